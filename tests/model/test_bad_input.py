"""Each mistake gets an error that names the culprit."""

import numpy as np
import pytest
from walls import running_bond, stack

import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box

JOINT = lm.Joint(30.0)
CUBE = box((0, 0, 0), (1, 1, 1))
GROUND = box((-1, -1, -1), (2, 2, 0))


def assemble(solids, **options):
    return lm.Assembly.from_polyhedra(solids, **{"joint": JOINT, "fixed": [0], **options})


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"friction_angle_deg": 90.0}, "friction_angle_deg"),
        ({"friction_angle_deg": float("nan")}, "friction_angle_deg"),
        ({"friction_angle_deg": "33"}, "friction_angle_deg"),
        ({"friction_angle_deg": 30.0, "dilatancy_angle_deg": 31.0}, "dilatancy_angle_deg"),
        ({"friction_angle_deg": 30.0, "cohesion": -1.0}, "cohesion"),
        ({"friction_angle_deg": 30.0, "tensile_strength": -1.0}, "tensile_strength"),
        ({"friction_angle_deg": 30.0, "compressive_strength": 0.0}, "compressive_strength"),
        ({"friction_angle_deg": 30.0, "cohesion": float("inf")}, "cohesion"),
        ({"friction_angle_deg": 30.0, "normal_stiffness": -5.0}, "normal_stiffness"),
    ],
)
def test_joint(fields, message):
    with pytest.raises(ValueError, match=message):
        lm.Joint(**fields)


def test_joint_error_carries_its_name():
    with pytest.raises(ValueError, match="joint 'mortar'.*dilatancy"):
        lm.Joint(30.0, dilatancy_angle_deg=40.0, name="mortar")


def test_open_solid():
    with pytest.raises(ValueError, match="'block-1' is open"):
        assemble([GROUND, (CUBE.vertices, CUBE.faces[:-1])])


def test_inverted_solid():
    with pytest.raises(ValueError, match="'block-1' is inverted"):
        assemble([GROUND, (CUBE.vertices, [f[::-1] for f in CUBE.faces])])


def test_face_with_unknown_vertex():
    with pytest.raises(ValueError, match="'block-1': face"):
        assemble([GROUND, (CUBE.vertices, [*CUBE.faces[:-1], (3, 0, 4, 99)])])


def test_zero_thickness():
    with pytest.raises(ValueError, match="'thin' has zero thickness"):
        assemble([GROUND, box((0, 0, 0), (1, 1, 0))], names=["ground", "thin"])
    with pytest.raises(ValueError, match="thickness"):
        lm.Assembly.from_polygons([[[0, 0], [1, 0], [1, 1]]], thickness=0.0, joint=JOINT)


def test_faces_of_a_concave_solid_that_cross_each_other():
    v = CUBE.vertices.copy()
    v[6] = (0.9, 0.9, -0.3)  # the dent comes out through the floor
    triangles = [t for f in CUBE.faces for t in ((f[0], f[1], f[2]), (f[0], f[2], f[3]))]
    with pytest.raises(ValueError, match="'block-1' is not convex, and its faces enclose .*cross each other"):
        assemble([GROUND, (v, triangles)])


def test_skew_face():
    v = CUBE.vertices.copy()
    v[6, 2] += 0.2
    with pytest.raises(ValueError, match="'block-1': face .* not plane"):
        assemble([GROUND, (v, CUBE.faces)])


def test_overlapping_blocks():
    with pytest.raises(ValueError, match="'left' and 'right' overlap by 0.1 m"):
        assemble([GROUND, CUBE, box((0.9, 0, 0), (1.9, 1, 1))], names=["ground", "left", "right"])


def test_block_inside_another():
    with pytest.raises(ValueError, match="overlap"):
        assemble([GROUND, CUBE, box((0.3, 0.3, 0.3), (0.6, 0.6, 0.6))])


def test_blocks_that_cross_with_their_edges_only():
    # a thin plate turned by 45 degrees through a corner region: separated by no face of either
    with pytest.raises(ValueError, match="overlap"):
        assemble([GROUND, CUBE, box((-0.5, 0.4, 0.4), (1.5, 0.6, 0.6))])


