"""Blocks that deform: elasticity in space and in a plane, and the modal shapes every engine may give a convex block."""

from limitmason.deformable.body import Body
from limitmason.deformable.elasticity import PLANE_STRAIN, PLANE_STRESS, SOLID, STATES, Elasticity, plane_normal
from limitmason.deformable.modes import modal_block, modal_blocks
from limitmason.deformable.polynomials import polynomial_block, polynomial_blocks

__all__ = [
    "PLANE_STRAIN", "PLANE_STRESS", "SOLID", "STATES", "Body", "Elasticity", "modal_block", "modal_blocks",
    "plane_normal", "polynomial_block", "polynomial_blocks",
]  # fmt: skip
