"""Brick panels whose joints vary at random: 4 sets, spatial and not, beside the published means and spreads.

The runs are read from a file: a run takes a second. ``python -m validation.stochastic --store FOLDER --runs 300``
makes them, goes on where FOLDER ends, and ``--out docs/papers`` writes the page. The outline of the panel is inferred,
not published; bricks are rigid, compliance lumped in the joints, which lose cohesion and tensile strength by opening.
Strengths are linked by c = 2 ft tan(phi), joint by joint.
"""

import csv
from pathlib import Path

import limitmason as lm
from limitmason import figures, study
from limitmason.display.text_table import markdown
from limitmason.experiments import stochastic_brick_panels as published

STORED = Path(__file__).parent / "stored" / "stochastic_panels.csv"

rows = {}
with STORED.open(encoding="utf-8") as file:
    # names, a comment with the units, lines
    for r in csv.DictReader(line for line in file if not line.startswith("#")):
        numbers = {k: float(r[k]) if r[k] else float("nan") for k in ("ultimate", "crack", "lone")}
        rows.setdefault(r["study"], []).append({"sample": int(r["sample"]), **numbers, "mode": r["mode"]})
tables = {name: study.Table(tuple(own)) for name, own in rows.items()}


def shown(number, kind):
    """A line of the table, and the spread of the peak."""
    found = study.running(tables[f"set{number}-{kind}"], "ultimate")
    mean, variation = (float(v) for v in lm.experiments.load(published.NAME, f"set-{number}-{kind}").published.values())
    value, spread = found.mean[-1] / 1e3, 100 * found.variation[-1]
    return found, [
        f"{number} {kind}", f"{int(found.n[-1])}", f"{value:.2f} +- {value * found.mean_error[-1]:.2f}", f"{mean:.2f}",
        f"{spread:.1f} +- {spread * found.variation_error[-1]:.1f}", f"{variation:.1f}",
    ]


lines = [["set", "runs", "mean [kN]", "published", "CoV [%]", "published"]]
spreads, ratios = {}, {}
for number in (1, 2, 3, 4):
    for kind in ("spatial", "non-spatial"):
        spreads[number, kind], line = shown(number, kind)
        lines.append(line)
    ratios[number] = spreads[number, "spatial"].variation[-1] / spreads[number, "non-spatial"].variation[-1]
print("\n".join(markdown(lines)))

# what the joints lose decides how far they average: the same draws, strengths alone
laws = {"opening takes all": "set4-{}", "cohesion stays": "set4-{}-kept", "nothing is lost": "set4-{}-nothing"}
by_law = {}
for words, form in laws.items():
    a, b = (study.running(tables[form.format(k)], "ultimate").variation[-1] for k in ("spatial", "non-spatial"))
    by_law[words] = a / b
    print(
        f"set 4, {words}: CoV {100 * a:.1f} % spatial, {100 * b:.1f} % non-spatial; ratio {a / b:.2f}, published 0.43"
    )

# and whether a panel breaks on one side: the part of its movement that the mirrored joint does not share
for kind in ("spatial", "non-spatial"):
    lone = tables[f"set1-{kind}"]["lone"].astype(float)
    print(f"set 1, {kind}: {(lone > 0.5).sum()} of {(lone == lone).sum()} runs break asymmetrically")

loads = {
    kind: study.Table(tuple({"load": r["ultimate"] / 1e3} for r in tables[f"set1-{kind}"]))
    for kind in ("spatial", "non-spatial")
}
figures.histogram(loads, "load", label="ultimate load [kN]", title="Set 1: all properties vary").savefig(
    "stochastic_panels.png"
)
