"""Associative limit analysis: the static theorem, and its mechanism from the dual.

What is answered where the load can grow without end: ``associative_prediction``.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.results import Prediction, Resultants, Status
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.limit.associative_prediction import UNDECIDED, prediction_from
from limitmason.limit.interior_point.coverage import unsupported
from limitmason.limit.program.clarabel_solver import BELOW_ZERO, Solution, carries_any, stands_under_dead_load
from limitmason.limit.program.cones import Cones, make_cones
from limitmason.limit.program.face_cells import Cells, refined
from limitmason.limit.program.scaling import balanced, spread
from limitmason.limit.program.static_theorem import Problem, make_problem
from limitmason.limit.solvers import TOLERANCE, choose_solver, solve_program
from limitmason.limit.torsion import with_torsion_limit

WIDE_LOADS = 1e5
"""Largest over smallest load of a block from which the program is first solved with every block in its own units."""

SEEN_LOADS = 1e3
"""The same up to which the own solver's word counts that the dead load can be carried, to 1e-10 of the total load."""

WELL_SOLVED = 1e-7
"""Residuals and gap up to which an answer for loads further apart than SEEN_LOADS is taken without a second opinion."""

FREE = "free multipliers"
"""Key of ``Prediction.details``: multipliers of the live loads that were free, see ``make_problem``."""

CELL_TARGET = 3e-3
"""Part of the gap that cells of cohesive faces may leave before they are made finer."""

BETWEEN_BOUNDS = 0.6
"""Part of the target that finer cells aim at between two bounds: chosen, as a finer mechanism fits its cells less."""

ONE_BOUND = 0.1
"""The same for a fall, where the motion alone decides: chosen."""

UNEQUAL = 2.0
"""Largest over smallest load of a block from which a second scaling is another program worth a try: chosen."""

REFINEMENTS = 6
"""Times that cells are made finer at most."""


def solve_associative(problem: Problem, **settings: Any) -> Prediction:
    """Largest multiplier of admissible joint forces; arguments as of :func:`analyse`."""
    return analyse(problem, **settings)[0]


def analyse(
    problem: Problem,
    *,
    torsion_limit: bool | float = False,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
    check_dead_load: bool = True,
    verbose: bool = False,
) -> tuple[Prediction, Problem]:
    """Largest multiplier of admissible joint forces, with normality to the motion.

    Maximise lambda subject to A f + w_dead + lambda w_live = 0 and the joint law; the dual is the mechanism.

    Parameters
    ----------
    problem : from :func:`limitmason.limit.program.static_theorem.make_problem`
    torsion_limit : limit each face's torsion about its centre of pressure to that of uniform pressure over this number
        (an estimate); in plane no face twists, and it changes nothing
    solver : "auto", "clarabel" or "interior-point", see :mod:`limitmason.limit.solvers`
    tolerance : of the interior-point method [-]
    check_dead_load : also find out whether the structure stands without live load
    verbose : report every iteration, see :func:`limitmason.limit.solvers.solve_program`

    Returns
    -------
    prediction, problem : the latter with the cells of cohesive faces as fine as the answer needed them

    Raises
    ------
    InputError, NotApplicable
        When the chosen solver does not cover the problem.
    """
    start = time.perf_counter()
    if torsion_limit and solver not in ("auto", "clarabel"):
        raise InputError(f"solver={solver!r} does not cover the torsion limit; use solver='clarabel'")
    settings: dict[str, Any] = {"tolerance": tolerance, "check_dead_load": check_dead_load, "verbose": verbose}
    # no face of a plane structure twists: the answer is as exact as without the limit
    torsion = float(torsion_limit) if problem.plane is None else 0.0
    seconds = 0.0
    for refinement in range(REFINEMENTS + 1):
        # torsion of a cohesive face needs its final cells
        prediction, spent = _first_certified(problem, solver, torsion=0.0 if problem.cells else torsion, **settings)
        seconds += spent
        cells = _finer(problem, prediction) if problem.cells and refinement < REFINEMENTS else None
        if cells is None:
            break
        problem = make_problem(problem.assembly, problem.loads, in_plane=False, cells=cells, cases=problem.cases)
    if torsion and problem.cells:
        prediction, spent = _first_certified(problem, "clarabel", torsion=torsion, **settings)
        seconds += spent
    provenance = dict(prediction.provenance, solver_seconds=seconds, seconds=time.perf_counter() - start)
    return replace(prediction, provenance=provenance), problem


