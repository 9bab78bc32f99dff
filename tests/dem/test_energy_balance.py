"""Every loss of a step is booked: energy balances to second order in the step, or exactly, against closed forms."""

import numpy as np
import pytest
from joint_points import along
from poses import place
from walls import on_slab

import dem
import limitmason as lm
from limitmason.geometry import box

DRY = lm.Joint(30.0, normal_stiffness=1e8, shear_stiffness=5e7)
MU = np.tan(np.radians(30.0))


def balance(h):
    """Energy missing at whole steps [J].

    What moves blocks is known half a step before and after the positions. Joints lose between them: up to the position
    of a sample that is in the next one.
    """
    now = h["elastic"][:-1] + h["friction"][1:] + h["fracture"][1:] + h["viscous"][1:]
    blocks = h["kinetic"] + h["damping"] - h["applied"] - h["support"]
    return now + 0.5 * (blocks[1:] + blocks[:-1])


def thrown(dt, height=0.0, velocity=(0.3, 0.0, 0.0), spin=(0.0, 0.0, 0.0), duration=0.06, dashpot=0.0, **hold):
    """A block over a slab, with a velocity, sampled at every step; its weight."""
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.1))], joint=DRY)
    options = dem.JointOptions(dashpot=dashpot)
    state = dem.initial_state(
        b, lm.Loads.weight(b), mode="dynamic", contact_points=(3, 3), joint_options=options, dt=dt
    )
    place(state, b, 1, np.eye(3), b.centroids[1] + (0, 0, height), velocity, spin)
    h = dem.simulate(
        b, dem.Hold(duration=duration, **hold), loads=lm.Loads.weight(b), start=state, detect_every=None, sample=1
    )
    return h, b.weights[1]


def worst(h):
    """Largest energy missing since the first step [J]."""
    return np.abs(balance(h)[2:] - balance(h)[2]).max()


def test_friction_takes_mu_n_times_the_way_of_a_block_that_slides_to_rest():
    # sunk in under its weight; friction tilts it forward, it rocks, and N swings a little about the weight
    sunk = 2000.0 * 0.1 * 9.81 / 1e8
    errors = []
    for dt in (8e-5, 2e-5):
        h, weight = thrown(dt, -sunk, duration=0.05)
        errors.append(worst(h) / (0.5 * weight / 9.81 * 0.3**2))
        slip = np.hypot(h.state.points.slip_1, h.state.points.slip_2).mean()
        assert slip == pytest.approx(h.shift[-1, 1, 0], rel=1e-2)
        assert h["friction"][-1] == pytest.approx(MU * weight * slip, rel=1e-2)
    assert errors[0] < 2e-4
    assert errors[1] < errors[0] / 10.0


@pytest.mark.slow
@pytest.mark.parametrize("first, peak", [(0, 0.2), (1, 0.2), (0, 0.4)])
def test_friction_takes_mu_n_times_the_way_where_contacts_are_found_anew(first, peak):
    # the block slides down a slope of 30 degrees by twice its length, over joints that are cut anew on the way;
    # dashpots had 10.2 J of the 16.3 J that friction takes, and 0.3 J were missing
    slope, mu = np.radians(30.0), 0.2
    turn = np.array([[np.cos(slope), 0, np.sin(slope)], [0, 1, 0], [-np.sin(slope), 0, np.cos(slope)]])
    upright = box((-3, -1, -0.2), (3, 1, 0)), box((-0.15, -0.1, 0), (0.15, 0.1, 0.2))
    solids = [(x @ turn.T, faces) for x, faces in upright]
    # a joint with a higher peak has lost it before
    rest = None if peak == mu else np.degrees(np.arctan(mu))
    joint = lm.Joint.from_friction_coefficient(
        peak, residual_friction_angle_deg=rest, normal_stiffness=1e9, shear_stiffness=5e8
    )
    made = lm.Assembly.from_polyhedra(solids[:: 1 - 2 * first], joint=joint, fixed=[first])
    state = dem.initial_state(made, lm.Loads.weight(made), mode="dynamic", contact_points=(2, 2))
    state.points.damage[:] = peak > mu
    h = dem.simulate(made, dem.Hold(duration=0.5), start=state, mode="dynamic", sample=0.02)
    assert (h.state.interface < 0).all()
    weight = made.weights[1 - first]
    way = 0.5 * 9.81 * (np.sin(slope) - mu * np.cos(slope)) * h["time"] ** 2
    assert h.displacement_of(1 - first) @ turn[:, 0] == pytest.approx(way, rel=1e-3, abs=3e-5)
    assert h["friction"] == pytest.approx(mu * weight * np.cos(slope) * way, rel=1e-3, abs=2.5e-2)
    assert h["viscous"].max() < 1e-3 * h["friction"][-1]
    assert np.abs(h.energy_error).max() < 5e-4 * h["applied"][-1]


