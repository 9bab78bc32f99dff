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
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options, with_source
from limitmason.experiments.recipe import Recipe
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.material import Material
from limitmason.model.stages import Drive

NAME = "bnw-walls"
BEAM = "beam"
WEIGHTLESS = 1e-6  # density of the units [kg/m3]: a block needs a positive one
FORCE = 1e3  # live load [N]: the multiplier is the horizontal force in kN
NO_FRICTION = (
    "friction of the mortar joints is not in the sources at hand (the material table was lost, the database leaves it "
    "blank); give it as an option, for example load('bnw-walls', 'BNW1', friction=0.6), with or without the initial "
    "shear strength of the database, cohesion=0.25e6"
)

OPTIONS = source_folder.read_options(NAME)

ASSUMED: Mapping[str, Any] = {
    "kn": 30e9, "ks": 12e9, "poisson_ratio": 0.15, "unit_friction_deg": 35.0, "unit_tension": 0.2e6,
    "unit_cracks": False,
}
"""Taken for units that deform where no option says otherwise; none of it is in the sources at hand."""

CRACK_STIFFNESS: Mapping[str, Any] = {"normal_stiffness": 2e11, "shear_stiffness": 1e11}
"""Of a closed crack in a unit [Pa/m]: it adds 6 % to the compliance of a unit of 3.1 GPa."""


specimens = source_folder.names_in(NAME, "walls.csv")
"""Names of the walls."""


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment of a wall.

    Parameters
    ----------
    specimen : "BNW1", "BNW2" or "BNW3"
    options : of the assembly, see ``OPTIONS``
    """
    table = source_folder.read_table(NAME, "walls.csv")
    row = table.row(specimen)
    chosen = chosen_options(OPTIONS, options, NAME)
    if chosen["young_modulus"] is None:
        for name in ("poisson_ratio", "unit_strength", "unit_friction_deg", "unit_tension", "unit_cracks"):
            if chosen[name] is not None:
                raise InputError(f"{NAME}: {name} is of units that deform: give young_modulus too, or leave it out")
    said = source_folder.read_description(NAME)
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS,
        row=row,
        title=f"Hollow clay unit wall with mortar, cyclic, constant vertical stress {row['sigma0']} MPa",
        parameters={**table.quantities(row, said["quantities"]["parameters"]), "failure type": row["failure_type"]},
        measured=table.quantities(row, said["quantities"]["measured"]),
        published=table.quantities(row, {"UDEC limit force": "V_udec"}, "calibrated on these walls"),
        assumptions=(*said["assumptions"]["always"], *_assumed_of_units(chosen)),
        targets=(
            TargetValue("Vmax+", "measured", direction="+"),
            TargetValue("Vmax-", "measured", direction="-"),
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
    options = _completed(chosen)
    strength = "the masonry's strength"
    if options["unit_strength"] is not None:
        strength = f"{1e-6 * options['unit_strength']:g} MPa"
    cracks = "no crack planes"
    if options["unit_cracks"]:
        cracks = "a brittle crack may open across the middle of each whole unit"
    return (
        "Units are assumed isotropic, Mohr-Coulomb with a tension cut-off: E "
        f"{1e-9 * options['young_modulus']:g} GPa, nu {options['poisson_ratio']:g}, {strength} in uniaxial "
        f"compression, {options['unit_friction_deg']:g} degrees, dilatancy 0, ft {1e-6 * options['unit_tension']:g} "
        f"MPa, nothing of it lost in yielding; {cracks}. None of this is in the sources at hand.",
        f"Joints are assumed to have kn {1e-9 * options['kn']:g} and ks {1e-9 * options['ks']:g} GPa/m, no tensile "
        "strength, and to lose nothing in slip.",
    )


def _completed(chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Options of units that deform, with what is assumed where none was chosen."""
    return {k: ASSUMED.get(k) if v is None else v for k, v in chosen.items()}


