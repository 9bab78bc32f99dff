"""A rubble leaf of 39 scanned stones: meshes read, mortar joints closed, and the horizontal load under its beam.

The stones are files of Wang and Beyer (Rigid-Block-3D, MIT licence; see SOURCE.txt in rubble_leaf.zip), 0.9 x 0.9 m.
A stone is its convex hull, mortar is counted to the stones, half to each; what that changes is printed. Mortar values
are those of the source's input file; 139 kN on the beam are read as kN, its sense of push is assumed.
"""

from pathlib import Path

import limitmason as lm
from limitmason.geometry import box

stones = lm.formats.read_stones(Path(__file__).with_name("rubble_leaf.zip"), up="x")
print(f"{len(stones.names)} stones, volume over that of the convex hull {min(stones.convexity):.3f} and more")
plates = {
    "ground": box((-0.1, -0.05, -0.1), (1.0, 0.25, 0.0)),
    "beam": box((0.0, -0.03, 0.9), (0.9, 0.23, 1.0)),
}
met = stones.grown(0.03, plates)
print(met)

mortar = {
    "dry": lm.Joint.from_friction_coefficient(0.5),
    "mortar": lm.Joint.from_friction_coefficient(0.5, cohesion=0.29e6, tensile_strength=0.57e6),
}
predictions = {}
for name, joint in mortar.items():
    # 1 mm closes what a third stone keeps apart
    leaf = met.assembly(joint=joint, density=2700.0, fixed=["ground"], tolerance=1e-3)
    loads = lm.Loads.weight(leaf).with_precompression(leaf, 139e3)
    loads = loads.with_point_load(leaf, "beam", (139e3, 0.0, 0.0))
    prediction = lm.limit_analysis(leaf, loads)
    predictions[name] = prediction
    outcome = f"H / V = {prediction.collapse_multiplier:.3f}" if prediction.status == "solved" else prediction.status
    print(f"{name}: {leaf.n_blocks} blocks, {len(leaf.interfaces)} joints: {outcome}")
    lm.figures.mechanism(leaf, prediction).savefig(f"rubble_leaf_{name}.png")
