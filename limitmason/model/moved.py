"""An assembly turned, mirrored, scaled, renumbered, or with blocks made one: interfaces and doubts go with them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import count, numbers
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid
from limitmason.model.blockwork import Blockwork
from limitmason.model.contact_warnings import moved_doubts, renumbered_doubts
from limitmason.model.input import read_list, read_vector
from limitmason.model.support import DEGREES_OF_FREEDOM, Support

Laid = TypeVar("Laid", bound=Blockwork)


def transformed(assembly: Laid, matrix: ArrayLike, translation: ArrayLike) -> Laid:
    """The assembly turned, mirrored, scaled or moved: x -> matrix x + translation.

    See ``Assembly.transformed``.

    Parameters
    ----------
    assembly : before
    matrix : a multiple of an orthogonal one, shape (3, 3)
    translation : [m], shape (3,)
    """
    m, t = numbers("matrix", matrix), read_vector("translation", translation)
    # lengths after over before
    scale = abs(np.linalg.det(m)) ** (1.0 / 3.0) if m.shape == (3, 3) else 0.0
    if not scale > 0.0 or not np.allclose(m @ m.T, scale**2 * np.eye(3), atol=1e-9 * scale**2):
        raise InputError("matrix must be a multiple of an orthogonal 3 x 3 matrix (rotation, mirror, uniform scale)")
    # a mirror turns the sense of every polygon round
    mirrored = np.linalg.det(m) < 0

    def moved(solid: Solid) -> Solid:
        """A convex piece after the motion.

        Its faces run counter-clockwise seen from outside again.
        """
        faces = tuple(f[::-1] for f in solid.faces) if mirrored else solid.faces
        return Solid(solid.vertices @ m.T + t, faces)

    blocks = tuple(
        replace(b, parts=tuple(moved(p) for p in b.parts), axis=None if b.axis is None else m @ b.axis / scale)
        for b in assembly.blocks
    )
    interfaces = tuple(
        replace(
            i,
            polygon=(i.polygon[::-1] if mirrored else i.polygon) @ m.T + t,
            normal=m @ i.normal / scale,
        )
        for i in assembly.interfaces
    )
    # lengths and directions that it names hold under a translation alone
    recipe = assembly.recipe if np.allclose(m, np.eye(3)) else {}
    rules = assembly.contact_rules
    return replace(
        assembly, blocks=blocks, interfaces=interfaces, recipe=recipe, tolerance=assembly.tolerance * scale,
        supports=tuple(_turned_support(s, m / scale) for s in assembly.supports),
        contact_rules=replace(
            rules, distance=None if rules.distance is None else rules.distance * scale,
            width=None if rules.width is None else rules.width * scale,
        ),
        doubts=moved_doubts(assembly.doubts, m, t, scale),
        ties=tuple(replace(tie, point_a=m @ tie.ends[0] + t, point_b=m @ tie.ends[1] + t) for tie in assembly.ties),
    )


def _turned_support(support: Support, turn: Array) -> Support:
    """A support whose held directions turn with its block.

    Parameters
    ----------
    support : before
    turn : orthogonal, shape (3, 3)

    Raises
    ------
    InputError
        Naming the block, where what it holds then runs along no global axes.
    """
    held: list[bool] = []
    for flags in (support.held[:3], support.held[3:]):
        # onto the space that is held: diagonal where global axes span it
        onto = turn @ np.diag(np.array(flags, dtype=float)) @ turn.T
        kept = np.diag(onto) > 0.5
        if not np.allclose(onto, np.diag(kept.astype(float)), atol=1e-6):
            raise InputError(
                f"the support of block {support.block!r} holds single directions, which then lie along no global axis: "
                "turn by quarters, or give the supports after the turn"
            )
        held += kept.tolist()
    if tuple(held) == support.held:
        return support
    return Support(support.block, dofs=tuple(d for d, h in zip(DEGREES_OF_FREEDOM, held, strict=True) if h))


def renumbered(assembly: Laid, order: Sequence[int]) -> Laid:
    """The assembly with its blocks in another order, see ``Assembly.renumbered``.

    Parameters
    ----------
    assembly : before
    order : every block number once; new block k is old block ``order[k]``
    """
    order = [count("order", k, 0) for k in read_list("order", order)]
    if sorted(order) != list(range(assembly.n_blocks)):
        raise InputError("order must hold every block number once")
    # new number of every old block
    new = np.empty(assembly.n_blocks, dtype=int)
    new[order] = np.arange(assembly.n_blocks)
    names = [b.name for b in assembly.blocks]
    supports = tuple(replace(s, block=names[assembly.block_index(s.block)]) for s in assembly.supports)
    interfaces = tuple(
        replace(i, block_a=int(new[i.block_a]), block_b=int(new[i.block_b])) for i in assembly.interfaces
    )
    return replace(
        assembly, blocks=tuple(assembly.blocks[k] for k in order), interfaces=interfaces, supports=supports,
        doubts=renumbered_doubts(assembly.doubts, new),
    )


def joined_to_first(assembly: Laid, group: Sequence[int], *, drop: bool = False) -> Laid:
    """The assembly with a group of held blocks made one, which moves as one support.

    The first of the group owns the joints and ties of all. Joints between two held blocks are left out: the ground
    bears both sides of them.

    Parameters
    ----------
    assembly : before
    group : numbers of held blocks
    drop : give the first block the solids of all and leave the others out; else these stay where they are, without
        joints, so that blocks keep their numbers
    """
    first = group[0]
    owner = np.arange(assembly.n_blocks)  # block that takes the place of each
    owner[list(group)] = first
    rest = np.setdiff1d(np.arange(assembly.n_blocks), group[1:])  # blocks that are left
    blocks = list(assembly.blocks)
    names = [blocks[k].name for k in owner]
    # numbers that blocks have once the others of the group are dropped
    new = np.searchsorted(rest, owner) if drop else owner
    interfaces = tuple(
        replace(i, block_a=int(new[i.block_a]), block_b=int(new[i.block_b]))
        for i in assembly.interfaces
        if not (assembly.fixed[i.block_a] and assembly.fixed[i.block_b])
    )
    ties = tuple(
        replace(t, block_a=names[assembly.block_index(t.block_a)],
                block_b=None if t.block_b is None else names[assembly.block_index(t.block_b)])
        for t in assembly.ties
    )
    joined = replace(assembly, interfaces=interfaces, ties=ties)
    if not drop:
        return joined
    blocks[first] = replace(blocks[first], parts=tuple(part for k in group for part in blocks[k].parts))
    supports = [(assembly.block_index(s.block), s) for s in assembly.supports]
    return replace(
        joined, blocks=tuple(blocks[k] for k in rest), doubts=(),
        supports=tuple(replace(s, block=names[k]) for k, s in supports if k == owner[k]),
    )
