"""Convex bodies near each other: how deep they overlap, and where they touch along an edge or at a corner alone.

The common area of two faces is in ``facing``.

``start`` is the row of each solid's first face, and p and q are the two solids of every pair.
"""

from collections.abc import Sequence

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.facing import Faces, all_faces
from limitmason.geometry.polyhedron import Solid

LINE = 0.1
"""Part of the least width of a block above which common points lie along an edge, and not at a corner: chosen [-]."""

PARALLEL_EDGES = 1e-6
"""Sine of the angle between two edges below which they have no common normal [-]: rounding."""


def near_pairs(solids: Sequence[Solid], owner: Index, reach: Array) -> tuple[Index, Index]:
    """Pairs of solids of different owners whose boxes are near each other.

    They are near within the smaller reach of the two owners.

    Parameters
    ----------
    owner : of every solid, shape (solids,)
    reach : of every owner [m], shape (owners,)

    Returns
    -------
    p, q : numbers of the solids of every pair, p < q, shape (k,)
    """
    low = np.array([s.vertices.min(axis=0) for s in solids])
    high = np.array([s.vertices.max(axis=0) for s in solids])
    # boxes that are larger by half their reach touch where the mean of both reaches holds: the smaller is asked then
    half = 0.5 * reach[owner][:, None]
    p, q = overlapping_pairs(low - half, high + half)
    least = np.minimum(reach[owner[p]], reach[owner[q]])[:, None]
    keep = owner[p] != owner[q]
    keep &= ((low[p] <= high[q] + least) & (low[q] <= high[p] + least)).all(axis=1)
    return p[keep], q[keep]


def penetrations(
    solids: Sequence[Solid], owner: Index, faces: Faces, start: Index, p: Index, q: Index, tolerance: Array
) -> list[tuple[int, int, float]]:
    """Owners of convex pieces that overlap deeper than a tolerance, and how deep.

    The depth is the least overlap along normals of faces and across pairs of edges (separating axis theorem).

    Parameters
    ----------
    solids, owner : convex pieces and the block each belongs to
    faces, start : of all solids, from :func:`limitmason.geometry.facing.all_faces`
    p, q : pairs of solids to look at, shape (k,)
    tolerance : one per pair [m], shape (k,)

    Returns
    -------
    list of (owner, owner, depth [m]), in the order of the pairs
    """
    depth = _face_axes_depth(solids, faces, start, p, q)
    found = []
    # edges are looked at only where no face separates: there are many more pairs of them
    for k in np.flatnonzero(depth > tolerance).tolist():
        d = min(float(depth[k]), _edge_axes_depth(solids[p[k]], solids[q[k]]))
        if d > tolerance[k]:
            found.append((int(owner[p[k]]), int(owner[q[k]]), d))
    return found


def touching_edges(
    solids: Sequence[Solid], owner: Index, tolerance: Array, widths: Array, carried: set[tuple[int, int]]
) -> list[tuple[int, int, str, Array]]:
    """Owners that touch along a line or at a point only, where no force passes.

    Parameters
    ----------
    solids, owner : convex pieces and the block each belongs to
    tolerance : gap up to which they touch, per owner [m]
    widths : least width of every owner [m], of which the smaller one's ``LINE`` tells a line from a corner
    carried : pairs (a, b), a < b, that meet in a face and are left out

    Returns
    -------
    list of (a, b, "edge" or "corner", place [m], shape (3,)), a < b, one for each pair of owners
    """
    p, q = near_pairs(solids, owner, tolerance)
    faces, start = all_faces(solids)
    depth = _face_axes_depth(solids, faces, start, p, q)
    slack = np.minimum(tolerance[owner[p]], tolerance[owner[q]])
    found: dict[tuple[int, int], list[Array]] = {}
    for k in np.flatnonzero(depth >= -slack).tolist():
        pair = (int(min(owner[p[k]], owner[q[k]])), int(max(owner[p[k]], owner[q[k]])))
        if pair in carried or _edge_axes_depth(solids[p[k]], solids[q[k]]) < -slack[k]:
            continue
        points = _shared_points(solids, faces, start, int(p[k]), int(q[k]), 2.0 * float(slack[k]))
        if len(points):
            found.setdefault(pair, []).append(points)
    out = []
    for pair, rows in sorted(found.items()):
        points = np.concatenate(rows)
        reach = float(np.linalg.norm(np.ptp(points, axis=0)))
        line = reach > LINE * min(widths[pair[0]], widths[pair[1]])
        out.append((*pair, "edge" if line else "corner", points.mean(axis=0)))
    return out