def _first_certified(
    problem: Problem, solver: str, *, torsion: float, tolerance: float, check_dead_load: bool, verbose: bool
) -> tuple[Prediction, float]:
    """The first answer that its certificate accepts, or the best; seconds in solvers.

    Parameters
    ----------
    problem, solver, verbose : as for :func:`analyse`
    torsion : torsional strength at uniform pressure over the limit put on torsion [-], 0 for no limit
    tolerance : of the solver [-]
    check_dead_load : whether it is also asked if the structure stands without live load
    """
    best: Prediction | None = None
    # ``unknown``: it was asked, but not found out, whether the best answer's structure stands without live load
    spent, tried, unknown = 0.0, [], False
    for scaled, name in _attempts(problem, "clarabel" if torsion else solver):
        attempt = _attempted(
            problem, scaled, name, torsion=torsion, tolerance=tolerance, check_dead_load=check_dead_load,
            verbose=verbose,
        )
        spent += attempt.seconds
        tried.append(attempt.outcome)
        if best is None or _rank(attempt.prediction) < _rank(best):
            best, unknown = attempt.prediction, check_dead_load and attempt.stands is None
        if torsion or _sure(best, problem):  # an estimate of torsion has no proof that another attempt could give
            break
    assert best is not None, "there is at least one attempt"
    best = _as_far_as_proven(best, problem, unknown=unknown)
    if len(tried) > 1:
        best = replace(best, provenance=dict(best.provenance, attempts=tuple(tried)))
    return best, spent


class _Attempt(NamedTuple):
    """What one solver made of the problem in one scaling."""

    prediction: Prediction  # with its certificate
    outcome: str  # the solver that gave it, and its status
    stands: bool | None  # whether the structure stands without live load, None where that is unknown
    seconds: float  # spent in solvers [s]


def _attempted(
    problem: Problem, scaled: Problem, solver: str, *, torsion: float, tolerance: float, check_dead_load: bool,
    verbose: bool,
) -> _Attempt:
    """Solve once, by one solver in one scaling, and certify the answer.

    The program with live load comes first, then the limit of torsion if asked for, last the check of the dead load
    alone: each may take back what the one before it says.

    Parameters
    ----------
    problem : in its own units
    scaled : the problem in the units that the solver gets
    solver, verbose : as for :func:`analyse`
    torsion : torsional strength at uniform pressure over the limit put on torsion [-], 0 for no limit
    tolerance : of the solver [-]
    check_dead_load : whether it is also asked if the structure stands without live load
    """
    cones = make_cones(scaled)
    solution = solve_program(
        scaled, cones, solver=solver, tolerance=tolerance, check_dead_load=check_dead_load, verbose=verbose,
        judged=True,  # the certificate below decides what an answer that is almost solved is worth
    )
    spent = solution.seconds
    # "unbounded" needs a ray of forces that carry the live load alone
    if solution.status == Status.UNBOUNDED and not carries_any(scaled, solution):
        solution = solution._replace(status=Status.NOT_CONVERGED)
    details: dict[str, Any] = {FREE: scaled.live_scale * solution.free} if len(scaled.free) else {}
    if torsion and solution.status in (Status.SOLVED, Status.ALMOST_SOLVED):
        solution, seconds, details = with_torsion_limit(scaled, solution, tolerance, torsion, verbose=verbose)
        spent += seconds
    # without an answer the free multipliers mean nothing: the dead load is then asked about as it is
    unknown = solution.status == Status.CANNOT_STAND
    free = np.zeros(len(scaled.free)) if unknown else solution.free
    # both scalings ask about one dead load: free multipliers are in the live units of each
    given = problem.with_free(free * (scaled.live_scale / problem.live_scale))
    scaled = given if scaled is problem else scaled.with_free(free)
    solution, stands, falling, seconds = _dead_load_checked(given, scaled, cones, solution, check_dead_load)
    spent += seconds
    if unknown and falling is not None and len(solution.velocity) and not check_dead_load:
        # what was asked is whether any multiplier carries it: the program's own motion, on which no live load works
        own, seconds = prediction_from(scaled, solution, bool(torsion), details, tolerance, stands, solution.velocity)
        if _falls(own):
            return _Attempt(own, f"{solution.solver}: {own.status}", stands, spent + seconds)
    prediction, seconds = prediction_from(scaled, solution, bool(torsion), details, tolerance, stands, falling)
    return _Attempt(prediction, f"{solution.solver}: {prediction.status}", stands, spent + seconds)


