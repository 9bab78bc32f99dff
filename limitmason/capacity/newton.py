"""Semismooth Newton on the true law: return map, unsymmetric consistent tangent, geometric stiffness, control row."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import PlasticHistory
from limitmason.capacity.system import Evaluated, System

TOLERANCE = 1e-9
"""Unbalance of a solved step, in mean block weights [-]."""

ITERATIONS = 12
"""Most of them for a step: chosen."""

SHARES = (1.0, 0.5, 0.25, 0.1, 0.03)
"""Shares of a step that are tried until the unbalance falls."""

FULL = (1.0,)
"""Full steps, whatever becomes of the unbalance: for the last steps to a state that is near."""

_FALLS = 0.1
"""Part of a share of a step by which the unbalance must fall for it to be taken [-]: chosen."""

_GROWN = 3.0
"""Unbalance over the least so far above which full steps lead nowhere [-]: chosen."""

_ENOUGH = 1e-7
"""Unbalance in mean block weights that is accepted where rounding lets Newton's method go no further: chosen."""


_NEAR = 0.3
"""Unbalance of the true law, in block weights, below which another way tries to end by Newton's method: chosen."""

_NEARER = 0.3
"""Part of the unbalance of the last such try below which it is tried again [-]: chosen."""

_AGAIN = 6
"""Iterations after which it is tried again all the same: chosen."""

_FINISH = 5
"""Full steps of such a try at most: chosen."""


class Solved(NamedTuple):
    """A pose in equilibrium by the true law, its multiplier and the iterations it took."""

    state: Evaluated
    multiplier: float
    iterations: int


def solve(
    system: System,
    pose: Pose,
    multiplier: float,
    old: PlasticHistory,
    target: float | None,
    *,
    viscosity: float = 0.0,
    origin: Array | None = None,
    iterations: int = ITERATIONS,
    shares: tuple[float, ...] = SHARES,
) -> Solved | None:
    """Newton's method from a guess, or None where it does not converge.

    Parameters
    ----------
    system : equations of the path's blocks and points
    pose, multiplier : the guess
    old : history at the start of the step
    target : control displacement to reach [m]; None keeps the multiplier
    viscosity, origin : eta of a viscous force against the motion, own units, and the motion made since the start of the
        step when Newton begins; none by default
    shares : of a step that are tried until the unbalance falls; ``FULL`` takes steps as they come
    iterations : how many are made at most
    """
    prescribed = "multiplier" if target is None else "control"
    done = np.zeros(system.order) if origin is None else origin.copy()

    def unbalance(at: Evaluated, made: Array) -> Array:
        """What equilibrium lacks in a state after the motion ``made``, and what is left of the control displacement."""
        missing = 0.0 if target is None else (target - system.controlled(at.pose)) / system.length
        return np.append(at.residual - viscosity * made, missing)

    now = system.evaluate(pose, old, multiplier)
    off = unbalance(now, done)
    best = np.inf
    for k in range(iterations + 1):
        size = float(np.abs(off).max())
        if not np.isfinite(size):
            return None
        # solved; or small, and no longer half of the least so far: rounding lets it go no further
        if size < TOLERANCE or (size < _ENOUGH and size > 0.5 * best):
            return Solved(now, multiplier, k)
        if k == iterations or (shares == FULL and size > _GROWN * best):
            return None
        best = min(best, size)
        try:
            factors = system.bordered(now, prescribed, viscosity)
        except RuntimeError:  # exactly singular
            return None
        step = factors.solve(np.append(-off[:-1], off[-1]))
        if not np.isfinite(step).all():
            return None
        # line search: the first share of the step that lowers the norm of what is lacking by enough
        merit = float(np.linalg.norm(off))
        for share in shares:
            load = multiplier + share * float(step[-1])
            tried = system.evaluate(system.advanced(now.pose, share * step[:-1]), old, load)
            new = unbalance(tried, done + share * step[:-1])
            if shares == FULL or float(np.linalg.norm(new)) < (1.0 - _FALLS * share) * merit:
                break
        else:
            # no share of the step lowers the unbalance
            return None
        now, off = tried, new
        done += share * step[:-1]
        multiplier = load
    return None


class LastSteps:
    """Newton's method with full steps, by which another way to the end of a step tries to end near it.

    Parameters
    ----------
    system : equations of the path's blocks and points
    old : history at the start of the step
    target : control displacement to reach [m]; None keeps the multiplier
    viscosity : eta of a viscous force against the motion, own units
    """

    def __init__(self, system: System, old: PlasticHistory, target: float | None, viscosity: float) -> None:
        self.system, self.old, self.target, self.viscosity = system, old, target, viscosity
        self.tried_at, self.tried = np.inf, -_AGAIN  # unbalance and iteration of the last try

    def __call__(
        self, now: Evaluated, multiplier: float, done: Array, unbalance: float, k: int, *, last: bool = False
    ) -> Solved | None:
        """The end of the step, where it is near and not just looked for in vain, or None.

        Parameters
        ----------
        now, multiplier : of the other way in its iteration ``k``, which counts as one of these
        done : motion since the start of the step, own units, shape (order,)
        unbalance : largest that is left there, in block weights
        last : whether the other way goes no further
        """
        again = last or unbalance < _NEARER * self.tried_at or k - self.tried >= _AGAIN
        if not (unbalance < _NEAR and again):
            return None
        self.tried_at, self.tried = unbalance, k
        found = solve(
            self.system, now.pose, multiplier, self.old, self.target, viscosity=self.viscosity, origin=done,
            iterations=_FINISH, shares=FULL,
        )
        return None if found is None else found._replace(iterations=found.iterations + k)
