"""Candidates: closed forms of dry-joint masonry with sixteen causes, and three designs of specimens.

Walls with interlocked side walls (mechanism A with friction sums of whole courses), horizontal flexure with torsion of
the overlaps (mechanism D), in-plane running bond, stacks and slider blocks (closed forms of `docs/mechanisms.md`,
sections 2 to 4 and 8). Model scale: heights near one metre, unit weight 20 kN/m3.
"""

import math

import numpy as np

from limitmason.diagnosis import Cause, Measured

UNIT_WEIGHT = 20e3
FRICTION = 0.70
FRICTION_ERROR = 0.03
NUISANCE = {"friction_coefficient": Measured(FRICTION, FRICTION_ERROR)}
COVARIATES = ("setup", "height", "thickness", "unit_height", "overlap", "overload", "batch", "order", "age", "operator")
NOISE = 0.04


def polar_mean_radius(a, b):
    """Lever arm of friction torsion of a rectangle under uniform pressure (section 4.3)."""
    d = math.hypot(a, b)
    return (2 * a * b * d + a**3 * math.asinh(b / a) + b**3 * math.asinh(a / b)) / (12 * a * b)


def simulate(
    specimen,
    *,
    friction_coefficient,
    rounding_mm=0.0,
    thickness_factor=1.0,
    plumb_deg=0.0,
    base_friction_factor=1.0,
    cohesion_kpa=0.0,
    dilatancy_deg=0.0,
    torsion_factor=1.0,
    overlap_factor=1.0,
    softness_per_m=0.0,
    density_factor=1.0,
    wear_per_test=0.0,
    crushing_per_mpa=0.0,
):
    """Collapse multiplier of one specimen, the least over its mechanisms."""
    s = specimen
    height, t, h, length = s["height"], s["thickness"], s["unit_height"], s["length"]
    n = round(height / h)
    v = s["overlap"] * overlap_factor
    gamma = UNIT_WEIGHT * density_factor
    q = s["overload"]
    mu = friction_coefficient * math.exp(-wear_per_test * (s["order"] - 1))
    mu_base = mu * base_friction_factor
    c = 1e3 * cohesion_kpa
    lift = 1.0 + 2.0 * math.tan(math.radians(dilatancy_deg))
    pressure = gamma * height + q / t
    arm = 0.5 * t * thickness_factor - 1e-3 * rounding_mm - 0.5 * pressure * 1e-6 * crushing_per_mpa * t
    lean = math.tan(math.radians(plumb_deg))
    sway = softness_per_m * height**2
    setup = s["setup"]
    if setup == "slide":
        return mu_base + c / pressure
    weight = gamma * t * length * height
    top = q * length
    if setup == "in-plane":
        step = (v - 1e-3 * rounding_mm) / h
        kf = (1.0 - 1.0 / n**2) * mu
        rocking = math.sqrt(kf * step) - 0.5 * kf if kf < step else 0.5 * step
        rocking += c / (gamma * height) - sway / height
        return max(min(rocking, mu_base + c / pressure), 0.02)
    resisting = weight * (arm - 0.5 * height * lean - sway) + top * (arm - height * lean - 1.5 * sway)
    driving = 0.5 * weight * height + top * height
    sliding = mu_base + c / pressure
    if setup == "wall":
        sides = s["side_walls"]
        friction = mu * gamma * t * v * h**2 * n * (n * n - 1) / 6.0 * lift
        bond = c * t * v * h * n * (n - 1) / 2.0
        rocking = (resisting + sides * (friction + bond)) / driving
    elif setup == "flexure":
        tan_a = min(v / h, length / (2.0 * height))
        part = gamma * t * height**2 * tan_a / 2.0
        middle = gamma * t * height * max(length - 2.0 * height * tan_a, 0.0)
        force = mu * gamma * t * v * h * n * (n + 1) / 2.0 * lift + c * t * v * n
        twist = torsion_factor * polar_mean_radius(v, t * thickness_factor - 2e-3 * rounding_mm)
        total = 2.0 * part + middle
        rocking = (total * (arm - 0.5 * height * lean - sway) + 2.0 * twist * force / tan_a) / (
            2.0 * part * height / 3.0 + middle * height / 2.0
        )
    else:  # a stack
        rocking = resisting / driving
    return max(min(rocking, sliding), 0.02)


