"""What a user should doubt of a fit: its starts and steps, bounds that stopped it, targets missed by too much."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy import stats

from limitmason.arrays import Flags
from limitmason.calibration.least_squares import SAME, Slopes
from limitmason.calibration.objective import Minimum, Objective
from limitmason.calibration.targets import POINT

FAR_OFF = 20.0
"""Measured over fitted, or the reverse, beyond which a unit is asked about."""

_ON_BOUND = 1e-6  # of the width of the bounds: a value that near to one lies on it
_TOO_LARGE = 0.99  # probability: targets are missed by more than their scatter where it leaves the misfit less chance


def strain(objective: Objective, best: Minimum) -> float:
    """How many times their stated scatter the targets are missed by [-].

    It is 1 where the scatter is not stated, or chance explains the misfit; else sqrt(chi2 / (n - p)).

    Parameters
    ----------
    objective : what was asked
    best : the fit
    """
    dof = max(objective.n - len(objective.scale), 1)
    if not objective.known or best.chi2 <= stats.chi2.ppf(_TOO_LARGE, dof):
        return 1.0
    return math.sqrt(best.chi2 / dof)


def on_bound(objective: Objective, best: Minimum) -> Flags:
    """Whether each of the p parameters lies on its lower and on its upper bound, shape (2, p)."""
    scale = objective.scale
    close = _ON_BOUND * (scale.high - scale.low)
    return np.array([best.x - scale.low < close, scale.high - best.x < close])


def asked_beyond(objective: Objective, best: Minimum, slopes: Slopes) -> Flags:
    """Whether the targets ask for values beyond a bound on which a parameter lies, shape (2, p).

    They do where the step to the least misfit by the slopes, bounds left aside, is longer than the resolution. The
    bound then sets the value, not the data.

    Parameters
    ----------
    objective : what was asked
    best : the fit
    slopes : of the residuals there
    """
    step = -np.linalg.lstsq(slopes.central * objective.scale.resolution, best.residuals, rcond=None)[0]
    return np.asarray(on_bound(objective, best) & (np.array([-step, step]) > 1.0))


def fit_warnings(
    objective: Objective, best: Minimum, minima: Sequence[Minimum], rise: float, slopes: Slopes
) -> tuple[str, ...]:
    """What a user should know before trusting a fit.

    Parameters
    ----------
    objective : what was asked, with all points tried
    best : the fit
    minima : where every start ended
    rise : of the sum of squares up to which a point is inside the interval [-]
    slopes : of the residuals at the fit
    """
    out, scale = [], objective.scale
    near = SAME * objective.variance(best)
    if objective.best.chi2 < best.chi2 - near:
        out.append(f"a run for the intervals has a lower misfit, {objective.best.chi2:.3g} for {best.chi2:.3g}: begin "
                   f"from {', '.join(f'{n} {v:.4g}' for n, v in scale.values(objective.best.x).items())}")
    if len(minima) > 1 and sum(m.chi2 - best.chi2 < near for m in minima) < 2:
        out.append(f"only one of {len(minima)} starts ended at this misfit: give more, or see whether the model jumps")
    if not best.converged:
        out.append("the search ended at its limit of steps, not at a minimum")
    apart = [best]
    for m in minima:
        # half-way to a minimum that is the same the sum of squares does not rise
        between = [] if m.chi2 > best.chi2 + rise else [objective.at(0.5 * (m.x + b.x)) for b in apart]
        if between and all(r @ r > best.chi2 + rise for r in between):
            apart.append(m)
            values = ", ".join(f"{n} {v:.4g}" for n, v in scale.values(m.x).items())
            out.append(f"another minimum is as near the targets, {values} (misfit {m.chi2:.3g}): an interval that "
                       "holds both also holds what lies between")
    beyond = asked_beyond(objective, best, slopes)
    for k, name in enumerate(scale.names):
        if on_bound(objective, best)[:, k].any():
            asked = ", and the targets ask for values beyond: the bound sets it, not the data"
            out.append(f"{name} lies on its bound{asked * bool(beyond[:, k].any())}")
    for e, fitted in zip(objective.entries, objective.predicted([best.x])[0].tolist(), strict=True):
        if e.relative and abs(math.log(e.measured / fitted)) > math.log(FAR_OFF):
            times = e.measured / fitted
            what = f"{e.label} of {e.test}" if len({o.test for o in objective.entries}) > 1 else e.label
            out.append(f"{what} is measured {times:.3g} times what the fit gives: are both in one unit?")
    out += _points_of_curves(objective)
    if (times := strain(objective, best)) > 1.0:
        out.append(f"the targets are missed by more than their scatter (misfit {best.chi2:.3g}), so that the intervals "
                   f"hold the true values less often than they say: ask fit.diagnose. Whether a parameter is "
                   f"identified is judged by deviations {times:.3g} times as wide")
    return tuple(out)


def _points_of_curves(objective: Objective) -> list[str]:
    """What is said of each curve of which several points were to be met."""
    read = [(e.test, e.reading.output) for e in objective.entries if e.reading.what == POINT]
    counts = {curve: read.count(curve) for curve in dict.fromkeys(read)}
    return [
        f"{n} points of {output!r} count as so many independent numbers: errors that they share, of the load cell or "
        f"of a gap, are in no interval. A point_scatter {math.sqrt(n):.2g} times as large makes them worth one"
        for (_, output), n in counts.items() if n > 1
    ]
