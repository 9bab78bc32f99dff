"""Table 10 of Murano et al. recomputed beside the printed values, and what that says about it.

Two-leaf stone walls on a U plan, dry (DS) and with mortar (REGW), pushed out of plane by an airbag. The light-damage
loads of test and models are compared there with loads of mechanisms A, B and D.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from limitmason.errors import InputError
from mechanisms.facade_rocking import compound_rocking, rocking_terms, simple_rocking
from mechanisms.friction import FrictionSums
from mechanisms.horizontal_flexure import horizontal_flexure
from mechanisms.optimum import ratio
from mechanisms.parameters import Facade

DENSITY = 2450.0
GRAVITY_OF_TABLE = 10.0
"""Murano et al. round gravity to 10 m/s2 in the loads of Table 10."""

FRICTION_ANGLE_DEG: Mapping[str, float] = {"DS": 10.0, "REGW": 33.0}
PRINTED_FACTOR: Mapping[tuple[str, str], float] = {
    ("DS", "A"): 0.09, ("DS", "B"): 0.302, ("DS", "D"): 0.083,
    ("REGW", "A"): 0.231, ("REGW", "B"): 0.391, ("REGW", "D"): 0.270,
}
PRINTED_LOAD: Mapping[tuple[str, str], float] = {
    ("DS", "A"): 2.01e3, ("DS", "B"): 3.38e3, ("DS", "D"): 0.97e3,
    ("REGW", "A"): 5.16e3, ("REGW", "B"): 7.46e3, ("REGW", "D"): 1.45e3,
}

HINGE: Mapping[str, int] = {"hinge_courses": 4}
CRACK = math.tan(math.radians(13.0))
"""Hinge and crack that section 6.3 states; k = 0.5 there."""


class LightDamageRow(NamedTuple):
    """A line of Table 10: wall, who found it, initial stiffness [N/m], displacement [m], load [N], percentages.

    The percentages are the printed differences to the loads of A, B and D.
    """

    wall: str
    by: str
    stiffness: float
    displacement: float
    load: float
    percent: tuple[float, float, float]


LIGHT_DAMAGE: tuple[LightDamageRow, ...] = (
    LightDamageRow("DS", "test", 2.15e6, 0.47e-3, 0.99e3, (50, 71, 2)),
    LightDamageRow("DS", "3DEC", 2.80e6, 0.48e-3, 1.31e3, (35, 61, 26)),
    LightDamageRow("DS", "FE macro", 3.10e6, 0.57e-3, 0.83e3, (59, 75, 14)),
    LightDamageRow("DS", "FE micro", 4.18e6, 0.50e-3, 2.05e3, (2, 39, 53)),
    LightDamageRow("REGW", "test", 29.80e6, 0.33e-3, 9.63e3, (46, 23, 73)),
    LightDamageRow("REGW", "3DEC", 46.09e6, 0.22e-3, 9.93e3, (48, 25, 74)),
    LightDamageRow("REGW", "FE macro", 46.42e6, 0.24e-3, 10.91e3, (53, 32, 76)),
    LightDamageRow("REGW", "FE micro", 43.08e6, 0.23e-3, 9.71e3, (47, 23, 73)),
)

VERDICT = (
    "Reproduced: the weight behind the A loads (22.33 kN, the whole facade at 2450 kg/m3 and 10 m/s2), the line load "
    "(20 kN over 3.65 m = 5.48 kN/m), the friction coefficients, and all percentages but those of REGW-D, from the "
    "printed loads. Not reproduced: A by any straightforward reading (+138 %, +51 %); one fitted reading comes within "
    "1 % (leaf thickness in the weight, load on the toe line, small-block arms), found among 1 920 and to be taken as "
    "a fit. B and D by none; B's loads and factors fit no common weight for two walls of equal size, and the printed "
    "percentages of REGW-D need about 2.6 kN where the table prints 1.45 kN. Nor at the hinge, crack and contact "
    "factor that the text states. Table 10 cannot serve as a check of B and D."
)


class Table10Row(NamedTuple):
    """A mechanism of a wall: factors [-] and loads [N], printed and recomputed.

    recomputed : closed form with the full thickness and the load on the facade's middle, worst hinge and crack, k = 1
    as_stated : the same closed form at what the text states: hinge and crack 4 courses down, cracks at 13 degrees (B
        and D), k = 0.5 and the interaction of shear and torsion (D)
    fitted : the one reading that meets A; None for B and D
    """

    wall: str
    mechanism: str
    printed_factor: float
    printed_load: float
    printed_weight: float
    recomputed: float
    as_stated: float
    fitted: float | None


def murano_facade(wall: str) -> Facade:
    """Return the facade of DS or REGW as its authors idealise it for limit analysis.

    Parameters
    ----------
    wall : "DS" or "REGW"; they differ in friction alone (10 and 33 degrees)

    Notes
    -----
    Source: Murano et al., sections 2 and 6.3: 2.25 x 1.35 x 0.30 m, 6 courses of 0.225 m, staggering 0.144 m, side
    walls 0.30 m, 5.48 kN/m on all of them (physically the 20 kN stood on the side walls). g = 10 m/s2.
    """
    if wall not in FRICTION_ANGLE_DEG:
        raise InputError(f"wall must be one of {tuple(FRICTION_ANGLE_DEG)}, got {wall!r}")
    load = line_load()
    return Facade(
        length=2.25, thickness=0.30, courses=6, course_height=0.225, staggering=0.144,
        unit_weight=DENSITY * GRAVITY_OF_TABLE, friction=math.tan(math.radians(FRICTION_ANGLE_DEG[wall])),
        side_walls=2, overload=load, side_overload=load,
    )


def line_load() -> float:
    """Return the top load per length of wall, 20 kN over 1.95 + 2 x 0.85 m [N/m]."""
    return 20e3 / (1.95 + 2 * 0.85)


def fitted_simple_rocking(wall: str) -> float:
    """Return mechanism A in the one reading that comes within 1 % of the printed 0.09 and 0.231: a documented fit.

    Leaf of 0.15 m in the facade's weight and arm, load on the toe line, hinge 4 courses down, side walls of 0.30 m with
    small-block arms H_k/3 and H_k/2.

    Parameters
    ----------
    wall : "DS" or "REGW"

    Notes
    -----
    1 920 readings were tried (docs/mechanisms.md, section 6) and two met both walls: not what was computed.
    """
    facade = murano_facade(wall).changed(thickness=0.15, side_wall_thickness=0.30, overload_offset=0.0)
    hinge = 4
    sums, height = rocking_terms(facade, hinge, hinge).friction, hinge * facade.course_height
    sums = FrictionSums(sums.weight, height / 3.0, sums.overload, height / 2.0)
    terms = rocking_terms(facade, hinge, hinge, friction=sums)
    return ratio(terms.numerator, terms.denominator, 0.0)


def table_10() -> tuple[Table10Row, ...]:
    """Return mechanisms A, B and D of both walls, printed and recomputed.

    Notes
    -----
    The structure of eqs (24) to (26) is theirs, after Casapulla et al.; the terms are derived here
    (docs/mechanisms.md), since the tables they come from were not at hand. ``VERDICT`` says what the comparison
    supports.
    """
    rows = []
    for wall in FRICTION_ANGLE_DEG:
        facade = murano_facade(wall)
        found = {
            "A": simple_rocking(facade).collapse_multiplier,
            "B": compound_rocking(facade, crossed_courses="hinge").collapse_multiplier,
            "D": horizontal_flexure(facade).collapse_multiplier,
        }
        stated = {
            "A": simple_rocking(facade, **HINGE).collapse_multiplier,
            "B": compound_rocking(facade, **HINGE, crossed_courses=4, crack_tangent=CRACK).collapse_multiplier,
            "D": horizontal_flexure(
                facade, **HINGE, crack_tangent=CRACK, contact_factor=0.5, interaction=True
            ).collapse_multiplier,
        }
        for name, value in found.items():
            factor, load = PRINTED_FACTOR[wall, name], PRINTED_LOAD[wall, name]
            fitted = fitted_simple_rocking(wall) if name == "A" else None
            rows.append(Table10Row(wall, name, factor, load, load / factor, value, stated[name], fitted))
    return tuple(rows)


def percentages(row: LightDamageRow, loads: Mapping[tuple[str, str], float] = PRINTED_LOAD) -> tuple[float, ...]:
    """Return the differences between a light-damage load and those of A, B and D, relative to the larger [%].

    Parameters
    ----------
    row : of ``LIGHT_DAMAGE``
    loads : of the mechanisms [N], by wall and mechanism

    Notes
    -----
    Relative to the larger of the two is how the printed percentages come out.
    """
    out = []
    for name in "ABD":
        load = loads[row.wall, name]
        out.append(100.0 * abs(row.load - load) / max(row.load, load))
    return tuple(out)
