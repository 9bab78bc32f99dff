"""A wall on a tilting table: small marble blocks with one return wall, joints that dilate and joints that do not.

    python tilt_test.py [--full]

Blocks and joints are those of the tilting tests at Pavia (80 x 40 x 28 mm, 33.82 degrees, 14 GPa/m; density of marble
assumed, it does not matter), the plan is ours: those of the specimens are not published in the sources at hand. The
table turns until the wall falls away from its return; lambda is where it falls on a table that stops. Beside it: loads
held one after the other, and the associative limit analysis, a bound from above for both. ``--full``: the larger wall,
the finer contacts and the slower table.
"""

import sys

import dem
from limitmason import Joint, Loads, build, figures, limit_analysis
from limitmason.experiments import load

FULL = "--full" in sys.argv
given = load("pavia-tilting", "S1").parameters
unit = tuple(float(given[f"block {side}"]) / 1e3 for side in ("length", "height", "thickness"))
phi = float(given["friction angle"])
stiffness = {
    "normal_stiffness": 1e9 * float(given["normal stiffness"]),
    "shear_stiffness": 1e9 * float(given["tangential stiffness"]),
}
AWAY = (0.0, -1.0, 0.0)  # from the return wall
if FULL:
    size = {"length": 0.64, "courses": 10, "return_length": 0.24}
    points = {"facade": (4, 8), "return-left": (4, 2)}  # 8 across the tilted wall and 2 in the return, as in 3DEC
    table = {"steps": 40_000, "tolerance": 0.01}
else:
    size = {"length": 0.32, "courses": 4, "return_length": 0.16}
    points = {"facade": (2, 5), "return-left": (2, 2)}
    table = {"steps": 12_000, "tolerance": 0.02}

tests = {}
for psi in (0.0, phi):
    joint = Joint(phi, dilatancy_angle_deg=psi, **stiffness)
    wall = build.wall(**size, unit=unit, plan="L", joint=joint, density=2700.0)
    name = f"ψ = {psi:g}°"
    tests[name] = dem.tilt_test(wall, AWAY, to_deg=30.0, contact_points=points, increments=True, **table)
    print(f"\n{name}")
    print(tests[name])
    print("  deg per 1000 steps: " + ", ".join(f"{rate:.3g}: {value:.4f}" for rate, value in tests[name].runs))

zero, dilatant = tests.values()
upper = limit_analysis(wall, Loads.horizontal(wall, AWAY)).collapse_multiplier
print(f"\n{wall.n_blocks - 1} blocks; limit analysis, psi = phi, rigid joints: {upper:.4f}")
print(f"ratio psi = 0 over psi = phi: {zero.at_rest / dilatant.at_rest:.2f} (3DEC on S1 to S13: 0.78 to 0.96)")
figures.tilt_test(
    tests,
    title=f"Tilting test of an L-shaped wall, {wall.n_blocks - 1} blocks",
    caption="Plan assumed, blocks and joints of the Pavia tests. A table that still turns while the wall falls reads "
    + " and ".join(f"{100 * (t.runs[-1][1] / t.collapse_multiplier - 1):.1f} %" for t in tests.values())
    + " too much, against a table that stops.",
).savefig("tilt_test.png")
figures.deformed(wall, zero.history, scale=2.0, title="The wall begins to fall, ψ = 0").savefig(
    "tilt_test_fall.png"
)
