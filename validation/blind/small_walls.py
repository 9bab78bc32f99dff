"""Fourteen small specimens, causes that act in both codes, and the stored values of limit analysis and of the DEM.

Like with like: every joint has psi = phi, so that the multiplier is unique and the same in theory for associative limit
analysis and for the DEM. What is left between the codes is the bracket and the finite stiffness of the DEM. Dimensions,
friction and its error are assumed: they are a design to be tried on, not tests that were made.
"""

import csv
from dataclasses import dataclass, field
from math import atan, degrees
from pathlib import Path

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.diagnosis import Extension, Measured
from limitmason.diagnosis.simulate import collapse

STORE = Path(__file__).with_name("two_codes.csv")
HEAD = ("code", "specimen", "cause", "size", "friction coefficient", "collapse multiplier")
UNITS = ("-", "-", "-", "unit of the cause", "-", "-")
LIMIT, DEM = "limit", "dem"
OPTIONS: dict[str, dict[str, object]] = {
    LIMIT: {"flow_rule": "associative"},
    DEM: {"error_budget": (), "tolerance": 3e-3, "contact_points": (3, 2)},
}

FRICTION, FRICTION_ERROR = 0.65, 0.02  # assumed
NUISANCE = {"friction_coefficient": Measured(FRICTION, FRICTION_ERROR)}
COVARIATES = ("setup", "height", "thickness", "overload", "batch")

SIMULATED = (
    catalogue.edge_rounding((0.0, 12.0)),
    catalogue.effective_thickness((0.7, 1.0)),
    catalogue.weak_base_joint((0.56, 1.0)),
    catalogue.cohesion((0.0, 0.5)),
    catalogue.out_of_plumb((-3.5, 3.5)),
    catalogue.overload_magnitude((0.5, 1.5)),
)
# no angle offset: of walls under a load in proportion to their weight it is nearly the twin of a lean
READ = (catalogue.gain((0.75, 1.35)), catalogue.batch_shift((0.75, 1.35)))
CAUSES = SIMULATED + READ


def specimen(name, setup, unit, courses, batch, length=None, *, start="whole", overload=0.0):
    """One specimen: unit (length, height, thickness) [m], wall length [m] or None for a stack, overload [N]."""
    return {
        "name": name, "setup": setup, "unit": unit, "courses": courses, "length": length, "start": start,
        "overload": overload, "batch": batch, "height": courses * unit[1], "thickness": unit[2],
    }


SPECIMENS = (
    specimen("stack of 3", "out of plane", (0.20, 0.10, 0.10), 3, "A"),
    specimen("stack of 4, thick", "out of plane", (0.20, 0.10, 0.20), 4, "B"),
    specimen("stack of 5, thin", "out of plane", (0.20, 0.06, 0.06), 5, "A"),
    specimen("stack of 4, loaded", "out of plane", (0.20, 0.08, 0.10), 4, "B", overload=150.0),
    specimen("strip, 2 x 4", "out of plane", (0.20, 0.10, 0.10), 4, "B", 0.4),
    specimen("strip, 2 x 3, thick", "out of plane", (0.20, 0.10, 0.15), 3, "A", 0.4),
    specimen("strip, 2 x 3, loaded", "out of plane", (0.20, 0.08, 0.08), 3, "A", 0.4, overload=300.0),
    specimen("wall, 2 x 4", "in plane", (0.20, 0.10, 0.10), 4, "B", 0.4),
    specimen("wall, 2 x 6", "in plane", (0.20, 0.10, 0.10), 6, "A", 0.4),
    specimen("wall, 1.5 x 5", "in plane", (0.20, 0.08, 0.10), 5, "B", 0.3, start="half"),
    specimen("wall, 2 x 6, loaded", "in plane", (0.20, 0.08, 0.10), 6, "A", 0.4, overload=400.0),
    specimen("slider, 1", "slides", (0.30, 0.10, 0.10), 1, "B"),
    specimen("slider, 3 x 2", "slides", (0.20, 0.06, 0.10), 2, "A", 0.6),
    specimen("slider, 1, loaded", "slides", (0.30, 0.10, 0.10), 1, "B", overload=40.0),
)


