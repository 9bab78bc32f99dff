"""Joints that lose their strength at once: a step ends where its first point reaches it, and what breaks is let go.

Within a step such points keep their strength, so that the step stays a cone program with a Newton finish. A step that
takes any of them beyond it ends where the first is at its strength, found as a root. From there that point breaks, at
the same control displacement. Points that the others then leave overloaded break with it, those with at least half of
the largest overload at a time. The fall of the load is a jump: its energy is that of the break.
"""

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.capacity import frozen_friction, newton
from limitmason.capacity.certificate import SHORTEST, WITHIN
from limitmason.capacity.kinematics import Pose, contact, motion_between, moved
from limitmason.capacity.point_law import PlasticHistory, slip_under_strength, trial
from limitmason.capacity.step_equilibrium import Node, by_programs, descent_first, node_of, quieted, step
from limitmason.capacity.system import Evaluated, System

_CLOSE = 1e-5
"""Overload that a step is ended at; up to WITHIN counts where rounding or a bend lets it come no nearer."""

_CUTS = 40
"""Tries at most to end a step where its first point breaks: 40 halvings are 1e-12 of it."""

_SURE = 8
"""Tries after which the far end of the step is doubted: chosen."""

_HALVED = 4
"""Every so many tries the interval is halved, should the secant not close in on it from both ends: chosen."""

_INSIDE = 0.01
"""Part of the interval that a try keeps away from its ends [-]: chosen."""

_LEAP = 1e-6
"""Part of a step: where its first point breaks only beyond an interval so short, the state leaps [-]."""

_BEYOND = 1.02
"""Part of the way to where a break is foreseen that is tried, so that it lies before the end [-]: chosen."""

_AIMS = 3
"""Times that a break is foreseen anew: chosen."""

_ALIKE = 1e-6
"""Overload that counts as none, and by which points of a symmetric structure may differ: 1e-7 by rounding."""

_ROUNDS = 400
"""Rounds at most of points that break one after the other at one displacement: chosen."""

_TOGETHER = 0.5
"""Part of the largest overload from which points break in one round: chosen, one point at a time takes longest."""

_SLIPS = 1e-6
"""Part of the elastic slip at the cohesion below which a slip is rounding [-]."""

_FALLING_ETA = 1e-2
"""Viscosity with which blocks fall after a break at first, in block weights per elastic length: chosen."""

_NEVER = -np.inf
"""Overload of a point that cannot break."""


def brittle(system: System) -> bool:
    """Whether any point loses its strength at once."""
    softening = system.law.softening
    return softening is not None and bool(np.logical_or(*softening.sudden).any())


def overload(system: System, old: PlasticHistory, displacement: Array, stress: Array, new: PlasticHistory) -> Array:
    """Opening or slip of the points beyond strength, over the elastic one there, (m,).

    By opening (w - lift - t / kn) / (t / kn), by slip p / (c / ks), with t and c at peak; the larger of both. It is
    negative below the strength, and minus infinity where nothing can break.

    Parameters
    ----------
    system : equations of the step, with the law of its points
    old : history that the state was reached from
    displacement : (w, e...) of b against a in the state, opening positive [m], (m, c)
    stress : (N, T...) in the state, compression positive [Pa], (m, c)
    new : history of the state
    """
    law, softening = system.law, system.law.softening
    assert softening is not None
    damage = np.broadcast_to(np.asarray(old.damage), law.kn.shape)
    s = law.strength_at(damage)
    least = SHORTEST * system.length  # opening or slip [m] that an overload is taken of, at least
    opening = displacement[:, 0] - new.lift - s.tension / law.kn
    tried, unlimited = trial(law, old, displacement), law.kn * (new.lift - displacement[:, 0])  # [Pa]
    slid = slip_under_strength(law, s, old, tried[:, 1:], unlimited, np.linalg.norm(new.slip - old.slip, axis=1))
    beyond = np.linalg.norm(stress[:, 1:], axis=1) - np.maximum(s.shear_strength(stress[:, 0]), 0.0)
    # an open point has no shear strength that slip could break, nor one beyond the tip of the cone
    # a point that does not slide is below its strength: ``beyond`` is negative, and over its spring a slip that lacks
    bears = (stress[:, 0] > -s.tension) & s.bears_shear(stress[:, 0])
    # slip ends at the tip, however little it was: how far that is passed tells where it broke
    past = np.maximum(-s.shear_strength(unlimited), 0.0) / law.ks
    slid = np.where(slid > _SLIPS * s.cohesion / law.ks, slid + past, 0.0)
    sliding = np.where(slid > 0.0, slid, np.where(bears, np.minimum(beyond / law.ks, 0.0), _NEVER))
    opens, slides = softening.sudden  # whether opening, and whether slip, breaks a point at once
    over_opening = np.where(opens, opening / np.maximum(law.strength.tension / law.kn, least), _NEVER)
    over_slip = np.where(slides, sliding / np.maximum(law.strength.cohesion / law.ks, least), _NEVER)
    return np.where(damage < 1.0, np.maximum(over_opening, over_slip), _NEVER)


