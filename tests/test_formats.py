"""Files: what is written comes back to the last bit, and what is wrong with a file is named."""

import base64
import json
import math
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import fields, replace

import numpy as np
import pytest

from limitmason import Assembly, Joint, Loads, Support, formats
from limitmason.results import Certificate, Mechanism, Prediction, Resultants

JOINT = Joint(33.0)
GROUND = [[-1, -0.2], [3, -0.2], [3, 0], [-1, 0]]
PIER = [[0, 0], [1, 0], [1, 2], [0, 2]]
LIP = [[1, 0], [2, 0], [2, 1], [1.5, 1], [1.5, 2], [1, 2]]
SIMPLE = {
    "schema": "limitmason-model",
    "version": 1,
    "outlines": [GROUND, PIER, LIP],
    "names": ["ground", "pier", "lip"],
    "thickness": 0.5,
    "density": 1800,
    "joint": {"friction_angle_deg": 33},
    "fixed": ["ground"],
    "loads": {"horizontal": [1, 0, 0]},
}


def make_assembly(**options):
    outlines = [np.array(o, dtype=float) for o in (GROUND, PIER, LIP)]
    return Assembly.from_polygons(
        outlines, thickness=0.5, density=[2400.0, 1 / 3e-3, 0.1 + 0.2], joint=JOINT, fixed=["ground"],
        names=["ground", "pier", "lip"], recipe={"unit": (0.4, math.pi), "limit": math.inf, "n": np.int64(3)},
        **options,
    )  # fmt: skip


def turned(assembly, angle=0.3):
    c, s = math.cos(angle), math.sin(angle)
    return assembly.transformed([[c, -s, 0], [s, c, 0], [0, 0, 1]], (1 / 3, 0.1, 0.7))


def same(a, b):
    """Two assemblies agree in every number."""
    assert [x.name for x in a.blocks] == [x.name for x in b.blocks]
    for x, y in zip(a.blocks, b.blocks, strict=True):
        assert x.density == y.density
        assert (x.axis is None) == (y.axis is None)
        assert x.axis is None or np.array_equal(x.axis, y.axis)
        assert len(x.parts) == len(y.parts)
        for p, q in zip(x.parts, y.parts, strict=True):
            assert np.array_equal(p.vertices, q.vertices)
            assert p.faces == q.faces
    assert len(a.interfaces) == len(b.interfaces)
    for x, y in zip(a.interfaces, b.interfaces, strict=True):
        assert (x.block_a, x.block_b, x.kind, x.joint) == (y.block_a, y.block_b, y.kind, y.joint)
        assert np.array_equal(x.polygon, y.polygon)
        assert np.array_equal(x.normal, y.normal)
    assert np.array_equal(a.held, b.held)
    assert a.tolerance == b.tolerance


def write(path, document):
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


# ---- native JSON ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["as built", "turned", "ends pulled in", "renumbered", "many laws", "held in part"])
def test_native_file_returns_every_number_unchanged(tmp_path, variant):
    head = Joint(20.0, dilatancy_angle_deg=1 / 3, cohesion=0.1, tensile_strength=0.3, compressive_strength=3e6,
                 normal_stiffness=1e9, residual_cohesion=0.0, name="mortar")  # fmt: skip
    assembly = make_assembly()
    if variant == "turned":
        assembly = turned(assembly)
    elif variant == "ends pulled in":
        assembly = assembly.with_contact_ends_pulled_in(0.013)
    elif variant == "renumbered":
        assembly = assembly.renumbered([2, 0, 1])
    elif variant == "many laws":
        assembly = make_assembly(joints={"head": head, ("ground", "pier"): replace(head, cohesion=0.2)})
        assert len({i.joint for i in assembly.interfaces}) == 3
    elif variant == "held in part":
        assembly = assembly.with_supports([Support("pier", translations=True, dofs=("rx",))])
    loads = Loads.horizontal(assembly, (1, 0.3, 0)).with_point_load(assembly, "pier", (1, 2, 1 / 3), at=(0.1, 0, 1))
    path = tmp_path / "model.json"
    formats.write_json(path, assembly, loads)
    back = formats.read_json(path)
    same(assembly, back.assembly)
    assert np.array_equal(loads.dead, back.loads.dead)
    assert np.array_equal(loads.live, back.loads.live)
    assert loads.name == back.loads.name


