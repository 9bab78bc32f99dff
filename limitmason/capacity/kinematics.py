"""Poses of blocks with finite rotations, displacements at the contact points, and the wrenches of their forces.

As in the DEM: a point's frame is carried by block a, forces act at block b's material point, on b and opposite on a.
With p_a and p_b the present places of the two material points that met, delta = D R_a^T (p_b - p_a) is the relative
displacement along the reference directions D = (n, t1, t2) or (n, t): exact at any rotation, without drift. The wrench
matrix of the pose is the exact transpose of its derivative.

Blocks that deform have k shapes beside the rigid motion: p = x + shift + R (arm + sum_j q_j phi_j), phi in the axes of
the block. The frame turns with the block, not with the bending of its face. With k = 0 all blocks are rigid.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.contacts import PathContacts
from limitmason.capacity.deformable import CondensedShapes
from limitmason.capacity.point_law import LARGE
from limitmason.geometry.rotation import cross_matrix, rotation_matrices
from limitmason.mechanics.equilibrium import degrees_of_freedom
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly


class Pose(NamedTuple):
    """Where the blocks are: displacement of the centroids [m], (n, 3), and R - I of the rotations, (n, 3, 3).

    ``shapes`` holds the coordinates of the shapes of blocks that deform, (n, k).
    """

    shift: Array
    turn: Array
    shapes: Array


class ContactGeometry(NamedTuple):
    """What the kinematics needs of m contact points with c components between n blocks of d degrees of freedom.

    A block's degrees of freedom are its d - k rigid ones, then the coordinates of its k shapes.
    """

    block_a: Index  # (m,)
    block_b: Index  # (m,)
    arm_a: Array  # from the centroids to the material points in the reference pose [m], (m, 3)
    arm_b: Array
    offset: Array  # from a's material point to b's in the reference pose [m], (m, 3)
    directions: Array  # reference pose, (m, c, 3)
    area: Array  # [m2], (m,)
    basis: Array  # shift, spin and coordinates of the shapes by each degree of freedom, (6 + k, d)
    free: Flags  # which degrees of freedom are not held, (n, d)
    shapes_a: Array  # displacement of the material points per unit of a shape, axes of their block, (m, 3, k)
    shapes_b: Array
    centroid: Array  # of the blocks in the reference pose [m], (n, 3)

    @property
    def deforming(self) -> int:
        """Number of shapes of a block, k."""
        return self.shapes_a.shape[2]

    @property
    def large(self) -> bool:
        """Whether compiled sums over the points are worth loading, and do for these blocks."""
        return len(self.area) >= LARGE and not self.deforming


class Contact(NamedTuple):
    """The points in a pose.

    Parameters
    ----------
    displacement : of b against a along the directions, opening positive [m], shape (m, c)
    directions : normal and tangents, turned with a, shape (m, c, 3)
    arm_a, arm_b : from the centroids of a and of b to b's point, where the force acts [m], shape (m, 3)
    shapes_b : displacement of b's point per unit of b's shapes, turned with b, shape (m, 3, k)
    """

    displacement: Array
    directions: Array
    arm_a: Array
    arm_b: Array
    shapes_b: Array


def make_bodies(
    assembly: Assembly, points: PathContacts, plane: Plane | None, deformation: CondensedShapes | None = None
) -> ContactGeometry:
    """Arrays of the contact points of an assembly in its reference pose.

    Blocks are rigid without a ``deformation``. Its shapes come behind the six degrees of freedom of every block.

    Parameters
    ----------
    points : contact points in the reference pose
    plane : in which blocks move, with three degrees of freedom; None in space, with six
    deformation : shapes of blocks that deform
    """
    basis, free = degrees_of_freedom(assembly, plane)  # (6, d) and (n, d), see ``ContactGeometry``
    x = assembly.arrays.centroid
    shapes_a = shapes_b = np.zeros((points.count, 3, 0))
    if deformation is not None:
        k = deformation.count
        shapes_a, shapes_b = deformation.shapes_a, deformation.shapes_b
        basis = np.block([[basis, np.zeros((6, k))], [np.zeros((k, basis.shape[1])), np.eye(k)]])
        free = np.hstack([free, deformation.stiffness > 0.0])
    return ContactGeometry(
        block_a=points.block_a, block_b=points.block_b, arm_a=points.place_a - x[points.block_a],
        arm_b=points.place_b - x[points.block_b], offset=points.place_b - points.place_a, directions=points.directions,
        area=points.area, basis=basis, free=free, shapes_a=shapes_a, shapes_b=shapes_b, centroid=x,
    )


def at_rest(n: int, shapes: int = 0) -> Pose:
    """The reference pose of n blocks with so many shapes."""
    return Pose(np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros((n, shapes)))


def moved(pose: Pose, motion: Array) -> Pose:
    """The pose after an increment, shape (n, 6 + k).

    Parameters
    ----------
    motion : shift of the centroids and rotation vector in global axes [m, rad], and change of the shapes' coordinates
    """
    step = rotation_matrices(motion[:, 3:6]) - np.eye(3)
    return Pose(pose.shift + motion[:, :3], pose.turn + step + step @ pose.turn, pose.shapes + motion[:, 6:])


def contact(bodies: ContactGeometry, pose: Pose) -> Contact:
    """Displacements, directions and arms of the points in a pose.

    Parameters
    ----------
    bodies : contact points and blocks in the reference pose
    pose : where the blocks are
    """
    a, b = bodies.block_a, bodies.block_b
    if bodies.large:
        from limitmason.capacity import compiled

        m, c = bodies.directions.shape[:2]
        found = Contact(
            displacement=np.empty((m, c)), directions=np.empty((m, c, 3)), arm_a=np.empty((m, 3)),
            arm_b=np.empty((m, 3)), shapes_b=bodies.shapes_b,
        )
        compiled.contact(
            a, b, bodies.arm_a, bodies.arm_b, bodies.offset, bodies.directions, pose.shift, pose.turn, *found[:4]
        )
        return found
    # how far the end of either arm moves by its block's turn, a rotation less one
    turn_a = pose.turn[a]
    swing_a = np.einsum("mij,mj->mi", turn_a, bodies.arm_a)
    swing_b = np.einsum("mij,mj->mi", pose.turn[b], bodies.arm_b)
    shapes_b = bodies.shapes_b
    if bodies.deforming:
        # and by its deformation, which turns with the block
        bent_a = np.einsum("mik,mk->mi", bodies.shapes_a, pose.shapes[a])
        swing_a = swing_a + bent_a + np.einsum("mij,mj->mi", turn_a, bent_a)
        shapes_b = shapes_b + pose.turn[b] @ shapes_b
        swing_b = swing_b + np.einsum("mik,mk->mi", shapes_b, pose.shapes[b])
    gap = bodies.offset + pose.shift[b] - pose.shift[a] + swing_b - swing_a
    directions = bodies.directions + np.einsum("mij,mcj->mci", turn_a, bodies.directions)
    displacement = np.einsum("mci,mi->mc", directions, gap)
    return Contact(displacement, directions, bodies.arm_a + swing_a + gap, bodies.arm_b + swing_b, shapes_b)


def point_wrenches(bodies: ContactGeometry, at: Contact) -> Array:
    """Wrenches of unit forces on the degrees of freedom of blocks a and b, in this order, shape (m, c, 2, d).

    (-n, -r_a x n) on a and (n, r_b x n) on b, n the direction of the component, times the basis.

    Parameters
    ----------
    bodies : contact points and blocks in the reference pose
    at : the points in a pose
    """
    if bodies.large:
        from limitmason.capacity import compiled

        out = np.empty((*at.displacement.shape, 2, bodies.basis.shape[1]))
        compiled.point_wrenches(at.directions, at.arm_a, at.arm_b, bodies.basis, out)
        return out
    parts_a = [at.directions, _moments(at.arm_a, at.directions)]
    parts_b = [at.directions, _moments(at.arm_b, at.directions)]
    if bodies.deforming:  # a turns its shapes and its frame together
        parts_a.append(bodies.directions @ bodies.shapes_a)
        parts_b.append(at.directions @ at.shapes_b)
    on_a, on_b = np.concatenate(parts_a, axis=2), np.concatenate(parts_b, axis=2)
    return np.stack([-on_a @ bodies.basis, on_b @ bodies.basis], axis=2)


def _moments(arm: Array, directions: Array) -> Array:
    """Vector products of arms, (m, 3), with directions, (m, c, 3): ``numpy.cross`` takes as long to move axes."""
    u, v, w = arm.T[:, :, None]
    x, y, z = (directions[:, :, i] for i in range(3))
    out = np.empty_like(directions)
    out[:, :, 0], out[:, :, 1], out[:, :, 2] = v * z - w * y, w * x - u * z, u * y - v * x
    return out


def block_wrenches(bodies: ContactGeometry, wrenches: Array, force: Array) -> Array:
    """Sum of the point forces [N], (m, c), on the blocks' degrees of freedom [N, N m], shape (n, d).

    Parameters
    ----------
    bodies : contact points and blocks in the reference pose
    wrenches : of unit forces on the two blocks of every point, shape (m, c, 2, d)
    force : of every point along its normal and tangents [N], shape (m, c)
    """
    n, d = bodies.free.shape
    out = np.zeros((n, d))
    if bodies.large:
        from limitmason.capacity import compiled

        compiled.block_wrenches(bodies.block_a, bodies.block_b, wrenches, force, out)
        return out
    pair = np.einsum("mcsd,mc->msd", wrenches, force)
    for k in range(d):
        out[:, k] = np.bincount(bodies.block_a, pair[:, 0, k], n) + np.bincount(bodies.block_b, pair[:, 1, k], n)
    return out


def geometric_stiffness(bodies: ContactGeometry, at: Contact, force: Array, starts: Index) -> Array:
    """Change of the wrenches with the pose at constant force components, rigid motions, shape (k, 2 r, 2 r).

    Summed over runs of points. The force turns with block a; its arm on b turns with b, that on a follows b's point.
    r are the rigid degrees of freedom of a block; what shapes add is :func:`shape_geometry`.

    Parameters
    ----------
    bodies : contact points and blocks in the reference pose
    at : directions and arms in the pose
    force : components of the points [N], shape (m, c)
    starts : first point of every run of points between the same two blocks, shape (k,)
    """
    k, d = len(starts), bodies.basis.shape[1] - bodies.deforming
    f = np.einsum("mci,mc->mi", at.directions, force)

    def crossed(arm: Array) -> Array:
        """[arm] [F] = F arm' - (arm . F) 1, summed over every run."""
        product = f[:, :, None] * arm[:, None, :]
        product[:, [0, 1, 2], [0, 1, 2]] -= (arm * f).sum(axis=1)[:, None]
        return np.asarray(np.add.reduceat(product, starts, axis=0))

    turned, a, b = cross_matrix(np.add.reduceat(f, starts, axis=0)), crossed(at.arm_a), crossed(at.arm_b)
    # rows: force and moment on a, then on b; columns: shift and spin of a, then of b. A spin theta of a turns the force
    # by theta x F = -[F] theta
    full = np.zeros((k, 12, 12))
    full[:, 0:3, 3:6] = turned
    full[:, 6:9, 3:6] = -turned
    full[:, 3:6, 3:6] = a
    full[:, 9:12, 3:6] = -b
    # d(arm) x F = -[F] d(arm); d(arm_a) = du_b - du_a - [arm_b] theta_b, d(arm_b) = -[arm_b] theta_b
    swapped = np.swapaxes(b, 1, 2)  # [F] [arm]
    full[:, 3:6, 0:3] = -turned
    full[:, 3:6, 6:9] = turned
    full[:, 3:6, 9:12] = -swapped
    full[:, 9:12, 9:12] = swapped
    p = np.zeros((12, 2 * d))  # from the degrees of freedom of both blocks to their motions
    p[:6, :d] = p[6:, d:] = bodies.basis[:6, :d]
    return np.asarray(p.T @ full @ p)


