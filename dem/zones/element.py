"""The zone: a quadrilateral with enhanced strains, whose tables (stiffness, strain operators) are made once per shape.

Strain of a zone is eps = B u + G a: B of the bilinear quadrilateral, G of four incompatible modes (Wilson et al. 1973,
in the form of Taylor, Beresford and Wilson 1976 and Simo and Rifai 1990: it passes the patch test at any shape). The
amplitudes a make the zone's own stresses orthogonal to G. With eps = Bt u + G b, Bt = B - G Kaa^-1 Kau, elastic zones
have b = 0 and the force is K u, K = sum w Bt^T D Bt: a rectangle bends exactly (one zone across a brick is enough), and
no volume is locked, since the four modes let the volumetric strain vary as plastic flow wants it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.errors import InputError

Array = NDArray[np.float64]


_XI = np.array([-1.0, 1.0, 1.0, -1.0])
_ETA = np.array([-1.0, -1.0, 1.0, 1.0])


class ZoneTables(NamedTuple):
    """Tables of one shape and elastic material, at the four stress points of a zone.

    Parameters
    ----------
    stiffness : K [N/m], shape (8, 8), freedoms x0, z0, x1, z1, ...
    strain : Bt [1/m], rows xx, zz, 2 xz, shape (4, 3, 8)
    release : b from initial strains: b = sum_g release_g D eps_p, Kaa^-1 w G^T, shape (4, 4, 3)
    modes : G [-], shape (4, 3, 4)
    weight : volume of each stress point [m3], shape (4,)
    gradient : of the shape functions at the centre [1/m], shape (4, 2)
    """

    stiffness: Array
    strain: Array
    release: Array
    modes: Array
    weight: Array
    gradient: Array


def zone_tables(corners: Array, thickness: float, elastic: Array) -> ZoneTables:
    """Tables of a quadrilateral.

    Parameters
    ----------
    corners : counter-clockwise [m], shape (4, 2)
    thickness : [m]
    elastic : of :class:`limitmason.deformable.Elasticity` in a plane, shape (4, 3)

    Raises
    ------
    ValueError
        For a quadrilateral that is not convex.
    """
    d = elastic[:3]
    jac0 = 0.25 * np.array([_XI, _ETA]) @ corners
    det0 = np.linalg.det(jac0)
    inv0 = np.linalg.inv(jac0)
    b, g, w = np.zeros((4, 3, 8)), np.zeros((4, 3, 4)), np.zeros(4)
    for k in range(4):
        s, t = _XI[k] / np.sqrt(3.0), _ETA[k] / np.sqrt(3.0)
        local = 0.25 * np.array([_XI * (1.0 + _ETA * t), _ETA * (1.0 + _XI * s)])
        jac = local @ corners
        det = np.linalg.det(jac)
        if not det > 0.0:
            raise InputError("a zone is not convex, or its corners run clockwise")
        grad = np.linalg.solve(jac, local)
        b[k, 0, 0::2], b[k, 1, 1::2] = grad
        b[k, 2, 0::2], b[k, 2, 1::2] = grad[1], grad[0]
        # gradients of the modes (1 - xi^2) / 2 and (1 - eta^2) / 2, mapped as at the centre: constant stress does
        # no work on them, whatever the shape
        for mode, direction in enumerate((np.array([-s, 0.0]), np.array([0.0, -t]))):
            q = det0 / det * inv0 @ direction
            g[k, 0, 2 * mode], g[k, 1, 2 * mode + 1] = q
            g[k, 2, 2 * mode], g[k, 2, 2 * mode + 1] = q[1], q[0]
        w[k] = det * thickness
    kaa = np.einsum("k,kip,ij,kjq->pq", w, g, d, g)
    kau = np.einsum("k,kip,ij,kjq->pq", w, g, d, b)
    inverse = np.linalg.inv(kaa)
    bt = b - g @ (inverse @ kau)
    stiffness = np.einsum("k,kip,ij,kjq->pq", w, bt, d, bt)
    release = np.einsum("pq,kiq,k->kpi", inverse, g, w)
    centre = 0.25 * np.linalg.solve(jac0, np.array([_XI, _ETA])).T
    return ZoneTables(0.5 * (stiffness + stiffness.T), bt, release, g, w, centre)
