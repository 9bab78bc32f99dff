"""Mechanisms on built walls: parameters read off, power balances, contact fields, and limit analysis beside them."""

import math

import numpy as np
import pytest
from facades import JOINT, MU, associative, built, outwards

import limitmason as lm
import mechanisms as me
from limitmason.constants import GRAVITY
from limitmason.errors import InputError, NotApplicable
from limitmason.geometry import box
from limitmason.mechanics.dissipation import point_rates
from mechanisms.classical import flat_levels
from mechanisms.velocity_field import ESTIMATE_INADMISSIBLE, UPPER


def without_heads(wall):
    return wall.with_interfaces([i for i in wall.interfaces if i.kind != "head"])


def column():
    return lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=3, joint=JOINT)


ONE_SMOOTH = {("facade-02-02", "facade-01-02"): lm.Joint(20.0)}


# ---- parameters -----------------------------------------------------------------------------------------------------


def test_parameters_are_read_from_the_recipe():
    facade = me.Facade.from_assembly(built("U", return_thickness=0.25, density=2300.0, staggering=0.15))
    assert (facade.length, facade.thickness, facade.courses, facade.course_height) == (2.4, 0.2, 6, 0.2)
    assert facade.staggering == 0.15
    assert facade.steepest_crack == pytest.approx(0.75)
    assert facade.unit_weight == pytest.approx(2300.0 * GRAVITY)
    assert facade.friction == pytest.approx(MU)
    assert (facade.side_walls, facade.side_wall_thickness) == (2, 0.25)
    assert facade.side_wall_length == pytest.approx(1.4)
    assert facade.overload == facade.side_overload == 0.0
    assert facade.crack_offset == 0.2


def test_reading_and_typing_the_numbers_give_the_same():
    wall = built("U")
    typed = me.Facade(length=2.4, thickness=0.2, courses=6, course_height=0.2, staggering=0.2,
                      unit_weight=2000.0 * GRAVITY, friction=MU, side_walls=2, side_wall_length=1.4)
    for mechanism in (me.simple_rocking, me.compound_rocking, me.horizontal_flexure):
        assert mechanism(wall).collapse_multiplier == pytest.approx(mechanism(typed).collapse_multiplier, rel=1e-12)


def test_beams_and_loads_on_them_become_overloads():
    wall = built("U", top_beam=0.3, beam_over="all", beam_density=2500.0)
    loads = outwards(wall).with_precompression(wall, 5000.0)
    for side in ("left", "right"):
        loads = loads.with_point_load(wall, f"beam-{side}", (0, 0, -2000.0), case="dead")
    facade = me.Facade.from_assembly(wall, loads)
    beam = 2500.0 * GRAVITY * 0.3 * 0.2
    assert facade.overload == pytest.approx(beam + 5000.0 / 2.4)
    assert facade.side_overload == pytest.approx(beam + 2000.0 / 1.4)
    assert facade.overload_offset == pytest.approx(0.1)
    assert facade.overload_inertia == pytest.approx(beam / (beam + 5000.0 / 2.4))
    assert facade.side_overload_inertia == pytest.approx(beam / (beam + 2000.0 / 1.4))
    assert facade.overload_rise == pytest.approx(0.15)


@pytest.mark.parametrize("direction", [-1, 1])
def test_eccentric_load_is_read_from_the_toe_line(direction):
    wall = built(top_beam=0.3)
    beam = wall.centroids[wall.block_index("beam")]
    loads = lm.Loads.horizontal(wall, (0, direction, 0)).with_point_load(
        wall, "beam", (0, 0, -30_000.0), at=(beam[0], 0.05, beam[2]), case="dead"
    )
    facade = me.Facade.from_assembly(wall, loads)
    weight = wall.weights[wall.block_index("beam")]
    y = (weight * 0.1 + 30_000.0 * 0.05) / (weight + 30_000.0)
    assert facade.overload_offset == pytest.approx(y if direction < 0 else 0.2 - y)
    prediction = me.simple_rocking(wall, loads=loads)
    assert prediction.collapse_multiplier == pytest.approx(associative(wall, loads), rel=1e-7)
    assert prediction.bound == UPPER


