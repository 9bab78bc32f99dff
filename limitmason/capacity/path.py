"""The path: how long steps are, when they are halved, how a limit point is closed in on, and when to stop.

A try of a step is accepted, tried again shorter, or ends the path. Up to its limit point a path rises; it then closes
in on it with short steps from the sample before the highest, and falls.
"""

from collections.abc import Callable

import numpy as np

from limitmason.capacity import breaking, step_equilibrium
from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.limit_point import DROP, LEVEL, passed
from limitmason.capacity.outcomes import PathEnd, Phase, StepOutcome, Try
from limitmason.capacity.step_equilibrium import Node
from limitmason.capacity.step_judges import CLOSER, DROP_OF_SOFTENING, MISSED, ROUNDS, JudgedPath
from limitmason.capacity.step_length import Steps, extrapolated, growth
from limitmason.capacity.system import System
from limitmason.display.progress import reached
from limitmason.storage.interrupts import ends_early

_TRIES = 12
"""Short steps towards a limit point that then does not come: chosen."""

_BEYOND = (1e-5, 1e-4, 1e-3, 3e-3, 1e-2)
"""Jumps that are tried where no short step goes on, over the median block size [-]: chosen."""

_OVER = 0.01
"""Least displacement of what overturns, over the median block size [-]: chosen."""

