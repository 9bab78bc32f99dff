"""What a model gives to be vibrated: stiffness, mass, and how its unknowns move points in space.

Blocks on joints, open ones left out, are assembled in :mod:`limitmason.vibration.blocks`, solids in
:mod:`limitmason.continuum.solid`.
Stiffness is elastic: weight takes nothing off it, as the geometric stiffness of a path does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from scipy import sparse

from limitmason.arrays import Array, Flags
from limitmason.storage.frozen import ReadOnly


class Carrier(Protocol):
    """How a shape, one row of components per place (block or node), moves points of the structure."""

    @property
    def places(self) -> Array:
        """Centroids of blocks or nodes [m], shape (n, 3)."""

    @property
    def masses(self) -> Array:
        """Share of each place in the mass [kg], shape (n,)."""

    @property
    def moving(self) -> Flags:
        """Places that are not wholly held, shape (n,)."""

    def at(self, shape: Array, points: Array) -> Array:
        """Displacement of points by one shape [m], shape (p, 3).

        Parameters
        ----------
        shape : components of every place, of blocks (u, theta, coordinates of their shapes), of nodes u, shape (n, c)
        points : places in the reference state [m], shape (p, 3)
        """


@dataclass(frozen=True, eq=False)
class VibratingSystem(ReadOnly):
    """K u = (2 pi f)^2 M u on the free unknowns.

    Parameters
    ----------
    stiffness : K, symmetric [N/m; N m of rotations], shape (r, r)
    mass : M, symmetric [kg; kg m2 of rotations], shape (r, r)
    excited : M times a unit translation of the whole along x, y, z, held unknowns included [kg], shape (r, 3)
    spread : from a vector of the free unknowns, (r,), to a shape, (n, c)
    carrier : what a shape moves
    total : mass that takes part, held points excluded [kg], shape (3,)
    label : what a table calls the model
    solve : K^-1 times a vector, where the model has a factor of its own
    warnings : what a user should know
    below : how many (2 pi f)^2 lie below a value [1/s2], None if unknown, where the model counts by its own factor
    """

    stiffness: sparse.csc_array
    mass: sparse.csc_array
    excited: Array
    spread: Callable[[Array], Array]
    carrier: Carrier
    total: Array
    label: str = ""
    solve: Callable[[Array], Array] | None = None
    warnings: tuple[str, ...] = ()
    below: Callable[[float], int | None] | None = None


class Vibrates(Protocol):
    """A model that knows its small vibrations: a continuum, a state of a simulation or of a capacity curve."""

    def vibration(self, **options: Any) -> VibratingSystem:
        """Stiffness and mass about the state it is in."""
