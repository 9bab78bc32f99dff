"""Small models with known multipliers on which the tests of causes act."""

import math

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.constants import GRAVITY

PHI = 35.0


MU = math.tan(math.radians(PHI))


DENSITY, G = 2000.0, GRAVITY


MODEL = [n for n, f in catalogue.ALL.items() if f().apply is not None and f().acts_on == "simulation"]


READINGS = [n for n, f in catalogue.ALL.items() if f().acts_on == "measurement"]


SPECIMEN = {"order": 4, "batch": "B", "overload": 2.0}


def block(b=0.2, h=1.0, t=0.3, phi=PHI, **law):
    """One block, b along x and the load, h high, t across; and its weight [N]."""
    joint = lm.Joint(friction_angle_deg=phi, **law)
    made = lm.build.column(width=b, depth=t, unit_height=h, courses=1, joint=joint, density=DENSITY)
    return made, DENSITY * G * b * h * t


def wall(top=0.0, courses=5, **law):
    joint = lm.Joint(friction_angle_deg=36.0, **law)
    made = lm.build.wall(length=1.6, courses=courses, unit=(0.4, 0.2, 0.2), joint=joint)
    loads = lm.Loads.horizontal(made)
    if top:
        for name in [b.name for b in made.blocks if b.name.split("-")[1:2] == [f"{courses:02d}"]]:
            loads = loads.with_point_load(made, name, (0, 0, -top), case="dead")
    return made, loads


def softening_wall():
    """A loaded wall of units with a modulus, on joints with a stiffness, that lose strength over an opening."""
    made, loads = wall(
        top=800.0, normal_stiffness=1e9, shear_stiffness=4e8, cohesion=2e3, tensile_strength=1e3,
        fracture_energy_tension=5.0, fracture_energy_shear=20.0,
    )
    return made.with_material(lm.Material(young_modulus=5e9, poisson_ratio=0.2)), loads


def extend(name, size, model, **options):
    cause = catalogue.ALL[name](**options)
    return cause.apply(size, *model, **({"specimen": SPECIMEN} if cause.reads_specimen else {}))


def value(assembly, loads, **options):
    prediction = lm.limit_analysis(assembly, loads, **options)
    assert prediction.status == "solved"
    return prediction.collapse_multiplier
