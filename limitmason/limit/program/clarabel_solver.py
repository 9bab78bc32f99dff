"""The cone program of the static theorem, handed to Clarabel as sparse matrices."""

import time
from typing import Any, NamedTuple

import clarabel
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from limitmason.answers.acceptance import OWN_RESIDUAL
from limitmason.answers.results import Status
from limitmason.arrays import Array
from limitmason.limit.program.cones import Cones
from limitmason.limit.program.idle_joints import ROUNDING, without_rounding
from limitmason.limit.program.scaling import block_norms, row_blocks, unit_loads
from limitmason.limit.program.static_theorem import Problem
from limitmason.mechanics.residuals import largest_on_blocks, own_measures


class Solution(NamedTuple):
    """Scaled multiplier, contact forces, velocities (live . v = 1), solver's account."""

    status: Status
    multiplier: float  # scaled [-]
    force: Array  # of every point, normal (compression > 0) and tangents, scaled [-], (c m,)
    velocity: Array  # duals of the equilibrium rows, (r,)
    iterations: int
    seconds: float  # in the solver [s]
    stands: bool | None = None  # True when the solver proved on its way that the dead load alone can be carried
    solver: str = "clarabel"
    fallback: str = ""  # which other solver was tried, and what it said
    free: Array = np.zeros(0)  # scaled multipliers u of the free live loads beside it [-], (k,)


# "almost" counts as proven here: callers test the forces and motions that come with it before they believe it
_STATUS = {  # by what Clarabel says
    "Solved": Status.SOLVED,
    "AlmostSolved": Status.ALMOST_SOLVED,
    "PrimalInfeasible": Status.CANNOT_STAND,
    "AlmostPrimalInfeasible": Status.CANNOT_STAND,
    "DualInfeasible": Status.UNBOUNDED,
    "AlmostDualInfeasible": Status.UNBOUNDED,
}


ROUNDING_STOPS = "NumericalError"
"""What Clarabel says where rounding stops it: now and then on a single block that crushes; another way leads past."""

SHORTER = 0.9
"""Part of the way to the border of the cones that it then goes in a step, for its own 0.99 [-]: chosen."""

BELOW_ZERO = -1e-9
"""Scaled multiplier below which a structure falls without live load [-]: above it is the solver's rounding of zero."""

STANDING_TOLERANCE = 1e-9
"""Of the programs that ask whether the dead load can be carried [-]: what they find is checked without them."""

LEVEL = 1e-9
"""Joints whose normal is vertical but for this are level [-]: chosen, well above rounding of a rotated geometry."""

SHARE = 1e-12
"""Diagonal added to equations of :func:`in_balance` over itself [-]: chosen, so that redundant rows have a factor."""

NOTHING = 1e-30
"""The same over the largest, for rows without any force [-]: chosen, so that their zero diagonal has a factor."""

CORRECTIONS = 3
"""Corrections of the forces in :func:`in_balance`, each with the unbalance that the one before left: chosen."""

OPENING_TOLERANCE = 1e-6
"""Of the motion that opens every joint [-]: it only helps another motion, whose bound is computed from what it is."""


def solver_settings(tolerance: float, *, max_iterations: int = 200, verbose: bool = False) -> clarabel.DefaultSettings:
    """Clarabel settings that reach a tolerance on walls of 50 to 10,000 blocks.

    Parameters
    ----------
    tolerance : of gap and feasibility [-]
    max_iterations : after which the solver gives up
    verbose : report every iteration to standard output
    """
    settings = clarabel.DefaultSettings()
    settings.verbose = verbose
    settings.max_iter = max_iterations
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    settings.direct_solve_method = "qdldl"
    return settings


