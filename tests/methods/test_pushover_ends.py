"""Where a capacity curve ends, and what it says of its end: a plateau of sliding, rocking, a bifurcation."""

import math

import numpy as np
import pytest
from walls import arch_blocks, on_slab

import limitmason as lm
from limitmason.capacity import Steps


@pytest.mark.parametrize("size", [1e-2, 1.0])
def test_a_wall_that_slides_on_its_bed_ends_on_a_plateau(size):
    """It slides at tan(phi) and the load never falls: the plateau is the limit."""
    wall = lm.build.wall(length=0.8 * size, courses=3, unit=(0.4 * size, 0.2 * size, 0.2 * size), joint=lm.Joint(33.0))
    found = lm.predict(wall, lm.Loads.horizontal(wall), "pushover")
    assert found.status == "solved"
    assert found.collapse_multiplier == pytest.approx(math.tan(math.radians(33.0)), rel=1e-5)
    assert found.details["curve"].status == "slides on at constant load"


@pytest.mark.parametrize("stiffness", [1e12, 1e13, 1e14])
@pytest.mark.parametrize(("friction_deg", "load", "status"), [
    (40.0, 0.5, "limit point passed"), (20.0, math.tan(math.radians(20.0)), "slides on at constant load"),
])
def test_on_stiff_joints_a_block_that_rocks_does_not_slide_on(stiffness, friction_deg, load, status):
    """A block rocks at b / h, and slides at tan(phi); in some nanometres neither load falls."""
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.4))], joint=lm.Joint(friction_deg))
    curve = lm.pushover(block, lm.Loads.horizontal(block), stiffness=stiffness)
    assert curve.status == status
    assert curve.first_limit_point.load == pytest.approx(load, rel=1e-6)
    assert curve.displacement[-1] > 1e-5


@pytest.mark.parametrize("points", ["vertices", "lobatto"])
def test_a_column_that_could_buckle_says_where_its_straight_path_is_left(points):
    """(1 + lambda) W h / 2 = K: the springs of the foot against the weight and a load at the middle of the height.

    K = kn b^4 / 12 on points that turn as the face does, three times that on corners.
    """
    kn, b, h = 3e6, 0.2, 0.8
    column = on_slab([((0, 0, 0), (b, b, h))], joint=lm.Joint(40.0))
    live = np.zeros((2, 6))
    live[1, 2] = -column.weights[1]
    loads = lm.Loads(lm.Loads.weight(column).dead, live)
    critical = kn * b**4 / 12.0 * (3.0 if points == "vertices" else 1.0) / (column.weights[1] * h / 2.0) - 1.0
    shortened = critical * column.weights[1] / (kn * b**2)

    def pressed(to):
        curve = lm.pushover(column, loads, stiffness=kn, contact_model=points, to=to, steps=Steps(largest=1e-3))
        return curve, [w for w in curve.warnings if w.startswith("bifurcation")]

    curve, said = pressed(0.99 * shortened)
    assert not said
    curve, said = pressed(1.2 * shortened)
    straight = np.abs(curve.nodes[-1].pose.shift[1, :2]).max()
    assert straight < 1e-9
    stands = np.array([curve.stability(k) != "unstable" for k in range(len(curve))])
    assert (stands == (curve.multiplier < critical)).all()
    first = int(np.argmin(stands))
    assert f"{(~stands).sum()} of {len(curve)} samples" in said[0]
    assert f"lambda {curve.multiplier[first]:.5g}" in said[0]


def test_the_force_of_a_curve_is_that_on_the_blocks_that_move():
    """A block of 0.4 m x 1 m rocks at 0.4 of its weight; that of the slab, which is held, goes straight to the ground.

    The slab weighs 0.7 of the block here: the force was 1.7 times too large.
    """
    block = on_slab([((0, 0, 0), (0.4, 1, 1))], joint=lm.Joint(35.0))
    force = lm.pushover(block, lm.Loads.horizontal(block), stiffness=1e12).as_force()
    assert block.weights[0] > 0.5 * block.weights[1]
    assert force.peak.load == pytest.approx(0.4 * block.weights[1], rel=1e-4)
    assert force.multiplier.max() == pytest.approx(0.4, rel=1e-4)


