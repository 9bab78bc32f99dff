"""Between which multipliers all states of a small plane structure lie, by proof."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from limitmason.answers.results import Prediction, Status
from limitmason.arrays import Array
from limitmason.checks import choice, count, finite, positive, several
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.limit.associative import solve_associative
from limitmason.limit.nonassociative.analysis import radenkovic_lower
from limitmason.limit.nonassociative.deadline import Deadline
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, exact, from_corner, joint_law
from limitmason.limit.nonassociative.mixed_integer import BoundedProgram
from limitmason.limit.nonassociative.polish import ACTIVE, PlanePrograms
from limitmason.limit.nonassociative.search import EFFORTS, search_smallest
from limitmason.limit.nonassociative.smallest_proof import (
    ACCURACY,
    ASSOCIATIVE,
    MARGIN,
    MIXED_INTEGER,
    Extreme,
    close,
    prove_smallest,
    velocity_limits,
)
from limitmason.limit.program.static_theorem import Problem, make_problem
from limitmason.mechanics.contact_points import Grid, chosen_grid
from limitmason.mechanics.law_table import GRID, PROVEN_RANGE, refuse
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.interrupts import handed_on

ENDS = ("smallest", "largest")

ALL_USED = 1.0 - 1e-6
"""Share of the velocity bound from which it is said to be reached [-]: less than one by the solver's accuracy."""

LARGEST_SECONDS = 1.0
"""Time that the program for the largest multiplier gets at least [s]: chosen."""


@dataclass(frozen=True, eq=False)
class ProvenRange:
    """Range of all admissible multipliers between zero and the associative value.

    Parameters
    ----------
    smallest, largest : multipliers of certified states at the ends [-]; NaN where not asked for
    ends : what is proven of each, by name
    associative : upper bound for every flow rule between psi and phi, infinite where there is none [-]
    velocity_bound, force_bound : stated bounds, where an end needs them
    seconds : of everything
    """

    smallest: float
    largest: float
    ends: Mapping[str, Extreme]
    associative: float
    velocity_bound: float
    force_bound: float
    seconds: float

    @property
    def proven(self) -> bool:
        """Whether every end asked for is proven."""
        return all(e.proven for e in self.ends.values())

    def __str__(self) -> str:
        """What is proven, in words."""
        lines = [f"associative value {self.associative:.6f}: no flow rule between psi and phi admits more (Radenkovic)"]
        if np.isinf(self.associative):
            lines = ["associative value without end: it sets no upper end for other flow rules"]
        for name, end in self.ends.items():
            side = "below" if name == "smallest" else "above"
            within = "without bounds on forces or velocities"
            if end.velocity_bounded:
                within = (
                    f"for velocities up to {self.velocity_bound:g} times the mean live velocity "
                    f"({'reached' if end.velocity_share > ALL_USED else f'{end.velocity_share:.2f} of it used'})"
                )
                if end.force_bounded:
                    within += f" and joint forces up to {self.force_bound:g} times the load"
            unproven = "" if end.proven else " found, not proven"
            lines.append(f"{name} {end.value:.6f}{unproven}: nothing {side} {end.bound:.6f} {within}; {end.method}")
        return "\n".join(lines)


