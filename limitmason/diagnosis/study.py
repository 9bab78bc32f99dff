"""A study: specimens, what was measured on them, what is known of the errors, and the simulator to be questioned."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, InitVar, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.causes.cause import Cause, check_causes
from limitmason.diagnosis.answer import Answer
from limitmason.diagnosis.from_table import About, study_arguments
from limitmason.diagnosis.inference.bootstrap import DRAWS, Draws
from limitmason.diagnosis.inference.decide import Rule
from limitmason.diagnosis.inference.design import Design
from limitmason.diagnosis.inference.gain import folds_of
from limitmason.diagnosis.inference.grid import Table, at_measured
from limitmason.diagnosis.inference.judge import Judge
from limitmason.diagnosis.inference.noise import Measured, Noise
from limitmason.diagnosis.inference.plan import Confusable, NextTests, confusable
from limitmason.diagnosis.inference.shared import Shares, estimated_shares, sharing, unrecorded
from limitmason.diagnosis.inference.verdict import VerdictKind
from limitmason.diagnosis.rehearse import Rehearsal, planted, rehearse
from limitmason.diagnosis.result import Diagnosis, checked_by_group
from limitmason.diagnosis.simulator import Simulator
from limitmason.diagnosis.specimens import called, covariates_of, positive_values
from limitmason.diagnosis.suggest import suggest
from limitmason.diagnosis.tables import ASSUMED_NOISE, Made, PoolGrids, Tables, placing_noise
from limitmason.diagnosis.tabulate import Tabulator
from limitmason.errors import InputError
from limitmason.experiments.measured_table import MeasuredTable
from limitmason.progress import reached, watched

FEWEST = 4  # specimens
ROUNDS = 6
STATEMENTS = ("measured", "noise", "groups", "covariates", "causes", "about", "shared")  # no table depends on them


@dataclass(frozen=True, eq=False, repr=False)
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
    shared : covariates whose labels may share a part of the noise: its share is estimated and carried. None takes
        those that by name are circumstances of a test (batch, day, operator, sensor, set-up, ...) and that no listed
        cause is about, and holds an alarm against noise shared unrecorded where no column tells batch, day or set-up;
        () takes all noise as independent
    levels : most sizes per cause at which the simulator is called; 9 and fewer for a slow or a jumpy one
    nuisance_levels : values of each measured input at which it is called; None is 5 for one input, 3 for more
    cache, n_jobs, version : see :class:`~limitmason.diagnosis.simulator.Simulator`
    pair_tables : "verified" adds the logarithms of single effects, checks every pair that comes near and tabulates it
        truly where that fails; "exact" tabulates every pair truly; "additive" never calls the simulator for a pair
    crossed : "full", or "corners" for few calls of a slow simulator: cause and measured inputs are then combined from
        their own effects and the corners; ``limitmason.diagnosis.simulate.SLOW`` sets all options of that kind
    causes : list that is taken where none is named
    about : title, units and notes for reports
    made : tables of the study that this one is a variant of; see :meth:`replace`

    Raises
    ------
    InputError
        For lengths that do not match, measured values that are not positive, or a covariate that a specimen lacks.

    Notes
    -----
    A study does not change; :meth:`replace` gives another. Tables are made once and shared by every verdict on the same
    specimens; ``simulator.calls`` counts the calls.
    """

    specimens: Sequence[Any]
    simulate: Callable[..., float]
    measured: Sequence[float] | np.ndarray | None = None
    noise: Noise | None = None
    nuisance: Mapping[str, Measured] | None = None
    covariates: Iterable[str] | Mapping[str, Sequence] = ()
    groups: Sequence | None = None
    shared: Sequence[str] | None = None
    _: KW_ONLY
    levels: int = 17
    nuisance_levels: int | None = None
    cache: str | Path | None = None
    n_jobs: int = 1
    version: str = ""
    pair_tables: str = "verified"
    crossed: str = "full"
    causes: tuple[Cause, ...] = ()
    about: About = field(default_factory=About)
    made: InitVar[Made | None] = None
    scale: np.ndarray = field(init=False)
    tables: Tables = field(init=False)
    _made: Made = field(init=False)

    def __post_init__(self, made: Made | None) -> None:
        specimens = tuple(self.specimens)
        n = len(specimens)
        if n < FEWEST:
            raise InputError(f"at least {FEWEST} specimens are needed, got {n}")
        noise = self.noise if self.noise is not None else Noise.unknown()
        nuisance = dict(self.nuisance or {})
        covariates = covariates_of(self.covariates, specimens)
        if unknown := [name for name in self.shared or () if name not in covariates]:
            raise InputError(f"shared names {unknown[0]!r}, which is no covariate; known: {', '.join(covariates)}")
        for name, value in nuisance.items():
            if not isinstance(value, Measured):
                raise InputError(f"nuisance {name!r} must be Measured(value, sd), got {value!r}")
        if self.groups is not None and len(self.groups) != n:
            raise InputError(f"groups has {len(self.groups)} labels for {n} specimens")
        fixed = {
            "specimens": specimens,
            "noise": noise,
            "scale": noise.scale(n),
            "measured": None if self.measured is None else positive_values(self.measured, n),
            "covariates": covariates,
            "shared": None if self.shared is None else tuple(self.shared),
            "groups": None if self.groups is None else list(self.groups),
            "nuisance": nuisance,
        }
        for name, value in fixed.items():
            object.__setattr__(self, name, value)
        made = made or Made(self._new_tables(), {})
        object.__setattr__(self, "tables", made.tables)
        object.__setattr__(self, "_made", made)

    def _new_tables(self) -> Tables:
        simulator = Simulator(
            self.simulate, self.specimens, cache=self.cache, n_jobs=self.n_jobs, version=self.version
        )  # fmt: skip
        placing = placing_noise(self.noise, self.n)
        tabulator = Tabulator(
            simulator, self.nuisance, placing, levels=self.levels, nuisance_levels=self.nuisance_levels,
            crossed=self.crossed,
        )  # fmt: skip
        return Tables(tabulator, self.pair_tables)

    @classmethod
    def from_table(
        cls,
        table: str | Path | MeasuredTable | None = None,
        *,
        cache: str | Path | None = None,
        n_jobs: int = 1,
        **stated: Any,
    ) -> Study:
        """A study of measured values in a table, with its causes, noise and units.

        Parameters
        ----------
        table : CSV file with names, a line of units and one row per measured value; None is the packaged series
            that ``model`` names
        cache, n_jobs : as for the study
        stated : ``model``, a packaged series or ``simulate(specimen, **parameters)``; without one the predictions stand
            in a column (``predicted``, and ``towards`` columns of a second model). Columns: ``measured``, ``group``,
            ``covariates`` (all that are left), ``shared`` (those of them whose labels share noise, see the study) and
            ``batches``, whose labels may be read by another gain. What is
            known: ``noise`` (a :class:`Noise`, a relative error, "replicates", "unknown"; else the column "noise"),
            ``dof`` and ``tails`` of it, ``inputs``, measured inputs of the model by name. ``causes``, causes or their
            names; else all that fit the model, with ``tilting`` for tangents of a tilt angle and ``spatial`` for walls
            that do not work in one plane. ``method`` and ``settings`` of a packaged series; ``levels``, ``title``

        Raises
        ------
        InputError
            Naming file, row and column of what is wrong.
        """
        return cls(cache=cache, n_jobs=n_jobs, **study_arguments(table, **stated))

    @classmethod
    def from_experiments(cls, series: str, **stated: Any) -> Study:
        """A study of a packaged series by its own models or published predictions; see :meth:`from_table`."""
        return cls.from_table(None, model=series, **stated)

    @property
    def n(self) -> int:
        """Number of specimens."""
        return len(self.specimens)

    @property
    def simulator(self) -> Simulator:
        """The calls of the simulator, counted and kept."""
        return self.tabulator.simulator

    @property
    def tabulator(self) -> Tabulator:
        """What makes the tables."""
        return self.tables.tabulator

    def replace(self, **changes: Any) -> Study:
        """The same study with other arguments.

        Tables are kept where only what was measured is stated otherwise: measured values, noise, groups, covariates.
        Their levels then stay where the noise first stated has put them. Other specimens begin without measured values
        and groups, and their covariates are read anew.
        """
        if "specimens" in changes:
            changes = {"measured": None, "groups": None, "covariates": tuple(self.covariates), **changes}
        if not set(changes) <= set(STATEMENTS):
            return dataclasses.replace(self, **changes)
        if set(changes) & {"noise", "covariates"}:
            return dataclasses.replace(self, **changes, made=Made(self.tables, {}))
        made = self._made
        if "groups" in changes:
            made = Made(self.tables, made.designs)
        return dataclasses.replace(self, **changes, made=made)

    def with_measured(self, measured: Sequence[float]) -> Study:
        """The same study, tables included, with other measured values."""
        return self.replace(measured=measured)

    def with_noise(self, noise: Noise) -> Study:
        """The same study, tables included, with another statement of the noise."""
        return self.replace(noise=noise)

    def baseline(self) -> np.ndarray:
        """Prediction of the baseline at the measured inputs, shape (n,)."""
        return np.exp(at_measured(self.tables.base()))

    def predicted(self, causes: Iterable[Cause], sizes: Iterable[float], z: Iterable[float] = ()) -> np.ndarray:
        """Prediction with given causes switched on, by the simulator itself, shape (n,).

        Parameters
        ----------
        causes, sizes : one or two causes and their sizes
        z : measured inputs in standard deviations from their values; none is the values themselves
        """
        z = tuple(z) or tuple(0.0 for _ in self.tabulator.free)
        return np.exp(self.tabulator.evaluate(tuple(causes), [(tuple(sizes), z)])[0])

    def _listed(self, causes: Iterable[Cause] | None) -> tuple[Cause, ...]:
        return check_causes(self.causes if causes is None else causes, self.nuisance)

    def design(self, causes: Iterable[Cause] | None = None) -> Design:
        """Tables of the design for a list of causes; made on the first call."""
        causes = self._listed(causes)
        designs = self._made.designs
        if causes not in designs:
            designs[causes] = self.tables.design(causes, self.noise, self.scale, self.covariates)
        return designs[causes]

    def judge(self, causes: Iterable[Cause] | None = None, rule: Rule | None = None) -> Judge:
        """What judges data of this design by a list, noise taken as independent; it keeps its rehearsal."""
        causes, rule = self._listed(causes), rule or Rule()
        if (causes, rule) not in self._made.judges:
            self._made.judges[causes, rule] = self._judge(causes, rule, self.design(causes))
        return self._made.judges[causes, rule]

    def _judge(
        self, causes: tuple[Cause, ...], rule: Rule, design: Design, rehearsed: Judge | None = None
    ) -> Judge:  # fmt: skip
        def known(sd: float) -> Design:
            return design if self.noise.kind != "unknown" else self.known_design(causes, sd)

        return Judge(
            design, known, self.covariates, folds_of(self.groups, self.n), rule, rehearsed=rehearsed,
            unrecorded=self.unrecorded,
        )  # fmt: skip

    @property
    def unrecorded(self) -> tuple[str, ...]:
        """Circumstances that no column tells and that tests may share: of batch, day and set-up; see ``shared``."""
        return unrecorded(self.covariates) if self.shared is None else ()

    def shares(self, causes: Iterable[Cause] | None = None, *, price: float | None = None) -> Shares:
        """Shares of the noise within the labels of :attr:`shared`, estimated from the measured values.

        Parameters
        ----------
        causes : the list
        price : None for shares at the baseline; else they are those beside the best explanation, each cause of which
            must improve the log-likelihood by this much
        """
        if self.measured is None:
            raise InputError("the study has no measured values to estimate shares of the noise from")
        causes = self._listed(causes)
        design = self.design(causes)
        named = {n: self.covariates[n] for n in self.shared or ()}
        return estimated_shares(
            design, design.whiten(self.measured), self.covariates if self.shared is None else named,
            every=self.shared is not None, price=price,
        )  # fmt: skip

    def _carrying(self, causes: tuple[Cause, ...], rule: Rule, shares: Shares) -> Judge:
        """What judges with some shares of the noise; margins are those of independent noise."""
        judge = self.judge(causes, rule)
        if not shares.shares:
            return judge
        mixed = sharing(judge.design, shares.correlation, self.covariates)
        return self._judge(causes, rule, mixed, judge)

    def table(self, cause: Cause) -> Table:
        """Table of one cause; made on the first call."""
        return self.tables.single(cause)

    @watched("diagnosis")
    def diagnose(
        self,
        causes: Iterable[Cause] | None = None,
        seed: int = 0,
        *,
        draws: int = DRAWS,
        pairs: bool = True,
        rule: Rule | None = None,
    ) -> Answer:
        """Say what the simulation gets wrong, or that the data cannot tell.

        Parameters
        ----------
        causes : the list that the verdict is conditional on; measurement causes belong to every list. None is that of
            the study
        seed : of the bootstrap; the same seed gives the same verdict
        draws : most bootstrap draws
        pairs : whether two causes are tried when no single one is left
        rule : thresholds

        Raises
        ------
        InputError
            Without measured values.
        """
        if self.measured is None:
            raise InputError("the study has no measured values: it can plan (confusable, rehearse), not diagnose")
        causes = self._listed(causes)
        reached(None, "tables")
        design, rule = self.design(causes), rule or Rule()
        reached(None, "verdict")
        chances = Draws.make([seed, self.n], self.n, design.inputs, self.noise, draws)
        y = design.whiten(self.measured)
        shares = self.shares(causes)
        judge = self._carrying(causes, rule, shares)
        alarm = judge.gate(judge.design.turned(y), chances)
        if alarm.kind == VerdictKind.UNEXPLAINED and shares.looked_at:
            shares = self.shares(causes, price=alarm.critical_gain)
            judge = self._carrying(causes, rule, shares)
        verdict = judge(judge.design.turned(y), chances, pairs, alarm)
        if self.tables.pair_tables == "verified":
            for _ in range(ROUNDS):
                if not self.tables.verify(judge.design, causes, verdict):
                    break
                if judge.design is not design:
                    design.forget_pairs()
                verdict = judge(judge.design.turned(y), chances, pairs, alarm)
        for names in verdict.pairs:
            design.grid(names)
        answer = Answer(
            listed=causes,
            design=design.closed(),
            judged=judge.design.closed(),
            shares=shares,
            y=y,
            verdict=verdict,
            seed=seed,
            draws=chances,
            rule=rule,
            specimens=tuple(called(s, i) for i, s in enumerate(self.specimens)),
            measured=self.measured,
            noise=self.noise,
            nuisance=self.nuisance,
            redrawn=tuple(self.tabulator.free),
            covariates=self.covariates,
            groups=self.groups,
            unrecorded=self.unrecorded,
            table_errors={c.name: self.table(c).error for c in causes},
            rehearsal=self._made.rehearsed.get(causes),
            study=self,
            references=self.about.references,
        )
        return checked_by_group(answer)

    def confusable(self, causes: Iterable[Cause] | None = None, *, sd: float | None = None) -> Confusable:
        """Which causes this design tells apart, without any data.

        Parameters
        ----------
        causes : the list
        sd : relative noise to assume where the study does not state it
        """
        return confusable(self.known_design(causes, sd))

    def known_design(self, causes: Iterable[Cause] | None = None, sd: float | None = None) -> Design:
        """The design with a known noise: as stated, or ``sd``, or 4 % where nothing is stated."""
        design = self.design(causes)
        if sd is None and self.noise.kind != "unknown":
            return design
        noise = Noise(sd if sd is not None else ASSUMED_NOISE)
        return design.with_noise(noise, noise.scale(self.n), self.covariates)

    def rehearse(
        self,
        causes: Iterable[Cause] | None = None,
        n: int = 200,
        *,
        hide: str | Iterable[Cause] | None = None,
        seed: int = 0,
        sd: float | None = None,
        pairs: bool = True,
        rule: Rule | None = None,
        progress: Callable[[str], None] | None = None,
    ) -> Rehearsal:
        """Confusion matrix of blind trials on this very design.

        Parameters
        ----------
        causes : the list; one trial in four hides nothing, the others one of these causes of random visible size
        n : trials
        hide : leave a cause out: "each" hides every cause of the list in turn and takes it off the list that the data
            are judged by; causes hide these instead, whether they are on the list or never were. The share of names
            that are then given stands in every later verdict of this study on that list
        seed : of truths, noise and bootstrap
        sd : relative noise to draw where the study does not state it
        pairs : whether two causes are tried when no single one is left, as ``diagnose`` does; without, no table of a
            pair is made and such trials end as "unexplained"
        rule : thresholds
        progress : told after each trial in a line what was hidden and what was found
        """
        causes, rule = self._listed(causes), replace(rule or Rule(), screen=True)  # no p of a hopeless cause is wanted
        if hide is None:
            known = self.known_design(causes, sd)
            judge = self.judge(causes, rule)
            hidden = [planted(known, c, judge) for c in causes]
            nothing = planted(known, None, judge)
        else:
            if isinstance(hide, str) and hide != "each":
                raise InputError(f"hide must be 'each' or causes, got {hide!r}")
            hidden = []
            for cause in causes if isinstance(hide, str) else check_causes(hide, self.nuisance):
                rest = tuple(c for c in causes if c.name != cause.name)
                if not rest:
                    raise InputError(f"without {cause.name!r} the list is empty: a list of two and more is needed")
                known = self.known_design((*rest, cause), sd)
                hidden.append(planted(known, cause, self.judge(rest, rule)))
            nothing = planted(known, None, hidden[0].judge)
        spread = known.scale / nothing.judge.design.scale
        found = rehearse(hidden, nothing, spread, n, seed, missing=hide is not None, pairs=pairs, progress=progress)
        if hide is not None:
            self._made.rehearsed[causes] = found
        return found

    def plan(self, causes: Iterable[Cause], pool: Sequence[Any], k: int = 4) -> NextTests:
        """Specimens of a pool that would tell the causes of the list apart, before anything is measured."""
        return self._suggested(check_causes(causes, self.nuisance), pool, k, None)

    def next_tests(self, diagnosis: Diagnosis, pool: Sequence[Any], k: int = 4) -> NextTests:
        """Specimens of a pool that would tell the kept causes of a diagnosis apart best, or earn the one name.

        Parameters
        ----------
        diagnosis : of this study
        pool : specimens that could be tested, as ``simulate`` takes them
        k : how many, at most the size of the pool
        """
        return self._suggested(diagnosis.listed, pool, k, diagnosis)

    def _suggested(
        self, causes: tuple[Cause, ...], pool: Sequence[Any], k: int, diagnosis: Diagnosis | None
    ) -> NextTests:
        design = self.known_design(causes, diagnosis.noise_sd if diagnosis is not None else None)
        there = PoolGrids(self.tables, pool, self.noise, causes, float(np.mean(design.scale)))
        return suggest(design, there, pool, k, diagnosis)
