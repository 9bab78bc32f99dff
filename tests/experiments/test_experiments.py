"""Packaged experiments: the assemblies are those of the sources, and the predictions meet the published values."""

import copy
import doctest
import json
import math
import pickle
import re

import numpy as np
import pytest

from limitmason import comparison, experiments
from limitmason.comparison import specimen
from limitmason.errors import InputError, NotConverged
from limitmason.experiments import Quantity, experiment, registry
from limitmason.limit import limit_analysis
from limitmason.methods import predict
from limitmason.model.assembly import Assembly

FERRIS, MINHO, WALLETTE = "ferris-tin-loi-2001", "minho-dry-stone-2005-2009", "rondelet-wallette"
BENDING, MURANO = "mcmaster-bending", "murano-u-walls"
WALLS = experiments.specimens(FERRIS)
TESTS = experiments.specimens(MINHO)
MODELLED = experiments.all_cases(with_model=True)
ids = {"ids": lambda case: case.name}


def active_contacts(assembly: Assembly) -> int:
    return sum(not (assembly.fixed[i.block_a] and assembly.fixed[i.block_b]) for i in assembly.interfaces)


def predicted(test: experiments.Experiment, **arguments) -> float:
    rows = comparison.run(test, kinds=experiment.KINDS, **arguments)
    return next(r.predicted for r in rows if r.prediction is not None)


# ---- looking up -----------------------------------------------------------------------------------------------------


def test_contract_example():
    test = experiments.load(FERRIS, "wall-3")
    assert test.published["associative"] == 0.404
    assert test.published["non-associative"] == 0.356
    assert test.published["rounded LMGC90"] == 0.321
    assert test.published["rounded UDEC"] == 0.325
    assert test.measured == {}
    assert test.assembly().n_blocks == test.loads().dead.shape[0]


def test_unknown_source_specimen_and_option_name_the_culprit_and_what_there_is():
    with pytest.raises(ValueError, match=r"unknown experiment source 'ferris'.*ferris-tin-loi-2001"):
        experiments.load("ferris", "wall-1")
    with pytest.raises(ValueError, match=r"no specimen 'wall-7'.*wall-6"):
        experiments.load(FERRIS, "wall-7")
    with pytest.raises(ValueError, match=r"no option 'mu'.*friction"):
        experiments.load(FERRIS, "wall-1", mu=0.5)
    with pytest.raises(ValueError, match="known: bnw-walls, .*ferris"):
        experiments.specimens("nothing")


def test_all_cases_covers_every_specimen_of_every_source_once():
    names = [c.name for c in experiments.all_cases()]
    assert len(names) == len(set(names)) == sum(len(experiments.specimens(s)) for s in registry.tabled())
    assert {c.source.name for c in MODELLED} <= set(registry.tabled())


def test_quantity_is_its_number_with_a_unit_frozen_and_copied_whole():
    force = Quantity(38.0, "kN", "peak")
    assert force == 38.0
    assert 2 * force == 76.0
    assert (str(force), repr(force)) == ("38 kN", "Quantity(38.0, 'kN')")
    for twin in (pickle.loads(pickle.dumps(force)), copy.deepcopy(force)):
        assert (twin, twin.unit, twin.note) == (38.0, "kN", "peak")
    with pytest.raises(AttributeError, match="frozen"):
        force.unit = "N"


@pytest.mark.parametrize("case", experiments.all_cases(), **ids)
def test_data_sheet_shows_source_licence_values_with_units_and_assumptions(case):
    sheet = str(case)
    for needle in (case.name, case.source.citation, case.source.licence, *case.assumptions, *case.source.caveats):
        assert needle in sheet
    for table in (case.parameters, case.measured, case.published, case.recomputed):
        for name, value in table.items():
            assert any(line.startswith(f"  {name}") and str(value) in line for line in sheet.splitlines()), name
    assert all("assum" in sentence for sentence in case.assumptions)


@pytest.mark.parametrize("case", experiments.all_cases(), **ids)
def test_targets_point_to_values_in_the_unit_of_the_prediction(case):
    # a source that shows its values only in a figure has none to compare with
    assert case.targets or not (case.measured or case.published or case.recomputed)
    for target in case.targets:
        assert case.value(target).unit == case.multiplier_to_measured.unit
        assert set(target.options) <= set(case.option_table)
    assert all(isinstance(v, (Quantity, str)) for v in case.parameters.values())
    assert set(case.options) == set(case.option_table)