def test_recipe_comes_back_as_plain_data(tmp_path):
    formats.write(tmp_path / "m.json", make_assembly())
    back = formats.read(tmp_path / "m.json").assembly
    assert back.recipe == {"unit": [0.4, math.pi], "limit": math.inf, "n": 3}
    strange = replace(make_assembly(), recipe={"wall": {"bond": object()}})
    with pytest.raises(ValueError, match=r"recipe\.wall\.bond.*object"):
        formats.write_json(tmp_path / "m.json", strange)


def test_native_file_is_standard_json_with_units_and_no_class_paths(tmp_path):
    path = tmp_path / "m.json"
    formats.write_json(path, make_assembly(), Loads.horizontal(make_assembly()))

    def refuse(constant):
        raise AssertionError(constant)

    document = json.loads(path.read_text(), parse_constant=refuse)
    assert (document["schema"], document["version"]) == ("limitmason-model", 1)
    assert document["units"]["length"] == "m"
    assert "limitmason." not in path.read_text()
    assert "numpy" not in path.read_text()
    # contacts that detection finds again need no polygon in the file
    assert all("polygon" not in i for i in document["interfaces"])


def test_simple_form_equals_the_same_call(tmp_path):
    model = formats.read_json(write(tmp_path / "m.json", SIMPLE))
    outlines = [np.array(o, dtype=float) for o in (GROUND, PIER, LIP)]
    direct = Assembly.from_polygons(outlines, thickness=0.5, density=1800, joint=JOINT, fixed=[0],
                                    names=["ground", "pier", "lip"])  # fmt: skip
    same(direct, model.assembly)
    assert np.array_equal(model.loads.live, Loads.horizontal(direct).live)
    assert {i.kind for i in direct.interfaces} == {"base", "head"}


def test_simple_form_takes_tables_of_joints_and_other_loads(tmp_path):
    document = SIMPLE | {
        "_note": "typed by hand",
        "joints": {"head": {"friction_coefficient": 0.5}},
        "joints_between": [{"blocks": ["ground", "lip"], "joint": {"friction_angle_deg": 10, "cohesion": 7.5}}],
        "supports": [{"block": "lip", "dofs": ["rz"]}],
        "loads": {"tilting": [0, 1, 0], "name": "table", "precompression": {"force": 1e3, "block": "pier"},
                  "point_loads": [{"block": "pier", "force": [5, 0, 0]}],
                  "pressures": [{"block": "lip", "pressure": 10.0, "face": "+x"}]},
    }  # fmt: skip
    assembly, loads = formats.read_json(write(tmp_path / "m.json", document))
    laws = {(i.block_a, i.block_b): i.joint for i in assembly.interfaces}
    assert laws[0, 1] == JOINT
    assert laws[1, 2].tan_phi == pytest.approx(0.5)
    assert laws[0, 2].cohesion == 7.5
    assert assembly.held[2].tolist() == [False] * 5 + [True]
    expected = Loads.tilting(assembly).with_point_load(assembly, "pier", (5, 0, 0))
    expected = expected.with_pressure(assembly, "lip", pressure=10.0, face="+x").with_precompression(
        assembly, 1e3, block="pier"
    )
    assert np.allclose(loads.live, expected.live)
    assert np.allclose(loads.dead, expected.dead)
    assert loads.name == "table"


def test_blocks_can_be_typed_as_vertices_and_faces(tmp_path):
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]

    def cube(z):
        return [[x, y, z + h] for h in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]

    document = {
        "schema": "limitmason-model", "version": 1, "density": [1000, 3000], "joint": {"friction_angle_deg": 30},
        "fixed": [0], "blocks": [{"vertices": cube(0), "faces": faces}, {"name": "top", "vertices": cube(1),
                                                                         "faces": faces}],
    }  # fmt: skip
    assembly, loads = formats.read_json(write(tmp_path / "m.json", document))
    assert [b.name for b in assembly.blocks] == ["block-0", "top"]
    assert assembly.blocks[1].mass == pytest.approx(3000)
    assert len(assembly.interfaces) == 1
    assert not loads.live.any()


