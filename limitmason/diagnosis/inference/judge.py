"""The whole judgement of a data set: shared noise, gate, causes, identification.

``y`` are the whitened values of the data set, shape (n,), ``data`` the same in the coordinates of its design,
``effect`` what an explanation changes in them, ``sd`` the noise in stated units and ``loglik`` the log-likelihood of
the fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtri

from limitmason.diagnosis.inference.bootstrap import share_of
from limitmason.diagnosis.inference.confidence_set import ConfidenceSet
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.discrepancy import dose_of, dosed
from limitmason.diagnosis.inference.evidence_by_kind import Evidence, agree, by_kind
from limitmason.diagnosis.inference.gain import folds_of, worse_by_fold
from limitmason.diagnosis.inference.identification import DRAWN, against_draws, margin_of, unseen_values
from limitmason.diagnosis.inference.missing import Missing, leave_each_out
from limitmason.diagnosis.inference.noise import Draws
from limitmason.diagnosis.inference.rivals import DRIFT, Rivals
from limitmason.diagnosis.inference.shared_noise import Shares, estimated_shares
from limitmason.diagnosis.inference.trends import chance_along
from limitmason.diagnosis.inference.verdict import CONDITIONS, Identification, Rule, Verdict, VerdictKind

ROUNDS = 6  # of renewed tables of pairs
PAIR_TAIL = 0.02  # chance that some second cause improves a single one by as much as noise alone
LEVER = 2.0  # log-likelihood by which a name must beat every listed lever with another dependence
CLOSE = 1e-6  # log-likelihood that rounding may be
UNFELT = 1e-6  # of the largest effect at a value of a column: less is rounding
COMMON = 0.001  # chance of so large an equal error of all values: below it they do not scatter about the simulation
ODDS = 3.0  # the same over a drift in an order that is not recorded: 20 to 1

Renewed = Callable[[Design, Verdict], bool]


@dataclass(frozen=True)
class Judged:
    """A verdict, its design, and the shares of the noise that this carries."""

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
    groups : label of the configuration of each specimen, left out together; None where each stands for itself
    rule : thresholds
    unstated : circumstances of the tests that no column tells: an alarm must outlast noise shared within them
    rehearsed : the judge whose rehearsal is taken, that of independent noise where this one carries shared noise: its
        shares hang on the data, the margins should not
    seed : of the rehearsal
    """

    design: Design
    known: Callable[[float], Design]
    groups: Sequence | None
    rule: Rule = field(default_factory=Rule)
    unstated: tuple[str, ...] = ()
    rehearsed: Judge | None = None
    seed: int = 0
    _rivals: dict[float, Rivals] = field(default_factory=dict, init=False)
    _missing: dict[float, Missing] = field(default_factory=dict, init=False)

    @cached_property
    def _folds(self) -> np.ndarray:
        """Number of the group of each specimen, shape (n,)."""
        return folds_of(self.groups, self.design.n)

    def missing(self, sd: float = 1.0) -> Missing:
        """What happens when the true cause is not on the list, and margins against it.

        Parameters
        ----------
        sd : noise in stated units, where it is not stated
        """
        if self.rehearsed is not None:
            return self.rehearsed.missing(sd)
        if sd not in self._missing:
            rivals, rule = self.rivals(sd), self.rule
            self._missing[sd] = leave_each_out(
                self.design, self.known(sd), rivals.of_each,
                lambda name, effect, *found: self._beside_margin((name,), sd, effect, *found), self.seed,
                floor=rule.margin, agreed=rule.agreed, share=rule.missing, each=rule.each,
            )
        return self._missing[sd]

    def _beside_margin(
        self, names: Names, sd: float, effect: np.ndarray, loglik: float, y: np.ndarray, kinds: Sequence[Evidence]
    ) -> bool:
        """Whether the conditions of a name beside its margin hold, without draws.

        ``kinds`` is what each kind of data shows of it; the other arguments are those of the module.
        """
        rivals = self.rivals(sd)
        _, beyond, asked = self._nearest_lever(rivals, names, effect, loglik, y)
        slope, error = dose_of(rivals.of(names), rivals.slopes, effect, y, sd)
        return beyond >= asked and dosed(slope, error) and self._by_kinds(names, effect, kinds)

    def _by_kinds(self, names: Names, effect: np.ndarray, kinds: Sequence[Evidence]) -> bool:
        """Whether two kinds of data show one size of a cause, or its dose along a column.

        Two kinds of one specimen are no evidence: what is peculiar to it may change both alike.
        """
        doses = any(c in self.design.numeric and self._grows(effect, c) for c in self.design.own(names))
        one_size = agree(kinds) and not self.design.alone
        return len(names) == 1 and (one_size or (doses and not any(k.absent for k in kinds)))

    def _grows(self, effect: np.ndarray, column: str) -> bool:
        """Whether an effect acts at two values of a column of numbers or more, not alike.

        A batch that is called 2 is no dose.
        """
        size = np.abs(self.design.apart(effect) * self.design.scale)
        values = np.asarray(self.design.columns[column], dtype=float)
        means = np.array([size[values == v].mean() for v in np.unique(values)])
        felt = means[means > UNFELT * means.max()]
        return len(felt) > 1 and bool(np.ptp(felt) > UNFELT * means.max())

    def _nearest_lever(
        self, rivals: Rivals, names: Names, effect: np.ndarray, loglik: float, data: np.ndarray
    ) -> tuple[str, float, float]:
        """Nearest rival lever, log-likelihood of the explanation over it, and that asked.

        A lever is what a listed cause acts through, here with another dependence on the columns than the explanation
        has. A drift from test to test is one of them, with its own threshold.

        Returns
        -------
        rival, beyond, asked : its name; by how much the explanation is likelier [log]; how much is asked [log]
        """
        like, levers = self.design.like, rivals.levers(names)
        rival, beyond, asked = "", np.inf, LEVER  # where there is no lever, nothing comes near
        if levers.along:
            each = levers.each(data[None], like)[0]
            rival, beyond = levers.along[int(each.argmax())], loglik - float(each.max())
        over_drift = loglik - rivals.drift(names, effect, data[None], like)
        # the one that is beaten by least beyond what is asked, or lacks most of it
        return (DRIFT, over_drift, ODDS) if over_drift - ODDS < beyond - asked else (rival, beyond, asked)

    def rivals(self, sd: float = 1.0) -> Rivals:
        """Discrepancy biases, in units of the noise."""
        if sd not in self._rivals:
            self._rivals[sd] = Rivals(self.design, sd)
        return self._rivals[sd]

    def noise(self, verdict: Verdict) -> float:
        """Noise of the best explanation in stated units, two digits, or 1 where stated."""
        if self.design.noise.kind != "unknown":
            return 1.0
        names = verdict.kept[0] if verdict.kept else ()
        fit = verdict.tested[names].fit if names else verdict.null
        return float(f"{self.design.noise_of(names, fit):.2g}")

    def carrying(self, shares: Shares) -> Judge:
        """This judge with shared noise carried, margins as for independent noise."""
        if not shares.shares:
            return self
        return replace(self, design=self.design.sharing(shares.correlation), rehearsed=self)

    def decide(
        self, y: np.ndarray, draws: Draws, pairs: bool, shared: Sequence[str] | None, renewed: Renewed
    ) -> Judged:
        """The verdict on one data set, noise shared as its residuals say.

        With few repeats the noise is too uncertain to reject a bad fit; what is left out as a whole still tells: an
        explanation is withdrawn when its score by group is negative by more than its standard error.

        Parameters
        ----------
        y : whitened data, per specimen, shape (n,)
        draws : standard errors for the bootstrap
        pairs : whether pairs of causes are tried
        shared : columns whose labels may share noise; None are the circumstances of the tests
        renewed : checks the tables of pairs that a verdict hangs on, and says whether one was replaced
        """
        # shares of the noise beside the baseline, the gate with them, and for an alarm shares beside its best cause
        shares = estimated_shares(self.design, y, shared)
        alarm = ConfidenceSet(self.carrying(shares).design, draws, self.rule).alarm(y, self.unstated)
        if alarm.kind == VerdictKind.UNEXPLAINED and shares.estimated:
            shares = estimated_shares(self.design, y, shared, price=alarm.critical_gain)
        judge = self.carrying(shares)
        verdict = judge.judge_with_own_noise(y, draws, pairs, alarm)
        # judged anew while a table of a pair that the verdict hangs on was wrong, and was replaced
        for _ in range(ROUNDS):
            if not renewed(judge.design, verdict):
                break
            if judge is not self:
                self.design.forget_pairs()  # the design of independent noise has grids of the wrong tables too
            verdict = judge.judge_with_own_noise(y, draws, pairs, alarm)
        # made now: a closed design makes no table, and who judges again tries all pairs
        for names in self.design.pair_names if verdict.pairs else ():
            self.design.grid(names)
        return Judged(self.beside_groups(judge, verdict, y, draws), judge.design.closed(), shares)

    def beside_groups(self, judge: Judge, verdict: Verdict, y: np.ndarray, draws: Draws) -> Verdict:
        """The verdict of a judge, without what predicts groups left out worse than the baseline does.

        ``judge`` is this one or the same with shared noise carried, and ``draws`` are those of its bootstrap.
        """
        kept = () if self.groups is None else verdict.kept
        worse = [names for names in kept if worse_by_fold(self.design, names, y, self._folds)]
        if not worse:
            return verdict
        # one that is left, of several, gets its record now
        return judge._recorded(ConfidenceSet(judge.design, draws, self.rule), verdict.without(worse), y, pairs=False)

    def judge_with_own_noise(
        self, y: np.ndarray, draws: Draws, pairs: bool = True, alarm: Verdict | None = None
    ) -> Verdict:
        """The verdict on one data set with the noise that this judge carries.

        Parameters
        ----------
        y : whitened data, per specimen, shape (n,)
        draws : standard errors for the bootstrap
        pairs : whether pairs of causes are tried where no single one is left, or the residuals ask for them
        alarm : what a gate said of the same data, which may have carried other shares of the noise; None asks its own
        """
        decision = ConfidenceSet(self.design, draws, self.rule)
        alarm = decision.alarm(y, self.unstated) if alarm is None else alarm
        if alarm.kind == VerdictKind.SCATTER:
            verdict = self.beside_scatter(decision, alarm, y)
        else:
            verdict = decision.explained(y, alarm, pairs)
        if self.rule.identify:
            verdict = self.beside_levers(verdict, y)
        return self._recorded(decision, verdict, y, pairs)

    def _recorded(self, decision: ConfidenceSet, verdict: Verdict, y: np.ndarray, pairs: bool) -> Verdict:
        """The verdict with what stands behind it, where the rule asks for that."""
        if not self.rule.identify:
            return verdict
        verdict = self.with_identification(decision, verdict, y, pairs)
        return replace(verdict, rehearsed=self.missing(self.noise(verdict)))

    def with_identification(self, decision: ConfidenceSet, verdict: Verdict, y: np.ndarray, pairs: bool) -> Verdict:
        """The verdict with the record of its one explanation, if it has just one.

        It becomes "behaves like" where a condition of the record is missing. It is withdrawn where its residuals keep a
        model discrepancy, or a kind of data that should show the effect does not.

        Parameters
        ----------
        decision : draws data from explanations
        verdict : of the confidence set
        y, pairs : data, and whether two causes may be tried
        """
        if len(verdict.kept) != 1:  # nothing is named, or a set
            return verdict
        record: Identification | None = self.identification_of(decision, verdict, y)
        if record is not None and len(record.names) == 1:
            verdict, record = self._second_look(decision, verdict, record, y, pairs)
        if record is None:  # no single explanation is left
            return verdict
        if (verdict.pairs and record.structure < self.rule.structure) or any(k.absent for k in record.kinds):
            left = verdict.without(verdict.kept[:1], "structured")
            return replace(left, identification=replace(record, missing=(*record.missing, "kinds")))
        return replace(verdict, kind=verdict.kind if record.holds else VerdictKind.BEHAVES_LIKE, identification=record)

    def beside_scatter(self, decision: ConfidenceSet, verdict: Verdict, y: np.ndarray) -> Verdict:
        """More scatter, or unexplained where a lever by specimen or an equal error of all values does better.

        A factor of every specimen that its force and its stiffness share, or a friction that some walls feel, is no
        scatter of single values. The log-likelihood of such a lever over scatter of each kind is compared with that in
        data drawn from the scatter, only where the noise is known. ``verdict`` says "more scatter than stated", and
        data are drawn by the errors and inputs of ``decision``.
        """
        design = self.design
        if chance_along(verdict.null.residuals[0], design.turned(1.0 / design.scale)) < COMMON:
            return replace(verdict, kind=VerdictKind.UNEXPLAINED)
        if not design.like.known:
            return verdict
        rivals, data = self.rivals(), design.turned(y)[None]
        if not rivals.by_specimen.along:  # no listed cause is felt
            return verdict
        # 1. the baseline fitted to the data: each kind of data scatters as its residuals do, and as stated at least
        fit = design.fits([()], data, residuals=True)[0]
        spread = np.ones(design.n)
        for inside in design.of_kind:
            spread[inside] = max(1.0, float(np.sqrt(np.mean(fit.residuals[0, inside] ** 2))))
        # 2. data drawn from that scatter, with measured inputs z drawn about the fitted ones
        rows, at = slice(0, min(DRAWN, decision.count)), design.null.z_at(fit.position)[0]
        z = at + decision.draws.inputs[rows]
        drawn = design.predicted((), fit)[0] + spread * decision.draws.errors[rows]
        # 3. the same statistic of each: the best lever over the scatter, less the shift that the inputs' own data make
        again = design.fits([()], drawn, z, residuals=True)[0]
        over = rivals.over_scatter(again, drawn - z @ rivals.slopes.T)
        # 4. scatter stands where drawn data reach what the real ones do often enough
        p = {**verdict.p, "lever": share_of(over >= float(rivals.over_scatter(fit, data)[0]))}
        if p["lever"] >= self.rule.guard:
            return replace(verdict, p=p)
        levers = rivals.by_specimen
        return replace(verdict, kind=VerdictKind.UNEXPLAINED, p=p, rival=levers.along[levers.best(data, design.like)])

    def beside_levers(self, verdict: Verdict, y: np.ndarray) -> Verdict:
        """The verdict without pairs for which one lever alone does as well.

        A friction that differs by direction acts through one lever, and two listed causes together can imitate it. A
        pair must beat every such lever by as much as a single name must.
        """
        rivals, rivalled = self.rivals(self.noise(verdict)), list[Names]()
        nearest = (-np.inf, "")  # log evidence and name of the best lever among those that do as well
        for names in verdict.pairs:
            levers = rivals.levers(names)
            each = levers.each(self.design.turned(y)[None], self.design.like)[0] if levers.along else np.zeros(0)
            if len(each) and float(verdict.tested[names].fit.loglik[0]) - each.max() < LEVER:
                rivalled.append(names)
                nearest = max(nearest, (float(each.max()), levers.along[int(each.argmax())]))
        if not rivalled:
            return verdict
        return replace(verdict.without(rivalled, "rivalled"), rival=nearest[1])

    def identification_of(self, decision: ConfidenceSet, verdict: Verdict, y: np.ndarray) -> Identification:
        """Record that holds one explanation against every model discrepancy, condition by condition.

        It is the first that ``verdict`` keeps; ``decision`` draws data from it.
        """
        design, names = self.design, verdict.kept[0]
        noise = self.noise(verdict)  # in stated units, as rivals and margins are kept by
        rivals, margins = self.rivals(noise), self.missing(noise)
        fit, data = verdict.tested[names].fit, design.turned(y)
        sd, effect = design.noise_of(names, fit), design.effect(names, fit)
        discrepancy, (loglik,) = rivals.of(names), fit.loglik
        rival, beyond, lever_margin = self._nearest_lever(rivals, names, effect, float(loglik), data)
        against = against_draws(design, rivals, decision, names, fit, data)
        slope, error = dose_of(discrepancy, rivals.slopes, effect, data, sd)
        kinds = by_kind(design, effect, y, verdict.null.residuals[0], fit.residuals[0], sd)
        margin = margin_of(names, kinds, margins)
        unseen = unseen_values(design, discrepancy, names, data, self._folds, sd)
        holds = {  # by the names of ``CONDITIONS``
            "lever": against.expected >= margin,
            "dose": dosed(slope, error),
            "excess": against.excess >= margin,
            "usual": against.p >= self.rule.usual,
            "left out": unseen.holds,
            "rival levers": beyond >= lever_margin,
            "kinds": self._by_kinds(names, effect, kinds),
        }
        return Identification(
            names=names, missing=tuple(name for name in CONDITIONS if not holds[name]),
            along=discrepancy.along[discrepancy.best(data[None], design.like)], excess=against.excess, margin=margin,
            expected=against.expected, chance=float(np.mean(against.drawn >= margin)), p=against.p, slope=slope,
            slope_error=error, ahead=unseen.ahead, ahead_error=unseen.ahead_error, structure=against.structure,
            kinds=kinds, rival=rival, rival_excess=beyond, alone=design.alone,
        )

    def _second_gains(self, verdict: Verdict, names: Names, y: np.ndarray) -> float:
        """Log-likelihood of the best pair, tested or not, above that of a single cause."""
        pairs = self.design.pair_names
        found = self.design.fits(pairs, self.design.turned(y)) if pairs else []
        return max((float(f.loglik[0]) for f in found), default=-np.inf) - float(verdict.tested[names].fit.loglik[0])

    def _second_look(
        self, decision: ConfidenceSet, verdict: Verdict, record: Identification, y: np.ndarray, pairs: bool
    ) -> tuple[Verdict, Identification | None]:
        """Withdraw a single name whose residuals keep structure, or try pairs first.

        Pairs are tried where the residuals ask for them. A pair counts if it gains more over the single name than the
        best of all second causes would by chance.

        Parameters
        ----------
        decision : the confidence set, which tries pairs
        verdict, record : the single name, and what stands behind it
        y, pairs : data, and whether pairs may be tried

        Returns
        -------
        verdict, record : as they were, or of what is left: a pair, several (record None), or nothing (record None)
        """
        # better: whether something is known to do better than the single name, here structure in its residuals
        names, better = record.names, record.structure < self.rule.structure
        if record.structure >= self.rule.asks or not (better or pairs):
            return verdict, record
        # gain of the best of all second causes by chance, by Bonferroni over their number
        enough = 0.5 * chdtri(1.0, PAIR_TAIL / max(len(self.design.causes) - 1, 1))
        if not better and self._second_gains(verdict, names, y) < enough - CLOSE:
            return replace(verdict, tried_pairs=bool(self.design.pair_names)), record
        bare = verdict.without([names], "structured")
        both = self.beside_levers(decision.with_pairs(y, bare), y) if pairs else bare
        if both.pairs and not better:  # a pair that is kept must itself gain enough
            better = both.tested[both.pairs[0]].gain - verdict.tested[names].gain >= enough
        if not better:
            return replace(verdict, tried_pairs=both.tried_pairs), record
        if len(both.pairs) != 1:
            return both, None
        return both, self.identification_of(decision, both, y)
