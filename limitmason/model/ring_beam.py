"""Ties on an assembly: whether they fit it, and ring beams as chains of ties along a line of points."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import instance, switch
from limitmason.errors import InputError
from limitmason.model.blockwork import Blockwork
from limitmason.model.input import read_list, read_vector
from limitmason.model.tie import Tie

_ON_FACE = 10.0  # tolerances of contacts, chosen: a point this near outside a face is meant to be on it
_LEAST_SLACK = 1e-9  # [m], of an assembly made by hand without a tolerance

FAR_OUTSIDE = 0.5
"""Distance of an end from its block, in longest sides of the block, from which it is taken for a mistake."""


def fitted(assembly: Blockwork, ties: Sequence[Tie]) -> tuple[Tie, ...]:
    """Ties with blocks by name, checked against an assembly.

    Parameters
    ----------
    assembly : that they are fastened to
    ties : with blocks by name or number

    Raises
    ------
    InputError
        For unknown blocks, a tie of a block to itself, one between held blocks, an end far outside its block, and a tie
        to the ground where no block is wholly held.
    """
    out = []
    for tie in ties:
        a = assembly.block_index(tie.block_a)
        b = assembly.ground_for(str(tie)) if tie.block_b is None else assembly.block_index(tie.block_b)
        names = assembly.blocks[a].name, assembly.blocks[b].name
        what = f"{tie}: " if not tie.name else f"tie {tie.name!r}: "
        if a == b and tie.block_b is not None:
            raise InputError(f"{what}both ends are on block {names[0]!r}; join two blocks, or one to the ground")
        if assembly.fixed[a] and assembly.fixed[b]:
            raise InputError(f"{what}both ends are held ({names[0]!r}, {names[1]!r}): it would never pull")
        # an end in the ground may lie anywhere
        for block, point in zip((a,) if tie.block_b is None else (a, b), tie.ends, strict=False):
            low, high = assembly.blocks[block].bounds
            outside = float(np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0.0)))
            if outside > FAR_OUTSIDE * float((high - low).max()):
                raise InputError(
                    f"{what}its end {point.tolist()} lies {outside:.3g} m outside block "
                    f"{assembly.blocks[block].name!r}; give a point of it, or name the block that the point belongs to"
                )
        out.append(replace(tie, block_a=names[0], block_b=None if tie.block_b is None else names[1]))
    return tuple(out)


def ring_beam(
    assembly: Blockwork, points: Sequence[ArrayLike], *, closed: bool = False, name: str = "ring beam",
    **options: Any,
) -> tuple[Tie, ...]:
    """Ties along a line of points, fastened to the blocks they lie in or on.

    Together they act as a ring beam in tension. Pieces whose both ends are on one block, or on held blocks, are
    left out.

    Parameters
    ----------
    assembly : the structure
    points : corners of the beam's line [m], shape (n, 3), on blocks; where several blocks meet the first
        free one counts
    closed : join the last point to the first; it needs three points
    name : of the beam; its pieces are numbered
    options : strengths and stiffness, see :class:`Tie`; every piece has them

    Raises
    ------
    InputError
        For fewer than two points, or three of a closed one, a point on no block, and a line none of whose pieces can
        pull.

    Notes
    -----
    The bending stiffness of a beam, which spreads load between its fastenings, is left out; a beam that rests on the
    wall as a body is a block of its own.
    """
    instance("assembly", assembly, Blockwork)
    line = np.array([read_vector("point of a ring beam", p) for p in read_list("points", points)])
    if len(line) < 2:
        raise InputError("a ring beam needs two points or more, three coordinates each [m]")
    if switch("closed", closed) and len(line) < 3:
        raise InputError("a closed ring beam needs three points or more: two would be tied twice")
    owner = [_block_at(assembly, p) for p in line]
    names = [assembly.blocks[block].name for block in owner]
    pairs = list(itertools.pairwise(range(len(line)))) + ([(len(line) - 1, 0)] if closed else [])
    ties = [
        Tie(names[i], line[i], names[j], line[j], name=f"{name} {k + 1}", **options)
        for k, (i, j) in enumerate(pairs)
        if names[i] != names[j] and not (assembly.fixed[owner[i]] and assembly.fixed[owner[j]])
    ]
    if not ties:
        raise InputError(f"{name}: no piece of the line joins two blocks of which one may move")
    return tuple(ties)


def _block_at(assembly: Blockwork, point: Array) -> int:
    """Number of the first block that holds a point, the free ones first.

    The point [m], shape (3,), lies inside it or on its faces.
    """
    slack = max(_ON_FACE * assembly.tolerance, _LEAST_SLACK)
    for block in sorted(range(assembly.n_blocks), key=lambda k: bool(assembly.fixed[k])):
        for part in assembly.blocks[block].parts:
            corners = part.vertices
            if all(_inside(corners[list(f)], point, slack) for f in part.faces):
                return block
    raise InputError(f"ring beam: the point {point.tolist()} lies in no block")


def _inside(corners: Array, point: Array, slack: float) -> bool:
    """Whether a point lies on the inner side of a face.

    Parameters
    ----------
    corners : of the face, counter-clockwise seen from outside [m], shape (n, 3)
    point : [m], shape (3,)
    slack : how far outside it still counts as inside [m]
    """
    # twice the vector area: a sum over triangles from the first corner
    normal = np.cross(corners - corners[0], np.roll(corners, -1, axis=0) - corners[0]).sum(axis=0)
    return bool((point - corners[0]) @ normal <= slack * np.linalg.norm(normal))
