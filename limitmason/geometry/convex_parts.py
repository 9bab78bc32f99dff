"""Closed polyhedra that are not convex, divided into convex parts by the planes of their own faces.

``slack`` is the distance up to which corners are one, and a corner lies in a plane [m].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.errors import InputError
from limitmason.geometry.polygon import area_in_space, clean_outline, convex_pieces
from limitmason.geometry.polyhedron import Solid, box, face_plane, face_planes, group_by_topology, mass_properties
from limitmason.geometry.splitting import below_planes, split_polygon, split_solid

MOST_PARTS = 40
"""A solid that would need more parts is refused: what it means is curved, and a hull or fewer faces say it better."""

_ROOM = 0.1
"""Part of the solid's size by which the box around it stands out [-]: any number above zero does."""

_CELLS_PER_PART = 4
"""Cells per part at which dividing ends: most cells are joined again."""

_VOLUME = 1e-6
"""Part of a solid's volume by which its parts may miss it [-]: rounding of many cells."""

_LOOSE = 10.0
"""Slacks within which corners and planes of cells are one: each cut may move them by a slack."""

_PARALLEL = 1e-9
"""1 less the cosine of two normals up to which they are parallel [-]: rounding."""

_SAME_PLANE = 1e-12
"""1 less the cosine of two normals up to which two planes bound a union once [-]: rounding."""

_FILLS = 1e-9
"""Part of the volume of two parts by which their union may differ from what their planes bound [-]: rounding."""


def convex_parts(solid: Solid, slack: float) -> list[Solid]:
    """Convex parts that tile a closed polyhedron exactly.

    Notches, holes and cavities are left open.

    A box around the solid is divided by planes of faces until no face runs through the inside of a cell. A cell then
    lies inside the solid where the faces cover the whole sphere of directions seen from its centre, sum of solid angles
    4 pi. Cells whose union is convex are joined again.

    Parameters
    ----------
    solid : closed, faces plane within ``slack`` and counter-clockwise seen from outside; faces may be concave too
    slack : points nearer than this to a plane lie in it [m]

    Returns
    -------
    list of Solid
        The solid itself where it is convex.

    Raises
    ------
    InputError
        Two bodies that are not joined, faces that cross each other or enclose nothing, more than :data:`MOST_PARTS`
        parts.
    """
    if is_convex([solid], slack)[0]:
        return [solid]
    # curved hollows are refused before a long division: a cut that parts two cells seldom ends more than two such edges
    if _hollow_edges(solid, slack) > 2 * MOST_PARTS:
        raise InputError(_TOO_MANY)
    faces = [_Face(solid.vertices[list(f)], slack) for f in solid.faces]
    triangles = np.array([t for f in faces for t in f.triangles])
    polygons = [(k, p) for k, f in enumerate(faces) for p in f.pieces]
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    # the box is larger than the solid, so that no outer face lies on its sides
    room = _ROOM * float((high - low).max())
    inside: list[Solid] = []
    waiting = [(box(low - room, high + room), polygons)]
    while waiting:
        cell, within = waiting.pop()
        if not within:
            if _winding(cell.vertices.mean(axis=0), triangles) > 0.5:
                inside.append(cell)
            continue
        if len(inside) + len(waiting) > _CELLS_PER_PART * MOST_PARTS:
            raise InputError(_TOO_MANY)
        waiting += _divided(cell, within, faces, slack)
    volume = float(mass_properties([solid]).volume[0])
    found = float(mass_properties(inside).volume.sum()) if inside else 0.0
    # faces may be off by a slack all over the surface
    if not abs(found - volume) <= _VOLUME * volume + _LOOSE * slack * float((high - low).max()) ** 2:
        raise InputError(
            f"its faces enclose {volume:.6g} m3 and its convex parts {found:.6g} m3: faces cross each other, or an "
            "inner shell is turned inside out"
        )
    parts = _joined(inside, slack)
    if len(parts) > MOST_PARTS:
        raise InputError(_TOO_MANY)
    _refuse_several_bodies(parts, slack)
    return [_snapped(p, solid.vertices, slack) for p in parts]


