"""Size of a cause with an interval from its profile likelihood, by the bootstrap."""

from dataclasses import dataclass

import numpy as np

from limitmason.diagnosis.inference.design import Design
from limitmason.diagnosis.inference.grid import Grid
from limitmason.diagnosis.inference.noise import Draws
from limitmason.diagnosis.inference.verdict import Tested

LEVEL = 0.95  # of intervals of sizes
CHI2 = 3.841458820694124  # its 95 % point with one degree of freedom
CALIBRATION = 699  # draws


@dataclass(frozen=True)
class Estimate:
    """Fitted size of a cause.

    Parameters
    ----------
    size : best fit
    low, high : 95 % interval; a bound of the cause where the interval ends there
    at_bound : whether the best fit lies on a bound that is not the baseline
    """

    size: float
    low: float
    high: float
    at_bound: bool = False


def estimate(design: Design, tested: Tested, y: np.ndarray, draws: Draws) -> dict[str, Estimate]:
    """Estimates of all causes of one explanation.

    The interval holds the sizes whose profile log-likelihood ratio stays below a limit. That is its own bootstrap
    quantile at the best fit, for a pair the chi-square value, widened for unknown noise.

    Parameters
    ----------
    design : independent noise, and tables of the explanation
    tested : explanation with its fit
    y : whitened data, shape (n,)
    draws : standard errors
    """
    grid = design.grid(tested.names)
    by_name = {c.name: c for c in design.causes}
    out = {}
    for axis, name in enumerate(tested.names):
        limit = _limit(design, tested, draws) if len(tested.names) == 1 else _wilks(design, len(tested.names))
        size = tested.sizes[axis]
        low, high = _interval(design, grid, axis, y, size, float(tested.fit.loglik[0]), limit)
        cause = by_name[name]
        width = cause.bounds[1] - cause.bounds[0]
        at_bound = any(abs(size - b) < 1e-6 * width for b in cause.sides)  # but for rounding
        out[name] = Estimate(size, min(low, size), max(high, size), at_bound)
    return out


def _interval(
    design: Design, grid: Grid, axis: int, y: np.ndarray, size: float, best: float, limit: float
) -> tuple[float, float]:
    """Ends of the 95 % interval of a size, where the profile crosses its limit.

    Parameters
    ----------
    design, grid : noise, and table of the explanation
    axis : of the size in the grid
    size, best : best size and its log-likelihood
    limit : root of twice the log-likelihood by which an end is worse, from :func:`_limit`
    y : whitened values, shape (n,)
    """
    profile = np.array([float(design.fit(g, y).loglik[0]) for g in grid.without_axis(axis)])
    nodes = grid.sizes[axis]
    # the root of the deficit is nearly linear in the size, so that a line between nodes finds the crossing
    root = np.sqrt(2.0 * np.maximum(best - profile, 0.0))
    ends = []
    for side in (-1.0, 1.0):
        rows = np.flatnonzero(side * (nodes - size) > 0)
        rows = rows if side > 0 else rows[::-1]
        at, value = np.concatenate([[size], nodes[rows]]), np.concatenate([[0.0], root[rows]])
        beyond = np.flatnonzero(value >= limit)
        if not len(beyond):  # the interval ends at the bound of the cause
            ends.append(float(at[-1]))
            continue
        i = int(beyond[0])
        part = (limit - value[i - 1]) / max(value[i] - value[i - 1], 1e-30)
        ends.append(float(at[i - 1] + part * (at[i] - at[i - 1])))
    return ends[0], ends[1]


def _limit(design: Design, tested: Tested, draws: Draws) -> float:
    """Root of twice the deficit of the true size that 95 of 100 draws stay below.

    It replaces 1.96 of a normal estimate, which is too small where noise is estimated or a size is at its bound.
    """
    rows = slice(0, min(CALIBRATION, len(draws.errors)))
    grid = design.grid(tested.names)
    y, z, replicate = design.drawn(tested.names, tested.fit, draws, rows)
    fixed = grid.at_size(float(tested.fit.position[0, 0]))
    free = design.fit(grid, y, z, replicate).loglik
    held = design.fit(fixed, y, z, replicate).loglik
    return float(np.sqrt(2.0 * max(np.quantile(free - held, LEVEL), 0.0)))


def _wilks(design: Design, spent: int) -> float:
    """Root of twice the log-likelihood by which an interval's end is worse.

    It is that of one parameter by chi-square. Where the noise is estimated it is larger, as ``spent`` fitted sizes are
    taken off the number of values.
    """
    if design.like.known:
        return float(np.sqrt(CHI2))
    free = max(design.n + design.like.dof - spent, 1.0)
    return float(np.sqrt((design.n + design.like.dof) * np.log1p(CHI2 * (1.0 + 2.0 / free) / free)))
