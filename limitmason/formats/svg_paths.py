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
_OWN_UNIT = re.compile(r"[\d.]\s*(?!px\b|[eE][-+]?\d)[a-zA-Z]+\b|%")
"""A length that is not in units of the drawing; px is one of those."""

_SMALLEST_TURN = 1e-3
"""Least turn of an arc over one chord [rad], chosen: with a tiny flatness the turn is zero by rounding."""

_FEWEST_CHORDS = 3
"""Of an arc: a circle, drawn as two half turns, keeps an area however large the flatness is."""

_MOST_CHORDS = 10_000
"""Of one curve, chosen: no drawing of stones needs more."""


class Line(NamedTuple):
    """Points of a line, shape (n, 2), and whether it is drawn as closed."""

    points: Array
    closed: bool


def numbers_of(text: str, where: str) -> list[float]:
    """All numbers in the text of an attribute, in units of the drawing.

    Parameters
    ----------
    text : the attribute as the file has it, such as "12.5", "3px", or "0 0 200 100" of a viewBox
    where : the file and the shape, for errors

    Raises
    ------
    InputError
        For a length in a unit of its own ("5mm", "10%"), text without a number, and a number beyond :data:`LARGEST`.
    """
    # one scale takes the whole drawing to metres: a length in another unit would need a second one
    if _OWN_UNIT.search(text):
        raise InputError(f"{where}: {text!r} has a unit of its own; let the program write plain numbers")
    found = [_number(n, where) for n in _NUMBER.findall(text)]
    if not found:
        raise InputError(f"{where}: {text!r} is no number")
    return found


def number_of(text: str, where: str) -> float:
    """The one number in the text of an attribute; several, as in "2,5", are refused, else as :func:`numbers_of`."""
    found = numbers_of(text, where)
    if len(found) > 1:
        raise InputError(f"{where}: {text!r} is not one number; write a point for a decimal comma")
    return found[0]


def _number(text: str, where: str) -> float:
    """A number of the file, refused where it is too large for a drawing."""
    value = float(text)
    if abs(value) > LARGEST:
        raise InputError(f"{where}: {text} is beyond {LARGEST:g} units")
    return value


def matrix_of(text: str, where: str) -> Array:
    """Matrix of a ``transform`` for columns (x, y, 1), shape (3, 3).

    Of several steps the one written first is applied last.

    Parameters
    ----------
    text : the attribute: steps matrix, translate, scale, rotate, skewX or skewY with their numbers in brackets, angles
        in degrees from x to y; "" for none
    where : the file and the shape, for errors

    Raises
    ------
    InputError
        For another word, and a step with too many or too few numbers.
    """
    out = np.eye(3)
    rest = re.sub(r"(\w+)\s*\(([^)]*)\)", "", text).strip(" ,\n\t")
    if rest:
        raise InputError(f"{where}: transform {text!r} cannot be read")
    for name, given in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        # a style may write units, an attribute has numbers alone: units of the drawing, and degrees
        if _OWN_UNIT.search(re.sub(r"deg\b", "", given)):
            raise InputError(f"{where}: transform {name}({given}) has a unit of its own; write plain numbers")
        found = [_number(v, where) for v in _NUMBER.findall(given)]
        step = np.eye(3)
        if name == "matrix" and len(found) == 6:
            # the file gives the columns one after another, without the last row
            step[:2] = np.array(found).reshape(3, 2).T
        elif name == "translate" and len(found) in (1, 2):
            step[:2, 2] = [found[0], found[1] if len(found) > 1 else 0.0]
        elif name == "scale" and len(found) in (1, 2):
            step[0, 0], step[1, 1] = found[0], found[-1]  # a single number is for both axes
        elif name == "rotate" and len(found) in (1, 3):
            c, s = np.cos(np.deg2rad(found[0])), np.sin(np.deg2rad(found[0]))
            step[:2, :2] = [[c, -s], [s, c]]
            if len(found) == 3:
                centre = np.array(found[1:])
                step[:2, 2] = centre - step[:2, :2] @ centre
        elif name in ("skewX", "skewY") and len(found) == 1:
            step[(0, 1) if name == "skewX" else (1, 0)] = np.tan(np.deg2rad(found[0]))
        else:
            raise InputError(f"{where}: transform {name}({given}) cannot be read")
        out = out @ step
    return out


