"""Tilting tests on dry marble blocks, S1-S13, University of Pavia: measured and 3DEC values, no plans."""

from typing import Any

from limitmason.experiments.record import Experiment, Quantity, Target, chosen_options
from limitmason.experiments.tables import read_parameters, read_source, read_table

NAME = "pavia-tilting"
NO_PLAN = (
    "the plans of the specimens (lengths, courses, openings, corner bond, sense of the load) are not published in the "
    "sources at hand; they are in Restrepo-Velez, Magenes and Griffith 2014 and in figure 7 of Godio et al. 2017"
)


def specimens() -> tuple[str, ...]:
    """Specimens used by Godio et al."""
    return tuple(r["specimen"] for r in read_table(NAME, "specimens.csv").rows)


def load(specimen: str, **options: Any) -> Experiment:
    """Values of one specimen, "S1" to "S13" without "S4"; there is no assembly."""
    chosen_options({}, options, NAME)
    table = read_table(NAME, "specimens.csv")
    row = table.row(specimen)
    return Experiment(
        source=read_source(NAME),
        specimen=specimen,
        title="Dry-stacked marble blocks at 1:5, a wall held by one or two orthogonal walls, tilted to collapse",
        parameters=dict(read_parameters(NAME)),
        measured=table.quantities(row, {"lambda": "lambda_measured", "tilt angle": "tilt_angle"}),
        published=table.quantities(
            row, {"3DEC zero dilatancy": "lambda_3dec_zero_dilatancy", "3DEC dilatant": "lambda_3dec_dilatant"}
        ),
        recomputed={},
        assumptions=(),
        targets=(
            Target("lambda", "measured"),
            Target("3DEC zero dilatancy", "published", "non-associative"),
            Target("3DEC dilatant", "published", "associative"),
        ),
        multiplier_to_measured=Quantity(1.0, "-"),
        recipe=__name__,
        row=row,
        no_model=NO_PLAN,
    )
