"""A contact interface: the plane polygon over which two blocks touch, with its joint law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import not_negative, numbers
from limitmason.errors import InputError
from limitmason.geometry.polygon import axes_in_plane, left_of_line
from limitmason.model.input import read_direction
from limitmason.model.joint import Joint
from limitmason.storage.frozen import ReadOnly, owned

COS_45 = np.sqrt(0.5)
"""Cosine of 45 degrees: of two directions at right angles, a unit vector faces the one it is nearer to [-]."""

ROUNDING = 1e-9
"""Part of a joint's size below which what cuts leave of it is no width [-]: chosen."""


@dataclass(frozen=True, eq=False)
class Interface(ReadOnly):
    """Contact between block a and block b.

    Parameters
    ----------
    block_a, block_b : block numbers
    polygon : convex polygon [m], shape (n, 3), counter-clockwise seen against the normal
    normal : unit vector from a to b, shape (3,)
    joint : its law
    kind : as it was found: "base" (one block wholly held), "bed" (normal within 45 degrees of vertical), else "head"
    """

    block_a: int
    block_b: int
    polygon: Array
    normal: Array
    joint: Joint
    kind: str

    def __post_init__(self) -> None:
        """Take polygon and normal as arrays of its own, which nobody changes."""
        for name, axes, shape in (("polygon", 2, "(n, 3)"), ("normal", 1, "(3,)")):
            given = getattr(self, name)
            value = owned(given if isinstance(given, np.ndarray) else numbers(f"{name} of an interface", given))
            if value.ndim != axes or value.shape[-1] != 3:
                raise InputError(f"{name} of an interface must have shape {shape}, got {value.shape}")
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"<Interface of blocks {self.block_a} and {self.block_b}: {self.kind}, {self.area:.4g} m2, {self.joint}>"

    @property
    def area(self) -> float:
        """Contact area [m2]."""
        r = self.polygon - self.polygon[0]
        return float(0.5 * np.cross(r[1:-1], r[2:]).sum(axis=0) @ self.normal)


def interface_kind(normal: Array, held_a: bool, held_b: bool) -> str:
    """Kind of a joint: "base", "bed" or "head".

    It is "base" where a block is wholly held, else its orientation says it.

    Parameters
    ----------
    normal : unit vector, shape (3,)
    held_a, held_b : whether block a, and block b, is held in all six degrees of freedom
    """
    if held_a or held_b:
        return "base"
    return "bed" if abs(normal[2]) >= COS_45 else "head"


def _pulled_in(interface: Interface, inset: float, keep: Array | None) -> Array | None:
    """Polygon of an interface with its edges moved inwards [m], shape (n, 3).

    It is None if nothing is left.

    Parameters
    ----------
    interface : with its polygon counter-clockwise about its normal
    inset : how far edges move [m]
    keep : unit vector, shape (3,), or None; edges whose normal in the plane is within 45 degrees of it stay
    """
    n, p = interface.normal, interface.polygon
    # columns are the axes in the plane
    frame = axes_in_plane(p, n)
    flat = (p - p[0]) @ frame
    out = flat
    size = np.ptp(flat, axis=0).max()
    far = 4.0 * size  # half the length of the line that cuts: last digits alone hang on it
    for a, b in zip(flat, np.roll(flat, -1, axis=0), strict=True):
        along = (b - a) / np.linalg.norm(b - a)
        inward = np.array([-along[1], along[0]])
        if keep is not None and abs((frame @ inward) @ keep) > COS_45:
            continue
        q = a + inset * inward
        # a sliver is left by rounding alone
        if ((out - q) @ inward).max() <= ROUNDING * size:
            return None
        out = left_of_line(out, q - far * along, q + far * along)
    return p[0] + out @ frame.T


def with_edges_inset(
    interfaces: Sequence[Interface], names: Sequence[str], inset: float, direction: ArrayLike | None
) -> tuple[Interface, ...]:
    """Interfaces with their edges moved inwards.

    Parameters
    ----------
    interfaces : of the assembly
    names : of all blocks, for messages
    inset : how far every edge moves [m], >= 0
    direction : edges whose normal in the plane is within 45 degrees of it stay, shape (3,); None moves all
    """
    not_negative("inset [m]", inset)
    keep = None if direction is None else read_direction("direction", direction)
    changed = []
    for interface in interfaces:
        polygon = _pulled_in(interface, inset, keep)
        if polygon is None:
            a, b = names[interface.block_a], names[interface.block_b]
            raise InputError(f"the interface between {a!r} and {b!r} is not wider than twice the inset {inset} m")
        changed.append(replace(interface, polygon=polygon))
    return tuple(changed)
