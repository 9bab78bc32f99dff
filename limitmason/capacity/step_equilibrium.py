"""From state to state: Newton from the extrapolated increment, other ways where it sticks, viscous jumps.

A step that fails is halved in ``path``.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.capacity import frozen_friction, interior, newton
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import PlasticHistory, trial
from limitmason.capacity.program import solve_step
from limitmason.capacity.system import Evaluated, System
from limitmason.mechanics.law import BELOW_THE_APEX

PROGRAMS = 7
"""Cone programs for a step at most: ``_PLAIN`` and then four with a proximal term, chosen."""

_PLAIN = 3
"""Programs of a step without a proximal term; Newton's method is tried from the last of them on: chosen."""

MANY, MANY_BY_DESCENT = 200, 500
"""Contact points from which an interior path, and from which descent, costs less than programs."""

SHORT = 10.0
"""Elastic lengths of a step of many points in plane that is halved no further before it may be a jump."""

_PATIENT, _MANY_PATIENT, _LONG_PATIENT = 2, 3, 8
"""Failures of a step of few points, of many, and of a long one on an interior path, see :func:`patience`: chosen."""

PROXIMAL = 1e-4
"""Viscosity of a program against the motion that it makes, in block weights per elastic length: chosen."""

_NEAR = 0.3
"""Unbalance in block weights below which Newton's method takes over from programs: chosen."""

_FALLS = 0.5
"""Motion through viscous sub-steps, in blocks, after which there is no state near: chosen."""

_QUIET = 1e-5
"""Largest viscous force at the end of a jump, in block weights: chosen."""

_FIRST_ETA = 0.02
"""Viscosity with which a jump of up to an elastic length begins, in block weights per elastic length: chosen."""

_LANDING_ETA = 1e-2
"""Viscosity with which blocks come down on each other under the dead load, in the same unit: chosen."""

_THINNER, _THICKER, _THICKEST = 0.2, 10.0, 10.0
"""Factors of the viscosity after a sub-step that was found, and after one that was not, and the most of it: chosen."""

_SUB_STEPS = 60
"""Viscous sub-steps of a jump at most: chosen."""


class Onward(NamedTuple):
    """The contacts found anew in a node's pose, with which the path goes on."""

    generation: int
    history: PlasticHistory
    force: Array  # [N], (m, c)
    before: Index  # their numbers among the node's own points, -1 for new ones, (m,)


class Node(NamedTuple):
    """A converged state of the path."""

    pose: Pose
    history: PlasticHistory
    multiplier: float  # of the live load [-]
    control: float  # control displacement [m]
    force: Array  # of the contact points [N], (m, c)
    jump: bool = False  # whether no states led to it
    programs: int = 0  # cone programs that it took
    iterations: int = 0  # of Newton's method
    generation: int = 0  # of its contacts
    onward: Onward | None = None  # contacts with which the path goes on, where they were found anew
    looked: Pose | None = None  # in which contacts were last looked for
    broken: Index | None = None  # numbers of the points that broke on the way to it
    handed: float = 0.0  # what contacts that were found anew at its start took off its load [-]


def node_of(solved: newton.Solved, jump: bool = False, programs: int = 0) -> Node:
    """The node of a solved step, whose history is committed here.

    Parameters
    ----------
    solved : a solution of the equations of the path
    jump : whether it was leapt to, without states on the way
    programs : how many cone programs were solved for it
    """
    s = solved.state
    return Node(
        s.pose, s.returned.history, solved.multiplier, control=s.control, force=s.force, jump=jump, programs=programs,
        iterations=solved.iterations,
    )


def dead_load(system: System, target: float | None = None, ratio: float = 1.0) -> Node | None:
    """The state under the dead load alone, from the unstressed pose, or None where none is found.

    Parameters
    ----------
    system : equations of the path's blocks and points
    target : control displacement that is held, with the multiplier that this takes [m]; None for no live load
    ratio : work of the live load per control displacement [N], for the program
    """
    old, pose = system.virgin(), system.at_rest()
    solved = newton.solve(newton.Way.begin(system, pose, 0.0, old, target))
    if solved is not None:
        return node_of(solved)
    # the associative program first: a limit frozen at no normal force would carry nothing
    found = by_programs(system, pose, old, target, multiplier=0.0, normal=None, ratio=ratio)
    if found is not None:
        return node_of(found[0], programs=found[1])
    # blocks that first have to come down on each other, through gaps
    return quieted(system, pose, old, target, multiplier=0.0, normal=None, ratio=ratio, eta=_LANDING_ETA)


