"""Plane polygons: area, centroid, simplicity, convex decomposition, reflection overlap and polar mean radius."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.errors import InputError

T = TypeVar("T")

STRAIGHT = 0.01
"""Part of the distance of two vertices that are one, at which a vertex leaves the line through others: chosen [-]."""

_ANGLE = 1e-9
"""Sine of a corner's turn that counts as straight [-]: rounding."""

_NO_AREA = 1e-9
"""Area over the square of a polygon's size below which it counts as a line [-]: rounding."""

NO_LENGTH = 1e-14
"""Length of a side over the polygon's size below which it has no direction [-]: rounding."""

NO_HEIGHT = 1e-12
"""Distance of a side's line from the pole over the polygon's size below which the line meets it [-]: rounding."""


def polygon_area_centroid(polygon: ArrayLike) -> tuple[float, Array]:
    """Signed area and centroid of a simple polygon.

    A = 1/2 sum (x_i y_{i+1} - x_{i+1} y_i); positive when the vertices run counter-clockwise.

    Parameters
    ----------
    polygon : [m], shape (n, 2)

    Returns
    -------
    area : [m2], signed
    centroid : [m], shape (2,); the vertex mean when the area vanishes
    """
    p = np.asarray(polygon, dtype=float)
    origin = p.mean(axis=0)
    q = p - origin  # a local origin keeps the cancellation small for outlines far from zero
    r = np.roll(q, -1, axis=0)
    cross = q[:, 0] * r[:, 1] - q[:, 1] * r[:, 0]
    area = 0.5 * cross.sum()
    if abs(area) <= 1e-300:
        return 0.0, origin
    return float(area), origin + ((q + r) * cross[:, None]).sum(axis=0) / (6.0 * area)


def axes_in_plane(corners: Array, normal: Array) -> Array:
    """Unit axes in the plane of a polygon as columns, the first along its first side, shape (3, 2).

    Parameters
    ----------
    corners : [m], shape (n, 3)
    normal : unit, shape (3,)
    """
    along = corners[1] - corners[0]
    along = along - (along @ normal) * normal
    along /= np.linalg.norm(along)
    return np.column_stack([along, np.cross(normal, along)])


def area_in_space(corners: Array) -> float:
    """Area of a plane polygon in space [m2], corners [m], shape (n, 3), zero for fewer than three."""
    if len(corners) < 3:
        return 0.0
    r = corners - corners[0]
    return 0.5 * float(np.linalg.norm(np.cross(r[1:-1], r[2:]).sum(axis=0)))


def width_in_space(corners: Array) -> float:
    """Twice the area over the perimeter of a plane polygon in space [m], corners [m], shape (n, 3)."""
    perimeter = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).sum()
    return float(2.0 * area_in_space(corners) / perimeter) if len(corners) > 2 else 0.0


def centroid_in_space(corners: Array) -> Array:
    """Centroid of a convex plane polygon in space [m], shape (3,), corners [m], shape (n, 3)."""
    r = corners - corners[0]
    part = np.linalg.norm(np.cross(r[1:-1], r[2:]), axis=1)  # triangles at the first corner, areas doubled
    return corners[0] + part @ (r[1:-1] + r[2:]) / 3.0 / max(float(part.sum()), 1e-300)


