"""Rondelet-type wallette of Godio, Stefanou and Sab 2017: 3 x 13 blocks beside a column, pushed out of plane."""

from typing import Any

from limitmason.build import layout
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment, TargetValue, chosen_options, with_source
from limitmason.experiments.recipe import Recipe
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.support import Support

NAME = "rondelet-wallette"

OPTIONS = source_folder.read_options(NAME)


specimens = source_folder.names_in(NAME, "variants.csv")
"""The four assumed bonds."""


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment with one of the assumed bonds.

    Parameters
    ----------
    specimen : for example "toothed-odd-ragged"
    options : of the assembly, see ``OPTIONS``
    """
    table = source_folder.read_table(NAME, "variants.csv")
    row = table.row(specimen)
    chosen = chosen_options(OPTIONS, options, NAME)
    given = source_folder.read_parameters(NAME)
    # of the table of parameters these are results, and the range of plausible associative values
    results = ("3DEC dilatant", "3DEC zero dilatancy")
    window = ("window low", "window high")
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS,
        row=row,
        title=f"Wallette of 3 x 13 blocks beside a column, {row['toothed_courses']} courses toothed, "
        f"free edge {row['free_edge']}",
        parameters={
            **{k: v for k, v in given.items() if k not in results + window},
            "toothed courses": row["toothed_courses"], "free edge": row["free_edge"],
        },
        published={k: given[k] for k in results},
        recomputed=table.quantities(row, {"associative": "associative_recomputed"}, "inscribed cone, fixed column"),
        assumptions=(
            f"The bond is assumed ({specimen}): the source shows it only in a figure, and four variants are packaged; "
            "which of them the source used is not known.",
            *source_folder.read_description(NAME)["assumptions"]["always"],
        ),
        targets=(
            TargetValue("3DEC dilatant", "published", "associative"),
            TargetValue("3DEC zero dilatancy", "published", "non-associative"),
            TargetValue(
                quantity="associative", kind="recomputed", flow_rule="associative", direction="+",
                options={"column": "fixed"},
            ),
        ),
    )


def assembly(test: Experiment) -> Assembly:
    """The wallette of a ``test`` from x = 0, its column to the left.

    The bottom course is held, and so is the column, which may turn where the options say so.
    """
    given, options = test.parameters, test.options
    length, height, thickness = (float(given[f"block {k}"]) / 1e3 for k in ("width", "height", "thickness"))
    lengths, courses = int(given["blocks per course"]), int(given["courses"])
    joint = Joint(
        float(given["friction angle"]), dilatancy_angle_deg=options["dilatancy_deg"], name="dry joint",
        normal_stiffness=float(given["normal stiffness"]) * 1e9,
        shear_stiffness=float(given["tangential stiffness"]) * 1e9,
    )
    rows = []  # lengths of the blocks of every course, in blocks, from the column on
    for k in range(courses):
        # every second course reaches into the column with half a block; another half makes its free end flush
        toothed = (k % 2 == 0) == (given["toothed courses"] == "odd")
        closer = [0.5] if toothed and given["free edge"] == "flush" else []
        rows.append([0.5 if toothed else 1.0] + [1.0] * lengths + closer)
    wall = layout(
        rows, unit=(length, height, thickness), joint=joint, density=options["density"], column="left",
        ragged=given["free edge"] == "ragged", base="course",
    )
    whole = options["column"] == "fixed"
    # its lowest block belongs to the bottom course, which is held already
    column = [b.name for b in wall.blocks if b.name.startswith("column-") and b.name != "column-1"]
    return with_source(wall.with_supports([Support(n, translations=True, rotations=whole) for n in column]), test)


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Weight of the wall dead, the same weight out of plane live.

    It is along y, or against it for a ``sense`` of -1.
    """
    return Loads.horizontal(wall, direction=(0.0, sense, 0.0))


RECIPE = Recipe(specimens, load, assembly, loads, shown=source_folder.read_shown(NAME))
