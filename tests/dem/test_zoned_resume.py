"""A zoned push that is cut off and taken up gives the bits of the whole one; what does not fit is refused by name."""

import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.errors import InputError

STONE = lm.Material(
    young_modulus=5e9, poisson_ratio=0.2, density=2000.0, cohesion=1e5, friction_angle_deg=40.0, tensile_strength=2e4,
)
ELASTIC = lm.Material(young_modulus=6e9, poisson_ratio=0.2, density=2000.0)
DRIVE = dem.Drive({"beam": {"x": 1.0}})
OPTIONS = dict(to=(1e-3, 5e-4), blocks="zoned", zone_size=0.2, samples=40, steps=800)


def wall(friction=40.0, material=STONE):
    """Stones that crack, joints that break and slide: everything that a file must hold is in use."""
    joint = lm.Joint(
        friction, normal_stiffness=2e10, shear_stiffness=1e10, cohesion=5e4, tensile_strength=3e4,
        residual_cohesion=0.0, residual_tensile_strength=0.0, dilatancy_angle_deg=5.0,
    )
    made = lm.build.wall(
        length=0.8, courses=4, unit=(0.4, 0.2, 0.2), joint=joint, density=2000.0, top_beam=0.2, beam_density=60_000.0
    )
    return made.with_material(material, blocks=[b.name for b in made.blocks if b.name != "beam"])


def assert_same(one, two):
    for name in ("displacement", "load", "opening", "slip", "crushed", "used", "failed"):
        assert np.array_equal(getattr(one, name), getattr(two, name), equal_nan=True), name
    for name, values in one.errors.items():
        assert np.array_equal(values, two.errors[name]), name
    for mine, other in zip(one.zones, two.zones, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(mine, other, strict=True))
    for mine, other in zip(one.states, two.states, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(mine, other, strict=True))
    for name in ("status", "warnings", "events", "settlement"):
        assert getattr(one, name) == getattr(two, name), name


@pytest.fixture(scope="module")
def whole():
    curve = dem.push(wall(), DRIVE, **OPTIONS)
    # or the file would have nothing to hold
    assert (curve.zones[-1].plastic > 0.0).any()
    assert np.nanmax(curve.slip[-1]) > 1e-5
    assert np.nanmax(curve.failed[-1]) > 0.1
    return curve


@pytest.mark.parametrize("calls", [1, 33, 60])
def test_a_stopped_push_goes_on_to_the_bits_of_the_whole_one(tmp_path, whole, calls):
    seen = []

    def stop(sample):
        seen.append(sample)
        return len(seen) == calls

    cut = dem.push(wall(), DRIVE, checkpoint=tmp_path / "cut.npz", progress=stop, **OPTIONS)
    assert cut.status == "interrupted"
    # of the slower run where the faster one is over
    assert len(cut) == 1 + calls - 40 * (calls > 40)
    again = dem.push(wall(), DRIVE, checkpoint=tmp_path / "cut.npz", **OPTIONS)
    assert_same(again, whole)
    assert_same(again.faster, whole.faster)
    # and once more there is nothing left to compute
    assert_same(dem.push(wall(), DRIVE, checkpoint=tmp_path / "cut.npz", **OPTIONS), whole)


def test_time_left_counts_from_where_a_push_was_taken_up(tmp_path):
    options = dict(OPTIONS, rate_check=False, checkpoint=tmp_path / "cut.npz")
    dem.push(wall(), DRIVE, progress=lambda s: s["part"] > 0.9, **options)
    seen = []
    dem.push(wall(), DRIVE, progress=lambda s: seen.append((s["part"], s["time left"])), **options)
    assert seen[0][0] > 0.9
    # a pace over the steps of the run before would be some twenty times too quick
    assert seen[-1] == (1.0, 0.0)
    assert all(left > 0.0 for _, left in seen[:-1])


@pytest.mark.parametrize(
    ("model", "changed", "named"),
    [
        (wall, {"to": 2e-3}, "its to differ"),
        (wall, {"steps": 900}, "its steps differ"),
        (wall, {"zone_size": 0.1}, "its zones"),
        (wall, {"stress": "plane strain"}, "its materials, stress differ"),
        (lambda: wall(35.0), {}, "its joints differ"),
        (lambda: wall(40.0, ELASTIC), {}, "its materials differ"),
    ],
)
def test_a_checkpoint_of_another_push_is_refused_by_what_differs(tmp_path, model, changed, named):
    path = tmp_path / "run.npz"
    dem.push(wall(), DRIVE, checkpoint=path, progress=lambda _: True, **OPTIONS)
    with pytest.raises(InputError, match=named):
        dem.push(model(), DRIVE, checkpoint=path, **{**OPTIONS, **changed})


def test_a_file_of_something_else_is_refused(tmp_path):
    np.savez(tmp_path / "run-settled.npz", shift=np.zeros(3))
    with pytest.raises(InputError, match="does not say how its push was run"):
        dem.push(wall(), DRIVE, checkpoint=tmp_path / "run.npz", **OPTIONS)


CHILD = """
    import sys, time
    sys.path.insert(0, {here!r})
    import dem
    from test_zoned_resume import DRIVE, OPTIONS, wall
    slow = (lambda s: time.sleep(0.05)) if sys.argv[1] == "run" else None
    dem.push(wall(), DRIVE, checkpoint={path!r}, progress=slow, **OPTIONS)
"""


@pytest.mark.slow
def test_a_killed_process_is_taken_up_by_a_fresh_one_to_the_same_bits(tmp_path, whole):
    script, file = tmp_path / "child.py", tmp_path / "run-v3.npz"
    here = str(Path(__file__).resolve().parent)
    script.write_text(textwrap.dedent(CHILD.format(here=here, path=str(tmp_path / "run.npz"))))
    child = subprocess.Popen([sys.executable, str(script), "run"])
    until = time.monotonic() + 120.0
    while not file.exists() and child.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    assert child.poll() is None, "the run was over before it could be killed"
    child.kill()
    child.wait()
    subprocess.run([sys.executable, str(script), "resume"], check=True)
    assert_same(dem.push(wall(), DRIVE, checkpoint=tmp_path / "run.npz", **OPTIONS), whole)
