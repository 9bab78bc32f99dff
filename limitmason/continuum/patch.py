"""Nodal forces of a load spread over a flat patch that may cut bricks' faces."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from limitmason.arrays import Array
from limitmason.continuum.mesh import Mesh
from limitmason.model.patch_pressure import NEAR, read_patch


def patch_forces(mesh: Mesh, corners: ArrayLike) -> tuple[Array, float, Array]:
    """Integral of the shape functions over a patch of the free faces.

    Parameters
    ----------
    mesh : of the solid
    corners : of the patch, convex, counter-clockwise seen from outside [m], shape (k, 3)

    Returns
    -------
    nodal : share of every node [m2], shape (n_nodes,)
    area : of the faces in the patch [m2]
    normal : outward, shape (3,)

    Raises
    ------
    InputError
        When the corners are no flat convex polygon, or no free face lies in it.
    """
    patch, faces = read_patch(corners), mesh.nodes[mesh.boundary_nodes]
    # twice the area of a triangle of the face, positive where it looks as the patch does
    across = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]) @ patch.normal
    # a face of 20-node bricks has functions with xi^2 eta, of degree 3, and the rule is exact up to degree 4; its
    # weights add up to the area of the reference triangle, 1/2
    place, weight = get_quadrature(RefTri, 4)
    bricks, points, shares = [], [], []
    total = 0.0
    for f in np.flatnonzero(patch.holds(faces) & (across > 0.0)):
        left = patch.clipped(faces[f])
        if len(left) < 3:
            continue
        brick = int(mesh.boundary_owner[f])
        for a, b in pairwise(left[1:]):  # a convex polygon as triangles that share its first corner
            edges = np.array([a - left[0], b - left[0]])
            twice_area = abs(float(np.linalg.det(edges)))
            if twice_area <= (NEAR * patch.size) ** 2:  # a sliver of rounding
                continue
            bricks.append(np.full(len(weight), brick))
            points.append(patch.corners[0] + (left[0] + place.T @ edges) @ patch.axes)
            shares.append(twice_area * weight)
            total += 0.5 * twice_area
    if total == 0.0:
        raise patch.missed("free face of the solid")
    owner = np.concatenate(bricks)
    share = np.concatenate(shares)[:, None] * mesh.shape_at(owner, np.concatenate(points))
    nodal = np.bincount(mesh.connectivity[owner].ravel(), share.ravel(), minlength=len(mesh.nodes))
    return np.asarray(nodal, dtype=np.float64), total, patch.normal
