"""Joints that slipped, turned or touch elsewhere so far that they are cut anew.

When it is looked: ``dem.stages.recording``. Throughout, ``assembly`` has the blocks and their interfaces, ``state`` is
what a run changes, and ``now`` what its contact points measure in that position.
"""

import numpy as np

from dem.kernels import FACES
from dem.model.edge_points import note_slid, pivots_on_a
from dem.model.state import PointForces, State
from limitmason.arrays import Array, Flags, Index
from limitmason.model import Assembly

SLIP_FRACTION = 0.25
"""A joint is cut anew when it has slipped this fraction of its point spacing since it was made [-]."""

TURN_LIMIT = np.deg2rad(3.0)
"""Turn of its blocks since it was made from which a joint is cut anew where they touch elsewhere [rad]."""

PIVOT_TURN = np.deg2rad(0.05)
"""Turn from which a joint that slid and pivots on an edge of a is cut anew with b as its base [rad]."""

PIVOT_SLIP = 5e-4
"""Slip from which it is, over the root of its area: the arm of what bears is wrong by the slip [-]."""

PARTED = 1.5
"""Gap from which a joint is dropped, over that up to which one is made: above 1, so that it is not made again [-]."""

OTHER_PLACE, OTHER_PART = 0.01, 0.1
"""Gaps that differ by more than these parts of the margin and of the gap are not of one point [-]; chosen."""


def among(values: Index, known: Index) -> Flags:
    """Whether ``values`` are among ``known`` numbers, which ascend.

    It is quicker than ``numpy.isin``, which sorts both.
    """
    if not len(known):
        return np.zeros(np.shape(values), dtype=bool)
    return np.asarray(known[np.minimum(np.searchsorted(known, values), len(known) - 1)] == values)


def pair_codes(one: Index, two: Index, n_blocks: int) -> Index:
    """Code of every pair of blocks: its lower number times ``n_blocks`` plus its higher."""
    return np.asarray(np.sort(np.column_stack([one, two]), axis=1) @ (n_blocks, 1))


def slip_allowed(spacing: Array, count: Index | int) -> Array:
    """Slip [m] up to which a joint is neither worn nor may pivot on a wrong edge.

    It has ``count`` points at a ``spacing`` [m].

    The root of a joint's area, of which :data:`PIVOT_SLIP` is a part, is the spacing times the root of the count.
    """
    return np.asarray(spacing * np.minimum(SLIP_FRACTION, PIVOT_SLIP * np.sqrt(count)))


def spacing_of(state: State) -> Array:
    """Distance of points of every joint [m]: root of their mean area, shape (k,)."""
    start = state.joints.start
    return np.asarray(np.sqrt(np.add.reduceat(state.points.area, start[:-1]) / np.diff(start)))


def outworn_joints(
    assembly: Assembly, state: State, now: PointForces, code: Index, key: Index, kind: Index, gap: Array,
    margin: float, turn: Array, slip: Array, mine: Flags,
) -> Flags:
    """Joints to drop or to cut anew.

    They have slid far, bear nothing beside another contact, have turned onto another face, or are open beyond the
    margin. Blocks are told by pair codes, see :func:`pair_codes`.

    Parameters
    ----------
    state, now : joints and points, and what these measure now
    code : pair code of every joint, shape (k,)
    key : pair code of the blocks of every pair of pieces that are near now, shape (p,)
    kind : how these pieces meet, ``FACES`` and the like, shape (p,)
    gap : between them, negative where they overlap [m], shape (p,)
    margin : gap up to which blocks count as near [m]
    turn, slip : how far joints have turned [rad] and slid [m] since they were cut, shape (k,)
    mine : joints that are looked at, shape (k,)

    Returns
    -------
    flags, shape (k,)
    """
    first = state.joints.start[:-1]
    if not len(first):
        return np.zeros(0, dtype=bool)
    # edges that pass each other beyond their ends are infinitely far apart
    nearest = np.minimum(np.minimum.reduceat(now.opening, first), np.finfo(float).max)
    spacing = spacing_of(state)
    pushed = (now.force[:, 0] != 0.0) | (now.force[:, 1] != 0.0) | (now.force[:, 2] != 0.0)
    carries = np.logical_or.reduceat(pushed, first)
    sharp = state.contact > FACES
    # one point on a plane, or two edges, are right at any slip and turn
    single = sharp & (np.add.reduceat((now.opening < 0.0).astype(int), first) == 1)
    worn = ~single & (slip > SLIP_FRACTION * spacing)
    # of the pieces of two blocks the two that are nearest decide, by how they meet and their gap
    order = np.lexsort((gap, key))
    pairs, first_of = np.unique(key[order], return_index=True)
    near = among(code, pairs)
    nearest_of = order[first_of[np.searchsorted(pairs, code[near])]]
    meets, apart = np.zeros(len(code), dtype=np.int64), np.full(len(code), np.inf)
    meets[near], apart[near] = kind[nearest_of], gap[nearest_of]
    # the nearest points are others: a block has come to lie on another face, a corner has left its face, the edges no
    # longer cross within their lengths. As long as they are the same, a joint between faces is right at any turn
    elsewhere = np.abs(apart - nearest) > OTHER_PLACE * margin + OTHER_PART * np.abs(nearest)
    moved_on = elsewhere & ((carries & sharp) | (turn > TURN_LIMIT))
    # what carries nothing at a corner or edge is looked for anew each time
    loose = ~carries & (sharp | ((meets > FACES) & elsewhere))
    # joints that pivot on an edge of a change their base
    swapped = np.zeros(len(code), dtype=bool)
    rows = np.flatnonzero(mine & ~worn & _may_pivot(state, now, turn, slip))
    swapped[rows] = pivots_on_a(assembly, state, now, rows)
    return np.asarray(mine & (worn | loose | moved_on | (nearest > PARTED * margin) | swapped))


