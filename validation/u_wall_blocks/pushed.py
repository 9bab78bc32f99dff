"""The U walls' rigid blocks pushed by the airbag in the DEM: which joints have the source's loads and which do not.

The airbag is driven: its load is that of a spring between the top of the facade and an end that moves on slowly, so
that the load falls where the wall gives way. Behind a peak a load that only grows shows inertia, not resistance.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import dem
import limitmason as lm
from dem.stepping import run as run_steps
from limitmason import experiments
from limitmason.csv_table import parsed, write_table
from limitmason.experiments import murano_u_walls as murano
from limitmason.model.assembly import Assembly
from mechanisms import light_damage

Array = NDArray[np.float64]

NAME = "murano-u-walls"
POINTS = (3, 3)
STEPS = 24_000
EVERY = 10
"""Steps between two looks at the top."""

SPRING = 0.5
"""Stiffness of the spring over that of the wall."""

AT = (2.0, 5.0, 10.0, 15.0)
"""Displacements of the top at which the load is kept [mm]."""

STORED = Path(__file__).with_name("pushed.csv")
UNITS = {
    "push": "-", "stiffness": "kN/mm", "light load": "kN", "light displacement": "mm", "peak": "kN", "there": "mm",
    **{f"at {u:g} mm": "kN" for u in AT}, "rate": "-", "end": "mm", "sides": "-", "foot": "-", "limit": "kN",
    "seconds": "s",
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A push: wall, options of the experiment, what joints that can fail have instead, and how far."""

    name: str
    wall: str
    options: Mapping[str, Any]
    law: Mapping[str, Any] = field(default_factory=dict)
    to: float = 18.0
    """Displacement of the top at the end, about [mm]."""


BY_OPENING = {"lost_by": "opening"}
ENERGIES = {"fracture_energy_tension": 12.0, "fracture_energy_shear": 120.0}
"""Of Table 9's macro-model, and ten times as much in shear (assumed) [J/m2]."""

FIRST = {"calibration": "first"}
"""Joints of the source's first step, 100 to 500 times as stiff; masses scale with them, so that walls move less far."""

CASES = (
    Case("REGW, lost at once", "REGW", {}),
    Case("REGW, lost at once; ground a joint", "REGW", {"ground": "joint"}),
    Case("REGW, lost by opening alone", "REGW", {}, BY_OPENING),
    Case("REGW, lost by opening alone; ground a joint", "REGW", {"ground": "joint"}, BY_OPENING),
    Case("REGW, cohesion kept", "REGW", {"residual": "cohesion"}),
    Case("REGW, cohesion kept; ground a joint", "REGW", {"residual": "cohesion", "ground": "joint"}),
    Case("REGW, lost over energies; ground a joint", "REGW", {"ground": "joint"}, ENERGIES),
    Case("REGW, lost at once, dilatancy 10 degrees", "REGW", {"dilatancy_deg": 10.0}),
    Case("REGW, nothing lost", "REGW", {"residual": "full"}),
    Case("DS", "DS", {}),
    Case("DS, ground a joint", "DS", {"ground": "joint"}),
    Case("REGW step 1, lost at once", "REGW", FIRST, to=0.04),
    Case("REGW step 1, cohesion kept; ground a joint", "REGW", {"residual": "cohesion", "ground": "joint", **FIRST},
         to=0.04),
    Case("REGW step 1, nothing lost", "REGW", {"residual": "full", **FIRST}, to=0.04),
    Case("DS step 1, lost at once", "DS", FIRST, to=0.1),
    Case("DS step 1, cohesion kept; ground a joint", "DS", {"residual": "cohesion", "ground": "joint", **FIRST},
         to=0.1),
    Case("DS step 1, nothing lost", "DS", {"residual": "full", **FIRST}, to=0.1),
)  # fmt: skip


class Pushed(NamedTuple):
    """What is kept of a push, in kN and mm.

    ``at`` are the loads at ``AT``, NaN beyond the end; ``rate`` is the mean difference of the airbag's load and the
    ground's reaction over the peak, 0 of a wall at rest throughout; ``sides`` and ``foot`` are the movement of the side
    walls' tops and of the facade's lowest course over that of the facade's top at mid-span, at the end; ``limit`` is
    the associative multiplier of limit analysis (nothing lost).
    """

    stiffness: float
    light: tuple[float, float]
    peak: tuple[float, float]
    at: tuple[float, ...]
    rate: float
    end: float
    sides: float
    foot: float
    limit: float
    seconds: float

    @property
    def mechanism(self) -> str:
        """In words, by what moves with the facade's top."""
        if self.foot > 0.5:
            return "slides on the ground"
        return "turns over in one" if self.sides > 0.5 else "facade off its side walls"


def model(case: Case) -> tuple[Any, Assembly]:
    """The experiment of a case and its blocks."""
    test = experiments.load(NAME, case.wall, **case.options)
    wall = test.assembly()
    if case.law:
        # what is bonded to the ground has nothing to lose
        wall = wall.with_interfaces(
            i if i.joint.residual_tensile_strength is None else replace(i, joint=replace(i.joint, **case.law))
            for i in wall.interfaces
        )
    return test, wall


