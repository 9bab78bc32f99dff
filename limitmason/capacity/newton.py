"""Semismooth Newton on the true law: return map, unsymmetric consistent tangent, geometric stiffness, control row."""

from collections.abc import Callable
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

ENOUGH = 1e-7
"""Unbalance in mean block weights that is accepted where rounding lets Newton's method go no further: chosen."""

_NEAR = 0.3
"""Unbalance in block weights below which another way to the end of a step tries Newton's method: chosen."""

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


class Way(NamedTuple):
    """A step on its way to the end: where it is, and what equilibrium by the true law lacks there."""

    system: System
    old: PlasticHistory  # at the start of the step
    target: float | None  # control displacement to reach [m]; None keeps the multiplier
    viscosity: float  # eta of a viscous force against the motion, own units
    state: Evaluated  # by the true law, with its multiplier
    made: Array  # motion since the start of the step, own units, (order,)

    @classmethod
    def begin(
        cls, system: System, pose: Pose, multiplier: float, old: PlasticHistory, target: float | None,
        viscosity: float = 0.0,
    ) -> "Way":
        """From a guess, a pose and a multiplier of the live load [-]; other arguments are the fields."""
        state = system.evaluate(pose, old, multiplier)
        return cls(system, old, target, viscosity, state, np.zeros(system.order))

    def moved(self, motion: Array, multiplier: float) -> "Way":
        """On by a ``motion`` in own units, shape (order,), at another multiplier of the live load [-]."""
        pose = self.system.advanced(self.state.pose, motion)
        return self._replace(state=self.system.evaluate(pose, self.old, multiplier), made=self.made + motion)

    @property
    def rest(self) -> Array:
        """What equilibrium lacks, own units, shape (order,)."""
        return self.state.residual - self.viscosity * self.made

    @property
    def unbalance(self) -> float:
        """Largest of ``rest``, in mean block weights."""
        return float(np.abs(self.rest).max(initial=0.0))

    @property
    def missing(self) -> float:
        """What the control displacement lacks of its target, in elastic lengths; 0 without one."""
        return 0.0 if self.target is None else (self.target - self.state.control) / self.system.length

    def tangent(self, state: Evaluated, viscosity: float) -> Callable[[Array], Array | None] | None:
        """Solution of the bordered tangent of a state for an unbalance, shape (order + 1,), multiplier last.

        The tangent is None where it is exactly singular, its solution None where that is not finite.

        Parameters
        ----------
        state : the present one, or what another law makes of it
        viscosity : eta of a viscous force, own units
        """
        try:
            factors = self.system.bordered(state, "multiplier" if self.target is None else "control", viscosity)
        except RuntimeError:
            return None
        missing = self.missing

        def solved(rest: Array) -> Array | None:
            """Motion and multiplier that undo an unbalance in own units, shape (order,)."""
            right = np.empty(len(rest) + 1)
            np.negative(rest, out=right[:-1])
            right[-1] = missing
            step = factors.solve(right)
            return step if np.isfinite(step).all() else None

        return solved


class LastWord:
    """Newton's method on the true law where another way is near: tried again when nearer, or after some iterations."""

    def __init__(self) -> None:
        self.unbalance, self.iteration = np.inf, -_AGAIN  # of the last try

    def on(self, way: Way, iteration: int, *, last: bool = False) -> Solved | None:
        """The end of a way, or None: it is too far, was tried not long ago, or is not found.

        Parameters
        ----------
        way : where it is
        iteration : its number, of which the end tells the sum
        last : whether nothing follows, so that it is tried however lately it was
        """
        unbalance = way.unbalance
        nearer = unbalance < _NEARER * self.unbalance or iteration - self.iteration >= _AGAIN
        if not (unbalance < _NEAR and (nearer or last)):
            return None
        self.unbalance, self.iteration = unbalance, iteration
        found = solve(way, iterations=_FINISH, shares=FULL)
        return None if found is None else found._replace(iterations=found.iterations + iteration)


def solve(way: Way, *, iterations: int = ITERATIONS, shares: tuple[float, ...] = SHARES) -> Solved | None:
    """The end of a way by Newton's method, or None where it does not converge.

    Parameters
    ----------
    way : where Newton begins
    iterations : how many are made at most
    shares : of a step that are tried until the unbalance falls; ``FULL`` takes steps as they come
    """

    def lack(at: Way) -> Array:
        """What equilibrium lacks, and what is left of the control displacement."""
        out = np.empty(len(at.made) + 1)
        out[:-1], out[-1] = at.rest, at.missing
        return out

    off, best = lack(way), np.inf
    for k in range(iterations + 1):
        size = float(np.abs(off).max())
        if not np.isfinite(size):
            return None
        # solved; or small, and no longer half of the least so far: rounding lets it go no further
        if size < TOLERANCE or (size < ENOUGH and size > 0.5 * best):
            return Solved(way.state, way.state.multiplier, k)
        if k == iterations or (shares == FULL and size > _GROWN * best):
            return None
        best = min(best, size)
        tangent = way.tangent(way.state, way.viscosity)
        step = None if tangent is None else tangent(off[:-1])
        if step is None:
            return None
        # line search: the first share of the step that lowers the norm of what is lacking by enough
        merit = float(np.linalg.norm(off))
        for share in shares:
            tried = way.moved(share * step[:-1], way.state.multiplier + share * float(step[-1]))
            off = lack(tried)
            if shares == FULL or float(np.linalg.norm(off)) < (1.0 - _FALLS * share) * merit:
                break
        else:
            # no share of the step lowers the unbalance
            return None
        way = tried
    return None
