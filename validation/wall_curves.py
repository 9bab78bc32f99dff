"""Capacity curves of the measured walls with all inputs, beside what was measured, and the section that shows them.

    python -m validation.wall_curves --store FILE --walls 189 190

keeps a curve a line; a run that was cut off goes on. Without ``--walls`` it is all walls with complete inputs, those
whose response is given first, the cheapest of every campaign, then the second of each. ``--by dem`` drives a dozen of
them by the distinct element method. The record is written beside this file. ``--page docs/measured-walls.md`` then
makes the sections of the page and the figure, without ``--store`` from the record.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.comparison.wall_curves import (
    FURTHEST,
    LEFT_OVER,
    POINTS,
    TRIES,
    UNITS,
    WallCurve,
    coarseness,
    wall_curve,
)
from limitmason.comparison.wall_ladder import DOZEN
from limitmason.errors import InputError
from limitmason.experiments import registry
from limitmason.experiments.modern_walls import MODELS, NAME, units_per_course
from limitmason.experiments.modern_walls.inputs import complete
from limitmason.experiments.source_folder import read_table
from limitmason.storage.csv_table import parsed, write_table
from limitmason.study.memo import Memo
from validation.kept_runs import with_section
from validation.wall_curves_text import sections
from validation.wall_figures import envelopes
from validation.wall_loop import first_mode
from validation.wall_tests import measured_walls

Array = NDArray[np.float64]
RECORDS: Mapping[str, tuple[Path, Path]] = {
    by: (Path(__file__).with_name(f"{name}.csv"), Path(__file__).with_name(f"{name}_ends.csv"))
    for by, name in (("pushover", "wall_curves"), ("dem", "wall_pushes"))
}
"""Samples and ends of the curves of a method."""
WALLS = {r["specimen"]: r for r in read_table(NAME, "walls.csv").rows}

PER_SAMPLE: Mapping[str, str] = {
    "drift": "%", "force": "kN", "slid": "-", "slips": "-", "apart": "-", "past": "-", "cracked": "-",
}
PER_WALL = "coarse", "points", "steps", "iterations", "rate", "seconds", "status"
NUMBER = 12  # walls that the DEM drives


def computed_curve(wall: str, by: str = "pushover") -> dict[str, Any]:
    """The curve of a wall, as a row of a store."""
    return asdict(wall_curve(registry.load(NAME, wall, **MODELS[by]), by=by))


def blocks_followed(wall: str) -> float:
    """Units of the wall that is followed."""
    units = units_per_course(WALLS[wall])[0] * int(WALLS[wall]["courses"])
    return units / coarseness(registry.load(NAME, wall)) ** 2


def order() -> list[str]:
    """Walls with all inputs: those with a response first, the cheapest of every campaign, the second of each, ..."""
    rows = sorted((r for r in WALLS.values() if complete(r)), key=lambda r: blocks_followed(r["specimen"]))
    taken: Counter[str] = Counter()
    turns = {}
    for r in rows:
        taken[r["campaign"]] += 1
        turns[r["specimen"]] = r["responses"] != "given", taken[r["campaign"]], blocks_followed(r["specimen"])
    return sorted(turns, key=turns.__getitem__)


def dozen() -> list[str]:
    """Walls for the DEM: by number of units, one whose campaign and first printed mode no smaller one has."""
    whole = [m for m in measured_walls() if complete(WALLS[m.wall])]
    by_size = sorted(whole, key=lambda m: units_per_course(WALLS[m.wall])[0] * int(WALLS[m.wall]["courses"]))
    first: dict[tuple[str, str], str] = {}
    for m in by_size:
        first.setdefault((m.campaign, first_mode(m.mode)), m.wall)
    return list(first.values())[:NUMBER]


def computed(store: Path, names: Sequence[str], workers: int = 1, by: str = "pushover") -> dict[str, WallCurve]:
    """Compute what a store lacks of some walls; all curves in it."""
    unknown = [n for n in names if n not in WALLS]
    if unknown:
        raise InputError(f"no wall {unknown[0]!r} in {NAME}")
    memo = Memo(store, kind=dict)
    of = by, tuple(sorted(MODELS[by].items())), POINTS, TRIES, LEFT_OVER, FURTHEST, UNITS
    jobs = {(name, of): {"wall": name, "by": by} for name in names}
    missing, begun = sum(key not in memo for key in jobs), time.perf_counter()
    for done, (key, row) in enumerate(memo.map(computed_curve, jobs, workers=workers), 1):
        left = (time.perf_counter() - begun) / done * (missing - done)
        said = f"{row['status']}, {row['seconds']:.0f} s; {left:.0f} s left"
        print(f"[{done}/{missing}] wall {key[0]}: {said}", flush=True)
    return {name: WallCurve(**memo[name, of]) for name in order() if (name, of) in memo}


def write_record(curves: Iterable[WallCurve], by: str = "pushover") -> None:
    """Keep curves beside this file: every sample, and how each ended."""
    samples_file, ends_file = RECORDS[by]
    kept = sorted(curves, key=lambda c: int(c.wall))
    rows = [
        [c.wall, *(f"{v:.5g}" for v in sample)]
        for c in kept for sample in zip(*(getattr(c, k) for k in PER_SAMPLE), strict=True)
    ]
    note = f"Curves of walls of modern-walls by limitmason.comparison.wall_curves, {by}, every sample."
    write_table(samples_file, {"wall": "-", **PER_SAMPLE}, rows, note)
    units = {"wall": "-", **dict.fromkeys(PER_WALL, "-"), "seconds": "s"}
    ends = [
        [c.wall, c.coarse, c.points, c.steps, c.iterations, f"{c.rate:.3g}", f"{c.seconds:.1f}", c.status] for c in kept
    ]
    write_table(ends_file, units, ends, "What those curves took [s of processor time], and how they ended.")


def read_record(by: str = "pushover") -> dict[str, WallCurve]:
    """The curves that are kept beside this file, by wall."""
    table, ends = (parsed(p.read_text(encoding="utf-8"), p.name) for p in RECORDS[by])
    samples: dict[str, list[list[float]]] = {}
    for wall, *cells in table.rows:
        samples.setdefault(wall, []).append([float(v) for v in cells])
    found = {}
    for wall, coarse, points, steps, iterations, rate, seconds, status in ends.rows:
        columns = [list(c) for c in zip(*samples.get(wall, []), strict=True)] or [[] for _ in PER_SAMPLE]
        found[wall] = WallCurve(
            wall=wall, **dict(zip(PER_SAMPLE, columns, strict=True)), coarse=int(coarse), points=int(points),
            steps=int(steps), iterations=int(iterations), status=status, warnings=[], seconds=float(seconds),
            rate=float(rate),
        )
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute what is missing, and write the sections."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--store", type=Path, help="file that keeps curves as they come")
    parser.add_argument("--walls", nargs="*", help="their numbers; all with complete inputs where left out")
    parser.add_argument("--page", type=Path, help="page whose sections are made, with its figure beside it")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--by", choices=sorted(RECORDS), default="pushover", help="dem: the walls of a dozen")
    o = parser.parse_args(arguments)
    if o.store is None and (o.walls or not o.page):
        parser.error("--store FILE keeps the curves that are to be computed")
    if o.store is not None:
        usual = list(DOZEN) if o.by == "dem" else order()
        write_record(computed(o.store, o.walls or usual, o.workers, o.by).values(), o.by)
    if o.page is not None:
        curves, text = read_record(), o.page.read_text(encoding="utf-8")
        for part in sections(curves, read_record("dem")):
            text = with_section(text, part.splitlines())
        o.page.write_text(text, encoding="utf-8")
        envelopes(curves, o.page.with_name("measured-walls-envelopes.png"))


if __name__ == "__main__":
    main()
