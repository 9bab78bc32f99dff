"""Tests after which a cause could be told from its rivals: which, and how many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from limitmason.diagnosis.inference.discrepancy import Discrepancy
from limitmason.diagnosis.inference.next_tests import CLEAR, MANY


def equivalent_tests(
    sums: Sequence[np.ndarray], adds: Sequence[np.ndarray], quantities: Sequence[str], cap: float = CLEAR
) -> dict[str, float]:
    """How many tests of each quantity bring as much as one test of the best quantity.

    What they bring is measured by the sum over pairs of min(d2, cap). The best specimen of each quantity is tested
    again and again. The result is empty where no test brings anything.

    Parameters
    ----------
    sums, adds : squared distances of the pairs at every node so far, and what each row of the pool adds, (g,) and (g,
        rows)
    quantities : of every row
    cap : distance from which a pair counts as told apart
    """

    def reached(row: int, times: int) -> float:
        """Sum over pairs of min(d2, cap), with a row of the pool tested so many times."""
        both = zip(sums, adds, strict=True)
        return sum(min(float((total + times * add[:, row]).min()), cap) for total, add in both)

    rows: dict[str, list[int]] = {}
    for row, quantity in enumerate(quantities):
        rows.setdefault(quantity, []).append(row)
    best = {q: max(each, key=lambda row: reached(row, 1)) for q, each in rows.items()}
    # less what rounding makes of equal sums
    target = max(reached(row, 1) for row in best.values()) - 1e-9
    if target <= sum(min(float(total.min()), cap) for total in sums):
        return {}  # the pairs are apart as they are
    return {q: float(next((t for t in range(1, MANY + 1) if reached(row, t) >= target), np.inf))
            for q, row in best.items()}


class IdentifyingTests(NamedTuple):
    """Specimens that identify an explanation best.

    Parameters
    ----------
    chosen : positions in the pool
    before, after : expected log-likelihood over the best model discrepancy without and with them
    each : what each test of the pool would add to ``before`` alone, shape (rows of the pool,)
    """

    chosen: list[int]
    before: float
    after: float
    each: np.ndarray


def tests_that_identify(
    discrepancy: Discrepancy, slopes: np.ndarray, effect: np.ndarray, tested: int, k: int, price: np.ndarray
) -> IdentifyingTests:
    """Greedy choice of specimens after which an effect exceeds every discrepancy most.

    The effect is taken without noise.

    Each step adds the specimen that raises min over the biases of f' (S + J J')^-1 f / 2 + log det(S + J J') / 2 most.

    Parameters
    ----------
    discrepancy : biases of the tested specimens and the pool together
    slopes : J of both, shape (n, number of measured inputs)
    effect : f of both, in units of the noise, shape (n,)
    tested : how many of them are tested, first
    k : how many to choose
    price : of each test of the pool, shape (rows of the pool,)
    """
    n = len(effect)
    whole = discrepancy.kernels + np.eye(n) + slopes @ slopes.T  # S + J J' of every bias, shape (m, n, n)
    done, chosen, values = list(range(tested)), list[int](), list[float]()  # tested and chosen; excess after each step
    first = np.zeros(n - tested)  # what each test alone adds, from the first step
    for _ in range(k + 1):
        # what the explanation exceeds every bias by: half of the square f' (S + J J')^-1 f, and half of the price log
        # det(S + J J'), less that of no bias
        part = whole[:, done][:, :, done]
        inverse = np.linalg.inv(part)
        own = np.eye(len(done)) + slopes[done] @ slopes[done].T
        paid = 0.5 * (np.linalg.slogdet(part)[1] - np.linalg.slogdet(own)[1])
        square = 0.5 * np.einsum("i,mij,j->m", effect[done], inverse, effect[done])
        values.append(float((square + paid).min()))
        if len(chosen) == k:
            break
        rest = [i for i in range(tested, n) if i not in done]
        # bordering: adding one row to S adds missed^2 / spread and log(spread), no new inverse
        across = whole[:, done][:, :, rest]
        pulled = inverse @ across
        spread = whole[:, rest, rest] - np.einsum("mir,mir->mr", across, pulled)
        missed = effect[rest] - np.einsum("i,mir->mr", effect[done], pulled)
        worth = (square + paid)[:, None] + 0.5 * missed**2 / spread + 0.5 * np.log(spread)
        each = worth.min(axis=0) - values[-1]
        first = first if chosen else each
        best = rest[int(np.argmax(each / price[np.array(rest) - tested]))]
        chosen.append(best - tested)
        done.append(best)
    return IdentifyingTests(chosen=chosen, before=values[0], after=values[-1], each=first)
