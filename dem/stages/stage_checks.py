"""Stages read before a run: their lengths and motions, and what is refused."""

from collections.abc import Mapping, Sequence

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.checks import count, instance, positive
from limitmason.errors import InputError
from limitmason.model import Assembly
from limitmason.model.base_motion import COAST, HOLD, BaseMotion
from limitmason.model.stages import Damping, Drive, Servo, Settle, Stage, Tilt

SERVO_EVERY = 10
"""Steps between two corrections of a servo's velocity."""


def check_stages(stages: Sequence[Stage], loaded: bool, timed: bool) -> list[str]:
    """Refuse wrong fields of stages, and note records that end with velocity.

    What is refused is told by stage and field.

    Parameters
    ----------
    stages : all of a run
    loaded : whether loads act already when the first stage begins
    timed : whether time is that of real masses; else it counts steps

    Raises
    ------
    InputError
        For lengths, dampings and servos that are none; durations where time counts steps; loads that come on gently
        where others act already; and a record that ends with velocity, is followed by another stage and does not say
        what the ground does then.
    """
    notes = []
    for number, stage in enumerate(stages):
        name = stage.name or f"stage {number} ({type(stage).__name__})"
        for field, check in (("steps", count), ("duration", positive), ("stop_when_moved", positive)):
            if getattr(stage, field, None) is not None:
                check(f"{name}: {field}", getattr(stage, field))
        if not timed and (seconds := getattr(stage, "duration", None)) is not None:
            raise InputError(
                f"{name}: duration = {seconds:g} s is for dynamic runs: time counts steps in others, give steps="
            )
        if stage.damping is not None:
            instance(f"{name}: damping", stage.damping, Damping)
        if not isinstance(stage.servo, Mapping):
            raise InputError(f"{name}: servo must be a mapping of blocks to Servo, got {stage.servo!r}")
        for block, servo in stage.servo.items():
            instance(f"{name}: servo of block {block!r}", servo, Servo)
        if isinstance(stage, Settle) and stage.gently and (number or loaded):
            raise InputError(f"{name}: loads act already, they cannot come on gently: give gently= in the first stage")
        if isinstance(stage, BaseMotion) and len(stage.acceleration) > 1 and stage.after is None:
            left, moves = stage.left_over()
            ends = f"{name}: the record ends with a ground velocity of {np.linalg.norm(left):.3g} m/s"
            if moves and number + 1 < len(stages):
                raise InputError(
                    f"{ends}; take .corrected() of it, or say after={COAST!r} (the ground goes on) or after={HOLD!r} "
                    "(it stops dead, which is a blow)"
                )
            if moves:
                notes.append(
                    f"{ends}; a run continued from here starts with the ground at rest, unless the record says "
                    f"after={COAST!r}"
                )
    return notes


def servo_holds(stage: Stage, assembly: Assembly) -> Flags:
    """Degrees of freedom that the servos of a stage hold, shape (n, 6).

    Raises
    ------
    InputError
        For a block that the assembly does not have, or that is named twice, and where a support or a Drive already
        prescribes its vertical.
    """
    held = np.zeros((assembly.n_blocks, 6), dtype=bool)
    for block, servo in stage.servo.items():
        i = assembly.block_index(block)
        driven = isinstance(stage, Drive) and any(
            assembly.block_index(b) == i and "z" in moves for b, moves in stage.displacement.items()
        )
        if held[i, 2]:
            raise InputError(f"servo on block {block!r}: it has one already, by its other name; add up their forces")
        if assembly.held[i, 2] or driven:
            raise InputError(f"servo on block {block!r}: its vertical is held or driven already; leave z to the servo")
        held[i, 2] = True
        held[i, 3:] = servo.parallel
    return held


def prescribed(assembly: Assembly, stages: Sequence[Stage]) -> Array:
    """Twists that stages prescribe, of blocks, ground and table, shape (k, 6).

    Their directions alone count: they say whether a problem stays in its plane.
    """
    rows = [np.zeros((0, 6))]
    for stage in stages:
        if isinstance(stage, Drive):
            rows.append(stage.twists(assembly)[0])
        elif isinstance(stage, BaseMotion):
            rows.append(np.pad(stage.units, ((0, 0), (0, 3))))  # displacements of the ground, which does not turn
        elif isinstance(stage, Tilt):
            rows.append(np.concatenate([np.zeros(3), stage.axis])[None])  # a turn of the table
    return np.concatenate(rows)


def stage_length(stage: Stage) -> tuple[int | None, float | None]:
    """Number of steps or duration [s] of a stage, the other None.

    Raises
    ------
    InputError
        When not exactly one is given.
    """
    if isinstance(stage, BaseMotion):
        if len(stage.acceleration) < 2:
            raise InputError("BaseMotion needs at least two samples of acceleration")
        return None, (len(stage.acceleration) - 1) * stage.sample_step
    steps, duration = getattr(stage, "steps", None), getattr(stage, "duration", None)
    if (steps is None) == (duration is None):
        raise InputError(f"{type(stage).__name__}: give either steps or duration")
    return (None if steps is None else int(steps)), duration