_TOO_MANY = (
    f"it divides into more than {MOST_PARTS} convex parts: draw curved hollows with fewer faces, give the parts as "
    "a list [(vertices, faces), ...], or take the hull of a scanned stone (formats.read_stones)"
)


def _hollow_edges(solid: Solid, slack: float) -> int:
    """Number of edges at which two faces enclose more than 180 degrees.

    Every part ends at one of them at least. ``slack`` is the distance up to which a corner lies in a plane [m].
    """
    planes = [face_plane(solid.vertices[list(f)]) for f in solid.faces]
    # number of the face that runs along every edge in either sense
    of_edge = {(f[i - 1], f[i]): k for k, f in enumerate(solid.faces) for i in range(len(f))}
    count = 0
    for (i, j), k in of_edge.items():
        other = of_edge[j, i]
        normal, offset = planes[k]
        if i < j and (solid.vertices[list(solid.faces[other])] @ normal - offset).max() > slack:
            # a face of another body part may lie above the plane too: only what begins at the edge counts
            along = solid.vertices[j] - solid.vertices[i]
            # at a hollow edge the normal turns clockwise about the edge from this face to the other
            count += float(np.cross(normal, planes[other][0]) @ along) < 0.0
    return count


def is_convex(solids: Sequence[Solid], slack: float) -> Flags:
    """Flags of the closed solids that are convex, shape (n,).

    In a convex solid no vertex lies farther than ``slack`` [m] outside the plane of a face.
    """
    out = np.ones(len(solids), dtype=bool)
    for faces, members, vertices in group_by_topology(solids):
        for f in faces:
            normal, offset = face_planes(vertices[:, list(f)])
            out[members] &= ~((np.einsum("kni,ki->kn", vertices, normal) - offset[:, None]).max(axis=1) > slack)
    return out


def largest_skew(solid: Solid) -> float:
    """Largest distance of a vertex from the plane of its face [m]."""
    out = 0.0
    for f in solid.faces:
        corners = solid.vertices[list(f)]
        normal, offset = face_plane(corners)
        out = max(out, float(np.abs(corners @ normal - offset).max()))
    return out


class _Face:
    """A plane face: a point and the unit normal of its plane, convex pieces and triangles of it [m], and its area."""

    def __init__(self, corners: Array, slack: float) -> None:
        """Cut a face into convex pieces and triangles, a sliver into none.

        Parameters
        ----------
        corners : in order around it, counter-clockwise seen from outside [m], shape (n, 3)
        slack : distance up to which corners are one [m]
        """
        self.normal, self.point = face_plane(corners)[0], corners.mean(axis=0)
        self.pieces: list[Array] = []
        self.triangles: list[Array] = []
        self.area = 0.0
        if 2.0 * area_in_space(corners) <= slack * float(np.ptp(corners, axis=0).max()):
            return  # a sliver closes the surface and encloses nothing
        # axes in the plane, from the global axis that lies nearest to it
        along = np.eye(3)[int(np.abs(self.normal).argmin())]
        along = along - (along @ self.normal) * self.normal
        along /= np.linalg.norm(along)
        axes = np.array([along, np.cross(self.normal, along)])
        flat = clean_outline((corners - self.point) @ axes.T, 1e-3 * slack)  # corners far within the slack stay apart
        self.pieces = [self.point + p @ axes for p in convex_pieces(flat)]
        self.triangles = [np.array([p[0], p[k], p[k + 1]]) for p in self.pieces for k in range(1, len(p) - 1)]
        self.area = 0.5 * sum(float(np.linalg.norm(np.cross(t[1] - t[0], t[2] - t[0]))) for t in self.triangles)


