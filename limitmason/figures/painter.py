"""Hidden surfaces without a depth buffer: convex pieces sorted so that none is painted over by one behind it.

Sorting faces by mean depth, as ``mpl_toolkits.mplot3d`` does, puts a long ground slab in front of the blocks on it.
Two convex pieces that do not overlap are separated by a plane, and the plane tells which of them can hide the other:
the order is then exact, and the drawing stays a vector drawing.

``solids`` are convex pieces where they are drawn.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from limitmason.arrays import Array, Flags, Index
from limitmason.errors import InputError
from limitmason.geometry import Solid
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.polyhedron import face_planes, group_by_topology


class Camera(NamedTuple):
    """Parallel projection: unit vectors to the right and up on the page, and towards the viewer."""

    right: Array
    up: Array
    towards: Array

    def project(self, points: Array) -> Array:
        """Page coordinates [m], shape (n, 2)."""
        return np.asarray(points) @ np.column_stack([self.right, self.up])


VIEWPOINT_DEG = (-58.0, 22.0)
"""Azimuth and elevation of the viewer where none are given [deg]."""


def camera(azimuth_deg: float, elevation_deg: float) -> Camera:
    """Camera that looks at the origin from ``azimuth_deg``, counted from x towards y, and ``elevation_deg``."""
    if not -90.0 < elevation_deg < 90.0:
        raise InputError(f"elevation_deg must be between -90 and 90, got {elevation_deg!r}")
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return Camera(right, np.cross(towards, right), towards)


class FacePlanes(NamedTuple):
    """Face planes of every piece, padded: outward normals (p, f, 3), offsets (p, f) [m], NaN beyond the count."""

    normal: Array
    offset: Array


def piece_faces(solids: Sequence[Solid]) -> FacePlanes:
    """Planes of the faces of convex pieces."""
    widest = max(len(s.faces) for s in solids)
    normal, offset = np.full((len(solids), widest, 3), np.nan), np.full((len(solids), widest), np.nan)
    for faces, members, vertices in group_by_topology(solids):
        for k, face in enumerate(faces):
            normal[members, k], offset[members, k] = face_planes(vertices[:, list(face)])
    return FacePlanes(normal, offset)


def back_to_front(solids: Sequence[Solid], faces: FacePlanes, view: Camera) -> list[int]:
    """Order in which to paint convex pieces.

    Pieces in contact may overlap slightly (finite rotations do that): the plane of least overlap then decides, the
    surer the more the least overlap with the other verdict exceeds it. A cycle, in which each piece hides part of the
    next, has no valid order: the least sure of its verdicts is given up, and nothing outside is painted out of turn.
    """
    i, j, front, _, sure = _hiding(solids, faces, view)
    depth = np.array([s.vertices.mean(axis=0) @ view.towards for s in solids])
    hides = front != 0
    behind = np.where(front > 0, i, j)[hides]
    before = np.where(front > 0, j, i)[hides]
    return _sorted_by_depth(len(solids), behind.tolist(), before.tolist(), depth, sure[hides].tolist())


def places_behind(order: list[int], solids: Sequence[Solid], others: Sequence[Solid], view: Camera) -> list[int]:
    """Where in the order to paint other pieces, which may overlap the sorted ones.

    They come before all pieces that can hide them. Of two pieces that occupy the same space the sorted one hides the
    other.

    Parameters
    ----------
    order : of ``solids``, from :func:`back_to_front`
    others : pieces to put in between

    Returns
    -------
    position in ``order`` before which each of ``others`` is painted
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


