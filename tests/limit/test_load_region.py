"""Loads that are safe at once: closed forms of one block, direct solves in random directions, cones, proofs."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.limit import load_regions
from limitmason.limit.program.clarabel_solver import solve_static

MU = math.tan(math.radians(35.0))


def block(dilatancy=35.0, **law):
    """One metre wide, 1.5 m high."""
    joint = lm.Joint(35.0, dilatancy_angle_deg=dilatancy, **law)
    solids = [box((-1, 0, -1), (2, 1, 0)), box((0, 0, 0), (1, 1, 1.5))]
    return lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[0])


def push(model, force, at=None, name=""):
    """A force in units of the block's weight."""
    weight = model.weights[1]
    return replace(lm.Loads.weight(model).with_point_load(model, 1, weight * np.array(force, float), at=at), name=name)


def two_pushes(model):
    return [push(model, (1, 0, 0), (0.5, 0.5, 1.5), "top"), push(model, (1, 0, 0), name="middle")]


def in_order(points):
    return np.array(sorted(map(tuple, np.round(points, 9))))


def test_two_pushes_on_a_block_have_the_parallelogram_of_sliding_and_turning():
    """|P + Q| <= tan(phi) W and |1.5 P + .75 Q| <= W / 2."""
    model = block()
    found = lm.load_region(model, lm.Loads.weight(model), two_pushes(model), tolerance=1e-6)
    arms = np.array([[1.0, 1.0], [1.5, 0.75]])
    wanted = [np.linalg.solve(arms, (a * MU, b * 0.5)) for a in (1, -1) for b in (1, -1)]
    assert found.status == "closed"
    assert found.gap < 1e-6
    assert in_order(found.corners) == pytest.approx(in_order(wanted), abs=1e-7)
    for forces, (p, q) in zip(found.forces, found.corners, strict=True):
        assert abs(forces.normal[0]) == pytest.approx(model.weights[1], rel=1e-6)
        assert np.linalg.norm(forces.shear[0]) == pytest.approx(abs(p + q) * model.weights[1], rel=1e-6)
    for plane in found.outside:
        assert (found.corners @ plane.normal).max() <= plane.offset + 1e-9
    assert found.contains((0.0, 0.0)) is True
    assert found.contains((0.4, 0.0)) is False
    assert not len(found.cone)


@pytest.mark.slow
def test_axial_force_and_moment_of_a_pier_are_the_parabola_of_the_stress_block():
    """M = N / 2 (b - N / (fc t)) in the worst bed joint, where own weight is part of N."""
    b, t, strength = 0.6, 0.4, 2e6
    joint = lm.Joint(35.0, dilatancy_angle_deg=35.0, compressive_strength=strength)
    pier = lm.build.column(width=b, depth=t, unit_height=0.2, courses=6, joint=joint, density=1800.0)
    most, cases = strength * b * t, []
    for name, wrench in (("N", (0, 0, -most, 0, 0, 0)), ("M", (0, 0, 0, 0, 0.5 * most * b, 0))):
        live = np.zeros((pier.n_blocks, 6))
        live[-1] = wrench
        cases.append(replace(lm.Loads.weight(pier), live=live, name=name))
    found = lm.load_region(pier, lm.Loads.weight(pier), cases, tolerance=0.01)
    assert found.status == "closed"
    assert len(found.corners) > 16
    n, m = found.corners.T
    above = np.cumsum(pier.weights[~pier.fixed][::-1]) / most
    wanted = ((n[:, None] + above) * (1.0 - n[:, None] - above)).min(axis=1)
    assert np.abs(m) == pytest.approx(wanted, abs=1e-7)


