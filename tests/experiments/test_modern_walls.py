"""Walls of modern masonry: inputs with their kinds, rounding of units, rig by its shear span, refusals."""

import numpy as np
import pytest

import limitmason as lm
import mechanisms
from limitmason import experiments
from limitmason.errors import InputError
from limitmason.experiments.modern_walls import MODELS, inputs, units_per_course
from limitmason.experiments.source_folder import read_table

NAME = "modern-walls"
WALLS = {r["specimen"]: r for r in read_table(NAME, "walls.csv").rows}
RESPONSES = {r["specimen"]: r for r in read_table(NAME, "responses.csv").rows}
DRY = {"cohesion_share": 0.0, "tension_share": 0.0, "cracks": "none"}


def test_responses_are_of_the_walls_that_are_given_and_of_no_other():
    assert len(WALLS) == 198
    assert set(RESPONSES) == {k for k, r in WALLS.items() if r["responses"] == "given"}
    assert sum(r["responses"] == "kept back" for r in WALLS.values()) == 52
    kept = experiments.load(NAME, "27")
    assert not kept.measured
    assert not kept.targets
    assert kept.parameters["failure type"] == "kept back"


def test_walls_with_all_inputs_are_73_of_which_53_have_responses():
    whole = [k for k, r in WALLS.items() if inputs.complete(r)]
    assert len(whole) == 73
    assert len(set(whole) & set(RESPONSES)) == 53
    assert len({WALLS[k]["campaign"] for k in set(whole) & set(RESPONSES)}) == 10


def test_large_series_stands_in_no_table_of_all_cases():
    assert NAME in experiments.sources()
    assert NAME not in {c.source.name for c in experiments.all_cases()}
    assert len(experiments.specimens(NAME)) == 198


@pytest.mark.parametrize(
    ("wall", "name", "kind", "value"),
    [
        ("22", "mu", "tested", 0.81), ("22", "ft", "assumed", 0.05 * 7.92), ("1", "fv0", "of a code", 0.5),
        ("1", "fc", "of a code", 19.39744268), ("1", "mu", "assumed", 0.45), ("124", "fv0", "tested", 0.44),
        ("69", "sigma0", "tested", 1.0),
    ],
)
def test_kind_of_an_input_is_inferred_from_its_value(wall, name, kind, value):
    found = inputs.inputs_of(WALLS[wall])[name]
    assert found.kind == kind
    assert found.value == pytest.approx(value)


def test_code_strength_is_the_formula_that_computed_it():
    # EN 1996-1-1, thin layer mortar, calcium silicate: 1.2 times 0.8 fb^0.85
    row = WALLS["1"]
    assert float(row["fc"]) == pytest.approx(1.2 * 0.8 * float(row["fb_norm"]) ** 0.85, rel=1e-6)


def test_draws_are_lognormal_about_the_median_and_the_same_again():
    drawn = inputs.draws(WALLS["22"], 4000)
    assert drawn[:3] == inputs.draws(WALLS["22"], 4000)[:3]
    for name, i in inputs.inputs_of(WALLS["22"]).items():
        logs = np.log([d[name] for d in drawn])
        assert np.median(logs) == pytest.approx(np.log(i.value), abs=4 * 1.25 * i.spread / np.sqrt(4000))
        assert logs.std() == pytest.approx(i.spread, rel=0.06)


def test_units_that_do_not_fit_are_said():
    assert units_per_course(WALLS["22"])[0] == 6.0
    units, said = units_per_course(WALLS["27"])
    assert units == 18.5
    assert "do not fit" not in said
    units, said = units_per_course(WALLS["114"])  # 1.5 m of units of 625 mm
    assert units == 2.5
    assert units_per_course({"L": "1.0", "lb": "620"})[1].startswith("the units do not fit the wall: 1.61 of them")


