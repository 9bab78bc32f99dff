"""The ladder of models on measured walls: resumed as it was, intervals, modes by what gave way, refusals."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from limitmason import experiments
from limitmason.cli import main
from limitmason.comparison import wall_ladder
from limitmason.comparison.wall_curves import WallCurve
from limitmason.comparison.wall_ladder import (
    LADDER,
    MODEL_SPREAD,
    ROCKS,
    predict_walls,
)
from limitmason.comparison.wall_modes import joint_motions, mode_inside, rocking_force
from limitmason.errors import InputError
from limitmason.experiments.modern_walls import value
from limitmason.experiments.modern_walls.inputs import inputs_of
from limitmason.limit import limit_analysis

NAME = "modern-walls"


def test_answers_are_kept_and_read_back(tmp_path):
    store = tmp_path / "walls.jsonl"
    (first,) = predict_walls("formulas", ["22"], store=store)
    again = predict_walls("formulas", ["22", "189"], store=store)
    assert again[0] == first  # its seconds too: it was read
    assert len(store.read_text().splitlines()) == 3
    with ThreadPoolExecutor(1) as executor:
        elsewhere = predict_walls("formulas", ["22", "189"], executor=executor)
    assert [p.force for p in elsewhere] == [p.force for p in again]
    assert set(MODEL_SPREAD) == set(LADDER)


def test_wall_without_shear_span_is_named_and_unknown_methods_are_refused():
    (found,) = predict_walls("formulas", ["97"])
    assert np.isnan(found.force)
    assert found.status == "wall 97 has '/' for its shear span"
    formulas, blocks = (predict_walls(m, ["98"], spread=False)[0].status for m in ("formulas", "first"))
    assert (formulas, blocks) == ("solved", "solved; head joints unknown, taken as not filled")
    with pytest.raises(InputError, match="method must be one of 'formulas', 'first'"):
        predict_walls("formula")
    with pytest.raises(InputError, match="no specimen '199'"):
        predict_walls("formulas", ["199"])


@pytest.mark.parametrize(("status", "force", "words"), [
    ("stopped", [0.0, 30.0, 45.1], "its curve stopped at a drift of 0.1 %, before the force fell: the largest so far"),
    ("stopped", [0.0, 45.1, 40.0], "solved"),
    ("reached", [0.0, 30.0, 45.1], "solved"),
])
def test_a_curve_that_stops_before_its_force_falls_is_no_solution(monkeypatch, status, force, words):
    still = {name: [0.0, 0.1, 0.1] for name in ("slid", "slips", "apart", "past")}
    curve = WallCurve(wall="22", drift=[0.0, 0.05, 0.1], force=force, status=status, **still)
    monkeypatch.setattr(wall_ladder, "wall_curve", lambda *_, **__: curve)
    (found,) = predict_walls("pushover", ["22"], spread=False)
    assert (found.force, found.status) == (45.1, words)


def test_answers_of_paths_with_fewer_tries_are_not_read_back(monkeypatch, tmp_path):
    still = {name: [0.0, 0.1, 0.1] for name in ("slid", "slips", "apart", "past")}
    forces = iter((45.1, 59.5))

    def pushed(*_, **__):
        return WallCurve(wall="110", drift=[0.0, 0.1, 0.4], force=[0.0, next(forces), 1.0], status="reached", **still)

    monkeypatch.setattr(wall_ladder, "wall_curve", pushed)
    found = []
    for tries in (100, 400, 400):
        monkeypatch.setattr(wall_ladder, "TRIES", tries)
        found += predict_walls("pushover", ["110"], spread=False, store=tmp_path / "walls.jsonl")
    assert [f.force for f in found] == [45.1, 59.5, 59.5]


def test_interval_is_that_of_inputs_and_model_and_holds_nine_in_ten():
    # rocking governs wall 142: ln V = ln s0 + ln(1 - s0 / .85 fc) + ..., and only load and strength move it
    (found,) = predict_walls("formulas", ["142"])
    i = inputs_of(experiments.load(NAME, "142").row)
    s0, fc = i["sigma0"], i["fc"]

    def log_force(stress, strength):
        return np.log(stress * (1.0 - stress / (0.85 * strength)))

    base = log_force(s0.value, fc.value)
    moved = log_force(s0.drawn(1.0), fc.value) - base, log_force(s0.value, fc.drawn(1.0)) - base
    assert found.spread == pytest.approx(np.hypot(*moved))
    low, high = found.interval
    assert low * high == pytest.approx(found.force**2)
    total = np.hypot(found.spread, MODEL_SPREAD["formulas"])
    drawn = found.force * np.exp(total * np.random.default_rng(1).standard_normal(20_000))
    assert np.mean((drawn > low) & (drawn < high)) == pytest.approx(0.9, abs=0.01)


def test_an_input_that_is_given_is_moved_about_what_was_given(monkeypatch):
    """Of a force that grows as mu the spread is that of mu: it was the way from the given mu to that of the table."""
    solve = {"first": lambda test: wall_ladder._Solved(value(test, "mu"), 0.0, "S")}
    monkeypatch.setattr(wall_ladder, "_SOLVERS", solve)
    spread = inputs_of(experiments.load(NAME, "142").row)["mu"].spread
    for options in ({}, {"mu": 0.1}):
        (found,) = predict_walls("first", ["142"], options=options)
        assert found.spread == pytest.approx(spread)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "mode"),
    [
        ({"mu": 5.0, "fv0": 5.0, "cracks": "none"}, "F"),  # nothing gives way but the edges
        ({"mu": 0.05, "fv0": 0.0, "tension_share": 0.0, "cracks": "none", "sigma0": 0.3}, "SL"),
        # smooth head joints, bed joints that hold
        ({"mu": 5.0, "fv0": 5.0, "cracks": "none", "unfilled_friction": 0.0, "tension_share": 0.0}, "G"),
    ],
)
def test_mode_is_named_by_what_gave_way(options, mode):
    test = experiments.load(NAME, "146", **options)
    wall = test.assembly()
    found = limit_analysis(wall, test.loads())
    rocks = found.collapse_multiplier / rocking_force(test)
    assert ("F" if rocks >= ROCKS else mode_inside(wall, found.mechanism.twists)) == mode
    if mode == "SL":  # the whole top moves on one bed joint: mu N
        beds, apart, past = joint_motions(wall, found.mechanism.twists)
        assert beds.max() == pytest.approx(1.0, abs=1e-3)
        assert apart + past < 1e-3
        assert found.collapse_multiplier < 0.1 * rocking_force(test)


@pytest.mark.slow
def test_wall_without_dilatancy_carries_less():
    # a bound from above: less dilatancy never carries more
    without, extended = (predict_walls(m, ["126"], spread=False)[0] for m in ("non-associative", "extended"))
    assert without.status == "solved"
    assert 0.6 * extended.force < without.force < extended.force


def test_command_writes_the_table_and_goes_on(tmp_path, capsys):
    table = tmp_path / "table.csv"
    command = ["predict", NAME, "189", "97", "--method", "formulas", "--store", str(tmp_path / "s")]
    command += ["--csv", str(table)]
    assert main(command) == 0
    said = capsys.readouterr().err
    assert "wall 189: 105.8 kN" in said
    assert "wall 97: wall 97 has '/' for its shear span" in said
    rows = table.read_text().splitlines()
    assert rows[0] == "wall,method,V,V_low,V_high,mode,status"
    assert rows[2].startswith("189,formulas,")
    assert "shear span" in rows[3]
    assert main(command[:-2]) == 0
    shown = capsys.readouterr()
    assert "wall 189:" not in shown.err
    assert "V_low [kN]" in shown.out
    assert main(["predict", NAME, "--method", "blocks"]) == 2


def test_one_wall_by_its_number_is_that_wall():
    assert [p.wall for p in predict_walls("formulas", "124", spread=False)] == ["124"]