def test_a_region_without_end_has_its_cone_and_its_tip():
    """Down V, sideways H: turning about an edge, |0.75 H| <= (1 + V) / 2, tip at V = -1."""
    model = block()
    cases = [push(model, (1, 0, 0), name="H"), push(model, (0, 0, -1), name="V")]
    found = lm.load_region(model, lm.Loads.weight(model), cases, tolerance=1e-6, within=(4.0, 4.0))
    assert in_order(found.corners) == pytest.approx(
        in_order([(0, -1), (10 / 3, 4), (-10 / 3, 4)]), abs=1e-6
    )
    rays = np.array([(2.0, 3.0), (-2.0, 3.0)]) / math.sqrt(13.0)
    assert in_order(found.cone) == pytest.approx(in_order(rays), abs=1e-6)
    for unit in (1.0, 1e3, 1e-3):  # limits that the call chose prove nothing beyond them
        scaled = [replace(c, live=c.live / u) for c, u in zip(cases, (1.0, unit), strict=True)]
        found = lm.load_region(model, lm.Loads.weight(model), scaled)
        points = (0.99 * 2.0, 2.0), (-0.99 * 14.0, 20.0), (1.01 * 2.0, 2.0), (0.0, -1.01)
        assert [found.contains((h, v * unit)) for h, v in points] == [True, True, False, False]
    assert lm.load_region(model, lm.Loads.weight(model), cases).within.max() >= 1.0


def test_loads_of_one_name_are_told_apart():
    # loads made from the same dead load keep its name
    model = block()
    found = lm.load_region(model, lm.Loads.weight(model), [push(model, f, name="p") for f in ([1, 0, 0], [0, 0, -1])])
    assert found.names == ("p", "p (2)")
    x, z = lm.figures.load_region(found).axes[0].get_xlabel(), lm.figures.load_region(found).axes[0].get_ylabel()
    assert x != z


def test_a_flat_region_is_drawn_from_end_to_end_whatever_its_direction():
    """Two pushes of a block without friction balance each other: x + y = 0, up to overturning at width / height."""
    solids = [box((-1, 0, -1), (2, 1, 0)), box((0, 0, 0), (1, 1, 1.5))]
    model = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(0.0), fixed=[0])
    cases = [push(model, (1, 0, 0), name="middle"), push(model, (1, 0, 0), at=(0.0, 0.5, 0.0), name="foot")]
    found = lm.load_region(model, lm.Loads.weight(model), cases)
    assert np.sort(found.corners[:, 0]) == pytest.approx([-2 / 3, 2 / 3])
    for corners in (found.corners, np.round(found.corners, 6)):  # rounded, both sums x + y are 0 exactly
        outline = lm.figures.load_region(replace(found, corners=corners)).axes[0].lines[0].get_xydata()
        assert np.ptp(outline, axis=0) == pytest.approx([4 / 3, 4 / 3], abs=1e-5)


def test_beyond_the_limits_that_were_asked_nothing_is_said():
    """Sideways alone within 0.1 of the weight, of 2 / 3 that is carried: no cone, and no motion is met."""
    model = block()
    found = lm.load_region(model, lm.Loads.weight(model), [push(model, (1, 0, 0), name="H")], within=0.1)
    assert [found.contains((h,)) for h in (0.09, 0.5)] == [True, None]


def test_an_empty_region_has_its_proof():
    """What is pulled up three times as hard as it weighs flies, however it is pushed."""
    model = block()
    up = lm.Loads.weight(model).with_point_load(model, 1, (0, 0, 3.0 * model.weights[1]), case="dead")
    found = lm.load_region(model, up, two_pushes(model))
    assert found.status == "empty"
    assert found.proof[1, 2] > 0.0
    assert np.abs([np.sum(c.live * found.proof) for c in two_pushes(model)]).max() < 1e-6 * model.weights[1]
    assert found.contains((0.0, 0.0)) is False


def test_below_normality_both_regions_are_shown():
    """Radenkovic: sliding at tan(psi) inside, at tan(phi) outside; turning is the same."""
    model = block(dilatancy=20.0)
    found = lm.load_region(model, lm.Loads.weight(model), two_pushes(model), tolerance=1e-6)
    arms = np.array([[1.0, 1.0], [1.5, 0.75]])
    psi = math.tan(math.radians(20.0))
    wanted = [np.linalg.solve(arms, (a * psi, b * 0.5)) for a in (1, -1) for b in (1, -1)]
    assert in_order(found.certain.corners) == pytest.approx(in_order(wanted), abs=1e-7)
    assert all(found.contains(c) for c in found.certain.corners * (1.0 - 1e-9))


