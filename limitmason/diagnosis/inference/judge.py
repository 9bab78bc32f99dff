"""The whole judgement of a data set: shared noise, gate, what explains an alarm, and whether it is identified."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtri

from limitmason.diagnosis.inference.bootstrap import Draws
from limitmason.diagnosis.inference.decide import Decision, Rule
from limitmason.diagnosis.inference.design import Design
from limitmason.diagnosis.inference.discrepancy import Rivals
from limitmason.diagnosis.inference.identify import identification
from limitmason.diagnosis.inference.missing import Missing, leave_each_out
from limitmason.diagnosis.inference.shared import Shares, doubted, estimated_shares
from limitmason.diagnosis.inference.verdict import Identification, Verdict, VerdictKind

ROUNDS = 6  # of renewed tables of pairs
PAIR_TAIL = 0.02  # chance that some second cause improves a single one by as much as noise alone


Renewed = Callable[[Design, Verdict], bool]


@dataclass(frozen=True)
class Judged:
    """A verdict, the design that it was made with, and the shares of the noise that this carries."""

    verdict: Verdict
    design: Design
    shares: Shares


@dataclass
class Judge:
    """Judges data sets of one design and list.

    Parameters
    ----------
    design : tables
    known : the same with a known noise, for rehearsals; called with the estimate of the noise where it is not stated
    folds : number of the group of each specimen, left out together, shape (n,)
    rule : thresholds
    unstated : circumstances of the tests that no column tells: an alarm must outlast noise shared within them
    rehearsed : the judge whose rehearsal is taken, that of independent noise where this one carries shared noise: its
        shares hang on the data, the margins should not
    seed : of the rehearsal
    """

    design: Design
    known: Callable[[float], Design]
    folds: np.ndarray
    rule: Rule = field(default_factory=Rule)
    unstated: tuple[str, ...] = ()
    rehearsed: Judge | None = None
    seed: int = 0
    _rivals: dict[float, Rivals] = field(default_factory=dict, init=False)
    _missing: dict[float, Missing] = field(default_factory=dict, init=False)

    def missing(self, sd: float = 1.0) -> Missing:
        """What happens here when the true cause is not on the list, and the margins against it; worked out once.

        Parameters
        ----------
        sd : noise in stated units, where it is not stated
        """
        if self.rehearsed is not None:
            return self.rehearsed.missing(sd)
        if sd not in self._missing:
            rivals, rule = self.rivals(sd), self.rule
            self._missing[sd] = leave_each_out(
                self.design, self.known(sd), lambda name, *fitted: rivals.excess((name,), *fitted), self.seed,
                floor=rule.margin, share=rule.missing, each=rule.each,
            )  # fmt: skip
        return self._missing[sd]

    def rivals(self, sd: float = 1.0) -> Rivals:
        """Discrepancy biases, in units of the noise."""
        if sd not in self._rivals:
            self._rivals[sd] = Rivals(self.design, sd)
        return self._rivals[sd]

    def noise(self, verdict: Verdict) -> float:
        """Noise of the best explanation of a verdict in stated units, to two digits; 1 where it is stated."""
        if self.design.noise.kind != "unknown":
            return 1.0
        names = verdict.kept[0] if verdict.kept else ()
        fit = verdict.tested[names].fit if names else verdict.null
        return float(f"{self.design.noise_of(names, fit):.2g}")

    def carrying(self, shares: Shares) -> Judge:
        """What judges with some shares of the noise; margins are those of independent noise."""
        if not shares.shares:
            return self
        return replace(self, design=self.design.sharing(shares.correlation), rehearsed=self)

    def decide(
        self, y: np.ndarray, draws: Draws, pairs: bool, shared: Sequence[str] | None, renewed: Renewed
    ) -> Judged:  # fmt: skip
        """The verdict on one data set, noise shared as its residuals say.

        Parameters
        ----------
        y : whitened data, per specimen, shape (n,)
        draws : standard errors for the bootstrap
        pairs : whether pairs of causes are tried
        shared : columns whose labels may share noise; None are the circumstances of the tests
        renewed : checks the tables of pairs that a verdict hangs on, and says whether one was replaced
        """
        shares = estimated_shares(self.design, y, shared)
        alarm = self.carrying(shares).alarm(y, draws)
        if alarm.kind == VerdictKind.UNEXPLAINED and shares.looked_at:  # beside the best explanation
            shares = estimated_shares(self.design, y, shared, price=alarm.critical_gain)
        judge = self.carrying(shares)
        verdict = judge.verdict(y, draws, pairs, alarm)
        for _ in range(ROUNDS):
            if not renewed(judge.design, verdict):
                break
            if judge is not self:
                self.design.forget_pairs()
            verdict = judge.verdict(y, draws, pairs, alarm)
        for names in verdict.pairs:
            self.design.grid(names)
        return Judged(verdict, judge.design.closed(), shares)

    def alarm(self, y: np.ndarray, draws: Draws) -> Verdict:
        """Whether the baseline is not enough, before anything is sought that explains the data."""
        decision = Decision(self.design, draws, self.rule)
        alarm = decision.gate(y)
        return doubted(decision, y, alarm, self.unstated)

    def verdict(self, y: np.ndarray, draws: Draws, pairs: bool = True, alarm: Verdict | None = None) -> Verdict:
        """The verdict on one data set.

        Parameters
        ----------
        y : whitened data, per specimen, shape (n,)
        draws : standard errors for the bootstrap
        pairs : whether pairs of causes are tried where no single one is left, or the residuals ask for them
        alarm : what a gate said of the same data, which may have carried other shares of the noise; None asks its own
        """
        alarm = self.alarm(y, draws) if alarm is None else alarm
        decision = Decision(self.design, draws, self.rule)
        verdict = decision.explained(y, alarm, pairs)
        if not self.rule.identify:
            return verdict
        verdict = self._identified(decision, verdict, y, pairs)
        return replace(verdict, rehearsed=self.missing(self.noise(verdict)))

    def _identified(self, decision: Decision, verdict: Verdict, y: np.ndarray, pairs: bool) -> Verdict:
        """The verdict with its one name identified, or not, or withdrawn."""
        if len(verdict.kept) != 1:
            return verdict
        record: Identification | None = self.held(decision, verdict, y)
        if record is not None and len(record.names) == 1:
            verdict, record = self._second_look(decision, verdict, record, y, pairs)
        if record is None:
            return verdict
        if (verdict.pairs and record.structure < self.rule.structure) or any(k.absent for k in record.kinds):
            left = replace(verdict.without(verdict.kept), withdrawn=(), structured=verdict.kept)
            return replace(left, identification=replace(record, missing=(*record.missing, "kinds")))
        kind = verdict.kind if record.holds else VerdictKind.BEHAVES_LIKE
        return replace(verdict, kind=kind, identification=record)

    def held(self, decision: Decision, verdict: Verdict, y: np.ndarray) -> Identification:
        """The one explanation of a verdict held against every model discrepancy."""
        sd = self.noise(verdict)
        margins = self.missing(sd).margins
        margin = max(margins[n] for n in verdict.kept[0])
        return identification(decision, verdict, y, self.rivals(sd), margin, self.folds)

    def _second_look(
        self, decision: Decision, verdict: Verdict, record: Identification, y: np.ndarray, pairs: bool
    ) -> tuple[Verdict, Identification | None]:
        """Withdraw a single name that leaves structure; try pairs before it is given where the residuals ask."""
        names = record.names
        if record.structure >= self.rule.asks or (record.structure >= self.rule.structure and not pairs):
            return verdict, record
        rejected = {**verdict.tested, names: replace(verdict.tested[names], kept=False)}
        bare = replace(verdict.without([names]), withdrawn=(), structured=(names,), tested=rejected)
        both = decision.with_pairs(y, bare) if pairs else bare
        better = record.structure < self.rule.structure
        if both.pairs and not better:
            second = both.tested[both.pairs[0]].gain - verdict.tested[names].gain
            trials = max(len(self.design.causes) - 1, 1)
            better = 2.0 * second >= chdtri(1.0, PAIR_TAIL / trials)
        if not better:
            return replace(verdict, tried_pairs=both.tried_pairs), record
        if len(both.pairs) != 1:
            return both, None
        return both, self.held(decision, both, y)
