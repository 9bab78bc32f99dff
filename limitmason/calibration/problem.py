"""Misfit of models and targets as a function of the parameters, and where it is least."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize
from scipy.stats import qmc

from limitmason.calibration.parameter import Scale
from limitmason.calibration.runs import Runs
from limitmason.calibration.targets import Entry
from limitmason.errors import NotConverged

Array = NDArray[np.float64]

LOST = 30.0
"""Misfit counted for a number that the model does not give, in standard deviations: a wall, not a slope."""

OPTIMISERS = ("least squares", "nelder-mead")
SAME = 0.1
"""Misfits, sums of squares over the variance, that differ by less are the same minimum."""

NEAR = 0.5
"""Of the way to a bound: an interval that reaches so far is first asked for at the bound, where an answer ends it."""

SCREENED = 4
"""Points of the Latin hypercube that are tried for every start that is followed."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Entries, each with its deviation, the model of each, and the scale of the parameters.

    Parameters
    ----------
    scale : of the parameters
    entries : what is to be met
    model_of, place_of : number of the model and place among its readings, by entry
    deviation : standard deviation of every misfit, relative or in the unit of the entry, shape (n,)
    runs : of the models
    step : of finite differences, on the scale of the fit
    """

    scale: Scale
    entries: tuple[Entry, ...]
    model_of: tuple[int, ...]
    place_of: tuple[int, ...]
    deviation: Array
    runs: Runs
    step: float

    @property
    def n(self) -> int:
        """Number of entries."""
        return len(self.entries)

    def only(self, kept: Sequence[bool]) -> Problem:
        """The problem of some of its entries."""
        chosen = [k for k, keep in enumerate(kept) if keep]
        return replace(
            self, entries=tuple(self.entries[k] for k in chosen), model_of=tuple(self.model_of[k] for k in chosen),
            place_of=tuple(self.place_of[k] for k in chosen), deviation=self.deviation[chosen],
        )  # fmt: skip

    def predicted(self, points: Sequence[Array]) -> Array:
        """Predictions of all entries at several vectors, shape (k, n); NaN where there is none."""
        models = sorted(set(self.model_of))
        found = self.runs([self.scale.values(x) for x in points], models)
        at = [models.index(m) for m in self.model_of]
        return np.array([[row[m][p] for m, p in zip(at, self.place_of, strict=True)] for row in found])

    def residuals(self, points: Sequence[Array]) -> Array:
        """Misfits in standard deviations, shape (k, n); ``LOST`` where the model gives no number."""
        found = self.predicted(points)
        raw = np.array([[e.misfit(v) for e, v in zip(self.entries, row, strict=True)] for row in found])
        return np.nan_to_num(raw / self.deviation, nan=LOST)

    def jacobian(self, x: Array, axes: Sequence[int], *, central: bool = False) -> Array:
        """Slope of the residuals along some axes by finite differences that stay within the bounds, shape (n, k)."""
        ahead, behind = [], []
        for k in axes:
            up, down = x.copy(), x.copy()
            inward = x[k] + self.step > self.scale.high[k]
            if central or not inward:
                up[k] = min(x[k] + self.step, self.scale.high[k])
            if central or inward:
                down[k] = max(x[k] - self.step, self.scale.low[k])
            ahead.append(up)
            behind.append(down)
        found = self.residuals([*ahead, *behind])
        width = np.array([(a - b)[k] for a, b, k in zip(ahead, behind, axes, strict=True)])
        half = len(ahead)
        return (found[:half] - found[half:]).T / width


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where a search ended: vector, sum of squares, whether it converged."""

    x: Array
    chi2: float
    converged: bool


class _Enough(Exception):
    """No error: the first point that is good enough ends a search."""

    def __init__(self, found: Minimum) -> None:
        super().__init__()
        self.found = found


