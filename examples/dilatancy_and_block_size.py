"""Dilatancy, contact points and block size: what they do to a wall with a return, pushed out of plane.

Blocks and joints of the Pavia tilting tests (80 x 40 x 28 mm, phi 33.82 degrees), a layout of our own. Two
block-size studies are kept apart: growing the blocks in the wall's plane changes the bond, growing the thickness too
changes t / H. A third grows the blocks of the McMaster wallettes in bending. Cut down by default; --full takes a wall
of 12 courses down to quarter blocks, all dilatancy angles and more contact points (a quarter of an hour on one core).
"""

import sys

import limitmason as lm
from limitmason.limit.nonassociative.search import EFFORTS

FULL = "--full" in sys.argv
UNIT, OUTWARDS = (0.08, 0.04, 0.028), (0, -1, 0)
joint = lm.Joint(friction_angle_deg=33.82)
small = {"length": 0.32, "height": 0.16, "unit": UNIT, "joint": joint, "plan": "L", "return_length": 0.12}
large = {**small, "length": 0.48, "height": 0.48, "return_length": 0.24}
arguments = large if FULL else small
dem = {"contact_points": (2, 8 if FULL else 4), "error_budget": ()}


def say(line):
    print(line, file=sys.stderr)


def draw(table, name, x, x_label, title, **options):
    lm.figures.study_lines(table, x, x_label=x_label, title=title, **options).savefig(name + ".png", dpi=200)


# dilatancy and contact points: on the small wall, whose search in 3-D takes seconds
wall = lm.build.wall(**small)
loads = lm.Loads.horizontal(wall, OUTWARDS)
dilatancy = lm.study.dilatancy_study(
    wall,
    loads,
    (0.0, 0.25, 0.5, 0.75, 1.0) if FULL else (0.0, 1.0),
    options={"dem": dem, "non-associative": {"search": EFFORTS["quick"]}},
    progress=say,
)
print(dilatancy)
draw(dilatancy, "dilatancy", "psi", "dilatancy angle ψ [deg]", "Dilatancy", caption="φ = 33.82°")

points = (2, 3, 4, 6, 8, 12) if FULL else (2, 4)
converging = lm.study.contact_point_study(wall, loads, points, options={"error_budget": ()}, progress=say)
print(converging)
draw(
    converging, "contact_points", "points", "contact points across the thickness", "Contact points",
    by=("method", "share"),
)

# block size: the DEM (psi = 0) where the blocks are few
sizes = {"associative": (0.25, 0.5, 1.0, 2.0), "dem": (1.0, 2.0)} if FULL else {"associative": (0.5, 1.0, 2.0)}
by_size = {}
for vary in ("in plane", "whole block"):
    by_size[vary] = lm.study.block_size_study(
        arguments, sizes, vary=vary, direction=OUTWARDS, options={"dem": dem} if FULL else None, progress=say
    )
    print(by_size[vary])
    draw(
        by_size[vary], f"block_size_{vary.replace(' ', '_')}", "size", "block size / reference [-]",
        f"Block size, {vary}", log=True, caption="hollow: straight line through the two smallest, no bound",
    )

# wallettes in four-point bending: perfectly plastic joints, so the values lie above brittle ones at any size
print("\n6 M / (b t2) [MPa] by associative limit analysis, blocks of size 1, 1/2" + (", 1/4" if FULL else ""))
bending = {}
for name in ("theta-0", "theta-45", "theta-90"):
    bending[name] = []
    for scale in (1.0, 0.5, 0.25) if FULL else (1.0, 0.5):
        test = lm.experiments.load("mcmaster-bending", name, block_scale=scale)
        bending[name].append(lm.limit_analysis(test.assembly(), test.loads()).collapse_multiplier)
    print(f"{name:<10}" + "".join(f"{v:8.3f}" for v in bending[name]))
