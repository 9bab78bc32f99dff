"""Walls from a written layout: rows of unit widths in block lengths, bottom row first, openings as negative widths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from limitmason.build.arguments import unit_size
from limitmason.build.erect import Site, add_ground, add_units
from limitmason.build.leading_course import Piece
from limitmason.build.plan import Unit
from limitmason.checks import choice, finite, positive, switch
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.input import read_list
from limitmason.model.joint import Joint

Row = str | Sequence[float]

_SAME = 1e-9  # of a block length: widths and places that differ by less are equal
_DIGITS = 12  # decimals to which sums of widths are rounded, so that 0.1 + 0.2 is 0.3


class _Gap(NamedTuple):
    """A gap in the wall.

    Its left and right end in block lengths, its lowest course from 0, and the course above it.
    """

    left: float
    right: float
    first: int
    past: int


def layout(
    rows: Sequence[Row],
    *,
    unit: Sequence[float],
    joint: Joint,
    thickness: float | None = None,
    density: float = 2000.0,
    column: str | None = None,
    ragged: bool = False,
    base: str | None = "slab",
    base_margin: float | None = None,
    top_beam: float | None = None,
    beam_density: float | None = None,
    joints: Mapping | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Return the straight single-leaf wall whose courses are written out unit by unit.

    Parameters
    ----------
    rows
        Bottom first. Each a string such as "0.5 1 -1 1 0.5" or a sequence of numbers: widths in block lengths, a
        negative one leaves an opening (at the start of a row: a row that starts further right).
    unit
        (length, height) or (length, height, thickness) of a whole block [m].
    thickness
        Of the wall [m]; default the thickness of the unit.
    joint, joints, density, base, base_margin, top_beam, beam_density, tolerance
        As in `wall`.
    column
        "left" or "right": the outermost block of every row belongs to a lateral column and is named "column-1",
        "column-2", ... by course. Where its width changes from row to row the wall is toothed into it.
    ragged
        Rows may end at different places; otherwise a row of another length is taken as a slip and refused.

    Returns
    -------
    Assembly
        Blocks "base", "facade-03-05" (course, position), "column-3", "beam".

    Raises
    ------
    InputError
        Naming the row: not numbers, zero width, no block, another length than the first row.

    Notes
    -----
    Source of the notation: layouts of the walls of Ferris and Tin-Loi (2001), Int. J. Mech. Sci. 43, 209-224.
    `recipe["staggering"]` is measured: the smallest overlap of successive rows.
    """
    rows = read_list("rows, bottom first,", rows)
    if not rows:
        raise InputError("rows must be a sequence of rows, bottom first")
    values = list(unit) if isinstance(unit, (tuple, list, np.ndarray)) else unit
    if thickness is None:
        length, height, depth = unit_size(values)
    else:
        # a thickness of the unit gives way to that of the wall
        length, height = unit_size(values[:2] if isinstance(values, list) and len(values) == 3 else values, parts=2)
        depth = positive("thickness", thickness)
    choice("column", column, (None, "left", "right"))
    ragged = switch("ragged", ragged)
    positive("density", density)
    widths = [_read(row, number) for number, row in enumerate(rows)]
    spans = [sum(abs(w) for w in row) for row in widths]
    for number, span in enumerate(spans):
        if not ragged and abs(span - spans[0]) > _SAME * spans[0]:
            raise InputError(
                f"rows[{number}] is {span:g} block lengths long, rows[0] is {spans[0]:g}; "
                "pass ragged=True if that is meant"
            )

    size = (length, height, depth)
    laid = [_course(row, number, size) for number, row in enumerate(widths)]
    courses, pieces = [units for units, _ in laid], [solid for _, solid in laid]
    columns = [] if column is None else [units[0 if column == "left" else -1] for units in courses]
    laps = min((_overlap(a, b) for a, b in pairwise(pieces)), default=float("inf"))
    overlap = None if laps == float("inf") else laps
    starts, stops = [row[0].start for row in pieces], [row[-1].end for row in pieces]
    left, right, top = min(starts), max(stops), len(rows) * height
    site = Site(density)
    add_ground(site, (left, right, 0.0, depth), size, base, base_margin)
    add_units(site, courses, fix_bottom=base == "course", columns=columns)
    if top_beam is not None:
        box = ((starts[-1], 0.0, top), (stops[-1], depth, top + positive("top_beam", top_beam)))
        site.add_box("beam", box, axis=0, density=beam_density)
    elif beam_density is not None:
        raise InputError("beam_density is given but top_beam is not")
    recipe = {
        "kind": "wall", "plan": "straight", "bond": "layout", "rows": widths, "length": right - left, "height": top,
        "thickness": depth, "courses": len(rows), "unit": list(size), "unit_length": length, "unit_height": height,
        "unit_thickness": depth, "leaves": 1, "header_every": None, "staggering": overlap, "smallest_overlap": overlap,
        "column": column, "returns": [], "side_walls": 0, "side_wall_thickness": 0.0,
        "openings": _openings(widths, length, height), "density": float(density), "base": base, "top_beam": top_beam,
        "beam_over": "facade" if top_beam is not None else None,
    }
    return site.assembly(joint, recipe, joints=joints, tolerance=tolerance)