def test_a_smooth_block_slides_down_a_slope_as_if_it_fell_and_loses_nothing():
    """s = g sin(a) t^2 / 2 without friction (Galileo's incline); its weight's work is all kinetic."""
    slope = np.radians(30.0)
    turn = np.array([[np.cos(slope), 0, np.sin(slope)], [0, 1, 0], [-np.sin(slope), 0, np.cos(slope)]])
    smooth = lm.Joint(0.0, normal_stiffness=1e8, shear_stiffness=5e7)
    solids = [box((-5, -5, -0.2), (5, 5, 0)), box((0, 0, 0), (0.4, 0.4, 0.1))]
    made = lm.Assembly.from_polyhedra(solids, joint=smooth, fixed=[0]).transformed(turn)
    h = dem.simulate(made, dem.Hold(duration=0.3), mode="dynamic", sample=0.05)
    way = 0.5 * 9.81 * np.sin(slope) * h["time"] ** 2
    assert h.displacement_of(1) @ turn[:, 0] == pytest.approx(way, rel=1e-3, abs=1e-4)
    # joints were cut anew on the way: friction and dashpots then took a third of the work
    assert max(h["friction"].max(), h["viscous"].max()) < 1e-3 * h["applied"][-1]
    assert np.abs(h.energy_error).max() < 1e-3 * h["applied"][-1]


@pytest.mark.parametrize("copy", ["as it is", "renumbered", "turned", "mirrored"])
@pytest.mark.parametrize("angle", [20.0, 35.0])
def test_a_block_on_a_slope_stays_below_its_friction_and_slides_by_coulombs_law_above(angle, copy):
    """s = g (sin(a) - mu cos(a)) t^2 / 2 where tan(a) > mu, else it only sinks into its springs."""
    slope, mu = np.radians(angle), 0.4
    place = np.array([[np.cos(slope), 0, np.sin(slope)], [0, 1, 0], [-np.sin(slope), 0, np.cos(slope)]])
    about = {"turned": [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]], "mirrored": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]}
    place = np.array(about.get(copy, np.eye(3)), dtype=float) @ place
    joint = lm.Joint.from_friction_coefficient(mu, normal_stiffness=1e9, shear_stiffness=5e8)
    solids = [box((-5, -5, -0.2), (5, 5, 0)), box((0, 0, 0), (0.4, 0.4, 0.1))]
    made = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0]).transformed(place)
    made = made.renumbered([1, 0]) if copy == "renumbered" else made
    h = dem.simulate(made, dem.Hold(duration=0.2), mode="dynamic", sample=0.05)
    way = 0.5 * 9.81 * max(np.sin(slope) - mu * np.cos(slope), 0.0) * h["time"] ** 2
    assert h.displacement_of("block-1") @ place[:, 0] == pytest.approx(way, rel=1e-3, abs=5e-5)


def test_what_is_kinetic_before_the_first_step_is_no_energy_from_nowhere():
    flight, weight = thrown(1e-4, 1.0, (1.0, -2.0, 3.0), duration=0.01)
    put = 0.5 * weight / 9.81 * 14.0
    assert np.abs(flight.energy_error).max() < 1e-12 * put
    on = dem.simulate(flight.assembly, dem.Hold(duration=0.01), start=flight, detect_every=None, sample=1)
    assert np.abs(on.energy_error).max() < 1e-12 * put
    bounce, _ = thrown(2e-5, 0.002, (0.0, 0.0, -0.2), duration=0.03)
    # thrown down from 2 mm onto a spring: what it stores is what was kinetic and what it fell and sank through
    put, spring = weight * (0.04 / 19.62 + 0.002), 1e8 * 0.09
    stored = put + weight * (weight + np.sqrt(weight**2 + 2.0 * spring * put)) / spring
    assert (bounce["elastic"].max(), bounce["elastic"][-1]) == (pytest.approx(stored, rel=5e-3), 0.0)
    assert abs(bounce.energy_error[-1]) < 1e-3 * stored


