"""Triangle meshes in PLY, STL, OFF or OBJ: files, folders and archives of them, and blocks exactly as drawn.

Corners at one place are made one, and bodies told apart, in ``geometry.shells``.
"""

from __future__ import annotations

import re
import zipfile
import zlib
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
from limitmason.geometry.shells import Shell, bodies_of_triangles, with_hollows
from limitmason.model.plausibility import warn
from limitmason.storage.files import named_path, needed

MESHES = (".ply", ".stl", ".obj", ".off")
_TURNS = {"x": ([1, 2, 0], [1, 1, 1]), "y": ([0, 2, 1], [1, -1, 1]), "z": ([0, 1, 2], [1, 1, 1])}
"""By the axis of a file that points up: the axes that become x, y and z, and their signs, right-handed."""


_ROUNDED = 1e-3
"""Rounding of corners over the least side of a body from which on a file is warned of; chosen."""


class MeshBody(NamedTuple):
    """A body of a file: its name, corners [m], shape (n, 3), triangles, shape (m, 3), and signed volume [m3]."""

    name: str
    corners: Array
    triangles: Index
    volume: float


def read_solids(path: str | Path | Sequence[str | Path], *, scale: float = 1.0, up: str = "z") -> Solids:
    """Read blocks exactly as they are drawn, one from every file or body.

    Bodies of a file are told apart where it is the only one. This is for blocks that meet, as a modelling program
    exports them. Notches and openings stay: ``Assembly.from_polyhedra`` divides what is not convex into convex parts of
    one rigid body, and refuses a surface that is not closed. For scans with mortar between, :func:`read_stones`.

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
        shells, lost = with_hollows([(b, Shell(b.corners, b.volume)) for b in group])
        if lost is not None:
            raise InputError(f"{lost.name}: its faces run clockwise seen from outside; turn its normals outwards")
        for shell in shells:
            solids.append([_solid(shell)])
            names.append(shell[0].name)
    return Solids(solids, names)


def bodies(path: str | Path | Sequence[str | Path], *, scale: float, up: str) -> Iterator[list[MeshBody]]:
    """Bodies of every file, as a list for each.

    A file that comes alone is split into its closed shells: it may hold a whole structure, whose bodies may share
    corners, edges and faces. Of several files each is one body, as programs write them that export part by part, even
    where its faces hang together loosely. Nothing that is missing is made up: what is open stays open.

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
            mesh: Any = trimesh.load(BytesIO(content), file_type=suffix[1:], force="mesh", process=False)
        except Exception as error:  # its readers raise whatever they meet
            raise InputError(f"{name}{suffix}: not a mesh that can be read: {error}") from None
        # some versions of trimesh give a list where there is nothing
        if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
            raise InputError(f"{name}{suffix}: not a mesh that can be read: it holds no faces")
        corners = np.array(mesh.vertices, dtype=float)[:, order] * signs * scale
        triangles = np.array(mesh.faces, dtype=np.intp)
        if not np.isfinite(corners[triangles]).all():
            raise InputError(f"{name}{suffix}: a coordinate is not finite (NaN or infinite)")
        shells = bodies_of_triangles(corners, triangles, whole=len(files) > 1)
        if not shells:
            raise InputError(f"{name}{suffix}: not a mesh that can be read: none of its faces has an area")
        found = [
            _body(name if len(shells) == 1 else f"{name}-{k + 1}", corners, shell) for k, shell in enumerate(shells)
        ]
        _warn_of_precision(f"{name}{suffix}", np.array(mesh.vertices, dtype=float), scale, found)
        yield found


