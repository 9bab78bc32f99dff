"""Terms added to the joint law, as a package of someone else would have them, and two blocks to try them on."""

from dataclasses import dataclass

import limitmason as lm
from limitmason.model.joint_term import JointTerm


@dataclass(frozen=True)
class Wear(JointTerm):
    """Cohesion and friction that wear off linearly over a slip."""

    title = "wear"
    words = "wears off"
    cohesion_over: float
    friction_over: float = 1e9

    @staticmethod
    def strength(tan_phi, tan_psi, cohesion, tension, slip, damage, cohesion_over, friction_over):
        left = [max(1.0 - slip / over, 0.0) for over in (cohesion_over, friction_over)]
        return tan_phi * left[1], tan_psi, cohesion * left[0], tension


@dataclass(frozen=True)
class Weaker(JointTerm):
    """A half of the cohesion at once, which no term may take."""

    title = words = "halved"

    @staticmethod
    def strength(tan_phi, tan_psi, cohesion, tension, slip, damage):
        return tan_phi, tan_psi, 0.5 * cohesion, tension


def stack(joint):
    outlines = [[(0, 0), (0.4, 0), (0.4, 0.1), (0, 0.1)], [(0.1, 0.1), (0.3, 0.1), (0.3, 0.2), (0.1, 0.2)]]
    return lm.Assembly.from_polygons(outlines, thickness=0.2, joint=joint, fixed=[0])
