"""The page of the random panels: what is kept of a run, how stores are folded in, and that a run repeats."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from stochastic import page, plastic, rows, runs, tables

from limitmason import build, study
from limitmason.experiments import stochastic_brick_panels as published
from limitmason.model import Joint

PAGE = Path(__file__).parents[2] / "docs" / "papers" / "stochastic.md"


@pytest.fixture(scope="module")
def panel():
    return runs.PANEL.assembly()


def test_printed_spreads_are_read_as_the_decimals_they_are():
    # 5.8 / 100 in binary is 0.057999999999999996
    assert published.drawn(4)["friction angle"].variation == 0.058
    assert published.drawn(1)["poisson ratio"].variation == 0.067


def test_movement_without_mirror_image_is_zero_of_a_symmetric_one_and_one_of_one_side():
    area, opposite = np.array([1.0, 1.0, 2.0]), np.array([1, 0, 2])
    assert rows.lone(np.array([3.0, 3.0, 5.0]), area, opposite) == 0.0
    assert rows.lone(np.array([3.0, 0.0, 0.0]), area, opposite) == 1.0
    # 3 and 1 on both sides: 2 of 4 have no image
    assert rows.lone(np.array([3.0, 1.0, 0.0]), area, opposite) == pytest.approx(0.5)
    # a joint on the axis is its own image
    assert rows.lone(np.array([3.0, 1.0, 2.0]), area, opposite) == pytest.approx(0.25)
    assert np.isnan(rows.lone(np.zeros(3), area, opposite))


def test_every_joint_of_the_panel_has_an_opposite_one_of_equal_area(panel):
    opposite = rows.mirrored(panel)
    assert (opposite[opposite] == np.arange(len(opposite))).all()
    assert panel.arrays.area[opposite] == pytest.approx(panel.arrays.area, rel=1e-12)
    assert 0 < (opposite == np.arange(len(opposite))).sum() < 20
    lopsided = build.wall(length=0.7875, courses=4, unit=(0.225, 0.075, 0.1025), joint=Joint(30.0), start="whole")
    with pytest.raises(ValueError, match="not symmetric"):
        rows.mirrored(lopsided)


def test_newer_lines_take_the_place_of_older_ones_and_a_gap_ends_a_study():
    older = {"a": study.Table(({"sample": 0, "x": 1.0}, {"sample": 1, "x": 2.0})), "b": study.Table(({"sample": 0},))}
    newer = {"a": study.Table(({"sample": 1, "x": 5.0}, {"sample": 2, "x": 6.0}, {"sample": 4, "x": 7.0}))}
    both = rows.folded(older, newer)
    assert list(both["a"]["x"]) == [1.0, 5.0, 6.0]
    assert len(both["b"]) == 1


def test_a_store_cut_off_by_a_kill_gives_its_whole_lines(tmp_path, panel):
    joints = len(panel.interfaces)
    still, moved = [0] * joints, [0] * joints
    moved[0] = 7
    row = {"ultimate": 3e3, "at": 1e-3, "mode": "diagonal", "crack": None}
    row |= {f"{what} at {when}": still for what in ("opening", "slip") for when in ("peak", "end")}
    row["slip at peak"] = moved
    head = {"schema": "limitmason-runs", "of": "k"}
    lines = [json.dumps(head), json.dumps({"key": 0, "row": row}), '{"key": 1, "r']
    (tmp_path / "set1-spatial.jsonl").write_text("\n".join(lines), encoding="utf-8")
    (found,) = rows.from_stores(tmp_path, panel)["set1-spatial"]
    assert found["ultimate"] == 3e3
    assert found["lone"] == 1.0
    assert np.isnan(found["crack"])
    rows.write({"set1-spatial": study.Table((found,))}, tmp_path / "kept.csv")
    assert rows.read(tmp_path / "kept.csv")["set1-spatial"] == study.Table((dict(sorted_like(found)),))


def sorted_like(found):
    """A line in the order in which it is read back."""
    return [("sample", found["sample"]), *((k, found[k]) for k in (*rows.NUMBERS, *rows.WORDS))]


@pytest.mark.slow
def test_the_page_is_what_the_kept_lines_say():
    assert page.page(rows.read()) == PAGE.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_panel_that_falls_under_its_own_weight_carries_nothing_and_the_study_goes_on():
    # without strength the soldiers over the opening have nothing to hang on
    weak = {"tensile_strength": 0.0, "cohesion": 0.0, "friction_angle_deg": 5.0}
    wall = runs.PANEL.assembly().with_joints(lambda j: replace(j, **weak))
    assert runs.pushed(wall) is None
    found = runs.push(wall, None)
    assert (found["ultimate"], found["mode"]) == (0.0, runs.OWN_WEIGHT)
    line = rows.line(found, wall, rows.mirrored(wall))
    assert line["mode at peak"] == runs.OWN_WEIGHT
    assert np.isnan(line["lone"])
    # shares and spread count it
    kept = dict(rows.read())
    name = page.name_of(1, "non-spatial")
    kept[name] = study.Table((*kept[name], {**line, "sample": len(kept[name])}))
    gone = sum(r["ultimate"] == 0.0 for r in kept[name])
    assert f"set 1 non-spatial this holds for {gone} of {len(kept[name])} runs" in page.fallen(kept)
    assert "own weight 0." in tables.modes(kept)[2][1]


@pytest.mark.slow
def test_one_draw_for_all_spreads_as_the_root_of_the_sum_of_squares_of_its_slopes():
    # the known answer, for the runs of the page: log-slopes times spreads of what was drawn
    kept = rows.read()
    table = kept[page.name_of(4, "non-spatial")]
    stood = table["ultimate"].astype(float) > 0.0
    drawn = page.inputs(4, len(table))
    given = np.column_stack([drawn[n].astype(float) for n in ("tensile_strength", "friction_angle_deg")])[stood]
    peak = table["ultimate"].astype(float)[stood]
    slopes = np.linalg.lstsq(np.column_stack([np.ones(len(peak)), np.log(given)]), np.log(peak), rcond=None)[0][1:]
    first = np.hypot(*(slopes * given.std(axis=0, ddof=1) / given.mean(axis=0)))
    own = study.running(study.Table(tuple(r for r in table if r["ultimate"] > 0.0)), "ultimate")
    assert first == pytest.approx(own.variation[-1], rel=0.1)
    # linked strengths: cohesion goes with ft and with tan(phi)
    law = 2.0 * given[:, 0] * np.tan(np.radians(given[:, 1]))
    assert drawn["cohesion"].astype(float)[stood] == pytest.approx(law, rel=1e-12)
    assert f"{slopes[0]:.2f} for ft" in page.slopes(kept)


@pytest.mark.slow
def test_kept_lines_are_made_again_from_the_same_input():
    # a brittle peak moves by some per cent where a sum is rounded another way, as another processor may do (the pairs
    # of the page measure that), and by 18 % from draw to draw
    wall, n = (runs.PANEL.assembly(), plastic.unit_load), 6
    kept = rows.read()[page.name_of(4, "non-spatial")]["ultimate"][:n]
    drawn = runs.draws(4, False)
    found = study.monte_carlo(wall, n, run=runs.short_push, seed=1, scheme="random", **drawn)["ultimate"]
    assert np.corrcoef(found, kept)[0, 1] > 0.9
    assert np.abs(found / kept - 1.0).mean() < 0.06


@pytest.mark.slow
def test_perfect_plasticity_carries_more_than_brittle_joints_and_averages_over_the_joints():
    kept = rows.read()
    brittle, soft = kept["set4-spatial"], kept["plastic-spatial-associative"]
    for a, b in zip(soft, brittle, strict=False):
        assert a["sample"] == b["sample"]
        assert a["load"] > b["ultimate"] / 1e3
    wall = (runs.PANEL.assembly(), plastic.unit_load)
    again = study.monte_carlo(wall, 1, run=plastic.associative, seed=1, scheme="random", **runs.draws(4, True))
    assert again["load"][0] == pytest.approx(soft["load"][0], rel=1e-6)


def test_a_panel_that_is_too_slow_to_settle_is_a_run_without_an_answer_and_no_fall(panel):
    status = "no answer: the structure does not settle under its own weight in 50000 steps (unbalanced force 0.96 …)"
    kept = rows.line({"sample": 7, "status": status}, panel, rows.mirrored(panel))
    assert np.isnan(kept["ultimate"])
    assert kept["mode"] != runs.OWN_WEIGHT