def _hiding(solids: Sequence[Solid], faces: FacePlanes, view: Camera) -> tuple[Index, Index, Index, Flags, Array]:
    """Which of two pieces that are near each other on the page hides the other.

    Returns
    -------
    Numbers i < j of the pairs; +1 where j may hide i, -1 where i may hide j, 0 where neither can; whether they
    overlap in space; and how sure that is [m].
    """
    page = [view.project(s.vertices) for s in solids]
    low = np.array([[*p.min(axis=0), 0.0] for p in page])
    high = np.array([[*p.max(axis=0), 0.0] for p in page])
    i, j = overlapping_pairs(low, high)
    widest = max(len(s.vertices) for s in solids)
    # padded by the first corner: extremes stay the same
    corners = np.array([s.vertices[[*range(len(s.vertices)), *[0] * (widest - len(s.vertices))]] for s in solids])
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    front, overlap, sure = np.zeros(len(i), dtype=np.intp), np.zeros(len(i), dtype=bool), np.zeros(len(i))
    # 20,000 pairs at a time: memory stays bounded
    for first in range(0, len(i), 20000):
        rows = slice(first, first + 20000)
        found = _which_in_front(i[rows], j[rows], corners, faces, view.towards, size)
        front[rows], overlap[rows], sure[rows] = found
    return i, j, front, overlap, sure


def _which_in_front(
    i: Index, j: Index, corners: Array, faces: FacePlanes, towards: Array, size: float
) -> tuple[Index, Flags, Array]:
    """+1 where piece j may hide piece i, -1 where i may hide j, 0 where neither can.

    The second value says whether the two overlap, the third how much farther they overlap by the other verdict [m].

    Parameters
    ----------
    i, j : pieces of every pair
    corners : of all pieces, padded [m], shape (n, v, 3)
    towards : unit vector to the viewer
    size : extent of all pieces [m]
    """
    # gaps along every face normal of i, then of j, and how these look at the viewer
    gap_i = np.einsum("mfk,mvk->mfv", faces.normal[i], corners[j]).min(axis=2) - faces.offset[i]
    gap_j = np.einsum("mfk,mvk->mfv", faces.normal[j], corners[i]).min(axis=2) - faces.offset[j]
    gap = np.concatenate([gap_i, gap_j], axis=1)
    slope = np.concatenate([faces.normal[i] @ towards, -(faces.normal[j] @ towards)], axis=1)
    gap = np.where(np.isnan(gap), -np.inf, gap)
    apart = gap >= -1e-9 * size
    edge_on = np.abs(slope) < 1e-9
    ahead = (apart & (slope > 0.0)).any(axis=1)
    back = (apart & (slope < 0.0)).any(axis=1)
    verdict = np.where(ahead & ~back, 1, np.where(back & ~ahead, -1, 0))
    # without a plane between both, the plane of least overlap decides
    best = gap.argmax(axis=1)
    touching = np.asarray(~apart.any(axis=1))
    verdict = np.where(touching, np.sign(slope[np.arange(len(i)), best]).astype(int), verdict)
    widest = [np.where(slope * side > 0.0, gap, -size).max(axis=1) for side in (1.0, -1.0)]
    return np.where((apart & edge_on).any(axis=1), 0, verdict), touching, np.abs(widest[0] - widest[1])


def _sorted_by_depth(
    n: int, behind: list[int], before: list[int], depth: Array, sure: Sequence[float]
) -> list[int]:
    """Order in which to paint pieces: each after those behind it, the farthest first.

    In a cycle the piece goes first that hides the others by the least certain verdict.

    Parameters
    ----------
    behind, before : pairs of pieces of which the second hides the first
    depth : of every piece towards the viewer
    sure : how certain each pair is [m]
    n : number of pieces
    """
    graph = coo_matrix((np.ones(len(behind)), (behind, before)), shape=(n, n))
    cycle = connected_components(graph, directed=True, connection="strong")[1]
    hides: list[list[int]] = [[] for _ in range(n)]
    waiting: list[dict[int, float]] = [{} for _ in range(n)]
    outside = [0] * int(cycle.max() + 1)
    members: list[list[int]] = [[] for _ in outside]
    for k in np.argsort(depth).tolist():
        members[cycle[k]].append(k)
    for far, near, by in zip(behind, before, sure, strict=True):
        hides[far].append(near)
        if cycle[far] == cycle[near]:
            waiting[near][far] = by
        else:
            outside[cycle[near]] += 1
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
                if cycle[near] == c:
                    waiting[near].pop(k, None)
                    continue
                outside[cycle[near]] -= 1
                if outside[cycle[near]] == 0:
                    heapq.heappush(ready, (float(depth[members[cycle[near]][0]]), int(cycle[near])))
    return order
