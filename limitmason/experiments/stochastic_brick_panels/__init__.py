"""Brick panels whose bricks and joints vary: distributions, sets of runs, and the means and spreads published.

>>> from limitmason.experiments import stochastic_brick_panels as panels
>>> panels.drawn(4)["friction angle"]
RandomProperty(mean=30.0, unit='deg', variation=0.058)
"""

from decimal import Decimal
from typing import Any, NamedTuple

from limitmason.checks import choice
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options
from limitmason.experiments.recipe import Recipe
from limitmason.experiments.source_folder import read_source, read_table

NAME = "stochastic-brick-panels"
NO_MODEL = "the drawing of the panel, which is that of brick-panels-opening, is not in the sources at hand"
RUNS = 300
"""Runs behind every mean and spread."""

_SYMBOLS = {
    "E": "young modulus", "nu": "poisson ratio", "kn": "normal stiffness", "ks": "shear stiffness",
    "phi": "friction angle", "c": "cohesion", "ft": "tensile strength",
}

STIFFNESS_RATIO = 2.32
"""kn / ks, equation 2 [-]."""

LINKS = {
    "shear_stiffness": f"normal_stiffness / {STIFFNESS_RATIO}",
    "cohesion": "2 * tensile_strength * tan(radians(friction_angle_deg))",
}
"""Equations 2 and 3 as ``links`` of ``lm.study.monte_carlo``; without the second cohesion is drawn by itself."""


class RandomProperty(NamedTuple):
    """Normal distribution of one property: mean in its unit, coefficient of variation [-]."""

    mean: float
    unit: str
    variation: float


def properties() -> dict[str, RandomProperty]:
    """Distributions of Table 2 by the name of the property.

    The density is among them and does not vary.
    """
    rows = read_table(NAME, "properties.csv").rows
    # decimal: 5.8 / 100 in binary is not the double 0.058, and one bit of a draw is a run of its own
    return {r["property"]: RandomProperty(float(r["mean"]), r["unit"], float(Decimal(r["cov"]) / 100)) for r in rows}


def drawn(number: int) -> dict[str, RandomProperty]:
    """What is random in a set of runs, by the name of the property, Table 3.

    Parameters
    ----------
    number : of the set, 1 to 4

    Raises
    ------
    InputError
        For another set.
    """
    rows = {r["number"]: r for r in read_table(NAME, "sets.csv").rows}
    choice("set", str(number), rows)
    known = properties()
    return {_SYMBOLS[s]: known[_SYMBOLS[s]] for s in rows[str(number)]["drawn"].split()}


def specimens() -> tuple[str, ...]:
    """Names of all eight, "set-1-spatial", "set-1-non-spatial" to "set-4-non-spatial"."""
    return tuple(f"set-{k}-{kind}" for k in range(1, 5) for kind in ("spatial", "non-spatial"))


def load(specimen: str, **options: Any) -> Experiment:
    """Mean and variation of the ultimate load of one set, Table 4.

    There is no assembly.

    Parameters
    ----------
    specimen : for example "set-1-spatial", see :func:`specimens`
    options : none are taken
    """
    choice("specimen", specimen, specimens())
    chosen_options({}, options, NAME)  # refuses any
    number, kind = specimen.removeprefix("set-").split("-", 1)
    table = read_table(NAME, "sets.csv")
    row = table.row(number, "number")
    column = kind.replace("-", "")  # as columns of the table are called
    note = f"of {RUNS} runs"
    published = {
        "mean ultimate load": Quantity(float(row[f"mean_{column}"]), "kN", note),
        "variation of the ultimate load": Quantity(float(row[f"cov_{column}"]), "%", note),
    }
    given: dict[str, Any] = {}
    for name, value in drawn(int(number)).items():
        given[name] = Quantity(value.mean, value.unit, f"normal, CoV {100.0 * value.variation:g} %")
    each = "a draw for every brick and joint" if kind == "spatial" else "one draw for all bricks and joints"
    return Experiment(
        source=read_source(NAME), specimen=specimen, title=f"Brick panel with an opening, set {number}: {each}",
        parameters=given, measured={}, published=published, recomputed={}, assumptions=(),
        targets=(TargetValue("mean ultimate load", "published", "non-associative"),),
        multiplier_to_measured=Quantity(1.0, "kN"), recipe=RECIPE, row=row, no_model=NO_MODEL,
    )


RECIPE = Recipe(specimens, load)
