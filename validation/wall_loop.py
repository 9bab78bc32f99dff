"""Choosing a model of measured walls with whole campaigns left out, and what may be said of its scatter.

A choice (which causes a block model has, which factors the formulas get) is made on the other campaigns, again for
every campaign; nothing of a campaign is seen by the choice that predicts it.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NINE_IN_TEN = 0.9


class Scatter(NamedTuple):
    """Predicted over measured of some walls: number, median, sd of ln, median and 90 % quantile of abs ln."""

    number: int
    median: float
    deviation: float
    middle: float
    nine: float


def scatter(logs: Array) -> Scatter:
    """Scatter of ln(predicted / measured)."""
    far = np.abs(logs)
    return Scatter(len(logs), float(np.exp(np.median(logs))), float(np.std(logs, ddof=1)), float(np.median(far)),
                   float(np.quantile(far, NINE_IN_TEN)))


class LeftOut(NamedTuple):
    """ln(predicted / measured) of every wall by the choice made without its campaign, and that choice."""

    logs: Array
    chosen: Mapping[str, str]


def left_out(candidates: Mapping[str, Array], campaigns: Sequence[str]) -> LeftOut:
    """Choose among candidates by least mean square of ln(predicted / measured), each campaign left out in turn.

    Parameters
    ----------
    candidates : ln(predicted / measured) of every wall by name of the candidate
    campaigns : of every wall; a campaign counts by its walls
    """
    names, table = list(candidates), np.array(list(candidates.values()))
    of = np.array(campaigns)
    logs, chosen = np.empty(table.shape[1]), {}
    for campaign in dict.fromkeys(campaigns):
        out = of == campaign
        best = int(np.argmin(np.mean(table[:, ~out] ** 2, axis=1)))
        logs[out], chosen[campaign] = table[best, out], names[best]
    return LeftOut(logs, chosen)


FACTORS = (0.8, 0.9, 1.0, 1.1, 1.25)


def factored(forces: Array, measured: Array) -> dict[str, Array]:
    """Candidates of the formulas: a factor on three of them and one on the smallest, as many as the block model gets.

    Parameters
    ----------
    forces : of the four formulas, shape (walls, 4), in the order of :class:`mechanisms.WallForces`
    measured : shape (walls,)
    """
    found = {}
    for rocking, sliding, cracking in itertools.product(FACTORS, repeat=3):
        scaled = forces * np.array([rocking, sliding, cracking, cracking])
        found[f"rocking {rocking:g}, sliding {sliding:g}, cracking {cracking:g}"] = np.log(
            scaled.min(axis=1) / measured
        )
    return found


def difference(one: Array, other: Array, campaigns: Sequence[str], *, draws: int = 4000, seed: int = 0) -> Array:
    """Ends of the 90 % interval of the difference of two deviations, campaigns drawn anew with all their walls."""
    rng, of = np.random.default_rng(seed), np.array(campaigns)
    groups = [np.flatnonzero(of == c) for c in dict.fromkeys(campaigns)]
    found = np.empty(draws)
    for k in range(draws):
        drawn = np.concatenate([groups[g] for g in rng.integers(len(groups), size=len(groups))])
        found[k] = np.std(one[drawn], ddof=1) - np.std(other[drawn], ddof=1)
    return np.quantile(found, [0.05, 0.95])


def first_mode(printed: str) -> str:
    """First mode of a printed one: "H-FS" is F, "SL" SL, "H-S?" S; "D" (uncertain) stays."""
    word = printed.removeprefix("H-").rstrip("?")
    return "SL" if word.startswith("SL") else word[:1]


class ThresholdsLeftOut(NamedTuple):
    """Mode of every wall by the threshold that the other campaigns choose, and the threshold of each campaign."""

    modes: list[str]
    thresholds: Mapping[str, float]


def threshold_left_out(
    ratios: Array, inside: Sequence[str], printed: Sequence[str], campaigns: Sequence[str]
) -> ThresholdsLeftOut:
    """F from a share of the rocking force on, chosen by the most right modes, each campaign left out in turn.

    Parameters
    ----------
    ratios : force over rocking force
    inside : mode of a wall that does not rock
    printed : first mode in the source; "D" is never right

    Notes
    -----
    Between two ratios that follow one another all thresholds are equal: the middle of the widest best interval.
    """
    of, far = np.array(campaigns), np.asarray(ratios, dtype=float)
    rocked, other = np.array(printed) == "F", np.array(inside) == np.array(printed)
    modes, thresholds = list(inside), {}
    for campaign in dict.fromkeys(campaigns):
        seen = of != campaign
        edges = np.unique(far[seen])
        middles, widths = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
        right = np.array([np.where(far[seen] >= at, rocked[seen], other[seen]).sum() for at in middles])
        best = np.flatnonzero(right == right.max())
        thresholds[campaign] = float(middles[best[np.argmax(widths[best])]])
        for k in np.flatnonzero(~seen):
            if far[k] >= thresholds[campaign]:
                modes[k] = "F"
    return ThresholdsLeftOut(modes, thresholds)
