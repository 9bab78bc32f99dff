"""Contacts found anew in space: what slides over an edge, what lands on another block, what goes through one."""

import math
from functools import cache

import numpy as np
import pytest

import limitmason as lm
from limitmason.capacity import Steps
from limitmason.capacity.contact_search import touching
from limitmason.capacity.contact_search.crossing import candidate_contacts, is_crossing
from limitmason.geometry.polyhedron import box
from limitmason.geometry.rotation import rotation_matrices

UPRIGHT = (0.0, 0.0, 0.0)


def turned(vector):
    return rotation_matrices(np.array([vector]))[0]


def problem(solids, push, friction, *, turn=UPRIGHT, order=None):
    """Assembly of named solids, held but for "block", which is pushed by its weight; gravity turns with the model."""
    t, u = turned(turn), np.array(push) / np.linalg.norm(push)
    names = list(solids) if order is None else order
    wall = lm.Assembly.from_polyhedra(
        [[(solids[n].vertices @ t.T, solids[n].faces)] for n in names], names=names,
        joint=lm.Joint.from_friction_coefficient(friction), fixed=[n for n in names if n != "block"],
    )
    dead, live, k = np.zeros((len(names), 6)), np.zeros((len(names), 6)), wall.block_index("block")
    dead[k, :3], live[k, :3] = -wall.weights[k] * t[:, 2], wall.weights[k] * (t @ u)
    return wall, lm.Loads(dead, live), t


EDGE = 0.5


def on_a_table(*, yaw=0.0, push=(1.0, 0.0, 0.0), half=(0.2, 0.15), side=0.6, **options):
    """A block of height 0.2 m and friction 0.4 with its centre 0.3 m short of the edge of a table."""
    start = np.array([0.2, 0.0, 0.0])
    plate = box((-1.0, -0.6, -0.2), (EDGE, side, 0.0))
    stone = box((-half[0], -half[1], 0.0), (*half, 0.2))
    stone = stone._replace(vertices=stone.vertices @ turned((0.0, 0.0, yaw)).T + start)
    wall, loads, t = problem({"table": plate, "block": stone}, push, 0.4, **options)
    u = push[0] / math.hypot(*push)
    return wall, loads, t, EDGE - start[0] - 0.1 * 0.4 * u  # where the resultant of weight and push leaves the edge


@cache
def askew(turn=UPRIGHT, order=None):
    """Curve of a block turned by 0.5 rad that slides off, and its way towards the edge [m]."""
    wall, loads, t, tips = on_a_table(yaw=0.5, push=(1.0, 1e-3, 0.0), turn=turn, order=order)
    curve = lm.pushover(wall, loads, stiffness=1e9, to=tips + 0.008)
    return curve, (curve.displacement_of("block") @ t)[:, 0], tips


def slides_and_tips(curve, slid, tips):
    """Friction up to where the resultant leaves the edge, but for the elastic give of the joint, then a fall."""
    rests = (slid > 0.02) & (slid < tips - 0.01)
    assert curve.load[rests] == pytest.approx(0.4, rel=2e-3)
    assert rests.sum() >= 5
    assert np.interp(tips + 0.004, slid, curve.load) < 0.37
    assert all(c.accepted for c in curve.certificates)
    assert not any("found anew" in w or "go through" in w for w in curve.warnings)
    return True


@pytest.mark.slow
def test_a_turned_block_tips_where_its_resultant_leaves_the_edge_of_the_table():
    assert slides_and_tips(*askew())


@pytest.mark.slow
@pytest.mark.parametrize(
    "options, settings",
    [
        ({"push": (1.0, 0.2, 0.0)}, {"contact_model": "grid", "grid": (3, 3)}),
        # over the corner of the table, 0.3 m off both of its edges
        ({"push": (1.0, 1.0, 0.0), "half": (0.15, 0.15), "side": 0.3}, {}),
    ],
    ids=["points inside the face", "over a corner"],
)
def test_a_block_that_slides_off_a_table_askew_tips_where_its_resultant_leaves_the_edge(options, settings):
    wall, loads, t, tips = on_a_table(**options)
    along = options["push"][0] / math.hypot(*options["push"])
    curve = lm.pushover(wall, loads, stiffness=1e9, to=(tips + 0.008) / along, **settings)
    assert slides_and_tips(curve, (curve.displacement_of("block") @ t)[:, 0], tips)


