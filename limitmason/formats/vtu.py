"""VTU files for ParaView and PyVista: blocks with their motion, interfaces with their forces. No dependency."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from limitmason.answers.results import Prediction
from limitmason.checks import choice, finite, instance
from limitmason.errors import InputError
from limitmason.mechanics.rigid_motion import checked_twists, finite_motion, joint_rates, velocity
from limitmason.model import Assembly
from limitmason.storage.files import named_path, utf8, write_text

Array = NDArray

_POLYGON, _POLYHEDRON = 7, 42  # numbers of the kinds of cells in VTK
_TYPES = {"f8": "Float64", "i8": "Int64", "u1": "UInt8"}
ENCODINGS = ("base64", "ascii")

_DRAWN = 0.05
"""Largest displacement of a mechanism as drawn, over the largest extent of the structure; chosen."""

_KINDS = {"bed": 0, "head": 1, "base": 2}
_OTHER_KIND = 3


class _Grid(NamedTuple):
    """Cells as VTK has them.

    ``points`` [m], shape (n, 3); ``connectivity`` the points of one cell after another, and ``offsets`` where those of
    each cell end. ``kind`` is a polygon or a polyhedron. Of polyhedra ``faces`` has, one cell after another, the number
    of faces, then of each face the number of its corners and these; ``face_offsets`` says where each cell ends in it.
    """

    points: Array
    connectivity: Array
    offsets: Array
    kind: int
    faces: Array | None
    face_offsets: Array | None


_Piece = tuple[_Grid, dict[str, Array], dict[str, Array]]
"""A grid, and the tables of its cells and of its points."""


def write_vtu(
    path: str | Path,
    assembly: Assembly,
    prediction: Prediction | None = None,
    *,
    amplitude: float | None = None,
    encoding: str = "base64",
) -> tuple[Path, ...]:
    """Write blocks as polyhedra to a VTU file, interfaces as polygons beside it.

    Parameters
    ----------
    path : of the blocks' file, by custom ending in .vtu; the interfaces go to "<stem>-interfaces.vtu"
    assembly : the model
    prediction : adds the mechanism and the joint forces, where it has them
    amplitude : largest displacement of a vertex [m]; a twentieth of the structure's largest extent by default. Without
        a mechanism nothing is displaced
    encoding : "base64" (exact and short) or "ascii" (exact and readable)

    Returns
    -------
    paths written

    Notes
    -----
    Blocks, per cell (one a convex piece): ``block`` number, ``density`` [kg/m3], ``fixed``, ``velocity`` of the
    centroid and ``spin``; per point: ``displacement`` [m], a finite rigid motion, so that *Warp By Vector* with factor
    1 keeps blocks rigid, and ``rate``, the velocity itself. Names are in the field data ``block_name``, one a line.

    Interfaces, per cell: ``interface``, ``block_a``, ``block_b``, ``kind`` (0 bed, 1 head, 2 base, 3 other), ``area``
    [m2], ``N`` [N], ``V`` [N] as a vector on block b, ``opening`` and ``sliding`` (largest rates at the corners).
    """
    choice("encoding", encoding, ENCODINGS)
    instance("assembly", assembly, Assembly)
    if prediction is not None:
        instance("prediction", prediction, Prediction)
    if amplitude is not None:
        finite("amplitude", amplitude)
    target = named_path(path)
    twists = None
    if prediction is not None and prediction.mechanism is not None:
        twists = checked_twists(assembly, prediction)
    written = [target]
    _write(target, *_blocks(assembly, twists, amplitude), encoding, [b.name for b in assembly.blocks])
    if assembly.interfaces:
        second = target.with_name(f"{target.stem}-interfaces{target.suffix}")
        _write(second, *_interfaces(assembly, prediction, twists), encoding, [])
        written.append(second)
    return tuple(written)


def _blocks(assembly: Assembly, twists: Array | None, amplitude: float | None) -> _Piece:
    """Grid, cell data and point data of the blocks with a drawn mechanism.

    Parameters
    ----------
    assembly : the model; each convex piece of a block is a cell
    twists : of a mechanism [m/s, rad/s], shape (n, 6); None for none
    amplitude : largest displacement of a vertex as drawn [m]; None for a share of the extent
    """
    pieces = [(i, part) for i, block in enumerate(assembly.blocks) for part in block.parts]
    owner = np.array([i for i, _ in pieces])
    counts = np.array([len(part.vertices) for _, part in pieces])
    start = np.concatenate([[0], np.cumsum(counts)])
    points = np.concatenate([part.vertices for _, part in pieces])
    faces: list[int] = []
    ends = []
    for (_, part), first in zip(pieces, start[:-1].tolist(), strict=True):
        faces.append(len(part.faces))
        for face in part.faces:
            faces.append(len(face))
            faces.extend(first + i for i in face)
        ends.append(len(faces))
    grid = _Grid(
        points=points, connectivity=np.arange(len(points)), offsets=start[1:], kind=_POLYHEDRON, faces=np.array(faces),
        face_offsets=np.array(ends),
    )
    cells = {
        "block": owner,
        "density": np.array([assembly.blocks[i].density for i in owner]),
        "fixed": assembly.fixed[owner].astype(np.uint8),
    }
    data: dict[str, Array] = {}
    if twists is not None:
        of_point = np.repeat(owner, counts)
        rate = velocity(assembly.centroids, twists, of_point, points)
        fastest = float(np.linalg.norm(rate, axis=1).max(initial=0.0))
        reach = _DRAWN * float(np.ptp(points, axis=0).max()) if amplitude is None else float(amplitude)
        # for so long that the fastest vertex goes that far; a mechanism at rest goes nowhere
        motion = finite_motion(assembly.centroids, twists, reach / fastest if fastest else 0.0)
        cells |= {"velocity": twists[owner, :3], "spin": twists[owner, 3:]}
        data = {"displacement": motion.moved(points, of_point) - points, "rate": rate}
    return grid, cells, data


def _interfaces(assembly: Assembly, prediction: Prediction | None, twists: Array | None) -> _Piece:
    """Grid and cell data of the interfaces, with opening, sliding and forces.

    Parameters
    ----------
    assembly : the model
    prediction : whose forces are written, where it has them
    twists : of a mechanism [m/s, rad/s], shape (n, 6); None for none
    """
    joints = assembly.arrays
    count = len(assembly.interfaces)
    grid = _Grid(
        points=joints.corners, connectivity=np.arange(len(joints.corners)), offsets=joints.corner_start[1:],
        kind=_POLYGON, faces=None, face_offsets=None,
    )
    cells: dict[str, Array] = {
        "interface": np.arange(count), "block_a": joints.block_a, "block_b": joints.block_b, "area": joints.area,
        "kind": np.array([_KINDS.get(i.kind, _OTHER_KIND) for i in assembly.interfaces]),
    }
    if twists is not None:
        opening, sliding = joint_rates(assembly, twists)
        cells |= {"opening": opening, "sliding": sliding}
    if prediction is not None and prediction.resultants is not None:
        resultants = prediction.resultants
        if len(resultants.normal) != count + len(assembly.ties):
            has = f"the assembly has {count} and {len(assembly.ties)} ties"
            raise InputError(f"the resultants are for {len(resultants.normal)} interfaces and ties, {has}")
        # forces of the ties come last and are left out
        shear = np.asarray(resultants.shear, dtype=float)[:count]
        cells |= {"N": np.asarray(resultants.normal, dtype=float)[:count],
                  "V": shear[:, :1] * joints.tangent_1 + shear[:, 1:2] * joints.tangent_2}
    return grid, cells, {}


def _write(
    path: Path, grid: _Grid, cells: dict[str, Array], points: dict[str, Array], encoding: str, names: Sequence[str]
) -> None:
    """Write a grid with its data as a VTU file.

    Parameters
    ----------
    path : of the file
    grid : points and cells
    cells : data of every cell by name, a row for each
    points : data of every point by name, a row for each
    encoding : of arrays, "base64" or "ascii"
    names : names of the blocks; none where the cells are no blocks
    """
    n = len(grid.offsets)
    out = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<UnstructuredGrid>",
    ]
    if names:
        # a text is an array of its bytes, with a zero at the end
        text = utf8("\n".join(names), path)
        codes = " ".join(str(byte) for byte in (*text, 0))
        out += [
            "<FieldData>",
            f'<Array type="String" Name="block_name" NumberOfTuples="1" format="ascii">{codes}</Array>',
            "</FieldData>",
        ]
    out.append(f'<Piece NumberOfPoints="{len(grid.points)}" NumberOfCells="{n}">')
    out += ["<Points>", _array("Points", grid.points, encoding), "</Points>", "<Cells>"]
    out += [_array("connectivity", grid.connectivity, encoding), _array("offsets", grid.offsets, encoding)]
    out.append(_array("types", np.full(n, grid.kind, np.uint8), encoding))
    if grid.faces is not None and grid.face_offsets is not None:
        out += [_array("faces", grid.faces, encoding), _array("faceoffsets", grid.face_offsets, encoding)]
    out.append("</Cells>")
    for tag, table in (("CellData", cells), ("PointData", points)):
        out += [f"<{tag}>", *(_array(name, values, encoding) for name, values in table.items()), f"</{tag}>"]
    out += ["</Piece>", "</UnstructuredGrid>", "</VTKFile>", ""]
    write_text(path, "\n".join(out))


def _array(name: str, values: Array, encoding: str) -> str:
    """An array as a VTU element called ``name``.

    ``values`` are of shape (n,) or (n, k), ``encoding`` is "base64" or "ascii".
    """
    kind = "u1" if values.dtype == np.uint8 else "i8" if values.dtype.kind in "iu" else "f8"
    data = np.ascontiguousarray(values, dtype=f"<{kind}" if kind != "u1" else kind)
    if encoding == "ascii":
        body, form = " ".join(repr(v) for v in data.ravel().tolist()), "ascii"
    else:
        raw = data.tobytes()
        # the number of bytes stands before them, in eight bytes as header_type says
        body, form = base64.b64encode(len(raw).to_bytes(8, "little") + raw).decode(), "binary"
    width = f' NumberOfComponents="{data.shape[1]}"' if data.ndim == 2 else ""
    return f'<DataArray type="{_TYPES[kind]}" Name="{escape(name)}"{width} format="{form}">{body}</DataArray>'