def test_held_bottom_course_is_the_ground():
    wall = built("U", base="course")
    facade = me.Facade.from_assembly(wall)
    assert facade.courses == 5
    prediction = me.simple_rocking(built(base="course"))
    assert prediction.collapse_multiplier == pytest.approx(0.2, rel=1e-12)
    assert prediction.certificate.kinematic_multiplier == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: me.simple_rocking(column()), "recipe of kind 'wall'"),
        (lambda: me.Facade.from_assembly(built(joints=ONE_SMOOTH)), "friction of the bed joints differs"),
        (lambda: me.compound_rocking(built()), "side_walls must be at least 1"),
        (lambda: me.horizontal_flexure(built("T")), "plan 'T'"),
        (lambda: me.simple_rocking(built("U"), loads=lm.Loads.horizontal(built("U"), (0, 1, 0))), "push the facade"),
        (lambda: me.simple_rocking(built("U"), loads=lm.Loads.weight(built("U"))), "live loads must be the weights"),
        (lambda: me.stepped_crack(built("U")), "side walls must be 0"),
        (lambda: me.simple_rocking(42), "facade must be a mechanisms.Facade"),
        (lambda: me.simple_rocking(built("U"), hinge_courses=7), "hinge_courses must be a whole number from 1 to 6"),
        (lambda: me.compound_rocking(built("U"), hinge_courses=2, crossed_courses=3), "crossed_courses 3 exceeds"),
        (lambda: me.compound_rocking(built("U"), crack="bent"), "crack must be one of"),
        (lambda: me.horizontal_flexure(built("U"), contact_factor=0.0), "contact_factor"),
    ],
)
def test_errors_name_what_is_wrong(make, message):
    with pytest.raises((ValueError, TypeError), match=message):
        make()


@pytest.mark.parametrize(
    "field, value",
    [
        ("length", -1.0),
        ("courses", 2.5),
        ("friction", math.nan),
        ("staggering", 0.0),
        ("overload", -2.0),
        ("side_wall_thickness", "thick"),
    ],
)
def test_facade_names_the_wrong_field(field, value):
    numbers = {"length": 3.0, "thickness": 0.3, "courses": 10, "course_height": 0.2, "staggering": 0.15,
               "unit_weight": 20e3, "friction": 0.6}
    with pytest.raises(ValueError, match=field):
        me.Facade(**{**numbers, field: value})


def test_dead_load_inside_the_wall_is_refused():
    wall = built("U")
    loads = outwards(wall).with_point_load(wall, "facade-03-03", (0, 0, -500.0), case="dead")
    with pytest.raises(ValueError, match="below the top course"):
        me.simple_rocking(wall, loads=loads)


# ---- the power balance with prescribed friction reproduces the multipliers ------------------------------------------


@pytest.mark.parametrize("plan", ["L", "U"])
def test_power_balance_reproduces_every_multiplier(plan):
    wall = built(plan, top_beam=0.2, beam_over="all")
    loads = outwards(wall)
    predictions = [
        me.simple_rocking(wall, loads=loads),
        me.compound_rocking(wall, loads=loads),
        me.compound_rocking(wall, loads=loads, hinge_courses=5, crossed_courses=3, crack_tangent=0.4),
        me.compound_rocking(wall, loads=loads, below_crack="free", crossed_courses=2),
        me.compound_rocking(wall, loads=loads, crack="stepped"),
        me.horizontal_flexure(wall, loads=loads, contact_factor=0.5),
        me.horizontal_flexure(wall, loads=loads, reduction=0.3),
    ]
    for p in predictions:
        assert p.details["power"]["multiplier"] == pytest.approx(p.collapse_multiplier, rel=1e-11)


# ---- motions on the blocks ------------------------------------------------------------------------------------------


def test_motion_is_scaled_and_agrees_with_velocities_at_the_contact_points():
    wall = built("U")
    loads = outwards(wall)
    for prediction in (me.simple_rocking(wall), me.compound_rocking(wall), me.horizontal_flexure(wall)):
        v = prediction.mechanism.twists
        assert v.shape == (wall.n_blocks, 6)
        assert (loads.live * v).sum() == pytest.approx(np.linalg.norm(loads.live[~wall.fixed, :3], axis=1).sum())
        check = me.check_contacts(wall, loads, v)
        opening, slip = point_rates(wall, v, check.points.position, check.points.interface)
        assert check.opening == pytest.approx(opening, abs=1e-9)
        assert check.sliding == pytest.approx(np.linalg.norm(slip, axis=1), abs=1e-9)
        facade = [k for k, b in enumerate(wall.blocks) if b.name.startswith("facade-06")]
        assert (v[facade, 1] <= 1e-12).all()  # outwards
        assert (v[facade, 2] >= -1e-12).all()  # upwards


