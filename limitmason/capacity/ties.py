"""Ties along a path: their wrenches on the blocks in a pose, and how these change with it."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.capacity.kinematics import Pose
from limitmason.geometry.rotation import cross_matrix, vector_product
from limitmason.mechanics.tie_springs import TieSprings, stretched, tension, tie_springs
from limitmason.model.assembly import Assembly


class Pulled(NamedTuple):
    """Ties in a pose.

    Parameters
    ----------
    tension : T [N], shape (t,)
    plastic : plastic elongation [m], shape (t,)
    tangent : dT/dL [N/m], shape (t,)
    wrenches : of a unit tension on the degrees of freedom of blocks a and b, shape (t, 2, d)
    elongation : L - L0 [m], shape (t,)
    direction : unit vector from end a to end b, shape (t, 3)
    arm_a, arm_b : from the centroids to the ends [m], shape (t, 3)
    length : L [m], shape (t,)
    """

    tension: Array
    plastic: Array
    tangent: Array
    wrenches: Array
    elongation: Array
    direction: Array
    arm_a: Array
    arm_b: Array
    length: Array


def make_ties(assembly: Assembly) -> tuple[TieSprings, list[str]]:
    """The ties of an assembly, and what a user should know about them."""
    ties, said = tie_springs(assembly)
    if all(t.governed_by == "yield" for t in assembly.ties):
        return ties, [*said]
    held = "ties hold their strength at any elongation: where bond or an anchor plate governs that is assumed"
    return ties, [*said, held]


def pull(ties: TieSprings, basis: Array, pose: Pose, plastic: Array) -> Pulled:
    """The ties in a pose reached from a plastic elongation.

    Parameters
    ----------
    ties : springs and their ends
    basis : rigid motion (shift, spin) per degree of freedom of a block, shape (6, d)
    pose : where the blocks are
    plastic : plastic elongation before the step [m], shape (t,)
    """
    if not len(ties.length):
        none, places = np.zeros(0), np.zeros((0, 3))
        return Pulled(
            tension=none, plastic=none, tangent=none, wrenches=np.zeros((0, 2, basis.shape[1])), elongation=none,
            direction=places, arm_a=places, arm_b=places, length=none,
        )
    now = stretched(ties, pose.shift, pose.turn)
    direction = now.span / np.maximum(now.length, 1e-300)[:, None]
    arm_a, arm_b = ties.arm_a + now.swing_a, ties.arm_b + now.swing_b
    on_a = np.concatenate([direction, vector_product(arm_a, direction)], axis=1)
    on_b = -np.concatenate([direction, vector_product(arm_b, direction)], axis=1)
    wrenches = np.stack([on_a @ basis, on_b @ basis], axis=1)
    force, after, tangent = tension(ties, now.elongation, plastic)
    return Pulled(force, after, tangent, wrenches, now.elongation, direction, arm_a, arm_b, now.length)


def stiffness(at: Pulled, basis: Array) -> Array:
    """Change of the wrenches of ties with the pose, minus a stiffness, (t, 2 d, 2 d).

    It is that of their tension, and that by which they turn.

    Parameters
    ----------
    at : tensions, directions and arms in a pose
    basis : from the degrees of freedom to wrenches, shape (6, d)
    """
    d = basis.shape[1]
    flat = at.wrenches.reshape(len(at.tension), 2 * d)
    e = at.direction
    # the direction turns with the ends: T de = T / L (1 - e e') (v_b - v_a)
    across = (at.tension / np.maximum(at.length, 1e-300))[:, None, None] * (np.eye(3) - e[:, :, None] * e[:, None, :])
    # skew matrices of both arms and of the force
    a, b, f = cross_matrix(at.arm_a), cross_matrix(at.arm_b), cross_matrix(at.tension[:, None] * e)
    one = np.broadcast_to(np.eye(3), a.shape)
    turned = across @ np.concatenate([-one, a, one, -b], axis=2)  # (t, 3, 12): theta x arm = -[arm] theta
    # rows: force and moment on a, then on b; columns: shift and spin of a, then of b
    full = np.concatenate([turned, a @ turned, -turned, -b @ turned], axis=1)
    # the arms turn too: (theta x arm) x T e
    full[:, 3:6, 3:6] += f @ a
    full[:, 9:12, 9:12] -= f @ b
    p = np.zeros((12, 2 * d))  # from the degrees of freedom of both blocks to their motions
    p[:6, :d], p[6:, d:] = basis, basis
    # a tie gets longer by minus the power of its unit wrenches
    return np.asarray(p.T @ full @ p - at.tangent[:, None, None] * flat[:, :, None] * flat[:, None, :])
