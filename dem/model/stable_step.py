"""Stable time step, and the masses that let every block settle at the same pace."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dem.kernels import LAW, Joints, Points, Ties
from limitmason.arrays import Array, Index
from limitmason.mechanics.joint_shapes import motion_at


def point_motions(points: Points, joints: Joints, arm: Array, frame: Array, side: Array | None = None) -> Array:
    """Displacement of every point along t1, t2, n by the motions of one of its blocks and by its shapes, (m, 3, 6 + k).

    Parameters
    ----------
    arm, frame : of the joints, in the axes of that block, shapes (joints, 3), (joints, 3, 3)
    side : what its shapes do to the joints' faces, see :class:`dem.kernels.BlockModes`; None of rigid blocks
    """
    owner = owners(joints)
    axes = frame[owner]
    r = arm[owner] + points.s[:, None] * axes[:, 0] + points.t[:, None] * axes[:, 1]
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


def block_stiffness(
    points: Points, joints: Joints, n_blocks: int, rotation: Array | None = None, ties: Ties | None = None
) -> Array:
    """Stiffness each block feels when only it moves and every joint is closed [N/m, N, N m], shape (n, 6, 6).

    K = sum over its points of k A g g^T, g = (e, r x e) for the normal and both tangents e, in the block's own axes.

    Parameters
    ----------
    rotation : of every block from the reference position, shape (n, 3, 3); none by default
    ties : taut, which adds k g g^T along each; the little that a force across it adds, T / L, is left out
    """
    turn = np.tile(np.eye(3), (n_blocks, 1, 1)) if rotation is None else rotation
    # the frame is given in the axes of a; seen from b it is turned by the present relative rotation
    seen = joints.frame @ np.swapaxes(turn[joints.block_a], 1, 2) @ turn[joints.block_b]
    out = springs_of_blocks(points, joints, n_blocks, seen)
    if ties is not None and len(ties.block_a):
        along = ties.span / ties.length[:, None]
        for block, arm in ((ties.block_a, ties.arm_a), (ties.block_b, ties.arm_b)):
            own = np.einsum("tji,tj->ti", turn[block], along)
            g = np.concatenate([own, np.cross(arm, own)], axis=1)
            np.add.at(out, block, ties.stiffness[:, None, None] * g[:, :, None] * g[:, None, :])
    return out


def springs_of_blocks(
    points: Points, joints: Joints, n_blocks: int, seen: Array, sides: tuple[Array, Array] | None = None
) -> Array:
    """Sums of k A g g^T over the points of every block, with its shapes where ``sides`` are given, (n, 6 + k, 6 + k).

    Parameters
    ----------
    seen : frames of the joints in the axes of block b, shape (joints, 3, 3)
    """
    stiff = point_stiffness(points, joints)
    one, two = (None, None) if sides is None else sides
    size = 6 if one is None else 6 + one.shape[1]
    out = np.zeros((n_blocks, size, size))
    for block, arm, frame, side in (
        (joints.block_a, joints.arm_a, joints.frame, one), (joints.block_b, joints.arm_b, seen, two),
    ):  # fmt: skip
        g = point_motions(points, joints, arm, frame, side)
        part = np.einsum("mk,mki,mkj->mij", stiff, g, g)
        np.add.at(out, block, np.add.reduceat(part, joints.start[:-1], axis=0) if len(part) else part[:0])
    return out


def largest_square(stiffness: Array, mass: float, inertia: Array, others: ArrayLike = ()) -> float:
    """Largest w^2 of M^-1 K of one block [1/s2], M its mass, inertia tensor and those of its shapes, shape (k,)."""
    value, axes = np.linalg.eigh(inertia)
    scale = np.zeros_like(stiffness)
    scale[:3, :3] = np.eye(3) / np.sqrt(mass)
    scale[3:6, 3:6] = (axes / np.sqrt(value)) @ axes.T
    scale[6:, 6:] = np.diag(1.0 / np.sqrt(others))
    return float(np.linalg.eigvalsh(scale @ stiffness @ scale)[-1])


def scaled_masses(stiffness: Array, dt: float, safety: float, floor: float = 0.02) -> tuple[Array, Array]:
    """Mass and inertia tensor with which every block is as fast as the time step allows.

    With e = e_b - e_a in every spring, e^2 <= 2 e_a^2 + 2 e_b^2, so w_max^2 <= 2 max_i lambda(M_i^-1 K_i), and central
    differences are stable for dt <= 2 / w_max. The inertia follows the rotational stiffness, eigenvalues not below
    ``floor`` of the largest.

    Returns
    -------
    mass : shape (n,), 1 where a block has no joint
    inertia : shape (n, 3, 3)
    """
    n = len(stiffness)
    mass, inertia = np.ones(n), np.tile(np.eye(3), (n, 1, 1))
    for i in range(n):
        k = stiffness[i]
        if not np.trace(k) > 0.0:
            continue
        # a root of twice a number has other bits: in units of a power of two the density does not show in the path
        unit = 2.0 ** np.floor(np.log2(np.trace(k)))
        k = k / unit
        m = np.linalg.eigvalsh(k[:3, :3])[-1]
        # about the centre of stiffness the arms are shortest; about the centroid is where the block turns
        value, axes = np.linalg.eigh(k[3:, 3:])
        j = (axes * np.maximum(value, floor * value[-1])) @ axes.T
        top = largest_square(k, m, j)
        factor = 2.0 * top * dt**2 / (4.0 * safety**2)
        mass[i], inertia[i] = m * factor * unit, j * factor * unit
    return mass, inertia


def stable_step(
    stiffness: Array, mass: Array, inertia: Array, free: NDArray, joints: Joints, safety: float, top: float = 0.0
) -> float:
    """Time step [s] for real masses: safety 2 / w_max (sqrt(1 + z^2) - z), z = dashpot w_max / 2.

    It is infinite where no motion has a stiffness.

    ``top`` is half of w_max^2 that other motions have, as of blocks that deform.
    """
    for i in np.flatnonzero(free):
        if not np.trace(stiffness[i]) > 0.0:
            continue
        top = max(top, largest_square(stiffness[i], mass[i], inertia[i]))
    if top == 0.0:
        return np.inf
    fastest = np.sqrt(2.0 * top)
    z = 0.5 * float(joints.law[:, LAW.dash].max(initial=0.0)) * fastest
    return safety * 2.0 / fastest * (np.sqrt(1.0 + z * z) - z)
