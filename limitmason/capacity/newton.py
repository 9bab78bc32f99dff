"""Semismooth Newton on the true law: return map, unsymmetric consistent tangent, geometric stiffness, control row."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import History
from limitmason.capacity.system import Evaluated, System

Array = NDArray[np.float64]

TOLERANCE = 1e-9
"""Unbalance of a solved step, in mean block weights [-]."""

ITERATIONS = 12
_ENOUGH = 1e-7  # accepted where rounding lets Newton go no further


class Solved(NamedTuple):
    """A pose in equilibrium by the true law, its multiplier and the iterations it took."""

    state: Evaluated
    multiplier: float
    iterations: int


def solve(
    system: System,
    pose: Pose,
    multiplier: float,
    old: History,
    target: float | None,
    *,
    viscosity: float = 0.0,
    origin: Array | None = None,
    iterations: int = ITERATIONS,
) -> Solved | None:
    """Newton's method from a guess; None where it does not converge.

    Parameters
    ----------
    pose, multiplier : the guess
    old : history at the start of the step
    target : control displacement to reach [m]; None keeps the multiplier
    viscosity, origin : eta of a viscous force against the motion, own units, and the motion made since the start of the
        step when Newton begins; none by default
    """
    prescribed = "multiplier" if target is None else "control"
    done = np.zeros(system.order) if origin is None else origin.copy()
    now = system.evaluate(pose, old, multiplier)
    first = best = np.inf
    for k in range(iterations + 1):
        residual = now.residual - viscosity * done
        missing = 0.0 if target is None else (target - system.controlled(now.pose)) / system.length
        size = max(float(np.abs(residual).max(initial=0.0)), abs(missing))
        if not np.isfinite(size):
            return None
        if size < TOLERANCE or (size < _ENOUGH and size > 0.5 * best):
            return Solved(now, multiplier, k)
        if k == 0:
            first = size
        best = min(best, size)
        if k == iterations or size > 1e4 * max(first, 1.0):
            return None
        try:
            factors = system.bordered(now, prescribed, viscosity)
        except RuntimeError:  # exactly singular
            return None
        step = factors.solve(np.concatenate([-residual, [missing]]))
        if not np.isfinite(step).all():
            return None
        done += step[:-1]
        multiplier += float(step[-1])
        now = system.evaluate(system.advanced(now.pose, step[:-1]), old, multiplier)
    return None
