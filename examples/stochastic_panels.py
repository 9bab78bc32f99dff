"""Brick panels whose bricks and joints vary, 4 sets, spatial and not, beside the published means and spreads.

    python stochastic_panels.py                          the runs that are stored beside the examples
    python stochastic_panels.py --runs 300 --store DIR   computes, some seconds a run; goes on where DIR ends

The outline of the panel is inferred, not published; bricks are rigid, compliance lumped in the joints, which lose
cohesion and tensile strength by opening. Headline: strengths linked by c = 2 ft tan(phi), joint by joint.
"""

import csv
import sys
from pathlib import Path

import dem
import limitmason as lm
from limitmason import study
from limitmason.experiments import stochastic_brick_panels as published
from limitmason.text_table import markdown

STORED = Path(__file__).parent / "stored" / "stochastic_panels.csv"
STEPS = 6000  # over 1.5 mm; a third of the speed for the noise floor
TRAVEL = 1.5e-3  # [m]
NAMES = {
    "young modulus": ("young_modulus", 1e6), "poisson ratio": ("poisson_ratio", 1.0),
    "normal stiffness": ("normal_stiffness", 1e9), "friction angle": ("friction_angle_deg", 1.0),
    "cohesion": ("cohesion", 1e6), "tensile strength": ("tensile_strength", 1e6),
}  # fmt: skip
SPREAD = {k: published.properties()[k] for k in NAMES}
PANEL = lm.experiments.load("brick-panels-opening", "S1", dilation_deg=0.0).with_options(
    young_modulus=7e9, poisson_ratio=0.15, kn=13.5e9, ks=13.5e9 / 2.32, friction_deg=30.0, cohesion=0.046e6,
    tensile_strength=0.040e6,
)  # fmt: skip


def push(assembly, loads, steps=STEPS):
    """Ultimate load, load at the first joint 0.15 mm open, and mode of one panel."""
    curve = dem.push(assembly, PANEL.drive(), to=TRAVEL, blocks="lumped", steps=steps, rate_check=False, samples=400)
    crack = curve.first_crack(0.15e-3)
    return {"ultimate": curve.peak.load, "at": curve.peak.displacement, "mode": curve.mode.name,
            "crack": float("nan") if crack is None else crack.load}  # fmt: skip


def slow_push(assembly, loads):
    """The same at a third of the speed."""
    return push(assembly, loads, 3 * STEPS)


def draws(number, spatial, linked=True):
    """What ``monte_carlo`` draws in a set."""
    own = published.drawn(number)
    joints, blocks, links = {}, {}, {}
    for name, value in own.items():
        if name not in NAMES or (linked and name == "cohesion"):
            continue
        keyword, unit = NAMES[name]
        brick = name in ("young modulus", "poisson ratio")
        per = ("block" if brick else "interface") if spatial else "assembly"
        draw = study.Random(study.normal(unit * value.mean, value.variation), per=per)
        (blocks if brick else joints)[keyword] = draw
    if "shear stiffness" in own:
        links["shear_stiffness"] = published.LINKS["shear_stiffness"]
    if "cohesion" in own and linked:
        links["cohesion"] = published.LINKS["cohesion"]
    return {"joints": joints, "blocks": blocks, "links": links}


