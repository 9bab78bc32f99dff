"""The answer of a study: what kind it is, which causes, how large, what they gain, and what it hangs on."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from limitmason.diagnosis import report as text
from limitmason.diagnosis.cause import Cause
from limitmason.diagnosis.inference.bootstrap import Draws
from limitmason.diagnosis.inference.decide import Rule, Verdict, decide
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.estimate import Estimate, estimate
from limitmason.diagnosis.inference.gain import Gain, measure_gain
from limitmason.diagnosis.inference.noise import Noise
from limitmason.diagnosis.inference.plan import NextTests, detectable
from limitmason.diagnosis.suggest import suggest

if TYPE_CHECKING:
    from limitmason.diagnosis.study import Study

TAILS = 4.0  # degrees of freedom of the Student errors tried as a check
NEAR = 25.0  # as ``Rule.far`` in these: a rival beyond it wins fewer than one draw in a thousand
QUICK = 299  # draws of the repeated verdicts that check what a verdict hangs on


@dataclass(frozen=True)
class Checks:
    """The same data judged again under other statements.

    Parameters
    ----------
    unknown_noise : kind and causes with the noise taken as unknown (relative sizes between specimens as stated)
    student : the same with Student errors, which forgive blunders; None unless the noise is known and Gaussian
    dropped : per specimen the kind and causes without it
    hangs_on : specimens without which the verdict is another
    """

    unknown_noise: tuple[str, Names]
    student: tuple[str, Names] | None
    dropped: tuple[tuple[str, Names], ...]
    hangs_on: tuple[int, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """Verdict of a study, conditional on its list of causes.

    Parameters
    ----------
    study, listed : what was asked; ``listed`` is the list of causes
    design, y : tables, and data as log differences from the baseline in units of the noise
    verdict : answer of the rule
    seed, draws, rule : of the bootstrap
    """

    study: "Study"
    listed: tuple[Cause, ...]
    design: Design
    y: np.ndarray
    verdict: Verdict
    seed: int
    draws: Draws
    rule: Rule

    @property
    def kind(self) -> str:
        """Answer: "none", "cause", "either", "two", "unexplained" or "scatter"."""
        return self.verdict.kind

    @property
    def causes(self) -> Names:
        """Names, best first: the cause, the set that the data cannot tell apart, or the two of the best pair."""
        return self.verdict.causes

    @property
    def pairs(self) -> tuple[Names, ...]:
        """Pairs of causes that are not rejected, best first; more than one means that the data cannot tell which."""
        return self.verdict.pairs

    @property
    def covariate(self) -> str | None:
        """Covariate that the residuals of the baseline vary with most; a pointer, not a cause."""
        return self.verdict.covariate

    @property
    def kept(self) -> tuple[Names, ...]:
        """Explanations that are not rejected: single causes or pairs, best first."""
        return self.verdict.kept

    @cached_property
    def estimates(self) -> dict[str, Estimate]:
        """Size of each kept cause with a 95 % interval; for pairs those of the best pair."""
        if self.kind == "two":
            return estimate(self.design, self.verdict.tested[self.pairs[0]], self.y, self.draws)
        out: dict[str, Estimate] = {}
        for names in self.kept:
            out.update(estimate(self.design, self.verdict.tested[names], self.y, self.draws))
        return out

    @cached_property
    def gains(self) -> dict[Names, Gain]:
        """Gain of each kept explanation."""
        critical = self.verdict.critical_gain
        return {n: measure_gain(self.design, n, self.y, self.study.groups, critical) for n in self.kept[:8]}

    def checked_by_group(self) -> "Diagnosis":
        """The diagnosis without explanations that predict whole groups left out worse than the baseline does.

        With few repeats the noise is too uncertain to reject a bad fit; what is left out as a whole still tells: an
        explanation is withdrawn when its score by group is negative by more than its standard error.
        """
        if not self.kept or self.study.groups is None:
            return self
        scores = {n: g.leave_group_out for n, g in self.gains.items()}
        worse = [n for n, s in scores.items() if s is not None and s.total + s.error < 0.0]
        return replace(self, verdict=self.verdict.without(worse)) if worse else self

    @property
    def gain(self) -> Gain | None:
        """Gain of the best kept explanation; None when nothing is named."""
        return self.gains[self.kept[0]] if self.kept else None

    @cached_property
    def detectable(self) -> dict[str, tuple[float | None, ...]]:
        """Smallest size of each cause, per side, that would have been seen nine times in ten; None within no bound."""
        known = self.study.known_design(self.listed, self.noise_sd)
        return detectable(known, self.verdict.critical_gain)

    @property
    def noise_sd(self) -> float | None:
        """Noise estimated from the best explanation where it is not stated, None where it is."""
        if self.study.noise.kind != "unknown":
            return None
        best = self.verdict.tested[self.kept[0]].fit if self.kept else self.verdict.null
        free = max(self.study.n - len(self.kept[0]) if self.kept else self.study.n, 1)
        return float(np.sqrt(best.loss[0] / free))

    @cached_property
    def residuals(self) -> dict[str, np.ndarray]:
        """Values of log(measured / predicted): "baseline" as stated, and refitted with each kept explanation."""
        out = {"baseline": self.y * self.design.scale}
        for names in self.kept:
            out[" + ".join(names)] = self.verdict.tested[names].fit.residuals[0] * self.design.scale
        return out

    def predicted(self, names: Iterable[str] | None = None) -> np.ndarray:
        """Prediction of every specimen by a kept explanation (default the best), or by the baseline for no names."""
        names = (self.kept[0] if self.kept else ()) if names is None else tuple(names)
        left = self.verdict.tested[names].fit.residuals[0] * self.design.scale if names else self.residuals["baseline"]
        return self.study.measured * np.exp(-left)

    @cached_property
    def checks(self) -> Checks:
        """The verdict under unknown noise, and without each specimen in turn (quick; the latter without pairs)."""
        return self._check(lambda line: None)

    def _check(self, progress: Callable[[str], None]) -> Checks:
        study = self.study
        progress("the verdict with the noise taken as unknown")
        draws, rule = self._quick(study.noise), replace(self.rule, screen=True, far=NEAR)
        plain = decide(self.design, self.y, draws, rule, pairs=False)
        pairs = self.kind == "two"
        blind = self.design.with_noise(Noise.unknown(), self.design.scale, study.covariates)
        other = decide(blind, self.y, self._quick(Noise.unknown()), rule, pairs=pairs)
        student = None
        if study.noise.kind == "known" and study.noise.tails is None:
            progress("the verdict with Student errors")
            noise = Noise(study.noise.sd, tails=TAILS)
            heavy = self.design.with_noise(noise, self.design.scale, study.covariates)
            verdict = decide(heavy, self.y, self._quick(noise), rule, pairs=pairs)
            student = (verdict.kind, verdict.causes)
        dropped = []
        for i in range(study.n):
            progress(f"the verdict without specimen {i + 1} of {study.n}")
            kept = np.arange(study.n) != i
            part = self.design.without(kept, study.covariates)
            verdict = decide(part, self.y[kept], draws.columns(kept), rule, pairs=False)
            dropped.append((verdict.kind, verdict.causes))
        hangs = [i for i, (k, c) in enumerate(dropped) if _other(plain, k, c)]
        return Checks((other.kind, other.causes), student, tuple(dropped), tuple(hangs))

    def _quick(self, noise: Noise) -> Draws:
        return Draws.make([self.seed, self.study.n], self.study.n, self.design.inputs, noise, QUICK)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What limits the verdict."""
        return text.warnings(self)

    def report(self, *, checks: bool = True, progress: Callable[[str], None] | None = None) -> str:
        """The verdict as text.

        Parameters
        ----------
        checks : also judge the data again under other statements of the noise and without each specimen (some seconds
            for 16 causes and 24 specimens)
        progress : told in a line what is judged again
        """
        if checks and progress is not None and "checks" not in self.__dict__:
            self.__dict__["checks"] = self._check(progress)  # where the cached property keeps it
        return text.report(self, checks)

    def table(self) -> list[dict[str, Any]]:
        """One row per cause of the list and per kept pair: size, interval, gain, p, and whether it is kept."""
        return text.table(self)

    def next_tests(self, pool: Sequence[Any], k: int = 4) -> NextTests:
        """Specimens of a pool that would tell the kept causes apart best; see :func:`~.suggest.suggest`."""
        return suggest(self.study, self.listed, pool, k, self)

    def __str__(self) -> str:
        return text.headline(self)

    def __repr__(self) -> str:
        return f"<Diagnosis of {self.study.n} specimens, {text.headline(self)}>"


def _other(plain: Verdict, kind: str, causes: Names) -> bool:
    """Whether another verdict contradicts: another kind of answer, or no cause in common."""
    named = ("cause", "either")
    if plain.kind in named and kind in named:
        return not set(plain.causes) & set(causes)
    return plain.kind != kind
