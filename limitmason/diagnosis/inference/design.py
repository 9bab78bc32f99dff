"""Everything that the rule needs of one design and one list of causes: whitened grids, trends, likelihood."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from scipy.special import fdtrc

from limitmason.diagnosis.inference.fit import Fit, fits
from limitmason.diagnosis.inference.grid import Grid, Table
from limitmason.diagnosis.inference.noise import Likelihood, Noise

KINDS = ("linear", "quadratic", "group")
FLOOR = 1e-300
Names = tuple[str, ...]


@dataclass(frozen=True)
class Shape:
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


class Shapes:
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
        self.n = len(scale)
        weight = 1.0 / np.asarray(scale, dtype=float)
        weight = weight / weight.mean()
        level = weight[:, None] if mix is None else mix @ weight[:, None]
        self.mean = level / np.linalg.norm(level)
        self.shapes: list[Shape] = []
        for name, column in covariates.items():
            for kind, columns in _columns(column):
                weighted = columns * weight[:, None]
                basis = _orthonormal(weighted if mix is None else mix @ weighted, self.mean)
                k = basis.shape[1]
                if k and self.n - 1 - k >= 2 and (kind != "quadratic" or k == 2):
                    self.shapes.append(Shape(name, kind, basis))
        self._stack = np.concatenate([s.basis for s in self.shapes], axis=1) if self.shapes else np.zeros((self.n, 0))
        self._starts = np.cumsum([0] + [s.basis.shape[1] for s in self.shapes])

    def __len__(self) -> int:
        return len(self.shapes)

    def tails(self, residuals: np.ndarray) -> np.ndarray:
        """Tail probability of each trend's F, shape (b, number of trends)."""
        ratios, k, free = self._ratios(np.atleast_2d(residuals))
        return np.maximum(fdtrc(k[None], free[None], ratios), FLOOR)

    def _ratios(self, residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F of each trend, shape (b, number of trends), and its degrees of freedom."""
        k = np.diff(self._starts).astype(float)
        free = self.n - 1.0 - k
        if not self.shapes:
            return np.ones((len(residuals), 0)), k, free
        centred = residuals - (residuals @ self.mean) @ self.mean.T
        total = np.einsum("bn,bn->b", centred, centred)
        along = np.add.reduceat((centred @ self._stack) ** 2, self._starts[:-1], axis=1)
        return (along / k) / (np.maximum(total[:, None] - along, 1e-12 * total[:, None] + FLOOR) / free), k, free

    def statistic(self, residuals: np.ndarray) -> np.ndarray:
        """Best trend of each data set, -log of its tail probability, shape (b,); zeros without covariates."""
        ratios, k, _ = self._ratios(np.atleast_2d(residuals))
        tails = np.ones(len(ratios))
        for count in np.unique(k):  # among trends of as many columns the largest F has the smallest tail
            largest = ratios[:, k == count].max(axis=1)
            tails = np.minimum(tails, np.maximum(fdtrc(count, self.n - 1.0 - count, largest), FLOOR))
        return -np.log(tails) if len(k) else np.zeros(len(ratios))

    def best(self, residuals: np.ndarray) -> Shape | None:
        """Trend with the smallest tail probability in one data set."""
        tails = self.tails(residuals)
        return self.shapes[int(np.argmin(tails[0]))] if tails.shape[1] else None


def is_numeric(column: Sequence) -> bool:
    """Whether a covariate consists of finite numbers, not labels or truth values."""
    try:
        return not any(isinstance(v, (bool, str)) for v in column) and bool(
            np.all(np.isfinite(np.asarray(column, dtype=float)))
        )
    except (TypeError, ValueError):
        return False


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


class Listed(Protocol):
    """What the statistics know of a cause: its name, the size that is no effect, and the sizes that are possible."""

    @property
    def name(self) -> str:
        """What it is called in a verdict."""
        ...

    @property
    def baseline(self) -> float:
        """Size without effect."""
        ...

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest size."""
        ...

    @property
    def sides(self) -> tuple[float, ...]:
        """The bounds that differ from the baseline."""
        ...


@dataclass(frozen=True, eq=False)
class Design:
    """Tables of one design in units of its noise, measured from the baseline prediction at the measured inputs.

    Parameters
    ----------
    causes : the list
    noise : what is stated of it
    scale : standard deviation per specimen, shape (n,)
    origin : log prediction of the baseline at the measured inputs, shape (n,)
    null : the baseline model on the nuisance inputs
    singles : one grid per cause
    shapes : trends of the covariates
    pair_table : makes the table of a pair of causes, by their names
    log : whether each row is compared by its logarithm, shape (n,); None is all
    kinds : kind of evidence of each row; () is one for all
    mix : what makes shared noise independent: all values are in these coordinates; None where it is not shared
    """

    causes: tuple[Listed, ...]
    noise: Noise
    scale: np.ndarray
    origin: np.ndarray
    null: Grid
    singles: Mapping[str, Grid]
    shapes: Shapes
    pair_table: Callable[[Names], Table]
    pair_names: tuple[Names, ...] = ()
    _pairs: dict[Names, Grid] = field(default_factory=dict)
    mix: np.ndarray | None = None
    log: np.ndarray | None = None
    kinds: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """Number of specimens."""
        return len(self.scale)

    @property
    def inputs(self) -> int:
        """Number of measured inputs with an error."""
        return len(self.null.z)

    @property
    def like(self) -> Likelihood:
        """How sums of squares become log-likelihoods."""
        return Likelihood.of(self.noise)

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """Measured values as differences from the baseline in units of the noise, shape (..., n)."""
        values = np.asarray(values, dtype=float)
        if self.log is None or self.log.all():
            return (np.log(values) - self.origin) / self.scale
        return (np.where(self.log, np.log(np.where(self.log, values, 1.0)), values) - self.origin) / self.scale

    def grid(self, names: Names) -> Grid:
        """Grid of the baseline (no name), a cause or a pair."""
        if not names:
            return self.null
        if len(names) == 1:
            return self.singles[names[0]]
        if names not in self._pairs:
            plain = self.pair_table(names).whitened(self.origin, self.scale)
            self._pairs[names] = plain if self.mix is None else plain.mixed(self.mix)
        return self._pairs[names]

    def fits(
        self,
        names: Sequence[Names],
        y: np.ndarray,
        z: np.ndarray,
        replicate: float | np.ndarray = 1.0,
        residuals: bool = False,
        like: Likelihood | None = None,
    ) -> list[Fit]:
        """Fits of explanations with as many causes each to every data set.

        Parameters
        ----------
        names : of the explanations
        y, z, replicate : as for :func:`~.fit.fits`
        residuals : whether those of the fits are wanted
        like : another likelihood than that of the noise
        """
        return fits([self.grid(n) for n in names], y, z, like or self.like, replicate, residuals=residuals)

    def fit(
        self,
        model: Names | Grid,
        y: np.ndarray,
        z: np.ndarray,
        replicate: float | np.ndarray = 1.0,
        weights: np.ndarray | None = None,
    ) -> Fit:
        """Fit of one explanation, by its names or its grid, to every data set; see :func:`~.fit.fits`."""
        grid = model if isinstance(model, Grid) else self.grid(model)
        return fits([grid], y, z, self.like, replicate, weights)[0]

    def predicted(self, names: Names, fit: Fit) -> np.ndarray:
        """Whitened predictions of fits of an explanation, shape (b, n)."""
        return self.grid(names).values_from(fit.node, fit.position)

    def effect(self, names: Names, fit: Fit) -> np.ndarray:
        """Whitened change of the predictions by an explanation at its fit, measured inputs included, shape (n,)."""
        return self.grid(names).effect(self.null, fit.node, fit.position)

    def mixed(self, mix: np.ndarray, shapes: Shapes) -> "Design":
        """The design in coordinates in which shared noise is independent; data turn into them by ``mix``.

        Parameters
        ----------
        mix : inverse of the lower factor of the noise's correlation, shape (n, n)
        shapes : trends in the same coordinates
        """
        return replace(
            self,
            null=self.null.mixed(mix),
            singles={k: g.mixed(mix) for k, g in self.singles.items()},
            shapes=shapes,
            _pairs={k: g.mixed(mix) for k, g in self._pairs.items()},
            mix=mix,
        )

    def turned(self, values: np.ndarray) -> np.ndarray:
        """Values per specimen, in units of the noise, in the coordinates of this design, shape (..., n)."""
        return values if self.mix is None else values @ self.mix.T

    def apart(self, values: np.ndarray) -> np.ndarray:
        """Values in the coordinates of this design per specimen again, shape (..., n)."""
        return values if self.mix is None else np.linalg.solve(self.mix, values.T).T

    def closed(self) -> "Design":
        """The design with the tables made so far and no way to make others: numbers only."""
        return replace(self, pair_table=_no_table, _pairs=dict(self._pairs))

    def forget_pair(self, names: Names) -> None:
        """Drop the grid of a pair whose table was replaced."""
        self._pairs.pop(names, None)

    def forget_pairs(self) -> None:
        """Drop the grids of all pairs."""
        self._pairs.clear()

    def without(self, chosen: np.ndarray, covariates: Mapping) -> "Design":
        """The design with the chosen specimens only.

        Parameters
        ----------
        chosen : boolean, shape (n,)
        covariates : name to values of all specimens
        """
        kept = {k: [v for v, keep in zip(column, chosen, strict=True) if keep] for k, column in covariates.items()}
        return Design(
            self.causes,
            self.noise.of_some(chosen),
            self.scale[chosen],
            self.origin[chosen],
            self.null.columns(chosen),
            {k: g.columns(chosen) for k, g in self.singles.items()},
            Shapes(kept, self.scale[chosen]),
            self.pair_table,
            self.pair_names,
            {k: g.columns(chosen) for k, g in self._pairs.items()},
            log=None if self.log is None else self.log[chosen],
            kinds=tuple(k for k, keep in zip(self.kinds, chosen, strict=False) if keep),
        )

    def with_noise(self, noise: Noise, scale: np.ndarray, covariates: Mapping) -> "Design":
        """The same tables under another statement of the noise."""
        ratio = self.scale / scale

        def again(grid: Grid) -> Grid:
            return Grid(grid.sizes, grid.z, grid.values * ratio)

        return Design(
            self.causes,
            noise,
            scale,
            self.origin,
            again(self.null),
            {k: again(g) for k, g in self.singles.items()},
            Shapes(covariates, scale),
            self.pair_table,
            self.pair_names,
            {k: again(g) for k, g in self._pairs.items()},
            log=self.log,
            kinds=self.kinds,
        )


def _no_table(names: Names) -> Table:
    raise LookupError(f"{' and '.join(names)} were not tried together: there is no table of the pair")
