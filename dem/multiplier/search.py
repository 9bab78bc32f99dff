"""Search for the collapse multiplier: loads held one after the other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dem.model.held_load import EQUILIBRIUM, MOVING, UNDECIDED, LoadOnset, LoadVerdict, hold
from dem.model.rest_criterion import EVENLY, SETTLING, SLID, Scale, slid_and_moved
from dem.model.state import State
from limitmason.answers.results import Mechanism, Status
from limitmason.arrays import Array
from limitmason.display.progress import reached, watched
from limitmason.mechanics.resultants import scaled_mechanism
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Damping
from limitmason.storage.interrupts import ends_early

RATE = 1000
"""Steps over which as much live load comes on as there is dead load: what acts at once overshoots, and slips."""


@dataclass(frozen=True)
class Controls:
    """Numerical settings of a search.

    See :func:`dem.collapse` for those not explained here.
    """

    tolerance: float
    max_steps: int
    moved_limit: float  # of the smallest block dimension [-]
    equilibrium: float  # largest tolerance of unbalanced forces over every block's own load [-]
    damping: Damping
    unit: float  # multiplier at which the live load equals the dead load
    first: float  # first increment of the multiplier
    progress: Callable[[float, LoadVerdict], object] | None = None
    edges: bool = True


@dataclass
class Search:
    """Outcome of a search: bracket, where it ended, and the record of every load tried.

    Parameters
    ----------
    stable, moving : largest load in equilibrium, smallest one at which the blocks kept moving; infinite if none did
    near : load of about nine tenths of ``stable`` or less, and the state held there, from which to come near again
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
    """
    def held(state: State, evenly: int) -> LoadVerdict:
        """The dead load held on a state, after coming on over ``evenly`` steps."""
        return hold(
            assembly, state, loads.rows("dead"), scale, SETTLING, tolerance=min(1e-6, c.equilibrium),
            limit=2.5 * c.moved_limit * scale.smallest, max_steps=c.max_steps, edges=c.edges,
            onset=LoadOnset(np.zeros((len(loads.dead), 15)), evenly),
        )

    begun, first = state.copy(), held(state, 0)
    slid, moved = slid_and_moved(assembly, state)
    if first.outcome == UNDECIDED or (first.outcome == EQUILIBRIUM and slid <= SLID * moved):
        return state, first
    again = held(begun, max(EVENLY, first.steps))
    return begun, replace(again, steps=first.steps + again.steps)


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
    state : at rest without load, or in equilibrium under ``settled``
    through : loads to be held first; above the last one in steps of the bracket's width. Without them the climb starts
        with the first increment and its strides grow to a quarter of the load
    settled : load at which ``state`` is in equilibrium; None settles it under the dead load
    patience : steps that loads took to settle in an earlier search
    loading : loads of every block at a multiplier, see ``Loads.rows``, shape (n, 15); dead load and that much live load
        by default
    up_to : multiplier beyond which nothing is tried: the search ends as unbounded where the blocks stand there
    """
    loading = loading or (lambda multiplier: loads.rows("dead") + multiplier * loads.rows("live"))
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
    b = _Bracket(settled or 0.0, through, c, up_to)
    mechanism, kept = None, [(b.stable, state.copy())]
    limit, settling = c.moved_limit * scale.smallest, 0.0
    while (new := b.next_load()) is not None:
        if new == np.inf:
            return Search(
                stable=b.stable, moving=np.inf, status=Status.UNBOUNDED, state=state, mechanism=None, record=record,
                steps=used,
            )
        keep = state.copy()
        reached(b.part(len(record)), b.words(new))
        try:
            # stiff joints settle within microns: no need to wait for a collapse to be seen by eye
            verdict = hold(
                assembly, state, loading(new), scale, c.damping,
                tolerance=min(c.equilibrium, 0.05 * (new - b.stable) / c.unit), limit=limit, max_steps=c.max_steps,
                patience=patience, early=min(0.2 * limit, max(20.0 * settling, 0.02 * limit)), edges=c.edges,
                onset=LoadOnset(loading(b.stable), int(RATE * (new - b.stable) / c.unit)),
            )
            used += verdict.steps
            record.append((float(new), verdict))
            if c.progress is not None:
                c.progress(float(new), verdict)
        except KeyboardInterrupt:
            ends_early()
            # what was found so far stands: the largest load in equilibrium, and a bracket that is not closed
            note = {"interrupted": float(new)}
            return Search(
                stable=float(b.stable), moving=float(b.moving), status=Status.NOT_CONVERGED, state=keep,
                mechanism=mechanism, record=record, steps=used, details=note,
            )
        if verdict.outcome == EQUILIBRIUM:
            patience, settling = max(patience, verdict.steps), max(settling, verdict.moved)
            b.held(new, record)
            state.stop()
            kept.append((float(b.stable), state.copy()))
            while len(kept) > 1 and kept[1][0] <= 0.9 * b.stable:
                kept.pop(0)
        else:
            if verdict.outcome == MOVING:
                mechanism = _mechanism(assembly, loads, state)
            b.refuse(new, verdict)
            state = keep
    # loads that stay undecided leave a bracket wider than was asked for
    closed = b.moving - b.stable <= 2.0 * b.width
    status = Status.NOT_CONVERGED if not np.isfinite(b.moving) else Status.SOLVED if closed else Status.ALMOST_SOLVED
    return Search(
        stable=float(b.stable), moving=float(b.moving), status=status, state=state, mechanism=mechanism, record=record,
        steps=used, near=kept[0],
    )


