"""On which face pieces meet, where it goes on from what carries the other."""

from typing import NamedTuple

import numpy as np

from dem.kernels.arrays import Array, Index
from dem.kernels.compiled import kernel
from dem.kernels.contact_geometry import CROSSING
from dem.kernels.pieces import Meetings, PieceArrays

TURNED = np.cos(np.deg2rad(3.0))
"""Cosine of the angle up to which two faces lie in one plane [-]."""

LEVEL = 3.0
"""Step between two faces, over the depth to which joints beside them are pressed, that is theirs and not built [-]."""

SAG = 10.0
"""Depth of a face beyond the edge of what carries it, over the depth to which that is pressed, that is elastic [-]."""


class Carrying(NamedTuple):
    """Joints between faces that carry now, and where each block's stand among them."""

    ends: Index  # blocks a and b, (k, 2)
    normal: Array  # from a to b, (k, 3)
    place: Array  # centre of pressure [m], (k, 3)
    depth: Array  # to which they are pressed [m], (k,)
    of_block: Index  # their numbers, block after block, those of a block in their order, (2 k,)
    start: Index  # where those of a block begin, (n + 1,)


@kernel(fast=False, forceinline=True)
def _faces_along(planes: Array, piece: int, face: int, n: Array, sign: float) -> bool:
    """Whether a face of a piece looks along the unit vector n times a sign of +-1."""
    x = planes[piece, face, 0] * n[0] + planes[piece, face, 1] * n[1] + planes[piece, face, 2] * n[2]
    return sign * x > TURNED


@kernel(fast=False, forceinline=True)
def _height(plane: Array, place: Array, n: Array, sign: float) -> float:
    """Height [m] of a plane above a place, along sign n.

    ``plane`` is its unit normal and offset [m], shape (4,); ``place`` in global axes [m] and the unit normal n have
    shape (3,).
    """
    below = plane[3] - (plane[0] * place[0] + plane[1] * place[1] + plane[2] * place[2])
    return below / (sign * (plane[0] * n[0] + plane[1] * n[1] + plane[2] * n[2]))


@kernel(fast=False)
def _step(pieces: PieceArrays, parts: Index, carrier: int, k: int, by: Carrying, sign: float, plane: Array,
          place: Array) -> float:
    """How much higher a plane lies at a place than the carrier's face [m].

    The carrier's face is the nearest to the joint's centre of pressure; infinite where it has none that looks that way.

    Parameters
    ----------
    pieces : all pieces in their present position
    parts : first piece of every block, shape (n + 1,)
    carrier : number of the block
    k : the joint at which it carries, number in ``by``
    by : joints that carry
    sign : 1 where that joint's normal leaves the carrier, else -1
    plane : unit normal and offset of the plane [m], shape (4,)
    place : where the height is taken, global axes [m], shape (3,)
    """
    nearest, height, n, at = np.inf, -np.inf, by.normal[k], by.place[k]
    for piece in range(parts[carrier], parts[carrier + 1]):
        for face in range(pieces.n_faces[piece]):
            if _faces_along(pieces.planes, piece, face, n, sign):
                own = pieces.planes[piece, face]
                off = abs(own[0] * at[0] + own[1] * at[1] + own[2] * at[2] - own[3])
                if off < nearest:
                    nearest, height = off, _height(own, place, n, sign)
    return _height(plane, place, n, sign) - height


@kernel(fast=False)
def _deepest(by: Carrying, n: Array, borne: int, other: int, carrier: int) -> float:
    """Largest depth [m] of joints of three blocks that look along n or against it.

    Parameters
    ----------
    by : joints that carry
    n : unit normal, shape (3,)
    borne, other, carrier : numbers of the three blocks
    """
    deep = 0.0
    for block in (borne, other, carrier):
        for i in range(by.start[block], by.start[block + 1]):
            k = by.of_block[i]
            x = by.normal[k, 0] * n[0] + by.normal[k, 1] * n[1] + by.normal[k, 2] * n[2]
            if abs(x) > TURNED:
                deep = max(deep, by.depth[k])
    return deep


