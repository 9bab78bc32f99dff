"""Contacts kept, or named: wedges, gaps, edges and tiny contacts, alike in every scale, turn and numbering."""

import warnings
from itertools import product

import numpy as np
import pytest
from lug_models import closed_form, lug, push_on_pier, whole
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.text import Text

import limitmason as lm
from limitmason.build.variants import displaced, resized
from limitmason.figures import contacts, style
from limitmason.geometry import box
from limitmason.model.assembly import ContactError
from limitmason.model.contact_report import NearMiss

JOINT = lm.Joint(30.0)
ALONE = 0.5 / 1.5  # the pier without the strut topples at b / h


def multiplier(assembly):
    return lm.limit_analysis(assembly, push_on_pier(assembly))


# ---- a contact between faces that are not parallel ------------------------------------------------------------------


@pytest.mark.parametrize("deg", [5.0, 9.0, 11.0, 14.0])
def test_short_contact_of_faces_at_an_angle_is_kept(deg):
    # 21 mm long, open by 1.8 to 5.2 mm at its end: within a tolerance of 6 mm
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assembly = lug(deg, tolerance=0.006)
    expected = closed_form(assembly, deg, whole(deg, 0.021))
    assert multiplier(assembly).collapse_multiplier == pytest.approx(expected, rel=1e-6)
    assert expected > 2 * ALONE


@pytest.mark.parametrize("deg", [0.01, 0.1, 0.4])
def test_long_face_that_opens_by_a_hair_is_kept_whole_and_named(deg):
    with pytest.warns(lm.ContactWarning, match=r"1 pair\(s\) of faces open like a wedge and are kept .*'A' and 'B'"):
        assembly = lug(deg, 0.4)
    expected = closed_form(assembly, deg, whole(deg, 0.4))
    assert multiplier(assembly).collapse_multiplier == pytest.approx(expected, rel=1e-6)
    (kept,) = assembly.contact_report().kept
    assert (kept.kind, kept.angle_deg) == ("closed", pytest.approx(deg))
    assert kept.gap == pytest.approx((0.0, 0.4 * np.tan(np.deg2rad(deg))), rel=1e-3)


@pytest.mark.parametrize("deg", [1.0, 2.0, 11.0])
def test_wider_wedge_is_kept_where_it_is_within_the_tolerance(deg):
    with pytest.warns(lm.ContactWarning, match="kept as contacts"):
        assembly = lug(deg, 0.4)
    # the gap on the plane midway is 2 s sin(t/2)
    along = assembly.tolerance / (2 * np.sin(np.deg2rad(deg / 2)))
    expected = closed_form(assembly, deg, along)
    assert multiplier(assembly).collapse_multiplier == pytest.approx(expected, rel=1e-6)
    report = assembly.contact_report()
    assert [k.kind for k in report.kept] == ["in part"]
    assert [c.width for c in report.tiny] == pytest.approx([along], rel=1e-6)
    assert report.decisions == ("1 wedge kept in part",)


def test_wedge_too_wide_is_named_and_the_prediction_says_so():
    with pytest.warns(lm.ContactWarning, match=r"nearly touch and are no contacts: 'A' and 'B' \(gap 0 mm to 7.64 mm"):
        assembly = lug(20.0, joints={}, tolerance=0.008)
    prediction = multiplier(assembly)
    assert prediction.collapse_multiplier == pytest.approx(ALONE, rel=1e-6)
    assert any("1 pair of faces nearly touches" in w and "contact_report()" in w for w in prediction.warnings)
    (miss,) = assembly.contact_report().near_misses
    assert (miss.kind, miss.angle_deg) == ("turned", pytest.approx(20.0))
    assert ("angle 30 degrees", 1) in assembly.contact_report().would_add
    kept = lug(20.0, tolerance=0.008, angle_tolerance_deg=25.0)
    expected = closed_form(kept, 20.0, whole(20.0, 0.021))
    assert multiplier(kept).collapse_multiplier == pytest.approx(expected, rel=1e-6)
    assert not multiplier(kept).warnings


