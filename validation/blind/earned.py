"""Command of the trials of earned names: ``python -m validation.blind.earned --scale 1 --records earned.jsonl``.

Runs what the records do not hold yet and writes the table beside what is asked into `report.md`, between its markers.
``python -m validation.blind.campaign_store`` makes the multipliers they rest on.
"""

import argparse
import json
import sys
import time
from pathlib import Path

from . import earned_report, earned_trials
from .campaign_store import DEM, LIMIT

SEED = 20261617  # fixed before the run; the floor of the margin was set on 265 data sets of seed 20261616
PORTION = 5
# class: data sets on each of the campaigns
PLAN = {
    "missing, of the list": 200, "missing, never listed": 100, "outsiders": 200, "clear": 200, "near a rival": 200,
    "near the baseline": 200, "two listed": 200, "listed and outside": 200, "nothing": 340,
}  # fmt: skip
SHARED = (("batch", 70), ("day", 70), ("setup", 70))


def jobs(scale):
    """Portions of trials in turns, so that a run that is stopped holds some of every class: (seed, arguments)."""
    todo = []

    def add(kind, design, count, key, **options):
        count = max(2, round(scale * count))
        for k in range(0, count, PORTION):
            todo.append((k, (kind, design, key, min(PORTION, count - k), options)))

    for i, (kind, count) in enumerate(PLAN.items()):
        for j, design in enumerate(earned_trials.DESIGNS):
            add(kind, design, count, (i, j))
    for i, (column, count) in enumerate(SHARED):
        for j, design in enumerate(earned_trials.DESIGNS):
            for k, how in enumerate(({}, {"recorded": False}, {"carried": False})):
                add("nothing", design, count, (20 + i, j, k), column=column, **how)
    for i, (kind, count) in enumerate({"nothing": 300, "outsiders": 200}.items()):
        add(kind, "12", count, (30 + i,), code=DEM)
    return [(k, *rest) for k, rest in sorted(todo, key=lambda t: t[0])]


def label_of(kind, options):
    """The class of a record in the report."""
    if options.get("code", LIMIT) == DEM:
        return f"{kind}, truth by the DEM"
    if "column" in options:
        how = "not recorded" if not options.get("recorded", True) else (
            "recorded" if options.get("carried", True) else "recorded, not carried"
        )  # fmt: skip
        return f"nothing, noise shared within {options['column']}, {how}"
    return kind


def run(path, scale, seconds):
    """Run the portions that the records do not hold, within some seconds; returns all records."""
    done = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            portion = json.loads(line)
            done[tuple(portion["key"])] = portion
    start, todo = time.process_time(), jobs(scale)
    with path.open("a", encoding="utf-8") as out:
        for n, (first, kind, design, key, count, options) in enumerate(todo):
            name = (*key, first, count)
            if name in done or time.process_time() - start > seconds:
                continue
            begin, records = time.process_time(), []
            for k in range(first, first + count):
                found = earned_trials.one(design, kind, [SEED, *key, k], **options)
                if found is not None:
                    records.append({**found, "class": label_of(kind, options)})
            done[name] = {"key": name, "records": records, "seconds": time.process_time() - begin}
            out.write(json.dumps(done[name], default=float) + "\n")
            out.flush()
            sys.stderr.write(f"\r{n + 1} of {len(todo)}  {label_of(kind, options):<60}")
    sys.stderr.write("\n")
    return list(done.values())


def main(arguments=None):
    """Run the trials and write their part of the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=float, default=1.0, help="multiplies the number of trials")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="processor seconds after which it stops")
    parser.add_argument("--records", type=Path, default=Path("earned.jsonl"), help="kept there; a run goes on")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("report.md"))
    given = parser.parse_args(arguments)
    portions = run(given.records, given.scale, given.seconds)
    records = [r for p in portions for r in p["records"]]
    spent = sum(p["seconds"] for p in portions)
    earned_report.put(given.out, earned_report.text(records, SEED, spent))


if __name__ == "__main__":
    main()
