"""Corners near faces of other blocks: which pairs there are in a pose, their gaps, and how far inside they lie."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.contact_search.faces import Shapes, turned
from limitmason.capacity.kinematics import Pose
from limitmason.geometry.boxtree import overlapping_pairs

OVERSHOOT = 1e-3
"""How far beyond a side a corner goes before it has left a face, or come to it, over the median block size [-]."""

NEAR = 0.01
"""Gap within which a corner is made a contact point, over the median block size [-]."""

FACING = -0.5
"""Cosine between the outward normals up to which the face of a corner looks at another face."""


class Near(NamedTuple):
    """Corners at faces of other blocks.

    Parameters
    ----------
    corner : its number, shape (k,); places where sides cross have one beyond those of all corners, see
        :mod:`limitmason.capacity.contact_search.crossing`
    face : number of the face, shape (k,)
    gap : of the corner above the face, negative where it lies behind [m], shape (k,)
    inside : least distance inside a side of the face, negative outside [m], shape (k,)
    owner : block of the corner, shape (k,)
    place : where the corner is in the reference pose [m], shape (k, 3)
    """

    corner: Index
    face: Index
    gap: Array
    inside: Array
    owner: Index
    place: Array

    def at(self, rows: Index | Flags) -> "Near":
        """Some of them, by number or by flag."""
        return Near._make(column[rows] for column in self)

    def with_rows(self, other: "Near") -> "Near":
        """These and others behind them."""
        return Near(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


def near_corners(shapes: Shapes, pose: Pose, inside: float, depth: float = 0.0) -> Near:
    """Corners within the near gap of faces of other blocks in a pose and inside their sides.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    pose : where the blocks are
    inside : least distance inside the sides, negative for outside [m]
    depth : by which corners may lie behind a face beyond the near gap, as the springs of soft joints let them [m]
    """
    one, two = near_blocks(shapes, pose, depth)
    own, face = facing(shapes, pose, np.concatenate([one, two]), np.concatenate([two, one]))
    start = shapes.corners_begin
    count = np.diff(start)[own]
    # every corner of face own[i], in a row, beside face[i]
    corner = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - start[own], count)
    face = np.repeat(face, count)
    gap, sides = gap_and_inside(shapes, pose, shapes.corner_place[corner], shapes.owner[corner], face)
    use = (gap < shapes.near) & (gap > -shapes.near - depth) & (sides > inside)
    corner = corner[use]
    return Near(
        corner=corner, face=face[use], gap=gap[use], inside=sides[use], owner=shapes.owner[corner],
        place=shapes.corner_place[corner],
    )


def facing(shapes: Shapes, pose: Pose, one: Index, two: Index) -> tuple[Index, Index]:
    """Faces that look at each other in a pose, n_f . n_g < ``FACING``, for many pairs of blocks.

    Parameters
    ----------
    one, two : the two blocks of every pair, shape (p,)

    Returns
    -------
    tuple
        Numbers of the faces of blocks ``one`` and of the faces of blocks ``two``, pair by pair, shape (k,) each.
    """
    f, g = all_pairs(shapes.face_start, one, shapes.face_start, two)
    normal = turned(pose, shapes.face_block, shapes.normal)
    looks = np.einsum("ij,ij->i", normal[f], normal[g]) < FACING
    return f[looks], g[looks]


def near_blocks(shapes: Shapes, pose: Pose, depth: float = 0.0) -> tuple[Index, Index]:
    """Pairs of blocks that may touch in a pose, not both held: numbers of the one and of the other, shape (p,) each.

    The spheres about their centroids that hold them come within the near gap and ``depth`` [m] of each other.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    pose : where the blocks are
    """
    fixed, x = shapes.assembly.fixed, shapes.assembly.centroids + pose.shift
    reach = shapes.spread + shapes.near + depth
    one, two = overlapping_pairs(x - reach[:, None], x + reach[:, None])
    near = np.linalg.norm(x[one] - x[two], axis=1) < shapes.spread[one] + shapes.spread[two] + shapes.near + depth
    near &= ~(fixed[one] & fixed[two])
    return one[near], two[near]


def all_pairs(first: Index, of: Index, second: Index, on: Index) -> tuple[Index, Index]:
    """All pairs of a thing of one block and a thing of another, for many pairs of blocks at once.

    Things are corners or faces, say; they stand in a row, block after block.

    Parameters
    ----------
    first, second : where the things of every block begin in their row, and the end, shape (n + 1,)
    of, on : the two blocks of every pair, shape (p,)

    Returns
    -------
    tuple
        Numbers in the first and in the second row: every thing of of[0] with every thing of on[0], then of the next.
    """
    nc, nf = np.diff(first)[of], np.diff(second)[on]
    total = nc * nf
    # pair of blocks, and number within it, of every pair of things: one * nf + other
    pair = np.repeat(np.arange(len(of)), total)
    k = np.arange(total.sum()) - np.repeat(np.cumsum(total) - total, total)
    return first[of][pair] + k // np.maximum(nf[pair], 1), second[on][pair] + k % np.maximum(nf[pair], 1)


def gap_and_inside(shapes: Shapes, pose: Pose, place: Array, owner: Index, face: Index) -> tuple[Array, Array]:
    """Gap of points above faces in a pose, and the least distance inside their sides [m], shape (m,) each.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    pose : where the blocks are
    place : of the points in the reference pose [m], shape (m, 3)
    face : number of the face of every point, shape (m,)
    owner : block of every point, shape (m,)
    """
    # where the points are now, seen from the block of the face and laid into its reference pose
    x, base = shapes.assembly.centroids, shapes.face_block[face]
    local = shapes.placed(pose, owner, place) - x[base] - pose.shift[base]
    local = x[base] + local + np.einsum("mji,mj->mi", pose.turn[base], local)
    gap = ((local - shapes.face_place[face]) * shapes.normal[face]).sum(axis=1)
    sides = np.einsum("mki,mi->mk", shapes.side[face], local) - shapes.reach[face]
    return gap, sides.min(axis=1)
