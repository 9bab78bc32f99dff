"""Contacts found while blocks move, and Coulomb's law with dashpots, against exact laws of motion."""

import numpy as np
import pytest
from poses import place, rotation

import dem
import limitmason as lm
from dem import kernels
from dem.contact import detection
from dem.contact.detection import redetect
from dem.contact.near import Neighbours, near_margin
from dem.contact.new_joints import assemble
from dem.model.pieces import Pieces
from dem.stages import recording
from limitmason.geometry import box

GRAVITY = 9.81


@pytest.mark.slow
def test_a_search_that_looks_at_changed_blocks_alone_gives_the_bits_of_one_that_looks_at_all(monkeypatch):
    # two columns on a shaken ground, one of which falls onto the other; the stiffness of all blocks is looked at or not
    joint = lm.Joint(30.0, normal_stiffness=1e8, shear_stiffness=5e7)
    solids = [
        box((-2, -2, -1), (2, 2, 0)), box((-0.2, -0.2, 0), (0.2, 0.2, 1)), box((0.3, -0.2, 0), (0.7, 0.2, 1.2)),
        box((-0.2, -0.15, 1), (0.15, 0.2, 1.3)), box((0.3, -0.15, 1.2), (0.65, 0.2, 1.4)),
    ]
    model = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0])
    shake = dem.BaseMotion(tuple(7.0 * np.sin(6.0 * np.arange(0.0, 1.2, 0.01))), 0.01, after="coast")
    looked_at = []

    def all_blocks(assembly, state, stays, made, changed):
        looked_at.append(changed.sum())
        return assemble(assembly, state, stays, made, np.ones_like(changed))

    few = dem.simulate(model, shake, mode="dynamic", contact_points=(3, 3))
    monkeypatch.setattr(detection, "assemble", all_blocks)
    every = dem.simulate(model, shake, mode="dynamic", contact_points=(3, 3))
    assert len(looked_at) > 20
    assert min(looked_at) < model.n_blocks
    assert np.abs(few.rotation_of(1)).max() > 0.1
    for name, value in few.state.arrays().items():
        if value.dtype.kind == "f":
            assert np.array_equal(value, every.state.arrays()[name], equal_nan=True), name


def leaning(n=8):
    """Column of cubes of 0.4 m on a slippery foot, and a ground that slides under it and lets it rock."""
    joint, foot = (lm.Joint(angle, normal_stiffness=1e8, shear_stiffness=5e7) for angle in (40.0, 12.0))
    solids = [box((-3, -3, -1), (3, 3, 0)), *(box((-0.2, -0.2, 0.4 * i), (0.2, 0.2, 0.4 * i + 0.4)) for i in range(n))]
    model = lm.Assembly.from_polyhedra(solids, joint=joint, joints={"base": foot}, density=2000.0, fixed=[0])
    return model, dem.BaseMotion(tuple(4.0 * np.sin(14.0 * np.arange(0.0, 0.8, 0.01))), 0.01, after="hold")


def same_bits(one, other):
    """Whether two states agree in every bit, but for what searches note of joints when they look at them."""
    a, b = one.arrays(), other.arrays()
    names = [k for k, v in a.items() if v.dtype.kind in "fi" and k != "ends" and not k.startswith("near.")]
    return all(np.array_equal(a[k], b[k], equal_nan=a[k].dtype.kind == "f") for k in names)


def dragged():
    """Two columns of cubes of 0.4 m, the top of one of which is drawn along until it overhangs; the other rests."""
    joint = lm.Joint(25.0, normal_stiffness=1e8, shear_stiffness=5e7)
    places = [(x, 0.4 * i) for x in (-0.2, 2.0) for i in range(6)]
    cubes = [box((x, -0.2, z), (x + 0.4, 0.2, z + 0.4)) for x, z in places]
    model = lm.Assembly.from_polyhedra([box((-3, -3, -1), (6, 3, 0)), *cubes], joint=joint, density=2000.0, fixed=[0])
    return model, dem.Drive({"block-6": {"x": 0.15}}, steps=8000)


