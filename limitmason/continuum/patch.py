"""Nodal forces of a load spread over a flat patch that may cut bricks' faces."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from limitmason.arrays import Array
from limitmason.continuum.mesh import Mesh
from limitmason.errors import InputError
from limitmason.geometry.polygon import clip_convex
from limitmason.model.input import read_vector
from limitmason.model.patch import patch_normal

_NEAR = 1e-6  # of the patch's size: faces this near to its plane lie in it


def patch_forces(mesh: Mesh, corners: ArrayLike) -> tuple[Array, float, Array]:
    """Integral of the shape functions over a patch of the free faces.

    Parameters
    ----------
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
    p = np.array([read_vector(f"corners[{k}] of the patch", c) for k, c in enumerate(np.atleast_2d(corners))])
    if len(p) < 3:
        raise InputError(f"a patch needs at least three corners, got {len(p)}")
    normal, size = patch_normal(p)
    first = (p[1] - p[0]) / np.linalg.norm(p[1] - p[0])
    axes = np.stack([first, np.cross(normal, first)])
    window = (p - p[0]) @ axes.T
    faces = mesh.boundary_corners
    flat = np.abs((faces - p[0]) @ normal).max(axis=1) <= _NEAR * size
    across = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]) @ normal
    place, weight = get_quadrature(RefTri, 4)  # exact for shape functions of a face, of degree 3
    bricks, points, shares = [], [], []
    total = 0.0
    for f in np.flatnonzero(flat & (across > 0.0)):
        left = clip_convex((faces[f] - p[0]) @ axes.T, window)
        if len(left) < 3:
            continue
        brick = int(mesh.boundary_owner[f])
        for a, b in pairwise(left[1:]):
            edges = np.array([a - left[0], b - left[0]])
            twice = abs(float(np.linalg.det(edges)))
            if twice <= (_NEAR * size) ** 2:
                continue
            bricks.append(np.full(len(weight), brick))
            points.append(p[0] + (left[0] + place.T @ edges) @ axes)
            shares.append(twice * weight)
            total += 0.5 * twice
    if total == 0.0:
        raise InputError(
            f"no free face of the solid lies in the patch with corners {p.tolist()} and outward normal "
            f"({normal[0]:.3g}, {normal[1]:.3g}, {normal[2]:.3g}): give the corners counter-clockwise seen from outside"
        )
    owner = np.concatenate(bricks)
    share = np.concatenate(shares)[:, None] * mesh.shape_at(owner, np.concatenate(points))
    nodal = np.bincount(mesh.connectivity[owner].ravel(), share.ravel(), minlength=len(mesh.nodes))
    return np.asarray(nodal, dtype=np.float64), total, normal
