"""The zone: a quadrilateral or hexahedron with enhanced strains, whose tables are made once per shape and material.

Strain of a zone is eps = B u + G a: B of its (bi- or trilinear) shapes, G of incompatible modes, the gradients of 1 -
xi^2, 1 - eta^2 and, in space, 1 - zeta^2 in each direction (Wilson et al. 1973, in the form of Taylor, Beresford and
Wilson 1976 and Simo and Rifai 1990). In space three volumetric ones go with them, xi eta, eta zeta and zeta xi times
the unit tensor. They are what is left of the volumetric strain of the trilinear shapes, by which nine modes alone still
lock as nu goes to 1/2 (Simo, Armero and Taylor 1993, sec. 3). All are mapped so that constant stress does no work on
them: the patch test holds at any shape.

The amplitudes a make the zone's own stresses orthogonal to G. With eps = Bt u + G b, Bt = B - G Kaa^-1 Kau, elastic
zones have b = 0 and the force is K u, K = sum w Bt^T D Bt: a rectangle or box bends exactly (one zone across a brick is
enough). In the plane no volume is locked, since the four modes let the volumetric strain vary as plastic flow wants it.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError

SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
"""Corners of the reference square, shape (4, 2)."""

CUBE = np.array([
    [-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1],
], dtype=float)  # fmt: skip
"""Corners of the reference cube, shape (8, 3)."""

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Corners of its faces, counter-clockwise from outside: -zeta, zeta, -eta, xi, eta, -xi; shape (6, 4)."""

_SHEAR = {2: ((0, 1),), 3: ((1, 2), (0, 2), (0, 1))}  # axes of the shear strains, row by row


class ZoneTables(NamedTuple):
    """Tables of one shape and elastic material, at the g stress points of a zone in d dimensions.

    Parameters
    ----------
    stiffness : K [N/m], shape (d g, d g), freedoms x0, z0, x1, ... or x0, y0, z0, x1, ...
    strain : Bt [1/m], rows xx, zz, 2 xz or xx, yy, zz, 2 yz, 2 xz, 2 xy, shape (g, s, d g)
    release : b from initial strains: b = sum_g release_g D eps_p, Kaa^-1 w G^T, shape (g, a, s)
    modes : G [-], shape (g, s, a)
    weight : volume of each stress point [m3], shape (g,)
    gradient : of the shape functions at the centre [1/m], shape (g, d)
    """

    stiffness: Array
    strain: Array
    release: Array
    modes: Array
    weight: Array
    gradient: Array


def reference(dimension: int) -> Array:
    """Corners of the reference square or cube, which are the stress points times the root of 3."""
    return SQUARE if dimension == 2 else CUBE


def shape_values(local: Array) -> Array:
    """Bi- or trilinear shape functions at places in the reference zone, (..., d) to (..., 2^d)."""
    corners = reference(local.shape[-1])
    return np.asarray(np.prod(1.0 + local[..., None, :] * corners, axis=-1) / len(corners))


def shape_gradients(local: Array) -> Array:
    """Their derivatives by the local coordinates at one place, shape (d, 2^d)."""
    d, corners = len(local), reference(len(local))
    factor = 1.0 + local * corners
    rows = [corners[:, i] / len(corners) for i in range(d)]
    for i in range(d):
        for k in range(1, d):
            rows[i] = rows[i] * factor[:, (i + k) % d]
    return np.stack(rows)


def strain_rows(gradient: Array) -> Array:
    """Strain rows, as in :class:`ZoneTables`, of displacements whose gradients are given, (d, k) to (s, d k)."""
    d = len(gradient)
    out = np.zeros((d + len(_SHEAR[d]), d * gradient.shape[1]))
    for i in range(d):
        out[i, i::d] = gradient[i]
    for row, (i, j) in enumerate(_SHEAR[d], d):
        out[row, i::d], out[row, j::d] = gradient[j], gradient[i]
    return out


def zone_tables(corners: Array, thickness: float, elastic: Array) -> ZoneTables:
    """Tables of a quadrilateral, or of a hexahedron.

    Parameters
    ----------
    corners : counter-clockwise, shape (4, 2), or in the order of :data:`CUBE`, shape (8, 3) [m]
    thickness : [m]; 1 in space
    elastic : of :class:`limitmason.deformable.Elasticity`, shape (4, 3) or (6, 6)

    Raises
    ------
    InputError
        For a quadrilateral that is not convex, and a hexahedron that is turned inside out at a stress point.
    """
    d, points = corners.shape[1], reference(corners.shape[1]) / np.sqrt(3.0)
    first = shape_gradients(np.zeros(d))
    jac0 = first @ corners
    det0, inv0 = np.linalg.det(jac0), np.linalg.inv(jac0)
    b, g, w = [], [], np.zeros(len(corners))
    for k, place in enumerate(points):
        local = shape_gradients(place)
        jac = local @ corners
        det = np.linalg.det(jac)
        if not det > 0.0:
            raise InputError("a zone is not convex or turned inside out, or its corners run the wrong way round")
        b.append(strain_rows(np.asarray(np.linalg.solve(jac, local), dtype=np.float64)))
        # where the factor stands decides the last bit of a zone, on which a brittle run hangs
        near, far = (det0 / det, 1.0) if d == 2 else (1.0, det0 / det)
        modes = far * strain_rows(near * inv0 * -place)
        if d == 3:
            volumetric = np.zeros((6, 3))
            volumetric[:3] = det0 / det * place * np.roll(place, -1)
            modes = np.hstack([modes, volumetric])
        g.append(modes)
        w[k] = det * thickness
    law, gs, bs = elastic[: len(b[0])], np.stack(g), np.stack(b)
    kaa = np.einsum("k,kip,ij,kjq->pq", w, gs, law, gs, optimize=d == 3)
    kau = np.einsum("k,kip,ij,kjq->pq", w, gs, law, bs, optimize=d == 3)
    inverse = np.linalg.inv(kaa)
    # of twelve modes the inverse loses digits that the solution keeps
    bt = bs - gs @ (inverse @ kau if d == 2 else np.linalg.solve(kaa, kau))
    stiffness = np.einsum("k,kip,ij,kjq->pq", w, bt, law, bt, optimize=d == 3)
    release = np.einsum("pq,kiq,k->kpi", inverse, gs, w)
    centre = np.asarray(np.linalg.solve(jac0, first).T)
    return ZoneTables(0.5 * (stiffness + stiffness.T), bt, release, gs, w, centre)
