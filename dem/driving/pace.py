"""In how many steps a structure is driven: its slowest swing in steps of scaled masses, and how many a push takes.

The speed along the path, with its gentle start, is in ``block_structure``, of zoned blocks in ``zoned_structure``.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from dem.kernels import LAW
from dem.model.stable_step import owners, point_motions, point_stiffness
from dem.model.state import State
from limitmason.arrays import Flags
from limitmason.model import Assembly, Loads

SWINGS = 40
"""Slowest swings that the faster run of a push takes, at least [-]."""

LEAST_STEPS = 6000
"""Steps that it takes, at least."""

SOFT_BLOCK = 1e-2
"""Stiffness of a block's softest mode, over that of the mode and twice its joints, below which it is named [-]."""

LIFT = 1e-9
"""Stiffness per mass that every motion gets, over the largest there is [-]: a matrix with none for one is singular."""

INVERSE = 2
"""Steps of inverse iteration from the shape under dead loads, which is a swing's already but for what it lacks."""


def slowest_period(assembly: Assembly, state: State, loads: Loads) -> float:
    """Steps of the slowest swing of a state on its scaled masses.

    Joints are closed and elastic. By Rayleigh's quotient omega^2 = u K u / u M u with K u = f, f the dead loads and
    then twice M u: the period is below the exact one by the square of what the shape lacks. Joints that open make it
    longer. Ties are left out, though masses are scaled for them: one that hangs loose holds nothing, and a taut one
    makes the period shorter.

    Parameters
    ----------
    assembly : whose blocks and joints the state has
    state : with scaled masses and the time step
    loads : of which the dead ones count, wrenches of every block [N, N m]
    """
    k = tangent(assembly, state)
    # freedoms that can move: six of every block, then its modes
    free = np.flatnonzero(np.concatenate([~state.bodies.held.ravel(), _deforms(state)]))
    b = state.bodies
    inertia = np.linalg.inv(b.inv_inertia)
    # mass matrix, block by block: of displacements, of turns, and of modes
    blocks = [part for m, j in zip(b.mass, inertia, strict=True) for part in (m * np.eye(3), j)]
    if state.modes is not None:
        blocks.append(sparse.diags_array(state.modes.mass.ravel()))
    mass = sparse.csc_array(sparse.block_diag(blocks, format="csc"))[free][:, free]
    k = sparse.csc_array(k[free][:, free])
    # no joint may hold a block one way, as across a single point: a trifle, shared as mass is, keeps K regular
    lift = LIFT * float((k.diagonal() / mass.diagonal()).max())
    solve = splu(sparse.csc_array(k + lift * mass)).solve
    # dead loads act on no mode of a block
    u = solve(np.concatenate([loads.dead.ravel(), np.zeros(_deforms(state).size)])[free])
    for _ in range(INVERSE):
        u = solve(mass @ u)
        u /= np.linalg.norm(u)
    return float(2.0 * np.pi * np.sqrt((u @ (mass @ u)) / (u @ (k @ u))) / state.dt)


def tangent(assembly: Assembly, state: State) -> sparse.csc_array:
    """Stiffness matrix K of a state with its joints closed and elastic.

    K = A k A^T, and the stiffness of the blocks' own modes. Column i of A is the opening or slip of one contact point
    per motion of the two blocks that meet there. All motions of the blocks come first, then their modes. The shape of K
    is (6 n, 6 n), or (6 n + n m, 6 n + n m) for blocks with m modes.
    """
    points, joints, modes = state.points, state.joints, state.modes
    rigid, owner = 6 * assembly.n_blocks, owners(joints)
    own = np.zeros(0) if modes is None else modes.stiffness.ravel()
    rows, values = [], []
    # openings and slips are motions of b less those of a
    for block, arm, side, sign in (
        (joints.block_a, joints.arm_a, None if modes is None else modes.side_a, -1.0),
        (joints.block_b, joints.arm_b, None if modes is None else modes.side_b, 1.0),
    ):
        values.append(sign * point_motions(points, joints, arm, joints.frame, side))
        m = values[-1].shape[2] - 6  # modes of a block
        # rows of K for the six motions of the block, and for its modes behind those of all blocks
        rows.append(block[owner][:, None] * 6 + np.arange(6))
        rows.append(rigid + block[owner][:, None] * m + np.arange(m))
    columns = 3 * len(owner)  # two tangents and the normal of every point, each with the same rows
    row = np.repeat(np.concatenate(rows, axis=1)[:, None], 3, axis=1).ravel()
    column = np.repeat(np.arange(columns), len(row) // columns)
    a = sparse.csc_array((np.concatenate(values, axis=2).ravel(), (row, column)), (rigid + len(own), columns))
    of_modes = sparse.diags_array(np.concatenate([np.zeros(rigid), own]))
    return sparse.csc_array(a @ sparse.diags_array(point_stiffness(points, joints).ravel()) @ a.T + of_modes)


def _deforms(state: State) -> Flags:
    """Which of at most m modes each block has, shape (n m,); empty of rigid blocks."""
    return np.zeros(0, dtype=bool) if state.modes is None else np.asarray(state.modes.inv_mass.ravel() > 0.0)


def default_steps(period: float, least: int = LEAST_STEPS) -> int:
    """Steps of the faster run of a push: forty of the slowest swings, or more.

    Brittle drops need a floor. ``period`` is the slowest swing in steps, ``least`` the floor.
    """
    return max(int(np.ceil(SWINGS * period)), least)


def softest_note(state: State, assembly: Assembly) -> str:
    """What is softest against the rest, in words.

    It is a block against its joints, or a joint against the stiffest one.
    """
    if state.modes is not None:
        # the modes of dem.model.strain_shapes are scaled to K_mode + 2 K_joints = 1 each. A small K_mode is a soft
        # block between stiff joints. Then 1 / K_mode is about 2 K_joints / K_mode
        softest = np.where(state.modes.inv_mass > 0.0, state.modes.stiffness, np.inf).min(axis=1)
        block = int(np.argmin(softest))
        if softest[block] < SOFT_BLOCK:
            return f"block {assembly.blocks[block].name!r} is {1.0 / softest[block]:.2g} times as soft as its joints"
    kn = state.joints.law[:, LAW.kn]
    j = int(np.argmin(kn))
    joint = assembly.joint_text(state.joints.block_a[j], state.joints.block_b[j])
    return f"{joint} is the softest, {kn[j]:.3g} Pa/m against {kn.max():.3g} Pa/m of the stiffest"
