"""What is known about errors of measured values and inputs, and draws of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from limitmason.checks import numbers, single_number
from limitmason.errors import InputError

DRAWS = 1999  # of the bootstrap; 399 cannot resolve a threshold of 0.005


@dataclass(frozen=True)
class Measured:
    """A nuisance input with its own measurement.

    It is a datum with an error, never a free knob.

    Parameters
    ----------
    value : measured value
    sd : standard deviation of that measurement; 0 takes the value as exact
    bounds : physically possible values; the refit stays within them

    Raises
    ------
    InputError
        For a value or error that is not finite, a negative error, or a value outside the bounds.

    Notes
    -----
    Wrong when the error is understated: the refit then cannot reach the true input and a cause takes the blame.
    """

    value: float
    sd: float
    bounds: tuple[float, float] = (-inf, inf)

    def __post_init__(self) -> None:
        given = numbers("a measured input", (self.value, self.sd))
        if not np.isfinite(given).all() or self.sd < 0:
            raise InputError(f"a measured input needs a finite value and an error of at least 0, got {self}")
        if numbers("bounds of a measured input", self.bounds).shape != (2,):
            raise InputError(f"bounds of a measured input are a lowest and a highest value, got {self.bounds!r}")
        if not self.bounds[0] <= self.value <= self.bounds[1]:
            raise InputError(f"a measured input must lie within its bounds, got {self}")
        if self.sd > 0.0 and self.bounds[0] == self.bounds[1]:
            raise InputError(f"bounds that leave one value leave no error: give sd=0, got {self}")

    def at(self, z: float) -> float:
        """The input ``z`` standard deviations above its measured value."""
        return self.value + z * self.sd

    def reach(self, width: float) -> tuple[float, float]:
        """Range of ``z`` within ``width`` standard deviations and within the bounds."""
        return max(-width, (self.bounds[0] - self.value) / self.sd), min(width, (self.bounds[1] - self.value) / self.sd)


@dataclass(frozen=True)
class Noise:
    """Relative error of the measured values, Gaussian in their logarithm.

    Parameters
    ----------
    sd : relative standard deviation (0.04 is 4 %), one number or one per specimen; None when unknown
    dof : degrees of freedom of the replicates that ``sd`` was estimated from; None, or infinity, takes it as known
    by_row : whether ``sd`` is that of every row on its own scale, relative or in the unit of the value
    misread : of rows that say yes or no (1 or 0), the rate of misreading, negative where 1 is predicted; 0 of measured
        rows

    Raises
    ------
    InputError
        For a standard deviation that is not positive, degrees of freedom below 1, or options that do not go together.

    Notes
    -----
    Wrong when stated too small: at 5 % true against 4 % stated about a third of clean data sets raise an alarm.
    """

    sd: float | Sequence[float] | None = None
    dof: float | None = None
    _: KW_ONLY
    by_row: bool = False
    misread: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.sd is not None:
            sd = numbers("noise", self.sd)
            if sd.ndim > 1 or not np.all(np.isfinite(sd)) or np.any(sd <= 0):
                raise InputError(f"noise must be a positive relative standard deviation, got {self.sd!r}")
            if np.any(sd >= 1.0) and not self.by_row:
                raise InputError(f"noise is relative: 0.04 is 4 %; got {self.sd!r}, which is 100 % or more")
            object.__setattr__(self, "sd", float(sd) if sd.ndim == 0 else tuple(float(s) for s in sd))
        if self.dof is not None:
            single_number("degrees of freedom of the noise", self.dof, endless=True)
            if self.dof == inf and self.sd is not None:  # of so many replicates it is known
                object.__setattr__(self, "dof", None)
        if self.dof is not None and (self.sd is None or not self.dof >= 1):
            raise InputError("degrees of freedom need a standard deviation from replicates and must be at least 1")

    @classmethod
    def unknown(cls) -> Noise:
        """Nothing is known: the scatter about the fit is the only measure of noise."""
        return cls()

    @classmethod
    def from_replicates(cls, values: Sequence[float], configurations: Sequence) -> Noise:
        """Noise from repeated tests of one configuration.

        sd^2 = sum over repeats of (log v - mean)^2 / dof.

        Parameters
        ----------
        values : measured values, positive, shape (n,)
        configurations : label of the configuration of each value; dof = values in repeated ones minus their number

        Raises
        ------
        InputError
            Where no configuration has two different values, where labels and values differ in number, and for values
            that are not positive.

        Notes
        -----
        Wrong where the repeats share an error that the configurations do not share, such as one batch of blocks: the
        noise is then too small.
        """
        given = numbers("values", list(values))
        if not (given > 0.0).all():
            raise InputError(f"values must be positive: their logarithms are taken, got {given.min():g}")
        logs = np.log(given)
        labels = [str(c) for c in configurations]
        if len(labels) != len(logs):
            raise InputError(f"{len(labels)} configurations are given for {len(logs)} values")
        total, dof = 0.0, 0
        for name in dict.fromkeys(labels):  # a set would add them up in another order in every process
            part = logs[[c == name for c in labels]]
            total += float(((part - part.mean()) ** 2).sum())
            dof += len(part) - 1
        if dof < 1 or total <= 0.0:
            raise InputError("the noise cannot be taken from replicates: no configuration has two different values")
        return cls(float(np.sqrt(total / dof)), float(dof))

    @property
    def kind(self) -> str:
        """Known, "replicates" or "unknown"."""
        if self.sd is None:
            return "unknown"
        return "known" if self.dof is None else "replicates"

    def scale(self, n: int) -> np.ndarray:
        """Standard deviation per specimen, shape (n,).

        Ones when unknown.

        Raises
        ------
        InputError
            When one value per specimen is given and the number does not match.
        """
        if self.sd is None:
            return np.ones(n)
        sd = np.asarray(self.sd, dtype=float)
        if sd.ndim and len(sd) != n:
            raise InputError(f"noise is given for {len(sd)} specimens, but there are {n}")
        return np.broadcast_to(sd, (n,)).copy()

    def for_others(self) -> Noise:
        """This statement for other specimens.

        Where the standard deviation differs from one specimen to the other, it becomes their mean.
        """
        if not isinstance(self.sd, tuple):
            return self
        return Noise(float(np.mean(self.sd)), self.dof, by_row=self.by_row)

    def about(self, predicted: np.ndarray) -> Noise:
        """The statement with the sign of every rate of misreading.

        The sign is negative where 1 is predicted, shape (n,).
        """
        if self.misread is None:
            return self
        return replace(self, misread=tuple(np.where(predicted > 0.5, -1.0, 1.0) * np.abs(self.misread)))

    def errors(self, rng: np.random.Generator, count: int, n: int) -> np.ndarray:
        """Errors of n rows in units of their noise, shape (count, n).

        Of measured rows they are normal. A row that says yes or no is misread at a rate r: its reading less its mean
        is 1 - r or -r, mirrored where 1 is predicted, and its standard deviation sqrt(r (1 - r)).
        """
        normal = rng.standard_normal((count, n))
        if self.misread is None:
            return normal
        rate = np.abs(self.misread)  # 0 for a measured row, for which another number stands in below
        # the same normal numbers choose which are misread, so that one seed means one set of errors
        wrong = normal > ndtri(1.0 - np.where(rate > 0.0, rate, 0.5))
        seen = np.sign(self.misread) * np.where(wrong, 1.0 - rate, -rate)
        return np.where(rate > 0.0, seen / np.sqrt(np.where(rate > 0.0, rate * (1.0 - rate), 1.0)), normal)

    def of_some(self, chosen: Sequence[bool] | np.ndarray) -> Noise:
        """The statement for the specimens that are ``chosen``, boolean, shape (n,)."""
        if not isinstance(self.sd, tuple):
            return self
        sd, misread = (None if v is None else tuple(s for s, keep in zip(v, chosen, strict=True) if keep)
                       for v in (self.sd, self.misread))
        return Noise(sd, self.dof, by_row=self.by_row, misread=misread)

    def __str__(self) -> str:
        if self.sd is None:
            return "unknown"
        sd = np.asarray(self.sd, dtype=float)
        text = f"{100 * float(sd.mean()):.3g} %" + (" on average" if sd.ndim else "")
        text = "as stated for every number" if self.by_row else text
        if self.dof is not None:
            text += f", from replicates with {self.dof:g} degrees of freedom"
        return text


def of_residuals(sd: float) -> Noise:
    """A noise that residuals tell, of any size: a factor of e and more (1) is no per cent misread for a share."""
    return Noise(sd, by_row=True)


class Drawn(NamedTuple):
    """Data sets drawn from a model: n whitened values and k inputs, (b, n), (b, k).

    ``replicate`` is the redrawn variance of the replicates over the stated one, shape (b,).
    """

    values: np.ndarray
    inputs: np.ndarray
    replicate: np.ndarray


@dataclass(frozen=True)
class Draws:
    """Standard errors shared by all models of a study, for the same chances.

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
    def make(cls, seed: int | Sequence[int], n: int, k: int, noise: Noise, count: int = DRAWS) -> Draws:
        """All draws from one seed.

        Parameters
        ----------
        n, k, count : values and measured inputs of a data set, and number of draws
        """
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
        return Drawn(fitted + sd * self.errors[rows], z + self.inputs[rows], sd**2 * self.replicate[rows])

    def columns(self, chosen: np.ndarray) -> Draws:
        """These draws for some of the specimens, by numbers or flags ``chosen``."""
        return Draws(self.errors[:, chosen], self.inputs, self.replicate)
