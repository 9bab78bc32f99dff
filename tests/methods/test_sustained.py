"""What a wall still carries after it has lost equilibrium: the sustained load, random gaps, and spreads beside it."""

import math

import numpy as np
import pytest

import limitmason as lm
from limitmason.capacity import imperfection_ensemble
from limitmason.capacity.ensemble import first_loss, thickness
from limitmason.errors import InputError, NotConverged
from limitmason.geometry.polyhedron import Solid, box
from limitmason.mechanics.plane import contacts_stay_in_plane, find_plane


def column(psi=0.0):
    wall = lm.build.column(width=0.2, depth=0.2, height=1.0, courses=1, joint=lm.Joint(60.0, psi))
    return wall, lm.Loads.horizontal(wall)


@pytest.mark.slow
def test_a_rocking_block_sustains_what_it_carries_turned():
    """Lambda = tan(alpha - theta), with the centroid moved by a tenth of the width."""
    wall, loads = column()
    found = lm.predict(wall, loads, "sustained", stiffness=1e10)
    alpha, arm = math.atan(0.2), math.hypot(0.1, 0.5)
    theta = alpha - math.asin(math.sin(alpha) - 0.02 / arm)
    assert found.status == "solved"
    assert found.details["first loss"] == pytest.approx(0.2, rel=1e-9)
    assert found.collapse_multiplier == pytest.approx(math.tan(alpha - theta), abs=2e-5)
    assert found.details["largest on the way"] == pytest.approx(0.2, abs=1e-4)
    assert found.bound.kind == "estimate"
    further = lm.predict(wall, loads, "sustained", stiffness=1e10, goes_on=0.2)
    theta = alpha - math.asin(math.sin(alpha) - 0.04 / arm)
    assert further.collapse_multiplier == pytest.approx(math.tan(alpha - theta), abs=2e-5)


def test_a_tied_pier_sustains_its_weight_and_its_rod():
    """Lambda = (W x + T a) / (W z) about the toe, with the rod yielding; at first (W t / 2 + T h) / (W H / 2)."""
    thick, high, at, reach, pull = 0.3, 3.0, 2.8, 3.0, 5e3
    joint = lm.Joint(60.0, normal_stiffness=1e10, shear_stiffness=1e10)
    wall = lm.build.column(width=2.0, depth=thick, height=high, courses=1, joint=joint)
    rod = lm.Tie("column-1", (1.0, 0.0, at), None, (1.0, reach, at), yield_force=pull, stiffness=1e7)
    wall = wall.with_ties([rod])
    weight = wall.weights[wall.block_index("column-1")]
    found = lm.predict(wall, lm.Loads.horizontal(wall, (0, -1, 0)), "sustained")
    curve = found.details["curve"]
    assert found.status == "solved"
    assert curve.tie_force[0, 0] == pytest.approx(pull, rel=1e-6)
    assert found.details["first loss"] == pytest.approx((weight * thick + 2.0 * pull * at) / (weight * high), rel=1e-6)
    # the toe is the outer edge, y = 0; the centroid has moved by a tenth of the thickness towards -y
    slope, arm = math.atan(thick / high), math.hypot(0.5 * thick, 0.5 * high)
    turn = slope - math.asin(math.sin(slope) - 0.1 * thick / arm)
    end = np.array([-at * math.sin(turn), at * math.cos(turn)])
    along = np.array([reach, at]) - end
    lever = (end[1] * along[0] - end[0] * along[1]) / np.linalg.norm(along)
    x, z = arm * math.sin(slope - turn), arm * math.cos(slope - turn)
    assert found.collapse_multiplier == pytest.approx((weight * x + pull * lever) / (weight * z), abs=2e-5)