def _divided(
    cell: Solid, within: list[tuple[int, Array]], faces: Sequence[_Face], slack: float
) -> list[tuple[Solid, list[tuple[int, Array]]]]:
    """Parts of a cell below and above the plane of a face, with the faces in each.

    The plane is that which cuts fewest other faces, and of these that of the largest area.

    Parameters
    ----------
    cell : what is divided
    within : pieces of faces in it: number of the face, and corners [m], shape (n, 3)
    faces : of the whole solid
    slack : distance up to which a corner lies in a plane [m]
    """
    numbers = sorted({k for k, _ in within})
    normals = np.array([faces[k].normal for k in numbers])
    points = np.concatenate([p for _, p in within])
    first = np.cumsum([0, *(len(p) for _, p in within[:-1])])  # row of the first corner of every piece
    offsets = np.array([faces[k].point @ faces[k].normal for k in numbers])
    height = points @ normals.T - offsets  # of every corner above every plane [m]
    # a face whose corners lie on both sides of a plane is cut by it
    cuts = (np.minimum.reduceat(height, first) < -slack) & (np.maximum.reduceat(height, first) > slack)
    # a face may come as triangles, and two faces may lie in one plane: their areas count together
    along = normals @ normals.T
    same_offset = np.abs(offsets - np.sign(along) * offsets[:, None]) <= _LOOSE * slack
    alike = (np.abs(along) > 1.0 - _PARALLEL) & same_offset
    area = alike @ np.array([faces[k].area for k in numbers])
    # areas that are equal but for rounding leave the order to the faces' numbers
    order = np.lexsort((np.round(-area / area.max(), 9), cuts.sum(axis=0)))
    plane = faces[numbers[int(order[0])]]
    below, above, _ = split_solid(cell, plane.point, plane.normal, slack)
    sides: tuple[list[tuple[int, Array]], list[tuple[int, Array]]] = ([], [])
    for k, p in within:
        if np.abs((p - plane.point) @ plane.normal).max() <= slack:
            continue  # it lies in the plane: a face of the new cells from now on
        for side, piece in zip(sides, split_polygon(p, plane.point, plane.normal, slack), strict=True):
            if piece is not None and len(piece) > 2:
                side.append((k, piece))
    return [(c, s) for c, s in zip((below, above), sides, strict=True) if c is not None]