def weakened(history: PlasticHistory, rows: Index) -> PlasticHistory:
    """The history with some points broken: their damage is 1.

    Parameters
    ----------
    rows : numbers of these points
    """
    damage = np.array(np.broadcast_to(np.asarray(history.damage), history.lift.shape))
    damage[rows] = 1.0
    return history._replace(damage=damage)


def worst_of(over: Array) -> Index:
    """The most overloaded point, with those that are alike to it to rounding, or none where no point is overloaded."""
    worst = float(over.max(initial=-np.inf))
    return np.flatnonzero(over >= worst - _ALIKE) if worst > 0.0 else np.empty(0, np.intp)


def overload_of(system: System, old: PlasticHistory, node: Node) -> Array:
    """Overload of the points in a node that was reached from history ``old`` [-], shape (m,), see :func:`overload`."""
    apart = contact(system.bodies, node.pose).displacement
    return overload(system, old, apart, stress=node.force / system.bodies.area[:, None], new=node.history)


def _overload_at(system: System, old: PlasticHistory, at: Evaluated) -> Array:
    """Overload of the points in a pose evaluated from history ``old`` [-], shape (m,), see :func:`overload`."""
    return overload(system, old, at.contact.displacement, at.returned.stress, at.returned.history)


def cut(system: System, last: Node, low: Node, new: Node, ratio: float) -> tuple[Node | None, Index | None]:
    """End a step where its first point breaks, and tell which points then break.

    A root of the overload over the control displacement, between ``low`` without and ``high`` with a point beyond its
    strength. By the secant and every fourth time by halving it comes to a state in which the first point alone is
    beyond, by no more than ``_CLOSE``, after ``_SURE`` tries ``WITHIN``. Points that are alike to it to rounding at
    both ends break with it. Where there is no such state, the one beyond the strength is returned as a jump.

    Where all of ``_SURE`` tries are below the strength, the far end may lie on another branch: it is found anew from
    the last of them, and where no point is beyond its strength then, that is the end of the step.

    Parameters
    ----------
    system : equations of the path's blocks and points
    last, new : states at the two ends of the step
    low : the last state of the step in which no point is known to be beyond its strength, ``last`` itself at first
    ratio : work of the live load per control displacement [N], for programs

    Returns
    -------
    The state, and the rows of points that break at it. No state where a shorter step is not found, no rows where no
    point breaks.
    """
    above = overload_of(system, last.history, new)  # overloads at ``high``, and ``below`` those at ``low``, (m,)
    if not (above > _ALIKE).any():
        return new, None
    if new.jump:
        return new, worst_of(above)
    # a point at its strength already would leave the secant no room: it counts as just below
    below = np.minimum(overload_of(system, last.history, low), -_ALIKE)
    high, dropped, latest = new, None, low  # dropped: control and overloads of the end that was replaced last
    for k in range(_CUTS):
        first, rest = _first(below, above)
        width = high.control - low.control
        narrow = abs(width) < _LEAP * abs(new.control - last.control)
        near = above[first].max() <= (WITHIN if narrow or k >= _SURE else _CLOSE)
        if near and not (above[rest] > 0.0).any():
            return high, first
        if narrow:
            break
        share = 0.5
        if k % _HALVED < _HALVED - 1:
            share = _aimed(below, above, first, rest)
            if dropped is not None and abs(latest.control - dropped[0]) < abs(width):
                # the last two states are nearer to each other than both ends: their secant to 0.5 _CLOSE is truer
                at, came = (below if latest is low else above)[first[0]], dropped[1][first[0]]
                rise = (at - came) / (latest.control - dropped[0]) * width if np.isfinite([at, came]).all() else 0.0
                onward = (0.5 * _CLOSE - at) / rise + (latest is high) if rise > 0.0 else -1.0  # share from ``low``
                share = onward if 0.0 < onward < 1.0 else share
        doubted = high is new and k == _SURE
        inside = float(np.clip(share, _INSIDE, 1.0 - _INSIDE))
        target = new.control if doubted else low.control + inside * width
        begin = (low.pose, low.multiplier) if doubted else between(low, high, target)
        tried = step(system, last, target, begin, ratio)
        if tried is None:
            return None, None
        found = overload_of(system, last.history, tried)
        if doubted and not (found > _ALIKE).any():
            return tried, None
        if (found > 0.0).any():
            # an end found anew and the old one are at one displacement: no secant goes through them
            dropped, high, above = None if doubted else (high.control, above), tried, found
        else:
            dropped, low, below = (low.control, below), tried, np.minimum(found, -_INSIDE * _ALIKE)  # as just below
        latest = tried
    # where the state leaps there is none just at the strength: the leap is part of the jump
    return high._replace(jump=True), worst_of(above)


