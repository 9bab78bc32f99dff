"""Stages of loading, histories, interruption, large displacement and bad states of the DEM."""

import dataclasses
import itertools
import re

import numpy as np
import pytest
from walls import on_slab, running_bond, stack

import dem
import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box

GRAVITY = 9.81
UNDAMPED = dem.JointOptions(dashpot=0.0)


def block_on_floor(size=(0.2, 0.3, 0.8), floor=3.0, lift=0.0, joint=None, **options):
    joint = joint or lm.Joint(35.0, normal_stiffness=1e8)
    solids = [box((-floor, -floor, -0.1), (floor, floor, 0.0)), box((0, 0, 0), size)]
    return lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0], **options)


def test_tilting_a_block_reads_tan_phi_at_the_supports():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.4)
    h = dem.simulate(b, [dem.Settle(), dem.Tilt(to_deg=30.0, steps=40_000, stop_when_moved=2e-3)])
    assert h.support_multiplier.max() == pytest.approx(0.4, rel=5e-3)
    # single points at the lifting edge slip before; the whole face at tan(phi)
    slipping = np.flatnonzero(h["largest slip"] > 2e-6)[0]
    assert np.tan(h["tilt"][slipping - 1]) == pytest.approx(0.4, rel=0.02)
    assert h.kinetic_ratio[slipping - 1] < 1e-3


def test_how_far_a_block_has_moved_counts_from_the_ground():
    """On ground of acceleration a a block slips by (a - mu g) t^2 / 2 while the ground moves a t^2 / 2."""
    b = on_slab([((0, 0, 0), (0.8, 0.8, 0.2))], mu=0.2)
    ground = dem.BaseMotion((4.0,) * 200, 0.002, after="hold", stop_when_moved=0.02)
    h = dem.simulate(b, [dem.Settle(), ground], mode="dynamic", sample=5)
    slip = np.abs(h.displacement_of(1) - h.displacement_of(0))[:, 0]
    assert slip[-2] < 0.02 < slip[-1] < 0.022
    moved = h.displacement_of(0)[-1, 0]
    assert slip[-1] / moved == pytest.approx(1.0 - 0.2 * GRAVITY / 4.0, rel=0.02)


@pytest.mark.parametrize("axis, to", [((1.0, 0.0, 0.0), 10.0), ((1.0, 1.0, 0.0), 20.0), ((1.0, 0.0, 0.0), 0.0)])
def test_a_table_turned_about_a_second_axis_goes_there_evenly_by_the_shortest_way(axis, to):
    # the supports bear the weight turned: from 20 degrees about y on an arc to the end, in equal parts
    b = on_slab([((0, 0, 0), (0.4, 0.3, 0.1))], joint=lm.Joint(40.0, normal_stiffness=1e9, shear_stiffness=5e8))
    tilts = [dem.Tilt(to_deg=20.0, steps=2000), dem.Tilt(to_deg=to, steps=4000, axis=axis)]
    h = dem.simulate(b, [dem.Settle(), *tilts], sample=200)
    pull = h.reaction_of(0)[h["stage"] == 2.0, :3] / b.weights[1]
    begin, end = np.deg2rad(20.0), np.deg2rad(to)
    first = np.array([-np.sin(begin), 0.0, np.cos(begin)])
    d = np.cross(axis, (0.0, 0.0, 1.0)) / np.linalg.norm(axis)
    last = np.cos(end) * np.array([0.0, 0.0, 1.0]) - np.sin(end) * d
    way = np.arccos(first @ last)
    turned = np.arccos(np.clip(pull @ first / np.linalg.norm(pull, axis=1), -1.0, 1.0))
    assert turned == pytest.approx(way * np.arange(1, 21) / 20.0, abs=2e-3)
    assert pull[-1] == pytest.approx(last, abs=1e-3)
    assert np.abs(pull @ np.cross(first, last)).max() < 1e-3


def test_half_the_weight_that_acts_turns_as_half_the_weight():
    b = on_slab([((0, 0, 0), (0.4, 0.3, 0.1))], joint=lm.Joint(40.0, normal_stiffness=1e9, shear_stiffness=5e8))
    tilts = [dem.Tilt(to_deg=20.0, steps=500), dem.Tilt(to_deg=10.0, steps=500, axis=(1.0, 0.0, 0.0))]
    h = dem.simulate(b, tilts, factors=(1.0, 0.5, 0.0, 0.0, 0.0), sample=500)
    end = np.deg2rad(10.0)
    assert h.factors == pytest.approx((1.0, 0.5 * np.cos(end), 0.0, 0.0, -0.5 * np.sin(end)), abs=1e-12)


