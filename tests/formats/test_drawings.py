"""Drawings as they come: gaps, doubled and single lines, inserted blocks; solved from the shell."""

import math
from itertools import pairwise

import numpy as np
import pytest

import limitmason as lm
from limitmason import formats
from limitmason.cli import main
from limitmason.errors import InputError
from limitmason.formats.outline_repair import loops
from limitmason.geometry import polygon_area_centroid

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("shapely")

JOINT = lm.Joint(33.0)


def bond(courses=4, length=1.2, unit=0.4, height=0.2):
    """Outlines of a running bond, corner to corner."""
    out = []
    for c in range(courses):
        cuts = [0.0, *np.arange(unit / 2, length, unit), length] if c % 2 else list(np.arange(0.0, length + 1e-9, unit))
        for a, b in pairwise(cuts):
            out.append(np.array([[a, c * height], [b, c * height], [b, (c + 1) * height], [a, (c + 1) * height]]))
    return out


def shaken(outlines, by, seed=0):
    rng = np.random.default_rng(seed)
    return [o + rng.uniform(-by, by, o.shape) for o in outlines]


def solved(outlines, **settings):
    wall = lm.Assembly.from_polygons(outlines, thickness=0.2, joint=JOINT, fixed=[0, 1, 2], **settings)
    return lm.limit_analysis(wall, lm.Loads.horizontal(wall)).collapse_multiplier, len(wall.interfaces)


def test_a_shaken_wall_is_closed_within_the_gap_and_carries_what_the_exact_one_does():
    exact, joints = solved(bond())
    cleaned = formats.clean(shaken(bond(), 0.002), 0.006)
    assert cleaned.largest_move <= 0.006
    assert not cleaned.alone
    assert not cleaned.overlaps
    # all joints are there, and those of the drawing's own tolerance only: 1 micrometre
    found, count = solved(cleaned.outlines, tolerance=1e-6)
    assert count == joints
    # corners moved by 2 mm on 400 x 200 mm stones: the multiplier moves by per cents, not more
    assert found == pytest.approx(exact, rel=0.05)


def test_nothing_moves_that_meets_already_and_the_order_of_outlines_does_not_count():
    exact = formats.clean(bond(), 0.005)
    assert exact.changes == ()
    traced = shaken(bond(), 0.002)
    a, b = formats.clean(traced, 0.006), formats.clean(traced[::-1], 0.006)
    assert all(np.allclose(p, q, atol=1e-12) for p, q in zip(a.outlines, b.outlines[::-1], strict=True))


@pytest.mark.parametrize("apart", [[], [0.5]])
def test_outlines_farther_apart_than_the_gap_stay_as_they_are(apart):
    # one stone, and two with half a metre between them: no corner has anything to move to
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    drawn = [square, *(square + [1.0 + a, 0.0] for a in apart)]
    found = formats.clean(drawn, 0.005)
    assert all((a == b).all() for a, b in zip(found.outlines, drawn, strict=True))
    assert found.changes == ()
    assert found.alone == tuple(found.names)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_cleaning_has_no_unit_of_its_own(scale):
    traced = shaken(bond(), 0.002)
    plain = formats.clean(traced, 0.006)
    scaled = formats.clean([scale * o for o in traced], 0.006 * scale)
    assert all(np.allclose(scale * p, q, rtol=1e-9) for p, q in zip(plain.outlines, scaled.outlines, strict=True))


def test_doubled_stones_lonely_ones_and_overlaps_are_named():
    outlines = [*bond(2), bond(2)[0] + 0.0005, np.array([[5.0, 0], [5.3, 0], [5.3, 0.2], [5.0, 0.2]]),
                np.array([[0.1, 0.45], [0.3, 0.3], [0.5, 0.45]])]
    names = [f"s{i}" for i in range(len(outlines))]
    found = formats.clean(outlines, 0.005, names=names)
    doubled = next(c for c in found.changes if c.what.startswith("dropped"))
    assert (doubled.name, doubled.what) == ("s7", "dropped: the same as s0")
    assert found.alone == ("s8",)
    assert {p[:2] for p in found.overlaps} == {("s3", "s9"), ("s4", "s9")}
    assert "s8: touches no other stone" in str(found)


