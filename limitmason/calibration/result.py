"""A fit: parameters, what the data say and do not say of them, what it predicts, what is still wrong."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.calibration.cross_validation import LeftOut
from limitmason.calibration.doubts import asked_beyond, strain
from limitmason.calibration.information import Information, NextTest, UnresolvedDirection, ranked
from limitmason.calibration.least_squares import Slopes
from limitmason.calibration.objective import Minimum, Objective
from limitmason.calibration.runs import Model, required, taken
from limitmason.calibration.simulated import Simulated, numbers_of
from limitmason.calibration.targets import check_candidates, check_scatters
from limitmason.causes.cause import check_causes
from limitmason.checks import finite
from limitmason.diagnosis import Cause, Diagnosis, Measured, Noise, Study
from limitmason.display.text_table import aligned
from limitmason.errors import InputError
from limitmason.storage.frozen import ReadOnly
from limitmason.study.workers import run_points

WIDE = 5.0
"""A fitted parameter that a diagnosis may refit is known to so many of its deviations: the data count twice by 4 %."""

LEVELS = 9
"""Most sizes of a cause at which a diagnosis of the residuals runs the models: few, as for models that are slow."""

MOST_REFITTED = 3
"""More parameters than these are not refitted unasked: every one multiplies the runs of a diagnosis by three."""

_LOOSE: Mapping[tuple[str, ...], str] = {("below",): "NOT from below", ("above",): "NOT from above"}
"""How a table calls a parameter that the data leave open on one side alone."""


class FittedRow(NamedTuple):
    """A number that was to be met: measured and fitted value in its unit, residual in standard deviations."""

    test: str
    quantity: str
    measured: float
    fitted: float
    residual: float


class Predicted(NamedTuple):
    """A prediction and the ends of its interval; the model's own error is not in it."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False, repr=False)
