"""Where the U walls' blocks have parted at the end of a push: the places at which the source saw cracks."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import dem
from limitmason.experiments import murano_u_walls as murano
from limitmason.model.assembly import Assembly
from limitmason.storage.csv_table import parsed, write_table

from . import pushed

Array = NDArray[np.float64]

APART = 1.0
"""Movement across a joint from which it counts as a crack that is seen [mm]."""

CASES = tuple(c for c in pushed.CASES if c.name in ("DS", "REGW, lost at once", "REGW, lost by opening alone"))
STORED = Path(__file__).with_name("places.csv")
UNITS = {"push": "-", "side walls, left": "mm", "side walls, right": "mm", "top at mid-span": "mm",
         "steps, left": "mm", "steps, right": "mm", "bed 1": "mm", "bed 2": "mm", "bed 3": "mm"}


class Places(NamedTuple):
    """Largest movement across a joint of every place since own weight [mm].

    ``steps`` are stepped cracks in a half of the facade, away from mid-span and side walls: the smaller one of head and
    bed joints there. Beds are counted from the ground's joint on and lie under the facade.
    """

    left_wall: float
    right_wall: float
    middle: float
    left_steps: float
    right_steps: float
    bed_1: float
    bed_2: float
    bed_3: float


def run(case: pushed.Case, progress: Callable[[str], None] | None = None) -> Places:
    """Push, and look at every place."""
    test, wall = pushed.model(case)
    if progress:
        progress(f"{case.name} ...")
    loads, top = test.loads(), murano.control_block(test)
    rest = dem.simulate(wall, dem.Settle(tolerance=1e-5), loads=loads, contact_points=pushed.POINTS, blocks=case.blocks)
    state = rest.state.copy()
    pushed.driven(state, loads, top, wall.fixed, case.to, case.steps)
    moved = across(wall, rest.state, state)
    x, across_facade = wall.arrays, np.abs(wall.arrays.normal[:, 1]) < np.sqrt(0.5)
    facade = (wall.centroids[:, 1] < 0.3) & ~wall.fixed
    own = facade[x.block_a] & facade[x.block_b] & across_facade
    corner = (facade[x.block_a] != facade[x.block_b]) & ~wall.fixed[x.block_a] & ~wall.fixed[x.block_b]
    level = np.abs(x.normal[:, 2]) > np.sqrt(0.5)
    middle = 0.5 * (wall.centroids[:, 0].min() + wall.centroids[:, 0].max())
    off, height = x.centre[:, 0] - middle, x.centre[:, 2]
    half = (np.abs(off) > 0.3) & (np.abs(off) < 0.85) & (height > 0.3)

    def most(where: NDArray[np.bool_]) -> float:
        return float(moved[where].max(initial=0.0))

    steps = [min(most(own & half & side & ~level), most(own & half & side & level)) for side in (off < 0.0, off > 0.0)]
    beds = [most(own & level & (np.abs(height - 0.225 * k) < 0.02)) for k in (1, 2, 3)]
    top_middle = most(own & ~level & (height > 0.9) & (np.abs(off) < 0.3))
    return Places(most(corner & (off < 0.0)), most(corner & (off > 0.0)), top_middle, *steps, *beds)


def across(wall: Assembly, before: dem.State, after: dem.State) -> Array:
    """Largest movement of the two sides of every joint against each other, at its corners [mm]."""

    def place(state: dem.State, block: int, corners: Array) -> Array:
        arm = corners - wall.centroids[block]
        return np.asarray(state.bodies.shift[block] + arm @ state.bodies.rot[block].T)

    def gap(state: dem.State, joint: int) -> Array:
        i = wall.interfaces[joint]
        return place(state, i.block_b, i.polygon) - place(state, i.block_a, i.polygon)

    numbers = range(len(wall.interfaces))
    return np.array([1e3 * np.linalg.norm(gap(after, k) - gap(before, k), axis=1).max() for k in numbers])


def write(kept: Mapping[str, Places]) -> None:
    """Write the kept lines."""
    write_table(STORED, UNITS, [[name, *(f"{v:.3g}" for v in p)] for name, p in kept.items()])


def read() -> dict[str, Places]:
    """What is kept, by name."""
    if not STORED.is_file():
        return {}
    rows = parsed(STORED.read_text(encoding="utf-8"), STORED.name).rows
    return {cells[0]: Places(*map(float, cells[1:])) for cells in rows}
