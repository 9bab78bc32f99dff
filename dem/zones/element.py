"""The zone: a quadrilateral with enhanced strains, whose tables are made once per shape and material.

Strain of a zone is eps = B u + G a: B of its bilinear shapes, G of incompatible modes, the gradients of 1 - xi^2 and 1
- eta^2 in each direction (Wilson et al. 1973, in the form of Taylor, Beresford and Wilson 1976 and Simo and Rifai
1990). They are mapped so that constant stress does no work on them: the patch test holds at any shape.

The amplitudes a make the zone's own stresses orthogonal to G. With eps = Bt u + G b, Bt = B - G Kaa^-1 Kau, elastic
zones have b = 0 and the force is K u, K = sum w Bt^T D Bt: a rectangle bends exactly (one zone across a brick is
enough). No volume is locked, since the four modes let the volumetric strain vary as plastic flow wants it.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError

SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
"""Corners of the reference square, shape (4, 2)."""


class ZoneTables(NamedTuple):
    """Tables of one shape and elastic material, at the four stress points of a zone.

    Parameters
    ----------
    stiffness : K [N/m], shape (8, 8), freedoms x0, z0, x1, ...
    strain : Bt [1/m], rows xx, zz, 2 xz, shape (4, 3, 8)
    release : b from initial strains: b = sum_g release_g D eps_p, Kaa^-1 w G^T, shape (4, 4, 3)
    modes : G [1/m], shape (4, 3, 4)
    weight : volume of each stress point [m3], shape (4,)
    gradient : of the shape functions at the centre [1/m], shape (4, 2)
    """

    stiffness: Array
    strain: Array
    release: Array
    modes: Array
    weight: Array
    gradient: Array


def shape_values(local: Array) -> Array:
    """Bilinear shape functions of the reference square's four nodes, shape (..., 4).

    They are taken at places ``local``, coordinates from -1 to 1, shape (..., 2).
    """
    return np.asarray(np.prod(1.0 + local[..., None, :] * SQUARE, axis=-1) / 4)


def shape_gradients(local: Array) -> Array:
    """Derivatives of the four shape functions by the two coordinates, shape (2, 4).

    They are taken at the place ``local``, shape (2,).
    """
    factor = 1.0 + local * SQUARE
    return np.stack([SQUARE[:, 0] / 4 * factor[:, 1], SQUARE[:, 1] / 4 * factor[:, 0]])


def strain_rows(gradient: Array) -> Array:
    """Rows of strain xx, zz, 2 xz for the displacements of k nodes, shape (3, 2 k).

    Parameters
    ----------
    gradient : of the shape of every node along x and z [1/m], shape (2, k)
    """
    out = np.zeros((3, 2 * gradient.shape[1]))
    out[0, 0::2], out[1, 1::2] = gradient
    out[2, 0::2], out[2, 1::2] = gradient[1], gradient[0]
    return out


def zone_tables(corners: Array, thickness: float, elastic: Array) -> ZoneTables:
    """Tables of a quadrilateral.

    Parameters
    ----------
    corners : counter-clockwise [m], shape (4, 2)
    thickness : [m]
    elastic : stress xx, zz, xz, yy by strain xx, zz, 2 xz, of :class:`limitmason.deformable.Elasticity` [Pa], shape
        (4, 3)

    Raises
    ------
    InputError
        For a quadrilateral that is not convex.
    """
    # Gauss points of order 2 are the stress points; Jacobians at the centre (0) and at each of them
    points, first = SQUARE / np.sqrt(3.0), shape_gradients(np.zeros(2))
    jac0 = first @ corners
    det0, inv0 = np.linalg.det(jac0), np.linalg.inv(jac0)
    b, g, w = [], [], np.zeros(len(corners))  # B, G and volume at every stress point
    for k, place in enumerate(points):
        local = shape_gradients(place)
        jac = local @ corners
        det = np.linalg.det(jac)
        if not det > 0.0:
            raise InputError("a zone is not convex or turned inside out, or its corners run the wrong way round")
        b.append(strain_rows(np.asarray(np.linalg.solve(jac, local), dtype=np.float64)))
        # gradients of 1 - xi^2 and 1 - eta^2 are -2 xi and -2 eta, here by half, mapped by the centre's Jacobian; where
        # the factor stands decides the last bit of a zone, on which a brittle run hangs
        g.append(strain_rows(det0 / det * inv0 * -place))
        w[k] = det * thickness
    law, gs, bs = elastic[: len(b[0])], np.stack(g), np.stack(b)  # D of the stresses in the plane
    # enhanced modes a are condensed: K = sum w Bt^T D Bt with strains Bt = B - G K_aa^-1 K_au. There
    # K_aa = sum w G^T D G and K_au = sum w G^T D B. Stress point k, strain components i and j, modes or freedoms p, q
    kaa = np.einsum("k,kip,ij,kjq->pq", w, gs, law, gs)
    kau = np.einsum("k,kip,ij,kjq->pq", w, gs, law, bs)
    inverse = np.linalg.inv(kaa)
    bt = bs - gs @ (inverse @ kau)
    stiffness = np.einsum("k,kip,ij,kjq->pq", w, bt, law, bt)
    release = np.einsum("pq,kiq,k->kpi", inverse, gs, w)
    centre = np.asarray(np.linalg.solve(jac0, first).T)
    return ZoneTables(
        stiffness=0.5 * (stiffness + stiffness.T), strain=bt, release=release, modes=gs, weight=w, gradient=centre,
    )