@pytest.mark.slow
def test_direct_solves_in_random_directions_are_neither_outside_nor_further_out_than_the_tolerance():
    wall = lm.build.wall(length=1.6, courses=5, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0, dilatancy_angle_deg=33.0))
    weight, top = lm.Loads.weight(wall), wall.n_blocks - 1
    cases = [lm.Loads.horizontal(wall), weight.with_point_load(wall, top, (0, 0, -2e3))]
    found = lm.load_region(wall, weight, cases, tolerance=1e-6, within=(2.0, 2.0))
    assert found.status == "closed"
    size = np.linalg.norm(np.ptp(found.corners, axis=0))
    seed = np.random.default_rng(28)
    for _ in range(12):
        d = seed.normal(size=2)
        d /= np.linalg.norm(d)
        both = lm.Loads(weight.dead, d[0] * cases[0].live + d[1] * cases[1].live)
        direct = lm.limit_analysis(wall, both).collapse_multiplier
        if not abs(direct * d).max() < 2.0:
            continue
        assert all(plane.normal @ d * direct <= plane.offset + 1e-7 * size for plane in found.outside)
        assert found.contains(d * direct * (1.0 - 1e-5)) is True
        assert found.contains(d * direct * (1.0 + 1e-5)) is False


@pytest.mark.slow
def test_three_loads_close_in_space_and_copies_agree(tmp_path):
    model = block()
    cases = [*two_pushes(model), push(model, (0, 1, 0), name="across")]
    found = lm.load_region(model, lm.Loads.weight(model), cases, tolerance=3e-2)
    assert found.status == "closed"
    assert found.corners[:, 2].max() == pytest.approx(2.0 / 3.0, abs=1e-7)  # turns about its long edge: 0.5 / 0.75
    found.to_json(tmp_path / "region.json")
    assert json.loads((tmp_path / "region.json").read_text())["cases"] == ["top", "middle", "across"]
    flat = lm.load_region(model, lm.Loads.weight(model), two_pushes(model), tolerance=1e-6)
    assert lm.figures.load_region(flat, title="two pushes").axes
    a = 0.7
    turn = 20.0 * np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    copy = model.transformed(turn).renumbered([1, 0])
    at = [turn @ (0.5, 0.5, 1.5), None]
    again = [
        lm.Loads.weight(copy).with_point_load(copy, 1 - 1, copy.weights[0] * turn @ (1, 0, 0) / 20.0, at=p) for p in at
    ]
    turned = lm.load_region(copy, lm.Loads.weight(copy), again, tolerance=1e-6)
    assert in_order(turned.corners) == pytest.approx(in_order(flat.corners), abs=2e-7)


@pytest.mark.parametrize(("change", "message"), [
    (lambda m, c: (m, lm.Loads.weight(m), []), "one to three loads"),
    (lambda m, c: (m, c[0], c), "dead: its live part"),
    (lambda m, c: (m, lm.Loads(np.zeros((3, 6)), np.zeros((3, 6))), c), "dead: for 3 blocks, the assembly has 2"),
    (lambda m, c: (m, lm.Loads.weight(m), [lm.Loads(np.zeros((3, 6)), np.ones((3, 6)), "far")]), "'far': for 3 blocks"),
    (lambda m, c: (m, lm.Loads.weight(m), [c[0], replace(lm.Loads.weight(m), name="none")]), "'none' has no live load"),
    (lambda m, c: (m, lm.Loads.weight(m), [c[0], c[0].scaled(live=2.0)]), "one of the loads is made of the others"),
])
def test_cases_that_make_no_region_are_refused_by_name(change, message):
    model = block()
    with pytest.raises(InputError, match=message):
        lm.load_region(*change(model, two_pushes(model)))


