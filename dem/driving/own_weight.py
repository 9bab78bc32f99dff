"""Own weight that comes to rest before a structure is driven: at once, evenly, or on joints that lose nothing first."""

from dataclasses import replace
from typing import Any

from dem.kernels import LAW
from dem.model.state import State, UnsettledError, UnstableError
from dem.model.unbalance import EVENLY, SLID, slid_and_moved
from dem.stages.history import History
from dem.stages.resuming import RunStatus
from dem.stages.simulate import simulate
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Settle

BEYOND = 1e30
"""Cohesion and tensile strength of joints that are to lose nothing [Pa]."""


def settled(
    assembly: Assembly, state: State, stage: Settle, loads: Loads, *, sound: bool
) -> History:
    """Run that ends at rest under dead loads.

    Loads that act at once overshoot. Where joints slide by it the loads come on once more, evenly, over as many steps
    as they took to come to rest.

    Parameters
    ----------
    assembly : what settles
    state : unloaded; left as it is
    stage : how it settles
    loads : dead ones [N, N m]; live ones of factor 0
    sound : where joints break on the way, settle once more on joints that lose nothing, and then on joints as they are

    Raises
    ------
    UnsettledError, UnstableError
        Where it does not come to rest, or flies apart.
    KeyboardInterrupt
        Where the keyboard stopped it: what is not at rest is not kept.
    """
    try:
        history, stage = evenly_where_it_slides(assembly, stage, loads=loads, start=state)
    # a structure that broke by the overshoot and flew apart may stand if it is sound while the weight comes on
    except UnstableError as error:
        if not sound or error.history is None or not _broken(error.history):
            raise
        history = error.history
    # once more on joints that lose nothing, and from there on joints as they are
    if sound and history.status != RunStatus.INTERRUPTED and _broken(history):
        whole = state.copy()
        # joints at hand, and the table of laws from which contacts that are found on the way take theirs
        for law in (whole.joints.law, whole.laws):
            # only joints that lose strength by opening or slip can break
            softens = (law[:, LAW.by_opening] > 0.0) | (law[:, LAW.by_slip] > 0.0)
            for strength in (LAW.cohesion, LAW.tension):
                law[softens, strength] = BEYOND
        at_rest = _rested(simulate(assembly, stage, loads=loads, start=whole)).state
        weaken(at_rest, state)
        # all of the weight is on it: nothing is left to come on gently
        history = simulate(assembly, replace(stage, gently=0), loads=loads, start=at_rest)
    return _rested(history)


def evenly_where_it_slides(assembly: Assembly, stage: Settle, **how: Any) -> tuple[History, Settle]:
    """Run of a first stage that settles, and the stage as it was run.

    Where joints slide by loads that act at once, it is run once more with loads that come on evenly.

    Parameters
    ----------
    stage : how the dead loads settle; one whose loads come on gently already, or with a servo, is run once
    how : what :func:`dem.simulate` takes
    """
    history = simulate(assembly, stage, **how)
    # a run that did not come to rest says nothing of how far joints slide
    if history.status == RunStatus.FINISHED and not (stage.gently or stage.servo):
        slid, moved = slid_and_moved(assembly, history.state)
        if slid > SLID * moved:
            steps = max(EVENLY, round(history["step"][-1]))
            stage = replace(stage, gently=steps, max_steps=stage.max_steps + steps)
            history = simulate(assembly, stage, **how)
    return history, stage


def _broken(history: History) -> bool:
    """Whether a joint has lost any of its strength."""
    return bool((history.state.points.damage > 0.0).any())


def weaken(state: State, before: State) -> None:
    """Give joints that were made to lose nothing back their strengths in ``before``.

    ``state`` is changed: these joints, known by a strength of :data:`BEYOND`, and its table of laws per interface.
    """
    state.laws[:] = before.laws
    for strength in (LAW.cohesion, LAW.tension):
        for j in (state.joints.law[:, strength] == BEYOND).nonzero()[0]:
            mark = int(state.interface[j])
            # a joint that was cut anew from interface k is marked -2 - k; blocks that met on the way were never bonded
            interface = mark if mark >= 0 else -2 - mark
            state.joints.law[j, strength] = before.laws[interface, strength]


def _rested(history: History) -> History:
    """Return a history that ended at rest; raise where it did not, or was interrupted."""
    if history.status == RunStatus.INTERRUPTED:
        raise KeyboardInterrupt("while own weight came to rest")
    if history.status != RunStatus.FINISHED:
        error = UnsettledError(
            f"the structure does not settle under its own weight in {history['step'][-1]:.0f} steps (unbalanced force "
            f"{history['unbalanced force'][-1]:.2g} of a block's load): it falls before it is driven, or needs settle="
        )
        error.history = history
        raise error
    return history
