"""Convex polyhedra and polygons split by a plane."""

from collections.abc import Iterable, Sequence

import numpy as np

from limitmason.arrays import Array
from limitmason.constants import RELATIVE_TOLERANCE
from limitmason.geometry.polygon import part_within
from limitmason.geometry.polyhedron import Solid, box, face_plane, least_widths

_JOINED = 1e-6
"""Part of the size of the pieces of a body up to which places are one, and 1 less the cosine of normals [-]: chosen."""


def split_polygon(polygon: Array, point: Array, normal: Array, slack: float) -> tuple[Array | None, Array | None]:
    """Parts of a convex polygon in space below and above a plane [m], shape (k, 3).

    A part that is thinner than ``slack`` is None.

    Parameters
    ----------
    polygon : [m], shape (n, 3)
    point, normal : of the plane, [m] and unit vector, shape (3,); above is where the normal points
    slack : vertices nearer than this to the plane lie on it [m]
    """
    height = (polygon - point) @ normal
    height = np.where(np.abs(height) <= slack, 0.0, height)
    if not (height < 0.0).any():
        return None, polygon
    if not (height > 0.0).any():
        return polygon, None
    # where the plane cuts the side to the first corner, both parts begin there
    turn = int(height[-1] * height[0] < 0.0)
    below, above = (np.roll(part_within(polygon, sign * height), turn, axis=0) for sign in (1.0, -1.0))
    return below, above


def outer_faces(parts: Sequence[Solid], distance: float | None = None) -> list[Array]:
    """Faces of the pieces of one body, without what lies between two of them [m], shape (k, 3) each.

    They are convex and run counter-clockwise seen from outside.

    Parameters
    ----------
    parts : convex pieces that do not overlap
    distance : gap or overlap up to which they touch [m]; by default that of contacts, for the thinnest piece
    """
    faces = [(k, part.vertices[list(face)]) for k, part in enumerate(parts) for face in part.faces]
    if len(parts) == 1:
        return [face for _, face in faces]
    slack = _JOINED * float(np.ptp(np.vstack([part.vertices for part in parts]), axis=0).max())
    # two faces of a stack of thin pieces are not one
    thinnest = float(least_widths([[part] for part in parts]).min())
    near = max(slack, RELATIVE_TOLERANCE * thinnest if distance is None else min(distance, 0.5 * thinnest))
    planes = [face_plane(face) for _, face in faces]
    out = []
    for (part, face), (normal, offset) in zip(faces, planes, strict=True):
        left = [face]
        for (other, cover), (opposite, distance) in zip(faces, planes, strict=True):
            if other != part and normal @ opposite < _JOINED - 1.0 and abs(offset + distance) <= near:
                left = [rest for piece in left for rest in _uncovered(piece, cover, opposite, slack)]
        out += left
    return out


def _uncovered(polygon: Array, cover: Array, normal: Array, slack: float) -> list[Array]:
    """What another convex polygon in its plane leaves of a convex one, in convex pieces [m], shape (k, 3) each.

    Parameters
    ----------
    polygon : [m], shape (n, 3)
    cover : counter-clockwise about ``normal`` [m], shape (m, 3)
    normal : unit vector, shape (3,)
    slack : vertices nearer than this to a side of the cover lie on it [m]
    """
    inside, out = polygon, []
    for a, b in zip(cover, np.roll(cover, -1, axis=0), strict=True):
        side = np.cross(b - a, normal)
        within, beside = split_polygon(inside, a, side / np.linalg.norm(side), slack)
        if within is None:  # all of the rest lies beside the cover, and so does all of the polygon
            return [polygon]
        inside = within
        out += [] if beside is None else [beside]
    return out


def split_solid(solid: Solid, point: Array, normal: Array, slack: float) -> tuple[Solid | None, Solid | None, Array]:
    """Parts of a convex polyhedron below and above a plane, and the polygon between.

    The polygon [m], shape (n, 3), is counter-clockwise seen against the normal, and empty where the plane misses the
    inside. A part that is thinner than ``slack`` is None.

    Parameters
    ----------
    solid : what is split
    point, normal : of the plane, [m] and unit vector, shape (3,); above is where the normal points
    slack : vertices nearer than this to the plane lie on it [m]
    """
    height = (solid.vertices - point) @ normal
    height = np.where(np.abs(height) <= slack, 0.0, height)
    if not (height < 0.0).any():
        return None, solid, np.empty((0, 3))
    if not (height > 0.0).any():
        return solid, None, np.empty((0, 3))
    vertices = [*solid.vertices]
    cuts: dict[tuple[int, int], int] = {}  # new vertices by the edge that the plane cuts there
    sides: tuple[list[list[int]], list[list[int]]] = ([], [])  # faces below and above, as numbers of vertices
    for face in solid.faces:
        parts: tuple[list[int], list[int]] = ([], [])
        for k, j in enumerate(face):
            i = face[k - 1]
            # both faces at an edge share the vertex where it is cut
            if height[i] * height[j] < 0.0:
                edge = (min(i, j), max(i, j))
                if edge not in cuts:
                    share = height[i] / (height[i] - height[j])
                    cuts[edge] = len(vertices)
                    vertices.append(solid.vertices[i] + share * (solid.vertices[j] - solid.vertices[i]))
                for part in parts:
                    part.append(cuts[edge])
            if height[j] <= 0.0:
                parts[0].append(j)
            if height[j] >= 0.0:
                parts[1].append(j)
        for side, part, sign in zip(sides, parts, (-1.0, 1.0), strict=True):
            # a face that only touches the plane with an edge has no part on the other side
            if len(part) >= 3 and any(i < len(height) and sign * height[i] > 0.0 for i in part):
                side.append(part)
    # the face between the parts: all vertices in the plane, by the angle about their middle
    rim = [*cuts.values(), *np.flatnonzero(height == 0.0).tolist()]
    places = np.array(vertices)
    middle = places[rim].mean(axis=0)
    along = places[rim[0]] - middle
    along /= np.linalg.norm(along)
    across = np.cross(normal, along)
    angle = np.arctan2((places[rim] - middle) @ across, (places[rim] - middle) @ along)
    ring = [rim[k] for k in np.argsort(angle)]
    sides[0].append(ring)
    sides[1].append(ring[::-1])
    return _solid(places, sides[0]), _solid(places, sides[1]), places[ring]


def _solid(places: Array, faces: list[list[int]]) -> Solid:
    """Solid of faces by numbers of vertices, with those of the places [m], (n, 3), that they use."""
    used = sorted({i for face in faces for i in face})
    number = {old: new for new, old in enumerate(used)}
    return Solid(places[used], tuple(tuple(number[i] for i in face) for face in faces))


def below_planes(
    planes: Iterable[tuple[Array, float]], points: Array, slack: float, *, margin: float = 0.0
) -> Solid | None:
    """What of a box around some points lies below all planes, None where nothing does.

    Parameters
    ----------
    planes : unit normal, and offset along it [m]
    points : [m], shape (n, 3); the box stands out from them by their largest extent and a margin
    slack : vertices nearer than this to a plane lie on it [m]
    margin : by which the box stands out further [m]
    """
    room = margin + float(np.ptp(points, axis=0).max())
    solid: Solid | None = box(points.min(axis=0) - room, points.max(axis=0) + room)
    for normal, offset in planes:
        if solid is None:
            return None
        solid, _, _ = split_solid(solid, offset * normal, normal, slack)
    return solid
