"""Part of two faces' common area where the gap between them is within a distance, and its centre."""

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.geometry.facing import FacingPairs
from limitmason.geometry.polygon import centroid_in_space, part_within


def closed_part(polygon: Array, gap: Array, limit: float) -> Array:
    """Part of a convex polygon in which a gap stays within a limit [m], shape (k, 3).

    The polygon has corners [m], shape (n, 3), at which ``gap`` is given [m], shape (n,); between them it is linear.
    What is closed along an edge or at a corner alone has fewer than three corners.
    """
    corners = part_within(polygon, gap, limit)
    if len(corners) < 3:
        return corners
    step = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    return corners[step > 1e-9 * step.sum()]  # without corners that are one but for rounding


def closed_centres(pairs: FacingPairs, rows: Index) -> Array:
    """Centroid of that half of the common area where the gap is smaller [m], (r, 3).

    What fills the mouth of a wedge need not reach its edge, so the open half tells less.

    Parameters
    ----------
    pairs : of faces
    rows : numbers of those that are looked at
    """
    out = np.empty((len(rows), 3))
    for row, k in enumerate(rows.tolist()):
        n = pairs.corners_of[k]
        polygon, gap = pairs.points[k, :n], pairs.gap[k, :n]
        low, high = float(gap.min()), float(gap.max())
        if high - low > 1e-6 * (abs(high) + abs(low)):  # else the faces are parallel: no half is closed
            half = closed_part(polygon, gap, 0.5 * (low + high))
            polygon = half if len(half) > 2 else polygon
        out[row] = centroid_in_space(polygon)
    return out
