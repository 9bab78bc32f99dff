"""Compiled sums over the points of a path beside the same written for whole arrays, in the plane and in space."""

import numpy as np
import pytest
from builders import whole_arrays

import limitmason as lm
from limitmason.capacity import compiled_law
from limitmason.capacity.contacts import first_contacts, turned_over
from limitmason.capacity.frozen_friction import frozen
from limitmason.capacity.kinematics import at_rest, block_wrenches, contact, make_bodies, moved, point_wrenches
from limitmason.capacity.path_loads import PathLoads
from limitmason.capacity.point_law import ElastoplasticLaw, PlasticHistory, return_map, returned_stress
from limitmason.capacity.system import Evaluated, System
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.law import BELOW_THE_APEX, PointLaw, interface_law
from limitmason.mechanics.plane import find_plane


@pytest.mark.parametrize("components", [2, 3])
def test_the_return_to_cone_tip_apex_and_cap_is_the_same(components):
    rng = np.random.default_rng(4)
    m = 4000
    one, cohesion = np.ones(m), rng.choice([0.0, 0.3], m)
    strength = PointLaw(
        0.6 * one, rng.choice([0.0, 0.2, 0.6], m), cohesion, rng.choice([0.0, 0.2, 0.8], m) * (cohesion > 0.0),
        rng.choice([0.5, np.inf], m),
    )
    law = ElastoplasticLaw(strength, 2.0 * one, 3.0 * one)
    old = PlasticHistory(0.2 * rng.normal(size=(m, components - 1)), 0.1 * np.abs(rng.normal(size=m)))
    at = 0.5 * rng.normal(size=(m, components))
    for one_law in (law, frozen(law, np.abs(rng.normal(size=m)))):
        arrays, compiled = whole_arrays.returned(one_law, old, at), return_map(one_law, old, at)
        for name in ("stress", "tangent"):
            assert getattr(compiled, name) == pytest.approx(getattr(arrays, name), abs=1e-12), name
        for name in ("slip", "lift"):
            assert getattr(compiled.history, name) == pytest.approx(getattr(arrays.history, name), abs=1e-12), name
        assert compiled_law.BELOW_THE_APEX == BELOW_THE_APEX
        assert (returned_stress(one_law, old, at) == compiled.stress).all()


@pytest.mark.parametrize("in_plane", [True, False])
def test_displacements_wrenches_and_elements_of_a_turned_pose_are_the_same(in_plane):
    wall = lm.build.wall(length=0.8, courses=3, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    loads = lm.Loads.horizontal(wall)
    plane = find_plane(wall, loads) if in_plane else None
    points = contact_points(wall, plane=plane)
    rng, ones = np.random.default_rng(1), np.ones(len(wall.interfaces))
    first = first_contacts(points, interface_law(wall.arrays), ones, ones)
    bodies = make_bodies(wall, turned_over(first, rng.random(points.count) < 0.5), plane)
    motion = 0.2 * rng.normal(size=bodies.free.shape) @ bodies.basis.T
    pose, m, c = moved(at_rest(wall.n_blocks), motion), points.count, points.components
    force = rng.normal(size=(m, c))
    n, d = bodies.free.shape
    law = ElastoplasticLaw(PointLaw(*(0.5 * np.ones(m) for _ in range(5))), np.ones(m), np.ones(m))
    acting = PathLoads.of(loads, bodies.basis, bodies.free)
    system = System(bodies, law, acting, np.zeros((n, d)), 1.0, 0.3, 0.01, np.zeros((n, 0)))
    tangent = rng.normal(size=(m, c, c))

    at = contact(bodies, pose)
    wrenches = point_wrenches(bodies, at)
    returned = return_map(law, PlasticHistory(np.zeros((m, c - 1)), np.zeros(m)), at.displacement)
    state = Evaluated(pose, at, wrenches, returned._replace(tangent=tangent), 0.0, force, None, None, 0.0)
    arrays = whole_arrays.contact(bodies, pose)
    theirs = whole_arrays.point_wrenches(bodies, arrays)
    for mine, other in (
        *zip(at, arrays, strict=True), (wrenches, theirs),
        (block_wrenches(bodies, wrenches, force), whole_arrays.block_wrenches(bodies, theirs, force)),
        (system._elements(state), whole_arrays.elements(bodies, arrays, theirs, tangent, force, system.starts)),
        (pose.turn, whole_arrays.turned(motion[:, 3:])),
    ):
        assert mine == pytest.approx(other, abs=1e-12)


def test_points_of_turned_blocks_that_deform_are_the_same():
    wall = lm.build.wall(length=0.8, courses=3, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    points = contact_points(wall)
    rng, ones, m, k = np.random.default_rng(2), np.ones(len(wall.interfaces)), points.count, 4
    bodies = make_bodies(wall, first_contacts(points, interface_law(wall.arrays), ones, ones), None)
    basis = np.block([[bodies.basis, np.zeros((6, k))], [np.zeros((k, bodies.basis.shape[1])), np.eye(k)]])
    bodies = bodies._replace(shapes_a=rng.normal(size=(m, 3, k)), shapes_b=rng.normal(size=(m, 3, k)), basis=basis)
    pose = moved(at_rest(wall.n_blocks, k), 0.3 * rng.normal(size=(wall.n_blocks, 6 + k)))
    at, arrays = contact(bodies, pose), whole_arrays.contact(bodies, pose)
    for mine, other in zip(at, arrays, strict=True):
        assert mine == pytest.approx(other, abs=1e-12)
    assert point_wrenches(bodies, at) == pytest.approx(whole_arrays.point_wrenches(bodies, at), abs=1e-12)