def minimise(
    problem: Problem, start: Array, axes: Sequence[int], optimiser: str, most: int, enough: float = -math.inf
) -> Minimum:
    """The nearest minimum along some axes, the others held.

    Parameters
    ----------
    start : vector
    axes : numbers of the parameters that move
    optimiser : of ``OPTIMISERS``
    most : evaluations
    enough : sum of squares from which on down any point will do
    """
    try:
        return _minimised(problem, start, axes, optimiser, most, enough)
    except _Enough as reached:
        return reached.found


def _minimised(
    problem: Problem, start: Array, axes: Sequence[int], optimiser: str, most: int, enough: float
) -> Minimum:
    axes, low, high = list(axes), problem.scale.low, problem.scale.high
    if not axes:
        r = problem.residuals([start])[0]
        return Minimum(start, float(r @ r), True)

    def full(y: Array) -> Array:
        x = start.copy()
        x[axes] = y
        return x

    def misfits(y: Array) -> Array:
        r = problem.residuals([full(y)])[0]
        if (chi2 := float(r @ r)) <= enough:
            raise _Enough(Minimum(full(y), chi2, False))
        return r

    if optimiser == "nelder-mead":
        # the first simplex spans a resolution, so that it sees past the jumps of a peak
        first = np.vstack([start[axes], *(start[axes] + np.eye(len(axes))[k] * _inward(problem, start, axes[k])
                                          for k in range(len(axes)))])  # fmt: skip
        found = minimize(
            lambda y: float(np.sum(misfits(y) ** 2)), start[axes], method="Nelder-Mead",
            bounds=list(zip(low[axes], high[axes], strict=True)),
            options={"maxfev": most * len(axes), "initial_simplex": first, "xatol": 1e-4, "fatol": 1e-4},
        )  # fmt: skip
        return Minimum(full(np.asarray(found.x)), float(found.fun), bool(found.success))
    margin = 1e-9 * (high - low)[axes]
    found = least_squares(
        misfits, np.clip(start[axes], low[axes] + margin, high[axes] - margin),
        jac=lambda y: problem.jacobian(full(y), axes), bounds=(low[axes], high[axes]),
        x_scale=problem.scale.resolution[axes], method="trf", ftol=1e-8, xtol=1e-7, gtol=1e-8, max_nfev=most,
    )  # fmt: skip
    return Minimum(full(np.asarray(found.x)), float(2.0 * found.cost), bool(found.status > 0))


def _inward(problem: Problem, start: Array, k: int) -> float:
    size = float(problem.scale.resolution[k])
    return -size if start[k] + size > problem.scale.high[k] else size


def search(problem: Problem, starts: int, seed: int, optimiser: str, most: int) -> tuple[Minimum, list[Minimum]]:
    """The best of several minima, and all of them: from the given start and from the best points of a Latin hypercube.

    Raises
    ------
    NotConverged
        Where the model answers at no start.
    """
    scale, first = problem.scale, problem.scale.start
    points = [first]
    if starts > 1:
        cube = qmc.LatinHypercube(d=len(scale), seed=np.random.default_rng(seed)).random(SCREENED * (starts - 1))
        others = list(scale.low + cube * (scale.high - scale.low))
        problem.runs.stage = "screening"
        cost = (problem.residuals(others) ** 2).sum(axis=1)
        points += [others[k] for k in np.argsort(cost, kind="stable")[: starts - 1]]
    lost = [np.isnan(problem.predicted([x])).all() for x in points]
    points = [x for x, gone in zip(points, lost, strict=True) if not gone]
    if not points:
        why = next((problem.runs.note(scale.values(first), m) for m in set(problem.model_of)), "")
        raise NotConverged(f"the model gives no number that is asked for at any start: {why or 'all are NaN'}")
    every = range(len(scale))
    minima = []
    for k, x in enumerate(points):
        before = problem.runs.calls
        problem.runs.stage = f"start {k + 1} of {len(points)}"
        minima.append(minimise(problem, x, every, optimiser, most))
        problem.runs.left = (len(points) - k - 1) * max(problem.runs.calls - before, 1)
    return min(minima, key=lambda m: m.chi2), minima


