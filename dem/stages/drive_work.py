"""Work of a drive step by step: its mean over ten steps now, and the largest such mean since the last sample."""

from dataclasses import dataclass

import numpy as np

from limitmason.arrays import Array

TOGETHER = 10
"""Steps whose mean counts: a joint that breaks sends waves through the blocks, whose crest is a third too high."""

SHOCK = 10
"""Means at the start of a stage that are never the largest: where the pace changes at once, masses push back."""


@dataclass
class DriveWork:
    """Mean work of a drive per step [J], over ten steps each, in the order of a stage.

    Its force is this work over the travel of a step. A step in which the drive waits counts for nothing.

    Parameters
    ----------
    begun, count : work of the ten steps that are not over yet [J], and how many of them are done
    last : mean of the last ten; 0 before there are ten
    largest, since : largest mean since the last sample, and steps from the middle of its ten to now; 0 where there
        is none
    tens : how many times ten steps are done
    """

    begun: float = 0.0
    count: int = 0
    last: float = 0.0
    largest: float = 0.0
    since: float = 0.0
    tens: int = 0

    def add(self, works: Array) -> None:
        """Go on by the works of further steps, shape (steps,)."""
        first = min(TOGETHER - self.count, len(works))
        whole = (len(works) - first) // TOGETHER * TOGETHER
        self.since += len(works) * (self.since > 0.0)
        self.begun, self.count = self.begun + float(works[:first].sum()), self.count + first
        if self.count < TOGETHER:
            return
        means = np.append(self.begun, works[first : first + whole].reshape(-1, TOGETHER).sum(axis=1)) / TOGETHER
        left = works[first + whole :]
        self.begun, self.count, self.last = float(left.sum()), len(left), float(means[-1])
        first, self.tens = max(SHOCK - self.tens, 0), self.tens + len(means)
        if first >= len(means):
            return
        best = first + int(np.argmax(means[first:]))
        if not self.since or means[best] > self.largest:
            self.largest = float(means[best])
            self.since = len(left) + (len(means) - 1 - best) * TOGETHER + 0.5 * TOGETHER

    def sampled(self) -> dict[str, float]:
        """What a sample keeps of it; the largest is looked for anew from there on."""
        row = {"drive work": self.last, "largest drive work": self.largest, "steps since largest": self.since}
        self.largest = self.since = 0.0
        return row
