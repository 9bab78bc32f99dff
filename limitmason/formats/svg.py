"""SVG drawings: closed shapes and paths, and what single lines close together, as outlines of blocks, by layer."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from numbers import Real
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import not_negative
from limitmason.errors import InputError
from limitmason.formats.outlines import DrawnOutlines, Outlines, check_layers, named_layers
from limitmason.formats.svg_paths import Line, matrix_of, number_of, shape_lines, viewport
from limitmason.storage.files import named_path

_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_MODE = "{http://www.inkscape.org/namespaces/inkscape}groupmode"
_LINK = "{http://www.w3.org/1999/xlink}href"
_NO_DRAWING = ("defs", "clipPath", "mask", "pattern", "marker", "symbol", "metadata", "style", "script")
_NO_LAYER = "drawing"

_DEEPEST = 50
"""Groups and copies in each other, chosen: a drawing has fewer, a copy that holds itself has no end."""


class _Shape(NamedTuple):
    """A shape of the file.

    ``kind`` is its tag, ``layer`` the name of its layer. ``matrix``, shape (3, 3), takes columns (x, y, 1) to the units
    of the drawing. ``where`` names the file and the shape in errors.
    """

    element: ElementTree.Element
    kind: str
    layer: str
    matrix: Array
    where: str


def read_svg(
    path: str | Path,
    *,
    scale: float | None = None,
    layers: str | Iterable[str] | None = None,
    flatness: float = 1e-3,
    gap: float = 1e-3,
) -> Outlines:
    """Read the outlines of blocks.

    Paths, polygons, rectangles, circles and ellipses, and lines where they form loops.

    The drawing's x is x, its y, which points down, becomes -z; the lowest point drawn has z = 0. Transformations and
    copies (``use``) are applied; shapes hidden by attribute, style or style sheet, texts and images are left out.
    Curves become chords. A layer is one of Inkscape's, or an outermost group with a name.

    Parameters
    ----------
    path : of the drawing
    scale : metres per unit of the drawing (the units of its viewBox); an .svg does not say it, so that it has to be
        given
    layers : names of the layers to read, upper and lower case alike; all by default
    flatness : largest distance between a curve and its chord [m]
    gap : distance up to which ends of single lines meet [m]

    Returns
    -------
    Outlines
        In the order of the drawing; names count from 1 within each layer.

    Raises
    ------
    ImportError
        Where svg.path is not installed, or shapely where lines have to be joined to loops; the message says how.
    InputError
        Naming the file, and the shape where one is wrong: not an SVG, no scale, an unknown layer, a path with a hole,
        nothing to read.

    Warns
    -----
    PlausibilityWarning
        With the number of open lines of each layer that enclose nothing.
    """
    not_negative("flatness", flatness)
    root = _root(path)
    by_id = {e.attrib["id"]: e for e in root.iter() if "id" in e.attrib}
    sheet = _style_sheet(root)
    outer = matrix_of(root.get("transform", ""), str(path))
    # the outermost element has the units in which the drawing is read
    shapes = [
        shape for child in root
        for shape in _shapes(child, outer, layer=None, path=path, by_id=by_id, sheet=sheet, room=_room(root), depth=1)
    ]
    shapes = _on_layers(shapes, layers, path)
    if scale is None:
        raise InputError(f"{path}: {_size_text(root, shapes)}; give scale=, the metres per unit (--scale)")
    if isinstance(scale, bool) or not isinstance(scale, Real) or not (np.isfinite(scale) and scale > 0.0):
        raise InputError(f"scale must be positive [m per unit of the drawing], got {scale!r}")
    lines = [(shape, line) for shape in shapes for line in _lines(shape, flatness / scale)]
    if not lines:
        raise InputError(f"{path}: no outline; draw every block as a closed path, polygon or rectangle")
    # y of a drawing points down: what is lowest has the largest
    lowest = max(float(line.points[:, 1].max()) for _, line in lines)
    drawn = DrawnOutlines()
    for shape, line in lines:
        points = scale * np.column_stack([line.points[:, 0], lowest - line.points[:, 1]])
        drawn.take(shape.layer, points, line.closed, shape.kind, shape.where)
    found = drawn.outlines(gap, path)
    if not found.outlines:
        raise InputError(
            f"{path}: {len(lines)} lines and no closed outline; close every block, or raise gap ({gap:g} m)"
        )
    return found


def _root(path: str | Path) -> ElementTree.Element:
    """Outermost element of an SVG drawing, whose file is ``path``."""
    try:
        root = ElementTree.parse(named_path(path)).getroot()
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: not an SVG drawing that can be read: {error}") from None
    if _kind(root) != "svg":
        raise InputError(f"{path}: not an SVG drawing: its outermost element is {_kind(root)!r}")
    return root


def _room(root: ElementTree.Element) -> tuple[float, float]:
    """Width and height of the drawing ``root`` in its units.

    Percentages are taken of them.
    """
    size = re.findall(r"[^\s,]+", root.get("viewBox", ""))[2:] or [root.get("width", ""), root.get("height", "")]
    try:
        return float(size[0].removesuffix("px")), float(size[1].removesuffix("px"))
    except (ValueError, IndexError):
        # a drawing without a size has none that percentages could be of: one per cent is then one unit
        return 100.0, 100.0


def _kind(element: ElementTree.Element) -> str:
    """Tag of an element without its namespace, such as "rect"; empty for a comment."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _shapes(
    element: ElementTree.Element, matrix: Array, layer: str | None, path: str | Path,
    by_id: dict[str, ElementTree.Element], sheet: dict[str, str], room: tuple[float, float], depth: int,
    visible: bool = True,
) -> Iterator[_Shape]:
    """Every visible shape in an element, itself included.

    Parameters
    ----------
    element : of the drawing
    matrix : of the transforms around the element, shape (3, 3)
    layer : the one in which the element lies; None for none so far
    path : of the drawing, for errors
    by_id : elements that copies may refer to, by their id
    sheet : declarations of the style sheet, see :func:`_style_sheet`
    room : width and height of the drawing around the element, in its units
    depth : number of elements around this one
    visible : whether those around it are, which holds where it does not say otherwise
    """
    kind = _kind(element)
    look = _look(element, sheet)
    if kind in _NO_DRAWING or look.get("display") == "none":
        return
    visible = {"visible": True, "hidden": False, "collapse": False}.get(look["visibility"], visible)
    # what is hidden may hold parts that say "visible": these are shown
    if not visible and not any(_look(part, sheet)["visibility"] == "visible" for part in element.iter()):
        return
    where = f"{path}: {kind} {element.get('id') or element.get(_LABEL) or ''}".rstrip()
    if look.get("transform", "none") != "none":
        raise InputError(f"{where}: it is moved by its style; let the program write transforms as attributes")
    if depth > _DEEPEST:
        raise InputError(f"{where}: groups and copies are nested more than {_DEEPEST} deep; a copy repeats itself")
    matrix = matrix @ matrix_of(element.get("transform", ""), where)
    if kind == "g":
        name = element.get(_LABEL) or element.get("id")
        # a group within a layer is no layer, unless Inkscape says so
        if name and (layer is None or element.get(_MODE) == "layer"):
            layer = name
    if kind == "svg":
        inner, room = viewport(element, element, room, where)
        matrix = matrix @ inner
    if kind == "use":
        link = element.get("href") or element.get(_LINK)
        if link is None:  # by the standard nothing is drawn
            return
        target = by_id.get(link.removeprefix("#"))
        if target is None:
            raise InputError(f"{where}: a copy of {link!r}, which is not in the drawing")
        copied: Iterable[ElementTree.Element] = [target]
        if _kind(target) == "symbol":
            # a symbol is drawn by its copies alone: its children, scaled into the place of the copy
            inner, room = viewport(target, element, room, where)
            copied = target
        else:
            inner = np.eye(3)
            inner[:2, 2] = [number_of(element.get(k, "0"), where) for k in ("x", "y")]
        for child in copied:
            yield from _shapes(child, matrix @ inner, layer, path, by_id, sheet, room, depth + 1, visible)
        return
    if visible and kind in ("path", "polygon", "polyline", "rect", "circle", "ellipse", "line"):
        yield _Shape(element, kind, layer or _NO_LAYER, matrix, where)
    for child in element:
        yield from _shapes(child, matrix, layer, path, by_id, sheet, room, depth + 1, visible)


