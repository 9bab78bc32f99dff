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


def test_pages_and_examples_use_names_that_exist():
    lines = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert "mypy" in lines
    assert "mypy --config-file .ci/commands.ini" in lines
