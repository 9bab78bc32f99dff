"""One wall, joints that dilate more and less: from no dilatancy to the friction angle.

The associative value is an upper bound for every dilatancy. With psi < phi the multiplier is not unique; what is
certain is Radenkovic's bracket.
"""

import limitmason as lm

FRICTION_DEG = 33.0
wall = lm.build.wall(
    length=1.6,
    courses=11,
    unit=(0.4, 0.175, 0.2),
    joint=lm.Joint(friction_angle_deg=FRICTION_DEG),
    openings=[lm.build.Opening(x=0.6, z=0.525, width=0.4, height=0.875, lintel=False)],
)
loads = lm.Loads.horizontal(wall)
associative = lm.limit_analysis(wall, loads)
print(associative)

multipliers = {}
for share in (0.0, 0.5, 1.0):
    joint = lm.Joint(friction_angle_deg=FRICTION_DEG, dilatancy_angle_deg=share * FRICTION_DEG)
    changed = wall.with_joints(joint)
    prediction = lm.limit_analysis(changed, loads, flow_rule="non-associative", search="quick")
    bracket = lm.limit_bracket(changed, loads)
    multipliers[share] = prediction.collapse_multiplier
    print(f"psi = {share:.1f} phi: smallest multiplier found {prediction.collapse_multiplier:.5f}; certain: {bracket}")
    if share == 0.0:
        lm.figures.mechanism(wall, prediction, title="psi = 0").savefig("wall_psi_0.png")
lm.figures.mechanism(wall, associative, title="psi = phi").savefig("wall_psi_phi.png")
