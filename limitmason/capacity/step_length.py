"""Steps of a path: their settings, their extrapolated end, and the shares in which too much happens.

``nodes`` are the states of the path so far, in their order. A step that fails is halved in ``path``, one
that was found in ``step_judges``.
"""

from dataclasses import dataclass

import numpy as np

from limitmason.capacity.contact_generations import LEAST, Generations
from limitmason.capacity.kinematics import Pose, contact, motion_between, moved
from limitmason.capacity.step_equilibrium import Node
from limitmason.capacity.system import System
from limitmason.checks import count, positive

STUCK = 1e-3
"""Slip of the slip that would have been made, below which a point has stuck [-]."""

BEARS = 1e-4
"""Force of a point from which it counts how far it opens in a step, in mean block weights [-]."""

_OPEN_MARGIN, _STUCK_MARGIN = 0.5, 0.7
"""Part of a bound to which a step is shortened, that of an opening and that of a slip [-]: chosen.

The shorter step should not miss the bound again.
"""

_COSTLY = 5
"""Cone programs of a step from which the next is shorter: chosen."""

_MANY = 22
"""Iterations of a step after which the next is shorter: chosen."""

# how many times as long the next step is, chosen on the walls of benchmarks/capacity_speed.py, not derived: after a
# costly step, after the first, where nothing was foretold, and else by the departure of the multiplier from its
# extrapolation over ``Steps.smooth``, up to the first number of each pair
_AFTER_COSTLY, _AFTER_FIRST, _UNTOLD = 0.6, 2.5, 1.5
_BY_DEPARTURE = ((0.01, 6.0), (0.25, 2.5), (1.0, 1.5), (4.0, 1.0), (np.inf, 0.7))


@dataclass(frozen=True)
class Steps:
    """How a path is stepped.

    Parameters
    ----------
    first : first step, in elastic lengths (mean block weight over the mean stiffness of a contact point) [-]
    largest : largest step over the median block size [-]
    smooth : departure of the multiplier from its extrapolation up to which steps grow, of the largest so far [-]
    peak : width in load within which the first limit point is known, and where a fifth of it is lost, of its load [-]
    energy : energy that a step may leave over, of its gross work [-]
    opening : gap to which a point that bears may open in a step, over the median block size [-]: where several points
        may let go, and one of them does, a longer step may end with another open, on a branch that no continuous path
        leads to
    sliding : slip that a point which slid before may lose by sticking in a step, over the median block size [-]: a step
        ends on the law of its end, so that a point that sticks there has not slid in it
    straight : distance in displacement of the curve from a straight line between two samples, as its tangents tell it,
        of the displacement [-]; where it is more, and in load above ``peak``, a sample is put between
    most : tries of a step, with those that are halved, after which the path is given up
    """

    first: float = 0.25
    largest: float = 0.04
    smooth: float = 0.02
    peak: float = 2e-4
    energy: float = 0.01
    opening: float = 3e-4
    sliding: float = 4e-3
    straight: float = 1.5e-2
    most: int = 1500

    def __post_init__(self) -> None:
        """Refuse what is not positive, and tries that are no whole number."""
        for name in ("first", "largest", "smooth", "peak", "energy", "opening", "sliding", "straight"):
            positive(f"steps: {name}", getattr(self, name))
        count("steps: most", self.most)


def extrapolated(system: System, nodes: list[Node], move: float) -> tuple[Pose, float] | None:
    """Guess of pose and multiplier after a move, by the last increment or the tangent.

    The tangent is taken at the start and where bonds just broke, as the increment before says nothing there. None where
    it is singular.

    Parameters
    ----------
    system : equations of the path's blocks and points
    nodes : states of the path so far; the last one, from which the step begins, with its contacts found anew
    move : control displacement, signed [m]
    """
    last = nodes[-1]
    if len(nodes) >= 2 and last.broken is None:
        before = nodes[-2]
        share = move / (last.control - before.control)
        pose = moved(last.pose, share * motion_between(before.pose, last.pose))
        return pose, last.multiplier + share * (last.multiplier - before.multiplier)
    step = system.along_tangent(system.evaluate(last.pose, last.history, last.multiplier), move)
    if step is None:
        return None
    return system.advanced(last.pose, step[:-1]), last.multiplier + float(step[-1])


