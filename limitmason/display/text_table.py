"""Tables as text: columns of equal width for the terminal, Markdown for pages."""

import re
from collections.abc import Mapping, Sequence


def aligned(lines: Sequence[Sequence[str]], align: str = "") -> str:
    """Columns padded to equal width.

    Parameters
    ----------
    lines : cells, the head first; all lines of one length
    align : a letter for every column, "<" for the left and ">" for the right; all to the left by default
    """
    width = [max(map(len, column)) for column in zip(*lines, strict=True)]
    align = align or "<" * len(width)
    return "\n".join(
        "  ".join(f"{c:{a}{w}}" for c, a, w in zip(line, align, width, strict=True)).rstrip() for line in lines
    )


def markdown(lines: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table of the cells in ``lines``, the head first."""
    return [markdown_line(lines[0]), markdown_line(["---"] * len(lines[0])), *map(markdown_line, lines[1:])]


def filled(text: str, tables: Mapping[str, Sequence[str]]) -> str:
    """A page whose lines "[name]" become tables.

    Parameters
    ----------
    text : of the page; a name that no table has stays as it is
    tables : lines of Markdown by name, as of :func:`markdown`
    """
    lines: list[str] = []
    for line in text.splitlines():
        name = line[1:-1] if line.startswith("[") and line.endswith("]") else ""
        lines += tables.get(name, [line])
    return "\n".join(lines) + "\n"


def markdown_line(cells: Sequence[str]) -> str:
    """One line of a Markdown table.

    No cell can end itself or begin an element of HTML.
    """
    plain = (re.sub(r"<(?=[A-Za-z/!?])", "&lt;", " ".join(c.splitlines())).replace("|", "\\|") for c in cells)
    return "| " + " | ".join(plain) + " |"


SHOWN = 40
"""Rows that a table shows of itself; what is longer is cut in the middle, with a count."""


def abridged(rows: Sequence[Sequence[str]]) -> tuple[list[list[str]], list[str]]:
    """Rows without the middle of a long table, and a line that says how many are cut.

    Parameters
    ----------
    rows : cells, without the head; more than ``SHOWN`` are cut, and the last quarter of what is shown is their end
    """
    if len(rows) <= SHOWN:
        return [list(r) for r in rows], []
    last = SHOWN // 4
    gap = ["..."] * len(rows[0])
    cut = [*map(list, rows[: SHOWN - last]), gap, *map(list, rows[-last:])]
    return cut, [f"{len(rows) - SHOWN} of {len(rows)} rows are not shown"]
