"""Inputs of a measured wall with kind and uncertainty: tested, of a code, or assumed as a distribution."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

TESTED, CODE, ASSUMED = "tested", "of a code", "assumed"

CODE_FV0 = (0.1, 0.125, 0.1875, 0.25, 0.375, 0.5)
"""Initial shear strengths that are 1.25 times a characteristic value of EN 1996-1-1 [MPa]."""

_MOST_DECIMALS = 4
"""Decimals of a measured fc; one with more was computed by a code's formula."""

_FM, _FB = 5.0, 10.0
"""Strengths of mortar and units where neither they nor fc are printed [MPa]; chosen."""

CODE_FRICTION = 0.4
"""Characteristic friction coefficient of EN 1996-1-1, 3.6.2 [-]."""

SPREAD: Mapping[tuple[str, str], float] = {
    ("fv0", TESTED): 0.2, ("fv0", CODE): 0.4,
    ("mu", TESTED): 0.1, ("mu", CODE): 0.25,
    ("fc", TESTED): 0.1, ("fc", CODE): 0.25, ("fc", ASSUMED): 0.35,
    ("fb", TESTED): 0.1, ("fb", ASSUMED): 0.35,
    ("ft", TESTED): 0.2, ("ft", ASSUMED): 0.4,
    ("sigma0", TESTED): 0.03,
}
"""Standard deviation of the logarithm of an input; judged, nowhere printed. fv0 and mu are means of a few triplets."""

FRICTION: Mapping[str, tuple[float, float]] = {
    "HC": (0.66, 0.33), "SB-C": (0.60, 0.20), "SB-CS": (0.45, 0.20), "AAC": (0.50, 0.20), "CS": (0.45, 0.20),
    "LAC": (0.50, 0.25),
}
"""Median and spread of the friction that is missing: of the campaigns of this table that state it, one value each.

HC: 9 campaigns with 12 values; SB-C: 4; SB-CS: 1; AAC: 1. CS is taken as SB-CS, LAC lies between: judged.
"""

DIAGONAL_OVER_FC = 0.05
"""Diagonal tensile strength over compressive strength where it is not printed [-]."""

FC_OF_UNITS = 1.2 * 0.45, 0.7, 0.3
"""fc = 1.2 K fb^0.7 fm^0.3 [MPa] where it is not printed: EN 1996-1-1, 3.6.1.2, group 2; mean over characteristic
strength 1.2."""

FB_OVER_FC = 2.0
"""Normalised strength of units over that of the masonry where it is not printed [-]."""


class Input(NamedTuple):
    """An input of a prediction.

    ``value`` is its median in ``unit``, ``kind`` says where it is from, ``spread`` is the standard deviation of its
    logarithm.
    """

    value: float
    unit: str
    kind: str
    spread: float

    def drawn(self, normal: float) -> float:
        """The value at a standard ``normal`` number: the distribution is lognormal."""
        return self.value * math.exp(self.spread * normal)

    def __str__(self) -> str:
        unit = "" if self.unit == "-" else f" {self.unit}"
        return f"{self.value:.4g}{unit}, {self.kind}, +-{100 * self.spread:.0f} % (lognormal)"


def inputs_of(row: Mapping[str, str]) -> dict[str, Input]:
    """Inputs of a row of walls.csv by name: fv0, mu, fc, fb, ft, sigma0.

    The kind is inferred. Taken as of a code are an fv0 that is exactly 1.25 times a code's value, a friction of 0.4,
    and an fc with more than four decimals, which was computed and not measured.
    """
    given = {name: float(row[column]) for name, column in _COLUMNS.items() if row[column]}
    found = {"sigma0": _input("sigma0", given["sigma0"], TESTED)}
    kind = CODE if given["fv0"] in CODE_FV0 else TESTED
    found["fv0"] = _input("fv0", given["fv0"], kind)
    if "mu" in given:
        found["mu"] = _input("mu", given["mu"], CODE if given["mu"] == CODE_FRICTION else TESTED)
    else:
        median, spread = FRICTION[row["unit_type"]]
        found["mu"] = Input(median, "-", ASSUMED, spread)
    found["fc"] = _strength(row, given)
    for name, over_fc in (("fb", FB_OVER_FC), ("ft", DIAGONAL_OVER_FC)):
        tested = name in given
        value = given[name] if tested else over_fc * found["fc"].value
        found[name] = _input(name, value, TESTED if tested else ASSUMED)
    return found


def complete(row: Mapping[str, str]) -> bool:
    """Whether a row of walls.csv has all that a prediction needs.

    Then nothing is assumed.
    """
    return all(row[c] for c in ("fv0", "mu", "fc", "sigma0", "lb", "hb")) and has_shear_span(row)


def has_shear_span(row: Mapping[str, str]) -> bool:
    """Whether the shear span of a row of walls.csv is a number, and no word."""
    return row["H0_over_H"].replace(".", "", 1).isdigit()


def draws(row: Mapping[str, str], number: int, seed: int = 0) -> list[dict[str, float]]:
    """Values of the inputs by name, drawn independently.

    A wall gets the same values whenever it is asked for.

    Parameters
    ----------
    row : of walls.csv
    number : of draws
    seed : of the random numbers
    """
    inputs = inputs_of(row)
    normal = np.random.default_rng([seed, int(row["specimen"])]).standard_normal((number, len(inputs)))
    return [{k: i.drawn(float(z)) for (k, i), z in zip(inputs.items(), draw, strict=True)} for draw in normal]


_COLUMNS = {"fv0": "fv0", "mu": "mu", "fc": "fc", "fb": "fb_norm", "ft": "ft", "sigma0": "sigma0"}
"""Columns of walls.csv by the name of the input."""


def _input(name: str, value: float, kind: str) -> Input:
    """An input of a kind with the spread that was judged for it.

    ``value`` is in the unit of the table.
    """
    return Input(value, "-" if name == "mu" else "MPa", kind, SPREAD[name, kind])


def _strength(row: Mapping[str, str], given: Mapping[str, float]) -> Input:
    """Compressive strength of the masonry [MPa], printed or by a code's power law.

    Parameters
    ----------
    row : of walls.csv
    given : inputs that it prints, as numbers by name
    """
    if "fc" in given:
        decimals = len(row["fc"].partition(".")[2])
        return _input("fc", given["fc"], CODE if decimals > _MOST_DECIMALS else TESTED)
    factor, of_unit, of_mortar = FC_OF_UNITS
    mortar = float(row["fm"]) if row["fm"] else _FM
    return _input("fc", factor * given.get("fb", _FB) ** of_unit * mortar**of_mortar, ASSUMED)
