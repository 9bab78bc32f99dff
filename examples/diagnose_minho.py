"""Thirty-one peaks of 21 dry-joint shear walls: what the rigid-block model gets wrong, and what the data say of causes.

    python diagnose_minho.py [--simulator dem] [--cache FOLDER] [--full]

Both directions of the cyclic tests are measurements. The simulator is limit analysis (associative; psi = 0 lowers these
peaks by less than 2 %), or the DEM with joints of the measured modulus for a shorter list. Nothing is tuned. All walls
are judged, then each series alone: they differ in stone, height and rig.

Simulated peaks are kept in stored/ (or FOLDER) and read back, so that a run goes on after a kill.
"""

import argparse
import csv
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import dem
from limitmason import experiments, figures, limit_analysis
from limitmason.diagnosis import Cause, Measured, Noise, Study, catalogue

SOURCE, X, NU = "minho-dry-stone-2005-2009", (1.0, 0.0, 0.0), 0.2
FRICTION = {"SW": 0.62, "WS": 0.65}  # of another author's model; assumed within 0.5 to 0.75
MODULUS_WS = {40: 3287.0, 100: 3287.0, 175: 4068.0, 250: 4722.0}  # [MPa] cyclic walls; 40 kN assumed as 100 kN
UNITS = {"precompression": "MPa", "H0/L": "-", "block height": "mm"}


def raised_force(size, assembly, loads):
    """The horizontal force acts higher by the size [mm]; lower also for a beam that resists turning."""
    live = np.array(loads.live)
    live[:, 3:] += np.cross((0.0, 0.0, 1e-3 * size), live[:, :3])
    return assembly, replace(loads, live=live)


FORCE_HEIGHT = Cause("force height", "raised_mm", 0.0, (-400.0, 100.0), "the force acts higher (or, negative, the beam "
                     "resists turning): SW force height is given as 0.95 and 1.0 m", apply=raised_force, unit="mm",
                     isolate="record the rotation of the beam")  # fmt: skip
CAUSES = [
    catalogue.weak_base_joint(),
    catalogue.stress_dependent_friction(),
    catalogue.cohesion((0.0, 100.0)),
    catalogue.finite_compressive_strength((0.0, 0.5)),
    catalogue.edge_rounding((0.0, 40.0), plane_normal=(0.0, 1.0, 0.0)),
    catalogue.lost_overlap((0.0, 80.0)),
    catalogue.second_order_displacement((0.0, 1.0)),
    FORCE_HEIGHT,
    catalogue.out_of_plumb((-3.0, 3.0), direction=X),
    catalogue.eccentric_overload((-60.0, 60.0), direction=X),
    catalogue.overload_magnitude((0.5, 1.3)),
    catalogue.load_direction(),
    catalogue.gain((0.6, 1.6)),
    catalogue.rig_friction((-5.0, 10.0), unit="kN"),
    catalogue.batch_shift(covariate="direction", label="-"),
    catalogue.batch_shift(covariate="series", label="SW"),
    catalogue.batch_shift(covariate="cyclic", label="cyclic"),
]
DIRECTED = ("out-of-plumb", "eccentric overload")
BY_DEM = ("finite compressive strength", "stress-dependent friction", "edge rounding", "force height")
CAUSES_DEM = [c for c in CAUSES if c.acts_on == "measurement" or c.name in BY_DEM]
CAUSES_DEM.append(catalogue.joint_softness((0.0, 0.1)))  # on top of the measured modulus


@cache
def case(name, friction, direction):
    """Test, assembly and loads; "WS.100 x2" is that wall twice as high."""
    name, _, times = name.partition(" x")
    test = experiments.load(SOURCE, name).with_options(friction=friction)
    if times:
        p, times = test.parameters, float(times)
        higher = {"height": p["height"] * times, "courses": round(p["courses"] * times)}
        above = float(p["force height H0"] - p["height"])
        options = {**test.options, "force_height": 1e-3 * (higher["height"] + above)}
        test = replace(test, parameters={**p, **higher}, options=options)
    return test, test.assembly(), test.loads(direction)


def stored(file):
    """Peaks computed before, by wall, friction, direction and extension."""
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("wall and extension,peak\n-,kN\n", encoding="utf-8")
    with file.open(encoding="utf-8") as lines:
        return {key: float(value) for key, value in list(csv.reader(lines))[2:]}


