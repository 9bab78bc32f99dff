"""Ten effects that never were in the catalogue, planted on units, joints, loads or readings by code of their own.

Written without the catalogue and without the diagnosis: each changes what a specimen is built of, or what is read.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from .campaigns import SPECIMENS, assembled, boxes, build, joint, thrust


@dataclass(frozen=True)
class Effect:
    """An effect that no list knows.

    Parameters
    ----------
    name, physics : what it is
    sizes : that are planted
    change : ``change(specimen, friction, size)`` returns (assembly, loads); None where only the reading changes
    read : ``read(size, value, specimen)`` returns what is read; None where it is the value
    """

    name: str
    physics: str
    sizes: tuple[float, ...]
    change: Callable | None = None
    read: Callable | None = None


def _middle(units):
    return (max(k for k, _ in units) + 1) // 2


def set_back(s, friction, size):
    """The course at mid height stands back by the size [mm], against the thrust."""
    units, d = boxes(s), np.array(thrust(s))
    for (k, _), corners in units.items():
        if k == _middle(units):
            corners[:] = [list(np.array(c) - 1e-3 * size * d) for c in corners]
    return assembled(s, units, friction)


def swayed(s, friction, size):
    """Units stand displaced along the thrust by size [1/m] times the square of their height when they collapse."""
    units, d = boxes(s), np.array(thrust(s))
    for corners in units.values():
        z = 0.5 * (corners[0][2] + corners[1][2])
        corners[:] = [list(np.array(c) + size * z**2 * d) for c in corners]
    return assembled(s, units, friction)


def weak_unit(s, friction, size):
    """All joints of one unit, the first of the second course or of the only one, have size times the friction."""
    units = boxes(s)
    weak = "1-0" if (1, 0) in units else "0-0"
    model, loads = build(s, friction)
    number = model.block_index(weak)
    changed = [
        replace(i, joint=joint(size * friction)) if number in (i.block_a, i.block_b) else i for i in model.interfaces
    ]
    return replace(model, interfaces=tuple(changed), recipe={}), loads


def light_above(s, friction, size):
    """Units of the upper half weigh size times as much as those below."""
    units = boxes(s)
    return assembled(s, units, friction, densities={n: size for n in units if n[0] >= _middle(units) > 0})


def _below(s, friction, law):
    """The model with another law in all joints below mid height."""
    model, loads = build(s, friction)
    changed = [
        replace(i, joint=law) if float(i.polygon[:, 2].mean()) < 0.5 * s["height"] else i for i in model.interfaces
    ]
    return replace(model, interfaces=tuple(changed), recipe={}), loads


def stuck_below(s, friction, size):
    """Joints of the lower half stick: cohesion of the size [kPa]."""
    return _below(s, friction, joint(friction, 1e3 * size))


def wet_below(s, friction, size):
    """Joints of the lower half are wet: friction times the size."""
    return _below(s, friction, joint(size * friction))


def higher(s, friction, size):
    """The live load grows with height: (1 + size (2 z / H - 1)) times the weight."""
    model, loads = build(s, friction)
    z = np.asarray(model.centroids)[:, 2] / s["height"]
    return model, replace(loads, live=np.asarray(loads.live) * (1.0 + size * (2.0 * z - 1.0))[:, None])


_AGE = float(np.mean([s["age"] for s in SPECIMENS]))

EFFECTS = (
    Effect("course set back", "one course stands back [mm]", (10.0, 15.0, 20.0), set_back),
    Effect("sway by the square of height", "second order [1/m]", (0.06, 0.10, 0.16), swayed),
    Effect("drift with the order of tests", "which goes with height", (0.003, 0.006, 0.01),
           read=lambda size, value, s: value * exp(-size * (s["order"] - 1))),
    Effect("one weak unit", "friction of its joints", (0.8, 0.65, 0.5), weak_unit),
    Effect("light upper half", "weight of the units above", (0.85, 0.7, 0.5), light_above),
    Effect("joints stick below", "cohesion of the lower joints [kPa]", (0.1, 0.2, 0.35), stuck_below),
    Effect("wet below", "friction of the lower joints", (0.9, 0.8, 0.65), wet_below),
    Effect("age", "of the specimen at the test", (0.004, 0.007, 0.012),
           read=lambda size, value, s: value * exp(size * (s["age"] - _AGE))),
    Effect("grows with the load", "read values rise with the overload [1/N]", (0.0008, 0.0014, 0.002),
           read=lambda size, value, s: value * exp(size * s["overload"])),
    Effect("load acts higher", "live load grows with height", (0.15, 0.25, 0.4), higher),
)
BY_NAME = {e.name: e for e in EFFECTS}
