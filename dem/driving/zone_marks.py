"""Zones of blocks as answers show them: the mesh, and which zones have yielded or cracked at a moment."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from dem.kernels.arrays import Index
from dem.kernels.zone_plasticity import SHEAR_NOW, SHEAR_PAST, TENSION_NOW, TENSION_PAST
from limitmason.arrays import Array, Flags

ELASTIC, AT_YIELD, YIELDED, TENSION = 0, 1, 2, 3
"""Marks of a zone: elastic, yields in shear now, yielded so before, failed in tension at any time."""


def zone_marks(flags: NDArray[np.int64]) -> NDArray[np.int64]:
    """Mark of every zone from the flags of its stress points, shape (e,).

    Tension goes first.
    """
    whole = np.bitwise_or.reduce(flags, axis=1)
    out = np.where(whole & SHEAR_PAST, YIELDED, ELASTIC)
    out = np.where(whole & SHEAR_NOW, AT_YIELD, out)
    return np.where(whole & (TENSION_NOW | TENSION_PAST), TENSION, out)


@dataclass(frozen=True, kw_only=True)
class BlockMesh(Protocol):
    """Nodes and zones of all blocks.

    Parameters
    ----------
    place : nodes in the reference position [m], x and z, shape (n, 2)
    block : of every node, shape (n,)
    zones : nodes of every zone, counter-clockwise, shape (e, 4)
    zone_block : shape (e,)
    rigid : blocks without zones, shape (b,)
    size : largest zone edge [m]
    """

    place: Array
    block: Index
    zones: Index
    zone_block: Index
    rigid: Flags
    size: float

    @property
    def zone_sizes(self) -> Array:
        """Edge of a square as large as every zone [m], shape (e,)."""


class ZoneState(NamedTuple):
    """Zones at a sample.

    Parameters
    ----------
    shift : displacements of all nodes [m], shape (n, 2)
    flags : of the stress points, shape (e, 4)
    plastic : accumulated length of the plastic strain, largest of each zone's points [-], shape (e,)
    """

    shift: Array
    flags: NDArray[np.int64]
    plastic: Array

    @property
    def marks(self) -> NDArray[np.int64]:
        """Mark of every zone, see :func:`zone_marks`."""
        return zone_marks(self.flags)
