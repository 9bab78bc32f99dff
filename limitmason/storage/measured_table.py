"""Tables of measured specimens: CSV with names and units of its columns, read with errors that name the cell.

Names and units of columns are taken apart in ``csv_table``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, isinf
from pathlib import Path
from typing import Any

from limitmason.checks import several
from limitmason.errors import InputError
from limitmason.storage.csv_table import UNITS, Parsed, Tabular, parsed, write_table
from limitmason.storage.files import named_path, read_text

BEYOND = {">": "above", "<": "below"}
"""Where a value lies that was not reached, by the sign before the number in its cell."""

FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6}
"""Newtons by unit of force."""


@dataclass(frozen=True)
class MeasuredTable(Tabular):
    """One row per measured value, columns with units.

    Parameters
    ----------
    name : of the file, for messages
    units : unit of every column, "-" for pure numbers and words
    columns : values of every column, numbers or words
    lines : line of each row in the file
    beyond : "above" or "below" by row number and column, of cells that say "> 20" or "< 3"
    """

    name: str
    units: Mapping[str, str]
    columns: Mapping[str, tuple]
    lines: tuple[int, ...]
    beyond: Mapping[tuple[int, str], str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One mapping per row, column to value."""
        return [{k: c[i] for k, c in self.columns.items()} for i in range(len(self))]

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Columns with their units, and the rows."""
        return self.units, list(zip(*self.columns.values(), strict=True))

    def column(self, name: str, what: str = "") -> tuple:
        """Values of a column.

        Parameters
        ----------
        name : of the column
        what : what it is needed for, for the error; empty for nothing to tell

        Raises
        ------
        InputError
            Where there is none of that name; the message lists the columns.
        """
        if name not in self.columns:
            for_ = f" for {what}" if what else ""
            raise InputError(
                f"{self.name}: there is no column {name!r}{for_}; the columns are {', '.join(self.columns)}"
            )
        return self.columns[name]

    def positive(self, name: str, what: str = "") -> list[float]:
        """Values of a column of positive numbers, with arguments as for :meth:`column`.

        Raises
        ------
        InputError
            Naming row and column of the first value that is no positive number.
        """
        for line, value in zip(self.lines, self.column(name, what), strict=True):
            if isinstance(value, str) or not (isfinite(value) and value > 0):
                raise InputError(
                    f"{self.name}: row {line}, column {name!r}: a positive number is needed, got {value!r}"
                )
        return [float(v) for v in self.columns[name]]


def read_measured(path: str | Path, *, blanks: bool = False) -> MeasuredTable:
    """Read a CSV file of measured values.

    It holds the names of the columns, a line of units, then one row per measured value.

    The units stand in the comment line "# units: ..." or, as version 0.1 wrote them, in a row below the names. Other
    lines that begin with # are comments. A column holds numbers, or words where its unit is "-".

    Parameters
    ----------
    path : of the file
    blanks : whether columns of numbers may have blank cells, which are NaN. A value that was not reached may then be
        written as a bound: "> 20", "< 3"

    Raises
    ------
    InputError
        Naming row, column and unit of what is wrong.
    """
    text = read_text(path)
    wanted = (f"{path}: a row of column names, a line of units ({UNITS}m,kN,-) and rows of values are needed; "
              "`limitmason diagnose --template FILE` writes a file to start from")
    try:
        found = parsed(text, str(path))
    except InputError:
        raise InputError(wanted) from None
    if not found.rows:
        raise InputError(wanted)
    _check_layout(str(path), found)
    header, units, lines = found.header, found.units, found.lines
    columns, beyond = {}, {}
    for k, name in enumerate(header):
        cells = [row[k] for row in found.rows]
        if not blanks and "nan" in cells and units[k] != "-":
            line = lines[cells.index("nan")]
            raise InputError(f"{path}: row {line}, column {name!r} is 'nan'; fill it, or leave the row or column out")
        if blanks:
            cells = [cell or "nan" for cell in cells]
            for i, cell in enumerate(cells):
                if cell[0] in BEYOND and _number(cell[1:]) is not None:
                    beyond[i, name], cells[i] = BEYOND[cell[0]], cell[1:]
        columns[name] = _column(str(path), name, units[k], lines, cells)
    return MeasuredTable(str(path), dict(zip(header, units, strict=True)), columns, tuple(lines), beyond)


def _check_layout(path: str, found: Parsed) -> None:
    """Refuse a table that cannot be read without doubt.

    Every column needs a unit and a name that no other has, every row a cell for each column.

    Parameters
    ----------
    path : of the file, for errors
    found : the table as text
    """
    header, units = found.header, found.units
    if found.doubt:
        raise InputError(f"{path}: {found.doubt}")
    twice = next((h for i, h in enumerate(header) if h in header[:i]), None)
    if twice:
        raise InputError(f"{path}: row {found.header_line}: the column {twice!r} is there twice")
    if "" in header:
        raise InputError(f"{path}: row {found.header_line}: column {header.index('') + 1} has no name")
    for number, row in zip([found.units_line, *found.lines], [units, *found.rows], strict=True):
        if len(row) != len(header):
            raise InputError(f"{path}: row {number} has {len(row)} cells, the header has {len(header)}")
    for name, unit in zip(header, units, strict=True):
        # a number is the first value of a table without a line of units
        if not unit or _number(unit) is not None:
            raise InputError(
                f"{path}: row {found.units_line} must give the unit of every column; {name!r} has {unit!r} ('-' for "
                "pure numbers and words)"
            )


def write_measured(
    path: str | Path, units: Mapping[str, str], rows: Sequence[Mapping[str, Any]], note: str = ""
) -> None:
    """Write a table that :func:`read_measured` reads.

    Numbers have ten digits: more than was ever measured, and none that only a change of units has made.

    Parameters
    ----------
    path : of the file, which must not be there yet: it may be somebody's work
    units : columns in order with their units
    rows : one mapping per row, column to value
    note : comment lines below the units

    Raises
    ------
    InputError
        Where the file exists already, without rows, for a row without one of the columns, and for an endless number.
    """
    path = named_path(path)
    if path.exists():
        raise InputError(f"{path} exists already; choose another name")
    rows = several("rows", rows, Mapping)  # type: ignore[type-abstract]
    if not rows:
        raise InputError("rows: give at least one, a mapping of columns to values")
    for k, row in enumerate(rows):
        if missing := [name for name in units if name not in row]:
            raise InputError(f"rows[{k}] has no {missing[0]!r}: give every column a value")
        endless = next((name for name in units if isinstance(row[name], float) and isinf(row[name])), None)
        if endless is not None:
            raise InputError(f"rows[{k}] has {row[endless]} for {endless!r}: a table holds finite numbers")
    cells = ([f"{v:.10g}" if isinstance(v, float) else v for v in (row[name] for name in units)] for row in rows)
    write_table(path, units, cells, note)


def force_factor(given: str, wanted: str, where: str) -> float:
    """Factor from one unit of force to another, 1 for equal units of any kind.

    Parameters
    ----------
    given : unit of the values
    wanted : unit of the predictions
    where : the column of the values, for the error

    Raises
    ------
    InputError
        For units that do not convert, naming both.
    """
    if given == wanted:
        return 1.0
    if given in FORCES and wanted in FORCES:
        return FORCES[given] / FORCES[wanted]
    raise InputError(f"{where} has the unit {given!r}, but the predictions come in {wanted!r}")


def _column(path: str, name: str, unit: str, lines: Sequence[int], cells: Sequence[str]) -> tuple:
    """Values of a column: numbers, or words where most are none and the unit is "-".

    Parameters
    ----------
    path : of the file, for errors
    name : of the column
    unit : of the column
    lines : line of every cell in the file, for errors
    cells : their texts
    """
    for line, cell in zip(lines, cells, strict=True):
        if not cell:
            raise InputError(f"{path}: row {line}, column {name!r} is blank; fill it, or leave the row or column out")
    values = [_number(cell) for cell in cells]
    bad = [k for k, value in enumerate(values) if value is None]
    if not bad:
        return tuple(values)
    # a few words among numbers are slips of the pen
    if unit == "-" and len(bad) >= len(cells) / 2:
        return tuple(cells)
    why = f"its unit is {unit!r}" if unit != "-" else "most of the column are numbers"
    raise InputError(f"{path}: row {lines[bad[0]]}, column {name!r}: {cells[bad[0]]!r} is not a number, but {why}")


def _number(cell: str) -> float | None:
    """A cell as a number, or None where it is none.

    "nan" is one, as blank cells become it.
    """
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if isfinite(value) or cell == "nan" else None
