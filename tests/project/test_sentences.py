"""Sentences of the pages are short: none of more than 30 words, tables, code and formulas aside."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST = 30
LISTED = {"docs/methods.md"}  # its lists of cases carry the refusals that the program itself gives
PAGES = sorted(
    p.relative_to(ROOT).as_posix()
    for p in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").glob("*.md"),
              *(ROOT / "docs" / "papers").glob("*.md"), *(ROOT / "docs" / "site").glob("*.md"),
              *(ROOT / "docs" / "history").glob("*.md"), *(ROOT / "docs" / "site" / "tutorials").glob("*.md"))
)


def paragraphs(text):
    """Prose of a page, one string for every paragraph and entry of a list."""
    text = re.sub(r"^ *(```|\$\$).*?^ *\1[^\n]*$", "", text, flags=re.DOTALL | re.MULTILINE)
    found = [[]]
    for line in map(str.strip, re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL).split("\n")):
        if not line or line[0] in "|#:!":
            found.append([])
            continue
        if entry := re.match(r"([-*+]|\d+\.)\s+", line):
            found.append([])
            line = line[entry.end():]
        found[-1].append(line)
    return [" ".join(lines) for lines in found if lines]


def sentences(text):
    """Words of every sentence; a formula, a piece of code and a quoted message count as one, a link as its text."""
    for paragraph in paragraphs(text):
        plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"\$[^$]*\$|`[^`]*`|\"[^\"]*\"", "X", paragraph))
        for sentence in re.split(r"(?<=[.!?])[\"')*]*\s+(?=[A-Z\"'(*\[\d])", plain):
            yield [word for word in sentence.split() if re.search(r"\w", word)]


def test_a_sentence_ends_at_its_full_stop_and_formulas_count_once():
    page = "One two $a = b + c$. **Three** four `x y z`.\n\n| a | table |\n\n- five\n  six\n\n```\ncode\n```\n"
    found = list(sentences(page))
    assert [len(words) for words in found] == [3, 3, 2]


@pytest.mark.parametrize("page", [p for p in PAGES if p not in LISTED])
def test_no_sentence_is_long(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    long = [" ".join(words) for words in sentences(text) if len(words) > MOST]
    assert not long, long
