"""Blocks of zones in space and their joints against closed forms: series, beams, strength, dilation, energy, rigid."""

import numpy as np
import pytest
from linear import solution
from scipy.spatial.transform import Rotation

import dem
import limitmason as lm
from dem.zones import running
from dem.zones.model import make_model, set_loads
from dem.zones.stable import freedoms, stiffness
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS, SOLID, STATES
from limitmason.errors import InputError
from limitmason.geometry import box

E, NU, KN, KS = 16.7e9, 0.15, 82e9, 36e9
BRICK = lm.Material(young_modulus=E, poisson_ratio=NU, density=2000.0)


def stack(n, joint, width=0.2, height=0.1, material=BRICK, thickness=0.1):
    """A held block and n blocks on it, the last of them rigid."""
    outlines = [[(0, k * height), (width, k * height), (width, (k + 1) * height), (0, (k + 1) * height)]
                for k in range(-1, n)]  # fmt: skip
    made = lm.Assembly.from_polygons(outlines, thickness=thickness, joint=joint, fixed=[0])
    return made.with_material(material)


def bonded(kn=KN, ks=KS, **more):
    return lm.Joint(40.0, normal_stiffness=kn, shear_stiffness=ks, cohesion=1e9, tensile_strength=1e9, **more)


def pressed(assembly, force, **options):
    """Model under a dead force on the middle of the last block, without weight."""
    dead = np.zeros((assembly.n_blocks, 6))
    dead[-1, :3] = force
    loads = lm.Loads(dead, np.zeros_like(dead))
    options = {"zone_size": 0.05, "plane": "solid"} | options
    return make_model(assembly, loads, stiff=[assembly.n_blocks - 1], **options)


def test_brick_joint_brick_is_springs_in_series():
    # free to widen: smooth joints (ks as good as none) so that no friction holds the bricks' ends
    joint = lm.Joint(0.0, normal_stiffness=KN, shear_stiffness=1e3)
    model = pressed(stack(3, joint), (0, 0, -1e3), zone_size=0.1)
    assert running.settle(model, 1e-9)
    exact = 1e3 / 0.02 * (3 / KN + 2 * 0.1 / E)
    assert -model.rigid.shift[1, 2] == pytest.approx(exact, rel=1e-6)  # change of geometry is of the order of 1e-6
    stress = running.read(model).stress
    assert np.abs(stress[..., 2] / (-1e3 / 0.02) - 1).max() < 1e-5
    assert abs(running.energy_error(model)) < 1e-8


@pytest.mark.parametrize("points", [None, (3, 3)])
def test_uniform_pressure_crosses_a_joint_of_unlike_meshes_evenly(points):
    # without Poisson's effect the state is uniform; the areas of the rigid DEM's grid are not those zones ask for
    still = lm.Material(young_modulus=E, poisson_ratio=0.0, density=2000.0)
    outlines = [[(0, -0.1), (0.2, -0.1), (0.2, 0), (0, 0)], [(0, 0), (0.2, 0), (0.2, 0.1), (0, 0.1)],
                [(0, 0.1), (0.1, 0.1), (0.1, 0.25), (0, 0.25)], [(0.1, 0.1), (0.2, 0.1), (0.2, 0.25), (0.1, 0.25)],
                [(0, 0.25), (0.2, 0.25), (0.2, 0.35), (0, 0.35)]]  # fmt: skip
    wall = lm.Assembly.from_polygons(outlines, thickness=0.1, joint=bonded(), fixed=[0]).with_material(still)
    model = pressed(wall, (0, 0, -1e3), contact_points=points)
    assert running.settle(model, 1e-8)
    now = running.read(model)
    stress = now.stress[..., 2]
    assert stress.mean() == pytest.approx(-1e3 / 0.02, rel=1e-5)
    if points is None:
        assert np.abs(stress / (-1e3 / 0.02) - 1).max() < 1e-6
    bed = np.abs(np.array([i.normal[2] for i in wall.interfaces]))[model.interface[model.contacts.joint]] > 0.5
    assert (now.normal * model.contacts.area)[bed].sum() == pytest.approx(3 * 1e3, rel=1e-7)


