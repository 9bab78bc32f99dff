"""Faces and corners of an assembly, and its contact points named by the corner and the face that they are."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array, Index
from limitmason.capacity.contact_search.faces import ALONG, Shapes
from limitmason.capacity.contact_search.near import NEAR, OVERSHOOT, Near, gap_and_inside, near_corners
from limitmason.capacity.contacts import PathContacts, turned_over
from limitmason.capacity.kinematics import at_rest
from limitmason.geometry.rotation import vector_product
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly

_SQUARE = 1e-6
"""Cosine up to which a face stands square to a plane, and 1 less that up to which two normals are one [-]: rounding."""

_AT_FACE = 1e-3
"""Part of a face's length within which a point of a joint lies on it [-]: chosen."""

_PULLED_IN = 10.0
"""Tolerances of the assembly below which points count as standing at the ends of faces: chosen."""


def shapes_of(
    assembly: Assembly, contacts: PathContacts, plane: Plane | None, size: float, firm: Index
) -> tuple[Shapes, PathContacts]:
    """Faces and corners of an assembly, and the contacts with their corners named and the frame carried by the face.

    Parameters
    ----------
    contacts : of the reference pose
    plane : of a problem in plane, whose faces are then lines; None in space
    size : median block size [m]
    firm : rank of every block by :func:`.firmness`, the higher the firmer, shape (n,)
    """
    outlines = _outlines(assembly, contacts, plane)
    inset = _inset(assembly, contacts, outlines, plane)
    # columns of ``Shapes``, face by face; ``owner`` is the face of every corner
    block: list[int] = []
    place, normal, side, reach, owner, corner = ([] for _ in range(6))
    width = max((len(p) for _, p, _ in outlines), default=2)
    for b, points, n in outlines:
        if plane is not None:  # a line, whose two sides are its ends
            along = points[1] - points[0]
            length = float(np.linalg.norm(along))
            if length <= 2.0 * inset:
                continue  # nothing of the face is left between its ends
            along = along / length
            ends = np.array([points[0] + inset * along, points[1] - inset * along])
            inward = np.array([along, -along])
        else:
            ends = points
            edge = np.roll(points, -1, axis=0) - points
            inward = np.cross(n, edge)
            inward = inward / np.linalg.norm(inward, axis=1)[:, None]
        # faces with fewer sides repeat the last one: a side counts once or twice alike
        pad = np.minimum(np.arange(width), len(ends) - 1)
        block.append(b)
        place.append(ends.mean(axis=0))
        normal.append(n)
        side.append(inward[pad])
        reach.append((inward * ends).sum(axis=1)[pad])
        owner.append(np.full(len(ends), len(block) - 1))
        corner.append(ends)
    face_block = np.array(block, np.intp)
    corner_face = np.concatenate(owner).astype(np.intp)
    corner_place = np.concatenate(corner)
    away = np.linalg.norm(corner_place - assembly.centroids[face_block[corner_face]], axis=1)
    spread = np.zeros(assembly.n_blocks)
    np.maximum.at(spread, face_block[corner_face], away)
    shapes = Shapes(
        assembly=assembly, face_block=face_block, face_place=np.array(place), normal=np.array(normal),
        side=np.array(side), reach=np.array(reach), corner_face=corner_face, corner_place=corner_place,
        face_start=np.searchsorted(face_block, np.arange(assembly.n_blocks + 1)),
        step=OVERSHOOT * size, near=NEAR * size, spread=spread, strangers=np.empty(0, np.int64), firm=firm, inset=inset,
    )
    near = near_corners(shapes, at_rest(assembly.n_blocks), inside=-shapes.near)
    named = _named(shapes, contacts, near)
    known, code = shapes.code(named.corner, named.face), shapes.code(near.corner, near.face)
    # what lies together without being a point belongs to a joint of the model, or to none by its user's will
    return shapes._replace(strangers=_strangers(shapes, named, near, np.setdiff1d(code, known))), named


def _outlines(assembly: Assembly, contacts: PathContacts, plane: Plane | None) -> list[tuple[int, Array, Array]]:
    """Block, corners [m], (k, 3), and outward unit normal, (3,), of every face, blocks in order.

    In plane the corners are the two ends of a line.

    Parameters
    ----------
    contacts : whose plane is taken, in plane
    """
    out = []
    # the plane of the contacts, to which all faces are taken
    level = 0.0 if plane is None else float(np.median(contacts.place_b @ plane.normal))
    for b, body in enumerate(assembly.blocks):
        for part in body.parts:
            for face in part.faces:
                x = part.vertices[list(face)]
                n = _area_vector(x)
                n = n / np.linalg.norm(n)
                if plane is None:
                    out.append((b, x, n))
                    continue
                if abs(n @ plane.normal) > _SQUARE:
                    continue  # it lies in the plane, or oblique to it: no line of the problem
                along = vector_product(plane.normal, n)
                s = x @ along
                flat = x[[int(s.argmin()), int(s.argmax())]]
                out.append((b, flat + (level - flat @ plane.normal)[:, None] * plane.normal, n))
    return out


def _area_vector(x: Array) -> Array:
    """Twice the area of a polygon along its normal [m2], written out: np.cross of few vertices is mostly overhead."""
    y = x[[*range(1, len(x)), 0]]
    products = x.T @ y
    return np.array([products[1, 2] - products[2, 1], products[2, 0] - products[0, 2], products[0, 1] - products[1, 0]])


