"""Diagnosis of the BNW walls by our own zoned units: peaks and drifts of BNW1 and BNW2 are judged, BNW3 is left out.

    python -m validation.bnw_causes [--kept FOLDER] [--out docs/papers]

reads ``bnw_causes.csv``, the runs of the page of the walls to its digits, and draws ``bnw-causes.png``. "slower" are
the runs of its first table, with and without crack planes; the others have one speed. --kept writes the file anew from
the pushes that ``validation.bnw_walls --kept`` has made.
"""

import argparse
import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from limitmason import causes as catalogue
from limitmason import experiments
from limitmason.diagnosis import Cause, Observation, Study
from limitmason.storage.csv_table import write_table

from .bnw_walls import CRACKING, MODELS, NAME, WALLS, once_pushed, pushed

BASE, SLOWER, UNCRACKED = "as assumed", "slower", "slower, units do not crack"
QUANTITIES = {"peak": "kN", "drift at the peak": "%"}
SCATTER = {"peak": 0.05, "drift at the peak": 0.3}
"""Assumed: peaks of the two senses of a wall differ by 1 to 5 %, their drifts by up to 60 %."""
ENDS = {
    ("fc", np.log(1.5)): "fc 1.5 times", ("fc", np.log(0.75)): "fc 0.75 times", ("E", np.log(2.0)): "E 6.18 GPa",
    ("friction", 0.2): "friction 0.6", ("friction", -0.2): "friction 0.2",
    ("ks", np.log(1.75 / 12.0)): "G: ks 1.75 GPa/m", ("ft", np.log(2.0)): "ft 0.4 MPa",
}
"""Runs from which effects are interpolated, by lever and its change: in logarithms, of friction in the coefficient."""
STORED = Path(__file__).with_suffix(".csv")


def stored() -> dict[tuple[str, str], dict[str, float]]:
    """What is kept, by wall and change."""
    lines = list(csv.reader(STORED.read_text(encoding="utf-8").splitlines()))[2:] if STORED.exists() else []
    return {(r[0], r[1]): dict(zip(QUANTITIES, map(float, r[2:]), strict=True)) for r in lines}


def keep(folder: Path) -> None:
    """Write the file anew from pushes that are kept in a folder; what is missing there is pushed."""
    rows = []
    for wall in WALLS:
        pushes = {c: once_pushed(wall, c, folder) for c in (BASE, *ENDS.values())}
        pushes |= {c: pushed(wall, folder, **MODELS[m]) for c, m in ((SLOWER, CRACKING), (UNCRACKED, "units yield"))}
        for change, p in pushes.items():
            top = p.curve.peak
            rows.append([wall, change, f"{1e-3 * top.load:.0f}", f"{p.drift(top.displacement):.2f}"])
    write_table(STORED, {"wall": "-", "change": "-", **QUANTITIES}, rows)


def simulate(
    specimen: Mapping[str, Any], *, fc: float = 1.0, modulus: float = 3.088, friction: float = 0.4, ks: float = 12.0,
    tension: float = 0.2, uncracked: float = 0.0,
) -> dict[str, float]:
    """Peak [kN] and drift [%] between the runs, in logarithms; effects of several causes multiply."""
    wall = specimen["wall"]
    out = _logs(wall, SLOWER) + uncracked * (_logs(wall, UNCRACKED) - _logs(wall, SLOWER))
    for lever, value in (("fc", np.log(fc)), ("E", np.log(modulus / 3.088)), ("friction", friction - 0.4),
                         ("ks", np.log(ks / 12.0)), ("ft", np.log(tension / 0.2))):
        if value:
            end = next(e for name, e in ENDS if name == lever and e * value > 0.0)
            out += value / end * (_logs(wall, ENDS[lever, end]) - _logs(wall, BASE))
    return dict(zip(QUANTITIES, np.exp(out).tolist(), strict=True))


RUNS = stored()


def _logs(wall: str, change: str) -> np.ndarray:
    return np.log([RUNS[wall, change][q] for q in QUANTITIES])


