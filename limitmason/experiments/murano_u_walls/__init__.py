"""Two-leaf stone walls on a U plan under an airbag, dry (DS) and with mortar (REGW), as published by Murano et al.

Tests by Martins (DS) and Maccarini (REGW); joints as calibrated on them in 3DEC. The walls are known by their overall
dimensions and one idealisation for limit analysis, not stone by stone.
"""

from dataclasses import replace
from typing import Any

from limitmason.build import wall as running_wall
from limitmason.checks import count
from limitmason.errors import InputError
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options, with_source
from limitmason.experiments.recipe import Recipe
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

Corners = list[tuple[float, float, float]]

NAME = "murano-u-walls"
FORCE = 1e3  # live load [N]: the multiplier is the force of the airbag in kN

OPTIONS = source_folder.read_options(NAME)

_BONDED = 2e6  # cohesion and tensile strength of bonded joints [Pa]: four and more times the mortar's
_ROUNDING = 1e-6  # coordinates nearer than this are one [m]


specimens = source_folder.names_in(NAME, "walls.csv")
"""Both walls."""


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment of a wall.

    Parameters
    ----------
    specimen : "DS" or "REGW"
    options : of the assembly, see ``OPTIONS``
    """
    table, said = source_folder.read_table(NAME, "walls.csv"), source_folder.read_description(NAME)
    row, names = table.row(specimen), said["quantities"]
    chosen = chosen_options(OPTIONS, options, NAME)
    for name in ("header_courses", "header_positions"):
        chosen[name] = count(f"{NAME}: {name}", chosen[name])
    derived = float(row["return_length"])
    if chosen["return_length"] is None:
        chosen["return_length"] = derived
    if not 0.0 <= chosen["roof_from"] < chosen["return_length"]:
        raise InputError(f"roof_from must lie on the side wall, 0 to {chosen['return_length']:g} m")
    suffix = "" if chosen["calibration"] == "final" else "_first"  # of the columns of the joint's law
    joint = {name: column + suffix for name, column in names["joint"].items()}
    sides = f"The side walls are assumed {chosen['return_length']:g} m long"
    follows = "derived from the axis of the plan, 3.65 m"
    assumptions = [
        "The layout is assumed: six equal courses in two leaves of running bond with the mean stone of the source's "
        f"idealisation, a through-stone at every {chosen['header_positions']}. position of every "
        f"{chosen['header_courses']}. course, interlocking corners.",
        f"{sides}: {follows}." if chosen["return_length"] == derived else f"{sides}; {derived:g} m are {follows}.",
        "The airbag is assumed to press evenly on the rear face between the side walls, 1.65 m = 2.25 m - 2 x 0.30 m.",
        f"The 10 kN on each side wall are assumed spread evenly from {chosen['roof_from']:g} m behind the facade's "
        "outer face to its free end.",
        said["assumptions"]["ground"][chosen["ground"]],
    ]
    # the first calibration gives dry joints a cohesion and a tensile strength too
    if float(row["c" + suffix]):
        bond = "Mortar" if _has_mortar(row["masonry"]) else "The bond that the first calibration gives dry joints"
        assumptions.append(said["assumptions"]["residual"][chosen["residual"]].format(bond=bond))
    if not _has_mortar(row["masonry"]):
        assumptions.append(
            "The irregular dry wall is assumed to have the layout of the regular one, as its source did."
        )
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS,
        row=row,
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
    """The wall of a ``test`` on a slab, its facade along x, outer face at y = 0.

    The side walls run towards +y.
    """
    given, options = test.parameters, test.options
    after: dict[str, Any] = {  # what bonded joints keep once they have failed
        "cohesion": {"residual_tensile_strength": 0.0},
        "none": {"residual_cohesion": 0.0, "residual_tensile_strength": 0.0},
        "full": {},
    }[options["residual"]]
    joint = Joint(
        float(given["friction angle"]), dilatancy_angle_deg=options["dilatancy_deg"],
        cohesion=float(given["cohesion"]) * 1e6, tensile_strength=float(given["tensile strength"]) * 1e6,
        normal_stiffness=float(given["normal stiffness"]) * 1e9, shear_stiffness=float(given["shear stiffness"]) * 1e9,
        name="mortar joint" if _has_mortar(test.row["masonry"]) else "dry joint",
        **(after if given["cohesion"] else {}),
    )
    ground = joint
    if options["ground"] == "bonded":
        ground = replace(
            joint, cohesion=_BONDED, tensile_strength=_BONDED, residual_cohesion=None, residual_tensile_strength=None,
            name="bonded to the ground",
        )
    elif options["ground"] in ("no tension", "dry"):
        ground = replace(
            joint, tensile_strength=0.0, residual_cohesion=None, residual_tensile_strength=None,
            cohesion=0.0 if options["ground"] == "dry" else joint.cohesion, name=f"ground, {options['ground']}",
        )
    leaf = float(given["leaf"])
    wall = running_wall(
        length=float(given["span"]), courses=int(given["courses"]), plan="U",
        return_length=float(options["return_length"]),
        unit=(float(given["unit length"]), float(given["course height"]), leaf), staggering=float(given["staggering"]),
        leaves=round(float(given["thickness"]) / leaf),
        header_every=(options["header_courses"], options["header_positions"]),
        joint=joint, joints={"base": ground}, density=float(given["density"]),
    )
    return with_source(wall, test)


def _has_mortar(masonry: str) -> bool:
    """Whether the joints of a kind of masonry, as the table of walls names it, are filled with mortar."""
    return "mortar" in masonry


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Weight and roof load dead, an airbag of 1 kN on the rear of the facade live.

    Parameters
    ----------
    test : the experiment
    wall : its assembly
    sense : 1 for an airbag that pushes the facade off its side walls, along -y
    """
    found = Loads.weight(wall)
    for top in roofs(test):
        force = 1e3 * float(test.parameters["roof load on each side wall"])
        found = found.with_patch_pressure(wall, top, force=force, case="dead")
    return found.with_patch_pressure(wall, airbag(test), force=sense * FORCE)


