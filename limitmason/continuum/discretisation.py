"""From a mesh to matrices: strains at integration points, nodal forces, stiffness and mass, and their factor."""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import sparse
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex

from limitmason.arrays import Array, Flags, Index
from limitmason.checks import choice
from limitmason.continuum.factor import Elimination, Factor, assembled
from limitmason.continuum.mesh import Mesh, trilinear
from limitmason.errors import InputError

_CHUNK = 256  # bricks whose stiffness is worked out at once: bounds the memory
_COPY = 1e-7  # of the largest brick's size: bricks whose corners agree within it are copies; above rounding


class Congruent(NamedTuple):
    """Bricks that are copies of one another: all share the strain matrix."""

    bricks: Index  # (k,)
    strain: Array  # B, from the k displacements to strains at the points [1/m], (q, 6, k)
    volume: Array  # weight of every point [m3], (q,)


class Discretisation:
    """A mesh with its integration points.

    Unknown 3 i + j is displacement j of node i.

    Parameters
    ----------
    mesh : bricks
    points : integration points along an edge of a brick, 2 or 3
    held : nodes that cannot move, shape (n,) or, by direction, shape (n, 3)

    Attributes
    ----------
    unknowns : of every brick, shape (m, k), with k three times its nodes
    groups : bricks that are copies of one another
    place, per_brick : integration points in the reference cube, shape (3, q), and their number q
    _shape : shape functions of a brick's nodes at these points, shape (nodes, q)
    """

    def __init__(self, mesh: Mesh, held: Flags, points: int = 3) -> None:
        """Group congruent bricks and number the free unknowns.

        Parameters
        ----------
        mesh, held, points : see the class
        """
        choice("points along an edge", points, (2, 3))
        self.mesh, self.points = mesh, points
        n = len(mesh.nodes)
        # nodes held in all directions, or each direction for itself
        self.held = np.broadcast_to(held[:, None] if held.ndim == 1 else held, (n, 3)).ravel()
        self.free = np.flatnonzero(~self.held)
        if not len(self.free) or not self.held.any():
            raise InputError("a solid needs nodes that are held and nodes that are free")
        self.unknowns: Index = (3 * mesh.connectivity[:, :, None] + np.arange(3)).reshape(len(mesh), -1)
        # Gauss's rule with p points along an edge is exact up to degree 2 p - 1
        place, weight = get_quadrature(RefHex, 2 * points - 1)
        self.place: Array = place  # integration points in the reference cube, (3, q)
        self.per_brick = len(weight)
        corners = mesh.corners - mesh.corners[:, :1]  # from the first of each brick: copies then are equal
        size = float(np.abs(corners).max())
        _, group = np.unique(np.round(corners.reshape(len(mesh), 24) / (_COPY * size)), axis=0, return_inverse=True)
        self.groups: list[Congruent] = []
        shape = [mesh.element.lbasis(place, i) for i in range(mesh.per_brick)]
        self._shape = np.array([np.broadcast_to(s[0], len(weight)) for s in shape])  # (n, q)
        gradient = np.array([s[1] for s in shape])  # (n, 3, q)
        for k in range(int(group.max()) + 1):
            bricks = np.flatnonzero(group == k)
            jacobian = _jacobian(mesh.corners[bricks[0]], place)  # (q, 3, 3), dx_i / dX_j
            volume = np.linalg.det(jacobian) * weight
            if not (volume > 0.0).all():
                raise InputError(f"brick {int(bricks[0])} is turned inside out or flat")
            # by the chain rule from reference coordinates to places in space
            in_space = np.einsum("ajq,qji->aiq", gradient, np.linalg.inv(jacobian))
            self.groups.append(Congruent(bricks, _strain_matrix(in_space), volume))

    @cached_property
    def elimination(self) -> Elimination:
        """Fronts of the factors of this mesh."""
        return Elimination(self.unknowns, self.held, self.mesh.nodes)

    @property
    def order(self) -> Index:
        """Free unknowns in the order of elimination."""
        return self.elimination.order

    @cached_property
    def volume(self) -> Array:
        """Volume of every integration point [m3], shape (m, q)."""
        v = np.empty((len(self.mesh), self.per_brick))
        for g in self.groups:
            v[g.bricks] = g.volume
        return v

    @cached_property
    def places(self) -> Array:
        """Integration points [m], shape (m, q, 3)."""
        return np.asarray(np.einsum("aq,mai->mqi", self._shape, self.mesh.nodes[self.mesh.connectivity]))

    def strains(self, displacement: Array) -> Array:
        """Strains (xx, yy, zz, xy, yz, zx) at the points, shear engineering [-], shape (m, q, 6).

        Parameters
        ----------
        displacement : of the nodes [m], shape (3 n,)
        """
        out = np.empty((len(self.mesh), self.per_brick, 6))
        for g in self.groups:
            u = displacement[self.unknowns[g.bricks]]
            out[g.bricks] = (u @ g.strain.reshape(-1, u.shape[1]).T).reshape(len(g.bricks), -1, 6)
        return out

    def forces(self, stress: Array) -> Array:
        """Nodal forces that carry stresses of shape (m, q, 6) [Pa]: [N], shape (3 n,)."""
        out, k = np.zeros(self.held.size), self.unknowns.shape[1]
        for g in self.groups:
            f = (stress[g.bricks] * g.volume[:, None]).reshape(len(g.bricks), -1) @ g.strain.reshape(-1, k)
            out += np.bincount(self.unknowns[g.bricks].ravel(), f.ravel(), minlength=out.size)
        return out

    def stiffness(self, tangent: Array) -> Array:
        """Stiffness of every brick [N/m], shape (m, k, k) for its k unknowns.

        Parameters
        ----------
        tangent : at the points [Pa], shape (m, q, 6, 6), or one per material, shape (materials, 6, 6)
        """
        # integral of B^T D B, as B^T times D B over all points of a brick at once
        n = self.unknowns.shape[1]
        values = np.empty((len(self.mesh), n, n))
        by_material = tangent.ndim == 3
        for g in self.groups:
            b = g.strain
            if by_material:  # equal bricks of one material have one stiffness
                for material in np.unique(self.mesh.material[g.bricks]):
                    db = np.einsum("q,ij,qjk->qik", g.volume, tangent[material], b)
                    one = b.reshape(-1, n).T @ db.reshape(-1, n)
                    values[g.bricks[self.mesh.material[g.bricks] == material]] = one
                continue
            for first in range(0, len(g.bricks), _CHUNK):
                rows = g.bricks[first : first + _CHUNK]
                db = (tangent[rows] * g.volume[:, None, None]) @ b
                values[rows] = b.reshape(-1, n).T @ db.reshape(len(rows), -1, n)
        return values

    def mass(self, density: Array, extra: Array | None = None) -> Array:
        """Consistent mass of every brick [kg], shape (m, k, k) for its k unknowns.

        Parameters
        ----------
        density : of every material [kg/m3], shape (materials,)
        extra : further masses per unknown, lumped [kg], shape (3 n,)
        """
        n = self.mesh.per_brick
        values = np.zeros((len(self.mesh), n, 3, n, 3))
        shape, volume = self._shape, self.volume
        if self.points < 3:  # products of shape functions need the finer rule
            fine = Discretisation(self.mesh, self.held.reshape(-1, 3), 3)
            shape, volume = fine._shape, fine.volume
        # integral of rho N_a N_b, the same along x, y and z
        rho = density[self.mesh.material]
        between_nodes = np.einsum("aq,mq,bq->mab", shape, volume * rho[:, None], shape, optimize=True)
        for i in range(3):
            values[:, :, i, :, i] = between_nodes
        out = values.reshape(len(self.mesh), 3 * n, 3 * n)
        if extra is not None:  # the mass of an unknown goes to the diagonal of the first brick that has this unknown
            unknown, first = np.unique(self.unknowns, return_index=True)
            brick, place = np.divmod(first, 3 * n)
            out[brick, place, place] += extra[unknown]
        return out

    def body_force(self, force: Array) -> Array:
        """Nodal forces of a force per volume of every brick [N/m3], shape (m, 3): [N], shape (3 n,)."""
        share = np.einsum("aq,mq->ma", self._shape, self.volume)
        f = (share[..., None] * force[:, None]).reshape(len(self.mesh), -1)
        return np.bincount(self.unknowns.ravel(), f.ravel(), minlength=self.held.size).astype(np.float64)

    def assembled(self, values: Array) -> sparse.csc_array:
        """Matrix of the free unknowns in the order of elimination from those of the bricks, shape (m, k, k)."""
        return assembled(values, self.elimination.rank, len(self.order))

    def factor(self, values: Array) -> Factor:
        """Factor of the matrix assembled from those of the bricks.

        Parameters
        ----------
        values : of the bricks, symmetric, not always definite [N/m], shape (m, k, k)
        """
        return Factor(self.elimination, values)

    def spread(self, values: Array) -> Array:
        """Values of all unknowns, shape (3 n,), from those in the order of elimination, shape (r,), zero where held."""
        out = np.zeros(self.held.size)
        out[self.order] = values
        return out