def viewport(
    element: ElementTree.Element, placed: ElementTree.Element, room: tuple[float, float], where: str
) -> tuple[Array, tuple[float, float]]:
    """Matrix of a drawing within a drawing, shape (3, 3), and the inner size.

    The matrix takes columns (x, y, 1) of the inner drawing to the outer one. The size is width and height in units of
    the inner drawing.

    Parameters
    ----------
    element : the inner drawing, svg or symbol, with its ``viewBox`` and ``preserveAspectRatio``
    placed : the element that says where it stands by ``x``, ``y``, ``width`` and ``height``: itself, or the copy (use)
        of a symbol
    room : width and height of the outer drawing in its units, of which percentages are taken
    where : the file and the shape, for errors

    Raises
    ------
    InputError
        For a viewBox without a size, and words that cannot be read.
    """

    def length(name: str, whole: float, default: str) -> float:
        """An attribute of ``placed`` in units of the outer drawing.

        Percentages are of the length ``whole``.
        """
        text = placed.get(name, default).strip()
        unit = 0.01 * whole if text.endswith("%") else 1.0
        return unit * number_of(text.removesuffix("%"), where)

    # x and y of the corner, width and height that the inner drawing shows, in its own units
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
    corner, extent = np.array(box[:2]), np.array(box[2:])
    stretch = size / extent
    if words[0] != "none":
        # stretched alike both ways: until all of it is inside, or until nothing stays empty (slice)
        stretch = np.full(2, stretch.max() if "slice" in words else stretch.min())
        place = np.array([{"Min": 0.0, "Mid": 0.5, "Max": 1.0}[w] for w in (words[0][1:4], words[0][5:8])])
        out[:2, 2] += place * (size - stretch * extent)
    inner = np.diag([*stretch, 1.0])
    inner[:2, 2] = -stretch * corner
    return out @ inner, (box[2], box[3])


def shape_lines(element: ElementTree.Element, kind: str, flatness: float, where: str) -> Iterator[Line]:
    """Lines of a shape in its own units, before its own transform.

    Rounded corners of a rect (``rx``) are taken as sharp.

    Parameters
    ----------
    element : the shape
    kind : its tag: path, polygon, polyline, rect, circle, ellipse or line
    flatness : largest distance between a curve and its chord, in units of the shape
    where : the file and the shape, for errors

    Raises
    ------
    InputError
        For path data or numbers that cannot be read.
    """

    def number(name: str) -> float:
        """An attribute of the shape, zero where it is not given."""
        return number_of(element.get(name, "0"), where)

    if kind == "path":
        data = element.get("d", "").strip()
    elif kind in ("polygon", "polyline"):
        # of several points after M all but the first are ends of lines; by the standard nothing is drawn without any
        points = element.get("points", "").strip()
        data = f"M{points}{'z' * (kind == 'polygon')}" if points else ""
    elif kind == "line":
        data = f"M{number('x1')} {number('y1')}L{number('x2')} {number('y2')}"
    elif kind == "rect":
        w, h = number("width"), number("height")
        # by the standard nothing is drawn without a size
        data = f"M{number('x')} {number('y')}h{w}v{h}h{-w}z" if w > 0.0 and h > 0.0 else ""
    else:
        a, b = (number("r"), number("r")) if kind == "circle" else (number("rx"), number("ry"))
        # two half turns: an arc that ends where it begins draws nothing
        halves = f"a{a} {b} 0 0 0 {2.0 * a} 0 {a} {b} 0 0 0 {-2.0 * a} 0z"
        data = f"M{number('cx') - a} {number('cy')}{halves}" if min(a, b) > 0.0 else ""
    return _path(data, flatness, where)


