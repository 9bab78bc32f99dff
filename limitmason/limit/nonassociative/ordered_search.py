"""Search for the smallest multiplier in an order off the geometry, and its proof.

The search is :mod:`limitmason.limit.nonassociative.search`, the proof
:mod:`limitmason.limit.nonassociative.smallest_proof`.
"""

import time
from typing import Any, NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.display.progress import reached, task
from limitmason.errors import NotApplicable
from limitmason.limit.nonassociative.deadline import Deadline
from limitmason.limit.nonassociative.force_program import ForceProgram
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, exact, split, violation
from limitmason.limit.nonassociative.numbering import Numbering, numbering
from limitmason.limit.nonassociative.polish import PlanePrograms
from limitmason.limit.nonassociative.search import (
    AT_REST,
    EFFORTS,
    LARGE,
    LARGE_IN_SPACE,
    Effort,
    SearchOutcome,
    Trial,
    search_smallest,
)
from limitmason.limit.nonassociative.smallest_proof import Extreme, prove_smallest, velocity_limits
from limitmason.limit.program.static_theorem import Problem
from limitmason.mechanics.law_table import GRID, PROVEN_SMALLEST, refuse
from limitmason.storage.interrupts import ends_early

PROVEN_POINTS = {"quick": 18, "standard": 28, "thorough": 28}
"""Contact points up to which a plane problem is proven unasked: two in each of 9 joints, some tenths of a second, or of
14, a second or some. A given effort counts as the standard one."""

PROOF_SECONDS = {"quick": 5.0, "standard": 30.0, "thorough": 120.0}
"""Time for the proof by search; a given effort has that of the standard one."""

FORCE_BOUND = 20.0
"""Normal force of a contact point in total loads that a proof assumes where equilibrium leaves it unbounded."""

PROOF_TOLERANCE, SMALLEST_SCALE = 1e-5, 0.01
"""Gap between state and bound up to which the smallest counts as proven, relative to the scaled multiplier or to that
smallest scale, below which the programs' own accuracy is reached."""

WIDENINGS = 3
"""The bound on velocities of the proof, 20 mean live velocities, is widened so often tenfold where it is used."""

TOLERANCE = 1e-10
"""Of the associative program that the search starts from [-]."""


class Ordered(NamedTuple):
    """A joint law in an order read off the geometry, and that order."""

    order: Numbering
    law: JointLaw


def proof_is_tried(problem: Problem, prove: bool | None, search: str) -> bool:
    """Whether a proof is tried; a demand that cannot be met is refused.

    Parameters
    ----------
    prove : what a user asks for; None for a proof where it pays
    search : name of the search
    """
    if prove:
        if problem.plane is None:
            raise NotApplicable("prove=True: the problem is not plane; a proof needs a plane problem")
        refuse(PROVEN_SMALLEST, problem.assembly, problem.interfaces, where=GRID)
        return True
    crushes = problem.law.crushes.any() or problem.stress_block.count > 0
    few = problem.plane is not None and problem.points.count <= PROVEN_POINTS[search]
    return prove is None and few and not crushes


def search_and_prove(
    problem: Problem, law: JointLaw, effort: Effort, seconds: float, deadline: Deadline, verbose: bool, *,
    low: float, top: float, **options: Any,
) -> tuple[Ordered, SearchOutcome, Extreme | None]:
    """Search the smallest multiplier, and prove it where there is time for a proof.

    With such time a quick search comes first, then the proof. The rest of the search follows if the proof is not
    complete.

    Parameters
    ----------
    law : of the problem, in the order of its own rows
    effort : of the whole search
    seconds : for the proof, zero for none
    deadline : at which everything stops
    verbose : let the mixed-integer solver write its log
    low, top : scaled multipliers that no state passes [-]; NaN and infinite for none
    options : seed, accuracy and progress of :func:`limitmason.limit.nonassociative.search.search_smallest`

    Returns
    -------
    The law in the order in which the best state is given, the outcome, and what is proven.
    """
    options = {**options, "deadline": deadline, "floor": low if np.isfinite(low) else -np.inf}
    if not seconds:
        return *_in_order_of_geometry(problem, law, effort, **options), None
    # an effort of the user's own is done at once and whole
    first = EFFORTS["quick"] if effort in EFFORTS.values() else effort
    ordered, found = _in_order_of_geometry(problem, law, first, **options)
    if found.interrupted:
        return ordered, found, None
    # relative to the multiplier: a live load that is small beside the dead one has a small scaled multiplier
    size = 1.0 if found.best is None else float(np.clip(found.best.multiplier, SMALLEST_SCALE, 1.0))
    reached(None, f"proof, at most {seconds:g} s")
    proof: Extreme | None = None
    try:
        proof = prove_smallest(
            PlanePrograms(ordered.law), found.best, velocity_limits(problem)[ordered.order.row], low=low, top=top,
            force_bound=FORCE_BOUND, deadline=deadline.within(seconds),
            tolerance=size * PROOF_TOLERANCE, widenings=WIDENINGS, verbose=verbose,
        )
        off = np.inf if proof.state is None else violation(ordered.law, proof.state).worst
        certified = np.nan if proof.state is None else proof.state.multiplier
        trial = Trial(
            strategy=f"proof, {proof.method}", sequential=np.nan, steps=0, certified=certified, violation=off,
            seconds=proof.seconds, best=certified,
        )
        found = found._replace(best=proof.state, trials=(*found.trials, trial))
        if options["progress"] is not None:
            options["progress"](trial)
    except KeyboardInterrupt:
        ends_early()
        return ordered, found._replace(stopped=True, interrupted=True), proof
    if proof.proven or proof.none or first is effort:
        return ordered, found, proof
    other, whole = _in_order_of_geometry(problem, law, effort, **options)
    trials = (*found.trials, *whole.trials)
    if whole.best is not None and (found.best is None or whole.best.multiplier < found.best.multiplier):
        ordered, found = other, whole
        # the bound of the proof holds whatever the order
        proof = proof._replace(state=found.best)
    return ordered, found._replace(trials=trials, stopped=whole.stopped, interrupted=whole.interrupted), proof


