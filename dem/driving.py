"""What a push is asked for, of blocks of any kind: the way to go, and the twist of the driven blocks."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from limitmason.errors import InputError
from limitmason.model import Assembly
from limitmason.model.stages import Drive

Array = NDArray[np.float64]

SLOWER = 3
"""The second run is so many times slower."""


def turning_points(to: float | Sequence[float]) -> list[float]:
    """Displacements at which the path of a push turns or ends [m], checked."""
    path = [float(v) for v in np.atleast_1d(np.asarray(to, dtype=float))]
    ends = np.diff([0.0, *path])
    if not len(path) or not np.isfinite(path).all() or not (np.abs(ends) > 0.0).all():
        raise InputError(f"to must be a displacement [m] or a path of different ones, got {to!r}")
    return path


def unit_twist(drive: Drive, assembly: Assembly) -> tuple[Array, NDArray[np.bool_]]:
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
    if drive.steps is not None or drive.duration is not None:
        raise InputError("the drive of a push is a direction: leave out its steps and duration, and give steps to push")
    return travel / size, held


def named(drive: Drive, label: str) -> str:
    """The label of a push; by default the blocks that it drives."""
    return label or ", ".join(str(b) for b in drive.displacement)


def widest_spacing(joints: Iterable[Iterable[Array]]) -> float:
    """Largest distance between neighbouring points of a joint along its axes [m], from their places along each."""
    far = 0.0
    for axes in joints:
        for along in axes:
            far = max(far, float(np.diff(np.unique(np.round(along, 9))).max(initial=0.0)))
    return far
