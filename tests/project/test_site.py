"""The documentation site: code blocks print what is shown, links lead somewhere, the reference has no gap."""

import ast
import importlib
import importlib.util
import re
import subprocess
import sys
import zlib
from pathlib import Path

import page_blocks
import pytest
import site_sources
from example_runs import LONG_PAGES, run_page

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "docs" / "site"
PAGES = sorted(p for p in SITE.rglob("*.md") if p.relative_to(SITE).parts[0] not in ("made", "gallery", "reference"))
WITH_CODE = [p for p in PAGES if page_blocks.blocks(p.read_text(encoding="utf-8"))]
TUTORIALS = sorted((SITE / "tutorials").glob("[0-9]*.md"))
MADE = {f"made/{name}" for name in (*site_sources.COPIED, "cite.md")}


def test_there_are_eight_tutorials_with_topics_time_and_files_on_top():
    assert [p.name[0] for p in TUTORIALS] == ["1", "2", "3", "4", "5", "6", "7", "8"]
    for page in TUTORIALS:
        top = page.read_text(encoding="utf-8").partition("```")[0]
        for word in ("Topics", "Time needed", "Files"):
            assert re.search(rf"^\| {word} \| .{{4,}} \|$", top, flags=re.MULTILINE), (page.name, word)


@pytest.mark.parametrize("page", [p for p in WITH_CODE if p.stem not in LONG_PAGES], ids=lambda p: p.stem)
def test_code_blocks_print_and_draw_what_the_page_shows(page, tmp_path, monkeypatch):
    run_page(page, tmp_path, monkeypatch)


def test_pages_that_another_lane_runs_have_code_that_is_python():
    long = [p for p in WITH_CODE if p.stem in LONG_PAGES]
    assert len(long) == len(LONG_PAGES)
    for page in long:
        for block in page_blocks.blocks(page.read_text(encoding="utf-8")):
            compile(block.code, page.name, "exec")


def test_no_output_is_shown_that_belongs_to_no_code():
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert text.count("```text\n") == sum(b.shown is not None for b in page_blocks.blocks(text)), page.name


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_links_lead_somewhere(page):
    text = re.sub(r"^```(?!\{toctree).*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if not re.match(r"[a-z]+:", target):
            file = (page.parent / target).resolve()
            assert file.exists() or file.relative_to(SITE).as_posix() in MADE, target
    entries = [x for tree in re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL) for x in tree.split("\n")]
    for target in [*filter(lambda x: x and x[0] != ":", entries), *re.findall(r"\{doc\}`([^`]+)`", text)]:
        known = target in ("gallery/index", "reference/index") or f"{target}.md" in MADE
        assert known or (page.parent / f"{target}.md").exists(), target


