"""Runs of the panels with an opening, on several paths to one answer, and the page that is made of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from brick_panels import bricks, onset, page, residual, runs, slopes
from opened_panels import NAME, elastic, load

import dem
import limitmason as lm
from limitmason.deformable.levels import SIMPLY_DEFORMABLE
from limitmason.errors import InputError
from limitmason.experiments.source_folder import read_table
from validation.kept_runs import with_section


@pytest.fixture(scope="module")
def fingerprint():
    return elastic(load("udec-01"))


def superposed(blocks, names=onset.STRENGTHS, **options):
    return runs.Runs(None, None).onsets(names, blocks=blocks, **options)


@pytest.mark.slow
def test_first_failure_rises_with_the_tensile_strength_as_printed_where_bricks_deform(fingerprint):
    lag = {}
    for blocks in ("lumped", "ritz"):
        found = np.array(superposed(blocks).opening)
        # target: the printed 19.4 kN/MPa within 15 %
        assert (found[2] - found[0]) / 0.10 == pytest.approx(19.4, rel=0.15)
        lag[blocks] = onset.TYPICAL - found
    # independent finite elements on 37.5 mm zones: 0.00, 0.98 and 1.96 kN
    assert found == pytest.approx([0.0, 0.98, 1.96], abs=0.05)
    assert (found[2] - found[0]) / 0.10 == pytest.approx(19.4, rel=0.05)
    # the source finds it later, bricks that deform by the same load for every strength
    assert (lag["ritz"] > 0.0).all()
    assert np.ptp(lag["ritz"]) < 0.1
    assert np.ptp(lag["lumped"]) > 0.1
    # the matrix of the DEM's own state says the same of lumped ones
    assert np.array(superposed("lumped").opening) == pytest.approx(fingerprint[1], abs=1e-9)


@pytest.mark.slow
def test_runs_that_print_another_first_crack_than_the_rest_of_their_strength_are_those_that_slip_first():
    rows = read_table(NAME, "udec_runs.csv").rows
    found = superposed("lumped", [r["specimen"] for r in rows])
    early = {r["specimen"] for r, o, s in zip(rows, found.opening, found.slip, strict=True) if s < o}
    rest = dict(zip(onset.FT, onset.TYPICAL, strict=True))
    # by more than the last digit
    away = {r["specimen"] for r in rows if abs(float(r["V_first_crack"]) - rest[float(r["tension"])]) > 0.015}
    assert away == early == {f"udec-{k:02d}" for k in (4, 7, 13, 16, 17)}


@pytest.mark.slow
def test_panel_whose_own_weight_statics_bears_bears_it_in_the_driven_run_too(fingerprint):
    assert fingerprint[1][0] > 0.0
    answer = runs._pushed("udec-01", runs.Push(True, 7e-5, 10_000, "lumped", 0), {})
    assert answer.settlement == pytest.approx(fingerprint[0][0], rel=1e-3)
    assert answer.first == pytest.approx(fingerprint[1][0], abs=0.01)


def test_page_finds_the_exponents_that_a_power_law_was_made_with():
    rows = read_table(NAME, "udec_runs.csv").rows
    mu = np.tan(np.radians([float(r["friction"]) for r in rows]))
    c, ft = (np.array([float(r[k]) for r in rows]) for k in ("cohesion", "tension"))
    exponents, errors = slopes.log_slopes(rows, 3.0 * mu**0.6 * c**0.8 * ft**0.2)
    assert exponents == pytest.approx([0.6, 0.8, 0.2])
    assert errors == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    # of the loads printed, without run 13: as the issue states them
    printed = np.array([float(r["V_failure"]) for r in rows])
    exponents, errors = slopes.log_slopes(rows, printed)
    assert exponents == pytest.approx([0.64, 0.75, 0.25], abs=0.01)
    # exponent of c and its error by Frisch and Waugh: what c has that the others have not, against the same of the load
    keep = np.array([r["specimen"] != "udec-13" for r in rows])
    others = np.column_stack([np.ones(17), np.log(mu[keep]), np.log(ft[keep])])
    alone, load_ = (v - others @ np.linalg.lstsq(others, v, rcond=None)[0] for v in np.log((c[keep], printed[keep])))
    slope = alone @ load_ / (alone @ alone)
    left = load_ - slope * alone
    assert exponents[1] == pytest.approx(slope)
    assert errors[1] == pytest.approx(np.sqrt(left @ left / (17 - 4) / (alone @ alone)))


def test_interval_of_two_medians_holds_as_often_as_it_says():
    random = np.random.default_rng(7)
    for n, ratio in bricks.MEDIAN_OF.items():
        assert np.median(random.normal(size=(200_000, n)), axis=1).std() == pytest.approx(ratio, rel=0.01)
    true = np.array([0.0, 0.0, 0.1, -0.1, 0.05, 0.0, 0.02])
    tries = [bricks.changes(9.0 * np.exp(true[:, None] + 0.05 * random.normal(size=(7, 5)))) for _ in range(1000)]
    held = np.mean([np.abs(c - true)[1:] < w for c, w in tries])
    assert held == pytest.approx(0.95, abs=0.015)


def test_perturbed_start_moves_every_brick_by_a_trifle_in_the_plane_and_no_joint():
    wall = load("udec-09").assembly()
    assert runs.nudged(wall, 0) is wall
    moved, again, other = (runs.nudged(wall, seed) for seed in (1, 1, 2))
    shift = moved.centroids - wall.centroids
    # centroids are known to the rounding of the coordinates
    assert np.abs(shift).max() <= 1.001 * runs.NUDGE
    assert np.abs(shift[:, [0, 2]]).max(axis=0).min() > 0.9 * runs.NUDGE
    assert np.abs(shift[:, 1]).max() < 1e-4 * runs.NUDGE
    assert (moved.centroids == again.centroids).all()
    assert (moved.centroids != other.centroids).any()
    assert (moved.arrays.centre == wall.arrays.centre).all()


def test_runs_of_another_level_start_or_pace_are_kept_apart(tmp_path, monkeypatch):
    asked = []

    def pushed(specimen, push, options):
        asked.append((specimen, *push))
        return runs.Answer(float(len(asked)), *[0.0] * 7, "", "", 37.5, "")

    monkeypatch.setattr(runs, "_pushed", pushed)
    known = runs.Runs(tmp_path, None)
    calls = [
        {}, {"blocks": SIMPLY_DEFORMABLE}, {"seed": 1}, {"blocks": SIMPLY_DEFORMABLE, "seed": 1}, {"steps": 45_000},
        {"once": True}, {"to": 3e-4}, {"outline": "675/8/5"}, {"start": "half"}, {"crack": 9},
    ]
    first = [known("udec-09", **c).peak for c in calls]
    assert len(set(first)) == len(calls)
    assert [runs.Runs(tmp_path, None)("udec-09", **c).peak for c in calls] == first
    assert asked[3] == ("udec-09", False, runs.TRAVEL, runs.STEPS, SIMPLY_DEFORMABLE, 1, 0)
    # a key says the call, and ends with the fingerprint of the panel and of what computes it
    assert sum(key.startswith('["udec-09", false, 0.0013, 15000, {}, "') for key in known.memo.rows) == 1


def one_sided(panel, more=1.02):
    """The panel with stronger joints in one half: of a symmetric one the last digits say which side breaks first."""
    middle = np.mean([i.polygon[:, 0].mean() for i in panel.interfaces])
    return panel.with_interfaces([
        replace(i, joint=replace(i.joint, tensile_strength=more * i.joint.tensile_strength,
                                 cohesion=more * i.joint.cohesion)) if i.polygon[:, 0].mean() > middle else i
        for i in panel.interfaces
    ])


# a hasty drive breaks other joints: at 12000 steps that of lumped bricks is 2.5 % low from 56 um on
@pytest.mark.slow
@pytest.mark.parametrize(("blocks", "steps"), [("lumped", 36_000), (SIMPLY_DEFORMABLE, 24_000)])
def test_driven_panel_breaks_as_the_path_without_rate_does(blocks, steps):
    # the two share the law and the points and nothing else: one integrates motion, the other solves for equilibrium
    test, to = load("udec-14"), 1e-4
    points = {"contact_model": "grid", "grid": runs.SPACING, "contacts": "first"}
    panel = one_sided(test.assembly())
    free = lm.pushover(panel, test.loads(), control=("spreader", "z"), to=-to, blocks=blocks, **points)
    driven = dem.push(panel, test.drive(), to=to, blocks=blocks, steps=steps, rate_check=False)
    assert driven.first_failure.load == pytest.approx(1e3 * free.load[free.breaks[0].sample - 1], rel=0.01)
    assert sum(b.points for b in free.breaks) > 30
    # behind a break the driven panel still swings, longest behind the first: it is looked at 4 um later, and as the
    # median over 2 um
    breaks = np.array([abs(free.displacement[b.sample]) for b in free.breaks])
    at = 1e-6 * np.arange(34.0, 96.0, 1.0)
    u, force = np.abs(free.displacement), 1e3 * free.load
    held = np.array([np.median(driven.load[np.abs(driven.displacement - v) < 1e-6]) for v in at])
    calm = np.array([not ((breaks > v - 4e-6) & (breaks < v + 1e-6)).any() for v in at])
    ratio = held / np.interp(at, u, force)
    assert calm.sum() > 8
    assert ratio[calm] == pytest.approx(1.0, abs=0.006)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.003)


@pytest.mark.slow
def test_zoned_bricks_are_as_stiff_as_elastic_ones_condensed_to_the_same_points():
    known, strong = runs.Runs(None, None), {"cohesion": 1e7, "tensile_strength": 1e7}
    lumped, simple, elastic = (
        known.rate_free("udec-09", blocks=b, to=2e-5, **strong).stiffness for b in ("lumped", SIMPLY_DEFORMABLE, "ritz")
    )
    zoned = known("udec-09", once=True, to=2e-5, steps=12_000, blocks="zoned", **strong).stiffness
    assert zoned == pytest.approx(elastic, rel=0.01)
    # fewer shapes are stiffer
    assert lumped < simple < elastic
    assert simple == pytest.approx(zoned, rel=0.05)


def test_panel_is_cracked_at_the_ends_of_one_bed():
    panel = load("udec-10").assembly()
    assert runs.cracked(panel, 0) is panel
    for course in (8, 9):
        # eight half-laps across both piers, the soldiers between them stand on none
        weak = [i for i in runs.cracked(panel, course).interfaces if i.joint.name == "cracked"]
        ends = sorted(float(i.polygon[:, 0].mean()) for i in weak)
        assert len(weak) == 2
        assert ends[1] - ends[0] > 3.3
        for i in weak:
            assert i.kind == "bed"
            assert i.joint.cohesion == i.joint.tensile_strength == 0.0
            assert i.polygon[:, 2] == pytest.approx(0.075 * course)
    with pytest.raises(InputError, match="no bed joint above course 15"):
        runs.cracked(panel, 15)


def test_a_run_of_zones_is_given_up_where_little_is_left_for_long_and_not_at_a_drop():
    def stopped(loads):
        over = runs._gives_up()
        return [over({"displacement": 0.8e-4 * k, "load": v}) for k, v in enumerate(loads)]

    # a drop to a fifth that recovers; half of the largest is enough to go on
    assert not any(stopped([0.0, 1.0, 5.0, 1.0, 1.0, 1.0, 2.5, 1.0, 1.0, 5.0]))
    assert stopped([0.0, 5.0, 2.4, 2.4, 2.4, 2.4]) == [False] * 5 + [True]


def test_the_largest_load_up_to_a_displacement_is_of_the_curve_that_was_kept():
    u = np.array([0.0, 0.5, 1.0, 1.25, 2.0]) * 1e-4
    kept = runs.kept_loads(u, np.array([0.0, 5e3, 2e3, 8e3, 1e3]))
    assert len(kept) == 21
    assert kept[5] == 5.0
    answer = runs.Answer(8.0, 0.125, *[0.0] * 6, "", "", 37.5, "", kept)
    assert answer.largest_until(0.04) == pytest.approx(4.0)
    assert answer.largest_until(0.11) == 5.0
    # the peak lies between two of the loads kept
    assert answer.largest_until(0.13) == 8.0


@pytest.mark.slow
def test_run_10_is_the_same_by_zones_and_modes_once_its_crack_is_chosen():
    """Two bed joints reach their strength within a hundredth of each other: the one that is first decides.

    Above 8 zoned bricks fall at .16 mm and 3.23 kN (3.21 at half the speed, 3.22 to 3.24 over three starts, 3.45 as a
    running median with zones half as large), Ritz ones without rate at .163 mm and 3.41 kN. Simply deformable bricks
    have too few shapes to follow: without rate they carry 4.33 kN above 8 and 4.36 above 9, driven 4.5 and 4.8. So the
    two cracks are compared by zones.
    """
    known, peaks = runs.Runs(None, None), {}
    # simply deformable runs fork at rounding, one start of three to 4.4 kN: the median of three, of the largest loads
    # up to .33 mm
    cases = ((8, "zoned", 1e8, (1,)), (9, "zoned", 1e8, (1,)), (9, SIMPLY_DEFORMABLE, 7e7, (1, 2, 3)))
    for course, blocks, pace, starts in cases:
        push = dict(once=True, to=3.3e-4, steps=round(pace * 3.3e-4), blocks=blocks)
        found = [known("udec-10", crack=course, seed=k, **push) for k in starts]
        peaks[course, blocks] = np.median([f.peak for f in found])
        # zoned panels have fallen: a push that ended before would compare where it ended
        assert blocks == SIMPLY_DEFORMABLE or found[0].at_peak < 0.325
    # the target for single brittle runs
    assert peaks[9, SIMPLY_DEFORMABLE] == pytest.approx(peaks[9, "zoned"], rel=0.12)
    assert min(peaks[9, SIMPLY_DEFORMABLE], peaks[9, "zoned"]) > 1.2 * peaks[8, "zoned"]


@pytest.mark.slow
def test_page_goes_on_from_what_was_kept(tmp_path, monkeypatch):
    said = []
    numbers = (1.0, 0.5, 0.2, 0.01, float("nan"), 0.03, 0.02, 0.01)
    answer = runs.Answer(*numbers, "diagonal", "lost in failure: x", 37.5, "a joint")
    monkeypatch.setattr(runs, "_pushed", lambda *_: answer)
    monkeypatch.setattr(runs, "_followed", lambda *_: answer)
    same = runs.Onsets([1.0] * 18, [2.0] * 18, "a joint", 0.03, 0.02)
    monkeypatch.setattr(
        runs, "_superposed",
        lambda names, *_: replace(same, opening=same.opening[: len(names)], slip=same.slip[: len(names)]),
    )
    text = page.page(store=tmp_path, progress=said.append)
    assert len(said) > 100
    for words in (
        "three levels", "Rate-free", "First failure, without rate", "Properties of the bricks",
        "inferred, not published", "Table 2", "Table 3", "Table 4", "L1 is an open case",
    ):
        assert words in text
    again = []
    assert page.page(store=tmp_path, progress=again.append) == text
    assert again == []


def test_a_section_of_the_page_is_written_anew_and_the_others_stay():
    text = "# T\n\nfirst\n\n## one\n\n1\n\n## two\n\n2\n"
    added = with_section(text, ["## new", "", "3", ""])
    assert added == "# T\n\nfirst\n\n## one\n\n1\n\n## new\n\n3\n\n## two\n\n2\n"
    assert with_section(added, ["## new", "", "4", ""]) == added.replace("3", "4")


def test_the_page_has_the_section_of_the_set_as_printed():
    text = "\n".join(residual.section(read_table(NAME, "udec_runs.csv").rows))
    shown = (Path(page.__file__).parents[2] / "docs" / "papers" / "panels.md").read_text(encoding="utf-8")
    assert text.strip() in shown


@pytest.mark.slow
def test_grid_of_strengths_lies_in_the_window_about_the_printed_loads():
    ratio = []
    for row in read_table(NAME, "udec_runs.csv").rows:
        test = load(row["specimen"])
        curve = dem.push(test.assembly(), test.drive(), to=1.3e-3, blocks="lumped", steps=10_000, rate_check=False)
        ratio.append(np.log(1e-3 * curve.peak.load / float(row["V_failure"])))
    assert 0.85 < np.exp(np.mean(ratio)) < 1.3
