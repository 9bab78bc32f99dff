"""Tilting tests: turn the weight slowly until the wall falls, and stop the table where it may still stand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from dem.default_damping import SEARCHING
from dem.driving.own_weight import evenly_where_it_slides
from dem.model.rest_or_collapse import UNDECIDED
from dem.model.unbalance import Scale
from dem.multiplier.collapse import FIRST_INCREMENT, MOVED, collapse
from dem.multiplier.search import APPROACH, AT_REST, Controls, Search
from dem.multiplier.search import increments as held_loads
from dem.multiplier.table_readings import Readings, first_reached, peak_of, readings
from dem.settings import ContactOptions, DemSettings, given
from dem.stages.history import History
from dem.stages.resuming import RunStatus
from dem.stages.simulate import simulate
from limitmason.answers.results import Prediction, Status
from limitmason.arrays import Array
from limitmason.checks import count, finite, positive
from limitmason.display.notebook import Displayed
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads
from limitmason.model.model_call import of_model
from limitmason.model.stages import Damping, Settle, Tilt

# chosen, not derived
_LAST_BITS = 1e-9  # part of the angle by which the repeat of a run differs: nothing but its last bits can [-]
_FOLLOWS = 0.98  # of the table's tangent: a wall that still reads as much at the end of a run has not fallen


class TiltStatus(StrEnum):
    """How a tilting test ended."""

    SOLVED = "solved"
    ALMOST_SOLVED = "almost solved"
    CANNOT_STAND = "cannot stand under dead load"
    NOT_CONVERGED = "not converged"
    DID_NOT_FALL = "did not fall"


class TableRun(NamedTuple):
    """A run of the turning table."""

    rate: float  # angle per 1000 steps [deg]
    peak: float  # largest Rh / Rv that it read [-]


@dataclass(frozen=True, eq=False)
class TiltTest(Displayed, Readings):
    """A tilting test.

    Parameters
    ----------
    status : "solved"; "almost solved" (stopped tables that stayed undecided leave a bracket wider than asked for);
        "not converged" (no stopped table was seen to fall, or a turning one fell below one that stood); "did not fall"
        (up to the last angle) or "cannot stand under dead load"
    collapse_multiplier : tangent of the smallest tilt at which the wall was seen to fall [-]: max(Rh / Rv) of the
        slowest run, or ``held[1]`` where that is less; tangent of the last angle where it did not fall
    held : largest tangent at which the wall stood on the stopped table, smallest one at which it went on moving [-]
    spread : change of max(Rh / Rv) when the slowest run is repeated with nothing but its last bits changed [-]
    tilt_deg : angle of the table at the samples [deg], shape (samples,)
    steps : time steps since the table began to turn, shape (samples,)
    vertical, horizontal : Rv / Rv0 and Rh / Rv0, the reaction normal to the table and along it (positive where it holds
        the wall back) over the weight Rv0 of all blocks that are free [-], shape (samples,)
    ratio : Rh / Rv [-], shape (samples,); NaN where the wall has left the table
    weight : Rv0 [N]
    collapse : sample at which ``ratio`` first comes within 0.1 % of the multiplier, or of its maximum if that is less
    runs : of tables that turned, fastest first; empty where the wall did not stand on the level one
    direction : down the tilted table, seen from it, shape (3,)
    history : of the slowest run
    increments : the answer of :func:`dem.collapse` with loads held one after the other, where asked for
    warnings : what a reader must know
    """

    status: TiltStatus
    collapse_multiplier: float
    runs: tuple[TableRun, ...]
    direction: tuple[float, float, float]
    history: History
    held: tuple[float, float] = (float("nan"), float("nan"))
    spread: float = float("nan")
    increments: Prediction | None = None
    warnings: tuple[str, ...] = ()

    @property
    def interval(self) -> tuple[float, float] | None:
        """Tangents of the tilt between which the wall falls [-], or None.

        The upper end is the lowest stopped table on which it fell. The lower end is the highest on which it stood, or
        the multiplier, where it fell earlier on a table that turned. It is None unless stopped tables showed both.
        """
        if not np.isfinite(self.held).all():
            return None
        return min(self.held[0], self.collapse_multiplier), self.held[1]

    @property
    def collapse_angle_deg(self) -> float:
        """Angle whose tangent is the multiplier [deg]: what a slow test on a table reads."""
        return float(np.rad2deg(np.arctan(self.collapse_multiplier)))

    @property
    def rate_change(self) -> float:
        """Relative change of max(Rh / Rv) in the last run [-], NaN without runs."""
        return self.runs[-1].peak / self.runs[-2].peak - 1.0 if self.runs else float("nan")

    @property
    def at_rest(self) -> float:
        """Max(Rh / Rv) extrapolated to a table that turns infinitely slowly [-].

        It holds where the lag is linear in the rate. It is not where the wall slides: the ratio then stays at tan(phi)
        however late the wall is seen to move. NaN where no table turned or the wall did not fall.
        """
        fell = self.runs and self.status != TiltStatus.DID_NOT_FALL
        return _at_rate_zero(self.runs) if fell else float("nan")

    def __str__(self) -> str:
        """Multiplier, angle, stopped tables, rate, and held loads where asked for.

        Status and warnings alone where no table was turned, or where the wall stood at the last angle.
        """
        if not self.runs or self.status == TiltStatus.DID_NOT_FALL:
            above = f", lambda above {self.collapse_multiplier:.4f}" if self.runs else ""
            return "\n".join([f"tilting test: {self.status}{above}", *(f"  {w}" for w in self.warnings)])
        lines = [
            f"tilting test: {self.status}, lambda = {self.collapse_multiplier:.4f}, "
            f"angle {self.collapse_angle_deg:.2f} deg",
            f"  table stopped: stands at {self.held[0]:.4f}, falls at {self.held[1]:.4f}",
            f"  table turning at {self.runs[-1].rate:.3g} deg per 1000 steps: max(Rh / Rv) = "
            f"{self.runs[-1].peak:.4f}; the "
            f"last slowing changed it by {self.rate_change:+.2%}, the last bits by {self.spread:.2%}; extrapolated to "
            f"rate 0: {self.at_rest:.4f}",
        ]
        if self.increments is not None:
            other = self.increments.collapse_multiplier
            lines.append(
                f"  loads held one after the other: {other:.4f} ({self.increments.status}), tilt / held "
                f"{self.collapse_multiplier / other:.3f}"
            )
        return "\n".join(lines + [f"  {w}" for w in self.warnings])


@of_model
@watched("tilting test")
def tilt_test(
    assembly: Assembly,
    direction: ArrayLike = (1.0, 0.0, 0.0),
    *,
    to_deg: float = 45.0,
    steps: int = 20_000,
    tolerance: float = 0.01,
    halvings: int = 5,
    moved_limit: float = 0.3,
    damping: Damping | None = None,
    sample: int | None = None,
    increments: bool = False,
    **contacts: Unpack[ContactOptions],
) -> TiltTest:
    """Tilt a wall on its table until it falls, as in a laboratory.

    It is tilted again at half speed until that no longer matters.

    The weight of every block turns as W (-cos(alpha) z + sin(alpha) d) while alpha grows steadily. A turning table
    reads max(Rh / Rv) of the reactions: tan(alpha) at collapse if it turns slowly enough, and tan(phi) at any rate
    where the wall slides in the end, however early its first blocks have left. The verdict is that of the blocks'
    motion on a table that stops: loads held as in :func:`dem.collapse`, with the weight turned.

    Parameters
    ----------
    direction : horizontal vector d towards which the wall leans, shape (3,)
    to_deg : angle at which the table stops [deg]
    steps : time steps of the first run from 0 to ``to_deg``; the second reaches the angle of collapse in as many (or
        turns at half the rate of the first), every further one turns half as fast
    tolerance : change of max(Rh / Rv) from one rate to half of it that is accepted, and width of the bracket of stopped
        tables over the multiplier [-]
    halvings : most times the rate is halved; then a warning says that the turning table still reads too much
    moved_limit : displacement at which the run ends, over the smallest block dimension [-]
    damping : while the table turns; local 0.5
    sample : steps between samples; ``steps`` / 200 by default, but 20 or more
    increments : also find the multiplier with loads held one after the other (:func:`dem.collapse`)
    contacts : ``contact_points``, ``contact_model`` and ``joint_options``, as :func:`dem.collapse` takes them

    Returns
    -------
    TiltTest

    Raises
    ------
    InputError
        When the direction is zero or not horizontal, ``to_deg`` is not between 0 and 90, nothing is held, a tolerance
        or limit is not positive, or a number of steps, samples or halvings is no whole number from 1 on.
    KeyboardInterrupt
        Stopped by the keyboard before the table has turned as slowly as it is to.

    Notes
    -----
    Only the blocks' own weight turns. With cohesion or tensile strength the angle is right for a tilting table but its
    tangent is not the multiplier of horizontal forces on an upright wall, so ``increments`` then differs. Stopped
    tables keep the first contacts; turning ones find them anew, as :func:`dem.simulate` does. Source: Godio, Stefanou,
    Sab 2017, section 3.1, eqs 5 to 7 and Figs 5, 6.
    """
    loads = Loads.horizontal(assembly, direction)
    downhill = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    if not 0.0 < finite("to_deg", to_deg) < 90.0:
        raise InputError(f"to_deg must lie between 0 and 90 degrees, got {to_deg!r}")
    tolerance, moved_limit = positive("tolerance", tolerance), positive("moved_limit", moved_limit)
    steps = count("steps", steps)
    if (halvings := count("halvings", halvings, least=0)) < 1:  # 0 is a number of halvings, but tells no change
        raise InputError("halvings must be positive: the rate check needs at least one halving")
    # some 200 samples in a run, of 20 steps at least; chosen
    every = max(steps // 200, 20) if sample is None else count("sample", sample)
    if not assembly.held.any():
        raise InputError("nothing is held: a tilting test reads the reactions of the held blocks (the table)")
    axis = tuple(np.cross((0.0, 0.0, 1.0), downhill).tolist())  # about which the table turns
    scale = Scale.of(assembly, loads.dead)
    weight = float(assembly.weights[~assembly.fixed].sum())
    options = given(contacts, ContactOptions, "tilt_test")
    # the weight acts at once, and comes on once more, evenly, where joints slid by its overshoot
    settled, _ = evenly_where_it_slides(assembly, Settle(tolerance=AT_REST), sample=every, **options)
    _raise_if_interrupted(settled)
    # what has fallen comes to rest too, on the table: where it lies is not the wall that was to be tilted
    fell = float(np.abs(settled.shift[-1]).max()) > moved_limit * scale.smallest
    if fell or settled.status != RunStatus.FINISHED:
        found = readings(settled, float("nan"), downhill, weight)
        return TiltTest(
            **vars(found), status=TiltStatus.CANNOT_STAND if fell else TiltStatus.NOT_CONVERGED,
            collapse_multiplier=float("nan"), runs=(), direction=tuple(downhill.tolist()), history=settled,
            warnings=(f"it {'fell' if fell else 'did not settle'} on the level table",),
        )
    # the multiplier alone is compared: no error budget, whose repeats take as long again each
    held = collapse(assembly, loads, error_budget=(), **options) if increments else None
    last_tangent = float(np.tan(np.deg2rad(to_deg)))

    def turned(stage: Tilt) -> _Turned:
        """Run of the table from rest through a stage."""
        history, begun = simulate(assembly, stage, start=settled, sample=every), float(settled["step"][-1])
        _raise_if_interrupted(history)
        return _Turned(stage, history, readings(history, begun, downhill, weight))

    first = Tilt(to_deg=to_deg, steps=steps, axis=axis, damping=damping, stop_when_moved=moved_limit * scale.smallest)
    runs, slowest = _slowed(turned, first, halvings, tolerance)
    # once more as in the last run, to see what hangs on rounding alone
    again = turned(replace(slowest.stage, to_deg=to_deg * (1.0 + _LAST_BITS)))
    repeat = peak_of(again.read.ratio)
    bracket = _stopped(assembly, loads, settled, runs, last_tangent, tolerance)
    status, multiplier, said = _judged(bracket, runs, repeat, last_tangent, tolerance)
    found = replace(slowest.read, collapse=first_reached(slowest.read.ratio, multiplier))
    return TiltTest(
        **vars(found), status=status, collapse_multiplier=multiplier, runs=tuple(runs),
        direction=tuple(downhill.tolist()), history=slowest.history, held=(bracket.stable, bracket.moving),
        spread=abs(repeat / runs[-1].peak - 1.0), increments=held, warnings=(*settled.warnings, *said),
    )


class _Turned(NamedTuple):
    """A run of the table, with the stage that turned it and what it read."""

    stage: Tilt
    history: History
    read: Readings


def _slowed(
    turned: Callable[[Tilt], _Turned], first: Tilt, halvings: int, tolerance: float
) -> tuple[list[TableRun], _Turned]:
    """Turn the table ever more slowly until that no longer matters: all runs, and the last one.

    Parameters
    ----------
    turned : runs the table through a stage, from rest
    first : stage of the first run, which only finds the scale
    halvings : most times that the rate is halved, one or more
    tolerance : change of max(Rh / Rv) from one rate to the next that counts as none [-]
    """
    assert first.steps is not None
    runs: list[TableRun] = []
    stood: list[bool] = []
    rate, last_tangent = first.to_deg / first.steps, float(np.tan(np.deg2rad(first.to_deg)))  # [deg per step], [-]
    for k in range(halvings + 1):
        reached(None, f"turn {k + 1}, {1000.0 * rate:.3g} deg per 1000 steps")
        run = turned(replace(first, steps=int(first.to_deg / rate)))
        peak = peak_of(run.read.ratio)
        runs.append(TableRun(1000.0 * rate, peak))
        # no block moved far on the whole way, and the wall still follows the table at its end
        stood.append(run.read.steps[-1] >= run.stage.steps and peak > _FOLLOWS * last_tangent)
        # slower no longer matters: two rates read alike, or the wall stood at both. One run alone says neither
        if k and (all(stood[-2:]) or abs(runs[-1].peak / runs[-2].peak - 1.0) < tolerance):
            break
        # the second run takes all steps of the first up to the angle of collapse
        rate = 0.5 * rate if k else min(0.5 * rate, float(np.rad2deg(np.arctan(peak))) / first.steps)
    return runs, run


def _raise_if_interrupted(history: History) -> None:
    """End the test where the keyboard stopped a run: its largest ratio means nothing."""
    if history.status == RunStatus.INTERRUPTED:
        raise KeyboardInterrupt("while a table settled or turned")


def _judged(
    bracket: Search, runs: list[TableRun], repeat: float, last_tangent: float, tolerance: float
) -> tuple[TiltStatus, float, list[str]]:
    """Status, multiplier [-] and notes, from tables that turned and that stopped.

    The multiplier is the least at which the wall was seen to fall on either. They contradict each other where the wall
    fell on a table that turned below an angle at which it stood on a stopped one: that is no answer.

    Parameters
    ----------
    bracket : tangents of the tilt at which the wall stood and fell on stopped tables
    runs : of the turning table, two or more, the last slower than the one before
    repeat : max(Rh / Rv) of the last run when it is made again with other last bits [-]
    last_tangent : of the largest tilt that was tried [-]
    tolerance : relative difference of readings that counts as none [-]
    """
    reading, notes = runs[-1].peak, []
    if bracket.status == Status.UNBOUNDED:
        angle = float(np.rad2deg(np.arctan(last_tangent)))
        return TiltStatus.DID_NOT_FALL, last_tangent, [f"it did not fall up to {angle:g} degrees: give a larger to_deg"]
    # a table that turns reads too much, never too little: below a load at which the wall stood the runs disagree
    status, lowest = TiltStatus(bracket.status), min(reading, repeat)
    if lowest < (1.0 - tolerance) * bracket.stable:
        status = TiltStatus.NOT_CONVERGED
        notes.append(f"it fell at {lowest:.4f} while the table turned and stood at {bracket.stable:.4f}")
    if "interrupted" in bracket.details:
        notes.append(f"interrupted on a table stopped at {bracket.details['interrupted']:.4f}: the bracket is open")
    undecided = [f"{x:.4f}" for x, v in bracket.record if v.outcome == UNDECIDED and x > bracket.stable]
    if undecided:
        notes.append(f"undecided on the stopped table at {', '.join(undecided)}; not counted as standing")
    # a ratio above where the wall falls, or one that still drops with the rate, is no reading of the collapse
    change = reading / runs[-2].peak - 1.0
    if reading > (1.0 + tolerance) * bracket.moving or abs(change) >= tolerance:
        notes.append(
            f"the turning table reads max(Rh / Rv) = {reading:.4f} ({change:+.1%} at half the rate), the wall "
            f"falls at {bracket.moving:.4f} on the stopped one: it turns too fast, or slides after others have left"
        )
    return status, min(lowest, bracket.moving), notes


def _stopped(
    assembly: Assembly, loads: Loads, settled: History, runs: list[TableRun], last_tangent: float, tolerance: float
) -> Search:
    """Bracket of the tangent of the tilt, by tables that stop and wait.

    Against a ratio of reactions this judges every block by its own load and motion: a stone of a thousandth of the
    weight does not show in the reactions, and a wall that slides shows tan(phi) before and after.

    Parameters
    ----------
    loads : dead load the weight, live load the weight turned to the direction of the tilt
    settled : at rest under dead load
    runs : tables that turned, two or more, each slower than the one before
    last_tangent : largest tangent of the tilt [-]
    tolerance : width of the bracket over the multiplier [-]
    """
    usual = DemSettings()
    # where the tangent is 1 the live load is as large as the dead one: the unit of this multiplier
    controls = Controls(
        tolerance=tolerance, max_steps=usual.max_steps, moved_limit=MOVED, equilibrium=usual.equilibrium,
        damping=SEARCHING, unit=1.0, first=FIRST_INCREMENT,
    )
    # tangent to begin near: what the table read, extrapolated to rate 0. A line through two noisy peaks may end far too
    # low: no lower than half of what was read
    read = min(runs[-1].peak, last_tangent)
    guess = min(read, max(_at_rate_zero(runs), 0.5 * read))

    def turned(tangent: float) -> Array:
        """Weight of every block on a table tilted to a tangent [-], shape (n, 15)."""
        return (loads.rows("dead") + tangent * loads.rows("live")) / np.hypot(1.0, tangent)

    return held_loads(
        assembly, loads, settled.state.copy(), controls, through=[part * guess for part in APPROACH], settled=0.0,
        loading=turned, up_to=last_tangent,
    )


def _at_rate_zero(runs: Sequence[TableRun]) -> float:
    """Max(Rh / Rv) of the last two runs, continued in a line to no speed [-]."""
    (fast, high), (slow, low) = runs[-2:]
    return low - (high - low) * slow / (fast - slow)
