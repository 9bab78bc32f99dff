"""Exact values of A, B, D and the classical mechanisms, named by their section of docs/mechanisms.md."""

import itertools
import math

import numpy as np
import pytest
from facades import ROUND
from thrust_lines import thinnest

import mechanisms as me
from limitmason.errors import NotApplicable
from mechanisms.facade_rocking import rocking_terms
from mechanisms.friction import edge_radii
from mechanisms.optimum import ratio, smallest_ratio

WHOLE = {"hinge_courses": 10, "crossed_courses": "hinge"}


def value(prediction):
    assert prediction.status == "solved"
    return prediction.collapse_multiplier


# ---- section 2: friction sums ---------------------------------------------------------------------------------------


def test_section_7_friction_sums_of_the_round_number_wall():
    details = me.simple_rocking(ROUND, hinge_courses=10).details
    assert details["F_g"] == pytest.approx(5.94, abs=1e-12)
    assert details["Z_g"] == pytest.approx(0.6, abs=1e-12)


@pytest.mark.parametrize("n", [1, 2, 7, 400])
def test_section_2_friction_sums_are_sums_over_joints(n):
    options = {"friction": 0.55, "unit_weight": 21.0, "thickness": 0.25, "staggering": 0.13, "course_height": 0.19}
    sums = me.bed_joint_friction(**options, crossed=n, overload=3.0, base_height=0.4)
    own = load = own_moment = load_moment = 0.0
    for j in range(1, n + 1):
        above = 0.4 + (n - j) * 0.19
        g, q = 0.55 * 21.0 * 0.25 * 0.13 * j * 0.19, 0.55 * 3.0 * 0.13
        own, own_moment, load, load_moment = own + g, own_moment + g * above, load + q, load_moment + q * above
    assert sums.weight == pytest.approx(own, rel=1e-12)
    assert sums.overload == pytest.approx(load, rel=1e-12)
    assert sums.moment == pytest.approx(own_moment + load_moment, rel=1e-12)
    if n == 400:  # small-block limits H_c / 3 and H_c / 2
        assert sums.weight_height - 0.4 == pytest.approx(n * 0.19 / 3.0, rel=3e-3)
        assert sums.overload_height - 0.4 == pytest.approx(n * 0.19 / 2.0, rel=3e-3)


def test_crack_angle_reduction_is_linear_and_refuses_what_no_bond_allows():
    assert me.crack_angle_reduction([0.0, 0.25, 0.75], 0.75) == pytest.approx([1.0, 2.0 / 3.0, 0.0])
    with pytest.raises(ValueError, match="crack tangent"):
        me.crack_angle_reduction(0.76, 0.75)


# ---- section 3 and 7: A and B ---------------------------------------------------------------------------------------


def test_section_7_simple_rocking():
    assert value(me.simple_rocking(ROUND, hinge_courses=10)) == pytest.approx(0.348, abs=1e-12)
    assert value(me.simple_rocking(ROUND.changed(friction=0.0), hinge_courses=10)) == pytest.approx(0.15, abs=1e-12)


@pytest.mark.parametrize("mechanism", [me.simple_rocking, me.compound_rocking, me.horizontal_flexure])
def test_a_hinge_lies_at_a_whole_course_of_the_wall(mechanism):
    for hinge in (0, 2.5, 11, True):
        with pytest.raises(ValueError, match="hinge_courses must be a whole number from 1 to 10"):
            mechanism(ROUND, hinge_courses=hinge)
    with pytest.raises(ValueError, match="reduction must lie between 0"):
        mechanism(ROUND, reduction=1.1)


def test_simple_rocking_searches_the_hinge():
    # friction grows with the cube of the depth: nine courses down is worse than ten
    worst = me.simple_rocking(ROUND)
    tried = [value(me.simple_rocking(ROUND, hinge_courses=n)) for n in range(1, 11)]
    assert value(worst) == min(tried) < 0.348
    assert worst.details["hinge_courses"] == 1 + int(np.argmin(tried)) == 9
    assert worst.details["hinge_height"] == pytest.approx(0.2)


