"""Leave a cause out: how often another name is given, and the margin against it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from limitmason.diagnosis.inference.design import Design, Listed, Names
from limitmason.diagnosis.inference.evidence_by_kind import Evidence, agree, by_kind
from limitmason.diagnosis.inference.fit import BestFit
from limitmason.diagnosis.inference.grid import Grid, at_measured
from limitmason.diagnosis.inference.next_tests import NINE_IN_TEN, distances, reached_at
from limitmason.diagnosis.inference.noise import Draws

_STREAM = 78  # second number of the seed: these draws are others than those of a verdict or a rehearsal
LEAST = 3.0 + NINE_IN_TEN  # the gate's critical distance is near 3 for lists of 10 to 20 causes
PER_CAUSE, ALL = 48, 480  # fewest data sets of each hidden cause, and of all
APART = 2.1  # log-likelihood deficit that a rival reaches with p = 0.02 by chi-square with one degree of freedom
FIT, TREND = 0.005, 0.005  # nominal tail probabilities of scatter and trend below which a name is not given

Excess = Callable[[Sequence[Names], Sequence[BestFit], np.ndarray, np.ndarray], np.ndarray]
Rest = Callable[[str, np.ndarray, float, np.ndarray, Sequence[Evidence]], bool]


@dataclass(frozen=True)
class Missing:
    """What happens on a design when the true cause is missing from the list.

    Parameters
    ----------
    trials : data sets with a visible cause that was taken off the list
    fitted : how many of them one single name fits, alone and without misfit
    named : how many of them a name would be given: margins, rival levers, dose and kinds of data applied
    margins : by name, how far it must beat every smooth model discrepancy, in log-likelihood
    agreed : the same where two kinds of evidence show one size, from the data sets in which they do
    power : by name, share of data sets with that cause, alone and visible, in which its excess reaches the margin

    Notes
    -----
    A quick rehearsal: nominal tail probabilities in place of the bootstrap, single causes only. Where a margin alone
    is counted as a name, 1.6 % are stated and .2 % found.
    ``Study.rehearse(causes, hide="each")`` applies the whole rule.
    """

    trials: int
    fitted: int
    named: int
    margins: Mapping[str, float]
    agreed: Mapping[str, float]
    power: Mapping[str, float]

    @property
    def rate(self) -> float:
        """Share of data sets with a name given although the true cause is not listed."""
        return self.named / self.trials if self.trials else 0.0


def leave_each_out(
    design: Design, known: Design, excess: Excess, rest: Rest, seed: int, *,
    floor: float, agreed: float, share: float, each: float,
) -> Missing:
    """Plant each cause at visible sizes, take it off, and see which name fits.

    Parameters
    ----------
    design : tables and list
    known : the same with the noise that is drawn
    excess : by how much fitted causes beat every model discrepancy, ``excess(names, fits, y, replicate)``, shape
        (causes, b)
    rest : whether the conditions of a name beside its margin hold, ``rest(name, effect, loglik, y, kinds)``
    seed : of noise and measured inputs
    floor : least margin
    agreed : margin where two kinds of evidence show one size
    share, each : largest share of wrong names, of all together and of a single name
    """
    names = [c.name for c in design.causes]
    count = max(PER_CAUSE, -(-ALL // len(names)))  # ALL / names, rounded up
    chances = Draws.make([seed, _STREAM, design.n], n=design.n, k=design.inputs, noise=design.noise, count=count)
    ratio = known.scale / design.scale  # noise that is drawn over the scale of the tables, shape (n,)
    parts = [_planted(design, known, cause, chances, ratio) for cause in design.causes]
    # data sets, one a row: ``count`` of each planted cause
    y = np.concatenate(parts)
    planted = np.repeat(np.arange(len(names)), count)
    replicate = np.tile(chances.replicate * float(np.mean(ratio)) ** 2, len(names))
    # every cause fitted to every data set: log-likelihood, whether it fits, and its lead on every model discrepancy
    fits = design.fits(design.listed, y, replicate=replicate)
    gains, along = np.array([f.loglik for f in fits]), design.trends.along(y)
    good = np.array([_adequate(design, name, f, along) for name, f in zip(design.listed, fits, strict=True)])
    lead = excess(design.listed, fits, y, replicate)
    rows = np.arange(len(y))
    own = lead[planted, rows]  # of the planted cause itself
    # the list without the planted cause: its best name, and whether that fits, far ahead of the second best
    others = gains.copy()
    others[planted, rows] = -np.inf
    best = others.argmax(axis=0)
    reached = others[best, rows]
    others[best, rows] = -np.inf
    alone = (reached - others.max(axis=0) >= APART) & good[best, rows] if len(names) > 1 else np.zeros(len(y), bool)
    wrong = lead[best, rows]
    both = np.zeros_like(alone)  # those in which two kinds of evidence show one size of the name
    held: dict[int, tuple[np.ndarray, tuple[Evidence, ...]]] = {}
    for row in np.flatnonzero(alone & (wrong >= min(floor, agreed))):
        fit, grid = fits[best[row]], design.singles[names[best[row]]]
        effect = grid.effect(design.null, fit.node[[row]], fit.position[[row]])
        residual = y[row] - grid.values_from(fit.node[[row]], fit.position[[row]])[0]
        kinds = by_kind(design, effect, y[row], y[row], residual, float(np.mean(ratio)))
        held[int(row)], both[row] = (effect, kinds), agree(kinds)
    # floors raised until names are seldom given to data whose cause is missing: of all data, and of those that agree
    margins, less = (_margins(names, best[some], wrong[some], len(y), least, share, each)
                     for some, least in ((alone, floor), (both, agreed)))
    limit, lower = (np.array([m[n] for n in names]) for m in (margins, less))
    passing = np.flatnonzero(alone & (wrong >= np.where(both, lower[best], limit[best])))
    named = [rest(names[best[k]], held[k][0], float(gains[best[k], k]), y[k], held[k][1]) for k in map(int, passing)]
    return Missing(
        trials=len(y) if len(names) > 1 else 0, fitted=int(alone.sum()), named=sum(named), margins=margins, agreed=less,
        power={n: float(np.mean(own[planted == i] >= limit[i])) for i, n in enumerate(names)},
    )


def visible(known: Design, cause: Listed) -> list[tuple[float, float]]:
    """Range of visible sizes on each side of the baseline, under a known noise."""
    grid = known.singles[cause.name]
    d = np.sqrt(distances(at_measured(grid), known.null))
    found = ((reached_at(grid, cause, side, d, LEAST), side) for side in cause.sides)
    return [(side if low is None else low, side) for low, side in found]


def position_of(grid: Grid, size: float | None, inputs: np.ndarray) -> np.ndarray:
    """Index along every axis of a grid, with fractions, of a size and inputs.

    What lies beyond the end of an axis gets the index of the end.

    Parameters
    ----------
    size : of the cause; None on the grid of the baseline, which has no axis of sizes
    inputs : measured inputs in standard deviations from their values, shape (k,)
    """
    values = ([] if size is None else [size]) + list(inputs)
    axes = (*grid.sizes, *grid.z)
    return np.array([np.interp(v, a, np.arange(len(a))) for v, a in zip(values, axes, strict=True)])


def _planted(design: Design, known: Design, cause: Listed, chances: Draws, ratio: np.ndarray) -> np.ndarray:
    """Whitened data with one cause planted at visible sizes, shape (draws, n).

    Sizes are evenly spaced, on both sides of the baseline in turn. Noise and inputs are as drawn; ``ratio`` is the
    noise of every row over the stated one.
    """
    grid, ranges = design.singles[cause.name], visible(known, cause)
    out = np.empty_like(chances.errors)
    for k, (error, inputs) in enumerate(zip(chances.errors, chances.inputs, strict=True)):
        low, high = ranges[k % len(ranges)]
        # the golden section fills the range evenly for any number of data sets
        size = low + (high - low) * ((0.5 + 0.618034 * k) % 1.0)
        out[k] = grid.between(position_of(grid, size, inputs)) + ratio * error
    return out


def _adequate(design: Design, names: Names, fit: BestFit, along: np.ndarray) -> np.ndarray:
    """Whether neither scatter nor trend speaks against fits, by nominal tails.

    Parameters
    ----------
    along : data along the trends, shape (b, trends)
    """
    good = design.trend_of(names)(along, fit) <= np.log(max(len(design.trends), 1) / TREND)
    if design.like.known:
        good &= chdtrc(design.n + design.inputs, fit.loss + fit.penalty) >= FIT
    return good


def _margins(
    names: Sequence[str], given: np.ndarray, excess: np.ndarray, trials: int, floor: float, share: float, each: float
) -> dict[str, float]:
    """Margin of every name: the floor, raised until no name is given too often.

    Neither one name nor all together are.

    Parameters
    ----------
    names : causes that may be named
    given : of every data set that got a wrong name, the number of that name, shape (b,)
    excess : its lead there on every model discrepancy, in log-likelihood, shape (b,)
    trials : data sets drawn, also those in which no cause was named
    floor : margin without any wrong name
    share, each : largest share of the data sets with a wrong name, in all and for one name
    """
    margins = {}
    for i, name in enumerate(names):
        reached = np.sort(excess[given == i])[::-1]
        allowed = int(each * trials)  # so many wrong names may pass
        margins[name] = floor if len(reached) <= allowed else max(floor, _above(reached[allowed]))
    limit = np.array([margins[n] for n in names])
    passing = np.sort(excess[excess >= limit[given]])[::-1] if len(given) else np.zeros(0)
    allowed = int(share * trials)
    if len(passing) > allowed:
        least = _above(passing[allowed])
        margins = {n: max(m, least) for n, m in margins.items()}
    return margins


def _above(value: float) -> float:
    """A number just above another, so that what reached that one does not pass."""
    return float(value) + 1e-6 * (1.0 + abs(float(value)))