@of_model
@watched("proven range")
def proven_range(
    assembly: Assembly,
    loads: Loads,
    *,
    velocity_bound: float = 20.0,
    force_bound: float = 20.0,
    time_limit: float = 120.0,
    which: tuple[str, ...] = ENDS,
    tolerance: float = 1e-5,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] | None = None,
    search: str = "quick",
    seed: int = 0,
) -> ProvenRange:
    """Smallest and largest multiplier that the non-associative law admits, with proof.

    min, max lambda subject to A f + w_dead + lambda w_live = 0, the joint law, its flow rule and complementarity, for
    0 <= lambda <= the associative value. The smallest value is bounded by the lifted linear program, and where that
    leaves a gap, like the largest, by a mixed-integer program within the stated bounds.

    Parameters
    ----------
    assembly, loads : a plane problem of a few blocks
    velocity_bound : largest velocity component of a centroid, and rotation times the distance of the block's farthest
        contact point, in mean live velocities [-]
    force_bound : largest normal force of a contact point in total loads, used only where equilibrium leaves the forces
        unbounded [-]
    time_limit : for each end [s]; what is proven until then is returned
    which : "smallest", "largest" or both
    tolerance : between state and bound to call an end proven, relative to max(1, lambda) [-]
    contact_model, grid : see :func:`limitmason.limit.limit_analysis`
    search, seed : for the state to begin with, see
        :func:`limitmason.limit.nonassociative.analysis.solve_nonassociative`

    Returns
    -------
    ProvenRange
        Its text says in words what is proven within which bounds.

    Raises
    ------
    InputError
        For settings that make no sense.
    NotApplicable
        For a problem that is not plane, and joints that crush.
    NotConverged
        For a structure that cannot stand, the largest multiplier of one without a finite associative one, and where no
        admissible state is found.

    Notes
    -----
    Sources: Radenkovic (1961) for the associative end, Sherali and Adams (1990) for the lifted program. Proofs are
    numerical, to about 1e-6, with HiGHS. Cohesion and tension are perfectly plastic, residual values are left out.
    Velocities far above the mean live velocity belong to mechanisms in which the live load hardly moves anything; raise
    the bound when it is reached.
    """
    began = time.perf_counter()
    if isinstance(which, str):
        which = (which,)
    which = several("which", which, str)
    if not which or not set(which) <= set(ENDS):
        raise InputError(f"which must hold names of {ENDS}, got {which!r}")
    seed = count("seed", seed, least=0)
    if not finite("velocity_bound", velocity_bound) > 1:
        raise InputError(f"velocity_bound must exceed the mean live velocity, 1, got {velocity_bound}")
    choice("search", search, EFFORTS)
    for label, number in (("force_bound", force_bound), ("time_limit", time_limit), ("tolerance", tolerance)):
        positive(label, number)
    problem = make_problem(assembly, loads, contact_model=contact_model, grid=chosen_grid(contact_model, grid))
    if problem.plane is None:
        raise NotApplicable(
            "a proven range needs a plane problem: blocks, interfaces and loads symmetric about one plane"
        )
    refuse(PROVEN_RANGE, assembly, problem.interfaces, where=GRID)
    bounded = partial(ProvenRange, velocity_bound=velocity_bound, force_bound=force_bound)
    law, ends = joint_law(problem), {}
    upper = _associative_end(problem, law, which)
    scale = problem.live_scale
    top = np.inf if upper.status == Status.UNBOUNDED else upper.collapse_multiplier / scale
    if law.dilatant.all():  # psi = phi everywhere: the associative multiplier is the only one
        value = upper.collapse_multiplier
        state = ForceState(value, np.zeros(0), np.zeros(0))
        ends = dict.fromkeys(which, Extreme(state, value, proven=True, method=ASSOCIATIVE))
        low, high = (value if name in which else float("nan") for name in ENDS)
        return bounded(smallest=low, largest=high, ends=ends, associative=value, seconds=time.perf_counter() - began)

    with handed_on():  # Ctrl-C ends the whole, not the search alone
        start = _starting_forces(problem, law, upper)
        found = search_smallest(law, start, effort=EFFORTS[search], seed=seed).best
    programs = PlanePrograms(law)
    lowest: Extreme | None = None
    if found is None or "smallest" in which:
        # where the search finds no state, the program for the smallest looks for the first one
        reached(0.0, f"the smallest multiplier, at most {time_limit:g} s")
        lowest = prove_smallest(
            programs, found, velocity_limits(problem), low=radenkovic_lower(law), top=top,
            velocity_bound=velocity_bound, force_bound=force_bound, deadline=Deadline.after(time_limit),
            tolerance=tolerance,
        )
        found = lowest.state
    if found is None:
        none = lowest is not None and lowest.none
        raise NotConverged(
            f"no admissible state exists with velocities up to {velocity_bound:g} times the mean live velocity"
            if none
            else "no admissible state was found to begin with; try search='thorough' or a longer time_limit"
        )
    for number, name in enumerate(which):
        since = time.perf_counter()
        reached(number / len(which), f"the {name} multiplier, at most {time_limit:g} s")
        if lowest is not None and name == "smallest":
            end = lowest
            since -= lowest.seconds  # it was proven above
        else:
            limits = velocity_limits(problem, velocity_bound)
            end = _largest(programs, found, top, limits, force_bound, Deadline.after(time_limit), tolerance)
        ends[name] = end.times(scale)._replace(seconds=time.perf_counter() - since)
    low, high = (ends[name].value if name in ends else float("nan") for name in ENDS)
    seconds = time.perf_counter() - began
    return bounded(smallest=low, largest=high, ends=ends, associative=top * scale, seconds=seconds)