def test_bad_outlines_are_named():
    with pytest.raises(InputError, match=r"stone 1: Self-intersection"):
        formats.clean([[[0, 0], [1, 1], [1, 0], [0, 1]]], 0.01)
    with pytest.raises(InputError, match="stone 2 is no wider than the gap"):
        formats.clean([bond()[0], [[0, 0], [1, 0], [1, 0.001]]], 0.01)
    with pytest.raises(InputError, match="gap must be"):
        formats.clean(bond(), 0.0)


def drawn(path, fill, unit=4):
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = unit
    fill(drawing.modelspace(), drawing)
    drawing.saveas(path)
    return path


def test_a_wall_of_single_lines_arrives_whole(tmp_path):
    # every side drawn once as a line: 64 stones in 8 courses of 8, in mm
    def fill(space, _):
        for k in range(9):
            space.add_line((0, 200 * k), (3200, 200 * k), dxfattribs={"layer": "STONE"})
        for c in range(8):
            for i in range(9):
                x = 400 * i + (200 if c % 2 and 0 < i < 8 else 0)
                space.add_line((x, 200 * c), (x, 200 * c + 200), dxfattribs={"layer": "STONE"})

    found = formats.read_dxf(drawn(tmp_path / "a.dxf", fill))
    assert len(found.outlines) == 64
    area = sum(0.5 * abs(np.dot(o[:, 0], np.roll(o[:, 1], 1)) - np.dot(o[:, 1], np.roll(o[:, 0], 1)))
               for o in found.outlines)
    assert area == pytest.approx(3.2 * 1.6, rel=1e-9)
    assert all(len(o) == 4 for o in found.outlines)  # the corners of the course above are no corners of a stone


def test_lines_arcs_and_inserted_blocks_form_loops_and_the_rest_is_counted(tmp_path):
    def fill(space, drawing):
        space.add_line((0, 0), (1, 0))
        space.add_line((1, 0), (1, 1))
        space.add_arc((0.5, 1), 0.5, 0, 180)  # a stone with a round head
        space.add_line((0, 1), (0, 0))
        space.add_line((3, 3), (4, 4))  # encloses nothing
        space.add_circle((5, 0.5), 0.5)
        block = drawing.blocks.new("STONE")
        block.add_lwpolyline([(0, 0), (1, 0), (1, 1), (0, 1)], close=True)
        space.add_blockref("STONE", (2, 0))
        space.add_blockref("STONE", (7, 0), dxfattribs={"xscale": 2.0})

    with pytest.warns(lm.PlausibilityWarning, match="1 LINE of 5 single lines enclose no block"):
        found = formats.read_dxf(drawn(tmp_path / "a.dxf", fill, unit=6), flatness=1e-5)
    areas = sorted(
        0.5 * abs(np.dot(o[:, 0], np.roll(o[:, 1], 1)) - np.dot(o[:, 1], np.roll(o[:, 0], 1))) for o in found.outlines
    )
    half_round = 1.0 + math.pi / 8.0
    assert areas == pytest.approx(sorted([1.0, 2.0, math.pi / 4.0, half_round]), rel=1e-3)


def test_layers_say_what_is_held_and_what_is_no_block(tmp_path):
    def fill(space, _):
        for o in bond(3):
            space.add_lwpolyline(1e3 * o, close=True, dxfattribs={"layer": "STONE"})
        space.add_lwpolyline([(-200, -200), (1400, -200), (1400, 0), (-200, 0)], close=True,
                             dxfattribs={"layer": "Ground"})
        space.add_lwpolyline([(0, 0), (1, 0), (1, 1)], close=True, dxfattribs={"layer": "OPENINGS"})

    model = formats.model_of_drawing(drawn(tmp_path / "a.dxf", fill), joint=JOINT, thickness=0.2)
    wall = model.assembly
    assert [wall.blocks[i].name for i in np.flatnonzero(wall.fixed)] == ["Ground-1"]
    assert wall.n_blocks == len(bond(3)) + 1
    assert not any("held" in text for text in model.assumed)


