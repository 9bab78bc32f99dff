"""What theory demands of several answers to one question, checked.

What was not computed is named, never passed. Measured values are no part of it: predicted over measured is in ``rows``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from limitmason.comparison.rows import NAN, Row
from limitmason.methods import get_method

HOLDS, OPEN, BROKEN, NOT_CHECKED = "holds", "open", "BROKEN", "not checked"
INSIDE = "inside"

_SAME = 1e-6
"""Relative difference of two multipliers that the programs behind them leave."""

_ZERO = 1e-9
"""Difference [-] that they leave where both multipliers are zero, and a relative one allows nothing."""

_ENDS = {"upper": "associative", "admissible": "smallest admissible"}
"""What a missing answer would have given, by the theorem of its method."""


class Finding(NamedTuple):
    """One demand of theory on an answer.

    Parameters
    ----------
    state : "holds", "open", "BROKEN" or "not checked"
    text : the demand and its numbers, in words
    method : by which the answer is
    theorem : whether a mistake of a program alone can break it
    """

    state: str
    text: str
    method: str
    theorem: bool = False

    def __str__(self) -> str:
        """The line of a table."""
        return f"{self.state}: {self.text}"


class Answers:
    """The rows of one question by what they mean: the associative, the smallest admissible, a mechanism, others."""

    def __init__(self, rows: Sequence[Row]) -> None:
        """Sort the answers by what theory they are of; of two by one theory the first row counts."""
        self.rows = tuple(rows)
        self.asked = {get_method(r.method).theorem: r for r in reversed(self.rows)}
        solved = {get_method(r.method).theorem: r for r in reversed(self.rows) if r.solved}
        self.upper, self.lower, self.mechanism = (solved.get(t) for t in ("upper", "admissible", "mechanism"))

    def position(self, row: Row) -> str:
        """Where a simulation lies: "inside", "above by ..." or "below by ...".

        It lies inside where its range meets that from the smallest admissible multiplier to the associative one. The
        position is "" where an end to judge by is missing.

        Parameters
        ----------
        row : answer of the simulation
        """
        if not row.solved:
            return ""
        # a simulation without a range of errors is judged by its value
        low, high = (end if math.isfinite(end) else row.multiplier for end in (row.low, row.high))
        # beyond one end it lies outside, wherever the other one is; inside takes both
        if self.upper and low > (top := self.upper.multiplier) * (1.0 + _SAME) + _ZERO:
            return f"above by {low / top - 1.0:.2%}" if top > 0.0 else f"above by {low - top:.3g}"
        if self.lower and high < (floor := _floor(self.lower)) * (1.0 - _SAME) - _ZERO:
            return f"below by {1.0 - high / floor:.2%}"
        return INSIDE if self.upper and self.lower else ""

    def missing(self, theorem: str) -> str:
        """Why there is no answer of a kind, which is named as ``Method.theorem`` names it."""
        row = self.asked.get(theorem)
        return "was not asked for" if row is None else f"{row.method} {row.status.partition(':')[0]}"

    def findings(self) -> tuple[Finding, ...]:
        """Every demand on the answers there are."""
        simulations = [r for r in self.rows if r.solved and get_method(r.method).theorem == "simulation"]
        found = [self._order(), *map(self._simulation, simulations), self._mechanism()]
        return tuple(f for f in found if f is not None)

    def _order(self) -> Finding | None:
        """Whether the smallest admissible multiplier is at most the associative one."""
        upper, lower, demand = self.upper, self.lower, "non-associative <= associative"
        if not {"upper", "admissible"} <= set(self.asked):
            return None
        if not (upper and lower):
            kind = "admissible" if upper else "upper"
            return Finding(NOT_CHECKED, f"{demand} ({self.missing(kind)})", self.asked["admissible"].method)
        pair = f"{lower.multiplier:.5f}, {upper.multiplier:.5f}"
        # where psi = phi the associative program answers both: equal by construction, which confirms nothing
        if lower.multiplier == upper.multiplier and not lower.has_range:
            return Finding(NOT_CHECKED, f"{demand} ({pair}): psi = phi, one program gave both", lower.method)
        good = lower.multiplier <= upper.multiplier * (1.0 + _SAME) + _ZERO
        return Finding(HOLDS if good else BROKEN, f"{demand} ({pair})", lower.method, theorem=True)

    def _simulation(self, row: Row) -> Finding | None:
        """Where a simulation lies beside the admissible range, None without a theory.

        ``row`` is its answer.
        """
        upper, lower = self.upper, self.lower
        name = f"the {get_method(row.method).look.name}"
        value = f"{row.low:.5f} to {row.high:.5f}" if row.has_range else f"{row.multiplier:.5f}"
        if not (upper or lower):
            if not set(_ENDS) & set(self.asked):  # no theory was asked for, so none demands anything
                return None
            why = "; ".join(f"{_ENDS[t]}: {self.missing(t)}" for t in _ENDS)
            return Finding(NOT_CHECKED, f"{name} {value} beside the admissible range ({why})", row.method)
        where = self.position(row)
        lowest, highest = f"{_floor(lower):.5f}" if lower else "?", f"{upper.multiplier:.5f}" if upper else "?"
        text = f"({name.removeprefix('the ')} {value}, admissible {lowest} to {highest})"
        within = f" within its {row.range_is.partition(':')[0]}" if row.has_range and row.range_is else ""
        beyond = " beyond its range" if row.has_range else ""
        if where.startswith("above"):
            return Finding(OPEN, f"{name} lies above the associative value{beyond} {text}", row.method)
        if where.startswith("below"):
            return Finding(OPEN, f"{name} lies below the smallest admissible multiplier found {text}", row.method)
        if where == INSIDE:
            return Finding(HOLDS, f"{name} lies inside the admissible range{within} {text}", row.method)
        # one end alone is known, and the simulation is on its right side
        kept, left = ("not above the associative value", "admissible") if upper else (
            "not below the smallest admissible multiplier found", "upper")
        rest = f"the {_ENDS[left]} value {self.missing(left)}, so that end is not checked"
        return Finding(HOLDS, f"{name} lies {kept}{within} {text}; {rest}", row.method)

    def _mechanism(self) -> Finding | None:
        """Whether the associative multiplier is at most that of the best admissible mechanism."""
        upper, mechanism, demand = self.upper, self.mechanism, "associative <= admissible mechanism"
        if not {"upper", "mechanism"} <= set(self.asked):
            return None
        bound = mechanism.details.get("smallest_upper_bound", NAN) if mechanism else NAN
        method = self.asked["mechanism"].method
        if not (upper and mechanism):
            why = self.missing("mechanism" if upper else "upper")
        elif not math.isfinite(bound):
            why = "no mechanism of the catalogue is admissible on these joints"
        else:
            good = upper.multiplier <= bound * (1.0 + _SAME) + _ZERO
            pair = f"({upper.multiplier:.5f}, {mechanism.details.get('smallest_upper_bound_of')} {bound:.5f})"
            return Finding(HOLDS if good else BROKEN, f"{demand} {pair}", method, theorem=True)
        return Finding(NOT_CHECKED, f"{demand} ({why})", method)


def _floor(lower: Row) -> float:
    """Smallest admissible multiplier known: the low end of the range, which may be proven, or the state found."""
    return min(v for v in (lower.low, lower.multiplier) if math.isfinite(v))
