"""Sections of the page of the measured walls that are about capacity curves, made from the record."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from limitmason.comparison.wall_curves import FURTHEST, TRIES, UNITS, WallCurve
from limitmason.comparison.wall_ladder import formulas_force
from limitmason.comparison.wall_modes import rocking_force
from limitmason.display.text_table import markdown
from limitmason.experiments import registry
from limitmason.experiments.modern_walls import FILLED, NAME
from limitmason.experiments.modern_walls.inputs import complete
from limitmason.experiments.tables import read_table
from validation.wall_figures import drift_at
from validation.wall_loop import (
    ThresholdsLeftOut,
    difference,
    first_mode,
    left_out,
    scatter,
    threshold_left_out,
)
from validation.wall_tests import ROWS, Measured, mean_of, measured_walls

Array = NDArray[np.float64]
WITHIN = 1.5  # factor that is asked of the drift at the peak
SECANT = 0.7  # of the largest force, at which the computed stiffness is read as the bilinear one is
FACTORS = tuple(np.round(np.arange(0.7, 1.31, 0.02), 2))
NAMES = "S", "F", "SL", "G"


def peak_of(drift: Sequence[float] | Array, force: Sequence[float] | Array) -> tuple[float, float, float]:
    """Largest force, the drift there, and the share of it that is left at the end."""
    far, load = np.asarray(drift, dtype=float), np.asarray(force, dtype=float)
    k = int(load.argmax())
    return float(load[k]), float(far[k]), float(load[-1] / load[k])


def inner(curve: WallCurve) -> float:
    """Share of the top's motion at the end that is slip of bed joints and vertical planes that move apart."""
    return curve.slips[-1] + curve.apart[-1]


def stiffness_of(curve: WallCurve) -> float:
    """Secant stiffness at 0.7 of the largest force [kN / %]."""
    force, drift = np.array(curve.force), np.array(curve.drift)
    return SECANT * curve.peak / drift_at(SECANT, drift, force)


def sections(curves: Mapping[str, WallCurve]) -> list[str]:
    """Sections of the page, each from its heading on."""
    walls = [m for m in measured_walls() if m.wall in curves and curves[m.wall].force]
    return [_curves(curves, walls), _modes(curves, walls), _envelopes(curves)]


def _ended(curves: Mapping[str, WallCurve]) -> str:
    """How many curves there are, what they took, and how they ended."""
    all_walls = [r["specimen"] for r in ROWS.values() if complete(r)]
    have = [curves[w] for w in all_walls if w in curves]
    missing = [w for w in all_walls if w not in curves]
    said = [f"{len(have)} of {len(all_walls)} walls with all inputs have a curve, {sum(c.seconds for c in have):.0f} s "
            f"of processor time in all, {max(c.seconds for c in have):.0f} s the longest."]
    ends = Counter(c.status for c in have)
    said.append("They ended as: " + ", ".join(f"{status} {n}" for status, n in ends.most_common()) + ".")
    coarse = [c.wall for c in have if c.coarse > 1]
    if coarse:
        said.append(f"{len(coarse)} of more than {UNITS} units are followed with larger ones.")
    early = [c for c in have if c.force and c.status == "stopped"]
    if early:
        said.append(f"{len(early)} stopped early, most after {TRIES} tries of a step.")
    if missing:
        said.append(f"Not computed: {', '.join(missing)}.")
    return "\n".join(said)


def _median(found: Sequence[float]) -> str:
    given = np.array([v for v in found if np.isfinite(v)])
    return f"{np.median(given):.2f} ({len(given)})" if len(given) else "-"


def _campaigns(curves: Mapping[str, WallCurve], walls: Sequence[Measured]) -> list[list[str]]:
    lines = [["campaign", "walls", "peak", "sd of ln", "drift at the peak", "within 1.5", "stiffness", "left",
              "left, measured"]]
    groups = {"all": list(walls)}
    for m in walls:
        groups.setdefault(m.campaign, []).append(m)
    for name, own in groups.items():
        pairs = [(curves[m.wall], m) for m in own]
        ratio = np.log([c.peak / m.force for c, m in pairs])
        drift = [peak_of(c.drift, c.force)[1] / mean_of(m.wall, "d_Vmax") for c, m in pairs]
        stiff = [stiffness_of(c) * mean_of(m.wall, "d_e") / mean_of(m.wall, "V_bl") for c, m in pairs]
        known = [d for d in drift if np.isfinite(d)]
        near = sum(1.0 / WITHIN <= d <= WITHIN for d in known)
        lines.append([
            name, str(len(own)), f"{np.exp(np.median(ratio)):.2f}",
            f"{ratio.std(ddof=1):.3f}" if len(own) > 1 else "-", _median(drift), f"{near} of {len(known)}",
            _median(stiff), _median([c.force[-1] / c.peak for c, _ in pairs]),
            _median([mean_of(m.wall, "V_dmax") / m.force for m in own]),
        ])
    return lines


