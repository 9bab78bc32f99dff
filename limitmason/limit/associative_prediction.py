"""From a solution of the static theorem to a prediction with its certificate."""

from dataclasses import replace

import numpy as np

from limitmason.answers.acceptance import GAP, Certificate
from limitmason.answers.results import Bound, BoundKind, FlowRule, Mechanism, Prediction, Status
from limitmason.arrays import Array
from limitmason.limit.associative_warnings import REASON, crushed_points, warnings_of
from limitmason.limit.program.clarabel_solver import Solution, in_balance, opening_motion
from limitmason.limit.program.face_cells import spread_cohesion
from limitmason.limit.program.idle_joints import without_rounding
from limitmason.limit.program.static_theorem import Problem
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.residuals import load_on_blocks
from limitmason.model.load import Loads

WIDE_GAP = 3e-7
"""Relative gap between the bounds above which a better repair of the mechanism is looked for."""

MOVES = 1e-4
"""Velocity over the largest from which a block is named among those that fall [-]: chosen."""

UNDECIDED = (
    "ask again with a friction angle or a size changed by a millionth, as the structure may be right at its limit, and "
    "look for blocks or loads whose sizes lie far apart"
)
"""What to do where neither forces nor a motion were found, in words."""


def _falling(problem: Problem, velocity: Array | None) -> tuple[Mechanism | None, dict]:
    """The motion by which the dead load falls, at mean velocity one, and its proof.

    Its kinematic bound is for the dead load itself: the structure falls where less than all of it can be carried.

    Parameters
    ----------
    velocity : duals of the equilibrium rows, shape (r,); None for no motion

    Returns
    -------
    mechanism, proof : the latter for the details: names of the blocks that fall, and one minus the bound [-]
    """
    if velocity is None:
        return None, {}
    # the dead load in the role of the live one, so that its multiplier is asked for
    fall = Loads(np.zeros_like(problem.loads.dead), problem.loads.dead)
    m = problem.mechanism(fall, velocity)
    if m is None:
        return None, {}
    bound = problem.proven_by(fall, m.twists).multiplier
    if not bound < 1.0:
        # as the solver gives it the motion may close joints by rounding: let one that opens all of them repair it
        motion, _ = opening_motion(problem)
        if motion is not None:
            bound = problem.proven_by(fall, m.twists, (problem.twists(motion),)).multiplier
    blocks = tuple(problem.assembly.blocks[i].name for i in m.moving_blocks(MOVES))
    return m, {"falling_blocks": blocks, "falling_margin": 1.0 - bound}


