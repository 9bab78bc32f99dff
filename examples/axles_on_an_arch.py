"""Two axles cross an arch bridge: how heavy they may be at every place, and where they are worst."""

import limitmason as lm

joint = lm.Joint(friction_angle_deg=38.0)
arch = lm.build.arch(span=8.0, rise=2.5, thickness=0.45, width=1.0, voussoirs=24, joint=joint, density=2200.0)
dead = lm.Loads.weight(arch).with_backfill(arch, level=3.4, density=1800.0)

# 50 kN each, 1.8 m apart; the fill spreads them by 30 degrees
axles = lm.axle_envelope(arch, dead, [(0.0, 5e4), (1.8, 5e4)], level=3.4)
print(f"{axles.multipliers.min():.2f} times both axles where the first stands at x = {axles.governing:.1f} m")
lm.figures.axle_envelope(axles, title="Two axles of 50 kN").savefig("axles_on_an_arch.png")
