"""Free vibration modes of a convex block in complete polynomials: an elastic body without a mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from limitmason.deformable.elasticity import Elasticity
from limitmason.deformable.polynomial_body import Body, Polynomials, materials_of
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block

DEGREE = 4
"""Of the polynomials, where none is asked for: 93 % of a fine mesh's compliance for a stone 2.5 times as long as deep
on its ends, loaded over its middle third (62 % with degree 2, 97 % with 6)."""

HIGHEST = 8
"""Degree up to which polynomials may be asked for; chosen."""

_SAME, _SIZE = 9, 12  # digits of a block's largest coordinate, and of a metre, to which equal blocks share their shapes


def polynomial_block(block: Block, elasticity: Elasticity, *, degree: int = DEGREE) -> Body:
    """Ritz vectors of a convex block: K v = w^2 M v over all polynomials up to a degree.

    The rigid motions are left out. The vectors are orthogonal to each other in stiffness and in mass, and the integral
    of phi . phi over the block is its volume, so that a coordinate is a root mean square of displacement. The
    compliance comes from below, and meets that of the body as the degree grows; singular stresses, as under the edge of
    a joint, are met in the mean only.

    Parameters
    ----------
    block : convex
    elasticity : of its material, with the plane
    degree : of the polynomials, 1 to 8; 1 are the constant strains

    Raises
    ------
    InputError
        For a block that is not convex, another degree, and a block that is no prism along the normal of the plane.
    """
    if isinstance(degree, bool) or degree not in range(1, HIGHEST + 1):
        raise InputError(f"degree of the polynomials must be a whole number from 1 to {HIGHEST}, got {degree!r}")
    space = Polynomials(block, elasticity, degree)
    n, used = len(space.powers), list(space.used)
    # one product of Legendre polynomials in one direction each, of which the Ritz vectors are sums
    unit = np.zeros((len(used) * n, 3, n))
    for row, i in enumerate(used):
        unit[row * n : (row + 1) * n, i] = np.eye(n)
    every = space.body(unit, tuple(f"product {k}" for k in range(len(unit))))
    rigid = 3 if elasticity.plane else 6
    # w^2 and v for a density of 1; the first are zero, of the rigid motions, which the block has already
    squared, vectors = eigh(every.stiffness, np.kron(np.eye(len(used)), space.gram))
    # vectors of a unit integral of phi . phi, to one that is the volume
    squared, vectors = squared[rigid:] * block.volume, vectors[:, rigid:] * np.sqrt(block.volume)
    names = tuple(f"mode {k + 1}" for k in range(vectors.shape[1]))
    return replace(
        every, coefficients=np.tensordot(vectors.T, unit, axes=1), stiffness=np.diag(squared),
        mass=block.density * block.volume * np.eye(len(squared)), names=names,
        mean_gradient=np.tensordot(vectors.T, every.mean_gradient, axes=1),
    )


def polynomial_blocks(
    assembly: Assembly, state: str, normal: ArrayLike | None = None, *, degree: int = DEGREE
) -> list[Body | None]:
    """Ritz vectors of the blocks of an assembly.

    The entry is None where a block has no material or is wholly held: the block stays rigid.

    Parameters
    ----------
    state, normal : as in :func:`limitmason.deformable.simply_deformable_blocks`
    degree : as in :func:`polynomial_block`; blocks that are alike share their shapes
    """
    known: dict[tuple[object, ...], Body] = {}
    out: list[Body | None] = []
    for block, elasticity in zip(assembly.blocks, materials_of(assembly, state, normal), strict=True):
        if elasticity is None:
            out.append(None)
            continue
        arm = block.vertices - block.centroid
        size = float(np.abs(arm).max())
        # shapes do not hang on where a block lies, but on how it is turned
        key = (id(elasticity), block.density, round(size, _SIZE), np.round(arm / size, _SAME).tobytes())
        if key not in known:
            known[key] = polynomial_block(block, elasticity, degree=degree)
        out.append(replace(known[key], centroid=block.centroid))
    return out
