"""The Italian Circular of 2019: a wall that overturns, for one body and for many stones; spectra and their traps."""

import math

import numpy as np
import pytest

import limitmason as lm
from limitmason.codes.circular_2019 import capacity_of
from limitmason.codes.spectra import FloorSpectrum, GroundSpectrum, RecordSpectrum
from limitmason.constants import GRAVITY
from limitmason.errors import InputError

SITE = GroundSpectrum(ag=0.15, f0=2.45, tc_star=0.28)
HEIGHT, THICK = 3.0, 0.30


def overturning():
    """Displacement of the middle of the top and multiplier, at exact finite rotations."""
    theta = np.linspace(0.0, math.atan(THICK / HEIGHT), 4001)
    alpha = np.tan(math.atan(THICK / HEIGHT) - theta)
    return HEIGHT * np.sin(theta) - 0.5 * THICK * (1.0 - np.cos(theta)), alpha


@pytest.mark.parametrize(("bodies", "wanted"), [
    (1, (1.0000, 0.9810, 0.1489, 0.0596, 0.5885, 1.679, 2.338, 0.2372, 0.2000)),
    (2, (0.8000, 1.2262, 0.1861, 0.0744, 0.7356, 1.679, 2.338, 0.2966, 0.2500)),
    (17, (0.7506, 1.3069, 0.1983, 0.0793, 0.7840, 1.679, 2.338, 0.3161, 0.2664)),
    (20000, (0.7500, 1.3080, 0.1985, 0.0794, 0.7846, 1.679, 2.338, 0.3163, 0.2667)),
])  # fmt: skip
def test_the_table_of_a_wall_cut_into_bodies_to_its_digits(bodies, wanted):
    heights = (np.arange(bodies) + 0.5) / bodies
    c = capacity_of(np.ones(bodies), heights, 1.0, 0.1, overturning(), SITE)
    found = (c.mass_share, c.a0, c.d0, c.d["SLV"], c.a["SLV"], c.period["SLV"], c.period["SLC"], c.ag["SLV"])
    digits = (4, 4, 4, 4, 4, 3, 3, 4)
    assert [abs(f - w) <= 0.6 * 10.0**-d for f, w, d in zip(found, wanted, digits, strict=False)] == [True] * 8
    assert c.ag_simplified == pytest.approx(wanted[8], abs=6e-5)
    assert SITE.displacement(c.period["SLV"], 0.08) == pytest.approx(0.0377, abs=6e-5)


@pytest.mark.parametrize(("bodies", "period", "displaced", "simplified"), [
    (1, 1.951, 0.2042, 0.1481), (20000, 1.951, 0.2723, 0.1975),
])  # fmt: skip
def test_the_table_with_a_confidence_factor(bodies, period, displaced, simplified):
    heights = (np.arange(bodies) + 0.5) / bodies
    c = capacity_of(np.ones(bodies), heights, 1.0, 0.1, overturning(), SITE, 1.35)
    assert c.period["SLV"] == pytest.approx(period, abs=6e-4)
    assert c.ag["SLV"] == pytest.approx(displaced, abs=6e-5)
    assert c.ag_simplified == pytest.approx(simplified, abs=6e-5)


def wall(courses):
    """The wall of the table from so many stones, that overturns as one about its edge."""
    made = lm.build.column(
        width=THICK, depth=1.0, unit_height=HEIGHT / courses, courses=courses, joint=lm.Joint(40.0)
    )  # fmt: skip
    return made, lm.Loads.horizontal(made)


def test_the_verdict_does_not_change_with_the_number_of_stones():
    verdicts = {n: lm.assess(*wall(n), SITE, confidence_factor=1.0) for n in (1, 2, 17)}
    for n, found in verdicts.items():
        assert found.bodies.bodies == 1
        assert found.stones.bodies == n
        assert found.bodies.mass_share == pytest.approx(1.0, rel=1e-6)
        assert found.bodies.ag_simplified == pytest.approx(0.2, rel=1e-6)
        assert found.safety["SLV"] == pytest.approx(0.2 / 0.15, rel=1e-6)
    assert verdicts[2].stones.mass_share == pytest.approx(0.8, rel=1e-6)
    assert verdicts[17].stones.mass_share == pytest.approx(0.7506, abs=6e-5)
    assert "the text asks for the bodies" in str(verdicts[17])
    assert not verdicts[1].warnings


