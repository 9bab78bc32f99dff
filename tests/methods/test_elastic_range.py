"""Loads up to which no joint reaches its strength: sections in closed form, cones, scale, turns, pushed and driven."""

from dataclasses import replace

import numpy as np
import pytest
from brick_panels import runs

import dem
import limitmason as lm
from limitmason.errors import InputError, NotApplicable
from limitmason.geometry.polyhedron import box
from limitmason.geometry.rotation import rotation_matrices
from limitmason.mechanics.law import interface_law

B, T, H = 0.4, 0.2, 0.6
AREA = B * T
LAW = {"cohesion": 0.2e6, "tensile_strength": 0.1e6, "normal_stiffness": 80e9, "shear_stiffness": 35e9}
GRIDS = {"contact_model": "grid", "grid": (7, 4)}


def jointed(wall, **law):
    """The same with other joints."""
    return jointed_by(wall, lm.Joint(35.0, **{**LAW, **law}))


def jointed_by(wall, joint):
    """The same with this joint everywhere."""
    return replace(wall, interfaces=tuple(replace(i, joint=joint) for i in wall.interfaces))


def pillar(joint=None, *, size=1.0, density=2000.0):
    """A block on a held one."""
    solids = [box((-1.0, -1.0, -0.2), (1.0, 1.0, 0.0)), box((-B / 2, -T / 2, 0.0), (B / 2, T / 2, H))]
    return lm.Assembly.from_polyhedra(
        [[(size * s.vertices, s.faces)] for s in solids], names=["ground", "block"], fixed=["ground"], density=density,
        joint=joint or lm.Joint(30.0, **LAW),
    )


# ---- closed forms ----


@pytest.mark.parametrize("out_of_plane", [0.0, 0.07])
def test_eccentric_load_pulls_the_far_edge_off_at_the_stress_of_a_section(out_of_plane):
    wall, e = pillar(), 0.15
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (0.0, 0.0, -1.0), at=(e, out_of_plane, H))
    found = lm.elastic_range(wall, loads, **GRIDS)
    weight = wall.weights[1] / AREA
    # N = (W + P) / A - P e x / I: at the far corner
    per_load = (6.0 * e / B + 6.0 * out_of_plane / T - 1.0) / AREA
    assert found.high.multiplier == pytest.approx((LAW["tensile_strength"] + weight) / per_load, rel=1e-9)
    assert (found.high.criterion, found.high.place[0]) == ("opening", pytest.approx(-B / 2))
    assert found.high.joint == "base joint of ground and block"
    # pulled up there, the near corner opens first
    pull = (6.0 * e / B + 6.0 * out_of_plane / T + 1.0) / AREA
    assert found.low.multiplier == pytest.approx(-(LAW["tensile_strength"] + weight) / pull, rel=1e-9)
    assert found.stands


@pytest.mark.parametrize("options", [{}, {"grid": (7, 2)}])
@pytest.mark.parametrize("out", [0.0, 0.01])
def test_without_a_word_on_points_the_answer_is_that_of_the_section_in_plane_and_in_space(options, out):
    # a load beside the plane of symmetry is one in space
    wall, e = pillar(), 0.15
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (0.0, 0.0, -1.0), at=(e, out, H))
    if out and options:
        options = {"grid": (7, 3)}  # two points across bend three times too stiffly
    found = lm.elastic_range(wall, loads, **options)
    assert found.points.components == (3 if out else 2)
    weight = wall.weights[1] / AREA
    per_load = (6.0 * e / B + 6.0 * out / T - 1.0) / AREA
    assert found.high.multiplier == pytest.approx((LAW["tensile_strength"] + weight) / per_load, rel=1e-9)
    corners = lm.elastic_range(wall, loads, contact_model="vertices")
    assert corners.high is None or corners.high.multiplier > 1.5 * found.high.multiplier


