"""A diagnosis with the distinct element method as its simulator: 24 walls, 12 causes, stopped and resumed at will.

    python benchmarks/dem_diagnosis.py --workers 2 --cache dem_diagnosis.jsonl [--seed 1]

Twelve dry walls pushed in their plane and twelve out of it, friction measured to 0.03. One effect, its size, the true
friction and 4 % of noise are drawn from the seed; the DEM itself makes the measured values. Every call is kept in the
cache as it comes: kill the run and start it again with the same words, and it goes on.
"""

import argparse
import resource
import time
from pathlib import Path

import numpy as np
from joblib.externals.loky import get_reusable_executor

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.build import wall
from limitmason.diagnosis import Measured, Noise, Study
from limitmason.diagnosis.simulate import SLOW, collapse

UNIT = (0.20, 0.10)  # length and height of the blocks [m]
GRID = (4, 4)  # contact points along and across every joint: coarse
MOVED = 0.1  # displacement that counts as collapse, over the block height: soft joints move before they fall
NOISE, FRICTION = 0.04, Measured(0.65, 0.03)
DIRECTION = {"in plane": (1.0, 0.0, 0.0), "out of plane": (0.0, 1.0, 0.0)}


def build(specimen, friction_coefficient=FRICTION.value):
    """A wall on its slab, pushed by a share of its weight."""
    dry = lm.Joint.from_friction_coefficient(friction_coefficient, dilatancy_angle_deg=0.0)
    made = wall(length=specimen["length"], courses=specimen["courses"], unit=(*UNIT, specimen["thickness"]), joint=dry)
    return made, lm.Loads.horizontal(made, DIRECTION[specimen["direction"]])


def walls():
    """The specimens with their covariates."""
    shapes = {
        "in plane": [(length, courses, 0.10) for length in (0.4, 0.6, 0.8) for courses in (2, 3, 4, 6)],
        "out of plane": [(0.6, courses, t) for t in (0.08, 0.10, 0.14) for courses in (3, 4, 5, 7)],
    }
    return [
        {"direction": d, "length": length, "courses": n, "thickness": t, "height": n * UNIT[1]}
        for d, rows in shapes.items() for length, n, t in rows
    ]


def cpu_seconds():
    """Processor time of this process and of the workers that have ended."""
    used = [resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


if __name__ == "__main__":
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--workers", type=int, default=2)
    words.add_argument("--cache", type=Path, help="file that keeps every value; none by default")
    words.add_argument("--seed", type=int, default=1)
    given = words.parse_args()
    begun, specimens = time.perf_counter(), walls()
    causes = catalogue.standard(plane=False, method="dem", without=["finite compressive strength"])
    study = Study(
        specimens, collapse(build, "dem", contact_points=GRID, moved_limit=MOVED), noise=Noise(NOISE),
        nuisance={"friction_coefficient": FRICTION},
        covariates=["direction", "length", "courses", "thickness"], cache=given.cache, n_jobs=given.workers, **SLOW,
    )
    kept = len(given.cache.read_text(encoding="utf-8").splitlines()) if given.cache and given.cache.exists() else 0
    simulated = [c for c in causes if c.acts_on == "simulation"]
    print(f"{len(specimens)} specimens, {len(causes)} causes ({len(simulated)} of the simulation), contact grid {GRID}")
    print(f"{kept} values kept by earlier runs", flush=True)

    def progress(calls):
        if calls % 100 == 0:
            print(f"{calls} calls, {time.perf_counter() - begun:.0f} s", flush=True)

    study.simulator.progress = progress
    rng = np.random.default_rng(given.seed)
    truth = simulated[rng.integers(len(simulated))]
    side = truth.sides[rng.integers(len(truth.sides))]
    size = truth.baseline + rng.uniform(0.5, 0.9) * (side - truth.baseline)
    clean = study.predicted([truth], [size], [rng.standard_normal()])
    measured = clean * np.exp(NOISE * rng.standard_normal(len(specimens)))
    verdict = study.replace(measured=measured).diagnose(causes, seed=given.seed)
    seconds = time.perf_counter() - begun
    if given.workers > 1:
        get_reusable_executor().shutdown(wait=True)  # so that the processor time of the workers is known
    calls = study.simulator.calls
    print(verdict.report(checks=False))
    print(f"\nplanted: {truth.name} of {size:.3g} {truth.unit}; verdict: {verdict.kind}, {' or '.join(verdict.causes)}")
    print(f"{calls} calls in this run, {kept} values from the cache; {seconds:.0f} s elapsed, {cpu_seconds():.0f} s of "
          f"processor time" + (f", {cpu_seconds() / calls:.2f} s per call" if calls else ""))
