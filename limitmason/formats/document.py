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


class DocumentNode:
    """A value of a document that knows where it stands, so that every error can say so.

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
        return self.given(key, lambda node: node, None)

    def given(self, key: str, read: Callable[[DocumentNode], T], default: D) -> T | D:
        """The value of a key as a reader takes it, or a default where it is missing or null."""
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
        """The value as an object, refusing keys that are not allowed (names that start with "_" are comments)."""
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
        """The value as a number, infinite or NaN only when written as text ("Infinity", "NaN")."""
        if isinstance(self.value, str) and self.value in _NOT_FINITE:
            return _NOT_FINITE[self.value]
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.error(f"expected a number, got {_shown(self.value)}")
        return self.value

    def whole(self, what: str = "a whole number", least: float = -math.inf) -> int:
        """The value as a whole number."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or self.value < least:
            raise self.error(f"expected {what}, got {_shown(self.value)}")
        return self.value

    def block(self) -> int | str:
        """The value as the name or number of a block."""
        return self.value if isinstance(self.value, str) else self.whole("the name or number of a block")

    def pair(self, what: str) -> tuple[DocumentNode, DocumentNode]:
        """Both entries of a list of two."""
        entries = list(self)
        if len(entries) != 2:
            raise self.error(f"expected two {what}, got {len(entries)}")
        return entries[0], entries[1]

    def read(self, hint: Any) -> Any:
        """The value as the type of a field: text, number, flag, word of a closed set, texts, numbers, plain data.

        Parameters
        ----------
        hint : type of the field, such as ``float | None``
        """
        if get_origin(hint) in (Union, UnionType):
            hint = next(h for h in get_args(hint) if h is not type(None))
        kind = get_origin(hint) or hint
        if kind is tuple:
            return tuple(entry.read(get_args(hint)[0]) for entry in self)
        if kind is np.ndarray:
            try:
                return np.array(restored(self.value), dtype=get_args(get_args(hint)[1])[0])
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
        """Fields of a class, read by their types.

        What is missing or null keeps its default.

        Parameters
        ----------
        special : how other keys are read, or fields in another way; None for those that are read elsewhere
        """
        hints = get_type_hints(kind)
        self.mapping((*hints, *special))
        given = [(k, v) for k, v in self.items() if v.value is not None and not k.startswith("_")]
        readers = {**{k: partial(DocumentNode.read, hint=h) for k, h in hints.items()}, **special}
        return {k: reader(v) for k, v in given if (reader := readers[k]) is not None}

    def make(self, maker: Callable[..., Any], *given: Any, **values: Any) -> Any:
        """What a class or function, ``maker``, makes of values.

        Its refusal names file and key.
        """
        try:
            return maker(*given, **values)
        except (InputError, TypeError) as error:
            own = isinstance(error, InputError) and str(error).startswith(self.file)
            # a law says itself that it is a joint: the key that leads to it says no more
            said = str(error).removeprefix(f"{self.where}: ")
            raise (error if own else self.error(said)) from None

    def row(self) -> Array:
        """The value as one row of numbers."""
        return np.array([entry.number() for entry in self], dtype=float)

    def array(self, columns: int, *, rows: int | None = None) -> Array:
        """The value as numbers: rows of a number of columns.

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
    schema, version : what it must declare; an older version is read, a newer one refused

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
    if (number := node["version"].whole("a whole number of at least 1", 1)) > version:
        text = f"the file has version {number}, this limitmason reads up to {version}: update it"
        raise node["version"].error(text)
    return node


def write_document(path: str | Path, document: Mapping[str, Any]) -> None:
    """Write plain data, ``document``, as JSON, one key a line and one entry of a list a line.

    Numbers keep every bit.
    """
    lines = []
    for key, value in document.items():
        head = f"  {json.dumps(key)}: "
        if isinstance(value, list) and value and isinstance(value[0], list | dict):
            entries = ",\n".join(f"    {_compact(entry)}" for entry in value)
            lines.append(f"{head}[\n{entries}\n  ]")
        elif isinstance(value, dict) and any(isinstance(v, list | dict) and v for v in value.values()):
            entries = ",\n".join(f"    {json.dumps(k)}: {_rows(v)}" for k, v in value.items())
            lines.append(f"{head}{{\n{entries}\n  }}")
        else:
            lines.append(head + _compact(value))
    write_text(path, "{\n" + ",\n".join(lines) + "\n}\n")


def _rows(value: Any) -> str:
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(f"      {_compact(row)}" for row in value) + "\n    ]"
    return _compact(value)


def _compact(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def plain(value: Any, where: str, *, strict: bool = True) -> Any:
    """Data as plain JSON: arrays and tuples as lists, numbers that are not finite as "Infinity", "-Infinity", "NaN".

    Parameters
    ----------
    where : named in the error
    strict : refuse what JSON has no form for; otherwise its text is kept
    value : anything that a field may hold
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
    """``value``, plain data, with "Infinity", "-Infinity" and "NaN" as numbers again."""
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
    return text if len(text) < 60 else text[:57] + "..."
