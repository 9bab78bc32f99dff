"""The table of every packaged case by every theory: rows, references, refusals, and the page that shows it."""

import csv
from pathlib import Path

import every_case
import pytest
from every_case import ratio_span, references_for
from every_case.__main__ import main

import limitmason as lm
from limitmason.experiments.series import series_notes
from limitmason.storage.measured_table import MeasuredTable

DOCS = Path(__file__).resolve().parents[2] / "docs"
FERRIS, MINHO, WALLETTE = "ferris-tin-loi-2001", "minho-dry-stone-2005-2009", "rondelet-wallette"
QUICK = ("associative", "mechanisms")


@pytest.mark.slow
def test_every_packaged_specimen_is_in_the_table_or_listed_with_its_reason():
    shown = {(c.source, s) for c in every_case.cases() for s in c.specimens}
    listed = {(source, s) for source, names, reason in every_case.not_covered() for s in names if reason}
    every = {(t.source.name, t.specimen) for t in lm.experiments.all_cases()}
    assert shown | listed == every
    assert not shown & listed


def test_repeats_of_one_model_are_one_row_with_all_their_values():
    rows = every_case.cases(MINHO)
    assert sorted(s for c in rows for s in c.specimens) == sorted(lm.experiments.specimens(MINHO))
    # four levels of load on each of two walls; the walls are symmetric, so both senses of a cyclic test are one row
    assert len(rows) == 8
    assert sum(len(c.references) for c in rows) == 31
    cyclic = next(c for c in rows if "WS1.100" in c.specimens)
    assert cyclic.specimens == ("WS1.100", "WS2.100", "WS3.100", "WS4.100", "WS.100")


def test_published_values_stand_beside_answers_of_their_own_kind():
    sharp, rounded = every_case.cases(FERRIS, specimen="wall-3")
    labels = {m: [r.label for r in references_for(sharp, m)] for m in ("associative", "non-associative", "dem")}
    assert labels["associative"] == ["published associative"]
    assert labels["non-associative"] == labels["dem"] == ["published non-associative"]
    assert [r.label for r in references_for(rounded, "dem")] == ["published rounded LMGC90", "published rounded UDEC"]
    assert references_for(rounded, "associative") == ()
    plain, dilatant = every_case.cases(WALLETTE, specimen="toothed-odd-flush")
    assert [r.value for r in references_for(plain, "dem")] == [0.32]
    assert "published 3DEC zero dilatancy (derived)" in [r.label for r in references_for(plain, "dem")]
    assert [r.value for r in references_for(dilatant, "dem")] == [0.40]


def test_answers_ratios_page_and_csv(tmp_path):
    wanted = every_case.cases(FERRIS, specimen="wall-1")
    said = []
    found = every_case.solve_cases(wanted, QUICK, store=tmp_path / "store", progress=said.append)
    again = every_case.solve_cases(wanted, QUICK, store=tmp_path / "store", progress=said.append)
    assert sum("from the store" in line for line in said) == 2 * len(wanted)
    for case in wanted:
        assert again[case]["associative"].multiplier == found[case]["associative"].multiplier
    low, high = ratio_span(wanted[0], found[wanted[0]]["associative"])
    assert low == high == pytest.approx(0.64286 / 0.643, abs=1e-4)
    page = every_case.as_markdown(found, (("a source", ("one", "two"), "no plan"),), version="0")
    assert "| wall-1 | associative 0.643; non-associative 0.64 | 0.6429 × 1.00 |" in page
    assert "- a source one ... two (2): no plan." in page
    every_case.write_csv(found, tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 1 + len(wanted) * len(QUICK)
    assert float(lines[1]["ratio low"]) == pytest.approx(low, rel=1e-5)


def test_what_a_theory_does_not_cover_is_said(tmp_path):
    wanted = every_case.cases("mcmaster-bending", specimen="theta-90")
    page = every_case.as_markdown(every_case.solve_cases(wanted, QUICK), (), version="0")
    assert "does not apply" in page
    assert "- theta-90: not covered by mechanisms: no mechanism of the catalogue fits" in page


@pytest.mark.slow
def test_command_writes_page_and_csv(tmp_path):
    page, table = tmp_path / "page.md", tmp_path / "table.csv"
    command = ["--source", "bnw-walls", "--specimen", "BNW1", "--methods", *QUICK]
    main([*command, "--markdown", str(page), "--csv", str(table)])
    assert "EN 1996-1-1" in page.read_text(encoding="utf-8")
    assert "BNW1, friction 0.4, cohesion 0.2 MPa" in page.read_text(encoding="utf-8")


def test_several_workers_need_a_store():
    with pytest.raises(ValueError, match="give a folder"):
        every_case.solve_cases(every_case.cases(FERRIS, specimen="wall-1"), QUICK, workers=2)


# ---- the page in docs ------------------------------------------------------------------------------------------------


def documented():
    with (DOCS / "methods.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))[1:]


@pytest.mark.slow
def test_documented_associative_values_are_what_the_cases_give():
    shown = {(r["source"], r["specimens"], r["variant"]): r["value"] for r in documented() if r["method"] == QUICK[0]}
    wanted = [c for c in every_case.cases() if c.source in (FERRIS, MINHO, WALLETTE)]
    for case, result in every_case.solve_cases(wanted, QUICK[:1]).items():
        value = result["associative"].multiplier * float(case.test.multiplier_to_measured)
        assert float(shown[case.source, " ".join(case.specimens), case.variant]) == pytest.approx(value, rel=1e-4)


def test_documented_orders_hold_and_every_dem_answer_outside_has_its_explanation():
    page = (DOCS / "methods.md").read_text(encoding="utf-8")
    assert "BROKEN" not in page
    assert "NOT EXPLAINED" not in page
    outside = [r for r in documented() if r["DEM is"] not in ("", "inside")]
    for row in outside:
        assert f"the DEM lies {row['DEM is']}" in page
    values = {(r["source"], r["specimens"], r["variant"], r["method"]): r for r in documented() if r["value"]}
    pairs = 0
    for (*case, method), row in values.items():
        if method == "non-associative":
            upper = float(values[*case, "associative"]["value"])
            assert float(row["value"]) <= upper * (1 + 1e-5), case
            pairs += 1
    assert pairs >= 20


def test_what_sources_leave_open_is_said_of_every_specimen_whatever_their_order():
    """Force height is open for SW walls, friction for WS walls: the last specimen alone was asked before."""
    for names in (("WS1.100", "SW.30.1"), ("SW.30.1", "WS1.100")):
        table = MeasuredTable("walls", {"specimen": "-"}, {"specimen": names}, (1, 2))
        left_open = [note for note in series_notes(MINHO, table, ()) if "leave" in note]
        assert sorted(note.split()[3] for note in left_open) == ["force_height", "friction"]
        assert all(note.endswith("(For 1 of the specimens.)") for note in left_open)
        assert not [note for note in series_notes(MINHO, table, ("friction", "force_height")) if "leave" in note]
