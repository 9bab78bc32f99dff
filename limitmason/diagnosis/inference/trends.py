"""Trends of residuals along what is recorded: lines, bends, groups."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import fdtrc

FLOOR = 1e-300  # of a tail probability, whose logarithm is taken
ROWS = ("quantity", "specimen")  # columns that tell rows apart, not specimens: not looked at within each kind


@dataclass(frozen=True)
class Trend:
    """One trend: an orthonormal basis of it after the mean is taken out.

    Parameters
    ----------
    covariate : name
    kind : "linear", "quadratic" or "group"
    basis : shape (n, k), columns orthonormal and orthogonal to the means
    means : orthonormal basis of the means that are taken out, shape (n, one or the number of kinds)
    of_each : whether these are the means of each kind, not that of all rows
    """

    covariate: str
    kind: str
    basis: np.ndarray
    means: np.ndarray
    of_each: bool


class Trends:
    """All trends of a design.

    Per trend with k columns the statistic is F = (S_k / k) / ((S - S_k) / (n - m - k)), with S the sum of squares about
    m means and S_k the part along the trend; the best trend is that with the smallest tail probability of its F.

    Of several kinds of data a trend along a column has a line, bend or group difference of its own in each kind, about
    the mean of that kind: an effect of age that forces and stiffness show, and frequencies do not, goes with age. Of a
    column of labels each label is also held alone against all others.

    Parameters
    ----------
    covariates : name to values, numbers or labels, each of length n
    scale : standard deviation per specimen, shape (n,): residuals come divided by it
    mix : what makes shared noise independent, shape (n, n), for residuals that come so; None where it is not shared
    kinds : kind of data of each row; () is one for all

    Notes
    -----
    The tail probabilities only rank the trends: the verdict compares the best with its own bootstrap distribution,
    because residuals of a fit are neither independent nor chosen in advance. Collinear covariates share a trend.
    """

    def __init__(
        self, covariates: Mapping[str, Sequence], scale: np.ndarray, mix: np.ndarray | None = None,
        kinds: Sequence[str] = (),
    ):
        """Find the basis of every trend that leaves two degrees of freedom or more.

        The weights are 1 / scale over their mean, mixed by ``mix`` where noise is shared. The level is what a constant
        becomes by them; ``means`` is its unit vector, or one for each kind, to which every basis is orthogonal. A
        quadratic trend needs twice the columns of a line: with fewer it is no more than one.

        Parameters
        ----------
        covariates, scale, kinds : columns by name; standard deviation of every row, (n,); kind of evidence of every row
        """
        self.n = len(scale)
        weight = 1.0 / np.asarray(scale, dtype=float)
        weight = (weight / weight.mean())[:, None]
        # kinds of evidence, such as forces and frequencies, if there are several; 1 where a row is of one, (n, kinds)
        of_kinds = list(dict.fromkeys(kinds)) if len(set(kinds)) > 1 else []
        indicator = np.array([[k == kind for kind in of_kinds] for k in kinds], dtype=float).reshape(self.n, -1)

        def whitened(columns: np.ndarray) -> np.ndarray:
            return columns * weight if mix is None else mix @ (columns * weight)

        none, one = np.zeros((self.n, 0)), np.ones((self.n, 1))
        mean_of_all, mean_of_each = _orthonormal(whitened(one), none), _orthonormal(whitened(indicator), none)
        self.trends: list[Trend] = []
        self._means = mean_of_all, mean_of_each
        for name, column in covariates.items():
            # a trend is of all rows, or one of each kind of evidence with a slope of its own
            whole = not of_kinds or name in ROWS
            means = mean_of_all if whole else mean_of_each
            one_slope = whole or name.endswith(tuple(f" in {k}" for k in of_kinds))
            parts = [one[:, 0]] if one_slope else list(indicator.T)
            for kind, columns in _columns(column):
                basis = _orthonormal(whitened(np.hstack([columns * part[:, None] for part in parts])), means)
                k = basis.shape[1]
                bends = kind != "quadratic" or k == 2 * len(parts)
                if k and self.n - means.shape[1] - k >= 2 and bends:
                    self.trends.append(Trend(name, kind, basis, means, of_each=not whole))
        self._turn = np.concatenate([*self._means, *(s.basis for s in self.trends)], axis=1)
        self._starts = np.cumsum([0] + [s.basis.shape[1] for s in self.trends])

    def __len__(self) -> int:
        return len(self.trends)

    def tails(self, residuals: np.ndarray) -> np.ndarray:
        """Tail probability of each trend's F, shape (b, number of trends)."""
        residuals = np.atleast_2d(residuals)
        ratios, k, free = self._ratios(residuals @ self._turn, np.einsum("bn,bn->b", residuals, residuals))
        return np.maximum(fdtrc(k[None], free[None], ratios), FLOOR)

    def along(self, values: np.ndarray) -> np.ndarray:
        """What the statistic wants of values beside squares: parts along means and trends.

        Where these are as many as the values, it is the values themselves. Shape (..., the fewer of the two).
        """
        return values @ self._turn if self._turn.shape[1] < self.n else values

    def _ratios(self, turned: np.ndarray, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F of each trend, shape (b, number of trends), and its degrees of freedom.

        Parameters
        ----------
        turned : parts of the residuals along the mean of all rows, the means of each kind, and the trends one after the
            other, as columns of ``self._turn`` stand, shape (b, all of these)
        whole : sum of their squares, shape (b,)

        Returns
        -------
        ratios, k, free : F; degrees of freedom above and below, shape (trends,)
        """
        k = np.diff(self._starts).astype(float)
        free = self.n - k - np.array([t.means.shape[1] for t in self.trends])
        if not self.trends:
            return np.ones((len(whole), 0)), k, free
        squares, ends = turned**2, np.cumsum([0, *(m.shape[1] for m in self._means)])
        # sums of squares about the mean of all rows, and about those of each kind, shape (b,)
        about = [whole - squares[:, a:b].sum(axis=1) for a, b in pairwise(ends)]
        total = np.array([about[t.of_each] for t in self.trends]).T
        along = np.add.reduceat(squares[:, ends[-1] :], self._starts[:-1], axis=1)
        return (along / k) / (np.maximum(total - along, 1e-12 * whole[:, None] + FLOOR) / free), k, free

    def statistic(self, residuals: np.ndarray) -> np.ndarray:
        """Best trend of each data set, -log of its tail probability, (b,), or zeros."""
        residuals = np.atleast_2d(residuals)
        return self.statistic_of(self.along(residuals), np.einsum("bn,bn->b", residuals, residuals))

    def statistic_of(self, along: np.ndarray, whole: np.ndarray) -> np.ndarray:
        """Best trend of each data set, as -log of its tail, (b,), without residuals.

        Parameters
        ----------
        along : what :meth:`along` makes of them
        whole : sum of their squares, shape (b,)
        """
        ratios, k, free = self._ratios(along if self._turn.shape[1] < self.n else along @ self._turn, whole)
        tails = np.ones(len(ratios))
        for count, rest in dict.fromkeys(zip(k, free, strict=True)):  # the largest F of equal freedom: least tail
            largest = ratios[:, (k == count) & (free == rest)].max(axis=1)
            tails = np.minimum(tails, np.maximum(fdtrc(count, rest, largest), FLOOR))
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


def one_of_each(labels: Sequence) -> np.ndarray:
    """A column of ones and zeros per label, a factor of its kernel, (n, labels)."""
    each = np.unique([str(v) for v in labels], return_inverse=True)[1]
    return np.eye(each.max() + 1)[each]


def same(column: Sequence) -> np.ndarray:
    """1 where two specimens have one label, shape (n, n)."""
    each = one_of_each(column)
    return each @ each.T


def _columns(column: Sequence) -> Iterator[tuple[str, np.ndarray]]:
    """Kind of every trend of one covariate, and the columns that span it, (n, k).

    A number gives a line and, from three levels on, a parabola. Labels that are few, two or at most a third of the
    rows, give a column for each but the first; so do numbers of more than three levels, where these are as few. Of more
    than two labels each that repeats is also held against all others. Many labels give no trend.
    """
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
        for name in names if len(names) > 2 and not is_numeric(column) else ():
            if labels.count(name) > 1:
                yield "group", np.array([[float(v == name)] for v in labels])


def _orthonormal(columns: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Orthonormal basis of columns, (n, k), less their part along ``means``, (n, m).

    Directions with singular values below 1e-8, or 1e-8 of the largest, are rounding: columns depend on each other.
    """
    rest = columns - means @ (means.T @ columns)
    u, s, _ = np.linalg.svd(rest, full_matrices=False)
    return u[:, s > 1e-8 * max(1.0, s[0] if len(s) else 1.0)]


def chance_along(residuals: np.ndarray, direction: np.ndarray) -> float:
    """Tail probability of the part of residuals along a direction, in noise of the size of the rest.

    It is that of F = S_1 / ((S - S_1) / (n - 1)), with S the sum of squares and S_1 the part along the direction.

    Parameters
    ----------
    residuals, direction : in the same coordinates, shape (n,)
    """
    along = float(residuals @ direction) ** 2 / float(direction @ direction)
    rest = max(float(residuals @ residuals) - along, FLOOR)
    return float(fdtrc(1, len(residuals) - 1, along * (len(residuals) - 1) / rest))
