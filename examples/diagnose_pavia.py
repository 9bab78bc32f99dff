"""Diagnosis of twelve tilting tests: Pavia against the published 3DEC values, where no plan is known.

Godio, Stefanou and Sab 2017 publish two multipliers per specimen, for joints without dilatancy and with psi = phi. No
geometry and no covariates are at hand, so a cause can act on the output (zero of the inclinometer, gain of the
sensor), or along the one sensitivity that is published: log lambda between psi = 0 and psi = phi.
"""

import math

import numpy as np

from limitmason import causes as catalogue
from limitmason import experiments, figures
from limitmason.diagnosis import Cause, Noise, Study

SOURCE = "pavia-tilting"


def simulate(specimen, *, dilatancy=0.0, weaker=0.0):
    """3DEC multiplier, interpolated in log lambda between psi = 0 (share 0) and psi = phi (share 1)."""
    return specimen["psi_0"] * (specimen["psi_phi"] / specimen["psi_0"]) ** (dilatancy - weaker)


OFFSET = catalogue.angle_offset()  # read - true; a lean of the walls is its exact twin
GAIN = catalogue.gain((0.6, 1.4))
DILATANCY = Cause(
    "dilatancy",
    "dilatancy",
    0.0,
    (0.0, 1.0),
    "joints dilate by a share of phi (published, interpolated)",
    source="Godio, Stefanou and Sab 2017, table 5",
    isolate="shear one joint: opening against slip",
)
WEAKER = Cause("weaker interlock", "weaker", 0.0, (0.0, 1.5), "walls are weaker the more dilatancy would help: the "
               "published sensitivity extrapolated below psi = 0, a pointer")
LESS = Cause("less dilatancy", "dilatancy", 1.0, (0.0, 1.0), "joints dilate less than phi (published, interpolated)")

tests = [experiments.load(SOURCE, name) for name in experiments.specimens(SOURCE)]
specimens = [
    {
        "name": t.specimen,
        "psi_0": float(t.published["3DEC zero dilatancy"]),
        "psi_phi": float(t.published["3DEC dilatant"]),
    }
    for t in tests
]
measured = np.array([float(t.measured["lambda"]) for t in tests])
# nominal repeats, told by their equal published values: S1-S3 and S8-S9 (the repetition is inferred)
groups = [f"{s['psi_0']}/{s['psi_phi']}" for s in specimens]
repeats = [np.log(measured[[g == label for g in groups]]) for label in dict.fromkeys(groups)]
dof = sum(len(r) - 1 for r in repeats)
sd = math.sqrt(sum(((r - r.mean()) ** 2).sum() for r in repeats) / dof)
noise = Noise(sd, dof)

print(f"Scatter of nominal repeats: {100 * sd:.1f} %, {dof} degrees of freedom.\n")
print("specimen   measured   3DEC psi = 0   measured / 3DEC   3DEC psi = phi   measured / 3DEC")
for s, value in zip(specimens, measured, strict=True):
    shown = "".join(f"{s[k]:15.3f}{value / s[k]:18.2f}" for k in ("psi_0", "psi_phi"))
    print(f"{s['name']:<9}{value:10.3f}{shown}")


def dilatant(specimen, *, dilatancy=1.0, weaker=0.0):
    """The same model with psi = phi as its baseline."""
    return simulate(specimen, dilatancy=dilatancy, weaker=weaker)


verdicts = {}
for label, model, causes in (
    ("psi = 0", simulate, [OFFSET, GAIN, DILATANCY, WEAKER]),
    ("psi = phi", dilatant, [OFFSET, GAIN, LESS]),
):
    study = Study(specimens, model, measured, noise, groups=groups)
    verdicts[label] = verdict = study.diagnose(causes, seed=0)
    print(f"\n=== 3DEC with {label} ===\n{verdict.report()}\n\n{study.confusable(causes)}")
    figures.diagnosis(
        verdict, quantity="collapse multiplier [-]", title=f"Pavia tilting tests against 3DEC, {label}"
    ).savefig(f"diagnose_pavia_{label.replace(' = ', '_')}.png")
again = verdicts["psi = 0"].next_tests(specimens, k=4)
print("\nTo be repeated first:", ", ".join(s["name"] for s in again.specimens), f"(smallest d2 {again.before:.1f} -> "
      f"{again.after:.1f})")
print("What limits this: no plans, so no cause acts on a model; one friction only was computed; no covariates, so an "
      "effect\noutside the list shows as scatter; the noise rests on five repeats.")
