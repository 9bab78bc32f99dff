"""Zoned blocks and their joints against closed forms: series, strength, dilation, energy, the rigid limit."""

import math

import numpy as np
import pytest
from zone_bodies import energy_error

import dem
import limitmason as lm
from dem.kernels.zone_motion import _net
from dem.zones import running
from dem.zones.assemble_zones import make_model, set_loads
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS
from limitmason.errors import InputError

E, NU, KN, KS = 16.7e9, 0.15, 82e9, 36e9
BRICK = lm.Material(young_modulus=E, poisson_ratio=NU, density=2000.0)


def box(x0, x1, z0, z1):
    return [(x0, z0), (x1, z0), (x1, z1), (x0, z1)]


def stack(n, joint, width=0.2, height=0.1, material=BRICK, thickness=0.1):
    """A held block and n blocks on it, the last of them rigid."""
    outlines = [box(0, width, k * height, (k + 1) * height) for k in range(-1, n)]
    made = lm.Assembly.from_polygons(outlines, thickness=thickness, joint=joint, fixed=[0])
    return made.with_material(material)


def elastic(phi=40.0, **more):
    return lm.Joint(phi, normal_stiffness=KN, shear_stiffness=KS, cohesion=1e9, tensile_strength=1e9, **more)


def pressed(assembly, force, **options):
    """Model under a dead force on the middle of the last block, without weight."""
    dead = np.zeros((assembly.n_blocks, 6))
    dead[-1, 2] = -force
    loads = lm.Loads(dead, np.zeros_like(dead))
    return make_model(assembly, loads, stiff=[assembly.n_blocks - 1], **options)


def reaction(model, block=-1):
    """Force that holds a rigid block, x and z, mean of the last call's steps [N]."""
    return -model.rigid.net[block]


@pytest.mark.parametrize("plane, stiff", [(PLANE_STRESS, E), (PLANE_STRAIN, E / (1 - NU**2))])
def test_brick_joint_brick_is_springs_in_series(plane, stiff):
    # free to widen: smooth joints (ks as good as none) so that no friction holds the bricks' ends
    joint = lm.Joint(0.0, normal_stiffness=KN, shear_stiffness=1.0)
    model = pressed(stack(4, joint), 1e3, zone_size=0.05, plane=plane)
    assert running.settle(model, 1e-8)
    area, height = 0.2 * 0.1, 0.1
    exact = 1e3 / area * (4 / KN + 3 * height / stiff)
    assert -model.rigid.shift[1, 1] == pytest.approx(exact, rel=1e-5)  # change of geometry is of the order of 1e-6


@pytest.mark.parametrize("points", [None, 3, 5])
def test_uniform_pressure_crosses_a_joint_evenly(points):
    # without Poisson's effect the state is uniform; the areas of the rigid DEM's grid are not those zones ask for
    still = lm.Material(young_modulus=E, poisson_ratio=0.0, density=2000.0)
    model = pressed(stack(3, elastic(), material=still), 1e3, zone_size=0.05, contact_points=points and (points, 2))
    assert running.settle(model, 1e-8)
    stress = running.read(model).stress[..., 1]
    assert stress.mean() == pytest.approx(-1e3 / 0.02, rel=1e-5)
    if points is None:
        assert np.abs(stress / (-1e3 / 0.02) - 1).max() < 1e-6
    seen = running.read(model).normal @ model.contacts.area
    assert seen == pytest.approx(3 * 1e3, rel=1e-7)


