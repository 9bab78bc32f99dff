"""Descent and the interior path, the ways of large models, and the states they find beside cone programs."""

import math

import numpy as np
import pytest

import limitmason as lm
from limitmason import experiments
from limitmason.capacity import frozen_friction, interior, newton, step_equilibrium
from limitmason.capacity.contacts import first_contacts
from limitmason.capacity.kinematics import at_rest, contact, geometric_stiffness, make_bodies, moved
from limitmason.capacity.point_law import ElastoplasticLaw, PlasticHistory, return_map, trial
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.law import PointLaw, interface_law


def potential(law, old, displacement):
    """Of an associative step: sup over the admissible stresses of s . C . trial - s . C . s / 2."""
    stress, tried = return_map(law, old, displacement).stress, trial(law, old, displacement)
    compliance = 1.0 / np.column_stack([law.kn, *[law.ks] * (stress.shape[1] - 1)])
    return ((tried - 0.5 * stress) * compliance * stress).sum(axis=1)


@pytest.mark.parametrize("components", [2, 3])
def test_stresses_at_frozen_friction_are_the_gradient_of_a_convex_potential(components):
    rng = np.random.default_rng(1)
    m = 3000
    one = np.ones(m)
    cohesion = rng.choice([0.0, 0.3], m)
    tension = np.minimum(rng.choice([0.0, 0.2], m), cohesion / 0.6)
    strength = PointLaw(0.6 * one, rng.uniform(0.0, 0.6, m), cohesion, tension, np.full(m, np.inf))
    old = PlasticHistory(0.2 * rng.normal(size=(m, components - 1)), 0.1 * np.abs(rng.normal(size=m)))
    law = frozen_friction.frozen(ElastoplasticLaw(strength, 2.0 * one, 3.0 * one), np.abs(rng.normal(size=m)))
    at, other = 0.4 * rng.normal(size=(2, m, components))
    stress, h = return_map(law, old, at).stress, 1e-6
    for k in range(components):
        step = np.zeros(components)
        step[k] = h
        slope = (potential(law, old, at + step) - potential(law, old, at - step)) / (2 * h)
        assert -slope == pytest.approx(stress[:, k], abs=1e-5)
    middle = potential(law, old, 0.5 * (at + other))
    assert (middle <= 0.5 * (potential(law, old, at) + potential(law, old, other)) + 1e-12).all()


def test_friction_frozen_at_the_normal_stress_of_a_pose_gives_the_stress_of_the_true_law_there():
    rng = np.random.default_rng(2)
    m = 2000
    one = np.ones(m)
    strength = PointLaw(0.6 * one, 0.0 * one, 0.1 * one, 0.0 * one, np.full(m, np.inf))
    law = ElastoplasticLaw(strength, 2.0 * one, 3.0 * one)
    old = PlasticHistory(0.2 * rng.normal(size=(m, 2)), np.zeros(m))
    at = 0.4 * rng.normal(size=(m, 3))
    true = return_map(law, old, at)
    frozen = return_map(frozen_friction.frozen(law, true.stress[:, 0]), old, at)
    assert frozen.stress == pytest.approx(true.stress, abs=1e-12)


def test_the_geometric_stiffness_of_a_run_of_points_is_the_sum_of_theirs():
    wall = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    points = contact_points(wall)
    one = np.ones(len(wall.interfaces))
    bodies = make_bodies(wall, first_contacts(points, interface_law(wall.arrays), one, one), None)
    rng = np.random.default_rng(3)
    at = contact(bodies, moved(at_rest(wall.n_blocks), 0.2 * rng.normal(size=(wall.n_blocks, 6))))
    force = rng.normal(size=(points.count, 3))
    starts = np.flatnonzero(np.diff(points.interface, prepend=-1))
    single = geometric_stiffness(bodies, at, force, np.arange(points.count))
    summed = np.add.reduceat(single, starts, axis=0)
    assert geometric_stiffness(bodies, at, force, starts) == pytest.approx(summed, abs=1e-12)


@pytest.mark.parametrize("psi, to, modulus", [
    pytest.param(0.0, (1.0, 0.0, 0.0), None, marks=pytest.mark.slow),
        pytest.param(20.0, (1.0, 0.0, 0.0), None, marks=pytest.mark.slow), (0.0, (0.6, 0.8, 0.0), None),
    pytest.param(0.0, (1.0, 0.0, 0.0), 1e9, marks=pytest.mark.slow),
])
def test_descent_interior_path_and_programs_find_the_same_states(psi, to, modulus):
    """Steps five times as long as those of the path; rigid blocks in plane and in space, and blocks that deform."""
    wall = lm.build.wall(length=0.8, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0, psi))
    options = {}
    if modulus is not None:
        wall = wall.with_material(lm.Material(young_modulus=modulus, poisson_ratio=0.2))
        options = {"blocks": "simply deformable"}
    curve = lm.pushover(wall, lm.Loads.horizontal(wall, to), stiffness=1e10, contacts="first", **options)
    for k in range(1, curve.first_limit_point.index - 5):
        node, target = curve.nodes[k], curve.nodes[k + 5].control
        system = curve.generations.systems[0]
        ratio = float(np.abs(system.loads.live).sum())
        start = node.pose, node.history, target, node.multiplier, node.force[:, 0], ratio
        programs = step_equilibrium.by_programs(system, *start)[0]
        for way in (frozen_friction, interior) if to[1] == 0.0 else (frozen_friction,):
            found = way.solve(newton.Way.begin(system, node.pose, node.multiplier, node.history, target))
            assert found.multiplier == pytest.approx(programs.multiplier, abs=1e-8)
            assert found.state.force == pytest.approx(programs.state.force, abs=1e-5 * system.weight)


