"""What a path finds on default steps and points beside finer ones: the same, or it says that it may not be."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from referee.engines import ENGINES
from referee.paths import finer
from referee.statics import Statics

import dem
import limitmason as lm
from limitmason.capacity import Steps
from limitmason.capacity.contact_generations import RUNS_OFF
from limitmason.capacity.contact_search.crossing import is_crossing
from limitmason.capacity.contact_search.touching import outside
from limitmason.capacity.contacts import NO_CORNER
from limitmason.geometry import box
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.plane import find_plane

MU = 0.4


@cache
def path(seed, case, times=1):
    """Curve of a random structure, with default steps or finer ones."""
    return lm.pushover(*ENGINES["pushover"].model(seed, case).build(), steps=None if times == 1 else finer(times))


# falls of 0.2 % behind the first limit point were leapt over by steps that ended 2.3 and 15 % higher; points that let
# go at once ended on a branch 1.4 % higher, with a crushing toe 2.5 %; limit points in a step whose end bears more were
# left out: 1.31 for .44, 1.49 for .839, .150 for .133 in (61, 31 to 37); a state near by, reached by a jump, was given
# up for one far away: .281 for .349 in (61, 86) with finer steps; points inside a face that had left it waited for an
# heir that none has, and loads that they then took off counted as falls of the structure: .549 for .530 in (31, 214);
# bonds went on beyond the ends of their faces: 9.55 for 10.75 in (61, 68)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "case"),
    [(1, 13), (1, 40), (1, 47), (31, 23), (31, 214), (51, 15), (61, 31), (61, 36), (61, 37), (61, 68), (61, 86)],
)
def test_steps_of_all_kinds_that_are_finer_find_the_same_largest_load(seed, case):
    usual, fine = (path(seed, case, times) for times in (1, 4))
    assert usual.peak.load == pytest.approx(fine.peak.load, rel=2e-3)
    # first limit points hung on dips that only finer steps see: 10.74 and 7.48 in (61, 68), .0089 and .0058 in (1, 47)
    assert usual.first_limit_point.load == pytest.approx(fine.first_limit_point.load, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("times", [1.1, 1.5])
def test_a_fall_between_two_rises_is_found_wherever_steps_end(times):
    """One point lets go and others take hold within 5 % of the displacement: 1.0015 for .8181, at 3 of 16 ratios."""
    found, fine = (path(1, 40, t).first_limit_point.load for t in (times, 16.0))
    assert found == pytest.approx(fine, rel=1e-3)


@pytest.mark.slow
def test_a_load_that_rises_and_falls_while_slip_turns_is_found_or_a_bifurcation_named_wherever_steps_end():
    """Rubble with ft and no cohesion slides .18 m. There one path falls, and another goes on over states that do not
    stand, to 3.5 % more. With steps 1.7 times finer one of 1.4 mm passed over both: 2.31."""
    problem = ENGINES["pushover bonds"].model(9102, 53).build()
    curves = [lm.pushover(*problem, steps=finer(times)) for times in (1.0, 1.7, 2.0, 4.0)]
    tops = [curve.first_limit_point.load for curve in curves]
    assert max(tops) < 1.05 * min(tops)
    for curve, top in zip(curves, tops, strict=True):
        assert top < 1.01 * min(tops) or any("bifurcation" in told for told in curve.warnings)


@pytest.mark.slow
def test_where_no_path_leads_on_every_step_leaps_at_the_same_load_as_another_control():
    """Rubble with ft beyond the tip of the cone: points that come to tension lose all shear, and a wedge slides .1 mm.

    Longer steps ended beyond it, from 1.92 and 2.12 on and without a word. With the wedge as control it is the same.
    """
    usual, fine = path(1, 15), path(1, 15, 4)
    problem = ENGINES["pushover"].model(1, 15).build()
    begun = lm.pushover(*problem, to=6e-6)
    wedge = lm.pushover(*problem, start=begun, control=(problem[0].blocks[1].name, "z"), to=3e-6, steps=finer(4))
    for curve in (usual, fine, wedge):
        (leap,) = curve.jumps
        assert curve.load[leap - 1] == pytest.approx(wedge.load[wedge.jumps[0] - 1], rel=1e-3)
        assert curve.load[leap] > 1.07 * curve.load[leap - 1]
        assert any("to a state that no path leads to" in w for w in curve.warnings)
    nearly = [c._crossing(0.98 * c.peak.load, c.peak.index) for c in (usual, fine)]
    assert nearly[0] == pytest.approx(nearly[1], rel=2e-3)  # 11 % apart before, 19 with blocks that deform


def test_a_displacement_that_hangs_on_the_last_digits_of_the_load_is_told():
    """A block on a bed, pressed over s, bears (b / 2 - s / 3) / a - theta, s^2 = 2 W / (kn t theta), a its arm."""
    bed = [(-0.5, -0.2), (0.7, -0.2), (0.7, 0.0), (-0.5, 0.0)]
    outline = [(0.0, 0.0), (0.2, 0.0), (0.2, 1.0), (0.0, 1.0)]
    joint = lm.Joint.from_friction_coefficient(1.5, normal_stiffness=1e11, shear_stiffness=1e11)
    block = lm.Assembly.from_polygons([bed, outline], thickness=0.2, joint=joint, fixed=[0])
    loads = lm.Loads.horizontal(block, (1.0, 0.0, 0.0))
    turn = np.geomspace(1e-7, 1e-2, 10001)
    load = 0.2 - np.minimum(np.sqrt(2.0 * block.weights[1] / (1e11 * 0.2 * turn)), 0.2) / 1.5 - turn
    top = int(load.argmax())
    at, after = np.interp((0.98 * load[top], 0.981 * load[top]), load[: top + 1], turn[: top + 1])
    assert after / at - 1.0 == pytest.approx(0.045, abs=1e-3)
    curve = lm.pushover(block, loads, contact_model="lobatto", grid=(200, 200))
    (said,) = [w for w in curve.warnings if "the curve is flat" in w]
    assert "0.1% of the load is 5% of the displacement at 98% of it" in said or "is 4% of" in said
    on_corners = lm.pushover(block, loads)  # straight up to the load at which it turns
    assert not any("the curve is flat" in w for w in on_corners.warnings)


@pytest.mark.slow
def test_a_jump_goes_to_the_state_near_by_and_the_path_ends_where_distinct_elements_fall():
    """At psi = 0 the control displacement turns back on the way: what comes next lies 0.7 % higher, beside it."""
    wall, loads = ENGINES["pushover"].model(61, 86).build()
    curve = path(61, 86, 4)
    fell = dem.collapse(wall, loads, contact_model="vertices", error_budget=())
    assert curve.peak.load == pytest.approx(fell.collapse_multiplier, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "case"), [(31, 214), (61, 68)])
def test_what_bears_lies_on_its_face(seed, case):
    """Pressed or bonded, no point goes farther off than a step may carry it; one that nothing can follow is gone."""
    made = (curve := path(seed, case)).generations
    for node in curve.nodes:
        points = made.structures[node.generation].points
        off = outside(made.shapes, points, node.pose) / made.shapes.step
        crosses = is_crossing(made.shapes, points)
        assert off[(node.force[:, 0] != 0.0) & ~crosses].max() <= RUNS_OFF
        if points.components == 2 and node.onward is not None:
            onward = made.structures[node.onward.generation].points
            inside = onward.corner == NO_CORNER
            assert outside(made.shapes, onward, node.pose)[inside].max() <= made.shapes.step


@pytest.mark.slow
def test_a_load_that_slides_on_below_its_limit_point_ends_the_path():
    """By own statics it is .122; what the blocks meet 95 mm on bears .552."""
    model = ENGINES["pushover"].model(61, 94)
    curve = lm.pushover(*model.build())
    assert curve.status in ("limit point passed", "slides on at constant load")
    assert curve.peak.load == pytest.approx(Statics(model).limit(), rel=5e-3)


@pytest.mark.slow
def test_a_load_that_falls_where_contacts_are_found_anew_is_told():
    """The handover takes off load at no displacement."""
    wall, loads = ENGINES["pushover"].model(31, 214).build()
    curve = lm.pushover(wall, loads)
    changes = [k for k in curve.jumps if curve.nodes[k - 1].onward is not None]
    fell = max(1.0 - curve.load[k] / curve.load[k - 1] for k in changes)
    assert fell > 2e-3
    assert any("where contacts were found anew the load fell by up to" in w for w in curve.warnings)


WIDE, HIGH, STOP = 0.2, 1.0, 0.8


def rocks_to_a_stop(stiffness, theta):
    """Path of a block that rocks, and turned by theta meets the top of a stop: its gap is s tan(theta) all over."""
    outlines = [
        [(-0.5, -0.2), (1.0, -0.2), (1.0, 0.0), (-0.5, 0.0)],
        [(0.0, 0.0), (WIDE, 0.0), (WIDE, HIGH), (0.0, HIGH)],
        [(WIDE, 0.0), (0.5, 0.0), (0.5, STOP), (WIDE, STOP)],
    ]
    joint = lm.Joint.from_friction_coefficient(1.5, normal_stiffness=stiffness, shear_stiffness=stiffness)
    wall = lm.Assembly.from_polygons(outlines, thickness=0.2, joint=joint, fixed=[0, 2])
    loads = lm.Loads.horizontal(wall, (1.0, 0.0, 0.0))
    points = contact_points(wall, plane=find_plane(wall, loads), elastic=True)
    gaps = np.where(np.abs(points.directions[:, 0, 0]) > 0.9, STOP * np.tan(theta), 0.0)
    return lm.pushover(wall, loads, gaps=gaps)


@pytest.mark.parametrize(("fall", "passed"), [(1.8e-3, False), (2.4e-3, True)])
def test_a_rocking_block_that_comes_to_a_stop_has_passed_its_limit_point_if_it_fell_by_02_per_cent(fall, passed):
    """Turned by theta it bears tan(alpha - theta)."""
    alpha = np.arctan(WIDE / HIGH)
    curve = rocks_to_a_stop(1e10, alpha - np.arctan(WIDE / HIGH * (1.0 - fall)))
    assert curve.status == "limit point passed"
    assert curve.first_limit_point.load == pytest.approx(WIDE / HIGH, rel=5e-4)
    assert (curve.peak.load < 1.01 * WIDE / HIGH) == passed


@pytest.mark.parametrize("stiffness", [2e7, 1e8])
@pytest.mark.parametrize("fall", [1e-2, 5e-2])
def test_what_is_apart_is_no_contact_before_its_gap_has_closed(stiffness, fall):
    """On two springs k it lets go at sin(theta) = W / (k b). Its foot, sunk beside the stop's, met it through the gap:
    1.3 % too much at the lower stiffness."""
    alpha, weight = np.arctan(WIDE / HIGH), 2000.0 * 9.81 * WIDE * HIGH * 0.2
    theta = np.arcsin(weight / (stiffness * WIDE * 0.2 / 2.0) / WIDE)
    curve = rocks_to_a_stop(stiffness, theta + fall * alpha)
    assert curve.status == "limit point passed"
    assert curve.first_limit_point.load == pytest.approx(np.tan(alpha - theta), rel=2e-4)


RAMP, KN, FLOOR_AREA = 0.2, 1e9, 0.3 * 0.2


def pushed_onto_a_ramp(stop=True, **joint):
    """A block that cannot turn, half on a floor with friction 1 and half on a smooth ramp, which lifts it.

    Also a stop behind it, where asked for.
    """
    low, high, rise = 0.3, 0.4, RAMP * 0.3
    outlines = {
        "floor": [(-1.0, -0.2), (low, -0.2), (low, 0.0), (-1.0, 0.0)],
        "ramp": [(low, -0.2), (2 * low, -0.2), (2 * low, rise), (low, 0.0)],
        "block": [(0.0, 0.0), (low, 0.0), (2 * low, rise), (2 * low, high), (0.0, high)],
    }
    if stop:
        outlines["stop"] = [(2 * low, rise + 0.05), (3 * low, rise + 0.05), (3 * low, high), (2 * low, high)]
    smooth, rough = (
        lm.Joint.from_friction_coefficient(mu, normal_stiffness=KN, shear_stiffness=KN, **options)
        for mu, options in ((0.0, {}), (1.0, joint))
    )
    wall = lm.Assembly.from_polygons(
        list(outlines.values()), thickness=0.2, joint=smooth, fixed=[n for n in outlines if n != "block"],
        names=list(outlines), joints={("floor", "block"): rough},
    )
    wall = replace(wall, supports=(*wall.supports, lm.Support("block", dofs=("ry",))))
    return wall, lm.Loads.horizontal(wall, (1.0, 0.0, 0.0))


class OnTheRamp:
    """Closed form of that block: it sinks by w and goes u along, N = k w and T = k u on the floor, k' (u s + w c) on
    the ramp. T is at most c A + N, and none beyond the apex of that cone."""

    def __init__(self, wall, cohesion=0.0, tension=0.0):
        """Displacements from the unstressed state at which it rests, slips and leaves the floor [m]."""
        self.weight, length = wall.weights[wall.block_index("block")], float(np.hypot(1.0, RAMP))
        self.floor, self.ramp, self.bond = KN * FLOOR_AREA, KN * FLOOR_AREA * length, cohesion * FLOOR_AREA
        self.s, self.c = RAMP / length, 1.0 / length
        both = self.floor + self.ramp * self.c**2
        self.sunk = np.array([self.weight, -self.ramp * self.s * self.c]) / both  # w = sunk[0] + sunk[1] u
        away = self.ramp * self.s * (self.s + self.c * self.sunk[1])
        self.rests = -self.ramp * self.s * self.c * self.sunk[0] / (self.floor + away)
        self.slips = (self.bond + self.floor * self.sunk[0]) / (self.floor * (1.0 - self.sunk[1]))
        self.leaves = -(tension * KN**-1 + self.sunk[0]) / self.sunk[1]

    def load(self, u):
        """Multiplier at a displacement from the unstressed state [m]."""
        w = self.sunk[0] + self.sunk[1] * u
        friction = np.minimum(self.floor * u, np.maximum(self.bond + self.floor * w, 0.0))
        return (friction + self.ramp * self.s * (u * self.s + w * self.c)) / self.weight


@pytest.mark.parametrize("on", [0.05, 0.2, 0.5, 2.0])
def test_a_limit_point_between_two_states_that_bear_more_is_found(on):
    """The block loses its friction as it slips and is lifted, until it meets a stop so many elastic lengths on."""
    wall, loads = pushed_onto_a_ramp()
    exact = OnTheRamp(wall)
    stops = exact.slips + on * exact.weight / exact.floor
    assert exact.load(stops) < 0.995 * exact.load(exact.slips)
    points = contact_points(wall, plane=find_plane(wall, loads), elastic=True)
    curve = lm.pushover(wall, loads, gaps=np.where(np.abs(points.directions[:, 0, 0]) > 0.99, stops, 0.0))
    assert curve.status == "limit point passed"
    assert curve.peak.load == pytest.approx(exact.load(exact.slips), rel=2e-4)


@pytest.mark.parametrize("on", [0.2, 0.5, 2.0])
@pytest.mark.parametrize("share", [0.9, 0.95, 0.99, 0.999])
def test_a_limit_point_in_the_first_step_of_a_path_that_goes_on_is_found(on, share):
    """The same, gone on with from a share of the slip: the load at which it began came out, up to 4 % too low."""
    wall, loads = pushed_onto_a_ramp()
    exact = OnTheRamp(wall)
    stops = exact.slips + on * exact.weight / exact.floor
    points = contact_points(wall, plane=find_plane(wall, loads), elastic=True)
    gaps = np.where(np.abs(points.directions[:, 0, 0]) > 0.99, stops, 0.0)
    begun = lm.pushover(wall, loads, gaps=gaps, to=share * exact.slips - exact.rests)
    assert begun.load[-1] < exact.load(exact.slips)
    curve = lm.pushover(wall, loads, gaps=gaps, start=begun)
    assert curve.status == "limit point passed"
    assert curve.first_limit_point.load == pytest.approx(exact.load(exact.slips), rel=2e-4)


@pytest.mark.parametrize("first", [0.25, 300.0, 1000.0])
@pytest.mark.parametrize("gap", [0.016, 0.018, 0.05])
def test_a_block_that_slides_on_at_constant_load_has_its_limit_whatever_it_meets(gap, first):
    """mu W over a part of its size; steps that pass over it with few samples went on to the stop: 2.65 for 1.43."""
    outlines = [[(-1, -0.1), (1, -0.1), (1, 0), (-1, 0)], [(0, 0), (0.5, 0), (0.5, 0.3), (0, 0.3)],
                [(0.5, 0), (0.8, 0), (0.8, 0.3), (0.5, 0.3)]]
    joint = lm.Joint.from_friction_coefficient(0.3, normal_stiffness=1e9, shear_stiffness=1e9)
    wall = lm.Assembly.from_polygons(outlines, thickness=0.2, joint=joint, fixed=[0, 2])
    loads = lm.Loads.horizontal(wall, (1.0, 0.0, 0.0))
    points = contact_points(wall, plane=find_plane(wall, loads), elastic=True)
    gaps = np.where(np.abs(points.directions[:, 0, 0]) > 0.9, 0.5 * gap, 0.0)
    curve = lm.pushover(wall, loads, gaps=gaps, steps=Steps(first=first))
    assert curve.status == "slides on at constant load"
    assert curve.peak.load == pytest.approx(0.3, rel=1e-6)
    assert curve.first_limit_point.load == pytest.approx(0.3, rel=1e-6)


@pytest.mark.parametrize("thickness", [None, 0.3])
def test_points_at_the_end_of_a_joint_belong_to_its_own_faces(thickness):
    """Two stones meet on a ridge: the corners there lie on either slope. By another's face they left too soon, and
    their friction of 103 N turned into one of 56 the other way: .0468 with finer steps for .0624 in random stones."""
    outlines = [[(0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (1.0, 1.0), (0.0, 0.5)],
                [(0.0, 0.5), (1.0, 1.0), (1.0, 1.5), (0.0, 1.0)],
                [(1.0, 1.0), (2.0, 0.5), (2.0, 1.0), (1.0, 1.5)]]
    joint = lm.Joint.from_friction_coefficient(0.7, normal_stiffness=1e9, shear_stiffness=1e9)
    wall = lm.Assembly.from_polygons(outlines, thickness=0.3, joint=joint, fixed=[0])
    push = (1.0, 0.0, 0.0) if thickness is None else (1.0, 0.2, 0.0)  # in plane, and in space
    curve = lm.pushover(wall, lm.Loads.horizontal(wall, push), to=1e-6)
    points, shapes = curve.structure.points, curve.generations.shapes
    known = points.face >= 0
    assert known.sum() >= 6
    along = (points.directions[known, 0] * shapes.normal[points.face[known]]).sum(axis=1)
    assert along == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(("fall", "passed"), [(1.5e-3, False), (3e-3, True)])
@pytest.mark.parametrize("times", [1, 8])
def test_a_dip_is_a_limit_point_if_it_is_as_deep_as_one_that_ends_a_path(fall, passed, times):
    """Short of half its displacement the load falls, by less than 0.2 % or more, before the stop."""
    wall, loads = pushed_onto_a_ramp()
    exact = OnTheRamp(wall)
    top = exact.load(exact.slips)
    stops = np.interp(fall, 1.0 - exact.load(w := exact.slips * np.linspace(1.0, 1.5, 999)) / top, w)
    assert stops - exact.slips < 0.5 * (exact.slips - exact.rests)
    points = contact_points(wall, plane=find_plane(wall, loads), elastic=True)
    gaps = np.where(np.abs(points.directions[:, 0, 0]) > 0.99, stops, 0.0)
    to = None if passed else 2.0 * stops - exact.rests
    curve = lm.pushover(wall, loads, gaps=gaps, to=to, steps=finer(times))
    if passed:
        assert curve.first_limit_point.load == pytest.approx(top, rel=2e-4)
    else:
        assert curve.first_limit_point is None
        assert curve.peak.load > 1.2 * top


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_path_that_is_to_end_in_a_dip_ends_there_and_names_its_limit_point(share):
    wall, loads = pushed_onto_a_ramp()
    exact = OnTheRamp(wall)
    top = exact.load(exact.slips)
    stops = np.interp(0.02, 1.0 - exact.load(w := exact.slips * np.linspace(1.0, 1.5, 999)) / top, w)
    points = contact_points(wall, plane=find_plane(wall, loads), elastic=True)
    ends = exact.slips + share * (stops - exact.slips)
    gaps = np.where(np.abs(points.directions[:, 0, 0]) > 0.99, stops, 0.0)
    curve = lm.pushover(wall, loads, gaps=gaps, to=ends - exact.rests)
    assert curve.status == "reached"
    assert curve.load[-1] == pytest.approx(exact.load(ends), rel=1e-6)
    assert curve.first_limit_point.load == pytest.approx(top, rel=2e-4)


@pytest.mark.parametrize("beyond", [1.0, 3.0, 30.0])
@pytest.mark.parametrize("bond", [2e3, 2e4])
def test_tension_beyond_the_apex_is_followed_exactly_and_bears_no_shear(beyond, bond):
    """The floor lets go at ft = c / tan(phi), or so many times that; the load falls, and rises again where it is."""
    wall, loads = pushed_onto_a_ramp(False, cohesion=bond, tensile_strength=beyond * bond)
    exact = OnTheRamp(wall, bond, beyond * bond)
    curve = lm.pushover(wall, loads, to=exact.leaves - exact.rests)
    assert curve.load == pytest.approx(exact.load(curve.displacement + exact.rests), rel=1e-6, abs=1e-6)
    assert curve.load[-1] == pytest.approx((exact.weight + beyond * exact.bond) * RAMP / exact.weight, rel=1e-6)
    # the first limit point is that of the slip; without dilation no load is smaller than that at the apex
    assert lm.pushover(wall, loads).peak.load == pytest.approx(exact.load(exact.slips), rel=1e-4)
    least = lm.limit_analysis(wall, loads, flow_rule="non-associative")
    assert least.collapse_multiplier == pytest.approx((exact.weight + exact.bond) * RAMP / exact.weight, rel=1e-6)


@pytest.mark.slow
def test_distinct_elements_follow_tension_beyond_the_apex_as_paths_do():
    wall, _ = pushed_onto_a_ramp(False, cohesion=2e3, tensile_strength=6e3)
    exact = OnTheRamp(wall, 2e3, 6e3)
    push = dem.push(wall, dem.Drive({"block": {"x": 1.0}}), to=exact.leaves - exact.rests, detect_every=None)
    followed = exact.load(push.displacement + exact.rests)
    assert push.load / exact.weight == pytest.approx(followed, abs=2e-3 * followed.max())


def told(curve):
    """What a curve says of friction that faces share among their points."""
    return [w for w in curve.warnings if "with dilation as large as friction" in w]


def in_a_slot(walls):
    """A block on a floor, pulled along x by its weight times lambda, and so many walls beside it."""
    beside = [box((-1.0, y, 0.0), (1.0, y + 0.1, 0.2)) for y in (0.1, -0.2)]
    solids = [box((-1.0, -0.2, -0.1), (1.0, 0.2, 0.0)), box((-0.15, -0.1, 0.0), (0.15, 0.1, 0.1)), *beside[:walls]]
    joint = lm.Joint.from_friction_coefficient(MU, normal_stiffness=1e9)
    a = lm.Assembly.from_polyhedra(solids, joint=joint, fixed=[k for k in range(len(solids)) if k != 1])
    return a, lm.Loads.horizontal(a, (1.0, 0.0, 0.0))


def test_friction_that_dilation_would_raise_without_end_is_told():
    # walls that nothing presses bear nothing: mu W. With dilation two of them wedge the block, whatever pulls it
    for walls, words in ((0, 0), (2, 1)):
        curve = lm.pushover(*in_a_slot(walls))
        assert curve.peak.load == pytest.approx(MU, rel=1e-3)
        assert len(told(curve)) == words


@pytest.mark.slow
def test_friction_in_space_that_hangs_on_how_faces_share_their_pressure_is_told():
    wall, loads = ENGINES["pushover"].model(1, 29).build()
    corners = lm.pushover(wall, loads)
    faces = lm.pushover(wall, loads, contact_model="lobatto", grid=(5, 5))
    assert abs(corners.peak.load / faces.peak.load - 1.0) > 0.2
    # by how much, limit analysis says, with dilation of its own
    more = float(told(corners)[0].split("could bear ")[1].split(" times")[0])
    assert more == pytest.approx(lm.limit_analysis(wall, loads).collapse_multiplier / corners.peak.load, rel=0.05)
    assert not told(faces)
    assert np.isfinite(faces.peak.load)


@pytest.mark.parametrize("kn", [1e9, 1e10, 1e11])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.6])
def test_a_crushing_toe_is_told_to_come_to_its_load_between_displacements_that_hold_the_exact_one(share, kn):
    """Pressure over the toe rises to fc within y = fc / (kn theta), or is a triangle; its force stands r inside."""
    b, t, h = 0.3, 0.2, 1.0
    weight = 2000.0 * 9.81 * b * t * h
    fc = weight / (share * b * t)
    outlines = [[(-1, -0.2), (1, -0.2), (1, 0), (-1, 0)], [(-b / 2, 0), (b / 2, 0), (b / 2, h), (-b / 2, h)]]
    joint = lm.Joint(60.0, compressive_strength=fc, normal_stiffness=kn, shear_stiffness=kn)
    wall = lm.Assembly.from_polygons(outlines, thickness=t, joint=joint, density=2000.0, fixed=[0])
    said = [w for w in lm.pushover(wall, lm.Loads.horizontal(wall)).warnings if "or anywhere from" in w]
    low, high = map(float, said[0].removesuffix(" m").split("from ")[1].split(" to "))
    theta = np.geomspace(1e-7, 0.2, 100_000)
    y, triangle = fc / (kn * theta), np.sqrt(2.0 * weight / (kn * t * theta))
    crushed = weight / (fc * t) + y / 2.0
    inside = np.where(crushed > y, fc * t * (crushed**2 / 2.0 - y / 2.0 * (crushed - y / 3.0)) / weight, triangle / 3.0)
    whole = np.where(crushed > y, crushed, triangle) >= b
    force = np.where(whole, kn * theta * t * b**3 / 12.0 / weight, b / 2.0 - inside) / (h / 2.0) - theta
    moved = theta * h / 2.0 + force * weight / (kn * b * t)
    exact = moved[np.argmax(force >= 0.98 * force.max())]
    assert low < exact < high < 2.0 * low
