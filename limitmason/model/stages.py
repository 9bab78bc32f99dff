"""Stages of loading: settle, ramp, tilt, driven blocks, base motion, hold.

Each is plain frozen data.

Loads and their factors are kept from stage to stage: a stage changes only what it names. A test is stated in them, and
a method that steps through time follows them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.checks import choice, finite, numbers, positive
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.support import DEGREES_OF_FREEDOM
from limitmason.storage.csv_table import separator, split
from limitmason.storage.files import read_text


def _finite(what: str, value: float | Sequence[float]) -> None:
    """Refuse numbers that are not finite, and what is no number."""
    try:
        fine = bool(np.isfinite(np.asarray(value, dtype=float)).all())
    except (TypeError, ValueError):
        fine = False
    if not fine:
        raise InputError(f"{what} must be finite, got {value!r}")


@dataclass(frozen=True)
class Damping:
    """How motion is braked.

    Parameters
    ----------
    local : Cundall's local damping, F - local |F| sign(v) per component; takes momentum from free flight
    adaptive : ratio of the power of global viscous damping to the rate of change of kinetic energy; 0 for none
    kinetic : stop all blocks whenever the kinetic energy has passed a peak; settles without overshoot
    combined : where motion is steady (kinetic energy small beside the elastic), half of the local damping acts against
        the change of the force instead, -local / 2 |F| (sign(v) - sign(dF/dt)): local damping alone drags on blocks
        that slide or turn on at one speed while their joints chatter (Cundall's combined damping)
    """

    local: float = 0.0
    adaptive: float = 0.0
    kinetic: bool = False
    combined: bool = False

    def __post_init__(self) -> None:
        """Check the range."""
        if not (0.0 <= self.local <= 0.9 and self.adaptive >= 0.0):
            raise InputError(
                f"local damping must lie in 0 .. 0.9 and adaptive be >= 0, got {self.local!r} and {self.adaptive!r}"
            )
        if self.combined and not self.local > 0.0:
            raise InputError("combined damping shares out the local one: give local > 0, or leave combined out")


@dataclass(frozen=True)
class Servo:
    """Jack that keeps the vertical push on a block constant while the block moves.

    v = gain / (K dt) (e + gain / 4 sum(e)), e = force - push: the block's vertical velocity is prescribed from what the
    push lacks and has lacked in every step so far, as a test rig closes its loop; K is the vertical stiffness of the
    block's own joints. A dead force does the same to a block that is free; a servo also does it to one that must stay
    parallel or is driven.

    Parameters
    ----------
    force : push downwards beyond the block's own loads [N]
    parallel : hold the rotations too, as a pair of jacks does (double bending); False leaves them free (cantilever)
    gain : part of the difference that is made up per step if nothing but the block's own joints gave way [-]; a tall
        soft wall below answers late: lower it where the force swings
    """

    force: float
    parallel: bool = True
    gain: float = 2e-2

    def __post_init__(self) -> None:
        """Check the range."""
        if not (np.isfinite(self.force) and 0.0 < self.gain <= 0.5):
            raise InputError(f"a servo needs a finite force and 0 < gain <= 0.5, got {self.force!r} and {self.gain!r}")


HOLD, COAST = "hold", "coast"

AT_REST = 0.01
"""A record ends at rest where its last velocity is below this fraction of its largest [-]."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """What all stages share.

    Parameters
    ----------
    damping : None takes the simulation's own
    stop_when_moved : end the stage when a block has moved this far since the stage began [m]
    name : label in the history
    servo : by block name or number: what keeps its vertical push constant in this stage; its degrees of freedom are
        released after it
    """

    damping: Damping | None = None
    stop_when_moved: float | None = None
    name: str = ""
    servo: Mapping[int | str, Servo] = field(default_factory=dict)


@dataclass(frozen=True)
class Settle(Stage):
    """Hold the loads until force and moment are small in four checks in a row.

    Parameters
    ----------
    tolerance : largest unbalanced force and moment over every block's own load [-]
    max_steps : the stage ends there in any case; the history then says "not settled"
    gently : steps over which the loads come on evenly, in the first stage of a structure without load. At once they
        overshoot, by twice their elastic settlement undamped, and joints slide that would stick; how far hangs on the
        way, on the axes too, since damping acts by components: 24 of 60 small structures came to rest 2 to 31 %
        elsewhere, over 1000 steps none by more than 1 %. A run says where they slid; a push does it again evenly
    """

    tolerance: float = 1e-6
    max_steps: int = 50_000
    gently: int = 0

    def __post_init__(self) -> None:
        """Check the range."""
        if not 0 <= self.gently < self.max_steps:
            raise InputError(f"Settle: gently must lie in 0 .. max_steps, got {self.gently!r} of {self.max_steps!r}")


@dataclass(frozen=True)
class Hold(Stage):
    """Hold the loads for a number of steps, or a duration [s]."""

    steps: int | None = None
    duration: float | None = None


@dataclass(frozen=True)
class Ramp(Stage):
    """Change the multiplier of the live loads linearly.

    Parameters
    ----------
    to : multiplier at the end [-]
    steps or duration : length of the stage, [-] or [s]
    """

    to: float = 1.0
    steps: int | None = None
    duration: float | None = None

    def __post_init__(self) -> None:
        """Check the target."""
        _finite("Ramp: to", self.to)


@dataclass(frozen=True)
class Tilt(Stage):
    """Turn the weight of all blocks as on a tilting table.

    W (-cos(alpha) z + sin(alpha) d), d = axis x z.

    Other dead loads and live loads stay as they are in the table's axes.

    Parameters
    ----------
    to_deg : tilt angle at the end [deg]
    axis : horizontal axis the table turns about by the right-hand rule, shape (3,)
    """

    to_deg: float = 45.0
    steps: int | None = None
    duration: float | None = None
    axis: tuple[float, float, float] = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        """Check angle and axis."""
        _finite("Tilt: to_deg", self.to_deg)
        _finite("Tilt: axis", self.axis)


@dataclass(frozen=True)
class Drive(Stage):
    """Move degrees of freedom of blocks with given velocities.

    The reaction is recorded (load-displacement curves).

    Parameters
    ----------
    displacement : by block name or number: {"x": 0.01, ...} [m] or [rad], travelled linearly in the stage; the degrees
        of freedom named are held in this stage and released after it unless ``keep``
    keep : hold these degrees of freedom after the stage too
    calm : stand still while the kinetic energy is above this part of the elastic one [-], quasi-static runs only; the
        steps in which it waits come on top of ``steps``. None goes on whatever happens
    """

    displacement: Mapping[int | str, Mapping[str, float]] = field(default_factory=dict)
    steps: int | None = None
    duration: float | None = None
    keep: bool = False
    calm: float | None = None

    def __post_init__(self) -> None:
        """Check what can be checked without a model."""
        for block, moves in self.displacement.items():
            if not isinstance(moves, Mapping):
                raise InputError(f"Drive: moves of block {block!r} must read {{'x': 0.005}} [m, rad], got {moves!r}")
            _finite(f"Drive: displacement of block {block!r}", list(moves.values()))
        if self.calm is not None and not (self.calm > 0.0 and self.duration is None):
            raise InputError(f"Drive: calm must be positive, and the length be given in steps, got {self.calm!r}")

    def twists(self, assembly: Assembly) -> tuple[Array, Flags]:
        """Travel per block, shape (n, 6), and the degrees of freedom it holds."""
        travel = np.zeros((assembly.n_blocks, 6))
        held = np.zeros((assembly.n_blocks, 6), dtype=bool)
        for block, moves in self.displacement.items():
            i = assembly.block_index(block)
            for name, value in moves.items():
                if name not in DEGREES_OF_FREEDOM:
                    raise InputError(f"drive of block {block!r}: unknown degree of freedom {name!r}")
                k = DEGREES_OF_FREEDOM.index(name)
                travel[i, k], held[i, k] = value, True
        if not held.any():
            raise InputError("a Drive stage moves nothing: give displacement={block: {'x': ...}}")
        return travel, held


_ACCELERATIONS = {"m/s2": 1.0, "cm/s2": 1e-2, "mm/s2": 1e-3, "g": GRAVITY}


@dataclass(frozen=True)
class BaseMotion(Stage):
    """Move all held blocks with a recorded ground acceleration.

    The stage is for the dynamic mode only.

    Parameters
    ----------
    acceleration : samples [m/s2], shape (k,) along ``direction``, or (k, 3): x, y and z at once
    sample_step : time between samples [s]; linear between them
    direction : unit vector of the motion, shape (3,); three components have none
    after : what the ground does when the record is over and it still moves. "hold": it stops dead, a blow of its whole
        velocity on everything that stands on it. "coast": it goes on at that velocity in the stages that follow, also
        in a run continued from the history. None: a record that ends with more than a hundredth of its largest velocity
        is refused where another stage follows, and named in the warnings where none does; what is left below that stops

    The displacement of the ground starts from the velocity that an earlier record left it with ("coast").
    """

    acceleration: Sequence[float] | Sequence[Sequence[float]] = ()
    sample_step: float = 0.01
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    after: str | None = None

    def __post_init__(self) -> None:
        """Check what can be checked without a model."""
        choice("BaseMotion: after", self.after, (None, HOLD, COAST))
        if isinstance(self.acceleration, str | Path):
            name = str(self.acceleration)
            raise InputError(f"BaseMotion takes numbers; a file is read by BaseMotion.from_csv({name!r})")
        record = numbers("BaseMotion: acceleration", self.acceleration)
        if not np.isfinite(record).all():
            raise InputError("BaseMotion: the record has samples that are not finite")
        if not record.size or len(record) < 2:
            raise InputError("BaseMotion: a record needs two samples of acceleration and more")
        if record.ndim != 1 and record.shape[1:] != (3,):
            raise InputError(f"BaseMotion: acceleration must have shape (k,) or (k, 3), got {record.shape}")
        positive("BaseMotion: sample_step", self.sample_step)
        if not np.linalg.norm(self.direction) > 0.0:
            raise InputError("BaseMotion: direction must not be zero")
        if record.ndim == 2 and tuple(self.direction) != BaseMotion.direction:
            raise InputError("BaseMotion: three components along x, y and z take no direction; leave it out")

    @classmethod
    def from_csv(
        cls, path: str | Path, *, units: str = "m/s2", scale: float = 1.0, column: int | Sequence[int] = 1,
        **settings: Any,
    ) -> BaseMotion:  # fmt: skip
        """A record from a CSV file.

        Time stands in the first column, acceleration in another. Lines of words are headings.

        Parameters
        ----------
        units : of the acceleration: "m/s2", "cm/s2", "mm/s2" or "g"; time is in seconds
        scale : factor on the whole record [-]
        column : of the acceleration, counted from 0; three of them hold x, y and z, (1, 2, 3)
        settings : ``direction`` and ``after``, see above

        Raises
        ------
        InputError
            For an unknown unit, a line of no numbers below one of numbers, and times that are not equally spaced; it
            names file and line.
        """
        if units not in _ACCELERATIONS:
            raise InputError(f"units must be one of {', '.join(_ACCELERATIONS)}, got {units!r}")
        rows: list[list[float]] = []
        columns = [column] if isinstance(column, int) else list(column)
        for number, line in enumerate(read_text(path).splitlines(), 1):
            cells = split([line], separator(line))
            try:
                rows.append([float(cells[0]), *(float(cells[c]) for c in columns)])
            except (ValueError, IndexError):
                if rows and line.strip():
                    raise InputError(f"{path}, line {number}: no time and acceleration in {line!r}") from None
        if len(rows) < 2:
            raise InputError(f"{path}: no two lines of time, acceleration (or with semicolons or tabs between)")
        table = np.array(rows)
        time, a = table[:, 0], table[:, 1] if len(columns) == 1 else table[:, 1:]
        step = float(np.median(np.diff(time)))
        uneven = np.flatnonzero(np.abs(np.diff(time) - step) > 0.01 * abs(step))
        if len(uneven):
            raise InputError(f"{path}: times must be equally spaced; after {time[uneven[0]]:g} s they are not")
        return cls(tuple((finite("scale", scale) * _ACCELERATIONS[units] * a).tolist()), step, **settings)

    @property
    def units(self) -> Array:
        """Directions of unit length of the components, shape (c, 3)."""
        if np.ndim(self.acceleration) == 2:
            return np.eye(3)
        d = np.asarray(self.direction, dtype=float)
        return (d / np.linalg.norm(d))[None]

    def left_over(self) -> tuple[Array, bool]:
        """Velocity at the end of the record [m/s], shape (3,), and whether it is noticeable.

        That is more than a hundredth of the largest.
        """
        a = self._components
        v = np.cumsum(0.5 * self.sample_step * (a[1:] + a[:-1]), axis=0)
        size = np.linalg.norm(v, axis=1)
        return v[-1] @ self.units, bool(size[-1] > AT_REST * size.max())

    @property
    def _components(self) -> Array:
        """Samples of every component [m/s2], shape (k, c)."""
        a = np.asarray(self.acceleration, dtype=float)
        return a.reshape(len(a), -1)

    def velocity(self, times: Array) -> Array:
        """Ground velocity at times since the stage began [m/s], shape (t, c).

        It is the exact integral of the piecewise linear record.
        """
        a, h = self._components, self.sample_step
        nodes = np.concatenate([np.zeros((1, a.shape[1])), np.cumsum(0.5 * h * (a[1:] + a[:-1]), axis=0)])
        k = np.clip((times / h).astype(int), 0, len(a) - 2)
        r = np.clip(times - k * h, 0.0, h)[:, None]
        return nodes[k] + a[k] * r + 0.5 * (a[k + 1] - a[k]) / h * r * r
