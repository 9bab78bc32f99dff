"""The assembly as contiguous arrays, made once: what programs and compiled kernels see."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index


class AssemblyArrays(NamedTuple):
    """Contiguous arrays of n blocks and k interfaces.

    Sign convention: ``normal`` runs from ``block_a`` to ``block_b``; (tangent_1, tangent_2, normal) is right-handed.
    """

    centroid: Array  # [m], (n, 3)
    volume: Array  # [m3], (n,)
    mass: Array  # [kg], (n,)
    inertia: Array  # [kg m2] about the centroid, (n, 3, 3)
    weight: Array  # [N], (n,)
    held: Flags  # (n, 6)
    block_a: Index  # (k,)
    block_b: Index  # (k,)
    normal: Array  # (k, 3)
    tangent_1: Array  # (k, 3)
    tangent_2: Array  # (k, 3)
    centre: Array  # centroid of the polygon [m], (k, 3)
    area: Array  # [m2], (k,)
    corners: Array  # all polygon corners in a row [m], (sum, 3)
    corner_start: Index  # (k + 1,)
    tan_phi: Array  # (k,)
    tan_psi: Array  # (k,)
    cohesion: Array  # [Pa], (k,)
    tensile_strength: Array  # [Pa], (k,)
    compressive_strength: Array  # [Pa], (k,), infinite without crushing
    normal_stiffness: Array  # [Pa/m], (k,), NaN where not given
    shear_stiffness: Array  # [Pa/m], (k,), NaN where not given

    @property
    def corner_owner(self) -> Index:
        """Interface that each corner belongs to, shape (sum,)."""
        return np.repeat(np.arange(len(self.corner_start) - 1), np.diff(self.corner_start))


def face_arrays(polygons: list[Array], normal: Array) -> tuple[Array, Array, Array, Array, Array, Index]:
    """Tangents, centroids, areas, corners and corner offsets of k contact polygons.

    Parameters
    ----------
    polygons : corners of every face, counter-clockwise about its normal [m], shape (m, 3) each
    normal : unit normal of every face, shape (k, 3)

    Returns
    -------
    t1, t2 : unit tangents, shape (k, 3): the first follows the polygon's first edge, the second completes a
        right-handed frame with the normal
    centre : centroids [m], shape (k, 3)
    area : [m2], shape (k,)
    corners : of all faces one after the other [m], shape (sum of m, 3)
    start : first row of every face in them, and their number, shape (k + 1,)
    """
    k = len(polygons)
    count = np.array([len(p) for p in polygons], dtype=np.intp)
    start = np.concatenate([[0], np.cumsum(count)]).astype(np.intp)
    corners = np.concatenate(polygons) if k else np.empty((0, 3))
    t1, centre, area = np.empty((k, 3)), np.empty((k, 3)), np.empty(k)
    for size in np.unique(count):
        rows = np.flatnonzero(count == size)
        # polygons of as many corners at once
        p = corners[start[rows][:, None] + np.arange(size)]
        edge = p[:, 1] - p[:, 0]
        # the corners of a face are plane up to rounding only
        edge -= (edge * normal[rows]).sum(axis=1)[:, None] * normal[rows]
        t1[rows] = edge / np.linalg.norm(edge, axis=1)[:, None]
        r = p - p[:, :1]
        # a fan of triangles from the first corner
        part = 0.5 * np.einsum("mti,mi->mt", np.cross(r[:, 1:-1], r[:, 2:]), normal[rows])
        area[rows] = part.sum(axis=1)
        mean = (r[:, 1:-1] + r[:, 2:]) / 3.0
        centre[rows] = p[:, 0] + (part[..., None] * mean).sum(axis=1) / area[rows][:, None]
    return t1, np.cross(normal, t1), centre, area, corners, start


def with_ties(
    faces: AssemblyArrays, block_a: Index, block_b: Index, ends: Array, strength: Array, stiffness: Array
) -> AssemblyArrays:
    """Arrays with a row per tie after those of the interfaces, see ``Assembly.links``.

    A tie reads as a point of 1 m2 that its tension presses. The normal runs from b to a, the strength is compressive,
    and there is no friction. Corners stay those of faces.

    Parameters
    ----------
    faces : arrays of k interfaces
    block_a, block_b : numbers of the blocks of every tie, shape (t,)
    ends : points on a and on b [m], shape (t, 2, 3)
    strength : of every tie [N], shape (t,)
    stiffness : axial, of every tie [N/m], shape (t,)
    """
    normal = ends[:, 0] - ends[:, 1]
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    # across the axis that the tie is farthest from: the product is never near nil
    t1 = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=1)])
    t1 /= np.linalg.norm(t1, axis=1)[:, None]
    zero, one = np.zeros(len(strength)), np.ones(len(strength))
    rows = {
        "block_a": block_a, "block_b": block_b, "normal": normal, "tangent_1": t1, "tangent_2": np.cross(normal, t1),
        "centre": ends.mean(axis=1), "area": one, "tan_phi": zero, "tan_psi": zero, "cohesion": zero,
        "tensile_strength": zero, "compressive_strength": strength, "normal_stiffness": stiffness,
        "shear_stiffness": zero,
    }
    return faces._replace(**{name: np.concatenate([getattr(faces, name), row]) for name, row in rows.items()})
