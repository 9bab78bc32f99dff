"""The elastic stiffness matrix of blocks on joints, K = A k A^T, with the shapes of blocks that deform."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from limitmason.arrays import Array
from limitmason.deformable import Body
from limitmason.deformable.levels import RIGID
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.equilibrium import equilibrium_matrix
from limitmason.mechanics.joint_shapes import at_joints
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly


def stiffness_matrix(
    assembly: Assembly, points: ContactPoints, stiffness: Array, plane: Plane | None = None,
    shapes: Sequence[Body | None] | None = None, blocks: str = RIGID,
) -> tuple[sparse.csc_array, sparse.csc_array]:
    """A and K = A k A^T, with the stiffness of the shapes beside that of the joints.

    Parameters
    ----------
    points : m contact points of c = 3 force components, in plane 2
    stiffness : of the points per area, of normal and two tangents [Pa/m], shape (m, 3); of normal and one in plane,
        (m, 2)
    plane : in which blocks move, where points come with one
    shapes : of every block that deforms, None where it is rigid; without, all are
    blocks : their kind, which says how joint points take the shapes up, see :mod:`limitmason.deformable.levels`

    Returns
    -------
    rows : A of all motions, held ones included, and then of the shapes block by block: A^T u are opening and slip,
        -k A^T u the stresses of the points, shape (d n + shapes of all, c m)
    matrix : K [N/m, N, N m], of as many
    """
    a = equilibrium_matrix(assembly, points, plane=plane)
    springs = sparse.diags_array((stiffness * points.area[:, None]).ravel())
    if shapes is None:
        return a, sparse.csc_array(a @ springs @ a.T)
    motions = a.shape[0]
    a = sparse.csc_array(sparse.vstack([a, _shape_rows(assembly, points, shapes, blocks)]))
    own = [s.stiffness for s in shapes if s is not None]
    parts = [sparse.csc_array((motions, motions)), *own]
    return a, sparse.csc_array(sparse.csc_array(a @ springs @ a.T) + sparse.block_diag(parts, format="csc"))


def _shape_rows(
    assembly: Assembly, points: ContactPoints, shapes: Sequence[Body | None], blocks: str
) -> sparse.csr_array:
    """Forces of the points on every shape, block by block, shape (shapes of all, c m): more rows of A.

    Arguments are those of :func:`stiffness_matrix`.
    """
    c = points.components
    shifts = at_joints(assembly, points, shapes, blocks)  # of every shape of blocks a and b at every point
    parts = []
    for i, shape in enumerate(shapes):
        if shape is None:
            continue
        rows = sparse.lil_array((shape.count, c * points.count))
        # a joint's force acts on block b, its reverse on block a
        for u, side, sign in zip(shifts, (points.block_a, points.block_b), (-1.0, 1.0), strict=True):
            at = np.flatnonzero(side == i)
            value = sign * (points.directions[at] @ u[at][:, :, : shape.count])  # (p, c, k)
            rows[:, (c * at[:, None] + np.arange(c)).ravel()] += value.reshape(-1, shape.count).T
        parts.append(rows.tocsr())
    return sparse.csr_array(sparse.vstack(parts))