@pytest.mark.parametrize("joint", [
    lm.Joint(33.0), lm.Joint(33.0, 20.0), lm.Joint(33.0, cohesion=3e3, tensile_strength=2e3),
    lm.Joint(33.0, compressive_strength=2e4),
])
def test_forces_of_the_interior_path_lie_inside_the_law_at_equal_products(joint):
    """In a pose that opens, slides and presses points: complementarity of each limit has the value asked for."""
    wall = lm.build.wall(length=0.8, courses=3, unit=(0.4, 0.2, 0.2), joint=joint)
    system = lm.pushover(wall, lm.Loads.horizontal(wall), stiffness=1e8, to=1e-7).generations.systems[0]
    own = np.random.default_rng(4).normal(size=system.order)
    at = system.evaluate(system.advanced(system.at_rest(), 3.0 * own), system.virgin(), 0.0)
    points = interior._Points(system, system.virgin())
    x, law = points.inside(at, 0.7), points.strength
    shear = np.linalg.norm(x.cone[:, 1:], axis=1)
    assert (law.excess(x.normal, shear)[~law.crushes] < 0.0).all()
    assert x.spare * x.given == pytest.approx(np.full(len(x.spare), 0.7))
    assert np.einsum("mc,mc->m", x.cone, x.slid) == pytest.approx(np.full(len(shear), 0.7), rel=1e-6)
    # slip along the shear, against it, and the elastic law without limits takes what is left
    assert x.cone[:, :1] * x.slid[:, 1:] == pytest.approx(-x.slid[:, :1] * x.cone[:, 1:], rel=1e-9, abs=1e-12)
    assert points.linearised(at, x).elastic[:, 1:] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("in_plane", [True, False])
@pytest.mark.parametrize("second", [False, True])
def test_a_step_of_the_interior_path_solves_its_linear_equations(in_plane, second):
    """Elastic law, limits and products, linearised, after a full step that goes with given displacements."""
    joint = lm.Joint(33.0, 20.0, cohesion=3e3, tensile_strength=2e3, compressive_strength=2e4)
    wall = lm.build.wall(length=0.8, courses=3, unit=(0.4, 0.2, 0.2), joint=joint)
    loads = lm.Loads.horizontal(wall, (1.0, 0.0 if in_plane else 0.2, 0.0))
    system = lm.pushover(wall, loads, stiffness=1e8, to=1e-7).generations.systems[0]
    rng = np.random.default_rng(7)
    at = system.evaluate(system.advanced(system.at_rest(), rng.normal(size=system.order)), system.virgin(), 0.0)
    points = interior._Points(system, system.virgin())
    x, s, aim = points.inside(at, 0.7), points.strength, 0.2
    x = x._replace(slid=1.1 * x.slid, given=0.8 * x.given, cone=x.cone * [1.05, *[1.0] * (x.cone.shape[1] - 1)])
    a, moved = points.linearised(at, x), rng.normal(size=x.cone.shape)
    first = points.step(x, a, points.freed(x, a, 0.0, None), moved)[0] if second else None
    step, edge = points.step(x, a, points.freed(x, a, aim, first), moved)
    new = x.onward(step, 1.0)
    force = np.column_stack([new.normal, new.cone[:, 1:]])
    lifted = s.tan_psi * new.slid[:, 0] + np.bincount(points.row, points.sign * new.given, len(force))
    plastic = np.column_stack([lifted, new.slid[:, 1:]])
    assert (force - points.elastic(at)) / points.stiff + moved == pytest.approx(plastic, abs=1e-10)
    assert new.spare == pytest.approx(points.bound + points.sign * new.normal[points.row], abs=1e-10)
    assert new.cone[:, 0] == pytest.approx(s.shear_strength(new.normal), abs=1e-10)
    pairs = x.spare * x.given + step.spare * x.given + x.spare * step.given
    cones = product(x.cone, x.slid) + product(step.cone, x.slid) + product(x.cone, step.slid)
    if first is not None:
        pairs, cones = pairs + first.spare * first.given, cones + product(first.cone, first.slid)
    assert pairs == pytest.approx(aim, abs=1e-10)
    assert cones[:, 0] == pytest.approx(aim, abs=1e-10)
    assert cones[:, 1:] == pytest.approx(0.0, abs=1e-10)

    def inside(share):
        y = x.onward(step, share)
        slack = [(v[:, 0] - np.linalg.norm(v[:, 1:], axis=1)).min() for v in (y.cone, y.slid)]
        return min(y.spare.min(), y.given.min(), *slack)

    assert inside(0.999 * edge) > 0.0 > inside(1.001 * edge)