def solve_static(
    problem: Problem, cones: Cones, *, tolerance: float = 1e-10, verbose: bool = False,
    direction: Array | None = None, within: Array | None = None,
) -> Solution:
    """Maximise lambda: matrix f + dead + lambda live + u free = 0, f within cones.

    The multipliers of the equilibrium rows are the velocities of the collapse mechanism.

    Parameters
    ----------
    problem : r equilibrium rows, n force components, k free live loads
    cones : the joint law
    tolerance : gap and feasibility tolerance of the interior-point method [-]; at 1e-8 lambda may be off by 4e-6
    verbose : report every iteration to standard output
    direction : maximise this . (lambda, u) instead, shape (1 + k,)
    within : largest size of the scaled lambda and u [-], shape (1 + k,); None leaves them without limit

    Returns
    -------
    Solution, scaled; with the free multipliers u.
    """
    r, n = problem.matrix.shape
    # the unknowns are (f, lambda, u); Clarabel minimises objective . x with bound - matrix x in its cones
    columns = sparse.csc_array(np.column_stack([problem.live, problem.free.T]))
    k = columns.shape[1]
    top = sparse.hstack([problem.matrix, columns])
    bottom = sparse.hstack([-cones.matrix, sparse.csc_array((cones.matrix.shape[0], k))])
    limits = sparse.csc_array((0, n + k)) if within is None else sparse.hstack(
        [sparse.csc_array((2 * k, n)), sparse.vstack([sparse.eye_array(k), -sparse.eye_array(k)])]
    )
    matrix = sparse.csc_matrix(sparse.vstack([top, limits, bottom]))
    bound = np.concatenate([-problem.dead, [] if within is None else np.tile(within, 2), cones.constant])
    objective = np.zeros(n + k)
    objective[n:] = -np.eye(k)[0] if direction is None else -direction
    settings = solver_settings(tolerance, verbose=verbose)
    start = time.perf_counter()
    quadratic = sparse.csc_matrix((n + k, n + k))
    kinds = _kinds(r, cones, limits.shape[0])
    answer = clarabel.DefaultSolver(quadratic, objective, matrix, bound, kinds, settings).solve()
    if str(answer.status) == ROUNDING_STOPS:
        settings.max_step_fraction = SHORTER
        answer = clarabel.DefaultSolver(quadratic, objective, matrix, bound, kinds, settings).solve()
    seconds = time.perf_counter() - start
    x, z = np.array(answer.x), np.array(answer.z)
    status = _STATUS.get(str(answer.status), Status.NOT_CONVERGED)
    return Solution(
        status=status, multiplier=float(x[n]), force=x[:n], velocity=z[:r], iterations=int(answer.iterations),
        seconds=seconds, free=x[n + 1 :],
    )


def _kinds(rows: int, cones: Cones, limits: int = 0) -> list[Any]:
    """Clarabel's cones: ``rows`` equations, ``limits`` on multipliers, joint law."""
    count = limits + cones.n_linear
    linear = [clarabel.NonnegativeConeT(count)] if count else []
    return [clarabel.ZeroConeT(rows), *linear, *(clarabel.SecondOrderConeT(size) for size in cones.cone_sizes)]


class Carried(NamedTuple):
    """Whether the dead load can be carried: the forces, or the velocities of a fall."""

    stands: bool | None  # None when the solver cannot tell
    force: Array | None  # scaled [-], (c m,); None unless it stands
    velocity: Array | None  # duals of the equilibrium rows, (r,); None unless it falls
    seconds: float  # in solvers [s]


def stands_under_dead_load(problem: Problem, cones: Cones) -> Carried:
    """Whether some admissible forces carry the dead load alone.

    The set of multipliers that can be carried is an interval: its upper end alone does not tell whether it holds zero.
    A frictionless trial with the normal forces of nearly horizontal joints (a small quadratic program) settles most
    walls; the full cone program decides the rest. Forces count that leave every block in equilibrium by its own load;
    where none do, the program's dual is a motion in which the dead load does more work than the joints can dissipate.
    ``cones`` are the joint law.
    """
    start = time.perf_counter()
    own = unit_loads(problem)  # load of every block, by which its unbalance is judged
    force = _pressure_alone(problem, own)
    if force is not None:
        return Carried(stands=True, force=force, velocity=None, seconds=time.perf_counter() - start)
    r, n = problem.matrix.shape
    # no objective: any admissible forces in equilibrium will do
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix((n, n)), np.zeros(n), sparse.csc_matrix(sparse.vstack([problem.matrix, -cones.matrix])),
        np.concatenate([-problem.dead, cones.constant]), _kinds(r, cones), solver_settings(STANDING_TOLERANCE),
    ).solve()
    status = str(answer.status)
    seconds = time.perf_counter() - start
    if status in ("Solved", "AlmostSolved"):
        force = _without_rounding(problem, np.array(answer.x), own)
        holds = _balances(problem, force, problem.dead, own)
        return Carried(True if holds else None, force if holds else None, velocity=None, seconds=seconds)
    if "PrimalInfeasible" not in status:
        return Carried(stands=None, force=None, velocity=None, seconds=seconds)
    # the solver's proof that the rows cannot be met: duals of the equilibrium rows, the motion of the fall
    return Carried(stands=False, force=None, velocity=np.array(answer.z[:r]), seconds=seconds)


