"""Our own zoned runs of the BNW walls judged by their tests: the runs are those of the page, and BNW3 was left out."""

from pathlib import Path

import pytest

from validation import bnw_causes as causes

PAGE = Path(causes.__file__).parents[1] / "docs" / "papers" / "bnw.md"
ROWS = [[c.strip() for c in line.strip("|").split("|")] for line in PAGE.read_text(encoding="utf-8").splitlines()]


def test_the_runs_are_those_of_the_page():
    shown, wall = {}, ""
    for row in ROWS:
        if len(row) == 14 and row[0] in causes.WALLS:
            shown[row[0], causes.UNCRACKED if row[1] == "units yield" else causes.SLOWER] = row[2], row[3]
        elif len(row) == 8 and row[0] in causes.WALLS:
            wall = row[0]
        elif len(row) == 8 and wall and row[2].isdigit():
            shown[wall, row[0]] = row[2], row[4]
    for key, found in causes.RUNS.items():
        assert list(found.values()) == [float(v) for v in shown[key]]
    assert len(causes.RUNS) == 30


def test_a_run_is_met_at_its_own_inputs():
    base, strong = (causes.simulate({"wall": "BNW1"}, fc=f) for f in (1.0, 1.5))
    once = [causes.RUNS["BNW1", c]["peak"] for c in ("as assumed", "fc 1.5 times")]
    assert base["peak"] == pytest.approx(causes.RUNS["BNW1", causes.SLOWER]["peak"])
    assert strong["peak"] / base["peak"] == pytest.approx(once[1] / once[0])
    assert causes.simulate({"wall": "BNW3"}, uncracked=1.0)["peak"] == pytest.approx(
        causes.RUNS["BNW3", causes.UNCRACKED]["peak"]
    )


def test_strength_of_units_or_a_gain_is_kept_and_bnw3_comes_nearer():
    verdict = causes.study().diagnose(causes.CAUSES, seed=0)
    assert not verdict.identified
    assert verdict.kind == "either"
    assert set(verdict.causes) == {"gain", "strength of units"}
    size = verdict.verdict.tested[("strength of units",)].sizes[0]
    real = [v["peak"] for v in causes.measured("BNW3").values()]
    before, after = (causes.simulate({"wall": "BNW3"}, fc=f)["peak"] for f in (1.0, size))
    assert abs(after - sum(real) / 2) < 0.5 * abs(before - sum(real) / 2)
