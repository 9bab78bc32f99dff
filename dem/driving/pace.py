"""How fast a structure may be driven: its slowest swing in steps of scaled masses, and how many a push should take."""

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


def slowest_period(assembly: Assembly, state: State, loads: Loads) -> float:
    """Steps of the slowest swing of closed, elastic joints on the scaled masses of a state, by Rayleigh's quotient.

    omega^2 = u K u / u M u with K u = f, f the dead loads and then M u once more: below the exact value by the square
    of what the shape lacks. Joints that open make it longer.
    """
    k = tangent(assembly, state)
    free = np.flatnonzero(np.concatenate([~state.bodies.held.ravel(), _deforms(state)]))
    b = state.bodies
    inertia = np.linalg.inv(b.inv_inertia)
    blocks = [part for m, j in zip(b.mass, inertia, strict=True) for part in (m * np.eye(3), j)]
    if state.modes is not None:
        blocks.append(sparse.diags_array(state.modes.mass.ravel()))
    mass = sparse.csc_array(sparse.block_diag(blocks, format="csc"))[free][:, free]
    k = sparse.csc_array(k[free][:, free])
    # blocks that nothing holds but friction across: a trifle of stiffness, shared as mass is, keeps the matrix regular
    lift = 1e-9 * float((k.diagonal() / mass.diagonal()).max())
    solve = splu(sparse.csc_array(k + lift * mass)).solve
    u = solve(np.concatenate([loads.dead.ravel(), np.zeros(_deforms(state).size)])[free])
    for _ in range(2):
        u = solve(mass @ u)
        u /= np.linalg.norm(u)
    return float(2.0 * np.pi * np.sqrt((u @ (mass @ u)) / (u @ (k @ u))) / state.dt)


def tangent(assembly: Assembly, state: State) -> sparse.csc_array:
    """Stiffness matrix of a state with its joints closed and elastic.

    All motions of the blocks come first, then their modes. The shape is (6 n, 6 n), or (6 n + n m, 6 n + n m) for
    blocks with m modes.
    """
    p, j, x = state.points, state.joints, state.modes
    n, owner = 6 * assembly.n_blocks, owners(j)
    more = np.zeros(0) if x is None else x.stiffness.ravel()
    rows, values = [], []
    for block, arm, side, sign in (
        (j.block_a, j.arm_a, None if x is None else x.side_a, -1.0),
        (j.block_b, j.arm_b, None if x is None else x.side_b, 1.0),
    ):
        values.append(sign * point_motions(p, j, arm, j.frame, side))
        rows.append(block[owner][:, None] * 6 + np.arange(6))
        k = values[-1].shape[2] - 6
        rows.append(n + block[owner][:, None] * k + np.arange(k))
    m = len(owner)
    row = np.repeat(np.concatenate(rows, axis=1)[:, None], 3, axis=1).ravel()
    column = np.repeat(np.arange(3 * m), len(row) // (3 * m))
    a = sparse.csc_array((np.concatenate(values, axis=2).ravel(), (row, column)), (n + len(more), 3 * m))
    own = sparse.diags_array(np.concatenate([np.zeros(n), more]))
    return sparse.csc_array(a @ sparse.diags_array(point_stiffness(p, j).ravel()) @ a.T + own)


def _deforms(state: State) -> Flags:
    """Which modes of the blocks there are, shape (n m,)."""
    return np.zeros(0, dtype=bool) if state.modes is None else np.asarray(state.modes.inv_mass.ravel() > 0.0)


def default_steps(period: float, least: int = LEAST_STEPS) -> int:
    """Steps of the faster run of a push: forty of the slowest swings, and not fewer than a floor for brittle drops."""
    return max(int(np.ceil(SWINGS * period)), least)


def softest_note(state: State, assembly: Assembly) -> str:
    """What is softest against the rest, in words: a block against its joints, or a joint against the stiffest one."""
    if state.modes is not None:
        # the modes of dem.model.strain_shapes are scaled to K_mode + 2 K_joints = 1 each: a small K_mode is a soft
        # block between stiff joints, and 1 / K_mode about twice K_joints over it
        part = np.where(state.modes.inv_mass > 0.0, state.modes.stiffness, np.inf).min(axis=1)
        i = int(np.argmin(part))
        if part[i] < SOFT_BLOCK:
            return f"block {assembly.blocks[i].name!r} is {1.0 / part[i]:.2g} times as soft as its joints"
    kn = state.joints.law[:, LAW.kn]
    j = int(np.argmin(kn))
    joint = assembly.joint_text(state.joints.block_a[j], state.joints.block_b[j])
    return f"{joint} is the softest, {kn[j]:.3g} Pa/m against {kn.max():.3g} Pa/m of the stiffest"
