"""Which pieces of blocks are near each other, and which have moved against each other since they were looked at."""

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.kernels import NearPairs
from dem.kernels.arrays import Index
from dem.model.holding import smallest_edge
from dem.model.state import State
from limitmason.arrays import Array, Flags
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.polyhedron import group_by_topology
from limitmason.model import Assembly

MARGIN = 0.05
"""Gap up to which two blocks count as near, over the smallest block dimension [-]."""

SMALL = 0.5
"""Displacement up to which the first contacts are all there are, over the gap at which two blocks count as near [-]."""

SKIN = 2.0
"""Travel up to which pairs of boxes are kept, over the gap at which two blocks count as near [-]."""

FEW = 64
"""Pieces whose boxes are made anew one by one; more of them are sorted into the tree with all others."""

ALWAYS = -1.0
"""Allowance of a pair that is looked at in every search, whether it has moved or not."""


class Pieces(NamedTuple):
    """Convex pieces of all blocks: corners from the block's centroid in the reference position [m], faces, edges."""

    owner: NDArray[np.int64]
    local: Array
    n_corners: NDArray[np.int64]
    faces: NDArray[np.int64]  # corners of every face, padded
    size: NDArray[np.int64]
    n_faces: NDArray[np.int64]
    edges: NDArray[np.int64]  # both corners and both faces of every edge between faces that are not coplanar, padded
    n_edges: NDArray[np.int64]
    reach: Array  # largest distance of a corner from the centroid of every block [m]

    @classmethod
    def of(cls, assembly: Assembly) -> "Pieces":
        """Pieces of an assembly, found once: a push runs the same one at two speeds."""
        if assembly in _KNOWN:
            return _KNOWN[assembly]
        solids = [part for block in assembly.blocks for part in block.parts]
        owner = np.repeat(np.arange(assembly.n_blocks), [len(block.parts) for block in assembly.blocks])
        groups = group_by_topology(solids)
        tables = [_edges_of(faces) for faces, _, _ in groups]
        v = max(vertices.shape[1] for _, _, vertices in groups)
        f = max(len(faces) for faces, _, _ in groups)
        k = max(len(face) for faces, _, _ in groups for face in faces)
        count, m = np.zeros((3, len(solids)), dtype=np.int64), len(solids)
        local, faces_of = np.zeros((m, v, 3)), np.zeros((m, f, k), dtype=np.int64)
        size, edges = np.zeros((m, f), dtype=np.int64), np.zeros((m, max(map(len, tables)), 4), dtype=np.int64)
        for (faces, rows, vertices), table in zip(groups, tables, strict=True):
            n = vertices.shape[1]
            local[rows, :n] = vertices - assembly.centroids[owner[rows]][:, None]
            local[rows, n:] = local[rows, n - 1 : n]
            for j, face in enumerate(faces):
                faces_of[rows, j, : len(face)] = face
                size[rows, j] = len(face)
            bent = _bent(vertices, faces, table)
            first = np.argsort(~bent, axis=1, kind="stable")
            edges[rows, : len(table)] = np.where(np.sort(~bent, axis=1)[:, :, None], 0, table[first])
            count[0, rows], count[1, rows], count[2, rows] = n, len(faces), bent.sum(axis=1)
        _KNOWN[assembly] = cls(owner, local, count[0], faces_of, size, count[1], edges, count[2], reaches(assembly))
        return _KNOWN[assembly]


_KNOWN: WeakKeyDictionary[Assembly, Pieces] = WeakKeyDictionary()


def _edges_of(faces: Sequence[tuple[int, ...]]) -> Index:
    """Corners i, j and faces of every edge between two faces, shape (e, 4)."""
    beside: dict[tuple[int, int], list[int]] = {}
    for f, face in enumerate(faces):
        for i, j in zip(face, (*face[1:], face[0]), strict=True):
            beside.setdefault((min(i, j), max(i, j)), []).append(f)
    return np.array([(*ends, *fs) for ends, fs in beside.items() if len(fs) == 2], dtype=np.int64).reshape(-1, 4)


