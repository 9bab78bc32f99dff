"""Wavefront OBJ: named blocks with polygon faces, both ways.

A block is an object (``o``), or a group (``g``) where the file has none or keeps several groups in one object. Groups
``part-1``, ``part-2`` ... of one object are the convex pieces of a concave block.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import choice, instance, positive
from limitmason.errors import InputError
from limitmason.geometry import Solid
from limitmason.geometry.shells import Shell, bodies_of_faces, with_hollows
from limitmason.model import Assembly
from limitmason.storage.files import read_text, write_text

_PART = re.compile(r"part-\d+$")
_IGNORED = frozenset(
    ("vt", "vn", "vp", "s", "usemtl", "mtllib", "l", "p", "bevel", "c_interp", "d_interp", "lod", "maplib", "usemap")
)


class Solids(NamedTuple):
    """Blocks of a file, ready for ``Assembly.from_polyhedra``: pieces of each [m], and their names."""

    solids: list[list[Solid]]
    names: list[str]


class _ObjFace(NamedTuple):
    """A face with the object and the group in which it stands, None for none, and its corners by number from 0."""

    thing: str | None
    group: str | None
    vertices: tuple[int, ...]


def write_obj(path: str | Path, assembly: Assembly | Solids) -> None:
    """Write the blocks as objects with polygon faces, numbers with every bit.

    A block of several convex pieces has one group for each.

    Parameters
    ----------
    path : of the file
    assembly : an assembly, or solids with names

    Raises
    ------
    InputError
        For a block name that spans lines, which the format cannot hold.
    """
    if isinstance(assembly, Assembly):
        solids: Iterable[Sequence[Solid]] = [b.parts for b in assembly.blocks]
        names: Sequence[str] = [b.name for b in assembly.blocks]
    else:
        solids, names = instance("assembly", assembly, Solids)
    lines = ["# limitmason blocks; units: m; z up"]
    first = 1  # number of the first vertex of a piece: a file counts from 1, through all blocks
    for name, parts in zip(names, solids, strict=True):
        if name != " ".join(name.split()) or not name:
            raise InputError(f"block name {name!r} cannot be written to OBJ: it is empty or has odd spaces")
        lines.append(f"o {name}")
        for k, part in enumerate(parts):
            if len(parts) > 1:
                lines.append(f"g part-{k + 1}")
            lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(part.vertices, dtype=float).tolist()]
            lines += ["f " + " ".join(str(first + i) for i in face) for face in part.faces]
            first += len(part.vertices)
    write_text(path, "\n".join(lines) + "\n")


def read_obj(path: str | Path, *, scale: float = 1.0, up: str = "z") -> Solids:
    """Read named solids with polygon faces.

    Parameters
    ----------
    path : of the file
    scale : metres per unit of the file, for example 0.001 for millimetres
    up : axis of the file that points up, "z" or "y" (x then stays, y becomes z and z becomes -y)

    Returns
    -------
    Solids
        ``solids, names``. Vertices of a block at exactly the same place are one; vertices no face uses are dropped.
        A block may have notches and holes: ``Assembly.from_polyhedra`` divides it into convex parts of one body.
        Closed surfaces apart in an object without groups ``part-1``, ``part-2`` ... are blocks of their own, called
        "name-1", "name-2" ...; a hollow stays in its block.

    Raises
    ------
    InputError
        Naming file and line: numbers that are not, faces with fewer than three corners or with vertices that do not
        exist, statements of curved surfaces, no faces at all.
    """
    choice("up", up, ("y", "z"))
    positive("scale", scale, "m per unit")
    vertices, faces = _parsed(path)
    points = np.array(vertices, dtype=float).reshape(-1, 3)
    if up == "y":
        points = np.column_stack([points[:, 0], -points[:, 2], points[:, 1]])
    points = points * scale
    blocks: dict[str, dict[str, list[tuple[int, ...]]]] = {}  # faces by block and piece
    for block, piece, face in _named(faces, Path(path).stem):
        blocks.setdefault(block, {}).setdefault(piece, []).append(face)
    solids: list[list[Solid]] = []
    names: list[str] = []
    for name, pieces in blocks.items():
        solid = [_solid(points, piece) for piece in pieces.values()]
        # without groups part-1, part-2 ... closed surfaces apart are blocks of their own
        own = [[s] for s in _bodies(solid[0])] if list(pieces) == [""] else [solid]
        solids += own
        names += [name] if len(own) == 1 else [f"{name}-{k + 1}" for k in range(len(own))]
    return Solids(solids, names)


def _parsed(path: str | Path) -> tuple[list[list[float]], list[_ObjFace]]:
    """Vertices x, y, z of the file ``path``, in its units and axes, and its faces."""
    vertices: list[list[float]] = []
    faces: list[_ObjFace] = []
    thing: str | None = None
    group: str | None = None
    text = read_text(path)
    pending = ""
    # an empty line at the end: the last one may say that it goes on
    for number, raw in enumerate([*text.splitlines(), ""], 1):
        # names may hold a number sign, everything else ends there
        raw = raw.replace("\t", " ")  # either stands between words
        line = pending + (raw if raw.startswith(("o ", "g ")) else raw.split("#", 1)[0]).strip()
        if line.endswith("\\"):  # goes on in the next line
            pending = line[:-1] + " "
            continue
        pending = ""
        keyword, _, rest = line.partition(" ")
        where = f"{path}: line {number}"
        if not keyword or keyword in _IGNORED:
            continue
        if keyword == "v":
            vertices.append(_vertex(rest, where))
        elif keyword == "f":
            faces.append(_ObjFace(thing, group, _face(rest, len(vertices), where)))
        elif keyword == "o":
            thing, group = rest.strip() or None, None  # groups end with their object
        elif keyword == "g":
            group = rest.strip() or None
        else:
            raise InputError(f"{where}: statement {keyword!r} is not read; blocks need plane polygons (v, f, o, g)")
    if not faces:
        raise InputError(f"{path}: there are no faces")
    return vertices, faces


def _vertex(text: str, where: str) -> list[float]:
    """Coordinates x, y, z of a vertex, from the ``text`` after its keyword.

    ``where`` names the line in errors.
    """
    words = text.split()
    try:
        numbers = [float(w) for w in words[:3]]
    except ValueError:
        raise InputError(f"{where}: {text!r} is not a vertex of three numbers") from None
    if len(numbers) < 3:
        raise InputError(f"{where}: a vertex needs three coordinates, got {len(numbers)}")
    if not np.isfinite(numbers).all():
        raise InputError(f"{where}: a coordinate is not finite: {text!r}")
    return numbers


def _face(text: str, count: int, where: str) -> tuple[int, ...]:
    """Corners of a face, numbered from 0.

    The file counts from 1, or back from its last vertex where the number is negative.

    Parameters
    ----------
    text : what stands after the keyword: numbers, each perhaps with those of texture and normal behind a slash
    count : number of vertices before this line
    where : the file and the line, for errors
    """
    out = []
    for word in text.split():
        try:
            index = int(word.split("/", 1)[0])
        except ValueError:
            raise InputError(f"{where}: {word!r} is not a vertex of a face") from None
        place = index - 1 if index > 0 else count + index
        if index == 0 or not 0 <= place < count:
            raise InputError(f"{where}: vertex {index} does not exist; {count} vertices were given before this line")
        out.append(place)
    if len(out) < 3:
        raise InputError(f"{where}: a face needs at least three vertices, got {len(out)}")
    return tuple(out)


def _named(faces: list[_ObjFace], stem: str) -> Iterable[tuple[str, str, tuple[int, ...]]]:
    """Names of block and piece, and corners of every face.

    A block is an object or a group, see the text of the module. The piece is "" where the block has only one.

    Parameters
    ----------
    faces : with object and group
    stem : name of the block where the file gives none
    """
    groups: dict[str | None, set[str | None]] = {}  # names of the groups in every object, by its name
    objects: dict[str | None, set[str | None]] = {}  # names of the objects in which a group of that name stands
    for thing, group, _ in faces:
        groups.setdefault(thing, set()).add(group)
        if group is not None:
            objects.setdefault(group, set()).add(thing)
    for thing, group, corners in faces:
        if group is not None and thing is not None and _PART.match(group):
            yield thing, group, corners
        elif group is None:
            yield thing or stem, "", corners
        elif thing is None or (len(objects[group]) == 1 and len(groups[thing]) > 1):
            # an object of several groups is a whole structure, its groups are the blocks
            yield group, "", corners
        elif len(groups[thing]) == 1:
            yield thing, "", corners
        else:
            # several objects have groups of one name, which names no block alone
            yield f"{thing}/{group}", "", corners


def _solid(points: Array, faces: list[tuple[int, ...]]) -> Solid:
    """A solid with corners numbered from 0, those at exactly the same place as one.

    Parameters
    ----------
    points : vertices of the file [m], shape (n, 3)
    faces : of the solid, by number of the vertices
    """
    place: dict[tuple[float, ...], int] = {}  # number of the corner at a place
    number: dict[int, int] = {}  # of the corner that a vertex of the file became
    for i in sorted({i for face in faces for i in face}):
        number[i] = place.setdefault(tuple(points[i].tolist()), len(place))
    vertices = np.array(list(place), dtype=float)
    return Solid(vertices, tuple(_without_repeats([number[i] for i in face]) for face in faces))


def _bodies(solid: Solid) -> list[Solid]:
    """Bodies of a solid that encloses several, each with its hollows.

    Where they cannot be told apart it is the solid itself.

    Parameters
    ----------
    solid : with plane faces
    """
    vertices, faces = solid
    if any(len(set(f)) < len(f) or len(f) < 3 for f in faces):  # no polygons: refused by name where blocks are made
        return [solid]
    label = bodies_of_faces(vertices, faces)  # number of the body of every face
    if not label.any():
        return [solid]
    shells = []
    for k in range(label.max() + 1):
        own = [f for f, n in zip(faces, label, strict=True) if n == k]
        used = np.unique(np.concatenate(own))
        # cones from the mean of the corners to all faces
        volume = sum(_fan(vertices[list(f)] - vertices[used].mean(axis=0)) for f in own)
        shells.append((own, Shell(vertices[used], volume)))
    grouped, lost = with_hollows(shells)
    if lost is not None:  # turned inside out: refused by name as one solid
        return [solid]
    return [_solid(vertices, [f for shell in group for f in shell]) for group in grouped]


def _fan(corners: Array) -> float:
    """Volume of the cone from the origin to a plane face [m3], from its corners [m], shape (k, 3)."""
    return float((np.cross(corners[1:-1], corners[2:]) @ corners[0]).sum()) / 6.0


def _without_repeats(face: list[int]) -> tuple[int, ...]:
    """Corners of a face, by number, of which none repeats the one before."""
    return tuple(i for k, i in enumerate(face) if i != face[k - 1])
