"""The catalogue of causes: shape, loads and measurement against exact solutions."""

import math

import numpy as np
import pytest
from cause_models import MU, READINGS, SPECIMEN, block, extend, value, wall
from scipy.optimize import brentq

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.geometry.rotation import rotation_matrices

# ---- shape, mass, displacement ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("lean", [-2.0, 1.0, 3.0])
def test_a_leaning_block_starts_that_much_nearer_to_falling(lean):
    b, h = 0.2, 1.0
    made, _ = block(b, h)
    got = value(*extend("out-of-plumb", lean, (made, lm.Loads.horizontal(made))))
    assert got == pytest.approx(math.tan(math.atan(b / h) - math.radians(lean)), abs=1e-8)


def test_out_of_plumb_is_the_wall_turned_under_loads_that_stay():
    made, loads = wall()
    top = made.blocks[-1].name
    at = made.centroids[made.block_index(top)] + (0.0, 0.0, 0.1)
    loads = loads.with_point_load(made, top, (0, 0, -900.0), at=at, case="dead")
    got = value(*extend("out-of-plumb", 1.5, (made, loads)))
    turn = rotation_matrices(np.radians((0.0, 1.5, 0.0)))  # towards +x
    leaning = made.transformed(turn)
    truth = lm.Loads.horizontal(leaning)
    # the point of application above the centroid on the line of action is the centroid's own level: no arm
    truth = truth.with_point_load(leaning, top, (0, 0, -900.0), case="dead")
    assert got == pytest.approx(value(leaning, truth), abs=1e-8)


def test_out_of_plumb_is_an_exact_twin_of_the_angle_offset_in_tilting_tests():
    made, loads = wall()
    lean = value(*extend("out-of-plumb", 1.2, (made, loads)))
    read = catalogue.angle_offset().apply(-1.2, value(made, loads), {})
    assert lean == pytest.approx(read, rel=1e-7)


def overloaded(b=0.2, h=1.0, t=0.3, share=1.5):
    made, weight = block(b, h, t)
    load = share * weight
    loads = lm.Loads.horizontal(made).with_point_load(made, "column-1", (0, 0, -load), case="dead")
    return made, loads, weight, load


def test_size_and_density_change_the_weight_that_a_fixed_overload_works_against():
    b, h = 0.2, 1.0
    made, loads, w, p = overloaded(b, h)
    s = 1.07
    expected = {"xyz": (s**3 * w + p) / (s**3 * w) * b / h, "z": (s * w + p) / (s * w) * b / (s * h)}
    expected |= {"x": (s * w + p) / (s * w) * s * b / h, "y": (s * w + p) / (s * w) * b / h}
    for axes, exact in expected.items():
        assert value(*extend("block size", s, (made, loads), axes=axes)) == pytest.approx(exact, rel=1e-8)
    assert value(*extend("block density", s, (made, loads))) == pytest.approx((s * w + p) / (s * w) * b / h, rel=1e-8)


def test_an_applied_live_force_does_not_change_with_density():
    made, w = block()
    loads = lm.Loads.weight(made).with_point_load(made, "column-1", (100.0, 0, 0), at=(0.1, 0.15, 1.0))
    got = value(*extend("block density", 1.2, (made, loads)))
    assert got == pytest.approx(1.2 * w * 0.1 / (100.0 * 1.0), rel=1e-8)
    high = value(*extend("block size", 1.1, (made, loads), axes="z"))
    assert high == pytest.approx(1.1 * w * 0.1 / (100.0 * 1.1), rel=1e-8)


@pytest.mark.parametrize("size", [4.0, 10.0])
def test_second_order_block_on_springs(size):
    b, h, t = 0.2, 1.0, 0.3
    made, weight = block(b, h, t)
    spring = t * b**3 / 12.0 / (size * 1e-9)

    def unbalance(multiplier):
        turn = multiplier * weight * h / 2.0 / spring
        return math.tan(math.atan(b / h) - turn) - multiplier

    exact = brentq(unbalance, 0.0, b / h)
    assert exact < 0.995 * b / h
    assert value(*extend("second-order displacement", size, (made, lm.Loads.horizontal(made)))) == pytest.approx(
        exact, rel=1e-6
    )


@pytest.mark.slow
def test_soft_joints_in_the_dem_follow_the_no_tension_winkler_base():
    b, h, t, size = 0.2, 1.0, 0.3, 4.0
    made, weight = block(b, h, t)
    # contact length x of a base turned by theta: N = kn t theta x^2 / 2, M = N (b/2 - x/3); the load and the sway of
    # the weight take lambda W h/2 + W theta h/2; the largest lambda over theta, rotations of second order left out
    a = math.sqrt(2.0 * weight * size * 1e-9 / t)
    turn = (a / (3.0 * h)) ** (2.0 / 3.0)
    assert a / math.sqrt(turn) < b
    exact = b / h - 2.0 * a / (3.0 * h * math.sqrt(turn)) - turn
    assert exact < 0.97 * b / h
    extended = extend("joint softness", size, (made, lm.Loads.horizontal(made)))
    got = lm.predict(*extended, "dem", contact_points=(61, 2), tolerance=1e-3).collapse_multiplier
    assert got == pytest.approx(exact, rel=0.01)


# ---- loads -----------------------------------------------------------------------------------------------------------


