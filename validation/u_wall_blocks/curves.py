"""Curves of pushed blocks for the figure of the page, kept where states of push-overs are kept."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import pushed

SHOWN = {
    "REGW blocks": "REGW, lost at once",
    "REGW blocks, loose foot": "REGW, lost by opening alone; ground without tension",
    "REGW micro, loose foot": "REGW, lost by opening alone; ground without tension; stones at rest",
    "DS blocks": "DS",
}
"""Name in the figure, and case."""

FAR = 6.0
"""Displacement of the top up to which curves are drawn, the end of the other models' [mm]."""

Array = NDArray[np.float64]


def curves(folder: Path | None) -> dict[str, tuple[Array, Array]]:
    """Displacement of the top [m] and load [N] by name; pushes are made where they are not in the folder."""
    found = {}
    for name, case in SHOWN.items():
        file = None if folder is None else folder / f"{name.replace(' ', '_').replace(',', '')}.npz"
        if file is not None and file.is_file():
            with np.load(file) as kept:
                u, load = kept["displacement"], kept["load"]
        else:
            trace = pushed.followed(next(c for c in pushed.CASES if c.name == case), print)
            u, load = 1e-3 * trace.displacement, 1e3 * trace.load
            if file is not None:
                np.savez(file, displacement=u, load=load)
        end = int(np.argmax(u >= 1e-3 * FAR)) if u.max() >= 1e-3 * FAR else len(u) - 1
        found[name] = u[: end + 1], load[: end + 1]
    return found