def _starting_forces(problem: Problem, law: JointLaw, upper: Prediction) -> Array:
    """Normal forces N' to begin a search with, scaled, (m,), of the answer ``upper``.

    They are all equal where it has no forces.
    """
    normal = np.full(len(law.tan_phi), law.total / len(law.tan_phi))
    if upper.resultants is not None:
        normal = (upper.resultants.point_force * problem.points.directions[:, 0]).sum(axis=1) / problem.force_scale
    return from_corner(law, normal)


def _associative_end(problem: Problem, law: JointLaw, which: tuple[str, ...]) -> Prediction:
    """The associative answer, an end of the range, or refused where there is no range.

    ``which`` are the names of the ends that are asked for.
    """
    upper = solve_associative(problem)
    endless, only = upper.status == Status.UNBOUNDED, law.dilatant.all()
    if not endless and (upper.status not in (Status.SOLVED, Status.ALMOST_SOLVED) or upper.resultants is None):
        raise NotConverged(f"the associative analysis ended '{upper.status}': there is no range to prove")
    if endless and ("largest" in which or only):
        raise NotConverged(
            "the associative multiplier has no end, so that no largest one is found; "
            + ("psi = phi: there is no other" if only else "ask for which='smallest'")
        )
    return upper


def _largest(
    programs: PlanePrograms, found: ForceState, top: float, limits: Array, force: float, deadline: Deadline,
    tolerance: float,
) -> Extreme:
    """Largest admissible scaled multiplier: state, bound above, whether they agree.

    If forces that comply with the mechanism found reach the associative multiplier, no larger one exists. Else the
    mixed-integer program looks for one.

    Parameters
    ----------
    programs : of the plane problem
    found : an exact state to begin from
    top : associative multiplier, scaled [-]
    limits : bounds on velocities at mean live velocity one, shape (r,)
    force : bound on joint forces, over the total load [-]
    deadline : of the mixed-integer program
    tolerance : difference of two multipliers that counts as none, relative to max(1, lambda) [-]
    """
    # theta = -1 asks for the largest multiplier; slacks of pairs whose rate is used are zero: these forces comply
    answer = programs.forces(theta=-1.0, zero=programs.rates(found.velocity) > ACTIVE)
    best = found if answer is None else ForceState(answer.multiplier, answer.force, found.velocity)
    if close(best.multiplier, top, tolerance):
        return Extreme(best, top, proven=True, method=ASSOCIATIVE)
    share = float(np.max(np.abs(best.velocity) / limits))
    program = BoundedProgram(programs, best.multiplier - MARGIN, top + MARGIN, limits, force)
    # a tenth of the tolerance, so that its gap does not use up what state and bound may differ by
    proof = program.solve(best, largest=True, time_limit=deadline.at_least(LARGEST_SECONDS), gap=0.1 * tolerance)
    if exact(proof.state, programs.law, ACCURACY) and proof.state.multiplier > best.multiplier:
        best = proof.state
    value = best.multiplier
    within: dict[str, Any] = {"velocity_bounded": True, "force_bounded": proof.forces_assumed, "nodes": proof.nodes}
    if proof.infeasible and share > 1.0:
        # the state found moves faster than the bound, and no slower one lies above it
        return Extreme(best, value, proven=True, method=MIXED_INTEGER, velocity_share=share, **within)
    # the solver contradicts a certified state: what it says counts for nothing
    contradicted = proof.infeasible or (proof.bound < value - tolerance * max(1.0, value) and share <= 1.0)
    met = close(value, proof.bound, tolerance)
    if contradicted or (proof.bound >= top - tolerance and not met):
        return Extreme(best, top, proven=False, method=ASSOCIATIVE, nodes=proof.nodes)
    return Extreme(best, proof.bound, proven=met, method=MIXED_INTEGER, velocity_share=proof.velocity_share, **within)
