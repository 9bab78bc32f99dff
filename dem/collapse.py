"""Collapse multiplier by the DEM with its own error budget: stiffness, contact points and rate."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from dem.joints import JointOptions, losses
from dem.search import Controls, Search, increments, ramps
from dem.state import QUASI_STATIC, State, make_state
from dem.stepping import EQUILIBRIUM, UNDECIDED, Verdict, smallest_edge
from limitmason.certificate import certify
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Damping
from limitmason.results import (
    ALMOST_SOLVED,
    NOT_CONVERGED,
    SOLVED,
    UNBOUNDED,
    Bound,
    BoundKind,
    ContactModel,
    Prediction,
)
from limitmason.stated import states

Grid = tuple[int, int]

INCREMENTS, RAMP = "increments", "ramp"
CHECKS = ("stiffness", "contact points", "rate")

LOADING = Damping(local=0.4, kinetic=True)
RAMPING = Damping(local=0.5)


@states("dem")
def collapse(
    assembly: Assembly,
    loads: Loads,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 8),
    contact_model: str = "grid",
    method: str = INCREMENTS,
    tolerance: float | None = None,
    error_budget: tuple[str, ...] = CHECKS,
    joint_options: JointOptions | None = None,
    first_increment: float | None = None,
    max_steps: int = 60_000,
    moved_limit: float = 0.02,
    equilibrium: float = 1e-4,
    ramp_steps: int | None = None,
    damping: Damping | None = None,
    progress: Callable[[float, Verdict], object] | None = None,
) -> Prediction:
    """Collapse multiplier of an assembly by the explicit distinct element method, quasi-static.

    The structure settles under the dead load and the live load grows until the blocks keep moving.

    Parameters
    ----------
    contact_points : points along the unit and across the thickness of every interface, one pair, or one per kind
        ("bed", "head", "base") or per wall by how its blocks' names begin ({"facade": (2, 8), "return": (2, 2)}; a
        joint between two walls takes the finer); at psi < phi torsion needs about 8 across
    contact_model : "grid", or "vertices" for corners only
    method : "increments" holds each load until force and moment are small in four checks in a row, restores the last
        equilibrium when the blocks keep moving and halves the increment; "ramp" raises the load steadily, reads the
        largest multiplier at the supports as max(Rh / Rv) does, repeats at half speed and extrapolates to none, until
        that changes by < 1 %
    tolerance : width of the final bracket over the multiplier [-], 0.005 by default; increments only
    error_budget : what to repeat the search with: "stiffness" (kn, ks x 10), "contact points" (x 2) and "rate"
        (increments half as long; a ramp at half speed). The repeats start near the multiplier found and close in on it
        to twice ``tolerance``; all three together take two to four times as long as the search. () for none
    joint_options : limits of dilation, softening lengths
    first_increment : first step of the multiplier; a twentieth of that at which live equals dead load by default
    max_steps : budget for one load, up to three times that while it is still on its way to a verdict; when it runs out
        the load is "undecided", never counted as stable
    moved_limit : displacement that counts as collapse, over the smallest block dimension [-]
    equilibrium : largest unbalanced force of every block over its own load, and moment over that load times its least
        thickness [-]; a twentieth of the load increment where that is less
    ramp_steps : steps in which a ramp reaches the estimate of the multiplier, 40,000 by default; ramps only
    progress : called with every load tried and its verdict
    damping : while loading; local 0.4 with stops at peaks of the kinetic energy, given up for local 0.6 in a load that
        has not settled after 8000 steps (increments), or 0.5 (ramp)

    Returns
    -------
    Prediction
        ``collapse_multiplier`` is the largest load found in equilibrium (increments) or the largest one measured at
        the supports (ramp). ``interval`` is the bracket, widened on each side by what the brackets of the repeats
        reach beyond it there, and below by what forces still unbalanced carry in the mechanism. ``details`` holds the
        bracket, every load tried, undecided loads and the error budget.
        "Almost solved" is a bracket wider than asked for, because loads in it stayed undecided.

    Raises
    ------
    ValueError
        For unknown methods or checks, no live load, and what :func:`dem.state.make_state` refuses.

    Notes
    -----
    The flow rule is that of the joints: psi = 0 unless they dilate. Finite stiffness lowers the multiplier of slender
    walls (bending before collapse), and torsion depends on the contact points: the error budget says by how much. It
    is an estimate, not a bound. Source of the procedure: Godio, Stefanou, Sab 2017, eq. 5.
    """
    if method not in (INCREMENTS, RAMP):
        raise InputError(f"method must be {INCREMENTS!r} or {RAMP!r}, got {method!r}")
    if tolerance is not None and method == RAMP:
        raise InputError(f"tolerance is for method={INCREMENTS!r}; ramps are slowed until lambda changes by under 1 %")
    tolerance = 5e-3 if tolerance is None else tolerance
    if ramp_steps is not None and method != RAMP:
        raise InputError(f"ramp_steps is for method={RAMP!r}; {method!r} holds loads one after the other")
    if isinstance(error_budget, str):
        raise InputError(f"error_budget must be several of {', '.join(CHECKS)}, such as ({error_budget!r},)")
    for check in error_budget:
        if check not in CHECKS:
            raise InputError(f"unknown check {check!r} in error_budget; known: {', '.join(CHECKS)}")
    unit = _unit(assembly, loads)
    if not tolerance > 0:
        raise InputError(f"tolerance must be positive, got {tolerance!r}")
    begun = time.perf_counter()
    first = first_increment if first_increment is not None else 0.05 * unit
    controls = Controls(
        tolerance, max_steps, moved_limit, equilibrium, damping or (LOADING if method == INCREMENTS else RAMPING),
        40_000 if ramp_steps is None else ramp_steps, unit, first, progress,
    )  # fmt: skip
    options = joint_options or JointOptions()

    def start(points: Any = contact_points, model: str = contact_model, law: JointOptions = options) -> State:
        return make_state(
            assembly, loads, contact_points=points, contact_model=model, joint_options=law, mode=QUASI_STATIC
        )

    search = increments if method == INCREMENTS else ramps
    found = search(assembly, loads, start(), controls)
    budget: dict[str, dict[str, Any]] = {}
    warnings = [*found.state.warnings, *assembly.contact_warnings]
    if found.status in (SOLVED, ALMOST_SOLVED):
        for check in error_budget:
            changed = start()
            # ten times as stiff, a joint gives a tenth as much before it moves on
            near = replace(
                controls, tolerance=2.0 * tolerance, moved_limit=(0.3 if check == "stiffness" else 1.0) * moved_limit
            )
            if check == "stiffness":
                changed = start(law=replace(options, stiffness_factor=10.0 * options.stiffness_factor))
            elif check == "contact points":
                changed = start(points=_doubled(contact_points), model="grid")
            if method == RAMP:
                again = _ramp_again(assembly, loads, changed, found, near, check)
            elif check == "rate":
                again = _at_half_rate(assembly, loads, found, near)
            else:
                guess = found.stable
                again = increments(assembly, loads, changed, near, through=[0.5 * guess, 0.9 * guess, guess])
            decided = again.status in (SOLVED, ALMOST_SOLVED)
            budget[check] = {
                "multiplier": again.stable,
                "change": again.stable / found.stable - 1.0 if found.stable and decided else float("nan"),
                "smallest moving": again.moving,
                "resolution": again.moving / again.stable - 1.0 if again.stable and method == INCREMENTS else 0.0,
                "steps": again.steps,
                "status": again.status,
            }
            if "interrupted" in again.details:
                warnings.append(f"interrupted while the search was repeated for the {check}: the budget is incomplete")
                del budget[check]
                break
            if again.status not in (SOLVED, ALMOST_SOLVED):
                warnings.append(f"error budget: undecided with {check} changed ({again.status})")
            elif not abs(budget[check]["change"]) <= 0.03:
                warnings.append(
                    f"the multiplier changes by {100 * budget[check]['change']:+.1f} % with {check} changed: it is not "
                    "converged in this respect"
                )
    if "interrupted" in found.details:
        warnings.append(f"interrupted while holding {found.details['interrupted']:.5g}: the bracket is not closed")
    undecided = [value for value, verdict in found.record if verdict.outcome == UNDECIDED]
    between = [u for u in undecided if found.stable < u < found.moving]
    if between and found.status != NOT_CONVERGED:
        warnings.append(
            f"undecided after {max_steps} steps and more at {', '.join(f'{u:.5g}' for u in between)}; not counted as "
            f"stable (least balanced: block {_least_balanced(assembly, found, between[-1])})"
        )
    swayed = max((v.moved for load, v in found.record if load and v.outcome == EQUILIBRIUM), default=0.0)
    share = swayed / (moved_limit * smallest_edge(assembly))
    if method == INCREMENTS and share > 0.5:
        warnings.append(
            f"a load in equilibrium moved a block by {swayed:.2g} m, {share:.0%} of what counts as collapse: with "
            f"joints as soft as these raise moved_limit ({moved_limit:g})"
        )
    answered = found.status in (SOLVED, ALMOST_SOLVED, NOT_CONVERGED)
    prediction = Prediction(
        method=f"dem, {method}",
        collapse_multiplier=found.stable if answered else
        float("inf") if found.status == UNBOUNDED else float("nan"),
        bound=Bound(BoundKind.ESTIMATE, "estimate for joints of finite stiffness with their own dilatancy angles"),
        status=found.status,
        resultants=found.state.resultants(assembly) if answered else None,
        warnings=tuple(warnings),
        provenance={
            "method": method, "contact points": contact_points, "contact model": contact_model,
            "tolerance": tolerance, "steps": found.steps, "seconds": time.perf_counter() - begun,
            "damping": controls.damping, "moved limit": moved_limit,
        },
        details={
            "largest stable": found.stable, "smallest moving": found.moving, "undecided": undecided,
            "loads tried": [(value, v.outcome, v.steps) for value, v in found.record], "error budget": budget,
            "interval": _interval(found, budget, _unbalanced(assembly, loads, found)),
            "steps": found.steps, **found.details,
        },
        contact_model=ContactModel(contact_model), error_budget=budget,
        lost_in_failure=losses(assembly, found.state.laws),
    )  # fmt: skip
    if prediction.resultants is not None and method == INCREMENTS:
        prediction = replace(prediction, certificate=certify(assembly, loads, prediction, convex=False))
    return replace(prediction, mechanism=found.mechanism)


def _ramp_again(assembly: Assembly, loads: Loads, state: State, found: Search, c: Controls, check: str) -> Search:
    """Ramps in a changed model from the third slowest speed down; for the rate, the last change with it."""
    if check == "rate":
        return replace(found, stable=found.details["at no speed"][-2], steps=0)
    # scaled masses grow with the stiffness, and the bias of a speed with the mass: one value measured would not compare
    return ramps(assembly, loads, state, c, found.details["ramps"][-3][0])


def _at_half_rate(assembly: Assembly, loads: Loads, found: Search, c: Controls) -> Search:
    """The last tenth of the climb again with every increment halved."""
    begin, state = found.near if found.near is not None else (0.0, found.state)
    climbed = [begin]
    for value, verdict in found.record:
        if verdict.outcome == EQUILIBRIUM and value > climbed[-1]:
            climbed.append(value)
    halves = [x for a, b in pairwise(climbed) for x in (0.5 * (a + b), b)]
    patience = max(verdict.steps for _, verdict in found.record if verdict.outcome == EQUILIBRIUM)
    return increments(assembly, loads, state.copy(), c, through=halves, settled=begin, patience=patience)


def _least_balanced(assembly: Assembly, found: Search, load: float) -> str:
    """Name of the block whose forces were farthest from balance when a load was given up."""
    block = next(v.block for x, v in found.record if x == load)
    return f"{assembly.blocks[block].name or block!r}"


def _unbalanced(assembly: Assembly, loads: Loads, found: Search) -> float:
    """Part of the multiplier that the largest load in equilibrium owes to forces not quite balanced.

    Joint forces within their strength that leave a wrench r unbalanced carry the load less r: by the static theorem the
    multiplier is at least the load's less the power of r, over that of the live load, in the mechanism.
    """
    if found.mechanism is None or "ramps" in found.details:
        return 0.0
    twists = np.where(assembly.held, 0.0, found.mechanism.twists)
    return max(float((found.state.bodies.net * twists).sum() / (loads.live * twists).sum()), 0.0)


def _interval(found: Search, budget: Mapping[str, Mapping[str, Any]], unbalanced: float) -> tuple[float, float] | None:
    """Bracket, with the changes of the error budget summed on each side; None without a bracket.

    A repeat knows its own multiplier only to its own bracket, twice as wide as the search's: what it may lie below or
    above the bracket found counts, and not the distance of the two largest loads that stood.
    """
    if found.status not in (SOLVED, ALMOST_SOLVED, NOT_CONVERGED) or not np.isfinite(found.stable):
        return None
    low, high = found.stable - unbalanced, found.moving
    for check, row in budget.items():
        # deformation fades as 1 / stiffness: a tenth of it is left at ten times the stiffness
        share = 10.0 / 9.0 if check == "stiffness" else 1.0
        least, most = row["multiplier"], row["smallest moving"]
        if "ramps" in found.details:
            # what a ramp measures at its own speed is no bracket; its value at no speed is what compares
            most = found.moving + least - found.stable
        if np.isfinite(least):
            low += share * min(least - found.stable, 0.0)
        if np.isfinite(most):
            high += share * max(most - found.moving, 0.0)
    return low, high


def _unit(assembly: Assembly, loads: Loads) -> float:
    """Multiplier at which the live load equals the dead load, the natural scale of the search."""
    if len(loads.dead) != assembly.n_blocks:
        raise InputError(f"loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    moves = ~assembly.held
    size = np.r_[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    dead = np.linalg.norm(loads.dead * moves * size, axis=1).sum()
    live = np.linalg.norm(loads.live * moves * size, axis=1).sum()
    if live == 0.0:
        length = np.cbrt(assembly.arrays.volume)[:, None]
        live = np.linalg.norm((loads.live * moves)[:, 3:] / length, axis=1).sum()
    if live == 0.0:
        raise InputError("no live load acts on a free degree of freedom: there is nothing to multiply")
    return float(dead / live) if dead > 0 else 1.0


def _doubled(grid: Grid | Mapping[str, Grid]) -> Any:
    if isinstance(grid, Mapping):
        return {k: (2 * a, 2 * b) for k, (a, b) in grid.items()}
    return (2 * grid[0], 2 * grid[1])
