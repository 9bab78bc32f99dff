"""Sides of quadrilateral faces: which of them runs along the unit, and which across its thickness."""

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly

DIFFERS = 1e-6
"""Part of a length, or of a unit vector, below which two of them count as equal: coordinates are rounded [-]."""


def in_rows(assembly: Assembly, sizes: Index, plane: Plane) -> Index:
    """Points both ways on every interface, shape (k, 2), whose first number is that of a row in a plane.

    A row across the thickness of a unit gets no fewer points than were asked for there.

    Parameters
    ----------
    sizes : points along and across every interface, shape (k, 2)
    plane : in which the rows lie
    """
    rows = np.flatnonzero((np.diff(assembly.arrays.corner_start) == 4) & (sizes[:, 0] < sizes[:, 1]))
    if not len(rows):
        return sizes
    corners = turned_corners(assembly, rows)
    # how far the sides along the unit and across it reach out of the plane [m]
    along, across = (np.abs((corners[:, k + 1] - corners[:, k]) @ plane.normal) for k in (0, 1))
    out, rows = sizes.copy(), rows[along > across]
    out[rows, 0] = sizes[rows, 1]
    return out


def turned_corners(assembly: Assembly, rows: Index) -> Array:
    """Corners of quadrilaterals [m], (m, 4, 3), whose first edge runs along the unit, the second across its thickness.

    ``rows`` are the numbers of the interfaces, shape (m,).
    """
    x = assembly.arrays
    corners = x.corners[x.corner_start[rows][:, None] + np.arange(4)]
    # lengths of the first two edges [m], and unit vectors along them
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1]
    one, two = np.linalg.norm(e1, axis=1), np.linalg.norm(e2, axis=1)
    e1, e2 = e1 / one[:, None], e2 / two[:, None]
    # the long edge is taken as along the unit, until a unit's own axis says otherwise
    turn = one < two
    # the free block decides before the held one, and b before a
    pair = np.column_stack([x.block_b[rows], x.block_a[rows]])
    swap = assembly.fixed[pair[:, 0]] & ~assembly.fixed[pair[:, 1]]
    pair[swap] = pair[swap, ::-1]
    square = np.abs(one - two) <= DIFFERS * one
    turn[square] = _squares_turned(assembly, pair[square], e1[square], e2[square])
    # length direction of the deciding unit as laid, or of the other where it names none
    axes = np.array([(np.nan, np.nan, np.nan) if b.axis is None else b.axis for b in assembly.blocks])
    axis = np.where(np.isnan(axes[pair[:, :1], 0]), axes[pair[:, 1]], axes[pair[:, 0]])
    across = np.cross(axis, (0.0, 0.0, 1.0))
    # an upright unit: its thickness is taken along y, as in a wall in x-z
    across[np.linalg.norm(across, axis=1) <= DIFFERS] = 0.0, 1.0, 0.0
    # NaN without an axis, and nothing where both edges stand square to the thickness: such faces stay undecided
    across_1, across_2 = (np.abs(np.einsum("ij,ij->i", e, across)) for e in (e1, e2))
    decided = np.fmax(across_1, across_2) > DIFFERS
    turn[decided] = across_1[decided] > across_2[decided]
    return np.where(turn[:, None, None], np.roll(corners, -1, axis=1), corners)


def _squares_turned(assembly: Assembly, pair: Index, e1: Array, e2: Array) -> Flags:
    """Whether the first side of square faces is not the one along the unit, shape (m,).

    Their sides differ by rounding only. The unit runs along the side in which the first block extends farther. Where it
    extends alike in both, the second block decides. Between two cubes the thickness is taken along y, and where neither
    side runs so, the unit along x.

    Parameters
    ----------
    pair : numbers of the two blocks of each face, the deciding one first, shape (m, 2)
    e1, e2 : unit vectors along the sides, shape (m, 3)
    """
    # by how much more the first side runs along y, and along x, than the second [-]
    by_y, by_x = np.abs(e1[:, 1]) - np.abs(e2[:, 1]), np.abs(e1[:, 0]) - np.abs(e2[:, 0])
    turn = np.where(np.abs(by_y) > DIFFERS, by_y > 0.0, by_x < -DIFFERS)
    # the first block of a pair comes last, so that its word stands
    for blocks in (pair[:, 1], pair[:, 0]):
        first, second = (_extent(assembly, blocks, e) for e in (e1, e2))
        differ = np.abs(first - second) > DIFFERS * first
        turn[differ] = (first < second)[differ]
    return np.asarray(turn)


def _extent(assembly: Assembly, blocks: Index, axis: Array) -> Array:
    """Length of blocks along a unit vector of each [m], shape (m,).

    Parameters
    ----------
    blocks : number of the block of each row, shape (m,)
    axis : unit vector of each row, shape (m, 3)
    """
    vertices, start = assembly.vertices
    count = np.diff(start)[blocks]
    # where the vertices of each row's block begin among those gathered below
    first = np.concatenate([[0], np.cumsum(count)])[:-1].astype(np.intp)
    if not len(first):
        return np.zeros(0)
    # all vertices of these blocks, block after block
    rows = np.arange(int(count.sum())) + np.repeat(start[blocks] - first, count)
    height = np.einsum("ij,ij->i", vertices[rows], np.repeat(axis, count, axis=0))
    return np.asarray(np.maximum.reduceat(height, first) - np.minimum.reduceat(height, first))