def _first(below: Array, above: Array) -> tuple[Index, Index]:
    """Numbers of the points that come to their strength first between two states, (k,), and of the others that do.

    Parameters
    ----------
    below : overloads in the state where none is beyond its strength [-], shape (m,)
    above : overloads in the other state [-], shape (m,)
    """
    rows = np.flatnonzero(above > 0.0)
    share = _shares(below[rows], above[rows])
    k = rows[int(np.argmin(share))]
    alike = np.logical_and(*(np.isclose(x[rows], x[k], rtol=0.0, atol=_ALIKE) for x in (below, above)))
    return rows[alike], rows[~alike]


def _shares(below: Array, above: Array) -> Array:
    """Shares of the straight way from one state to another at which points come to their strength [-], shape (k,).

    Infinity for those that do not come nearer to it, and a half for those that leap beyond it: their overload before
    is minus infinity, which no line starts from.

    Parameters
    ----------
    below, above : overloads in both states [-], shape (k,)
    """
    known = np.isfinite(below)
    rises = known & (above > below)
    share = np.where(known | (above <= 0.0), np.inf, 0.5)
    share[rises] = -below[rises] / (above[rises] - below[rises])
    return share


def _aimed(below: Array, above: Array, first: Index, rest: Index) -> float:
    """Share of the way at which only the first is beyond its strength, and by half of what it may be [-].

    Parameters
    ----------
    below, above : overloads in both states [-], shape (m,)
    first, rest : numbers of the points that come first and of the others, see :func:`_first`
    """
    share = float(_shares(below[first], above[first]).min())
    second = float(_shares(below[rest], above[rest]).min(initial=1.0))
    rise = float((above[first] - below[first]).max())
    return share + min(0.5 * _CLOSE / rise, 0.5 * max(second - share, 0.0))


def foreseen(
    system: System, last: Node, guess: tuple[Pose, float], target: float, ratio: float
) -> tuple[Node | None, Index | None]:
    """The state at which the first point breaks and the points that do, where that is foreseen within a step.

    Overloads, negative below the strength and 0 at it, tell on the line to the guess where the first point comes to
    it. A step goes a little beyond. Where none breaks yet it is told anew on the line from ``last`` through what was
    found, ``_AIMS`` times at most.

    Parameters
    ----------
    system : equations of the path's blocks and points
    last : state at the start of the step
    guess : extrapolated pose and multiplier at the control displacement ``target`` [m]
    ratio : work of the live load per control displacement [N], for programs

    Returns
    -------
    tuple
        As of :func:`cut`; twice None where no break is foreseen, or no step leads to it.
    """
    far, low = last._replace(pose=guess[0], multiplier=guess[1], control=target), last
    above = _overload_at(system, last.history, system.evaluate(far.pose, last.history, far.multiplier))
    # at ``last``, where every line begins, also when ``low`` has moved on; as in :func:`cut` a point at its strength
    # already counts as just below, else the share of the way to it is zero
    below = np.minimum(overload_of(system, last.history, last), -_ALIKE)
    for _ in range(_AIMS):
        share = _BEYOND * float(_shares(below, above).min(initial=np.inf))
        control = last.control + share * (far.control - last.control)
        if (target - control) * (target - last.control) <= 0.0:
            break  # at the end of the step or beyond it, or nowhere
        tried = step(system, last, control, between(last, far, control), ratio, patient=False)
        if tried is None:
            break
        above = overload_of(system, last.history, tried)
        if (above > 0.0).any():
            return cut(system, last, low, tried, ratio)
        far = low = tried
    return None, None


