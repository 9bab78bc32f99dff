"""Speed of capacity curves: walls of growing size, and every tenth step beside the cone programs that it stands for.

Plane running-bond walls of 0.4 x 0.2 m units, friction 0.65, psi = 0, at the default stiffness, followed to 2 mm of
mean displacement. A curve that stops before is refused. Three processor times of the same sampled steps, from the same
states to the same displacement: the step as the path takes it; one bare Clarabel solve of its first program; and the
whole step by programs. One thread.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/capacity_speed.py            # about a minute
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/capacity_speed.py --large    # 820 blocks too, 3 minutes
"""

import argparse
import os
import resource
import time

import numpy as np

import limitmason as lm
from limitmason.capacity import step_equilibrium
from limitmason.capacity.point_law import trial
from limitmason.capacity.program import solve_step
from limitmason.capacity.step_length import extrapolated

TO = 2e-3  # m


def wall_of(size):
    """A wall of 10 courses of 5 units, or twice, four times as many each way."""
    wall = lm.build.wall(length=2.0 * size, courses=10 * size, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.02, 0.0))
    return wall, lm.Loads.horizontal(wall)


def seconds(function):
    """Processor seconds of a call, and what it gives."""
    start = time.process_time()
    answer = function()
    return time.process_time() - start, answer


def sampled(curve, every):
    """Processor seconds per sampled step: as the path takes it, one bare program, all programs (NaN: not found)."""
    rows = []
    nodes, made = curve.nodes, curve.generations
    for k in range(2, len(nodes) - 1, every):
        last, target = made.begun(nodes[k]), nodes[k + 1].control
        system = made.systems[last.generation]
        ratio = float(np.abs(system.loads.live).sum())
        guess = extrapolated(system, [*nodes[:k], last], target - last.control)
        own, _ = seconds(lambda s=system, n=last, t=target, g=guess, r=ratio: step_equilibrium.step(s, n, t, g, r))
        at = system.evaluate(last.pose, last.history, last.multiplier)
        elastic = trial(system.law, last.history, at.contact.displacement) * system.bodies.area[:, None]
        advance = (target - last.control) * ratio
        bare, _ = seconds(
            lambda s=system, a=at, e=elastic, n=last, d=advance: solve_step(s, a, n.history, e, n.force[:, 0], d)
        )
        whole, found = seconds(
            lambda s=system, n=last, t=target, r=ratio: step_equilibrium.by_programs(
                s, n.pose, n.history, t, n.multiplier, n.force[:, 0], r
            )
        )
        rows.append((own, bare, whole if found is not None else np.nan))
    return np.array(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--large", action="store_true", help="820 blocks too")
    large = parser.parse_args().large
    print(f"Load average at the start {os.getloadavg()[0]:.1f}.\n")
    print(
        "| blocks | points | steps | programs | jumps | lambda at 2 mm | whole curve [CPU s] | s/step "
        "| 50 steps [CPU s] | one program / step | programs / step | peak memory [MB] |"
    )
    print("|---" * 12 + "|")
    grown = []
    for size in (1, 2, 4) if large else (1, 2):
        wall, loads = wall_of(size)
        spent, curve = seconds(lambda w=wall, q=loads: lm.pushover(w, q, to=TO))
        # of Linux in kB; before the comparisons, which are no part of a curve
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        if curve.status != "reached" or not all(c.accepted for c in curve.certificates):
            raise SystemExit(f"{size}: {curve.status} at {curve.displacement[-1]:.4g} m. {' '.join(curve.warnings)}")
        rows = sampled(curve, every=3)
        ratio = rows[:, 1:].T / rows[:, 0]
        blocks, points = int((~wall.fixed).sum()), curve.structure.points.count
        per_step = spent / curve.cost.steps
        grown.append((blocks, per_step))
        print(
            f"| {blocks} | {points} | {curve.cost.steps} | {curve.cost.programs} | {len(curve.jumps)} | "
            f"{curve.load[-1]:.5f} | {spent:.1f} | {per_step:.3f} | {50 * per_step:.1f} | {np.median(ratio[0]):.1f} | "
            f"{np.nanmedian(ratio[1]):.1f} ({int(np.isnan(ratio[1]).sum())} of {len(rows)} not found) | {memory:.0f} |"
        )
    x, y = np.log(np.array(grown)).T
    print(f"\nTime per step grows as blocks^{np.polyfit(x, y, 1)[0]:.2f}.")


if __name__ == "__main__":
    main()
