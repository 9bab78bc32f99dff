"""Steps of one large structure by two threads, beside two processes of one thread each.

    python benchmarks/dem_threads.py [--ring 20] [--courses 113] [--steps 60] [--rounds 7]

The tower of ``tower.py`` with a fifth of its weight sideways. Every round steps it by one thread, in two processes at a
time, and by two threads. Elapsed seconds: on a machine with other work all three lose, so they are taken in turn.
"""

import argparse
import multiprocessing
import os
import time

import numpy as np
from tower import tower

import dem
import limitmason as lm
from dem import kernels
from dem.model.advance import run_constant


def made(ring, courses):
    """State of a tower and what acts on it."""
    model = tower(ring, courses)
    state = dem.initial_state(model, lm.Loads.weight(model), mode="dynamic", contact_points=(2, 4))
    wrench = state.dead.copy()
    wrench[:, 0] += 0.2 * model.weights
    run_constant(state, wrench, 4, dem.Damping(local=0.3))
    return state, wrench


def stepped(state, wrench, steps, threads):
    """Elapsed and processor seconds of some steps in chunks of 50, as between two searches for contacts."""
    kernels.threads_allowed, before = (lambda: threads), kernels.threads_allowed
    begun = time.perf_counter(), time.process_time()
    for first in range(0, steps, 50):
        run_constant(state, wrench, min(50, steps - first), dem.Damping(local=0.3))
    kernels.threads_allowed = before
    return np.array([time.perf_counter() - begun[0], time.process_time() - begun[1]])


def companion(ring, courses, line):
    """Another process with the same tower: steps it whenever it is told how often."""
    state, wrench = made(ring, courses)
    line.send(None)
    while steps := line.recv():
        line.send(stepped(state, wrench, steps, 1))


def main():
    """Print a line for every round, and medians."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, value in (("ring", 20), ("courses", 113), ("steps", 60), ("rounds", 7)):
        parser.add_argument(f"--{name}", type=int, default=value)
    x = parser.parse_args()
    context = multiprocessing.get_context("spawn")
    line, end = context.Pipe()
    other = context.Process(target=companion, args=(x.ring, x.courses, end), daemon=True)
    other.start()
    state, wrench = made(x.ring, x.courses)
    line.recv()
    print(f"{len(state.bodies.mass)} blocks, {len(state.joints.block_a)} joints\n")
    print("| one thread [ms/step] | two processes | two threads | threads over processes | processor time over one's |")
    print("|---|---|---|---|---|")
    rows = []
    for _ in range(x.rounds):
        one = stepped(state, wrench, x.steps, 1)
        line.send(x.steps)
        pair = stepped(state, wrench, x.steps, 1), line.recv()
        two = stepped(state, wrench, x.steps, 2)
        beside = 1.0 / sum(1.0 / p[0] for p in pair)  # seconds for the steps of one
        rows.append((*(1e3 * t / x.steps for t in (one[0], beside, two[0])), beside / two[0], two[1] / one[1]))
        print("| " + " | ".join(f"{v:.2f}" for v in rows[-1]) + " |", flush=True)
    medians = ", ".join(f"{v:.2f}" for v in np.median(rows, axis=0))
    print(f"\nMedians {medians}. Load average {os.getloadavg()[0]:.1f}.")
    line.send(0)
    other.join()


if __name__ == "__main__":
    main()
