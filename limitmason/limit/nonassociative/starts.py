"""Where runs of the sequential scheme start: slopes, and random normal forces.

How many there are, and with which seed, is said by :mod:`limitmason.limit.nonassociative.search`.
"""

import numpy as np

from limitmason.arrays import Array
from limitmason.limit.nonassociative.force_program import ForceProgram
from limitmason.limit.nonassociative.joint_law import JointLaw, split

HIDES = 2.0
"""Dilatancy over friction below which a slope hides it, in units of the smallest slope of the scheme [-]: chosen."""

NOISE = 0.7
"""Standard deviation of the logarithm of normal forces of a disturbed start [-].

With ``RANDOM_FORCE`` it spreads starts over what forces in a wall differ by: both chosen.
"""

RANDOM_FORCE = 4.0
"""Largest normal force of a start with any forces, over the total load per point [-]."""

UNLOADED_FORCE, UNLOADED_WEIGHT = 0.02, 0.01
"""Share of the largest force, and of a weight, added so that joints without force take part [-]: chosen."""

STEEP = 1.75
"""Friction tan(phi) above which runs from random forces take this one, about 60 degrees [-]: chosen."""


def slopes_for(law: JointLaw, slopes: tuple[float, ...]) -> tuple[float, ...]:
    """The ``slopes`` of the scheme [-], and a smaller one where joints dilate little."""
    dilating = (law.tan_psi > 0) & ~law.dilatant
    if dilating.any():
        # a slope that hides a small dilatancy leads to states of psi = 0, which no polish brings back
        ratio = float((law.tan_psi[dilating] / law.tan_phi[dilating]).min())
        if ratio < HIDES * min(slopes):
            return 0.1 * ratio, *slopes  # well below the dilatancy
    return slopes


def no_steeper(law: JointLaw) -> JointLaw:
    """The law with friction of at most ``STEEP``, or psi where that is more.

    Frozen cones of steep friction hold whatever forces they begin with, so that a run ends next to the associative
    state. A state of this law that slides nowhere keeps the true one as well; others are polished to it.
    """
    return law._replace(tan_phi=np.minimum(law.tan_phi, np.maximum(STEEP, law.tan_psi)))


def random_start(
    law: JointLaw, forces: ForceProgram, good: Array, random: np.random.Generator, k: int
) -> tuple[str, Array | None]:
    """Normal forces to start the sequential scheme from, of four kinds in turn.

    They are random but admissible, those of the best state disturbed, the mean of both, or any random ones.

    Parameters
    ----------
    forces : program of the admissible forces
    good : normal forces N' of the best state so far, scaled, shape (m,)
    k : number of the start, which chooses the kind

    Returns
    -------
    name : what it is
    normal : normal forces N', scaled, shape (m,), or None without any
    """
    m = len(good)
    kind = ("admissible", "disturbed", "mean", "any")[k % 4]
    if kind == "disturbed":
        noise = np.exp(NOISE * random.standard_normal(m))
        return "best disturbed", good * noise + UNLOADED_FORCE * good.max(initial=0.0) * random.random(m)
    if kind == "any":
        return "random forces", RANDOM_FORCE * law.total / m * random.random(m)
    # least sum of randomly weighted normal forces, an end of the admissible set
    weight = np.zeros((m, law.components))
    weight[:, 0] = random.random(m) + UNLOADED_WEIGHT
    answer = forces.solve(0.0, weight.ravel())
    if answer is None:
        return "random admissible forces", None
    normal = np.maximum(split(law, answer[1])[0], 0.0)
    if kind == "admissible":
        return "random admissible forces", normal
    return "mean of best and random forces", 0.5 * (normal + good)