@pytest.mark.slow
def test_a_curve_that_does_not_find_where_sides_cross_is_noticed(monkeypatch):
    def corners_alone(shapes, *where, **options):
        near = candidate_contacts(shapes, *where, **options)
        return near.at(~is_crossing(shapes, near))

    monkeypatch.setattr(touching, "candidate_contacts", corners_alone)
    wall, loads, t, _ = on_a_table(push=(1.0, 0.1, 0.0))
    curve = lm.pushover(wall, loads, stiffness=1e9, to=0.2, steps=Steps(most=40))
    slid = (curve.displacement_of("block") @ t)[:, 0]
    assert slid[-1] < 0.19 or curve.load[-1] < 0.39  # on its two rear corners it tips at once


@pytest.mark.slow
def test_a_turned_and_renumbered_copy_slides_off_alike():
    curve, slid, tips = askew()
    other, turned_slid, _ = askew((0.3, -0.7, 1.1), ("block", "table"))
    at = np.append(np.linspace(0.01, tips - 0.01, 20), tips + np.array([0.002, 0.004, 0.006]))
    assert np.interp(at, turned_slid, other.load) == pytest.approx(np.interp(at, slid, curve.load), rel=5e-3)


FACE = 0.15


def beside_a_stop(stop, push, **options):
    """A block of 0.2 x 0.2 x 1.0 m on a floor, 50 mm from a stop that is held."""
    floor, stone = box((-1.0, -1.0, -0.2), (2.0, 1.0, 0.0)), box((-0.1, -0.1, 0.0), (0.1, 0.1, 1.0))
    return problem({"floor": floor, "block": stone, "stop": stop}, push, 0.7, **options)


@pytest.mark.slow
@pytest.mark.parametrize("sideways", [0.0, 1e-3], ids=["in plane", "in space"])
@pytest.mark.parametrize("width", [0.05, 0.5], ids=["narrow stop", "wide stop"])
def test_a_block_that_rocks_comes_to_lie_on_the_edge_of_another_it_did_not_touch(sideways, width):
    """The face, turned by theta about the toe, meets the edge at height h at h tan(theta) = gap, at any steps."""
    stop = box((FACE, -width, 0.0), (0.4, width, 0.5))
    wall, loads, _ = beside_a_stop(stop, (1.0, sideways, 0.0))
    curve = lm.pushover(wall, loads, stiffness=1e9, to=0.06)
    theta = math.atan((FACE - 0.1) / 0.5)
    lands = 0.1 - 0.1 * math.cos(theta) + 0.5 * math.sin(theta)
    free = curve.displacement < lands - 2e-3
    assert (curve.load[free & (curve.displacement > 1e-3)] < 0.2).all()
    assert (curve.load[curve.displacement > lands + 3e-3] > 1.0).all()
    assert (curve.displacement > lands + 3e-3).any()
    assert all(c.accepted for c in curve.certificates)


