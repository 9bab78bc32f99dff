"""Fragility: the probability of failure over an intensity, from runs that failed or did not, with its interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from limitmason.arrays import Array
from limitmason.checks import finite, numbers
from limitmason.errors import InputError, NotConverged
from limitmason.storage.frozen import ReadOnly
from limitmason.study.table import Table

ROUNDS = 100
"""Most steps of Fisher scoring; twenty are many."""

_FAR = 30.0  # standard deviations at which a probit is cut: the density there is 1e-196, far from underflow
_LONGEST = 2.0  # standard deviations: a longer step would leave where the likelihood is known
_SETTLED = 1e-12  # of the coefficients: a step below it is rounding


@dataclass(frozen=True, eq=False)
class Fragility(ReadOnly):
    """Lognormal fragility curve, P(failure | x) = Phi(ln(x / median) / dispersion).

    Parameters
    ----------
    intensity, failed : names of the columns
    median : intensity at which half of the runs fail
    dispersion : standard deviation of its logarithm [-]
    median_interval, dispersion_interval : at ``level``; an end is 0 or infinite where the runs do not bound it
    level : confidence of all intervals [-]
    runs : that count
    failures : those of them that failed
    missing : those without an answer
    coefficients : of the probit a + b ln(x), shape (2,)
    covariance : of the coefficients, by the expected information, shape (2, 2)
    """

    intensity: str
    failed: str
    median: float
    dispersion: float
    median_interval: tuple[float, float]
    dispersion_interval: tuple[float, float]
    level: float
    runs: int
    failures: int
    missing: int
    coefficients: Array
    covariance: Array

    def probability(self, at: ArrayLike) -> Array:
        """Probability of failure at intensities [-], of their shape."""
        u = _logarithm(at)
        return np.asarray(stats.norm.cdf(self.coefficients[0] + self.coefficients[1] * u))

    def band(self, at: ArrayLike) -> tuple[Array, Array]:
        """Low and high end of the probability of failure at each intensity [-]."""
        u = _logarithm(at)
        c = self.covariance
        probit = self.coefficients[0] + self.coefficients[1] * u
        wide = _quantile(self.level) * np.sqrt(c[0, 0] + 2.0 * c[0, 1] * u + c[1, 1] * u**2)
        return np.asarray(stats.norm.cdf(probit - wide)), np.asarray(stats.norm.cdf(probit + wide))

    def __str__(self) -> str:
        """Median and dispersion with their intervals."""
        (low, high), (less, more) = self.median_interval, self.dispersion_interval
        missing = f", {self.missing} without an answer" if self.missing else ""
        return (
            f"{self.failed} over {self.intensity}: median {self.median:.4g} ({low:.4g} to {high:.4g}), dispersion "
            f"{self.dispersion:.3g} ({less:.3g} to {more:.3g}), {100 * self.level:g} % intervals; "
            f"{self.failures} of {self.runs} runs{missing}"
        )


def fragility(table: Table, intensity: str, failed: str, *, level: float = 0.9) -> Fragility:
    """Lognormal fragility curve of largest likelihood, with its interval.

    Parameters
    ----------
    table : a row per run, from :func:`sweep` or :func:`monte_carlo`
    intensity : column of positive numbers, such as the largest ground acceleration
    failed : column of True and False, or 1 and 0; rows without either do not count
    level : of the intervals [-]

    Raises
    ------
    InputError
        For columns that the table does not have, intensities that are not positive, runs that all failed or all stood,
        and failures that grow rarer with the intensity.
    NotConverged
        Where no run that stood was shaken harder than one that failed: the dispersion is then not to be told.

    Notes
    -----
    Every run counts by its own intensity (Baker 2015, Earthquake Spectra 31(1), 579-599). The median's interval holds
    the intensities at which the band of the curve holds one half. Intervals rest on the normal approximation of the
    estimate; below some 20 failures or 20 stands they are too narrow. They say what the number of runs leaves open, not
    how good records and model are.
    """
    if not 0.0 < finite("level", level) < 1.0:
        raise InputError(f"level must lie between 0 and 1, got {level!r}")
    if lost := [c for c in (intensity, failed) if c not in table.columns]:
        raise InputError(f"the table has no column {lost[0]!r}; columns: {', '.join(table.columns)}")
    x, y = (numbers(f"column {c!r}", [np.nan if v is None else v for v in table[c]]) for c in (intensity, failed))
    kept = np.isfinite(x) & np.isfinite(y)
    if not np.isin(y[kept], (0.0, 1.0)).all():
        raise InputError(f"column {failed!r} must hold True and False, or 1 and 0")
    if not (x[kept] > 0.0).all():
        raise InputError(f"column {intensity!r} must be positive: its logarithm is taken")
    u, fell = np.log(x[kept]), y[kept] > 0.0
    if fell.all() or not fell.any():
        raise InputError(f"{int(fell.sum())} of {len(fell)} runs failed: a curve needs some of both")
    if not np.ptp(u) > 0.0:
        raise InputError(f"all runs have {intensity} = {np.exp(u[0]):.4g}: a curve needs several intensities")
    if u[fell].max() <= u[~fell].min():
        raise InputError(f"{failed} grows rarer with {intensity}: that is no intensity of this failure")
    # runs that separate at one intensity: the likelihood grows without end as the dispersion goes to zero
    if u[fell].min() >= u[~fell].max():
        raise NotConverged(
            f"all runs above {intensity} = {np.exp(u[fell].min()):.4g} failed and none below "
            f"{np.exp(u[~fell].max()):.4g}: the median lies between, the dispersion needs more runs there"
        )
    # P(failed) = Phi(a + b ln x): median exp(-a / b), dispersion 1 / b
    coefficients, covariance = _probit(u, fell)
    a, b = coefficients
    if not b > 0.0:
        raise InputError(f"{failed} grows rarer with {intensity}: that is no intensity of this failure")
    z = _quantile(level)
    # 1 / b at both ends of the interval of b, without end where b may be zero
    steep = z * float(np.sqrt(covariance[1, 1]))
    return Fragility(
        intensity=intensity, failed=failed, median=float(np.exp(-a / b)), dispersion=float(1.0 / b),
        median_interval=_median_interval(coefficients, covariance, z),
        dispersion_interval=(float(1.0 / (b + steep)), float(1.0 / (b - steep)) if b > steep else np.inf), level=level,
        runs=int(kept.sum()), failures=int(fell.sum()), missing=int((~kept).sum()), coefficients=coefficients,
        covariance=covariance,
    )


def _logarithm(at: ArrayLike) -> Array:
    """Natural logarithm of intensities, of their shape; refuses what is not positive."""
    intensity = numbers("intensities", at)
    if not (intensity > 0.0).all():
        raise InputError(f"intensities must be positive, got {intensity.min():g}")
    return np.asarray(np.log(intensity))


def _quantile(level: float) -> float:
    """Standard errors from the middle to either end of a two-sided interval [-]."""
    return float(stats.norm.ppf(0.5 * (1.0 + level)))


def _probit(u: Array, fell: Array) -> tuple[Array, Array]:
    """Coefficients a, b of the probit a + b u of largest likelihood, and covariance.

    Fisher scoring: steps by the information expected, shapes (2,) and (2, 2).

    Parameters
    ----------
    u : logarithm of the intensity of every run, shape (n,)
    fell : whether the structure fell, shape (n,)
    """
    # in standard units both coefficients are near 1 and nearly independent: steps are short, no digits are lost
    centre, spread = u.mean(), u.std()
    rows = np.column_stack([np.ones(len(u)), (u - centre) / spread])
    # begin as if the intensity did not matter
    now = np.array([stats.norm.ppf(fell.mean()), 0.0])
    for _ in range(ROUNDS):
        # far out the density underflows to zero, and the information would be singular
        probit = np.clip(rows @ now, -_FAR, _FAR)
        log_density = stats.norm.logpdf(probit)
        # d ln L / d probit of those that fell and those that stood
        up, down = np.exp(log_density - stats.norm.logcdf(probit)), np.exp(log_density - stats.norm.logsf(probit))
        # step = I^-1 d ln L / d coefficients, cut to the longest allowed
        information = (rows * (up * down)[:, None]).T @ rows
        step = np.linalg.solve(information, rows.T @ np.where(fell, up, -down))
        now = now + step * min(1.0, _LONGEST / float(np.abs(step).max() + 1e-300))
        if np.abs(step).max() <= _SETTLED * (1.0 + np.abs(now).max()):
            # from standard units to those of u: a + b (u - centre) / spread
            back = np.array([[1.0, -centre / spread], [0.0, 1.0 / spread]])
            return back @ now, back @ np.linalg.inv(information) @ back.T
    raise NotConverged("the likelihood of the fragility curve was not maximised: its runs hardly overlap")


def _median_interval(coefficients: Array, covariance: Array, z: float) -> tuple[float, float]:
    """Lowest and highest intensity at which |a + b u| stays within z standard errors.

    The ends are the roots of (a + b u)^2 = z^2 (c_aa + 2 c_ab u + c_bb u^2), u the logarithm of the intensity. They are
    0 and infinite where the slope b may be zero.

    Parameters
    ----------
    coefficients : a and b, shape (2,)
    covariance : of them, shape (2, 2)
    z : number of standard errors
    """
    (a, b), c = coefficients, covariance
    # square u^2 + 2 middle u + rest = 0
    square, middle, rest = b * b - z * z * c[1, 1], a * b - z * z * c[0, 1], a * a - z * z * c[0, 0]
    if not square > 0.0:  # the slope may be zero: every intensity is possible
        return 0.0, np.inf
    root = np.sqrt(max(middle * middle - square * rest, 0.0))
    return float(np.exp((-middle - root) / square)), float(np.exp((-middle + root) / square))
