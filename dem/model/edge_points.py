"""Whose edges end the contact of faces that slide on each other, and points that stay with these edges.

A joint keeps its points as material points of block b, and the plane of block a. Where a's edge ends the contact, b
slides past that edge: what bears is the material of b that lies there now, and once b has turned the plane is b's. A
search for contacts cuts such a joint anew; one for the collapse load, which looks for none, lets its points follow.

Throughout, ``assembly`` has the blocks and their interfaces, ``state`` is what a run changes, and ``now`` what its
contact points measure in that position.
"""

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.kernels import FACES, OF_A, OF_B, Joints, Points
from dem.model.pieces import Pieces
from dem.model.state import ENDS, PointForces, State
from limitmason.arrays import Array, Flags, Index
from limitmason.model import Assembly

LEVEL = 1e-9
"""Component of a normal along the loads up to which two blocks stand side by side [-]."""

NOTICED = 1e-4
"""Slip from which the points of a joint follow its edges, over the square root of its area [-]."""


def base_first(assembly: Assembly, dead: Array, points: Points, joints: Joints) -> tuple[Points, Joints]:
    """Points and joints with the block as first on whose face the other one stands.

    A joint's plane turns with its first block. Of two blocks this is the one of which fewer edges end the contact: a
    corner of the other bears on its face once that one rocks. Where both have as many it is the lower one, as the
    dead loads pull, and side by side that of the lower number. Joints with another first block are turned round.

    Parameters
    ----------
    dead : wrench per block [N, N m], shape (n, 6); its sum tells where down is
    points, joints : in the reference position
    """
    ends, rows = np.full((len(points.s), ENDS), np.nan), np.arange(len(joints.block_a))
    kernels.find_ends(points, joints, np.zeros(len(points.s)), Pieces.of(assembly).solids, rows, ends)
    whose = ends[:, [5, 6, 8, 9]]  # whose edges the lower and the upper end are, along s and along t
    # how many more ends are edges of a than of b, over all points of a joint
    more = np.add.reduceat((whose == OF_A).sum(axis=1) - (whose == OF_B).sum(axis=1), joints.start[:-1])
    total = dead[~assembly.fixed, :3].sum(axis=0)
    # the normal points from the first block to the second
    falls = joints.frame[:, 2] @ total > LEVEL * np.abs(dead[:, :3]).sum()
    turned = (more > 0) | ((more == 0) & falls)
    one, mine = turned[:, None], np.repeat(turned, np.diff(joints.start))
    # turned round about t1: the second axis and the normal change their sign
    return points._replace(t=np.where(mine, -points.t, points.t)), joints._replace(
        block_a=np.where(turned, joints.block_b, joints.block_a),
        block_b=np.where(turned, joints.block_a, joints.block_b),
        arm_a=np.where(one, joints.arm_b, joints.arm_a), arm_b=np.where(one, joints.arm_a, joints.arm_b),
        frame=np.where(one[:, :, None], joints.frame * [[1.0], [-1.0], [-1.0]], joints.frame),
    )


def follow_edges(assembly: Assembly, state: State) -> None:
    """Let the points of joints that have slipped follow the edges of their faces.

    Changes ``state.points``. With b slipped by u along an axis, an end that is an edge of b moves by u over the face of
    a, one of a by nothing, and one of both by what makes the contact smaller. Points between move in proportion. Areas
    stay until the joint is cut anew.
    """
    joints, points, now = state.joints, state.points, state.forces()  # of slips alone: places are not needed
    slid = note_ends(assembly, state, now)
    if not slid.any():
        return
    mine = np.repeat(slid, np.diff(joints.start))  # points of these joints
    # columns as :func:`dem.kernels.outlines.find_ends` writes them: s, t and the gap's slopes as the joint was made,
    # then for each axis the part of the way from the lower to the upper end and whose edge either end is
    row, slip = state.ends[mine], now.slip[mine]
    s, t = (
        row[:, c] - slip[:, c] + _moved(row[:, 4 + 3 * c], row[:, 5 + 3 * c], row[:, 6 + 3 * c], slip[:, c])
        for c in (0, 1)
    )
    # the gap belongs to the place on b's face
    points.gap[mine] += row[:, 2] * (s - points.s[mine]) + row[:, 3] * (t - points.t[mine])
    points.s[mine], points.t[mine] = s, t


