"""A structure that a push drives, whatever its blocks are made of: its path, how it rests, and driven copies of it."""

import time
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dem.driving.push_curve import PushCurve
from dem.model.state import UnstableError
from dem.settings import PushSettings
from dem.stages.resuming import RunStatus, check_same
from dem.stages.run import Progress, Run, go
from limitmason.arrays import Array, Flags
from limitmason.checks import listener, numbers
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive

SLOWER = 3
"""The second run is so many times slower."""


class Follower:
    """Tells who listens what part of a push is done and how long the rest will take.

    Parameters
    ----------
    progress : who listens
    run : number of the run, of one or two speeds
    before : steps of the runs before this one
    count : steps of this one
    total : steps of all
    """

    def __init__(self, progress: Progress | None, run: int, before: int, count: int, total: int) -> None:
        listener("progress", progress, "a sample")
        self.progress, self.run, self.before, self.count, self.total = progress, run, before, count, total
        self.begin(0.0)

    def begin(self, origin: float, done: float = 0.0) -> None:
        """Begin a run that counts steps from ``origin`` and has ``done`` so many."""
        self.origin, self.begun, self.clock = origin, done, time.perf_counter()

    def __call__(self, sampled: Mapping[str, Any]) -> object:
        """Pass a sample on with the part done [-] and the time left [s].

        ``sampled`` is what was recorded, by name, and its "step". A run counts steps from its ``origin``; ``begun`` of
        its ``count`` were there when it was taken up, and ``before`` steps belong to runs before it, out of ``total``.
        """
        if self.progress is None:
            return None
        # a run that waits for calm, or in shorter steps, takes more of them than it was to
        done = min(float(sampled["step"]) - self.origin, self.count)
        since = done - self.begun  # by this process, whose clock runs
        pace = (time.perf_counter() - self.clock) / since if since > 0.0 else float("nan")
        done += self.before
        return self.progress(
            {**sampled, "run": self.run, "part": done / self.total, "time left": pace * (self.total - done)}
        )


def turning_points(to: float | Sequence[float]) -> list[float]:
    """Displacements at which the path of a push turns or ends [m], checked.

    ``to`` is one or several, each counted from the start.
    """
    given = np.atleast_1d(numbers("to [m]", to))
    path = given.ravel().tolist()
    ends = np.diff([0.0, *path])
    if given.ndim > 1 or not len(path) or not np.isfinite(path).all() or not (np.abs(ends) > 0.0).all():
        raise InputError(f"to must be a displacement [m] or a path of different ones, got {to!r}")
    return path


def check_once(drive: Drive, chosen: PushSettings) -> None:
    """Refuse a damping or calm that stands in the drive and, otherwise, in the settings too."""
    for name in ("damping", "calm"):
        one, other = getattr(drive, name), getattr(chosen, name)
        if one is not None and other is not None and one != other:
            raise InputError(f"{name} is {one!r} in the drive and {other!r} in the settings: give one of them")


def unit_twist(drive: Drive, assembly: Assembly) -> tuple[Array, Flags]:
    """Twists of the blocks per 1 m of a drive, and freedoms that it holds, (n, 6).

    A drive of a push is a direction alone: one with a length of its own, or on freedoms that are held, is refused.
    """
    if not isinstance(drive, Drive):
        raise InputError(f"drive must be a limitmason Drive such as Drive({{'plate': {{'z': -1.0}}}}), got {drive!r}")
    travel, held = drive.twists(assembly)
    # 1 m is the translation of the block that moves farthest
    size = float(np.linalg.norm(travel[:, :3], axis=1).max())
    if not size > 0.0:
        raise InputError("the drive has no direction: give a translation, such as {'plate': {'z': -1.0}}")
    taken = held & assembly.held
    if taken.any():
        name = assembly.blocks[int(np.flatnonzero(taken.any(axis=1))[0])].name
        raise InputError(
            f"block {name!r} is held by a support in a degree of freedom that the drive moves: leave it out of fixed=, "
            "and the drive holds it; a support that moves under the structure is a Drive of dem.simulate, after Settle"
        )
    extra = [name for name in ("steps", "duration", "stop_when_moved") if getattr(drive, name) is not None]
    if extra:
        raise InputError(f"the drive of a push is a direction: leave out its {', '.join(extra)}; steps= is of push")
    return travel / size, held