def test_horizontal_load_slips_where_bending_lifts_or_crushes_where_it_presses():
    e, mu = 0.02, np.tan(np.radians(30.0))
    weak = lm.Joint(30.0, **{**LAW, "tensile_strength": 1e9})
    wall = pillar(weak)
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (1.0, 0.0, 0.0), at=(0.0, 0.0, e))
    found = lm.elastic_range(wall, loads, **GRIDS)
    weight = wall.weights[1] / AREA
    # shear is even; N at the lifted edge falls by 6 e / b of it
    high = (LAW["cohesion"] + mu * weight) / ((1.0 + mu * 6.0 * e / B) / AREA)
    assert found.high.multiplier == pytest.approx(high, rel=1e-9)
    assert found.high.criterion == "slip"
    assert found.low.multiplier == pytest.approx(-high, rel=1e-9)
    crushes = pillar(lm.Joint(30.0, **{**LAW, "tensile_strength": 1e9}, compressive_strength=weight + 2e4))
    found = lm.elastic_range(crushes, loads, **GRIDS)
    assert found.high.criterion == "crushing"
    assert found.high.multiplier == pytest.approx(2e4 * AREA / (6.0 * e / B), rel=1e-6)
    assert found.end(1, "slip").multiplier == pytest.approx(high, rel=1e-9)


def test_bricks_in_series_with_their_joints_shorten_by_the_closed_form():
    wall = pillar().with_material(lm.Material(young_modulus=10e9, poisson_ratio=0.0, density=2000.0))
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (0.0, 0.0, -1e3), at=(0.0, 0.0, H))
    found = lm.elastic_range(wall, loads, blocks="lumped", **GRIDS)
    assert found.shift_live[1, 2] == pytest.approx(-1e3 / AREA * (1.0 / 80e9 + 0.5 * H / 10e9), rel=1e-9)
    assert found.shift_dead[1, 2] / found.shift_live[1, 2] == pytest.approx(wall.weights[1] / 1e3, rel=1e-9)


# ---- laws ----


def leaning(*, size=1.0, order=(0, 1, 2, 3), turn=(0.0, 0.0, 0.0)):
    """Four blocks in space, askew loads: cones are met from inside and from outside."""
    rows = [((0.0, 0.0, -0.2), (2.0, 1.0, 0.0)), ((0.1, 0.2, 0.0), (0.7, 0.8, 0.4)),
            ((0.7, 0.1, 0.0), (1.2, 0.7, 0.6)), ((0.3, 0.2, 0.4), (0.7, 0.7, 0.9))]
    t = rotation_matrices(np.array([turn]))[0]
    solids = [box(*r) for r in rows]
    wall = lm.Assembly.from_polyhedra(
        [[(size * solids[k].vertices @ t.T, solids[k].faces)] for k in order], names=[f"b{k}" for k in order],
        fixed=["b0"], density=2000.0, joint=lm.Joint(35.0, **LAW),
    )
    random = np.random.default_rng(3)
    dead, live = (scale * random.normal(size=(4, 3)) for scale in (1e3, 1e4))
    dead, live = (np.hstack([w[list(order)] @ t.T, np.zeros((4, 3))]) for w in (dead, live))
    return wall, lm.Loads(size**2 * dead, size**2 * live)


def test_no_point_is_over_its_strength_within_the_range_and_one_is_at_either_end():
    wall, loads = leaning()
    found = lm.elastic_range(wall, loads, contact_model="grid", grid=(4, 3))
    law = interface_law(wall.arrays, convex=False).at(found.points.interface)

    def excess(multiplier):
        stress = found.dead + multiplier * found.live
        return law.excess(stress[:, 0], np.linalg.norm(stress[:, 1:], axis=1)).max()

    low, high = found.low.multiplier, found.high.multiplier
    assert low < 0.0 < high
    assert {found.end(s, c).criterion for s in (1, -1) for c in ("opening", "slip")} == {"opening", "slip"}
    for end in (low, high):
        assert abs(excess(end)) < 1e-6 * LAW["tensile_strength"]
        assert excess(end * (1.0 + 1e-6)) > 0.0
    assert max(excess(v) for v in np.linspace(low, high, 41)[1:-1]) < 0.0


