"""How far the push of jacks strayed from the force that they were to keep."""

from collections.abc import Mapping

import numpy as np

from dem.stages.history import COLUMNS
from limitmason.arrays import Array, Index
from limitmason.model import Assembly
from limitmason.model.stages import Servo

STRAYED = 0.05
"""Part of a servo's force by which its push may stray without a word [-]: chosen."""


def strayed_pushes(
    assembly: Assembly, servos: Mapping[int | str, Servo], stage: int, samples: Mapping[str, Array], blocks: Index
) -> list[str]:
    """Say of which blocks the push strayed from the force of their servo, between which ends.

    A block that is driven fast rises or sinks ahead of its jack.

    Parameters
    ----------
    assembly : of the run
    servos : of a stage, by block
    stage : its number, from 0
    samples : "rows" of scalars and "reaction" of the recorded blocks, as of :class:`dem.stages.store.Samples`
    blocks : numbers of these, shape (r,)
    """
    inside = samples["rows"][:, list(COLUMNS).index("stage")] == stage
    notes = []
    for block, servo in servos.items():
        i = assembly.block_index(block)
        # the jack pushes downwards
        push = -samples["reaction"][inside][:, blocks == i, 2].ravel()
        if np.abs(push - servo.force).max(initial=0.0) > STRAYED * abs(servo.force):
            notes.append(
                f"the servo on block {assembly.blocks[i].name!r} pushed by {push.min():.5g} to {push.max():.5g} N, its "
                f"force is {servo.force:.5g} N: move the block more slowly, or change gain={servo.gain:g}"
            )
    return notes
