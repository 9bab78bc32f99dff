"""Built walls: their recipe, and where it places them."""

from __future__ import annotations

from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import instance
from limitmason.errors import NotApplicable
from limitmason.model.assembly import Assembly


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
    corners = [b.bounds[0] for b in assembly.blocks if b.name.startswith("facade")]
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
