"""A facade before and after strengthening: a tie rod at a height, a ring beam to the returns, and a floor that slides.

The multiplier of the tied facade rises in proportion to the strength of the rods until another mechanism governs:
lambda = t / H + 2 (sum of strengths) h / (W H), and the answer of limit analysis is that number. The capacity curves
show what it leaves open: how far the rods stretch before they yield, and what the facade still carries as it leans.
"""

import limitmason as lm
from limitmason.geometry import box

thickness, height, width = 0.3, 3.0, 4.0
joint = lm.Joint.from_friction_coefficient(0.6)
solids = [
    box((-1.0, -1.0, -0.2), (width + 1.0, 5.0, 0.0)),  # ground
    box((0.0, 0.0, 0.0), (width, thickness, height)),  # facade
    box((0.0, 1.0, 0.0), (thickness, 4.0, height)),  # returns, which have come apart from it
    box((width - thickness, 1.0, 0.0), (width, 4.0, height)),
]
house = lm.Assembly.from_polyhedra(
    solids, joint=joint, density=1800.0, fixed=["ground"], names=["ground", "facade", "left", "right"]
)
loads = lm.Loads.horizontal(house, (0.0, -1.0, 0.0))
weight = house.weights[house.block_index("facade")]

# two rods of 12 mm at 2.5 m through the facade, anchored in the returns; their plates break out before the rods yield
rods = [
    lm.Tie("facade", (x, 0.0, 2.5), name, (x, 2.5, 2.5), area=1.13e-4, yield_stress=235e6, modulus=2.1e11,
           anchor_force=6e3, name=f"rod {name}")
    for name, x in (("left", 0.15), ("right", width - 0.15))
]
tied = house.with_ties(rods)
line = [(0.15, 3.5, height), (0.15, 0.15, height), (width - 0.15, 0.15, height), (width - 0.15, 3.5, height)]
ringed = house.with_ties(lm.ring_beam(house, line, yield_force=4e3))

predictions = {
    name: lm.limit_analysis(wall, loads) for name, wall in (("bare", house), ("rods", tied), ("ring beam", ringed))
}
exact = {
    "bare": thickness / height,
    "rods": thickness / height + 2.0 * 2.0 * 6e3 * 2.5 / (weight * height),
    "ring beam": thickness / height + 2.0 * 2.0 * 4e3 * height / (weight * height),
}
for rod in tied.ties:
    print(rod)
for name, found in predictions.items():
    print(f"{name:10} lambda = {found.collapse_multiplier:.4f} ({found.status}), closed form {exact[name]:.4f}")

# a floor of 6 t on the returns: its own inertia leaves it behind at the friction of its bearings
floored = lm.build.with_floor(
    tied, mass=6000.0, joint=lm.Joint.from_friction_coefficient(0.25), footprint=(0.0, width, 1.0, 4.0)
)
sliding = lm.limit_analysis(floored, lm.Loads.horizontal(floored, (0.0, -1.0, 0.0)))
moving = [floored.blocks[i].name for i in sliding.mechanism.moving_blocks(1e-3)]
print(f"with the floor lambda = {sliding.collapse_multiplier:.4f}, what moves: {', '.join(moving)}")

curves = {name: lm.pushover(wall, loads, to=0.06) for name, wall in (("bare", house), ("rods", tied))}
for name, curve in curves.items():
    top = curve.peak
    print(f"{name:10} peak {top.load:.4f} at {1e3 * top.displacement:.3f} mm, at the end {curve.load[-1]:.3f}")

found = predictions["rods"]
gain = f"lambda = {found.collapse_multiplier:.3g}, {predictions['bare'].collapse_multiplier:.3g} without the rods"
lm.figures.mechanism(tied, found, title=gain).savefig("tie_rods.png")
