"""Which points of the U walls' joints give way first, and at what load: in the DEM and in the micro-model.

Until the first does, the joints are springs: every force is that under dead load and so much per kN.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import dem
from limitmason import experiments
from limitmason.capacity import Steps
from limitmason.capacity.point_range import OPENING, SLIP, point_range
from limitmason.display.text_table import markdown
from limitmason.experiments.experiment import Experiment
from limitmason.mechanics.law import PointLaw, interface_law
from limitmason.model.assembly import Assembly
from limitmason.storage.csv_table import parsed, write_table
from validation import murano_micro as micro

from .pushed import NAME, POINTS

Array = NDArray[np.float64]

LOADS = (5.0, 10.0, 15.0)
"""At which points are counted [kN]."""

SMALL = 1.0
"""Load from which forces per kN are taken [kN]."""

FAR, FINE = 4e-4, 5e-5
"""Mean displacement at which 15 kN are passed [m]; longest step over the median block, some 0.3 kN."""

STORED = Path(__file__).with_name("onset.csv")
UNITS = {
    "blocks": "-", "points": "-", "pulled": "kN", "opens": "kN", "slips": "kN",
    **{f"{what} at {load:g} kN": "-" for load in (0.0, *LOADS) for what in ("open", "slid")}, "seconds": "s",
}


@dataclass(frozen=True)
class Case:
    """A wall, what it stands on, and the family of models."""

    wall: str
    ground: str
    stones: bool

    @property
    def name(self) -> str:
        """In the table."""
        return f"{self.wall}, ground {self.ground}, {'micro-model' if self.stones else 'DEM'}"


CASES = tuple(
    Case("REGW", ground, stones) for ground in ("bonded", "joint", "no tension", "dry") for stones in (False, True)
)
"""Of DS points are open and slide under dead load already."""


class Onset(NamedTuple):
    """What is kept: number of points; loads [kN] at which one is first pulled, opens and slips; counts; seconds.

    A point opens at its tensile strength and slips at its shear strength. ``counts`` are the points that are open and
    those that have slid under dead load and at ``LOADS``. Loads are 0 where a point has failed under dead load.
    """

    points: int
    pulled: float
    opens: float
    slips: float
    counts: tuple[int, ...]
    seconds: float


class Forces(NamedTuple):
    """Normal force, compression positive [N], (m,), shear [N], (m, 2), points that are open and that have slid, (m,).

    ``load`` is that of the airbag [kN].
    """

    normal: Array
    shear: Array
    open: NDArray[np.bool_]
    slid: NDArray[np.bool_]
    load: float = SMALL


def first_loads(at_rest: Forces, per_kn: Forces, law: PointLaw) -> Array:
    """Loads at which the first point is pulled, opens and slips [kN], as springs; 0 where it has under dead load.

    Parameters
    ----------
    at_rest, per_kn : forces under dead load, and per kN of the airbag
    law : strengths over the areas of the points [N]
    """
    dead, live = (np.column_stack([f.normal, f.shear]) for f in (at_rest, per_kn))
    found = []
    for criterion, strength in (
        (OPENING, law._replace(tension=np.zeros_like(law.tension))), (OPENING, law), (SLIP, law)
    ):
        low, high = point_range(criterion, strength, dead, live)
        # a point that is beyond its strength at rest has no range with 0 in it
        found.append(np.where((low >= 0.0) | (high <= 0.0), 0.0, high).min())
    return np.array(found)


def wall_of(case: Case) -> tuple[Experiment, Assembly]:
    """The experiment and its blocks: their mortar keeps all it has, so that points that fail do not bring others."""
    test = experiments.load(NAME, case.wall, ground=case.ground, residual="full")
    return test, test.assembly()


def in_the_dem(case: Case) -> tuple[list[Forces], Array, Array]:
    """Forces of rigid blocks at rest under 0, ``SMALL`` and ``LOADS``; areas [m2] and interfaces of the points."""
    test, wall = wall_of(case)
    calm = dem.Settle(tolerance=1e-6)
    history = dem.simulate(wall, calm, loads=test.loads(), contact_points=POINTS)
    states = [history.state]
    for load in (SMALL, *LOADS):
        history = dem.simulate(
            wall, [dem.Ramp(to=load, steps=4000), calm], loads=test.loads(), start=states[-1], sample=1000,
            detect_every=None,
        )
        states.append(history.state)
    points = states[0].points
    interface = np.repeat(states[0].interface, np.diff(states[0].joints.start))
    law, found = interface_law(wall.arrays, convex=False).at(interface).over(points.area), []
    for state in states:
        now, j = state.measured(wall), state.joints
        # the axes of a joint turn by less than a thousandth up to these loads
        force = np.einsum("mij,mj->mi", j.frame[now.owner], now.force)
        slip = np.hypot(state.points.slip_1, state.points.slip_2)
        found.append(Forces(force[:, 2], force[:, :2], at_strength(force[:, 2], law.tension), slip > 0.0))
    return found, points.area, interface


def in_the_micro_model(case: Case) -> tuple[list[Forces], Array, Array]:
    """The same of elastic stones, from state of rest to state of rest: the first at a load or beyond it."""
    test, wall = wall_of(case)
    curve = micro.push_micro(test, FAR, wall=wall, steps=Steps(largest=FINE, most=2000))
    p, found = curve.structure.points, []
    law = interface_law(wall.arrays, convex=False).at(p.interface).over(p.area)
    first = curve.nodes[int(np.argmax(curve.multiplier > 0.0))]
    beyond = [curve.nodes[int(np.argmax(curve.multiplier >= load))] for load in LOADS]
    for node in (curve.nodes[0], first, *beyond):
        slip = np.linalg.norm(node.history.slip, axis=1)
        normal, shear = node.force[:, 0], node.force[:, 1:]
        found.append(Forces(normal, shear, at_strength(normal, law.tension), slip > 0.0, node.multiplier))
    return found, p.area, p.interface


def at_strength(normal: Array, tension: Array) -> NDArray[np.bool_]:
    """Points that are pulled as much as they can be, or that carry nothing where that is nothing."""
    return np.asarray(normal <= -tension + 1e-9 * np.abs(normal).max())


def run(case: Case, progress: Callable[[str], None] | None = None) -> Onset:
    """Push to the largest of ``LOADS`` and count."""
    if progress:
        progress(f"{case.name} ...")
    begun = time.process_time()
    found, area, interface = (in_the_micro_model if case.stones else in_the_dem)(case)
    law = interface_law(wall_of(case)[1].arrays, convex=False).at(interface).over(area)
    rest, small = found[0], found[1]
    per_kn = small._replace(
        normal=(small.normal - rest.normal) / small.load, shear=(small.shear - rest.shear) / small.load
    )
    pulled, opens, slips = first_loads(rest, per_kn, law)
    counts = tuple(int(c.sum()) for f in (rest, *found[2:]) for c in (f.open, f.slid))
    return Onset(len(area), pulled, opens, slips, counts, time.process_time() - begun)


def read() -> dict[str, Onset]:
    """What is kept, by name."""
    found = {}
    if STORED.is_file():
        for cells in parsed(STORED.read_text(encoding="utf-8"), STORED.name).rows:
            numbers = [float(c) for c in cells[2:5]]
            counts, seconds = tuple(map(int, cells[5:-1])), float(cells[-1])
            found[cells[0]] = Onset(int(cells[1]), *numbers, counts=counts, seconds=seconds)
    return found


def write(kept: Mapping[str, Onset]) -> None:
    """Write the kept lines."""
    lines = []
    for name, o in kept.items():
        loads = [f"{v:.4g}" for v in (o.pulled, o.opens, o.slips)]
        lines.append([name, str(o.points), *loads, *map(str, o.counts), f"{o.seconds:.3g}"])
    write_table(STORED, UNITS, lines)


def table(kept: Mapping[str, Onset]) -> list[str]:
    """Loads of the first points and counts of those that have failed."""
    rows = [["blocks", "first pulled [kN]", "first opens [kN]", "first slips [kN]", "points", "open, slid at rest",
             *(f"at {load:g} kN" for load in LOADS)]]
    for name, o in kept.items():
        pairs = [f"{o.counts[k]}, {o.counts[k + 1]}" for k in range(0, len(o.counts), 2)]
        rows.append([name, *(f"{v:.1f}" for v in (o.pulled, o.opens, o.slips)), str(o.points), *pairs])
    return markdown(rows)