def test_blocks_that_would_go_through_each_other_stop_the_path_by_name():
    """The edge of a stop that stands askew has no line in the plane of the joints, but is met in space.

    The top edge of the block comes to it at 50 mm. What then goes on into its faces is named.
    """
    stop = box((0.0, 0.0, 0.0), (0.15, 0.15, 1.5))
    stop = stop._replace(vertices=stop.vertices @ turned((0.0, 0.0, -0.25 * math.pi)).T + (FACE, 0.0, 0.0))
    wall, loads, _ = beside_a_stop(stop, (1.0, 0.0, 0.0))
    curve = lm.pushover(wall, loads, stiffness=1e9, to=0.1)
    assert curve.status == "stopped"
    assert any("'block' and 'stop'" in w and "no contact point" in w for w in curve.warnings)
    theta = math.atan(FACE - 0.1)
    lands = 0.1 - 0.1 * math.cos(theta) + 0.5 * math.sin(theta)
    rocks = (curve.displacement > 1e-3) & (curve.displacement < lands - 1e-3)
    assert rocks.any()
    assert (curve.load[rocks] < 0.2).all()
    assert curve.load[curve.displacement < lands + 5e-3].max() > 1.0
    # points of the undeformed joints, kept for ever, go through: said after the path
    kept = lm.pushover(wall, loads, stiffness=1e9, to=0.1, contacts="first")
    assert any("'block' and 'stop'" in w and "go through each other" in w for w in kept.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1e8, 1e10])
@pytest.mark.parametrize(
    ("gap", "step", "most"), [(0.0, 0.0, 0.4), (0.01, 0.0, 0.4), (0.0, -1e-3, 0.4), (0.0, 1e-3, 3.0)]
)
def test_a_block_slides_from_table_to_table_at_mu_w(stiffness, gap, step, most):
    """And stops at a step up until it tips about the foot of its front face, at its length over its height."""
    x = 0.35 + gap
    joint = lm.Joint.from_friction_coefficient(0.4, normal_stiffness=stiffness, shear_stiffness=stiffness)
    tables = [(-1, -0.2), (0.35, -0.2), (0.35, 0), (-1, 0)], [(x, -0.2), (3, -0.2), (3, step), (x, step)]
    a = lm.Assembly.from_polygons(
        [*tables, [(0, 0), (0.3, 0), (0.3, 0.1), (0, 0.1)]], thickness=0.3, joint=joint, fixed=[0, 1]
    )
    curve = lm.pushover(a, lm.Loads.horizontal(a, (1, 0, 0)), control=(2, "x"), to=0.4)
    assert curve.multiplier.max() == pytest.approx(most, rel=0.03 if most > 1.0 else 1e-6)
    if most < 1.0:
        assert curve.status == "reached"
        assert curve.multiplier[5:] == pytest.approx(0.4, rel=0.025 if step else 1e-3)


