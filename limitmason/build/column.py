"""A column: one block on top of another, on a held base."""

from __future__ import annotations

from collections.abc import Mapping

from limitmason.build.arguments import courses_from
from limitmason.build.erect import Site, add_ground
from limitmason.checks import count, positive
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint


def column(
    *,
    width: float,
    depth: float,
    unit_height: float | None = None,
    joint: Joint,
    height: float | None = None,
    courses: int | None = None,
    density: float = 2000.0,
    base: str | None = "slab",
    base_margin: float | None = None,
    joints: Mapping | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Return a stack of equal blocks on a base.

    Parameters
    ----------
    width, depth
        Of every block along x and y [m].
    unit_height, height, courses
        Block height [m], and one of: height of the stack [m], a whole number of blocks; or their number. Height and
        number together, without `unit_height`, fix the block height.
    joint, joints, density, tolerance
        As in `wall`.
    base
        "slab": a held block "base". "course": no slab, the lowest block is held. None: nothing is held.
    base_margin
        Projection of the slab on every side, default half the width [m]; it is one block thick.

    Returns
    -------
    Assembly
        Blocks "base", "column-1" (lowest), "column-2", ... on x from 0 to `width`, y from 0 to `depth`.

    Raises
    ------
    InputError
        Naming the argument that is wrong.
    """
    wide, deep = positive("width", width), positive("depth", depth)
    positive("density", density)
    if unit_height is None:
        if height is None or courses is None:
            raise InputError("unit_height is needed unless height and courses are both given")
        number = count("courses", courses)
        tall = positive("height", height) / number
    else:
        tall = positive("unit_height", unit_height)
        number = courses_from(height, courses, tall)
    site = Site(density)
    add_ground(site, (0.0, wide, 0.0, deep), (wide, tall), base, base_margin)
    for k in range(number):
        box = ((0.0, 0.0, k * tall), (wide, deep, (k + 1) * tall))
        site.add_box(f"column-{k + 1}", box, axis=0, fixed=base == "course" and k == 0)
    recipe = {
        "kind": "column", "width": wide, "depth": deep, "length": wide, "thickness": deep, "height": number * tall,
        "courses": number, "unit": [wide, tall, deep], "unit_height": tall, "density": float(density), "base": base,
    }
    return site.assembly(joint, recipe, joints=joints, tolerance=tolerance)
