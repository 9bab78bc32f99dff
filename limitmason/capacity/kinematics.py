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
from limitmason.geometry.rotation import axial, cross_matrix
from limitmason.mechanics.equilibrium import degrees_of_freedom
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly

LARGE = 200
"""Contact points from which equations are factored front by front: below, that takes longer than what it saves."""


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
        """Whether fronts are worth their ordering, and do for these blocks."""
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
    from limitmason.capacity import compiled

    shift, turn = pose.shift.copy(), pose.turn.copy()
    compiled.moved(np.ascontiguousarray(motion), shift, turn)
    return Pose(shift, turn, pose.shapes + motion[:, 6:])


def contact(bodies: ContactGeometry, pose: Pose) -> Contact:
    """Displacements, directions and arms of the points in a pose.

    Parameters
    ----------
    bodies : contact points and blocks in the reference pose
    pose : where the blocks are
    """
    from limitmason.capacity import compiled

    b, (m, c) = bodies, bodies.directions.shape[:2]
    found = Contact(
        displacement=np.empty((m, c)), directions=np.empty((m, c, 3)), arm_a=np.empty((m, 3)), arm_b=np.empty((m, 3)),
        shapes_b=np.empty_like(b.shapes_b),
    )
    compiled.contact(
        b.block_a, b.block_b, b.arm_a, b.arm_b, b.offset, b.directions, b.shapes_a, b.shapes_b, *pose, *found
    )
    return found


def point_wrenches(bodies: ContactGeometry, at: Contact) -> Array:
    """Wrenches of unit forces on the degrees of freedom of blocks a and b, in this order, shape (m, c, 2, d).

    (-n, -r_a x n) on a and (n, r_b x n) on b, n the direction of the component, times the basis.

    Parameters
    ----------
    bodies : contact points and blocks in the reference pose
    at : the points in a pose
    """
    from limitmason.capacity import compiled

    out = np.empty((*at.displacement.shape, 2, bodies.basis.shape[1]))
    # a turns its shapes and its frame together
    compiled.point_wrenches(
        at.directions, bodies.directions, at.arm_a, at.arm_b, bodies.shapes_a, at.shapes_b, bodies.basis, out
    )
    return out


def block_wrenches(bodies: ContactGeometry, wrenches: Array, force: Array) -> Array:
    """Sum of the point forces [N], (m, c), on the blocks' degrees of freedom [N, N m], shape (n, d).

    Parameters
    ----------
    bodies : contact points and blocks in the reference pose
    wrenches : of unit forces on the two blocks of every point, shape (m, c, 2, d)
    force : of every point along its normal and tangents [N], shape (m, c)
    """
    from limitmason.capacity import compiled

    out = np.zeros(bodies.free.shape)
    compiled.block_wrenches(bodies.block_a, bodies.block_b, wrenches, force, out)
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
    from limitmason.capacity import compiled

    rigid = bodies.basis.shape[1] - bodies.deforming
    out = np.zeros((len(starts), 2 * rigid, 2 * rigid))
    basis = np.ascontiguousarray(bodies.basis[:6, :rigid])
    compiled.geometric(at.directions, at.arm_a, at.arm_b, force, starts, basis, out)
    return out


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
    twist = 0.5 * axial(np.swapaxes(step, 1, 2))
    sine = np.linalg.norm(twist, axis=1)
    cosine = 1.0 + 0.5 * np.einsum("nii->n", step)  # the trace of a rotation is 1 + 2 cos(angle)
    angle = np.arctan2(sine, cosine)
    # angle / sine is 1 to the last digit below 1e-12
    vector = twist * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 1.0)[:, None]
    return np.concatenate([after.shift - before.shift, vector, after.shapes - before.shapes], axis=1)
