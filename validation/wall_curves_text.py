"""Sections of the page of the measured walls that are about capacity curves, made from the record."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from limitmason.comparison.wall_curves import ELASTIC, FURTHEST, INNER, TRIES, UNITS, WallCurve
from limitmason.comparison.wall_ladder import DOZEN, MODEL_SPREAD, NINETY, formulas_force
from limitmason.comparison.wall_modes import mode_of_shares
from limitmason.display.text_table import markdown
from limitmason.experiments import registry
from limitmason.experiments.modern_walls import FILLED, NAME
from limitmason.experiments.modern_walls.inputs import complete
from limitmason.experiments.source_folder import read_table
from validation.wall_figures import drift_at
from validation.wall_loop import (
    difference,
    first_mode,
    left_out,
    scatter,
    threshold_left_out,
)
from validation.wall_tests import ROWS, Measured, mean_of, measured_walls

Array = NDArray[np.float64]
SOFTER = 0.9  # of its first secant stiffness, at which a computed wall is said to have cracked
NEAR = 0.05  # difference of two engines from which on a wall is listed
WITHIN = 1.5  # factor that is asked of the drift at the peak
SECANT = 0.7  # of the largest force, at which the computed stiffness is read as the bilinear one is
FACTORS = tuple(np.round(np.arange(0.7, 1.31, 0.02), 2))
NAMES = "S", "F", "SL", "G"


def peak_of(drift: Sequence[float] | Array, force: Sequence[float] | Array) -> tuple[float, float, float]:
    """Largest force, the drift there, and the share of it that is left at the end."""
    far, load = np.asarray(drift, dtype=float), np.asarray(force, dtype=float)
    k = int(load.argmax())
    return float(load[k]), float(far[k]), float(load[-1] / load[k])


def stiffness_of(curve: WallCurve) -> float:
    """Secant stiffness at 0.7 of the largest force [kN / %]."""
    force, drift = np.array(curve.force), np.array(curve.drift)
    return SECANT * curve.peak / drift_at(SECANT, drift, force)


def with_a_curve(curves: Mapping[str, WallCurve]) -> list[Measured]:
    """Measured walls that have one."""
    return [m for m in measured_walls() if m.wall in curves and curves[m.wall].force]


def cracking_of(curve: WallCurve) -> float:
    """Drift at which the secant stiffness has first fallen to 0.9 of that at a tenth of the largest force [%]."""
    force, drift = np.array(curve.force), np.array(curve.drift)
    first = int(np.argmax(force >= ELASTIC * curve.peak))
    secant = force[first:] / drift[first:]
    return float(drift[first + int(np.argmax(secant <= SOFTER * secant[0]))])


def _kinds(of: Mapping[str, Mapping[str, WallCurve]], walls: Mapping[str, Sequence[Measured]]) -> list[list[str]]:
    """Computed over measured of every kind of data: number, median, scatter, how many within a factor."""
    lines = [["computed over measured", "walls", "median", "sd of ln", f"within {WITHIN:g}"]]
    for by, curves in of.items():
        pairs = [(curves[m.wall], m) for m in walls[by]]
        for name, ratios in (
            ("peak", [c.peak / m.force for c, m in pairs]),
            ("drift at the peak", [peak_of(c.drift, c.force)[1] / mean_of(m.wall, "d_Vmax") for c, m in pairs]),
            ("stiffness", [stiffness_of(c) * mean_of(m.wall, "d_e") / mean_of(m.wall, "V_bl") for c, m in pairs]),
            ("drift at the first crack", [cracking_of(c) / mean_of(m.wall, "d_cr") for c, m in pairs]),
        ):
            logs = np.log(ratios)
            s = scatter(logs[np.isfinite(logs)])
            near = int((np.abs(logs) <= np.log(WITHIN)).sum())
            lines.append([f"{by}, {name}", str(s.number), f"{s.median:.2f}", f"{s.deviation:.2f}", str(near)])
    return lines


def sections(curves: Mapping[str, WallCurve], pushes: Mapping[str, WallCurve]) -> list[str]:
    """Sections of the page, each from its heading on; ``pushes`` are the DEM's."""
    walls, by_dem = with_a_curve(curves), with_a_curve(pushes)
    kinds = _kinds({"path": curves, "DEM": pushes}, {"path": walls, "DEM": by_dem})
    return [_curves(curves, walls, kinds), _dem(pushes, curves, by_dem), _modes(curves, walls, pushes, by_dem),
            _envelopes(curves, pushes)]


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
    return "\n".join([*markdown(lines), "", said, "", _intervals(made["curves"], campaigns)])