def test_a_drawing_is_solved_from_the_shell(tmp_path, capsys):
    # a column rocks at b / h, whatever the courses: lambda = 200 / 800 above the held stone
    def fill(space, _):
        for k in range(5):
            space.add_lwpolyline([(0, 200 * k), (200, 200 * k), (200, 200 * k + 199), (0, 200 * k + 199)], close=True)

    path = drawn(tmp_path / "column.dxf", fill)
    words = ["--thickness", "0.4", "--friction", "40", "--tilt", "x", "--gap", "0.002"]
    assert main(["solve", str(path), *words]) == 0
    out = capsys.readouterr()
    assert "lambda = 0.25" in out.out
    assert "moved by up to 0.5 mm" in out.err
    assert "held: 0-1, which reach down to the lowest level" in out.err
    assert main(["solve", str(path), "--friction", "40"]) == 2
    assert "give the thickness" in capsys.readouterr().err
    assert main(["solve", str(path)]) == 2
    assert "--thickness 0.4 --friction 33 --tilt x" in capsys.readouterr().err
    assert main(["solve", "ferris-tin-loi-2001/wall-1", "--friction", "40"]) == 2
    assert "--friction is not used by an experiment" in capsys.readouterr().err


def test_gaps_between_the_lines_of_two_stones_are_no_stones():
    # two courses of single lines, head joints 2 mm and bed joints 1 mm open
    def around(left, right, bottom, top):
        corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top]], dtype=float)
        return [corners[[k, (k + 1) % 4]] for k in range(4)]

    stones = [(0, 0.598, 0, 0.299), (0.6, 1.198, 0, 0.299), (0, 0.298, 0.3, 0.6), (0.3, 0.898, 0.3, 0.6)]
    lines = [line for s in stones for line in around(*s)]
    drawn = np.array(lines)
    found, unused = loops(lines, 0.005)
    assert (np.array(lines) == drawn).all()  # what the caller drew stays
    assert not unused
    assert sorted(np.ptp(f, axis=0)[0] for f in found) == pytest.approx([0.298, 0.598, 0.598, 0.598], abs=0.005)
    wall = lm.Assembly.from_polygons(formats.clean(found, 0.005).outlines, thickness=0.3, joint=JOINT, tolerance=1e-4)
    assert len(wall.interfaces) == 5  # two head joints, and beds of the upper stones on one and two others


def test_of_many_moved_stones_the_text_names_the_farthest():
    cleaned = formats.clean(shaken(bond(), 0.001), 0.005)
    lines = str(cleaned).split("\n")
    moved = [c for c in cleaned.changes if c.what == "moved"]
    assert len(moved) > 10
    assert sum("moved by up to" in line for line in lines) == 10
    assert f"and {len(moved) - 10} more by" in lines[-1]
    assert f"{1e3 * cleaned.largest_move:.3g} mm" in lines[1]


def apart(outlines, mortar):
    """Rectangles with half a joint taken off every side."""
    middle = [0.5 * (o.min(axis=0) + o.max(axis=0)) for o in outlines]
    half = [0.5 * np.ptp(o, axis=0) for o in outlines]
    return [
        m + (o - m) * (h - 0.5 * mortar) / h for o, m, h in zip(outlines, middle, half, strict=True)
    ]


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_stones_between_mortar_joints_grow_to_meet_and_keep_their_free_sides(turn):
    mortar, c, s = 0.012, math.cos(turn), math.sin(turn)
    drawn = apart(bond(courses=3, length=1.2, unit=0.4, height=0.2), mortar)
    drawn = [o @ np.array([[c, s], [-s, c]]) for o in drawn]
    cleaned = formats.clean(drawn, 0.001, mortar=mortar)
    assert cleaned.mortar == mortar
    assert cleaned.alone == ()
    assert cleaned.overlaps == ()
    # mortar within the wall is filled and nothing else: the wall's outer sides stay half a joint inside the bond's
    areas = [abs(polygon_area_centroid(o)[0]) for o in cleaned.outlines]
    assert sum(areas) == pytest.approx((1.2 - mortar) * (0.6 - mortar), rel=1e-9)
    back = [o @ np.array([[c, -s], [s, c]]) for o in cleaned.outlines]
    wall = lm.Assembly.from_polygons(back, thickness=0.3, joint=JOINT, fixed=[0, 1, 2], tolerance=1e-6)
    exact = lm.Assembly.from_polygons(bond(courses=3), thickness=0.3, joint=JOINT, fixed=[0, 1, 2], tolerance=1e-6)
    assert len(wall.interfaces) == len(exact.interfaces)
    assert "half a mortar joint" in str(cleaned)


