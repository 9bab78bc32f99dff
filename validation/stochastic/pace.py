"""How the time of the random panels grows with runs and workers: measured, kept in a file, shown on the page.

    python -m validation.stochastic.pace 12,24,48 1 2 dask2

Set 4, a draw for every joint. Processor time is that of this process and of all that it started; beside it the load of
the machine, which decides what the wall clock shows. ``dask2`` is a local dask cluster of two processes.
"""

import os
import sys
import time
from pathlib import Path
from typing import Any

import limitmason as lm
from limitmason import study
from limitmason.errors import InputError
from limitmason.storage.csv_table import parsed, write_table
from limitmason.study.table import Table

from .runs import PANEL, draws, push

STORED = Path(__file__).parents[2] / "examples" / "stored" / "stochastic_pace.csv"
UNITS = {"workers": "-", "runs": "-", "wall": "s", "processor": "s", "load": "-", "same": "-"}
"""``same``: 1 where the peaks equal those of the first way to the bit; ``load``: of the machine in the last minute."""


def spent() -> dict[int, float]:
    """Processor time of this process and of all below it [s], by process; from /proc, so on Linux alone."""
    tick, below, times = os.sysconf("SC_CLK_TCK"), {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                words = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # ended while we looked
                continue
            below.setdefault(int(words[1]), []).append(int(entry.name))
            times[int(entry.name)] = (int(words[11]) + int(words[12])) / tick
    out, todo = {}, [os.getpid()]
    while todo:
        pid = todo.pop()
        out[pid] = times[pid]
        todo += below.get(pid, [])
    return out


def timed(runs: int, **how: Any) -> tuple[float, float, Table]:
    """Wall and processor time [s] of so many runs, and their table."""
    before, clock = spent(), time.perf_counter()
    found = study.monte_carlo(
        (PANEL.assembly(), lm.Loads.weight), runs, run=push, seed=1, scheme="random", **how, **draws(4, True)
    )
    wall = time.perf_counter() - clock
    return wall, sum(t - before.get(p, 0.0) for p, t in spent().items()), found


def measure(sizes: list[int], ways: list[str]) -> list[list[object]]:
    """A line for every way and number of runs; compilation and the start of workers come before the clock.

    Raises
    ------
    InputError
        For a way that is neither a number of workers nor ``dask`` with one.
    """
    lines: list[list[object]] = []
    first: dict[int, list[float]] = {}
    for way in ways:
        count = way.removeprefix("dask")
        if not count.isdigit():
            raise InputError(f"a way is a number of workers, or dask and a number, got {way!r}")
        cluster = None
        if way != count:
            from dask.distributed import Client, LocalCluster

            cluster = LocalCluster(n_workers=int(count), threads_per_worker=1, dashboard_address=None)
            how: dict[str, Any] = {"executor": Client(cluster)}
        else:
            how = {"workers": int(count)}
        try:
            timed(4 * int(count), **how)
            for runs in sizes:
                wall, processor, found = timed(runs, **how)
                peaks = [float(r["ultimate"]) for r in found]
                same = first.setdefault(runs, peaks) == peaks
                lines.append([way, runs, f"{wall:.1f}", f"{processor:.1f}", f"{os.getloadavg()[0]:.1f}", int(same)])
        finally:
            if cluster is not None:
                how["executor"].close()
                cluster.close()
    return lines


def table(path: Path = STORED) -> list[list[str]]:
    """The kept lines as a table of the page."""
    kept = parsed(path.read_text(encoding="utf-8"), path.name)
    shown = [["workers", "runs", "processor [s]", "a run [s]", "wall [s]", "runs a minute", "load of the machine",
              "peaks to the bit"]]
    for cells in kept.rows:
        r = dict(zip(kept.header, cells, strict=True))
        runs, wall, processor = int(r["runs"]), float(r["wall"]), float(r["processor"])
        way = r["workers"] if r["workers"].isdigit() else f"dask, {r['workers'].removeprefix('dask')}"
        shown.append([
            way, f"{runs}", f"{processor:.0f}", f"{processor / runs:.2f}", f"{wall:.0f}", f"{60 * runs / wall:.0f}",
            r["load"], "the same" if r["same"] == "1" else "others",
        ])
    return shown


if __name__ == "__main__":
    write_table(STORED, UNITS, measure([int(n) for n in sys.argv[1].split(",")], sys.argv[2:]))
