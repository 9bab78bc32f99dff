"""Tests of the measured walls as the pages compare them: force of both senses, mode, drifts, rigid bound."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from limitmason.experiments.modern_walls import NAME
from limitmason.experiments.modern_walls.inputs import inputs_of
from limitmason.experiments.source_folder import read_table

ROWS = {r["specimen"]: r for r in read_table(NAME, "walls.csv").rows}
RESPONSES = {r["specimen"]: r for r in read_table(NAME, "responses.csv").rows}


class Measured(NamedTuple):
    """A wall whose response is given: number, campaign, mean of the largest forces of both senses [kN], mode."""

    wall: str
    campaign: str
    force: float
    mode: str


def measured_walls() -> list[Measured]:
    """Walls with a response, in their order."""
    found = []
    for wall, row in RESPONSES.items():
        forces = [float(row[c]) for c in ("V_max_pos", "V_max_neg") if row[c]]
        if forces:
            found.append(Measured(wall, ROWS[wall]["campaign"], float(np.mean(forces)), row["failure_mode"]))
    return found


def mean_of(wall: str, column: str) -> float:
    """Mean of both senses of a printed response, such as "d_Vmax"; NaN where neither is printed."""
    given = [float(v) for sense in ("pos", "neg") if (v := RESPONSES[wall][f"{column}_{sense}"])]
    return float(np.mean(given)) if given else np.nan


def rigid_bound(wall: str) -> float:
    """N L / (2 H0) [kN], above which no wall can be under a constant load."""
    row = ROWS[wall]
    length, stress = float(row["L"]), inputs_of(row)["sigma0"].value
    return 500.0 * stress * length**2 * float(row["t"]) / (float(row["H0_over_H"]) * float(row["H"]))
