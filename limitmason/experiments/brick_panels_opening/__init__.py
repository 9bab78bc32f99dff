"""Single-leaf brick panels with an opening (Bradford) and the UDEC parametric study on them: values, no plans."""

from typing import Any

from limitmason.experiments.recipe import Recipe
from limitmason.experiments.record import Experiment, Quantity, Target, chosen_options
from limitmason.experiments.tables import read_parameters, read_source, read_table

NAME = "brick-panels-opening"
NO_PLAN = (
    "overall width and height of the panel, height of the opening, bearings and spreader are only in figure 2 of the "
    "source and were not found in its text"
)

_BRICK = ("density", "Young's modulus", "Poisson's ratio")
_JOINT = ("normal stiffness", "shear stiffness", "friction angle", "cohesion", "tensile strength", "dilation angle")
_TABLE_4 = "input of the UDEC model calibrated on S1 to S4, Table 4; not measured"


def specimens() -> tuple[str, ...]:
    """The five panels and the 18 UDEC runs."""
    return tuple(r["specimen"] for name in ("panels.csv", "udec_runs.csv") for r in read_table(NAME, name).rows)


def load(specimen: str, **options: Any) -> Experiment:
    """A panel "S1" to "S4" or "L1", or a run "udec-01" to "udec-18"; there is no assembly."""
    chosen_options({}, options, NAME)
    run = specimen.startswith("udec-")
    table = read_table(NAME, "udec_runs.csv" if run else "panels.csv")
    row = table.row(specimen)
    given = dict(read_parameters(NAME))
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
        }  # fmt: skip
        measured = {}
        published = table.quantities(
            row,
            {
                **loads,
                "self-weight displacement": "d_selfweight",
                "displacement at first crack": "d_first_crack",
                "displacement at failure": "d_failure",
            },
        )
        if row["suspect"] == "1":
            load_cell = published["failure load"]
            published["failure load"] = Quantity(load_cell, load_cell.unit, "out of line with its neighbours")
        targets = (Target("failure load", "published", "non-associative"),)
    else:
        title = "Single-leaf brick panel with an opening, point load at the top of mid-span"
        own = {"clear opening": "clear_opening", "mortar strength": "mortar_strength"}
        measured = table.quantities(row, loads)
        published = {}
        if specimen.startswith("S"):
            published["mean failure load of the stochastic paper"] = Quantity(mean, mean.unit, "mean of the tests")
        targets = (Target("failure load", "measured"),)
    parameters = {**given, **table.quantities(row, own)}
    if row.get("note"):
        parameters["note"] = row["note"]
    return Experiment(
        source=read_source(NAME),
        specimen=specimen,
        title=title,
        parameters=parameters,
        measured=measured,
        published=published,
        recomputed={},
        assumptions=(),
        targets=targets,
        multiplier_to_measured=Quantity(1.0, "kN"),
        recipe=RECIPE,
        row=row,
        no_model=NO_PLAN,
    )


RECIPE = Recipe(specimens, load)
