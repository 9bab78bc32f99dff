"""A tower of 11,526 blocks in an earthquake of 20 s: time, energies, drift and blocks lost.

    python benchmarks/tower.py STORE [--part 0.01] [--ring 20] [--courses 113] [--points 2 4] [--stiffness 1]
                                     [--step 1] [--moved 0] [--seed 0]

Own geometry of the kind of Di Giosaffatte et al. (2026), Procedia Structural Integrity 78, 1935-1942: a square tower of
three leaves, 6.0 x 6.0 x 24.9 m, walls 0.9 m. Blocks are 0.60 x 0.30 x 0.22 m. Ashlar: 19 kN/m3, friction 0.9. Rubble
core: 22 kN/m3, 0.5, also where it touches ashlar. Ground: 0.3. kn 2e9, ks 1e9 Pa/m, default step, 2 x 4 points a joint.

Own weight comes to rest in 0.5 s of local damping 0.8. Then the ground shakes for 20 s times ``--part``, without any
damping but friction. The record is normal noise, seeded, between 0.5 and 8 Hz (Butterworth, order 2) under a trapezoid
of 2 s rise and 5 s fall, without mean, scaled to largest accelerations of 3.0, 2.4 and 1.2 m/s2 along x, y and z.

Samples are kept in the folder STORE every 0.1 s of motion. The same call goes on after a kill. ``--stiffness`` is a
factor on kn and ks, ``--step`` one on the step. ``--moved`` moves every block by so much at random [m].
"""

import argparse
import json
import os
import resource
import time
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy.signal import butter, sosfilt

import dem
import limitmason as lm
from limitmason.constants import GRAVITY
from limitmason.geometry import box

CELL, COURSE, SAMPLE, SETTLE = 0.3, 0.22, 0.1, 0.5
LENGTH, RECORD_STEP, PEAKS = 20.0, 0.01, (3.0, 2.4, 1.2)


def record(seed=0, part=1.0):
    """Three components of seeded noise, or the beginning of them."""
    t = np.arange(0.0, LENGTH + RECORD_STEP, RECORD_STEP)
    band = butter(2, (0.5, 8.0), "band", fs=1.0 / RECORD_STEP, output="sos")
    noise = np.random.default_rng(seed).normal(size=(3, len(t)))
    shape = np.minimum(1.0, np.minimum(t / 2.0, (LENGTH - t) / 5.0))
    a = sosfilt(band, noise) * shape
    a -= shape * (a.sum(axis=1) / shape.sum())[:, None]  # the ground ends at rest
    a *= (np.array(PEAKS) / np.abs(a).max(axis=1))[:, None]
    return dem.BaseMotion(tuple(map(tuple, a.T[: max(2, round(part * len(t)))].tolist())), RECORD_STEP, after="hold")


def ring(side, first):
    """Cells of a square ring in its order, the first cell at (first, first)."""
    k, zero, full = np.arange(side - 1), np.zeros(side - 1, dtype=int), np.full(side - 1, side - 1)
    x, y = np.concatenate([k, full, side - 1 - k, zero]), np.concatenate([zero, k, full, side - 1 - k])
    return np.column_stack([x, y]) + first


def tower(side=20, courses=113, stiffness=1.0, moved=0.0, seed=0):
    """Tower of three leaves on a slab; every leaf in stretcher bond."""
    wide, random = side * CELL, np.random.default_rng(seed)
    solids, names, density = [box((-1.0, -1.0, -0.5), (wide + 1.0, wide + 1.0, 0.0))], ["ground"], [19e3 / GRAVITY]
    for course in range(courses):
        for leaf, weight in enumerate((19e3, 22e3, 19e3)):
            cells = np.roll(ring(side - 2 * leaf, leaf), (course + leaf) % 2, axis=0).reshape(-1, 2, 2)
            for k, pair in enumerate(cells):
                low = (*pair.min(axis=0) * CELL, course * COURSE)
                high = (*(pair.max(axis=0) + 1) * CELL, (course + 1) * COURSE)
                corners, faces = box(low, high)
                solids.append((np.asarray(corners) + moved * random.uniform(-1.0, 1.0, 3), faces))
                names.append(f"{'core' if leaf == 1 else 'ashlar'}-{course}-{leaf}-{k}")
                density.append(weight / GRAVITY)
    law, core, ground = (
        lm.Joint(float(np.degrees(np.arctan(mu))), normal_stiffness=2e9 * stiffness, shear_stiffness=1e9 * stiffness)
        for mu in (0.9, 0.5, 0.3)
    )
    built = lm.Assembly.from_polyhedra(
        solids, joint=law, density=density, fixed=["ground"], names=names, joints={"base": ground}
    )
    rubble = np.array([name.startswith("core") for name in names])
    return built.with_interfaces(
        replace(i, joint=core) if i.kind != "base" and (rubble[i.block_a] or rubble[i.block_b]) else i
        for i in built.interfaces
    )


