"""Single-leaf brick panels with an opening (Bradford) and the UDEC parametric study on them.

The drawing of the panels is lost: their assemblies are inferred, see :mod:`.layout`, and marked so.
"""

from math import isclose
from typing import Any

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.errors import InputError
from limitmason.experiments import source_folder
from limitmason.experiments.brick_panels_opening.layout import BASIS, OUTLINES, panel, read_outline
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options, with_source
from limitmason.experiments.recipe import Recipe
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint, LostBy
from limitmason.model.load import Loads
from limitmason.model.material import Material
from limitmason.model.stages import Drive

NAME = "brick-panels-opening"
NO_PLAN = (
    "overall width and height of the panel, height of the opening, bearings and spreader are only in figure 2 of the "
    "source and were not found in its text"
)

_BRICK = ("density", "Young's modulus", "Poisson's ratio")
_JOINT = ("normal stiffness", "shear stiffness", "friction angle", "cohesion", "tensile strength", "dilation angle")
_TABLE_4 = "input of the UDEC model calibrated on S1 to S4, Table 4; not measured"

_SPAN, _LONG_SPAN = 2.025, 2.925
"""Clear opening of the panels and runs, and of the panel L1 [m]."""

_PRINTED_MODULUS = 1.67e9  # of the bricks, Table 4 [Pa]

LOSSES = tuple(str(v) for v in (LostBy.OPENING, LostBy.OPENING_OR_SLIP, LostBy.NOTHING))

OPTIONS = source_folder.read_options(NAME)


