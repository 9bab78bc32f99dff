"""Response spectrum of a ground motion: the largest displacement of oscillators that stand on it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import finite, numbers, positive
from limitmason.constants import GRAVITY
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.storage.csv_table import Tabular
from limitmason.storage.frozen import ReadOnly

_SHORTEST, _LONGEST, _PERIODS = 0.05, 4.0, 100  # [s], [s], [-], chosen: periods where none are asked for

STEPS = 50
"""Steps at least in the shortest period: the period is then off by (2 pi / 50)^2 / 12, a thousandth."""


@dataclass(frozen=True, eq=False)
class ResponseSpectrum(Displayed, Tabular, ReadOnly):
    """Largest response of oscillators on a moving ground, one for each period.

    Parameters
    ----------
    period : of the oscillators without damping [s], shape (k,)
    displacement : largest, against the ground [m], shape (k,)
    damping : of the oscillators over the critical one [-]
    """

    period: Array
    displacement: Array
    damping: float

    @property
    def acceleration(self) -> Array:
        """Pseudo-acceleration, displacement (2 pi / T)^2 [m/s2], shape (k,)."""
        return np.asarray(self.displacement * (2.0 * np.pi / self.period) ** 2)

    def diagram(self) -> dict[str, Any]:
        """What ``plot()`` draws: pseudo-acceleration over the period [g]."""
        columns = {"period": self.period, "acceleration": self.acceleration / GRAVITY}
        label = f"pseudo-acceleration, {self.damping:.0%} damping [g]"
        return {"history": columns, "names": ["acceleration"], "against": "period", "units": {"period": "s"},
                "ylabel": label}

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Columns with their units, and a row for each period."""
        units = {"period": "s", "displacement": "m", "acceleration": "m/s2"}
        return units, [list(row) for row in zip(self.period, self.displacement, self.acceleration, strict=True)]

    def __str__(self) -> str:
        """Peak and range."""
        k, a = int(self.acceleration.argmax()), self.acceleration / GRAVITY
        return (
            f"response spectrum, {self.damping:.0%} damping: {len(a)} periods from {self.period.min():g} to "
            f"{self.period.max():g} s; largest pseudo-acceleration {a[k]:.3g} g at {self.period[k]:.3g} s"
        )

    @classmethod
    def of_record(
        cls, acceleration: ArrayLike, sample_step: float, periods: ArrayLike | None, damping: float
    ) -> ResponseSpectrum:
        """The spectrum of one component of a record.

        The record is linear between samples. The oscillators swing on after its end, for a period of the slowest.

        Parameters
        ----------
        acceleration : [m/s2], shape (n,)
        sample_step : time between samples [s]
        periods : of the oscillators [s], shape (k,); 100 from 0.05 to 4 s where None
        damping : part of the critical one [-]

        Raises
        ------
        InputError
            For samples that are not finite, a step or periods that are not positive, and a damping outside 0 .. 1.
        """
        if periods is None:
            asked = np.geomspace(_SHORTEST, _LONGEST, _PERIODS)
        else:
            asked = np.atleast_1d(numbers("periods", periods)).copy()
        if asked.ndim != 1 or not asked.size or not (np.isfinite(asked) & (asked > 0.0)).all():
            raise InputError(f"periods must be positive numbers [s], got {periods!r}")
        if not 0.0 <= finite("damping", damping) < 1.0:
            raise InputError(f"damping must lie in 0 .. 1, a part of the critical one (0.05 for 5 %), got {damping!r}")
        record, sample_step = numbers("acceleration", acceleration), positive("sample_step", sample_step, "s")
        if record.ndim != 1 or not np.isfinite(record).all():
            raise InputError("acceleration must be finite samples of one component, shape (n,)")
        # the largest displacement may come after the record: each swings on for a period, the slowest too
        rest = np.zeros(math.ceil(float(asked.max()) / sample_step) + 1)
        fine, step = refined(np.concatenate([record, rest]), sample_step, float(asked.min()) / STEPS)
        return cls(asked, largest_displacements(fine, step, 2.0 * np.pi / asked, damping), float(damping))


def refined(samples: Array, step: float, most: float) -> tuple[Array, float]:
    """A record with further samples in between, linear, and its new step [s].

    Parameters
    ----------
    samples : shape (n,)
    step : between them [s]
    most : largest step of the record that is made [s]
    """
    parts = max(1, math.ceil(step / most))
    fine = np.interp(np.arange((len(samples) - 1) * parts + 1) / parts, np.arange(len(samples)), samples)
    return np.asarray(fine), step / parts


def largest_displacements(record: Array, h: float, omega: Array, damping: float) -> Array:
    """Largest displacement of oscillators against the ground [m], shape (k,).

    Integrated by the mean acceleration of every step (Newmark with beta 1/4 and gamma 1/2), which is stable at any
    step. The oscillators begin at rest.

    Parameters
    ----------
    record : acceleration of the ground [m/s2], shape (n,)
    h : its step [s]
    omega : angular frequency of each oscillator [rad/s], shape (k,)
    damping : over the critical one [-]
    """
    u, v, a = np.zeros_like(omega), np.zeros_like(omega), np.full_like(omega, -record[0])
    largest = np.zeros_like(omega)
    # factor of the new acceleration in the equilibrium of a unit mass at the end of a step
    mass = 1.0 + damping * omega * h + 0.25 * (omega * h) ** 2
    for ground in record[1:]:
        # as far as the old acceleration takes them; the new one follows from equilibrium
        step_u, step_v = u + h * v + 0.25 * h * h * a, v + 0.5 * h * a
        a = (-ground - 2.0 * damping * omega * step_v - omega**2 * step_u) / mass
        u, v = step_u + 0.25 * h * h * a, step_v + 0.5 * h * a
        np.maximum(largest, np.abs(u), out=largest)
    return largest
