"""Ties along a path: rods between material points of two blocks that pull, yield at their strength and hang loose.

T = k (L - L0 - p), not below zero and not above the strength; p is the plastic elongation, which grows by what the
spring would be stretched beyond its strength and never shrinks. A tie is unstressed in the reference pose and follows
its ends exactly at any rotation: the same law and kinematics as in the DEM.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity.kinematics import Pose, cross_matrix
from limitmason.model.assembly import Assembly
from limitmason.stiffness import TIE_STRETCH, default_tie_stiffness

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class Ties(NamedTuple):
    """What t ties are in the reference pose.

    ``arm_a``, ``arm_b`` lead from the centroids to the ends and ``span`` from end to end [m], (t, 3); ``length`` [m],
    ``stiffness`` [N/m] and ``strength`` [N], (t,).
    """

    block_a: Index
    block_b: Index
    arm_a: Array
    arm_b: Array
    span: Array
    length: Array
    stiffness: Array
    strength: Array


_PLACES = np.zeros((0, 3))
_NUMBERS = np.zeros(0, np.intp)
NO_TIES = Ties(_NUMBERS, _NUMBERS, _PLACES, _PLACES, _PLACES, *(np.zeros(0) for _ in range(3)))


class Pulled(NamedTuple):
    """Ties in a pose: tension [N], plastic elongation [m], dT/dL [N/m], (t,); unit wrenches, (t, 2, d); geometry.

    ``wrenches`` are of a unit tension on blocks a and b; ``elongation`` [m]; ``direction`` from end a to end b and the
    arms to the ends [m], (t, 3); ``length`` [m].
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


def make_ties(assembly: Assembly) -> tuple[Ties, list[str]]:
    """The ties of an assembly, and what a user should know about those without a stiffness."""
    rows = slice(len(assembly.interfaces), None)
    x = assembly.links
    a, b = x.block_a[rows], x.block_b[rows]
    ends = np.array([t.ends for t in assembly.ties]).reshape(-1, 2, 3)
    span = ends[:, 1] - ends[:, 0]
    strength, stiffness = x.compressive_strength[rows].copy(), x.normal_stiffness[rows].copy()
    without = np.isnan(stiffness)
    said = []
    if without.any():
        stiffness[without] = default_tie_stiffness(assembly, strength[without])
        said.append(
            f"{int(without.sum())} of {len(without)} ties name no stiffness: they reach their strength when stretched "
            f"by {TIE_STRETCH:g} of a block; it is not a material property"
        )
    if any(t.governed_by != "yield" for t in assembly.ties):
        said.append("ties hold their strength at any elongation: where bond or an anchor plate governs that is assumed")
    arms = ends[:, 0] - x.centroid[a], ends[:, 1] - x.centroid[b]
    return Ties(a, b, *arms, span, np.linalg.norm(span, axis=1), stiffness, strength), said


def tension(ties: Ties, elongation: Array, plastic: Array) -> tuple[Array, Array, Array]:
    """Tension [N], plastic elongation after it [m], and dT/dL [N/m], at an elongation [m]; all (t,)."""
    tried = ties.stiffness * (elongation - plastic)
    yields = tried > ties.strength
    after = np.where(yields, elongation - ties.strength / ties.stiffness, plastic)
    tangent = np.where(yields | (tried <= 0.0), 0.0, ties.stiffness)
    return np.clip(tried, 0.0, ties.strength), after, tangent


def pull(ties: Ties, basis: Array, pose: Pose, plastic: Array) -> Pulled:
    """The ties in a pose reached from a plastic elongation [m], (t,).

    Parameters
    ----------
    basis : of the degrees of freedom, (6, d)
    """
    a, b = ties.block_a, ties.block_b
    swing_a = np.einsum("tij,tj->ti", pose.turn[a], ties.arm_a)
    swing_b = np.einsum("tij,tj->ti", pose.turn[b], ties.arm_b)
    change = pose.shift[b] - pose.shift[a] + swing_b - swing_a
    now = ties.span + change
    length = np.linalg.norm(now, axis=1)
    # L - L0 without cancellation
    elongation = (change * (ties.span + now)).sum(axis=1) / (length + ties.length)
    direction = now / np.maximum(length, 1e-300)[:, None]
    arm_a, arm_b = ties.arm_a + swing_a, ties.arm_b + swing_b
    on_a = np.concatenate([direction, np.cross(arm_a, direction)], axis=1)
    on_b = -np.concatenate([direction, np.cross(arm_b, direction)], axis=1)
    wrenches = np.stack([on_a @ basis, on_b @ basis], axis=1)
    force, after, tangent = tension(ties, elongation, plastic)
    return Pulled(force, after, tangent, wrenches, elongation, direction, arm_a, arm_b, length)


def stiffness(at: Pulled, basis: Array) -> Array:
    """Change of the wrenches of all ties with the pose, shape (t, 2 d, 2 d): that of their tension, and geometric."""
    d = basis.shape[1]
    flat = at.wrenches.reshape(len(at.tension), 2 * d)
    e = at.direction
    # the direction turns with the ends: T de = T / L (1 - e e') (v_b - v_a)
    across = (at.tension / np.maximum(at.length, 1e-300))[:, None, None] * (np.eye(3) - e[:, :, None] * e[:, None, :])
    a, b, f = cross_matrix(at.arm_a), cross_matrix(at.arm_b), cross_matrix(at.tension[:, None] * e)
    one = np.broadcast_to(np.eye(3), a.shape)
    turned = across @ np.concatenate([-one, a, one, -b], axis=2)  # (t, 3, 12): theta x arm = -[arm] theta
    full = np.concatenate([turned, a @ turned, -turned, -b @ turned], axis=1)
    full[:, 3:6, 3:6] += f @ a
    full[:, 9:12, 9:12] -= f @ b
    p = np.zeros((12, 2 * d))
    p[:6, :d], p[6:, d:] = basis, basis
    # a tie gets longer by minus the power of its unit wrenches
    return np.asarray(p.T @ full @ p - at.tangent[:, None, None] * flat[:, :, None] * flat[:, None, :])
