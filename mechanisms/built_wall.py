"""Built walls: their recipe, where it places them, and what closed forms read of their blocks."""

from __future__ import annotations

from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import instance
from limitmason.errors import NotApplicable
from limitmason.model.assembly import Assembly

_FACADE = ("facade", "column")
"""How the names of a facade's units begin; a lateral column of a layout is part of it."""

_UNITS = (*_FACADE, "return")
"""How the names of a built wall's units begin."""

BEAMS = ("beam", "spreader")
"""How the names of what loads a built wall from above begin."""

_SAME_DENSITY = 1e-6
"""Relative difference of densities that are the same: rounding."""


def wall_recipe(assembly: Assembly) -> dict[str, Any]:
    """Recipe of an assembly that is a built wall, or an error that says what to do."""
    recipe = dict(instance("assembly", assembly, Assembly).recipe)
    if recipe.get("kind") != "wall":
        raise NotApplicable(
            f"recipe of kind 'wall' is needed, this assembly has {recipe.get('kind')!r}: build it with "
            "limitmason.build.wall or layout, or give the numbers as mechanisms.Facade"
        )
    return recipe


def origin_of(assembly: Assembly) -> Array:
    """Where the origin of a built wall's recipe lies [m], shape (3,): not at 0 where the wall has been moved."""
    corners = [b.bounds[0] for b in assembly.blocks if b.name.startswith(_FACADE)]
    low = np.min(corners, axis=0) if corners else np.zeros(3)
    return low if np.abs(low).max() > 10.0 * assembly.tolerance else np.zeros(3)


def at_origin(assembly: Assembly) -> Assembly:
    """A built wall where its recipe has it: outer face at y = 0, left end at x = 0, foot at z = 0."""
    moved = origin_of(assembly)
    return assembly.transformed(np.eye(3), -moved) if moved.any() else assembly


def foot_level(assembly: Assembly) -> float:
    """Level at which the free part of a built wall stands [m]: its foot, or the top of a held bottom course."""
    recipe = wall_recipe(assembly)
    return float(origin_of(assembly)[2]) + (recipe["unit_height"] if recipe.get("base") == "course" else 0.0)


def check_free(assembly: Assembly) -> None:
    """Refuse a built wall with units or beams that are held above its foot, in any direction.

    The closed forms are of walls that stand on their foot and are free above. A lateral column may be held: they do not
    see it, and give the free wall.
    """
    level = foot_level(assembly) + 10.0 * assembly.tolerance
    for k, block in enumerate(assembly.blocks):
        above = block.name.startswith(("facade", "return", *BEAMS)) and block.bounds[1, 2] > level
        if above and assembly.held[k].any():
            raise NotApplicable(f"block {block.name!r} is held above the foot: the closed forms take walls free there")


def unit_density(assembly: Assembly) -> float:
    """Density of the free units of a built wall [kg/m3]: of the blocks, as materials change it and no recipe.

    Raises
    ------
    NotApplicable
        When densities differ: a closed form knows one value.
    """
    units = [b for k, b in enumerate(assembly.blocks) if not assembly.fixed[k] and b.name.startswith(_UNITS)]
    values = np.unique([b.density for b in units])
    if not len(values) or np.ptp(values) > _SAME_DENSITY * values[-1]:
        span = f" ({values[0]:.4g} to {values[-1]:.4g} kg/m3)" if len(values) else ""
        raise NotApplicable(f"there is no one density of the free units{span}; read the Facade with unit_weight=...")
    return float(values[0])