def result(h):
    """Energies [J] of the shaking, drift at the top and of the base [m], and blocks that fell, of a history."""
    shaken = int(np.searchsorted(h["stage"], 1.0)) - 1  # the last sample at rest
    gain = {
        c: float(h[c][-1] - h[c][shaken])
        for c in ("kinetic", "elastic", "friction", "fracture", "viscous", "damping", "applied", "support")
    }
    put = {c: h[c][shaken:] - h[c][shaken] for c in gain}
    work = put["applied"] + put["support"]
    missing = work - sum(v for c, v in put.items() if c not in ("applied", "support"))
    flow = float(np.abs(np.diff(put["support"])).sum())
    shift = h.shift - h.shift[:, :1]  # from the ground
    top = np.flatnonzero(h.assembly.centroids[:, 2] > h.assembly.centroids[1:, 2].max() - 1e-6)
    low = np.arange(1, 1 + len(top))
    drift = np.linalg.norm(np.median(shift[:, top], axis=1)[:, :2], axis=1)
    base = np.linalg.norm(np.median(shift[:, low], axis=1)[:, :2], axis=1)
    lost = h.shift[-1, :, 2] - h.shift[-1, 0, 2] < -0.5 * COURSE
    return {
        "shaken [s]": float(h["time"][-1] - h["time"][shaken]),
        **{f"{c} [kJ]": 1e-3 * v for c, v in gain.items()},
        "support, absolute [kJ]": 1e-3 * flow,
        "missing, largest [kJ]": 1e-3 * float(np.abs(missing).max()),
        "largest drift of the top [mm]": 1e3 * float(drift.max()),
        "drift left [mm]": 1e3 * float(drift[-1]),
        "base slid [mm]": 1e3 * float(base[-1]),
        "blocks lost": int(lost.sum()),
        "blocks moved by 10 mm against the base": int(
            (np.linalg.norm(shift[-1] - np.median(shift[-1, low], axis=0), axis=1) > 0.01).sum()
        ),
    }


def stepped(h, stages, folder, begun, **how):
    """History at the end, of a new run or one that is taken up; a line for every sample."""
    first = 0.0 if h is None else float(h["step"][-1])

    def told(row):
        wall, cpu = time.perf_counter() - begun[0], time.process_time() - begun[1]
        steps = row["step"] - first
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        line = {
            "time": row["time"],
            "step": row["step"],
            "stage": row["stage"],
            "elapsed": round(wall, 1),
            "cpu": round(cpu, 1),
            "cpu/step": cpu / max(steps, 1),
            "MB": round(peak),
        }
        with (Path(folder) / "log.jsonl").open("a") as log:
            log.write(json.dumps(line) + "\n")

    if h is not None:
        return dem.resume(h, stages, progress=told, checkpoint_every=5)
    return dem.simulate(
        how.pop("assembly"),
        stages,
        mode="dynamic",
        sample=SAMPLE,
        progress=told,
        checkpoint_every=5,
        store=dem.Store(folder, joints=False),
        **how,
    )


def main():
    """Run, or go on, and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("store")
    parser.add_argument("--part", type=float, default=1.0)
    parser.add_argument("--ring", type=int, default=20)
    parser.add_argument("--courses", type=int, default=113)
    parser.add_argument("--points", type=int, nargs=2, default=(2, 4))
    for name in ("stiffness", "step"):
        parser.add_argument(f"--{name}", type=float, default=1.0)
    parser.add_argument("--moved", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--no-search", action="store_true")
    x = parser.parse_args()
    begun = time.perf_counter(), time.process_time()
    model = tower(x.ring, x.courses, x.stiffness, x.moved, x.seed)
    built = time.process_time()
    points = tuple(x.points)
    stages = [dem.Hold(duration=SETTLE, damping=dem.Damping(local=0.8)), record(part=x.part)]
    h, how = None, {}
    if (Path(x.store) / "checkpoint.npz").exists():
        h = dem.History.load(x.store, model)
    else:
        state = dem.initial_state(model, lm.Loads.weight(model), mode="dynamic", contact_points=points)
        made = time.process_time()
        print(
            f"{model.n_blocks} blocks, {len(model.interfaces)} joints, {len(state.points.s)} points: assembly "
            f"{built - begun[1]:.1f} s, state {made - built:.1f} s, step {state.dt:.3e} s",
            flush=True,
        )
        how = {"assembly": model, "contact_points": points, "dt": x.step * state.dt}
        how |= {"detect_every": None} if x.no_search else {}
        del state
    if h is None or h.position is not None:
        begun = time.perf_counter(), time.process_time()
        Path(x.store).mkdir(parents=True, exist_ok=True)
        h = stepped(h, stages, x.store, begun, **how)
        print(
            f"{time.perf_counter() - begun[0]:.0f} s elapsed, {time.process_time() - begun[1]:.0f} s of processor "
            f"time in this process"
        )
    print(f"{h.status} after {h['step'][-1]:.0f} steps")
    for name, value in result(h).items():
        print(f"| {name} | {value:.4g} |")


if __name__ == "__main__":
    main()
