"""Modes of the U walls identified from what the DEM records under white noise at its base, before and after a push.

The source did the same in 3DEC: 100 s between 0 and 30 Hz, frequency-domain decomposition and subspace identification.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import dem
import limitmason as lm
from limitmason import experiments
from limitmason.experiments import murano_u_walls as murano
from limitmason.experiments.experiment import Experiment
from limitmason.model.assembly import Assembly
from limitmason.storage.csv_table import parsed, write_table

Array = NDArray[np.float64]

NAME = "murano-u-walls"
POINTS = (3, 3)
DAMPING = 0.01
"""Of the first mode by the joints' dashpots; assumed, the source names none."""

STEP = 0.004
"""Between two samples of the record [s]: 250 Hz."""

HOLDS = 2e6
"""Cohesion and tensile strength of joints that are made to hold [Pa]."""

METHODS = {"fdd": 6, "ssi": 6}
"""Modes asked for; what is no mode of the wall is recognised by its shape."""

TANGENT = "tangent"
"""Name under which the modes of the state before the noise are kept beside those of the methods."""

MODES = Path(__file__).with_name("identified.csv")
RUNS = Path(__file__).with_name("identified_runs.csv")
MODE_UNITS = {"run": "-", "method": "-", "frequency": "Hz", "damping": "-", "shape": "-"}
RUN_UNITS = {
    "run": "-", "closed": "Hz", "tangent": "Hz", "points": "-", "open": "-", "broken": "-", "moved": "mm",
    "left": "mm", "seconds": "s",
}


@dataclass(frozen=True)
class Case:
    """A record to identify: wall, what its joints and its past are, noise at the base."""

    name: str
    wall: str
    highest: float
    """End of the band [Hz]."""
    seconds: float
    rms: float
    """Of the base's acceleration [m/s2]."""
    holds: bool = False
    """Whether joints hold whatever comes."""
    pushed: float = 0.0
    """Load of the airbag before, taken off again [kN]."""


CASES = (
    Case("REGW", "REGW", 45.0, 30.0, 0.05),
    Case("DS", "DS", 30.0, 30.0, 0.05),
    Case("REGW after 44 kN", "REGW", 45.0, 18.0, 0.02, pushed=44.0),
    Case("DS, joints that hold", "DS", 30.0, 18.0, 0.05, holds=True),
    Case("DS, a tenth of the noise", "DS", 30.0, 18.0, 0.005),
    Case("REGW, 0 to 30 Hz", "REGW", 30.0, 18.0, 0.05),
)


class Run(NamedTuple):
    """What is kept of a run beside its modes: frequencies [Hz], contact points, movement [mm], seconds of a core.

    ``closed`` are the modes of closed joints, ``tangent`` those of the state before the noise, ``moved`` the largest
    displacement against the base under noise, ``left`` the top's displacement that the push has left.
    """

    closed: Array
    tangent: Array
    points: int
    open: int
    broken: int
    moved: float
    left: float
    seconds: float


class Found(NamedTuple):
    """Modes of a run by one method: frequency [Hz], damping [-], shape at the channels."""

    frequency: Array
    damping: Array
    shape: Array


def channels(wall: Assembly) -> list[tuple[int, str]]:
    """Facade at three heights across the wall, side walls at two heights sideways: stones and directions."""
    facade = [(x, 0.0, z) for x in (0.30, 0.85, 1.125, 1.40, 1.95) for z in (0.56, 1.01, 1.24)]
    sides = [(x, y, z) for x in (0.10, 2.15) for y in (0.55, 0.90) for z in (0.56, 1.24)]
    bounds = np.array([b.bounds for b in wall.blocks])
    out = []
    for places, axis in ((facade, "y"), (sides, "x")):
        for p in places:
            inside = ((bounds[:, 0] <= np.array(p) + 1e-9) & (np.array(p) <= bounds[:, 1] + 1e-9)).all(axis=1)
            out.append((int(np.flatnonzero(inside & ~wall.fixed)[0]), axis))
    return out


def at_channels(modes: Any, wall: Assembly, where: Sequence[tuple[int, str]]) -> Array:
    """Shapes of computed modes, of any model of the wall, at the channels, shape (modes, channels)."""
    moved = modes.at(wall.centroids[[block for block, _ in where]])
    return np.asarray(moved[:, np.arange(len(where)), ["xyz".index(axis) for _, axis in where]])


def model(case: Case) -> tuple[Experiment, Assembly]:
    """The experiment of a case and its blocks."""
    test = experiments.load(NAME, case.wall)
    wall = test.assembly()
    if case.holds:
        firm = {"cohesion": HOLDS, "tensile_strength": HOLDS}
        wall = wall.with_interfaces(replace(i, joint=replace(i.joint, **firm)) for i in wall.interfaces)
    return test, wall


