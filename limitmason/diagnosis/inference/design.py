"""One design and one list of causes: grids, columns, trends, likelihood, draws.

``y`` are the whitened values of data sets, shape (b, n), ``z`` their measured inputs in standard deviations, (b, k),
``replicate`` redrawn variances of replicates, (b,), and ``weights`` 1 for values that are used, (b, n).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from limitmason.diagnosis.inference.fit import BestFit, fits
from limitmason.diagnosis.inference.grid import Grid, Tabulation
from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.noise import Drawn, Draws, Noise
from limitmason.diagnosis.inference.trends import Trends, is_numeric

Names = tuple[str, ...]


class Listed(Protocol):
    """What the statistics know of a cause: name, size without effect, and sizes."""

    @property
    def name(self) -> str:
        """What it is called in a verdict."""

    @property
    def baseline(self) -> float:
        """Size without effect."""

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest size."""

    @property
    def sides(self) -> tuple[float, ...]:
        """The bounds that differ from the baseline."""


@dataclass(frozen=True, eq=False)
class Design:
    """Tables of one design in units of its noise, from the baseline prediction.

    That is the one at the measured inputs.

    Parameters
    ----------
    causes : the list
    noise : what is stated of it
    scale : standard deviation per specimen, shape (n,)
    origin : prediction of the baseline at the measured inputs, on the scale of comparison (see ``log``), shape (n,)
    null : the baseline model on the nuisance inputs
    singles : one grid per cause
    columns : what is recorded of the specimens, name to n numbers or labels: effects may go with it
    pair_table : makes the table of a pair of causes, by their names
    pair_names : pairs that may be tried
    log : whether each row is compared by its logarithm, shape (n,); None is all
    kinds : kind of evidence of each row; () is one for all
    mix : what makes shared noise independent: grids are in these coordinates; None where it is not shared
    measured : names of the measured inputs
    """

    causes: tuple[Listed, ...]
    noise: Noise
    scale: np.ndarray
    origin: np.ndarray
    null: Grid
    singles: Mapping[str, Grid]
    columns: Mapping[str, Sequence[Any]]
    pair_table: Callable[[Names], Tabulation]
    pair_names: tuple[Names, ...] = ()
    log: np.ndarray | None = None
    kinds: tuple[str, ...] = ()
    mix: np.ndarray | None = None
    measured: tuple[str, ...] = ()
    _pairs: dict[Names, Grid] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """Number of specimens."""
        return len(self.scale)

    @property
    def inputs(self) -> int:
        """Number of measured inputs with an error."""
        return len(self.null.z)

    @property
    def listed(self) -> list[Names]:
        """Every cause of the list as an explanation of its own."""
        return [(c.name,) for c in self.causes]

    @cached_property
    def like(self) -> Likelihood:
        """How sums of squares become log-likelihoods."""
        return Likelihood.of(self.noise)

    @cached_property
    def trends(self) -> Trends:
        """Trends along the recorded columns."""
        return Trends(self.columns, self.scale, self.mix, self.kinds)

    @cached_property
    def numeric(self) -> frozenset[str]:
        """Recorded columns that are numbers, not labels."""
        return frozenset(name for name, column in self.columns.items() if is_numeric(column))

    @cached_property
    def alone(self) -> bool:
        """Whether all values are of one specimen."""
        return len(set(self.columns.get("specimen", range(self.n)))) < 2

    @cached_property
    def of_kind(self) -> tuple[np.ndarray, ...]:
        """Rows of each kind of evidence, boolean, shape (n,)."""
        kinds = np.array(self.kinds or ("",) * self.n)
        return tuple(kinds == kind for kind in dict.fromkeys(kinds.tolist()))

    def recorded_as(self, column: str) -> str:
        """Name under which a column is recorded: of "age in force", which is age within one kind of data, "age"."""
        kinds = set(self.kinds) if len(set(self.kinds)) > 1 else ()
        return next((column.removesuffix(f" in {k}") for k in kinds if column.endswith(f" in {k}")), column)

    def own(self, names: Names) -> tuple[str, ...]:
        """Columns that the causes of an explanation declare as their own."""
        return tuple(column for c in self.causes if c.name in names for column in getattr(c, "own", ()))

    # ---- data ----------------------------------------------------------------------------------------------------

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """Measured values less the baseline in units of the noise, shape (..., n)."""
        values = np.asarray(values, dtype=float)
        if self.log is None or self.log.all():
            return (np.log(values) - self.origin) / self.scale
        return (np.where(self.log, np.log(np.where(self.log, values, 1.0)), values) - self.origin) / self.scale

    def turned(self, values: np.ndarray) -> np.ndarray:
        """Values by specimen, in units of noise, in this design's coordinates, (..., n)."""
        return values if self.mix is None else values @ self.mix.T

    def apart(self, values: np.ndarray) -> np.ndarray:
        """Values in the coordinates of this design per specimen again, shape (..., n)."""
        return values if self.mix is None else np.linalg.solve(self.mix, values.T).T

    @cached_property
    def correlation(self) -> np.ndarray:
        """Correlation of the noise that is carried, shape (n, n)."""
        if self.mix is None:
            return np.eye(self.n)
        factor = np.linalg.inv(self.mix)
        return factor @ factor.T

    # ---- explanations --------------------------------------------------------------------------------------------

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
        self, models: Sequence[Names | Grid], y: np.ndarray, z: np.ndarray | None = None,
        replicate: float | np.ndarray = 1.0, residuals: bool = False, *, like: Likelihood | None = None,
        weights: np.ndarray | None = None,
    ) -> list[BestFit]:
        """Fits of explanations to every data set.

        Parameters
        ----------
        models : explanations, by their names or their grids
        y : whitened data sets, shape (b, n)
        weights : of their values, shape (b, n), or None for ones
        replicate : redrawn replicate variance, a number or shape (b,)
        z : measured inputs in standard deviations from their values, shape (b, k); None is the values themselves
        residuals : whether those of the fits are wanted
        like : another likelihood than that of the noise
        """
        z = np.zeros((len(np.atleast_2d(y)), self.inputs)) if z is None else z
        grids = [model if isinstance(model, Grid) else self.grid(model) for model in models]
        return fits(grids, y, z, like or self.like, replicate, weights, residuals)

    def fit(
        self, model: Names | Grid, y: np.ndarray, z: np.ndarray | None = None, replicate: float | np.ndarray = 1.0,
        weights: np.ndarray | None = None,
    ) -> BestFit:
        """Fit of one explanation to every data set, with residuals, as :meth:`fits` does."""
        return self.fits([model], y, z, replicate, residuals=True, weights=weights)[0]

    def trend_of(self, names: Names) -> Callable[[np.ndarray, BestFit], np.ndarray]:
        """Statistic of trends in what fits of an explanation leave, shape (b,).

        The function that is returned takes data as ``trends.along`` gives them, and the fits. No residual of a data set
        is formed: of a thousand numbers some hundred directions are wanted.
        """
        grid = self.grid(names)
        short = Grid(grid.sizes, grid.z, self.trends.along(grid.values))
        return lambda along, fit: self.trends.statistic_of(along - short.values_from(fit.node, fit.position), fit.loss)

    def predicted(self, names: Names, fit: BestFit) -> np.ndarray:
        """Whitened predictions of fits of an explanation, shape (b, n)."""
        return self.grid(names).values_from(fit.node, fit.position)

    def effect(self, names: Names, fit: BestFit) -> np.ndarray:
        """Whitened change by an explanation at its fit, inputs included, shape (n,)."""
        return self.grid(names).effect(self.null, fit.node, fit.position)

    def noise_of(self, names: Names, fit: BestFit) -> float:
        """Noise about a fitted explanation in stated units: 1 where it is known."""
        squares = float((fit.residuals[0] ** 2).sum())
        return float(np.sqrt(self.like.variance(squares, self.n, spent=len(names))))

    def drawn(self, names: Names, fit: BestFit, draws: Draws, rows: slice) -> Drawn:
        """Values, measured inputs and replicate variances drawn from a fitted explanation."""
        z = self.grid(names).z_at(fit.position)[0]
        return draws.data(self.predicted(names, fit)[0], z, self.noise_of(names, fit), rows)

    # ---- other designs -------------------------------------------------------------------------------------------

    def _with(self, change: Callable[[Grid], Grid], **other: Any) -> Design:
        """The design with every grid changed, pairs too, and ``other`` fields replaced."""
        singles = {name: change(grid) for name, grid in self.singles.items()}
        pairs = {names: change(grid) for names, grid in self._pairs.items()}
        return replace(self, null=change(self.null), singles=singles, _pairs=pairs, **other)

    def sharing(self, correlation: np.ndarray) -> Design:
        """The design in coordinates in which correlated noise, (n, n), is independent."""
        mix = np.linalg.inv(np.linalg.cholesky(correlation))
        step = mix if self.mix is None else mix @ np.linalg.inv(self.mix)
        return self._with(lambda grid: grid.mixed(step), mix=mix)

    def with_noise(self, noise: Noise) -> Design:
        """These tables under another statement of independent noise.

        The scale is kept where the statement gives none.
        """
        scale = self.scale if noise.kind == "unknown" else noise.scale(self.n)
        ratio = self.scale / scale
        return self._with(lambda g: Grid(g.sizes, g.z, g.values * ratio), noise=noise, scale=scale)

    def only(self, kept: np.ndarray) -> Design:
        """The design of independent noise with some of the specimens.

        Parameters
        ----------
        kept : which ones, boolean, shape (n,)
        """

        def some(values: Sequence[Any]) -> list[Any]:
            return [v for v, keep in zip(values, kept, strict=False) if keep]  # no kinds: one for all

        return self._with(
            lambda grid: grid.columns(kept), noise=self.noise.of_some(kept), scale=self.scale[kept],
            origin=self.origin[kept], columns={k: some(column) for k, column in self.columns.items()},
            log=None if self.log is None else self.log[kept], kinds=tuple(some(self.kinds)),
        )

    def closed(self) -> Design:
        """The design with the tables made so far and no way to make others: numbers only."""
        return replace(self, pair_table=_no_table, _pairs=dict(self._pairs))

    def forget_pair(self, names: Names) -> None:
        """Drop the grid of a pair whose table was replaced: the next use makes it anew."""
        self._pairs.pop(names, None)

    def forget_pairs(self) -> None:
        """Drop the grids of all pairs."""
        self._pairs.clear()


def _no_table(names: Names) -> Tabulation:
    """Refuse a pair of causes that were not tabulated together."""
    raise LookupError(f"{' and '.join(names)} were not tried together: there is no table of the pair")