def test_a_b_and_d_as_published_are_not_contact_fields_and_say_so():
    wall = built("U")
    for prediction in (me.simple_rocking(wall), me.compound_rocking(wall), me.horizontal_flexure(wall)):
        assert prediction.bound == ESTIMATE_INADMISSIBLE
        assert not prediction.details["admissible"]
        assert prediction.certificate.flow_residual > 0.1
        assert np.isnan(prediction.certificate.kinematic_multiplier)


@pytest.mark.parametrize("direction", [(0, -1, 0), (0, 1, 0)])
def test_free_wall_rocks_at_t_over_h_in_all_theories(direction):
    wall = built()
    loads = lm.Loads.horizontal(wall, direction)
    prediction = me.simple_rocking(wall, loads=loads)
    assert prediction.collapse_multiplier == pytest.approx(0.2 / 1.2, rel=1e-12)
    assert prediction.bound == UPPER
    assert prediction.certificate.kinematic_multiplier == pytest.approx(0.2 / 1.2, rel=1e-12)
    assert associative(wall, loads) == pytest.approx(0.2 / 1.2, rel=1e-7)


@pytest.mark.parametrize("mu", [0.3, 0.7, 1.0])
def test_compound_rocking_at_the_bond_angle_is_admissible_on_bed_joints_and_bounds_limit_analysis(mu):
    # at tan(alpha_c) = v/h every unit of the wedge lies over a fixed one, and rises by at least f times its sliding
    wall = without_heads(built("U", joint=lm.Joint.from_friction_coefficient(mu)))
    loads = outwards(wall)
    p = me.compound_rocking(wall, loads=loads, hinge_courses=6, crossed_courses="hinge", crack_tangent=1.0)
    assert p.bound == UPPER
    kinematic = p.certificate.kinematic_multiplier
    value = associative(wall, loads)
    assert value <= kinematic * (1.0 + 1e-7)
    assert kinematic <= p.collapse_multiplier
    if mu == 1.0:  # f = v/h: normality holds on every step, and the two theories meet
        assert value == pytest.approx(kinematic, rel=1e-6)
    else:
        assert value < kinematic * (1.0 - 1e-2)


def test_compound_rocking_steeper_friction_than_bond_is_not_admissible():
    wall = without_heads(built("U", joint=lm.Joint.from_friction_coefficient(1.5)))
    p = me.compound_rocking(wall, hinge_courses=6, crossed_courses="hinge", crack_tangent=1.0)
    assert not p.details["admissible"]
    assert p.bound == ESTIMATE_INADMISSIBLE
    # and limit analysis exceeds what the same blocks give at f = v/h: dilatancy forbids the steps
    assert associative(wall, outwards(wall)) > 0.36


@pytest.mark.exact
@pytest.mark.parametrize("n", [1, 2, 3, 5])
@pytest.mark.parametrize("sense", [1, -1])
def test_section_8_stepped_crack_on_blocks_is_exact_for_friction_equal_to_the_bond_slope(n, sense):
    wall = without_heads(lm.build.wall(length=0.4 * max(3, n + 2), courses=n, unit=(0.4, 0.2, 0.2), start="half",
                                       joint=lm.Joint.from_friction_coefficient(1.0)))
    loads = lm.Loads.horizontal(wall, (sense, 0, 0))
    prediction = me.stepped_crack(wall, loads=loads)
    assert prediction.bound == UPPER
    assert prediction.collapse_multiplier == pytest.approx((4 * n + 2) / (4 * n - 1) / 2, rel=1e-12)
    assert associative(wall, loads) == pytest.approx(prediction.collapse_multiplier, rel=1e-6)


@pytest.mark.parametrize("mu", [0.5, 0.8])
def test_stepped_crack_bounds_limit_analysis_below_the_bond_slope(mu):
    wall = without_heads(built(joint=lm.Joint.from_friction_coefficient(mu)))
    loads = lm.Loads.horizontal(wall)
    prediction = me.stepped_crack(wall, loads=loads)
    assert prediction.bound == UPPER
    assert associative(wall, loads) <= prediction.collapse_multiplier * (1.0 + 1e-7)


def test_stepped_crack_with_head_joints_is_a_bound_without_them_only():
    wall = built()
    prediction = me.stepped_crack(wall)
    assert prediction.bound.startswith("upper without head-joint contact only")
    assert not prediction.details["admissible"]


