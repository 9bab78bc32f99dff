"""How the tests lie: each in the folder of its subject, none importing another, all collected."""

import ast
import re
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests"
MODULES = sorted(TESTS.rglob("test_*.py"))


def imported(text: str) -> set[str]:
    """Last names of the modules that a file of this text imports, wherever in it."""
    names = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {a.name.rpartition(".")[2] for a in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {(node.module or "").rpartition(".")[2], *(a.name for a in node.names)}
    return names


def test_every_test_stands_in_the_folder_of_its_subject():
    assert len(MODULES) > 60
    assert {path.name for path in TESTS.glob("*.py")} == {"conftest.py"}


def test_no_test_module_imports_another():
    tests = {path.stem for path in MODULES}
    texts = {path: path.read_text(encoding="utf-8") for path in TESTS.rglob("*.py")}
    guilty = {
        f"{path.relative_to(TESTS)} imports {name}"
        for path, text in texts.items()
        if not tests.isdisjoint(re.findall(r"\w+", text))  # what is imported is named
        for name in imported(text) & tests
    }
    assert guilty == set()


def test_what_tests_share_holds_no_test_of_its_own():
    for path in (TESTS / "builders").glob("*.py"):
        found = re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        assert not found, (path.name, found)


def test_every_test_module_is_collected(pytestconfig: pytest.Config):
    # a folder called like one that pytest leaves out by default ("build") would be passed over in silence
    left_out = pytestconfig.getini("norecursedirs")
    for path in MODULES:
        for folder in path.relative_to(ROOT).parts[:-1]:
            assert not any(fnmatch(folder, pattern) for pattern in left_out), path


def test_names_of_test_modules_and_builders_are_all_different():
    names = [path.stem for path in (*MODULES, *(TESTS / "builders").glob("*.py"))]
    assert sorted(names) == sorted(set(names))


def test_what_is_listed_as_slow_exists():
    listed = [line for line in (TESTS / "slow.txt").read_text(encoding="utf-8").split("\n") if line]
    assert listed == sorted(set(listed))
    for line in listed:
        file, _, test = line.partition("::")
        assert (TESTS / file).is_file(), line
        name = test.partition("[")[0]
        assert f"def {name}(" in (TESTS / file).read_text(encoding="utf-8") if name else True, line


def test_files_that_the_glossary_names_exist():
    named = re.findall(r"`([\w/]+\.py)`", (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8"))
    assert len(named) > 20
    for path in named:
        assert (ROOT / path).is_file(), path
