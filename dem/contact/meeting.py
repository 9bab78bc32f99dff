"""How pairs of pieces meet now: on which faces, over what area, and on faces that go on from their neighbours'."""

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.contact.internal_edges import FLAT, Bearings, Poses, goes_on
from dem.contact.near import Pieces
from dem.kernels import APART, CROSSING, Joints
from dem.kernels.arrays import Index
from limitmason.arrays import Array, Flags
from limitmason.model import Assembly


class PiecesMeet:
    """How pairs of pieces meet, row by row: see ``kernels.contact_shapes``."""

    def __init__(
        self, corners: Array, pieces: Pieces, pairs: Index, margin: float, blocks: Flags | None = None
    ) -> None:
        m = len(pairs)
        self.pieces, self.margin, self.pairs = pieces, margin, np.ascontiguousarray(pairs)
        self.poses = Poses(pieces.owner, corners, np.zeros((*pieces.size.shape, 4)))
        some = np.arange(len(corners)) if blocks is None else np.flatnonzero(blocks[pieces.owner])
        kernels.face_planes(self._arrays, some)
        self.now = kernels.Meetings(
            np.zeros(m, dtype=np.int64), np.zeros(m), np.zeros(m), np.zeros((m, kernels.MOST, 3)),
            np.zeros(m, dtype=np.int64), np.zeros((m, 4)), np.zeros((m, 5, 3)), np.zeros(m, dtype=bool),
        )  # fmt: skip
        self._look(slice(None), np.full(m, -1))

    def meet_on(self, row: int, piece: int, face: int) -> None:
        """Take a face of a piece as the base of a row, whatever the least overlap."""
        self.now.base_first[row] = piece == self.pairs[row, 0]
        self._look(slice(row, row + 1), np.array([face]))

    @property
    def _arrays(self) -> kernels.PieceArrays:
        x = self.pieces
        return kernels.PieceArrays(
            self.poses.corners, x.n_corners, x.faces, x.size, x.n_faces, x.edges, x.n_edges, self.poses.planes
        )

    def _look(self, rows: slice, face: NDArray[np.int64]) -> None:
        now = kernels.Meetings._make(v[rows] for v in self.now)
        kernels.contact_shapes(self._arrays, self.pairs[rows], self.margin, FLAT, now, face)


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
    """Let pairs that overlap little along two axes meet on the face that goes on: rows, and the joint beside each."""
    found: dict[int, int] = {}
    shape = met.now
    rows = np.flatnonzero((shape.kind != APART) & (shape.beside > -met.margin))
    if not len(rows) or not len(bearings.row):
        return found
    ends = np.concatenate([joints.block_a[bearings.row], joints.block_b[bearings.row]])
    order = np.argsort(ends, kind="stable")
    cut = np.searchsorted(ends[order], np.arange(1, n_blocks))
    of_block = np.split(order % len(bearings.row), cut)
    for row in rows:
        outline = shape.polygon[row, : shape.corners[row]]
        place = shape.crossing[row, 2] if shape.kind[row] == CROSSING else outline.mean(axis=0)
        on = goes_on(met.poses, joints, bearings, of_block, (met.pairs[row, 0], met.pairs[row, 1]), place)
        if on is not None:
            met.meet_on(int(row), on.piece, on.face)
            if not on.own:
                found[int(row)] = on.joint
    return found
