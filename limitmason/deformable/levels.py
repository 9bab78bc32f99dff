"""How the units of a structure deform: the words that every engine takes for its ``blocks``."""

RIGID = "rigid"
"""Not at all."""

LUMPED = "lumped"
"""Not themselves: their compliance is put into the joints."""

SIMPLY_DEFORMABLE = "simply deformable"
"""In uniform strain, bending and shear, plane at the joints: :func:`limitmason.deformable.simply_deformable_block`.
"""

RITZ = "ritz"
"""In complete polynomials, as Ritz did, seen from their joints: see :func:`limitmason.deformable.polynomial_block`."""

ZONED = "zoned"
"""In zones that strain, and in the plane yield and crack."""
