"""Modal shapes of a convex block: uniform and linear stresses, with exact stiffness and mass matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import roots_jacobi

from limitmason.deformable.elasticity import SOLID, Elasticity
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid, face_planes
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block

Array = NDArray[np.float64]

STRAINS, BENDING = "strain", "bending"
FAMILIES = (STRAINS, BENDING)
"""Families of shapes: constant strains alone, or with bending and the other linear stresses beside them."""

_SQUARE = 1e-6  # sides and faces this nearly equal count as equal: the first one given sets the axes


@dataclass(frozen=True)
class ModalBlock:
    """Displacements of a block in addition to its rigid motion, u(X) = sum_k q_k phi_k(X), in its own axes.

    phi = c + L X + X Q X with X from the centroid. The means of every phi and of X x phi are zero, so that neither
    uniform body forces nor body forces that grow as in a rotation act on a mode, and the kinetic energy is that of the
    rigid motion plus q' M q' / 2.

    Parameters
    ----------
    centroid : [m], shape (3,)
    constant, linear, quadratic : c, L, Q of every mode, Q symmetric in its last two axes, shapes (k, 3), (k, 3, 3),
        (k, 3, 3, 3)
    stiffness : integral of eps : C : eps over the volume, shape (k, k)
    mass : density times the integral of phi . phi, shape (k, k)
    second_moments : integral of X X^T over the volume [m5], shape (3, 3)
    elasticity : of its material
    volume : [m3]
    axes : rows are the axes that the shapes were written in, shape (3, 3)
    names : of the modes, as ``exx``, ``bend xz`` (stress along x, linear in z), ``pull x`` (along x, linear in x),
        ``twist x``

    Notes
    -----
    A mode's coordinate is its strain [-], or its gradient [1/m]; :meth:`in_coordinates` gives other ones. Strains
    are small, the rotation of the block is not limited where the engine carries the shapes with the block. In a plane
    exact for every stress that is linear over the block and in equilibrium without body forces; in space for uniform
    stress and for pure bending of a bar in any of its axes. A moment that varies along the block is met by its mean
    alone (a cantilever of n blocks is too stiff by 1 / (4 n^2)), shear by its mean over the depth (5/6 of the shear
    deflection of a beam). Cundall 1988 names the constant-strain blocks of the DEM "simply deformable".
    """

    centroid: Array
    constant: Array
    linear: Array
    quadratic: Array
    stiffness: Array
    mass: Array
    second_moments: Array
    elasticity: Elasticity
    volume: float
    axes: Array
    names: tuple[str, ...]

    @property
    def count(self) -> int:
        """Number of modes."""
        return len(self.constant)

    def displacement(self, points: Array) -> Array:
        """Displacement of every mode at points [m per unit of the mode], points in space (m, 3), shape (m, k, 3)."""
        x = np.asarray(points, dtype=float) - self.centroid
        out = self.constant[None] + np.einsum("kij,mj->mki", self.linear, x)
        return np.asarray(out + np.einsum("kijl,mj,ml->mki", self.quadratic, x, x))

    def strain(self, points: Array) -> Array:
        """Strain of every mode at points, shape (m, k, 3, 3)."""
        x = np.asarray(points, dtype=float) - self.centroid
        mean, slope = self.strain_field()
        return np.asarray(mean[None] + np.einsum("kijp,mp->mkij", slope, x))

    def strain_field(self) -> tuple[Array, Array]:
        """Strain at the centroid and its gradient, eps = eps_0 + slope . X, shapes (k, 3, 3), (k, 3, 3, 3)."""
        return _strain_field(self.linear, self.quadratic)

    def stress_field(self, coordinates: Array) -> tuple[Array, Array]:
        """Mean stress [Pa] and its gradient [Pa/m] at modal coordinates (k,), tension positive, own axes.

        Returns
        -------
        mean, gradient : sigma(X) = mean + gradient . X, shapes (3, 3), (3, 3, 3)
        """
        q = np.asarray(coordinates, dtype=float)
        mean, gradient = self.stress_modes()
        return np.asarray(np.tensordot(q, mean, axes=1)), np.asarray(np.tensordot(q, gradient, axes=1))

    def stress_modes(self) -> tuple[Array, Array]:
        """:meth:`stress_field` of a unit of every mode, shapes (k, 3, 3), (k, 3, 3, 3)."""
        mean, slope = self.strain_field()
        gradient = self.elasticity.stress(np.moveaxis(slope, -1, 1))
        return self.elasticity.stress(mean), np.asarray(np.moveaxis(gradient, 1, -1))

    def on_plane(self, origin: ArrayLike, tangent_1: ArrayLike, tangent_2: ArrayLike) -> Array:
        """Coefficients of phi(origin + s t1 + t t2) before 1, s, t, s^2, s t, t^2, shape (k, 6, 3).

        Parameters
        ----------
        origin : from the centroid [m], own axes, shape (3,)
        """
        o, a, b = (np.asarray(v, dtype=float) for v in (origin, tangent_1, tangent_2))

        def form(u: Array, v: Array) -> Array:
            return np.asarray(np.einsum("kijl,j,l->ki", self.quadratic, u, v))

        return np.stack(
            [
                self.constant + self.linear @ o + form(o, o), self.linear @ a + 2.0 * form(o, a),
                self.linear @ b + 2.0 * form(o, b), form(a, a), 2.0 * form(a, b), form(b, b),
            ], axis=1,
        )  # fmt: skip

    def in_coordinates(self, basis: Array) -> ModalBlock:
        """The same shapes in other coordinates, new mode = sum_k basis[k, new] phi_k, basis of shape (k, new)."""
        t = np.asarray(basis, dtype=float)

        def mixed(x: Array) -> Array:
            return np.asarray(np.tensordot(t.T, x, axes=1))

        return replace(
            self, constant=mixed(self.constant), linear=mixed(self.linear), quadratic=mixed(self.quadratic),
            stiffness=t.T @ self.stiffness @ t, mass=t.T @ self.mass @ t,
            names=tuple(f"mixed {n}" for n in range(t.shape[1])),
        )  # fmt: skip


def modal_block(block: Block, elasticity: Elasticity, *, family: str = BENDING) -> ModalBlock:
    """Modal shapes of a convex block.

    In a plane 3 constant strains, 2 of bending and 2 of pull; in space 6, 6 of bending and 3 of twist. Bending of axis
    i across j has the strain eps_ii = x_j and no stress but sigma_ii; pull along i has eps_ii = x_i, and beside
    sigma_ii the shear sigma_ij = -(sigma_ii / x_i) x_j that balances it: a load that enters a block through its sides;
    twist spans x_j x_k along each axis i. With bending and pull the stresses in a plane are those of all polynomials of
    Airy's stress function of degrees 2 and 3.

    Parameters
    ----------
    elasticity : of its material, with the plane
    family : "strain" or "bending", which has the strains too

    Raises
    ------
    InputError
        For a block that is not convex (one of several pieces), an unknown family, and a block that is no prism along
        the normal of the plane.

    Notes
    -----
    The axes are those of the block's largest face and of the longest side of it, in a plane of the longest side. In a
    plane the shapes together do not depend on them; in space bricks bend along their edges, and the shapes of bending
    depend on the axes where a block is no box. A turned block has turned shapes.

    References
    ----------
    Timoshenko and Goodier, Theory of Elasticity, 3rd ed. 1970, article 18: the polynomials of the stress function.
    """
    if family not in FAMILIES:
        raise InputError(f"the family of shapes must be one of {', '.join(FAMILIES)}, got {family!r}")
    if len(block.parts) != 1:
        raise InputError(
            f"block {block.name!r} is not convex ({len(block.parts)} pieces): the modal shapes are those of one convex "
            "body. Divide it into convex blocks with strong joints between them, use zones, or leave it rigid by "
            "giving it no material"
        )
    solid = block.parts[0]
    normal = elasticity.normal
    if normal is not None:
        check_prism(block.name, solid, normal)
    axes = block_axes(solid, normal)
    constant, linear, quadratic, names = _shapes(elasticity, family)
    e = axes.T  # columns: own axes in space
    linear = e @ linear @ e.T
    quadratic = np.einsum("ia,jb,lc,kabc->kijl", e, e, e, quadratic)
    inertia = block._properties[2]
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    # no mean displacement and no mean rotation: a mode is orthogonal to the six of the rigid block
    constant = constant - np.einsum("kijl,jl->ki", quadratic, second) / block.volume
    points, weights = volume_points(solid, block.centroid)
    phi = _values(constant, linear, quadratic, points)
    spin = np.linalg.solve(inertia, np.einsum("m,mki->ik", weights, np.cross(points[:, None], phi)))
    linear = linear - _cross_matrices(spin.T)
    phi = _values(constant, linear, quadratic, points)
    mass = block.density * np.einsum("m,mki,mli->kl", weights, phi, phi)
    return ModalBlock(
        block.centroid, constant, linear, quadratic, _stiffness(linear, quadratic, second, block.volume, elasticity),
        mass, second, elasticity, block.volume, axes, names,
    )  # fmt: skip


def modal_blocks(assembly: Assembly, state: str, normal: ArrayLike | None = None) -> list[ModalBlock | None]:
    """Modal shapes of the blocks of an assembly; None where a block has no material or is wholly held: it stays rigid.

    Parameters
    ----------
    state : "solid", "plane stress" or "plane strain"
    normal : of the plane, shape (3,); (0, 1, 0) where none is given

    Raises
    ------
    InputError
        Where no free block has a material, for a normal in space, and what :func:`modal_block` refuses.
    """
    laws = materials_of(assembly, state, normal)
    return [None if x is None else modal_block(b, x) for b, x in zip(assembly.blocks, laws, strict=True)]


def materials_of(assembly: Assembly, state: str, normal: ArrayLike | None = None) -> list[Elasticity | None]:
    """Elasticity of every block; None where a block has no material or is wholly held. As in :func:`modal_blocks`."""
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
    """Axes of a block as rows, right-handed: longest side of the largest face, across it, and its normal.

    In a plane: along the longest side, the normal of the plane, and their cross product.
    """
    vertices = solid.vertices
    corners = [vertices[list(face)] for face in solid.faces]
    if normal is not None:
        sides = [np.roll(c, -1, axis=0) - c for c in corners]
        flat = np.concatenate([s - np.outer(s @ normal, normal) for s in sides])
        first = _largest(np.linalg.norm(flat, axis=1))
        along = flat[first] / np.linalg.norm(flat[first])
        return np.stack([along, normal, np.cross(along, normal)])
    area = np.array([np.linalg.norm(np.cross(c, np.roll(c, -1, axis=0)).sum(axis=0)) / 2.0 for c in corners])
    face = corners[_largest(area)]
    across = face_planes(face[None])[0][0]
    side = np.roll(face, -1, axis=0) - face
    along = side[_largest(np.linalg.norm(side, axis=1))]
    along = along - (along @ across) * across
    along = along / np.linalg.norm(along)
    return np.stack([along, np.cross(across, along), across])


def volume_points(solid: Solid, centre: Array, order: int = 4) -> tuple[Array, Array]:
    """Points [m] from ``centre`` and weights [m3], exact for polynomials up to ``order`` over a convex solid.

    Tetrahedra from the centre to the triangles of the faces, each with a product of Gauss and Jacobi rules on the
    collapsed cube (Stroud 1971, conical product).
    """
    n = order // 2 + 1
    grids = [roots_jacobi(n, a, 0.0) for a in (2.0, 1.0, 0.0)]
    rules = [((1.0 + x) / 2.0, y / 2.0 ** (1 + a)) for (x, y), a in zip(grids, (2, 1, 0), strict=True)]
    (u, wu), (v, wv), (w, ww) = rules
    a, b, c = (g.ravel() for g in np.meshgrid(u, v, w, indexing="ij"))
    weight = np.einsum("i,j,k->ijk", wu, wv, ww).ravel()
    local = np.column_stack([a, b * (1.0 - a), c * (1.0 - a) * (1.0 - b)])
    triangles = np.array([(f[0], f[k], f[k + 1]) for f in solid.faces for k in range(1, len(f) - 1)])
    corner = solid.vertices[triangles] - centre
    det = np.linalg.det(corner)
    points = np.einsum("mc,tci->tmi", local, corner)
    return points.reshape(-1, 3), (det[:, None] * weight).ravel()


def _largest(values: Array) -> int:
    return int(np.flatnonzero(values >= values.max() * (1.0 - _SQUARE))[0])


def check_prism(name: str, solid: Solid, normal: Array) -> None:
    """Refuse a block whose faces are neither along nor across the normal of the plane."""
    for face in solid.faces:
        n = face_planes(solid.vertices[list(face)][None])[0][0]
        if 1e-6 < abs(n @ normal) < 1.0 - 1e-6:
            raise InputError(
                f"block {name!r} is no prism along the normal {np.round(normal, 6).tolist()} of the plane: plane "
                "stress and plane strain are for walls of constant thickness; take it in space"
            )


def _shapes(elasticity: Elasticity, family: str) -> tuple[Array, Array, Array, tuple[str, ...]]:
    """Shapes in the block's axes before the rigid motion is taken out, and their names."""
    letters, nu = "xyz", elasticity.contraction
    used: Sequence[int] = (0, 2) if elasticity.plane else (0, 1, 2)
    linear: list[Array] = []
    quadratic: list[Array] = []
    names: list[str] = []

    def add(name: str, first: Array | None = None, second: Array | None = None) -> None:
        names.append(name)
        linear.append(np.zeros((3, 3)) if first is None else first)
        quadratic.append(np.zeros((3, 3, 3)) if second is None else 0.5 * (second + second.transpose(0, 2, 1)))

    for n, i in enumerate(used):
        for j in used[n:]:
            form = np.zeros((3, 3))
            form[i, j] += 0.5
            form[j, i] += 0.5
            add(f"e{letters[i]}{letters[j]}", form)
    if family == BENDING:
        for i, j in permutations(used, 2):
            form = np.zeros((3, 3, 3))
            form[i, i, j] = 1.0
            form[j, i, i], form[j, j, j] = -0.5, -0.5 * nu
            if not elasticity.plane:
                k = 3 - i - j
                form[j, k, k], form[k, j, k] = 0.5 * nu, -nu
            add(f"bend {letters[i]}{letters[j]}", second=form)
        if elasticity.plane:
            for i, j in permutations(used, 2):
                form = np.zeros((3, 3, 3))
                form[i, i, i], form[i, j, j], form[j, i, j] = 0.5, -0.5 * (2.0 + nu), -nu
                add(f"pull {letters[i]}", second=form)
        else:
            for i in used:
                form = np.zeros((3, 3, 3))
                form[i, (i + 1) % 3, (i + 2) % 3] = 1.0
                add(f"twist {letters[i]}", second=form)
    return np.zeros((len(names), 3)), np.array(linear), np.array(quadratic), tuple(names)


