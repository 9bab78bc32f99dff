"""How far a structure is from the state in which it no longer stands, as a multiplier with proven ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from limitmason.answers.results import Range, Status
from limitmason.arrays import Array
from limitmason.limit.associative import analyse
from limitmason.limit.program.problem import Problem, make_problem
from limitmason.mechanics.residuals import total_load
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

Margin = tuple[float, float]
"""Proven from below by forces, and from above by a motion [-]: it stands where the first is 0 or more."""

SHARE_OF_LOAD = 0.37
"""Even pressure in all joints over the load: no simple number, which may happen to balance a block."""

ENOUGH = 1.0
"""Margin beyond which nothing is measured: the structure stands well."""

MOST_TRIALS = 60
"""Values tried for a measure at most."""


def standing_margin(assembly: Assembly, loads: Loads, **model: Any) -> Margin:
    """How much further than to its dead load a structure goes, as a multiplier.

    It starts from forces that press all joints evenly.

    The multiplier of w_dead + lambda (w_dead + A f_even) is -1 or more, because f_even is admissible. The dead load is
    carried where it is 0 or more.

    Parameters
    ----------
    model : contact_model, grid, in_plane of :func:`limitmason.limit.program.problem.make_problem`
    """
    left = loads.dead + _pressed_evenly(make_problem(assembly, loads, live_required=False, **model))
    if np.abs(left[~assembly.held]).max() <= 1e-9 * np.abs(loads.dead[~assembly.held]).max():
        return ENOUGH, ENOUGH  # even pressure carries the load
    found = analyse(make_problem(assembly, Loads(loads.dead, left), **model), check_dead_load=False)[0]
    if found.certificate is None:
        return (ENOUGH, ENOUGH) if found.status == Status.UNBOUNDED else (math.nan, math.nan)
    c = found.certificate
    return min(c.static_multiplier, ENOUGH), min(c.kinematic_multiplier, ENOUGH)


def _pressed_evenly(problem: Problem) -> Array:
    """Wrench of an even pressure in all joint faces on every block [N, N m], shape (n, 6), below what joints bear."""
    p, x = problem.points, problem.assembly.arrays
    # links after the interfaces are ties, which bear no pressure
    faces = p.interface < len(problem.assembly.interfaces)
    pressure = SHARE_OF_LOAD * total_load(problem.assembly, problem.loads) / x.area.sum()
    # well below crushing, so that these forces are admissible in every joint
    pressure = min(pressure, 0.3 * float(x.compressive_strength.min()))
    force = p.directions[:, 0] * np.where(faces, pressure * p.area, 0.0)[:, None]
    wrench = np.zeros((problem.assembly.n_blocks, 6))
    for block, sign in ((p.block_a, -1.0), (p.block_b, 1.0)):
        arm = p.position - problem.assembly.centroids[block]
        np.add.at(wrench, block, sign * np.hstack([force, np.cross(arm, force)]))
    return wrench


def last_standing(margin: Callable[[float], Margin], safe: float, far: float, accuracy: float) -> Range:
    """Value at which the margin comes to nothing, between two proven ends.

    The margin falls from positive where the structure stands to negative where it does not, see
    :func:`standing_margin`. Its zero is found by the secant; the value at an end that stays is halved (Illinois).

    ``low`` and ``high`` are the two proven ends of the margin at a value, see ``Margin``.

    Parameters
    ----------
    safe : value that stands
    far : value that may fall
    accuracy : of the value, relative to it or to one where it is smaller [-]
    """
    low, high = margin(far)
    if low >= 0.0:
        return Range(far, math.inf)
    ends = {True: safe, False: far}
    values = {True: max(margin(safe)[0], 1e-12), False: high}
    last = None
    for trial in range(MOST_TRIALS):
        gap, unit = ends[False] - ends[True], max(1.0, abs(ends[True]))
        if abs(gap) <= accuracy * unit or not all(map(math.isfinite, values.values())):
            break
        # past the crossing by a part of the accuracy, so that the other end comes near it too
        share = values[True] / (values[True] - values[False])
        step = 0.3 * accuracy * unit / abs(gap)
        share = share + step if last else share - step
        at = ends[True] + min(max(share, 0.01 * step), 1.0 - 0.01 * step) * gap
        # a margin with a kink can hold the secant up: every third late trial bisects
        if trial > 12 and trial % 3 == 0:
            at = ends[True] + 0.5 * gap
        low, high = margin(at)
        if not (low >= 0.0 or high < 0.0):
            _close_in(margin, at, ends, accuracy * unit)
            break
        stands = low >= 0.0
        if stands == last:
            values[not stands] *= 0.5
        ends[stands], values[stands], last = at, max(low, 1e-14) if stands else high, stands
    return Range(ends[True], ends[False])


def _close_in(margin: Callable[[float], Margin], at: float, ends: dict[bool, float], step: float) -> None:
    """Bring both ends as near as can be proven to a value at which neither forces nor a motion is found.

    Parameters
    ----------
    margin, at : of a value, and the value at which neither is found
    ends : value at which it stands and at which it falls, changed
    step : first distance from ``at`` that is tried, then four times as far
    """
    for stands in (True, False):
        far = ends[stands]
        for k in range(12):
            trial = at + math.copysign(step * 4.0**k, far - at)
            if not abs(trial - at) < abs(far - at):
                break
            low, high = margin(trial)
            if low >= 0.0 if stands else high < 0.0:
                ends[stands] = trial
                break
