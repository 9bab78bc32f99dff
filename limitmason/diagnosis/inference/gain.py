"""Gain of an extension: predicted against measured, and values left out.

``y`` are the whitened values, shape (n,), and ``folds`` the number of the fold of each specimen, (n,).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from limitmason.diagnosis.inference.design import Design, Names

ROUNDING = 1e-9  # of a log-likelihood: two that are nearer are equal
_CLOSE = 1e-6  # log score that rounding may be


def told_error(error: float) -> str:
    """A root mean square of logarithms in words: per cent, or a factor beyond 2."""
    return f"{100.0 * error:.1f} %" if error < np.log(2.0) else f"a factor of {np.exp(error):.3g}"


@dataclass(frozen=True)
class Score:
    """Log predictive score of an extension minus the baseline's, of values left out.

    Parameters
    ----------
    total : sum; positive when the extension predicts better
    error : standard error of the sum from the spread of the left-out parts
    each : per specimen, shape (n,)
    """

    total: float
    error: float
    each: np.ndarray

    def __str__(self) -> str:
        return f"{self.total:+.2f} +- {self.error:.2f}"


@dataclass(frozen=True)
class Gain:
    """What an extension gains on the data of one study.

    Parameters
    ----------
    names : the causes switched on
    error_before, error_after : root mean square of log(measured / predicted), baseline as stated and extension fitted
    error_left_out : the same for specimens predicted without their own value
    leave_one_out : score of single specimens left out
    leave_group_out : score of whole groups left out; None without groups
    selected : score when the choice among the whole list is repeated without the part left out
    leave_kind_out : score of each kind of evidence predicted by fits to the others; empty for one kind
    """

    names: Names
    error_before: float
    error_after: float
    error_left_out: float
    leave_one_out: Score
    leave_group_out: Score | None
    selected: Score
    leave_kind_out: Mapping[str, Score] = field(default_factory=dict)

    def __str__(self) -> str:
        text = (
            f"error {told_error(self.error_before)} before, {told_error(self.error_after)} after, "
            f"{told_error(self.error_left_out)} left out; log score left out {self.leave_one_out}"
        )
        if self.leave_group_out is not None:
            text += f", by group {self.leave_group_out}"
        for kind, score in self.leave_kind_out.items():
            text += f", {kind} from the other kinds {score.total:+.2f}"
        return text + f", with the choice repeated {self.selected}"


def measure_gain(design: Design, names: Names, y: np.ndarray, groups: Sequence | None, critical_gain: float) -> Gain:
    """Gain of one explanation on one data set.

    Every part left out is predicted by fits on the rest, baseline and extension alike, on the same grid. In the
    repeated selection each fold takes the cause of the list with the best fit to the rest. It takes none when that gain
    stays below what noise alone reaches.

    Parameters
    ----------
    design : tables
    names : cause or pair
    y : whitened data, shape (n,)
    groups : label per specimen, or None
    critical_gain : log-likelihood gain over the whole list that noise alone reaches with the probability of the gate

    Notes
    -----
    Wrong (optimistic) for a cause chosen on the same data, except the repeated selection; and for repeats of one
    configuration left out one at a time: leave the configuration out.
    """
    singles = np.arange(design.n)
    folds = folds_of(groups, design.n)
    best = design.fit(names, y)
    one, base = left_out(design, names, y, singles), left_out(design, (), y, singles)
    kinds = dict.fromkeys(design.kinds)
    by_kind: dict[str, Score] = {}
    if len(kinds) > 1:
        parts = folds_of(design.kinds, design.n)
        each = left_out(design, names, y, parts).score - left_out(design, (), y, parts).score
        for number, kind in enumerate(kinds):
            mine = each[parts == number]
            by_kind[kind] = _score(mine, np.arange(len(mine)))
    return Gain(
        names=names, error_before=_rms(y * design.scale), error_after=_rms(best.residuals[0] * design.scale),
        error_left_out=_rms(one.residual * design.scale), leave_one_out=_score(one.score - base.score, singles),
        leave_group_out=None if groups is None else score_by_fold(design, names, y, folds),
        selected=_score(_selected(design, y, folds, critical_gain), folds), leave_kind_out=by_kind,
    )


@dataclass(frozen=True)
class Unseen:
    """Every value predicted by fits without its fold.

    Parameters
    ----------
    score : log predictive score, shape (n,)
    residual : whitened residual, shape (n,)
    loglik : of each fit to what it has seen, one per fold
    """

    score: np.ndarray
    residual: np.ndarray
    loglik: np.ndarray


def left_out(design: Design, names: Names, y: np.ndarray, folds: np.ndarray) -> Unseen:
    """Every value predicted by an explanation that is fitted without its fold.

    Parameters
    ----------
    names, y : causes of the explanation, () for the baseline, and whitened data, shape (n,)
    folds : number of the fold of each specimen, shape (n,)
    """
    # one data set per fold, its own values at weight 0, shape (folds, n)
    weights = (folds[None, :] != np.arange(int(folds.max()) + 1)[:, None]).astype(float)
    fits = design.fit(names, np.broadcast_to(y, weights.shape), weights=weights)
    variance = design.like.variance(fits.loss, weights.sum(axis=1), spent=len(names))
    residual = fits.residuals[folds, np.arange(design.n)]
    # a cause that the rest does not feel fits with any size, of which the first was taken: it stays at its baseline
    for name in names:
        others = left_out(design, tuple(n for n in names if n != name), y, folds)
        unfelt = fits.loglik <= others.loglik + ROUNDING * (1.0 + np.abs(others.loglik))
        residual = np.where(unfelt[folds], others.residual, residual)
    return Unseen(design.like.log_score(residual, variance[folds]), residual, fits.loglik)


def score_by_fold(design: Design, names: Names, y: np.ndarray, folds: np.ndarray) -> Score:
    """Score over the baseline of values that an explanation predicts without their fold."""
    return _score(left_out(design, names, y, folds).score - left_out(design, (), y, folds).score, folds)


def worse_by_fold(design: Design, names: Names, y: np.ndarray, folds: np.ndarray) -> bool:
    """Whether an explanation predicts folds left out worse than the baseline, beyond the error of that."""
    score = score_by_fold(design, names, y, folds)
    # a cause that one fold alone feels has that fold's score alone: its error is its size, to rounding
    return score.total + score.error < -_CLOSE


def _selected(design: Design, y: np.ndarray, folds: np.ndarray, critical_gain: float) -> np.ndarray:
    """Score over the baseline of every value, (n,), with the cause best for the rest.

    The rest are the values outside its fold. It is 0 where no cause gains ``critical_gain`` on them.
    """
    null, *listed = (left_out(design, names, y, folds) for names in ((), *design.listed))
    gains = np.array([u.loglik - null.loglik for u in listed])  # shape (causes, folds)
    # number of the cause that each value is predicted by, -1 for the baseline, shape (n,)
    chosen = np.where(gains.max(axis=0) >= critical_gain, np.argmax(gains, axis=0), -1)[folds]
    scores = np.array([u.score for u in listed])
    return np.where(chosen < 0, 0.0, scores[np.maximum(chosen, 0), np.arange(design.n)] - null.score)


def _score(each: np.ndarray, folds: np.ndarray) -> Score:
    """Sum of the scores of ``each`` value, with the standard error by folds."""
    count = int(folds.max()) + 1
    # the sum of independent parts has the standard error sqrt(count) times the deviation of a part
    parts = np.bincount(folds, weights=each, minlength=count)
    error = float(np.sqrt(count) * parts.std(ddof=1)) if count > 1 else float("nan")
    return Score(float(each.sum()), error, each)


def folds_of(groups: Sequence | None, n: int) -> np.ndarray:
    """Number of the fold of each specimen, (n,): its group, or itself without groups."""
    if groups is None:
        return np.arange(n)
    names = {name: i for i, name in enumerate(dict.fromkeys(groups))}
    return np.array([names[g] for g in groups])


def _rms(residuals: np.ndarray) -> float:
    """Root mean square of residuals, in their unit."""
    return float(np.sqrt(np.mean(np.asarray(residuals) ** 2)))
