"""Convex sets of a few dimensions by points or half-spaces: corners, nearest points, extreme points and rays."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import HalfspaceIntersection

from limitmason.arrays import Array

OUTWEIGHS = 1e3
"""Weight of an equation that must hold beside those to be fitted, whose terms are of size one: chosen."""

_RAYS_ALIKE = 1e-6
"""Distance of a unit ray from sums of others below which it is one of them: beyond the rounding of nnls, chosen."""

_POINTS_ALIKE = 1e-7
"""Distance of a point from the hull of others, in a set of size one, below which it lies in it: chosen."""

_HAIR = 1e-10
"""By how much half-spaces are widened, so that a flat set has an inside: chosen."""


def corners_of_half_spaces(normal: Array, offset: Array, inner: Array) -> Array:
    """Corners of the set normal . y <= offset, shape (m, k).

    Parameters
    ----------
    normal, offset : of every half-space, of any length, shapes (p, k) and (p,)
    inner : points within all of them, shape (n, k)
    """
    length = np.linalg.norm(normal, axis=1)
    offset, normal = offset / length, normal / length[:, None]
    if normal.shape[1] == 1:
        # an interval, which qhull does not take: its two ends
        return np.array([[offset[normal[:, 0] > 0].min()], [-offset[normal[:, 0] < 0].min()]])
    # a hair wider, so that what is found of a flat set has an inside
    room = _HAIR + np.maximum((inner @ normal.T).max(axis=0) - offset, 0.0)
    middle = inner.mean(axis=0)
    return np.asarray(HalfspaceIntersection(np.column_stack([normal, -offset - room]), middle).intersections)


def nearest_in_hull(points: Array, w: Array, rays: Array | None = None) -> Array:
    """The point of a convex hull, widened by rays, that is nearest to w, shape (k,).

    Parameters
    ----------
    points : whose hull it is, shape (n, k)
    w : shape (k,)
    rays : directions of which sums with shares from zero up may be added to the hull, shape (r, k); none by default
    """
    rays = np.zeros((0, len(w))) if rays is None else rays
    scale = max(float(np.abs(points - w).max()), 1e-300)
    # the shares sum to one by a row that outweighs the distances; what is left of it is divided out
    weight = np.append(np.full(len(points), OUTWEIGHS), np.zeros(len(rays)))
    rows = np.vstack([np.hstack([(points - w).T / scale, rays.T]), weight])
    share = nnls(rows, np.append(np.zeros(len(w)), OUTWEIGHS))[0]
    total = share[: len(points)].sum()
    return np.asarray((share[: len(points)] @ points + scale * (share[len(points) :] @ rays)) / total)


def positively_spans(vectors: Array) -> bool:
    """Whether sums of vectors, shape (n, k), with shares from zero up reach every direction.

    Half-spaces with these normals then bound a set.
    """
    axes = np.eye(vectors.shape[1])
    return len(vectors) > 0 and all(nnls(vectors.T, d)[1] < _RAYS_ALIKE for d in (*axes, *-axes))


def extreme_rays(rays: Array) -> Array:
    """Those of unit rays, shape (r, k), that are no positive sum of others."""
    # nnls gives the distance that is left to the nearest such sum
    return rays[_needed(len(rays), lambda i, rest: nnls(rays[rest].T, rays[i])[1] < _RAYS_ALIKE)]


def extreme_points(points: Array) -> list[int]:
    """Numbers of the points (n, k) that are not between others, of a set whose size is about one."""
    def between(i: int, rest: list[int]) -> bool:
        """Whether a point lies in the hull of others."""
        return float(np.linalg.norm(points[i] - nearest_in_hull(points[rest], points[i]))) < _POINTS_ALIKE

    return _needed(len(points), between)


def _needed(count: int, made_of: Callable[[int, list[int]], bool]) -> list[int]:
    """Numbers of those of ``count`` things that cannot be made of the others.

    Those that can are taken out one by one.

    Parameters
    ----------
    made_of : whether the thing of a number can be made of those of a list of numbers
    """
    kept = list(range(count))
    for i in range(count):
        rest = [j for j in kept if j != i]
        if rest and made_of(i, rest):
            kept = rest
    return kept
