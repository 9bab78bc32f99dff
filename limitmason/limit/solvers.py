"""Which solver takes a static theorem: Clarabel, or the own one on large ones.

The own solver is compiled by numba and therefore loaded only when it is used. Its first call in a process costs 0.3 s
(seconds where numba's cache on disk is still empty), so small problems go to Clarabel.
"""

import logging
from typing import TYPE_CHECKING

from limitmason.answers.results import Status
from limitmason.errors import InputError
from limitmason.limit.interior_point.coverage import unsupported
from limitmason.limit.program.clarabel_solver import Solution, solve_static
from limitmason.limit.program.cones import Cones
from limitmason.limit.program.static_theorem import Problem

SOLVERS = ("auto", "clarabel", "interior-point", "cvxpy")

TOLERANCE = 1e-10
"""Default tolerance of the interior-point methods [-]."""

LARGE_IN_SPACE = 5000
LARGE_IN_PLANE = 4000
"""Contact points from which "auto" takes the own solver: measured so that even the first call of a process gains."""

if TYPE_CHECKING:
    from limitmason.limit.interior_point.solver import Progress

_log = logging.getLogger(__name__)


def choose_solver(problem: Problem, solver: str = "auto") -> str:
    """Solver that "auto" stands for: the own on large ones it covers, or Clarabel.

    Raises
    ------
    InputError
        For an unknown name.
    """
    if solver not in SOLVERS and not str(solver).startswith("cvxpy:"):
        raise InputError(f"solver must be one of {SOLVERS} or 'cvxpy:NAME', got {solver!r}")
    if solver != "auto":
        return solver
    large = LARGE_IN_SPACE if problem.plane is None else LARGE_IN_PLANE
    return "interior-point" if problem.points.count >= large and unsupported(problem) is None else "clarabel"


def solve_program(
    problem: Problem,
    cones: Cones,
    *,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
    check_dead_load: bool = False,
    verbose: bool = False,
    judged: bool = False,
) -> Solution:
    """Solve the static theorem by the chosen solver.

    "auto" hands to Clarabel whatever the own one does not solve.

    Parameters
    ----------
    problem : the scaled static theorem
    cones : the joint law, see :func:`limitmason.limit.program.cones.make_cones`
    solver : "auto", "clarabel" or "interior-point"; "cvxpy" or "cvxpy:NAME" for any solver installed for cvxpy
    tolerance : of the solver, see there [-]; a solver by way of cvxpy stops at its own
    check_dead_load : let the own solver also find out whether the dead load alone can be carried
    verbose : report every iteration, Clarabel to standard output, the own solver to the log of this module
    judged : a certificate decides what is made of it: what the own solver almost solves is not handed on

    Returns
    -------
    Solution, scaled; its ``fallback`` names the solver that was tried besides, and the status that it gave.

    Raises
    ------
    InputError
        For an unknown name, and for a tolerance with cvxpy.
    NotApplicable
        For "interior-point" on a problem that it does not cover.
    """
    chosen = choose_solver(problem, solver)
    if chosen.startswith("cvxpy"):
        from limitmason.limit.program.reference import solve_reference

        if tolerance != TOLERANCE:
            raise InputError(f"tolerance={tolerance!r} is not passed on to solver={solver!r}; leave it out")
        name = chosen.partition(":")[2].upper() or None
        return solve_reference(problem, solver=name, verbose=verbose)._replace(solver=chosen)
    if chosen == "clarabel":
        return solve_static(problem, cones, tolerance=tolerance, verbose=verbose)
    from limitmason.limit.interior_point.solver import solve_interior_point

    callback = _log_progress if verbose else None
    own = solve_interior_point(problem, tolerance=tolerance, check_dead_load=check_dead_load, callback=callback)
    if own.status == Status.SOLVED or solver == "interior-point" or (judged and own.status == Status.ALMOST_SOLVED):
        return own
    other = solve_static(problem, cones, tolerance=tolerance, verbose=verbose)
    seconds = own.seconds + other.seconds
    # almost solved is more than not solved at all
    if other.status == Status.NOT_CONVERGED and own.status == Status.ALMOST_SOLVED:
        return own._replace(seconds=seconds, fallback=f"clarabel: {other.status}")
    return other._replace(seconds=seconds, stands=own.stands, fallback=f"interior-point: {own.status}")


def _log_progress(progress: "Progress") -> None:
    _log.info("%3d static %.10f kinematic %.10f residuals %.1e %.1e complementarity %.1e", *progress[:6])