def test_either_springer_that_moves_has_its_peak_where_its_thrust_is_largest():
    """Mirrored springers have mirrored curves; the right one, moved inwards against x, had its peak at the begin."""
    arch = arch_blocks(5.0, 0.9, 11)
    moved = {
        (block, to): lm.pushover(arch, lm.Loads.weight(arch), control=(block, "x"), to=to, stiffness=1e9)
        for block, to in ((0, 0.01), (1, -0.01), (0, -0.01), (1, 0.01))
    }
    for left, right, inwards in (((0, 0.01), (1, -0.01), True), ((0, -0.01), (1, 0.01), False)):
        one, other = moved[left], moved[right]
        assert np.allclose(other.load, -one.load, rtol=1e-6)
        assert other.peak.load == pytest.approx(-one.peak.load, rel=1e-6)
        assert abs(other.peak.load) == pytest.approx(np.abs(other.load).max(), rel=1e-9)
        # outwards the thrust falls from the begin
        assert (other.peak.index > 0) == inwards
        assert (other.first_limit_point is None) == (one.first_limit_point is None) == (not inwards)


@pytest.mark.parametrize(("sides", "off", "exact"), [
    ((1.0, 1.0), 0.2, 0.84481), ((1.0, 1.0), 0.4, 0.64995), ((1.0, 0.5), 0.2, 0.94511), ((1.0, 0.5), 0.4, 0.82277),
])
def test_a_block_pushed_off_its_centre_slides_as_under_even_pressure_or_the_answer_says_why_not(sides, off, exact):
    """Largest push over mu W under even pressure: least mean distance from a pole over the arm of the push about it.

    Corners carry up to a quarter more. Neither the path nor limit analysis said so where faces also slide.
    """
    block = on_slab([((0, 0, 0), (*sides, 0.1))], joint=lm.Joint(35.0))
    mu, at = math.tan(math.radians(35.0)), (sides[0] / 2, sides[1] * (0.5 + off), 0.0)
    loads = lm.Loads.weight(block).with_point_load(block, 1, (mu * block.weights[1], 0, 0), at=at)
    faces = lm.predict(block, loads, "pushover", contact_model="lobatto", grid=(9, 9))
    assert faces.collapse_multiplier == pytest.approx(exact, rel=1e-3)
    assert not any("twist" in w for w in faces.warnings)
    for method in ("pushover", "associative", "non-associative"):
        found = lm.predict(block, loads, method)
        assert found.collapse_multiplier > 1.03 * exact
        assert any("torsion" in w for w in found.warnings), method
    # through the centre nothing twists
    through = lm.Loads.horizontal(block)
    for method in ("pushover", "associative", "non-associative"):
        assert not any("torsion" in w for w in lm.predict(block, through, method).warnings), method


def test_a_path_whose_control_turns_back_says_what_goes_on():
    """A weight beside a block tips it about its edge, by which its centroid rises: the path stopped without a word."""
    joint = lm.Joint(40.0, normal_stiffness=1e9, shear_stiffness=5e8)
    pile = lm.build.column(width=0.4, depth=0.3, unit_height=0.3, courses=3, joint=joint)
    loads = lm.Loads.weight(pile)
    with pytest.warns(lm.PlausibilityWarning, match="outside the block"):
        loads = loads.with_point_load(pile, 3, (0, 0, -pile.weights[1]), at=(0.55, 0.15, 0.9))
    stopped = lm.pushover(pile, loads, to=3e-3, steps=Steps(most=3))
    assert any("give control=(block, axis)" in w for w in stopped.warnings)
    on = lm.pushover(pile, loads, to=3e-3, control=(3, "x"))
    assert on.status == "reached"
    assert on.peak.load == pytest.approx(4.0 / 3.0, rel=2e-3)  # W b / 2 = lambda W (0.55 - b)
    assert not any("control=" in w for w in on.warnings)


@pytest.mark.parametrize("along", [(1, 0, 0), (0, 1, 0)])
def test_a_control_that_the_load_does_not_move_is_refused(along):
    """A column under its weight, pushed sideways: its blocks rise or fall by rounding alone, which overflowed."""
    pile = lm.build.column(width=0.4, depth=0.3, unit_height=0.3, courses=2, joint=lm.Joint(33.0))
    with pytest.raises(lm.errors.InputError, match="does not move block 'column-1' along 'z': give an axis"):
        lm.pushover(pile, lm.Loads.horizontal(pile, along), to=1e-3, control=(1, "z"))