def compute(runs, folder):
    """Tables by name, from a folder of stores."""
    wall = (PANEL.assembly(), lm.Loads.weight)
    tiny = {"friction_angle_deg": study.Random(study.normal(30.0, 1e-6))}
    common = {"scheme": "random", "progress": print}
    out = {"floor": study.monte_carlo(wall, max(runs // 10, 2), run=push, joints=tiny, seed=9,
                                      store=folder / "floor.jsonl", **common),
           "floor-third": study.monte_carlo(wall, max(runs // 20, 2), run=slow_push, joints=tiny, seed=9,
                                            store=folder / "floor-third.jsonl", **common)}  # fmt: skip
    for number in (1, 2, 3, 4):
        for kind in ("spatial", "non-spatial"):
            name = f"set{number}-{kind}"
            out[name] = study.monte_carlo(wall, runs, run=push, seed=1, store=folder / f"{name}.jsonl",
                                          **draws(number, kind == "spatial"), **common)  # fmt: skip
    for kind in ("spatial", "non-spatial"):
        name = f"set4-{kind}-independent"
        out[name] = study.monte_carlo(wall, runs, run=push, seed=1, store=folder / f"{name}.jsonl",
                                      **draws(4, kind == "spatial", linked=False), **common)  # fmt: skip
    lasting = (PANEL.with_options(loss="nothing").assembly(), lm.Loads.weight)
    for kind in ("spatial", "non-spatial"):
        name = f"set4-{kind}-nothing"
        out[name] = study.monte_carlo(
            lasting, runs, run=push, seed=1, store=folder / f"{name}.jsonl", **draws(4, kind == "spatial"), **common
        )
    return out


def stored():
    """Tables by name, from the file beside the examples."""
    rows = {}
    with STORED.open(encoding="utf-8") as file:
        for r in csv.DictReader(file):
            numbers = {k: float(r[k]) for k in ("ultimate", "at", "crack")}
            rows.setdefault(r["study"], []).append({"sample": int(r["sample"]), **numbers, "mode": r["mode"]})
    return {name: study.Table(tuple(own)) for name, own in rows.items()}


def both(value, error):
    """A percentage with its sampling error."""
    return f"{100 * value:.1f} +- {100 * error:.1f}"


tables = stored()
if "--runs" in sys.argv:
    where = Path(sys.argv[sys.argv.index("--store") + 1])
    tables = compute(int(sys.argv[sys.argv.index("--runs") + 1]), where)

spreads = {name: study.running(t, "ultimate") for name, t in tables.items() if len(t) > 1}
lines = [
    ["set", "runs", "mean [kN]", "published", "CoV [%]", "published", "ratio of CoV", "published", "shift of mean"]
]
ratios = {}
for number in (1, 2, 3, 4):
    a, b = (spreads[f"set{number}-{k}"] for k in ("spatial", "non-spatial"))
    ratios[number] = a.variation[-1] / b.variation[-1]
    error = ratios[number] * (a.variation_error[-1] ** 2 + b.variation_error[-1] ** 2) ** 0.5
    cases = [lm.experiments.load(published.NAME, f"set-{number}-{k}").published for k in ("spatial", "non-spatial")]
    (mean_a, cov_a), (mean_b, cov_b) = ([float(v) for v in c.values()] for c in cases)
    for kind, own, mean, cov in (("spatial", a, mean_a, cov_a), ("non-spatial", b, mean_b, cov_b)):
        first = kind == "spatial"
        value = own.mean[-1] / 1e3
        lines.append([
            f"{number} {kind}", f"{int(own.n[-1])}", f"{value:.2f} +- {value * own.mean_error[-1]:.2f}",
            f"{mean:.2f}", both(own.variation[-1], own.variation[-1] * own.variation_error[-1]), f"{cov:.1f}",
            f"{ratios[number]:.2f} +- {error:.2f}" if first else "", f"{cov_a / cov_b:.2f}" if first else "",
            f"{a.mean[-1] / b.mean[-1] - 1.0:+.1%} (published {mean_a / mean_b - 1.0:+.1%})" if first else "",
        ])  # fmt: skip
print("\n".join(markdown(lines)))
print("\nnoise floor, strengths that differ by one part in a million:")
for name, text in (("floor", "at the speed of the runs"), ("floor-third", "at a third of it")):
    print(f"  {text}: {spreads[name]}")
for kind in ("spatial", "non-spatial"):
    print(f"set 4 {kind}, strengths drawn each by itself: {spreads[f'set4-{kind}-independent']}")
    print(f"set 4 {kind}, joints that lose nothing: {spreads[f'set4-{kind}-nothing']}")
for name in ("set1-spatial", "set1-non-spatial"):
    shares = ", ".join(f"{s.name} {s.share:.0%}" for s in study.shares(tables[name], "mode"))
    crack = tables[name]["crack"].astype(float)
    seen = crack == crack  # NaN where no joint opened so far
    text = f"{name}: modes {shares}; first crack {crack[seen].mean() / 1e3:.2f} kN in {seen.sum()} runs"
    if seen.sum() > 4:
        text += f", rank correlation with the peak {study.sensitivity(tables[name], 'ultimate', ['crack'])[0].rank:.2f}"
    print(text)
