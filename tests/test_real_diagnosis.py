"""Diagnosis of published data: stored values are those that the simulators give, verdicts follow from numbers."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from limitmason.diagnosis import Extension, Noise, Study, catalogue

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def example(name):
    """Names of an example without running its main part."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="not main")


def without_store(scope, function, tmp_path):
    """The function with an empty store, so that it computes."""
    inside = function.__globals__
    inside["VALUES"], inside["STORE"] = {}, tmp_path / "computed.csv"
    return function


def test_stored_multipliers_are_those_that_the_simulators_give(tmp_path):
    scope = example("diagnose_ferris_tin_loi")
    stored = dict(scope["VALUES"])
    rounding, overlap = scope["PHYSICAL"][:2]
    walls = {s["name"]: s for s in (*scope["WALLS"], *scope["published"])}
    simulate = without_store(scope, scope["simulate"], tmp_path)
    by_dem = scope["by_dem"]
    for name in ("wall-1", "1 x 5", "small, 2 x 6"):
        assert simulate(walls[name]) == pytest.approx(stored[f"limit {name}"], rel=2e-3)
    extend = Extension(((rounding, 15.0),))
    assert simulate(walls["1 x 5"], extend=extend) == pytest.approx(stored["limit 1 x 5 | edge rounding 15"], rel=2e-3)
    extend = Extension(((overlap, 30.0),))
    assert simulate(walls["2 x 8"], extend=extend) == pytest.approx(stored["limit 2 x 8 | lost overlap 30"], rel=2e-3)
    extend = Extension(((rounding, 20.0),))
    assert by_dem(walls["1 x 5"], extend=extend) == pytest.approx(stored["dem 1 x 5 | edge rounding 20"], rel=2e-3)


def test_rounding_of_a_column_moves_its_hinge_by_the_rounding():
    # one block wide, rocking about its lowest joint: lambda = (b - 2 r) / H exactly, in both codes' stored values
    values = example("diagnose_ferris_tin_loi")["VALUES"]
    height, width = 5 * 0.175, 0.4
    assert values["limit 1 x 5"] == pytest.approx(width / height, rel=1e-6)
    assert values["limit 1 x 5 | edge rounding 15"] == pytest.approx((width - 0.03) / height, rel=1e-6)
    assert values["dem 1 x 5 | edge rounding 20"] == pytest.approx((width - 0.04) / height, rel=5e-3)


def test_stored_minho_peaks_are_those_of_limit_analysis(tmp_path):
    scope = example("diagnose_minho")
    stored = scope["stored"](EXAMPLES / "stored" / "diagnose_minho_limit.csv")
    specimens, _ = scope["peaks"]()
    simulate = without_store(scope, scope["by_limit_analysis"], tmp_path)
    (tmp_path / "computed.csv").write_text("")
    crushing = next(c for c in scope["CAUSES"] if c.name == "finite compressive strength")
    by_model = {s["model"]: s for s in specimens}
    for model, friction in (("WS.100", 0.65), ("SW.30.1", 0.62)):
        key = f"{model} + friction {friction:g}"
        assert simulate(by_model[model]) == pytest.approx(stored[key], rel=1e-6)
        for size in (0.125, 0.25):
            extended = simulate(by_model[model], extend=Extension(((crushing, size),)))
            assert extended == pytest.approx(stored[f"{key} | finite compressive strength {size:g}"], rel=1e-6)


def test_granite_walls_by_dem_need_no_softening_of_joints_but_a_shift_of_the_second_direction(tmp_path):
    # joints of the measured modulus and second-order effects: the fall with precompression is in the baseline, and
    # neither crushing nor softer joints are called for; what limit analysis leaves between three causes is decided
    scope = example("diagnose_minho")
    stored = scope["stored"](EXAMPLES / "stored" / "diagnose_minho_dem.csv")
    by_dem = without_store(scope, scope["by_dem"], tmp_path)
    (tmp_path / "computed.csv").write_text("")
    specimens, measured = scope["peaks"]()
    rows = [i for i, s in enumerate(specimens) if s["series"] == "WS"]
    smallest = next(specimens[i] for i in rows if specimens[i]["model"] == "WS.40")
    assert by_dem(smallest) == pytest.approx(stored["WS.40 + friction 0.65"], rel=2e-3)
    by_dem.__globals__["VALUES"] = dict(stored)
    scatter = scope["replicates"](specimens, measured)
    study = scope["study_of"]([specimens[i] for i in rows], measured[rows], scatter, by_dem, {}, levels=5)
    causes = [c for c in scope["CAUSES_DEM"] if c.name != "shift of series SW"]
    verdict = study.diagnose(causes, draws=499)
    assert verdict.kind == "two"
    assert all("shift of direction -" in names for names in verdict.pairs)
    assert verdict.estimates["shift of direction -"].size == pytest.approx(1.1, abs=0.03)
    softer = verdict.verdict.tested[("joint softness",)]
    assert softer.sizes[0] < 0.01
    assert len((tmp_path / "computed.csv").read_text().splitlines()) <= 1  # all else was read back


def test_minho_peaks_are_thirty_one_and_the_ten_cyclic_walls_count_twice():
    specimens, measured = example("diagnose_minho")["peaks"]()
    assert len(specimens) == len(measured) == 31
    assert sum(s["direction"] == "-" for s in specimens) == 10
    assert {s["cyclic"] for s in specimens if s["direction"] == "-"} == {"cyclic"}


def test_replicate_scatter_of_the_sw_walls_by_hand():
    scope = example("diagnose_minho")
    sd, dof = scope["replicates"](*scope["peaks"]())["SW"]
    pairs = ((21.9, 22.9), (41.5, 48.2), (71.6, 68.6))
    assert dof == 3
    assert sd == pytest.approx(math.sqrt(sum(math.log(a / b) ** 2 / 2 for a, b in pairs) / 3))


def test_a_wall_of_another_height_keeps_stone_and_load():
    case = example("diagnose_minho")["case"]
    test, assembly, loads = case("WS.100 x2", 0.65, "+")
    plain, wall, _ = case("WS.100", 0.65, "+")
    assert assembly.n_blocks - 2 == 2 * (wall.n_blocks - 2)
    assert loads.dead[:, 2].sum() < 0
    assert float(test.parameters["N on top"]) == float(plain.parameters["N on top"])


def test_pavia_offset_planted_in_the_published_values_is_named_with_its_size():
    # the same twelve specimens, measured values made from the 3DEC ones: a verdict on real data can be rehearsed
    scope = runpy.run_path(str(EXAMPLES / "diagnose_pavia.py"), run_name="not main")
    specimens, simulate = scope["specimens"], scope["simulate"]
    shaken = np.exp(0.02 * np.random.default_rng(5).standard_normal(12))
    truth = np.array([catalogue.angle_offset().apply(-1.2, simulate(s), s) for s in specimens]) * shaken
    study = Study(specimens, simulate, truth, Noise(0.02))
    verdict = study.diagnose([scope["OFFSET"], scope["GAIN"], scope["DILATANCY"]])
    assert verdict.causes == ("angle offset",)
    assert verdict.estimates["angle offset"].size == pytest.approx(-1.2, abs=0.2)