def test_documents_of_the_repository_are_there_and_their_links_become_pages(tmp_path):
    site_sources.write_pages(tmp_path / "made")
    assert {f"made/{p.name}" for p in (tmp_path / "made").glob("*.md")} == MADE
    for page in (tmp_path / "made").glob("*.md"):
        for mark, target in re.findall(r"(!?)\[[^\]]*\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
            if mark:
                assert (SITE / "made" / target).resolve().exists(), (page.name, target)
            elif not re.match(r"[a-z]+:", target):
                assert f"made/{target}" in MADE, (page.name, target)
    limits = (tmp_path / "made" / "limits.md").read_text(encoding="utf-8")
    assert limits.count("\n- ") >= 5


@pytest.mark.slow
def test_every_promise_names_a_test_that_exists():
    rows = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", (SITE / "validation.md").read_text(encoding="utf-8"))
    assert len(rows) > 15
    for file, name in rows:
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        assert name in {n.name for n in tree.body if isinstance(n, ast.FunctionDef)}, (file, name)


def test_every_package_with_public_names_is_in_the_reference():
    # what the public packages are made of
    inner = {"dem.kernels", "dem.push", "limitmason.answers.results", "limitmason.mechanics.contact_points"}
    inner |= {"limitmason.mechanics.plane", "limitmason.storage.frozen"}
    found = set()
    for package in ("limitmason", "dem", "mechanisms"):
        for path in (ROOT / package).rglob("*.py"):
            names = path.relative_to(ROOT).with_suffix("").parts
            names = names[:-1] if names[-1] == "__init__" else names
            if re.search(r"^__all__\b", path.read_text(encoding="utf-8"), flags=re.MULTILINE):
                found.add(".".join(names))
    assert found - inner <= set(site_sources.PACKAGES)
    import limitmason as lm

    # and every document of the repository has its page
    documents = {p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md") if not p.is_relative_to(SITE)}
    assert documents <= set(site_sources.COPIED.values())
    named = {f"limitmason.{name}" for name in lm._MODULES} | set(lm._BESIDE)
    assert named <= set(site_sources.PACKAGES)


@pytest.mark.parametrize("package", site_sources.PACKAGES)
def test_the_reference_lists_every_public_name_once(package):
    page = site_sources.reference_page(package)
    module = importlib.import_module(package)
    listed = [
        *re.findall(rf"^\.\. auto(?!module)\w+:: {re.escape(package)}\.(\w+)$", page, flags=re.MULTILINE),
        *re.findall(r"^\.\. py:(?!module)\w+:: (\w+)", page, flags=re.MULTILINE),
    ]
    assert sorted(listed) == sorted(site_sources.names_of(module))
    for name, thing in site_sources.public_names(module):
        assert not callable(thing) or thing.__doc__, name


def test_equations_become_literal_blocks_and_bars_stay_bars():
    rest = ["", "Parameters", "----------", "x : it"]
    made = site_sources.readable(["The law |T| <= ``|c|``:", "", "    |T| <= c A", *rest])
    assert made == [r"The law \|T\| <= ``|c|``:", "", "::", "", "    |T| <= c A", *rest]


def test_constants_are_found_with_their_words_where_they_are_defined():
    assert site_sources.words_of("limitmason.causes", "LEVERS").startswith("What a cause pulls at")
    assert "entry-point group" in site_sources.words_of("limitmason.methods", "METHODS")


def test_every_example_has_a_title_and_a_page(tmp_path):
    site_sources.write_gallery(tmp_path / "gallery_source")
    for script in site_sources.examples():
        title, _ = site_sources.title_of(script)
        assert 10 < len(title) < 50, script.name  # a card of the gallery has room for two lines
        (copy,) = (tmp_path / "gallery_source").glob(f"*/{script.name}")
        page = copy.read_text(encoding="utf-8")
        compile(page, script.name, "exec")
        body = re.match(r'""".*?"""\n', script.read_text(encoding="utf-8"), flags=re.DOTALL).end()
        assert script.read_text(encoding="utf-8")[body:] in page
        for picture in re.findall(r"image:: /(\S+)", page):
            assert (SITE / picture).exists()


def test_the_gallery_shows_every_example_once_with_a_picture_and_ten_short_ones_first():
    names = [p.stem for p in site_sources.examples()]
    assert sorted(names) == sorted(p.stem for p in (ROOT / "examples").glob("*.py"))
    assert not [name for name in names if not list((site_sources.STORED / name).glob("*.png"))]
    first = site_sources.GALLERY["First steps"]
    assert len(first) == 10
    for name in first:  # read in a minute
        assert len((ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 35, name


def test_stored_output_belongs_to_examples():
    names = {p.stem for p in site_sources.examples()}
    assert {p.name for p in site_sources.STORED.iterdir()} == names
    assert len(list(site_sources.STORED.glob("*/output.txt"))) == len(names)


def test_literals_end_on_the_line_of_the_parameter_they_describe():
    # one that goes on to the next line is an error of the site's build, which not every run of the tests makes
    for package in ("limitmason", "dem", "mechanisms"):
        for path in (ROOT / package).rglob("*.py"):
            for line in path.read_text(encoding="utf-8").splitlines():
                if re.match(r"\s*\*{0,2}\w[\w, *]* : ", line):
                    assert line.count("``") % 2 == 0, (path.name, line)


def names_of_inventory(path: Path) -> set[str]:
    """Names that a built site documents, out of its inventory."""
    raw = path.read_bytes().split(b"\n", 4)
    return {line.split(" ")[0] for line in zlib.decompress(raw[4]).decode().splitlines()}


@pytest.mark.slow
@pytest.mark.skipif(
    any(importlib.util.find_spec(n) is None for n in ("sphinx", "numpydoc", "myst_parser", "sphinx_gallery")),
    reason="needs the extra docs",
)
def test_the_site_is_built_without_a_warning_and_documents_every_public_name(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(tmp_path / "trees")]
    done = subprocess.run([*command, str(SITE), str(tmp_path / "site")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    documented = names_of_inventory(tmp_path / "site" / "objects.inv")
    for package in site_sources.PACKAGES:
        module = importlib.import_module(package)
        for name, thing in site_sources.public_names(module):
            home = site_sources.home_of(name, thing, package)
            assert f"{home or package}.{name}" in documented, f"{package}.{name}"
