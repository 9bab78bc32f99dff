"""Triangle meshes in PLY, STL, OFF or OBJ: files, folders and archives of them, and blocks exactly as drawn."""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

from limitmason.arrays import Array, Index
from limitmason.checks import choice, positive
from limitmason.errors import InputError
from limitmason.formats.obj import Solids
from limitmason.geometry import Solid
from limitmason.storage.files import needed

MESHES = (".ply", ".stl", ".obj", ".off")
_TURNS = {"x": ([1, 2, 0], [1, 1, 1]), "y": ([0, 2, 1], [1, -1, 1]), "z": ([0, 1, 2], [1, 1, 1])}
"""By the axis of a file that points up: the axes that become x, y and z, and their signs, right-handed."""

_ONE_PLACE = 1e-8
"""Distance over the size of a file up to which corners are one: rounding; chosen."""

_ONE_ANGLE = 1e-4
"""Angle [rad] about an edge up to which faces of two bodies lie on each other, in files of single precision; chosen."""


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
    divides what is not convex into convex parts of one rigid body. For scans with mortar between, :func:`read_stones`.

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
        shells = _shells(corners, triangles, whole=len(files) > 1)
        if not shells:
            raise InputError(f"{name}{suffix}: not a mesh that can be read: none of its faces has an area")
        yield [
            _body(name if len(shells) == 1 else f"{name}-{k + 1}", corners, shell) for k, shell in enumerate(shells)
        ]