@pytest.mark.parametrize("case", MODELLED, **ids)
def test_assembly_is_reproducible_and_its_recipe_is_plain_data(case):
    assembly = case.assembly()
    recipe = json.loads(json.dumps(dict(assembly.recipe)))
    assert (recipe["source"], recipe["specimen"]) == (case.source.name, case.specimen)
    again = experiments.load(recipe["source"], recipe["specimen"], **recipe["options"]).assembly()
    assert np.array_equal(again.centroids, assembly.centroids)
    assert len(again.interfaces) == len(assembly.interfaces)


def test_doctests_of_the_package():
    for module in (experiments, registry):
        result = doctest.testmod(module)
        assert result.attempted > 0
        assert result.failed == 0


# ---- Ferris and Tin-Loi 2001 ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("wall", WALLS)
def test_ferris_tin_loi_2001_block_and_contact_counts(wall):
    test = experiments.load(FERRIS, wall)
    assembly = test.assembly()
    assert (~assembly.fixed).sum() == test.parameters["blocks"]
    assert active_contacts(assembly) == test.parameters["contacts"]
    volumes = assembly.volumes[~assembly.fixed]
    half = np.isclose(volumes, volumes.max() / 2)
    assert half.sum() == test.parameters["half blocks"]
    assert (half | np.isclose(volumes, 0.4 * 0.175 * 0.175)).all()


@pytest.mark.parametrize("wall", WALLS)
def test_ferris_tin_loi_2001_every_bottom_block_has_one_base_contact(wall):
    assembly = experiments.load(FERRIS, wall).assembly()
    ground = int(np.flatnonzero(assembly.fixed)[0])
    base = [i for i in assembly.interfaces if ground in (i.block_a, i.block_b)]
    others = [i.block_b if i.block_a == ground else i.block_a for i in base]
    bottom = [k for k in range(assembly.n_blocks) if k != ground and abs(assembly.blocks[k].bounds[0, 2]) < 1e-12]
    assert sorted(others) == bottom
    assert {i.kind for i in base} == {"base"}


@pytest.mark.parametrize("wall", WALLS)
def test_ferris_tin_loi_2001_associative(wall):
    test = experiments.load(FERRIS, wall)
    (row,) = comparison.run(test, kinds="recomputed")
    assert row.status == "solved"
    assert row.predicted == pytest.approx(float(row.reference), abs=1e-4)
    assert row.predicted == pytest.approx(float(test.published["associative"]), abs=1e-3)


def test_ferris_tin_loi_2001_multiplier_does_not_depend_on_thickness_density_or_sense():
    plain = experiments.load(FERRIS, "wall-4")
    value = predicted(plain, quantities=["associative"])
    other = plain.with_options(thickness=0.4, density=1234.0)
    assert predicted(other, quantities=["associative"]) == pytest.approx(value, abs=1e-7)
    from limitmason.methods import predict

    back = predict(plain.assembly(), plain.loads("-"))
    assert back.collapse_multiplier == pytest.approx(value, abs=1e-7)


def test_rounded_corners_shorten_every_contact_by_40_mm_and_lower_the_multiplier():
    sharp = experiments.load(FERRIS, "wall-1")
    rounded = sharp.with_options(rounding=0.02)
    for a, b in zip(sharp.assembly().interfaces, rounded.assembly().interfaces, strict=True):
        assert a.area / 0.175 - b.area / 0.175 == pytest.approx(0.04, abs=1e-9)
    value = [predicted(t, quantities=["associative"]) for t in (sharp, rounded)]
    assert value[1] < value[0] - 0.01


# ---- University of Minho --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TESTS)
def test_minho_vertical_force_at_the_base_is_that_of_the_database(name):
    test = experiments.load(MINHO, name)
    assembly, loads = test.assembly(), test.loads()
    down = -loads.dead[~assembly.fixed, 2].sum()
    assert down == pytest.approx(float(test.parameters["N total at the base"]) * 1e3, rel=1e-6)
    assert assembly.weights[assembly.block_index("beam")] == 0.0