@pytest.mark.slow
def test_bonded_cantilever_of_four_blocks_is_timoshenkos_beam_across_both_axes():
    # joints ten times as stiff as the blocks; pulled along y and along z at once
    length, depth, n, force = 0.8, 0.1, 4, 100.0
    h = length / n
    outlines = [[(h * k, 0), (h * (k + 1), 0), (h * (k + 1), depth), (h * k, depth)] for k in range(-1, n)]
    outlines.append([(length, 0), (length + 0.1, 0), (length + 0.1, depth), (length, depth)])
    kn, ks = 10.0 * E / h, 4.0 * E / h
    beam = lm.Assembly.from_polygons(outlines, thickness=depth, joint=bonded(kn, ks), fixed=[0]).with_material(BRICK)
    model = pressed(beam, (0.0, force, -2.0 * force), zone_size=0.05)
    assert running.settle(model, 1e-6)
    # the force acts at the middle of the rigid end piece, 0.05 beyond the bricks: a force and a moment on their end
    inertia, area, arm = depth**4 / 12.0, depth**2, 0.05
    at = arm + length
    factor = 10 * (1 + NU) / (12 + 11 * NU)  # Cowper 1966, rectangle
    exact = force * ((at**3 - arm**3) / 3 / (E * inertia) + length * 2 * (1 + NU) / (factor * E * area))
    # with a trapezoid rule the second moment of 3 points is 1.5 times that of the face
    lever = at - h * np.arange(n + 1)
    exact += (force * lever**2 / (kn * 1.5 * inertia) + force / (ks * area)).sum()
    assert model.rigid.shift[1, 1] == pytest.approx(exact, rel=0.02)
    assert model.rigid.shift[1, 2] == pytest.approx(-2.0 * exact, rel=0.02)


