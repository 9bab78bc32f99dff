"""Ferris and Tin-Loi 2001: six dry-joint walls under a horizontal body force, in plane."""

from typing import Any, NamedTuple

from limitmason.build import layout
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options, with_source
from limitmason.experiments.recipe import Recipe
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

NAME = "ferris-tin-loi-2001"
BLOCK = (0.4, 0.175)  # length and height [m]; 4 x 1.75 units in the authors' model data
ROUNDING = 0.020  # ends pulled in by LMGC90, UDEC and the rounded HybriDFEM column [m]

OPTIONS = source_folder.read_options(NAME)
"""Options of an assembly by name, with default, unit and meaning, as "options" of ``source.json`` states them."""


class Published(NamedTuple):
    """A multiplier that others published: its column of the sheet, flow rule, and whether ends are pulled in.

    ``starred`` is a column that says 1 where the sheet has a star whose meaning it does not state.
    """

    column: str
    flow_rule: str
    rounded: bool = False
    starred: str | None = None


_PUBLISHED = {
    "associative": Published("associative", "associative"),
    "non-associative": Published("nonassociative_minimum", "non-associative"),
    "rounded LMGC90": Published("rounded_LMGC90", "non-associative", rounded=True),
    "rounded UDEC": Published("rounded_UDEC", "non-associative", rounded=True),
    "HybriDFEM associative": Published("hybridfem_associative", "associative"),
    "HybriDFEM non-associative": Published(
        "hybridfem_nonassociative", "non-associative", starred="hybridfem_nonassociative_starred"
    ),
    "HybriDFEM rounded": Published(
        "hybridfem_rounded", "non-associative", rounded=True, starred="hybridfem_rounded_starred"
    ),
}
_COPY = "HybriDFEM"  # rigid blocks on the same contacts: no references of their own
_NOTES = {
    ("wall-6", "associative"): "truncated in the sheet; recomputed 0.34782",
    ("wall-5", "associative"): "rounded in the sheet; recomputed 0.23964",
}


specimens = source_folder.names_in(NAME, "walls.csv")
"""Names of the walls."""


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment of a wall.

    Parameters
    ----------
    specimen : "wall-1" to "wall-6"
    options : of the assembly, see ``OPTIONS``
    """
    table = source_folder.read_table(NAME, "walls.csv")
    row, said = table.row(specimen), source_folder.read_description(NAME)
    chosen = chosen_options(OPTIONS, options, NAME)
    published, targets = {}, []
    for name, given in _PUBLISHED.items():
        if name == "non-associative":  # the smallest that a solver found, which others may undercut
            note = "from local solvers: a reference, not a floor"
        elif given.starred and row[given.starred] == "1":
            note = "starred in the sheet, meaning not stated"
        else:
            note = _NOTES.get((specimen, name), "")
        value = table.quantity(row, given.column, note)
        if value is None:
            continue
        published[name] = value
        where = {"rounding": ROUNDING} if given.rounded else {}
        targets.append(TargetValue(
            quantity=name, kind="published", flow_rule=given.flow_rule, direction="+", options=where,
            copy=name.startswith(_COPY),
        ))
    recomputed = table.quantities(
        row, {"associative": "associative_recomputed", "zero-dilatancy fixed point": "fixed_point_recomputed"}
    )
    # one optimum, that every solver must meet; the fixed point hangs on its start and is shown only
    targets.append(TargetValue("associative", "recomputed", "associative"))
    parameters: dict[str, Quantity | str] = {
        "block length": Quantity(BLOCK[0], "m"), "block height": Quantity(BLOCK[1], "m"),
        "friction coefficient": Quantity(chosen["friction"]),
        "live load": "the weight of every block sideways, at its centroid",
        **table.quantities(row, said["quantities"]["parameters"]),
    }
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS,
        row=row,
        title=f"Dry wall, {row['width']} block lengths x {row['n_courses']} courses, pushed sideways in its plane",
        parameters=parameters, published=published, recomputed=recomputed,
        assumptions=tuple(said["assumptions"]["always"]), targets=tuple(targets),
    )


def rows_of(specimen: str) -> list[str]:
    """Courses of a specimen from the bottom, each as lengths of units in a text.

    A length is in block lengths, negative for an opening.
    """
    courses = [r for r in source_folder.read_table(NAME, "layouts.csv").rows if r["specimen"] == specimen]
    return [r["pattern"] for r in sorted(courses, key=lambda r: int(r["course"]))]


def assembly(test: Experiment) -> Assembly:
    """The wall of a ``test`` in the x-z plane, on its ground slab; ``OPTIONS`` has units."""
    options = test.options
    joint = Joint.from_friction_coefficient(
        options["friction"], dilatancy_angle_deg=options["dilatancy_deg"], name="dry joint"
    )
    wall = layout(
        rows_of(test.specimen), unit=BLOCK, thickness=options["thickness"], joint=joint, density=options["density"],
        base="slab",
    )
    if options["rounding"]:
        # edges that face y, across the wall, stay and keep the full thickness; the ends along the courses come in
        wall = wall.with_contact_ends_pulled_in(options["rounding"], direction=(0, 1, 0))
    return with_source(wall, test)


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Weight of the wall dead, the same weight sideways live.

    It is along x, or against it for a ``sense`` of -1.
    """
    return Loads.horizontal(wall, direction=(sense, 0.0, 0.0))


RECIPE = Recipe(specimens, load, assembly, loads, shown=source_folder.read_shown(NAME))
