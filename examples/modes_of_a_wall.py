"""Modes of a wall with a return: natural frequencies, shapes, and what joints half as stiff do to them."""

import limitmason as lm

joint = lm.Joint(friction_angle_deg=33.0, normal_stiffness=5e9, shear_stiffness=2e9)
size = {"length": 1.6, "courses": 6, "unit": (0.4, 0.2, 0.2), "plan": "L", "return_length": 1.2}
stiff = lm.modes(lm.build.wall(**size, joint=joint))
print(stiff)
stiff.plot(number=1).savefig("modes_of_a_wall.png")

# every frequency goes with the root of the stiffness
soft = lm.modes(lm.build.wall(**size, joint=lm.Joint(33.0, normal_stiffness=2.5e9, shear_stiffness=1e9)))
print("half as stiff: " + ", ".join(f"{f:.2f} Hz" for f in soft.frequency) + f"; {stiff.frequency[0] / 2**0.5:.2f} Hz")
