"""What a step of a path must not do: leap, skip a fall, go too far, run off its branch, bend, make energy, keep bonds.

A judge accepts a try of a step or has it tried again, shorter; some end the path.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.limit_point import DROP, LEVEL
from limitmason.capacity.outcomes import PathEnd, Phase, StepOutcome, Try
from limitmason.capacity.step_equilibrium import Node, handed_over
from limitmason.capacity.step_length import Steps, bend, may_have_fallen, senses, until_open, until_stuck

FARTHEST = 0.5
"""Control displacement up to which a limit point is looked for, over the median block size [-]."""

_SHORTEST = 1e-4
"""Least step, in elastic lengths [-]: chosen."""

_HALVINGS = 6
"""Times that a step is halved at most for energy, bonds, a hidden fall or its pace: chosen."""

CLOSER = 0.25
"""Length of a step towards a limit point over that of the step before [-]: chosen."""

ROUNDS = 8
"""Rounds at most in which a limit point, or the end of a path, is closed in on: chosen."""

_CUTS = 4
"""Times that a step is cut at most for its bend: chosen."""

_AT_BEND, _AT_END = (0.1, 0.9), (0.02, 0.98)
"""Least and most that is left of a step that is cut for its bend, and for the end of the path [-]: chosen."""

_STEADY = 4
"""Steps that do not grow after one in which a point ran off its face: chosen."""

_OUTRUN = 3.0
"""Motion of the blocks in a step, over that by a tangent, from which it may be a leap [-]: chosen."""

_MOVED = 1e-7
"""Motion of the blocks, of the median block size, below which no step is a leap [-]: chosen."""

_ASIDE = 0.3
"""Distance of a step's end from where it was going, of its motion, that may hide a fall [-]: chosen."""

_DEPARTS = 0.1
"""Departure of the multiplier from its extrapolation that may hide a fall, of ``Steps.smooth`` [-]: chosen."""

MISSED = 2e-3
"""Fall behind which nothing is looked for, and rise that may hide one, of the largest load [-]: as ``DROP``."""

_UNSEEN = 1e-3
"""Rise to a jump that may be left unseen, of the largest load [-]: chosen."""

DROP_OF_SOFTENING = 0.2
"""Fall that ends a path whose joints lose strength, of the largest load [-]: others may take over, chosen."""


