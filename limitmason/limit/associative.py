"""Associative limit analysis: the static theorem, its mechanism from the dual, and the torsion estimate."""

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from limitmason.certificate import certify, resultants_from_points, scaled_mechanism
from limitmason.geometry.polygon import centred_overlap, polar_mean_radius
from limitmason.limit.problem import Problem
from limitmason.limit.program import Solution, opening_motion, solve_static, stands_under_dead_load
from limitmason.limit.solvers import solve_program
from limitmason.limit.strength import TorsionLimit, make_cones
from limitmason.results import ALMOST_SOLVED, CANNOT_STAND, NOT_CONVERGED, SOLVED, UNBOUNDED, Certificate, Prediction

Array = NDArray[np.float64]

WIDE_GAP = 3e-7
"""Relative gap between the bounds above which a better repair of the mechanism is looked for."""

MAX_TORSION_ITERATIONS = 60
"""Programs solved in search of a pressure that fits its own torsion limit."""

GOOD_RESIDUAL, GOOD_GAP = 1e-7, 1e-6
"""Largest equilibrium residual and yield violation, and largest gap, of an answer that is called solved."""

CONFINEMENT_WARNING = 10.0
"""Largest joint force over the total load from which an answer is said to rest on self-stress."""


def solve_associative(
    problem: Problem,
    *,
    torsion_limit: bool | float = False,
    solver: str = "auto",
    tolerance: float = 1e-10,
    check_dead_load: bool = True,
    verbose: bool = False,
) -> Prediction:
    """Largest multiplier that admissible joint forces can carry, with normality between forces and motion.

    Maximise lambda subject to A f + w_dead + lambda w_live = 0 and the joint law; the dual is the mechanism.

    Parameters
    ----------
    problem : from :func:`limitmason.limit.problem.make_problem`
    torsion_limit : limit each face's torsion about its centre of pressure to that of uniform pressure over this number
        (an estimate)
    solver : "auto", "clarabel" or "interior-point", see :mod:`limitmason.limit.solvers`
    tolerance : of the interior-point method [-]
    check_dead_load : also find out whether the structure stands without live load

    Raises
    ------
    ValueError
        When the chosen solver does not cover the problem.
    """
    start = time.perf_counter()
    cones = make_cones(problem)
    if torsion_limit:
        if solver == "interior-point":
            raise ValueError("solver='interior-point' does not cover the torsion limit; use solver='clarabel'")
        solver = "clarabel"
    solution = solve_program(
        problem, cones, solver=solver, tolerance=tolerance, check_dead_load=check_dead_load, verbose=verbose
    )
    solver_seconds = solution.seconds
    details: dict = {}
    if torsion_limit and solution.status in (SOLVED, ALMOST_SOLVED):
        solution, seconds, details = _with_torsion(problem, solution, tolerance, float(torsion_limit))
        solver_seconds += seconds
    if solution.status == CANNOT_STAND or (check_dead_load and solution.status in (SOLVED, ALMOST_SOLVED)):
        stands, seconds = (False, 0.0) if solution.multiplier < -1e-9 else (solution.stands, 0.0)
        if stands is None:
            stands, seconds = stands_under_dead_load(problem, cones)
        solver_seconds += seconds
        if stands is False:
            solution = solution._replace(status=CANNOT_STAND)
        elif stands and solution.status == CANNOT_STAND:
            # the interior point called a problem infeasible that has a solution at zero live load
            solution = solution._replace(status=NOT_CONVERGED)
    return prediction_from(problem, solution, bool(torsion_limit), details, start, solver_seconds, tolerance)