def _strain_field(linear: Array, quadratic: Array) -> tuple[Array, Array]:
    slope = 2.0 * quadratic
    return 0.5 * (linear + linear.transpose(0, 2, 1)), 0.5 * (slope + slope.transpose(0, 2, 1, 3))


def _stiffness(linear: Array, quadratic: Array, second: Array, volume: float, elasticity: Elasticity) -> Array:
    """Integral of eps_k : C : eps_l; first moments about the centroid are zero, so two terms are left."""
    mean, slope = _strain_field(linear, quadratic)
    by_place = np.moveaxis(slope, -1, 1)  # (k, p, i, j)
    out = volume * np.einsum("kij,lij->kl", mean, elasticity.stress(mean))
    out += np.einsum("pq,kpij,lqij->kl", second, by_place, elasticity.stress(by_place))
    return np.asarray(0.5 * (out + out.T))


def _values(constant: Array, linear: Array, quadratic: Array, x: Array) -> Array:
    out = constant[None] + np.einsum("kij,mj->mki", linear, x)
    return np.asarray(out + np.einsum("kijl,mj,ml->mki", quadratic, x, x))


def _cross_matrices(w: Array) -> Array:
    """[w x] of every row, shape (k, 3, 3)."""
    out = np.zeros((len(w), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -w[:, 2], w[:, 1], -w[:, 0]
    return np.asarray(out - out.transpose(0, 2, 1))
