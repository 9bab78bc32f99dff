"""The multiplier does not depend on how the same structure is written down."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from test_certificate import corner
from walls import running_bond

import limitmason as lm

WALLS = {"wall": lambda: running_bond(3, 4), "corner": corner}


def value(assembly, direction):
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, direction))
    assert prediction.status == "solved"
    return prediction.collapse_multiplier


@pytest.mark.parametrize("name", WALLS)
@settings(max_examples=6, deadline=None, derandomize=True)
@given(
    angle=st.floats(-180, 180), shift=st.tuples(*[st.floats(-50, 50)] * 3), heading=st.floats(-180, 180),
    mirror=st.booleans(), scale=st.sampled_from([1.0, 0.1, 7.3]), seed=st.integers(0, 1000),
)  # fmt: skip
def test_rotated_translated_mirrored_rescaled_renumbered(name, angle, shift, heading, mirror, scale, seed):
    assembly = WALLS[name]()
    direction = np.array([np.cos(np.deg2rad(heading)), np.sin(np.deg2rad(heading)), 0.0])
    expected = value(assembly, direction)
    matrix = Rotation.from_euler("z", angle, degrees=True).as_matrix()
    if mirror:
        matrix = matrix @ np.diag([1.0, -1.0, 1.0])
    moved = assembly.transformed(scale * matrix, shift)
    moved = moved.renumbered(np.random.default_rng(seed).permutation(moved.n_blocks))
    assert value(moved, matrix @ direction) == pytest.approx(expected, abs=1e-6)


def test_in_plane_wall_turned_about_the_vertical_is_still_found_plane():
    wall = running_bond(3, 4)
    turn = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()
    prediction = lm.limit_analysis(wall.transformed(turn), lm.Loads.horizontal(wall, turn @ (1, 0, 0)))
    assert prediction.provenance["plane"]
    assert prediction.collapse_multiplier == pytest.approx(value(wall, (1, 0, 0)), abs=1e-7)


def test_detected_contacts_do_not_depend_on_numbering_or_pose():
    wall = corner()
    turn = Rotation.from_euler("zyx", [20, 30, 40], degrees=True).as_matrix()
    areas = sorted(i.area for i in wall.interfaces)
    rebuilt = lm.Assembly.from_polyhedra(
        [b.parts for b in reversed(wall.transformed(turn, (5, -3, 2)).blocks)], joint=lm.Joint(30.0)
    )
    assert sorted(i.area for i in rebuilt.interfaces) == pytest.approx(areas, rel=1e-9)


def test_cohesion_breaks_scale_invariance():
    joint = lm.Joint(33.0, cohesion=1e3)
    wall = running_bond(3, 4, joint=joint)
    assert value(wall.transformed(2.0 * np.eye(3)), (1, 0, 0)) < value(wall, (1, 0, 0)) - 1e-3
