"""Everything that the rule needs of one design and one list of causes: whitened grids, trends, likelihood."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from limitmason.diagnosis.inference.fit import Fit, fit, fit_many
from limitmason.diagnosis.inference.grid import Grid, Table
from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.noise import Noise
from limitmason.diagnosis.inference.shapes import Shapes

Names = tuple[str, ...]


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
        """Measured values as log differences from the baseline in units of the noise, shape (..., n)."""
        return (np.log(values) - self.origin) / self.scale

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
        self, names: Sequence[Names], y: np.ndarray, z: np.ndarray, replicate=1.0, residuals: bool = False
    ) -> list[Fit]:
        """Fits of explanations with as many causes each to every data set.

        Parameters
        ----------
        names : of the explanations
        y, z, replicate : as for :func:`~.fit.fit`
        residuals : whether those of the fits are wanted
        """
        grids = [self.grid(n) for n in names]
        if self.like.tails is None:
            return fit_many(grids, y, z, self.like, replicate, residuals)
        return [fit(g, y, z, self.like, replicate) for g in grids]

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
        )


def _no_table(names: Names) -> Table:
    raise LookupError(f"{' and '.join(names)} were not tried together: there is no table of the pair")