def _beside(curves: Mapping[str, WallCurve], walls: Sequence[Measured]) -> str:
    """The curves beside the formulas on the same walls, nothing fitted and one factor each with campaigns left out."""
    force, campaigns = np.array([m.force for m in walls]), [m.campaign for m in walls]
    made = {
        "curves": np.log(np.array([curves[m.wall].peak for m in walls]) / force),
        "formulas": np.log(np.array([formulas_force(registry.load(NAME, m.wall)) for m in walls]) / force),
    }
    lines = [["model, same walls", "median", "sd of ln", "median abs ln", "90 %"]]
    loops = {}
    filled = np.array([ROWS[m.wall]["head_joints"] in FILLED for m in walls])
    for name, logs in made.items():
        factors = {f"{f:g}": logs + np.log(f) for f in FACTORS}
        loops[name] = left_out(factors, campaigns).logs
        for label, found in (
            (name, logs), (f"{name}, one factor, campaigns left out", loops[name]),
            (f"{name}, {filled.sum()} walls of filled heads", logs[filled]),
            (f"{name}, {(~filled).sum()} of other heads", logs[~filled]),
        ):
            s = scatter(found)
            lines.append([label, f"{s.median:.2f}", f"{s.deviation:.3f}", f"{s.middle:.2f}", f"{s.nine:.2f}"])
    logs_of_filled = {name: logs[filled] for name, logs in made.items()}
    low, high = difference(loops["curves"], loops["formulas"], campaigns)
    less = loops["curves"].std(ddof=1) - loops["formulas"].std(ddof=1)
    said = (f"sd of the curves less that of the formulas, one factor each: {less:+.3f}, 90 % of draws of campaigns "
            f"{low:+.3f} to {high:+.3f}.")
    less = logs_of_filled["curves"].std(ddof=1) - logs_of_filled["formulas"].std(ddof=1)
    own = [c for c, yes in zip(campaigns, filled, strict=True) if yes]
    low, high = difference(logs_of_filled["curves"], logs_of_filled["formulas"], own)
    said += f" The same of filled heads, nothing fitted: {less:+.3f}, {low:+.3f} to {high:+.3f}; split afterwards."
    return "\n".join([*markdown(lines), "", said])


def _worst(curves: Mapping[str, WallCurve], walls: Sequence[Measured], number: int = 10) -> list[list[str]]:
    lines = [["wall", "campaign", "units", "curve", "formulas", "drift at the peak", "mode", "ended"]]
    far = sorted(walls, key=lambda m: -abs(np.log(curves[m.wall].peak / m.force)))[:number]
    for m in far:
        c, test = curves[m.wall], registry.load(NAME, m.wall)
        drift = peak_of(c.drift, c.force)[1]
        lines.append([
            m.wall, m.campaign, ROWS[m.wall]["unit_type"], f"{c.peak / m.force:.2f}",
            f"{formulas_force(test) / m.force:.2f}", f"{drift:.2f}, measured {mean_of(m.wall, 'd_Vmax'):.2f}", m.mode,
            f"{c.status} at {c.drift[-1]:.2f} %",
        ])
    return lines


def _curves(curves: Mapping[str, WallCurve], walls: Sequence[Measured]) -> str:
    """Peaks, drifts, stiffness and drop beside what was measured."""
    return f"""## Capacity curves

Made by `python -m validation.wall_curves --store FILE --page docs/measured-walls.md`, and wall by wall by `limitmason
predict modern-walls --method pushover`. Every strength is as printed. Units crack by the diagonal strength with k = 2.
Joints and cracks lose all strength over assumed fracture energies. Stiffness is the printed E and G. **Nothing is
fitted.** Where both ends of a wall were held its beam does not turn. Walls are pushed once to {100 * FURTHEST:g} %.

{_ended(curves)}

Computed over measured, medians, number of walls in brackets. *stiffness*: secant at {SECANT:g} of the peak over that of
the bilinear curve. *left*: force at the end over the peak; the measured one is at the largest drift, mostly further.

{chr(10).join(markdown(_campaigns(curves, walls)))}

{_beside(curves, walls)}

The worst ten:

{chr(10).join(markdown(_worst(curves, walls)))}
"""


