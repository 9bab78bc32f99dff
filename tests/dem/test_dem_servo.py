"""Servo jacks: constant push on a block that is driven sideways, parallel or free to turn; drives that stay."""

import numpy as np
import pytest
from walls import on_slab

import dem
import limitmason as lm

BREADTH, HEIGHT, BEAM = 0.2, 0.6, 0.2


def pier():
    """A pier of one block under a loading beam as wide as itself."""
    return on_slab(
        [((0, 0, 0), (BREADTH, BREADTH, HEIGHT)), ((0, 0, HEIGHT), (BREADTH, BREADTH, HEIGHT + BEAM))],
        joint=lm.Joint(60.0, normal_stiffness=1e10),
    )


def pushed(parallel, travel=4e-4):
    b = pier()
    servo = {2: dem.Servo(10.0 * b.weights[1], parallel=parallel)}
    stages = [
        dem.Settle(servo=servo, tolerance=1e-5),
        dem.Drive(displacement={2: {"x": travel}}, steps=20_000, servo=servo),
        dem.Settle(servo=servo, tolerance=1e-5, name="after"),
    ]
    return b, dem.simulate(b, stages, contact_points=(2, 2))


@pytest.mark.parametrize("parallel", [False, True])
def test_a_servo_keeps_its_push_while_a_rocking_pier_lifts_the_beam(parallel):
    b, h = pushed(parallel)
    push = -h.reaction_of(2)[:, 2]
    wanted, weight, top = 10.0 * b.weights[1], b.weights[1], b.weights[2]
    late = (h["stage"] == 1) & (h["step"] > h["step"][h["stage"] == 1][0] + 15_000)
    assert push[late] == pytest.approx(np.full(late.sum(), wanted), rel=5e-3)
    assert h.displacement_of(2)[late, 2].max() > 1e-5  # a held height would have jammed the pier
    # rocking: the whole breadth as lever arm where the beam stays parallel, half of it where it turns with the pier
    exact = (
        ((wanted + top) * BREADTH + weight * BREADTH / 2) / HEIGHT
        if parallel
        else (wanted + top + weight) * BREADTH / 2 / (HEIGHT + BEAM / 2)
    )
    assert h.reaction_of(2)[late, 0][-1] == pytest.approx(exact, rel=1e-2)
    # the jack's velocity changes in jumps, whose work is known to half a step
    assert np.abs(h.energy_error).max() < 1e-2 * np.abs(h["support"]).max()


def test_a_servo_reaches_its_push_from_nothing_and_lets_go_after_its_stage():
    b = pier()
    settled = dem.simulate(b, dem.Settle(servo={2: dem.Servo(500.0)}, tolerance=1e-6), contact_points=(2, 2))
    assert settled.status == "finished"
    assert -settled.reaction_of(2)[-1, 2] == pytest.approx(500.0, rel=1e-4)
    assert settled.reaction_of(0)[-1, 2] == pytest.approx(500.0 + b.weights[1] + b.weights[2], rel=1e-4)
    free = dem.simulate(b, dem.Settle(), start=settled)
    assert free.status == "finished"
    assert free.reaction_of(0)[-1, 2] == pytest.approx(b.weights[1] + b.weights[2], rel=1e-5)


def test_mistakes_in_a_servo_are_named():
    b = pier()
    with pytest.raises(ValueError, match="gain"):
        dem.Servo(1.0, gain=0.0)
    for stage in (
        dem.Settle(servo={0: dem.Servo(1.0)}),
        dem.Drive(displacement={2: {"z": 1e-3}}, steps=10, servo={2: dem.Servo(1.0)}),
    ):
        with pytest.raises(ValueError, match="vertical is held or driven"):
            dem.simulate(b, stage)


def test_a_block_held_by_an_earlier_drive_keeps_recording_its_reaction():
    b = pier()
    first = dem.simulate(
        b, [dem.Settle(), dem.Drive(displacement={2: {"x": 1e-4}}, steps=4000, keep=True)], contact_points=(2, 2)
    )
    later = dem.simulate(b, dem.Settle(tolerance=1e-7), start=first)
    # what the drive holds is no unbalanced force: the run settles, and the reaction is still there
    assert later.status == "finished"
    exact = (b.weights[1] + b.weights[2]) * BREADTH / 2 / (HEIGHT + BEAM / 2)
    assert later.reaction_of(2)[-1, 0] == pytest.approx(exact, rel=5e-3)


def test_a_push_that_strays_from_its_servo_is_named_with_what_it_was():
    """What the beam bears at any sample is known from the reaction that is recorded: at a fast drive not its force."""
    b = pier()
    wanted = 10.0 * b.weights[1]
    servo = {2: dem.Servo(wanted, parallel=False)}
    for steps, strays in ((2_000, True), (40_000, False)):
        drive = dem.Drive(displacement={2: {"x": 4e-4}}, steps=steps, servo=servo)
        h = dem.simulate(b, [dem.Settle(servo=servo, tolerance=1e-5), drive], contact_points=(2, 2))
        push = -h.reaction_of(2)[h["stage"] == 1, 2]
        assert bool(np.abs(push / wanted - 1.0).max() > 0.05) is strays
        said = [w for w in h.warnings if f"servo on block {b.blocks[2].name!r}" in w]
        assert len(said) == strays
        assert not strays or f"pushed by {push.min():.5g} to {push.max():.5g} N, its force is {wanted:.5g} N" in said[0]
