"""Which courses the crack of mechanism B steps in: the worst choice, exactly, by dynamic programming."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechanisms.friction import joint_friction
from mechanisms.parameters import Facade

_SAME = 1e-14  # relative: a multiplier that falls by less has settled, the rest is rounding
_WHOLE = 1e-9  # of a step: one that is missing no more fits in the side wall


class SteppingCourses(NamedTuple):
    """Numbers of the stepping courses, counted from the top, and the multiplier [-]."""

    courses: tuple[int, ...]
    multiplier: float


def best_steps(facade: Facade, hinge: int, *, reduction: float = 1.0, keep_all: bool = False) -> SteppingCourses:
    """Return the choice of stepping courses that gives mechanism B its smallest multiplier for one hinge.

    The crack line is vertical over a course, or inclined by tan(alpha_b) where the course steps; a course that steps
    opens the bed joint under it, one that does not keeps its friction. For a given lambda the power
    N - lambda D is a sum over courses that depends on the steps below only through their number, so its minimum is
    found by dynamic programming; lambda = N / D of that choice is repeated until it stays (Dinkelbach).

    Parameters
    ----------
    facade : parameters
    hinge : n_k, courses between the top and the hinge
    reduction : factor on the friction of the joints that do not step [-]
    keep_all : joints under stepping courses keep their friction too, the upper end of the bracket

    Notes
    -----
    All courses stepping gives the straight crack at alpha_b, none gives mechanism A. The straight crack in between
    replaces the friction of single joints by an even share; a stepped crack chooses where to step, so it may come out
    lower or higher.
    """
    f, h = facade, facade.course_height
    top, advance = hinge * h, facade.steepest_crack * h  # height above the hinge, and width of a step [m]
    base, force = np.array(f.rocking_powers(top)), joint_friction(f, np.arange(1, hinge + 1))
    # as many steps as there are courses, or as fit in the side wall
    most = hinge if np.isinf(f.side_wall_length) else min(hinge, int(f.side_wall_length / advance + _WHOLE))

    # power (resisting, driving) of course j with k steps below it, without and with a step of its own
    plain = np.zeros((hinge + 1, most + 1, 2))
    step = np.zeros((hinge + 1, most + 1, 2))
    for j in range(1, hinge + 1):
        z0 = top - j * h
        for k in range(most + 1):
            plain[j, k] = _course_power(f, k * advance, k * advance, z0)
            plain[j, k, 0] += reduction * force[j - 1] * z0
            step[j, k] = _course_power(f, k * advance, (k + 1) * advance, z0)
            step[j, k, 0] += keep_all * force[j - 1] * z0
    # (resisting, driving) of the overload on a wedge of k steps
    width = advance * np.arange(most + 1)
    roof = np.column_stack([
        f.side_overload * width * (f.crack_offset + 0.5 * width),
        f.side_overload * f.side_overload_inertia * width * top,
    ])

    # begun at mechanism A, no step at all; the multiplier falls, or a choice comes again, which ends it
    value = np.inf
    chosen: tuple[int, ...] = ()
    guess = float((base[0] + f.side_walls * plain[1:, 0, 0].sum()) / base[1])
    while guess < value:
        value = guess
        cost = np.array([1.0, -value])
        chosen = _cheapest(plain @ cost, step @ cost, roof @ cost, hinge, most)
        total, k = base.copy(), 0
        for j in range(hinge, 0, -1):
            stepping = j in chosen
            total += f.side_walls * (step if stepping else plain)[j, k]
            k += int(stepping)
        total += f.side_walls * roof[k]
        guess = min(float(total[0] / total[1]), value)
        if value - guess <= _SAME * value:
            break
    return SteppingCourses(tuple(sorted(chosen)), guess)


def _cheapest(plain: np.ndarray, step: np.ndarray, roof: np.ndarray, hinge: int, most: int) -> tuple[int, ...]:
    """Courses to step in, cheapest in total, by dynamic programming from the top down.

    Costs are N - lambda D per turn [N m], courses count from the top, from 1 on.

    Parameters
    ----------
    plain : cost of course j without a step of its own and with k steps below it, shape (hinge + 1, most + 1)
    step : that of course j with a step of its own, shape (hinge + 1, most + 1)
    roof : cost of the overload on a wedge with k steps, shape (most + 1,)
    hinge : courses from the top to the hinge
    most : the largest number of steps
    """
    best = roof.copy()  # [k]: least cost of the overload and of the courses so far, with k steps below them
    decisions = []
    for j in range(1, hinge + 1):
        without = plain[j] + best
        with_step = np.full(most + 1, np.inf)  # no step more where all of them lie below
        with_step[:most] = step[j, :most] + best[1:]
        decisions.append(with_step < without)
        best = np.minimum(with_step, without)
    chosen, k = [], 0
    for j in range(hinge, 0, -1):
        if decisions[j - 1][k]:
            chosen.append(j)
            k += 1
    return tuple(chosen)


def _course_power(f: Facade, low: float, high: float, z0: float) -> np.ndarray:
    """Powers that one course of a wedge resists and drives with, per side wall and turn [N m], shape (2,).

    Parameters
    ----------
    f : facade and side walls
    low, high : width of the wedge at the foot of the course and at its head [m]
    z0 : height of the foot above the hinge [m]
    """
    h, x0 = f.course_height, f.crack_offset
    per_area = f.unit_weight * f.side_wall_thickness
    # means over the height of the course, of the width and of its square
    mean = 0.5 * (low + high)
    mean_square = (low**2 + low * high + high**2) / 3.0
    lift = per_area * h * (x0 * mean + 0.5 * mean_square)
    travel = per_area * h * (z0 * mean + h * (low + 2.0 * high) / 6.0)
    return np.array([lift, travel])