def modes_of(curves: Mapping[str, WallCurve], walls: Sequence[Measured]) -> Mapping[str, ThresholdsLeftOut]:
    """Modes of walls by two measures of rocking, each with the threshold that the other campaigns choose."""
    found = [curves[m.wall] for m in walls]
    rocks = [c.peak / rocking_force(registry.load(NAME, c.wall)) for c in found]
    moves = [1.0 - inner(c) for c in found]
    inside, printed = [c.inside for c in found], [first_mode(m.mode) for m in walls]
    campaigns = [m.campaign for m in walls]
    return {
        "peak over rocking force": threshold_left_out(np.array(rocks), inside, printed, campaigns),
        "motion at the end": threshold_left_out(np.array(moves), inside, printed, campaigns),
    }


def _modes(curves: Mapping[str, WallCurve], walls: Sequence[Measured]) -> str:
    """Confusion of modes by what gave way on the path."""
    walls = [m for m in walls if m.mode != "D"]
    text = []
    for name, found in modes_of(curves, walls).items():
        pairs = [(first_mode(m.mode), mode) for m, mode in zip(walls, found.modes, strict=True)]
        right = sum(a == b for a, b in pairs)
        head = [f"F by the {name}", *(f"computed {n}" for n in NAMES)]
        rows = [[f"measured {a}", *(str(pairs.count((a, b))) for b in NAMES)] for a in NAMES]
        text += [*markdown([head, *rows]), "", f"Right: {right} of {len(pairs)} ({right / len(pairs):.0%}).", ""]
    return "## Failure modes by the curves\n\n" + "\n".join([
        "What gave way from the dead load to the end names S, SL or G, as in limit analysis. F is by one of two",
        "measures, each with the threshold that the other campaigns choose. One is the peak over the force at which",
        "the wall rocks in one piece. The other is the share of the top's motion at the end that is neither slip nor",
        "opening of cracks.",
        "",
        *text,
    ])


def envelope_lines(curves: Mapping[str, WallCurve]) -> list[list[str]]:
    """Rows of a table: peak, drift at the peak and what is left, computed and measured, positive sense."""
    lines = [["wall", "peak", "drift at the peak [%]", "ratio", "within 1.5", "drifts at 0.7 of the peak, ratio",
              "left", "left, measured", "at [%]", "ended"]]
    for name in dict.fromkeys(r["specimen"] for r in read_table(NAME, "envelopes.csv").rows):
        if name not in curves or not curves[name].force:
            continue
        row, test = curves[name], registry.load(NAME, name)
        measured = test.recipe.curve(test)
        far, load = np.asarray(measured.displacement), np.asarray(measured.load)
        most, at, _ = peak_of(far, load)
        force, drift, _ = peak_of(row.drift, row.force)
        end = min(row.drift[-1], float(far.max()))
        left, theirs = (float(np.interp(end, *c)) for c in ((row.drift, row.force), (far, load)))
        rise = drift_at(SECANT, np.array(row.drift), np.array(row.force)) / drift_at(SECANT, far, load)
        lines.append([
            name, f"{force / most:.2f}", f"{drift:.3f}, measured {at:.3f}", f"{drift / at:.2f}",
            "yes" if 1.0 / WITHIN <= drift / at <= WITHIN else "no", f"{rise:.2f}", f"{left / force:.2f}",
            f"{theirs / most:.2f}", f"{end:.2f}", str(row.status),
        ])
    return lines


def _envelopes(curves: Mapping[str, WallCurve]) -> str:
    return "\n".join([
        "## Envelopes", "",
        "The six walls whose envelopes were measured, positive sense, beside the computed curve. In the figure each is",
        "divided by its largest force.", "", *markdown(envelope_lines(curves)), "",
        "![envelopes](measured-walls-envelopes.png)", "",
    ])