def run(case: Case, progress: Callable[[str], object] | None = None) -> Pushed:
    """Settle and push."""
    test, wall = model(case)
    if progress:
        progress(f"{case.name} ...")
    begun = time.process_time()
    loads, top = test.loads(), murano.control_block(test)
    settled = dem.simulate(wall, dem.Settle(tolerance=1e-5), loads=loads, contact_points=POINTS)
    state = settled.state.copy()
    u, load, reaction = driven(state, loads, top, wall.fixed, case.to)
    moved = settled.state.bodies.shift[:, 1] - state.bodies.shift[:, 1]
    facade = ~wall.fixed & (wall.centroids[:, 1] < 0.3)
    low = facade & (wall.centroids[:, 2] < 0.225)
    sides = ~wall.fixed & (wall.centroids[:, 1] > 0.6) & (wall.centroids[:, 2] > 1.125)
    rate = float(np.abs(load - reaction).mean() / load.max())
    even = np.convolve(np.pad(load, 15, mode="edge"), np.full(31, 1.0 / 31.0), mode="valid")
    k = int(even.argmax())
    stiffness, light = stiffness_and_light_damage(u, even)
    first = [int(np.argmax(u >= at)) if u.max() >= at else None for at in AT]
    return Pushed(
        stiffness, light, (float(even[k]), float(u[k])),
        tuple(float("nan") if i is None else float(even[i]) for i in first), rate, float(u[-1]),
        float(moved[sides].mean() / moved[top]), float(moved[low].mean() / moved[top]),
        float(lm.limit_analysis(wall, loads).collapse_multiplier), time.process_time() - begun,
    )  # fmt: skip


def driven(
    state: dem.State, loads: lm.Loads, top: int, held: NDArray[np.bool_], to: float
) -> tuple[Array, Array, Array]:
    """Displacement of the top [mm], load of the airbag and reaction of the ground [kN] as a state is pushed.

    load = k (a - u), a growing with the square of the steps: slowly while the wall is stiff. k is half the wall's
    stiffness, from what the first step along ``a`` moves.

    Parameters
    ----------
    state : at rest under the dead loads; is moved on
    loads : the live ones are 1 kN of airbag
    top, held : number of the stone whose movement along -y is u, blocks that are held
    to : of u at the end, where the load has come to little [mm]
    """
    cases = np.stack([loads.dead, loads.live])
    brake = dem.Damping(local=0.5, combined=True)  # local damping alone drags on what slides
    zero, n = state.bodies.shift[top, 1], STEPS // EVERY
    # stiffness from a small load, held for a while on a copy
    probe, small = state.copy(), 0.1
    run_steps(probe, cases, np.column_stack([np.ones(2000), np.full(2000, small)]), brake)
    spring = SPRING * small / (1e3 * (zero - probe.bodies.shift[top, 1]))
    u, load, reaction = np.zeros((3, n))
    before = 0.0
    for i in range(n):
        moved = 1e3 * (zero - state.bodies.shift[top, 1])
        now = max(spring * (to * ((i + 1) / n) ** 2 - moved), 0.0)
        ramp = np.linspace(before, now, EVERY + 1)[1:]
        run_steps(state, cases, np.column_stack([np.ones(EVERY), ramp]), brake)
        u[i], load[i], before = 1e3 * (zero - state.bodies.shift[top, 1]), now, now
        reaction[i] = -1e-3 * float(state.bodies.net[held, 1].sum())
    return u, load, reaction


def stiffness_and_light_damage(u: Array, load: Array) -> tuple[float, tuple[float, float]]:
    """Slope between 5 and 15 % of the peak, and load and displacement at which the secant is 2 % below it.

    Parameters
    ----------
    u : at the top, from the state under dead load [mm]
    load : of the airbag [kN]
    """
    most = float(load.max())
    rising = np.arange(len(u)) <= load.argmax()
    early = rising & (load > 0.05 * most) & (load < 0.15 * most)
    slope = float(load[early] @ u[early] / (u[early] @ u[early]))
    # a wall that sways forth and back: from one largest displacement to the next
    on = u > np.maximum.accumulate(np.concatenate([[0.0], u[:-1]]))
    on &= load > 0.05 * most
    found = light_damage(np.append(0.0, u[on]), np.append(0.0, load[on]), initial_stiffness=slope)
    return slope, (found.load, found.displacement)


def write(pushes: Mapping[str, Pushed]) -> None:
    """Write the kept lines."""
    lines = []
    for name, p in pushes.items():
        numbers = (p.stiffness, *p.light, *p.peak, *p.at, p.rate, p.end, p.sides, p.foot, p.limit, p.seconds)
        lines.append([name, *("" if np.isnan(v) else f"{v:.5g}" for v in numbers)])
    write_table(STORED, UNITS, lines)


def read() -> dict[str, Pushed]:
    """What is kept, by name."""
    found = {}
    if STORED.is_file():
        for cells in parsed(STORED.read_text(encoding="utf-8"), STORED.name).rows:
            v = [float(c) if c else float("nan") for c in cells[1:]]
            n = 5 + len(AT)
            found[cells[0]] = Pushed(v[0], (v[1], v[2]), (v[3], v[4]), tuple(v[5:n]), *v[n:])
    return found


def make(names: Sequence[str], progress: Callable[[str], object]) -> None:
    """Make pushes by name, all that are missing without names, and keep each as soon as it is there."""
    order = [c.name for c in CASES]
    for case in CASES:
        kept = read()
        if case.name in names or (not names and case.name not in kept):
            kept[case.name] = run(case, progress)
            write({n: kept[n] for n in sorted(kept, key=order.index)})
