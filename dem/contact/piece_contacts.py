"""How pairs of pieces meet now: faces, areas, and faces that go on from others.

A block has sunk into the face that carries it by N / (kn A). Where that face ends and the next block's begins in the
same plane, the block overlaps the next one by that depth and, at first, by less along the way it slides: the least
overlap is against the side (the "internal edge" of collision detection in games). Against the *face that carries it*
the next face is no higher, so it is the one that is met.
"""

from typing import NamedTuple

import numpy as np

from dem import kernels
from dem.kernels import APART, LAW, Carrying, Joints
from dem.kernels.arrays import Index
from dem.model.pieces import Pieces
from dem.model.state import PointForces, State
from limitmason.arrays import Array, Flags
from limitmason.model import Assembly

FLAT = np.cos(np.deg2rad(5.0))
"""Cosine of the angle up to which two faces lie on each other, and their contact is an area; chosen."""

NOTHING = 1e-8
"""Area up to which two faces do not touch, over that of a face of the smallest block as a cube; chosen [-]."""

WITH = 0.5
"""Slip from which a joint has slipped together with another on its face, over that one's slip; chosen [-]."""


class Bearings(NamedTuple):
    """Joints between faces that carry now, c of them."""

    row: Index  # numbers of the joints, (c,)
    normal: Array  # unit, from block a to block b, global axes, (c, 3)
    place: Array  # centre of pressure [m], (c, 3)
    depth: Array  # to which the deepest point is pressed [m], (c,)

    @classmethod
    def of(cls, state: State, now: PointForces, rot: Array, flat: Flags) -> "Bearings":
        """Joints of a state that press: normals, centres of pressure and depths [m].

        Parameters
        ----------
        state, now : joints and points, and what these measure
        rot : rotation matrices of the blocks, shape (n, 3, 3)
        flat : joints between faces that have not turned, which alone count, shape (k,)
        """
        joints, count = state.joints, len(state.joints.block_a)
        # normals R_a n of the joints now, and the pressure of every point along its own [N]
        normal = np.einsum("kij,kj->ki", rot[joints.block_a], joints.frame[:, 2])
        push = np.maximum(np.einsum("mi,mi->m", now.force, normal[now.owner]), 0.0)
        total = np.bincount(now.owner, push, count)
        # of the points of a joint that which is pressed deepest, by N / (k A)
        deep = np.zeros(count)
        np.maximum.at(deep, now.owner, push / (joints.law[now.owner, LAW.kn] * state.points.area))
        row = np.flatnonzero(flat & (total > 0.0))
        place = np.stack([np.bincount(now.owner, push * x, count) for x in now.position.T], axis=1)
        return cls(row, normal[row], place[row] / total[row, None], deep[row])

    def carrying(self, joints: Joints, n_blocks: int) -> Carrying:
        """These bearings with the blocks of each, and the list of every block's.

        ``joints`` are all joints, of which ``row`` has numbers, and ``n_blocks`` says how many blocks there are.
        """
        ends = np.column_stack([joints.block_a[self.row], joints.block_b[self.row]])
        blocks = np.concatenate(ends.T)
        # every bearing twice, once for each of its blocks; sorted by block they are the lists
        number = np.tile(np.arange(len(self.row)), 2)
        order = np.lexsort((number, blocks))
        start = np.searchsorted(blocks[order], np.arange(n_blocks + 1))
        return Carrying(ends, self.normal, self.place, self.depth, number[order], start)


def moved_together(joints: Joints, bearings: Bearings, worn: Flags, slip: Array, near: float) -> list[tuple[int, int]]:
    """Joints on a face of a block that slipped with an outworn one on that face.

    Cut anew together, what the one loses of the face at the edge is what the other gains.

    Parameters
    ----------
    joints, bearings : all joints, and those that carry
    worn : joints that are to be cut anew, shape (k,)
    slip : largest slip of every joint [m], shape (k,)
    near : distance of two planes up to which they are one [m]

    Returns
    -------
    pairs of numbers of joints: an outworn one, and another on its face
    """
    out: list[tuple[int, int]] = []
    # bearings of every block: entry 2 k + side of the raveled ends is block a (side 0) or b (1) of bearing k
    ends = np.stack([joints.block_a, joints.block_b], axis=1)[bearings.row]
    order = np.argsort(ends.ravel(), kind="stable")
    sorted_ends = ends.ravel()[order]
    for k in np.flatnonzero(worn[bearings.row]).tolist():
        for side in (0, 1):
            # all bearings of the block at this side of bearing k, and which side of each it is
            low, high = np.searchsorted(sorted_ends, (ends[k, side], ends[k, side] + 1))
            at, end = np.divmod(np.sort(order[low:high]), 2)
            # normals towards the shared block: on one face of it are those that look alike and lie in one plane
            towards = np.where(end == 1, 1.0, -1.0)[:, None] * bearings.normal[at]
            mine = (1.0 if side else -1.0) * bearings.normal[k]
            beside = (towards @ mine > FLAT) & (at != k)
            beside &= np.abs((bearings.place[at] - bearings.place[k]) @ mine) < near
            beside &= slip[bearings.row[at]] >= WITH * slip[bearings.row[k]]
            out += [(int(bearings.row[k]), int(r)) for r in bearings.row[at[beside]]]
    return out


