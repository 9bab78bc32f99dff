"""Collapse multiplier by the DEM: a search for the largest load that stands, its doubts, its answer."""

import time
from dataclasses import replace
from typing import Any

import numpy as np

from dem.contact.near import SMALL, farthest, near_margin
from dem.default_damping import SEARCHING
from dem.model.joint_marks import bond_yielded
from dem.model.joints import VERTICES, chosen_points, losses
from dem.model.pieces import reaches
from dem.model.rest_or_collapse import EQUILIBRIUM, UNDECIDED
from dem.model.unbalance import smallest_edge
from dem.multiplier.error_budget import error_budget, interval_of, range_of, share_of_unbalance, unloaded_state
from dem.multiplier.search import Controls, Search, increments
from dem.papers import COLLAPSE
from dem.settings import EDGES, DemSettings
from limitmason.answers.results import Bound, BoundKind, ContactModel, Prediction, Status
from limitmason.checks import instance
from limitmason.deformable.levels import RIGID
from limitmason.display.progress import reached, task
from limitmason.errors import InputError
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.model_notes import adds_model_notes
from limitmason.model import Assembly, Loads
from limitmason.model.model_call import of_model

MOVED, WIDEST = 0.02, 0.3
"""Displacement that counts as collapse, at first and for soft joints, over the smallest block dimension [-]."""

SWAYED = 0.5
"""Part of what counts as collapse from which a load that stood has moved blocks far, as soft joints let it [-]."""

PLASTIC = 0.1
"""Part of what counts as collapse from which the yielding of a perfectly plastic bond is no sway of soft joints [-]."""

CANCELLED = 1e-9  # of the couples over the sizes of their blocks: live forces that small are rounding

FIRST_INCREMENT = 0.05  # of the multiplier at which live equals dead load [-]; chosen



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
    given = DemSettings() if settings is None else instance("settings", settings, DemSettings)
    chosen = replace(given, **options)
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
        damping=chosen.damping or SEARCHING, unit=unit,
        first=FIRST_INCREMENT * unit if chosen.first_increment is None else chosen.first_increment,
        progress=chosen.progress, edges=chosen.contacts == EDGES,
    )
    reached(0.0, "search", share=1.0 / (1 + len(chosen.error_budget)))
    found = increments(assembly, loads, unloaded_state(assembly, loads, chosen, check=""), controls)
    swayed = chosen.moved_limit is None and _swayed(assembly, found, controls.moved_limit) > SWAYED
    # a bond that yields and never ends carries more the farther blocks move
    if swayed and bond_yielded(assembly, found.state)[0] < PLASTIC * MOVED * smallest_edge(assembly):
        controls = replace(controls, moved_limit=WIDEST)
        found = _further(assembly, loads, found, controls)
    warnings = [*found.state.warnings]
    budget: dict[str, dict[str, Any]] = {}
    if found.status in (Status.SOLVED, Status.ALMOST_SOLVED):
        budget, notes = error_budget(assembly, loads, found, chosen, controls)
        warnings += notes
    undecided = [value for value, verdict in found.record if verdict.outcome == UNDECIDED]
    warnings += _doubts(assembly, found, controls, undecided)
    warnings += _far_notes(assembly, found, chosen.contacts)
    answered = found.status in (Status.SOLVED, Status.ALMOST_SOLVED, Status.NOT_CONVERGED)
    interval = interval_of(found, budget, share_of_unbalance(assembly, loads, found))
    prediction = Prediction(
        method="dem, increments",
        collapse_multiplier=found.stable if answered else
        float("inf") if found.status == Status.UNBOUNDED else float("nan"),
        bound=Bound(BoundKind.ESTIMATE, "estimate for joints of finite stiffness with their own dilatancy angles"),
        status=found.status,
        resultants=found.state.resultants(assembly) if answered else None,
        warnings=tuple(warnings),
        provenance={
            "contact points": None if model == VERTICES else points,
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
        contact_model=ContactModel(model), error_budget=budget, range=range_of(found, interval, budget),
        lost_in_failure=losses(assembly, found.state.laws),
    )
    if prediction.resultants is not None:
        prediction = replace(prediction, certificate=certify(assembly, loads, prediction, convex=False))
    return replace(prediction, mechanism=found.mechanism)


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


def _swayed(assembly: Assembly, found: Search, moved_limit: float) -> float:
    """Farthest that a load that stood moved a block, over what counts as collapse [-]; 0 without an answer.

    ``moved_limit`` is the displacement that counts as collapse, divided by the smallest edge [-].
    """
    if found.status not in (Status.SOLVED, Status.ALMOST_SOLVED):
        return 0.0
    moved = max((v.moved for load, v in found.record if load and v.outcome == EQUILIBRIUM), default=0.0)
    return float(moved / (moved_limit * smallest_edge(assembly)))


def _far_notes(assembly: Assembly, found: Search, contacts: str) -> list[str]:
    """Note where the largest load that stood moved blocks beyond small displacement.

    ``contacts`` is the setting of the same name, ``EDGES`` or "first".
    """
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

    ``moved_limit`` is as for :func:`_swayed`.
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


def _least_balanced(assembly: Assembly, found: Search, load: float) -> str:
    """Name of the block farthest from balance when a ``load`` [-] was given up."""
    block = next(v.block for x, v in found.record if x == load)
    return f"{assembly.blocks[block].name or block!r}"


def _unit(assembly: Assembly, loads: Loads) -> float:
    """Multiplier at which live forces equal dead ones, the scale of the search [-]; 1 without dead ones.

    Forces are sums of sizes on free blocks. No live load at all is an InputError.
    """
    if len(loads.dead) != assembly.n_blocks:
        raise InputError(f"loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    moves = ~assembly.held
    dead = np.linalg.norm((loads.dead * moves)[:, :3], axis=1).sum()
    live = np.linalg.norm((loads.live * moves)[:, :3], axis=1).sum()
    # moments alone, beside forces that cancel but for rounding: as large as forces at an arm of the block's size
    length = np.cbrt(assembly.arrays.volume)[:, None]
    turning = np.linalg.norm((loads.live * moves)[:, 3:] / length, axis=1).sum()
    if live <= CANCELLED * turning:
        live = turning
    if live == 0.0:
        raise InputError("no live load acts on a free degree of freedom: there is nothing to multiply")
    return float(dead / live) if dead > 0 else 1.0