def once(specimen, friction, extend, solve):
    """Peak [kN] of one wall, read from the store or computed and added to it; repeated tests share it."""
    steps = extend.steps if extend else ()
    # the bond is symmetric: a direction matters only to a cause that has one
    direction = specimen["direction"] if any(c.name in DIRECTED for c, _ in steps) else "+"
    start = f"{specimen['model']} {direction} friction {friction:.6g}"
    key = " | ".join([start, *(f"{cause.name} {size:.10g}" for cause, size in steps)])
    if key not in VALUES:
        test, assembly, loads = case(specimen["model"], friction, direction)
        value = solve(test, assembly, loads, extend or (lambda *model: model))
        if not np.isfinite(value):
            raise ValueError(f"no peak was found for {key}: narrow the bounds of the cause")
        VALUES[key] = value
        with STORE.open("a", encoding="utf-8", newline="") as lines:
            csv.writer(lines, lineterminator="\n").writerow([key, f"{VALUES[key]:.9g}"])
    return VALUES[key]


def rigid(test, assembly, loads, extend):
    """Peak [kN] by limit analysis, at least 0.5 kN for a wall that cannot carry its dead load."""
    result = limit_analysis(*extend(assembly, loads), check_dead_load=False)
    return max(result.collapse_multiplier, 0.5) if result.status == "solved" else 0.5


def elastic(test, assembly, loads, extend):
    """Peak [kN] by the DEM on elastic joints: kn = E / block height, ks = kn / (2 (1 + nu))."""
    modulus = test.parameters.get("masonry modulus") or MODULUS_WS[round(float(test.parameters["N on top"]))]
    kn = float(modulus) * 1e6 / (float(test.parameters["block height"]) * 1e-3)
    law = {"normal_stiffness": kn, "shear_stiffness": kn / (2.0 * (1.0 + NU))}
    wall = assembly.with_interfaces(replace(i, joint=replace(i.joint, **law)) for i in assembly.interfaces)
    return dem.collapse(*extend(wall, loads), error_budget=(), contact_points=(6, 2)).collapse_multiplier


def by_limit_analysis(specimen, *, friction_SW=FRICTION["SW"], friction_WS=FRICTION["WS"], extend=None):
    """Peak [kN]."""
    return once(specimen, {"SW": friction_SW, "WS": friction_WS}[specimen["series"]], extend, rigid)


def by_dem(specimen, *, extend=None):
    """Peak [kN]."""
    return once(specimen, FRICTION[specimen["series"]], extend, elastic)


def wall(model, direction, cyclic):
    """A specimen with its covariates."""
    p = case(model, FRICTION[model[:2]], "+")[0].parameters
    force = p["force height H0"] if " x" not in model else p["height"] + 125.0  # [mm] WS walls
    return {
        "model": model, "series": model[:2], "direction": direction, "cyclic": "cyclic" if cyclic else "monotonic",
        "N": round(float(p["N on top"])), "precompression": float(p["precompression"]), "H0/L": force / p["length"],
        "block height": float(p["block height"]),
    }  # fmt: skip


def peaks():
    """Specimens and measured peaks [kN], one per direction."""
    specimens, measured = [], []
    for name in experiments.specimens(SOURCE):
        test = experiments.load(SOURCE, name)
        n = round(float(test.parameters["N on top"]))
        model = f"SW.{n}.1" if name.startswith("SW") else f"WS.{n}"
        for quantity in ("Vmax+", "Vmax-"):
            if quantity in test.measured:
                specimens.append({"name": name, **wall(model, quantity[-1], "Vmax-" in test.measured)})
                measured.append(float(test.measured[quantity]))
    return specimens, np.array(measured)


def replicates(specimens, measured):
    """Scatter of repeated tests of each series (same load, direction and kind) and their degrees of freedom."""
    out = {}
    for series in ("SW", "WS"):
        sets = {}
        for s, value in zip(specimens, measured, strict=True):
            if s["series"] == series:
                sets.setdefault((s["N"], s["direction"], s["cyclic"]), []).append(np.log(value))
        dof = sum(len(v) - 1 for v in sets.values())
        out[series] = (float(np.sqrt(sum(np.var(v) * len(v) for v in sets.values()) / dof)), dof)
    return out


