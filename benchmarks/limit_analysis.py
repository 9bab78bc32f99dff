"""Limit analysis of running-bond walls of 55 to 10,011 blocks: whole call, bare solvers, overhead and memory.

Every row of the table is one wall and one load, with everything that is to be compared side by side and from one run:
the whole ``limit_analysis`` call, the package's own solver and Clarabel (force form, tolerance 1e-8) on the same
arrays, the multiplier of each and the certified gap of the whole call. Each measurement runs in a child process, so
that its peak memory is its own; compiled kernels are loaded before. The bare solvers, which use one thread, are
measured in processor seconds, which other work on the machine disturbs less; the rest in elapsed seconds.

    python benchmarks/limit_analysis.py                       # up to 3041 blocks, minutes
    python benchmarks/limit_analysis.py --large               # also 10,011 blocks
    python benchmarks/limit_analysis.py --sizes 820 --repeat 3
"""

import argparse
import multiprocessing
import os
import resource
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import limitmason as lm
from limitmason.limit.interior_point.solver import solve_interior_point
from limitmason.limit.program.clarabel_solver import solve_static
from limitmason.limit.program.cones import make_cones
from limitmason.limit.program.static_theorem import make_problem
from limitmason.limit.solvers import choose_solver

UNITS_AND_COURSES = {55: (5, 10), 210: (10, 20), 820: (20, 40), 3041: (39, 77), 10011: (70, 142)}
CASES = (
    # name, direction of the live load, reduction to the plane, friction in the head joints
    ("plane", (1, 0, 0), None, True),
    ("plane, no heads", (1, 0, 0), None, False),
    ("out of plane", (0, 1, 0), None, True),
    ("out of plane, no heads", (0, 1, 0), None, False),
    ("plane as 3-D", (1, 0, 0), False, True),
    ("plane as 3-D, no heads", (1, 0, 0), False, False),
)
HEADER = (
    "| blocks | case | points | whole [s] | own [CPU s] | outside [s] | its | Clarabel [CPU s] | its | Clarabel / own "
    "| lambda | Clarabel - own | gap | own [MB] | Clarabel [MB] |"
)


def wall(blocks, heads):
    """Running bond of units 0.4 x 0.2 x 0.2 m on a slab, friction coefficient 0.65."""
    units, courses = UNITS_AND_COURSES[blocks]
    joint = lm.Joint.from_friction_coefficient(0.65)
    assembly = lm.build.wall(length=0.4 * units, courses=courses, unit=(0.4, 0.2, 0.2), joint=joint)
    return assembly if heads else assembly.with_interfaces(i for i in assembly.interfaces if i.kind != "head")


def whole_call(assembly, loads, in_plane):
    start = time.perf_counter()
    p = lm.limit_analysis(assembly, loads, in_plane=in_plane)
    seconds = time.perf_counter() - start
    return {
        "seconds": seconds,
        "outside": seconds - p.provenance["solver_seconds"],
        "gap": p.certificate.gap,
        "solver": p.provenance["solver"],
    }


def own_solver(problem):
    start = time.process_time()
    s = solve_interior_point(problem)
    return {
        "seconds": time.process_time() - start,
        "iterations": s.iterations,
        "lambda": s.multiplier * problem.live_scale,
    }


def clarabel_solver(problem):
    start = time.process_time()
    s = solve_static(problem, make_cones(problem), tolerance=1e-8)
    return {
        "seconds": time.process_time() - start,
        "iterations": s.iterations,
        "lambda": s.multiplier * problem.live_scale,
    }


def apart(function, *arguments, repeat=1):
    """Result of the fastest of some calls in child processes, with the peak memory of the child."""
    best = None
    for _ in range(repeat):
        receiver, sender = multiprocessing.Pipe(duplex=False)

        def work(sender=sender):
            result = function(*arguments)
            result["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            sender.send(result)

        child = multiprocessing.get_context("fork").Process(target=work)
        child.start()
        sender.close()
        result = receiver.recv()
        child.join()
        if best is None or result["seconds"] < best["seconds"]:
            best = result
    return best


def row(blocks, case, clarabel_points, repeat):
    """One line of the table."""
    name, direction, in_plane, heads = case
    assembly = wall(blocks, heads)
    loads = lm.Loads.horizontal(assembly, direction)
    whole = apart(whole_call, assembly, loads, in_plane, repeat=repeat)
    problem = make_problem(assembly, loads, in_plane=in_plane)
    own = apart(own_solver, problem, repeat=repeat)
    other = None
    if problem.points.count <= clarabel_points:
        other = apart(clarabel_solver, problem, repeat=repeat)
    cells = [
        blocks, name, problem.points.count,
        f"{whole['seconds']:.2f}{'' if choose_solver(problem) == 'interior-point' else ' (Clarabel)'}",
        f"{own['seconds']:.3f}", f"{whole['outside']:.3f}", own["iterations"],
        *((f"{other['seconds']:.3f}", other["iterations"], f"{other['seconds'] / own['seconds']:.1f}") if other
          else ("-", "-", "-")),
        f"{own['lambda']:.8f}", f"{other['lambda'] / own['lambda'] - 1:+.0e}" if other else "-",
        f"{whole['gap']:.0e}", f"{own['memory']:.0f}", f"{other['memory']:.0f}" if other else "-",
    ]
    return "| " + " | ".join(str(c) for c in cells) + " |"


def main():
    """Print the table as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", choices=UNITS_AND_COURSES, default=[55, 210, 820, 3041])
    parser.add_argument("--large", action="store_true", help="also 10,011 blocks")
    parser.add_argument("--repeat", type=int, default=1, help="runs of each measurement, the fastest counts")
    parser.add_argument("--clarabel-points", type=int, default=60000, help="largest problem that Clarabel is given")
    options = parser.parse_args()
    warm = wall(55, True)
    for direction in ((1, 0, 0), (0, 1, 0)):
        own_solver(make_problem(warm, lm.Loads.horizontal(warm, direction)))
    print(HEADER)
    print("|" + "---|" * (HEADER.count("|") - 1))
    for blocks in dict.fromkeys([*options.sizes, *([10011] if options.large else [])]):
        for case in CASES:
            print(row(blocks, case, options.clarabel_points, options.repeat), flush=True)


if __name__ == "__main__":
    main()
