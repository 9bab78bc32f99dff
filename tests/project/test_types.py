"""Types are checked over the whole library; packages with errors have a number of them, which ``.ci/run`` compares."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOOL = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]


def test_the_whole_library_is_checked_strictly():
    assert set(TOOL["mypy"]["packages"]) == {"limitmason", "dem", "mechanisms"}
    assert TOOL["mypy"]["strict"]


def test_no_package_hides_errors_without_a_number():
    hidden = {m.removesuffix(".*") for o in TOOL["mypy"]["overrides"] if o.get("ignore_errors") for m in o["module"]}
    debt = TOOL["limitmason"]["type-debt"]
    assert hidden == set(debt)
    assert all(number > 0 for number in debt.values())


def test_counts_are_compared_before_every_merge():
    lines = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert "mypy" in lines
    assert "python .ci/type_debt.py" in lines
