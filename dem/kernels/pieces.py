"""Convex pieces of blocks now: corners, boxes, planes, motion since the last look."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.kernels.arrays import Array, Index
from dem.kernels.compiled import kernel


class PieceArrays(NamedTuple):
    """Convex pieces in their present position, padded to the largest piece and face."""

    corners: Array  # [m], (p, v, 3)
    n_corners: Index  # numbers in use, (p,)
    faces: Index  # corners of every face, (p, f, k)
    size: Index  # how many corners a face has, (p, f)
    n_faces: Index  # (p,)
    edges: Index  # both corners and both faces of every edge, (p, e, 4)
    n_edges: Index  # (p,)
    planes: Array  # outward normal and offset [m] of every face, see ``face_planes``, (p, f, 4)


class Meetings(NamedTuple):
    """How pairs of pieces meet; all of it is written."""

    kind: Index  # APART, FACES, CORNER or CROSSING, (m,)
    gap: Array  # along the axis, negative where the pieces overlap [m], (m,)
    beside: Array  # widest gap along the normals of faces that leave the axis [m], (m,)
    polygon: Array  # where faces meet, on the other piece's face [m], (m, 32, 3)
    corners: Index  # of the polygon, (m,)
    plane: Array  # where faces meet, unit normal away from the base and offset [m], (m, 4)
    crossing: Array  # where edges cross, see ``_widest_crossing``, first piece first, (m, 5, 3)
    base_first: NDArray[np.bool_]  # whether the first piece is the base; given where a face is asked for, (m,)


class NearPairs(NamedTuple):
    """Pairs of pieces whose boxes overlap, and how they lay at the last look."""

    pairs: Index  # pieces, sorted, (m, 2)
    blocks: Index  # the one that reaches farther from its centroid first, (m, 2)
    low: Array  # boxes of all pieces as they were, from the ground, with a skin: least coordinates [m], (p, 3)
    high: Array  # and largest ones [m], (p, 3)
    offset: Array  # of the second block's centroid from the first, in the axes of the first [m], (m, 3)
    turn: Array  # of the second block against the first, quaternion, (m, 4)
    move: Array  # motion against each other up to which they need not be looked at [m], (m,)
    angle: Array  # and turn [rad], (m,)


@kernel(fast=False)
def place_pieces(owner: Index, local: Array, rot: Array, place: Array, corners: Array, low: Array, high: Array) -> None:
    """Write corners and boxes of all pieces in a position.

    Parameters
    ----------
    owner : block of each piece, shape (p,)
    local : its corners from that block's centroid, reference axes [m], shape (p, v, 3)
    rot : R - I of every block, shape (n, 3, 3)
    place : centroid of every block now [m], shape (n, 3)
    corners : of every piece in global axes [m], written, shape (p, v, 3)
    low, high : least and largest coordinates of its corners [m], written, shape (p, 3)
    """
    for i in range(len(owner)):
        b = owner[i]
        for r in range(3):
            low[i, r], high[i, r] = 1e300, -1e300
        for k in range(local.shape[1]):
            for r in range(3):
                x = place[b, r] + local[i, k, r]
                for c in range(3):
                    x += rot[b, r, c] * local[i, k, c]
                corners[i, k, r] = x
                low[i, r], high[i, r] = min(low[i, r], x), max(high[i, r], x)


@kernel(fast=False)
def relative_motion(
    near: NearPairs, quat: Array, rot: Array, place: Array, reach: Array, offset: Array, turn: Array, moved: Array,
    turned: Array,
) -> None:
    """How the blocks of every pair lie now, and have moved since the last look.

    Parameters
    ----------
    near : the pairs, and how their blocks lay when they were looked at
    quat : rotation of every block as a unit quaternion, scalar first, shape (n, 4)
    rot : the same as a matrix less one, shape (n, 3, 3)
    place : centroid of every block now [m], shape (n, 3)
    reach : radius of the block about it [m], shape (n,)
    offset : centroid of the second block from that of the first, in the first's axes [m], written, shape (m, 3)
    turn : rotation of the second against the first, quaternion, written, shape (m, 4)
    moved : bound of the travel of any point of the second since, seen from the first [m], written, shape (m,)
    turned : angle by which the second has turned since, seen from the first [rad], written, shape (m,)
    """
    for m in range(len(near.blocks)):
        a, b = near.blocks[m, 0], near.blocks[m, 1]
        far = 0.0  # squared change of the offset, in the axes of the first
        for r in range(3):
            x = place[b, r] - place[a, r]
            for c in range(3):
                x += rot[a, c, r] * (place[b, c] - place[a, c])
            offset[m, r] = x
            far += (x - near.offset[m, r]) ** 2
        a0, a1, a2, a3 = quat[a, 0], quat[a, 1], quat[a, 2], quat[a, 3]
        b0, b1, b2, b3 = quat[b, 0], quat[b, 1], quat[b, 2], quat[b, 3]
        # turn of b against a: conjugate of q_a times q_b
        h0, h1 = a0 * b0 + a1 * b1 + a2 * b2 + a3 * b3, a0 * b1 - a1 * b0 - (a2 * b3 - a3 * b2)
        h2, h3 = a0 * b2 - a2 * b0 - (a3 * b1 - a1 * b3), a0 * b3 - a3 * b0 - (a1 * b2 - a2 * b1)
        turn[m, 0], turn[m, 1], turn[m, 2], turn[m, 3] = h0, h1, h2, h3
        k0, k1, k2, k3 = near.turn[m, 0], near.turn[m, 1], near.turn[m, 2], near.turn[m, 3]
        # and since then: conjugate of that turn times this one, whose vector part is as long as sin(angle / 2)
        y1 = k0 * h1 - k1 * h0 - (k2 * h3 - k3 * h2)
        y2 = k0 * h2 - k2 * h0 - (k3 * h1 - k1 * h3)
        y3 = k0 * h3 - k3 * h0 - (k1 * h2 - k2 * h1)
        turned[m] = 2.0 * np.arcsin(min(np.sqrt(y1 * y1 + y2 * y2 + y3 * y3), 1.0))
        moved[m] = np.sqrt(far) + turned[m] * reach[b]


@kernel(fast=False)
def face_planes(pieces: PieceArrays, some: Index) -> None:
    """Write planes of all faces of the pieces ``some``, (k,), to ``pieces.planes``."""
    for i in some:
        for f in range(pieces.n_faces[i]):
            _plane_of(pieces.corners, pieces.faces, pieces.size, i, f, pieces.planes[i, f])


@kernel(fast=False)
def _plane_of(corners: Array, faces: Index, size: Index, p: int, f: int, out: Array) -> None:
    """Plane of face f of piece p: outward normal and offset [m], to ``out`` (4).

    The unit normal is by Newell's sums.

    ``corners``, ``faces`` and ``size`` are those of :class:`PieceArrays`.
    """
    n0 = n1 = n2 = c0 = c1 = c2 = 0.0  # normal, not of unit length, and sum of the corners
    m = size[p, f]
    for k in range(m):
        u, v = faces[p, f, k], faces[p, f, (k + 1) % m]
        x0, x1, x2 = corners[p, u, 0], corners[p, u, 1], corners[p, u, 2]
        y0, y1, y2 = corners[p, v, 0], corners[p, v, 1], corners[p, v, 2]
        n0 += (x1 - y1) * (x2 + y2)
        n1 += (x2 - y2) * (x0 + y0)
        n2 += (x0 - y0) * (x1 + y1)
        c0 += x0
        c1 += x1
        c2 += x2
    r = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    out[0], out[1], out[2] = n0 * r, n1 * r, n2 * r
    out[3] = (out[0] * c0 + out[1] * c1 + out[2] * c2) / m
