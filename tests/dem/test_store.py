"""Samples on disk while a run goes on: the bits of a run in memory, read without loading, taken up after a kill."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.stages.simulate import prepared
from limitmason.errors import InputError

WALL = lm.build.wall(
    length=0.4, courses=3, unit=(0.2, 0.1, 0.1), joint=lm.Joint(30.0, normal_stiffness=1e8, shear_stiffness=5e7)
)
SHAKE = dem.BaseMotion(tuple(6.0 * np.sin(2.0 * np.pi * 4.0 * np.arange(0.0, 0.25, 0.005))), 0.005, after="coast")
STAGES = [SHAKE, dem.Hold(duration=0.05)]
OPTIONS = {"mode": "dynamic", "contact_points": (2, 2), "sample": 40}


@pytest.fixture(scope="module")
def in_memory():
    return dem.simulate(WALL, STAGES, **OPTIONS)


def same(one, two):
    """The samples and the end of two histories, to the last bit."""
    names = ("reaction", "shift", "quaternion", "opening", "slip", "crushed", "used", "failed", "tie_force")
    return (
        all(np.array_equal(getattr(one, n), getattr(two, n), equal_nan=True) for n in names)
        and all(np.array_equal(one.scalars[k], two.scalars[k]) for k in one.scalars)
        and all(np.array_equal(v, two.state.arrays()[k], equal_nan=True) for k, v in one.state.arrays().items()
                if v.dtype.kind == "f")
    )


def test_a_run_with_a_store_gives_the_bits_of_one_in_memory_and_is_read_without_loading(tmp_path, in_memory):
    kept = dem.simulate(WALL, STAGES, store=tmp_path / "run", **OPTIONS)
    assert same(kept, in_memory)
    read = dem.History.load(tmp_path / "run", WALL)
    assert same(read, in_memory)
    assert isinstance(read.shift, np.memmap)
    # plain numbers, sample after sample, as layout.json says
    raw = np.fromfile(tmp_path / "run" / "shift.f8").reshape(-1, WALL.n_blocks, 3)
    assert np.array_equal(raw, in_memory.shift)
    assert np.array_equal(read.rotation_of(2), in_memory.rotation_of(2))


def test_chosen_blocks_alone_are_kept_and_others_are_refused_by_name(tmp_path, in_memory):
    top = WALL.blocks[-1].name
    kept = dem.simulate(WALL, STAGES, store=dem.Store(tmp_path / "run", blocks=[top, 1], joints=False), **OPTIONS)
    read = dem.History.load(tmp_path / "run", WALL)
    for history in (kept, read):
        assert history.shift.shape == (len(in_memory.shift), 2, 3)
        assert np.array_equal(history.displacement_of(top), in_memory.displacement_of(top))
        assert np.array_equal(history.rotation_of(1), in_memory.rotation_of(1))
        assert history.opening.shape[1] == 0
        with pytest.raises(InputError, match="count from the ground, and no held block is among Store"):
            _ = history.quantities
        with pytest.raises(InputError, match=WALL.blocks[2].name):
            history.displacement_of(2)
        with pytest.raises(InputError, match=WALL.blocks[0].name):
            history.corners()
    assert (tmp_path / "run" / "shift.f8").stat().st_size == 8 * 6 * len(in_memory.shift)


def test_what_a_test_would_write_down_is_known_of_chosen_blocks(tmp_path, in_memory):
    top = WALL.blocks[-1].name
    kept = dem.simulate(WALL, STAGES, store=dem.Store(tmp_path / "run", blocks=[top, "base"]), **OPTIONS)
    moved = np.linalg.norm(in_memory.displacement_of(top) - in_memory.displacement_of("base"), axis=1)
    assert kept.quantities["peak displacement"] == pytest.approx(moved.max(), rel=1e-12)
    assert kept.quantities["residual displacement"] == pytest.approx(moved[-1], rel=1e-12)


KILLED = """
import os, signal, sys
sys.path.insert(0, {folder!r})
from test_store import OPTIONS, STAGES, WALL, dem
seen = []
def progress(sample):
    seen.append(sample)
    if len(seen) == {after}:
        os.kill(os.getpid(), signal.SIGKILL)
