"""Causes in the measurement: what the sensor, the rig or the operator made of the true value.

Their ``apply(size, prediction, specimen)`` returns what would have been read. None of them needs the simulator again.
"""

from collections.abc import Mapping
from math import atan, radians, tan
from typing import Any

from limitmason.causes.declare import declare
from limitmason.errors import InputError

LOAD_CELL = ("force", "stiffness")  # what its error goes into: forces, and forces over displacements
FLOOR = 1e-3  # of the prediction: a reading stays positive, so that its logarithm exists


def entry(specimen: Any, name: str, cause: str) -> Any:
    """What a specimen holds under a name.

    Raises
    ------
    InputError
        Naming the cause that needs it.
    """
    try:
        return specimen[name] if hasattr(specimen, "keys") else getattr(specimen, name)
    except (KeyError, AttributeError):
        raise InputError(f"cause {cause!r} needs {name!r} in every specimen") from None


@declare(
    "angle offset", parameter="angle_offset_deg", lever="reading", reads=("force",), baseline=0.0, bounds=(-3.0, 3.0),
    unit="deg",
    physics="zero of the inclinometer or a table that is not level",
    source="lambda is the tangent of the tilt angle",
    isolate="turn the specimen or the sensor by 180 degrees and repeat",
    hidden_when="all specimens have nearly one multiplier: twin of gain; tilted in one direction: exact twin of "
    "out-of-plumb",
)  # fmt: skip
def angle_offset(size: float, prediction: float, specimen: Any) -> float:
    """Zero of the inclinometer off by the size [deg].

    Read lambda = tan(atan lambda + size).

    For tilting tests.
    """
    angle = atan(prediction) + radians(size)
    if angle >= radians(89.9):
        raise InputError(f"an angle offset of {size:g} deg on a multiplier of {prediction:g} passes the vertical")
    return max(tan(angle), FLOOR * prediction)


@declare(
    "gain", parameter="gain", lever="reading", baseline=1.0, bounds=(0.7, 1.4), reads=LOAD_CELL,
    physics="calibration of the load cell or the accelerometer", source="linear sensor",
    isolate="calibrate the sensor against a known load",
    hidden_when="any cause that changes all specimens by one factor, such as friction where all slide",
)  # fmt: skip
def gain(size: float, prediction: float, specimen: Any) -> float:
    """Sensor with a wrong gain: read value = size x value [-]."""
    return size * prediction


def _shifted(*, covariate: str, label: Any) -> Mapping[str, Any]:
    return {
        "name": f"shift of {covariate} {label}",
        "parameter": f"shift_{covariate}_{label}".replace(" ", "_"),
        "own": (covariate,),
        "physics": f"another sensor, operator or delivery: specimens with {covariate} = {label} read size times the "
        "value",
    }


@declare(
    "batch shift", parameter="shift", lever="reading", baseline=1.0, bounds=(0.7, 1.4), variant=_shifted,
    reads=LOAD_CELL,
    physics="another sensor, operator or delivery", source="linear sensor",
    isolate="test one configuration in both batches", hidden_when="the batch goes with a change of geometry or load",
)  # fmt: skip
def batch_shift(
    size: float, prediction: float, specimen: Any, *, covariate: str = "batch", label: Any = "B"
) -> float:  # fmt: skip
    """Specimens of one batch, sensor or operator read by another gain.

    Value x size [-] where covariate == label.
    """
    return size * prediction if entry(specimen, covariate, "batch shift") == label else prediction


def _taken(*, per: str | None, unit: str) -> Mapping[str, str]:
    more = "a constant force" if per is None else f"a force in proportion to {per}"
    return {"physics": f"rollers, hinges or guides take {more}", "unit": unit}


@declare(
    "friction of the rig", parameter="rig_friction", lever="reading", baseline=0.0, bounds=(0.0, 0.1), variant=_taken,
    reads=("force",),
    physics="rollers, hinges or guides take a force", source="Coulomb friction of the guides",
    isolate="run the rig without a specimen; load and unload: the sign changes",
    hidden_when="all specimens carry about the same load: twin of gain",
)  # fmt: skip
def rig_friction(
    size: float, prediction: float, specimen: Any, *, per: str | None = None, unit: str = "-"
) -> float:  # fmt: skip
    """Force that the loading rig takes before the specimen gets any.

    Read value = value + size [unit of the value].

    Parameters
    ----------
    per : name of what the force grows with, such as the overload on the rollers; the size is then a coefficient
    unit : of the size, for reports
    """
    times = 1.0 if per is None else float(entry(specimen, per, "friction of the rig"))
    return max(prediction + size * times, FLOOR * prediction)
