"""Geometry files (OBJ, DXF, VTU): what is written comes back, and what is wrong with a file is named."""

import base64
import math
import subprocess
import sys
import warnings
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from format_models import JOINT, make_assembly, make_prediction, turned, write

import limitmason as lm
from limitmason import Assembly, PlausibilityWarning, formats

# ---- OBJ --------------------------------------------------------------------------------------------------------

CUBE = """# a cube of six quads
o my cube #1
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
vn 0 0 1
s off
f 1 4 3 2
f 5//1 6//1 7//1 8//1
f 1/1 2/2 6/3 5/4
f -7 -6 -2 -3
f 3 4 \\
  8 7
f 4 1 5 8
"""


def test_obj_cube_of_quads(tmp_path):
    solids, names = formats.read_obj(write(tmp_path / "a.obj", CUBE))
    assert names == ["my cube #1"]
    (piece,) = solids[0]
    assert [len(f) for f in piece.faces] == [4] * 6
    assert piece.faces[3] == (1, 2, 6, 5)
    assembly = Assembly.from_polyhedra(solids, names=names, joint=JOINT, fixed=[0])
    assert assembly.volumes[0] == pytest.approx(1.0)


def test_obj_words_may_stand_apart_by_tabs_and_the_last_line_may_go_on(tmp_path):
    text = CUBE.replace("v ", "v\t").replace("f ", "f\t").replace("s off", "s\toff").rstrip() + " \\\n"
    ((piece,),), names = formats.read_obj(write(tmp_path / "a.obj", text))
    assert names == ["my cube #1"]
    assert [len(f) for f in piece.faces] == [4] * 6


def test_obj_scale_and_upward_axis(tmp_path):
    path = write(tmp_path / "a.obj", CUBE.replace("v 0 1 1", "v 0 3 1").replace("v 1 1 1", "v 1 3 1")
                 .replace("v 1 1 0", "v 1 3 0").replace("v 0 1 0", "v 0 3 0"))
    ((piece,),), names = formats.read_obj(path, scale=0.5, up="y")
    assert np.ptp(piece.vertices, axis=0).tolist() == [0.5, 0.5, 1.5]
    assert Assembly.from_polyhedra([piece], names=names, joint=JOINT, fixed=[0]).volumes[0] == pytest.approx(0.375)


@pytest.mark.parametrize("variant", ["as built", "turned"])
def test_obj_round_trip_keeps_names_pieces_and_every_bit(tmp_path, variant):
    assembly = make_assembly()
    assembly = turned(assembly) if variant == "turned" else assembly
    assert len(assembly.blocks[2].parts) > 1
    path = tmp_path / "a.obj"
    formats.write(path, assembly)
    solids, names = formats.read(path)
    assert names == ["ground", "pier", "lip"]
    for block, parts in zip(assembly.blocks, solids, strict=True):
        assert len(block.parts) == len(parts)
        for p, q in zip(block.parts, parts, strict=True):
            assert np.array_equal(p.vertices, q.vertices)
            assert p.faces == q.faces
    again = tmp_path / "b.obj"
    formats.write_obj(again, formats.Solids(solids, names))
    assert again.read_text() == path.read_text()


def test_obj_groups_are_blocks_when_one_object_holds_several(tmp_path):
    points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    faces = "f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -4 -1 -2\n"
    text = "o wall\ng left\n" + points + faces + "g right\n" + points + faces
    assert formats.read_obj(write(tmp_path / "a.obj", text)).names == ["left", "right"]
    assert formats.read_obj(write(tmp_path / "a.obj", text.replace("o wall\n", ""))).names == ["left", "right"]
    several = "o a\ng default\n" + points + faces + "o b\ng default\n" + points + faces
    assert formats.read_obj(write(tmp_path / "a.obj", several)).names == ["a", "b"]
    assert formats.read_obj(write(tmp_path / "stone.obj", points + faces)).names == ["stone"]


CUBE_FACES = ((1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8))


def cube_text(low, high, first, *, hollow=False):
    (x, y, z), (a, b, c) = low, high
    corners = [(x, y, z), (a, y, z), (a, b, z), (x, b, z), (x, y, c), (a, y, c), (a, b, c), (x, b, c)]
    faces = [f[::-1] if hollow else f for f in CUBE_FACES]
    return "".join(f"v {p} {q} {r}\n" for p, q, r in corners) + "".join(
        "f " + " ".join(str(first + i) for i in f) + "\n" for f in faces
    )


