"""Path of a push: its turning points, its direction as a twist of the blocks, and who is told how far it has come."""

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from dem.stages.run import Progress
from limitmason.arrays import Array, Flags
from limitmason.checks import numbers
from limitmason.errors import InputError
from limitmason.model import Assembly
from limitmason.model.stages import Drive

SLOWER = 3
"""The second run is so many times slower."""


class Follower:
    """Tells who listens what part of a push is done and how long the rest will take.

    Parameters
    ----------
    progress : who listens
    run : number of the run, of one or two speeds
    before, count, total : steps of the runs before this one, of this one, and of all
    """

    def __init__(self, progress: Progress | None, run: int, before: int, count: int, total: int) -> None:
        self.progress, self.run, self.before, self.count, self.total = progress, run, before, count, total
        self.begin(0.0)

    def begin(self, origin: float, done: float = 0.0) -> None:
        """A run begins, or is taken up: it counts steps from ``origin`` and has taken so many of its own."""
        self.origin, self.begun, self.clock = origin, done, time.perf_counter()

    def __call__(self, sampled: Mapping[str, Any]) -> object:
        """Pass a sample to the user's progress function, with the part done and the time left.

        A run counts steps from its ``origin``; ``begun`` of its ``count`` were there when it was taken up, and
        ``before`` steps belong to runs before it, out of ``total``.
        """
        if self.progress is None:
            return None
        done = min(float(sampled["step"]) - self.origin, self.count)
        own = done - self.begun
        pace = (time.perf_counter() - self.clock) / own if own > 0.0 else float("nan")
        done += self.before
        return self.progress(
            {**sampled, "run": self.run, "part": done / self.total, "time left": pace * (self.total - done)}
        )


def turning_points(to: float | Sequence[float]) -> list[float]:
    """Displacements at which the path of a push turns or ends [m], checked."""
    path = [float(v) for v in np.atleast_1d(numbers("to [m]", to))]
    ends = np.diff([0.0, *path])
    if not len(path) or not np.isfinite(path).all() or not (np.abs(ends) > 0.0).all():
        raise InputError(f"to must be a displacement [m] or a path of different ones, got {to!r}")
    return path


def unit_twist(drive: Drive, assembly: Assembly) -> tuple[Array, Flags]:
    """Twist of the blocks per displacement of 1 m, and the freedoms the drive holds, shapes (n, 6)."""
    if not isinstance(drive, Drive):
        raise InputError(f"drive must be a limitmason Drive such as Drive({{'plate': {{'z': -1.0}}}}), got {drive!r}")
    travel, held = drive.twists(assembly)
    size = float(np.linalg.norm(travel[:, :3], axis=1).max())
    if not size > 0.0:
        raise InputError("the drive has no direction: give a translation, such as {'plate': {'z': -1.0}}")
    taken = held & assembly.held
    if taken.any():
        name = assembly.blocks[int(np.flatnonzero(taken.any(axis=1))[0])].name
        raise InputError(f"block {name!r} is held by a support in a degree of freedom that the drive moves")
    extra = [name for name in ("steps", "duration", "stop_when_moved") if getattr(drive, name) is not None]
    if extra:
        raise InputError(f"the drive of a push is a direction: leave out its {', '.join(extra)}; steps= is of push")
    return travel / size, held


def widest_spacing(joints: Iterable[Iterable[Array]]) -> float:
    """Largest distance between neighbouring points of a joint along its axes [m], from their places along each."""
    far = 0.0
    for axes in joints:
        for along in axes:
            far = max(far, float(np.diff(np.unique(np.round(along, 9))).max(initial=0.0)))
    return far
