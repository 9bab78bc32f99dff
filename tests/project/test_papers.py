"""The list of what five papers describe: whole, every entry with a state and where it is shown."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "papers" / "index.md"
ENTRIES = {0: 20, 1: 16, 2: 14, 3: 24, 4: 13}  # of each paper
WORKS, PARTLY, OPEN = "works", "partly", "not decidable"
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.read_text(encoding="utf-8").splitlines()
    if re.match(r"\| \d+\.\d+ \|", line)
]


def test_every_entry_of_every_paper_is_listed_once():
    assert [row[0] for row in ROWS] == [f"{paper}.{k}" for paper, n in ENTRIES.items() for k in range(1, n + 1)]


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_an_entry_has_a_state_a_page_that_exists_and_a_reason(row):
    assert len(row) == 5
    assert row[2] in (WORKS, PARTLY, OPEN)
    assert all(row)
    targets = re.findall(r"\]\(([^)#]+)", row[3])
    assert targets
    assert all((PAGE.parent / target).is_file() for target in targets)


def test_the_first_sentence_counts_the_entries():
    counts = [sum(row[2] == state for row in ROWS) for state in (WORKS, PARTLY, OPEN)]
    first = r"Of (\d+) things.*?(\d+) work here, (\d+) work partly and (\d+) cannot"
    found = re.search(first, PAGE.read_text(encoding="utf-8"))
    assert found
    assert [int(n) for n in found.groups()] == [sum(counts), *counts]
