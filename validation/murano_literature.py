"""Joint properties of 33 models of stone masonry in the literature, with medians beside the averages that were printed.

>>> from validation import murano_literature as literature
>>> literature.summary("dry")["normal stiffness"].median
5.0
"""

from collections.abc import Mapping
from statistics import fmean, median
from typing import NamedTuple

from limitmason.checks import choice
from limitmason.experiments.experiment import Quantity
from limitmason.experiments.source_folder import TextTable, read_table

NAME = "murano-u-walls"

MASONRY = ("dry", "mortar")
COLUMNS: Mapping[str, str] = {
    "normal stiffness": "kn", "shear stiffness": "ks", "tensile strength": "ft", "cohesion": "c",
    "friction angle": "phi",
}
"""Property and its column."""

TIES: Mapping[str, str] = {"shear_stiffness": "normal_stiffness / 2", "cohesion": "1.25 * tensile_strength"}
"""Ratios that the Murano paper keeps while it fits stiffness first and strength second; ``ties`` of ``lm.calibrate``.

Its section 6.2 has 1.5 for the 1.25 of section 5; its final mortared set has 0.19 / 0.15 = 1.27.
"""


class Summary(NamedTuple):
    """One property of dry or mortared joints: number of rows, printed average, mean and median of the rows, unit."""

    rows: int
    printed: float
    mean: float
    median: float
    unit: str


def joints(masonry: str) -> dict[str, dict[str, Quantity]]:
    """Properties by row, "dry-01" to "dry-20" or "mortar-01" to "mortar-13".

    A blank cell is left out.

    A property that is printed as a range is the middle of it, and its note says so.

    Parameters
    ----------
    masonry : "dry" or "mortar"

    Raises
    ------
    InputError
        For other masonry.
    """
    choice("masonry", masonry, MASONRY)
    table, out = read_table(NAME, "joints.csv"), {}
    for row in table.rows:
        if row["masonry"] == masonry:
            found = {name: _value(table, row, column) for name, column in COLUMNS.items()}
            out[row["specimen"]] = {name: value for name, value in found.items() if value is not None}
    return out


def _value(table: TextTable, row: Mapping[str, str], column: str) -> Quantity | None:
    low, high = row[f"{column}_low"], row[f"{column}_high"]
    if not low:
        return None
    note = "" if low == high else f"middle of {low} to {high}"
    return Quantity(0.5 * (float(low) + float(high)), table.units[f"{column}_low"], note)


def summary(masonry: str) -> dict[str, Summary]:
    """Every property of dry or mortared joints, with arguments as :func:`joints`.

    A stiffness of zero is no stiffness and is left out.
    """
    rows = joints(masonry)
    printed = read_table(NAME, "joint_averages.csv").row(masonry, "masonry")
    out = {}
    for name, column in COLUMNS.items():
        found = [row[name] for row in rows.values() if name in row]
        kept = [float(v) for v in found if v > 0.0 or "stiffness" not in name]
        out[name] = Summary(len(kept), float(printed[column]), fmean(kept), median(kept), found[0].unit)
    return out
