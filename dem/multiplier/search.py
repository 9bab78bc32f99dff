"""Search for the collapse multiplier: loads held one after the other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dem.default_damping import SETTLING
from dem.model.rest_or_collapse import EQUILIBRIUM, MOVING, UNDECIDED, LoadOnset, LoadVerdict, hold
from dem.model.state import State
from dem.model.unbalance import EVENLY, SLID, Scale, slid_and_moved
from limitmason.answers.results import Mechanism, Status
from limitmason.arrays import Array
from limitmason.display.progress import reached, watched
from limitmason.mechanics.resultants import scaled_mechanism
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Damping
from limitmason.storage.interrupts import ends_early

APPROACH = (0.5, 0.9, 1.0)
"""Parts of a multiplier that is known about at which loads are held on the way to it [-]; chosen."""

RATE = 1000
"""Steps over which as much live load comes on as there is dead load: what acts at once overshoots, and slips."""

AT_REST = 1e-6
"""Largest unbalance of a block under the dead load over its own load, as far as no smaller one is asked for [-]."""

SINKING = 2.5
"""Displacement under the dead load that counts as collapse, over that of an increment [-]: soft joints sink by all."""

# chosen, not derived
_BALANCED = 0.05  # unbalance that is left, over an increment that is as large as the dead load [-]
_FARTHER = 20.0  # times the farthest that a load moved a block before it rested: who speeds up there is moving [-]
_EARLIEST, _EARLY = 0.02, 0.2  # least and most of that displacement, over what counts as collapse [-]

_ALIKE = 1e-9  # rounding of a bracket as wide as asked for [-]
_LARGE = 1e3  # multiplier, over that at which live equals dead load, beyond which no load of this kind fells it [-]
_SMALL = 1e-3  # the same: a bracket is no narrower than that of so small a multiplier, which may be 0 [-]
_LONG = 4.0  # brackets: a stride longer than so many shakes blocks
_REACH = 0.9  # part of the largest load held up to which a state is kept, to come near again from there [-]


@dataclass(frozen=True)
class Controls:
    """Numerical settings of a search; for those without comment see ``DemSettings``."""

    tolerance: float
    max_steps: int
    moved_limit: float  # of the smallest block dimension [-]
    equilibrium: float  # largest tolerance of unbalanced forces over every block's own load [-]
    damping: Damping
    unit: float  # multiplier at which the live load equals the dead load
    first: float  # first increment of the multiplier
    progress: Callable[[float, LoadVerdict], object] | None = None
    edges: bool = True  # whether points of joints that slide follow the edges of their faces


@dataclass
class Search:
    """Outcome of a search: bracket, where it ended, and every load that was tried.

    Parameters
    ----------
    stable, moving : largest load in equilibrium, smallest one at which the blocks kept moving, as multipliers [-]; NaN
        and 0 where they do not rest under the dead load, infinite where none kept them moving
    status : of the bracket, "almost solved" where loads that stayed undecided leave it wider than was asked for
    state : at ``stable``; where the dead load did not come to rest the one that moves
    mechanism : velocities of the last load that kept the blocks moving; None where none did along the live load
    record : multiplier of every load tried and its verdict, in the order they were tried
    steps : of all loads
    details : {"interrupted": multiplier} where the keyboard ended it
    near : multiplier of about nine tenths of ``stable`` or less, and the state held there, to come near again from
    """

    stable: float
    moving: float
    status: Status
    state: State
    mechanism: Mechanism | None
    record: list[tuple[float, LoadVerdict]]
    steps: int
    details: dict[str, Any] = field(default_factory=dict)
    near: tuple[float, State] | None = None


def settle(assembly: Assembly, loads: Loads, state: State, scale: Scale, c: Controls) -> tuple[State, LoadVerdict]:
    """State at rest under the dead load, and how it came there.

    A load that acts at once overshoots. Where joints slide by that it comes on once more, evenly: what a jammed wedge
    holds hangs on how deep its weight has driven it.

    Parameters
    ----------
    loads : of which the dead ones act
    state : unloaded; changed
    scale : what unbalance and displacement are small against
    c : controls of the search
    """
    def held(state: State, evenly: int) -> LoadVerdict:
        """Verdict on the dead load, held after it came on over ``evenly`` steps."""
        return hold(
            assembly, state, loads.rows("dead"), scale, SETTLING, tolerance=min(AT_REST, c.equilibrium),
            limit=SINKING * c.moved_limit * scale.smallest, max_steps=c.max_steps, edges=c.edges,
            onset=LoadOnset(np.zeros_like(loads.rows("dead")), evenly),
        )

    unloaded, first = state.copy(), held(state, evenly=0)
    slid, moved = slid_and_moved(assembly, state)
    # what fell may have fallen by the overshoot alone; what is undecided has had all its steps
    if first.outcome == UNDECIDED or (first.outcome == EQUILIBRIUM and slid <= SLID * moved):
        return state, first
    again = held(unloaded, evenly=max(EVENLY, first.steps))
    return unloaded, replace(again, steps=first.steps + again.steps)  # no longer unloaded


@watched("search")
def increments(
    assembly: Assembly,
    loads: Loads,
    state: State,
    c: Controls,
    *,
    through: Sequence[float] = (),
    settled: float | None = None,
    patience: int = 0,
    loading: Callable[[float], Array] | None = None,
    up_to: float = np.inf,
) -> Search:
    """Bracket of the multiplier by loads held one after the other.

    Parameters
    ----------
    assembly, loads : the problem
    state : at rest without load, or in equilibrium under ``settled``
    c : controls of the search
    through : loads to be held first, rising; above the last one strides begin at the bracket's width. Without any above
        ``settled`` the climb starts with the first increment, and strides grow to a quarter of the load
    settled : load at which ``state`` is in equilibrium; None settles it under the dead load
    patience : steps that loads took to settle in an earlier search
    loading : loads of every block at a multiplier, see ``Loads.rows``, shape (n, 15); dead load and that much live load
        by default
    up_to : multiplier beyond which nothing is tried: the search ends as unbounded where the blocks stand there
    """
    loading = loading or (lambda multiplier: loads.rows("dead") + multiplier * loads.rows("live"))
    # without dead loads a block's own load is what the live load is in this unit
    scale = Scale.of(assembly, loads.dead if loads.dead.any() else loads.live * c.unit)
    record: list[tuple[float, LoadVerdict]] = []
    used = 0
    if settled is None:
        state, verdict = settle(assembly, loads, state, scale, c)
        record.append((0.0, verdict))
        used, patience = verdict.steps, max(patience, verdict.steps)
        if verdict.outcome != EQUILIBRIUM:
            status = Status.CANNOT_STAND if verdict.outcome == MOVING else Status.NOT_CONVERGED
            return Search(
                stable=float("nan"), moving=0.0, status=status, state=state, mechanism=None, record=record, steps=used,
            )
    bracket = _Bracket(settled or 0.0, through, c, up_to)
    mechanism, climb = None, [(bracket.stable, state.copy())]  # loads held and their states, on the way up
    limit, farthest = c.moved_limit * scale.smallest, 0.0  # [m]: what counts as collapse, and a block's way to a rest
    while (new := bracket.next_load()) is not None:
        if new == np.inf:
            return Search(
                stable=bracket.stable, moving=np.inf, status=Status.UNBOUNDED, state=state, mechanism=None,
                record=record, steps=used,
            )
        low, before = bracket.stable, state.copy()  # the load held so far, and the state under it
        reached(bracket.part(len(record)), bracket.words(new))
        try:
            # stiff joints settle within microns: no need to wait for a collapse to be seen by eye
            early = min(_EARLY * limit, max(_FARTHER * farthest, _EARLIEST * limit))
            verdict = hold(
                assembly, state, loading(new), scale, c.damping,
                tolerance=min(c.equilibrium, _BALANCED * (new - low) / c.unit), limit=limit, max_steps=c.max_steps,
                patience=patience, early=early, edges=c.edges,
                onset=LoadOnset(loading(low), int(RATE * (new - low) / c.unit)),
            )
            used += verdict.steps
            record.append((float(new), verdict))
            if c.progress is not None:
                c.progress(float(new), verdict)
        except KeyboardInterrupt:
            ends_early()
            # what was found so far stands: the largest load in equilibrium, and a bracket that is not closed
            return Search(
                stable=float(low), moving=float(bracket.moving), status=Status.NOT_CONVERGED, state=before,
                mechanism=mechanism, record=record, steps=used, details={"interrupted": float(new)},
            )
        if verdict.outcome == EQUILIBRIUM:
            patience, farthest = max(patience, verdict.steps), max(farthest, verdict.moved)
            bracket.held(new, record)
            # what is left of the motion would go on under the next load
            state.stop()
            climb.append((float(bracket.stable), state.copy()))
            while len(climb) > 1 and climb[1][0] <= _REACH * bracket.stable:
                climb.pop(0)
        else:
            if verdict.outcome == MOVING:
                mechanism = _mechanism(assembly, loads, state)
            bracket.refuse(new, verdict)
            state = before
    # loads that stay undecided leave a bracket wider than was asked for; chosen: from twice as wide on
    stable, moving = float(bracket.stable), float(bracket.moving)
    status = Status.SOLVED if moving - stable <= 2.0 * bracket.width else Status.ALMOST_SOLVED
    return Search(
        stable=stable, moving=moving, status=status if np.isfinite(moving) else Status.NOT_CONVERGED, state=state,
        mechanism=mechanism, record=record, steps=used, near=climb[0],
    )


class _Bracket:
    """The largest load held, the smallest one refused above it, and the next to try.

    All loads are multipliers of the live load [-].

    Parameters
    ----------
    settled : multiplier held at the beginning
    through : multipliers to be held first, rising; those up to ``settled`` are left out
    c : controls of the search
    up_to : multiplier beyond which nothing is tried

    Attributes
    ----------
    stable : largest load held
    refused : smallest load above it that was not held, whether blocks kept moving or it stayed undecided; else infinite
    moving : smallest load at which blocks kept moving; infinite where none did
    refused_from : load that was held when ``refused`` came on, at the foot of its stride
    queue : loads asked for that are still to be tried, rising
    last_asked : the largest load asked for, or ``settled``; above it strides grow
    stride : from the largest load held to the next one tried, while nothing is refused
    begins_near_collapse : whether loads above ``settled`` were asked for: then the first stride above them is a bracket
        wide
    """

    def __init__(self, settled: float, through: Sequence[float], c: Controls, up_to: float) -> None:
        """Begin at a load that stood."""
        self.c, self.up_to = c, up_to
        self.stable, self.refused, self.moving, self.refused_from = settled, np.inf, np.inf, 0.0
        self.queue = [x for x in through if x > settled]
        self.stride, self.last_asked = c.first, settled
        if self.queue:
            self.stride, self.last_asked = c.tolerance * self.queue[-1], self.queue[-1]
        self.begins_near_collapse = bool(self.queue)

    @property
    def width(self) -> float:
        """Width from which the bracket is closed [-], that of a small load near 0."""
        return self.c.tolerance * max(abs(self.stable), _SMALL * self.c.unit)

    def next_load(self) -> float | None:
        """Load to try next, None where the bracket is closed, infinite where all stand.

        Upwards through the loads that were asked for, then in strides until one is refused; then by halving.
        """
        if np.isfinite(self.refused):
            if self.refused - self.stable > self.width * (1.0 + _ALIKE):
                return 0.5 * (self.stable + self.refused)
            # a load that was refused after a long stride may hold from close by after all
            return None if self.stable - self.refused_from <= _LONG * self.width else self.refused
        if self.queue:
            return self.queue.pop(0)
        new = min(self.stable + self.stride, self.up_to)
        return np.inf if self.stable >= self.up_to or new > _LARGE * self.c.unit else new

    def held(self, new: float, record: list[tuple[float, LoadVerdict]]) -> None:
        """Count a load as held.

        One that is held though it was refused before was refused for the long stride that led to it, which shook the
        blocks: the bracket opens again.

        Parameters
        ----------
        new : multiplier that was held [-]
        record : all that were tried, with what came of them
        """
        if new >= self.refused:
            # reopen the bracket: up to the next refused load, or upwards again
            above = [(x, v.outcome) for x, v in record if v.outcome != EQUILIBRIUM and x > new]
            self.refused, self.stride = min((x for x, _ in above), default=np.inf), new - self.stable
            self.moving = min((x for x, outcome in above if outcome == MOVING), default=np.inf)
            self.refused_from = 0.0
        self.stable = new
        self.queue = [x for x in self.queue if x > new]
        if not np.isfinite(self.refused) and new > self.last_asked:
            # where loads asked for lead near to collapse strides begin at the bracket's width and double; else the
            # first climb takes longer strides, each half as long again as the last, to a quarter of the load (chosen)
            longest = max(2.0 * self.c.first, 0.25 * new)
            self.stride = 2.0 * self.stride if self.begins_near_collapse else min(1.5 * self.stride, longest)

    def refuse(self, new: float, verdict: LoadVerdict) -> None:
        """Count a load ``new`` [-] as refused: blocks kept moving, or it was undecided."""
        if verdict.outcome == MOVING:
            self.moving = min(self.moving, new)
        self.refused, self.refused_from = new, self.stable

    def part(self, tried: int) -> float | None:
        """Part of the search that is done [-], None while nothing was refused.

        It is the number of loads ``tried``, divided by that number and the halvings left until the bracket is closed.
        """
        gap = self.refused - self.stable
        if not np.isfinite(gap):
            return None
        halvings = np.log2(max(gap / self.width, 1.0))
        return float(tried / (tried + halvings + 1.0))

    def words(self, new: float) -> str:
        """Progress in words: which load ``new`` [-] is being held, and between which."""
        above = f", {self.refused:.4g} not" if np.isfinite(self.refused) else ""
        return f"holding {new:.4g}, {self.stable:.4g} held{above}"


def _mechanism(assembly: Assembly, loads: Loads, state: State) -> Mechanism | None:
    """Velocities of a state as a mechanism, None where the live load does no work."""
    now = state.resultants(assembly)
    twists = np.concatenate([state.bodies.vel, state.bodies.spin], axis=1)
    if not twists.any():
        return None
    return scaled_mechanism(assembly, loads, twists, now.point_position, now.point_interface)