def test_range_is_that_of_a_renumbered_turned_and_scaled_copy():
    wall, loads = leaning()
    ends = [lm.elastic_range(wall, loads, **GRIDS)]
    ends.append(lm.elastic_range(*leaning(order=(2, 0, 3, 1), turn=(0.2, -0.5, 1.1)), **GRIDS))
    # with the stiffness of joints over the size the same stresses stand in a model of any size
    for size in (1e-3, 30.0):
        ends.append(lm.elastic_range(*leaning(size=size), stiffness=(80e9 / size, 35e9 / size), **GRIDS))
    for other in ends[1:]:
        assert other.high.multiplier == pytest.approx(ends[0].high.multiplier, rel=1e-7)
        assert other.low.multiplier == pytest.approx(ends[0].low.multiplier, rel=1e-7)


def test_strengths_alone_are_exchanged_and_a_dead_load_that_is_too_much_is_said():
    wall, loads = leaning()
    found = lm.elastic_range(wall, loads, **GRIDS)
    half = lm.Loads(2.0 * loads.dead, 2.0 * loads.live)
    strong = jointed(wall, cohesion=0.4e6, tensile_strength=0.2e6)
    twice = lm.elastic_range(strong, half, **GRIDS)
    # twice the loads on twice the strengths
    assert twice.high.multiplier == pytest.approx(found.high.multiplier, rel=1e-12)
    assert found.with_strengths(strong).high.multiplier == pytest.approx(
        lm.elastic_range(strong, loads, **GRIDS).high.multiplier, rel=1e-12
    )
    weak = found.with_strengths(jointed(wall, cohesion=1e3, tensile_strength=1e3))
    assert not weak.stands
    with pytest.raises(InputError, match="strengths only"):
        found.with_strengths(jointed(wall, normal_stiffness=1e9))


def test_strengths_are_exchanged_again_and_again_where_units_are_lumped():
    clay = {"young_modulus": 10e9, "poisson_ratio": 0.2}
    wall = pillar().with_material(lm.Material(**clay))
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (0.3, 0.0, -1.0), at=(0.15, 0.0, H))
    found = lm.elastic_range(wall, loads, blocks="lumped")
    for ft in (0.2e6, 0.3e6):
        strong = jointed(wall, tensile_strength=ft)
        found = found.with_strengths(strong)
        assert found.high.multiplier == lm.elastic_range(strong, loads, blocks="lumped").high.multiplier


@pytest.mark.parametrize("blocks", ["rigid", "lumped", "ritz"])
def test_strengths_of_another_structure_are_refused(blocks):
    clay = {"young_modulus": 10e9, "poisson_ratio": 0.2}
    wall = pillar().with_material(lm.Material(**clay))
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (0.0, 0.0, -1.0), at=(0.15, 0.0, H))
    found = lm.elastic_range(wall, loads, blocks=blocks)
    with pytest.raises(InputError, match="must be of the same material"):
        found.with_strengths(wall.with_material(lm.Material(**clay | {"young_modulus": 20e9})))
    with pytest.raises(InputError, match="strengths only"):
        found.with_strengths(jointed(wall, normal_stiffness=80e9 * (1.0 + 1e-6)))
    # small numbers are as different as large ones: areas of 1e-8 m2
    size = 1e-4 * np.sqrt(B * T) ** -1
    small = pillar(size=size)
    mine = lm.elastic_range(small, lm.Loads.weight(small).with_point_load(small, "block", (1.0, 0.0, 0.0)))
    with pytest.raises(InputError, match="strengths only"):
        mine.with_strengths(pillar(size=0.9 * size))


# ---- past the apex, and joints without strength ----


