"""What an iteration of the macro-model costs as bricks grow in number, each mesh measured in a process of its own.

Processor seconds of one thread. "Sparse factor" is scipy's SuperLU in the same order of elimination without exchanges,
measured in the same process: the factor of version 0.1.
"""

import multiprocessing
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import splu

import limitmason as lm
from limitmason import experiments
from limitmason.continuum.equilibrium import Solver
from limitmason.continuum.rotating_crack import virgin
from limitmason.display.text_table import filled, markdown
from limitmason.experiments.murano_u_walls import NAME
from limitmason.storage.csv_table import parsed, write_table
from validation import murano_macro as macro

from . import readings, whole

TEXT = """### What an iteration takes

The first iteration of REGW, all elastic, in seconds of one core of a busy machine, each mesh in a process of its own.
The sparse factor beside is SuperLU's in the same order of elimination, without exchanges, in the same process.

[cost]

Between the two largest meshes the factor grows with the power {factor:.1f} of the number of bricks, the rest with
{rest:.1f}, memory with {memory:.1f}. Points that have cracked take ten times the law of elastic ones. A step that comes
no nearer works it out four times. With a third of the points of 450 bricks damaged the law takes 0.03 s. The solution
is that of modes; in a push it is corrected once and takes twice as long. A whole path of REGW:

[whole]

The first is that of the table of push-overs, the second on the source's size of bricks. The readings below take steps
of 0.05 mm. In these the peak on 0.15 m is {fine:.2f} kN, {apart:.1%} higher. Peaks move by 1 to 2 % with the steps.
"""
STORED = Path(__file__).with_name("cost.csv")
UNITS = {
    "size": "m", "bricks": "-", "unknowns": "-", "law": "s", "stiffness": "s", "factor": "s", "solution": "s",
    "memory": "MB", "modes": "s", "sparse factor": "s",
}
SIZES = (0.15, 0.10, 0.0675, 0.045)
LARGEST = 6000
"""Bricks up to which modes and, beside, the sparse factor are measured: that takes the square of their number."""


def measure(size: float) -> list[float]:
    """A row of the table: one elastic iteration of REGW, memory up to its end, three modes, the sparse factor."""
    test = experiments.load(NAME, "REGW")
    model = macro.macro_model(test, size=size)
    d = model.discretisation
    solver = Solver(model, model.functional(macro.control_point(test), (0.0, -1.0, 0.0)), 1e-3)
    nothing, memory = np.zeros(len(solver.dead)), virgin(len(solver.curves.modulus))
    marks = [time.process_time()]

    def mark() -> None:
        marks.append(time.process_time())

    unknowns = len(d.order)
    mark()
    now = solver.answer(nothing, memory)
    right = solver.unbalanced(now, 0.0)
    mark()
    values = d.stiffness(now.tangent.reshape(len(model.mesh), -1, 6, 6))
    mark()
    factor = d.factor(values)
    mark()
    factor.solve(np.column_stack([right, solver.live_row]))
    mark()
    peak = _memory()
    _, law, stiffness, eliminated, solved = np.diff(marks)
    del factor, now, memory
    modes = sparse = np.nan
    if len(model.mesh) <= LARGEST:
        matrix = d.assembled(values)
        begun = time.process_time()
        splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        sparse = time.process_time() - begun
        fresh = macro.macro_model(test, size=size)
        begun = time.process_time()
        lm.modes(fresh, 3)
        modes = time.process_time() - begun
    return [size, len(model.mesh), unknowns, law, stiffness, eliminated, solved, peak, modes, sparse]


def _memory() -> float:
    """Largest memory this process has held [MB], nan where the system does not say."""
    if sys.platform == "win32":
        return float("nan")
    import resource  # not on Windows

    unit = 1e6 if sys.platform == "darwin" else 1e3  # bytes there, elsewhere kB
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def make(progress: Callable[[str], object]) -> None:
    """Measure every size that is missing and keep it."""
    rows = read()
    for size in SIZES:
        if size not in [r[0] for r in rows]:
            progress(f"bricks of {size:g} m ...")
            with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
                rows.append(pool.submit(measure, size).result())
            write_table(STORED, UNITS, [["" if np.isnan(v) else f"{v:.6g}" for v in r] for r in rows])


def read() -> list[list[float]]:
    """What is kept, row by row."""
    if not STORED.is_file():
        return []
    rows = parsed(STORED.read_text(encoding="utf-8"), STORED.name).rows
    return [[float(c) if c else np.nan for c in cells] for cells in rows]


def growth() -> dict[str, float]:
    """Exponents at which the factor, the rest and memory grow with the number of bricks, over the largest two."""
    a, b = read()[-2:]
    parts = {"factor": (5,), "rest": (3, 4, 6), "memory": (7,)}
    return {
        k: float(np.log(sum(b[i] for i in at) / sum(a[i] for i in at)) / np.log(b[1] / a[1])) for k, at in parts.items()
    }


def steps() -> dict[str, float]:
    """Peak of REGW on bricks of 0.15 m in the steps of the readings [kN], and how far above the path's [-]."""
    fine = readings.read()["bricks of 0.15 m", "REGW"].load
    path = next(r[3] for r in whole.read() if r[0] == 0.15)
    return {"fine": fine, "apart": fine / path - 1.0}


def table() -> list[str]:
    """Seconds of an iteration and what it is made of, memory, modes."""
    head = ["bricks", "unknowns", "law [s]", "stiffness [s]", "factor [s]", "solution [s]", "iteration [s]",
            "memory [MB]", "three modes [s]", "sparse factor [s]", "over the factor"]
    out = [head]
    for _size, bricks, unknowns, law, stiffness, factor, solution, memory, modes, sparse in read():
        parts = [law, stiffness, factor, solution, law + stiffness + factor + solution]
        beside = ["not run"] * 3 if np.isnan(sparse) else [f"{modes:.1f}", f"{sparse:.2f}", f"{sparse / factor:.1f}"]
        out.append([f"{bricks:.0f}", f"{unknowns:.0f}", *(f"{v:.2f}" for v in parts), f"{memory:.0f}", *beside])
    return markdown(out)


def section() -> list[str]:
    """The section of the page, in lines."""
    tables = {"cost": table(), "whole": whole.table()}
    return filled(TEXT.format(**growth(), **steps()), tables).splitlines()
