"""One answer by the name of a theory: value, range about it, and what that range is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from limitmason.methods import available_methods, predict
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import ALMOST_SOLVED, SOLVED, Prediction

ASSOCIATIVE, NON_ASSOCIATIVE, DEM, MECHANISMS = "associative", "non-associative", "dem", "mechanisms"
THEORIES = (ASSOCIATIVE, NON_ASSOCIATIVE, DEM, MECHANISMS)
BUDGET = ("stiffness", "contact points", "rate")

_LIMIT = (ASSOCIATIVE, NON_ASSOCIATIVE)
_NAN = float("nan")


class Range(NamedTuple):
    """Low and high end about a multiplier [-], NaN where there is none, and what they are."""

    low: float
    high: float
    meaning: str


def check_method(method: str) -> None:
    """Refuse a name that is neither a flow rule of limit analysis nor a method of ``limitmason.methods``."""
    known = {*_LIMIT, *available_methods()}
    if method not in known:
        raise ValueError(f"unknown method {method!r}; available: {', '.join(sorted(known))}")


def one_of_many(method: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Options of one run of a study: the DEM without its error budget, dearer than its answer, unless asked."""
    return {"error_budget": (), **options} if method == DEM else dict(options)


def solve(assembly: Assembly, loads: Loads, method: str, options: Mapping[str, Any]) -> Prediction:
    """Prediction by a flow rule of limit analysis ("associative", "non-associative") or any method by its name."""
    if method in _LIMIT:
        return predict(assembly, loads, "limit", flow_rule=method, **options)
    return predict(assembly, loads, method, **options)


def range_of(found: Prediction) -> Range:
    """Range of a prediction from what its method recorded.

    Non-associative: multipliers of the certified states found. DEM: the bracket of the search, widened by what
    the repeats of its error budget reach beyond it, summed on each side. Mechanisms: friction factor omega = 0 and 1 of
    an estimate; a bound has no prescribed friction and no range.
    """
    value, details = found.collapse_multiplier, found.details
    if found.status not in (SOLVED, ALMOST_SOLVED) or not math.isfinite(value):
        return Range(_NAN, _NAN, "")
    if "interval_at_mechanism" in details:
        ends = [e for e in (*details["interval_at_mechanism"], *details["spread"], value) if math.isfinite(e)]
        return Range(min(ends), max(ends), "certified states found")
    if "smallest moving" in details:
        low, high = found.interval or (_NAN, _NAN)
        budget = details["error budget"]
        undecided = [f"{name} undecided" for name, row in budget.items() if not math.isfinite(row["change"])]
        parts = ["bracket", *(name for name, row in budget.items() if math.isfinite(row["change"])), *undecided]
        return Range(low, high, f"error budget: {', '.join(parts)}" if budget else "bracket of the search")
    if "omega_bracket" in details and details.get("smallest_upper_bound_of") is None:
        ends = [*details["omega_bracket"], value]
        if max(ends) - min(ends) > 1e-9 * max(map(abs, ends)):
            return Range(min(ends), max(ends), "friction factor omega 0 to 1")
    return Range(_NAN, _NAN, "")


def as_row(found: Prediction) -> dict[str, Any]:
    """Multiplier, range and status as columns of a table."""
    low, high, _ = range_of(found)
    return {
        "multiplier": float(found.collapse_multiplier), "low": float(low), "high": float(high), "status": found.status,
    }  # fmt: skip
