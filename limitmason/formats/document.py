"""JSON documents: read with errors that name file, line or key, and written so that a person can read and edit them."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, is_dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.storage.files import read_json, write_text

T = TypeVar("T")
D = TypeVar("D")
_NOT_FINITE = {"Infinity": math.inf, "-Infinity": -math.inf, "NaN": math.nan}
"""Numbers for which JSON has no form, by the texts that stand for them."""

_SHOWN = 60
"""Characters of a value that an error shows; chosen, so that it fits a line."""


class DocumentNode:
    """A value of a document that knows where it stands, for errors to say so.

    Parameters
    ----------
    value : plain JSON data
    file : shown in errors
    where : keys that lead to the value, "" for the document itself
    """

    def __init__(self, value: Any, file: str, where: str = "") -> None:
        self.value = value
        self.file = file
        self.where = where

    def error(self, message: str) -> InputError:
        """An error that names file and key."""
        return InputError(f"{self.file}: {self.where}: {message}" if self.where else f"{self.file}: {message}")

    def __contains__(self, key: str) -> bool:
        """Whether the key is there and not null."""
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def __getitem__(self, key: str) -> DocumentNode:
        """The value of a key that must be there."""
        if key not in self:
            raise self.error(f"{key!r} is missing")
        return DocumentNode(self.value[key], self.file, f"{self.where}.{key}" if self.where else key)

    def get(self, key: str) -> DocumentNode | None:
        """The value of a key, or None where it is missing or null."""
        return self.given(key, lambda node: node, default=None)

    def given(self, key: str, read: Callable[[DocumentNode], T], default: D) -> T | D:
        """The value of a key as the function ``read`` takes it, or a default.

        The default holds where the key is missing or null.
        """
        return read(self[key]) if key in self else default

    def __iter__(self) -> Iterator[DocumentNode]:
        """Entries of a list."""
        if not isinstance(self.value, list):
            raise self.error(f"expected a list, got {_shown(self.value)}")
        for i, entry in enumerate(self.value):
            yield DocumentNode(entry, self.file, f"{self.where}[{i}]")

    def items(self) -> Iterator[tuple[str, DocumentNode]]:
        """Keys and values of an object."""
        self.mapping()
        for key in self.value:
            yield key, DocumentNode(self.value[key], self.file, f"{self.where}.{key}" if self.where else key)

    def mapping(self, allowed: Iterable[str] | None = None) -> dict[str, Any]:
        """The value as an object, refusing keys that are not allowed.

        Keys that start with "_" are comments. ``allowed`` None allows every key.
        """
        if not isinstance(self.value, dict):
            raise self.error(f"expected an object {{...}}, got {_shown(self.value)}")
        if allowed is not None:
            known = list(allowed)
            for key in self.value:
                if key not in known and not key.startswith("_"):
                    near = difflib.get_close_matches(key, known, 1)
                    hint = f"did you mean {near[0]!r}?" if near else f"known keys: {', '.join(known)}"
                    raise self.error(f"unknown key {key!r}; {hint}")
        return self.value

    def text(self) -> str:
        """The value as a string."""
        if not isinstance(self.value, str):
            raise self.error(f"expected a text, got {_shown(self.value)}")
        return self.value

    def number(self) -> float:
        """The value as a number.

        "Infinity", "-Infinity" and "NaN" are numbers too.
        """
        if isinstance(self.value, str) and self.value in _NOT_FINITE:
            return _NOT_FINITE[self.value]
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.error(f"expected a number, got {_shown(self.value)}")
        return self.value

    def whole(self, what: str = "a whole number", least: float = -math.inf) -> int:
        """The value as a whole number of at least ``least``, called ``what`` in the error."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or self.value < least:
            raise self.error(f"expected {what}, got {_shown(self.value)}")
        return self.value

    def block(self) -> int | str:
        """The value as the name or number of a block."""
        return self.value if isinstance(self.value, str) else self.whole("the name or number of a block")

    def pair(self, what: str) -> tuple[DocumentNode, DocumentNode]:
        """Both entries of a list of two, called ``what`` in the error."""
        entries = list(self)
        if len(entries) != 2:
            raise self.error(f"expected two {what}, got {len(entries)}")
        return entries[0], entries[1]

    def read(self, hint: Any) -> Any:
        """The value as the type of a field.

        Parameters
        ----------
        hint : type of the field: str, int, float, bool, a StrEnum, a tuple or an array of one type, a Mapping;
            of ``X | None`` it is X, as :meth:`values` leaves null out before
        """
        if get_origin(hint) in (Union, UnionType):
            hint = next(h for h in get_args(hint) if h is not type(None))
        kind = get_origin(hint) or hint
        if kind is tuple:
            return tuple(entry.read(get_args(hint)[0]) for entry in self)
        if kind is np.ndarray:
            number = get_args(get_args(hint)[1])[0]  # of ndarray[shape, dtype[number]]
            try:
                return np.array(restored(self.value), dtype=number)
            except (TypeError, ValueError, OverflowError):
                raise self.error("expected numbers in rows of equal length") from None
        if kind is Mapping:
            return restored(self.mapping())
        if kind is bool and not isinstance(self.value, bool):
            raise self.error(f"expected true or false, got {_shown(self.value)}")
        if kind is bool:
            return self.value
        if kind in (int, float):
            return self.whole() if kind is int else self.number()
        if issubclass(kind, StrEnum) and self.text() not in tuple(kind):
            raise self.error(f"expected one of {', '.join(kind)}, got {self.text()!r}")
        return kind(self.text())

    def values(self, kind: type, **special: Callable[[DocumentNode], Any] | None) -> dict[str, Any]:
        """Fields of a class by name, read by their types.

        What is missing or null is left out.

        Parameters
        ----------
        kind : the class
        special : functions that read other keys, or fields in another way; None for keys that are read elsewhere
        """
        hints = get_type_hints(kind)
        self.mapping((*hints, *special))
        readers = {**{k: partial(DocumentNode.read, hint=h) for k, h in hints.items()}, **special}
        out = {}
        for key, node in self.items():
            if node.value is None or key.startswith("_"):
                continue
            if (reader := readers[key]) is not None:
                out[key] = reader(node)
        return out

    def make(self, maker: Callable[..., Any], *given: Any, **values: Any) -> Any:
        """What a class or function makes of values, or an error that names file and key.

        The error is an ``InputError`` in the words of the class or function.

        Parameters
        ----------
        maker : the class or function
        given : its arguments by position
        values : its arguments by name
        """
        try:
            return maker(*given, **values)
        except (InputError, TypeError) as error:
            # a value inside said its place already
            if isinstance(error, InputError) and str(error).startswith(self.file):
                raise error from None
            # a law begins its message with "joint: ", and may stand under the key "joint": that is not said twice
            raise self.error(str(error).removeprefix(f"{self.where}: ")) from None

    def row(self) -> Array:
        """The value as one row of numbers."""
        return np.array([entry.number() for entry in self], dtype=float)

    def array(self, columns: int, *, rows: int | None = None) -> Array:
        """The value as numbers, shape (rows, columns).

        Parameters
        ----------
        columns : numbers in every row
        rows : how many there must be; None for any

        Raises
        ------
        InputError
            Naming the entry that is not a number or the row whose length is wrong.
        """
        out = []
        for entry in self:
            out.append(entry.row())
            if len(out[-1]) != columns:
                raise entry.error(f"expected {columns} numbers, got {len(out[-1])}")
        if rows is not None and len(out) != rows:
            raise self.error(f"expected {rows} rows, got {len(out)}")
        return np.array(out, dtype=float).reshape(-1, columns)