def _inset(
    assembly: Assembly, contacts: PathContacts, outlines: list[tuple[int, Array, Array]], plane: Plane | None
) -> float:
    """How far the contacts of the model are pulled in from the ends of the faces [m]: the median over its joints.

    Parameters
    ----------
    contacts : points of the model in the reference pose
    outlines : block, corners [m], shape (k, 3), and outward normal of every face
    plane : of a problem in plane; None in space, where points stand at the corners themselves
    """
    if plane is None:
        return 0.0
    found = []
    block, normals = np.array([b for b, _, _ in outlines]), np.reshape([n for _, _, n in outlines], (-1, 3))
    ends = np.reshape([points for _, points, _ in outlines], (-1, 2, 3))
    at_face = _AT_FACE * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    of_block = {int(b): np.flatnonzero(block == b) for b in np.unique(block)}
    # the first and the last point of every joint stand at its ends
    first = np.flatnonzero(np.diff(contacts.interface, prepend=-2))
    last = np.append(first[1:], contacts.count) - 1
    for i in np.concatenate([first, last]):
        nearest = []  # distances to the end of either block's face [m]
        for b, sign in ((contacts.block_a[i], 1.0), (contacts.block_b[i], -1.0)):
            own = of_block.get(int(b), np.zeros(0, np.intp))
            to_ends = ends[own] - contacts.place_b[i]
            off = np.abs((to_ends[:, 0] * normals[own]).sum(axis=1))
            along = normals[own] @ (sign * contacts.directions[i, 0])
            meets = (along > 1.0 - _SQUARE) & (off < at_face[own])
            if meets.any():
                nearest.append(float(np.linalg.norm(to_ends[meets], axis=2).min()))
        if nearest:
            found.append(min(nearest))
    inset = float(np.median(found)) if found else 0.0
    return inset if inset > _PULLED_IN * assembly.tolerance else 0.0


def _named(shapes: Shapes, c: PathContacts, near: Near) -> PathContacts:
    """The contacts with their corners and faces, the frame carried by the face.

    Where two corners meet the frame stays with the block that has it. Where a joint ends at an edge its corners lie on
    the faces beyond it too: they belong to those that look along its normal.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : contacts of the model
    near : corners and faces that lie together in the reference pose
    """
    owner, normal = shapes.owner, shapes.normal
    by_pair: dict[tuple[int, int], list[int]] = {}  # rows of ``near`` by block of the face and block of the corner
    for row in range(len(near.corner)):
        key = int(shapes.face_block[near.face[row]]), int(owner[near.corner[row]])
        by_pair.setdefault(key, []).append(row)
    corner, face, turned = c.corner.copy(), c.face.copy(), np.zeros(c.count, bool)
    reachable = 1e-2 * shapes.near + 1e-9  # from a point to the corner that it is [m]: chosen
    for i in range(c.count):
        a, b = int(c.block_a[i]), int(c.block_b[i])
        best: dict[bool, int] = {}  # row that fits best with the frame as it is, and with the frame turned over
        for flipped, key, along in ((False, (a, b), c.directions[i, 0]), (True, (b, a), -c.directions[i, 0])):
            most = ALONG
            for row in by_pair.get(key, []):
                off = shapes.corner_place[near.corner[row]] - c.place_b[i]
                if np.abs(off).max() >= reachable or (looks := float(normal[near.face[row]] @ along)) < ALONG:
                    continue
                # the face of the corner itself should look the other way
                looks -= float(normal[shapes.corner_face[near.corner[row]]] @ along)
                if looks > most:
                    best[flipped], most = row, looks
        if not best:
            continue
        flipped = False not in best
        turned[i] = flipped
        corner[i], face[i] = near.corner[best[flipped]], near.face[best[flipped]]
    return replace(turned_over(c, turned), corner=corner, face=face)


def with_faces(shapes: Shapes, c: PathContacts) -> PathContacts:
    """The points, each that is neither a corner nor a crossing with the face of its block a on which it lies.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : contact points
    """
    face, rest = c.face.copy(), at_rest(shapes.assembly.n_blocks)
    for i in np.flatnonzero(face < 0):
        # all faces of block a, and the point once for each
        mine = np.arange(shapes.face_start[c.block_a[i]], shapes.face_start[c.block_a[i] + 1])
        one = np.full(len(mine), i)
        gap, inside = gap_and_inside(shapes, rest, c.place_b[one], c.block_b[one], mine)
        along = shapes.normal[mine] @ c.directions[i, 0] > ALONG
        lies = (np.abs(gap) < shapes.near) & (inside > -shapes.step) & along
        if lies.any():
            face[i] = mine[np.where(lies, np.abs(gap), np.inf).argmin()]
    return replace(c, face=face)


def _strangers(shapes: Shapes, c: PathContacts, near: Near, codes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Codes of pairs of corner and face that meet in the reference pose and are no contacts, shape (s,).

    They must not become contacts later. Those are pairs of blocks without a joint, and corners deep inside a face where
    the model has no point. What is left is the second of two corners that meet, which takes over once they slide.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : contact points of the model
    near : pairs of corner and face that lie together in the reference pose
    codes : numbers of the pairs that are no point, corner * number of faces + face
    """
    f, owner = len(shapes.face_block), shapes.owner
    pairs = {(min(a, b), max(a, b)) for a, b in zip(c.block_a.tolist(), c.block_b.tolist(), strict=True)}
    deep = set(shapes.code(near.corner, near.face)[near.inside > shapes.step].tolist())
    out = []
    for code in codes.tolist():
        a, b = int(shapes.face_block[code % f]), int(owner[code // f])
        if code in deep or (min(a, b), max(a, b)) not in pairs:
            out.append(code)
    return np.array(out, np.int64)
