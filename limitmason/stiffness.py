"""Joint stiffness where a model names none: one rule for the DEM, the capacity curve and studies of both."""

import numpy as np
from numpy.typing import NDArray

from limitmason.model.assembly import Assembly

Array = NDArray[np.float64]

SETTLEMENT = 1e-6
"""The base shortens by this fraction of the median block size under the whole dead load [-]."""


def default_stiffness(assembly: Assembly, dead: Array) -> float:
    """Joint stiffness for joints that name none [Pa/m].

    kn = (dead load / area of the joints on supports) / (1e-6 x median block size): the foot of the structure shortens
    by 1e-6 of a block. Small enough that the change of geometry does not show in the multiplier, large enough to
    settle fast. It is a number for rigid-block collapse, not a property of a material.

    Parameters
    ----------
    dead : wrench per block [N, N m], shape (n, 6)
    """
    x = assembly.arrays
    free = ~assembly.fixed
    load = np.linalg.norm(dead[free, :3], axis=1).sum()
    load = max(float(load), float(assembly.weights[free].sum()), 1e-300)
    at_support = assembly.held[x.block_a].any(axis=1) ^ assembly.held[x.block_b].any(axis=1)
    level = at_support & (np.abs(x.normal[:, 2]) > 0.5)
    area = x.area[level].sum() if level.any() else x.area[at_support].sum() if at_support.any() else x.area.mean()
    size = float(np.median(np.cbrt(x.volume[free])))
    return load / area / (SETTLEMENT * size)
