"""Layouts that the specimens of the Pavia tilting tests may have had, and the values that they are held to."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from limitmason.experiments.pavia_tilting import CORNERS, NAME
from limitmason.experiments.source_folder import read_table

PUBLISHED = ("lambda_3dec_zero_dilatancy", "lambda_3dec_dilatant")
GROUPS = {"S1": "S1-S3", "S2": "S1-S3", "S3": "S1-S3", "S8": "S8-S9", "S9": "S8-S9"}
"""Specimens with one drawing and one 3DEC value in the source, taken as repeats of one layout."""
LAYOUTS = {
    "return_walls": (1, 2),
    "sense": ("outward", "inward"),
    "facade_units": (2, 3, 4, 5, 6, 7, 8, 10, 12),
    "courses": (6, 8, 10, 12, 14, 16, 18, 20, 24),
    "return_units": (1.5, 2, 3, 4, 6),
    "corner": CORNERS,
    "first_through": ("facade", "return"),
}
"""What a specimen may have looked like, argument by argument of :func:`specimen`: assumed, all combinations."""
SEARCH_NOTES = (
    "The plans of S1 to S13 are not published in the sources at hand. **What follows is inferred, not measured**: "
    "layouts of a facade of 80 x 40 x 28 mm blocks held by one or two return walls. Their computed multipliers come "
    "near the two 3DEC values of Godio, Stefanou and Sab 2017 (Table 5) for a specimen. These are for psi = 0 and for "
    "psi = phi = 33.82 deg.",
    "The catalogue is a random draw from all combinations of:",
    "\n".join([
        "| what | values |",
        "|---|---|",
        "| returns | one or two |",
        "| load | outward or inward |",
        f"| blocks of the facade | {', '.join(map(str, LAYOUTS['facade_units']))} |",
        f"| courses | {', '.join(map(str, LAYOUTS['courses']))} |",
        f"| blocks of a return | {', '.join(map(str, LAYOUTS['return_units']))} |",
        "| head joints behind the corner | over the middle of the units below, or whole units from the corner on |",
        "| through the corner in the bottom course | facade or returns |",
        "| blocks in all | at most about 200 |",
    ]),
    "There are no openings, and no other quality of the connection. Both were variables of the tests, so the true "
    "layout need not be in the catalogue.",
    "Both values are computed by the DEM of this package with the published kn = ks = 14 GPa/m. There are 8 contact "
    "points across the facade, 2 in the returns. S1 to S3 and S8 to S9 have one published value each and count once.",
)
"""What a reader must know of a search for the layouts."""


def catalogue(number: int | None = None, *, seed: int = 1, most_blocks: int = 200) -> list[dict[str, Any]]:
    """Layouts from all combinations of ``LAYOUTS``, as arguments of :func:`specimen`, in a random but fixed order.

    Parameters
    ----------
    number : how many of them; None for all. A longer list begins with the shorter one
    seed : of the order
    most_blocks : walls with more blocks, about, are left out [-]
    """
    every: list[dict[str, Any]] = [dict(zip(LAYOUTS, values, strict=True)) for values in product(*LAYOUTS.values())]
    small = [x for x in every if x["courses"] * (x["facade_units"] + x["return_walls"] * x["return_units"])
             <= most_blocks]
    order = np.random.default_rng(seed).permutation(len(small))
    return [small[k] for k in order[:number]]


def published_pairs() -> dict[str, tuple[float, float]]:
    """3DEC multipliers (psi = 0, psi = phi) [-] by specimen; repeats of one layout appear once, as "S1-S3"."""
    return {
        GROUPS.get(r["specimen"], r["specimen"]): (float(r[PUBLISHED[0]]), float(r[PUBLISHED[1]]))
        for r in read_table(NAME, "specimens.csv").rows
    }


def measured_multipliers() -> dict[str, tuple[float, ...]]:
    """Multipliers of the tests, tan(tilt angle) [-], by specimen; several for repeats of one layout."""
    found: dict[str, tuple[float, ...]] = {}
    for r in read_table(NAME, "specimens.csv").rows:
        key = GROUPS.get(r["specimen"], r["specimen"])
        found[key] = (*found.get(key, ()), float(r["lambda_measured"]))
    return found