def note_ends(assembly: Assembly, state: State, now: PointForces) -> NDArray[np.bool_]:
    """Write to ``state.ends`` whose edges end the joints that have slid.

    ``now`` is what the points of the state measure.

    Returns
    -------
    Which of the k joints have slid, shape (k,).
    """
    slid, first = joints_that_slid(state, now), state.joints.start[:-1]
    # NaN in the row of its first point: the ends of a joint have not been looked for
    _look_for_ends(assembly, state, np.flatnonzero(slid & np.isnan(state.ends[first, 0])))
    return slid


def note_slid(state: State, now: PointForces) -> None:
    """Mark joints between faces that have slid: their ends are found once asked for.

    The mark is a number in the second column of ``state.ends`` beside NaN in the first.
    """
    first = state.joints.start[:-1]
    new = first[joints_that_slid(state, now) & np.isnan(state.ends[first, 1])]
    state.ends[new, 1] = 0.0


def joints_that_slid(state: State, now: PointForces) -> Flags:
    """Joints between faces that have slid, shape (k,).

    The mean slip of their points is above :data:`NOTICED`.
    """
    joints, area = state.joints, state.points.area
    first = joints.start[:-1]
    if not len(first):
        return np.zeros(0, dtype=bool)
    total = np.add.reduceat(area, first)
    mean = np.add.reduceat(now.slip * area[:, None], first) / total[:, None]
    return np.asarray((state.contact == FACES) & (np.linalg.norm(mean, axis=1) > NOTICED * np.sqrt(total)))


def _look_for_ends(assembly: Assembly, state: State, rows: Index) -> None:
    """Write whose edges end the joints ``rows`` to ``state.ends``."""
    if len(rows):
        rows = np.ascontiguousarray(rows, dtype=np.int64)
        kernels.find_ends(state.points, state.joints, state.setback, Pieces.of(assembly).solids, rows, state.ends)


def _moved(part: Array, lower: Array, upper: Array, slip: Array) -> Array:
    """Motion over a's face of points between two ends while b slips [m], shape (m,).

    Parameters
    ----------
    part : where a point lies on the way from the lower to the upper end, 0 to 1 [-]
    lower, upper : whose edge either end is, ``OF_A``, ``OF_B`` or ``OF_BOTH``
    slip : of b against a along the axis [m]
    """
    # an edge of a stays, one of b goes along, and one of both does what makes the contact smaller
    low = np.where(lower == OF_A, 0.0, np.where(lower == OF_B, slip, np.maximum(slip, 0.0)))
    high = np.where(upper == OF_A, 0.0, np.where(upper == OF_B, slip, np.minimum(slip, 0.0)))
    return np.asarray((1.0 - part) * low + part * high)


def pivots_on_a(assembly: Assembly, state: State, now: PointForces, rows: Index) -> Flags:
    """Whether some joints bear on an edge of block a alone, shape (r,).

    The face that they bear on then is that of block b.

    Parameters
    ----------
    assembly, state, now : blocks, the state, and what its points measure
    rows : joints that slid and turned, shape (r,)
    """
    where = np.empty(len(rows), dtype=np.int64)
    # whose edges end a contact is found only where the first round asks for it; the second then knows
    for _ in range(2):
        kernels.bearing_ends(state.points, state.joints.start, state.ends, now.opening, now.slip, rows, where)
        _look_for_ends(assembly, state, rows[where == kernels.UNKNOWN])
    return np.asarray(where == kernels.ON_A)
