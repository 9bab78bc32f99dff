"""Kinematics and return map of the capacity curve against differences, and against the DEM's law for small steps."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.capacity.contacts import first_contacts, turned_over
from limitmason.capacity.kinematics import (
    at_rest,
    block_wrenches,
    contact,
    geometric_stiffness,
    make_bodies,
    motion_between,
    moved,
    point_wrenches,
)
from limitmason.capacity.point_law import ElastoplasticLaw, PlasticHistory, return_map
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.equilibrium import equilibrium_matrix
from limitmason.mechanics.law import PointLaw, interface_law
from limitmason.mechanics.plane import find_plane


def contacts_of(wall, points, over=None):
    """The contacts of a wall's points; ``over`` turns the frames of some of them over to the other block."""
    one = np.ones(len(wall.interfaces))
    first = first_contacts(points, interface_law(wall.arrays), one, one)
    return first if over is None else turned_over(first, over)


@pytest.fixture
def turned():
    """Bodies of a small wall in space, in a pose with rotations of a fifth of a radian."""
    wall = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    points = contact_points(wall)
    rng = np.random.default_rng(1)
    bodies = make_bodies(wall, contacts_of(wall, points, rng.random(points.count) < 0.5), None)
    return wall, points, bodies, moved(at_rest(wall.n_blocks), 0.2 * rng.normal(size=(wall.n_blocks, 6)))


def test_the_wrench_matrix_of_the_reference_pose_is_that_of_limit_analysis():
    wall = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    loads = lm.Loads.horizontal(wall)
    for plane in (None, find_plane(wall, loads)):
        points = contact_points(wall, plane=plane)
        bodies = make_bodies(wall, contacts_of(wall, points), plane)
        force = np.random.default_rng(0).normal(size=(points.count, points.components))
        wrenches = point_wrenches(bodies, contact(bodies, at_rest(wall.n_blocks)))
        expected = equilibrium_matrix(wall, points, plane=plane) @ force.ravel()
        assert block_wrenches(bodies, wrenches, force).ravel() == pytest.approx(expected, abs=1e-12)


def test_a_frame_turned_over_changes_nothing_in_small_displacement():
    wall = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    points = contact_points(wall)
    motion = 1e-7 * np.random.default_rng(7).normal(size=(wall.n_blocks, 6))
    force = np.random.default_rng(8).normal(size=(points.count, 3))
    found = []
    for over in (None, np.random.default_rng(9).random(points.count) < 0.5):
        bodies = make_bodies(wall, contacts_of(wall, points, over), None)
        at = contact(bodies, moved(at_rest(wall.n_blocks), motion))
        found.append((at.displacement, block_wrenches(bodies, point_wrenches(bodies, at), force)))
    assert found[1][0] == pytest.approx(found[0][0], abs=1e-12)
    assert found[1][1] == pytest.approx(found[0][1], abs=1e-4)


def test_wrenches_are_the_transpose_of_the_derivative_of_the_displacement(turned):
    wall, _, bodies, pose = turned
    motion = np.random.default_rng(2).normal(size=(wall.n_blocks, 6))
    h = 1e-6
    ahead, behind = (contact(bodies, moved(pose, s * h * motion)).displacement for s in (1.0, -1.0))
    wrenches = point_wrenches(bodies, contact(bodies, pose))
    ends = np.stack([motion[bodies.block_a], motion[bodies.block_b]], axis=1)
    assert (ahead - behind) / (2 * h) == pytest.approx(np.einsum("mcsd,msd->mc", wrenches, ends), abs=1e-8)


def test_the_geometric_stiffness_is_the_derivative_of_the_wrenches(turned):
    wall, points, bodies, pose = turned
    rng = np.random.default_rng(3)
    motion, force = rng.normal(size=(wall.n_blocks, 6)), rng.normal(size=(points.count, 3))
    h = 1e-6
    change = [
        np.einsum("mcsd,mc->msd", point_wrenches(bodies, contact(bodies, moved(pose, s * h * motion))), force)
        for s in (1.0, -1.0)
    ]
    stiffness = geometric_stiffness(bodies, contact(bodies, pose), force, np.arange(points.count))
    ends = np.concatenate([motion[bodies.block_a], motion[bodies.block_b]], axis=1)
    expected = np.einsum("mij,mj->mi", stiffness, ends)
    assert ((change[0] - change[1]) / (2 * h)).reshape(expected.shape) == pytest.approx(expected, abs=1e-7)


def test_the_motion_between_two_poses_is_the_one_made(turned):
    wall, _, _, pose = turned
    motion = 0.5 * np.random.default_rng(4).normal(size=(wall.n_blocks, 6))
    assert motion_between(pose, moved(pose, motion)) == pytest.approx(motion, abs=1e-12)


