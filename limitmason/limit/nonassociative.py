"""Non-associative limit analysis, any 0 <= psi <= phi: the smallest admissible multiplier that a search finds."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from limitmason.certificate import certify, resultants_from_points, scaled_mechanism
from limitmason.limit.associative import CONFINEMENT_WARNING, solve_associative
from limitmason.limit.joint_law import JointLaw, State, joint_law, split, true_forces, violation
from limitmason.limit.numbering import Numbering, numbering
from limitmason.limit.problem import Problem
from limitmason.limit.search import EFFORTS, Effort, Polisher, Search, Trial, search_smallest
from limitmason.limit.sequential import FrozenCones
from limitmason.results import ALMOST_SOLVED, NOT_CONVERGED, SOLVED, UNBOUNDED, Prediction

Array = NDArray[np.float64]

METHOD = "limit analysis, non-associative"

LOOSE = 1e-5
"""Violation of the true law up to which a state is still returned, as "almost solved"."""

SMALL_DILATANCY = 0.002
"""tan(psi) / tan(phi) at which the jump of the multiplier at psi = 0 is measured."""

JUMP_POINTS = 1000
"""Contact points up to which the jump is measured unasked: beyond, it may take as long as the search."""


def solve_nonassociative(
    problem: Problem,
    *,
    search: str | Effort = "standard",
    seed: int = 0,
    tolerance: float = 1e-10,
    check_dead_load: bool = True,
    accuracy: float = 1e-8,
    budget: float | None = None,
    measure_jump: bool | None = None,
    progress: Callable[[Trial], None] | None = None,
) -> Prediction:
    """Smallest multiplier found at which equilibrium, the joint law and its flow rule hold together.

    A f + w_dead + lambda w_live = 0, |T| <= c + tan(phi) N, e_n >= tan(psi) |e_t|, and no joint force does power
    against its flow rule: N (e_n - tan(psi) |e_t|) = 0, T . e_t = -(c + tan(phi) N) |e_t|.

    Parameters
    ----------
    problem : from :func:`limitmason.limit.problem.make_problem`
    search : "quick", "standard" or "thorough", or an :class:`~limitmason.limit.search.Effort`
    seed : of the random starts; equal arguments give equal results unless ``budget`` is set
    tolerance : of the interior-point method in the associative analysis that comes first [-]
    check_dead_load : also find out whether the structure stands without live load
    accuracy : violation of the true law, relative to the total load, up to which a state counts [-]
    budget : ends the search after so many seconds where given
    measure_jump : compare with psi slightly above zero where psi is zero; None does so in plane, up to 1000 points
    progress : called with every trial of the search

    Returns
    -------
    Prediction
        ``details`` holds the bracket, the interval of multipliers at the mechanism found, the sequential value raw and
        certified, its steps, the spread over the candidates, and the record of trials. Where psi = phi at all joints
        the associative prediction is returned under this method's name.

    Raises
    ------
    ValueError
        For an unknown search, and for in-plane sections with an exact crushing stress block.

    Notes
    -----
    Sources: Radenkovic (1961) for the bracket; Ferris and Tin-Loi (2001) for the problem; Gilbert, Casapulla and Ahmed
    (2006) for the sequential idea. The multiplier is not unique: joint forces are statically indeterminate and their
    friction is not worked out from how they came about. The value is admissible (see the certificate), hence an upper
    bound of the smallest admissible one; for small plane walls :func:`limitmason.limit.proven_range` settles the rest.
    The search goes in an order read off the geometry: other numbers of blocks and joints end at the same value, and by
    the standard and the thorough search a plane wall and its mirror image do too.
    Wrong as a prediction where the least favourable joint forces never come about: in 3-D the smallest admissible
    multiplier at psi = 0 can be zero, a block at a free end turning about one corner that carries all its load.
    """
    start = time.perf_counter()
    if isinstance(search, str) and search not in EFFORTS:
        raise ValueError(f"search must be one of {tuple(EFFORTS)}, got {search!r}")
    effort = EFFORTS[search] if isinstance(search, str) else search
    everywhere = bool((problem.tan_psi >= problem.tan_phi - 1e-15).all())
    law = None if everywhere else joint_law(problem)
    upper = solve_associative(problem, tolerance=tolerance, check_dead_load=check_dead_load)
    provenance = dict(
        upper.provenance, flow_rule="non-associative", seed=seed,
        solver="clarabel" if problem.plane is None else "clarabel, HiGHS",
        search=search if isinstance(search, str) else "given",
    )  # fmt: skip
    if law is None:
        # psi = phi: the two laws are one and the associative certificate, with its gap, says more
        provenance["flow_rule"] = "associative"
        return replace(upper, method=f"{METHOD} (psi = phi: associative)", provenance=provenance)
    if upper.status not in (SOLVED, ALMOST_SOLVED, UNBOUNDED):
        return replace(upper, method=METHOD, provenance=provenance)
    order, ordered, found = _in_order_of_geometry(
        problem, law, effort, seed=seed, accuracy=accuracy, budget=budget, progress=progress
    )
    low = radenkovic_lower(law)
    details = _details(problem, found, low, upper.collapse_multiplier)
    state, status = found.best, SOLVED
    if state is None and found.nearest is not None and violation(ordered, found.nearest).worst <= LOOSE:
        state, status = found.nearest, ALMOST_SOLVED
    if state is None:
        provenance["seconds"] = time.perf_counter() - start
        if upper.status == UNBOUNDED:
            return replace(upper, method=METHOD, provenance=provenance, details=details)
        reason = "no state that keeps the true law was found; the bracket in the details still holds"
        return Prediction(
            METHOD, float("nan"), "none", NOT_CONVERGED, provenance=provenance, details=details, warnings=(reason,)
        )
    ends = Polisher(ordered, accuracy).interval(state) if status == SOLVED else (state.multiplier, state.multiplier)
    details["interval_at_mechanism"] = tuple(e * problem.live_scale for e in ends)
    if measure_jump is None:
        measure_jump = problem.plane is not None and problem.points.count <= JUMP_POINTS
    if measure_jump and status == SOLVED and (law.tan_psi[law.tan_phi > 0] == 0).any():
        details["at_small_dilatancy"] = _at_small_dilatancy(problem, ordered, state, accuracy)
    prediction = _prediction(problem, law, order.back(law, state), status, details, provenance)
    certificate = certify(problem.assembly, problem.loads, prediction)
    provenance["seconds"] = time.perf_counter() - start
    prediction = replace(prediction, certificate=certificate)
    return replace(prediction, warnings=tuple(_warnings(problem, prediction)))


def radenkovic_lower(law: JointLaw) -> float:
    """Scaled associative multiplier of the law inside, |T| <= c' + tan(psi) N'; NaN where nothing stands on that.

    Notes
    -----
    Source: Radenkovic's second theorem. Both laws share the tension corner: with tension, tan(psi) N + c A would lie
    outside the true law below N = 0.
    """
    status, state = FrozenCones(law, law.tan_psi).solve(law.cohesion)
    if state is None or status not in ("Solved", "AlmostSolved"):
        return float("nan")
    # an interior point leaves 1e-12 where the bound is zero
    return 0.0 if abs(state.multiplier) < 1e-9 else state.multiplier


def _in_order_of_geometry(
    problem: Problem, law: JointLaw, effort: Effort, *, budget: float | None, **options
) -> tuple[Numbering, JointLaw, Search]:
    """Search in an order that does not depend on how blocks are numbered: order, law and outcome of the lower end.

    A search is local, and a mirrored order of a symmetric wall ends elsewhere: where the effort asks for it both are
    searched, so that a plane wall and its mirror image give one value.
    """
    tried: list[tuple[Numbering, JointLaw, Search]] = []
    for mirrored in (False, True) if effort.mirrored else (False,):
        order = numbering(problem, mirrored=mirrored)
        ordered = order.law(law)
        share = None if budget is None else budget / (2 if effort.mirrored else 1)
        found = search_smallest(ordered, _starting_forces(ordered), effort=effort, budget=share, **options)
        tried.append((order, ordered, found))

    def height(one: tuple[Numbering, JointLaw, Search]) -> float:
        return np.inf if one[2].best is None else one[2].best.multiplier

    order, ordered, best = min(tried, key=height)
    return order, ordered, best._replace(trials=tuple(t for one in tried for t in one[2].trials))


def _starting_forces(law: JointLaw) -> Array:
    """Normal forces N' of the associative state, or equal ones where that has no bound."""
    _, state = FrozenCones(law, law.tan_phi).solve(law.cohesion)
    if state is None:
        return np.full(len(law.tan_phi), law.total / len(law.tan_phi))
    return np.maximum(split(law, state.force)[0], 0.0)


