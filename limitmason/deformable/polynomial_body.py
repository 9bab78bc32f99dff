"""Displacement shapes of a deformable block: polynomials at points, their strains, stiffness and mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike
from scipy.special import roots_jacobi

from limitmason.arrays import Array, Index
from limitmason.deformable.elasticity import SOLID, Elasticity
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid, face_plane
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block
from limitmason.storage.frozen import ReadOnly

_SQUARE = 1e-6  # sides and faces this nearly equal count as equal
_PRISM = 1e-6  # cosine, or what it lacks of 1, up to which a face is along or across the normal of a plane
_ALIKE = 0.6  # cosine from which equal ones set an axis together; of a square's sides the first one given sets it


@dataclass(frozen=True, eq=False)
class Body(ReadOnly):
    """Displacements of a block beside its rigid motion.

    u(X) = sum_k q_k phi_k(X), phi polynomials in its own axes.

    The means of every phi and of X x phi are zero: uniform body forces, and those that grow as in a rotation, act on no
    shape, and the kinetic energy is that of the rigid motion plus q' M q' / 2.

    Parameters
    ----------
    centroid : [m], shape (3,)
    axes : rows are the axes of the polynomials, shape (3, 3)
    half : half extents along them, by which coordinates are divided [m], shape (3,)
    powers : degree along each axis of every product of Legendre polynomials, shape (e, 3)
    coefficients : of them, components along the axes, shape (k, 3, e)
    stiffness : integral of eps : C : eps over the volume, shape (k, k)
    mass : density times the integral of phi . phi, shape (k, k)
    elasticity : of its material, global axes
    names : of the shapes
    mean_gradient : mean of d phi_i / d x_j over the volume, global axes [-], shape (k, 3, 3)

    Notes
    -----
    Strains are small; the rotation of the block is not limited where the engine carries the shapes with the block.
    """

    centroid: Array
    axes: Array
    half: Array
    powers: Index
    coefficients: Array
    stiffness: Array
    mass: Array
    elasticity: Elasticity
    names: tuple[str, ...]
    mean_gradient: Array

    @property
    def count(self) -> int:
        """Number of shapes."""
        return len(self.coefficients)

    def displacement(self, points: Array) -> Array:
        """Displacement of a unit of every shape at points [m], shape (m, k, 3)."""
        value, _ = products(self._scaled(points), self.powers)
        return np.asarray(np.einsum("me,kce,ci->mki", value, self.coefficients, self.axes, optimize=True))

    def strain(self, points: Array) -> Array:
        """Strain of a unit of every shape at points, global axes, shape (m, k, 3, 3)."""
        gradient = self._gradient(points)
        own = 0.5 * (gradient + gradient.transpose(0, 1, 3, 2))
        return np.asarray(self.axes.T @ own @ self.axes)

    def _gradient(self, points: Array) -> Array:
        """Gradient of every shape at points, d phi_c / d x_j in the axes of the polynomials, shape (m, k, 3, 3)."""
        _, slope = products(self._scaled(points), self.powers)
        return np.einsum("mej,kce->mkcj", slope / self.half, self.coefficients, optimize=True)

    def stress(self, points: Array) -> Array:
        """Stress of a unit of every shape, tension positive [Pa], shape (m, k, 3, 3)."""
        return self.elasticity.stress(self.strain(points))

    def linear_stress(self, block: Block) -> tuple[Array, Array]:
        """Mean stress of every shape [Pa] and its gradient by least squares [Pa/m].

        They are per unit of its coordinate. Shapes (k, 3, 3) and (k, 3, 3, 3), the last index along which it changes.
        The block is the one that the shapes are of.
        """
        x, w = volume_points(block.parts[0], block.centroid)
        stress = self.stress(x + block.centroid)
        # least squares over the volume: about the centroid mean and gradient are found one without the other
        moment = np.einsum("m,mkij,mp->kijp", w, stress, x, optimize=True)
        return np.tensordot(w, stress, axes=1) / w.sum(), np.asarray(moment @ np.linalg.inv((w * x.T) @ x))

    def _scaled(self, points: Array) -> Array:
        """Coordinates of points [m] along the block's axes over its half extents [-], shape (m, 3)."""
        return np.asarray((np.asarray(points, dtype=float) - self.centroid) @ self.axes.T / self.half)


