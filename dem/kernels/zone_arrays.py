"""What compiled functions see of zones: nodes, tables, sides, points, blocks."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.kernels.arrays import Array, Index


class Nodes(NamedTuple):
    """Nodes of all blocks: places [m], motion, mass, forces, their rigid block."""

    place: Array  # reference position, (n, 2)
    shift: Array  # displacement [m], (n, 2)
    velocity: Array  # at the half step [m/s], (n, 2)
    mass: Array  # [kg], or scaled to a step of 1, (n,)
    load: Array  # applied force [N], (n, 2)
    force: Array  # written: of zones, joints and loads in the last step [N], (n, 2)
    body: Index  # rigid block, -1 for a node of a zone, (n,)
    before: Array  # force in the step before [N], (n, 2)
    held: NDArray[np.bool_]  # freedoms of zones' nodes that keep the velocity they have, (n, 2)


class Zones(NamedTuple):
    """Zones and their plastic state."""

    node: Index  # four nodes, counter-clockwise, (e, 4)
    kind: Index  # row of the tables of shapes, (e,)
    material: Index  # row of the table of materials, (e,)
    spent: Array  # D eps_p: stress taken away by plastic strain xx, zz, xz, yy [Pa], (e, 4, 4)
    relief: Array  # its nodal forces in the zone's axes [N], (e, 8)
    amplitude: Array  # of the enhanced modes [m], (e, 4)
    flag: Index  # of every stress point, flags ``SHEAR_NOW`` and the like of ``zone_plasticity``, (e, 4)
    plastic: Array  # accumulated length of the plastic strain [-], (e, 4)


class QuadTable(NamedTuple):
    """Tables of zone shapes and materials."""

    stiffness: Array  # enhanced modes condensed [N/m], (k, 8, 8)
    strain: Array  # xx, zz, 2 xz at every stress point by nodal displacements [1/m], (k, 4, 3, 8)
    release: Array  # enhanced modes by the stress that plastic strain takes away at a point [m/Pa], (k, 4, 4, 3)
    modes: Array  # strains at every stress point by enhanced modes [1/m], (k, 4, 3, 4)
    weight: Array  # volume of every stress point [m3], (k, 4)
    gradient: Array  # of the nodes' shape functions at the middle, x and z [1/m], (k, 4, 2)
    material: Array  # rows of materials, columns ``MAT_...``, (m, MAT_SIZE)


class Sides(NamedTuple):
    """Sides of blocks: chains of nodes, counter-clockwise."""

    node: Index  # nodes of all chains, one chain after another
    start: Index  # first entry of every side in ``node``, (s + 1,)
    arc: Array  # reference distance of every chain entry from the side's first node [m]


class SideContacts(NamedTuple):
    """Contact points and their plastic state."""

    joint: Index  # row of the law, (m,)
    side: Index  # side of block a, (m,)
    segment: Index  # chain entry at which the segment of a begins that the point lies at now, (m,)
    arc: Array  # reference place along the side of a [m], (m,)
    node: Index  # both nodes of b, (m, 2)
    share: Array  # of the second of them, (m,)
    area: Array  # tributary area [m2], (m,)
    gap: Array  # opening less the distance in the reference position [m], (m,)
    slip: Array  # plastic slip [m], (m,)
    lift: Array  # plastic opening [m], (m,)
    damage: Array  # 0 peak, 1 residual [-], (m,)
    opening: Array  # in the last step [m], (m,)
    along: Array  # slip in the last step, elastic and plastic [m], (m,)


class Rigid(NamedTuple):
    """Rigid blocks: motion x, z and turn, masses, held freedoms and their velocity."""

    centre: Array  # in the reference position, x and z [m], (b, 2)
    shift: Array  # displacement x and z [m], turn [rad], (b, 3)
    velocity: Array  # at the half step [m/s, rad/s], (b, 3)
    mass: Array  # mass, mass, inertia, (b, 3)
    load: Array  # force x and z [N], moment from x to z [N m], (b, 3)
    arms: Array  # sum of r f^T of the loads, r from the centre [N m], (b, 2, 2)
    held: NDArray[np.bool_]  # (b, 3)
    drive: Array  # velocity of held freedoms [m/s, rad/s], (b, 3)
    before: Array  # net in the step before [N, N m], (b, 3)
    net: Array  # written: joints and loads in the last step [N, N m], (b, 3)
    total: Array  # written: net summed over the steps of a call [N, N m], (b, 3)
    node: Index  # numbers of the nodes of all rigid blocks


class ZonedArrays(NamedTuple):
    """All that the steps of zoned blocks change or read."""

    nodes: Nodes
    zones: Zones
    tables: QuadTable
    sides: Sides
    contacts: SideContacts
    rigid: Rigid
    law: Array  # rows of the joint law, (k, LAW_SIZE)
    soft: bool  # whether a joint has residual values or added terms
    total: Array  # accumulated sums, see the ``Z_`` entries, (Z_SIZE,)


Z_APPLIED, Z_SUPPORT, Z_FRICTION, Z_FRACTURE, Z_PLASTIC, Z_DAMPING = 0, 1, 2, 3, 4, 5
Z_KINETIC, Z_STEPS, Z_MISSED = 6, 7, 8
"""Entries of the accumulated sums: works and losses [J], steps, returns that met no combination of planes."""
Z_SIZE = 9
Z_LOST = slice(Z_FRICTION, Z_KINETIC)
"""What is lost: friction, fracture, plastic work, damping [J]."""
