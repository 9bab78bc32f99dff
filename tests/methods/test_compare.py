"""Theories side by side: what theory demands of them, what is kept, what is drawn."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from walls import on_slab, running_bond

import limitmason as lm
from limitmason import cli
from limitmason.comparison import comparing
from limitmason.study import Memo

FAST = {"dem": {"contact_points": (2, 2), "error_budget": ()}, "non_associative": {"search": "quick"}}


@pytest.fixture(scope="module")
def wall():
    assembly = lm.build.wall(length=0.6, courses=4, unit=(0.2, 0.1, 0.1), joint=lm.Joint(33.0))
    return assembly, lm.Loads.horizontal(assembly)


@pytest.fixture(scope="module")
def result(wall):
    return lm.compare(*wall, measured=(0.4, 0.5), title="wall", **FAST)


def test_rows_hold_what_each_method_returns(wall, result):
    assert [r.method for r in result.rows] == ["associative", "non-associative", "dem", "mechanisms"]
    assert result["associative"].multiplier == lm.limit_analysis(*wall).collapse_multiplier
    assert result["mechanisms"].multiplier == lm.predict(*wall, "mechanisms").collapse_multiplier
    assert all(r.ratio == pytest.approx(r.multiplier / 0.45) for r in result.rows)
    assert result["dem"].low <= result["dem"].multiplier < result["dem"].high


def test_theory_holds_on_the_wall(result):
    assert result["non-associative"].multiplier <= result["associative"].multiplier * (1 + 1e-6)
    # the two theorems hold, which could not be otherwise: only what could have failed stands below the table
    (line,) = result.findings()
    assert line.startswith("holds: the DEM lies inside the admissible range")
    assert str(result).count("holds:") == 1


def test_a_broken_order_is_found(result):
    def shifted(method, by):
        rows = tuple(
            replace(r, multiplier=r.multiplier * by, low=r.low * by, high=r.high * by)
            if r.method == method else r
            for r in result.rows
        )
        return " ".join(comparing.SideBySide(rows).findings())

    assert "BROKEN: non-associative <= associative" in shifted("non-associative", 1.2)
    assert "open: the DEM lies above" in shifted("dem", 1.2)
    assert "open: the DEM lies below" in shifted("dem", 0.8)
    assert "BROKEN: associative <= admissible mechanism" in shifted("associative", 2.0)


def test_a_check_says_which_of_its_ends_was_not_computed(result):
    """Equilibrium and strength bound a simulation on both sides: each end that is missing is named, none is passed."""

    def lines(*methods, dem=1.0):
        own = {r.method: r for r in result.rows}
        moved = own["dem"]
        own["dem"] = replace(moved, multiplier=dem * moved.multiplier, low=dem * moved.low, high=dem * moved.high)
        return comparing.SideBySide(tuple(own[m] for m in methods)).findings()

    assert lines("dem", "mechanisms") == lines("associative") == ()  # nothing to hold against
    (above,) = lines("associative", "dem")
    assert above.startswith("holds: the DEM lies not above the associative value")
    assert "admissible ? to" in above
    assert "smallest admissible value was not asked for" in above
    assert lines("associative", "dem", dem=0.1)[0].startswith("holds")  # no lower end: it cannot tell, and says so
    assert lines("associative", "dem", dem=1.5)[0].startswith("open: the DEM lies above")
    (below,) = lines("non-associative", "dem")
    assert below.startswith("holds: the DEM lies not below")
    assert "associative value was not asked for" in below
    assert lines("non-associative", "dem", dem=0.1)[0].startswith("open: the DEM lies below")


def test_answers_that_are_missing_are_not_checked(result):
    rows = {r.method: r for r in result.rows}
    refused = comparing.Row.refused("non-associative", "an example")
    lines = comparing.SideBySide((rows["associative"], refused, rows["dem"])).findings()
    assert lines[0] == "not checked: non-associative <= associative (non-associative does not apply)"
    assert "non-associative does not apply, so that end is not checked" in lines[1]
    bare = replace(rows["mechanisms"], details={})
    (line,) = comparing.SideBySide((rows["associative"], bare)).findings()
    assert line.startswith("not checked: associative <= admissible mechanism (no mechanism")
    failed = comparing.Row.unanswered("associative", "an example")
    assert all("not checked" in f for f in comparing.SideBySide((failed, rows["dem"], bare)).findings())


@pytest.mark.slow
def test_a_resume_shares_its_bar_among_what_is_missing(wall, tmp_path, monkeypatch):
    """Two of three answers were in the store: the third fills the bar, so that its speed is that of the whole."""
    said = []
    monkeypatch.setattr(comparing, "reached", lambda part, text=None, *, share=0.0: said.append((part, text, share)))
    two = ("associative", "mechanisms")
    first = lm.compare(*wall, two, store=tmp_path)
    assert said == [(0.0, "associative", 0.5), (0.5, "mechanisms", 0.5)]
    said.clear()
    again = lm.compare(*wall, ("associative", "mechanisms", "sustained"), store=tmp_path)
    assert said == [(0.0, "sustained", 1.0)]
    assert [r.multiplier for r in again.rows[:2]] == [r.multiplier for r in first.rows]


def test_one_program_is_no_check_of_itself():
    wall = lm.build.wall(length=0.6, courses=2, unit=(0.2, 0.1, 0.1), joint=lm.Joint(30.0, dilatancy_angle_deg=30.0))
    (line,) = lm.compare(wall, lm.Loads.horizontal(wall), ("associative", "non-associative")).findings()
    assert line.startswith("not checked: non-associative <= associative")
    assert "psi = phi" in line


@pytest.mark.slow
def test_scaling_a_dry_wall_leaves_all_multipliers():
    values = []
    for scale in (1.0, 3.0):
        a = lm.build.wall(
            length=0.6 * scale, courses=3, unit=(0.2 * scale, 0.1 * scale, 0.1 * scale), joint=lm.Joint(33.0)
        )
        values.append([r.multiplier for r in lm.compare(a, lm.Loads.horizontal(a), **FAST).rows])
    assert values[0] == pytest.approx(values[1], rel=1e-6)


def test_error_budget_widens_the_range_of_the_dem():
    b = on_slab([((0, 0, 0), (0.4, 0.4, 0.4))], mu=0.5)
    live = np.zeros((2, 6))
    live[1, 5] = 0.5 * b.weights[1] * 0.4
    twist = lm.Loads(lm.Loads.weight(b).dead, live)
    dem = lm.compare(b, twist, "dem", dem={"contact_points": (2, 2), "error_budget": ("contact points",)})["dem"]
    change = dem.details["error budget"]["contact points"]["multiplier"] - dem.multiplier
    assert change < -0.05  # two points across carry torsion in the corners, four less
    assert dem.low == pytest.approx(dem.multiplier + change)


def test_a_finished_method_is_not_repeated(wall, tmp_path, monkeypatch):
    first = lm.compare(*wall, ("associative", "mechanisms"), store=tmp_path)
    file = tmp_path / comparing.ANSWERS
    assert len(Memo(file)) == 2
    # as if killed after the first method
    file.write_text("".join(line for line in file.read_text().splitlines(True) if '["mechanisms"' not in line))
    assert len(Memo(file)) == 1
    called = []
    solve = comparing._solve
    monkeypatch.setattr(comparing, "_solve", lambda a, b, name, *c: called.append(name) or solve(a, b, name, *c))
    again = lm.compare(*wall, ("associative", "mechanisms"), store=tmp_path, measured=0.5)
    assert called == ["mechanisms"]
    for a, b in zip(first.rows, again.rows, strict=True):
        assert (a.multiplier, a.bound, a.status) == (b.multiplier, b.bound, b.status)
    assert again["associative"].ratio == pytest.approx(again["associative"].multiplier / 0.5)


def test_another_wall_load_or_option_is_another_entry(wall, tmp_path):
    assembly, loads = wall
    lm.compare(assembly, loads, "associative", store=tmp_path)
    lm.compare(assembly, lm.Loads.horizontal(assembly, (-1, 0, 0)), "associative", store=tmp_path)
    lm.compare(assembly.with_joints(lm.Joint(20.0)), loads, "associative", store=tmp_path)
    lm.compare(assembly, loads, "associative", store=tmp_path, associative={"contact_model": "grid"})
    assert len(Memo(tmp_path / comparing.ANSWERS)) == 4


def test_a_damaged_answer_is_named(wall, tmp_path):
    lm.compare(*wall, "associative", store=tmp_path)
    path = tmp_path / comparing.ANSWERS
    with path.open("a") as file:
        file.write(json.dumps({"schema": "other"}) + "\n")
    with pytest.raises(ValueError, match=r"answers.jsonl, line 3 is damaged"):
        lm.compare(*wall, "associative", store=tmp_path)


def test_a_method_that_refuses_says_so():
    arch = lm.build.arch(radius=1.2, thickness=0.4, voussoirs=9, width=0.5, joint=lm.Joint(35.0))
    found = lm.compare(arch, lm.Loads.horizontal(arch), ("associative", "mechanisms"))
    assert found["associative"].solved
    assert found["mechanisms"].status.startswith("does not apply: the catalogue has no mechanism of an arch")
    assert math.isnan(found["mechanisms"].multiplier)
    assert "does not apply" in found.table()


@pytest.mark.slow
def test_proven_range_replaces_what_the_search_found():
    a = running_bond(2, 3)
    row = lm.compare(a, lm.Loads.horizontal(a), "non-associative", proven=30.0)["non-associative"]
    assert row.range_is == "no admissible multiplier lies outside"
    assert row.low <= row.multiplier <= row.high


@pytest.mark.parametrize("call, message", [
    (lambda w: lm.compare(*w, ("associative", "fem")), "unknown method 'fem'"),
    (lambda w: lm.compare(*w, "associative", dem={}), "options are given for 'dem'"),
    (lambda w: lm.compare(*w, "associative", measured=-1.0), "measured must be positive"),
    (lambda w: lm.compare(*w, "associative", measured=(0.5, 0.4)), "measured must be positive"),
    (lambda w: lm.compare(*w, "associative", associative=3), "must be a mapping"),
    (lambda w: lm.compare(*w, None), "methods must be a list"),
    (lambda w: lm.compare(*w, "non-associative", **{"non-associative": {"search": "quick"}, "non_associative": {}}),
     "'non-associative' are given twice"),
])
def test_mistakes_are_named(call, message, wall):
    with pytest.raises(ValueError, match=message):
        call(wall)


def test_table_and_markdown_show_every_method_and_the_test(result):
    for text in (result.table(), result.as_markdown()):
        for word in ("associative", "non-associative", "dem", "mechanisms", "test", "0.45000", "sloping crack"):
            assert word in text
    lines = result.as_markdown().splitlines()
    assert len({line.count("|") for line in lines}) == 1


def test_figure_marks_every_value_and_the_test(result):
    ax = lm.figures.side_by_side(result).axes[0]
    values = [line.get_xdata()[0] for line in ax.lines if line.get_gid() == "value"]
    assert values == [r.multiplier for r in result.rows]
    assert [line.get_xdata()[0] for line in ax.lines if line.get_gid() == "test"] == [0.45]
    bars = {round(p.get_x(), 12) for p in ax.patches if p.get_gid() == "range"}
    assert round(result["dem"].low, 12) in bars


@pytest.mark.slow
def test_command_prints_the_table_keeps_answers_and_draws(tmp_path, capsys):
    arguments = ["compare", "ferris-tin-loi-2001/wall-1", "--methods", "associative", "mechanisms", "--measured", "0.6",
                 "--store", str(tmp_path / "answers"), "--figure", str(tmp_path / "f.png")]
    for word in ("...", "from the store"):
        assert cli.main(["--progress", "always", *arguments]) == 0
        captured = capsys.readouterr()
        assert "0.64286" in captured.out
        assert "1.071" in captured.out
        assert word in captured.err
    assert (tmp_path / "f.png").stat().st_size > 5_000
    assert cli.main([*arguments, "--no-budget"]) == 2
    assert "not among --methods" in capsys.readouterr().err


def test_what_carries_nothing_by_any_theory_is_compared_too():
    rows = [lm.comparison.Row("associative", 0.0, status="solved"),
            lm.comparison.Row("non-associative", 0.0, low=0.0, high=0.0, status="solved")]
    for value, state in ((1e-12, "holds"), (0.1, "open")):  # both ended in a division by zero
        found = lm.comparison.SideBySide((*rows, lm.comparison.Row("dem", value, status="solved"))).findings()
        assert [line.partition(":")[0] for line in found] == [state]