def test_wall_without_shear_span_is_refused_by_name_and_a_load_above_fc_too():
    wall = experiments.load(NAME, "97")
    assert not wall.has_model
    with pytest.raises(InputError, match="modern-walls/97 has no assembly: wall 97 has '/' for its shear span"):
        wall.assembly()
    with pytest.raises(InputError, match="for its shear span; give the option shear_span"):
        wall.drive()
    given = wall.with_options(shear_span=1.0)
    assert given.has_model
    assert given.loads().name == f"1000 N at {float(wall.row['H']):g} m"
    with pytest.raises(InputError, match=r"sigma0 = 9 MPa is above fc = 7\.92"):
        experiments.load(NAME, "22", sigma0=9.0).assembly()
    with pytest.raises(InputError, match="no cantilever"):
        experiments.load(NAME, "22").drive()
    with pytest.raises(InputError, match="those of 189, 190"):
        experiments.load(NAME, "22").curve()


@pytest.mark.parametrize("wall", ["118", "119", "120", "124"])  # shear span 0.5, 0.75, 1.5, 1
def test_dry_wall_of_sticking_joints_rocks_about_its_toe_by_statics(wall):
    test = experiments.load(NAME, wall, mu=20.0, **DRY)
    row = test.row
    height, span = float(row["H"]), float(row["L"])
    force = 1e3 * float(row["sigma0"]) * span * float(row["t"])
    ratio = float(row["H0_over_H"])
    weight = 1e-3 * 9.80665 * 1000.0 * span * height * float(row["t"])
    fc = 1e3 * float(row["fc"]) * float(row["t"])

    def about_toe(n, arm):
        return (0.5 * n * span - 0.5 * n * n / fc) / arm

    # about the foot, or, where zero moment lies below the middle, about the top
    foot, top = about_toe(force + weight, ratio * height), about_toe(force, abs(1.0 - ratio) * height or 1e-9)
    found = lm.limit_analysis(test.assembly(), test.loads()).collapse_multiplier
    assert found == pytest.approx(min(foot, top), rel=2e-3)


def test_first_model_has_its_bond_over_the_whole_foot_as_a_plastic_section_has():
    # N + ft t (L - x) = fc t x over the foot; both stress blocks about the middle
    test = experiments.load(NAME, "112")
    length, height, t, fc, stress, fv0 = (float(test.row[k]) for k in ("L", "H", "t", "fc", "sigma0", "fv0"))
    axial, bond = 1e3 * stress * length * t + 9.80665 * length * height * t, 500.0 * fv0
    x = (axial + bond * t * length) / ((1e3 * fc + bond) * t)
    moment = 1e3 * fc * t * x * (length - x) / 2.0 + bond * t * (length - x) * x / 2.0
    found = lm.limit_analysis(test.assembly(), test.loads(), check_dead_load=False).collapse_multiplier
    assert found == pytest.approx(moment / height, rel=2e-3)


def test_wall_whose_ends_are_held_carries_the_moments_of_both():
    # H V = M top + M foot, wherever the force is drawn; the free beam has the smaller one at both ends
    options = {"mu": 20.0, **DRY}
    test = experiments.load(NAME, "118", rotation="as tested", **options)
    length, height, t, fc, stress = (float(test.row[k]) for k in ("L", "H", "t", "fc", "sigma0"))
    axial = 1e6 * stress * length * t + np.array([0.0, 9.80665 * 1000.0 * length * height * t])
    ends = axial * length / 2.0 * (1.0 - axial / (1e6 * fc * length * t))
    found = lm.limit_analysis(test.assembly(), test.loads(), check_dead_load=False).collapse_multiplier
    assert found == pytest.approx(1e-3 * ends.sum() / height, rel=1e-3)
    assert test.drive().displacement == {"beam": {"x": 1.0}}  # the wall's own support holds the turn
    cantilever = experiments.load(NAME, "124", rotation="as tested")  # nothing to hold there
    assert len(cantilever.assembly().supports) == len(experiments.load(NAME, "124").assembly().supports)


@pytest.mark.slow
@pytest.mark.parametrize("wall", ["7", "52", "189"])
def test_head_joints_are_as_printed(wall):
    test = experiments.load(NAME, wall)
    laws = {i.kind: i.joint for i in test.assembly().interfaces}
    filled = test.row["head_joints"] in ("F", "TF")
    assert (laws["head"].cohesion > 0.0) == filled
    assert laws["bed"].cohesion == pytest.approx(1e6 * inputs.inputs_of(test.row)["fv0"].value)
    dry = experiments.load(NAME, wall, unfilled_friction=0.0, head_friction=0.5).assembly()
    friction = {i.joint.tan_phi for i in dry.interfaces if i.kind == "head"}
    assert list(friction) == [pytest.approx(0.5 * laws["bed"].tan_phi if filled else 0.0)]
    assert {"crack", "bed", "base"} <= set(laws)