def test_a_driven_block_is_dragged_with_its_weight_times_friction():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.4)
    h = dem.simulate(b, [dem.Settle(), dem.Drive(displacement={1: {"x": 1e-3}}, steps=5000)])
    curve = h.curve(1)
    displacement, force = curve
    assert (curve.status, curve.label, curve.source) == ("finished", "block-1", "dem")
    # the work of the curve is that of the drive, but for the sampling of the rise
    assert curve.work[-1] == pytest.approx(h["support"][-1], rel=0.02)
    assert np.abs(curve.errors["energy"]).max() < 1e-3
    assert displacement[-1] == pytest.approx(1e-3, rel=1e-9)
    assert force[-1] == pytest.approx(0.4 * b.weights[1], rel=1e-4)
    # all the work of the drive goes into friction
    assert h["support"][-1] == pytest.approx(h["friction"][-1], rel=5e-3)
    assert np.abs(h.energy_error).max() < 1e-3 * (np.abs(h["applied"]) + np.abs(h["support"])).max()


def test_dilatant_drag_lifts_the_block_by_tan_psi_until_the_limiting_slip():
    joint = lm.Joint.from_friction_coefficient(0.6, dilatancy_angle_deg=10.0)
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], joint=joint)
    h = dem.simulate(
        b, [dem.Settle(), dem.Drive(displacement={1: {"x": 2e-3}}, steps=20_000)],
        joint_options=dem.JointOptions(dilatant_slip=1e-3),
    )
    travel, lift = h.displacement_of(1)[:, 0], h.displacement_of(1)[:, 2]
    slope = np.tan(np.deg2rad(10.0))
    assert np.interp(0.5e-3, travel, lift) == pytest.approx(0.5e-3 * slope, rel=5e-3)
    assert lift[-1] == pytest.approx(1e-3 * slope, rel=5e-3)


def test_linear_softening_drag_falls_to_the_residual_friction():
    joint = lm.Joint(40.0, residual_friction_angle_deg=20.0, normal_stiffness=1e10)
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], joint=joint)
    h = dem.simulate(
        b, [dem.Settle(), dem.Drive(displacement={1: {"x": 2e-3}}, steps=20_000)],
        joint_options=dem.JointOptions(softening_slip=1e-3), sample=50,
    )
    travel, force = h.curve(1)
    ratio = force / b.weights[1]
    high, low = np.tan(np.deg2rad(40.0)), np.tan(np.deg2rad(20.0))
    assert ratio.max() == pytest.approx(high, rel=0.01)
    assert np.interp(0.5e-3, travel, ratio) == pytest.approx(0.5 * (high + low), rel=0.01)
    assert ratio[-1] == pytest.approx(low, rel=1e-3)


def test_joints_may_have_their_own_laws():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2)), ((0.5, 0, 0), (0.8, 0.3, 0.2))], mu=0.4)
    b = b.with_joints({("block-0", "block-2"): lm.Joint.from_friction_coefficient(0.2)})
    h = dem.simulate(b, [dem.Settle(), dem.Drive(displacement={1: {"x": 1e-3}, 2: {"x": 1e-3}}, steps=4000)])
    assert h.curve(1).load[-1] == pytest.approx(0.4 * b.weights[1], rel=1e-3)
    assert h.curve(2).load[-1] == pytest.approx(0.2 * b.weights[2], rel=1e-3)


def test_pressure_and_point_loads_reach_the_supports():
    b = stack([(0.3, 0.2)] * 2, mu=0.6)
    loads = lm.Loads.weight(b).with_pressure(b, 2, pressure=5e3).with_point_load(b, 1, (50.0, 20.0, 0.0), case="dead")
    h = dem.simulate(b, dem.Settle(), loads=loads)
    reaction = h.reaction_of(0)[-1, :3]
    assert h.status == "finished"
    assert reaction == pytest.approx((-50.0, -20.0, b.weights[1:].sum() + 5e3 * 0.3), rel=1e-4)


