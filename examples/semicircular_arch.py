"""A semicircular arch: minimum thickness, horizontal collapse multiplier, mechanism and line of thrust.

A semicircular arch with radial joints needs t / R = 0.1075 to stand under its own weight (Milankovitch, 1907). With
more thickness it also carries a horizontal acceleration.
"""

import limitmason as lm

joint = lm.Joint(friction_angle_deg=37.0)
ring = {"radius": 1.0, "width": 0.6, "voussoirs": 60, "joint": joint}
minimum = lm.minimum_thickness(lambda t: lm.build.arch(thickness=t, **ring), between=(0.08, 0.2)).high
print(f"minimum t/R of a semicircular arch of 60 voussoirs: {minimum:.5f} (Milankovitch 0.1075)")

arch = lm.build.arch(radius=2.0, thickness=0.36, width=0.6, voussoirs=25, joint=joint)
horizontal = lm.Loads.horizontal(arch)
prediction = lm.limit_analysis(arch, horizontal)
print(prediction)

lm.figures.mechanism(arch, prediction).savefig("arch_mechanism.png")
lm.figures.contact_forces(arch, prediction).savefig("arch_thrust.png")

# a little thinner than the minimum it cannot stand: that is a result, not an error
thin = lm.build.arch(radius=2.0, thickness=0.99 * 2.0 * minimum, width=0.6, voussoirs=60, joint=joint)
falling = lm.limit_analysis(thin, lm.Loads.horizontal(thin))
print(f"t/R = {0.99 * minimum:.4f}: {falling.status}")

# and it collapses when a springing gives way sideways: the least thrust it still needs from there
spreading = lm.settlement_analysis(arch, "base-right", direction="+x")
thrust = spreading.reaction.least
print(f"least horizontal thrust on the spreading support: {thrust / 1e3:.2f} kN")
