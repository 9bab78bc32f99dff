"""The equilibrium matrix: the one place for normals and lever arms.

A f + w = 0 with f = (N, T1, T2) per contact point, compression positive. The force on block b is
N n + T1 t1 + T2 t2 at the point, the force on block a its opposite; moments are taken about block centroids.
The transpose gives the rates conjugate to f: A^T v = (opening, sliding of b relative to a).
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Flags
from limitmason.geometry.rotation import vector_product
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly


def degrees_of_freedom(assembly: Assembly, plane: Plane | None = None) -> tuple[Array, Flags]:
    """Basis of a block's motion and which of its coordinates are free.

    Parameters
    ----------
    plane : in which blocks move; None in space

    Returns
    -------
    basis : shape (6, 6), the unit wrenches; in plane shape (6, 3), two translations and the turn about the normal
    free : shape (n_blocks, 6 or 3)
    """
    if plane is None:
        return np.eye(6), ~assembly.held
    basis = np.zeros((6, 3))
    basis[:3, 0], basis[:3, 1], basis[3:, 2] = plane.axis_1, plane.axis_2, plane.normal
    # a motion of the plane is held where any freedom that it has a part in is held: axes may lie askew to x, y, z
    touched = np.abs(basis) > 1e-9  # beyond rounding
    free = ~np.stack([assembly.held[:, touched[:, k]].any(axis=1) for k in range(3)], axis=1)
    return basis, free


def equilibrium_matrix(assembly: Assembly, points: ContactPoints, *, plane: Plane | None = None) -> sparse.csc_array:
    """Equilibrium matrix A of A f + w = 0, held degrees of freedom included.

    Parameters
    ----------
    points : contact points; in plane they must come with the same ``plane``
    plane : in which blocks move; None in space

    Returns
    -------
    sparse array, shape (d n_blocks, c m) with d = 6 or 3 degrees of freedom a block and c = 3 or 2 force components a
    point; row d i + j belongs to block i, column c p + q to point p. Force rows [-], moment rows [m].
    """
    m, c = points.count, points.components
    n = assembly.n_blocks
    force = points.directions
    blocks, values = [], []
    # the block with the lower number first: the rows of every column then ascend and need no sorting
    swapped = points.block_b > points.block_a
    for block, sign in (
        (np.minimum(points.block_a, points.block_b), np.where(swapped, -1.0, 1.0)),
        (np.maximum(points.block_a, points.block_b), np.where(swapped, 1.0, -1.0)),
    ):
        arm = points.position - assembly.centroids[block]
        moment = vector_product(arm[:, None], force)
        wrench = sign[:, None, None] * np.concatenate([force, moment], axis=2)  # (m, c, 6)
        if plane is not None:
            basis, _ = degrees_of_freedom(assembly, plane)
            wrench = wrench @ basis
        blocks.append(block)
        values.append(wrench)
    d = values[0].shape[2]
    wrench = np.stack(values, axis=2)  # (m, c, 2, d)
    rows = (d * np.stack(blocks, axis=1))[:, None, :, None] + np.arange(d)
    rows = np.broadcast_to(rows, wrench.shape).flatten()  # a copy: without points ravel() is a view, read-only
    starts = np.arange(m * c + 1) * (2 * d)
    matrix = sparse.csc_array((wrench.ravel(), rows, starts), shape=(d * n, c * m))
    matrix.eliminate_zeros()
    return matrix