def clean_outline(outline: ArrayLike, tolerance: float) -> Array:
    """Counter-clockwise outline without repeated or collinear vertices [m], (k, 2).

    Parameters
    ----------
    outline : [m], shape (n, 2)
    tolerance : vertices closer than this to their neighbour are dropped, and those closer than ``STRAIGHT`` of it to
        the line through both neighbours [m]

    Raises
    ------
    InputError
        When fewer than three vertices remain, a coordinate is not finite, or two edges cross.
    """
    p = np.asarray(outline, dtype=float)
    if p.ndim != 2 or p.shape[1] != 2:
        raise InputError(f"an outline is an array of shape (n, 2), got shape {p.shape}")
    if not np.isfinite(p).all():
        raise InputError("the outline has a coordinate that is not finite (NaN or infinite)")
    p = p[np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1) > tolerance]
    # one vertex at a time, the straightest first: two neighbours that each look straight may together be a corner
    while len(p) > 2:
        before, after = np.roll(p, 1, axis=0), np.roll(p, -1, axis=0)
        chord = after - before
        length = np.maximum(np.linalg.norm(chord, axis=1), 1e-300)
        offset = np.abs(chord[:, 0] * (p - before)[:, 1] - chord[:, 1] * (p - before)[:, 0]) / length
        if offset.min() > STRAIGHT * tolerance:
            break
        p = np.delete(p, offset.argmin(), axis=0)
    if len(p) < 3:
        raise InputError("the outline encloses no area (fewer than three distinct vertices)")
    if crossing := _crossing_edges(p):
        raise InputError(f"the outline crosses itself: edges {crossing[0]} and {crossing[1]} intersect")
    return p if polygon_area_centroid(p)[0] > 0 else p[::-1].copy()


def _crossing_edges(p: Array) -> tuple[int, int] | None:
    """Numbers of two edges of a closed outline p (n, 2) that cross, or None."""
    n = len(p)
    a, b = p, np.roll(p, -1, axis=0)
    i, j = np.triu_indices(n, 2)  # pairs of edges that are not next to each other, the last and the first aside
    keep = (j + 1) % n != i
    i, j = i[keep], j[keep]

    def side(o: Array, e: Array, q: Array) -> Array:
        """Twice the area from o to e to q: positive where q lies left of the line from o to e."""
        return (e - o)[:, 0] * (q - o)[:, 1] - (e - o)[:, 1] * (q - o)[:, 0]

    s1, s2 = side(a[i], b[i], a[j]), side(a[i], b[i], b[j])
    s3, s4 = side(a[j], b[j], a[i]), side(a[j], b[j], b[i])
    hit = np.flatnonzero((s1 * s2 < 0) & (s3 * s4 < 0))
    return (int(i[hit[0]]), int(j[hit[0]])) if len(hit) else None


def convex_pieces(polygon: ArrayLike) -> list[Array]:
    """Split a simple counter-clockwise polygon into convex pieces that tile it.

    Ears are clipped, then triangles are joined across every diagonal whose removal keeps both ends convex
    (at most four times the smallest possible number of pieces).

    Parameters
    ----------
    polygon : [m], shape (n, 2), simple, counter-clockwise

    Returns
    -------
    list of [m], shape (k, 2), counter-clockwise
    """
    p = np.asarray(polygon, dtype=float)
    if _is_convex(p, range(len(p))):
        return [p]
    pieces = joined_in_pairs([list(t) for t in _ears(p)], partial(_join, p))
    return [p[piece] for piece in pieces]


def joined_in_pairs(items: list[T], join: Callable[[T, T], T | None]) -> list[T]:
    """Items joined in pairs until no two can be.

    The first pair that can be joined is made one, in the place of its first, and so on.

    Parameters
    ----------
    items : in any number
    join : makes one of two items, or None where they cannot be joined
    """
    while True:
        pairs = ((i, j, join(items[i], items[j])) for i in range(len(items)) for j in range(i + 1, len(items)))
        i, j, both = next((pair for pair in pairs if pair[2] is not None), (0, 0, None))
        if both is None:
            return items
        items = [*items[:i], both, *items[i + 1 : j], *items[j + 1 :]]