CAUSES = [
    Cause("strength of units", "fc", 1.0, (0.75, 1.5), "fc of the units over that of the masonry"),
    Cause("stiffer units", "modulus", 3.088, (3.088, 6.176), "E of the units", unit="GPa"),
    Cause("friction of joints", "friction", 0.4, (0.2, 0.6), "coefficient"),
    Cause("softer joints in shear", "ks", 12.0, (1.75, 12.0), "down to the G of the sister series", unit="GPa/m"),
    Cause("tension of units", "tension", 0.2, (0.2, 0.4), "ft of the units", unit="MPa"),
    Cause("units that do not crack", "uncracked", 0.0, (0.0, 1.0), "1: no crack planes"),
    catalogue.gain((0.7, 1.3)),
]


def measured(wall: str) -> dict[str, dict[str, float]]:
    """Peaks [kN] and their drifts [%] by sense."""
    found = experiments.load(NAME, wall).measured
    return {sense: {"peak": float(found[f"Vmax{sense}"]), "drift at the peak": float(found[f"drift at Vmax{sense}"])}
            for sense in "+-"}


def study() -> Study:
    """Eight numbers of two walls, both senses."""
    specimens = [{"name": f"{w}{sense}", "wall": w} for w in WALLS[:2] for sense in "+-"]
    rows = [Observation(s["name"], q, v, SCATTER[q], QUANTITIES[q]) for s in specimens
            for q, v in measured(s["wall"])[s["name"][-1]].items()]
    return Study(specimens, simulate, rows, covariates=(), groups=[s["wall"] for s in specimens], levels=9)


def draw(sets: Mapping[str, Mapping[str, float]]) -> Any:
    """Peaks of the three walls, measured and predicted."""
    figure, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for k, wall in enumerate(WALLS):
        known = [v["peak"] for v in measured(wall).values()]
        ax.plot([k - 0.25] * 2, known, "ko", ms=5, label="measured, both senses" if k == 0 else None)
        for j, (words, sizes) in enumerate(sets.items()):
            found = simulate({"wall": wall}, **sizes)["peak"]
            label = words if k == 0 else None
            ax.plot(k - 0.12 + 0.1 * j, found, marker="sDv^P"[j % 5], ls="none", color=f"C{j}", label=label)
    ax.set_xticks(range(len(WALLS)), [*WALLS[:2], f"{WALLS[2]}, left out"])
    ax.set(ylabel="peak [kN]", xlim=(-0.5, len(WALLS) - 0.4), ylim=(0.0, 1.08 * ax.get_ylim()[1]))
    ax.legend(fontsize=7, frameon=False, loc="lower right")
    return figure


def main() -> None:
    """Diagnose, and predict BNW3 with what is kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=None, help="folder of the figure")
    parser.add_argument("--kept", type=Path, default=None, help="folder of pushes from which the file is made anew")
    chosen = parser.parse_args()
    if chosen.kept is not None:
        keep(chosen.kept)
        RUNS.update(stored())
    verdict = study().diagnose(CAUSES, seed=0)
    print(verdict.report())
    by = {c.name: c.parameter for c in CAUSES if c.apply is None}
    tested = verdict.verdict.tested
    kept = [n for n, t in tested.items() if t.kept and set(n) <= set(by)]
    sets = {"as assumed": {}, "units that do not crack": {"uncracked": 1.0}} | {
        " + ".join(n): {by[c]: v for c, v in zip(n, tested[n].sizes, strict=True)} for n in kept
    }
    left = ", ".join(f"{v['peak']:g} kN at {v['drift at the peak']:.2f} %" for v in measured(WALLS[2]).values())
    print(f"{WALLS[2]}, left out: measured {left}")
    for words, sizes in sets.items():
        found = simulate({"wall": WALLS[2]}, **sizes)
        print(f"  {words}: {found['peak']:.0f} kN at {found['drift at the peak']:.2f} %")
    if chosen.out is not None:
        draw(sets).savefig(chosen.out / "bnw-causes.png", dpi=130)


if __name__ == "__main__":
    main()
