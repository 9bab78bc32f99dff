"""A column on moving ground: it stays, rocks or falls. It lifts off where the acceleration passes g b / h = 0.2 g."""

import numpy as np

import dem
import limitmason as lm

joint = lm.Joint(friction_angle_deg=40.0, normal_stiffness=2e9, shear_stiffness=1e9)
column = lm.build.column(width=0.4, depth=0.4, height=2.0, courses=1, joint=joint)
time = np.arange(0.0, 0.81, 0.01)

angles = {}
for peak in (0.15, 0.25, 0.5):
    sine = dem.BaseMotion(peak * 9.81 * np.sin(2 * np.pi * time / 0.8), sample_step=0.01)
    run = dem.simulate(column, [dem.Settle(), sine, dem.Hold(duration=2.5)], mode="dynamic", sample=20)
    angles[peak] = np.degrees(run.rotation_of("column-1")[:, 1])
    largest = abs(angles[peak]).max()
    print(f"{peak} g: " + ("falls" if largest > 60.0 else f"largest angle {largest:.1f} deg"))
    if peak == 0.25:
        shown = {"time": run["time"], "angle": angles[peak]}
        figure = lm.figures.history_curves(shown, ["angle"], against="time", units={"time": "s", "angle": "deg"})
        figure.savefig("rocking_column.png")