def _in_order_of_geometry(
    problem: Problem, law: JointLaw, effort: Effort, *, deadline: Deadline, **options: Any
) -> tuple[Ordered, SearchOutcome]:
    """Search in an order read off the geometry, not from the numbers of blocks.

    A search is local, and a mirrored order of a symmetric wall ends elsewhere: where the effort asks for it both are
    searched, so that a plane wall and its mirror image give one value. In space the standard search is short where the
    associative state is admissible for every psi, and shorter than on small walls from ``LARGE_IN_SPACE`` points on.

    Parameters
    ----------
    problem : the static theorem, whose geometry gives the order
    law : of the problem, in the order of its own rows
    deadline : at which it stops
    options : accuracy, seed, floor and progress of :func:`search_smallest`

    Returns
    -------
    The law in the order whose search ended at the lower multiplier, and that outcome with the trials of both.
    """
    tried: list[tuple[Ordered, SearchOutcome]] = []
    standard = problem.plane is None and effort is EFFORTS["standard"]
    if standard and problem.points.count >= LARGE_IN_SPACE:
        effort = LARGE
    known, at_rest, interrupted = None, False, False
    for mirrored in (False, True):
        if mirrored and (not effort.mirrored or deadline.passed):
            break
        order = numbering(problem, mirrored=mirrored)
        ordered = Ordered(order, order.law(law))
        since = time.perf_counter()
        try:
            start, associative = _starting_forces(ordered.law, deadline)
        except KeyboardInterrupt:
            if not mirrored:
                raise
            interrupted = True
            ends_early()
            break
        if mirrored and deadline.passed:
            break
        # a state that keeps the law for this psi is one to begin with, ``known``; little is then tried beside it, and
        # by ``AT_REST`` nothing in the mirrored order
        if standard and not mirrored and exact(associative, ordered.law, options["accuracy"]):
            known, effort, at_rest = associative, AT_REST, True
            trial = _at_rest(ordered.law, associative, time.perf_counter() - since)
            if options["progress"] is not None:
                options["progress"](trial)
        # of two orders the first has half of the time; without a limit both have no end
        until = deadline if mirrored or not effort.mirrored else Deadline.after(0.5 * deadline.left)
        share = 0.5 if effort.mirrored else 1.0  # of the progress that is shown
        reached(share * mirrored, "mirrored" if mirrored else "", share=share)
        with task("search"):
            found = search_smallest(ordered.law, start, effort=effort, deadline=until, known=known, **options)
        if at_rest:
            found = found._replace(trials=(trial, *found.trials), at_rest=True)
        tried.append((ordered, found))
        interrupted = found.interrupted
        if found.closed or interrupted:
            break

    def height(one: tuple[Ordered, SearchOutcome]) -> float:
        """Scaled multiplier that a search ended at, infinite for none."""
        _, outcome = one
        return np.inf if outcome.best is None else outcome.best.multiplier

    ordered, best = min(tried, key=height)
    trials = tuple(t for _, outcome in tried for t in outcome.trials)
    stopped = interrupted or any(outcome.stopped for _, outcome in tried)
    return ordered, best._replace(trials=trials, stopped=stopped, interrupted=interrupted)


def _at_rest(law: JointLaw, state: ForceState, seconds: float) -> Trial:
    """The associative ``state`` as a trial of a search, which no run of its sequential scheme came to.

    ``seconds`` is what it cost [s].
    """
    return Trial(
        strategy="associative state, which slides nowhere", sequential=np.nan, steps=0, certified=state.multiplier,
        violation=violation(law, state).worst, seconds=seconds, best=state.multiplier,
    )


def _starting_forces(law: JointLaw, deadline: Deadline) -> tuple[Array, ForceState | None]:
    """Normal forces N' to start from, scaled, (m,), and the associative state.

    N' = N + t is counted from the tension corner, see :class:`JointLaw`. Where the live load has no power in the
    associative mechanism, or the solver leaves what is no number, the forces are equal ones and the state is None. The
    program ends at the ``deadline``.
    """
    _, state = ForceProgram(law, slope=law.tan_phi, tolerance=TOLERANCE, deadline=deadline).largest(law.cohesion)
    if state is None:
        return np.full(len(law.tan_phi), law.total / len(law.tan_phi)), None
    return np.maximum(split(law, state.force)[0], 0.0), state
