"""What the properties of the bricks move: without rate, with joints that soften, and over perturbed starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.deformable.levels import RITZ
from limitmason.display.text_table import markdown

from .runs import STEPS, TRAVEL, Runs

Array = NDArray[np.float64]

VARIED: tuple[tuple[str, str, float], ...] = (
    ("density", "density", 2000.0),
    ("Young's modulus", "young_modulus", 16.7e9),
    ("Poisson's ratio", "poisson_ratio", 0.15),
)
"""Name, option and value of what is varied by a tenth."""

STARTS = (1, 2, 3, 4, 5)
"""Perturbed starts of every case."""

BRITTLE = ("udec-09", "udec-04")
"""Runs whose joints lose their strength at once: one that is a close race, one that is not."""

TO = 0.6e-3
"""Displacement of the brittle runs [m], beyond their peaks."""

PACE = round(3 * STEPS * TO / TRAVEL)
"""Their steps, as slow as the slower of two runs of a push."""

ENERGY = 0.5
"""Fracture energy in tension with which the sequence of failures is no race [J/m2]; assumed."""

MEDIAN_OF = {3: 0.6698, 5: 0.5355}
"""Standard deviation of the median of so many normal values over theirs: the integral of an order statistic."""

STUDENT = 2.05
"""Of 95 % on both sides at 28 degrees of freedom, four of each of seven cases."""


def cases() -> list[tuple[str, dict[str, Any]]]:
    """Every case, the first with nothing changed."""
    return [("as they are", {})] + [
        (f"{name} {100 * (factor - 1):+.0f} %", {key: value * factor})
        for name, key, value in VARIED for factor in (0.9, 1.1)
    ]


def changes(peaks: Array) -> tuple[Array, float]:
    """Logarithm of the medians over the first case's, and the half width of its interval.

    Parameters
    ----------
    peaks : of seven cases over five starts, shape (7, 5)

    Returns
    -------
    change [-], shape (7,), and half the width of its 95 % interval, from the scatter of all cases about their means [-]
    """
    log = np.log(peaks)
    spread = float(np.sqrt(log.var(axis=1, ddof=1).mean()))
    middle = np.median(log, axis=1)
    return middle - middle[0], STUDENT * MEDIAN_OF[5] * np.sqrt(2.0) * spread


def section(runs: Runs) -> list[str]:
    """Part of the page."""
    listed = cases()
    first = np.array([runs.onsets(["udec-09"], blocks=RITZ, **o).opening[0] for _, o in listed])
    stiff = np.array([runs.onsets(["udec-09"], blocks=RITZ, **o).compliance for _, o in listed])
    soft = np.array([
        [runs("udec-09", once=True, seed=s, fracture_energy=ENERGY, **o).peak for s in (1, 2)] for _, o in listed
    ])
    free = np.array([runs.rate_free("udec-09", to=TO, **o).peak for _, o in listed])
    slow: dict[str, Any] = {"once": True, "to": TO, "steps": PACE}
    brittle = {
        name: np.array([[runs(name, **slow, seed=s, **o).peak for s in STARTS] for _, o in listed]) for name in BRITTLE
    }
    found = {name: changes(p) for name, p in brittle.items()}
    softly = soft.mean(axis=1) / soft[0].mean() - 1.0
    body = [["", "compliance", "first failure", "peak, softening joints", *(f"peak, run {n[-2:]}" for n in BRITTLE),
             "peak, run 09, rate-free"]]
    for k, (words, _) in enumerate(listed):
        if k == 0:
            medians = [f"{np.median(p[0]):.2f} kN" for p in brittle.values()]
            body.append([words, f"{stiff[0]:.4f} mm/kN", f"{first[0]:.3f} kN", f"{soft[0].mean():.2f} kN", *medians,
                         f"{free[0]:.2f} kN"])
            continue
        moved = [f"{np.expm1(c[k]):+.1%} +- {w:.1%}" for c, w in found.values()]
        body.append([words, f"{stiff[k] / stiff[0] - 1:+.1%}", f"{first[k] / first[0] - 1:+.1%}", f"{softly[k]:+.1%}",
                     *moved, f"{free[k] / free[0] - 1:+.1%}"])
    return [
        "## Properties of the bricks (5.1)", "",
        "\"No significant effect\" at +-10 %. Compliance and first failure (ft 0.15 MPa): elastic bricks, by "
        f"superposition. Softening joints: run 9 with {ENERGY:g} J/m2 in tension (assumed), over which cohesion goes "
        f"too; mean of two starts, which differ by {float(np.abs(np.diff(soft, axis=1) / soft[:, :1]).max()):.1e} at "
        "most. Runs 9 and 4 have joints that break at once. They give the median of five starts moved by 1e-10 m, in "
        f"{PACE} steps to "
        f"{1e3 * TO:.1f} mm. The 95 % interval is that of the difference of two medians. Of six such intervals one "
        "misses by chance in a quarter of all studies. Rate-free: `lm.pushover`.", "",
        *markdown(body), "", *_words(listed, softly, first, free, found), "",
    ]


def _words(
    listed: Sequence[tuple[str, Mapping[str, Any]]], softly: Array, first: Array, free: Array,
    found: Mapping[str, tuple[Array, float]],
) -> list[str]:
    moves = first / first[0] - 1.0
    heavy = float(np.abs(moves[1:3]).max())
    lines = [
        f"- With joints that soften the bricks move the peak by {np.abs(softly).max():.1%} at most: "
        + ("no significant effect, as the paper says." if np.abs(softly).max() < 0.03 else "above the target of 3 %."),
        f"- The first failure follows the weight of the bricks, {heavy:.1%} for a tenth of density, since own weight "
        f"takes a share of ft. The stiffness of bricks moves it by {np.abs(moves[3:]).max():.1%} at most.",
    ]
    for name, (change, width) in found.items():
        beyond = [
            f"{words} ({np.expm1(c):+.1%})" for (words, _), c in zip(listed, change, strict=True) if abs(c) > width
        ]
        lines.append(
            f"- Run {name[-2:]}, joints that break at once: a difference of two medians is known to {width:.1%}; "
            + (f"beyond it: {', '.join(beyond)}." if beyond else "no change lies beyond it.")
        )
    lines.append(
        "- The path without rate, which has no start to perturb and no speed, moves by "
        f"{np.abs(free / free[0] - 1.0).max():.1%} at most."
    )
    return lines