def test_head_joint_open_by_a_millimetre_is_named():
    outlines = [[[0, 0], [1, 0], [1, 0.5], [0, 0.5]], [[0, 0.5], [0.4, 0.5], [0.4, 1], [0, 1]],
                [[0.401, 0.5], [1, 0.5], [1, 1], [0.401, 1]]]
    with pytest.warns(lm.ContactWarning, match=r"'block-1' and 'block-2' \(gap 1 mm, 0 degrees\)"):
        assembly = lm.Assembly.from_polygons(outlines, thickness=0.3, joint=JOINT, fixed=[0])
    report = assembly.contact_report()
    (miss,) = report.near_misses
    assert (miss.a, miss.b, miss.kind, miss.area) == ("block-1", "block-2", "apart", pytest.approx(0.15))
    assert dict(report.would_add)["distance 1 mm"] == 1
    assert "1 near miss" in repr(report)
    assert "block-1 | block-2 | apart | gap 1 to 1 mm" in str(report)
    # a limit on the gap that is looked for is kept to
    assert not assembly.contact_report(distance=5e-4).near_misses
    joint = lm.Interface(1, 2, miss.polygons[0], np.array([1.0, 0, 0]), JOINT, "head")
    by_hand = assembly.with_interfaces([*assembly.interfaces, joint])
    assert not by_hand.contact_warnings
    assert not by_hand.contact_report().near_misses


# ---- alike in every scale, turn, mirror and numbering ---------------------------------------------------------------


def signature(report, scale):
    def rows(found):
        out = [
            (*sorted((d.a, d.b)), d.kind, *np.round(np.array(d.gap) / scale, 9) + 0.0, round(d.angle_deg, 6),
             round(d.area / scale**2, 9))
            for d in found
        ]
        return sorted(out)

    contacts = sorted((*sorted((c.a, c.b)), round(c.area / scale**2, 9), c.tiny) for c in report.contacts)
    edges = sorted((*sorted((e.a, e.b)), e.kind) for e in report.edges)
    misses, kept, passed = (rows(r) for r in (report.near_misses, report.kept, report.passed_over))
    return (
        contacts, misses, kept, passed, edges, report.floating, report.hanging,
        len(report.untouched), report.n_faces, [n for what, n in report.would_add if " x " in what or what[0] in "an"],
    )


@pytest.mark.exact
@pytest.mark.filterwarnings("ignore::limitmason.PlausibilityWarning")
@pytest.mark.parametrize("deg, length", [(11.0, 0.021), (0.1, 0.4), (3.0, 0.4), (20.0, 0.021)])
def test_report_does_not_depend_on_scale_turn_mirror_and_numbering(deg, length):
    expected = signature(lug(deg, length, joints={}).contact_report(), 1.0)
    for scale, turn in product((1e-3, 1.0, 1e3), (0.0, 0.3, 2.0)):
        assembly = lug(deg, length, joints={}, scale=scale, turn=turn)
        assert signature(assembly.contact_report(), scale) == expected
    other = lug(deg, length, joints={}, mirror=-1.0, order=(2, 0, 1))
    assert signature(other.contact_report(), 1.0) == expected
    moved = lug(deg, length, joints={}).transformed(2.0 * np.diag([1.0, -1.0, 1.0]), (1.0, 2.0, 3.0))
    assert signature(moved.contact_report(), 2.0) == expected
    assert len(moved.near_misses) == len(other.near_misses) == len(expected[1])
    again = lug(deg, length, joints={}).renumbered((2, 0, 1))
    assert signature(again.contact_report(), 1.0) == expected
    assert [{again.blocks[d.a].name, again.blocks[d.b].name} for d in again.doubts] == [{"A", "B"}] * len(again.doubts)