@pytest.mark.parametrize("tangent, expected", [(0.25, 0.29436364), (0.5, 0.29569231), (0.75, 0.33)])
def test_section_7_compound_rocking_at_three_angles(tangent, expected):
    assert value(me.compound_rocking(ROUND, **WHOLE, crack_tangent=tangent)) == pytest.approx(expected, abs=5e-9)


def test_section_7_compound_rocking_has_an_interior_minimum():
    worst = me.compound_rocking(ROUND, **WHOLE)
    assert value(worst) == pytest.approx(0.28981707, abs=5e-9)
    assert worst.details["crack_tangent"] == pytest.approx(0.361817, abs=5e-7)
    assert worst.details["omega"] == pytest.approx(1.0 - 0.361817 / 0.75, abs=1e-6)


def test_section_7_with_overload():
    loaded = ROUND.changed(overload=5.0, side_overload=5.0)
    assert value(me.simple_rocking(loaded, hinge_courses=10)) == pytest.approx(0.34663636, abs=5e-9)
    assert value(me.compound_rocking(loaded, **WHOLE, crack_tangent=0.25)) == pytest.approx(0.278, abs=5e-9)


def test_compound_rocking_without_crack_angle_is_simple_rocking_and_without_friction_at_the_bond_angle():
    for n in (3, 10):
        upright = me.compound_rocking(ROUND, hinge_courses=n, crossed_courses="hinge", crack_tangent=0.0)
        assert value(upright) == pytest.approx(value(me.simple_rocking(ROUND, hinge_courses=n)), rel=1e-14)
    steep = {**WHOLE, "crack_tangent": 0.75}
    assert value(me.compound_rocking(ROUND.changed(friction=0.1), **steep)) == pytest.approx(0.33, abs=1e-12)


def test_omega_bracket_contains_the_multiplier():
    for options in ({}, WHOLE, {"crack": "stepped"}):
        prediction = me.compound_rocking(ROUND, **options)
        low, high = prediction.details["omega_bracket"]
        assert low <= value(prediction) <= high
        assert low == pytest.approx(0.15, abs=1e-12)  # a free wall
    assert me.compound_rocking(ROUND, **WHOLE, reduction=1.0).collapse_multiplier == pytest.approx(
        me.compound_rocking(ROUND, **WHOLE).details["omega_bracket"][1], rel=1e-14
    )


def test_published_reading_without_friction_below_the_crack_degenerates_to_a_free_wall():
    # with no friction between hinge and crack the minimum runs to one crossed course: t/H and nothing of the side walls
    free = me.compound_rocking(ROUND, below_crack="free")
    assert free.details["crossed_courses"] == 1
    assert value(free) == pytest.approx(0.15, abs=5e-4)
    assert value(me.compound_rocking(ROUND)) > 0.24


def test_side_wall_length_limits_the_wedge():
    short = ROUND.changed(side_wall_length=0.3)
    for crack in ("straight", "stepped"):
        limited = me.compound_rocking(short, crack=crack)
        assert limited.details["wedge_width"] <= 0.3 + 1e-12
        assert value(limited) > value(me.compound_rocking(ROUND, crack=crack)) + 1e-3


@pytest.mark.parametrize("n", [1, 2, 5, 7])
def test_whole_courses_are_the_best_of_all_choices(n):
    # every one of the 2^n choices, by the power balance joint by joint
    wall = ROUND.changed(side_overload=1.5, staggering=0.1, friction=0.8)
    best = min(
        me.rocking_power(wall, hinge=n, crossed=n, stepping=[j + 1 for j in range(n) if choice[j]]).multiplier
        for choice in itertools.product((False, True), repeat=n)
    )
    assert value(me.compound_rocking(wall, crack="stepped", hinge_courses=n)) == pytest.approx(best, rel=1e-12)


