"""What a calibration may change: parameters with start, bounds and the resolution wanted, and their scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import finite, numbers, several, single_number
from limitmason.errors import InputError
from limitmason.storage.frozen import ReadOnly, frozen

RELATIVE = 0.1
"""Resolution of a parameter on the scale of logarithms, a tenth of its value; chosen."""
OF_WIDTH = 0.01
"""Resolution of any other, part of the width of its bounds; chosen."""


@dataclass(frozen=True)
class Parameter:
    """One unknown of a calibration.

    Parameters
    ----------
    name : keyword by which the model takes it, such as a property of ``limitmason.Joint``
    start : first guess, from the literature
    bounds : lowest and highest possible value
    log : fitted on the scale of its logarithm; for every quantity that is positive by nature
    resolution : deviation above which it is called unidentified: relative for ``log``, 0.1 by default; else in its own
        unit, by default a hundredth of the width of the bounds
    unit : shown in tables

    Raises
    ------
    InputError
        For bounds out of order, a start outside them, or a lower bound that is not positive on the scale of logarithms.
    """

    name: str
    start: float
    bounds: tuple[float, float]
    log: bool = True
    resolution: float | None = None
    unit: str = "-"

    def __post_init__(self) -> None:
        """Check every field, and take the default resolution."""
        if not str(self.name).isidentifier():
            raise InputError(f"a parameter's name must be a keyword of the model, got {self.name!r}")
        pair = numbers(f"parameter {self.name!r}: bounds", self.bounds)
        if pair.shape != (2,):
            raise InputError(f"parameter {self.name!r}: bounds (low, high) stand behind the start, got {self.bounds!r}")
        finite(f"parameter {self.name!r}: start", self.start)
        low, high = pair.tolist()
        object.__setattr__(self, "bounds", (low, high))
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(f"parameter {self.name!r}: bounds must be finite and increasing, got {self.bounds!r}")
        if not low <= self.start <= high:
            raise InputError(f"parameter {self.name!r}: the start {self.start!r} lies outside its bounds {self.bounds}")
        if self.log and low <= 0.0:
            raise InputError(f"parameter {self.name!r}: log=True needs a positive lower bound, got {low!r}")
        if self.resolution is None:
            object.__setattr__(self, "resolution", RELATIVE if self.log else OF_WIDTH * (high - low))
        else:
            single_number(label := f"parameter {self.name!r}: the resolution", self.resolution, endless=True)
            if not self.resolution > 0.0:
                raise InputError(f"{label} must be positive, got {self.resolution!r}")

    def inner(self, value: float) -> float:
        """Coordinate of a value on the scale of the fit: its logarithm, or the value itself."""
        return math.log(value) if self.log else value

    def value(self, inner: float) -> float:
        """Value at a coordinate, within the bounds."""
        return min(max(math.exp(inner) if self.log else float(inner), self.bounds[0]), self.bounds[1])


class ParameterScale(ReadOnly):
    """All parameters of a calibration as one vector.

    Parameters
    ----------
    parameters : in the order of the vector
    """

    def __init__(self, parameters: Sequence[Parameter]) -> None:
        """Check the parameters, and take bounds, starts and resolutions to the scale of the fit."""
        self.parameters = several("parameters", parameters, Parameter)
        if not self.parameters:
            raise InputError("no parameters are given: there is nothing to fit")
        self.names = tuple(p.name for p in self.parameters)
        if len(set(self.names)) < len(self.names):
            raise InputError(f"a parameter is given twice: {', '.join(self.names)}")
        self.low = frozen(np.array([p.inner(p.bounds[0]) for p in self.parameters]))
        self.high = frozen(np.array([p.inner(p.bounds[1]) for p in self.parameters]))
        self.start = frozen(np.array([p.inner(p.start) for p in self.parameters]))
        self.resolution = frozen(np.array([p.resolution for p in self.parameters], dtype=float))

    def __len__(self) -> int:
        return len(self.parameters)

    def values(self, vector: Array) -> dict[str, float]:
        """Values of the parameters by name, from their coordinates on the scale of the fit, shape (p,)."""
        return {p.name: p.value(float(x)) for p, x in zip(self.parameters, vector, strict=True)}
