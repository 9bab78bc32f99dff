"""A block on a tilting table: it slides at the friction angle or rocks over its edge, whichever comes first.

For a dry joint the collapse multiplier of a horizontal load equals the tangent of the tilt angle at collapse:
lambda = min(tan(phi), b / h).
"""

import math

import limitmason as lm

FRICTION_ANGLE_DEG = 33.0
joint = lm.Joint(friction_angle_deg=FRICTION_ANGLE_DEG)

multipliers = {}
for height in (0.2, 0.4, 0.8):
    block = lm.build.column(width=0.3, depth=0.3, height=height, courses=1, joint=joint)
    prediction = lm.limit_analysis(block, lm.Loads.tilting(block, axis=(0, 1, 0)))
    exact = min(math.tan(math.radians(FRICTION_ANGLE_DEG)), 0.3 / height)
    multipliers[height] = (prediction.collapse_multiplier, exact)
    print(
        f"0.3 x {height} m: lambda = {prediction.collapse_multiplier:.5f} (exact {exact:.5f}), "
        f"tilt at collapse {prediction.tilt_angle_deg:.2f} deg, gap {prediction.certificate.gap:.1e}"
    )
lm.figures.mechanism(block, prediction, title="The tallest rocks").savefig("block_on_slope.png")
