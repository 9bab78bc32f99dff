"""Types are checked over the whole library; no package hides errors."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOOL = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]


def test_the_whole_library_is_checked_strictly():
    assert set(TOOL["mypy"]["packages"]) == {"limitmason", "dem", "mechanisms"}
    assert TOOL["mypy"]["strict"]


def test_no_package_hides_errors():
    assert not any(o.get("ignore_errors") for o in TOOL["mypy"].get("overrides", []))
    assert TOOL["limitmason"]["type-debt"] == {}


def test_counts_are_compared_before_every_merge():
    lines = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert "mypy" in lines
    assert "python .ci/type_debt.py" in lines