class _Bracket:
    """The largest load held, the smallest one refused above it, and which load to try next.

    All loads are multipliers of the live load [-].

    Parameters
    ----------
    settled : multiplier held at the beginning
    through : multipliers to be held first
    up_to : that beyond which nothing is tried

    Attributes
    ----------
    stable : largest load held
    refused : smallest load above it that was not held, whether blocks kept moving or it stayed undecided; else infinite
    moving : smallest load at which blocks kept moving; infinite where none did
    refused_from : load that was held when ``refused`` came on, at the foot of its stride
    queue : loads asked for that are still to be tried, rising
    last_asked : the largest load asked for; above it strides grow
    stride : from the largest load held to the next one tried, while nothing is refused
    begins_near_collapse : whether loads were asked for: then the first stride above them is a bracket wide
    """

    def __init__(self, settled: float, through: Sequence[float], c: Controls, up_to: float) -> None:
        """Begin at a load that stood.

        Parameters
        ----------
        settled : multiplier that stood [-]
        through : those to try first
        up_to : the largest to try
        """
        self.c, self.up_to = c, up_to
        self.stable, self.refused, self.moving, self.refused_from = settled, np.inf, np.inf, 0.0
        self.queue = [x for x in through if x > settled]
        self.stride, self.last_asked = c.first, settled
        if self.queue:
            self.stride, self.last_asked = c.tolerance * self.queue[-1], self.queue[-1]
        self.begins_near_collapse = bool(through)

    @property
    def width(self) -> float:
        """Width of the bracket from which it is closed."""
        return self.c.tolerance * max(abs(self.stable), 1e-3 * self.c.unit)

    def next_load(self) -> float | None:
        """Load to try next, or None where the bracket is closed, infinite where every load is held.

        Upwards through the loads that were asked for, then in strides until one is refused; then by halving.
        """
        if np.isfinite(self.refused):
            if self.refused - self.stable > self.width * (1.0 + 1e-9):
                return 0.5 * (self.stable + self.refused)
            # a load that was refused after a long stride may hold from close by after all: four brackets count as long
            return None if self.stable - self.refused_from <= 4.0 * self.width else self.refused
        if self.queue:
            return self.queue.pop(0)
        new = min(self.stable + self.stride, self.up_to)
        # a thousand times the usual size of a multiplier: no load of this kind makes it fall
        return np.inf if self.stable >= self.up_to or new > 1e3 * self.c.unit else new

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
            # first climb takes longer strides, to a quarter of the load
            longest = max(2.0 * self.c.first, 0.25 * new)
            self.stride = 2.0 * self.stride if self.begins_near_collapse else min(1.5 * self.stride, longest)

    def refuse(self, new: float, verdict: LoadVerdict) -> None:
        """Count a load as refused: the blocks kept moving, or it stayed undecided."""
        if verdict.outcome == MOVING:
            self.moving = min(self.moving, new)
        self.refused, self.refused_from = new, self.stable

    def part(self, tried: int) -> float | None:
        """Loads tried over those and the halvings of a bracket that are left [-], or None while nothing was refused."""
        gap = self.refused - self.stable
        return tried / (tried + np.log2(max(gap / self.width, 1.0)) + 1.0) if np.isfinite(gap) else None

    def words(self, new: float) -> str:
        """Which load is being held, and between which."""
        above = f", {self.refused:.4g} not" if np.isfinite(self.refused) else ""
        return f"holding {new:.4g}, {self.stable:.4g} held{above}"


def _mechanism(assembly: Assembly, loads: Loads, state: State) -> Mechanism | None:
    """Velocities of the moving state as a mechanism, or None when it does not move along the live load."""
    now = state.resultants(assembly)
    twists = np.concatenate([state.bodies.vel, state.bodies.spin], axis=1)
    if not twists.any():
        return None
    return scaled_mechanism(assembly, loads, twists, now.point_position, now.point_interface)
