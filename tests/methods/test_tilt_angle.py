"""A multiplier has a tilt angle only where it is the tangent of one; elsewhere the reason is said."""

import numpy as np
import pytest

import limitmason as lm
import mechanisms

WIDTH, HEIGHT, DENSITY = 0.4, 1.0, 2000.0


def block(joint=None, scale=1.0, density=DENSITY):
    joint = joint or lm.Joint.from_friction_coefficient(0.9)
    size = {"width": WIDTH * scale, "depth": 0.5 * scale, "unit_height": HEIGHT * scale}
    return lm.build.column(**size, courses=1, joint=joint, density=density)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("density", [2.0, 2e6])
@pytest.mark.parametrize("method", ["limit", "mechanisms"])
def test_dry_block_on_a_tilting_table_turns_over_at_the_angle_of_its_diagonal(method, scale, density):
    stone = block(scale=scale, density=density)
    for loads in (lm.Loads.tilting(stone, (0, 1, 0)), lm.Loads.horizontal(stone, (3, 0, 0))):
        angle = lm.predict(stone, loads, method).tilt_angle_deg
        assert angle == pytest.approx(np.degrees(np.arctan(WIDTH / HEIGHT)), rel=1e-6)


def test_dem_says_so_too():
    stone = block()
    found = lm.predict(stone, lm.Loads.horizontal(stone), "dem", error_budget=(), contact_points=(2, 2))
    assert found.tilt_angle_deg == pytest.approx(np.degrees(np.arctan(WIDTH / HEIGHT)), rel=0.02)


def test_held_blocks_and_their_loads_do_not_count():
    stone = block()
    loads = lm.Loads.horizontal(stone)
    pushed = loads.with_point_load(stone, 0, (0, 0, -1e6), case="dead")
    assert lm.limit_analysis(stone, pushed).tilt_angle_deg == lm.limit_analysis(stone, loads).tilt_angle_deg


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda a, loads: loads.with_point_load(a, 1, (0, 0, -50.0), case="dead"), "dead load is not the own weight"),
        (lambda a, loads: loads.with_point_load(a, 1, (50.0, 0, 0)), "live load is not the weight"),
        (lambda a, _: lm.Loads.body_force(a, (1, 0, 0.1)), "live load is not the weight"),
        (lambda a, _: lm.Loads.weight(a).with_point_load(a, 1, (500.0, 0, 0)), "live load is not the weight"),
        (lambda a, loads: lm.Loads(loads.dead, 2.0 * loads.live), "live load is not the weight"),
    ],
)
@pytest.mark.parametrize("method", ["limit", "mechanisms"])
def test_other_loads_have_no_tilt_angle(method, change, reason):
    stone = block()
    found = lm.predict(stone, change(stone, lm.Loads.horizontal(stone)), method)
    with pytest.raises(ValueError, match=reason):
        _ = found.tilt_angle_deg


@pytest.mark.parametrize("strength", [{"cohesion": 500.0}, {"cohesion": 500.0, "tensile_strength": 100.0},
                                      {"compressive_strength": 1e6}])
def test_joints_with_a_strength_of_their_own_have_no_tilt_angle(strength):
    # W (-cos z + sin d) against a joint that keeps its cohesion: the cosine does not cancel
    stone = block(joint=lm.Joint(42.0, **strength))
    with pytest.raises(ValueError, match="the joint between .* has cohesion, tensile or compressive strength"):
        _ = lm.limit_analysis(stone, lm.Loads.horizontal(stone)).tilt_angle_deg


def test_glued_block_tilts_at_another_angle_than_the_tangent_of_its_multiplier():
    # why it is refused: moments about the toe, tension ft over the base, upright and on the table
    tension, depth = 1e4, 0.5
    stone = block(joint=lm.Joint(60.0, cohesion=1e5, tensile_strength=tension))
    weight, hold = stone.weights[1], tension * WIDTH * depth * WIDTH / 2
    upright = lm.limit_analysis(stone, lm.Loads.horizontal(stone), contact_model="grid", grid=(2, 2))
    assert upright.collapse_multiplier == pytest.approx((weight * WIDTH / 2 + hold) / (weight * HEIGHT / 2), rel=1e-3)
    angle = np.linspace(0.0, np.pi / 2, 100_001)
    over = weight * (np.sin(angle) * HEIGHT / 2 - np.cos(angle) * WIDTH / 2) > hold
    assert np.degrees(angle[over][0]) > np.degrees(np.arctan(upright.collapse_multiplier)) + 1.0


def test_an_answer_without_loads_and_one_from_a_file_say_the_same(tmp_path):
    free = mechanisms.rigid_block(width=WIDTH, height=HEIGHT, friction=0.9)
    with pytest.raises(ValueError, match="does not say which loads"):
        _ = free.tilt_angle_deg
    stone = block()
    loads = lm.Loads.horizontal(stone)
    for k, own in enumerate((loads, loads.with_point_load(stone, 1, (9.0, 0, 0)))):
        found = lm.limit_analysis(stone, own)
        lm.formats.write_prediction(tmp_path / f"{k}.json", found, assembly=stone)
        again = lm.formats.read_prediction(tmp_path / f"{k}.json")
        if k:
            with pytest.raises(ValueError, match="live load is not the weight"):
                _ = again.tilt_angle_deg
        else:
            assert again.tilt_angle_deg == found.tilt_angle_deg
