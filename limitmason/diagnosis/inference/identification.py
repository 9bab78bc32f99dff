"""Statistics that an explanation is identified by: against drawn data, by its margin, on values left out.

``names`` are the causes of the explanation and ``fit`` is its fit to ``data``, whitened and in the coordinates of the
design, shape (n,). A discrepancy is a smooth error of the model that could stand in for it, see ``discrepancy``.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from limitmason.diagnosis.inference.bootstrap import share_of
from limitmason.diagnosis.inference.confidence_set import ConfidenceSet
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.discrepancy import Discrepancy
from limitmason.diagnosis.inference.evidence_by_kind import Evidence, agree
from limitmason.diagnosis.inference.fit import BestFit
from limitmason.diagnosis.inference.gain import left_out
from limitmason.diagnosis.inference.missing import Missing
from limitmason.diagnosis.inference.rivals import Rivals

DRAWN = 699
"""Data sets drawn from the explanation: its own distribution of the excess; chosen."""


class AgainstDraws(NamedTuple):
    """An explanation against discrepancies, in the data and in data drawn from itself.

    Parameters
    ----------
    excess : log L(explanation) - log of the evidence of the best discrepancy
    drawn : the same of every drawn data set, shape (b,)
    structure : share of the draws whose residuals show as much of a discrepancy as those of the data [-]
    """

    excess: float
    drawn: np.ndarray
    structure: float

    @property
    def p(self) -> float:
        """Share of the draws with an excess as small: its chance, were the explanation true [-]."""
        return share_of(self.drawn <= self.excess)

    @property
    def expected(self) -> float:
        """Excess that one would expect, were the explanation true: the median of the draws."""
        return float(np.median(self.drawn))


def against_draws(
    design: Design, rivals: Rivals, decision: ConfidenceSet, names: Names, fit: BestFit, data: np.ndarray
) -> AgainstDraws:
    """Excess and structure of an explanation beside those of data that ``decision`` draws from it.

    Every draw is fitted anew by the explanation.
    """
    parts = rivals.parts(names, fit)
    # values, the inputs' own measured values [sd], and variances of replicates, one row per draw
    drawn, z, replicate = decision.drawn(names, fit, slice(0, min(DRAWN, decision.count)))
    again = design.fit(names, drawn, z, replicate)
    # the inputs' own data are part of the draw: what the fit leaves of them is a shift of the values to first order
    shifted = drawn - z @ (rivals.slopes * rivals.sd).T
    structure = float(rivals.structure(names, fit)[0])
    return AgainstDraws(
        excess=float(rivals.excess(names, fit, data, parts=parts)[0]),
        drawn=rivals.excess(names, again, shifted, replicate, parts),
        structure=share_of(rivals.structure(names, again, replicate) >= structure),
    )


def margin_of(names: Names, kinds: Sequence[Evidence], margins: Missing) -> float:
    """Log-likelihood that the excess must reach, by which other effects would seldom get this name.

    A single cause of which two kinds of data show one size needs less: a discrepancy seldom imitates that.

    Parameters
    ----------
    kinds : what every kind of data shows of the explanation
    margins : of a rehearsal with true causes taken off the list
    """
    if len(names) == 1 and agree(kinds):
        return margins.agreed[names[0]]
    return max(margins.margins[n] for n in names)


class UnseenScores(NamedTuple):
    """Log scores of values that are predicted without their fold, sums over all [-].

    Parameters
    ----------
    over_baseline : of the explanation, less that of the baseline
    ahead : of the explanation, less that of the nearest discrepancy
    ahead_error : standard error of that, sqrt(folds) times the deviation of the sums of single folds
    """

    over_baseline: float
    ahead: float
    ahead_error: float

    @property
    def holds(self) -> bool:
        """Whether it beats the baseline, and is not behind the discrepancy by more than the standard error."""
        return self.over_baseline > 0.0 and self.ahead + self.ahead_error >= 0.0


def unseen_values(
    design: Design, discrepancy: Discrepancy, names: Names, data: np.ndarray, folds: np.ndarray, sd: float
) -> UnseenScores:
    """How well an explanation predicts values that its fit has not seen, beside baseline and nearest discrepancy.

    Parameters
    ----------
    discrepancy : those that could stand in for the explanation
    folds : number of the group of every value, left out together, shape (n,)
    sd : noise in stated units
    """
    own, base = (left_out(design, n, data, folds).score for n in (names, ()))
    miss, spread = discrepancy.left_out(discrepancy.best(data[None], design.like), data, folds)
    by_fold = np.bincount(folds, weights=own - design.like.log_score(miss, spread * sd**2))
    error = float(np.sqrt(len(by_fold)) * by_fold.std(ddof=1)) if len(by_fold) > 1 else 0.0
    return UnseenScores(float(np.sum(own - base)), float(by_fold.sum()), error)