@pytest.mark.parametrize("head", ["", "o pile\n"])
@pytest.mark.parametrize("shift", [0.0, 0.25])
def test_obj_bodies_that_one_object_holds_are_blocks_of_their_own(tmp_path, head, shift):
    path = tmp_path / "pile.obj"
    bricks = [((0, 0, 0), (1, 1, 1)), ((shift, 0, 1), (1 + shift, 1, 2)), ((shift, 0, 2), (1 + shift, 1, 3))]
    path.write_text(head + "".join(cube_text(*b, 8 * k) for k, b in enumerate(bricks)), encoding="utf-8")
    solids, names = formats.read_obj(path)
    assert names == ["pile-1", "pile-2", "pile-3"]
    pile = lm.Assembly.from_polyhedra(solids, names=names, joint=lm.Joint(60.0), fixed=["pile-1"])
    assert [b.volume for b in pile.blocks] == pytest.approx([1.0, 1.0, 1.0])
    assert len(pile.interfaces) == 2
    answer = lm.limit_analysis(pile, lm.Loads.horizontal(pile, (1, 0, 0)))
    # about the edge of the lowest brick: arm of the weight over the height of the centre of two bricks
    assert answer.collapse_multiplier == pytest.approx((0.5 - shift) / 1.0, rel=1e-6)


def test_obj_hollow_stays_in_its_block_and_pieces_stay_one_block(tmp_path):
    path = tmp_path / "hollow.obj"
    box_and_hollow = cube_text((0, 0, 0), (3, 3, 3), 0) + cube_text((1, 1, 1), (2, 2, 2), 8, hollow=True)
    path.write_text("o safe\n" + box_and_hollow + cube_text((3, 0, 0), (4, 1, 1), 16), encoding="utf-8")
    solids, names = formats.read_obj(path)
    assert names == ["safe-1", "safe-2"]
    blocks = lm.Assembly.from_polyhedra(solids, names=names, joint=lm.Joint(30.0), fixed=[0]).blocks
    assert [b.volume for b in blocks] == pytest.approx([26.0, 1.0])
    path.write_text("o stone\ng part-1\n" + cube_text((0, 0, 0), (1, 1, 1), 0) + "g part-2\n"
                    + cube_text((1, 0, 0), (2, 1, 1), 8), encoding="utf-8")
    assert formats.read_obj(path).names == ["stone"]


def test_obj_corners_repeated_per_face_are_joined(tmp_path):
    points = {1: "0 0 0", 2: "1 0 0", 3: "0 1 0", 4: "0 0 1"}
    text = "".join(
        f"v {points[a]}\nv {points[b]}\nv {points[c]}\nf -3 -2 -1\n"
        for a, b, c in ((1, 3, 2), (1, 2, 4), (2, 3, 4), (1, 4, 3))
    )
    solids, _ = formats.read_obj(write(tmp_path / "a.obj", text))
    assert len(solids[0][0].vertices) == 4
    assert Assembly.from_polyhedra(solids, joint=JOINT, fixed=[0]).volumes[0] == pytest.approx(1 / 6)


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("v 1 1 0", "v 1 one 0", "line 5: '1 one 0' is not a vertex"),
        ("v 1 1 0", "v 1 1", "line 5: a vertex needs three coordinates, got 2"),
        ("v 1 1 0", "v 1 nan 0", "line 5: a coordinate is not finite"),
        ("f 4 1 5 8", "f 4 1 5 9", "line 19: vertex 9 does not exist; 8 vertices"),
        ("f 4 1 5 8", "f 4 1 5 0", "line 19: vertex 0 does not exist"),
        ("f -7 -6 -2 -3", "f -9 -6 -2 -3", "line 16: vertex -9 does not exist"),
        ("f 4 1 5 8", "f 4 1", "line 19: a face needs at least three vertices, got 2"),
        ("f 4 1 5 8", "f 4 a 5", "line 19: 'a' is not a vertex of a face"),
        ("s off", "curv2 1 2", "line 12: statement 'curv2' is not read"),
    ],
)
def test_malformed_obj_names_the_line(tmp_path, old, new, message):
    assert old in CUBE
    with pytest.raises(ValueError, match=message) as caught:
        formats.read_obj(write(tmp_path / "bad.obj", CUBE.replace(old, new)))
    assert "bad.obj" in str(caught.value)


