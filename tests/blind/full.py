"""The full blind trial: ``python -m tests.blind.full --seed 20261121 --scale 1 --out tests/blind/report.md``.

Writes confusion matrices by class with 95 % binomial (Clopper-Pearson) intervals, the acceptance table, and the same
table for two broken rules. From the root of the source tree; about a quarter of an hour on one core.
"""

import argparse
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from limitmason.diagnosis import Noise, binomial_interval

from . import hide, score, surrogate, trials

ALL = ("12", "24", "24 alike", "40")
BARE = tuple(c for c in surrogate.COVARIATES if c not in ("age", "operator"))

DRAWN = (
    "- d2: distance to the nearest rival after refitting it and the friction. Clear 25 to 150, middle 9 to 25, twins "
    "below 1 (and above 30 from the baseline); a cause of the list is drawn first, then a size in that range. The "
    "middle class is also shown apart by d2 from the refitted baseline: near it an effect is missed, whatever the "
    "rivals.",
    "- unlisted: a line, a hump or a group effect along a recorded covariate (age, operator) on which no cause "
    "depends; 2.5 times the noise as root mean square over the specimens. Weak: 2.5 times the noise at its largest.",
    "- scatter: 1.5 to 2 times the stated noise.",
    "- pair: both seen alone (36), apart from each other (25), and d2 25 to 150 from the best single cause. It counts "
    "as found when the true pair is in the kept set, 'pair alone' when it is the only one; one of the two named "
    "alone is wrong.",
    f"- other code: truth by quadrature (`other.py`), method error {100 * trials.CROSS_ERROR:.1f} % declared on top of "
    "the noise.",
    "- next test: sets that hold the truth, four specimens added, the truth named alone afterwards. Plain pool: "
    "mostly more of the walls already tested, a few of every other set-up. Rich pool: every set-up beyond the range "
    "of the campaign, so that four random specimens tell a lot as well.",
)


