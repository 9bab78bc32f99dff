"""Diagnosis of 21 dry-joint shear walls: what the rigid-block model gets wrong, and what the data say of causes.

    python diagnose_minho.py [--simulator dem] [--cache FOLDER] [--full]

Both directions of the cyclic tests are measurements. The simulator is limit analysis (associative; psi = 0 lowers these
peaks by less than 2 %), or the DEM with joints of the measured modulus and large displacements. Nothing is tuned,
friction is redrawn within its error. All walls are judged, then each series: they differ in stone, height and rig.

Simulated peaks are kept in stored/ (or FOLDER) and read back, so that a run goes on after a kill.
"""

import argparse
import csv
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

import dem
from limitmason import causes as catalogue
from limitmason import experiments, figures, limit_analysis
from limitmason.diagnosis import Cause, Extension, Measured, Noise, Study

SOURCE, X, NU = "minho-dry-stone-2005-2009", (1.0, 0.0, 0.0), 0.2
# friction of SW: another author's model, its error assumed; of WS: not found, assumed
FRICTION = {"SW": Measured(0.62, 0.05), "WS": Measured(0.65, 0.07, (0.5, 0.75))}
MODULUS_WS = {40: 3287.0, 100: 3287.0, 175: 4068.0, 250: 4722.0}  # [MPa] cyclic walls; 40 kN assumed as 100 kN
UNITS = {"precompression": "MPa", "H0/L": "-", "block height": "mm"}
GRID, MOVED = (6, 2), 0.2  # DEM: points per joint; displacement of a fall over the block height (walls sway before it)
OPTIONS = {
    "limit": {"levels": 9, "nuisance_levels": 3},
    "dem": {"levels": 5, "nuisance_levels": 3, "crossed": "corners", "pair_tables": "additive"},
}


def raised_force(size, assembly, loads):
    """The horizontal force acts higher by the size [mm]; lower also for a beam that resists turning."""
    live, arms = np.array(loads.live), np.array(loads.live_arms)
    live[:, 3:] += np.cross((0.0, 0.0, 1e-3 * size), live[:, :3])
    arms[:, 2] += 1e-3 * size * live[:, :3]
    return assembly, replace(loads, live=live, live_arms=arms)


CAUSES = [
    catalogue.weak_base_joint(), catalogue.stress_dependent_friction(), catalogue.cohesion((0.0, 100.0)),
    catalogue.finite_compressive_strength((0.0, 0.5)),
    catalogue.edge_rounding((0.0, 40.0), plane_normal=(0.0, 1.0, 0.0)), catalogue.lost_overlap((0.0, 80.0)),
    catalogue.second_order_displacement((0.0, 1.0)),
    Cause("force height", "raised_mm", 0.0, (-400.0, 100.0), "the force acts higher (or, negative, the beam resists "
          "turning): SW force height is given as 0.95 and 1.0 m", apply=raised_force, unit="mm",
          isolate="record the rotation of the beam"),
    catalogue.out_of_plumb((-3.0, 3.0), direction=X), catalogue.eccentric_overload((-60.0, 60.0), direction=X),
    catalogue.overload_magnitude((0.5, 1.3)), catalogue.load_direction(), catalogue.gain((0.6, 1.6)),
    catalogue.rig_friction((-5.0, 10.0), unit="kN"),
    catalogue.batch_shift(covariate="direction", label="-"), catalogue.batch_shift(covariate="series", label="SW"),
    catalogue.batch_shift(covariate="cyclic", label="cyclic"),
]
# softness comes on top of the measured one, whose displacement the DEM follows by itself
BY_DEM = [catalogue.joint_softness((0.0, 0.1)), catalogue.open_head_joints(), *CAUSES[:6], *CAUSES[7:]]
LISTS = {"limit": CAUSES, "dem": BY_DEM}


@cache
def case(name, friction):
    """Test, assembly and loads; "WS.100 x2" is that wall twice as high."""
    name, _, times = name.partition(" x")
    test = experiments.load(SOURCE, name).with_options(friction=friction)
    if times:
        p, times = test.parameters, float(times)
        higher = {"height": p["height"] * times, "courses": round(p["courses"] * times)}
        force_height = 1e-3 * float(higher["height"] + p["force height H0"] - p["height"])
        test = replace(test, parameters={**p, **higher}, options={**test.options, "force_height": force_height})
    return test, test.assembly(), test.loads("+")


