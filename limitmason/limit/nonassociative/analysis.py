"""Non-associative limit analysis, 0 <= psi <= phi: the smallest multiplier."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.results import FlowRule, Prediction, Status
from limitmason.arrays import Array
from limitmason.checks import choice, count, listener, positive, switch
from limitmason.display.progress import noted
from limitmason.errors import InputError
from limitmason.limit.associative import solve_associative
from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.force_program import ForceProgram
from limitmason.limit.nonassociative.joint_law import SAME_ANGLE, ForceState, JointLaw, exact, joint_law, violation
from limitmason.limit.nonassociative.ordered_search import (
    FORCE_BOUND,
    PROOF_SECONDS,
    PROVEN_POINTS,
    WIDENINGS,
    proof_is_tried,
    search_and_prove,
)
from limitmason.limit.nonassociative.polish import PlanePrograms
from limitmason.limit.nonassociative.prediction import (
    JUMP,
    LOOSE,
    METHOD,
    SMALL_DILATANCY,
    bound_alone,
    certified,
    details_of,
    prediction_of,
    without_state,
)
from limitmason.limit.nonassociative.search import (
    EFFORTS,
    USUAL_MIXING,
    Effort,
    Polisher,
    SearchOutcome,
    Trial,
    search_smallest,
)
from limitmason.limit.nonassociative.smallest_proof import prove_smallest, velocity_limits
from limitmason.limit.program.static_theorem import Problem
from limitmason.storage.interrupts import ends_early, handed_on

JUMP_POINTS = 1000
"""Contact points up to which the jump is measured unasked: beyond, it may take as long as the search."""

TOLERANCE = 1e-10
"""Of the program of Radenkovic's lower bound [-]."""

ZERO = 1e-9
"""Scaled lower bound that counts as zero [-]: an interior point leaves 1e-12 there."""


