"""What failed joints keep, what cracks first, and the calibrated set exactly as printed.

    python -m validation.brick_panels.residual --store FOLDER [--starts 3] [--page docs/papers/panels.md]

goes on where FOLDER ends, and writes ``residual.csv`` and ``as_printed.csv`` beside this file. From these the page of
the panels has its section, which --page writes anew by itself; the other sections take hours.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import dem
from limitmason import study
from limitmason.display.text_table import markdown
from limitmason.experiments import load
from limitmason.experiments.brick_panels_opening.layout import OUTLINES
from limitmason.experiments.source_folder import read_table
from limitmason.storage.csv_table import parsed, write_table
from validation.kept_runs import with_section
from validation.stochastic.readings import MOVED, told

from .runs import NAME, SPACING, TRAVEL, nudged
from .slopes import log_slopes

KEPT = (0.0, 0.25, 0.5)
"""Shares of the cohesion that failed joints keep."""
LAYOUTS = (("675/8/5", 0.0), ("787.5/8/4", 0.0), ("675/8/5", 0.1125))
"""Outline, and bearing of the soldiers on each pier [m]: neither is printed."""
STEPS = 45_000
PANELS = (*(("S1", outline) for outline in OUTLINES), ("L1", "787.5/8/4"), ("L1", "562.5/8/4"))
AS_PRINTED = {"dilation_deg": 12.0, "young_modulus": 1.67e9, "poisson_ratio": 0.14}
"""What Table 4 prints and the other runs of the page have otherwise."""
PLACES = ("between soldiers", "beds of piers", "heads above", "beds above", "beds over piers", "soldier at pier")
HERE = Path(__file__)
STORED = {name: HERE.with_name(f"{name}.csv") for name in ("residual", "as_printed")}
POINT = ("outline", "bearing", "kept", "run", "start")


def pushed(
    test: Any, *, kept: float = 0.0, start: int = 0, to: float = TRAVEL, steps: int = STEPS, samples: int = 300
) -> dem.PushCurve:
    """A panel whose failed joints keep a share of their cohesion."""
    wall = nudged(test.assembly(), start).with_joints(lambda j: replace(j, residual_cohesion=kept * j.cohesion))
    return dem.push(
        wall, test.drive(), to=to, blocks="lumped", steps=steps, rate_check=False, samples=samples, sound=True,
        contact_points=SPACING, damping=dem.Damping(0.5, combined=True),
        settle=dem.Settle(tolerance=1e-5, gently=2000), detect_every=None,
    )


def one(outline: str, bearing: float, kept: float, run: str, start: int) -> dict[str, Any]:
    """Peak, and when every place first moves."""
    found = told(pushed(load(NAME, run, outline=outline, bearing=bearing), kept=kept, start=start))
    return {k: v for k, v in found.items() if k != "curve" and not k.endswith(": part")}


def as_printed(panel: str, outline: str) -> dict[str, Any]:
    """The same of a panel with the set of Table 4, driven on to 6 mm, and its cracks."""
    curve = pushed(load(NAME, panel, outline=outline, **AS_PRINTED), to=6e-3, steps=60_000, samples=600)
    found, crack = told(curve), curve.first_crack(0.2e-3)
    kept = {k: v for k, v in found.items() if k != "curve" and not k.endswith(": part")}
    return {**kept, "failure": curve.first_failure.load, "crack": None if crack is None else crack.load}


def points(starts: int) -> Iterator[dict[str, Any]]:
    """Every run; all of one start before those of the next."""
    for start in range(starts):
        for (outline, bearing), kept, number in product(LAYOUTS, KEPT, range(1, 19)):
            run = f"udec-{number:02d}"
            yield {"outline": outline, "bearing": bearing, "kept": kept, "run": run, "start": start}


def write(path: Path, words: Sequence[str], rows: Sequence[dict[str, Any]]) -> None:
    """Lines of a table; words first, loads in [N], displacements in [m]."""
    numbers = [n for n in rows[0] if n not in words]
    units = dict.fromkeys(words, "-")
    units |= {n: "-" if n == "left" else "m" if n == "at" or n.endswith(" at") else "N" for n in numbers}
    lines = [[*(r[w] for w in words), *("" if r[n] is None else f"{r[n]:.6g}" for n in numbers)] for r in rows]
    write_table(path, units, lines)


def read(name: str) -> list[dict[str, str]]:
    """Lines of one of the two tables."""
    kept = parsed(STORED[name].read_text(encoding="utf-8"), STORED[name].name)
    return [dict(zip(kept.header, cells, strict=True)) for cells in kept.rows]


def order(row: dict[str, str]) -> str:
    """Places in the order in which they first move, those that do not left out."""
    known = [(float(row[f"{p}: first at"]), p) for p in PLACES if row[f"{p}: first at"]]
    return ", ".join(p for _, p in sorted(known))


def before_shear(row: dict[str, str]) -> bool:
    """Whether soldiers bend, then piers open below, then cracks step up, as the source of the random panels says."""
    at = {p: float(row[f"{p}: first at"] or np.inf) for p in PLACES}
    steps = min(at["beds above"], at["beds over piers"])
    return at["between soldiers"] <= at["beds of piers"] <= steps and at["beds of piers"] < np.inf


def section(published: Sequence[dict[str, str]]) -> list[str]:
    """What the page of the panels says of these runs.

    Parameters
    ----------
    published : lines of Table 2
    """
    printed = np.array([float(r["V_failure"]) for r in published])
    table = [["outline", "soldiers bear on [mm]", "kept", "runs", "tan(phi)", "c", "ft", "ours / print", "scatter",
              "starts differ by [%]", "printed order in"]]
    rows = read("residual")
    for (outline, bearing), kept in product(LAYOUTS, KEPT):
        own = [r for r in rows if (r["outline"], float(r["bearing"]), float(r["kept"])) == (outline, bearing, kept)]
        starts = len(own) // 18
        if not starts:
            continue
        loads = np.array([[1e-3 * float(r["ultimate"]) for r in own[18 * k : 18 * k + 18]] for k in range(starts)])
        middle = np.median(loads, axis=0)
        log = np.log(middle / printed)
        apart = 100.0 * np.median(np.std(loads, axis=0, ddof=1) / middle) if starts > 1 else float("nan")
        met = sum(before_shear(r) for r in own)
        table.append([outline, f"{1e3 * bearing:g}", f"{kept:g} c", f"{18 * starts}", *(
            f"{v:.2f} +- {e:.2f}" for v, e in zip(*log_slopes(published, middle), strict=True)),
            f"{np.exp(log.mean()):.2f}", f"{log.std(ddof=1):.2f}", f"{apart:.1f}", f"{met} of {len(own)}"])
    exponents, errors = log_slopes(published, printed)
    table.append(["print", "not printed", "not printed", "18", *(
        f"{v:.2f} +- {e:.2f}" for v, e in zip(exponents, errors, strict=True)), "1", "-", "-", "-"])
    panels = [["panel", "outline", "first failure [kN]", "0.2 mm crack [kN]", "peak [kN]", "at [mm]", "what moves"]]
    for r in read("as_printed"):
        panels.append([r["panel"], r["outline"], *(f"{1e-3 * float(r[k]):.2f}" for k in (
            "failure", "crack", "ultimate")), f"{1e3 * float(r['at']):.1f}", order(r)])
    peaks = [1e-3 * float(r["ultimate"]) for r in read("as_printed") if r["panel"] == "S1"]
    low, high = min(peaks), max(peaks)
    return [
        "## The calibrated set exactly as printed, and the order of cracks", "",
        f"**With every number of Table 4 as printed, S1 to S4 peak at {low:.1f} to {high:.1f} kN on three outlines; "
        "the tests have 3.69 to 5.67 kN.** E is then 1.67 GPa and psi 12 degrees without end. With 16.7 GPa, the "
        "modulus of Tables 2 and 3, they lie higher, see above. Lumped bricks, first contacts kept, one speed.", "",
        *markdown(panels), "",
        f"- Beside the mean of the tests, 4.77 kN, that is {low / 4.77 - 1:+.0%} to {high / 4.77 - 1:+.0%}. With 16.7 "
        "GPa it was +26 to +39 %. E as printed takes most of that error.",
        "- The tests' first visible cracks, 0.72 to 1.71 kN, lie where joints first reach their strength. A crack of "
        "0.2 mm, which the paper calls visible, comes at twice that.",
        "- L1 has 0.1 and 1.6 kN. Its two possible outlines enclose both.",
        f"- *What moves* lists places by the first opening or slip of {1e3 * MOVED:g} mm. The paper on random panels "
        "says: soldiers bend, bed joints of the supports open, cracks step up, a soldier shears.", "",
        "Runs of Table 2 in this way, medians of the starts. *Printed order*: soldiers, then beds of the piers, then "
        "the first crack that steps up.", "", *markdown(table), "",
        "- Shape and level pull apart. The more failed joints keep, the nearer are the exponents of c and ft to print, "
        "and the farther is the level.",
        "- The printed order of cracks speaks for 675/8/5.",
        "- Soldiers that bear on half a brick of the piers bring the exponent of tan(phi) up to 0.1 nearer to print. "
        "The level stays.",
        "- Three starts, moved by 1e-10 m, differ by less than a per cent: the scatter about print is not theirs.", "",
    ]


def main() -> None:
    """Make what is missing and write the lines."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--starts", type=int, default=1)
    parser.add_argument("--page", type=Path, default=None, help="page whose section is written anew")
    chosen = parser.parse_args()
    panels = [{"panel": panel, "outline": outline} for panel, outline in PANELS]
    table = study.sweep(as_printed, panels, store=chosen.store / "as_printed.jsonl", key="as printed", progress=print)
    write(STORED["as_printed"], ("panel", "outline"), table.rows)
    table = study.sweep(one, list(points(chosen.starts)), store=chosen.store / "residual.jsonl",
                        key=f"residual {STEPS}", progress=print)
    write(STORED["residual"], POINT, table.rows)
    if chosen.page is not None:
        text = chosen.page.read_text(encoding="utf-8")
        own = section(read_table(NAME, "udec_runs.csv").rows)
        chosen.page.write_text(with_section(text, own), encoding="utf-8")


if __name__ == "__main__":
    main()
