"""Files: written whole or not at all, and read with errors that name them and say what to do."""

from __future__ import annotations

import json
import os
import shutil
import struct
import uuid
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from limitmason.errors import InputError

DEEPEST = 100
"""Levels of lists and mappings in each other that a JSON file may have."""

LONGEST_INTEGER = 300
"""Digits of an integer in a JSON file; longer ones are no floating-point number."""

_CONTEXT = 20
"""Characters before and after a wrong one that an error shows; chosen."""


def needed(module: str, what: str, extra: str) -> Any:
    """A library that is no dependency, or an error that says how to install it.

    Parameters
    ----------
    module : its name, as imported
    what : what needs it, in the plural, for the error
    extra : the extra of limitmason that installs it
    """
    try:
        return import_module(module)
    except ImportError:
        install = f"pip install 'limitmason[{extra}]' (or pip install {module})"
        raise ImportError(f"{what} need {module}: {install}") from None


def named_path(path: object) -> Path:
    """A path, in which a leading ``~`` is the home folder, or an error where it is none."""
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"path must be the name of a file, got {path!r}")
    return Path(os.path.expanduser(path))  # a name that is no user's stays as it is


@contextmanager
def written_whole(path: str | Path, mode: str = "w", *, newline: str | None = None) -> Iterator[IO[Any]]:
    """A file that takes the place of ``path`` when all of it is written.

    Its folder is made. Writes go to a file of a name of its own beside it. An error, a full disk, a kill or another
    process that writes the same file leave the old one, or one whole new one.

    Parameters
    ----------
    path : of the file; where a link is given, the file behind it
    mode : "w" for text in UTF-8, "wb" for bytes
    newline : how ends of lines are written, as for ``open``

    Raises
    ------
    InputError
        For text that is no Unicode, such as half of a surrogate pair in a name, and a path that is none.
    OSError
        Naming ``path``, for a full disk or a folder that may not be written.
    """
    path = Path(os.path.realpath(named_path(path)))  # a link stays one
    if path.exists() and not path.is_file() and not path.is_dir():  # a pipe or a terminal has no file beside it
        with path.open(mode, encoding=None if "b" in mode else "utf-8") as file:
            yield file
        return
    # cut short, as file systems limit the length of names
    beside = path.with_name(f".{path.name[:100]}.{os.getpid()}-{uuid.uuid4().hex[:8]}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with beside.open(mode.replace("w", "x"), encoding=None if "b" in mode else "utf-8", newline=newline) as file:
            yield file
            file.flush()
            os.fsync(file.fileno())  # on the disk before it takes the place of the old one
        if path.exists():
            shutil.copymode(path, beside)
        os.replace(beside, path)
    except UnicodeEncodeError as error:
        raise _half_a_character(error, path) from None
    except OSError as error:
        # of another file, that the caller reads while it writes this one
        if error.filename is not None and str(error.filename) not in (str(beside), str(path)):
            raise
        kept = "; the file is as it was before" if path.is_file() else ""
        raise OSError(error.errno, f"{error.strerror}{kept}", str(path)) from None
    finally:
        beside.unlink(missing_ok=True)


def utf8(text: str, path: object) -> bytes:
    """A text as bytes for the file ``path``, which an error names.

    Half of a character is refused as by :func:`written_whole`.
    """
    try:
        return text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise _half_a_character(error, path) from None


def _half_a_character(error: UnicodeEncodeError, path: object) -> InputError:
    """The error of a text that cannot be written, naming what is wrong in it."""
    text = error.object[max(error.start - _CONTEXT, 0) : error.end + _CONTEXT]
    return InputError(
        f"{path} is not written: {text!r} holds half of a character (a lone surrogate), which no file keeps; rename "
        "what is called so"
    )


def write_text(path: str | Path, text: str, *, newline: str | None = None) -> Path:
    """Write a text whole or not at all, and return its path.

    ``newline`` says how ends of lines are written, see :func:`written_whole`.
    """
    with written_whole(path, newline=newline) as file:
        file.write(text)
    return named_path(path)


def save_figure(figure: Any, path: str | Path, *, dpi: float = 200) -> None:
    """Write a figure of matplotlib whole or not at all.

    The format is that of the ending of its name. ``dpi`` are dots per inch, for formats that have dots.
    """
    with written_whole(path, "wb") as file:
        figure.savefig(file, format=Path(path).suffix[1:].lower() or "png", dpi=dpi)


def as_json(value: Any) -> NDArray[np.str_]:
    """Words and numbers as a text in JSON that an archive keeps, see :func:`of_json`."""
    return np.array(json.dumps(value, default=np.generic.item))


def write_archive(path: str | Path, arrays: Mapping[str, Any], *, compressed: bool = False) -> None:
    """Write arrays to a numpy archive, whole or not at all, see :func:`written_whole`."""
    with written_whole(path, "wb") as file:
        (np.savez_compressed if compressed else np.savez)(file, **arrays)


def read_text(path: str | Path) -> str:
    """Text of the file ``path`` in UTF-8.

    Raises
    ------
    InputError
        For bytes that are no UTF-8, by the name of the file and their place.
    """
    data = named_path(path).read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: not a text file in UTF-8: {error.reason} at byte {error.start}; save it as UTF-8, or give another"
        ) from None


