"""How the units of a structure deform: the words that every engine takes for its ``blocks``."""

RIGID = "rigid"
"""Not at all."""

LUMPED = "lumped"
"""Not themselves: their compliance is put into the joints."""

MODAL = "modal"
"""In uniform strain, bending and shear, plane faces at the joints, see :func:`limitmason.deformable.modal_block`."""

ELASTIC = "elastic"
"""As elastic bodies seen from their joints, see :func:`limitmason.deformable.polynomial_block`."""

ZONED = "zoned"
"""In zones that strain, and in the plane yield and crack."""
