"""Three campaigns on assemblies: 24 specimens, 12 and 7 of them, built box by box; a list of causes, and circumstances.

Dimensions, friction and its error are assumed: they are designs to be tried on, not tests that were made. Every joint
has psi = phi, where the multiplier is unique and the same in theory for limit analysis and for the DEM.
"""

from itertools import pairwise
from math import atan, degrees

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.diagnosis import Measured
from limitmason.geometry import box

FRICTION, FRICTION_ERROR, NOISE = 0.65, 0.02, 0.04  # assumed
NUISANCE = {"friction_coefficient": Measured(FRICTION, FRICTION_ERROR)}
DENSITY = 2000.0  # kg/m3
SPECIMEN = ("setup", "height", "thickness", "unit_height", "overload")
CIRCUMSTANCE = ("batch", "day", "order", "age")
COVARIATES = (*SPECIMEN, *CIRCUMSTANCE)

SIMULATED = (
    catalogue.edge_rounding((0.0, 12.0)),
    catalogue.effective_thickness((0.6, 1.0)),
    catalogue.weak_base_joint((0.5, 1.0)),
    catalogue.stress_dependent_friction((0.0, 0.2)),
    catalogue.cohesion((0.0, 0.5)),
    catalogue.lost_overlap((0.0, 60.0)),
    catalogue.out_of_plumb((-3.5, 3.5)),
    catalogue.overload_magnitude((0.5, 1.5)),
    catalogue.eccentric_overload((-15.0, 15.0)),
    catalogue.load_direction((-15.0, 15.0)),
)
READ = (
    catalogue.angle_offset((-3.5, 3.5)), catalogue.gain((0.75, 1.35)),
    catalogue.batch_shift((0.75, 1.35), covariate="batch", label="B"),
)
CAUSES = SIMULATED + READ
# of the catalogue, felt by limit analysis, and never on the list
NEVER_LISTED = (
    catalogue.block_size((0.8, 1.2), axes="z"), catalogue.block_density((0.7, 1.3)), catalogue.open_head_joints(),
    catalogue.head_joint_friction((0.0, 1.0)), catalogue.rig_friction((0.0, 0.15)),
)


def _specimen(setup, length, height, unit, thickness, overload=0.0):
    """Wall length and height [m], unit (length, height) [m], thickness [m], overload [N]."""
    return {"setup": setup, "length": length, "height": height, "unit": unit, "unit_height": unit[1],
            "thickness": thickness, "overload": overload}


def _all():
    out = [_specimen("stack", 0.2, n * h, (0.2, h), t) for n, h, t in ((3, 0.10, 0.10), (5, 0.06, 0.06),
           (4, 0.08, 0.14), (6, 0.06, 0.10), (3, 0.08, 0.08))]
    out += [_specimen("stack", 0.2, n * h, (0.2, h), t, q) for n, h, t, q in ((4, 0.08, 0.10, 120.0),
            (3, 0.10, 0.07, 60.0))]
    out += [_specimen("strip", 0.4, n * h, (0.2, h), t) for n, h, t in ((4, 0.10, 0.10), (3, 0.10, 0.15),
            (5, 0.08, 0.12), (4, 0.06, 0.06))]
    out += [_specimen("strip", 0.4, n * h, (0.2, h), t, q) for n, h, t, q in ((3, 0.08, 0.08, 200.0),
            (4, 0.08, 0.12, 80.0))]
    out += [_specimen("in plane", w, n * h, (0.2, h), 0.10) for n, h, w in ((4, 0.10, 0.4), (6, 0.10, 0.4),
            (5, 0.08, 0.3), (5, 0.06, 0.4))]
    out += [_specimen("in plane", 0.4, n * h, (0.2, h), 0.10, q) for n, h, q in ((6, 0.08, 300.0), (4, 0.06, 80.0))]
    slides = ((0.3, 0.10, (0.3, 0.10), 0.10, 0.0), (0.6, 0.06, (0.2, 0.06), 0.10, 0.0),
              (0.3, 0.08, (0.3, 0.08), 0.14, 0.0), (0.3, 0.10, (0.3, 0.10), 0.10, 40.0),
              (0.6, 0.06, (0.2, 0.06), 0.10, 90.0))
    return out + [_specimen("slides", w, n, u, t, q) for w, n, u, t, q in slides]


