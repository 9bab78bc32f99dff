"""Faces of different bodies that look at each other: their common area and the gap over it; the faces under a joint.

``solids`` are convex and closed, with faces counter-clockwise from outside.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array, Flags, Index
from limitmason.geometry.clipping import area_perimeter, clip_convex_batch, drop_redundant_vertices
from limitmason.geometry.polygon import axes_in_plane, clip_convex, polygon_area_centroid
from limitmason.geometry.polyhedron import Solid, face_planes, group_by_topology

_OPPOSITE = -1.0 + 1e-9
"""Cosine of two normals below which they are opposite [-]: rounding."""

_AREAS_ALIKE = 1e-6
"""Difference of the areas of two faces over that of one, up to which they are equal [-]: rounding."""

_LOOKS_THE_SAME_WAY = 0.7
"""Cosine of about 45 degrees: the face that a joint lies on looks its way [-]: chosen."""

_FARTHEST = 0.5
"""Part of a joint's size: a face farther from its plane is not the one that it lies on [-]: chosen."""

_ALIGNMENT_COUNTS = 1e-6
"""Part of a joint's size: so little that alignment decides between equal distances alone [-]: chosen."""

_LEVEL = 1e-6
"""Part of a joint's size: faces whose distances from it differ by no more lie in one plane [-]: chosen."""

_COVERED = 1e-4
"""Part of a face, or of a joint where that is smaller, up to which their common area is none [-]: chosen."""


class Faces(NamedTuple):
    """All F faces of all solids, or of all bodies, in a row, with their planes."""

    corners: Array  # [m], (F, K, 3), padded by repeating the last
    corners_of: Index  # (F,)
    normal: Array  # outward, (F, 3)
    offset: Array  # [m], (F,)
    part: Index  # solid or body each belongs to, (F,)

    @classmethod
    def of(cls, polygons: Sequence[Array], part: Index) -> "Faces":
        """Faces by their corners, counter-clockwise from outside [m], shape (k, 3) each.

        ``part`` is the solid or body of each, shape (F,).
        """
        count = np.array([len(p) for p in polygons])
        corners = np.array([p[np.minimum(np.arange(count.max()), len(p) - 1)] for p in polygons])
        normal, offset = np.empty((len(count), 3)), np.empty(len(count))
        for k in np.unique(count):
            rows = count == k
            normal[rows], offset[rows] = face_planes(corners[rows, :k])
        return cls(corners, count, normal, offset, part)


class FacingPairs(NamedTuple):
    """Pairs of faces that may overlap in projection: the area common to both, placed midway between them.

    Pairs whose boxes overlap but not the faces are among them: they have no corners, area or width.

    Parameters
    ----------
    f, g : faces, the one of the lower owner first, shape (m,)
    points : corners of the common area [m], shape (m, K, 3), padded by repeating the last one
    corners_of : number of corners, shape (m,)
    normal : unit vector from f to g, the mean of both faces' normals, shape (m, 3)
    gap : between the faces at every corner, negative where they overlap [m], shape (m, K)
    area : [m2], shape (m,)
    width : 2 area / perimeter, about the shorter side of a long strip [m], shape (m,)
    angle_deg : between the faces [deg], shape (m,)
    """

    f: Index
    g: Index
    points: Array
    corners_of: Index
    normal: Array
    gap: Array
    area: Array
    width: Array
    angle_deg: Array

    def rows(self, keep: NDArray) -> "FacingPairs":
        """Some of the pairs."""
        return FacingPairs(*(column[keep] for column in self))


