"""A tidy table: one row per run, one column per quantity, every column with its unit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.display.notebook import Displayed, html_table
from limitmason.display.text_table import abridged, aligned
from limitmason.errors import InputError
from limitmason.storage.csv_table import Tabular, write_table


@dataclass(frozen=True, eq=False)
class Table(Displayed, Tabular):
    """Rows of a study.

    Parameters
    ----------
    rows : one mapping per run, all with the same columns
    units : by column; "-" where not named
    notes : what a reader must know before using the numbers
    """

    rows: tuple[Mapping[str, Any], ...]
    units: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns, in order of first appearance."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row))

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        return iter(self.rows)

    def __getitem__(self, column: str) -> np.ndarray:
        """One column as an array.

        Numbers missing in a row are NaN.
        """
        if column not in self.columns:
            raise InputError(f"the table has no column {column!r}; columns: {', '.join(self.columns)}")
        values = [row.get(column) for row in self.rows]
        if all(v is None or (isinstance(v, (int, float)) and not isinstance(v, bool)) for v in values):
            return np.array([np.nan if v is None else v for v in values], dtype=float)
        return np.array(values, dtype=object)

    def __eq__(self, other: object) -> bool:
        """Whether both hold the same rows in the same order.

        NaN equals NaN.
        """
        if not isinstance(other, Table):
            return NotImplemented
        return len(self) == len(other) and all(
            list(a) == list(b) and all(same_entry(a[k], b[k]) for k in a) for a, b in zip(self, other, strict=True)
        )

    __hash__ = None  # type: ignore[assignment]

    def where(self, **wanted: Any) -> Table:
        """Only the rows whose columns have the given values."""
        for name in wanted:
            if name not in self.columns:
                raise InputError(f"the table has no column {name!r}; columns: {', '.join(self.columns)}")
        kept = tuple(r for r in self.rows if all(same_entry(r.get(k), v) for k, v in wanted.items()))
        return Table(kept, self.units, self.notes)

    def write_csv(self, path: str | Path) -> None:
        """Write names, a comment line of units, and the rows.

        ``pandas.read_csv(path, comment="#")`` reads it.
        """
        write_table(path, *self.tabulated())

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Columns with their units, and the rows; None where a row has no such column."""
        units = {c: self.units.get(c, "-") for c in self.columns}
        return units, [[row.get(c) for c in units] for row in self.rows]

    def __str__(self) -> str:
        """The table in plain text, units in the header."""
        head, rows, notes = self._shown()
        return "\n".join([aligned([head, *rows]), *notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """The table as a notebook shows it."""
        return html_table(*self._shown())

    def _shown(self) -> tuple[list[str], list[list[str]], list[str]]:
        """Head with units, the rows as text without the middle of many, and the notes."""
        head = [c if self.units.get(c, "-") == "-" else f"{c} [{self.units[c]}]" for c in self.columns]
        rows, cut = abridged([[_text(r.get(c)) for c in self.columns] for r in self.rows])
        return head, rows, [*(f"{c}: write_csv and to_dataframe have them" for c in cut), *self.notes]


def _text(value: Any) -> str:
    """An entry as it is shown: "-" for none, six digits of a number."""
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def same_entry(a: Any, b: Any) -> bool:
    """Equality of table entries in which NaN equals NaN."""
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b):
        return True
    return bool(a == b)
