"""Why the DEM leaves the admissible range, or gives no value, where it does: what experiments showed."""

from __future__ import annotations

from typing import NamedTuple

from limitmason.packaged.cases import Case

UNEXPLAINED = "NOT EXPLAINED."


class Reason(NamedTuple):
    """What is known of cases of a source whose name holds a word, with a verdict or status that begins so."""

    source: str
    word: str
    begins: str
    text: str


REASONS = (
    Reason(
        "rondelet-wallette", "toothed-even-ragged", "cannot stand",
        "The topmost block at the free edge has its centroid exactly above the edge of the only block under it: "
        "neutral for rigid blocks, which limit analysis lets stand, but elastic joints yield at that edge and it tips "
        "over; at ten times the stiffness too, once equilibrium is asked for to 1e-8 of a block's weight. With this "
        "block kept level the wall stands and the DEM carries 0.381 at psi = 0.",
    ),
    Reason(
        "rondelet-wallette", "psi = phi", "below",
        "Soft joints: at psi = phi there is one admissible value, and the DEM lies about 2 % below it at the published "
        "14 GPa/m, 0.3 to 0.5 % at ten times and 0.1 % at a hundred times that. The budget counts ten times.",
    ),
    Reason(
        "bnw-walls", "BNW1, friction 0.6", "below",
        "The quick search ends too high: a longer one (slope 0.1, or random starts) finds an admissible state at 224.4 "
        "kN, below the DEM.",
    ),
    Reason(
        "ferris-tin-loi-2001", "wall-5, rounded", "not converged",
        "The largest load held is 0.1 % below the smallest admissible multiplier found; every load tried above it "
        "neither settled nor ran away in 60,000 steps, so that the bracket has no upper end.",
    ),
)  # fmt: skip


def reason_for(case: Case, outcome: str) -> str:
    """What is known of a case whose verdict or status is ``outcome``; says so where nothing is."""
    for reason in REASONS:
        if reason.source == case.source and reason.word in case.name and outcome.startswith(reason.begins):
            return reason.text
    return UNEXPLAINED
