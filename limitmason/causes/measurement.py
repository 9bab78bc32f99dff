"""Causes in the measurement: what the sensor, the rig or the operator made of the true value.

Their ``apply(size, prediction, specimen)`` returns what would have been read. None of them needs the simulator again.
"""

from collections.abc import Mapping
from math import atan, exp, radians, tan
from typing import Any

from limitmason.causes.declare import declare
from limitmason.checks import finite
from limitmason.errors import InputError

ORDER = ("order", "sequence", "time", "date")  # columns that hold the order of tests
LOAD_CELL = ("force", "stiffness")  # what its error goes into: forces, and forces over displacements
SENSOR = ("stiffness", "drift at peak", "drift at first crack")  # what an error of displacements goes into
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


def number(specimen: Any, name: str, cause: str) -> float:
    """The number that a specimen holds under a name.

    Raises
    ------
    InputError
        Naming the cause that needs it.
    """
    value = entry(specimen, name, cause)
    try:
        return finite(f"cause {cause!r}: {name!r} of a specimen", float(value))
    except (TypeError, ValueError):
        raise InputError(f"cause {cause!r}: {name!r} of a specimen must be a number, got {value!r}") from None


@declare(
    "angle offset", parameter="angle_offset_deg", lever="reading", reads=("force",), baseline=0.0, bounds=(-3.0, 3.0),
    unit="deg",
    physics="zero of the inclinometer or a table that is not level",
    source="lambda is the tangent of the tilt angle",
    isolate="turn the specimen or the sensor by 180 degrees and repeat",
    hidden_when="all specimens have nearly one multiplier: twin of gain; tilted in one direction: exact twin of "
    "out-of-plumb",
)
def angle_offset(size: float, prediction: float, specimen: Any) -> float:
    """Zero of the inclinometer off by the size [deg].

    Read lambda = tan(atan lambda + size).

    For tilting tests.
    """
    angle = atan(prediction) + radians(size)
    if angle >= radians(89.9):
        raise InputError(f"an angle offset of {size:g} deg on a multiplier of {prediction:g} passes the vertical: "
                         "a multiplier is the tangent of the tilt, not the angle")
    return max(tan(angle), FLOOR * prediction)


@declare(
    "gain", parameter="gain", lever="reading", baseline=1.0, bounds=(0.7, 1.4), reads=LOAD_CELL,
    drifts=ORDER,
    physics="calibration of the load cell or the accelerometer", source="linear sensor",
    isolate="calibrate the sensor against a known load",
    hidden_when="any cause that changes all specimens by one factor, such as friction where all slide",
)
def gain(size: float, prediction: float, specimen: Any) -> float:
    """Sensor with a wrong gain: read value = size x value [-]."""
    return size * prediction


@declare(
    "sensor drift", parameter="drift_per_test", lever="reading", baseline=0.0, bounds=(-0.03, 0.03), unit="per test",
    reads=LOAD_CELL, variant=lambda order: {"own": (order,)},
    physics="the load cell or its amplifier drifts: value x exp(size (order - 1))",
    source="exponential drift; the law is assumed", isolate="calibrate before and after the campaign",
    hidden_when="the order of tests follows another covariate, such as the height; twin of wear where all slide",
)
def sensor_drift(size: float, prediction: float, specimen: Any, *, order: str = "order") -> float:
    """Load cell that reads more from test to test.

    Read value = value exp(size (order - 1)).

    Parameters
    ----------
    order : name under which every specimen holds the number of its test, 1 for the first
    """
    return prediction * exp(size * (number(specimen, order, "sensor drift") - 1.0))


def _displaced(factor: float, prediction: float, quantity: str) -> float:
    """A drift or a stiffness where displacements are read so many times larger."""
    return prediction / factor if quantity == "stiffness" else prediction * factor


@declare(
    "gain of displacements", parameter="displacement_gain", lever="reading", baseline=1.0, bounds=(0.7, 1.4),
    reads=SENSOR, physics="calibration of the displacement sensor: drifts x size, stiffness / size",
    source="linear sensor", isolate="calibrate the sensor against gauge blocks; a second sensor",
    hidden_when="peaks and frequencies, which it does not enter; one joint stiffness for all specimens",
)
def displacement_gain(size: float, prediction: float, specimen: Any, quantity: str = "stiffness") -> float:
    """Displacement sensor with a wrong gain.

    Displacements are size [-] times theirs, a stiffness is divided by it.
    """
    return _displaced(size, prediction, quantity)