BAD = {
    "not JSON": ('{"schema": "limitmason-model",\n "version": 1,,}', "line 2, column 15"),
    "key twice": ('{"schema": "limitmason-model", "version": 1, "version": 1}', "'version' is given twice"),
    "a list": ("[1, 2]", "expected an object"),
    "no schema": ({"outlines": []}, '"schema" is missing'),
    "other schema": (SIMPLE | {"schema": "ifc"}, "schema: expected 'limitmason-model', got 'ifc'"),
    "newer": (SIMPLE | {"version": 2}, "version 2.*update"),
    "version as text": (SIMPLE | {"version": "1"}, "version: expected a whole number"),
    "misspelt key": (SIMPLE | {"thicknes": 0.5}, "unknown key 'thicknes'; did you mean 'thickness'"),
    "no thickness": ({k: v for k, v in SIMPLE.items() if k != "thickness"}, "'thickness' is missing"),
    "text for a number": (SIMPLE | {"thickness": "half"}, 'thickness: expected a number, got "half"'),
    "an outline too few": (SIMPLE | {"outlines": [GROUND, PIER]}, r"names: 3 entries for 2 outlines"),
    "three numbers": (SIMPLE | {"outlines": [GROUND, PIER, [[0, 0, 0]]]}, r"outlines\[2\]\[0\]: expected 2 numbers"),
    "names do not fit": (SIMPLE | {"names": ["a", "b"]}, "names: 2 entries for 3 outlines"),
    "other unit": (SIMPLE | {"units": {"length": "mm"}}, "units.length: only 'm'"),
    "friction too large": (SIMPLE | {"joint": {"friction_angle_deg": 95}}, "joint: .*friction_angle_deg = 95"),
    "no friction": (SIMPLE | {"joint": {"cohesion": 1.0}}, "joint: give exactly one of 'friction_angle_deg'"),
    "misspelt law": (SIMPLE | {"joint": {"friction_angle": 30}}, "did you mean 'friction_angle_deg'"),
    "unknown block fixed": (SIMPLE | {"fixed": ["grund"]}, "no block named 'grund'"),
    "nothing to tilt about": (SIMPLE | {"loads": {"tilting": [0, 0, 1]}}, "not horizontal"),
    "two loads": (SIMPLE | {"loads": {"tilting": [0, 1, 0], "horizontal": [1, 0, 0]}}, "exclude each other"),
    "NaN corner": (json.dumps(SIMPLE).replace("[0, 2]", "[0, NaN]", 1), "block 'pier'.*not finite"),
    "negative density": (SIMPLE | {"density": -1}, "density must be finite and not negative"),
    "joint and interfaces": (SIMPLE | {"interfaces": []}, "exactly one of 'joint' and 'interfaces'"),
    "support of nothing": (SIMPLE | {"supports": [{"block": "pier", "dofs": ["w"]}]}, r"supports\[0\].*freedom 'w'"),
}