def test_obj_without_faces(tmp_path):
    with pytest.raises(ValueError, match="there are no faces"):
        formats.read_obj(write(tmp_path / "a.obj", "v 0 0 0\n"))


# ---- DXF --------------------------------------------------------------------------------------------------------


def make_drawing(path, *, unit=4, open_one=False):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = unit
    space = drawing.modelspace()
    drawing.layers.add("STONE")
    drawing.layers.add("LINTEL")
    space.add_lwpolyline([(0, 0), (400, 0), (400, 200), (0, 200)], close=True, dxfattribs={"layer": "STONE"})
    # closed by repeating the first corner
    space.add_lwpolyline([(400, 0), (800, 0), (800, 200), (400, 200), (400, 0)], dxfattribs={"layer": "STONE"})
    space.add_polyline2d([(0, 200), (800, 200), (800, 300), (0, 300)], close=True, dxfattribs={"layer": "LINTEL"})
    space.add_line((0, 0), (1, 1))
    space.add_text("section A")
    if open_one:
        space.add_lwpolyline([(0, 0), (1, 0), (1, 1)], dxfattribs={"layer": "STONE"})
    drawing.saveas(path)
    return path


def test_dxf_outlines_by_layer_in_metres(tmp_path):
    found = formats.read(make_drawing(tmp_path / "a.dxf"))
    assert found.names == ["STONE-1", "STONE-2", "LINTEL-1"]
    assert found.layers == ["STONE", "STONE", "LINTEL"]
    assert np.allclose(found.outlines[1], [[0.4, 0], [0.8, 0], [0.8, 0.2], [0.4, 0.2]])
    assembly = Assembly.from_polygons(found.outlines, names=found.names, thickness=0.2, joint=JOINT, fixed=[0, 1])
    assert len(assembly.interfaces) == 3
    only = formats.read_dxf(tmp_path / "a.dxf", layers=["lintel"], scale=1.0)
    assert only.names == ["LINTEL-1"]
    assert only.outlines[0].max() == 800.0


