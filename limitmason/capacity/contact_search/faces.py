"""Faces and corners of the blocks, which contact points are made of, and which corners lie at which faces in a pose.

Every face of every block has corners (in plane: its two ends) and sides. A contact point is a corner of one block on a
face of another; corners that contacts of the model are pulled in from stay pulled in.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.contacts import PathContacts, turned_over
from limitmason.capacity.kinematics import Pose, at_rest
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly

OVERSHOOT = 1e-3
"""How far beyond a side a corner goes before it has left a face, or come to it, over the median block size [-]."""

NEAR = 0.01
"""Gap within which a corner is made a contact point, over the median block size [-]."""

FACING = -0.5
"""Cosine between the outward normals up to which the face of a corner looks at another face."""


ALONG = 0.99
"""Cosine between the outward normal of a face and that of a point from which the point may lie on it."""


class Shapes(NamedTuple):
    """Faces of all blocks and their corners in the reference pose.

    A face has k sides, padded by repetition.

    Parameters
    ----------
    assembly : whose faces they are
    face_block, face_place, normal : block, a point [m] and the outward normal of every face
    side, reach : inward unit normals of the sides, (f, k, 3), and side . x on them in the reference pose [m], (f, k)
    corner_face, corner_place : face that a corner belongs to, and where it is [m], shape (q,) and (q, 3)
    face_start, corner_start : where the faces and the corners of every block begin; those of a block follow each other
    step : how far beyond a side counts [m]
    near : gap within which a corner becomes a point [m]
    spread : largest distance of a corner from its block's centroid [m], shape (n,)
    strangers : codes corner * f + face of what lies together in the reference pose without a joint
    firm : ranks of the blocks, see :func:`limitmason.capacity.contacts.firmness`, shape (n,)
    inset : how far the ends of faces are pulled in from the corners of the blocks, in plane [m]
    edge : number of the edge of its block that the side from every corner to the next is, in space, shape (q,)
    open : pairs of blocks whose joint is open in the reference pose, though their faces touch there
    opening : the least opening of their points [m]
    """

    assembly: Assembly
    face_block: Index
    face_place: Array
    normal: Array
    side: Array
    reach: Array
    corner_face: Index
    corner_place: Array
    face_start: Index
    corner_start: Index
    step: float
    near: float
    spread: Array
    strangers: NDArray[np.int64]
    firm: Index
    inset: float = 0.0
    edge: Index = np.empty(0, np.intp)
    open: Index = np.empty(0, np.intp)
    opening: Array = np.empty(0)

    @property
    def owner(self) -> Index:
        """Block of every corner."""
        return self.face_block[self.corner_face]

    @property
    def corners_begin(self) -> Index:
        """Where the corners of every face begin, and the end, shape (f + 1,)."""
        return np.searchsorted(self.corner_face, np.arange(len(self.face_block) + 1))

    def placed(self, pose: Pose, block: Index, place: Array) -> Array:
        """Where material points of blocks are in a pose [m], shape (m, 3).

        ``place`` is in the reference pose.
        """
        x = self.assembly.centroids
        return x[block] + pose.shift[block] + turned(pose, block, place - x[block])

    def code(self, corner: Index, face: Index) -> NDArray[np.int64]:
        """One number for a corner at a face."""
        return corner.astype(np.int64) * len(self.face_block) + face

    def pair(self, one: Index, other: Index) -> Index:
        """One number for two blocks, in either order."""
        return np.minimum(one, other) * self.assembly.n_blocks + np.maximum(one, other)

    def apart(self, face: Index, owner: Index) -> Array:
        """By how much faces and corners of other blocks are farther apart than their geometry says [m].

        Parameters
        ----------
        face, owner : number of the face, and of the block whose corner it is, shape (m,)
        """
        if not len(self.open):
            return np.zeros(len(face))
        pair = self.pair(self.face_block[face], owner)
        row = np.minimum(np.searchsorted(self.open, pair), len(self.open) - 1)
        return np.where(self.open[row] == pair, self.opening[row], 0.0)

    def with_openings(self, c: PathContacts) -> "Shapes":
        """With the joints that are open in the reference pose."""
        gap = np.einsum("mi,mi->m", c.directions[:, 0], c.place_b - c.place_a)
        pair, of = np.unique(self.pair(c.block_a, c.block_b), return_inverse=True)
        least = np.full(len(pair), np.inf)
        np.minimum.at(least, of, gap)
        rows = least > 0.0
        return self._replace(open=pair[rows], opening=least[rows])


def shapes_of(
    assembly: Assembly, contacts: PathContacts, plane: Plane | None, size: float, firm: Index
) -> tuple[Shapes, PathContacts]:
    """Faces and corners of an assembly, and the contacts with their corners named and the frame carried by the face.

    Parameters
    ----------
    contacts : of the reference pose
    plane : of a problem in plane, whose faces are then lines; None in space
    size : median block size [m]
    firm : ranks of the blocks
    """
    outlines = _outlines(assembly, contacts, plane)
    inset = _inset(assembly, contacts, outlines, plane)
    block: list[int] = []
    place, normal, side, reach, owner, corner = ([] for _ in range(6))
    width = max((len(p) for _, p, _ in outlines), default=2)
    for b, points, n in outlines:
        if plane is not None:
            along = points[1] - points[0]
            length = float(np.linalg.norm(along))
            if length <= 2.0 * inset:
                continue
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
    blocks = np.arange(assembly.n_blocks + 1)
    away = np.linalg.norm(corner_place - assembly.centroids[face_block[corner_face]], axis=1)
    spread = np.zeros(assembly.n_blocks)
    np.maximum.at(spread, face_block[corner_face], away)
    shapes = Shapes(
        assembly, face_block, np.array(place), np.array(normal), np.array(side), np.array(reach), corner_face,
        corner_place, np.searchsorted(face_block, blocks), np.searchsorted(face_block[corner_face], blocks),
        OVERSHOOT * size, NEAR * size, spread, np.empty(0, np.int64), firm, inset,
    )
    near = together(shapes, at_rest(assembly.n_blocks), -shapes.near)
    named = _named(shapes, contacts, near)
    known, code = shapes.code(named.corner, named.face), shapes.code(near.corner, near.face)
    # what lies together without being a point belongs to a joint of the model, or to none by its user's will
    return shapes._replace(strangers=_strangers(shapes, named, near, np.setdiff1d(code, known))), named


class Near(NamedTuple):
    """Corners at faces: numbers of both, gap [m], and the least distance inside a side [m].

    ``owner`` is the block of the corner and ``place`` where it is in the reference pose [m]; places where sides cross
    have a number beyond those of all corners, see :mod:`limitmason.capacity.contact_search.crossing`.
    """

    corner: Index
    face: Index
    gap: Array
    inside: Array
    owner: Index
    place: Array

    def at(self, rows: Index | Flags) -> "Near":
        """Some of them."""
        return Near(
            self.corner[rows], self.face[rows], self.gap[rows], self.inside[rows], self.owner[rows], self.place[rows]
        )

    def with_rows(self, other: "Near") -> "Near":
        """These and others behind them."""
        return Near(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


def _outlines(assembly: Assembly, contacts: PathContacts, plane: Plane | None) -> list[tuple[int, Array, Array]]:
    """Block, corners and outward normal of every face, blocks in order.

    In plane the corners are the two ends of a line.
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
                if abs(n @ plane.normal) > 1e-6:
                    continue
                along = np.cross(plane.normal, n)
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
    outlines : block, corners [m], shape (k, 3), and outward normal of every face
    """
    if plane is None:
        return 0.0
    found = []
    faces: dict[int, list[tuple[Array, Array]]] = {}
    for b, points, n in outlines:
        faces.setdefault(b, []).append((points, n))
    # the first and the last point of every joint stand at its ends
    first = np.flatnonzero(np.diff(contacts.interface, prepend=-2))
    last = np.append(first[1:], contacts.count) - 1
    for i in np.concatenate([first, last]):
        nearest = []
        for block, sign in ((contacts.block_a[i], 1.0), (contacts.block_b[i], -1.0)):
            n = sign * contacts.directions[i, 0]
            for points, normal in faces.get(int(block), []):
                off = abs((contacts.place_b[i] - points[0]) @ normal)
                if normal @ n > 1.0 - 1e-6 and off < 1e-3 * np.linalg.norm(points[1] - points[0]):
                    nearest.append(float(np.linalg.norm(points - contacts.place_b[i], axis=1).min()))
        if nearest:
            found.append(min(nearest))
    inset = float(np.median(found)) if found else 0.0
    return inset if inset > 10.0 * assembly.tolerance else 0.0


def _named(shapes: Shapes, c: PathContacts, near: Near) -> PathContacts:
    """The contacts with their corners and faces, the frame carried by the face.

    ``near`` is what lies together in the reference pose.

    Where two corners meet the frame stays with the block that has it. Where a joint ends at an edge its corners lie on
    the faces beyond it too: they belong to those that look along its normal.
    """
    owner, normal = shapes.owner, shapes.normal
    by_pair: dict[tuple[int, int], list[int]] = {}
    for row in range(len(near.corner)):
        key = int(shapes.face_block[near.face[row]]), int(owner[near.corner[row]])
        by_pair.setdefault(key, []).append(row)
    corner, face, over = c.corner.copy(), c.face.copy(), np.zeros(c.count, bool)
    reachable = 1e-2 * shapes.near + 1e-9
    for i in range(c.count):
        a, b = int(c.block_a[i]), int(c.block_b[i])
        best: dict[bool, int] = {}
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
        over[i] = flipped
        corner[i], face[i] = near.corner[best[flipped]], near.face[best[flipped]]
    return replace(turned_over(c, over), corner=corner, face=face)


def with_faces(shapes: Shapes, c: PathContacts) -> PathContacts:
    """Name the face on which points lie that are neither a corner nor a crossing."""
    face, rest = c.face.copy(), at_rest(shapes.assembly.n_blocks)
    for i in np.flatnonzero(face < 0):
        mine = np.arange(shapes.face_start[c.block_a[i]], shapes.face_start[c.block_a[i] + 1])
        one = np.full(len(mine), i)
        gap, inside = beside(shapes, rest, c.place_b[one], c.block_b[one], mine)
        along = shapes.normal[mine] @ c.directions[i, 0] > ALONG
        lies = (np.abs(gap) < shapes.near) & (inside > -shapes.step) & along
        if lies.any():
            face[i] = mine[np.where(lies, np.abs(gap), np.inf).argmin()]
    return replace(c, face=face)


def _strangers(shapes: Shapes, c: PathContacts, near: Near, codes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs of corner and face that meet in the reference pose and are no contacts.

    They must not become contacts later. Those are pairs of blocks without a joint, and corners deep inside a face where
    the model has no point. What is left is the second of two corners that meet, which takes over once they slide.

    Parameters
    ----------
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


def together(shapes: Shapes, pose: Pose, inside: float, depth: float = 0.0) -> Near:
    """Corners within the near gap of faces of other blocks in a pose and at least so far inside their sides [m].

    Parameters
    ----------
    depth : by which corners may lie behind a face beyond the near gap, as the springs of soft joints let them [m]
    """
    one, two = near_blocks(shapes, pose, depth)
    own, face = facing(shapes, pose, np.concatenate([one, two]), np.concatenate([two, one]))
    start = shapes.corners_begin
    count = np.diff(start)[own]
    corner = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - start[own], count)
    face = np.repeat(face, count)
    gap, sides = beside(shapes, pose, shapes.corner_place[corner], shapes.owner[corner], face)
    use = (gap < shapes.near) & (gap > -shapes.near - depth) & (sides > inside)
    corner = corner[use]
    return Near(corner, face[use], gap[use], sides[use], shapes.owner[corner], shapes.corner_place[corner])


def facing(shapes: Shapes, pose: Pose, one: Index, two: Index) -> tuple[Index, Index]:
    """Faces of blocks ``one`` and of blocks ``two`` that look at each other, pair by pair."""
    f, g = products(shapes.face_start, one, shapes.face_start, two)
    normal = turned(pose, shapes.face_block, shapes.normal)
    looks = np.einsum("ij,ij->i", normal[f], normal[g]) < FACING
    return f[looks], g[looks]


def near_blocks(shapes: Shapes, pose: Pose, depth: float = 0.0) -> tuple[Index, Index]:
    """Pairs of blocks that may touch in a pose, not both held.

    ``depth`` as in :func:`together`.
    """
    fixed, x = shapes.assembly.fixed, shapes.assembly.centroids + pose.shift
    reach = shapes.spread + shapes.near + depth
    one, two = overlapping_pairs(x - reach[:, None], x + reach[:, None])
    near = np.linalg.norm(x[one] - x[two], axis=1) < shapes.spread[one] + shapes.spread[two] + shapes.near + depth
    near &= ~(fixed[one] & fixed[two])
    return one[near], two[near]


def products(first: Index, of: Index, second: Index, on: Index) -> tuple[Index, Index]:
    """All pairs of a thing of one block and a thing of another, for many pairs of blocks at once.

    Things are corners or faces, say; they stand in a row, block after block.

    Parameters
    ----------
    first, second : where the things of each block begin in their row, and the end: corners, say, and faces; (n + 1,)
    of, on : blocks of the pairs, shape (p,)
    first, second : row in which the things of every block begin, and the end, shape (n + 1,)
    of, on : the two blocks of every pair, shape (p,)

    Returns
    -------
    tuple
        Numbers in the first and in the second row: every thing of of[0] with every thing of on[0], then of the next.
    one, other : rows of the two things of every pair: those of of[0] and on[0] first
    """
    nc, nf = np.diff(first)[of], np.diff(second)[on]
    total = nc * nf
    # pair of blocks, and number within it, of every pair of things: one * nf + other
    pair = np.repeat(np.arange(len(of)), total)
    k = np.arange(total.sum()) - np.repeat(np.cumsum(total) - total, total)
    return first[of][pair] + k // np.maximum(nf[pair], 1), second[on][pair] + k % np.maximum(nf[pair], 1)


def turned(pose: Pose, block: Index, vector: Array) -> Array:
    """Vectors of blocks, turned with them, shape (m, 3)."""
    return vector + np.einsum("mij,mj->mi", pose.turn[block], vector)


def beside(shapes: Shapes, pose: Pose, place: Array, owner: Index, face: Index) -> tuple[Array, Array]:
    """Gap of points of blocks ``owner`` above faces in a pose, and the least distance inside their sides [m].

    Parameters
    ----------
    place : of the points in the reference pose [m], shape (m, 3)
    face : number of the face of every point, shape (m,)
    owner : block of every point, shape (m,)
    """
    x, base = shapes.assembly.centroids, shapes.face_block[face]
    local = shapes.placed(pose, owner, place) - x[base] - pose.shift[base]
    local = x[base] + local + np.einsum("mji,mj->mi", pose.turn[base], local)
    gap = ((local - shapes.face_place[face]) * shapes.normal[face]).sum(axis=1)
    sides = np.einsum("mki,mi->mk", shapes.side[face], local) - shapes.reach[face]
    return gap, sides.min(axis=1)
