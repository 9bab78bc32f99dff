"""Base motion: the ground follows its record, and friction carries or drags what stands on it."""

import dataclasses
import itertools

import numpy as np
import pytest
from walls import on_slab

import dem
import limitmason as lm

GRAVITY = 9.81
UNDAMPED = dem.JointOptions(dashpot=0.0)


def test_base_motion_below_the_friction_limit_carries_the_block_with_the_ground():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], joint=lm.Joint(35.0, normal_stiffness=1e9))
    t = np.arange(0.0, 1.0001, 0.01)
    record = 0.3 * GRAVITY * np.sin(2 * np.pi * 2 * t)
    stages = [dem.Hold(duration=0.05, damping=dem.Damping(0.8)), dem.BaseMotion(acceleration=record, sample_step=0.01)]
    h = dem.simulate(b, stages, mode="dynamic", joint_options=dem.JointOptions(dashpot=1e-5))
    # the integral of the piecewise linear record, twice
    velocity = np.concatenate([[0.0], np.cumsum(0.005 * (record[1:] + record[:-1]))])
    exact = np.sum(0.01 * velocity[:-1] + 0.01**2 * (record[:-1] / 3.0 + record[1:] / 6.0))
    assert h.shift[-1, 0, 0] == pytest.approx(exact, rel=1e-3)
    assert h.shift[-1, 1, 0] == pytest.approx(h.shift[-1, 0, 0], abs=1e-5)
    with pytest.raises(ValueError, match="dynamic"):
        dem.simulate(b, dem.BaseMotion(acceleration=record))


@pytest.mark.parametrize("sample_step", [1e-5, 3.7e-5, 1e-3])
def test_the_ground_follows_a_record_whatever_the_time_step(sample_step):
    """u(k + 1) = u(k) + v(k) h + h^2 (2 a(k) + a(k + 1)) / 6 of a record linear between its samples."""
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], joint=lm.Joint(35.0, normal_stiffness=1e9))
    a = 2.0 + 300.0 * np.random.default_rng(1).standard_normal(1001)
    velocity, exact = [0.0], [0.0]
    for old, new in itertools.pairwise(a.tolist()):
        exact.append(exact[-1] + velocity[-1] * sample_step + sample_step**2 * (2.0 * old + new) / 6.0)
        velocity.append(velocity[-1] + 0.5 * sample_step * (old + new))
    stages = [dem.BaseMotion(a, sample_step, after="coast"), dem.Hold(duration=1e-3)]
    h = dem.simulate(b, stages, mode="dynamic", sample=1)
    during = h["stage"] == 0.0
    assert h["time"][during][1] - h["time"][during][0] > 5e-5
    # between samples too: cubic from one to the next
    k = np.minimum((h["time"][during] / sample_step).astype(int), len(a) - 2)
    r = h["time"][during] - k * sample_step
    way = np.array(exact)[k] + np.array(velocity)[k] * r + a[k] * r**2 / 2 + np.diff(a)[k] / sample_step * r**3 / 6
    assert h.shift[during, 0, 0] == pytest.approx(way, rel=1e-9, abs=1e-12 + 1e-9 * np.abs(way).max())
    assert h.shift[-1, 0, 0] == pytest.approx(exact[-1] + velocity[-1] * 1e-3, rel=1e-9)


def test_base_motion_above_the_friction_limit_makes_the_block_slide():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.1))], joint=lm.Joint.from_friction_coefficient(0.2, normal_stiffness=1e9))
    push = dem.BaseMotion(acceleration=[0.5 * GRAVITY] * 11, sample_step=0.01)
    settle = dem.Hold(duration=0.05, damping=dem.Damping(0.8))
    h = dem.simulate(b, [settle, push], mode="dynamic", joint_options=UNDAMPED)
    ground, block = h.shift[-1, 0, 0], h.shift[-1, 1, 0]
    assert ground == pytest.approx(0.5 * 0.5 * GRAVITY * 0.1**2, rel=0.02)
    assert block == pytest.approx(0.5 * 0.2 * GRAVITY * 0.1**2, rel=0.03)


