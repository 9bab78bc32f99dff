"""Stable time step, and the masses that let every block settle at the same pace.

Throughout, ``points`` and ``joints`` are all of them, ``stiffness`` is that of every block in its axes [N/m, N, N m],
shape (n, 6 + k, 6 + k), ``mass`` [kg] has shape (n,) and ``inertia`` [kg m2] (n, 3, 3). ``safety`` is the fraction of
the bound of the stable step ``dt`` [s] that is used.
"""

import numpy as np
from numpy.typing import NDArray

from dem.kernels import LAW, Joints, Points, Ties, add_springs
from limitmason.arrays import Array, Flags, Index
from limitmason.mechanics.joint_shapes import motion_at
from limitmason.multifrontal.dissection import ragged_ranges

SAFETY = 0.65
"""Fraction of the bound of the stable step that is used by default.

Local damping up to 0.8 makes a block that slows down 1.8 times as stiff, and 0.9 falls into a limit cycle.
"""

FLOOR = 0.02
"""Least rotational stiffness that inertia follows, over the largest: about no axis it is next to nothing; chosen."""


def point_motions(points: Points, joints: Joints, arm: Array, frame: Array, side: Array | None = None) -> Array:
    """Displacement of every point by the motions of one of its blocks.

    Along t1, t2, n, by six rigid motions and k shapes, shape (m, 3, 6 + k).

    Parameters
    ----------
    arm : joint origins from the centroid of that block, in its axes [m], shape (joints, 3)
    frame : rows t1, t2, n of the joints in the axes of that block, shape (joints, 3, 3)
    side : what its shapes do to the joints' faces, see :class:`dem.kernels.BlockModes`; None of rigid blocks
    """
    owner = owners(joints)
    axes = frame[owner]
    r = arm[owner] + points.s[:, None] * axes[:, 0] + points.t[:, None] * axes[:, 1]
    # (w x r) . e = w . (r x e)
    parts = [axes, np.cross(r[:, None], axes)]
    if side is not None:
        parts.append(motion_at(np.column_stack([points.s, points.t])) @ side[owner].transpose(0, 2, 1))
    return np.concatenate(parts, axis=2)


def point_stiffness(points: Points, joints: Joints) -> Array:
    """Stiffness of every point along t1, t2, n [N/m], shape (m, 3)."""
    return np.asarray(joints.law[:, [LAW.ks, LAW.ks, LAW.kn]][owners(joints)] * points.area[:, None])


def owners(joints: Joints) -> Index:
    """Joint of every point, shape (m,)."""
    return np.repeat(np.arange(len(joints.block_a)), np.diff(joints.start))


def points_of(joints: Joints, rows: Index) -> Index:
    """Numbers of the points of the joints ``rows``, joint after joint in that order."""
    return ragged_ranges(joints.start[rows], np.diff(joints.start)[rows])[0]


def block_stiffness(
    points: Points, joints: Joints, n_blocks: int, rotation: Array | None = None, ties: Ties | None = None,
    wanted: Flags | None = None,
) -> Array:
    """Stiffness that each block feels when only it moves, shape (n, 6, 6).

    Every joint is closed; units are [N/m, N, N m].

    K = sum over its points of k A g g^T, g = (e, r x e) for the normal and both tangents e, in the block's own axes.

    Parameters
    ----------
    n_blocks : how many blocks there are
    rotation : matrix of every block from the reference position, shape (n, 3, 3); none by default
    ties : taut, which adds k g g^T along each; the little that a force across it adds, T / L, is left out
    wanted : blocks that are asked for, all by default, shape (n,); the others' stiffness is zero
    """
    turn = np.tile(np.eye(3), (n_blocks, 1, 1)) if rotation is None else rotation
    wanted = np.ones(n_blocks, dtype=bool) if wanted is None else wanted
    out = np.zeros((n_blocks, 6, 6))
    for of_b, block in ((False, joints.block_a), (True, joints.block_b)):
        rows = np.flatnonzero(wanted[block])
        frame = joints.frame[rows]
        if of_b:
            # the frame is given in the axes of a; seen from b it is turned by the present relative rotation
            frame = frame @ np.swapaxes(turn[joints.block_a[rows]], 1, 2) @ turn[joints.block_b[rows]]
        add_springs(points, joints, rows, of_b, np.ascontiguousarray(frame), out)
    if ties is not None and len(ties.block_a):
        along = ties.span / ties.length[:, None]
        for block, arm in ((ties.block_a, ties.arm_a), (ties.block_b, ties.arm_b)):
            # direction of the tie in the axes of the block
            own = np.einsum("tji,tj->ti", turn[block], along)
            g = np.concatenate([own, np.cross(arm, own)], axis=1)
            np.add.at(out, block, ties.stiffness[:, None, None] * g[:, :, None] * g[:, None, :])
    return out


