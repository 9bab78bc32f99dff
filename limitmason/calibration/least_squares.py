"""Least squares without derivatives: Gauss-Newton in a trust region, slopes by secants as wide as the parameters.

Slopes are taken over moves that change the residuals by about one standard deviation. A kink, a flat or a jump within
this distance is seen; what is smaller does not matter to the answer. See Cartis, Fiala, Marteau and Roberts (2019),
Improving the flexibility and robustness of model-based derivative-free optimization solvers, doi 10.1145/3338517.

``x`` is a vector of p parameters and ``r`` the n residuals there, ``slopes`` and ``guess`` their derivative, (n, p).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from limitmason.arrays import Array
from limitmason.calibration.objective import LOST, Minimum, Objective
from limitmason.checks import count
from limitmason.errors import NotConverged
from limitmason.study.sampling import latin_hypercube

SAME = 0.1
"""Misfits, sums of squares over the variance, that differ by less are the same minimum."""

FIRST = 0.1
"""First trust region, part of the width of the bounds to each side."""

SMALL = 1e-8
"""A step that promises less, over the variance, is not made: a ten thousandth of a deviation."""

NOISE = 1e-2
"""A step that failed and promised less, over the variance, ends a search."""

SCREENED = 3
"""Points of the Latin hypercube for every start that may be followed."""

_NARROWEST = 1e-6  # part of the width of the bounds: a trust region that is no wider ends a search
_HELD = 0.5  # of what a step promised: where it gained more, the linear model holds further out
_NO_ROOM = 1e-12  # of the width: an axis with no more room does not move, ``lsq_linear`` refuses ends that are equal
_ON_BOUND = 1e-9  # of the width: a parameter that near to its bound has no side there
_NUMBERS = 1e-7  # of a parameter: a smaller move is lost in its rounding
_ORIGIN = 1e-6  # of the width: by this a parameter near zero is measured, whose own size says nothing
_CHANGES = (0.3, 3.0)  # deviations that a move for slopes may change the residuals by: less is rounding, more curvature
_CORRECTED = (0.05, 20.0)  # factors by which such a move is corrected at once: a change may be zero by chance
_TRIES = 4  # of it, three of them corrected: a kink or a jump may keep a change outside for ever
_FAR = 0.3  # deviations: a minimum that lies further from where slopes were measured needs its own


@dataclass(frozen=True)
class SearchSettings:
    """How the least misfit is looked for.

    Parameters
    ----------
    starts : 1 follows the given start; of more, those points of it and a Latin hypercube within the bounds are followed
        that none of their neighbours lies below, at most so many
    most : steps of a single search
    seed : of the hypercube

    Raises
    ------
    InputError
        For less than one start, less than two steps, and a seed that is no whole number of at least 0.
    """

    starts: int = 6
    most: int = 60
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the numbers."""
        count("starts", self.starts)
        count("most", self.most, least=2)
        object.__setattr__(self, "seed", count("seed", self.seed, least=0))


class Slopes(NamedTuple):
    """Slopes of the residuals over one deviation, and the moves they were taken over.

    Parameters
    ----------
    central : slopes at the minimum, shape (n, p)
    below, above : slopes to either side, NaN on a side without room, shape (n, p)
    down, up : size of the moves to either side, zero on a side without room, shape (p,)
    """

    central: Array
    below: Array
    above: Array
    down: Array
    up: Array


def updated(slopes: Array, move: Array, change: Array, width: Array) -> Array:
    """Broyden's update: the least change of slopes that reproduces one move.

    J + (r - J d) (d / w^2)^T / (d . d / w^2), with d the move, r what it changed and w the widths of the bounds.

    Parameters
    ----------
    slopes : J so far, shape (n, p)
    move : of the parameters, shape (p,)
    change : of the residuals by that move, shape (n,)
    width : of the bounds of every parameter, by which moves of different units are compared, shape (p,)
    """
    scaled = move / width**2
    return np.asarray(slopes + np.outer(change - slopes @ move, scaled) / max(float(move @ scaled), 1e-300))


