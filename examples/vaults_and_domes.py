"""Vaults, domes and a tower: horizontal load, fill on haunches, and the thinnest dome that stands.

A vault or a dome has hundreds of voussoirs, built from a few numbers. The dome's meridian joints run from springing to
crown, as the cracks of real domes do, so that its least thickness can be read beside Heyman's 4.2 % of the radius.
"""

import limitmason as lm

joint = lm.Joint(friction_angle_deg=40.0)
section = {"radius": 2.5, "thickness": 0.4, "voussoirs": 11, "unit_length": 0.8, "joint": joint}
structures = {
    "barrel vault": lm.build.vault(length=4.0, **section),
    "groin vault": lm.build.vault(shape="groin", **section),
    "dome": lm.build.dome(radius=2.5, thickness=0.3, courses=8, lunes=16, joint=joint),
    "tower": lm.build.wall(
        length=2.4, courses=16, unit=(0.6, 0.25, 0.3), joint=joint, plan="box", return_length=2.4,
        openings=[lm.build.Opening(x=0.9, z=0.0, width=0.6, height=1.5, lintel=0.25, bearing=0.3)],
    ),
}

multipliers = {}
for name, structure in structures.items():
    loads = lm.Loads.horizontal(structure, (1, 0, 0))
    prediction = lm.limit_analysis(structure, loads)
    multipliers[name] = prediction.collapse_multiplier
    print(f"{name:<14}{structure.n_blocks:4d} blocks: lambda = {prediction.collapse_multiplier:.4f}")
    lm.figures.mechanism(structure, prediction).savefig(f"vaults_{name.replace(' ', '_')}.png")

# fill up to the crown: more weight on the haunches, and the horizontal load of the fill itself is not counted here
barrel = structures["barrel vault"]
filled = lm.Loads.horizontal(barrel).with_backfill(barrel, level=2.7, density=1600.0)
multipliers["barrel vault, filled"] = lm.limit_analysis(barrel, filled).collapse_multiplier
print(f"barrel vault with fill: lambda = {multipliers['barrel vault, filled']:.4f} of its own weight")

thin, thick = 0.035, 0.06
while thick - thin > 5e-4:
    share = 0.5 * (thin + thick)
    dome = lm.build.dome(radius=5.0, thickness=5.0 * share, courses=12, lunes=16, joint=lm.Joint(50.0))
    stands = lm.limit_analysis(dome, lm.Loads.horizontal(dome)).status == "solved"
    thin, thick = (thin, share) if stands else (share, thick)
print(f"a hemisphere stands from {100 * thick:.1f} % of its radius on (Heyman: 4.2 %)")