@pytest.mark.slow
def test_a_tied_wall_sustains_a_load_from_a_state_whose_tangent_is_singular():
    """Newton's method finds no step there; the joint forces balance to 1e-9 of a block, which is enough."""
    wall = lm.build.wall(length=1.6, courses=6, unit=(0.4, 0.2, 0.2), joint=lm.Joint(35.0))
    rod = lm.Tie("facade-06-01", (0.0, 0.1, 1.1), None, (-1.0, 0.1, 1.1), yield_force=800.0)
    loads = lm.Loads.horizontal(wall)
    bare, found = (lm.predict(w, loads, "sustained") for w in (wall, wall.with_ties([rod])))
    assert found.status == bare.status == "solved"
    # the rod holds a stone that no smallest mechanism takes along
    assert found.details["first loss"] == pytest.approx(bare.details["first loss"], rel=1e-6)
    assert found.collapse_multiplier == pytest.approx(bare.collapse_multiplier, rel=1e-4)


def l_wall():
    wall = lm.build.wall(
        unit=(0.08, 0.04, 0.04), joint=lm.Joint(33.82), plan="L", length=0.16, return_length=0.12, courses=4
    )
    return wall, lm.Loads.horizontal(wall, (0, -1, 0))


@pytest.fixture(scope="module")
def compared():
    wall, loads = l_wall()
    return wall, loads, lm.compare(
        wall, loads, ("associative", "non-associative", "sustained", "pushover"),
        non_associative={"search": "quick"}, sustained={"stiffness": 6e10}, pushover={"stiffness": 6e10},
    )


@pytest.mark.slow
def test_a_path_begins_in_the_smallest_state_and_forgets_its_self_stress(compared):
    """It starts with the joint forces of the state in the reference pose; a tenth of the thickness on, no path has any
    memory of it: those from the unstressed wall, on softer joints or on other points, carry the same. (On stiff joints
    with points at the corners one from the unstressed wall jumps to a branch 2 % above it.)
    """
    wall, loads, both = compared
    smallest, found = both["non-associative"].prediction, both["sustained"].prediction
    curve = found.details["curve"]
    assert curve.multiplier[0] == pytest.approx(smallest.collapse_multiplier, abs=1e-9)
    assert np.abs(curve.nodes[0].pose.shift).max() < 1e-9
    force = curve.resultants(0).point_force
    assert force == pytest.approx(smallest.resultants.point_force, abs=1e-6 * np.abs(force).max())
    assert all(c.accepted for c in curve.certificates)
    assert smallest.collapse_multiplier < 0.9 * both["associative"].multiplier
    for stiffness, points in ((6e9, {}), (6e10, {"contact_model": "grid", "grid": (2, 4)})):
        unstressed = lm.pushover(wall, loads, to=0.004, stiffness=stiffness, contacts="first", **points)
        assert unstressed.multiplier[-1] == pytest.approx(found.collapse_multiplier, rel=0.002)
    soft = lm.predict(wall, loads, "sustained", smallest=smallest, stiffness=6e9)
    assert soft.collapse_multiplier == pytest.approx(found.collapse_multiplier, rel=0.01)


@pytest.mark.slow
def test_a_comparison_says_what_its_three_loads_are(compared):
    wall, loads, both = compared
    row = both["sustained"]
    assert row.details["first loss"] == both["non-associative"].multiplier  # no second search
    assert "4 mm" in str(row.bound)
    text = both.table()
    for words in (
        "first loss of equilibrium: 0.38462",
        "sustained: 0.35",
        "first limit point: ",
        "associative: 0.44126",
    ):
        assert words in text
    assert "on the way" in both.as_markdown()
    assert lm.compare(wall, loads, ("associative",)).loads_of_self_stress() == ()


