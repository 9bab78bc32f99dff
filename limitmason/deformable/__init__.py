"""Blocks that deform: elasticity in space and in a plane, and the shapes every engine may give a convex block."""

from limitmason.deformable.elasticity import PLANE_STRAIN, PLANE_STRESS, SOLID, STATES, Elasticity, plane_normal
from limitmason.deformable.polynomial_body import Body
from limitmason.deformable.ritz_shapes import polynomial_block, polynomial_blocks
from limitmason.deformable.simple_shapes import simply_deformable_block, simply_deformable_blocks
from limitmason.display.notebook import shows

__all__ = [
    "PLANE_STRAIN", "PLANE_STRESS", "SOLID", "STATES", "Body", "Elasticity", "plane_normal", "polynomial_block",
    "polynomial_blocks", "simply_deformable_block", "simply_deformable_blocks",
]

shows(__name__)