def largest_slip(state: State, now: PointForces) -> Array:
    """Largest slip of the points of every joint [m], shape (k,)."""
    first, (s, t) = state.joints.start[:-1], now.slip.T
    return np.asarray(np.maximum.reduceat(np.sqrt(s * s + t * t), first)) if len(first) else np.zeros(0)


def _may_pivot(state: State, now: PointForces, turn: Array, slip: Array) -> Flags:
    """Joints for which it matters whose edge they pivot on, shape (k,).

    They have slid and turned far enough, and bear on some of their points but not on all. ``now`` is what their points
    measure; ``turn`` [rad] and ``slip`` [m] are those of every joint since it was made.
    """
    first = state.joints.start[:-1]
    count, bears = np.diff(state.joints.start), np.add.reduceat((now.opening < 0.0).astype(int), first)
    return np.asarray((turn > PIVOT_TURN) & _slid_far(state, slip) & (bears > 0) & (bears < count))


def _slid_far(state: State, slip: Array) -> Flags:
    """Joints that slid so far that it matters whose edge they pivot on, shape (k,).

    ``slip`` is that of every joint [m], shape (k,).
    """
    return np.asarray(slip > PIVOT_SLIP * spacing_of(state) * np.sqrt(np.diff(state.joints.start)))


def pivots_on_wrong_face(assembly: Assembly, state: State, now: PointForces) -> bool:
    """Whether a joint that slid and turned bears on an edge of its base, block a.

    The face on which it pivots then is block b's, and the joint must be cut anew. ``now`` is what the points measure.
    """
    note_slid(state, now)
    if not len(now.owner):
        return False
    slip = largest_slip(state, now)
    if not _slid_far(state, slip).any():
        return False  # turns cost more to ask for
    tipped = np.flatnonzero(_may_pivot(state, now, turned_since(state), slip))
    return bool(pivots_on_a(assembly, state, now, tipped).any())


def turned_since(state: State) -> Array:
    """Turn of the blocks of every joint since it was made [rad], shape (k,).

    It is the angle of their rotation against each other.
    """
    j, q = state.joints, state.bodies.quat
    # conj(q_a) q_b, times what undoes that turn as it was then; the vector part is as long as sin(angle / 2)
    p = q[j.block_a] * (1, -1, -1, -1)
    relative = _multiply_rows(_multiply_rows(p, q[j.block_b]), j.turn)
    return 2.0 * np.arcsin(np.minimum(np.linalg.norm(relative[:, 1:], axis=1), 1.0))


def _multiply_rows(p: Array, q: Array) -> Array:
    """Products p q of quaternions, scalar first, row by row, shape (n, 4)."""
    a, b, c, d = p.T  # scalar, then vector
    e, f, g, h = q.T
    return np.stack([
        a * e - (b * f + c * g + d * h), a * f + e * b + (c * h - d * g), a * g + e * c + (d * f - b * h),
        a * h + e * d + (b * g - c * f),
    ], axis=1)