@pytest.mark.parametrize(("aside", "options"), [
    (0.0, {}), (4e-4, {}), (0.0, {"grid": (5, 5)}), pytest.param(1e-5, {}, marks=pytest.mark.slow),
    pytest.param(5e-5, {}, marks=pytest.mark.slow), pytest.param(5e-5, {"grid": (5, 5)}, marks=pytest.mark.slow),
])
def test_a_block_drawn_along_a_face_keeps_its_friction_where_sides_stay_in_line(aside, options):
    """W + mu P all along: points that run off go on at the side of the face, however near sides of both lie."""
    friction, pressed = 0.4, 3e3
    joint = lm.Joint.from_friction_coefficient(friction, normal_stiffness=1e10, shear_stiffness=1e10)
    solids = [box((0.0, 0.0, 0.0), (0.3, 0.2, 0.4)), box((aside, -0.2, 0.0), (aside + 0.3, 0.0, 0.4))]
    wall = lm.Assembly.from_polyhedra(solids, joint=joint, density=2000.0, fixed=["a"], names=["a", "b"])
    weight = float(wall.weights[1])
    dead, live = np.zeros((2, 6)), np.zeros((2, 6))
    dead[1, 1:3] = pressed, -weight
    live[1, 2] = 1.0
    curve = lm.pushover(wall, lm.Loads(dead, live), to=0.06, **options)
    assert curve.status == "reached"
    assert not curve.jumps
    slides = curve.displacement > 1e-5
    assert slides.sum() > 5
    assert curve.load[slides] == pytest.approx(weight + friction * pressed, rel=1e-4)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize(("angle", "to", "options"), [
    (20.0, 0.02, {}), (45.0, 0.02, {}), (200.0, 0.02, {}),
    pytest.param(340.0, 0.02, {"grid": (5, 5)}, marks=pytest.mark.slow),
    # the last step is cut to a little less than what is left
    pytest.param(340.0, 0.019, {"grid": (5, 5)}, marks=pytest.mark.slow),
])
def test_a_block_with_a_bevelled_edge_slides_along_a_face_at_mu_p_whichever_way(angle, to, options, order):
    """The bevel looks at the face too: where sides cross there is one point, its normal that of the faces that lie."""
    friction, pressed = 0.4, 3e3
    joint = lm.Joint.from_friction_coefficient(friction, normal_stiffness=1e10, shear_stiffness=1e10)
    bevelled = box((0.0, -0.2, 0.1), (0.3, 0.0, 0.35))
    far_below = (bevelled.vertices[:, 2] < 0.2) & (bevelled.vertices[:, 1] < -0.1)
    lower = bevelled.vertices - 0.18 * np.outer(far_below, (0.0, 0.0, 1.0))
    solids = [box((0.0, 0.0, 0.0), (0.3, 0.2, 0.4)), bevelled._replace(vertices=lower)]
    names = [("held", "drawn")[i] for i in order]
    wall = lm.Assembly.from_polyhedra(
        [solids[i] for i in order], joint=joint, density=2000.0, fixed=["held"], names=names
    )
    k = wall.block_index("drawn")
    dead, live = np.zeros((2, 6)), np.zeros((2, 6))
    arm = np.array([0.15, 0.0, 0.225]) - wall.centroids[k]
    dead[k, 1], live[k, 0], live[k, 2] = pressed, math.cos(math.radians(angle)), math.sin(math.radians(angle))
    for load in (dead, live):
        load[k, 3:] = np.cross(arm, load[k, :3])
    curve = lm.pushover(wall, lm.Loads(dead, live), to=to, **options)
    assert curve.status == "reached"
    slides = curve.displacement > 1e-5
    assert slides.sum() > 5
    assert curve.load[slides] == pytest.approx(friction * pressed, rel=1e-4)


def test_blocks_that_meet_at_another_corner_bear_their_bond_once():
    """Both corners of a joint's open end may lie over the other face; the static theorem bounds what it bears."""
    outlines = [
        [(-0.3, -0.2), (1.3, -0.2), (1.3, 0.0), (-0.3, 0.0)],
        [(0.971, 0.0), (1.014, 0.0), (1.014, 0.76), (0.736, 0.32)],
        [(0.442, 0.0), (0.567, 0.0), (0.539, 0.438), (0.0, 0.842), (0.0, 0.741)],
        [(0.567, 0.0), (0.971, 0.0), (0.736, 0.32), (0.539, 0.438)],
        [(0.539, 0.438), (0.736, 0.32), (1.014, 0.76), (1.014, 0.928), (0.0, 0.928), (0.0, 0.842)],
        [(0.0, 0.0), (0.442, 0.0), (0.0, 0.741)],
    ]
    joint = lm.Joint(17.7, cohesion=2200.0, normal_stiffness=6.25e9, shear_stiffness=3.45e9)
    rubble = lm.Assembly.from_polygons(outlines, thickness=0.2456, joint=joint, fixed=[0])
    loads = lm.Loads.weight(rubble).with_point_load(rubble, 1, (1048.0, 0.0, -674.0))
    curve = lm.pushover(rubble, loads, to=1e-3)
    most = lm.limit_analysis(rubble, loads).collapse_multiplier
    assert 0.98 * most < curve.peak.load < 1.002 * most
    p = curve.generations.structures[-1].points
    of_joint = p.interface >= 0
    bond = np.bincount(p.interface[of_joint], (p.area * p.law.cohesion)[of_joint])
    assert len(curve.generations.structures) > 1
    assert (bond <= 2200.0 * rubble.arrays.area * (1.0 + 1e-9)).all()