def test_tolerance_follows_the_smaller_block_not_the_model():
    # two stones of 20 mm, 0.2 mm apart, beside blocks of 5 m: alone or not, the stones do not touch
    stones = [box((0, 0, 0), (0.02, 0.02, 0.02)), box((0.0202, 0, 0), (0.0402, 0.02, 0.02))]
    floor = box((-5, -5, -5), (6, 6, 0))
    large = [box((6 + 5 * k, 0, 0), (11 + 5 * k, 5, 5)) for k in range(6)]
    with pytest.warns(lm.ContactWarning, match=r"'block-0' and 'block-1' \(gap 0.2 mm"):
        assembly = lm.Assembly.from_polyhedra([*stones, floor, *large], joint=JOINT)
    pairs = {(i.block_a, i.block_b) for i in assembly.interfaces}
    assert (0, 1) not in pairs
    assert {(0, 2), (1, 2)} <= pairs
    # and large blocks keep their own tolerance beside many small ones
    apart = [box((0, 0, 0), (5, 5, 5)), box((0, 0, 5.0004), (5, 5, 10))]
    pebbles = [box((10 + k, 0, 0), (10.01 + k, 0.01, 0.01)) for k in range(9)]
    both = lm.Assembly.from_polyhedra([*apart, *pebbles], joint=JOINT)
    assert [(i.block_a, i.block_b) for i in both.interfaces] == [(0, 1)]


def mosaic(seed, n=25):
    """Convex cells that fill the unit square without gaps."""
    from scipy.spatial import Voronoi

    points = np.random.default_rng(seed).uniform(0, 1, (n, 2))
    images = [np.where([axis == 0, axis == 1], 2 * side - points, points) for axis in (0, 1) for side in (0, 1)]
    cells = Voronoi(np.vstack([points, *images]))
    return [cells.vertices[cells.regions[cells.point_region[i]]] for i in range(n)]


@pytest.mark.exact
@pytest.mark.parametrize("seed", [19, 32, 43])  # without edges as short as the jitter
def test_exact_mosaic_raises_no_alarm_and_a_traced_one_the_same_in_any_order(seed):
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exact = lm.Assembly.from_polygons([c @ turn for c in mosaic(seed)], thickness=0.2, joint=JOINT, fixed=[0])
    report = exact.contact_report()
    assert [report.decisions, report.passed_over, report.edges] == [(), (), ()]

    rng = np.random.default_rng(1)
    traced = [c + rng.normal(0.0, 5e-4, c.shape) for c in mosaic(seed)]

    def traced_report(order, scale=1.0, matrix=None):
        outlines = [scale * (traced[i] if matrix is None else traced[i] @ matrix) for i in order]
        names = [f"stone-{i}" for i in order]
        return lm.Assembly.from_polygons(
            outlines, names=names, thickness=0.2 * scale, joint=JOINT, tolerance=0.003 * scale
        ).contact_report()

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lm.PlausibilityWarning)
        first = signature(traced_report(range(25)), 1.0)
        assert first[3]  # rounded corners and slivers are passed over, and said to be
        assert signature(traced_report(range(24, -1, -1)), 1.0) == first
        assert signature(traced_report(range(25), 1e-3), 1e-3) == first
        assert signature(traced_report(range(25), 1e3, turn), 1e3) == first


# ---- what the interface model cannot carry, and what is no near miss -------------------------------------------------


def test_edges_and_corners_are_named():
    roof = [[1, 1], [2, 2], [0, 2]]  # stands on its tip
    outlines = [[[0, 0], [2, 0], [2, 1], [0, 1]], roof]
    report = lm.Assembly.from_polygons(outlines, thickness=0.5, joint=JOINT).contact_report()
    assert [(e.a, e.b, e.kind) for e in report.edges] == [("block-0", "block-1", "edge")]
    assert report.edges[0].place == pytest.approx([1.0, 0.25, 1.0], abs=1e-3)
    assert report.floating == ("block-0", "block-1")
    cubes = [box((0, 0, 0), (1, 1, 1)), box((1, 1, 1), (2, 2, 2))]
    (corner,) = lm.Assembly.from_polyhedra(cubes, joint=JOINT).contact_report().edges
    assert corner.kind == "corner"
    assert corner.place == pytest.approx([1.0, 1.0, 1.0], abs=1e-3)
    # four blocks at a cross: the diagonal ones share an edge, the others faces
    cross = [box((x, 0, z), (x + 1, 1, z + 1)) for x in (0, 1) for z in (0, 1)]
    report = lm.Assembly.from_polyhedra(cross, joint=JOINT, fixed=[0]).contact_report()
    assert [(e.a, e.b) for e in report.edges] == [("block-0", "block-3"), ("block-1", "block-2")]
    assert not report.decisions


