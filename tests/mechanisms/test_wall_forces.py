"""Four formulas of a wall in plane: closed forms of sections, stress states and units; the table of measured walls."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import limitmason as lm
import mechanisms
from limitmason.errors import InputError

WALL = {"stress": 0.6e6, "strength": 6e6, "cohesion": 0.2e6, "friction": 0.6, "diagonal_strength": 0.2e6}
SIZE = (1.5, 2.0, 0.3, 1.0)


def forces(size=SIZE, unit=(0.25, 0.065), **changed):
    return mechanisms.wall_forces(*size, unit=unit, **{**WALL, **changed})


def test_rocking_is_the_moment_of_a_rectangular_block_of_stress_at_the_toe():
    length, _, t, h0 = SIZE
    load = WALL["stress"] * length * t
    block = load / (0.85 * WALL["strength"] * t)  # length of the block
    assert forces().rocking == pytest.approx(load * 0.5 * (length - block) / h0)
    assert forces(strength=1e15).rocking == pytest.approx(load * length / 2.0 / h0)


@pytest.mark.parametrize("cohesion", [0.0, 0.05e6, 0.2e6])
def test_sliding_has_cohesion_on_the_length_that_linear_stress_compresses(cohesion):
    length, _, t, h0 = SIZE
    load = WALL["stress"] * length * t

    def lack(v):
        compressed = min(length, 3.0 * (0.5 * length - v * h0 / load))
        return WALL["friction"] * load + cohesion * t * compressed - v

    assert forces(cohesion=cohesion).sliding == pytest.approx(brentq(lack, 0.0, 1e7))


def test_diagonal_crack_opens_where_the_principal_stress_at_the_centre_reaches_the_strength():
    length, height, t, _ = SIZE
    found = forces().diagonal_cracking
    b = height / length
    shear = b * found / (length * t)
    stress = np.array([[0.0, shear], [shear, -WALL["stress"]]])
    assert np.linalg.eigvalsh(stress).max() == pytest.approx(WALL["diagonal_strength"])
    wide, tall = forces((4.0, 2.0, 0.3, 1.0)), forces((1.0, 9.0, 0.3, 1.0))
    root = math.sqrt(1.0 + WALL["stress"] / WALL["diagonal_strength"]) * WALL["diagonal_strength"] * 0.3
    assert wide.diagonal_cracking == pytest.approx(4.0 * root)
    assert tall.diagonal_cracking == pytest.approx(1.0 * root / 1.5)


def test_stepped_crack_slides_on_the_half_of_a_unit_that_is_relieved():
    lb, hb = 0.25, 0.065
    tau = forces().stepped_cracking / (SIZE[0] * SIZE[2])
    # without shear in head joints the couple tau lb hb of a unit moves stress from one half to the other
    relieved = WALL["stress"] - 2.0 * tau * hb / lb
    assert tau == pytest.approx(WALL["cohesion"] + WALL["friction"] * relieved)


def test_smallest_governs_and_says_which():
    found = forces()
    assert found.smallest == min(found)
    assert (found.governing, found.mode) == ("diagonal cracking", "S")
    assert forces(diagonal_strength=9e6, cohesion=2e6).mode == "F"
    assert forces(strength=0.65e6).rocking == 0.0  # the block would be longer than the wall


@pytest.mark.parametrize(
    ("changed", "said"),
    [({"stress": 7e6}, "not below strength"), ({"cohesion": -1.0}, "cohesion must"), ({"friction": 0.0}, "friction")],
)
def test_wrong_numbers_are_named(changed, said):
    with pytest.raises(InputError, match=said):
        forces(**changed)


def test_piers_of_the_circular_meet_their_equations():
    """Squat b = 1, slender b = 1.5; irregular bond is Turnsek and Cacovic with ft = 1.5 tau0."""
    given = {"stress": 0.3e6, "shear_strength": 0.05e6, "cohesion": 0.1e6, "friction": 0.4, "interlocking": 0.5,
             "unit_tension": 0.8e6}
    squat = mechanisms.circular_pier_forces(2.0, 1.0, 0.4, **given)
    assert squat.irregular == pytest.approx(0.8 * 0.075e6 * 5.0**0.5)
    assert squat.stepped == pytest.approx(0.8 * 0.22e6 / 1.2)
    assert squat.through_units == pytest.approx(0.8 * 0.8e6 / 2.3 * (1.0 + 3.0 / 8.0) ** 0.5)
    assert squat.regular == squat.stepped
    slender = mechanisms.circular_pier_forces(1.0, 3.0, 0.4, **given)
    assert slender.irregular == pytest.approx(squat.irregular / 3.0)
    with pytest.raises(InputError, match="interlocking"):
        mechanisms.circular_pier_forces(1.0, 3.0, 0.4, **{**given, "interlocking": 0.0})


def test_rocking_on_a_crushed_toe_is_the_limit_load_of_a_block_of_any_size():
    """V H = N L / 2 (1 - s / fc), stress block at the full strength: EN 1998-3 with 0.85 fc written as fc."""
    rng = np.random.default_rng(3)
    drawn = rng.uniform((0.2, 0.5, 0.1, 0.0, 1.5), (1.0, 2.0, 1.0, 3.0, 20.0), (30, 5))
    for length, height, depth, press, spare in drawn:
        weight = 2000.0 * 9.81 * length * height * depth
        force = weight * (1.0 + press)
        stress = force / (length * depth)
        joint = lm.Joint.from_friction_coefficient(3.0, compressive_strength=spare * stress)
        pier = lm.build.column(width=length, depth=depth, unit_height=height, courses=1, joint=joint)
        at = (length / 2.0, depth / 2.0, height)
        loads = lm.Loads.weight(pier).with_point_load(pier, 1, (0, 0, weight - force), at=at, case="dead")
        loads = loads.with_point_load(pier, 1, (weight, 0, 0), at=at)
        found = lm.limit_analysis(pier, loads).collapse_multiplier * weight
        assert found == pytest.approx(force * length / (2.0 * height) * (1.0 - 1.0 / spare), rel=1e-6)
        formula = mechanisms.wall_forces(
            length, height, depth, height, stress=stress, strength=spare * stress / 0.85, cohesion=0.0, friction=3.0,
            diagonal_strength=1e9, unit=(1.0, 1.0),
        )
        assert found == pytest.approx(formula.rocking, rel=1e-6)
