"""Blind trials across two codes: truth in the DEM and candidates in limit analysis, and the reverse.

The diagnosing code sees values only. The null comes first: one code without any effect, measured with noise, diagnosed
with the other. The difference of the codes is declared as a method error on top of the noise. The command is
``two_codes.py``.
"""

import csv
import functools
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import zip_longest

import numpy as np

from limitmason.diagnosis import Noise, Study
from limitmason.diagnosis.inference.next_tests import distances

from . import hide, score, small_walls, surrogate
from .small_walls import CAUSES, DEM, LIMIT, SPECIMENS, STORE, Simulator
from .trials import SET, Record

NOISE = surrogate.NOISE
SLOW = {"levels": 5, "nuisance_levels": 3, "crossed": "corners", "pair_tables": "additive"}
# friction of the truth in standard deviations: drawn from three values with the mean and variance of the normal one
FRICTIONS, CHANCES = (-2.0, 0.0, 2.0), (0.125, 0.75, 0.125)
CANDIDATES = {DEM: LIMIT, LIMIT: DEM}  # by the code of the truth
PLAN = {"null": 300, "clear": 150, "middle": 150}
STRESS = ((0.01, True), (0.005, True), (0.005, False))  # noise of more nulls, and whether the method error is declared
PORTION = 10
SPOKEN = {
    DEM: "truth in the DEM, candidates in limit analysis",
    LIMIT: "truth in limit analysis, candidates in the DEM",
}
PLANTED = (hide.RANGES["middle"][0], hide.FAR)


def make(store=STORE):
    """Compute what is not stored yet: tables of both codes, and truths at the frictions they are drawn with."""
    values = small_walls.read(store)
    fresh = not store.exists()
    with store.open("a", encoding="utf-8", newline="") as lines:
        out = csv.writer(lines, lineterminator="\n")
        if fresh:
            lines.write(_provenance())
            out.writerows([small_walls.HEAD, small_walls.UNITS])

        def append(name, value):
            out.writerow([*name, f"{value:.9g}"])
            lines.flush()
            sys.stderr.write(f"\r{len(values)} values, {name[0]} {name[1]}, {name[2]} {name[3]}        ")

        both = {code: Simulator(code, values, append) for code in (LIMIT, DEM)}
        sizes = planted_sizes(both[LIMIT])
        for z in FRICTIONS:
            both[LIMIT].predict(z=z)
            both[DEM].predict(z=z)
        study(both[DEM]).design(CAUSES)
        # one size of each cause, then another of each: a store that is not finished serves for what it holds
        turns = [(name, size) for row in zip_longest(*sizes.values()) for name, size in zip(sizes, row, strict=True)]
        for name, size in turns:
            for z in sorted(FRICTIONS, key=abs) if size is not None else ():
                both[LIMIT].predict((name,), (size,), z)
                both[DEM].predict((name,), (size,), z)
    sys.stderr.write("\n")


def _provenance():
    used = ", ".join(f"{p} {version(p)}" for p in ("limitmason", "numpy", "numba", "clarabel"))
    limit, dem = (", ".join(f"{k}={v!r}" for k, v in small_walls.OPTIONS[c].items()) for c in (LIMIT, DEM))
    return (
        "# Collapse multipliers of small_walls.SPECIMENS, computed by python -m validation.blind.two_codes --make\n"
        f"# from {datetime.now(UTC).date()} on with {used}\n"
        f"# limit: limitmason.limit_analysis({limit}); dem: dem.collapse({dem}); all joints with psi = phi\n"
    )


def study(simulator):
    """The design with one code as the candidates, without measured values.

    Its tables are made for the noise of the trials: change it by ``replace(noise=...)``, or other sizes are asked for.
    """
    known = {"shared": (), **SLOW}
    return Study(SPECIMENS, simulator, None, Noise(NOISE), small_walls.NUISANCE, small_walls.COVARIATES, **known)


def planted_sizes(simulator):
    """Sizes per simulated cause that are planted: tabulated ones whose d2 to the nearest rival is worth a trial."""
    where = place(simulator)
    out = {}
    for cause in small_walls.SIMULATED:
        d2 = where.d2[cause.name]
        out[cause.name] = where.sizes[cause.name][(d2 >= PLANTED[0]) & (d2 < PLANTED[1])]
    return out


@dataclass(frozen=True)
class Place:
    """A design with one code as the candidates.

    Parameters
    ----------
    study : without measured values
    sizes, d2, seen : per cause the sizes that can be planted, their d2 to the nearest rival and to the baseline
    """

    study: Study
    sizes: dict
    d2: dict
    seen: dict


def place(simulator, noise=NOISE):
    """Distances on the design, by the candidates' own predictions.

    Parameters
    ----------
    noise : stated, method error included
    """
    blank = study(simulator).replace(noise=Noise(noise))
    design = blank.known_design(CAUSES)
    sizes, d2, seen = {}, {}, {}
    for cause in CAUSES:
        levels = blank.table(cause).levels[0]
        if cause.transforms:  # nothing to be stored: any size will do
            levels = np.linspace(*cause.bounds, 25)
        logs = np.log([simulator.predict((cause.name,), (x,)) for x in levels])
        curve = (logs - design.origin) / design.scale
        sizes[cause.name] = levels
        d2[cause.name] = np.min([distances(curve, g) for n, g in design.singles.items() if n != cause.name], axis=0)
        seen[cause.name] = distances(curve, design.null)
    return Place(blank, sizes, d2, seen)