def shape_geometry(at: Contact, force: Array) -> tuple[Array, Array]:
    """Change of the moments on a and on b with the shapes of b at constant force components, shapes (m, 3, k).

    With p_b = ... + phi q the arms of the force change by phi dq: dM_a = F x phi dq, dM_b = -dM_a. Transposed they are
    the change of the forces on b's shapes with the spins of a and of b.

    Parameters
    ----------
    at : directions, arms and shapes in the pose
    force : components of the points [N], shape (m, c)
    """
    f = cross_matrix(np.einsum("mci,mc->mi", at.directions, force))
    on_a = f @ at.shapes_b
    return on_a, -on_a


def motion_between(before: Pose, after: Pose) -> Array:
    """The motion of :func:`moved` that takes one pose to another, shape (n, 6 + k).

    Parameters
    ----------
    before, after : the poses, of each block less than half a turn apart
    """
    # the turn between the two less one: half its skew part is sin(angle) times the axis, its trace tells cos(angle)
    step = (after.turn - before.turn) @ np.swapaxes(before.turn + np.eye(3), 1, 2)
    twist = 0.5 * np.stack(
        [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]], axis=1
    )
    sine = np.linalg.norm(twist, axis=1)
    cosine = 1.0 + 0.5 * np.einsum("nii->n", step)  # the trace of a rotation is 1 + 2 cos(angle)
    angle = np.arctan2(sine, cosine)
    # angle / sine is 1 to the last digit below 1e-12
    vector = twist * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 1.0)[:, None]
    return np.concatenate([after.shift - before.shift, vector, after.shapes - before.shapes], axis=1)
