"""Warnings about input in another unit: each said once, by name, and none for what is ordinary."""

import warnings

import numpy as np
import pytest
from figure_models import has, make_column, make_prediction, rocking, texts

import limitmason as lm
from limitmason.geometry import box

JOINT = lm.Joint(30.0)
CUBE = box((0, 0, 0), (1, 1, 1))


@pytest.mark.parametrize(
    "law, message",
    [
        ({"friction_angle_deg": 0.6}, r"friction_angle_deg = 0.6 degrees looks like radians \(34.4 degrees\)"),
        ({"friction_angle_deg": 30.0, "cohesion": 0.2}, r"cohesion = 0.2 Pa looks like MPa \(0.2 MPa is 200000 Pa\)"),
        ({"friction_angle_deg": 30.0, "tensile_strength": 0.1}, "tensile_strength = 0.1 Pa looks like MPa"),
        ({"friction_angle_deg": 30.0, "compressive_strength": 5.0}, "compressive_strength = 5 Pa looks like MPa"),
        ({"friction_angle_deg": 30.0, "residual_cohesion": 0.1, "cohesion": 1e5}, "residual_cohesion = 0.1 Pa"),
        ({"friction_angle_deg": 30.0, "normal_stiffness": 8.0}, "normal_stiffness = 8 Pa/m looks like N/mm3"),
    ],
)
def test_joint_in_another_unit(law, message):
    with pytest.warns(lm.PlausibilityWarning, match=message) as said:
        lm.Joint(**law)
    assert len(said) == 1
    assert said[0].filename == __file__  # it points at the user's line


@pytest.mark.parametrize("given, what", [(8.0, "kn"), ((8e9, 8.0), "ks"), ((np.full(3, 8.0), 8e9), "kn")])
def test_a_stiffness_given_to_an_analysis_is_looked_at_as_that_of_a_joint(given, what):
    column = make_column()
    assert len(column.interfaces) == 3
    with pytest.warns(lm.PlausibilityWarning, match=rf"stiffness: {what} = 8 Pa/m looks like N/mm3 \(8 N/mm3") as said:
        lm.modes(column, 1, stiffness=given)
    assert said[0].filename == __file__


@pytest.mark.parametrize("given", [np.full(2, 1e9), (np.full(4, 1e9), 1e9), "a lot", (1e9, None), (1e9, 1e9, 1e9)])
def test_a_stiffness_that_is_none_is_refused_by_name(given):
    with pytest.raises(lm.errors.InputError, match="stiffness must be"):
        lm.modes(make_column(), 1, stiffness=given)


@pytest.mark.parametrize(
    "rod, message",
    [
        ({"area": 3e-4, "yield_stress": 235.0}, r"yield_stress = 235 Pa looks like MPa \(235 MPa is 2.35e\+08 Pa\)"),
        ({"area": 3e-4, "modulus": 2.1e5 / 3, "yield_force": 1e4}, "modulus = 70000 Pa looks like MPa"),
        ({"area": 300.0, "yield_stress": 235e6}, r"area = 300 m2 looks like mm2 \(300 mm2 is 0.0003 m2\)"),
    ],
)
def test_tie_in_another_unit(rod, message):
    with pytest.warns(lm.PlausibilityWarning, match=message) as said:
        lm.Tie("a", (0, 0, 0), "b", (1, 0, 0), **rod)
    assert len(said) == 1


def test_ordinary_input_says_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lm.Joint(0.0)
        lm.Joint.from_friction_coefficient(0.01)
        lm.Tie("a", (0, 0, 0), "b", (1, 0, 0), area=3e-4, yield_stress=235e6, modulus=2.1e11)
        lm.Joint(33.0, cohesion=1e5, tensile_strength=5e4, compressive_strength=5e6, normal_stiffness=1e9)
        assembly = lm.Assembly.from_polyhedra([CUBE], joint=JOINT, density=0.0, fixed=[0])
        lm.Assembly.from_polyhedra([CUBE], joint=JOINT, density=1e-6)
        lm.Loads.weight(assembly).with_point_load(assembly, 0, (0, 0, -1e3), at=(1, 1, 1))
        lm.Loads.weight(assembly).with_pressure(assembly, 0, pressure=1e6)
        lm.build.wall(length=2.0, courses=4, unit=(0.4, 0.2, 0.2), joint=JOINT)