def solve_nonassociative(
    problem: Problem,
    *,
    search: str | Effort = "standard",
    seed: int = 0,
    tolerance: float = 1e-10,
    check_dead_load: bool = True,
    accuracy: float = 1e-8,
    time_limit: float | None = None,
    prove: bool | None = None,
    proof_seconds: float | None = None,
    measure_jump: bool | None = None,
    progress: Callable[[Trial], None] | None = None,
    verbose: bool = False,
) -> Prediction:
    """Extreme multiplier with equilibrium, joint law and flow rule, proven or found.

    A f + w_dead + lambda w_live = 0, |T| <= c + tan(phi) N, e_n >= tan(psi) |e_t|, and no joint force does power
    against its flow rule: N (e_n - tan(psi) |e_t|) = 0, T . e_t = -(c + tan(phi) N) |e_t|.

    Parameters
    ----------
    problem : from :func:`limitmason.limit.program.static_theorem.make_problem`
    search : "quick", "standard" or "thorough", or an :class:`~limitmason.limit.nonassociative.search.Effort`. Where a
        proof is tried the named ones begin with the quick search and go on only when the proof is not complete. In
        space the standard one is short where the associative mechanism slides nowhere, and from 700 contact points on;
        the thorough one tries everything, whatever the size. All end where the lowest state meets the lower bound
    seed : of the random starts; equal arguments give equal results unless ``time_limit`` or the time for the proof ends
    tolerance : of the interior-point method in the associative analysis that comes first [-]
    check_dead_load : also find out whether the structure stands without live load
    accuracy : violation of the true law, relative to the total load, up to which a state counts [-]
    time_limit : [s]; search and proof then end with what they have, at least one trial, and a warning says so; no
        program begins after it but the associative one and the first of the search, and those of the search go on for a
        second at most. Where no state keeps the law by then, the nearest one is returned as "time limit ended it",
        or, where that lies above it, the associative bound: neither is admissible. Ctrl-C ends search and proof in the
        same way, as "interrupted", once a mixed-integer program that runs has ended: ``certificate`` then says whether
        the state is admissible
    prove : prove the smallest multiplier by programs, which also find it where the search does not; None does so in
        plane up to 28 contact points (14 joints; 18, or 9 joints, in the quick search), without crushing; True demands
        it
    proof_seconds : time for the proof; None: 5, 30 or 120 s for the quick, standard or thorough search
    measure_jump : compare with psi slightly above zero where psi is zero; None does so in plane, up to 1000 points
    progress : called after every stage with its trial, whose text is a line with the lowest multiplier so far
    verbose : let Clarabel (associative analysis) and HiGHS (mixed-integer program) write their logs

    Returns
    -------
    Prediction
        ``details`` holds the bracket, the interval of multipliers at the mechanism found, the sequential value raw and
        certified, its steps, the spread over the candidates, the record of trials, and "proof": what is proven within
        which bounds. ``bound`` begins with "exact" where the multiplier is proven to be the smallest and with
        "estimate" elsewhere. Where psi = phi at all joints the associative prediction is returned under this method's
        name.

    Raises
    ------
    InputError
        For an unknown search, and times that are not positive.
    NotApplicable
        For in-plane sections with an exact crushing stress block, and where a proof is demanded that is not available:
        in 3-D and for joints that crush.

    Notes
    -----
    Sources: Radenkovic (1961) for the bracket; Ferris and Tin-Loi (2001) for the problem; Gilbert, Casapulla and Ahmed
    (2006) for the sequential idea. The multiplier is not unique: joint forces are statically indeterminate and their
    friction is not worked out from how they came about. The value is admissible (see the certificate), hence an upper
    bound of the smallest admissible one; on small plane structures a mixed-integer program finds that and proves it,
    within bounds on velocities that ``details["proof"]`` names. The search alone ends above it in one of ten of those.
    The search goes in an order read off the geometry: other numbers of blocks and joints end at the same value, and by
    the standard and the thorough search a plane wall and its mirror image do too.
    In 3-D the smallest admissible multiplier at psi = 0 can be zero, a block at a free end turning about one corner
    that carries all its load. Gaps in the joints of 1e-4 of a block, 20 micrometres, are enough for equilibrium to be
    lost first at that value; in most walls the motion arrests itself after millimetres, which a theory of the
    undeformed geometry does not see.
    """
    start = time.perf_counter()
    named = "standard" if isinstance(search, Effort) else choice("search", search, EFFORTS)
    effort = search if isinstance(search, Effort) else EFFORTS[named]
    positive("accuracy", accuracy)
    seed = count("seed", seed, least=0)
    listener("progress", progress, "a trial")
    for name, asked in (("prove", prove), ("measure_jump", measure_jump)):
        switch(name, False if asked is None else asked)
    for name, number in (("time_limit", time_limit), ("proof_seconds", proof_seconds)):
        if number is not None and number != np.inf:
            positive(name, number)
    deadline = Deadline.after(time_limit)
    proving = proof_is_tried(problem, prove, named)
    if proof_seconds is not None and not proving:
        raise InputError(
            "proof_seconds is given, but no proof is tried: prove=False, or not a plane problem of at most "
            f"{PROVEN_POINTS[named]} contact points without crushing; prove=True demands one in plane without crushing"
        )
    associative = bool((problem.law.tan_psi >= problem.law.tan_phi - SAME_ANGLE).all())
    law = None if associative else joint_law(problem)
    upper = solve_associative(problem, tolerance=tolerance, check_dead_load=check_dead_load, verbose=verbose)
    # with the flow rule and the solver of the associative analysis, until a search begins
    provenance = dict(upper.provenance, seed=seed, search="given" if effort is search else named)
    if law is None:
        # psi = phi: the two laws are one and the associative certificate, with its gap, says more
        return replace(upper, method=f"{METHOD} (psi = phi: associative)", provenance=provenance)
    provenance["flow_rule"] = str(FlowRule.NON_ASSOCIATIVE)
    if upper.status not in (Status.SOLVED, Status.ALMOST_SOLVED, Status.UNBOUNDED):
        return replace(upper, method=METHOD, provenance=provenance, flow_rule=FlowRule.NON_ASSOCIATIVE)
    provenance["solver"] = "clarabel" if problem.plane is None else "clarabel, HiGHS"
    low = radenkovic_lower(law, deadline)
    if proof_seconds is None:
        proof_seconds = PROOF_SECONDS[named]
    ordered, found, proof = search_and_prove(
        problem, law, effort, proof_seconds if proving else 0.0, deadline, verbose, low=low,
        top=_scaled_upper(problem, upper), seed=seed, accuracy=accuracy, progress=_told(progress, problem.live_scale),
    )
    details = details_of(problem, found, low, upper.collapse_multiplier, proof)
    state, status = _state_of(problem, ordered.law, found, upper)
    if state is None:
        provenance["seconds"] = time.perf_counter() - start
        if status == Status.NOT_CONVERGED:
            return without_state(problem, upper, proof, details, provenance)
        return bound_alone(problem, upper, details, provenance, status)
    # of no width until both of its ends are looked for
    details["interval_at_mechanism"] = (state.multiplier * problem.live_scale,) * 2
    if found.interrupted:
        status = Status.INTERRUPTED
    elif status == Status.SOLVED and not deadline.passed:
        if measure_jump is None:
            measure_jump = problem.plane is not None and problem.points.count <= JUMP_POINTS
        limits = None if proof is None else velocity_limits(problem)[ordered.order.row]
        try:
            details |= _around(problem, ordered.law, state, accuracy, deadline, limits, jump=measure_jump)
        except KeyboardInterrupt:
            ends_early()
            status, details["interrupted"] = Status.INTERRUPTED, True
    prediction = prediction_of(problem, law, ordered.order.back(law, state), status, details, provenance, search)
    prediction = certified(problem, prediction)
    provenance["seconds"] = time.perf_counter() - start
    return prediction