def on_two_tables(block, at, push, friction, yaw, *, turn=UPRIGHT, scale=1.0, mirror=False, order=None, sunk=1e-6):
    """A block on two level tables that meet at x = 0, seen in another frame; it sinks by that part of its size.

    The pair of tables, or the block, is turned about the vertical by ``yaw`` [rad].
    """
    b, flip = turned((0.0, 0.0, yaw)), np.diag([1.0, -1.0 if mirror else 1.0, 1.0])
    frame = turned(turn) @ flip
    solids = {
        "left": box((-1.5, -1.5, -0.2), (0.0, 1.5, 0.0)), "right": box((0.0, -1.5, -0.2), (1.5, 1.5, 0.0)),
        "block": box(*block),
    }
    names, seen = order or list(solids), []
    for name in names:
        s = solids[name]
        place = s.vertices + at if name == "block" else s.vertices @ b.T
        seen.append((scale * place @ frame.T, [tuple(reversed(f)) for f in s.faces] if mirror else s.faces))
    low, high = (scale * np.array(x) for x in block)
    area, weight = float(np.prod((high - low)[:2])), 2000.0 * 9.81 * float(np.prod(high - low))
    stiff = weight / area / (sunk * scale)
    joint = lm.Joint.from_friction_coefficient(friction, normal_stiffness=stiff, shear_stiffness=stiff)
    held = [n for n in names if n != "block"]
    wall = lm.Assembly.from_polyhedra([[x] for x in seen], names=names, joint=joint, fixed=held, density=2000.0)
    dead, live, k = np.zeros((len(names), 6)), np.zeros((len(names), 6)), wall.block_index("block")
    dead[k, :3], live[k, :3] = -weight * frame[:, 2], weight * frame @ push
    return wall, lm.Loads(dead, live)


SEEN = [
    {"scale": 1e3, "mirror": True, "order": ["block", "right", "left"]},
    {"turn": (0.7, -1.1, 0.4), "scale": 1e-3, "order": ["right", "block", "left"]},
]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:half the blocks measure")
@pytest.mark.parametrize("seen", SEEN)
def test_a_block_that_slides_over_an_oblique_seam_of_level_tables_bears_its_friction_all_along(seen):
    block = ((-0.2, -0.1, 0.0), (0.2, 0.1, 0.1))
    wall, loads = on_two_tables(block, [-0.35, 0.03, 0.0], [1.0, 0.0, 0.0], 0.5, 0.8, **seen)
    curve = lm.pushover(wall, loads, to=0.25 * seen["scale"])
    assert curve.status == "reached"
    slides = curve.displacement > 1e-5 * seen["scale"]
    assert slides.sum() > 10
    assert len(curve.generations.structures) > 5
    assert curve.load[slides] == pytest.approx(0.5, rel=1e-4)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:half the blocks measure")
@pytest.mark.parametrize(("deep", "angle", "friction", "yaw"), [(0.24, 0.16, 0.26, -0.04), (0.2, 0.07, 0.38, 0.23)])
def test_a_block_slides_over_a_seam_from_one_table_to_the_other_in_the_tries_that_a_path_has(
    deep, angle, friction, yaw
):
    """Half the tries went into longer steps that the crossings of sides, which run on as they ran, cut again."""
    block = ((-0.2, -0.5 * deep, 0.0), (0.2, 0.5 * deep, 0.1))
    push = [math.cos(angle), math.sin(angle), 0.0]
    curve = lm.pushover(*on_two_tables(block, [-0.3, 0.05, 0.0], push, friction, yaw), to=0.55)
    assert curve.status == "reached"
    assert curve.load[curve.displacement > 1e-5] == pytest.approx(friction, rel=1e-4)


