"""First failure of the panels: without rate, by superposition, for what bricks do; and what a speed adds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.deformable.levels import LUMPED, RIGID, RITZ, SIMPLY_DEFORMABLE
from limitmason.display.text_table import markdown
from limitmason.experiments.brick_panels_opening.layout import OUTLINES
from limitmason.experiments.source_folder import read_table

from .runs import NAME, SPACING, Onsets, Runs

Array = NDArray[np.float64]

STRENGTHS = ("udec-02", "udec-05", "udec-08")
"""Runs of one cohesion and friction at ft 0.05, 0.10 and 0.15 MPa, of which none slips first."""

FT = np.array([0.05, 0.10, 0.15])
"""Their tensile strengths [MPa]."""

TYPICAL = np.array([0.28, 1.25, 2.21])
"""First crack that the paper prints for these strengths in runs that do not slip first [kN]."""

FAST, FAST_TO = (300, 1_000, 3_000, 10_000), 70e-6
"""Steps of the driven runs that show what a speed adds, and their displacement [m]."""

_HALF, _QUARTER = SPACING / 2.0, SPACING / 4.0

CASES: tuple[tuple[str, str, str, float, str | None], ...] = (
    (OUTLINES[0], "whole", RIGID, SPACING, None),
    (OUTLINES[0], "whole", LUMPED, SPACING, None),
    (OUTLINES[0], "whole", LUMPED, _QUARTER, None),
    (OUTLINES[0], "whole", SIMPLY_DEFORMABLE, SPACING, None),
    (OUTLINES[0], "whole", SIMPLY_DEFORMABLE, _QUARTER, None),
    (OUTLINES[0], "whole", RITZ, SPACING, None),
    (OUTLINES[0], "whole", RITZ, _HALF, None),
    (OUTLINES[0], "whole", RITZ, _QUARTER, None),
    (OUTLINES[0], "whole", RITZ, _HALF, "plane strain"),
    *(
        (outline, start, blocks, _HALF, None)
        for outline, start in ((OUTLINES[0], "half"), *((o, s) for o in OUTLINES[1:] for s in ("whole", "half")))
        for blocks in (LUMPED, RITZ)
    ),
)
"""Outline, bond, bricks, spacing of points [m], state of stress."""


def section(runs: Runs) -> list[str]:
    """Part of the page."""
    table = [_row(*case, _onsets(runs, *case)) for case in CASES]
    head = ["outline", "bond", "bricks", "points [mm]", *(f"ft {v:.2f}" for v in FT), "slope [kN/MPa]",
            "printed less ours [kN]", "their span"]
    return [
        "## First failure, without rate", "",
        "Joints hold everywhere up to the first failure, so stresses are those of own weight and of the load, "
        "superposed. `lm.elastic_range` is exact, without steps and speed. The table has the loads in kN at which a "
        "point reaches ft (MPa); below 0, own weight is as much too much. Printed are "
        + ", ".join(f"{v:.2f}" for v in TYPICAL)
        + f" kN, slope {_slope(TYPICAL):.1f} kN/MPa, for the runs in which nothing slips first.", "",
        *markdown([head, *table]), "", *_words(runs), *_slipping(runs), *_speed(runs),
    ]


def _onsets(runs: Runs, outline: str, start: str, blocks: str, spacing: float, stress: str | None) -> Onsets:
    options: dict[str, Any] = {"outline": outline, "start": start, **({"stress": stress} if stress else {})}
    return runs.onsets(STRENGTHS, blocks=blocks, spacing=spacing, **options)


def _slope(loads: Array) -> float:
    return float((loads[-1] - loads[0]) / (FT[-1] - FT[0]))


def _row(outline: str, start: str, blocks: str, spacing: float, stress: str | None, found: Onsets) -> list[str]:
    ours = np.array(found.opening)
    lag = TYPICAL - ours
    return [
        outline, start, blocks + (f", {stress}" if stress else ""), f"{1e3 * spacing:.4g}",
        *(f"{v:.3f}" for v in ours), f"{_slope(ours):.1f}", ", ".join(f"{v:.2f}" for v in lag), f"{np.ptp(lag):.2f}",
    ]


def _words(runs: Runs) -> list[str]:
    deform = [_onsets(runs, *c) for c in CASES if c[0] == OUTLINES[0] and c[1] == "whole" and c[2] == RITZ]
    slopes = [_slope(np.array(f.opening)) for f in deform]
    spans = [float(np.ptp(TYPICAL - np.array(f.opening))) for f in deform]
    lags = np.array([TYPICAL - np.array(f.opening) for f in deform])
    lumped = _slope(np.array(_onsets(runs, *CASES[1]).opening))
    fine = deform[2]
    other = {
        o: [_slope(np.array(_onsets(runs, *c).opening)) for c in CASES if c[0] == o and c[2] == RITZ]
        for o in OUTLINES[1:]
    }
    return [
        f"- Bricks that deform give the slope printed, {_slope(TYPICAL):.1f} kN/MPa. Elastic ones give "
        f"{min(slopes):.1f} to "
        f"{max(slopes):.1f}. The print less ours is the same load for the three strengths but for {min(spans):.2f} to "
        f"{max(spans):.2f} kN. It is {lags.min():.2f} to {lags.max():.2f} kN. Lumped ones spread the stress that "
        f"elastic ones draw to their corners, and give {lumped:.1f}, rigid ones with the joints' stiffness alone more.",
        "- Points: rigid and lumped bricks bear linear stresses along a joint, the same on any points. Finer points "
        "draw more to the corners of bricks that deform, by less each time: "
        + ", ".join(f"{f.opening[2]:.3f}" for f in deform[:3])
        + f" kN at 37.5, 18.75 and 9.375 mm. The joint is the {fine.where}, at the lower edge of the soldiers.",
        "- Outlines: elastic bricks give "
        + " and ".join(f"{min(v):.1f} to {max(v):.1f} kN/MPa on {o}" for o, v in other.items())
        + ". The print speaks for the first.", "",
    ]


def _slipping(runs: Runs) -> list[str]:
    rows = read_table(NAME, "udec_runs.csv").rows
    names = [r["specimen"] for r in rows]
    out = []
    for blocks, spacing in ((LUMPED, SPACING), (RITZ, _HALF)):
        found = runs.onsets(names, blocks=blocks, spacing=spacing)
        early = [n[-2:] for n, o, s in zip(names, found.opening, found.slip, strict=True) if s < o]
        out.append(f"{blocks} {', '.join(early)}")
    typical = dict(zip(FT, TYPICAL, strict=True))
    away = [
        f"{r['specimen'][-2:]} ({r['V_first_crack']})" for r in rows
        if abs(float(r["V_first_crack"]) - typical[float(r["tension"])]) > 0.015
    ]
    four = names.index("udec-04")
    return [
        "- The first crack hangs on ft alone where no point slips first. Runs in which one does, by superposition: "
        + "; ".join(out)
        + f". Runs that print another load than the rest of their ft: {', '.join(away)}. They are the same but for "
        f"the last digit of a print. Elastic bricks of run 4 slip at {found.slip[four]:.2f} kN, after the first point "
        "opens but before its print. Slip takes no strength. It unloads the point that would open, which then opens "
        "later. A line through all 18 prints, 20.1 kN/MPa, counts them in; it is no slope against ft.", "",
    ]


def _speed(runs: Runs) -> list[str]:
    still = np.array(runs.onsets(STRENGTHS, blocks=LUMPED, outline=OUTLINES[0], start="whole").opening)
    table = [["steps over 70 um", *(f"ft {v:.2f}" for v in FT), "less static"]]
    for steps in FAST:
        loads = np.array([runs(s, once=True, to=FAST_TO, steps=steps).first for s in STRENGTHS])
        late = ", ".join(f"{v:+.3f}" for v in loads - still)
        table.append([str(steps), *(f"{v:.3f}" for v in loads), late])
    return [
        "Lumped panels driven to 70 um (the large table drives 1.3 mm in 45000 steps, 2400 of them over 70 um):", "",
        *markdown(table), "",
        "- Driven slowly, ours fails where statics says. Driven faster it fails later, by the same load at the two "
        "strengths that the steady drive meets. At ft 0.05 MPa it fails while the drive still starts, on what is left "
        "of the swing of own weight. Driven so fast that it would be as late as the source, it swings, and the delays "
        "are no longer one.",
        f"- What delays the source is not printed. {_stiffnesses(runs)} A speed may do that, or looking at the joints "
        "now and then only: inferred, not shown.",
        "- Own weight that acts at once overshoots. At ft 0.05 MPa statics leaves lumped bricks 0.03 kN. Five joints "
        "broke where the weight was let go at once. Here it comes to rest on sound joints first (`sound=True`).",
        "",
    ]


def _stiffnesses(runs: Runs) -> str:
    """What print less ours is at the stiffnesses of Table 3."""
    late = []
    for r in read_table(NAME, "stiffness_table.csv").rows:
        given = {"kn": 1e9 * float(r["kn"]), "ks": 1e9 * float(r["ks"])}
        found = runs.onsets(["udec-01"], blocks=RITZ, **given)
        late.append(float(r["V_first_crack"]) - found.opening[0])
    return (
        "Table 3 has joints of 1, 10, 100 and 1000 times 8.3 GPa/m, at ft 0.05 MPa. There the print less elastic "
        f"bricks is {', '.join(f'{v:.2f}' for v in late)} kN. It grows with the stiffness, less than in proportion."
    )
