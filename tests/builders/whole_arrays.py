"""What a path computes point by point, written for whole arrays: an independent form that compiled sums are held to."""

import numpy as np

from limitmason.capacity.kinematics import Contact
from limitmason.capacity.point_law import PlasticHistory, Returned
from limitmason.geometry.rotation import cross_matrix, rotation_matrices

_FLOOR = 1e-9  # share of the elastic stiffness left in the tangent


def turned(vectors):
    """R - 1 of rotation vectors."""
    return rotation_matrices(vectors) - np.eye(3)


def contact(bodies, pose):
    """Displacements, directions and arms of the points in a pose."""
    a, b = bodies.block_a, bodies.block_b
    turn_a, turn_b = pose.turn[a], pose.turn[b]
    bent = np.einsum("mik,mk->mi", bodies.shapes_a, pose.shapes[a])
    swing_a = bent + np.einsum("mij,mj->mi", turn_a, bodies.arm_a + bent)
    shapes_b = bodies.shapes_b + turn_b @ bodies.shapes_b
    swing_b = np.einsum("mij,mj->mi", turn_b, bodies.arm_b) + np.einsum("mik,mk->mi", shapes_b, pose.shapes[b])
    gap = bodies.offset + pose.shift[b] - pose.shift[a] + swing_b - swing_a
    directions = bodies.directions + np.einsum("mij,mcj->mci", turn_a, bodies.directions)
    displacement = np.einsum("mci,mi->mc", directions, gap)
    return Contact(displacement, directions, bodies.arm_a + swing_a + gap, bodies.arm_b + swing_b, shapes_b)


def point_wrenches(bodies, at):
    """Wrenches of unit forces on both blocks of every point, a first."""
    on_a = [at.directions, np.cross(at.arm_a[:, None], at.directions), bodies.directions @ bodies.shapes_a]
    on_b = [at.directions, np.cross(at.arm_b[:, None], at.directions), at.directions @ at.shapes_b]
    return np.stack([-np.concatenate(on_a, 2) @ bodies.basis, np.concatenate(on_b, 2) @ bodies.basis], axis=2)


def block_wrenches(bodies, wrenches, force):
    """Sums of the point forces on the blocks."""
    out = np.zeros(bodies.free.shape)
    for side, block in enumerate((bodies.block_a, bodies.block_b)):
        np.add.at(out, block, np.einsum("mcd,mc->md", wrenches[:, :, side], force))
    return out


def elements(bodies, at, wrenches, tangent, force, starts):
    """Derivative of the wrenches of every run of points by the motions of its two rigid blocks."""
    (m, c), d = force.shape, bodies.basis.shape[1]
    flat = wrenches.transpose(0, 2, 3, 1).reshape(m, 2 * d, c)
    stiff = flat @ (bodies.area[:, None, None] * tangent) @ flat.transpose(0, 2, 1)
    f = np.einsum("mci,mc->mi", at.directions, force)
    full = np.zeros((m, 12, 12))
    arm_a, arm_b, turns = (cross_matrix(x) for x in (at.arm_a, at.arm_b, f))
    # -[F] theta_a, and d(arm) x F = -[F] d(arm) with d(arm_a) = du_b - du_a - [arm_b] theta_b, d(arm_b) = the last
    full[:, :3, 3:6], full[:, 6:9, 3:6] = turns, -turns
    full[:, 3:6, 3:6], full[:, 9:, 3:6] = arm_a @ turns, -arm_b @ turns
    full[:, 3:6, :3], full[:, 3:6, 6:9] = -turns, turns
    full[:, 3:6, 9:], full[:, 9:, 9:] = -turns @ arm_b, turns @ arm_b
    both = np.zeros((12, 2 * d))
    both[:6, :d] = both[6:, d:] = bodies.basis[:6]
    return np.add.reduceat(both.T @ full @ both - stiff, starts, axis=0)


def returned(law, old, displacement):
    """Return map by the strengths at the start of the step, each case overriding the one before."""
    s, kn, ks, c = law.strength_at(old.damage), law.kn, law.ks, displacement.shape[1]
    n0, shear = kn * (old.lift - displacement[:, 0]), ks[:, None] * (old.slip - displacement[:, 1:])
    size = np.linalg.norm(shear, axis=1)
    along = shear / np.maximum(size, 1e-300)[:, None]
    hardness = ks + kn * s.tan_phi * s.tan_psi
    slip = np.maximum(size - s.shear_strength(n0), 0.0) / hardness
    tip = (slip > 0.0) & (s.shear_strength(n0 + kn * s.tan_psi * slip) < 0.0)
    slip = np.where(tip, size / ks, slip)
    apex = n0 + kn * s.tan_psi * slip <= -s.tension
    slip = np.where(apex, np.maximum(size - s.corner_cohesion, 0.0) / ks, slip)
    normal = np.where(apex, -s.tension, n0 + kn * s.tan_psi * slip)
    lift = old.lift + s.tan_psi * slip
    crushed = normal > s.crushing
    normal = np.minimum(normal, s.crushing)
    slip = np.where(crushed, np.maximum(size - s.shear_strength(normal), 0.0) / ks, slip)
    lift = np.where(crushed, displacement[:, 0] + normal / kn, lift)
    tip, cone, held = tip & ~apex, ~apex & ~tip & (slip > 0.0), size - ks * slip
    sliding = (slip > 0.0) | (s.shear_strength(normal) <= 0.0)
    share = np.where(sliding, held / np.maximum(size, 1e-300), 1.0)
    tangent = np.zeros((len(kn), c, c))
    outer = along[:, :, None] * along[:, None, :]
    tangent[:, 1:, 1:] = (ks * share)[:, None, None] * (np.eye(c - 1) - sliding[:, None, None] * outer)
    mu, flow = s.tan_phi * cone, kn * s.tan_psi * np.where(tip, 1.0 / ks, (cone & ~crushed) / hardness)
    tangent[:, 0, 0] = np.where(apex | crushed, 0.0, kn * (1.0 - flow * mu))
    tangent[:, 0, 1:] = (flow * ks)[:, None] * along
    tangent[:, 1:, 0] = (mu * tangent[:, 0, 0])[:, None] * along
    tangent[:, 1:, 1:] += mu[:, None, None] * along[:, :, None] * tangent[:, 0, None, 1:]
    tangent += _FLOOR * np.minimum(kn, ks)[:, None, None] * np.eye(c)
    stress = np.column_stack([normal, held[:, None] * along])
    return Returned(stress, PlasticHistory(old.slip - slip[:, None] * along, lift, old.damage), tangent)
