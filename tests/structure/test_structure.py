"""The arrows of the design: layers, light imports, and public names that exist."""

import ast
import importlib
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import limitmason as lm

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(not (ROOT / "pyproject.toml").exists(), reason="needs the source tree")
def test_import_contracts_hold():
    code = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports(no_cache=True))"
    source = {**os.environ, "PYTHONPATH": str(ROOT)}  # of the source tree, whatever is installed
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=source, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr


def test_import_is_light():
    # counted, not timed: numpy is all that is loaded from outside, and what draws or solves waits until it is asked
    code = "import sys, limitmason; print(*sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    outside = {m.partition(".")[0] for m in out} - set(sys.stdlib_module_names)
    assert not outside & {"cvxpy", "matplotlib", "clarabel", "numba", "scipy", "skfem", "joblib", "highspy", "tqdm"}
    assert sum(m.startswith("limitmason") for m in out) < 80


@pytest.mark.parametrize("name", lm.__all__)
def test_public_name_exists_and_is_documented(name):
    assert getattr(lm, name).__doc__


def test_the_other_packages_import():
    for name in ("dem", "mechanisms"):
        assert importlib.import_module(name).__doc__


def test_dem_and_mechanisms_are_at_hand_and_wait_until_they_are_asked_for():
    code = (
        "import sys, limitmason as lm; before = {'dem', 'mechanisms'} & set(sys.modules); "
        "import dem, mechanisms; print(before, lm.dem is dem, lm.mechanisms is mechanisms)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    assert out == "set() True True"


def test_unknown_attribute_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'limit_anlysis'"):
        lm.limit_anlysis  # noqa: B018


def test_no_class_name_is_used_twice():
    found: dict[str, list[str]] = {}
    roots = [Path(importlib.import_module(package).__file__).parent for package in ("limitmason", "dem", "mechanisms")]
    texts = {str(p.relative_to(r.parent)): p.read_text(encoding="utf-8") for r in roots for p in r.rglob("*.py")}
    words = {path: re.findall(r"\bclass\s+(\w+)", text) for path, text in texts.items()}  # those of comments too
    assert sum(len(names) for names in words.values()) > 100
    often = {name for name, count in Counter(n for names in words.values() for n in names).items() if count > 1}
    for path, text in texts.items():
        for node in ast.walk(ast.parse(text)) if often & set(words[path]) else ():
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(path)
    assert {name: places for name, places in found.items() if len(places) > 1} == {}