def test_quarter_period_of_free_rocking_approaches_housner_as_the_joint_stiffens():
    # Housner 1963: T/4 = arccosh(1 / (1 - theta0 / alpha)) / p, p^2 = 3 g / (4 R)
    b, height, r = 0.2, 0.8, np.hypot(0.1, 0.4)
    alpha, p = np.arctan(b / height), np.sqrt(3.0 * GRAVITY / (4.0 * r))
    start = 0.3 * alpha
    exact = np.arccosh(1.0 / (1.0 - start / alpha)) / p
    errors = []
    for stiffness in (1e7, 1e8, 1e9):
        a = block_on_floor(joint=lm.Joint(60.0, normal_stiffness=stiffness))
        state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", contact_points=(2, 2), joint_options=UNDAMPED)
        # turned about its right foot, released from rest
        q = np.array([np.cos(start / 2), 0.0, np.sin(start / 2), 0.0])
        turn = np.array([[np.cos(start), 0, np.sin(start)], [0, 1, 0], [-np.sin(start), 0, np.cos(start)]])
        foot = np.array([b, 0.15, 0.0])
        state.bodies.quat[1] = q
        state.bodies.rot[1] = turn - np.eye(3)
        sunk = a.weights[1] / (stiffness * b * 0.3 / 2)  # the foot carries the weight on half the area
        state.bodies.shift[1] = foot + turn @ (a.centroids[1] - foot) - a.centroids[1] - (0.0, 0.0, sunk)
        h = dem.simulate(a, dem.Hold(duration=1.2 * exact), start=state, mode="dynamic", sample=1)
        angle = 2.0 * h.quaternion[:, 1, 2]
        hit = np.flatnonzero(angle <= 0.0)[0]
        errors.append(abs(h["time"][hit] / exact - 1.0))
    assert errors[0] > errors[2]
    assert errors[2] < 0.02


def test_a_load_on_the_top_of_a_leaning_block_leans_with_it():
    """theta'' = -(W arm(centroid) + P arm(top)) / I about the foot: at .03 rad 1.31 of W alone, not 4 times."""
    start, width, height = 0.03, 0.3, 0.9
    a = on_slab([((0, 0, 0), (width, width, height))], joint=lm.Joint(60.0, normal_stiffness=1e11))
    weight, mass = a.weights[1], a.arrays.mass[1]
    foot = np.array([width, 0.5 * width, 0.0])
    cos, sin = np.cos(start), np.sin(start)
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    for extra in (0.0, 3.0 * weight):
        top = (0.5 * width, 0.5 * width, height)
        loads = lm.Loads.weight(a).with_point_load(a, 1, (0.0, 0.0, -extra), at=top, case="dead")
        state = dem.initial_state(a, loads, mode="dynamic", contact_points=(2, 2), joint_options=UNDAMPED)
        state.bodies.quat[1] = np.cos(start / 2), 0.0, np.sin(start / 2), 0.0
        state.bodies.rot[1] = turn - np.eye(3)
        state.bodies.shift[1] = foot + turn @ (a.centroids[1] - foot) - a.centroids[1]
        h = dem.simulate(a, dem.Hold(duration=0.02), start=state)
        arms = [0.5 * width * cos - z * sin for z in (0.5 * height, height)]
        inertia = mass * (width**2 + height**2) / 3.0
        fall = 0.5 * (weight * arms[0] + extra * arms[1]) / inertia * 0.02**2
        assert start - h.rotation_of(1)[-1, 1] == pytest.approx(fall, rel=0.03)


def test_interrupting_keeps_a_usable_history_that_can_be_continued():
    wall = running_bond(2, 3, mu=0.6)
    loads = lm.Loads.horizontal(wall)
    calls = []

    def stop_at_third(sample):
        calls.append(sample["step"])
        return len(calls) == 3

    h = dem.simulate(wall, dem.Hold(steps=5000), loads=loads, progress=stop_at_third)
    assert h.status == "interrupted"
    assert len(h["time"]) == 3

    def keyboard(sample):
        raise KeyboardInterrupt

    again = dem.simulate(wall, dem.Hold(steps=5000), loads=loads, start=h, progress=keyboard)
    assert again.status == "interrupted"
    assert again.state.time == 800.0


def test_first_crack_is_found_where_a_tilted_wall_opens():
    wall = stack([(0.2, 0.2)] * 4, mu=0.7)
    h = dem.simulate(
        wall, [dem.Settle(), dem.Ramp(to=0.3, steps=20_000, stop_when_moved=0.01)], loads=lm.Loads.horizontal(wall)
    )
    sample, interface = h.first_crack(1e-4)
    # the stack turns about its foot
    assert wall.interfaces[interface].kind == "base"
    assert h["multiplier"][sample] > 0.2
    with pytest.raises(InputError, match="kind must be one of"):
        h.first_crack(1e-4, "bases")
    # joint 1 opens from 80 to 110 micrometres while joint 0 opens from none to 120: joint 1 is at 100 first
    opening = np.zeros_like(h.opening)
    opening[3, 1], opening[4:, :2] = 80e-6, (120e-6, 110e-6)
    assert dataclasses.replace(h, opening=opening).first_crack(1e-4) == (4, 1)


