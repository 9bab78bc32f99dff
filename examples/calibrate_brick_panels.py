"""From tests to parameters: what four brick panels fix, what they leave free, and which test to make next.

The panel is the closed form after the published UDEC runs, seconds instead of hours; what it assumes stands in
``validation.panel_surrogate``. Any other model takes its place: a function, or
``lm.calibration.JointModel`` of a wall with a method. ``workers=2`` runs it side by side, ``store=`` keeps every run.
"""

import sys
from pathlib import Path

import limitmason as lm
from limitmason import experiments
from limitmason.experiments import brick_panels_opening

sys.path.insert(0, str(Path(__file__).parents[1]))  # of the source tree, whose validation holds the models
from validation import panel_surrogate as surrogate

# what is unknown, from literature values on, and how well it is wanted
unknown = [
    lm.Parameter("normal_stiffness", 83e9, (5e9, 5e11), unit="Pa/m"),
    lm.Parameter("shear_stiffness", 36e9, (2e9, 2e11), unit="Pa/m"),
    lm.Parameter("friction_angle_deg", 30.0, (20.0, 45.0), resolution=0.05, unit="deg"),
    lm.Parameter("cohesion", 1e5, (1e4, 5e5), resolution=0.05, unit="Pa"),
    lm.Parameter("tensile_strength", 1e5, (4e4, 4e5), resolution=0.05, unit="Pa"),
    lm.Parameter("dilatancy_angle_deg", 5.0, (0.5, 20.0), unit="deg"),
]

# what was measured: first crack and failure of S1 to S4; the text of the source has no stiffness. Four panels of one
# geometry scatter by about 18 % at failure and more at the first crack
panels = {}
for name in ("S1", "S2", "S3", "S4"):
    test = experiments.load("brick-panels-opening", name)
    panels[name] = {
        "first crack": lm.Target(1e3 * test.measured["first crack"], 0.35, unit="N"),
        "peak": lm.Target(1e3 * test.measured["failure load"], 0.18, unit="N"),
    }

fit = lm.calibrate(surrogate.panel_response, panels, unknown)
print("Four panels of one geometry\n")
print(fit)
print(f"\n{fit.left_out}\n")
rows = [(row[0], row[2] / 1e3, row[3] / 1e3, row[1]) for row in fit.rows]
figure = lm.figures.predicted_against_published(
    rows, quantity="load [kN]", published="measured", predicted="fitted", band=0.18, title="Four brick panels"
)
figure.savefig("calibrate_brick_panels.png")

# the paper's set meets the same numbers: it is one of many that do
joint = brick_panels_opening.joint(test)
paper = {p.name: getattr(joint, p.name) for p in unknown}
shown = surrogate.panel_response(**paper)
print(f"the paper's set: first crack {shown['first crack']:.0f} N, peak {shown['peak']:.0f} N")
for name, value in fit.predict(surrogate.panel_response).items():
    print(f"fitted: {name} {value.value:.4g}, parameters leave {value.low:.4g} to {value.high:.4g}")

# which small test would fix most of what is free
plan = fit.next_test({
    "pull-off": (surrogate.pull_off, {"strength": 0.05}),
    "column of two bricks": (surrogate.joint_column, {"slope": 0.05}),
    "triplet": (surrogate.triplet, {"shear strength 1": 0.05, "shear strength 2": 0.05, "shear strength 3": 0.05,
                                    "slope": 0.05, "dilatancy": 0.05}),
    "a fifth panel": (surrogate.panel_response, {"first crack": 0.35, "peak": 0.18}),
})
print(f"\n{plan}")
