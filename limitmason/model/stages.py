"""Stages of loading: settle, ramp, tilt, driven blocks, hold; base motion stands in its own file.

Each is plain frozen data.

Loads and their factors are kept from stage to stage: a stage changes only what it names. A test is stated in them, and
a method that steps through time follows them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.checks import count, finite, not_negative, switch
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.input import read_vector
from limitmason.model.support import DEGREES_OF_FREEDOM


@dataclass(frozen=True)
class Damping:
    """How motion is braked.

    Parameters
    ----------
    local : Cundall's local damping, F - local |F| sign(v) along each axis of a block's largest joint, or of space for
        zones; takes momentum from free flight
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
        switch("Damping: kinetic", self.kinetic)
        switch("Damping: combined", self.combined)
        local, adaptive = finite("Damping: local", self.local), finite("Damping: adaptive", self.adaptive)
        if not (0.0 <= local <= 0.9 and adaptive >= 0.0):
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
        finite("Servo: force", self.force)
        switch("Servo: parallel", self.parallel)
        if not 0.0 < finite("Servo: gain", self.gain) <= 0.5:
            raise InputError(f"a servo needs a finite force and 0 < gain <= 0.5, got {self.force!r} and {self.gain!r}")


@dataclass(frozen=True, kw_only=True)
class Stage:
    """What all stages share.

    Parameters
    ----------
    damping : None takes the simulation's own
    stop_when_moved : end the stage when a block has moved this far since the stage began [m], against the ground where
        that moves
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
    """Hold the loads until force and moment are small in four samples in a row.

    Parameters
    ----------
    tolerance : largest unbalanced force and moment over every block's own load [-]
    max_steps : the stage ends there in any case; the history then says "not settled", as it does where fewer than four
        samples lie in them
    gently : steps over which the loads come on evenly, in the first stage of a structure without load. At once they
        overshoot, by twice their elastic settlement undamped, and joints slide that would stick; how far hangs on the
        way, and on its direction against the block's joints: 24 of 60 small structures came to rest 2 to 31 %
        elsewhere, over 1000 steps none by more than 1 %. A run says where they slid; a push does it again evenly
    """

    tolerance: float = 1e-6
    max_steps: int = 50_000
    gently: int = 0

    def __post_init__(self) -> None:
        """Check the range."""
        not_negative("Settle: tolerance", self.tolerance)
        if not 0 <= count("Settle: gently", self.gently, 0) < count("Settle: max_steps", self.max_steps):
            raise InputError(f"Settle: gently must lie in 0 .. max_steps, got {self.gently!r} of {self.max_steps!r}")


@dataclass(frozen=True)
class Hold(Stage):
    """Hold the loads.

    Parameters
    ----------
    steps : length of the stage [-]; or
    duration : its length [s], of dynamic runs alone
    """

    steps: int | None = None
    duration: float | None = None


@dataclass(frozen=True)
class Ramp(Stage):
    """Change the multiplier of the live loads linearly.

    Parameters
    ----------
    to : multiplier at the end [-]
    steps : length of the stage [-]; or
    duration : its length [s], of dynamic runs alone
    """

    to: float = 1.0
    steps: int | None = None
    duration: float | None = None

    def __post_init__(self) -> None:
        """Check the target."""
        finite("Ramp: to", self.to)


@dataclass(frozen=True)
class Tilt(Stage):
    """Turn the weight of all blocks as on a tilting table.

    W (-cos(alpha) z + sin(alpha) d), d = axis x z.

    Other dead loads and live loads stay as they are in the table's axes.

    Parameters
    ----------
    to_deg : tilt angle at the end [deg]
    steps : length of the stage [-]; or
    duration : its length [s], of dynamic runs alone
    axis : horizontal axis the table turns about by the right-hand rule, shape (3,); a table that an earlier stage
        turned about another one goes to this end by the shortest way
    """

    to_deg: float = 45.0
    steps: int | None = None
    duration: float | None = None
    axis: tuple[float, float, float] = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        """Check angle and axis."""
        finite("Tilt: to_deg", self.to_deg)
        read_vector("Tilt: axis", self.axis)


@dataclass(frozen=True)
class Drive(Stage):
    """Move degrees of freedom of blocks with given velocities.

    The reaction is recorded (load-displacement curves).

    Parameters
    ----------
    displacement : by block name or number: {"x": 0.01, ...} [m] or [rad], travelled linearly in the stage; the degrees
        of freedom named are held in this stage and released after it unless ``keep``
    steps : length of the stage [-]; or
    duration : its length [s], of dynamic runs alone
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
        if not isinstance(self.displacement, Mapping):
            raise InputError(f"Drive: displacement must be a mapping of blocks to moves, got {self.displacement!r}")
        for block, moves in self.displacement.items():
            if not isinstance(moves, Mapping):
                raise InputError(f"Drive: moves of block {block!r} must read {{'x': 0.005}} [m, rad], got {moves!r}")
            for name, value in moves.items():
                finite(f"Drive: displacement of block {block!r} along {name!r}", value)
        switch("Drive: keep", self.keep)
        if self.calm is not None and not (finite("Drive: calm", self.calm) > 0.0 and self.duration is None):
            raise InputError(f"Drive: calm must be positive, and the length be given in steps, got {self.calm!r}")

    def twists(self, assembly: Assembly) -> tuple[Array, Flags]:
        """Travel of every block, and flags of the degrees of freedom that the drive holds.

        Travel is in m and rad; both have shape (n, 6), in the order of ``DEGREES_OF_FREEDOM``.

        Parameters
        ----------
        assembly : of n blocks, of which the drive names some

        Raises
        ------
        InputError
            For an unknown block or degree of freedom, a block that is named twice, and a drive that moves nothing.
        """
        travel = np.zeros((assembly.n_blocks, 6))
        held = np.zeros((assembly.n_blocks, 6), dtype=bool)
        for block, moves in self.displacement.items():
            i = assembly.block_index(block)
            if held[i].any():
                raise InputError(f"a Drive names block {assembly.blocks[i].name!r} twice: put its moves together")
            for name, value in moves.items():
                if name not in DEGREES_OF_FREEDOM:
                    raise InputError(f"drive of block {block!r}: unknown degree of freedom {name!r}")
                k = DEGREES_OF_FREEDOM.index(name)
                travel[i, k], held[i, k] = value, True
        if not held.any():
            raise InputError("a Drive stage moves nothing: give displacement={block: {'x': ...}}")
        return travel, held