def prediction_from(
    problem: Problem, solution: Solution, torsion: bool, details: dict, tolerance: float, stands: bool | None,
    falling: Array | None,
) -> tuple[Prediction, float]:
    """Unscaled, certified prediction from a scaled solution, and the seconds for it.

    Parameters
    ----------
    problem : in the scaling that was solved
    solution : of it
    torsion : whether a torsion limit holds
    details : entries of ``Prediction.details``
    tolerance : of the solver [-]
    stands : whether the dead load alone is carried, None where not known
    falling : duals of the equilibrium rows of the motion by which it falls, shape (r,); None for none

    Returns
    -------
    prediction, seconds : the latter in the programs of the certificate [s]
    """
    assembly, loads, points = problem.assembly, problem.loads, problem.points
    provenance = {
        "flow_rule": "associative",
        "contact_model": problem.contact_model,
        "plane": problem.plane is not None,
        "crushing": "stress block" if problem.stress_block.count else "points",
        "solver": solution.solver,
        "tolerance": tolerance,
        "iterations": solution.iterations,
        "contact_points": points.count,
    }
    if solution.fallback:
        provenance["solver_fallback"] = solution.fallback
    facts = {"flow_rule": FlowRule.ASSOCIATIVE, **problem.contact_facts}
    law = "associative law (psi = phi)"
    bound = Bound(BoundKind.EXACT, f"exact for the {law}")
    if torsion:
        beside = "beside shear up to 7 % too strong on square faces, 14 % on long ones"
        bound = Bound(BoundKind.ESTIMATE, f"estimate: torsion limited to that of uniform pressure ({beside})")
    if problem.contact_model == "grid" and problem.plane is None and (spread_cohesion(assembly) > 0).any():
        words = f"estimate: {law} at the points of a grid, which overstate the torsion of cohesive faces"
        bound = Bound(BoundKind.ESTIMATE, words)
    if bound.kind is BoundKind.EXACT and problem.crushing_points.any():
        bound = Bound(BoundKind.ESTIMATE, f"estimate: {law} at {crushed_points(problem)}")
    method = "limit analysis, associative" + (", torsion limit" if torsion else "")
    if solution.status in (Status.CANNOT_STAND, Status.UNBOUNDED, Status.NOT_CONVERGED):
        none = Prediction(
            method=method, collapse_multiplier=np.inf if solution.status == Status.UNBOUNDED else np.nan,
            bound=Bound(BoundKind.NONE), status=solution.status, provenance=provenance, details=details, **facts,
        )
        return _with_its_reason(problem, none, stands, falling), 0.0
    value = solution.multiplier * problem.live_scale
    own = load_on_blocks(assembly, loads, value)
    force = problem.forces(in_balance(problem, solution.force, solution.multiplier))
    force = without_rounding(assembly, own, points.interface, force)
    mechanism = problem.mechanism(loads, solution.velocity)
    prediction = Prediction(
        method=method, collapse_multiplier=value, bound=bound, status=solution.status, mechanism=mechanism,
        resultants=problem.resultants(force), provenance=provenance, details=details,
        **facts,
    )
    certificate, seconds = _certified(problem, prediction, torsion)
    if not torsion:
        # what counts is the certificate, not what the solver calls itself: it may stop short of its own tolerance with
        # an answer that is good enough, or call an answer solved that is not
        provenance["solver_status"] = prediction.status
        prediction = replace(prediction, status=Status.SOLVED if certificate.accepted else Status.ALMOST_SOLVED)
        if certificate.discretisation > GAP:
            words = f"lower bound for the {law}, {certificate.gap:.1e} below an upper one (cells of cohesive faces)"
            bound = Bound(BoundKind.LOWER, words)
    warnings = warnings_of(problem, replace(prediction, certificate=certificate), certificate.confinement, torsion)
    if np.isfinite(certificate.force_cap):
        warnings.append(
            "no motion opens every joint (blocks are wedged between supports): the kinematic bound holds for joint "
            f"forces up to {certificate.force_cap:.3g} times the load"
        )
    return replace(prediction, bound=bound, certificate=certificate, warnings=tuple(warnings)), seconds


def _with_its_reason(problem: Problem, none: Prediction, stands: bool | None, falling: Array | None) -> Prediction:
    """A prediction without a multiplier: the reason as a warning, and how it falls.

    Parameters
    ----------
    none : the prediction, with its status but without mechanism and warnings
    stands, falling : as for :func:`prediction_from`
    """
    mechanism, proof = _falling(problem, falling)
    reason = REASON[Status(none.status)]
    if mechanism is not None:
        count, first = len(proof["falling_blocks"]), proof["falling_blocks"][0]
        reason += f"; the mechanism is that of the fall ({count} blocks move, among them {first!r})"
    if none.status == Status.UNBOUNDED and stands is None:
        reason += "; whether it stands without live load was not found out"
    return replace(none, mechanism=mechanism, details={**none.details, **proof}, warnings=(reason,))


def _certified(problem: Problem, prediction: Prediction, torsion: bool) -> tuple[Certificate, float]:
    """Certificate of a prediction, and seconds in its programs [s].

    Where the usual repair of the mechanism leaves a wide gap, a motion that opens all joints is computed to repair it.

    Parameters
    ----------
    torsion : whether a torsion limit holds, so that only forces can be certified
    """
    certificate = certify(problem.assembly, problem.loads, prediction)
    if torsion:
        # the torsion limit is no part of the law that the kinematic value knows: only the forces are certified
        nan = float("nan")
        return replace(
            certificate, flow_residual=nan, complementarity=nan, kinematic_multiplier=nan, gap=nan, discretisation=0.0,
            force_cap=float("inf"),
        ), 0.0
    if certificate.gap - certificate.discretisation <= WIDE_GAP and np.isinf(certificate.force_cap):
        return certificate, 0.0
    motion, seconds = opening_motion(problem)
    if motion is None:
        return certificate, seconds
    candidates = (problem.twists(motion),)
    return certify(problem.assembly, problem.loads, prediction, candidates=candidates), seconds
