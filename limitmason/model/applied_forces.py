"""Forces at points of blocks, summed up per block, and spread over plane faces."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.geometry.rotation import axial

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly


class AppliedForces(NamedTuple):
    """Sums of forces at points of every block, filled by :meth:`add`.

    Parameters
    ----------
    force : [N], shape (n_blocks, 3)
    arms : sum of r f^T, r from the centroid [N m], shape (n_blocks, 3, 3)
    centroids : of the blocks [m], shape (n_blocks, 3)
    """

    force: Array
    arms: Array
    centroids: Array

    @classmethod
    def none(cls, assembly: Assembly) -> AppliedForces:
        """No force yet on any block of an assembly."""
        n = assembly.n_blocks
        return cls(np.zeros((n, 3)), np.zeros((n, 3, 3)), assembly.centroids)

    @property
    def wrench(self) -> Array:
        """Wrench of every block about its centroid [N, N m], shape (n_blocks, 6)."""
        return np.hstack([self.force, axial(self.arms)])

    def add(self, block: int, point: Array, force: Array) -> None:
        """Add a force to those of a block.

        Parameters
        ----------
        block : its number
        point : where the force acts, in the reference position [m], shape (3,)
        force : in global axes [N], shape (3,)
        """
        self.force[block] += force
        self.arms[block] += np.outer(point - self.centroids[block], force)

    def add_spread(self, block: int, polygon: Array, normal: Array, value: Array, traction: Array) -> None:
        """Add a traction that varies linearly over a plane polygon, exactly.

        Parameters
        ----------
        block : number of the block that the polygon lies on
        polygon : corners, convex or not, counter-clockwise about the normal [m], shape (k, 3)
        normal : unit normal of its plane, shape (3,)
        value : at the corners [-], shape (k,)
        traction : load per area where the value is one [Pa], shape (3,)
        """
        total, first = linear_integrals(polygon, normal, value)
        self.force[block] += total * traction
        self.arms[block] += np.outer(first + total * (polygon[0] - self.centroids[block]), traction)


def linear_integrals(polygon: Array, normal: Array, value: Array) -> tuple[float, Array]:
    """Integrals of a value v, linear in x, over a plane polygon: v and v (x - x_0).

    They are in m2 and in m3, shape (3,); x_0 is the first corner.

    Parameters
    ----------
    polygon : corners, convex or not, counter-clockwise about the normal [m], shape (k, 3)
    normal : unit normal of its plane, shape (3,)
    value : at the corners [-], shape (k,)

    Notes
    -----
    Summed over a fan of triangles of signed area A from the first corner: A mean(v), and
    A / 12 (sum of v x + sum of v times sum of x) over the three corners.
    """
    x = polygon - polygon[0]
    area = 0.5 * np.cross(x[1:-1], x[2:]) @ normal
    # of every triangle beside the first corner, where x = 0
    corners, values = np.stack([x[1:-1], x[2:]], axis=1), np.stack([value[1:-1], value[2:]], axis=1)
    each = value[0] + values.sum(axis=1)
    weighted = (values[:, :, None] * corners).sum(axis=1) + each[:, None] * corners.sum(axis=1)
    return float(area @ each) / 3.0, np.asarray(area @ weighted) / 12.0
