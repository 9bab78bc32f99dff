"""Scaling where blocks differ much in load: equations relative to own loads.

A solver stops where residuals are small beside the largest numbers of a program. In units of the total load the
equations of a small stack beside a very large block are then never solved at all. Here every row is divided by the load
of its block and every contact force by that of the lighter of its two blocks.
"""

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Index
from limitmason.limit.program.static_theorem import Problem

NO_LOAD = 1e-30
"""Load of a block over the largest up to which it is none [-]: chosen, so that rows divided by it stay finite."""


def row_blocks(problem: Problem) -> Index:
    """Block of every row, shape (r,)."""
    # rows are numbered by degrees of freedom, 3 per block in plane and 6 in space
    return problem.row // (3 if problem.plane is not None else 6)


def block_norms(problem: Problem, load: Array) -> Array:
    """Size of a load on blocks over ``force_scale`` [-], with moments, (n_blocks,).

    ``load`` is scaled, of every row, shape (r,).
    """
    return np.sqrt(np.bincount(row_blocks(problem), (load * problem.row_unit) ** 2, problem.assembly.n_blocks))


def unit_loads(problem: Problem) -> Array:
    """Dead and live load of blocks over ``force_scale`` [-], (n_blocks,), 0 if held."""
    return block_norms(problem, problem.dead) + block_norms(problem, problem.live)


def own_loads(problem: Problem) -> Array:
    """Load of every block over ``force_scale`` [-], shape (n_blocks,), to scale it by.

    It is the dead load, or the live one where no block has dead load. Held blocks have zero. A free block without load
    takes the largest of its neighbours', passed on from block to block.
    """
    block = row_blocks(problem)
    load = block_norms(problem, problem.dead if problem.dead.any() else problem.live)
    free = np.zeros(len(load), dtype=bool)
    free[block] = True
    a, b = problem.points.block_a, problem.points.block_b
    unloaded = free & (load <= NO_LOAD * load.max(initial=0.0))
    load[unloaded] = 0.0
    while unloaded.any():
        # one block farther in every round
        passed = load.copy()
        np.maximum.at(passed, a, np.where(unloaded[a], load[b], 0.0))
        np.maximum.at(passed, b, np.where(unloaded[b], load[a], 0.0))
        reached = unloaded & (passed > 0)
        if not reached.any():
            # no chain of joints leads from a loaded block to these: any load serves, as nothing acts on them
            load[unloaded] = load.max(initial=1.0)
            break
        load[reached] = passed[reached]
        unloaded &= ~reached
    return np.where(free, load, 0.0)


def spread(problem: Problem) -> float:
    """Largest over smallest load of a block [-]."""
    load = own_loads(problem)[np.unique(row_blocks(problem))]
    return float(load.max() / load.min())


def balanced(problem: Problem) -> Problem:
    """This problem with every row relative to the load of its block.

    The live load is scaled so that on no block it exceeds the block's own: a load on a small block alone, in units of
    the whole, would have a multiplier too small for a solver to see.
    """
    load = own_loads(problem)
    points = problem.points
    # forces of a point are in units of the load of the lighter of its two blocks
    free_load = np.where(load > 0, load, np.inf)  # a held block is never the lighter one
    lighter = np.minimum(free_load[points.block_a], free_load[points.block_b])
    row = load[row_blocks(problem)]
    columns = np.repeat(lighter, problem.components)
    matrix = sparse.diags_array(1.0 / row) @ problem.matrix.tocsr() @ sparse.diags_array(columns)
    # largest live load of a block over its own load; one without any live load, where there is nothing to scale
    most = float((block_norms(problem, problem.live) / free_load).max(initial=0.0)) or 1.0
    return problem._replace(
        matrix=sparse.csc_array(matrix), dead=problem.dead / row, live=problem.live / row / most,
        free=problem.free / row / most,
        live_scale=problem.live_scale / most, row_radius=problem.row_radius * row, row_unit=problem.row_unit * row,
        point_scale=problem.point_scale * lighter, size=1.0, law=problem.law.in_units_of(lighter),
        stress_block=problem.stress_block.in_units_of(lighter[problem.stress_block.ends[:, 0]]),
    )