def test_a_toppled_block_falls_on_its_side_and_comes_to_rest():
    a = block_on_floor()
    loads = lm.Loads.weight(a)
    state = dem.initial_state(a, loads, mode="dynamic", joint_options=dem.JointOptions(dashpot=3e-4))
    spin = np.array([0.0, 1.2, 0.0])
    state.bodies.ang[1] = np.linalg.inv(state.bodies.inv_inertia[1]) @ spin
    state.bodies.vel[1] = np.cross(spin, a.centroids[1] - (0.2, 0.15, 0.0))
    h = dem.simulate(a, dem.Hold(duration=3.0), loads=loads, start=state, mode="dynamic", detect_every=50)
    place = a.centroids[1] + h.shift[-1, 1]
    turned = 2.0 * np.arcsin(np.linalg.norm(h.quaternion[-1, 1, 1:]))
    assert place[2] == pytest.approx(0.1, rel=2e-3)
    assert np.rad2deg(turned) == pytest.approx(90.0, abs=0.2)
    assert h["kinetic"][-1] < 1e-3
    # re-cut contacts exchange a little energy; what is lost must stay below a tenth of the fall
    fall = a.weights[1] * 0.3
    assert np.abs(h.energy_error).max() < 0.1 * fall


def test_a_dropped_block_lands_and_stays_on_a_floor_it_did_not_touch():
    solids = [box((-1, -1, -0.1), (1, 1, 0.0)), box((-1, -1, -0.3), (-0.8, 1, -0.1)), box((0, 0, 0), (0.3, 0.3, 0.2))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0, normal_stiffness=1e8), fixed=[0, 1])
    loads = lm.Loads.weight(a)
    state = dem.initial_state(a, loads, mode="dynamic", joint_options=dem.JointOptions(dashpot=1e-3))
    state.bodies.shift[2] = (0.2, 0.1, 0.25)
    h = dem.simulate(a, dem.Hold(duration=1.5), loads=loads, start=state, mode="dynamic", detect_every=20)
    assert h.shift[-1, 2] == pytest.approx((0.2, 0.1, 0.0), abs=1e-3)
    assert h["kinetic"][-1] < 1e-6


def test_two_blocks_that_collide_in_flight_keep_their_momentum():
    solids = [box((-1, -1, -0.1), (1, 1, 0.0)), box((0, 0, 0), (0.2, 0.2, 0.2)), box((0.2, 0, 0), (0.4, 0.2, 0.2))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0, normal_stiffness=1e8), fixed=[0])
    nothing = lm.Loads(np.zeros((3, 6)), np.zeros((3, 6)))
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=dem.JointOptions(dashpot=1e-4))
    state.bodies.shift[1], state.bodies.shift[2] = (-0.05, 0.03, 1.0), (0.05, 0.0, 1.02)
    state.bodies.vel[1], state.bodies.vel[2] = (1.0, 0.1, 0.0), (-0.5, 0.0, 0.0)
    mass = state.bodies.mass[1:]
    before = mass @ state.bodies.vel[1:]
    place = a.centroids + state.bodies.shift
    spin_before = np.cross(place[1:], mass[:, None] * state.bodies.vel[1:]).sum(axis=0)
    h = dem.simulate(a, dem.Hold(duration=0.3), loads=nothing, start=state, mode="dynamic", detect_every=20)
    end = h.state.bodies
    assert end.vel[1, 0] < 0.9  # they met
    assert mass @ end.vel[1:] == pytest.approx(before, abs=1e-10)
    place = a.centroids + end.shift
    spin = np.cross(place[1:], mass[:, None] * end.vel[1:]).sum(axis=0) + end.ang[1:].sum(axis=0)
    # the angular momentum of the velocities at the half step is exact about moving points up to one step
    assert np.abs(spin - spin_before).max() < 1e-3 * np.abs(spin_before).max()


