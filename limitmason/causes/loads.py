"""Causes in the loads: where, how large and in which direction they act."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from limitmason.causes.declare import Model, declare
from limitmason.causes.wrenches import Direction, live_direction, overload_of, shared_acceleration, turned
from limitmason.checks import choice
from limitmason.errors import InputError, NotApplicable
from limitmason.geometry.rotation import axial, rotation_matrices
from limitmason.model import Assembly, Loads
from limitmason.model.input import read_direction

LEVEL = 1e-9
"""Largest height of a unit vector that counts as horizontal."""


@declare(
    "eccentric overload", parameter="eccentricity_mm", lever="overload", baseline=0.0, bounds=(-20.0, 20.0), unit="mm",
    physics="jack, beam or added mass sits off its axis: its lever arm changes by size", source="statics",
    isolate="turn the loading device round and repeat; a specimen without overload",
    hidden_when="no specimen has an overload, or a beam held against rotation spreads it",
)
def eccentric_overload(size: float, assembly: Assembly, loads: Loads, *, direction: Direction | None = None) -> Model:
    """Dead load beyond self weight that acts off its place by the size [mm].

    Positive along the live load.

    Parameters
    ----------
    direction : horizontal vector; None is the direction of the live load
    """
    d = live_direction(loads) if direction is None else read_direction("direction", direction)
    if direction is not None and abs(d[2]) > LEVEL:
        raise InputError(f"an eccentric overload needs a horizontal direction, got {direction!r}")
    extra, dead = overload_of(assembly, loads), np.array(loads.dead)
    arms = 1e-3 * size * d[:, None] * extra[:, None, :3]
    dead[:, 3:] += axial(arms)
    return assembly, replace(loads, dead=dead, dead_arms=loads.dead_arms + arms)


@declare(
    "overload magnitude", parameter="overload_factor", lever="overload", baseline=1.0, bounds=(0.7, 1.3),
    physics="load cell, jack friction or springs: overload x size", source="statics",
    isolate="weigh the overload by a second load cell under the wall",
    hidden_when="no specimen has an overload, or dry walls whose whole dead load is overload: twin of gain",
)
def overload_magnitude(factor: float, assembly: Assembly, loads: Loads, *, inertial: bool = False) -> Model:
    """Dead load beyond self weight that is not what was written down.

    Overload x size [-].

    Parameters
    ----------
    factor : size of the cause [-]
    inertial : whether it is a mass tilted or shaken along, whose live load beyond the blocks' own weight changes too
    """
    extra = overload_of(assembly, loads)
    live, live_arms = np.array(loads.live), np.array(loads.live_arms)
    if inertial:
        # the part of the live load that goes with the blocks' own weight stays
        body = np.zeros_like(live)
        body[:, :3] = assembly.weights[:, None] * shared_acceleration(assembly, loads)
        loaded = (extra != 0).any(axis=1)
        live[loaded] += (factor - 1.0) * (live - body)[loaded]
        live_arms[loaded] *= factor
    dead = loads.dead + (factor - 1.0) * extra
    return assembly, replace(loads, dead=dead, live=live, dead_arms=factor * loads.dead_arms, live_arms=live_arms)


def _turned_in(*, plane: str) -> Mapping[str, str]:
    """Name, parameter and physics of the cause for a plane in which the load turns."""
    choice("plane", plane, ("vertical", "horizontal"))
    name, parameter = ("inclined load", "rise_deg") if plane == "vertical" else ("skewed load", "skew_deg")
    physics = f"the live load is turned by size in the {plane} plane"
    return {"name": name, "parameter": parameter, "physics": physics}


@declare(
    "load direction", parameter="rise_deg", lever="direction of loads", baseline=0.0, bounds=(-15.0, 15.0), unit="deg",
    physics="the live load is turned by size", source="statics", variant=_turned_in,
    isolate="push from the other side; measure the cable's or the actuator's angle",
    hidden_when="a few degrees of horizontal skew change the multiplier by 1 - cos(size) only; inclination is near "
    "twin of gain where one mechanism governs",
)
def load_direction(size: float, assembly: Assembly, loads: Loads, *, plane: str = "vertical") -> Model:
    """Live load that acts in another direction than assumed, by the size [deg].

    Parameters
    ----------
    plane : "vertical", positive upwards (the actuator or the cable rises); "horizontal", positive counter-clockwise
        seen from above
    """
    d = live_direction(loads)
    axis = np.array([0.0, 0.0, 1.0]) if plane == "horizontal" else np.cross(d, (0.0, 0.0, 1.0))
    if np.linalg.norm(axis) < 1e-9:
        raise NotApplicable("a vertical live load has no vertical plane of its own: use plane='horizontal'")
    rotation = rotation_matrices(np.radians(size) * axis / np.linalg.norm(axis))
    return assembly, replace(loads, **turned(loads, "live", rotation))
