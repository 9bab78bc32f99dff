"""Interior-point method made for the static theorem: few unknowns a block.

Infeasible primal-dual predictor-corrector with separate primal and dual steps. Every iteration factorises the matrix
of the block velocities alone, so a wall of 10,000 blocks takes seconds and hardly more memory than its own data.

Sources: Mehrotra (1992), On the implementation of a primal-dual interior point method; Nesterov and Todd (1997, 1998),
Self-scaled barriers; Gondzio (1996), Multiple centrality corrections. Length of a step: ``newton``. Ordering and
factorisation: ``factor`` and :mod:`limitmason.multifrontal`.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from limitmason.answers.results import Status
from limitmason.arrays import Array
from limitmason.errors import NotApplicable
from limitmason.limit.interior_point.blas_threads import one_blas_thread
from limitmason.limit.interior_point.coverage import unsupported
from limitmason.limit.interior_point.factor import BlockCholesky
from limitmason.limit.interior_point.newton import (
    ConeProgram,
    Iterate,
    NewtonSystem,
    Residuals,
    residuals,
    step_lengths,
)
from limitmason.limit.program.clarabel_solver import BELOW_ZERO, Solution
from limitmason.limit.program.scaling import row_blocks
from limitmason.limit.program.static_theorem import Problem

CORRECTORS = 2
"""Centrality corrections tried in an iteration whose steps stay short."""

SHORT = 0.9
"""Step length below which a centrality correction is tried [-]: chosen; longer steps gain little from one."""

LONGER = 0.05
"""Sum of primal and dual step lengths that a centrality correction must add to be kept [-]: chosen."""

USELESS = 1e-6
"""Step length below which the iteration has come to its end [-]: chosen."""

FIRST_RAY = 3
"""Iteration from which rays are looked for: the first iterates are far from any and would only cost the products."""

DEAD_LOAD_ITERATIONS = 50
"""Iterations for the dead load alone at most: chosen, far more than the one or two that most structures take."""

CLEANINGS = 3
"""Newton steps at most that remove what is left of the residuals of the final iterate: chosen."""

FIRST_SHIFT = 1e-12
"""Diagonal added to the first least squares [-], whose matrix, of geometry alone, may be singular to rounding."""

RAY = 1e-8
"""Residual relative to its size at which a direction counts as a proof that there is no bound or no solution."""

REDUCED = 1e-6
"""Accuracy at which an iterate is worth keeping as "almost solved"."""

BALANCED = 1e-9
"""Unbalance over the total load that "solved" allows at most, whatever the tolerance [-]: certificates judge it."""

REACHABLE = 1e-12
"""Unbalance over the total load below which no tolerance asks for less [-]: rounding."""

SMALL, SMALL_REDUCED = 1e-3, 1e-6
"""Scaled multipliers below which a gap counts over these, for "solved" and "almost solved" [-]: chosen, a multiplier
may be zero."""

FIRST_FORCE, FIRST_RATE, FIRST_FLOOR = 2.0, 3.0, 0.3
"""Forces over those of least squares, rates over their mean, least force over the mean of the first iterate [-].
They keep both clear of zero and of one size, so that the first steps are long; any positive ones would do."""


class Progress(NamedTuple):
    """State of one iteration, in the scaled units of the problem.

    The multipliers bound each other once feasible.
    """

    iteration: int
    static: float  # multiplier of the forces [-]
    kinematic: float  # multiplier of the motion [-]
    primal_residual: float  # unbalance over the total load [-]
    dual_residual: float  # largest violation of the motion's equations, for live power one
    complementarity: float  # x . s + slack . z, the gap of a feasible pair
    shifts: int  # fronts of the factorisation that needed a shift


def solve_interior_point(
    problem: Problem,
    *,
    tolerance: float = 1e-9,
    max_iterations: int = 150,
    check_dead_load: bool = False,
    callback: Callable[[Progress], None] | None = None,
) -> Solution:
    """Maximise lambda, matrix f + dead + lambda live = 0 and the law, by the own way.

    Parameters
    ----------
    problem : Coulomb cones with cohesion, tension cut-off and crushing of grid points; see
        :func:`limitmason.limit.interior_point.coverage.unsupported` for what it does not cover
    tolerance : largest difference of the two bounds relative to lambda [-]; limit analysis asks for
        ``solvers.TOLERANCE``, ten times less
    max_iterations : iterations after which it stops
    check_dead_load : also find out whether the dead load alone can be carried
    callback : called with the progress of every iteration

    Returns
    -------
    Solution
        Scaled as that of :func:`limitmason.limit.program.clarabel_solver.solve_static`. The velocities obey the flow
        rule to rounding. ``stands`` is None where it was not asked for or not settled.

    Raises
    ------
    NotApplicable
        For a joint law that it does not cover.
    """
    reason = unsupported(problem)
    if reason is not None:
        raise NotApplicable(reason)
    start = time.perf_counter()
    program, shift = cone_program(problem)
    # numbers that overflow on the last, useless steps are caught where steps are measured
    with one_blas_thread(), np.errstate(all="ignore"):
        factor = BlockCholesky(
            program.matrix.tocsc(), program.components, row_blocks(problem), problem.assembly.centroids
        )
        first = _first_iterate(program, factor)
        status, it, iterations = _iterate(program, factor, first, tolerance, max_iterations, callback)
        stands = None
        if check_dead_load:
            # a structure that carries no multiplier of zero or more falls under its dead load alone
            falls = status == Status.SOLVED and it.multiplier < BELOW_ZERO
            stands = False if falls else _stands(program, factor, first)
    # back from x = (tan(phi) N + c A, T) of the cone program to (N, T)
    force = it.x.copy()
    force[:, 0] /= problem.law.tan_phi
    force[:, 0] -= shift
    seconds = time.perf_counter() - start
    return Solution(
        status=status, multiplier=float(it.multiplier), force=force.ravel(), velocity=-it.y, iterations=iterations,
        seconds=seconds, stands=stands, solver="interior-point",
    )


def cone_program(problem: Problem) -> tuple[ConeProgram, Array]:
    """Standard form with x = (tan(phi) N + c A, T), and the shift c A / tan(phi).

    In plane the two half-planes |T| <= tan(phi) N + c A are a cone in two dimensions: one method serves both. Cut-offs
    N >= -ft A that do not cut the cone's tip and infinite crushing forces are left out.

    Returns
    -------
    program, shift : scaled; the latter [-] of every point, shape (m,), so that N = x_0 / tan(phi) - shift
    """
    law = problem.law
    c, m, mu, shift = problem.components, problem.points.count, law.tan_phi, law.apex
    scale = np.ones((m, c))
    scale[:, 0] = 1.0 / mu
    # columns of normal forces are divided by tan(phi), their shift goes to the right-hand side
    matrix = sparse.csr_array(problem.matrix @ sparse.diags_array(scale.ravel()))
    moved = np.zeros((m, c))
    moved[:, 0] = shift
    low = np.flatnonzero(law.cut_off)
    high = np.flatnonzero(law.crushes)
    program = ConeProgram(
        matrix=matrix, transpose=sparse.csr_array(matrix.T), right=problem.matrix @ moved.ravel() - problem.dead,
        live=problem.live, components=c, bound_point=np.concatenate([low, high]),
        bound_sign=np.repeat([1.0, -1.0], [len(low), len(high)]),
        bound_level=np.concatenate([(mu * (shift - law.tension))[low], -(mu * (law.crushing + shift))[high]]),
        size=problem.size,
    )
    return program, shift


def _first_iterate(program: ConeProgram, factor: BlockCholesky) -> Iterate:
    """Forces and velocities of least squares, each pushed to the axis of its cone.

    On the axis a point is as far from the boundary of its cone as its size allows. ``factor`` is factorised anew.
    """
    c = program.components
    m = program.matrix.shape[1] // c
    # M = G G^T: least squares of the forces alone, and the motion of live power -1 that moves the joints least
    factor.factorise(np.broadcast_to(np.eye(c), (m, c, c)).copy(), shift=FIRST_SHIFT)
    for_live, for_right = factor.solve(np.array([program.live, program.right]))
    y = -for_live / float(program.live @ for_live)
    force = np.linalg.norm((program.transpose @ for_right).reshape(m, c), axis=1)
    rate = np.linalg.norm((program.transpose @ y).reshape(m, c), axis=1)
    mean = float(force.mean()) or 1.0
    x, s = np.zeros((m, c)), np.zeros((m, c))
    # well inside: no cone begins near its edge, and all products are about alike
    x[:, 0] = FIRST_FORCE * np.maximum(force, FIRST_FLOOR * mean)
    s[:, 0] = FIRST_RATE * float(rate.mean())
    slack = np.maximum(program.bounded(x) - program.bound_level, np.abs(x).mean())
    z = s[:, 0].mean() * x[:, 0].mean() / slack  # slack z of every bound is about x . s of a point
    return Iterate(x, 0.0, slack, y, s, z)


class _Measures(NamedTuple):
    """How far an iterate is from a solution."""

    primal: float  # unbalance and violation of bounds over the total load [-]
    dual: float  # largest violation of the motion's equations, for live power one
    complementarity: float  # x . s + slack . z, the gap of a feasible pair
    kinematic: float  # multiplier of the motion [-]

    def within(self, multiplier: float, tolerance: float) -> bool:
        """Whether both bounds are feasible and close, for a scaled multiplier [-]."""
        gap = self.complementarity / max(abs(multiplier), SMALL)
        balanced = self.primal < max(min(tolerance, BALANCED), REACHABLE)
        return balanced and self.dual < tolerance and gap < tolerance

    def nearly(self, multiplier: float) -> bool:
        """The same to ``REDUCED``; a tenth for the unbalance, which nothing repairs later."""
        gap = max(self.complementarity, abs(self.kinematic - multiplier)) / max(abs(multiplier), SMALL_REDUCED)
        return self.primal < 0.1 * REDUCED and self.dual < REDUCED and gap < REDUCED


def _measures(program: ConeProgram, it: Iterate, rest: Residuals) -> _Measures:
    """Largest relative residuals, complementarity, kinematic multiplier of ``it``.

    ``rest`` are its residuals.
    """
    primal = max(np.abs(rest.equilibrium).max(), np.abs(rest.bounds).max(initial=0.0)) / program.size
    dual = max(np.abs(rest.rates).max(), abs(rest.live_rate))
    kinematic = -float(program.right @ it.y + program.bound_level @ it.z)
    return _Measures(float(primal), float(dual), it.complementarity, kinematic)


def _iterate(
    program: ConeProgram, factor: BlockCholesky, it: Iterate, tolerance: float, max_iterations: int,
    callback: Callable[[Progress], None] | None,
) -> tuple[Status, Iterate, int]:
    """Iterate until the program is solved, proven unsolvable, or stops improving.

    Of several iterates that nearly solve the program the one of least merit is kept: residuals of equilibrium count 100
    times the complementarity (chosen), as they cannot be repaired later.

    Parameters
    ----------
    factor : symbolic factorisation of the program's matrix
    it : first iterate, within all cones
    tolerance : largest difference of the two bounds relative to lambda [-]
    max_iterations : after which it stops
    callback : told every iteration

    Returns
    -------
    Status, last or best iterate, and number of iterations.
    """
    newton = NewtonSystem(program, factor)
    best, best_merit = None, np.inf
    status = Status.NOT_CONVERGED
    for iteration in range(max_iterations + 1):
        rest = residuals(program, it)
        measures = _measures(program, it, rest)
        if callback is not None:
            callback(Progress(iteration, it.multiplier, measures.kinematic, *measures[:3], factor.shifts))
        if measures.within(it.multiplier, tolerance):
            status = Status.SOLVED
            break
        if iteration >= FIRST_RAY and (proof := _no_solution(program, it)) is not None:
            return proof, it, iteration
        merit = max(100.0 * measures.primal, measures.complementarity)
        if measures.nearly(it.multiplier) and merit < best_merit:
            best, best_merit = it, merit
        if iteration == max_iterations or not newton.scale(it):
            break
        step = _predict_and_correct(newton, rest)
        if step is None:
            break
        it = it.moved(*step)
    if status != Status.SOLVED and best is not None:
        it, status = best, Status.ALMOST_SOLVED
    if status in (Status.SOLVED, Status.ALMOST_SOLVED) and newton.scale(it):
        it = _cleaned(program, newton, it)
        final = _measures(program, it, residuals(program, it))
        # the iteration may have stopped early because of residuals that are gone now
        if final.within(it.multiplier, tolerance):
            status = Status.SOLVED
    return status, it, iteration


def _stands(program: ConeProgram, factor: BlockCholesky, first: Iterate) -> bool | None:
    """Whether the dead load alone can be carried, None where that is not settled.

    It is the same method without a live load, stopped at the first proof. With nothing to maximise the iterates head
    for the middle of the admissible forces, where one or two suffice.

    Parameters
    ----------
    program, factor : whose live load is left out, and the symbolic factorisation of its matrix
    first : iterate of :func:`_first_iterate`
    """
    program = program._replace(live=np.zeros_like(program.live))
    s = np.zeros_like(first.s)
    # rates that make x o s the same at every point: the start is centred
    s[:, 0] = first.x[:, 0].mean() ** 2 / first.x[:, 0]
    it = first._replace(y=np.zeros_like(first.y), s=s)
    newton = NewtonSystem(program, factor)
    for iteration in range(DEAD_LOAD_ITERATIONS):
        if not newton.scale(it):
            return None
        if newton.carries_dead_load():
            return True
        if iteration >= FIRST_RAY and _no_solution(program, it) == Status.CANNOT_STAND:
            return False
        # live . y = -1 cannot hold without live load and is not asked for
        step = _predict_and_correct(newton, residuals(program, it)._replace(live_rate=0.0))
        if step is None:
            return None
        it = it.moved(*step)
    return None


def _predict_and_correct(newton: NewtonSystem, rest: Residuals) -> tuple[Iterate, float, float] | None:
    """Direction and step lengths of an iteration, or None without a step of use.

    Parameters
    ----------
    newton : system scaled and factorised at its iterate
    rest : residuals at that iterate

    Returns
    -------
    direction, primal, dual : the latter lengths of the steps of forces and of velocities, at most one [-]
    """
    it = newton.it
    gap = it.complementarity
    predictor = newton.direction(rest, *newton.products(0.0))
    primal, dual = step_lengths(it, predictor)
    # how far the plain Newton step comes tells how much centring is worth
    reached = max(0.0, it.moved(predictor, primal, dual).complementarity / gap)
    # Mehrotra's rule: the better the plain step, the less centring
    target = min(1.0, reached) ** 3 * gap / newton.program.degree
    wanted = newton.products(target, predictor)
    d = newton.direction(rest, *wanted)
    primal, dual = step_lengths(it, d)
    for _ in range(CORRECTORS):
        # Gondzio's correctors pay only where steps stay short, and while they lengthen them
        if min(primal, dual) > SHORT:
            break
        # corrected at a point a little farther than the steps reach: 1.1 times and 0.1, chosen
        trial = min(1.0, 1.1 * primal + 0.1), min(1.0, 1.1 * dual + 0.1)
        centred = newton.centred_products(wanted, d, *trial, target)
        other = newton.direction(rest, *centred)
        longer = step_lengths(it, other)
        if sum(longer) < primal + dual + LONGER:
            break
        d, wanted, (primal, dual) = other, centred, longer
    # numbers overflow where the iterates lie too close to the boundary of their cones
    if not np.isfinite(primal + dual + d.multiplier) or max(primal, dual) < USELESS:
        return None
    return d, primal, dual


def _no_solution(program: ConeProgram, it: Iterate) -> Status | None:
    """Status that a ray of the iterate proves: unbounded, cannot stand, or None.

    The first is a ray of forces, the second one of velocities (Farkas). A ray counts as a proof where its residual is
    below ``RAY`` times its size. The iterate itself is the candidate: where there is a ray, iterates grow along it
    until the loads are nothing beside them.
    """
    # forces that carry live load alone, within bounds whose levels are nothing beside them
    if it.multiplier > 0:
        rest = np.abs(program.matrix @ it.x.ravel() + it.multiplier * program.live).max()
        held = program.bounded(it.x).min(initial=0.0) > -RAY * it.multiplier
        if held and rest < RAY * it.multiplier * np.abs(program.live).max():
            return Status.UNBOUNDED
    # a motion without live power in which the dead load does more work than the joints can dissipate
    work = float(program.right @ it.y + program.bound_level @ it.z)
    if work > 0:
        rates = (program.transpose @ it.y).reshape(it.x.shape) + it.s
        rates[:, 0] += program.push(it.z)
        if max(np.abs(rates).max(), abs(float(program.live @ it.y))) < RAY * work:
            return Status.CANNOT_STAND
    return None


def _cleaned(program: ConeProgram, newton: NewtonSystem, it: Iterate) -> Iterate:
    """Iterate with what is left of residuals removed by full Newton steps.

    Forces, or velocities, are moved only where the full step stays within their cones. ``newton`` is scaled and
    factorised at ``it``.
    """
    none = np.zeros_like(it.x), np.zeros_like(it.slack)
    for _ in range(CLEANINGS):
        d = newton.direction(residuals(program, it), *none)
        primal, dual = step_lengths(it, d)
        it = it.moved(d, float(primal == 1.0), float(dual == 1.0))
    return it
