"""Command of the trials of earned names: ``python -m validation.blind.earned --scale 1 --records earned.jsonl``.

Makes the data sets that the records do not hold yet and writes the table beside what is asked into `report.md`, between
its markers. ``python -m validation.blind.campaign_store`` makes the multipliers they rest on.
"""

import argparse
import sys
import time
from pathlib import Path

from limitmason.study import Memo, fingerprint

from . import earned_report, earned_trials, report_parts
from .campaign_store import DEM, LIMIT

SEED = 20261618  # fixed before the run; the floor of the margin was set on 265 data sets of seed 20261616
MOST = 1000  # data sets of a cell, so that every one has a number of its own
# class: data sets on each of the campaigns
PLAN = {
    "missing, of the list": 200, "missing, never listed": 200, "outsiders": 200, "clear": 300, "near a rival": 200,
    "near the baseline": 200, "two listed": 200, "listed and outside": 200, "nothing": 340,
}
SHARED = ("batch", "day", "setup")
HOW = ((200, {}), (200, {"recorded": False}), (40, {"carried": False}))
UNTOLD = (("near the baseline", 70), ("clear", 70))  # independent noise, and the batches not recorded: what that costs


def cells():
    """Class, campaign, part of the seed, data sets and options of every cell."""
    for i, (kind, count) in enumerate(PLAN.items()):
        for j, design in enumerate(earned_trials.DESIGNS):
            yield kind, design, (i, j), count, {}
    for i, column in enumerate(SHARED):
        for j, design in enumerate(earned_trials.DESIGNS):
            for k, (count, how) in enumerate(HOW):
                yield "nothing", design, (20 + i, j, k), count, {"column": column, **how}
    for i, (kind, count) in enumerate(UNTOLD):
        for j, design in enumerate(earned_trials.DESIGNS):
            yield kind, design, (40 + i, j), count, {"untold": "batch"}
    for i, (kind, count) in enumerate({"nothing": 300, "outsiders": 200}.items()):
        yield kind, "12", (30 + i,), count, {"code": DEM}


def jobs(scale):
    """Data sets in turns, so that a run that is stopped holds the same share of every class: (number, class, ...)."""
    todo = []
    for cell, (kind, design, key, count, options) in enumerate(cells()):
        total = max(2, round(scale * count))
        for k in range(total):
            todo.append(((k + 0.5) / total, MOST * cell + k, kind, design, [SEED, *key, k], options))
    return [job[1:] for job in sorted(todo, key=lambda t: t[:2])]


def label_of(kind, options):
    """The class of a record in the report."""
    if options.get("code", LIMIT) == DEM:
        return f"{kind}, truth by the DEM"
    if "untold" in options:
        return f"{kind}, {options['untold']} not recorded"
    if "column" in options:
        how = "not recorded" if not options.get("recorded", True) else (
            "recorded" if options.get("carried", True) else "recorded, not carried"
        )
        return f"nothing, noise shared within {options['column']}, {how}"
    return kind


def run(path, scale, seconds):
    """Make the data sets that the store does not hold, within some seconds; what it then holds of those asked for."""
    memo = Memo(path, fingerprint("earned names", SEED, earned_trials.DRAWS, earned_trials.RULE), kind=dict)
    start, todo = time.process_time(), jobs(scale)
    for n, (number, kind, design, seed, options) in enumerate(todo):
        if number in memo or time.process_time() - start > seconds:
            continue
        begin, found = time.process_time(), earned_trials.one(design, kind, seed, **options)
        record = None if found is None else {**found, "class": label_of(kind, options)}
        memo.keep(number, {"record": record, "seconds": time.process_time() - begin})
        sys.stderr.write(f"\r{n + 1} of {len(todo)}  {label_of(kind, options):<60}")
    sys.stderr.write("\n")
    return [memo[job[0]] for job in todo if job[0] in memo]


def main(arguments=None):
    """Run the trials and write their part of the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=float, default=1.0, help="multiplies the number of trials")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="processor seconds after which it stops")
    parser.add_argument("--records", type=Path, default=Path("earned.jsonl"), help="kept there; a run goes on")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("report.md"))
    given = parser.parse_args(arguments)
    rows = run(given.records, given.scale, given.seconds)
    records = [r["record"] for r in rows if r["record"] is not None]
    spent = sum(r["seconds"] for r in rows)
    report_parts.put(given.out, earned_report.text(records, SEED, spent), earned_report.BEGIN, earned_report.END)


if __name__ == "__main__":
    main()