def unit_material(test: Experiment) -> Material:
    """Mohr-Coulomb material of the units that deform, of the wall of a ``test``.

    The cohesion is c = fc / (2 tan(45 + phi / 2)). fc is that of the masonry where no option says otherwise.

    Raises
    ------
    InputError
        For rigid units.
    """
    options = _completed(test.options)
    if options["young_modulus"] is None:
        raise InputError(f"{test.name} has rigid units: give the option young_modulus")
    strength, friction_deg = options["unit_strength"], options["unit_friction_deg"]
    if strength is None:
        strength = 1e6 * float(test.parameters["masonry strength"])
    return Material(
        young_modulus=options["young_modulus"], poisson_ratio=options["poisson_ratio"],
        tensile_strength=options["unit_tension"], friction_angle_deg=friction_deg, name="hollow clay unit",
        cohesion=strength / (2.0 * np.tan(np.deg2rad(45.0 + 0.5 * friction_deg))),
    )


def assembly(test: Experiment) -> Assembly:
    """The wall of a ``test`` on its foundation slab under a thin beam."""
    options, given = test.options, test.parameters
    deform = options["young_modulus"] is not None
    # rigid units cannot crush themselves: their joints do
    crushes = options["crushing"] if options["crushing"] is not None else not deform
    crushing = {"compressive_strength": float(given["masonry strength"]) * 1e6} if crushes else {}
    stiff = {k: ASSUMED[k] if options[k] is None and deform else options[k] for k in ("kn", "ks")}
    joint = Joint.from_friction_coefficient(
        options["friction"], dilatancy_angle_deg=options["dilatancy_deg"], cohesion=options["cohesion"],
        name="mortar joint", normal_stiffness=stiff["kn"], shear_stiffness=stiff["ks"], **crushing,
    )
    unit = unit_material(test) if deform else None
    crack = None
    if unit is not None and options["unit_cracks"]:
        crack = Joint(
            float(unit.friction_angle_deg or 0.0), cohesion=float(unit.cohesion or 0.0), residual_cohesion=0.0,
            tensile_strength=float(unit.tensile_strength or 0.0), residual_tensile_strength=0.0,
            name="crack in a unit", **CRACK_STIFFNESS,
        )
    courses = int(given["courses"])
    # as many whole units as fit: each model unit takes half of the joints beside it and is longer than the unit
    per_course = int(float(given["length"]) / (float(given["unit length"]) / 1e3))
    # weightless, as assumed: the vertical force comes on the beam
    wall = running_wall(
        length=float(given["length"]), courses=courses, joint=joint, density=WEIGHTLESS, unit_cracks=crack,
        unit=(float(given["length"]) / per_course, float(given["height"]) / courses, float(given["thickness"])),
        top_beam=options["beam_height"], beam_density=0.0,
    )
    if unit is not None:
        wall = wall.with_material(unit, blocks=[b.name for b in wall.blocks if b.name != BEAM])
    return with_source(wall, test)


def drive(test: Experiment) -> Drive:
    """The beam pushed sideways, free to rise and to turn."""
    del test
    return Drive({BEAM: {"x": 1.0}})


def curve(test: Experiment) -> Curve:
    """Bilinear idealisation of the measured envelope of a ``test``, positive sense.

    It is that of the database. The displacement is in [mm], the load in [kN].
    """
    measured, height = test.measured, 1e3 * float(test.parameters["height"])  # [mm]
    force = float(measured["bilinear force+"])
    drifts = (0.0, float(measured["bilinear elastic drift+"]), float(measured["bilinear ultimate drift+"]))  # [%]
    return Curve(
        np.array([1e-2 * drift * height for drift in drifts]), np.array([0.0, force, force]),
        displacement_unit="mm", load_unit="kN",
        label=f"{test.specimen}, bilinear of the measured envelope", source=str(test.source),
    )


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Vertical force dead at the beam's centroid, 1 kN sideways live at H0.

    Parameters
    ----------
    test : the experiment
    wall : its assembly
    sense : 1 for a live load along x, -1 against it
    """
    given = test.parameters
    force = float(given["vertical stress"]) * 1e6 * float(given["length"]) * float(given["thickness"])
    i = wall.block_index(BEAM)
    at = (wall.centroids[i, 0], wall.centroids[i, 1], float(given["H0 over H"]) * float(given["height"]))
    return (
        Loads.weight(wall)
        .with_precompression(wall, force, block=BEAM)
        .with_point_load(wall, BEAM, (sense * FORCE, 0.0, 0.0), at=at)
    )


RECIPE = Recipe(specimens, load, assembly, loads, curve, source_folder.read_shown(NAME), drive)