def may_have_fallen(first: float, rose: float, last: float) -> bool:
    """Whether a load that rises from the start of a step may have fallen within it.

    It did where it falls at the end, or rises by less than by the slope of either end. The same on the cubic through
    both ends with their slopes, where the least of its slopes is negative.

    Parameters
    ----------
    first, last : what the slopes at the ends come to over the whole step [-]
    rose : by how much the load rose [-]
    """
    curved = 3.0 * (first + last) - 6.0 * rose
    turn = (2.0 * first + last - 3.0 * rose) / curved if curved > 0.0 else 1.0
    return first > 0.0 and (rose < min(first, last) or last < 0.0 or (0.0 < turn < 1.0 and first < curved * turn**2))


def bend(first: float, rose: float, last: float) -> tuple[float, float]:
    """How far a curve may lie off the straight line over a step [-], and the share of the step where that is.

    Where tangents meet within the step the curve lies between them and the line. Else it is taken as the cubic.

    Parameters
    ----------
    first, last : what the slopes at the ends come to over the whole step [-]
    rose : by how much the curve rose [-]
    """
    one, other = first - rose, rose - last
    if one * other > 0.0:
        return abs(one * other / (one + other)), other / (one + other)
    # a cubic with slopes that depart by d from the line at one end lies off it by 4 d / 27 at most
    return 4.0 / 27.0 * max(abs(one), abs(other)), 0.5


def growth(new: Node, off: float | None, smooth: float, second: bool) -> float:
    """How many times as long the next step is as the one to a node [-].

    Parameters
    ----------
    new : state at the end of the step that was made
    off : departure of its multiplier from the extrapolation, of the largest [-]; None where there was none
    smooth : as in :class:`Steps`
    second : whether the next step is the second
    """
    if new.programs >= _COSTLY or new.iterations > _MANY:
        return _AFTER_COSTLY
    if second:
        # whether the tangent of an unloaded joint is open or closed hangs on rounding: it foretells nothing
        return _AFTER_FIRST
    if off is None:
        return _UNTOLD
    return next((times for most, times in _BY_DEPARTURE if off < most * smooth), _BY_DEPARTURE[-1][1])


def until_open(system: System, last: Node, new: Node, most: float) -> float:
    """Share of a step in which no point that bore opens beyond a gap, at most 1.0 [-].

    Closing and opening are taken on one straight line, from what the spring is pressed by at the start to the gap at
    the end. The step is cut where the line is at half of the gap ``most`` [m].

    Parameters
    ----------
    system : equations of the path's blocks and points
    last, new : states at the ends of the step
    most : gap up to which a point may open [m]
    """
    bore = last.force[:, 0] > BEARS * system.weight
    gap = contact(system.bodies, new.pose).displacement[:, 0] - new.history.lift
    pressed = last.force[:, 0] / (system.law.kn * system.bodies.area)
    far = bore & (gap > most)
    if not far.any():
        return 1.0
    return max(LEAST, float(((pressed[far] + _OPEN_MARGIN * most) / (pressed[far] + gap[far])).min()))


def until_stuck(generations: Generations, nodes: list[Node], new: Node, most: float) -> float:
    """Share of a step in which no point misses too much slip by sticking [-].
    It is asked of points that slid in the step before and now stick: what they miss is the slip at the rate of before.
    1.0 where all of the step is so.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path so far
    new : state at the end of the step
    most : slip that may be lost by sticking [m]
    """
    last = nodes[-1]
    if len(nodes) < 2 or last.broken is not None or last.control == nodes[-2].control:
        return 1.0
    slid = np.linalg.norm(last.history.slip - generations.begun(nodes[-2]).history.slip, axis=1)
    if last.onward is not None:  # rows of points as before contacts were found anew; new ones have not slid
        slid = np.where(last.onward.before < 0, 0.0, slid[last.onward.before])
    on = slid * abs((new.control - last.control) / (last.control - nodes[-2].control))
    made = np.linalg.norm(new.history.slip - generations.begun(last).history.slip, axis=1)
    far = float(on[(made < STUCK * on) & (new.force[:, 0] > 0.0)].max(initial=0.0))
    return 1.0 if far <= most else max(LEAST, _STUCK_MARGIN * most / far)


def senses(begins: float, to: float | None, ratio: float) -> tuple[float, float]:
    """Signs of the control displacement, and of the multiplier that grows along it, as in :func:`.path.follow`."""
    sense = 1.0 if (ratio > 0.0 if to is None else to >= begins) else -1.0
    return sense, sense * float(np.sign(ratio))