def _intervals(logs: Array, campaigns: Sequence[str]) -> str:
    """How many walls the 90 % interval holds by the model's scatter alone, that of the page and that of the others."""
    of, held = np.array(campaigns), 0
    for campaign in dict.fromkeys(campaigns):
        own = of == campaign
        held += int((np.abs(logs[own]) <= NINETY * np.sqrt(np.mean(logs[~own] ** 2))).sum())
    spread = MODEL_SPREAD["pushover"]
    usual = int((np.abs(logs) <= NINETY * spread).sum())
    return "\n".join([
        f"The 90 % interval of a curve has a scatter of {spread:g} for the model. With that alone, no input moved,",
        f"it holds {usual} of {len(logs)} walls ({usual / len(logs):.0%}). With the root mean square of the other",
        f"campaigns it holds {held} ({held / len(logs):.0%}). Asked of all walls: 80 to 97 %.",
    ])


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


def _curves(curves: Mapping[str, WallCurve], walls: Sequence[Measured], kinds: list[list[str]]) -> str:
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

Kinds of data, where printed, by the path and by the DEM (below). *first crack*: the computed one is where the secant
stiffness has fallen by a tenth; the measured one was seen.

{chr(10).join(markdown(kinds))}

The worst ten:

{chr(10).join(markdown(_worst(curves, walls)))}
"""


def _dem(pushes: Mapping[str, WallCurve], curves: Mapping[str, WallCurve], walls: Sequence[Measured]) -> str:
    """Peak, drift, mode and time by the DEM beside the path and what was measured."""
    lines = [["wall", "campaign", "units", "measured [kN]", "DEM", "path", "peak", "drift at the peak [%]", "left",
              "left, path", "mode", "printed", "rate", "time [s]"]]
    for m in walls:
        if m.wall not in DOZEN:
            continue
        dem, path = pushes[m.wall], curves[m.wall]
        drifts = (f"{peak_of(c.drift, c.force)[1]:.3f}" for c in (dem, path))
        lines.append([
            m.wall, m.campaign, ROWS[m.wall]["unit_type"], f"{m.force:.0f}", f"{dem.peak:.0f}", f"{path.peak:.0f}",
            f"{dem.peak / m.force:.2f}", f"{', path '.join(drifts)}, measured {mean_of(m.wall, 'd_Vmax'):.3f}",
            f"{dem.force[-1] / dem.peak:.2f}", f"{path.force[-1] / path.peak:.2f} at {path.drift[-1]:.2f} %", dem.mode,
            m.mode, f"{dem.rate:.1%}", f"{dem.seconds:.0f}",
        ])
    ratio = np.array([pushes[m.wall].peak / curves[m.wall].peak for m in walls])
    s = scatter(np.log([pushes[m.wall].peak / m.force for m in walls]))
    peaks = [peak_of(pushes[m.wall].drift, pushes[m.wall].force)[1] for m in walls]
    drift = np.array(peaks) / [mean_of(m.wall, "d_Vmax") for m in walls]
    near = int(((drift >= 1.0 / WITHIN) & (drift <= WITHIN)).sum())
    far = [m.wall for m, r in zip(walls, ratio, strict=True) if abs(r - 1.0) > NEAR]
    other = [m for m in walls if pushes[m.wall].mode != curves[m.wall].mode]
    early = sum(curves[m.wall].status == "stopped" for m in other)
    fast = [m for m in walls if pushes[m.wall].rate > NEAR]
    of_fast = [pushes[m.wall].peak / curves[m.wall].peak for m in fast]
    own = [i for i, m in enumerate(walls) if m.wall in DOZEN]
    return f"""## The DEM

Made by `python -m validation.wall_curves --by dem --store FILE`, and a dozen of walls by `limitmason predict
modern-walls --method dem`: the same walls as the curves, driven at two speeds to {100 * FURTHEST:g} %, nothing fitted.
The dozen: by number of units, a wall whose campaign and first printed mode no smaller one has. *rate*: difference of
the peaks at the two speeds. *left*: force at the end over the peak.

{chr(10).join(markdown(lines))}

DEM over path, the dozen: {ratio[own].min():.3f} to {ratio[own].max():.3f}.

All {len(walls)} with a response were driven, {sum(pushes[m.wall].seconds for m in walls):.0f} s of processor time:

- DEM over path: median {np.median(ratio):.3f}, {ratio.min():.3f} to {ratio.max():.3f}.
- Beyond {NEAR:.0%} of it: walls {" and ".join(far)}.
- The path of 147 stops at 0.07 %, before its wall rises again. 167 falls before its peak, dynamically in the DEM.
- The two speeds differ by more than {NEAR:.0%} in walls {", ".join(m.wall for m in fast)}. The slower run is quoted,
  {min(of_fast):.3f} to {max(of_fast):.3f} of the path.
- The mode is that of the path in {len(walls) - len(other)}. Of the other {len(other)}, {early} paths had stopped early.
- DEM over measured: median {s.median:.2f}, sd of ln {s.deviation:.3f}, 90 % {s.nine:.2f}.
- Drift at the peak within {WITHIN:g} of the measured one: {near} of {int(np.isfinite(drift).sum())}.
- Two engines agree on one model: what is wrong is in the model, not in how it is followed.
"""


def mode_at_peak(curve: WallCurve) -> str:
    """The same as the curve's mode, read at the peak."""
    slips, slid, apart, past = curve.inelastic(int(np.argmax(curve.force)))
    return "F" if slips + apart < INNER else mode_of_shares(slid, apart, past)


