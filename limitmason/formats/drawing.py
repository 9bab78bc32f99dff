"""Drawings as assemblies: outlines made prisms, solids as they are.

Layers say what a block is.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.checks import choice, finite, positive
from limitmason.errors import InputError
from limitmason.formats.dxf import read_dxf
from limitmason.formats.meshes import read_solids
from limitmason.formats.obj import read_obj
from limitmason.formats.outline_repair import Cleaned, clean
from limitmason.formats.outlines import Outlines
from limitmason.formats.svg import read_svg
from limitmason.model import Assembly, Joint, Loads, Support
from limitmason.model.input import read_fixed
from limitmason.storage.files import named_path

PLANE_DRAWINGS = (".dxf", ".svg")
"""Drawings of outlines x, z."""

DRAWINGS = (*PLANE_DRAWINGS, ".obj", ".ply", ".stl", ".off")
"""Drawings, by the ending of the file; those beside :data:`PLANE_DRAWINGS` hold solids."""

SUPPORTS = ("support", "supports", "base", "ground", "fixed", "foundation")
"""Layers whose blocks are held, in upper and lower case alike."""

OPENINGS = ("opening", "openings", "window", "windows", "door", "doors", "ignore")
"""Layers whose outlines are no blocks."""

LOWEST = "lowest"
"""Hold the stones that reach down to the lowest level of the drawing."""

DIRECTIONS = {"x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0)}
"""Unit vectors x, y, z of the live load by the word for it."""

_LEVEL = 0.01
"""Height over that of the structure up to which a stone reaches down to the lowest level; chosen."""

_DRAWING_ERROR = 0.1
"""Gap that counts as an error of drawing, over the mortar, where only the mortar is given; chosen."""


class DrawingModel(NamedTuple):
    """A drawing ready to be solved.

    Assembly, loads, what was assumed, and what was moved to close gaps.
    """

    assembly: Assembly
    loads: Loads
    assumed: tuple[str, ...]
    cleaned: Cleaned | None


def read_drawing(
    path: str | Path,
    *,
    joint: Joint | None = None,
    thickness: float | None = None,
    density: float = 2000.0,
    scale: float | None = None,
    tolerance: float | None = None,
    gap: float | None = None,
    mortar: float | None = None,
    layers: str | Sequence[str] | None = None,
) -> Assembly:
    """Blocks of a drawing and their contacts.

    Held are those of a layer of :data:`SUPPORTS` alone.

    Parameters
    ----------
    path : .dxf or .svg (outlines, x and z), or .obj, .ply, .stl or .off (solids)
    joint : of every contact; where omitted one of 30 degrees, which is enough to look for contacts
    thickness : of the prisms over outlines [m]; 1 m where omitted
    density : of all blocks [kg/m3]
    scale : metres per unit of the drawing; that of a .dxf, or 1 for solids; has to be given for an .svg
    tolerance : gap or overlap up to which faces touch [m]; ``gap`` where that is given, so that what it cannot close
        by moving corners still touches; else see :meth:`limitmason.Assembly.from_polyhedra`
    gap : close gaps of outlines up to this length first [m], see :func:`limitmason.formats.clean`; none where omitted
    mortar : thickness of the joints that outlines leave open [m]; stones grow by half of it, see
        :func:`limitmason.formats.clean`
    layers : names of the layers to read, upper and lower case alike; all but :data:`OPENINGS` by default

    Raises
    ------
    InputError
        For another kind of file, for a thickness, gap, mortar or layers of solids, and as the readers do.
    """
    law = Joint(30.0) if joint is None else joint
    return _read(named_path(path), law, thickness, density, scale, tolerance, gap, mortar, layers)[0]


def model_of_drawing(
    path: str | Path,
    *,
    joint: Joint,
    thickness: float | None = None,
    density: float = 2000.0,
    tilt: str = "x",
    fixed: Sequence[str] | str = LOWEST,
    scale: float | None = None,
    tolerance: float | None = None,
    gap: float | None = None,
    mortar: float | None = None,
    layers: str | Sequence[str] | None = None,
) -> DrawingModel:
    """A drawing with supports and loads.

    Own weight, and the same weights sideways as live load.

    Parameters
    ----------
    path, joint, density, scale, tolerance, gap, mortar, layers : as for :func:`read_drawing`
    thickness : of the prisms over outlines [m]; has to be given for them
    tilt : "x", "-x", "y" or "-y": direction of the live load
    fixed : names of blocks that are held beside those of the layers :data:`SUPPORTS`; "lowest" holds these alone, and
        where there are none the stones that reach down to the lowest level

    Raises
    ------
    InputError
        As :func:`read_drawing`, for outlines without thickness, and for a direction or a block that there is not.
    """
    path = named_path(path)
    if path.suffix.lower() in PLANE_DRAWINGS and thickness is None:
        raise InputError(f"{path} holds outlines: give the thickness of the wall [m]")
    choice("tilt", tilt, DIRECTIONS)
    assembly, cleaned = _read(path, joint, thickness, density, scale, tolerance, gap, mortar, layers)
    assumed = [f"density {finite('density', density):g} kg/m3 for all blocks", f"every joint: {joint}"]
    if not isinstance(fixed, str) or fixed != LOWEST:
        named = [fixed] if isinstance(fixed, str) else read_fixed(fixed)
        assembly = assembly.with_supports(Support.fixed(n) for n in named)
    elif not assembly.fixed.any():
        low = np.array([b.bounds[0, 2] for b in assembly.blocks])
        height = float(np.ptp([b.bounds[:, 2] for b in assembly.blocks]))
        held = [b.name for b, z in zip(assembly.blocks, low, strict=True) if z < low.min() + _LEVEL * height]
        assembly = assembly.with_supports(Support.fixed(n) for n in held)
        assumed.append(
            f"held: {', '.join(held[:6])}{' ...' if len(held) > 6 else ''}, which reach down to the lowest level (a "
            f"layer named {SUPPORTS[0]!r} says otherwise)"
        )
    return DrawingModel(assembly, Loads.horizontal(assembly, DIRECTIONS[tilt]), tuple(assumed), cleaned)


def _read(
    path: Path, law: Joint, thickness: float | None, density: float, scale: float | None, tolerance: float | None,
    gap: float | None, mortar: float | None, layers: str | Sequence[str] | None,
) -> tuple[Assembly, Cleaned | None]:
    """Assembly of a drawing, and what was cleaned in its outlines or None.

    Parameters
    ----------
    path : of the drawing
    law : of every joint
    thickness : of the prisms over outlines [m]; 1 m for None
    density : of all blocks [kg/m3]
    scale : metres per unit of the drawing; None for that of the file
    tolerance : gap or overlap up to which faces touch [m]; None for the gap, or the default of the assembly
    gap : width up to which gaps of outlines are closed by moving corners [m]; None for none
    mortar : thickness of the open joints that stones share [m]; None for none
    layers : those that are read; None for all but openings
    """
    for what, length in (("gap", gap), ("mortar", mortar)):
        if length is not None:
            positive(what, length, "m")
    suffix = path.suffix.lower()
    if suffix not in DRAWINGS:
        raise InputError(f"{path}: a drawing ends in {', '.join(DRAWINGS)}, this in {suffix or 'nothing'}")
    given: dict[str, Any] = {"joint": law, "density": density, "tolerance": tolerance}
    if suffix not in PLANE_DRAWINGS:
        for name, value in (("thickness", thickness), ("gap", gap), ("mortar", mortar), ("layers", layers)):
            if value is not None:
                raise InputError(f"{path}: {name} is for outlines ({', '.join(PLANE_DRAWINGS)}); solids have their own")
        read = read_obj if suffix == ".obj" else read_solids
        solids, names = read(path) if scale is None else read(path, scale=scale)
        return Assembly.from_polyhedra(solids, names=names, **given), None
    outlines, names, _ = outlines_of(path, scale, gap, layers)
    cleaned = None
    if gap is not None or mortar is not None:
        # where the mortar alone is given, a part of it counts as an error of drawing
        near = _DRAWING_ERROR * mortar if gap is None and mortar is not None else gap
        cleaned = clean(outlines, near or 0.0, mortar=mortar or 0.0, names=names)
        outlines, names = cleaned.outlines, cleaned.names
    if gap is not None and tolerance is None:
        # what is left of the gap where corners could not meet touches all the same
        given["tolerance"] = gap
    if mortar:
        # joints were made to meet side by side, parallel but for rounding (the angle is chosen): those that go on from
        # each other at a small angle are no wedges
        given |= {"angle_tolerance_deg": 0.05, "wedge_tolerance_deg": 0.0}
    # names are "layer-number"
    held = [name for name in names if name.rpartition("-")[0].casefold() in SUPPORTS]
    wall = Assembly.from_polygons(
        outlines, names=names, thickness=1.0 if thickness is None else thickness, fixed=held, **given,
    )
    return wall, cleaned


def outlines_of(path: Path, scale: float | None, gap: float | None, layers: str | Sequence[str] | None) -> Outlines:
    """Outlines of a .dxf or .svg on some layers.

    Parameters
    ----------
    path : of the drawing
    scale : metres per unit of the drawing; None for what the file says
    gap : distance up to which ends of single lines meet [m]; None for the default of the reader
    layers : those that are read; None for all but :data:`OPENINGS`
    """
    read_outlines = read_dxf if path.suffix.lower() == ".dxf" else read_svg
    ends: dict[str, Any] = {} if gap is None else {"gap": gap}
    outlines, names, on = read_outlines(path, scale=scale, layers=layers, **ends)
    rows = [i for i, layer in enumerate(on) if layers is not None or layer.casefold() not in OPENINGS]
    if not rows:
        raise InputError(f"{path}: every outline lies on a layer that is no block ({', '.join(OPENINGS)})")
    return Outlines([outlines[i] for i in rows], [names[i] for i in rows], [on[i] for i in rows])
