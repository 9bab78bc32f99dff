"""Proof of the smallest multiplier of a plane structure: what lies below.

Branch and bound is in :mod:`limitmason.limit.nonassociative.mixed_integer`, by HiGHS, a bound without stated bounds on
forces and velocities in :mod:`limitmason.limit.nonassociative.lifted`.
"""

import time
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, exact
from limitmason.limit.nonassociative.lifted import MAX_ROWS, lifted_bound, lifted_rows
from limitmason.limit.nonassociative.mixed_integer import BoundedProgram
from limitmason.limit.nonassociative.polish import PlanePrograms
from limitmason.limit.program.static_theorem import Problem

ASSOCIATIVE = "associative"
LIFTED = "lifted linear program"
MIXED_INTEGER = "mixed-integer program"

ACCURACY = 1e-8
"""Violation of the true law up to which a state of the mixed-integer program counts."""

REACHED = 0.5
"""Share of the velocity bound from which the bound may hide lower states and is widened where that is allowed."""

WIDER = 10.0
"""Times that a velocity bound is widened by: chosen."""

MARGIN = 1e-6
"""Scaled multiplier added to both ends of the range of a program [-], so that rounding excludes no state at its end."""


class Extreme(NamedTuple):
    """Lowest (or highest) exact state known, and the multiplier with none beyond."""

    state: ForceState | None
    bound: float
    proven: bool  # state and bound agree within the tolerance asked for
    method: str  # what gave the bound
    none: bool = False  # there is no admissible state at all within the bounds
    velocity_bounded: bool = False  # the bound holds only within velocity_bound
    velocity_bound: float = float("nan")  # in mean live velocities
    velocity_share: float = float("nan")  # largest velocity of the state over its bound; near one it may hide others
    force_bounded: bool = False  # a stated bound on the joint forces was needed too
    nodes: int = 0  # of the mixed-integer programs
    seconds: float = 0.0  # [s]

    @property
    def value(self) -> float:
        """Multiplier of the state, NaN without one."""
        return float("nan") if self.state is None else self.state.multiplier

    @property
    def gap(self) -> float:
        """Distance between state and bound, or infinite without a state."""
        return np.inf if self.state is None else abs(self.value - self.bound)

    def times(self, scale: float) -> "Extreme":
        """This extreme with multiplier and bound in units of the live load, by a scale."""
        state = None if self.state is None else self.state._replace(multiplier=self.value * scale)
        return self._replace(state=state, bound=self.bound * scale)


class _Within(NamedTuple):
    """A bound that holds within stated velocities only."""

    bound: float  # scaled multiplier [-]
    velocity_bound: float  # in mean live velocities
    forces_bounded: bool  # it rests on a bound on joint forces as well


def velocity_limits(problem: Problem, velocity_bound: float = 1.0) -> Array:
    """Bound of every scaled velocity of a plane problem, shape (r,).

    A rotation counts times the distance of the block's farthest contact point.

    Parameters
    ----------
    velocity_bound : largest velocity of a contact point by a translation or a turn, over the mean live velocity [-]
    """
    points = problem.points
    reach = np.zeros(problem.assembly.n_blocks)
    for block in (points.block_a, points.block_b):
        distance = np.linalg.norm(points.position - problem.assembly.centroids[block], axis=1)
        np.maximum.at(reach, block, distance)
    block, coordinate = np.divmod(problem.row, 3)  # in plane: two translations and a turn
    limit = np.full(len(problem.row), float(velocity_bound))
    turns = coordinate == 2
    # a block without contact points, of reach zero, may turn without limit
    limit[turns] *= problem.row_radius[turns] / np.maximum(reach[block[turns]], 1e-300)
    return limit


def close(value: float, bound: float, tolerance: float) -> bool:
    """Whether a multiplier meets a bound [-], within ``tolerance`` of max(1, value)."""
    return bool(np.isfinite(value) and abs(value - bound) <= tolerance * max(1.0, abs(value)))


