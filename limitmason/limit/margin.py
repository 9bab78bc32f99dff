"""How far a structure is from not standing, as a multiplier with proven ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.results import Range, Status
from limitmason.arrays import Array
from limitmason.limit.associative import analyse
from limitmason.limit.program.static_theorem import Problem, make_problem
from limitmason.mechanics.residuals import total_load
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads


class Margin(NamedTuple):
    """How far from falling [-]: it stands if ``low`` >= 0, it falls if ``high`` < 0."""

    low: float  # proven by forces
    high: float  # proven by a motion


SHARE_OF_LOAD = 0.37
"""Even pressure in all joints over the load: no simple number, which may happen to balance a block."""

ENOUGH = 1.0
"""Margin beyond which nothing is measured: the structure stands well."""

MOST_TRIALS = 60
"""Values tried for a measure at most."""

BALANCED = 1e-9
"""Unbalance of even pressure over the largest dead load, up to which the pressure carries the load [-]: rounding."""

BELOW_CRUSHING = 0.3
"""Even pressure over the least strength at most [-]: chosen, so that these forces are admissible in every joint."""

LEAST_MARGIN = 1e-12
"""Margin that counts for an end that stands with none [-]: the secant needs ends of opposite signs."""

PAST = 0.3
"""Step past the crossing, over the accuracy [-]: chosen, so that the next trial brings the other end near as well."""

FIRST_BISECTION, EVERY = 12, 3
"""Trials after which every third halves the interval: chosen, since a margin with a kink can hold the secant up."""

STEPS_NEAR, WIDER = 12, 4.0
"""Distances tried about a value that is not decided, and the growth from one to the next: chosen."""


def standing_margin(assembly: Assembly, loads: Loads, **model: Any) -> Margin:
    """Proven ends of a multiplier that is 0 or more where the dead load is carried.

    It is the largest lambda with w_dead + lambda (w_dead + A f_even) carried, where f_even presses all joints evenly.
    At lambda = -1 the admissible f_even balance the load, so that the multiplier is never below -1.

    Parameters
    ----------
    loads : dead loads
    model : contact_model, grid, in_plane of :func:`limitmason.limit.program.static_theorem.make_problem`

    Returns
    -------
    Margin: NaN where neither forces nor a motion decide, ``ENOUGH`` at most.
    """
    # what even pressure leaves of the load
    left = loads.dead + _pressed_evenly(make_problem(assembly, loads, live_required=False, **model))
    if np.abs(left[~assembly.held]).max() <= BALANCED * np.abs(loads.dead[~assembly.held]).max():
        return Margin(ENOUGH, ENOUGH)  # even pressure carries the load
    found = analyse(make_problem(assembly, Loads(loads.dead, left), **model), check_dead_load=False)[0]
    if found.certificate is None:  # no multiplier: without end the structure stands well, else nothing is known
        return Margin(ENOUGH, ENOUGH) if found.status == Status.UNBOUNDED else Margin(math.nan, math.nan)
    c = found.certificate
    return Margin(min(c.static_multiplier, ENOUGH), min(c.kinematic_multiplier, ENOUGH))


def _pressed_evenly(problem: Problem) -> Array:
    """Wrench of an even pressure in all faces on every block [N, N m], shape (n, 6).

    The pressure is below what joints bear.
    """
    p, x = problem.points, problem.assembly.arrays
    # links after the interfaces are ties, which bear no pressure
    faces = p.interface < len(problem.assembly.interfaces)
    pressure = SHARE_OF_LOAD * total_load(problem.assembly, problem.loads) / x.area.sum()
    pressure = min(pressure, BELOW_CRUSHING * float(x.compressive_strength.min()))
    force = p.directions[:, 0] * np.where(faces, pressure * p.area, 0.0)[:, None]
    wrench = np.zeros((problem.assembly.n_blocks, 6))
    for block, sign in ((p.block_a, -1.0), (p.block_b, 1.0)):
        arm = p.position - problem.assembly.centroids[block]
        np.add.at(wrench, block, sign * np.hstack([force, np.cross(arm, force)]))
    return wrench


def last_standing(margin: Callable[[float], Margin], safe: float, far: float, accuracy: float) -> Range:
    """Last value at which a structure stands: zero of its margin, with proven ends.

    The margin falls from positive where the structure stands to negative where it does not, see
    :func:`standing_margin`. Its zero is found by the secant; the value at an end that stays is halved (Illinois).

    Parameters
    ----------
    margin : proven ends of the margin at a value
    safe : value that stands
    far : value that may fall, above or below ``safe``
    accuracy : of the value, relative to it or to one where it is smaller [-]

    Returns
    -------
    Range from the last value that is proven to stand to the first that is proven to fall: infinite if ``far`` stands,
    or if neither it nor a value before it is proven to fall.
    """
    low, high = margin(far)
    if low >= 0.0:
        return Range(far, math.inf)
    # two ends, True where it stands and False where it falls: their values, and the margin that proves it
    ends = {True: safe, False: far}
    # where it is not proven that ``far`` falls, the least margin that there is serves to begin with
    values = {True: max(margin(safe).low, LEAST_MARGIN), False: high if high < 0.0 else -1.0}
    falls = high < 0.0  # whether the end at which it falls is proven
    last = None  # whether it stood at the trial before
    for trial in range(MOST_TRIALS):
        gap, unit = ends[False] - ends[True], max(1.0, abs(ends[True]))
        if abs(gap) <= accuracy * unit or not all(map(math.isfinite, values.values())):
            break
        # the secant's zero between the ends, and past it by a part of the accuracy, so that the other end nears it too
        share = values[True] / (values[True] - values[False])
        step = PAST * accuracy * unit / abs(gap)
        share = share + step if last else share - step
        at = ends[True] + min(max(share, 0.01 * step), 1.0 - 0.01 * step) * gap  # never at an end, which is known
        if trial > FIRST_BISECTION and trial % EVERY == 0:
            at = ends[True] + 0.5 * gap
        low, high = margin(at)
        if not (low >= 0.0 or high < 0.0):  # the bounds lie on either side of zero, or there are none
            _close_in(margin, at, ends, accuracy * unit)
            falls = falls or ends[False] != far
            break
        stands = low >= 0.0
        if stands == last:  # the other end has stayed twice: Illinois
            values[not stands] *= 0.5
        # a margin of zero would hold the secant at this end
        ends[stands], values[stands], last = at, max(low, 0.01 * LEAST_MARGIN) if stands else high, stands
        falls = falls or not stands
    return Range(ends[True], ends[False] if falls else math.inf)


def _close_in(margin: Callable[[float], Margin], at: float, ends: dict[bool, float], step: float) -> None:
    """Bring both ends as near as can be proven to a value where nothing is proven.

    Parameters
    ----------
    margin : proven ends of the margin at a value
    at : value between the ends at which neither forces nor a motion are found
    ends : value at which it stands (True) and at which it falls (False), changed
    step : first distance from ``at`` that is tried, then ``WIDER`` times as far
    """
    for stands in (True, False):
        far = ends[stands]
        for k in range(STEPS_NEAR):
            trial = at + math.copysign(step * WIDER**k, far - at)
            if not abs(trial - at) < abs(far - at):
                break
            low, high = margin(trial)
            proven = low >= 0.0 if stands else high < 0.0
            if proven:
                ends[stands] = trial
                break