def step(
    system: System, node: Node, target: float, guess: tuple[Pose, float] | None, ratio: float, *, patient: bool = True
) -> Node | None:
    """The state at the control displacement ``target`` [m], or None where it is not found.

    Newton's method has the first word. What it leaves is solved by programs, and by descent where they find nothing;
    from ``MANY`` points on, and where strength falls over a length, by :func:`_ways`, and by programs if ``patient``:
    but not where an interior path comes first, since they found nothing there that it had not.

    Parameters
    ----------
    system : equations of the path's blocks and points
    node : to begin from, with its history
    target : control displacement [m]
    guess : extrapolated pose and multiplier; None without any, which leaves Newton's method out
    ratio : work of the live load per control displacement [N], for the program
    patient : whether descent follows where an interior path finds nothing, see :func:`patience`
    """
    start, load = guess if guess is not None else (node.pose, node.multiplier)
    begun = newton.Way.begin(system, start, load, node.history, target)
    many = descent_first(system)  # many points, or strength that falls over a length
    for way in _ways(system, patient) if many else (newton.solve,):
        solved = None if guess is None and way is newton.solve else way(begun)
        if solved is not None:
            return node_of(solved)
    if many and not (patient and _programs_may_find(system)):
        return None
    found = by_programs(system, node.pose, node.history, target, node.multiplier, node.force[:, 0], ratio)
    if found is not None:
        return node_of(found[0], programs=found[1])
    solved = None if many else frozen_friction.solve(begun)
    return None if solved is None else node_of(solved)


def _ways(system: System, patient: bool) -> tuple[Callable[[newton.Way], newton.Solved | None], ...]:
    """How a step of many points is looked for, in turn.

    In plane an interior path finds nearly all that is there, by a quarter of the factorisations of descent, the way of
    ``frozen_friction``; in space it sticks more often. It knows neither strengths that fall nor tension beyond the tip
    of the cone.

    Parameters
    ----------
    system : equations of the path's blocks and points
    patient : whether descent follows, in plane, where the interior path finds nothing
    """
    strength = system.law.strength
    if _falls(system) or bool((strength.tension > (1.0 + BELOW_THE_APEX) * strength.apex).any()):
        return newton.solve, frozen_friction.solve
    if system.bodies.directions.shape[1] > 2:
        return newton.solve, frozen_friction.solve, interior.solve
    return (interior.solve, frozen_friction.solve) if patient else (interior.solve,)


def descent_first(system: System) -> bool:
    """Whether a step is left to descent before any program is solved for it.

    Programs hold strengths as they are: where these fall over a length, their fixed point swings to and fro.
    """
    return _falls(system) or len(system.bodies.area) >= (MANY if _by_interior_path(system) else MANY_BY_DESCENT)


def patience(system: System, move: float) -> int:
    """Failures of a step of a length [m] after which cone programs and a jump are tried for it.

    On an interior path a shorter step costs less than either, and goes on where they would leap to another branch.
    Steps of a few elastic lengths come to a turning point and no further.
    """
    if not descent_first(system):
        return _PATIENT
    return _LONG_PATIENT if _by_interior_path(system) and move > SHORT * system.length else _MANY_PATIENT


def _by_interior_path(system: System) -> bool:
    """Whether a step is first looked for by an interior path."""
    return _ways(system, patient=False)[0] is interior.solve


def _programs_may_find(system: System) -> bool:
    """Whether programs are tried where other ways found nothing: not for many points in plane.

    There they took a fifth of the time and found nothing, while in space they go on where others leap.
    """
    return not (_by_interior_path(system) and len(system.bodies.area) >= MANY)


def _falls(system: System) -> bool:
    """Whether the strength of any joint falls over a length."""
    softening = system.law.softening
    return softening is not None and any(bool((rate > 0.0).any()) for rate in softening.gradual)