@pytest.mark.parametrize("name", TESTS)
@pytest.mark.parametrize("direction", ["+", "-"])
def test_minho_live_load_is_1_kn_at_the_force_height(name, direction):
    test = experiments.load(MINHO, name)
    assembly, loads = test.assembly(), test.loads(direction)
    sense = 1.0 if direction == "+" else -1.0
    assert loads.live.sum(axis=0)[0] == pytest.approx(sense * 1e3)
    about_base = loads.live[:, 4] + assembly.centroids[:, 2] * loads.live[:, 0]
    height = float(test.parameters["force height H0"]) / 1e3
    assert about_base.sum() == pytest.approx(sense * 1e3 * height)


def test_minho_sw_layout_is_nine_courses_with_half_blocks_at_both_ends_of_the_odd_ones():
    assembly = experiments.load(MINHO, "SW.30.1").assembly()
    wall = [b for b in assembly.blocks if b.name not in ("base", "beam")]
    levels = sorted({round(float(b.bounds[0, 2]), 9) for b in wall})
    assert levels == pytest.approx([0.1 * k for k in range(9)])
    for k, level in enumerate(levels):
        course = [b for b in wall if abs(b.bounds[0, 2] - level) < 1e-9]
        lengths = [round(float(np.ptp(b.bounds[:, 0])), 9) for b in sorted(course, key=lambda b: b.bounds[0, 0])]
        assert lengths == ([0.1] + [0.2] * 4 + [0.1] if k % 2 == 0 else [0.2] * 5)
        assert all(np.ptp(b.bounds[:, 1]) == pytest.approx(0.2) for b in course)


def test_minho_sw_force_height_by_geometry_is_a_beam_one_course_high():
    test = experiments.load(MINHO, "SW.100.1", force_height=0.95)
    beam = test.assembly().blocks[test.assembly().block_index("beam")]
    assert np.ptp(beam.bounds[:, 2]) == pytest.approx(0.1)
    default = experiments.load(MINHO, "SW.100.1")
    ratio = predicted(test) / predicted(default)
    assert ratio == pytest.approx(1.0 / 0.95, rel=1e-3)


@pytest.mark.parametrize("name", ["SW.30.1", "SW.250.1", "WS.40", "WS2.175"])
def test_minho_prediction_is_bounded_by_overturning_as_one_block_and_reaches_it_with_high_friction(name):
    test = experiments.load(MINHO, name)
    p = test.parameters
    total, length, height = p["N total at the base"], p["length"], p["force height H0"]
    overturning = total * length / 2 / height
    plain, rough = predicted(test), predicted(test.with_options(friction=3.0))
    assert plain < overturning
    assert plain <= test.options["friction"] * p["N on top"] * (1 + 1e-9)
    assert rough == pytest.approx(overturning, rel=1e-6)


def test_minho_slippery_joints_slide_under_the_beam():
    test = experiments.load(MINHO, "SW.100.1", friction=0.2)
    assert predicted(test) == pytest.approx(0.2 * 100.0, rel=1e-6)


def test_minho_more_friction_never_lowers_the_prediction_and_crushing_lowers_it():
    test = experiments.load(MINHO, "WS.250")
    values = [predicted(test.with_options(friction=mu)) for mu in (0.5, 0.65, 0.75)]
    assert values == sorted(values)
    assert predicted(test.with_options(crushing=True)) < values[1]


@pytest.mark.slow
def test_minho_all_31_peaks_are_compared_in_their_own_direction():
    rows = comparison.table(source=MINHO, kinds="measured")
    assert len(rows) == 31
    assert {r.unit for r in rows} == {"kN"}
    assert {r.status for r in rows} == {"solved"}
    assert sum(r.quantity == "Vmax-" for r in rows) == 10
    # symmetric walls: both senses give one prediction, only the measured values differ
    by_test = {}
    for r in rows:
        by_test.setdefault(r.specimen, []).append(r.predicted)
    assert all(max(v) - min(v) < 1e-6 * max(v) for v in by_test.values())