def _winding(point: Array, triangles: Array) -> float:
    """Solid angle of triangles seen from a point over 4 pi: 1 inside, 0 outside.

    tan(omega/2) = a.(b x c) / (abc + (a.b) c + (b.c) a + (c.a) b) for every triangle with corners a, b, c from the
    point (van Oosterom and Strackee 1983, eq. 8).
    """
    a, b, c = (triangles[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    over = np.einsum("ij,ij->i", a, np.cross(b, c))
    under = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return float(2.0 * np.arctan2(over, under).sum() / (4.0 * np.pi))


def _joined(parts: list[Solid], slack: float) -> list[Solid]:
    """Parts of which no two have a convex union, made of ``parts``.

    Those with the largest common face are joined first. ``slack`` is the distance up to which corners are one [m].
    """
    present = dict(enumerate(parts))
    candidates = _unions(present, [(i, j) for i in present for j in present if i < j], slack)
    number = len(parts)
    while candidates:
        (i, j), (_, union) = max(candidates.items(), key=lambda c: (c[1][0], c[0]))
        del present[i], present[j]
        candidates = {p: c for p, c in candidates.items() if not {i, j} & set(p)}
        candidates |= _unions({**present, number: union}, [(k, number) for k in present], slack)
        present[number] = union
        number += 1
    return list(present.values())


def _unions(
    parts: dict[int, Solid], pairs: list[tuple[int, int]], slack: float
) -> dict[tuple[int, int], tuple[float, Solid]]:
    """Pairs of parts with a convex union: area of their common face [m2], and the union.

    Parameters
    ----------
    parts : by number
    pairs : numbers of parts to try
    slack : distance up to which corners are one [m]
    """
    out = {}
    for i, j in pairs:
        area = _common_face(parts[i], parts[j], slack)
        union = _union(parts[i], parts[j], slack) if area > 0.0 else None
        if union is not None:
            out[i, j] = area, union
    return out


def _common_face(a: Solid, b: Solid, slack: float) -> float:
    """Area of a face that two parts share corner by corner [m2], zero without one.

    Corners within a few times ``slack`` [m] are one.
    """
    for f in a.faces:
        for g in b.faces:
            if len(f) != len(g):
                continue
            p, q = a.vertices[list(f)], b.vertices[list(g)]
            apart = np.linalg.norm(p[:, None] - q[None], axis=2)
            if (apart.min(axis=1) <= _LOOSE * slack).all() and (apart.min(axis=0) <= _LOOSE * slack).all():
                return area_in_space(p)
    return 0.0


def _union(a: Solid, b: Solid, slack: float) -> Solid | None:
    """Union of two convex parts where it is convex, else None.

    It is then what lies below those planes of their faces that have both parts below them, to a few times ``slack``
    [m].
    """
    points = np.vstack([a.vertices, b.vertices])
    planes: list[tuple[Array, float]] = []
    for part in (a, b):
        for f in part.faces:
            n, d = face_plane(part.vertices[list(f)])
            if (points @ n).max() <= d + _LOOSE * slack and not any(n @ m > 1.0 - _SAME_PLANE for m, _ in planes):
                planes.append((n, d))
    whole = below_planes(planes, points, slack)
    if whole is None:
        return None
    # the planes bound what holds both: it is the union only where its volume is that of both
    both = float(mass_properties([a, b]).volume.sum())
    return whole if abs(float(mass_properties([whole]).volume[0]) - both) <= _FILLS * both else None


def _refuse_several_bodies(parts: list[Solid], slack: float) -> None:
    """Refuse parts of which some share no face with the others."""
    from scipy.sparse.csgraph import connected_components  # `import limitmason` loads numpy alone

    touching = [[i < j and _touch(a, b, slack) for j, b in enumerate(parts)] for i, a in enumerate(parts)]
    if connected_components(np.array(touching), directed=False)[0] > 1:
        raise InputError("it consists of bodies that are not joined by a face: give each a block of its own")


def _touch(a: Solid, b: Solid, slack: float) -> bool:
    """Whether two parts that do not overlap share part of a face.

    Faces of a in whose plane b begins are clipped by the faces of b. ``slack`` is the distance from a plane up to which
    a corner lies in it [m].
    """
    for f in a.faces:
        n, d = face_plane(a.vertices[list(f)])
        # b begins elsewhere
        if abs(float((b.vertices @ n).min()) - d) > _LOOSE * slack:
            continue
        common: Array | None = a.vertices[list(f)]
        for g in b.faces:
            side, distance = face_plane(b.vertices[list(g)])
            # the face of b in this plane, and that on its far side, cut nothing off
            if abs(side @ n) > 1.0 - _PARALLEL or common is None:
                continue
            common, _ = split_polygon(common, distance * side, side, slack)  # what lies below, on the side of b
        if common is not None and area_in_space(common) > slack * float(np.ptp(common, axis=0).max()):
            return True
    return False


def _snapped(part: Solid, corners: Array, slack: float) -> Solid:
    """The part with every vertex that repeats a corner of the whole exactly there.

    Parameters
    ----------
    corners : of the whole [m], shape (n, 3)
    """
    apart = np.linalg.norm(part.vertices[:, None] - corners[None], axis=2)
    nearest = apart.argmin(axis=1)
    near = apart.min(axis=1) <= _LOOSE * slack
    return Solid(np.where(near[:, None], corners[nearest], part.vertices), part.faces)
