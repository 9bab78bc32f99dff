"""Hollow clay unit shear walls BNW1-3 with mortar, ZAG Ljubljana (Bosiljkov and Tomazevic 2005)."""

from typing import Any

from limitmason.build import wall as running_wall
from limitmason.experiments.recipe import Recipe
from limitmason.experiments.record import Experiment, Option, Quantity, Target, chosen_options, signed
from limitmason.experiments.shown import Departure, Settings, Shown, Variant
from limitmason.experiments.tables import read_source, read_table
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

NAME = "bnw-walls"
BEAM = "beam"
FORCE = 1e3  # live load [N]: the multiplier is the horizontal force in kN
NO_FRICTION = (
    "friction of the mortar joints is not in the sources at hand (the material table was lost, the database leaves it "
    "blank); give it as an option, for example load('bnw-walls', 'BNW1', friction=0.6), with or without the initial "
    "shear strength of the database, cohesion=0.25e6"
)

OPTIONS = {
    "friction": Option(None, "-", "friction coefficient; not in the sources at hand, so it must be given"),
    "cohesion": Option(0.0, "Pa", "cohesion of the joints; 0 is assumed, the database gives fv0 = 0.25e6"),
    "dilatancy_deg": Option(0.0, "deg", "dilatancy angle, used by non-associative limit analysis"),
    "crushing": Option(True, "-", "give the joints the compressive strength of the masonry"),
    "beam_height": Option(0.02, "m", "height of the model's beam; small, so that the force acts at the wall's top"),
}


def specimens() -> tuple[str, ...]:
    """Names of the walls."""
    return tuple(r["specimen"] for r in read_table(NAME, "walls.csv").rows)


def load(specimen: str, **options: Any) -> Experiment:
    """One of "BNW1", "BNW2", "BNW3"; see ``OPTIONS``."""
    table = read_table(NAME, "walls.csv")
    row = table.row(specimen)
    chosen = chosen_options(OPTIONS, options, NAME)
    measured = {
        "Vmax+": "V_max_pos", "Vmax-": "V_max_neg", "drift at first crack": "d_cr", "drift at Vmax+": "d_max_pos",
        "drift at Vmax-": "d_max_neg", "ultimate drift+": "d_u_pos", "ultimate drift-": "d_u_neg",
    }  # fmt: skip
    parameters = {
        "height": "H", "length": "L", "thickness": "t", "courses": "courses", "unit length": "unit_l",
        "unit width": "unit_w", "unit height": "unit_h", "unit strength": "fb", "mortar strength": "f_mortar",
        "masonry strength": "f_masonry", "initial shear strength": "fv0", "H0 over H": "H0_over_H",
        "vertical stress": "sigma0",
    }  # fmt: skip
    return Experiment(
        source=read_source(NAME),
        specimen=specimen,
        title=f"Hollow clay unit wall with mortar, cyclic, constant vertical stress {row['sigma0']} MPa",
        parameters={**table.quantities(row, parameters), "failure type": row["failure_type"]},
        measured=table.quantities(row, measured),
        published={"UDEC limit force": table.quantity(row, "V_udec", "calibrated on these walls")},
        recomputed={},
        assumptions=(
            "Running bond of ten expanded units per course without mortar thickness is assumed, wall length and height "
            "divided evenly; the bottom course is assumed to start with a whole unit.",
            "Friction is yours to assume: not in the sources at hand. Cohesion is assumed zero unless given: the "
            "database has an initial shear strength of 0.25 MPa without saying how it was obtained.",
            "The vertical force is taken as sigma0 L t at the top; wall and beam are assumed weightless.",
            "The horizontal force is assumed at the top of the wall (H0/H = 1), on a thin beam that carries both "
            "forces and is free to rotate (cantilever).",
            "The masonry strength is assumed for every joint, uniform and plastic; units are rigid, so cracks through "
            "units, seen in the tests of BNW2 and BNW3, cannot appear.",
        ),
        targets=(
            Target("Vmax+", "measured", None, "+"),
            Target("Vmax-", "measured", None, "-"),
            Target("UDEC limit force", "published", "non-associative"),
        ),
        multiplier_to_measured=Quantity(FORCE / 1e3, "kN"),
        recipe=RECIPE,
        options=chosen,
        option_table=OPTIONS,
        row=row,
        no_model=NO_FRICTION if chosen["friction"] is None else "",
    )


def assembly(test: Experiment) -> Assembly:
    """The wall on its foundation slab under a thin beam."""
    o, p = test.options, test.parameters
    crushing = {"compressive_strength": float(p["masonry strength"]) * 1e6} if o["crushing"] else {}
    joint = Joint.from_friction_coefficient(
        o["friction"], dilatancy_angle_deg=o["dilatancy_deg"], cohesion=o["cohesion"], name="mortar joint", **crushing
    )
    courses = int(p["courses"])
    lengths = round(float(p["length"]) / (float(p["unit length"]) / 1e3))
    wall = running_wall(
        length=float(p["length"]),
        courses=courses,
        unit=(float(p["length"]) / lengths, float(p["height"]) / courses, float(p["thickness"])),
        joint=joint,
        density=1e-6,
        top_beam=o["beam_height"],
        beam_density=0.0,
    )
    return signed(wall, test)


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Vertical force dead at the beam's centroid; 1 kN sideways at the top of the wall live."""
    p = test.parameters
    force = float(p["vertical stress"]) * 1e6 * float(p["length"]) * float(p["thickness"])
    i = wall.block_index(BEAM)
    at = (wall.centroids[i, 0], wall.centroids[i, 1], float(p["H0 over H"]) * float(p["height"]))
    return (
        Loads.weight(wall)
        .with_precompression(wall, force, block=BEAM)
        .with_point_load(wall, BEAM, (sense * FORCE, 0.0, 0.0), at=at)
    )


SHOWN = Shown(
    variants=(
        Variant("friction 0.4, cohesion 0.2 MPa", {"friction": 0.4, "cohesion": 0.2e6}),
        Variant("friction 0.6, no cohesion", {"friction": 0.6}),
    ),
    settings=Settings((8, 2), grid=(8, 2)),
    departures=(
        Departure(
            "BNW1, friction 0.6", "below",
            "The quick search ends too high: a longer one (slope 0.1, or random starts) finds an admissible state at "
            "224.4 kN, below the DEM.",
        ),
    ),
    assumed="Friction of the joints is not in the sources at hand; the database has an initial shear strength of 0.25 "
    "MPa. Assumed here: 0.4 and 0.2 MPa, the characteristic values of EN 1996-1-1:2005 (3.6.2 and Table 3.4, clay "
    "units, general purpose mortar M2.5 to M9), and, to show what they do, 0.6 without cohesion; no tension. Joints "
    "crush at the masonry strength of the database. Units are rigid: cracks through them, seen in the tests of BNW2 "
    "and BNW3, cannot appear. The UDEC run was calibrated on these walls.",
)  # fmt: skip

RECIPE = Recipe(specimens, load, assembly, loads, shown=SHOWN)