def test_what_cannot_begin_is_refused():
    wall, loads = l_wall()
    own = lm.limit_analysis(wall, loads)
    with pytest.raises(InputError, match=r"to \[m\] must be a finite number"):
        lm.pushover(wall, loads, initial=own, to="1e-3")
    other = lm.limit_analysis(wall, loads, contact_model="grid", grid=(3, 3))
    with pytest.raises(InputError, match="same contact_model and grid"):
        lm.pushover(wall, loads, initial=other, to=1e-3)
    with pytest.raises(InputError, match="without gaps, start"):
        lm.pushover(wall, loads, initial=own, gaps=np.zeros(136), to=1e-3)
    with pytest.raises(InputError, match="goes_on"):
        lm.predict(wall, loads, "sustained", goes_on=0.0)
    joint = lm.Joint(10.0)
    weak = lm.build.column(width=0.4, depth=0.4, height=0.4, courses=2, joint=joint)
    pushed = lm.Loads.horizontal(weak).with_body_force(weak, (0.5, 0.0, 0.0), case="dead")
    with pytest.raises(NotConverged, match="no smallest state"):
        lm.predict(weak, pushed, "sustained")


@pytest.mark.slow
def test_the_first_limit_point_has_the_spread_that_is_asked_for():
    """A block on its toe: ks changes nothing, nor does a push the other way; corners are points of every grid."""
    wall, loads = column()
    plain = lm.predict(wall, loads, "pushover", stiffness=1e10)
    found = lm.predict(wall, loads, "pushover", stiffness=1e10, spread=("ks/kn", "preload", "grid"))
    assert found.collapse_multiplier == plain.collapse_multiplier
    assert set(found.error_budget) == {"ks/kn", "preload", "grid"}
    assert abs(found.error_budget["ks/kn"]["change"]) < 1e-3
    assert abs(found.error_budget["preload"]["change"]) < 1e-3
    assert set(found.error_budget["grid"]) == {"change", "resolution", "2 x 4", "2 x 8", "4 x 8"}
    assert found.range.low <= plain.collapse_multiplier <= found.range.high
    assert found.range.high - found.range.low < 2e-3
    assert "spread over ks/kn, preload, grid" in found.range.meaning
    with pytest.raises(InputError, match="spread must be out of"):
        lm.predict(wall, loads, "pushover", stiffness=1e10, spread=("weather",))


def test_what_is_carried_again_soon_is_no_loss():
    u = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 20.0, 21.0])
    rattles = np.array([0.0, 0.1, 0.05, 0.12, 0.3, 0.2, 0.1])
    assert first_loss(u, rattles, 10.0) == 0.3
    assert first_loss(u, rattles, 1.5) == 0.1
    arrested = np.array([0.0, 0.1, 0.25, 0.24, 0.24, 0.26, 0.1])
    assert first_loss(u, arrested, 10.0) == 0.25
    assert math.isnan(first_loss(u, np.sort(arrested), 10.0))


@pytest.mark.slow
def test_gaps_spread_the_first_loss_of_a_wall_in_space_more_than_what_it_sustains():
    wall, loads = l_wall()
    found = imperfection_ensemble(
        wall, loads, gap=1e-4, samples=4, seed=1, stiffness=6e9, contacts="first", contact_model="grid", grid=(2, 4)
    )
    lost, kept = found.spread_of_first_loss, found.spread_of_sustained
    assert min(lost.paths, kept.paths) >= 4
    assert (kept.high - kept.low) / kept.median < 0.01
    assert (lost.high - lost.low) / lost.median > 0.03
    assert lost.low <= lost.median <= lost.high < 0.44126 * 1.01
    assert len(found.curves) == 4
    assert "sustained" in str(found)


@pytest.mark.slow
def test_the_spread_of_a_wall_whose_joints_break_is_that_of_what_it_stands_for():
    # glued blocks lose their bond first, at 0.22, and rock at 0.25 afterwards, whatever ks is
    joint = lm.Joint(35.0, cohesion=5e3, tensile_strength=500.0, residual_cohesion=0.0, residual_tensile_strength=0.0)
    tower = lm.build.column(width=0.5, depth=0.25, unit_height=1.0, courses=2, joint=joint)
    found = lm.predict(
        tower, lm.Loads.horizontal(tower), "pushover", stiffness=1e9, spread=("ks/kn",), contact_model="vertices"
    )
    assert found.collapse_multiplier == pytest.approx(0.25, rel=2e-3)
    assert found.details["curve"].first_limit_point.load < 0.9 * found.collapse_multiplier
    assert abs(found.error_budget["ks/kn"]["change"]) < 1e-3
    assert found.interval[0] > 0.999 * found.collapse_multiplier


