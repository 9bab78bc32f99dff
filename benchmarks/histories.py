"""A thousand histories of a free-standing block on shaken ground: time, peak rotation, overturning and fragility.

    python benchmarks/histories.py [--histories 1000] [--workers 2] [--store FILE]

A block 0.30 x 0.30 x 1.20 m on a slab, kn 1e9 and ks 5e8 Pa/m, friction 35 degrees, contact points at its corners. The
ground moves by 10 s of noise between 0.5 and 5 Hz under half a sine, seeded and scaled to its largest acceleration, and
then rests for 1 s. Contacts are searched for by default; rotations are sampled every 0.05 s.
"""

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy.signal import butter, sosfilt

import dem
import limitmason as lm
from limitmason.geometry import box

STEP, LENGTH, GRAVITY = 0.01, 10.0, 9.81
JOINT = lm.Joint(35.0, normal_stiffness=1e9, shear_stiffness=5e8)
OVER = 0.5 * np.pi / 2.0  # rotation beyond which nothing comes back [rad]


def record(seed, pga):
    """Seeded noise as a ground motion with a largest acceleration [m/s2]."""
    t = np.arange(0.0, LENGTH, STEP)
    noise = np.random.default_rng(seed).normal(size=len(t))
    shaped = sosfilt(butter(2, (0.5, 5.0), "band", fs=1.0 / STEP, output="sos"), noise) * np.sin(np.pi * t / LENGTH)
    shaped -= shaped.mean()  # the ground ends at rest
    return dem.BaseMotion(tuple((shaped * pga / np.abs(shaped).max()).tolist()), STEP, after="hold")


def rocking(seed, pga):
    """Peak rotation of a block [rad] and whether it overturned."""
    block = lm.Assembly.from_polyhedra(
        [box((-2.0, -2.0, -0.5), (2.0, 2.0, 0.0)), box((-0.15, -0.15, 0.0), (0.15, 0.15, 1.2))], joint=JOINT, fixed=[0]
    )
    h = dem.simulate(
        block, [record(seed, pga), dem.Hold(duration=1.0)], mode="dynamic", contact_points=(2, 2), sample=0.05
    )
    tilt = np.arccos(np.clip(1.0 - 2.0 * (h.quaternion[:, 1, 1:3] ** 2).sum(axis=1), -1.0, 1.0))
    return {"peak": float(tilt.max()), "overturned": bool(tilt.max() > OVER), "steps": float(h["step"][-1])}


def main():
    """Print time, shares and the curve."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--histories", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--store", default=None)
    args = parser.parse_args()
    random = np.random.default_rng(0)
    points = [{"seed": k, "pga": float(v)} for k, v in enumerate(random.uniform(2.0, 8.0, args.histories))]
    begun, busy = time.perf_counter(), time.process_time()
    units = {"pga": "m/s2", "peak": "rad"}
    table = lm.study.sweep(rocking, points, workers=args.workers, store=args.store, units=units)
    spent = time.perf_counter() - begun
    fell = np.array([bool(v) for v in table["overturned"]])
    peak = np.degrees(table["peak"])
    busy = time.process_time() - busy
    print(f"{len(table)} histories of {LENGTH + 1:g} s, {table['steps'].mean():.0f} steps each: {spent:.0f} s elapsed, "
          f"{busy:.0f} s of processor time in this process, {args.workers} at work")
    if not fell.all():
        share = ", ".join(f"{v:.2g}" for v in np.percentile(peak[~fell], (10, 50, 90)))
        print(f"peak rotation of those that stand, 10, 50 and 90 %: {share} degrees")
    print("| largest acceleration [m/s2] | histories | overturned | median peak [degrees] |\n|---|---|---|---|")
    for low in range(2, 8):
        rows = (table["pga"] >= low) & (table["pga"] < low + 1)
        if not rows.any():
            continue  # few histories leave some ranges empty
        print(f"| {low} to {low + 1} | {int(rows.sum())} | {fell[rows].mean():.3f} | {np.median(peak[rows]):.2g} |")
    if 0 < fell.sum() < len(fell):
        print(lm.study.fragility(table, "pga", "overturned"))
    else:
        print(f"no fragility curve: {fell.sum()} of {len(fell)} histories overturned, it needs some of both; "
              "give more --histories")


if __name__ == "__main__":
    main()
