"""The figure of the README: one wall, its mechanisms under both flow rules side by side."""

import sys
from pathlib import Path

from matplotlib.figure import Figure

from limitmason import experiments, figures, limit_analysis

OUT = Path(sys.argv[sys.argv.index("--out") + 1]) if "--out" in sys.argv else Path()  # folder for the figures
OUT.mkdir(parents=True, exist_ok=True)

test = experiments.load("ferris-tin-loi-2001", "wall-4")
wall, loads = test.assembly(), test.loads()
associative = limit_analysis(wall, loads)
lowest = limit_analysis(wall, loads, flow_rule="non-associative", search="quick")

with figures.print_style():
    figure = Figure(figsize=(10.0, 6.1), layout="constrained")
    left, right = figure.subplots(1, 2)
    for ax, name, prediction, published in (
        (left, "associative (psi = phi)", associative, test.published["associative"]),
        (right, "no dilatancy (psi = 0)", lowest, test.published["non-associative"]),
    ):
        heading = f"{name}: λ = {prediction.collapse_multiplier:.3f}, published {published:.3f}"
        figures.mechanism(wall, prediction, ax=ax, caption=False, legend=ax is left, title=heading)
    figure.savefig(OUT / "wall.png", dpi=160)
print(f"associative {associative.collapse_multiplier:.5f}, non-associative {lowest.collapse_multiplier:.5f}")