def test_stepped_crack_above_the_bond_slope_is_no_bound_on_blocks():
    # dilatancy forbids the steps: only staircases of one course stay admissible, far above the closed form
    wall = without_heads(built(joint=lm.Joint.from_friction_coefficient(1.2), start="half"))
    prediction = me.stepped_crack(wall)
    closed = me.stepped_crack(me.Facade.from_assembly(wall, lm.Loads.horizontal(wall)))
    assert closed.bound.startswith("estimate")
    assert closed.collapse_multiplier < associative(wall, lm.Loads.horizontal(wall)) < prediction.collapse_multiplier


@pytest.mark.parametrize("plan", ["straight", "L", "T", "U"])
@pytest.mark.parametrize("direction", [(0, -1, 0), (0, 1, 0), (1, 0, 0)])
def test_overturning_and_sliding_in_one_piece_bound_limit_analysis(plan, direction):
    wall = built(plan, courses=4)
    loads = lm.Loads.horizontal(wall, direction)
    value = associative(wall, loads)
    for mechanism in (me.overturning, me.sliding):
        prediction = mechanism(wall, loads=loads)
        assert prediction.bound == UPPER
        assert value <= prediction.collapse_multiplier * (1.0 + 1e-7)
        assert prediction.collapse_multiplier == pytest.approx(prediction.certificate.kinematic_multiplier)
    assert me.sliding(wall, loads=loads).collapse_multiplier == pytest.approx(MU)


