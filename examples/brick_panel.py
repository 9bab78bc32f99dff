"""A brick panel with an opening: its spreader driven down, load-displacement curve, cracks, mode, and what is open.

    python brick_panel.py [--full]

The panel is S1 of the Bradford tests by the set of joints that the source calibrated on S1 to S4 (psi = 0). Its drawing
is lost: the outline is inferred from what the tables print, not published. Rigid bricks, their compliance lumped in the
joints. ``--full``: twice the steps and the other outlines.
"""

import sys

import dem
import limitmason as lm

FULL = "--full" in sys.argv

panel = lm.experiments.load("brick-panels-opening", "S1", dilation_deg=0.0)
print(panel.title, *panel.assumptions, sep="\n  ")
curves = {}
for outline in panel.open_options["outline"] if FULL else (panel.options["outline"],):
    test = panel.with_options(outline=outline)
    curve = dem.push(
        test.assembly(), test.drive(), to=1e-3, blocks="lumped", steps=30_000 if FULL else 10_000,
        label=f"DEM, outline {outline} inferred",
    )
    print(curve)
    crack = curve.first_crack(0.2e-3)
    if crack is not None:
        at = f"{crack.load / 1e3:.2f} kN, {1e3 * crack.displacement:.3f} mm"
        print(f"  a joint is 0.2 mm open at {at}: {crack.where}")
    curves[outline] = curve
curve = curves[panel.options["outline"]]
caption = "Outline inferred, not published; rigid bricks, compliance lumped in the joints."
figure = lm.figures.load_displacement(list(curves.values()), measured=panel, title="Panel S1", caption=caption)
figure.savefig("brick_panel.png")
lm.figures.cracks(curve, width=0.2e-3, title="Panel S1", caption=caption).savefig("brick_panel_cracks.png")
