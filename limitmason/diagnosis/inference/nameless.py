"""A smooth bias without a name: what the covariates alone could do, as Gaussian processes, the rival of every name."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.shapes import is_numeric

AMPLITUDES = (1.5, 3.0, 6.0, 12.0, 24.0)  # of the bias in units of the noise
REACH = 1.0  # length over which a curved bias changes, in standard deviations of its covariate
JOINT = (1.0, 2.0)  # the same for all numeric covariates at once
CONSTANT, TOGETHER = "nothing recorded", "several covariates"
SPANNED = 1e-6  # share of a cause's effect that a column of labels may leave, for the cause to be about that column


@dataclass(frozen=True)
class Nameless:
    """Log evidence of smooth biases: one covariate at a time, all of them together, or one bias for all specimens.

    With the covariance of a bias S = I + a^2 (K + 11') or I + a^2 K in units of the noise, J the change of the baseline
    per standard deviation of each measured input, and y the data from the baseline::

        log E(y) = max over K and a of  log L(y' (S + J J')^-1 y) - log det(S) / 2

    where log L is the likelihood of the noise statement. K is x x' of a numeric covariate, its squared-exponential
    kernel, the same-label kernel of a column of labels, the sum of these, or the kernel of all numbers at once. The
    determinant is the price of a bias that could have been anything.

    Parameters
    ----------
    along : covariate of every bias, shape (m,); ``CONSTANT`` and ``TOGETHER`` for those of none and of several
    weights : (S + J J')^-1, shape (m, n, n)
    kernels : S - I, shape (m, n, n)
    prices : log det(S) / 2, shape (m,)

    Notes
    -----
    Squared-exponential and linear kernels: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine
    Learning (2006), eq. 2.16, 4.9 and 5.8. Measured inputs act to first order. Wrong for a bias that jumps within a
    covariate, such as a change of mechanism, which this takes for noise. The price grows with the logarithm of the
    amplitude: an effect many times the noise that has the very shape of a listed one wins its name (a cap on the price
    kept fewer true names at equal wrong ones). Errors with Student tails are taken as
    Gaussian ones once their residuals are drawn in.
    """

    along: tuple[str, ...]
    weights: np.ndarray
    kernels: np.ndarray
    prices: np.ndarray

    @classmethod
    def of(
        cls, covariates: Mapping[str, Sequence], scale: np.ndarray, slopes: np.ndarray, mix: np.ndarray | None = None
    ) -> "Nameless":
        """All biases of a design.

        Parameters
        ----------
        covariates : name to values, numbers or labels
        scale : standard deviation of each specimen's noise, shape (n,): a bias counts less where the noise is larger
        slopes : J in units of the noise, shape (n, number of measured inputs)
        mix : what makes shared noise independent, shape (n, n); None where the noise is not shared
        """
        n = len(scale)
        weight = np.mean(scale) / np.asarray(scale, dtype=float)
        one = np.ones((n, n))
        along, kernels = [CONSTANT], [np.zeros((n, n))]
        for name, kernel in [(CONSTANT, None), *_kernels(covariates)]:
            for amplitude in AMPLITUDES:
                for constant in (1.0,) if kernel is None else (0.0, 1.0):
                    along.append(name)
                    kernels.append(amplitude**2 * (constant * one + (0.0 if kernel is None else kernel)))
        stack = np.outer(weight, weight) * np.array(kernels)
        if mix is not None:
            stack = mix @ stack @ mix.T
        whole = stack + np.eye(n)
        weights = np.linalg.inv(whole + slopes @ slopes.T)
        return cls(tuple(along), weights, stack, 0.5 * np.linalg.slogdet(whole)[1])

    def evidence(self, y: np.ndarray, like: Likelihood, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Log evidence of the best bias for each data set, shape (b,)."""
        return self.each(y, like, replicate).max(axis=1)

    def best(self, y: np.ndarray, like: Likelihood) -> int:
        """Number of the best bias for one data set."""
        return int(self.each(y, like)[0].argmax())

    def each(self, y: np.ndarray, like: Likelihood, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Log evidence of every bias for each data set, shape (b, m)."""
        y = np.atleast_2d(y)
        m, n = len(self.along), y.shape[1]
        turned = (y @ self.weights.transpose(1, 0, 2).reshape(n, m * n)).reshape(len(y), m, n)
        squares = np.einsum("bmn,bn->bm", turned, y)
        replicate = np.broadcast_to(np.asarray(replicate, dtype=float), (len(y),))[:, None]
        return like.loglik(squares, 0.0, float(n), replicate) - self.prices

    def left_out(self, number: int, y: np.ndarray, folds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual and variance of every value of one data set, predicted by a bias without its fold, shape (n,).

        With Q the weights, the fold F is missed by (Q_FF)^-1 (Q y)_F with covariance (Q_FF)^-1.
        """
        q = self.weights[number]
        pull = q @ y
        miss, spread = np.empty(len(y)), np.empty(len(y))
        for fold in np.unique(folds):
            rows = np.flatnonzero(folds == fold)
            covariance = np.linalg.inv(q[np.ix_(rows, rows)])
            miss[rows], spread[rows] = covariance @ pull[rows], np.diag(covariance)
        return miss, spread


def about(effect: np.ndarray, scale: np.ndarray, covariates: Mapping[str, Sequence]) -> str | None:
    """Column of labels that an effect is all about: it changes with the label and with nothing else.

    A cause such as the shift of one batch claims no more than a dependence on that column, which therefore is no rival
    of it.

    Parameters
    ----------
    effect : whitened change of the predictions, shape (n,)
    scale : standard deviation per specimen, shape (n,)
    """
    raw = effect * scale
    total = float(((raw - raw.mean()) ** 2).sum())
    if total <= SPANNED * float((raw**2).sum()):
        return None
    for name, column in covariates.items():
        labels = [str(v) for v in column]
        names = sorted(set(labels))
        if is_numeric(column) or not 1 < len(names) < len(labels):
            continue
        means = {k: np.mean([r for r, v in zip(raw, labels, strict=True) if v == k]) for k in names}
        left = raw - np.array([means[v] for v in labels])
        if float((left**2).sum()) <= SPANNED * total:
            return name
    return None


def _kernels(covariates: Mapping[str, Sequence]) -> Iterator[tuple[str, np.ndarray]]:
    """Name and kernel of every bias that is not constant, each with a mean diagonal of one."""
    parts, numbers = [], []
    for name, column in covariates.items():
        labels = [str(v) for v in column]
        levels = set(labels)
        if len(levels) < 2:
            continue
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) <= 1e-12 * np.abs(x).max():
                continue
            x = (x - x.mean()) / x.std()
            yield name, np.outer(x, x)
            if len(levels) > 2:
                yield name, np.exp(-0.5 * ((x[:, None] - x[None]) / REACH) ** 2)
            parts.append(np.outer(x, x))
            numbers.append(x)
        elif len(levels) < len(labels):
            same = np.array([[float(a == b) for b in labels] for a in labels])
            yield name, same
            parts.append(same)
    if len(parts) > 1:
        yield TOGETHER, sum(parts) / len(parts)
    if len(numbers) > 1:
        apart = sum((x[:, None] - x[None]) ** 2 for x in numbers) / len(numbers)
        for reach in JOINT:
            yield TOGETHER, np.exp(-0.5 * apart / reach**2)
