"""Edges that cross while blocks move: impacts, where a crossing carries, and what it inherits, against exact laws."""

import numpy as np
import pytest
from poses import place, rotation

import dem
import limitmason as lm
from dem import kernels
from dem.contact.detection import redetect
from dem.contact.near import near_margin
from dem.contact.new_joints import assemble
from dem.model.pieces import Pieces
from limitmason.geometry import box

FRICTIONLESS = 1e-9


def edge_up(along, out):
    """Rotation that takes a cube's edge to ``along`` with the outward diagonal ``out``."""
    diagonal = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    own = np.stack([diagonal, np.cross((0, 0, 1.0), diagonal), (0, 0, 1.0)])
    return np.stack([out, np.cross(along, out), along]).T @ own


def test_a_cube_on_a_map_has_its_twelve_edges_and_no_more():
    """Its faces are given as triangles, whose diagonals are no edges; products of map coordinates leave no normal."""
    cube = box((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))
    faces = [f for a, b, c, d in cube.faces for f in ((a, b, c), (a, c, d))]
    turn, at = rotation([0.3, -1.1, 0.7])[1], np.array([6e5, 5.3e6, 100.0])
    solids = [((cube.vertices + [0.0, 0.0, z]) @ turn.T + at, faces) for z in (0.0, 0.2)]
    made = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0), fixed=[0])
    assert Pieces.of(made).n_edges.tolist() == [12, 12]


def two_cubes(size=1.0, density=2000.0, mu=FRICTIONLESS, stiffness=1e8, dt=1e-4):
    """Two cubes of 0.2 size on a slab, to be put elsewhere; no loads, no dashpots."""
    x = 0.1 * size
    solids = [
        box((-20 * x, -20 * x, -10 * x), (20 * x, 20 * x, -x)), box((-x, -x, -x), (x, x, x)),
        box((x, -x, -x), (3 * x, x, x)),
    ]
    joint = lm.Joint.from_friction_coefficient(mu, normal_stiffness=stiffness)
    a = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0], density=density)
    state = dem.initial_state(
        a, lm.Loads.weight(a), mode="dynamic", joint_options=dem.JointOptions(dashpot=0.0), dt=dt
    )
    return a, lm.Loads(np.zeros((3, 6)), np.zeros((3, 6))), state


def energy_at_whole_steps(h):
    """Kinetic energy averaged to the steps at which the elastic energy is taken, and that."""
    return 0.5 * (h["kinetic"][1:] + h["kinetic"][:-1]) + h["elastic"][:-1]


def edge_on_edge(seed, spinning=0.0, size=1.0, dt=1e-4):
    """Two cubes that meet edge on edge at a seeded angle, offset and turn; energy against that of the start."""
    random = np.random.default_rng(seed)
    a, none, state = two_cubes(size, dt=dt)
    angle = random.uniform(np.deg2rad(25.0), np.deg2rad(155.0))
    along = np.array([0, 0, 1.0]), np.array([0, np.sin(angle), np.cos(angle)])
    first = rotation(along[0] * random.uniform(-0.3, 0.3))[1] @ edge_up(along[0], np.array([1.0, 0, 0]))
    second = rotation(along[1] * random.uniform(-0.3, 0.3))[1] @ edge_up(along[1], np.array([-1.0, 0, 0]))
    reach, high = 0.1 * np.sqrt(2.0) * size, np.array([0.0, 0.0, 5.0 * size])
    centre = np.array([2 * reach + 0.01 * size, *(size * random.uniform(-0.04, 0.04, 2))])
    spin = spinning * random.normal(size=(2, 3))
    place(state, a, 1, first, high, (0.5, 0, 0), spin[0])
    place(state, a, 2, second, high + centre, (-0.5, 0, 0), spin[1])
    h = dem.simulate(
        a, dem.Hold(duration=0.1 * size), loads=none, start=state, mode="dynamic", detect_every=20, sample=1
    )
    energy = energy_at_whole_steps(h)
    met = h["elastic"].max() > 1e-3 * energy[0]
    return energy / energy[0] - 1.0, met


