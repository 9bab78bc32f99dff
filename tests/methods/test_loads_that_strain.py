"""Loads beside the centroid of a block that deforms: they strain it by its mean gradient, in every engine alike."""

from itertools import pairwise

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.kernels import E_APPLIED
from dem.model.advance import run, run_constant
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.path_loads import PathLoads
from limitmason.deformable.levels import RITZ, SIMPLY_DEFORMABLE
from limitmason.geometry import box
from limitmason.geometry.rotation import rotation_matrices

pytestmark = pytest.mark.filterwarnings("ignore::limitmason.model.plausibility.PlausibilityWarning")
E, KN, WIDTH, DEPTH, HEIGHT = 1e9, 1e11, 0.4, 0.3, 1.0
AREA = WIDTH * DEPTH
TOP = np.array((0.5 * WIDTH, 0.5 * DEPTH, HEIGHT))


def bar(blocks=1, poisson=0.0, glue=1e9, density=20.0):
    """A bar of some blocks on a held one, glued; of little weight."""
    cuts = np.linspace(0.0, HEIGHT, blocks + 1)
    solids = [box((-0.5, 0, -0.2), (1, DEPTH, 0)), *(box((0, 0, a), (WIDTH, DEPTH, b)) for a, b in pairwise(cuts))]
    joint = lm.Joint(60.0, cohesion=glue, tensile_strength=glue, normal_stiffness=KN, shear_stiffness=KN)
    made = lm.Assembly.from_polyhedra(solids, joint=joint, density=density, fixed=[0])
    return made.with_material(lm.Material(young_modulus=E, poisson_ratio=poisson, density=density))


def end_of(curve, block, point):
    """Way of a point from the first sample to the last [m]."""
    way = curve.displacement_of(block, point)
    return way[-1] - way[0]


@pytest.mark.parametrize("blocks", [SIMPLY_DEFORMABLE, RITZ])
@pytest.mark.parametrize("spread", [False, True])
def test_a_bar_pressed_at_its_end_shortens_by_its_whole_length(blocks, spread):
    """F L / (E A) + F / (kn A), by a force and by a pressure on its top; it was half of the first."""
    wall, force = bar(), 1e3
    loads = lm.Loads.weight(wall)
    if spread:
        loads = loads.with_pressure(wall, 1, pressure=force / AREA, case="live")
    else:
        loads = loads.with_point_load(wall, 1, (0, 0, -force), at=TOP)
    curve = lm.pushover(wall, loads, to=-1e-7, control=(1, "z"), blocks=blocks, contact_model="lobatto")
    exact = curve.load[-1] * force * (HEIGHT / (E * AREA) + 1.0 / (KN * AREA))
    assert end_of(curve, 1, TOP)[2] == pytest.approx(-exact, rel=1e-5)
    assert all(c.accepted for c in curve.certificates)
    # the force itself is spread over the block: polynomials make its pressure fall along it from 1.5 F to F / 2
    middle = {SIMPLY_DEFORMABLE: 0.5, RITZ: 0.625}[blocks]
    reach = lm.elastic_range(wall, loads, blocks=blocks, contact_model="lobatto")
    exact = force * (middle * HEIGHT / (E * AREA) + 1.0 / (KN * AREA))
    assert reach.shift_live[1, 2] == pytest.approx(-exact, rel=1e-9)


def test_a_bar_in_the_dem_does_the_same():
    wall, force = bar(density=1e-3), 1e3
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -force), at=TOP, case="dead")
    state = dem.initial_state(wall, loads, blocks=SIMPLY_DEFORMABLE, contact_points=(4, 4))
    for _ in range(20):
        run_constant(state, loads.rows("dead"), 500, dem.Damping(local=0.8))
    gradient = np.einsum("k,kij->ij", state.modes.value[1], state.modes.gradient[1])
    end = state.bodies.shift[1] + (state.bodies.rot[1] + gradient) @ (TOP - wall.centroids[1])
    assert end[2] == pytest.approx(-force * (HEIGHT / (E * AREA) + 1.0 / (KN * AREA)), rel=1e-5)
    assert state.stresses.mean[1, 2, 2] == pytest.approx(-force / AREA, rel=1e-5)


