"""Files: JSON, OBJ, PLY, STL, DXF and SVG in, JSON, OBJ and VTU out.

:func:`read`, :func:`write` by suffix.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any

from limitmason.answers.results import Prediction
from limitmason.display.notebook import shows
from limitmason.errors import InputError
from limitmason.formats.answers import read_prediction, write_prediction
from limitmason.formats.drawing import DRAWINGS, PLANE_DRAWINGS, DrawingModel, model_of_drawing, read_drawing
from limitmason.formats.dxf import read_dxf
from limitmason.formats.meshes import read_solids
from limitmason.formats.native import Model, read_json, write_json
from limitmason.formats.obj import Solids, read_obj, write_obj
from limitmason.formats.outline_repair import Cleaned, clean
from limitmason.formats.outlines import Outlines
from limitmason.formats.proposed_options import Proposal, proposal
from limitmason.formats.stones import MetStones, Stones, read_stones
from limitmason.formats.svg import read_svg
from limitmason.formats.template import write_model_template
from limitmason.formats.vtu import write_vtu
from limitmason.model import Assembly, Loads
from limitmason.storage.files import named_path
from limitmason.storage.measured_table import MeasuredTable, read_measured, write_measured

__all__ = [
    "DRAWINGS", "PLANE_DRAWINGS", "Cleaned", "DrawingModel", "MeasuredTable", "MetStones", "Model", "Outlines",
    "Proposal", "Solids", "Stones", "clean", "model_of_drawing", "proposal", "read", "read_drawing", "read_dxf",
    "read_json", "read_measured", "read_obj", "read_prediction", "read_solids", "read_stones", "read_svg", "write",
    "write_json", "write_measured", "write_model_template", "write_obj", "write_prediction", "write_vtu",
]

shows(__name__)

_READERS: dict[str, Callable[..., Any]] = {
    ".json": read_json, ".obj": read_obj, ".dxf": read_dxf, ".svg": read_svg,
    ".ply": read_solids, ".stl": read_solids, ".off": read_solids,
}
_WRITERS = (".json", ".obj", ".vtu")


def read(path: str | Path, **options: Any) -> Model | Solids | Outlines:
    """Read a file by its suffix.

    Parameters
    ----------
    path : .json (a ``Model``: assembly, loads), .obj, .ply, .stl or .off (``Solids`` for ``Assembly.from_polyhedra``),
        .dxf or .svg (``Outlines`` for ``Assembly.from_polygons``)
    options : those of the reader of that suffix

    Raises
    ------
    InputError
        For an unknown suffix, an option that its reader does not have, and as the readers do.
    """
    suffix = named_path(path).suffix.lower()
    if suffix not in _READERS:
        raise InputError(f"{path}: cannot read {suffix or 'a file without suffix'}; known: {', '.join(_READERS)}")
    reader = _READERS[suffix]
    taken = [name for name, p in signature(reader).parameters.items() if p.kind is not p.VAR_KEYWORD][1:]
    if unknown := sorted(options.keys() - set(taken)):
        known = f"options: {', '.join(taken)}" if taken else "it has no options, leave it out"
        raise InputError(f"{path}: a {suffix} file is not read with {unknown[0]!r}; {known}")
    return reader(path, **options)


def write(
    path: str | Path, assembly: Assembly, loads: Loads | None = None, *, prediction: Prediction | None = None
) -> None:
    """Write an assembly by the suffix of the file.

    Parameters
    ----------
    path : .json (blocks, joints, supports and loads), .obj (blocks only) or .vtu (blocks and interfaces, with the
        prediction's mechanism and forces)
    assembly, loads, prediction : what to write; OBJ and VTU leave out what they cannot hold

    Raises
    ------
    InputError
        For an unknown suffix; and for a prediction given with a .json model, which goes to a file of its own with
        :func:`write_prediction`.
    """
    if not isinstance(path, str | Path):
        raise InputError(f"path must be the name of a file, got {type(path).__name__}: write(path, assembly)")
    suffix = named_path(path).suffix.lower()
    if suffix not in _WRITERS:
        raise InputError(f"{path}: cannot write {suffix or 'a file without suffix'}; known: {', '.join(_WRITERS)}")
    if suffix == ".json":
        if prediction is not None:
            raise InputError(f"{path}: a model file holds no prediction; use write_prediction for a file of its own")
        write_json(path, assembly, loads)
    elif suffix == ".obj":
        write_obj(path, assembly)
    else:
        write_vtu(path, assembly, prediction)
