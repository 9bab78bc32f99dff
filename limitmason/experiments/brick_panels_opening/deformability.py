"""How the panels' peaks depend on how their bricks deform, over perturbed starts and beside the path without rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from limitmason.deformable.levels import ELASTIC, LUMPED, MODAL, ZONED
from limitmason.experiments.brick_panels_opening.runs import NAME, NUDGE, SPACING, STEPS, TRAVEL, Answer, Runs
from limitmason.experiments.tables import read_table
from limitmason.text_table import markdown

SLOWER = 3 * STEPS
"""Steps of a run that is as slow as the slower of the two of a push."""

BENDING: dict[str, Any] = {"once": True, "steps": SLOWER, "blocks": MODAL, "seed": 1}
"""One run of bricks that strain and bend."""

STARTS = (1, 2, 3)
"""Perturbed starts of the runs that have several."""

CLOSELY = ("udec-09", "udec-10", "udec-14")
"""Runs that have several, and rate-free paths."""

ZONES = ("udec-10", "udec-14", "udec-06", "udec-09")
"""Runs with zoned bricks."""

SHORT, SHORT_STEPS = 0.3e-3, 30_000
"""Displacement [m] and steps of zoned runs, three times slower than the fastest that ``dem.push`` takes for them."""


ELASTIC_TO = 0.22e-3
"""Displacement up to which elastic bricks are followed without rate [m]: a minute and a half of processor time."""


def section(runs: Runs) -> list[str]:
    """Part of the page."""
    return [
        "## Bricks that deform: three levels", "",
        f"Lumped: rigid bricks, their compliance in the joints. Modal: bricks that strain and bend. Zoned: bricks of "
        f"{1e3 * SPACING:.4g} mm zones. The same contact points. Perturbed starts: every brick moved by up to "
        f"{NUDGE:g} m. Rate-free: `lm.pushover` on the same points with the same law.", "",
        *_stiffness(runs), *_grid(runs), *_starts(runs), *_zones(runs),
    ]  # fmt: skip


def _slow(runs: Runs, name: str, blocks: str, seed: int) -> Answer:
    return runs(name, once=True, steps=SLOWER, blocks=blocks, seed=seed)


def _stiffness(runs: Runs) -> list[str]:
    strong: dict[str, Any] = {"cohesion": 1e7, "tensile_strength": 1e7}
    free = [runs.rate_free("udec-09", blocks=b, to=5e-5, **strong).stiffness for b in (LUMPED, MODAL, ELASTIC)]
    zoned = runs("udec-09", once=True, to=5e-5, steps=12_000, blocks=ZONED, **strong).stiffness
    return [
        f"- Compliance under the plate, joints that do not fail, rate-free: lumped {free[0]:.5f}, modal {free[1]:.5f}, "
        f"elastic bricks condensed to their joints {free[2]:.5f} mm/kN; zoned, driven {zoned:.5f}: modal "
        f"{free[1] / zoned - 1.0:+.1%} of zoned.", "",
    ]  # fmt: skip


def _grid(runs: Runs) -> list[str]:
    names = [r["specimen"] for r in read_table(NAME, "udec_runs.csv").rows]
    lumped, modal = [runs(n) for n in names], [runs(n, **BENDING) for n in names]
    ratio = np.array([m.peak / f.peak for m, f in zip(modal, lumped, strict=True)])
    body = [["run", "lumped [kN]", "at [mm]", "modal [kN]", "at [mm]", "modal/lumped"]]
    body += [
        [n[-2:], f"{f.peak:.2f}", f"{f.at_peak:.2f}", f"{m.peak:.2f}", f"{m.at_peak:.2f}", f"{q:.2f}"]
        for n, f, m, q in zip(names, lumped, modal, ratio, strict=True)
    ]
    return [
        f"Peaks up to {1e3 * TRAVEL:.1f} mm, {SLOWER} steps, one start each: modal over lumped, median "
        f"{np.median(ratio):.2f}, from {ratio.min():.2f} to {ratio.max():.2f}.", "", *markdown(body), "",
    ]  # fmt: skip


def _starts(runs: Runs) -> list[str]:
    body = [["run", "blocks", f"median of {len(STARTS)} [kN]", "least", "largest", "rate-free [kN]"]]
    for name in CLOSELY:
        for blocks in (LUMPED, MODAL):
            found = [_slow(runs, name, blocks, s) for s in STARTS]
            free = runs.rate_free(name, blocks=blocks)
            body.append([name[-2:], blocks, *_spread(found), f"{free.peak:.2f}" + (free.mode and f" ({free.mode})")])
    return [
        "Perturbed starts, driven, beside the path without rate:", "", *markdown(body), "",
        "Where modal lies below lumped (runs 10 and 14) the path without rate says the same: it is the bending of the "
        "bricks, which opens joints from their edges, and neither the rate, nor the scaled masses of the modes, nor "
        "rounding.", "",
    ]  # fmt: skip


def _zones(runs: Runs) -> list[str]:
    body = [["run", "lumped [kN]", "modal [kN]", "zoned [kN]", "modal/zoned"]]
    pace = round(SLOWER * SHORT / TRAVEL)
    for name in ZONES:
        f, m = (runs(name, once=True, to=SHORT, steps=pace, blocks=b, seed=1).peak for b in (LUMPED, MODAL))
        z = runs(name, once=True, to=SHORT, steps=SHORT_STEPS, blocks=ZONED, seed=1).peak
        body.append([name[-2:], f"{f:.2f}", f"{m:.2f}", f"{z:.2f}", f"{m / z:.2f}"])
    elastic = runs.rate_free("udec-10", blocks=ELASTIC, to=ELASTIC_TO)
    return [
        f"Largest loads up to {1e3 * SHORT:.1f} mm, one start:", "", *markdown(body), "",
        "Runs 6, 9 and 14 agree as far as one start and one speed can tell. Run 10, whose joints break by own weight, "
        "does not, and is open: elastic bricks condensed to their joints carry "
        f"{elastic.peak:.2f} kN without rate up to {1e3 * ELASTIC_TO:.2f} mm, as modal ones do; whether they later "
        "regain what the zoned run carries is not known.", "",
    ]  # fmt: skip


def _spread(found: Sequence[Answer]) -> list[str]:
    peaks = [a.peak for a in found]
    return [f"{np.median(peaks):.2f}", f"{min(peaks):.2f}", f"{max(peaks):.2f}"]
