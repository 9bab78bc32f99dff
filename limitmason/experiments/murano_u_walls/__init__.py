"""Two-leaf stone walls on a U plan under an airbag, dry (DS) and with mortar (REGW), as published by Murano et al.

Tests by Martins (DS) and Maccarini (REGW); joints as calibrated on them in 3DEC. The walls are known by their overall
dimensions and one idealisation for limit analysis, not stone by stone.
"""

from dataclasses import replace
from typing import Any

from limitmason.build import wall as running_wall
from limitmason.errors import InputError
from limitmason.experiments.recipe import Recipe
from limitmason.experiments.record import Experiment, Quantity, TargetValue, chosen_options, signed
from limitmason.experiments.tables import names_in, read_description, read_options, read_shown, read_source, read_table
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

Corners = list[tuple[float, float, float]]

NAME = "murano-u-walls"
FORCE = 1e3  # live load [N]: the multiplier is the force of the airbag in kN

OPTIONS = read_options(NAME)

_BONDED = 2e6  # cohesion and tensile strength of bonded joints [Pa]: four and more times the mortar's


specimens = names_in(NAME, "walls.csv")
"""Both walls."""


def load(specimen: str, **options: Any) -> Experiment:
    """One of "DS" and "REGW".

    See ``OPTIONS``.
    """
    table, said = read_table(NAME, "walls.csv"), read_description(NAME)
    row, names = table.row(specimen), said["quantities"]
    chosen = chosen_options(OPTIONS, options, NAME)
    if chosen["return_length"] is None:
        chosen["return_length"] = float(row["return_length"])
    if not 0.0 <= chosen["roof_from"] < chosen["return_length"]:
        raise InputError(f"roof_from must lie on the side wall, 0 to {chosen['return_length']:g} m")
    suffix = "" if chosen["calibration"] == "final" else "_first"
    joint = {name: column + suffix for name, column in names["joint"].items()}
    assumptions = [
        "The layout is assumed: six equal courses in two leaves of running bond with the mean stone of the source's "
        f"idealisation, a through-stone at every {chosen['header_positions']}. position of every "
        f"{chosen['header_courses']}. course, interlocking corners.",
        f"The side walls are assumed {chosen['return_length']:g} m long: derived from the axis of the plan, 3.65 m.",
        "The airbag is assumed to press evenly on the rear face between the side walls, 1.65 m = 2.25 m - 2 x 0.30 m.",
        f"The 10 kN on each side wall are assumed spread evenly from {chosen['roof_from']:g} m behind the facade's "
        "outer face to its free end.",
        said["assumptions"]["ground"][chosen["ground"]],
    ]
    if float(row["c" + suffix]):
        assumptions.append(said["assumptions"]["residual"][chosen["residual"]])
    else:
        assumptions.append(
            "The irregular dry wall is assumed to have the layout of the regular one, as its source did."
        )
    return Experiment(
        source=read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS, row=row,
        title=f"Two-leaf U wall of {row['masonry']}, airbag behind the facade", assumptions=tuple(assumptions),
        parameters={**table.quantities(row, names["parameters"] | joint), "observed mechanism": row["observed"]},
        measured=table.quantities(row, names["measured"]),
        published=table.quantities(row, names["published"]),
        targets=(TargetValue("peak (section 2)", "measured"), TargetValue("peak (section 6)", "measured")),
        multiplier_to_measured=Quantity(FORCE / 1e3, "kN"),
        open_options={
            "ground": ("bonded", "joint"), "residual": ("none", "cohesion"), "roof_from": (0.0, 0.3),
            "header_positions": (2, 3, 4), "return_length": (0.85, 1.0, 1.15),
        },
    )


