"""``limitmason diagnose`` as a user runs it: from a file with a units row, for our series or the user's own model."""

import csv
from pathlib import Path

import numpy as np
import pytest

from limitmason import cli, comparison, experiments
from limitmason.diagnosis import Noise, Study
from limitmason.diagnosis.simulator_calls import Job, Simulator
from limitmason.experiments.series import packaged_table
from limitmason.formats import read_measured, write_measured

OWN = """
from math import exp
from limitmason.diagnosis import Cause

def simulate(specimen, *, friction=0.7, rounding=0.0):
    return (specimen["width"] - 2.0 * rounding) / specimen["height"] * friction**0.1

def gain(size, prediction, specimen):
    return size * prediction

CAUSES = [
    Cause("edge rounding", "rounding", 0.0, (0.0, 0.02), "edges pulled in", unit="m"),
    Cause("gain", "gain", 1.0, (0.7, 1.4), "sensor", "measurement", gain),
]
"""


def run(*arguments, capsys):
    """Status, report and messages; the terminal shows three lines of the report at most, and one with its files."""
    status = cli.main(["diagnose", *(str(a) for a in arguments)])
    captured = capsys.readouterr()
    wrote = [line for line in captured.err.splitlines() if line.startswith("wrote ") and ": report.txt" in line]
    if not wrote:
        return status, captured.out, captured.err
    (line,) = wrote
    folder, _, names = line.removeprefix("wrote ").partition(": ")
    assert all((Path(folder) / name).is_file() for name in names.split(", "))
    shown, text = captured.out.splitlines(), (Path(folder) / "report.txt").read_text()
    assert 2 <= len(shown) <= 3
    assert len(set(shown)) == len(shown)
    assert all(line in text for line in shown)
    return status, text, captured.err


def template(folder, capsys, *more):
    path = folder / "data.csv"
    status, _, err = run("--template", path, *more, capsys=capsys)
    assert status == 0
    assert f"wrote {path}" in err
    return path


def rewritten(path, change):
    """The file with its rows changed, by line number; in the form of version 0.1, whose second row gives the units."""
    lines = [line.removeprefix("# units: ") for line in path.read_text().splitlines()]
    lines = [line for line in lines if not line.startswith("#")]
    rows = list(csv.reader(lines))
    change(rows)
    path.write_text("\n".join(",".join(row) for row in rows) + "\n")
    return path


@pytest.mark.slow
def test_template_runs_as_it_stands_and_writes_report_figures_and_page(tmp_path, capsys):
    path = template(tmp_path, capsys)
    out = tmp_path / "result"
    status, text, err = run(path, "--noise", "4%", "--tilting", "--out", out, capsys=capsys)
    assert status == 0
    # the example was made with 0.88 times the prediction
    assert "Behaves like gain" in text
    assert "conditional on this list" in text
    assert "without" in text or "No single specimen decides" in text
    for name in ("diagnosis.png", "confusable.png"):
        assert (out / name).read_bytes()[:4] == b"\x89PNG"
    page = (out / "diagnosis.html").read_text()
    assert page.startswith("<!DOCTYPE html>")
    assert "Behaves like gain" in page
    assert "width [m]" in page
    rows = list(csv.reader((out / "causes.csv").open()))
    assert rows[1][4] == "unit"
    (size,) = [float(r[4]) for r in rows[2:] if r[0] == "gain"]
    assert size == pytest.approx(0.88, rel=0.03)
    assert f"wrote {out}: report.txt, diagnosis.html" in err
    status, _, err = run("--template", path, capsys=capsys)
    assert status == 2
    assert "exists already" in err


