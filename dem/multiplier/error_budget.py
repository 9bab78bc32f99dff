"""Error budget of a collapse multiplier: the search again in changed models, and the interval that this leaves.

Stiffness, ks/kn, contact points and rate are changed one at a time. The interval is the bracket of the search, widened
by what each change makes of the multiplier, and by forces that are not quite balanced.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from dem.model.initial_state import initial_state
from dem.model.joints import Grid, JointOptions, chosen_points
from dem.model.rest_or_collapse import EQUILIBRIUM
from dem.model.state import QUASI_STATIC, State
from dem.multiplier.search import APPROACH, Controls, Search, increments
from dem.settings import DemSettings
from limitmason.answers.results import ContactModel, Range, Status
from limitmason.display.progress import reached
from limitmason.model import Assembly, Loads

WARNED = 0.02
"""Change of the multiplier from which a check of the error budget warns [-]."""

FAR, MORE = 0.05, 3.0
"""Change of the multiplier at ten times the stiffness from which so many times as much is taken for the whole [-].

Rigid stones bore 1.6, 1.8 and 3.0 times as much more in three of 70 small structures.
"""

STIFFER, SHEAR = 10.0, 0.4
"""Factors of the error budget on kn and ks, and on ks alone [-]: G / E of a mortar, where kn is ks by default."""


def error_budget(
    assembly: Assembly, loads: Loads, found: Search, chosen: DemSettings, controls: Controls
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Repeats of a search in changed models, by check, and notes on doubts.

    Of each repeat: multiplier, its change [-], upper end and relative width of its bracket, steps, status.

    Parameters
    ----------
    found : the search that is repeated, which has a bracket
    chosen : with the checks that are wanted
    controls : of the search; repeats close in to twice its tolerance
    """
    share = 1.0 / (1 + len(chosen.error_budget))
    budget: dict[str, dict[str, Any]] = {}
    notes: list[str] = []
    for number, check in enumerate(chosen.error_budget, 1):
        reached(number * share, f"error budget: {check}", share=share)
        # ten times as stiff, joints give a tenth as much before blocks move on; 0.3 is chosen
        limit = (0.3 if check == "stiffness" else 1.0) * controls.moved_limit
        near = replace(controls, tolerance=2.0 * controls.tolerance, moved_limit=limit)
        if check == "rate":
            again = _at_half_rate(assembly, loads, found, near)
        else:
            changed = unloaded_state(assembly, loads, chosen, check)
            again = increments(assembly, loads, changed, near, through=[part * found.stable for part in APPROACH])
        if "interrupted" in again.details:
            notes.append(f"interrupted while the search was repeated for the {check}: the budget is incomplete")
            break
        decided = again.status in (Status.SOLVED, Status.ALMOST_SOLVED)
        change = again.stable / found.stable - 1.0 if found.stable and decided else float("nan")
        budget[check] = {
            "multiplier": again.stable, "change": change, "smallest moving": again.moving,
            "resolution": again.moving / again.stable - 1.0 if again.stable else 0.0, "steps": again.steps,
            "status": again.status,
        }
        if not decided:
            notes.append(f"error budget: undecided with {check} changed ({again.status})")
        elif not _same(found, again):
            notes.append(
                f"the multiplier changes by {100 * change:+.1f} % with {check} changed: it is not converged in this "
                "respect"
            )
    return budget, notes


def unloaded_state(assembly: Assembly, loads: Loads, chosen: DemSettings, check: str) -> State:
    """Unloaded state that a search with the settings ``chosen`` begins with.

    Its joints are changed as a check of the error budget asks, "" for none.
    """
    points: Grid | None = chosen.contact_points
    model = chosen.contact_model
    law = chosen.joint_options or JointOptions()
    if check == "stiffness":
        law = replace(law, stiffness_factor=STIFFER * law.stiffness_factor)
    elif check == "ks/kn":
        law = replace(law, shear_factor=SHEAR * law.shear_factor)
    elif check == "contact points":
        # on an even lattice twice as fine the edges on which blocks turn are hardly better told
        points, model = _doubled(chosen_points(assembly, points, model)[0]), ContactModel.LOBATTO
    return initial_state(
        assembly, loads, contact_points=points, contact_model=model, joint_options=law, mode=QUASI_STATIC,
        blocks=chosen.blocks, stress=chosen.stress,
    )


