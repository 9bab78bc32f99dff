"""A run that is cut off and taken up gives the bits of the one that was not; what does not fit is refused by name."""

import subprocess
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from long_runs import JOINT, stages, wall_and_loads
from walls import stack

import dem
import limitmason as lm
from dem.stages.recording import Recorder
from dem.stages.resuming import check_same_stages, stage_as_text
from limitmason.errors import InputError
from limitmason.geometry import box


def assert_same(one, two):
    for name in ("reaction", "reaction_blocks", "shift", "quaternion", "opening"):
        assert np.array_equal(getattr(one, name), getattr(two, name), equal_nan=True), name
    for name in one.scalars:
        assert np.array_equal(one[name], two[name]), name
    mine, other = one.state.arrays(), two.state.arrays()
    assert mine.keys() == other.keys()
    for name, value in mine.items():
        assert np.array_equal(value, other[name], equal_nan=value.dtype.kind == "f"), name
    assert (one.status, one.factors, one.stages, one.warnings) == (two.status, two.factors, two.stages, two.warnings)


@pytest.mark.parametrize("calls", [1, 4, 7, 8, 11, 14])
def test_an_interrupted_run_saved_and_taken_up_gives_the_bits_of_the_whole_one(tmp_path, calls):
    wall, loads = wall_and_loads()
    whole = dem.simulate(wall, stages(), loads=loads, sample=190)
    seen = []
    cut = dem.simulate(wall, stages(), loads=loads, sample=190, progress=lambda s: seen.append(s) or len(seen) == calls)
    assert cut.status == "interrupted"
    assert len(cut["time"]) == calls
    cut.save(tmp_path / "cut.npz")
    again = dem.History.load(tmp_path / "cut.npz", wall)
    assert_same(again, cut)
    assert_same(dem.resume(again, stages()), whole)
    # what was taken up stands where it was, and is taken up once more
    assert_same(dem.resume(again, stages()), whole)
    assert_same(dem.resume(cut, stages()), whole)


class Killed(Exception):
    """Stands for a kill: nothing is written after it."""


@pytest.mark.parametrize("stage", [0, 1, 2, 3])
def test_a_run_killed_after_the_last_sample_of_a_stage_goes_on_from_there_to_the_same_bits(tmp_path, stage):
    wall, loads = wall_and_loads()
    whole = dem.simulate(wall, stages(), loads=loads, sample=190)
    count = int((whole["stage"] <= stage).sum())
    assert whole["stage"][count - 1] == stage < whole["stage"][count]

    def kill(sample):
        if sample["step"] == whole["step"][count - 1]:
            raise Killed

    path = tmp_path / "cut.npz"
    with pytest.raises(Killed):
        dem.simulate(
            wall, stages(), loads=loads, sample=190, progress=kill, checkpoint=path, checkpoint_every=count
        )
    cut = dem.History.load(path, wall)
    assert len(cut["step"]) == count
    assert_same(dem.resume(cut, stages()), whole)


@pytest.mark.parametrize("ends", [0, 1, 2])
def test_a_run_cut_by_the_sample_that_ends_a_stage_before_its_time_does_not_go_on_in_it(tmp_path, ends):
    """It took one sample more: of a Settle at rest, or of a ramp under which a block had moved far enough."""
    block = stack([(0.4, 1.0)])
    run = [dem.Settle(), dem.Ramp(to=1.0, steps=4000, stop_when_moved=0.01), dem.Settle(tolerance=1.0)]
    whole = dem.simulate(block, run, loads=lm.Loads.horizontal(block), sample=100)
    assert whole["multiplier"][-1] < 1.0
    last = whole["step"][whole["stage"] <= ends][-1]
    cut = dem.simulate(
        block, run, loads=lm.Loads.horizontal(block), sample=100, progress=lambda sample: sample["step"] == last,
    )
    assert cut.status == "interrupted"
    assert_same(dem.resume(cut, run), whole)
    cut.save(tmp_path / "cut.npz")
    assert_same(dem.resume(dem.History.load(tmp_path / "cut.npz", block), run), whole)