def _turn(a: Array, b: Array, c: Array) -> float:
    """Twice the area of a triangle a, b, c, positive where it runs counter-clockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _is_convex(p: Array, indices: Iterable[int]) -> bool:
    """Whether corners of a set, in the order of their numbers, make a convex polygon.

    The set is ``p`` [m], shape (n, 2); ``indices`` are the numbers. A straight corner counts as convex.
    """
    q = p[list(indices)]
    e = np.roll(q, -1, axis=0) - q
    f = np.roll(e, -1, axis=0)
    scale = np.linalg.norm(e, axis=1) * np.linalg.norm(f, axis=1)
    return bool((e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0] >= -_ANGLE * scale).all())


def _ears(p: Array) -> list[tuple[int, int, int]]:
    """Triangles that tile a simple polygon, as numbers of its corners.

    Ears of the polygon ``p``, shape (n, 2), counter-clockwise, are cut off one by one.
    """
    remaining = list(range(len(p)))
    triangles = []
    while len(remaining) > 3:
        best = None
        for k in range(len(remaining)):
            a, b, c = remaining[k - 1], remaining[k], remaining[(k + 1) % len(remaining)]
            # an ear is a corner that turns left and whose triangle holds no other corner
            turn = _turn(p[a], p[b], p[c])
            if turn <= 0:
                continue
            others = [q for q in remaining if q not in (a, b, c)]
            if any(
                _turn(p[a], p[b], p[q]) >= 0 and _turn(p[b], p[c], p[q]) >= 0 and _turn(p[c], p[a], p[q]) >= 0
                for q in others
            ):
                continue
            # the fattest ear first: slivers would give contact patches thinner than the tolerance
            sides = [np.linalg.norm(p[a] - p[b]), np.linalg.norm(p[b] - p[c]), np.linalg.norm(p[c] - p[a])]
            quality = turn / max(sides) ** 2
            if best is None or quality > best[0]:
                best = (quality, k, (a, b, c))
        if best is None:
            raise InputError("the outline cannot be divided into triangles: it touches or crosses itself")
        triangles.append(best[2])
        del remaining[best[1]]
    triangles.append((remaining[0], remaining[1], remaining[2]))
    return triangles


def _join(p: Array, first: list[int], second: list[int]) -> list[int] | None:
    """Two rings of corners joined along a common edge, if the result is convex.

    Parameters
    ----------
    p : corners [m], shape (n, 2)
    first, second : numbers of the corners of both rings, counter-clockwise
    """
    for k, a in enumerate(first):
        b = first[(k + 1) % len(first)]
        for m, c in enumerate(second):
            # the common edge runs from a to b in the first ring and back in the second
            if c == b and second[(m + 1) % len(second)] == a:
                ring = first[k + 1 :] + first[: k + 1]
                other = second[m + 1 :] + second[: m + 1]
                candidate = ring + other[1:-1]
                return candidate if _is_convex(p, candidate) else None
    return None


def clip_convex(subject: ArrayLike, window: ArrayLike) -> Array:
    """Part of a convex polygon inside a convex counter-clockwise window.

    Parameters
    ----------
    subject, window : [m], shape (n, 2) and (k, 2)

    Returns
    -------
    [m], shape (j, 2); empty when they do not overlap
    """
    p = np.asarray(subject, dtype=float)
    w = np.asarray(window, dtype=float)
    for a, b in zip(w, np.roll(w, -1, axis=0), strict=True):
        p = left_of_line(p, a, b)
    return p


def left_of_line(polygon: Array, a: Array, b: Array) -> Array:
    """Part of a convex polygon left of the line from point a to point b [m], shape (k, 2), as ``part_within`` gives it.

    Parameters
    ----------
    polygon : [m], shape (n, 2)
    a, b : [m], shape (2,)
    """
    # twice the area of a, b and each corner, positive to the right of the line
    return part_within(polygon, (b[1] - a[1]) * (polygon[:, 0] - a[0]) - (b[0] - a[0]) * (polygon[:, 1] - a[1]))


def part_within(polygon: Array, value: Array, limit: float = 0.0) -> Array:
    """Part of a convex polygon where a value that is linear over it is at most a limit [m], shape (k, 2) or (k, 3).

    Corners at the limit stay: of what meets it at a corner or along a side alone one or two are left, without slack.

    Parameters
    ----------
    polygon : [m], shape (n, 2) or (n, 3)
    value : at its corners, shape (n,)
    limit : in the unit of the value
    """
    out = []
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if value[i] <= limit:
            out.append(polygon[i])
        if value[i] < limit < value[j] or value[j] < limit < value[i]:
            out.append(polygon[i] + (limit - value[i]) / (value[j] - value[i]) * (polygon[j] - polygon[i]))
    return np.array(out).reshape(-1, polygon.shape[1])


def polar_mean_radius(polygon: ArrayLike, pole: ArrayLike) -> float:
    """Mean distance of the points of a polygon from a pole.

    r_m = (1/A) integral |x - pole| dA.

    The torque a face can carry under uniform pressure is mu N r_m. Every edge and the pole span a triangle whose
    integral is closed: h^3/6 [u sqrt(1 + u^2) + asinh u] between the edge's ends, u measured along the edge in
    units of the pole's distance h from it.

    Parameters
    ----------
    polygon : [m], shape (n, 2), counter-clockwise; the pole may lie anywhere
    pole : [m], shape (2,)

    Returns
    -------
    [m]; for a polygon squeezed to a line, a quarter of its length when the pole is its middle

    Notes
    -----
    Unit square about its centre: 0.382598; 2 x 1: 0.593233 (integrated independently in the tests).
    """
    q = np.asarray(polygon, dtype=float) - np.asarray(pole, dtype=float)
    size = np.ptp(q, axis=0).max()
    area = abs(polygon_area_centroid(q)[0])
    if area <= _NO_AREA * size**2:
        if size == 0.0:
            return 0.0
        # without area it is a line at a distance h from the pole: the mean of sqrt(s^2 + h^2) along it is taken
        direction = q[np.argmax(np.linalg.norm(q - q[0], axis=1))] - q[0]
        direction /= np.linalg.norm(direction)
        s = q @ direction
        h = abs(float(q[0, 0] * direction[1] - q[0, 1] * direction[0]))
        ends = np.array([s.min(), s.max()])
        low, high = ends * np.hypot(ends, h) + h**2 * np.arcsinh(ends / max(h, 1e-300))
        return float((high - low) / (2.0 * np.ptp(ends)))
    r = np.roll(q, -1, axis=0)
    edge = r - q
    length = np.linalg.norm(edge, axis=1)
    keep = length > NO_LENGTH * size
    q, r, edge, length = q[keep], r[keep], edge[keep], length[keep]
    t = edge / length[:, None]
    h = q[:, 0] * t[:, 1] - q[:, 1] * t[:, 0]  # distance of the pole from the side's line, positive to its left [m]
    # a side that points at the pole spans no area
    keep = np.abs(h) > NO_HEIGHT * size
    q, r, t, h = q[keep], r[keep], t[keep], h[keep]
    u0, u1 = (q * t).sum(axis=1) / np.abs(h), (r * t).sum(axis=1) / np.abs(h)

    def primitive(u: Array) -> Array:
        """Integral of twice sqrt(1 + u^2) over u."""
        return u * np.sqrt(1.0 + u * u) + np.arcsinh(u)

    integral = np.sign(h) * np.abs(h) ** 3 / 6.0 * (primitive(u1) - primitive(u0))
    return float(abs(integral.sum()) / area)


def centred_overlap(polygon: ArrayLike, centre: ArrayLike) -> Array:
    """The part of a convex polygon that is symmetric about a point: P intersected with its image 2 c - P.

    It is the largest area whose uniform pressure has its resultant at ``centre``; corners [m], shape (k, 2).

    Parameters
    ----------
    polygon : [m], shape (n, 2), convex, counter-clockwise
    centre : [m], shape (2,)
    """
    p = np.asarray(polygon, dtype=float)
    return clip_convex(p, 2.0 * np.asarray(centre, dtype=float) - p)