def build(s, friction_coefficient=FRICTION):
    """Assembly and loads: horizontal body force live; overload a vertical dead force on the top block or beam."""
    phi = degrees(atan(friction_coefficient))
    joint = lm.Joint(phi, dilatancy_angle_deg=phi)
    length, height, thickness = s["unit"]
    if s["length"] is None:
        model = lm.build.column(width=length, depth=thickness, unit_height=height, courses=s["courses"], joint=joint)
        top = f"column-{s['courses']}"
    else:
        model = lm.build.wall(
            length=s["length"], courses=s["courses"], unit=s["unit"], start=s["start"], joint=joint,
            top_beam=height if s["overload"] else None,
        )
        top = "beam"
    loads = lm.Loads.horizontal(model, (0.0, 1.0, 0.0) if s["setup"] == "out of plane" else (1.0, 0.0, 0.0))
    if s["overload"]:
        loads = loads.with_point_load(model, top, (0.0, 0.0, -s["overload"]), case="dead")
    return model, loads


def key(code, s, friction_coefficient, extend=None):
    """Heading columns of a stored value; a cause at its baseline is no cause."""
    steps = [(c, size) for c, size in (extend.steps if extend else ()) if size != c.baseline]
    if len(steps) > 1:
        raise ValueError("values are stored for one cause at a time")
    cause, size = (steps[0][0].name, f"{steps[0][1]:.10g}") if steps else ("", "")
    return code, s["name"], cause, size, f"{friction_coefficient:.10g}"


def read(store=STORE):
    """Stored values by key; lines that begin with # say where they come from."""
    if not store.exists():
        return {}
    with store.open(encoding="utf-8") as lines:
        rows = [r for r in csv.reader(lines) if r and not r[0].startswith("#")]
    if tuple(map(tuple, rows[:2])) != (HEAD, UNITS):
        raise ValueError(f"{store.name} must begin with the columns {HEAD} and their units {UNITS}")
    return {tuple(r[:5]): float(r[5]) for r in rows[2:] if len(r) == 6}


@dataclass
class Simulator:
    """``simulate(specimen, friction_coefficient=, extend=)`` of one code, from the store.

    Parameters
    ----------
    code : "limit" or "dem"
    values : stored values, shared
    append : called with (key, value) for values that are not stored; None refuses them
    """

    code: str
    values: dict = field(repr=False)
    append: object = field(default=None, repr=False)

    def __call__(self, specimen, *, friction_coefficient=FRICTION, extend=None):
        """Collapse multiplier."""
        name = key(self.code, specimen, friction_coefficient, extend)
        if name not in self.values:
            if self.append is None:
                raise LookupError(f"no stored value for {name}: run python -m validation.blind.two_codes --make")
            self.values[name] = self.compute(specimen, friction_coefficient, extend)
            self.append(name, self.values[name])
        return self.values[name]

    def compute(self, specimen, friction_coefficient=FRICTION, extend=None):
        """The same from the code itself."""
        simulate = collapse(build, self.code, **OPTIONS[self.code])
        return simulate(specimen, friction_coefficient=friction_coefficient, extend=extend)

    def predict(self, names=(), sizes=(), z=0.0):
        """Values of all specimens with at most one cause; ``z`` is the friction in standard deviations."""
        chosen = [next(c for c in CAUSES if c.name == n) for n in names]
        steps = tuple((c, s) for c, s in zip(chosen, sizes, strict=True) if not c.transforms)
        out = []
        for s in SPECIMENS:
            value = self(s, friction_coefficient=FRICTION + FRICTION_ERROR * z, extend=Extension(steps, s))
            for cause, size in zip(chosen, sizes, strict=True):
                value = cause.apply(size, value, s) if cause.transforms else value
            out.append(value)
        return out

    def knows(self, cause, size, frictions):
        """Whether the truth with a cause can be read from the store for all specimens."""
        extend = Extension(() if cause.transforms else ((cause, float(size)),))
        mu = [FRICTION + FRICTION_ERROR * z for z in frictions]
        return all(key(self.code, s, m, extend) in self.values for s in SPECIMENS for m in mu)
