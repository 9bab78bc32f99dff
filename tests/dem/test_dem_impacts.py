"""What is left after an impact: closed forms for a flat landing and for rocking, at any number of contact points."""

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import dem
import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box

WIDTH, DEPTH, HEIGHT = 0.2, 0.3, 0.8


def standing(joint):
    solids = [box((-3, -3, -0.1), (3, 3, 0.0)), box((0, 0, 0), (WIDTH, DEPTH, HEIGHT))]
    return lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0])


@pytest.mark.parametrize("ratio", [0.05, 0.25, 0.6])
@pytest.mark.parametrize("grid", [(2, 2), (3, 5)])
def test_a_flat_landing_rebounds_as_spring_and_dashpot_without_pull_do(ratio, grid):
    # Schwager and Poeschel 2007: contact ends where the force, not the overlap, is zero
    stiffness = 1e8
    a = standing(lm.Joint(35.0, normal_stiffness=stiffness))
    frequency = np.sqrt(stiffness * WIDTH * DEPTH / a.arrays.mass[1])
    options = dem.JointOptions(dashpot=2.0 * ratio / frequency)
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", contact_points=grid, joint_options=options)
    state.dt *= 0.05
    state.bodies.shift[1, 2], state.bodies.vel[1, 2] = 1e-4, -1.0
    none = lm.Loads(np.zeros((2, 6)), np.zeros((2, 6)))
    h = dem.simulate(a, dem.Hold(duration=6.0 / frequency), loads=none, start=state)
    root = np.sqrt(1.0 - ratio**2)
    exact = np.exp(-2.0 * ratio / root * np.arctan2(root, ratio))
    assert h.state.bodies.vel[1, 2] == pytest.approx(exact, rel=0.01)


def spin_kept(dashpot, detect=50, **points):
    """Part of the spin left after every impact of a block that rocks."""
    alpha = np.arctan(WIDTH / HEIGHT)
    start = 0.3 * alpha
    a = standing(lm.Joint(60.0, normal_stiffness=1e9))
    options = dem.JointOptions(dashpot=dashpot)
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", joint_options=options, **points)
    turn = np.array([[np.cos(start), 0, np.sin(start)], [0, 1, 0], [-np.sin(start), 0, np.cos(start)]])
    foot = np.array([WIDTH, DEPTH / 2, 0.0])
    state.bodies.quat[1] = (np.cos(start / 2), 0.0, np.sin(start / 2), 0.0)
    state.bodies.rot[1] = turn - np.eye(3)
    state.bodies.shift[1] = foot + turn @ (a.centroids[1] - foot) - a.centroids[1]
    h = dem.simulate(a, dem.Hold(duration=1.0), start=state, sample=5, detect_every=detect)
    angle = 2.0 * h.quaternion[:, 1, 2]
    impact = np.flatnonzero(angle[1:] * angle[:-1] < 0)
    peaks = [start, *(np.abs(angle[i:j]).max() for i, j in itertools.pairwise(impact))]
    speed = [np.sqrt(np.cos(alpha - p) - np.cos(alpha)) for p in peaks]
    return speed[1] / speed[0]


def left_by_impulse_at(x):
    """Part of the spin that an impulse at x from the middle of the base leaves, by angular momentum about it."""
    b, h = WIDTH / 2, HEIGHT / 2
    inertia = (b * b + h * h) / 3.0 + h * h
    return (inertia - x * b) / (inertia + x * b)


@pytest.mark.slow
def test_rocking_on_corners_is_housners_with_and_without_new_contacts():
    housner = 1.0 - 1.5 * np.sin(np.arctan(WIDTH / HEIGHT)) ** 2
    assert left_by_impulse_at(WIDTH / 2) == pytest.approx(housner, rel=1e-12)
    for detect in (None, 50):
        assert spin_kept(3e-3, detect, contact_points=(2, 2)) == pytest.approx(housner, rel=5e-3)
        assert spin_kept(3e-3, detect, contact_model="vertices") == pytest.approx(housner, rel=5e-3)


@pytest.mark.slow
def test_points_between_the_edges_leave_more_spin_and_never_more_than_there_was():
    kept = [spin_kept(3e-3, contact_points=(2, n)) for n in (2, 4, 8)]
    assert kept[0] < kept[1] < kept[2]
    # an impulse of points that only push lies between the middle, about which nothing is lost, and the new edge
    assert left_by_impulse_at(WIDTH / 2) * (1.0 - 5e-3) < kept[0]
    assert kept[2] < left_by_impulse_at(0.0)


FLOOR, LOW, TOP = box((-1, -1, -0.1), (1, 1, 0)), box((-0.1, -0.15, 0), (0.1, 0.15, 0.5)), box(
    (-0.08, -0.15, 0.5), (0.08, 0.15, 0.9)
)


def numbered(order, *solids):
    """Solids, of which the first is held, as blocks in another order."""
    joint = lm.Joint(40.0, normal_stiffness=5e8, shear_stiffness=2.5e8)
    return lm.Assembly.from_polyhedra([solids[k] for k in order], joint=joint, fixed=[order.index(0)])


