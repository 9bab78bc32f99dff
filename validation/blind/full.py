"""The full blind trial: ``python -m validation.blind.full --seed 20261121 --scale 1 --out validation/blind/report.md``.

Writes confusion matrices by class with 95 % binomial (Clopper-Pearson) intervals, the acceptance table, and the same
table for two broken rules. From the root of the source tree; about a quarter of an hour on one core.
"""

import argparse
import sys
import time
from collections import Counter
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from limitmason.diagnosis import Rule, binomial_interval

from . import report_parts, score, surrogate, trials
from .portions import ALL, jobs, work

BEGIN, END = "<!-- all trials: begin -->", "<!-- all trials: end -->"
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
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--rule", nargs="*", default=[], help="other thresholds, for example gain=0.04")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("report.md"))
    given = parser.parse_args(arguments)
    start = time.perf_counter()
    kinds = {f.name: type(f.default) for f in fields(Rule)}
    changed = {k: kinds[k](v) for k, v in (r.split("=") for r in given.rule)}
    record, notes = trial_all(given.seed, given.scale, given.only, given.workers, Rule(identify=False, **changed))
    text = report(record, notes, given.seed, time.perf_counter() - start, given.workers, given.rule)
    report_parts.put(given.out, f"{BEGIN}\n{text}{END}\n", BEGIN, END)
    sys.stdout.write(text)


def trial_all(seed, scale, only=None, workers=1, rule=None):
    """Record of all trials and notes on their time; the same trials whatever the number of workers."""
    todo = jobs(seed, scale, only)
    record, seconds, counts = trials.Record(), Counter(), Counter()
    answers = Parallel(n_jobs=workers, return_as="generator")(delayed(work)(job, rule) for job in todo)
    for done, (job, (more, spent)) in enumerate(zip(todo, answers, strict=True), start=1):
        record.add(more)
        seconds[job.title] += spent
        counts[job.title] += job.count
        sys.stderr.write(f"\r{done} of {len(todo)}  {job.title:<20}")
    sys.stderr.write("\n")
    return record, [f"{title}: {spent / counts[title]:.2f} s a trial" for title, spent in seconds.items()]


def report(record, notes, seed, seconds, workers, changed):
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
        f"{datetime.now(UTC).date()}, seed {seed}, {seconds:.0f} s with {workers} "
        f"worker{'s' * (workers > 1)}. "
        + (f"Thresholds changed: {', '.join(changed)}. " if changed else "")
        + "Surrogate: closed forms of dry-joint "
        f"masonry, {len(surrogate.CAUSES)} causes, designs {', '.join(ALL)}, noise {100 * surrogate.NOISE:.0f} %, "
        f"friction {surrogate.FRICTION} +- {surrogate.FRICTION_ERROR}. Written by `python -m validation.blind.full`.",
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
