"""Cross-validation: what a fit predicts of the tests, or the numbers, that it did not see."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from limitmason.arrays import Array
from limitmason.calibration.information import Information
from limitmason.calibration.least_squares import descend
from limitmason.calibration.objective import Minimum, Objective
from limitmason.calibration.targets import Entry
from limitmason.display.text_table import aligned
from limitmason.errors import InputError

STEPS = 6
"""Steps of the fit to the rest, which begins where the slopes at the best of all put it."""

_FAINT = 1e-6
"""Weight of the pull to the start, over that of one standard deviation per width of the bounds: data outweigh it."""
_ROOM = 1e-12
"""Of the width: by so much the box is wider than the bounds, as a best point on its bound would leave it no room."""


class LeftOutRow(NamedTuple):
    """A number that the fit did not see.

    Parameters
    ----------
    group : that was left out with it
    quantity : its name
    measured, predicted : in its unit
    error : predicted / measured - 1 [-], or the difference in its unit where differences are compared
    deviation : what the parameters leave open in the prediction, on the same scale
    relative : whether it is compared by its ratio, else by its difference
    """

    group: str
    quantity: str
    measured: float
    predicted: float
    error: float
    deviation: float
    relative: bool = True


@dataclass(frozen=True)
class LeftOut:
    """Errors on what was left out of the fit, group by group.

    Parameters
    ----------
    rows : one per number
    by : what the groups are
    """

    rows: tuple[LeftOutRow, ...]
    by: str

    @property
    def error(self) -> float:
        """Root mean square of log(predicted / measured) [-].

        It is taken over all numbers that are compared by their ratio: infinite where one of them is predicted as zero
        or less, NaN where a prediction is missing, or where there are none.
        """
        ratios = np.array([r.predicted / r.measured for r in self.rows if r.relative])
        with np.errstate(divide="ignore"):
            return float(np.sqrt(np.mean(np.log(np.maximum(ratios, 0.0)) ** 2))) if len(ratios) else math.nan

    def __str__(self) -> str:
        """The table; differences stand in the unit of the number, not in per cent."""
        head = [["left out", "quantity", "measured", "predicted", "error", "left open"]]
        return aligned(head + [[
            r.group, r.quantity, f"{r.measured:.4g}", f"{r.predicted:.4g}",
            *((f"{r.error:+.1%}", f"{r.deviation:.1%}") if r.relative else (f"{r.error:+.3g}", f"{r.deviation:.3g}")),
        ] for r in self.rows], "<<>>>>")


def groups_of(entries: Sequence[Entry], leave_out: str | Mapping[str, str] | None) -> list[str] | None:
    """Group of every entry, or None where nothing is left out.

    Parameters
    ----------
    entries : numbers to be met
    leave_out : "test" or "quantity", or a group by test

    Raises
    ------
    InputError
        For groups that are none, or one, and for a group of no test.
    """
    if leave_out is None:
        return None
    if isinstance(leave_out, Mapping):
        if missing := [e.test for e in entries if e.test not in leave_out]:
            raise InputError(f"leave_out names no group for test {missing[0]!r}")
        if unknown := [t for t in leave_out if t not in {e.test for e in entries}]:
            raise InputError(f"leave_out names {unknown[0]!r}, which is no test")
        groups = [leave_out[e.test] for e in entries]
        if len(set(groups)) < 2:
            raise InputError("leave_out needs at least two groups")
        return groups
    if leave_out not in ("test", "quantity"):
        raise InputError(f"leave_out must be 'test', 'quantity', groups by test, or None, got {leave_out!r}")
    by_test = leave_out == "test" and len({e.test for e in entries}) > 1
    groups = [e.test if by_test else f"{e.test}: {e.reading.output} {e.reading.what}" for e in entries]
    return groups if len(set(groups)) > 1 else None


def left_out(
    objective: Objective, groups: Sequence[str], best: Minimum, information: Information, by: str, most: int
) -> LeftOut:
    """Errors on every group by the fit to the others.

    What these leave free goes back to the given start.

    Parameters
    ----------
    objective : of all entries
    groups : group of every entry
    best : the fit to all entries
    information : its slopes
    by : what was left out, in words
    most : steps of a search at most
    """
    rows: dict[int, LeftOutRow] = {}
    for name in dict.fromkeys(groups):
        objective.say(f"without {name}")
        objective.runs.left = 0
        kept = np.array([g != name for g in groups])
        # the others, and what is left out
        rest, gone = objective.only(kept), objective.only(~kept)
        slopes = information.slopes[kept]  # at the fit to all: the fit to the rest begins with them
        found, _ = descend(rest, _toward_start(rest, best, slopes), min(most, STEPS), slopes)
        # as few numbers as parameters are met exactly and tell no scatter: that of all counts then
        variance = rest.variance(found) if rest.n > len(rest.scale) else objective.variance(best)
        spread = information.of(kept, variance).covariance
        seen = information.slopes[~kept] * gone.deviation[:, None]
        # deviation of the prediction that the others leave open, by the slopes of the fit to all
        open_ = np.sqrt(np.einsum("ij,jk,ik->i", seen, spread, seen))
        values = gone.predicted([found.x])[0]
        for k, e, v, d in zip(np.flatnonzero(~kept), gone.entries, values, open_, strict=True):
            error = v / e.measured - 1.0 if e.relative else v - e.measured
            rows[int(k)] = LeftOutRow(
                group=name, quantity=e.label, measured=e.measured, predicted=float(v), error=float(error),
                deviation=float(d), relative=e.relative,
            )
    return LeftOut(tuple(rows[k] for k in sorted(rows)), by)


def _toward_start(rest: Objective, best: Minimum, slopes: Array) -> Array:
    """Point from which the fit to the rest of the data begins, shape (p,).

    It is where the rest lies lowest by the slopes at the best: the move d, in widths w of the bounds, with least
    |r + J w d|^2 + (1e-6)^2 |d - d_start|^2 within the bounds. By the second term what the rest does not see is as at
    the start: else the fit would know, by its beginning, what was left out.

    Parameters
    ----------
    rest : objective of the data that are kept
    best : the fit to all data
    slopes : J, of the residuals of the rest at the best by every parameter, shape (n, p)
    """
    scale = rest.scale
    width = scale.high - scale.low
    pull = _FAINT * np.eye(len(scale))
    to_start = (scale.start - best.x) / width
    r = rest.at(best.x)
    rows, aim = np.vstack([slopes * width, pull]), np.concatenate([-r, pull @ to_start])
    box = (scale.low - best.x) / width - _ROOM, (scale.high - best.x) / width + _ROOM
    move = lsq_linear(rows, aim, box, method="bvls").x
    return np.clip(best.x + width * move, scale.low, scale.high)
