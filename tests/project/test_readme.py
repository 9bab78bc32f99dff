"""What the README shows is what the code does."""

import re
from pathlib import Path

import page_blocks
import pytest
from every_case import table_rows

from limitmason import experiments

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PREDICTED = (ROOT / "docs" / "predicted.md").read_text(encoding="utf-8")
MOVED = ("theories", "predicted", "findings", "limits")


@pytest.mark.slow
def test_python_block_prints_what_the_readme_says(tmp_path):
    (block,) = page_blocks.blocks(README)
    assert page_blocks.run(README, tmp_path) == [block.shown]
    assert (tmp_path / "wall.png").exists()


@pytest.mark.parametrize("source", ["ferris-tin-loi-2001",
    pytest.param("minho-dry-stone-2005-2009", marks=pytest.mark.slow), "rondelet-wallette"])
def test_summary_table_is_what_the_packaged_cases_give(source):
    shown = PREDICTED.split("<!-- summary")[1].split("<!-- end of summary -->")[0]
    fresh = table_rows(experiments.all_cases(source=source, with_model=True), flow_rule="associative")
    assert fresh
    for row in fresh:
        assert row in shown, row


def test_every_packaged_case_with_a_model_is_in_the_summary():
    shown = PREDICTED.split("<!-- summary")[1].split("<!-- end of summary -->")[0]
    cases = [c for c in experiments.all_cases(with_model=True) if c.measured or c.published]
    for source in {case.source.name for case in cases}:
        assert source in shown


def test_a_newcomer_reads_one_page():
    assert len(README.splitlines()) < 110
    assert README.count("![") == 2
    assert len(re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)[0].splitlines()) < 20


def test_commands_of_the_readme_and_its_pages_exist():
    from limitmason.cli.parser import command_parser

    text = README + "".join((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in MOVED)
    commands = re.findall(r"`limitmason ([^`]*)`", text) + re.findall(r"^limitmason (.*)$", README, flags=re.MULTILINE)
    assert len(commands) >= 10
    for command in commands:
        words = ["x" if w in ("SOURCE", "SPECIMEN") else w for w in command.split()]
        if "--help" not in words:
            command_parser().parse_args(words)


def test_linked_files_exist():
    for page in (ROOT / "README.md", *(ROOT / "docs" / f"{name}.md" for name in MOVED)):
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), (page.name, target)
