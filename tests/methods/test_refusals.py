"""What a method may raise: a refusal is a row, a run without an answer too, everything else comes through."""

import ast
import sys
from pathlib import Path

import pytest

import dem
import limitmason as lm
import mechanisms
from limitmason.comparison import compare
from limitmason.errors import InputError, NotApplicable, NotConverged

PACKAGES = ("limitmason", "dem", "mechanisms")


def wall(**joint):
    return lm.build.wall(length=0.4, courses=2, unit=(0.2, 0.1, 0.1), joint=lm.Joint(33.0, **joint))


def method_that(monkeypatch, error):
    """Let the name "other" stand for a method that raises."""

    def other(assembly, loads):
        raise error

    monkeypatch.setattr(sys.modules[__name__], "OTHER", other, raising=False)
    monkeypatch.setitem(lm.methods.METHODS, "other", f"{__name__}:OTHER")
    structure = wall()
    return structure, lm.Loads.horizontal(structure), ("associative", "other")


def test_a_refusal_is_a_row_with_its_reason(monkeypatch, tmp_path):
    found = compare(*method_that(monkeypatch, NotApplicable("no vaults")), store=tmp_path)
    assert found["associative"].solved
    assert (found["other"].refusal, found["other"].solved) == ("no vaults", False)
    # a second call reads it from the store
    again = compare(*method_that(monkeypatch, AssertionError("was called again")), store=tmp_path)
    assert again["other"].status == "does not apply: no vaults"


def test_a_run_without_an_answer_is_a_row_and_no_refusal(monkeypatch):
    row = compare(*method_that(monkeypatch, NotConverged("lost at step 7")))["other"]
    assert row.status == "no answer: lost at step 7"
    assert (row.refusal, row.solved) == (None, False)


@pytest.mark.parametrize("error", [ValueError("operands"), InputError("friction"), ZeroDivisionError("by zero")])
def test_a_mistake_and_wrong_input_come_through_compare(monkeypatch, error):
    with pytest.raises(type(error)) as caught:
        compare(*method_that(monkeypatch, error))
    assert caught.value is error


@pytest.mark.parametrize("error", [ValueError("operands"), InputError("friction")])
def test_a_mistake_and_wrong_input_come_through_the_catalogue(monkeypatch, error):
    def broken(*_, **__):
        raise error

    monkeypatch.setattr(sys.modules["mechanisms.catalogue"], "sliding", broken)
    structure = wall()
    with pytest.raises(type(error)) as caught:
        mechanisms.catalogue(structure, lm.Loads.horizontal(structure))
    assert caught.value is error


def test_a_refusal_of_one_mechanism_is_named_by_the_catalogue(monkeypatch):
    def refusing(*_, **__):
        raise NotApplicable("too steep")

    monkeypatch.setattr(sys.modules["mechanisms.catalogue"], "sliding", refusing)
    structure = wall()
    found, skipped = mechanisms.catalogue(structure, lm.Loads.horizontal(structure))
    assert "overturning" in found
    assert "sliding" not in found
    assert "sliding left out: too steep" in skipped


def test_a_mistake_inside_a_proven_range_comes_through(monkeypatch):
    def broken(*_, **__):
        raise ValueError("operands")

    monkeypatch.setattr("limitmason.comparison.comparing.proven_range", broken)
    structure = wall()
    with pytest.raises(ValueError, match="operands"):
        compare(structure, lm.Loads.horizontal(structure), ("non-associative",), proven=1.0,
                non_associative={"search": "quick"})


def test_what_the_dem_refuses_others_take():
    structure = wall(normal_stiffness=1e9, shear_stiffness=0.0)
    found = compare(structure, lm.Loads.horizontal(structure), ("associative", "dem", "pushover"))
    assert found["associative"].solved
    for method in ("dem", "pushover"):
        assert "shear_stiffness 0" in found[method].refusal


def test_no_method_takes_a_structure_of_which_every_block_is_held():
    structure = wall()
    supports = [lm.Support(k, translations=True, rotations=True) for k in range(structure.n_blocks)]
    held = structure.with_supports(supports)
    loads = lm.Loads.horizontal(structure)
    for method in lm.methods.COMPARED_METHODS:
        with pytest.raises(InputError, match="there is nothing to"):
            lm.predict(held, loads, method)
    with pytest.raises(InputError, match="there is nothing to"):
        lm.predict(held, loads, "pushover")


def test_every_error_has_its_place():
    assert issubclass(lm.ContactError, InputError)
    assert issubclass(dem.UnstableError, NotConverged)
    assert issubclass(dem.UnstableError, RuntimeError)  # as in 0.1
    kinds = (InputError, NotApplicable, NotConverged)
    assert all(issubclass(kind, ValueError) for kind in kinds)
    assert not any(issubclass(a, b) for a in kinds for b in kinds if a is not b)


def test_no_plain_value_error_is_raised_by_the_library():
    plain = []
    for package in PACKAGES:
        folder = Path(sys.modules[package].__file__).parent
        for path in folder.rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            for node in ast.walk(ast.parse(text)) if "ValueError" in text or "RuntimeError" in text else ():
                name = node.func if isinstance(node, ast.Call) else node.exc if isinstance(node, ast.Raise) else None
                if isinstance(name, ast.Name) and name.id in ("ValueError", "RuntimeError"):
                    plain.append(f"{path.name}:{node.lineno}")
    assert not plain


def test_a_refused_experiment_is_a_row_of_the_table_and_a_mistake_is_not(monkeypatch):
    def refusing(assembly, loads):
        raise NotApplicable("no walls")

    def broken(assembly, loads):
        raise ValueError("operands")

    this = sys.modules[__name__]
    monkeypatch.setitem(lm.methods.METHODS, "other", f"{__name__}:OTHER")
    monkeypatch.setattr(this, "OTHER", refusing, raising=False)
    rows = lm.comparison.table(source="ferris-tin-loi-2001", method="other")
    assert rows
    assert {row.refusal for row in rows} == {"no walls"}
    assert "does not apply: no walls" in lm.comparison.as_text(rows)
    monkeypatch.setattr(this, "OTHER", broken)
    with pytest.raises(ValueError, match="operands"):
        lm.comparison.table(source="ferris-tin-loi-2001", method="other")
