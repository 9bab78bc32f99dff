"""What the compiled functions see of zones in space: hexahedra, tables, facets of blocks, contacts, rigid blocks.

Nodes are those of the plane with three freedoms each (:class:`dem.kernels.zone_arrays.Nodes`).
"""

from typing import NamedTuple

from numpy import bool_
from numpy.typing import NDArray

from dem.kernels.arrays import Array, Index


class Hexahedra(NamedTuple):
    """Elastic zones; they keep no state."""

    node: Index  # (e, 8)
    kind: Index  # row of the tables, (e,)


class HexTable(NamedTuple):
    """Tables of zone shapes and materials."""

    stiffness: Array  # (k, 24, 24)
    strain: Array  # (k, 8, 6, 24)
    weight: Array  # (k, 8)
    gradient: Array  # (k, 8, 3)
    elastic: Array  # of the material of each, (k, 6, 6)


class Facets(NamedTuple):
    """Quadrilaterals that the faces of the blocks are made of, counter-clockwise from outside."""

    node: Index  # (f, 4)
    beside: Index  # facet of the same face across the edges from node 0, 1, 2, 3 to the next; -1 at its rim, (f, 4)


class FaceContacts(NamedTuple):
    """Contact points: fixed on block b, sliding over the facets of block a, and their plastic state."""

    joint: Index  # row of the law, (m,)
    facet: Index  # of block a, on which the point lies now, (m,)
    local: Array  # where on it, from -1 to 1 along both its directions, (m, 2)
    origin: Array  # where on block a in the reference position [m], (m, 3)
    node: Index  # of a facet of b, (m, 4)
    share: Array  # of each of them, (m, 4)
    area: Array  # (m,)
    gap: Array  # opening less the distance in the reference position [m], (m,)
    slip: Array  # plastic, along t1 and t2, (m, 2)
    lift: Array  # (m,)
    damage: Array  # (m,)
    tangent: Array  # t1 and t2 of every row of the law on block a, reference position, (rows, 2, 3)


class RigidSolids(NamedTuple):
    """Rigid blocks: motion x, y, z and turns about them, masses, held freedoms and their prescribed velocity."""

    centre: Array  # (b, 3)
    shift: Array  # displacement [m], and turns summed about the axes [rad], (b, 6)
    turn: Array  # unit quaternion from the reference position, scalar first, (b, 4)
    velocity: Array  # (b, 6)
    mass: Array  # mass three times, moments of inertia, (b, 6)
    load: Array  # (b, 6)
    held: NDArray[bool_]  # (b, 6)
    drive: Array  # velocity of held freedoms, (b, 6)
    before: Array  # net in the step before, (b, 6)
    net: Array  # written: joints and loads in the last step, about the centre, (b, 6)
    total: Array  # written: net summed over the steps of a call, (b, 6)
    node: Index  # nodes of all rigid blocks
