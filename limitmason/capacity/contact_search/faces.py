"""Faces and corners of the blocks, which contact points are made of, and which corners lie at which faces in a pose.

Every face of every block has corners (in plane: its two ends) and sides. A contact point is a corner of one block on a
face of another; corners that contacts of the model are pulled in from stay pulled in.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array, Index
from limitmason.capacity.contacts import PathContacts
from limitmason.capacity.kinematics import Pose
from limitmason.model.assembly import Assembly

ALONG = 0.99
"""Cosine between the outward normal of a face and that of a point from which the point may lie on it."""


class Shapes(NamedTuple):
    """Faces of all n blocks and their corners in the reference pose.

    There are f faces of k sides, padded by repetition, and q corners: those of every face for itself.

    Parameters
    ----------
    assembly : whose faces they are
    face_block : block of every face, shape (f,)
    face_place : a point of it, the mean of its corners [m], shape (f, 3)
    normal : its outward unit normal, shape (f, 3)
    side : inward unit normals of the sides, (f, k, 3)
    reach : side . x on them in the reference pose [m], (f, k)
    corner_face : face that a corner belongs to, shape (q,)
    corner_place : where the corner is [m], shape (q, 3)
    face_start : where the faces of every block begin, and the end; those of a block follow each other, shape (n + 1,)
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
        """One number for a corner at a face, corner f + face, so that pairs can be looked up as numbers."""
        return corner.astype(np.int64) * len(self.face_block) + face

    def pair(self, one: Index, other: Index) -> Index:
        """One number for two blocks, the same in either order, shape (m,)."""
        return np.minimum(one, other) * self.assembly.n_blocks + np.maximum(one, other)

    def apart(self, face: Index, owner: Index) -> Array:
        """By how much faces and corners of other blocks are farther apart than their geometry says [m], shape (m,).

        Parameters
        ----------
        face : number of the face, shape (m,)
        owner : number of the block whose corner it is, shape (m,)
        """
        if not len(self.open):
            return np.zeros(len(face))
        pair = self.pair(self.face_block[face], owner)
        row = np.minimum(np.searchsorted(self.open, pair), len(self.open) - 1)
        return np.where(self.open[row] == pair, self.opening[row], 0.0)

    def with_open_pairs(self, c: PathContacts) -> "Shapes":
        """These shapes with the pairs of blocks all of whose points ``c`` are open in the reference pose."""
        gap = np.einsum("mi,mi->m", c.directions[:, 0], c.place_b - c.place_a)
        pair, of = np.unique(self.pair(c.block_a, c.block_b), return_inverse=True)
        least = np.full(len(pair), np.inf)
        np.minimum.at(least, of, gap)
        rows = least > 0.0
        return self._replace(open=pair[rows], opening=least[rows])


def turned(pose: Pose, block: Index, vector: Array) -> Array:
    """Vectors of blocks, turned with them, R v, shape (m, 3).

    Parameters
    ----------
    block : number of the block of every vector, shape (m,)
    vector : in the reference pose, shape (m, 3)
    """
    return vector + np.einsum("mij,mj->mi", pose.turn[block], vector)
