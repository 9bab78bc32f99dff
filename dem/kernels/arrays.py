"""What compiled functions see of a model: arrays, entries of a law and of sums."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Points(NamedTuple):
    """Contact points of all joints, run after run, as arrays of shape (m,)."""

    s: Array  # place along t1 from the joint's origin [m]
    t: Array  # place along t2 [m]
    area: Array  # tributary area [m2]
    gap: Array  # height over a's face when the joint was made, carried by b; and what is set back [m]
    slip_1: Array  # plastic slip along t1 [m]
    slip_2: Array  # plastic slip along t2 [m]
    lift: Array  # plastic opening w_p [m]
    damage: Array  # 0 peak, 1 residual [-]


class Joints(NamedTuple):
    """Joints: blocks, runs of points, frame in block a, origin in both bodies, law."""

    block_a: Index  # (k,)
    block_b: Index  # (k,)
    start: Index  # first point of each joint, (k + 1,)
    frame: Array  # rows t1, t2, n in the reference axes of block a, (k, 3, 3)
    turn: Array  # quaternion undoing the relative rotation at which the joint was made, (k, 4)
    arm_a: Array  # joint origin from the centroid of a, reference axes of a [m], (k, 3)
    arm_b: Array  # joint origin from the centroid of b, reference axes of b [m], (k, 3)
    offset: Array  # (X_b + arm_b) - (X_a + arm_a) in the reference position [m], (k, 3)
    law: Array  # (k, LAW_SIZE), columns as in LAW and then those of added terms
    edge: Array  # direction of b's edge, reference axes of b, where two edges cross (a's is frame row t1), (k, 3)
    limits: Array  # along a's edge, then b's: from where to where they may cross, 0 where they were made to [m], (k, 4)


class LawRow(NamedTuple):
    """Entries of a joint's law by name; those of added terms follow them."""

    kn: int  # normal stiffness [Pa/m]
    ks: int  # shear stiffness [Pa/m]
    tan_phi: int
    tan_psi: int
    cohesion: int  # c [Pa]
    tension: int  # ft [Pa]
    crushing: int  # closing at which it crushes, fc / kn [m]
    lift: int  # largest plastic opening [m]
    rest_tan_phi: int  # residual values
    rest_tan_psi: int
    rest_cohesion: int
    rest_tension: int
    by_opening: int  # damage per opening beyond the strength [1/m]
    dash: int  # dashpot over stiffness [s]
    cross: int  # 1 where two edges cross
    by_slip: int  # damage per plastic slip [1/m]
    secant: int  # 1 where tension unloads to the origin, which its opening damages


LAW = LawRow(*range(len(LawRow._fields)))
"""Column of every entry."""


class RigidBodies(NamedTuple):
    """Blocks: motion, inverse inertia, held freedoms, wrenches of the last step."""

    shift: Array  # displacement of the centroid [m], (n, 3)
    quat: Array  # rotation from the reference position, scalar first, (n, 4)
    rot: Array  # R - I, (n, 3, 3)
    vel: Array  # velocity at the half step [m/s], (n, 3)
    spin: Array  # angular velocity at the half step [rad/s], (n, 3)
    ang: Array  # angular momentum at the half step [kg m2/s], (n, 3)
    mass: Array  # [kg], or scaled to the step, (n,)
    inv_mass: Array  # 1 / mass, (n,)
    inv_inertia: Array  # inverse inertia about the centroid, reference axes [1/(kg m2)], (n, 3, 3)
    held: NDArray[np.bool_]  # freedoms x, y, z, rx, ry, rz that follow the drives or stand still, (n, 6)
    contact: Array  # wrench of the joints about the centroid in the last step [N, N m], (n, 6)
    net: Array  # contact plus applied wrench, without damping [N, N m], (n, 6)
    axes: Array  # rows along which local damping acts, (n, 3, 3)


class Acting(NamedTuple):
    """What acts on blocks in some steps: load cases, prescribed twists, factors."""

    cases: Array  # wrench per load case and block [N, N m], (c, n, 6), or with its arms, see ``Loads.rows``, (c, n, 15)
    factors: Array  # of the cases, (steps, c)
    drives: Array  # twist per drive and block for the held degrees of freedom, (d, n, 6)
    speeds: Array  # factors of the drives, (steps, d)


