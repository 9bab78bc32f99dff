"""The DEM at psi = phi against the referee: its interval holds the value of the static theorem.

Small random assemblies whose joint forces stay of the order of their weight, so that stiff joints can follow.
"""

import functools

import numpy as np
import pytest
from referee import plane
from referee.draw import plane_case
from referee.engines import ENGINES
from referee.statics import Statics

import dem
import limitmason as lm

SHAPES = ("bond", "rubble", "arch", "opening", "tower", "overhang", "leaning")


def small(seed, number):
    """The case and its value if it is a dry one of 2 to 8 equal stones under a load of the order of its weight."""
    case = plane_case(seed, number)
    tags = case.tags
    if tags["law"] != "dry" or tags["densities"] != "equal" or tags["shape"] not in SHAPES:
        return None
    if tags["loads"] not in ("horizontal", "inclined", "point") or not 2 <= len(case.free) <= 8:
        return None
    if not 0.3 < case.law.mu < 1.2:
        return None
    verdict = plane.referee(case)
    if verdict.status != plane.NUMBER or not 0.05 < verdict.value / verdict.unit < 10:
        return None
    return case, verdict.value


@functools.cache
def answered(seed, number):
    """The case with dilatancy, its value, and the answer of the DEM with its error budget; None as above."""
    found = small(seed, number)
    if found is None:
        return None
    assembly, loads = found[0].build()
    phi = assembly.interfaces[0].joint.friction_angle_deg
    assembly = assembly.with_joints(lm.Joint(phi, dilatancy_angle_deg=phi))
    return *found, dem.collapse(assembly, loads, contact_points=(2, 2))


def within(seed, numbers):
    """How many were tried, and those outside of their interval."""
    tried, outside = 0, []
    for number in numbers:
        if (found := answered(seed, number)) is None:
            continue
        case, value, answer = found
        tried += 1
        low, high = answer.interval or (np.nan, np.nan)
        if not low <= value <= high:
            outside.append((seed, number, case.tags["shape"], value, answer.status, (low, high)))
    return tried, outside


@pytest.mark.slow
def test_the_interval_of_the_dem_holds_the_value_of_the_referee():
    tried, outside = within(11, [11, 40, 41, 66, 70, 92, 93, 95, 104, 115, 116, 132])
    assert tried == 12
    assert not outside, outside


@pytest.mark.slow
@pytest.mark.parametrize("seed", [12, 13])
def test_the_interval_of_the_dem_holds_the_value_of_the_referee_in_many_cases(seed):
    tried, outside = within(seed, range(400))
    assert tried > 20
    # an interval is an estimate: one in twenty may miss, by little
    assert len(outside) <= 0.05 * tried, outside
    assert all(low * 0.98 <= value <= high * 1.02 for *_, value, _, (low, high) in outside), outside


@pytest.mark.slow
def test_rubble_that_rattles_and_rubble_held_by_its_tolerance_alone_lie_in_their_intervals():
    # 250: stones that slid further than they were open kept sliding at 1.043, the referee's 1.059. 340: equilibrium to
    # 1e-4 of every stone's load holds 4e-4 more than the referee's 0.27177
    tried, outside = within(12, [250, 340])
    assert tried == 2
    assert not outside, outside


@pytest.mark.slow
@pytest.mark.parametrize("case", [(11, 24), (12, 13), (12, 18)])
def test_the_interval_of_stones_on_soft_joints_holds_what_rigid_stones_bear(case):
    # 11/24: 0.794 on its joints, 0.961 on ones ten times as stiff, 1.047 on a hundred times, 1.063 rigid
    engine = ENGINES["dem collapse"]
    model = engine.model(*case)
    answer = engine.ask(model)
    assert engine.judge(model, answer) == []
    assert answer["multiplier"].value < 0.9 * Statics(model).limit()


def test_bonds_that_yield_and_never_end_carry_no_more_than_the_static_theorem_allows():
    # bonds that yield were taken for a sway of soft joints, up to 0.3 of a block: 3.04, "solved", for 1.77
    model = ENGINES["dem collapse"].model(1, 49)
    answer = dem.collapse(*model.build(), error_budget=())
    assert answer.status == "solved"
    assert answer.collapse_multiplier < Statics(model).limit()
    assert any("has yielded by" in w and "perfectly plastic" in w for w in answer.warnings)


@pytest.mark.parametrize("case", [11, pytest.param(19, marks=pytest.mark.slow)])
def test_a_multiplier_that_finer_points_lower_says_so_itself(case):
    # an even lattice twice as fine moved these by about 1 %, one four times as fine by 4 and 6 %
    model = ENGINES["dem collapse"].model(1, case)
    answer = dem.collapse(*model.build(), error_budget=("contact points",))
    finer = dem.collapse(*model.build(), contact_points=(16, 32), error_budget=())
    assert finer.collapse_multiplier < 0.98 * answer.collapse_multiplier
    assert any("contact points changed" in w for w in answer.warnings)
    low, high = answer.interval
    assert low * 0.99 < finer.collapse_multiplier < high
