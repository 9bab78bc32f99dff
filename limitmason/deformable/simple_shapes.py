"""Shapes of a simply deformable block: uniform and linear stresses, and the moments that shear makes grow along it."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.deformable.elasticity import Elasticity
from limitmason.deformable.polynomial_body import Body, Polynomials, materials_of
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block

DEGREE = 3
"""Of the shapes: displacements of a moment that grows along a block are cubic."""


def simply_deformable_block(block: Block, elasticity: Elasticity) -> Body:
    """Shapes of a simply deformable block, which is convex.

    In a plane 3 constant strains, 2 of bending, 2 of pull and 2 of shear; in space 6, 6 of bending, 3 of twist and 6
    of shear. Bending of axis i across j has the strain eps_ii = x_j and no stress but sigma_ii. Pull along i has
    eps_ii = x_i, and beside sigma_ii the shear sigma_ij = -(sigma_ii / x_i) x_j that balances it: a load that enters a
    block through its sides. Twist spans x_j x_k along each axis i. Shear along i across j has the strain
    eps_ii = x_i x_j of a moment that grows along i, and the parabola of shear which makes it grow. A mode's coordinate
    is its strain [-], or its gradient [1/m] or [1/m2].

    Parameters
    ----------
    block : convex
    elasticity : of its material, with the plane

    Raises
    ------
    InputError
        For a block that is not convex (one of several pieces), and one that is no prism along the normal of the plane.

    Notes
    -----
    The axes are those of the block's largest face and of the longest side of it, in a plane of the longest side. In
    space bricks bend along their edges, and the shapes of bending depend on the axes where a block is no box. A turned
    block has turned shapes. Every shape but twist is balanced without body forces. A beam of such blocks under forces
    at its joints has Timoshenko's deflection with any number of them; twist is too stiff, as of an ellipse with the
    same second moments (18 % for 3 to 2). Cundall 1988 names the constant-strain blocks of the DEM "simply deformable".

    References
    ----------
    Timoshenko and Goodier, Theory of Elasticity, 3rd ed. 1970, articles 18 and 21: polynomials of the stress function.
    """
    space = Polynomials(block, elasticity, DEGREE)
    names, values = _shapes(elasticity, space.local)
    return space.body(space.fitted(np.stack(values, axis=1)), names)


def simply_deformable_blocks(assembly: Assembly, state: str, normal: ArrayLike | None = None) -> list[Body | None]:
    """Shapes of simply deformable blocks.

    The entry is None where a block has no material or is wholly held: the block stays rigid.

    Parameters
    ----------
    state : "solid", "plane stress" or "plane strain"
    normal : of the plane, shape (3,); (0, 1, 0) where none is given

    Raises
    ------
    InputError
        Where no free block has a material, for a normal in space, and what :func:`simply_deformable_block` refuses.
    """
    laws = materials_of(assembly, state, normal)
    return [None if x is None else simply_deformable_block(b, x) for b, x in zip(assembly.blocks, laws, strict=True)]


def _shapes(elasticity: Elasticity, x: Array) -> tuple[tuple[str, ...], list[Array]]:
    """Names of the shapes and their values at points, rigid motions left in.

    Values are along the block's axes, shape (m, 3) each. They are the displacements of the strains and stresses that
    :func:`simply_deformable_block` names. Axis i is along, j across and k the third in space; their coordinates are a,
    b and c.

    Parameters
    ----------
    elasticity : of the material, which gives the lateral contraction
    x : places from the centroid in the block's axes [m], shape (m, 3)
    """
    letters, nu = "xyz", elasticity.contraction
    used = (0, 2) if elasticity.plane else (0, 1, 2)
    found: dict[str, Array] = {}

    def add(name: str, parts: dict[int, Array]) -> None:
        """Take a shape in, from its displacement along every axis on which it is not zero."""
        found[name] = np.stack([parts.get(c, np.zeros(len(x))) for c in range(3)], axis=1)

    for n, i in enumerate(used):
        for j in used[n:]:
            # a shear strain of one, half of it from the displacement along either axis
            both = {i: 0.5 * x[:, j], j: 0.5 * x[:, i]}
            add(f"e{letters[i]}{letters[j]}", both if i != j else {i: x[:, i]})
    for i, j in permutations(used, 2):
        a, b = x[:, i], x[:, j]
        c = np.zeros(len(x)) if elasticity.plane else x[:, 3 - i - j]
        third = {} if elasticity.plane else {3 - i - j: -nu * b * c}  # axes 0, 1 and 2 add up to 3
        # eps_ii = b with eps_jj = eps_kk = -nu b: nothing but sigma_ii
        add(f"bend {letters[i]}{letters[j]}", {i: a * b, j: -0.5 * (a**2 + nu * b**2 - nu * c**2), **third})
        # eps_ii = a b: a moment that grows along i, and the section warps by the parabola of shear that makes it grow
        third = {} if elasticity.plane else {3 - i - j: -nu * a * b * c}
        warp = -(2.0 + nu) / 6.0 * b**3 + 0.5 * nu * b * c**2
        across = -(a**3) / 6.0 - 0.5 * nu * a * (b**2 - c**2)
        add(f"shear {letters[i]}{letters[j]}", {i: 0.5 * a**2 * b + warp, j: across, **third})
    if elasticity.plane:
        for i, j in permutations(used, 2):
            a, b = x[:, i], x[:, j]
            # eps_ii = a: sigma_ii grows along i, and the shear sigma_ij = -(sigma_ii / a) b balances it
            add(f"pull {letters[i]}", {i: 0.5 * (a**2 - (2.0 + nu) * b**2), j: -nu * a * b})
    else:
        for i in used:
            add(f"twist {letters[i]}", {i: x[:, (i + 1) % 3] * x[:, (i + 2) % 3]})
    return tuple(found), list(found.values())