def _circumstances(specimens):
    """Batch, day, order of tests and age: the order goes with the height (tall ones last), the rest does not."""
    by_height = sorted(range(len(specimens)), key=lambda i: (specimens[i]["height"], 7 * i % 11))
    for rank, i in enumerate(by_height):
        s = specimens[i]
        s["name"], s["order"], s["day"] = f"{i + 1}", rank + 1, f"day {rank // 4 + 1}"
        s["batch"], s["age"] = "ABBABAAB"[i % 8], float(10 + 17 * i % 43)
    return tuple(specimens)


SPECIMENS = _circumstances(_all())
CHOSEN = {
    "7": (0, 2, 5, 8, 13, 17, 20),
    "12": (0, 1, 2, 5, 7, 8, 11, 13, 14, 17, 19, 22),
    "24": tuple(range(24)),
}


def specimens(name):
    """Specimens of a campaign."""
    return tuple(SPECIMENS[i] for i in CHOSEN[name])


def thrust(s):
    """Direction of the live load: along the wall in plane and in sliding, across it otherwise."""
    return (1.0, 0.0, 0.0) if s["setup"] in ("in plane", "slides") else (0.0, 1.0, 0.0)


def boxes(s):
    """Units of a specimen by name (course, place): [low corner, high corner] [m]; running bond from whole units."""
    out, unit, courses = {}, s["unit"][0], round(s["height"] / s["unit"][1])
    for k in range(courses):
        x = 0.0
        cuts = [x]
        first = unit if k % 2 == 0 or s["setup"] == "stack" else 0.5 * unit
        x = min(first, s["length"])
        while x < s["length"] - 1e-9:
            cuts.append(x)
            x += unit
        cuts.append(s["length"])
        z = k * s["unit"][1]
        for j, (a, b) in enumerate(pairwise(cuts)):
            out[k, j] = [[a, 0.0, z], [b, s["thickness"], z + s["unit"][1]]]
    return out


def joint(friction, cohesion=0.0):
    """A joint with psi = phi."""
    phi = degrees(atan(friction))
    return lm.Joint(phi, dilatancy_angle_deg=phi, cohesion=cohesion)


def build(s, friction_coefficient=FRICTION):
    """Assembly and loads without any effect."""
    return assembled(s, boxes(s), friction_coefficient)


def assembled(s, units, friction, *, densities=None, joints=None):
    """Assembly and loads from units.

    Parameters
    ----------
    units : from :func:`boxes`, moved or not
    densities : factor by name of the unit
    joints : law by pair of block names
    """
    names = ["ground", *(f"{k}-{j}" for k, j in units)]
    ground = box((-0.3, -0.3, -0.1), (s["length"] + 0.3, s["thickness"] + 0.3, 0.0))
    densities = densities or {}
    model = lm.Assembly.from_polyhedra(
        [ground, *(box(*u) for u in units.values())], joint=joint(friction), names=names, fixed=["ground"],
        density=[DENSITY, *(DENSITY * densities.get(n, 1.0) for n in units)], joints=joints,
    )
    loads = lm.Loads.horizontal(model, thrust(s))
    top = max(k for k, _ in units)
    upper = [(n, u) for n, u in units.items() if n[0] == top]
    for (k, j), (low, high) in upper if s["overload"] else ():
        part = (high[0] - low[0]) / s["length"]
        loads = loads.with_point_load(model, f"{k}-{j}", (0.0, 0.0, -part * s["overload"]), case="dead")
    return model, loads
