"""Dry-joint stone shear walls of the University of Minho: 21 tests, constant vertical load, horizontal force in plane.

SW: Lourenco et al. 2005, sandstone, monotonic. WS: Vasconcelos 2005 and Vasconcelos and Lourenco 2009, granite,
monotonic and cyclic. Measured values from the StoneMasonryDatabase (Vanin et al. 2017).
"""

from typing import Any

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.build import wall as running_wall
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options, with_source
from limitmason.experiments.recipe import Recipe
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.support import Support

NAME = "minho-dry-stone-2005-2009"
UNIT_WEIGHT = 20e3  # of the masonry in the database's Ntot [N/m3]
WS_FRICTION = 0.65  # not found for these walls: assumed, to be shown over 0.5 to 0.75
BEAM = "beam"
FORCE = 1e3  # live load [N]: the multiplier is the horizontal force in kN

OPTIONS = source_folder.read_options(NAME)


specimens = source_folder.names_in(NAME, "tests.csv")
"""Test unit names of the database."""


def measured_curve(specimen: str) -> Curve:
    """Measured force-displacement curve of a monotonic test, thinned.

    The displacement is that of the top [mm], the load the horizontal force [kN]. ``specimen`` is its test unit name.

    Raises
    ------
    InputError
        For tests whose curve was not found; the message names those that have one.
    """
    rows = source_folder.read_table(NAME, "curves.csv").rows
    own = [r for r in rows if r["specimen"] == specimen]
    if not own:
        known = ", ".join(dict.fromkeys(r["specimen"] for r in rows))
        raise InputError(f"no curve of {specimen!r} was found; there are those of {known}")
    units = source_folder.read_table(NAME, "curves.csv").units
    return Curve(
        np.array([float(r["displacement"]) for r in own]), np.array([float(r["force"]) for r in own]),
        displacement_unit=units["displacement"], load_unit=units["force"], label=specimen,
        source=str(source_folder.read_source(NAME)), references=source_folder.papers_of(NAME),
    )


def curve(test: Experiment) -> Curve:
    """The measured curve of an experiment, see :func:`measured_curve`."""
    return measured_curve(test.specimen)


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment of one of the 21 tests.

    Parameters
    ----------
    specimen : its test unit name, for example "SW.30.1" or "WS1.100"
    options : of the assembly, see ``OPTIONS``
    """
    table, series_table = source_folder.read_table(NAME, "tests.csv"), source_folder.read_table(NAME, "series.csv")
    row, said = table.row(specimen), source_folder.read_description(NAME)
    series = series_table.row(row["series"], "series")
    chosen = chosen_options(OPTIONS, options, NAME)
    assumptions, names = list(said["assumptions"]["always"]), said["quantities"]
    left_open: dict[str, tuple[Any, ...]] = {}  # options that sources leave open, with the values to show
    known, height = bool(series["friction"]), float(row["H0"]) / 1e3  # of the horizontal force above the ground [m]
    # what is assumed stays so in a copy with other options, which is given the number itself
    friction = float(series["friction"]) if known else WS_FRICTION
    if chosen["friction"] in (None, friction):
        chosen["friction"] = friction
        assumptions.append(
            "Friction 0.62 is assumed: it is the value of another author's model of these walls."
            if known
            else f"Friction {WS_FRICTION} is assumed: not found for these walls; show {series['friction_low']} to "
            f"{series['friction_high']}."
        )
    if not series["odd_courses_start_with_half"]:
        assumptions.append("The bond of the WS walls was not found: running bond as in the SW walls is assumed.")
    if series["force_height_others"]:
        other = float(series["force_height_others"]) / 1e3
        left_open["force_height"] = (other, height)
        if chosen["force_height"] in (None, height):
            assumptions.append(
                f"The force height {height:g} m of the database is assumed; nine courses and a beam one course high "
                f"put it at {other:g} m (option force_height)."
            )
    if not known:
        left_open["friction"] = (float(series["friction_low"]), float(series["friction_high"]))
    if not series["odd_courses_start_with_half"]:
        left_open["first_course"] = ("half", "whole")
    chosen["force_height"] = height if chosen["force_height"] is None else chosen["force_height"]
    if not chosen["force_height"] > float(row["H"]) / 1e3:
        raise InputError(f"force_height must be above the wall's top at {float(row['H']) / 1e3:g} m")
    if chosen["crushing"]:
        assumptions.append("The prism strength of the masonry is assumed for every joint, uniform and plastic.")
    measured = table.quantities(row, names["measured"])
    targets = [TargetValue(f"Vmax{s}", "measured", direction=s) for s in "+-" if f"Vmax{s}" in measured]
    failure = [w for w, c in (("flexural", "F"), ("rocking", "R"), ("sliding", "SL"), ("toe crushing", "TC"))
               if row[f"failure_{c}"] == "1"]
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS,
        row=row, open_options=left_open, assumptions=tuple(assumptions), measured=measured, targets=tuple(targets),
        multiplier_to_measured=Quantity(FORCE / 1e3, "kN"),
        title=f"{row['stone']} wall with dry joints, {row['loading'].lower()}, {row['N_top']} kN on top; "
        f"{row['reference']}",
        parameters={
            **table.quantities(row, names["parameters"]),
            **series_table.quantities(series, {"courses": "courses", "blocks per course": "blocks_per_course"}),
            "friction coefficient": Quantity(chosen["friction"]),
            "failure type": f"{row['failure_type']} ({', '.join(failure)})",
        },
        recomputed=table.quantities(row, {"overturning of one rigid block": "V_overturning"}, "N total (L/2) / H0"),
    )


def assembly(test: Experiment) -> Assembly:
    """The wall of a ``test`` on its ground slab under the loading beam."""
    options, given = test.options, test.parameters
    crushing = {"compressive_strength": float(given["masonry strength fc"]) * 1e6} if options["crushing"] else {}
    joint = Joint.from_friction_coefficient(
        options["friction"], dilatancy_angle_deg=options["dilatancy_deg"], name="dry joint", **crushing
    )
    length, height, thickness = (float(given[k]) / 1e3 for k in ("length", "height", "thickness"))
    courses, lengths = int(given["courses"]), int(given["blocks per course"])
    wall = running_wall(
        length=length, courses=courses, unit=(length / lengths, height / courses, thickness),
        start=options["first_course"], joint=joint, density=UNIT_WEIGHT / GRAVITY,
        # the force acts at the beam's centroid
        top_beam=2.0 * (options["force_height"] - height), beam_density=0.0,
    )
    if options["beam_rotation"] == "held":
        wall = wall.with_supports([Support(BEAM, dofs=("ry",))])
    return with_source(wall, test)


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Weight and top load dead, and 1 kN sideways live at the beam's centroid.

    The live load on the ``wall`` of an experiment is along x for a ``sense`` of 1, against it for -1.
    """
    return (
        Loads.weight(wall)
        .with_precompression(wall, float(test.parameters["N on top"]) * 1e3, block=BEAM)
        .with_point_load(wall, BEAM, (sense * FORCE, 0.0, 0.0))
    )


RECIPE = Recipe(specimens, load, assembly, loads, curve, source_folder.read_shown(NAME))
