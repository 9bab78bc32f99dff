"""Straight, L and U walls out of plane: what the interlocking corners add to t / H."""

import limitmason as lm

joint = lm.Joint(friction_angle_deg=33.0)
common = {"length": 2.4, "courses": 9, "unit": (0.4, 0.2, 0.2), "joint": joint}
walls = {
    "straight": lm.build.wall(**common),
    "L": lm.build.wall(**common, plan="L", return_length=1.2),
    "U": lm.build.wall(**common, plan="U", return_length=1.2),
}
free_wall = 0.2 / (9 * 0.2)
print(f"free wall t / H = {free_wall:.4f}")

multipliers, limited = {}, {}
for plan, wall in walls.items():
    outwards = lm.Loads.horizontal(wall, (0, -1, 0))
    prediction = lm.limit_analysis(wall, outwards)
    # corners can twist a face only as far as the pressure on it allows: an estimate of what that costs
    with_torsion = lm.limit_analysis(wall, outwards, torsion_limit=True)
    multipliers[plan], limited[plan] = prediction.collapse_multiplier, with_torsion.collapse_multiplier
    print(
        f"{plan:<9}{wall.n_blocks - 1:4d} blocks: lambda = {prediction.collapse_multiplier:.4f} "
        f"(torsion limited: {with_torsion.collapse_multiplier:.4f}), gap {prediction.certificate.gap:.1e}"
    )
    lm.figures.mechanism(wall, prediction).savefig(f"corner_{plan}.png")