def law_of(m, rng):
    one = np.ones(m)
    cohesion = rng.choice([0.0, 0.3], m)
    tension = np.minimum(rng.choice([0.0, 0.2, 0.5], m), cohesion / 0.6)
    strength = PointLaw(0.6 * one, rng.uniform(0.0, 0.6, m), cohesion, tension, np.full(m, np.inf))
    return ElastoplasticLaw(strength, 2.0 * one, 3.0 * one)


@pytest.mark.parametrize("components", [2, 3])
def test_the_tangent_is_the_derivative_of_the_returned_stress(components):
    rng = np.random.default_rng(5)
    m = 2000
    law = law_of(m, rng)
    old = PlasticHistory(0.2 * rng.normal(size=(m, components - 1)), 0.1 * np.abs(rng.normal(size=m)))
    at = 0.4 * rng.normal(size=(m, components))
    found, h = return_map(law, old, at), 1e-7
    for k in range(components):
        step = np.zeros(components)
        step[k] = h
        change = return_map(law, old, at - step).stress - return_map(law, old, at + step).stress
        assert change / (2 * h) == pytest.approx(found.tangent[:, :, k], abs=1e-6)


def test_the_return_keeps_the_law_the_flow_rule_and_the_energy():
    rng = np.random.default_rng(6)
    m = 5000
    law = law_of(m, rng)
    old = PlasticHistory(0.2 * rng.normal(size=(m, 2)), 0.1 * np.abs(rng.normal(size=m)))
    found = return_map(law, old, 0.4 * rng.normal(size=(m, 3)))
    shear = np.linalg.norm(found.stress[:, 1:], axis=1)
    slip = found.history.slip - old.slip
    size = np.linalg.norm(slip, axis=1)
    assert law.strength.excess(found.stress[:, 0], shear).max() < 1e-12
    assert found.history.lift - old.lift == pytest.approx(law.strength.tan_psi * size, abs=1e-12)
    limit = law.strength.cohesion + law.strength.tan_phi * found.stress[:, 0]
    assert (found.stress[:, 1:] * slip).sum(axis=1) == pytest.approx(-limit * size, abs=1e-12)
    loss = limit * size - found.stress[:, 0] * (found.history.lift - old.lift)
    assert loss.min() > -1e-12


def test_small_steps_come_to_the_same_as_the_dem_kernel():
    """The kernel's apex rule is an incremental one; over many small steps both are one law."""
    from dem.kernels import LAW_SIZE, Points
    from dem.kernels.joint_strength import plain_peak_of
    from dem.kernels.sums import point_sums

    def scan(d, law_row, points):
        g = (0.0,) * 6
        peak, still = plain_peak_of(law_row, 0), (0.0,) * 6
        return point_sums(points, 0, 1, (d, g, (0.0, 0.0, 1.0)), peak, None, 0.0, None, still, None, None, True)

    mu, dil, kn, ks, cohesion, tension = 0.6, 0.3, 2.0, 3.0, 0.3, 0.2
    row = np.zeros((1, LAW_SIZE))
    row[0, :8] = kn, ks, mu, dil, cohesion, tension, np.inf, np.inf
    points = Points(np.zeros(1), np.zeros(1), np.ones(1), *(np.zeros(1) for _ in range(5)))
    one = np.ones(1)
    strength = PointLaw(mu * one, dil * one, cohesion * one, tension * one, np.inf * one)
    law = ElastoplasticLaw(strength, kn * one, ks * one)
    old = PlasticHistory(np.zeros((1, 2)), np.zeros(1))
    s = np.linspace(0.0, 1.0, 4001)
    # pressed, slid away on a line, pulled open while sliding, and closed again; where slip turns or comes back the lift
    # of the DEM follows it and that of a path stays, which the path says
    way = np.column_stack([0.5 * s, 0.4 * s, -0.3 + 0.9 * np.sin(2.5 * s)])
    worst = 0.0
    for e1, e2, w in way:
        found = return_map(law, old, np.array([[w, e1, e2]]))
        old = found.history
        dem = scan((e1, e2, w), row, points)
        worst = max(worst, np.abs(found.stress[0] - [dem[2], dem[0], dem[1]]).max())
    assert worst < 1e-3


def test_a_point_that_slides_back_is_seen():
    from limitmason.capacity.slip_softening import slid_back

    one = np.ones(1)
    law = ElastoplasticLaw(PointLaw(0.6 * one, 0.3 * one, 0.0 * one, 0.0 * one, np.inf * one), 2.0 * one, 3.0 * one)
    old, seen = PlasticHistory(np.zeros((1, 2)), np.zeros(1)), []
    for e in [*np.linspace(0.0, 1.0, 21), *np.linspace(1.0, 0.0, 21)]:
        old = return_map(law, old, np.array([[-0.3, e, 0.0]])).history
        seen.append(bool(slid_back(law.strength.tan_psi, old)[0]))
    assert not any(seen[:21])
    assert seen[-1]
    assert old.lift[0] > 0.3  # kept and grown on the way back, where the DEM ends without
