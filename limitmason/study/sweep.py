"""Many runs of one function on any executor, with rows kept as they come."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, TypedDict

from limitmason.checks import count, listener
from limitmason.display.progress import reached, taken_up, watched
from limitmason.errors import InputError
from limitmason.study.memo import Memo, plain
from limitmason.study.run_fingerprint import fingerprint
from limitmason.study.table import Table, same_entry
from limitmason.study.workers import as_row

Progress = Callable[[str], object]


class RunOptions(TypedDict, total=False):
    """How the runs of a study are made, as :func:`sweep` takes it."""

    executor: Any
    workers: int
    store: str | Path | None
    progress: Progress | None


@watched("study")
def sweep(
    function: Callable[..., Any],
    parameters: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]],
    *,
    executor: Any = None,
    workers: int = 1,
    store: str | Path | None = None,
    key: str | tuple[Any, ...] | None = None,
    progress: Progress | None = None,
    units: Mapping[str, str] | None = None,
    batch: int | None = None,
    enough: Callable[[Table], bool] | None = None,
) -> Table:
    """Call a function at every point of a grid, or of a list, and return a table.

    Parameters
    ----------
    function : called with one point as keywords; returns a number, a mapping of numbers and text, or a Prediction (its
        multiplier, status and method become columns)
    parameters : values by name, all combinations of which are run (the last name fastest); or the points themselves
    executor : anything with ``submit`` (concurrent.futures, ``dask.distributed.Client``); joblib's processes by default
    workers : most processes, used where they save more time than starting them takes, in chunks where runs are short;
        1 runs in this process. Each has one thread for its linear algebra
    store : file that keeps finished rows; the same call with it does only what is missing, also after a kill
    key : identifies the study in the store, or what its fingerprint is made of; by default function and points. Give
        one where the function closes over a model
    progress : called with one line per finished run
    units : by column
    batch, enough : points are run so many at a time, in order, and no more once ``enough`` says so of the table up to
        there: the same points whatever the workers, and after a kill

    Returns
    -------
    Table
        One row per point in the order given, whatever the number of workers; none for a point whose function raised
        :class:`Unfinished`.

    Raises
    ------
    InputError
        For no points, points with different names, a result with the name of a parameter, a store of another study
        or with runs of other points, and ``enough`` without ``batch``.
    Exception
        What ``function`` raises; the rows finished before are in the store.
    """
    listener("progress", progress, "a line of text")
    if not callable(function):
        raise InputError(f"function must be one that is called with a point, got {function!r}")
    points = _points(parameters)
    if enough is not None and batch is None:
        raise InputError("enough is asked after every batch of points: give batch= too, 1 to ask after each")
    study = key or ("sweep", function, points)
    memo = Memo(store, "" if store is None else study if isinstance(study, str) else fingerprint(*study), kind=dict)
    rows = {k: memo[k] for k in range(len(points)) if k in memo}  # by number of the point
    _check_points(rows, points, store)
    if rows and progress is not None:
        progress(f"{len(rows)} of {len(points)} runs are in {store}")
    # without a rule to stop by, all points are one batch
    size = len(points) if enough is None or batch is None else count("batch", batch)
    taken_up(len(rows) / len(points))
    clock, done, end = time.perf_counter(), 0, 0
    while end < len(points):
        end = min(end + size, len(points))
        # share of the whole that one run is, whose own progress shows where runs come one after another
        alone = 1.0 / len(points) if executor is None and workers == 1 else 0.0
        reached(len(rows) / len(points), share=alone)
        # all up to here: those that are in the memo are not run again
        jobs = {k: points[k] for k in range(end)}
        for number, row in memo.map(function, jobs, executor=executor, workers=workers, row=partial(_row, points)):
            rows[number] = row
            done += 1
            reached(len(rows) / len(points), f"{len(rows)} of {len(points)} runs", share=alone)
            if progress is not None:
                left = (time.perf_counter() - clock) / done * (len(points) - len(rows))
                shown = ", ".join(f"{k} = {v}" for k, v in _shown(points[number]).items())
                progress(f"[{len(rows)}/{len(points)}] {shown}; {left:.0f} s left")
        if enough is not None and enough(_table(rows, end, units)):
            break
    found = _table(rows, end, units)
    unfinished = end - len(found)
    notes = (f"{unfinished} of {end} runs are not finished: call again with the same store",) if unfinished else ()
    return replace(found, notes=notes)


def _check_points(
    rows: Mapping[int, Mapping[str, Any]], points: Sequence[Mapping[str, Any]], store: str | Path | None
) -> None:
    """Refuse rows of a store whose point is another one, as where the list has changed and a given key has not.

    A point is told by what differs among the points. What all have in common, as a limit of time, may be another in a
    later call with the key.

    Parameters
    ----------
    rows : that the store holds, by number of their point
    points : all of them
    store : its file
    """
    shown = [plain(_shown(p)) for p in points] if rows else []
    alike = {n for n, v in shown[0].items() if all(same_entry(p.get(n), v) for p in shown)} if len(shown) > 1 else set()
    for k, row in rows.items():
        for name, value in shown[k].items():
            if name not in alike and (name not in row or not same_entry(row[name], value)):
                raise InputError(
                    f"{store}: run {k} is of another point, {name} = {row.get(name)!r} in place of {value!r}: the "
                    "points have changed, the key has not; give another key and file, or put new points behind the "
                    "old ones"
                )


def _row(points: Sequence[Mapping[str, Any]], number: int, result: Any) -> dict[str, Any]:
    """Row of a table: a point as far as it fits there, and what the function returned.

    Parameters
    ----------
    points : all of them
    number : of this one
    result : what the function returned
    """
    shown, row = _shown(points[number]), as_row(result)
    if lost := [k for k in shown if k in row and row[k] != shown[k]]:
        raise InputError(f"the function returns {lost[0]!r}, which is the name of a parameter: call it otherwise")
    return {**shown, **row}


def _table(rows: Mapping[int, Mapping[str, Any]], end: int, units: Mapping[str, str] | None) -> Table:
    """Table of ``rows``, by number of their point, of all points before ``end``."""
    return Table(tuple(rows[k] for k in sorted(rows) if k < end), dict(units or {}))


def _points(parameters: Any) -> list[dict[str, Any]]:
    """Points of a sweep: all combinations of values by name, or a list of points.

    ``parameters`` are one or the other, as :func:`sweep` takes them.
    """
    if isinstance(parameters, Mapping):
        for name, given in parameters.items():
            if isinstance(given, str) or not isinstance(given, Iterable):
                raise InputError(f"parameter {name!r} must be a list of values, [{given!r}] for one, got {given!r}")
        values = {k: list(v) for k, v in parameters.items()}
        empty = next((k for k, v in values.items() if not v), None)
        if empty is not None or not values:
            raise InputError(f"parameter {empty!r} has no values" if values else "no parameters are given")
        return [dict(zip(values, point, strict=True)) for point in product(*values.values())]
    try:
        points = [dict(p) for p in parameters]
    except (TypeError, ValueError):
        raise InputError("parameters must be values by name, or a list of points, each a mapping by name") from None
    if not points:
        raise InputError("no points are given")
    if any(p.keys() != points[0].keys() for p in points):
        raise InputError("all points must have the same parameter names")
    return points


def pair_of(built: Any) -> tuple[Any, Any]:
    """What a building function has returned, a model and its loads; anything but a pair is refused."""
    if not isinstance(built, tuple | list) or len(built) != 2:
        kind = f"{len(built)} things" if isinstance(built, tuple | list) else type(built).__name__
        raise InputError(f"build must return a pair (assembly, loads), it returned {kind}")
    return built[0], built[1]


def _shown(point: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of a point that fit in a table: numbers and text."""
    out = {}
    for name, value in point.items():
        # a numpy scalar as a number of Python
        value = value.item() if hasattr(value, "item") and getattr(value, "ndim", 1) == 0 else value
        if isinstance(value, (bool, int, float, str)) or value is None:
            out[name] = value
    return out