def test_whole_courses_all_or_none_are_the_ends_of_the_straight_crack():
    all_step = me.rocking_power(ROUND, hinge=10, crossed=10, stepping=range(1, 11)).multiplier
    assert all_step == pytest.approx(0.33, abs=1e-12)
    assert me.rocking_power(ROUND, hinge=10, crossed=10, stepping=()).multiplier == pytest.approx(0.348, abs=1e-12)


def test_whole_courses_step_at_the_top_where_wedges_are_light():
    steps = me.compound_rocking(ROUND, crack="stepped")
    assert steps.details["stepping_courses"] == (1, 2, 3, 4, 5, 6)
    assert value(steps) == pytest.approx(value(me.compound_rocking(ROUND)), rel=1e-12)


def test_scaling_the_wall_leaves_the_multipliers():
    twice = me.Facade(
        length=6.0,
        thickness=0.6,
        courses=10,
        course_height=0.4,
        staggering=0.3,
        unit_weight=7.0,
        friction=0.6,
        side_walls=2,
    )
    for mechanism in (me.simple_rocking, me.compound_rocking, me.horizontal_flexure):
        assert value(mechanism(twice)) == pytest.approx(value(mechanism(ROUND)), rel=1e-12)


# ---- section 4 and 7: D ---------------------------------------------------------------------------------------------


def test_section_7_horizontal_flexure():
    at = {"hinge_courses": 10, "crack_tangent": 0.5}
    assert value(me.horizontal_flexure(ROUND, **at)) == pytest.approx(0.32095226, abs=5e-9)
    assert value(me.horizontal_flexure(ROUND, **at, interaction=True)) == pytest.approx(0.26447081, abs=5e-9)
    assert value(me.horizontal_flexure(ROUND.changed(friction=0.0), **at)) == pytest.approx(0.18, abs=1e-12)


@pytest.mark.parametrize("tangent", [0.1, 0.4, 0.7])
def test_section_4_2_friction_free_limit_of_flexure(tangent):
    wall = ROUND.changed(friction=0.0)
    expected = 0.15 * (3.0 - 2.0 * tangent) / (3.0 - 4.0 / 3.0 * 2.0 * tangent)
    assert value(me.horizontal_flexure(wall, hinge_courses=10, crack_tangent=tangent)) == pytest.approx(
        expected, rel=1e-13
    )


def test_section_4_2_interaction_term_degenerates_to_the_shear_of_the_side_lines():
    wall = ROUND.changed(overload=2.0)
    tiny = value(me.horizontal_flexure(wall, hinge_courses=4, crack_tangent=1e-9, interaction=True))
    f = me.bed_joint_friction(friction=0.6, unit_weight=20.0, thickness=0.3, staggering=0.15, course_height=0.2,
                              crossed=4, overload=2.0).force
    assert tiny == pytest.approx(2.0 * f / (20.0 * 0.3 * 3.0 * 0.8 + 2.0 * 3.0), rel=1e-6)
    assert me.horizontal_flexure(wall, interaction=True).details["hinge_courses"] == 1


def test_one_side_wall_is_half_of_a_wall_twice_as_long():
    one = me.horizontal_flexure(ROUND.changed(side_walls=1))
    two = me.horizontal_flexure(ROUND.changed(length=6.0))
    assert value(one) == pytest.approx(value(two), rel=1e-13)
    assert one.details["power"]["multiplier"] == pytest.approx(value(one), rel=1e-12)


def test_flexure_takes_an_overload_on_a_part_of_the_top_as_spread_over_all_of_it():
    for sides in (1, 2):
        wall = ROUND.changed(side_walls=sides)
        part = me.horizontal_flexure(wall.changed(overload=6.0, overload_length=1.0))
        whole = me.horizontal_flexure(wall.changed(overload=2.0))
        assert value(part) == pytest.approx(value(whole), rel=1e-13)
        assert part.details["F_q"] == pytest.approx(whole.details["F_q"], rel=1e-13)
        assert part.details["power"] == pytest.approx(whole.details["power"], rel=1e-12)
        assert part.details["power"]["multiplier"] == pytest.approx(value(part), rel=1e-12)


