"""What dilatancy, contact points and block size do to a wall with returns pushed out of plane.

Cut down by default; --full takes all sizes, dilatancy angles and contact points (half an hour). Two block-size studies
are kept apart: growing the blocks in the wall's plane changes the bond, growing the thickness too changes t / H.
"""

import sys

import limitmason as lm

FULL = "--full" in sys.argv
shares = (0.0, 0.25, 0.5, 0.75, 1.0) if FULL else (0.0, 1.0)
points = (2, 3, 4, 6, 8, 12, 16, 20) if FULL else (2, 4, 8)
sizes = (0.25, 0.5, 1.0, 2.0) if FULL else (0.5, 1.0, 2.0)
workers = 2 if FULL else 1

arguments = {
    "length": 0.32,
    "height": 0.16,
    "unit": (0.08, 0.04, 0.04),
    "joint": lm.Joint(friction_angle_deg=33.82),
    "plan": "L",
    "return_length": 0.12,
}
outwards = (0, -1, 0)
wall = lm.build.wall(**arguments)
loads = lm.Loads.horizontal(wall, outwards)


def say(line):
    print(line, file=sys.stderr)


dem = {"contact_points": (2, 8) if FULL else (2, 4)}
dilatancy = lm.study.dilatancy_study(wall, loads, shares, options={"dem": dem}, workers=workers, progress=say)
print(dilatancy)
lm.figures.study_lines(
    dilatancy, "psi", x_label="dilatancy angle ψ [deg]", title="Dilatancy", caption="φ = 33.82°"
).savefig("dilatancy.png")

converging = lm.study.contact_point_study(wall, loads, points, workers=workers, progress=say)
print(converging)
lm.figures.study_lines(
    converging, "points", by=("method", "share"), x_label="contact points across the thickness", title="Contact points"
).savefig("contact_points.png")

by_size = {}
for vary in ("in plane", "whole block"):
    by_size[vary] = lm.study.block_size_study(
        arguments,
        sizes,
        ("associative", "dem") if FULL else ("associative",),
        vary=vary,
        direction=outwards,
        options={"dem": dem} if FULL else None,
        workers=workers,
        progress=say,
    )
    print(by_size[vary])
    lm.figures.study_lines(
        by_size[vary], "size", log=True, x_label="block size / reference [-]", title=f"Block size, {vary}"
    ).savefig(f"block_size_{vary.replace(' ', '_')}.png")