@pytest.mark.filterwarnings("ignore:half the blocks measure")
@pytest.mark.parametrize("seen", SEEN)
@pytest.mark.parametrize("yaw", [0.0, 1.3])
def test_a_block_that_turns_over_its_edge_across_a_seam_follows_its_branch(yaw, seen):
    """tan(alpha - theta), theta by the shift of its centroid, to four fifths of overturning."""
    wide, high = 0.2, 0.6
    alpha, arm = math.atan(wide / high), 0.5 * math.hypot(wide, high)
    block = ((-wide, -0.15, 0.0), (0.0, 0.15, high))
    wall, loads = on_two_tables(block, [0.05, 0.03, 0.0], [1.0, 0.0, 0.0], 1.0, yaw, sunk=1e-7, **seen)
    shift = arm * (math.sin(alpha) - math.sin(0.2 * alpha))
    curve = lm.pushover(wall, loads, to=shift * seen["scale"])
    assert curve.status == "reached"
    u = curve.displacement / seen["scale"]
    theta = alpha - np.arcsin(np.sin(alpha) - u / arm)
    rocks = u > 1e-3
    assert rocks.sum() > 5
    assert curve.load[rocks] == pytest.approx(np.tan(alpha - theta)[rocks], abs=5e-6)


@pytest.mark.slow
@pytest.mark.parametrize("yaw", [0.0, 0.8])
def test_a_block_that_is_pushed_past_the_edge_of_a_table_turns_over_it_however_the_edge_runs(yaw):
    """Its joint lies in a plane, the edge across it does not: it slid on by 0.05 m more than there was table."""
    block = ((-0.2, -0.1, 0.0), (0.2, 0.1, 0.1))
    wall, loads = on_two_tables(block, [-0.45, 0.0, 0.0], [1.0, 0.0, 0.0], 0.5, yaw, order=["left", "block"])
    curve = lm.pushover(wall, loads, to=0.5)
    assert curve.status == "overturned"
    assert curve.displacement[-1] == pytest.approx(0.45, abs=0.02)
    slides = (curve.displacement > 1e-5) & (curve.displacement < 0.4)
    assert curve.load[slides] == pytest.approx(0.5, rel=1e-4)


def before_a_stop(apart, to, strength=1e6, **options):
    """Curve of a block of 1 x 0.5 x 1 m that slides to a higher stop, and its load where the stop crushes."""
    outlines = [
        [(x, z), (x1, z), (x1, z1), (x, z1)]
        for x, z, x1, z1 in ((-5.0, -1.0, 5.0, 0.0), (0.0, 0.0, 1.0, 0.5), (1.0 + apart, 0.0, 2.0, 1.0))
    ]
    joint = lm.Joint(20.0, normal_stiffness=1e10, shear_stiffness=4e9, compressive_strength=strength)
    wall = lm.Assembly.from_polygons(
        outlines, thickness=1.0, joint=joint, fixed=[0, 2], names=["ground", "block", "stop"]
    )
    exact = math.tan(math.radians(20.0)) + strength * 0.5 / wall.weights[1]
    return lm.pushover(wall, lm.Loads.horizontal(wall), to=to, **options), exact


def test_a_stop_crushes_at_the_strength_of_its_face_where_the_gap_is_given():
    """It is mu + fc A / W."""
    curve, exact = before_a_stop(0.0, 0.052, gaps=[0.0] * 15 + [0.05] * 15)
    assert curve.status == "reached"
    assert curve.load[-1] == pytest.approx(exact, rel=1e-5)
    assert not any("had no joint" in w for w in curve.warnings)


def test_blocks_that_had_no_joint_and_crush_where_they_meet_are_named():
    """A single point of 0.005 m2 stood for the face of 0.5 m2: a load of 0.85 for 51.3, in silence."""
    curve, exact = before_a_stop(0.05, 0.051)
    assert curve.load[-1] < 0.1 * exact
    assert any("had no joint" in w and "'block'" in w and "'stop'" in w for w in curve.warnings)
    firm, _ = before_a_stop(0.05, 0.051, strength=math.inf)
    assert not any("had no joint" in w for w in firm.warnings)
