"""A block: one or more convex polyhedra that move together, rigid unless a material says how they deform."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid, mass_properties, steiner
from limitmason.geometry.splitting import outer_faces
from limitmason.model.input import read_vector
from limitmason.model.material import Material
from limitmason.storage.frozen import ReadOnly, frozen, owned


@dataclass(frozen=True, eq=False)
class Block(ReadOnly):
    """Unit or voussoir: a closed polyhedron given as convex pieces.

    Parameters
    ----------
    name : unique label
    parts : convex pieces (vertices [m], shape (n, 3); faces counter-clockwise seen from outside)
    density : mass density [kg/m3], >= 0
    axis : length direction of the unit as laid, made a unit vector, shape (3,), or None
    material : what deforms, yields or cracks in it; None where it is rigid in every theory

    Raises
    ------
    InputError
        For an axis that is no direction, and a material with fracture energies.
    """

    name: str
    parts: tuple[Solid, ...]
    density: float
    axis: Array | None = None
    material: Material | None = None

    def __post_init__(self) -> None:
        """Take vertices and axis as arrays of its own, which nobody changes.

        The axis is checked.
        """
        object.__setattr__(self, "parts", tuple(Solid(owned(p.vertices), p.faces) for p in self.parts))
        if self.material is not None and self.material.fractures:
            raise InputError(
                f"block {self.name!r}: units yield by cohesion and friction_angle_deg; fracture energies are for "
                "limitmason.continuum"
            )
        if self.axis is not None:
            axis = read_vector(f"axis of block {self.name!r}", self.axis)
            # beyond, the square of its length is no number
            if not 1e-100 < np.abs(axis).max() < 1e100:
                raise InputError(f"axis of block {self.name!r} must be a direction, got {self.axis!r}")
            length = float(np.linalg.norm(axis))
            # one that is a unit vector but for rounding stays to the last bit
            object.__setattr__(self, "axis", owned(axis if abs(length - 1.0) < 1e-9 else axis / length))

    @cached_property
    def _properties(self) -> tuple[float, Array, Array]:
        """Volume, centroid and inertia per density.

        [m3], [m], shape (3,), and about the centroid [m5], shape (3, 3).
        """
        part = mass_properties(self.parts)
        volume = float(part.volume.sum())
        centroid = (part.volume[:, None] * part.centroid).sum(axis=0) / volume
        arm = part.centroid - centroid  # by which the parallel axes theorem moves the inertia of each part
        return volume, frozen(centroid), frozen((part.inertia + part.volume[:, None, None] * steiner(arm)).sum(axis=0))

    def __repr__(self) -> str:
        return f"<Block {self.name!r}: {self.volume:.4g} m3, {self.mass:.4g} kg, {len(self.parts)} convex part(s)>"

    @property
    def volume(self) -> float:
        """Exact volume [m3]."""
        return self._properties[0]

    @property
    def centroid(self) -> Array:
        """Exact centroid [m], shape (3,)."""
        return self._properties[1]

    @property
    def inertia(self) -> Array:
        """Inertia tensor about the centroid [kg m2], shape (3, 3)."""
        return frozen(self.density * self._properties[2])

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.density * self.volume

    @property
    def faces(self) -> list[Array]:
        """Corners of every face of its pieces [m], shape (k, 3) each.

        They run counter-clockwise seen from outside.
        """
        return [part.vertices[list(face)] for part in self.parts for face in part.faces]

    @cached_property
    def outer_faces(self) -> tuple[Array, ...]:
        """Corners of what is seen of these faces [m], shape (k, 3) each.

        What lies between two of its pieces is left out.
        """
        return tuple(frozen(face) for face in outer_faces(self.parts))

    @property
    def vertices(self) -> Array:
        """Vertices of all parts [m], shape (n, 3)."""
        if len(self.parts) == 1:
            return self.parts[0].vertices
        return frozen(np.vstack([part.vertices for part in self.parts]))

    @property
    def bounds(self) -> Array:
        """Lowest and highest coordinates [m], shape (2, 3)."""
        v = self.vertices
        return frozen(np.array([v.min(axis=0), v.max(axis=0)]))
