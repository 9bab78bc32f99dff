"""The U walls' blocks pushed by the airbag: which joints have the source's loads and which do not.

In the DEM the airbag is driven: its load is that of a spring between the top of the facade and an end that moves on
slowly, so that the load falls where the wall gives way. Behind a peak a load that only grows shows inertia, not
resistance. The engine of capacity curves goes from one state of rest to the next instead.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import dem
import limitmason as lm
from dem.model.advance import run as run_steps
from limitmason import experiments
from limitmason.deformable.levels import RIGID, SIMPLY_DEFORMABLE
from limitmason.experiments import murano_u_walls as murano
from limitmason.mechanics.law import above_apex
from limitmason.model.assembly import Assembly
from limitmason.storage.csv_table import parsed, write_table
from mechanisms import light_damage
from validation import murano_micro as micro

from . import at_rest

Array = NDArray[np.float64]

NAME = "murano-u-walls"
POINTS = (3, 3)
STEPS = 24_000

LONG = 240_000
"""Steps where joints are so stiff that failure is over after a hundredth of the way."""

EVERY = 10
"""Steps between two looks at the top."""

BETWEEN = 20
"""Places that are looked at from one state at rest to the next."""

MOST = 3
"""Times the steps asked for after which a push ends."""

SPRING = 0.5
"""Stiffness of the spring over that of the wall."""

AT = (2.0, 5.0, 10.0, 15.0)
"""Displacements of the top at which the load is kept [mm]."""

RISES, TOP = 1.05, 0.98
"""Load at the end over that half-way there, and over the largest, above which a wall is told to rise still [-]."""

STORED = Path(__file__).with_name("pushed.csv")
UNITS = {
    "push": "-", "stiffness": "kN/mm", "light load": "kN", "light displacement": "mm", "peak": "kN", "there": "mm",
    **{f"at {u:g} mm": "kN" for u in AT}, "half-way": "kN", "last": "kN", "rate": "-", "end": "mm", "sides": "-",
    "foot": "-", "limit": "kN", "hull": "kN", "seconds": "s",
}


@dataclass(frozen=True)
class Case:
    """A push: wall, options of the experiment, what joints that can fail have instead, how far, and by what."""

    name: str
    wall: str
    options: Mapping[str, Any]
    law: Mapping[str, Any] = field(default_factory=dict)
    to: float = 18.0
    """Displacement of the top at the end [mm]."""
    steps: int = STEPS
    blocks: str = RIGID
    at_rest: bool = False
    """Whether the engine of capacity curves pushes, not the DEM."""
    grows: float = 0.0
    """Load to which the airbag only grows, as fast as steps say, instead of being driven [kN]."""
    heads: float = 1.0
    """Stiffness of the head joints over that of the source: little where stones only touch after a gap [-]."""


BY_OPENING = {"lost_by": "opening"}
ENERGIES = {"fracture_energy_tension": 12.0, "fracture_energy_shear": 120.0}
"""Of Table 9's macro-model, and ten times as much in shear (assumed) [J/m2]."""

FIRST = {"calibration": "first"}
"""Joints of the source's first step, 100 to 500 times as stiff; masses scale with them, so that walls move less far."""

JOINT = {"ground": "joint"}
LOOSE = {"ground": "no tension"}

