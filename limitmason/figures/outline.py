"""What of a block is drawn: outline in a plane, edges in space, no inner cuts.

``assembly`` is the structure; ``tolerance`` is the distance up to which places are one [m]; ``normals`` and ``offsets``
are those of the faces of every piece, shapes (f, 3) and (f,).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from limitmason.arrays import Array, Index
from limitmason.geometry import Solid
from limitmason.geometry.polyhedron import face_plane, faces_at_edges
from limitmason.mechanics.plane import Plane
from limitmason.mechanics.rigid_motion import free_or_all
from limitmason.model import Assembly, Block

_AROUND = 24  # places on a circle about an edge: a wedge of 15 degrees is seen

_FLAT = 1e-6
"""Sine of an angle that counts as none when the plane of a wall is looked for: rounding [-]."""

_IN_PLANE = 1e-3
"""Part of a mechanism across a plane up to which it is drawn in it, chosen: it cannot be seen [-]."""


class Edge(NamedTuple):
    """A visible edge of a convex piece: its ends [m] and the numbers of its faces."""

    start: Array
    end: Array
    faces: tuple[int, ...]


def wall_plane(assembly: Assembly, twists: Array | None = None) -> Plane | None:
    """The vertical plane of a single-leaf structure, or None when it needs 3-D.

    Every free block is then a prism across the plane, all at one depth, and the mechanism, if given, moves in it.

    Parameters
    ----------
    assembly : the structure; where all its blocks are fixed, all count as free
    twists : of a mechanism: velocities of the centroids and angular velocities, shape (n, 6)
    """
    x = assembly.arrays  # x.normal are the unit normals of all joints, shape (k, 3)
    free = free_or_all(assembly)
    candidates = [np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])]
    if len(x.normal):
        # normals of joints that span a plane, and no line, tell it alone: the axis across has no part of them, where
        # 1e-10 of a square is 1e-5 of a length; it must lie level
        value, vector = np.linalg.eigh(x.normal.T @ x.normal)
        if value[0] < 1e-10 * value[2] < value[1] and abs(vector[2, 0]) < _FLAT:
            candidates = [vector[:, 0]]
    # joints all of one direction do not tell the plane, the sides of a block do
    sides = [face_plane(face)[0] for face in assembly.blocks[free[0]].faces]
    candidates += [n for n in sides if abs(n[2]) < _FLAT]
    for p in candidates:  # unit normals of planes
        p = p * (1.0 if p[np.abs(p[:2]).argmax()] > 0 else -1.0)  # one of its two senses, always the same
        if np.abs(x.normal @ p).max(initial=0.0) > _FLAT or not _one_leaf(assembly, free, p):
            continue
        if twists is not None:
            # in the plane blocks neither shift along its normal p nor turn about anything else
            corners = np.vstack([assembly.blocks[i].vertices for i in free])
            # spins as what they displace over the structure: where blocks only slide, spins are all rounding. The
            # least size is not zero: a mechanism without motion lies in any plane
            spins = twists[:, 3:] * float(np.ptp(corners, axis=0).max())
            size = max(float(np.abs(twists[:, :3]).max(initial=0.0)), float(np.abs(spins).max(initial=0.0)), 1e-300)
            turning = spins - (spins @ p)[:, None] * p
            across = np.abs(twists[:, :3] @ p).max(initial=0.0)
            if max(across, np.abs(turning).max(initial=0.0)) > _IN_PLANE * size:
                continue
        return elevation_plane(p)
    return None


def elevation_plane(normal: Array) -> Plane:
    """Plane looked at along a horizontal normal, from the side of -normal.

    The horizontal axis points right, z up.
    """
    p = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    z = np.array([0.0, 0.0, 1.0])
    return Plane(axis_1=np.cross(p, z), axis_2=z, normal=p, level=0.0)


def _one_leaf(assembly: Assembly, rows: Index, p: Array) -> bool:
    """Whether blocks ``rows``, by number, are prisms across the plane, at one depth.

    ``p`` is its unit normal, shape (3,).
    """
    low, high, off = [], [], []
    for i in rows:
        h = assembly.blocks[i].vertices @ p
        low.append(h.min())
        high.append(h.max())
        off.append(np.minimum(h - h.min(), h.max() - h).max())  # of a prism every corner lies in front or behind
    slack = 10.0 * assembly.tolerance + 1e-9  # chosen: well above what contacts may be off [m]
    middle = 0.5 * (np.array(low) + np.array(high))
    return bool(max(off) <= slack and np.abs(middle - np.median(middle)).max() <= slack)


def elevation_loops(block: Block, plane: Plane, tolerance: float) -> list[Array]:
    """Closed outline of a block in elevation, points of it [m], list of (k, 3).

    Edges that two convex pieces share are left out, so a concave block shows one outline.

    Parameters
    ----------
    block, plane : what is drawn, and the plane of the drawing
    tolerance : distance on the page up to which corners are one [m]
    """
    rings = [_front(part, plane) for part in block.parts]
    if len(rings) == 1:
        return rings
    axes = np.column_stack([plane.axis_1, plane.axis_2])
    points = np.concatenate(rings)
    flat = points @ axes
    label = _labels(flat, max(tolerance, 1e-12))
    starts = np.concatenate([[0], np.cumsum([len(r) for r in rings])])
    # how often each directed edge occurs: two pieces pass a shared edge in opposite directions, which cancel
    directed: dict[tuple[int, int], int] = {}
    for a, b in pairwise(starts.tolist()):
        for i in range(a, b):
            j = i + 1 if i + 1 < b else a
            chain = _through(flat, label, i, j, tolerance)
            for u, v in pairwise(chain):
                if directed.get((v, u), 0):
                    directed[v, u] -= 1
                else:
                    directed[u, v] = directed.get((u, v), 0) + 1
    return [points[loop] for loop in _chained(directed)]  # a label is the number of its first point


def _front(part: Solid, plane: Plane) -> Array:
    """Corners of the silhouette of ``part`` [m], counter-clockwise, shape (n, 3).

    The viewer is at -normal of ``plane``: the least depth is in front. A face in front keeps corners within a straight
    side, where neighbours end; a hull drops them.
    """
    v = part.vertices
    depth = v @ plane.normal
    slack = 1e-9 * max(float(np.ptp(v, axis=0).max()), 1e-300)  # of depths that are one but for rounding [m]
    axes = np.column_stack([plane.axis_1, plane.axis_2])
    flat = v @ axes
    for face in part.faces:
        rows = list(face)
        # of a prism seen along its length the face in front has all corners of the silhouette, in order
        if 2 * len(rows) == len(v) and (depth[rows] <= depth.min() + slack).all():
            others = np.setdiff1d(np.arange(len(v)), rows)
            # each corner behind lies on the page at one in front, to a millionth of the piece (chosen): it is seen
            # along its length
            reach = np.linalg.norm(flat[others][:, None] - flat[rows][None], axis=2).min(axis=1)
            if (reach <= 1e-6 * max(float(np.ptp(flat, axis=0).max()), 1e-300)).all():
                return v[rows]
    return v[ConvexHull(flat).vertices]  # of anything else the corners on the page


def _labels(flat: Array, tolerance: float) -> Index:
    """For every point of ``flat`` [m], (n, 2), the first one within ``tolerance`` [m]."""
    label = np.full(len(flat), -1, dtype=np.intp)
    for i in range(len(flat)):
        if label[i] < 0:
            near = (np.abs(flat - flat[i]).max(axis=1) <= tolerance) & (label < 0)
            label[near] = i
    return label


def _through(flat: Array, label: Index, i: int, j: int, tolerance: float) -> list[int]:
    """Labels along the edge i-j: its ends and vertices of other pieces on it.

    Parameters
    ----------
    flat, label : points on the page [m], shape (n, 2), and their numbers by :func:`_labels`, shape (n,)
    i, j : rows of the two ends
    tolerance : distance from the edge up to which a point lies on it [m]
    """
    edge = flat[j] - flat[i]
    length = np.linalg.norm(edge)
    if label[i] == label[j] or length <= tolerance:  # both ends are one place
        return [int(label[i])]
    # of every point: its place along the edge and its distance from it [m]
    arm = flat - flat[i]
    s = arm @ edge / length
    off = np.abs(arm[:, 0] * edge[1] - arm[:, 1] * edge[0]) / length
    between = np.flatnonzero((off <= tolerance) & (s > tolerance) & (s < length - tolerance))
    chain = [int(label[i])]
    for k in between[np.argsort(s[between], kind="stable")]:
        if label[k] != chain[-1]:
            chain.append(int(label[k]))
    return [*chain, int(label[j])]


def _chained(directed: dict[tuple[int, int], int]) -> list[list[int]]:
    """Closed loops of vertices, by number, along the directed edges that are left.

    ``directed`` has how often each edge is left, by its two ends; those at zero have cancelled.
    """
    after: dict[int, list[int]] = {}
    for (u, v), times in directed.items():
        if times:
            after.setdefault(u, []).append(v)
    loops = []
    while after:
        start = next(iter(after))
        loop, here = [], start
        while here in after:
            loop.append(here)
            following = after[here].pop()
            if not after[here]:
                del after[here]
            here = following
            if here == start:
                break
        if len(loop) > 2:  # there and back encloses nothing
            loops.append(loop)
    return loops


def visible_edges(parts: Sequence[Solid], tolerance: float) -> list[list[Edge]]:
    """For every convex piece of a block, those of its edges that are the block's.

    An edge of a piece is cut where faces of other pieces cross it; a stretch is dropped when the block is flat or solid
    all around it, which a small circle of points about its middle tells.

    Parameters
    ----------
    parts : the pieces; the only piece of a convex block keeps all its edges
    tolerance : distance up to which places are one [m]
    """
    # normal and offset of every face of every piece
    planes = [[face_plane(part.vertices[list(f)]) for f in part.faces] for part in parts]
    normals, offsets = ([np.array([plane[k] for plane in p]) for p in planes] for k in (0, 1))
    out: list[list[Edge]] = []
    for k, part in enumerate(parts):
        edges = []
        for (i, j), touching in faces_at_edges(part.faces).items():
            a, b = part.vertices[i], part.vertices[j]
            if len(parts) == 1:
                edges.append(Edge(a, b, tuple(touching)))
                continue
            for s, t in _stretches(a, b, k, normals, offsets, tolerance):
                if _is_edge(a + 0.5 * (s + t) * (b - a), b - a, normals, offsets, tolerance):
                    edges.append(Edge(a + s * (b - a), a + t * (b - a), tuple(touching)))
        out.append(edges)
    return out


def _stretches(
    a: Array, b: Array, own: int, normals: list[Array], offsets: list[Array], tolerance: float
) -> list[tuple[float, float]]:
    """Parts of an edge between crossing faces of other pieces, by start and end [-].

    Start and end are shares of the edge's length from ``a``. Parts shorter than twice the tolerance are left out: what
    is about their middle cannot be told.

    Parameters
    ----------
    a, b : ends of the edge [m], shape (3,)
    own : number of the piece that it is of
    normals, offsets : planes of the faces of every piece, shapes (f, 3) and (f,) [m]
    tolerance : distance up to which places are one [m]
    """
    length = float(np.linalg.norm(b - a))
    cuts = [0.0, 1.0]
    for k, (n, o) in enumerate(zip(normals, offsets, strict=True)):
        if k == own:
            continue
        da, db = n @ a - o, n @ b - o  # signed distances of both ends from the faces [m]
        crossing = (da * db < 0.0) & (np.abs(da - db) > tolerance)
        cuts.extend((da[crossing] / (da[crossing] - db[crossing])).tolist())
    cuts.sort()
    return [(s, t) for s, t in pairwise(cuts) if (t - s) * length > 2.0 * tolerance]


def _is_edge(middle: Array, along: Array, normals: list[Array], offsets: list[Array], tolerance: float) -> bool:
    """Whether a block has an edge at a place, by points on a circle around it.

    Where all points lie inside the block it is solid, and where half of them do in a row it is flat. Else it has an
    edge.

    Parameters
    ----------
    middle, along : place on the edge and vector along it [m], shape (3,)
    normals, offsets : planes of the faces of every piece, shapes (f, 3) and (f,) [m]
    tolerance : gap between pieces of the block that is none [m]
    """
    # v, w: unit vectors across the edge, from x, or from y where the edge lies within 45 degrees of x
    u = along / np.linalg.norm(along)
    v = np.cross(u, (1.0, 0.0, 0.0) if abs(u[0]) < 0.7 else (0.0, 1.0, 0.0))
    v /= np.linalg.norm(v)
    w = np.cross(u, v)
    angle = (np.arange(_AROUND) + 0.37) * 2.0 * np.pi / _AROUND  # 0.37 of a step aside: none on a brick's face
    # a circle around the edge, far from it beside the tolerance: all inside is solid, half of it is a flat face
    circle = middle + 20.0 * tolerance * (np.cos(angle)[:, None] * v + np.sin(angle)[:, None] * w)
    inside = np.zeros(_AROUND, dtype=bool)
    for n, o in zip(normals, offsets, strict=True):
        # pieces may leave a gap of the contact tolerance between them; it is no edge
        inside |= (circle @ n.T - o <= tolerance).all(axis=1)
    count = int(inside.sum())
    turns = int((inside != np.roll(inside, 1)).sum())
    # a face off by a tolerance moves one point across
    flat = turns == 2 and abs(count - _AROUND // 2) <= 1
    return not (flat or count == _AROUND)
