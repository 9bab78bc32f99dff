"""What the samples of a driven curve can and cannot tell of its load: swings, and a peak between two of them."""

import math
import re

import numpy as np
import pytest
from stacked_bricks import stacked

import dem
from dem.driving.push_curve import missed_between, swing_of


def test_the_swing_of_a_load_is_what_it_does_about_its_course():
    # nine tenths of a sine lie within sin(.45 pi) of its amplitude; a ramp and a drop do not swing
    x = np.linspace(0.0, 1.0, 401)
    course = 1.0 + x
    assert swing_of(course) < 1e-9
    assert swing_of(np.where(x < 0.5, course, 0.5 * course)) < 0.01
    assert swing_of(1.0 + 0.2 * np.sin(2 * np.pi * 20.0 * x)) == pytest.approx(0.2 / 1.2, rel=0.1)


def test_a_peak_that_may_lie_between_two_samples_is_said_to():
    # a line that breaks at .7: with 12 samples the last before it is at .6364, 9.1 % low, and may be up to 1/7 low
    def sampled(count, after=0.0):
        x = np.linspace(0.0, 1.0, count)
        return np.where(x < 0.7, x, after)

    assert missed_between(sampled(12)) == pytest.approx(1 / 7)
    assert missed_between(-sampled(12)) == pytest.approx(1 / 7)
    assert missed_between(sampled(401)) == pytest.approx(1 / 279)
    # a yield plateau and a smooth top miss nothing that counts, and of an end nobody knows
    assert missed_between(sampled(12, after=0.7)) == 0.0
    assert missed_between(np.sin(np.linspace(0.0, 3.0, 40))) < 1e-3
    assert missed_between(np.linspace(0.0, 1.0, 12)) == 0.0


def test_a_brittle_peak_on_few_samples_warns_and_on_as_many_as_it_asks_for_does_not():
    law = {"cohesion": 4e4, "tensile_strength": 4e4, "residual_cohesion": 0.0, "residual_tensile_strength": 0.0}
    wall = stacked(1, width=0.4, height=0.1, **law)
    friction = math.tan(math.radians(30.0)) * float(wall.weights[~wall.fixed].sum())
    exact = 4e4 * 0.04 + friction

    def pushed(samples):
        curve = dem.push(
            wall, dem.Drive({"top": {"x": 1.0, "ry": 0.0}}), to=4e-6, steps=20_000, samples=samples, rate_check=False
        )
        return curve, [w for w in curve.warnings if "falls at once behind" in w]

    few, (said,) = pushed(10)
    higher = float(re.search(r"up to ([\d.]+)% higher", said)[1]) / 100.0
    assert few.peak.load < 0.98 * exact <= (1.0 + higher) * few.peak.load
    many, none = pushed(int(re.search(r"samples=(\d+)", said)[1]))
    assert not none
    assert many.peak.load == pytest.approx(exact, rel=5e-3)


def test_first_failure_lies_between_two_samples_also_of_a_push_backwards():
    # it was told at the sample behind it: up to a tenth of this path too late
    law = {"cohesion": 4e4, "tensile_strength": 4e4, "residual_cohesion": 0.0, "residual_tensile_strength": 0.0}
    wall = stacked(1, width=0.4, height=0.1, **law)
    exact = 4e4 * 0.04 + math.tan(math.radians(30.0)) * float(wall.weights[~wall.fixed].sum())
    for way in (1.0, -1.0):
        curve = dem.push(
            wall, dem.Drive({"top": {"x": 1.0, "ry": 0.0}}), to=way * 4e-6, steps=20_000, samples=10, rate_check=False
        )
        assert curve.first_failure.load == pytest.approx(way * exact, rel=0.01)