CASES = (
    Case("REGW, lost at once", "REGW", {}),
    Case("REGW, lost at once; ground a joint", "REGW", JOINT),
    Case("REGW, lost at once; ground a joint; ten times as slowly", "REGW", JOINT, to=5.0, steps=5 * STEPS),
    Case("REGW, lost at once; ground a joint; stones", "REGW", JOINT, blocks=SIMPLY_DEFORMABLE),
    Case("REGW, lost at once; ground a joint; stones at rest", "REGW", JOINT, to=5.0, blocks=SIMPLY_DEFORMABLE,
         at_rest=True),
    Case("REGW, lost at once; ground without tension", "REGW", LOOSE),
    Case("REGW, lost by opening alone", "REGW", {}, BY_OPENING),
    Case("REGW, lost by opening alone; ground a joint", "REGW", JOINT, BY_OPENING),
    Case("REGW, lost by opening alone; ground a joint; stones", "REGW", JOINT, BY_OPENING, blocks=SIMPLY_DEFORMABLE),
    Case("REGW, lost by opening alone; ground a joint; stones at rest", "REGW", JOINT, BY_OPENING, to=5.0,
         blocks=SIMPLY_DEFORMABLE, at_rest=True),
    Case("REGW, lost by opening alone; ground without tension", "REGW", LOOSE, BY_OPENING),
    Case("REGW, lost by opening alone; ground without tension; stones", "REGW", LOOSE, BY_OPENING,
         blocks=SIMPLY_DEFORMABLE),
    Case("REGW, lost by opening alone; ground without tension; stones at rest", "REGW", LOOSE, BY_OPENING, to=3.0,
         blocks=SIMPLY_DEFORMABLE, at_rest=True),
    Case("REGW, lost by opening alone; ground dry", "REGW", {"ground": "dry"}, BY_OPENING),
    Case("REGW, cohesion kept", "REGW", {"residual": "cohesion"}),
    Case("REGW, cohesion kept; ground a joint", "REGW", {"residual": "cohesion", **JOINT}),
    Case("REGW, lost over energies; ground a joint", "REGW", JOINT, ENERGIES),
    Case("REGW, lost at once, dilatancy 10 degrees", "REGW", {"dilatancy_deg": 10.0}),
    Case("REGW, nothing lost", "REGW", {"residual": "full"}),
    Case("DS", "DS", {}),
    Case("DS, ground a joint", "DS", JOINT),
    Case("DS, head joints a thousandth as stiff", "DS", {}, heads=1e-3),
    Case("REGW step 1, lost at once", "REGW", FIRST, to=0.04),
    Case("REGW step 1, lost by opening alone", "REGW", FIRST, BY_OPENING, to=0.04),
    Case("REGW step 1, lost by opening alone; ground a joint", "REGW", {**JOINT, **FIRST}, BY_OPENING, to=0.04),
    Case("REGW step 1, cohesion kept", "REGW", {"residual": "cohesion", **FIRST}, to=1.0, steps=LONG),
    Case("REGW step 1, cohesion kept; ground a joint", "REGW", {"residual": "cohesion", **JOINT, **FIRST}, to=0.04),
    Case("REGW step 1, nothing lost", "REGW", {"residual": "full", **FIRST}, to=1.0, steps=LONG),
    Case("DS step 1, lost at once", "DS", FIRST, to=1.0, steps=LONG),
    Case("DS step 1, lost by opening alone", "DS", FIRST, BY_OPENING, to=10.0, steps=LONG),
    Case("DS step 1, lost by opening alone; ground a joint", "DS", {**JOINT, **FIRST}, BY_OPENING, to=10.0,
         steps=LONG),
    Case("DS step 1, lost by opening alone; airbag grows by 0.01 kN a step", "DS", FIRST, BY_OPENING, to=10.0,
         steps=10_000, grows=100.0),
    Case("DS step 1, lost by opening alone; airbag grows by 0.0025 kN a step", "DS", FIRST, BY_OPENING, to=10.0,
         steps=40_000, grows=100.0),
    Case("DS step 1, lost over an energy", "DS", FIRST, ENERGIES, to=10.0, steps=LONG),
    Case("DS step 1, nothing lost", "DS", {"residual": "full", **FIRST}, to=10.0, steps=LONG),
    Case("DS step 1, nothing lost; ground a joint", "DS", {"residual": "full", **JOINT, **FIRST}, to=10.0, steps=LONG),
)


