"""How set-up, contact search, steps and memory grow with the number of blocks: a tower of bricks on a shaken ground.

    python benchmarks/tower_growth.py [--blocks 1000 3000 10000]

A square ring of bricks 0.50 x 0.25 x 0.20 m in courses that are shifted by half a brick, on a slab. Joints have kn 2e9
and ks 1e9 Pa/m, and the default 4 x 8 points.
Every size runs in a process of its own, so that its peak of memory is its own. Processor seconds.
"""

import argparse
import json
import resource
import subprocess
import sys
import time

import numpy as np

import dem
import limitmason as lm
from dem.contact.detection import redetect
from dem.contact.near import near_margin
from dem.model.advance import run
from dem.model.pieces import Pieces
from limitmason.model.stages import Damping

THICKNESS, COURSE = 0.25, 0.2
COLUMNS = ("blocks", "joints", "points", "assembly", "state", "first search", "search", "step", "memory")
UNITS = ("", "", "", "s", "s", "s", "s", "ms", "MB")


def tower(side, courses, joint=None):
    """Square tower on a slab, ``side`` widths of a brick wide: 2 (side - 1) bricks a course."""
    t, h = THICKNESS, COURSE
    line = np.arange(side - 1)
    zero, full = np.zeros(side - 1, dtype=int), np.full(side - 1, side - 1)
    ring = np.concatenate([
        np.column_stack([line, zero]), np.column_stack([full, line]),
        np.column_stack([side - 1 - line, full]), np.column_stack([zero, side - 1 - line]),
    ])
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))

    def box(low, high):
        (a, b, c), (d, e, f) = low, high
        corners = ((a, b, c), (d, b, c), (d, e, c), (a, e, c), (a, b, f), (d, b, f), (d, e, f), (a, e, f))
        return np.array(corners, dtype=float), faces

    wide = side * t
    solids = [box((-0.5, -0.5, -0.5), (wide + 0.5, wide + 0.5, 0.0))]
    for course in range(courses):
        cells = np.roll(ring, course % 2, axis=0).reshape(-1, 2, 2)
        for pair in cells:
            low, high = pair.min(axis=0) * t, (pair.max(axis=0) + 1) * t
            solids.append(box((*low, course * h), (*high, (course + 1) * h)))
    law = joint or lm.Joint(35.0, normal_stiffness=2e9, shear_stiffness=1e9)
    return lm.Assembly.from_polyhedra(solids, joint=law, density=2000.0, fixed=[0])


def of_about(blocks, courses_per_side=5.0):
    """Width in cells and number of courses of a tower of about so many blocks, five courses to a cell of width."""
    side = max(4, round((blocks / (2.0 * courses_per_side)) ** 0.5) + 1)
    return side, max(1, round(blocks / (2 * (side - 1))))


def measured(blocks):
    """Row of the table of one size."""
    clock = time.process_time
    small = tower(4, 2)
    dem.simulate(small, dem.Hold(steps=2), mode="dynamic", detect_every=None)
    begun = clock()
    model = tower(*of_about(blocks))
    built = clock()
    state = dem.initial_state(model, lm.Loads.weight(model), mode="dynamic")
    made = clock()
    pieces, margin = Pieces.of(model), near_margin(model)
    redetect(model, state, pieces, margin=margin)
    first = clock()
    redetect(model, state, pieces, margin=margin)
    again = clock()
    steps = max(4, round(200_000 / model.n_blocks))
    cases, drives = np.zeros((1, model.n_blocks, 6)), np.zeros((0, model.n_blocks, 6))
    cases[0, :, 2] = -model.weights
    run(state, cases, np.ones((1, 1)), Damping(), drives, np.zeros((1, 0)))
    ready = clock()
    run(state, cases, np.ones((steps, 1)), Damping(), drives, np.zeros((steps, 0)))
    stepped = clock()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return dict(zip(COLUMNS, (
        model.n_blocks, len(model.interfaces), len(state.points.s), built - begun, made - built, first - made,
        again - first, 1e3 * (stepped - ready) / steps, peak,
    ), strict=True))


def main():
    """Print the table and its exponents."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--blocks", type=int, nargs="+", default=[1000, 3000, 10_000])
    parser.add_argument("--one", type=int)
    args = parser.parse_args()
    if args.one:
        print(json.dumps(measured(args.one)))
        return
    rows = []
    print("| " + " | ".join(f"{c} [{u}]" if u else c for c, u in zip(COLUMNS, UNITS, strict=True)) + " |")
    print("|---" * len(COLUMNS) + "|", flush=True)
    for blocks in args.blocks:
        done = subprocess.run(
            [sys.executable, __file__, "--one", str(blocks)], check=True, capture_output=True, text=True
        )
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        print("| " + " | ".join(f"{rows[-1][c]:.4g}" if u else str(rows[-1][c])
                                for c, u in zip(COLUMNS, UNITS, strict=True)) + " |", flush=True)
    if len(rows) > 1:
        low, high = rows[0], rows[-1]
        size = np.log(high["blocks"] / low["blocks"])
        powers = (f"{np.log(high[c] / low[c]) / size:.2f}" if u else "" for c, u in zip(COLUMNS, UNITS, strict=True))
        print("| exponent | " + " | ".join(list(powers)[1:]) + " |")


if __name__ == "__main__":
    main()
