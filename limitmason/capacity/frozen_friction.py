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
from limitmason.capacity.point_law import ElastoplasticLaw, return_map, returned_stress
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


def solve(way: newton.Way) -> newton.Solved | None:
    """The end of a step by descent, or None where it is not found.

    What is found is in equilibrium by the true law, or is not returned: Newton's method on it has the last word.
    ``way`` is where descent begins.
    """
    system, viscosity, last_word = way.system, way.viscosity, newton.LastWord()
    for k in range(ITERATIONS):
        now, unbalance = way.state, way.unbalance
        if not np.isfinite(unbalance):
            return None
        if (found := last_word.on(way, k)) is not None:
            return found
        # one iteration of Newton's method on the potential of the law whose friction is frozen here
        law = frozen(system.law, now.returned.stress[:, 0], now.returned.history.damage)
        returned = return_map(law, way.old, now.contact.displacement)
        force = returned.stress * system.bodies.area[:, None]
        rest = system.unbalanced(now.pose, now.wrenches, force, now.pulled, now.multiplier) - viscosity * way.made
        tangent = way.tangent(now._replace(returned=returned), viscosity + min(DAMPING * unbalance, _MOST))
        step = None if tangent is None else tangent(rest)
        if step is None:
            return None
        # the multiplier moves in full: the potential that the motion goes down on is that of the new load
        multiplier, motion, share = now.multiplier + float(step[-1]), step[:-1], 1.0
        # while the control still moves there is no potential to go down on: the whole step is made
        if abs(way.missing) < _ARRIVED * max(1.0, float(np.abs(motion).max(initial=0.0))):
            share = _lowest(way, law, motion, multiplier)
        way = way.moved(share * motion, multiplier)
    return None


def frozen(law: ElastoplasticLaw, normal: Array, damage: Array | float = 0.0) -> ElastoplasticLaw:
    """The associative law of friction at frozen normal stresses [Pa] and damage, shape (m,), with dilation as it is."""
    return law._replace(strength=law.strength_at(damage).frozen(normal), softening=None)


def _lowest(way: newton.Way, law: ElastoplasticLaw, motion: Array, multiplier: float) -> float:
    """Share of a motion at which the potential of the frozen law is lowest, by its slope.

    Parameters
    ----------
    way : at the start of the motion
    law : law whose friction is frozen
    motion : of the full step, in own units, shape (order,)
    multiplier : of the live load after it [-]
    """
    system, now, viscosity = way.system, way.state, way.viscosity
    # displacements of the points [m], and what the motion adds to them and to the ties' elongation [m]
    apart, (work, longer) = now.contact.displacement, system.relative(now, motion)
    dead, live = system.applied(now.pose)
    load = dead + multiplier * live - viscosity * way.made
    if system.bodies.deforming:
        load = load + system.sprung(now.pose)
    # rise of the slope with the share, by the viscous force and by the springs of the blocks' shapes
    against = float(motion @ ((viscosity + system.springs_own) * motion))
    area, tied = system.bodies.area[:, None], len(longer) > 0

    def slope(share: float) -> float:
        """Derivative of the potential by the share of the motion, at a share, in own units."""
        force = returned_stress(law, way.old, apart + share * work) * area
        pulls = tension(system.ties, now.pulled.elongation + share * longer, way.old.stretched)[0] if tied else longer
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
