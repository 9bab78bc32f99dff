"""Methods by name: one vocabulary everywhere, and a method of one file is a full member."""

import math
import re
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import pytest

import dem
import limitmason as lm
from limitmason import cli, methods
from limitmason.answers.method import Look, Method, settings_of
from limitmason.answers.results import Bound, BoundKind, Prediction, Range, Status
from limitmason.errors import InputError
from limitmason.methods import answer

ROOT = Path(__file__).resolve().parents[2]


def toy(assembly, loads, *, factor: float = 2.0):
    """A method that knows one number."""
    return Prediction("toy", factor * 0.1, Bound(BoundKind.ESTIMATE, "estimate: a toy"), Status.SOLVED,
                      range=Range(0.18, 0.3, "toy's own"))


TOY = Method(
    "toy", toy, settings_of("ToySettings", toy),
    look=Look("TOY", "PURPLE", "X"), cheap={"factor": 3.0}, kept=(), beside=lambda _: "a word beside",
)


@pytest.fixture
def wall():
    built = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(friction_angle_deg=33.0))
    return built, lm.Loads.horizontal(built)


@pytest.fixture
def with_toy(monkeypatch):
    monkeypatch.setattr(methods, "METHODS", {**methods.METHODS, "toy": f"{__name__}:TOY"})


@pytest.mark.parametrize("name", methods.COMPARED_METHODS)
def test_every_theory_has_the_same_name_in_predict_and_compare(name, wall):
    options = {"error_budget": ()} if name == "dem" else {}
    found = lm.predict(*wall, name, **options)
    again = lm.compare(*wall, (name,), **({name: options} if options else {}))[name]
    assert again.multiplier == found.collapse_multiplier
    assert again.bound.endswith(found.bound)


QUICK = {"search": "quick", "prove": False, "measure_jump": False}

SAME_NAMES = {
    "limit_analysis": lambda w, name: lm.limit_analysis(*w, name, **QUICK).collapse_multiplier,
    "predict": lambda w, name: lm.predict(*w, name, **QUICK).collapse_multiplier,
    "flow rule of predict": lambda w, name: lm.predict(*w, flow_rule=name, **QUICK).collapse_multiplier,
    "answer": lambda w, name: answer(*w, {"peak": name}, non_associative=QUICK)["peak"],
    "answer, options by name": lambda w, name: answer(*w, {"peak": "non-associative"}, **{name: QUICK})["peak"],
    "compare": lambda w, name: lm.compare(*w, (name,), non_associative=QUICK)["non-associative"].multiplier,
    "answers of compare": lambda w, name: lm.compare(*w, "non-associative", non_associative=QUICK)[name].multiplier,
    "dilatancy study": lambda w, name: lm.study.dilatancy_study(
        *w, [0.0], methods=name, options={name: QUICK})["multiplier"][0],
    "experiment": lambda _, name: lm.comparison.run(
        lm.experiments.load("ferris-tin-loi-2001", "wall-1"), flow_rule=name, kinds="published", **QUICK)[0].multiplier,
}


@pytest.mark.parametrize("call", SAME_NAMES)
def test_a_hyphen_of_a_method_or_flow_rule_may_be_an_underscore(call, wall):
    hyphen, underscore = (SAME_NAMES[call](wall, name) for name in ("non-associative", "non_associative"))
    assert math.isfinite(hyphen)
    assert underscore == hyphen


def test_the_command_line_takes_an_underscore_in_a_name_too(wall, tmp_path, capsys):
    file = str(lm.formats.write_json(tmp_path / "wall.json", *wall) or tmp_path / "wall.json")
    for words in (["--flow-rule", "non_associative"], ["--method", "non_associative"]):
        assert cli.main(["solve", file, *words, "--search", "quick"]) == 0
        assert "non-associative" in capsys.readouterr().out


def test_options_under_both_spellings_of_a_method_are_refused(wall):
    with pytest.raises(InputError, match="'non-associative' are given twice"):
        answer(*wall, {"lambda": "non-associative"}, **{"non-associative": QUICK, "non_associative": QUICK})