def _at_small_dilatancy(problem: Problem, law: JointLaw, state: State, accuracy: float) -> float:
    """Smallest multiplier of a short search with a little dilatancy wherever there is none; NaN when none is found."""
    little = law._replace(tan_psi=np.where(law.tan_psi == 0, SMALL_DILATANCY * law.tan_phi, law.tan_psi))
    normal = np.maximum(state.force[:: law.components], 0.0)
    # a larger slope would hide so small a dilatancy
    effort = Effort((0.1 * SMALL_DILATANCY,), (0.6,), 0, (), False)
    found = search_smallest(little, normal, effort=effort, accuracy=accuracy)
    return float("nan") if found.best is None else found.best.multiplier * problem.live_scale


def _details(problem: Problem, found: Search, low: float, high: float) -> dict:
    values = found.certified * problem.live_scale
    run = found.first_run
    return {
        "radenkovic": (low * problem.live_scale, high),
        "sequential_multiplier": run.state.multiplier * problem.live_scale if run and run.state else float("nan"),
        "sequential_steps": run.steps if run else 0,
        "sequential_excess": run.excess if run else float("nan"),
        "sequential_certified": found.unpushed * problem.live_scale,
        "candidates": len(found.trials),
        "certified_candidates": len(values),
        "spread": (float(values.min()), float(values.max())) if len(values) else (float("nan"), float("nan")),
        "trials": tuple(
            t._replace(sequential=t.sequential * problem.live_scale, certified=t.certified * problem.live_scale)
            for t in found.trials
        ),
    }