def _warn_of_precision(file: str, vertices: Array, scale: float, found: Sequence[MeshBody]) -> None:
    """Warn of bodies far from the origin of a file that holds single precision.

    Their corners are rounded by it.

    Parameters
    ----------
    file : its name
    vertices : as the file has them, in its units, shape (n, 3)
    scale : metres per unit of the file
    found : bodies of the file
    """
    single = vertices.astype(np.float32)
    if not file.endswith((".stl", ".ply")) or not np.array_equal(single, vertices):  # others are written in digits
        return
    step = scale * float(np.spacing(np.abs(single).max()))  # [m]
    least, body = min((float(np.ptp(b.corners, axis=0).min()), b.name) for b in found)
    if step > _ROUNDED * least:
        warn(
            f"{file}: so far from its origin single precision rounds corners to {step:.2g} m, and {body!r} measures "
            f"{least:.2g} m: move the structure to the origin in the program that drew it, and export again"
        )


def _body(name: str, corners: Array, triangles: Index) -> MeshBody:
    """A body with its own corners.

    Its volume, the sum of a . (b x c) / 6 over triangles a, b, c, is taken about the mean of the corners. So even that
    of an open mesh is the same wherever it lies.

    Parameters
    ----------
    name : of the body
    corners : of the file [m], shape (n, 3)
    triangles : of the body, by number of the corners, shape (m, 3)
    """
    used, own = np.unique(triangles, return_inverse=True)
    own = own.reshape(-1, 3)
    a, b, c = ((corners[used] - corners[used].mean(axis=0))[own[:, k]] for k in range(3))
    return MeshBody(name, corners[used], own, float(np.einsum("ni,ni->", a, np.cross(b, c))) / 6.0)


def _solid(shell: Sequence[MeshBody]) -> Solid:
    """One closed surface of an outer body and its hollows.

    Parameters
    ----------
    shell : the outer body first, then its hollows
    """
    # corners are numbered through all bodies
    first = np.cumsum([0, *(len(b.corners) for b in shell[:-1])])
    faces = np.vstack([b.triangles + n for b, n in zip(shell, first, strict=True)])
    corners = np.vstack([b.corners for b in shell])
    return Solid(corners, tuple(tuple(int(i) for i in f) for f in faces))


def _files(path: str | Path | Sequence[str | Path]) -> Iterator[tuple[str, str, bytes]]:
    """Name, suffix in lower case, and content of every mesh.

    Those of a folder or a .zip come in the order of their names, stone-2 before stone-10.

    Parameters
    ----------
    path : a file, a folder, a .zip, or a list of files, whose order stays
    """
    several = [named_path(p) for p in (path if isinstance(path, (list, tuple)) else [path])]
    if len(several) == 1 and several[0].suffix.lower() == ".zip":
        try:
            with zipfile.ZipFile(several[0]) as archive:
                found = {Path(name): name for name in archive.namelist() if _is_mesh(Path(name))}
                for p in sorted(found, key=_natural):
                    yield p.stem, p.suffix.lower(), archive.read(found[p])
        except (zipfile.BadZipFile, zlib.error, EOFError) as error:
            raise InputError(f"{several[0]}: cut off, damaged or no archive: {error}") from None
        return
    if len(several) == 1 and several[0].is_dir():
        several = sorted((p for p in several[0].iterdir() if _is_mesh(p)), key=_natural)
    for p in several:
        if p.suffix.lower() not in MESHES:
            raise InputError(f"{p}: a mesh is a file {', '.join(MESHES)}")
        yield p.stem, p.suffix.lower(), p.read_bytes()


def _is_mesh(path: Path) -> bool:
    """Whether a file of a folder or archive is a mesh by its name.

    Those that begin with a full stop are none: some systems put notes of that name beside every file.
    """
    return path.suffix.lower() in MESHES and not path.name.startswith(".")


def _natural(path: Path) -> tuple[str, int, str]:
    """Key by which files are sorted, by the number at the end of the name.

    stone-2 is before stone-10.
    """
    number = re.search(r"[0-9]*$", path.stem)
    digits = number[0] if number else ""
    return path.stem.removesuffix(digits), int(digits or 0), path.stem
