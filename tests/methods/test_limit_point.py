"""What a limit point is: made-up curves with dips and level stretches, judged by hand."""

import numpy as np
import pytest
from referee.engines import ENGINES
from referee.paths import finer

import limitmason as lm
from limitmason.capacity.limit_point import first_limit_point

SIZE, LENGTH = 0.3, 1e-5
RISE = np.linspace(0.0, 1.0, 5)


@pytest.mark.parametrize(
    ("after", "found"),
    [
        ([0.9985, 1.1], None),  # a dip of 0.15 %
        ([0.997, 1.1], 4),  # of 0.3 %
        ([1.0] * 5 + [1.1], 4),  # level while the displacement doubles
        ([1.0] * 4 + [1.1], None),
        ([1.0] * 3, None),  # level at the end, not for long
        ([1.0] * 5, 4),
        ([0.9999], 4),  # lower at the end
    ],
)
def test_a_limit_point_is_passed_by_a_fall_by_lasting_or_at_the_end(after, found):
    load = np.append(RISE, after)
    way = np.cumsum(np.append(0.0, np.full(len(load) - 1, LENGTH)))
    assert first_limit_point(load, way, np.zeros(len(load)), SIZE) == found


def test_what_contacts_found_anew_take_off_is_no_fall():
    load = np.append(RISE, [0.99, 1.1])
    lacks, way = np.array([0.0] * 5 + [0.01, 0.0]), 1e-4 * np.arange(7.0)
    assert first_limit_point(load, way, 0.0 * lacks, SIZE) == 4
    assert first_limit_point(load, way, lacks, SIZE) is None


def test_a_load_that_hardly_rises_has_passed_wherever_its_samples_lie():
    """A level of 0.58384 that creeps up by 3e-5 of it: .618 came out where a sample lay just short of its doubling."""
    for first in (0.2, 0.4, 0.5):
        way = SIZE * np.append([0.0, 4e-4], 4e-4 * np.cumprod([1.0 + first, 1.9, 4.0, 4.0, 2.0, 4.0]))
        load = np.append([0.0, 1.0], [*(1.0 + 5e-6 * np.arange(1.0, 6.0)), 1.06])
        assert load[first_limit_point(load, way, 0.0 * load, SIZE)] < 1.001


def test_a_limit_point_is_passed_where_the_load_comes_back_whatever_samples_are_left_out():
    """A load of 0.642 that dips by a thousandth and comes back at 2.3 times its displacement, over all its samples."""
    way = 1e-3 * np.linspace(0.0, 8.0, 161)
    knots = 1e-3 * np.array([0.0, 1.0, 2.2, 3.8, 5.1, 7.0, 8.0])
    load = np.interp(way, knots, [0.0, 0.62, 0.642, 0.6415, 0.642, 0.644, 0.645])
    for since, until in ((44, 45), (76, 140), (80, 104), (87, 160)):
        kept = np.append(np.arange(since + 1), np.arange(until, 161))
        found = first_limit_point(load[kept], way[kept], np.zeros(len(kept)), SIZE)
        assert found is not None
        assert kept[found] == 44


def test_a_limit_point_has_the_sense_of_the_push_and_none_is_found_on_the_way_back():
    """A block of 0.2 x 0.5 m bears 0.4 of its weight either way."""
    wall = lm.build.column(width=0.2, depth=0.2, height=0.5, courses=1, joint=lm.Joint(35.0, normal_stiffness=1e10))
    loads = lm.Loads.horizontal(wall)
    away, there = (lm.pushover(wall, loads, to=to) for to in (-0.02, 0.02))
    assert away.first_limit_point.load == pytest.approx(-0.4, rel=2e-3)
    assert away.peak == away.first_limit_point
    for quantity, sign in {"peak": -1, "drift at peak": -1, "stiffness": 1}.items():
        assert away.quantities[quantity] == pytest.approx(sign * there.quantities[quantity], rel=1e-6)
    back = lm.pushover(wall, loads, start=away)
    released = lm.pushover(wall, loads, start=there, to=0.5 * there.displacement[-1])
    assert released.peak.load == released.load.max()  # it never comes to a load of the other sense
    assert away.load[-1] < 0.0
    assert back.first_limit_point.load == pytest.approx(0.4, rel=2e-3)


@pytest.mark.parametrize("times", [0.5, 1.0, 3.0])
def test_a_path_ends_where_its_joints_have_lost_a_fifth_of_the_largest_load(times):
    """W + A s = 0.8 (W + A ft) on the straight softening branch; by the steps it ended at 0.04 to 0.62 of the peak."""
    energy, ft, kn, area = 20.0, 1e5, 1e10, 0.04
    joint = lm.Joint(35.0, cohesion=1e6, tensile_strength=ft, fracture_energy_tension=energy, normal_stiffness=kn)
    cube = lm.build.column(width=0.2, depth=0.2, height=0.2, courses=1, joint=joint)
    pulled = lm.Loads.weight(cube).with_point_load(cube, "column-1", (0.0, 0.0, 1.0))
    pressure = float(cube.weights.min()) / area
    curve = lm.pushover(cube, pulled, steps=finer(times))
    assert curve.status == "limit point passed"
    assert 0.0 <= 0.8 - curve.load[-1] / curve.peak.load <= 2e-4 / times + 1e-9
    lost = 1.0 - (0.8 * ft - 0.2 * pressure) / ft
    ends = pressure / kn + ft / kn + lost * (2.0 * energy / ft - ft / kn)
    assert curve.displacement[-1] == pytest.approx(ends, rel=2e-3)
    assert curve.ultimate().displacement == pytest.approx(ends, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "number"), [(7, 5), (9104, 3)])
def test_where_a_path_has_lost_a_fifth_of_its_load_does_not_hang_on_the_steps(seed, number):
    """At .0390 and .0312 m: the first sample below 80 % was as far beyond it as a step is long."""
    model = ENGINES["pushover bonds"].model(seed, number)
    ends = [lm.pushover(*model.build(), steps=finer(times)).displacement[-1] for times in (1.3, 3.0)]
    assert ends[0] == pytest.approx(ends[1], rel=5e-3)


@pytest.mark.slow
def test_a_load_that_rises_to_a_leap_is_followed_to_it_whatever_the_steps_are():
    """A tower whose load falls from 2.23 to .64 at once: a step of a seventh of the way leapt from 2.01 to 2.20."""
    model = ENGINES["pushover"].model(9106, 22)
    tops = [lm.pushover(*model.build(), steps=finer(times)).first_limit_point.load for times in (1.0, 1.3, 2.0)]
    assert tops == pytest.approx(3 * [tops[-1]], rel=2e-3)
