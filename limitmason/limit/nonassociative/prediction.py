"""The answer of a non-associative analysis: bound, details, certificate, warnings.

``details`` and ``provenance`` are those of the prediction: what the search found, by name, and how it was made.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.acceptance import Certificate
from limitmason.answers.results import Bound, BoundKind, FlowRule, Prediction, Range, Status
from limitmason.limit.associative_warnings import TWISTED, crushed_points, self_stress, twisted_faces
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, true_forces
from limitmason.limit.nonassociative.ordered_search import FORCE_BOUND
from limitmason.limit.nonassociative.search import Effort, SearchOutcome
from limitmason.limit.nonassociative.smallest_proof import Extreme
from limitmason.limit.program.static_theorem import Problem
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.law_table import NON_ASSOCIATIVE, notes

METHOD = "limit analysis, non-associative"

LOOSE = 1e-5
"""Violation of the true law up to which a state is still returned, as "almost solved"."""

SMALL_DILATANCY = 0.002
"""tan(psi) / tan(phi) at which the jump of the multiplier at psi = 0 is measured."""

JUMP = 0.01
"""Part of the multiplier by which it must rise with so small a dilatancy to be called a jump."""

FAR_BELOW = 1.2
"""Multiplier of the sequence over that of the search from which a user is told of the difference [-]: chosen."""


def without_state(
    problem: Problem, upper: Prediction, proof: Extreme | None, details: dict, provenance: dict
) -> Prediction:
    """The answer where no state keeps the law: unbounded, or not converged.

    Parameters
    ----------
    upper : the associative answer
    proof : of the smallest multiplier, whose ``none`` says that there is no state; None where none was tried
    """
    reason = "no state that keeps the true law was found; the bracket in the details still holds"
    if proof is not None and proof.none:
        reason = (
            f"no admissible state exists, proven for velocities up to {proof.velocity_bound:g} times the mean live "
            f"velocity and joint forces up to {FORCE_BOUND:g} times the load"
        )
    if upper.status == Status.UNBOUNDED:
        return replace(
            upper, method=METHOD, provenance=provenance, details=details, warnings=(*upper.warnings, reason),
            flow_rule=FlowRule.NON_ASSOCIATIVE,
        )
    return Prediction(
        METHOD, float("nan"), Bound(BoundKind.NONE), Status.NOT_CONVERGED, provenance=provenance, details=details,
        warnings=(reason,), flow_rule=FlowRule.NON_ASSOCIATIVE, **problem.contact_facts,
    )


def bound_alone(
    problem: Problem, upper: Prediction, details: dict, provenance: dict, status: Status
) -> Prediction:
    """The answer of a search that ended before a state: the associative bound.

    Parameters
    ----------
    upper : the associative answer
    status : says what ended the search
    """
    words = f"upper bound: the associative multiplier, its state not admissible; not unique, {_between(details)}"
    return certified(problem, replace(
        upper, method=METHOD, status=status, bound=Bound(BoundKind.UPPER, f"{words} (Radenkovic)"),
        details=details, provenance=provenance, flow_rule=FlowRule.NON_ASSOCIATIVE, certificate=None, warnings=(),
    ))


def details_of(problem: Problem, found: SearchOutcome, low: float, high: float, proof: Extreme | None) -> dict:
    """What the search did: the details of the prediction.

    Its multipliers are unscaled, of the live load as it was given [-]: scaled ones times ``problem.live_scale``.

    Parameters
    ----------
    found : all trials, scaled
    low : Radenkovic's lower bound, scaled [-]
    high : the associative multiplier, unscaled [-]
    proof : of the smallest multiplier, None where none was tried
    """
    values = found.certified * problem.live_scale
    # a trial knows the lowest of its own search only: here it is the lowest of all before it
    lowest = np.fmin.accumulate([t.certified * problem.live_scale for t in found.trials]).tolist()
    run = found.first_run
    return {
        "radenkovic": (low * problem.live_scale, high),
        "sequential_multiplier": run.state.multiplier * problem.live_scale if run and run.state else float("nan"),
        "sequential_steps": run.steps if run else 0,
        "sequential_excess": run.excess if run else float("nan"),
        "sequential_certified": found.unpushed * problem.live_scale,
        "candidates": len(found.trials),
        "certified_candidates": len(values),
        "slides_nowhere": found.at_rest,
        "time_limit_reached": found.stopped and not found.interrupted,
        "interrupted": found.interrupted,
        "bound_met": found.closed,
        "spread": (float(values.min()), float(values.max())) if len(values) else (float("nan"), float("nan")),
        "trials": tuple(
            t.times(problem.live_scale)._replace(best=b) for t, b in zip(found.trials, lowest, strict=True)
        ),
        "proof": None if proof is None else _proof_details(problem, proof),
    }


def _proof_details(problem: Problem, proof: Extreme) -> dict:
    """What the proof of the smallest multiplier found, by name.

    Only "bound" and "gap", as multipliers, are unscaled. "velocity_bound" is in mean live velocities, "force_bound" in
    total loads; either is infinite where the proof needs none. "velocity_share" is the largest velocity of the state
    over its bound [-], "nodes" are those of the programs, "seconds" their time [s].

    Parameters
    ----------
    proof : scaled
    """
    return {
        "proven": proof.proven,
        "none exists": proof.none,
        "bound": proof.bound * problem.live_scale,
        "gap": proof.gap * problem.live_scale,
        "method": proof.method,
        "velocity_bound": proof.velocity_bound if proof.velocity_bounded else np.inf,
        "velocity_share": proof.velocity_share,
        "force_bound": FORCE_BOUND if proof.force_bounded else np.inf,
        "nodes": proof.nodes,
        "seconds": proof.seconds,
    }


def prediction_of(
    problem: Problem, law: JointLaw, state: ForceState, status: Status, details: dict, provenance: dict,
    search: str | Effort,
) -> Prediction:
    """Prediction of a state: forces, mechanism, bound and range of certified states.

    Parameters
    ----------
    law : of the problem, in the order of its own rows
    state : scaled, with forces from the tension corner
    status : how the search ended
    details : of :func:`details_of`, with the interval of multipliers at the mechanism
    search : its name or effort, for the words of the bound
    """
    resultants = problem.resultants(problem.forces(true_forces(law, state)))
    mechanism = problem.mechanism(problem.loads, state.velocity)
    kind, words = _kind_of_bound(details, search)
    if kind is BoundKind.EXACT and problem.crushing_points.any():
        kind, words = BoundKind.ESTIMATE, f"estimate: it meets the lower bound at {crushed_points(problem)}"
    value = state.multiplier * problem.live_scale
    if ended_without_state(status, details):
        words = "estimate: multiplier of the nearest state when the search was ended, not admissible"
        certified = Range()
    else:
        ends = [e for e in (*details["interval_at_mechanism"], *details["spread"], value) if math.isfinite(e)]
        certified = Range(min(ends), max(ends), "certified states found")
    bound = Bound(kind, f"{words}; not unique, {_between(details)} (Radenkovic)")
    return Prediction(
        method=METHOD, collapse_multiplier=value, bound=bound, status=status, mechanism=mechanism,
        resultants=resultants, provenance=provenance, details=details,
        flow_rule=FlowRule.NON_ASSOCIATIVE, range=certified, **problem.contact_facts,
    )


def certified(problem: Problem, prediction: Prediction) -> Prediction:
    """The prediction with its certificate, and with the warnings that follow from it."""
    certificate = certify(problem.assembly, problem.loads, prediction)
    prediction = replace(prediction, certificate=certificate)
    return replace(prediction, warnings=tuple(_warnings(problem, prediction, certificate)))


def ended_without_state(status: Status, details: Mapping[str, Any]) -> bool:
    """Whether the search was ended before a state that keeps the law.

    It ended by its time or from the keyboard.
    """
    return status == Status.TIME_ENDED or (status == Status.INTERRUPTED and not details["certified_candidates"])


def _between(details: dict) -> str:
    """Where Radenkovic's bounds have the multiplier, in words."""
    low, high = details["radenkovic"]
    if not np.isfinite(high):
        return "without an upper bound, the associative multiplier being infinite"
    return f"between {low:.6g} and {high:.6g}" if np.isfinite(low) else f"at most {high:.6g}"


