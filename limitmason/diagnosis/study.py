"""A study: what is asked of measured values and a simulator, see ``statement``."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from limitmason.causes.cause import Cause, check_causes
from limitmason.checks import choice, count, instance, listener
from limitmason.diagnosis.cause_tables import ASSUMED_NOISE, PoolGrids
from limitmason.diagnosis.error_rates import Rehearsal, planted, rehearse
from limitmason.diagnosis.inference.design import Design
from limitmason.diagnosis.inference.grid import Tabulation, at_measured
from limitmason.diagnosis.inference.judge import Judge
from limitmason.diagnosis.inference.next_tests import Confusable, NextTests, confusable
from limitmason.diagnosis.inference.noise import DRAWS, Draws, Noise, of_residuals
from limitmason.diagnosis.inference.shared_noise import Shares, estimated_shares
from limitmason.diagnosis.inference.verdict import Rule, fewest_draws
from limitmason.diagnosis.observations import linked
from limitmason.diagnosis.report import Diagnosis
from limitmason.diagnosis.result import Findings
from limitmason.diagnosis.statement import Statement
from limitmason.diagnosis.suggest import suggest
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError
from limitmason.study.run_fingerprint import fingerprint

FAR_OFF = 20.0  # measured over predicted, or the reverse, beyond which a unit is asked about
MOST_NAMED = 5  # numbers that a warning of it names


@dataclass(frozen=True, eq=False, repr=False)
class Study(Statement):
    """Measured values against a simulator.

    Parameters
    ----------
    specimens : mappings of covariates, or any objects that ``simulate`` understands
    simulate : ``simulate(specimen, **parameters)``, the prediction of what was measured: a number, or a mapping of
        quantities to numbers
    measured : one positive value per specimen, shape (n,), or a list of :class:`~limitmason.diagnosis.Observation`,
        any number per specimen; None for planning
    noise : relative error of the measured values, where the observations do not state their own
    nuisance : inputs of the simulator that were measured separately, with their errors
    covariates : names to read from each specimen, or a mapping of names to n values; where omitted, the circumstances
        that all specimens record by name and in which they differ (batch, day, operator, sensor, set-up, ...)
    groups : label of the configuration of each specimen: repeats share one
    shared : covariates whose labels may share a part of the noise: its share is estimated and carried. None takes
        those that by name are circumstances of a test (batch, day, operator, sensor, set-up, ...) and that no listed
        cause is about, and holds an alarm against noise shared unstated where no column tells batch, day or set-up;
        () takes all noise as independent
    levels : most sizes per cause at which the simulator is called; 9 and fewer for a slow or a jumpy one
    nuisance_levels : values of each measured input at which it is called; None is 5 for one input, 3 for more
    cache, n_jobs, version : see :class:`~limitmason.diagnosis.simulator_calls.Simulator`
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

    def _listed(self, causes: Iterable[Cause] | None) -> tuple[Cause, ...]:
        return self.tables.computable(self._checked(causes))

    def _checked(self, causes: Iterable[Cause] | None) -> tuple[Cause, ...]:
        return check_causes(self.causes if causes is None else causes, self.nuisance)

    def design(self, causes: Iterable[Cause] | None = None) -> Design:
        """Tables of the design for a list of causes.

        They are made on the first call.
        """
        causes, designs = self._listed(causes), self._made.designs
        if causes not in designs:
            designs[causes] = self.tables.design(causes, self.noise, self.scale, self.columns)
        self.tables.forget_sums(designs[causes])
        return designs[causes]

    def judge(self, causes: Iterable[Cause] | None = None, rule: Rule | None = None) -> Judge:
        """The judge of data of this design by a list of causes, noise independent.

        It is kept for each list and rule, with the rehearsal that sets its margins.
        """
        causes, rule, judges = self._listed(causes), instance("rule", rule or Rule(), Rule), self._made.judges
        design = self.design(causes)
        if (causes, rule) not in judges:

            def known(sd: float) -> Design:
                """The design with a noise that is known: as stated, else ``sd`` as residuals tell it."""
                return design if self.noise.kind != "unknown" else design.with_noise(of_residuals(sd))

            judges[causes, rule] = Judge(
                design=design, known=known, groups=self.groups, rule=rule, unstated=self.unstated
            )
        return judges[causes, rule]

    def shares(self, causes: Iterable[Cause] | None = None, *, price: float | None = None) -> Shares:
        """Shares of the noise within the labels of :attr:`shared`.

        They are estimated from the measured values.

        Parameters
        ----------
        causes : the list
        price : None for shares at the baseline; else they are those beside the best explanation, each cause of which
            must improve the log-likelihood by this much
        """
        if self.measured is None:
            raise InputError("the study has no measured values to estimate shares of the noise from")
        design = self.design(causes)
        return estimated_shares(design, design.whiten(self.measured), self.shared, price=price)

    def table(self, cause: Cause) -> Tabulation:
        """Table of one cause.

        It is made on the first call.
        """
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
    ) -> Diagnosis:
        """Say what the simulation gets wrong, or that the data cannot tell.

        Parameters
        ----------
        causes : the list that the verdict is conditional on; measurement causes belong to every list. None is that of
            the study
        seed : of the bootstrap; the same seed gives the same verdict
        draws : most bootstrap draws; fewer than 99 cannot reach the default thresholds
        pairs : whether two causes are tried when no single one is left
        rule : thresholds

        Raises
        ------
        InputError
            Without measured values, and for too few draws.

        Notes
        -----
        A cause that the simulator refuses, or finds no answer for, is set aside: the answer's ``aside`` names it with
        the reason, and its warnings do.
        """
        if self.measured is None:
            raise InputError("the study has no measured values: it can plan (confusable, rehearse), not diagnose")
        rule = instance("rule", rule or Rule(), Rule)
        draws, seed = count("draws", draws, least=fewest_draws(rule)), count("seed", seed, least=0)
        reached(None, "tables")
        asked = self._checked(causes)
        causes = self.tables.computable(asked)
        judge = self.judge(causes, rule)
        design = judge.design
        self._say_if_far_off()
        self._say_if_copied()
        reached(None, "verdict")
        chances = Draws.make([seed, self.n], n=self.n, k=design.inputs, noise=design.noise, count=draws)
        y = design.whiten(self.measured)
        judged = judge.decide(y, chances, pairs, shared=self.shared, renewed=self.tables.replace_wrong_pairs)
        return Diagnosis(
            listed=causes, design=design.closed(), judged=judged.design, shares=judged.shares, y=y,
            verdict=judged.verdict, seed=seed, draws=chances, rule=judge.rule, specimens=self.called,
            measured=self.measured, noise=self.noise, nuisance=self.nuisance, redrawn=tuple(self.tabulator.free),
            covariates=self.columns, quantities=self.rows.quantities, groups=self.groups, unstated=self.unstated,
            table_errors={c.name: self.table(c).error for c in causes}, rehearsal=self._made.rehearsed.get(causes),
            study=self, aside={c.name: self.tables.aside[c] for c in asked if c not in causes},
            references=self.about.references, counted=self.rows.counted,
        )

    def _say_if_far_off(self) -> None:
        """Warn of a quantity, or numbers, far from predicted: a unit, as a rule."""
        assert self.measured is not None, "a verdict has measured values"
        apart = linked(self.measured, self.rows.log) - at_measured(self.tables.base())
        for quantity in dict.fromkeys(self.rows.quantities):
            mine = self.rows.log & np.array([q == quantity for q in self.rows.quantities])
            if not mine.any():
                continue
            ratio = float(np.median(apart[mine]))
            if abs(ratio) > np.log(FAR_OFF):
                warnings.warn(f"{quantity}: measured is {np.exp(ratio):.3g} times predicted; are both in one unit?",
                              stacklevel=4)
            # by the median of a quantity few numbers in another unit than the rest are not seen
            far = np.flatnonzero(mine & (np.abs(apart - ratio) > np.log(FAR_OFF)))
            if len(far):
                each = ", ".join(f"{self.called[k]} ({np.exp(apart[k]):.3g})" for k in far[:MOST_NAMED])
                warnings.warn(f"{len(far)} of {mine.sum()} numbers lie apart from the others, measured over predicted: "
                              f"{each}; are they in the unit of the others?", stacklevel=4)

    def _say_if_copied(self) -> None:
        """Warn of specimens equal in all that is recorded: a copied row, as a rule."""
        assert self.measured is not None, "a verdict has measured values"
        read: dict[int, list[tuple[str, float]]] = {}  # quantities and values by number of the specimen
        for number, quantity, value, log in zip(
            self.rows.of.tolist(), self.rows.quantities, self.measured.tolist(), self.rows.log, strict=True
        ):
            if log:  # what was seen or not, and signed values such as 0, are often equal by themselves
                read.setdefault(number, []).append((quantity, value))
        known: dict[str, int] = {}  # number of the first specimen with this record
        pairs = []  # (first, number of its copy)
        for number, values in read.items():
            if isinstance(self.specimens[number], Mapping):  # what an object records is not known
                first = known.setdefault(fingerprint(self.specimens[number], sorted(values)), number)
                pairs += [(first, number)] * (first != number)
        if pairs:
            warnings.warn(f"{len(pairs)} of {len(read)} specimens equal another in all that is recorded and measured, "
                          f"first {pairs[0][1]} and {pairs[0][0]} (from 0); a copied row counts as a test of its own",
                          stacklevel=4)

    def log_likelihood(self, sizes: Mapping[Cause, float] | Sequence[float], z: Iterable[float] = ()) -> float:
        """Log-likelihood of the measured values with causes at given sizes.

        A sampler of posteriors takes it.

        -sum (r^2 / 2 + log sd) - sum z^2 / 2, with r the measured from the predicted values over their stated noise. A
        noise from replicates is taken as known, whatever its degrees of freedom. Predictions come from the tables, in
        which the effects of several causes add up. Noise shared by tests is not in it. Minus infinity outside the
        tables.

        Parameters
        ----------
        sizes : of each cause, by cause; or numbers, as a sampler walks: of every cause of the study in its order, then
            the measured inputs as in ``z``
        z : measured inputs in standard deviations from their values, which are their prior; none is the values

        Raises
        ------
        InputError
            Without measured values, where the noise is not stated, or for another number of numbers.

        >>> study.log_likelihood({causes.gain(): 1.1})  # doctest: +SKIP
        """
        if self.measured is None or self.noise.kind == "unknown":
            raise InputError("a likelihood needs measured values and a stated noise")
        if not isinstance(sizes, Mapping):
            theta, names = np.atleast_1d(sizes).tolist(), [c.name for c in self.causes] + list(self.tabulator.free)
            if len(theta) != len(names):
                raise InputError(f"{len(theta)} numbers are given, these are to be sampled: {', '.join(names)}")
            sizes, z = dict(zip(self.causes, theta, strict=False)), (*theta[len(self.causes) :], *z)
        elif other := [c for c in sizes if not isinstance(c, Cause)]:
            raise InputError(f"sizes are told by cause, not by {other[0]!r}")
        z = tuple(z)
        if len(z) not in (0, len(self.tabulator.free)):
            free = ", ".join(self.tabulator.free) or "none"
            raise InputError(f"z has {len(z)} numbers, these inputs have an error: {free}")
        r = (linked(self.measured, self.rows.log) - self.tables.between(sizes, z)) / self.scale
        if not np.isfinite(r).all():
            return float("-inf")
        return float((-0.5 * r**2 - np.log(self.scale)).sum() - 0.5 * np.square(z).sum())

    def confusable(self, causes: Iterable[Cause] | None = None, *, sd: float | None = None) -> Confusable:
        """Which causes this design tells apart, without any data.

        Parameters
        ----------
        causes : the list; None is that of the study
        sd : relative noise to plan with, in place of what the study states of values compared by their logarithm; None
            is that, or 4 % where it states none
        """
        return confusable(self.known_design(causes, sd))

    def known_design(self, causes: Iterable[Cause] | None = None, sd: float | None = None) -> Design:
        """The design with a known noise.

        The noise is ``sd`` where that is given, else as stated, else 4 %. Rows that are not compared by their logarithm
        keep what is stated of them.
        """
        design = self.design(causes)
        if sd is None and self.noise.kind != "unknown":
            return design
        noise = Noise(sd if sd is not None else ASSUMED_NOISE)
        if self.noise.by_row and not self.rows.log.all():
            of_rows = np.where(self.rows.log, noise.scale(self.n), self.scale)
            noise = replace(design.noise, sd=tuple(of_rows.tolist()), dof=None)
        return design.with_noise(noise)

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

        Every trial is judged as :meth:`diagnose` judges, groups left out included. Only noise that tests share is
        neither drawn nor estimated.

        Parameters
        ----------
        causes : the list; one trial in four hides nothing, the others one of these causes of random visible size
        n : trials
        hide : leave a cause out: "each" hides every cause of the list in turn and takes it off the list that the data
            are judged by; causes hide these instead, whether they are on the list or never were. The share of names
            that are then given stands in every later verdict of this study on that list
        seed : of truths, noise and bootstrap
        sd : relative noise to draw, in place of what the study states of values compared by their logarithm; the trials
            are judged by what it states all the same. None is that, or 4 % where it states none
        pairs : whether two causes are tried when no single one is left, as ``diagnose`` does; without, no table of a
            pair is made and such trials end as "unexplained"
        rule : thresholds
        progress : told after each trial in a line what was hidden and what was found
        """
        n = count("n", n, least=0)
        listener("progress", progress, "a line of text")
        causes, rule = self._listed(causes), instance("rule", rule or Rule(), Rule)
        rule = replace(rule, screen=True)  # no p of a hopeless cause is wanted
        if hide is None:
            known = self.known_design(causes, sd)
            judge = self.judge(causes, rule)
            hidden = [planted(known, c, judge) for c in causes]
            nothing = planted(known, cause=None, judge=judge)
        else:
            if isinstance(hide, str) and hide != "each":
                raise InputError(f"hide must be 'each' or causes, got {hide!r}")
            hidden = []
            for cause in causes if isinstance(hide, str) else self._listed(hide):
                rest = tuple(c for c in causes if c.name != cause.name)
                if not rest:
                    raise InputError(f"without {cause.name!r} the list is empty: a list of two and more is needed")
                known = self.known_design((*rest, cause), sd)
                hidden.append(planted(known, cause, self.judge(rest, rule)))
            nothing = planted(known, cause=None, judge=hidden[0].judge)
        spread = known.scale / nothing.judge.design.scale
        found = rehearse(hidden, nothing, spread, n, seed, missing=hide is not None, pairs=pairs, progress=progress)
        if hide is not None:
            self._made.rehearsed[causes] = found
        return found

    def plan(
        self, causes: Iterable[Cause], pool: Sequence[Any], k: int = 4, costs: Mapping[str, float] | None = None
    ) -> NextTests:
        """Specimens of a pool that would tell causes apart, where nothing is measured yet.

        Parameters
        ----------
        causes : the list
        pool, k, costs : as for ``Diagnosis.next_tests``, which goes by what is left of the list
        """
        return self.suggested(self._listed(causes), pool, k, costs)

    def suggested(
        self, causes: tuple[Cause, ...], pool: Sequence[Any], k: int, costs: Mapping[str, float] | None,
        diagnosis: Findings | None = None,
    ) -> NextTests:
        """Specimens of a pool to test for a list of causes, or what was left of it.

        See :meth:`plan`.

        Parameters
        ----------
        k : number of tests
        costs : cost of a test by quantity
        """
        if costs is not None:
            if not isinstance(costs, Mapping):
                raise InputError(f"costs must read {{'peak': 3.0}}, a cost for each quantity, got {costs!r}")
            for quantity in costs:
                choice("a quantity of costs", quantity, (*self.rows.needed, *self.rows.planned))
        sd, pool = None if diagnosis is None else diagnosis.noise_sd, list(pool)
        design = self.known_design(causes) if sd is None else self.design(causes).with_noise(of_residuals(sd))
        there = PoolGrids(self.tables, pool, self.noise, causes, design.scale)
        return suggest(design, there, pool, k, diagnosis, self.about.costs if costs is None else costs)
