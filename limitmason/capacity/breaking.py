"""Joints that lose their strength at once: the step is cut where the first point reaches it, and what breaks is let go.

Within a step such points keep their strength, so that the step stays a cone program with a Newton finish. A step that
takes one of them beyond it ends where the first is at its strength; from there it breaks, at the same control
displacement, and the points that the others then leave overloaded break with it, those with at least half of the
largest overload at a time. The fall of the load is a jump: its energy is that of the break.
"""

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.capacity import descent, newton
from limitmason.capacity.certificate import SHORTEST, WITHIN
from limitmason.capacity.kinematics import Pose, motion_between, moved
from limitmason.capacity.point_law import PlasticHistory, slip_under_strength, trial
from limitmason.capacity.stepping import Node, by_programs, descent_first, node_of, quieted, step
from limitmason.capacity.system import Evaluated, System

_CUTS = 25  # tries to end a step where the first point breaks
_LEAP, _SURE = 0.02, 8  # of the step, and tries: where the first point still breaks only beyond, the state leaps
_ROUNDS = 400  # of points that break one after the other at one displacement
_TOGETHER = 0.5  # of the largest overload: what breaks in one round
_SLIPS = 1e-6  # of the elastic slip at the cohesion: less is rounding


def brittle(system: System) -> bool:
    """Whether any point loses its strength at once."""
    softening = system.law.softening
    return softening is not None and bool(np.logical_or(*softening.sudden).any())


def overload(system: System, old: PlasticHistory, at: Evaluated) -> Array:
    """Opening or slip beyond the strength of points that would break, over the elastic one at the strength, (m,).

    It is negative below the strength, and minus infinity where nothing can break.
    """
    law, softening = system.law, system.law.softening
    assert softening is not None
    damage = np.broadcast_to(np.asarray(old.damage), law.kn.shape)
    s = law.strength_at(damage)
    stress, new = at.returned.stress, at.returned.history
    least = SHORTEST * system.length
    opening = at.contact.displacement[:, 0] - new.lift - s.tension / law.kn
    tried, free = trial(law, old, at.contact.displacement), law.kn * (new.lift - at.contact.displacement[:, 0])
    slid = slip_under_strength(law, s, old, tried[:, 1:], free, np.linalg.norm(new.slip - old.slip, axis=1))
    spare = np.linalg.norm(stress[:, 1:], axis=1) - np.maximum(s.shear_strength(stress[:, 0]), 0.0)
    # an open point has no shear strength that slip could break, nor one beyond the tip of the cone
    # a point that does not slide is below its strength by its spare shear over its spring
    bears = (stress[:, 0] > -s.tension) & s.bears_shear(stress[:, 0])
    # slip ends at the tip, however little it was: how far that is passed tells where it broke
    past = np.maximum(-s.shear_strength(free), 0.0) / law.ks
    slid = np.where(slid > _SLIPS * s.cohesion / law.ks, slid + past, 0.0)
    sliding = np.where(slid > 0.0, slid, np.where(bears, np.minimum(spare / law.ks, 0.0), -np.inf))
    by_opening, by_slip = softening.sudden
    over = np.where(by_opening, opening / np.maximum(law.strength.tension / law.kn, least), -np.inf)
    other = np.where(by_slip, sliding / np.maximum(law.strength.cohesion / law.ks, least), -np.inf)
    return np.where(damage < 1.0, np.maximum(over, other), -np.inf)


def weakened(history: PlasticHistory, rows: Index) -> PlasticHistory:
    """The history with some points broken."""
    damage = np.array(np.broadcast_to(np.asarray(history.damage), history.lift.shape))
    damage[rows] = 1.0
    return history._replace(damage=damage)


def due(over: Array) -> Index:
    """Points that break: the most overloaded one and those that are as near to their strength."""
    worst = float(over.max(initial=-np.inf))
    return np.flatnonzero(over >= worst - WITHIN) if worst > 0.0 else np.empty(0, np.intp)


def overload_of(system: System, old: PlasticHistory, node: Node) -> Array:
    """Overload of a node that was reached from a history."""
    return overload(system, old, system.evaluate(node.pose, old, node.multiplier))


