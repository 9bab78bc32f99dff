"""Diagnosis of rounded block corners: in other programs and in our DEM, by limit analysis of sharp-cornered walls.

First the values of LMGC90 and UDEC on the six walls of Ferris and Tin-Loi, computed with corners rounded by 20 mm, are
treated as measurements: what survives of a list that does not know? Then the same rounding is planted in our own DEM
on twelve other walls, after the cross-code null (sharp DEM against sharp limit analysis) has given the error of method.

Simulated values are kept in stored/ and read back: delete the lines below its two heading rows, and all are computed
again (half an hour).
"""

import csv
from math import hypot
from pathlib import Path

import numpy as np

import dem
import limitmason as lm
from limitmason import causes as catalogue
from limitmason import experiments, figures
from limitmason.causes.joints import with_friction_factor
from limitmason.diagnosis import Cause, Extension, Noise, Study

STORE = Path(__file__).parent / "stored" / "diagnose_ferris_tin_loi.csv"
SOURCE, FRICTION, IN_PLANE = "ferris-tin-loi-2001", 0.65, (0.0, 1.0, 0.0)
STIFFNESS = {"normal_stiffness": 1e10, "shear_stiffness": 4e9}  # of the DEM's joints [Pa/m], nearly rigid


def other_friction(factor, assembly, loads):
    """All joints with tan(phi) times a factor."""
    return assembly.with_joints(lambda joint: with_friction_factor(joint, factor)), loads


PHYSICAL = [
    catalogue.edge_rounding((0.0, 30.0), plane_normal=IN_PLANE),
    catalogue.lost_overlap((0.0, 60.0)),
    catalogue.weak_base_joint(),
    Cause("friction", "friction_factor", 1.0, (0.6, 1.1), "all joints: tan(phi) x size",
          apply=other_friction),
]
ROUNDED = ((PHYSICAL[0], 1e3 * 0.020),)  # contact ends pulled in by 20 mm
# under a load in proportion to weight a lean of the wall and an offset of the angle are one and the same: listed once
MEASURED = [catalogue.angle_offset(), catalogue.gain()]


def model(specimen):
    """One of the six published walls by name, or a wall of our own with its window if it has one."""
    if "published" in specimen:
        test = experiments.load(SOURCE, specimen["published"])
        return test.assembly(), test.loads()
    length, courses, start, unit, hole = (specimen[k] for k in ("length", "courses", "start", "unit", "window"))
    window = [lm.build.Opening(x=hole[0], z=hole[1], width=hole[2], height=hole[3], lintel=unit[1])] if hole else []
    joint = lm.Joint.from_friction_coefficient(FRICTION, **STIFFNESS)
    wall = lm.build.wall(length=length, courses=courses, unit=(*unit, 0.175), start=start, joint=joint,
                         openings=window)
    return wall, lm.Loads.horizontal(wall)


def stored():
    """Values computed before, by name, method and extension."""
    with STORE.open(encoding="utf-8") as lines:
        return {key: float(value) for key, value in list(csv.reader(lines))[2:]}


def once(method, specimen, extend, solve):
    """Multiplier of one wall, read from the store or computed and added to it."""
    steps = extend.steps if extend else ()
    key = " | ".join([f"{method} {specimen['name']}", *(f"{cause.name} {size:.10g}" for cause, size in steps)])
    if key not in VALUES:
        assembly, loads = model(specimen)
        VALUES[key] = float(solve(*(extend(assembly, loads) if extend else (assembly, loads))).collapse_multiplier)
        with STORE.open("a", encoding="utf-8", newline="") as lines:
            csv.writer(lines, lineterminator="\n").writerow([key, f"{VALUES[key]:.9g}"])
    return VALUES[key]


def smallest(wall, loads):
    """Smallest multiplier that a quick search finds, or a thorough one where that finds none."""
    for search in ("quick", "standard", "thorough"):
        found = lm.limit_analysis(wall, loads, "non-associative", search=search, measure_jump=False)
        if found.status == "solved":
            break
    return found


def simulate(specimen, *, extend=None):
    """Limit analysis, psi = 0, sharp corners unless extended."""
    return once("limit", specimen, extend, smallest)


def simulate_rounded(specimen, *, extend=None):
    """The same with the rounding that the programs were given."""
    return once("limit", specimen, Extension((*ROUNDED, *(extend.steps if extend else ()))), smallest)


def by_dem(specimen, *, extend=None):
    """Distinct elements, psi = 0, sharp corners unless extended."""
    options = {"error_budget": (), "tolerance": 3e-3}
    return once("dem", specimen, extend, lambda wall, loads: dem.collapse(wall, loads, **options))


def own(name, length, courses, start="whole", unit=(0.4, 0.175), window=None):
    """A wall of our own."""
    return {"name": name, "length": length, "courses": courses, "start": start, "unit": unit, "window": window,
            "block": unit[0], "slenderness": courses * unit[1] / length}