def _bent(vertices: Array, faces: Sequence[tuple[int, ...]], edges: Index) -> Flags:
    """Edges of solids of one topology that are none inside a plane, as triangulation leaves them, shape (k, e)."""
    normal = np.empty((len(vertices), len(faces), 3))
    for f, face in enumerate(faces):
        x = vertices[:, list(face)]
        n = np.cross(x, np.roll(x, -1, axis=1)).sum(axis=1)
        normal[:, f] = n / np.linalg.norm(n, axis=1)[:, None]
    return np.asarray(np.einsum("kei,kei->ke", normal[:, edges[:, 2]], normal[:, edges[:, 3]]) < 1.0 - 1e-10)


class Neighbours(NamedTuple):
    """Pieces in their present position, the pairs that are near, and how these have moved since they were looked at."""

    near: NearPairs  # as the pairs were when they were looked at last
    corners: Array  # [m], (p, v, 3)
    apart: Flags  # whether the boxes of a pair are more than twice the margin apart, (m,)
    offset: Array  # as in ``near``, now
    turn: Array
    moved: Array  # [m], (m,)
    turned: Array  # [rad], (m,)
    gone: Index  # blocks of pairs that are no longer near, (g, 2)

    @classmethod
    def of(
        cls, assembly: Assembly, state: State, pieces: Pieces, margin: float, since: NearPairs | None
    ) -> "Neighbours":
        """What is around the blocks of a state; ``since`` None is their reference position."""
        n, b = assembly.n_blocks, state.bodies
        if since is None:
            _, low, high = placed(pieces, np.zeros((n, 3, 3)), assembly.centroids)
            skin = (1.0 + SKIN) * margin
            since = _pairs(assembly, pieces, low - skin, high + skin)
            since.move[:], since.angle[:] = SMALL * margin, np.inf
            since.offset[:] = np.diff(assembly.centroids[since.blocks], axis=1)[:, 0]
            since.turn[:, 0] = 1.0
        ground = b.shift[assembly.fixed].mean(axis=0) if assembly.fixed.any() else np.zeros(3)
        place = assembly.centroids + b.shift - ground
        corners, low, high = placed(pieces, b.rot, place)
        near = _renewed(assembly, pieces, since, low, high, margin)
        m = len(near.pairs)
        offset, turn, moved, turned = np.empty((m, 3)), np.empty((m, 4)), np.empty(m), np.empty(m)
        kernels.relative_motion(near, b.quat, b.rot, place, pieces.reach, offset, turn, moved, turned)
        moved[near.move == ALWAYS] = 0.0  # enough for them, and those that have come near have no place before
        p, q = near.pairs.T
        gap = np.maximum(low[p] - high[q], low[q] - high[p]).max(axis=1)
        size = (len(pieces.owner), 1)
        gone = since.blocks[~np.isin(since.pairs @ size, near.pairs @ size)] if near is not since else since.blocks[:0]
        return cls(near, corners + ground, gap > 2.0 * margin, offset, turn, moved, turned, gone)

    def due(self) -> Flags:
        """Pairs that have moved or turned beyond what they were allowed, (m,)."""
        return np.asarray((self.moved > self.near.move) | (self.turned > self.near.angle))

    @property
    def new(self) -> Flags:
        """Pairs that have come near since, (m,)."""
        return self.near.move == ALWAYS

    def looked_at(self, rows: Flags, move: Array, angle: Array) -> NearPairs:
        """Pairs as they are when some have been looked at, with what they are allowed from now on."""
        near = self.near
        now = {"offset": self.offset, "turn": self.turn, "move": move, "angle": angle}
        every = {name: rows.reshape(-1, *[1] * (x.ndim - 1)) for name, x in now.items()}
        return near._replace(**{name: np.where(every[name], x, getattr(near, name)) for name, x in now.items()})


def placed(pieces: Pieces, rot: Array, place: Array) -> tuple[Array, Array, Array]:
    """Corners of all pieces and their boxes [m], by R - I and place of every block."""
    corners, low, high = np.empty_like(pieces.local), np.empty((len(pieces.owner), 3)), np.empty((len(pieces.owner), 3))
    kernels.place_pieces(pieces.owner, pieces.local, rot, place, corners, low, high)
    return corners, low, high


