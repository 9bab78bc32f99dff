"""What the zones of zoned blocks have done at a moment: displacements, and which have yielded or cracked."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.kernels.yielding import SHEAR_NOW, SHEAR_PAST, TENSION_NOW, TENSION_PAST

Array = NDArray[np.float64]

ELASTIC, AT_YIELD, YIELDED, TENSION = 0, 1, 2, 3
"""Marks of a zone: elastic, yields in shear now, yielded so before, failed in tension at any time."""


def zone_marks(flags: NDArray[np.int64]) -> NDArray[np.int64]:
    """Mark of every zone from the flags of its stress points, shape (e,); tension goes first."""
    whole = np.bitwise_or.reduce(flags, axis=1)
    out = np.where(whole & SHEAR_PAST, YIELDED, ELASTIC)
    out = np.where(whole & SHEAR_NOW, AT_YIELD, out)
    return np.where(whole & (TENSION_NOW | TENSION_PAST), TENSION, out)


class ZoneState(NamedTuple):
    """Zones at a sample.

    Parameters
    ----------
    shift : displacements of all nodes [m], shape (n, 2) or (n, 3)
    flags : of the stress points, shape (e, 4); in space a zero for each zone
    plastic : accumulated length of the plastic strain, largest of each zone's points [-], shape (e,)
    """

    shift: Array
    flags: NDArray[np.int64]
    plastic: Array

    @property
    def marks(self) -> NDArray[np.int64]:
        """Mark of every zone, see :func:`zone_marks`."""
        return zone_marks(self.flags)
