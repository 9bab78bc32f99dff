"""Joints that do not quite fit: a corner wall out of plane, first loss of equilibrium, and what it sustains.

An L wall of 22 blocks without dilation. A path at large displacement from an admissible state says what is still
carried after a tenth of the thickness. Random gaps of 1e-4 of a block then open every joint of the wall: the load at
which it first loses equilibrium depends on them, what it sustains hardly does.

The 10 paths are read from a file, for one takes several seconds; ``--paths 10`` makes them again.
"""

import sys
from pathlib import Path

import numpy as np

import limitmason as lm
from limitmason import figures
from limitmason.answers.curve import Curve
from limitmason.capacity import Ensemble, imperfection_ensemble
from limitmason.storage.csv_table import parsed, write_table

STORED = Path(__file__).parent / "stored" / "gaps_in_a_corner_wall.csv"
PATHS = int(sys.argv[sys.argv.index("--paths") + 1]) if "--paths" in sys.argv else 0
STIFFNESS = 6e9  # Pa/m

wall = lm.build.wall(
    unit=(0.08, 0.04, 0.04), joint=lm.Joint(33.82), plan="L", length=0.32, return_length=0.12, courses=4
)
loads = lm.Loads.horizontal(wall, (0, -1, 0))

if PATHS:
    found = imperfection_ensemble(
        wall, loads, gap=1e-4, samples=PATHS, stiffness=STIFFNESS, contacts="first", contact_model="grid", grid=(2, 4),
        progress=print,
    )
    lines = []
    for k, c in enumerate(found.curves):
        kept = (found.status[k], f"{found.first_loss[k]:.6g}", f"{found.sustained[k]:.6g}")
        lines += [[k + 1, *kept, f"{u:.6g}", f"{load:.6g}"] for u, load in zip(*c, strict=True)]
    units = {"path": "-", "status": "-", "first_loss": "-", "sustained": "-", "displacement": "m", "multiplier": "-"}
    write_table(STORED, units, lines)
else:
    rows = {}
    table = parsed(STORED.read_text(encoding="utf-8"), STORED.name)
    for cells in table.rows:
        r = dict(zip(table.header, cells, strict=True))
        rows.setdefault(int(r["path"]), []).append(r)
    curves = [
        Curve([float(r["displacement"]) for r in own], [float(r["multiplier"]) for r in own], load_unit="-",
              label=f"path {k}", status=own[0]["status"])
        for k, own in rows.items()
    ]
    first, sustained = (np.array([float(own[0][n]) for own in rows.values()]) for n in ("first_loss", "sustained"))
    found = Ensemble(first, sustained, tuple(c.status for c in curves), tuple(curves))
print(found)

# an admissible state by the quick search, and what its mechanism carries a tenth of the thickness on
state = lm.limit_analysis(wall, loads, "non-associative", search="quick")
late = lm.predict(wall, loads, "sustained", smallest=state, stiffness=STIFFNESS)
associative = lm.limit_analysis(wall, loads).collapse_multiplier
print(
    f"associative {associative:.4f}; a state at {state.collapse_multiplier:.4f}, of which "
    f"{late.collapse_multiplier:.4f} is left after {1e3 * late.details['displacement']:.0f} mm"
)

# the figure divides by a thousand, as from N to kN: what is drawn are multipliers
drawn = {c.label if k == 0 else f"_{c.label}": (c.displacement, 1e3 * c.load)
         for k, c in enumerate(c for c in found.curves if len(c) > 1)}
levels = {"associative": 1e3 * associative, "sustained, from a state": 1e3 * late.collapse_multiplier}
figure = figures.load_displacement(
    drawn, levels=levels, ylabel="multiplier [-]", title="L wall of 22 blocks, gaps of 1e-4 of a block",
    caption=f"{len(drawn)} paths, each from other random gaps; the first is named.",
)
figure.savefig("gaps_in_a_corner_wall.png", bbox_inches="tight")