def _path(data: str, flatness: float, where: str) -> Iterator[Line]:
    """Lines of path data, with chords for curves.

    Parameters
    ----------
    data : as in the attribute ``d`` of a path
    flatness : largest distance between a curve and its chord, in the units of the data
    where : the file and the shape, for errors
    """
    points: list[complex] = []  # x + iy, as svg.path has them
    for segment in _segments(data, where):
        kind = type(segment).__name__
        if kind in ("Move", "Close"):
            if len(points) > 1:
                yield _line(points, closed=kind == "Close")
            # after Close the pen stands where the closed line began: what follows without Move is a new line from there
            points = [segment.end] if kind == "Move" else []
            continue
        points = points or [segment.start]
        if kind != "Line":
            points += [segment.point(t) for t in np.linspace(0.0, 1.0, _chords(segment, flatness) + 1)[1:-1]]
        points.append(segment.end)
    if len(points) > 1:
        yield _line(points, closed=False)


def _line(points: list[complex], closed: bool) -> Line:
    """A line through points x + iy, as svg.path has them."""
    whole = np.array(points)
    return Line(np.column_stack([whole.real, whole.imag]), closed)


def _segments(data: str, where: str) -> Any:
    """Segments of path data, as svg.path reads them.

    What svg.path would pass over in silence is refused.

    Parameters
    ----------
    data : as in the attribute ``d`` of a path
    where : the file and the shape, for errors
    """
    svg = needed("svg.path", "SVG drawings", "dxf")
    # every command and number is blanked out: what is left, but for space and commas, is none
    odd = re.search(r"[^\s,]", _WORD.sub(lambda word: " " * len(word[0]), data))
    if odd:
        raise InputError(f"{where}: path data cannot be read at {data[odd.start() : odd.start() + 12]!r}")
    if data and data[0] not in "Mm":
        raise InputError(f"{where}: path data {data[:20]!r} does not begin with M")
    for text in _NUMBER.findall(data):
        _number(text, where)  # refuses what is too large
    # these commands take pairs x, y
    for pairs in re.findall(rf"[MLTCSQ]((?:[\s,]*{_NUMBER.pattern})*)", data, re.IGNORECASE):
        if len(_NUMBER.findall(pairs)) % 2:  # svg.path ends there in silence
            raise InputError(f"{where}: path data {data[:20]!r} cannot be read: an odd number of coordinates")
    try:
        return svg.parse_path(data)
    except (ValueError, ArithmeticError, IndexError, AssertionError) as error:
        raise InputError(f"{where}: path data {data[:20]!r} cannot be read: {error}") from None


def _chords(segment: Any, flatness: float) -> int:
    """Number of chords that keep to a curve within the flatness.

    They are equal steps of its parameter. A chord that turns by t leaves an arc of radius r by r (1 - cos(t / 2)). A
    chord over 1/n of a Bezier curve B is off by at most max |B''| / (8 n^2). With k + 1 handles, |B''| is at most
    k (k - 1) times their largest second difference.

    Parameters
    ----------
    segment : a curve of svg.path: Arc, QuadraticBezier or CubicBezier
    flatness : largest distance between the curve and a chord, in the units of the path
    """
    if type(segment).__name__ == "Arc":
        # by the standard such an arc is left out, or is a straight line
        if segment.start == segment.end or 0.0 in (segment.radius.real, segment.radius.imag):
            return 1
        # radii too small for the ends to be reached are scaled up; the larger one of an ellipse is on the safe side
        radius = segment.radius_scale * max(segment.radius.real, segment.radius.imag)
        turn = 2.0 * np.arccos(max(1.0 - flatness / radius, 0.0))
        count = int(np.ceil(np.deg2rad(abs(segment.delta)) / max(turn, _SMALLEST_TURN)))
        return min(max(count, _FEWEST_CHORDS), _MOST_CHORDS)
    middle = [getattr(segment, name) for name in ("control", "control1", "control2") if hasattr(segment, name)]
    handles = np.array([segment.start, *middle, segment.end])
    bend = len(middle) * (len(middle) + 1) * float(np.abs(np.diff(handles, 2)).max())
    if bend >= 8.0 * flatness * _MOST_CHORDS**2:  # a flatness of zero asks for more than any number
        return _MOST_CHORDS if bend > 0.0 else 1
    return max(int(np.ceil(np.sqrt(bend / (8.0 * flatness)))), 1)
