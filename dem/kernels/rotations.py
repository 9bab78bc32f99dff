"""Rotation of blocks: quaternions, R - I, and spin by angular momentum."""

import numpy as np

from dem.kernels.arrays import Array, RigidBodies
from dem.kernels.compiled import kernel


@kernel(forceinline=True)
def spin_of(rot: Array, inv_inertia: Array, ang: Array, out: Array) -> None:
    """Spin Omega = R J^-1 R^T L of a block.

    Parameters
    ----------
    rot : R - I, shape (3, 3)
    inv_inertia : J^-1 in the block's axes [1/(kg m2)], shape (3, 3)
    ang : angular momentum L in global axes [kg m2/s], shape (3,)
    out : Omega in global axes [rad/s], written, shape (3,)
    """
    b0 = ang[0] + rot[0, 0] * ang[0] + rot[1, 0] * ang[1] + rot[2, 0] * ang[2]
    b1 = ang[1] + rot[0, 1] * ang[0] + rot[1, 1] * ang[1] + rot[2, 1] * ang[2]
    b2 = ang[2] + rot[0, 2] * ang[0] + rot[1, 2] * ang[1] + rot[2, 2] * ang[2]
    w0 = inv_inertia[0, 0] * b0 + inv_inertia[0, 1] * b1 + inv_inertia[0, 2] * b2
    w1 = inv_inertia[1, 0] * b0 + inv_inertia[1, 1] * b1 + inv_inertia[1, 2] * b2
    w2 = inv_inertia[2, 0] * b0 + inv_inertia[2, 1] * b1 + inv_inertia[2, 2] * b2
    out[0] = w0 + rot[0, 0] * w0 + rot[0, 1] * w1 + rot[0, 2] * w2
    out[1] = w1 + rot[1, 0] * w0 + rot[1, 1] * w1 + rot[1, 2] * w2
    out[2] = w2 + rot[2, 0] * w0 + rot[2, 1] * w1 + rot[2, 2] * w2


@kernel(forceinline=True)
def turned_by(q: Array, spin: Array, h: float, out: Array) -> None:
    """Quaternion after a rotation spin h, by the Cayley form (1, spin h / 2) q.

    It is brought to unit length.

    Parameters
    ----------
    q : quaternion before, scalar first, shape (4,)
    spin : [rad/s], shape (3,)
    h : time [s]
    out : quaternion after, written, shape (4,); may be q itself
    """
    x, y, z = 0.5 * h * spin[0], 0.5 * h * spin[1], 0.5 * h * spin[2]
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    r0 = q0 - x * q1 - y * q2 - z * q3
    r1 = q1 + x * q0 + y * q3 - z * q2
    r2 = q2 + y * q0 + z * q1 - x * q3
    r3 = q3 + z * q0 + x * q2 - y * q1
    size = 1.0 / np.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + r3 * r3)
    out[0], out[1], out[2], out[3] = r0 * size, r1 * size, r2 * size, r3 * size


@kernel(forceinline=True)
def rotation_of(q: Array, out: Array) -> None:
    """R - I of a unit quaternion q, scalar first, written to ``out`` (3, 3).

    Nothing cancels at small angles.
    """
    s, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0] = -2.0 * (y * y + z * z)
    out[1, 1] = -2.0 * (x * x + z * z)
    out[2, 2] = -2.0 * (x * x + y * y)
    out[0, 1] = 2.0 * (x * y - s * z)
    out[1, 0] = 2.0 * (x * y + s * z)
    out[0, 2] = 2.0 * (x * z + s * y)
    out[2, 0] = 2.0 * (x * z - s * y)
    out[1, 2] = 2.0 * (y * z - s * x)
    out[2, 1] = 2.0 * (y * z + s * x)


@kernel(inline="always")
def middle_spin(bodies: RigidBodies, i: int, half_step: float, half: Array, trot: Array, out: Array) -> None:
    """Spin at the middle of a step, of second order.

    It is with the axes that block i has there, found in two rounds.

    Parameters
    ----------
    bodies, i : all blocks, and the number of the block
    half_step : half of the step [s]
    half, trot : work space for a quaternion and for R - I, shapes (4,) and (3, 3)
    out : the spin [rad/s], read as a guess and written, shape (3,)
    """
    turned_by(bodies.quat[i], out, half_step, half)
    rotation_of(half, trot)
    spin_of(trot, bodies.inv_inertia[i], bodies.ang[i], out)
    turned_by(bodies.quat[i], out, half_step, half)
    rotation_of(half, trot)
    spin_of(trot, bodies.inv_inertia[i], bodies.ang[i], out)
