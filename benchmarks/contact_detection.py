"""Contact detection on running-bond walls with a slab: time by size, and the exponent at which it grows.

python benchmarks/contact_detection.py
python benchmarks/contact_detection.py --sizes 820 3041 --repeat 5
"""

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import limitmason as lm
from limitmason.geometry.contact import find_contacts
from limitmason.model.detection import contact_distances, near_miss_reach, pieces_of

UNITS_AND_COURSES = {210: (10, 20), 820: (20, 40), 3041: (39, 77), 10011: (70, 142)}


def measure(blocks, repeat):
    """Blocks, contacts, seconds of the whole builder and of detection alone; the fastest of some runs."""
    units, courses = UNITS_AND_COURSES[blocks]
    joint = lm.Joint.from_friction_coefficient(0.65)
    start = time.perf_counter()
    assembly = lm.build.wall(length=0.4 * units, courses=courses, unit=(0.4, 0.2, 0.2), joint=joint)
    build = time.perf_counter() - start
    pieces = pieces_of(assembly.blocks)
    distances = contact_distances(pieces.widths, assembly.contact_rules)
    reach = near_miss_reach(pieces.widths, distances)
    seconds = np.inf
    for _ in range(repeat):
        start = time.perf_counter()
        found = find_contacts(pieces.solids, pieces.owner, distances, rules=assembly.contact_rules, reach=reach)
        seconds = min(seconds, time.perf_counter() - start)
    return assembly.n_blocks, len(found.a), build, seconds


def main():
    """Print one row per size and the growth exponent, the slope of log(time) over log(blocks)."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", choices=UNITS_AND_COURSES, default=[820, 3041, 10011])
    parser.add_argument("--repeat", type=int, default=3, help="runs of each measurement, the fastest counts")
    options = parser.parse_args()
    print("| blocks with slab | contacts | builder, whole [s] | detection [s] | microseconds per contact |")
    print("|---|---|---|---|---|")
    rows = []
    for blocks in options.sizes:
        rows.append(measure(blocks, options.repeat))
        n, contacts, build, seconds = rows[-1]
        print(f"| {n} | {contacts} | {build:.2f} | {seconds:.3f} | {1e6 * seconds / contacts:.1f} |", flush=True)
    if len(rows) > 1:
        n, _, _, seconds = np.array(rows).T
        print(f"\ntime grows as blocks^{np.polyfit(np.log(n), np.log(seconds), 1)[0]:.2f}")


if __name__ == "__main__":
    main()