def prediction_from(
    problem: Problem, solution: Solution, torsion: bool, details: dict, start: float, solver_seconds: float,
    tolerance: float,
) -> Prediction:  # fmt: skip
    """Unscaled, certified prediction from a scaled solution."""
    assembly, loads, points = problem.assembly, problem.loads, problem.points
    provenance = {
        "flow_rule": "associative",
        "contact_model": problem.contact_model,
        "plane": problem.plane is not None,
        "crushing": "stress block" if len(problem.stress_block) else "points",
        "solver": solution.solver,
        "tolerance": tolerance,
        "iterations": solution.iterations,
        "contact_points": points.count,
        "solver_seconds": solver_seconds,
    }
    if solution.fallback:
        provenance["solver_fallback"] = solution.fallback
    law = "associative law (psi = phi)"
    bound = f"exact for the {law}" if not torsion else "estimate: torsion limited to that of uniform pressure"
    method = "limit analysis, associative" + (", torsion limit" if torsion else "")
    if solution.status in (CANNOT_STAND, UNBOUNDED, NOT_CONVERGED):
        value = np.inf if solution.status == UNBOUNDED else np.nan
        provenance["seconds"] = time.perf_counter() - start
        return Prediction(
            method, float(value), "none", solution.status, provenance=provenance, details=details,
            warnings=(_REASON[solution.status],),
        )  # fmt: skip
    force = problem.forces(solution.force)
    resultants = resultants_from_points(assembly, points.position, points.interface, points.area, force)
    mechanism = scaled_mechanism(assembly, loads, problem.twists(solution.velocity), points.position, points.interface)
    prediction = Prediction(
        method, solution.multiplier * problem.live_scale, bound, solution.status, mechanism, resultants, None, (),
        provenance, details,
    )  # fmt: skip
    certificate, seconds = _certified(problem, prediction, torsion)
    provenance["solver_seconds"] += seconds
    if not torsion:
        # what counts is the certificate, not what the solver calls itself: it may stop short of its own tolerance with
        # an answer that is good enough, or call an answer solved that is not
        provenance["solver_status"] = prediction.status
        prediction = replace(prediction, status=SOLVED if _is_good(certificate) else ALMOST_SOLVED)
    warnings = _warnings(problem, prediction, certificate.confinement)
    if np.isfinite(certificate.force_cap):
        warnings.append(
            "no motion opens every joint (blocks are wedged between supports): the kinematic bound holds for joint "
            f"forces up to {certificate.force_cap:.3g} times the load"
        )
    provenance["seconds"] = time.perf_counter() - start
    return Prediction(
        method, prediction.collapse_multiplier, bound, prediction.status, mechanism, resultants, certificate,
        tuple(warnings), provenance, details,
    )  # fmt: skip


def _is_good(c: Certificate) -> bool:
    return c.equilibrium_residual <= GOOD_RESIDUAL and c.yield_violation <= GOOD_RESIDUAL and abs(c.gap) <= GOOD_GAP


def _certified(problem: Problem, prediction: Prediction, torsion: bool) -> tuple[Certificate, float]:
    """Certificate; where the simple opening motions give too wide a gap, one is computed for this assembly."""
    certificate = certify(problem.assembly, problem.loads, prediction)
    if torsion:
        # the torsion limit is no part of the law that the kinematic value knows: only the forces are certified
        unknown = dict.fromkeys(("flow_residual", "complementarity", "kinematic_multiplier", "gap"), float("nan"))
        return replace(certificate, **unknown, force_cap=float("inf")), 0.0
    if certificate.gap <= WIDE_GAP and np.isinf(certificate.force_cap):
        return certificate, 0.0
    motion, seconds = opening_motion(problem)
    if motion is None:
        return certificate, seconds
    candidates = (problem.twists(motion),)
    return certify(problem.assembly, problem.loads, prediction, candidates=candidates), seconds


_REASON = {
    CANNOT_STAND: "no admissible joint forces carry the dead load: the structure cannot stand before any live load",
    UNBOUNDED: "no finite multiplier: admissible joint forces grow with the live load without limit",
    NOT_CONVERGED: "the solver stopped without an answer; try another tolerance or contact model",
}


def _warnings(problem: Problem, prediction: Prediction, confinement: float) -> list[str]:
    out = []
    if prediction.status == ALMOST_SOLVED:
        out.append("reduced accuracy: read the certificate before using the number")
    spread = prediction.details.get("torsion_spread", 0.0)
    if spread > 2e-3:
        tail = prediction.details["torsion_history"][-5:]
        out.append(
            f"the torsion iteration did not settle: its last values lie between {min(tail):.6g} and {max(tail):.6g}"
        )
    if (problem.tension > 0).any() or (problem.cohesion > 0).any():
        out.append(
            "tension and cohesion are taken as perfectly plastic: a section carries ft A L / 2, three times the "
            "elastic-brittle ft A L / 6; where ft > c / tan(phi) the apex of the Coulomb cone governs"
        )
    if confinement > CONFINEMENT_WARNING:
        out.append(
            f"the answer rests on confining forces: the largest joint force is {confinement:.3g} times the load; "
            "check with a method that builds up stress from zero"
        )
    limited = "torsion limit" in prediction.method
    if not limited and not len(problem.stress_block) and problem.plane is None:
        x = problem.assembly.arrays
        twist = np.abs(prediction.resultants.torsion)
        limit = x.tan_phi * np.maximum(prediction.resultants.normal, 0.0) * np.sqrt(x.area)
        if (twist > 0.4 * limit + 1e-6 * problem.force_scale).any():
            out.append(
                "some faces carry more torsion than uniform pressure allows (0.38 mu N a on a square): "
                "torsion_limit=True gives an estimate with it limited"
            )
    return out


