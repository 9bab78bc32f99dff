"""Points of one face and their tributary areas: corners, lattices of quadrilaterals, fans of others, lines in plane."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import Legendre

from limitmason.arrays import Array, Index
from limitmason.mechanics.plane import Plane
from limitmason.model.arrays import AssemblyArrays

Rule = Callable[[int], tuple[Array, Array]]
"""Points on a side of unit length, and their weights times 1 - s and s."""


def _centroids(corners: Array, normal: Array) -> Array:
    """Centroids of polygons with equally many corners, from the triangles at their first corner [m], shape (m, 3).

    Arguments are those of :func:`corner_areas`.
    """
    r = corners - corners[:, :1]
    part = 0.5 * np.einsum("mti,mi->mt", np.cross(r[:, 1:-1], r[:, 2:]), normal)
    return corners[:, 0] + (part[..., None] * (r[:, 1:-1] + r[:, 2:]) / 3.0).sum(axis=1) / part.sum(axis=1)[:, None]


def corner_areas(corners: Array, normal: Array) -> Array:
    """Tributary areas of polygon corners that add up to the area and keep its centroid [m2], shape (m, k).

    Each triangle from the centroid to an edge gives half its area to either end: that is linear interpolation with the
    centroid's own third handed to the corners in the same proportion, which leaves the first moment unchanged.

    Parameters
    ----------
    corners : of m polygons, in order around each [m], shape (m, k, 3)
    normal : unit, about which the corners run counterclockwise, shape (m, 3)
    """
    q = corners - _centroids(corners, normal)[:, None]
    triangle = 0.5 * np.einsum("mti,mi->mt", np.cross(q, np.roll(q, -1, axis=1)), normal)
    return 0.5 * (triangle + np.roll(triangle, 1, axis=1))


def edge_points(n: int, elastic: bool) -> tuple[Array, Array]:
    """Evenly spaced points on 0 .. 1, ends included, and their weights times 1 - s and s.

    The width of a quadrilateral goes from that of one side at s = 0 to that of the other at s = 1: the first row weighs
    the one width, the second the other.

    Parameters
    ----------
    n : number of points, at least 2
    elastic : weights with the second moment of the face from n = 3 on; False for the integrals of hat functions

    Returns
    -------
    points, share : shape (n,), and shape (2, n); the sum of both rows is the weights, which add up to 1

    Notes
    -----
    Any stress below a strength, handed to the points by hat functions, stays below strength times their integrals:
    what limit analysis finds on them comes from above. Their second moment, though, is 1 + 2 / (n - 1)^2 times the
    face's, which elastic points must not have: handing h / (12 (1 - h)) of each end, h the spacing, to its
    neighbour makes it right (Simpson's rule for n = 3, the 3/8 rule for 4, Gregory's for many; exact up to cubics).
    Gauss-Lobatto points are exact to higher powers but leave an edge 1 / (n (n - 1)) of the area: blocks that
    overturn stand on it, and it gives way. With n = 2 area and centroid are kept; the second moment is then three
    times too large with any weights.
    """
    s, h = np.linspace(0.0, 1.0, n), 1.0 / (n - 1)
    weight = np.full(n, h)
    weight[[0, -1]] *= 0.5
    if elastic and n > 2:
        handed = h / (12.0 * (1.0 - h))
        weight[[0, -1]] -= handed
        weight[1] += handed
        weight[-2] += handed
        return s, np.stack([weight * (1.0 - s), weight * s])
    # integrals of hat functions times 1 - s and s. Hats inside are symmetric: weight times s is exact. The half hats at
    # the ends have their centroids h / 3 inside, which is h^2 / 6 more of s
    share = np.stack([weight * (1.0 - s), weight * s])
    share[:, 0] += np.array([-1.0, 1.0]) * h * h / 6.0
    share[:, -1] += np.array([1.0, -1.0]) * h * h / 6.0
    return s, share


def lobatto_points(n: int) -> tuple[Array, Array]:
    """Gauss-Lobatto points on 0 .. 1 and their weights times 1 - s and s, as :func:`edge_points`.

    Their ends bear 1 / (n (n - 1)) of a face: what a section crushes or breaks by at its edge is told in few points.

    Parameters
    ----------
    n : number of points, at least 2

    Returns
    -------
    s, share : shape (n,), and shape (2, n)
    """
    # on -1 .. 1: the ends, and where the Legendre polynomial of degree n - 1 is level, made symmetric beyond rounding
    inner = Legendre.basis(n - 1).deriv().roots().real if n > 2 else np.zeros(0)
    x = np.concatenate([[-1.0], np.sort(0.5 * (inner - inner[::-1])), [1.0]])
    weight = 1.0 / (n * (n - 1) * Legendre.basis(n - 1)(x) ** 2)  # half of those on -1 .. 1
    s = 0.5 * (x + 1.0)
    return s, np.stack([weight * (1.0 - s), weight * s])


def lattice_points(corners: Array, n1: int, n2: int, normal: Array, rule: Rule) -> tuple[Array, Array]:
    """Points of quadrilaterals, mapped from the unit square by its bilinear map, and their areas.

    The ratio of areas of this map is linear in either coordinate, so that its values at the corners give the areas of
    the points exactly.

    Parameters
    ----------
    corners : in order around each [m], shape (m, 4, 3)
    n1, n2 : points along the first side and across it
    normal : unit, shape (m, 3)
    rule : places on 0 .. 1 and weights times 1 - s and s, as :func:`edge_points`

    Returns
    -------
    tuple
        Places [m], (m, n1 n2, 3), and areas [m2], (m, n1 n2).
    """
    (s, along), (t, across) = rule(n1), rule(n2)
    a, b, c, d = corners[:, 0], corners[:, 1], corners[:, 2], corners[:, 3]
    # places on the sides a b and d c, and across from one to the other
    low = a[:, None] + s[None, :, None] * (b - a)[:, None]
    high = d[:, None] + s[None, :, None] * (c - d)[:, None]
    points = low[:, :, None] + t[None, None, :, None] * (high - low)[:, :, None]
    m = len(corners)
    weight = np.zeros((m, n1, n2))
    for i, edge in enumerate((b - a, c - d)):
        for j, side in enumerate((d - a, c - b)):
            # area of the map per unit square at the corner at s = j and t = i, by the sides that meet there
            ratio = np.einsum("mi,mi->m", np.cross(edge, side), normal)
            weight += ratio[:, None, None] * np.outer(along[j], across[i])
    return points.reshape(m, -1, 3), weight.reshape(m, -1)


def fan_points(corners: Array, n: int, normal: Array, rule: Rule) -> tuple[Array, Array]:
    """Rings of points between the centroid and the boundary of a polygon that is no quadrilateral.

    Every triangle from the centroid to a side is mapped from the unit square, s from the centroid outwards and t along
    the side; its ratio of areas grows as s, so that the centroid itself counts for nothing in exact weights.

    Parameters
    ----------
    corners : of m polygons, in order around each [m], shape (m, k, 3)
    normal : unit, shape (m, 3)
    n : points between the centroid and a corner, both counted
    rule : places on 0 .. 1 and weights times 1 - s and s, as :func:`edge_points`

    Returns
    -------
    points : [m], shape (m, p, 3)
    areas : [m2], shape (m, p)
    """
    m, centre = len(corners), _centroids(corners, normal)
    s, share = rule(n)
    outwards, along = share[1], share.sum(axis=0)
    following = np.roll(corners, -1, axis=1)
    side = following - corners
    boundary = (corners[:, :, None] + s[None, None, :-1, None] * side[:, :, None]).reshape(m, -1, 3)
    # twice the area of the triangle from the centroid to each side
    ratio = np.einsum("mki,mi->mk", np.cross(corners - centre[:, None], side), normal)
    # a corner ends one side and begins the next
    load = ratio[:, :, None] * along[:-1]
    load[:, :, 0] += along[-1] * np.roll(ratio, 1, axis=1)
    load = load.reshape(m, -1)
    rings = range(1, n)
    points = [centre[:, None] + s[k] * (boundary - centre[:, None]) for k in rings]
    weight = [outwards[k] * load for k in rings]
    # integrals of hat functions leave the centroid a part, elastic and Gauss-Lobatto weights none
    if outwards[0] > 0.0:
        points, weight = [centre[:, None], *points], [outwards[0] * ratio.sum(axis=1)[:, None], *weight]
    return np.concatenate(points, axis=1), np.concatenate(weight, axis=1)


def plane_points(
    corners: Array, x: AssemblyArrays, rows: Index, plane: Plane, n: int, rule: Rule
) -> tuple[Array, Array]:
    """Points along each interface on the plane of symmetry, ends included, and their areas.

    Each point stands for a strip across the whole joint.

    Parameters
    ----------
    corners : of the interfaces [m], shape (m, k, 3)
    x : all interfaces
    rows : numbers of these interfaces, shape (m,)
    plane : in which the points lie
    n : points along each interface
    rule : places on 0 .. 1 and weights times 1 - s and s, as :func:`edge_points`

    Returns
    -------
    points : [m], shape (m, n, 3)
    areas : [m2], shape (m, n)
    """
    tangent = np.cross(plane.normal, x.normal[rows])
    # along the joint from its centre [m]
    s = np.einsum("mki,mi->mk", corners - x.centre[rows][:, None], tangent)
    low, high = s.min(axis=1), s.max(axis=1)
    t, share = rule(n)
    along = low[:, None] + t * (high - low)[:, None]
    weight = share.sum(axis=0)
    return x.centre[rows][:, None] + along[..., None] * tangent[:, None], x.area[rows][:, None] * weight
