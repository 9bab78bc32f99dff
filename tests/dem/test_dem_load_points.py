"""Points of application in the DEM: moments and work of forces whose points turn with their blocks."""

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.kernels import E_APPLIED
from dem.model.advance import run_constant
from limitmason.geometry import box
from limitmason.geometry.rotation import rotation_matrices

WIDTH, DEPTH, HEIGHT = 0.4, 0.3, 1.0


def block(stiffness):
    solids = [box((-1, 0, -0.2), (2, DEPTH, 0)), box((0, 0, 0), (WIDTH, DEPTH, HEIGHT))]
    joint = lm.Joint(60.0, normal_stiffness=stiffness, shear_stiffness=stiffness)
    return lm.Assembly.from_polyhedra(solids, names=["ground", "block"], joint=joint, density=2000.0, fixed=[0])


@pytest.mark.exact
def test_a_block_in_flight_turns_about_the_point_of_its_load():
    """M = R r x f at any turn, and the work done is f . dx of the point, to second order of the step."""
    wall = block(1e9)
    force, at = np.array((3e2, -2e2, 5e2)), np.array((0.1, 0.25, 0.9))
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, force, at=at, case="dead")
    arm, errors = at - wall.centroids[1], []
    for dt in (2e-4, 1e-4):
        state = dem.initial_state(wall, loads, mode="dynamic", dt=dt, joint_options=dem.JointOptions(dashpot=0.0))
        state.bodies.shift[1, 2] = 3.0
        state.bodies.quat[1] = np.cos(0.6), *(np.sin(0.6) * np.array((0.6, 0.0, 0.8)))
        state.bodies.rot[1] = rotation_matrices(1.2 * np.array((0.6, 0.0, 0.8))) - np.eye(3)
        state.bodies.ang[1] = np.linalg.solve(state.bodies.inv_inertia[1], (0.0, 8.0, 0.0))
        run_constant(state, loads.rows("dead"), 1, dem.Damping())
        begun = state.bodies.shift[1] + state.bodies.rot[1] @ arm, state.bodies.shift[1].copy()
        work = state.total[E_APPLIED]
        turned = (state.bodies.rot[1] + np.eye(3)) @ arm
        run_constant(state, loads.rows("dead"), 1, dem.Damping())
        assert state.bodies.net[1, 3:] == pytest.approx(np.cross(turned, force), rel=1e-9)
        run_constant(state, loads.rows("dead"), round(0.2 / dt), dem.Damping())
        way = state.bodies.shift[1] + state.bodies.rot[1] @ arm - begun[0]
        fallen = (state.bodies.shift[1] - begun[1])[2]
        assert np.linalg.norm(state.bodies.rot[1]) > 0.5
        errors.append(abs(state.total[E_APPLIED] - work - force @ way + wall.weights[1] * fallen))
    assert errors[0] < 2e-3 * abs(force @ way)
    assert errors[1] < 0.7 * errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("height", [HEIGHT, 0.2])
def test_a_push_of_a_loaded_block_is_the_path_of_its_capacity_curve(height):
    """Rocking under 2 W on its top and near its foot: 930 and 2040 N at 8 cm, to a share of the swings of a push."""
    wall = block(1e8)
    weight = wall.weights[1]
    at = (0.5 * WIDTH, 0.5 * DEPTH, height)
    dead = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -2.0 * weight), at=at, case="dead")
    drive = dem.Drive({"block": {"x": 1.0}}, damping=dem.Damping(local=0.8))
    pushed = dem.push(wall, drive, to=0.08, loads=dead, contact_points=(4, 2), rate_check=False, steps=12000)
    live = dead.with_point_load(wall, 1, (weight, 0.0, 0.0))
    curve = lm.pushover(wall, live, control=("block", "x"), to=0.08, contact_model="grid", grid=(4, 2))
    places = np.linspace(0.02, 0.08, 7)
    exact = weight * np.interp(places, curve.displacement, curve.load)
    assert np.interp(places, pushed.displacement, pushed.load) == pytest.approx(exact, rel=0.02)


@pytest.mark.exact
def test_a_run_goes_on_under_the_same_points_only(tmp_path):
    wall = block(1e9)
    high, low = (
        lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -1e3), at=(0.2, 0.15, z), case="dead") for z in (1.0, 0.5)
    )
    run = dem.simulate(wall, dem.Hold(steps=20), loads=high)
    run.save(tmp_path / "run.npz")
    again = dem.History.load(tmp_path / "run.npz", wall)
    assert np.array_equal(again.state.loads.dead_arms, high.dead_arms)
    with pytest.raises(lm.errors.InputError, match="'block' acts at another point"):
        dem.simulate(wall, dem.Hold(steps=20), loads=low, start=again)