def _as_far_as_proven(best: Prediction, problem: Problem, *, unknown: bool) -> Prediction:
    """The best answer, with the status that it has a proof for.

    Parameters
    ----------
    best : of all attempts
    problem : that was solved
    unknown : whether it was asked in vain if the structure stands without live load
    """
    # cells are a lower bound: that none of their forces carry the dead load proves no fall, and may be all there is
    if best.status == Status.CANNOT_STAND and not _falls(best) and not problem.cells:
        reason = f"no forces that carry the dead load were found, nor a motion that proves it cannot be; {UNDECIDED}"
        return replace(best, status=Status.NOT_CONVERGED, mechanism=None, warnings=(reason,))
    if unknown and best.status == Status.UNBOUNDED:
        # "unbounded" holds only of a structure that stands without live load, which is not known here
        return replace(best, status=Status.NOT_CONVERGED, collapse_multiplier=float("nan"))
    if unknown and best.status == Status.SOLVED:
        reason = "reduced accuracy: whether it stands without live load was not found out"
        return replace(best, status=Status.ALMOST_SOLVED, warnings=(*best.warnings, reason))
    return best


def _attempts(problem: Problem, solver: str) -> Iterator[tuple[Problem, str]]:
    """Scalings and solvers in the order of trial until an answer is accepted.

    ``solver`` is the one asked for. Yields the problem in some scaling, and the solver for it.
    """
    wide = spread(problem)
    # loads of blocks far apart: each block in its own units first; somewhat apart: only if the common unit fails
    scaled = balanced(problem) if wide > WIDE_LOADS else None
    if scaled is not None:
        yield scaled, solver
    yield problem, solver
    if scaled is None and wide > UNEQUAL:
        scaled = balanced(problem)
        yield scaled, solver
    if solver != "auto":
        return
    # then each solver by name: "auto" may have stopped at the first one's answer, or handed on to the other
    if choose_solver(problem, solver) == "interior-point":
        yield problem, "clarabel"
    if unsupported(problem) is None:
        # thin blocks among thick ones may suit one scaling only
        yield problem, "interior-point"
        if scaled is not None:
            yield scaled, "interior-point"


def _falls(prediction: Prediction) -> bool:
    """Whether a mechanism proves that the dead load alone sets the structure going."""
    return bool(prediction.details.get("falling_margin", 0.0) > 0.0)


def _rank(prediction: Prediction) -> tuple[int, float]:
    """Sort key of an answer, best first: (rank, worst figure of the certificate [-]).

    Rank 0: accepted or proven. 1: solved, not accepted. 2: said to fall without proof. 3: nothing known.
    """
    c = prediction.certificate
    if prediction.status in (Status.SOLVED, Status.ALMOST_SOLVED) and c is not None:
        # the part of the gap that the cells leave is no fault of the solver: finer cells take it away
        numerical = replace(c, gap=c.gap - c.discretisation, discretisation=0.0)
        worst = float(np.nanmax([c.block_residual, c.joint_excess, abs(numerical.gap)]))
        return (0 if prediction.status == Status.SOLVED or numerical.accepted else 1), worst
    if prediction.status == Status.CANNOT_STAND:
        return (0 if _falls(prediction) else 2), 0.0
    return (0 if prediction.status == Status.UNBOUNDED else 3), 0.0


def _sure(best: Prediction, problem: Problem) -> bool:
    """Whether no other solver or scaling need be tried after the ``best`` answer.

    It must be accepted or proven. Where blocks differ much in load its residuals and gap must also be ``WELL_SOLVED``:
    an accepted residual of a small block may change the multiplier of the whole by more than itself.
    """
    rank, worst = _rank(best)
    return rank == 0 and (worst <= WELL_SOLVED or spread(problem) <= SEEN_LOADS)