def test_floating_block():
    with pytest.raises(ValueError, match="'block-2' floats"):
        assemble([GROUND, CUBE, box((0, 0, 1.1), (1, 1, 2))])


def test_nothing_fixed():
    assembly = lm.Assembly.from_polyhedra([GROUND, CUBE], joint=JOINT)
    with pytest.raises(ValueError, match="nothing is fixed"):
        lm.limit_analysis(assembly, lm.Loads.horizontal(assembly))


def test_everything_fixed():
    assembly = assemble([GROUND, CUBE], fixed=[0, 1])
    with pytest.raises(ValueError, match="every block is fixed"):
        lm.limit_analysis(assembly, lm.Loads.horizontal(assembly))


def test_nan_vertex():
    v = CUBE.vertices.copy()
    v[2, 1] = np.nan
    with pytest.raises(ValueError, match="'block-1' has a coordinate that is not finite"):
        assemble([GROUND, (v, CUBE.faces)])


@pytest.mark.parametrize("density", [-1.0, float("nan"), [2000.0, -3.0]])
def test_density(density):
    with pytest.raises(ValueError, match=r"block.*density"):
        assemble([GROUND, CUBE], density=density)


def test_density_of_wrong_length():
    with pytest.raises(ValueError, match="density"):
        assemble([GROUND, CUBE], density=[1.0, 2.0, 3.0])


def test_repeated_name():
    with pytest.raises(ValueError, match="'a' is used more than once"):
        assemble([GROUND, CUBE], names=["a", "a"])


def test_unknown_fixed_block():
    with pytest.raises(ValueError, match="no block named 'grund'"):
        assemble([GROUND, CUBE], names=["ground", "cube"], fixed=["grund"])


@pytest.mark.parametrize("outline, message", [
    ([[0, 0], [1, 1], [1, 0], [0, 1]], "crosses itself"),
    ([[0, 0], [1, 1], [2, 2]], "no area"),
    ([[0, 0], [1, np.nan], [1, 1]], "not finite"),
    ([[0, 0, 0], [1, 0, 0], [1, 1, 0]], "shape"),
])
def test_outline(outline, message):
    with pytest.raises(ValueError, match=f"'stone'.*{message}"):
        lm.Assembly.from_polygons([outline], thickness=1.0, joint=JOINT, names=["stone"])


def test_block_without_faces():
    with pytest.raises(InputError, match="block 'pier'.*faces"):
        assemble([GROUND, (CUBE.vertices, [])], names=["ground", "pier"])


@pytest.mark.parametrize("axis", [(0.0, 0.0, 0.0), (np.nan, 0.0, 1.0), (1.0, 0.0), (1e200, 1e200, 0.0)])
def test_axis_that_is_no_direction(axis):
    with pytest.raises(InputError, match="axis of block 'pier'"):
        assemble([GROUND, CUBE], names=["ground", "pier"], axes=[None, axis])


@pytest.mark.parametrize("size", [1e308, -1e308, 1e31])
def test_load_beyond_all_measure(size):
    wall = assemble([GROUND, CUBE], names=["ground", "pier"])
    with pytest.raises(InputError, match="block 'pier'"):
        lm.Loads.weight(wall).with_point_load(wall, "pier", (size, 0.0, 0.0))
    wrench = np.zeros((2, 6))
    wrench[1, 5] = size
    with pytest.raises(InputError, match="block number 1"):
        lm.Loads(np.zeros((2, 6)), wrench)


def test_zero_live_load():
    assembly = stack([(1, 1)])
    with pytest.raises(ValueError, match="live load is zero"):
        lm.limit_analysis(assembly, lm.Loads.weight(assembly))


def test_loads_of_another_assembly():
    with pytest.raises(ValueError, match="2 blocks, the assembly has 3"):
        lm.limit_analysis(stack([(1, 1)] * 2), lm.Loads.horizontal(stack([(1, 1)])))