def _state_of(
    problem: Problem, law: JointLaw, found: SearchOutcome, upper: Prediction
) -> tuple[ForceState | None, Status]:
    """State that a search is answered with, or None, and the status of the answer.

    The lowest exact state is preferred, then one that nearly keeps the law. If the search was ended before it had
    either, the state that violates the law least is taken, unless it lies above the associative bound.

    Parameters
    ----------
    law : in the order of ``ordered_search.Ordered``, as the states of ``found``
    found : outcome of the search
    upper : the associative answer
    """
    nearest = found.nearest
    if found.best is not None:
        return found.best, Status.SOLVED
    if nearest is not None and violation(law, nearest).worst <= LOOSE:
        return nearest, Status.ALMOST_SOLVED
    if not found.stopped or upper.status == Status.UNBOUNDED:
        return None, Status.NOT_CONVERGED
    if nearest is not None and nearest.multiplier * problem.live_scale > upper.collapse_multiplier:
        nearest = None
    return nearest, Status.INTERRUPTED if found.interrupted else Status.TIME_ENDED


def _told(progress: Callable[[Trial], None] | None, scale: float) -> Callable[[Trial], None]:
    """What a search calls after a trial: the progress bar and ``progress``.

    A search sees scaled multipliers and begins anew in the mirrored order. The user is told multipliers of the live
    load, and the lowest over both orders.

    Parameters
    ----------
    scale : multiplier over scaled multiplier [-]
    """
    lowest = float("nan")

    def tell(trial: Trial) -> None:
        """Tell of one trial."""
        nonlocal lowest
        trial = trial.times(scale)
        lowest = float(np.fmin(lowest, trial.best))
        noted(f"lowest so far {lowest:.5g}")
        if progress is not None:
            progress(trial._replace(best=lowest))

    return tell


def radenkovic_lower(law: JointLaw, deadline: Deadline = NEVER) -> float:
    """Radenkovic's lower bound: scaled associative multiplier for friction tan(psi).

    The law |T| <= c' + tan(psi) N' lies inside the true one. It is NaN where no forces are found within it, also when a
    program ends at the ``deadline``, and 0 up to ``ZERO``.

    Notes
    -----
    Source: Radenkovic's second theorem. Both laws share the tension corner: with tension, tan(psi) N + c A would lie
    outside the true law below N = 0.
    """
    status, state = ForceProgram(law, slope=law.tan_psi, tolerance=TOLERANCE, deadline=deadline).largest(law.cohesion)
    if state is None or status not in ("Solved", "AlmostSolved"):
        return float("nan")
    return 0.0 if abs(state.multiplier) < ZERO else state.multiplier


