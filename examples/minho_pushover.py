"""Dry-joint shear walls pushed once and in cycles: the Minho walls by the distinct element method.

    python minho_pushover.py [SW.30 SW.100 SW.200 SW.250 WS.100] [--full]

The loading beam is driven sideways under its constant vertical load and is free to turn. Joint stiffness from the
measured modulus E of the wall, whose blocks are rigid in the model: kn = E / block height, ks = kn / (2 (1 + nu)) with
nu = 0.2 assumed. Measured curves and peaks beside the DEM and limit analysis. ``--full``: all five, four times slower.
"""

import sys
from dataclasses import replace

import numpy as np

import dem
from limitmason import experiments, figures, limit_analysis

FULL = "--full" in sys.argv
LEVELS = [w for w in sys.argv[1:] if w.startswith(("SW.", "WS."))]
LEVELS = LEVELS or (["SW.30", "SW.100", "SW.200", "SW.250", "WS.100"] if FULL else ["SW.100"])
SOURCE, NU = "minho-dry-stone-2005-2009", 0.2
STEPS_PER_MM = 4000 if FULL else 1000
AMPLITUDES = (2, 5, 10, 15) if FULL else (2, 5, 10)  # of the cycles [mm]
TRAVEL = {"SW": 20, "WS": 40}  # of the single push [mm]


def elastic_wall(test):
    """The wall with joints as soft as its measured modulus says, that normal stiffness [Pa/m] and the modulus."""
    # the monotonic WS walls have no modulus of their own: that of the cyclic wall under the same load is assumed
    twin = experiments.load(SOURCE, test.specimen.replace("WS.", "WS1."))
    modulus = test.parameters.get("masonry modulus", twin.parameters["masonry modulus"])
    kn = float(modulus) * 1e6 / (float(test.parameters["block height"]) / 1e3)
    soft = {"normal_stiffness": kn, "shear_stiffness": kn / (2.0 * (1.0 + NU))}
    return test.assembly().with_joints(lambda joint: replace(joint, **soft)), kn, modulus


def push(wall, loads, settled, *travels):
    """Drive the beam by each travel [mm] in turn."""
    stages = [
        dem.Drive(displacement={"beam": {"x": 1e-3 * d}}, steps=int(abs(d) * STEPS_PER_MM), keep=True) for d in travels
    ]
    return dem.simulate(wall, stages, loads=loads, start=settled, sample=STEPS_PER_MM // 10)


def degradation(cycles):
    """Peaks [N], peak-to-peak stiffness [N/m] and dissipated energy [J] of every amplitude."""
    x, y = cycles.curve("beam")
    rows = []
    for k, amplitude in enumerate(AMPLITUDES):
        part = (cycles["stage"] >= 3 * k) & (cycles["stage"] < 3 * k + 3)
        top, bottom = y[part].max(), y[part].min()
        work = float(0.5 * (y[part][1:] + y[part][:-1]) @ np.diff(x[part]))
        rows.append((amplitude, top, bottom, (top - bottom) / (2e-3 * amplitude), work))
    return rows


answers = {}
for level in LEVELS:
    tests = [experiments.load(SOURCE, n) for n in experiments.specimens(SOURCE) if f"{n}.".startswith(f"{level}.")]
    test, name = tests[0], level.replace(".", "_").lower()
    wall, kn, modulus = elastic_wall(test)
    loads = test.loads()
    settled = dem.simulate(wall, dem.Settle(tolerance=1e-5), loads=loads, contact_points=(6, 2))
    once = push(wall, loads, settled, TRAVEL[level[:2]])
    cycles = push(wall, loads, settled, *(d for a in AMPLITUDES for d in (a, -2 * a, a)))
    pushed = once.curve("beam")
    u, f = pushed
    slope = pushed.stiffness() / 1e6  # between 10 and 40 % of the peak [kN/mm]
    rigid = {rule: limit_analysis(test.assembly(), loads, rule).collapse_multiplier
             for rule in ("associative", "non-associative")}
    measured = [float(t.measured["Vmax+"]) for t in tests]
    curves = {t.specimen: t.curve() for t in tests if t.specimen != "SW.30.1"}
    slopes = [c.stiffness() for c in curves.values()]  # kN/mm
    table = degradation(cycles)
    answers[level] = {
        "peak": float(f.max()) / 1e3, "measured": measured, "limit analysis": rigid, "stiffness": slope,
        "measured stiffness": slopes, "degradation": [row[3] / 1e6 for row in table],
        "dissipated": [row[4] for row in table], "initial slope": float(f[3] / u[3]) / 1e6,
    }
    print(f"\n{level}: {test.parameters['N on top']} on top, kn = {kn / 1e9:.1f} GPa/m from E = "
          f"{modulus}")
    print(f"  peak [kN]: DEM {f.max() / 1e3:.1f}, limit analysis {rigid['associative']:.1f} (psi = phi) and "
          f"{rigid['non-associative']:.1f} (psi = 0), measured {', '.join(f'{m:.1f}' for m in measured)}; "
          f"DEM / mean {f.max() / 1e3 / np.mean(measured):.2f}")
    print(f"  stiffness from 10 to 40 % of the peak [kN/mm]: DEM {slope:.1f}, measured "
          f"{', '.join(f'{s:.1f}' for s in slopes)}")
    for amplitude, top, bottom, slope, work in table:
        print(f"  cycle of {amplitude:2.0f} mm: peaks {top / 1e3:.1f} and {bottom / 1e3:.1f} kN, stiffness "
              f"{slope / 1e6:.1f} kN/mm, dissipated {work:.0f} J")
    figures.load_displacement(
        {"DEM, pushed once": once, "DEM, cycles": cycles}
        | {f"test {n}": c for n, c in curves.items()},
        block="beam", levels={"limit analysis, psi = 0": 1e3 * rigid["non-associative"]},
        title=f"{level}: {test.parameters['N on top']} on top", xlabel="displacement of the beam [mm]",
        caption="Assumed: weightless rigid beam free to turn, friction, nu = 0.2; the test's curve is thinned.",
    ).savefig(f"minho_{name}.png")
    figures.deformed(wall, once, scale=2.0, title=f"{level} pushed by {TRAVEL[level[:2]]} mm").savefig(
        f"minho_{name}_deformed.png"
    )
    if FULL and level == "SW.100":
        figures.animate(wall, cycles, "minho_sw_100.gif", scale=5.0)
