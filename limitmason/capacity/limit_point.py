"""What a limit point of a capacity curve is: a load that falls after it, or that does not rise above it for long.

The same rule ends a path and names the first limit point of its curve. It asks for what a curve does between its
samples, not for where they lie.
"""

import numpy as np

from limitmason.arrays import Array

LEVEL = 1e-6
"""Change of a load that counts as none, of the largest [-]."""

DROP = 0.002
"""Fall below a limit point after which it is passed, of its load [-]: shallower dips hang on the steps."""

BELOW, RISEN = 0.02, 2e-4
"""Displacement, of the median block size, over which a load rises by less than so much of it and is passed [-].

One that does not rise at all is passed where its displacement has doubled; paths go on until it falls or comes so far.
"""

TOLD = 1e-4
"""Displacement, of the median block size, over which the turn of a block changes its load by more than ``LEVEL`` [-].

On stiff joints a displacement doubles in some nanometres, in which no load falls by as much.
"""


def passed(load: Array, way: Array, lacks: Array, size: float, doubled: float = 2.0) -> int | None:
    """Number of the sample with a limit point that a later one has passed, or None.

    A load is passed by a fall of ``DROP`` below it, or where it does not rise above it for long (``BELOW``). On the way
    back from a load of the other sense there is none to pass.

    Parameters
    ----------
    load : multipliers or forces, shape (n,), positive in the sense in which they are pushed
    way : control displacements [m], shape (n,)
    lacks : what contacts found anew took off the load and it has not regained, in its unit, shape (n,)
    size : median block size [m]
    doubled : a load that has not risen is passed at so many times the displacement at which it was first reached [-]
    """
    way, highest, largest = np.abs(way - way[0]), 0, float(np.abs(load).max())
    tops = np.maximum.accumulate(load)  # largest load up to each sample

    def lasts(at: float, top: float) -> bool:
        """Whether the largest load so far, ``top``, has lasted to the displacement ``at`` [m]."""
        if top <= 0.0:
            return False  # on the way back from a load of the other sense
        # displacements [m] since which the load has risen to ``top`` by no more than LEVEL, and than RISEN
        level, creeps = (way[int(np.searchsorted(tops, top / (1.0 + rise)))] for rise in (LEVEL, RISEN))
        return bool((0.0 < level < at / doubled and at - level > TOLD * size) or at - creeps > BELOW * size)

    for k in range(1, len(load)):
        if load[k] > tops[k - 1] > load[k - 1]:
            # where the load, on a straight way to the sample, comes back to the largest before it
            beyond = (load[k] - tops[k - 1]) / (load[k] - load[k - 1])
            if lasts(way[k] - beyond * (way[k] - way[k - 1]), tops[k - 1]):
                return highest
        if load[k] > load[highest] + LEVEL * largest:
            highest = k
        if lasts(way[k], tops[k]) or (tops[k] > 0.0 and load[k] + lacks[k] < (1.0 - DROP) * load[highest]):
            return highest
    return None


def first_limit_point(load: Array, way: Array, lacks: Array, size: float) -> int | None:
    """The sample that :func:`passed` finds, or that of the largest load where it is higher than the last.

    Parameters
    ----------
    load : multipliers or forces of the samples, positive in the sense in which they are pushed, shape (n,)
    way : control displacements [m], shape (n,)
    lacks : load that contacts found anew took off and it has not regained, shape (n,)
    size : median block size [m]
    """
    if (found := passed(load, way, lacks, size)) is not None:
        return found
    highest = int(np.argmax(load))
    return highest if load[-1] < load[highest] - LEVEL * np.abs(load).max() and load[highest] > 0.0 else None
