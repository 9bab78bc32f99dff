"""Model discrepancy: smooth biases without a cause, and listed levers with another dependence, as rivals of a cause."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.fit import BestFit, Likelihood
from limitmason.diagnosis.inference.trends import is_numeric, same

AMPLITUDES = (1.5, 3.0, 6.0, 12.0, 24.0)  # of the bias in units of the noise
LEVERS = (3.0, 6.0, 12.0, 24.0)  # the same of a lever with another dependence
REACH = 1.0  # length over which a curved bias changes, in standard deviations of its covariate
JOINT = (1.0, 2.0)  # the same for all numeric covariates at once
CONSTANT, TOGETHER = "nothing recorded", "several covariates"
DRIFT = "a drift with an order of tests that is not recorded"
NEARLY = (0.8, 1.0, 1.25)  # of the fitted effect: mean of a drift


class Discrepancy:
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
    kernels : S - I, shape (m, n, n)
    slopes : J in units of the noise, shape (n, number of measured inputs)

    Notes
    -----
    Squared-exponential and linear kernels: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine
    Learning (2006), eq. 2.16, 4.9 and 5.8. Measured inputs act to first order. Wrong for a bias that jumps within a
    covariate, such as a change of mechanism, which this takes for noise. The price grows with the logarithm of the
    amplitude: an effect many times the noise that has the very shape of a listed one wins its name (a cap on the price
    kept fewer true names at equal wrong ones).
    """

    def __init__(self, along: Sequence[str], kernels: np.ndarray, slopes: np.ndarray):
        self.along, self.kernels = tuple(along), kernels
        whole = kernels + np.eye(len(slopes))
        self.weights = np.linalg.inv(whole + slopes @ slopes.T)  # (S + J J')^-1, shape (m, n, n)
        self.prices = 0.5 * np.linalg.slogdet(whole)[1]  # log det(S) / 2, shape (m,)

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
        weight = np.mean(scale) / np.asarray(scale, dtype=float)
        one = np.ones((n, n))
        along, kernels = [CONSTANT], [np.zeros((n, n))]
        for name, kernel in [(CONSTANT, None), *_kernels(covariates)]:
            for amplitude in AMPLITUDES:
                for constant in (1.0,) if kernel is None else (0.0, 1.0):
                    along.append(name)
                    kernels.append(amplitude**2 * (constant * one + (0.0 if kernel is None else kernel)))
        stack = np.outer(weight, weight) * np.array(kernels)
        return cls(along, stack if mix is None else mix @ stack @ mix.T, slopes)

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
        """Residual and variance of every value predicted without its fold, shape (n,).

        The values are those of one data set, and a bias predicts them. With Q the weights, the fold F is missed by
        (Q_FF)^-1 (Q y)_F with covariance (Q_FF)^-1.
        """
        q = self.weights[number]
        pull = q @ y
        miss, spread = np.empty(len(y)), np.empty(len(y))
        for fold in np.unique(folds):
            rows = np.flatnonzero(folds == fold)
            covariance = np.linalg.inv(q[np.ix_(rows, rows)])
            miss[rows], spread[rows] = covariance @ pull[rows], np.diag(covariance)
        return miss, spread


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
            parts.append(np.outer(x, x))
            yield name, parts[-1]
            if len(levels) > 2:
                yield name, np.exp(-0.5 * ((x[:, None] - x[None]) / REACH) ** 2)
            numbers.append(x)
        elif len(levels) < len(labels):
            parts.append(same(column))
            yield name, parts[-1]
    if len(parts) > 1:
        yield TOGETHER, np.sum(parts, axis=0) / len(parts)
    if len(numbers) > 1:
        apart = np.sum([(x[:, None] - x[None]) ** 2 for x in numbers], axis=0) / len(numbers)
        for reach in JOINT:
            yield TOGETHER, np.exp(-0.5 * apart / reach**2)


def dependences(columns: Mapping[str, Sequence]) -> dict[str, list[np.ndarray]]:
    """Other dependences of a lever, as kernels of shape (n, n): on labels, along a number, and on its level."""
    out: dict[str, list[np.ndarray]] = {}
    for name, column in columns.items():
        labels: Sequence = [str(v) for v in column]
        kernels = []
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) <= 1e-12 * np.abs(x).max(initial=0.0):
                continue
            kernels.append(np.outer(x - x.mean(), x - x.mean()) / x.var() + 1.0)
            labels = list(x > np.median(x))
        if 1 < len(set(labels)) < len(labels):
            kernels.append(same(labels))
        if kernels:
            out[name] = kernels
    return out


