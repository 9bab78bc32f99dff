"""The folder of the application: the only place where it reads and writes files of the user."""

from __future__ import annotations

import re
from pathlib import Path

from limitmason.errors import InputError
from limitmason.storage.files import named_path, written_whole

KINDS = (".json", ".dxf", ".svg", ".obj", ".ply", ".stl", ".off")
"""Files that the page can open."""

LARGEST = 20_000_000
"""Bytes of a file that the page may send."""

# no control character, no separator of folders, nothing that Windows refuses in a name, and no dot at the beginning;
# 119 characters at most
_NAME = re.compile(r"""[^\x00-\x1f\x7f/\\:*?"<>|.][^\x00-\x1f\x7f/\\:*?"<>|]{0,118}""")


class Folder:
    """A folder of which the files directly in it, by their bare names, may be opened.

    Parameters
    ----------
    path : of the folder

    Raises
    ------
    InputError
        When there is no such folder.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = named_path(path).resolve()
        if not self.path.is_dir():
            raise InputError(f"--folder {str(path)!r} is no folder: make it first, or give another")

    def names(self) -> list[str]:
        """Models and drawings in it."""
        return sorted(p.name for p in self.path.iterdir() if self._holds(p.name))

    def known(self, name: str) -> str:
        """A name that is that of a file in it.

        Raises
        ------
        InputError
            For a name with a path, another kind of file, a link that leaves the folder, and a file that is not there.
        """
        if not self._holds(name):
            raise InputError(f"file: {name!r} is no model or drawing in the chosen folder")
        return name

    def add(self, name: str, data: bytes) -> str:
        """Keep a file that was sent, and return its name.

        One that is there already with the same bytes stays.

        Parameters
        ----------
        name : bare file name
        data : what is in it

        Raises
        ------
        InputError
            For a name that is no bare file name of a model or drawing, and for one that is taken by another file.
        """
        if not _plain(name):
            raise InputError(f"file: {name!r} is refused: send a plain file name that ends in {', '.join(KINDS)}")
        path = self.path / name
        if path.is_symlink() or path.exists():
            if self._holds(name) and path.read_bytes() == data:
                return name
            raise InputError(f"file: {name!r} is in the chosen folder already and differs: rename one of them")
        with written_whole(path, "wb") as file:
            file.write(data)
        return name

    def _holds(self, name: str) -> bool:
        """Whether ``name`` is that of a file that can be opened and that lies in the folder, links followed."""
        path = self.path / name
        return _plain(name) and path.is_file() and path.resolve().parent == self.path


def _plain(name: str) -> bool:
    """Whether a name is a bare file name of a kind that can be opened."""
    return _NAME.fullmatch(name) is not None and Path(name).suffix.lower() in KINDS
