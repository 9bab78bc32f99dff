"""Model discrepancy: smooth biases without a cause, weighed by their evidence.

``y`` are the whitened values of several data sets, shape (b, n), ``replicate`` their redrawn variances of replicates,
and ``slopes`` what the measured inputs change, (n, k).
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.linalg import solve_triangular

from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.trends import is_numeric, one_of_each

AMPLITUDES = (1.5, 3.0, 6.0, 12.0, 24.0)  # of the bias in units of the noise
REACH = 1.0  # length over which a curved bias changes, in standard deviations of its covariate
JOINT = (1.0, 2.0)  # the same for all numeric covariates at once
CONSTANT, TOGETHER = "nothing recorded", "several covariates"
TINY = 1e-14  # of the largest eigenvalue of a kernel: smaller ones are rounding
BATCH = 256  # data sets that are weighed at once
SURE = 3.0  # standard errors by which the slope along its own contrast must differ from 0, and at most from 1


class Discrepancy:
    """Log evidence of smooth biases: by covariate, all together, or one for all.

    With the covariance of a bias S = I + F F' in units of the noise, J the change of the baseline per standard
    deviation of each measured input, and y the data from the baseline::

        log E(y) = max over F of  log L(y' (S + J J')^-1 y) - log det(S) / 2

    where log L is the likelihood of the noise statement, and F F' is a^2 K or a^2 (K + 11'). K is x x' of a numeric
    covariate, its squared-exponential kernel, the same-label kernel of a column of labels, the sum of these, or the
    kernel of all numbers at once. The determinant is the price of a bias that could have been anything. With A = [F, J]
    the inverse is I - B B', B B' = A (I + A'A)^-1 A': as many columns as a covariate has values, whatever the number of
    rows.

    Parameters
    ----------
    along : covariate of every bias, shape (m,); ``CONSTANT`` and ``TOGETHER`` for those of none and of several
    factors : F of each, shape (n, its rank)
    slopes : J in units of the noise, shape (n, number of measured inputs)

    Notes
    -----
    Squared-exponential and linear kernels: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine
    Learning (2006), eq. 2.16, 4.9 and 5.8. Measured inputs act to first order. Wrong for a bias that jumps within a
    covariate, such as a change of mechanism, which this takes for noise. The price grows with the logarithm of the
    amplitude: an effect many times the noise that has the very shape of a listed one wins its name (a cap on the price
    kept fewer true names at equal wrong ones).
    """

    def __init__(self, along: Sequence[str], factors: Sequence[np.ndarray], slopes: np.ndarray):
        """Factor every bias.

        B with (S + J J')^-1 = I - B B', S the bias's covariance and J the inputs' slopes, and its price log det(S) / 2.

        Parameters
        ----------
        along : what each bias goes with, in words
        factors : root of its covariance over the noise, shape (n, r)
        """
        self.along, self.factors, self.n = tuple(along), tuple(factors), len(slopes)
        parts, prices = [np.zeros((self.n, 0))], []
        for factor in self.factors:
            a = np.hstack([factor, slopes])
            # R'R = I + A'A, with no square of an effect that is many times the noise
            root = np.linalg.qr(np.vstack([np.eye(a.shape[1]), a]), mode="r")
            parts.append(solve_triangular(root, a.T, trans=1).T)
            prices.append(float(np.log(np.abs(np.diag(root)[: factor.shape[1]])).sum()))
        self.prices = np.array(prices)  # log det(S) / 2, shape (m,)
        self._stack = np.concatenate(parts, axis=1)  # B of all, side by side
        self._starts = np.cumsum([p.shape[1] for p in parts])

    @classmethod
    def of(
        cls, covariates: Mapping[str, Sequence], scale: np.ndarray, slopes: np.ndarray, mix: np.ndarray | None = None
    ) -> "Discrepancy":
        """All biases of a design.

        Parameters
        ----------
        covariates : name to values, numbers or labels
        scale : standard deviation of each specimen's noise, shape (n,): a bias counts less where the noise is larger
        slopes : J in units of the noise, shape (n, number of measured inputs)
        mix : what makes shared noise independent, shape (n, n); None where the noise is not shared
        """
        n = len(scale)
        weight = (np.mean(scale) / np.asarray(scale, dtype=float))[:, None]
        one = np.ones((n, 1))
        along, factors = [CONSTANT], [np.zeros((n, 0))]
        for name, factor in [(CONSTANT, one), *_factors(covariates)]:
            # without and with a constant beside it, which the constant itself does not need
            for constant in (one[:, :0],) if name == CONSTANT else (one[:, :0], one):
                lifted = weight * np.hstack([factor, constant])
                lifted = _thin(lifted if mix is None else mix @ lifted)
                for amplitude in AMPLITUDES:
                    along.append(name)
                    factors.append(amplitude * lifted)
        return cls(along, factors, slopes)

    @property
    def kernels(self) -> np.ndarray:
        """S - I of every bias, shape (m, n, n)."""
        return np.array([f @ f.T for f in self.factors])

    def evidence(self, y: np.ndarray, like: Likelihood, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Log evidence of the best bias for each data set, shape (b,)."""
        return self.each(y, like, replicate).max(axis=1)

    def best(self, y: np.ndarray, like: Likelihood) -> int:
        """Number of the best bias for one data set."""
        return int(self.each(y, like)[0].argmax())

    def each(self, y: np.ndarray, like: Likelihood, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Log evidence of every bias for each data set, shape (b, m).

        Parameters
        ----------
        y : data from the baseline in units of the noise, shape (b, n) or (n,)
        like : likelihood of the noise statement
        replicate : estimates of the noise from replicates, relative, shape (b,) or one
        """
        y = np.atleast_2d(y)
        whole = np.einsum("bn,bn->b", y, y)[:, None]
        squares = np.empty((len(y), len(self.along)))
        widths = np.diff(self._starts)
        for first in range(0, len(y), BATCH):
            rows = slice(first, first + BATCH)
            sums = np.zeros((len(y[rows]), len(widths)))
            if widths.any():  # |B' y|^2 of every bias; one without columns, no bias and no input, stays at 0
                # reduceat adds up the columns of each

                turned = (y[rows] @ self._stack) ** 2
                sums[:, widths > 0] = np.add.reduceat(turned, self._starts[:-1][widths > 0], axis=1)
            # what each bias takes off the sum of squares
            squares[rows] = sums
        replicate = np.broadcast_to(np.asarray(replicate, dtype=float), (len(y),))[:, None]
        left = np.maximum(whole - squares, 0.0)
        return like.loglik(left, penalty=0.0, count=float(self.n), replicate=replicate) - self.prices

    def weighted(self, number: int, values: np.ndarray) -> np.ndarray:
        """(S + J J')^-1 of one bias times values, shape (n, ...)."""
        b = self._stack[:, self._starts[number] : self._starts[number + 1]]
        return values - b @ (b.T @ values)

    def left_out(self, number: int, y: np.ndarray, folds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual and variance of every value predicted without its fold, shape (n,).

        The values are those of one data set, and a bias predicts them. With Q = (S + J J')^-1, the fold F is missed by
        (Q_FF)^-1 (Q y)_F with covariance (Q_FF)^-1.

        Parameters
        ----------
        number : of the bias
        folds : number of the fold of every value, shape (n,)
        """
        b, pull = self._stack[:, self._starts[number] : self._starts[number + 1]], self.weighted(number, y)
        miss, spread = np.empty(len(y)), np.empty(len(y))
        for fold in np.unique(folds):
            rows = np.flatnonzero(folds == fold)
            covariance = np.linalg.inv(np.eye(len(rows)) - b[rows] @ b[rows].T)
            miss[rows], spread[rows] = covariance @ pull[rows], np.diag(covariance)
        return miss, spread


def dosed(slope: float, error: float) -> bool:
    """Whether the share of an effect, with its standard error [-], is sure and near 1."""
    return slope >= SURE * error and abs(slope - 1.0) <= SURE * error


def dose_of(
    discrepancy: Discrepancy, slopes: np.ndarray, effect: np.ndarray, data: np.ndarray, sd: float
) -> tuple[float, float]:
    """Share of the fitted effect that no bias could make, and its standard error [-].

    The contrast is the part of the effect that is left when the nearest bias and the measured inputs have taken all
    they can. A share of 1 is all of the effect, 0 none.

    Parameters
    ----------
    effect, data, sd : both whitened, shape (n,); noise in stated units [-]
    slopes : J in units of the noise, shape (n, number of measured inputs)
    """
    contrast = discrepancy.weighted(discrepancy.best(effect / sd, Likelihood()), effect)
    reach = float(contrast @ effect)
    if reach <= 0.0:
        return 0.0, float("inf")
    spread = float(contrast @ contrast + np.square(contrast @ slopes).sum())  # of noise and measured inputs
    return float(contrast @ data) / reach, sd * float(np.sqrt(spread)) / reach


def _thin(factor: np.ndarray) -> np.ndarray:
    """A factor of the same covariance with no more columns than its rank."""
    if factor.shape[1] < 2:
        return factor
    size, turn = np.linalg.eigh(factor.T @ factor)
    return factor @ turn[:, size > TINY * size[-1]]


def _curved(points: np.ndarray, reach: float) -> np.ndarray:
    """Root of the squared-exponential kernel of points (n, k), a column per place.

    Parameters
    ----------
    reach : distance over which values go together
    """
    places, where = np.unique(points, axis=0, return_inverse=True)
    apart = np.sum([(x[:, None] - x[None]) ** 2 for x in places.T], axis=0) / points.shape[1]
    size, turn = np.linalg.eigh(np.exp(-0.5 * apart / reach**2))
    kept = size > TINY * size[-1]
    return (turn[:, kept] * np.sqrt(size[kept]))[where.ravel()]


def _factors(covariates: Mapping[str, Sequence]) -> Iterator[tuple[str, np.ndarray]]:
    """Names and kernel factors of all biases that are not constant.

    A factor F has shape (n, its rank), and F F' a mean diagonal of one. A number gives a line and a smooth curve,
    labels give a level each. Several columns give their sum, and smooth curves over all numbers at once.

    Parameters
    ----------
    covariates : columns by name, numbers or labels, n each
    """
    parts, numbers = [], []
    for name, column in covariates.items():
        labels = [str(v) for v in column]
        levels = set(labels)
        if len(levels) < 2:
            continue
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) <= 1e-12 * np.abs(x).max():  # one value, but for rounding
                continue
            x = ((x - x.mean()) / x.std())[:, None]
            parts.append(x)
            yield name, x
            if len(levels) > 2:
                yield name, _curved(x, REACH)
            numbers.append(x)
        elif len(levels) < len(labels):
            parts.append(one_of_each(column))
            yield name, parts[-1]
    if len(parts) > 1:
        yield TOGETHER, np.hstack(parts) / np.sqrt(len(parts))
    if len(numbers) > 1:
        for reach in JOINT:
            yield TOGETHER, _curved(np.hstack(numbers), reach)