def test_crossed_ridges_touch_at_a_point():
    lower = lm.geometry.prism([[-1, 0], [1, 0], [0, 0.5]], -1, 1)
    turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    upper = lm.geometry.prism([[0, 0.5], [1, 1], [-1, 1]], -1, 1)
    solids = [lower, (upper.vertices @ turned.T, upper.faces)]
    with pytest.warns(lm.ContactWarning, match=r"1 pair\(s\) of faces nearly touch"):
        report = lm.Assembly.from_polyhedra(solids, joint=JOINT).contact_report()
    (ridge,) = report.edges
    assert ridge.kind == "corner"
    assert ridge.place == pytest.approx([0, 0, 0.5], abs=1e-3)
    # slopes of 1 : 2 crossed at a right angle: cos t = 4/5
    assert [m.angle_deg for m in report.near_misses] == pytest.approx([np.degrees(np.arccos(0.8))])


def test_thin_block_between_two_others_is_no_gap():
    # a tile of 4 mm between blocks of 1 m: they face each other 4 mm apart, and nothing is missing
    solids = [box((0, 0, 0), (1, 1, 1)), box((0, 0, 1), (1, 1, 1.004)), box((0, 0, 1.004), (1, 1, 2))]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assembly = lm.Assembly.from_polyhedra(solids, joint=JOINT, fixed=[0])
    assert not assembly.contact_report().decisions
    # nor is a slim wedge between two others, however near its tip they come
    tip = [[[-1, 0], [0, 0], [1, 1], [-1, 1]], [[0, 0], [1.15, 1], [1, 1]], [[0, 0], [2, 0], [2, 1], [1.15, 1]]]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wedge = lm.Assembly.from_polygons(tip, thickness=0.5, joint=JOINT, fixed=[0])
    assert [(i.block_a, i.block_b) for i in wedge.interfaces] == [(0, 1), (1, 2)]


def test_faces_cut_into_triangles_give_one_near_miss():
    a, b = box((0, 0, 0), (1, 1, 1)), box((0, 0, 1.002), (1, 1, 2))
    cut = tuple(t for f in a.faces for t in ((f[0], f[1], f[2]), (f[0], f[2], f[3])))
    with pytest.warns(lm.ContactWarning):
        assembly = lm.Assembly.from_polyhedra([(a.vertices, cut), (b.vertices, cut)], joint=JOINT)
    (miss,) = assembly.contact_report().near_misses
    assert miss.area == pytest.approx(1.0)
    assert miss.gap == pytest.approx((0.002, 0.002))


def test_steps_of_two_blocks_are_near_misses_of_their_own():
    low = [[0, 0], [2, 0], [2, 1.3], [1, 1.3], [1, 1], [0, 1]]
    high = [[0, 1.002], [0.99, 1.002], [0.99, 1.302], [2, 1.302], [2, 2], [0, 2]]
    with pytest.warns(lm.ContactWarning):
        assembly = lm.Assembly.from_polygons([low, high], thickness=0.5, joint=JOINT, fixed=[0, 1])
    misses = sorted((m for m in assembly.contact_report().near_misses if m.kind == "apart"), key=lambda m: m.place[2])
    steps = [m for m in misses if m.gap == pytest.approx((0.002, 0.002))]
    assert [m.place[2] for m in steps] == pytest.approx([1.001, 1.301])
    assert [m.area for m in steps] == pytest.approx([0.5 * 0.99, 0.5])


