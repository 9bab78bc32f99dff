"""Joints of weightless blocks that nothing passes: rounding there is no force.

A block without load that others do not press on may have joint forces of any size next to nothing. By its own measure,
the forces on it, such rounding is neither in equilibrium nor within the joint law. Without forces it is in both.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from limitmason.arrays import Array, Index
from limitmason.model.assembly import Assembly

ROUNDING = 1e-8
"""Forces on weightless blocks over the least load of the blocks around them up to which they are rounding."""


def without_rounding(assembly: Assembly, own: Array, interface: Index, force: Array) -> Array:
    """Contact forces, those at idle joints of weightless blocks set to zero.

    Zero forces are within every joint law, and they are in equilibrium on a block without load. The blocks around feel
    no more than ``ROUNDING`` of their own load. Weightless blocks that touch each other are judged together.

    Parameters
    ----------
    own : load on every block, shape (n_blocks,); any unit
    interface : of every contact point, shape (m,)
    force : at every contact point, same unit, shape (m, c)

    Returns
    -------
    The forces, shape (m, c).
    """
    x, n = assembly.links, assembly.n_blocks
    weightless = ~assembly.fixed & (own == 0.0)
    if not weightless.any():
        return force
    a, b = x.block_a, x.block_b
    both = weightless[a] & weightless[b]
    touching = coo_array((np.ones(both.sum()), (a[both], b[both])), shape=(n, n))
    _, group = connected_components(touching, directed=False)
    joint = np.bincount(interface, np.linalg.norm(force, axis=1), len(x.area))
    # per group of weightless blocks: largest force on it, and least load of the free blocks around it
    largest, least = np.zeros(n), np.full(n, np.inf)
    for one, other in ((a, b), (b, a)):
        at = np.flatnonzero(weightless[one])
        np.maximum.at(largest, group[one[at]], joint[at])
        at = at[~weightless[other[at]] & ~assembly.fixed[other[at]]]
        np.minimum.at(least, group[one[at]], own[other[at]])
    idle = weightless & (largest <= ROUNDING * least)[group]
    return np.where((idle[a] | idle[b])[interface][:, None], 0.0, force)
