"""The two readings of the random panels: stores read back, noise taken out, and when a pair meets the print."""

import json

import numpy as np
import pytest
from walls import bonded_stack

import limitmason as lm
from limitmason import study
from validation.stochastic import readings_page as page
from validation.stochastic import rows
from validation.stochastic.readings import KEPT, SHARING
from validation.stochastic.tables import printed


def strength(assembly, loads):
    """Of the first joint."""
    return {"ultimate": assembly.interfaces[0].joint.tensile_strength}


def lines_of(sharing, kept, peaks, again="0", number=4):
    places = dict.fromkeys(page.PLACES, "")
    return [
        {"set": f"{number}", "drawn": sharing, "keeps": f"{kept:g}", "again": again, "sample": f"{k}",
         "ultimate": f"{v}", "at": "900", "left": "0.5", "most": page.PLACES[0], **places, page.PLACES[0]: "100"}
        for k, v in enumerate(peaks)
    ]


def spread(mean, variation, n=400):
    """Peaks with a mean and a CoV [%] to the digit."""
    z = np.random.default_rng(3).normal(size=n)
    z = (z - z.mean()) / z.std(ddof=1)
    return mean * (1.0 + 0.01 * variation * z)


def test_a_store_is_read_back_without_the_line_that_a_kill_cut_off(tmp_path):
    path = tmp_path / "one.jsonl"
    draw = study.Random(study.normal(4e4, 0.2), per="assembly")
    made = study.monte_carlo(
        (bonded_stack(2, 1e5), lm.Loads.weight), 3, run=strength, joints={"tensile_strength": draw}, scheme="random",
        store=path,
    )
    with path.open("a") as file:
        file.write('{"key": 3, "row": {"ulti')
    assert [r["ultimate"] for _, r in sorted(rows.read_store(path).items())] == list(made["ultimate"])


def test_a_folder_adds_to_what_is_kept_and_replaces_its_own_samples(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "LINES", tmp_path / "lines.csv")
    monkeypatch.setattr(page, "CURVES", tmp_path / "curves.csv")
    for folder, number, peaks in (("a", 4, (3e3, 4e3)), ("b", 3, (5e3,)), ("c", 4, (6e3,))):
        name = f"{page.name_of(number, SHARING[1], 0.1)}.jsonl"
        (tmp_path / folder).mkdir()
        lines = (json.dumps({"key": k, "row": {"sample": k, "ultimate": v, "at": 0.0}}) for k, v in enumerate(peaks))
        (tmp_path / folder / name).write_text("\n".join(["{}", *lines, ""]))
        page.fold(tmp_path / folder)
    kept = [(r["set"], r["sample"], float(r["ultimate"])) for r in page.read(page.LINES)]
    assert kept == [("4", "0", 6e3), ("4", "1", 4e3), ("3", "0", 5e3)]


def test_noise_of_a_run_is_taken_out_of_a_spread():
    # pairs that differ by 4 % up or down have a noise of 4 / sqrt(2) %: 10 % less that is sqrt(100 - 8)
    peaks = spread(3e3, 10.0)
    moved = peaks[:40] * (1.0 + 0.04 * np.where(np.arange(40) % 2, 1.0, -1.0))
    cell = page.Cell([*lines_of(SHARING[1], 0.1, peaks), *lines_of(SHARING[1], 0.1, moved, "1")], 4, SHARING[1], 0.1)
    assert cell.raw == pytest.approx(0.10)
    assert cell.noise == pytest.approx(0.04 / np.sqrt(2.0), rel=1e-3)
    assert cell.variation == pytest.approx(np.sqrt(0.0092), rel=1e-3)


def test_a_pair_meets_the_print_only_with_both_spreads_and_the_shift():
    (mean_a, cov_a), (mean_b, cov_b) = (printed(4, k) for k in ("spatial", "non-spatial"))

    def said(spatial, single, level=0.7, shifted=1.0):
        lines = []
        for kept in KEPT:
            lines += lines_of(SHARING[1], kept, spread(1e3 * level * shifted * mean_a, spatial))
            lines += lines_of(SHARING[2], kept, spread(1e3 * level * mean_b, single))
        return page.verdict(lines)

    assert "4 pairs meet" in said(cov_a, cov_b)  # the level is no part of it
    for other in (said(0.5 * cov_a, cov_b), said(cov_a, 1.5 * cov_b), said(cov_a, cov_b, shifted=0.85)):
        assert "No pair meets" in other


def test_breaks_count_sides_and_corners():
    rest = spread(3e3, 10.0, 10)
    lines = lines_of(SHARING[0], 0.0, rest)
    for k, line in enumerate(lines):
        line["left"] = "0.7" if k < 3 else "0.3" if k < 4 else "0.5"
        line[page.PLACES[-1]] = "800" if k < 2 else "1000"  # before and behind the peak at 900
    (row,) = page.breaks(lines)[1:]
    assert row[2:4] == ["30, 60, 10", "20"]
