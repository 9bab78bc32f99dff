"""What a state leaves of equilibrium and of the joint law, block by block and joint by joint, each by its own measure.

A residual over the total load hides a small block beside a large one: a twenty-millionth of the load of a tower is a
quarter of the weight of a brick. So every block is measured by its own load and size, every joint by its own force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from limitmason.answers.results import Resultants
from limitmason.arrays import Array, Flags, Index
from limitmason.geometry.rotation import vector_product
from limitmason.mechanics.law import PointLaw
from limitmason.mechanics.stress_block import StressBlock
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

WEIGHTLESS = 1e-9
"""Own load over the largest force on a block up to which it counts as weightless, and its forces are the measure."""

ROUNDING = 1e-6
"""Least measure of a loaded block over the largest force on it: sums of such forces are not exact in floating point."""

IDLE = 1e-3
"""Least measure of a weightless block over the largest force on the weightless blocks that it is joined to."""


class PointState(NamedTuple):
    """Forces, rates and law at every contact point, relative forces and rates already formed."""

    normal_force: Array  # N [N], (m,)
    shear_force: Array  # T in global axes [N], (m, 3)
    opening: Array  # e_n [m/s], (m,)
    sliding: Array  # e_t in global axes [m/s], (m, 3)
    law: PointLaw  # capacities over tributary areas [N]


def live_size(assembly: Assembly, loads: Loads) -> float:
    """Sum over the blocks of the live force, or of the live couple over the block's size where that is more [N]."""
    free = ~assembly.fixed
    force = np.linalg.norm(loads.live[free, :3], axis=1)
    couple = np.linalg.norm(loads.live[free, 3:], axis=1) / np.cbrt(assembly.volumes[free])
    return float(np.maximum(force, couple).sum())


def total_load(assembly: Assembly, loads: Loads) -> float:
    """Sum of the dead forces on free blocks [N], or the size of the live load without them.

    The scale of residuals.
    """
    dead = float(np.linalg.norm(loads.dead[~assembly.fixed, :3], axis=1).sum())
    return dead if dead > 0 else live_size(assembly, loads) or 1.0


def part_labels(assembly: Assembly, free: Flags | None = None) -> Index:
    """Number of the independent part of every block, shape (n_blocks,), or -1 for wholly held blocks.

    Two free blocks belong to one part when a chain of joints between free blocks joins them: what is held passes
    nothing on.

    Parameters
    ----------
    free : blocks that count as free, shape (n_blocks,); those not wholly held by default
    """
    x = assembly.links
    free = ~assembly.fixed if free is None else free
    label = _chains(assembly, free[x.block_a] & free[x.block_b])
    out = np.full(assembly.n_blocks, -1)
    _, out[free] = np.unique(label[free], return_inverse=True)
    return out


def _chains(assembly: Assembly, counts: Flags) -> Index:
    """Number of the chain of blocks that each block is in, shape (n_blocks,).

    Parameters
    ----------
    counts : which joints and ties join their blocks, shape (links,)
    """
    x, n = assembly.links, assembly.n_blocks
    edges = (np.ones(counts.sum()), (x.block_a[counts], x.block_b[counts]))
    _, label = connected_components(coo_array(edges, shape=(n, n)), directed=False)
    return np.asarray(label)


def unbalance(assembly: Assembly, loads: Loads, resultants: Resultants, multiplier: float) -> Array:
    """Unbalanced force, and moment over the block's size, of every block [N], shape (n_blocks, 6).

    It is zero where the block is held.

    Parameters
    ----------
    loads : dead and live
    resultants : with the force at every contact point
    multiplier : of the live load [-]
    """
    x = assembly.links
    k = resultants.point_interface
    rest = np.array(loads.dead + multiplier * loads.live)
    # a joint's force acts on block b, its reverse on block a
    for block, sign in ((x.block_b[k], 1.0), (x.block_a[k], -1.0)):
        force = sign * resultants.point_force
        moment = vector_product(resultants.point_position - assembly.centroids[block], force)
        for c in range(3):
            rest[:, c] += np.bincount(block, force[:, c], assembly.n_blocks)
            rest[:, 3 + c] += np.bincount(block, moment[:, c], assembly.n_blocks)
    rest[assembly.held] = 0.0
    rest[:, 3:] /= np.cbrt(x.volume)[:, None]
    return rest


