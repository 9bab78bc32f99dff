"""What `limitmason check` says of a drawing whose stones do not meet, and that what it says works when typed."""

import re
import shlex

import numpy as np
import pytest

import limitmason as lm
from limitmason import formats
from limitmason.cli import main
from limitmason.formats.proposed_options import open_joints
from limitmason.model import ContactWarning, PlausibilityWarning

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("shapely")

JOINT = lm.Joint(33.0)


def drawing(path, stones, unit=6, **more):
    """Rectangles (x, z, width, height) as closed lines on a layer each, circles (x, z, radius) on theirs."""
    made = ezdxf.new()
    made.header["$INSUNITS"] = unit
    space = made.modelspace()
    for layer, rows in (stones | more).items():
        for row in rows:
            if len(row) == 3:
                space.add_circle(row[:2], row[2], dxfattribs={"layer": layer})
                continue
            x, z, w, h = row
            corners = [(x, z), (x + w, z), (x + w, z + h), (x, z + h)]
            space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    made.saveas(path)
    return path


def bond(joint, courses=4, length=400.0, height=200.0, edge=lambda: 0.0):
    """Running bond four units long, in millimetres, with open joints, over a plinth."""
    out = {"STONES": [], "base": [(-100, -joint - 100, 4 * (length + joint) + 200, 100)]}
    for r in range(courses):
        start = 0.0 if r % 2 == 0 else -0.5 * (length + joint)
        for c in range(5):
            left = max(start + c * (length + joint), 0.0)
            right = min(start + c * (length + joint) + length, 4 * (length + joint) - joint)
            if right - left > 0.1 * length:
                a, b, d, e = (edge() for _ in range(4))
                out["STONES"].append((left + a, r * (height + joint) + b, right - left - a - d, height - b - e))
    return out


def proposed(text):
    """The command between back quotes."""
    return shlex.split(re.search("`limitmason (.*?)`", text).group(1))


def test_open_mortar_is_measured_and_the_proposed_command_leaves_nothing_to_decide(tmp_path, capsys):
    path = drawing(tmp_path / "wall.dxf", bond(12.0), 4, PIPES=[(600, 300, 40)])
    assert main(["check", str(path)]) == 1
    said = capsys.readouterr().out
    assert said.startswith("12 mm of open mortar everywhere; what is drawn on 'PIPES' lies in stones of other layers")
    typed = proposed(said)
    assert typed[2:] == ["--mortar", "0.012", "--layers", "STONES", "base"]
    assert main(typed) == 0
    out = capsys.readouterr().out
    assert "nothing to decide" in out
    assert "try `" not in out
    # the same words make an assembly in Python, and solve from the shell
    wall = formats.read_drawing(path, mortar=0.012, layers=["stones", "base"], joint=JOINT)
    assert wall.n_blocks == 19
    assert not wall.contact_report().floating
    assert main(["solve", str(path), *typed[2:], "--thickness", "20cm", "--friction", "33"]) == 0


def test_the_proposed_command_keeps_what_was_typed_and_names_with_spaces(tmp_path, capsys):
    # without the layers it would read the pipe again, which the proposal was not measured with
    path = drawing(tmp_path / "the wall.dxf", bond(12.0), 4, PIPES=[(600, 300, 40)])
    assert main(["check", str(path), "--layers", "STONES", "base", "--thickness", "20cm"]) == 1
    typed = proposed(capsys.readouterr().out)
    assert typed[1:] == [str(path), "--thickness", "0.2", "--mortar", "0.012", "--layers", "STONES", "base"]
    assert main(typed) == 0


def test_a_layer_of_which_nothing_is_held_by_a_stone_is_left_out_of_the_proposal(tmp_path, capsys):
    # a pipe in the open air touches no stone at any thickness of the mortar, and once kept the mortar from being told
    path = drawing(tmp_path / "wall.dxf", bond(12.0), 4, PIPES=[(2500, 400, 40)])
    assert main(["check", str(path)]) == 1
    said = capsys.readouterr().out
    assert said.startswith("12 mm of open mortar everywhere; nothing on 'PIPES' is held by a stone: try")
    typed = proposed(said)
    assert typed[2:] == ["--mortar", "0.012", "--layers", "STONES", "base"]
    assert main(typed) == 0