def rigid(test, assembly, loads, extend):
    """Peak [kN] by limit analysis, at least 0.5 kN for a wall that cannot carry its dead load."""
    result = limit_analysis(*extend(assembly, loads), check_dead_load=False)
    return max(result.collapse_multiplier, 0.5) if result.status == "solved" else 0.5


def elastic(test, assembly, loads, extend):
    """Peak [kN] by the DEM on elastic joints: kn = E / block height, ks = kn / (2 (1 + nu))."""
    modulus = test.parameters.get("masonry modulus") or MODULUS_WS[round(float(test.parameters["N on top"]))]
    kn = float(modulus) * 1e6 / (float(test.parameters["block height"]) * 1e-3)
    law = {"normal_stiffness": kn, "shear_stiffness": kn / (2.0 * (1.0 + NU))}
    wall = assembly.with_joints(lambda joint: replace(joint, **law))
    found = dem.collapse(*extend(wall, loads), error_budget=(), contact_points=GRID, moved_limit=MOVED)
    return found.collapse_multiplier if found.status in ("solved", "almost solved") else np.nan


def stored(file):
    """Peaks computed before, by wall, friction and extension."""
    if not file.exists():
        file.write_text("wall and extension,peak\n# units: -,kN\n", encoding="utf-8")
    return {k: float(v) for k, v in list(csv.reader(file.read_text(encoding="utf-8").splitlines()))[2:]}


def peak(solve, specimen, *, friction_SW=FRICTION["SW"].value, friction_WS=FRICTION["WS"].value, extend=None):
    """Peak [kN] of one wall, read from the store or computed and added to it; repeated tests share it."""
    friction = {"SW": friction_SW, "WS": friction_WS}[specimen["series"]]
    # the bond is symmetric: the second direction is the first with what leans or lies off the axis turned round
    turn = {"out-of-plumb": -1.0, "eccentric overload": -1.0} if specimen["direction"] == "-" else {}
    steps = tuple((c, turn.get(c.name, 1.0) * size) for c, size in (extend.steps if extend else ()))
    key = " | ".join([f"{specimen['model']} friction {friction:.6g}", *(f"{c.name} {size:.10g}" for c, size in steps)])
    if key not in VALUES:
        value = solve(*case(specimen["model"], friction), Extension(steps))
        if not np.isfinite(value):
            raise ValueError(f"no peak was found for {key}: narrow the bounds of the cause")
        VALUES[key] = value
        with STORE.open("a", encoding="utf-8", newline="") as lines:
            csv.writer(lines, lineterminator="\n").writerow([key, f"{value:.9g}"])
    return VALUES[key]


SIMULATORS = {"limit": partial(peak, rigid), "dem": partial(peak, elastic)}


def wall(model, direction="+", cyclic=False):
    """A specimen with its covariates; the force acts 125 mm above a WS wall of another height."""
    p = case(model, FRICTION[model[:2]].value)[0].parameters
    force = p["force height H0"] if " x" not in model else p["height"] + 125.0  # [mm]
    return {"model": model, "series": model[:2], "direction": direction, "N": round(float(p["N on top"])),
            "cyclic": "cyclic" if cyclic else "monotonic", "precompression": float(p["precompression"]),
            "H0/L": force / p["length"], "block height": float(p["block height"])}


def peaks():
    """Specimens and measured peaks [kN], one per direction."""
    found = []
    for name in experiments.specimens(SOURCE):
        test = experiments.load(SOURCE, name)
        model = f"{name[:2]}.{test.parameters['N on top']:g}" + (".1" if name.startswith("SW") else "")
        for quantity in ("Vmax+", "Vmax-"):
            if quantity in test.measured:
                specimen = {"name": name, **wall(model, quantity[-1], "Vmax-" in test.measured)}
                found.append((specimen, float(test.measured[quantity])))
    return [s for s, _ in found], np.array([v for _, v in found])


def replicates(specimens, measured):
    """Scatter of repeated tests of each series: same load, direction and kind."""
    kinds = np.array([f"{s['series']} {s['N']} {s['direction']} {s['cyclic']}" for s in specimens])
    rows = {series: [k.startswith(series) for k in kinds] for series in FRICTION}
    return {series: Noise.from_replicates(measured[r], kinds[r]) for series, r in rows.items()}