def _scaled_upper(problem: Problem, upper: Prediction) -> float:
    """Scaled multiplier that no state passes [-], from the associative answer.

    It is proven by the mechanism of ``upper``, and infinite where there is no certificate or no bound.
    """
    c = upper.certificate
    value = c.kinematic_multiplier if c is not None else np.inf
    return max(value, upper.collapse_multiplier) / problem.live_scale if np.isfinite(value) else np.inf


def _around(
    problem: Problem, law: JointLaw, state: ForceState, accuracy: float, deadline: Deadline, limits: Array | None, *,
    jump: bool,
) -> dict[str, Any]:
    """Entries of the details: multipliers at the mechanism, and at a little dilatancy.

    Parameters
    ----------
    law, state : in the order of ``ordered_search.Ordered``, read off the geometry
    accuracy : violation that counts as none [-]
    deadline : of the whole analysis
    limits : bounds on velocities for a proof with a little dilatancy, shape (r,), in the same order; None for no proof
    jump : whether the multiplier with a little dilatancy is looked for
    """
    ends = Polisher(law, accuracy, deadline=deadline).multiplier_interval(state)
    out: dict[str, Any] = {"interval_at_mechanism": tuple(e * problem.live_scale for e in ends)}
    if jump and not deadline.passed and (law.tan_psi[law.tan_phi > 0] == 0).any():
        with handed_on():
            scaled = _at_small_dilatancy(law, state, accuracy, deadline, limits)
            out["at_small_dilatancy"] = scaled * problem.live_scale
    return out


def _at_small_dilatancy(
    law: JointLaw, state: ForceState, accuracy: float, deadline: Deadline, limits: Array | None
) -> float:
    """Smallest scaled multiplier [-] of a short search with a little dilatancy, or NaN.

    Joints without dilatancy get tan(psi) = ``SMALL_DILATANCY`` tan(phi). With ``limits`` a value that is a jump, more
    than ``JUMP`` above that of ``state``, is returned only where it is proven: a search that ends high would feign one.
    A lower value feigns none and needs no proof. It is NaN where the deadline ends the search.

    Parameters
    ----------
    law, state : without dilatancy, in the order of ``ordered_search.Ordered``, read off the geometry
    accuracy : violation that counts as none [-]
    deadline : of the whole analysis
    limits : bounds on velocities for a proof, shape (r,), in the same order; None for no proof
    """
    little = law._replace(tan_psi=np.where(law.tan_psi == 0, SMALL_DILATANCY * law.tan_phi, law.tan_psi))
    normal = np.maximum(state.force[:: law.components], 0.0)
    # one slope, below the dilatancy that it must not hide; one mixing; no random starts and no pushes
    effort = Effort(
        slopes=(0.1 * SMALL_DILATANCY,), mixings=(USUAL_MIXING,), random_starts=0, pushes=(), lower_each=False
    )
    found = search_smallest(little, normal, effort=effort, accuracy=accuracy, deadline=deadline)
    if found.stopped:
        return float("nan")
    best = found.best
    if limits is not None:
        near = Polisher(little, accuracy, deadline=deadline).exact_near(state)
        if exact(near, little, accuracy) and (best is None or near.multiplier < best.multiplier):
            best = near
        if best is None or best.multiplier > state.multiplier * (1.0 + JUMP):
            proof = prove_smallest(
                PlanePrograms(little), best, limits, force_bound=FORCE_BOUND, widenings=WIDENINGS,
                deadline=deadline.within(PROOF_SECONDS["quick"]),
            )
            best = proof.state if proof.proven else None
    return float("nan") if best is None else best.multiplier