def _course(
    row: Sequence[float], number: int, size: tuple[float, float, float]
) -> tuple[list[Unit], tuple[Piece, ...]]:
    """Units of a row and the pieces of it that are solid.

    Parameters
    ----------
    row : widths in unit lengths, negative for gaps
    number : of the row, counted from 0 at the bottom
    size : length, height and thickness of a unit [m]
    """
    length, height, depth = size
    units, solid = [], []
    # the running sum is taken in block lengths, so that joints meant to be in line are in line to the last bit
    position = 0.0
    for width in row:
        end = round(position + abs(width), _DIGITS)
        if width > 0.0:
            box = ((position * length, 0.0, number * height), (end * length, depth, (number + 1) * height))
            units.append(Unit(run="facade", course=number, leaf=-1, boxes=[box], axis=0))
            solid.append(Piece(position * length, end * length, header=False))
        position = end
    return units, tuple(solid)


def _read(row: Row, number: int) -> list[float]:
    """Widths of a row in unit lengths, a negative one for a gap.

    Parameters
    ----------
    row : as written
    number : of the row from 0 at the bottom, for messages
    """
    try:
        tokens = [float(token) for token in row.split()] if isinstance(row, str) else list(row)
    except (TypeError, ValueError):
        raise InputError(f"rows[{number}] must be numbers with spaces between, got {row!r}") from None
    widths = [finite(f"rows[{number}]", token) for token in tokens]
    if any(width == 0.0 for width in widths):
        raise InputError(f"rows[{number}] has a block of zero width: {row!r}")
    if not any(width > 0.0 for width in widths):
        raise InputError(f"rows[{number}] has no block: {row!r}")
    return widths


def _overlap(lower: tuple[Piece, ...], upper: tuple[Piece, ...]) -> float:
    """Smallest distance between head joints of two rows [m].

    Edges of openings do not count: they stand in line on purpose. It is infinite where a row has no head joint.

    Parameters
    ----------
    lower, upper : pieces of the two rows
    """
    joints = []
    for row in (lower, upper):
        # a head joint is where one piece begins and another ends
        ends = {round(p.end, _DIGITS) for p in row}
        joints.append({round(p.start, _DIGITS) for p in row} & ends)
    return min((abs(a - b) for a in joints[0] for b in joints[1]), default=float("inf"))


def _openings(rows: Sequence[Sequence[float]], length: float, height: float) -> list[dict]:
    """Openings for the recipe, as bounding rectangles [m].

    An opening is a gap with a block on both sides; gaps of successive rows that lie one over the other are one.

    Parameters
    ----------
    rows : widths in unit lengths, negative for gaps, bottom row first
    length, height : of a unit [m]
    """
    open_now: list[_Gap] = []
    found: list[_Gap] = []
    for number, row in enumerate(rows):
        following: list[_Gap] = []
        for left, right in _gaps(row):
            below = [g for g in open_now if g.left < right - _SAME and g.right > left + _SAME]
            for gap in below:
                open_now.remove(gap)
            following.append(_Gap(
                left=min([left, *(g.left for g in below)]), right=max([right, *(g.right for g in below)]),
                first=min([number, *(g.first for g in below)]), past=number + 1,
            ))
        # what nothing goes on from is closed
        found.extend(open_now)
        open_now = following
    found.extend(open_now)
    return [
        {"x": g.left * length, "z": g.first * height, "width": (g.right - g.left) * length,
         "height": (g.past - g.first) * height, "lintel": None, "bearing": None}
        for g in sorted(found, key=lambda g: (g.first, g.left))
    ]


def _gaps(row: Sequence[float]) -> list[tuple[float, float]]:
    """Gaps of a row between its first and last block.

    Returned are left and right end of each, in unit lengths.
    """
    gaps, position = [], 0.0
    solid = [k for k, width in enumerate(row) if width > 0.0]
    for k, width in enumerate(row):
        if width < 0.0 and solid[0] < k < solid[-1]:
            gaps.append((position, position - width))
        position += abs(width)
    return gaps
