"""A step by descent: friction frozen at the present normal forces makes it convex, one Newton pass for every freeze.

With the limit of shear c + (tan(phi) - tan(psi)) N_bar + tan(psi) N, N_bar the normal force of the pose, the law is
associative and its stresses are minus the gradient of a convex potential: an iteration of Newton's method on it,
damped where equilibrium is far, goes down along its direction to the lowest potential, whatever points stick, slide or
open on the way. In the new pose N_bar is frozen again. Where Newton's method on the true law stops at a kink this goes
on, at the price of a factorisation per iteration; a cone program takes 14 to 24 for one freeze of the fixed point of
Haslinger, and three to seven freezes a step. Own units are those of :mod:`limitmason.capacity.system`.
"""

import numpy as np

from limitmason.arrays import Array
from limitmason.capacity import newton
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import ElastoplasticLaw, PlasticHistory, return_map, returned_stress
from limitmason.capacity.system import Evaluated, System
from limitmason.mechanics.tie_springs import tension

# chosen, not derived: what is found is the answer of Newton's method on the true law, whatever these are
ITERATIONS = 60  # most of a step

DAMPING = 3e-3
"""Of a motion, in block weights per elastic length, for an unbalance of one block weight [-]."""

_MOST = 0.1
"""Damping at most, however large the unbalance is, in block weights per elastic length."""

_SLOPE = 0.2
"""Part of the slope at the start of a line search that is small enough at its end [-]."""

_TRIES = 8
"""Tries of a line search at most."""

_INNER = 0.05
"""Least part of the bracket that a line search leaves on either side [-]."""

_ARRIVED = 1e-6
"""Way of the control that is still to go, over the step, below which the control is where it should be [-]."""


def solve(
    system: System,
    pose: Pose,
    multiplier: float,
    old: PlasticHistory,
    target: float | None,
    *,
    viscosity: float = 0.0,
    origin: Array | None = None,
) -> newton.Solved | None:
    """The state at a control displacement from a guess, or None where it is not found.

    Parameters
    ----------
    system : equations of the path's blocks and points
    pose, multiplier : the guess; the multiplier is that of the live load [-]
    old : history at the start of the step
    target : control displacement to reach [m]; None keeps the multiplier
    viscosity, origin : eta of a viscous force against the motion, and the motion made since the start of the step,
        shape (order,), both in own units; none by default

    Notes
    -----
    What is found is in equilibrium by the true law, or is not returned: Newton's method on it has the last word.
    """
    prescribed = "multiplier" if target is None else "control"
    done = np.zeros(system.order) if origin is None else origin.copy()
    now = system.evaluate(pose, old, multiplier)
    ends = newton.LastSteps(system, old, target, viscosity)
    for k in range(ITERATIONS):
        unbalance = float(np.abs(now.residual - viscosity * done).max(initial=0.0))
        if not np.isfinite(unbalance):
            return None
        found = ends(now, multiplier, done, unbalance, k)
        if found is not None:
            return found
        # one iteration of Newton's method on the potential of the law whose friction is frozen here
        law = frozen(system.law, now.returned.stress[:, 0], now.returned.history.damage)
        returned = return_map(law, old, now.contact.displacement)
        damping = viscosity + min(DAMPING * unbalance, _MOST)
        # what the control displacement lacks of its target, in elastic lengths
        missing = 0.0 if target is None else (target - system.controlled(now.pose)) / system.length
        force = returned.stress * system.bodies.area[:, None]
        rest = system.unbalanced(now.pose, now.wrenches, force, now.pulled, multiplier) - viscosity * done
        try:
            factors = system.bordered(now._replace(returned=returned), prescribed, damping)
        except RuntimeError:  # exactly singular
            return None
        step = factors.solve(np.append(-rest, missing))
        if not np.isfinite(step).all():
            return None
        multiplier += float(step[-1])  # in full: the potential that the motion goes down on is that of the new load
        # while the control still moves there is no potential to go down on: the whole step is made
        share = 1.0
        if abs(missing) < _ARRIVED * max(1.0, float(np.abs(step[:-1]).max(initial=0.0))):
            share = _lowest(system, law, old, now, step[:-1], multiplier, viscosity, done)
        done += share * step[:-1]
        now = system.evaluate(system.advanced(now.pose, share * step[:-1]), old, multiplier)
    return None


def frozen(law: ElastoplasticLaw, normal: Array, damage: Array | float = 0.0) -> ElastoplasticLaw:
    """The associative law of friction at frozen normal stresses [Pa] and damage, shape (m,), with dilation as it is."""
    return law._replace(strength=law.strength_at(damage).frozen(normal), softening=None)


def _lowest(
    system: System, law: ElastoplasticLaw, old: PlasticHistory, now: Evaluated, motion: Array, multiplier: float,
    viscosity: float, done: Array,
) -> float:
    """Share of a motion at which the potential of the frozen law is lowest, by its slope.

    Parameters
    ----------
    system : equations of the path's blocks and points
    law : law whose friction is frozen
    old : history at the start of the step, from which the law returns
    now : state at the start of the motion
    motion : of the full step, in own units, shape (order,)
    multiplier : of the live load [-]
    viscosity : eta of a viscous force against the motion, own units
    done : motion made before, against which the viscous force acts too, own units, shape (order,)
    """
    # displacements of the points [m], and what the motion adds to them and to the ties' elongation [m]
    apart, (work, longer) = now.contact.displacement, system.relative(now, motion)
    dead, live = system.applied(now.pose)
    load = dead + multiplier * live - viscosity * done
    if system.bodies.deforming:
        load = load + system.sprung(now.pose)
    # rise of the slope with the share, by the viscous force and by the springs of the blocks' shapes
    against = float(motion @ ((viscosity + system.springs_own) * motion))
    area, tied = system.bodies.area[:, None], len(longer) > 0

    def slope(share: float) -> float:
        """Derivative of the potential by the share of the motion, at a share, in own units."""
        force = returned_stress(law, old, apart + share * work) * area
        pulls = tension(system.ties, now.pulled.elongation + share * longer, old.stretched)[0] if tied else longer
        own = (float(pulls @ longer) - float((force * work).sum())) / (system.weight * system.length)
        return own - float(motion @ load) + share * against

    low, high, at_low, at_high = 0.0, 1.0, slope(0.0), slope(1.0)
    if at_low >= 0.0:  # the tangent has the geometry's part, the potential has not: uphill, the whole step is made
        return 1.0
    # by the secant of the slopes at both ends of a bracket, kept away from these
    enough, share, at = _SLOPE * abs(at_low), 1.0, at_high
    for _ in range(_TRIES):
        if abs(at) <= enough or (share == 1.0 and at <= 0.0):
            break
        if at > 0.0:
            high, at_high = share, at
        else:
            low, at_low = share, at
        width = high - low
        share = low - width * at_low / (at_high - at_low)
        share = min(max(share, low + _INNER * width), high - _INNER * width)
        at = slope(share)
    return share