def own_measures(assembly: Assembly, own: Array, largest: Array) -> Array:
    """Force by which each block's residual is judged: its own load, or joint forces.

    Shape (n_blocks,). Of a weightless block it is the largest joint force on it, but not less than ``IDLE`` of the
    largest on the weightless blocks that a chain of such blocks joins to it: a block that does nothing carries only
    rounding.

    Parameters
    ----------
    own : load of every block, shape (n_blocks,); any unit
    largest : largest joint force on it, in the same unit, shape (n_blocks,)
    """
    x = assembly.links
    idle = own <= WEIGHTLESS * largest
    measure = np.where(idle, largest, np.maximum(own, ROUNDING * largest))
    if idle.any():
        # groups of weightless blocks that touch one another
        both = idle[x.block_a] & idle[x.block_b] & ~(assembly.fixed[x.block_a] | assembly.fixed[x.block_b])
        label, group = _chains(assembly, both), np.zeros(assembly.n_blocks)
        np.maximum.at(group, label, np.where(idle, largest, 0.0))
        measure = np.where(idle, np.maximum(largest, IDLE * group[label]), measure)
    return measure


def load_on_blocks(assembly: Assembly, loads: Loads, multiplier: float) -> Array:
    """Size of dead and live load on every block, forces and moments over its size [N], shape (n_blocks,).

    Parameters
    ----------
    loads : dead and live
    multiplier : of the live load [-]
    """
    size = np.cbrt(assembly.links.volume)
    own = np.zeros(assembly.n_blocks)
    for part, factor in ((loads.dead, 1.0), (loads.live, abs(multiplier))):
        own += factor * (np.linalg.norm(part[:, :3], axis=1) + np.linalg.norm(part[:, 3:], axis=1) / size)
    return own


def largest_on_blocks(assembly: Assembly, interface: Index, size: Array) -> Array:
    """Largest joint force on every block [N], shape (n_blocks,).

    Parameters
    ----------
    interface : number of the joint or tie of every contact force, shape (m,)
    size : of these forces [N], shape (m,)
    """
    x, largest = assembly.links, np.zeros(assembly.n_blocks)
    joint = np.bincount(interface, size, len(x.area))
    for block in (x.block_a, x.block_b):
        np.maximum.at(largest, block, joint)
    return largest


def block_measures(assembly: Assembly, loads: Loads, resultants: Resultants, multiplier: float) -> Array:
    """Force by which the residual of every block is judged [N], shape (n_blocks,).

    The dead and live load of the block, forces and moments over its size; see :func:`own_measures`. Of held blocks,
    which have no residual, it is infinite.

    Parameters
    ----------
    loads : dead and live
    resultants : with the force at every contact point
    multiplier : of the live load [-]
    """
    size = np.linalg.norm(resultants.point_force, axis=1)
    largest = largest_on_blocks(assembly, resultants.point_interface, size)
    measure = own_measures(assembly, load_on_blocks(assembly, loads, multiplier), largest)
    return np.where(assembly.fixed, np.inf, np.maximum(measure, 1e-300))


def joint_measures(assembly: Assembly, resultants: Resultants, blocks: Array) -> Array:
    """Force by which the joint law is judged, per interface [N]: its own force, or the lighter block's measure.

    The larger of both counts, shape (interfaces and ties,).

    Parameters
    ----------
    resultants : with the force at every contact point
    blocks : what :func:`block_measures` says of every block [N], shape (n_blocks,)
    """
    x = assembly.links
    force = np.linalg.norm(resultants.point_force, axis=1)
    joint = np.bincount(resultants.point_interface, force, len(x.area))
    lighter = np.minimum(blocks[x.block_a], blocks[x.block_b])  # infinite between held blocks, whose joint is no matter
    return np.maximum(joint, np.where(np.isfinite(lighter), lighter, 1e-300))


def yield_excess(state: PointState, sections: StressBlock | None) -> Array:
    """Excess of every contact force over the joint law [N], shape (m,), zero within it.

    Parameters
    ----------
    state : forces and law at every point
    sections : in-plane stress blocks, which stand for the crushing of the points at their ends; None where there are
        none
    """
    law = state.law if sections is None else state.law.without_crushing(sections.ends)
    excess = np.maximum(law.excess(state.normal_force, np.linalg.norm(state.shear_force, axis=1)), 0.0)
    if sections is not None:
        # what a section exceeds counts at either end
        over = sections.excess(state.normal_force[sections.ends])
        for end in sections.ends.T:
            excess[end] = np.maximum(excess[end], over)
    return excess