def test_hand_drawn_gaps_are_measured_and_no_second_tolerance_is_needed(tmp_path, capsys):
    rng = np.random.default_rng(1)
    path = drawing(tmp_path / "wall.dxf", bond(0.0, edge=lambda: rng.uniform(0.0, 2.0)), 4)
    assert main(["check", str(path)]) == 1
    said = capsys.readouterr().out
    assert re.match(r"gaps of up to [\d.]+ mm between stones: try `limitmason check .* --gap 0.00\d+`; then no", said)
    assert main(proposed(said)) == 0
    capsys.readouterr()
    # a gap that corners cannot wholly close once ended with "raise the tolerance", which no command took
    assert main(["check", str(path), "--gap", "3mm"]) == 1
    out = capsys.readouterr().out
    assert "0 contacts" not in out
    assert "floating" not in out
    assert "to decide: 2 wedges kept in part" in out
    cleaned = formats.clean(formats.read_dxf(path, layers="STONES").outlines, 0.003)
    with pytest.warns(ContactWarning, match="open like a wedge"):
        wall = lm.Assembly.from_polygons(cleaned.outlines, thickness=0.2, joint=JOINT, fixed=[0], tolerance=cleaned.gap)
    assert not wall.contact_report().floating


@pytest.mark.exact
def test_widths_of_open_joints_are_those_that_connect_all_stones():
    # three squares of 1 m, 10 mm and 30 mm apart, and a fourth that touches the third
    left = [0.0, 1.01, 2.04, 3.04]
    squares = [np.array([[x, 0], [x + 1, 0], [x + 1, 1], [x, 1.0]]) for x in left]
    assert sorted(open_joints(squares)) == pytest.approx([0.0, 0.01, 0.03], abs=1e-9)


def test_a_drawing_whose_stones_meet_gets_no_proposal(tmp_path, capsys):
    path = drawing(tmp_path / "wall.dxf", bond(0.0), 4)
    assert formats.proposal(path) is None
    assert main(["check", str(path)]) == 0
    assert "try `" not in capsys.readouterr().out


@pytest.mark.parametrize("command", [["compare", "--methods", "associative"], ["stability"], ["solve"]])
def test_commands_take_a_drawing_with_its_layers(command, tmp_path, capsys):
    # a column of three 0.2 m cubes on a held one rocks at 0.2 / 0.6; a pipe in it is no block
    cubes = [(0, 0.2 * k, 0.2, 0.2) for k in range(1, 4)]
    path = drawing(tmp_path / "column.dxf", {"stones": cubes, "base": [(0, 0, 0.2, 0.2)], "pipe": [(0.1, 0.3, 0.03)]})
    typed = [command[0], str(path), *command[1:], "--thickness", "0.2", "--friction", "40"]
    typed += ["--layers", "stones", "base"]
    assert main(typed) == 0
    out = capsys.readouterr()
    assert ("can stand" if command == ["stability"] else "0.33333") in out.out
    assert main([*typed[:-3], "--layers", "stone"]) == 2
    assert "there is no layer 'stone'; there are" in capsys.readouterr().err


def test_hatches_and_filled_faces_are_blocks_where_nothing_else_is_drawn(tmp_path):
    made = ezdxf.new()
    made.header["$INSUNITS"] = 6
    space = made.modelspace()
    for k in range(3):
        corners = [(0, 0.2 * k), (0.4, 0.2 * k), (0.4, 0.2 * k + 0.2), (0, 0.2 * k + 0.2)]
        if k == 0:
            space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "line"})
        if k == 1:
            space.add_solid([corners[0], corners[1], corners[3], corners[2]], dxfattribs={"layer": "face"})
        # over all three a hatch: it repeats the first two
        space.add_hatch(dxfattribs={"layer": "fill"}).paths.add_polyline_path(corners, is_closed=True)
    space.add_mline([(0, 1), (1, 1)], dxfattribs={"layer": "rest"})
    path = tmp_path / "filled.dxf"
    made.saveas(path)
    with pytest.warns(PlausibilityWarning) as said:
        found = formats.read_dxf(path)
    assert found.layers == ["line", "face", "fill"]
    assert [o[:, 1].min() for o in found.outlines] == pytest.approx([0.0, 0.2, 0.4])
    texts = [str(w.message) for w in said]
    assert any("1 MLINE cannot be read and is left out" in t for t in texts)
    assert any("layer 'fill': 1 hatches are taken as blocks" in t for t in texts)


def test_a_hatch_with_an_island_is_told_and_left_out(tmp_path):
    made = ezdxf.new()
    made.header["$INSUNITS"] = 6
    space = made.modelspace()
    space.add_lwpolyline([(5, 0), (6, 0), (6, 1), (5, 1)], close=True)
    mortar = space.add_hatch(dxfattribs={"layer": "mortar"})
    mortar.paths.add_polyline_path([(0, 0), (1, 0), (1, 1), (0, 1)], is_closed=True)
    mortar.paths.add_polyline_path([(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)], is_closed=True, flags=0)
    made.saveas(tmp_path / "island.dxf")
    with pytest.warns(PlausibilityWarning, match="1 hatches are left out: they have islands"):
        found = formats.read_dxf(tmp_path / "island.dxf")
    assert found.names == ["0-1"]
