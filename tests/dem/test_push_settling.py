"""Settling by own weight before a push, on joints as they are or on sound ones first; files that keep it and what they
refuse.
"""

from dataclasses import replace

import numpy as np
import pytest

import dem
import limitmason as lm
from dem import UnsettledError, UnstableError
from dem.driving.own_weight import BEYOND, weaken
from dem.kernels import LAW
from dem.stages.resuming import RunStatus
from limitmason.constants import GRAVITY
from limitmason.errors import InputError

KN, KS = 83e9, 36e9
DOWN = dem.Drive({"top": {"z": -1.0}})


def hanging(strength, blocks=3):
    """Blocks glued below a held beam, and ft, so many times the stress that they put on the uppermost joint."""
    outlines = [[[-0.3, 0.0], [0.5, 0.0], [0.5, 0.1], [-0.3, 0.1]]]
    for z in -0.1 * np.arange(1, blocks + 1):
        outlines.append([[0.0, z], [0.2, z], [0.2, z + 0.1], [0.0, z + 0.1]])
    ft = strength * 2000.0 * GRAVITY * 0.1 * blocks
    joint = lm.Joint(
        30.0, cohesion=1e6, tensile_strength=ft, normal_stiffness=KN, shear_stiffness=KS, residual_tensile_strength=0.0,
        residual_cohesion=0.0, lost_by="opening",
    )
    names = ["beam", *(f"b{k}" for k in range(blocks - 1)), "top"]
    wall = lm.Assembly.from_polygons(
        outlines, thickness=0.1, joint=joint, fixed=["beam"], names=names, density=2000.0
    )
    return wall, ft


# ---- sound joints ----


@pytest.mark.slow
def test_weight_that_comes_to_rest_on_sound_joints_breaks_only_what_it_would_break_at_rest():
    wall, ft = hanging(1.05)
    settle = dem.Settle(tolerance=1e-5, max_steps=4000)
    words = {"to": 1e-7, "rate_check": False, "steps": 4000, "settle": settle, "detect_every": None}
    # at once it overshoots by more than a twentieth, and the chain falls
    with pytest.raises(UnsettledError, match="falls before it is driven"):
        dem.push(wall, DOWN, **words)
    curve = dem.push(wall, DOWN, sound=True, **words)
    assert curve.settlement == pytest.approx((3 + 2 + 1) * 2000.0 * GRAVITY * 0.1 / KN, rel=1e-4)
    # what is left of its strength is what the drive may add
    assert curve.first_failure.load == pytest.approx((ft - ft / 1.05) * 0.2 * 0.1, rel=0.01)
    with pytest.raises(UnsettledError, match="falls before it is driven"):
        dem.push(hanging(0.98)[0], DOWN, sound=True, **words)
    # where nothing breaks nothing is settled anew, to the bit
    one, other = (dem.push(hanging(3.0)[0], DOWN, sound=s, **words).load for s in (False, True))
    assert (one == other).all()
    with pytest.raises(InputError, match="take no sound"):
        dem.push(wall, DOWN, to=1e-6, blocks="zoned", zone_size=0.1, sound=True)


# ---- files and interrupts ----


HUNG = dict(to=1e-7, steps=400, rate_check=False, settle=dem.Settle(tolerance=1e-3), samples=20, detect_every=None)


@pytest.mark.parametrize(
    ("then", "now", "name"),
    [
        ({}, {"sound": True}, "sound"),
        ({}, {"to": 3e-7}, "to"),
        ({}, {"steps": 500}, "steps"),
        ({}, {"samples": 10}, "samples"),
        ({}, {"damping": dem.Damping(local=0.7)}, "damping"),
        ({}, {"settle": dem.Settle(tolerance=1e-4)}, "settle"),
        ({}, {"joint_options": dem.JointOptions(residual_dilatancy_angle_deg=0.0)}, "joint_options"),
        ({}, {"contact_points": (4, 2)}, "contact points"),
        ({}, {"loads": lm.Loads(2.0 * np.ones((4, 6)), np.zeros((4, 6)))}, "loads"),
        ({"sound": True}, {}, "sound"),
    ],
)
def test_the_finished_file_of_another_push_is_refused_by_what_differs(tmp_path, then, now, name):
    wall = hanging(3.0)[0]
    kept = {**HUNG, "checkpoint": tmp_path / "push.npz"}
    first = dem.push(wall, DOWN, **{**kept, **then})
    for stop in (False, True):
        if stop:  # the driven file alone says it too
            (tmp_path / "push-settled.npz").unlink()
        with pytest.raises(InputError, match=rf"is of another run: its .*\b{name}\b.* differ.*delete this one"):
            dem.push(wall, DOWN, **{**kept, **now})
    again = dem.push(wall, DOWN, **{**kept, **then}, progress=lambda _: pytest.fail("it ran"))
    assert np.array_equal(again.load, first.load)


def test_a_file_that_does_not_say_how_it_was_run_is_refused(tmp_path):
    wall, file = hanging(3.0)[0], tmp_path / "push-settled.npz"
    dem.simulate(wall, dem.Settle(tolerance=1e-3)).save(file)
    with pytest.raises(InputError, match="does not say how its push was run"):
        dem.push(wall, DOWN, checkpoint=tmp_path / "push.npz", **HUNG)