class Pushed(NamedTuple):
    """What is kept of a push, in kN and mm.

    ``at`` are the loads at ``AT``, NaN beyond the end, ``half`` and ``last`` those half-way to the end and there;
    ``rate`` is the mean difference of the airbag's load and the ground's reaction over the peak, 0 of a wall at rest
    throughout; ``sides`` and ``foot`` are the movement of the side walls' tops and of the facade's lowest course over
    that of the facade's top at mid-span, at the end; ``limit`` is the associative multiplier of limit analysis (nothing
    lost), ``hull`` that of :func:`hull`, NaN where it is the same.
    """

    stiffness: float
    light: tuple[float, float]
    peak: tuple[float, float]
    at: tuple[float, ...]
    half: float
    last: float
    rate: float
    end: float
    sides: float
    foot: float
    limit: float
    hull: float
    seconds: float

    @property
    def mechanism(self) -> str:
        """In words, by what moves with the facade's top."""
        found = "turns over in one" if self.sides > 0.5 else "facade off its side walls"
        if self.foot > 0.5:
            found = "slides on the ground"
        rising = self.last > max(RISES * self.half, TOP * self.peak[0])
        return found + (", still rising" if rising else "")


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
    if case.heads != 1.0:
        wall = wall.with_joints(
            lambda j: replace(j, normal_stiffness=case.heads * j.normal_stiffness,
                              shear_stiffness=case.heads * j.shear_stiffness),
            kinds=("head",),
        )
    return test, wall


def hull(wall: Assembly) -> Assembly:
    """The wall with the smallest convex law around the DEM's: |T| <= tan(phi) (N + ft) where ft lies above the apex.

    The DEM's law there is the Coulomb cone and tension without shear beyond its apex, which is not convex. By the
    static theorem the associative multiplier of the hull is an upper bound of what the DEM's law can carry as built.
    """
    above = above_apex(wall.arrays)
    return wall.with_interfaces(
        replace(i, joint=replace(i.joint, cohesion=i.joint.tan_phi * i.joint.tensile_strength)) if up else i
        for i, up in zip(wall.interfaces, above, strict=True)
    )


class Trace(NamedTuple):
    """Displacement of the top [mm] and load, evened out [kN], movement of every block [m], rate error as in Pushed."""

    displacement: Array
    load: Array
    moved: Array
    rate: float


def followed(case: Case, progress: Callable[[str], None] | None = None) -> Trace:
    """Settle and push."""
    test, wall = model(case)
    if progress:
        progress(f"{case.name} ...")
    loads, top = test.loads(), murano.control_block(test)
    if case.at_rest:
        found = at_rest.followed(test, wall, case.blocks, case.to, progress)
        # states are few while nothing happens: the chords between them are looked at
        states = np.arange(len(found.load))
        fine = np.linspace(0.0, states[-1], BETWEEN * int(states[-1]) + 1)
        u, even = (np.interp(fine, states, v) for v in (found.displacement, found.load))
        return Trace(u, even, found.moved, float("nan"))
    stones = wall.with_material(micro.STONE) if case.blocks == SIMPLY_DEFORMABLE else wall
    settled = dem.simulate(stones, dem.Settle(tolerance=1e-5), loads=loads, contact_points=POINTS, blocks=case.blocks)
    state = settled.state.copy()
    if case.grows:
        u, load, reaction = grown(state, loads, top, wall.fixed, case.to, case.grows / case.steps)
    else:
        u, load, reaction = driven(state, loads, top, wall.fixed, case.to, case.steps)
    even = np.convolve(np.pad(load, 15, mode="edge"), np.full(31, 1.0 / 31.0), mode="valid")
    moved = settled.state.bodies.shift[:, 1] - state.bodies.shift[:, 1]
    return Trace(u, even, moved, float(np.abs(load - reaction).mean() / load.max()))


