"""What the capacity path refuses: joint laws it does not follow, partly held rotations, nothing to push."""

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.capacity.result import PushoverCurve
from limitmason.capacity.step_length import Steps
from limitmason.checks import instance
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics import law_table
from limitmason.model.assembly import Assembly


def refuse(assembly: Assembly) -> None:
    """Refuse joints that a path does not follow, and models that nothing can push."""
    law_table.refuse(law_table.PUSHOVER, assembly)
    if assembly.fixed.all():
        raise InputError("every block is held: there is nothing to push")


def refuse_other_classes(steps: object, start: object, initial: object) -> None:
    """Refuse steps, a start and an initial state that are something else; None is left out."""
    kinds = {"steps": (steps, Steps), "start": (start, PushoverCurve), "initial": (initial, Prediction)}
    for name, (value, kind) in kinds.items():
        if value is not None:
            instance(name, value, kind)


def refuse_with_initial(deforming: bool, not_as_built: bool) -> None:
    """Refuse initial joint forces beside blocks that deform, or with a structure that is not begun with as built."""
    if deforming:
        raise NotApplicable("initial forces go with rigid blocks: limit analysis knows no strains")
    if not_as_built:
        raise InputError("initial forces go with the structure as built: without gaps, start and a support that moves")


def refuse_partial_rotations(assembly: Assembly) -> None:
    """Refuse blocks in space of which some rotations are held and others free.

    Finite rotations about one axis change the others, so that a held component has no meaning of its own.
    """
    turning = assembly.held[:, 3:]
    some = np.flatnonzero(turning.any(axis=1) & ~turning.all(axis=1))
    if len(some):
        raise NotApplicable(
            f"block {assembly.blocks[some[0]].name!r} has some of its rotations held: with finite rotations in space "
            "pushover takes all or none"
        )