def modes_of(curves: Mapping[str, WallCurve], walls: Sequence[Measured]) -> Mapping[str, Sequence[str]]:
    """Modes just after the peak and at it, nothing fitted, and with a limit that the other campaigns choose."""
    found = [curves[m.wall] for m in walls]
    campaigns, printed = [m.campaign for m in walls], [first_mode(m.mode) for m in walls]
    known: dict[str, Sequence[str]] = {
        "just after the peak": [c.mode for c in found], "at the peak": [mode_at_peak(c) for c in found],
    }
    for name, at in (("just after the peak", [c.just_after for c in found]),
                     ("at the peak", [int(np.argmax(c.force)) for c in found])):
        shares = [c.inelastic(k) for c, k in zip(found, at, strict=True)]
        outer, inside = np.array([1.0 - s[0] - s[2] for s in shares]), [mode_of_shares(*s[1:]) for s in shares]
        known[f"{name}, limit of the other campaigns"] = threshold_left_out(outer, inside, printed, campaigns).modes
    return known


def _modes(curves: Mapping[str, WallCurve], walls: Sequence[Measured], pushes: Mapping[str, WallCurve],
           by_dem: Sequence[Measured]) -> str:
    """Confusion of modes by what gave way on the path."""
    text, lines = [], [["read", "right", "with sliding counted as shear"]]
    for by, all_walls, of in (("path", walls, curves), ("DEM", by_dem, pushes)):
        known = [m for m in all_walls if m.mode != "D"]
        for name, found in modes_of(of, known).items():
            pairs = [(first_mode(m.mode), mode) for m, mode in zip(known, found, strict=True)]
            right = sum(a == b for a, b in pairs)
            shear = sum({"SL": "S"}.get(a, a) == {"SL": "S"}.get(b, b) for a, b in pairs)
            lines.append([f"{by}, {name}", f"{right} of {len(pairs)} ({right / len(pairs):.0%})",
                          f"{shear} ({shear / len(pairs):.0%})"])
            if by == "path" and "limit" not in name:
                head = [f"path, {name}", *(f"computed {n}" for n in NAMES)]
                rows = [[f"measured {a}", *(str(pairs.count((a, b))) for b in NAMES)] for a in NAMES]
                text += [*markdown([head, *rows]), ""]
    return "## Failure modes by the curves\n\n" + "\n".join([*MODES_TEXT, "", *markdown(lines), "", *text])


MODES_TEXT = (
    "What gave way names the mode. Motions since the dead load are taken less what is elastic, which goes with the",
    "force. F: bed joints that slip and vertical planes that move apart have less than half of the motion of the top.",
    "Else SL, G and S as in limit analysis. *Just after the peak*: the force has fallen to 0.9 of it, or the end. This",
    "reading, with its half, was written down before any of its shares was seen. Those at the peak, and those whose",
    "limit the other campaigns choose, stand beside it. Read at the very end, as before, 17 and 22 of 53 were right.",
    "",
    "- The gate, 85 %, is not reached by curves. Limit analysis names 83 to 85 %, formulas 68 to 75 %.",
    "- Eight walls printed S slide on one bed joint after the peak, seven of them on the one under the beam. Held",
    "  there, they slide all the same, at a peak 0 to 4 % larger: it is no matter of the rig.",
    "- 137 to 139, printed S, rock to 0.4 % and lose nothing. Their forces are 0.94 to 1.20 of those measured.",
    "- Walls printed H-FS rock up to the peak and crack after it: which comes first hangs on where it is read.",
    "- Vertical planes that slide past each other count as no shear here. Counted as distortion, past H / L, 25 of 53",
    "  are right just after the peak, 28 at it: tried after the rest was seen, and not taken.",
)


def envelope_lines(curves: Mapping[str, WallCurve], by: str = "path") -> list[list[str]]:
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
            f"{name}, {by}", f"{force / most:.2f}", f"{drift:.3f}, measured {at:.3f}", f"{drift / at:.2f}",
            "yes" if 1.0 / WITHIN <= drift / at <= WITHIN else "no", f"{rise:.2f}", f"{left / force:.2f}",
            f"{theirs / most:.2f}", f"{end:.2f}", str(row.status),
        ])
    return lines


def _envelopes(curves: Mapping[str, WallCurve], pushes: Mapping[str, WallCurve]) -> str:
    return "\n".join([
        "## Envelopes", "",
        "The six walls whose envelopes were measured, positive sense, beside the computed curve. In the figure each is",
        "divided by its largest force.", "",
        *markdown([*envelope_lines(curves), *envelope_lines(pushes, "DEM")[1:]]), "",
        "Three of six reach their peak at half to six tenths of the measured drift. They slide on one bed joint once",
        "its cohesion is gone, and keep more than eight tenths of the force. The tests cracked diagonally and kept",
        "four to seven tenths.", "",
        "![envelopes](measured-walls-envelopes.png)", "",
    ])