def test_power_of_flexure_needs_what_holds_the_triangles():
    with pytest.raises(NotApplicable, match="side_walls must be 1 or 2"):
        me.flexure_power(ROUND.changed(side_walls=0), hinge=10, tangent=0.5, torsion_radius=0.09)


def test_section_4_2_true_pole_costs_up_to_twice_the_torsion():
    d_0 = me.torsion_radius(0.15, 0.3)
    middle, end = edge_radii(0.15, 0.3)
    assert d_0 == pytest.approx(0.0890, abs=5e-5)
    assert (middle, end) == (pytest.approx(0.159, abs=5e-4), pytest.approx(2.0 * d_0, rel=1e-12))
    prediction = me.horizontal_flexure(ROUND)
    at = {"hinge_courses": 10, "crack_tangent": prediction.details["crack_tangent"]}
    by_arm = [value(me.horizontal_flexure(ROUND, **at, torsion_arm=arm)) for arm in (middle, end)]
    assert prediction.details["edge_pole_multipliers"] == pytest.approx(by_arm, rel=1e-12)
    assert value(prediction) < by_arm[0] < by_arm[1]


@pytest.mark.slow
def test_smallest_flexure_is_below_a_fine_scan():
    scan = min(
        value(me.horizontal_flexure(ROUND, hinge_courses=n, crack_tangent=s))
        for n in range(6, 11) for s in np.linspace(0.02, min(0.75, 3.0 / (0.4 * n)), 200)
    )
    best = value(me.horizontal_flexure(ROUND))
    assert scan - 1e-4 < best <= scan


# ---- section 4.3: torsion -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "a, b, radius", [(1, 1, 0.382598), (2, 1, 0.593233), (0.144, 0.15, 0.05625), (0.144, 0.30, 0.08812)]
)
def test_section_4_3_torsion_radius(a, b, radius):
    assert me.torsion_radius(a, b) == pytest.approx(radius, abs=6e-7 if a >= 1 else 6e-6)


def test_section_4_3_torsion_radius_of_a_thin_strip_and_by_quadrature():
    assert me.torsion_radius(1.0, 1e-6) == pytest.approx(0.25, abs=1e-6)
    x, w = np.polynomial.legendre.leggauss(300)
    r = np.hypot(*np.meshgrid(0.35 * x, 0.1 * x))
    assert me.torsion_radius(0.7, 0.2) == pytest.approx(float(np.outer(w, w).ravel() @ r.ravel()) / 4.0, rel=1e-5)


def test_section_4_3_plastic_curve_of_torsion_and_shear():
    shear, torque = me.torsion_shear_curve(
        0.144, 0.15, np.concatenate([np.linspace(1e-4, 0.1, 200), np.linspace(0.11, 2, 400)])
    )
    for s, t in [(0.177, 0.976), (0.436, 0.856), (0.797, 0.504), (0.957, 0.223), (0.990, 0.105)]:
        assert float(np.interp(s, shear, torque)) == pytest.approx(t, abs=2e-3)
    assert (torque + shear > 1.0).all()  # the straight line of eq (26) lies inside
    assert (shear**2 + torque**2 < 1.0 + 1e-6).all()  # the circle outside


# ---- section 8 ------------------------------------------------------------------------------------------------------


def test_section_8_block_and_stack():
    assert value(me.rigid_block(width=0.3, height=1.0, friction=0.5)) == pytest.approx(0.3)
    assert value(me.rigid_block(width=0.7, height=1.0, friction=0.5)) == 0.5
    loaded = me.rigid_block(width=0.6, height=1.5, friction=0.9, weight=10.0, top_load=4.0)
    assert value(loaded) == pytest.approx(0.4 * 14.0 / 18.0)
    pile = me.stack(width=0.5, course_height=0.4, courses=6, friction=0.9)
    assert value(pile) == pytest.approx(0.5 / 2.4)
    assert pile.details["rocking"][2] == pytest.approx(0.5 / 1.2)