def _style_sheet(root: ElementTree.Element) -> dict[str, str]:
    """Declarations of the style sheets in a drawing, by a tag, ".class", "tag.class" or "#id".

    Other selectors are left out. ``root`` is the outermost element.
    """
    out: dict[str, str] = {}
    for style in (e for e in root.iter() if _kind(e) == "style"):
        text = re.sub(r"/\*.*?\*/", "", "".join(style.itertext()), flags=re.DOTALL)
        for selectors, declared in re.findall(r"([^{}]+)\{([^{}]*)\}", text):
            for name in map(str.strip, selectors.split(",")):
                out[name] = f"{out.get(name, '')};{declared}"
    return out


def _look(element: ElementTree.Element, sheet: dict[str, str]) -> dict[str, str]:
    """How an element is shown: its attributes, over these the style sheet, over that its own style."""
    classes = [f".{c}" for c in (element.get("class") or "").split()]
    named = [_kind(element), *classes, *(f"{_kind(element)}{c}" for c in classes), f"#{element.get('id')}"]
    declared = ";".join([*(sheet[n] for n in named if n in sheet), element.get("style") or ""])
    pairs = [d.partition(":") for d in declared.split(";") if ":" in d]
    out = {k: element.get(k, "") for k in ("display", "visibility")}
    return out | {k.strip(): v.replace("!important", "").strip() for k, _, v in pairs}


