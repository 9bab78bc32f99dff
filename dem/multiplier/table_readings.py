"""What the reactions say of a table that turns: their path, and the largest ratio of the horizontal to the vertical."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dem.stages.history import History
from limitmason.arrays import Array
from limitmason.storage.frozen import ReadOnly

# chosen, not derived
_WINDOW = 5  # samples of the running median: a single sample may ride on a vibration
_WITHIN = 1e-3  # the multiplier counts as reached where the ratio comes this near to it [-]
_PRESSED = 1e-3  # of the weight: with less on the table Rh / Rv is a ratio of two small numbers


@dataclass(frozen=True, eq=False)
class Readings(ReadOnly):
    """What a history says of a turning table.

    Parameters
    ----------
    tilt_deg : angle of the table at the samples [deg], shape (samples,)
    steps : time steps since the table began to turn, shape (samples,)
    vertical, horizontal : Rv / Rv0 and Rh / Rv0, the reaction normal to the table and along it (positive where it holds
        the wall back) over the weight Rv0 of all blocks that are free [-], shape (samples,)
    ratio : Rh / Rv [-], shape (samples,); NaN where the wall has left the table
    weight : Rv0 [N]
    collapse : sample at which ``ratio`` first comes within 0.1 % of the multiplier, or of its maximum if that is less
    """

    tilt_deg: Array
    steps: Array
    vertical: Array
    horizontal: Array
    ratio: Array
    weight: float
    collapse: int


def readings(history: History, begun: float, downhill: Array, weight: float) -> Readings:
    """Readings of a turning table: angles, reactions over the weight, their ratio.

    The blocks stay upright and their weight turns, so that the reactions come in axes of the table.

    Parameters
    ----------
    history : of a run on the table
    begun : step at which the table began to turn
    downhill : unit vector along the table, towards which the wall leans, shape (3,)
    weight : of the free blocks [N]
    """
    total = history.reaction[:, :, :3].sum(axis=1)
    vertical, horizontal = total[:, 2] / weight, -(total @ downhill) / weight
    # a wall that leaves the table has no ratio
    ratio = np.divide(horizontal, vertical, out=np.full_like(vertical, np.nan), where=vertical > _PRESSED)
    return Readings(
        tilt_deg=np.rad2deg(history["tilt"]), steps=history["step"] - begun, vertical=vertical, horizontal=horizontal,
        ratio=ratio, weight=weight, collapse=first_reached(ratio, np.inf),
    )


def first_reached(ratio: Array, multiplier: float) -> int:
    """First sample at which a ratio reaches the multiplier, or its lower maximum.

    The ratio is Rh / Rv of every sample [-], NaN where the wall has left the table. None known: the last one.
    """
    near = np.flatnonzero(ratio >= (1.0 - _WITHIN) * min(peak_of(ratio), multiplier))
    return int(near[0]) if len(near) else len(ratio) - 1


def peak_of(ratio: Array) -> float:
    """Largest running median of Rh / Rv [-]: one sample of noise is no peak.

    The ratio of a sample is NaN where the wall has left the table. The peak is 0 where no ratio is known.
    """
    known = ratio[np.isfinite(ratio)]
    if len(known) < _WINDOW:
        return float(known.max(initial=0.0))
    return float(np.median(np.lib.stride_tricks.sliding_window_view(known, _WINDOW), axis=1).max())