def test_load_mistakes():
    assembly = stack([(1, 1)])
    with pytest.raises(ValueError, match="not horizontal"):
        lm.Loads.horizontal(assembly, (1, 0, 1))
    with pytest.raises(ValueError, match="not zero"):
        lm.Loads.horizontal(assembly, (0, 0, 0))
    with pytest.raises(ValueError, match="axis"):
        lm.Loads.tilting(assembly, (0, 0, 1))
    with pytest.raises(ValueError, match="no block named 'lintel'"):
        lm.Loads.weight(assembly).with_point_load(assembly, "lintel", (1, 0, 0))
    with pytest.raises(ValueError, match="case"):
        lm.Loads.weight(assembly).with_point_load(assembly, 1, (1, 0, 0), case="alive")
    with pytest.raises(ValueError, match="no face towards"):
        lm.Loads.weight(assembly).with_pressure(assembly, 1, face=(1, 1, 1), pressure=1.0)
    with pytest.raises(ValueError, match="finite"):
        lm.Loads.weight(assembly).with_point_load(assembly, 1, (np.inf, 0, 0))
    with pytest.raises(ValueError, match="no block named 'beam'"):
        lm.Loads.weight(assembly).with_precompression(assembly, 1e3)


def test_support_mistakes():
    with pytest.raises(ValueError, match="holds nothing"):
        lm.Support("a")
    with pytest.raises(ValueError, match="unknown degree of freedom 'w'"):
        lm.Support("a", dofs=["w"])
    with pytest.raises(ValueError, match="no block named"):
        stack([(1, 1)]).with_supports([lm.Support("column-3", translations=True)])


def test_analysis_mistakes():
    wall = running_bond(2, 2)
    loads = lm.Loads.horizontal(wall)
    with pytest.raises(ValueError, match="flow_rule"):
        lm.limit_analysis(wall, loads, flow_rule="asociative")
    with pytest.raises(ValueError, match="contact_model"):
        lm.limit_analysis(wall, loads, contact_model="corners")
    with pytest.raises(ValueError, match="grid"):
        lm.limit_analysis(wall, loads, contact_model="grid", grid=(1, 3))
    with pytest.raises(ValueError, match="unknown method 'lmit'; available:.*limit"):
        lm.predict(wall, loads, method="lmit")
    with pytest.raises(ValueError, match="symmetric about one plane"):
        lm.limit_analysis(wall, lm.Loads.horizontal(wall, (1, 1, 0)), in_plane=True)
    with pytest.raises(ValueError, match="at least one block"):
        lm.Assembly.from_polyhedra([], joint=JOINT)
    with pytest.raises(ValueError, match="not wider than twice the inset"):
        wall.with_contact_ends_pulled_in(0.2)


def test_overlapping_pieces_of_one_block():
    with pytest.raises(ValueError, match="two pieces of block 'block-1' overlap by 0.5 m"):
        assemble([GROUND, [CUBE, box((0.5, 0, 0), (1.5, 1, 1))]])


@pytest.mark.parametrize(
    "options, message",
    [
        ({"fixed": "block-0"}, "fixed must be a list"),
        ({"fixed": 0}, "fixed must be a list"),
        ({"fixed": [0.5]}, "fixed: 0.5 is neither"),
        ({"joint": None}, "joint must be a limitmason.Joint"),
        ({"density": "heavy"}, "density must be a number"),
        ({"tolerance": float("nan")}, "tolerance must be a finite number"),
    ],
)
def test_arguments_of_the_wrong_kind(options, message):
    with pytest.raises(ValueError, match=message):
        assemble([GROUND, CUBE], **options)


def test_arguments_of_loads_of_the_wrong_kind():
    assembly = stack([(1, 1)])
    weight = lm.Loads.weight(assembly)
    for call, message in (
        (lambda: lm.Loads.horizontal(assembly, "x"), "direction"),
        (lambda: weight.with_pressure(assembly, 1, pressure=1.0, face=(0, 0, 0)), "face"),
        (lambda: weight.with_pressure(assembly, 1, pressure=1.0, face="upper"), "face 'upper'"),
        (lambda: weight.with_pressure(assembly, 1, pressure=float("nan")), "pressure"),
        (lambda: weight.with_pressure(assembly, 1, traction=(1.0, 2.0)), "traction"),
        (lambda: weight.with_point_load(assembly, 1, (1, 0, 0), at=(0, 1)), "at must be"),
        (lambda: weight.with_body_force(assembly, (1, 0)), "direction"),
    ):
        with pytest.raises(ValueError, match=message):
            call()


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"friction_coefficient": 0.6}, "write friction_angle_deg=30.96"),
        ({"friction_angle": 30.0}, "write friction_angle_deg"),
        ({"tension": 1e5}, "no field 'tension': write tensile_strength"),
        ({"compression": 1e6}, "write compressive_strength"),
        ({"kn": 1e9}, "write normal_stiffness"),
        ({"weight": 1.0}, "one of friction_angle_deg, dilatancy_angle_deg"),
    ],
)
def test_a_joint_names_the_field_that_it_has(fields, message):
    with pytest.raises(InputError, match=message):
        lm.Joint(**fields)