def test_minho_ranges_cover_what_the_sources_leave_open():
    (sw,) = comparison.run(experiments.load(MINHO, "SW.100.1"), spread=True)
    assert experiments.load(MINHO, "SW.100.1").open_options == {"force_height": (0.95, 1.0)}
    assert sw.low == pytest.approx(sw.predicted)
    assert sw.high == pytest.approx(sw.predicted / 0.95, rel=1e-3)
    ws = experiments.load(MINHO, "WS.100")
    assert ws.open_options == {"friction": (0.5, 0.75), "first_course": ("half", "whole")}
    (row,) = comparison.run(ws, spread=True)
    ends = [predicted(ws.with_options(friction=mu)) for mu in (0.5, 0.75)]
    assert row.low <= ends[0] < row.predicted < ends[1] <= row.high
    assert " to " in comparison.as_text([row])
    (plain,) = comparison.run(ws)
    assert math.isnan(plain.low)


def test_a_range_is_told_where_only_the_own_options_have_no_answer(monkeypatch):
    asked = []

    def first_fails(*model, **settings):
        asked.append(model)
        if len(asked) == 1:
            raise NotConverged("not this one")
        return predict(*model, **settings)

    monkeypatch.setattr("limitmason.comparison.specimen.predict", first_fails)
    (row,) = comparison.run(experiments.load(MINHO, "SW.100.1"), spread=True)
    assert math.isnan(row.predicted)
    assert row.low == pytest.approx(0.95 * row.high, rel=1e-3)


def test_minho_negative_peaks_are_predicted_with_the_reversed_load(monkeypatch):
    seen = []

    def spy(assembly, loads, method, **settings):
        seen.append(float(np.sign(loads.live[:, 0].sum())))
        return limit_analysis(assembly, loads, **settings)

    monkeypatch.setattr(specimen, "predict", spy)
    rows = comparison.run(experiments.load(MINHO, "WS1.100"))
    assert [r.quantity for r in rows] == ["Vmax+", "Vmax-"]
    assert seen == [1.0, -1.0]


@pytest.mark.slow
def test_minho_ws_walls_rock_as_rigid_blocks_within_15_per_cent_and_sw_30_exceeds_them():
    ratio = {(r.specimen, r.quantity): r.ratio for r in comparison.table(source=MINHO, kinds="measured")}
    assert all(0.85 < x < 1.15 for (name, _), x in ratio.items() if name.startswith("WS"))
    assert all(x < 0.75 for (name, _), x in ratio.items() if name.startswith("SW.30"))
    assert all(x > 1.0 for (name, _), x in ratio.items() if name.startswith(("SW.100", "SW.200", "SW.250")))


@pytest.mark.parametrize(("source", "specimen", "options", "message"), [
    (MINHO, "SW.100.1", {"friction": "x"}, "friction must be a number, got 'x'"),
    (MINHO, "SW.100.1", {"force_height": "1.0"}, "force_height must be a number"),
    (MINHO, "SW.100.1", {"crushing": "False"}, "crushing must be one of False, True, got 'False'"),
    ("bnw-walls", "BNW1", {"friction": 0.6, "crushing": "False"}, "crushing must be one of None, True, False"),
    ("mcmaster-bending", "theta-0", {"scale_thickness": "no"}, "scale_thickness must be one of False, True"),
    ("mcmaster-bending", "theta-0", {"load_span": "0.5"}, "load_span must be a number"),
    ("murano-u-walls", "DS", {"header_positions": 2.5}, "header_positions must be a whole number"),
    ("murano-u-walls", "DS", {"roof_from": None}, "roof_from must be a number"),
    ("modern-walls", "189", {"coarse": -1}, "coarse = -1 must not be negative"),
    ("modern-walls", "189", {"coarse": 0}, "coarse must be a whole number of at least 1"),
    ("modern-walls", "189", {"shear_span": -1.0}, "shear_span = -1.0 must not be negative"),
    ("modern-walls", "189", {"energy_share": math.nan}, "energy_share is NaN"),
])
def test_options_that_are_no_numbers_or_no_choice_are_refused_by_name(source, specimen, options, message):
    with pytest.raises(InputError, match=re.escape(message)):
        experiments.load(source, specimen, **options)


