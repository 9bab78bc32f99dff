"""The elastic zone in space: a hexahedron with enhanced strains, whose tables are made once per shape and material.

eps = B u + G a, as in the plane (:mod:`dem.zones.element`), with the stress that goes with eps orthogonal to G. G holds
nine incompatible modes, the gradients of 1 - xi^2, 1 - eta^2 and 1 - zeta^2 in each direction (Wilson et al. 1973; Simo
and Rifai 1990), by which a box bends exactly about any axis, and three volumetric ones, xi eta, eta zeta and zeta xi
times the unit tensor: what is left of the volumetric strain of the trilinear shapes, by which nine modes alone still
lock as nu goes to 1/2 (Simo, Armero and Taylor 1993, sec. 3). All are mapped so that constant stress does no work on
them: the patch test holds at any shape.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.errors import InputError

Array = NDArray[np.float64]

CORNERS = np.array([
    [-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1],
], dtype=float)  # fmt: skip
"""Corners of the reference cube, shape (8, 3)."""

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Corners of its faces, counter-clockwise from outside: -zeta, zeta, -eta, xi, eta, -xi; shape (6, 4)."""

_MODES = 12


class HexTables(NamedTuple):
    """Tables of one shape and material, at the eight stress points of a zone.

    Parameters
    ----------
    stiffness : K [N/m], shape (24, 24), freedoms x0, y0, z0, x1, ...
    strain : Bt = B - G Kaa^-1 Kau [1/m], rows xx, yy, zz, 2 yz, 2 xz, 2 xy, shape (8, 6, 24)
    weight : volume of each stress point [m3], shape (8,)
    gradient : of the shape functions at the centre [1/m], shape (8, 3)
    """

    stiffness: Array
    strain: Array
    weight: Array
    gradient: Array


def shape_values(local: Array) -> Array:
    """Trilinear shape functions at places in the reference cube, (..., 3) to (..., 8)."""
    return np.asarray(0.125 * np.prod(1.0 + local[..., None, :] * CORNERS, axis=-1))


def shape_gradients(local: Array) -> Array:
    """Their derivatives by xi, eta, zeta at one place, shape (3, 8)."""
    factor = 1.0 + local * CORNERS
    return np.stack([
        0.125 * CORNERS[:, i] * factor[:, (i + 1) % 3] * factor[:, (i + 2) % 3] for i in range(3)
    ])  # fmt: skip


def strain_rows(gradient: Array) -> Array:
    """Strain rows xx, yy, zz, 2 yz, 2 xz, 2 xy of displacements whose gradients are given, (3, k) to (6, 3 k)."""
    out = np.zeros((6, 3 * gradient.shape[1]))
    x, y, z = gradient
    out[0, 0::3], out[1, 1::3], out[2, 2::3] = x, y, z
    out[3, 1::3], out[3, 2::3] = z, y
    out[4, 0::3], out[4, 2::3] = z, x
    out[5, 0::3], out[5, 1::3] = y, x
    return out


def hex_tables(corners: Array, elastic: Array) -> HexTables:
    """Tables of a hexahedron.

    Parameters
    ----------
    corners : in the order of :data:`CORNERS` [m], shape (8, 3)
    elastic : of :class:`limitmason.deformable.Elasticity` in space, shape (6, 6)

    Raises
    ------
    InputError
        For a hexahedron that is turned inside out at a stress point.
    """
    first = shape_gradients(np.zeros(3))
    jac0 = first @ corners
    det0, inv0 = np.linalg.det(jac0), np.linalg.inv(jac0)
    b, g, w = np.zeros((8, 6, 24)), np.zeros((8, 6, _MODES)), np.zeros(8)
    for k in range(8):
        place = CORNERS[k] / np.sqrt(3.0)
        local = shape_gradients(place)
        jac = local @ corners
        det = np.linalg.det(jac)
        if not det > 0.0:
            raise InputError("a zone is turned inside out, or its corners run the wrong way round")
        b[k] = strain_rows(np.asarray(np.linalg.solve(jac, local), dtype=np.float64))
        g[k, :, :9] = det0 / det * strain_rows(-inv0 * place)
        g[k, :3, 9:] = det0 / det * place[[0, 1, 2]] * place[[1, 2, 0]]
        w[k] = det
    kaa = np.einsum("k,kip,ij,kjq->pq", w, g, elastic, g, optimize=True)
    kau = np.einsum("k,kip,ij,kjq->pq", w, g, elastic, b, optimize=True)
    bt = b - g @ np.linalg.solve(kaa, kau)
    stiffness = np.einsum("k,kip,ij,kjq->pq", w, bt, elastic, bt, optimize=True)
    return HexTables(0.5 * (stiffness + stiffness.T), bt, w, np.asarray(np.linalg.solve(jac0, first).T))