def main(arguments=None):
    """Run the trials and write the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument("--scale", type=float, default=1.0, help="multiplies the number of trials")
    parser.add_argument("--only", nargs="*", help="classes of single effects to run, and nothing else")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("report.md"))
    given = parser.parse_args(arguments)
    start = time.perf_counter()
    record, notes = trial_all(given.seed, given.scale, given.only)
    text = report(record, notes, given.seed, time.perf_counter() - start)
    given.out.write_text(text, encoding="utf-8")
    sys.stdout.write(text)


def trial_all(seed, scale, only=None):
    """All classes on all designs, or some of the classes of single effects."""

    def many(n):
        return max(2, round(scale * n))

    record, notes = trials.Record(), []

    def timed(name, begin, count):
        notes.append(f"{name}: {(time.perf_counter() - begin) / max(count, 1):.2f} s a trial")
        sys.stderr.write(f"{name} {time.perf_counter() - begin:.0f} s\n")

    places = {name: hide.campaign(name) for name in ALL}
    plan = {"null": 150, "clear": 60, "middle": 75, "twins": 75, "unlisted": 30, "unlisted weak": 25, "scatter": 60}
    for kind, n in plan.items():
        if only and kind not in only:
            continue
        begin, number = time.perf_counter(), list(hide.CLASSES).index(kind)
        for i, where in enumerate(places.values()):
            trials.run(record, where, kind, [seed, i, number], many(n))
        timed(kind, begin, record.sheet.trials(kind))
    if only:
        return record, notes
    begin = time.perf_counter()
    for i, name in enumerate(("24", "40")):
        trials.run(record, places[name], "pair", [seed, i, 7], many(50))
    timed("pair", begin, record.sheet.trials("pair"))
    begin = time.perf_counter()
    for i, where in enumerate(places.values()):
        for sd in (0.05, 0.03):
            label = f"null, noise {100 * sd:.0f} % against 4 % stated"
            trials.run(record, where, "null", [seed, i, 8], many(50), noise=sd, label=label)
    timed("wrong noise", begin, many(50) * 8)
    for number, (text, noise) in enumerate((("unknown", Noise()), ("8 dof", Noise(0.04, 8))), start=9):
        begin = time.perf_counter()
        for i, name in enumerate(("12", "24")):
            where = hide.campaign(name, noise)
            for kind in ("null", "clear"):
                trials.run(record, where, kind, [seed, i, number], many(60), label=f"{kind}, noise {text}")
        timed(f"noise {text}", begin, many(60) * 4)
    begin = time.perf_counter()
    for i, name in enumerate(("12", "24", "40")):
        where = hide.campaign(name, covariates=BARE)
        trials.run(record, where, "unlisted", [seed, i, 11], many(25), label="unlisted, not recorded")
        trials.blunders(record, places[name], [seed, i, 12], many(30))
    timed("not recorded, blunders", begin, many(25) * 3 + many(30) * 3)
    begin = time.perf_counter()
    for i, name in enumerate(("24", "40")):
        trials.crossed(record, hide.campaign(name, trials.CROSS), [seed, i, 13], many(50))
    timed("other code", begin, many(50) * 6)
    begin = time.perf_counter()
    for i, (name, kind) in enumerate((("12", "twins"), ("24 alike", "twins"), ("12", "middle"))):
        trials.next_tests(record, places[name], kind, [seed, i, 14], many(20), "plain")
        trials.next_tests(record, places[name], kind, [seed, i, 15], many(12), "rich")
    timed("next tests", begin, sum(map(len, record.resolved.values())))
    return record, notes


def report(record, notes, seed, seconds):
    """The report as markdown."""

    def share(hits, bound, text):
        k, n = int(np.sum(hits)), len(hits)
        if not n:
            return f"| {text} | not run | | 0 | |"
        low, high = binomial_interval(k, n)
        rate = k / n if n else float("nan")
        return f"| {text} | {100 * rate:.1f} % | {100 * low:.1f} to {100 * high:.1f} % | {n} | {bound(rate)} |"

    def verdict(holds):
        return "holds" if holds else "**falls short**"

    lines = [
        "# Blind trials of the diagnosis",
        "",
        f"{datetime.now(UTC).date()}, seed {seed}, {seconds:.0f} s on one core. Surrogate: closed forms of dry-joint "
        f"masonry, {len(surrogate.CAUSES)} causes, designs {', '.join(ALL)}, noise {100 * surrogate.NOISE:.0f} %, "
        f"friction {surrogate.FRICTION} +- {surrogate.FRICTION_ERROR}. Written by `python -m tests.blind.full`.",
        "",
        "## Acceptance",
        "",
        "| class | required | measured | 95 % interval | trials | |",
        "|---|---|---|---|---|---|",
    ]
    for label, text, rate, low, high, holds in score.requirements(record.sheet):
        n = record.sheet.trials(label)
        lines.append(
            f"| {label} | {text} | {100 * rate:.1f} % | {100 * low:.1f} to {100 * high:.1f} % | {n} "
            f"| {verdict(holds)} |"
        )
    lines.append("| gain " + share(record.gain_signs, lambda r: verdict(r >= 0.95), "signs agree >= 95 %"))
    median = float(np.median(record.size_errors)) if record.size_errors else float("nan")
    lines.append(
        f"| size of a named cause | median error <= 15 % | {100 * median:.1f} % | | {len(record.size_errors)} | "
        f"{verdict(median <= 0.15)} |"
    )
    for label, pairs in record.resolved.items():
        suggested, random = np.array(pairs).sum(axis=0)
        holds = verdict(suggested >= 2 * random and suggested > 0)
        lines.append(
            f"| next test, {label} pool | four suggested resolve at least twice as many sets as four random ones | "
            f"{suggested} against {random} | | {len(pairs)} | {holds} |"
        )
    lines += [
        "",
        "Also: " + share(record.covered, lambda r: "", "95 % interval of a named size holds the truth").strip("| "),
        "",
        "Also: " + share(record.flagged, lambda r: "", "an alarm by a blunder is said to hang on it").strip("| "),
        "",
        "## Counts by class",
        "",
        record.sheet.text(),
        "",
        "## Teeth: the same trials judged by broken rules",
        "",
    ]
    for name, sheet in record.broken.items():
        failed = [f"{a}: {b}" for a, b, *_, holds in score.requirements(sheet) if not holds]
        lines += [f"- {name}: fails {len(failed)} of {len(score.requirements(sheet))} ({'; '.join(failed)})"]
    lines += [
        "",
        "## How the classes are drawn",
        "",
        *DRAWN,
        "",
        "## Time",
        "",
        *[f"- {note}" for note in notes],
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
