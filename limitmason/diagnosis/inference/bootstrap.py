"""Bootstrap p values: draws counted, batch by batch, until the answer is settled."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import bdtr, bdtrc

BATCHES = (99, 299, 699, 1299, 1999)  # of draws, after each of which an answer may be settled
DOUBT = 1e-3  # a threshold counts as passed when chance would reverse it less often than this


@dataclass
class Tally:
    """How often each statistic of the draws reached the observed one.

    Parameters
    ----------
    observed : by name
    thresholds : by name; p below it is a rejection
    """

    observed: Mapping[str, float]
    thresholds: Mapping[str, float]
    reached: dict[str, int] = field(default_factory=dict)
    draws: int = 0

    def add(self, drawn: Mapping[str, np.ndarray]) -> None:
        """Count a batch."""
        for name, values in drawn.items():
            self.reached[name] = self.reached.get(name, 0) + int(np.count_nonzero(values >= self.least(name)))
        self.draws += len(next(iter(drawn.values())))

    def least(self, name: str) -> float:
        """Value from which a draw has reached the observed one: that less rounding."""
        return self.observed[name] - 1e-9 * (1.0 + abs(self.observed[name]))

    def p(self, name: str) -> float:
        """Bootstrap p, (1 + reached) / (1 + draws)."""
        return (1 + self.reached.get(name, 0)) / (1 + self.draws)

    def rejected(self, name: str) -> bool:
        """Whether p lies below the threshold."""
        return self.p(name) < self.thresholds[name]

    def settled(self, name: str) -> bool:
        """Whether more draws would hardly change that answer."""
        k, m, alpha = self.reached.get(name, 0), self.draws, self.thresholds[name]
        return bool(bdtr(k, m, alpha) < DOUBT or (k > 0 and bdtrc(k - 1, m, alpha) < DOUBT))


def add_draws(
    tally: Tally, draw: Callable[[slice], Mapping[str, np.ndarray]], enough: Callable[[Tally], bool], count: int,
    least: int = 0,
) -> Tally:
    """Add batches of draws until the answer is settled or all are used.

    Parameters
    ----------
    tally : what is counted; changed in place
    draw : statistics of some of the draws, by name
    enough : whether the answer is settled
    count, least : most and fewest draws
    """
    start = 0
    for stop in [b for b in BATCHES if b < count] + [count]:
        tally.add(draw(slice(start, stop)))
        start = stop
        if stop >= least and enough(tally):
            break
    return tally


def share_of(reached: np.ndarray) -> float:
    """Bootstrap p of a statistic, from which draws reached it."""
    return float((1.0 + np.count_nonzero(reached)) / (1.0 + len(reached)))