def product(x, y):
    """Product of the cone, (x . y, x0 y + y0 x)."""
    return np.column_stack([np.einsum("mc,mc->m", x, y), x[:, :1] * y[:, 1:] + y[:, :1] * x[:, 1:]])


@pytest.mark.slow
def test_factors_in_the_kept_order_solve_what_was_asked():
    """A plane wall of 500 points and more keeps the order of its first factors; so does the sign of the determinant."""
    wall = lm.build.wall(length=4.0, courses=12, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), stiffness=1e10, to=2e-6)
    system, node = curve.generations.systems[0], curve.nodes[-1]
    at = system.evaluate(node.pose, node.history, node.multiplier)
    right = np.random.default_rng(5).normal(size=system.order + 1)
    full = system.tangent(at, "control").toarray()
    for _ in range(2):
        assert system.bordered(at, "control").solve(right) == pytest.approx(np.linalg.solve(full, right), rel=1e-8)
        assert system.sense(at, "control") == np.linalg.slogdet(full)[0]
    assert system.bodies.large


@pytest.mark.slow
@pytest.mark.parametrize("name, minimum", [("wall-2", 0.563), ("wall-4", 0.264)])
def test_a_path_without_programs_ends_at_the_published_minimum(name, minimum, monkeypatch):
    """As from 200 points on; the certificate of every step is as strict."""
    monkeypatch.setattr(step_equilibrium, "MANY", 0)
    test = experiments.load("ferris-tin-loi-2001", name, dilatancy_deg=0.0)
    curve = lm.pushover(test.assembly(), test.loads(), stiffness=1e10)
    assert curve.cost.programs <= 1  # the dead load
    assert all(c.accepted for c in curve.certificates)
    assert max(abs(c.energy) for c in curve.certificates) < 0.01
    assert curve.first_limit_point.load == pytest.approx(minimum, rel=3e-3)


@pytest.mark.slow
def test_a_wall_of_two_hundred_blocks_is_followed_without_a_jump():
    """Plane running bond, psi = 0: programs jump at 1.8 mm. Below the associative 0.4655 by limit analysis."""
    wall = lm.build.wall(length=4.0, courses=20, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.02, 0.0))
    loads = lm.Loads.horizontal(wall)
    curve = lm.pushover(wall, loads, stiffness=1e10, to=1.9e-3)
    assert curve.status == "reached"
    assert not curve.jumps
    assert all(c.accepted for c in curve.certificates)
    assert max(abs(c.energy) for c in curve.certificates) < 0.01
    associative = lm.limit_analysis(wall, loads).collapse_multiplier
    assert 0.9 * associative < curve.load[-1] < associative
    assert math.isclose(associative, 0.4655, rel_tol=1e-3)


def test_a_path_does_not_leap_where_what_it_found_beyond_a_bend_leads_nowhere():
    """It crept towards that state by ever shorter steps, and leapt from .30 to .40 mm: each start lay off the path."""
    wall = lm.build.wall(length=5.6, courses=26, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.02, 0.0))
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), to=4e-4)
    assert curve.status == "reached"
    assert not any("no state was found" in w for w in curve.warnings)
    assert np.diff(curve.displacement).max() < 0.2 * 4e-4  # a step that leaps has no sample within it
    assert curve.load[-1] > 0.99 * curve.load.max()


def test_blocks_in_space_come_down_on_each_other_from_two_hundred_points_on():
    """Between 200 and 500 points nothing was tried: "cannot stand under dead load", with 192 points it stood."""
    wall = lm.build.wall(length=1.6, courses=5, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0, 0.0))
    gaps = np.random.default_rng(1).uniform(0.0, 2e-4, len(contact_points(wall).area))
    curve = lm.pushover(wall, lm.Loads.horizontal(wall, (0, 1, 0)), stiffness=1e10, gaps=gaps, to=1e-8)
    assert step_equilibrium.MANY <= curve.structure.points.count < step_equilibrium.MANY_BY_DESCENT
    assert not step_equilibrium.descent_first(curve.generations.systems[0])
    assert curve.status == "reached"
    assert all(c.accepted for c in curve.certificates)


def test_programs_that_were_not_solved_are_not_counted(monkeypatch):
    """Every viscous sub-step that was not found counted seven, also where none is tried: 51 for 2 on an arch."""
    wall = lm.build.wall(length=1.2, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0, 0.0))
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), stiffness=1e10, to=1e-6)
    system, node = curve.generations.systems[0], curve.nodes[-1]
    monkeypatch.setattr(step_equilibrium, "MANY", 0)
    way, missed = interior.solve, []

    def first_two_missed(*given, **options):
        missed.append(1)
        return None if len(missed) <= 2 else way(*given, **options)

    monkeypatch.setattr(interior, "solve", first_two_missed)
    monkeypatch.setattr(frozen_friction, "solve", lambda *_, **__: None)
    found = step_equilibrium.jump(system, node, node.control + 1e-7, 1.0)
    assert found is not None
    assert found.jump
    assert len(missed) > 2
    assert found.programs == 0
