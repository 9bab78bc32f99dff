"""The six walls of Ferris and Tin-Loi (2001): both flow rules beside the published values.

The non-associative multiplier is not unique: the published minima come from local solvers, and a lower value whose
certificate is clean is a finding. The quick search is used here; the standard one (the default, a quarter of a minute
for wall 6) finds 0.292 for wall 6.
"""

from limitmason import experiments, figures, limit_analysis

SOURCE = "ferris-tin-loi-2001"

print("wall    associative  published   non-associative  published   law violated by")
rows, found = [], {}
for name in experiments.specimens(SOURCE):
    test = experiments.load(SOURCE, name)
    wall, loads = test.assembly(), test.loads()
    upper = limit_analysis(wall, loads)
    lowest = limit_analysis(wall, loads, flow_rule="non-associative", search="quick")
    c = lowest.certificate
    violation = max(c.yield_violation, c.flow_residual, c.complementarity, c.equilibrium_residual)
    found[name] = (upper.collapse_multiplier, lowest.collapse_multiplier, violation)
    print(
        f"{name}  {upper.collapse_multiplier:11.5f}  {test.published['associative']:9.3f}   "
        f"{lowest.collapse_multiplier:15.5f}  {test.published['non-associative']:9.3f}   {violation:.0e}"
    )
    rows.append((name, float(test.published["associative"]), upper.collapse_multiplier, "associative"))
    rows.append((name, float(test.published["non-associative"]), lowest.collapse_multiplier, "non-associative"))
    if name == "wall-4":
        figures.mechanism(wall, lowest, title="Wall 4, non-associative").savefig("ferris_tin_loi_wall_4.png")
figures.predicted_against_published(rows, title="Ferris and Tin-Loi walls 1-6").savefig("ferris_tin_loi.png")
