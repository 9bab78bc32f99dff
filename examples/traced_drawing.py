"""From a traced drawing to a multiplier: an irregular dry-stone wall given as outlines.

The outlines are what one traces over a scaled photograph: closed polygons in metres, gaps and overlaps of a few
millimetres included. `tolerance` says how much of that is drawing error. A DXF file works the same way:
`lm.formats.read_dxf("wall.dxf")` returns outlines and names (needs the extra: pip install "limitmason[dxf]").
"""

import json
from pathlib import Path

import limitmason as lm

drawing = json.loads((Path(__file__).parent / "traced_wall.json").read_text(encoding="utf-8"))
wall = lm.Assembly.from_polygons(
    list(drawing["stones"].values()),
    names=list(drawing["stones"]),
    thickness=drawing["thickness"],
    density=drawing["density"],
    joint=lm.Joint(friction_angle_deg=34.0),
    fixed=["ground"],
    tolerance=drawing["tolerance"],
)
print(f"{wall.n_blocks - 1} stones, {len(wall.interfaces)} contacts found within {1000 * wall.tolerance:g} mm")

predictions = lm.predict_cases(
    wall, {"to the right": lm.Loads.horizontal(wall), "to the left": lm.Loads.horizontal(wall, (-1, 0, 0))}
)
for name, prediction in predictions.items():
    c = prediction.certificate
    print(
        f"{name}: lambda = {prediction.collapse_multiplier:.4f}, "
        f"tilt {prediction.tilt_angle_deg:.1f} deg, gap {c.gap:.1e}"
    )
governing = min(predictions, key=lambda name: predictions[name].collapse_multiplier)
print(f"governing: {governing}")
lm.figures.mechanism(wall, predictions[governing], title=f"Traced wall, {governing}").savefig("traced_wall.png")
lm.figures.contact_forces(wall, predictions[governing]).savefig("traced_wall_forces.png")