@dataclass
class JudgedPath:
    """A path on its way, see :func:`limitmason.capacity.path.follow`, and what its steps must not do.

    A judge takes a try of a step and says ACCEPTED where it has nothing against it. Otherwise it sets
    ``advance``, the length of the next try, and says SHORTER, or says how the path ends. Some set more, for later
    steps: ``bound``, ``ahead``, ``steady``. Loads are multipliers [-], times ``toward`` where they count as positive
    in the sense of the push.
    """

    generations: Generations
    nodes: list[Node]  # of the path so far, those of the path that it goes on from first
    to: float | None  # control displacement at its end [m]; None for its first limit point
    ratio: float  # work of the live loads per control displacement, at first [N]
    steps: Steps
    say: Callable[[str], None]
    loading: bool  # whether loads are pushed up; False where a support moves
    warnings: list[str] = field(default_factory=list)
    phase: Phase = Phase.RISING
    bound: float = np.inf  # length that steps which were seen to leap over the largest load must not have again [m]
    again: bool = False  # whether this step is tried again, shorter
    failures: int = 0  # times that the end of this step was not found
    passed: bool = False  # whether this step passed a limit point
    halved: int = 0  # times that this step was halved, for energy or for bonds, say
    rounds: int = 0  # of closing in on a limit point
    short: int = 0  # steps of this round
    taken_off: float = 0.0  # largest fall where contacts were found anew, of the largest load
    steepest: float = 0.0  # rise of the load over displacement so far [1/m]
    cuts: int = 0  # of this step, for its bend or for the end of the path
    closer: int = 0  # tries to end a path of softening joints at the load to which it is followed
    steady: int = 0  # steps that grow no longer than one that was cut, for points that ran off
    ahead: Node | None = None  # the state found beyond a bend, where the step to it was cut
    near: Try | None = None  # the shortest step from a state that loses energy: a jump, should none go on without

    def __post_init__(self) -> None:
        """Where the path begins and ends, and its first step."""
        system = self.generations.systems[0]
        self.begin = len(self.nodes) - 1  # number of its first node
        self.origin = self.nodes[self.begin]
        # signs of the control displacement, and of the load that grows along it
        self.sense, self.toward = senses(self.origin.control, self.to, self.ratio)
        self.end = self.origin.control + self.sense * FARTHEST * system.size if self.to is None else self.to
        # lengths of steps [m]: the most, the least, the next one, and the last before a limit point was closed in on
        self.longest = self.steps.largest * system.size
        self.shortest = _SHORTEST * system.length
        self.advance = self.coarse = self.steps.first * system.length

    def _stopped(self, last: Node, why: str, end: PathEnd = PathEnd.STOPPED) -> PathEnd:
        """How the path ends, with a warning of where, at its ``last`` state, and why."""
        self.warnings.append(f"the path stops at {last.control:.4g} m, lambda {last.multiplier:.5g}: {why}")
        return end

    def judged(self, tried: Try) -> StepOutcome | PathEnd:
        """The first verdict on a try that does not accept it, ACCEPTED where there is none."""
        judges = self._leaps, self._skips_a_fall, self._goes_too_far, self._outruns, self._bends, self._hides_a_fall
        for judge in (*judges, self._makes_energy, self._keeps_bonds, self._passes_its_end):
            verdict = judge(tried)
            if verdict is not StepOutcome.ACCEPTED:
                return verdict
        return StepOutcome.ACCEPTED

    def _largest(self) -> float:
        """Size of the largest load so far [-]."""
        return max(abs(n.multiplier) for n in self.nodes[self.begin :])

    def _leaps(self, tried: Try) -> StepOutcome:
        """A step that leaps while the load still rises may have passed over the largest.

        Where joints soften every such leap may have. Where they are plastic only one may that ends lower than the
        largest load so far by ``DROP``, the fall that passes a limit point.
        """
        may_pass_largest = tried.system.law.softening is not None or (
            self.toward * tried.new.multiplier < (1.0 - DROP) * self._largest()
        )
        if not tried.new.jump or not may_pass_largest or not self._rises_unseen(tried):
            return StepOutcome.ACCEPTED
        # halved as often as it leaps; by ``bound`` no later step is longer until the largest load is behind
        self.advance = self.bound = 0.5 * tried.move
        return StepOutcome.SHORTER

    def _rises_unseen(self, tried: Try) -> bool:
        """Whether the load would rise within a step to more than ever, if it went on as it came."""
        if tried.guess is None or tried.move <= self.shortest:
            return False
        return self.toward * tried.guess[1] > (1.0 + _UNSEEN) * self._largest()

    def _skips_a_fall(self, tried: Try) -> StepOutcome:
        """Past a limit point: a load that fell and rises again may hide the path's end.

        It may have fallen far enough in between. Then the lowest node is taken off the path, and shorter steps are made
        from the one before, until the lowest load is known to ``steps.peak``. ACCEPTED where the load did not fall and
        rise, where the fall cannot end the path, and where it is known or given up.
        """
        if self.to is not None or self.phase is not Phase.FALLING or tried.new.jump or len(self.nodes) - self.begin < 2:
            return StepOutcome.ACCEPTED
        before, largest = self.nodes[-2], self._largest()
        fell = self.toward * (before.multiplier - tried.last.multiplier)
        rose = self.toward * (tried.new.multiplier - tried.last.multiplier)
        moved = abs(tried.last.control - before.control)
        if moved == 0.0:
            # two samples at one displacement, as where points break: no slope goes through them
            return StepOutcome.ACCEPTED
        # how far the load lies below the largest, over it: at each sample, at the lowest since, and as low as it may
        # come in this step, were it to go on falling by the slope of the last one
        below = 1.0 - self.toward * np.array([n.multiplier for n in self.nodes[self.begin :]]) / largest
        known = float(below[int(np.argmin(below)) :].max())
        on = fell * abs(tried.new.control - tried.last.control) / moved
        lowest = float(below[-1]) + on / largest
        # a first limit point is passed by a first fall, a path of joints that soften ends by a larger one
        may_end = known <= DROP < lowest or lowest > (DROP if tried.system.law.softening is None else DROP_OF_SOFTENING)
        if not may_end or min(fell, rose) <= LEVEL * largest or tried.last.jump or tried.last.broken is not None:
            return StepOutcome.ACCEPTED
        if max(fell, rose) <= self.steps.peak * largest or self.rounds >= ROUNDS:
            # the lowest load is known to ``steps.peak``, or the search for it is given up
            self.rounds, self.bound = 0, np.inf
            return StepOutcome.ACCEPTED
        self.rounds += 1
        self.advance = self.bound = CLOSER * moved
        self.nodes.pop()
        return StepOutcome.SHORTER

    def _hides_a_fall(self, tried: Try) -> StepOutcome:
        """A step that ends with more load may hide a limit point and a fall that its end has made up for.

        It is halved while it may: where a tangent falls, at either end or with the weaker law of every point in
        between, or where it lies far off its extrapolation and :func:`may_have_fallen`, or its blocks end beside where
        they were going. No load changes faster than it once rose: a step too short for a fall that counts hides none.
        """
        # nothing is looked for on the reaction of a support, nor past the first limit point of a path that goes on
        behind = self.phase is Phase.FALLING and self.to is not None
        if not self.loading or behind or tried.new.jump or tried.due is not None or tried.guess is None:
            return StepOutcome.ACCEPTED
        move, largest = tried.new.control - tried.last.control, max(self._largest(), abs(tried.new.multiplier))
        # rise of the load over the whole step [-]: in fact, and by the tangent at its start
        rose = self.toward * (tried.new.multiplier - self.nodes[-1].multiplier)
        by_start = self._begins_with(tried)
        self.steepest = max(self.steepest, by_start / abs(move))
        # a load that falls at its end hides nothing; to fall by DROP and come up again it has to be steep enough
        if rose < 0.0 or self.steepest * abs(move) - rose <= 2.0 * DROP * largest:
            return StepOutcome.ACCEPTED
        # the rise by the tangent at its end, and a fall of half of what counts
        by_end, falls = self.toward * self.generations.rise(tried.new, tried.last, move), -0.5 * DROP * largest
        off = abs(tried.new.multiplier - tried.guess[1]) > _DEPARTS * self.steps.smooth * largest
        hides = min(by_start, by_end) < falls or (
            off and by_start > MISSED * largest and may_have_fallen(by_start, rose + LEVEL * largest, by_end)
        )
        if off and not hides:
            # joints whose slip turns stick meanwhile: by their springs the load rises, and falls, and no tangent tells
            # motion [m] from where the step was going to its end, and from where it began
            aside, went = (tried.system.far(pose, tried.new.pose) for pose in (tried.guess[0], tried.last.pose))
            hides = aside > _ASIDE * went
        if not hides:
            weakest = self.generations.weakest_rise(self.nodes[self.begin :], tried.new, move)
            hides = weakest is not None and not self.toward * weakest >= falls
        return StepOutcome.SHORTER if hides and self._halve(tried) else StepOutcome.ACCEPTED

    def _begins_with(self, tried: Try) -> float:
        """What the slope at the start of a step comes to over all of it, in the sense of the push [-]."""
        move = tried.new.control - tried.last.control
        return self.toward * self.generations.rise(self.nodes[-1], self._before(), move)

    def _before(self) -> Node | None:
        """The node before the last; None at the beginning and after a jump."""
        return self.nodes[-2] if len(self.nodes) - self.begin > 1 and not self.nodes[-1].jump else None

    def _bends(self, tried: Try) -> StepOutcome:
        """A step whose curve lies off the straight line between its ends is cut where their tangents meet.

        It must lie off in load, by more than ``Steps.peak``, and in displacement, by more than ``Steps.straight``: a
        steep curve is off in load alone and a level one in displacement alone, though both look straight. The cut sets
        ``cuts``, and ``ahead``, the end that was found, which the step after it goes towards. Not judged are jumps,
        steps after one, breaks, closing in on a limit point, shortest steps, and those cut ``_CUTS`` times.

        Parameters
        ----------
        tried : try of the step, with the multiplier that was foretold for its end
        """
        sharp = tried.new.jump or tried.due is not None or tried.last.jump or self.phase is Phase.CLOSING
        if sharp or tried.guess is None or tried.move <= self.shortest or self.cuts >= _CUTS:
            return StepOutcome.ACCEPTED
        largest, move = max(self._largest(), abs(tried.new.multiplier), 1e-300), tried.new.control - tried.last.control
        if abs(tried.new.multiplier - tried.guess[1]) <= self.steps.peak * largest:
            # as straight as it was foretold
            return StepOutcome.ACCEPTED
        # rise of the load over the whole step [-]: in fact, by the tangent at its start, by the tangent at its end
        rose = self.toward * (tried.new.multiplier - tried.last.multiplier)
        by_start, by_end = self._begins_with(tried), self.toward * self.generations.rise(tried.new, tried.last, move)
        # the tangent at the start foretells little in the first step, whose joints are unloaded, and after contacts
        # were found anew (``onward``): then only a curve that flattens all along counts as bent
        untold = len(self.nodes) - self.begin < 2 or self.nodes[-1].onward is not None
        if untold and not by_start > rose > by_end:
            return StepOutcome.ACCEPTED
        if by_end < 0.0 < by_start:
            return StepOutcome.ACCEPTED  # a limit point, which is closed in on
        off, share = bend(by_start, rose, by_end)  # off the line in load [-], and where, as a share of the step [-]
        # off the line in displacement, by the mean slope of the step, over the displacement so far [-]
        aside = off * abs(move) / max(abs(rose) * abs(tried.new.control - self.origin.control), 1e-300)
        if off <= self.steps.peak * largest or not aside > self.steps.straight:
            return StepOutcome.ACCEPTED
        self.cuts, self.ahead = self.cuts + 1, tried.new
        self.advance = float(np.clip(share, *_AT_BEND)) * tried.move
        return StepOutcome.SHORTER

    def _goes_too_far(self, tried: Try) -> StepOutcome:
        """A step in which a point opens, lands, sticks or runs off its face too far is cut before that.

        After a cut for points that ran off, ``steady`` keeps the steps that follow from growing.
        """
        if tried.new.jump or tried.due is not None:
            return StepOutcome.ACCEPTED
        # share of the step in which each of these stays within bounds
        made, size = self.generations, tried.system.size
        off = made.until_off(tried.last, tried.new)
        share = min(
            until_open(tried.system, tried.last, tried.new, self.steps.opening * size), off,
            made.until_landed(tried.last, tried.new),
            until_stuck(made, self.nodes, tried.new, self.steps.sliding * size),
        )
        if share == 1.0 or tried.move <= self.shortest:
            return StepOutcome.ACCEPTED
        # a place where sides cross runs on as it ran: the next longer step would be cut again
        self.steady = _STEADY if off == share else self.steady
        self.advance = share * tried.move
        return StepOutcome.SHORTER

    def _outruns(self, tried: Try) -> StepOutcome:
        """A step in which blocks move much farther than at the pace of its start may end on another branch.

        It is halved while it may. Where the pace at its end does not explain the motion either, no path leads there: it
        is a jump. It is halved on where the largest load may lie within it, see :meth:`_rises_unseen`.
        """
        if tried.new.jump or tried.last.jump or tried.due is not None or tried.guess is None:
            return StepOutcome.ACCEPTED  # the tangent of joints that a jump has unloaded foretells little
        # motion [m] of the blocks in the step, and as it was extrapolated
        went, told = (tried.system.far(tried.last.pose, pose) for pose in (tried.new.pose, tried.guess[0]))
        if went <= max(_OUTRUN * told, _MOVED * tried.system.size):
            return StepOutcome.ACCEPTED
        # the same by the tangents at both ends
        first, last = self.generations.paces(self.nodes[-1], self._before(), tried.new)
        if went <= _OUTRUN * first:
            return StepOutcome.ACCEPTED
        if self._halve(tried):
            return StepOutcome.SHORTER
        if went <= _OUTRUN * last:
            return StepOutcome.ACCEPTED
        if self._rises_unseen(tried):
            self.advance = 0.5 * tried.move
            return StepOutcome.SHORTER
        self._jumped(tried)
        return StepOutcome.ACCEPTED

    def _halve(self, tried: Try) -> bool:
        """Whether the step is tried half as long once more; then ``advance`` is set and ``halved`` counts it."""
        if self.halved >= _HALVINGS or tried.move <= self.shortest:
            return False
        self.halved += 1
        self.advance = 0.5 * tried.move
        return True

    def _makes_energy(self, tried: Try) -> StepOutcome | PathEnd:
        """A step that loses energy is a jump, and one that makes some is refused.

        Either is halved first, as energy may be left over by the length of the step alone.
        """
        # over its gross work [-], negative where some is made; a jump loses energy by its nature, and is not judged
        lost = 0.0 if tried.new.jump else self.generations.energy(tried.last, tried.new)
        if abs(lost) <= self.steps.energy:
            return StepOutcome.ACCEPTED
        if lost > 0.0:
            self.near = tried  # should no shorter step be found, :mod:`.path` takes this one, as a jump
        if self._halve(tried):
            return StepOutcome.SHORTER
        if lost < 0.0:
            return self._stopped(tried.last, f"the next step would make {-lost:.1%} of its work out of nothing")
        self._jumped(tried)
        return StepOutcome.ACCEPTED

    def _jumped(self, tried: Try) -> Try:
        """A step to a state near by that no path leads to, marked as a jump in place."""
        last, new = tried.last, tried.new
        self.say(f"jump at {new.control:.4g} m: lambda {last.multiplier:.5f} to {new.multiplier:.5f}")
        tried.new = tried.new._replace(jump=True)
        return tried

    def _keeps_bonds(self, tried: Try) -> StepOutcome | PathEnd:
        """Open joints that still bear their bond end a path: the law does not say when such a bond is gone."""
        bonded = self.generations.bonded(tried.new)
        if not bonded:
            return StepOutcome.ACCEPTED
        return StepOutcome.SHORTER if self._halve(tried) else self._stopped(tried.last, bonded, PathEnd.OPENED)

    def _passes_its_end(self, tried: Try) -> StepOutcome:
        """A step over the load at which a path of softening joints ends is cut there, to the width of a limit point.

        Where the load falls at one displacement, or leaps, the crossing is that fall.
        """
        if self.to is not None or tried.system.law.softening is None or tried.new.jump or tried.due is not None:
            return StepOutcome.ACCEPTED
        new = tried.new._replace(handed=self.generations.handed(self.nodes[-1], tried.last, tried.new, self.toward))
        made = [*self.nodes[self.begin :], new]
        pushing = self.toward * np.array([n.multiplier for n in made])
        pushed = float(pushing.max())
        # what contacts found anew took off is no fall of the structure's own load
        own = pushing + handed_over(self.toward, made)
        before, after = own[-2:] - (1.0 - DROP_OF_SOFTENING) * pushed
        width = self.steps.peak * pushed
        if not before > 0.0 > after + width or tried.move <= self.shortest or self.closer >= ROUNDS:
            return StepOutcome.ACCEPTED
        # half of the width beyond, so that the sample is the last; from one that is short of it the path goes on
        share = (before + 0.5 * width) / (before - after)
        self.closer, self.ahead, self.cuts = self.closer + 1, tried.new, 1
        self.advance = float(np.clip(share, *_AT_END)) * tried.move
        return StepOutcome.SHORTER
