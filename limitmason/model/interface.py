"""A contact interface: the plane polygon over which two blocks touch, with its joint law."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitmason.model.joint import Joint

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Interface:
    """Contact between block a and block b.

    Parameters
    ----------
    block_a, block_b : block numbers
    polygon : convex polygon [m], shape (n, 3), counter-clockwise seen against the normal
    normal : unit vector from a to b, shape (3,)
    joint : its law
    kind : "base" (one block is wholly held), "bed" (normal within 45 degrees of vertical), else "head"
    """

    block_a: int
    block_b: int
    polygon: Array
    normal: Array
    joint: Joint
    kind: str

    @property
    def area(self) -> float:
        """Contact area [m2]."""
        r = self.polygon - self.polygon[0]
        return float(0.5 * np.cross(r[1:-1], r[2:]).sum(axis=0) @ self.normal)


def interface_kind(normal: Array, held_a: bool, held_b: bool) -> str:
    """Name of a joint by its orientation: "base", "bed" or "head"."""
    if held_a or held_b:
        return "base"
    return "bed" if abs(normal[2]) >= np.sqrt(0.5) else "head"