def _pressure_alone(problem: Problem, own: Array) -> Array | None:
    """Normal forces of level joints that carry the dead load without shear, or None.

    They are scaled contact forces, shape (c m,), zero elsewhere, and have the least sum of squares. Joints that crush
    are left out: where nothing crushes, any compression without shear is within the joint law. ``own`` is the load of
    every block as in :func:`_balances`.
    """
    level = np.abs(problem.points.directions[:, 0, 2]) > 1 - LEVEL
    simple = level & ~problem.law.crushes
    simple[problem.stress_block.ends] = False
    columns = problem.components * np.flatnonzero(simple)
    k = len(columns)
    if not k:
        return None
    part = problem.matrix[:, columns].tocsr()
    # rows that neither these forces nor a load act on say nothing
    loaded = np.flatnonzero((np.diff(part.indptr) > 0) | (problem.dead != 0))
    # minimise |N|^2 / 2 subject to equilibrium and N >= 0
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.eye_array(k)), np.zeros(k),
        sparse.csc_matrix(sparse.vstack([part[loaded], -sparse.eye_array(k)])),
        np.concatenate([-problem.dead[loaded], np.zeros(k)]),
        [clarabel.ZeroConeT(len(loaded)), clarabel.NonnegativeConeT(k)],
        solver_settings(STANDING_TOLERANCE),
    ).solve()
    if str(answer.status) != "Solved":
        return None
    force = np.zeros(problem.matrix.shape[1])
    force[columns] = answer.x
    force = _without_rounding(problem, force, own)
    return force if _balances(problem, force, problem.dead, own) else None


def _without_rounding(problem: Problem, force: Array, own: Array) -> Array:
    """Scaled ``force`` (c m,) without rounding on blocks that bear none of a load.

    ``own`` is the load of every block as in :func:`_balances`.
    """
    scale = problem.point_scale[:, None]
    force = force.reshape(-1, problem.components) * scale
    return np.asarray(without_rounding(problem.assembly, own, problem.points.interface, force) / scale).ravel()


def _balances(problem: Problem, force: Array, load: Array, own: Array) -> bool:
    """Whether scaled ``force`` carries ``load`` on every block.

    Parameters
    ----------
    force : of every point, scaled [-], shape (c m,)
    load : on every equilibrium row, scaled [-], shape (r,)
    own : own load of every block over ``force_scale`` [-], shape (n,)
    """
    block = row_blocks(problem)
    size = np.linalg.norm(force.reshape(-1, problem.components), axis=1) * problem.point_scale
    largest = largest_on_blocks(problem.assembly, problem.points.interface, size)
    rest = np.abs(problem.matrix @ force + load) * problem.row_unit
    return bool((rest <= OWN_RESIDUAL * own_measures(problem.assembly, own, largest)[block]).all())


def in_balance(problem: Problem, force: Array, multiplier: float) -> Array:
    """Contact forces changed as little as brings every block into equilibrium.

    A solver leaves a block that is light beside what it passes on out of balance by rounding of the latter. The sum of
    squares of relative changes is the least. Forces that balance already come back as they are, and so do those that
    would have to change by more than ``OWN_RESIDUAL`` of themselves.

    Parameters
    ----------
    force : scaled [-], shape (c m,)
    multiplier : scaled multiplier [-]
    """
    load = problem.dead + multiplier * problem.live
    own = block_norms(problem, problem.dead) + abs(multiplier) * block_norms(problem, problem.live)
    if _balances(problem, force, load, own) or not force.any():
        return force
    # least sum of squares of the changes over the size of their force: equations B B^T y = unbalance, B = A diag(size)
    size = np.repeat(np.linalg.norm(force.reshape(-1, problem.components), axis=1), problem.components)
    by_share = sparse.csr_array(problem.matrix @ sparse.diags_array(size))
    normal = by_share @ by_share.T
    diagonal = normal.diagonal()
    factor = splu(sparse.csc_matrix(normal + sparse.diags_array(SHARE * diagonal + NOTHING * diagonal.max())))
    changed = force
    for _ in range(CORRECTIONS):
        changed = changed - size * (by_share.T @ factor.solve(problem.matrix @ changed + load))
    small = bool((np.abs(changed - force) <= OWN_RESIDUAL * size).all())
    return changed if small and _balances(problem, changed, load, own) else force