@pytest.mark.parametrize("case", BAD)
def test_malformed_model_is_named_with_its_file(tmp_path, case):
    document, message = BAD[case]
    path = write(tmp_path / "bad.json", document)
    with pytest.raises(ValueError, match=message) as caught:
        formats.read_json(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert str(caught.value).count(str(path)) == 1


def test_edited_geometry_that_loses_a_contact_names_the_pair(tmp_path):
    path = tmp_path / "m.json"
    formats.write_json(path, make_assembly())
    document = json.loads(path.read_text())
    for part in document["blocks"][1]["parts"]:
        part["vertices"] = [[x - 0.1, y, z] for x, y, z in part["vertices"]]
    with pytest.raises(ValueError, match=r"interfaces: blocks 'pier' and 'lip' have 1 interface.*0 found"):
        formats.read_json(write(path, document))


def test_unknown_law_and_block_of_an_interface_are_named(tmp_path):
    path = tmp_path / "m.json"
    formats.write_json(path, make_assembly())
    document = json.loads(path.read_text())
    changed = json.loads(path.read_text())
    document["interfaces"][1]["law"] = "glue"
    with pytest.raises(ValueError, match=r"interfaces\[1\]\.law: there is no law 'glue'"):
        formats.read_json(write(path, document))
    changed["interfaces"][0]["blocks"] = ["ground", "peer"]
    with pytest.raises(ValueError, match=r"interfaces\[0\]\.blocks: there is no block named 'peer'"):
        formats.read_json(write(path, changed))


def test_loads_of_another_assembly_are_refused(tmp_path):
    small = Assembly.from_polygons([np.array(GROUND), np.array(PIER)], thickness=1.0, joint=JOINT, fixed=[0])
    with pytest.raises(ValueError, match="loads are for 2 blocks, the assembly has 3"):
        formats.write_json(tmp_path / "m.json", make_assembly(), Loads.horizontal(small))


def test_missing_file_and_unknown_suffix(tmp_path):
    with pytest.raises(FileNotFoundError):
        formats.read_json(tmp_path / "none.json")
    with pytest.raises(ValueError, match=r"cannot read \.step; known: \.json, \.obj, \.dxf"):
        formats.read(tmp_path / "a.step")
    with pytest.raises(ValueError, match=r"cannot write \.dxf"):
        formats.write(tmp_path / "a.dxf", make_assembly())
    with pytest.raises(ValueError, match="use write_prediction"):
        formats.write(tmp_path / "a.json", make_assembly(), prediction=make_prediction(make_assembly()))


# ---- predictions ------------------------------------------------------------------------------------------------


def make_prediction(assembly, multiplier=1 / 3):
    """A rocking pier: its twist about the toe, and one force on its base."""
    twists = np.zeros((assembly.n_blocks, 6))
    toe, omega = np.array([1.0, 0.25, 0.0]), np.array([0.0, 1.0, 0.0])
    twists[1] = [*np.cross(omega, assembly.centroids[1] - toe), *omega]
    x = assembly.arrays
    k = len(assembly.interfaces)
    base = next(n for n, i in enumerate(assembly.interfaces) if i.block_b == 1)
    normal, shear = np.zeros(k), np.zeros((k, 2))
    normal[base], shear[base] = 1000.0, (30.0, -40.0)
    force = normal[base] * x.normal[base] + shear[base, 0] * x.tangent_1[base] + shear[base, 1] * x.tangent_2[base]
    resultants = Resultants(normal, shear, np.zeros((k, 2)), np.zeros(k), toe[None], np.array([base]),
                            np.array([0.5]), force[None])  # fmt: skip
    return Prediction(
        "synthetic, associative", multiplier, "exact", "solved", Mechanism(twists, np.array([0.1]), np.zeros((1, 2))),
        resultants, Certificate(1e-9, 1 / 3), ("a warning",), {"numpy": np.__version__, "size": np.float64(0.1)},
        {"trace": np.array([0.1, math.nan])},
    )  # fmt: skip


@pytest.mark.parametrize("multiplier", [1 / 3, math.nan, math.inf])
def test_prediction_comes_back_to_the_last_bit(tmp_path, multiplier):
    assembly = make_assembly()
    prediction = make_prediction(assembly, multiplier)
    path = tmp_path / "p.json"
    formats.write_prediction(path, prediction, assembly=assembly)
    assert json.loads(path.read_text())["blocks"] == ["ground", "pier", "lip"]
    back = formats.read_prediction(path)
    assert np.array_equal(back.collapse_multiplier, multiplier, equal_nan=True)
    assert (back.method, back.bound, back.status, back.warnings) == (
        prediction.method, prediction.bound, prediction.status, prediction.warnings,
    )  # fmt: skip
    for part in ("mechanism", "resultants"):
        for f in fields(getattr(prediction, part)):
            old, new = getattr(getattr(prediction, part), f.name), getattr(getattr(back, part), f.name)
            assert np.array_equal(old, new), f.name
            assert old.dtype == new.dtype
    assert np.array_equal(
        [getattr(prediction.certificate, f.name) for f in fields(Certificate)],
        [getattr(back.certificate, f.name) for f in fields(Certificate)], equal_nan=True,
    )  # fmt: skip
    assert math.isnan(back.details["trace"][1])


def test_prediction_without_mechanism_and_with_odd_details(tmp_path):
    bare = Prediction("m", math.nan, "estimate", "not converged", details={"solver": object})
    formats.write_prediction(tmp_path / "p.json", bare)
    back = formats.read_prediction(tmp_path / "p.json")
    assert back.mechanism is None
    assert back.resultants is None
    assert back.certificate is None
    assert "object" in back.details["solver"]
    document = json.loads((tmp_path / "p.json").read_text()) | {"status": 3}
    with pytest.raises(ValueError, match=r"p\.json: status: expected a text, got 3"):
        formats.read_prediction(write(tmp_path / "p.json", document))


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


def test_obj_scale_and_upward_axis(tmp_path):
    path = write(tmp_path / "a.obj", CUBE.replace("v 0 1 1", "v 0 3 1").replace("v 1 1 1", "v 1 3 1")
                 .replace("v 1 1 0", "v 1 3 0").replace("v 0 1 0", "v 0 3 0"))  # fmt: skip
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


def test_formats_load_no_heavy_or_optional_package():
    heavy = {"matplotlib", "cvxpy", "clarabel", "ezdxf"}
    code = f"import sys, limitmason.formats; print(sorted({heavy} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
