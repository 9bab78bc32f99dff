"""Triangle meshes in PLY, STL, OFF or OBJ: files, folders and archives of them, and blocks exactly as drawn."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.checks import choice, positive
from limitmason.errors import InputError
from limitmason.formats.obj import Solids
from limitmason.geometry import Solid
from limitmason.storage.files import needed

MESHES = (".ply", ".stl", ".obj", ".off")
_TURNS = {"x": ([1, 2, 0], [1, 1, 1]), "y": ([0, 2, 1], [1, -1, 1]), "z": ([0, 1, 2], [1, 1, 1])}
"""By the axis of a file that points up: the axes that become x, y and z, and their signs, right-handed."""


class MeshBody(NamedTuple):
    """A body of a file: its name, corners [m], shape (n, 3), triangles, shape (m, 3), and signed volume [m3]."""

    name: str
    corners: Array
    triangles: Index
    volume: float


def read_solids(path: str | Path | Sequence[str | Path], *, scale: float = 1.0, up: str = "z") -> Solids:
    """Read blocks exactly as they are drawn.

    One from every file, or from every body where one file holds all.

    For blocks that meet, as a modelling program exports them. Notches and openings stay: ``Assembly.from_polyhedra``
    divides what is not convex into convex parts of one rigid body, and refuses a surface that is not closed. For scans
    with mortar between, :func:`read_stones`.

    Parameters
    ----------
    path : files (.ply, .stl, .off, .obj), a folder or a .zip of them, or one file with several bodies; an .obj with
        named objects is better read by :func:`read_obj`, which keeps the names
    scale : metres per unit of the files
    up : axis of the files that points up: "x", "y" or "z"

    Returns
    -------
    Solids
        ``solids, names``; names are those of the files.

    Raises
    ------
    ImportError
        When trimesh is not installed; the message says how to install it.
    InputError
        Naming the file: not a mesh, or a hollow that lies in no body.
    """
    solids, names = [], []
    for group in bodies(path, scale=scale, up=up):
        # faces of a hollow run the other way, so that its volume is negative; where all run so, nothing is hollow
        outer = [b for b in group if b.volume >= 0.0] or list(group)
        shells: list[list[MeshBody]] = [[b] for b in outer]
        for hollow in (b for b in group if not any(b is o for o in outer)):
            around = [s for s in shells if _within(hollow, s[0])]
            if not around:
                raise InputError(f"{hollow.name}: its faces run clockwise seen from outside; turn its normals outwards")
            # of bodies in each other the innermost
            min(around, key=lambda s: s[0].volume).append(hollow)
        for shell in shells:
            solids.append([_solid(shell)])
            names.append(shell[0].name)
    return Solids(solids, names)


def bodies(path: str | Path | Sequence[str | Path], *, scale: float, up: str) -> Iterator[list[MeshBody]]:
    """Bodies of every file, as a list for each.

    A file that comes alone is split into its connected shells: it may hold a whole structure. Of several files each is
    one body, as programs write them that export part by part, even where its faces hang together loosely.

    Parameters
    ----------
    path : files, a folder or a .zip of them, or one file with several bodies
    scale : metres per unit of the files
    up : axis of the files that points up: "x", "y" or "z"
    """
    choice("up", up, _TURNS)
    positive("scale", scale, "m per unit")
    trimesh = needed("trimesh", "meshes", "solids")
    files = list(_files(path))
    if not files:
        raise InputError(f"{path}: no file {', '.join(MESHES)} there")
    order, signs = (np.array(t) for t in _TURNS[up])
    for name, suffix, content in files:
        try:
            mesh: Any = trimesh.load(BytesIO(content), file_type=suffix[1:], force="mesh")
        except Exception as error:  # its readers raise whatever they meet
            raise InputError(f"{name}{suffix}: not a mesh that can be read: {error}") from None
        # some versions of trimesh give a list where there is nothing
        if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
            raise InputError(f"{name}{suffix}: not a mesh that can be read: it holds no faces")
        parts = [mesh] if len(files) > 1 else list(mesh.split(only_watertight=False))
        yield [
            MeshBody(
                name if len(parts) == 1 else f"{name}-{k + 1}",
                np.array(part.vertices, dtype=float)[:, order] * signs * scale,
                np.array(part.faces, dtype=np.intp),
                float(part.volume) * scale**3,
            )
            for k, part in enumerate(parts)
        ]


def _within(body: MeshBody, other: MeshBody) -> bool:
    """Whether the box of a body lies in that of another.

    That is enough to tell in which one a hollow is.
    """
    low, high = other.corners.min(axis=0), other.corners.max(axis=0)
    return bool((body.corners >= low).all() and (body.corners <= high).all())


def _solid(shell: Sequence[MeshBody]) -> Solid:
    """One closed surface of an outer body and its hollows.

    Parameters
    ----------
    shell : the outer body first, then its hollows
    """
    # corners are numbered through all bodies
    first = np.cumsum([0, *(len(b.corners) for b in shell[:-1])])
    faces = np.vstack([b.triangles + n for b, n in zip(shell, first, strict=True)])
    # triangles two of whose corners are one have no area, and no normal
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    corners = np.vstack([b.corners for b in shell])
    return Solid(corners, tuple(tuple(int(i) for i in f) for f in faces[whole]))


def _files(path: str | Path | Sequence[str | Path]) -> Iterator[tuple[str, str, bytes]]:
    """Name, suffix in lower case, and content of every mesh.

    Those of a folder or a .zip come in the order of their names, stone-2 before stone-10.

    Parameters
    ----------
    path : a file, a folder, a .zip, or a list of files, whose order stays
    """
    several = [Path(p) for p in path] if isinstance(path, (list, tuple)) else [Path(str(path))]
    if len(several) == 1 and several[0].suffix.lower() == ".zip":
        with zipfile.ZipFile(several[0]) as archive:
            found = {Path(name): name for name in archive.namelist() if Path(name).suffix.lower() in MESHES}
            for p in sorted(found, key=_natural):
                yield p.stem, p.suffix.lower(), archive.read(found[p])
        return
    if len(several) == 1 and several[0].is_dir():
        several = sorted((p for p in several[0].iterdir() if p.suffix.lower() in MESHES), key=_natural)
    for p in several:
        if p.suffix.lower() not in MESHES:
            raise InputError(f"{p}: a mesh is a file {', '.join(MESHES)}")
        yield p.stem, p.suffix.lower(), p.read_bytes()


def _natural(path: Path) -> tuple[str, int, str]:
    """Key by which files are sorted, by the number at the end of the name.

    stone-2 is before stone-10.
    """
    number = re.search(r"[0-9]*$", path.stem)
    digits = number[0] if number else ""
    return path.stem.removesuffix(digits), int(digits or 0), path.stem
