"""Seconds of a verdict, its report and a rehearsal, against the matrix products that they cannot do without.

``python benchmarks/diagnosis.py [--trials 20]`` from the repository root, about a minute on one core. Simulator: a
closed form of dry walls on a tilting table, tabulated beforehand; 24 specimens, 16 causes, one measured input.
Processor seconds, one thread. The limit is the ranking of all nodes of all causes by one matrix product each, for as
many data sets as the verdict draws for its gate and for each explanation held against the others.
"""

import argparse
import math
import sys
import time

import numpy as np

from limitmason.diagnosis import Cause, Measured, Noise, Study

NOISE = 0.04
DRAWS = 699  # of the gate, and about as many of a confidence set
HIDDEN = {"nothing": {}, "one cause": {"p1": 0.5}, "two causes": {"p2": 0.6, "p7": 0.9}}


def specimens():
    """Twenty-four walls that differ in eight recorded quantities, drawn once."""
    rng = np.random.default_rng(24)
    return [{f"x{i}": float(v) for i, v in enumerate(row)} for row in rng.uniform(0.0, 1.0, (24, 8))]


def simulate(s, *, friction=0.7, **sizes):
    """Multiplier of a slender wall, changed by sixteen causes that go with the recorded quantities."""
    value = 0.1 * (1.0 + s["x0"]) + 0.2 * friction * (0.5 + s["x1"])
    for name, size in sizes.items():
        i = int(name[1:])
        value *= math.exp(size * (0.15 + 0.3 * s[f"x{i % 8}"] * (1.0 if i < 8 else s[f"x{(i + 3) % 8}"] - 0.6)))
    return value


CAUSES = [Cause(f"cause {i}", f"p{i}", 0.0, (0.0, 1.5) if i % 2 else (-1.5, 1.5)) for i in range(16)]


def seconds(work):
    """Processor seconds of a call, and what it returned."""
    start = time.process_time()
    out = work()
    return time.process_time() - start, out


def bare(design, causes):
    """Processor seconds of one ranking of every node by a product, for the draws of a gate, the best of five."""
    data = np.random.default_rng(0).standard_normal((DRAWS, design.n + design.inputs + 1))
    ranks = [design.singles[c.name].cells.ranks for c in causes]
    return min(seconds(lambda: [data @ r for r in ranks])[0] for _ in range(5))


def main(arguments=None):
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=20)
    given = parser.parse_args(arguments)
    walls = specimens()
    study = Study(
        walls, simulate, None, Noise(NOISE), {"friction": Measured(0.7, 0.03)}, list(walls[0]), pair_tables="additive"
    )
    spent, design = seconds(lambda: study.design(CAUSES))
    nodes = sum(len(g.nodes) for g in design.singles.values())
    limit = bare(design, CAUSES)
    sys.stdout.write(
        f"tables: {spent:.1f} s, {study.simulator.calls} calls, {nodes} nodes; products for {DRAWS} data sets: "
        f"{1e3 * limit:.1f} ms\n\n"
        "| hidden | verdict | verdict [s] | of the products | report with checks [s] | of the products |\n"
        "|---|---|---|---|---|---|\n"
    )
    for name, sizes in HIDDEN.items():
        rng = np.random.default_rng(len(name))
        values = [simulate(s, **sizes) * math.exp(NOISE * rng.standard_normal()) for s in walls]
        now = study.replace(measured=values)
        now.diagnose(CAUSES)  # makes the tables of pairs, where they are needed
        once, diagnosis = seconds(lambda now=now: now.diagnose(CAUSES))
        told, _ = seconds(diagnosis.report)
        sys.stdout.write(
            f"| {name} | {diagnosis.kind} | {once:.2f} | {once / limit:.0f} | {told:.2f} | {told / limit:.0f} |\n"
        )
    for pairs in (True, False):
        each, _ = seconds(lambda pairs=pairs: study.rehearse(CAUSES, given.trials, pairs=pairs))
        sys.stdout.write(
            f"\nrehearsal{'' if pairs else ' without pairs'}: {each / given.trials:.2f} s a trial, "
            f"{each / given.trials / limit:.0f} times the products; 200 trials {200 * each / given.trials:.0f} s\n"
        )


if __name__ == "__main__":
    main()