dem.simulate(WALL, STAGES, store={store!r}, checkpoint_every=3, progress=progress, **OPTIONS)
"""


@pytest.mark.slow
@pytest.mark.parametrize("after", [5, 8])
def test_a_run_that_was_killed_goes_on_to_the_same_bits(tmp_path, in_memory, after):
    # two samples more than the checkpoint knows of were written, and half of another
    words = KILLED.format(folder=os.path.dirname(__file__), after=after, store=str(tmp_path / "run"))
    done = subprocess.run([sys.executable, "-c", words], env={**os.environ})
    assert done.returncode == -signal.SIGKILL
    with (tmp_path / "run" / "shift.f8").open("ab") as file:
        file.write(b"\x01" * 100)
    with pytest.raises(InputError, match="holds a run already"):
        dem.simulate(WALL, STAGES, store=tmp_path / "run", **OPTIONS)
    cut = dem.History.load(tmp_path / "run", WALL)
    assert len(cut.shift) == 3 * (after // 3)
    assert np.array_equal(cut.shift, in_memory.shift[: len(cut.shift)])
    assert same(dem.resume(cut, STAGES), in_memory)
    assert same(dem.History.load(tmp_path / "run", WALL), in_memory)


def test_samples_by_time_are_at_the_first_step_after_each_multiple():
    every = 0.01
    options = {k: v for k, v in OPTIONS.items() if k != "sample"}
    # searches for contacts begin where a sample sees that blocks have moved: what samples do not move has first ones
    h = dem.simulate(WALL, STAGES, sample=every, detect_every=None, **options)
    by_steps = dem.simulate(WALL, STAGES, sample=40, detect_every=None, **options)
    # each stage counts from its own begin, and its end is a sample
    for stage, (begin, end) in enumerate(((0.0, 0.245), (0.245, 0.295))):
        times = h["time"][h["stage"] == stage] - begin
        wanted = every * np.arange(1, int((end - begin) / every + 1e-6) + 1)
        assert len(times) == len(wanted) + (end - begin - wanted[-1] > 1e-6)
        late = times[: len(wanted)] - wanted
        assert (late > -1e-9).all()
        assert late.max() < h.state.dt
    # when a sample is taken moves no block: time is summed up in other pieces, and rounded elsewhere
    assert np.abs(h.shift[-1] - by_steps.shift[-1]).max() < 1e-12


def test_what_does_not_go_together_is_refused(tmp_path):
    with pytest.raises(InputError, match="is for dynamic runs"):
        dem.simulate(WALL, dem.Hold(steps=10), sample=0.1)
    with pytest.raises(InputError, match="sample must be positive"):
        dem.simulate(WALL, STAGES, sample=0.0, mode="dynamic")
    with pytest.raises(InputError, match="checkpoint of a run with a store"):
        dem.simulate(WALL, STAGES, store=tmp_path / "run", checkpoint=tmp_path / "other.npz", mode="dynamic")
    with pytest.raises(InputError, match="nobody"):
        dem.simulate(WALL, STAGES, store=dem.Store(tmp_path / "run", blocks=["nobody"]), mode="dynamic")


def test_the_part_that_is_done_counts_steps_not_stages():
    run = prepared(WALL, [dem.Hold(steps=100), dem.Hold(steps=900)], contact_points=(2, 2), sample=50)
    run.begin()
    parts = []
    while not run.over:
        run.advance()
        parts.append(run.where[0])
    assert parts == pytest.approx(np.arange(1, 21) / 20.0)


def test_nothing_of_somebody_else_is_written_over(tmp_path):
    """Arrays of those names were cut to nothing, and a file in place of the folder was told in the system's words."""
    brief = dem.Hold(steps=10)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match=r"the store .*file is a file: give a folder"):
        dem.simulate(WALL, brief, store=tmp_path / "file")
    (tmp_path / "shift.f8").write_text("mine")
    with pytest.raises(InputError, match=r"shift.f8 is of no run, and would be lost"):
        dem.simulate(WALL, brief, store=tmp_path)
    for text, words in (("mine", "not JSON"), ('{"columns": 3}', "no layout of a run"), ("[]", "no")):
        (tmp_path / "layout.json").write_text(text)
        with pytest.raises(InputError, match=rf"layout.json.*{words}"):
            dem.simulate(WALL, brief, store=tmp_path)
        assert (tmp_path / "layout.json").read_text() == text
    assert (tmp_path / "shift.f8").read_text() == "mine"


def test_two_runs_do_not_write_to_one_folder(tmp_path):
    """Both appended their samples to the same files: every other one was of the other run, and nothing said so."""
    second = []

    def start_again(_):
        with pytest.raises(InputError, match="another run writes to .*run now"):
            dem.simulate(WALL, dem.Hold(steps=40), store=tmp_path / "run", **OPTIONS)
        second.append(1)

    cut = dem.simulate(WALL, dem.Hold(steps=80), store=tmp_path / "run", progress=start_again, **OPTIONS)
    assert len(second) == 2
    assert cut.shift.shape[0] == 2

    def cut_short(_):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        dem.simulate(WALL, dem.Hold(steps=80), store=tmp_path / "next", progress=cut_short, **OPTIONS)
    # the folder is free again, and without a checkpoint nothing in it can be gone on from
    assert dem.simulate(WALL, dem.Hold(steps=80), store=tmp_path / "next", **OPTIONS).status == "finished"