@pytest.mark.slow
@pytest.mark.parametrize("made, mode, most", [(leaning, "dynamic", 1.0), (dragged, "quasi-static", 0.75)])
def test_pairs_that_have_not_moved_are_left_out_of_a_search_and_no_bit_changes(made, mode, most, monkeypatch):
    model, motion = made()
    seen = []

    class Noted(Neighbours):
        def due(self):
            seen.append(super().due())
            return seen[-1]

    class Every(Neighbours):
        def due(self):
            return np.ones(len(self.moved), dtype=bool)

    # in the searches alone: both runs begin to search at the same step
    monkeypatch.setattr(detection, "Neighbours", Noted)
    few = dem.simulate(model, motion, mode=mode, contact_points=(3, 3))
    assert len(seen) > 10
    assert np.mean(seen[1:]) < most
    monkeypatch.setattr(detection, "Neighbours", Every)
    every = dem.simulate(model, motion, mode=mode, contact_points=(3, 3))
    assert (every.state.interface < -1).any()  # cut anew on the way
    assert same_bits(few.state, every.state)


def test_a_tower_that_sinks_and_goes_along_with_its_ground_starts_no_search():
    # each bed closes by some 2 mm, the top sinks by 18, and the ground carries all of it off by 0.2 m
    model, _ = leaning(9)
    soft = model.with_joints(lm.Joint(40.0, normal_stiffness=2e7, shear_stiffness=1e7))
    ride = dem.BaseMotion(tuple(0.5 * np.sin(2.0 * np.pi * np.arange(0.0, 1.01, 0.05))), 0.05, after="hold")
    h = dem.simulate(soft, [dem.Hold(duration=0.3, damping=dem.Damping(local=0.8)), ride], mode="dynamic")
    margin = near_margin(soft)
    assert h.shift[-1, -1, 2] < -0.5 * margin
    assert h.shift[-1, 0, 0] > 2.0 * margin
    assert not h.warnings
    assert h.state.near is None


@pytest.mark.slow
def test_a_search_adds_no_energy_and_what_it_takes_is_counted(monkeypatch):
    # bricks shaken off a stack: they slide, rock, fall on edges and corners
    shapes = [box((-1.0, -1.0, -0.2), (1.0, 1.0, 0.0))]
    for course, side in ((c, k) for c in range(2) for k in range(2)):
        x = 0.12 * side + 0.06 * (course % 2)
        shapes.append(box((x - 0.06, -0.05, 0.06 * course), (x + 0.06, 0.05, 0.06 * (course + 1))))
    joint = lm.Joint(30.0, normal_stiffness=1e8, shear_stiffness=5e7)
    a = lm.Assembly.from_polyhedra(shapes, joint=joint, fixed=[0])
    time = np.arange(0.0, 0.32, 0.01)
    shaken = np.column_stack([12.0 * np.sin(14.0 * time), 8.0 * np.sin(19.0 * time), 0.0 * time])
    shake = dem.BaseMotion(tuple(map(tuple, shaken.tolist())), 0.01, after="coast")
    steps = []

    def searched(assembly, state, *rest, **how):
        before = state.measured(assembly).elastic_energy, state.total[kernels.E_DAMPING]
        found = redetect(assembly, state, *rest, **how)
        steps.append((*before, state.measured(assembly).elastic_energy, state.total[kernels.E_DAMPING]))
        return found

    monkeypatch.setattr(recording, "redetect", searched)
    h = dem.simulate(a, shake, mode="dynamic", contact_points=(3, 3))
    stored, counted, left, more = np.array(steps).T
    assert len(steps) > 50
    assert (stored - left).sum() > 1e-3 * stored.max()
    assert (left - stored).max() < 1e-12 * stored.max()
    assert more - counted == pytest.approx(stored - left, abs=1e-12 * stored.max())
    assert h["damping"][-1] == pytest.approx((stored - left).sum(), rel=1e-9)


