"""Search for the smallest non-associative multiplier: variants, starts, descent.

The multiplier is not unique for psi < phi. Every candidate is polished and checked against the true law before it
counts, so that the smallest one found is admissible; that nothing lies below it is not proven.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.display.progress import reached
from limitmason.limit.nonassociative.alternating import ConePrograms, alternate, complying_forces, lower
from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.force_program import ForceProgram
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, exact, split, violation
from limitmason.limit.nonassociative.polish import PlanePrograms, alternate_plane, descend, interval_in_plane, polish
from limitmason.limit.nonassociative.sequential import SchemeRun, SchemeSettings, run_sequence
from limitmason.limit.nonassociative.starts import no_steeper, random_start, slopes_for
from limitmason.storage.interrupts import ends_early


class Effort(NamedTuple):
    """How much a search tries, counted, so that it repeats.

    Slopes and mixings of the scheme, random starts, pushes.
    """

    slopes: tuple[float, ...]  # a of ``SchemeSettings`` [-]
    mixings: tuple[float, ...]  # b of the same [-]
    random_starts: int  # runs of the scheme from random normal forces
    pushes: tuple[float, ...]  # weights of the multiplier against the law [-]
    lower_each: bool  # in 3-D: push every candidate down, not only the best
    descents: int = 0  # in plane: disturbed descents of every candidate
    mirrored: bool = False  # also in the order of the mirror image, with as many random starts


USUAL_MIXING = 0.6
"""Mixing that is tried first, and alone in the shorter searches [-]."""

EFFORTS = {
    "quick": Effort(slopes=(0.005, 0.05), mixings=(USUAL_MIXING,), random_starts=0, pushes=(), lower_each=False),
    "standard": Effort(
        slopes=(0.005, 0.02, 0.05, 0.1), mixings=(USUAL_MIXING,), random_starts=4, pushes=(), lower_each=True,
        descents=4, mirrored=True,
    ),
    "thorough": Effort(
        slopes=(0.001, 0.005, 0.02, 0.05, 0.1), mixings=(0.3, 0.6, 0.9), random_starts=30,
        pushes=(0.01, 0.03, 0.1, 0.3, 1.0), lower_each=True, descents=8, mirrored=True,
    ),
}
"""Efforts by name: their settings and counts are chosen."""

AT_REST = Effort(slopes=(0.005,), mixings=(USUAL_MIXING,), random_starts=2, pushes=(), lower_each=False)
"""What is tried in space where the associative state is admissible for every psi: one sequence, two random starts and
a push of the lowest. Nothing has to be found there; what may lie below are forces that gather in a corner."""

LARGE_IN_SPACE = 700
"""Contact points in space from which the standard search takes ``LARGE``: a cone program then takes some tenths of a
second, and the whole search would take minutes."""

LARGE = Effort(slopes=(0.005, 0.05), mixings=(USUAL_MIXING,), random_starts=2, pushes=(), lower_each=False)
"""What the standard search tries on large problems in space."""

LOWER = 1e-9
"""Scaled multiplier by which a state must lie below the lowest so far to take its place [-]: less is rounding."""

ROUNDS = 20
"""Descents of a plane state at most, disturbed ones aside: chosen."""

PUSH_STEPS = 15
"""Alternations with a weight on the multiplier, before those without: chosen."""

CLOSED = 1e-6
"""Distance between the lowest state and a bound that no state passes at which the search ends, relative to
max(1, lambda)."""


class Trial(NamedTuple):
    """One candidate: strategy, raw and certified scaled multiplier (or NaN), cost."""

    strategy: str
    sequential: float  # raw multiplier of the scheme [-]
    steps: int  # of the scheme, 0 where it was not run
    certified: float  # multiplier of the exact state [-]
    violation: float  # worst of the candidate [-]
    seconds: float  # [s]
    best: float = float("nan")  # lowest certified so far [-]

    def times(self, scale: float) -> "Trial":
        """The trial in multipliers of the live load: scaled ones times ``scale`` [-]."""
        return self._replace(
            sequential=self.sequential * scale, certified=self.certified * scale, best=self.best * scale
        )

    def __str__(self) -> str:
        """One line for a reader who waits: the stage, what it gave, the lowest so far."""
        gave = f"{self.certified:.6g}" if np.isfinite(self.certified) else "no state that keeps the law"
        lowest = f"{self.best:.6g}" if np.isfinite(self.best) else "none yet"
        return f"{self.strategy}: {gave} in {self.seconds:.1f} s; lowest so far {lowest}"


class SearchOutcome(NamedTuple):
    """Outcome: the lowest exact state, or the least violating one, and all trials."""

    best: ForceState | None  # the lowest exact state
    nearest: ForceState | None  # the one that violates the law least
    trials: tuple[Trial, ...]
    first_run: SchemeRun | None  # the first sequence of the scheme
    stopped: bool = False  # the time limit ended it
    closed: bool = False  # the lowest state meets a bound that no state passes
    at_rest: bool = False  # the associative state is admissible for every psi, and only ``AT_REST`` was tried
    interrupted: bool = False  # from the keyboard; then also ``stopped``

    @property
    def unpushed(self) -> float:
        """Certified multiplier of the first sequence with one: without a search."""
        values = [t.certified for t in self.trials if t.steps and np.isfinite(t.certified)]
        return values[0] if values else float("nan")

    @property
    def certified(self) -> Array:
        """Scaled multipliers of all certified candidates."""
        values = np.array([t.certified for t in self.trials])
        return values[np.isfinite(values)]


class Polisher:
    """From a near-admissible state to an exact one: linear programs, or cones in 3-D."""

    def __init__(
        self, law: JointLaw, accuracy: float, *, descents: int = 0, random: np.random.Generator | None = None,
        deadline: Deadline = NEVER,
    ) -> None:
        """Prepare the programs of a joint law.

        Parameters
        ----------
        law : of the problem
        accuracy : violation that counts as none [-]
        descents : disturbed descents of every state, in plane
        random : of the disturbances; needed where there are descents
        deadline : after which no further program begins
        """
        self.law, self.accuracy, self.descents, self.random, self.deadline = law, accuracy, descents, random, deadline
        self.cones = ConePrograms(law, deadline)
        self.plane = PlanePrograms(law, deadline) if law.components == 2 else None

    def exact_near(self, state: ForceState) -> ForceState | None:
        """Exact state near a given one, or the nearest that was found, or None.

        In plane an exact state is then lowered further by :func:`descend`. ``state`` is near the law, as the sequential
        scheme leaves it.
        """
        if self.plane is None:
            return alternate(self.cones, state)
        found = polish(self.plane, state)
        if self.deadline.passed:
            return found or state
        # where linear programs do not reach the law, cone programs come nearer first
        if not exact(found, self.law, self.accuracy):
            around = alternate(self.cones, state)
            again = None if around is None else polish(self.plane, around)
            found = again if exact(again, self.law, self.accuracy) else found or around
        if not exact(found, self.law, self.accuracy):
            return found
        lowered = descend(
            self.plane, found, rounds=ROUNDS + self.descents, tries=self.descents, random=self.random
        )
        return lowered if exact(lowered, self.law, self.accuracy) else found

    def push(self, state: ForceState, theta: float) -> ForceState | None:
        """Exact state after giving the multiplier a weight ``theta`` [-], or None.

        It may lie above ``state``, from which it is reached: the weight leads away, alternation back to the law.
        """
        if self.plane is None:
            return lower(self.cones, state, thetas=(theta,), tolerance=self.accuracy)
        pushed = alternate_plane(self.plane, state, theta=theta, steps=PUSH_STEPS)
        back = None if pushed is None else alternate_plane(self.plane, pushed)
        return None if back is None else self.exact_near(back)

    def multiplier_interval(self, state: ForceState) -> tuple[float, float]:
        """Lowest and highest scaled multiplier at which a mechanism is admissible [-]."""
        if self.plane is not None:
            return interval_in_plane(self.plane, state)
        ends = [state.multiplier]
        for largest in (False, True):
            found = complying_forces(self.cones, state, largest=largest)
            if exact(found, self.law, self.accuracy):
                ends.append(found.multiplier)
        return min(ends), max(ends)


def search_smallest(
    law: JointLaw, start: Array, *, effort: Effort = EFFORTS["standard"], seed: int = 0, accuracy: float = 1e-8,
    deadline: Deadline = NEVER, floor: float = -np.inf, known: ForceState | None = None,
    progress: Callable[[Trial], None] | None = None,
) -> SearchOutcome:
    """Smallest certified multiplier over variants, random starts and pushes.

    The first trial is made whatever the time; the search ends early where its lowest state meets ``floor``. An
    interrupt from the keyboard ends it with the trials so far.

    Parameters
    ----------
    law : joint law of the problem
    start : normal forces from the tension corner to begin with, scaled, shape (m,), as of the associative state
    effort : how much is tried; a count, so that equal arguments give equal results
    seed : of the random starts
    accuracy : largest violation of the true law of a candidate that counts [-]
    deadline : at which it stops; the result then depends on the machine
    floor : scaled multiplier that no state passes
    known : exact state to begin with
    progress : called with every trial

    Returns
    -------
    SearchOutcome: all multipliers in it are scaled.
    """
    search = _Trials(law, effort, seed, accuracy, deadline, floor, known, progress)
    interrupted = False
    try:
        search.sequences(start)
        search.random_starts(start)
        search.pushes()
    except KeyboardInterrupt:
        interrupted = True
        ends_early()
    closed = search.closed
    stopped = (interrupted or deadline.passed) and not closed
    return SearchOutcome(
        search.best, search.nearest, tuple(search.trials), search.first_run, stopped, closed,
        interrupted=stopped and interrupted,
    )


class _Trials:
    """A search under way: every trial so far, and the best states that they gave.

    Arguments are those of :func:`search_smallest`.

    Attributes
    ----------
    best : the lowest state that meets the law; None while there is none
    nearest : the state that violates the law least
    least_violation : by how much that is [-]
    first_run : the first sequence of the scheme
    trials : record of every trial so far; ``planned`` is their number without pushes of single candidates
    polisher : makes the end of a sequence exact
    random : generator of all random starts and disturbances
    """

    def __init__(
        self, law: JointLaw, effort: Effort, seed: int, accuracy: float, deadline: Deadline, floor: float,
        known: ForceState | None, progress: Callable[[Trial], None] | None,
    ) -> None:
        """Begin without any trial; arguments as of :func:`search_smallest`."""
        self.law, self.effort, self.accuracy, self.deadline, self.floor = law, effort, accuracy, deadline, floor
        self.progress = progress
        self.planned = len(effort.slopes) * len(effort.mixings) + effort.random_starts + len(effort.pushes)
        self.random = np.random.default_rng(seed)
        self.polisher = Polisher(law, accuracy, descents=effort.descents, random=self.random, deadline=deadline)
        self.trials: list[Trial] = []
        self.best = known
        self.nearest: ForceState | None = None
        self.least_violation = np.inf
        self.first_run: SchemeRun | None = None

    @property
    def closed(self) -> bool:
        """Whether the lowest state meets the bound that no state passes."""
        best, floor = self.best, self.floor
        return best is not None and best.multiplier <= floor + CLOSED * max(1.0, abs(floor))

    @property
    def over(self) -> bool:
        """Whether no further trial is to begin: it is closed, or its time is up."""
        return self.closed or self.deadline.passed

    def sequences(self, start: Array) -> None:
        """Try every slope and mixing of the scheme, the usual mixings first.

        Parameters
        ----------
        start : normal forces N' to begin with, scaled, shape (m,)
        """
        for mixing in sorted(self.effort.mixings, key=lambda b: abs(b - USUAL_MIXING)):
            for slope in slopes_for(self.law, self.effort.slopes):
                # something must be tried, even without any time
                if not (self.over and (self.trials or self.best is not None)):
                    variant = SchemeSettings(slope=slope, mixing=mixing)
                    self._attempt(
                        f"sequence, {variant}", start, variant, push=self.effort.lower_each, law=self.law
                    )

    def random_starts(self, start: Array) -> None:
        """Run the scheme from random normal forces, with random settings.

        Parameters
        ----------
        start : normal forces N' that are disturbed while no state meets the law, scaled, shape (m,)
        """
        if self.over or not self.effort.random_starts:
            return
        law, forces = no_steeper(self.law), self.polisher.cones.forces
        if (law.tan_phi < self.law.tan_phi).any():
            gentle = ForceProgram(law, deadline=self.deadline)
            # what stands by steep friction alone is searched with it
            law, forces = (law, gentle) if gentle.solve(0.0) is not None else (self.law, forces)
        for k in range(self.effort.random_starts):
            if self.over:
                break
            good = start if self.best is None else split(self.law, self.best.force)[0]
            kind, normal = random_start(self.law, forces, good, self.random, k)
            # over the range of slopes and mixings that the efforts name
            slope, mixing = 10 ** self.random.uniform(-3, -1), self.random.uniform(0.3, 0.95)
            variant = SchemeSettings(slope=float(slope), mixing=float(mixing))
            if normal is not None:
                self._attempt(f"{kind}, {variant}", normal, variant, push=False, law=law)

    def pushes(self) -> None:
        """Push the best state down by every weight of the effort, in space to the end."""
        for theta in self.effort.pushes:
            if self.over or self.best is None:
                break
            since = time.perf_counter()
            self._keep(f"push, weight {theta:g}", self.polisher.push(self.best, theta), None, since)
        if self.polisher.plane is None and self.best is not None and not self.over:
            since = time.perf_counter()
            lowered = lower(self.polisher.cones, self.best, tolerance=self.accuracy)
            self._keep("push of the best", lowered, None, since)

    def _attempt(
        self, strategy: str, normal: Array, variant: SchemeSettings, *, push: bool, law: JointLaw
    ) -> None:
        """Run the sequential scheme, make its end exact and, in space, push it down.

        Parameters
        ----------
        strategy : what the trial is called
        normal : normal forces N' to begin with, scaled, shape (m,)
        variant : settings of the scheme
        push : whether the end is pushed down, which in plane the descent has done already
        law : that the scheme runs with
        """
        since = time.perf_counter()
        run = run_sequence(law, normal, variant, self.deadline)
        self.first_run = self.first_run or run
        candidate = run.state
        if candidate is not None and not self.over:
            candidate = self.polisher.exact_near(candidate)
        self._keep(strategy, candidate, run, since)
        if push and self.polisher.plane is None and exact(candidate, self.law, self.accuracy):
            since = time.perf_counter()
            lowered = lower(self.polisher.cones, candidate, tolerance=self.accuracy)
            self._keep(f"{strategy}, pushed", lowered, None, since)

    def _keep(self, strategy: str, candidate: ForceState | None, run: SchemeRun | None, since: float) -> None:
        """Record a candidate; keep the lowest that meets the law, and the nearest else.

        Parameters
        ----------
        strategy : what the trial is called
        candidate : None where the trial gave none
        run : of the scheme that led to it, None for a push
        since : reading of ``time.perf_counter`` at which the work for it began
        """
        off = np.inf if candidate is None else violation(self.law, candidate).worst
        good = candidate if off <= self.accuracy else None
        if candidate is not None and off < self.least_violation:
            self.nearest, self.least_violation = candidate, off
        if good is not None and (self.best is None or good.multiplier < self.best.multiplier - LOWER):
            self.best = good
        raw = run.state.multiplier if run is not None and run.state is not None else np.nan
        trial = Trial(
            strategy=strategy, sequential=raw, steps=run.steps if run else 0,
            certified=np.nan if good is None else good.multiplier, violation=off, seconds=time.perf_counter() - since,
            best=np.nan if self.best is None else self.best.multiplier,
        )
        self.trials.append(trial)
        reached(min(len(self.trials) / self.planned, 1.0))
        if self.progress is not None:
            self.progress(trial)