def prove_smallest(
    programs: PlanePrograms, found: ForceState | None, limits: Array, *, low: float = 0.0, top: float = np.inf,
    velocity_bound: float = 20.0, force_bound: float = 20.0, deadline: Deadline = NEVER, tolerance: float = 1e-5,
    widenings: int = 0, verbose: bool = False,
) -> Extreme:
    """Prove the smallest multiplier: lower bounds in turn, until one meets a state.

    They are Radenkovic's, that of the lifted program, and that of mixed-integer programs, which may also find lower
    states.

    Parameters
    ----------
    programs : of a plane problem without crushing
    found : exact state to begin with, or None: the mixed-integer program then looks for the first one
    limits : from :func:`velocity_limits` with a bound of one, in the order of the programs' rows
    low, top : scaled multipliers that no state passes: Radenkovic's bounds; NaN for none below
    velocity_bound, force_bound : see :func:`limitmason.limit.range.proven_range`
    deadline : after which no further program begins, and at which one that runs ends
    tolerance : between state and bound to call it proven, relative to max(1, lambda) [-]
    widenings : times that the velocity bound is made ten times as wide at most, where the state uses more than half
    verbose : let the mixed-integer solver write its log

    Returns
    -------
    Extreme: state and bound, scaled.
    """
    began = time.perf_counter()
    law = programs.law
    floor, method = (low if np.isfinite(low) else 0.0), ASSOCIATIVE  # bound for any velocities, and what gave it
    best, value = found, np.inf if found is None else found.multiplier
    # states above the one at hand are of no interest: the tighter range makes both programs sharper
    high = min(top, value) + MARGIN
    small = np.isfinite(high) and lifted_rows(programs) <= MAX_ROWS
    if small and not close(value, floor, tolerance) and not deadline.passed:
        lifted = lifted_bound(programs, 0.0, high, deadline)
        if floor < lifted.value <= value + tolerance:
            floor, method = lifted.value, LIFTED
    within: _Within | None = None
    # share: largest velocity of the best state over its bound; none: whether there is no state within the bounds
    share, nodes, none = _share(law, best, velocity_bound * limits), 0, False
    while not close(value, floor, tolerance) and not deadline.passed:
        while share > REACHED and widenings > 0:
            velocity_bound, share, widenings = WIDER * velocity_bound, (1.0 / WIDER) * share, widenings - 1
        # the bound so far holds for any velocities: the program need not look below it
        program = BoundedProgram(
            programs, max(floor, 0.0) - MARGIN, min(top, value) + MARGIN, velocity_bound * limits, force_bound
        )
        # a tenth of the tolerance, so that its gap does not use up what state and bound may differ by
        proof = program.solve(best, time_limit=deadline.at_least(), gap=0.1 * tolerance, verbose=verbose)
        nodes += proof.nodes
        if exact(proof.state, law, ACCURACY) and proof.state.multiplier < value:
            best, value = proof.state, proof.state.multiplier
            share = _share(law, best, velocity_bound * limits)
        if proof.infeasible:
            # only a state that moves faster than the bound is not in the program: any other contradicts the solver
            none = best is None
            if best is not None and share > 1.0:
                within = _Within(value, velocity_bound, proof.forces_assumed)
            break
        # a bound above a state that the program contains contradicts the solver: it counts for nothing
        if proof.bound > value + tolerance * max(1.0, value) and share <= 1.0:
            break
        reached = min(proof.bound, value)
        met = close(value, reached, tolerance)
        if met or (within is None and reached > floor + tolerance):
            within = _Within(reached, velocity_bound, proof.forces_assumed)
        if not met or share <= REACHED or widenings == 0:
            break
    seconds = time.perf_counter() - began
    if within is None:
        proven = best is not None and close(value, floor, tolerance)
        return Extreme(
            state=best, bound=floor, proven=proven, method=method, none=none, velocity_bounded=none,
            velocity_bound=velocity_bound, force_bounded=none, nodes=nodes, seconds=seconds,
        )
    share = _share(law, best, within.velocity_bound * limits) if best is not None else float("nan")
    proven = best is not None and close(value, within.bound, tolerance)
    return Extreme(
        state=best, bound=within.bound, proven=proven, method=MIXED_INTEGER, velocity_bounded=True,
        velocity_bound=within.velocity_bound, velocity_share=share, force_bounded=within.forces_bounded, nodes=nodes,
        seconds=seconds,
    )


def _share(law: JointLaw, state: ForceState | None, limits: Array) -> float:
    """Largest velocity of a state over its bound [-], 0 without one; ``limits`` (r,)."""
    if state is None:
        return 0.0
    return float(np.max(np.abs(state.velocity) * (law.live_size / (law.live @ state.velocity)) / limits))