def read_document(path: str | Path, schema: str, version: int) -> DocumentNode:
    """Read a JSON file of a schema.

    Parameters
    ----------
    path : of the file
    schema : the name that the file must declare
    version : the newest that is read; an older one is read too

    Raises
    ------
    InputError
        For text that is not JSON (with line and column), a key given twice, another schema, a newer version.
    FileNotFoundError
        When there is no such file.
    """
    node = DocumentNode(read_json(path), str(path))
    node.mapping()
    if "schema" not in node:
        raise node.error(f'"schema" is missing; the file must declare "schema": "{schema}", "version": {version}')
    if node["schema"].text() != schema:
        raise node["schema"].error(f"expected {schema!r}, got {node['schema'].value!r}")
    if (number := node["version"].whole("a whole number of at least 1", least=1)) > version:
        text = f"the file has version {number}, this limitmason reads up to {version}: update it"
        raise node["version"].error(text)
    return node


def write_document(path: str | Path, document: Mapping[str, Any]) -> None:
    """Write plain data as JSON that a person can read and edit.

    Numbers keep every bit. Every key has a line of its own. So has every entry of a list of lists or objects, every key
    of an object that holds such, and every row of a list of lists in it. All that is deeper stands in one line.

    Parameters
    ----------
    path : of the file
    document : plain data by key, see :func:`plain`
    """
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and value and isinstance(value[0], list | dict):
            text = _broken("[]", [_one_line(entry) for entry in value], "  ")
        elif isinstance(value, dict) and any(isinstance(v, list | dict) and v for v in value.values()):
            text = _broken("{}", [f"{json.dumps(k)}: {_table(v)}" for k, v in value.items()], "  ")
        else:
            text = _one_line(value)
        lines.append(f"{json.dumps(key)}: {text}")
    write_text(path, _broken("{}", lines, "") + "\n")


