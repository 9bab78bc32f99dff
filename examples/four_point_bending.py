"""Wallettes in four-point bending: five orientations of the bed joints, by the distinct element method.

The joints of Godio, Stefanou and Sab 2017, Table 4; spans, bond at the edges and brittle failure are assumed (printed
below); the measured strengths are only in a figure of the source and not packaged. ``--full`` runs at half the speed
with twice the contact points, and with blocks of half the length and height.
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import dem
from limitmason import experiments, figures
from limitmason.experiments import mcmaster_bending as mcmaster

FULL = "--full" in sys.argv
SPECIMENS = experiments.specimens("mcmaster-bending")
PUSH = 1e-3  # travel of the loading bars [m]


def bend(test, steps, points, push=PUSH):
    """Push both loading bars and hold the rest of them: history, and 6 M / (b t^2) [Pa] at every sample."""
    wall = test.assembly()
    held = dict.fromkeys(("x", "z", "rx", "ry", "rz"), 0.0)
    drive = dem.Drive(displacement={bar: {"y": -push, **held} for bar in mcmaster.LOADED}, steps=steps)
    # a push of 1 mm is large for the thin bars alone: the contacts between the blocks stay where they are
    history = dem.simulate(
        wall, drive, loads=test.loads(), contact_points=points, sample=steps // 200, detect_every=None
    )
    force = -sum(history.reaction_of(bar)[:, 1] for bar in mcmaster.LOADED)
    return history, force / (2.0 * mcmaster.line_load(test, 1.0))


def broken_parts(test, history):
    """Part of the broken joint area, by tension or shear, that lies in bed joints [-]."""
    wall, state = history.assembly, history.state
    angle = np.deg2rad(test.parameters["orientation"])
    is_bed = np.abs(wall.arrays.normal @ (-np.sin(angle), 0.0, np.cos(angle))) > 0.5
    of_point = np.repeat(state.interface, np.diff(state.joints.start))
    broken = state.points.damage * state.points.area
    return float(broken[is_bed[of_point]].sum() / broken.sum())


print(*experiments.load("mcmaster-bending", "theta-0").assumptions, sep="\n")
print("\nbed joints at   peak M [N m]   6 M / (b t^2) [MPa]   travel [mm]   broken bed / head   observed failure")
strength, bed_part, curves, ends = {}, {}, {}, {}
page = Figure(figsize=(6.3, 7.2), dpi=200)
for number, name in enumerate(SPECIMENS):
    test = experiments.load("mcmaster-bending", name)
    history, stress = bend(test, 160_000 if FULL else 80_000, (8, 16) if FULL else (4, 8))
    peak = int(stress.argmax())
    theta = float(test.parameters["orientation"])
    strength[theta], ends[theta] = stress[peak], stress[-1]
    bed_part[theta] = broken_parts(test, history)
    travel = np.linspace(0.0, PUSH, len(stress) + 1)[1:]
    curves[f"{theta:g}°"] = (travel, 1e-3 * stress)  # kPa, drawn in MPa
    modulus = float(test.parameters["width"]) * float(test.parameters["block thickness"]) ** 2 / 6e9
    print(
        f"{theta:10g}°{stress[peak] * modulus:15.0f}{stress[peak] / 1e6:20.3f}{1e3 * travel[peak]:16.2f}"
        f"{bed_part[theta]:14.2f} / {1 - bed_part[theta]:.2f}     {test.parameters['failure']}"
    )
    ax = page.add_subplot(3, 2, number + 1)
    figures.deformed(
        history.assembly, history, view="elevation", crack=5e-5, ghost=False, legend=False, ax=ax,
        title=f"{theta:g}°: {stress[peak] / 1e6:.2f} MPa",
    )

ax = page.add_subplot(3, 2, 6)
angles = np.linspace(0.0, 90.0, 91)
square = np.sin(np.deg2rad(angles)) ** 2
ax.plot(angles, 1e-6 * (strength[90.0] * square + strength[0.0] * (1.0 - square)), label="ftn sin² + ftp cos²")
ax.plot(list(strength), [1e-6 * s for s in strength.values()], "o", label="DEM")
ax.set_xlabel("bed joints to the span [°]", fontsize=8)
ax.set_ylabel("6 M / (b t²) [MPa]", fontsize=8)
ax.tick_params(labelsize=7.5)
ax.set_ylim(0.0, None)
ax.legend(fontsize=7, frameon=False)
page.tight_layout()
page.savefig("four_point_bending_cracks.png")
figures.load_displacement(
    curves, ylabel="6 M / (b t²) [MPa]", xlabel="travel of the loading bars [mm]", title="Four-point bending, DEM",
    caption="Assumed: spans 1.5 and 0.7 m, brittle joints. Joints: Godio et al. 2017.",
).savefig("four_point_bending.png")

straight = 0.36e6 * (1.0 + 2.0 / (15 if FULL else 7) ** 2)
print(f"straight bed joint, elastic until its edge breaks (contact points counted): {straight / 1e6:.3f} MPa")
if FULL:
    for name in ("theta-0", "theta-90"):
        _, stress = bend(experiments.load("mcmaster-bending", name, block_scale=0.5), 160_000, (4, 8), 3.0 * PUSH)
        print(f"{name} with blocks of half the size: {stress.max() / 1e6:.3f} MPa")