specimens = source_folder.names_in(NAME, "panels.csv", "udec_runs.csv")
"""The five panels and the 18 UDEC runs."""


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment of a panel or a run, whose assembly is inferred.

    Parameters
    ----------
    specimen : a panel "S1" to "S4" or "L1", or a run "udec-01" to "udec-18"
    options : of the assembly, see ``OPTIONS``
    """
    chosen = chosen_options(OPTIONS, options, NAME)
    read_outline(chosen["outline"])  # refuses a wrong one before anything is built
    run = specimen.startswith("udec-")
    table = source_folder.read_table(NAME, "udec_runs.csv" if run else "panels.csv")
    row = table.row(specimen)
    given = dict(source_folder.read_parameters(NAME))
    mean = given.pop("stochastic test mean failure load")
    # Table 4 belongs to the calibrated model: the runs of the parametric study state no property of the bricks
    given = {
        name: Quantity(value, value.unit, _TABLE_4) if name in (*_BRICK, *_JOINT) else value
        for name, value in given.items()
        if not (run and name in _BRICK)
    }
    loads = {"first crack": "V_first_crack", "failure load": "V_failure"}
    if run:
        title = "UDEC run of the parametric study on the 2.025 m opening"
        own = {
            "friction angle": "friction", "cohesion": "cohesion", "tensile strength": "tension",
            "dilation angle": "dilation", "normal stiffness": "kn", "shear stiffness": "ks",
        }
        measured = {}
        published = table.quantities(row, {
            **loads, "self-weight displacement": "d_selfweight", "displacement at first crack": "d_first_crack",
            "displacement at failure": "d_failure",
        })
        if row["suspect"] == "1":
            load_cell = published["failure load"]
            published["failure load"] = Quantity(load_cell, load_cell.unit, "out of line with its neighbours")
        targets = (TargetValue("failure load", "published", "non-associative"),)
    else:
        title = "Single-leaf brick panel with an opening, point load at the top of mid-span"
        own = {"clear opening": "clear_opening", "mortar strength": "mortar_strength"}
        measured = table.quantities(row, loads)
        published = {}
        if specimen.startswith("S"):
            published["mean failure load of the stochastic paper"] = Quantity(mean, mean.unit, "mean of the tests")
        targets = (TargetValue("failure load", "measured"),)
    parameters: dict[str, Quantity | str] = {**given, **table.quantities(row, own)}
    if row.get("note"):
        parameters["note"] = row["note"]
    said = source_folder.read_description(NAME)["assumptions"]
    modulus = "printed" if isclose(chosen["young_modulus"], _PRINTED_MODULUS) else "assumed"
    open_outline = ("787.5/8/4", "562.5/8/4") if specimen == "L1" else OUTLINES
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS,
        row=row, title=title, parameters=parameters, measured=measured, published=published, targets=targets,
        assumptions=(*said["always"], said["modulus"][modulus].format(modulus=1e-9 * chosen["young_modulus"])),
        multiplier_to_measured=Quantity(1.0, "kN"), no_model=NO_PLAN, inferred=BASIS,
        open_options={"outline": open_outline, "young_modulus": (16.7e9, 1.67e9), "loss": LOSSES},
    )


def assembly(test: Experiment) -> Assembly:
    """The panel of a ``test`` on the outline chosen.

    Its joints are those of the run or of Table 4.
    """
    options = test.options
    brick = Material(
        young_modulus=options["young_modulus"], poisson_ratio=options["poisson_ratio"], density=options["density"],
        name="brick",
    )
    built = panel(
        read_outline(options["outline"]), _LONG_SPAN if test.specimen == "L1" else _SPAN, joint(test), brick,
        start=options["start"], bearing=options["bearing"],
    )
    return with_source(built, test)


def joint(test: Experiment) -> Joint:
    """Mortar joint of a ``test``, by its options, else by the values of its source."""
    options, given = test.options, test.parameters

    def value(option: str, name: str, unit: float) -> float:
        """An option in SI units, or the parameter called ``name``.

        ``unit`` is the unit of the parameter in SI.
        """
        return float(options[option]) if options[option] is not None else unit * float(given[name])

    return Joint(
        value("friction_deg", "friction angle", 1.0), dilatancy_angle_deg=value("dilation_deg", "dilation angle", 1.0),
        cohesion=value("cohesion", "cohesion", 1e6),
        tensile_strength=value("tensile_strength", "tensile strength", 1e6),
        normal_stiffness=value("kn", "normal stiffness", 1e9), shear_stiffness=value("ks", "shear stiffness", 1e9),
        residual_cohesion=0.0, residual_tensile_strength=0.0, lost_by=LostBy(options["loss"]),
        fracture_energy_tension=options["fracture_energy"], name="mortar",
    )


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Own weight of the wall dead, 1 kN downwards on the spreader live.

    The multiplier is the load in kN. ``sense`` -1 turns the live load upwards. ``test`` is not needed: all specimens
    are loaded alike.
    """
    del test
    return Loads.weight(wall).with_point_load(wall, "spreader", (0.0, 0.0, -1e3 * sense))


def drive(test: Experiment) -> Drive:
    """The spreader pushed down, free to turn and to move sideways."""
    del test
    return Drive({"spreader": {"z": -1.0}})


def curve(test: Experiment) -> Curve:
    """Published points of a ``test`` by UDEC, from own weight on.

    They are first crack and failure. The displacement is in [mm], the load in [kN].

    Raises
    ------
    InputError
        For the panels, of which the text gives loads without displacements.
    """
    known = test.published
    if "displacement at failure" not in known:
        raise InputError(
            f"no curve of {test.name}: the text of the source gives its loads at first crack and failure ("
            f"{test.measured['first crack']:g} and {test.measured['failure load']:g} kN) without displacements"
        )
    rest = float(known["self-weight displacement"])
    points = [
        (float(known[f"displacement at {name}"]) - rest, float(known[load]))
        for name, load in (("first crack", "first crack"), ("failure", "failure load"))
    ]
    u, f = np.array([(0.0, 0.0), *points]).T
    return Curve(
        u, f, displacement_unit="mm", load_unit="kN", label=f"{test.specimen}, published", source=str(test.source),
        references=source_folder.papers_of(NAME),
    )


RECIPE = Recipe(specimens, load, assembly, loads, curve, drive=drive)