def test_an_assembly_comes_before_its_loads():
    assembly = stack([(1, 1)])
    loads = lm.Loads.horizontal(assembly)
    for call in (lm.limit_analysis, lm.predict, lm.pushover, lm.elastic_range, lm.dem.collapse, lm.compare):
        with pytest.raises(InputError, match=r"assembly must be an Assembly; got Loads. Write \w+\(assembly, loads\)"):
            call(loads, assembly)
    with pytest.raises(InputError, match="loads must be Loads.*got int"):
        lm.predict(assembly, loads=3)
    with pytest.raises(TypeError, match="loads"):
        lm.limit_analysis(assembly)
    with pytest.raises(InputError, match="model must be an Assembly; got Prediction"):
        lm.figures.mechanism(lm.limit_analysis(assembly, loads), assembly)


def test_texts_are_no_numbers():
    assembly = stack([(1, 1)])
    for call, message in (
        (lambda: assembly.with_joints(30), "joints must be a limitmason.Joint"),
        (lambda: lm.modes(assembly, count="3"), "count must lie between"),
        (lambda: lm.pushover(assembly, lm.Loads.horizontal(assembly), to="1mm"), "to \\[m\\] must be a finite number"),
        (lambda: lm.build.column(width="1", depth=1, unit_height=1, courses=1, joint=JOINT), "width must be a finite"),
    ):
        with pytest.raises(InputError, match=message):
            call()


@pytest.mark.parametrize("text", [
    "t,a\n# units: ms,g\n0,1\n10,2\n",  # as the tables of this package have them
    "t;a\n# units: ms;g\n0;1,0\n10,0;2,0\n",
    "t,a\nms,g\n0,1\n10,2\n",
    "t / ms,a / g\n0,1\n10,2\n",
    "time ms,acceleration g\n0,1\n10,2\n",
])
def test_units_of_a_ground_motion_are_those_of_its_headings_however_they_are_written(tmp_path, text):
    (tmp_path / "record.csv").write_text(text, encoding="utf-8")
    motion = lm.dem.BaseMotion.from_csv(tmp_path / "record.csv")
    assert np.allclose(motion.acceleration, [9.81, 19.62])
    assert motion.sample_step == pytest.approx(0.01)
    with pytest.raises(InputError, match="the heading says g, not cm/s2"):
        lm.dem.BaseMotion.from_csv(tmp_path / "record.csv", units="cm/s2")


