"""BNW shear walls with units that deform, yield and crack: predicted with inputs of codes, beside the measured peaks.

    python examples/bnw_zoned_walls.py [--out FOLDER]     # BNW1 in coarse zones, one speed: some seconds
    python examples/bnw_zoned_walls.py --full             # BNW1 to BNW3 in finer zones with rate errors, and what
                                                          # E, friction and strengths do to BNW1: some ten minutes

Nothing is fitted: the source's material table is lost. Joints: initial shear strength of the database (0.25 MPa),
friction 0.4 of EN 1996-1-1, no tension, kn 30 and ks 12 GPa/m, all assumed. Units: Mohr-Coulomb with the masonry's
compressive strength of the database; 35 degrees, a tensile strength of 0.2 MPa, E of the sister series BNL (3.09 GPa)
and nu 0.15 are assumed. Units have no crack plane of their own: they crack where their zones fail in tension.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import dem
import limitmason as lm

FULL = "--full" in sys.argv
OUT = Path(sys.argv[sys.argv.index("--out") + 1]) if "--out" in sys.argv else Path()  # folder for the figures
ZONE = 0.0625 if FULL else 0.11  # largest edge of a zone [m]; units of 233 x 250 mm and their halves
PHI = 35.0  # friction angle of the units [deg]


def push(specimen, *, modulus=3.09e9, tension=0.2e6, strength=1.0, friction=0.4):
    """The test, and its wall driven to a drift of 1 %."""
    test = lm.experiments.load("bnw-walls", specimen, friction=friction, cohesion=0.25e6, crushing=False)
    crushing = strength * 1e6 * float(test.parameters["masonry strength"])
    unit = lm.Material(
        young_modulus=modulus, poisson_ratio=0.15, density=1000.0, friction_angle_deg=PHI, tensile_strength=tension,
        cohesion=crushing / (2.0 * np.tan(np.deg2rad(45.0 + 0.5 * PHI))), name="hollow clay unit",
    )  # fmt: skip
    wall = test.assembly().with_joints(lambda j: replace(j, normal_stiffness=30e9, shear_stiffness=12e9))
    wall = wall.with_material(unit, blocks=[b.name for b in wall.blocks if b.name != "beam"])
    dead = test.loads("+").dead
    curve = dem.push(
        wall, dem.Drive({"beam": {"x": 1.0}}), to=0.01 * float(test.parameters["height"]), label=specimen,
        loads=lm.Loads(dead, np.zeros_like(dead)), blocks="zoned", zone_size=ZONE, rate_check=FULL,
        steps=None if FULL else 10_000,  # units that yield need no more; the default is for brittle walls
    )  # fmt: skip
    return test, curve


def row(name, test, curve):
    """One line of the table; peak over the mean of the measured ones of both senses."""
    measured = 0.5 * (float(test.measured["Vmax+"]) + float(test.measured["Vmax-"]))
    drift = curve.peak.displacement / float(test.parameters["height"])
    order = ", then ".join(e.name for e in curve.events if e.name.startswith("unit"))
    print(
        f"{name:20s} peak {1e-3 * curve.peak.load:5.0f} kN at {drift:.2%} drift, measured {measured:.0f} kN: "
        f"{1e-3 * curve.peak.load / measured:.2f}; {1e-6 * curve.stiffness():.0f} kN/mm; first {order}; "
        + (f"rate error {curve.rate_error:.1%}" if FULL else "one speed")
    )


found = {}
for specimen in ("BNW1", "BNW2", "BNW3") if FULL else ("BNW1",):
    found[specimen] = push(specimen)
    row(specimen, *found[specimen])
    lm.figures.plasticity(found[specimen][1], title=f"{specimen}: predicted, nothing fitted").savefig(
        OUT / f"{specimen.lower()}_plasticity.png", dpi=200
    )
if FULL:
    for name, options in (
        ("E 6.2 GPa", {"modulus": 6.18e9}), ("friction 0.6", {"friction": 0.6}), ("fc 0.75", {"strength": 0.75}),
        ("ft 0.4 MPa", {"tension": 0.4e6}),
    ):  # fmt: skip
        row(f"BNW1, {name}", *push("BNW1", **options))