def secants(objective: Objective, x: Array, r: Array, moves: Array, axes: Sequence[int] | None = None) -> Array:
    """Slopes along some axes by one run of the model each, shape (n, k).

    Parameters
    ----------
    objective : what is asked
    x, r : point, shape (p,), and the residuals there, shape (n,)
    moves : size of the move of every parameter, shape (p,): upwards, or down where the bound above is in the way
    axes : numbers of the k parameters to move; all where omitted
    """
    scale, points = objective.scale, []
    axes = range(len(x)) if axes is None else axes
    for k in axes:
        y = x.copy()
        # down only where the bound above is in the way and there is more room below
        inward = -1.0 if x[k] + moves[k] > scale.high[k] and x[k] - scale.low[k] > scale.high[k] - x[k] else 1.0
        y[k] = np.clip(x[k] + inward * moves[k], scale.low[k], scale.high[k])
        points.append(y)
    found = objective.residuals(points) if points else np.zeros((0, len(r)))
    return np.array([(b - r) / (y - x)[k] for b, y, k in zip(found, points, axes, strict=True)]).reshape(-1, len(r)).T


def one_deviation(objective: Objective, x: Array, slopes: Array, most: Array, best: Minimum) -> Array:
    """Move of every parameter that changes the residuals by one deviation, shape (p,).

    It stays within limits. With J_k the slopes of all residuals with parameter k and s^2 the variance of the residuals,
    it is s / |J_k|.

    Parameters
    ----------
    objective : what is asked
    x : parameters at which the slopes hold, shape (p,)
    slopes : J, shape (n, p)
    most : largest move of every parameter, shape (p,)
    best : minimum whose residuals tell the variance, where it is not stated
    """
    width = objective.scale.high - objective.scale.low
    least = _NUMBERS * np.maximum(np.abs(x), _ORIGIN * width)
    with np.errstate(divide="ignore"):  # a parameter that nothing sees has zero slopes, and moves by ``most``
        move = np.sqrt(objective.variance(best)) / np.linalg.norm(slopes, axis=0)
    move = np.clip(move, np.minimum(least, most), most)
    # in powers of sqrt(2): moves that differ by rounding ask for the same run of the model, which is then known
    return np.asarray(np.minimum(width * np.exp2(0.5 * np.round(2.0 * np.log2(move / width))), most))


def descend(
    objective: Objective, start: Array, most: int, slopes: Array | None = None, ended: Sequence[Minimum] = ()
) -> tuple[Minimum, Array]:
    """The minimum below a start, and the slopes there.

    Steps of Gauss and Newton within a radius, a share of the width of the bounds. Slopes are measured by runs of the
    model, then updated from step to step; a search ends only on slopes that were measured where it stands (``fresh``).

    Parameters
    ----------
    objective : what is asked
    start : parameters, shape (p,)
    most : steps
    slopes : at the start where they are known, shape (n, p)
    ended : minima already found: a search that comes within one deviation of one ends there
    """
    low, high = objective.scale.low, objective.scale.high
    width, radius = high - low, FIRST
    x, r = start, objective.at(start)
    fresh = slopes is None
    j = secants(objective, x, r, radius * width) if slopes is None else slopes
    for _ in range(most):
        noise = objective.variance(Minimum(x, r))
        # Gauss-Newton's step within the trust region and the bounds, worked out in widths of the bounds
        d = width * _boxed(j * width, r, np.maximum(-radius, (low - x) / width), np.minimum(radius, (high - x) / width))
        room = max(radius, _NARROWEST) * width  # for slopes: on an exact fit the radius gets too small for numbers
        # by how much the sum of squares falls if the residuals are linear
        promised = float(r @ r - np.sum((r + j @ d) ** 2))
        if promised <= SMALL * noise:
            if fresh:
                return Minimum(x, r), j
            # slopes that were only updated may promise too little: measured before the search ends on them
            j, fresh = secants(objective, x, r, one_deviation(objective, x, j, room, Minimum(x, r))), True
            continue
        y = np.clip(x + d, low, high)
        new = objective.at(y)
        long, gain = float(np.abs(d / width).max()), float(r @ r - new @ new)
        # a run of the model gave no value there: nothing to learn slopes from
        lost = bool(((new == LOST) & (r != LOST)).any())
        if not lost:
            j = updated(j, d, new - r, width)
        if gain > 0.0:
            x, r, fresh = y, new, False
            # Gauss-Newton's model held for half of what it promised or more: twice as far next time
            radius = max(radius, min(2.0 * long, 1.0)) if gain > _HELD * promised else max(long, _NARROWEST)
            # lower by no more than the noise, and within one deviation of a minimum known: it leads there
            for other in ended:
                if other.chi2 <= r @ r + SAME * noise and np.sum((j @ (x - other.x)) ** 2) < noise:
                    return other, j
            continue
        if fresh and (promised < NOISE * noise or radius < _NARROWEST):
            return Minimum(x, r), j
        # a step that failed on measured slopes was too long; on updated ones these may be wrong, and it is tried again
        radius = 0.25 * long if fresh or lost else long
        if not lost:
            room = max(radius, _NARROWEST) * width
            j, fresh = secants(objective, x, r, one_deviation(objective, x, j, room, Minimum(x, r))), True
    return Minimum(x, r, converged=False), j