def before(case: Case, progress: Callable[[str], None]) -> tuple[dem.History, float]:
    """The wall at rest, pushed and let go where the case says so, and what the push has left at the top [mm]."""
    test, wall = model(case)
    first = lm.modes(wall, 1, contact_points=POINTS).frequency[0]
    joints = dem.JointOptions(dashpot=2.0 * DAMPING / (2.0 * np.pi * first))
    calm = dem.Settle(damping=dem.Damping(local=0.8), tolerance=1e-6, max_steps=40_000)
    state = dem.simulate(
        wall, calm, loads=test.loads(), mode="dynamic", contact_points=POINTS, detect_every=None, joint_options=joints,
    )
    top = murano.control_block(test)
    stood = state.shift[-1, top, 1]
    if case.pushed:
        progress(f"{case.name}: pushed to {case.pushed:g} kN and let go ...")
        brake = dem.Damping(local=0.5)
        up = dem.Ramp(to=case.pushed, duration=1.0, damping=brake)
        down = dem.Ramp(to=0.0, duration=1.0, damping=brake)
        state = dem.simulate(wall, [up, down, calm], loads=test.loads(), start=state, detect_every=None)
    return state, 1e3 * float(stood - state.shift[-1, top, 1])


def of_state(state: dem.History, wall: Assembly) -> Found:
    """Modes of the tangent of a state, as they would be seen at the channels."""
    own = lm.modes(state, 4)
    return Found(own.frequency, np.full(4, np.nan), at_channels(own, wall, channels(wall)))


def run(case: Case, progress: Callable[[str], None]) -> tuple[Run, dict[str, Found]]:
    """Settle, push and let go, shake, identify."""
    test, wall = model(case)
    begun = time.process_time()
    state, left = before(case, progress)
    progress(f"{case.name}: {case.seconds:g} s of white noise up to {case.highest:g} Hz ...")
    base = dem.white_noise(case.seconds, rms=case.rms, highest=case.highest, direction=(1.0, 1.0, 0.0), seed=1)
    sample = max(1, round(STEP / state.state.dt))
    history = dem.simulate(wall, base, loads=test.loads(), start=state, sample=sample, detect_every=None)
    where, found = channels(wall), {TANGENT: of_state(state, wall)}
    lines = 2048 if case.seconds >= 30.0 else 1024  # so that several segments are averaged
    for method, count in METHODS.items():
        modes = dem.identify(
            history, where, method=method, count=count, band=(8.0, 1.1 * case.highest), skip=1.0, lines=lines, order=30
        )
        # in phase with the largest component
        found[method] = Found(modes.frequency, modes.damping, np.real(modes.shape))
    force = np.linalg.norm(state.state.measured(wall).force, axis=1)
    damage = history.state.points.damage
    ground = int(np.flatnonzero(wall.fixed)[0])
    moved = np.abs(history.shift - history.shift[:, [ground]] - (state.shift[-1] - state.shift[-1, ground]))
    kept = Run(
        lm.modes(wall, 4, contact_points=POINTS).frequency, found[TANGENT].frequency, len(damage),
        int((force <= 1e-9 * force.max()).sum()), int((damage > 0.5).sum()), 1e3 * float(moved.max()), left,
        time.process_time() - begun,
    )
    return kept, found


def write(kept: Mapping[str, tuple[Run, Mapping[str, Found]]]) -> None:
    """Write the kept lines, a run and its modes by method; lists stand in one cell, separated by spaces."""
    write_table(RUNS, RUN_UNITS, [[name, *(_cell(v) for v in run)] for name, (run, _) in kept.items()])
    lines = [
        [name, method, f"{f:.5g}", "" if np.isnan(d) else f"{d:.4g}", _cell(s)]
        for name, (_, modes) in kept.items() for method, found in sorted(modes.items())
        for f, d, s in zip(*found, strict=True)
    ]
    write_table(MODES, MODE_UNITS, lines)


def read() -> dict[str, tuple[Run, dict[str, Found]]]:
    """What is kept, by run: numbers, and modes by method."""
    runs, modes = tables()
    return {name: (run, {m: f for (n, m), f in modes.items() if n == name}) for name, run in runs.items()}


def tables() -> tuple[dict[str, Run], dict[tuple[str, str], Found]]:
    """The same by run, and by run and method."""
    runs: dict[str, Run] = {}
    gathered: dict[tuple[str, str], list[tuple[float, float, Array]]] = {}
    if RUNS.is_file():
        for cells in parsed(RUNS.read_text(encoding="utf-8"), RUNS.name).rows:
            numbers = [_numbers(c) for c in cells[1:3]]
            counts = [int(c) for c in cells[3:6]]
            runs[cells[0]] = Run(numbers[0], numbers[1], *counts, *(float(c) for c in cells[6:]))
        for cells in parsed(MODES.read_text(encoding="utf-8"), MODES.name).rows:
            damping = float(cells[3]) if cells[3] else float("nan")
            gathered.setdefault((cells[0], cells[1]), []).append((float(cells[2]), damping, _numbers(cells[4])))
    return runs, {key: Found(*(np.array(c) for c in zip(*own, strict=True))) for key, own in gathered.items()}


def _cell(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return " ".join(f"{v:.5g}" for v in value)
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _numbers(cell: str) -> Array:
    return np.array([float(v) for v in cell.split()])
