"""Before and between tests: what a design tells apart, and what to test next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from limitmason.checks import choice
from limitmason.diagnosis.inference.design import Design, Listed, Names
from limitmason.diagnosis.inference.fit import fits
from limitmason.diagnosis.inference.grid import Grid, at_measured
from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError

KNOWN = Likelihood()
CLEAR = 25.0  # d2 at which a cause is named in 98 of 100 data sets
TWIN = 1.0  # d2 below which two causes cannot be told apart: one standard deviation of the noise
SEEN = 9.0  # d2 from the baseline from which a cause is visible: three standard deviations
REFERENCE = 36.0  # d2 from the baseline at which causes are compared
NINE_IN_TEN = 1.2816  # standard normal quantile
MANY = 100  # tests of a quantity, beyond which one of another is not compared
REJECTED = 2.326  # distance, in standard deviations, at which a rival is rejected in half of the data sets (p = 0.02)


@dataclass(frozen=True)
class Confusable(Displayed):
    """Squared distance d2 from every cause to every other.

    The other and the measured inputs are refitted.

    Parameters
    ----------
    names : causes
    sizes : sizes at which each is compared, one on each side of the baseline that its bounds leave
    seen : larger d2 from the baseline at these sizes
    d2 : shape (c, c), row: true cause, column: rival
    """

    names: tuple[str, ...]
    sizes: Mapping[str, tuple[float, ...]]
    seen: Mapping[str, float]
    d2: np.ndarray

    def __str__(self) -> str:
        return self.report()

    @property
    def twins(self) -> tuple[tuple[str, str], ...]:
        """Pairs of visible causes that this design cannot tell apart (d2 < 1 one way)."""
        out = []
        for i, a in enumerate(self.names):
            for j, b in enumerate(self.names[:i]):
                # either one as the true cause, the other as its rival
                visible = [d for d, name in ((self.d2[i, j], a), (self.d2[j, i], b)) if self.seen[name] >= SEEN]
                if visible and min(visible) < TWIN:
                    out.append((b, a))
        return tuple(out)

    @property
    def invisible(self) -> tuple[str, ...]:
        """Causes that stay below d2 = 9 from the baseline within their bounds."""
        return tuple(n for n in self.names if self.seen[n] < SEEN)

    def nearest(self, name: str) -> tuple[str, float]:
        """Nearest rival of a cause and its d2.

        Raises
        ------
        InputError
            For a cause that is not on the list, or is alone on it.
        """
        choice("name", name, self.names)
        if len(self.names) < 2:
            raise InputError(f"{name!r} is alone on the list and has no rival: give a list of two causes or more")
        row = self.d2[self.names.index(name)]
        best = int(np.argmin(np.where(np.arange(len(row)) == self.names.index(name), np.inf, row)))
        return self.names[best], float(row[best])

    def table(self) -> list[dict]:
        """One row per cause: size, d2 from the baseline, nearest rival and its d2."""
        rows = []
        for name in self.names:
            rival, d2 = self.nearest(name) if len(self.names) > 1 else ("", float("nan"))
            rows.append(
                {"cause": name, "sizes": self.sizes[name], "d2_baseline": self.seen[name], "rival": rival, "d2": d2}
            )
        return rows

    def report(self) -> str:
        """The table as text, then twins and invisible causes."""
        width = max(map(len, ("cause", *self.names)))
        lines = [
            "Distance of each cause to its nearest rival on this design (d2 in noise units, after refitting the rival",
            "and the measured inputs; 25 and more: named in 98 of 100 data sets, below 1: twins)",
            f"{'cause':<{width}}  {'d2 baseline':>11}  {'d2 rival':>8}  nearest rival",
        ]
        for row in self.table():
            lines.append(f"{row['cause']:<{width}}  {row['d2_baseline']:11.1f}  {row['d2']:8.2f}  {row['rival']}")
        twins = "; ".join(" and ".join(p) for p in self.twins) or "none"
        return "\n".join([*lines, f"Twins: {twins}", f"Invisible here: {', '.join(self.invisible) or 'none'}"])


@dataclass(frozen=True)
class NextTests:
    """Suggested specimens, best first.

    Parameters
    ----------
    indices : positions in the pool
    specimens : the specimens themselves
    reason : what they are chosen for
    pairs : ordered pairs (true, rival) that they separate
    before, after : smallest d2 over these pairs without and with them; NaN where no pair is separated
    quantities : what to measure on each; () where there is one quantity
    costs : of each; () where there is one quantity
    chance : expected chance of a verdict without and with them: that the true one of the explanations in question is
        left alone, or identified where one is left already; NaN where none is in question
    worth : tests of each quantity that one of the best quantity is worth; infinity for more than ``MANY``
    """

    indices: tuple[int, ...]
    specimens: tuple
    reason: str
    pairs: tuple[tuple[str, str], ...] = ()
    before: float = float("nan")
    after: float = float("nan")
    quantities: tuple[str, ...] = ()
    costs: tuple[float, ...] = ()
    chance: tuple[float, float] = (float("nan"), float("nan"))
    worth: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        told = [f"{self.reason}: specimens {self.listed(0)} of the pool", *self.expected]
        return "; ".join(told)

    def listed(self, first: int) -> str:
        """Numbers in the pool, counted from ``first``, each with what to measure."""
        what = [f" ({q})" for q in self.quantities] or [""] * len(self.indices)
        return ", ".join(f"{i + first}{q}" for i, q in zip(self.indices, what, strict=True))

    @property
    def expected(self) -> list[str]:
        """What the tests would bring, and what one of a quantity is worth in others."""
        out = [f"smallest d2 {self.before:.1f} -> {self.after:.1f}"] if self.pairs else []
        if np.isfinite(self.chance[1]):
            cost = f" for a cost of {sum(self.costs):g}" if self.costs else ""
            out.append(f"expected chance of a verdict {100 * self.chance[0]:.0f} -> {100 * self.chance[1]:.0f} %{cost}")
        if len(self.worth) > 1:
            best = min(self.worth, key=lambda q: self.worth[q])
            others = [f"more than {MANY} tests of {q}" if w > MANY else f"{w:.0f} of {q}"
                      for q, w in self.worth.items() if q != best]
            out.append(f"one test of {best} is worth {', '.join(others)}")
        return out


def distances(truth: np.ndarray, rival: Grid, z: np.ndarray | None = None) -> np.ndarray:
    """Squared distance d2 of predictions to a rival after refitting it.

    d2 = min over rival sizes and inputs of |truth - rival|^2 + |inputs - measured|^2, in units of the noise.

    Parameters
    ----------
    truth : whitened predictions, shape (b, n)
    rival : grid
    z : measured inputs that the truth would give, shape (b, k); None is zeros
    """
    truth = np.atleast_2d(truth)
    z = np.zeros((len(truth), len(rival.z))) if z is None else z
    (best,) = fits([rival], truth, z, KNOWN)
    return best.loss + best.penalty


def confusable(design: Design) -> Confusable:
    """Distances between all causes of a design with known noise.

    Each cause is taken at the first size that is clearly visible (d2 of ``REFERENCE``), or else at its bound.
    """
    names = tuple(c.name for c in design.causes)
    d2 = np.full((len(names), len(names)), np.inf)
    sizes: dict[str, tuple[float, ...]] = {}
    seen: dict[str, float] = {}
    for i, cause in enumerate(design.causes):
        grid = design.singles[cause.name]
        curve = at_measured(grid)
        far = distances(curve, design.null)
        picks = []  # node that is compared on each side of the baseline
        for side in cause.sides:
            rows = outward(grid, cause, side)[1:]
            reached = rows[far[rows] >= REFERENCE]
            picks.append(int(reached[0]) if len(reached) else int(rows[-1]))
        visible = [p for p in picks if far[p] >= SEEN] or picks
        for j, rival in enumerate(names):
            d2[i, j] = 0.0 if i == j else float(distances(curve[visible], design.singles[rival]).min())
        sizes[cause.name] = tuple(float(grid.sizes[0][p]) for p in picks)
        seen[cause.name] = float(far[picks].max())
    return Confusable(names=names, sizes=sizes, seen=seen, d2=d2)


def detectable(
    design: Design, critical_gain: float, seen: Callable[[np.ndarray], np.ndarray] | None = None
) -> dict[str, tuple[float | None, ...]]:
    """Smallest size of each cause, per side, that raises an alarm nine times in ten.

    A cause at distance d from the refitted baseline gains (d + N(0, 1))^2 / 2 in log-likelihood; it is seen when this
    passes the gate's critical gain. None where the bounds end before.

    Parameters
    ----------
    design : with a known noise
    critical_gain : log-likelihood gain over the whole list that noise alone reaches with the probability of the gate
    seen : of predictions with effects, shape (b, n), the distance that nine in ten data sets reach in a second test
        that they must pass [standard deviations], shape (b,)

    Notes
    -----
    An approximation to first order in the noise; the trends and the scatter may raise an alarm earlier.
    """
    least = np.sqrt(2.0 * max(critical_gain, 0.0))
    out = {}
    for cause in design.causes:
        grid = design.singles[cause.name]
        curve = at_measured(grid)
        d = np.sqrt(distances(curve, design.null)) - NINE_IN_TEN
        d = d if seen is None else np.minimum(d, seen(curve))
        out[cause.name] = tuple(reached_at(grid, cause, side, d, least) for side in cause.sides)
    return out


def outward(grid: Grid, cause: Listed, side: float) -> np.ndarray:
    """Numbers of the size nodes from the baseline to one bound, ``side``, of a cause."""
    away = (grid.sizes[0] - cause.baseline) * np.sign(side - cause.baseline)
    rows = np.flatnonzero(away >= 0)
    return rows[np.argsort(away[rows])]


def reached_at(grid: Grid, cause: Listed, side: float, d: np.ndarray, least: float) -> float | None:
    """Smallest size towards a bound at which a distance reaches a value, or None.

    Parameters
    ----------
    grid : table of the cause
    side : the bound
    d : distance of every size node, shape (nodes,); between nodes it is linear
    least : value to be reached, in the unit of ``d``
    """
    rows = outward(grid, cause, side)
    reach = np.maximum.accumulate(d[rows])
    return float(np.interp(least, reach, grid.sizes[0][rows])) if reach[-1] >= least else None


class Truth(NamedTuple):
    """Predictions of an explanation that is taken as true.

    Parameters
    ----------
    tested : of the rows that were measured, in units of their noise, shape (rows,)
    pool : of the rows of the pool, likewise
    inputs : measured inputs, in standard deviations from their values, shape (k,)
    """

    tested: np.ndarray
    pool: np.ndarray
    inputs: np.ndarray


def choose_tests(
    truths: Mapping[Names, Truth], rivals: Mapping[Names, tuple[Grid, Grid]],
    pairs: Sequence[tuple[Names, Names]], k: int, price: np.ndarray | None = None,
) -> tuple[list[int], np.ndarray, np.ndarray]:
    """Greedy choice of specimens that pull pairs apart after the rival is refitted.

    Pairs are ordered: true cause, rival.

    Each step adds the specimen with the largest gain of the sum over the pairs of min(d2, ``CLEAR``) for its price; the
    cap keeps an easy pair from being served at the cost of a hard one.

    Parameters
    ----------
    truths : every explanation that may be true
    rivals : per explanation its grids on the tested specimens and on the pool, with the same nodes
    pairs : (true, rival)
    k : how many
    price : of each test, shape (n,); None for one price

    Returns
    -------
    chosen, before, after : positions in the pool; d2 of each pair without and with them
    """
    sums, adds = apart(truths, rivals, pairs)
    before = np.array([s.min() for s in sums])
    chosen: list[int] = []
    for _ in range(k):
        worth = np.zeros(adds[0].shape[1])
        for total, add in zip(sums, adds, strict=True):
            # d2 of the pair so far, and with each row of the pool: the rival takes its best node anew
            now, d2 = total.min(), (total[:, None] + add).min(axis=0)
            # a tie among the capped goes to the larger: a thousandth of what lies between the cap and four times it
            below, beyond = (np.minimum(d2, cap) - min(now, cap) for cap in (CLEAR, 4 * CLEAR))
            worth += below + 1e-3 * beyond
        worth = worth if price is None else worth / price
        worth[chosen] = -np.inf
        chosen.append(int(np.argmax(worth)))
        sums = [total + add[:, chosen[-1]] for total, add in zip(sums, adds, strict=True)]
    return chosen, before, np.array([s.min() for s in sums])


def apart(
    truths: Mapping[Names, Truth], rivals: Mapping[Names, tuple[Grid, Grid]],
    pairs: Sequence[tuple[Names, Names]],
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Squared distance d2 of every pair on tested rows, and what each pool row adds.

    They are told at every node of the rival, whose sizes and inputs are refitted by taking the least of them.

    Parameters
    ----------
    truths : every explanation that may be true
    rivals : grids of every rival on the tested rows and on the pool
    pairs : true explanation and rival

    Returns
    -------
    Per pair d2 at every node of the rival, shape (g,), and what each row of the pool adds, shape (g, rows).
    """
    sums, adds = [], []
    for true, rival in pairs:
        truth = truths[true]
        here, there = rivals[rival]
        sums.append(((here.nodes - truth.tested) ** 2).sum(axis=1) + ((here.node_z - truth.inputs) ** 2).sum(axis=1))
        adds.append((there.nodes - truth.pool) ** 2)
    return sums, adds


def chance_of_verdict(d2: np.ndarray, pairs: Sequence[tuple[Names, Names]]) -> float:
    """Expected chance that the true explanation is left alone, each being as likely.

    A rival at distance d is rejected with the chance of d + N(0, 1) to exceed ``REJECTED``; the nearest one counts.

    Parameters
    ----------
    d2 : squared distance of every pair in standard deviations
    pairs : (true, rival) explanations
    """
    nearest: dict[Names, float] = {}
    for (true, _), value in zip(pairs, d2, strict=True):
        nearest[true] = min(nearest.get(true, np.inf), float(value))
    return float(np.mean(ndtr(np.sqrt(list(nearest.values())) - REJECTED)))
