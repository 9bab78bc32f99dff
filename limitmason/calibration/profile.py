"""Profile likelihood: how far a parameter can go while the others make up for it, from the runs made and a few more."""

from __future__ import annotations

import math

import numpy as np

from limitmason.arrays import Array
from limitmason.calibration.least_squares import Slopes, secants, updated
from limitmason.calibration.objective import LOST, Minimum, Objective

SHARP = 0.02
"""An end is known to this part of its distance from the best."""

MOST = 14
"""Runs along the way to one end."""

CHECKED = 2
"""Times that the other parameters are asked anew at an end."""

_ON_BOUND = 1e-9  # of the width of the bounds: a point that near to its bound is on it
_CLOSE = 0.9  # of the way to a point known to lie beyond the end: a step that goes further is as good as there
_HALF = 0.5  # of that way is gone instead, as by bisection
_CUT = 0.3  # of that way: the least that a step goes, so that each cuts it down
_NEAREST = 0.01  # of a deviation: points that are closer show the rounding of the model in their slopes
_REGULAR = 1e-10  # of the largest square of slopes: keeps J^T J regular where the data do not see a parameter


def profile(objective: Objective, best: Minimum, slopes: Slopes, rise: float) -> Array:
    """Interval of every parameter on the scale of the fit, shape (p, 2).

    An end is infinite where a bound comes first.

    An end encloses every point tried so far whose sum of squares exceeds the best by at most ``rise``. Minima apart
    from each other then lie in one interval. What later runs, for other ends, find within is not looked at again.

    Parameters
    ----------
    objective : what is asked, with all points tried so far
    best : the fit
    slopes : of the residuals there, to both sides
    rise : of the sum of squares up to which a point lies inside [-]
    """
    ends = np.zeros((len(objective.scale), 2))
    total, before = 2 * len(objective.scale), objective.runs.calls
    for axis, name in enumerate(objective.scale.names):
        for side, sign in enumerate((-1, 1)):
            objective.say(f"interval of {name}")
            ends[axis, side] = end(objective, best, slopes, axis, sign, rise)
            done = 2 * axis + side + 1
            objective.runs.left = (total - done) * (objective.runs.calls - before) // done
    return ends


def end(objective: Objective, best: Minimum, slopes: Slopes, axis: int, sign: int, rise: float) -> float:
    """End of the interval of one parameter on the scale of the fit.

    It is the furthest point whose least sum of squares exceeds the best by ``rise``, infinite with its sign where the
    bound itself lies within.

    Parameters
    ----------
    objective, best, slopes, rise : as for :func:`profile`
    axis : number of the parameter
    sign : the side: 1 above, -1 below
    """
    scale, limit = objective.scale, best.chi2 + rise
    low, high, width = scale.low, scale.high, scale.high - scale.low
    bound = float(high[axis] if sign > 0 else low[axis])
    side = slopes.above if sign > 0 else slopes.below
    if np.isnan(side[0, axis]):  # the best lies on the bound of this side
        return sign * math.inf
    others = [k for k in range(len(scale)) if k != axis]
    inside = _outermost(objective, best, limit, axis, sign)
    guess = slopes.central.copy()
    guess[:, axis] = side[:, axis]
    j, checked = _nearby(objective, inside, guess, slopes), 0

    def step() -> Array:
        """Move from ``inside`` to where the linear residuals reach the limit, shape (p,)."""
        room = (low - inside.x) / width, (high - inside.x) / width
        return np.asarray(width * furthest(j * width, inside.residuals, limit, axis, sign, *room))

    # coordinates: one that lies beyond the end as far as the others have followed, and the last such
    beyond, last = math.inf, math.inf
    for _ in range(MOST):
        here = sign * float(inside.x[axis])
        if sign * bound - here <= _ON_BOUND * width[axis]:
            return sign * math.inf
        d = step()
        ahead, room = max(sign * float(d[axis]), 0.0), beyond - here
        # close to a point known to lie beyond the end: halve the room, as bisection does
        if ahead > _CLOSE * room:
            d, ahead = d * (_HALF * room / ahead), _HALF * room
        # how exactly the end must be known; it is, where the step is shorter and either the sum of squares is nearly at
        # the limit, or a point beyond the end is as near
        near = SHARP * (here + ahead - sign * float(best.x[axis]))
        if ahead <= near and (inside.chi2 >= limit - 2.0 * SHARP * rise or room <= 2.0 * near):
            to = here + ahead
            if checked == CHECKED or not others:
                return sign * to
            # have the others followed? asked again where the parameter ends
            checked += 1
            j[:, others] = secants(objective, inside.x, inside.residuals, _aside(slopes), others)
            inside, last, beyond = _outermost(objective, inside, limit, axis, sign), min(beyond, last), math.inf
            if sign * step()[axis] <= near:
                return sign * max(to, sign * float(inside.x[axis]))
            continue
        # a step that shows the end, or cuts the room down: the line from far beyond points too near
        least = max(2.0 * near if ahead <= near else 0.0, _CUT * room if math.isfinite(room) else 0.0)
        if ahead < least:
            d = d * (least / ahead) if ahead > 0.0 else sign * least * np.eye(len(d))[axis]
        y = np.clip(inside.x + d, low, high)
        found = objective.at(y)
        # where the model gives no answer is beyond the end, and nothing to learn slopes from
        if (found == LOST).any() and not (inside.residuals == LOST).any():
            beyond = sign * float(y[axis])
            continue
        j = updated(j, y - inside.x, found - inside.residuals, width)
        if found @ found <= limit + SHARP * rise:
            inside = Minimum(y, found)
        else:
            beyond = sign * float(y[axis])
    # runs are used up: the nearest point known to lie beyond, so that the interval is rather too wide
    return sign * (beyond if math.isfinite(beyond) else max(last, sign * float(inside.x[axis])))