@pytest.mark.parametrize("wall", ["SW.100.1", "WS1.100"])
def test_minho_copy_with_another_option_still_says_what_is_assumed(wall):
    test = experiments.load(MINHO, wall)
    copied = test.with_options(beam_rotation="held")
    assert copied.assumptions == test.assumptions
    assert any(text.startswith("Friction") for text in copied.assumptions)
    other = test.with_options(friction=0.7, force_height=1.4)
    assert not any(text.startswith(("Friction", "The force height")) for text in other.assumptions)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"force_height": 0.9}, "above the wall's top"), ({"beam_rotation": "loose"}, "'free', 'held'")],
)
def test_minho_bad_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        experiments.load(MINHO, "SW.30.1", **options)


# ---- Rondelet wallette ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bond", experiments.specimens(WALLETTE))
def test_rondelet_wallette_geometry_and_supports(bond):
    test = experiments.load(WALLETTE, bond)
    assembly = test.assembly()
    column = [k for k, b in enumerate(assembly.blocks) if b.name.startswith("column")]
    wall = [k for k in range(assembly.n_blocks) if k not in column]
    halves = {"toothed-odd-flush": 7, "toothed-even-flush": 6}.get(bond, 0)
    assert len(wall) == 39 + halves
    assert len(column) == 13
    held = assembly.held
    bottom = [k for k in range(assembly.n_blocks) if assembly.blocks[k].bounds[0, 2] < 1e-9]
    assert held[bottom].all()
    upper = [k for k in column if k not in bottom]
    assert held[upper, :3].all()
    assert not held[upper, 3:].any()
    assert not held[[k for k in wall if k not in bottom]].any()
    heights = np.array([b.bounds[1, 2] for b in assembly.blocks])
    assert heights.max() == pytest.approx(13 * 0.081)


@pytest.mark.parametrize("bond", experiments.specimens(WALLETTE))
def test_rondelet_wallette_associative_lies_in_the_window_of_godio_2017(bond):
    test = experiments.load(WALLETTE, bond)
    rows = comparison.run(test, flow_rule="associative", kinds=("published", "recomputed"))
    assert [r.quantity for r in rows] == ["3DEC dilatant", "associative"]
    for row in rows:
        assert row.status == "solved"
        assert 0.37 < row.predicted < 0.441
        assert row.predicted == pytest.approx(float(test.recomputed["associative"]), abs=1e-3)


@pytest.mark.slow
def test_rondelet_wallette_even_courses_toothed_are_stronger_for_either_free_edge():
    value = {
        b: predicted(experiments.load(WALLETTE, b), flow_rule="associative") for b in experiments.specimens(WALLETTE)
    }
    for edge in ("flush", "ragged"):
        assert value[f"toothed-even-{edge}"] > value[f"toothed-odd-{edge}"]


# ---- sources without an assembly ------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", experiments.all_cases(with_model=False), **ids)
def test_missing_plans_are_an_error_that_says_what_is_missing(case):
    if case.inferred:
        # a layout can be asked for, but no row of a table rests on it, and whoever sees it is told
        assert case.assembly().n_blocks > 1
        assert any("inferred, not published" in sentence for sentence in case.assumptions)
    else:
        with pytest.raises(ValueError, match=r"has no assembly: .*(not published|not found|not in the sources)"):
            case.assembly()
    rows = comparison.run(case)
    assert rows
    assert all(math.isnan(r.predicted) and r.status == specimen.NO_MODEL for r in rows)
    assert case.measured or case.published


@pytest.mark.parametrize("name", experiments.specimens("bnw-walls"))
def test_bnw_with_high_friction_fails_by_rocking_with_crushing_in_closed_form(name):
    test = experiments.load("bnw-walls", name, friction=2.0)
    p = test.parameters
    length, depth, height = float(p["length"]), float(p["thickness"]), float(p["height"])
    force = p["vertical stress"] * 1e6 * length * depth
    expected = force * (length - force / (p["masonry strength"] * 1e6 * depth)) / (2 * height) / 1e3
    assert predicted(test, quantities=["Vmax+"]) == pytest.approx(expected, rel=5e-3)
    assert -test.loads().dead[:, 2].sum() == pytest.approx(force, rel=1e-6)