def test_blocks_that_float_or_overlap_can_still_be_reported():
    pier = [[0, 0.005], [1, 0.005], [1, 2], [0, 2]]
    ground = [[-1, -1], [2, -1], [2, 0], [-1, 0]]
    with pytest.raises(lm.ContactError, match="'block-1' floats.*nearest miss: 'block-0' and 'block-1'") as error:
        lm.Assembly.from_polygons([ground, pier], thickness=0.5, joint=JOINT, fixed=[0])
    report = error.value.assembly.contact_report()
    assert report.floating == ("block-1",)
    assert report.decisions == ("1 near miss", "1 floating block")
    deep = [[0, -0.1], [1, -0.1], [1, 2], [0, 2]]
    with pytest.raises(lm.ContactError, match="overlap by 0.1 m") as error:
        lm.Assembly.from_polygons([ground, deep], thickness=0.5, joint=JOINT, fixed=[0])
    assert error.value.assembly.contact_report().overlaps == (("block-0", "block-1", pytest.approx(0.1)),)


def test_block_on_a_sliver_hangs():
    outlines = [[[0, 0], [1, 0], [1, 1], [0, 1]], [[0.99, 1], [2, 1], [2, 2], [0.99, 2]]]
    report = lm.Assembly.from_polygons(outlines, thickness=0.5, joint=JOINT, fixed=[0]).contact_report()
    assert report.hanging == ("block-1",)
    assert [c.width for c in report.tiny] == pytest.approx([0.01])
    # 2 A / P of 10 mm x 0.5 m is 9.8 mm
    wide = lm.Assembly.from_polygons(outlines, thickness=0.5, joint=JOINT, smallest_contact=0.012)
    (narrow,) = wide.contact_report().passed_over
    assert narrow.kind == "narrow"
    assert ("no least width", 1) in wide.contact_report().would_add


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_bearing_narrower_than_the_least_width_is_named_and_kept_on_demand(scale):
    piers = [[[0, 0], [0.3, 0], [0.3, 1], [0, 1]], [[2 - 1e-5, 0], [2.5, 0], [2.5, 1], [2 - 1e-5, 1]]]
    outlines = [np.multiply(scale, o) for o in (*piers, [[0, 1], [2, 1], [2, 1.3], [0, 1.3]])]
    with pytest.warns(lm.ContactWarning, match="'block-1' and 'block-2'.*wide.*lower smallest_contact to keep them"):
        beam = lm.Assembly.from_polygons(outlines, thickness=0.5 * scale, joint=JOINT, fixed=[0, 1])
    (miss,) = beam.contact_report().near_misses
    assert (miss.kind, miss.a, miss.b) == ("narrow", "block-1", "block-2")
    assert lm.limit_analysis(beam, lm.Loads.horizontal(beam)).warnings[-1].startswith("1 pair of faces nearly touches")
    given = {"thickness": 0.5 * scale, "joint": JOINT, "fixed": [0, 1]}
    with warnings.catch_warnings():
        warnings.simplefilter("error", lm.ContactWarning)
        left_out = lm.Assembly.from_polygons(outlines, smallest_contact=1e-4 * scale, **given)
        kept = lm.Assembly.from_polygons(outlines, smallest_contact=1e-6 * scale, **given)
        # an edge that touches by rounding alone is no bearing
        lm.Assembly.from_polygons([o + ((1e-5 - 1e-9) * scale * (k == 1), 0) for k, o in enumerate(outlines)], **given)
    assert (len(left_out.interfaces), len(kept.interfaces)) == (1, 2)


