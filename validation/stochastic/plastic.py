"""The same draws by perfect plasticity: how much of the spread lies in the mechanism, how much in brittleness."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import limitmason as lm
from limitmason import study
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

from .runs import PANEL, draws

NUMBER = 4
"""Set whose draws are used: strengths only; stiffness means nothing to a limit load."""


def unit_load(wall: Assembly) -> Loads:
    """Own weight, and 1 kN down on the spreader: a multiplier is the load in kN."""
    return Loads.weight(wall).with_point_load(wall, "spreader", (0.0, 0.0, -1e3))


def associative(wall: Assembly, loads: Loads) -> dict[str, Any]:
    """Limit load [kN] at psi = phi."""
    found = lm.predict(wall, loads, "associative")
    return {"load": float(found.collapse_multiplier), "status": found.status}


def non_associative(wall: Assembly, loads: Loads) -> dict[str, Any]:
    """Smallest limit load [kN] at psi = 0 that a quick search finds: a smaller one may exist."""
    found = lm.predict(wall, loads, "non-associative", search="quick", prove=False, measure_jump=False)
    return {"load": float(found.collapse_multiplier), "status": found.status}


RUNS: Mapping[str, tuple[Callable[[Assembly, Loads], dict[str, Any]], float]] = {
    "associative": (associative, 1.0), "non-associative": (non_associative, 0.5),
}
"""Flow rule, and the part of the draws that it is worked out for: the search at psi = 0 takes seconds a draw."""


def compute(
    store: Path, samples: int = 60, progress: Callable[[str], object] | None = None, workers: int = 1,
    rules: tuple[str, ...] = tuple(RUNS),
) -> dict[str, study.Table]:
    """Limit loads of the draws of set 4, by study, kept in files beside the runs."""
    out = {}
    for rule in rules:
        run, part = RUNS[rule]
        for kind in ("spatial", "non-spatial"):
            name = f"plastic-{kind}-{rule}"
            out[name] = study.monte_carlo(
                (PANEL.assembly(), unit_load), max(round(part * samples), 2), run=run, seed=1, scheme="random",
                store=store / f"{name}.jsonl", progress=progress, workers=workers, **draws(NUMBER, kind == "spatial"),
            )
    return out