def inner_faces(faces: Faces, owner: Index, near: float) -> Flags:
    """Flags of the faces in which two pieces of one owner join, shape (F,): they lie in it and meet nothing else.

    Of a face that is covered in part :func:`~limitmason.geometry.splitting.outer_faces` gives the rest.

    Parameters
    ----------
    faces : from :func:`all_faces`
    owner : block of every solid, shape (solids,)
    near : distance up to which centres of faces are one [m]
    """
    inner = np.zeros(len(faces.part), dtype=bool)
    rows = np.flatnonzero((np.bincount(owner) > 1)[owner[faces.part]])
    if not len(rows):
        return inner
    from scipy.spatial import cKDTree  # `import limitmason` loads numpy alone

    corners, count = faces.corners[rows], faces.corners_of[rows]
    own = np.arange(corners.shape[1]) < count[:, None]  # behind these the last corner is repeated
    centre = np.where(own[..., None], corners, 0.0).sum(axis=1) / count[:, None]
    arms = corners - corners[:, :1]
    area = np.linalg.norm(np.cross(arms[:, :-1], arms[:, 1:]).sum(axis=1), axis=1)  # doubled [m2]
    i, j = cKDTree(centre).query_pairs(near, output_type="ndarray").T
    part, normal = faces.part[rows], faces.normal[rows]
    # a piece may be thinner than that itself: its own two sides do not join
    same = (owner[part[i]] == owner[part[j]]) & (part[i] != part[j])
    same &= np.einsum("ki,ki->k", normal[i], normal[j]) < _OPPOSITE
    same &= np.abs(area[i] - area[j]) <= _AREAS_ALIKE * area[i]
    inner[rows[i[same]]] = inner[rows[j[same]]] = True
    return inner


def faces_under(faces: Faces, rows: slice, polygon: Array, outward: Array) -> Index:
    """Numbers of the faces of one body that a joint lies on, the nearest first, shape (k,); none where all are far.

    A joint lies half-way in the gap between two faces as drawn, and may lie on several: those of triangles, or of
    pieces, in one plane. The nearest is that of those that look its way within 45 degrees and are no farther than half
    its size. Alignment decides between faces as near as each other. How far the middle lies beside a face is told by
    the face's box. With it go the faces in its plane over which the joint lies too.

    Parameters
    ----------
    faces : of all bodies
    rows : numbers of the faces of this one
    polygon : corners of the joint [m], shape (n, 3)
    outward : unit normal of the joint out of the body, shape (3,)
    """
    aligned = faces.normal[rows] @ outward
    away = np.abs(polygon @ faces.normal[rows].T - faces.offset[rows]).max(axis=0)
    middle = polygon.mean(axis=0)
    low, high = faces.corners[rows].min(axis=1), faces.corners[rows].max(axis=1)
    beside = np.maximum(np.maximum(low - middle, middle - high), 0.0).max(axis=1)
    size = float(np.ptp(polygon, axis=0).max())
    fits = (aligned > _LOOKS_THE_SAME_WAY) & (away <= _FARTHEST * size)
    if not fits.any():
        return np.empty(0, dtype=np.intp)
    distance = away + beside + _ALIGNMENT_COUNTS * size * (1.0 - aligned)
    nearest = int(np.where(fits, distance, np.inf).argmin())
    found = [rows.start + nearest]
    level = np.flatnonzero(fits & (np.abs(away - away[nearest]) <= _LEVEL * size))
    for k in (rows.start + level[level != nearest]).tolist():
        # seen along the joint's normal
        frame = axes_in_plane(polygon, outward)
        joint, face = polygon @ frame, faces.corners[k, : faces.corners_of[k]] @ frame
        areas = [abs(polygon_area_centroid(p)[0]) if len(p) else 0.0 for p in (joint, face, clip_convex(joint, face))]
        if areas[2] > _COVERED * min(areas[:2]):
            found.append(k)
    return np.array(found)