@declare(
    "wrong control point", parameter="control_point_m", lever="reading", baseline=0.0, bounds=(-0.5, 0.5), unit="m",
    reads=SENSOR, variant=lambda height: {"own": (height,)},
    physics="the sensor sits size above the point that the model reports: displacements x (h + size) / h",
    source="a wall that turns about its base or shears evenly: displacements in proportion to the height",
    isolate="measure the height of the sensor; sensors at two heights",
    hidden_when="specimens of one height: twin of a gain of displacements",
)
def control_point(
    size: float, prediction: float, specimen: Any, quantity: str = "stiffness", *, height: str = "height"
) -> float:
    """Displacements read at another height than the model's, by the size [m].

    Parameters
    ----------
    height : name under which every specimen holds that of the model's point [m]
    prediction : that is read
    specimen : that was tested
    quantity : what the prediction is of

    Raises
    ------
    InputError
        For a size that puts the sensor below the base.
    """
    above = number(specimen, height, "wrong control point")
    if above + size <= 0.0:
        raise InputError(f"a control point {size:g} m above a height of {above:g} m is below the base")
    return _displaced(1.0 + size / above, prediction, quantity)


@declare(
    "rig compliance", parameter="rig_compliance", lever="reading", baseline=0.0, bounds=(0.0, 5e-8), unit="m/N",
    reads=SENSOR[:2],
    physics="frame, bolts and bearings give way in row with the specimen: displacement + size x force",
    source="springs in row", isolate="a sensor on the specimen itself; push a stiff block in the same rig",
    hidden_when="one stiffness for all specimens: twin of a gain of displacements; peaks do not feel it",
)
def rig_compliance(
    size: float, prediction: float, specimen: Any, quantity: str = "stiffness", *, peak: str = "peak"
) -> float:
    """Displacements that hold those of the rig as well.

    Stiffness read K / (1 + size K), drift at the peak u + size F.

    Parameters
    ----------
    peak : name under which specimens hold the force F at their peak, where a drift at the peak was measured
    prediction : that is read
    specimen : that was tested
    quantity : what the prediction is of
    """
    if quantity == "stiffness":
        return prediction / (1.0 + size * prediction)
    return prediction + size * number(specimen, peak, "rig compliance")


def _shifted(*, covariate: str, label: Any) -> Mapping[str, Any]:
    """Name, parameter and own column of the cause for one batch.

    A trend along its own column cannot rival it: that is what it says.
    """
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
)
def batch_shift(size: float, prediction: float, specimen: Any, *, covariate: str = "batch", label: Any = "B") -> float:
    """Specimens of one batch, sensor or operator read by another gain.

    Value x size [-] where covariate == label.
    """
    return size * prediction if entry(specimen, covariate, "batch shift") == label else prediction


def _taken(*, per: str | None, unit: str) -> Mapping[str, str]:
    """Physics and unit of the cause: a constant force, or one in proportion to what is recorded under ``per``."""
    more = "a constant force" if per is None else f"a force in proportion to {per}"
    return {"physics": f"rollers, hinges or guides take {more}", "unit": unit}


@declare(
    "friction of the rig", parameter="rig_friction", lever="reading", baseline=0.0, bounds=(0.0, 0.1), variant=_taken,
    reads=("force",),
    physics="rollers, hinges or guides take a force", source="Coulomb friction of the guides",
    isolate="run the rig without a specimen; load and unload: the sign changes",
    hidden_when="all specimens carry about the same load: twin of gain",
)
def rig_friction(size: float, prediction: float, specimen: Any, *, per: str | None = None, unit: str = "-") -> float:
    """Force that the loading rig takes before the specimen gets any.

    Read value = value + size [unit of the value].

    Parameters
    ----------
    per : name of what the force grows with, such as the overload on the rollers; the size is then a coefficient
    unit : of the size, for reports
    """
    times = 1.0 if per is None else number(specimen, per, "friction of the rig")
    return max(prediction + size * times, FLOOR * prediction)
