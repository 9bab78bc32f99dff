"""How a sum of squares becomes a log-likelihood, by what is known of the noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.diagnosis.inference.noise import Noise

SMALLEST_SUM = 1e-18  # keeps the logarithm finite for data that a model fits exactly


@dataclass(frozen=True)
class Likelihood:
    """How a sum of squares becomes a log-likelihood.

    With residuals in units of the stated noise, R their sum of squares, P the sum of squares of the nuisance data,
    nu the degrees of freedom of the replicates and s2 the redrawn replicate variance in stated units::

        known       -(R + P) / 2
        replicates  -(n + nu)/2 log(R + nu s2) - P/2
        unknown     -n/2 log(R) - P/2

    Parameters
    ----------
    kind : "known", "replicates" or "unknown"
    dof : nu, 0 unless replicates

    Notes
    -----
    The noise is profiled out, not integrated; the bootstrap, not a table, gives the distribution of differences.
    Wrong for errors that specimens share: leave whole groups out and compare.
    """

    kind: str = "known"
    dof: float = 0.0

    @classmethod
    def of(cls, noise: Noise) -> Likelihood:
        """The likelihood that belongs to a noise statement."""
        return cls(noise.kind, float(noise.dof or 0.0))

    @property
    def known(self) -> bool:
        """Whether the noise is known, so that no variance is estimated."""
        return self.kind == "known"

    def loglik(self, loss: Any, penalty: Array | float, count: Array | float, replicate: Array | float = 1.0) -> Any:
        """Log-likelihood up to a constant that all models of the same data share.

        Parameters
        ----------
        loss : sum of squares of the data, any shape
        penalty : sum of squares of the nuisance data
        count : number of values in ``loss``
        replicate : redrawn variance of the replicates in stated units
        """
        if self.known:
            return -0.5 * (loss + penalty)
        total = np.maximum(loss + self.dof * replicate, SMALLEST_SUM)
        return -0.5 * (count + self.dof) * np.log(total) - 0.5 * penalty

    def loss(self, residuals: Array, weights: Array | None = None) -> Array:
        """Sum of squares over the last axis.

        A weight of 0 leaves a value out.
        """
        if weights is not None:
            return (weights * residuals**2).sum(axis=1)
        return np.einsum("...i,...i->...", residuals, residuals)

    def variance(
        self, loss: Array | float, count: Array | float, replicate: Array | float = 1.0, spent: float = 0.0
    ) -> Array:
        """Noise variance in stated units, 1 if known, of the shape of ``loss``.

        Else it is (loss + dof replicate) / (count + dof - spent).

        Parameters
        ----------
        loss : sum of squares of the data, any shape
        count : number of values in it
        replicate : redrawn variance of the replicates in stated units
        spent : number of fitted parameters
        """
        if self.known:
            return np.ones_like(np.asarray(loss, dtype=float))
        freedom = np.maximum(count + self.dof - spent, 1.0)
        return np.maximum(loss + self.dof * replicate, SMALLEST_SUM) / freedom

    def log_score(self, residuals: Array, variance: Array | float) -> Array:
        """Log predictive density of whitened residuals, up to a constant, shape (n,)."""
        return -0.5 * (np.log(variance) + residuals**2 / variance)