class Scheme(NamedTuple):
    """How blocks are stepped, and their artificial damping."""

    dt: float  # [s]
    true_inertia: bool  # angular momentum stays exact in free flight: spin of second order at the half step
    local: float  # local damping, see ``local_damping.brake_of``, 0 for none
    adaptive: float  # wanted power of global damping over the rate of change of kinetic energy, 0 for none
    kinetic_stop: bool  # all free velocities become zero whenever the kinetic energy has passed a peak


class BlockStep(NamedTuple):
    """A step of central differences, damped: v' = (v keep + F kick / m) lag."""

    dt: float  # [s]
    kick: float  # time over which forces act [s]: half a step after a stop
    viscosity: float  # C of the global damping [1/s]
    keep: float  # 1 - C dt / 2
    lag: float  # 1 / (1 + C dt / 2)


class Ties(NamedTuple):
    """Ties: blocks, arms to both ends, reference vector and length, elastic law."""

    block_a: Index  # (t,)
    block_b: Index  # (t,)
    arm_a: Array  # end from the centroid of a, reference axes of a [m], (t, 3)
    arm_b: Array  # end from the centroid of b, reference axes of b [m], (t, 3)
    span: Array  # from end a to end b in the reference position [m], (t, 3)
    length: Array  # of the span [m], (t,)
    stiffness: Array  # [N/m], (t,)
    strength: Array  # [N], (t,)
    plastic: Array  # elongation at which it hangs loose [m], (t,)


E_FRICTION, E_VISCOUS, E_DAMPING, E_APPLIED, E_SUPPORT = 0, 1, 2, 3, 4
E_KINETIC, E_VISCOSITY, E_STEPS, E_STOP, E_FRACTURE, E_BEGUN, E_LENGTH = 5, 6, 7, 8, 9, 10, 11
"""Entries of the vector of accumulated scalars.

Energies taken by friction, by dashpots and by artificial damping, and work of loads and of supports [J]; kinetic energy
now [J], adaptive viscosity [1/s], steps so far, the step of the last stop, energy of fracture [J], the energy that a
run began with [J], and the length of the last step [s].
"""
E_SIZE = 12
"""How many they are."""


class Part(NamedTuple):
    """Some joints, and where their sums go."""

    first: int  # joint
    end: int  # the joint after the last
    row: int  # of ``contact`` of the first block
    sums: int  # entry of the accumulated scalars


class Team(NamedTuple):
    """How a step is shared: runs of joints and blocks are parts, which threads take.

    What comes out depends on the parts, never on who does them: their sums are added in the order of the parts.
    """

    mine: int  # first part of this thread
    end: int  # the part after its last
    parts: int
    sums: Array  # of the parts in two steps, (4 SUMS,); of one part the accumulated scalars themselves
    gate: Index  # see :func:`dem.kernels.threads.meet`


SUMS = 32
"""From a part's sums to the next one's: no two threads write to a line of the cache, nor to the one beside it."""


class BlockModes(NamedTuple):
    """Deformation of blocks: coordinates of shapes, and their effect on joints' sides.

    A side has six numbers a shape, displacement and rotation of the face about the joint's origin along t1, t2 and n.
    """

    value: Array  # coordinates, (n, m)
    rate: Array  # of the coordinates at the half step, (n, m)
    stiffness: Array  # coordinates are such that no two modes share stiffness or mass, (n, m)
    mass: Array  # of each mode, (n, m)
    inv_mass: Array  # 0 where a block has no such mode, (n, m)
    gradient: Array  # mean gradient of the displacement of every shape, reference axes [1/m], (n, m, 3, 3)
    contact: Array  # force of the joints on the modes in the last step, (n, m)
    load: Array  # force of the loads on the modes in the last step, (n, m)
    net: Array  # contact and load less stiffness, without damping, (n, m)
    side_a: Array  # in the joint's frame, (k, m, 6)
    side_b: Array  # in the joint's frame as block b carries it, (k, m, 6)
