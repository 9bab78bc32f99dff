"""The line of thrust of arches and columns: through the centres of pressure, from block to block."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from limitmason.arrays import Array, Flags
from limitmason.mechanics.joint_forces import JointForces
from limitmason.model.arrays import AssemblyArrays
from limitmason.model.assembly import Assembly

Pair = tuple[int, int]


class ThrustLine(NamedTuple):
    """Centres of pressure in the order of the blocks, one for every pair of blocks that press on each other."""

    centre: Array  # [m], (p, 3)
    force: Array  # size of the resultant there [N], (p,)
    interfaces: tuple[int, ...]  # numbers of all that it passes through, as many as p or more


def thrust_lines(model: Assembly, forces: JointForces) -> list[ThrustLine]:
    """Lines of thrust of arches and columns: centres of pressure in the order in which blocks follow each other.

    There is one for every group of free blocks that form a chain, each with at most two neighbours; several interfaces
    between the same two blocks count as one, their centres weighted by the normal forces.

    Parameters
    ----------
    model : what was solved
    forces : resultants of its interfaces

    Notes
    -----
    Between two joints the polyline is straight, the true line bends under the block's own weight.
    """
    x, fixed = model.arrays, model.fixed
    pairs: dict[Pair, list[int]] = {}  # interfaces between two blocks, the lower number first
    for k, (a, b) in enumerate(zip(x.block_a.tolist(), x.block_b.tolist(), strict=True)):
        if not (fixed[a] and fixed[b]):
            pairs.setdefault((min(a, b), max(a, b)), []).append(k)
    around: dict[int, list[Pair]] = {}  # pairs that every free block is in
    for pair in pairs:
        for block in pair:
            if not fixed[block]:
                around.setdefault(block, []).append(pair)
    between = np.array([p for p in pairs if not fixed[p[0]] and not fixed[p[1]]], dtype=np.intp).reshape(-1, 2).T
    graph = coo_array((np.ones(between.shape[1]), tuple(between)), shape=(len(fixed), len(fixed)))
    _, label = connected_components(graph, directed=False)
    groups: dict[int, set[int]] = {}
    for block in around:
        groups.setdefault(label[block], set()).add(block)
    # a block with more than two neighbours stands in no line
    chains = (group for group in groups.values() if all(len(around[b]) <= 2 for b in group))
    lines = (_line([pairs[p] for p in _in_order(group, around, fixed)], forces, x) for group in chains)
    return [line for line in lines if line is not None]


def _in_order(group: set[int], around: dict[int, list[Pair]], fixed: Flags) -> list[Pair]:
    """Pairs of blocks along a chain, from a support or a free end, or none for a closed ring.

    Parameters
    ----------
    group : blocks of the chain
    around : pairs that each block is in
    fixed : which blocks of all are fixed, shape (n_blocks,)
    """

    def held(pair: Pair) -> bool:
        """Whether one block of a pair is a support."""
        return bool(fixed[pair[0]] or fixed[pair[1]])

    def other(pair: Pair, block: int) -> int:
        """The block of a pair that is not this one."""
        return pair[0] + pair[1] - block

    ends = [b for b in sorted(group) if any(held(p) for p in around[b])]
    ends += [b for b in sorted(group) if len(around[b]) == 1]
    if not ends:
        return []
    # the walk begins at a joint with a support where there is one, and then stays at its free block
    block = ends[0]
    first = next((p for p in around[block] if held(p)), around[block][0])
    if not held(first):
        block = other(first, block)
    order = [first]
    while (pair := next((p for p in around[block] if p not in order), None)) is not None:
        order.append(pair)
        if held(pair):
            break
        block = other(pair, block)
    return order


def _line(joints: list[list[int]], forces: JointForces, x: AssemblyArrays) -> ThrustLine | None:
    """Line of thrust through groups of joints, or None with fewer than two groups that carry force.

    Parameters
    ----------
    joints : numbers of the interfaces of every pair of blocks, in the order of the line
    forces : resultants of all interfaces
    x : all interfaces
    """
    centres, sizes, used = [], [], []
    for interfaces in joints:
        rows = [k for k in interfaces if forces.carries[k]]
        if not rows:
            continue
        weight = np.maximum(np.einsum("ij,ij->i", forces.force[rows], x.normal[rows]), 0.0)
        weight = weight if weight.sum() > 0 else np.ones(len(rows))  # nothing presses: shear alone has no centre
        centres.append((weight[:, None] * forces.centre[rows]).sum(axis=0) / weight.sum())
        sizes.append(float(np.linalg.norm(forces.force[rows].sum(axis=0))))
        used += rows
    return ThrustLine(np.array(centres), np.array(sizes), tuple(used)) if len(centres) > 1 else None
