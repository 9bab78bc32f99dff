"""A structure that a push drives, whatever its blocks are made of: it comes to rest, and copies of it are driven."""

import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dem.driving.path import Follower, unit_twist
from dem.driving.push_curve import PushCurve
from dem.model.state import UnstableError
from dem.settings import PushSettings
from dem.stages.resuming import RunStatus, check_same
from dem.stages.run import Run, go
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive


class DrivenStructure(ABC):
    """Blocks of one kind that a push drives.

    Parameters
    ----------
    assembly : what is driven; of lumped units with the joints' series stiffness
    unit, held : twist of the blocks per displacement of 1 m, and the freedoms that the drive holds, shapes (n, 6)
    chosen : settings of the push
    blocks : how they deform, in words
    same : digests by name of what a file of it must have in common with it
    least_steps, tried : of the faster run, and by which the time of a step is measured
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
        """What is driven and how.

        Nothing moves yet.
        """
        self.assembly, self.chosen = assembly, chosen
        self.unit, self.held = unit_twist(drive, assembly)

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
    def digests_of(self, file: Path) -> Mapping[str, str]:
        """What a file says that a run which goes on from it must have in common with it."""

    @abstractmethod
    def begun(self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None) -> Any:
        """Run of a copy along a path in so many steps, from its start or from where a file says that it stood."""

    @abstractmethod
    def steps_of(self, run: Any) -> tuple[float, float]:
        """Number that the first step of a run counts from, and steps that it has taken."""

    @abstractmethod
    def curve_of(self, run: Any, status: RunStatus, steps: int, seconds: float) -> PushCurve:
        """What a run says of the drive."""

    def step_time(self) -> float:
        """Time that a step takes [s], from a few of a copy once they are compiled."""
        self.try_steps(1)
        clock = time.perf_counter()
        self.try_steps(self.tried)
        return (time.perf_counter() - clock) / self.tried

    def check(self, file: Path, same: Mapping[str, str]) -> None:
        """Refuse a file of another push."""
        check_same(file, self.digests_of(file), same)

    def rest(self, file: Path | None) -> None:
        """Come to rest under the dead loads, or take the rest from a file; it is kept there."""
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
        """Drive a copy along a path in so many steps, or on from where a file says that it stood.

        Parameters
        ----------
        path : turning points of the displacement [m]
        same : signature that a file must agree with
        file : checkpoint, written on the way; where it is there the run goes on from it
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