def widest_spacing(joints: Iterable[Iterable[Array]]) -> float:
    """Largest distance between neighbouring points of any joint along its axes [m].

    ``joints`` gives for each of them, and along each of its axes, the places of its points [m].
    """
    far = 0.0
    for axes in joints:
        for along in axes:
            places = np.unique(np.round(along, 9))  # points of one row lie at one place: told apart from 1 nm on
            far = max(far, float(np.diff(places).max(initial=0.0)))
    return far


class DrivenStructure(ABC):
    """Blocks of one kind that a push drives.

    Parameters
    ----------
    assembly : what is driven; of lumped units with the joints' series stiffness
    unit : twist of the blocks per displacement of 1 m, shape (n, 6)
    held : freedoms that the drive holds, shape (n, 6)
    chosen : settings of the push
    blocks : how they deform, in words
    same : digests by name of what a file of it must have in common with it
    least_steps : of the faster run
    tried : steps by which the time of a step is measured
    to_settle : slowest motions in which it comes to rest, about; 0 where settling has an end of its own
    least_samples : of a run that flew apart, from which it is a curve
    """

    blocks: str
    same: Mapping[str, str]
    least_steps: int
    tried: int
    least_samples: int
    to_settle = 0.0

    def __init__(self, assembly: Assembly, drive: Drive, loads: Loads | None, chosen: PushSettings) -> None:
        """Take what is driven, under dead ``loads`` or self weight where None."""
        self.assembly, self.chosen = assembly, chosen
        self.unit, self.held = unit_twist(drive, assembly)
        check_once(drive, chosen)

    @property
    @abstractmethod
    def period(self) -> float:
        """Steps of the slowest motion."""

    @abstractmethod
    def contrast(self) -> str:
        """What makes its motion slow, in words."""

    @abstractmethod
    def try_steps(self, count: int) -> None:
        """Take steps of a copy."""

    @abstractmethod
    def come_to_rest(self) -> None:
        """Come to rest under the dead loads."""

    @abstractmethod
    def keep_rest(self, file: Path) -> None:
        """Write the state at rest to a file."""

    @abstractmethod
    def take_rest(self, file: Path) -> None:
        """Take the state at rest from a file."""

    @abstractmethod
    def begun(self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None) -> Any:
        """Run of a copy along a path, from its start or from where a file says it stood.

        Parameters
        ----------
        path : turning points of the displacement [m]
        steps : of the whole path
        same : digests by name of what a file of this run must have in common with it
        file : where it stood; None begins it
        """

    @abstractmethod
    def steps_of(self, run: Any) -> tuple[float, float]:
        """Number that the first step of a run counts from, and steps that it has taken."""

    @abstractmethod
    def curve_of(self, run: Any, status: RunStatus, steps: int, seconds: float) -> PushCurve:
        """Curve of a run.

        ``status`` is how it ended, ``steps`` those that it was to take, ``seconds`` what it took [s].
        """

    def step_time(self) -> float:
        """Time that a step takes [s], from a few of a copy once they are compiled."""
        self.try_steps(1)
        clock = time.perf_counter()
        self.try_steps(self.tried)
        return (time.perf_counter() - clock) / self.tried

    def check(self, file: Path, same: Mapping[str, str]) -> None:
        """Refuse a file of another push."""
        check_same(file, same)

    def rest(self, file: Path | None) -> None:
        """Come to rest under the dead loads, and keep that in a file, or read it there."""
        if file is not None and file.exists():
            self.check(file, self.same)
            self.take_rest(file)
            return
        self.come_to_rest()
        if file is not None:
            self.keep_rest(file)

    def drive(
        self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None, follow: Follower
    ) -> PushCurve:
        """Drive a copy along a path, or on from where a file says that it stood.

        Parameters
        ----------
        path : turning points of the displacement [m]
        steps : of the whole path
        same : signature that a file must agree with
        file : checkpoint, written on the way; where it is there the run goes on from it
        follow : told of every sample
        """
        clock, before = time.perf_counter(), file if file is not None and file.exists() else None
        if before is not None:
            self.check(before, same)
        run: Run = self.begun(path, steps, same, before)
        follow.begin(*self.steps_of(run))
        try:
            status = go(run, progress=follow, checkpoint=file)
        except UnstableError as error:
            # a block that has fallen out may end a run whose curve was there before
            if run.samples < self.least_samples:
                raise
            status = RunStatus.UNSTABLE
            run.note(f"the run ended early: {error}")
        if file is not None:
            run.save(file, status)
        return self.curve_of(run, status, steps, time.perf_counter() - clock)