@pytest.mark.parametrize("side", [0.0, 0.07])
def test_pure_pull_past_the_apex_ends_at_the_tensile_strength_and_not_by_slip(side):
    ft = 5e5
    joint = lm.Joint(
        30.0, cohesion=1e4, tensile_strength=ft, normal_stiffness=80e9, shear_stiffness=35e9, lost_by="opening"
    )
    wall = pillar(joint)
    assert ft > joint.cohesion / joint.tan_phi
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (0.0, 0.0, 1.0), at=(side, 0.0, H))
    found = lm.elastic_range(wall, loads)
    weight = wall.weights[1] / AREA
    assert found.high.criterion == "opening"
    assert found.high.multiplier == pytest.approx((ft + weight) * AREA / (1.0 + 6.0 * side / B), rel=1e-9)
    assert found.end(1, "slip") is None


def test_shear_past_the_apex_slips_there():
    joint = lm.Joint(
        30.0, cohesion=1e4, tensile_strength=5e5, normal_stiffness=80e9, shear_stiffness=35e9, lost_by="opening"
    )
    wall, pull = pillar(joint), 0.1
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (pull, 0.0, 1.0), at=(0.0, 0.0, 0.0))
    found = lm.elastic_range(wall, loads)
    # even stresses: P pull / A = c + tan(phi) (W - P) / A
    high = (joint.cohesion * AREA + joint.tan_phi * wall.weights[1]) / (pull + joint.tan_phi)
    assert (found.high.criterion, found.high.multiplier) == ("slip", pytest.approx(high, rel=1e-9))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("plane", [True, False])
def test_lines_of_stress_end_where_they_leave_the_cone_along_it_and_through_its_apex_too(plane):
    # round numbers run along generators, through the apex and in the other nappe
    random = np.random.default_rng(0)
    at = np.linspace(-20.0, 20.0, 401)
    seen = set()
    wall = pillar()
    some = lm.Loads.weight(wall).with_point_load(wall, "block", (0.0, 0.0, -1.0), at=(0.0, 0.0 if plane else 0.01, H))
    found = lm.elastic_range(wall, some, grid=(2, 2))
    for _ in range(400):
        joint = lm.Joint(45.0 * random.integers(2), cohesion=random.choice([0.0, 1e5]))
        found = replace(found, assembly=jointed_by(wall, joint))
        rows = 1e5 * random.choice([0.0, 0.0, 1.0, -1.0, 2.0], size=(2, found.points.components))
        dead, live = (np.tile(r, (found.points.count, 1)) for r in rows)
        found = replace(found, dead=dead, live=live)
        low, high = found.end(-1, "slip"), found.end(1, "slip")
        bounds = -np.inf if low is None else low.multiplier, np.inf if high is None else high.multiplier
        stress = rows[0] + at[:, None] * rows[1]
        strength = joint.cohesion + joint.tan_phi * stress[:, 0]
        if not rows[:, 1:].any() and joint.tan_phi * joint.tensile_strength >= joint.cohesion:
            strength = np.maximum(strength, 0.0)
        over = (np.linalg.norm(stress[:, 1:], axis=1) - strength) / 1e5
        within = (at > bounds[0] + 1e-6) & (at < bounds[1] - 1e-6)
        beyond = (at < bounds[0] - 1e-6) | (at > bounds[1] + 1e-6)
        assert over[within].max(initial=-1.0) <= 1e-7
        assert over[beyond].min(initial=1.0) >= -1e-7
        seen.add((bool(within.any()), bool(beyond.any())))
    assert len(seen) == 3


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("out", [0.0, 0.01])
def test_joint_without_friction_bears_what_presses_it(out):
    wall = pillar(lm.Joint(0.0, normal_stiffness=80e9, shear_stiffness=35e9))
    loads = lm.Loads.weight(wall).with_point_load(wall, "block", (0.0, 0.0, -1.0), at=(0.0, out, H))
    found = lm.elastic_range(wall, loads)
    # lifted until the weight is off, or the edge that the load is nearer to
    assert found.low.multiplier == pytest.approx(-wall.weights[1] / (1.0 + 6.0 * out / T), rel=1e-9)
    assert (found.low.criterion, found.high, found.end(1, "slip")) == ("opening", None, None)
    pushed = lm.Loads.weight(wall).with_point_load(wall, "block", (1.0, 0.0, 0.0), at=(0.0, out, 0.0))
    nothing = lm.elastic_range(wall, pushed)
    assert (nothing.low.multiplier, nothing.high.multiplier, nothing.stands) == (0.0, 0.0, False)
    assert "empty: own weight alone reaches a strength, which any load exceeds, by slip of the base" in str(nothing)