def angle_offset(size, prediction, specimen):
    """Multiplier read on a table whose zero is off by ``size`` degrees."""
    return max(math.tan(math.atan(prediction) - math.radians(size)), 0.02)


def gain(size, prediction, specimen):
    """Multiplier read by a sensor with a wrong gain."""
    return size * prediction


def batch(size, prediction, specimen):
    """Multiplier of the second batch read with another gain."""
    return size * prediction if specimen["batch"] == "B" else prediction


def direction(size, prediction, specimen):
    """Multiplier for a load inclined upwards by ``size`` degrees, read as horizontal."""
    b = math.radians(size)
    return prediction / (math.cos(b) + prediction * math.sin(b))


CAUSES = (
    Cause("edge rounding", "rounding_mm", 0.0, (0.0, 8.0), "contact pulled in from worn edges", unit="mm"),
    Cause("effective thickness", "thickness_factor", 1.0, (0.7, 1.0), "contact over part of the thickness"),
    Cause("out-of-plumb", "plumb_deg", 0.0, (-2.0, 2.0), "the wall leans before the test", unit="deg"),
    Cause("weak base joint", "base_friction_factor", 1.0, (0.4, 1.0), "less friction on the ground"),
    Cause("cohesion", "cohesion_kpa", 0.0, (0.0, 3.0), "joints stick", unit="kPa"),
    Cause("dilatancy", "dilatancy_deg", 0.0, (0.0, 25.0), "joints climb and raise their pressure", unit="deg"),
    Cause("torsion strength", "torsion_factor", 1.0, (0.3, 1.3), "pressure not uniform under twist"),
    Cause("overlap loss", "overlap_factor", 1.0, (0.5, 1.0), "open head joints, shorter overlaps"),
    Cause("P-delta", "softness_per_m", 0.0, (0.0, 0.025), "sway before collapse", unit="1/m"),
    Cause("density", "density_factor", 1.0, (0.75, 1.25), "wrong weight of the blocks"),
    Cause("wear", "wear_per_test", 0.0, (0.0, 0.04), "friction falls from test to test"),
    Cause("edge crushing", "crushing_per_mpa", 0.0, (0.0, 8.0), "toe of finite strength", unit="1/MPa"),
    Cause("angle offset", "offset", 0.0, (-3.0, 3.0), "zero of the inclinometer", "measurement", angle_offset, "deg"),
    Cause("gain", "gain", 1.0, (0.75, 1.3), "gain of the sensor", "measurement", gain),
    Cause("batch shift", "batch", 1.0, (0.75, 1.3), "second batch read differently", "measurement", batch),
    Cause("load direction", "direction", 0.0, (-15.0, 15.0), "inclined load", "measurement", direction, "deg"),
)


def specimen(setup, height, thickness, unit_height, overlap, *, length=0.9, side_walls=2, overload=0.0):
    """A specimen without the circumstances of its test."""
    return {
        "setup": setup, "height": height, "thickness": thickness, "unit_height": unit_height, "overlap": overlap,
        "length": length, "side_walls": side_walls, "overload": overload,
    }


def _twelve():
    """Tilted walls of one block thickness, no sliding or in-plane specimen: a typical small campaign."""
    walls = [specimen("wall", h, 0.10, 0.05, v) for h in (0.5, 0.8, 1.1) for v in (0.03, 0.05)]
    walls += [specimen("wall", h, 0.10, 0.05, 0.04, overload=q) for h, q in ((0.8, 800.0), (1.1, 800.0))]
    return walls + [specimen("flexure", h, 0.10, 0.05, v, length=1.6) for h in (0.5, 0.8) for v in (0.04, 0.08)]


def _twenty_four():
    """Two thicknesses, two block heights, some in-plane, sliding and loaded specimens."""
    out = [specimen("wall", h, t, 0.05, 0.04) for h in (0.5, 0.8, 1.1) for t in (0.08, 0.12)]
    out += [specimen("wall", h, 0.10, 0.07, 0.05, overload=q) for h in (0.56, 0.98) for q in (500.0, 1500.0)]
    out += [specimen("flexure", h, t, 0.05, 0.06, length=1.6) for h in (0.5, 0.8) for t in (0.08, 0.12)]
    out += [specimen("in-plane", h, 0.10, 0.05, v) for h in (0.4, 0.8) for v in (0.05, 0.08)]
    out += [specimen("stack", h, 0.10, 0.05, 0.08) for h in (0.2, 0.3)]
    return out + [specimen("slide", 0.1, 0.10, 0.05, 0.08, overload=q) for q in (0.0, 0.0, 500.0, 1500.0)]