@pytest.mark.parametrize(
    "density, message",
    [
        (22.0, r"22 kg/m3 looks like kN/m3 \(2243 kg/m3\)"),
        (1.8, r"looks like g/cm3 \(1800 kg/m3\)"),
        (22e3, r"22000 kg/m3 or more, which looks like N/m3 \(2243 kg/m3\)"),
    ],
)
def test_density_in_another_unit(density, message):
    with pytest.warns(lm.PlausibilityWarning, match=message):
        lm.Assembly.from_polyhedra([CUBE], joint=JOINT, density=density)


@pytest.mark.parametrize("per_metre", [1000.0, 100.0])
def test_coordinates_in_millimetres_or_centimetres(per_metre):
    brick = per_metre * np.array([[0.0, 0.0], [0.25, 0.0], [0.25, 0.055], [0.0, 0.055]])
    with pytest.warns(lm.PlausibilityWarning, match="are the coordinates in mm or cm"):
        lm.Assembly.from_polygons([brick], thickness=0.12 * per_metre, joint=JOINT)


@pytest.mark.parametrize("strength", ["cohesion", "tensile_strength"])
def test_a_joint_that_grows_stronger_by_failing(strength):
    with pytest.warns(lm.PlausibilityWarning, match=f"residual_{strength} = 1e\\+06 Pa exceeds {strength} = 10000 Pa"):
        lm.Joint(30.0, **{strength: 1e4, f"residual_{strength}": 1e6})


def test_tolerance_too_large_for_the_smallest_block():
    with pytest.warns(lm.PlausibilityWarning, match=r"tolerance of 0.3 m is 30% of the width of block 'block-0'"):
        lm.Assembly.from_polyhedra([CUBE], joint=JOINT, tolerance=0.3)


def test_loads_beside_their_block_and_out_of_range():
    assembly = lm.Assembly.from_polyhedra([CUBE], joint=JOINT, names=["cube"])
    weight = lm.Loads.weight(assembly)
    with pytest.warns(lm.PlausibilityWarning, match=r"block 'cube': it acts at \(0, 0, 500\) m, 499 m outside"):
        weight.with_point_load(assembly, 0, (0, 0, -1.0), at=(0, 0, 500))
    with pytest.warns(lm.PlausibilityWarning, match="pressure on block 'cube': 2e\\+09 Pa is more than 1 GPa"):
        weight.with_pressure(assembly, 0, pressure=2e9)


# ---- what falls under dead load -------------------------------------------------------------------------------------


def test_falling_mechanism_is_drawn_and_its_blocks_named(tmp_path, capsys, monkeypatch):
    from dataclasses import replace

    from limitmason.answers.results import Status
    from limitmason.cli import main, solve_and_draw

    column = make_column(names=["ground", "low", "middle", "top"])
    rocks = rocking(column, [2, 3], (1.0, 0.25, 1.0))
    falls = replace(rocks, status=Status.CANNOT_STAND, collapse_multiplier=float("nan"))
    figure = lm.figures.mechanism(column, falls)
    assert has(figure, "opening")
    said = texts(figure).replace("\n", " ")
    assert "status: cannot stand under dead load" in said
    assert "nan" not in said
    lm.formats.write_json(tmp_path / "m.json", column, lm.Loads.horizontal(column))
    monkeypatch.setattr(solve_and_draw, "predict", lambda *_, **__: falls)
    for command in (["solve", str(tmp_path / "m.json"), "--figure", str(tmp_path / "f.png")],
                    ["figure", "mechanism", str(tmp_path / "m.json"), "-o", str(tmp_path / "g.png")]):
        assert main(command) == 3
        assert "blocks that fall under dead load: middle, top\n" in capsys.readouterr().out
    assert (tmp_path / "f.png").exists()
    assert (tmp_path / "g.png").exists()
    none = make_prediction(column, None, status=Status.CANNOT_STAND)
    monkeypatch.setattr(solve_and_draw, "predict", lambda *_, **__: none)
    assert main(["figure", "mechanism", str(tmp_path / "m.json"), "-o", str(tmp_path / "h.png")]) == 3
    assert not (tmp_path / "h.png").exists()
    assert np.isnan(falls.collapse_multiplier)
