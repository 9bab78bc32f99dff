"""Misfit of models and targets as a function of the parameters, and every point at which it was asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import stats

from limitmason.arrays import Array, Flags
from limitmason.calibration.parameter import ParameterScale
from limitmason.calibration.runs import Runs
from limitmason.calibration.targets import Entry
from limitmason.display.progress import noted
from limitmason.errors import NotConverged
from limitmason.storage.frozen import ReadOnly

LOST = 30.0
"""Misfit counted for a number that the model does not give, in standard deviations: a wall, not a slope."""

_EXACT = 1e-24  # sum of squares below which a fit is exact: no variance may be zero, it is divided by
_LARGEST = 1e100  # of a misfit: the square of one that is larger would overflow


@dataclass(frozen=True, eq=False)
class Minimum(ReadOnly):
    """A point at which the misfit was asked, such as that where a search ended.

    Parameters
    ----------
    x : parameters on the scale of the fit, shape (p,)
    residuals : misfits there in standard deviations, shape (n,)
    converged : whether the search ended by itself, not at its limit of steps
    """

    x: Array
    residuals: Array
    converged: bool = True

    @cached_property
    def chi2(self) -> float:
        """Sum of the squared residuals [-]."""
        return float(self.residuals @ self.residuals)


@dataclass(frozen=True, eq=False)
class Objective(ReadOnly):
    """Entries, each with its deviation, the model of each, and the scale of the parameters.

    Parameters
    ----------
    scale : names, bounds and starts of the p parameters
    entries : the n measured numbers that are to be met
    model_of : number of the model that predicts each entry, among those of ``runs``
    place_of : place of each entry among what is read of its model
    deviation : standard deviation of every misfit, relative or in the unit of the entry, shape (n,)
    known : whether the deviations were stated
    runs : the models with the memory of their answers
    tried : every point that was asked for, in order
    """

    scale: ParameterScale
    entries: tuple[Entry, ...]
    model_of: tuple[int, ...]
    place_of: tuple[int, ...]
    deviation: Array
    known: bool
    runs: Runs
    tried: list[Minimum] = field(default_factory=list)

    @property
    def n(self) -> int:
        """Number of entries."""
        return len(self.entries)

    @property
    def best(self) -> Minimum:
        """The least misfit of all points tried."""
        return min(self.tried, key=lambda m: m.chi2)

    def variance(self, best: Minimum) -> float:
        """Variance of a residual [-]: 1 where the scatter is known, else chi2 / (n - p).

        Parameters
        ----------
        best : point whose sum of squares tells it
        """
        return 1.0 if self.known else max(best.chi2, _EXACT) / max(self.n - len(self.scale), 1)

    def rise(self, best: Minimum, level: float) -> float:
        """By how much the sum of squares rises to the ends of an interval [-].

        It is the quantile of chi squared with one degree of freedom where the scatter is known. Else it is that of
        F(1, n - p) times the variance of a residual.

        Parameters
        ----------
        best : the fit
        level : confidence of the interval [-]
        """
        if self.known:
            return float(stats.chi2.ppf(level, 1))
        return float(stats.f.ppf(level, 1, self.n - len(self.scale))) * self.variance(best)

    def only(self, kept: Flags) -> Objective:
        """The objective of some of the entries, at the points tried so far.

        Parameters
        ----------
        kept : which entries, shape (n,)
        """
        at = np.flatnonzero(kept)
        part = replace(
            self, entries=tuple(self.entries[k] for k in at), model_of=tuple(self.model_of[k] for k in at),
            place_of=tuple(self.place_of[k] for k in at), deviation=self.deviation[at], tried=[],
        )
        part.tried.extend(replace(m, residuals=m.residuals[at]) for m in self.tried)
        return part

    def predicted(self, points: Sequence[Array]) -> Array:
        """Predictions of all entries at k vectors of parameters, shape (k, n), or NaN.

        Parameters
        ----------
        points : vectors, shape (p,) each
        """
        models = sorted(set(self.model_of))
        found = self.runs([self.scale.values(x) for x in points], models)
        at = [models.index(m) for m in self.model_of]
        return np.array([[row[m][p] for m, p in zip(at, self.place_of, strict=True)] for row in found])

    def residuals(self, points: Sequence[Array]) -> Array:
        """Misfits in standard deviations at several points, shape (k, n).

        They are ``LOST`` where the model gives no number. ``points`` are vectors of parameters on the scale of the fit,
        shape (p,) each.
        """
        found = self.predicted(points)
        raw = np.array([[e.misfit(v) for e, v in zip(self.entries, row, strict=True)] for row in found])
        out = np.clip(np.nan_to_num(raw / self.deviation, nan=LOST), -_LARGEST, _LARGEST)
        self.tried.extend(Minimum(np.array(x), r) for x, r in zip(points, out, strict=True))
        self.runs.tell(self._so_far())
        return out

    def at(self, x: Array) -> Array:
        """Misfits in standard deviations at one vector of parameters, shape (n,)."""
        return np.asarray(self.residuals([x])[0])

    def refuse_lost(self, best: Minimum) -> None:
        """Refuse a minimum at which the model gives no number for a target.

        What is left of the targets would pass for a fit.

        Parameters
        ----------
        best : the minimum

        Raises
        ------
        NotConverged
            Naming the targets, where that is, and in how many runs the first of them had a number.
        """
        lost = [k for k, r in enumerate(best.residuals) if r == LOST]
        if not lost:
            return
        values, names = self.scale.values(best.x), ", ".join(repr(self.entries[k].label) for k in lost)
        had = sum(m.residuals[lost[0]] != LOST for m in self.tried)
        why = self.runs.note(values, self.model_of[lost[0]]) or "it is not finite, or not positive as the target is"
        raise NotConverged(
            f"the model gives no number for {names} at the least misfit, "
            f"{', '.join(f'{n} {v:.4g}' for n, v in values.items())}: {why}. {had} of {len(self.tried)} points gave "
            "one: "
            + ("keep the bounds to where it answers" if had else "leave the target out, or mend the model")
        )

    def say(self, stage: str, *, now: bool = False) -> None:
        """Name the stage for lines of progress, and write one ``now`` if asked."""
        self.runs.stage, self.runs.best = stage, self._so_far()
        if now:
            noted(stage + self.runs.best)
            if self.runs.progress is not None:
                self.runs.progress(stage + self.runs.best)

    def _so_far(self) -> str:
        """The least misfit and where it lies, in words; empty before the first run."""
        if not self.tried:
            return ""
        best = self.best
        return f"; best misfit {best.chi2:.4g} at " + ", ".join(
            f"{k} {v:.4g}" for k, v in self.scale.values(best.x).items()
        )
