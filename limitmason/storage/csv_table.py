"""CSV tables with units, as every reader takes them: names, a comment line with the units, one line per row.

    length,force,stone
    # units: m,kN,-
    0.4,12.5,granite

``pandas.read_csv(file, comment="#")`` and ``numpy.genfromtxt(file, delimiter=",", names=True)`` read numbers as
numbers. Comments stand below the names, because the latter takes names from the first line, comment or not.
Tables that a spreadsheet writes where the comma is the decimal sign, with semicolons or tabs between, are read too.
Version 0.1 wrote the units as a row of the table; both forms are read.
"""

import csv
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from limitmason.errors import InputError
from limitmason.storage.files import write_text

UNITS = "# units: "
"""How the line of units begins."""

_DECIMAL = re.compile(r"^([<>]?\s*[-+]?\d*),(\d+(?:[eE][-+]?\d+)?)$")
_POINTED = re.compile(r"^[<>]?\s*[-+]?\d*\.\d+(?:[eE][-+]?\d+)?$")


class Parsed(NamedTuple):
    """A table as text.

    ``header`` names the columns, ``units`` are theirs, ``rows`` the cells. The others are the lines of the file, from
    1, on which every row, the units and the names stand. ``doubt`` says what may be read in two ways, empty
    for nothing.
    """

    header: list[str]
    units: list[str]
    rows: list[list[str]]
    lines: list[int]
    units_line: int
    header_line: int
    doubt: str = ""


def _cell(value: Any, separators: str = ",") -> str:
    """A cell as it is written.

    It is quoted where a reader would take a part of it for something else, such as one of the ``separators``.
    """
    text = "" if value is None else str(value)
    # a reader that skips comments would cut an unquoted cell at the sign
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in f'{separators}"\n\r#') else text


def table_text(units: Mapping[str, str], rows: Iterable[Sequence[Any]], note: str = "") -> str:
    """The text of a table.

    Parameters
    ----------
    units : columns in order with their units, "-" for pure numbers and words
    rows : cells of every row, as they are to be written
    note : comment lines below the units

    Raises
    ------
    InputError
        For a row of another length, and a name that begins like a comment.
    """
    names = list(units)
    if names and names[0].startswith("#"):
        raise InputError(f"the first column is called {names[0]!r}: readers would take the names for a comment")
    # a reader takes the separator from the names: a semicolon or tab in one is quoted
    head = [_cell(name, ",;\t") for name in names]
    out = [",".join(head), UNITS + ",".join(map(_cell, units.values()))]
    # a note is no second line of units
    out += [f"#  {line}" if f"# {line}".startswith(UNITS.strip()) else f"# {line}" for line in note.splitlines()]
    for row in rows:
        if len(row) != len(names):
            raise InputError(f"a row has {len(row)} cells, the table {len(names)} columns")
        out.append(",".join(map(_cell, row)))
    return "\n".join(out) + "\n"


def write_table(path: str | Path, units: Mapping[str, str], rows: Iterable[Sequence[Any]], note: str = "") -> None:
    """Write a table to the file ``path``, with arguments as for :func:`table_text`."""
    write_text(path, table_text(units, rows, note), newline="")


def separator(line: str) -> str:
    """What parts the cells of a line.

    It is a semicolon or tab outside quotes, else the comma.
    """
    plain = re.sub('"[^"]*"', "", line)
    return next((mark for mark in ";\t" if mark in plain), ",")


def split(record: Iterable[str], between: str) -> list[str]:
    """Cells of a record, with points for decimal commas.

    A comma is one where it does not part the cells. ``record`` are the lines of one row, ``between`` is the sign that
    parts its cells.
    """
    cells = _parted(record, between)
    return cells if between == "," else with_points(cells)


def _parted(record: Iterable[str], between: str) -> list[str]:
    """Cells of a record as they stand in the file, with arguments as for :func:`split`."""
    return [c.strip() for c in next(csv.reader(record, delimiter=between), [])]


def with_points(cells: Iterable[str]) -> list[str]:
    """Cells with points for decimal commas."""
    return [_DECIMAL.sub(r"\1.\2", c) for c in cells]


def two_decimal_signs(cells: Iterable[tuple[int, str]]) -> str:
    """What is wrong with numbers of which some have a point and some a comma.

    One of the two parts thousands then, and 1,250 may be 1.25 or 1250. The text is empty where nothing is wrong.

    Parameters
    ----------
    cells : number of the line and text of each, as it stands in the file
    """
    comma = point = ""
    for line, cell in cells:
        comma = comma or (f"row {line} has {cell!r}" if _DECIMAL.match(cell) else "")
        point = point or (f"row {line} {cell!r}" if _POINTED.match(cell) else "")
    if not (comma and point):
        return ""
    return f"{comma} and {point}: write numbers with one decimal sign and without signs between thousands"


def parsed(text: str, name: str) -> Parsed:
    """The cells of a table, whose units are a comment line or a row below the names.

    Other comment lines and blank lines are left out.

    Parameters
    ----------
    text : of the file
    name : for messages

    Raises
    ------
    InputError
        Where there are no names or no units.
    """
    names = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    between = separator(next(names, ""))
    said: list[tuple[int, str]] = []  # comment lines with units, by number
    cells: list[list[str]] = []
    lines: list[int] = []
    numbered = enumerate(text.splitlines(keepends=True), 1)
    for number, line in numbered:
        if line.lstrip().startswith(UNITS.strip()):
            said.append((number, line.strip()[len(UNITS) - 1 :].strip()))
        elif line.strip() and not line.lstrip().startswith("#"):
            # a quoted cell may go on over lines, blank ones and ones that look like comments among them
            record = [line]
            while "".join(record).count('"') % 2 and (more := next(numbered, None)):
                record.append(more[1])
            cells.append(_parted(record, between))
            lines.append(number)
    below = not said  # the units are a row below the names, as version 0.1 wrote them
    if len(cells) < 1 + below:
        raise InputError(f"{name}: expected a row of names and a units row ({UNITS}m,kN,- below the names)")
    if below:
        units, where, first = cells[1], lines[1], 2
    else:
        units, where, first = split([said[0][1]], between), said[0][0], 1
    doubt = ""
    if between != ",":
        doubt = two_decimal_signs(
            (line, cell) for line, row in zip(lines[first:], cells[first:], strict=True)
            for cell, unit in zip(row, units, strict=False) if unit != "-"
        )
        cells = [with_points(row) for row in cells]
    other = next((number for number, units_there in said[1:] if units_there != said[0][1]), None)
    if other is not None:
        doubt = f"rows {where} and {other} give different units; leave one out"
    return Parsed(
        header=cells[0], units=units, rows=cells[first:], lines=lines[first:], units_line=where, header_line=lines[0],
        doubt=doubt,
    )


class Tabular(ABC):
    """What is a table, or can be written as one: ``to_dataframe()`` hands it to pandas."""

    @abstractmethod
    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Columns with their units ("-" for pure numbers and words), and the rows."""

    def to_dataframe(self) -> Any:
        """The table as a ``pandas.DataFrame``.

        Its ``attrs["units"]`` are those of the columns.

        Raises
        ------
        ImportError
            Without pandas, with how to install it.
        """
        try:
            import pandas
        except ImportError:
            raise ImportError("a data frame needs pandas: pip install 'limitmason[pandas]'") from None
        units, rows = self.tabulated()
        # words of an enumeration are words
        plain = [[str(v) if isinstance(v, str) else v for v in row] for row in rows]
        frame = pandas.DataFrame(plain, columns=list(units))
        frame.attrs["units"] = dict(units)
        return frame