def test_head_joints_without_pressure_do_not_end_the_range_by_rounding():
    solids = [((-1.0, -0.1, -0.2), (2.0, 0.1, 0.0)), ((0.0, -0.1, 0.0), (0.4, 0.1, 0.4)),
              ((0.4, -0.1, 0.0), (0.8, 0.1, 0.4))]
    wall = lm.Assembly.from_polyhedra(
        [[(s.vertices, s.faces)] for s in (box(*r) for r in solids)], names=["ground", "left", "right"],
        fixed=["ground"], density=2000.0, joint=lm.Joint(35.0, normal_stiffness=1e10, shear_stiffness=4e9),
    )
    loads = lm.Loads.weight(wall)
    for name, x in (("left", 0.2), ("right", 0.6)):
        loads = loads.with_point_load(wall, name, (0.0, 0.0, -1.0), at=(x, 0.0, 0.4))
    for turn in (0.0, 0.3):
        t = rotation_matrices(np.array([[0.0, 0.0, turn]]))[0]
        turned = lm.Assembly.from_polyhedra(
            [[(b.parts[0].vertices @ t.T, b.parts[0].faces)] for b in wall.blocks], names=["ground", "left", "right"],
            fixed=["ground"], density=2000.0, joint=wall.interfaces[0].joint,
        )
        moved = lm.Loads(*(np.hstack([w[:, :3] @ t.T, w[:, 3:] @ t.T]) for w in (loads.dead, loads.live)))
        found = lm.elastic_range(turned, moved)
        assert found.low.multiplier == pytest.approx(-wall.weights[1], rel=1e-9)
        assert found.high is None


def test_range_with_nothing_in_it_says_what_own_weight_alone_exceeds():
    t = rotation_matrices(np.array([[0.0, np.radians(30.0), 0.0]]))[0]
    solids = [box((-1.0, -1.0, -0.2), (1.0, 1.0, 0.0)), box((-B / 2, -T / 2, 0.0), (B / 2, T / 2, 0.2))]
    for phi in (0.0, 20.0):
        # dry, on a slope of 30 degrees, and pulled along it across the fall
        slope = lm.Assembly.from_polyhedra(
            [[(s.vertices @ t.T, s.faces)] for s in solids], names=["ground", "block"], fixed=["ground"],
            density=2000.0, joint=lm.Joint(phi, normal_stiffness=80e9, shear_stiffness=35e9),
        )
        loads = lm.Loads.weight(slope).with_point_load(slope, "block", (0.0, 1.0, 0.0), at=(0.0, 0.0, 0.0))
        found = lm.elastic_range(slope, loads)
        assert not found.stands
        words = str(found)
        assert "empty: own weight alone exceeds a strength, by slip of the base joint of ground and block" in words
        assert "inf" not in words
        assert "inf" not in str(found.high)