def slider(dashpot, detect, slope=35.0, friction=25.0):
    """Acceleration of a settled block that slides down a slope, over the exact one."""
    solids = [box((-3, -3, -0.1), (3, 3, 0)), box((0, 0, 0), (0.3, 0.3, 0.2))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(friction, normal_stiffness=1e8), fixed=[0])
    angle, mu = np.deg2rad(slope), np.tan(np.deg2rad(friction))
    dead = np.zeros((2, 6))
    dead[1, :3] = a.weights[1] * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    loads = lm.Loads(dead, np.zeros_like(dead))
    options = dem.JointOptions(dashpot=dashpot)
    state = dem.initial_state(a, loads, mode="dynamic", joint_options=options)
    state.bodies.shift[1, 2] = -a.weights[1] * np.cos(angle) / (1e8 * 0.09)
    h = dem.simulate(
        a, dem.Hold(duration=0.6), loads=loads, start=state, mode="dynamic", detect_every=detect, sample=1
    )
    exact = GRAVITY * (np.sin(angle) - mu * np.cos(angle))
    time, travel = h["time"] - h["time"][0], h.shift[:, 1, 0] - h.shift[0, 1, 0]
    # position at a step, velocity half a step before: s = v t + a t^2 / 2 with v from the first two samples
    speed = (h.shift[1, 1, 0] - h.shift[0, 1, 0]) / time[1]
    return travel[-1] / (speed * time[-1] + 0.5 * exact * time[-1] * (time[-1] - time[1])), h


@pytest.mark.parametrize("detect", [None, 20])
@pytest.mark.parametrize("dashpot", [0.0, 1e-4, 1e-2])
def test_a_slider_travels_as_coulomb_says_with_contacts_cut_anew_and_any_dashpot(dashpot, detect):
    ratio, h = slider(dashpot, detect)
    assert h["largest slip"][-1] < (0.1 if detect else 1.0)  # cut anew on the way
    assert ratio == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize("dashpot", [0.0, 1e-4, 1e-3])
@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_an_oblique_impact_in_full_slip_transfers_mu_times_its_normal_impulse(dashpot, mu):
    solids = [box((-3, -3, -0.1), (3, 3, 0)), box((0, 0, 0), (0.3, 0.3, 0.2))]
    joint = lm.Joint.from_friction_coefficient(mu, normal_stiffness=1e8)
    a = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0])
    none = lm.Loads(np.zeros((2, 6)), np.zeros((2, 6)))
    options = dem.JointOptions(dashpot=dashpot)
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=options)
    state.bodies.held[1, 3:] = True
    state.dt *= 0.1
    state.bodies.shift[1], state.bodies.vel[1] = (0, 0, 1e-3), (3.0, 0, -1.0)
    energy = state.energy_of_motion()
    h = dem.simulate(a, dem.Hold(duration=0.015), loads=none, start=state, mode="dynamic", detect_every=None)
    vel = h.state.bodies.vel[1]
    assert vel[2] > 0.3  # gone again
    assert (3.0 - vel[0]) / (vel[2] + 1.0) == pytest.approx(mu, rel=1e-12)
    # what friction and the dashpots are said to have taken is what is gone
    gone = energy - h.state.energy_of_motion()
    assert h["friction"][-1] + h["viscous"][-1] == pytest.approx(gone, rel=0.03)


def test_a_run_without_loads_in_which_energy_falls_is_not_called_an_explosion():
    solids = [box((-3, -3, -0.1), (3, 3, 0)), box((0, 0, 0), (0.3, 0.3, 0.2))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0, normal_stiffness=1e8), fixed=[0])
    none = lm.Loads(np.zeros((2, 6)), np.zeros((2, 6)))
    for vel in ((1.0, 0, 1.0), (0, 0, -1.0), (1.0, 0, -1.0)):
        state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=dem.JointOptions(dashpot=1e-3))
        state.bodies.vel[1] = vel
        energy = state.energy_of_motion()
        h = dem.simulate(a, dem.Hold(duration=0.02), loads=none, start=state, mode="dynamic", sample=3)
        assert h["kinetic"].max() <= energy * (1.0 + 1e-9)


def test_a_block_that_bounces_back_to_where_it_fell_from_is_not_called_an_explosion():
    # the net work of its weight is nothing there; impacts in four steps of time gain and lose a few per cent of W h
    height = 0.05
    a = lm.Assembly.from_polyhedra(
        [box((-1, -1, -0.1), (1, 1, 0)), box((0, 0, 0), (0.3, 0.3, 0.2))], joint=lm.Joint(30.0, normal_stiffness=1e8),
        fixed=[0],
    )
    options = dem.JointOptions(dashpot=0.0)
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=options)
    state.bodies.shift[1, 2] = height
    turns = np.sqrt(8.0 * height / 9.81)
    h = dem.simulate(a, dem.Hold(duration=4.2 * turns), start=state, sample=1)
    assert h.status == "finished"
    # in flight, where both energies are taken half a step apart at the most
    flying = h["elastic"] == 0.0
    total = h["kinetic"] + a.weights[1] * h.shift[:, 1, 2]
    assert np.abs(total[flying] / (a.weights[1] * height) - 1.0).max() < 0.2