def profile_end(
    problem: Problem, best: Minimum, axis: int, sign: int, covariance: Array, rise: float, optimiser: str, most: int,
    sharp: float = 0.01,
) -> tuple[float, Minimum]:  # fmt: skip
    """End of the interval of one parameter, and the least minimum met on the way.

    The end is where the least sum of squares with the parameter held there exceeds the best by ``rise``; infinite where
    the bound comes before. ``sharp`` is by how much of itself the root of that excess may be missed, to the safe side:
    of a model that jumps, what it cannot tell costs many runs.
    """
    scale, others = problem.scale, [k for k in range(len(problem.scale)) if k != axis]
    bound = float(scale.high[axis] if sign > 0 else scale.low[axis])
    span = abs(bound - float(best.x[axis]))
    target, least = math.sqrt(rise), best
    known: list[tuple[float, float, Array]] = [(0.0, 0.0, best.x)]

    def excess(distance: float) -> float:
        nonlocal least
        near = min(known, key=lambda k: abs(k[0] - distance))
        x = near[2].copy()
        slope = covariance[:, axis] / max(covariance[axis, axis], 1e-300)
        x = scale.clipped(x + sign * (distance - near[0]) * slope)
        x[axis] = best.x[axis] + sign * distance if distance < span else bound
        # at a bound only one thing is asked: whether anything there is within the interval
        enough = best.chi2 + rise if distance >= span else -math.inf
        found = minimise(problem, x, others, optimiser, most, enough)
        if found.chi2 < least.chi2:
            least = found
        above = math.sqrt(max(found.chi2 - best.chi2, 0.0))
        known.append((distance, above, found.x))
        return above

    low, low_excess = 0.0, 0.0
    guess = target * math.sqrt(covariance[axis, axis])
    guess = span if guess > NEAR * span else guess
    high, high_excess = guess, excess(guess)
    while high_excess < target:
        if high >= span:
            return sign * math.inf, least
        low, low_excess = high, high_excess
        high = min(2.0 * high if high > 0.0 else span, span)
        high_excess = excess(high)
    for _ in range(12):
        if high_excess - target < sharp * target or high - low < 1e-6 * span:
            break
        # the root of the sum of squares is nearly a line: the chord hits it, halving where it does not
        middle = low + (high - low) * min(max((target - low_excess) / (high_excess - low_excess), 0.05), 0.95)
        value = excess(middle)
        if abs(value - target) < 0.01 * target:
            high = middle
            break
        if value < target:
            low, low_excess = middle, value
        else:
            high, high_excess = middle, value
    return float(best.x[axis] + sign * high), least


def profile(
    problem: Problem, best: Minimum, covariance: Array, rise: float, optimiser: str, most: int
) -> tuple[Array, Minimum]:
    """Interval of every parameter on the scale of the fit, shape (p, 2), and the least minimum met on the way."""
    ends, least = np.zeros((len(problem.scale), 2)), best
    total, before = 2 * len(problem.scale), problem.runs.calls
    for axis, name in enumerate(problem.scale.names):
        for side, sign in enumerate((-1, 1)):
            problem.runs.stage = f"interval of {name}"
            ends[axis, side], met = profile_end(problem, best, axis, sign, covariance, rise, optimiser, most)
            least = met if met.chi2 < least.chi2 else least
            done = 2 * axis + side + 1
            problem.runs.left = (total - done) * (problem.runs.calls - before) // done
    return ends, least


def left_out(problem: Problem, groups: Sequence[Any], best: Minimum, optimiser: str, most: int) -> dict[Any, Minimum]:
    """Minimum without each group, by group; from the best fit of all, and from the given start."""
    out: dict[Any, Minimum] = {}
    for name in dict.fromkeys(groups):
        problem.runs.stage = f"without {name}"
        problem.runs.left = 0
        rest = problem.only([g != name for g in groups])
        every = range(len(problem.scale))
        # the start is what was known before: where the rest leaves something free it decides, not what is predicted
        found = [minimise(rest, x, every, optimiser, most) for x in (problem.scale.start, best.x)]
        if found[1].chi2 < found[0].chi2 - SAME:
            found.reverse()
        out[name] = found[0]
    return out
