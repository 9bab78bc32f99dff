"""How a structure failed, by rule, from the joints that have opened and slid."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.model import Assembly

MODES = SOLDIER, DIAGONAL, SLIDING, ROCKING, CRUSHING, MIXED, NONE = (
    "soldier bending", "diagonal", "sliding", "rocking", "crushing", "mixed", "none",
)

MOST = 0.5
"""Part of the movement that one kind must have to give the mode its name [-]."""

SOME = 0.2
"""Part of the movement from which a kind counts [-]."""

# chosen, as the two above
_BESIDE = 0.25  # part of the movement that upright joints may have where a wall slides or rocks at one level [-]
_IN_STEPS = 0.1  # part that they have at least where level joints at several levels crack in steps [-]

# vertical components of unit vectors [-]
_LEVEL = np.sqrt(0.5)  # of a joint's normal: within 45 degrees of the vertical
_UPRIGHT = 0.7  # of a unit's length: within 45.6 degrees of it, as a soldier stands


class Mode(NamedTuple):
    """Name of a mode and the parts of all movement of joints that it rests on.

    Each part is 0 to 1 and weighed by area [-]. ``soldiers``: opening and slip between upright units; ``head``: of all
    other upright joints; ``bed_slip``, ``bed_opening``: of level joints; ``crushed``: closing beyond the compressive
    strength; ``one_level``: of the level joints' movement, the part at the level with the most.
    """

    name: str
    soldiers: float = 0.0
    head: float = 0.0
    bed_slip: float = 0.0
    bed_opening: float = 0.0
    crushed: float = 0.0
    one_level: float = 0.0

    def __str__(self) -> str:
        """Name and the parts behind it."""
        if self.name == NONE:
            return self.name
        return (
            f"{self.name} (movement: {self.soldiers:.0%} between soldiers, {self.head:.0%} other head joints, bed "
            f"joints {self.bed_slip:.0%} slip and {self.bed_opening:.0%} opening; {self.one_level:.0%} of that at one "
            f"level{f', crushing {self.crushed:.0%}' if self.crushed > 0.0 else ''})"
        )


def failure_mode(assembly: Assembly, opening: Array, slip: Array, crushed: Array) -> Mode:
    """Mode of failure from the movements of the joints.

    Movements are weighed by area, and the first of these rules that holds gives the name. Half of all by crushing is
    "crushing". Half of all in level joints, most of it at one level, and less than a quarter in upright ones is
    "sliding", or "rocking" where opening is more than slip. A fifth in level joints at several levels, and a tenth in
    upright ones, is "diagonal": a crack in steps. A fifth between soldiers is "soldier bending". All else is "mixed".

    Parameters
    ----------
    assembly : whose joints moved; x and y are level, z upwards
    opening, slip, crushed : largest of every interface since the drive began [m], shape (k,); NaN, of joints that found
        new contacts, counts as nothing

    Notes
    -----
    A rule of thumb on sums: a wall that slides at one place and cracks at another is called by the larger movement.
    """
    x = assembly.arrays
    # movement times area [m3], shape (k,)
    opened, slid, closed = (np.maximum(np.nan_to_num(v), 0.0) * x.area for v in (opening, slip, crushed))
    moved = opened + slid
    total = float((moved + closed).sum())
    if not total > 0.0:
        return Mode(NONE)
    level = np.abs(x.normal[:, 2]) > _LEVEL
    upright = np.array([b.axis is not None and abs(b.axis[2]) > _UPRIGHT for b in assembly.blocks])
    between = ~level & upright[x.block_a] & upright[x.block_b]
    # levels told apart as places are in this assembly, or by a nanometre
    heights = np.round(x.centre[:, 2] / max(assembly.tolerance, 1e-9))
    at_level = [float(moved[level & (heights == z)].sum()) for z in np.unique(heights[level])]
    bed = float(moved[level].sum())
    soldiers, head = float(moved[between].sum()) / total, float(moved[~level & ~between].sum()) / total
    bed_slip, bed_opening = float(slid[level].sum()) / total, float(opened[level].sum()) / total
    one_level, crush = max(at_level, default=0.0) / max(bed, 1e-300), float(closed.sum()) / total
    if crush >= MOST:
        name = CRUSHING
    elif bed / total >= MOST and one_level >= MOST and soldiers + head < _BESIDE:
        name = SLIDING if bed_slip >= bed_opening else ROCKING
    elif bed / total >= SOME and one_level < MOST and soldiers + head >= _IN_STEPS:
        name = DIAGONAL
    elif soldiers >= SOME:
        name = SOLDIER
    else:
        name = MIXED
    return Mode(name, soldiers, head, bed_slip, bed_opening, crush, one_level)