def test_untouched_faces_are_the_outer_ones():
    cubes = [box((0, 0, k), (1, 1, k + 1)) for k in range(3)]
    stack = lm.Assembly.from_polyhedra(cubes, joint=JOINT, fixed=[0])
    report = stack.contact_report()
    assert (len(report.untouched), report.n_faces) == (14, 18)
    assert str(report).endswith("nothing to decide")
    # cuts between the pieces of a concave block are no faces: an L of two boxes has 10 outer ones in two pieces
    ell = [box((0, 0, 0), (2, 1, 1)), box((0, 0, 1), (1, 1, 2))]
    alone = lm.Assembly.from_polyhedra([ell], joint=JOINT).contact_report()
    assert alone.n_faces == len(alone.untouched) == 11  # the upper piece's foot is a cut, the lower one's top is not
    without = stack.with_interfaces(stack.interfaces[1:]).contact_report()
    assert [m.kind for m in without.near_misses] == ["left out"]


def test_rules_of_contact_are_checked():
    cubes = [box((0, 0, 0), (1, 1, 1))]
    with pytest.raises(ValueError, match="contact angles must keep 0 <= wedge"):
        lm.Assembly.from_polyhedra(cubes, joint=JOINT, angle_tolerance_deg=60.0)
    with pytest.raises(ValueError, match="contact width must be positive"):
        lm.Assembly.from_polyhedra(cubes, joint=JOINT, smallest_contact=-1.0)
    with pytest.raises(ValueError, match="distance must be positive"):
        lm.Assembly.from_polyhedra(cubes, joint=JOINT).contact_report(distance=0.0)


# ---- file, command and figure ---------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::limitmason.ContactWarning")
@pytest.mark.parametrize("options", [{}, {"tolerance": 0.002}, {"angle_tolerance_deg": 10.0, "smallest_contact": 1e-5}])
def test_model_file_keeps_the_rules_and_what_they_gave(tmp_path, options):
    assembly = lug(11.0, joints={}, **options)
    lm.formats.write_json(tmp_path / "m.json", assembly)
    back = lm.formats.read_json(tmp_path / "m.json").assembly
    assert back.contact_rules == assembly.contact_rules
    assert back.tolerance == assembly.tolerance
    assert signature(back.contact_report(), 1.0) == signature(assembly.contact_report(), 1.0)
    assert [d.kind for d in back.doubts] == [d.kind for d in assembly.doubts]


@pytest.mark.filterwarnings("ignore::limitmason.ContactWarning")
def test_check_command(tmp_path, capsys):
    from limitmason.cli import main

    figure = tmp_path / "check.png"
    assert main(["check", "ferris-tin-loi-2001/wall-1"]) == 0
    assert "nothing to decide" in capsys.readouterr().out
    lm.formats.write_json(tmp_path / "lug.json", lug(20.0, joints={}))
    assert main(["check", str(tmp_path / "lug.json"), "--figure", str(figure)]) == 1
    assert "A | B | turned" in capsys.readouterr().out
    assert figure.stat().st_size > 10_000
    assert main(["check", str(tmp_path / "lug.json"), "--angle", "18"]) == 0
    floats = tmp_path / "floats.json"
    floats.write_text(
        '{"schema": "limitmason-model", "version": 1, "thickness": 0.5, "density": 20, "fixed": [0],'
        '"joint": {"friction_angle_deg": 0.6}, "outlines": [[[0, 0], [1, 0], [1, 1], [0, 1]],'
        "[[0, 2], [1, 2], [1, 3], [0, 3]]]}"
    )
    capsys.readouterr()
    assert main(["check", str(floats)]) == 1
    out = capsys.readouterr().out
    for part in ("1 floating block", "'block-1' floats", "looks like radians (34.4 degrees)", "looks like kN/m3"):
        assert part in out
    assert main(["check", str(floats), "--tolerance", "0.1"]) == 2
    lm.formats.write_obj(tmp_path / "lug.obj", lug(0.0, joints={}))
    assert main(["check", str(tmp_path / "lug.obj")]) == 0