def test_envelope_meets_the_largest_force():
    for wall in ("189", "192"):
        test = experiments.load(NAME, wall)
        assert test.curve().peak.load == pytest.approx(float(test.measured["Vmax+"]), rel=0.02)
        assert float(test.curve().displacement[-1]) <= 1.05 * float(test.measured["largest drift+"])


@pytest.mark.parametrize("wall", ["11", "12", "110"])
def test_units_of_a_vertical_section_carry_the_formula_of_diagonal_cracking(wall):
    test = experiments.load(NAME, wall, cracks="diagonal strength", crack_factor=2.0)
    row, i = test.row, inputs.inputs_of(test.row)
    length, height, t = (float(row[k]) for k in ("L", "H", "t"))
    force = mechanisms.wall_forces(
        length, height, t, 0.5 * height, stress=1e6 * i["sigma0"].value, strength=1e6 * i["fc"].value, cohesion=0.0,
        friction=1.0, diagonal_strength=1e6 * i["ft"].value, unit=(0.25, 0.2),
    ).diagonal_cracking
    # half of the height of a vertical section is head joints without strength; shear on it is that of a horizontal one
    cracks = [k for k in test.assembly().interfaces if k.kind == "crack"]
    assert 0.5 * cracks[0].joint.cohesion * length * t == pytest.approx(force)
    assert cracks[0].joint.tensile_strength <= 1e6 * i["ft"].value


def test_joints_that_soften_have_the_moduli_of_the_wall_and_published_energies():
    test = experiments.load(NAME, "189", cracks="diagonal strength", energy_share=1.0)
    modulus, shear = 1e6 * float(test.row["E"]), 1e6 * float(test.row["G"])
    of = {k.kind: k.joint for k in test.assembly().interfaces}
    bed, crack = of["bed"], of["crack"]
    # a course under a stress s shortens by s h / E, and half a unit beside a vertical plane by s l / 2 E
    course, unit = float(test.row["H"]) / int(test.row["courses"]), float(test.row["L"]) / units_per_course(test.row)[0]
    assert bed.normal_stiffness == pytest.approx(modulus / course)
    assert crack.normal_stiffness == pytest.approx(modulus / (0.5 * unit))
    # pure shear s: bed joints give s / (ks h), vertical planes s / (ks l / 2), together s / G
    gives = 1.0 / (bed.shear_stiffness * course) + 1.0 / (crack.shear_stiffness * 0.5 * unit)
    assert gives == pytest.approx(1.0 / shear)
    for joint, (opening, sliding) in ((bed, (0.02e-3, 0.12e-3)), (crack, (0.04e-3, 0.4e-3))):
        least = 1.5 * joint.tensile_strength**2 / (2.0 * joint.normal_stiffness)
        assert joint.fracture_energy_tension == pytest.approx(max(opening * joint.tensile_strength, least))
        least = 1.5 * joint.cohesion**2 / (2.0 * joint.shear_stiffness)
        assert joint.fracture_energy_shear == pytest.approx(max(sliding * joint.cohesion, least))


def test_unknown_law_of_cracks_is_named():
    with pytest.raises(InputError, match="cracks must be"):
        experiments.load(NAME, "11", cracks="all").assembly()


@pytest.mark.slow
def test_extended_model_lies_below_the_first():
    for wall in ("124", "161"):
        first, extended = (
            lm.limit_analysis((t := experiments.load(NAME, wall, **options)).assembly(), t.loads()).collapse_multiplier
            for options in (MODELS["first"], MODELS["extended"])
        )
        assert extended < first


def test_cracks_by_a_diagonal_strength_of_nothing_are_refused_by_name():
    """It was a ZeroDivisionError."""
    test = experiments.load("modern-walls", "189", ft=0.0, cracks="diagonal strength")
    with pytest.raises(InputError, match=r"modern-walls/189: ft of cracks must be positive \[MPa\], got 0"):
        test.assembly()
