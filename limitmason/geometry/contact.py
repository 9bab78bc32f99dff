"""Contacts between polyhedra: plane patches where two faces of different blocks meet, and blocks that overlap."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.clipping import area_perimeter, clip_convex_batch, drop_redundant_vertices
from limitmason.geometry.polyhedron import Solid, face_planes, group_by_topology

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_FACING = -np.cos(np.deg2rad(10.0))
"""Faces whose normals are further than this from opposite are not looked at; the gap decides among the rest."""


class ContactPatches(NamedTuple):
    """Patches found: owners a < b, convex polygon [m] (n, 3) each, unit normal from a to b, and overlapping pairs."""

    a: Index
    b: Index
    polygons: list[Array]
    normals: Array
    overlaps: list[tuple[int, int, float]]


class _Faces(NamedTuple):
    corners: Array  # (F, K, 3), padded by repeating the last corner
    corners_of: Index
    normal: Array
    offset: Array
    part: Index


def find_contacts(
    solids: Sequence[Solid], owner: Index, tolerance: float, skip: NDArray[np.bool_] | None = None
) -> ContactPatches:
    """Plane patches where faces of different owners meet, with gaps or overlaps up to a tolerance.

    Parameters
    ----------
    solids : convex pieces, faces counter-clockwise from outside
    owner : block each piece belongs to, shape (n_solids,); pieces of one block do not touch each other
    tolerance : largest gap or overlap between two faces in contact; a patch must also be wider than this [m]
    skip : blocks between which no contact is wanted (both marked), shape (n_blocks,)

    Returns
    -------
    ContactPatches
        ``overlaps`` lists (block, block, depth [m]) where convex pieces penetrate deeper than the tolerance.

    Notes
    -----
    Edge-to-edge and corner-to-face touching without an area carries no interface and is not reported.
    """
    low = np.array([s.vertices.min(axis=0) for s in solids]) - 0.5 * tolerance
    high = np.array([s.vertices.max(axis=0) for s in solids]) + 0.5 * tolerance
    p, q = overlapping_pairs(low, high)
    keep = owner[p] != owner[q]
    if skip is not None:
        keep &= ~(skip[owner[p]] & skip[owner[q]])
    p, q = p[keep], q[keep]
    faces, start = _all_faces(solids)
    overlaps = _overlaps(solids, owner, faces, start, p, q, tolerance)

    f, g = _face_pairs(faces, start, p, q, tolerance)
    nothing = ContactPatches(np.empty(0, np.intp), np.empty(0, np.intp), [], np.empty((0, 3)), overlaps)
    if not len(f):
        return nothing
    # lower block number first, so that the normal runs from a to b
    swap = owner[faces.part[f]] > owner[faces.part[g]]
    f, g = np.where(swap, g, f), np.where(swap, f, g)
    normal = faces.normal[f] - faces.normal[g]
    normal /= np.linalg.norm(normal, axis=1)[:, None]

    first = faces.corners[f]
    edge = first[:, 1] - first[:, 0]
    t1 = edge - (edge * normal).sum(axis=1)[:, None] * normal
    t1 /= np.linalg.norm(t1, axis=1)[:, None]
    t2 = np.cross(normal, t1)
    origin = first[:, 0]
    frame = np.stack([t1, t2], axis=2)
    subject = (first - origin[:, None]) @ frame
    # the partner's outward normal is opposite: its corners run clockwise here, reversal makes them counter-clockwise
    window = ((faces.corners[g] - origin[:, None]) @ frame)[:, ::-1]
    window = _left_packed(window, faces.corners_of[g])
    clipped, count = clip_convex_batch(subject, faces.corners_of[f], window, faces.corners_of[g])
    clipped, count = drop_redundant_vertices(clipped, count, 1e-3 * tolerance)
    area, perimeter = area_perimeter(clipped)
    wide = (count >= 3) & (2.0 * area > tolerance * perimeter)

    # clipped corners lie in the plane through `origin` normal to the mean normal: place them midway between both faces
    points = origin[:, None] + clipped @ np.swapaxes(frame, 1, 2)
    to_f = faces.offset[f][:, None] - np.einsum("mki,mi->mk", points, faces.normal[f])
    to_g = np.einsum("mki,mi->mk", points, faces.normal[g]) - faces.offset[g][:, None]
    wide &= np.abs(to_g - to_f).max(axis=1) <= tolerance
    points += (0.5 * (to_f + to_g))[..., None] * normal[:, None, :]

    if not wide.any():
        return nothing
    a, b = owner[faces.part[f[wide]]], owner[faces.part[g[wide]]]
    polygons = [poly[:k] for poly, k in zip(points[wide], count[wide], strict=True)]
    return _merge_patches(a, b, polygons, normal[wide], area[wide], tolerance, overlaps)


def _all_faces(solids: Sequence[Solid]) -> tuple[_Faces, Index]:
    widest = max(len(f) for s in {s.faces: s for s in solids}.values() for f in s.faces)
    n_faces = np.array([len(s.faces) for s in solids])
    start = np.concatenate([[0], np.cumsum(n_faces)])
    total = start[-1]
    corners, count = np.empty((total, widest, 3)), np.empty(total, np.intp)
    normal, offset = np.empty((total, 3)), np.empty(total)
    for faces, members, vertices in group_by_topology(solids):
        for k, face in enumerate(faces):
            rows = start[members] + k
            padded = [*face, *[face[-1]] * (widest - len(face))]
            corners[rows] = vertices[:, padded]
            count[rows] = len(face)
            normal[rows], offset[rows] = face_planes(vertices[:, list(face)])
    return _Faces(corners, count, normal, offset, np.repeat(np.arange(len(solids)), n_faces)), start


def _face_pairs(faces: _Faces, start: Index, p: Index, q: Index, tolerance: float) -> tuple[Index, Index]:
    n_p, n_q = start[p + 1] - start[p], start[q + 1] - start[q]
    pair = np.repeat(np.arange(len(p)), n_p * n_q)
    local = np.arange(len(pair)) - np.repeat(np.cumsum(n_p * n_q) - n_p * n_q, n_p * n_q)
    f = start[p[pair]] + local // n_q[pair]
    g = start[q[pair]] + local % n_q[pair]
    facing = np.einsum("mi,mi->m", faces.normal[f], faces.normal[g]) < _FACING
    f, g = f[facing], g[facing]
    low, high = faces.corners.min(axis=1), faces.corners.max(axis=1)
    near = (low[f] <= high[g] + tolerance).all(axis=1) & (low[g] <= high[f] + tolerance).all(axis=1)
    return f[near], g[near]


def _left_packed(reversed_corners: Array, count: Index) -> Array:
    """Corners of reversed padded rows moved to the left: the padding came first after the reversal."""
    k = reversed_corners.shape[1]
    index = np.minimum(np.arange(k)[None, :] + (k - count)[:, None], k - 1)
    return np.take_along_axis(reversed_corners, index[..., None], axis=1)


def _overlaps(
    solids: Sequence[Solid], owner: Index, faces: _Faces, start: Index, p: Index, q: Index, tolerance: float
) -> list[tuple[int, int, float]]:
    """Pairs of convex pieces that no plane separates (separating axis theorem), with their penetration depth."""
    if not len(p):
        return []
    widest = max(len(s.vertices) for s in solids)
    corners = np.stack(
        [np.concatenate([s.vertices, np.repeat(s.vertices[-1:], widest - len(s.vertices), axis=0)]) for s in solids]
    )
    depth = np.full(len(p), np.inf)
    for one, other in ((p, q), (q, p)):
        n_faces = start[one + 1] - start[one]
        for k in range(int(n_faces.max())):
            rows = np.flatnonzero(n_faces > k)
            face = start[one[rows]] + k
            inside = faces.offset[face][:, None] - np.einsum("mvi,mi->mv", corners[other[rows]], faces.normal[face])
            depth[rows] = np.minimum(depth[rows], inside.max(axis=1))
    found = []
    for k in np.flatnonzero(depth > tolerance).tolist():
        d = min(float(depth[k]), _edge_axes_depth(solids[p[k]], solids[q[k]]))
        if d > tolerance:
            found.append((int(owner[p[k]]), int(owner[q[k]]), d))
    return found


def _edge_axes_depth(a: Solid, b: Solid) -> float:
    def edges(s: Solid) -> Array:
        e = np.array([s.vertices[f[(k + 1) % len(f)]] - s.vertices[f[k]] for f in s.faces for k in range(len(f))])
        return e / np.linalg.norm(e, axis=1)[:, None]

    axes = np.cross(edges(a)[:, None], edges(b)[None]).reshape(-1, 3)
    length = np.linalg.norm(axes, axis=1)
    axes = axes[length > 1e-6] / length[length > 1e-6][:, None]
    if not len(axes):
        return np.inf
    u, v = a.vertices @ axes.T, b.vertices @ axes.T
    return float(np.minimum(u.max(axis=0) - v.min(axis=0), v.max(axis=0) - u.min(axis=0)).min())


def _merge_patches(
    a: Index, b: Index, polygons: list[Array], normals: Array, areas: Array, tolerance: float, overlaps: list
) -> ContactPatches:
    """Join coplanar patches of one block pair when together they fill their convex hull (faces cut into triangles)."""
    order = np.lexsort((b, a))
    a, b, normals, areas = a[order], b[order], normals[order], areas[order]
    polygons = [polygons[i] for i in order]
    new_pair = np.r_[True, (np.diff(a) != 0) | (np.diff(b) != 0)]
    first = np.flatnonzero(new_pair)
    last = np.r_[first[1:], len(a)]
    drop: set[int] = set()
    for i, j in zip(first.tolist(), last.tolist(), strict=True):
        if j - i < 2:
            continue
        group = list(range(i, j))
        merged = True
        while merged and len(group) > 1:
            merged = False
            for x in range(len(group)):
                for y in range(x + 1, len(group)):
                    u, v = group[x], group[y]
                    joined = _hull_if_filled(
                        polygons[u], polygons[v], normals[u], normals[v], areas[u] + areas[v], tolerance
                    )
                    if joined is not None:
                        polygons[u] = joined
                        areas[u] += areas[v]
                        drop.add(v)
                        group.remove(v)
                        merged = True
                        break
                if merged:
                    break
    keep = np.array([k for k in range(len(a)) if k not in drop], dtype=np.intp)
    return ContactPatches(a[keep], b[keep], [polygons[k] for k in keep], normals[keep], overlaps)


def _hull_if_filled(p: Array, q: Array, n_p: Array, n_q: Array, area: float, tolerance: float) -> Array | None:
    if n_p @ n_q < 1.0 - 1e-9 or np.abs((q - p[0]) @ n_p).max() > tolerance:
        return None
    t1 = p[1] - p[0]
    t1 = t1 - (t1 @ n_p) * n_p
    t1 /= np.linalg.norm(t1)
    frame = np.column_stack([t1, np.cross(n_p, t1)])
    points = np.vstack([p, q])
    flat = (points - p[0]) @ frame
    hull = _hull(flat, 1e-3 * tolerance)
    x, y = flat[hull].T
    hull_area = 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    if hull_area - area > tolerance * np.sqrt(area):
        return None
    return points[hull]


def _hull(points: Array, slack: float) -> list[int]:
    """Convex hull, counter-clockwise, without vertices closer than ``slack`` to the line through their neighbours."""
    order = np.lexsort((points[:, 1], points[:, 0]))

    def half(sequence: Index) -> list[int]:
        chain: list[int] = []
        for i in sequence:
            while len(chain) >= 2:
                u, v = points[chain[-1]] - points[chain[-2]], points[i] - points[chain[-2]]
                if u[0] * v[1] - u[1] * v[0] > slack * np.linalg.norm(v):
                    break
                chain.pop()
            if not chain or np.linalg.norm(points[i] - points[chain[-1]]) > slack:
                chain.append(int(i))
        return chain

    lower, upper = half(order), half(order[::-1])
    return lower[:-1] + upper[:-1]
