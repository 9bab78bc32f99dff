"""Log-likelihood of residuals: Gaussian in log, with the noise known, unknown or estimated from replicates."""

from dataclasses import dataclass

import numpy as np

from limitmason.diagnosis.inference.noise import Noise

SMALLEST_SUM = 1e-18  # keeps the logarithm finite for data that a model fits exactly
FACTORS = 4  # of 1 + r^2 / tau under one logarithm: no overflow for residuals below 1e4 in single precision


@dataclass(frozen=True)
class Likelihood:
    """How a sum of squares becomes a log-likelihood.

    With residuals in units of the stated noise, R their sum of squares, P the sum of squares of the nuisance data,
    nu the degrees of freedom of the replicates and s2 the redrawn replicate variance in stated units::

        known       -(R + P) / 2
        replicates  -(n + nu)/2 log(R + nu s2) - P/2
        unknown     -n/2 log(R) - P/2
        Student     -(tau + 1)/2 sum log(1 + r^2 / tau) - P/2

    Parameters
    ----------
    kind : "known", "replicates" or "unknown"
    dof : nu, 0 unless replicates
    tails : tau of Student errors, None for Gaussian

    Notes
    -----
    The noise is profiled out, not integrated; the bootstrap, not a table, gives the distribution of differences.
    Wrong for errors that are correlated between specimens: leave whole groups out and compare.
    """

    kind: str = "known"
    dof: float = 0.0
    tails: float | None = None

    @classmethod
    def of(cls, noise: Noise) -> "Likelihood":
        """The likelihood that belongs to a noise statement."""
        return cls(noise.kind, float(noise.dof or 0.0), noise.tails)

    @property
    def scale_known(self) -> bool:
        """Whether the scatter can be held against a stated noise, exact or from replicates."""
        return self.kind != "unknown"

    @property
    def quadratic(self) -> bool:
        """Whether the best node is found by one matrix product: known Gaussian noise."""
        return self.kind == "known" and self.tails is None

    def loglik(self, loss, penalty, count, replicate=1.0):
        """Log-likelihood up to a constant that is the same for every model of the same data.

        Parameters
        ----------
        loss : sum of squares of the data, or the Student loss, any shape
        penalty : sum of squares of the nuisance data
        count : number of values in ``loss``
        replicate : redrawn variance of the replicates in stated units
        """
        if self.kind == "known":
            return -0.5 * (loss + penalty)
        total = np.maximum(loss + self.dof * replicate, SMALLEST_SUM)
        return -0.5 * (count + self.dof) * np.log(total) - 0.5 * penalty

    def loss(self, residuals, weights=None):
        """Sum of squares, or of Student terms, over the last axis; a weight of 0 leaves a value out."""
        if weights is not None:
            if self.tails is None:
                return (weights * residuals**2).sum(axis=1)
            return (self.tails + 1.0) * (weights * np.log1p(residuals**2 / self.tails)).sum(axis=1)
        if self.tails is None:
            return np.einsum("...i,...i->...", residuals, residuals)
        return (self.tails + 1.0) * np.log1p(residuals**2 / self.tails).sum(axis=-1)

    def variance(self, loss, count, replicate=1.0, spent: float = 0.0):
        """Noise variance in stated units: 1 when known, else the estimate with ``spent`` parameters taken off."""
        if self.kind == "known":
            return np.ones_like(np.asarray(loss, dtype=float))
        freedom = np.maximum(count + self.dof - spent, 1.0)
        return np.maximum(loss + self.dof * replicate, SMALLEST_SUM) / freedom

    def scatter(
        self, loss: np.ndarray, penalty: np.ndarray | float, replicate: np.ndarray | float = 1.0
    ) -> np.ndarray:  # fmt: skip
        """Statistic of "more scatter than stated": the loss over the (redrawn) replicate variance."""
        return (loss + penalty) / replicate if self.kind == "replicates" else loss + penalty


def student_terms(y, used, nodes, tails) -> np.ndarray:
    """Sum of log(1 + r^2 / tau) over the values used, shape (b, g), by one logarithm for several; to rank nodes."""
    y, scaled, columns = y.astype(np.float32), (used / tails).astype(np.float32), nodes.T.astype(np.float32)
    out = np.zeros((len(y), columns.shape[1]), dtype=np.float32)
    factor = np.ones_like(out)
    for i, column in enumerate(columns):
        term = y[:, i, None] - column
        term *= term
        term *= scaled[:, i, None]
        term += 1.0
        factor *= term
        if i % FACTORS == FACTORS - 1 or i == len(columns) - 1:
            out += np.log(factor)
            factor[...] = 1.0
    return out