def test_a_run_that_starts_from_one_cut_off_in_a_drive_does_not_hold_what_that_drove():
    """The block stayed held for good: on a table that tilts beyond its friction it did not slide."""
    block = stack([(0.4, 0.2)], mu=0.3)
    drive = [dem.Settle(), dem.Drive({1: {"x": 1e-4}}, steps=400)]
    cut = dem.simulate(block, drive, sample=50, progress=lambda sample: sample["stage"] == 1)
    assert cut.status == "interrupted"
    tilted = dem.simulate(block, dem.Tilt(to_deg=25.0, steps=4000, stop_when_moved=2e-3), start=cut)
    assert tilted["step"][-1] - cut["step"][-1] < 4000
    assert tilted.reaction_blocks.tolist() == [0]


def falling():
    """A block that topples on a floor: contacts are found and cut anew on the way."""
    solids = [box((-3, -3, -0.1), (3, 3, 0.0)), box((0, 0, 0), (0.2, 0.3, 0.8))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0, normal_stiffness=1e8), fixed=[0])
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=dem.JointOptions(dashpot=3e-4))
    spin = np.array([0.0, 1.2, 0.0])
    state.bodies.ang[1] = np.linalg.inv(state.bodies.inv_inertia[1]) @ spin
    state.bodies.vel[1] = np.cross(spin, a.centroids[1] - (0.2, 0.15, 0.0))
    return a, state


@pytest.mark.slow
@pytest.mark.parametrize("calls", [2, 11])
def test_a_fall_with_new_contacts_is_taken_up_to_the_same_bits(tmp_path, calls):
    a, state = falling()
    fall = [dem.Hold(duration=1.2)]
    whole = dem.simulate(a, fall, start=state, sample=97)
    assert whole.state.interface.min() < 0  # cut anew
    seen = []
    cut = dem.simulate(a, fall, start=state, sample=97, progress=lambda s: seen.append(s) or len(seen) == calls)
    cut.save(tmp_path / "cut.npz")
    assert_same(dem.resume(dem.History.load(tmp_path / "cut.npz", a), fall), whole)


@pytest.mark.slow
def test_a_run_is_taken_up_to_the_same_bits_where_a_sample_looked_for_contacts():
    """A joint that pivots on the wrong face is seen and cut anew by a sample: what is kept there is what follows it.

    A column under three records ended 7 mm beside the whole run where it was cut at one of 45 samples.
    """
    joint = lm.Joint(33.0, normal_stiffness=2e8, shear_stiffness=1e8)
    column = lm.build.column(width=0.3, depth=0.3, height=0.9, courses=3, joint=joint)
    sine = 9.81 * np.sin(2.0 * np.pi * np.arange(0.0, 0.305, 0.01) / 0.3)
    shaken = [dem.BaseMotion(part * sine, 0.01, after="coast") for part in (0.4, -0.6)]
    looked, sampled = [], Recorder.add

    def add(self, state, stage):
        before = self.watch.due
        row = sampled(self, state, stage)
        if self.watch.due != before:
            looked.append(len(self.samples))
        return row

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Recorder, "add", add)
        whole = dem.simulate(column, shaken, mode="dynamic", sample=0.02)
    assert looked
    for count in looked:
        time = whole["time"][count - 1]
        cut = dem.simulate(
            column, shaken, mode="dynamic", sample=0.02, progress=lambda row, time=time: row["time"] >= time
        )
        assert len(cut["step"]) == count
        assert_same(dem.resume(cut, shaken), whole)


BUILDERS = Path(__file__).resolve().parents[1] / "builders"
CHILD = """
    import sys, pathlib
    sys.path.insert(0, {builders!r})
    import dem
    from long_runs import stages, wall_and_loads
    wall, loads = wall_and_loads()
    if sys.argv[1] == "run":
        def slow(sample):
            import time
            time.sleep(0.05)
        dem.simulate(wall, stages(), loads=loads, sample=50, checkpoint={path!r}, checkpoint_every=3, progress=slow)
    else:
        dem.resume(dem.History.load({path!r}, wall), stages()).save({path!r} + ".whole")
"""