def _jacobian(corners: Array, place: Array) -> Array:
    """Derivatives dx_i / dX_j of the trilinear map at reference points [m], shape (q, 3, 3).

    Parameters
    ----------
    corners : of the brick [m], shape (8, 3)
    place : reference points, shape (3, q)
    """
    _, gradient = trilinear(place.T)
    return np.asarray(np.einsum("ki,qkj->qij", corners, gradient))


def _strain_matrix(gradient: Array) -> Array:
    """Strains of nodal displacements, B in e = B u, at q points of bricks with n nodes, shape (q, 6, 3 n).

    Strains stand as xx, yy, zz, xy, yz, zx, and the last three are engineering shear, twice the tensor's: their product
    with stresses in this order is the work. Displacements stand as x, y, z of one node after another.

    Parameters
    ----------
    gradient : derivatives of the shape functions by x, y, z [1/m], shape (n, 3, q)
    """
    n, _, q = gradient.shape
    b = np.zeros((q, 6, n, 3))
    dx, dy, dz = gradient[:, 0].T, gradient[:, 1].T, gradient[:, 2].T
    b[:, 0, :, 0], b[:, 1, :, 1], b[:, 2, :, 2] = dx, dy, dz
    b[:, 3, :, 0], b[:, 3, :, 1] = dy, dx
    b[:, 4, :, 1], b[:, 4, :, 2] = dz, dy
    b[:, 5, :, 2], b[:, 5, :, 0] = dx, dz
    return b.reshape(q, 6, 3 * n)
