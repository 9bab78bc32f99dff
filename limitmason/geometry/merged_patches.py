"""Contact patches of one pair of blocks that make one face together: joined where they fill their convex hull."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.geometry.polygon import axes_in_plane, joined_in_pairs

_LEVEL = 1e-9
"""1 less the cosine of two normals up to which patches may lie in one plane [-]: rounding."""

_ON_LINE = 1e-3
"""Part of the tolerance of contacts within which a corner lies on the line through others [-]: chosen."""


class ContactPatch(NamedTuple):
    """A contact patch between two blocks."""

    polygon: Array  # corners [m], (n, 3)
    normal: Array  # unit, (3,)
    area: float  # [m2]; 0 where it is joined to no other
    tolerance: float  # distance up to which faces of its blocks touch [m]


def merged(patches: list[ContactPatch]) -> list[ContactPatch]:
    """Patches of one pair of blocks, two of them joined at a time until no two fill their hull."""
    return joined_in_pairs(patches, _hull_if_filled)


def _hull_if_filled(one: ContactPatch, other: ContactPatch) -> ContactPatch | None:
    """Two coplanar patches as one, where they fill their convex hull."""
    p, q, normal, tolerance = one.polygon, other.polygon, one.normal, one.tolerance
    area = one.area + other.area
    if normal @ other.normal < 1.0 - _LEVEL or np.abs((q - p[0]) @ normal).max() > tolerance:
        return None
    points = np.vstack([p, q])
    flat = (points - p[0]) @ axes_in_plane(p, normal)
    hull = _hull(flat, _ON_LINE * tolerance)
    x, y = flat[hull].T
    hull_area = 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    # a strip as wide as the tolerance along the patch is no gap
    if abs(hull_area - area) > tolerance * np.sqrt(area):
        return None
    return ContactPatch(points[hull], normal, area, tolerance)


def _hull(points: Array, slack: float) -> list[int]:
    """Convex hull of points [m], (n, 2), as their numbers, counter-clockwise.

    It has no vertices closer than ``slack`` [m] to the line through their neighbours.
    """
    # points above each other but for rounding are taken as such, or rounding would order them: a corner is lost then
    order = np.argsort(points[:, 0], kind="stable")
    column = np.empty(len(points), dtype=np.intp)
    column[order] = np.cumsum(np.diff(points[order, 0], prepend=points[order[0], 0]) > slack)
    order = np.lexsort((points[:, 1], column))

    def half(sequence: Index) -> list[int]:
        """Lower half of the hull, from points in order along x."""
        chain: list[int] = []
        for i in sequence:
            while len(chain) >= 2:
                # the last point stays where it lies right of the line from the one before to this one, past the slack
                u, v = points[chain[-1]] - points[chain[-2]], points[i] - points[chain[-2]]
                if u[0] * v[1] - u[1] * v[0] > slack * np.linalg.norm(v):
                    break
                chain.pop()
            if not chain or np.linalg.norm(points[i] - points[chain[-1]]) > slack:
                chain.append(int(i))
        return chain

    lower, upper = half(order), half(order[::-1])
    return lower[:-1] + upper[:-1]
