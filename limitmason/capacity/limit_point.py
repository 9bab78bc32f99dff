"""What a limit point of a capacity curve is: a load that falls after it, or that does not rise above it for long.

The same rules end a path and name the first limit point of its curve.
"""

import numpy as np

from limitmason.arrays import Array

LEVEL, LASTING = 1e-6, 6
"""A plateau: so little change, of the largest load, over so many samples."""

SLID = 0.25
"""Least displacement of a plateau, in elastic lengths [-]."""

PLAIN = 0.01
"""Displacement of a plateau over however few samples, of the median block size [-]."""

DROP = 0.002
"""Fall below a limit point after which it is passed, of its load [-]."""

DOUBLED = 2.0
"""Displacement up to which a load has not risen above its largest, after which it is passed, of that at the largest."""


def plateau(load: Array, way: Array, size: float, length: float) -> int | None:
    """The first sample of a last plateau, or None where the curve does not end on one.

    Parameters
    ----------
    load : multipliers or forces, shape (n,)
    way : control displacements [m], shape (n,)
    size, length : median block size and elastic length [m]
    """
    other = np.flatnonzero(np.abs(load - load[-1]) > LEVEL * np.abs(load).max())
    first = int(other[-1]) + 1 if len(other) else 0
    count, slid = len(load) - first, np.abs(way[-1] - way)
    lasts = (count >= LASTING and slid[-LASTING] > SLID * length) or (count >= 3 and slid[first] > PLAIN * size)
    return first if lasts else None


def first_limit_point(load: Array, way: Array, lacks: Array, size: float, length: float) -> int | None:
    """The sample of the largest load before one that has passed it, or the first of a last plateau.

    Parameters
    ----------
    lacks : what contacts found anew took off the load and it has not regained, shape (n,)
    load, way, size, length : as in :func:`plateau`
    """
    way, highest, largest = np.abs(way - way[0]), 0, float(np.abs(load).max())
    for k in range(1, len(load)):
        if load[k] > load[highest] + LEVEL * largest:
            highest = k
        elif (
            load[k] + lacks[k] < load[highest] - DROP * abs(load[highest])
            or way[k] > DOUBLED * way[highest] > 0.0
        ):
            return highest
    return highest if load[-1] < load[highest] - LEVEL * largest else plateau(load, way, size, length)