def test_section_8_inclined_hinge_with_one_side_wall():
    wall = ROUND.changed(side_walls=1)
    for tangent in (0.2, 0.9, 1.5):
        expected = 0.15 * (3.0 - tangent) / (3.0 - 4.0 / 3.0 * tangent)
        assert value(me.inclined_hinge(wall, crack_tangent=tangent)) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("length", [0.7, 3.0, 20.0])
@pytest.mark.parametrize("side_walls", [1, 2])
def test_section_8_diagonal_hinge_gives_three_halves_of_t_over_h_for_any_length(length, side_walls):
    wall = ROUND.changed(length=length, side_walls=side_walls)
    assert value(me.inclined_hinge(wall)) == pytest.approx(1.5 * 0.15, rel=1e-12)


def test_section_8_rondelet_rule_of_thumb():
    found = [me.rondelet_thickness(length=2.0, height=3.0, divisor=n) for n in (8, 10, 12)]
    assert found == pytest.approx([0.2080, 0.1664, 0.1387], abs=5e-5)
    assert me.rondelet_thickness(length=4.0, height=3.0, side_walls=2) == pytest.approx(found[1])


def test_section_8_godio_wallette():
    # blocks 210 x 81 x 71 mm, 3 by 13, one side wall, f = tan 35
    wall = me.Facade(length=0.63, thickness=0.071, courses=13, course_height=0.081, staggering=0.105,
                     unit_weight=26e3, friction=math.tan(math.radians(35.0)), side_walls=1)
    assert value(me.simple_rocking(wall, side_walls=0)) == pytest.approx(0.0674, abs=5e-5)
    assert value(me.inclined_hinge(wall)) == pytest.approx(0.1011, abs=6e-5)
    flexure = me.horizontal_flexure(wall)
    assert flexure.details["hinge_courses"] == 6
    assert value(flexure) == pytest.approx(0.3295, abs=5e-4)


IN_PLANE = {1: 1.0, 2: 0.714286, 3: 0.636364, 5: 0.578947, 8: 0.548387, 12: 0.531915}


@pytest.mark.parametrize("n", IN_PLANE)
@pytest.mark.parametrize("slope", [1.0, 0.5])
def test_section_8_stepped_crack_in_whole_courses(n, slope):
    wall = me.Facade(length=20.0, thickness=0.2, courses=n, course_height=0.2, staggering=0.2 * slope,
                     unit_weight=20.0, friction=slope)
    prediction = me.stepped_crack(wall)
    assert value(prediction) == pytest.approx(slope * IN_PLANE[n], abs=6e-7)
    assert prediction.bound.startswith("upper")
    assert me.stepped_crack(wall.changed(friction=1.2 * slope)).bound.startswith("estimate")


