"""Factors of load cases through a stage: live loads, turning weight, slow loads.

Motions that are prescribed, as that of the ground, are in ``stage_run``.
"""

import numpy as np

from dem.model.state import LIVE, WEIGHT, WEIGHT_X, WEIGHT_Y
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.model.stages import Ramp, Settle, Stage, Tilt

_LEVEL = 1e-9  # part of an axis that may be vertical: its rounding [-]
_OFF = 1e-12  # weight across the way that a table turns, over all weight: more is no rounding, it leans elsewhere [-]


def load_factors(start: Array, part: Array, stage: Stage) -> Array:
    """Factors of the cases at the given parts of a stage, shape (steps, 5).

    Their columns are those of :attr:`dem.model.state.State.factors`. What a stage does not change stays.

    Parameters
    ----------
    start : factors at the stage's beginning, shape (5,)
    part : parts of it from 0 to 1, shape (steps,)
    stage : which says how they change
    """
    out = np.tile(start, (len(part), 1))
    if isinstance(stage, Ramp):
        out[:, LIVE] = start[LIVE] + part * (stage.to - start[LIVE])
    elif isinstance(stage, Tilt):
        weight = [WEIGHT, WEIGHT_X, WEIGHT_Y]
        out[:, weight] = _turned(start[weight], part, stage)
    elif isinstance(stage, Settle) and stage.gently:
        # parts are of the most steps that the stage may take
        out *= np.minimum(part * (stage.max_steps / stage.gently), 1.0)[:, None]
    return out


def _turned(here: Array, part: Array, stage: Tilt) -> Array:
    """Factors of weight down, along x and y while a table turns, shape (steps, 3).

    Parameters
    ----------
    here : the factors where the stage begins, shape (3,)
    part : parts of the stage from 0 to 1, shape (steps,)
    stage : axis and angle at the end

    Raises
    ------
    InputError
        For an axis that is not horizontal.
    """
    # a weight that is scaled stays so; that of turned tables is 1 but for rounding
    weight = float(np.linalg.norm(here))
    weight = 1.0 if abs(weight - 1.0) < _OFF else weight
    axis = np.asarray(stage.axis, dtype=float)
    size = np.linalg.norm(axis)
    if not size > 0 or abs(axis[2]) > _LEVEL * size:
        raise InputError(f"tilting axis {stage.axis} is not horizontal")
    x, y = axis[1] / size, -axis[0] / size  # unit vector downhill: the axis turned by a right angle
    end = float(np.deg2rad(stage.to_deg))
    if abs(here[1] * y - here[2] * x) > _OFF * weight:
        # an earlier stage has turned the table about another axis. The weight turns on evenly, on the great circle from
        # where it points to where it will (spherical interpolation)
        here, there = here / np.linalg.norm(here), np.array([np.cos(end), np.sin(end) * x, np.sin(end) * y])
        angle_between = float(np.arccos(here @ there))
        done = part * angle_between
        shares = np.sin(np.column_stack([angle_between - done, done])) / np.sin(angle_between)
        return weight * np.asarray(shares @ np.array([here, there]))
    # about one axis the angle grows evenly
    begin = float(np.arctan2(here[1] * x + here[2] * y, here[0]))
    angle = begin + part * (end - begin)
    return weight * np.column_stack([np.cos(angle), np.sin(angle) * x, np.sin(angle) * y])