def slid(joint, travel, steps, direction=(0.8, 0.6), pressure=0.5e6):
    """A zoned block on a held one under a rigid plate driven obliquely: shear stress and place of the plate."""
    outlines = [[(0, a), (0.2, a), (0.2, b), (0, b)] for a, b in ((-0.1, 0), (0, 0.05), (0.05, 0.07))]
    made = lm.Assembly.from_polygons(
        outlines, thickness=0.1, joint=bonded(), joints={("block-0", "block-1"): joint}, fixed=[0]
    ).with_material(BRICK)
    area = 0.02
    model = pressed(made, (0, 0, -pressure * area))
    assert running.settle(model, 1e-6)
    start = model.rigid.shift[1].copy()
    velocity, held = np.zeros((2, 6)), np.array([[True] * 6, [True, True, False, True, True, True]])
    velocity[1, :2] = np.array(direction) * travel / steps
    running.drive(model, velocity, held)
    shear, moved = [], []
    for _ in range(40):
        running.advance(model, steps // 40, drifts=True)
        shear.append(-model.rigid.total[1, :2] / (steps // 40) / area)
        moved.append(model.rigid.shift[1] - start)
    return np.array(shear), np.array(moved), model


@pytest.mark.slow
def test_brittle_joint_shears_obliquely_at_its_peak_then_at_its_residual_strength():
    joint = lm.Joint(
        35.0, cohesion=0.3e6, tensile_strength=0.1e6, residual_cohesion=0.0, residual_tensile_strength=0.0,
        normal_stiffness=KN, shear_stiffness=KS,
    )  # fmt: skip
    shear, _, model = slid(joint, 3e-4, 24_000)
    friction = 0.5e6 * np.tan(np.deg2rad(35))
    assert np.linalg.norm(shear, axis=1).max() < (0.3e6 + friction) * 1.005
    # against the motion, once the points have forgotten how they were sheared before
    assert shear[-1] == pytest.approx(friction * np.array([0.8, 0.6]), rel=1e-4)
    assert abs(running.energy_error(model)) < 0.01


def test_plastic_joint_carries_c_plus_sigma_tan_phi_and_rises_by_tan_psi():
    joint = lm.Joint(
        35.0, cohesion=0.3e6, tensile_strength=0.1e6, dilatancy_angle_deg=10.0, normal_stiffness=KN, shear_stiffness=KS
    )
    shear, moved, _ = slid(joint, 2e-4, 16_000)
    assert np.linalg.norm(shear[-1]) == pytest.approx(0.3e6 + 0.5e6 * np.tan(np.deg2rad(35)), rel=1e-4)
    slope = (moved[-1, 2] - moved[20, 2]) / np.linalg.norm(moved[-1, :2] - moved[20, :2])
    assert slope == pytest.approx(np.tan(np.deg2rad(10.0)), rel=2e-3)


@pytest.mark.parametrize("angle", [0.0, 0.6])
def test_points_that_slide_from_facet_to_facet_keep_their_friction(angle):
    # 90 mm over zones of 50 mm; the block that slides is rigid, the slab under it is cut
    solids = [
        box((0, 0, -0.1), (0.3, 0.25, 0)), box((0, 0, 0), (0.3, 0.25, 0.05)),
        box((0.03, 0.02, 0.05), (0.13, 0.12, 0.1)),
    ]  # fmt: skip
    joint = lm.Joint(30.0, normal_stiffness=1e10, shear_stiffness=1e10)
    made = lm.Assembly.from_polyhedra(solids, joint=joint, joints={("block-0", "block-1"): bonded()}, fixed=[0])
    turn = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    model = pressed(made.with_material(BRICK).transformed(turn), (0.0, 0.0, -1e3))
    assert running.settle(model, 1e-6)
    under, start = model.contacts.facet.copy(), model.rigid.shift[1, :2].copy()
    steps, travel = 8000, turn @ (0.072, 0.054, 0.0)
    velocity, held = np.zeros((2, 6)), np.array([[True] * 6, [True, True, False, True, True, True]])
    velocity[1, :3] = travel / steps
    running.drive(model, velocity, held)
    for part in range(20):
        running.advance(model, steps // 20, drifts=True)
        if part:
            force = -model.rigid.total[1, :2] / (steps // 20)
            assert force == pytest.approx(1e3 * np.tan(np.deg2rad(30)) * travel[:2] / 0.09, rel=2e-3, abs=0.3)
    points = model.contacts.joint == 1
    assert (model.contacts.facet != under)[points].all()
    slip = np.linalg.norm(running.read(model).slip[points], axis=1)
    assert slip == pytest.approx(0.09, rel=1e-4)  # less the shear of the slab
    assert model.rigid.shift[1, :2] - start == pytest.approx(travel[:2], rel=1e-12)
    # what it is pressed into the joint and the slab, whatever facet it lies on
    assert 1e-5 < -model.rigid.shift[1, 2] < 1.1e-5


def corner(joint, scale=1.0):
    """A corner of two short walls in running bond, pushed out of both planes by a force on its last block."""
    wall = lm.build.wall(length=0.4, courses=3, unit=(0.2, 0.1, 0.1), joint=joint, plan="L", return_length=0.4)
    dead = np.zeros((wall.n_blocks, 6))
    dead[:, 2] = -wall.weights
    dead[-1, :2] = 20.0, 10.0
    return wall, lm.Loads(scale * dead, 0 * dead)


def solved(model):
    """Linear static displacements of all nodes under the loads, joints closed, shape (n, d)."""
    reach = freedoms(model)
    load = np.concatenate([model.nodes.load[model.nodes.body < 0].ravel(), model.rigid.load[~model.rigid.held]])
    u = solution(reach.T @ stiffness(model) @ reach, load)
    return (reach @ u).reshape(model.nodes.place.shape)


@pytest.mark.slow
def test_explicit_rest_state_of_a_corner_is_the_static_solution():
    wall, loads = corner(bonded(1e10, 4e9))
    model = make_model(wall.with_material(BRICK), loads, zone_size=0.1, plane="solid")
    exact = solved(model)
    assert running.settle(model, 1e-8)
    # its change of geometry is of the order of the displacements over the blocks
    assert np.abs(model.nodes.shift - exact).max() < 1e-4 * np.abs(exact).max()
    assert abs(running.energy_error(model)) < 1e-6


@pytest.mark.slow
def test_ever_stiffer_zones_return_the_rigid_dem_on_a_corner():
    wall, loads = corner(bonded(1e9, 4e8), 1e-4)
    rigid = dem.simulate(wall, dem.Settle(tolerance=1e-10), loads=loads, contact_points=(3, 3))
    exact, gaps = rigid.state.bodies.shift[1:], []
    for modulus in (1e12, 1e14):
        stiff = wall.with_material(lm.Material(young_modulus=modulus, poisson_ratio=0.2))
        model = make_model(stiff, loads, zone_size=0.1, contact_points=(3, 3), plane="solid")
        u = solved(model)
        # the mean over the nodes is the centroid's motion in a block that does not strain
        seen = np.array([u[model.mesh.block == b].mean(axis=0) for b in range(1, wall.n_blocks)])
        gaps.append(np.abs(seen - exact).max() / np.abs(exact).max())
    assert gaps[1] < 1e-4
    assert gaps[0] / gaps[1] == pytest.approx(100.0, rel=0.1)


@pytest.mark.slow
def test_zones_and_simple_blocks_are_equally_stiff_on_a_corner():
    wall, loads = corner(bonded(8.2e9, 3.6e9))
    dead = loads.dead.copy()
    dead[:, 2] = 0.0
    loads = lm.Loads(dead, 0 * dead)
    wall = wall.with_material(BRICK)
    rest, options = dem.Settle(tolerance=1e-8), {"loads": loads, "contact_points": (3, 3)}
    simple = dem.simulate(wall, rest, blocks="simply deformable", **options)
    rigid = dem.simulate(wall, rest, **options)
    far, near = (float(dead[-1, :3] @ run.state.bodies.shift[-1]) for run in (simple, rigid))
    assert near < 0.95 * far  # what the blocks give way is there to be compared
    for size in (0.1, 0.05):
        model = make_model(wall, loads, zone_size=size, contact_points=(3, 3), plane="solid")
        work = float((model.nodes.load * solved(model)).sum())
        assert work == pytest.approx(far, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("poisson", [0.0, 0.2])
def test_a_wall_in_space_lies_between_plane_stress_and_plane_strain(poisson):
    # voussoirs of an arch and a gable of three corners too; without Poisson's effect all three are one
    made_of = lm.Material(young_modulus=E, poisson_ratio=poisson, density=2000.0)
    gable = [[(0, -0.1), (0.3, -0.1), (0.3, 0), (0, 0)], [(0, 0), (0.3, 0), (0.1, 0.2)]]
    walls = (
        lm.build.wall(length=0.6, courses=3, unit=(0.2, 0.1, 0.1), joint=bonded()),
        lm.build.arch(thickness=0.2, width=0.3, voussoirs=7, radius=1.0, joint=bonded()),
        lm.Assembly.from_polygons(gable, thickness=0.1, joint=bonded(), fixed=[0]),
    )
    for wall, size in zip(walls, (0.05, 0.1, 0.1), strict=True):
        wall = wall.with_material(made_of)
        loads, works = lm.Loads.weight(wall), {}
        for plane in STATES:
            model = make_model(wall, loads, zone_size=size, plane=plane)
            works[plane] = float((model.nodes.load * solved(model)).sum())
        low, high = works[PLANE_STRAIN] * (1 - 5e-6), works[PLANE_STRESS] * (1 + 5e-6)
        assert low < works[SOLID] < high
        assert high / low < (1.03 if poisson else 1.00002)


@pytest.mark.slow
def test_a_corner_turned_and_renumbered_stores_the_same_energy():
    wall = lm.build.wall(length=0.4, courses=3, unit=(0.2, 0.1, 0.1), joint=bonded(), plan="L", return_length=0.4)
    wall = wall.with_material(BRICK)
    turn = Rotation.from_rotvec(np.deg2rad(30.0) * np.array([2.0, -1.0, 2.0]) / 3.0).as_matrix()
    order = np.random.default_rng(1).permutation(wall.n_blocks)
    other = wall.renumbered(order).transformed(turn)
    energies = []
    for model_of, numbers in ((wall, np.arange(wall.n_blocks)), (other, order)):
        dead = np.zeros((wall.n_blocks, 6))
        dead[:, 2] = -wall.weights[numbers]
        if model_of is other:
            dead[:, :3] = dead[:, :3] @ turn.T
        model = make_model(model_of, lm.Loads(dead, 0 * dead), zone_size=0.1, plane="solid")
        assert running.settle(model, 1e-8)
        energies.append(running.read(model).energy)
    assert energies[1] == pytest.approx(energies[0], rel=1e-6)


def test_loads_of_a_block_reach_its_nodes_with_their_moment():
    assembly = stack(2, bonded())
    model = make_model(assembly, lm.Loads.weight(assembly), zone_size=0.05, plane="solid")
    wrench = np.zeros((assembly.n_blocks, 6))
    wrench[1] = 3.0, 2.0, -5.0, 0.4, 0.7, -0.3
    set_loads(model, wrench)
    own = model.mesh.block == 1
    f, r = model.nodes.load[own], model.nodes.place[own] - assembly.centroids[1]
    assert f.sum(axis=0) == pytest.approx(wrench[1, :3], rel=1e-12)
    assert np.cross(r, f).sum(axis=0) == pytest.approx(wrench[1, 3:], rel=1e-12)


def test_what_cannot_be_zoned_in_space_is_refused_by_name():
    wall = lm.build.wall(length=0.6, courses=2, unit=(0.2, 0.1, 0.1), joint=bonded())
    loads = lm.Loads.weight(wall)
    with pytest.raises(InputError, match="no block has a material"):
        make_model(wall, loads, zone_size=0.05, plane="solid")
    zoned = wall.with_material(BRICK)
    with pytest.raises(InputError, match=r"zone_size = 0.15 m is larger than the shortest edge of block"):
        make_model(zoned, loads, zone_size=0.15, plane="solid")
    with pytest.raises(InputError, match=r"into 1.2e\+07 zones or more"):
        make_model(zoned, loads, zone_size=1e-3, plane="solid")
    strong = lm.Material(young_modulus=E, poisson_ratio=NU, density=2000.0, cohesion=1e5, friction_angle_deg=40.0)
    with pytest.raises(InputError, match="zones in space are elastic"):
        make_model(wall.with_material(strong), loads, zone_size=0.1, plane="solid")
