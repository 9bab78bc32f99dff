"""What is said of effects that no list holds: ``python -m validation.blind.places --sets 300 --out places.md``.

Two classes on the designs of ``kinds_designs.py``: effects built without the catalogue, and listed causes that are
taken off the list before the verdict. Is the place named, how often is a name wrong, and is the rate that the verdict
states the one that is found? Every data set has its own seed; what is in the records is not run again.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from limitmason.diagnosis.error_rates import binomial_interval
from limitmason.diagnosis.inference.next_tests import distances

from . import campaigns
from .kinds import SEED, SETS, found_words, outcome, stated
from .kinds_designs import CAUSES, VISIBLE, Trials

TIE = 1e-6  # relative: kinds that feel an effect alike, as a reading of all forces does, are either the right one
APART = 25.0  # d2 from every listed cause from which an effect ought to be told as unexplained
# what an effect goes with, where one recorded column is its own
OWN = {
    "drift with the order of tests": ("order",), "age": ("age",), "grows with the load": ("overload",),
    "friction in one direction": ("setup",), "instrument of one set-up": ("setup",), "shift of batch B": ("batch",),
}
DESIGNS = {"all recorded": campaigns.COVARIATES, "nothing recorded": ()}
CLASSES = ("an effect built without the catalogue", "a listed cause, taken off the list")


def plant(design, kind, k, rng):
    """Values, the name of what was planted, and the causes that are listed; None where it is not visible."""
    if kind == CLASSES[0]:
        values, name = design.off_the_list(k, rng)
        return values, name, CAUSES
    cause = CAUSES[k % len(CAUSES)]
    sizes = design.design.singles[cause.name].sizes[0]
    y = design.at_size(cause, rng.uniform(sizes[0], sizes[-1]))
    if distances(y, design.design.null)[0] < VISIBLE:
        return None
    return design.values(y), cause.name, tuple(c for c in CAUSES if c.name != cause.name)


def kinds_apart(design, values):
    """Mean square of the effect without noise, by kind of data."""
    y = design.design.whiten(values) - design.design.null.between(design.design.null.zero)
    kinds = np.array(design.study.rows.kinds)
    return {str(kind): float((y[kinds == kind] ** 2).mean()) for kind in np.unique(kinds)}


def judged(design, kind, k, seed):
    """The record of one data set, None where nothing visible was planted."""
    rng = np.random.default_rng([*seed, k])
    made = plant(design, kind, k, rng)
    if made is None:
        return None
    values, name, listed = made
    found = design.judged(values, rng, listed)
    y, apart = design.design.whiten(values), kinds_apart(design, values)
    return {
        "k": k, "planted": name, "said": outcome(found, None),
        "d2": design.seen(values), "apart": min(float(distances(y, design.design.singles[c.name])[0]) for c in listed),
        "kind": apart[max(found.by_kind, key=lambda e: e.misfit).kind] >= (1.0 - TIE) * max(apart.values()),
        "column": found.covariate in OWN.get(name, ()),
        "stated": stated(found),
    }


def share(count, of):
    """A share in per cent with its 90 % interval."""
    if not of:
        return "-"
    low, high = (100.0 * v for v in binomial_interval(count, of, level=0.9))
    return f"{100.0 * count / of:.1f} % [{low:.0f}, {high:.0f}]"


def row(name, kind, records):
    """A row of the page."""
    clear = [r for r in records if r["apart"] >= APART]
    unexplained = [r for r in clear if r["said"] == "unexplained"]
    placed = sum(r["kind"] or r["column"] for r in unexplained)
    wrong = sum(r["said"] == "identified wrongly" for r in records)
    rates = [r["stated"] for r in records if r["stated"] is not None]
    told = f"{100.0 * np.mean(rates):.1f} %" if rates else "-"
    alone = sum(r["said"] == "behaves like another" for r in records)
    sets = sum(r["said"] in SETS for r in records)
    return (
        f"| {name} | {kind} | {len(records)} | {share(wrong, len(records))} | {told} | {share(alone, len(records))} | "
        f"{share(sets, len(records))} | {len(clear)} | {share(len(unexplained), len(clear))} | "
        f"{share(placed, len(clear))} |"
    )


HEAD = (
    "| recorded | planted | sets | identified wrongly | stated | behaves like another | sets without it | clear | "
    "unexplained | with its place |\n|---|---|---|---|---|---|---|---|---|---|"
)
INTRODUCTION = """# Effects that are not on the list