@pytest.mark.parametrize(("blocks", "wanted"), [(SIMPLY_DEFORMABLE, 5e-3), (RITZ, 1.5e-2)])
def test_a_cantilever_of_four_blocks_bends_as_timoshenkos_beam(blocks, wanted):
    """Force across the tip; without strain by the load it is 1.1 and 1.8 % short, of two blocks more."""
    wall = bar(4, poisson=0.2)
    loads = lm.Loads.weight(wall).with_point_load(wall, 4, (1.0, 0, 0), at=TOP)
    curve = lm.pushover(wall, loads, to=1e-7, control=(4, "x"), blocks=blocks, contact_model="lobatto")
    inertia, shear = DEPTH * WIDTH**3 / 12, E / 2.4 * AREA * 5.0 / 6.0
    joints = sum((HEIGHT - z) ** 2 for z in (0.0, 0.25, 0.5, 0.75)) / (KN * inertia) + 4 / (KN * AREA)
    exact = curve.load[-1] * (HEIGHT**3 / (3 * E * inertia) + HEIGHT / shear + joints)
    assert end_of(curve, 4, TOP)[0] == pytest.approx(exact, rel=wanted)


@pytest.mark.slow
def test_the_dem_follows_the_path_of_a_bar_pushed_aside_at_its_top():
    """Finite rotation and strain: rocking under weight on its top, on the same points."""
    wall = bar(glue=0.0)
    wall = wall.with_material(lm.Material(young_modulus=2e7, poisson_ratio=0.2, density=2000.0))
    weight = wall.weights[1]
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -2.0 * weight), at=TOP, case="dead")
    live = loads.with_point_load(wall, 1, (weight, 0.0, 0.0), at=TOP)
    options = {"contact_model": "vertices", "blocks": SIMPLY_DEFORMABLE, "stress": "plane stress"}
    curve = lm.pushover(wall, live, to=0.02, **options)
    assert all(c.accepted for c in curve.certificates)
    assert np.abs(curve.errors["energy"]).max() < 5e-3  # trapezoids over steps in which the joint opens
    for part in (0.3, 0.8):
        load = part * max(curve.load)
        state = dem.initial_state(wall, loads, **options)
        both = np.stack([live.rows("dead"), live.rows("live")])
        # slowly, as on the path: where the joint opens points slip, and what is left of the shear hangs on the way
        pushes = np.repeat([0.0, *np.linspace(0.0, load, 2000), load], [5000, *[10] * 2000, 10000])
        run(state, both, np.column_stack([np.ones_like(pushes), pushes]), dem.Damping(local=0.8))
        there = lm.pushover(wall, live, to=state.bodies.shift[1, 0], **options)
        assert there.load[-1] == pytest.approx(load, rel=5e-3)
        assert there.states[-1].shift[1, 2] == pytest.approx(state.bodies.shift[1, 2], rel=1e-3)


@pytest.mark.exact
def test_work_in_flight_is_that_of_the_point_of_the_load():
    """f . dx with x = R (1 + G) r, to second order of the step, while the block turns, strains and swings."""
    wall = bar(poisson=0.2, glue=0.0, density=2000.0)
    force, at = np.array((3e4, -2e4, 5e4)), np.array((0.1, 0.25, 0.9))
    wall = wall.with_material(lm.Material(young_modulus=1e7, poisson_ratio=0.2, density=2000.0))
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, force, at=at, case="dead")
    arm, errors = at - wall.centroids[1], []

    def point(state):
        gradient = np.einsum("k,kij->ij", state.modes.value[1], state.modes.gradient[1])
        turn = state.bodies.rot[1] + np.eye(3)
        return state.bodies.shift[1] + turn @ (arm + gradient @ arm) - arm

    for dt in (2e-5, 1e-5):
        state = dem.initial_state(
            wall, loads, mode="dynamic", dt=dt, joint_options=dem.JointOptions(dashpot=0.0), blocks=SIMPLY_DEFORMABLE
        )
        state.bodies.shift[1, 2] = 3.0
        state.bodies.ang[1] = np.linalg.solve(state.bodies.inv_inertia[1], (0.0, 8.0, 0.0))
        run_constant(state, loads.rows("dead"), 1, dem.Damping())
        begun, fallen, work = point(state), state.bodies.shift[1, 2], state.total[E_APPLIED]
        run_constant(state, loads.rows("dead"), round(0.05 / dt), dem.Damping())
        exact = force @ (point(state) - begun) - wall.weights[1] * (state.bodies.shift[1, 2] - fallen)
        errors.append(abs(state.total[E_APPLIED] - work - exact))
        assert np.abs(state.modes.value[1]).max() > 1e-4
    assert errors[0] < 2e-3 * abs(force @ (point(state) - begun))
    assert errors[1] < 0.7 * errors[0]


