"""Tilting tests on dry marble blocks, S1-S13, University of Pavia: measured and 3DEC values, a parametric specimen.

The plans of the specimens are not published in the sources at hand. :func:`specimen` builds what they could be: a
facade held by one or two return walls, of any length, height, corner bond and loading sense.
"""

from dataclasses import replace
from typing import Any

from limitmason.build.wall import wall
from limitmason.checks import choice, count, finite, positive
from limitmason.errors import InputError
from limitmason.experiments.experiment import Experiment, TargetValue, chosen_options
from limitmason.experiments.recipe import Recipe
from limitmason.experiments.source_folder import names_in, read_parameters, read_source, read_table
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

NAME = "pavia-tilting"
NO_PLAN = (
    "the plans of the specimens (lengths, courses, openings, corner bond, sense of the load) are not published in the "
    "sources at hand; they are in Restrepo-Velez, Magenes and Griffith 2014 and in figure 7 of Godio et al. 2017; "
    "limitmason.experiments.pavia_tilting.specimen builds walls of this kind from an assumed layout"
)

DENSITY = 2700.0  # of marble, assumed [kg/m3]: without cohesion the multiplier does not depend on it
CONTACT_POINTS = {"facade": (2, 8), "return": (2, 2)}
"""Points along and across a block as Godio et al. model it: 8 across the facade, 2 in the walls that hold it."""
SENSES = {"outward": (0.0, -1.0, 0.0), "inward": (0.0, 1.0, 0.0)}
"""Directions of the live load: away from the return walls, and towards them."""
CORNERS = ("half lap", "whole units")


def specimen(
    *, facade_units: float, courses: int, return_walls: int = 2, return_units: float = 3.0, corner: str = "half lap",
    first_through: str = "facade", sense: str = "outward", dilatancy_angle_deg: float = 0.0, block_scale: float = 1.0,
) -> tuple[Assembly, Loads]:
    """A dry wall held by one or two return walls, and its loads.

    The blocks are 80 x 40 x 28 mm. They are those of a tilting table: the weight of every block, and the same weight
    across the facade as live load. lambda = tan(alpha) of the table.

    Parameters
    ----------
    facade_units : length outside to outside in block lengths, in steps of a half
    courses : number of courses of 40 mm
    return_walls : 1 (plan L, return at the left end) or 2 (plan U)
    return_units : length of a return from the outer face of the facade in block lengths, in steps of a half
    corner : bond of the courses that start behind the corner. "half lap": head joints are over the middle of the units
        below, and the first unit behind the corner is 92 mm long. "whole units": they begin at the corner, and lap by
        the thickness of the wall, 28 mm. A cut unit closes the course in the middle or at a free end
    first_through : "facade" or "return": which of the two passes through the corner in the bottom course, that is
        which courses, odd or even, are toothed into the return
    sense : "outward" pushes the facade away from the returns (-y), "inward" towards them (+y)
    dilatancy_angle_deg : psi [deg], from 0 to phi = 33.82
    block_scale : length and height of the blocks over 80 and 40 mm, in a wall of the same size and thickness. The
        height of the wall must be a whole number of the new courses. The overlap of the courses grows with the blocks,
        so that "whole units" then needs a cut unit behind the corner

    Returns
    -------
    Assembly
        Blocks "base" (held: the platform), "facade-...", "return-left-...", "return-right-...". ``recipe`` says what
        was assumed.
    Loads

    Raises
    ------
    InputError
        Naming the argument that is wrong.

    Notes
    -----
    Source of block size, friction (33.82 deg, platform too) and stiffness (kn = ks = 14 GPa/m): Godio, Stefanou, Sab
    2017, Table 2. The layout is not from a source: openings, other bonds and returns inside the facade are left out.
    """
    choice("corner", corner, CORNERS)
    choice("first_through", first_through, ("facade", "return"))
    choice("sense", sense, tuple(SENSES))
    choice("return_walls", return_walls, (1, 2))
    for label, units in (("facade_units", facade_units), ("return_units", return_units)):
        if not finite(label, units) >= 1.0 or not float(2.0 * units).is_integer():
            raise InputError(f"{label} must be at least 1, in steps of half a block, got {units!r}")
    given = read_parameters(NAME)
    length, height, thickness = (float(given[f"block {side}"]) / 1e3 for side in ("length", "height", "thickness"))
    rows = count("courses", courses) / positive("block_scale", block_scale)  # courses of scaled blocks
    if not rows >= 1.0 or abs(rows - round(rows)) > 1e-9:  # a division may miss a whole number by rounding
        raise InputError(f"block_scale {block_scale!r} does not divide {courses} courses into whole ones")
    joint = Joint(
        float(given["friction angle"]), dilatancy_angle_deg=dilatancy_angle_deg, name="marble on marble",
        normal_stiffness=float(given["normal stiffness"]) * 1e9,
        shear_stiffness=float(given["tangential stiffness"]) * 1e9,
    )
    built = wall(
        length=facade_units * length, courses=round(rows), joint=joint, density=DENSITY,
        unit=(block_scale * length, block_scale * height, thickness),
        plan="L" if return_walls == 1 else "U", return_length=return_units * length,
        start="whole" if first_through == "facade" else "half",
        staggering=block_scale * thickness if corner == "whole units" else None,
    )
    assumed = {
        "facade_units": float(facade_units), "courses": int(courses), "return_walls": int(return_walls),
        "return_units": float(return_units), "corner": corner, "first_through": first_through, "sense": sense,
    }
    recipe = {**built.recipe, "source": NAME, "specimen": "layout assumed, not measured", "options": assumed}
    built = replace(built, recipe=recipe)
    return built, Loads.horizontal(built, SENSES[sense])


specimens = names_in(NAME, "specimens.csv")
"""Specimens used by Godio et al."""


def load(specimen: str, **options: Any) -> Experiment:
    """Measured and published multipliers of one specimen, whose plan is not published.

    Parameters
    ----------
    specimen : "S1" to "S13" without "S4", which the source does not use
    options : none are taken; any is refused by name

    Returns
    -------
    Experiment
        ``measured``: lambda = tan of the tilt angle at collapse [-] and that angle [deg]. ``published``: lambda by 3DEC
        with psi = 0, and with psi = phi. ``targets`` say which theory each is compared with.
    """
    chosen_options({}, options, NAME)  # refuses any
    table = read_table(NAME, "specimens.csv")
    row = table.row(specimen)
    return Experiment(
        source=read_source(NAME), specimen=specimen, recipe=RECIPE, row=row, no_model=NO_PLAN,
        title="Dry-stacked marble blocks at 1:5, a wall held by one or two orthogonal walls, tilted to collapse",
        parameters=dict(read_parameters(NAME)),
        measured=table.quantities(row, {"lambda": "lambda_measured", "tilt angle": "tilt_angle"}),
        published=table.quantities(
            row, {"3DEC zero dilatancy": "lambda_3dec_zero_dilatancy", "3DEC dilatant": "lambda_3dec_dilatant"}
        ),
        targets=(
            TargetValue("lambda", "measured"),
            TargetValue("3DEC zero dilatancy", "published", "non-associative"),
            TargetValue("3DEC dilatant", "published", "associative"),
        ),
    )


RECIPE = Recipe(specimens, load)