def _table(value: Any) -> str:
    """A list of lists with a line for every row, anything else in one line."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return _broken("[]", [_one_line(row) for row in value], "    ")
    return _one_line(value)


def _broken(brackets: str, entries: Iterable[str], indent: str) -> str:
    """Entries between two brackets, each on a line of its own.

    They are two spaces in from ``indent``, that of the last line.
    """
    return f"{brackets[0]}\n" + ",\n".join(f"{indent}  {entry}" for entry in entries) + f"\n{indent}{brackets[1]}"


def _one_line(value: Any) -> str:
    """Plain data as JSON without line breaks."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def plain(value: Any, where: str, *, strict: bool = True) -> Any:
    """Data as JSON has it.

    That is text, numbers, flags, lists, and objects with texts as keys. Arrays, tuples and sets become lists,
    dataclasses objects, and numbers that are not finite "Infinity", "-Infinity" and "NaN".

    Parameters
    ----------
    value : anything that a field may hold
    where : keys that lead to it, named in the error
    strict : refuse what JSON has no form for; otherwise its text is kept
    """
    if isinstance(value, np.ndarray):
        value = value.tolist()
    elif isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, float):
        if math.isfinite(value):
            return value
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {str(k): plain(v, f"{where}.{k}", strict=strict) for k, v in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(v, f"{where}[{i}]", strict=strict) for i, v in enumerate(value)]
    if strict:
        raise InputError(f"{where}: a {type(value).__name__} is not plain data; use numbers, texts, lists and dicts")
    return str(value)


def restored(value: Any) -> Any:
    """Plain data ``value`` with its numbers that are not finite as such again.

    :func:`plain` made them "Infinity", "-Infinity" and "NaN".
    """
    if isinstance(value, str):
        return _NOT_FINITE.get(value, value)
    if isinstance(value, dict):
        return {k: restored(v) for k, v in value.items()}
    if isinstance(value, list):
        return [restored(v) for v in value]
    return value


def _shown(value: Any) -> str:
    """A value in few words, for errors."""
    if isinstance(value, dict | list):
        return "a list" if isinstance(value, list) else "an object"
    text = json.dumps(value)
    return text if len(text) < _SHOWN else text[: _SHOWN - 3] + "..."