@pytest.mark.slow
def test_a_killed_process_is_taken_up_by_a_fresh_one_to_the_same_bits(tmp_path):
    path = tmp_path / "check.npz"
    script = tmp_path / "child.py"
    script.write_text(textwrap.dedent(CHILD.format(builders=str(BUILDERS), path=str(path))))
    child = subprocess.Popen([sys.executable, str(script), "run"])
    until = time.monotonic() + 120.0
    while not path.exists() and child.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    time.sleep(0.5)
    assert child.poll() is None, "the run was over before it could be killed"
    child.kill()
    child.wait()
    subprocess.run([sys.executable, str(script), "resume"], check=True)
    wall, loads = wall_and_loads()
    assert_same(
        dem.History.load(str(path) + ".whole", wall), dem.simulate(wall, stages(), loads=loads, sample=50)
    )


def test_a_history_goes_on_with_its_own_loads_and_factors():
    wall, loads = wall_and_loads()
    begun = dem.simulate(wall, [dem.Settle(), dem.Ramp(to=0.3, steps=400)], loads=loads)
    given = dem.simulate(wall, dem.Hold(steps=300), loads=loads, start=begun)
    left_out = dem.simulate(wall, dem.Hold(steps=300), start=begun)
    by_state = dem.simulate(wall, dem.Hold(steps=300), start=begun.state)
    for other in (left_out, by_state):
        assert_same(other, given)
    assert given["multiplier"][-1] == pytest.approx(0.3)


@pytest.mark.slow
def test_stages_one_by_one_give_the_bits_of_one_run_of_them_all_where_contacts_are_searched_for(tmp_path):
    # a search at every begin moved a wall of two stages by 0.1 mm of 120 at its end
    t = np.arange(0.0, 0.405, 0.01)
    shaken = dem.BaseMotion(np.column_stack([6 * np.sin(20 * t), 9 * np.cos(31 * t), 0 * t]), 0.01, after="coast")
    column = stack([(0.3, 0.2)] * 4, joint=JOINT)
    every = [shaken, dem.Hold(duration=0.06), dem.Hold(duration=0.06)]
    options = {"contact_points": (2, 2), "mode": "dynamic"}
    whole = dem.simulate(column, every, sample=0.02, **options)
    assert any("contacts are searched for" in w for w in whole.warnings)
    history = dem.simulate(column, every[0], sample=0.02, **options)
    for stage in every[1:]:
        history.save(tmp_path / "part.npz")
        history = dem.simulate(column, stage, start=dem.History.load(tmp_path / "part.npz", column), sample=0.02)
    mine, other = history.state.arrays(), whole.state.arrays()
    for name, value in mine.items():
        assert np.array_equal(value, other[name], equal_nan=value.dtype.kind == "f"), name
    for name in ("kinetic", "elastic", "friction", "damping", "support"):
        assert history[name][-1] == whole[name][-1], name


def test_what_does_not_fit_the_run_before_is_refused_by_name(tmp_path):
    wall, loads = wall_and_loads()
    begun = dem.simulate(wall, [dem.Hold(steps=100), dem.Ramp(to=0.3, steps=400)], loads=loads)
    hold = dem.Hold(steps=10)
    first = wall.interfaces[0]
    pair = wall.blocks[first.block_a].name, wall.blocks[first.block_b].name
    other = wall.with_joints({pair: replace(JOINT, cohesion=1e3)})
    with pytest.raises(ValueError, match=r"joint between .* another cohesion now \(1000\), not 0"):
        dem.simulate(other, hold, loads=loads, start=begun)
    begun.save(tmp_path / "run.npz")
    with pytest.raises(ValueError, match="another cohesion"):
        dem.History.load(tmp_path / "run.npz", other)
    with pytest.raises(ValueError, match="another model .* 3 blocks and had 8"):
        dem.History.load(tmp_path / "run.npz", stack([(0.3, 0.2)] * 2, joint=JOINT))
    with pytest.raises(ValueError, match=f"live load of block '{wall.blocks[1].name}'"):
        dem.simulate(wall, hold, loads=lm.Loads.horizontal(wall, (0, 1, 0)), start=begun)
    heavier = lm.Loads(1.1 * loads.dead, loads.live)
    with pytest.raises(ValueError, match=f"dead load of block '{wall.blocks[1].name}'"):
        dem.simulate(wall, hold, loads=heavier, start=begun)
    with pytest.raises(ValueError, match="joint_options differ"):
        dem.simulate(wall, hold, start=begun, joint_options=dem.JointOptions(stiffness_factor=2.0))
    for name, value in (("contact_points", (2, 2)), ("dt", 2.0), ("contact_model", "grid")):
        with pytest.raises(ValueError, match=name):
            dem.simulate(wall, hold, start=begun, **{name: value})
    with pytest.raises(ValueError, match="quasi-static, not dynamic"):
        dem.simulate(wall, hold, start=begun, mode="dynamic")
    with pytest.raises(ValueError, match="5 numbers"):
        dem.simulate(wall, hold, start=begun, factors=[1.0])
    with pytest.raises(ValueError, match="the run is over"):
        dem.resume(begun, hold)
    with np.load(tmp_path / "run.npz") as file:
        arrays = dict(file)
    for missing in ("state.factors", "state.laws", "state.dead", "scalar.kinetic", "reaction", "words"):
        np.savez(tmp_path / "less.npz", **{k: v for k, v in arrays.items() if k != missing})
        with pytest.raises(ValueError, match=missing.removeprefix("state.")):
            dem.History.load(tmp_path / "less.npz", wall)