def test_mortar_leaves_openings_open_and_is_refused_where_it_means_nothing(tmp_path):
    piers = [np.array([[x, 0.0], [x + 0.3, 0.0], [x + 0.3, 1.0], [x, 1.0]]) for x in (0.0, 0.7)]
    lintel = np.array([[0.0, 1.01], [1.0, 1.01], [1.0, 1.2], [0.0, 1.2]])
    cleaned = formats.clean([*piers, lintel], 0.001, mortar=0.01)
    assert cleaned.outlines[0].max(axis=0) == pytest.approx([0.3, 1.005])  # up to the lintel, not into the opening
    assert cleaned.outlines[2].min(axis=0) == pytest.approx([0.0, 1.005])
    for wrong in (-0.01, math.nan):
        with pytest.raises(InputError, match=r"mortar \[m\] must (not be negative|be a finite number)"):
            formats.clean(piers, 0.001, mortar=wrong)


def test_a_wall_with_mortar_is_solved_from_the_shell(tmp_path, capsys):
    # a block 0.4 x 0.8 over a joint of 20 mm falls as one 0.4 x 0.81: half the joint is counted to it
    drawing = ezdxf.new(units=6)
    plane = drawing.modelspace()
    for layer, corners in (
        ("base", [(-1, -0.5), (1, -0.5), (1, 0), (-1, 0)]), ("stones", [(0, 0.02), (0.4, 0.02), (0.4, 0.82), (0, 0.82)])
    ):
        plane.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    drawing.saveas(tmp_path / "wall.dxf")
    wall = [str(tmp_path / "wall.dxf"), "--thickness", "0.3", "--friction", "45"]
    assert main(["solve", *wall, "--mortar", "0.02"]) == 0
    shown = capsys.readouterr()
    assert f"{0.4 / 0.81:.6f}"[:7] in shown.out
    assert "half a mortar joint" in shown.err


