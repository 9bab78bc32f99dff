"""The static theorem written out in cvxpy: readable, and a door to other solvers."""

import time

import numpy as np

from limitmason.answers.results import Status
from limitmason.errors import InputError
from limitmason.limit.program.clarabel_solver import Solution
from limitmason.limit.program.cones import make_cones
from limitmason.limit.program.static_theorem import Problem


def solve_reference(problem: Problem, *, solver: str | None = None, verbose: bool = False) -> Solution:
    """Maximise lambda by cvxpy: the program of ``solve_static``, cone by cone.

    Parameters
    ----------
    solver : any solver installed for cvxpy ("CLARABEL", "HIGHS" for plane problems, "SCS", "MOSEK", ...)
    verbose : let the solver report to standard output

    Returns
    -------
    Solution, scaled; with NaN and zeros where the solver gives no forces.

    Raises
    ------
    InputError
        When cvxpy does not know the solver or it cannot solve this kind of program.
    """
    import cvxpy as cp
    from cvxpy.atoms.affine.vstack import vstack  # the types of cvxpy know it there only

    if len(problem.free):
        raise InputError("cvxpy takes one live load; use solver='clarabel'")
    cones = make_cones(problem)
    force = cp.Variable(problem.matrix.shape[1], name="f")
    multiplier = cp.Variable(name="lambda")
    equilibrium = problem.matrix @ force + problem.dead + multiplier * problem.live == 0
    slack = cones.matrix @ force + cones.constant
    law = [slack[: cones.n_linear] >= 0] if cones.n_linear else []
    start = cones.n_linear
    sizes = np.array(cones.cone_sizes, dtype=int)
    # cvxpy takes all cones of one size at once, one in a column, which is much faster than one by one
    for size in np.unique(sizes):
        # first row of every cone of this size
        first = start + np.concatenate([[0], np.cumsum(sizes)[:-1]])[sizes == size].astype(int)
        tail = vstack([slack[first + k] for k in range(1, size)])
        law.append(cp.SOC(slack[first], tail, axis=0))
    program = cp.Problem(cp.Maximize(multiplier), [equilibrium, *law])
    begin = time.perf_counter()
    try:
        program.solve(solver=solver, verbose=verbose)
    except cp.error.SolverError as error:
        raise InputError(f"cvxpy could not use solver {solver!r}: {error}") from None
    seconds = time.perf_counter() - begin
    status = {
        cp.OPTIMAL: Status.SOLVED,
        cp.OPTIMAL_INACCURATE: Status.ALMOST_SOLVED,
        cp.INFEASIBLE: Status.CANNOT_STAND,
        cp.UNBOUNDED: Status.UNBOUNDED,
    }.get(program.status, Status.NOT_CONVERGED)
    if force.value is None:
        empty = np.zeros(problem.matrix.shape[0])
        return Solution(
            status=status, multiplier=float("nan"), force=np.zeros(problem.matrix.shape[1]), velocity=empty,
            iterations=0, seconds=seconds,
        )
    velocity = np.asarray(equilibrium.dual_value, dtype=float)
    # the sign and the scale of duals differ between solvers: live power one fixes both
    rate = float(problem.live @ velocity)
    velocity = velocity / rate if rate != 0 else velocity
    iterations = int(program.solver_stats.num_iters or 0)
    return Solution(status, float(np.asarray(multiplier.value).item()), force.value, velocity, iterations, seconds)
