"""One wall with a return, pushed out of plane: three theories side by side, and where the gap between two comes from.

The associative program is an upper bound for every flow rule. The DEM takes the joints as they are, psi = 0, and must
lie within the range that the non-associative law admits, give or take its own error budget. The mechanism prescribes
its friction: an engineering estimate with a bracket.
"""

import sys

import numpy as np

import limitmason as lm

wall = lm.build.wall(
    length=0.32,
    courses=4,
    unit=(0.08, 0.04, 0.04),
    joint=lm.Joint(friction_angle_deg=33.82),
    plan="L",
    return_length=0.12,
)
loads = lm.Loads.horizontal(wall, direction=(0, -1, 0))


def say(line):
    print(line, file=sys.stderr)


result = lm.compare(wall, loads, dem={"contact_points": (2, 4)}, progress=say, title="L-shaped wall, out of plane")
print(result)
lm.figures.side_by_side(result).savefig("three_theories_one_wall.png")

# a stone twisted about the vertical: flow rule and pressure in the face only act together
outlines = [[[-0.2, -0.1], [0.6, -0.1], [0.6, 0], [-0.2, 0]], [[0, 0], [0.4, 0], [0.4, 0.4], [0, 0.4]]]
joint = lm.Joint.from_friction_coefficient(0.5)
stone = lm.Assembly.from_polygons(outlines, thickness=0.4, joint=joint, fixed=[0])
live = np.zeros((2, 6))
live[1, 5] = joint.tan_phi * stone.weights[1] * 0.4
twist = lm.Loads(lm.Loads.weight(stone).dead, live)
gap = lm.study.attribute_gap(stone, twist, contact_points=(8, 8))
print(gap)
lm.figures.gap(gap, title="A stone twisted on a slab: from limit analysis to the DEM").savefig("gap.png")
