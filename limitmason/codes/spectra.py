"""Demand of the Italian code: spectra of the ground, of a floor above it, and of records."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.checks import choice, finite, instance, not_negative, numbers, positive
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.model.response_spectrum import ResponseSpectrum

LARGEST_AG = 2.0
"""Acceleration of the ground over g beyond which a number is no such thing."""

_LARGEST = 100.0  # of any number of a spectrum: one above it is in other units
_LONGEST_TC = 2.0  # [s]: a start of the branch of constant velocity above it is in other units
_PERIODS = 40  # of oscillators between the shortest and the longest that a record is asked for; chosen


class _Soil(NamedTuple):
    """Soil of NTC 2018, Table 3.2.IV: SS = upper - slope F0 ag / g, from least to most; CC = factor Tc*^exponent."""

    upper: float
    slope: float
    least: float
    most: float
    factor: float
    exponent: float


_SOILS = {
    "A": _Soil(1.0, 0.0, 1.0, 1.0, 1.00, 0.0),
    "B": _Soil(1.4, 0.4, 1.0, 1.2, 1.10, -0.20),
    "C": _Soil(1.7, 0.6, 1.0, 1.5, 1.05, -0.33),
    "D": _Soil(2.4, 1.5, 0.9, 1.8, 1.25, -0.50),
    "E": _Soil(2.0, 1.1, 1.0, 1.6, 1.15, -0.40),
}


def damping_factor(damping: float) -> float:
    """Factor of the spectrum for a damping, eta = sqrt(10 / (5 + 100 xi)), 0.55 or more [-].

    Parameters
    ----------
    damping : xi, a fraction of the critical one [-]
    """
    if not 0.0 < finite("damping", damping) < 1.0:
        raise InputError(f"damping is a fraction, 0.05 for five per cent, got {damping!r}")
    return max(math.sqrt(10.0 / (5.0 + 100.0 * damping)), 0.55)


@dataclass(frozen=True)
class GroundSpectrum:
    """Elastic spectrum of the ground, NTC 2018, 3.2.3.2.1.

    Parameters
    ----------
    ag : peak acceleration on rock over g, at most 2 [-]
    f0 : largest amplification, 1 or more [-]
    tc_star : start of the branch of constant velocity on rock, at most 2 [s]
    soil : class "A" to "E"
    topography : factor ST, 1 or more [-]
    """

    ag: float
    f0: float
    tc_star: float
    soil: str = "A"
    topography: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("ag", "f0", "tc_star", "topography"):
            if not 0.0 < (value := finite(f"ground spectrum: {name}", getattr(self, name))) < _LARGEST:
                raise InputError(f"ground spectrum: {name} must lie between 0 and {_LARGEST:g}, got {value:g}")
        if self.ag > LARGEST_AG:
            raise InputError(f"ground spectrum: ag is over g, got {self.ag!r}; is it in m/s2?")
        if min(self.f0, self.topography) < 1.0 or self.tc_star > _LONGEST_TC:
            raise InputError(
                f"ground spectrum: f0 and topography are 1 or more, tc_star at most 2 s; got f0 {self.f0!r}, tc_star "
                f"{self.tc_star!r} and topography {self.topography!r}"
            )
        choice("ground spectrum: soil", self.soil, _SOILS)

    @property
    def amplification(self) -> float:
        """S = SS ST [-]."""
        soil = _SOILS[self.soil]
        return min(max(soil.upper - soil.slope * self.f0 * self.ag, soil.least), soil.most) * self.topography

    def scaled(self, ag: float) -> GroundSpectrum:
        """The spectrum of another peak acceleration over g [-], F0 and Tc* as they are."""
        return replace(self, ag=ag)

    def acceleration(self, period: float, damping: float = 0.05) -> float:
        r"""Spectral acceleration Se(T) [m/s2] at a period [s] and damping [-], NTC 2018, 3.2.3.2.1.

        .. math:: a_g S \eta F_0 \min(1, T_C / T, T_C T_D / T^2), \qquad T_D = 4 a_g / g + 1.6
        """
        period = not_negative("period [s]", period)
        eta, soil = damping_factor(damping), _SOILS[self.soil]
        tc = soil.factor * self.tc_star**soil.exponent * self.tc_star
        tb, td = tc / 3.0, 4.0 * self.ag + 1.6
        top = self.ag * GRAVITY * self.amplification * eta * self.f0
        if period < tb:
            return top * (period / tb + (1.0 - period / tb) / (eta * self.f0))
        return top * min(1.0, tc / period, tc * td / period**2)

    def displacement(self, period: float, damping: float = 0.05) -> float:
        """SDe(T) = Se(T) (T / 2 pi)^2 [m], beyond T_E of 3.2.3.2.3 too, where the code lets it fall."""
        return self.acceleration(period, damping) * (period / (2.0 * math.pi)) ** 2


@dataclass(frozen=True)
class FloorSpectrum:
    r"""Spectrum at a height of a building whose modes are known, C7.2.5 to C7.2.8.

    .. math:: S_{eZ}(T) = \left[\textstyle\sum_k S_{eZ,k}^2\right]^{1/2}, \qquad
        a_{Z,k} = S_e(T_k, \xi_k) |\gamma_k \psi_k| \sqrt{1 + 0.0004 (100 \xi_k)^2}

    Parameters
    ----------
    ground : spectrum below the building
    periods : T_k of its modes, longest first [s]
    factors : gamma_k psi_k(z), participation times shape at the height [-]; gamma_1 = 3 n / (2 n + 1) of n storeys
    damping : xi_k, as a fraction in every equation here: C7.2.6 divides by its root, C7.2.7 means per cent
    """

    ground: GroundSpectrum
    periods: Sequence[float]
    factors: Sequence[float]
    damping: float = 0.05

    def __post_init__(self) -> None:
        """Check the modes."""
        instance("ground", self.ground, GroundSpectrum)
        damping_factor(self.damping)
        for name in ("periods", "factors"):
            values = np.atleast_1d(numbers(f"floor spectrum: {name}", getattr(self, name))).tolist()
            object.__setattr__(self, name, tuple(finite(f"floor spectrum: {name}", v) for v in values))
        if not self.periods or len(self.periods) != len(self.factors) or not min(self.periods) > 0.0:
            raise InputError("floor spectrum: give a period above 0 and a factor for every mode")

    def scaled(self, ag: float) -> FloorSpectrum:
        """The spectrum over another peak acceleration of the ground over g [-]."""
        return replace(self, ground=self.ground.scaled(ag))

    def peaks(self) -> list[float]:
        """Peak acceleration a_Zk of every mode [m/s2]."""
        more = math.sqrt(1.0 + 0.0004 * (100.0 * self.damping) ** 2)
        return [
            self.ground.acceleration(t, self.damping) * abs(f) * more
            for t, f in zip(self.periods, self.factors, strict=True)
        ]

    def acceleration(self, period: float, damping: float = 0.05) -> float:
        """SeZ(T) at a period [s] and damping [-], not below Se(T) beyond the first period [m/s2].

        Raises
        ------
        InputError
            Where 1.1 eta(damping) / sqrt(xi_k) is below 1: the formula then has a pole above the period of a mode.
        """
        period = not_negative("period [s]", period)
        # C7.2.6 and C7.2.8: factors 1.1, 0.8 and exponents 1.6, 1.2 are those of the text
        resonance = 1.1 * self.damping**-0.5 * damping_factor(damping)
        if resonance < 1.0:
            raise InputError(
                f"floor spectrum: C7.2.6 holds where resonance amplifies; with a damping of {self.damping:.3g} in the "
                f"building and {damping:.3g} in what stands there, 1.1 eta / sqrt(xi) is {resonance:.2f}: give a "
                f"damping of the building up to {min((1.1 * damping_factor(damping)) ** 2, 1.0):.2f}"
            )
        total = 0.0
        for t, peak in zip(self.periods, self.peaks(), strict=True):
            # resonance is whole from 0.8 to 1.1 of the period of the mode, and falls off on both sides
            below, above = 1.0 - period / (0.8 * t), period / (1.1 * t) - 1.0
            fall = 1.0 + (resonance - 1.0) * (max(below, 0.0) ** 1.6 + max(above, 0.0) ** 1.2)
            total += (resonance * peak / fall) ** 2
        # softer than all modes of the building, it follows the ground
        own = self.ground.acceleration(period, damping) if period > max(self.periods) else 0.0
        return max(math.sqrt(total), own)

    def displacement(self, period: float, damping: float = 0.05) -> float:
        """SeZ(T) (T / 2 pi)^2, beyond b T_1 not below SeZ(T_1) (b T_1 / 2 pi)^2, C8.7.1.12 [m].

        Parameters
        ----------
        period : [s]
        damping : part of the critical one [-]
        """
        first = max(self.periods)
        edge = 1.1 * first  # b = 1.1, where resonance ends
        own = self.acceleration(period, damping) * (period / (2.0 * math.pi)) ** 2
        return own if period <= edge else max(own, self.acceleration(first, damping) * (edge / (2.0 * math.pi)) ** 2)


@dataclass(frozen=True, eq=False)
class RecordSpectrum:
    """Displacement spectrum of a record, largest between two periods.

    C8.7.1.2.1 takes it for records of a site.

    Parameters
    ----------
    record : acceleration of the ground [m/s2], shape (n,)
    sample_step : [s]
    least : shortest period asked, that of the elastic branch [s]
    ag : peak over g that the record stands for, at most 2; by default, 0, that of the record itself, whatever it is
    """

    record: ArrayLike
    sample_step: float
    least: float
    ag: float = 0.0

    def __post_init__(self) -> None:
        """Check the samples; take their peak where none is given."""
        samples = numbers("record", self.record)
        if samples.ndim != 1 or len(samples) < 2 or not np.isfinite(samples).all() or not samples.any():
            raise InputError("record: give two or more finite samples, not all zero")
        for name in ("sample_step", "least"):
            positive(f"record: {name}", getattr(self, name), "s")
        object.__setattr__(self, "record", samples)
        given = not_negative("record: ag", self.ag)
        if given > LARGEST_AG:
            raise InputError(f"record: ag is over g, got {self.ag!r}; is it in m/s2?")
        object.__setattr__(self, "ag", given or float(np.abs(samples).max()) / GRAVITY)

    def scaled(self, ag: float) -> RecordSpectrum:
        """The record with all its samples scaled to another peak over g [-]."""
        ag = positive("record: ag", ag)
        return replace(self, record=np.asarray(self.record) * (ag / self.ag), ag=ag)

    def displacement(self, period: float, damping: float = 0.05) -> float:
        """Largest displacement of oscillators of periods from ``least`` on [m].

        The record is linear between samples. The oscillators swing on after it.

        Parameters
        ----------
        period : the longest [s]
        damping : part of the critical one [-]
        """
        period = positive("period", period, "s")
        periods = np.geomspace(min(self.least, period), period, _PERIODS)
        return float(ResponseSpectrum.of_record(self.record, self.sample_step, periods, damping).displacement.max())
