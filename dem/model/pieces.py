"""Convex pieces of all blocks as arrays, with their faces and the edges between these."""

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from dem.kernels import SolidArrays
from limitmason.arrays import Array, Flags, Index
from limitmason.geometry.polyhedron import faces_at_edges, group_by_topology
from limitmason.model import Assembly


class Pieces(NamedTuple):
    """Convex pieces of all blocks in the reference position.

    Arrays are padded to the largest piece and face.
    """

    owner: NDArray[np.int64]  # block of every piece, ascending, (p,)
    local: Array  # corners from the block's centroid [m], (p, v, 3)
    n_corners: NDArray[np.int64]  # (p,)
    faces: NDArray[np.int64]  # corners of every face, (p, f, k)
    size: NDArray[np.int64]  # how many corners a face has, (p, f)
    n_faces: NDArray[np.int64]  # (p,)
    edges: NDArray[np.int64]  # both corners and both faces of every edge between faces that are not coplanar, (p, e, 4)
    n_edges: NDArray[np.int64]  # (p,)
    reach: Array  # largest distance of a corner from the centroid of every block [m], (n,)

    @property
    def solids(self) -> SolidArrays:
        """Corners and faces of the pieces in the reference position, by block."""
        start = np.searchsorted(self.owner, np.arange(len(self.reach) + 1)).astype(np.int64)
        return SolidArrays(start, self.local, self.faces, self.size, self.n_faces)

    @classmethod
    def of(cls, assembly: Assembly) -> "Pieces":
        """Pieces of an assembly, found once: a push runs the same one at two speeds.

        Arrays are as wide as the piece with the most corners, faces and edges. Pieces of one topology are filled in
        together.
        """
        if assembly in _KNOWN:
            return _KNOWN[assembly]
        solids = [part for block in assembly.blocks for part in block.parts]
        owner = np.repeat(np.arange(assembly.n_blocks), [len(block.parts) for block in assembly.blocks])
        groups = group_by_topology(solids)
        tables = [_edges_of(faces) for faces, _, _ in groups]
        # most corners and faces of a piece, and corners of a face
        v = max(vertices.shape[1] for _, _, vertices in groups)
        f = max(len(faces) for faces, _, _ in groups)
        k = max(len(face) for faces, _, _ in groups for face in faces)
        count, m = np.zeros((3, len(solids)), dtype=np.int64), len(solids)  # corners, faces and edges of every piece
        local, faces_of = np.zeros((m, v, 3)), np.zeros((m, f, k), dtype=np.int64)
        size, edges = np.zeros((m, f), dtype=np.int64), np.zeros((m, max(map(len, tables)), 4), dtype=np.int64)
        for (faces, rows, vertices), table in zip(groups, tables, strict=True):
            n = vertices.shape[1]
            local[rows, :n] = vertices - assembly.centroids[owner[rows]][:, None]
            local[rows, n:] = local[rows, n - 1 : n]  # the last corner once more, which widens no box
            for j, face in enumerate(faces):
                faces_of[rows, j, : len(face)] = face
                size[rows, j] = len(face)
            # edges at which two faces really turn come first; those between coplanar faces are none
            bent = _bent(vertices, faces, table)
            first = np.argsort(~bent, axis=1, kind="stable")
            edges[rows, : len(table)] = np.where(np.sort(~bent, axis=1)[:, :, None], 0, table[first])
            count[0, rows], count[1, rows], count[2, rows] = n, len(faces), bent.sum(axis=1)
        _KNOWN[assembly] = cls(owner, local, count[0], faces_of, size, count[1], edges, count[2], reaches(assembly))
        return _KNOWN[assembly]


_KNOWN: WeakKeyDictionary[Assembly, Pieces] = WeakKeyDictionary()

_COPLANAR = 1.0 - 1e-10
"""Cosine between the normals of two faces from which on they are parts of one: 1.4e-5 rad, rounding in corners."""


def _edges_of(faces: Sequence[tuple[int, ...]]) -> Index:
    """Corners i, j and both faces of every edge between two faces, shape (e, 4).

    ``faces`` are the corners of every face.
    """
    beside = faces_at_edges(faces).items()
    return np.array([(*ends, *fs) for ends, fs in beside if len(fs) == 2], dtype=np.int64).reshape(-1, 4)


def _bent(vertices: Array, faces: Sequence[tuple[int, ...]], edges: Index) -> Flags:
    """Whether the two faces at an edge meet at an angle, shape (k, e).

    The others lie inside a plane, as triangulation leaves them. The k solids have one topology.

    Parameters
    ----------
    vertices : [m], shape (k, v, 3)
    faces : vertices of each face
    edges : both vertices and both faces of every edge, shape (e, 4)
    """
    normal = np.empty((len(vertices), len(faces), 3))
    for f, face in enumerate(faces):
        x = vertices[:, list(face)] - vertices[:, :1]  # products of map coordinates would leave nothing of a face
        n = np.cross(x, np.roll(x, -1, axis=1)).sum(axis=1)
        normal[:, f] = n / np.linalg.norm(n, axis=1)[:, None]
    return np.asarray(np.einsum("kei,kei->ke", normal[:, edges[:, 2]], normal[:, edges[:, 3]]) < _COPLANAR)


def reaches(assembly: Assembly) -> Array:
    """Largest distance of a corner from the centroid of its block [m], shape (n,)."""
    vertices, start = assembly.vertices
    arm = vertices - np.repeat(assembly.centroids, np.diff(start), axis=0)
    return np.asarray(np.maximum.reduceat(np.linalg.norm(arm, axis=1), start[:-1]))