class Polynomials:
    """All polynomials up to a degree over a convex block, its rigid motions among them.

    Parameters
    ----------
    block : convex
    elasticity : of its material, with the plane
    degree : of the polynomials, the largest sum of powers

    Attributes
    ----------
    axes, half, powers : as of :class:`Body`
    used : numbers of the axes along which blocks are displaced: in a plane the second is its normal
    points, weight : quadrature points [m], shape (m, 3), and their weights [m3], shape (m,)
    local : points from the centroid along the axes [m], shape (m, 3)
    value : of every product at the points, shape (m, e)
    gram : integrals of all products of two of them [m3], shape (e, e)

    Raises
    ------
    InputError
        For a block that is not convex, and one that is no prism along the normal of the plane.
    """

    def __init__(self, block: Block, elasticity: Elasticity, degree: int) -> None:
        """Lay out axes, products and a quadrature that is exact for their squares."""
        if len(block.parts) != 1:
            raise InputError(
                f"block {block.name!r} is not convex ({len(block.parts)} pieces): the shapes are those of one convex "
                "body. Divide it into convex blocks with strong joints between them, use zones, or leave it rigid by "
                "giving it no material"
            )
        self.block, self.elasticity, solid = block, elasticity, block.parts[0]
        if elasticity.normal is not None:
            check_prism(block.name, solid, elasticity.normal)
        self.axes = block_axes(solid, elasticity.normal)
        self.half = np.abs((solid.vertices - block.centroid) @ self.axes.T).max(axis=0)
        self.used: Sequence[int] = (0, 2) if elasticity.plane else (0, 1, 2)
        order = range(degree + 1)
        self.powers = np.array([
            (i, j, k) for i in order for j in order for k in order
            if i + j + k <= degree and not (elasticity.plane and j)  # nothing changes across a plane
        ])
        points, self.weight = volume_points(solid, block.centroid, 2 * degree)
        self.points = points + block.centroid
        self.local = points @ self.axes.T
        self.value, _ = products(self.local / self.half, self.powers)
        self.gram = self.value.T @ (self.weight[:, None] * self.value)

    def body(self, coefficients: Array, names: tuple[str, ...]) -> Body:
        """A body with shapes of these coefficients, with its stiffness and mass by quadrature.

        Parameters
        ----------
        coefficients : of every shape in the products of :class:`Body`, along its axes, shape (k, 3, e)
        names : of the shapes, in words
        """
        none = np.zeros((0, 0))
        # stiffness, mass and mean gradient are found from the strains and displacements of the shapes, and then put in
        out = Body(
            centroid=self.block.centroid, axes=self.axes, half=self.half, powers=self.powers, coefficients=coefficients,
            stiffness=none, mass=none, elasticity=self.elasticity, names=names, mean_gradient=np.zeros((0, 3, 3)),
        )
        strain = out.strain(self.points)
        stress = self.elasticity.stress(strain)
        stiffness = np.tensordot(self.weight[:, None, None, None] * strain, stress, axes=((0, 2, 3), (0, 2, 3)))
        u = out.displacement(self.points)
        mass = self.block.density * np.tensordot(self.weight[:, None, None] * u, u, axes=((0, 2), (0, 2)))
        gradient = np.tensordot(self.weight, out._gradient(self.points), axes=1) / self.weight.sum()
        return replace(
            out, stiffness=0.5 * (stiffness + stiffness.T), mass=0.5 * (mass + mass.T),
            mean_gradient=self.axes.T @ gradient @ self.axes,
        )

    def fitted(self, shapes: Array) -> Array:
        """Coefficients of shapes, less their mean displacement and rotation, (k, 3, e).

        Parameters
        ----------
        shapes : values at the points of polynomials up to the degree, along the block's axes [m], shape (m, k, 3)
        """
        w, x = self.weight, self.local
        # take off the mean, and the rotation of least squares: inertia of a density of 1 times spin is the moment
        u = shapes - np.tensordot(w, shapes, axes=1) / w.sum()
        inertia = np.einsum("m,mij->ij", w, (x**2).sum(axis=1)[:, None, None] * np.eye(3) - x[:, :, None] * x[:, None])
        spin = np.linalg.solve(inertia, np.einsum("m,mki->ik", w, np.cross(x[:, None], u)))
        u = u - np.cross(spin.T, x[:, None])
        # least squares again, which polynomials of the degree meet exactly
        values = np.tensordot((w[:, None] * self.value).T, u, axes=1)  # (e, k, 3)
        solved = np.linalg.solve(self.gram, values.reshape(len(self.gram), -1))
        return np.asarray(solved.reshape(values.shape).transpose(1, 2, 0))


def materials_of(assembly: Assembly, state: str, normal: ArrayLike | None = None) -> list[Elasticity | None]:
    """Elasticity of every block, None where it has no material or is wholly held.

    Arguments and errors are those of :func:`limitmason.deformable.simply_deformable_blocks`: a ``state`` of stress and
    the ``normal`` of its plane. Blocks of one material share one object.
    """
    if state == SOLID and normal is not None:
        raise InputError("a normal is for plane stress and plane strain; in space leave it out")
    held = assembly.fixed
    materials = [None if f else b.material for b, f in zip(assembly.blocks, held, strict=True)]
    if not any(materials):
        raise InputError(
            "no free block has a material, so that nothing deforms: give assembly.with_material(Material(...))"
        )
    laws = {id(m): Elasticity.of(m.young_modulus, m.poisson_ratio, state, normal) for m in materials if m is not None}
    return [None if m is None else laws[id(m)] for m in materials]


