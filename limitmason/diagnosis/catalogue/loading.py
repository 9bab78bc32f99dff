"""Causes in the loads: where, how large and in which direction they act."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from limitmason.diagnosis.cause import Cause
from limitmason.geometry.rotation import rotation_matrices
from limitmason.model import Assembly, Loads

Array = NDArray[np.float64]
Bounds = tuple[float, float]
Direction = tuple[float, float, float]


def turned(wrench: Array, rotation: Array) -> Array:
    """Wrenches whose forces turn about their points of application, which stay; free couples turn along.

    The point is taken as that of the line of action nearest the block's centroid, which is exact for forces at the
    centroid.
    """
    force, moment = wrench[:, :3], wrench[:, 3:]
    square = (force**2).sum(axis=1, keepdims=True)
    arm = np.divide(np.cross(force, moment), square, out=np.zeros_like(force), where=square > 0)
    couple = moment - np.cross(arm, force)
    new = force @ rotation.T
    return np.hstack([new, np.cross(arm, new) + couple @ rotation.T])


def self_weight(assembly: Assembly) -> Array:
    """Wrench of the weight of every block, shape (n, 6)."""
    out = np.zeros((assembly.n_blocks, 6))
    out[:, 2] = -assembly.weights
    return out


def shared_acceleration(assembly: Assembly, loads: Loads) -> Array:
    """Live force over weight that most blocks have in common, in units of g, shape (3,); zero where there is none.

    Only forces at the centroid count, as body forces act there. Of a single block under a force at its centroid nobody
    can tell whether it is a body force: it is taken as one.
    """
    rows = np.flatnonzero((assembly.weights > 0) & ~assembly.fixed)
    if not len(rows):
        return np.zeros(3)
    ratio = loads.live[rows, :3] / assembly.weights[rows, None]
    middle = np.median(ratio, axis=0)
    same = np.abs(ratio - middle).max(axis=1) <= 1e-9 * max(1.0, float(np.abs(middle).max()))
    moment = np.abs(loads.live[rows, 3:]).max(axis=1)
    same &= moment <= 1e-9 * np.linalg.norm(loads.live[rows, :3], axis=1) * np.cbrt(assembly.volumes[rows])
    return middle if 2 * same.sum() > len(rows) else np.zeros(3)


def live_direction(loads: Loads) -> Array:
    """Direction of the sum of the live forces, shape (3,).

    Raises
    ------
    ValueError
        When the live forces add up to nothing.
    """
    total = loads.live[:, :3].sum(axis=0)
    size = float(np.linalg.norm(total))
    if size <= 1e-9 * float(np.abs(loads.live[:, :3]).sum() or 1.0):
        raise ValueError("the live forces add up to zero: give the cause a direction")
    return total / size


def overload_of(assembly: Assembly, loads: Loads) -> Array:
    """Dead load beyond self weight, shape (n, 6); rounding of the weights themselves does not count."""
    extra = loads.dead - self_weight(assembly)
    largest = max(float(np.abs(loads.dead).max(initial=0.0)), 1e-300)
    return np.where(np.abs(extra) > 1e-12 * largest, extra, 0.0)


@dataclass(frozen=True)
class Eccentric:
    """Overload moved sideways by the size in mm."""

    direction: Direction | None

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if size == 0.0:
            return assembly, loads
        d = live_direction(loads) if self.direction is None else np.asarray(self.direction, dtype=float)
        d = d / np.linalg.norm(d)
        extra, dead = overload_of(assembly, loads), np.array(loads.dead)
        dead[:, 3:] += np.cross(1e-3 * size * d, extra[:, :3])
        return assembly, replace(loads, dead=dead)


def eccentric_overload(bounds: Bounds = (-20.0, 20.0), *, direction: Direction | None = None) -> Cause:
    """Dead load beyond self weight that acts off its place by the size [mm], positive along the live load.

    Parameters
    ----------
    direction : horizontal vector; None is the direction of the live load
    """
    return Cause(
        "eccentric overload", "eccentricity_mm", 0.0, bounds, "jack, beam or added mass sits off its axis: its lever "
        "arm changes by size", apply=Eccentric(direction), unit="mm", source="statics",
        isolate="turn the loading device round and repeat; a specimen without overload",
        hidden_when="no specimen has an overload, or a beam held against rotation spreads it",
    )  # fmt: skip


@dataclass(frozen=True)
class OverloadFactor:
    """Overload times the size, with its share of the live load if it moves with the structure."""

    inertial: bool

    def __call__(self, factor: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if factor == 1.0:
            return assembly, loads
        extra = overload_of(assembly, loads)
        live = np.array(loads.live)
        if self.inertial:
            body = np.zeros_like(live)
            body[:, :3] = assembly.weights[:, None] * shared_acceleration(assembly, loads)
            loaded = (extra != 0).any(axis=1)
            live[loaded] += (factor - 1.0) * (live - body)[loaded]
        return assembly, replace(loads, dead=loads.dead + (factor - 1.0) * extra, live=live)


def overload_magnitude(bounds: Bounds = (0.7, 1.3), *, inertial: bool = False) -> Cause:
    """Dead load beyond self weight that is not what was written down: overload x size [-].

    Parameters
    ----------
    inertial : the overload is a mass that is tilted or shaken with the structure, so that its live load (beyond the
        blocks' own weight) changes with it
    """
    return Cause(
        "overload magnitude", "overload_factor", 1.0, bounds, "load cell, jack friction or springs: overload x size",
        apply=OverloadFactor(inertial), unit="-", source="statics",
        isolate="weigh the overload by a second load cell under the wall",
        hidden_when="no specimen has an overload, or dry walls whose whole dead load is overload: twin of gain",
    )  # fmt: skip


@dataclass(frozen=True)
class SkewLive:
    """Live load turned by the size in degrees."""

    plane: str

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if size == 0.0:
            return assembly, loads
        d = live_direction(loads)
        axis = np.array([0.0, 0.0, 1.0]) if self.plane == "horizontal" else np.cross(d, (0.0, 0.0, 1.0))
        if np.linalg.norm(axis) < 1e-9:
            raise ValueError("a vertical live load has no vertical plane of its own: use plane='horizontal'")
        rotation = rotation_matrices(np.radians(size) * axis / np.linalg.norm(axis))
        return assembly, replace(loads, live=turned(loads.live, rotation))


def load_direction(bounds: Bounds = (-15.0, 15.0), *, plane: str = "vertical") -> Cause:
    """Live load that acts in another direction than assumed, by the size [deg].

    Parameters
    ----------
    plane : "vertical", positive upwards (the actuator or the cable rises); "horizontal", positive counter-clockwise
        seen from above
    """
    if plane not in ("vertical", "horizontal"):
        raise ValueError(f"plane must be 'vertical' or 'horizontal', got {plane!r}")
    name, parameter = ("inclined load", "rise_deg") if plane == "vertical" else ("skewed load", "skew_deg")
    return Cause(
        name, parameter, 0.0, bounds, f"the live load is turned by size in the {plane} plane",
        apply=SkewLive(plane), unit="deg", source="statics",
        isolate="push from the other side; measure the cable's or the actuator's angle",
        hidden_when="a few degrees of horizontal skew change the multiplier by 1 - cos(size) only; inclination is near "
        "twin of gain where one mechanism governs",
        methods=("limit", "dem"),
    )  # fmt: skip