def roofs(test: Experiment) -> list[Corners]:
    """Corners of the patches that carry the roof of a ``test``, x, y, z [m].

    There is one on each side wall.
    """
    span, depth, height = _sizes(test)
    start, end = float(test.options["roof_from"]), float(test.options["return_length"])
    return [
        [(x, start, height), (x + depth, start, height), (x + depth, end, height), (x, end, height)]
        for x in (0.0, span - depth)
    ]


def airbag(test: Experiment) -> Corners:
    """Corners of the airbag on the rear of the facade of a ``test``, x, y, z [m]."""
    span, depth, height = _sizes(test)
    left = 0.5 * (span - float(test.parameters["airbag width"]))
    right, low = span - left, height - float(test.parameters["airbag height"])
    return [(right, depth, low), (left, depth, low), (left, depth, height), (right, depth, height)]


def _sizes(test: Experiment) -> tuple[float, float, float]:
    """Length of the facade, thickness and height of the walls of an experiment [m]."""
    span, depth, height = (float(test.parameters[k]) for k in ("span", "thickness", "height"))
    return span, depth, height


def control_block(test: Experiment) -> int:
    """Number of the stone whose displacement the test measured.

    It is at the top of the facade's outer face at mid-span.
    """
    wall = test.assembly()
    middle = 0.5 * float(test.parameters["span"])
    top = max(block.bounds[1, 2] for block in wall.blocks)
    face = [
        i for i, block in enumerate(wall.blocks)
        if block.bounds[1, 2] > top - _ROUNDING and abs(block.bounds[0, 1]) < _ROUNDING
    ]
    # two stones meet at mid-span: rounding to a micrometre, and then the left one, must choose between them
    return min(face, key=lambda i: (round(abs(float(wall.centroids[i, 0]) - middle), 6), float(wall.centroids[i, 0])))


RECIPE = Recipe(specimens, load, assembly, loads, shown=source_folder.read_shown(NAME))
