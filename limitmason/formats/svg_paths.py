"""Shapes of an SVG drawing as lines of points: path data by svg.path, basic shapes, transformations."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.storage.files import needed

LARGEST = 1e30
"""Numbers beyond it are errors of a drawing; the squares and products of others can be taken."""

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_WORD = re.compile(rf"[MmZzLlHhVvCcSsQqTtAa]|{_NUMBER.pattern}")


class Line(NamedTuple):
    """Points of a line, shape (n, 2), and whether it is drawn as closed."""

    points: Array
    closed: bool


def numbers_of(text: str, where: str) -> list[float]:
    """Numbers of an attribute.

    Lengths in other units than those of the drawing are refused.

    Raises
    ------
    InputError
        For text that holds none.
    """
    if re.search(r"\d\s*(%|mm|cm|in|pt|pc|em|ex)\b|%", text):
        raise InputError(f"{where}: {text!r} has a unit of its own; let the program write plain numbers")
    found = [_number(n, where) for n in _NUMBER.findall(text)]
    if not found:
        raise InputError(f"{where}: {text!r} is no number")
    return found


def _number(text: str, where: str) -> float:
    """A number of the file, refused where it is too large for a drawing."""
    value = float(text)
    if abs(value) > LARGEST:
        raise InputError(f"{where}: {text} is beyond {LARGEST:g} units")
    return value


def matrix_of(text: str, where: str) -> Array:
    """Matrix (3, 3) of a ``transform``: matrix, translate, scale, rotate and skew, the first applied last.

    Raises
    ------
    InputError
        For words that are none of these.
    """
    out = np.eye(3)
    rest = re.sub(r"(\w+)\s*\(([^)]*)\)", "", text).strip(" ,\n\t")
    if rest:
        raise InputError(f"{where}: transform {text!r} cannot be read")
    for name, given in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        n = [_number(v, where) for v in _NUMBER.findall(given)]
        step = np.eye(3)
        if name == "matrix" and len(n) == 6:
            step[:2] = np.array(n).reshape(3, 2).T
        elif name == "translate" and len(n) in (1, 2):
            step[:2, 2] = [n[0], n[1] if len(n) > 1 else 0.0]
        elif name == "scale" and len(n) in (1, 2):
            step[0, 0], step[1, 1] = n[0], n[-1]
        elif name == "rotate" and len(n) in (1, 3):
            c, s = np.cos(np.deg2rad(n[0])), np.sin(np.deg2rad(n[0]))
            step[:2, :2] = [[c, -s], [s, c]]
            if len(n) == 3:
                step[:2, 2] = np.array(n[1:]) - step[:2, :2] @ n[1:]
        elif name in ("skewX", "skewY") and len(n) == 1:
            step[(0, 1) if name == "skewX" else (1, 0)] = np.tan(np.deg2rad(n[0]))
        else:
            raise InputError(f"{where}: transform {name}({given}) cannot be read")
        out = out @ step
    return out


def viewport(
    element: ElementTree.Element, placed: ElementTree.Element, room: tuple[float, float], where: str
) -> tuple[Array, tuple[float, float]]:
    """Matrix (3, 3) of a drawing within a drawing, and the size of its inside in its own units.

    Parameters
    ----------
    element : svg or symbol, with its ``viewBox`` and ``preserveAspectRatio``
    placed : what says where it stands, ``x``, ``y``, ``width`` and ``height``: itself, or the copy of a symbol
    room : size of the drawing around it, of which percentages are, in its units

    Raises
    ------
    InputError
        For a viewBox without a size, and words that cannot be read.
    """

    def length(name: str, of: float, default: str) -> float:
        text = placed.get(name, default).strip()
        share = 0.01 * of if text.endswith("%") else 1.0
        return share * numbers_of(text.removesuffix("%"), where)[0]

    box = None if element.get("viewBox") is None else numbers_of(element.get("viewBox", ""), where)
    if box is not None and (len(box) != 4 or min(box[2:]) <= 0.0):
        raise InputError(f"{where}: viewBox {element.get('viewBox')!r} is no x, y, width and height")
    out = np.eye(3)
    out[:2, 2] = length("x", room[0], "0"), length("y", room[1], "0")
    size = np.array([length("width", room[0], "100%"), length("height", room[1], "100%")])
    if box is None:
        return out, (float(size[0]), float(size[1]))
    words = (element.get("preserveAspectRatio") or "xMidYMid meet").split()
    if not re.fullmatch(r"none|x(Min|Mid|Max)Y(Min|Mid|Max)", words[0]):
        raise InputError(f"{where}: preserveAspectRatio {words[0]!r} cannot be read")
    share = size / box[2:]
    if words[0] != "none":
        share = np.full(2, share.max() if "slice" in words else share.min())
        place = np.array([{"Min": 0.0, "Mid": 0.5, "Max": 1.0}[w] for w in (words[0][1:4], words[0][5:8])])
        out[:2, 2] += place * (size - share * box[2:])
    inner = np.diag([*share, 1.0])
    inner[:2, 2] = -share * box[:2]
    return out @ inner, (box[2], box[3])


def shape_lines(element: ElementTree.Element, kind: str, flatness: float, where: str) -> Iterator[Line]:
    """Lines of a path, polygon, polyline, rect, circle, ellipse or line, before its own matrix.

    Parameters
    ----------
    flatness : largest distance between a curve and its chord, in units of the shape
    where : for errors

    Raises
    ------
    InputError
        For path data or numbers that cannot be read.
    """

    def number(name: str) -> float:
        return numbers_of(element.get(name, "0"), where)[0]

    if kind == "path":
        data = element.get("d", "").strip()
    elif kind in ("polygon", "polyline"):
        data = "M" + element.get("points", "") + "z" * (kind == "polygon")
    elif kind == "line":
        data = f"M{number('x1')} {number('y1')}L{number('x2')} {number('y2')}"
    elif kind == "rect":
        w, h = number("width"), number("height")
        data = f"M{number('x')} {number('y')}h{w}v{h}h{-w}z" if w > 0.0 and h > 0.0 else ""
    else:
        a, b = (number("r"), number("r")) if kind == "circle" else (number("rx"), number("ry"))
        halves = f"a{a} {b} 0 0 0 {2.0 * a} 0 {a} {b} 0 0 0 {-2.0 * a} 0z"
        data = f"M{number('cx') - a} {number('cy')}{halves}" if min(a, b) > 0.0 else ""
    return _path(data, flatness, where)


def _path(data: str, flatness: float, where: str) -> Iterator[Line]:
    """Lines of path data; curves become chords.

    Points are complex, x + iy, as svg.path has them. ``flatness`` is the largest distance between curve and chord in
    units of the drawing, ``where`` names the shape in errors.
    """
    points: list[complex] = []
    for segment in _segments(data, where):
        kind = type(segment).__name__
        if kind in ("Move", "Close"):
            if len(points) > 1:
                yield _line(points, kind == "Close")
            # after Close the pen stands where the closed line began: what follows without Move is a new line from there
            points = [segment.end] if kind == "Move" else []
            continue
        points = points or [segment.start]
        if kind != "Line":
            points += [segment.point(t) for t in np.linspace(0.0, 1.0, _chords(segment, flatness) + 1)[1:-1]]
        points.append(segment.end)
    if len(points) > 1:
        yield _line(points, False)


def _line(points: list[complex], closed: bool) -> Line:
    whole = np.array(points)
    return Line(np.column_stack([whole.real, whole.imag]), closed)


def _segments(data: str, where: str) -> Any:
    """Segments of path data.

    What svg.path would pass over in silence is refused.
    """
    svg = needed("svg.path", "SVG drawings", "dxf")
    odd = re.search(r"[^\s,]", _WORD.sub(lambda word: " " * len(word[0]), data))
    if odd:
        raise InputError(f"{where}: path data cannot be read at {data[odd.start() : odd.start() + 12]!r}")
    if data and data[0] not in "Mm":
        raise InputError(f"{where}: path data {data[:20]!r} does not begin with M")
    for text in _NUMBER.findall(data):
        _number(text, where)
    for pairs in re.findall(rf"[MLTCSQ]((?:[\s,]*{_NUMBER.pattern})*)", data, re.IGNORECASE):
        if len(_NUMBER.findall(pairs)) % 2:  # svg.path ends there in silence
            raise InputError(f"{where}: path data {data[:20]!r} cannot be read: an odd number of coordinates")
    try:
        return svg.parse_path(data)
    except (ValueError, ArithmeticError, IndexError, AssertionError) as error:
        raise InputError(f"{where}: path data {data[:20]!r} cannot be read: {error}") from None


def _chords(segment: Any, flatness: float) -> int:
    """Number of equal steps of the parameter whose chords leave a curve by no more than the flatness.

    A chord over 1/n of the parameter of a Bezier curve is off by at most |B''| / (8 n^2), and |B''| by k (k - 1) times
    the largest second difference of the k + 1 handles.

    Parameters
    ----------
    segment, flatness : of the library of paths, and that distance, in the units of the drawing
    """
    if type(segment).__name__ == "Arc":
        if segment.start == segment.end or 0.0 in (segment.radius.real, segment.radius.imag):
            return 1
        radius = segment.radius_scale * max(segment.radius.real, segment.radius.imag)
        step = 2.0 * np.arccos(max(1.0 - flatness / radius, 0.0))
        return min(max(int(np.ceil(np.deg2rad(abs(segment.delta)) / max(step, 1e-3))), 3), 10_000)
    middle = [getattr(segment, name) for name in ("control", "control1", "control2") if hasattr(segment, name)]
    handles = np.array([segment.start, *middle, segment.end])
    bend = len(middle) * (len(middle) + 1) * float(np.abs(np.diff(handles, 2)).max())
    return min(max(int(np.ceil(np.sqrt(bend / (8.0 * flatness)))), 1), 10_000)