def _forty():
    """The campaign of 24, enlarged."""
    out = _twenty_four()
    out += [specimen("wall", h, t, 0.04, 0.06, side_walls=1) for h in (0.4, 0.8, 1.2) for t in (0.08, 0.12)]
    out += [specimen("flexure", h, 0.10, 0.07, 0.09, length=2.0) for h in (0.56, 0.98)]
    out += [specimen("in-plane", h, 0.10, 0.07, 0.09) for h in (0.56, 0.98)]
    out += [specimen("stack", h, t, 0.05, 0.08, overload=q) for h in (0.2, 0.4) for t, q in ((0.08, 0), (0.12, 800))]
    return out + [specimen("slide", 0.1, 0.12, 0.05, 0.08, overload=q) for q in (200.0, 3000.0)]


def _alike():
    """Twenty-four walls of one block thickness: more tests of the same kind, so the same twins."""
    walls = [specimen("wall", h, 0.10, 0.05, v) for h in (0.4, 0.6, 0.8, 1.0, 1.2) for v in (0.03, 0.05)]
    walls += [specimen("wall", h, 0.10, 0.05, 0.04, overload=q) for h in (0.6, 1.0) for q in (400.0, 800.0)]
    flexure = [
        specimen("flexure", h, 0.10, 0.05, v, length=1.6) for h in (0.4, 0.5, 0.6, 0.7, 0.8) for v in (0.04, 0.08)
    ]
    return walls + flexure


DESIGNS = {"12": _twelve, "24": _twenty_four, "24 alike": _alike, "40": _forty}


def rich_pool():
    """Specimens of every set-up, many beyond the range of the campaigns: four at random already tell a lot."""
    out = [specimen("wall", h, t, 0.05, v) for h in (0.3, 0.7, 1.3) for t in (0.06, 0.15) for v in (0.02, 0.06)]
    out += [specimen("wall", 0.8, t, 0.05, 0.04, overload=3000.0) for t in (0.06, 0.15)]
    out += [
        specimen("flexure", h, t, 0.05, v, length=1.6) for h in (0.4, 0.8) for t in (0.06, 0.15) for v in (0.03, 0.08)
    ]
    return _numbered(out + _others())


def plain_pool():
    """Mostly more of the walls already tested, of the blocks at hand, and a few of every other set-up."""
    out = [
        specimen("wall", h, 0.10, 0.05, v) for h in (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1) for v in (0.03, 0.04, 0.05)
    ]
    out += [specimen("wall", h, 0.10, 0.05, 0.04, overload=q) for h in (0.6, 0.8, 1.0) for q in (400.0, 800.0)]
    out += [specimen("flexure", h, 0.10, 0.05, v, length=1.6) for h in (0.4, 0.5, 0.6, 0.8) for v in (0.04, 0.06, 0.08)]
    out += [specimen("wall", 0.8, t, 0.05, 0.04) for t in (0.06, 0.15)]
    return _numbered(out + _others())


def _others():
    out = [specimen("in-plane", h, 0.10, 0.05, v) for h in (0.3, 1.0) for v in (0.04, 0.08)]
    out += [specimen("stack", h, t, 0.05, 0.08) for h, t in ((0.15, 0.06), (0.3, 0.06), (0.6, 0.15))]
    return out + [specimen("slide", 0.1, 0.10, 0.05, 0.08, overload=q) for q in (0.0, 3000.0)]


def _numbered(specimens):
    for i, s in enumerate(specimens):
        s.update(order=1 + i % 10, batch="AB"[i % 2], age=30.0, operator="XYZ"[i % 3])
    return specimens


def design(name):
    """Specimens of a design, with circumstances drawn once per design.

    Order of tests, batch, age and operator are recorded; no cause of the list depends on age or operator.
    """
    out = DESIGNS[name]()
    n = len(out)
    rng = np.random.default_rng(n + len(name))
    order = rng.permutation(n)
    ages = rng.permutation(np.linspace(5, 60, n))
    for i, s in enumerate(out):
        s["order"] = int(order[i]) // 2 + 1  # a set of blocks for every two tests
        s["batch"] = "AB"[int(rng.integers(2))]
        s["age"] = round(float(ages[i]), 1)
        s["operator"] = "XYZ"[int(rng.integers(3))]
    return out