class PiecesMeet:
    """How pairs of pieces meet, row by row: see ``kernels.contact_shapes``.

    Attributes
    ----------
    pairs : numbers of both pieces of every pair, shape (m, 2)
    arrays : all pieces where they stand, as the kernels see them
    now : how every pair meets
    """

    def __init__(
        self, corners: Array, pieces: Pieces, pairs: Index, margin: float, blocks: Flags | None = None
    ) -> None:
        """See how pairs of convex pieces meet in a position.

        Parameters
        ----------
        corners : of all pieces [m], padded, shape (p, v, 3)
        pairs : numbers of two pieces, shape (m, 2)
        margin : gap up to which they count as near [m]
        blocks : blocks whose face planes are needed, shape (n,); None is all
        """
        m, x = len(pairs), pieces
        self.pieces, self.margin, self.pairs = pieces, margin, np.ascontiguousarray(pairs)
        self.arrays = kernels.PieceArrays(
            corners=corners, n_corners=x.n_corners, faces=x.faces, size=x.size, n_faces=x.n_faces, edges=x.edges,
            n_edges=x.n_edges, planes=np.zeros((*x.size.shape, 4)),
        )
        some = np.arange(len(corners)) if blocks is None else np.flatnonzero(blocks[pieces.owner])
        kernels.face_planes(self.arrays, some)
        self.now = kernels.Meetings(
            kind=np.zeros(m, dtype=np.int64), gap=np.zeros(m), beside=np.zeros(m),
            polygon=np.zeros((m, kernels.MOST, 3)), corners=np.zeros(m, dtype=np.int64), plane=np.zeros((m, 4)),
            crossing=np.zeros((m, 5, 3)), base_first=np.zeros(m, dtype=bool),
        )
        no_face_asked = np.full(m, -1)
        self._look(np.arange(m), no_face_asked)

    def meet_on(self, rows: Index, piece: Index, face: Index) -> None:
        """Take faces of pieces as the bases of some pairs, whatever the least overlap.

        Parameters
        ----------
        rows : the pairs, shape (r,)
        piece, face : numbers of the piece, one of the pair, and of its face, shape (r,)
        """
        asked = np.full(len(self.pairs), -1)
        asked[rows], self.now.base_first[rows] = face, piece == self.pairs[rows, 0]
        self._look(rows, asked)

    def _look(self, rows: Index, face: Index) -> None:
        """See how the pairs ``rows`` meet.

        ``face`` is the face of the base that is asked for of every pair, or -1, shape (m,).
        """
        kernels.contact_shapes(self.arrays, self.pairs, rows, self.margin, FLAT, self.now, face)


def least_area(assembly: Assembly) -> float:
    """Area up to which two faces do not touch [m2]."""
    return NOTHING * float(assembly.volumes.min()) ** (2.0 / 3.0)


def area_of(shape: kernels.Meetings) -> Array:
    """Area of the polygons in which pairs of pieces meet [m2], shape (m,).

    It is seen along the normal of the base, and 0 without a polygon. ``shape`` says how the pairs meet.
    """
    out = np.zeros(len(shape.kind))
    for n in np.unique(shape.corners[shape.corners > 2]):  # polygons of as many corners together
        rows = np.flatnonzero(shape.corners == n)
        x = shape.polygon[rows, :n] - shape.polygon[rows, :1]
        out[rows] = 0.5 * np.abs(np.einsum("mki,mi->m", np.cross(x, np.roll(x, -1, axis=1)), shape.plane[rows, :3]))
    return out


def on_next_faces(met: PiecesMeet, joints: Joints, bearings: Bearings, n_blocks: int) -> dict[int, int]:
    """Let pairs meet on a face that goes on from the one that carries a block.

    Asked are pairs that overlap little along a second axis too, so that the least overlap may lie along the wrong one.
    The corner between two blocks of a course is no edge for the block that slides over both.

    Parameters
    ----------
    met : the pairs, changed where they now meet on such a face
    joints : all joints
    bearings : which of them carry
    n_blocks : how many blocks there are

    Returns
    -------
    number of the joint with a third block on whose face a pair now meets, by row of the pair
    """
    shape, owner = met.now, met.pieces.owner
    rows = np.flatnonzero((shape.kind != APART) & (shape.beside > -met.margin))
    if not len(rows) or not len(bearings.row):
        return {}
    found, parts = np.empty((len(rows), 4), dtype=np.int64), np.searchsorted(owner, np.arange(n_blocks + 1))
    by = bearings.carrying(joints, n_blocks)
    kernels.faces_that_go_on(met.arrays, owner, parts, by, met.pairs, rows, shape, found)
    bearing, piece, face, own = found.T
    on = bearing >= 0
    met.meet_on(rows[on], piece[on], face[on])
    beside = on & (own == 0)
    return dict(zip(rows[beside].tolist(), bearings.row[bearing[beside]].tolist(), strict=True))