def _kind_of_bound(details: dict, search: str | Effort) -> tuple[BoundKind, str]:
    """Kind of the bound and its first words: proven, found, or only a value.

    ``details`` are those of :func:`details_of`, ``search`` is its name or effort.
    """
    proof = details["proof"]
    if details["bound_met"]:
        return BoundKind.EXACT, "exact: smallest admissible multiplier, it meets the lower bound"
    if proof is None:
        if details["slides_nowhere"]:
            return BoundKind.ESTIMATE, (
                "estimate: smallest admissible multiplier found, not proven; the associative mechanism slides nowhere, "
                "so that its state is admissible for every psi, and the search was short (one sequence, two random "
                "starts, a push; search='thorough' looks longer)"
            )
        words = "estimate: smallest admissible multiplier found, not proven"
        if search == "quick":
            words = "estimate: an admissible multiplier, not the smallest (quick search: a longer one may end lower)"
        return BoundKind.ESTIMATE, words
    within = ""
    if np.isfinite(proof["velocity_bound"]):
        within = f" for velocities up to {proof['velocity_bound']:g} times the mean live velocity"
    if np.isfinite(proof["force_bound"]):
        within += f" and joint forces up to {proof['force_bound']:g} times the load"
    if proof["proven"]:
        return BoundKind.EXACT, f"exact: smallest admissible multiplier, proven{within} (gap {proof['gap']:.1e})"
    return BoundKind.ESTIMATE, (
        f"estimate: smallest admissible multiplier found, not proven in the time given (proven: none below "
        f"{proof['bound']:.6g}{within})"
    )


