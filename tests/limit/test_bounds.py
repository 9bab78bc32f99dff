"""Order between values that theory puts in order, and results that are not a number."""

import numpy as np
import pytest
from walls import corner, leaning, on_slab, running_bond, stack

import limitmason as lm


def value(assembly, direction=(1, 0, 0), **options):
    return lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, direction), **options).collapse_multiplier


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0)])
def test_more_friction_never_lowers_the_associative_value(direction):
    wall = corner()
    values = [value(wall.with_joints(lm.Joint.from_friction_coefficient(mu)), direction) for mu in (0.3, 0.5, 0.7, 0.9)]
    assert np.all(np.diff(values) >= -1e-8)


def test_plane_reduction_equals_four_corners():
    wall = running_bond(4, 6)
    assert value(wall) == pytest.approx(value(wall, in_plane=False), abs=1e-7)


def test_grid_never_lies_above_its_corners_and_equals_them_without_crushing():
    # the corners span every pressure distribution: a grid adds nothing, in torsion neither
    wall = corner()
    for direction in ((1, 0, 0), (0, -1, 0)):
        corners = value(wall, direction)
        grid = value(wall, direction, contact_model="grid", grid=(4, 3))
        assert grid == pytest.approx(corners, abs=1e-6)


@pytest.mark.parametrize(
    ("limit", "share"), [(False, np.sqrt(0.5)), (True, 0.382598), (2.0, 0.191299), (0.0, np.sqrt(0.5))]
)
def test_torsion_limit_of_a_twisted_block_is_that_of_uniform_pressure(limit, share):
    # mu N a times the mean distance from the centre: 0.3826 over a square, 0.7071 with all pressure in its corners
    mu, side = 0.5, 0.4
    block = on_slab([((0, 0, 0), (side, side, side))], mu=mu)
    live = np.zeros((2, 6))
    live[1, 5] = mu * block.weights[1] * side
    found = lm.limit_analysis(block, lm.Loads(lm.Loads.weight(block).dead, live), torsion_limit=limit)
    assert found.collapse_multiplier == pytest.approx(share, rel=1e-4)


@pytest.mark.slow
def test_torsion_limit_lowers_a_corner_that_twists_and_leaves_what_does_not():
    wall = lm.build.wall(length=1.6, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0), plan="L", return_length=1.2)
    free, limited = (value(wall, (0, -1, 0), torsion_limit=t) for t in (False, True))
    assert limited < 0.95 * free
    straight = running_bond(3, 4)
    assert value(straight, torsion_limit=True) == pytest.approx(value(straight), abs=1e-6)


def test_pulled_in_contact_ends_lower_the_value():
    wall = running_bond(4, 6)
    values = [value(wall.with_contact_ends_pulled_in(r, direction=(0, 1, 0))) for r in (0.0, 0.01, 0.02)]
    assert values[0] > values[1] > values[2]


def test_bracket_holds_the_associative_value_on_top():
    wall = running_bond(3, 4, joint=lm.Joint(33.0, dilatancy_angle_deg=20.0))
    bracket = lm.limit_bracket(wall, lm.Loads.horizontal(wall))
    assert bracket.upper.collapse_multiplier == pytest.approx(value(wall), abs=1e-8)
    assert bracket.lower.collapse_multiplier == pytest.approx(value(wall.with_joints(lm.Joint(20.0))), abs=1e-7)


@pytest.mark.parametrize("direction", [(1, 0, 0), (-1, 0, 0)])
def test_a_structure_that_topples_by_itself_cannot_stand_even_if_a_push_would_right_it(direction):
    assembly = leaning()
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, direction))
    assert prediction.status == "cannot stand under dead load"
    assert np.isnan(prediction.collapse_multiplier)
    assert prediction.warnings


def test_pressing_down_on_a_column_has_no_finite_multiplier():
    assembly = stack([(0.5, 0.5)] * 2)
    loads = lm.Loads.weight(assembly).with_point_load(assembly, "block-2", (0, 0, -1.0))
    prediction = lm.limit_analysis(assembly, loads)
    assert prediction.status == "unbounded"
    assert prediction.collapse_multiplier == np.inf


def test_load_cases_are_solved_by_name():
    wall = running_bond(3, 4)
    cases = {"right": lm.Loads.horizontal(wall), "left": lm.Loads.horizontal(wall, (-1, 0, 0))}
    out = lm.predict_cases(wall, cases)
    assert list(out) == ["right", "left"]
    assert out["right"].collapse_multiplier == pytest.approx(out["left"].collapse_multiplier, abs=1e-7)
