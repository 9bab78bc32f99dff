"""How far the proof of the smallest and largest multiplier reaches: times, gaps and what each end rests on.

Run ``python benchmarks/proven_range.py [seconds per end]``. Walls of 0.4 x 0.175 m units, psi = 0.
"""

import sys
import time

import limitmason as lm

LENGTH, HEIGHT, DEPTH = 0.4, 0.175, 0.2


def running_bond(units, courses, half_first=True):
    """Rows of unit lengths, the bottom course with half units at its ends."""
    full, half = [1.0] * units, [0.5] + [1.0] * (units - 1) + [0.5]
    return [half if (k % 2 == 0) == half_first else full for k in range(courses)]


PORTAL = [[0.5, -1, 0.5], [0.5, -1, 0.5], [1, 1], [0.5, 1, 0.5]]

CASES = {
    "2 x 3, mu 0.8": (running_bond(2, 3), 0.8, ("smallest", "largest")),
    "2 x 3, mu 2.0": (running_bond(2, 3), 2.0, ("smallest", "largest")),
    "2 x 4, mu 0.8": (running_bond(2, 4), 0.8, ("smallest", "largest")),
    "2 x 5, mu 0.8": (running_bond(2, 5), 0.8, ("smallest", "largest")),
    "2 x 6, mu 0.8": (running_bond(2, 6), 0.8, ("smallest", "largest")),
    "3 x 3, mu 0.9": (running_bond(3, 3), 0.9, ("smallest", "largest")),
    "portal, mu 0.65": (PORTAL, 0.65, ("smallest", "largest")),
}


def assembly_of(rows, mu):
    """Courses of rectangles on a fixed slab; a negative length is an opening."""
    width = LENGTH * max(sum(abs(q) for q in row) for row in rows)
    outlines = [[(-1.0, -0.2), (width + 1.0, -0.2), (width + 1.0, 0.0), (-1.0, 0.0)]]
    for k, row in enumerate(rows):
        x = 0.0
        for q in row:
            if q > 0:
                low, high = x * LENGTH, (x + q) * LENGTH
                bottom, top = k * HEIGHT, (k + 1) * HEIGHT
                outlines.append([(low, bottom), (high, bottom), (high, top), (low, top)])
            x += abs(q)
    return lm.Assembly.from_polygons(outlines, thickness=DEPTH, joint=lm.Joint.from_friction_coefficient(mu), fixed=[0])


def show(name, found):
    for end_name, end in found.ends.items():
        proof = "proven" if end.proven else "open"
        within = (
            f"velocities <= {found.velocity_bound:g} ({end.velocity_share:.2f})" if end.velocity_bounded else "none"
        )
        print(
            f"{name:<22}{end_name:<10}{end.value:10.6f}{end.bound:10.6f}{end.gap:9.1e}  {proof:<7}{end.seconds:7.1f}"
            f"{end.nodes:8d}  {end.method:<23}bounds: {within}",
            flush=True,
        )


def main(seconds):
    print(f"{'wall':<22}{'end':<10}{'value':>10}{'bound':>10}{'gap':>9}  {'':<7}{'s':>7}{'nodes':>8}  proof")
    for name, (rows, mu, which) in CASES.items():
        assembly = assembly_of(rows, mu)
        show(name, lm.proven_range(assembly, lm.Loads.horizontal(assembly), time_limit=seconds, which=which))
    for number in range(1, 7):
        test = lm.experiments.load("ferris-tin-loi-2001", f"wall-{number}")
        show(
            f"Ferris-Tin-Loi {number}",
            lm.proven_range(test.assembly(), test.loads(), time_limit=seconds, which=("largest",)),
        )


if __name__ == "__main__":
    start = time.perf_counter()
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
    print(f"{time.perf_counter() - start:.0f} s in all")
