"""Shapes of an SVG drawing as lines of points: path data, basic shapes, transformations."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from limitmason.errors import InputError

Array = NDArray[np.float64]

LARGEST = 1e30
"""Numbers beyond it are errors of a drawing; the squares and products of others can be taken."""

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_TOKEN = re.compile(rf"([MmZzLlHhVvCcSsQqTtAa])|({_NUMBER.pattern})|([^\s,])")
_ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


class Line(NamedTuple):
    """Points of a line, shape (n, 2), and whether it is drawn as closed."""

    points: Array
    closed: bool


def numbers_of(text: str, where: str) -> list[float]:
    """Numbers of an attribute; lengths in other units than those of the drawing are refused.

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
        yield from _path(element.get("d", ""), flatness, where)
    elif kind in ("polygon", "polyline"):
        values = numbers_of(element.get("points", ""), where)
        if len(values) % 2:
            raise InputError(f"{where}: an odd number of coordinates")
        yield Line(np.array(values).reshape(-1, 2), kind == "polygon")
    elif kind == "line":
        yield Line(np.array([[number("x1"), number("y1")], [number("x2"), number("y2")]]), False)
    elif kind == "rect":
        x, y, w, h = (number(k) for k in ("x", "y", "width", "height"))
        if w > 0.0 and h > 0.0:
            yield Line(np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]]), True)
    else:
        middle = np.array([number("cx"), number("cy")])
        radii = np.array([number("r")] * 2 if kind == "circle" else [number("rx"), number("ry")])
        if radii.min() > 0.0:
            angle = np.linspace(0.0, 2.0 * np.pi, _chords(2.0 * np.pi, float(radii.max()), flatness) + 1)[:-1]
            yield Line(middle + radii * np.column_stack([np.cos(angle), np.sin(angle)]), True)


def _path(data: str, flatness: float, where: str) -> Iterator[Line]:
    points: list[Array] = []
    start = at = np.zeros(2)
    control: Array | None = None  # second handle of the curve before, for smooth ones
    before = ""
    for command, n in _commands(data, where):
        kind, relative = command.upper(), command.islower()
        origin = at if relative else np.zeros(2)
        if kind == "Z":
            if len(points) > 1:
                yield Line(np.array(points), True)
            at, points, before = start, [], kind
            continue
        if kind == "M":
            if len(points) > 1:
                yield Line(np.array(points), False)
            start = at = origin + n
            points, before = [at], kind
            continue
        if not points:
            points = [at]
        end = origin + n[-2:]
        if kind in "HV":
            end = at.copy()
            end[0 if kind == "H" else 1] = n[0] + (origin[0 if kind == "H" else 1])
            points.append(end)
        elif kind == "L":
            points.append(end)
        elif kind == "A":
            points += _arc(at, n, end, flatness)
        else:
            mirrored = 2.0 * at - control if control is not None and before in _SMOOTH_AFTER[kind] else at
            handles = [mirrored] if kind in "ST" else []
            handles += [origin + n[k : k + 2] for k in range(0, len(n) - 2, 2)]
            points += _bezier([at, *handles, end], flatness)
            control = handles[-1]
        at, before = end, kind
    if len(points) > 1:
        yield Line(np.array(points), False)


_SMOOTH_AFTER = {"C": "", "Q": "", "S": "CS", "T": "QT"}


def _commands(data: str, where: str) -> Iterator[tuple[str, Array]]:
    """Commands of path data with their numbers; repeated ones are written out."""
    command, numbers = "", []
    words = [*_tokens(data, where), ("Z", None)]
    first = True
    for k, (letter, number) in enumerate(words):
        if letter is None:
            if not command:
                raise InputError(f"{where}: path data {data[:20]!r} begins with a number")
            numbers.append(number)
            need = _ARGUMENTS[command.upper()]
            if need == 0:
                raise InputError(f"{where}: a number follows the end of a path")
            if len(numbers) == need:
                if first and command.upper() != "M":
                    raise InputError(f"{where}: path data {data[:20]!r} does not begin with M")
                yield command, np.array(numbers)
                first, numbers = False, []
                command = {"M": "L", "m": "l"}.get(command, command)
            continue
        if numbers:
            raise InputError(f"{where}: {command} needs {_ARGUMENTS[command.upper()]} numbers, got {len(numbers)}")
        command = letter
        if letter in "Zz" and k + 1 < len(words):
            yield letter, np.empty(0)