def by_their_dose():
    """What drift at the peak and load do to WS walls, by the printed columns alone.

    A wall that sways loses V / N by its drift: V = N (L / 2 H0 - drift). Load and direction are fitted beside it. The
    joint at the base opens first at N L / 6 H0 where stress is linear over it.
    """
    rows, first = [], {}
    for name in experiments.specimens(SOURCE):
        test = experiments.load(SOURCE, name)
        if not name.startswith("WS"):
            continue
        n, arm = float(test.parameters["N total at the base"]), float(test.parameters["length"])
        arm /= float(test.parameters["force height H0"])
        if "Vcr" in test.measured:
            ratios = float(test.measured["Vcr"]) / (n * arm / 6), float(test.measured["Vmax+"]) / (n * arm / 2)
            first.setdefault(round(float(test.parameters["N on top"])), []).append(ratios)
        for sense in "+-":
            if f"Vmax{sense}" in test.measured:
                drift = float(test.measured[f"drift at Vmax{sense}"]) / 100.0
                lost = arm / 2 - float(test.measured[f"Vmax{sense}"]) / n
                rows.append((lost, 1.0, drift, n, sense == "-"))
    lost, given = np.array(rows)[:, 0], np.array(rows)[:, 1:]
    slope, rest = np.linalg.lstsq(given, lost)[:2]
    error = np.sqrt(np.linalg.inv(given.T @ given)[1, 1] * rest[0] / (len(lost) - given.shape[1]))
    print(f"Sway, WS: V / N falls by {slope[1]:.2f} +- {error:.2f} of the drift at {len(lost)} peaks; sway asks 1")
    for n, ratios in sorted(first.items()):
        crack, most = np.mean(ratios, axis=0)
        print(f"WS, {n} kN: first crack {crack:.2f} N L / 6 H0, peak {most:.2f} N L / 2 H0, {len(ratios)} walls")


def study_of(part, specimens, measured, method):
    """The study of all walls or of one series, and the causes of its list."""
    rows = [i for i, s in enumerate(specimens) if part in ("all", s["series"])]
    scatter, some = replicates(specimens, measured), [specimens[i] for i in rows]
    series = sorted({s["series"] for s in some})
    noise = Noise([scatter[s["series"]].sd for s in some], sum(scatter[x].dof for x in series))
    names = [n for n in some[0] if n not in ("name", "model", "N") and len({s[n] for s in some}) > 1]
    study = Study(
        some, SIMULATORS[method], measured[rows], noise,
        {f"friction_{x}": FRICTION[x] for x in series}, names, [s["model"] for s in some], **OPTIONS[method],
    )
    return study, [c for c in LISTS[method] if not c.name.startswith("shift of") or c.name.split()[2] in names]


if __name__ == "__main__":
    words = argparse.ArgumentParser()
    words.add_argument("--simulator", choices=tuple(LISTS), default="limit")
    words.add_argument("--cache", type=Path, help="folder that keeps the peaks")
    words.add_argument("--full", action="store_true", help="pairs and checks for all parts, next tests by the DEM")
    given = words.parse_args()
    specimens, measured = peaks()
    STORE = (given.cache or Path(__file__).parent / "stored") / f"diagnose_minho_{given.simulator}.csv"
    VALUES = stored(STORE)
    for name, noise in replicates(specimens, measured).items():
        print(f"Scatter of repeated tests, {name}: {noise}")
    by_their_dose()
    studies, verdicts = {}, {}
    for part in ("all", "WS", "SW"):
        studies[part], listed = study_of(part, specimens, measured, given.simulator)
        pairs = part == "WS" or given.full
        verdicts[part] = verdict = studies[part].diagnose(listed, seed=0, pairs=pairs)
        print(f"\n=== {part}: {studies[part].n} peaks ===\n{verdict.report(checks=part == 'SW' or given.full)}")
        print(f"\n{studies[part].confusable(listed)}" if pairs else "Pairs of causes were not tried here (--full).")
        figure = figures.diagnosis(
            verdict, units=UNITS, quantity="peak [kN]", title=f"Minho, {part}: {given.simulator}"
        )
        figure.savefig(f"diagnose_minho_{part}_{given.simulator}.png")
    # which walls would tell the kept physical causes of the WS walls apart?
    kept = {name for names in verdicts["WS"].kept for name in names}
    rivals = [c for c in LISTS[given.simulator] if c.name in kept and c.acts_on == "simulation"]
    if len(rivals) > 1 and (given.simulator == "limit" or given.full):  # by the DEM some 20 minutes more
        pool = [wall(f"WS.{n}{times}") for n in (40, 100, 250) for times in (" x0.5", "", " x2")]
        tests = studies["WS"].plan(rivals, pool, k=3)
        print(f"\nTo tell {', '.join(c.name for c in rivals)} apart, test next:")
        print(f"{', '.join(s['model'] for s in tests.specimens)} (d2 {tests.before:.1f} -> {tests.after:.1f})")