def sheared(joint, travel, steps, pressure=0.5e6, plane=PLANE_STRESS, material=BRICK):
    """A held block, a zoned one and a rigid plate driven sideways: shear stress and place of the plate by travel."""
    plate = lm.Assembly.from_polygons(
        [box(0, 0.2, -0.1, 0), box(0, 0.2, 0, 0.05), box(0, 0.2, 0.05, 0.07)], thickness=0.1,
        joint=elastic(80.0), joints={("block-0", "block-1"): joint}, fixed=[0],
    ).with_material(material)
    model = pressed(plate, pressure * 0.02, zone_size=0.05, plane=plane)
    assert running.settle(model, 1e-6)
    start = model.rigid.shift[1].copy()
    held = np.array([[True] * 3, [True, False, True]])
    running.drive(model, np.array([[0.0] * 3, [travel / steps, 0.0, 0.0]]), held)
    shear, moved = [], []
    for _ in range(100):
        running.advance(model, steps // 100)
        shear.append(-model.rigid.total[1, 0] / (steps // 100) / 0.02)
        moved.append(model.rigid.shift[1] - start)
    return np.array(shear), np.array(moved), model


def test_joint_shears_at_its_peak_then_at_its_residual_strength():
    joint = lm.Joint(
        35.0, cohesion=0.3e6, tensile_strength=0.1e6, residual_cohesion=0.0, residual_tensile_strength=0.0,
        normal_stiffness=KN, shear_stiffness=KS,
    )
    shear, _, _ = sheared(joint, 1e-4, 40_000)
    friction = 0.5e6 * np.tan(np.deg2rad(35))
    # points fail one after the other where stresses are uneven: the whole face at once only in the mean
    assert shear.max() < (0.3e6 + friction) * 1.005
    assert shear[-1] == pytest.approx(friction, rel=1e-3)


def test_plastic_joint_carries_c_plus_sigma_tan_phi():
    joint = lm.Joint(35.0, cohesion=0.3e6, tensile_strength=0.1e6, normal_stiffness=KN, shear_stiffness=KS)
    shear, _, _ = sheared(joint, 1e-4, 40_000)
    assert shear[-1] == pytest.approx(0.3e6 + 0.5e6 * np.tan(np.deg2rad(35)), rel=5e-3)


def test_sliding_joint_rises_by_tan_psi():
    joint = lm.Joint(35.0, dilatancy_angle_deg=10.0, normal_stiffness=KN, shear_stiffness=KS)
    _, moved, _ = sheared(joint, 4e-4, 40_000)
    slope = (moved[-1, 1] - moved[50, 1]) / (moved[-1, 0] - moved[50, 0])
    assert slope == pytest.approx(np.tan(np.deg2rad(10.0)), rel=0.01)


def test_energies_balance_with_yielding_zones_and_sliding_brittle_joints():
    soft = lm.Material(
        young_modulus=1e9, poisson_ratio=0.2, density=2000.0, cohesion=0.15e6, friction_angle_deg=30.0,
        dilatancy_angle_deg=10.0, tensile_strength=0.1e6,
    )
    joint = lm.Joint(
        20.0, cohesion=0.1e6, tensile_strength=0.1e6, residual_cohesion=0.0, normal_stiffness=KN, shear_stiffness=KS,
    )
    _, _, model = sheared(joint, 2e-3, 40_000, material=soft, plane=PLANE_STRAIN)
    assert (model.zones.flag > 0).any()
    assert model.total[2] > 0.0  # friction
    assert model.total[4] > 0.0  # yielding
    assert abs(energy_error(model)) < 0.01


def test_a_model_turned_and_renumbered_gives_the_same_forces():
    # gravity turned with the model, as a dead force
    wall = lm.build.wall(length=0.6, courses=3, unit=(0.2, 0.1, 0.1), joint=elastic()).with_material(BRICK)
    angle = np.deg2rad(30.0)
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    order = np.random.default_rng(1).permutation(wall.n_blocks)
    other = wall.renumbered(order).transformed(turn)
    energies = []
    for model_of, numbers in ((wall, np.arange(wall.n_blocks)), (other, order)):
        dead = np.zeros((wall.n_blocks, 6))
        dead[:, 2] = -wall.weights[numbers]
        if model_of is other:
            dead[:, :3] = dead[:, :3] @ turn.T
        model = make_model(model_of, lm.Loads(dead, np.zeros_like(dead)), zone_size=0.05)
        assert running.settle(model, 1e-8)
        energies.append(running.read(model).energy)
    assert energies[1] == pytest.approx(energies[0], rel=1e-6)


@pytest.mark.slow
def test_very_stiff_zones_return_the_rigid_dem():
    joint = lm.Joint(35.0, normal_stiffness=1e9, shear_stiffness=4e8, cohesion=1e7, tensile_strength=1e7)
    wall = lm.build.wall(length=0.6, courses=4, unit=(0.2, 0.1, 0.1), joint=joint)
    loads = lm.Loads.weight(wall)
    rigid = dem.simulate(wall, dem.Settle(tolerance=1e-8), loads=loads, contact_points=(5, 2))
    stiff = wall.with_material(lm.Material(young_modulus=1e12, poisson_ratio=0.2))
    model = make_model(stiff, loads, zone_size=0.1, contact_points=(5, 2))
    assert running.settle(model, 1e-7, 400_000)
    for block in range(1, wall.n_blocks):
        own = model.mesh.block == block
        u = model.nodes.shift[own].mean(axis=0)
        # mean of the nodes against the centroid of a block that turns by 1e-6: the same
        exact = rigid.state.bodies.shift[block][[0, 2]]
        assert u == pytest.approx(exact, rel=2e-3, abs=1e-3 * np.abs(rigid.shift).max())


def test_what_cannot_be_zoned_is_refused_by_name():
    wall = lm.build.wall(length=0.6, courses=2, unit=(0.2, 0.1, 0.1), joint=elastic())
    loads = lm.Loads.weight(wall)
    with pytest.raises(InputError, match="no block has a material"):
        make_model(wall, loads, zone_size=0.05)
    zoned = wall.with_material(BRICK)
    with pytest.raises(InputError, match=r"zone_size = 0.15 m is larger than the shortest side of block"):
        make_model(zoned, loads, zone_size=0.15)
    with pytest.raises(InputError, match="must be one of .plane stress"):
        make_model(zoned, loads, zone_size=0.05, plane="plain stress")
    with pytest.raises(InputError, match="out of the x-z plane"):
        make_model(zoned, lm.Loads.horizontal(zoned, (0, 1, 0)), zone_size=0.05)
    with pytest.raises(InputError, match="poisson_ratio"):
        lm.Material(young_modulus=1e9, poisson_ratio=0.5)


def test_loads_of_a_block_reach_its_nodes_with_their_moment():
    assembly = stack(2, elastic())
    model = make_model(assembly, lm.Loads.weight(assembly), zone_size=0.05)
    wrench = np.zeros((assembly.n_blocks, 6))
    wrench[1] = 3.0, 0.0, -5.0, 0.0, 0.7, 0.0
    set_loads(model, lm.Loads(wrench, 0.0 * wrench))
    own = model.mesh.block == 1
    f, r = model.nodes.load[own], model.nodes.place[own] - assembly.centroids[1][[0, 2]]
    assert f.sum(axis=0) == pytest.approx([3.0, -5.0], rel=1e-12)
    assert (r[:, 0] * f[:, 1] - r[:, 1] * f[:, 0]).sum() == pytest.approx(-0.7, rel=1e-12)


def test_points_of_loads_go_along_with_zones_and_with_rigid_blocks():
    """Nodes share f(x) with the sum of r f^T that the point has; the moment on a rigid block is R r x f."""
    assembly = stack(2, elastic())
    force, at = np.array((3.0, 0.0, -5.0)), assembly.centroids + np.array((0.04, 0.0, 0.03))
    loads = lm.Loads(np.zeros((assembly.n_blocks, 6)), np.zeros((assembly.n_blocks, 6)))
    for block in (1, 2):
        loads = loads.with_point_load(assembly, block, force, at=at[block], case="dead")
    model = make_model(assembly, loads, zone_size=0.05, stiff=[2])
    own, flat = model.mesh.block == 1, force[[0, 2]]
    r = model.nodes.place[own] - assembly.centroids[1][[0, 2]]
    assert r.T @ model.nodes.load[own] == pytest.approx(np.outer((0.04, 0.03), flat), abs=1e-12)
    (block,) = np.flatnonzero(~model.rigid.held.all(axis=1))
    model.rigid.shift[block, 2] = 0.4
    model.nodes.force[:] = 0.0
    _net(model.nodes, model.rigid)
    x, z = 0.04 * np.cos(0.4) - 0.03 * np.sin(0.4), 0.03 * np.cos(0.4) + 0.04 * np.sin(0.4)
    assert model.rigid.net[block] == pytest.approx((3.0, -5.0, x * flat[1] - z * flat[0]), rel=1e-9)
    # forces that balance and a moment that does not: over all that is applied, and the block's height of 0.1 m
    moment, model.rigid.net[block, :2] = model.rigid.net[block, 2], 0.0
    applied = np.linalg.norm(model.nodes.load, axis=1).sum() + math.hypot(3.0, 5.0)
    assert running.unbalance(model) == pytest.approx(abs(moment) / 0.1 / applied, rel=1e-9)
