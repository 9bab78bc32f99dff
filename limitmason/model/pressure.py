"""Pressure on faces: even, and growing with depth as of water and earth, integrated exactly."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import finite, positive
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import face_plane
from limitmason.geometry.splitting import split_polygon
from limitmason.model.applied_forces import AppliedForces
from limitmason.model.face_touch import outer_faces_of
from limitmason.model.input import read_direction
from limitmason.model.plausibility import warn_of_pressure

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly

_SIDES = {
    "top": (0, 0, 1), "bottom": (0, 0, -1), "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0),
    "+z": (0, 0, 1), "-z": (0, 0, -1),
}

_SAME_SIDE_DEG = 10.0
"""Chosen: faces turned by no more from a direction are on that side of a block [deg]."""


class Pressure(NamedTuple):
    """Pressure into a face, even or growing with depth.

    The part that grows is nil above its level. Both are added.

    Parameters
    ----------
    even : p, above the level too [Pa]; negative pulls
    level : of the water or earth [m]
    unit_weight : gamma of gamma (level - z) [N/m3]; 0 for none
    """

    even: float
    level: float = 0.0
    unit_weight: float = 0.0

    @classmethod
    def read(
        cls, on: str, other: str, even: float | None, level: float | None, unit_weight: float | None
    ) -> Self:
        """A pressure by what was given, checked.

        Parameters
        ----------
        on : what it is a load on, for messages
        other : name of the argument that may be given in its place, for messages
        even : pressure [Pa], or None; 0 where a level is given
        level : of the water or earth [m], or None
        unit_weight : growth with depth [N/m3], together with the level
        """
        if (level is None) != (unit_weight is None):
            raise InputError(f"load on {on}: level and unit_weight go together")
        if even is None and level is None:
            raise InputError(f"load on {on}: give either pressure or {other}")
        p = 0.0 if even is None else finite("pressure", even)
        warn_of_pressure(on, p)
        if level is None:
            return cls(p)
        return cls(p, finite("level", level), positive("unit_weight", unit_weight, "N/m3"))

    def press(self, forces: AppliedForces, block: int, polygon: Array, normal: Array) -> bool:
        """Press on a plane polygon of a block, and return whether any of it is loaded.

        Parameters
        ----------
        forces : to which the load is added
        block : its number
        polygon : counter-clockwise seen from outside [m], shape (k, 3)
        normal : outward unit normal, shape (3,)
        """
        if self.even:
            forces.add_spread(block, polygon, normal, np.ones(len(polygon)), -self.even * normal)
        if not self.unit_weight:
            return True
        # the surface of the water cuts the polygon
        below, _ = split_polygon(polygon, np.array([0.0, 0.0, self.level]), np.array([0.0, 0.0, 1.0]), slack=0.0)
        if below is not None:
            forces.add_spread(block, below, normal, self.level - below[:, 2], -self.unit_weight * normal)
        return below is not None or self.even != 0.0


def side_forces(
    assembly: Assembly, block: int, face: str | tuple[float, float, float], load: Pressure | Array
) -> AppliedForces:
    """Forces of a pressure, or of another load per area, on one side of a block.

    Parameters
    ----------
    assembly : that has the block
    block : its number
    face : name of a side, or an outward direction, shape (3,); all faces within 10 degrees of it
    load : pressure into the faces, or load per area in global axes [Pa], shape (3,)

    Raises
    ------
    InputError
        When the block has no face on that side, or the load is a pressure and that side lies above its level.
    """
    if isinstance(face, str) and face not in _SIDES:
        raise InputError(f"face {face!r} is not one of {tuple(_SIDES)} or a direction of three numbers")
    outward = read_direction("face", _SIDES[face] if isinstance(face, str) else face)
    name = assembly.blocks[block].name
    forces, found, loaded = AppliedForces.none(assembly), False, False
    for corners in outer_faces_of(assembly, block):
        normal, _ = face_plane(corners)
        if normal @ outward < np.cos(np.deg2rad(_SAME_SIDE_DEG)):
            continue
        found = True
        if isinstance(load, Pressure):
            loaded |= load.press(forces, block, corners, normal)
        else:
            forces.add_spread(block, corners, normal, np.ones(len(corners)), load)
    if not found:
        raise InputError(f"block {name!r} has no face towards {face!r}")
    if isinstance(load, Pressure) and not loaded:
        raise InputError(f"that side of block {name!r} lies above the level {load.level:g} m: nothing presses on it")
    return forces