@pytest.mark.exact
@pytest.mark.parametrize("matrix", [np.diag((-1.0, 1.0, 1.0)), rotation_matrices((0.3, -0.5, 0.8))])
def test_turned_and_mirrored_copies_strain_alike(matrix):
    wall, at = bar(2, poisson=0.2), (0.1, 0.15, 0.9)
    loads = lm.Loads.weight(wall).with_point_load(wall, 2, (2e2, 0, -1e3), at=at)
    options = {"to": 1e-6, "blocks": SIMPLY_DEFORMABLE}
    one = lm.pushover(wall, loads, **options)
    two = lm.pushover(wall.transformed(matrix), loads.transformed(matrix), **options)
    assert two.load[-1] == pytest.approx(one.load[-1], rel=1e-9)
    assert end_of(two, 2, matrix @ at) == pytest.approx(matrix @ end_of(one, 2, at), rel=1e-8, abs=1e-15)


@pytest.mark.exact
def test_the_tangent_of_loads_on_shapes_is_the_derivative_of_their_forces():
    """Of spins, at any turn, and of coordinates of shapes of any gradient."""
    rng = np.random.default_rng(3)
    wall = bar()
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (1e3, -2e3, 5e2), at=(0.1, 0.05, 0.8), case="dead")
    loads = loads.with_point_load(wall, 1, (-4e2, 1e3, 2e3), at=(0.3, 0.2, 0.4))
    gradients, q, h = rng.normal(size=(2, 2, 3, 3)), 0.1 * rng.normal(size=(2, 2)), 1e-6
    path = PathLoads.of(loads, np.eye(8), np.ones((2, 8), bool), gradients)
    turn = rotation_matrices((0.3, -0.5, 0.8))

    def force(by):
        turned = np.zeros((2, 3, 3))
        turned[1] = rotation_matrices(tuple(by[3:6])) @ turn - np.eye(3)
        dead, live = path.at(Pose(np.zeros((2, 3)), turned, q + by[6:]))
        return (dead + 0.7 * live)[1]

    differences = np.column_stack([(force(h * d) - force(-h * d)) / (2 * h) for d in np.eye(8)])
    turned = np.stack([np.zeros((3, 3)), turn - np.eye(3)])
    assert path.load_tangent(Pose(np.zeros((2, 3)), turned, q), 0.7)[0] == pytest.approx(differences, abs=1e-4)


def test_forces_on_shapes_that_are_held_are_no_loads():
    wall = bar(blocks=2)
    loads = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -1e3), at=TOP, case="live")
    loads = loads.with_point_load(wall, 2, (0, 0, -1e3), at=TOP, case="dead")
    free = np.ones((3, 7), dtype=bool)
    free[0], free[1, 6] = False, False  # of block 1 the one shape is held, block 2 has a free one
    gradients = np.zeros((3, 1, 3, 3))
    gradients[:, 0, 2, 2] = 1.0
    path = PathLoads.of(loads, np.eye(7), free, gradients)
    assert list(path.turning) == [1, 2]
    assert path.live[1, 6] == 0.0
    assert path.dead[2, 6] != 0.0
    for wrench in (path.dead, path.live, *path.at(Pose(np.zeros((3, 3)), np.zeros((3, 3, 3)), np.zeros((3, 1))))):
        assert not wrench[~free].any()


def test_forces_that_cancel_on_a_block_press_it_and_its_joints():
    """The sum of both by themselves; no block is moved, and rigid ones do not feel them."""
    wall, force = bar(poisson=0.3), np.array((1e3, 0.0, 0.0))
    low = 0.1 * HEIGHT
    sides = [((0.0, 0.5 * DEPTH, low), force), ((WIDTH, 0.5 * DEPTH, low), -force)]
    options = {"blocks": RITZ, "stress": "solid", "contact_model": "lobatto"}
    own = lm.Loads(lm.Loads.weight(wall).dead, np.zeros((2, 6)))
    apart = [lm.elastic_range(wall, own.with_point_load(wall, 1, f, at=x), **options) for x, f in sides]
    pressed = own
    for x, f in sides:
        pressed = pressed.with_point_load(wall, 1, f, at=x)
    found = lm.elastic_range(wall, pressed, **options)
    size = np.abs(found.live).max()
    assert size > 1.0
    assert found.live == pytest.approx(apart[0].live + apart[1].live, abs=1e-6 * size)
    # the joint of a simply deformable block stays plane as it is pressed: no load opens it
    plane = lm.elastic_range(wall, pressed, **{**options, "blocks": SIMPLY_DEFORMABLE})
    assert plane.low is None
    assert plane.high is None
    with pytest.raises(lm.errors.InputError, match="no live load acts on a free block"):
        lm.elastic_range(wall, pressed)