def inserted(path, *, nested=False, columns=1):
    """A wall of 49 stones drawn on layer stones, and 14 in a block on layer 0 that is inserted on layer stones."""
    drawing = ezdxf.new(units=6)
    for name in ("stones", "other"):
        drawing.layers.add(name)
    plane, block = drawing.modelspace(), drawing.blocks.new("course")
    stone = np.array([[0.0, 0.0], [0.4, 0.0], [0.4, 0.2], [0.0, 0.2]])
    for k in range(49):
        plane.add_lwpolyline(stone + [0.4 * (k % 7), 0.2 * (k // 7)], close=True, dxfattribs={"layer": "stones"})
    for k in range(14 // columns):
        block.add_lwpolyline(stone + [0.4 * k, 1.4], close=True)
    block.add_lwpolyline(stone + [9.0, 9.0], close=True, dxfattribs={"layer": "other"})
    target = plane
    if nested:
        target = drawing.blocks.new("storey")
        plane.add_blockref("storey", (0.0, 0.0), dxfattribs={"layer": "stones"})
    insert = target.add_blockref("course", (0.0, 0.0), dxfattribs={"layer": "0" if nested else "stones"})
    insert.dxf.column_count, insert.dxf.column_spacing = columns, 0.4 * (14 // columns)
    drawing.saveas(path)
    return path


@pytest.mark.parametrize("options", [{}, {"nested": True}, {"columns": 2}])
def test_what_lies_on_layer_0_of_a_block_lies_where_it_is_inserted(tmp_path, options):
    read = formats.read_dxf(inserted(tmp_path / "wall.dxf", **options), layers=["stones"])
    assert len(read.outlines) == 63
    assert set(read.layers) == {"stones"}
    assert sum(abs(polygon_area_centroid(o)[0]) for o in read.outlines) == pytest.approx(63 * 0.08)
    every = formats.read_dxf(tmp_path / "wall.dxf")
    assert sorted(set(every.layers)) == ["other", "stones"]


def test_a_cut_drawing_is_refused_by_its_name_wherever_it_is_cut(tmp_path):
    whole = inserted(tmp_path / "whole.dxf").read_text(encoding="utf-8")
    path = tmp_path / "cut.dxf"
    lines = whole.splitlines(keepends=True)
    said = []
    for share in (0.0, 0.001, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 0.99):
        for odd in (0, 1):
            path.write_text("".join(lines[: int(share * len(lines)) + odd]), encoding="utf-8")
            try:
                formats.read_dxf(path)
            except InputError as error:
                said.append(str(error))
    assert said
    assert all("cut.dxf" in text for text in said)
    path.write_text("0\nSECTION\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"cut\.dxf"):
        formats.read_dxf(path)


SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])


def areas(found):
    return sorted(abs(polygon_area_centroid(o)[0]) for o in found.outlines)


def sides(space, corners, layers):
    for k, layer in enumerate(layers):
        space.add_line(corners[k], corners[(k + 1) % len(corners)], dxfattribs={"layer": layer})


def both_triangles(space, _):
    space.add_lwpolyline([(0, 0), (1, 0), (0, 1)], close=True)  # and the other half of its box in single lines
    sides(space, [(1, 0), (1, 1), (0, 1)], "000")


def points(space, _):
    space.add_lwpolyline(SQUARE, close=True)
    space.add_line((3, 3), (3, 3))
    space.add_lwpolyline([(4, 4), (4, 4)])


def invisible(space, drawing):
    # as the states of a dynamic block that are not chosen
    block = drawing.blocks.new("STONE")
    for k in range(3):
        block.add_lwpolyline(SQUARE + [2 * k, 0], close=True).dxf.invisible = int(k > 0)
    space.add_blockref("STONE", (0, 0))
    space.add_blockref("STONE", (0, 9)).dxf.invisible = 1


def filled_twice(space, _):
    for _ in range(2):
        space.add_hatch().paths.add_polyline_path(SQUARE)


def spelt_in_many_ways(space, _):
    sides(space, SQUARE, ["Wall", "WALL", "wall", "Wall"])


def periodic(space, _):
    space.add_spline().set_closed([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])


@pytest.mark.filterwarnings("ignore::limitmason.model.plausibility.PlausibilityWarning")
@pytest.mark.parametrize(("fill", "exact"), [
    (both_triangles, [0.5, 0.5]), (points, [1.0]), (invisible, [1.0]), (filled_twice, [1.0]),
    (spelt_in_many_ways, [1.0]),
    (periodic, [61 / 90]),  # four pieces of a uniform cubic spline around the unit square
])
def test_drawings_hold_each_block_once_and_whole(tmp_path, fill, exact):
    found = formats.read_dxf(drawn(tmp_path / "a.dxf", fill, unit=6), flatness=1e-6)
    assert areas(found) == pytest.approx(exact, abs=1e-5)
    assert len(set(found.layers)) == 1


def test_parts_of_a_drawing_that_are_not_there_are_told(tmp_path):
    def missing(space, _):
        space.add_lwpolyline(SQUARE, close=True)
        space.add_blockref("LOST", (0, 0))

    def elsewhere(space, drawing):
        space.add_lwpolyline(SQUARE, close=True)
        drawing.add_xref_def("other.dxf", "OTHER")
        space.add_blockref("OTHER", (0, 0))

    with pytest.raises(InputError, match='a.dxf: an inserted block cannot be taken apart.*"LOST"'):
        formats.read_dxf(drawn(tmp_path / "a.dxf", missing))
    with pytest.warns(lm.PlausibilityWarning, match="1 external reference cannot be read"):
        assert len(formats.read_dxf(drawn(tmp_path / "a.dxf", elsewhere)).outlines) == 1
