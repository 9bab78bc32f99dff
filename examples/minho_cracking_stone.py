"""Dry-joint walls of stone that cracks: does it take away what rigid blocks of the Minho SW walls carry too much?

    python minho_cracking_stone.py [--full]

Rigid blocks carry 0.7 times the measured peak under 30 kN and 1.2 to 1.45 times under 200 and 250 kN. Blocks are cut
into zones (Mohr-Coulomb with a tension cut-off) and may crack along their vertical middle (brittle); joints are as soft
as the measured modulus of the wall says. Assumed: 45 degrees, nu 0.2 and all strengths but the 91.6 MPa of the source.
Without ``--full`` SW.200.1 alone; with it all levels, written to stored/minho_cracking_stone.csv.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import dem
import limitmason as lm
from limitmason.display.text_table import aligned
from limitmason.storage.csv_table import parsed, write_table

FULL = "--full" in sys.argv
STORED = Path(__file__).resolve().parent / "stored" / "minho_cracking_stone.csv"
SOURCE, PHI, NU, STONE = "minho-dry-stone-2005-2009", 45.0, 0.2, 91.6e6
TRAVEL = 20e-3  # of the beam [m], beyond the measured peaks
FACTOR = 2.0 * np.tan(np.deg2rad(45.0 + 0.5 * PHI))  # fc / c of Mohr-Coulomb [-]


def pushed(test, *, zones=None, plane=None):
    """Peak [kN] of a wall: strengths (fc, ft) of its zones and (c, ft) of a crack plane in each block [Pa], or None."""
    p = test.parameters
    modulus, stone = float(p["masonry modulus"]) * 1e6, float(p["stone modulus"]) * 1e6
    # block and joint in series have the modulus of the wall
    kn = 1.0 / (float(p["block height"]) / 1e3 * (1.0 / modulus - 1.0 / stone))
    ks = kn / (2.0 * (1.0 + NU))
    wall = test.assembly().with_joints(lambda j: replace(j, normal_stiffness=kn, shear_stiffness=ks))
    blocks = [b.name for b in wall.blocks if b.name.startswith("facade")]
    if plane is not None:
        crack = lm.Joint(
            PHI, normal_stiffness=50.0 * kn, shear_stiffness=50.0 * ks, cohesion=plane[0], tensile_strength=plane[1],
            residual_cohesion=0.0, residual_tensile_strength=0.0, name="crack",
        )
        long = 0.75 * float(p["block length"]) / 1e3
        planes = {}
        for name in blocks:
            block = wall.blocks[wall.block_index(name)]
            if np.ptp(block.vertices[:, 0]) > long:
                planes[name] = (block.centroid, (1.0, 0.0, 0.0))
        wall = lm.build.with_potential_cracks(wall, planes, crack)
        blocks = [b.name for b in wall.blocks if b.name.startswith("facade")]
    strength = {}
    if zones is not None:
        strength = dict(friction_angle_deg=PHI, cohesion=zones[0] / FACTOR, tensile_strength=zones[1])
    wall = wall.with_material(lm.Material(young_modulus=stone, poisson_ratio=NU, **strength), blocks=blocks)
    loads = lm.Loads.weight(wall).with_precompression(wall, float(p["N on top"]) * 1e3, block="beam")
    curve = dem.push(
        wall, dem.Drive({"beam": {"x": 1.0}}), to=TRAVEL, loads=loads, blocks="zoned", zone_size=0.1,
        rate_check=FULL and test.specimen == "SW.200.1", samples=150,
    )
    return 1e-3 * curve.peak.load, curve.rate_error


CASES = {"elastic stone": {}}
for ft in (6.0, 3.0, 1.0, 0.3):
    CASES[f"stone fc 91.6, ft {ft:g} MPa, zones and planes"] = {
        "zones": (STONE, ft * 1e6), "plane": (0.5 * np.sqrt(STONE * ft * 1e6), ft * 1e6),
    }
for ft in (3.0, 1.0, 0.2):
    CASES[f"elastic zones, planes ft {ft:g}, c of fc 91.6 MPa"] = {"plane": (STONE / FACTOR, ft * 1e6)}
for ft in (3.0, 1.0, 0.5):
    CASES[f"elastic zones, planes ft {ft:g}, c 1.5 ft"] = {"plane": (1.5e6 * ft, ft * 1e6)}
for fc in (57.0, 20.0, 10.0, 7.0, 5.0, 3.5):
    CASES[f"zones fc {fc:g} MPa, ft a twentieth"] = {"zones": (fc * 1e6, fc * 1e6 / 20.0)}
QUICK = (
    "elastic stone", "stone fc 91.6, ft 3 MPa, zones and planes", "stone fc 91.6, ft 0.3 MPa, zones and planes",
    "elastic zones, planes ft 1, c 1.5 ft", "zones fc 3.5 MPa, ft a twentieth",
)
LEVELS = {"SW.30.1": ("SW.30.1", "SW.30.2"), "SW.100.1": ("SW.100.1", "SW.100.2"),
          "SW.200.1": ("SW.200.1", "SW.200.2"), "SW.250.1": ("SW.250.1",)}

rows = []
for name, repeats in LEVELS.items() if FULL else (("SW.200.1", LEVELS["SW.200.1"]),):
    test = lm.experiments.load(SOURCE, name)
    measured = float(np.mean([float(lm.experiments.load(SOURCE, n).measured["Vmax+"]) for n in repeats]))
    rigid = lm.limit_analysis(test.assembly(), test.loads()).collapse_multiplier
    found = {"rigid blocks, limit analysis": (float(rigid), float("nan"))}
    for case in CASES if FULL else QUICK:
        found[case] = pushed(test, **CASES[case])
        print(name, case, f"{found[case][0]:.1f} kN", flush=True)
    for case, (peak, rate) in found.items():
        cells = f"{peak:.1f}", f"{measured:.1f}", f"{peak / measured:.2f}", "" if np.isnan(rate) else f"{rate:.3f}"
        rows.append([name, case, *cells])
if FULL:
    units = {"wall": "-", "case": "-", "peak": "kN", "measured mean": "kN", "ratio": "-", "rate error": "-"}
    write_table(STORED, units, rows)
stored = parsed(STORED.read_text(encoding="utf-8"), STORED.name)
head = [name if unit == "-" else f"{name} [{unit}]" for name, unit in zip(stored.header, stored.units, strict=True)]
print("\n" + aligned([head, *stored.rows], "<<>>>>"))
drawn = ("rigid blocks, limit analysis", "elastic stone", "zones fc 3.5 MPa, ft a twentieth")
pairs = [(r[0], float(r[3]), float(r[2]), r[1]) for r in stored.rows if r[1] in drawn]
figure = lm.figures.predicted_against_published(pairs, quantity="peak [kN]", published="measured")
figure.savefig("minho_cracking_stone.png")
print("""
Softer joints and displacements take 8 % off under 200 and 250 kN (rigid 1.44 and 1.22, elastic stone 1.32 and 1.11).
Tensile cracking takes nothing more: with the 91.6 MPa of the stone, zones and planes of 6 down to 1 MPa leave the
peak within 1.5 %, for the load goes down in struts that cracks along them do not cut; at 0.3 MPa it moves by 4 % each
way, less than the rate error of 13 %. What meets the tests is a stone that crushes at 3.5 MPa (200 kN) or 7 MPa
(250 kN), or, under 200 kN alone, planes of 1 MPa whose cohesion is 1.5 ft. Such a stone is 13 to 26 times weaker than
the source's: cracking of it is no plausible cause. Local crushing at uneven dry joints would be one, and no source
says it.""")
