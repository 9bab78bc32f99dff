"""Closed polyhedra in batches of equal topology: mass properties, and checks that name what is wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array, Flags, Index
from limitmason.errors import InputError
from limitmason.geometry.rotation import vector_product

Faces = tuple[tuple[int, ...], ...]


class Solid(NamedTuple):
    """A closed convex polyhedron: vertices [m], shape (n, 3).

    Faces as index tuples, counter-clockwise from outside.
    """

    vertices: Array
    faces: Faces


class MassProperties(NamedTuple):
    """Volume, centroid and inertia of n polyhedra."""

    volume: Array  # [m3], negative for an inverted solid, (n,)
    centroid: Array  # [m], (n, 3)
    inertia: Array  # about the centroid per unit density [m5], (n, 3, 3)


NO_VOLUME = 1e-12
"""Volume over the cube of a solid's size below which it encloses none [-]: rounding."""

_BOX_FACES: Faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def encloses(solids: Sequence[Solid]) -> Flags:
    """Flags of the solids with a volume above rounding, which is below zero for an inverted one, shape (n,)."""
    return np.abs(mass_properties(solids).volume) > NO_VOLUME * longest_sides(solids) ** 3


def box(low: ArrayLike, high: ArrayLike) -> Solid:
    """Rectangular block between two opposite corners [m], shape (3,) each."""
    (x0, y0, z0), (x1, y1, z1) = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    vertices = np.array(
        [[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0], [x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]]
    )
    return Solid(vertices, _BOX_FACES)


def prism(outline: ArrayLike, y0: float, y1: float) -> Solid:
    """Prism between y0 < y1 [m] over a convex outline in x-z.

    Corners of ``outline`` run counter-clockwise [m], shape (n, 2).
    """
    p = np.asarray(outline, dtype=float)
    n = len(p)
    front = np.column_stack([p[:, 0], np.full(n, y0), p[:, 1]])
    back = np.column_stack([p[:, 0], np.full(n, y1), p[:, 1]])
    # seen from -y, x runs right and z up, so the counter-clockwise outline is the outward front face
    sides = tuple((i, i + n, (i + 1) % n + n, (i + 1) % n) for i in range(n))
    return Solid(np.vstack([front, back]), (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides))


def group_by_topology(solids: Sequence[Solid]) -> list[tuple[Faces, Index, Array]]:
    """Solids of equal vertex count and faces stacked together.

    Returned for every group of k solids with n vertices are its faces, the numbers of the solids, shape (k,), and their
    vertices [m], shape (k, n, 3).
    """
    groups: dict[tuple[int, Faces], list[int]] = {}
    for i, solid in enumerate(solids):
        groups.setdefault((len(solid.vertices), solid.faces), []).append(i)
    return [
        (faces, np.array(members), np.stack([solids[i].vertices for i in members]))
        for (_, faces), members in groups.items()
    ]


def _triangles(faces: Faces) -> Index:
    """Triangles at the first vertex of every face, numbers of their vertices, shape (t, 3)."""
    return np.array([(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)])


def mass_properties(solids: Sequence[Solid]) -> MassProperties:
    """Exact volume, centroid and inertia of closed polyhedra.

    Tetrahedra from the vertex mean to every triangle of the surface: V = sum det/6, and the second moments of a
    tetrahedron with apex at the origin, integral x x^T dV = det/120 (sum_k v_k v_k^T + s s^T), s = v_1 + v_2 + v_3.

    Parameters
    ----------
    solids : sequence of Solid
    """
    volume, centroid = np.empty(len(solids)), np.empty((len(solids), 3))
    inertia = np.empty((len(solids), 3, 3))
    for faces, members, vertices in group_by_topology(solids):
        origin = vertices.mean(axis=1)
        t = (vertices - origin[:, None])[:, _triangles(faces)]  # (k, triangles, 3 corners, 3)
        det = np.einsum("kti,kti->kt", t[:, :, 0], vector_product(t[:, :, 1], t[:, :, 2]))  # six times each volume
        total = det.sum(axis=1) / 6.0
        s = t.sum(axis=2)
        safe = np.where(np.abs(total) > 0, total, 1.0)  # of a flat solid the mean of its vertices is told
        local = np.einsum("kt,kti->ki", det, s) / 24.0 / safe[:, None]
        second = (np.einsum("kt,ktci,ktcj->kij", det, t, t) + np.einsum("kt,kti,ktj->kij", det, s, s)) / 120.0
        # from the mean vertex to the centroid
        second -= total[:, None, None] * local[:, :, None] * local[:, None, :]
        # inertia = trace(S) 1 - S of the second moments S
        trace = np.trace(second, axis1=1, axis2=2)
        volume[members] = total
        centroid[members] = origin + local
        inertia[members] = trace[:, None, None] * np.eye(3) - second
    return MassProperties(volume, centroid, inertia)


def steiner(arm: Array) -> Array:
    """Inertia of unit volumes about a point at arms a [m], shape (n, 3): |a|^2 I - a a^T, shape (n, 3, 3)."""
    return (arm**2).sum(axis=1)[:, None, None] * np.eye(3) - arm[:, :, None] * arm[:, None, :]


