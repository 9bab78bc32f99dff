"""Hidden surfaces without a depth buffer: pieces sorted, those behind first.

Sorting faces by mean depth, as ``mpl_toolkits.mplot3d`` does, puts a long ground slab in front of the blocks on it.
Two convex pieces that a face of one of them separates are told by its plane, which of them can hide the other: the
order is then exact, and the drawing stays a vector drawing. Of others the face of least overlap decides.

``solids`` are convex pieces where they are drawn, and ``view`` is from where they are seen.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from limitmason.arrays import Array, Flags, Index
from limitmason.checks import finite
from limitmason.errors import InputError
from limitmason.geometry import Solid
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.polyhedron import face_planes, group_by_topology


class Camera(NamedTuple):
    """Parallel projection: unit vectors right and up on the page, and to the viewer."""

    right: Array
    up: Array
    towards: Array

    def project(self, points: Array) -> Array:
        """Page coordinates [m], shape (n, 2)."""
        return np.asarray(points) @ np.column_stack([self.right, self.up])


VIEWPOINT_DEG = (-58.0, 22.0)
"""Azimuth and elevation of the viewer where none are given [deg]."""


def viewpoint(viewpoint_deg: tuple[float, float]) -> tuple[float, float]:
    """Azimuth and elevation [deg] of a viewer as a user gives them, both finite."""
    try:
        azimuth, elevation = viewpoint_deg
    except (TypeError, ValueError):
        raise InputError(f"viewpoint_deg must be azimuth and elevation [deg], got {viewpoint_deg!r}") from None
    return finite("azimuth of viewpoint_deg", azimuth), finite("elevation of viewpoint_deg", elevation)


def camera(azimuth_deg: float, elevation_deg: float) -> Camera:
    """Camera that looks at the origin from an azimuth and an elevation [deg].

    ``azimuth_deg`` counts from x towards y.

    From straight above or below no direction would be up on the page.
    """
    finite("azimuth_deg", azimuth_deg)
    if not -90.0 < finite("elevation_deg", elevation_deg) < 90.0:
        raise InputError(f"elevation_deg must be between -90 and 90, got {elevation_deg!r}")
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return Camera(right, np.cross(towards, right), towards)


class FacePlanes(NamedTuple):
    """Face planes of pieces, padded by NaN: normals (p, f, 3), offsets (p, f) [m].

    Normals point outwards.
    """

    normal: Array
    offset: Array


def piece_faces(solids: Sequence[Solid]) -> FacePlanes:
    """Outward normals and offsets of faces of all pieces, padded to the most."""
    widest = max(len(s.faces) for s in solids)
    normal, offset = np.full((len(solids), widest, 3), np.nan), np.full((len(solids), widest), np.nan)
    for faces, members, vertices in group_by_topology(solids):
        for k, face in enumerate(faces):
            normal[members, k], offset[members, k] = face_planes(vertices[:, list(face)])
    return FacePlanes(normal, offset)


def back_to_front(solids: Sequence[Solid], faces: FacePlanes, view: Camera) -> list[int]:
    """Numbers of convex pieces in the order in which to paint them.

    Pieces in contact may overlap slightly (finite rotations do that): the plane of least overlap then decides, the
    surer the more the least overlap with the other verdict exceeds it. A cycle, in which each piece hides part of the
    next, has no valid order: the least sure of its verdicts is given up, and nothing outside is painted out of turn.

    Parameters
    ----------
    faces : of ``solids``, from :func:`piece_faces`
    view : from which they are seen
    """
    i, j, front, _, sure = _hiding(solids, faces, view)
    depth = np.array([s.vertices.mean(axis=0) @ view.towards for s in solids])
    hides = front != 0
    behind = np.where(front > 0, i, j)[hides]
    before = np.where(front > 0, j, i)[hides]
    return _sorted_by_depth(len(solids), behind.tolist(), before.tolist(), depth, sure[hides].tolist())


def places_behind(order: list[int], solids: Sequence[Solid], others: Sequence[Solid], view: Camera) -> list[int]:
    """Where in the order to paint other pieces, which may overlap the sorted ones.

    Each comes before all sorted pieces that can hide it. Of two pieces that occupy the same space the sorted one hides
    the other. What the others hide of each other is not asked: of them edges alone are drawn.

    Parameters
    ----------
    order : of ``solids``, from :func:`back_to_front`
    others : pieces to put in between

    Returns
    -------
    position in ``order`` before which each of ``others`` is painted; its length where nothing hides it
    """
    n = len(solids)
    both = [*solids, *others]
    i, j, front, overlap, _ = _hiding(both, piece_faces(both), view)
    # pairs of a sorted piece i and another j that i hides, or that overlap
    mixed = (i < n) & (j >= n) & ((front < 0) | overlap)
    position = np.empty(n, dtype=np.intp)
    position[order] = np.arange(n)
    place = np.full(len(others), n, dtype=np.intp)
    np.minimum.at(place, j[mixed] - n, position[i[mixed]])
    return place.tolist()


_AT_ONCE = 20000
"""Pairs of pieces that are compared at a time: memory stays bounded."""

_PARALLEL = 1e-9
"""Sine of an angle, and gap over the size of the drawing, that count as none: rounding [-]."""


def _hiding(solids: Sequence[Solid], faces: FacePlanes, view: Camera) -> tuple[Index, Index, Index, Flags, Array]:
    """Which of two pieces whose boxes meet on the page hides the other.

    Parameters
    ----------
    faces : of ``solids``, from :func:`piece_faces`

    Returns
    -------
    i, j : numbers i < j of the m pairs, shape (m,) each
    front : +1 where j may hide i, -1 where i may hide j, 0 where neither can
    overlap : whether they overlap in space
    sure : how sure ``front`` is, from :func:`_which_in_front` [m]
    """
    page = [view.project(s.vertices) for s in solids]
    # boxes of no depth: pieces far apart along the line of sight hide each other too
    low = np.array([[*p.min(axis=0), 0.0] for p in page])
    high = np.array([[*p.max(axis=0), 0.0] for p in page])
    i, j = overlapping_pairs(low, high)
    widest = max(len(s.vertices) for s in solids)
    # padded by the first corner: extremes stay the same
    corners = np.array([s.vertices[[*range(len(s.vertices)), *[0] * (widest - len(s.vertices))]] for s in solids])
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    front, overlap, sure = np.zeros(len(i), dtype=np.intp), np.zeros(len(i), dtype=bool), np.zeros(len(i))
    for first in range(0, len(i), _AT_ONCE):
        rows = slice(first, first + _AT_ONCE)
        found = _which_in_front(i[rows], j[rows], corners, faces, view.towards, size)
        front[rows], overlap[rows], sure[rows] = found
    return i, j, front, overlap, sure


def _which_in_front(
    i: Index, j: Index, corners: Array, faces: FacePlanes, towards: Array, size: float
) -> tuple[Index, Flags, Array]:
    """Which piece of every pair hides the other, by faces as planes between them.

    Edges of both are no planes here: two pieces that only a plane along two edges separates count as overlapping.

    Parameters
    ----------
    i, j : pieces of every pair, shape (m,)
    corners : of all pieces, padded [m], shape (n, v, 3)
    faces : of all pieces
    towards : unit vector to the viewer
    size : extent of all pieces [m]

    Returns
    -------
    front : +1 where piece j may hide piece i, -1 where i may hide j, 0 where neither can, shape (m,)
    overlap : whether no face has the two on different sides
    sure : difference between the widest gaps, or least overlaps, that speak for either verdict [m]
    """
    # gap between every face of i and all of j, then between every face of j and all of i; negative for an overlap.
    # Where slope is positive, a gap has j on the side of the viewer
    gap_i = np.einsum("mfk,mvk->mfv", faces.normal[i], corners[j]).min(axis=2) - faces.offset[i]
    gap_j = np.einsum("mfk,mvk->mfv", faces.normal[j], corners[i]).min(axis=2) - faces.offset[j]
    gap = np.concatenate([gap_i, gap_j], axis=1)
    slope = np.concatenate([faces.normal[i] @ towards, -(faces.normal[j] @ towards)], axis=1)
    gap = np.where(np.isnan(gap), -np.inf, gap)  # padded faces tell nothing
    apart = gap >= -_PARALLEL * size
    edge_on = np.abs(slope) < _PARALLEL
    ahead = (apart & (slope > 0.0)).any(axis=1)
    back = (apart & (slope < 0.0)).any(axis=1)
    # planes that say both: each keeps one piece from hiding the other, so neither does
    verdict = np.where(ahead & ~back, 1, np.where(back & ~ahead, -1, 0))
    # without a plane between both, the plane of least overlap decides
    best = gap.argmax(axis=1)
    overlap = np.asarray(~apart.any(axis=1))
    verdict = np.where(overlap, np.sign(slope[np.arange(len(i)), best]).astype(int), verdict)
    widest = [np.where(slope * side > 0.0, gap, -size).max(axis=1) for side in (1.0, -1.0)]
    # a plane between both along the line of sight: side by side on the page, neither hides the other
    return np.where((apart & edge_on).any(axis=1), 0, verdict), overlap, np.abs(widest[0] - widest[1])


def _sorted_by_depth(
    n: int, behind: list[int], before: list[int], depth: Array, sure: Sequence[float]
) -> list[int]:
    """Numbers of pieces in painting order: each after those behind it.

    The farthest is first.

    In a cycle the piece goes first whose surest verdict of something behind it is the least sure.

    Parameters
    ----------
    n : number of pieces
    behind, before : pairs of pieces of which the second hides the first
    depth : of every piece along the direction to the viewer [m], shape (n,)
    sure : how certain each pair is [m]
    """
    # number of the strongly connected part that every piece is of: a cycle, or the piece alone
    graph = coo_matrix((np.ones(len(behind)), (behind, before)), shape=(n, n))
    part = connected_components(graph, directed=True, connection="strong")[1]
    hides: list[list[int]] = [[] for _ in range(n)]
    waiting: list[dict[int, float]] = [{} for _ in range(n)]  # pieces of its cycle behind each, and how sure
    # of every part: how many verdicts from outside still keep it waiting, and its pieces, the farthest first
    outside = [0] * int(part.max() + 1)
    members: list[list[int]] = [[] for _ in outside]
    for k in np.argsort(depth).tolist():
        members[part[k]].append(k)
    for far, near, by in zip(behind, before, sure, strict=True):
        hides[far].append(near)
        if part[far] == part[near]:
            waiting[near][far] = by
        else:
            outside[part[near]] += 1
    # a cycle is painted as a whole once all behind it is: breaking it elsewhere would bring forward what it hides
    ready = [(float(depth[pieces[0]]), c) for c, pieces in enumerate(members) if outside[c] == 0]
    heapq.heapify(ready)
    order: list[int] = []
    while ready:
        c = heapq.heappop(ready)[1]
        left = members[c]
        while left:
            k = min(left, key=lambda piece: max(waiting[piece].values(), default=0.0))
            left.remove(k)
            order.append(k)
            for near in hides[k]:
                if part[near] == c:
                    waiting[near].pop(k, None)
                    continue
                outside[part[near]] -= 1
                if outside[part[near]] == 0:
                    heapq.heappush(ready, (float(depth[members[part[near]][0]]), int(part[near])))
    return order
