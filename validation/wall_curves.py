"""Capacity curves of measured walls with joints that soften and units that crack, beside what was measured.

    python -m validation.wall_curves --store FILE --walls 189 190

keeps a curve a line; a run that was cut off goes on. At its end it prints the walls whose envelope was measured.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import limitmason as lm
from limitmason.capacity.steps import Steps
from limitmason.display.text_table import markdown
from limitmason.errors import NotApplicable, NotConverged
from limitmason.experiments.modern_walls import NAME, units_per_course
from limitmason.experiments.modern_walls.inputs import complete
from limitmason.experiments.tables import read_table
from limitmason.study.memo import Memo
from validation.wall_figures import drift_at

Array = NDArray[np.float64]

SOFTENS: Mapping[str, Any] = {"cracks": "diagonal strength", "energy_share": 1.0}
"""Options of the wall: every strength as printed, lost over assumed fracture energies. No number is fitted, but these
options were **chosen** among six after the curves of wall 189 had been seen beside its test."""

POINTS = 5  # contact points along a joint
TRIES = 3000  # of a step
FURTHEST = 0.004  # drift to which walls are pushed
WITHIN = 1.5  # factor that is asked of the drift at the peak


def curve_of(wall: str) -> dict[str, Any]:
    """Drift [%] and force [kN] of a wall pushed by its top, how it ended, and processor time [s]."""
    test = lm.experiments.load(NAME, wall, **SOFTENS)
    height, begun = float(test.row["H"]), time.process_time()
    row: dict[str, Any] = {"wall": wall, "drift": [], "force": []}
    try:
        curve = lm.pushover(
            test.assembly(), test.loads(), control=("beam", "x"), to=FURTHEST * height, contact_model="grid",
            grid=POINTS, steps=Steps(most=TRIES),
        )  # fmt: skip
        row |= {"drift": 100.0 * np.asarray(curve.displacement) / height, "force": np.asarray(curve.multiplier)}
        row["status"] = str(curve.status)
    except (NotApplicable, NotConverged) as refusal:
        row["status"] = str(refusal)
    return {**row, "seconds": time.process_time() - begun}


def curves_kept(store: Path | None) -> dict[str, dict[str, Any]]:
    """Curves in a store, by wall."""
    memo = Memo(store, kind=dict)
    return {str(row["wall"]): row for row in memo.rows.values()}


def peak_of(drift: Sequence[float] | Array, force: Sequence[float] | Array) -> tuple[float, float, float]:
    """Largest force, the drift there, and the share of it that is left at the end."""
    far, load = np.asarray(drift, dtype=float), np.asarray(force, dtype=float)
    k = int(load.argmax())
    return float(load[k]), float(far[k]), float(load[-1] / load[k])


def envelope_lines(curves: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """Rows of a table: peak, drift at the peak and what is left, computed and measured."""
    lines = [["wall", "largest force, computed over measured", "drift at the peak [%]", "ratio",
              "within 1.5", "ratio of the drifts at 0.7 of the peak", "left", "path"]]  # fmt: skip
    for name, row in curves.items():
        test = lm.experiments.load(NAME, name)
        measured = test.recipe.curve(test)
        most, at, _ = peak_of(measured.displacement, measured.load)
        force, drift, left = peak_of(row["drift"], row["force"])
        end = min(float(row["drift"][-1]), float(np.max(measured.displacement)))
        left = float(np.interp(end, row["drift"], row["force"])) / force
        theirs = float(np.interp(end, measured.displacement, measured.load)) / most
        ratio = drift / at
        rise = drift_at(0.7, np.asarray(row["drift"]), np.asarray(row["force"])) / drift_at(
            0.7, np.asarray(measured.displacement), np.asarray(measured.load)
        )
        lines.append([
            name, f"{force / most:.2f}", f"{drift:.3f}, measured {at:.3f}", f"{ratio:.2f}",
            "yes" if 1.0 / WITHIN <= ratio <= WITHIN else "no", f"{rise:.2f}", 
            f"{left:.2f}, measured {theirs:.2f} at {end:.2f} %", f"{row['status']}, {row['seconds']:.0f} s",
        ])  # fmt: skip
    return lines


def cheapest_first() -> list[str]:
    """Walls with all inputs, fewest blocks first."""
    rows = [r for r in read_table(NAME, "walls.csv").rows if complete(r)]
    return [r["specimen"] for r in sorted(rows, key=lambda r: units_per_course(r)[0] * int(r["courses"]))]


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute what is missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--walls", nargs="*", help="their numbers; all with complete inputs where left out")
    parser.add_argument("--workers", type=int, default=1)
    o = parser.parse_args(arguments)
    computed(o.store, o.walls or cheapest_first(), o.workers)
    measured = dict.fromkeys(r["specimen"] for r in read_table(NAME, "envelopes.csv").rows)
    kept = {wall: row for wall, row in curves_kept(o.store).items() if wall in measured and row["drift"]}
    print("\n".join(markdown(envelope_lines(kept))))


def computed(store: Path, names: Sequence[str], workers: int = 1) -> None:
    """Compute what a store lacks of some walls."""
    memo = Memo(store, kind=dict)
    jobs = {(name, tuple(SOFTENS.items()), POINTS, FURTHEST): {"wall": name} for name in names}
    missing, begun = sum(key not in memo for key in jobs), time.perf_counter()
    for done, (key, row) in enumerate(memo.map(curve_of, jobs, workers=workers), 1):
        left = (time.perf_counter() - begun) / done * (missing - done)
        said = f"{row['status']}, {row['seconds']:.0f} s; {left:.0f} s left"
        print(f"[{done}/{missing}] wall {key[0]}: {said}", flush=True)


if __name__ == "__main__":
    main()