@pytest.mark.filterwarnings("ignore::limitmason.ContactWarning")
def test_figure_shows_contacts_wedges_and_misses():
    from figure_models import artist, has, legend_labels, texts

    figure = lm.figures.contact_report(lug(2.0, 0.4, joints={}))
    assert len(artist(figure, "contacts").get_segments()) == 3
    (wedge,) = artist(figure, "kept").get_segments()
    assert np.linalg.norm(np.diff(wedge, axis=0)) == pytest.approx(whole(2.0, 0.4), rel=1e-6)
    assert "0–14 mm, 2°" in texts(figure)
    assert {"contact", "wedge kept: gap, angle", "tiny contact", "touches nothing", "fixed"} == set(
        legend_labels(figure)
    )
    missed = lug(20.0, joints={})
    column = lm.build.column(width=0.4, depth=0.4, unit_height=0.2, courses=7, joint=JOINT)
    with pytest.raises(lm.errors.InputError, match="report is of . blocks, the assembly has 8"):
        lm.figures.contact_report(column, missed.contact_report())
    for view in ("elevation", "3d"):
        figure = lm.figures.contact_report(missed, view=view, labels=view == "3d")
        assert has(figure, "near misses")
        assert not has(figure, "kept")
        assert ("0–7.6 mm, 20°" in texts(figure)) == (view == "3d")


def test_a_short_label_of_a_near_miss_does_not_cover_a_long_one():
    """Places 50 points apart: the label of the first, of 20 letters, is wider than that, that of the second is not."""
    near = [
        NearMiss("a", "b", "gap", gap, angle, 0.0, np.array([x, 0.0, 0.3]), [])
        for gap, angle, x in (((1.2e-3, 13.4e-3), 12.0, 0.25), ((1e-3, 1e-3), 1.0, 0.25 + 50.0 / 72.0 / 6.0))
    ]
    figure = Figure(figsize=(6.0, 6.0))
    FigureCanvasAgg(figure)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(-0.5, 0.5), ylim=(0.0, 1.0))
    contacts._label(style.Page((1.0, 1.0), ax), [(miss, "black") for miss in near], np.eye(3)[:, [0, 2]])
    first, second = (Text.get_window_extent(text, figure.canvas.get_renderer()) for text in ax.texts)
    assert first.width > 50.0 / 72.0 * figure.dpi
    assert not first.overlaps(second)


def test_near_misses_go_along_where_blocks_are_resized_or_displaced():
    outlines = [[(0, 0), (1, 0), (1, 0.2), (0, 0.2)], [(0, 0.2), (1, 0.2), (1, 0.5), (0, 0.5)],
                [(0, 0.501), (1, 0.501), (1, 0.8), (0, 0.8)], [(1, 0.2), (1.3, 0.2), (1.3, 0.8), (1, 0.8)]]
    with pytest.warns(lm.ContactWarning):
        wall = lm.Assembly.from_polygons(outlines, thickness=0.3, joint=lm.Joint(30.0), fixed=[0, 3])
    (before,) = wall.near_misses
    (after,) = resized(wall, (2.0, 1.0, 3.0)).near_misses
    assert after.place == pytest.approx(before.place * (2.0, 1.0, 3.0))
    assert after.gap[1] == pytest.approx(3.0 * before.gap[1])
    assert after.area == pytest.approx(2.0 * before.area)
    u = np.zeros((4, 6))
    u[:, 0] = 10.0
    (after,) = displaced(wall, u).near_misses
    assert after.place == pytest.approx(before.place + (10.0, 0.0, 0.0))
    u[2, 2] = -0.001  # the gap closes
    assert not [d for d in displaced(wall, u).doubts if d.kind == "apart"]


def test_in_space_blocks_that_float_have_the_colour_of_their_legend():
    blocks = [box((0, 0, 0), (1, 1, 1)), box((0, 0, 1), (1, 1, 2)), box((3, 0, 3), (4, 1, 4))]
    with pytest.raises(ContactError) as refused:
        lm.Assembly.from_polyhedra(blocks, joint=JOINT, fixed=[0])
    figure = lm.figures.contact_report(refused.value.assembly, view="3d")
    entries = {h.get_label(): h.get_facecolor() for h in figure.legends[0].get_patches()}
    assert set(entries) == {"floats", "fixed"}  # nothing moves here
    assert entries["floats"] == to_rgba(style.STONE)