_WHOLE = 1.2
"""Steps up to which what is left of a path is made in one, and not split into a step and a splinter [-]: chosen."""


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
    generations : contacts and equations of the path, part by part
    nodes : states of the path so far; the new ones are appended
    to : control displacement at which the path ends [m]; None for its first limit point
    ratio : work of the live load per control displacement, at first [N]; negative where the live loads push against it
    steps : lengths and tolerances of the steps
    say : called with a line of text on every step
    loading : whether loads are pushed up: limit points are then closed in on, and the path ends where the load is back
        at nothing; False where a support moves and the multiplier is its reaction

    Returns
    -------
    status and warnings

    Notes
    -----
    A step that leaves over more than ``steps.energy`` of its work is halved; where that does not mend it, energy that
    went is a jump, energy that came is refused.
    """
    path = _Path(generations, nodes, to, ratio, steps, say, loading)
    end = path.followed()
    if path.taken_off > DROP:
        path.warnings.append(
            f"where contacts were found anew the load fell by up to {path.taken_off:.1%} of its largest, which is no "
            "limit point of the structure: with other steps the path may come to another one"
        )
    return end, path.warnings


class _Path(JudgedPath):
    """A path on its way, from step to step.

    State, counters and judges are those of :class:`.step_judges.JudgedPath`.

    Attributes
    ----------
    generations, nodes, to, ratio, steps, say, loading : as of :func:`follow`
    begin, origin : number of the first node of this path, and that node; those before are of the path it goes on from
    sense, toward : signs of the control displacement, and of the load in the sense in which it is pushed
    end : control displacement beyond which no step goes [m]
    advance, shortest, longest : length of the next try of a step, and bounds of it [m]
    bound : length below which steps were found to leap over the largest load [m]; infinite where none did
    phase : where the path is by its largest load; ``rounds`` and ``short`` count tries and steps of closing in on it
    failures, halved, cuts : how often this step was not found, halved for energy or bonds, and cut for its bend
    again : whether this try is of a step that was tried before, and is to be shorter
    ahead : state found beyond a bend, which the next shorter steps go towards; None for none
    near : shortest try so far that loses energy: a jump, should no step go on without; None for none
    passed : whether this step passed a limit point
    coarse : length of a step before a limit point was closed in on [m]
    steady : how many steps to come do not grow
    taken_off : largest fall by contacts found anew, of the largest load [-]
    """

    def followed(self) -> PathEnd:
        """Follow the path from its first states to its end, and say how it ended."""
        try:
            return self._stepped()
        except KeyboardInterrupt:
            ends_early()
            return self._stopped(self.nodes[-1], "it was interrupted; go on with start=", PathEnd.INTERRUPTED)

    def _stepped(self) -> PathEnd:
        """Step until the path ends, or stop after as many tries as are allowed."""
        for _ in range(self.steps.most):
            verdict = self._step()
            if isinstance(verdict, PathEnd):
                return verdict
            self.again = verdict is StepOutcome.SHORTER  # the next try is of the same step
        self.warnings.append(
            f"{self.steps.most} tries of a step were made and {self.end:.4g} m was not reached: go on with start=, or "
            "raise steps.most"
        )
        return PathEnd.STOPPED

    def _step(self) -> StepOutcome | PathEnd:
        """Try one step: find its end, judge it, append it, and choose the next length.

        It returns how the path ends, or whether the step was taken or is to be tried again shorter.
        """
        last = self.generations.begun(self.nodes[-1])
        system = self.generations.systems[last.generation]
        left = self.sense * (self.end - last.control)
        # the end is reached but for the rounding of displacements, or far less than an elastic length
        if left <= 1e-9 * abs(self.end) or left <= 1e-6 * system.length:
            return PathEnd.REACHED
        found = self._found(system, last, left)
        if not isinstance(found, Try):
            return found
        self.failures = 0  # this and the two below count tries of one step
        verdict = self.judged(found)
        if verdict is not StepOutcome.ACCEPTED:
            return verdict
        self.halved = self.cuts = 0
        if self._closes_in(found):
            return StepOutcome.SHORTER
        if self.phase is Phase.FALLING and self.toward * found.new.multiplier > (1.0 + LEVEL) * self._largest():
            self.phase = Phase.RISING  # what was passed was no limit point
        end = self._appended(found) or self._ended(found.system, self.nodes[-1])
        if end is None:
            self._pace(found, self.nodes[-1])
        return end or StepOutcome.ACCEPTED

    def _found(self, system: System, last: Node, left: float) -> Try | StepOutcome | PathEnd:
        """Find the end of a step, by ever more costly ways the more often it failed.

        Newton's method comes first, then a jump in viscous sub-steps, then longer jumps.

        Parameters
        ----------
        system : equations with the contacts of the step
        last : state that the step begins from, its contacts found anew
        left : control displacement to the end of the path [m]
        """
        self.advance = min(self.advance, self.longest, self.bound)
        # a step may be a little longer to come to the end; one that was cut is not stretched to it again
        move = left if left < (1.0 if self.again else _WHOLE) * self.advance else self.advance
        guess = extrapolated(system, [*self.nodes[self.begin : -1], last], self.sense * move)
        patient = self.failures >= step_equilibrium.patience(system, move)
        target = last.control + self.sense * move
        # after a step that was cut for a bend the next begins on the line to what was found beyond it
        on = self.ahead if self.cuts == 0 else None
        begin = guess if on is None else breaking.between(last, on, target)
        if guess is not None and breaking.brittle(system):
            new, due = breaking.foreseen(system, last, guess, target, self.ratio)
            if new is not None:
                return Try(system, last, move, guess, new._replace(generation=last.generation), due)
        new = step_equilibrium.step(system, last, target, begin, self.ratio, patient=patient)
        if new is None and on is not None:
            # what was found beyond the bend is no way from here: as long a step again, to where it is extrapolated
            self.ahead, self.advance = None, move
            return StepOutcome.SHORTER
        if new is None and patient:
            new = step_equilibrium.jump(system, last, target, self.ratio)
            if new is not None:
                self.say(f"jump at {new.control:.4g} m: lambda {last.multiplier:.5f} to {new.multiplier:.5f}")
        if new is None and 0.5 * move < self.shortest:
            if self.near is not None and self.near.last.control == last.control:
                return self._jumped(self.near)
            if self.generations.shapes is not None:
                new, move = self._jump_ahead(system, last, left)
        due = None
        if new is not None and breaking.brittle(system):
            new, due = breaking.cut(system, last, last, new, self.ratio)
        if new is not None:
            return Try(system, last, move, guess, new._replace(generation=last.generation), due)
        self.failures += 1
        self.advance = 0.5 * move
        return (
            self._stopped(last, "no step goes on from there") if self.advance < self.shortest else StepOutcome.SHORTER
        )

    def _jump_ahead(self, system: System, last: Node, left: float) -> tuple[Node | None, float]:
        """The state that a jump leads to, the shortest first, and how far on [m].

        It is called where no step goes on, not even one that loses energy, on a path that finds contacts anew. A block
        may have lost its support there and come to rest farther on. A jump is told and warned of; without one None, 0.

        Parameters
        ----------
        system : equations with the contacts of the step
        last : state that the step begins from
        left : control displacement to the end of the path [m]
        """
        for share in _BEYOND:
            move = min(left, share * system.size)
            new = step_equilibrium.jump(system, last, last.control + self.sense * move, self.ratio)
            if new is not None:
                self.say(f"jump to {new.control:.4g} m: lambda {last.multiplier:.5f} to {new.multiplier:.5f}")
                self.warnings.append(
                    f"no state was found between {last.control:.4g} m, lambda {last.multiplier:.5g}, and "
                    f"{new.control:.4g} m: the path leaps, and finer steps may find larger loads there"
                )
                return new, move
            if move == left:  # a longer jump would end there too
                break
        return None, 0.0

    def _closes_in(self, tried: Try) -> bool:
        """Whether the step passed a limit point whose load is not known to within ``steps.peak`` yet.

        Then the highest node is taken off the path, and shorter steps are to be made from the one before it. On the way
        back from a load of the other sense there is none to be found.
        """
        last, new, largest = tried.last, tried.new, self._largest()
        falls = self.toward * last.multiplier > 0.0 and (
            self.toward * (last.multiplier - new.multiplier) > LEVEL * largest
        )
        ignored = not self.loading or self.phase is Phase.FALLING
        if ignored or new.jump or last.broken is not None or not falls:
            return False
        # the first step of a path that goes on from another has no node before its own
        before = self.nodes[-2] if len(self.nodes) - self.begin > 1 else last
        width = max(abs(last.multiplier - before.multiplier), abs(last.multiplier - new.multiplier))
        if width <= self.steps.peak * abs(last.multiplier) or self.rounds >= ROUNDS:
            # a fall that is leapt over is looked for only where the path ends by it
            self.phase, self.rounds, self.passed = Phase.FALLING, 0, self.to is not None
            # the next step is as long as those before the search, and not as its last short ones
            tried.move = 0.5 * max(self.coarse, tried.move)
            return False
        span = tried.move if before is last else abs(last.control - before.control)
        if self.phase is Phase.RISING:
            self.coarse = span
        self.phase, self.rounds, self.short = Phase.CLOSING, self.rounds + 1, 0
        self.advance = CLOSER * span
        if before is not last:
            self.nodes.pop()
        return True

    def _appended(self, tried: Try) -> PathEnd | None:
        """Put the state found by a try on the path, with what breaks from it.

        It returns how the path ends where that does not go, else None.
        """
        made, last = self.generations, tried.last
        if tried.due is None:
            # a whole step, at whose end contacts are looked for; where that was done blocks may have met unseen
            new = made.looked_at(tried.new, last)
            met = made.through(new) if made.shapes is not None and new.looked is new.pose else ""
            if met:
                return self._stopped(
                    last,
                    f"at {new.control:.4g} m blocks would go through each other where they have no contact "
                    f"point: {met}",
                )
            self.nodes.append(new._replace(handed=made.handed(self.nodes[-1], last, new, self.toward)))
        else:
            # two samples at one displacement, before and after points break at once
            weak = tried.new._replace(looked=last.looked)
            self.nodes.append(weak)
            broken = breaking.released(tried.system, weak, tried.due, self.ratio, weak.control)
            if broken is None:
                return self._stopped(
                    weak,
                    "joints break and no equilibrium is found after it: a block that they held falls, or the "
                    "state lies too far",
                )
            new = made.looked_at(broken._replace(generation=weak.generation, looked=last.looked), weak)
            self.nodes.append(new)
            self.rounds = 0
            if self.phase is Phase.CLOSING:
                self.phase = Phase.RISING
            count = 0 if new.broken is None else len(new.broken)
            points = "1 point" if count == 1 else f"{count} points"
            self.say(f"u {new.control:.4g} m, {points} break: lambda {weak.multiplier:.5f} to {new.multiplier:.5f}")
        if new.onward is not None:
            self.say(f"contacts found anew at {new.control:.4g} m")
        line = f"u {new.control:.4g} m, lambda {new.multiplier:.5f}"
        self.say(line)
        began = self.origin.control
        reached(None if self.to is None else (new.control - began) / (self.to - began), line)
        return None

    def _ended(self, system: System, new: Node) -> PathEnd | None:
        """How the path ends with its last state, or None where it goes on.

        Parameters
        ----------
        system : equations with the contacts of the last step
        new : last state of the path
        """
        made = self.nodes[self.begin :]
        loads, way = self.toward * np.array([n.multiplier for n in made]), np.array([n.control for n in made])
        softens, first = system.law.softening is not None, self.generations.systems[0]
        # largest load, and whether the load fell by a jump as contacts were found anew
        pushed, renewed = float(loads.max()), new.jump and self.nodes[-2].onward is not None
        if renewed and pushed > 0.0:
            self.taken_off = max(self.taken_off, new.handed / pushed)
        lacks = step_equilibrium.handed_over(self.toward, made)
        fell = pushed > 0.0 and (self.phase is Phase.FALLING or softens or (new.jump and not renewed))
        # where joints lose strength others may take over: only a deep fall ends the path
        if self.to is None and softens and fell and loads[-1] + lacks[-1] < (1.0 - DROP_OF_SOFTENING) * pushed:
            return PathEnd.PASSED
        found = passed(loads, way, lacks, first.size) if self.to is None and not softens else None
        if found is not None and loads[found:].min() < (1.0 - LEVEL) * pushed:
            # what falls a little is followed over a part of a block
            found = passed(loads, way, lacks, first.size, np.inf)
        if found is not None:
            return PathEnd.PASSED if loads[-1] < (1.0 - LEVEL) * pushed else PathEnd.PLATEAU
        # blocks that come down on each other through gaps may ask for a push the other way before they carry
        far = abs(new.control - self.origin.control) > _OVER * system.size
        return PathEnd.OVERTURNED if self.loading and fell and loads[-1] <= 0.0 and far else None

    def _pace(self, tried: Try, new: Node) -> None:
        """How long the next step is, by what this one took and by how well it was extrapolated.

        It writes ``advance``, and with it ``bound``, ``short``, ``steady``, ``passed`` and ``ahead``.

        Parameters
        ----------
        tried : try of the step that was accepted
        new : state at its end
        """
        largest = self._largest()
        if new.jump or (self.toward * new.multiplier < (1.0 - MISSED) * largest and not self.rounds):
            self.bound = np.inf  # what could be passed over is behind
        elif self.phase is not Phase.CLOSING:
            self.bound *= 2.0  # where nothing was passed over
        if self.phase is Phase.CLOSING and self.short < _TRIES:
            self.short += 1
            factor = 1.0
        else:
            off = None if tried.guess is None else abs(new.multiplier - tried.guess[1]) / max(largest, 1e-300)
            factor = growth(new, off, self.steps.smooth, second=len(self.nodes) - self.begin <= 2)
        # the step just past a limit point is no longer than the one before
        self.advance = (min(factor, 1.0) if self.passed or self.steady else factor) * tried.move
        self.steady = max(self.steady - 1, 0)
        self.passed = False
        # displacement that is left to what was found beyond a bend
        left = 0.0 if self.ahead is None else self.sense * (self.ahead.control - new.control)
        if left > self.shortest and self.phase is not Phase.CLOSING:
            self.advance = left
        else:
            self.ahead = None
