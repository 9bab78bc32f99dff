"""Collapse multiplier by the DEM with its own error budget: stiffness, ks/kn, contact points and rate."""

import time
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from dem.contact.near import SMALL, farthest, near_margin
from dem.model.initial_state import initial_state
from dem.model.joint_marks import bond_yielded
from dem.model.joints import Grid, JointOptions, chosen_points, losses
from dem.model.pieces import reaches
from dem.model.rest_or_collapse import EQUILIBRIUM, UNDECIDED
from dem.model.state import QUASI_STATIC, State
from dem.model.unbalance import smallest_edge
from dem.multiplier.search import APPROACH, Controls, Search, increments
from dem.papers import COLLAPSE
from dem.settings import EDGES, DemSettings
from limitmason.answers.results import Bound, BoundKind, ContactModel, Prediction, Range, Status
from limitmason.deformable.levels import RIGID
from limitmason.display.progress import reached, task
from limitmason.errors import InputError
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.model_notes import adds_model_notes
from limitmason.model import Assembly, Loads
from limitmason.model.model_call import of_model
from limitmason.model.stages import Damping

MOVED, WIDEST = 0.02, 0.3
"""Displacement that counts as collapse, at first and for soft joints, over the smallest block dimension [-]."""

SWAYED = 0.5
"""Part of what counts as collapse from which a load that stood has moved blocks far, as soft joints let it [-]."""

PLASTIC = 0.1
"""Part of what counts as collapse from which the yielding of a perfectly plastic bond is no sway of soft joints [-]."""

FIRST_INCREMENT = 0.05  # of the multiplier at which live equals dead load [-]; chosen

WARNED = 0.02
"""Change of the multiplier from which a check of the error budget warns [-]."""

FAR, MORE = 0.05, 3.0
"""Change of the multiplier at ten times the stiffness from which so many times as much is taken for the whole [-].

Rigid stones bore 1.6, 1.8 and 3.0 times as much more in three of 70 small structures.
"""

STIFFER, SHEAR = 10.0, 0.4
"""Factors of the error budget on kn and ks, and on ks alone [-]: G / E of a mortar, where kn is ks by default."""

LOADING = Damping(local=0.4, kinetic=True)  # chosen, not derived


@of_model
@adds_model_notes("dem", cites=lambda _: COLLAPSE)
def collapse(
    assembly: Assembly, loads: Loads, settings: DemSettings | None = None, **options: Any
) -> Prediction:
    """Collapse multiplier by the explicit distinct element method, quasi-static.

    The structure settles under the dead load and the live load grows until the blocks keep moving.

    Parameters
    ----------
    assembly, loads : the problem
    settings : those of :class:`dem.DemSettings`; its defaults where omitted
    options : single settings by name, in place of those in ``settings``

    Returns
    -------
    Prediction
        ``collapse_multiplier`` is the largest load found in equilibrium. ``interval`` is the bracket, widened on each
        side by what the brackets of the repeats reach beyond it there, and below by what forces still unbalanced carry
        in the mechanism. ``details`` holds the bracket, every load tried, undecided loads and the error budget.
        "Almost solved" is a bracket wider than asked for, because loads in it stayed undecided.

    Raises
    ------
    InputError
        For settings that are wrong, no live load, and what :func:`dem.initial_state` says is wrong.
    NotApplicable
        For joints without shear stiffness.
    NotConverged
        :class:`dem.UnstableError`, where energy explodes.

    Notes
    -----
    The flow rule is that of the joints: psi = 0 unless they dilate. Finite stiffness lowers the multiplier of slender
    walls (bending before collapse), and torsion depends on the contact points: the error budget says by how much. It
    is an estimate, not a bound. Source of the procedure: Godio, Stefanou, Sab 2017, eq. 5.

    Contacts are those of the first position, their points at the edges where faces that slide end. The multiplier is
    too high where joints are so soft that blocks turn or meet others before they fall, by up to 1.4 % on four walls of
    1e8 Pa/m at psi = phi. The answer says from which displacement; :func:`dem.push` finds contacts anew.
    """
    chosen = replace(settings or DemSettings(), **options)
    with task("DEM, collapse", shown=chosen.progress is None):
        return _collapse(assembly, loads, chosen)