def by_programs(
    system: System, pose: Pose, old: PlasticHistory, target: float | None, multiplier: float, normal: Array | None,
    ratio: float, viscosity: float = 0.0,
) -> tuple[newton.Solved, int] | None:
    """Find the end of a step as the fixed point of cone programs, then by Newton's method.

    Parameters
    ----------
    system : equations of the path's blocks and points
    pose, multiplier : to begin from
    old : history that the step begins with
    target : control displacement [m], None where the multiplier is prescribed
    normal : normal forces of the last program, at which friction is frozen [N], (m,); None at first, for associative
        friction
    ratio : work of the live load per control displacement [N]
    viscosity : of a jump's sub-step; 0 for a step in equilibrium

    Returns
    -------
    The solved state and the number of programs, or None.
    """
    area = system.bodies.area[:, None]
    way = newton.Way.begin(system, pose, multiplier, old, target, viscosity)
    for k in range(1, PROGRAMS + 1):
        now = way.state
        elastic = trial(system.law, old, now.contact.displacement) * area
        advance = None if target is None else (target - now.control) * ratio
        # without geometric stiffness free motions swing to and fro; a proximal term, gone at the end, damps them
        proximal = viscosity == 0.0 and k > _PLAIN
        eta, since = (PROXIMAL, None) if proximal else (viscosity, way.made if viscosity > 0.0 else None)
        found = solve_step(system, now, old, elastic, normal, advance, now.multiplier, eta, since)
        if found is None:
            return None
        normal, way = found.force[:, 0], way.moved(found.motion, found.multiplier)
        if not np.isfinite(way.unbalance):
            return None
        if way.unbalance < _NEAR or k >= _PLAIN:
            solved = newton.solve(way)
            if solved is not None:
                return solved, k
    return None


def jump(system: System, node: Node, target: float, ratio: float) -> Node | None:
    """The state reached through viscous sub-steps at a fixed control displacement, recorded as a jump.

    Every sub-step ends with its history committed; eta is lowered until the viscous force is below 1e-5 of a block
    weight, then Newton finishes without it.

    Parameters
    ----------
    system : equations of the path's blocks and points
    node : to begin from
    target : control displacement [m]
    ratio : work of the live load per control displacement [N]
    """
    # a long jump begins with less, so that its viscous force is of the same size
    eta = _FIRST_ETA / max(abs(target - node.control) / system.length, 1.0)
    return quieted(system, node.pose, node.history, target, node.multiplier, node.force[:, 0], ratio, eta)


def quieted(
    system: System, pose: Pose, history: PlasticHistory, target: float | None, multiplier: float, normal: Array | None,
    ratio: float, eta: float, commit: Callable[[PlasticHistory, Evaluated], PlasticHistory] | None = None,
) -> Node | None:
    """The state that viscous sub-steps come to, with no viscous force left in it.

    A force against the motion of each sub-step slows the blocks. Its viscosity eta is lowered from sub-step to sub-step
    until that force is next to nothing. The result is None where blocks are still on their way after half a block: they
    fall.

    Parameters
    ----------
    system : equations of the path's blocks and points
    pose, history : to begin from
    target : control displacement that is held [m]; None to keep the multiplier
    multiplier : its first value [-]
    normal : normal forces at which the programs' friction is frozen at first [N], (m,); None for associative friction
    ratio : work of the live load per control displacement [N]
    eta : the first viscosity [block weights per elastic length]
    commit : makes the history that is kept, from the history before a sub-step and the state at its end; None to keep
        that of this state
    """
    total, begin = 0, pose.shift  # programs so far, and where the blocks were
    early, last_resort = descent_first(system), _programs_may_find(system)
    for _ in range(_SUB_STEPS):
        # descent before programs where these do badly (see `descent_first`); Newton would find no state near
        found = None
        for way in _ways(system, patient=True) if early else ():
            if found is None and way is not newton.solve:
                solved = way(newton.Way.begin(system, pose, multiplier, history, target, eta))
                found = None if solved is None else (solved, 0)
        if found is None and last_resort:
            found = by_programs(system, pose, history, target, multiplier, normal, ratio, eta)
            total += PROGRAMS if found is None else found[1]
        if found is None:
            # no state with so little viscosity: more of it
            eta *= _THICKER
            if eta > _THICKEST:
                return None
            continue
        state = found[0].state
        kept = state.returned.history if commit is None else commit(history, state)
        pose, history, multiplier, normal = state.pose, kept, found[0].multiplier, state.force[:, 0]
        if float(np.abs(pose.shift - begin).max()) > _FALLS * system.size:
            return None
        if state.unbalance < _QUIET:
            last = newton.solve(newton.Way.begin(system, pose, multiplier, history, target))
            if last is not None:
                return node_of(last, jump=True, programs=total)
        # what was left over is the viscous force: with less viscosity it is less
        eta *= _THINNER
    return None


def handed_over(toward: float, nodes: Sequence[Node]) -> Array:
    """Load that contacts found anew took off and that is not regained yet, at every node [-], shape (n,).

    It is no fall of the structure's own load.

    Parameters
    ----------
    toward : sign of the load in the sense in which it is pushed
    nodes : of the path, in their order
    """
    lacks = [0.0]
    for before, node in pairwise(nodes):
        regained = max(0.0, toward * (node.multiplier - before.multiplier))
        lacks.append(lacks[-1] + node.handed if node.handed else max(0.0, lacks[-1] - regained))
    return np.array(lacks)
