"""Push-over of REGW to 6 mm on bricks of several sizes, with what a path cost and how well it is in balance."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from limitmason import experiments
from limitmason.continuum import load_curve, push
from limitmason.display.text_table import markdown
from limitmason.experiments.murano_u_walls import NAME
from limitmason.storage.csv_table import parsed, write_table
from validation import murano_macro as macro

STORED = Path(__file__).with_name("whole.csv")
UNITS = {
    "size": "m", "bricks": "-", "stiffness": "kN/mm", "peak": "kN", "there": "mm", "end": "kN", "at": "mm",
    "jumps": "-", "iterations": "-", "in jumps": "-", "residual": "-", "energy": "-", "seconds": "s",
}
FAR = 6e-3
"""Displacement up to which the wall is pushed [m]."""


def make(size: float, progress: Callable[[str], object], folder: Path | None = None) -> None:
    """Push REGW on bricks of a size [m] and keep a row; states are kept in a folder, and gone on from where there.

    A path that was stopped and gone on from has the seconds of both, from the file beside its states.
    """
    test = experiments.load(NAME, "REGW")
    model = macro.macro_model(test, size=size)
    file = None if folder is None else folder / f"REGW_{size:g}_{FAR:g}.npz"
    clock = None if file is None else file.with_suffix(".seconds")
    start = load_curve(file, model) if file is not None and file.is_file() else None
    spent = float(clock.read_text()) if clock is not None and clock.is_file() and start is not None else 0.0
    begun = time.process_time()

    def say(line: str) -> None:
        progress(line)
        if clock is not None and file is not None and file.is_file():
            clock.write_text(f"{spent + time.process_time() - begun:.1f}")

    done = 0.0 if start is None else float(start.displacement[-1])
    curve = start if start is not None and FAR - done < 1e-9 else push(
        model, control=(macro.control_point(test), (0.0, -1.0, 0.0)), to=FAR, first=2e-5, largest=FAR / 25.0,
        start=start, checkpoint=file, progress=say,
    )
    jumps = [n for n in curve.nodes if n.jump]
    assert curve.energy is not None
    row = [
        size, len(model.mesh), 1e-6 * float(curve.load[1] / curve.displacement[1]), curve.peak.load / 1e3,
        1e3 * curve.peak.displacement, float(curve.load[-1]) / 1e3, 1e3 * float(curve.displacement[-1]), len(jumps),
        sum(n.iterations for n in curve.nodes), sum(n.iterations for n in jumps), float(curve.residual.max()),
        float(np.abs(curve.energy.error).max()), spent + time.process_time() - begun,
    ]
    rows = sorted([*(r for r in read() if r[0] != size), row], reverse=True)
    write_table(STORED, UNITS, [[f"{v:.5g}" for v in r] for r in rows])


def read() -> list[list[float]]:
    """What is kept, row by row, coarse bricks first."""
    if not STORED.is_file():
        return []
    rows = parsed(STORED.read_text(encoding="utf-8"), STORED.name).rows
    return [[float(c) for c in cells] for cells in rows]


def table() -> list[str]:
    """Peak, end, jumps, balance and seconds by the size of the bricks."""
    out = [["bricks", "stiffness [kN/mm]", "peak [kN, mm]", "at the end", "jumps", "iterations, in jumps", "residual",
            "energy left over", "seconds"]]
    for size, bricks, stiffness, peak, there, end, at, jumps, iterations, inside, residual, energy, seconds in read():
        out.append([
            f"{size:.2f} m, {bricks:.0f}", f"{stiffness:.2f}", f"{peak:.2f}, {there:.2f}",
            f"{end:.2f} kN at {at:.2f} mm", f"{jumps:.0f}",
            f"{iterations:.0f}, {inside:.0f}", f"{residual:.0e}", f"{energy:.1%}", f"{seconds:.0f}",
        ])
    return markdown(out)
