"""How pairs of pieces meet now: on which faces, over what area, and on faces that go on from their neighbours'."""

import numpy as np

from dem import kernels
from dem.contact.internal_edges import FLAT, Bearings
from dem.kernels import APART, Joints
from dem.kernels.arrays import Index
from dem.model.pieces import Pieces
from limitmason.arrays import Array, Flags
from limitmason.model import Assembly


class PiecesMeet:
    """How pairs of pieces meet, row by row: see ``kernels.contact_shapes``."""

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
            corners, x.n_corners, x.faces, x.size, x.n_faces, x.edges, x.n_edges, np.zeros((*x.size.shape, 4))
        )
        some = np.arange(len(corners)) if blocks is None else np.flatnonzero(blocks[pieces.owner])
        kernels.face_planes(self.arrays, some)
        self.now = kernels.Meetings(
            np.zeros(m, dtype=np.int64), np.zeros(m), np.zeros(m), np.zeros((m, kernels.MOST, 3)),
            np.zeros(m, dtype=np.int64), np.zeros((m, 4)), np.zeros((m, 5, 3)), np.zeros(m, dtype=bool),
        )
        self._look(np.arange(m), np.full(m, -1))

    def meet_on(self, rows: Index, piece: Index, face: Index) -> None:
        """Take faces of pieces as the bases of rows, whatever the least overlap."""
        asked = np.full(len(self.pairs), -1)
        asked[rows], self.now.base_first[rows] = face, piece == self.pairs[rows, 0]
        self._look(rows, asked)

    def _look(self, rows: Index, face: Index) -> None:
        kernels.contact_shapes(self.arrays, self.pairs, rows, self.margin, FLAT, self.now, face)


def least_area(assembly: Assembly) -> float:
    """Area up to which two faces do not touch [m2]."""
    return 1e-8 * float(assembly.volumes.min()) ** (2.0 / 3.0)


def area_of(shape: kernels.Meetings) -> Array:
    """Area of the polygons in which faces meet, as flat as they come [m2], shape (m,)."""
    out = np.zeros(len(shape.kind))
    for n in np.unique(shape.corners[shape.corners > 2]):
        rows = np.flatnonzero(shape.corners == n)
        x = shape.polygon[rows, :n] - shape.polygon[rows, :1]
        out[rows] = 0.5 * np.abs(np.einsum("mki,mi->m", np.cross(x, np.roll(x, -1, axis=1)), shape.plane[rows, :3]))
    return out


def on_faces_that_go_on(met: PiecesMeet, joints: Joints, bearings: Bearings, n_blocks: int) -> dict[int, int]:
    """Let pairs that overlap little along two axes meet on the face that goes on beside them.

    The corner between two blocks of a course is no edge for the block that slides over both. Returned is, for the rows
    of pairs that do, the joint beside each.
    """
    shape, owner = met.now, met.pieces.owner
    rows = np.flatnonzero((shape.kind != APART) & (shape.beside > -met.margin))
    if not len(rows) or not len(bearings.row):
        return {}
    found, parts = np.empty((len(rows), 4), dtype=np.int64), np.searchsorted(owner, np.arange(n_blocks + 1))
    by = bearings.carrying(joints, n_blocks)
    kernels.faces_that_go_on(met.arrays, owner, parts, by, met.pairs, rows, shape, found)
    on = found[:, 0] >= 0
    met.meet_on(rows[on], found[on, 1], found[on, 2])
    beside = on & (found[:, 3] == 0)
    return dict(zip(rows[beside].tolist(), bearings.row[found[beside, 0]].tolist(), strict=True))