@pytest.mark.parametrize("hide", ["off", "freeze"])
def test_hidden_layers_are_no_blocks_unless_they_are_named(hide, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.readfile(make_drawing(tmp_path / "a.dxf"))
    getattr(drawing.layers.get("LINTEL"), hide)()
    drawing.saveas(tmp_path / "a.dxf")
    with pytest.warns(PlausibilityWarning, match="'LINTEL' is off or frozen: 1 entity is left out"):
        assert formats.read_dxf(tmp_path / "a.dxf").layers == ["STONE", "STONE"]
    assert formats.read_dxf(tmp_path / "a.dxf", layers="lintel").names == ["LINTEL-1"]


@pytest.mark.parametrize(("hide", "shown"), [("off", ["STONE"]), ("freeze", [])])
def test_what_is_inserted_on_a_frozen_layer_does_not_show(hide, shown, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = 6
    for name in ("STONE", "OLD"):
        drawing.layers.add(name)
    stone = drawing.blocks.new("STONE OF A WALL")
    stone.add_lwpolyline([(0, 0), (1, 0), (1, 1), (0, 1)], close=True, dxfattribs={"layer": "STONE"})
    drawing.modelspace().add_blockref("STONE OF A WALL", (0, 0), dxfattribs={"layer": "OLD"})
    drawing.modelspace().add_lwpolyline([(5, 0), (6, 0), (6, 1)], close=True, dxfattribs={"layer": "STONE"})
    getattr(drawing.layers.get("OLD"), hide)()
    drawing.saveas(tmp_path / "a.dxf")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert formats.read_dxf(tmp_path / "a.dxf").layers == [*shown, "STONE"]
    assert any("'OLD' is off or frozen" in str(w.message) for w in said) == (hide == "freeze")
    # asked for by its name a layer is read, frozen or not
    assert formats.read_dxf(tmp_path / "a.dxf", layers="stone").layers == ["STONE", "STONE"]


def test_dxf_arcs_become_chords_within_flatness(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = 6
    drawing.modelspace().add_lwpolyline([(-1, 0, 1), (1, 0, 0)], format="xyb", close=True)
    drawing.saveas(tmp_path / "a.dxf")
    (outline,) = formats.read_dxf(tmp_path / "a.dxf", flatness=1e-4).outlines
    assert np.allclose(np.linalg.norm(outline, axis=1), 1.0, atol=1e-12)
    # bulge 1 is a half turn to the left, here below the chord; n chords miss it by 1 - cos(pi / 2n)
    assert outline[:, 1].max() < 1e-9
    n = len(outline) - 1
    assert 1 - math.cos(math.pi / (2 * n)) <= 1e-4 < 1 - math.cos(math.pi / (2 * (n - 1)))


def test_dxf_errors_name_layer_and_entity(tmp_path):
    with pytest.raises(ValueError, match="layer 'STONE', entity .*: the polyline is open"):
        formats.read_dxf(make_drawing(tmp_path / "a.dxf", open_one=True))
    with pytest.raises(ValueError, match=r"INSUNITS = 0\); give scale="):
        formats.read_dxf(make_drawing(tmp_path / "b.dxf", unit=0))
    with pytest.raises(ValueError, match=r"no layer 'brick'; there are .*STONE"):
        formats.read_dxf(make_drawing(tmp_path / "c.dxf"), layers=["brick"])
    with pytest.raises(ValueError, match="not a DXF"):
        formats.read_dxf(write(tmp_path / "d.dxf", "hello"))
    with pytest.raises(FileNotFoundError):
        formats.read_dxf(tmp_path / "none.dxf")


def test_dxf_without_ezdxf_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(ImportError, match=r"pip install 'limitmason\[dxf\]'"):
        formats.read_dxf(tmp_path / "a.dxf")


# ---- VTU --------------------------------------------------------------------------------------------------------


def parse_vtu(path):
    """Arrays of a VTU file, decoded with nothing but the standard library and numpy."""
    root = ElementTree.parse(path).getroot()
    assert root.attrib["type"] == "UnstructuredGrid"
    out = {}
    for array in root.iter("DataArray"):
        kind = {"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}[array.attrib["type"]]
        if array.attrib["format"] == "ascii":
            data = np.array((array.text or "").split(), dtype=kind)
        else:
            raw = base64.b64decode(array.text)
            assert int.from_bytes(raw[:8], "little") == len(raw) - 8
            data = np.frombuffer(raw[8:], dtype=kind)
        width = int(array.attrib.get("NumberOfComponents", 1))
        out[array.attrib["Name"]] = data.reshape(-1, width) if width > 1 else data
    piece = next(root.iter("Piece"))
    return out, int(piece.attrib["NumberOfPoints"]), int(piece.attrib["NumberOfCells"])


@pytest.mark.parametrize("encoding", ["base64", "ascii"])
def test_vtu_blocks_are_polyhedra_that_stay_rigid(tmp_path, encoding):
    assembly = turned(make_assembly())
    prediction = make_prediction(assembly)
    paths = formats.write_vtu(tmp_path / "a.vtu", assembly, prediction, amplitude=0.4, encoding=encoding)
    assert [p.name for p in paths] == ["a.vtu", "a-interfaces.vtu"]
    data, n_points, n_cells = parse_vtu(paths[0])
    pieces = [p for b in assembly.blocks for p in b.parts]
    assert (n_points, n_cells) == (sum(len(p.vertices) for p in pieces), len(pieces))
    assert np.array_equal(data["Points"], np.concatenate([p.vertices for p in pieces]))
    assert data["types"].tolist() == [42] * n_cells
    # the face stream, read as VTK does, gives the faces of every piece
    start = 0
    for cell, piece in enumerate(pieces):
        first = 0 if cell == 0 else data["offsets"][cell - 1]
        stream = data["faces"][start : data["faceoffsets"][cell]].tolist()
        start = data["faceoffsets"][cell]
        count, at, faces = stream[0], 1, []
        for _ in range(count):
            faces.append(tuple(i - first for i in stream[at + 1 : at + 1 + stream[at]]))
            at += 1 + stream[at]
        assert at == len(stream)
        assert tuple(faces) == piece.faces
    assert data["density"].tolist() == [assembly.blocks[b].density for b in data["block"]]
    moved = data["Points"] + data["displacement"]
    # amplitude is that of the rate; the chord of an arc is a little shorter
    assert np.linalg.norm(data["displacement"], axis=1).max() == pytest.approx(0.4, rel=0.05)
    for cell in range(n_cells):
        rows = slice(0 if cell == 0 else data["offsets"][cell - 1], data["offsets"][cell])
        before, after = data["Points"][rows], moved[rows]
        distance = np.linalg.norm(before[:, None] - before[None], axis=2)
        assert np.allclose(np.linalg.norm(after[:, None] - after[None], axis=2), distance, atol=1e-12)
    twist = prediction.mechanism.twists[1]
    pier = np.flatnonzero(data["block"] == 1)[0]
    rows = slice(data["offsets"][pier - 1], data["offsets"][pier])
    expected = twist[:3] + np.cross(twist[3:], data["Points"][rows] - assembly.centroids[1])
    assert np.allclose(data["rate"][rows], expected)


def test_vtu_rocking_block_keeps_its_toe(tmp_path):
    assembly = make_assembly()
    paths = formats.write_vtu(tmp_path / "a.vtu", assembly, make_prediction(assembly), amplitude=0.5)
    data, _, _ = parse_vtu(paths[0])
    toe = np.flatnonzero(np.abs(data["Points"] - [1.0, 0.0, 0.0]).max(axis=1) < 1e-12)
    pier = [i for i in toe if np.searchsorted(data["offsets"], i, side="right") == 1]
    assert len(pier) == 1
    assert np.allclose(data["displacement"][pier], 0.0, atol=1e-12)


def test_vtu_interfaces_carry_resultants_and_rates(tmp_path):
    assembly = make_assembly()
    prediction = make_prediction(assembly)
    data, _, n_cells = parse_vtu(formats.write_vtu(tmp_path / "a.vtu", assembly, prediction)[1])
    assert n_cells == len(assembly.interfaces)
    assert data["types"].tolist() == [7] * n_cells
    base = int(np.flatnonzero(data["N"])[0])
    assert data["N"][base] == 1000.0
    force = prediction.resultants.point_force[0]
    assert np.allclose(data["N"][base] * assembly.interfaces[base].normal + data["V"][base], force)
    # the pier, 1 m wide, turns with 1 rad/s about its toe: its heel rises with 1 m/s
    assert data["opening"][base] == pytest.approx(1.0)
    assert data["area"][base] == pytest.approx(0.5)
    assert sorted(data["kind"].tolist()) == [1, 2, 2]


def test_vtu_of_an_assembly_alone_and_unknown_encoding(tmp_path):
    data, _, _ = parse_vtu(formats.write_vtu(tmp_path / "a.vtu", make_assembly())[0])
    assert "displacement" not in data
    with pytest.raises(ValueError, match="encoding must be one of"):
        formats.write_vtu(tmp_path / "a.vtu", make_assembly(), encoding="zip")


@pytest.mark.parametrize("encoding", ["base64", "ascii"])
def test_vtu_is_read_by_vtk(tmp_path, encoding):
    pyvista = pytest.importorskip("pyvista")
    assembly = make_assembly()
    paths = formats.write_vtu(tmp_path / "a.vtu", assembly, make_prediction(assembly), encoding=encoding)
    blocks, interfaces = pyvista.read(paths[0]), pyvista.read(paths[1])
    volume = blocks.compute_cell_sizes()["Volume"]
    assert np.bincount(blocks["block"], np.abs(volume)) == pytest.approx(assembly.volumes)
    assert interfaces.compute_cell_sizes()["Area"] == pytest.approx(assembly.arrays.area)
    assert "\n".join(blocks.field_data["block_name"]).split() == ["ground", "pier", "lip"]


@pytest.mark.slow
def test_formats_load_no_heavy_or_optional_package():
    heavy = {"matplotlib", "cvxpy", "clarabel", "ezdxf"}
    code = f"import sys, limitmason.formats; print(sorted({heavy} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