@functools.lru_cache(maxsize=1)
def codes():
    """Both codes from the store, by name."""
    values = small_walls.read()
    return {code: Simulator(code, values) for code in (LIMIT, DEM)}


def difference(names=(), sizes=(), z=0.0):
    """log(DEM / limit analysis) per specimen."""
    both = codes()
    return np.log(both[DEM].predict(names, sizes, z)) - np.log(both[LIMIT].predict(names, sizes, z))


@functools.lru_cache(maxsize=1)
def method_error():
    """Root mean square of the difference without any cause, over specimens and frictions: what is declared."""
    return float(np.sqrt(np.mean([difference(z=z) ** 2 for z in FRICTIONS])))


@functools.lru_cache(maxsize=8)
def ready(code, noise=NOISE, declared=True):
    """The design with one code as the candidates, the method error declared or not."""
    return place(codes()[code], float(np.hypot(noise, method_error())) if declared else noise)


def hidden(truth_code, kind, seed, noise=NOISE):
    """One data set: values, which are all that the diagnosis sees, and the truth.

    Parameters
    ----------
    truth_code : "dem" or "limit"; the candidates are the other
    kind : "null", "clear" or "middle", by d2 of the candidates
    seed : integers
    noise : true relative noise
    """
    rng = np.random.default_rng(seed)
    truth, where = codes()[truth_code], ready(CANDIDATES[truth_code])
    z = float(rng.choice(FRICTIONS, p=CHANCES))
    names, sizes, d2, seen = (), (), float("nan"), float("nan")
    if kind != "null":
        options = choices(truth, where, kind)
        name = sorted(options)[int(rng.integers(len(options)))]
        row = int(rng.choice(options[name]))
        names, sizes = (name,), (float(where.sizes[name][row]),)
        d2, seen = float(where.d2[name][row]), float(where.seen[name][row])
    expected = np.array(truth.predict(names, sizes, z))
    values = expected * np.exp(noise * rng.standard_normal(len(expected)))
    return values, hide.Truth(kind, names, sizes, d2, seen, None, z, expected)


def choices(truth, where, kind):
    """Rows of the sizes of each cause that belong to a class and are stored for the truth."""
    low, high = hide.RANGES[kind]
    out = {}
    for cause in CAUSES:
        d2, sizes = where.d2[cause.name], where.sizes[cause.name]
        rows = np.flatnonzero((d2 >= low) & (d2 < high) & (where.seen[cause.name] >= low))
        rows = [int(r) for r in rows if truth.knows(cause, sizes[r], FRICTIONS)]
        if rows:
            out[cause.name] = rows
    return out


def run(record, truth_code, kind, seed, count, *, label=None, noise=NOISE, declared=True):
    """Hide and diagnose ``count`` times.

    Parameters
    ----------
    label : class in the record; None is ``kind``
    noise : true and stated
    declared : whether the method error is stated on top of it
    """
    where = ready(CANDIDATES[truth_code], noise, declared)
    for k in range(count):
        values, truth = hidden(truth_code, kind, [*seed, k], noise)
        diagnosis = where.study.replace(measured=values).diagnose(CAUSES, seed=k, rule=SET)
        result = score.outcome(*score.ours(diagnosis), truth=truth)
        record.sheet.add(label or kind, result)
        for name, broken in (("best fit", score.best_fit), ("abstain", score.abstain)):
            record.broken[name].add(label or kind, score.outcome(*broken(diagnosis), truth=truth))
        if truth.names and result not in ("named", "set with it"):
            record.missed.append((truth.names[0], truth.sizes[0], round(truth.d2, 1), result, diagnosis.causes))
        if result == "named":
            estimate, size = diagnosis.estimates[truth.names[0]], truth.sizes[0]
            baseline = next(c.baseline for c in CAUSES if c.name == truth.names[0])
            record.size_errors.append(abs(estimate.size - size) / abs(size - baseline))
            record.covered.append(estimate.low <= size <= estimate.high)


def jobs(seed, scale):
    """Portions of trials: code of the truth, class, seed, number, options."""
    out = []
    for i, code in enumerate((DEM, LIMIT)):
        plan = [(kind, n, {}) for kind, n in PLAN.items()]
        for noise, declared in STRESS:
            said = "declared" if declared else "not declared"
            label = f"null, noise {100 * noise:g} %, method error {said}"
            plan.append(("null", 100, {"noise": noise, "declared": declared, "label": label}))
        for j, (kind, n, options) in enumerate(plan):
            count = max(2, round(scale * n))
            for k, first in enumerate(range(0, count, PORTION)):
                out.append((code, kind, (seed, i, j, k), min(PORTION, count - first), options))
    return out


def work(job):
    """Run one portion."""
    code, kind, seed, count, options = job
    record = Record()
    run(record, code, kind, seed, count, **options)
    return code, record