def _with_torsion(
    problem: Problem, solution: Solution, tolerance: float, reduction: float
) -> tuple[Solution, float, dict]:
    """Repeat with every face's torsion limited about the centre of pressure of the last iterate.

    The step towards the new forces shrinks (successive averages), so that faces whose pressure jumps from corner to
    corner settle. The value has settled when the last tenth of a per cent no longer moves; otherwise the spread of the
    last iterates is reported and the status says that accuracy is reduced.
    """
    if problem.plane is not None:
        return solution, 0.0, {"torsion_iterations": 0}
    values, seconds, force, last = [], 0.0, solution.force, None
    for k in range(MAX_TORSION_ITERATIONS):
        limits = torsion_limits(problem, force)
        limits = limits._replace(radius=limits.radius / reduction)
        answer = solve_static(problem, make_cones(problem, torsion=limits), tolerance=tolerance)
        seconds += answer.seconds
        if answer.status not in (SOLVED, ALMOST_SOLVED):
            if last is None:
                return solution._replace(status=NOT_CONVERGED), seconds, {"torsion_iterations": k + 1}
            force = 0.5 * (
                force + last.force
            )  # too strict a linearisation: move back towards forces that were possible
            continue
        last = answer
        values.append(answer.multiplier)
        recent = values[-5:]
        if len(values) > 1 and abs(values[-1] - values[-2]) <= 1e-7 * max(1e-9, abs(values[-1])):
            break
        if k >= 12 and max(recent) - min(recent) <= 1e-3 * abs(values[-1]):
            break
        force = force + (answer.force - force) * (0.5 if k < 6 else 3.0 / k)
    recent = values[-min(10, len(values)) :] if len(values) > 1 else values
    tail = recent[-5:]
    spread = 0.0 if len(values) < 3 else (max(tail) - min(tail)) / max(abs(values[-1]), 1e-300)
    details = {
        "torsion_iterations": len(values),
        "torsion_history": [v * problem.live_scale for v in values],
        "torsion_spread": spread,
    }
    status = SOLVED if spread <= 2e-3 else ALMOST_SOLVED
    return last._replace(status=status), seconds, details


def torsion_limits(problem: Problem, force: Array) -> TorsionLimit:
    """Centre of pressure and polar mean radius of the compressed area of every loaded interface.

    The compressed area is the part of the face that is symmetric about the centre of pressure, which carries its force
    under uniform pressure.
    """
    x = problem.assembly.arrays
    points = problem.points
    normal = force.reshape(-1, 3)[:, 0]
    interfaces = np.unique(points.interface)
    total = np.bincount(points.interface, normal, len(x.area))
    threshold = 1e-7 * np.abs(normal).max(initial=0.0)
    chosen, poles, radii = [], [], []
    for k in interfaces:
        frame = np.column_stack([x.tangent_1[k], x.tangent_2[k]])
        corners = (x.corners[x.corner_start[k] : x.corner_start[k + 1]] - x.centre[k]) @ frame
        pole = np.zeros(2)
        if total[k] > threshold:
            p = np.flatnonzero(points.interface == k)
            weight = np.maximum(normal[p], 0.0)
            pole = (weight[:, None] * ((points.position[p] - x.centre[k]) @ frame)).sum(axis=0) / weight.sum()
        area = centred_overlap(corners, pole)
        chosen.append(k)
        poles.append(x.centre[k] + frame @ pole)
        size = np.sqrt(x.area[k])
        radii.append(max(polar_mean_radius(area, pole) if len(area) >= 3 else 0.0, 1e-4 * size))
    return TorsionLimit(np.array(chosen), np.array(poles), np.array(radii))