def _boxed(j: Array, r: Array, low: Array, high: Array) -> Array:
    """The move d with the least |r + j d|^2 within a box low <= d <= high, shape (p,).

    Parameters
    ----------
    j, r : slopes, shape (n, p), and residuals, shape (n,)
    low, high : ends of the move, shape (p,); an axis without room between them keeps the end nearest to 0
    """
    free = high - low > _NO_ROOM
    d = np.clip(np.zeros(len(low)), low, high)
    if free.any():
        d[free] = lsq_linear(j[:, free], -(r + j @ d - j[:, free] @ d[free]), (low[free], high[free]), method="bvls").x
    return d


def measured_slopes(objective: Objective, at: Minimum, guess: Array) -> Slopes:
    """Slopes over one deviation to either side of a minimum, by runs of the model.

    A move is corrected until it changes the residuals by 0.3 to 3 deviations: less is rounding, more is curvature. A
    parameter that nothing sees is moved to its bound.

    Parameters
    ----------
    objective : what is asked
    at : the minimum
    guess : slopes from which the first moves are taken, shape (n, p)
    """
    x, r, scale = at.x, at.residuals, objective.scale
    # one deviation of every parameter, and its room, below and above: shape (2, p)
    one, deviation = np.zeros((2, len(x))), np.sqrt(objective.variance(at))
    room = np.array([x - scale.low, scale.high - x])
    open_ = room > _ON_BOUND * (scale.high - scale.low)
    for side in (0, 1):
        one[side] = one_deviation(objective, x, guess, np.maximum(room[side], 1e-300), at)
    slopes = np.full((2, len(x), len(r)), np.nan)
    asked = [(s, k) for k in range(len(x)) for s in (0, 1) if open_[s, k]]
    for _ in range(_TRIES):
        points = []
        for s, k in asked:
            y = x.copy()
            y[k] = np.clip(x[k] + (2 * s - 1) * one[s, k], scale.low[k], scale.high[k])
            points.append(y)
        again = []
        for (s, k), y, found in zip(asked, points, objective.residuals(points) if points else (), strict=True):
            slopes[s, k] = (found - r) / (y - x)[k]
            # in deviations; a move that changes far more or less than one is made again
            change = float(np.linalg.norm(found - r)) / deviation
            wanted = min(one[s, k] * np.clip(1.0 / max(change, 1e-9), *_CORRECTED), room[s, k])
            if not _CHANGES[0] <= change <= _CHANGES[1] and not np.isclose(wanted, one[s, k]):
                one[s, k] = wanted
                again.append((s, k))
        asked = again
        if not asked:
            break
    below, above = slopes[0].T, slopes[1].T
    # slope at the middle of the parabola through three points: the nearer side counts more
    share = one[0] / (one[0] + one[1])
    central = np.where(np.isnan(below), above, np.where(np.isnan(above), below, share * above + (1.0 - share) * below))
    return Slopes(central, below, above, np.where(open_[0], one[0], 0.0), np.where(open_[1], one[1], 0.0))