def _pairs(assembly: Assembly, pieces: Pieces, low: Array, high: Array, known: Index | None = None) -> NearPairs:
    """Pairs of pieces of two blocks, not both held, whose boxes overlap; they are to be looked at."""
    pairs = np.column_stack(overlapping_pairs(low, high)).astype(np.int64) if known is None else known
    blocks = pieces.owner[pairs]
    use = (blocks[:, 0] != blocks[:, 1]) & ~assembly.fixed[blocks].all(axis=1)
    pairs, blocks = np.ascontiguousarray(pairs[use]), np.sort(blocks[use], axis=1)
    reach = pieces.reach[blocks]
    blocks = np.where((reach[:, 0] >= reach[:, 1])[:, None], blocks, blocks[:, ::-1])
    m = len(pairs)
    return NearPairs(
        pairs, np.ascontiguousarray(blocks), low, high, np.zeros((m, 3)), np.zeros((m, 4)), np.full(m, ALWAYS),
        np.full(m, ALWAYS),
    )


def _renewed(assembly: Assembly, pieces: Pieces, near: NearPairs, low: Array, high: Array, margin: float) -> NearPairs:
    """Pairs that are near now, where pieces have left their boxes; new ones are to be looked at."""
    left = np.asarray((low - margin < near.low) | (high + margin > near.high)).any(axis=1).reshape(-1)
    if not left.any():
        return near
    skin = (1.0 + SKIN) * margin
    few: Index | None = None
    low, high = np.where(left[:, None], low - skin, near.low), np.where(left[:, None], high + skin, near.high)
    rows, size = np.flatnonzero(left), len(left)
    if len(rows) <= FEW:
        meets = (low[rows][:, None] <= high) & (low <= high[rows][:, None])
        one, other = np.nonzero(meets.all(axis=2))
        new = np.sort(np.column_stack([rows[one], other]), axis=1)
        kept = near.pairs[~left[near.pairs].any(axis=1)]
        every = np.concatenate([kept, new[new[:, 0] < new[:, 1]]]) @ (size, 1)
        few = np.column_stack(np.divmod(np.unique(every), size)).astype(np.int64)
    out = _pairs(assembly, pieces, low, high, few)
    code, old = out.pairs @ (size, 1), near.pairs @ (size, 1)
    at: Index = np.minimum(np.searchsorted(old, code), len(old) - 1).astype(np.int64)
    known = old[at] == code if len(old) else np.zeros(len(code), dtype=bool)
    for name in ("offset", "turn", "move", "angle"):
        getattr(out, name)[known] = getattr(near, name)[at[known]]
    return out


def near_margin(assembly: Assembly) -> float:
    """Gap up to which two blocks count as near [m]."""
    return MARGIN * smallest_edge(assembly)


def reaches(assembly: Assembly) -> Array:
    """Largest distance of a corner from the centroid of its block [m], shape (n,)."""
    vertices, start = assembly.vertices
    arm = vertices - np.repeat(assembly.centroids, np.diff(start), axis=0)
    return np.asarray(np.maximum.reduceat(np.linalg.norm(arm, axis=1), start[:-1]))


def farthest(assembly: Assembly, state: State, reach: Array) -> tuple[int, float]:
    """Block that has moved most against the held ones, and how far its farthest corner has [m].

    ``reach`` as below.
    """
    b = state.bodies
    ground = b.shift[assembly.fixed].mean(axis=0) if assembly.fixed.any() else np.zeros(3)
    moved = np.linalg.norm(b.shift - ground, axis=1)
    turned = 2.0 * np.arcsin(np.minimum(np.linalg.norm(b.quat[:, 1:], axis=1), 1.0))
    path = moved + turned * reach
    return int(path.argmax()), float(path.max())


def travel_per_step(state: State, reach: Array) -> float:
    """Largest distance that a corner of a block can travel from the ground in one step [m].

    ``reach`` as :func:`reaches` gives it.
    """
    still = np.flatnonzero(state.bodies.held.all(axis=1))
    ground = state.bodies.vel[still[0]] if len(still) else 0.0
    speed = np.linalg.norm(state.bodies.vel - ground, axis=1) + np.linalg.norm(state.bodies.spin, axis=1) * reach
    return float(speed.max(initial=0.0)) * state.dt
