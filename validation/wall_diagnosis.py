"""What models of the measured walls get wrong, as a study of causes; and what planted campaigns it would find.

    python -m validation.wall_diagnosis --store FOLDER --out FILE

prints the parts of the page ``measured-walls.md`` that :mod:`validation.measured_walls` puts in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from limitmason import causes
from limitmason.causes import Cause
from limitmason.diagnosis import Observation, Study
from limitmason.validation.wall_causes import (
    COVARIATES,
    FORCE,
    MODE,
    REPLICATES,
    UNITS,
    WallModel,
    as_specimens,
    responses,
    wall_causes,
)

KINDS: Mapping[str, tuple[str, ...]] = {
    "first": ("bond_lost", "cohesion_lost", "heads_lost", "units_weaker", "units_diagonal", "webs_weaker", "toe_weaker",
              "rig_turns", "load_rises", "stiffness_lost"),
    "laws": ("cohesion_lost", "heads_carry", "units_weaker", "webs_weaker", "toe_weaker", "rig_turns", "load_rises",
             "overlap_short", "stiffness_lost"),
}  # fmt: skip
"""Causes that are offered, by the model they are nested in."""

LEVELS = 4  # most sizes of a cause at which a model is solved


def observations(walls: Sequence[str], spreads: Mapping[str, float], kinds: Sequence[str] = ()) -> list[Observation]:
    """What was measured on some walls, with the scatter of repeated walls and, of forces, that of the inputs.

    Parameters
    ----------
    walls : numbers
    spreads : of ln V by the inputs of every wall
    kinds : quantities; all where empty
    """
    found = []
    for wall in walls:
        for quantity in kinds or tuple(REPLICATES):
            inputs = spreads[wall] if quantity == FORCE else 0.0
            kind = "pattern" if quantity == MODE else "force" if quantity == FORCE else "deformation"
            found.append(Observation(
                wall, quantity, responses()[wall][quantity], math.hypot(REPLICATES[quantity], inputs), UNITS[quantity],
                kind, "identity" if quantity == MODE else "log",
            ))  # fmt: skip
    return found


def study_of(
    base: str, walls: Sequence[str], spreads: Mapping[str, float], store: Path, quantities: Sequence[str] = ()
) -> Study:  # fmt: skip
    """A study of measured walls by one block model; campaigns may share a part of the noise."""
    specimens = as_specimens(walls)
    offered: tuple[Cause, ...] = (*wall_causes(KINDS[base]), causes.ALL["gain"]())
    return Study(
        specimens, WallModel(base, store / f"causes_{base}.jsonl"), observations(walls, spreads, quantities),
        covariates=COVARIATES, groups=[s["campaign"] for s in specimens], shared=("campaign",), levels=LEVELS,
        pair_tables="additive", causes=offered,
    )  # fmt: skip