def parsed_json(text: str, name: object) -> Any:
    """What a text in JSON holds.

    Parameters
    ----------
    text : of the file
    name : of its file, for errors

    Raises
    ------
    InputError
        For text that is no JSON, by line and column; a key given twice in one object; an integer of more than 300
        digits; and nesting beyond 100 levels.
    """

    def mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        """An object of the file, refused where a key is given twice."""
        out = dict(pairs)
        if len(out) < len(pairs):
            keys = [key for key, _ in pairs]
            twice = next(key for key in keys if keys.count(key) > 1)
            raise InputError(f"{name}: key {twice!r} is given twice in one object")
        return out

    def integer(digits: str) -> int:
        """An integer of the file, refused where it is too long."""
        if len(digits) > LONGEST_INTEGER:
            raise InputError(f"{name}: the number {digits[:12]}... has {len(digits)} digits, more than a number may")
        return int(digits)

    try:
        value = json.loads(text, parse_int=integer, object_pairs_hook=mapping)
    except json.JSONDecodeError as error:
        raise InputError(f"{name}: line {error.lineno}, column {error.colno}: not JSON: {error.msg}") from None
    except RecursionError:
        raise InputError(f"{name}: nested too deeply, {DEEPEST} levels are the most") from None
    # level by level without recursion: what is done with the value later recurses
    level = [value]
    for _ in range(DEEPEST + 1):
        inside = (v.values() if isinstance(v, dict) else v for v in level if isinstance(v, dict | list))
        level = [v for values in inside for v in values]
        if not level:
            return value
    raise InputError(f"{name}: nested too deeply, {DEEPEST} levels are the most")


def read_json(path: str | Path) -> Any:
    """What a file in JSON holds.

    Errors as of :func:`read_text` and :func:`parsed_json`.
    """
    return parsed_json(read_text(path), path)


def of_json(file: Mapping[str, Any], name: str) -> Any:
    """What :func:`as_json` has made an entry of an archive of."""
    return json.loads(str(file[name]))


class Archive(dict[str, Any]):
    """Arrays of a file by name; one that is not there is an error that names the file and it."""

    def __init__(self, path: object, arrays: Mapping[str, Any]) -> None:
        super().__init__(arrays)
        self.path = path

    def __missing__(self, name: str) -> NDArray[Any]:
        """Refuse a name that is not there, as the lookup of a dict asks for it."""
        raise InputError(
            f"{self.path} lacks {name!r}: it is a file of something else, was cut short, or is of another version of "
            "this package"
        )

    def group(self, name: str, mark: str = ".") -> Archive:
        """Arrays whose names begin with that of a group and a mark.

        They are called by what follows.
        """
        begin = f"{name}{mark}"
        return Archive(self.path, {k.removeprefix(begin): v for k, v in self.items() if k.startswith(begin)})


# what reading damaged archives raises beside its own errors: a byte may name a place before the file (OSError), a
# compression that there is not (NotImplementedError) or a password (RuntimeError)
_DAMAGED = (ValueError, EOFError, KeyError, OSError, NotImplementedError, RuntimeError)


def read_archive(path: str | Path) -> Archive:
    """All arrays of the numpy archive ``path`` by name.

    Raises
    ------
    InputError
        For a file that is cut off, damaged, or no archive.
    """
    if not named_path(path).is_file():
        raise InputError(f"there is no file {path}")
    try:
        with np.load(named_path(path), allow_pickle=False) as file:
            return Archive(path, {name: file[name] for name in file.files})
    except PermissionError:
        raise
    except (*_DAMAGED, zipfile.BadZipFile, zlib.error, struct.error) as error:
        raise InputError(
            f"{path} is cut off, damaged or no archive of arrays ({error}); delete it to begin anew, or give another"
        ) from None