def block_axes(solid: Solid, normal: Array | None) -> Array:
    """Axes of a convex block as the rows of a right-handed frame, shape (3, 3).

    In space they are the longest side of the largest face, the direction across it, and its normal. In a plane they are
    the longest side, the normal of the plane, and their cross product.

    Parameters
    ----------
    solid : the block [m]
    normal : unit normal of the plane, shape (3,); None in space
    """
    # from a corner of its own: products of map coordinates would leave nothing of the block
    corners = [solid.vertices[list(face)] - solid.vertices[0] for face in solid.faces]
    sides = [np.roll(c, -1, axis=0) - c for c in corners]
    if normal is not None:
        # sides as they are seen along the normal
        flat = np.concatenate([s - np.outer(s @ normal, normal) for s in sides])
        along, _ = _longest(flat)
        return np.stack([along, normal, np.cross(along, normal)])
    # normals of the faces, as long as twice their areas
    across, faces = _longest(np.array([np.cross(c, np.roll(c, -1, axis=0)).sum(axis=0) for c in corners]))
    # two equal faces need not be parallel, as a voussoir's beds: their sides are laid into the plane between them
    flat = np.concatenate([sides[k] for k in faces])
    along, _ = _longest(flat - np.outer(flat @ across, across))
    return np.stack([along, np.cross(across, along), across])


def _longest(vectors: Array) -> tuple[Array, Index]:
    """Unit vector along the longest of vectors, (n, 3), and the numbers of those that set it.

    Of equally long ones, as of a voussoir's two beds, it is the mean of those that nearly point along the first, or
    against it.
    """
    size = np.linalg.norm(vectors, axis=1)
    # sense does not count: opposite faces have opposite normals
    longest = np.flatnonzero(size >= size.max() * (1.0 - _SQUARE))
    turn = vectors[longest] @ vectors[longest[0]] / size.max() ** 2
    alike = np.abs(turn) > _ALIKE
    total = (np.sign(turn[alike])[:, None] * vectors[longest[alike]]).sum(axis=0)
    return total / np.linalg.norm(total), longest[alike]


def volume_points(solid: Solid, centre: Array, order: int = 4) -> tuple[Array, Array]:
    """Quadrature over a convex solid, exact for polynomials up to ``order``.

    Tetrahedra from the centre to the triangles of the faces, each with a product of Gauss and Jacobi rules on the
    collapsed cube (Stroud 1971, conical product).

    Parameters
    ----------
    centre : a point of the solid [m], shape (3,)

    Returns
    -------
    Points seen from the centre [m], shape (m, 3), and their weights [m3], shape (m,).
    """
    n = order // 2 + 1  # a Gauss rule of n points is exact up to degree 2 n - 1
    # Jacobi rules on (-1, 1) with the weights (1 - x)^2, 1 - x and 1, to which the cube collapses, moved to (0, 1)
    grids = [roots_jacobi(n, a, 0.0) for a in (2.0, 1.0, 0.0)]
    rules = [((1.0 + x) / 2.0, y / 2.0 ** (1 + a)) for (x, y), a in zip(grids, (2, 1, 0), strict=True)]
    (u, wu), (v, wv), (w, ww) = rules
    a, b, c = (g.ravel() for g in np.meshgrid(u, v, w, indexing="ij"))  # points of the cube
    weight = np.einsum("i,j,k->ijk", wu, wv, ww).ravel()
    # barycentric weights of a tetrahedron's corners beside the centre
    local = np.column_stack([a, b * (1.0 - a), c * (1.0 - a) * (1.0 - b)])
    triangles = np.array([(f[0], f[k], f[k + 1]) for f in solid.faces for k in range(1, len(f) - 1)])
    corner = solid.vertices[triangles] - centre
    det = np.linalg.det(corner)  # six times the volume of every tetrahedron, which the rules' weights divide by six
    points = np.einsum("mc,tci->tmi", local, corner)
    return points.reshape(-1, 3), (det[:, None] * weight).ravel()


def products(x: Array, powers: Index) -> tuple[Array, Array]:
    """Products of Legendre polynomials, shape (m, e), and gradients, (m, e, 3).

    Parameters
    ----------
    x : coordinates of points over the half extents [-], shape (m, 3)
    powers : degree along every axis of each product, shape (e, 3)
    """
    most = int(powers.max())
    one = legendre.legvander(x, most)  # (m, 3, most + 1)
    derivative = np.zeros_like(one)
    for k in range(1, most + 1):
        derivative[..., k] = legendre.legval(x, legendre.legder(np.eye(most + 1)[k]))
    # of every axis its factor in each product, (3, m, e), and the derivative of that
    factor = np.stack([one[:, i, powers[:, i]] for i in range(3)])
    change = np.stack([derivative[:, i, powers[:, i]] for i in range(3)])
    slope = [change[i] * factor[(i + 1) % 3] * factor[(i + 2) % 3] for i in range(3)]
    return factor.prod(axis=0), np.stack(slope, axis=2)


def check_prism(name: str, solid: Solid, normal: Array) -> None:
    """Refuse a block, by its name, whose solid is no prism along the unit normal of the plane.

    A face of it is then neither along nor across the normal.
    """
    for face in solid.faces:
        n, _ = face_plane(solid.vertices[list(face)])
        if _PRISM < abs(n @ normal) < 1.0 - _PRISM:
            raise InputError(
                f"block {name!r} is no prism along the normal {np.round(normal, 6).tolist()} of the plane: plane "
                "stress and plane strain are for walls of constant thickness; take it in space"
            )
