"""The answer of a study as numbers: kind, causes, sizes, and what they gain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from limitmason.answers.references import Citable, Cited
from limitmason.causes.cause import Cause
from limitmason.diagnosis.error_rates import Rehearsal
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.estimate import Estimate, estimate
from limitmason.diagnosis.inference.evidence_by_kind import Evidence, by_kind, predicted_evidence
from limitmason.diagnosis.inference.fit import BestFit
from limitmason.diagnosis.inference.gain import Gain, measure_gain
from limitmason.diagnosis.inference.next_tests import Confusable, confusable, detectable
from limitmason.diagnosis.inference.noise import Draws, Measured, Noise, of_residuals
from limitmason.diagnosis.inference.shared_noise import Shares, seen_if_shared
from limitmason.diagnosis.inference.verdict import Identification, Rule, Verdict, VerdictKind
from limitmason.diagnosis.inference.verdict_sensitivity import Checks, judge_again
from limitmason.diagnosis.observations import linked, unlinked
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.storage.frozen import ReadOnly

NORMAL_95 = 1.96  # half the width of a 95 % interval over the standard deviation
GAINS = 8  # most kept explanations whose gain is measured and told, chosen: more are hardly told apart


@dataclass(frozen=True, eq=False, repr=False)
class Findings(Displayed, Citable, ReadOnly):
    """Verdict of a study, conditional on its causes: data and tables, no simulator.

    Parameters
    ----------
    listed : the list of causes
    design : tables
    y : data as log differences from the baseline in units of the noise
    judged : the tables that the verdict was made with: ``design``, or that with shared noise made independent
    shares : shares of the noise within batches, days, set-ups, ... that are carried
    verdict : answer of the rule
    seed, draws, rule : of the bootstrap
    specimens : what each row is called, shape (n,)
    measured : measured values, shape (n,)
    quantities : of each row
    noise, nuisance, covariates, groups : as stated to the study
    redrawn : names of the measured inputs that have an error
    unstated : circumstances of the tests that no column tells and that tests may share
    table_errors : largest error of each cause's table between its levels, in units of the noise
    counted : by specimen, points of its curve and how many independent ones they are worth
    aside : causes that were asked for and could not be computed, by name, with the reason
    rehearsal : blind trials on this design with the true cause missing from this list, where they were made before

    Notes
    -----
    What follows from these numbers is worked out when it is first asked for; the simulator is never called.
    """

    listed: tuple[Cause, ...]
    design: Design
    y: np.ndarray
    judged: Design
    shares: Shares
    verdict: Verdict
    seed: int
    draws: Draws
    rule: Rule
    specimens: tuple[str, ...]
    measured: np.ndarray
    noise: Noise
    nuisance: Mapping[str, Measured]
    redrawn: tuple[str, ...]
    quantities: tuple[str, ...]
    covariates: Mapping[str, Sequence[Any]]
    groups: Sequence[Any] | None
    unstated: tuple[str, ...]
    table_errors: Mapping[str, float]
    rehearsal: Rehearsal | None
    references: tuple[Cited, ...] = field(default=(), kw_only=True)
    aside: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    counted: Mapping[int, tuple[int, float]] = field(default_factory=dict, kw_only=True)
    _judged: list[Checks] = field(default_factory=list, init=False)

    @property
    def n(self) -> int:
        """Number of measured values."""
        return len(self.measured)

    @property
    def kind(self) -> VerdictKind:
        """"none", "cause", "behaves like", "either", "two", "unexplained" or "scatter"."""
        return self.verdict.kind

    @property
    def causes(self) -> Names:
        """Names, best first: the cause, the set not told apart, or the best pair."""
        return self.verdict.causes

    @property
    def pairs(self) -> tuple[Names, ...]:
        """Pairs of causes that are not rejected, best first.

        More than one means that the data cannot tell which.
        """
        return self.verdict.pairs

    @property
    def covariate(self) -> str | None:
        """Covariate that the residuals of the baseline vary with most.

        It is a pointer, not a cause.
        """
        return self.verdict.covariate

    @property
    def kept(self) -> tuple[Names, ...]:
        """Explanations that are not rejected: single causes or pairs, best first."""
        return self.verdict.kept

    @cached_property
    def by_name(self) -> dict[str, Cause]:
        """The causes of the list by their names."""
        return {c.name: c for c in self.listed}

    def sized(self, names: Names) -> list[str]:
        """Every cause of a kept explanation with its size, as "name = size [low, high]".

        The interval of a pair is told for the best one alone, by which :attr:`estimates` go.
        """
        out = []
        for name, size in zip(names, self.verdict.tested[names].sizes, strict=True):
            cause, known = self.by_name[name], len(names) == 1 or names == self.kept[0]
            ends = self.estimates.get(name) if known else None
            shown = f" [{cause.show(ends.low)}, {cause.show(ends.high)}]" if ends else ""
            out.append(f"{name} = {cause.show(size)}{shown}")
        return out

    @cached_property
    def estimates(self) -> dict[str, Estimate]:
        """Size of each kept cause with a 95 % interval.

        Where pairs are kept, the sizes are those of the best pair.
        """
        y = self.judged.turned(self.y)  # in coordinates in which noise that tests share is independent
        if self.pairs:
            return estimate(self.judged, self.verdict.tested[self.pairs[0]], y, self.draws)
        out: dict[str, Estimate] = {}
        for names in self.kept:
            out.update(estimate(self.judged, self.verdict.tested[names], y, self.draws))
        return out

    @cached_property
    def gains(self) -> dict[Names, Gain]:
        """Gain of each kept explanation."""
        critical = self.verdict.critical_gain
        return {n: measure_gain(self.design, n, self.y, self.groups, critical) for n in self.kept[:GAINS]}

    @property
    def gain(self) -> Gain | None:
        """Gain of the best kept explanation, or None when nothing is named."""
        return self.gains[self.kept[0]] if self.kept else None

    @property
    def identification(self) -> Identification | None:
        """What stands behind the one name, or the one pair, and what is missing for it.

        It is None where there is no such name or pair.
        """
        return self.verdict.identification

    @property
    def identified(self) -> bool:
        """Whether a name is given that is identified, of one cause or of two together."""
        return self.identification is not None and self.identification.holds

    @property
    def distinct(self) -> bool:
        """Whether one explanation is left, told from every smooth discrepancy.

        The one explanation need not be identified.
        """
        return self.verdict.distinct

    @property
    def noise_sd(self) -> float | None:
        """Noise estimated from the best explanation, None where it is stated.

        It is relative, of the logarithm [-]: sqrt(sum of squared residuals / (n - causes)).
        """
        if self.noise.kind != "unknown":
            return None
        spent = len(self.kept[0]) if self.kept else 0  # degrees of freedom: each kept cause takes one
        return float(np.sqrt(self.judged.like.variance(self.best.loss[0], self.n, spent=spent)))

    @property
    def best(self) -> BestFit:
        """Fit of the best kept explanation.

        Where none is kept, it is the fit of the baseline.
        """
        return self.verdict.tested[self.kept[0]].fit if self.kept else self.verdict.null

    @cached_property
    def by_kind(self) -> tuple[Evidence, ...]:
        """What each kind of data says of the best explanation, or of the baseline."""
        held = self.verdict.identification
        if held is not None and held.kinds:  # worked out for the verdict
            return held.kinds
        names = self.kept[0] if self.kept else ()
        sd = self.noise_sd or 1.0
        effect = self.judged.effect(names, self.best) if names else np.zeros(self.n)
        return by_kind(self.judged, effect, self.y, self.verdict.null.residuals[0], self.best.residuals[0], sd)

    def confirmed_by(self, later: Any) -> Evidence:
        """What values measured afterwards say of the one cause left, at its size.

        ``whole`` says that they show what was predicted within two standard errors, of the size and of the measured
        inputs too: the cause is then confirmed in advance. ``absent`` rejects it.

        Parameters
        ----------
        later : a study of these values with a stated noise, whose model takes the same cause

        Raises
        ------
        InputError
            Where no single cause is left, and for what is no study or has no values or states no noise.
        """
        if len(self.causes) != 1 or self.pairs:
            raise InputError(f"one cause must be left to be confirmed; the verdict is {self.kind}")
        if not isinstance(getattr(later, "noise", None), Noise):
            raise InputError(f"later must be a Study of the values measured afterwards, got {later!r}")
        if later.measured is None or later.noise.kind == "unknown":
            raise InputError("what is to confirm a cause needs measured values with a stated noise")
        cause, found = self.by_name[self.causes[0]], self.estimates[self.causes[0]]
        base = later.tables.between({})
        at, low, high = (later.tables.between({cause: size}) for size in (found.size, found.low, found.high))
        # one standard deviation of the size, and of each measured input, in units of the noise
        spread = (high - low) / (2.0 * NORMAL_95 * later.scale)
        slopes = later.tables.base().whitened(base, later.scale).slopes
        data = (linked(later.measured, later.rows.log) - base) / later.scale
        kind = " and ".join(dict.fromkeys(later.rows.kinds))
        return predicted_evidence(kind, (at - base) / later.scale, np.column_stack([spread, slopes]), data)

    @cached_property
    def known(self) -> Design:
        """The design with a known noise, stated, or estimated by the best explanation."""
        sd = self.noise_sd
        return self.design if sd is None else self.design.with_noise(of_residuals(sd))

    @cached_property
    def detectable(self) -> dict[str, tuple[float | None, ...]]:
        """Smallest size of each cause, per side, to be seen nine times in ten.

        It is None where no size within the bound would have been.
        """
        known = self.known
        shared = (lambda curve: seen_if_shared(known, curve)) if self.unstated else None
        return detectable(known, self.verdict.critical_gain, shared)

    @cached_property
    def distances(self) -> Confusable:
        """Which causes of the list this design tells apart."""
        return confusable(self.known)

    def judged_again(self, progress: Callable[[str], None] | None = None) -> Checks:
        """Verdicts on these data under other statements and without each specimen.

        They are worked out once.

        Parameters
        ----------
        progress : told in a line what is judged again
        """
        if not self._judged:
            self._judged.append(judge_again(
                self.design, self.y, self.rule, self.seed, bool(self.pairs), self.shares, self.unstated, progress
            ))
        return self._judged[0]

    @property
    def checks(self) -> Checks:
        """What the verdict hangs on.

        Some seconds for 16 causes and 24 specimens.
        """
        return self.judged_again()

    @cached_property
    def residuals(self) -> dict[str, np.ndarray]:
        """Differences log(measured / predicted) or as compared, by explanation.

        "baseline", and each that is kept.
        """
        out = {"baseline": self.y * self.design.scale}
        for names in self.kept:
            out[" + ".join(names)] = self._left(names)
        return out

    def predicted(self, names: Iterable[str] | None = None) -> np.ndarray:
        """Prediction of every specimen by an explanation that was fitted, or () for the baseline.

        The best one that is kept is the default.

        Raises
        ------
        InputError
            For names of no explanation that was fitted.
        """
        names = (names,) if isinstance(names, str) else names
        names = (self.kept[0] if self.kept else ()) if names is None else tuple(names)
        if names and names not in self.verdict.tested:
            known = "; ".join(" + ".join(n) for n in self.verdict.tested)
            raise InputError(f"no explanation {' + '.join(map(str, names))!r} was fitted; there are {known}")
        left = self._left(names) if names else self.residuals["baseline"]
        log = np.ones(self.n, bool) if self.design.log is None else self.design.log
        return unlinked(linked(self.measured, log) - left, log)

    def _left(self, names: Names) -> np.ndarray:
        """Residuals log(measured / predicted) of an explanation, shape (n,)."""
        return self.judged.apart(self.verdict.tested[names].fit.residuals[0]) * self.design.scale

    def __repr__(self) -> str:
        return f"<Findings of {self.n} specimens, {self.kind}: {' + '.join(self.causes) or 'no cause'}>"
