"""Points of application on a path: forces of fixed direction whose arms turn with the block, in closed form."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.path_loads import PathLoads
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.geometry.rotation import rotation_matrices

WIDTH, DEPTH, HEIGHT = 0.4, 0.3, 1.0
TURN = rotation_matrices((0.3, -0.5, 0.8))


def block(stiffness=1e12, size=1.0, density=2000.0):
    """A block on rigid ground that cannot slide."""
    solids = [box((-1, 0, -0.2), (2, DEPTH, 0)), box((0, 0, 0), (WIDTH, DEPTH, HEIGHT))]
    joint = lm.Joint(80.0, normal_stiffness=stiffness, shear_stiffness=stiffness)
    made = lm.Assembly.from_polyhedra(solids, names=["ground", "block"], joint=joint, density=density, fixed=[0])
    return made if size == 1.0 else made.transformed(size * np.eye(3))


def rocking(turns, forces):
    """Live multiplier on the edge x = WIDTH by moments: sum of x f_z - z f_x of (point, dead force, live force)."""
    out = []
    for turn in turns:
        sums = np.zeros(2)
        for (x, _, z), *both in forces:
            rx, rz = (x - WIDTH) * np.cos(turn) + z * np.sin(turn), z * np.cos(turn) - (x - WIDTH) * np.sin(turn)
            sums += [rz * f[0] - rx * f[2] for f in both]
        out.append(-sums[0] / sums[1])
    return np.array(out)


def turns_of(curve, i=1):
    return np.array([np.arctan2(s.turn[i, 0, 2], 1.0 + s.turn[i, 0, 0]) for s in curve.states])


@pytest.mark.exact
@pytest.mark.parametrize(("x", "z"), [(0.2, 1.0), (0.2, 0.5), (0.2, 0.1), (0.05, 1.0), (0.3, 0.0)])
def test_a_block_rocks_on_its_edge_under_a_load_at_any_point(x, z):
    wall, at = block(), (x, 0.15, z)
    weight, middle, top = wall.weights[1], wall.centroids[1], (0.2, 0.15, 1.0)
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -2.0 * weight), at=at, case="dead")
    curve = lm.pushover(wall, loads.with_point_load(wall, 1, (weight, 0, 0), at=top), to=0.1)
    none, down = np.zeros(3), np.array([0.0, 0.0, -weight])
    forces = [(middle, down, none), (at, 2.0 * down, none), (top, none, (weight, 0, 0))]
    turns = turns_of(curve)
    rocks = turns > 1e-3
    assert np.count_nonzero(rocks) > 5
    assert turns[-1] > 0.15
    assert np.array(curve.load)[rocks] == pytest.approx(rocking(turns[rocks], forces), rel=1e-5)
    assert all(c.accepted for c in curve.certificates)


@pytest.mark.exact
def test_a_live_load_that_is_eccentric_turns_with_its_block_too():
    """Pushed down beside its edge, from outside: the arm falls as the block turns."""
    wall = block()
    weight, middle, at = wall.weights[1], wall.centroids[1], (0.6, 0.15, 0.9)
    push = weight * np.array((0.1, 0.0, -1.0))
    with pytest.warns(lm.PlausibilityWarning, match="outside the block"):
        loads = lm.Loads.weight(wall).with_point_load(wall, 1, push, at=at)
    curve = lm.pushover(wall, loads, control=(1, "x"), to=0.15)
    turns = turns_of(curve)
    rocks = turns > 1e-3
    forces = [(middle, (0, 0, -weight), np.zeros(3)), (at, np.zeros(3), push)]
    assert np.array(curve.load)[rocks] == pytest.approx(rocking(turns[rocks], forces), rel=1e-5)
    assert lm.limit_analysis(wall, loads).collapse_multiplier == pytest.approx(0.2 / 0.29, rel=1e-6)


@pytest.mark.exact
def test_work_of_the_loads_is_that_of_their_points():
    """Dead loads lose f . (x - x0) at their points; on the edge of a stiff joint the live load gains that."""
    wall = block()
    weight, at = wall.weights[1], np.array((0.2, 0.15, 1.0))
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -2.0 * weight), at=at, case="dead")
    curve = lm.pushover(wall, loads.with_point_load(wall, 1, (weight, 0, 0), at=at), to=0.1)
    first, last = curve.states[0], curve.states[-1]
    ways = [s.shift[1] + s.turn[1] @ (at - wall.centroids[1]) for s in (first, last)]
    dead = -weight * (last.shift - first.shift)[1, 2] - 2.0 * weight * (ways[1] - ways[0])[2]
    assert curve.energy.dead[-1] == pytest.approx(dead, rel=1e-9)
    assert curve.energy.live[-1] == pytest.approx(-dead, rel=2e-3)  # trapezoids over the steps
    assert np.abs(curve.errors["energy"]).max() < 1e-3


@pytest.mark.exact
def test_a_load_on_an_arm_under_a_hung_block_pulls_it_back():
    """Hung from its top edge by glue, a block swings like a pendulum: H = (W + 2 P) tan of the turn, from below."""
    solids = [box((0, 0, 0), (0.4, DEPTH, 0.2)), box((0.19, 0, -1.0), (0.21, DEPTH, 0))]
    joint = lm.Joint(30.0, cohesion=1e9, tensile_strength=1e9, normal_stiffness=1e9, shear_stiffness=1e9)
    wall = lm.Assembly.from_polyhedra(solids, joint=joint, density=2000.0, fixed=[0])
    weight, low = wall.weights[1], (0.2, 0.15, -1.0)
    none = lm.Loads.weight(wall).with_point_load(wall, 1, (weight, 0, 0))
    for load in (0.0, 5.0):
        loads = none.with_point_load(wall, 1, (0, 0, -load * weight), at=low, case="dead")
        curve = lm.pushover(wall, loads, to=0.02)
        turn = np.array([-np.arctan2(s.turn[1, 0, 2], 1.0 + s.turn[1, 0, 0]) for s in curve.states])[-1]
        # the joint of area A and half width a is a spring k A a^2 on two points, which the turn loads beside the arms
        spring = 1e9 * 0.02 * DEPTH * 0.01**2 * np.sin(turn) * np.cos(turn)
        exact = (spring + (0.5 + load) * weight * np.sin(turn)) / (0.5 * weight * np.cos(turn))
        assert curve.load[-1] == pytest.approx(exact, rel=2e-3)


@pytest.mark.exact
@pytest.mark.parametrize("matrix", [np.diag((-1.0, 1.0, 1.0)), TURN @ np.diag((1.0, -1.0, 1.0))])
def test_turned_and_mirrored_copies_rock_alike(matrix):
    wall = block(1e9)
    weight, at = wall.weights[1], (0.1, 0.1, 1.0)
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -weight), at=at, case="dead")
    loads = loads.with_point_load(wall, 1, (weight, 0, 0), at=at)
    curve = lm.pushover(wall, loads, to=0.05)
    copy = wall.transformed(matrix)
    other = lm.pushover(copy, loads.transformed(matrix), to=0.05)
    assert np.interp([0.01, 0.03, 0.05], other.displacement, other.load) == pytest.approx(
        np.interp([0.01, 0.03, 0.05], curve.displacement, curve.load), rel=1e-6
    )
    again = lm.Loads.weight(wall).transformed(matrix).with_point_load(
        copy, 1, matrix @ (0, 0, -weight), at=matrix @ at, case="dead"
    )
    assert again.dead_arms == pytest.approx(loads.transformed(matrix).dead_arms, abs=1e-9 * weight)
    assert again.dead == pytest.approx(loads.transformed(matrix).dead, abs=1e-9 * weight)


@pytest.mark.exact
@pytest.mark.filterwarnings("ignore::limitmason.model.plausibility.PlausibilityWarning")
def test_a_copy_in_millimetres_rocks_alike():
    """Lengths times 1000 under the same forces: stiffness per area over 1e9 at displacements times 1000."""
    at, found = np.array((0.2, 0.15, 1.0)), []
    for size in (1.0, 1e3):
        wall = block(1e9 / size**3, size, density=1.0)
        loads = lm.Loads(np.zeros((2, 6)), np.zeros((2, 6)))
        for point in (at, wall.centroids[1] / size):
            loads = loads.with_point_load(wall, 1, (0, 0, -2e3), at=point * size, case="dead")
        curve = lm.pushover(wall, loads.with_point_load(wall, 1, (1e3, 0, 0), at=at * size), to=0.05 * size)
        found.append(np.interp([0.01, 0.03, 0.05], curve.displacement / size, curve.load))
    assert found[1] == pytest.approx(found[0], rel=1e-6)


@pytest.mark.exact
def test_a_path_goes_on_under_the_same_points_only():
    wall = block(1e9)
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (1e3, 0, 0), at=(0.2, 0.15, 1.0))
    curve = lm.pushover(wall, loads, to=0.01)
    other = lm.Loads.weight(wall).with_point_load(wall, 1, (1e3, 0, 0), at=(0.3, 0.15, 1.0))
    with pytest.raises(lm.errors.NotApplicable, match="live load"):
        lm.pushover(wall, other, to=0.02, start=curve)
    # the state under dead load bears none that could differ: the path from it is that from the start
    rest = lm.pushover(wall, lm.Loads.weight(wall), to=0.0)
    on = lm.pushover(wall, other, to=0.02, start=rest)
    assert np.array_equal(on.load, lm.pushover(wall, other, to=0.02).load)
    high, low = (loads.with_point_load(wall, 1, (0, 0, -1e3), at=(0.2, 0.15, z), case="dead") for z in (1.0, 0.0))
    first = lm.pushover(wall, high, to=0.01)
    with pytest.raises(lm.errors.InputError, match="'block' acts at another point"):
        lm.pushover(wall, low, to=0.02, start=first)


@pytest.mark.exact
def test_blocks_that_hardly_deform_rock_as_rigid_ones():
    wall = block(1e11).with_material(lm.Material(young_modulus=1e13, poisson_ratio=0.2, density=2000.0))
    weight, at = wall.weights[1], (0.2, 0.15, 1.0)
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -2.0 * weight), at=at, case="dead")
    loads = loads.with_point_load(wall, 1, (weight, 0, 0), at=at)
    options = {"contacts": "first", "contact_model": "vertices", "to": 0.03}
    rigid, soft = (lm.pushover(wall, loads, blocks=kind, **options) for kind in ("rigid", "simply deformable"))
    places = [0.01, 0.02, 0.03]
    assert np.interp(places, soft.displacement, soft.load) == pytest.approx(
        np.interp(places, rigid.displacement, rigid.load), rel=1e-3
    )
    assert all(c.accepted for c in soft.certificates)


@pytest.mark.exact
def test_the_tangent_of_turning_arms_is_the_derivative_of_their_moments():
    wall = block()
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (1e3, -2e3, 5e2), at=(0.1, 0.05, 0.8), case="dead")
    loads = loads.with_point_load(wall, 1, (-4e2, 1e3, 2e3), at=(0.3, 0.2, 0.4))
    path, turn, spin, h = PathLoads.of(loads, np.eye(6), np.ones((2, 6), bool)), np.zeros((2, 3, 3)), np.eye(3), 1e-6
    still = np.zeros((2, 3)), np.zeros((2, 0))
    turn[1] = TURN - np.eye(3)

    def wrench(by):
        moved = turn.copy()
        moved[1] = rotation_matrices(tuple(by)) @ TURN - np.eye(3)
        dead, live = path.at(Pose(still[0], moved, still[1]))
        return (dead + 0.7 * live)[1]

    differences = np.column_stack([(wrench(h * d) - wrench(-h * d)) / (2 * h) for d in spin])
    assert path.load_tangent(Pose(still[0], turn, still[1]), 0.7)[0][:, 3:] == pytest.approx(differences, abs=1e-4)


def test_a_couple_whose_forces_cancel_but_for_rounding_is_a_couple():
    pier = lm.build.column(
        width=0.3, depth=0.3, unit_height=0.2, courses=2,
        joint=lm.Joint(30.0, normal_stiffness=1e9, shear_stiffness=5e8),
    )
    top, foot = (pier.centroids[2] + [0.0, 0.0, z] for z in (0.1, -0.1))
    loads = lm.Loads.weight(pier).with_point_load(pier, 2, (0.1 + 0.2, 0.0, 0.0), at=top)
    for force in (-0.1, -0.2):
        loads = loads.with_point_load(pier, 2, (force, 0.0, 0.0), at=foot)
    assert 0.0 < loads.live[2, 0] < 1e-16
    moment = lm.limit_analysis(pier, loads).collapse_multiplier * loads.live[2, 4]
    assert lm.predict(pier, loads, "dem").collapse_multiplier * loads.live[2, 4] == pytest.approx(moment, rel=2e-3)
    with pytest.raises(InputError, match="no live force acts"):
        lm.pushover(pier, loads, to=1e-4)