def _same(found: Search, again: Search) -> bool:
    """Whether a repeat differs by less than ``WARNED`` wherever the brackets hold it."""
    # least and largest ratio of two multipliers, one in the bracket of either search
    least, most = again.stable / found.moving, again.moving / found.stable
    return bool(1.0 - WARNED <= least <= most <= 1.0 + WARNED)


def _at_half_rate(assembly: Assembly, loads: Loads, found: Search, c: Controls) -> Search:
    """Repeat of a search's last tenth in halved increments, with controls ``c``."""
    assert found.near is not None  # as of any search that has a bracket
    begin, state = found.near
    climbed = [begin]  # loads that stood on the way up
    for value, verdict in found.record:
        if verdict.outcome == EQUILIBRIUM and value > climbed[-1]:
            climbed.append(value)
    halves = [x for a, b in pairwise(climbed) for x in (0.5 * (a + b), b)]
    patience = max(verdict.steps for _, verdict in found.record if verdict.outcome == EQUILIBRIUM)
    return increments(assembly, loads, state.copy(), c, through=halves, settled=begin, patience=patience)


def share_of_unbalance(assembly: Assembly, loads: Loads, found: Search) -> float:
    """How much less the multiplier may be, as forces are not quite balanced [-].

    Joint forces within their strength that leave a wrench r unbalanced carry the load less r: by the static theorem the
    multiplier is at least the load's less the power of r, over that of the live load, in the mechanism.
    """
    if found.mechanism is None:
        return 0.0
    twists = np.where(assembly.held, 0.0, found.mechanism.twists)
    return max(float((found.state.bodies.net * twists).sum() / (loads.live * twists).sum()), 0.0)


def interval_of(
    found: Search, budget: Mapping[str, Mapping[str, Any]], unbalanced: float
) -> tuple[float, float] | None:
    """Bracket widened on each side by the error budget [-], None without a bracket.

    A repeat lowers the lower end by what its own largest stable load lies below the search's. It lifts the upper end by
    what its smallest moving load lies above the search's.

    Parameters
    ----------
    found : the search, whose bracket is ``stable`` to ``moving`` [-]
    budget : rows of :func:`error_budget`; ``change`` is NaN where a repeat was undecided, and counts as small
    unbalanced : what forces that are still unbalanced may carry, as a multiplier [-]
    """
    if found.status not in (Status.SOLVED, Status.ALMOST_SOLVED, Status.NOT_CONVERGED) or not np.isfinite(found.stable):
        return None
    low, high = found.stable - unbalanced, found.moving
    for check, row in budget.items():
        # small deformation fades as 1 / stiffness: a tenth of it is left at ten times the stiffness. What is large
        # changes the shape and fades more slowly
        whole = MORE if abs(row["change"]) > FAR else STIFFER / (STIFFER - 1.0)
        share = whole if check == "stiffness" else 1.0
        least, most = row["multiplier"], row["smallest moving"]
        if np.isfinite(least):
            low += share * min(least - found.stable, 0.0)
        if np.isfinite(most):
            high += share * max(most - found.moving, 0.0)
    return low, high


def range_of(found: Search, interval: tuple[float, float] | None, budget: Mapping[str, Mapping[str, Any]]) -> Range:
    """The interval of an answer, and what it rests on in words.

    ``interval`` is the bracket widened by the error budget [-]. ``budget`` holds what each check found, by its name.
    """
    if found.status not in (Status.SOLVED, Status.ALMOST_SOLVED) or interval is None:
        return Range()
    decided = [name for name, row in budget.items() if np.isfinite(row["change"])]
    parts = ["bracket", *decided, *(f"{name} undecided" for name in budget if name not in decided)]
    return Range(*interval, f"error budget: {', '.join(parts)}" if budget else "bracket of the search")


def _doubled(grid: Grid) -> Grid:
    """A grid with twice as many points along either axis, or at half the spacing [m]."""
    if isinstance(grid, int | float):
        return 0.5 * grid
    if isinstance(grid, Mapping):
        return {k: (2 * a, 2 * b) for k, (a, b) in grid.items()}
    return (2 * grid[0], 2 * grid[1])