def _warnings(problem: Problem, prediction: Prediction, certificate: Certificate) -> list[str]:
    """What a user must know of a prediction and its certificate, one sentence each."""
    out = []
    details = prediction.details
    worst = max(certificate.flow_residual, certificate.complementarity, certificate.yield_violation)
    if not worst <= LOOSE:
        out.append(f"the true law is violated by {worst:.1e}: the multiplier is not certified")
    elif prediction.status == Status.ALMOST_SOLVED:
        out.append(f"the true law is met to {worst:.1e} only: read the certificate before using the number")
    jump = details.get("at_small_dilatancy", np.nan)
    if jump > (1.0 + JUMP) * prediction.collapse_multiplier:
        out.append(
            f"jump at psi = 0: with tan(psi) = {SMALL_DILATANCY:g} tan(phi) the smallest multiplier found is "
            f"{jump:.6g}; joints that dilate ever so little lock this mechanism"
        )
    unpushed = details["sequential_certified"]
    if unpushed > FAR_BELOW * prediction.collapse_multiplier:
        text = f"the search went far below the sequence, which gives {unpushed:.6g}: "
        if problem.plane is None:
            text += (
                "joint forces that gather in a corner let a block turn there at little or no load. Gaps of 1e-4 of a "
                "block in the joints (20 micrometres on 0.2 m) are enough to lose equilibrium first at the low value; "
                "in most walls that motion arrests itself after millimetres"
            )
        else:
            text += "which of the two a structure meets depends on the joint forces that its history leaves"
        out.append(text)
    if problem.crushing_points.any():
        n = int(np.bincount(problem.points.interface).max())
        out.append(f"crushing on a grid of {n} points per interface: refine the grid to see its error")
    if details["time_limit_reached"] or details["interrupted"]:
        given = "the multiplier is the lowest of these, a longer search may end lower"
        if ended_without_state(prediction.status, details):
            given = "none keeps the law yet, the nearest state is given; allow more time"
            if prediction.bound.kind is BoundKind.UPPER:
                given = "none keeps the law yet below the associative bound, which is given; allow more time"
        by = "the time limit ended the search" if details["time_limit_reached"] else "the search was interrupted"
        out.append(f"{by} after {details['candidates']} trials: {given}")
    out += notes(NON_ASSOCIATIVE, problem.assembly, problem.interfaces)
    out += self_stress(certificate.confinement)
    if twisted_faces(problem, prediction):
        out.append(TWISTED)
    return out
