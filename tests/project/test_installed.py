"""The package as it is installed: where it is imported from, what the wheel carries, and one version number."""

import importlib
import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

import limitmason as lm

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("limitmason", "dem", "mechanisms")
INSTALLED_IN = os.environ.get("LIMITMASON_INSTALLED_IN", "")
"""Folder of the environment in which the wheel was installed, set where the wheel and not the checkout is tested."""

only_installed = pytest.mark.skipif(not INSTALLED_IN, reason="LIMITMASON_INSTALLED_IN does not name an environment")


def shipped() -> set[str]:
    """What belongs into the wheel: every file of the packages but what running them leaves behind."""
    return {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@only_installed
@pytest.mark.parametrize("name", PACKAGES)
def test_the_installed_package_is_tested_and_not_the_checkout(name):
    here = Path(importlib.import_module(name).__file__).resolve()
    assert here.is_relative_to(Path(INSTALLED_IN).resolve())
    assert not here.is_relative_to(ROOT)


@only_installed
def test_processes_that_tests_start_take_the_installed_package_too():
    code = "import limitmason, dem, mechanisms; print(limitmason.__file__, dem.__file__, mechanisms.__file__)"
    out = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for path in out.split():
        assert Path(path).resolve().is_relative_to(Path(INSTALLED_IN).resolve()), path


@only_installed
def test_every_file_of_the_packages_is_installed():
    files = {Path(f).as_posix() for f in distribution("limitmason").files}
    assert shipped() <= files
    # and nothing else goes to the top of site-packages
    tops = {f.split("/")[0] for f in files if not f.startswith("..")}
    assert {t for t in tops if not t.endswith(".dist-info")} == set(PACKAGES)


@only_installed
def test_licence_citation_and_type_markers_are_installed():
    files = {Path(f).as_posix() for f in distribution("limitmason").files}
    assert any(re.fullmatch(r"limitmason-[^/]*\.dist-info/licenses/LICENSE", f) for f in files)
    assert {f"{package}/py.typed" for package in PACKAGES} <= files
    assert "limitmason/CITATION.cff" in files


def test_packages_declare_that_they_are_typed():
    for package in PACKAGES:
        assert (ROOT / package / "py.typed").read_text(encoding="utf-8") == ""


def test_there_is_one_version_number():
    said = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert said
    assert said[1].strip('"') == lm.__version__
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["dynamic"] == ["version"]
    assert project["tool"]["hatch"]["version"]["path"] == "limitmason/constants.py"
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.search(r"^## \[(.*?)\] - (.*)$", changes, flags=re.MULTILINE)
    assert newest
    assert newest[1] == lm.__version__.partition(".dev")[0]
    day = re.search(r"^date-released: (.*)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert day
    assert newest[2] == ("unreleased" if ".dev" in lm.__version__ else day[1])
    try:
        installed = distribution("limitmason").version
    except PackageNotFoundError:
        return
    assert not INSTALLED_IN or installed == lm.__version__


def test_the_test_command_of_the_readme_is_the_one_that_is_run_before_every_merge():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    command = re.search(r'^pip install "\.\[test\]" && (pytest.*)$', readme, flags=re.MULTILINE)
    assert command
    lines = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert lines[-1] == command[1]  # last, so that what pytest says at its end is what is seen
    assert any(line.startswith("export LIMITMASON_INSTALLED_IN=") for line in lines)


def test_every_extra_is_named_with_what_it_gives_and_used_by_code():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for page in ("README.md", "docs/site/quickstart.md"):
        rows = re.findall(r"^\| `(\w+)` \| .{10,} \|$", (ROOT / page).read_text(encoding="utf-8"), flags=re.MULTILINE)
        assert sorted(rows) == sorted(extras), page
    sources = [p for package in PACKAGES for p in (ROOT / package).rglob("*.py")] + [ROOT / "docs/site/conf.py"]
    code = "\n".join(p.read_text(encoding="utf-8") for p in sources)
    for extra in extras.keys() - {"test"}:
        for requirement in extras[extra]:
            name = re.match(r"[\w-]+", requirement)[0]
            known = name.replace("-", "_")
            assert re.search(rf"\b{known}\b", code), requirement


def test_the_source_distribution_takes_every_folder_of_the_repository():
    taken = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]["targets"]
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout.split()
    top = {name.partition("/")[0] for name in listed}
    assert top <= {*taken["sdist"]["include"], "pyproject.toml", ".gitignore"}  # these two always go along
