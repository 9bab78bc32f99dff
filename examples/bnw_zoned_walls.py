"""Shear walls whose units yield and crack: BNW walls predicted with inputs of codes, beside the measured peaks.

    python examples/bnw_zoned_walls.py            # BNW1 in coarse zones, one speed: some seconds
    python examples/bnw_zoned_walls.py --full             # BNW1 to BNW3 in finer zones with rate errors, and what
                                                          # E, friction and strengths do to BNW1: some ten minutes

Nothing is fitted: the source's material table is lost. Joints: initial shear strength of the database (0.25 MPa),
friction 0.4 of EN 1996-1-1, no tension, kn 30 and ks 12 GPa/m, all assumed. Units: Mohr-Coulomb with the masonry's
compressive strength of the database; 35 degrees, a tensile strength of 0.2 MPa, E of the sister series BNL (3.09 GPa)
and nu 0.15 are assumed. Units crack where their zones fail in tension; with ``unit_cracks`` across their
middle too. docs/papers/bnw.md has all three walls beside the paper.
"""

import sys

import dem
import limitmason as lm

FULL = "--full" in sys.argv
ZONE = 0.0625 if FULL else 0.11  # largest edge of a zone [m]; units of 257 x 250 mm and their halves


def push(specimen, **options):
    """The test, and its wall driven to a drift of 1 %."""
    given = {"friction": 0.4, "cohesion": 0.25e6, "young_modulus": 3.09e9, **options}
    test = lm.experiments.load("bnw-walls", specimen, **given)
    curve = dem.push(
        test.assembly(), test.drive(), to=0.01 * float(test.parameters["height"]), label=specimen, loads=test.loads(),
        blocks="zoned", zone_size=ZONE, rate_check=FULL,
        steps=None if FULL else 10_000,  # units that yield need no more; the default is for brittle walls
    )
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
        f"{specimen.lower()}_plasticity.png", dpi=200
    )
if FULL:
    for name, options in (
        ("E 6.2 GPa", {"young_modulus": 6.18e9}), ("friction 0.6", {"friction": 0.6}),
        ("fc 0.75", {"unit_strength": 0.75 * 4.956e6}),
        ("ft 0.4 MPa", {"unit_tension": 0.4e6}),
        ("cracks in the units", {"unit_cracks": True}),
    ):
        row(f"BNW1, {name}", *push("BNW1", **options))