WALLS = [
    own("1 x 5", 0.4, 5), own("1.5 x 6", 0.6, 6, "half"), own("2 x 8", 0.8, 8), own("2 x 12", 0.8, 12),
    own("3 x 8", 1.2, 8, "half"), own("3 x 12", 1.2, 12), own("4 x 6", 1.6, 6, "half"), own("3 x 10", 1.2, 10),
    own("4 x 8, window", 1.6, 8, window=(0.4, 0.35, 0.8, 0.7)), own("small, 3 x 8", 0.75, 8, unit=(0.25, 0.12)),
    own("large, 2 x 6", 1.2, 6, unit=(0.6, 0.25)), own("small, 2 x 6", 0.5, 6, unit=(0.25, 0.12)),
]
published = []
for name in experiments.specimens(SOURCE):
    p = experiments.load(SOURCE, name).parameters
    slender = p["courses"] * p["block height"] / (p["width"] * p["block length"])
    common = {"name": name, "published": name, "slenderness": float(slender), "blocks": int(p["blocks"])}
    published += [{**common, "code": code} for code in ("LMGC90", "UDEC")]
VALUES = stored()


def theirs():
    """Rounded values of two other programs as measurements of a sharp simulation."""
    tests = {s["name"]: experiments.load(SOURCE, s["name"]) for s in published}
    values = np.array([float(tests[s["name"]].published[f"rounded {s['code']}"]) for s in published])
    apart = np.diff(np.log(values).reshape(-1, 2), axis=1).ravel()  # the programs against each other, wall by wall
    noise = Noise(float(np.sqrt((apart**2).mean() / 2)), len(apart))
    # no single cause is left here: pairs are put together from single effects, not simulated one by one
    study = Study(published, simulate, values, noise, covariates=["slenderness", "blocks", "code"],
                  groups=[s["name"] for s in published], levels=5, pair_tables="additive")
    causes = [
        catalogue.edge_rounding((0.0, 50.0), plane_normal=IN_PLANE), *PHYSICAL[1:], *MEASURED,
        catalogue.batch_shift(covariate="code", label="UDEC"),
    ]
    # the rounding is known: what comes on top of it?
    rest = Study(published, simulate_rounded, values, noise, covariates=["slenderness", "blocks", "code"],
                 groups=[s["name"] for s in published])
    return study, study.diagnose(causes), rest, rest.diagnose(causes[-3:])


def ours(planted_mm=20.0, error=0.02, seed=1):
    """Rounding planted in our DEM with an error of 2 %; first the null: sharp against sharp."""
    truth = Study(WALLS, by_dem)
    sharp, rounded = truth.baseline(), truth.predicted(PHYSICAL[:1], [planted_mm])
    shaken = np.exp(error * np.random.default_rng(seed).standard_normal(len(WALLS)))
    study = Study(WALLS, simulate, sharp, Noise(error), covariates=["slenderness", "block"],
                  groups=[s["name"] for s in WALLS], levels=5)
    method = float(np.sqrt(np.mean(np.log(sharp / study.baseline()) ** 2)))
    study = study.replace(noise=Noise(hypot(error, method)))
    causes = [*PHYSICAL, *MEASURED]
    null, planted = (study.replace(measured=v * shaken).diagnose(causes) for v in (sharp, rounded))
    return study, sharp, rounded, method, null, planted


if __name__ == "__main__":
    study, theirs_verdict, rest, rest_verdict = theirs()
    print("=== LMGC90 and UDEC, corners rounded by 20 mm, against sharp limit analysis ===")
    print(theirs_verdict.report())
    print("A program has no inclinometer: an angle offset stands for any equal loss of angle, such as a lean.\n")
    print("wall      limit analysis, 20 mm   HybriDFEM, 20 mm   LMGC90   UDEC   (values of others: published)")
    for s, value in zip(published[::2], rest.baseline()[::2], strict=True):
        p = experiments.load(SOURCE, s["name"]).published
        shown = "".join(f"{p[k]:>{w}.3f}" if k in p else " " * (w - 1) + "-" for k, w in
                        (("HybriDFEM rounded", 19), ("rounded LMGC90", 9), ("rounded UDEC", 7)))
        print(f"{s['name']:<8}{value:23.3f}{shown}")
    print(f"\n=== The same with the rounding switched on: what comes on top ===\n{rest_verdict.report()}")
    print(f"\n{study.confusable(theirs_verdict.listed)}")
    study, sharp, rounded, method, null, planted = ours()
    print("\n=== Rounding of 20 mm planted in our DEM ===")
    print("wall             limit analysis   DEM, sharp   DEM, rounded")
    for s, a, b, c in zip(WALLS, study.baseline(), sharp, rounded, strict=True):
        print(f"{s['name']:<16}{a:15.4f}{b:13.4f}{c:15.4f}")
    print(f"\nDEM against limit analysis, both sharp: {100 * method:.1f} % (declared as error of method)")
    print(f"Cross-code null: {null}\n\nPlanted: {planted.report()}")
    print(f"\n{study.confusable(planted.listed)}")
    for name, verdict in {"published": theirs_verdict, "planted": planted}.items():
        figures.diagnosis(verdict, quantity="collapse multiplier [-]", title=f"Rounded corners, {name}",
                          units={"slenderness": "-", "block": "m"},
                          ).savefig(f"diagnose_ferris_tin_loi_{name}.png")
