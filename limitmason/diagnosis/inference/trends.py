"""Trends of residuals along what is recorded of the specimens: lines, bends and differences between groups."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

FLOOR = 1e-300  # of a tail probability, whose logarithm is taken


@dataclass(frozen=True)
class Trend:
    """One trend: an orthonormal basis of it after the mean is taken out.

    Parameters
    ----------
    covariate : name
    kind : "linear", "quadratic" or "group"
    basis : shape (n, k), columns orthonormal and orthogonal to the mean
    """

    covariate: str
    kind: str
    basis: np.ndarray


class Trends:
    """All trends of a design.

    Per trend with k columns the statistic is F = (S_k / k) / ((S - S_k) / (n - 1 - k)), with S the sum of squares about
    the mean and S_k the part along the trend; the best trend is that with the smallest tail probability of its F.

    Parameters
    ----------
    covariates : name to values, numbers or labels, each of length n
    scale : standard deviation per specimen, shape (n,): residuals come divided by it
    mix : what makes shared noise independent, shape (n, n), for residuals that come so; None where it is not shared

    Notes
    -----
    The tail probabilities only rank the trends: the verdict compares the best with its own bootstrap distribution,
    because residuals of a fit are neither independent nor chosen in advance. Collinear covariates share a trend.
    """

    def __init__(self, covariates: Mapping[str, Sequence], scale: np.ndarray, mix: np.ndarray | None = None):
        """Find the basis of every trend that leaves two degrees of freedom or more.

        The weights are 1 / scale over their mean, mixed by ``mix`` where noise is shared. The level is what a constant
        becomes by them; ``mean`` is its unit vector, to which every basis is orthogonal. A quadratic trend needs k = 2
        columns: with one it is no more than a line.
        """
        self.n = len(scale)
        weight = 1.0 / np.asarray(scale, dtype=float)
        weight = weight / weight.mean()
        level = weight[:, None] if mix is None else mix @ weight[:, None]
        self.mean = level / np.linalg.norm(level)
        self.trends: list[Trend] = []
        for name, column in covariates.items():
            for kind, columns in _columns(column):
                weighted = columns * weight[:, None]
                basis = _orthonormal(weighted if mix is None else mix @ weighted, self.mean)
                k = basis.shape[1]
                if k and self.n - 1 - k >= 2 and (kind != "quadratic" or k == 2):
                    self.trends.append(Trend(name, kind, basis))
        self._stack = np.concatenate([s.basis for s in self.trends], axis=1) if self.trends else np.zeros((self.n, 0))
        self._starts = np.cumsum([0] + [s.basis.shape[1] for s in self.trends])

    def __len__(self) -> int:
        return len(self.trends)

    def tails(self, residuals: np.ndarray) -> np.ndarray:
        """Tail probability of each trend's F, shape (b, number of trends)."""
        ratios, k, free = self._ratios(np.atleast_2d(residuals))
        return np.maximum(fdtrc(k[None], free[None], ratios), FLOOR)

    def _ratios(self, residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F of each trend, shape (b, number of trends), and its degrees of freedom."""
        k = np.diff(self._starts).astype(float)
        free = self.n - 1.0 - k
        if not self.trends:
            return np.ones((len(residuals), 0)), k, free
        centred = residuals - (residuals @ self.mean) @ self.mean.T
        total = np.einsum("bn,bn->b", centred, centred)
        along = np.add.reduceat((centred @ self._stack) ** 2, self._starts[:-1], axis=1)
        return (along / k) / (np.maximum(total[:, None] - along, 1e-12 * total[:, None] + FLOOR) / free), k, free

    def statistic(self, residuals: np.ndarray) -> np.ndarray:
        """Best trend of each data set, -log of its tail probability, shape (b,), or zeros without covariates."""
        ratios, k, _ = self._ratios(np.atleast_2d(residuals))
        tails = np.ones(len(ratios))
        for count in np.unique(k):  # among trends of as many columns the largest F has the smallest tail
            largest = ratios[:, k == count].max(axis=1)
            tails = np.minimum(tails, np.maximum(fdtrc(count, self.n - 1.0 - count, largest), FLOOR))
        return -np.log(tails) if len(k) else np.zeros(len(ratios))

    def best(self, residuals: np.ndarray) -> Trend | None:
        """Trend with the smallest tail probability in one data set."""
        tails = self.tails(residuals)
        return self.trends[int(np.argmin(tails[0]))] if tails.shape[1] else None


def is_numeric(column: Sequence) -> bool:
    """Whether a covariate consists of finite numbers, not labels or truth values."""
    try:
        return not any(isinstance(v, (bool, str)) for v in column) and bool(
            np.all(np.isfinite(np.asarray(column, dtype=float)))
        )
    except (TypeError, ValueError):
        return False


def same(column: Sequence) -> np.ndarray:
    """1 where two specimens have one label, shape (n, n)."""
    labels = np.unique([str(v) for v in column], return_inverse=True)[1]
    return (labels[:, None] == labels[None]).astype(float)


def _columns(column: Sequence) -> Iterator[tuple[str, np.ndarray]]:
    """Kind and columns of every trend of one covariate."""
    labels = [str(v) for v in column]
    if is_numeric(column):
        x = np.asarray(column, dtype=float)
        levels = np.unique(x)
        if len(levels) < 2:
            return
        x = (x - x.mean()) / x.std()
        yield "linear", x[:, None]
        if len(levels) > 2:
            yield "quadratic", np.stack([x, x**2], axis=1)
        if not 3 < len(levels) <= len(x) / 3:  # two or three levels: linear and quadratic say the same
            return
    names = sorted(set(labels))
    if 1 < len(names) <= max(2, len(labels) // 3):
        yield "group", np.array([[float(v == name) for name in names[1:]] for v in labels])


def _orthonormal(columns: np.ndarray, mean: np.ndarray) -> np.ndarray:
    rest = columns - mean @ (mean.T @ columns)
    u, s, _ = np.linalg.svd(rest, full_matrices=False)
    return u[:, s > 1e-8 * max(1.0, s[0] if len(s) else 1.0)]
