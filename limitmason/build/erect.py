"""The last step of every builder: name the units, put the ground under them and the beam on them, make the Assembly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from string import ascii_lowercase
from typing import Any

from limitmason.build.plan import Box, Unit
from limitmason.checks import choice, not_negative
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid, box
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint

BASES = ("slab", "course", None)
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_SAME_PLACE = 1e-9  # [m], chosen: starts of units that differ by less are one, no masonry is that fine


@dataclass
class Site:
    """Blocks collected in their final order.

    Parameters
    ----------
    density : of blocks that have none of their own [kg/m3]
    names : of the blocks
    solids : of each, or its convex pieces
    axes : direction of the unit's length as laid, None for none
    densities : of each [kg/m3]
    fixed : names of those held in all six degrees of freedom
    """

    density: float
    names: list[str] = field(default_factory=list)
    solids: list[Solid | list[Solid]] = field(default_factory=list)
    axes: list[tuple[float, float, float] | None] = field(default_factory=list)
    densities: list[float] = field(default_factory=list)
    fixed: list[str] = field(default_factory=list)

    def add(
        self, name: str, solid: Solid | list[Solid], *, axis: tuple[float, float, float] | None = None,
        density: float | None = None, fixed: bool = False,
    ) -> None:
        """Put one block on the site.

        Parameters
        ----------
        name : its own
        solid : of the block, or its convex pieces
        axis : unit vector along the unit's length, or None
        density : the site's own where None [kg/m3]
        fixed : whether it is held
        """
        if density is not None:
            not_negative(f"density of block {name!r}", density)
        self.names.append(name)
        self.solids.append(solid)
        self.axes.append(axis)
        self.densities.append(self.density if density is None else density)
        if fixed:
            self.fixed.append(name)

    def add_box(
        self, name: str, corners: Box, *, axis: int | None = None, density: float | None = None, fixed: bool = False
    ) -> None:
        """Put one box on the site.

        Parameters
        ----------
        name : of the block
        corners : lower and upper corner [m]
        axis : along which the unit's length runs, 0, 1 or 2 for x, y or z, or None
        density : the site's own where None [kg/m3]
        fixed : whether it is held
        """
        direction = None if axis is None else _AXES[axis]
        self.add(name, box(*corners), axis=direction, density=density, fixed=fixed)

    def assembly(
        self, joint: Joint, recipe: dict, *, joints: Mapping | None = None, tolerance: float | None = None
    ) -> Assembly:
        """Return the assembly of everything on the site.

        Parameters
        ----------
        joint : law of every joint that ``joints`` does not name
        recipe : what is told of the structure
        joints : laws by kind or by pair of block names
        tolerance : gap up to which faces touch [m]; None for the default
        """
        return Assembly.from_polyhedra(
            self.solids, density=self.densities, joint=joint, fixed=self.fixed, names=self.names, axes=self.axes,
            joints=joints, recipe=recipe, tolerance=tolerance,
        )


def add_ground(
    site: Site, footprint: tuple[float, float, float, float], unit: tuple[float, ...], base: object,
    base_margin: Any,
) -> None:
    """Where the base is a slab, add it as the held block "base".

    It is one course thick, and its top is at z = 0.

    Parameters
    ----------
    site : to which it is added
    footprint : x0, x1, y0, y1 of what stands on it [m]
    unit : (length, height, ...) of a unit [m]
    base : "slab", or another of ``BASES``, for which nothing is added
    base_margin : how far it stands out [m], half a unit where None
    """
    choice("base", base, BASES)
    if base_margin is not None and base != "slab":
        raise InputError(f"base_margin is of the slab, and base is {base!r}: leave it out")
    margin = unit[0] / 2.0 if base_margin is None else not_negative("base_margin", base_margin)
    if base == "slab":
        x0, x1, y0, y1 = footprint
        site.add_box("base", ((x0 - margin, y0 - margin, -unit[1]), (x1 + margin, y1 + margin, 0.0)), fixed=True)


def add_units(
    site: Site, courses: Sequence[Sequence[Unit]], *, fix_bottom: bool = False, columns: Sequence[Unit] = ()
) -> None:
    """Add units course by course and name them "run-course-position".

    A letter tells the leaf, "a" the outer one.

    Parameters
    ----------
    site : to which they are added
    courses : units of every course, bottom course first, those of a run in their order along it
    fix_bottom : whether the first course is held
    columns : units of a lateral column, the same objects: they are named "column-course" instead
    """
    of_column = {id(unit) for unit in columns}
    most = max((len(units) for units in courses), default=1)
    digits = max(2, len(str(len(courses))), len(str(most)))
    for units in courses:
        run, position, start = "", 0, 0.0
        letters: set[str] = set()
        for unit in units:
            parts = [box(*corners) for corners in unit.boxes]
            solid = parts[0] if len(parts) == 1 else parts
            held = fix_bottom and unit.course == 0
            if id(unit) in of_column:
                site.add(f"column-{unit.course + 1}", solid, axis=_AXES[unit.axis], fixed=held)
                continue
            # positions are counted along the run: facade and rear wall in x, returns in y
            here = unit.extent(0 if unit.run in ("facade", "rear") else 1)[0]
            letter = "" if unit.leaf < 0 else ascii_lowercase[unit.leaf]  # below 0: a unit through all leaves
            if unit.run != run:
                run, position, letters, start = unit.run, 1, set(), here
            elif abs(here - start) > _SAME_PLACE or letter in letters:
                # units side by side in different leaves share a position; one above the other (cut ones) do not
                position, letters, start = position + 1, set(), here
            letters.add(letter)
            name = f"{run}-{unit.course + 1:0{digits}d}-{position:0{digits}d}{letter}"
            site.add(name, solid, axis=_AXES[unit.axis], fixed=held)