def test_section_8_slender_wall_ends():
    assert me.slender_wall(1.0, 1.0, 1.0) == pytest.approx(0.5)  # b = 1: v / 2h
    assert me.slender_wall(1e-6, 1.0, 1.0) == pytest.approx(1e-6, rel=1e-5)  # b -> 0: B/H
    for wrong in ({"width": -0.2}, {"height": 0.0}, {"slope": float("nan")}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            me.slender_wall(**{"width": 0.2, "height": 1.0, "slope": 0.5, **wrong})
    wall = me.Facade(
        length=0.8, thickness=0.2, courses=12, course_height=0.2, staggering=0.2, unit_weight=20.0, friction=1.0
    )
    b = 0.8 / 2.4
    assert value(me.stepped_crack(wall)) == pytest.approx(b * (1 - 2 * b / 3) / (1 - b * b / 3))


@pytest.mark.parametrize("friction, expected", [(0.4, 0.43246), (0.65, 0.48123), (1.0, 0.5), (1.3, 0.5)])
def test_section_8_sloping_crack_with_prescribed_friction(friction, expected):
    assert me.sloping_crack_limit(friction, 1.0)[0] == pytest.approx(expected, abs=5e-6)


def test_section_8_sloping_crack_is_the_optimum_of_its_own_power_balance():
    # triangle H x H s over the toe, friction (1 - s) f gamma y b at depth y on every joint, by integration over depth
    f, n = 0.65, 9
    joints = np.arange(1, n + 1)

    def multiplier(s):
        resisting = 0.5 * n**2 * s * (n * s / 3.0) + (1.0 - s) * f * (joints * (n - joints)).sum()
        return resisting / (0.5 * n**2 * s * (2.0 * n / 3.0))

    slopes = np.linspace(0.3, 1.0, 7001)
    values = [multiplier(s) for s in slopes]
    best, tangent = me.sloping_crack_limit(f, 1.0, n)
    assert best == pytest.approx(min(values), abs=1e-7)
    assert tangent == pytest.approx(slopes[int(np.argmin(values))], abs=2e-4)


def test_section_8_sliding_beats_the_sloping_crack_below_four_ninths():
    for f, slides in ((0.44, True), (0.45, False)):
        assert (f < me.sloping_crack_limit(f, 1.0)[0]) == slides


def test_section_8_milankovitch_semicircular_arch():
    limit = me.arch_limit()
    assert limit.thickness == pytest.approx(0.107478, abs=5e-7)
    assert limit.haunch_deg == pytest.approx(54.484, abs=5e-4)
    assert limit.thrust == pytest.approx(0.19763, abs=5e-6)


@pytest.mark.parametrize("angle", [180, 150, 120, 90])
def test_arch_limit_is_approached_from_below_by_the_thrust_line_program(angle):
    few, many = (thinnest(n, angle) for n in (20, 120))
    limit = me.arch_limit(angle).thickness
    assert few < limit
    assert many == pytest.approx(limit, rel=1e-3)
    with pytest.raises(ValueError, match="angle_deg must be a finite number"):
        me.arch_limit(str(angle))


# ---- the search itself ----------------------------------------------------------------------------------------------


def test_smallest_ratio_against_a_scan():
    rng = np.random.default_rng(5)
    for _ in range(60):
        n, d = rng.uniform(-1, 2, 3), rng.uniform(0.1, 1.0, 3)
        best = smallest_ratio(n, d, 0.0, 1.5)
        scan = [ratio(n, d, s) for s in np.linspace(0.0, 1.5, 2001)]
        assert best.value <= min(scan) + 1e-12
        assert best.value >= min(scan) - 1e-5
        assert ratio(n, d, best.at) == best.value


def test_rocking_terms_are_the_polynomials_of_the_power_balance():
    wall = ROUND.changed(overload=3.0, side_overload=2.0, crack_offset=0.37)
    terms = rocking_terms(wall, 8, 5)
    for s in (0.1, 0.6):
        power = me.rocking_power(wall, hinge=8, crossed=5, tangent=s)
        powers = np.array([1.0, s, s * s])
        assert terms.numerator @ powers == pytest.approx(power.lift + power.overload_lift + power.friction, rel=1e-12)
        assert terms.denominator @ powers == pytest.approx(power.travel, rel=1e-12)


def test_the_smallest_ratio_is_found_inside_an_interval_that_ends_at_zero():
    found = smallest_ratio((0.25, 1.0, 1.0), (1.0, 0.5, 1.0), -1.0, 0.0)
    assert found.value == pytest.approx(0.0, abs=1e-15)
    assert found.at == pytest.approx(-0.5)


@pytest.mark.parametrize("points", [5, 6, 201])
def test_a_pole_at_a_quadrature_point_is_pure_torsion(points):
    shear, torque = me.torsion_shear_curve(1.0, 1.0, [0.0, 1.0], points=points)
    assert np.isfinite([shear, torque]).all()
    assert (shear[0], torque[0]) == (pytest.approx(0.0, abs=1e-12), pytest.approx(1.0, abs=0.02))
