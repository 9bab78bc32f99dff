"""Collapse multipliers known in closed form."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import linprog
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient
from walls import arch_blocks, on_slab, running_bond, stack

import limitmason as lm
from limitmason.figures.style import prediction_text
from limitmason.geometry import box


def collapse(assembly, direction=(1, 0, 0), **options):
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, direction), **options)
    assert prediction.status == "solved"
    return prediction.collapse_multiplier


def static_program(units, courses, *, mu, length=0.4, height=0.2):
    """Largest multiplier of a running bond without head joints, first course with half units at its ends.

    The static theorem written from the widths alone: N and T at both ends of every overlap, three equations a block,
    |T| <= mu N, maximise lambda under weights and lambda times the weights sideways.
    """
    rows = [
        [0.0, *(length * (i + 0.5) for i in range(units)), units * length] if j % 2 == 0
        else [length * i for i in range(units + 1)]
        for j in range(courses)
    ]
    blocks = [(j, a, b) for j, ends in enumerate(rows) for a, b in pairwise(ends)]
    points = [
        (i, k, x)
        for i, (j, a, b) in enumerate(blocks)
        for k, (m, c, d) in [(-1, (-1, a, b)), *enumerate(blocks)]
        if m == j - 1 and min(b, d) - max(a, c) > 1e-9
        for x in (max(a, c), min(b, d))
    ]
    n = len(points)
    balance, weight = np.zeros((3 * len(blocks), 2 * n + 1)), np.zeros(3 * len(blocks))
    for p, (upper, lower, x) in enumerate(points):
        for i, sign, z in ((upper, 1.0, -0.5 * height), (lower, -1.0, 0.5 * height)):
            if i >= 0:
                arm = x - 0.5 * (blocks[i][1] + blocks[i][2])
                balance[3 * i : 3 * i + 3, p] = [0.0, sign, sign * arm]
                balance[3 * i : 3 * i + 3, n + p] = [sign, 0.0, -sign * z]
    for i, (_, a, b) in enumerate(blocks):
        balance[3 * i, -1], weight[3 * i + 1] = b - a, b - a
    friction = [np.hstack([-mu * np.eye(n), s * np.eye(n), np.zeros((n, 1))]) for s in (1.0, -1.0)]
    cost = np.r_[np.zeros(2 * n), -1.0]
    bounds = [(0, None)] * n + [(None, None)] * (n + 1)
    found = linprog(cost, np.vstack(friction), np.zeros(2 * n), balance, weight, bounds, method="highs")
    assert found.status == 0
    return -found.fun


@pytest.mark.parametrize("mu", [0.2, 0.5, 0.65])
@pytest.mark.parametrize("width", [0.3, 1.0])
def test_single_block_slides_or_rocks(mu, width):
    assert collapse(stack([(width, 1.0)], mu=mu)) == pytest.approx(min(mu, width), abs=1e-8)


@pytest.mark.parametrize("in_plane", [None, False])
def test_stack_rocks_about_the_lowest_joint(in_plane):
    assembly = stack([(0.5, 0.4)] * 6, mu=0.9)
    assert collapse(assembly, in_plane=in_plane) == pytest.approx(0.5 / (6 * 0.4), abs=1e-8)


def test_rocking_joint_of_a_stack_with_a_waist():
    # joint j from the top rocks at b / (j h); the waist's lower joint has a lever of 0.1 only
    assembly = stack([(1.0, 0.5), (0.2, 0.5), (1.0, 0.5)], mu=5.0)
    lever = 0.1
    above = np.array([[1.0 * 0.5, 0.75], [0.2 * 0.5, 0.25]])  # area, height above the waist's lower joint
    expected = lever * above[:, 0].sum() / (above[:, 0] * above[:, 1]).sum()
    assert collapse(assembly) == pytest.approx(expected, abs=1e-8)


def test_block_with_centred_top_load():
    # rocking (b/h) (W + Q) / (W + 2 Q): the load at the top turns sideways with the weight
    assembly = stack([(0.6, 1.5)], mu=0.9)
    weight, q = assembly.weights[1], 12_000.0
    top = (0.3, 0.5, 1.5)
    loads = (
        lm.Loads.horizontal(assembly)
        .with_point_load(assembly, 1, (0, 0, -q), at=top, case="dead")
        .with_point_load(assembly, 1, (q, 0, 0), at=top)
    )
    value = lm.limit_analysis(assembly, loads).collapse_multiplier
    assert value == pytest.approx(0.6 / 1.5 * (weight + q) / (weight + 2 * q), abs=1e-8)


def test_free_wall_overturns_at_t_over_h():
    wall = running_bond(4, 6, size=(0.4, 0.2, 0.15))
    assert collapse(wall, (0, 1, 0)) == pytest.approx(0.15 / 1.2, abs=1e-7)


@pytest.mark.parametrize("n, expected", [(1, 1.0), (2, 0.714286), (3, 0.636364), (5, 0.578947), (8, 0.548387)])
def test_running_bond_without_head_joints_friction_equal_to_bond_slope(n, expected):
    # (v / 2h) (4n + 2) / (4n - 1) for f = v / h = 1, bottom course ending at the toe with a half unit
    units = max(3, n + 2)
    wall = running_bond(units, n, half_first=True, heads=False, mu=1.0)
    assert (4 * n + 2) / (4 * n - 1) / 2 == pytest.approx(expected, abs=1e-6)
    assert collapse(wall) == pytest.approx((4 * n + 2) / (4 * n - 1) / 2, abs=1e-6)


def test_running_bond_associative_value_exceeds_the_mechanism_when_friction_is_above_bond_slope():
    # f = 1.2 > v / h = 1: normality forbids the stepped crack; the associated value is an artefact of dilatancy
    wall = running_bond(14, 12, half_first=True, heads=False, mu=1.2)
    found = collapse(wall)
    assert found == pytest.approx(static_program(14, 12, mu=1.2), rel=1e-6)
    stepped = (4 * 12 + 2) / (4 * 12 - 1) / 2  # 0.532
    assert found > stepped + 0.05


def test_benchmark_walls_in_plane():
    # independent static linear programs on the same walls (HiGHS), five digits
    assert collapse(running_bond(5, 10)) == pytest.approx(0.53830, abs=1e-5)
    assert collapse(running_bond(5, 10, heads=False)) == pytest.approx(0.51471, abs=1e-5)
    assert collapse(running_bond(10, 20)) == pytest.approx(0.46552, abs=1e-5)
    assert collapse(running_bond(10, 20, heads=False)) == pytest.approx(0.44969, abs=1e-5)


def test_milankovitch_semicircular_arch_stands_above_and_falls_below_its_minimum_thickness():
    for ratio, stands in ((0.1085, True), (0.1065, False)):
        arch = arch_blocks(1.0, ratio, 60)
        prediction = lm.limit_analysis(arch, lm.Loads.horizontal(arch))
        assert (prediction.status == "solved") is stands, ratio
        assert (prediction.status == "cannot stand under dead load") is not stands, ratio


def test_tilting_table_turns_the_weight_towards_the_lower_side():
    assembly = on_slab([((0, 0, 0), (1.0, 0.4, 1.0))], mu=5.0)
    about_y = lm.limit_analysis(assembly, lm.Loads.tilting(assembly, (0, 1, 0)))
    about_x = lm.limit_analysis(assembly, lm.Loads.tilting(assembly, (1, 0, 0)))
    assert about_y.collapse_multiplier == pytest.approx(1.0, abs=1e-8)
    assert about_x.collapse_multiplier == pytest.approx(0.4, abs=1e-8)
    assert about_y.tilt_angle_deg == pytest.approx(45.0, abs=1e-6)
    # a right-handed turn about +y lowers the +x side
    assert about_y.mechanism.twists[1, 0] > 0
    assert about_y.mechanism.twists[1, 4] > 0


def test_settling_support_keeps_the_least_reaction_that_carries_the_lintel():
    # weight at 2 m, far pier's inner edge at 1 m, settling pier's outer edge at 4 m
    piers = [((0, 0, 0), (1, 1, 1)), ((3, 0, 0), (4, 1, 1)), ((0, 0, 1), (4, 1, 2))]
    from limitmason.geometry import box

    assembly = lm.Assembly.from_polyhedra([box(*b) for b in piers], joint=lm.Joint(30.0), fixed=[0, 1])
    lintel = assembly.weights[2]
    prediction = lm.settlement_analysis(assembly, "block-1")
    assert prediction.reaction.least == pytest.approx(lintel * (2 - 1) / (4 - 1), rel=1e-6)
    assert prediction.mechanism.twists[1, 2] < 0
    assert prediction.reaction[1:3] == pytest.approx((lintel / 3, lintel / 3), rel=1e-6)
    assert prediction.reaction.stands_without is False
    # no load is multiplied: nothing here is called lambda
    assert np.isnan(prediction.collapse_multiplier)
    assert "lambda" not in str(prediction)
    assert "multiplier" not in str(prediction)
    assert f"least reaction {lintel / 3:.4g}" in str(prediction).replace(f"{lintel / 3:.6g}", f"{lintel / 3:.4g}")
    assert "λ" not in prediction_text(prediction)
    with pytest.raises(ValueError, match="reaction of a support is no multiplier"):
        _ = prediction.tilt_angle_deg
    with pytest.raises(ValueError, match="the live part has no role"):
        lm.settlement_analysis(assembly, "block-1", loads=lm.Loads.horizontal(assembly))
    with pytest.raises(ValueError, match="associative flow rule only"):
        lm.settlement_analysis(assembly, "block-1", flow_rule="non-associative")


@pytest.mark.parametrize("step", [0.05, 0.1, 0.2])
def test_corbelled_blocks_turn_about_the_edge_below(step):
    """n blocks that overhang each other by d, live load W at the tip: least over joints j of dead over live moment.

    About the edge of joint j the weights above have W (L / 2 - i d) each, i = 1, 2, ..., and the load W (n - j) d.
    """
    n, length, height, depth = 4, 1.0, 0.25, 0.5
    boxes = [((k * step, 0, k * height), (k * step + length, depth, (k + 1) * height)) for k in range(n)]
    corbel = on_slab(boxes, mu=2.0, joints={("block-0", "block-1"): lm.Joint(60.0, cohesion=1e9, tensile_strength=1e9)})
    weight = corbel.weights[1]
    tip = length + (n - 1) * step
    loads = lm.Loads.weight(corbel).with_point_load(corbel, n, (0, 0, -weight), at=(tip, depth / 2, n * height))
    # the lowest is glued to the slab
    exact = min(
        sum(length / 2.0 - i * step for i in range(1, n - j + 1)) / ((n - j) * step) for j in range(1, n)
    )
    assert exact > 0.0
    assert lm.limit_analysis(corbel, loads).collapse_multiplier == pytest.approx(exact, rel=1e-7)
    assert lm.limit_analysis(corbel, loads, in_plane=False).collapse_multiplier == pytest.approx(exact, rel=1e-7)


def flat_arch(span, height, number, pier, tall, mu, width=0.4):
    """Plumb voussoirs between two piers on held ground, and a unit force at mid-span; rough but for the ground."""
    x = np.linspace(-span / 2.0, span / 2.0, number + 1)
    near, far = span / 2.0, span / 2.0 + pier
    solids = [box((-far - 1.0, 0, -0.3), (-near, width, 0)), box((near, 0, -0.3), (far + 1.0, width, 0))]
    solids += [box((-far, 0, 0), (-near, width, tall)), box((near, 0, 0), (far, width, tall))]
    solids += [box((a, 0, tall - height), (b, width, tall)) for a, b in pairwise(x)]
    made = lm.Assembly.from_polyhedra(
        solids, joint=lm.Joint(70.0), fixed=[0, 1], joints={"base": lm.Joint.from_friction_coefficient(mu)}
    )
    loads = lm.Loads.weight(made)
    for k in (number // 2, number // 2 - 1):
        loads = loads.with_point_load(made, 4 + k, (0, 0, -500.0), at=(0, width / 2, tall))
    return made, loads


@pytest.mark.parametrize(("span", "height", "number", "pier", "tall", "mu"), [
    (2.0, 0.4, 4, 0.8, 1.0, 0.5), (1.5, 0.5, 8, 0.6, 1.2, 0.6),
])
def test_flat_arch_pushes_its_piers_away(span, height, number, pier, tall, mu):
    """Least thrust of a flat arch, from the soffit at its ends to the top at mid-span (Coulomb 1773, Heyman 1995).

    H = (W / 2 + lambda P) L / (4 h), W half of the arch; piers slide at H = mu (W_pier + W + lambda P / 2).
    """
    made, loads = flat_arch(span, height, number, pier, tall, mu)
    arm = span / (4.0 * height)
    half, foot = made.weights[4:].sum() / 2.0, made.weights[2]
    exact = (mu * (foot + half) - half * arm) / (1000.0 * (arm - mu / 2.0))
    for options in ({}, {"in_plane": False}, {"flow_rule": "non-associative", "search": "quick"}):
        assert lm.limit_analysis(made, loads, **options).collapse_multiplier == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(("number", "turn"), [(3, 10.0), (4, 15.0), (6, 12.0)])
def test_winding_stair_tips_over_a_side_of_the_overlap_of_two_steps(number, turn):
    """Steps on each other, each turned by an angle about one axis; live load at the tip of the last.

    What stands above a joint turns about a side of the polygon in which two steps overlap: dead over live moment,
    least over sides and joints.
    """
    length, breadth, height, back = 1.2, 0.5, 0.2, 0.25
    plan = np.array([[-back, -1], [length - back, -1], [length - back, 1], [-back, 1]]) * [1.0, breadth / 2.0]
    faces = ((3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    ways = np.deg2rad(turn) * np.arange(number)
    plans = [plan @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) for a in ways]
    solids = [
        (np.vstack([np.column_stack([p, np.full(4, z * height)]) for z in (k, k + 1)]), faces)
        for k, p in enumerate(plans)
    ]
    stair = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(75.0), fixed=[0])
    weight, tip = stair.weights[1], (length - back) * np.array([np.cos(ways[-1]), np.sin(ways[-1])])
    loads = lm.Loads.weight(stair).with_point_load(
        stair, number - 1, (0, 0, -weight), at=(*tip, number * height)
    )
    exact = np.inf
    for joint in range(1, number):
        centre = np.array([p.mean(axis=0) for p in plans[joint:]])
        overlap = Polygon(plans[joint - 1]).intersection(Polygon(plans[joint]))
        ring = np.array(orient(overlap).exterior.coords)
        for a, b in pairwise(ring):
            outward = np.array([b[1] - a[1], a[0] - b[0]])
            dead, live = ((centre - a) @ outward).sum(), (tip - a) @ outward
            assert dead < 0.0
            if live > 0.0:
                exact = min(exact, -dead / live)
    assert lm.limit_analysis(stair, loads).collapse_multiplier == pytest.approx(exact, rel=1e-7)
