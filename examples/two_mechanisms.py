"""Two mechanisms of one wall: the figure of the README, both flow rules side by side."""

from matplotlib.figure import Figure

from limitmason import experiments, figures, limit_analysis

test = experiments.load("ferris-tin-loi-2001", "wall-4")
wall, loads = test.assembly(), test.loads()
associative = limit_analysis(wall, loads)
lowest = limit_analysis(wall, loads, flow_rule="non-associative", search="quick")

with figures.print_style():
    figure = Figure(figsize=(10.0, 5.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for ax, name, prediction, published in (
        (left, "associative (psi = phi)", associative, test.published["associative"]),
        (right, "no dilatancy (psi = 0)", lowest, test.published["non-associative"]),
    ):
        heading = f"{name}: λ = {prediction.collapse_multiplier:.3f}, published {published:.3f}"
        figures.mechanism(wall, prediction, ax=ax, caption=False, legend=ax is left, title=heading)
    handles = left.get_legend().legend_handles
    left.get_legend().remove()
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    figure.savefig("wall.png", dpi=160)
print(f"associative {associative.collapse_multiplier:.5f}, non-associative {lowest.collapse_multiplier:.5f}")