@pytest.mark.exact
def test_overturning_of_a_u_wall_is_its_centre_of_gravity_over_the_toe():
    wall = built("U")
    weight, c = wall.weights[~wall.fixed], wall.centroids[~wall.fixed]
    prediction = me.overturning(wall)
    assert prediction.collapse_multiplier == pytest.approx((weight @ c[:, 1]) / (weight @ c[:, 2]), rel=1e-12)
    assert prediction.details["hinge_height"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.exact
@pytest.mark.parametrize(("push", "exact"), [
    ((1, 1, 0), 2.0**0.5 / 3.0), ((1, 5, 0), 26.0**0.5 / 7.5), ((-5, 1, 0), 26.0**0.5 / 15.0), ((0, -1, 0), 2.0 / 3.0),
])
def test_a_block_pushed_askew_turns_about_a_side_of_its_foot(push, exact):
    """1 x 2 m and 3 m high: about a side s / (H cos), s its depth across it. About its corner alone .707 for .471."""
    block = lm.build.column(width=1.0, depth=2.0, height=3.0, courses=1, joint=lm.Joint(70.0))
    loads = lm.Loads.horizontal(block, push)
    assert me.overturning(block, loads=loads).collapse_multiplier == pytest.approx(exact, rel=1e-12)
    assert lm.limit_analysis(block, loads).collapse_multiplier == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("push", [(0, -1, 0), (0, 1, 0), (1, 2, 0), (-1, 1, 0)])
def test_overturning_of_an_l_is_that_of_one_stone_of_its_shape(push):
    slab, legs = box((-1, -1, -0.2), (2, 2, 0)), [box((0, 0, 0), (1.2, 0.2, 0.8)), box((0, 0.2, 0), (0.2, 0.8, 0.8))]
    stone = lm.Assembly.from_polyhedra([slab, legs], joint=lm.Joint(60.0), fixed=["g"], names=["g", "stone"])
    made = lm.build.wall(
        length=1.2, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(60.0), plan="L", return_length=0.8
    )
    bound = me.overturning(made, loads=lm.Loads.horizontal(made, push)).collapse_multiplier
    exact = lm.limit_analysis(stone, lm.Loads.horizontal(stone, push)).collapse_multiplier
    assert bound == pytest.approx(exact, rel=1e-8)


def test_a_block_that_overhangs_falls_without_a_push_and_says_so():
    """Centre .1 beyond the edge and .1 above it: lambda = -1, below zero; no abutment holds it."""
    outlines = [[(-1, -0.2), (0, -0.2), (0, 0), (-1, 0)], [(-0.3, 0), (0.5, 0), (0.5, 0.2), (-0.3, 0.2)]]
    made = lm.Assembly.from_polygons(outlines, thickness=1.0, joint=lm.Joint(40.0), fixed=[0])
    found = lm.predict(made, lm.Loads.horizontal(made), "mechanisms")
    assert found.collapse_multiplier == pytest.approx(-1.0, rel=1e-9)
    assert "falls under its dead load alone" in found.warnings[0]
    assert str(lm.thrust(made, 0)) == "no thrust along (-1, 0, 0): cannot stand under dead load"


def test_overturning_of_a_stack_finds_the_lowest_joint_and_cohesion_raises_it():
    stack = lm.build.column(width=0.4, depth=0.3, unit_height=0.25, courses=5, joint=JOINT)
    assert len(flat_levels(stack)) == 5
    loads = lm.Loads.horizontal(stack)
    dry = me.overturning(stack, loads=loads)
    assert dry.collapse_multiplier == pytest.approx(0.4 / 1.25, rel=1e-12)
    glued = stack.with_joints(lm.Joint(31.0, cohesion=2e3, tensile_strength=1e3))
    bound = me.overturning(glued, loads=loads).collapse_multiplier
    # plastic tension ft over the section, turning about its edge: ft A b/2
    assert bound == pytest.approx(
        (stack.weights[1:].sum() * 0.2 + 1e3 * 0.12 * 0.2) / (stack.weights[1:].sum() * 0.625)
    )
    assert lm.limit_analysis(glued, loads).collapse_multiplier <= bound * (1.0 + 1e-6)


def test_flexure_moves_continuously_from_its_lines_to_the_middle():
    # on the outer face both triangles are still on their lines and move with the middle on its sides
    wall = lm.build.wall(length=4.8, courses=12, unit=(0.2, 0.1, 0.1), plan="U", return_length=0.6, joint=JOINT)
    prediction = me.horizontal_flexure(wall, hinge_courses=12, crack_tangent=0.5)
    v = prediction.mechanism.twists
    spin = np.unique(np.round(v[np.abs(v).max(axis=1) > 0.0, 3:], 9), axis=0)
    assert len(spin) == 3
    height, reach = 1.2, 0.6

    def outward(x, z, sign):
        """Rate of a point of the outer face in the body whose spin about z has this sign."""
        body = next(k for k in range(wall.n_blocks) if np.abs(v[k]).max() > 0 and np.sign(np.round(v[k, 5], 9)) == sign)
        return -(v[body, :3] + np.cross(v[body, 3:], np.array([x, 0.0, z]) - wall.centroids[body]))[1]

    for z in (0.0, 0.4, 1.2):
        for sign, side, end in ((-1.0, reach, 0.0), (1.0, 4.8 - reach, 4.8)):
            line = side + (end - side) * z / height
            assert outward(line, z, sign) == pytest.approx(0.0, abs=1e-9)
            assert outward(side, z, sign) == pytest.approx(outward(side, z, 0.0), abs=1e-9)
            assert outward(side, 1.2, sign) > 0.1
    # weights on small blocks: the friction-free value of this motion
    check = me.check_contacts(wall, outwards(wall), v)
    expected = 0.1 / 1.2 * (4.8 - 0.6) / (4.8 - 4.0 / 3.0 * 0.6)
    assert check.multiplier == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("way", [(5.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, -2.0), (1.0, 2.0, 3.0)])
@pytest.mark.parametrize(("plan", "direction"), [("straight", (0, 1, 0)), ("straight", (1, 0, 0)), ("U", (0, -1, 0))])
def test_a_wall_that_was_moved_has_the_same_mechanisms(plan, direction, way):
    wall = built(plan, top_beam=0.3 if direction[1] else None)
    moved = wall.transformed(np.eye(3), way)
    here, there = (me.catalogue(w, lm.Loads.horizontal(w, direction))[0] for w in (wall, moved))
    assert list(here) == list(there)
    for name, p in here.items():
        assert there[name].collapse_multiplier == pytest.approx(p.collapse_multiplier, rel=1e-9)
        assert there[name].bound == p.bound
        assert there[name].details.get("hinge_height") == pytest.approx(p.details.get("hinge_height"), abs=1e-9)


def test_the_sloping_crack_refuses_an_overload_and_says_that_cohesion_is_left_out():
    laden = built("straight", top_beam=0.3)
    with pytest.raises(NotApplicable, match="overload must be 0"):
        me.sloping_crack(laden)
    glued = built("straight").with_joints(lambda j: lm.Joint(j.friction_angle_deg, cohesion=1e5, tensile_strength=1e5))
    assert any("cohesion" in w for w in me.sloping_crack(glued).warnings)


@pytest.mark.parametrize("mechanism", [me.inclined_hinge, me.horizontal_flexure])
def test_no_motion_is_given_for_another_number_of_side_walls_than_the_wall_has(mechanism):
    wall = built("U")
    assert mechanism(wall, side_walls=2).mechanism is not None
    alone = mechanism(wall, side_walls=1)
    assert alone.mechanism is None
    assert any("side_walls=1, and the wall has 2" in w for w in alone.warnings)


def test_what_is_no_wall_or_of_another_wall_is_refused_by_name():
    wall, other = built("straight"), built("U")
    for wrong, message in (("x", "loads must be a Loads"), (lm.Loads.horizontal(other), "the loads are for")):
        for mechanism in (me.simple_rocking, me.overturning, me.sliding, me.stepped_crack):
            with pytest.raises(InputError, match=message):
                mechanism(wall, loads=wrong)
    with pytest.raises(InputError, match="include is empty"):
        me.catalogue(wall, lm.Loads.horizontal(wall), include=())
    with pytest.raises(InputError, match="twists must have shape"):
        me.check_contacts(wall, lm.Loads.horizontal(wall), np.zeros((3, 6)))


def test_a_material_gives_the_closed_forms_its_density():
    """Units twice as dense under the same overload: the recipe's density was read, 0.55 in place of 0.47."""
    stone, iron = (lm.Material(density=d, young_modulus=1e9, poisson_ratio=0.2) for d in (4000.0, 9000.0))
    found = []
    for wall in (built("U", density=4000.0), built("U", density=2000.0).with_material(stone)):
        own = outwards(wall)
        top = [b.name.startswith("facade") and b.bounds[1, 2] > wall.recipe["height"] - 1e-6 for b in wall.blocks]
        loads = lm.Loads(own.dead - np.outer(top, (0.0, 0.0, 1000.0, 0.0, 0.0, 0.0)), own.live)
        found.append(me.simple_rocking(wall, loads=loads).collapse_multiplier)
    assert found[1] == found[0]
    with pytest.raises(NotApplicable, match="no one density"):
        me.simple_rocking(wall.with_material(iron, blocks=[wall.n_blocks - 1]))


def test_a_bottom_course_that_may_slide_now_is_no_ground_of_the_closed_forms():
    """Held on its bottom course as built; with that free to slide the forms of a wall on firm ground still answered."""
    wall = built("U", base="course")
    assert me.simple_rocking(wall, loads=outwards(wall)).collapse_multiplier > 0.0
    bottom = [b.name for b, held in zip(wall.blocks, wall.fixed, strict=True) if held]
    loose = wall.with_supports(lm.Support(name, dofs=("z", "rx", "ry", "rz")) for name in bottom)
    with pytest.raises(NotApplicable, match="recipe of kind 'wall'"):
        me.simple_rocking(loose, loads=outwards(loose))
    held = wall.with_supports([lm.Support.fixed(bottom[0])])
    assert held.recipe == wall.recipe


def test_a_load_that_hangs_on_no_mass_pushes_no_side_wall():
    """Of a floor on rollers only the weight is felt: the share of its push falls out of mechanism B."""
    wall = built("U", return_thickness=0.25)
    tops = [b.name for b in wall.blocks if b.name.startswith("return") and b.bounds[1, 2] > 1.19 and b.bounds[0, 1] > 0]
    hung = outwards(wall)
    for name in tops:
        hung = hung.with_point_load(wall, name, (0, 0, -900.0), case="dead")
    mass = hung
    for name in tops:
        mass = mass.with_point_load(wall, name, (0, -900.0, 0))
    given = {"hinge_courses": 6, "crossed_courses": 6, "crack_tangent": 0.5}
    by_mass, by_hanging = (me.compound_rocking(wall, loads=loads, **given) for loads in (mass, hung))
    f = me.Facade.from_assembly(wall, hung)
    assert f.side_overload_inertia == 0.0
    # resisting power over the multiplier is the driving one, of which both side walls' load has 2 q_s b H
    resisting = by_mass.collapse_multiplier * by_mass.details["power"]["travel"]
    without = by_mass.details["power"]["travel"] - 2.0 * f.side_overload * 0.5 * 1.2 * 1.2
    assert by_hanging.collapse_multiplier == pytest.approx(resisting / without, rel=1e-9)
    assert by_hanging.details["power"]["multiplier"] == pytest.approx(by_hanging.collapse_multiplier, rel=1e-9)
    steps = me.compound_rocking(wall, loads=hung, crack="stepped")
    assert steps.details["power"]["multiplier"] == pytest.approx(steps.collapse_multiplier, rel=1e-9)
