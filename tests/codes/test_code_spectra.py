"""Spectra of the Italian code and of records: formulas by hand, oscillators in closed form."""

import math

import numpy as np
import pytest

from limitmason.codes.spectra import FloorSpectrum, GroundSpectrum, RecordSpectrum
from limitmason.constants import GRAVITY
from limitmason.errors import InputError

SITE = GroundSpectrum(ag=0.15, f0=2.45, tc_star=0.28)


def test_damping_is_a_fraction_in_one_equation_and_per_cent_in_the_next():
    """1.1 / sqrt(0.05) = 4.92 and sqrt(1 + 0.0004 25) = 1.005; "5" in both would give 0.49 and 1.005."""
    floor = FloorSpectrum(SITE, [0.3], [1.2], damping=0.05)
    peak = SITE.acceleration(0.3, 0.05) * 1.2 * math.sqrt(1.01)
    assert floor.peaks() == pytest.approx([peak], rel=1e-12)
    assert floor.acceleration(0.3, 0.05) == pytest.approx(1.1 / math.sqrt(0.05) * peak, rel=1e-12)
    assert floor.acceleration(1e-9, 0.05) == pytest.approx(peak, rel=1e-6)  # what is stiff moves with the floor
    # far above its period the floor is still, not below the ground
    assert floor.acceleration(3.0) >= SITE.acceleration(3.0)
    assert floor.displacement(2.0) >= floor.acceleration(0.33) * (0.33 / (2 * math.pi)) ** 2
    both = FloorSpectrum(SITE, np.array([0.3, 0.1]), np.array([1.2, -0.3]))
    still = both.acceleration(0.3, 0.08) * (1.1 * 0.3 / (2 * math.pi)) ** 2  # C8.7.1.12: at T_1, not at b T_1
    assert both.displacement(0.5, 0.08) == pytest.approx(still, rel=1e-12)
    for factors, words in ((1.2, "a factor for every mode"), ([math.nan, 1.0], "factors must be a finite number")):
        with pytest.raises(InputError, match=words):
            FloorSpectrum(SITE, [0.3, 0.1], factors)
    for damping in (5.0, 0.0):
        with pytest.raises(InputError, match="damping is a fraction"):
            FloorSpectrum(SITE, [0.3], [1.2], damping=damping)


@pytest.mark.parametrize(("own", "damping"), [(0.6, 0.5), (0.9, 0.1)])
def test_a_floor_spectrum_whose_resonance_does_not_amplify_is_refused(own, damping):
    """1.1 eta / sqrt(xi) < 1 has a pole above the period of a mode: 24,500 m/s2 at five times it for .6 and .5."""
    edge = 1.1**2 * max(10.0 / (5.0 + 100.0 * damping), 0.55**2)
    with pytest.raises(InputError, match=f"building up to {edge:.2f}"):
        FloorSpectrum(SITE, [0.3], [1.3], own).acceleration(1.5, damping)
    # resonance is 1 at the edge of what is taken: what stands on the floor moves as it does, at every period
    floor = FloorSpectrum(SITE, [0.3], [1.3], edge * (1.0 - 1e-12))
    assert floor.acceleration(0.2, damping) == pytest.approx(floor.peaks()[0], rel=1e-9)


def test_ground_spectrum_of_the_code():
    """NTC 2018: soil B, ag .15, F0 2.45: SS = 1.4 - .4 2.45 .15 = 1.2 at most, CC = 1.1 Tc*^-.2."""
    soft = GroundSpectrum(0.15, 2.45, 0.28, soil="B", topography=1.2)
    assert soft.amplification == pytest.approx(1.2 * 1.2)
    tc = 1.1 * 0.28**-0.2 * 0.28
    assert soft.acceleration(tc) == pytest.approx(0.15 * GRAVITY * 1.44 * 2.45, rel=1e-12)
    assert soft.acceleration(0.0) == pytest.approx(0.15 * GRAVITY * 1.44, rel=1e-12)
    assert soft.acceleration(4.4) == pytest.approx(0.15 * GRAVITY * 1.44 * 2.45 * tc * 2.2 / 4.4**2, rel=1e-12)
    for wrong in (-1.0, float("nan"), "1"):
        with pytest.raises(InputError, match="period"):
            soft.acceleration(wrong)
        with pytest.raises(InputError, match="period"):
            FloorSpectrum(soft, [0.3], [1.2]).acceleration(wrong)
    with pytest.raises(InputError, match="soil must be"):
        GroundSpectrum(0.15, 2.45, 0.28, soil="F")
    with pytest.raises(InputError, match=r"in m/s2"):
        GroundSpectrum(2.5, 2.45, 0.28)


def test_spectrum_of_a_record_is_the_largest_over_the_periods():
    """A sine at the period of an oscillator: a / (2 xi w^2) (1 - exp(-xi w t)) after n turns."""
    period, xi, turns = 0.5, 0.05, 12
    w = 2 * math.pi / period
    record = np.sin(w * np.arange(0.0, turns * period, 0.005))
    wanted = (1.0 - math.exp(-xi * w * turns * period)) / (2 * xi * w * w)
    found = RecordSpectrum(record, 0.005, least=period)
    assert found.displacement(period, xi) == pytest.approx(wanted, rel=0.02)
    wider = RecordSpectrum(record, 0.005, least=0.3)
    assert wider.displacement(0.9, xi) == pytest.approx(wanted, rel=0.02)  # 0.9 s alone would be far less
    assert wider.scaled(2.0 * wider.ag).displacement(0.9, xi) == pytest.approx(2 * wider.displacement(0.9, xi))


def test_oscillators_swing_on_after_a_record():
    """A triangle of 0.02 s is a blow v = a t / 2: v / w exp(-z / s acos(z)), s^2 = 1 - z^2, long after it."""
    period, z, step = 2.0, 0.08, 0.01
    w, s = 2 * math.pi / period, math.sqrt(1.0 - z * z)
    wanted = 3.0 * step / w * math.exp(-z / s * math.acos(z))
    blow = RecordSpectrum([0.0, 3.0, 0.0], step, least=period)
    assert blow.displacement(period, z) == pytest.approx(wanted, rel=2e-3)
