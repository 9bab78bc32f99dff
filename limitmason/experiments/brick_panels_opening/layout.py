"""The panel whose drawing is lost: outlines that its printed answers allow, and the wall built on one of them."""

from typing import NamedTuple

from limitmason.build import Opening, wall
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.material import Material

UNIT = (0.225, 0.075, 0.1025)
"""Brick with its share of the mortar, length, height, thickness [m]."""

_SOLDIERS = 3
"""Courses that a soldier, a brick set upright, is high."""

BASIS = (
    "the outline follows from the block count, the settlement by own weight, and the stiffness and first-failure loads "
    "in print. It is not published, and other outlines fit nearly as well: show '675/8/5' and '1350/4/3' beside "
    "'787.5/8/4'"
)

OUTLINES = ("787.5/8/4", "675/8/5", "1350/4/3")
"""Pier width [mm], courses below and above the soldiers: the best guess first."""


class Outline(NamedTuple):
    """Width of a pier [m], courses of the opening below its head of soldiers, and courses above that."""

    pier: float
    below: int
    above: int


def read_outline(text: str) -> Outline:
    """Outline written as "787.5/8/4": pier [mm], courses below the soldiers and above.

    Raises
    ------
    InputError
        For another ``text``, and a pier that is not a whole number of half bricks.
    """
    parts = str(text).split("/")
    try:
        pier, below, above = 1e-3 * float(parts[0]), int(parts[1]), int(parts[2])
    except (IndexError, ValueError):
        raise InputError(f"outline must be 'pier mm/courses below/courses above', got {text!r}") from None
    half = 0.5 * UNIT[0]
    if len(parts) != 3 or min(below, above) < 1 or pier < half or abs(pier / half - round(pier / half)) > 1e-6:
        raise InputError(
            f"outline {text!r}: the pier must be a whole number of half bricks (112.5 mm), and a course lie below and "
            "above"
        )
    return Outline(pier, below, above)


def panel(
    outline: Outline, span: float, joint: Joint, brick: Material, *, start: str, bearing: float = 0.0
) -> Assembly:
    """Panel with soldiers over its opening and a brick as spreader plate at mid-span.

    Parameters
    ----------
    outline : width of the piers and courses
    span : of the opening [m]
    joint : law of every joint
    brick : material of every brick
    start : "whole" or "half", the brick at the ends of the bottom course
    bearing : of the soldier course on each pier [m], whole soldiers over both
    """
    opening = Opening(
        x=outline.pier, z=0.0, width=span, height=outline.below * UNIT[1], head="soldier",
        bearing=float(bearing) if bearing else None,
    )
    found = wall(
        length=2.0 * outline.pier + span, courses=outline.below + _SOLDIERS + outline.above, unit=UNIT, joint=joint,
        start=start, density=brick.density or 2000.0, spreader=(UNIT[0], UNIT[1]),
        openings=[opening],
    )
    return found.with_material(brick)