def test_a_curve_of_any_control_gives_the_same_displacement():
    """The mean along the loads and the top differ by a factor that the mechanism knows."""
    made, loads = wall(2)
    middle, top = made.blocks[1].name, made.blocks[2].name
    d, alpha = overturning()
    mean = lm.assess(made, loads, SITE, curve=lm.Curve(0.5 * d, alpha, load_unit="-"), confidence_factor=1.0)
    for block, share in ((middle, 0.25), (top, 0.75)):
        other = lm.assess(
            made, loads, SITE, curve=lm.Curve(share * d, alpha, load_unit="-"), control=(block, "x"),
            confidence_factor=1.0,
        )  # fmt: skip
        assert other.bodies.d0 == pytest.approx(mean.bodies.d0, rel=1e-6)
    assert mean.bodies.ag["SLV"] == pytest.approx(0.2372, abs=6e-5)
    assert mean.stones.ag["SLV"] == pytest.approx(0.2966, abs=6e-5)
    with pytest.raises(InputError, match="follow it to where it is zero"):
        lm.assess(made, loads, SITE, curve=lm.Curve(d[:100], alpha[:100], load_unit="-"))
    with pytest.raises(InputError, match="does not move"):
        lm.assess(made, loads, SITE, control=(0, "x"))


def test_capacity_that_is_lost_at_once_ends_the_mechanism_of_slv():
    d, alpha = overturning()
    tied = alpha + np.where(d < 0.05, 0.3, 0.0)
    c = capacity_of(np.ones(1), np.ones(1) * 0.5, 1.0, 0.4, (d, tied), SITE)
    assert c.d["SLV"] == pytest.approx(0.025, abs=1e-4)
    assert c.d["SLC"] == pytest.approx(0.6 * c.d0, rel=1e-12)


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
    for damping in (5.0, 0.0):
        with pytest.raises(InputError, match="damping is a fraction"):
            FloorSpectrum(SITE, [0.3], [1.2], damping=damping)


def test_ground_spectrum_of_the_code():
    """NTC 2018: soil B, ag .15, F0 2.45: SS = 1.4 - .4 2.45 .15 = 1.2 at most, CC = 1.1 Tc*^-.2."""
    soft = GroundSpectrum(0.15, 2.45, 0.28, soil="B", topography=1.2)
    assert soft.amplification == pytest.approx(1.2 * 1.2)
    tc = 1.1 * 0.28**-0.2 * 0.28
    assert soft.acceleration(tc) == pytest.approx(0.15 * GRAVITY * 1.44 * 2.45, rel=1e-12)
    assert soft.acceleration(0.0) == pytest.approx(0.15 * GRAVITY * 1.44, rel=1e-12)
    assert soft.acceleration(4.4) == pytest.approx(0.15 * GRAVITY * 1.44 * 2.45 * tc * 2.2 / 4.4**2, rel=1e-12)
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


@pytest.mark.slow
def test_capacity_curves_of_elastic_joints_give_the_verdict_of_the_rigid_body():
    """d0 of the rigid body by 1 %, whether the wall is one stone or three; and the page draws it."""
    for courses in (1, 3):
        joint = lm.Joint(40.0, normal_stiffness=1e10, shear_stiffness=1e10)
        made = lm.build.column(width=THICK, depth=1.0, unit_height=HEIGHT / courses, courses=courses, joint=joint)
        loads = lm.Loads.horizontal(made)
        curve = lm.pushover(made, loads, to=0.5)
        found = lm.assess(made, loads, SITE, curve=curve, confidence_factor=1.0)
        assert found.bodies.d0 == pytest.approx(0.1489, rel=0.01)
        assert found.bodies.ag["SLV"] == pytest.approx(0.2372, rel=0.02)
    page = lm.figures.assessment(found, SITE, curve, title="Wall")
    assert len(page.axes) == 2
    with pytest.raises(InputError, match="q = 2 alone"):
        lm.figures.assessment(lm.assess(made, loads, SITE), SITE)