def confirmed(objective: Objective, best: Minimum, guess: Array, most: int) -> tuple[Minimum, Slopes]:
    """The minimum that no point one deviation away lies below, and the slopes there.

    Slopes are measured a deviation to either side of a minimum. Where one of these runs lies below it, or the slopes
    lead on, the search goes on from there and the slopes are measured anew.

    Parameters
    ----------
    objective : what is asked
    best : minimum to begin with
    guess : slopes to begin with, shape (n, p)
    most : steps of a search at most
    """
    while True:
        found = measured_slopes(objective, best, guess)
        below = objective.best  # of all runs so far, those for the slopes included
        start = below if below.chi2 < best.chi2 - NOISE * objective.variance(best) else best
        better, guess = descend(objective, start.x, most, found.central)
        moved = float(np.linalg.norm(found.central @ (better.x - best.x)))
        far = moved > _FAR * np.sqrt(objective.variance(best))
        gain = best.chi2 - better.chi2
        best = better if gain > 0.0 else best
        if not far or gain <= NOISE * objective.variance(best):
            return best, found


def searched(objective: Objective, effort: SearchSettings) -> tuple[Minimum, Array, list[Minimum]]:
    """The best minimum, the slopes there, shape (n, p), and all minima.

    The search begins at the given start or, where several are asked for, at those points of it and of a Latin hypercube
    that lie lower than their nearest neighbours.

    Parameters
    ----------
    objective : what is asked
    effort : number of starts, and of steps from each

    Raises
    ------
    NotConverged
        Where the model answers at no start.
    """
    scale, first = objective.scale, objective.scale.start
    points, width = [first], scale.high - scale.low
    if effort.starts > 1:
        cube = latin_hypercube(len(scale), SCREENED * (effort.starts - 1), effort.seed)
        points += list(scale.low + cube * width)
    objective.runs.stage = "screening"
    r = objective.residuals(points)
    answered = [k for k in range(len(points)) if (r[k] != LOST).any()]
    if not answered:
        why = next((objective.runs.note(scale.values(first), m) for m in set(objective.model_of)), "")
        raise NotConverged(f"the model gives no number that is asked for at any start: {why or 'all are NaN'}")
    place, cost = np.array([points[k] for k in answered]) / width, (r[answered] ** 2).sum(axis=1)
    apart = np.linalg.norm(place[:, None] - place[None], axis=2)
    # itself and as many as there are along the axes to either side
    near = np.argsort(apart, axis=1, kind="stable")[:, : 2 * len(scale) + 1]
    # starts that lie lower than their nearest neighbours, by their place in the order of costs: no two are equal
    rank = np.argsort(np.argsort(cost, kind="stable"))
    lowest = [k for k in np.argsort(cost, kind="stable") if rank[k] == rank[near[k]].min()][: effort.starts]
    # the lowest start first: what its search finds ends later ones that lead there
    minima: list[Minimum] = []
    slopes: list[Array] = []
    for k, at in enumerate(lowest):
        before = objective.runs.calls
        objective.say(f"start {k + 1} of {len(lowest)}")
        found, j = descend(objective, points[answered[at]], effort.most, ended=minima)
        minima.append(found)
        slopes.append(j)
        objective.runs.left = (len(lowest) - k - 1) * max(objective.runs.calls - before, 1)
    least = int(np.argmin([m.chi2 for m in minima]))
    return minima[least], slopes[least], minima
