"""A stack of equal blocks: the lowest joint rocks first, lambda = b / (n h)."""

import sys
from pathlib import Path

import limitmason as lm

OUT = Path(sys.argv[sys.argv.index("--out") + 1]) if "--out" in sys.argv else Path()  # folder for the figures
OUT.mkdir(parents=True, exist_ok=True)

joint = lm.Joint(friction_angle_deg=38.0)
stack = lm.build.column(width=0.4, depth=0.3, unit_height=0.25, courses=6, joint=joint)
prediction = lm.limit_analysis(stack, lm.Loads.horizontal(stack))
exact = 0.4 / (6 * 0.25)

print(prediction)
print(f"exact b / (n h) = {exact:.6f}")
lm.figures.mechanism(stack, prediction).savefig(OUT / "stack.png")