def _on_layers(shapes: list[_Shape], layers: str | Iterable[str] | None, path: str | Path) -> list[_Shape]:
    """The shapes on the layers asked for, all for None.

    A layer that the drawing ``path`` lacks is an error.
    """
    wanted = named_layers(layers)
    check_layers(wanted, [s.layer for s in shapes], path)
    return [s for s in shapes if wanted is None or s.layer.casefold() in wanted]


def _lines(shape: _Shape, flatness: float) -> Iterator[Line]:
    """Lines of a shape in the units of the drawing.

    Parameters
    ----------
    shape : with its matrix to those units
    flatness : largest distance between a curve and its chord, in units of the drawing
    """
    # the largest stretch of any direction: chords of the shape are as flat in the drawing; 1 where all falls together
    stretch = float(np.linalg.norm(shape.matrix[:2, :2], 2)) or 1.0
    lines = list(shape_lines(shape.element, shape.kind, flatness / stretch, shape.where))
    rings = [line.points for line in lines if line.closed]
    if any(a is not b and all(_within(p, b) for p in a) for a in rings for b in rings):
        raise InputError(f"{shape.where}: it has a hole, and a block has one outline: draw it as several blocks around")
    for points, closed in lines:
        yield Line(points @ shape.matrix[:2, :2].T + shape.matrix[:2, 2], closed)


def _within(point: Array, outline: Array) -> bool:
    """Whether a point lies in an outline.

    A ray from it to +x then crosses an odd number of sides. ``point`` is x, y and ``outline`` the
    corners, shape (n, 2).
    """
    x, y = point
    after = np.roll(outline, -1, axis=0)
    crossing = (outline[:, 1] > y) != (after[:, 1] > y)
    a, b = outline[crossing], after[crossing]
    at = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool((at > x).sum() % 2)


def _size_text(root: ElementTree.Element, shapes: list[_Shape]) -> str:
    """What is known of the size of a drawing, in words.

    Its reader can tell the scale from that. ``root`` is its outermost element, ``shapes`` what is drawn in it.
    """
    # chords within a unit are near enough for a size that is only shown
    drawn = [line.points for shape in shapes for line in _lines(shape, flatness=1.0)]
    width, box = root.get("width", ""), root.get("viewBox", "")
    paper = f", {width} wide on paper" if width and not width.endswith("%") else ""
    if not drawn:
        return f"an .svg holds no unit of length (viewBox {box or 'missing'}{paper})"
    across, high = np.ptp(np.concatenate(drawn), axis=0)
    return f"an .svg holds no unit of length: what is drawn measures {across:.6g} x {high:.6g} units{paper}"