@pytest.mark.slow
@pytest.mark.parametrize("spinning", [0.0, 3.0])
def test_edges_that_meet_elastically_keep_their_energy_from_approach_to_separation(spinning):
    runs = [edge_on_edge(seed, spinning) for seed in range(10)]
    assert sum(met for _, met in runs) >= 5
    # what is left is the error of the step: the touch falls between two steps
    assert max(np.abs(error).max() for error, _ in runs) < 1e-3


@pytest.mark.slow
def test_the_energy_that_an_impact_of_edges_gains_or_loses_fades_with_the_square_of_the_step():
    coarse, fine = (max(np.abs(edge_on_edge(s, dt=dt)[0]).max() for s in range(4)) for dt in (4e-4, 1e-4))
    assert fine < coarse / 8.0


@pytest.mark.slow
def test_crossed_ridges_stop_each_other_as_two_elastic_bodies_do():
    # head on through both centroids: m v' = -m v, whatever the stiffness; the overlap is v sqrt(mu_red / K)
    for size in (1e-2, 1.0, 1e2):
        a, none, state = two_cubes(size, stiffness=1e8 / size, dt=None)
        state.dt *= 0.1
        reach, high = 0.1 * np.sqrt(2.0) * size, np.array([0.0, 0.0, 5.0 * size])
        speed = 0.2 * size  # in a time that grows with the size as the blocks do
        place(state, a, 1, edge_up(np.array([0, 0, 1.0]), np.array([1.0, 0, 0])), high, (speed, 0, 0))
        far = high + (2 * reach + 0.002 * size, 0, 0)
        place(state, a, 2, edge_up(np.array([0, 1.0, 0]), np.array([-1.0, 0, 0])), far, (-speed, 0, 0))
        stiffness, mass = 1e8 / size * (0.2 * size / 3.0) ** 2, state.bodies.mass[1]
        contact = np.pi * np.sqrt(0.5 * mass / stiffness)  # half a period of the reduced mass
        h = dem.simulate(
            a, dem.Hold(duration=0.005 + 1.2 * contact), loads=none, start=state, mode="dynamic", detect_every=50,
            sample=1,
        )
        vel = h.state.bodies.vel
        assert vel[1, 0] == pytest.approx(-speed, rel=2e-3)
        assert vel[2, 0] == pytest.approx(speed, rel=2e-3)
        gap = (a.centroids + h.shift)[:, 2, 0] - (a.centroids + h.shift)[:, 1, 0] - 2 * reach
        assert -gap.min() == pytest.approx(2 * speed * np.sqrt(0.5 * mass / stiffness), rel=0.01)


def test_edges_that_pass_each_other_apart_while_they_become_parallel_do_not_touch():
    # the second turns in the plane of its edge, 1 mm from the first's: nearly parallel they cross beyond their ends,
    # and behind that the normal of the crossing points the other way. Free flight keeps momenta and energy to the bit
    a, none, state = two_cubes()
    reach, high = 0.1 * np.sqrt(2.0), np.array([0.0, 0.0, 5.0])
    tilt, spin = 0.0315, np.array([1.5, 0.0, 0.0])
    place(state, a, 1, edge_up(np.array([0, 0, 1.0]), np.array([1.0, 0, 0])), high)
    tilted = edge_up(np.array([0, np.sin(tilt), np.cos(tilt)]), np.array([-1.0, 0, 0]))
    place(state, a, 2, tilted, high + (2 * reach + 1e-3, 1e-4, 0), spin=spin)
    h = dem.simulate(
        a, dem.Hold(duration=2 * tilt / 1.5), loads=none, start=state, mode="dynamic", detect_every=20, sample=20
    )
    assert (h.state.contact == kernels.CROSSING).any()
    assert not h["elastic"].any()
    assert (h.state.bodies.ang == state.bodies.ang).all()
    assert not h.state.bodies.vel[1:].any()