def _body(name: str, corners: Array, triangles: Index) -> MeshBody:
    """A body with its own corners.

    Its volume is taken about their mean, so that even that of an open mesh is the same wherever it lies.

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


def _shells(corners: Array, triangles: Index, *, whole: bool) -> list[Index]:
    """Triangles of every body of a file, in the order of their first ones.

    Corners are those that the file numbers. Where its triangles do not close by these, as in an .stl, whose triangles
    each have their own, those at one place are one.

    Parameters
    ----------
    corners : of the file [m], shape (n, 3)
    triangles : by number of the corners, shape (m, 3)
    whole : all triangles are one body
    """
    triangles = _with_area(triangles)
    sides = _sides(triangles)
    if not np.array_equal(np.unique(sides, axis=0), np.unique(sides[:, ::-1], axis=0)):
        triangles = _with_area(_one_at_a_place(corners)[triangles])
    if whole or len(triangles) == 0:
        return [triangles] if len(triangles) else []
    label = _pieces(_joined(corners, triangles), len(triangles))
    return [triangles[label == k] for k in dict.fromkeys(label.tolist())]


def _with_area(triangles: Index) -> Index:
    """Triangles without those two of whose corners are one, which have no area and no normal."""
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (c != a)]


def _sides(triangles: Index) -> Index:
    """Sides of triangles as pairs of corners in the sense of each, shape (3 m, 2): all first, all second, all third."""
    return np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _one_at_a_place(corners: Array) -> Index:
    """Of every corner [m] the number of the first at its place, shape (n,)."""
    places, at = np.unique(corners, axis=0, return_inverse=True)
    near = cKDTree(places).query_pairs(_ONE_PLACE * float(np.ptp(corners, axis=0).max()), output_type="ndarray")
    at = _pieces(near, len(places))[at.ravel()]
    first = np.full(at.max() + 1, len(corners), dtype=np.intp)
    np.minimum.at(first, at, np.arange(len(corners)))
    return first[at]


def _joined(corners: Array, triangles: Index) -> Index:
    """Pairs of triangles of one body that share an edge, shape (k, 2).

    Where bodies meet at an edge it has four triangles or more. Each body then lies between two that follow each other
    about the edge, from one that turns its back to the next that faces on.

    Parameters
    ----------
    corners : of the file [m], shape (n, 3)
    triangles : by number of the corners, shape (m, 3)
    """
    sides, m = _sides(triangles), len(triangles)
    two, more = _edges(sides)
    pairs = [two]
    for at in more:
        forward = sides[at, 0] < sides[at, 1]
        if 2 * forward.sum() == len(at):
            first, last = np.sort(sides[at[0]])
            opposite = triangles[at % m, (at // m + 2) % 3]  # the corner off the edge
            axis, arms = corners[last] - corners[first], corners[opposite] - corners[first]
            pairs.append(at[np.array(list(_wedges(axis, arms, forward)))])
        else:  # what does not close stays one body, and is refused as such
            pairs.append(np.column_stack([np.full(len(at) - 1, at[0]), at[1:]]))
    return np.vstack(pairs) % m


def _edges(sides: Index) -> tuple[Index, list[Index]]:
    """Sides that are one edge, by number: pairs where it has two, shape (k, 2), and a list of those that have more.

    Parameters
    ----------
    sides : pairs of corners, shape (n, 2)
    """
    low, high = sides.min(axis=1), sides.max(axis=1)
    order = np.lexsort((high, low))
    new = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    ends = np.flatnonzero(np.r_[True, new, True])
    count = np.diff(ends)
    two = ends[:-1][count == 2]
    more = [order[begin : begin + n] for begin, n in zip(ends[:-1], count, strict=True) if n > 2]
    return np.column_stack([order[two], order[two + 1]]), more


def filled(body: MeshBody) -> float:
    """Volume of a body [m3] that does not hang on the senses of its faces, which scans often mix.

    Faces that share an edge are turned alike, each piece of them that was mixed outwards. What is missing of an open
    body is missing here: the cone from the mean of the corners to it.

    Parameters
    ----------
    body : read from a file
    """
    sides, m = _sides(body.triangles), len(body.triangles)
    two = _edges(sides)[0]
    pairs, one = np.unique(np.sort(two % m, axis=1), axis=0, return_index=True)
    against = (sides[two[:, 0], 0] == sides[two[:, 1], 0])[one]  # both run alike: one of the faces is turned over
    piece = _pieces(pairs, m)
    first = np.unique(piece, return_index=True)[1]
    # from the first face of each piece on along the shortest ways, so that a fault of the mesh turns few faces: of a
    # tree from a face m of none, with a number m + 1 on for every face turned over
    links = np.vstack([pairs, np.column_stack([first, np.full(len(first), m)])])
    before = breadth_first_order(coo_array((np.ones(len(links)), links.T), shape=(m + 1, m + 1)), m, directed=False)[1]
    later = np.flatnonzero(before[:m] != m)
    tree = np.sort(np.column_stack([before[later], later]), axis=1)
    over = against[np.searchsorted(pairs @ [m, 1], tree @ [m, 1])] * (m + 1)
    sheet = _pieces(
        np.vstack([tree + np.outer(over, [0, 1]), tree + np.outer(m + 1 - over, [0, 1]) + [m + 1, 0]]), 2 * (m + 1)
    )
    sign = np.where(sheet[:m] == sheet[first[piece]], 1.0, -1.0)
    p = (body.corners - body.corners.mean(axis=0))[body.triangles]
    cones = np.einsum("ni,ni->n", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6.0
    mixed = np.bincount(piece[pairs[:, 0]], weights=against, minlength=len(first)) > 0
    volumes = np.bincount(piece, weights=cones * sign)
    return abs(float(np.where(mixed, np.abs(volumes), volumes).sum()))


def _pieces(pairs: Index, count: int) -> Index:
    """Number of the connected piece of each of some things, shape (count,).

    Parameters
    ----------
    pairs : of things that are connected, shape (k, 2)
    count : number of things
    """
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _wedges(axis: Array, arms: Array, forward: Any) -> Iterator[tuple[int, int]]:
    """Pairs of faces at an edge with a body between them, like brackets about the edge.

    Parameters
    ----------
    axis : along the edge [m], shape (3,)
    arms : from the edge into each face [m], shape (k, 3)
    forward : whether each face, counter-clockwise from outside, runs along the axis, shape (k,); a body then lies
        behind it in the sense of a right-handed turn about the axis, else before it
    """
    across = np.cross(axis, arms[0])
    turn = np.arctan2(arms @ across * np.linalg.norm(axis), arms @ np.cross(across, axis))
    turn = (turn + _ONE_ANGLE) % (2.0 * np.pi)  # those on the first do not come last
    order = np.argsort(turn)
    group = np.cumsum(np.r_[0, np.diff(turn[order]) > _ONE_ANGLE])  # faces on each other
    order = order[np.lexsort((~forward[order], group))]  # of these the body behind ends before the next begins
    depth = np.cumsum(np.where(forward[order], -1, 1))
    open_faces: list[int] = []
    for k in np.roll(order, -int(np.argmin(depth)) - 1):
        if forward[k]:
            yield open_faces.pop(), int(k)
        else:
            open_faces.append(int(k))


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
    corners = np.vstack([b.corners for b in shell])
    return Solid(corners, tuple(tuple(int(i) for i in f) for f in faces))


def _files(path: str | Path | Sequence[str | Path]) -> Iterator[tuple[str, str, bytes]]:
    """Name, suffix in lower case, and content of every mesh.

    Those of a folder or a .zip come in the order of their names, stone-2 before stone-10.

    Parameters
    ----------
    path : a file, a folder, a .zip, or a list of files, whose order stays
    """
    several = [Path(p) for p in path] if isinstance(path, (list, tuple)) else [Path(str(path))]
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
