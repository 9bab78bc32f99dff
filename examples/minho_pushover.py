"""A dry-joint shear wall of the University of Minho by the distinct element method, pushed once and back and forth.

    python minho_pushover.py [SW.30 | SW.100 | SW.200 | SW.250] [--full]

The loading beam is driven sideways under its constant vertical load and is free to turn. Joint stiffness from the
measured modulus E of the wall, whose blocks are rigid in the model: kn = E / block height, ks = kn / (2 (1 + nu)) with
nu = 0.2 assumed. Peaks are compared with the tests and with limit analysis (rigid joints, first-order equilibrium).
"""

import sys
from dataclasses import replace

import numpy as np

import dem
from limitmason import experiments, figures, limit_analysis

FULL = "--full" in sys.argv
LEVEL = next((word for word in sys.argv[1:] if word.startswith("SW.")), "SW.100")
SOURCE, NU = "minho-dry-stone-2005-2009", 0.2
STEPS_PER_MM = 4000 if FULL else 1000
AMPLITUDES = (2, 5, 10, 15) if FULL else (2, 5, 10)  # of the cycles [mm]

tests = [experiments.load(SOURCE, n) for n in experiments.specimens(SOURCE) if n.startswith(f"{LEVEL}.")]
test = tests[0]
kn = float(test.parameters["masonry modulus"]) * 1e6 / (float(test.parameters["block height"]) / 1e3)
ks = kn / (2.0 * (1.0 + NU))
rigid = test.assembly()
elastic = (replace(i.joint, normal_stiffness=kn, shear_stiffness=ks) for i in rigid.interfaces)
wall = rigid.with_interfaces(replace(i, joint=joint) for i, joint in zip(rigid.interfaces, elastic, strict=True))
loads = test.loads()
model = {"loads": loads, "contact_points": (6, 2)}
settled = dem.simulate(wall, dem.Settle(tolerance=1e-5), **model)


def push(*travels):
    """Drive the beam by each travel [mm] in turn."""
    stages = [
        dem.Drive(displacement={"beam": {"x": 1e-3 * d}}, steps=int(abs(d) * STEPS_PER_MM), keep=True) for d in travels
    ]
    return dem.simulate(wall, stages, start=settled, sample=STEPS_PER_MM // 10, **model)


once = push(20)
cycles = push(*(d for a in AMPLITUDES for d in (a, -2 * a, a)))
u, f = once.curve("beam")
peak, measured = float(f.max()) / 1e3, [float(t.measured["Vmax+"]) for t in tests]
first = np.searchsorted(u, 3e-4)
late = int(np.argmax(f >= 0.7 * f.max()))
initial, effective = f[first] / u[first] / 1e6, f[late] / u[late] / 1e6
associative = limit_analysis(rigid, loads).collapse_multiplier
non_associative = limit_analysis(rigid, loads, "non-associative").collapse_multiplier

print(*test.assumptions, sep="\n")
print(f"kn = {kn / 1e9:.2f} GPa/m, ks = {ks / 1e9:.2f} GPa/m from E = {test.parameters['masonry modulus']}\n")
print(f"peak [kN]: DEM {peak:.1f}, limit analysis {associative:.1f} (psi = phi) and {non_associative:.1f} (psi = 0),")
print(f"           measured {', '.join(f'{m:.1f}' for m in measured)}; DEM / mean {peak / np.mean(measured):.2f}")
print(f"stiffness [kN/mm]: DEM {initial:.1f} at first, {effective:.1f} at 70 % of the peak, measured effective "
      f"{', '.join(format(t.measured['Keff+'], '.1f') for t in tests)}")  # fmt: skip

print("\ncycle [mm]   peaks [kN]        peak-to-peak stiffness [kN/mm]   dissipated [J]   equivalent damping")
stiffness, dissipated = [], []
x, y = cycles.curve("beam")
for k, amplitude in enumerate(AMPLITUDES):
    part = (cycles["stage"] >= 3 * k) & (cycles["stage"] < 3 * k + 3)
    top, bottom = y[part].max(), y[part].min()
    stiffness.append((top - bottom) / (2e3 * amplitude))
    dissipated.append(float(0.5 * (y[part][1:] + y[part][:-1]) @ np.diff(x[part])))
    damping = dissipated[-1] / (np.pi * (top - bottom) * 1e-3 * amplitude)
    print(f"{amplitude:6.0f}{top / 1e3:13.1f}{bottom / 1e3:8.1f}{stiffness[-1]:22.1f}", end="")
    print(f"{dissipated[-1]:25.0f}{damping:18.2f}")

height = float(test.parameters["force height H0"]) / 1e3
curves, points = {"DEM, pushed once": once, "DEM, cycles": cycles}, []
for t in tests:
    top = 1e3 * float(t.measured["Vmax+"])
    curves[f"Keff, {t.specimen}"] = ([0.0, top / (1e6 * float(t.measured["Keff+"]))], [0.0, top])
    points.append((f"peak, {t.specimen}", 0.01 * float(t.measured["drift at Vmax+"]) * height, top))
figures.load_displacement(
    curves, block="beam", levels={"limit analysis, psi = 0": 1e3 * non_associative}, points=points,
    title=f"{LEVEL}: {test.parameters['N on top']} on top", xlabel="displacement of the beam [mm]",
    caption="Measured key points only; drift times H0 (assumed) gives their displacement.",
).savefig("minho_pushover.png")  # fmt: skip
figures.deformed(wall, once, scale=2.0, title=f"{LEVEL} pushed by 20 mm").savefig("minho_pushover_deformed.png")
if FULL:
    figures.animate(wall, cycles, "minho_pushover.gif", scale=5.0)