def test_a_tie_adds_no_direction_without_end():
    """It bears no more than its strength: pressed down and pushed, the block has the friction cone and no more."""
    model = block()
    strength = 200.0 * model.weights[1]
    model = model.with_ties([lm.Tie(1, (0.5, 0.5, 1.5), None, (0.5, 0.5, -1.0), yield_force=strength)])
    loads = [push(model, (0, 0, 1), name="up"), push(model, (1, 0, 0), (0.5, 0.5, 0.0), name="side")]
    found = lm.load_region(model, lm.Loads.weight(model), loads)
    friction = math.radians(35.0)
    wanted = [(-math.cos(friction), sign * math.sin(friction)) for sign in (-1, 1)]
    assert found.corners[:, 0].max() == pytest.approx(201.0, rel=1e-6)
    assert in_order(found.cone) == pytest.approx(in_order(wanted), abs=1e-6)
    assert found.contains((-5000.0, 0.8 * 5000.0)) is not True


def test_a_joint_that_crushes_has_no_direction_without_end():
    """Of two blocks pressed down the one on a joint of finite strength bears N = fc A, the other any force."""
    solids = [box((-1, 0, -1), (8, 1, 0)), box((0, 0, 0), (1, 1, 1)), box((4, 0, 0), (5, 1, 1))]
    model = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0, dilatancy_angle_deg=35.0), fixed=[0])
    weak = replace(model.interfaces[0].joint, compressive_strength=20.0 * model.weights[2])
    model = model.with_interfaces(replace(i, joint=weak) if i.block_b == 2 else i for i in model.interfaces)
    weight = lm.Loads.weight(model)
    loads = [
        replace(weight.with_point_load(model, k, model.weights[k] * np.array([0.0, 0.0, -1.0])), name=f"on {k}")
        for k in (1, 2)
    ]
    found = lm.load_region(model, weight, loads)
    assert found.corners[:, 1].max() == pytest.approx(19.0, rel=1e-6)
    assert found.cone == pytest.approx(np.array([[1.0, 0.0]]), abs=1e-6)


def test_what_is_asked_beside_the_axes_is_counted_without_them():
    """Six programs close the parallelogram, after two along each axis: these were counted among them before."""
    model = block()
    dead, cases = lm.Loads.weight(model), two_pushes(model)
    found = [lm.load_region(model, dead, cases, tolerance=1e-6, most=most).status for most in (5, 6)]
    assert found == ["not closed", "closed"]


def test_a_name_that_looks_like_a_numbered_one_is_told_apart_too():
    model = block()
    cases = [push(model, f, name=name) for f, name in (([1, 0, 0], "p"), ([0, 0, -1], "p (2)"), ([0, 1, 0], "p"))]
    assert lm.load_region(model, lm.Loads.weight(model), cases, most=0).names == ("p", "p (2)", "p (3)")


def test_limits_on_a_bounded_region_cost_no_search_for_its_directions_without_end(monkeypatch):
    """The cone is its tip alone: 252 programs went after the rounding of the solver there before."""
    solved = []
    monkeypatch.setattr(load_regions, "solve_static", lambda *a, **k: solved.append(1) or solve_static(*a, **k))
    model = block()
    found = lm.load_region(model, lm.Loads.weight(model), two_pushes(model), within=0.2)
    assert (found.status, len(found.cone)) == ("closed", 0)
    assert len(solved) < 30


def test_a_block_between_floor_and_ceiling_has_a_region_though_no_motion_opens_its_joints():
    """Two glued faces of 1 m2 and 5 kPa carry 10 kN either way; that ended in an error of numpy's."""
    infill = lm.Assembly.from_polyhedra(
        [box((-1, 0, -1), (4, 1, 0)), box((-1, 0, 1), (4, 1, 2)), box((0, 0, 0), (1, 1, 1))],
        joint=lm.Joint(0.0, cohesion=5e3), fixed=[0, 1],
    )
    dead = lm.Loads.weight(infill)
    push, across = (dead.with_point_load(infill, 2, force) for force in ((1e3, 0, 0), (0, 1e3, 0)))
    one = lm.load_region(infill, dead, [push])
    assert sorted(one.corners[:, 0]) == pytest.approx([-10.0, 10.0], rel=1e-6)
    assert one.contains([9.9])
    assert one.contains([11.0]) is not True
    both = lm.load_region(infill, dead, [push, across], most=40)
    assert both.contains([6.9, 6.9])
    assert both.contains([7.2, 7.2]) is not True