def assembly(test: Experiment) -> Assembly:
    """Facade along x with its outer face at y = 0, side walls towards +y, on a slab."""
    p, o = test.parameters, test.options
    mortar = bool(p["cohesion"])
    after: dict[str, Any] = {
        "cohesion": {"residual_tensile_strength": 0.0},
        "none": {"residual_cohesion": 0.0, "residual_tensile_strength": 0.0},
        "full": {},
    }[o["residual"]]
    joint = Joint(
        float(p["friction angle"]), dilatancy_angle_deg=o["dilatancy_deg"], cohesion=float(p["cohesion"]) * 1e6,
        tensile_strength=float(p["tensile strength"]) * 1e6, normal_stiffness=float(p["normal stiffness"]) * 1e9,
        shear_stiffness=float(p["shear stiffness"]) * 1e9, name="mortar joint" if mortar else "dry joint",
        **(after if mortar else {}),
    )
    ground = joint
    if o["ground"] == "bonded":
        ground = replace(
            joint, cohesion=_BONDED, tensile_strength=_BONDED, residual_cohesion=None, residual_tensile_strength=None,
            name="bonded to the ground",
        )
    elif o["ground"] in ("no tension", "dry"):
        ground = replace(
            joint, tensile_strength=0.0, residual_cohesion=None, residual_tensile_strength=None,
            cohesion=0.0 if o["ground"] == "dry" else joint.cohesion, name=f"ground, {o['ground']}",
        )
    leaf = float(p["leaf"])
    wall = running_wall(
        length=float(p["span"]), courses=int(p["courses"]), plan="U", return_length=float(o["return_length"]),
        unit=(float(p["unit length"]), float(p["course height"]), leaf), staggering=float(p["staggering"]),
        leaves=round(float(p["thickness"]) / leaf),
        header_every=(int(o["header_courses"]), int(o["header_positions"])),
        joint=joint, joints={"base": ground}, density=float(p["density"]),
    )
    return signed(wall, test)


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Weight and roof load dead.

    An airbag of 1 kN on the rear of the facade live, pushing it off its side walls.

    ``sense`` is 1 for that direction.
    """
    found = Loads.weight(wall)
    for top in roofs(test):
        force = 1e3 * float(test.parameters["roof load on each side wall"])
        found = found.with_patch_pressure(wall, top, force=force, case="dead")
    return found.with_patch_pressure(wall, airbag(test), force=sense * FORCE)


def roofs(test: Experiment) -> list[Corners]:
    """Corners of the patches on the two side walls that carry the roof [m]."""
    span, depth, height = _sizes(test)
    start, end = float(test.options["roof_from"]), float(test.options["return_length"])
    return [
        [(x, start, height), (x + depth, start, height), (x + depth, end, height), (x, end, height)]
        for x in (0.0, span - depth)
    ]


def airbag(test: Experiment) -> Corners:
    """Corners of the airbag on the rear of the facade [m]."""
    span, depth, height = _sizes(test)
    left = 0.5 * (span - float(test.parameters["airbag width"]))
    right, low = span - left, height - float(test.parameters["airbag height"])
    return [(right, depth, low), (left, depth, low), (left, depth, height), (right, depth, height)]


def _sizes(test: Experiment) -> tuple[float, float, float]:
    span, depth, height = (float(test.parameters[k]) for k in ("span", "thickness", "height"))
    return span, depth, height


def control_block(test: Experiment) -> int:
    """Number of the stone at the top of the facade's outer face at mid-span, where the test measured displacements."""
    wall = test.assembly()
    half = 0.5 * float(test.parameters["span"])
    top = max(block.bounds[1, 2] for block in wall.blocks)
    face = [
        i for i, block in enumerate(wall.blocks) if block.bounds[1, 2] > top - 1e-6 and abs(block.bounds[0, 1]) < 1e-6
    ]
    # two stones meet at mid-span: rounding must not choose between them
    return min(face, key=lambda i: (round(abs(float(wall.centroids[i, 0]) - half), 6), float(wall.centroids[i, 0])))


RECIPE = Recipe(specimens, load, assembly, loads, shown=read_shown(NAME))
