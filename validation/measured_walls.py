"""The page of the measured walls: a ladder of models beside 146 walls, causes chosen with campaigns left out.

    python -m validation.measured_walls --out docs --store FOLDER

makes ``measured-walls.md`` and its figures, and ``validation/blind_walls.csv``. Answers are kept in the folder of
``--store`` as they come; a run that was cut off goes on.
"""

from __future__ import annotations

import argparse
import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mechanisms
from limitmason.comparison.wall_ladder import MODEL_SPREAD, ROCKS, WallPrediction, predict_walls
from limitmason.constants import VERSION
from limitmason.display.text_table import markdown as markdown_lines
from limitmason.experiments.modern_walls import MODELS, NAME, specimens
from limitmason.experiments.modern_walls.inputs import complete, inputs_of
from limitmason.experiments.registry import load as load_wall
from limitmason.storage.csv_table import parsed, write_table
from validation.measured_walls_text import TEXT
from validation.wall_acceptance import asked, by_hand
from validation.wall_causes import HELD, STIFFNESS, responses, stiffness
from validation.wall_curves import read_record
from validation.wall_curves_text import sections
from validation.wall_draws import drawn_logs
from validation.wall_figures import envelopes, scatter_figure, worst_walls
from validation.wall_loop import (
    LeftOut,
    ThresholdsLeftOut,
    difference,
    factored,
    first_mode,
    left_out,
    scatter,
    threshold_left_out,
)
from validation.wall_tests import RESPONSES, ROWS, Measured, measured_walls, rigid_bound

Array = NDArray[np.float64]
ABOVE = ("22", "24")  # walls above the rigid bound which the acceptance is asked with and without
BLIND = Path(__file__).with_name("blind_walls.csv")
TWO_SENSES, STIFFER = 1.4, 1.3  # ratios from which on a row is listed as doubtful
RIGID_ERROR = 1.1  # measured force over the rigid bound from which on a row is listed

DRY = {"tension_share": 0.0, "head_share": 0.0, "head_friction": 0.0, "unfilled_friction": 0.0}
CAUSES: Mapping[str, Mapping[str, Any]] = {
    "first": {}, "no tension in joints": {"tension_share": 0.0}, "head joints carry nothing": DRY,
    **{
        f"c {c:g}, filled heads {h:g}, cracks {k:g}": {
            **DRY, "cohesion_share": c, "head_friction": h, "cracks": "diagonal strength", "crack_factor": k,
        }
        for c, h, k in itertools.product((1.0, 0.6), (0.0, 0.25, 0.5), (2.0, 1.6, 1.2))
    },
}
"""Candidates of the block model: one cause after another, then shares of cohesion, friction of filled head joints and
the factor of the cracks in units."""


def logs(found: Iterable[WallPrediction], walls: Sequence[Measured]) -> Array:
    """ln(predicted / measured)."""
    by = {p.wall: p.force for p in found}
    return np.log([by[m.wall] / m.force for m in walls])


def four_forces(walls: Sequence[Measured]) -> Array:
    """The four formulas of every wall [kN], shape (walls, 4)."""
    found = []
    for m in walls:
        row, i = ROWS[m.wall], inputs_of(ROWS[m.wall])
        length, height, t = (float(row[k]) for k in ("L", "H", "t"))
        found.append(mechanisms.wall_forces(
            length, height, t, float(row["H0_over_H"]) * height, stress=1e6 * i["sigma0"].value,
            strength=1e6 * i["fc"].value, cohesion=1e6 * i["fv0"].value, friction=i["mu"].value,
            diagonal_strength=1e6 * i["ft"].value, unit=(1e-3 * float(row["lb"]), 1e-3 * float(row["hb"])),
        ))
    return 1e-3 * np.array(found)


