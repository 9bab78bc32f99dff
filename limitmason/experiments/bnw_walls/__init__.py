"""Hollow clay unit shear walls BNW1-3 with mortar, ZAG Ljubljana (Bosiljkov and Tomazevic 2005).

Rigid units by default. With ``young_modulus`` the units deform and yield (``dem.push(..., blocks="zoned")``), with
``unit_cracks`` they may crack across their middle too, as in the UDEC model; its table of materials is lost, so that
what it held is an option with a value assumed here.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.build import wall as running_wall
from limitmason.errors import InputError
from limitmason.experiments.recipe import Recipe
from limitmason.experiments.record import Experiment, Quantity, TargetValue, chosen_options, signed
from limitmason.experiments.tables import names_in, read_description, read_options, read_shown, read_source, read_table
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.material import Material
from limitmason.model.stages import Drive

NAME = "bnw-walls"
BEAM = "beam"
FORCE = 1e3  # live load [N]: the multiplier is the horizontal force in kN
NO_FRICTION = (
    "friction of the mortar joints is not in the sources at hand (the material table was lost, the database leaves it "
    "blank); give it as an option, for example load('bnw-walls', 'BNW1', friction=0.6), with or without the initial "
    "shear strength of the database, cohesion=0.25e6"
)

OPTIONS = read_options(NAME)

ASSUMED: Mapping[str, Any] = {
    "kn": 30e9, "ks": 12e9, "poisson_ratio": 0.15, "unit_friction_deg": 35.0, "unit_tension": 0.2e6,
    "unit_cracks": False,
}
"""Taken for units that deform where no option says otherwise; none of it is in the sources at hand."""

CRACK_STIFFNESS = 2e11, 1e11
"""Normal and shear stiffness of a closed crack in a unit [Pa/m]: it adds 6 % to the compliance of a unit of 3.1 GPa."""


specimens = names_in(NAME, "walls.csv")
"""Names of the walls."""


def load(specimen: str, **options: Any) -> Experiment:
    """One of "BNW1", "BNW2", "BNW3", see ``OPTIONS``."""
    table = read_table(NAME, "walls.csv")
    row = table.row(specimen)
    chosen = chosen_options(OPTIONS, options, NAME)
    if chosen["young_modulus"] is None:
        for name in ("poisson_ratio", "unit_strength", "unit_friction_deg", "unit_tension", "unit_cracks"):
            if chosen[name] is not None:
                raise InputError(f"{NAME}: {name} is of units that deform: give young_modulus too, or leave it out")
    said = read_description(NAME)
    return Experiment(
        source=read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS, row=row,
        title=f"Hollow clay unit wall with mortar, cyclic, constant vertical stress {row['sigma0']} MPa",
        parameters={**table.quantities(row, said["quantities"]["parameters"]), "failure type": row["failure_type"]},
        measured=table.quantities(row, said["quantities"]["measured"]),
        published=table.quantities(row, {"UDEC limit force": "V_udec"}, "calibrated on these walls"),
        assumptions=(*said["assumptions"]["always"], *_assumed_of_units(chosen)),
        targets=(
            TargetValue("Vmax+", "measured", None, "+"),
            TargetValue("Vmax-", "measured", None, "-"),
            TargetValue("UDEC limit force", "published", "non-associative"),
        ),
        multiplier_to_measured=Quantity(FORCE / 1e3, "kN"),
        no_model=NO_FRICTION if chosen["friction"] is None else "",
    )


def _assumed_of_units(chosen: Mapping[str, Any]) -> tuple[str, ...]:
    """What is assumed of the units and where the wall crushes, one sentence each.

    Parameters
    ----------
    chosen : options of the specimen
    """
    if chosen["young_modulus"] is None:
        return (
            "The masonry strength is assumed for every joint, uniform and plastic; units are rigid, so cracks through "
            "units, seen in the tests of BNW2 and BNW3, cannot appear.",
        )
    o: dict[str, Any] = {k: ASSUMED.get(k) if v is None else v for k, v in chosen.items()}
    strength = "the masonry's strength" if o["unit_strength"] is None else f"{1e-6 * o['unit_strength']:g} MPa"
    cracks = "a brittle crack may open across the middle of each whole unit" if o["unit_cracks"] else "no crack planes"
    return (
        f"Units are assumed isotropic, Mohr-Coulomb with a tension cut-off: E {1e-9 * o['young_modulus']:g} GPa, nu "
        f"{o['poisson_ratio']:g}, {strength} in uniaxial compression, {o['unit_friction_deg']:g} degrees, dilatancy 0, "
        f"ft {1e-6 * o['unit_tension']:g} MPa, nothing of it lost in yielding; {cracks}. None of this is in the "
        "sources at hand.",
        f"Joints are assumed to have kn {1e-9 * o['kn']:g} and ks {1e-9 * o['ks']:g} GPa/m, no tensile strength, and "
        "to lose nothing in slip.",
    )


def unit_material(test: Experiment) -> Material:
    """Material of the units that deform: Mohr-Coulomb of a uniaxial strength fc, c = fc / (2 tan(45 + phi / 2)).

    Raises
    ------
    InputError
        For rigid units.
    """
    o: dict[str, Any] = {k: ASSUMED.get(k) if v is None else v for k, v in test.options.items()}
    if o["young_modulus"] is None:
        raise InputError(f"{test.name} has rigid units: give the option young_modulus")
    strength = 1e6 * float(test.parameters["masonry strength"]) if o["unit_strength"] is None else o["unit_strength"]
    return Material(
        young_modulus=o["young_modulus"], poisson_ratio=o["poisson_ratio"], tensile_strength=o["unit_tension"],
        friction_angle_deg=o["unit_friction_deg"], name="hollow clay unit",
        cohesion=strength / (2.0 * np.tan(np.deg2rad(45.0 + 0.5 * o["unit_friction_deg"]))),
    )


def assembly(test: Experiment) -> Assembly:
    """The wall on its foundation slab under a thin beam."""
    o, p = test.options, test.parameters
    deform = o["young_modulus"] is not None
    crushes = o["crushing"] if o["crushing"] is not None else not deform
    crushing = {"compressive_strength": float(p["masonry strength"]) * 1e6} if crushes else {}
    stiff = {k: ASSUMED[k] if o[k] is None and deform else o[k] for k in ("kn", "ks")}
    joint = Joint.from_friction_coefficient(
        o["friction"], dilatancy_angle_deg=o["dilatancy_deg"], cohesion=o["cohesion"], name="mortar joint",
        normal_stiffness=stiff["kn"], shear_stiffness=stiff["ks"], **crushing,
    )
    unit = unit_material(test) if deform else None
    crack = None
    if unit is not None and o["unit_cracks"]:
        crack = Joint(
            float(unit.friction_angle_deg or 0.0), cohesion=float(unit.cohesion or 0.0), residual_cohesion=0.0,
            tensile_strength=float(unit.tensile_strength or 0.0), residual_tensile_strength=0.0,
            normal_stiffness=CRACK_STIFFNESS[0], shear_stiffness=CRACK_STIFFNESS[1], name="crack in a unit",
        )
    courses = int(p["courses"])
    # as many whole units as fit: each model unit takes half of the joints beside it and is longer than the unit
    per_course = int(float(p["length"]) / (float(p["unit length"]) / 1e3))
    # weightless, as assumed: the vertical force comes on the beam
    wall = running_wall(
        length=float(p["length"]), courses=courses, joint=joint, density=1e-6, unit_cracks=crack,
        unit=(float(p["length"]) / per_course, float(p["height"]) / courses, float(p["thickness"])),
        top_beam=o["beam_height"], beam_density=0.0,
    )
    if unit is not None:
        wall = wall.with_material(unit, blocks=[b.name for b in wall.blocks if b.name != BEAM])
    return signed(wall, test)


def drive(test: Experiment) -> Drive:
    """The beam pushed sideways, free to rise and to turn."""
    del test
    return Drive({BEAM: {"x": 1.0}})


def curve(test: Experiment) -> Curve:
    """The database's bilinear idealisation of the measured envelope, positive sense.

    The displacement is in [mm], the load in [kN].
    """
    m, height = test.measured, 1e3 * float(test.parameters["height"])
    force = float(m["bilinear force+"])
    drifts = (0.0, float(m["bilinear elastic drift+"]), float(m["bilinear ultimate drift+"]))
    return Curve(
        np.array([1e-2 * d * height for d in drifts]), np.array([0.0, force, force]),
        displacement_unit="mm", load_unit="kN",
        label=f"{test.specimen}, bilinear of the measured envelope", source=str(test.source),
    )


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Vertical force dead at the beam's centroid, and 1 kN sideways at the top of the wall live, along x by its
    sense.
    """
    p = test.parameters
    force = float(p["vertical stress"]) * 1e6 * float(p["length"]) * float(p["thickness"])
    i = wall.block_index(BEAM)
    at = (wall.centroids[i, 0], wall.centroids[i, 1], float(p["H0 over H"]) * float(p["height"]))
    return (
        Loads.weight(wall)
        .with_precompression(wall, force, block=BEAM)
        .with_point_load(wall, BEAM, (sense * FORCE, 0.0, 0.0), at=at)
    )


RECIPE = Recipe(specimens, load, assembly, loads, curve, read_shown(NAME), drive)