def test_a_time_step_above_the_stable_one_is_refused_and_an_explosion_is_caught():
    # glued down: a joint that may open lets the block bounce off into free flight, where no step is too long
    a = block_on_floor(joint=lm.Joint(35.0, normal_stiffness=1e8, cohesion=1e15, tensile_strength=1e15))
    with pytest.raises(ValueError, match="stable time step"):
        dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", dt=0.1)
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic")
    state.dt *= 5.0
    with pytest.raises(dem.UnstableError) as caught:
        dem.simulate(a, dem.Hold(steps=20_000), start=state, mode="dynamic")
    assert caught.value.history is not None
    # slower, so that there are samples before: that of the explosion is not kept behind them
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic")
    state.dt *= 2.5
    with pytest.raises(dem.UnstableError, match="energy explodes") as caught:
        dem.simulate(a, dem.Hold(steps=4000), start=state, mode="dynamic", sample=2)
    kinetic = caught.value.history["kinetic"]
    assert len(kinetic) > 5
    assert float(re.search(r"kinetic ([\d.e+]+) J", str(caught.value))[1]) > 2.0 * kinetic.max()


def test_not_finite_states_name_the_block():
    a = block_on_floor()
    state = dem.initial_state(a, lm.Loads.weight(a))
    state.bodies.vel[1, 0] = np.nan
    with pytest.raises(dem.UnstableError, match="block number 1"):
        dem.simulate(a, dem.Hold(steps=10), start=state)


def test_bad_input_is_named():
    a = block_on_floor()
    with pytest.raises(ValueError, match="mode"):
        dem.simulate(a, dem.Hold(steps=1), mode="static")
    with pytest.raises(ValueError, match="either steps or duration"):
        dem.simulate(a, dem.Hold())
    light = block_on_floor(density=0.0)
    with pytest.raises(ValueError, match="no mass"):
        dem.initial_state(light, lm.Loads.weight(light), mode="dynamic")
    with pytest.raises(ValueError, match="unknown degree of freedom"):
        dem.simulate(a, dem.Drive(displacement={1: {"u": 1.0}}, steps=10))
    with pytest.raises(ValueError, match="nothing to multiply"):
        dem.collapse(a, lm.Loads.weight(a))


def free_rocking(stiffness, dashpot, start, duration):
    """Rotation of a slender block released from a turn about its right foot, against time."""
    a = block_on_floor(joint=lm.Joint(60.0, normal_stiffness=stiffness))
    options = dem.JointOptions(dashpot=dashpot)
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", contact_points=(2, 2), joint_options=options)
    turn = np.array([[np.cos(start), 0, np.sin(start)], [0, 1, 0], [-np.sin(start), 0, np.cos(start)]])
    foot = np.array([0.2, 0.15, 0.0])
    state.bodies.quat[1] = (np.cos(start / 2), 0.0, np.sin(start / 2), 0.0)
    state.bodies.rot[1] = turn - np.eye(3)
    sunk = a.weights[1] / (stiffness * 0.2 * 0.3 / 2)  # the foot carries the weight on half the area
    state.bodies.shift[1] = foot + turn @ (a.centroids[1] - foot) - a.centroids[1] - (0.0, 0.0, sunk)
    h = dem.simulate(a, dem.Hold(duration=duration), start=state, mode="dynamic", sample=5)
    return h["time"], 2.0 * h.quaternion[:, 1, 2]


@pytest.mark.slow
def test_inelastic_dashpots_give_housners_restitution():
    # Housner 1963: ratio of the rocking speeds after and before an impact, 1 - 3/2 sin^2(alpha), for inelastic impact
    alpha = np.arctan(0.2 / 0.8)
    exact = 1.0 - 1.5 * np.sin(alpha) ** 2
    _, angle = free_rocking(1e9, 3e-3, 0.3 * alpha, 1.2)
    impact = np.flatnonzero(angle[1:] * angle[:-1] < 0)
    peaks = [0.3 * alpha, *(np.abs(angle[i:j]).max() for i, j in itertools.pairwise(impact))]
    # the speed at impact follows from the amplitude: omega^2 is proportional to cos(alpha - theta) - cos(alpha)
    speed = [np.sqrt(np.cos(alpha - p) - np.cos(alpha)) for p in peaks]
    assert len(peaks) >= 3
    assert speed[1] / speed[0] == pytest.approx(exact, rel=5e-3)
    assert speed[2] / speed[1] == pytest.approx(exact, rel=5e-3)