def toppling(stiffness=1e8):
    """A slender block on a floor with a spin about its right foot that turns it over; damped alike at any stiffness."""
    solids = [box((-3, -3, -0.1), (3, 3, 0.0)), box((0, 0, 0), (0.2, 0.3, 0.8))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0, normal_stiffness=stiffness), fixed=[0])
    options = dem.JointOptions(dashpot=3e-4 * np.sqrt(1e8 / stiffness))
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=options)
    spin = np.array([0.0, 1.2, 0.0])
    state.bodies.ang[1] = np.linalg.inv(state.bodies.inv_inertia[1]) @ spin
    state.bodies.vel[1] = np.cross(spin, a.centroids[1] - (0.2, 0.15, 0.0))
    return a, state


@pytest.mark.slow
def test_a_toppled_block_lies_on_the_floor_without_being_asked_to_look_for_contacts():
    # a face cut while a corner is pressed into the floor may not make energy: it starts set back. Points that open lose
    # that again, so that the block rests as deep as its weight presses it into the spring of its side, W / (kn A)
    for stiffness in (1e8, 1e9):
        a, state = toppling(stiffness)
        h = dem.simulate(a, dem.Hold(duration=3.5), start=state)
        rest = a.centroids[1, 2] + h.shift[-1, 1, 2] - 0.1  # above half its thickness
        assert rest == pytest.approx(-a.weights[1] / (stiffness * 0.8 * 0.3), rel=0.02)
        assert not h.state.setback.any()
        assert any("'block-1'" in w and "small displacement" in w for w in h.warnings)


@pytest.mark.exact
def test_a_setback_goes_as_its_point_opens_and_no_energy_with_it():
    # a block first seen when it overlaps by 0.1 mm has no energy to give: set back by all of that, and by what is left
    # of it after every rise, so that the energy at a depth d is kn A (d - what is left)^2 / 2
    a = lm.Assembly.from_polyhedra(
        [box((-1, -1, -0.1), (1, 1, 0)), box((-1, -1, -0.3), (-0.8, 1, -0.1)), box((0, 0, 0), (0.3, 0.2, 0.1))],
        joint=lm.Joint(35.0, normal_stiffness=1e9), fixed=[0, 1],
    )
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic")
    pieces, margin = Pieces.of(a), near_margin(a)
    # no contact is known
    assemble(a, state, np.zeros(len(state.interface), dtype=bool), None, np.ones(a.n_blocks, dtype=bool))

    def energy(height):
        state.bodies.shift[2, 2] = height
        before = state.measured(a).elastic_energy
        redetect(a, state, pieces, margin=margin)
        after = state.measured(a).elastic_energy
        assert after == pytest.approx(before, abs=1e-15)
        return after

    area, left = 0.3 * 0.2, 1e-4
    assert energy(-1e-4) == 0.0
    for height in (-0.7e-4, -0.4e-4, -0.9e-4, 0.0):
        left = min(left, max(-height, 0.0))
        energy(height)
        assert state.setback == pytest.approx(left, abs=1e-15)
        depth = 2e-4 - left
        state.bodies.shift[2, 2] = -2e-4
        stored = state.measured(a).elastic_energy
        assert stored == pytest.approx(0.5 * 1e9 * area * depth**2, rel=1e-9)


def test_points_cut_while_a_block_is_tilted_above_a_face_are_points_of_the_block():
    # 11 mm above the floor and turned by 4 degrees: laid down by d, turned about the vertical and moved aside, all
    # points are open by -d and their forces act there; a gap that stays upright was 27 um short, its force 11 mm deep
    solids = [box((-1, -1, -0.1), (1, 1, 0)), box((-0.4, -0.15, 0), (0.4, 0.15, 0.2))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0, normal_stiffness=1e9), fixed=[0])
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic")
    assemble(a, state, np.zeros(len(state.interface), dtype=bool), None, np.ones(a.n_blocks, dtype=bool))
    _, tilted = rotation((np.deg2rad(4.0), np.deg2rad(1.0), 0.0))
    lowest = (tilted @ (solids[1].vertices - a.centroids[1]).T)[2].min()
    place(state, a, 1, tilted, (0.0, 0.0, 1e-4 - lowest))
    redetect(a, state, Pieces.of(a), margin=near_margin(a))
    assert (state.contact == 1).all()
    assert np.ptp(state.points.gap) > 0.02
    depth = 1e-6
    place(state, a, 1, rotation((0.0, 0.0, 0.3))[1], (0.05, 0.02, 0.1 - depth))
    now = state.measured(a)
    assert now.opening == pytest.approx(-depth, rel=1e-6)
    assert now.position[:, 2] == pytest.approx(-depth, rel=1e-6)


