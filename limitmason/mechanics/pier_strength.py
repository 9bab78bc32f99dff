"""Horizontal force of a wall in plane under axial load: four formulas from numbers, the smallest governs."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitmason.checks import not_negative, positive
from limitmason.errors import InputError

SLENDEREST = 1.5
"""Height over length above which diagonal cracking is no weaker, with 1 as the least (Turnsek and Cacovic) [-]."""

CRUSHED = 0.85
"""Part of the strength in the stress block at the toe of a wall that rocks [-]."""

SHEAR_IN_UNITS = 2.3
"""Shear stress at the middle of a unit over the wall's mean, in the Circular's formula of units that crack [-]."""


class WallForces(NamedTuple):
    """Horizontal forces [N] of four formulas, of which the smallest governs."""

    rocking: float
    sliding: float
    diagonal_cracking: float
    stepped_cracking: float

    @property
    def smallest(self) -> float:
        """The force of the wall [N]."""
        return min(self)

    @property
    def governing(self) -> str:
        """Name of the formula that gives the smallest force.

        Of equal ones it is the first.
        """
        return self._fields[self.index(self.smallest)].replace("_", " ")

    @property
    def mode(self) -> str:
        """F where rocking governs, S for the other three."""
        return "F" if self.governing == "rocking" else "S"


def wall_forces(
    length: float, height: float, thickness: float, zero_moment: float, *,
    stress: float, strength: float, cohesion: float, friction: float, diagonal_strength: float,
    unit: tuple[float, float],
) -> WallForces:
    """Return the horizontal force of a rectangular wall under axial load by four formulas [N].

        rocking with a stress block   N L / (2 H0) (1 - s0 / (0.85 fc))
        sliding                       min[(1.5 c L t + mu N) / (1 + 3 c H0 t / N), mu N + c L t]
        diagonal cracking             L t ft / b sqrt(1 + s0 / ft)
        stepped cracking              (c + mu s0) L t / (1 + 2 mu hb / lb)

    N = s0 L t; b = H / L, not below 1 nor above 1.5. In sliding cohesion acts on the compressed length of a section
    without tension and with linear stress, l = 3 (L / 2 - V H0 / N) <= L.

    Parameters
    ----------
    length, height, thickness : L, H, t [m]
    zero_moment : H0, height of zero moment above the foot [m]
    stress, strength : s0, fc [Pa], compression positive, s0 on the gross section
    cohesion, friction : c [Pa], mu [-] of bed joints
    diagonal_strength : ft [Pa], of a diagonal compression test
    unit : length and height of a unit, lb, hb [m]

    Raises
    ------
    InputError
        For a number that is not positive, and a stress that is not below the strength.

    Notes
    -----
    Wrong where unfilled head joints open before anything else, and for walls with openings. The weight of the wall is
    left out. No bound of limit analysis: the last two compare elastic stresses with strengths.

    Source: rocking and sliding as in EN 1996-1-1 and EN 1998-3 (Magenes and Calvi 1997); diagonal cracking of Turnsek
    and Cacovic (1971), stepped cracking of Mann and Mueller (1982).
    """
    try:
        unit_length, unit_height = unit
    except (TypeError, ValueError):
        raise InputError(f"unit must be length and height of a unit [m], got {unit!r}") from None
    numbers = {"length": length, "height": height, "thickness": thickness, "zero_moment": zero_moment,
               "stress": stress, "strength": strength, "friction": friction,
               "diagonal_strength": diagonal_strength, "unit length": unit_length, "unit height": unit_height}
    for name, value in numbers.items():
        positive(name, value)
    not_negative("cohesion", cohesion)
    if not stress < strength:
        raise InputError(f"stress {stress:g} Pa is not below strength {strength:g} Pa: the wall crushes under its load")
    area = length * thickness
    load = stress * area
    rocking = 0.5 * load * length / zero_moment * (1.0 - stress / (CRUSHED * strength))
    # cohesion acts on the compressed length 3 (l / 2 - e) only, with e = V zero_moment / N
    cracked = (1.5 * cohesion * area + friction * load) / (1.0 + 3.0 * cohesion * zero_moment * thickness / load)
    slender = min(max(height / length, 1.0), SLENDEREST)
    return WallForces(
        max(rocking, 0.0),  # between 0.85 fc and fc nothing is left to rock on
        min(cracked, friction * load + cohesion * area),  # the compressed length is no more than all of it
        area * diagonal_strength / slender * math.sqrt(1.0 + stress / diagonal_strength),
        (cohesion + friction * stress) * area / (1.0 + 2.0 * friction * unit_height / unit_length),
    )


class CircularPierForces(NamedTuple):
    """Shear of a pier by diagonal cracking [N], of irregular bond and, by two ways of cracking, of regular bond."""

    irregular: float
    stepped: float
    through_units: float

    @property
    def regular(self) -> float:
        """Of regular bond: stepped cracks, unless the units crack before [N]."""
        return min(self.stepped, self.through_units)


def circular_pier_forces(
    length: float, height: float, thickness: float, *, stress: float, shear_strength: float, cohesion: float,
    friction: float, interlocking: float, unit_tension: float,
) -> CircularPierForces:
    """Return the shear of a pier in plane after the Italian Circular of 2019, C8.7.1.16 to C8.7.1.18.

        irregular bond   l t 1.5 tau0 / b sqrt(1 + s0 / (1.5 tau0))
        stepped crack    l t / b (fv0 + mu s0) / (1 + mu phi)
        through units    l t fbt / (2.3 b) sqrt(1 + s0 / fbt)

    with b = h / l, not below 1 nor above 1.5.

    Parameters
    ----------
    length, height, thickness : l, h, t [m]
    stress : s0, compression positive [Pa]
    shear_strength : tau0 of irregular masonry [Pa]
    cohesion, friction : fv0 [Pa], mu [-] of bed joints
    interlocking : phi, height of a course over the lap of units in it [-]
    unit_tension : fbt of a unit [Pa]

    Raises
    ------
    InputError
        Naming the number that is not positive.

    Notes
    -----
    Design values are divided by their factors before. Wrong for walls with openings; no bound of limit analysis.
    Source: Circolare 21 gennaio 2019 n. 7, C8.7.1.3.1.1.
    """
    numbers = {"length": length, "height": height, "thickness": thickness, "stress": stress,
               "shear_strength": shear_strength, "friction": friction, "interlocking": interlocking,
               "unit_tension": unit_tension}
    for name, value in numbers.items():
        positive(name, value)
    not_negative("cohesion", cohesion)
    area, slender = length * thickness, min(max(height / length, 1.0), SLENDEREST)
    # mean shear is 2/3 of the largest in a rectangle: ft = 1.5 tau0
    return CircularPierForces(
        area * 1.5 * shear_strength / slender * math.sqrt(1.0 + stress / (1.5 * shear_strength)),
        area / slender * (cohesion + friction * stress) / (1.0 + friction * interlocking),
        area * unit_tension / (SHEAR_IN_UNITS * slender) * math.sqrt(1.0 + stress / unit_tension),
    )