def markdown(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table of Markdown."""
    return "\n".join(markdown_lines([head, *lines]))


# ---- parts of the page -----------------------------------------------------------------------------------------


def _line(name: str, found: Array, walls: Sequence[Measured]) -> list[str]:
    s = scatter(found)
    without = np.std(found[[m.wall not in ABOVE for m in walls]], ddof=1)
    modes = []
    for mode in ("S", "F", "H-FS"):
        own = found[[m.mode == mode for m in walls]]
        modes.append(f"{np.exp(np.median(own)):.2f}" if len(own) else "-")
    return [name, f"{s.median:.2f}", f"{s.deviation:.3f}", f"{without:.3f}", f"{s.middle:.2f}", f"{s.nine:.2f}", *modes]


HEAD = ["model", "median", "sd of ln", "without 22, 24", "median abs ln", "90 %", "S", "F", "H-FS"]


def ladder(walls: Sequence[Measured], causes: Mapping[str, Array], four: Array) -> tuple[str, str, LeftOut]:
    """Tables of the models, fixed and chosen with campaigns left out; what was chosen, and the difference."""
    force, campaigns = np.array([m.force for m in walls]), [m.campaign for m in walls]
    formulas = np.log(four.min(axis=1) / force)
    by_loop = left_out(causes, campaigns)
    formulas_loop = left_out(factored(four, force), campaigns)
    lines = [HEAD, _line("rocking alone", np.log(four[:, 0] / force), walls),
             _line("smallest of the four formulas", formulas, walls),
             _line("the same, three factors, campaigns left out", formulas_loop.logs, walls),
             *(_line(f"blocks: {name}", found, walls) for name, found in causes.items()),
             _line("**blocks, causes chosen, campaigns left out**", by_loop.logs, walls)]
    said = []
    for name, other in (("without factors", formulas), ("with factors in the same loop", formulas_loop.logs)):
        low, high = difference(by_loop.logs, other, campaigns)
        less = by_loop.logs.std(ddof=1) - other.std(ddof=1)
        said.append(f"- sd of the blocks less that of the formulas {name}: {less:+.3f}, 90 % of draws of campaigns "
                    f"{low:+.3f} to {high:+.3f}.")
    picks = Counter(by_loop.chosen.values())
    said += [f"- Chosen without {'one of ' if n > 1 else ''}{n} campaign{'s' if n > 1 else ''}"
             f"{'' if n > 1 else ' (' + next(c for c, k in by_loop.chosen.items() if k == name) + ')'}: *{name}*."
             for name, n in picks.most_common()]
    return markdown(lines[0], lines[1:]), "\n".join(said), by_loop


def modes_by_loop(
    walls: Sequence[Measured], causes: Mapping[str, list[WallPrediction]], chosen: Mapping[str, str]
) -> ThresholdsLeftOut:
    """Mode of every wall by the model and the threshold that the other campaigns choose."""
    campaigns, printed = [m.campaign for m in walls], [first_mode(m.mode) for m in walls]
    modes, thresholds = [""] * len(walls), {}
    for name in dict.fromkeys(chosen.values()):
        own = [p for m in walls for p in causes[name] if p.wall == m.wall]
        found = threshold_left_out(np.array([p.rocks for p in own]), [p.inside for p in own], printed, campaigns)
        for k, campaign in enumerate(campaigns):
            if chosen[campaign] == name:
                modes[k], thresholds[campaign] = found.modes[k], found.thresholds[campaign]
    return ThresholdsLeftOut(modes, thresholds)


def modes(walls: Sequence[Measured], found: Mapping[str, list[WallPrediction]], by_loop: ThresholdsLeftOut,
          four: Array) -> str:
    """Confusion of failure modes, hybrids by their first, and how many are right; formulas get a threshold too."""
    text = []
    inside = ["SL" if k == 0 else "S" for k in four[:, 1:].argmin(axis=1)]
    formulas = threshold_left_out(four[:, 1:].min(axis=1) / four[:, 0], inside, [first_mode(m.mode) for m in walls],
                                  [m.campaign for m in walls])
    names = [m.wall for m in walls]
    for method, answers in (
        ("formulas", {p.wall: p.mode for p in found["formulas"]}),
        ("formulas, threshold of the other campaigns", dict(zip(names, formulas.modes, strict=True))),
        ("extended, model and threshold of the other campaigns", dict(zip(names, by_loop.modes, strict=True))),
    ):
        pairs = [(first_mode(m.mode), answers[m.wall]) for m in walls if m.mode != "D"]
        names = ["S", "F", "SL", "G"]
        table = [[f"measured {a}", *(str(pairs.count((a, b))) for b in names)] for a in names]
        right = sum(a == b for a, b in pairs)
        shear = sum({"SL": "S"}.get(a, a) == {"SL": "S"}.get(b, b) for a, b in pairs)
        text += [markdown([method, *(f"predicted {n}" for n in names)], table),
                 f"Right: {right} of {len(pairs)} ({right / len(pairs):.0%}); with sliding counted as shear {shear} "
                 f"({shear / len(pairs):.0%})."]
    ends = min(by_loop.thresholds.values()), max(by_loop.thresholds.values())
    text.append(f"Thresholds chosen: {ends[0]:.3f} to {ends[1]:.3f} over {len(by_loop.thresholds)} campaigns left out.")
    return "\n\n".join(text).strip()


def coverage(walls: Sequence[Measured], found: Mapping[str, list[WallPrediction]]) -> str:
    """Share of walls inside the 90 % interval, scatter, and medians by unit type."""
    lines, kinds = [], sorted({ROWS[m.wall]["unit_type"] for m in walls})
    for method in ("formulas", "first", "extended"):
        by = {p.wall: p for p in found[method]}
        own = [m for m in walls if np.isfinite(by[m.wall].force)]
        inside = np.mean([by[m.wall].interval[0] <= m.force <= by[m.wall].interval[1] for m in own])
        s = scatter(logs(found[method], own))
        medians = []
        for kind in kinds:
            part = [m for m in own if ROWS[m.wall]["unit_type"] == kind]
            campaigns = len({m.campaign for m in part})
            medians.append(f"{np.exp(np.median(logs(found[method], part))):.2f} ({len(part)}, {campaigns})")
        lines.append([method, str(s.number), f"{s.median:.2f}", f"{s.deviation:.3f}", f"{inside:.0%}", *medians])
    table = markdown(["model", "walls", "median", "sd of ln", "in the 90 % interval", *kinds], lines)
    still = [m.wall for m in walls if np.isnan({p.wall: p for p in found["extended"]}[m.wall].spread)]
    note = f"\n\nOf {len(still)} walls the inputs of the extended model were not moved: the model's scatter alone."
    return table + (note if still else "")


def impossible(walls: Sequence[Measured]) -> str:
    """Rows above the rigid bound by more than an error of measurement."""
    lines = []
    for m in walls:
        ratio = m.force / rigid_bound(m.wall)
        if ratio > RIGID_ERROR:
            r = ROWS[m.wall]
            stress, span = float(r["sigma0"]) * ratio, float(r["H0_over_H"]) / ratio
            lines.append([m.wall, m.campaign, m.mode, r["H0_over_H"], f"{m.force:.0f}", f"{rigid_bound(m.wall):.0f}",
                          f"{ratio:.2f}", f"{stress:.2f} for {r['sigma0']}",
                          f"{span:.2f}" if span >= HELD else f"{span:.2f}, below what two held ends give"])
    head = ["wall", "campaign", "mode", "H0 / H", "measured [kN]", "N L / 2 H0 [kN]", "ratio", "sigma0 that would do",
            "H0 / H that would do"]
    return markdown(head, lines)


def doubtful(walls: Sequence[Measured]) -> str:
    """Other rows that do not agree with themselves, a line each."""
    lines = []
    for m in walls:
        row, said = RESPONSES[m.wall], []
        given = {k: float(v) for k, v in row.items() if k not in ("specimen", "failure_mode", "source") and v}
        senses = given["V_max_pos"], given["V_max_neg"]
        if max(senses) > TWO_SENSES * min(senses):
            said.append(f"forces of the two senses {senses[0]:.0f} and {senses[1]:.0f} kN")
        for sense in ("pos", "neg"):
            plateau, largest = given.get(f"V_bl_{sense}", 0.0), given.get(f"V_max_{sense}", np.inf)
            if plateau > 1.01 * largest:
                said.append(f"bilinear force {plateau:.0f} above the largest, {largest:.0f} kN")
            if given.get(f"d_cr_{sense}", 0.0) > given.get(f"d_Vmax_{sense}", np.inf):
                said.append("first crack after the largest force")
        over = responses()[m.wall][STIFFNESS] / stiffness(load_wall(NAME, m.wall))
        if over > STIFFER:
            said.append(f"{over:.1f} times as stiff as uncracked, gross, by the printed E")
        if said:
            lines.append(f"- {m.wall} ({m.campaign}): {'; '.join(said)}.")
    return "\n".join(lines)


def without_them(walls: Sequence[Measured], found: Mapping[str, list[WallPrediction]]) -> str:
    """Scatter of the models with and without the rows above the rigid bound."""
    below = [m for m in walls if m.force <= RIGID_ERROR * rigid_bound(m.wall)]
    lines = []
    for method, answers in found.items():
        for of in (walls, below):
            s = scatter(logs(answers, of))
            lines.append([method, str(s.number), f"{s.median:.2f}", f"{s.deviation:.3f}", f"{s.nine:.2f}"])
    return markdown(["model", "walls", "median", "sd of ln", "90 %"], lines)


def without_dilatancy(walls: Sequence[Measured], extended: list[WallPrediction], without: list[WallPrediction]) -> str:
    """The extended model with and without dilatancy on the same walls."""
    by = {p.wall: p for p in without}
    own = [m for m in walls if np.isfinite(by[m.wall].force)]
    ratio = np.exp(logs(without, own) - logs(extended, own))
    lines = []
    for name, found in (("extended", extended), ("the same without dilatancy", without)):
        s = scatter(logs(found, own))
        lines.append([name, str(s.number), f"{s.median:.2f}", f"{s.deviation:.3f}", f"{s.nine:.2f}"])
    took = sum(p.seconds for p in without) / 60.0
    left = [f"- {p.wall}: {p.status}." for p in without if not np.isfinite(p.force)]
    return "\n".join([
        markdown(["model", "walls", "median", "sd of ln", "90 %"], lines), "",
        f"Without dilatancy they carry {np.median(ratio):.2f} of what they carry with it, "
        f"{ratio.min():.2f} to {ratio.max():.2f}.",
        f"All {len(without)} walls took {took:.0f} min of processor time. Without an answer:", "", *left,
    ])


def carriers(walls: Sequence[Measured], loop: LeftOut, by_loop: ThresholdsLeftOut, number: int = 12) -> tuple[str, str]:
    """Walls that carry most of the scatter of the extended model, campaigns left out; walls whose mode is wrong."""
    share = (loop.logs - loop.logs.mean()) ** 2
    share /= share.sum()

    def line(k: int) -> list[str]:
        m = walls[k]
        return [m.wall, m.campaign, ROWS[m.wall]["unit_type"], ROWS[m.wall]["head_joints"],
                f"{np.exp(loop.logs[k]):.2f}", f"{share[k]:.0%}", f"{m.force / rigid_bound(m.wall):.2f}", m.mode,
                by_loop.modes[k]]

    head = ["wall", "campaign", "units", "heads", "ratio", "share of the variance", "over rigid bound", "mode", "ours"]
    wrong = [k for k, m in enumerate(walls) if by_loop.modes[k] != first_mode(m.mode)]
    most = np.argsort(-share)[:number]
    return markdown(head, [line(k) for k in most]), markdown(head, [line(k) for k in wrong])


def worst(walls: Sequence[Measured], found: list[WallPrediction], number: int = 10) -> tuple[list[str], str]:
    """The walls furthest off, and their table."""
    far = np.abs(logs(found, walls))
    order = [walls[k] for k in np.argsort(-far)[:number]]
    by = {p.wall: p for p in found}
    lines = [
        [m.wall, m.campaign, ROWS[m.wall]["unit_type"], ROWS[m.wall]["head_joints"], f"{m.force:.0f}",
         f"{by[m.wall].force:.0f}", f"{by[m.wall].force / m.force:.2f}", m.mode, by[m.wall].mode,
         f"{m.force / rigid_bound(m.wall):.2f}"]
        for m in order
    ]
    head = ["wall", "campaign", "units", "heads", "measured", "extended", "ratio", "mode", "ours", "over rigid bound"]
    return [m.wall for m in order], markdown(head, lines)


def write_blind(found: Mapping[str, list[WallPrediction]]) -> int:
    """Predictions of the walls whose responses are kept back, and how many; the same ones keep version and date."""
    rows = []
    kept = {tuple(r[:6]): r for r in parsed(BLIND.read_text(encoding="utf-8"), BLIND.name).rows}
    for wall in specimens():
        if ROWS[wall]["responses"] == "given":
            continue
        for method in ("formulas", "first", "extended"):
            p = next(p for p in found[method] if p.wall == wall)
            forces = (f"{v:.1f}" for v in (p.force, *p.interval))
            row = wall, method, *forces, p.mode
            rows.append(kept.get(row, [*row, VERSION, date.today().isoformat()]))
    units = dict.fromkeys(("wall", "model"), "-") | dict.fromkeys(("V_kN", "V_low_kN", "V_high_kN"), "kN")
    note = ("Walls of modern-walls whose responses are kept back, predicted without them; V is the mean of both "
            "senses, low and high hold 90 %.")
    write_table(BLIND, units | dict.fromkeys(("mode", "version", "date"), "-"), rows, note)
    return len(rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make everything that is missing, then the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--no-interval", action="store_true", help="do not move inputs: a draft in a fifth of the time")
    o = parser.parse_args(arguments)
    text = TEXT

    def solved(method: str, walls: Sequence[str] | None = None, file: str = "ladder", **more: Any) -> Any:
        show: Callable[[str], object] = lambda line: print(method, line, flush=True)  # noqa: E731
        return predict_walls(
            method, walls, store=o.store / f"{file}.jsonl", workers=o.workers, progress=show, **more
        )

    found = {"formulas": solved("formulas"), "first": solved("first", spread=False),
             "extended": solved("extended", spread=not o.no_interval),
             "non-associative": solved("non-associative", file="dilatancy", spread=False)}
    all_walls = [m for m in measured_walls() if ROWS[m.wall]["H0_over_H"] != "/"]
    whole = [m for m in all_walls if complete(ROWS[m.wall])]
    names = [m.wall for m in whole]
    causes = {
        name: solved("first", names, "causes", spread=False, options=options) for name, options in CAUSES.items()
    }
    four = four_forces(whole)
    table, chosen, loop = ladder(whole, {name: logs(answers, whole) for name, answers in causes.items()}, four)
    by_loop = modes_by_loop(whole, causes, loop.chosen)
    carry, wrong = carriers(whole, loop, by_loop)
    far, worst_table = worst(all_walls, found["extended"])
    curves, pushes = read_record(), read_record("dem")
    formulas_loop = left_out(factored(four, np.array([m.force for m in whole])), [m.campaign for m in whole]).logs
    parts = {
        "[asked]": asked(whole, all_walls, loop, formulas_loop, by_loop.modes, found, curves, pushes, ABOVE,
                         write_blind(found), drawn_logs(all_walls, o.store / "drawn.jsonl", workers=o.workers)),
        "[hand]": by_hand(), "[curves]": "\n".join(sections(curves, pushes)),
        "[ladder]": table, "[chosen]": chosen, "[modes]": modes(whole, found, by_loop, four),
        "[carriers]": carry, "[wrong]": wrong, "[coverage]": coverage(all_walls, found),
        "[impossible]": impossible(all_walls), "[doubtful]": doubtful(all_walls),
        "[dilatancy]": without_dilatancy(whole, found["extended"], found["non-associative"]),
        "[without]": without_them(all_walls, {k: v for k, v in found.items() if k != "non-associative"}),
        "[worst]": worst_table,
        "[model]": ", ".join(f"{k} {v}" for k, v in MODELS["extended"].items()),
        "[rocks]": f"{ROCKS:g}", "[spread]": ", ".join(f"{k} {v:g}" for k, v in MODEL_SPREAD.items()),
    }
    for mark, part in parts.items():
        text = text.replace(mark, part)
    (o.out / "measured-walls.md").write_text(text, encoding="utf-8")
    print(text)
    scatter_figure({k: found[k] for k in ("formulas", "first", "extended")}, all_walls, o.out / "measured-walls.png")
    worst_walls(far, {p.wall: p for p in found["extended"]}, o.out / "measured-walls-worst.png")
    envelopes(curves, o.out / "measured-walls-envelopes.png")


if __name__ == "__main__":
    main()
