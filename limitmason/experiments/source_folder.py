"""Reading the packaged tables and the source, licence and checksums of their folder, ``source.json``.

Tables are CSV files with names, a line of units and a source in every row.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

from limitmason.answers.references import DATA, Cited, Reference
from limitmason.errors import InputError
from limitmason.experiments.experiment import Option, Quantity, Source
from limitmason.experiments.shown import Departure, Settings, Shown, Variant
from limitmason.storage.csv_table import parsed


@dataclass(frozen=True)
class TextTable:
    """A table as text, with the unit of every column.

    Parameters
    ----------
    name : file name
    units : unit of every column, "-" for pure numbers and words
    rows : one mapping per row, column to text; a blank cell is an empty string
    """

    name: str
    units: Mapping[str, str]
    rows: tuple[Mapping[str, str], ...]

    def row(self, key: str, column: str = "specimen") -> Mapping[str, str]:
        """The row whose ``column`` holds ``key``."""
        for row in self.rows:
            if row[column] == key:
                return row
        raise InputError(f"{self.name} has no row with {column} {key!r}")

    def quantity(self, row: Mapping[str, str], column: str, note: str = "") -> Quantity | None:
        """A cell of a row as a number in the unit of its column, None for a blank cell.

        ``note`` is a remark to hang on it.
        """
        text = row[column]
        if not text:
            return None
        try:
            return Quantity(float(text), self.units[column], note)
        except ValueError:
            first = next(iter(row.values()))
            raise InputError(f"{self.name}: {column} of {first!r} is not a number: {text!r}") from None

    def quantities(self, row: Mapping[str, str], columns: Mapping[str, str], note: str = "") -> dict[str, Quantity]:
        """Cells of a row that are not blank, by new names, each with a note.

        ``columns`` maps the new name to the column.
        """
        found = {name: self.quantity(row, column, note) for name, column in columns.items()}
        return {name: value for name, value in found.items() if value is not None}


def folder(source: str) -> Traversable:
    """Folder of a source: its data files beside its module."""
    return files(f"limitmason.experiments.{source.replace('-', '_')}")


@cache
def read_table(source: str, name: str) -> TextTable:
    """Read a packaged CSV file.

    Raises
    ------
    InputError
        When the file has no names or no units, or a row of another length.
    """
    text = (folder(source) / name).read_text(encoding="utf-8")
    return parse_table(text, f"{source}/{name}")


def names_in(source: str, *tables: str) -> Callable[[], tuple[str, ...]]:
    """Names of the specimens in tables of a source, as a function for its recipe."""
    return partial(_names, source, tables)


def _names(source: str, tables: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(r["specimen"] for name in tables for r in read_table(source, name).rows)


def parse_table(text: str, name: str) -> TextTable:
    """Table from the text of a CSV file, called ``name`` in errors.

    See :mod:`limitmason.storage.csv_table`.
    """
    header, units, rows, lines, units_line, *_ = parsed(text, name)
    if len(set(header)) < len(header):
        raise InputError(f"{name}: a column name is used twice")
    for number, row in zip([units_line, *lines], [units, *rows], strict=True):
        if len(row) != len(header):
            raise InputError(f"{name}: row {number} has {len(row)} cells, the header has {len(header)}")
    found = tuple(dict(zip(header, row, strict=True)) for row in rows)
    return TextTable(name, dict(zip(header, units, strict=True)), found)


@cache
def read_description(source: str) -> Mapping:
    """Content of a source's ``source.json``.

    It holds citation, licence, caveats, options, columns and checksums.
    """
    return json.loads((folder(source) / "source.json").read_text(encoding="utf-8"))


@cache
def read_options(source: str) -> Mapping[str, Option]:
    """Options of a source's assemblies, as its ``source.json`` states them."""
    return {
        name: Option(said["default"], said["unit"], said["meaning"], tuple(said.get("choices", ())))
        for name, said in read_description(source)["options"].items()
    }


@cache
def read_shown(source: str) -> Shown:
    """How a source is shown beside the theories, as its ``source.json`` states it."""
    said = dict(read_description(source)["shown"])  # a copy: what is taken out of it below stays in the description
    variants = tuple(Variant(name, options) for name, options in said.pop("variants", {"": {}}).items())
    settings: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in said.pop("settings", {}).items()}
    departures = tuple(Departure(**one) for one in said.pop("departures", ()))
    return Shown(variants, Settings(**settings), tuple(said.pop("stubborn", ())), departures=departures, **said)


@cache
def read_source(source: str) -> Source:
    """Description of a source without its columns."""
    said = read_description(source)
    return Source(
        name=said["name"], title=said["title"], kind=said["kind"], citation=said["citation"], doi=said["doi"],
        url=said["url"], licence=said["licence"], references=said["references"], caveats=tuple(said["caveats"]),
        papers=tuple(Reference(**paper) for paper in said.get("papers", ())),
    )


def papers_of(source: str) -> tuple[Cited, ...]:
    """What to cite for the data of a source."""
    return tuple(Cited(DATA, paper) for paper in read_source(source).papers)


@cache
def read_parameters(source: str, name: str = "parameters.csv") -> Mapping[str, Quantity]:
    """A long table (name, value, unit, mark, source) as quantities.

    The mark becomes the note unless it is "read".
    """
    table = read_table(source, name)
    return {
        r["name"]: Quantity(float(r["value"]), r["unit"], "" if r["mark"] == "read" else r["mark"]) for r in table.rows
    }


def checksum(source: str, name: str) -> str:
    """SHA-256 of a data file as it lies on disk."""
    return hashlib.sha256((folder(source) / name).read_bytes()).hexdigest()