def test_a_crossing_carries_within_its_edges_and_nothing_beyond_their_ends():
    a, _, state = two_cubes()
    reach, high, deep = 0.1 * np.sqrt(2.0), np.array([0.0, 0.0, 5.0]), 1e-4
    place(state, a, 1, edge_up(np.array([0, 0, 1.0]), np.array([1.0, 0, 0])), high)
    place(state, a, 2, edge_up(np.array([0, 1.0, 0]), np.array([-1.0, 0, 0])), high + (2 * reach + deep, 0, 0))
    redetect(a, state, Pieces.of(a), margin=near_margin(a))
    assert state.contact.tolist()[-1] == kernels.CROSSING
    state.bodies.shift[2, 0] -= 2 * deep
    full = 1e8 * deep * (0.2 / 3.0) ** 2  # a place on the edges of .2 m that cross in their middle
    for axis in (1, 2):
        for part, force in ((0.0, full), (0.49, full), (-0.49, full), (0.61, 0.0), (-0.61, 0.0)):
            moved = state.copy()
            moved.bodies.shift[2, axis] += 0.2 * part
            assert moved.measured(a).force[-1, 0] == pytest.approx(force, rel=1e-9)


def test_a_crossing_is_made_on_both_edges_and_mass_that_joins_adds_no_energy():
    # of blocks apart the axis of the widest gap may belong to edges whose lines pass beyond their ends, far away where
    # they are nearly parallel: a joint there scaled a stone's inertia up at every search, and its energy with it
    solids = [
        box((-1, -1, -0.1), (1, 1, 0)),
        box((-0.1, -0.1, 0), (0.1, 0.1, 0.2)),
        box((0.4, 0.4, 0), (0.6, 0.6, 0.2)),
    ]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0, normal_stiffness=1e9), fixed=[0])
    pieces, margin = Pieces.of(a), near_margin(a)
    empty = dem.initial_state(a, lm.Loads.weight(a))
    assemble(a, empty, np.zeros(len(empty.interface), dtype=bool), None, np.ones(a.n_blocks, dtype=bool))
    empty.bodies.vel[1:], empty.bodies.spin[1:] = 1e-6, 1e-6
    rng, found = np.random.default_rng(3), 0
    for _ in range(150):
        state, towards = empty.copy(), rng.normal(size=3)
        towards /= np.linalg.norm(towards)
        _, turn = rotation(rng.normal(size=3))
        near = 0.1 * np.abs(towards).sum() + 0.1 * np.abs(towards @ turn).sum()
        centre = a.centroids[1] + rng.uniform(0.8, 1.0) * near * towards
        place(state, a, 2, turn, centre, vel=(1e-6, 0, 0), spin=(0, 1e-6, 0))
        momentum = state.bodies.mass[:, None] * state.bodies.vel
        energy, angular = state.energy_of_motion(), state.bodies.ang.copy()
        redetect(a, state, pieces, margin=margin)
        assert state.energy_of_motion() <= energy * (1.0 + 1e-12)
        assert state.bodies.mass[:, None] * state.bodies.vel == pytest.approx(momentum, rel=1e-9)
        assert (state.bodies.ang == angular).all()
        edges = np.flatnonzero(state.contact == 3)
        found += len(edges)
        assert (np.abs(state.joints.arm_a[edges]) < 0.1 + 0.01 * 0.2 + 1e-12).all()
        assert (np.abs(state.joints.arm_b[edges]) < 0.1 + 0.01 * 0.2 + 1e-12).all()
    assert found > 20