def _tokens(data: str, where: str) -> Iterator[tuple[str | None, float]]:
    """Letters and numbers of path data; the flags of an arc may stand without a space between."""
    place, letter, count = 0, "", 0
    while place < len(data):
        flag = letter in "Aa" and letter and count % 7 in (3, 4)
        match = (re.compile(r"[\s,]*([01])") if flag else re.compile(r"[\s,]*")).match(data, place)
        if flag and match:
            yield None, float(match.group(1))
            place, count = match.end(), count + 1
            continue
        place = match.end() if match else place
        if place >= len(data):
            return
        found = _TOKEN.match(data, place)
        if found is None or found.group(3):
            raise InputError(f"{where}: path data cannot be read at {data[place : place + 12]!r}")
        place = found.end()
        if found.group(1):
            letter, count = found.group(1), 0
            yield letter, 0.0
        else:
            count += 1
            yield None, _number(found.group(2), where)


def _bezier(handles: list[Array], flatness: float) -> list[Array]:
    """Points of a curve after its first, near enough that chords leave it by less than the flatness.

    A chord over 1/n of the parameter is off by at most |B''| / (8 n^2), and |B''| by k (k - 1) times the largest second
    difference of the k + 1 handles.
    """
    h = np.array(handles)
    degree = len(h) - 1
    bend = degree * (degree - 1) * float(np.linalg.norm(np.diff(h, 2, axis=0), axis=1).max(initial=0.0))
    count = min(max(int(np.ceil(np.sqrt(bend / (8.0 * flatness)))), 1), 10_000)
    t = np.linspace(0.0, 1.0, count + 1)[1:, None]
    level = [np.broadcast_to(p, (count, 2)) for p in h]
    while len(level) > 1:
        level = [(1.0 - t) * a + t * b for a, b in pairwise(level)]
    return list(level[0])


def _arc(start: Array, n: Array, end: Array, flatness: float) -> list[Array]:
    """Points of an elliptic arc after its first, by its centre (SVG 1.1, appendix F.6.5)."""
    radii = np.abs(n[:2])
    if radii.min() < 1.0 / LARGEST or np.allclose(start, end):
        return [end]
    c, s = np.cos(np.deg2rad(n[2])), np.sin(np.deg2rad(n[2]))
    turn = np.array([[c, s], [-s, c]])
    p = turn @ (0.5 * (start - end))
    radii = radii * max(1.0, float(np.sqrt(((p / radii) ** 2).sum())))  # too small ones grow until they reach
    product = float((radii**2).prod())
    cross = float(((radii[::-1] * p) ** 2).sum())
    factor = np.sqrt(max(product / cross - 1.0, 0.0)) * (1.0 if n[3] != n[4] else -1.0)
    centre = factor * np.array([radii[0] * p[1] / radii[1], -radii[1] * p[0] / radii[0]])
    one, two = (p - centre) / radii, (-p - centre) / radii
    first = np.arctan2(one[1], one[0])
    angle = (np.arctan2(two[1], two[0]) - first) % (2.0 * np.pi)
    if not n[4]:
        angle -= 2.0 * np.pi
    steps = first + angle * np.linspace(0.0, 1.0, _chords(abs(angle), float(radii.max()), flatness) + 1)[1:]
    middle = turn.T @ centre + 0.5 * (start + end)
    curve = middle + (radii * np.column_stack([np.cos(steps), np.sin(steps)])) @ turn
    return [*curve[:-1], end]


def _chords(angle: float, radius: float, flatness: float) -> int:
    """Number of equal chords that leave an arc by no more than the flatness."""
    step = 2.0 * np.arccos(max(1.0 - flatness / radius, 0.0))
    return min(max(int(np.ceil(angle / max(step, 1e-3))), 3), 10_000)