def test_dashpots_brake_nothing_of_a_block_that_coasts_however_long_its_steps_are():
    # the last steps of each stage are shortened to end with it, down to half
    smooth = on_slab([((0, 0, 0), (0.3, 0.3, 0.1))], joint=lm.Joint(0.0, normal_stiffness=1e8, shear_stiffness=5e7))
    state = dem.initial_state(smooth, lm.Loads.weight(smooth), mode="dynamic", contact_points=(3, 3))
    place(state, smooth, 1, np.eye(3), smooth.centroids[1] - (0, 0, 2000.0 * 0.1 * 9.81 / 1e8), (0.3, 0, 0), (0, 0, 0))
    stages = [dem.Hold(duration=d * state.dt) for d in (10.0, 3.5, 2.01, 4.0, 1.000001)]
    h = dem.simulate(smooth, stages, loads=lm.Loads.weight(smooth), start=state, detect_every=None, sample=1)
    moving = 0.5 * smooth.weights[1] / 9.81 * 0.3**2
    assert h["kinetic"][-1] == pytest.approx(moving, rel=1e-9)
    # what the unloaded springs of the beginning take is over within the first stage, of ten steps
    assert h["viscous"][-1] - h["viscous"][10] < 1e-9 * moving
    assert np.ptp(h.energy_error[10:]) < 1e-9 * moving


@pytest.mark.parametrize("velocity", [(0.0, 0.0, -0.2), (0.5, 0.2, -0.2)])
def test_what_a_block_that_bounces_gains_or_loses_fades_with_the_square_of_the_step(velocity):
    errors = []
    for dt in (8e-5, 2e-5):
        h, weight = thrown(dt, 0.002, velocity, (0.2, 0.3, 0.1), 0.03)
        assert (h["elastic"] > 0.0).any()
        assert h["elastic"][-1] < 0.1 * h["elastic"].max()
        put = 0.5 * weight / 9.81 * np.dot(velocity, velocity)
        errors.append(worst(h) / put)
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 6.0


def test_local_and_global_damping_take_what_a_block_that_rocks_loses():
    for damping in (dem.Damping(local=0.3), dem.Damping(adaptive=0.5)):
        errors = []
        for dt in (8e-5, 2e-5):
            h, _ = thrown(dt, -1e-5, (0.0, 0.0, 0.0), (0.01, 0.02, 0.0), 0.004, damping=damping)
            assert h["damping"][-1] > 0.5 * h["kinetic"].max()
            errors.append(worst(h) / h["damping"][-1])
        assert errors[0] < 2e-2
        assert errors[1] < errors[0] / 10.0


@pytest.mark.parametrize("dashpot", [0.0, None])
def test_eight_dry_bricks_that_are_shaken_lose_what_is_booked(dashpot):
    solids = [box((-1, -1, -0.2), (1, 1, 0))]
    for course in range(4):
        for x in (0.06 * (course % 2), 0.12 + 0.06 * (course % 2)):
            solids.append(box((x - 0.06, -0.05, 0.06 * course), (x + 0.06, 0.05, 0.06 * (course + 1))))
    a = lm.Assembly.from_polyhedra(solids, joint=DRY, fixed=[0])
    t = np.arange(0, 1.0, 0.01)
    ground = np.column_stack([9 * np.sin(14 * t), 4 * np.sin(19 * t), 0 * t])
    shaking = dem.BaseMotion(tuple(map(tuple, ground.tolist())), 0.01, after="coast")
    options, errors = dem.JointOptions(dashpot=dashpot), []
    for part in (1.0, 0.25):
        state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", contact_points=(3, 3), joint_options=options)
        state.dt *= part
        h = dem.simulate(a, shaking, start=state, detect_every=None, sample=50)
        assert h["friction"][-1] > 10.0
        errors.append(np.abs(h.energy_error).max() / h["support"][-1])
    # friction at its new strength alone left 7 % at the default step and 2 % at a quarter of it; what is left here is
    # half a step between motion and places, which does not add up
    assert errors[0] < 4e-3
    assert errors[1] < 1e-3