@pytest.mark.slow
def test_a_model_and_causes_of_the_user_and_noise_from_replicates(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own_walls.py").write_text(OWN)
    rng = np.random.default_rng(4)
    rows = [
        {"measured": float((w - 0.024) / h * np.exp(0.03 * rng.standard_normal())), "group": f"{h}-{w}", "height": h,
         "width": w}
        for h in (0.4, 0.7, 1.0) for w in (0.08, 0.14, 0.25) for _ in range(2)
    ]
    write_measured("walls.csv", {"measured": "-", "group": "-", "height": "m", "width": "m"}, rows)
    arguments = ("walls.csv", "--model", "own_walls.py:simulate", "--causes", "own_walls:CAUSES", "--noise",
                 "replicates", "--input", "friction=0.7,0.03", "--out", "out", "--no-checks")
    monkeypatch.setenv("LIMITMASON_PROGRESS", "always")
    status, text, err = run(*arguments, capsys=capsys)
    assert status == 0
    assert "Behaves like edge rounding" in text  # nine walls expect an excess of 8; a name is earned from 10 on
    assert "from replicates with 9 degrees of freedom" in text
    assert "Measured input friction: 0.7 +- 0.03" in text
    assert "9 groups" in text
    assert int(err.split(" simulations")[0].split()[-1]) > 0
    # simulated values are kept: the second run computes none, until the model is edited
    _, again, err = run(*arguments, capsys=capsys)
    assert again == text
    assert "\n0 simulations" in err


@pytest.mark.slow
def test_a_second_column_of_predictions_can_be_the_cause(tmp_path, capsys):
    rng = np.random.default_rng(2)
    rows = []
    for k in range(14):
        low = float(rng.uniform(0.1, 0.4))
        high = low * float(rng.uniform(1.02, 1.6))
        value = low * (high / low) ** 0.6 * float(np.exp(0.02 * rng.standard_normal()))
        rows.append({"specimen": f"S{k}", "measured": value, "stiff": low, "dilatant": high})
    path = tmp_path / "data.csv"
    write_measured(path, {"specimen": "-", "measured": "-", "stiff": "-", "dilatant": "-"}, rows)
    status, text, _ = run(path, "--predicted", "stiff", "--towards", "dilatant", "--noise", 0.02, "--out",
                          tmp_path / "out", "--no-checks", "--next", 0, capsys=capsys)
    assert status == 0
    assert "Behaves like towards dilatant" in text
    size = float(text.split("towards dilatant = ")[1].split()[0])
    assert size == pytest.approx(0.6, abs=0.1)
    assert "No covariates are recorded" in text


@pytest.mark.slow
def test_a_packaged_series_with_our_simulator(tmp_path, capsys):
    path = template(tmp_path, capsys, "--model", "minho")
    table = read_measured(path)
    assert len(table) == 31  # peaks of 21 walls, both senses of the cyclic ones
    assert table.units["measured"] == "kN"
    keep = {"SW.30.1", "SW.100.1", "SW.100.2", "SW.200.1", "SW.250.1"}
    rewritten(path, lambda rows: rows.__setitem__(slice(2, None), [r for r in rows[2:] if r[0] in keep]))
    status, text, err = run(path, "--model", "minho", "--noise", 0.05, "--causes", "edge rounding,gain", "--levels", 3,
                            "--out", tmp_path / "out", "--no-checks", "--next", 0, capsys=capsys)
    assert status == 0
    assert "5 values" in err
    assert "is assumed" in text  # what the sources leave open is said
    # repeats of one configuration are solved once, and give what the experiment itself gives
    study = Study.from_table(path, model="minho", causes=["gain"])
    row = {r["specimen"]: r for r in study.specimens}
    known = Simulator(study.simulate, [row["SW.100.1"], row["SW.100.2"], row["SW.200.1"]])
    value, repeat, other = known.predict([Job(0, ()), Job(1, ()), Job(2, ())])
    assert value == repeat != other
    assert known.calls == 2
    assert " at 0x" not in repr(study.simulate)  # values on disk are found again by another process
    (wanted,) = [r.predicted for r in comparison.run(experiments.load("minho-dry-stone-2005-2009", "SW.100.1"))]
    assert value == pytest.approx(wanted, rel=1e-9)


def test_units_of_force_are_converted_and_others_refused(tmp_path, capsys):
    path = template(tmp_path, capsys, "--model", "minho")

    def in_newton(rows):
        rows[1][rows[0].index("measured")] = "N"

    before = read_measured(path).columns["measured"]
    study = Study.from_table(rewritten(path, in_newton), model="minho")
    assert study.measured == pytest.approx([v / 1e3 for v in before])
    assert "weak base joint" in [c.name for c in study.causes]
    assert "[kN]" in study.about.quantity

    def in_metres(rows):
        rows[1][rows[0].index("measured")] = "m"

    status, _, err = run(rewritten(path, in_metres), "--model", "minho", capsys=capsys)
    assert status == 2
    assert "'measured' has the unit 'm', but the predictions come in 'kN'" in err


@pytest.mark.slow
def test_a_series_without_plans_is_held_against_its_published_predictions(tmp_path, capsys):
    table = packaged_table("pavia-tilting")
    assert {"predicted", "3DEC dilatant"} <= set(table.columns)
    assert len(table) == 12
    out = tmp_path / "out"
    status, text, _ = run("--model", "pavia", "--noise", 0.05, "--towards", "3DEC dilatant", "--out", out,
                          "--no-checks", capsys=capsys)
    assert status == 0
    assert "angle offset" in text  # tilted: the zero of the inclinometer is in the list
    assert "causes inside the model cannot be tried" in text


def cell(row, column, value):
    def change(rows):
        rows[row][rows[0].index(column)] = value

    return change


@pytest.mark.parametrize("change, arguments, message", [
    (cell(4, "measured", "-0.2"), (), "row 5, column 'measured': a positive number is needed, got -0.2"),
    (cell(4, "measured", "abc"), (), "row 5, column 'measured': 'abc' is not a number, but most of the column"),
    (cell(4, "height", "tall"), (), "row 5, column 'height': 'tall' is not a number, but its unit is 'm'"),
    (cell(4, "height", ""), (), "row 5, column 'height' is blank"),
    (cell(1, "height", ""), (), "row 2 must give the unit of every column; 'height' has ''"),
    (cell(1, "measured", "kN"), (), "'predicted' is in '-', 'measured' in 'kN'"),
    (lambda rows: rows[3].append("1"), (), "row 4 has 8 cells, the header has 7"),
    (lambda rows: rows[0].__setitem__(5, "height"), (), "the column 'height' is there twice"),
    (lambda rows: rows.__delitem__(slice(2, None)), (), "rows of values are needed"),
    (None, ("--measured", "force"), "there is no column 'force'"),
    (None, ("--covariates", "age"), "there is no column 'age' for the covariates"),
    (None, ("--noise", "small"), "--noise must be a number"),
    (None, ("--noise", "4%%"), "--noise must be a number such as 0.04 or 4%"),
    (None, ("--model", ":f"), "--model :f: give module:name or file.py:name"),
    (None, ("--noise", "4"), "0.04 is 4 %"),
    (None, ("--causes", "gain,magic"), "there is no cause 'magic'"),
    (None, ("--model", "nowhere"), "neither module:function nor a packaged series"),
    (None, ("--model", "nowhere.py:simulate"), "there is no file nowhere.py"),
    (None, ("--model", "nowhere_at_all:simulate"), "No module named 'nowhere_at_all'"),
    (None, ("--model", "math:nothing"), "math has no 'nothing'"),
    (None, ("--model", "math:sqrt"), "--causes module:LIST"),
    (None, ("--model", "minho"), "minho-dry-stone-2005-2009 has no 'B1.1'"),
    (None, ("--input", "friction"), "NAME=VALUE,SD"),
])
def test_mistakes_name_the_place_and_end_with_status_2(change, arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = template(tmp_path, capsys)
    rewritten(path, change or (lambda rows: None))
    status, out, err = run(path, *arguments, "--out", tmp_path / "out", capsys=capsys)
    assert status == 2
    assert message in err
    assert "Traceback" not in out + err
    assert not (tmp_path / "out" / "report.txt").exists()


def test_no_data_and_a_benchmark_without_measurements_say_what_to_do(tmp_path, capsys):
    status, _, err = run(capsys=capsys)
    assert status == 2
    assert "--template" in err
    status, _, err = run("--model", "ferris", "--out", tmp_path, capsys=capsys)
    assert status == 2
    assert "numerical benchmark" in err


def test_a_study_comes_from_a_packaged_series_in_one_call():
    study = Study.from_experiments("minho", noise="unknown", inputs={})
    assert (study.n, study.about.units["measured"], study.noise.kind) == (31, "kN", "unknown")
    assert {"edge rounding", "friction of the rig", "overload magnitude"} <= {c.name for c in study.causes}
    assert "friction" in " ".join(study.about.notes)
    published = Study.from_experiments("pavia-tilting", noise=0.05, towards=["3DEC dilatant"])
    assert [c.name for c in published.causes] == ["gain", "friction of the rig", "angle offset",
                                                  "towards 3DEC dilatant"]
    assert published.simulator.calls == 0


def test_noise_of_a_table_comes_in_three_units(tmp_path):
    rows = [{"measured": 2.0 + k, "predicted": 2.0 + k, "noise": 0.1 * (2.0 + k)} for k in range(5)]
    absolute = tmp_path / "kn.csv"
    write_measured(absolute, {"measured": "kN", "predicted": "kN", "noise": "kN"}, rows)
    assert Study.from_table(absolute).noise.sd == pytest.approx(0.1, rel=1e-12)
    percent = tmp_path / "percent.csv"
    write_measured(percent, {"measured": "-", "predicted": "-", "noise": "%"}, [{**r, "noise": 4.0} for r in rows])
    assert Study.from_table(percent, dof=5).noise == Noise(0.04, 5)
    assert Study.from_table(percent, noise=Noise(0.03, 6)).noise == Noise(0.03, 6)
    with pytest.raises(ValueError, match="no list of causes|needs its list of causes"):
        Study.from_table(percent, model=len)
    with pytest.raises(TypeError, match="colour"):
        Study.from_table(percent, colour="red")