def test_other_stages_than_those_that_were_cut_off_are_refused_by_number():
    wall, loads = wall_and_loads()
    cut = dem.simulate(wall, stages(), loads=loads, progress=lambda s: s["step"] >= 800)
    wrong = stages()
    wrong[1] = dem.Ramp(to=0.4, steps=900)
    with pytest.raises(ValueError, match="stage 1"):
        dem.resume(cut, wrong)
    with pytest.raises(ValueError, match="5 stages, 3 are given"):
        dem.resume(cut, stages()[:3])


@pytest.mark.slow
def test_an_interrupt_from_the_keyboard_leaves_a_state_that_goes_on_to_the_same_bits():
    import os
    import signal

    wall, loads = wall_and_loads()
    long = [dem.Hold(steps=60_000)]
    samples = []

    def strike(row):
        # from within the run, so that the signal meets it on any machine
        samples.append(row)
        if len(samples) == 7:
            os.kill(os.getpid(), signal.SIGINT)

    cut = dem.simulate(wall, long, loads=loads, progress=strike)
    assert cut.status == "interrupted"
    assert len(samples) < 60_000 // 200
    assert_same(dem.resume(cut, long), dem.simulate(wall, long, loads=loads))


def test_every_field_of_a_stage_and_of_its_damping_counts():
    plain = dem.Drive({1: {"x": 1e-3}}, damping=dem.Damping(local=0.5))
    old = stage_as_text(plain)
    check_same_stages([plain], [old])
    for other in (replace(plain, calm=1e-3), replace(plain, damping=dem.Damping(local=0.5, combined=True))):
        with pytest.raises(InputError, match="is not the one"):
            check_same_stages([other], [old])


def test_a_run_that_begins_writes_over_no_checkpoint_and_no_file_of_somebody_else(tmp_path):
    """The same script, started again after a kill, wrote its first samples over what was to be gone on from."""
    wall, loads = wall_and_loads()
    hold, path = dem.Hold(steps=300), tmp_path / "cut.npz"
    options = {"loads": loads, "sample": 50, "checkpoint": path, "checkpoint_every": 2}
    cut = dem.simulate(wall, hold, progress=lambda sample: sample["step"] >= 200, **options)
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"cut.npz holds a run already: go on with dem.resume"):
        dem.simulate(wall, hold, **options)
    assert path.read_bytes() == before
    whole = dem.simulate(wall, hold, loads=loads, sample=50)
    again = dem.resume(dem.History.load(path, wall), hold, checkpoint=path, checkpoint_every=2)
    assert_same(again, whole)
    # a run that goes on from another takes its file
    dem.simulate(wall, hold, start=cut, checkpoint=path, checkpoint_every=2)
    np.savez(tmp_path / "mine.npz", x=np.arange(3.0))
    with pytest.raises(InputError, match=r"mine.npz is no checkpoint of a run, and would be lost"):
        dem.simulate(wall, hold, start=cut, checkpoint=tmp_path / "mine.npz")
    with pytest.raises(InputError, match="is a folder: give a file"):
        dem.resume(cut, hold, checkpoint=tmp_path)
