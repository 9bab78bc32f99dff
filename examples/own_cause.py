"""A cause of one's own, in ten lines: added, applied, and found in measurements that hide it.

The measurements are synthetic: the upper units of the stacks are hollow, which the model does not know. The data behave
like it, with its size; it is not identified, because in these stacks it goes with the height alone.
"""

import numpy as np

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.build.variants import with_density_factor
from limitmason.diagnosis import Cause, Measured, Noise, Study, simulate


# ---- the cause: ten lines ----------------------------------------------------
def hollow_above(size, assembly, loads):
    """Units above 0.6 m have `size` times their density; the loads follow the weights."""
    high = [b.name for b in assembly.blocks if b.centroid[2] > 0.6]
    lighter = with_density_factor(assembly, size, high)
    return lighter, lm.Loads.horizontal(lighter)


hollow = Cause(
    "hollow upper units", "upper_density", baseline=1.0, bounds=(0.3, 1.0), apply=hollow_above,
    physics="units above 0.6 m are hollow: weight x size", isolate="weigh units of every course",
)


# ---- the model, and the extended one: same calls afterwards --------------------
def stack(specimen, *, friction_coefficient=0.7):
    """One specimen: a stack of blocks, and its loads."""
    joint = lm.Joint.from_friction_coefficient(friction_coefficient)
    made = lm.build.column(width=specimen["width"], depth=0.3, unit_height=0.2, height=specimen["height"], joint=joint)
    return made, lm.Loads.horizontal(made)


tall = {"width": 0.15, "height": 1.2}
extended = hollow.apply(0.5, *stack(tall))
plain_value = lm.limit_analysis(*stack(tall)).collapse_multiplier
extended_value = lm.limit_analysis(*extended).collapse_multiplier
print(f"stack of {tall['height']} m: lambda {plain_value:.3f}, with hollow upper units {extended_value:.3f}\n")

# ---- measurements that hide it -------------------------------------------------
specimens = [{"width": w, "height": h} for w in (0.12, 0.18, 0.24) for h in (0.4, 0.6, 0.8, 1.2)]
study = Study(
    specimens, simulate.collapse(stack), noise=Noise(sd=0.04), covariates=["width", "height"],
    nuisance={"friction_coefficient": Measured(0.70, 0.03)}, **simulate.SLOW,
)
rng = np.random.default_rng(0)
measured = study.predicted([hollow], [0.5]) * np.exp(0.04 * rng.standard_normal(len(specimens)))

# ---- the verdict, and the better model ------------------------------------------
others = [
    catalogue.edge_rounding(bounds=(0.0, 15.0), plane_normal=(0.0, 1.0, 0.0)),
    catalogue.weak_base_joint(),
    catalogue.gain(),
    catalogue.angle_offset(),
]
diagnosis = study.replace(measured=measured).diagnose([hollow, *others], seed=0)
print(diagnosis.report())
lm.figures.diagnosis(diagnosis, title="Stacks with hollow upper units").savefig("own_cause.png")
size = diagnosis.estimates[hollow.name].size
better = lm.limit_analysis(*hollow.apply(size, *stack(tall)))
print(f"\nbetter model of the 1.2 m stack: {better}")

# ---- a verdict is conditional on its list: without the true cause others take its place, or none does --------
without = study.replace(measured=measured).diagnose(others, seed=0)
print(f"without it in the list: {without}")
print(f"\n{study.simulator.calls} simulator calls")