def _shared_points(solids: Sequence[Solid], faces: Faces, start: Index, i: int, j: int, slack: float) -> Array:
    """Points common to two touching pieces, from the edges of each within the other.

    Parameters
    ----------
    solids : all pieces
    faces, start : of all pieces, from :func:`limitmason.geometry.facing.all_faces`
    i, j : the two pieces
    slack : distance up to which they touch [m]

    Returns
    -------
    both ends of every stretch of an edge inside the other piece [m], shape (p, 3); points may repeat
    """
    out = []
    for one, other in ((i, j), (j, i)):
        rows = slice(start[other], start[other + 1])
        normal, offset = faces.normal[rows], faces.offset[rows] + slack
        a, b = _edge_ends(solids[one])
        # the stretch of every edge inside all half-spaces, from s to t of its length; an edge along a plane, whose cut
        # is 0 / 0 or infinite, lies wholly on one side of it
        at, step = a @ normal.T - offset, (b - a) @ normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            cut = -at / step
        enters = np.where(step < 0.0, cut, np.where((step == 0.0) & (at > 0.0), np.inf, -np.inf)).max(axis=1)
        leaves = np.where(step > 0.0, cut, np.inf).min(axis=1)
        s, t = np.maximum(enters, 0.0), np.minimum(leaves, 1.0)
        inside = s <= t
        out += [a[inside] + u[inside, None] * (b - a)[inside] for u in (s, t)]
    return np.concatenate(out)


def _face_axes_depth(solids: Sequence[Solid], faces: Faces, start: Index, p: Index, q: Index) -> Array:
    """Least overlap of pairs of pieces along the normals of their faces [m], (m,).

    It is negative where a plane separates them.

    Parameters
    ----------
    solids, faces : all pieces, and the faces of all
    start : first face of every piece, shape (pieces + 1,)
    p, q : numbers of the pieces of every pair, shape (m,)
    """
    depth = np.full(len(p), np.inf)
    if not len(p):
        return depth
    count = np.array([len(s.vertices) for s in solids])
    # rows padded by repeating the last corner
    index = np.minimum(np.arange(count.max()), count[:, None] - 1) + (np.cumsum(count) - count)[:, None]
    corners = np.concatenate([s.vertices for s in solids])[index]
    for one, other in ((p, q), (q, p)):
        n_faces = start[one + 1] - start[one]
        for k in range(int(n_faces.max())):
            rows = np.flatnonzero(n_faces > k)
            face = start[one[rows]] + k
            inside = faces.offset[face][:, None] - np.einsum("mvi,mi->mv", corners[other[rows]], faces.normal[face])
            depth[rows] = np.minimum(depth[rows], inside.max(axis=1))
    return depth


def _edge_ends(solid: Solid) -> tuple[Array, Array]:
    """First and second end of every edge of a solid, once for each of its two faces [m], shape (e, 3) each."""
    sides = np.array([(f[k], f[(k + 1) % len(f)]) for f in solid.faces for k in range(len(f))])
    return solid.vertices[sides[:, 0]], solid.vertices[sides[:, 1]]


def _edge_axes_depth(a: Solid, b: Solid) -> float:
    """Least overlap of two solids along the cross products of their edges [m].

    It is infinite where all edges are parallel.
    """
    # vectors along the edges of both, made unit vectors
    one, other = (end - start for start, end in map(_edge_ends, (a, b)))
    one, other = (e / np.linalg.norm(e, axis=1)[:, None] for e in (one, other))
    axes = np.cross(one[:, None], other[None]).reshape(-1, 3)
    length = np.linalg.norm(axes, axis=1)
    crossed = length > PARALLEL_EDGES
    axes = axes[crossed] / length[crossed][:, None]
    if not len(axes):
        return np.inf
    u, v = a.vertices @ axes.T, b.vertices @ axes.T
    return float(np.minimum(u.max(axis=0) - v.min(axis=0), v.max(axis=0) - u.min(axis=0)).min())
