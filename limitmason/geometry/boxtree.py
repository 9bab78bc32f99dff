"""All pairs of overlapping boxes by an implicit binary tree, traversed a whole level at a time."""

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array, Index

_CELLS = 2**20
"""Cells along the longest extent: a code of 64 bits has room for 21 bits of each coordinate."""

_SPREAD = (
    (32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F), (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)
"""Shifts, and masks of what stays after each: halves of halves move apart until two places follow every bit."""


def overlapping_pairs(low: Array, high: Array) -> tuple[Index, Index]:
    """Pairs i < j of axis-aligned boxes that touch or overlap.

    Boxes are sorted along a space-filling curve; their tree is implicit (parents are pairs of neighbours), and pairs
    of nodes are refined level by level. A box that spans everything (a ground slab) enlarges one node a level, so it
    costs a number of tests linear in the number of boxes and loses nothing.

    Parameters
    ----------
    low, high : least and largest coordinates of every box [m], shape (n, 3)

    Returns
    -------
    i, j : numbers of the boxes of every pair, i < j, sorted by i and then j, shape (k,) each
    """
    n = len(low)
    if n < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    order = np.argsort(_morton(0.5 * (low + high)), kind="stable")
    levels = [(low[order], high[order])]  # bounds of the nodes, from single boxes up to one that holds all
    while len(levels[-1][0]) > 1:
        lo, hi = levels[-1]
        # an empty box, which touches nothing, makes the number of nodes even
        if len(lo) % 2:
            lo = np.vstack([lo, np.full((1, 3), np.inf)])
            hi = np.vstack([hi, np.full((1, 3), -np.inf)])
            levels[-1] = (lo, hi)
        levels.append((np.minimum(lo[0::2], lo[1::2]), np.maximum(hi[0::2], hi[1::2])))
    i, j = np.zeros(1, np.intp), np.zeros(1, np.intp)
    for lo, hi in levels[-2::-1]:
        # a node d paired with itself gives both children and their pair; two nodes p and q give four pairs
        same = i == j
        d, (p, q) = i[same], (i[~same], j[~same])
        i = np.concatenate([2 * d, 2 * d, 2 * d + 1, 2 * p, 2 * p, 2 * p + 1, 2 * p + 1])
        j = np.concatenate([2 * d, 2 * d + 1, 2 * d + 1, 2 * q, 2 * q + 1, 2 * q, 2 * q + 1])
        keep = ((lo[i] <= hi[j]) & (lo[j] <= hi[i])).all(axis=1)
        i, j = i[keep], j[keep]
    keep = i != j
    i, j = order[i[keep]], order[j[keep]]
    i, j = np.minimum(i, j), np.maximum(i, j)
    by = np.lexsort((j, i))
    return i[by], j[by]


def _morton(points: Array) -> NDArray[np.uint64]:
    """Morton code of every point [m], shape (n, 3): near codes are near places.

    A code has the bits of the three coordinates in turn.
    """
    span = max(float(np.ptp(points, axis=0).max()), 1e-300)
    cell = ((points - points.min(axis=0)) / span * (_CELLS - 1)).astype(np.uint64)
    code = np.zeros(len(points), np.uint64)
    for axis in range(3):
        x = cell[:, axis]
        for shift, mask in _SPREAD:
            x = (x | (x << np.uint64(shift))) & np.uint64(mask)
        code |= x << np.uint64(axis)
    return code