def springs_of_blocks(
    points: Points, joints: Joints, n_blocks: int, seen: Array, sides: tuple[Array, Array]
) -> Array:
    """Stiffness that each block with m shapes feels when only it moves, joints closed.

    It is the sum of k A g g^T over its points, shape (n, 6 + m, 6 + m). There g is the displacement of a point along
    t1, t2 or n by six rigid motions and the shapes; k is ks, ks or kn.

    Parameters
    ----------
    n_blocks : how many blocks there are
    seen : frames of the joints in the axes of block b, shape (joints, 3, 3)
    sides : what the shapes of a and b do to the joints' faces, see :class:`dem.kernels.BlockModes`
    """
    stiff = point_stiffness(points, joints)
    size = 6 + sides[0].shape[1]
    out = np.zeros((n_blocks, size, size))
    for block, arm, frame, side in (
        (joints.block_a, joints.arm_a, joints.frame, sides[0]), (joints.block_b, joints.arm_b, seen, sides[1]),
    ):
        g = point_motions(points, joints, arm, frame, side)
        part = np.einsum("mk,mki,mkj->mij", stiff, g, g)
        # the points of a joint stand together: their sum first, then those of every block's joints
        np.add.at(out, block, np.add.reduceat(part, joints.start[:-1], axis=0) if len(part) else part[:0])
    return out


def largest_squares(stiffness: Array, mass: Array, inertia: Array, others: Array | None = None) -> Array:
    """Largest w^2 of M^-1 K of every block alone [1/s2], shape (n,).

    M is made of its mass, its inertia tensor and the masses of its shapes.

    Parameters
    ----------
    stiffness : K of every block in its motions and shapes [N/m, N, N m], shape (n, 6 + k, 6 + k)
    mass, inertia : [kg] and [kg m2], shapes (n,) and (n, 3, 3)
    others : masses of its k shapes, shape (n, k); None for rigid blocks
    """
    # M^(-1/2) K M^(-1/2) is symmetric and has the same eigenvalues
    value, axes = np.linalg.eigh(inertia)
    scale = np.zeros_like(stiffness)
    scale[:, :3, :3] = np.eye(3) / np.sqrt(mass)[:, None, None]
    scale[:, 3:6, 3:6] = (axes / np.sqrt(value)[:, None]) @ axes.transpose(0, 2, 1)
    if others is not None:
        k = np.arange(6, stiffness.shape[1])
        scale[:, k, k] = 1.0 / np.sqrt(others)
    return np.asarray(np.linalg.eigvalsh(scale @ stiffness @ scale)[:, -1])


def scaled_masses(stiffness: Array, dt: float, safety: float) -> tuple[Array, Array]:
    """Mass and inertia with which every block is as fast as the time step allows.

    The elongation of every spring is e = e_b - e_a by the motions of its two blocks. As e^2 <= 2 e_a^2 + 2 e_b^2,
    w_max^2 <= 2 max_i lambda(M_i^-1 K_i), and central differences are stable for dt <= 2 / w_max. The inertia follows
    the rotational stiffness, eigenvalues not below :data:`FLOOR` times the largest.

    Parameters
    ----------
    stiffness : K_i of every block when it alone moves [N/m, N, N m], shape (n, 6, 6)
    dt, safety : time step [s], and the part of its bound that it is to be [-]

    Returns
    -------
    mass : [kg], shape (n,), 1 where a block has no joint
    inertia : [kg m2], shape (n, 3, 3)
    """
    n = len(stiffness)
    mass, inertia = np.ones(n), np.tile(np.eye(3), (n, 1, 1))
    size = np.trace(stiffness, axis1=1, axis2=2)
    rows = np.flatnonzero(size > 0.0)
    # stiffness is divided by a power of two near its size, which is exact. A model scaled by a power of two then takes
    # the same path to the bit
    unit = np.ldexp(1.0, np.frexp(size[rows])[1] - 1)
    k = stiffness[rows] / unit[:, None, None]
    m = np.linalg.eigvalsh(k[:, :3, :3])[:, -1]
    # rotational stiffness about the centroid, about which the equations of motion turn a block; about the centre of
    # stiffness it is least
    value, axes = np.linalg.eigh(k[:, 3:, 3:])
    j = (axes * np.maximum(value, FLOOR * value[:, -1:])[:, None]) @ axes.transpose(0, 2, 1)
    # from mass m and inertia j, by which a block has the frequencies of largest_squares, to those of the step
    factor = 2.0 * largest_squares(k, m, j) * dt**2 / (4.0 * safety**2)
    mass[rows], inertia[rows] = m * factor * unit, j * factor[:, None, None] * unit[:, None, None]
    return mass, inertia


def stable_step(
    stiffness: Array, mass: Array, inertia: Array, free: NDArray, joints: Joints, safety: float, top: float = 0.0
) -> float:
    """Time step [s] for real masses, infinite where no motion has a stiffness.

    It is safety 2 / w_max (sqrt(1 + z^2) - z), with z = dashpot w_max / 2 the part of critical damping.

    Parameters
    ----------
    stiffness : of every block when it alone moves [N/m, N, N m], shape (n, 6, 6)
    mass, inertia : [kg] and [kg m2], shapes (n,) and (n, 3, 3)
    free : blocks that may move, shape (n,)
    joints : all of them, of which the largest dashpot counts
    safety : part of the bound of the stable step that is used [-]
    top : half of the w_max^2 that other motions have, as of blocks that deform [1/s2]
    """
    rows = np.flatnonzero(free & (np.trace(stiffness, axis1=1, axis2=2) > 0.0))
    top = float(largest_squares(stiffness[rows], mass[rows], inertia[rows]).max(initial=top))
    if top == 0.0:
        return np.inf
    fastest = np.sqrt(2.0 * top)
    z = 0.5 * float(joints.law[:, LAW.dash].max(initial=0.0)) * fastest
    return safety * 2.0 / fastest * (np.sqrt(1.0 + z * z) - z)
