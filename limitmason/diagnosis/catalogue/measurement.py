"""Causes in the measurement: what the sensor, the rig or the operator made of the true value.

Their ``apply(size, prediction, specimen)`` returns what would have been read. None of them needs the simulator again.
"""

from dataclasses import dataclass
from math import atan, radians, tan
from typing import Any

from limitmason.diagnosis.cause import Cause

Bounds = tuple[float, float]
FLOOR = 1e-3  # of the prediction: a reading stays positive, so that its logarithm exists


def entry(specimen: Any, name: str, cause: str) -> Any:
    """What a specimen holds under a name.

    Raises
    ------
    ValueError
        Naming the cause that needs it.
    """
    try:
        return specimen[name] if hasattr(specimen, "keys") else getattr(specimen, name)
    except (KeyError, AttributeError):
        raise ValueError(f"cause {cause!r} needs {name!r} in every specimen") from None


@dataclass(frozen=True)
class AngleOffset:
    """tan(atan(prediction) + offset)."""

    def __call__(self, size: float, prediction: float, specimen: Any) -> float:
        """Reading."""
        if size == 0.0:
            return prediction
        angle = atan(prediction) + radians(size)
        if angle >= radians(89.9):
            raise ValueError(f"an angle offset of {size:g} deg on a multiplier of {prediction:g} passes the vertical")
        return max(tan(angle), FLOOR * prediction)


def angle_offset(bounds: Bounds = (-3.0, 3.0)) -> Cause:
    """Zero of the inclinometer off by the size [deg]: read lambda = tan(atan lambda + size); for tilting tests."""
    return Cause(
        "angle offset", "angle_offset_deg", 0.0, bounds, "zero of the inclinometer or a table that is not level",
        "measurement", AngleOffset(), "deg", "lambda is the tangent of the tilt angle",
        "turn the specimen or the sensor by 180 degrees and repeat",
        "all specimens have nearly one multiplier: twin of gain; tilted in one direction: exact twin of out-of-plumb",
    )  # fmt: skip


@dataclass(frozen=True)
class Gain:
    """size x prediction."""

    def __call__(self, size: float, prediction: float, specimen: Any) -> float:
        """Reading."""
        return size * prediction


def gain(bounds: Bounds = (0.7, 1.4)) -> Cause:
    """Sensor with a wrong gain: read value = size x value [-]."""
    return Cause(
        "gain", "gain", 1.0, bounds, "calibration of the load cell or the accelerometer", "measurement", Gain(), "-",
        "linear sensor", "calibrate the sensor against a known load",
        "any cause that changes all specimens by one factor, such as friction where all slide",
    )  # fmt: skip


@dataclass(frozen=True)
class BatchShift:
    """size x prediction for the specimens of one batch."""

    covariate: str
    label: Any

    def __call__(self, size: float, prediction: float, specimen: Any) -> float:
        """Reading."""
        return size * prediction if entry(specimen, self.covariate, "batch shift") == self.label else prediction


def batch_shift(bounds: Bounds = (0.7, 1.4), *, covariate: str = "batch", label: Any = "B") -> Cause:
    """Specimens of one batch, sensor or operator read by another gain: value x size [-] where covariate == label."""
    return Cause(
        f"shift of {covariate} {label}", f"shift_{covariate}_{label}".replace(" ", "_"), 1.0, bounds,
        f"another sensor, operator or delivery: specimens with {covariate} = {label} read size times the value",
        "measurement", BatchShift(covariate, label), "-", "linear sensor", "test one configuration in both batches",
        "the batch goes with a change of geometry or load",
    )  # fmt: skip


@dataclass(frozen=True)
class RigFriction:
    """Prediction plus size, or plus size times what a specimen holds under a name."""

    per: str | None

    def __call__(self, size: float, prediction: float, specimen: Any) -> float:
        """Reading."""
        if size == 0.0:
            return prediction
        times = 1.0 if self.per is None else float(entry(specimen, self.per, "friction of the rig"))
        return max(prediction + size * times, FLOOR * prediction)


def rig_friction(bounds: Bounds = (0.0, 0.1), *, per: str | None = None, unit: str = "-") -> Cause:
    """Force that the loading rig takes before the specimen gets any: read value = value + size [unit of the value].

    Parameters
    ----------
    per : name of what the force grows with, such as the overload on the rollers; the size is then a coefficient
    unit : of the size
    """
    more = "a constant force" if per is None else f"a force in proportion to {per}"
    return Cause(
        "friction of the rig", "rig_friction", 0.0, bounds, f"rollers, hinges or guides take {more}", "measurement",
        RigFriction(per), unit, "Coulomb friction of the guides",
        "run the rig without a specimen; load and unload: the sign changes",
        "all specimens carry about the same load: twin of gain",
    )  # fmt: skip