def _aside(slopes: Slopes) -> Array:
    """Moves of the parameters over one deviation, to the better seen side, shape (p,).

    On that side the move is shorter; on a side without room it is zero, and the other one counts.
    """
    return np.where(slopes.up * slopes.down > 0.0, np.minimum(slopes.up, slopes.down), slopes.up + slopes.down)


def _outermost(objective: Objective, best: Minimum, limit: float, axis: int, sign: int) -> Minimum:
    """The furthest point tried along an axis with squares within a limit, or the best.

    Parameters
    ----------
    objective : with all points tried so far
    best : the fit
    limit : of the sum of squares [-]
    axis : number of the parameter
    sign : the side: 1 above, -1 below
    """
    within = [m for m in objective.tried if m.chi2 <= limit]
    return max([best, *within], key=lambda m: sign * float(m.x[axis]))


def _nearby(objective: Objective, at: Minimum, guess: Array, slopes: Slopes) -> Array:
    """Slopes at a point, from those elsewhere and the nearest points tried, (n, p).

    Parameters
    ----------
    objective : with all points tried so far
    at : the point
    guess : slopes elsewhere, shape (n, p)
    slopes : at the best, whose moves are one deviation
    """
    width = objective.scale.high - objective.scale.low
    least = _NEAREST * np.maximum(slopes.up, slopes.down)
    near = [m for m in objective.tried if (np.abs(m.x - at.x) > least).any() and not (m.residuals == LOST).any()]
    near.sort(key=lambda m: float(np.linalg.norm((m.x - at.x) / width)))
    # two for every parameter; the nearest last, as what came before may be undone by it
    for m in reversed(near[: 2 * len(at.x)]):
        guess = updated(guess, m.x - at.x, m.residuals - at.residuals, width)
    return guess


def furthest(j: Array, r: Array, limit: float, axis: int, sign: int, low: Array, high: Array) -> Array:
    """Move d in a box that takes one parameter furthest with |r + j d|^2 in a limit.

    With C = (J^T J)^-1, centre m = -C J^T r and reach s = limit - |r + J m|^2, the furthest point of the ellipsoid
    along axis k is m + C_k / C_kk sqrt(s C_kk). Another parameter that leaves the box is held at its end, and the point
    found anew.

    Parameters
    ----------
    j, r : slopes (n, p) and residuals (n,)
    limit : largest sum of squares [-]
    axis : number of the parameter
    sign : the side: 1 above, -1 below
    low, high : the box of the move, shape (p,)
    """
    d, free = np.zeros(len(low)), np.ones(len(low), dtype=bool)  # free: not held at an end of the box
    stop = float(high[axis] if sign > 0 else low[axis])
    # a parameter that the data do not see: its move is ended by the box
    floor = _REGULAR * float((j * j).sum(axis=0).max()) + 1e-30
    while True:
        own, at = j[:, free], int(np.count_nonzero(free[:axis]))  # slopes of the free ones, place of the axis in them
        rest = r + j[:, ~free] @ d[~free]
        inverse = np.linalg.inv(own.T @ own + floor * np.eye(own.shape[1]))
        centre = -inverse @ (own.T @ rest)
        reach = max(limit - float(rest @ rest + centre @ (own.T @ rest)), 0.0)
        # the far point of the ellipsoid along the axis, or the end of the box
        to = sign * min(sign * float(centre[at]) + math.sqrt(reach * inverse[at, at]), sign * stop)
        d[free] = centre + inverse[:, at] / inverse[at, at] * (to - centre[at])
        # how far each leaves the box; the axis itself was cut above
        over = np.maximum(low - d, d - high)
        over[axis] = over[~free] = 0.0
        worst = int(np.argmax(over))
        if over[worst] <= 0.0:
            return d
        d[worst], free[worst] = np.clip(d[worst], low[worst], high[worst]), False
