"""A wall with a window and its lintel: horizontal load in both senses, and a load on the lintel."""

import limitmason as lm

joint = lm.Joint(friction_angle_deg=33.0)
wall = lm.build.wall(
    length=3.2,
    courses=12,
    unit=(0.4, 0.2, 0.3),
    joint=joint,
    openings=[lm.build.Opening(x=1.2, z=0.8, width=0.8, height=0.8, lintel=0.2, bearing=0.2)],
)
print(f"{wall.n_blocks - 1} blocks, {len(wall.interfaces)} interfaces")

cases = {"to the right": lm.Loads.horizontal(wall), "to the left": lm.Loads.horizontal(wall, (-1, 0, 0))}
predictions = lm.predict_cases(wall, cases)
for name, prediction in predictions.items():
    print(f"{name}: lambda = {prediction.collapse_multiplier:.4f}, gap {prediction.certificate.gap:.1e}")
lm.figures.mechanism(wall, predictions["to the right"]).savefig("wall_with_opening.png")

# a point load at the middle of the lintel, 1 kN times lambda, pulling down and to the right
lintel = wall.block_index("lintel-1")
loads = lm.Loads.weight(wall).with_point_load(wall, "lintel-1", (1000.0, 0.0, -200.0), at=wall.centroids[lintel])
pulled = lm.limit_analysis(wall, loads)
print(f"load on the lintel: {pulled.collapse_multiplier:.2f} kN sideways; {pulled.status}")
