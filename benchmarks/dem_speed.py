"""Speed of the distinct element kernel: contact updates against the machine's limit, steps, growth, two at a time.

The machine's limit is measured in the same run by two sweeps over arrays that stay in the first-level cache: one of
multiply-adds, one of a square root and a division. A contact point of the plain law takes about 42 arithmetic
instructions (a multiply-add counts as one), one square root and one division; the limit is the slower of the two units
at work all the time, with loads, stores, joint kinematics and block motion for nothing. A second limit counts the
kinematics of a joint too. One thread; processor seconds, best of several; the two processes side by side are timed in
elapsed seconds too.

    python benchmarks/dem_speed.py             # 1 to 2 minutes
    python benchmarks/dem_speed.py --quick     # up to 1,000 blocks
"""

import argparse
import multiprocessing
import os
import queue
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np
from numba import njit

import limitmason as lm
from dem import initial_state
from dem.model.advance import run_constant
from limitmason.model.stages import Damping

INSTRUCTIONS_PER_POINT = 42  # of the plain law without dilation and crushing, counted in dem/kernels/joint_law.py
INSTRUCTIONS_PER_JOINT = 180  # of its kinematics and of its forces on blocks
CHAIN = 16  # multiply-adds per element of the sweep
GRIDS = {8: (4, 2), 32: (8, 4), 128: (16, 8)}
SIZES = {104: (9, 11), 420: (20, 20), 1040: (32, 32), 2080: (45, 45), 4095: (63, 64)}
ELSEWHERE = {8: 80e6, 32: 236e6, 128: 444e6}  # point updates per second on the machine the kernel was designed on
DAMPING = Damping(local=0.5)
LOOKED_AFTER = 1.0  # time between two looks at whether the processes are alive [s]


@njit(fastmath={"contract"}, error_model="numpy")
def multiply_adds(x, y, b, c, times):
    for _ in range(times):
        for k in range(x.size):
            v = x[k]
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            v = v * b + c
            y[k] = v


@njit(fastmath={"contract"}, error_model="numpy")
def roots_and_divisions(x, y, z, times):
    for _ in range(times):
        for k in range(x.size):
            y[k] = z[k] / np.sqrt(x[k] + y[k])


def best(function, repeat=5):
    """Least processor seconds of several calls."""
    seconds = []
    for _ in range(repeat):
        start = time.process_time()
        function()
        seconds.append(time.process_time() - start)
    return min(seconds)


def machine_rates():
    """Multiply-adds, and pairs of a square root and a division, per second of one thread."""
    n, times = 1024, 20_000
    x, y, z = np.full(n, 0.7), np.zeros(n), np.full(n, 1.3)
    multiply_adds(x, y, 0.9, 0.1, 1)
    y[:] = 1.0
    roots_and_divisions(x, y, z, 1)
    adds = n * times * CHAIN / best(lambda: multiply_adds(x, y, 0.9, 0.1, times))
    roots = n * times / best(lambda: roots_and_divisions(x, y, z, times))
    return adds, roots


def wall_state(blocks, points):
    """State and dead load of a running-bond wall of Pavia's blocks, 80 x 28 x 40 mm."""
    units, courses = SIZES[blocks]
    wall = lm.build.wall(
        length=0.08 * units, courses=courses, unit=(0.08, 0.04, 0.028), joint=lm.Joint.from_friction_coefficient(0.67)
    )
    loads = lm.Loads.weight(wall)
    return wall, initial_state(wall, loads, contact_points=GRIDS[points]), loads.dead


def steps_per_second(blocks, points, seconds=0.6):
    """Steps per processor second, points, joints and blocks that move."""
    wall, state, dead = wall_state(blocks, points)
    run_constant(state, dead, 10, DAMPING)
    start = time.process_time()
    run_constant(state, dead, 20, DAMPING)
    count = max(int(20 * seconds / max(time.process_time() - start, 1e-4)), 20)
    rate = count / best(lambda: run_constant(state, dead, count, DAMPING))
    return rate, len(state.points.s), len(state.joints.block_a), int((~wall.fixed).sum())


def timed_process(count, barrier, results):
    """Elapsed and processor seconds of steps of the 104-block wall, started together with the other processes."""
    _, state, dead = wall_state(104, 32)
    run_constant(state, dead, 50, DAMPING)
    barrier.wait()
    start = time.perf_counter(), time.process_time()
    run_constant(state, dead, count, DAMPING)
    results.put((time.perf_counter() - start[0], time.process_time() - start[1]))


def side_by_side(processes, count):
    """Elapsed and processor seconds of the slowest of some processes, each with the same work."""
    context = multiprocessing.get_context("spawn")
    barrier, results = context.Barrier(processes), context.Queue()
    workers = [context.Process(target=timed_process, args=(count, barrier, results)) for _ in range(processes)]
    for worker in workers:
        worker.start()
    seconds: list[tuple[float, float]] = []
    while len(seconds) < processes:
        try:
            seconds.append(results.get(timeout=LOOKED_AFTER))
        except queue.Empty:
            # one that died, as it cannot import, never comes to the barrier: the others would wait there for ever
            died = [w.exitcode for w in workers if w.exitcode]
            if died:
                barrier.abort()
                for worker in workers:
                    worker.join()
                raise SystemExit(f"a process of the benchmark ended with {died[0]}, see above") from None
    for worker in workers:
        worker.join()
    return np.array(seconds).max(axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="up to 1,040 blocks")
    quick = parser.parse_args().quick
    adds, roots = machine_rates()
    limit = min(adds / INSTRUCTIONS_PER_POINT, roots)
    print(f"Multiply-adds {adds / 1e9:.2f} billion/s, square root with division {roots / 1e6:.0f} million/s: limit ")
    print(f"{limit / 1e6:.0f} million points/s. Load average at the start {os.getloadavg()[0]:.1f}.\n")
    print(
        "| points per joint | steps/s, 104 blocks | million points/s | of the limit "
        "| of the limit with kinematics of joints | of another machine |"
    )
    print("|---" * 6 + "|")
    for points in GRIDS:
        rate, total, _, _ = steps_per_second(104, points)
        updates = rate * total
        with_joints = min(adds / (INSTRUCTIONS_PER_POINT + INSTRUCTIONS_PER_JOINT / points), roots)
        print(
            f"| {points} | {rate:,.0f} | {updates / 1e6:.0f} | {100 * updates / limit:.0f} % "
            f"| {100 * updates / with_joints:.0f} % | {100 * updates / ELSEWHERE[points]:.0f} % |"
        )
    print("\n| blocks | joints | microseconds per step, 8 points | nanoseconds per joint |\n|---|---|---|---|")
    rows = []
    for blocks in [b for b in SIZES if b <= (1040 if quick else 10_000)]:
        rate, _, joints, moving = steps_per_second(blocks, 8)
        rows.append((joints, 1.0 / rate))
        print(f"| {moving} | {joints} | {1e6 / rate:.0f} | {1e9 / rate / joints:.0f} |")
    x, y = np.log(np.array(rows)).T
    print(f"\nTime per step grows as joints^{np.polyfit(x, y, 1)[0]:.2f}.\n")
    count = 20_000 if quick else 40_000
    ratios = np.array([2.0 * side_by_side(1, count) / side_by_side(2, count) for _ in range(4)])
    elapsed, processor = (", ".join(f"{r:.2f}" for r in column) for column in ratios.T)
    print(f"Two processes side by side do {elapsed} times the work of one in the same elapsed time (four tries),")
    print(f"and {processor} times in the same processor time each, which other work on the machine disturbs less.")


if __name__ == "__main__":
    main()
