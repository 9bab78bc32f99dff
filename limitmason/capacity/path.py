"""The path: how long steps are, when they are halved, how a limit point is closed in on, and when to stop."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity import breaking, stepping
from limitmason.capacity.generations import LEAST, Generations
from limitmason.capacity.kinematics import Pose, contact, motion_between, moved
from limitmason.capacity.stepping import Node
from limitmason.capacity.system import System
from limitmason.errors import InputError
from limitmason.progress import reached


class PathEnd(StrEnum):
    """How a path ended."""

    REACHED = "reached"
    PASSED = "limit point passed"
    OVERTURNED = "overturned"
    STOPPED = "stopped"
    PLATEAU = "slides on at constant load"
    CANNOT_STAND = "cannot stand under dead load"


REACHED, PASSED, OVERTURNED, STOPPED, PLATEAU, CANNOT_STAND = PathEnd
LEVEL, LASTING = 1e-6, 6  # a plateau: so little change, of the largest load, over so many samples

FARTHEST = 0.5
"""Control displacement up to which a limit point is looked for, over the median block size [-]."""

_SHORTEST = 1e-4  # elastic lengths
_TRIES = 12  # short steps towards a limit point that then does not come
_COSTLY = 5  # programs of a step after which the next is shorter
_MANY = 22  # iterations of a step after which the next is shorter
_BEYOND = (1e-3, 3e-3, 1e-2)  # of the median block size: jumps that are tried where no short step goes on
_PATIENT = 3  # failures of a step after which cone programs are solved for it
_HALVINGS = 6  # of a step that loses or makes energy
_OVER = 0.01  # least displacement of what overturns, of the median block size
_DROP = 0.002  # fall below a limit point after which it is passed, of its load
_DROP_OF_SOFTENING = 0.2  # the same where joints lose strength and others may take over
_STUCK = 1e-3  # of the slip that it would have made: less of it is none
_BEARS = 1e-4  # block weights: force of a point from which it counts how far it opens in a step


@dataclass(frozen=True)
class Steps:
    """How a path is stepped.

    Parameters
    ----------
    first : first step, in elastic lengths (mean block weight over the mean stiffness of a contact point) [-]
    largest : largest step over the median block size [-]
    smooth : departure of the multiplier from its extrapolation up to which steps grow, of the largest so far [-]
    peak : width in load within which the first limit point is known, of its load [-]
    energy : energy that a step may leave over, of its gross work [-]
    opening : gap to which a point that bears may open in a step, over the median block size [-]: where several points
        may let go, and one of them does, a longer step may end with another open, on a branch that no continuous path
        leads to
    sliding : slip that a point which slid before may lose by sticking in a step, over the median block size [-]: a step
        ends on the law of its end, so that a point that sticks there has not slid in it
    most : tries of a step, with those that are halved, after which the path is given up
    """

    first: float = 0.25
    largest: float = 0.04
    smooth: float = 0.02
    peak: float = 2e-4
    energy: float = 0.01
    opening: float = 1e-3
    sliding: float = 4e-3
    most: int = 400

    def __post_init__(self) -> None:
        """Refuse what is not positive."""
        for name in ("first", "largest", "smooth", "peak", "energy", "opening", "sliding", "most"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"steps: {name} must be a positive number, got {value!r}")


def follow(
    generations: Generations,
    nodes: list[Node],
    to: float | None,
    ratio: float,
    steps: Steps,
    say: Callable[[str], None],
    *,
    loading: bool = True,
) -> tuple[PathEnd, list[str]]:
    """Extend a path from its last node to a control displacement [m], or past its first limit point if ``to`` is None.

    Parameters
    ----------
    ratio : work-conjugate displacement of the live loads per control displacement, at first [N]; negative where they
        push against it
    loading : whether loads are pushed up: limit points are then closed in on, and the path ends where the load is back
        at nothing; False where a support moves and the multiplier is its reaction

    Returns
    -------
    status and warnings; the nodes are appended to the list

    Notes
    -----
    A step that leaves over more than ``steps.energy`` of its work is halved; where that does not mend it, energy that
    went is a jump, energy that came is refused.
    """
    system = generations.systems[0]
    begin = len(nodes) - 1
    sense = 1.0 if to is None or to >= nodes[-1].control else -1.0
    if to is None and ratio < 0.0:
        sense = -1.0
    toward = sense * np.sign(ratio)  # in which the multiplier grows
    end = nodes[begin].control + sense * FARTHEST * system.size if to is None else to
    longest = steps.largest * system.size
    advance = steps.first * system.length
    closing = failures = rough = tries = 0
    coarse = advance
    passed = False
    warnings: list[str] = []
    for _ in range(steps.most):
        last = generations.begun(nodes[-1])
        system = generations.systems[last.generation]
        left = sense * (end - last.control)
        if left <= 1e-9 * abs(end) or left <= 1e-6 * system.length:
            return REACHED, warnings
        advance = min(advance, longest)
        move = left if left < 1.2 * advance else advance
        guess = _extrapolated(system, nodes, begin, sense * move)
        patience = _PATIENT if stepping.is_large(system) else 2
        new = stepping.step(
            system, last, last.control + sense * move, guess, ratio, patient=failures >= patience
        )  # fmt: skip
        if new is None and failures >= patience:
            new = stepping.jump(system, last, last.control + sense * move, ratio)
            if new is not None:
                say(f"jump at {new.control:.4g} m: lambda {last.multiplier:.5f} to {new.multiplier:.5f}")
        if new is None and 0.5 * move < _SHORTEST * system.length and generations.shapes is not None:
            # where a block has lost a support there may be nothing near; where it comes to rest is beyond
            for share in _BEYOND:
                move = min(left, share * system.size)
                new = stepping.jump(system, last, last.control + sense * move, ratio)
                if new is not None:
                    say(f"jump to {new.control:.4g} m: lambda {last.multiplier:.5f} to {new.multiplier:.5f}")
                    break
            else:
                move = 0.0
        fragile = breaking.brittle(system)
        if new is not None and fragile:
            new = breaking.cut(system, last, new, ratio)
        if new is None:
            failures += 1
            advance = 0.5 * move
            if advance < _SHORTEST * system.length:
                warnings.append(
                    f"the path stops at {last.control:.4g} m, lambda {last.multiplier:.5g}: no step goes on from there"
                )
                return STOPPED, warnings
            continue
        failures = 0
        new = new._replace(generation=last.generation)
        share = 1.0
        if not new.jump and new.due is None:
            share = min(
                _until_open(system, last, new, steps.opening * system.size),
                generations.until_off(last, new),
                generations.until_landed(last, new),
                _until_stuck(generations, nodes, new, steps.sliding * system.size),
            )
        if share < 1.0 and move > _SHORTEST * system.length:
            advance = share * move
            continue
        over = 0.0 if new.jump else generations.energy(last, new)
        if abs(over) > steps.energy:
            if rough < _HALVINGS and move > _SHORTEST * system.length:
                rough += 1
                advance = 0.5 * move
                continue
            if over < 0.0:
                warnings.append(
                    f"the path stops at {last.control:.4g} m, lambda {last.multiplier:.5g}: the next step would make "
                    f"{-over:.1%} of its work out of nothing"
                )
                return STOPPED, warnings
            new = new._replace(jump=True)
            say(f"jump at {new.control:.4g} m: {over:.1%} of the step's work is lost")
        rough = 0
        # a limit point is closed in on from the node before the highest, with shorter steps
        falls = toward * (last.multiplier - new.multiplier) > LEVEL * max(abs(n.multiplier) for n in nodes[begin:])
        if loading and not passed and len(nodes) - begin >= 2 and not new.jump and last.broken is None and falls:
            before = nodes[-2]
            width = max(abs(last.multiplier - before.multiplier), abs(last.multiplier - new.multiplier))
            if width > steps.peak * abs(last.multiplier) and closing < 8:
                coarse = coarse if closing else abs(last.control - before.control)
                closing, tries = closing + 1, 0
                advance = 0.25 * abs(last.control - before.control)
                nodes.pop()
                continue
            passed, closing = True, 0
            move = 0.5 * max(coarse, move)
        if new.due is None:
            new = generations.looked_at(new, last)
            met = generations.through(new) if generations.shapes is not None and new.looked is new.pose else ""
            if met:
                warnings.append(
                    f"the path stops at {last.control:.4g} m, lambda {last.multiplier:.5g}: at {new.control:.4g} m "
                    f"blocks would go through each other where they have no contact point: {met}"
                )
                return STOPPED, warnings
            nodes.append(new)
        else:
            weak = new._replace(looked=last.looked)
            broken = breaking.released(system, weak, ratio, weak.control)
            nodes.append(weak)
            if broken is None:
                warnings.append(
                    f"the path stops at {weak.control:.4g} m, lambda {weak.multiplier:.5g}: joints break and no "
                    "equilibrium is found after it: a block that they held falls, or the state lies too far"
                )
                return STOPPED, warnings
            new = generations.looked_at(broken._replace(generation=weak.generation, looked=last.looked), weak)
            nodes.append(new)
            closing = 0
            count = _counted(new.broken)
            say(f"u {new.control:.4g} m, {count} break: lambda {weak.multiplier:.5f} to {new.multiplier:.5f}")
        if new.onward is not None:
            say(f"contacts found anew at {new.control:.4g} m")
        line = f"u {new.control:.4g} m, lambda {new.multiplier:.5f}"
        say(line)
        began = nodes[begin].control
        reached(None if to is None else (new.control - began) / (to - began), line)
        largest = max(abs(n.multiplier) for n in nodes[begin:])
        drop = _DROP_OF_SOFTENING if system.law.fall is not None else _DROP
        fell = passed or system.law.fall is not None
        if to is None and fell and toward * new.multiplier < (1.0 - drop) * largest:
            return PASSED, warnings
        level = [n.multiplier for n in nodes[begin:]][-LASTING:]
        if to is None and len(level) == LASTING and max(level) - min(level) <= LEVEL * largest and not passed:
            return PLATEAU, warnings
        # blocks that come down on each other through gaps may ask for a push the other way before they carry
        far = abs(new.control - nodes[begin].control) > _OVER * system.size
        if loading and fell and toward * new.multiplier <= 0.0 and far:
            return OVERTURNED, warnings
        off = np.inf if guess is None else abs(new.multiplier - guess[1]) / max(largest, 1e-300)
        if closing and tries < _TRIES:
            tries += 1
            advance = move
        elif new.programs >= _COSTLY or new.iterations > _MANY:
            advance = 0.6 * move
        elif off < 0.25 * steps.smooth:
            advance = (6.0 if off < 0.01 * steps.smooth else 2.5) * move
        else:
            advance = move * (1.5 if off < steps.smooth or guess is None else 0.7 if off > 4 * steps.smooth else 1.0)
    warnings.append(f"{steps.most} tries of a step were made and {end:.4g} m was not reached: raise steps.most")
    return STOPPED, warnings


def _extrapolated(system: System, nodes: list[Node], begin: int, move: float) -> tuple[Pose, float] | None:
    """Pose and multiplier by the last increment, or by the elastic tangent at the start."""
    last = nodes[-1]
    if len(nodes) - begin >= 2 and last.broken is None:
        before = nodes[-2]
        share = move / (last.control - before.control)
        pose = moved(last.pose, share * motion_between(before.pose, last.pose))
        return pose, last.multiplier + share * (last.multiplier - before.multiplier)
    now = system.evaluate(last.pose, last.history, last.multiplier)
    try:
        step = system.bordered(now, "control").solve(np.concatenate([np.zeros(system.order), [move / system.length]]))
    except RuntimeError:
        return None
    if not np.isfinite(step).all():
        return None
    return system.advanced(last.pose, step[:-1]), last.multiplier + float(step[-1])


def _until_open(system: System, last: Node, new: Node, most: float) -> float:
    """Share of a step in which no point that bore opens beyond a gap [m]; 1.0 for all of it.

    On a line from what its spring is pressed by at the start to its gap at the end, up to half of that gap.
    """
    bore = last.force[:, 0] > _BEARS * system.weight
    gap = contact(system.bodies, new.pose).displacement[:, 0] - new.history.lift
    pressed = last.force[:, 0] / (system.law.kn * system.bodies.area)
    far = bore & (gap > most)
    if not far.any():
        return 1.0
    return max(LEAST, float(((pressed[far] + 0.5 * most) / (pressed[far] + gap[far])).min()))


def _until_stuck(generations: Generations, nodes: list[Node], new: Node, most: float) -> float:
    """Share of a step in which no point that slid before, and now sticks, would have slid on by more than a length."""
    last = nodes[-1]
    if len(nodes) < 2 or last.broken is not None or last.control == nodes[-2].control:
        return 1.0
    slid = np.linalg.norm(last.history.slip - generations.begun(nodes[-2]).history.slip, axis=1)
    if last.onward is not None:
        slid = np.where(last.onward.before < 0, 0.0, slid[last.onward.before])
    on = slid * abs((new.control - last.control) / (last.control - nodes[-2].control))
    made = np.linalg.norm(new.history.slip - generations.begun(last).history.slip, axis=1)
    far = float(on[(made < _STUCK * on) & (new.force[:, 0] > 0.0)].max(initial=0.0))
    return 1.0 if far <= most else max(LEAST, 0.7 * most / far)


def _counted(points: NDArray[np.intp] | None) -> str:
    n = 0 if points is None else len(points)
    return "1 point" if n == 1 else f"{n} points"


def jumps(nodes: list[Node]) -> tuple[int, ...]:
    """Numbers of the nodes that were reached by a jump."""
    return tuple(k for k, (_, node) in enumerate(pairwise(nodes), 1) if node.jump)