def facing_pairs(
    faces: Faces, start: Index, owner: Index, p: Index, q: Index, reach: Array, slack: Array, angle_deg: float
) -> FacingPairs:
    """Common areas of all faces that look at each other.

    Parameters
    ----------
    faces, start : from :func:`all_faces`
    owner : block of every solid, shape (solids,)
    p, q : pairs of solids to look at, shape (k,)
    reach : faces whose boxes are further apart than this are left out, one per pair of solids [m]
    slack : corners nearer than this to the line past them are dropped, one per pair of solids [m]
    angle_deg : faces further than this from parallel are left out [deg]
    """
    f, g, pair = _face_pairs(faces, start, p, q, reach, -np.cos(np.deg2rad(angle_deg)))
    # lower block number first, so that the normal runs from a to b
    swap = owner[faces.part[f]] > owner[faces.part[g]]
    f, g = np.where(swap, g, f), np.where(swap, f, g)
    # outward normals of faces that look at each other are nearly opposite: their difference is twice the mean
    normal = faces.normal[f] - faces.normal[g]
    length = np.linalg.norm(normal, axis=1)
    normal /= length[:, None]

    # both faces in the plane across their mean normal, from a corner of the first
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
    clipped, count = drop_redundant_vertices(clipped, count, slack[pair])
    area, perimeter = area_perimeter(clipped)
    width = np.where(count >= 3, 2.0 * area / np.maximum(perimeter, 1e-300), 0.0)

    # clipped corners lie in the plane through `origin` normal to the mean normal: place them midway between both faces
    points = origin[:, None] + clipped @ np.swapaxes(frame, 1, 2)
    to_f = faces.offset[f][:, None] - np.einsum("mki,mi->mk", points, faces.normal[f])
    to_g = np.einsum("mki,mi->mk", points, faces.normal[g]) - faces.offset[g][:, None]
    points += (0.5 * (to_f + to_g))[..., None] * normal[:, None, :]
    # two unit vectors at an angle: half their difference has the cosine of half of it for length, its sine for rest
    half = np.linalg.norm(faces.normal[f] + faces.normal[g], axis=1) / length
    return FacingPairs(
        f=f, g=g, points=points, corners_of=count, normal=normal, gap=to_g - to_f, area=area, width=width,
        angle_deg=np.degrees(2.0 * np.arctan(half)),
    )


def all_faces(solids: Sequence[Solid]) -> tuple[Faces, Index]:
    """All faces of all solids, and the row of each solid's first one.

    The rows have the total at the end, shape (solids + 1,).
    """
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
    return Faces(corners, count, normal, offset, np.repeat(np.arange(len(solids)), n_faces)), start


def _face_pairs(
    faces: Faces, start: Index, p: Index, q: Index, reach: Array, facing: float
) -> tuple[Index, Index, Index]:
    """Pairs of faces with opposite normals whose boxes are within reach.

    Every face of one solid of a pair is set beside every face of the other.

    Parameters
    ----------
    faces : of all solids
    start : row of each solid's first face, and the total, shape (solids + 1,)
    p, q : solids of every pair, shape (k,)
    reach : gap up to which they are near [m], shape (k,)
    facing : cosine between outward normals below which faces look at each other [-]

    Returns
    -------
    f, g : rows of the two faces, shape (m,)
    pair : row of their pair of solids, shape (m,)
    """
    # every face of p beside every face of q: row ``local`` of a pair is face local // n_q of p and local % n_q of q
    n_p, n_q = start[p + 1] - start[p], start[q + 1] - start[q]
    pair = np.repeat(np.arange(len(p)), n_p * n_q)
    local = np.arange(len(pair)) - np.repeat(np.cumsum(n_p * n_q) - n_p * n_q, n_p * n_q)
    f = start[p[pair]] + local // n_q[pair]
    g = start[q[pair]] + local % n_q[pair]
    opposite = np.einsum("mi,mi->m", faces.normal[f], faces.normal[g]) < facing
    f, g, pair = f[opposite], g[opposite], pair[opposite]
    low, high = faces.corners.min(axis=1), faces.corners.max(axis=1)
    far = reach[pair][:, None]
    near = (low[f] <= high[g] + far).all(axis=1) & (low[g] <= high[f] + far).all(axis=1)
    return f[near], g[near], pair[near]


def _left_packed(reversed_corners: Array, count: Index) -> Array:
    """Corners of reversed rows with their padding behind them again, in the same form.

    The reversal has brought the padding to the front.

    Parameters
    ----------
    reversed_corners : [m], shape (m, K, 2)
    count : number of corners of each, without the padding, shape (m,)
    """
    k = reversed_corners.shape[1]
    index = np.minimum(np.arange(k)[None, :] + (k - count)[:, None], k - 1)
    return np.take_along_axis(reversed_corners, index[..., None], axis=1)