class Rivals:
    """Model discrepancies of a design, by the columns that the cause in question declares as its own.

    Parameters
    ----------
    design : tables
    sd : noise in stated units, where the noise is unknown
    """

    def __init__(self, design: Design, sd: float = 1.0):
        self.design, self.sd = design, sd
        self.slopes = design.null.slopes / sd
        self._made: dict[tuple[str, ...], Discrepancy] = {}

    def of(self, names: Names) -> Discrepancy:
        """Biases that could stand in for an explanation: all but those along its own columns."""
        own = self.design.own(names)
        if own not in self._made:
            rest = {k: v for k, v in self.design.columns.items() if k.split(" in ")[0] not in own}
            self._made[own] = Discrepancy.of(rest, self.design.scale, self.slopes, self.design.mix)
        return self._made[own]

    def levers(self, names: Names) -> Discrepancy:
        """Listed levers with another dependence than on the explanation's own columns.

        A rival is the effect of a listed cause at its largest size, scaled to a mean square of one, times an unknown
        factor that depends on a column: a friction that differs by direction, a softness that grows with the load.
        """
        design, inner = self.design, tuple(f" in {kind}" for kind in set(self.design.kinds))
        plain: dict[str, Sequence[Any]] = {
            k: v for k, v in design.columns.items()
            if not k.endswith(inner) and k != "specimen" and k not in design.own(names)
        }  # fmt: skip
        ways, along, kernels = dependences(plain), [], []
        null = design.null.between(design.null.zero)
        for cause in design.causes:
            grid = design.singles[cause.name]
            far = int(np.argmax(np.abs(grid.sizes[0] - cause.baseline)))
            effect = design.apart(grid.at_size(float(far)).between(grid.zero) - null)
            size = float(np.sqrt(np.mean(effect**2)))
            if size <= 1e-9:
                continue
            for column, parts in ways.items():
                for part in parts:
                    for amplitude in LEVERS:
                        along.append(f"{cause.name} by {column}")
                        kernels.append((amplitude / size) ** 2 * np.outer(effect, effect) * part)
        stack = np.array(kernels).reshape(len(kernels), design.n, design.n)
        return Discrepancy(along, stack if design.mix is None else design.mix @ stack @ design.mix.T, self.slopes)

    def drift(self, names: Names, effect: np.ndarray, y: np.ndarray, like: Likelihood) -> float:
        """Log evidence of the same effect growing from nothing from test to test, in an order that is not recorded.

        Specimen i of m shows t_i of the effect f: a permutation of 0, 2/(m-1), ... 2, of mean 1, variance
        V = (m+1) / 3(m-1) and covariance -V/(m-1), taken as normal. Minus infinity where an order is recorded, or the
        explanation has none.

        Parameters
        ----------
        effect : of the fitted explanation, in the coordinates of the design, shape (n,)
        y : one data set, shape (1, n)
        like : of the noise
        """
        design = self.design
        orders = {o for c in design.causes if c.name in names for o in getattr(c, "drifts", ())}
        specimens = design.columns.get("specimen", range(design.n))
        m = len(set(specimens))
        if not orders or orders & set(design.columns) or m < 2:
            return -np.inf
        part, spread = same(specimens), (m + 1.0) / (3.0 * (m - 1.0))
        f = design.apart(effect) / self.sd
        kernel = spread * np.outer(f, f) * (part - (1.0 - part) / (m - 1.0))
        kernel = kernel if design.mix is None else design.mix @ kernel @ design.mix.T
        made = [Discrepancy([DRIFT], a**2 * kernel[None], self.slopes).evidence(y - a * effect, like) for a in NEARLY]
        return float(np.max(made))

    def excess(
        self,
        names: Names,
        fit: BestFit,
        y: np.ndarray,
        replicate: float | np.ndarray = 1.0,
        parts: Sequence[np.ndarray] = (),
    ) -> np.ndarray:
        """Log-likelihood of fits over the evidence of the best model discrepancy, shape (b,).

        Parameters
        ----------
        names, fit : explanation and its fits
        y, replicate : what was fitted
        parts : of a pair, the effect of each cause, shape (n,): each must beat a model discrepancy beside the
            other, and the smaller excess counts
        """
        like, data = self.design.like, np.atleast_2d(y)
        if len(names) == 1:
            return fit.loglik - self.of(names).evidence(data, like, replicate)
        beside = zip(names, reversed(parts), strict=True)
        return fit.loglik - np.max([self.of((n,)).evidence(data - part, like, replicate) for n, part in beside], axis=0)

    def parts(self, names: Names, fit: BestFit) -> list[np.ndarray]:
        """Effect of each cause of a pair at the fit, at the measured inputs, shape (n,), or none for a single cause."""
        out = []
        for axis, name in enumerate(names if len(names) == 2 else ()):
            grid, null = self.design.singles[name], self.design.null
            size = float(self.design.grid(names).sizes_at(fit.position)[0, axis])
            at = [float(np.interp(size, grid.sizes[0], np.arange(len(grid.sizes[0])))), *grid.zero]
            out.append(grid.between(at) - null.between(null.zero))
        return out

    def structure(self, names: Names, fit: BestFit, replicate: float | np.ndarray = 1.0) -> np.ndarray:
        """Evidence of a model discrepancy in the residuals of fits over that of none, shape (b,)."""
        like = self.design.like
        plain = like.loglik((fit.residuals**2).sum(axis=1), 0.0, float(self.design.n), replicate)
        return self.of(names).evidence(fit.residuals, like, replicate) - plain
