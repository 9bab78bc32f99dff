"""Free vibrations of a convex block in complete polynomials: an elastic body to any accuracy, without a mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from limitmason.deformable.elasticity import Elasticity
from limitmason.deformable.modes import block_axes, check_prism, materials_of, volume_points
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block

Array = NDArray[np.float64]

DEGREE = 4
"""Of the polynomials, where none is asked for: 93 % of a fine mesh's compliance for a stone 2.5 times as long as deep
on its ends, loaded over its middle third (62 % with degree 2, 97 % with 6)."""

_SAME = 9  # digits of a block's largest coordinate to which equal blocks share their shapes


@dataclass(frozen=True, eq=False)
class PolynomialBlock:
    """Ritz vectors of a free elastic body, u(X) = sum_k q_k phi_k(X), phi complete polynomials up to a degree.

    K v = w^2 M v over all of them, without the rigid motions: the shapes are orthogonal to these, so that uniform body
    forces act on none, and to each other in stiffness and in mass. The integral of phi . phi is the volume.

    Parameters
    ----------
    centroid : [m], shape (3,)
    axes : rows are the axes of the polynomials, shape (3, 3)
    half : half extents along them, by which coordinates are divided [m], shape (3,)
    powers : degree along each axis of every product of Legendre polynomials, shape (e, 3)
    coefficients : of them, components along the axes, shape (k, 3, e)
    stiffness : diagonal [N/m], shape (k, k)
    mass : diagonal [kg], shape (k, k)

    Notes
    -----
    The compliance comes from below, and meets that of the body as the degree grows; singular stresses, as under the
    edge of a joint, are met in the mean only.
    """

    centroid: Array
    axes: Array
    half: Array
    powers: NDArray[np.intp]
    coefficients: Array
    stiffness: Array
    mass: Array

    @property
    def count(self) -> int:
        """Number of shapes."""
        return len(self.coefficients)

    def displacement(self, points: Array) -> Array:
        """Displacement of every shape at points [m per unit of its coordinate], points (m, 3), shape (m, k, 3)."""
        value, _ = _products((np.asarray(points, float) - self.centroid) @ self.axes.T / self.half, self.powers)
        return np.asarray(np.einsum("me,kce,ci->mki", value, self.coefficients, self.axes, optimize=True))


def polynomial_block(block: Block, elasticity: Elasticity, *, degree: int = DEGREE) -> PolynomialBlock:
    """Ritz vectors of a convex block.

    Parameters
    ----------
    elasticity : of its material, with the plane
    degree : of the polynomials, 1 to 8; 1 are the constant strains

    Raises
    ------
    InputError
        For a block that is not convex, another degree, and a block that is no prism along the normal of the plane.
    """
    if len(block.parts) != 1:
        raise InputError(
            f"block {block.name!r} is not convex ({len(block.parts)} pieces): divide it into convex blocks with strong "
            "joints between them, or leave it rigid by giving it no material"
        )
    if isinstance(degree, bool) or degree not in range(1, 9):
        raise InputError(f"degree of the polynomials must be a whole number from 1 to 8, got {degree!r}")
    solid, normal = block.parts[0], elasticity.normal
    if normal is not None:
        check_prism(block.name, solid, normal)
    axes = block_axes(solid, normal)
    local = (solid.vertices - block.centroid) @ axes.T
    half = np.abs(local).max(axis=0)
    used = (0, 2) if elasticity.plane else (0, 1, 2)
    powers = np.array([
        (i, j, k) for i in range(degree + 1) for j in range(degree + 1 - i) for k in range(degree + 1 - i - j)
        if not (elasticity.plane and j)
    ])  # fmt: skip
    points, weight = volume_points(solid, block.centroid, 2 * degree)
    value, slope = _products(points @ axes.T / half, powers)
    slope = slope / half
    n = len(powers)
    gradient = np.zeros((len(points), len(used) * n, 3, 3))  # d u_i / d x_j, own axes
    for row, i in enumerate(used):
        gradient[:, row * n : (row + 1) * n, i, :] = slope
    strain = 0.5 * (gradient + gradient.transpose(0, 1, 3, 2))
    turned = replace(elasticity, projector=axes @ elasticity.projector @ axes.T)
    stress = turned.stress(strain)
    stiffness = np.tensordot((weight[:, None, None, None] * strain), stress, axes=((0, 2, 3), (0, 2, 3)))
    mass = np.kron(np.eye(len(used)), (weight[:, None] * value).T @ value)
    rigid = 3 if elasticity.plane else 6
    squared, vectors = eigh(0.5 * (stiffness + stiffness.T), mass)
    vectors, squared = vectors[:, rigid:] * np.sqrt(block.volume), squared[rigid:] * block.volume
    coefficients = np.zeros((len(squared), 3, n))
    coefficients[:, used] = vectors.T.reshape(len(squared), len(used), n)
    return PolynomialBlock(
        block.centroid, axes, half, powers, coefficients, np.diag(squared),
        block.density * block.volume * np.eye(len(squared)),
    )  # fmt: skip


def polynomial_blocks(
    assembly: Assembly, state: str, normal: ArrayLike | None = None, *, degree: int = DEGREE
) -> list[PolynomialBlock | None]:
    """Ritz vectors of the blocks of an assembly; None where a block has no material or is wholly held: it stays rigid.

    Parameters
    ----------
    state, normal : as in :func:`limitmason.deformable.modal_blocks`
    degree : as in :func:`polynomial_block`; blocks that are alike share their shapes
    """
    known: dict[tuple[object, ...], PolynomialBlock] = {}
    out: list[PolynomialBlock | None] = []
    for block, elasticity in zip(assembly.blocks, materials_of(assembly, state, normal), strict=True):
        if elasticity is None:
            out.append(None)
            continue
        arm = block.vertices - block.centroid
        size = float(np.abs(arm).max())
        key = (id(elasticity), block.density, round(size, 12), np.round(arm / size, _SAME).tobytes())
        if key not in known:
            known[key] = polynomial_block(block, elasticity, degree=degree)
        out.append(replace(known[key], centroid=block.centroid))
    return out


def _products(x: Array, powers: NDArray[np.intp]) -> tuple[Array, Array]:
    """Products of Legendre polynomials and their gradient at scaled coordinates (m, 3), shapes (m, e), (m, e, 3)."""
    most = int(powers.max())
    one = legendre.legvander(x, most)  # (m, 3, most + 1)
    derivative = np.zeros_like(one)
    for k in range(1, most + 1):
        derivative[..., k] = legendre.legval(x, legendre.legder(np.eye(most + 1)[k]))
    factor = np.stack([one[:, i, powers[:, i]] for i in range(3)])
    change = np.stack([derivative[:, i, powers[:, i]] for i in range(3)])
    slope = [change[i] * factor[(i + 1) % 3] * factor[(i + 2) % 3] for i in range(3)]
    return factor.prod(axis=0), np.stack(slope, axis=2)
