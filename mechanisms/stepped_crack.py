"""Which courses a crack steps in: the worst choice, exactly, by dynamic programming over whole courses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechanisms.friction import joint_friction
from mechanisms.parameters import Facade


class SteppingCourses(NamedTuple):
    """The stepping courses, counted from the top, and the multiplier."""

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
    top, advance = hinge * h, facade.steepest_crack * h
    base, force = np.array(f.rocking_powers(top)), joint_friction(f, np.arange(1, hinge + 1))
    most = hinge if np.isinf(f.side_wall_length) else min(hinge, int(f.side_wall_length / advance + 1e-9))

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
    width = advance * np.arange(most + 1)
    roof = np.column_stack([
        f.side_overload * width * (f.crack_offset + 0.5 * width), f.side_overload * width * top,
    ])

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
        if value - guess <= 1e-14 * value:
            break
    return SteppingCourses(tuple(sorted(chosen)), guess)


def _cheapest(plain: np.ndarray, step: np.ndarray, roof: np.ndarray, hinge: int, most: int) -> tuple[int, ...]:
    """Courses to step in, cheapest in total, by dynamic programming from the top down.

    ``best[k]`` is the least cost of the courses above with k steps below.

    Parameters
    ----------
    plain : cost of a course without a step, shape (n + 1,)
    step : of one with a step, and k below it, shape (n + 1, most + 1)
    roof : cost of the overload on a wedge with k steps, shape (most + 1,)
    hinge : courses from the top to the hinge
    most : the largest number of steps
    """
    best = roof.copy()
    decisions = []
    for j in range(1, hinge + 1):
        without = plain[j] + best
        with_step = np.full(most + 1, np.inf)
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
    """Moments by which one course of a wedge lifts and travels, per side wall and turn [N m].

    It is ``low`` wide at its foot and ``high`` at its head; its foot is z0 above the hinge [m].
    """
    h, x0 = f.course_height, f.crack_offset
    density = f.unit_weight * f.side_wall_thickness
    mean = 0.5 * (low + high)
    square = (low**2 + low * high + high**2) / 3.0
    lift = density * h * (x0 * mean + 0.5 * square)
    travel = density * h * (z0 * mean + h * (low + 2.0 * high) / 6.0)
    return np.array([lift, travel])
