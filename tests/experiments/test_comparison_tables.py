"""Predictions beside published and measured values: rows, what is left out of them, and their table."""

import pytest

from limitmason import comparison, experiments
from limitmason.errors import InputError
from limitmason.experiments import experiment

FERRIS, MINHO = "ferris-tin-loi-2001", "minho-dry-stone-2005-2009"


def test_rows_keep_reference_prediction_and_ratio_and_share_one_solution():
    rows = comparison.run(experiments.load(FERRIS, "wall-1"), flow_rule="associative", kinds=experiment.KINDS)
    assert [(r.quantity, r.kind) for r in rows] == [
        ("associative", "published"),
        ("HybriDFEM associative", "published"),
        ("associative", "recomputed"),
    ]
    assert len({id(r.prediction) for r in rows}) == 1
    for r in rows:
        assert r.ratio == pytest.approx(r.predicted / float(r.reference))
        assert r.predicted == r.prediction.collapse_multiplier
        assert r.unit == "-"


def test_asked_flow_rule_leaves_out_what_was_computed_with_another():
    def quantities(**arguments):
        return {r.quantity for r in comparison.run(experiments.load(FERRIS, "wall-1"), **arguments)}

    associative = quantities(flow_rule="associative")
    assert associative == {"associative", "HybriDFEM associative"}
    assert quantities(flow_rule="associative", quantities=["associative"]) == {"associative"}
    assert quantities(flow_rule="associative", kinds="measured") == set()
    # a method that is a flow rule is held against values of that rule, as "limit" with the rule is
    assert quantities(method="associative") == associative
    assert quantities(method="non-associative", quantities=["associative"]) == set()
    with pytest.raises(InputError, match="flow_rule must be one of 'associative', 'non-associative', got 'nosuch'"):
        quantities(flow_rule="nosuch")
    with pytest.raises(InputError, match="cases must be a list"):
        comparison.table(experiments.load(FERRIS, "wall-1"))
    with pytest.raises(InputError, match="test must be an Experiment"):
        comparison.run("ferris-tin-loi-2001/wall-1")
    with pytest.raises(InputError, match="quantities must be one of .* got 'peak'"):
        quantities(quantities=["associative", "peak"])


def test_text_table_has_one_aligned_line_per_row():
    rows = comparison.table(
        [experiments.load(MINHO, "WS1.100"), experiments.load("pavia-tilting", "S1")], kinds="measured"
    )
    lines = comparison.as_text(rows).splitlines()
    assert len(lines) == 1 + len(rows) == 4
    assert lines[0].split()[0] == "experiment"
    assert "39 kN" in lines[1]
    assert "no assembly" in lines[3]
    start = lines[0].index("quantity")
    assert all(line[start - 1] == " " and line[start] != " " for line in lines)


def test_table_takes_cases_or_a_source():
    with pytest.raises(ValueError, match="either cases or source"):
        comparison.table([experiments.load(FERRIS, "wall-1")], source=FERRIS)
    assert comparison.table(source="pavia-tilting") == ()
    assert len(comparison.table(source="pavia-tilting", with_model=None)) == 36


def test_kinds_from_an_iterator_are_those_of_every_experiment():
    cases = [experiments.load("pavia-tilting", name) for name in ("S1", "S2")]
    rows = comparison.table(cases, kinds=iter(("measured",)))
    assert {r.specimen for r in rows} == {"S1", "S2"}
