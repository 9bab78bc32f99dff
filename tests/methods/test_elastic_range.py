"""Loads up to which no joint reaches its strength: sections in closed form, cones, scale, turns, pushed and driven."""

from dataclasses import replace

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.errors import InputError, NotApplicable
from limitmason.experiments.brick_panels_opening import runs
from limitmason.geometry.polyhedron import box
from limitmason.geometry.rotation import rotation_matrices
from limitmason.law import interface_law

B, T, H = 0.4, 0.2, 0.6
AREA = B * T
LAW = {"cohesion": 0.2e6, "tensile_strength": 0.1e6, "normal_stiffness": 80e9, "shear_stiffness": 35e9}
GRIDS = {"contact_model": "grid", "grid": (7, 4)}


def jointed(wall, **law):
    """The same with other joints."""
    joint = lm.Joint(35.0, **{**LAW, **law})
    return replace(wall, interfaces=tuple(replace(i, joint=joint) for i in wall.interfaces))


def pillar(joint=None, *, size=1.0, density=2000.0):
    """A block on a held one."""
    solids = [box((-1.0, -1.0, -0.2), (1.0, 1.0, 0.0)), box((-B / 2, -T / 2, 0.0), (B / 2, T / 2, H))]
    return lm.Assembly.from_polyhedra(
        [[(size * s.vertices, s.faces)] for s in solids], names=["ground", "block"], fixed=["ground"], density=density,
        joint=joint or lm.Joint(30.0, **LAW),
    )  # fmt: skip


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
            ((0.7, 0.1, 0.0), (1.2, 0.7, 0.6)), ((0.3, 0.2, 0.4), (0.7, 0.7, 0.9))]  # fmt: skip
    t = rotation_matrices(np.array([turn]))[0]
    solids = [box(*r) for r in rows]
    wall = lm.Assembly.from_polyhedra(
        [[(size * solids[k].vertices @ t.T, solids[k].faces)] for k in order], names=[f"b{k}" for k in order],
        fixed=["b0"], density=2000.0, joint=lm.Joint(35.0, **LAW),
    )  # fmt: skip
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


@pytest.mark.parametrize("blocks", ["rigid", "lumped", "modal", "elastic"])
def test_path_without_rate_breaks_first_where_superposition_says(blocks):
    test = small_panel()
    points = {"contact_model": "grid", "grid": runs.SPACING}
    found = lm.elastic_range(test.assembly(), test.loads(), blocks=blocks, **points)
    far = 1.05 * found.high.multiplier * found.shift_live[test.assembly().block_index("spreader"), 2]
    path = lm.pushover(
        test.assembly(), test.loads(), control=("spreader", "z"), to=far, blocks=blocks, contacts="first", **points
    )
    # a path finds a break to 1e-3 of what opens elastically
    assert path.load[path.breaks[0].sample - 1] == pytest.approx(found.high.multiplier, rel=1e-3)
    names = found.high.joint.split(" joint of ")[1].replace(" and ", " - ")
    assert any(names in joint for joint in path.breaks[0].joints)


@pytest.mark.parametrize("blocks", ["lumped", "modal"])
def test_driven_slowly_it_fails_first_where_superposition_says(blocks):
    test = small_panel()
    found = lm.elastic_range(test.assembly(), test.loads(), blocks=blocks, contact_model="grid", grid=runs.SPACING)
    k = test.assembly().block_index("spreader")
    to = -1.2 * found.high.multiplier * found.shift_live[k, 2]
    curve = dem.push(
        test.assembly(), test.drive(), to=to, blocks=blocks, contact_points=runs.SPACING, steps=20_000,
        rate_check=False, detect_every=None,
    )  # fmt: skip
    assert curve.settlement == pytest.approx(-found.shift_dead[k, 2], rel=1e-3)
    assert curve.first_failure.load == pytest.approx(1e3 * found.high.multiplier, rel=0.01)
