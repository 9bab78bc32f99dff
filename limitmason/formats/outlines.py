"""Outlines of blocks in a drawing, by layer: what is drawn closed, and what single lines enclose together."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import not_negative, several
from limitmason.errors import InputError
from limitmason.formats.outline_repair import SAME, loops, need_shapely
from limitmason.formats.svg_paths import LARGEST
from limitmason.model.plausibility import PlausibilityWarning

_OVER = 0.02
"""Share of a filled area over outlines from which on it repeats them; chosen."""

_ROUNDING = 1e-9
"""Distance over the size of a line within which its ends are one point."""

_SAME = 1e-3
"""Difference of the boxes of two outlines over their size below which they may be one, drawn twice; chosen."""


class Outlines(NamedTuple):
    """Outlines x, z [m], shape (n, 2) each, for ``Assembly.from_polygons``.

    ``names`` are "layer-number", ``layers`` the layer of each.
    """

    outlines: list[Array]
    names: list[str]
    layers: list[str]


class _Stroke(NamedTuple):
    """An open line: its points x, z [m], kind, and where it stands in the file."""

    points: Array
    kind: str
    where: str


class DrawnOutlines:
    """What a drawing holds, by layer in the order of the drawing.

    ``closed`` are its outlines x, z [m], shape (n, 2) each, and ``open`` its single lines. ``filled`` are its filled
    areas, each as the rings around it.
    """

    def __init__(self) -> None:
        self.layers: list[str] = []
        self.closed: dict[str, list[Array]] = {}
        self.open: dict[str, list[_Stroke]] = {}
        self.filled: dict[str, list[list[Array]]] = {}

    def take(self, layer: str, points: Array, closed: bool, kind: str, where: str) -> None:
        """Keep a line of a layer, as an outline where it is closed or ends where it began.

        Parameters
        ----------
        layer : name of the layer
        points : x, z [m], shape (n, 2)
        closed : whether it is drawn as closed
        kind : what it is called in the file
        where : the file and its place there, for errors

        Raises
        ------
        InputError
            For a closed line of fewer than three corners, and for one that leaves the numbers.
        """
        if not (np.abs(points) < LARGEST).all():
            raise InputError(f"{where}: a coordinate is no number, or beyond {LARGEST:g} m")
        if layer not in self.closed:
            self.layers.append(layer)
            self.closed[layer], self.open[layer] = [], []
        size = float(np.ptp(points, axis=0).max(initial=0.0))
        # a line that never leaves its first point ends there too, and is none
        if size > 0.0 and len(points) > 1 and np.linalg.norm(points[0] - points[-1]) <= _ROUNDING * size:
            points, closed = points[:-1], True
        if closed and len(points) < 3:
            raise InputError(f"{where}: the outline has {len(points)} corners and encloses no area")
        if closed:
            self.closed[layer].append(points)
        elif size > 0.0:  # a point is no line
            self.open[layer].append(_Stroke(points, kind, where))

    def fill(self, layer: str, rings: list[Array]) -> None:
        """Keep the rings x, z [m], shape (n, 2) each, around one filled area of a layer."""
        self.filled.setdefault(layer, []).append(rings)

    def outlines(self, gap: float, path: str | Path, must_close: Collection[str] = ()) -> Outlines:
        """Closed lines, then loops of the open ones, layer by layer.

        Parameters
        ----------
        gap : distance up to which ends of lines meet [m]
        path : of the drawing, for messages
        must_close : kinds of lines that are an error where they enclose nothing with their neighbours

        Raises
        ------
        InputError
            For such a line, by its place in the file.

        Warns
        -----
        PlausibilityWarning
            With the number of lines of each kind and layer that enclose nothing.
        """
        not_negative("gap", gap)
        found = Outlines([], [], [])
        for layer in self.layers:
            for outline in (*self.closed[layer], *self._enclosed(layer, gap, path, must_close)):
                found.outlines.append(outline)
                found.layers.append(layer)
                found.names.append(f"{layer}-{found.layers.count(layer)}")
        for layer, areas in self.filled.items():
            self._add_filled(found, layer, areas, path)
        return found

    @staticmethod
    def _add_filled(found: Outlines, layer: str, areas: list[list[Array]], path: str | Path) -> None:
        """Add filled areas where nothing else is drawn: elsewhere they repeat outlines.

        Parameters
        ----------
        found : outlines so far, to which they are added
        layer : name of the layer of the areas
        areas : rings x, z [m], shape (n, 2) each, around every area
        path : of the drawing, for messages
        """
        shapely = need_shapely()
        drawn = shapely.union_all([shapely.make_valid(shapely.Polygon(o)) for o in found.outlines])
        alone, islands = 0, 0
        taken: list[Any] = []
        for rings in areas:
            polygons = [shapely.make_valid(shapely.Polygon(r)) for r in rings]
            # a ring within another leaves an island out, and a block has no hole
            if any(a is not b and a.covers(b) for a in polygons for b in polygons):
                islands += 1
                continue
            for ring, polygon in zip(rings, polygons, strict=True):
                # one area filled twice, with a colour and a pattern, is one block
                again = any(_common(polygon, other) > SAME for other in taken)
                if polygon.area > 0.0 and not again and polygon.intersection(drawn).area < _OVER * polygon.area:
                    alone += 1
                    taken.append(polygon)
                    found.outlines.append(_open(ring))
                    found.layers.append(layer)
                    found.names.append(f"{layer}-{found.layers.count(layer)}")
        for count, text in ((alone, "taken as blocks: nothing else is drawn there"),
                            (islands, "left out: they have islands, and a block has one outline")):
            if count:
                warnings.warn(f"{path}: layer {layer!r}: {count} hatches are {text}", PlausibilityWarning, stacklevel=4)

    def _enclosed(self, layer: str, gap: float, path: str | Path, must_close: Collection[str]) -> list[Array]:
        """Loops of the open lines of a layer, unless they repeat a closed outline.

        They are corners [m], shape (n, 2) each. What encloses nothing is told in a warning.

        Parameters
        ----------
        layer : name of the layer
        gap : distance up to which ends of lines meet [m]
        path : of the drawing, for messages
        must_close : kinds of lines that may not stay open
        """
        strokes = self.open[layer]
        if not strokes:
            return []
        faces, unused = loops([s.points for s in strokes], gap)
        lost = next((strokes[k] for k in unused if strokes[k].kind in must_close), None)
        if lost is not None:
            raise InputError(f"{lost.where}: the polyline is open; close it, or leave its layer out with layers=[...]")
        if unused:
            kinds = Counter(strokes[k].kind for k in unused)
            text = ", ".join(f"{n} {kind}" for kind, n in sorted(kinds.items()))
            warnings.warn(
                f"{path}: layer {layer!r}: {text} of {len(strokes)} single lines enclose no block and are left out "
                f"(their ends must meet within gap={gap:g} m)", PlausibilityWarning, stacklevel=5,
            )
        return [f for f in faces if not any(_same(f, c) for c in self.closed[layer])]


def named_layers(layers: str | Iterable[str] | None) -> set[str] | None:
    """Layers that are asked for, in lower case, or None for all."""
    if layers is None:
        return None
    wanted = (layers,) if isinstance(layers, str) else several("layers", layers, str)
    if not wanted:
        raise InputError("layers: name at least one, or leave them out to read all")
    return {name.casefold() for name in wanted}


def check_layers(wanted: set[str] | None, there: Iterable[str], path: str | Path) -> None:
    """Refuse layers asked for that a drawing does not have.

    Parameters
    ----------
    wanted : names in lower case; None for all
    there : names of the layers of the drawing
    path : of the drawing, for the error
    """
    known = {name.casefold(): name for name in there}
    for name in sorted((wanted or set()) - set(known)):
        raise InputError(f"{path}: there is no layer {name!r}; there are {', '.join(sorted(known.values())) or 'none'}")


def _open(ring: Array) -> Array:
    """A ring whose last point does not repeat the first."""
    size = float(np.ptp(ring, axis=0).max())
    return ring[:-1] if np.linalg.norm(ring[0] - ring[-1]) <= _ROUNDING * size else ring


def _same(a: Array, b: Array) -> bool:
    """Whether two outlines, corners of shape (n, 2), have the same box around them and the same area in it."""
    size = float(np.ptp(b, axis=0).max())
    if np.abs([a.min(axis=0) - b.min(axis=0), a.max(axis=0) - b.max(axis=0)]).max() >= _SAME * size:
        return False
    # two triangles of a rectangle have one box
    shapely = need_shapely()
    return _common(*(shapely.make_valid(shapely.Polygon(ring)) for ring in (a, b))) > SAME


def _common(a: Any, b: Any) -> float:
    """Common area of two polygons of shapely over that of the larger one, zero where they have none."""
    return float(a.intersection(b).area) / max(a.area, b.area, 1e-300)
