"""Capacity curve of a dry wall: with and without dilation, beside what limit analysis says.

Wall 4 of Ferris and Tin-Loi (2001) with stiff joints: at psi = phi the path peaks at the associative multiplier, less
the change of geometry; at psi = 0 at the smallest multiplier published for it. Both then fall with the displacement.
"""

import limitmason as lm
from limitmason import experiments

curves, levels = {}, {}
for label, psi_deg in (("ψ = 0", 0.0), ("ψ = φ", 33.0238)):
    test = experiments.load("ferris-tin-loi-2001", "wall-4", dilatancy_deg=psi_deg)
    wall, loads = test.assembly(), test.loads()
    weight = float(wall.weights[~wall.fixed].sum())
    curve = lm.pushover(wall, loads, stiffness=1e10, to=1.5e-3)
    worst = max(c.equilibrium for c in curve.certificates)
    point = curve.first_limit_point
    print(curve)
    print(f"  first limit point {point.load:.4f} at {1e3 * point.displacement:.3f} mm, unbalance {worst:.0e} blocks")
    curves[label] = (curve.displacement, weight * curve.multiplier)
levels["limit analysis, associative"] = weight * lm.limit_analysis(wall, loads, "associative").collapse_multiplier
levels["published, non-associative"] = weight * float(test.published["non-associative"])
figure = lm.figures.load_displacement(curves, levels=levels, title="Wall 4, dry joints, kn = ks = 10 GPa/m")
figure.savefig("capacity_curve.png")
