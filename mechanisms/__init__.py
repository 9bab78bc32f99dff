"""Closed-form collapse mechanisms of masonry walls and arches, from numbers or from an assembly's recipe.

Facades out of plane: simple rocking (A), compound rocking with stepped cracks in the side walls (B), horizontal flexure
(D); overturning, sliding, inclined hinges and Rondelet's rule; stepped cracks in plane; thinnest arches. A, B and D
prescribe their friction: engineering estimates, no bounds of limit analysis; ``Prediction.bound`` says which is what.
Crushing moves no hinge inward here: see ``limitmason.mechanics.pier_strength`` and :func:`limitmason.limit_analysis`.
All are at the reference pose: for alpha(d), the load along the motion, see ``lm.pushover`` (``limitmason.capacity``).
"""

from limitmason.display.notebook import shows
from limitmason.mechanics.pier_strength import CircularPierForces, WallForces, circular_pier_forces, wall_forces
from mechanisms.arch import ArchLimit, arch_limit
from mechanisms.catalogue import NAMES, catalogue, smallest
from mechanisms.classical import inclined_hinge, overturning, rigid_block, rondelet_thickness, sliding, stack
from mechanisms.facade_rocking import compound_rocking, simple_rocking
from mechanisms.friction import (
    FrictionSums,
    bed_joint_friction,
    crack_angle_reduction,
    torsion_radius,
    torsion_shear_curve,
)
from mechanisms.horizontal_flexure import horizontal_flexure
from mechanisms.in_plane import slender_wall, sloping_crack, sloping_crack_limit, stepped_crack
from mechanisms.light_damage import LightDamage, light_damage
from mechanisms.parameters import Facade
from mechanisms.virtual_work_check import PowerBalance, check_contacts, flexure_power, rocking_power

__all__ = [
    "NAMES", "ArchLimit", "CircularPierForces", "Facade", "FrictionSums", "LightDamage", "PowerBalance", "WallForces",
    "arch_limit", "bed_joint_friction", "catalogue", "check_contacts", "circular_pier_forces", "compound_rocking",
    "crack_angle_reduction", "flexure_power", "horizontal_flexure", "inclined_hinge", "light_damage", "overturning",
    "rigid_block", "rocking_power", "rondelet_thickness", "simple_rocking", "slender_wall", "sliding", "sloping_crack",
    "sloping_crack_limit", "smallest", "stack", "stepped_crack", "torsion_radius", "torsion_shear_curve", "wall_forces",
]

shows(__name__)
