"""Joints that bear on an edge of block a alone, so on block b's face."""

import numpy as np

from dem.kernels.arrays import Array, Index, Points
from dem.kernels.compiled import kernel

OF_A, OF_B, OF_BOTH = 0, 1, 2
"""Whose edge ends a contact."""

ELSEWHERE, ON_A, UNKNOWN = 0, 1, 2
"""Where a joint bears: not on an edge of a alone, on one, or on an end of which nobody has asked whose it is."""


ROW = 1e-9
"""Difference of places across an axis, over the extent of all points across it, up to which points lie in one row."""

INWARD = 2e-3
"""Distance along an axis, over the outline's length, from which a point lies beyond another; chosen."""

AT_THE_END = 1e-3
"""Part of the way between two ends up to which a point lies at one of them; chosen."""


@kernel(fast=False, forceinline=True)
def extremes(x: Array, count: int) -> tuple[int, int]:
    """Places of the least and the largest of the first ``count`` numbers of x.

    Of equal ones it is the first.
    """
    low = high = 0
    for k in range(1, count):
        low = k if x[k] < x[low] else low
        high = k if x[k] > x[high] else high
    return low, high


@kernel(fast=False, forceinline=True)
def extent(x: Array, count: int) -> float:
    """Largest of the first ``count`` numbers of x less the smallest of them."""
    low, high = extremes(x, count)
    return x[high] - x[low]


@kernel(fast=False, forceinline=True)
def _may_be_at_an_end(along: Array, aside: Array, opening: Array) -> bool:
    """Whether all pressed points may be at one end of the outline along an axis.

    They are not where other points lie beyond in the same row, to both sides.

    Parameters
    ----------
    along, aside : places of every point along the axis and across it [m], shape (k,)
    opening : of every point, below 0 where it is pressed [m], shape (k,)
    """
    level, length = ROW * extent(aside, len(aside)), max(extent(along, len(along)), 1e-300)
    above = below = False
    for i in range(len(along)):
        if opening[i] < 0.0:
            for j in range(len(along)):
                if abs(aside[i] - aside[j]) <= level:
                    beyond = (along[j] - along[i]) / length
                    above, below = above or beyond > INWARD, below or beyond < -INWARD
    return not (above and below)


@kernel(fast=False, forceinline=True)
def _on_a(ends: Array, opening: Array, slip: Array) -> bool:
    """Whether all pressed points lie at an end along an axis that is an edge of a.

    An edge of both counts while b slides off it.

    Parameters
    ----------
    ends : of every point, as :func:`dem.kernels.outlines.find_ends` writes them, shape (k, 10)
    opening : of every point, below 0 where it is pressed [m], shape (k,)
    slip : of every point, b against a along s and t [m], shape (k, 2)
    """
    for c in range(2):
        upper = lower = True
        for i in range(len(opening)):
            if opening[i] < 0.0:
                # part of the way from the lower to the upper end along axis c, and whose edge either end is
                part, low, high = ends[i, 4 + 3 * c], ends[i, 5 + 3 * c], ends[i, 6 + 3 * c]
                upper = upper and part > 1.0 - AT_THE_END and (high == OF_A or (high == OF_BOTH and slip[i, c] > 0.0))
                lower = lower and part < AT_THE_END and (low == OF_A or (low == OF_BOTH and slip[i, c] < 0.0))
        if upper or lower:
            return True
    return False


@kernel(fast=False)
def bearing_ends(
    points: Points, start: Index, ends: Array, opening: Array, slip: Array, rows: Index, where: Index
) -> None:
    """Where some joints that slid and turned bear: ELSEWHERE, ON_A or UNKNOWN.

    Parameters
    ----------
    points : all points
    start : first point of every joint, shape (k + 1,)
    ends : see ``State.ends``: NaN in column 1 of joints that have not slid, in column 0 where nobody has asked
    opening : of all points now, below 0 where pressed [m], shape (m,)
    slip : of all points now, b against a along s and t [m], shape (m, 2)
    rows : joints that are asked for, shape (r,)
    where : where each of them bears, written, shape (r,)
    """
    for i in range(len(rows)):
        first, last = start[rows[i]], start[rows[i] + 1]
        where[i] = ELSEWHERE
        pressed = 0
        for k in range(first, last):
            pressed += opening[k] < 0.0
        # a joint pressed everywhere, or nowhere, bears on no edge
        if first == last or np.isnan(ends[first, 1]) or pressed == 0 or pressed == last - first:
            continue
        deep = opening[first:last]  # below 0 where pressed
        if np.isnan(ends[first, 0]):
            s, t = points.s[first:last], points.t[first:last]
            if _may_be_at_an_end(s, t, deep) or _may_be_at_an_end(t, s, deep):
                where[i] = UNKNOWN
        elif _on_a(ends[first:last], deep, slip[first:last]):
            where[i] = ON_A
