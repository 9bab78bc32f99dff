"""The memory of runs: each computed once, kept in a file as it comes, found again after a kill, by any process."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np

from limitmason.constants import VERSION
from limitmason.errors import InputError
from limitmason.storage.files import named_path, parsed_json
from limitmason.storage.interrupts import handed_on
from limitmason.study.workers import Unfinished, run_points

try:
    import fcntl
except ImportError:  # no locks on this system: one process at a time
    fcntl = None  # type: ignore[assignment]

SCHEMA = "limitmason-runs"

_as_text = json.JSONEncoder(sort_keys=True).encode  # json.dumps makes an encoder for every call

_PLAIN = frozenset((bool, int, float, str, type(None)))

_TOLD = 20  # bytes of a header that are the same whatever version and study it names


class Memo:
    """Results of runs by key, in memory and in a file of JSON lines.

    Parameters
    ----------
    path : file, made with its folder when the first result comes; None keeps results in memory only
    of : fingerprint of the study that all of them belong to; empty where every key says what its result belongs to
    kind : type of the results; another one in the file is damage

    Attributes
    ----------
    rows : dict
        Results by key, as JSON keeps them: a key is what :func:`key_text` makes of it.

    Raises
    ------
    InputError
        For a file of another study, of another version, or no such file; and for damage, by line.

    Notes
    -----
    Several processes may share a file, and begin it at once: every line is written under a lock. A last line that a
    kill or a full disk has cut off is dropped; what was written before stays. Numbers return bit by bit.
    """

    def __init__(self, path: str | Path | None, of: str = "", *, kind: type | tuple[type, ...] = object) -> None:
        """Open a store of runs and read what it holds.

        Parameters
        ----------
        path, of, kind : see the class
        """
        self.path = None if path is None else named_path(path)
        self._file = None if path is None else named_path(path).absolute()  # a run may go to another folder
        self.of, self.kind = of, kind
        self.rows: dict[str, Any] = {}
        if self.path is not None and self.path.is_dir():
            raise InputError(f"{self.path} is a folder: give a file")
        if self.path is not None and self.path.exists():
            with self.path.open("rb") as file, _locked(file, shared=True):
                self._read(file.read())

    def __len__(self) -> int:
        return len(self.rows)

    def __contains__(self, key: Any) -> bool:
        return key_text(key) in self.rows

    def __getitem__(self, key: Any) -> Any:
        return self.rows[key_text(key)]

    def once(self, key: Any, compute: Callable[[], Any]) -> Any:
        """The result of a key, computed and kept where there is none yet."""
        if key in self:
            return self[key]
        self.check_writable()
        with handed_on():
            result = compute()
        return self.keep(key, result)

    def keep(self, key: Any, result: Any) -> Any:
        """Keep a result, and return it as it is read back."""
        text, row = key_text(key), plain(result)
        if self.path is not None:
            self._append({"key": json.loads(text), "row": row})
        self.rows[text] = row
        return row

    def map(
        self, function: Callable[..., Any], jobs: Mapping[Any, Mapping[str, Any]], *, executor: Any = None,
        workers: int = 1, row: Callable[[Any, Any], Any] = lambda _, result: result,
    ) -> Iterator[tuple[Any, Any]]:
        """Compute the jobs that are not kept yet, and keep each as it is done.

        Parameters
        ----------
        function : called with the keywords of a job
        jobs : keywords of the function, by key
        executor, workers : as for :func:`limitmason.study.sweep`
        row : row(key, result) is what is kept in place of the result itself

        Yields
        ------
        key, kept : of computed jobs alone, in the order in which they end; those that were kept before are in the memo.
            A job whose function raises :class:`Unfinished` is neither kept nor given
        """
        # calls run by number: workers hand back numbers, and keys may be anything
        missing = [key for key in jobs if key not in self]
        numbered = [(k, jobs[key]) for k, key in enumerate(missing)]
        if missing:
            self.check_writable()
        with closing(run_points(function, numbered, executor, workers)) as results:
            for k, result in results:
                if not isinstance(result, Unfinished):
                    yield missing[k], self.keep(missing[k], row(missing[k], result))

    def check_writable(self) -> None:
        """Make the file where there is none, so that no run is computed that could not be kept.

        Raises
        ------
        OSError
            Naming what may not be written.
        """
        if self._file is not None:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            self._file.open("ab").close()

    # ---- the file ------------------------------------------------------------------------------------------------

    def _read(self, data: bytes) -> None:
        """Take over the rows of a file from its bytes; a torn last line is left out."""
        whole = data[: data.rfind(b"\n") + 1]  # lines that are complete
        if not whole:
            # a kill may have cut off the first line: what is there must begin as a header does
            if not self._header().startswith(data[:_TOLD]):
                raise InputError(f"{self.path} is not a store of runs of limitmason: give another file")
            return
        for number, line in enumerate(whole.splitlines(), 1):
            if number == 1:
                self._check_header(line)
                continue
            try:
                entry = parsed_json(line.decode("utf-8"), self.path)
                text, row = key_text(entry["key"]), entry["row"]
            except (ValueError, KeyError, TypeError):
                entry = None
            if entry is None or not isinstance(row, self.kind):
                raise InputError(f"{self.path}, line {number} is damaged; remove the line to compute it again")
            self.rows[text] = row

    def _header(self) -> bytes:
        """First line of the file: what it is, its version, and the study of its rows."""
        return json.dumps({"schema": SCHEMA, "limitmason": VERSION, "of": self.of}).encode() + b"\n"

    def _check_header(self, line: bytes) -> None:
        """Refuse a file whose first ``line`` says that it is no store of this study.

        It may be no store at all, or one of another version or of another study.
        """
        try:
            header = json.loads(line)
        except ValueError:
            header = None
        schema = header.get("schema") if isinstance(header, dict) else None
        if schema == "limitmason-rows":
            raise InputError(f"{self.path} was written before limitmason 0.2: delete it, or give another file")
        if schema != SCHEMA:
            raise InputError(f"{self.path} is not a store of runs of limitmason: give another file")
        if header.get("limitmason") != VERSION:
            raise InputError(
                f"{self.path} was written by limitmason {header.get('limitmason')}, whose answers may differ from "
                f"those of {VERSION}: delete it, or give another file"
            )
        if header.get("of") != self.of:
            raise InputError(
                f"{self.path} holds the runs of another study (other model, function, method, options or seed): give "
                "another file, or delete it"
            )

    def _append(self, entry: Mapping[str, Any]) -> None:
        """Write an entry, key and row, at the end of the file, behind the header.

        Other processes may write to the file too.
        """
        assert self._file is not None
        line = json.dumps(entry).encode() + b"\n"
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("ab+", buffering=0) as file, _locked(file):
            end = _whole(file)  # where the last whole line ends
            try:
                if end == 0:
                    line = self._header() + line
                elif not self.rows:  # begun by another process
                    file.seek(0)
                    self._check_header(file.readline())
                # a write may take a part only
                while line:
                    line = line[file.write(line) :]
            except OSError as error:
                os.ftruncate(file.fileno(), end)  # without what was written of this entry
                kept = "what was computed before is kept: make room, and start again"
                raise OSError(error.errno, f"{error.strerror}; {kept}", str(self.path)) from None


def _whole(file: IO[bytes]) -> int:
    """Cut off what follows the last whole line of a file; where that ends [bytes]."""
    end = file.seek(0, os.SEEK_END)
    if end:
        file.seek(end - 1)
        if file.read(1) != b"\n":
            file.seek(0)
            end = file.read().rfind(b"\n") + 1
            file.truncate(end)
    return end


@contextmanager
def _locked(file: IO[bytes], *, shared: bool = False) -> Iterator[None]:
    """Keep other processes from writing to an open file meanwhile.

    Parameters
    ----------
    file : open
    shared : whether others may read meanwhile
    """
    if fcntl is None:
        yield
        return
    fcntl.flock(file, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
    try:
        yield
    finally:
        fcntl.flock(file, fcntl.LOCK_UN)


def key_text(key: Any) -> str:
    """A key as text, equal for what JSON does not tell apart, as a tuple and a list."""
    return _as_text(plain(key))


def plain(value: Any) -> Any:
    """A value as JSON keeps it: numpy scalars and arrays become numbers and lists.

    Raises
    ------
    TypeError
        For what JSON does not keep.
    """
    if type(value) in _PLAIN:  # most are, and the questions below take time
        return value
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
