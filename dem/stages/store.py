"""A run's samples, column by column: in memory, or in files read where needed."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.arrays import Index
from limitmason.errors import InputError
from limitmason.model import Assembly
from limitmason.storage.files import named_path, read_json, write_text

try:
    import fcntl
except ImportError:  # no locks on this system: one process at a time
    fcntl = None  # type: ignore[assignment]

LAYOUT, CHECKPOINT = "layout.json", "checkpoint.npz"


@dataclass(frozen=True)
class Store:
    """Folder of the samples of a simulation: a history of any length takes no memory.

    Parameters
    ----------
    folder : is made; one that holds a run already is refused
    blocks : names or numbers of the blocks whose displacement and rotation are kept; all by default
    joints : whether the marks of all joints are kept (opening, slip, crushing, strength in use)

    Notes
    -----
    Every quantity is a file of 8-byte numbers, least byte first, one sample after the other. ``layout.json`` names them
    with the shape of a sample. ``checkpoint.npz`` holds the rest of the history and the state from which
    :func:`dem.resume` goes on. What a killed run wrote after its last checkpoint is left out when it is read.
    """

    folder: str | Path
    blocks: Sequence[int | str] | None = None
    joints: bool = True

    @property
    def checkpoint(self) -> Path:
        """File of the state and of all that is no sample."""
        return named_path(self.folder) / CHECKPOINT

    def recorded(self, assembly: Assembly) -> Index:
        """Numbers of the blocks that are kept, in their order."""
        chosen = range(assembly.n_blocks) if self.blocks is None else map(assembly.block_index, self.blocks)
        return np.array(sorted(set(chosen)), dtype=np.intp)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Make the folder, and keep other runs from writing to it meanwhile.

        Raises
        ------
        InputError
            For a file of that name, and a folder to which another run writes.
        """
        folder = named_path(self.folder)
        if folder.exists() and not folder.is_dir():
            raise InputError(f"the store {folder} is a file: give a folder")
        folder.mkdir(parents=True, exist_ok=True)
        if fcntl is None:
            yield
            return
        held = os.open(folder, os.O_RDONLY)  # a lock of the folder itself, which ends with this process at the latest
        try:
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"another run writes to {folder} now: wait for its end, or give another folder"
                ) from None
            yield
        finally:
            os.close(held)

    def check_free(self) -> None:
        """Refuse a folder that holds a run that can be taken up or read, or files of somebody else."""
        if self.checkpoint.exists():
            raise InputError(
                f"{self.folder} holds a run already: go on with dem.resume(dem.History.load({str(self.folder)!r}, "
                "assembly), stages), or give another folder"
            )
        folder = named_path(self.folder)
        if (folder / LAYOUT).exists():
            _shapes(folder)  # left by a run that was killed before its first checkpoint
        elif others := sorted(folder.glob("*.f8")):
            raise InputError(f"{others[0]} is of no run, and would be lost: give another folder")


class Samples:
    """Columns of a record, an entry for every sample.

    Parameters
    ----------
    shapes : of an entry of each
    """

    def __init__(self, **shapes: tuple[int, ...]) -> None:
        self.shapes = shapes
        self.columns: dict[str, list[Any]] = {name: [] for name in shapes}

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def add(self, **entry: Any) -> None:
        """Write a sample down."""
        for name, values in self.columns.items():
            values.append(entry[name])

    def take_up(self, arrays: Mapping[str, Any]) -> None:
        """Go on with the samples of a run before, from arrays as of :meth:`arrays`."""
        self.columns = {name: list(arrays[name]) for name in self.columns}

    def arrays(self) -> dict[str, Any]:
        """All samples of every column, shape (samples, ...)."""
        every = self.columns.items()
        return {name: np.array(values).reshape(len(values), *self.shapes[name]) for name, values in every}


class StoredSamples(Samples):
    """Columns of a record that are files, an entry for every sample.

    Parameters
    ----------
    folder : of the files
    shapes : of an entry of each column
    count : samples that are there and count
    """

    def __init__(self, folder: str | Path, shapes: Mapping[str, tuple[int, ...]], count: int = 0) -> None:
        super().__init__(**shapes)
        self.folder, self.count = named_path(folder), count
        self.columns = {}

    def __len__(self) -> int:
        return self.count

    @classmethod
    def read(cls, folder: str | Path, count: int) -> StoredSamples:
        """Those of a folder that was written before.

        Parameters
        ----------
        count : samples that were recorded

        Raises
        ------
        InputError
            For a folder that lacks something, by name.
        """
        if not (named_path(folder) / LAYOUT).exists():
            raise InputError(f"{folder} lacks {LAYOUT!r}: no run was stored there")
        out = cls(folder, _shapes(folder), count)
        for name in out.shapes:
            # a file may be longer than that: a run that was killed wrote on after its last checkpoint
            file, size = out._file(name), count * out._row(name)
            if size and (not file.exists() or file.stat().st_size < size):
                raise InputError(f"{file} is shorter than the {count} samples of the run: it was cut short")
        return out

    def begin(self) -> None:
        """Write the layout, and cut the files to the samples that count."""
        self.folder.mkdir(parents=True, exist_ok=True)
        columns = {name: list(shape) for name, shape in self.shapes.items()}
        write_text(self.folder / LAYOUT, json.dumps({"type": "<f8", "columns": columns}, indent=1))
        for name in self.shapes:
            with self._file(name).open("ab") as file:
                file.truncate(self.count * self._row(name))

    def add(self, **entry: Any) -> None:
        """Write a sample down."""
        for name, shape in self.shapes.items():
            row = np.ascontiguousarray(entry[name], dtype="<f8").reshape(shape)
            with self._file(name).open("ab") as file:
                file.write(row.tobytes())
        self.count += 1

    def take_up(self, arrays: Mapping[str, Any]) -> None:
        """Go on after the samples of a run before, whose arrays are those of the files.

        Of the arrays only their length counts: what a killed run wrote behind its last checkpoint is cut off.
        """
        self.count = len(arrays["rows"])
        self.begin()

    def arrays(self) -> dict[str, Any]:
        """All samples of every column, shape (samples, ...), read where looked at."""
        # a column of no samples, or of entries without numbers, has an empty file, which cannot be mapped
        return {
            name: np.memmap(self._file(name), "<f8", "r", shape=(self.count, *shape))
            if self.count and self._row(name) else np.zeros((self.count, *shape))
            for name, shape in self.shapes.items()
        }

    def _file(self, name: str) -> Path:
        """File of the column of a name."""
        return self.folder / f"{name}.f8"

    def _row(self, name: str) -> int:
        """Bytes of a sample of the column of a name."""
        return 8 * int(np.prod(self.shapes[name], dtype=np.int64))


def _shapes(folder: str | Path) -> dict[str, tuple[int, ...]]:
    """Names of the columns of a store with the shapes of their entries, as its layout says.

    Raises
    ------
    InputError
        For a file of that name that is something else.
    """
    layout = named_path(folder) / LAYOUT
    said = read_json(layout)
    columns = said.get("columns") if isinstance(said, dict) else None
    if not columns or not isinstance(columns, dict) or not all(
        isinstance(shape, list) and all(isinstance(n, int) for n in shape) for shape in columns.values()
    ):
        raise InputError(f"{layout} is no layout of a run: it is damaged or of something else; give another folder")
    return {name: tuple(shape) for name, shape in columns.items()}