def test_a_ground_motion_is_read_in_its_units(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("a station\nt [s],north,east\n0.00,0.0,0.5\n0.02,0.1,-0.5\n0.04,0.2,0.0\n", encoding="utf-8")
    given = lm.dem.BaseMotion.from_csv(path, units="g", scale=2.0, column=2, direction=(0.0, 1.0, 0.0))
    assert np.allclose(given.acceleration, [9.81, -9.81, 0.0])
    assert (given.sample_step, given.direction) == (0.02, (0.0, 1.0, 0.0))
    three = lm.dem.BaseMotion.from_csv(path, column=(2, 1, 1))
    assert np.allclose(three.acceleration, [(0.5, 0.0, 0.0), (-0.5, 0.1, 0.1), (0.0, 0.2, 0.2)])
    for words, message in (
        ({"column": "north"}, "column must be a whole number above 0, or three of them, got 'north'"),
        ({"column": 7}, "no two lines of time, acceleration in column 7"),
        ({"column": (1, 2)}, r"or three of them, got \(1, 2\)"),
        ({"column": (1, 2, 2), "direction": (0.0, 1.0, 0.0)}, "three components along x, y and z take no direction"),
    ):
        with pytest.raises(InputError, match=message):
            lm.dem.BaseMotion.from_csv(path, **words)
    path.write_text("t;a\n0,00;0,5\n0,02;-0,5\n", encoding="utf-8")  # a spreadsheet whose decimal sign is the comma
    assert np.allclose(lm.dem.BaseMotion.from_csv(path).acceleration, [0.5, -0.5])
    path.write_text("t,a\ns,g\n0,0\n0.02,1\n", encoding="utf-8")  # a line of units, as in tables of measured numbers
    assert np.allclose(lm.dem.BaseMotion.from_csv(path).acceleration, [0.0, 9.81])
    for heading in ("t,acc_g", "t,a (mg)", "t,a (%g)"):  # read as m/s2 before
        path.write_text(f"{heading}\n0,0\n0.02,1\n", encoding="utf-8")
        with pytest.raises(InputError, match="line 1: .*give units="):
            lm.dem.BaseMotion.from_csv(path)
        assert np.allclose(lm.dem.BaseMotion.from_csv(path, units="g").acceleration, [0.0, 9.81])
    for text, message in (
        ("t,a\n0,\n0.1,2\n0.2,1\n", "line 2: a time, 0, without an acceleration"),
        ("0,1\n0.1,2\n0.2,1\n0.4,1\n", "equally spaced; after 0.2 s"),
        ("0,1\n0.1,two\n", "line 2: no time and acceleration"),
        ("0 1\n1 2\n", "no two lines of time, acceleration"),
        ("t;a\n0;1,000\n0.01;2,000\n", "write numbers with one decimal sign"),
        ("t,a\n0,00,1,5\n0,01,2,5\n", "times must grow"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=message):
            lm.dem.BaseMotion.from_csv(path)
    with pytest.raises(InputError, match="units must be one of m/s2"):
        lm.dem.BaseMotion.from_csv(path, units="ft/s2")


ONE = assemble([GROUND, CUBE])
BAD = {
    "axes": (lambda: assemble([GROUND, CUBE], axes=[None]), "1 axes are given for 2 blocks"),
    "axis in words": (lambda: assemble([GROUND, CUBE], axes=[None, "x"]), "axis of block 'block-1' must be three"),
    "solids": (lambda: assemble(None), "solids must be a list, got None"),
    "names": (lambda: assemble([GROUND, CUBE], names="ab"), "names must be a list"),
    "recipe": (lambda: assemble([GROUND, CUBE], recipe="wall"), "recipe must be a mapping"),
    "joints": (lambda: assemble([GROUND, CUBE], joints=[JOINT]), "joints must be a table"),
    "matrix": (lambda: ONE.transformed(np.ones((2, 3))), "matrix must be a multiple of an orthogonal"),
    "move": (lambda: ONE.transformed(np.eye(3), 1.0), "translation must be three finite numbers, got 1.0"),
    "NaN move": (lambda: ONE.transformed(np.eye(3), (np.nan, 0, 0)), "translation must be three finite numbers"),
    "order": (lambda: ONE.renumbered([0.4, 1.4]), "order must be a whole number"),
    "inset": (lambda: ONE.with_contact_ends_pulled_in("1mm"), r"inset \[m\] must be a finite number"),
    "no way": (lambda: ONE.with_contact_ends_pulled_in(0.01, direction=(0, 0, 0)), "direction must be a direction"),
    "interfaces": (lambda: ONE.with_interfaces([1]), r"interfaces\[0\] must be an Interface"),
    "material of one": (
        lambda: ONE.with_material(lm.Material(1e9, 0.2), blocks="block-1"), r"write blocks=\['block-1'\]"),
    "no block": (lambda: ONE.block_index(True), "one block is needed, by its name or number; got True"),
    "coefficient": (lambda: lm.Joint.from_friction_coefficient("0.6"), "friction coefficient must be a number"),
    "both": (lambda: lm.Joint.from_friction_coefficient(0.6, friction_angle_deg=30.0), "not both"),
    "alpha": (lambda: lm.Material.from_modulus(1e9, modulus_over_strength=0.0), "modulus_over_strength must be"),
    "beam line": (lambda: lm.ring_beam(ONE, [(0, 0, 0), (1, 2)], yield_force=1.0), "point of a ring beam must be"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_argument_is_refused_by_name(case):
    call, message = BAD[case]
    with pytest.raises(InputError, match=message):
        call()
