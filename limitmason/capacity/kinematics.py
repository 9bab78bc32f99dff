"""Poses of rigid blocks with finite rotations, displacements at the contact points, and the wrenches of their forces.

As in the DEM: a point's frame is carried by block a, forces act at block b's material point, on b and opposite on a.
With p_a and p_b the present places of the two material points that met, delta = D R_a^T (p_b - p_a) is the relative
displacement along the reference directions D = (n, t1, t2) or (n, t): exact at any rotation, without drift. The wrench
matrix of the pose is the exact transpose of its derivative.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity.contacts import Contacts
from limitmason.equilibrium import degrees_of_freedom
from limitmason.geometry.rotation import rotation_matrices
from limitmason.model.assembly import Assembly
from limitmason.plane import Plane

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class Pose(NamedTuple):
    """Where the blocks are: displacement of the centroids [m], (n, 3), and R - I of the rotations, (n, 3, 3)."""

    shift: Array
    turn: Array


class Bodies(NamedTuple):
    """What the kinematics needs of m contact points with c components between n blocks of d degrees of freedom."""

    block_a: Index  # (m,)
    block_b: Index  # (m,)
    arm_a: Array  # from the centroids to the material points in the reference pose [m], (m, 3)
    arm_b: Array
    offset: Array  # from a's material point to b's in the reference pose [m], (m, 3)
    directions: Array  # reference pose, (m, c, 3)
    area: Array  # [m2], (m,)
    basis: Array  # (6, d)
    free: NDArray[np.bool_]  # (n, d)


class Contact(NamedTuple):
    """The points in a pose: relative displacement [m], (m, c); directions, (m, c, 3); arms to b's point [m], (m, 3)."""

    displacement: Array
    directions: Array
    arm_a: Array
    arm_b: Array


def make_bodies(assembly: Assembly, points: Contacts, plane: Plane | None) -> Bodies:
    """Arrays of the contact points of an assembly in its reference pose."""
    basis, free = degrees_of_freedom(assembly, plane)
    x = assembly.arrays.centroid
    return Bodies(
        points.block_a, points.block_b, points.place_a - x[points.block_a], points.place_b - x[points.block_b],
        points.place_b - points.place_a, points.directions, points.area, basis, free,
    )  # fmt: skip


def at_rest(n: int) -> Pose:
    """The reference pose of n blocks."""
    return Pose(np.zeros((n, 3)), np.zeros((n, 3, 3)))


def moved(pose: Pose, motion: Array) -> Pose:
    """The pose after an increment: shift of the centroids and rotation vector in global axes [m, rad], (n, 6)."""
    step = rotation_matrices(motion[:, 3:]) - np.eye(3)
    return Pose(pose.shift + motion[:, :3], pose.turn + step + step @ pose.turn)


def contact(bodies: Bodies, pose: Pose) -> Contact:
    """Displacements, directions and arms of the points in a pose."""
    a, b = bodies.block_a, bodies.block_b
    turn_a = pose.turn[a]
    swing_a = np.einsum("mij,mj->mi", turn_a, bodies.arm_a)
    swing_b = np.einsum("mij,mj->mi", pose.turn[b], bodies.arm_b)
    gap = bodies.offset + pose.shift[b] - pose.shift[a] + swing_b - swing_a
    directions = bodies.directions + np.einsum("mij,mcj->mci", turn_a, bodies.directions)
    displacement = np.einsum("mci,mi->mc", directions, gap)
    return Contact(displacement, directions, bodies.arm_a + swing_a + gap, bodies.arm_b + swing_b)


def point_wrenches(bodies: Bodies, at: Contact) -> Array:
    """Wrenches of unit forces on blocks a and b, projected on their degrees of freedom, shape (m, c, 2, d)."""
    on_a = np.concatenate([at.directions, np.cross(at.arm_a[:, None], at.directions)], axis=2)
    on_b = np.concatenate([at.directions, np.cross(at.arm_b[:, None], at.directions)], axis=2)
    return np.stack([-on_a @ bodies.basis, on_b @ bodies.basis], axis=2)


def block_wrenches(bodies: Bodies, wrenches: Array, force: Array) -> Array:
    """Sum of the point forces [N], (m, c), on the blocks' degrees of freedom [N, N m], shape (n, d)."""
    n, d = bodies.free.shape
    pair = np.einsum("mcsd,mc->msd", wrenches, force)
    out = np.zeros((n, d))
    for k in range(d):
        out[:, k] = np.bincount(bodies.block_a, pair[:, 0, k], n) + np.bincount(bodies.block_b, pair[:, 1, k], n)
    return out


def geometric_stiffness(bodies: Bodies, at: Contact, force: Array) -> Array:
    """Change of the point wrenches with the pose at constant force components, shape (m, 2 d, 2 d).

    The force turns with block a; its arm on b turns with b, that on a follows b's point.
    """
    m, d = len(force), bodies.basis.shape[1]
    f = _cross_matrix(np.einsum("mci,mc->mi", at.directions, force))
    a, b = _cross_matrix(at.arm_a), _cross_matrix(at.arm_b)
    # rows: force and moment on a, then on b; columns: shift and spin of a, then of b. theta x F = -[F] theta
    full = np.zeros((m, 12, 12))
    full[:, 0:3, 3:6] = f
    full[:, 6:9, 3:6] = -f
    full[:, 3:6, 3:6] = a @ f
    full[:, 9:12, 3:6] = -b @ f
    # d(arm) x F = -[F] d(arm); d(arm_a) = du_b - du_a - [arm_b] theta_b, d(arm_b) = -[arm_b] theta_b
    full[:, 3:6, 0:3] = -f
    full[:, 3:6, 6:9] = f
    full[:, 3:6, 9:12] = -f @ b
    full[:, 9:12, 9:12] = f @ b
    p = np.zeros((12, 2 * d))
    p[:6, :d], p[6:, d:] = bodies.basis, bodies.basis
    return p.T @ full @ p


def _cross_matrix(v: Array) -> Array:
    k = np.zeros((len(v), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return k - np.swapaxes(k, 1, 2)


def motion_between(before: Pose, after: Pose) -> Array:
    """Shift and rotation vector in global axes that take one pose to another, shape (n, 6); below half a turn."""
    step = (after.turn - before.turn) @ np.swapaxes(before.turn + np.eye(3), 1, 2)
    twist = 0.5 * np.stack(
        [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]], axis=1
    )
    sine = np.linalg.norm(twist, axis=1)
    cosine = 1.0 + 0.5 * np.einsum("nii->n", step)
    angle = np.arctan2(sine, cosine)
    vector = twist * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 1.0)[:, None]
    return np.concatenate([after.shift - before.shift, vector], axis=1)
