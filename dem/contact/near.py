"""Which pieces are near each other, and which have moved since the last look.

Throughout, ``margin`` is the gap up to which pieces are near [m], ``pieces`` are the convex pieces of all blocks,
``assembly`` has the blocks and ``state`` is what a run changes.

When pairs are looked at again is decided in ``dem.stages.recording``.
"""

from typing import NamedTuple

import numpy as np

from dem import kernels
from dem.kernels import NearPairs
from dem.kernels.arrays import Index
from dem.model.pieces import Pieces
from dem.model.state import State
from dem.model.unbalance import smallest_edge
from limitmason.arrays import Array, Flags
from limitmason.geometry.boxtree import overlapping_pairs
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


class Neighbours(NamedTuple):
    """Pieces now, the pairs that are near, and how these have moved since a look."""

    near: NearPairs  # as the pairs were when they were looked at last
    corners: Array  # of all pieces now [m], (p, v, 3)
    apart: Flags  # whether the boxes of a pair are more than twice the margin apart, (m,)
    offset: Array  # as in ``near``, now, (m, 3)
    turn: Array  # as in ``near``, now, (m, 4)
    moved: Array  # of the blocks of a pair against each other since then [m], (m,)
    turned: Array  # of the same [rad], (m,)
    gone: Index  # blocks of pairs that are no longer near, (g, 2)

    @classmethod
    def of(
        cls, assembly: Assembly, state: State, pieces: Pieces, margin: float, since: NearPairs | None
    ) -> "Neighbours":
        """Pairs of pieces around the blocks of a state, and how they have moved.

        Parameters
        ----------
        assembly, state, pieces : blocks, the state they are in, and their convex pieces
        margin : gap up to which pieces count as near [m]
        since : pairs as they were when they were looked at; None is the reference position
        """
        n, b = assembly.n_blocks, state.bodies
        if since is None:
            _, low, high = placed(pieces, np.zeros((n, 3, 3)), assembly.centroids)
            skin = (1.0 + SKIN) * margin
            since = _pairs(assembly, pieces, low - skin, high + skin)
            since.move[:], since.angle[:] = SMALL * margin, np.inf
            since.offset[:] = np.diff(assembly.centroids[since.blocks], axis=1)[:, 0]
            since.turn[:, 0] = 1.0
        # the ground may travel far: pieces are placed against it, so that boxes stay valid
        ground = ground_shift(assembly, b.shift)
        place = assembly.centroids + b.shift - ground
        corners, low, high = placed(pieces, b.rot, place)
        near = _renewed(assembly, pieces, since, low, high, margin)
        m = len(near.pairs)
        offset, turn, moved, turned = np.empty((m, 3)), np.empty((m, 4)), np.empty(m), np.empty(m)
        kernels.relative_motion(near, b.quat, b.rot, place, pieces.reach, offset, turn, moved, turned)
        # pairs that are always looked at: 0 lies above ALWAYS. Those that have just come near had no pose to count from
        moved[near.move == ALWAYS] = 0.0
        p, q = near.pairs.T
        gap = np.maximum(low[p] - high[q], low[q] - high[p]).max(axis=1)
        size = (len(pieces.owner), 1)  # by which both numbers of a pair of pieces become one
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
        """Pairs once some have been looked at: these may move from where they are now.

        Parameters
        ----------
        rows : pairs that have been looked at, shape (m,)
        move, angle : what pairs may move [m] and turn [rad] before they are looked at again, shape (m,)
        """
        near = self.near
        wide = rows[:, None]
        return near._replace(
            offset=np.where(wide, self.offset, near.offset), turn=np.where(wide, self.turn, near.turn),
            move=np.where(rows, move, near.move), angle=np.where(rows, angle, near.angle),
        )


def placed(pieces: Pieces, rot: Array, place: Array) -> tuple[Array, Array, Array]:
    """Corners of all pieces [m], and least and largest coordinates of each [m].

    Shapes are (p, v, 3), (p, 3) and (p, 3).

    Parameters
    ----------
    pieces : convex pieces of all blocks
    rot : R - I of every block, shape (n, 3, 3)
    place : centroid of every block [m], shape (n, 3)
    """
    corners, low, high = np.empty_like(pieces.local), np.empty((len(pieces.owner), 3)), np.empty((len(pieces.owner), 3))
    kernels.place_pieces(pieces.owner, pieces.local, rot, place, corners, low, high)
    return corners, low, high


