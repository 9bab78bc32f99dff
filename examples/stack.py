"""A stack of equal blocks: the lowest joint rocks first, lambda = b / (n h)."""

import limitmason as lm

joint = lm.Joint(friction_angle_deg=38.0)
stack = lm.build.column(width=0.4, depth=0.3, unit_height=0.25, courses=6, joint=joint)
prediction = lm.limit_analysis(stack, lm.Loads.horizontal(stack))
exact = 0.4 / (6 * 0.25)

print(prediction)
print(f"exact b / (n h) = {exact:.6f}")
lm.figures.mechanism(stack, prediction).savefig("stack.png")