@pytest.mark.parametrize("damage", [0.0, 1.0])
def test_a_crossing_slides_at_the_friction_that_the_damage_of_its_pair_has_left(damage):
    """Stepping and measuring alike: tan(phi) undamaged, tan(phi_r) at full damage; no more is done there."""
    x, peak, rest = 0.1, 35.0, 15.0
    solids = [box((-2, -2, -1), (2, 2, -x)), box((-x, -x, -x), (x, x, x)), box((x, -x, -x), (3 * x, x, x))]
    joint = lm.Joint(peak, cohesion=1e4, residual_cohesion=0.0, residual_friction_angle_deg=rest, normal_stiffness=1e8)
    a = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0, 1])
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=dem.JointOptions(dashpot=0.0))
    reach, high, deep = 0.1 * np.sqrt(2.0), np.array([0.0, 0.0, 5.0]), 1e-5
    place(state, a, 1, edge_up(np.array([0, 0, 1.0]), np.array([1.0, 0, 0])), high)
    place(state, a, 2, edge_up(np.array([0, 1.0, 0]), np.array([-1.0, 0, 0])), high + (2 * reach, 0, 0))
    redetect(a, state, Pieces.of(a), margin=near_margin(a))
    assert state.contact.tolist() == [kernels.CROSSING]
    state.points.damage[:] = damage
    state.bodies.shift[2, 0] -= deep
    # the drive holds the second and moves it along its edge by far more than the elastic slip
    none = lm.Loads(np.zeros((3, 6)), np.zeros((3, 6)))
    along = {"x": 0.0, "y": 1e-3, "z": 0.0, "rx": 0.0, "ry": 0.0, "rz": 0.0}
    drive = dem.Drive({"block-2": along}, duration=50 * state.dt)
    h = dem.simulate(a, drive, loads=none, start=state, mode="dynamic", detect_every=None, sample=1)
    force = h.state.measured(a).force[0]
    normal = 1e8 * deep * (0.2 / 3.0) ** 2
    mu = np.tan(np.deg2rad(rest if damage else peak))
    assert abs(force[0]) == pytest.approx(normal, rel=1e-6)
    assert np.hypot(force[1], force[2]) == pytest.approx(mu * normal, rel=1e-6)
    assert np.hypot(*h.reaction_of("block-2")[-1, 1:3]) == pytest.approx(mu * normal, rel=1e-6)
    assert h.state.points.damage.tolist() == [damage]


def test_a_joint_takes_over_the_force_of_a_crossing_and_of_a_joint_beside_it_in_one_sense():
    """A slider, block a of every joint, pushes 3 N on one stone and 5 N on another: the new joint has 8 N, not 2 N."""
    def points(**of):
        return kernels.Points(**{name: of.get(name, np.zeros(1)) for name in kernels.Points._fields})

    def joints(block_b):
        k = len(block_b)
        law = np.zeros((k, kernels.LAW_SIZE))
        law[:, [kernels.LAW.kn, kernels.LAW.ks]] = 2.0
        return kernels.Joints(
            block_a=np.zeros(k, np.int64), block_b=np.array(block_b), start=np.arange(k + 1), frame=np.zeros((k, 3, 3)),
            turn=np.zeros((k, 4)), arm_a=np.zeros((k, 3)), arm_b=np.zeros((k, 3)), offset=np.zeros((k, 3)), law=law,
            edge=np.zeros((k, 3)), limits=np.zeros((k, 4)),
        )

    old = kernels.Points(*(np.ones(2) for _ in kernels.Points._fields))
    new, place = points(area=np.ones(1)), np.zeros((1, 3))
    left = kernels.Testators(
        np.array([kernels.CROSSING, kernels.FACES]), np.zeros((2, 3)), np.array([[3.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    )
    heirs = kernels.Heirs(np.array([kernels.FACES]), np.eye(3)[None], place, np.zeros(1), np.zeros((1, 2)), np.zeros(1))
    kernels.inherit(
        old, joints([2, 1]), left, np.array([0, 2]), np.array([0, 1]), np.array([1, 0]), new, joints([2]), heirs
    )
    assert new.slip_1.tolist() == [(3.0 + 5.0) / 2.0]