def test_limit_takes_the_flow_rule_as_an_option(wall):
    by_rule = lm.predict(*wall, "limit", flow_rule="non-associative", search="quick")
    assert by_rule.collapse_multiplier == lm.predict(*wall, "non-associative", search="quick").collapse_multiplier
    with pytest.raises(ValueError, match="flow_rule must be one of"):
        lm.predict(*wall, "limit", flow_rule="dilatant")
    with pytest.raises(ValueError, match="method 'dem' has its own"):
        lm.predict(*wall, "dem", flow_rule="associative")


@pytest.mark.parametrize("name", methods.COMPARED_METHODS)
def test_an_unknown_option_is_refused_with_the_nearest_name(name, wall):
    with pytest.raises(TypeError, match=f"method '{name}' has no option 'no_such_thing'"):
        lm.predict(*wall, name, no_such_thing=1)
    known = methods.get_method(name).takes[0]
    with pytest.raises(TypeError, match=f"did you mean '{known}'"):
        lm.predict(*wall, name, **{known + "x": 1})


@pytest.mark.parametrize("name", methods.COMPARED_METHODS)
def test_settings_are_a_frozen_dataclass_with_the_defaults_of_the_solver(name):
    settings = methods.get_method(name).settings()
    with pytest.raises(FrozenInstanceError):
        setattr(settings, fields(settings)[0].name, None)


def test_a_method_of_one_file_is_a_full_member(wall, with_toy, capsys, tmp_path):
    assert lm.predict(*wall, "toy").collapse_multiplier == pytest.approx(0.2)
    result = lm.compare(*wall, ("associative", "toy"), store=tmp_path / "store")
    row = result["toy"]
    assert (row.low, row.high, row.range_is, row.beside) == (pytest.approx(0.18), 0.3, "toy's own", "a word beside")
    assert any("TOY" in line for line in result.findings())
    figure = lm.figures.side_by_side(result)
    assert any("TOY" in t.get_text() for t in figure.axes[0].get_yticklabels())
    model = tmp_path / "wall.json"
    lm.formats.write_json(model, wall[0], wall[1])
    assert cli.main(["compare", str(model), "--methods", "associative", "toy"]) == 0
    assert "toy" in capsys.readouterr().out
    assert cli.main(["solve", str(model), "--method", "toy"]) == 0
    study = lm.study.dilatancy_study(*wall, shares=(0.0,), methods=("toy",))
    assert study.rows[0]["multiplier"] == pytest.approx(0.3)  # the settings of one run of many
    simulate = lm.diagnosis.simulate.collapse(lambda specimen: wall, "toy")
    assert simulate("one") == pytest.approx(0.3)
    assert math.isclose(simulate("one", factor=4.0), 0.4)


def test_no_method_is_told_apart_by_its_name_outside_its_file():
    pattern = re.compile(r"[=!]= *['\"](dem|mechanisms|associative|non-associative)['\"]")
    guilty = [
        f"{path.relative_to(ROOT)}:{n}"
        for path in sorted((ROOT / "limitmason").rglob("*.py"))
        for n, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        # in a source's folder such a name is that of a published value
        if pattern.search(line) and "flow_rule" not in line and "experiments" not in path.parts
    ]
    assert guilty == []


@pytest.mark.parametrize(("wanted", "options", "message"), [
    ({"frequency 1": "modes"}, {"modes": {"drive": dem.Drive({"top": {"x": 1.0}})}}, "'modes': drive is not used"),
    ({"frequency 1": "modes"}, {"modes": {"stages": [dem.Hold(steps=2)]}}, "'modes': stages is not used"),
    ({"collapse multiplier": "limit"}, {"limit": {"test": object()}}, "'limit': test is not used"),
    ({"peak": "dem"}, {"dem": {"drive": dem.Drive({"top": {"x": 1.0}}), "stages": [dem.Hold(steps=2)], "to": 1e-3}},
     "'dem': stages is not used by it beside a drive"),
    ({"collapse multiplier": "limit"}, {"limit": 3}, "options of 'limit' must be a mapping, got 3"),
    ({"frequency 1": "modes"}, {"modes": {"test": 3}}, "options of 'modes': test must be a ModalTest"),
    ({"peak": ["limit"]}, {}, "unknown method"),
    ({3: "limit"}, {}, "the name of a quantity must be a str, got 3"),
])
def test_what_a_method_asked_for_a_quantity_would_not_use_is_refused_by_name(wanted, options, message, wall):
    with pytest.raises(InputError, match=message):
        answer(*wall, wanted, **options)