**Where nothing is recorded, the place of clear effects is told in 92.4 % [88, 95], where all is in 97.9 % [95, 99]
(asked 85 %).** Names stay safe: 2 of 983 data sets give a wrong one, 0.20 % [0.04, 0.64]; the verdicts state 0.15 %.

Rules were set on seed 20261130. They were judged once, on seed 20261226, which stood on this page before the run. Rows
of fewer than 300 data sets are the first of them.

Specimens are the twelve of [kinds.md](kinds.md), with peak, stiffness and first frequency. "Stated" is the mean of the
rates that the verdicts state for a wrong name. "Clear" are data sets at least 25 in d2 from every listed cause. Their
place is told where the kind of data named as the worst is the worst without noise, or the column named is the effect's
own. Kinds that feel an effect alike are both the worst: a reading of all forces moves peak and stiffness by one factor.
Asked: identified wrongly at most 5 %; unexplained with its place at least 85 % of the clear ones; the stated rate
within a factor of 1.5 of the one found. Brackets hold 90 % intervals. `python -m validation.blind.places
--seed 20261226 --sets 300 --cache kept_tables.jsonl --records kept.jsonl --out places.md` makes the page.

What changed: where nothing is recorded, 28 % of the clear effects ended as more scatter. That is now held against
levers that differ from specimen to specimen. The count changed too: rounding decided between kinds that feel an effect
alike. By that count seed 20261130 gives 78 % where nothing is recorded, by this one 93 %. An ideal judge, who knows
every family of effects but no column, is right in 99.5 % of these 193 data sets.

"""


def page(rows):
    """The page of all records."""
    lines = [HEAD, *(row(name, kind, records) for (name, kind), records in rows.items() if records), ""]
    every = [r for records in rows.values() for r in records]
    by_name = {}
    for r in every:
        if r["apart"] >= APART:
            by_name.setdefault(r["planted"], []).append(r)
    lines += ["What is said of the clear data sets, by what was planted:", ""]
    for name, records in sorted(by_name.items()):
        placed = sum(r["said"] == "unexplained" and (r["kind"] or r["column"]) for r in records)
        lines.append(f"- {name} ({len(records)}): {found_words(records)}; unexplained with its place {placed}.")
    return "\n".join(lines) + "\n"


def main():
    """Run the trials and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=300)
    parser.add_argument("--cache", type=Path, default=None, help="predictions, kept from run to run")
    parser.add_argument("--records", type=Path, required=True, help="outcomes, kept from run to run")
    parser.add_argument("--seed", type=int, default=SEED, help="another for trials that thresholds are set on")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    kept, rows = {}, {}
    if given.records.exists():
        for line in given.records.read_text(encoding="utf-8").splitlines():
            record = json.loads(line)
            kept.setdefault((record.pop("recorded"), record.pop("class")), []).append(record)
    for i, (name, columns) in enumerate(DESIGNS.items()):
        design = None
        for j, kind in enumerate(CLASSES):
            records = rows[name, kind] = kept.get((name, kind), [])[: given.sets]
            k = records[-1]["k"] + 1 if records else 0
            while len(records) < given.sets and k < 10 * given.sets:
                design = design or Trials(columns, given.cache)
                record = judged(design, kind, k, [given.seed, 20 + i, j])
                k += 1
                if record is None:
                    continue
                records.append(record)
                with given.records.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps({"recorded": name, "class": kind, **record}) + "\n")
            given.out.write_text(INTRODUCTION + page(rows), encoding="utf-8")
            print(row(name, kind, records), flush=True)


if __name__ == "__main__":
    main()
