"""The path: how long steps are, when they are halved, how a limit point is closed in on, and when to stop.

A try of a step is accepted, tried again shorter, or ends the path. Up to its limit point a path rises; it then closes
in on it with short steps from the sample before the highest, and falls.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from limitmason.capacity import breaking, stepping
from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.limit_point import DROP, LEVEL, passed
from limitmason.capacity.outcomes import PathEnd, Phase, StepOutcome, Try
from limitmason.capacity.stepping import Node
from limitmason.capacity.steps import (
    Steps,
    bend,
    extrapolated,
    growth,
    may_have_fallen,
    senses,
    until_open,
    until_stuck,
)
from limitmason.capacity.system import System
from limitmason.display.progress import reached

FARTHEST = 0.5
"""Control displacement up to which a limit point is looked for, over the median block size [-]."""

_SHORTEST = 1e-4  # elastic lengths
_TRIES = 12  # short steps towards a limit point that then does not come
_BEYOND = (1e-3, 3e-3, 1e-2)  # of the median block size: jumps that are tried where no short step goes on
_HALVINGS = 6  # of a step that loses or makes energy
_OVER = 0.01  # least displacement of what overturns, of the median block size
_CLOSER, _ROUNDS = 0.25, 8  # of the step before a limit point; rounds in which it is closed in on
_DROP_OF_SOFTENING = 0.2  # the same where joints lose strength and others may take over
_CUTS = 4  # of a step for its bend
_OUTRUN, _MOVED = 3.0, 1e-7  # motion over a tangent's, and over the median block size, that may be a leap
_MISSED = 2e-3  # of the largest load: rise to a jump that may be left unseen


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
    path = _Path(generations, nodes, to, ratio, steps, say, loading)
    end = path.followed()
    if path.taken_off > DROP:
        path.warnings.append(
            f"where contacts were found anew the load fell by up to {path.taken_off:.1%} of its largest, which is no "
            "limit point of the structure: with other steps the path may come to another one"
        )
    return end, path.warnings


@dataclass
class _Path:
    """A path on its way, see :func:`follow`."""

    generations: Generations
    nodes: list[Node]
    to: float | None
    ratio: float
    steps: Steps
    say: Callable[[str], None]
    loading: bool
    warnings: list[str] = field(default_factory=list)
    phase: Phase = Phase.RISING
    bound: float = np.inf  # steps that were seen to leap over the largest load
    again: bool = False  # whether this step is tried again, shorter
    failures: int = 0  # of this step to be found
    passed: bool = False  # a limit point, by this step
    halved: int = 0  # this step, for energy or for bonds
    rounds: int = 0  # of closing in on a limit point
    short: int = 0  # steps of this round
    taken_off: float = 0.0  # largest fall where contacts were found anew, of the largest load
    steepest: float = 0.0  # rise of the load over displacement so far [1/m]
    cuts: int = 0  # of this step, for its bend
    ahead: Node | None = None  # what was found beyond the bend
    near: Try | None = None  # the shortest step from a state that loses energy: a jump, should none go on without

    def __post_init__(self) -> None:
        """Where the path begins and ends, and its first step."""
        system = self.generations.systems[0]
        self.begin = len(self.nodes) - 1
        self.origin = self.nodes[self.begin]
        self.sense, self.toward = senses(self.origin.control, self.to, self.ratio)
        self.end = self.origin.control + self.sense * FARTHEST * system.size if self.to is None else self.to
        self.longest = self.steps.largest * system.size
        self.shortest = _SHORTEST * system.length
        self.advance = self.coarse = self.steps.first * system.length

    def followed(self) -> PathEnd:
        """Follow the path from its first states to its end, and say how it ended."""
        for _ in range(self.steps.most):
            verdict = self._step()
            if isinstance(verdict, PathEnd):
                return verdict
            self.again = verdict is StepOutcome.SHORTER
        self.warnings.append(
            f"{self.steps.most} tries of a step were made and {self.end:.4g} m was not reached: raise steps.most"
        )
        return PathEnd.STOPPED

    def _step(self) -> StepOutcome | PathEnd:
        """Try one step: find its end, judge it, append it, and choose the next length.

        It returns how the path ends, or whether the step was taken or is to be tried again shorter.
        """
        last = self.generations.begun(self.nodes[-1])
        system = self.generations.systems[last.generation]
        left = self.sense * (self.end - last.control)
        if left <= 1e-9 * abs(self.end) or left <= 1e-6 * system.length:
            return PathEnd.REACHED
        found = self._found(system, last, left)
        if not isinstance(found, Try):
            return found
        self.failures = 0
        judges = self._leaps, self._skips_a_fall, self._goes_too_far, self._outruns, self._bends, self._hides_a_fall
        for judge in (*judges, self._makes_energy, self._keeps_bonds):
            verdict = judge(found)
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

    def _stopped(self, last: Node, why: str, end: PathEnd = PathEnd.STOPPED) -> PathEnd:
        self.warnings.append(f"the path stops at {last.control:.4g} m, lambda {last.multiplier:.5g}: {why}")
        return end

    def _found(self, system: System, last: Node, left: float) -> Try | StepOutcome | PathEnd:
        """Find the end of a step, by ever more costly ways the more often it failed.

        Newton's method comes first, then a jump in viscous sub-steps, then a search for where a block comes to rest.

        Parameters
        ----------
        last : state that the step begins from, its contacts found anew
        left : control displacement to the end of the path [m]
        """
        self.advance = min(self.advance, self.longest, self.bound)
        # what is left is not split into a step and a splinter; a step that was cut is not stretched to the end again
        move = left if left < (1.0 if self.again else 1.2) * self.advance else self.advance
        guess = extrapolated(system, [*self.nodes[self.begin : -1], last], self.sense * move)
        patient = self.failures >= stepping.patience(system, move)
        target = last.control + self.sense * move
        on = self.ahead if self.cuts == 0 else None
        begin = guess if on is None else breaking.between(last, on, target)
        new = stepping.step(system, last, target, begin, self.ratio, patient=patient)
        if new is None and patient:
            new = stepping.jump(system, last, target, self.ratio)
            if new is not None:
                self.say(f"jump at {new.control:.4g} m: lambda {last.multiplier:.5f} to {new.multiplier:.5f}")
        if new is None and 0.5 * move < self.shortest:
            if self.near is not None and self.near.last.control == last.control:
                return self._jumped(self.near)
            if self.generations.shapes is not None:
                new, move = self._beyond(system, last, left)
        due = None
        if new is not None and breaking.brittle(system):
            new, due = breaking.cut(system, last, new, self.ratio)
        if new is not None:
            return Try(system, last, move, guess, new._replace(generation=last.generation), due)
        self.failures += 1
        self.advance = 0.5 * move
        return (
            self._stopped(last, "no step goes on from there") if self.advance < self.shortest else StepOutcome.SHORTER
        )

    def _beyond(self, system: System, last: Node, left: float) -> tuple[Node | None, float]:
        """Where a block that has lost a support comes to rest: there may be nothing near. Also how far that is [m]."""
        for share in _BEYOND:
            move = min(left, share * system.size)
            new = stepping.jump(system, last, last.control + self.sense * move, self.ratio)
            if new is not None:
                self.say(f"jump to {new.control:.4g} m: lambda {last.multiplier:.5f} to {new.multiplier:.5f}")
                self.warnings.append(
                    f"no state was found between {last.control:.4g} m, lambda {last.multiplier:.5g}, and "
                    f"{new.control:.4g} m: the path leaps, and finer steps may find larger loads there"
                )
                return new, move
        return None, 0.0

    # ---- what a step must not do ----------------------------------------------------------------------------------

    def _largest(self) -> float:
        return max(abs(n.multiplier) for n in self.nodes[self.begin :])

    def _leaps(self, a: Try) -> StepOutcome:
        """A step that leaps while the load still rises to more than ever may have passed over the largest load."""
        if not a.new.jump or a.guess is None or a.system.law.softening is None or a.move <= self.shortest:
            return StepOutcome.ACCEPTED
        if self.toward * a.guess[1] <= (1.0 + _MISSED) * self._largest():
            return StepOutcome.ACCEPTED
        self.advance = self.bound = 0.5 * a.move
        return StepOutcome.SHORTER

    def _skips_a_fall(self, a: Try) -> StepOutcome:
        """Past a limit point: where a load that fell rises again, the fall between that may end the path is looked for.

        From the node before the lowest, which is taken back, in shorter steps, until its load is known to the width of
        a limit point. ACCEPTED where the step is none of these, where the fall cannot end the path, and where it is
        known or given up.
        """
        if self.to is not None or self.phase is not Phase.FALLING or a.new.jump or len(self.nodes) - self.begin < 2:
            return StepOutcome.ACCEPTED
        before, largest = self.nodes[-2], self._largest()
        fell = self.toward * (before.multiplier - a.last.multiplier)
        rose = self.toward * (a.new.multiplier - a.last.multiplier)
        # as low as it comes if it goes on to fall as it fell
        moved = abs(a.last.control - before.control)
        if moved == 0.0:
            return StepOutcome.ACCEPTED
        on = fell * abs(a.new.control - a.last.control) / moved
        below = 1.0 - self.toward * np.array([n.multiplier for n in self.nodes[self.begin :]]) / largest
        known, lowest = float(below[int(np.argmin(below)) :].max()), float(below[-1]) + on / largest
        # a first limit point is passed by a first fall, a path of joints that soften ends by a larger one
        may_end = known <= DROP < lowest or lowest > (DROP if a.system.law.softening is None else _DROP_OF_SOFTENING)
        if not may_end or min(fell, rose) <= LEVEL * largest or a.last.jump or a.last.broken is not None:
            return StepOutcome.ACCEPTED
        if max(fell, rose) <= self.steps.peak * largest or self.rounds >= _ROUNDS:
            self.rounds, self.bound = 0, np.inf
            return StepOutcome.ACCEPTED
        self.rounds += 1
        self.advance = self.bound = _CLOSER * moved
        self.nodes.pop()
        return StepOutcome.SHORTER

    def _hides_a_fall(self, a: Try) -> StepOutcome:
        """A step that ends with more load may hide a limit point and a fall that its end has made up for.

        It is halved while it may: where a tangent falls, at either end or with the weaker law of every point in
        between, or where it lies far off its extrapolation and :func:`may_have_fallen`. No load changes faster than it
        once rose: a step too short for a fall that counts hides none.
        """
        behind = self.phase is Phase.FALLING and self.to is not None
        if not self.loading or behind or a.new.jump or a.due is not None or a.guess is None:
            return StepOutcome.ACCEPTED
        move, largest = a.new.control - a.last.control, max(self._largest(), abs(a.new.multiplier))
        rose = self.toward * (a.new.multiplier - self.nodes[-1].multiplier)
        first = self._begins_with(a)
        self.steepest = max(self.steepest, first / abs(move))
        if rose < 0.0 or self.steepest * abs(move) - rose <= 2.0 * DROP * largest:
            return StepOutcome.ACCEPTED
        last, falls = self.toward * self.generations.rise(a.new, a.last, move), -0.5 * DROP * largest
        off = abs(a.new.multiplier - a.guess[1]) > 0.1 * self.steps.smooth * largest and first > _MISSED * largest
        hides = min(first, last) < falls or (off and may_have_fallen(first, rose + LEVEL * largest, last))
        if not hides:
            weakest = self.generations.weakest_rise(self.nodes[self.begin :], a.new, move)
            hides = weakest is not None and not self.toward * weakest >= falls
        return StepOutcome.SHORTER if hides and self._halve(a) else StepOutcome.ACCEPTED

    def _begins_with(self, a: Try) -> float:
        """What the slope at the start of a step comes to over all of it, in the sense of the push [-]."""
        return self.toward * self.generations.rise(self.nodes[-1], self._before(), a.new.control - a.last.control)

    def _before(self) -> Node | None:
        """The node from which the last was reached by a path."""
        return self.nodes[-2] if len(self.nodes) - self.begin > 1 and not self.nodes[-1].jump else None

    def _bends(self, a: Try) -> StepOutcome:
        """A step whose curve lies off the straight line between its ends is cut where their tangents meet."""
        sharp = a.new.jump or a.due is not None or a.last.jump or self.phase is Phase.CLOSING
        if sharp or a.guess is None or a.move <= self.shortest or self.cuts >= _CUTS:
            return StepOutcome.ACCEPTED
        largest, move = max(self._largest(), abs(a.new.multiplier), 1e-300), a.new.control - a.last.control
        if abs(a.new.multiplier - a.guess[1]) <= self.steps.peak * largest:
            return StepOutcome.ACCEPTED
        rose = self.toward * (a.new.multiplier - a.last.multiplier)
        first, last = self._begins_with(a), self.toward * self.generations.rise(a.new, a.last, move)
        # the tangent of joints that are unloaded, or found anew, foretells little
        if (len(self.nodes) - self.begin < 2 or self.nodes[-1].onward is not None) and not first > rose > last:
            return StepOutcome.ACCEPTED
        if last < 0.0 < first:
            return StepOutcome.ACCEPTED  # a limit point, which is closed in on
        off, share = bend(first, rose, last)
        aside = off * abs(move) / max(abs(rose) * abs(a.new.control - self.origin.control), 1e-300)
        if off <= self.steps.peak * largest or not aside > self.steps.straight:
            return StepOutcome.ACCEPTED
        self.cuts, self.ahead = self.cuts + 1, a.new
        self.advance = float(np.clip(share, 0.1, 0.9)) * a.move
        return StepOutcome.SHORTER

    def _goes_too_far(self, a: Try) -> StepOutcome:
        """A step in which points open, land, stick or run off by more than is found at its end."""
        if a.new.jump or a.due is not None:
            return StepOutcome.ACCEPTED
        made, size = self.generations, a.system.size
        share = min(
            until_open(a.system, a.last, a.new, self.steps.opening * size), made.until_off(a.last, a.new),
            made.until_landed(a.last, a.new), until_stuck(made, self.nodes, a.new, self.steps.sliding * size),
        )
        if share == 1.0 or a.move <= self.shortest:
            return StepOutcome.ACCEPTED
        self.advance = share * a.move
        return StepOutcome.SHORTER

    def _outruns(self, a: Try) -> StepOutcome:
        """A step in which blocks move much farther than at the pace of its start may end on another branch.

        It is halved while it may. Where the pace at its end is no faster either, no path leads there: it is a jump.
        """
        if a.new.jump or a.last.jump or a.due is not None or a.guess is None:
            return StepOutcome.ACCEPTED  # the tangent of joints that a jump has unloaded foretells little
        went, told = (a.system.far(a.last.pose, pose) for pose in (a.new.pose, a.guess[0]))
        if went <= max(_OUTRUN * told, _MOVED * a.system.size):
            return StepOutcome.ACCEPTED
        first, last = self.generations.paces(self.nodes[-1], self._before(), a.new)
        if went <= _OUTRUN * first:
            return StepOutcome.ACCEPTED
        if self._halve(a):
            return StepOutcome.SHORTER
        if went > _OUTRUN * last:
            self._jumped(a)
        return StepOutcome.ACCEPTED

    def _halve(self, a: Try) -> bool:
        """Whether the step is tried half as long once more."""
        if self.halved >= _HALVINGS or a.move <= self.shortest:
            return False
        self.halved += 1
        self.advance = 0.5 * a.move
        return True

    def _makes_energy(self, a: Try) -> StepOutcome | PathEnd:
        """A step that loses energy is a jump; one that makes some is none."""
        over = 0.0 if a.new.jump else self.generations.energy(a.last, a.new)
        if abs(over) <= self.steps.energy:
            return StepOutcome.ACCEPTED
        self.near = a if over > 0.0 else self.near
        if self._halve(a):
            return StepOutcome.SHORTER
        if over < 0.0:
            return self._stopped(a.last, f"the next step would make {-over:.1%} of its work out of nothing")
        self._jumped(a)
        return StepOutcome.ACCEPTED

    def _jumped(self, a: Try) -> Try:
        """A step to a state near by that loses energy, as the jump that it is."""
        self.say(f"jump at {a.new.control:.4g} m: lambda {a.last.multiplier:.5f} to {a.new.multiplier:.5f}")
        a.new = a.new._replace(jump=True)
        return a

    def _keeps_bonds(self, a: Try) -> StepOutcome | PathEnd:
        """Open joints that still bear their bond end a path."""
        bonded = self.generations.bonded(a.new)
        if not bonded:
            return StepOutcome.ACCEPTED
        return StepOutcome.SHORTER if self._halve(a) else self._stopped(a.last, bonded, PathEnd.OPENED)

    # ---- limit points, and the end --------------------------------------------------------------------------------

    def _closes_in(self, a: Try) -> bool:
        """Whether a limit point lies behind that is not known to a width: from the node before the highest, shorter.

        On the way back from a load of the other sense there is none to be found.
        """
        last, new, largest = a.last, a.new, self._largest()
        falls = self.toward * last.multiplier > 0.0 and (
            self.toward * (last.multiplier - new.multiplier) > LEVEL * largest
        )
        known = not self.loading or self.phase is Phase.FALLING or len(self.nodes) - self.begin < 2
        if known or new.jump or last.broken is not None or not falls:
            return False
        before = self.nodes[-2]
        width = max(abs(last.multiplier - before.multiplier), abs(last.multiplier - new.multiplier))
        if width <= self.steps.peak * abs(last.multiplier) or self.rounds >= _ROUNDS:
            # a fall that is leapt over is looked for only where the path ends by it
            self.phase, self.rounds, self.passed = Phase.FALLING, 0, self.to is not None
            # the next step is as long as those before the search, and not as its last short ones
            a.move = 0.5 * max(self.coarse, a.move)
            return False
        span = abs(last.control - before.control)
        if self.phase is Phase.RISING:
            self.coarse = span
        self.phase, self.rounds, self.short = Phase.CLOSING, self.rounds + 1, 0
        self.advance = _CLOSER * span
        self.nodes.pop()
        return True

    def _appended(self, a: Try) -> PathEnd | None:
        """Put the state on the path, with what breaks from it; a status where that does not go."""
        made, last = self.generations, a.last
        if a.due is None:
            new = made.looked_at(a.new, last)
            met = made.through(new) if made.shapes is not None and new.looked is new.pose else ""
            if met:
                return self._stopped(
                    last,
                    f"at {new.control:.4g} m blocks would go through each other where they have no contact "
                    f"point: {met}",
                )
            self.nodes.append(new._replace(handed=made.handed(self.nodes[-1], last, new, self.toward)))
        else:
            weak = a.new._replace(looked=last.looked)
            self.nodes.append(weak)
            broken = breaking.released(a.system, weak, a.due, self.ratio, weak.control)
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
        """How the path ends with its last state; None where it goes on."""
        made = self.nodes[self.begin :]
        loads, way = self.toward * np.array([n.multiplier for n in made]), np.array([n.control for n in made])
        softens, first = system.law.softening is not None, self.generations.systems[0]
        pushed, renewed = float(loads.max()), new.jump and self.nodes[-2].onward is not None
        if renewed and pushed > 0.0:
            self.taken_off = max(self.taken_off, new.handed / pushed)
        lacks = stepping.handed_over(self.toward, made)
        fell = pushed > 0.0 and (self.phase is Phase.FALLING or softens or (new.jump and not renewed))
        # where joints lose strength others may take over: only a deep fall ends the path
        if self.to is None and softens and fell and loads[-1] + lacks[-1] < (1.0 - _DROP_OF_SOFTENING) * pushed:
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

    def _pace(self, a: Try, new: Node) -> None:
        """How long the next step is, by what this one took and by how well it was extrapolated."""
        largest = self._largest()
        if new.jump or (self.toward * new.multiplier < (1.0 - _MISSED) * largest and not self.rounds):
            self.bound = np.inf  # what could be passed over is behind
        elif self.phase is not Phase.CLOSING:
            self.bound *= 2.0  # where nothing was passed over
        if self.phase is Phase.CLOSING and self.short < _TRIES:
            self.short += 1
            factor = 1.0
        else:
            off = None if a.guess is None else abs(new.multiplier - a.guess[1]) / max(largest, 1e-300)
            factor = growth(new, off, self.steps.smooth, len(self.nodes) - self.begin <= 2)
        # what is beyond a limit point is not foretold by the way to it
        self.advance = (min(factor, 1.0) if self.passed else factor) * a.move
        self.passed = False
        left = 0.0 if self.ahead is None else self.sense * (self.ahead.control - new.control)
        if left > self.shortest and self.phase is not Phase.CLOSING:
            self.advance = left  # to what was found there
        else:
            self.ahead = None