def test_a_push_on_sound_joints_that_was_cut_off_goes_on_to_the_same_bits(tmp_path):
    wall = hanging(1.05)[0]
    kept = {**HUNG, "sound": True, "settle": dem.Settle(tolerance=1e-4, max_steps=1500)}
    whole, seen = dem.push(wall, DOWN, **kept), []
    file = tmp_path / "push.npz"
    cut = dem.push(wall, DOWN, **kept, checkpoint=file, progress=lambda s: seen.append(s) or len(seen) == 7)
    assert cut.status == "interrupted"
    assert np.array_equal(dem.push(wall, DOWN, **kept, checkpoint=file).load, whole.load)


def settling(monkeypatch, number, answer):
    """Replace what one of the runs of settling answers; the states that they begin with."""
    begun, real = [], dem.driving.own_weight.simulate

    def run(*args, start, **options):
        begun.append(start)
        history = real(*args, start=start, **options)
        return answer(history) if len(begun) == number else history

    monkeypatch.setattr(dem.driving.own_weight, "simulate", run)
    return begun


SOUND = {**HUNG, "sound": True, "settle": dem.Settle(tolerance=1e-4, max_steps=1500)}


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_keyboard_that_stops_any_run_of_settling_leaves_no_settled_file(tmp_path, monkeypatch, number):
    wall = hanging(1.05)[0]
    begun = settling(monkeypatch, number, lambda h: replace(h, status=RunStatus.INTERRUPTED))
    with pytest.raises(KeyboardInterrupt):
        dem.push(wall, DOWN, checkpoint=tmp_path / "push.npz", **SOUND)
    assert len(begun) == number
    assert not list(tmp_path.iterdir())


def test_sound_joints_are_tried_where_the_weight_has_come_on_once_more_evenly():
    # a block that slides brings the weight on evenly; the bond of another one breaks even so, and its floor bears it
    slope = np.array([[1.0, 0.0], [2.0, 0.0], [2.0, 0.5], [1.0, 0.1]])
    up, out = np.array([1.0, 0.4]) / np.hypot(1.0, 0.4), np.array([-0.4, 1.0]) / np.hypot(1.0, 0.4)
    foot = slope[3] + 0.4 * up
    block = np.array([foot, foot + 0.2 * up, foot + 0.2 * up + 0.2 * out, foot + 0.2 * out])
    floor, side, top = (np.array([[x, z], [x + b, z], [x + b, z + h], [x, z + h]]) for x, z, b, h in (
        (0.0, 0.0, 0.2, 0.1), (0.2, 0.1, 0.1, 0.2), (0.0, 0.1, 0.2, 0.2)))
    names = ["slope", "block", "floor", "side", "top"]
    wall = lm.Assembly.from_polygons(
        [slope, block, floor, side, top], thickness=0.1, fixed=["slope", "floor", "side"], names=names, density=2000.0,
        joint=lm.Joint(30.0, normal_stiffness=KN, shear_stiffness=KS),
    )
    weak = lm.Joint(
        30.0, cohesion=100.0, tensile_strength=100.0, normal_stiffness=KN, shear_stiffness=KS, residual_cohesion=0.0,
        residual_tensile_strength=0.0, lost_by="opening or slip",
    )
    wall = wall.with_interfaces([
        replace(i, joint=weak) if {names[i.block_a], names[i.block_b]} == {"side", "top"} else i
        for i in wall.interfaces
    ])
    words = {**HUNG, "settle": dem.Settle(tolerance=1e-4, max_steps=20000)}
    curve = dem.push(wall, DOWN, sound=True, **words)
    assert curve.settlement == pytest.approx(2000.0 * GRAVITY * 0.2 / KN, rel=0.01)


def test_sound_joints_that_do_not_settle_either_are_said_to(monkeypatch):
    settling(monkeypatch, 2, lambda h: replace(h, status=RunStatus.NOT_SETTLED))
    with pytest.raises(UnsettledError, match="does not settle"):
        dem.push(hanging(1.05)[0], DOWN, **SOUND)


def test_sound_joints_are_tried_where_the_weight_at_once_ends_unstable(monkeypatch):
    def explode(history):
        error = UnstableError("energy explodes")
        error.history = history
        raise error

    wall = hanging(1.05)[0]
    whole = dem.push(wall, DOWN, **SOUND)
    begun = settling(monkeypatch, 1, explode)
    assert np.array_equal(dem.push(wall, DOWN, **SOUND).load, whole.load)
    assert len(begun) == 3
    # what has broken nothing is not mended by it
    with pytest.raises(UnstableError, match="energy explodes"):
        begun.clear() or dem.push(hanging(3.0)[0], DOWN, **SOUND)


def test_joints_found_anew_on_the_way_have_their_own_strength_again():
    wall = hanging(1.05)[0]
    before = dem.initial_state(wall, lm.Loads.weight(wall))
    after = before.copy()
    for law in (after.joints.law, after.laws):
        law[:, [LAW.cohesion, LAW.tension]] = BEYOND
    # the uppermost joint is gone, another one is cut anew, from the interface between the last two blocks
    order = [1, 2, 2]
    after.joints = after.joints._replace(law=after.joints.law[order].copy())
    after.interface = np.array([1, 2, -2 - 2])
    after.laws[0] = before.laws[0]
    before.laws[2, LAW.tension] *= 0.5
    weaken(after, before)
    assert np.array_equal(after.joints.law[:, LAW.tension], before.laws[order, LAW.tension])
    assert np.array_equal(after.laws, before.laws)