class Fit(ReadOnly):
    """Answer of :func:`limitmason.calibrate`.

    Parameters
    ----------
    objective : what was asked, and all that was tried
    minimum : the best that was found
    minima : where every start ended
    information : what the slopes at the best say
    slopes : at the best, with the moves they were taken over
    level : of the intervals [-]
    ends : profile interval of every parameter on the scale of the fit, infinite where only a bound ends it; None
        where intervals were not asked for
    left_out : errors on what was left out; None where nothing was
    groups : of the entries
    """

    objective: Objective
    minimum: Minimum
    minima: tuple[Minimum, ...]
    information: Information
    slopes: Slopes
    level: float
    ends: Array | None
    left_out: LeftOut | None
    groups: tuple[str, ...]
    warnings: tuple[str, ...] = ()

    @property
    def parameters(self) -> dict[str, float]:
        """Fitted values by name, ties not included."""
        return self.objective.scale.values(self.minimum.x)

    @property
    def tied(self) -> dict[str, float]:
        """All values by name, those tied to the fitted ones included."""
        return {k: float(v) for k, v in self.objective.runs.ties(self.parameters).items()}

    @property
    def interval(self) -> dict[str, tuple[float, float]]:
        """Profile interval of every parameter at ``level``.

        An end that is a bound says only that no other was found.

        Raises
        ------
        InputError
            Where intervals were not asked for.
        """
        if self.ends is None:
            raise InputError("intervals were not computed: calibrate(..., level=0.95)")
        out = {}
        for p, (low, high) in zip(self.objective.scale.parameters, self.ends, strict=True):
            out[p.name] = (p.bounds[0] if math.isinf(low) else p.value(low),
                           p.bounds[1] if math.isinf(high) else p.value(high))
        return out

    @property
    def deviation(self) -> dict[str, float]:
        """Deviation by name from the slopes over one deviation.

        It is that of the side that the data see less. For a parameter on a log scale it is relative. Where the data do
        not see a parameter it is infinite.
        """
        return dict(zip(self.objective.scale.names, self.information.deviation.tolist(), strict=True))

    @property
    def correlation(self) -> Array:
        """Correlation of the parameters in the order given, shape (p, p)."""
        return self.information.correlation

    @property
    def open_sides(self) -> dict[str, tuple[str, ...]]:
        """Sides on which the data set a parameter no end within its bounds, by name.

        A side is "below" or "above". It is open where the slopes see nothing, and where the parameter lies on its bound
        and the targets ask for values beyond. Where profile intervals were asked for, it is open if the interval ends
        at the bound alone and the deviation by the slopes is wider than the resolution.
        """
        scale = self.objective.scale
        deviation = self._strained.to_sides
        loose: Flags = ~np.isfinite(deviation)
        if self.ends is not None:
            loose = np.asarray(np.isinf(self.ends).T & (deviation > scale.resolution))
        loose = loose | asked_beyond(self.objective, self.minimum, self.slopes)
        return {n: ("below",) * bool(loose[0, k]) + ("above",) * bool(loose[1, k]) for k, n in enumerate(scale.names)}

    @property
    def identified(self) -> tuple[str, ...]:
        """Parameters that the data hold to within their resolution on both sides.

        By the ends of the interval, over the deviations of the level; where a bound lies within it, or none was asked
        for, by the slopes over one deviation. Targets that are missed by more than their stated scatter count as known
        to what they are missed by. A parameter on a bound beyond which they ask for values is not identified.
        """
        best = self.minimum
        held = self._held(strain(self.objective, best)) & ~asked_beyond(self.objective, best, self.slopes)
        return tuple(n for k, n in enumerate(self.objective.scale.names) if held[:, k].all())

    def _held(self, times: float = 1.0) -> Flags:
        """Which sides of the p parameters the data hold to within the resolution, shape (2, p).

        All deviations count ``times`` as wide as the scatter of the targets makes them.
        """
        scale, best = self.objective.scale, self.minimum
        resolution = scale.resolution / times
        held: Flags = self.information.to_sides <= resolution
        if self.ends is None:
            return held
        # an interval of the level reaches as many deviations as the rise is over the variance, the root of it
        reach = math.sqrt(self.objective.rise(best, self.level) / self.objective.variance(best)) * resolution
        away = np.abs(self.ends - best.x[:, None]).T
        return np.asarray(np.where(np.isinf(away), held, away <= reach))

    @property
    def _strained(self) -> Information:
        """What the slopes say where targets are known only to what they are missed by."""
        return replace(self.information, variance=self.information.variance * strain(self.objective, self.minimum) ** 2)

    @property
    def unidentified(self) -> tuple[UnresolvedDirection, ...]:
        """Moves of parameters that the data leave free, or none where all are identified."""
        return self._strained.unresolved_directions

    @property
    def misfit(self) -> float:
        """Sum of squared residuals in standard deviations [-]."""
        return self.minimum.chi2

    @property
    def rows(self) -> tuple[FittedRow, ...]:
        """Every number that was to be met, measured and fitted."""
        p = self.objective
        fitted, residual = p.predicted([self.minimum.x])[0], p.residuals([self.minimum.x])[0]
        return tuple(FittedRow(e.test, e.label, e.measured, float(f), float(r))
                     for e, f, r in zip(p.entries, fitted, residual, strict=True))

    def predict(self, other: Model, *, level: float | None = None) -> dict[str, Predicted]:
        """What another model gives at the fitted parameters, with the interval they leave.

        value exp(+- z d), d^2 = g' C g with z the normal quantile of the level, Student's where the scatter is not
        known, C the covariance of the parameters and g the slopes of the value's logarithm; value +- z d, by its own
        slopes, where it is not positive or one deviation of a parameter makes it so

        Parameters
        ----------
        other : takes some of the parameters, or those tied to them; of a curve the stiffness and the peak are given
        level : of the interval [-], above 0 and below 1; that of the fit where omitted

        Raises
        ------
        InputError
            For a level that is none, and a model that takes none of the parameters or gives no number.
        """
        if level is not None and not 0.0 < finite("level", level) < 1.0:
            raise InputError(f"level must lie between 0 and 1, got {level!r}")
        names, base, ratio, slopes = self._slopes(other)
        if lost := [n for n, v in zip(names, base.tolist(), strict=True) if not math.isfinite(v)]:
            raise InputError(f"the other model gives no finite {lost[0]!r} at the fitted parameters")
        spread = np.sqrt(np.einsum("ij,jk,ik->i", slopes, self.information.covariance, slopes))
        rise = self.objective.rise(self.minimum, self.level if level is None else level)
        reach = math.sqrt(rise / self.objective.variance(self.minimum)) * spread
        return {
            n: Predicted(v, v * math.exp(-r), v * math.exp(r)) if by_ratio else Predicted(v, v - r, v + r)
            for n, v, by_ratio, r in zip(names, base.tolist(), ratio, reach.tolist(), strict=True)
        }

    def _slopes(self, other: Model) -> tuple[list[str], Array, Flags, Array]:
        """Another model's numbers at the fit and their slopes by the parameters.

        Parameters
        ----------
        other : the model

        Returns
        -------
        names, values : of the k numbers
        ratio : whether a number is positive wherever it was asked for; its slopes are then those of its logarithm
        slopes : shape (k, p)
        """
        objective, x = self.objective, self.minimum.x
        known = (*objective.scale.names, *objective.runs.ties.formulas)
        if not callable(other):
            raise InputError(f"the other model must be a function of the parameters, got {other!r}")
        if not (takes := taken(other, known)):
            raise InputError(f"the other model takes none of the parameters {', '.join(objective.scale.names)}")
        if bare := [n for n in required(other) if n not in known]:
            raise InputError(f"the other model needs {bare[0]!r}, which was not fitted; known: {', '.join(known)}")
        # the fit itself, then a point above and one below it along each parameter: the moves of the fit's own slopes
        points, width = [x], []
        for k in range(len(x)):
            for move in (self.slopes.up[k], -self.slopes.down[k]):
                y = x.copy()
                y[k] = np.clip(x[k] + move, objective.scale.low[k], objective.scale.high[k])
                points.append(y)
            width.append(points[-2][k] - points[-1][k])
        tried = (objective.runs.ties(objective.scale.values(y)) for y in points)
        jobs = [(number, {"model": other, "parameters": {n: float(every[n]) for n in takes}})
                for number, every in enumerate(tried)]
        found = dict(run_points(numbers_of, jobs, objective.runs.executor, objective.runs.workers))
        names = list(found[0])
        if not names:
            raise InputError("the other model gives neither numbers nor curves")
        if lost := [n for f in found.values() for n in names if n not in f]:
            raise InputError(f"the other model gives {lost[0]!r} at the fit, and not one deviation of a parameter away")
        values = np.array([[found[number][n] for n in names] for number in range(len(points))])
        ratio = np.asarray((values > 0.0).all(axis=0))
        scaled = np.where(ratio, np.log(np.where(ratio, values, 1.0)), values)
        # from the point below to that above, along each parameter
        slopes = (scaled[1::2] - scaled[2::2]).T / width
        return names, values[0], ratio, slopes

    def next_test(self, candidates: Mapping[str, tuple[Model, Mapping[str, float]]]) -> NextTest:
        """Which further test would fix most of what is free.

        Parameters
        ----------
        candidates : by name, a model and the relative scatter with which each of its numbers would be measured; of a
            curve "curve: peak" and "curve: stiffness"

        Raises
        ------
        InputError
            For no candidates, a scatter outside 0 to 1, and a number that the model does not give, or that is 0.
        """
        check_candidates(candidates)
        so_far = self._strained
        slopes, deviation = {}, math.sqrt(so_far.variance)
        for name, (model, scatter) in candidates.items():
            given, values, ratio, rows = self._slopes(model)
            check_scatters(name, scatter, given)
            at = {q: k for k, q in enumerate(given)}
            if zero := [q for q in scatter if not values[at[q]]]:
                raise InputError(f"candidate {name!r}: {zero[0]!r} is 0, of which no relative scatter is told")
            # slopes of a number itself go with a scatter in its unit; a residual of the fit has its own deviation
            slopes[name] = np.array([
                deviation * rows[at[q]] / (sd if ratio[at[q]] else sd * abs(values[at[q]])) for q, sd in scatter.items()
            ])
        return ranked(so_far, slopes)

    def diagnose(
        self, causes: Iterable[Cause], *, refit: Sequence[str] | None = None, seed: int = 0,
        cache: str | Path | None = None, **options: Any,
    ) -> Diagnosis:
        """What is still wrong: the residuals of the fit handed to the diagnosis.

        Every number compared by its ratio is a specimen, with covariates "test" and "quantity"; the models run at the
        fitted parameters. A cause inside the model needs a model that takes its parameter as a keyword.

        Parameters
        ----------
        causes : see ``limitmason.causes``
        refit : parameters that may move with the causes: where omitted those that the stated scatter identifies, none
            of more than three. Each is known to five of its deviations, wider where the fit is bad. Without them what
            the fit has taken up is not seen, or is undone by a second cause
        seed : of the bootstrap
        cache : file that keeps the runs of the diagnosis
        options : of :meth:`limitmason.diagnosis.Study.diagnose`

        Raises
        ------
        InputError
            For fewer than four such numbers, two of known scatter, a name not fitted, or one that the data do not see.
        """
        p = self.objective
        kept = [k for k, e in enumerate(p.entries) if e.relative]
        if refit is None:
            sides = self._held()
            held = [n for k, n in enumerate(p.scale.names) if sides[:, k].all()]
            refit = held if len(held) <= MOST_REFITTED else ()
        # a fit that misses its targets by more than their scatter knows its parameters less well than its slopes say
        strained = math.sqrt(max(self.misfit / max(p.n - len(p.scale), 1), 1.0)) if p.known else 1.0
        nuisance = {}
        for name in refit:
            if name not in p.scale.names:
                raise InputError(f"{name!r} was not fitted; fitted: {', '.join(p.scale.names)}")
            own = p.scale.parameters[p.scale.names.index(name)]
            sd = self.deviation[name] * (self.parameters[name] if own.log else 1.0)
            if not math.isfinite(sd):
                raise InputError(f"the data do not see {name!r}: leave it out of refit")
            nuisance[name] = Measured(self.parameters[name], WIDE * strained * sd, own.bounds)
        simulate = Simulated(
            models=p.runs.models, readings=p.runs.readings, at=self.parameters, ties=p.runs.ties,
            given=(*p.scale.names, *p.runs.ties.formulas),
        )
        specimens = [
            {"test": p.entries[k].test, "quantity": p.entries[k].label, "model": p.model_of[k], "place": p.place_of[k]}
            for k in kept
        ]
        noise = Noise(tuple(float(s) for s in p.deviation[kept])) if p.known else Noise.unknown()
        study = Study(
            specimens=specimens, simulate=simulate, measured=[p.entries[k].measured for k in kept], noise=noise,
            nuisance=nuisance, covariates=("test", "quantity"), levels=LEVELS, causes=check_causes(causes), cache=cache,
            n_jobs=p.runs.workers,
        )
        return study.diagnose(seed=seed, **options)

    def __str__(self) -> str:
        """The error on what was left out, the parameters, and what the data cannot tell."""
        lines = []
        if self.left_out is not None and any(r.relative for r in self.left_out.rows):
            by = self.left_out.by
            lines.append(f"error on what was left out ({by} by {by}): {self.left_out.error:.1%}")
        n, p = self.objective.n, len(self.objective.scale)
        lines.append(f"misfit {self.misfit:.3g} of {n} numbers with {p} parameters")
        table = [["parameter", "unit", "value", f"{self.level:.0%} interval", "deviation", "identified"]]
        for k, own in enumerate(self.objective.scale.parameters):
            ends = "-"
            if self.ends is not None:
                low, high = self.interval[own.name]
                open_low, open_high = np.isinf(self.ends[k])
                ends = f"{'bound ' if open_low else ''}{low:.4g} to {'bound ' if open_high else ''}{high:.4g}"
            sd = self.deviation[own.name]
            shown = "not seen" if math.isinf(sd) else f"{sd:.1%}" if own.log else f"{sd:.3g}"
            held = "yes" if own.name in self.identified else _LOOSE.get(self.open_sides[own.name], "NO")
            table.append([own.name, own.unit, f"{self.parameters[own.name]:.5g}", ends, shown, held])
        lines.append(aligned(table, "<<><>>"))
        lines += [f"free: {c}" for c in self.unidentified]
        return "\n".join([*lines, *(f"warning: {w}" for w in self.warnings)])

    __repr__ = __str__