def test_what_has_no_range_is_refused():
    wall = pillar()
    with pytest.raises(InputError, match="no live load"):
        lm.elastic_range(wall, lm.Loads.weight(wall))
    live = lm.Loads.weight(wall).with_point_load(wall, "block", (1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="criterion one of"):
        lm.elastic_range(wall, live).end(1, "bending")
    with pytest.raises(InputError, match="have no stress"):
        lm.elastic_range(wall, live, stress="solid")
    rolls = replace(wall, supports=(lm.Support("ground", dofs=("z", "rx", "ry")),))
    with pytest.raises(NotApplicable, match="do not hold the blocks"):
        lm.elastic_range(rolls, live)
    assert lm.elastic_range(pillar(lm.Joint(30.0, 0.0, 1e9, 1e30, normal_stiffness=1e9)), live).high.criterion == "slip"


# ---- against methods that know no superposition ----


def small_panel(**options):
    return lm.experiments.load("brick-panels-opening", "udec-09", outline="337.5/2/1", **options)


@pytest.mark.slow
@pytest.mark.parametrize("blocks", ["rigid", "lumped", "simply deformable", "ritz"])
def test_path_without_rate_breaks_first_where_superposition_says(blocks):
    test = small_panel()
    points = {"contact_model": "grid", "grid": runs.SPACING}
    found = lm.elastic_range(test.assembly(), test.loads(), blocks=blocks, **points)
    wall = test.assembly()
    spreader = wall.block_index("spreader")
    far = 1.05 * found.high.multiplier * found.shift_live[spreader, 2]
    path = lm.pushover(
        wall, test.loads(), control=("spreader", "z"), to=far, blocks=blocks, contacts="first", **points
    )

    def place(names):
        """Distance of a joint from the axis of the panel, and its height [m]."""
        x, _, z = np.mean([wall.centroids[wall.block_index(name)] for name in names], axis=0)
        return abs(x - wall.centroids[spreader, 0]), z

    # a path finds a break to 1e-3 of what opens elastically
    assert path.load[path.breaks[0].sample - 1] == pytest.approx(found.high.multiplier, rel=1e-3)
    names = found.high.joint.split(" joint of ")[1].split(" and ")
    # rounding chooses between a joint and its mirror image
    assert any(place(joint.split(" - ")) == pytest.approx(place(names)) for joint in path.breaks[0].joints)


@pytest.mark.slow
@pytest.mark.parametrize("blocks", ["lumped", "simply deformable"])
def test_driven_slowly_it_fails_first_where_superposition_says(blocks):
    test = small_panel()
    found = lm.elastic_range(test.assembly(), test.loads(), blocks=blocks, contact_model="grid", grid=runs.SPACING)
    k = test.assembly().block_index("spreader")
    to = -1.2 * found.high.multiplier * found.shift_live[k, 2]
    curve = dem.push(
        test.assembly(), test.drive(), to=to, blocks=blocks, contact_points=runs.SPACING, steps=20_000,
        rate_check=False, detect_every=None,
    )
    assert curve.settlement == pytest.approx(-found.shift_dead[k, 2], rel=1e-3)
    assert curve.first_failure.load == pytest.approx(1e3 * found.high.multiplier, rel=0.01)


@pytest.mark.parametrize("blocks", ["simply deformable", "ritz"])
def test_a_pier_under_vertical_loads_lies_in_two_planes_and_deforms_as_a_solid(blocks):
    """Plane stress about either of its planes is another answer, so none of them is taken unasked."""
    base, pier = box((-1.0, -1.0, -0.2), (1.0, 1.0, 0.0)), box((-0.6, -1.0, 0.0), (0.6, 1.0, 0.9))
    lengths = []
    for turn in rotation_matrices(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5 * np.pi], [0.3, -1.1, 0.7]])):
        wall = lm.Assembly.from_polyhedra(
            [[(s.vertices @ turn.T, s.faces)] for s in (base, pier)], names=["ground", "pier"], fixed=["ground"],
            density=2000.0, joint=lm.Joint(30.0, normal_stiffness=5e9, shear_stiffness=2e9),
        ).with_material(lm.Material(4e9, 0.25))
        force = np.zeros((2, 6))
        force[1, :3] = turn @ [0.0, 0.0, -3e4]
        lengths.append(np.linalg.norm(lm.elastic_range(wall, lm.Loads(force, force), blocks=blocks).shift_dead[1]))
    assert lengths == pytest.approx([lengths[0]] * 3, rel=1e-9)
