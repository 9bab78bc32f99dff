"""One wall with a return, pushed out of plane: three theories side by side.

The associative program is an upper bound for every flow rule. The DEM takes the joints as they are, psi = 0, and must
lie within the range that the non-associative law admits, give or take its own error budget. The mechanism prescribes
its friction: an engineering estimate with a bracket.
"""

import sys

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