def test_three_components_move_the_ground_and_slide_the_block_along_each():
    # along y the ground outruns friction, t^2 / 2 of .5 g against .2 g; up and down it goes by the record's integral
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.1))], joint=lm.Joint.from_friction_coefficient(0.2, normal_stiffness=1e9))
    settle = dem.Hold(duration=0.05, damping=dem.Damping(0.8))

    def moved(record, **words):
        stages = [settle, dem.BaseMotion(record, 0.01, after="hold", **words)]
        h = dem.simulate(b, stages, mode="dynamic", joint_options=UNDAMPED)
        return h.shift[-1] - h.shift[np.searchsorted(h["stage"], 1.0) - 1], h

    flat = np.zeros(11)
    (ground, block), _ = moved(np.column_stack([flat, flat + 0.5 * GRAVITY, flat]))
    assert ground == pytest.approx([0.0, 0.25 * GRAVITY * 0.1**2, 0.0], rel=1e-6, abs=1e-12)
    assert block[1] == pytest.approx(0.5 * 0.2 * GRAVITY * 0.1**2, rel=0.03)
    assert abs(block[0]) < 1e-6
    up = np.linspace(0.0, 2.0, 11)  # its second integral is 2 t^3 / (6 T)
    (ground, block), _ = moved(np.column_stack([flat, flat, up]))
    assert ground == pytest.approx([0.0, 0.0, 2.0 * 0.1**2 / 6.0], rel=1e-3, abs=1e-12)
    assert block[2] == pytest.approx(ground[2], abs=1e-5)
    # two components at rest add nothing
    push = 0.5 * GRAVITY * np.sin(np.arange(11))
    one, three = moved(push)[1], moved(np.column_stack([push, flat, flat]))[1]
    for name in ("shift", "quaternion", "reaction", "opening"):
        assert np.array_equal(getattr(one, name), getattr(three, name)), name


def test_a_record_is_not_changed_with_the_array_it_was_made_of():
    record = np.array([0.0, 1.0, -1.0, 0.0])
    motion = dem.BaseMotion(record, 0.01)
    record[:] = 9.0
    assert motion.acceleration == (0.0, 1.0, -1.0, 0.0)
    assert motion.displacement([0.0, 0.01])[0] == 0.0
    three = dem.BaseMotion(np.ones((4, 3)), 0.01)
    assert three.corrected().acceleration == ((0.0, 0.0, 0.0),) * 4


def test_a_table_that_may_turn_is_ground_too():
    """Held in x, y and z alone: how far blocks moved was no number, or counted the way of the ground."""
    free = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], joint=lm.Joint(35.0, normal_stiffness=1e9))
    table = lm.Support("block-0", translations=True, dofs=("rx", "ry"))
    shake = dem.BaseMotion(0.4 * GRAVITY * np.sin(12.0 * np.arange(0.0, 0.3, 0.01)), 0.01, after="coast")
    kept, turns = (
        dem.simulate(made, shake, mode="dynamic", contact_points=(2, 2))
        for made in (free, free.with_supports([table]))
    )
    assert kept.quantities["peak displacement"] < 1e-3 < 0.1 < np.abs(kept.shift).max()
    assert turns.quantities["peak displacement"] == pytest.approx(kept.quantities["peak displacement"], rel=0.1)
    stopped = dem.simulate(
        free.with_supports([table]), dataclasses.replace(shake, stop_when_moved=1e-8), mode="dynamic",
        contact_points=(2, 2), sample=20,
    )
    assert stopped["time"][-1] < 0.5 * turns["time"][-1]


def test_a_displacement_is_asked_of_one_time_as_well():
    """A constant acceleration of 2 m/s2 has moved the ground by t^2 at t."""
    record = dem.BaseMotion([2.0] * 11, 0.1, after="coast")
    assert record.displacement(0.5) == pytest.approx(np.array([[0.25]]), rel=1e-12)
