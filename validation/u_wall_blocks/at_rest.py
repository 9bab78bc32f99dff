"""The U walls' blocks pushed from one state of rest to the next by the engine of capacity curves."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity import PushoverCurve, Steps
from limitmason.experiments import murano_u_walls as murano
from limitmason.experiments.experiment import Experiment
from limitmason.model.assembly import Assembly
from validation import murano_micro as micro

Array = NDArray[np.float64]

PART = 2.5e-4
"""Mean displacement of the facade after which the top is looked at [m]."""

MOST = 500
"""Tries of a step in a part."""


class Followed(NamedTuple):
    """Displacement of the top [mm], load [kN], movement of every block along -y at the end [m], curves of the parts."""

    displacement: Array
    load: Array
    moved: Array
    curves: tuple[PushoverCurve, ...]


def followed(
    test: Experiment, wall: Assembly, blocks: str, to: float, progress: Callable[[str], None] | None = None
) -> Followed:
    """Follow the blocks until their top has moved, or their path ends.

    Parameters
    ----------
    blocks : how stones deform, see :func:`limitmason.pushover`
    to : of the top [mm]
    """
    top = murano.control_block(test)
    curves: list[PushoverCurve] = []
    u, load = np.zeros(1), np.zeros(1)
    while u[-1] < to and (not curves or curves[-1].status == "reached"):
        start = curves[-1] if curves else None
        far = PART * (len(curves) + 1)
        curves.append(
            micro.push_micro(
                test, far, blocks=blocks, wall=wall, start=start, steps=Steps(most=MOST), progress=progress
            )
        )
        zero = curves[0].displacement_of(top)[0, 1]
        # the first state of a part is the last of the one before
        u = np.append(u, 1e3 * (zero - curves[-1].displacement_of(top)[1:, 1]))
        load = np.append(load, curves[-1].multiplier[1:])
    moved = curves[0].nodes[0].pose.shift[:, 1] - curves[-1].nodes[-1].pose.shift[:, 1]
    return Followed(u, load, moved, tuple(curves))
