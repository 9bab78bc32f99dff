"""When a search is to end: the one thing that every search is told of its time and asks."""

import math
import time

LEAST_SECONDS = 0.1
"""Time that a solver gets at least, where its search is all but over [s]: chosen."""


class Deadline(float):
    """Reading of ``time.perf_counter`` [s] after which no further program begins."""

    @classmethod
    def after(cls, seconds: float | None) -> "Deadline":
        """The deadline so many seconds from now; None is never."""
        return NEVER if seconds is None else cls(time.perf_counter() + seconds)

    @property
    def left(self) -> float:
        """Time until then [s], 0 once it has passed."""
        return max(self - time.perf_counter(), 0.0)

    @property
    def passed(self) -> bool:
        """Whether no further program is to begin."""
        return time.perf_counter() > self

    def at_least(self, seconds: float = LEAST_SECONDS) -> float:
        """Time that a program may take: what is left, but no less than some seconds [s]."""
        return max(self.left, seconds)

    def within(self, seconds: float) -> "Deadline":
        """This deadline, or the one so many seconds from now where that comes first."""
        return min(self, Deadline.after(seconds))


NEVER = Deadline(math.inf)
"""The deadline of a search without one."""
