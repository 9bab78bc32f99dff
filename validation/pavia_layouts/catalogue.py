"""Both multipliers, psi = 0 and psi = phi, of many layouts by the DEM, after a screen by limit analysis."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.errors import InputError
from limitmason.methods import ASSOCIATIVE, DEM, predict
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.study.run_fingerprint import fingerprint
from limitmason.study.sweep import Progress, sweep
from limitmason.study.table import Table
from limitmason.study.workers import Unfinished

Build = Callable[..., tuple[Assembly, Loads]]

COLUMNS = ("psi = 0", "psi = phi")
"""Columns of the catalogue with the DEM multipliers [-]."""


def compute_layouts(
    build: Build,
    layouts: Sequence[Mapping[str, Any]],
    targets: Sequence[float],
    *,
    friction_angle_deg: float,
    window: tuple[float, float] = (0.97, 1.15),
    options: Mapping[str, Any] | None = None,
    store: str | Path | None = None,
    workers: int = 1,
    time_limit: float = np.inf,
    progress: Progress | None = None,
) -> Table:
    """Compute layouts by the DEM at psi = 0 and psi = phi, those near a target first screened by limit analysis.

    Parameters
    ----------
    build : from a layout as keywords, and ``dilatancy_angle_deg``, to an assembly and its loads
    layouts : arguments of ``build``, numbers and text
    targets : multipliers at psi = phi to be met [-]
    friction_angle_deg : phi = psi of the second run [deg]
    window : of associative value over target; layouts outside it for every target are left out. Joints of finite
        stiffness and moved blocks lower the DEM value, so the window reaches further up than down
    options : of the DEM
    store : folder that keeps what is done; the same call goes on from there
    workers : processes
    time_limit : [s], after which no load is begun; what is not finished is left to the next call
    progress : called with one line per finished run

    Returns
    -------
    Table
        Layouts of which both runs are done: their arguments, ``blocks``, ``associative``, ``COLUMNS`` (middle of the
        bracket of the search). Small walls come first, near every target in turn, so that a catalogue that is cut
        short treats the targets alike.

    Raises
    ------
    InputError
        For no layouts or no targets, and a store of another study.

    Notes
    -----
    The associative value is exact for the points of the DEM at psi = phi with rigid joints: points between the corners
    of a face change nothing there.
    """
    if not len(layouts) or not len(targets):
        raise InputError("layouts and targets must not be empty")
    deadline = time.time() + time_limit
    given = dict(options or {})
    folder = None if store is None else Path(store)

    def study(function: Callable[..., Any], points: list[dict[str, Any]], name: str) -> Table:
        file = None if folder is None else folder / f"{name}.jsonl"
        key = fingerprint(name, build, layouts, given if name == DEM else None, points)
        return sweep(function, points, workers=workers, store=file, key=key, progress=progress)

    screened = study(functools.partial(associative_row, build), [dict(x) for x in layouts], ASSOCIATIVE)
    by_size = sorted(range(len(layouts)), key=lambda k: screened.rows[k]["blocks"])
    low, high = window
    in_turn = zip_longest(*(
        [k for k in by_size if low <= screened.rows[k][ASSOCIATIVE] / target <= high] for target in targets
    ))
    near = list(dict.fromkeys(k for turn in in_turn for k in turn if k is not None))
    if not near:
        return Table(())
    angles = (0.0, friction_angle_deg)
    runs = [{**layouts[k], "psi": psi} for k in near for psi in angles]
    found = study(functools.partial(_by_dem, build, given, deadline), runs, DEM)
    names = tuple(layouts[0])
    value = {tuple(row[c] for c in (*names, "psi")): row["multiplier"] for row in found}
    rows = []
    for k in near:
        own = [value.get((*(layouts[k][c] for c in names), psi), np.nan) for psi in angles]
        if np.isfinite(own).all():
            rows.append({**screened.rows[k], **dict(zip(COLUMNS, own, strict=True))})
    return Table(tuple(rows), {}, found.notes)


def associative_row(build: Build, **layout: Any) -> dict[str, Any]:
    """Number of blocks and associative multiplier [-] of one layout."""
    wall, loads = build(**layout)
    found = predict(wall, loads, ASSOCIATIVE)
    return {"blocks": int((~wall.fixed).sum()), ASSOCIATIVE: found.collapse_multiplier, "status": found.status}


def _by_dem(build: Build, options: Mapping[str, Any], deadline: float, *, psi: float, **layout: Any) -> dict[str, Any]:
    """Middle of the bracket of the DEM."""

    def in_time(*_: object) -> None:
        if time.time() > deadline:
            raise Unfinished

    in_time()
    wall, loads = build(**layout, dilatancy_angle_deg=psi)
    found = predict(wall, loads, DEM, **{**options, "progress": in_time})
    low = found.details.get("largest stable", np.nan)
    high = found.details.get("smallest moving", np.nan)
    return {
        "low": low, "high": high, "multiplier": 0.5 * (low + high), "status": found.status,
        "steps": found.details.get("steps", 0),
    }
