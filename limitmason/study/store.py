"""Results kept while they are made: rows in a file, documents in a folder, a fingerprint of what they belong to."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

SCHEMA = "limitmason-rows"


_JOINT_FIELDS_SINCE_0_2 = ("lost_by", "fracture_energy_tension", "fracture_energy_shear", "unloading")


def fingerprint(*parts: Any) -> str:
    """Hash of models, loads and plain values: equal for equal content, whatever the process or the machine.

    Parameters
    ----------
    parts : assemblies (geometry, joints, supports, recipe), loads, dataclasses, arrays, mappings, sequences, numbers,
        text, functions (their name and code)

    Returns
    -------
    str
        64 hexadecimal digits.

    Raises
    ------
    TypeError
        For objects without a content of their own, such as open files.

    Notes
    -----
    The code of the methods is not part of it: after an update of a method start with an empty store. A function is
    known by name and code, not by the values it closes over.
    """
    digest = hashlib.sha256()
    _feed(digest, parts)
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:
    """Add one value, with a tag of its kind, so that 1 and "1" differ."""
    if isinstance(value, Assembly):
        _feed(digest, ("assembly", tuple(value.links), [b.name for b in value.blocks], value.recipe))
        _feed(digest, [(i.kind, i.joint) for i in value.interfaces])
    elif isinstance(value, Loads):
        _feed(digest, ("loads", value.dead, value.live))
    elif isinstance(value, np.ndarray) and value.dtype != object:
        digest.update(f"array{value.shape}{value.dtype.str}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        _feed(digest, ("mapping", sorted(((str(k), v) for k, v in value.items()), key=lambda item: item[0])))
    elif isinstance(value, (bool, int, float, str, type(None), np.generic)):
        plain = value.item() if isinstance(value, np.generic) else value
        digest.update(f"{type(plain).__name__}:{plain!r};".encode())
    elif isinstance(value, (list, tuple)):
        digest.update(f"[{len(value)}".encode())
        for item in value:
            _feed(digest, item)
    elif isinstance(value, (set, frozenset)):
        _feed(digest, sorted(value, key=repr))
    elif isinstance(value, Joint):
        # what 0.1 did not know counts where it is said: an answer that it stored is found again
        said = [
            (f.name, getattr(value, f.name))
            for f in fields(value)
            if f.name not in _JOINT_FIELDS_SINCE_0_2 or getattr(value, f.name) != f.default
        ]
        _feed(digest, (type(value).__qualname__, said))
    elif is_dataclass(value) and not isinstance(value, type):
        _feed(digest, (type(value).__qualname__, [(f.name, getattr(value, f.name)) for f in fields(value)]))
    elif hasattr(value, "dist") and hasattr(value, "kwds"):
        # a distribution of scipy.stats with its parameters
        _feed(digest, ("distribution", value.dist.name, value.args, value.kwds))
    elif hasattr(value, "func") and hasattr(value, "keywords"):
        _feed(digest, ("partial", value.func, value.args, value.keywords))
    elif callable(value) and hasattr(value, "__qualname__"):
        code = getattr(value, "__code__", None)
        _feed(digest, ("function", value.__qualname__, b"".hex() if code is None else code.co_code.hex()))
        if code is not None:
            _feed(digest, [c for c in code.co_consts if isinstance(c, (bool, int, float, str))])
    else:
        raise TypeError(f"a {type(value).__name__} has no content to identify a stored result by; leave the store out")


def plain(value: Any) -> Any:
    """A value as JSON keeps it: numpy scalars and arrays become numbers and lists."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (bool, int, float, str, type(None))):
        return value
    raise TypeError(f"a result may hold numbers, text, lists and mappings, not a {type(value).__name__}")


def write_whole(path: Path, text: str) -> None:
    """Write a file whole or not at all, so that a kill leaves no half file; its folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


class DocumentStore:
    """One JSON document per finished answer in a folder, found again after a kill.

    Parameters
    ----------
    folder : made when the first document comes
    schema : what the documents are; a file of another schema is refused
    """

    def __init__(self, folder: str | Path, schema: str) -> None:
        self.folder, self.schema = Path(folder), schema

    def path(self, kind: str, *parts: Any) -> Path:
        """File of an answer: what it is, and the fingerprint of what it belongs to."""
        return self.folder / f"{kind}-{fingerprint(*parts)[:24]}.json"

    def read(self, path: Path, build: Callable[[Mapping[str, Any]], Any]) -> Any:
        """A stored answer; None where there is none yet.

        Parameters
        ----------
        path : from :meth:`path`
        build : makes the answer from the document

        Raises
        ------
        InputError
            For a file that is no document of this schema, or that ``build`` cannot read.
        """
        if not path.exists():
            return None
        try:
            document = json.loads(path.read_text(encoding="utf-8"))
            if document["schema"] != self.schema:
                raise KeyError("schema")
            return build(document)
        except (ValueError, KeyError, TypeError):
            raise InputError(
                f"{path} is damaged or not an answer of limitmason; delete it to compute it again"
            ) from None

    def write(self, path: Path, document: Mapping[str, Any]) -> None:
        """Keep an answer."""
        text = json.dumps({"schema": self.schema, **document}, default=str, indent=1)
        write_whole(path, text + "\n")


class RowStore:
    """Numbered rows in a file of JSON lines, written one by one and found again after a kill.

    Parameters
    ----------
    path : file; made with its folder when the first row comes
    key : fingerprint of the study; a file of another study is refused

    Raises
    ------
    InputError
        When the file belongs to another study, or is no such file.

    Notes
    -----
    A last line cut off by a kill is dropped; a damaged line in the middle is an error. Numbers return bit by bit.
    """

    def __init__(self, path: str | Path, key: str) -> None:
        self.path, self.key = Path(path), key
        self.rows: dict[int, dict[str, Any]] = {}
        text = self.path.read_text(encoding="utf-8") if self.path.exists() else ""
        complete, cut = text.rpartition("\n")[0], text.rpartition("\n")[2]
        lines = complete.split("\n") if complete else []
        if not lines:
            if cut and not f'{{"schema": "{SCHEMA}"'.startswith(cut[: len(SCHEMA) + 12]):
                raise InputError(f"{self.path} is not a store of rows of limitmason")
            self._start()
            return
        self._check_header(lines[0])
        for number, line in enumerate(lines[1:], 2):
            try:
                entry = json.loads(line)
                self.rows[int(entry["number"])] = entry["row"]
            except (ValueError, KeyError, TypeError):
                raise InputError(
                    f"{self.path}, line {number} is damaged; remove the line to compute it again"
                ) from None
        if cut:
            self._rewrite(lines)

    def _start(self) -> None:
        self._rewrite([json.dumps({"schema": SCHEMA, "version": 1, "key": self.key})])

    def _check_header(self, line: str) -> None:
        try:
            header = json.loads(line)
            known = isinstance(header, dict) and header.get("schema") == SCHEMA
        except ValueError:
            known = False
        if not known:
            raise InputError(f"{self.path} is not a store of rows of limitmason")
        if header["key"] != self.key:
            raise InputError(
                f"{self.path} holds the rows of another study (other model, method, options or seed); "
                "give another file, or delete it"
            )

    def _rewrite(self, lines: list[str]) -> None:
        write_whole(self.path, "\n".join(lines) + "\n")

    def add(self, number: int, row: Mapping[str, Any]) -> None:
        """Append one finished row."""
        self.rows[number] = dict(row)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"number": number, "row": plain(row)}) + "\n")


def same(a: Any, b: Any) -> bool:
    """Equality of table entries in which NaN equals NaN."""
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b):
        return True
    return bool(a == b)
