"""Random samples: a Latin hypercube, what many runs say with its sampling error, and when to stop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from limitmason.arrays import Array
from limitmason.checks import count, single_number
from limitmason.errors import InputError
from limitmason.storage.frozen import ReadOnly
from limitmason.study.table import Table


def latin_hypercube(width: int, samples: int, seed: int) -> Array:
    """Random points in the unit cube, one in each of n slices of every coordinate [-].

    ``width`` is the number of coordinates, n that of samples, and the shape (n, width).
    """
    if width == 0:  # which scipy refuses
        return np.zeros((samples, 0))
    return np.asarray(qmc.LatinHypercube(d=width, seed=np.random.default_rng(seed)).random(samples))


@dataclass(frozen=True, eq=False)
class Running(ReadOnly):
    """Mean and spread of a column over its first n runs.

    Parameters
    ----------
    column : name
    n : number of finite values so far, 2 to N, shape (k,)
    mean, deviation : sample mean and standard deviation (n - 1), shape (k,)
    missing : runs without a finite value, which are in no average
    """

    column: str
    n: Array
    mean: Array
    deviation: Array
    missing: int

    @property
    def variation(self) -> Array:
        """Coefficient of variation [-], shape (k,); NaN where the mean is zero, which has none."""
        nothing = np.full(len(self.mean), np.nan)
        return np.divide(self.deviation, np.abs(self.mean), out=nothing, where=self.mean != 0.0)

    @property
    def mean_error(self) -> Array:
        """Standard error of the mean over the mean, CoV / sqrt(n) [-], shape (k,)."""
        return np.asarray(self.variation / np.sqrt(self.n))

    @property
    def variation_error(self) -> Array:
        """Standard error of the CoV over the CoV itself [-], shape (k,).

        It is sqrt((1 + 2 CoV^2) / (2 n)) if the values are normal.
        """
        return np.asarray(np.sqrt((1.0 + 2.0 * self.variation**2) / (2.0 * self.n)))

    def __str__(self) -> str:
        """Mean and spread with their sampling errors, in one line."""
        missing = f"; {self.missing} runs gave no value" if self.missing else ""
        spread = f"{100 * self.variation[-1]:.4g} % +- {100 * self.variation_error[-1]:.2g} % of it"
        return (
            f"{self.column}: mean {self.mean[-1]:.5g} +- {100 * self.mean_error[-1]:.2g} %, CoV {spread}, "
            f"{int(self.n[-1])} runs{missing}"
        )


def running(table: Table, column: str) -> Running:
    """Mean and spread of a column as the runs come, in the order of the samples.

    Parameters
    ----------
    table : a row per run
    column : name of a column of numbers; rows without a finite one are left out

    Raises
    ------
    InputError
        For a column that the table does not have, and with fewer than two finite values.
    """
    value = _numbers(table, column)
    kept = value[np.isfinite(value)]
    if len(kept) < 2:
        raise InputError(f"column {column!r} has {len(kept)} finite values: a spread needs two")
    n = np.arange(1.0, len(kept) + 1.0)
    # sums about the first value, so that a small spread of large numbers keeps its digits; a spread needs two values
    shifted = kept - kept[0]
    total, square = np.cumsum(shifted), np.cumsum(shifted**2)
    variance = np.maximum(square - total**2 / n, 0.0)[1:] / (n[1:] - 1.0)
    return Running(
        column=column, n=n[1:], mean=(kept[0] + total / n)[1:], deviation=np.sqrt(variance),
        missing=len(value) - len(kept),
    )


@dataclass(frozen=True)
class Stop:
    """Rule by which a Monte Carlo study has enough samples: both sampling errors are small.

    Parameters
    ----------
    column : name of the column of numbers that is watched; looked for in the table at the first look
    mean : largest standard error of its mean, relative [-]; infinite where it does not count
    variation : the same of its CoV: 0.041 needs about 300 samples
    every : samples between two looks
    least : samples with a finite value before the study may stop

    Raises
    ------
    InputError
        For errors that are no positive numbers, ``every`` below 1 and ``least`` below 2.

    Notes
    -----
    A rule that looks many times stops a little early: the true errors are somewhat larger than those asked for.
    """

    column: str
    mean: float = 0.01
    variation: float = 0.05
    every: int = 20
    least: int = 40

    def __post_init__(self) -> None:
        """Check errors and counts, and keep counts as int."""
        for name in ("mean", "variation"):
            single_number(name, value := getattr(self, name), endless=True)
            if not value > 0.0:
                raise InputError(f"errors of a stopping rule must be positive, got {name} = {value!r}")
        for name, least in (("every", 1), ("least", 2)):
            object.__setattr__(self, name, count(name, getattr(self, name), least))

    def __call__(self, table: Table) -> bool:
        """Whether the table has enough samples; a column that it lacks is an InputError."""
        if np.isfinite(_numbers(table, self.column)).sum() < self.least:
            return False
        so_far = running(table, self.column)
        return bool(so_far.mean_error[-1] <= self.mean and so_far.variation_error[-1] <= self.variation)


def _numbers(table: Table, column: str) -> Array:
    """A column of a table as numbers."""
    if column not in table.columns:
        raise InputError(f"the table has no column {column!r}; columns: {', '.join(table.columns)}")
    found = table[column]
    if found.dtype == object:
        raise InputError(f"column {column!r} holds no numbers")
    return np.asarray(found, dtype=float)
