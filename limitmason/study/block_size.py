"""What the size of the blocks does to the collapse multiplier of a wall whose own size stays."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Unpack

import numpy as np

from limitmason.build.arguments import courses_from, unit_size
from limitmason.build.wall import wall
from limitmason.checks import choice, numbers, positive
from limitmason.errors import InputError
from limitmason.methods import ASSOCIATIVE, MECHANISMS, get_method, method_name, options_by_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.study.sweep import RunOptions, pair_of, sweep
from limitmason.study.table import Table

Unit = tuple[float, float, float]
Build = Callable[[Unit], tuple[Assembly, Loads]]

SIZES = (0.25, 0.5, 1.0, 2.0)
IN_PLANE, WHOLE = "in plane", "whole block"
MONOLITH = "monolith"
OUTWARDS = (0.0, 1.0, 0.0)
UNIT_COLUMNS = ("unit_length", "unit_height", "unit_thickness")
_PIECES = ("overturning", "sliding")
"""Mechanisms of a structure that moves in one piece, as the catalogue names them."""


def scaled_unit(unit: Unit, size: float, vary: str) -> Unit:
    """Unit with its face, or all of it, a number of times as large.

    Parameters
    ----------
    unit : length, height and thickness [m]
    size : over the unit's own [-]
    vary : "in plane" for length and height, "whole block" for the thickness too
    """
    choice("vary", vary, (IN_PLANE, WHOLE))
    positive("size", size)
    length, height, thickness = unit_size(unit)
    return size * length, size * height, thickness * (size if vary == WHOLE else 1.0)


def block_size_study(
    build: Mapping[str, Any] | Build,
    sizes: Sequence[float] | Mapping[str, Sequence[float]] = SIZES,
    methods: Sequence[str] | None = None,
    *,
    unit: Unit | None = None,
    vary: str = IN_PLANE,
    direction: tuple[float, float, float] | None = None,
    options: Mapping[str, Mapping[str, Any]] | None = None,
    **runs: Unpack[RunOptions],
) -> Table:
    """Collapse multiplier against the size of the blocks.

    The wall's length and height are kept.

    Parameters
    ----------
    build : arguments of ``limitmason.build.wall``, or a function of the unit that returns assembly and loads
    sizes : of the blocks over the reference unit [-], for all methods or by method (the DEM is slow on small blocks)
    methods : "associative" (the default), "non-associative", "dem", ...; the keys of ``sizes`` where that is a mapping
    unit : reference unit (length, height, thickness) [m], where the wall's arguments do not name it
    vary : "in plane" scales length and height of the units at fixed wall thickness; "whole block" scales the thickness
        too, and with it t / H of the wall
    direction : of the horizontal load, for walls given by their arguments; (0, 1, 0) where omitted
    options : settings by method
    runs : executor, workers, store and progress of :func:`limitmason.study.sweep`

    Returns
    -------
    Table
        vary, method, size, unit length, height, thickness [m], blocks, multiplier, low, high, status, ratio to size 1.
        Rows of method "monolith": the structure in one piece, the smaller of overturning and sliding. Rows of size 0
        and status "extrapolated" ("in plane" only: with the thickness the wall itself would vanish): the straight line
        through the two smallest sizes, an indication and no bound.

    Raises
    ------
    InputError
        For an unknown ``vary`` or method, a size that does not fit the height, methods given beside sizes by method,
        options of methods not asked for, a unit given twice, and a direction beside a building function.

    Notes
    -----
    Figs 16 and 17 of Godio, Stefanou, Sab 2017. The two studies are apart because the thickness alone moves t / H:
    part of what "whole block" shows is the stability of a thicker wall, which has nothing to do with its blocks.
    """
    if isinstance(build, Mapping):
        arguments = dict(build)
        if "unit" not in arguments and unit is None:
            raise InputError("the wall's arguments name no unit")
        if "unit" in arguments and unit is not None:
            raise InputError("the wall's arguments name the unit: leave unit= out, or take it out of them")
        unit = arguments.pop("unit", unit)
        direction = OUTWARDS if direction is None else direction
        # the height of the wall stays, in metres: courses of the reference unit would be others of a larger one
        _, tall, _ = unit_size(unit)
        arguments["height"] = tall * courses_from(arguments.get("height"), arguments.pop("courses", None), tall)
        build = functools.partial(_wall, arguments, direction)
    elif direction is not None:
        raise InputError("direction is for walls given by their arguments: a building function returns its own loads")
    elif unit is None:
        raise InputError("give the reference unit=(length, height, thickness) with a building function")
    by_method = _sizes_by_method(sizes, methods)
    methods = tuple(by_method)
    chosen = options_by_method(methods, options)
    # the structure in one piece at every size that any method has, by mechanisms
    by_method[MONOLITH] = sorted({s for its_sizes in by_method.values() for s in its_sizes})
    jobs = [{"vary": vary, "method": m, "size": s} for m, its_sizes in by_method.items() for s in its_sizes]
    for size in by_method[MONOLITH]:  # a size that is wrong is refused before any run
        scaled_unit(unit, size, vary)
    chosen[MONOLITH] = {"include": _PIECES}
    key = ("block size", build, unit, jobs, chosen)
    table = sweep(
        functools.partial(_at_size, build, unit, chosen), jobs, key=key, **runs,
        units=dict.fromkeys(UNIT_COLUMNS, "m"),
    )
    rows = []
    for method in (*methods, MONOLITH):
        of_method = sorted((r for r in table if r["method"] == method), key=lambda r: r["size"])
        reference = next((r["multiplier"] for r in of_method if r["size"] == 1.0), np.nan)
        if method != MONOLITH and vary == IN_PLANE and len(of_method) > 1:
            of_method.insert(0, _extrapolated(of_method[0], of_method[1]))
        rows += [{**r, "ratio": r["multiplier"] / reference if reference else np.nan} for r in of_method]
    return Table(tuple(rows), table.units, table.notes)


def _sizes_by_method(
    sizes: Sequence[float] | Mapping[str, Sequence[float]], methods: Sequence[str] | None
) -> dict[str, list[float]]:
    """Sizes of units of every method, given for each or for all; each size once.

    Parameters
    ----------
    sizes : over the unit's own [-], for all methods or by method
    methods : names, of sizes for all; the associative program where omitted
    """
    if isinstance(sizes, Mapping):
        if methods is not None:
            raise InputError("sizes are given by method: leave methods out")
    else:
        methods = (methods,) if isinstance(methods, str) else methods
        sizes = list(sizes) if isinstance(sizes, Iterable) else sizes  # those of an iterator are for every method
        sizes = dict.fromkeys((ASSOCIATIVE,) if methods is None else methods, sizes)
    own = {method_name(m): list(v) if isinstance(v, Iterable) else v for m, v in sizes.items()}
    return {m: list(dict.fromkeys(numbers(f"sizes for {m!r}", v).ravel().tolist())) for m, v in own.items()}


def _wall(arguments: Mapping[str, Any], direction: tuple[float, float, float], unit: Unit) -> tuple[Assembly, Loads]:
    """Wall of units (length, height, thickness) [m], and its weight as live load.

    ``arguments`` are the others of the wall, ``direction`` is that of the live load.
    """
    built = wall(unit=unit, **arguments)
    return built, Loads.horizontal(built, direction)


def _at_size(
    build: Build, unit: Unit, options: Mapping[str, Mapping[str, Any]], *, vary: str, method: str, size: float
) -> dict[str, Any]:
    """Answer of one method for the wall of units of a size, as a row.

    Parameters
    ----------
    build : makes assembly and loads of a unit
    unit : reference unit (length, height, thickness) [m]
    options : of each method, by name
    vary : "in plane" or "whole block"
    method : its name, or that of the structure in one piece
    size : of the units over the reference unit [-]
    """
    scaled = scaled_unit(unit, size, vary)
    assembly, loads = pair_of(build(scaled))
    found = get_method(MECHANISMS if method == MONOLITH else method).row(assembly, loads, options[method])
    units = dict(zip(UNIT_COLUMNS, scaled, strict=True))
    return {**units, "blocks": int((~assembly.fixed).sum()), **found}


def _extrapolated(smallest: Mapping[str, Any], next_one: Mapping[str, Any]) -> dict[str, Any]:
    """The row of size 0 on the straight line through the two smallest sizes.

    Parameters
    ----------
    smallest, next_one : rows of the two smallest sizes
    """
    share = smallest["size"] / (next_one["size"] - smallest["size"])
    value = smallest["multiplier"] - share * (next_one["multiplier"] - smallest["multiplier"])
    return {
        **smallest, "size": 0.0, "unit_length": 0.0, "unit_height": 0.0, "unit_thickness": smallest["unit_thickness"],
        "blocks": None, "multiplier": value, "low": np.nan, "high": np.nan, "status": "extrapolated",
    }
