"""Model and prediction files: what is written comes back to the last bit, and what is wrong with a file is named."""

import json
import math
from dataclasses import fields, replace

import numpy as np
import pytest
from format_models import GROUND, JOINT, LIP, PIER, SIMPLE, make_assembly, make_prediction, same, turned, write

from limitmason import Assembly, Joint, Loads, Support, formats
from limitmason.answers.acceptance import Certificate
from limitmason.answers.results import Prediction
from limitmason.build import column
from limitmason.errors import InputError

# ---- native JSON ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["as built", "turned", "ends pulled in", "renumbered", "many laws", "held in part"])
def test_native_file_returns_every_number_unchanged(tmp_path, variant):
    head = Joint(20.0, dilatancy_angle_deg=1 / 3, cohesion=0.1, tensile_strength=0.3, compressive_strength=3e6,
                 normal_stiffness=1e9, residual_cohesion=0.0, name="mortar")
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


@pytest.mark.exact
def test_simple_form_equals_the_same_call(tmp_path):
    model = formats.read_json(write(tmp_path / "m.json", SIMPLE))
    outlines = [np.array(o, dtype=float) for o in (GROUND, PIER, LIP)]
    direct = Assembly.from_polygons(outlines, thickness=0.5, density=1800, joint=JOINT, fixed=[0],
                                    names=["ground", "pier", "lip"])
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
    }
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
    }
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
    "misspelt unit": (SIMPLE | {"units": {"lengths": "mm"}}, "units: unknown key 'lengths'; did you mean 'length'"),
    "materials of no block": (
        SIMPLE | {"materials": {"stone": {"young_modulus": 1e9, "poisson_ratio": 0.2, "density": 1500}}},
        "materials: goes with 'blocks'",  # outlines cannot name one
    ),
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
    )
    for part in ("mechanism", "resultants"):
        for f in fields(getattr(prediction, part)):
            old, new = getattr(getattr(prediction, part), f.name), getattr(getattr(back, part), f.name)
            assert np.array_equal(old, new), f.name
            assert old.dtype == new.dtype
    names = [f.name for f in fields(Certificate) if f.name not in ("worst_block", "worst_joint")]
    assert np.array_equal(
        [getattr(prediction.certificate, name) for name in names], [getattr(back.certificate, name) for name in names],
        equal_nan=True,
    )
    assert back.certificate.worst_block == prediction.certificate.worst_block
    assert back.certificate.worst_joint == prediction.certificate.worst_joint
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


def _changed(path, change):
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    return path


@pytest.mark.parametrize("key, value, message", [
    ("point_loads", [{"block": "pier", "force": [1, 0, 0]}], "loads.point_loads: does not go with 'dead'"),
    ("precompression", {"force": 5, "block": "pier"}, "loads.precompression: does not go with 'dead'"),
])
def test_actions_beside_wrenches_are_refused_not_passed_over(tmp_path, key, value, message):
    assembly = make_assembly()
    formats.write_json(tmp_path / "m.json", assembly, Loads.weight(assembly))
    with pytest.raises(ValueError, match=message):
        formats.read_json(_changed(tmp_path / "m.json", lambda d: d["loads"].__setitem__(key, value)))
    with pytest.raises(ValueError, match="loads.live: needs 'dead'"):
        formats.read_json(_changed(tmp_path / "m.json", lambda d: d["loads"].pop("dead")))


def test_a_stored_interface_has_a_shape_that_can_be_one(tmp_path):
    assembly = make_assembly().with_contact_ends_pulled_in(0.013)
    for key, value, message in (
        ("normal", [0, 0], "normal: expected a unit vector"), ("normal", [0, 0, 2], "normal: expected a unit vector"),
        ("polygon", [[0, 0, 0], [1, 0, 0]], "polygon: a polygon needs three corners, got 2"),
        ("polygon", [[0, 0, 0], [1, 0, 0], [2, 0, 0]], "must run counter-clockwise about the normal"),
    ):
        formats.write_json(tmp_path / "m.json", assembly)
        with pytest.raises(ValueError, match=message):
            formats.read_json(_changed(tmp_path / "m.json", lambda d: d["interfaces"][0].__setitem__(key, value)))  # noqa: B023


def test_keys_of_another_form_of_file_are_refused(tmp_path):
    formats.write_json(tmp_path / "m.json", make_assembly())
    for key, value, message in (
        ("thickness", 0.5, "thickness: goes with 'outlines'"), ("names", ["a"], "names: goes with 'outlines'"),
        ("density", [1.0], "density: 1 densities"),
    ):
        def change(document, key=key, value=value):
            document[key] = value
            if key == "density":
                for block in document["blocks"]:
                    block.pop("density")
        formats.write_json(tmp_path / "m.json", make_assembly())
        with pytest.raises(ValueError, match=message):
            formats.read_json(_changed(tmp_path / "m.json", change))


def test_options_that_a_reader_does_not_have_are_refused(tmp_path):
    wall = column(width=0.3, depth=0.3, unit_height=0.2, courses=2, joint=JOINT)
    formats.write(tmp_path / "a.json", wall)
    with pytest.raises(InputError, match="a .json file is not read with 'scale'; it has no options"):
        formats.read(tmp_path / "a.json", scale=2)
    with pytest.raises(InputError, match="'layers'; options: scale, up"):
        formats.read(tmp_path / "a.obj", layers="x")


def test_a_model_that_no_file_may_hold_is_not_written(tmp_path):
    wall = column(width=0.3, depth=0.3, unit_height=0.2, courses=2, joint=JOINT)
    with pytest.raises(InputError, match="block 'column-1' floats"):
        formats.write(tmp_path / "a.json", wall.with_interfaces([]))
    assert not (tmp_path / "a.json").exists()
