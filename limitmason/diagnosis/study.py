"""A study: specimens, what was measured on them, what is known of the errors, and the simulator to be questioned."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.diagnosis.cause import Cause, cause_pairs, check_causes
from limitmason.diagnosis.inference.bootstrap import DRAWS, Draws
from limitmason.diagnosis.inference.decide import Rule, Verdict, decide
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.grid import Table, at_measured
from limitmason.diagnosis.inference.noise import Measured, Noise
from limitmason.diagnosis.inference.plan import Confusable, NextTests, confusable
from limitmason.diagnosis.inference.shapes import Shapes
from limitmason.diagnosis.rehearse import Rehearsal, rehearse
from limitmason.diagnosis.simulator import Simulator
from limitmason.diagnosis.suggest import suggest
from limitmason.diagnosis.tabulate import Tabulator
from limitmason.diagnosis.verdict import Diagnosis

ASSUMED_NOISE = 0.04  # places levels and nodes, and scales distances, where the noise is unknown
PAIR_TABLES = ("verified", "exact", "additive")
PAIR_ERROR = 0.25  # of the noise: largest error of an additive pair table
PAIR_NEAR = 6.0  # log-likelihood deficit within which a pair is verified
ROUNDS = 6


class Study:
    """Measured values against a simulator.

    Parameters
    ----------
    specimens : one per measured value; a mapping of covariates, or any object that ``simulate`` understands
    simulate : ``simulate(specimen, **parameters)``, a positive prediction of what was measured
    measured : positive values, shape (n,); None for planning
    noise : relative error of the measured values
    nuisance : inputs of the simulator that were measured separately, with their errors
    covariates : names to read from each specimen, or a mapping of names to n values
    groups : label of the configuration of each specimen: repeats share one
    levels : most sizes per cause at which the simulator is called; 9 and fewer for a slow or a jumpy one
    nuisance_levels : values of each measured input at which it is called; None is 5 for one input, 3 for more
    cache, n_jobs, version : see :class:`~limitmason.diagnosis.simulator.Simulator`
    pair_tables : "verified" adds the logarithms of single effects, checks every pair that comes near and tabulates it
        truly where that fails; "exact" tabulates every pair truly; "additive" never calls the simulator for a pair
    crossed : "full", or "corners" for few calls of a slow simulator: cause and measured inputs are then combined from
        their own effects and the corners; ``limitmason.diagnosis.simulate.SLOW`` sets all options of that kind

    Raises
    ------
    ValueError
        For lengths that do not match, measured values that are not positive, or a covariate that a specimen lacks.

    Notes
    -----
    Tables are made once and shared by every verdict on the same specimens; ``simulator.calls`` counts the calls.
    """

    def __init__(
        self,
        specimens: Sequence[Any],
        simulate: Callable[..., float],
        measured: Sequence[float] | None = None,
        noise: Noise | None = None,
        nuisance: Mapping[str, Measured] | None = None,
        covariates: Iterable[str] | Mapping[str, Sequence] = (),
        groups: Sequence | None = None,
        *,
        levels: int = 17,
        nuisance_levels: int | None = None,
        cache: str | Path | None = None,
        n_jobs: int = 1,
        version: str = "",
        pair_tables: str = "verified",
        crossed: str = "full",
    ):
        self.specimens = list(specimens)
        n = len(self.specimens)
        if n < 4:
            raise ValueError(f"at least 4 specimens are needed, got {n}")
        if pair_tables not in PAIR_TABLES:
            raise ValueError(f"pair_tables must be one of {PAIR_TABLES}, got {pair_tables!r}")
        self.noise = noise if noise is not None else Noise.unknown()
        self.scale = self.noise.scale(n)
        self.measured = None if measured is None else _positive(measured, n)
        self.covariates = _covariates(covariates, self.specimens)
        if groups is not None and len(groups) != n:
            raise ValueError(f"groups has {len(groups)} labels for {n} specimens")
        self.groups = None if groups is None else list(groups)
        self.nuisance = dict(nuisance or {})
        for name, value in self.nuisance.items():
            if not isinstance(value, Measured):
                raise ValueError(f"nuisance {name!r} must be Measured(value, sd), got {value!r}")
        self.pair_tables = pair_tables
        self.simulator = Simulator(simulate, self.specimens, cache=cache, n_jobs=n_jobs, version=version)
        placing = self.scale if self.noise.kind != "unknown" else np.full(n, ASSUMED_NOISE)
        self.tabulator = Tabulator(
            self.simulator, self.nuisance, placing, levels=levels, nuisance_levels=nuisance_levels, crossed=crossed
        )
        self._tables: dict[Any, Table] = {}
        self._true_pairs: set[frozenset] = set()
        self._designs: dict[tuple[Cause, ...], Design] = {}

    @property
    def n(self) -> int:
        """Number of specimens."""
        return len(self.specimens)

    def with_measured(self, measured: Sequence[float]) -> "Study":
        """The same study, tables included, with other measured values."""
        out = object.__new__(Study)
        out.__dict__.update(self.__dict__)
        out.measured = _positive(measured, self.n)
        return out

    def with_noise(self, noise: Noise) -> "Study":
        """The same study, tables included, with another statement of the noise."""
        out = object.__new__(Study)
        out.__dict__.update(self.__dict__)
        out.noise, out.scale, out._designs = noise, noise.scale(self.n), {}
        return out

    def baseline(self) -> np.ndarray:
        """Prediction of the baseline at the measured inputs, shape (n,)."""
        table = self._base()
        return np.exp(at_measured(table))

    def predicted(self, causes: Iterable[Cause], sizes: Iterable[float], z: Iterable[float] = ()) -> np.ndarray:
        """Prediction with given causes switched on, by the simulator itself, shape (n,).

        Parameters
        ----------
        causes, sizes : one or two causes and their sizes
        z : measured inputs in standard deviations from their values; none is the values themselves
        """
        z = tuple(z) or tuple(0.0 for _ in self.tabulator.free)
        return np.exp(self.tabulator.evaluate(tuple(causes), [(tuple(sizes), z)])[0])

    def design(self, causes: Iterable[Cause]) -> Design:
        """Tables of the design for a list of causes; made on the first call."""
        causes = check_causes(causes, self.nuisance)
        if causes not in self._designs:
            base = self._base()
            origin = at_measured(base)
            by_name = {c.name: c for c in causes}
            singles = {c.name: self.table(c).whitened(origin, self.scale) for c in causes}
            pairs = tuple((a.name, b.name) for a, b in cause_pairs(causes))

            def pair_table(names: Names) -> Table:
                return self._pair(by_name[names[0]], by_name[names[1]])

            self._designs[causes] = Design(
                causes,
                self.noise,
                self.scale,
                origin,
                base.whitened(origin, self.scale),
                singles,
                Shapes(self.covariates, self.scale),
                pair_table,
                pairs,
            )
        return self._designs[causes]

    def table(self, cause: Cause) -> Table:
        """Table of one cause; made on the first call."""
        if cause not in self._tables:
            self._tables[cause] = self.tabulator.single(cause)
        return self._tables[cause]

    def diagnose(
        self,
        causes: Iterable[Cause],
        seed: int = 0,
        *,
        draws: int = DRAWS,
        pairs: bool = True,
        rule: Rule | None = None,
    ) -> Diagnosis:
        """Say what the simulation gets wrong, or that the data cannot tell.

        Parameters
        ----------
        causes : the list that the verdict is conditional on; measurement causes belong to every list
        seed : of the bootstrap; the same seed gives the same verdict
        draws : most bootstrap draws
        pairs : whether two causes are tried when no single one is left
        rule : thresholds

        Raises
        ------
        ValueError
            Without measured values.
        """
        if self.measured is None:
            raise ValueError("the study has no measured values: it can plan (confusable, rehearse), not diagnose")
        causes = check_causes(causes, self.nuisance)
        design = self.design(causes)
        chances = Draws.make([seed, self.n], self.n, design.inputs, self.noise, draws)
        y = design.whiten(self.measured)
        verdict = decide(design, y, chances, rule, pairs)
        if self.pair_tables == "verified":
            for _ in range(ROUNDS):
                if not self._verify(design, verdict):
                    break
                verdict = decide(design, y, chances, rule, pairs)
        return Diagnosis(self, causes, design, y, verdict, seed, chances, rule or Rule()).checked_by_group()

    def confusable(self, causes: Iterable[Cause], *, sd: float | None = None) -> Confusable:
        """Which causes this design tells apart, without any data.

        Parameters
        ----------
        causes : the list
        sd : relative noise to assume where the study does not state it
        """
        return confusable(self.known_design(causes, sd))

    def known_design(self, causes: Iterable[Cause], sd: float | None = None) -> Design:
        """The design with a known noise: as stated, or ``sd``, or 4 % where nothing is stated."""
        design = self.design(causes)
        if sd is None and self.noise.kind != "unknown":
            return design
        noise = Noise(sd if sd is not None else ASSUMED_NOISE)
        return design.with_noise(noise, noise.scale(self.n), self.covariates)

    def rehearse(
        self,
        causes: Iterable[Cause],
        n: int = 200,
        *,
        seed: int = 0,
        sd: float | None = None,
        pairs: bool = True,
        progress: Callable[[str], None] | None = None,
    ) -> Rehearsal:
        """Confusion matrix of blind trials on this very design.

        Parameters
        ----------
        causes : the list; one trial in four hides nothing, the others one of these causes of random visible size
        n : trials
        seed : of truths, noise and bootstrap
        sd : relative noise to draw where the study does not state it
        pairs : whether two causes are tried when no single one is left, as ``diagnose`` does; without, no table of a
            pair is made and such trials end as "unexplained"
        progress : told after each trial in a line what was hidden and what was found
        """
        return rehearse(self, check_causes(causes, self.nuisance), n, seed, sd, pairs, progress)

    def plan(self, causes: Iterable[Cause], pool: Sequence[Any], k: int = 4) -> NextTests:
        """Specimens of a pool that would tell the causes of the list apart, before anything is measured."""
        causes = check_causes(causes, self.nuisance)
        return suggest(self, causes, pool, k)

    def on(self, specimens: Sequence[Any]) -> "Study":
        """A study of other specimens with the same simulator, inputs and noise (its mean where it differs)."""
        noise = self.noise
        if isinstance(noise.sd, tuple):
            noise = Noise(float(np.mean(noise.sd)), noise.dof, noise.tails)
        if len(specimens) < 1:
            raise ValueError("the pool of specimens is empty")
        out = object.__new__(Study)
        out.__dict__.update(self.__dict__)
        out.specimens, out.measured, out.noise = list(specimens), None, noise
        out.scale, out.groups, out.covariates = noise.scale(len(specimens)), None, {}
        out.simulator = self.simulator.on(out.specimens)
        placing = out.scale if noise.kind != "unknown" else np.full(out.n, ASSUMED_NOISE)
        count = len(self.tabulator.z_levels[0]) if self.tabulator.z_levels else None
        out.tabulator = Tabulator(
            out.simulator, self.nuisance, placing, levels=self.tabulator.levels, nuisance_levels=count,
            crossed=self.tabulator.crossed,
        )  # fmt: skip
        out._tables, out._true_pairs, out._designs = {}, set(), {}
        return out

    def _base(self) -> Table:
        if None not in self._tables:
            self._tables[None] = self.tabulator.baseline()
        return self._tables[None]

    def _pair(self, first: Cause, second: Cause) -> Table:
        key = frozenset((first, second))
        if key not in self._tables:
            exact = self.pair_tables == "exact" or key in self._true_pairs
            self._tables[key] = self.tabulator.pair(self.table(first), self.table(second), self._base(), exact=exact)
        return self._tables[key]

    def _verify(self, design: Design, verdict: Verdict) -> bool:
        """Check additive tables of pairs near the best against the true pair; True when one had to be replaced."""
        by_name = {c.name: c for c in design.causes}
        replaced = False
        for names, tested in verdict.tested.items():
            if len(names) != 2 or tested.deficit > PAIR_NEAR:
                continue
            first, second = by_name[names[0]], by_name[names[1]]
            key = frozenset((first, second))
            if key in self._true_pairs or (first.transforms and second.transforms):
                continue
            table = self._pair(first, second)
            z = tuple(float(np.clip(v, a[0], a[-1])) for v, a in zip(tested.z, table.z, strict=True))
            half = tuple(0.5 * (c.baseline + s) for c, s in zip((first, second), tested.sizes, strict=True))
            errors = [self.tabulator.pair_error(table, at, z) for at in (tested.sizes, half)]
            if max(errors) > PAIR_ERROR:
                self._true_pairs.add(key)
                del self._tables[key]
                design.forget_pair(names)
                replaced = True
        return replaced


def _positive(values: Sequence[float], n: int) -> np.ndarray:
    out = np.asarray(values, dtype=float)
    if out.shape != (n,):
        raise ValueError(f"measured must have one value per specimen ({n}), got shape {out.shape}")
    bad = np.flatnonzero(~(np.isfinite(out) & (out > 0)))
    if len(bad):
        raise ValueError(f"measured values must be positive and finite; specimen {bad[0]} has {out[bad[0]]!r}")
    return out


def _covariates(given: Iterable[str] | Mapping[str, Sequence], specimens: list) -> dict[str, list]:
    if isinstance(given, Mapping):
        out = {str(k): list(v) for k, v in given.items()}
    else:
        out = {}
        for name in given:
            out[name] = []
            for i, s in enumerate(specimens):
                try:
                    out[name].append(s[name] if isinstance(s, Mapping) else getattr(s, name))
                except (KeyError, AttributeError):
                    raise ValueError(f"covariate {name!r} is not recorded for specimen {i}") from None
    for name, column in out.items():
        if len(column) != len(specimens):
            raise ValueError(f"covariate {name!r} has {len(column)} values for {len(specimens)} specimens")
    return out