def _dead_load_checked(
    problem: Problem, scaled: Problem, cones: Cones, solution: Solution, check: bool
) -> tuple[Solution, bool | None, Array | None, float]:
    """Solution whose status takes account of whether the dead load alone is carried.

    Whatever the program with live load says, a structure that falls without it has no multiplier: also where live load
    would hold it up for ever ("unbounded"), and where the solver stopped short.

    Parameters
    ----------
    problem : in its own units, with its free live loads taken to the dead load
    scaled : the same in the units of ``cones`` and ``solution``, which may be its own
    cones : the joint law in these units
    solution : of the program with live load
    check : False checks only a solution that says "cannot stand"

    Returns
    -------
    solution : with the status "cannot stand" where the structure falls
    stands : whether the dead load alone is carried, None where that is not known
    velocity : duals of the rows of ``scaled`` by which it falls, shape (r,); None unless it falls
    seconds : spent in solvers here [s]
    """
    if not check and solution.status != Status.CANNOT_STAND:
        return solution, None, None, 0.0
    # the own solver's word, which counts only where no load is lost in its accuracy
    stands = solution.stands if spread(scaled) <= SEEN_LOADS else None
    # the largest multiplier that can be carried is below zero: the live load would have to hold the structure up
    falls = solution.status in (Status.SOLVED, Status.ALMOST_SOLVED) and solution.multiplier < BELOW_ZERO
    if stands and not falls and solution.status != Status.CANNOT_STAND:
        return solution, True, None, 0.0
    answer = stands_under_dead_load(scaled, cones)
    if answer.stands is None and not falls:
        # undecided: the other scaling may decide it, and its motion is then written in the units of this one
        other = problem if scaled is not problem else balanced(problem)
        again = stands_under_dead_load(other, make_cones(other))
        velocity = None if again.velocity is None else scaled.dual(other.twists(again.velocity))
        answer = again._replace(force=None, velocity=velocity, seconds=answer.seconds + again.seconds)
    if falls or answer.stands is not None:
        stands = not falls and answer.stands
    if stands is False:
        velocity = solution.velocity if answer.velocity is None and falls else answer.velocity
        return solution._replace(status=Status.CANNOT_STAND), False, velocity, answer.seconds
    if solution.status == Status.CANNOT_STAND and stands:
        # the interior point called a problem infeasible that has a solution at zero live load
        return solution._replace(status=Status.NOT_CONVERGED), stands, None, answer.seconds
    return solution, stands, None, answer.seconds


def _finer(problem: Problem, prediction: Prediction) -> Cells | None:
    """Finer cells of cohesive faces, where whole faces dissipate more than cells.

    Parameters
    ----------
    prediction : of the problem with its cells so far, with mechanism and certificate

    Returns
    -------
    Cells or None
        None where the cells are fine enough, or cohesion is not what matters.

    Notes
    -----
    The dissipation that the cells may miss, in the power of loads and twists [W for velocities in m/s], is such that
    their part of the gap is less than ``CELL_TARGET``. Finer cells let the mechanism change and then fit it less, so a
    part of the target alone is asked for: ``BETWEEN_BOUNDS``, or ``ONE_BOUND`` where there is a single one.
    """
    loads, mechanism, c = problem.loads, prediction.mechanism, prediction.certificate
    if mechanism is None:
        return None
    if prediction.status == Status.CANNOT_STAND:
        if _falls(prediction):
            return None  # the motion is a proof already
        # a fall has no live load: what the cells may miss is measured by the power of the dead load
        allowed = ONE_BOUND * CELL_TARGET * float((loads.dead * mechanism.twists).sum())
    elif c is not None and c.discretisation > CELL_TARGET:
        live_power = float((loads.live * mechanism.twists).sum())
        # gap = (kinematic - static) / scale: a power over the live power and that scale is a part of the gap
        allowed = BETWEEN_BOUNDS * CELL_TARGET * (c.kinematic_multiplier - c.static_multiplier) / c.gap * live_power
    else:
        return None
    cells = refined(problem.assembly, problem.cells, mechanism.twists, allowed)
    return None if cells is problem.cells else cells


def carry(problem: Problem) -> tuple[Resultants | None, Prediction | None]:
    """Forces that carry the dead load alone; or None, and a proof that it falls.

    Parameters
    ----------
    problem : with ``live_required=False`` if there is no live load

    Returns
    -------
    forces, falling : one of them None, or both where neither was found
    """
    for _ in range(REFINEMENTS + 1):
        cells = None  # finer ones, where the motion by which it falls is no proof on these
        for scaled in (balanced(problem), problem):
            answer = stands_under_dead_load(scaled, make_cones(scaled))
            if answer.force is not None:
                return problem.resultants(scaled.forces(answer.force)), None
            if answer.velocity is None:
                continue
            solution = Solution(
                status=Status.CANNOT_STAND, multiplier=np.nan, force=np.empty(0), velocity=answer.velocity,
                iterations=0, seconds=answer.seconds,
            )
            falling, _ = prediction_from(
                scaled, solution, torsion=False, details={}, tolerance=np.nan, stands=False, falling=answer.velocity
            )
            if _falls(falling):
                return None, falling
            cells = _finer(problem, falling) if problem.cells else None
        if cells is None:
            break
        problem = make_problem(problem.assembly, problem.loads, in_plane=False, cells=cells, live_required=False)
    return None, None