def work_on(path, opening, slip):
    """Work done on a point up to every place of its path, by the mean of both ends of a step [J/m2]."""
    steps = 0.5 * (path.normal[1:] + path.normal[:-1]) * np.diff(opening)
    return np.r_[0.0, -np.cumsum(steps + 0.5 * (path.shear[1:] + path.shear[:-1]) * np.diff(slip))]


def test_fracture_takes_the_work_of_few_steps_and_of_many_the_fracture_energies():
    joint = lm.Joint(
        30.0, cohesion=2e5, tensile_strength=1e5, normal_stiffness=1e9, shear_stiffness=5e8, residual_cohesion=0.0,
        residual_tensile_strength=0.0, fracture_energy_tension=40.0, fracture_energy_shear=150.0,
    )
    for steps in (41, 401):
        opening, slip, none = np.linspace(0.0, 2e-3, steps), np.linspace(0.0, 4e-3, steps), np.zeros(steps)
        pulled, slid = along(joint, opening=opening), along(joint, opening=none, slip=slip)
        assert pulled.broken[-1] == pytest.approx(work_on(pulled, opening, none)[-1], rel=1e-9)
        assert slid.broken[-1] + slid.rubbed[-1] == pytest.approx(work_on(slid, none, slip)[-1], rel=1e-9)
        # the law itself is of first order: damage is that of the strength before the step
        assert pulled.broken[-1] == pytest.approx(40.0, rel=1.0 / steps)
        assert slid.broken[-1] + slid.rubbed[-1] == pytest.approx(150.0, rel=1.0 / steps)


def test_work_on_a_point_is_what_it_stores_and_loses_on_any_path():
    rng = np.random.default_rng(4)
    for cohesion in (0.0, 1e4):
        joint = lm.Joint(30.0, cohesion=cohesion, normal_stiffness=1e8, shear_stiffness=5e7)
        slip = np.cumsum(rng.normal(size=400)) * 1e-4
        opening = -2e-4 + 1e-4 * np.cos(np.cumsum(rng.normal(size=400)))
        path = along(joint, opening=opening, slip=slip)
        stored = 0.5 * (path.normal**2 / 1e8 + path.shear**2 / 5e7)
        lost = work_on(path, opening, slip) - (stored - stored[0])
        assert path.rubbed[-1] > 1.0
        assert path.rubbed == pytest.approx(lost, abs=1e-9 * path.rubbed[-1])


def test_crushing_takes_the_strength_times_the_closing():
    joint = lm.Joint(30.0, compressive_strength=1e6, normal_stiffness=1e9, shear_stiffness=5e8)
    path = along(joint, opening=-np.linspace(0.0, 5e-3, 11))
    assert path.rubbed[-1] == pytest.approx(1e6 * (5e-3 - 1e-3), rel=1e-9)


def test_what_holds_a_block_works_to_the_end_of_its_drive_and_no_energy_comes_from_nowhere():
    """Stretched by u in n steps springs store K u^2 / 2; a tenth of it was missing from the work of ten steps."""
    joint = lm.Joint(30.0, cohesion=1e9, tensile_strength=1e9, normal_stiffness=1e8, shear_stiffness=5e7)
    b = on_slab([((0, 0, 0), (0.4, 0.4, 0.2))], joint=joint)
    along, still = {"x": 1e-4}, dict.fromkeys(("y", "z", "rx", "ry", "rz"), 0.0)
    none = lm.Loads(np.zeros((2, 6)), np.zeros((2, 6)))
    stages = [dem.Drive({"block-1": along | still}, steps=10, keep=True), dem.Hold(steps=3)]
    h = dem.simulate(b, stages, loads=none, contact_points=(3, 3), sample=1)
    stored = 0.5 * 5e7 * 0.16 * 1e-4**2
    assert h["elastic"][-1] == pytest.approx(stored, rel=1e-12)
    assert h["support"][-1] == pytest.approx(stored, rel=1e-12)
    assert abs(h.energy_error[-1]) < 1e-12 * stored