def check_closed(solids: Sequence[Solid], names: Sequence[str]) -> None:
    """Refuse solids that are open, of mixed orientation, or with faces that are none.

    A face has three distinct vertices or more.

    Parameters
    ----------
    solids : sequence of Solid, one convex piece each
    names : what to call each in an error

    Raises
    ------
    InputError
        Naming the block, what is wrong and what to do.
    """
    for faces, members, vertices in group_by_topology(solids):
        first = names[members[0]]
        n = vertices.shape[1]
        for f in faces:
            if len(f) < 3 or min(f) < 0 or max(f) >= n or len(set(f)) != len(f):
                raise InputError(
                    f"block {first!r}: face {f} is not a polygon of at least three distinct vertex indices below {n}"
                )
        edges = Counter((f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f)))
        for (i, j), count in edges.items():
            if count > 1 or edges.get((j, i), 0) != 1:
                raise InputError(
                    f"block {first!r} is open or has faces of mixed orientation: edge {i}-{j} is not shared by exactly "
                    "two faces that run along it in opposite senses; close the solid and orient every face "
                    "counter-clockwise seen from outside"
                )


def check_solids(solids: Sequence[Solid], names: Sequence[str], flatness: float) -> None:
    """Refuse closed solids that are inverted, flat or not convex, or have bent faces.

    Parameters
    ----------
    solids : sequence of Solid, one convex piece each
    names : what to call each in an error
    flatness : largest distance of a vertex from its face's plane, and of any vertex outside a face's plane [m]

    Raises
    ------
    InputError
        Naming the block, what is wrong and what to do.
    """
    for faces, members, vertices in group_by_topology(solids):
        bad = ~np.isfinite(vertices).all(axis=(1, 2))
        if bad.any():
            raise InputError(f"block {names[members[bad][0]]!r} has a coordinate that is not finite (NaN or infinite)")
        volume = mass_properties([solids[i] for i in members]).volume
        size = np.ptp(vertices, axis=1).max(axis=1)
        inverted = volume < -NO_VOLUME * size**3
        if inverted.any():
            raise InputError(
                f"block {names[members[inverted][0]]!r} is inverted (signed volume {volume[inverted][0]:.3g} m3): "
                "its faces run clockwise seen from outside; reverse them"
            )
        flat = volume <= NO_VOLUME * size**3
        if flat.any():
            raise InputError(f"block {names[members[flat][0]]!r} has zero thickness: it encloses no volume")
        for f in faces:
            corner = vertices[:, list(f)]
            normal, offset = face_planes(corner)
            inside = np.einsum("kni,ki->kn", vertices, normal) - offset[:, None]  # height above the face: none inside
            skew = np.abs(inside[:, list(f)]).max(axis=1) > flatness
            if skew.any():
                raise InputError(
                    f"block {names[members[skew][0]]!r}: face {f} is not plane within {flatness:.3g} m; split it into "
                    "triangles"
                )
            concave = inside.max(axis=1) > flatness
            if concave.any():
                raise InputError(
                    f"block {names[members[concave][0]]!r} is not convex (a vertex lies outside face {f}); give it as "
                    "a list of convex pieces [(vertices, faces), ...]"
                )


def face_planes(corners: Array) -> tuple[Array, Array]:
    """Outward unit normal (k, 3) and offset n.x [m] (k,) of k plane polygons of n corners each [m], (k, n, 3)."""
    centre = corners.mean(axis=1)
    r = corners - centre[:, None]
    normal = vector_product(r, np.concatenate((r[:, 1:], r[:, :1]), axis=1)).sum(axis=1)
    normal /= np.maximum(np.sqrt((normal * normal).sum(axis=1)), 1e-300)[:, None]
    return normal, np.einsum("ki,ki->k", normal, centre)


def face_plane(corners: Array) -> tuple[Array, float]:
    """Outward unit normal (3,) and offset n.x [m] of one plane polygon [m], shape (n, 3)."""
    normal, offset = face_planes(corners[None])
    return normal[0], float(offset[0])


def faces_at_edges(faces: Sequence[tuple[int, ...]]) -> dict[tuple[int, int], list[int]]:
    """Numbers of the faces at every edge, by its two corners in ascending order, as the faces pass them."""
    found: dict[tuple[int, int], list[int]] = {}
    for number, face in enumerate(faces):
        for i, j in zip(face, (*face[1:], face[0]), strict=True):
            found.setdefault((min(i, j), max(i, j)), []).append(number)
    return found


def least_widths(blocks: Sequence[Sequence[Solid]]) -> Array:
    """Least width of every block [m], shape (n,).

    It is the smallest distance between two planes parallel to a face that hold the block between them.
    Unlike the sides of its box it does not change when the block is turned.

    Parameters
    ----------
    blocks : convex pieces of every block
    """
    out = np.full(len(blocks), np.inf)
    single = np.array([i for i, parts in enumerate(blocks) if len(parts) == 1], dtype=np.intp)
    for faces, members, vertices in group_by_topology([blocks[i][0] for i in single]):
        for face in faces:
            normal, _ = face_planes(vertices[:, list(face)])
            across = np.ptp(np.einsum("kni,ki->kn", vertices, normal), axis=1)
            out[single[members]] = np.minimum(out[single[members]], across)
    for i in np.flatnonzero(np.array([len(parts) > 1 for parts in blocks])).tolist():
        vertices = np.vstack([part.vertices for part in blocks[i]])
        for part in blocks[i]:
            for face in part.faces:
                out[i] = min(out[i], float(np.ptp(vertices @ face_plane(part.vertices[list(face)])[0])))
    return out


def longest_sides(solids: Sequence[Solid]) -> Array:
    """Longest side of the box around each solid [m], shape (n,)."""
    return np.array([np.ptp(s.vertices, axis=0).max() for s in solids])
