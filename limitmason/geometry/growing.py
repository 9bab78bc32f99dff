"""Stones grown to meet: convex solids with gaps between, cut and filled to the planes half-way to their neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from limitmason.arrays import Array
from limitmason.checks import positive
from limitmason.errors import InputError
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.convex_set import OUTWEIGHS
from limitmason.geometry.polyhedron import Solid, face_plane, mass_properties
from limitmason.geometry.splitting import below_planes

_FACING = 0.34
"""Cosine of 70 degrees: a face is moved where a neighbour lies within this of its normal, chosen."""

_ALIKE = np.cos(np.deg2rad(10.0))
"""Cosine of 10 degrees: facets of a scan whose normals differ by less are one face, chosen."""

_APART = 1e-9
"""Distance of two hulls over their size above which they are apart, so that it has a direction [-]: rounding."""

_SLACK = 1e-9
"""Part of a stone's size within which corners lie in a plane [-]: rounding."""


class Gap(NamedTuple):
    """Plane that parts two stones."""

    i: int  # numbers of the stones
    j: int
    normal: Array  # unit, from i to j, (3,)
    offset: float  # n . x of its points [m]
    gap: float  # between the stones along the normal, negative where they overlap [m]


class Grown(NamedTuple):
    """Stones that meet."""

    solids: list[Solid]
    gaps: tuple[Gap, ...]  # planes that they meet in
    before: Array  # volume of each stone as it was [m3], (n,)
    after: Array  # and as it is [m3], (n,)
    moved: Array  # how far a corner now lies outside its stone's old faces at most [m], (n,)


def grown(
    stones: Sequence[Array], reach: float, against: Sequence[Solid] = (), names: Sequence[str] | None = None
) -> Grown:
    """Grow convex stones until they meet half-way, and cut them where they overlap.

    Each pair nearer than twice the reach is parted by a plane: across the shortest distance between them, in its
    middle; where they overlap, that of least overlap among their faces. A stone is what lies on its side of all its
    planes, of its own faces moved out by the reach where they look at a neighbour within the reach (within 70 degrees
    of the plane's normal), and of its other faces as they are.

    Parameters
    ----------
    stones : points of each [m], shape (n, 3); their convex hull is the stone
    reach : largest gap that is closed [m]
    against : convex solids that keep their shape, such as the ground: stones grow to the nearest face of theirs; in the
        gaps they are numbered after the stones
    names : of the stones, for errors; their numbers by default

    Returns
    -------
    Grown
        Meeting faces lie in one plane, so that contact detection finds them; ``gaps`` keeps what was between.

    Raises
    ------
    InputError
        A stone without volume, or one that its neighbours leave nothing of, by name.
    """
    positive("reach", reach, "m")
    own = [_planes(np.asarray(s, dtype=float)) for s in stones]  # normals and offsets of each stone's faces
    solids = [_inside(n, d, np.asarray(s, dtype=float)) for (n, d), s in zip(own, stones, strict=True)]
    every = [*solids, *against]
    low = np.array([s.vertices.min(axis=0) for s in every]) - reach
    high = np.array([s.vertices.max(axis=0) for s in every]) + reach
    pairs = zip(*overlapping_pairs(low, high), strict=True)
    gaps = [_between(int(i), int(j), every, held=j >= len(solids)) for i, j in pairs if min(i, j) < len(solids)]
    # both stones may move by the reach: planes farther than that from either cut nothing off
    gaps = [g for g in gaps if g.gap <= 2.0 * reach]
    out, moved = [], np.zeros(len(solids))
    for k, (normal, offset) in enumerate(own):
        # planes to the neighbours, their normals pointing away from this stone
        towards = [(g.normal if g.i == k else -g.normal, g) for g in gaps if k in (g.i, g.j)]
        facing = np.zeros(len(normal), dtype=bool)  # its faces that look at a neighbour within the reach
        for direction, g in towards:
            facing |= (normal @ direction > _FACING) & (g.gap <= reach)
        wide = offset + reach * facing
        cuts = [(direction, g.offset if g.i == k else -g.offset) for direction, g in towards]
        normals = np.array([*normal, *(c[0] for c in cuts)])
        offsets = np.array([*wide, *(c[1] for c in cuts)])
        try:
            solid = _inside(normals, offsets, solids[k].vertices, margin=2.0 * reach)
        except InputError:
            name = f"stone {k}" if names is None else names[k]
            raise InputError(f"{name}: its neighbours leave nothing of it; they overlap, or it is doubled") from None
        out.append(solid)
        moved[k] = max(0.0, float((solid.vertices @ normal.T - offset).max()))
    volumes = [mass_properties(s).volume for s in (solids, out)]
    return Grown(
        solids=out, gaps=tuple(g for g in gaps if g.gap <= reach), before=volumes[0], after=volumes[1], moved=moved,
    )


