"""What is said of a data set: thresholds, kinds of answers, what stands behind.

It is decided by the sets of causes in ``confidence_set``, and settled in ``judge``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import ceil
from typing import Any

from limitmason.diagnosis.inference.design import Names
from limitmason.diagnosis.inference.evidence_by_kind import Evidence
from limitmason.diagnosis.inference.fit import BestFit
from limitmason.diagnosis.inference.missing import Missing
from limitmason.diagnosis.inference.noise import DRAWS


@dataclass(frozen=True)
class Rule:
    """Thresholds on bootstrap p.

    Parameters
    ----------
    gain, shape, scatter : the gate: below any of them the baseline is not enough
    guard : a scatter with neither a scale-free gain nor a trend below this is "more scatter than stated"
    deficit, kept_shape, kept_scatter : a cause below any of them is rejected under its own fit
    hopeless : log-likelihood deficit at which a pair is rejected without bootstrap
    hopeless_tail : nominal tail probability of trend or scatter at which a pair is rejected without bootstrap
    far : log-likelihood by which a rival misses what an explanation predicts, beyond which it is not refitted to the
        data drawn from that explanation (a chance of less than 1e-7 a draw)
    screen : whether single causes that are hopeless are rejected without bootstrap as well
    draws : most draws
    identify : whether a name must be identified; without, whatever is the only one left is named
    margin : least log-likelihood by which a name must beat every smooth model discrepancy; 10 was set on pilot trials
    agreed : the same where two kinds of evidence show one size; 6.5 was set on pilot trials
    missing, each : largest share of data sets, with a cause that was taken off the list, in which any name, or one and
        the same name, is given; the margin is raised until it holds
    usual : a name that beats the discrepancies by less than this share of data drawn from it do, is not identified
    structure : a single name whose residuals show a model discrepancy as seldom as this is withdrawn
    asks : as seldom as this, and pairs are tried before it is given
    """

    gain: float = 0.03
    shape: float = 0.01
    scatter: float = 0.01
    guard: float = 0.05
    deficit: float = 0.02
    kept_shape: float = 0.005
    kept_scatter: float = 0.005
    hopeless: float = 15.0
    hopeless_tail: float = 1e-5
    far: float = 60.0
    screen: bool = False
    draws: int = DRAWS
    identify: bool = True
    margin: float = 10.0
    agreed: float = 6.5
    missing: float = 0.05
    each: float = 0.01
    usual: float = 0.02
    structure: float = 0.005
    asks: float = 0.10


def fewest_draws(rule: Rule) -> int:
    """Draws by which the bootstrap can reach every threshold of the gate: p is 1 / (draws + 1) at least."""
    smallest = min((p for p in (rule.gain, rule.shape, rule.scatter) if p > 0.0), default=1.0)
    return max(1, ceil(1.0 / smallest - 1.0 - 1e-9))  # 1e-9: of rounding


class VerdictKind(StrEnum):
    """What is said: nothing, a name, one of several, two, off the list, scatter."""

    NONE = "none"
    CAUSE = "cause"
    BEHAVES_LIKE = "behaves like"
    EITHER = "either"
    TWO = "two"
    UNEXPLAINED = "unexplained"
    SCATTER = "scatter"


@dataclass(frozen=True)
class Tested:
    """One explanation held against the data under its own fit.

    Parameters
    ----------
    names : the cause or the pair
    kept : whether it is neither rejected nor withdrawn
    sizes : fitted sizes
    z : refitted nuisance inputs in standard deviations
    gain : log-likelihood above the baseline
    deficit : log-likelihood below the best explanation of its kind
    p : "deficit", "shape" and "scatter"; a missing one was not needed. Above the threshold it means "not rejected"
    draws : number of draws behind them
    fit : fit itself
    """

    names: Names
    kept: bool
    sizes: tuple[float, ...]
    z: tuple[float, ...]
    gain: float
    deficit: float
    p: dict[str, float]
    draws: int
    fit: BestFit


CONDITIONS = ("lever", "dose", "excess", "usual", "left out", "rival levers", "kinds")
BEYOND_FIT = ("rival levers", "kinds")  # conditions that no statistics of one kind of data can meet


@dataclass(frozen=True)
class Identification:
    """What stands behind a name, and what is missing for it.

    Parameters
    ----------
    names : the explanation
    missing : conditions that do not hold, of ``CONDITIONS``; none of them: it is identified
    along : covariate of the model discrepancy that comes nearest
    excess : log-likelihood of the explanation over the evidence of the best model discrepancy
    margin : that it must reach
    expected : median of it in data drawn from the explanation; below the margin, the design does not vary what only
        this cause acts through
    chance : share of these in which it reaches the margin: how often this design identifies it
    p : share of these with an excess as small as that of the data
    slope, slope_error : of the data along that contrast; 0 is no effect, 1 the fitted size
    ahead : log score of values left out, explanation minus model discrepancy
    ahead_error : its standard error
    structure : share of these draws whose residuals show as much of a model discrepancy as those of the data
    kinds : what each kind of data shows of it
    rival : the nearest listed lever with another dependence
    rival_excess : log-likelihood over its evidence
    alone : whether all values are of one specimen
    """

    names: Names
    missing: tuple[str, ...]
    along: str
    excess: float
    margin: float
    expected: float
    chance: float
    p: float
    slope: float
    slope_error: float
    ahead: float
    ahead_error: float
    structure: float
    kinds: tuple[Evidence, ...] = ()
    rival: str = ""
    rival_excess: float = float("inf")
    alone: bool = False

    @property
    def distinct(self) -> bool:
        """Whether it is told from every smooth discrepancy, which one kind of data can do."""
        return not set(self.missing) - set(BEYOND_FIT)

    @property
    def holds(self) -> bool:
        """Whether it is identified."""
        return not self.missing


@dataclass(frozen=True)
class Doubt:
    """An alarm where it is not recorded which tests have a circumstance in common.

    Parameters
    ----------
    names : the cause with the largest gain; the tests that it acts on are taken to share half the noise's variance
    unstated : circumstances that no column tells
    p : the gate's "gain", "shape" and "scatter" under such noise
    holds : whether the alarm stands all the same; else the verdict is "none"
    """

    names: Names
    unstated: tuple[str, ...]
    p: Mapping[str, float]
    holds: bool


@dataclass(frozen=True)
class Verdict:
    """What the rule says about one data set.

    Parameters
    ----------
    kind : of the answer
    causes : kept causes, best first; for a pair the causes of the best pair
    pairs : kept pairs, best first
    covariate, trend : best trend of the residuals at the baseline, None when none is seen
    p : the gate's "gain", "shape", "scatter" and "guard"; "lever", where more scatter was held against levers that
        differ from specimen to specimen
    critical_gain : log-likelihood gain over the whole list that noise alone reaches with probability ``Rule.gain``
    tested : all explanations that were held against the data, by names
    null : fit of the baseline
    tried_pairs : whether pairs were held against the data
    withdrawn : explanations that fit but predict whole groups left out worse than the baseline does
    structured : single names that fit but leave a model discrepancy in the residuals
    rivalled : pairs that fit, but do no better than one lever with another dependence
    rival : that lever and its column; or the lever that differs from specimen to specimen, as more scatter would not
    identification : what stands behind the single name or pair, None where there is none
    rehearsed : how often a name is given where the true cause is missing from the list, None where no name is at stake
    doubt : an alarm held against noise that tests share unstated, None without an alarm or where all is recorded
    """

    kind: VerdictKind
    causes: Names
    pairs: tuple[Names, ...]
    covariate: str | None
    trend: str | None
    p: dict[str, float]
    critical_gain: float
    tested: dict[Names, Tested]
    null: BestFit
    tried_pairs: bool = False
    withdrawn: tuple[Names, ...] = ()
    structured: tuple[Names, ...] = ()
    rivalled: tuple[Names, ...] = ()
    rival: str = ""
    identification: Identification | None = None
    rehearsed: Missing | None = None
    doubt: Doubt | None = None

    @property
    def kept(self) -> tuple[Names, ...]:
        """Explanations that are not rejected: single causes or pairs, best first."""
        return self.pairs or tuple((name,) for name in self.causes)

    @property
    def distinct(self) -> bool:
        """Whether one explanation is left, told from every smooth discrepancy.

        The one explanation need not be identified.
        """
        if len(self.kept) != 1:
            return False
        return self.identification.distinct if self.identification is not None else self.kind != "behaves like"

    def without(self, names: Sequence[Names], why: str = "withdrawn") -> "Verdict":
        """The verdict without some explanations, "unexplained" if none is left.

        Parameters
        ----------
        names : the explanations
        why : field that they are told in: "withdrawn", "structured" or "rivalled"
        """
        left = tuple(n for n in self.kept if n not in set(names))
        tested = {n: replace(t, kept=False) if n in names else t for n, t in self.tested.items()}
        if not left:
            kind = VerdictKind.UNEXPLAINED
        elif self.pairs or self.kind == VerdictKind.BEHAVES_LIKE:
            kind = self.kind
        else:
            kind = VerdictKind.CAUSE if len(left) == 1 else VerdictKind.EITHER
        gone = self.identification is not None and self.identification.names in names
        told: dict[str, Any] = {why: (*names, *getattr(self, why))}
        return replace(
            self, kind=kind, causes=left[0] if left and self.pairs else tuple(n[0] for n in left),
            pairs=left if self.pairs else (), tested=tested, identification=None if gone else self.identification,
            **told,
        )
