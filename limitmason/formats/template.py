"""A small model file, or a drawing, to start from."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from limitmason.build.arch import arch
from limitmason.checks import choice
from limitmason.errors import InputError
from limitmason.formats.native import write_json
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.storage.files import named_path, write_text

_MODEL = """\
{
 "schema": "limitmason-model",
 "version": 1,
 "thickness": 0.3,
 "density": 2000.0,
 "joint": {"friction_angle_deg": 33.0, "dilatancy_angle_deg": 0.0},
 "fixed": ["ground"],
 "loads": {"horizontal": [1, 0, 0]},
 "names": [
NAMES
 ],
 "outlines": [
OUTLINES
 ]
}
"""


_OPEN = 0.012  # thickness of the mortar in the drawing [m]


def write_model_template(path: str | Path, *, of: str = "wall") -> None:
    """Write a small structure as a file, to be edited by hand.

    Parameters
    ----------
    path : of the file, which must not be there yet. An .svg is a drawing of the wall in millimetres whose mortar is
        left open; every other file is a model
    of : "wall", six courses in running bond with one line per block, or "arch", of a bridge of 5 m

    Raises
    ------
    InputError
        Where the file exists: it may be somebody's work. For an unknown structure, and an arch as a drawing.
    """
    path = named_path(path)
    drawn = path.suffix.lower() == ".svg"
    choice("of", of, ("wall", "arch"))
    if path.suffix.lower() not in (".json", ".svg"):
        raise InputError(f"{path}: give a name that ends in .json, a model, or in .svg, a drawing")
    if path.exists():
        raise InputError(f"{path} exists already; choose another name")
    if of == "arch":
        if drawn:
            raise InputError(f"{path}: the arch is a model, no drawing: give a name that ends in .json")
        joint = Joint(friction_angle_deg=35.0)
        bridge = arch(thickness=0.45, width=1.0, voussoirs=15, span=5.0, rise=1.5, joint=joint)
        write_json(path, bridge, Loads.weight(bridge))
        return
    # six courses of 0.2 m, half a stone of 0.4 m at the ends of every second one, on a slab; corners x, z [m]
    stones = {"ground": [[-0.2, -0.2], [1.4, -0.2], [1.4, 0.0], [-0.2, 0.0]]}
    for course, ends in enumerate([[0, 0.4, 0.8, 1.2], [0, 0.2, 0.6, 1.0, 1.2]] * 3):
        low, high = round(0.2 * course, 3), round(0.2 * (course + 1), 3)
        for k, (left, right) in enumerate(pairwise(ends), 1):
            stones[f"stone-{course + 1}-{k}"] = [[left, low], [right, low], [right, high], [left, high]]
    if drawn:
        write_text(path, _drawing(stones))
        return
    rows = [[f"  {json.dumps(outline)}" for outline in stones.values()], [f'  "{name}"' for name in stones]]
    outlines, names = (",\n".join(r) for r in rows)
    write_text(path, _MODEL.replace("OUTLINES", outlines).replace("NAMES", names))


def _drawing(stones: Mapping[str, Sequence[Sequence[float]]]) -> str:
    """An SVG of rectangles in millimetres, with half the mortar off every side.

    The ground has a layer of its own, as it is held.

    Parameters
    ----------
    stones : corners of every stone by name [m], counter-clockwise from the lower left
    """
    layers: dict[str, list[str]] = {"ground": [], "stones": []}
    for name, corners in stones.items():
        (left, low), (right, high) = corners[0], corners[2]
        # y points down: its upper left corner is at -z of the top
        x, y = 1e3 * (left + _OPEN / 2), 1e3 * (_OPEN / 2 - high)
        width, height = 1e3 * (right - left - _OPEN), 1e3 * (high - low - _OPEN)
        rectangle = f'  <rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}"/>'
        layers["ground" if name == "ground" else "stones"].append(rectangle)
    groups = "\n".join(f' <g id="{name}">\n' + "\n".join(rows) + "\n </g>" for name, rows in layers.items())
    # the wall of 1.2 m by 1.2 m, its slab, and some room around
    box = 'viewBox="-250 -1250 1700 1500" fill="none" stroke="black"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box}>\n{groups}\n</svg>\n'