def _pairs(assembly: Assembly, pieces: Pieces, low: Array, high: Array, known: Index | None = None) -> NearPairs:
    """Pairs of pieces whose boxes overlap, as if no search had looked at them yet.

    They are of two blocks that are not both held.

    Parameters
    ----------
    low, high : least and largest coordinates of the boxes of all pieces [m], shape (p, 3)
    known : pairs whose boxes overlap, shape (m, 2); None where they are not known yet
    """
    pairs = np.column_stack(overlapping_pairs(low, high)).astype(np.int64) if known is None else known
    blocks = pieces.owner[pairs]
    use = (blocks[:, 0] != blocks[:, 1]) & ~assembly.fixed[blocks].all(axis=1)
    pairs, blocks = np.ascontiguousarray(pairs[use]), np.sort(blocks[use], axis=1)
    reach = pieces.reach[blocks]  # the block that reaches farther goes first: motion is measured in its axes
    blocks = np.where((reach[:, 0] >= reach[:, 1])[:, None], blocks, blocks[:, ::-1])
    m = len(pairs)
    return NearPairs(
        pairs, np.ascontiguousarray(blocks), low, high, offset=np.zeros((m, 3)), turn=np.zeros((m, 4)),
        move=np.full(m, ALWAYS), angle=np.full(m, ALWAYS),
    )


def _renewed(assembly: Assembly, pieces: Pieces, near: NearPairs, low: Array, high: Array, margin: float) -> NearPairs:
    """Pairs that are near now, where pieces have left their boxes.

    Boxes are kept wider by a skin, so that pairs are sought anew only when a piece has left its own.

    Parameters
    ----------
    near : pairs as they were when they were looked at, with the boxes of then
    low, high : least and largest coordinates of every piece now [m], shape (p, 3)
    margin : gap up to which pieces count as near [m]
    """
    left = np.asarray((low - margin < near.low) | (high + margin > near.high)).any(axis=1).reshape(-1)
    if not left.any():
        return near
    # boxes of the pieces that have left theirs are made anew
    skin = (1.0 + SKIN) * margin
    low, high = np.where(left[:, None], low - skin, near.low), np.where(left[:, None], high + skin, near.high)
    rows, size = np.flatnonzero(left), len(left)
    overlapping: Index | None = None  # pairs whose boxes overlap; None where they are still to be sought among all
    if len(rows) <= FEW:
        # few such pieces are compared with all; pairs of others stay
        meets = (low[rows][:, None] <= high) & (low <= high[rows][:, None])
        one, other = np.nonzero(meets.all(axis=2))
        new = np.sort(np.column_stack([rows[one], other]), axis=1)
        kept = near.pairs[~left[near.pairs].any(axis=1)]
        # both numbers of a pair as one, by which pairs are sorted and each is taken once
        every = np.concatenate([kept, new[new[:, 0] < new[:, 1]]]) @ (size, 1)
        overlapping = np.column_stack(np.divmod(np.unique(every), size)).astype(np.int64)
    out = _pairs(assembly, pieces, low, high, overlapping)
    # pairs that were near before keep what they may move, and how they lay when looked at
    code, old = out.pairs @ (size, 1), near.pairs @ (size, 1)
    at: Index = np.minimum(np.searchsorted(old, code), len(old) - 1).astype(np.int64)
    known = old[at] == code if len(old) else np.zeros(len(code), dtype=bool)
    for name in ("offset", "turn", "move", "angle"):
        getattr(out, name)[known] = getattr(near, name)[at[known]]
    return out


def near_margin(assembly: Assembly) -> float:
    """Gap up to which two blocks of an assembly count as near [m]."""
    return MARGIN * smallest_edge(assembly)


def on_ground(assembly: Assembly) -> Flags:
    """Blocks that go with the ground, shape (n,): those wholly held, else in x, y and z."""
    return np.asarray(assembly.fixed if assembly.fixed.any() else assembly.held[:, :3].all(axis=1))


def ground_shift(assembly: Assembly, shift: Array) -> Array:
    """Mean displacement of the blocks that go with the ground [m], zero without any.

    ``shift`` is that of every block [m], shape (n, 3).
    """
    held = on_ground(assembly)
    return np.asarray(shift[held].mean(axis=0)) if held.any() else np.zeros(3)


def farthest(assembly: Assembly, state: State, reach: Array) -> tuple[int, float]:
    """Block moved most against held ones, and how far its farthest corner has [m].

    Parameters
    ----------
    reach : of every block, from the centroid to its farthest corner [m], shape (n,)
    """
    b = state.bodies
    moved = np.linalg.norm(b.shift - ground_shift(assembly, b.shift), axis=1)
    turned = 2.0 * np.arcsin(np.minimum(np.linalg.norm(b.quat[:, 1:], axis=1), 1.0))
    path = moved + turned * reach  # a bound
    return int(path.argmax()), float(path.max())


def travel_per_step(state: State, reach: Array) -> float:
    """Largest distance that a corner travels in a step, seen from the ground [m].

    All held blocks move with the ground: the first stands for it.

    Parameters
    ----------
    reach : largest distance of a corner from its block's centroid [m], shape (n,)
    """
    still = np.flatnonzero(state.bodies.held.all(axis=1))
    ground = state.bodies.vel[still[0]] if len(still) else 0.0
    vel = state.bodies.vel - ground
    speed = np.sqrt((vel * vel).sum(axis=1)) + np.sqrt((state.bodies.spin**2).sum(axis=1)) * reach
    return float(speed.max(initial=0.0)) * state.dt
