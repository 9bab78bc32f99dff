"""Floors that rest on walls by friction, against closed forms: sliding on their bearings, overturning with the wall."""

import pytest
from walls import on_slab, stack

import limitmason as lm

RULES = ("associative", "non-associative")


def solved(house, rule):
    options = {"search": "quick", "measure_jump": False} if rule == "non-associative" else {}
    found = lm.limit_analysis(house, lm.Loads.horizontal(house), rule, **options)
    assert found.status == "solved"
    assert max(found.certificate.equilibrium_residual, found.certificate.complementarity) < 1e-8
    return found


def value(house, rule="associative"):
    return solved(house, rule).collapse_multiplier


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("mu", [0.1, 0.25, 0.6])
def test_a_floor_slides_on_its_bearing_or_overturns_with_the_wall(mu, rule):
    wall = stack([(0.4, 0.5)] * 2, mu=0.7)
    own, floor = wall.weights[1:].sum(), 600.0 * lm.constants.GRAVITY
    joint = lm.Joint.from_friction_coefficient(mu)
    loaded = lm.build.with_floor(wall, mass=600.0, joint=joint, thickness=0.2)
    assert loaded.blocks[-1].name == "floor"
    assert loaded.weights[-1] == pytest.approx(floor)
    together = 0.2 * (own + floor) / (0.5 * own + 1.1 * floor)
    # the upper block with the floor, about its own foot
    upper = 0.2 * (0.5 * own + floor) / (0.25 * 0.5 * own + 0.6 * floor)
    assert value(loaded, rule=rule) == pytest.approx(min(mu, together, upper), abs=1e-7)


def test_a_floor_on_two_walls_is_left_behind_at_the_friction_of_its_bearings():
    # as a load fastened to the walls the same mass would overturn them or not at all
    walls = on_slab([((0, 0, 0), (1, 1, 1)), ((3, 0, 0), (4, 1, 1))], mu=0.9)
    joint = lm.Joint.from_friction_coefficient(0.35)
    house = lm.build.with_floor(walls, mass=800.0, joint=joint)
    assert sum(house.n_blocks - 1 in (i.block_a, i.block_b) for i in house.interfaces) == 2
    for rule in RULES:
        found = solved(house, rule)
        assert found.collapse_multiplier == pytest.approx(0.35, abs=1e-7)
        assert found.mechanism.moving_blocks(1e-3).tolist() == [house.n_blocks - 1]
    # anchored to one wall it is held until the anchor yields: lambda F = mu F + Y
    tie = lm.Tie("floor", (0.5, 0.5, 1.0), "block-1", (0.0, 0.5, 1.0), yield_force=0.1 * house.weights[-1])
    for rule in RULES:
        assert value(house.with_ties([tie]), rule) == pytest.approx(0.45, abs=1e-7)


def test_a_floor_keeps_joints_ties_and_supports_of_the_wall_under_it():
    wall = stack([(0.4, 0.5)] * 2, joint=lm.Joint(31.0, cohesion=1e4, tensile_strength=5e3))
    wall = wall.with_ties([lm.Tie("block-2", (0, 0.5, 0.8), None, (-1, 0.5, 0.8), yield_force=1e3)])
    loaded = lm.build.with_floor(wall, mass=100.0, joint=lm.Joint(20.0))
    assert loaded.interfaces[: len(wall.interfaces)] == wall.interfaces
    assert loaded.ties == wall.ties
    assert loaded.supports == wall.supports
    assert loaded.interfaces[-1].joint == lm.Joint(20.0)
    assert loaded.interfaces[-1].area == pytest.approx(0.4)
    second = lm.build.with_floor(loaded, mass=50.0, joint=lm.Joint(25.0), name="roof")
    assert second.blocks[-1].bounds[0, 2] == pytest.approx(1.2)


def test_a_floor_that_fits_nowhere_is_refused():
    wall, joint = stack([(0.4, 0.5)] * 2), lm.Joint(30.0)
    for options, message in (
        ({"level": 3.0}, "touches no block"),
        ({"level": 0.7}, "overlap"),
        ({"mass": -1.0}, "mass must be positive"),
        ({"footprint": (0, 0, 0, 1)}, "footprint must be"),
        ({"name": "block-1"}, "already"),
    ):
        with pytest.raises(ValueError, match=message):
            lm.build.with_floor(wall, **{"mass": 100.0, "joint": joint, **options})


def test_a_floor_that_nearly_bears_on_a_wall_is_told_of():
    # one wall is 1.5 mm lower than the other: the floor bears on one alone
    walls = on_slab([((0, 0, 0), (1, 1, 1)), ((3, 0, 0), (4, 1, 0.9985))], mu=0.9)
    floor = {"mass": 500.0, "joint": lm.Joint.from_friction_coefficient(0.4), "footprint": (0, 4, 0, 1), "level": 1.0}
    house = lm.build.with_floor(walls, **floor)
    floored = house.n_blocks - 1
    assert {min(i.block_a, i.block_b) for i in house.interfaces if floored in (i.block_a, i.block_b)} == {1}
    assert [sorted((d.a, d.b)) for d in house.near_misses] == [[2, floored]]
