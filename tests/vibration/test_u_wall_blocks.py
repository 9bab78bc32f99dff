"""Kept records and pushes of the U walls beside what is worked out here: modes of joints, closed forms, the page."""

from pathlib import Path

import numpy as np
import pytest
from u_wall_blocks import identification, page, pushed

import dem
import limitmason as lm

PAGE = Path(__file__).parents[2] / "docs" / "papers" / "u-walls.md"


@pytest.fixture(scope="module")
def kept():
    return identification.read()


def case(name):
    return next(c for c in identification.CASES if c.name == name)


@pytest.mark.parametrize("name", ["REGW", "DS, joints that hold"])
@pytest.mark.parametrize("method", ["ssi", "fdd"])
def test_records_of_joints_that_do_not_open_have_the_wall_s_own_modes_to_two_per_cent(kept, name, method):
    runs, modes = kept
    assert runs[name].open == runs[name].broken == 0
    _, wall = identification.model(case(name))
    own = lm.modes(wall, 3, contact_points=identification.POINTS)
    assert runs[name].closed[:3] == pytest.approx(own.frequency, rel=1e-4)
    found = modes[name, method]
    shapes = identification.at_channels(own, wall, identification.channels(wall))
    values = lm.mac(found.shape, shapes).values
    best = values.argmax(axis=0)
    assert found.frequency[best] == pytest.approx(own.frequency, rel=0.02)
    assert values.max(axis=0).min() > (0.98 if method == "ssi" else 0.9)


def test_a_push_that_cracks_joints_lowers_the_frequencies_to_those_of_the_cracked_state(kept):
    runs, modes = kept
    after, before = runs["REGW after 44 kN"], runs["REGW"]
    assert after.broken > 0
    assert after.open > 0
    assert (after.tangent[:3] < before.tangent[:3]).all()
    found = modes["REGW after 44 kN", "ssi"].frequency
    for k in range(3):
        nearest = found[np.abs(found - after.tangent[k]).argmin()]
        assert nearest == pytest.approx(after.tangent[k], rel=0.02)
    first = modes["REGW", "ssi"].frequency.min()
    assert found.min() < first - 0.5 * (before.tangent[0] - after.tangent[0])


def test_channels_lie_on_stones_and_shapes_there_are_those_of_the_modes():
    _, wall = identification.model(case("REGW"))
    where = identification.channels(wall)
    assert len(set(where)) == len(where)
    assert not wall.fixed[[block for block, _ in where]].any()
    own = lm.modes(wall, 2, contact_points=identification.POINTS)
    direct = [[shape[block, "xyz".index(axis)] for block, axis in where] for shape in own.shape]
    assert identification.at_channels(own, wall, where) == pytest.approx(np.array(direct))


def test_stiffness_and_light_damage_of_a_bilinear_push():
    # 40 kN/mm to 10 kN, then 20 kN/mm to 40 kN: secant 0.98 x 40 at u = 5 / (0.98 x 40 - 20) mm
    u = np.linspace(0.0, 2.0, 4001)
    load = np.minimum(np.where(u <= 0.25, 40 * u, 10 + 20 * (u - 0.25)), 40.0)
    sway = 2e-6 * np.sin(np.arange(len(u)))
    slope, light = pushed.stiffness_and_light_damage(u + sway, load)
    at = 5 / (0.98 * 40 - 20)
    assert slope == pytest.approx(40.0, rel=1e-3)
    assert light == pytest.approx((0.98 * 40 * at, at), rel=1e-2)


@pytest.mark.parametrize(
    ("name", "courses", "rigidly"),
    [
        ("REGW, cohesion kept; ground a joint", 6, 37.6),
        ("REGW, lost by opening alone; ground a joint", 6, 37.6),
        ("REGW, cohesion kept", 5, 49.7),  # on the bed joint above a ground that holds
    ],
)
def test_plateaus_of_a_wall_that_turns_over_in_one_are_its_rigid_overturning(name, courses, rigidly):
    # (W y + 20 kN y_roof) over the arm of the airbag's part above the joint, about the joint's edge
    kept = pushed.read()[name]
    _, wall = pushed.model(next(c for c in pushed.CASES if c.name == name))
    height = 0.225 * courses
    above = ~wall.fixed & (wall.centroids[:, 2] > 1.35 - height)
    moment = wall.centroids[above, 1] @ wall.weights[above] + 20e3 * 0.65
    force = moment / (height / 1.35 * 0.5 * height) / 1e3
    assert force == pytest.approx(rigidly, abs=0.1)
    assert kept.mechanism == "turns over in one"
    assert kept.at[1:] == pytest.approx([force] * 3, rel=0.05)
    assert kept.peak[0] > force


def test_a_driven_block_shows_its_friction():
    # tan(phi) W; it sticks and slips, so that the mean lies below, the more the faster it is driven
    side, density, phi = 0.4, 2500.0, 30.0
    joint = lm.Joint(phi, normal_stiffness=4e9, shear_stiffness=1e9)
    block = lm.build.column(width=side, depth=side, unit_height=0.1, courses=1, joint=joint, density=density)
    loads = lm.Loads.weight(block)
    low = [(side, side, 0.0), (0.0, side, 0.0), (0.0, side, 0.1), (side, side, 0.1)]
    loads = loads.with_patch_pressure(block, low, force=1e3)
    settled = dem.simulate(block, dem.Settle(tolerance=1e-6), loads=loads, contact_points=pushed.POINTS)
    u, load, reaction = pushed.driven(settled.state.copy(), loads, 1, block.fixed, 0.05)
    friction = np.tan(np.radians(phi)) * block.weights[1] / 1e3
    for shown in (load, reaction):
        assert 0.98 * friction < shown[-1000:].mean() < 1.001 * friction
    assert u[-1] > 0.04


def test_the_page_has_the_kept_pushes_and_the_mechanisms():
    text = PAGE.read_text(encoding="utf-8")
    for table in (page.pushes(pushed.read()), page.table_10()):
        assert "\n".join(table) in text