def between(last: Node, far: Node, target: float) -> tuple[Pose, float]:
    """Pose and multiplier at a control displacement [m] on the line between two nodes."""
    share = (target - last.control) / (far.control - last.control)
    pose = moved(last.pose, share * motion_between(last.pose, far.pose))
    return pose, last.multiplier + share * (far.multiplier - last.multiplier)


def released(system: System, node: Node, rows: Index, ratio: float, target: float | None) -> Node | None:
    """The state after points have broken, and those that are overloaded by it.

    Points whose overload is near the largest break together; the rest is solved again, until no point is overloaded.
    Where no equilibrium is found, viscous sub-steps tell whether the blocks come to rest.

    Parameters
    ----------
    system, node : equations of the path's blocks and points, and the state at which points break
    rows : numbers of the points that break first
    ratio : work of the live load per control displacement [N], for programs
    target : control displacement that is held [m]; None to hold the multiplier instead

    Returns
    -------
    the node, a jump whose ``broken`` are all points that broke; None where no equilibrium is found, or points still
    break after ``_ROUNDS`` rounds
    """
    history, broken = weakened(node.history, rows), [rows]
    pose, multiplier, programs = node.pose, node.multiplier, 0
    for _ in range(_ROUNDS):
        solved = newton.solve(newton.Way.begin(system, pose, multiplier, history, target))
        if solved is None:
            found = _solved(system, node, history, pose, multiplier, target, ratio)
            if found is None:
                return _fallen(system, node, history, broken, ratio, target, programs)
            solved, programs = found[0], programs + found[1]
        over = _overload_at(system, history, solved.state)
        worst = float(over.max(initial=-np.inf))
        if worst <= _ALIKE:
            last = node_of(solved, jump=True, programs=programs)
            return last._replace(broken=np.unique(np.concatenate(broken)))
        more = np.flatnonzero(over >= _TOGETHER * worst)
        broken.append(more)
        history = weakened(history, more)
        pose, multiplier = solved.state.pose, solved.multiplier
    return None


def _solved(
    system: System, node: Node, history: PlasticHistory, pose: Pose, multiplier: float, target: float | None,
    ratio: float,
) -> tuple[newton.Solved, int] | None:
    """Solve a step that Newton's method alone did not, by descent and by programs.

    No interior path: it knows no strength that falls. It returns the solved state and the number of programs, or None.

    Parameters
    ----------
    system, node : equations of the path, and the state from which the first points broke
    history : with the damage of the points that broke so far
    pose, multiplier : guess of the state, for descent; programs find their way from ``node``
    target : control displacement that is held [m]; None to hold the multiplier instead
    ratio : work of the live load per control displacement [N]
    """
    for by_descent in (True, False) if descent_first(system) else (False, True):
        if by_descent:
            solved = frozen_friction.solve(newton.Way.begin(system, pose, multiplier, history, target))
            found = None if solved is None else (solved, 0)
        else:
            found = by_programs(system, node.pose, history, target, node.multiplier, node.force[:, 0], ratio)
        if found is not None:
            return found
    return None


def _fallen(
    system: System,
    node: Node,
    history: PlasticHistory,
    broken: list[Index],
    ratio: float,
    target: float | None,
    programs: int,
) -> Node | None:
    """The state that viscous sub-steps come to, where whatever they overload breaks at the end of each.

    Parameters
    ----------
    system, node : equations of the path, and the state from which the first points broke
    history : with the damage of all that broke so far
    broken : numbers of the points that broke, a list by round; more are added
    ratio : work of the live load per control displacement [N]
    target : control displacement that is held [m]; None to hold the multiplier instead
    programs : cone programs that were solved before

    Returns
    -------
    The node at rest, or None where the blocks do not come to rest.
    """

    def breaks(old: PlasticHistory, at: Evaluated) -> PlasticHistory:
        """History of a sub-step at its end, with what it overloads broken."""
        rows = worst_of(_overload_at(system, old, at))
        if not len(rows):
            return at.returned.history
        broken.append(rows)
        return weakened(at.returned.history, rows)

    found = quieted(
        system, node.pose, history, target, node.multiplier, node.force[:, 0], ratio, eta=_FALLING_ETA, commit=breaks
    )
    if found is None:
        return None
    return found._replace(broken=np.unique(np.concatenate(broken)), programs=found.programs + programs)