def _prediction(
    problem: Problem, law: JointLaw, state: State, status: str, details: dict, provenance: dict
) -> Prediction:
    assembly, points = problem.assembly, problem.points
    force = problem.forces(true_forces(law, state))
    resultants = resultants_from_points(assembly, points.position, points.interface, points.area, force)
    mechanism = scaled_mechanism(
        assembly, problem.loads, problem.twists(state.velocity), points.position, points.interface
    )
    low, high = details["radenkovic"]
    between = f"between {low:.6g} and {high:.6g}" if np.isfinite(low) else f"at most {high:.6g}"
    if not np.isfinite(high):
        between = "without an upper bound, the associative multiplier being infinite"
    bound = f"estimate: smallest admissible multiplier found; not unique, {between} (Radenkovic)"
    return Prediction(
        METHOD, state.multiplier * problem.live_scale, bound, status, mechanism, resultants, None, (), provenance,
        details,
    )  # fmt: skip


def _warnings(problem: Problem, prediction: Prediction) -> list[str]:
    out = []
    certificate, details = prediction.certificate, prediction.details
    worst = max(certificate.flow_residual, certificate.complementarity, certificate.yield_violation)
    if not worst <= LOOSE:
        out.append(f"the true law is violated by {worst:.1e}: the multiplier is not certified")
    elif prediction.status == ALMOST_SOLVED:
        out.append(f"the true law is met to {worst:.1e} only: read the certificate before using the number")
    jump = details.get("at_small_dilatancy", np.nan)
    if jump > 1.01 * prediction.collapse_multiplier:
        out.append(
            f"jump at psi = 0: with tan(psi) = {SMALL_DILATANCY:g} tan(phi) the smallest multiplier found is "
            f"{jump:.6g}; joints that dilate ever so little lock this mechanism"
        )
    unpushed = details["sequential_certified"]
    if unpushed > 1.2 * prediction.collapse_multiplier:
        out.append(
            f"the search went far below the sequence, which gives {unpushed:.6g}: joint forces that gather in a corner "
            "let a block turn there at little or no load. Few load histories lead to such forces"
        )
    if np.isfinite(problem.crushing).any():
        n = int(np.bincount(problem.points.interface).max())
        out.append(f"crushing on a grid of {n} points per interface: refine the grid to see its error")
    if (problem.tension > 0).any() or (problem.cohesion > 0).any():
        out.append("tension and cohesion are taken as perfectly plastic, and dilatancy goes on with any slip")
    if certificate.confinement > CONFINEMENT_WARNING:
        out.append(
            f"the answer rests on confining forces: the largest joint force is {certificate.confinement:.3g} times the "
            "load; check with a method that builds up stress from zero"
        )
    if problem.plane is None:
        x = problem.assembly.arrays
        limit = x.tan_phi * np.maximum(prediction.resultants.normal, 0.0) * np.sqrt(x.area)
        if (np.abs(prediction.resultants.torsion) > 0.4 * limit + 1e-6 * problem.force_scale).any():
            out.append("some faces carry more torsion than uniform pressure allows (0.38 mu N a on a square)")
    return out