@pytest.mark.slow
def test_a_stack_that_rocks_moves_alike_whatever_the_numbers_of_its_blocks():
    # the plane of a joint turns with its first block: by number, the upper block fell in five orders of six
    record = 6.0 * np.sin(2.0 * np.pi * np.arange(0.0, 0.3005, 0.005) / 0.3)
    stages = [dem.BaseMotion(record, 0.005, after="coast"), dem.Hold(duration=0.7)]
    ways = []
    for order in itertools.permutations(range(3)):
        stack = numbered(order, FLOOR, LOW, TOP)
        run = dem.simulate(stack, stages, mode="dynamic", sample=0.02, contact_points=(2, 2))
        assert any("contacts are searched for" in w for w in run.warnings)
        ways.append(run.shift[:, [order.index(k) for k in range(3)]])
    for way in ways[1:]:
        assert np.abs(way - ways[0]).max() < 1e-5


@pytest.mark.exact
def test_the_plane_of_a_joint_is_the_face_that_goes_on_beyond_it_and_else_that_of_the_lower_block():
    wide, even, beside = box((-0.3, -0.3, 0.5), (0.3, 0.3, 0.9)), box((-0.1, -0.15, 0.5), (0.1, 0.15, 0.9)), box(
        (0.1, -0.05, 0.1), (0.3, 0.05, 0.3)
    )
    for order in itertools.permutations(range(3)):
        for third, base in ((TOP, 1), (wide, 2), (even, 1), (beside, 1)):
            made = numbered(order, FLOOR, LOW, third)
            state = dem.initial_state(made, lm.Loads.weight(made), mode="dynamic", contact_points=(2, 2))
            pairs = {(order[a], order[b]) for a, b in zip(state.joints.block_a, state.joints.block_b, strict=True)}
            assert pairs == {(0, 1), (base, 3 - base)}
            assert np.linalg.det(state.joints.frame) == pytest.approx(1.0)


@pytest.mark.exact
def test_forces_in_joints_that_were_turned_round_are_those_of_the_interfaces():
    for order in ((0, 1, 2), (2, 1, 0), (1, 0, 2)):
        stack = numbered(order, FLOOR, LOW, box((-0.08, -0.15, 0.5), (0.04, 0.05, 0.9)))
        run = dem.simulate(
            stack, dem.Hold(duration=0.4), mode="dynamic", contact_points=(2, 2), damping=dem.Damping(local=0.7)
        )
        found, low, top = run.state.resultants(stack), order.index(1), order.index(2)
        for k, interface in enumerate(stack.interfaces):
            pair = {interface.block_a, interface.block_b}
            above = [top] if pair == {low, top} else [low, top]
            weight = stack.weights[above]
            assert found.normal[k] == pytest.approx(weight.sum(), rel=1e-3)
            mine = found.point_interface == k
            force = found.point_force[mine, 2]
            # on block b: up where that is the upper one
            assert force.sum() == pytest.approx(weight.sum() * (1.0 if interface.block_b in above else -1.0), rel=1e-3)
            place = force @ found.point_position[mine, :2] / force.sum()
            assert place == pytest.approx(weight @ stack.centroids[above, :2] / weight.sum(), abs=2e-4)


def test_a_column_let_go_beyond_its_balance_falls_as_a_rigid_body_and_half_a_turn_is_refused():
    """The angle of a fall about the edge, by the equation of a rigid body; a turn that only the quaternion has is none.

    The kernel took the arms of the upright block: it had turned five times as far after 0.3 s.
    """
    alpha, size = np.arctan(WIDTH / HEIGHT), 0.5 * np.hypot(WIDTH, HEIGHT)
    start, until = 1.5 * alpha, 0.2
    a = standing(lm.Joint(60.0, normal_stiffness=5e9))
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic")
    turn = np.array([[np.cos(start), 0, np.sin(start)], [0, 1, 0], [-np.sin(start), 0, np.cos(start)]])
    foot = np.array([WIDTH, DEPTH / 2, 0.0])
    state.bodies.quat[1] = (np.cos(start / 2), 0.0, np.sin(start / 2), 0.0)
    state.bodies.shift[1] = foot + turn @ (a.centroids[1] - foot) - a.centroids[1]
    with pytest.raises(InputError, match=f"{a.blocks[1].name!r} of the state to start from is turned two ways"):
        dem.simulate(a, dem.Hold(duration=until), start=state)
    state.bodies.rot[1] = turn - np.eye(3)
    h = dem.simulate(a, dem.Hold(duration=until), start=state)
    inertia = 4.0 / 3.0 * size**2  # about the edge, over the mass [m2]
    wanted = solve_ivp(
        lambda t, y: [y[1], 9.81 * size / inertia * np.sin(y[0] - alpha)], (0.0, until), [start, 0.0], rtol=1e-9
    ).y[0, -1]
    assert wanted > 1.1 * start
    assert h.rotation_of(1)[-1, 1] == pytest.approx(wanted, rel=3e-3)
