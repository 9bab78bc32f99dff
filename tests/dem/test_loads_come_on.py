"""Loads that come on at once or evenly: a block on a table, pressed and pulled sideways below its friction."""

from dataclasses import replace

import numpy as np
import pytest
from builders.walls import on_slab
from referee.driven import PART
from referee.engines import ENGINES
from referee.statics import Statics
from scipy.spatial.transform import Rotation

import dem
import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box

FORCE, KN, KS, AREA = 0.4, 1e9, 4e8, 0.09  # sideways over the weight, at a friction of 0.5; [Pa/m], [m2]


def pulled(angle):
    """Block and table, and its weight with a force at an angle to x, through the middle of the face between them."""
    wall = on_slab([((-0.15, -0.15, 0.0), (0.15, 0.15, 0.2))], mu=0.5)
    wall = wall.with_joints(lambda j: replace(j, normal_stiffness=KN, shear_stiffness=KS))
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    dead = lm.Loads.weight(wall).dead.copy()
    force = FORCE * wall.weights[1] * along
    dead[1, :3] += force
    dead[1, 3:] += np.cross((0.0, 0.0, -0.1), force)
    exact = force / (KS * AREA) - (0.0, 0.0, wall.weights[1] / (KN * AREA))
    return wall, lm.Loads(dead, 0.0 * dead), exact


@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 4])
def test_loads_that_come_on_gently_leave_what_sticks_where_statics_has_it(angle):
    wall, loads, exact = pulled(angle)
    run = dem.simulate(wall, dem.Settle(gently=2000), loads=loads)
    assert run.status == "finished"
    assert run.shift[-1, 1] == pytest.approx(exact, rel=1e-4, abs=1e-6 * np.abs(exact).max())
    assert not any("slid" in note for note in run.warnings)


def test_loads_at_once_overshoot_and_slide_and_the_run_warns():
    wall, loads, exact = pulled(0.5)
    run = dem.simulate(wall, dem.Settle(), loads=loads)
    (note,) = (n for n in run.warnings if "joints slid" in n)
    assert "gently=" in note
    assert np.linalg.norm(run.shift[-1, 1, :2]) > 1.5 * np.linalg.norm(exact[:2])


@pytest.mark.parametrize("damping", [dem.Damping(local=0.8), dem.Damping(local=0.5, combined=True)])
@pytest.mark.parametrize("blocks", ["rigid", "simply deformable"])
def test_damped_motion_is_the_same_in_all_axes(damping, blocks):
    # of a square block: shapes along either side have one stiffness
    wall, loads, _ = pulled(0.5)
    wall = wall.with_material(lm.Material(young_modulus=1e9, poisson_ratio=0.2), blocks=[wall.blocks[1].name])
    places = []
    for turn in (np.eye(3), *Rotation.random(3, random_state=0).as_matrix()):
        seen = lm.Loads(np.hstack([loads.dead[:, :3] @ turn.T, loads.dead[:, 3:] @ turn.T]), loads.live)
        run = dem.simulate(
            wall.transformed(turn), dem.Hold(steps=400), loads=seen, damping=damping, contact_points=(4, 4), sample=50,
            blocks=blocks,
        )
        places.append(run.shift[:, 1] @ turn)
    assert places == pytest.approx(np.broadcast_to(places[0], (4, 8, 3)), abs=1e-6 * np.abs(places[0]).max())


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_a_push_begins_where_statics_has_what_sticks(angle):
    # on loads that act at once the block has slid by half as much again or more
    wall, loads, exact = pulled(angle)
    curve = dem.push(wall, dem.Drive({1: {"z": -1.0}}), to=1e-7, loads=loads, steps=400, rate_check=False)
    assert curve.states[0][0][1] == pytest.approx(exact, rel=1e-3, abs=1e-5 * np.abs(exact).max())


def test_what_goes_on_after_its_ramp_is_told():
    # a block that breaks loose slides on as its loads stop: here at the limit, where it stops nowhere
    wall, _, _ = pulled(0.0)
    stages = [dem.Settle(), dem.Ramp(to=0.5001, steps=2000), dem.Settle(max_steps=2000)]
    run = dem.simulate(wall, stages, loads=lm.Loads.horizontal(wall))
    assert any("after the ramp had ended" in note for note in run.warnings)
    stages[1:] = [dem.Ramp(to=0.3, steps=2000), dem.Settle()]
    assert not dem.simulate(wall, stages, loads=lm.Loads.horizontal(wall)).warnings


@pytest.mark.slow
def test_a_block_that_has_fallen_ends_the_wait_for_rest():
    # it fell on, with a search for contacts at every step, to the last of 50,000 steps
    solids = [box((0.0, 0.0, -0.1), (0.2, 0.2, 0.0)), box((0.15, 0.0, 0.0), (0.45, 0.2, 0.2))]
    wall = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0), fixed=[0])
    run = dem.simulate(wall, dem.Settle())
    assert run.status == "not settled"
    assert any("has fallen by" in note for note in run.warnings)
    assert run["step"][-1] < 25_000


def test_weight_at_once_that_moves_an_answer_by_two_per_cent_is_told():
    # joints slid by 1 % of the largest displacement as weight came to rest; after the live load it was off by 2.5 %
    model = ENGINES["dem simulate"].model(3, 65)
    wall, loads = model.build()
    to = PART * Statics(model).limit()
    once, gently = (
        dem.simulate(wall, [dem.Settle(gently=n), dem.Ramp(to=to, steps=4000), dem.Settle()], loads=loads)
        for n in (0, 8000)
    )
    assert np.abs(once.shift[-1] - gently.shift[-1]).max() > 0.02 * np.abs(gently.shift[-1]).max()
    assert any("slid" in note for note in once.warnings)
    assert not any("slid" in note for note in gently.warnings)


def test_what_does_not_slide_needs_no_word():
    wall = on_slab([((-0.15, -0.15, 0.0), (0.15, 0.15, 0.2))], mu=0.5)
    assert not any("slid" in note for note in dem.simulate(wall, dem.Settle()).warnings)


def test_loads_that_act_already_cannot_come_on_gently():
    wall, loads, _ = pulled(0.0)
    with pytest.raises(InputError, match=r"stage 1 \(Settle\): loads act already"):
        dem.simulate(wall, [dem.Hold(steps=10), dem.Settle(gently=100)], loads=loads)
    with pytest.raises(InputError, match="gently"):
        dem.Settle(gently=60_000)
    with pytest.raises(InputError, match="gently"):
        dem.Settle(gently=-1)
    run = dem.simulate(wall, dem.Hold(steps=10), loads=loads)
    with pytest.raises(InputError, match="act already"):
        dem.simulate(wall, dem.Settle(gently=100), start=run)


def test_a_run_cut_off_while_loads_come_on_goes_on_to_the_same_bits(tmp_path):
    wall, loads, _ = pulled(0.5)
    stage = dem.Settle(gently=2000)
    whole = dem.simulate(wall, stage, loads=loads)
    calls = []

    def stop(sample):
        calls.append(sample)
        return len(calls) == 3

    cut = dem.simulate(wall, stage, loads=loads, progress=stop)
    assert cut.status == "interrupted"
    cut.save(tmp_path / "cut.npz")
    again = dem.resume(dem.History.load(tmp_path / "cut.npz", wall), stage)
    assert (again.shift == whole.shift).all()
    assert (again.reaction == whole.reaction).all()