def carries_any(problem: Problem, solution: Solution) -> bool:
    """Whether forces of a solution grow with the live load without end: "unbounded".

    A f + live = 0 on every block, by its own live load, with friction and normal force alone: cohesion, ties and joints
    that crush have a largest force and no ray. Every block is judged by its own load, since cohesion that is rounding
    to the whole may bear all of a small block. Forces that a solver does not give prove nothing.

    Parameters
    ----------
    solution : "unbounded", scaled; its forces over its multiplier are the candidate for the ray
    """
    if not solution.multiplier > 0:  # there is no ray (NaN), or none along which the live load grows
        return False
    force = solution.force.reshape(-1, problem.components) / solution.multiplier
    normal = np.maximum(force[:, 0], 0.0)
    if problem.stress_block.count:
        normal[problem.stress_block.ends] = 0.0
    normal[problem.law.crushes] = 0.0
    shear = np.linalg.norm(force[:, 1:], axis=1)
    # shear shortened to the friction of N alone: along a ray cohesion and strengths count for nothing
    within = np.divide(problem.law.tan_phi * normal, shear, out=np.ones_like(shear), where=shear > 0.0)
    ray = np.column_stack([normal, force[:, 1:] * np.minimum(within, 1.0)[:, None]])
    live = problem.live + solution.free / solution.multiplier @ problem.free
    own = block_norms(problem, live)
    ray = _without_rounding(problem, ray.ravel(), own).reshape(ray.shape)
    # blocks without live load, far from those with it, are left with rounding: the ray needs none of their joints
    interface = problem.points.interface
    joint = np.bincount(interface, np.linalg.norm(ray, axis=1) * problem.point_scale)
    bare = np.where((joint <= ROUNDING * joint.max())[interface][:, None], 0.0, ray)
    return any(_balances(problem, forces.ravel(), live, own) for forces in (ray, bare))


def opening_motion(problem: Problem) -> tuple[Array | None, float]:
    """Velocities that open every joint beyond friction, or None of wedged blocks.

    Minimise |v|^2 subject to e_n - tan(phi) |e_t| >= 1 at every contact point, e = A^T v. Added in a small amount to a
    solver's mechanism it makes that strictly admissible. Depends on geometry and friction alone.

    Returns
    -------
    velocity, seconds : of the equilibrium rows, shape (r,); and the time of the solver [s]
    """
    start = time.perf_counter()
    r = problem.matrix.shape[0]
    c, m = problem.components, problem.points.count
    opening = problem.matrix[:, ::c].T
    mu = sparse.diags_array(problem.law.tan_phi)
    if c == 2:  # |e_t| in plane is two linear rows; in space the condition is a second-order cone
        sliding = mu @ problem.matrix[:, 1::c].T
        rows = sparse.vstack([-(opening - sliding), -(opening + sliding)])
        bound = np.full(2 * m, -1.0)
        kinds = [clarabel.NonnegativeConeT(2 * m)]
    else:
        scale = np.ones(3 * m)
        scale.reshape(m, 3)[:, 1:] = problem.law.tan_phi[:, None]
        rows = -(sparse.diags_array(scale) @ problem.matrix.T)
        bound = np.zeros(3 * m)
        bound[::3] = -1.0
        kinds = [clarabel.SecondOrderConeT(3)] * m
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.eye_array(r)), np.zeros(r), sparse.csc_matrix(rows), bound, kinds,
        solver_settings(OPENING_TOLERANCE),
    ).solve()
    seconds = time.perf_counter() - start
    return (np.array(answer.x) if str(answer.status) in ("Solved", "AlmostSolved") else None), seconds
