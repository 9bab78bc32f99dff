"""Arguments of the mechanisms that are no numbers, or that a mechanism does not take, are refused by name."""

import math

import pytest
from facades import ROUND

import mechanisms as me
from limitmason.errors import InputError, NotApplicable


@pytest.mark.parametrize("crack", [me.stepped_crack, me.sloping_crack])
def test_cracks_in_plane_refuse_an_overload(crack):
    with pytest.raises(NotApplicable, match="overload must be 0"):
        crack(ROUND.changed(side_walls=0, overload=5.0))


@pytest.mark.parametrize(("mechanism", "given"), [
    (me.simple_rocking, {"hinge_courses": "x"}), (me.simple_rocking, {"hinge_courses": math.nan}),
    (me.simple_rocking, {"reduction": "x"}), (me.compound_rocking, {"crossed_courses": math.nan}),
    (me.compound_rocking, {"crack_tangent": "x"}), (me.horizontal_flexure, {"contact_factor": None}),
    (me.horizontal_flexure, {"torsion_arm": "x"}), (me.inclined_hinge, {"crack_tangent": [1]}),
])
def test_what_is_no_number_is_refused_by_name(mechanism, given):
    with pytest.raises(InputError, match=next(iter(given))):
        mechanism(ROUND, **given)


def test_a_given_crack_stays_within_the_side_walls():
    short = ROUND.changed(side_wall_length=1.0 * ROUND.course_height)
    worst = me.compound_rocking(short).collapse_multiplier
    given = me.compound_rocking(short, crack_tangent=short.steepest_crack)
    assert given.details["wedge_width"] <= short.side_wall_length * (1.0 + 1e-9)
    assert given.collapse_multiplier >= worst * (1.0 - 1e-12)
    with pytest.raises(InputError, match="leaves the side walls"):
        me.compound_rocking(short, crack_tangent=short.steepest_crack, hinge_courses=4, crossed_courses=4)


@pytest.mark.parametrize(("given", "message"), [
    ({"hinge": 999, "crossed": 3}, "hinge must be a whole number from 0 to"),
    ({"hinge": 3, "crossed": 4}, "crossed must be a whole number from 0 to 3, got 4"),
    ({"hinge": 3, "crossed": 3, "tangent": 99.0}, "tangent must lie between 0 and"),
    ({"hinge": 3, "crossed": 3, "stepping": [9]}, "stepping: each must be a whole number from 1 to 3"),
    ({"hinge": 3, "crossed": 3, "stepping": [1], "tangent": 0.1}, "give it or stepping, not both"),
    ({"hinge": 3, "crossed": 3, "reduction": 5.0}, "reduction must lie between 0"),
])
def test_powers_of_rocking_are_those_of_the_facade(given, message):
    with pytest.raises(InputError, match=message):
        me.rocking_power(ROUND, **given)


@pytest.mark.parametrize(("given", "message"), [
    ({"hinge": 999, "tangent": 0.1, "torsion_radius": 0.1}, "hinge must be a whole number from 1 to"),
    ({"hinge": 3, "tangent": 99.0, "torsion_radius": 0.1}, "tangent 99.0 must not exceed"),
    ({"hinge": 3, "tangent": 0.1, "torsion_radius": "x"}, "torsion_radius must be a finite number"),
])
def test_powers_of_flexure_are_those_of_the_facade(given, message):
    with pytest.raises(InputError, match=message):
        me.flexure_power(ROUND.changed(side_walls=2), **given)


def test_upright_cracks_that_friction_holds_are_no_flexure():
    with pytest.raises(InputError, match="crack_tangent must be above 0, got 0"):
        me.horizontal_flexure(ROUND, crack_tangent=0)
    smooth = me.horizontal_flexure(ROUND.changed(friction=0.0), crack_tangent=0)
    assert smooth.collapse_multiplier == pytest.approx(ROUND.thickness / ROUND.height)


def test_nan_is_refused_by_friction_and_curves():
    with pytest.raises(InputError, match="crack tangent"):
        me.crack_angle_reduction(math.nan, 0.5)
    with pytest.raises(InputError, match="friction"):
        me.bed_joint_friction(friction=math.nan, unit_weight=1.0, thickness=1.0, staggering=1.0, course_height=1.0,
                              crossed=2)
    with pytest.raises(InputError, match="unit_weight must be a finite number"):
        me.bed_joint_friction(friction=0.5, unit_weight=math.nan, thickness=1.0, staggering=1.0, course_height=1.0,
                              crossed=2)
    with pytest.raises(InputError, match="load is not finite at sample 2"):
        me.light_damage([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, math.nan, 1.0])