def test_kept_contacts_that_a_block_has_left_are_named():
    a, state = toppling()
    h = dem.simulate(a, dem.Hold(duration=1.0), start=state, detect_every=None)
    assert any("'block-1'" in w and "detect_every=None" in w and "wrong" in w for w in h.warnings)
    settled = dem.simulate(a, dem.Settle())
    assert not any("small displacement" in w for w in settled.warnings)


def shaken(record, step, **options):
    """A block glued by friction to a floor that follows a record."""
    solids = [box((-1, -1, -0.1), (1, 1, 0)), box((0, 0, 0), (0.3, 0.3, 0.1))]
    joint = lm.Joint.from_friction_coefficient(0.2, normal_stiffness=1e9)
    a = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0])
    return a, dem.BaseMotion(acceleration=record, sample_step=step, **options)


def test_a_record_that_ends_with_velocity_must_say_what_the_ground_does_then():
    push = [0.05 * GRAVITY] * 11  # ends at 0.05 g 0.1 s
    end = 0.05 * GRAVITY * 0.1
    a, silent = shaken(push, 0.01)
    settle, later = dem.Hold(duration=0.05, damping=dem.Damping(0.8)), dem.Hold(duration=0.2)
    with pytest.raises(ValueError, match=r"stage 1 \(BaseMotion\).*0.049.*coast.*hold"):
        dem.simulate(a, [settle, silent, later], mode="dynamic")
    last = dem.simulate(a, [settle, silent], mode="dynamic")
    assert any("ends with a ground velocity of 0.049" in w for w in last.warnings)
    for after, velocity in (("coast", end), ("hold", 0.0)):
        a, motion = shaken(push, 0.01, after=after)
        h = dem.simulate(a, [settle, motion, later], mode="dynamic")
        at = np.interp(0.155, h["time"], h.shift[:, 0, 0])  # the ground at the end of the record
        assert h.shift[-1, 0, 0] - at == pytest.approx(velocity * (h["time"][-1] - 0.155), abs=1e-4)
        # below the friction limit nothing slides while the ground coasts; stopped dead, the block slides on by
        # v^2 / (2 mu g)
        apart = h.shift[-1, 1, 0] - h.shift[-1, 0, 0]
        assert apart == pytest.approx(0.0 if after == "coast" else end**2 / (2 * 0.2 * GRAVITY), abs=2e-5)
        # a run continued from the history goes on the same way
        more = dem.simulate(a, dem.Hold(duration=0.1), start=h)
        assert more.shift[-1, 0, 0] - h.shift[-1, 0, 0] == pytest.approx(velocity * 0.1, abs=2e-4)
    with pytest.raises(ValueError, match="after must be"):
        shaken(push, 0.01, after="stop")
    with pytest.raises(ValueError, match="not finite"):
        shaken([0.0, np.nan], 0.01)


def test_resultants_leave_out_contacts_that_were_cut_anew_of_the_last_interface_too():
    joint = lm.Joint(30.0, normal_stiffness=1e8, shear_stiffness=5e7)
    solids = [box((-1, -1, -0.2), (1, 1, 0)), *(box((-0.1, -0.1, z), (0.1, 0.1, z + 0.2)) for z in (0.0, 0.2))]
    a = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0])
    state = dem.simulate(a, dem.Settle(), contact_points=(3, 3)).state
    before = state.resultants(a)
    # joints cut anew from interface i are marked -2 - i
    state.interface[1] = -2 - 1
    after = state.resultants(a)
    assert after.normal[0] == before.normal[0] > 0.0
    assert after.normal[1] == 0.0