def _collapse(assembly: Assembly, loads: Loads, chosen: DemSettings) -> Prediction:
    """Search for the largest load that stands, with the settings ``chosen``."""
    begun = time.perf_counter()
    unit = _unit(assembly, loads)
    points, model = chosen_points(assembly, chosen.contact_points, chosen.contact_model)
    controls = Controls(
        tolerance=chosen.tolerance, max_steps=chosen.max_steps,
        moved_limit=MOVED if chosen.moved_limit is None else chosen.moved_limit, equilibrium=chosen.equilibrium,
        damping=chosen.damping or LOADING, unit=unit,
        first=FIRST_INCREMENT * unit if chosen.first_increment is None else chosen.first_increment,
        progress=chosen.progress, edges=chosen.contacts == EDGES,
    )
    reached(0.0, "search", share=1.0 / (1 + len(chosen.error_budget)))
    found = increments(assembly, loads, _start(assembly, loads, chosen, check=""), controls)
    swayed = chosen.moved_limit is None and _swayed(assembly, found, controls.moved_limit) > SWAYED
    # a bond that yields and never ends carries more the farther blocks move
    if swayed and bond_yielded(assembly, found.state)[0] < PLASTIC * MOVED * smallest_edge(assembly):
        controls = replace(controls, moved_limit=WIDEST)
        found = _further(assembly, loads, found, controls)
    warnings = [*found.state.warnings]
    budget: dict[str, dict[str, Any]] = {}
    if found.status in (Status.SOLVED, Status.ALMOST_SOLVED):
        budget, notes = _budget(assembly, loads, found, chosen, controls)
        warnings += notes
    undecided = [value for value, verdict in found.record if verdict.outcome == UNDECIDED]
    warnings += _doubts(assembly, found, controls, undecided)
    warnings += _far_notes(assembly, found, chosen.contacts)
    answered = found.status in (Status.SOLVED, Status.ALMOST_SOLVED, Status.NOT_CONVERGED)
    interval = _interval(found, budget, _unbalanced(assembly, loads, found))
    prediction = Prediction(
        method="dem, increments",
        collapse_multiplier=found.stable if answered else
        float("inf") if found.status == Status.UNBOUNDED else float("nan"),
        bound=Bound(BoundKind.ESTIMATE, "estimate for joints of finite stiffness with their own dilatancy angles"),
        status=found.status,
        resultants=found.state.resultants(assembly) if answered else None,
        warnings=tuple(warnings),
        provenance={
            "contact points": points,
            "contact model": model, "contacts": chosen.contacts, "tolerance": controls.tolerance,
            "steps": found.steps, "seconds": time.perf_counter() - begun, "damping": controls.damping,
            "moved limit": controls.moved_limit,
            **({} if chosen.blocks == RIGID else {"blocks": chosen.blocks, "stress": chosen.stress}),
        },
        details={
            "largest stable": found.stable, "smallest moving": found.moving, "undecided": undecided,
            "loads tried": [(value, str(v.outcome), v.steps) for value, v in found.record], "error budget": budget,
            "interval": interval, "steps": found.steps, **found.details,
        },
        contact_model=ContactModel(model), error_budget=budget, range=_range(found, interval, budget),
        lost_in_failure=losses(assembly, found.state.laws),
    )
    if prediction.resultants is not None:
        prediction = replace(prediction, certificate=certify(assembly, loads, prediction, convex=False))
    return replace(prediction, mechanism=found.mechanism)


def _start(assembly: Assembly, loads: Loads, chosen: DemSettings, check: str) -> State:
    """Unloaded state that a search with the settings ``chosen`` begins with.

    Its joints are changed as a check of the error budget asks, "" for none.
    """
    points, model = chosen_points(assembly, chosen.contact_points, chosen.contact_model)
    law = chosen.joint_options or JointOptions()
    if check == "stiffness":
        law = replace(law, stiffness_factor=STIFFER * law.stiffness_factor)
    elif check == "ks/kn":
        law = replace(law, shear_factor=SHEAR * law.shear_factor)
    elif check == "contact points":
        # on an even lattice twice as fine the edges on which blocks turn are hardly better told
        points, model = _doubled(points), ContactModel.LOBATTO
    return initial_state(
        assembly, loads, contact_points=points, contact_model=model, joint_options=law, mode=QUASI_STATIC,
        blocks=chosen.blocks, stress=chosen.stress,
    )


