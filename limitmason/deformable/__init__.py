"""Blocks that deform: elasticity in space and in a plane, and the modal shapes every engine may give a convex block."""

from limitmason.deformable.elasticity import PLANE_STRAIN, PLANE_STRESS, SOLID, STATES, Elasticity, plane_normal
from limitmason.deformable.modes import BENDING, ModalBlock, modal_block, modal_blocks
from limitmason.deformable.polynomials import PolynomialBlock, polynomial_block, polynomial_blocks

__all__ = [
    "BENDING", "PLANE_STRAIN", "PLANE_STRESS", "SOLID", "STATES", "Elasticity", "ModalBlock", "PolynomialBlock",
    "modal_block", "modal_blocks", "plane_normal", "polynomial_block", "polynomial_blocks",
]  # fmt: skip
