"""Random brick panels beside the paper: runs, the lines kept of them, and the page.

    python -m validation.stochastic --out docs/papers                       the page from the lines that are kept
    python -m validation.stochastic --store FOLDER --out docs/papers        folds in what the folder holds
    python -m validation.stochastic --store FOLDER --runs 300 --workers 2   makes what is missing, then folds it in
    python -m validation.stochastic --readings FOLDER --make                the same of the two readings; hours

Every run is a line in a file of the folder: a killed study goes on with it, and no run is made twice.
"""

import argparse
from pathlib import Path

from . import page, readings, readings_page, rows, study, tables
from .runs import PANEL


def main() -> None:
    """Run, fold in, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--store", type=Path, default=None, help="folder of the runs")
    parser.add_argument("--runs", type=int, default=0, help="runs a cell to make before; none by default")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=None, help="folder of stochastic.md and stochastic.png")
    parser.add_argument("--readings", type=Path, default=None, help="folder of the runs of the two readings")
    parser.add_argument("--make", action="store_true", help="make the runs of the readings that are missing")
    chosen = parser.parse_args()
    if chosen.make and chosen.readings is None:
        parser.error("--make needs --readings, where they are kept")
    if chosen.make:
        readings.compute(chosen.readings, print)
    if chosen.readings is not None:
        readings_page.fold(chosen.readings)
    if chosen.runs and chosen.store is None:
        parser.error("--runs needs --store, where they are kept")
    if chosen.runs:
        study.compute(chosen.runs, chosen.store, print, chosen.workers)
    kept = rows.read()
    if chosen.store is not None:
        kept = rows.folded(kept, rows.from_stores(chosen.store, PANEL.assembly()))
        rows.write(kept)
    if chosen.out is not None:
        chosen.out.mkdir(parents=True, exist_ok=True)
        tables.figure(kept).savefig(chosen.out / "stochastic.png", dpi=130)
        readings_page.fans().savefig(chosen.out / "stochastic-fans.png")
        (chosen.out / "stochastic.md").write_text(page.page(kept), encoding="utf-8")


if __name__ == "__main__":
    main()
