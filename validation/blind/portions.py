"""The full blind trial in portions that workers take: what is run, and how one portion is run."""

import functools
import time
from dataclasses import dataclass

from limitmason.diagnosis import Noise

from . import hide, surrogate, trials

ALL = ("12", "24", "24 alike", "40")
PORTION = 15  # trials a worker does at a time
BARE = tuple(c for c in surrogate.COVARIATES if c not in ("age", "operator"))


@dataclass(frozen=True)
class Job:
    """A portion of trials of one class on one design: what a worker does at a time."""

    title: str
    what: str
    design: str
    kind: str
    seed: tuple[int, ...]
    count: int
    options: tuple = ()


@functools.lru_cache(maxsize=12)
def _campaign(design, stated, bare):
    return hide.campaign(design, stated, BARE if bare else surrogate.COVARIATES)


def work(job, rule=None):
    """Run one portion; returns its record and its seconds."""
    options = dict(job.options)
    where = _campaign(job.design, options.pop("stated", None), options.pop("bare", False))
    begin, record = time.perf_counter(), trials.Record()
    if job.what == "run":
        trials.run(record, where, job.kind, job.seed, job.count, rule=rule, **options)
    elif job.what == "blunders":
        trials.blunders(record, where, job.seed, job.count)
    elif job.what == "crossed":
        trials.crossed(record, where, job.seed, job.count)
    else:
        trials.next_tests(record, where, job.kind, job.seed, job.count, options["label"])
    return record, time.perf_counter() - begin


def jobs(seed, scale, only=None):
    """All classes on all designs in portions of few trials, or some of the classes of single effects."""
    out = []

    def add(title, what, design, kind, key, n, **options):
        count = max(2, round(scale * n))
        for portion, first in enumerate(range(0, count, PORTION)):
            size = min(PORTION, count - first)
            out.append(Job(title, what, design, kind, (seed, *key, portion), size, tuple(options.items())))

    plan = {"null": 150, "clear": 60, "middle": 75, "twins": 75, "unlisted": 30, "unlisted weak": 25, "scatter": 60}
    for kind, n in plan.items():
        if only and kind not in only:
            continue
        number = list(hide.CLASSES).index(kind)
        for i, name in enumerate(ALL):
            add(kind, "run", name, kind, (i, number), n)
    if only:
        return out
    for i, name in enumerate(("24", "40")):
        add("pair", "run", name, "pair", (i, 7), 50)
    for i, name in enumerate(ALL):
        for j, sd in enumerate((0.05, 0.03)):
            label = f"null, noise {100 * sd:.0f} % against 4 % stated"
            add("wrong noise", "run", name, "null", (i, 8, j), 50, noise=sd, label=label)
    for number, (text, noise) in enumerate((("unknown", Noise()), ("8 dof", Noise(0.04, 8))), start=9):
        for i, name in enumerate(("12", "24")):
            for j, kind in enumerate(("null", "clear")):
                add(f"noise {text}", "run", name, kind, (i, number, j), 60, stated=noise, label=f"{kind}, noise {text}")
    for i, name in enumerate(("12", "24", "40")):
        add("not recorded", "run", name, "unlisted", (i, 11), 25, bare=True, label="unlisted, not recorded")
        add("blunders", "blunders", name, "null", (i, 12), 30)
    for i, name in enumerate(("24", "40")):
        add("other code", "crossed", name, "", (i, 13), 50, stated=trials.CROSS)
    for i, (name, kind) in enumerate((("12", "twins"), ("24 alike", "twins"), ("12", "middle"))):
        add("next tests", "next tests", name, kind, (i, 14), 20, label="plain")
        add("next tests", "next tests", name, kind, (i, 15), 12, label="rich")
    return out
