"""Parametric bootstrap with sequential stopping."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import bdtr, bdtrc

from limitmason.diagnosis.inference.noise import Noise

DRAWS = 1999  # 399 cannot resolve a threshold of 0.005
BATCHES = (99, 299, 699, 1299, 1999)
DOUBT = 1e-3  # a threshold counts as passed when chance would reverse it less often than this


Drawn = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Values, measured inputs and replicate variances."""


@dataclass(frozen=True)
class Draws:
    """Standard errors shared by all models of a study, so that they are compared on the same chances.

    Parameters
    ----------
    errors : of the values, in units of the noise, shape (b, n)
    inputs : of the measured inputs, in standard deviations, shape (b, k)
    replicate : variance of the replicates over the true one, shape (b,)
    """

    errors: np.ndarray
    inputs: np.ndarray
    replicate: np.ndarray

    @classmethod
    def make(cls, seed: int | Sequence[int], n: int, k: int, noise: Noise, count: int = DRAWS) -> "Draws":
        """All draws from one seed."""
        rng = np.random.default_rng(seed)
        errors = noise.errors(rng, count, n)
        replicate = np.ones(count) if noise.dof is None else rng.chisquare(noise.dof, count) / noise.dof
        return cls(errors, rng.standard_normal((count, k)), replicate)

    def data(self, fitted: np.ndarray, z: np.ndarray, sd: float, rows: slice) -> Drawn:
        """Values, measured inputs and replicate variances drawn from a fitted model.

        Parameters
        ----------
        fitted, z : predictions and inputs of the fit, shapes (n,) and (k,)
        sd : noise of the fit in stated units; the replicate variance is drawn in the same units
        rows : which draws
        """
        return fitted + sd * self.errors[rows], z + self.inputs[rows], sd**2 * self.replicate[rows]

    def columns(self, chosen: np.ndarray) -> "Draws":
        """The same draws for some of the specimens."""
        return Draws(self.errors[:, chosen], self.inputs, self.replicate)


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
        """Value from which a draw counts as having reached the observed one."""
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


def run(
    tally: Tally,
    draw: Callable[[slice], Mapping[str, np.ndarray]],
    enough: Callable[[Tally], bool],
    count: int,
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