def _planes(points: Array) -> tuple[Array, Array]:
    """Planes of the faces of a hull, large facets first, those nearly alike made one.

    Parameters
    ----------
    points : [m], shape (n, 3)

    Returns
    -------
    normals : unit vectors, shape (k, 3)
    offsets : [m], shape (k,)
    """
    try:
        hull = ConvexHull(points)
    except Exception:  # scipy's own error tells of its options, not of stones
        raise InputError("a stone has no volume: its points lie in one plane, or are fewer than four") from None
    corners = points[hull.simplices]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # facets that triangulate one face count together: the plane of a large flat side leads
    keys = np.round(hull.equations[:, :3], 6)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    total = np.bincount(group.ravel(), weights=area)[group.ravel()]
    kept: list[Array] = []
    for k in np.argsort(-total, kind="stable"):
        n = hull.equations[k, :3]
        if all(n @ other < _ALIKE for other in kept):
            kept.append(n)
    normals = np.array(kept)
    return normals, (points @ normals.T).max(axis=0)


def _inside(normals: Array, offsets: Array, points: Array, margin: float = 0.0) -> Solid:
    """What lies below all planes, within a box around some points.

    The box is larger than the points by their size and a margin.

    Parameters
    ----------
    normals : unit vectors of the planes, shape (k, 3)
    offsets : n . x of their points [m], shape (k,)
    points : [m], shape (n, 3)
    margin : by which the box is larger still [m]
    """
    slack = _SLACK * float(np.ptp(points, axis=0).max())
    solid = below_planes(zip(normals, offsets, strict=True), points, slack, margin=margin)
    if solid is None:
        raise InputError("nothing lies below all planes")
    return solid


def _between(i: int, j: int, solids: Sequence[Solid], *, held: bool) -> Gap:
    """The plane that parts two convex solids, across the widest gap between them.

    Where the second is ``held`` it is the plane of one of its faces, since that solid keeps its shape.

    Parameters
    ----------
    i, j : numbers of the solids
    solids : all of them
    held : whether the second keeps its shape
    """
    a, b = solids[i].vertices, solids[j].vertices
    if held:
        # normals of its faces turned inwards, that is from i to j: the face that leaves most room between both
        faces = -np.array([face_plane(b[list(f)])[0] for f in solids[j].faces])
        clear = (b @ faces.T).min(axis=0) - (a @ faces.T).max(axis=0)
        n = faces[int(clear.argmax())]
        return Gap(i, j, n, float((b @ n).min()), float(clear.max()))
    middle, size = a.mean(axis=0), float(np.ptp(np.vstack([a, b]), axis=0).max())
    p, q = (a - middle) / size, (b - middle) / size
    # closest points of two hulls: |P s - Q t| smallest, shares s and t above zero and of sum one (weighted rows)
    system = np.zeros((5, len(p) + len(q)))
    system[:3, : len(p)], system[:3, len(p) :] = p.T, -q.T
    system[3, : len(p)], system[4, len(p) :] = OUTWEIGHS, OUTWEIGHS
    shares, distance = nnls(system, np.array([0.0, 0.0, 0.0, OUTWEIGHS, OUTWEIGHS]))
    # normals of both solids' faces, all from i to j, and the direction of the shortest distance
    candidates = [
        sign * face_plane(s.vertices[list(f)])[0]
        for s, sign in ((solids[i], 1.0), (solids[j], -1.0))
        for f in s.faces
    ]
    if distance > _APART:
        apart = q.T @ shares[len(p) :] - p.T @ shares[: len(p)]
        candidates.append(apart / np.linalg.norm(apart))
    normals = np.array(candidates)
    clear = (b @ normals.T).min(axis=0) - (a @ normals.T).max(axis=0)
    best = int(clear.argmax())
    n = normals[best]
    return Gap(i, j, n, 0.5 * float((b @ n).min() + (a @ n).max()), float(clear[best]))