def run(case: Case, progress: Callable[[str], None] | None = None) -> Pushed:
    """What is kept of a push."""
    begun = time.process_time()
    u, even, moved, rate = followed(case, progress)
    test, wall = model(case)
    loads, top = test.loads(), murano.control_block(test)
    facade = ~wall.fixed & (wall.centroids[:, 1] < 0.3)
    low = facade & (wall.centroids[:, 2] < 0.225)
    sides = ~wall.fixed & (wall.centroids[:, 1] > 0.6) & (wall.centroids[:, 2] > 1.125)
    k = int(even.argmax())
    stiffness, light = stiffness_and_light_damage(u, even)
    first = [int(np.argmax(u >= at)) if u.max() >= at else None for at in (*AT, 0.5 * u.max())]
    at = [float("nan") if i is None else float(even[i]) for i in first]
    limit, around = (float(lm.limit_analysis(w, loads).collapse_multiplier) for w in (wall, hull(wall)))
    return Pushed(
        stiffness, light, (float(even[k]), float(u[k])), tuple(at[:-1]), at[-1], float(even[-1]), rate, float(u[-1]),
        float(moved[sides].mean() / moved[top]), float(moved[low].mean() / moved[top]), limit,
        around if above_apex(wall.arrays).any() else float("nan"), time.process_time() - begun,
    )


def driven(
    state: dem.State, loads: lm.Loads, top: int, held: NDArray[np.bool_], to: float, steps: int = STEPS
) -> tuple[Array, Array, Array]:
    """Displacement of the top [mm], load of the airbag and reaction of the ground [kN] as a state is pushed.

    load = k (a - u), a growing with the square of the steps: slowly while the wall is stiff. k is half the wall's
    stiffness, from what the first step along ``a`` moves.

    Parameters
    ----------
    state : at rest under the dead loads; is moved on
    loads : the live ones are 1 kN of airbag
    top, held : number of the stone whose movement along -y is u, blocks that are held
    to : of u at the end [mm]
    steps : in which ``a`` comes to it; u does later, the more the wall carries, after at most three times as many
    """
    cases = np.stack([loads.dead, loads.live])
    brake = dem.Damping(local=0.5, combined=True)  # local damping alone drags on what slides
    zero, n = state.bodies.shift[top, 1], steps // EVERY
    # stiffness from a small load, held for a while on a copy
    probe, small = state.copy(), 0.1
    run_steps(probe, cases, np.column_stack([np.ones(2000), np.full(2000, small)]), brake)
    spring = SPRING * small / (1e3 * (zero - probe.bodies.shift[top, 1]))
    u, load, reaction = np.zeros((3, MOST * n))
    before, moved, i = 0.0, 0.0, 0
    while moved < to and i < MOST * n:
        now = max(spring * (to * ((i + 1) / n) ** 2 - moved), 0.0)
        ramp = np.linspace(before, now, EVERY + 1)[1:]
        run_steps(state, cases, np.column_stack([np.ones(EVERY), ramp]), brake)
        moved = 1e3 * (zero - state.bodies.shift[top, 1])
        u[i], load[i], before = moved, now, now
        reaction[i] = -1e-3 * float(state.bodies.net[held, 1].sum())
        i += 1
    return u[:i], load[:i], reaction[:i]


def grown(
    state: dem.State, loads: lm.Loads, top: int, held: NDArray[np.bool_], to: float, pace: float
) -> tuple[Array, Array, Array]:
    """The same as :func:`driven` under an airbag whose load only grows, by ``pace`` a step [kN]."""
    cases, brake, zero = np.stack([loads.dead, loads.live]), dem.Damping(local=0.5), state.bodies.shift[top, 1]
    rows: list[tuple[float, float, float]] = []
    while not rows or rows[-1][0] < to:
        before = rows[-1][1] if rows else 0.0
        ramp = before + pace * np.arange(1, EVERY + 1)
        run_steps(state, cases, np.column_stack([np.ones(EVERY), ramp]), brake)
        reaction = -1e-3 * float(state.bodies.net[held, 1].sum())
        rows.append((1e3 * float(zero - state.bodies.shift[top, 1]), float(ramp[-1]), reaction))
    u, load, reactions = np.array(rows).T
    return u, load, reactions


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
        numbers = (
            p.stiffness, *p.light, *p.peak, *p.at, p.half, p.last, p.rate, p.end, p.sides, p.foot, p.limit, p.hull,
            p.seconds,
        )
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