def test_paths_from_gaps_follow_the_load_whatever_the_control_and_tell_the_force_of_a_support():
    stack = lm.build.column(width=0.4, depth=0.2, unit_height=0.1, courses=2, joint=lm.Joint(30.0))
    west = lm.Loads.horizontal(stack, (-1, 0, 0))
    # a control whose axis looks against the load was pushed against it: -0.577, and lost at the first step
    found = imperfection_ensemble(stack, west, samples=1, control=(2, "x"))
    assert found.first_loss == pytest.approx([math.tan(math.radians(30.0))], rel=1e-3)
    assert found.sustained == pytest.approx([math.tan(math.radians(30.0))], rel=1e-3)
    assert found.curves[0].displacement[-1] < 0.0
    held = lm.Assembly.from_polygons(
        [[(0, 0), (0.4, 0), (0.4, 0.1), (0, 0.1)], [(1, 0), (1.4, 0), (1.4, 0.1), (1, 0.1)],
         [(0, 0.1), (1.4, 0.1), (1.4, 0.3), (0, 0.3)]], thickness=0.2, joint=lm.Joint(30.0), fixed=[0, 1],
    )
    slid = imperfection_ensemble(held, lm.Loads.weight(held), samples=1, control=(1, "x"))
    half = 0.5 * held.weights[2] * math.tan(math.radians(30.0))  # on one of two supports
    assert slid.curves[0].load_unit == "N"
    assert slid.sustained == pytest.approx([half], rel=0.02)
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    rigid = lm.Assembly.from_polygons([square], thickness=0.2, joint=lm.Joint(30.0), fixed=[0])
    with pytest.raises(InputError, match="every block is held"):
        imperfection_ensemble(rigid, lm.Loads.horizontal(rigid))


def test_gaps_of_a_block_with_sloping_sides_lean_it_as_far_as_they_open():
    """Its path is followed in space, as its sides may meet others off the plane: so many points have gaps.

    A frustum leans by the slope of its gap, at most twice the gap over the width: lambda = tan(atan(b / 2 z) +- lean).
    """
    bottom = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    top = [(0.2, 0.2, 1), (0.8, 0.2, 1), (0.8, 0.8, 1), (0.2, 0.8, 1)]
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    solids = [box((-0.5, -0.5, -0.2), (1.5, 1.5, 0)), Solid(np.array(bottom + top, dtype=float), faces)]
    block = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(60.0), fixed=[0])
    assert not contacts_stay_in_plane(block, find_plane(block, lm.Loads.horizontal(block)))
    found = imperfection_ensemble(block, lm.Loads.horizontal(block), gap=1e-3, samples=2, stiffness=1e10)
    lean = np.arctan(2e-3 * np.cbrt(block.volumes[1]))
    low, high = np.tan(np.arctan(0.5 / block.centroids[1, 2]) + lean * np.array([-1.0, 1.0]))
    assert ((low - 1e-4 < found.first_loss) & (found.first_loss < high + 1e-4)).all()
    assert np.ptp(found.first_loss) > 0.5 * (high - low)


def test_the_smallest_dimension_does_not_hang_on_how_a_block_is_turned():
    column = lm.build.column(width=0.2, depth=0.1, unit_height=0.3, courses=3, joint=lm.Joint(30.0))
    a = np.radians(30.0)
    turn = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    assert thickness(column) == pytest.approx(0.1)
    assert thickness(column.transformed(turn)) == pytest.approx(0.1)
