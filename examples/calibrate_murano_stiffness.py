"""Joint stiffness from natural frequencies: two stone walls, the first stage of the fit in two stages.

The source fits stiffness first, kn = 2 ks, from averages of the literature that are two outliers; here from their
medians. The frequencies are those of its 3DEC models (the measured ones are not printed), the bond is assumed. Every
frequency goes with the root of the stiffness, so that three of them tell one number three times: their scatter about
the fit is the error of this bond. The second stage, c = 1.25 ft from the peak, needs a driven brittle model.
"""

import sys
from pathlib import Path

import limitmason as lm

sys.path.insert(0, str(Path(__file__).parents[1]))  # of the source tree, whose validation holds the models
from validation import murano_literature as literature

SCATTER = 0.05  # of a frequency between two programs; assumed

fits = {}
for name, masonry in (("DS", "dry"), ("REGW", "mortar")):
    wall = lm.experiments.load("murano-u-walls", name)
    known = literature.summary(masonry)["normal stiffness"]
    model = lm.calibration.JointModel(wall.assembly(), lambda a: {"frequency": lm.modes(a, 3).frequency})
    target = [float(wall.published[f"3DEC frequency {k}"]) for k in (1, 2, 3)]
    fit = lm.calibrate(
        model, {"frequency": lm.Target(target, SCATTER, unit="Hz")},
        [lm.Parameter("normal_stiffness", 1e9 * known.median, (1e8, 1e12), unit="Pa/m")],
        ties={"shear_stiffness": literature.TIES["shear_stiffness"]}, search=lm.calibration.SearchSettings(starts=1),
    )
    print(f"{name}: average {known.printed:g} GPa/m, median {known.median:g}, the source's fit {wall.row['kn']}")
    print(fit)
    for _, label, measured, fitted, residual in fit.rows:
        print(f"  {label}: 3DEC {measured:.2f} Hz, fitted {fitted:.2f} Hz, {residual:+.1f} deviations")
    fits[name] = fit
rows = [(f"mode {k}", row[2], row[3], name) for name, fit in fits.items() for k, row in enumerate(fit.rows, 1)]
figure = lm.figures.predicted_against_published(rows, quantity="frequency [Hz]", published="3DEC", predicted="fitted")
figure.savefig("calibrate_murano_stiffness.png")