@pytest.mark.slow
def test_a_wall_pushed_over_falls_apart_and_its_blocks_stay_on_the_floor():
    joint = lm.Joint(35.0, normal_stiffness=3e8)
    blocks = [box(*b.bounds) for b in running_bond(2, 4, size=(0.4, 0.2, 0.2), joint=joint).blocks[1:]]
    floor = box((-6, -6, -0.1), (8, 8, 0))
    wall = lm.Assembly.from_polyhedra([floor, *blocks], joint=joint, fixed=[0])
    stages = [
        dem.Hold(duration=0.1, damping=dem.Damping(0.8)), dem.Ramp(to=0.5, duration=0.2), dem.Hold(duration=0.3),
        dem.Ramp(to=0.0, duration=0.05), dem.Hold(duration=2.0),
    ]
    h = dem.simulate(
        wall, stages, loads=lm.Loads.horizontal(wall, (0, 1, 0)), mode="dynamic", sample=100, detect_every=50
    )
    place = wall.centroids + h.shift[-1]
    assert place[-1, 1] > 0.6  # the top has fallen off
    assert place[1:, 2].min() > 0.09
    # a corner that carries the blow sinks by v sqrt(m / K), K = kn times the corner's tributary area
    assert min(c[:, 2].min() for c in h.corners()[1:]) > -0.02
    # contacts that are cut anew lose energy; they must not make any
    assert h.energy_error.max() < 0.01 * np.abs(h["applied"]).max()
    # everything that moves rests on something: no block is in free fall or below the floor
    assert h["kinetic"][-1] < 0.2 * h["kinetic"].max()


def on_a_spring(weight):
    """A block on a held one, its joint one spring; its weight upwards or downwards, applied at once."""
    outlines = [[[-1.0, -0.2], [1.0, -0.2], [1.0, 0.0], [-1.0, 0.0]], [[0.0, 0.0], [0.1, 0.0], [0.1, 0.3], [0.0, 0.3]]]
    joint = lm.Joint(30.0, normal_stiffness=1e6, shear_stiffness=1e6)
    a = lm.Assembly.from_polygons(outlines, thickness=0.3, joint=joint, fixed=[0])
    dead = np.zeros((2, 6))
    dead[1, 2] = weight * a.weights[1]
    h = dem.simulate(
        a, dem.Hold(steps=40), loads=lm.Loads(dead, np.zeros((2, 6))), mode="dynamic", sample=1, joint_options=UNDAMPED
    )
    return h.shift[:, 1, 2], h["time"], a.arrays.mass[1], h


def test_what_starts_from_rest_is_not_half_a_step_ahead():
    fallen, time, _, h = on_a_spring(1.0)
    assert fallen == pytest.approx(0.5 * GRAVITY * time**2, rel=1e-12)
    # on a spring central differences swing at sin(w' dt / 2) = w dt / 2, and begin at rest
    sunk, time, mass, h = on_a_spring(-1.0)
    w = np.sqrt(1e6 * 0.03 / mass)
    angle = 2.0 * np.arcsin(0.5 * w * h.state.dt) * time / h.state.dt
    assert sunk == pytest.approx(-GRAVITY / w**2 * (1.0 - np.cos(angle)), abs=1e-9 * GRAVITY / w**2)


@pytest.mark.parametrize("made", [
    lambda: dem.Ramp(to=float("nan")), lambda: dem.Ramp(to="all"), lambda: dem.Tilt(to_deg=float("inf")),
    lambda: dem.Tilt(axis=(0.0, float("nan"), 0.0)), lambda: dem.Drive({"a": {"x": float("nan")}}, steps=10),
])
def test_a_target_that_is_not_finite_is_refused(made):
    with pytest.raises(InputError, match="must be (a |three )?finite"):
        made()


@pytest.mark.parametrize("rest", [0.0, None])
def test_a_joint_that_is_torn_has_used_all_of_its_strength_from_then_on(rest):
    """Its part in use was 0 again once a brittle bond had broken."""
    joint = lm.Joint(
        30.0, cohesion=1e5, tensile_strength=5e4, residual_cohesion=rest, residual_tensile_strength=rest,
        normal_stiffness=1e8,
    )
    up = {"z": 1e-3} | dict.fromkeys(("x", "y", "rx", "ry", "rz"), 0.0)
    drive = dem.Drive({"block-1": up}, steps=200)
    h = dem.simulate(on_slab([((0, 0, 0), (0.4, 0.4, 0.2))], joint=joint), drive, contact_points=(3, 3), sample=40)
    # ft / kn is half of the way
    assert h.used[:, 0] == pytest.approx([0.4, 0.8, 1.0, 1.0, 1.0], rel=1e-6)
