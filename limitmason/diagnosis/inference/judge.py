"""The whole judgement of a data set: the rule, identifiability, and pairs where the residuals ask for them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from limitmason.diagnosis.inference.bootstrap import Draws
from limitmason.diagnosis.inference.decide import Rule, explained, gate, noise_of, with_pairs
from limitmason.diagnosis.inference.design import Design
from limitmason.diagnosis.inference.discrepancy import Rivals, identification
from limitmason.diagnosis.inference.missing import Missing, leave_each_out
from limitmason.diagnosis.inference.shared import doubted
from limitmason.diagnosis.inference.verdict import Identification, Verdict, VerdictKind

PAIR_TAIL = 0.02  # chance that some second cause improves a single one by as much as noise alone


class Judge:
    """Judges data sets of one design and list.

    Parameters
    ----------
    design : tables
    known : the same with a known noise, for rehearsals; called with the estimate of the noise where it is not stated
    covariates : name to values of all specimens
    folds : number of the group of each specimen, left out together, shape (n,); None leaves single ones out
    rule : thresholds
    seed : of the rehearsal
    unstated : circumstances of the tests that no column tells: an alarm must outlast noise shared within them
    rehearsed : the judge whose rehearsal is taken, that of independent noise where this one carries shared noise: its
        shares hang on the data, the margins should not
    """

    def __init__(
        self,
        design: Design,
        known: Callable[[float], Design],
        covariates: Mapping[str, Sequence],
        folds: np.ndarray | None = None,
        rule: Rule | None = None,
        seed: int = 0,
        rehearsed: "Judge | None" = None,
        unstated: tuple[str, ...] = (),
    ):
        self.design, self.known, self.covariates, self.seed = design, known, covariates, seed
        self.rehearsed, self.unstated = rehearsed, unstated
        self.rule = rule or Rule()
        self.folds = np.arange(design.n) if folds is None else folds
        self._rivals: dict[float, Rivals] = {}
        self._missing: dict[float, Missing] = {}

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
            self._rivals[sd] = Rivals(self.design, self.covariates, sd)
        return self._rivals[sd]

    def noise(self, verdict: Verdict) -> float:
        """Noise of the best explanation of a verdict in stated units, to two digits; 1 where it is stated."""
        if self.design.noise.kind != "unknown":
            return 1.0
        names = verdict.kept[0] if verdict.kept else ()
        fit = verdict.tested[names].fit if names else verdict.null
        return float(f"{noise_of(self.design, names, fit):.2g}")

    def gate(self, y: np.ndarray, draws: Draws) -> Verdict:
        """Whether one data set raises an alarm, before anything is sought that explains it."""
        verdict = gate(self.design, y, draws, self.rule)
        return doubted(self.design, y, verdict, draws, self.rule, self.covariates, self.unstated)

    def __call__(self, y: np.ndarray, draws: Draws, pairs: bool = True, alarm: Verdict | None = None) -> Verdict:
        """The verdict on one data set.

        Parameters
        ----------
        y : whitened data, shape (n,)
        draws : standard errors for the bootstrap
        pairs : whether pairs of causes are tried where no single one is left, or the residuals ask for them
        alarm : what a gate said of the same data, which may have carried other shares of the noise; None asks its own
        """
        alarm = self.gate(y, draws) if alarm is None else alarm
        verdict = explained(self.design, y, alarm, draws, self.rule, pairs)
        if not self.rule.identify:
            return verdict
        verdict = self._identified(verdict, y, draws, pairs)
        return replace(verdict, rehearsed=self.missing(self.noise(verdict)))

    def _identified(self, verdict: Verdict, y: np.ndarray, draws: Draws, pairs: bool) -> Verdict:
        """The verdict with its one name identified, or not, or withdrawn."""
        if len(verdict.kept) != 1:
            return verdict
        record: Identification | None = self.held(verdict, y, draws)
        if record is not None and len(record.names) == 1:
            verdict, record = self._second_look(verdict, record, y, draws, pairs)
        if record is None:
            return verdict
        if (verdict.pairs and record.structure < self.rule.structure) or any(k.absent for k in record.kinds):
            left = replace(verdict.without(verdict.kept), withdrawn=(), structured=verdict.kept)
            return replace(left, identification=replace(record, missing=(*record.missing, "kinds")))
        kind = verdict.kind if record.holds else VerdictKind.BEHAVES_LIKE
        return replace(verdict, kind=kind, identification=record)

    def held(self, verdict: Verdict, y: np.ndarray, draws: Draws) -> Identification:
        """The one explanation of a verdict held against every model discrepancy."""
        names, sd = verdict.kept[0], self.noise(verdict)
        margins = self.missing(sd).margins
        margin = max(margins[n] for n in names)
        rivals = self.rivals(sd)
        fit = verdict.tested[names].fit
        return identification(self.design, names, fit, y, draws, self.rule, rivals, margin, self.folds, verdict.null)

    def _second_look(
        self, verdict: Verdict, record: Identification, y: np.ndarray, draws: Draws, pairs: bool
    ) -> tuple[Verdict, Identification | None]:
        """Withdraw a single name that leaves structure; try pairs before it is given where the residuals ask."""
        names = record.names
        if record.structure >= self.rule.asks or (record.structure >= self.rule.structure and not pairs):
            return verdict, record
        rejected = {**verdict.tested, names: replace(verdict.tested[names], kept=False)}
        bare = replace(verdict.without([names]), withdrawn=(), structured=(names,), tested=rejected)
        both = with_pairs(self.design, y, bare, draws, self.rule) if pairs else bare
        better = record.structure < self.rule.structure
        if both.pairs and not better:
            second = both.tested[both.pairs[0]].gain - verdict.tested[names].gain
            trials = max(len(self.design.causes) - 1, 1)
            better = 2.0 * second >= chdtri(1.0, PAIR_TAIL / trials)
        if not better:
            return replace(verdict, tried_pairs=both.tried_pairs), record
        if len(both.pairs) != 1:
            return both, None
        return both, self.held(both, y, draws)