@kernel(fast=False)
def _goes_on(
    pieces: PieceArrays, owner: Index, parts: Index, by: Carrying, p: int, q: int, place: Array, found: Index
) -> None:
    """Face on which pieces p and q meet, see :func:`faces_that_go_on`, to ``found``.

    At every joint of the two blocks one block is borne by another, the carrier. A face of the other piece goes on from
    the carrier's if it looks the same way and stands no higher than springs are pressed. Of several that with
    the widest gap counts. Without one it is the face on which the two blocks bear each other now.

    Parameters
    ----------
    pieces : all pieces in their present position
    owner : block of every piece, shape (p,)
    parts : first piece of every block, shape (n + 1,)
    by : joints that carry
    p, q : numbers of the two pieces
    place : where the pieces meet, global axes [m], shape (3,)
    found : joint, piece with the face, face, and 1 where it is the pair's own joint, written; -1 first where there is
        none, shape (4,)
    """
    found[0] = -1
    apart, widest = False, -np.inf  # of the best face so far: whether a third block bears it, and its gap [m]
    one, two = owner[p], owner[q]
    i, i_end, j, j_end = by.start[one], by.start[one + 1], by.start[two], by.start[two + 1]
    while i < i_end or j < j_end:
        # the joints of both blocks in their order; one between them is in both lists
        left = by.of_block[i] if i < i_end else len(by.depth)
        right = by.of_block[j] if j < j_end else len(by.depth)
        k = min(left, right)
        i, j = i + (left == k), j + (right == k)
        a, b = by.ends[k, 0], by.ends[k, 1]
        own = (a == one and b == two) or (a == two and b == one)
        for here in range(2):  # either block of the pair may be the one that is borne
            borne, other = (one, two) if here == 0 else (two, one)
            # the joint's plane is carried by a: the pair's own joint bears b on a's face, never the other way round
            if (borne != a and borne != b) or (own and borne != b):
                continue
            carrier = b if borne == a else a
            sign, n = (1.0 if borne == b else -1.0), by.normal[k]  # sign n leads from the carrier to what it bears
            piece, mine = (q, p) if here == 0 else (p, q)  # the piece with the face, and the one that is borne
            for face in range(pieces.n_faces[piece]):
                if not _faces_along(pieces.planes, piece, face, n, sign):
                    continue
                plane, gap = pieces.planes[piece, face], np.inf  # gap: height of the lowest corner above the face
                for c in range(pieces.n_corners[mine]):
                    x = pieces.corners[mine, c]
                    gap = min(gap, plane[0] * x[0] + plane[1] * x[1] + plane[2] * x[2])
                gap -= plane[3]
                # a face borne by a third block goes before the pair's own joint; of either kind the widest gap counts
                if gap < -SAG * by.depth[k] or (own and apart) or (own != apart and gap <= widest):
                    continue
                if not own:
                    # a face that stands higher than springs beside it give is a step that was built, and is met as such
                    step = _step(pieces, parts, carrier, k, by, sign, plane, place)
                    if step > LEVEL * _deepest(by, n, borne, other, carrier):
                        continue
                apart, widest = not own, gap
                found[0], found[1], found[2], found[3] = k, piece, face, own


@kernel(fast=False, counted=True)
def faces_that_go_on(
    pieces: PieceArrays, owner: Index, parts: Index, by: Carrying, pairs: Index, rows: Index, met: Meetings,
    found: Index,
) -> None:
    """Faces on which some pairs of pieces meet whatever their least overlap says.

    Where a block slides over a butt joint onto the next one, the least overlap with this lies along the wrong axis: it
    has sunk into the face below by more than it has slid past the side (the internal edge of collision detection). So a
    face that goes on, in one plane, from the one that bears the block already goes before the least overlap.

    Parameters
    ----------
    pieces : all pieces in their present position
    owner : block of every piece, ascending, shape (p,)
    parts : first piece of every block, shape (n + 1,)
    by : joints that carry
    pairs : numbers of both pieces of every pair, shape (m, 2)
    rows : pairs that are asked for, shape (r,)
    met : how all pairs meet by their least overlap
    found : written, shape (r, 4): number of the joint whose face goes on, -1 where there is none; piece and face that
        are met; 1 where that joint is between the pair itself, else 0
    """
    place = np.empty(3)
    for i in range(len(rows)):
        m = rows[i]
        # where they meet: at an end of the second piece's edge that crosses, or in the middle of the common area
        for r in range(3):
            if met.kind[m] == CROSSING:
                place[r] = met.crossing[m, 2, r]
            else:
                total = 0.0
                for c in range(met.corners[m]):
                    total += met.polygon[m, c, r]
                place[r] = total / met.corners[m]
        _goes_on(pieces, owner, parts, by, pairs[m, 0], pairs[m, 1], place, found[i])