def study_of(specimens, measured, scatter, simulate, nuisance, **options):
    """The study of some of the walls."""
    series = {s["series"] for s in specimens}
    noise = Noise([scatter[s["series"]][0] for s in specimens], sum(scatter[x][1] for x in series))
    names = ("precompression", "series", "H0/L", "block height", "cyclic", "direction")
    return Study(
        specimens, simulate, measured, noise, {k: v for k, v in nuisance.items() if k[-2:] in series},
        covariates=[n for n in names if len({s[n] for s in specimens}) > 1],
        groups=[s["model"] for s in specimens], **options,
    )  # fmt: skip


if __name__ == "__main__":
    words = argparse.ArgumentParser()
    words.add_argument("--simulator", choices=("limit", "dem"), default="limit")
    words.add_argument("--cache", type=Path, help="folder that keeps the DEM's values")
    words.add_argument("--full", action="store_true", help="pairs of causes and checks for all parts")
    given, _ = words.parse_known_args()
    specimens, measured = peaks()
    scatter = replicates(specimens, measured)
    causes, simulate, options = CAUSES, by_limit_analysis, {"levels": 9, "nuisance_levels": 3}
    nuisance = {"friction_SW": Measured(0.62, 0.05), "friction_WS": Measured(0.65, 0.07, (0.5, 0.75))}
    if given.simulator == "dem":
        causes, simulate, options, nuisance = CAUSES_DEM, by_dem, {"levels": 5}, {}
    STORE = (given.cache or Path(__file__).parent / "stored") / f"diagnose_minho_{given.simulator}.csv"
    VALUES = stored(STORE)
    for name, (sd, dof) in scatter.items():
        print(f"Scatter of repeated tests, {name}: {100 * sd:.1f} %, {dof} degrees of freedom")
    studies, verdicts = {}, {}
    for part in ("all", "WS", "SW"):
        rows = [i for i, s in enumerate(specimens) if part in ("all", s["series"])]
        studies[part] = study_of([specimens[i] for i in rows], measured[rows], scatter, simulate, nuisance, **options)
        shifts = {"all": ("direction", "cyclic", "series"), "WS": ("direction", "cyclic"), "SW": ()}[part]
        listed = [c for c in causes if not c.name.startswith("shift of") or c.name.split()[2] in shifts]
        pairs = part == "WS" or given.full
        verdicts[part] = verdict = studies[part].diagnose(listed, seed=0, pairs=pairs)
        print(f"\n=== {part}: {len(rows)} peaks ===\n{verdict.report(checks=part == 'SW' or given.full)}")
        if not pairs:
            print("Pairs of causes were not tried here (--full).")
        if part == "WS" or given.full:
            print(f"\n{studies[part].confusable(listed)}")
        figures.diagnosis(
            verdict, units=UNITS, quantity="peak [kN]", title=f"Minho shear walls, {part}: {given.simulator}"
        ).savefig(f"diagnose_minho_{part}_{given.simulator}.png")
    # facts recorded beside the peaks, which the verdict does not use
    granite = [experiments.load(SOURCE, n).parameters for n in experiments.specimens(SOURCE) if n.startswith("WS")]
    soft = [p["block height"] / p["masonry modulus"] for p in granite if "masonry modulus" in p]
    modes = sorted({str(p["failure type"]).split(" (")[0] for p in granite})
    print(f"\nRecorded of the WS walls: failure {' or '.join(modes)} (R rocking, TC toe crushing); prism strength "
          f"{granite[0]['masonry strength fc']:g} MPa, 1/fc = {1 / granite[0]['masonry strength fc']:.3f} 1/MPa; "
          f"joint compliance from E, at most, {min(soft):.3f} to {max(soft):.3f} mm/MPa")  # fmt: skip
    # which walls would tell the kept physical causes of the WS walls apart?
    kept = {name for names in verdicts["WS"].kept for name in names}
    rivals = [c for c in causes if c.name in kept and c.acts_on == "simulation"]
    if len(rivals) > 1:
        pool = [wall(f"WS.{n}{times}", "+", False) for n in (40, 100, 250) for times in (" x0.5", "", " x2")]
        tests = studies["WS"].plan(rivals, pool, k=3)
        names = ", ".join(c.name for c in rivals)
        print(f"\nTo tell {names} apart, test next: {', '.join(s['model'] for s in tests.specimens)} "
              f"(smallest d2 {tests.before:.1f} -> {tests.after:.1f})")  # fmt: skip