def _budget(
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
        changed = _start(assembly, loads, chosen, check)
        # ten times as stiff, joints give a tenth as much before blocks move on; 0.3 is chosen
        limit = (0.3 if check == "stiffness" else 1.0) * controls.moved_limit
        near = replace(controls, tolerance=2.0 * controls.tolerance, moved_limit=limit)
        if check == "rate":
            again = _at_half_rate(assembly, loads, found, near)
        else:
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


def _doubts(assembly: Assembly, found: Search, c: Controls, undecided: list[float]) -> list[str]:
    """Notes of what is doubtful in a search with controls ``c``.

    They say that it was interrupted, which loads [-] in its bracket are ``undecided``, and that blocks moved far.
    """
    notes = []
    if "interrupted" in found.details:
        notes.append(f"interrupted while holding {found.details['interrupted']:.5g}: the bracket is not closed")
    between = [u for u in undecided if found.stable < u < found.moving]
    if between and found.status != Status.NOT_CONVERGED:
        notes.append(
            f"undecided after {c.max_steps} steps and more at {', '.join(f'{u:.5g}' for u in between)}; not counted as "
            f"stable (least balanced: block {_least_balanced(assembly, found, between[-1])})"
        )
    return notes + _sway_notes(assembly, found, c.moved_limit)


def _same(found: Search, again: Search) -> bool:
    """Whether a repeat differs by less than ``WARNED`` wherever the brackets hold it."""
    # least and largest ratio of two multipliers, one in the bracket of either search
    least, most = again.stable / found.moving, again.moving / found.stable
    return bool(1.0 - WARNED <= least <= most <= 1.0 + WARNED)


def _swayed(assembly: Assembly, found: Search, moved_limit: float) -> float:
    """Farthest that a load that stood moved a block, as part of a collapse [-]."""
    if found.status not in (Status.SOLVED, Status.ALMOST_SOLVED):
        return 0.0
    moved = max((v.moved for load, v in found.record if load and v.outcome == EQUILIBRIUM), default=0.0)
    return float(moved / (moved_limit * smallest_edge(assembly)))


def _far_notes(assembly: Assembly, found: Search, contacts: str) -> list[str]:
    """Note where the largest load that stood moved blocks beyond their contacts."""
    block, moved = farthest(assembly, found.state, reaches(assembly))
    if found.status not in (Status.SOLVED, Status.ALMOST_SOLVED) or moved <= SMALL * near_margin(assembly):
        return []
    kept = "joints keep their planes" if contacts == EDGES else "joints keep their points and planes"
    return [
        f"the largest load that stood has moved block {assembly.blocks[block].name!r} by {moved:.2g} m, beyond small "
        f"displacement: {kept}, and blocks that meet later are not looked for; dem.push finds contacts anew"
    ]


def _sway_notes(assembly: Assembly, found: Search, moved_limit: float) -> list[str]:
    """Note where a load in equilibrium moved blocks far, by soft joints or bonds.

    ``moved_limit`` is the displacement that counts as collapse, divided by the smallest edge [-].
    """
    share, edge = _swayed(assembly, found, moved_limit), smallest_edge(assembly)
    yielded, joint = bond_yielded(assembly, found.state)
    if yielded >= MOVED * edge or (share > SWAYED and yielded >= PLASTIC * MOVED * edge):
        return [
            f"{joint} has yielded by {yielded:.2g} m and still bears its perfectly plastic cohesion or tension: give "
            "residual values or fracture energies for what is left when a bond ends"
        ]
    if share > SWAYED:
        return [
            f"a load in equilibrium moved a block by {share * moved_limit * edge:.2g} m, {share:.0%} of what counts as "
            f"collapse: with joints as soft as these raise moved_limit ({moved_limit:g})"
        ]
    return []


def _further(assembly: Assembly, loads: Loads, found: Search, c: Controls) -> Search:
    """Go on with a search from its largest load that stood; both as one search.

    Parameters
    ----------
    found : the search so far
    c : its controls, with a larger displacement that counts as collapse
    """
    patience = max(v.steps for _, v in found.record if v.outcome == EQUILIBRIUM)
    again = increments(
        assembly, loads, found.state.copy(), replace(c, first=c.tolerance * found.stable), settled=found.stable,
        patience=patience,
    )
    again.record[:0] = [(x, v) for x, v in found.record if x <= found.stable]
    again.steps += found.steps
    # a check of the rate repeats the last tenth of the climb: what was kept since may lie too high (chosen)
    if again.near is not None and again.near[0] > 0.95 * again.stable and found.near is not None:
        again.near = found.near
    return again


def _at_half_rate(assembly: Assembly, loads: Loads, found: Search, c: Controls) -> Search:
    """Repeat of a search's last tenth in halved increments, with controls ``c``."""
    begin, state = found.near if found.near is not None else (0.0, found.state)
    climbed = [begin]  # loads that stood on the way up
    for value, verdict in found.record:
        if verdict.outcome == EQUILIBRIUM and value > climbed[-1]:
            climbed.append(value)
    halves = [x for a, b in pairwise(climbed) for x in (0.5 * (a + b), b)]
    patience = max(verdict.steps for _, verdict in found.record if verdict.outcome == EQUILIBRIUM)
    return increments(assembly, loads, state.copy(), c, through=halves, settled=begin, patience=patience)


def _least_balanced(assembly: Assembly, found: Search, load: float) -> str:
    """Name of the block farthest from balance when a ``load`` [-] was given up."""
    block = next(v.block for x, v in found.record if x == load)
    return f"{assembly.blocks[block].name or block!r}"


def _unbalanced(assembly: Assembly, loads: Loads, found: Search) -> float:
    """How much less the multiplier may be, as forces are not quite balanced [-].

    Joint forces within their strength that leave a wrench r unbalanced carry the load less r: by the static theorem the
    multiplier is at least the load's less the power of r, over that of the live load, in the mechanism.
    """
    if found.mechanism is None:
        return 0.0
    twists = np.where(assembly.held, 0.0, found.mechanism.twists)
    return max(float((found.state.bodies.net * twists).sum() / (loads.live * twists).sum()), 0.0)


def _range(found: Search, interval: tuple[float, float] | None, budget: Mapping[str, Mapping[str, Any]]) -> Range:
    """The interval of an answer, and what it rests on in words.

    ``interval`` is the bracket widened by the error budget [-]. ``budget`` holds what each check found, by its name.
    """
    if found.status not in (Status.SOLVED, Status.ALMOST_SOLVED) or interval is None:
        return Range()
    decided = [name for name, row in budget.items() if np.isfinite(row["change"])]
    parts = ["bracket", *decided, *(f"{name} undecided" for name in budget if name not in decided)]
    return Range(*interval, f"error budget: {', '.join(parts)}" if budget else "bracket of the search")


def _interval(found: Search, budget: Mapping[str, Mapping[str, Any]], unbalanced: float) -> tuple[float, float] | None:
    """Bracket widened on each side by the error budget [-], None without a bracket.

    A repeat knows its own multiplier only to its own bracket, twice as wide as the search's: what it may lie below or
    above the bracket found counts, and not the distance of the two largest loads that stood. ``unbalanced`` is what
    forces that are still unbalanced may carry, as a multiplier [-].
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


def _unit(assembly: Assembly, loads: Loads) -> float:
    """Multiplier at which live forces equal dead ones, the scale of the search [-]."""
    if len(loads.dead) != assembly.n_blocks:
        raise InputError(f"loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    moves = ~assembly.held
    dead = np.linalg.norm((loads.dead * moves)[:, :3], axis=1).sum()
    live = np.linalg.norm((loads.live * moves)[:, :3], axis=1).sum()
    # moments alone: as large as forces at an arm of the block's size
    if live == 0.0:
        length = np.cbrt(assembly.arrays.volume)[:, None]
        live = np.linalg.norm((loads.live * moves)[:, 3:] / length, axis=1).sum()
    if live == 0.0:
        raise InputError("no live load acts on a free degree of freedom: there is nothing to multiply")
    return float(dead / live) if dead > 0 else 1.0


def _doubled(grid: Grid) -> Grid:
    """A grid with twice as many points along either axis, or at half the spacing [m]."""
    if isinstance(grid, int | float):
        return 0.5 * grid
    if isinstance(grid, Mapping):
        return {k: (2 * a, 2 * b) for k, (a, b) in grid.items()}
    return (2 * grid[0], 2 * grid[1])
