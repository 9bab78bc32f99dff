"""The distinct element method as a method: ``limitmason.predict(..., "dem")``."""

import math

from dem.multiplier.collapse import collapse
from dem.papers import COLLAPSE
from dem.push import push
from dem.settings import CHECKS, DemSettings
from dem.stages.simulate import simulate
from limitmason.answers.method import DISPLACED, Look, Method
from limitmason.answers.results import ALMOST_SOLVED, SOLVED, Prediction, Range


def _bracket_and_budget(found: Prediction) -> Range:
    """The bracket of the search, widened by the changes of its error budget, summed on each side."""
    if found.status not in (SOLVED, ALMOST_SOLVED) or not math.isfinite(found.collapse_multiplier):
        return Range()
    low, high = found.interval or (math.nan, math.nan)
    budget = found.error_budget
    undecided = [f"{name} undecided" for name, row in budget.items() if not math.isfinite(row["change"])]
    parts = ["bracket", *(name for name, row in budget.items() if math.isfinite(row["change"])), *undecided]
    return Range(low, high, f"error budget: {', '.join(parts)}" if budget else "bracket of the search")


DEM = Method(
    "dem",
    collapse,
    DemSettings,
    range_of=_bracket_and_budget,
    look=Look("DEM", "VERMILION", "o"),
    cheap={"error_budget": ()},  # dearer than the answer itself
    stated={"error_budget": CHECKS},
    kept=("error budget",),
    theorem="simulation",
    drive=push,
    follow=simulate,
    references=COLLAPSE,
    levers=DISPLACED,
)