def test_overload_off_its_axis_and_of_another_size():
    b, h = 0.2, 1.0
    made, loads, w, p = overloaded(b, h)
    for e in (-15.0, 20.0):
        exact = (w * b / 2 + p * (b / 2 - 1e-3 * e)) / (w * h / 2)
        assert value(*extend("eccentric overload", e, (made, loads))) == pytest.approx(exact, rel=1e-8)
    assert value(*extend("overload magnitude", 1.2, (made, loads))) == pytest.approx(
        (w + 1.2 * p) / w * b / h, rel=1e-8
    )
    moving = loads.with_point_load(made, "column-1", (p, 0, 0), at=(0.1, 0.15, 0.9))
    moving = extend("overload magnitude", 1.2, (made, moving), inertial=True)
    # one block: what it carries live beyond its weight cannot be told from its weight, unless others show it
    assert value(*moving) <= (w + 1.2 * p) * b / 2 / (w * h / 2 + p * 0.9) * (1 + 1e-8)


def test_overload_that_moves_with_the_wall():
    made = lm.build.column(width=0.2, depth=0.3, unit_height=0.25, courses=4, joint=lm.Joint(60.0))
    w, p = made.weights[1:].sum(), 700.0
    loads = lm.Loads.horizontal(made).with_point_load(made, "column-4", (0, 0, -p), case="dead")
    loads = loads.with_point_load(made, "column-4", (p, 0, 0))
    got = value(*extend("overload magnitude", 1.3, (made, loads), inertial=True))
    exact = (w + 1.3 * p) * 0.1 / (w * 0.5 + 1.3 * p * 0.875)
    assert got == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("beta", [-10.0, 6.0])
def test_inclined_and_skewed_live_load(beta):
    rad = math.radians(beta)
    made, _ = block(b=2.0, h=0.5)
    got = value(*extend("load direction", beta, (made, lm.Loads.horizontal(made))))
    assert got == pytest.approx(MU / (math.cos(rad) + MU * math.sin(rad)), rel=1e-7)
    made, _ = block(b=0.2, h=1.0, t=0.6)
    got = value(*extend("load direction", beta, (made, lm.Loads.horizontal(made)), plane="horizontal"))
    assert got == pytest.approx(0.2 / math.cos(rad), rel=1e-7)


# ---- measurement -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", READINGS)
def test_readings_without_an_error_are_the_value(name):
    cause = catalogue.ALL[name]()
    assert cause.transforms
    for true in (0.03, 0.7, 45.0):
        assert cause.apply(cause.baseline, true, SPECIMEN) == true


def test_readings_follow_their_law():
    assert catalogue.angle_offset().apply(2.0, 0.5, {}) == pytest.approx(math.tan(math.atan(0.5) + math.radians(2)))
    assert catalogue.angle_offset().apply(-2.0, math.tan(math.radians(9)), {}) == pytest.approx(
        math.tan(math.radians(7.0))
    )
    assert catalogue.gain().apply(1.1, 0.5, {}) == pytest.approx(0.55)
    shift = catalogue.batch_shift(covariate="operator", label="second")
    assert shift.apply(1.1, 0.5, {"operator": "second"}) == pytest.approx(0.55)
    assert shift.apply(1.1, 0.5, {"operator": "first"}) == 0.5
    assert catalogue.rig_friction().apply(0.02, 0.5, {}) == pytest.approx(0.52)
    assert catalogue.rig_friction(per="overload").apply(0.02, 10.0, SPECIMEN) == pytest.approx(10.04)
    with pytest.raises(ValueError, match="operator"):
        shift.apply(1.1, 0.5, {"batch": "A"})
    with pytest.raises(ValueError, match="vertical"):
        catalogue.angle_offset().apply(3.0, 60.0, {})


@pytest.mark.exact
def test_a_load_that_is_turned_or_whose_block_grows_keeps_its_point():
    """A force turned about its point is that force at that point; a block 1.1 times as high bears it as much higher."""
    made, _ = block()
    at, force = np.array((0.05, 0.1, 0.9)), np.array((100.0, 0.0, 0.0))
    loads = lm.Loads.weight(made).with_point_load(made, "column-1", force, at=at)
    turn = rotation_matrices((0.0, -np.deg2rad(10.0), 0.0))
    taller, grown = extend("block size", 1.1, (made, loads), axes="z")
    for found, (wall_, push, place) in (
        (extend("load direction", 10.0, (made, loads))[1], (made, turn @ force, at)),
        (grown, (taller, force, at * (1.0, 1.0, 1.1))),
    ):
        exact = lm.Loads.weight(wall_).with_point_load(wall_, "column-1", push, at=place)
        for name in ("live", "live_arms"):
            assert getattr(found, name) == pytest.approx(getattr(exact, name), abs=1e-9)


@pytest.mark.exact
def test_a_moment_without_arms_is_a_couple_for_causes_too():
    """Causes read it as the force off the centroid: a higher block had a larger moment, a turned load another."""
    made, _ = block()
    wrench = np.zeros((made.n_blocks, 6))
    k = made.block_index("column-1")
    wrench[k] = (100.0, 0.0, 0.0, 0.0, 30.0, 20.0)
    loads = lm.Loads(lm.Loads.weight(made).dead, wrench)
    assert extend("block size", 1.1, (made, loads), axes="z")[1].live[k].tolist() == wrench[k].tolist()
    turn = rotation_matrices((0.0, -np.deg2rad(10.0), 0.0))
    found = extend("load direction", 10.0, (made, loads))[1].live[k]
    assert found == pytest.approx(np.concatenate([turn @ wrench[k, :3], turn @ wrench[k, 3:]]), abs=1e-12)