def cut(system: System, last: Node, new: Node, ratio: float) -> tuple[Node | None, Index | None]:
    """End a step where its first point breaks, and tell which points then break.

    The control displacement of that state is closed in on by the secant, every fourth time by halving. A state counts
    whose largest overload is between 0 and ``WITHIN``.

    Parameters
    ----------
    last, new : states at the two ends of the step
    ratio : work of the live load per control displacement [N], for programs

    Returns
    -------
    The state, and the rows of points that break at it. No state where a shorter step is not found, no rows where no
    point
    breaks.
    """
    over = overload_of(system, last.history, new)
    high, above = new, float(over.max(initial=-np.inf))
    if above <= 0.0:
        return new, None
    if new.jump:
        return new, due(over)
    low, below = last, float(overload_of(system, last.history, last).max(initial=-np.inf))
    # a point that is due already would leave the secant no room
    below = min(below, -WITHIN)
    for k in range(_CUTS):
        if above <= WITHIN:
            return high, due(over)
        if k >= _SURE and abs(high.control - low.control) < _LEAP * abs(new.control - last.control):
            break
        # aimed at the middle of what counts, so that the state found is past the strength
        share = (0.5 * WITHIN - below) / (above - below) if k % 4 < 3 else 0.5
        target = low.control + float(np.clip(share, 0.02, 0.98)) * (high.control - low.control)
        tried = step(system, last, target, between(last, high, target), ratio)
        if tried is None:
            return None, None
        found = overload_of(system, last.history, tried)
        worst = float(found.max(initial=-np.inf))
        if worst > 0.0:
            high, above, over = tried, worst, found
        else:
            low, below = tried, min(worst, -0.01 * WITHIN)
    # where the state leaps there is none just at the strength: the leap is part of the jump
    return high._replace(jump=True), due(over)


def between(last: Node, far: Node, target: float) -> tuple[Pose, float]:
    """Pose and multiplier at a control displacement [m] on the line between two nodes."""
    share = (target - last.control) / (far.control - last.control)
    pose = moved(last.pose, share * motion_between(last.pose, far.pose))
    return pose, last.multiplier + share * (far.multiplier - last.multiplier)


def released(system: System, node: Node, rows: Index, ratio: float, target: float | None) -> Node | None:
    """The state after points have broken, and those that their load then breaks.

    Points whose overload is near the largest break together; the rest is solved again, until no point is overloaded.
    Where no equilibrium is found, viscous sub-steps tell whether the blocks come to rest.

    Parameters
    ----------
    rows : the points that break first
    ratio : work of the live load per control displacement [N], for programs
    target : control displacement that is held [m]; None for the multiplier

    Returns
    -------
    the node, a jump whose ``broken`` are the points; None where no equilibrium is found
    """
    history, broken = weakened(node.history, rows), [rows]
    pose, multiplier, programs = node.pose, node.multiplier, 0
    for _ in range(_ROUNDS):
        solved = newton.solve(system, pose, multiplier, history, target)
        if solved is None:
            found = _solved(system, node, history, pose, multiplier, target, ratio)
            if found is None:
                return _fallen(system, node, history, broken, ratio, target, programs)
            solved, programs = found[0], programs + found[1]
        over = overload(system, history, solved.state)
        worst = float(over.max(initial=-np.inf))
        if worst <= WITHIN:
            return node_of(system, solved, True, programs)._replace(broken=np.unique(np.concatenate(broken)))
        more = np.flatnonzero(over >= _TOGETHER * worst)
        broken.append(more)
        history = weakened(history, more)
        pose, multiplier = solved.state.pose, solved.multiplier
    return None


def _solved(
    system: System,
    node: Node,
    history: PlasticHistory,
    pose: Pose,
    multiplier: float,
    target: float | None,
    ratio: float,
) -> tuple[newton.Solved, int] | None:
    """Solve a step that Newton's method alone did not: by descent and by programs.

    The order is that of :func:`stepping.step`. It returns the solved state and the number of programs, or None.
    """
    for by_descent in (True, False) if descent_first(system) else (False, True):
        if by_descent:
            solved = descent.solve(system, pose, multiplier, history, target)
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
    """The state that viscous sub-steps come to.

    Whatever they overload breaks at the end of each.
    """

    def breaks(old: PlasticHistory, at: Evaluated) -> PlasticHistory:
        rows = due(overload(system, old, at))
        if not len(rows):
            return at.returned.history
        broken.append(rows)
        return weakened(at.returned.history, rows)

    found = quieted(system, node.pose, history, target, node.multiplier, node.force[:, 0], ratio, 1e-2, breaks)
    if found is None:
        return None
    return found._replace(broken=np.unique(np.concatenate(broken)), programs=found.programs + programs)
