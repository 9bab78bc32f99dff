"""A tie: a straight element between two points that pulls and never pushes, up to its strength.

In limit analysis a tie is a row of ``model.arrays.with_ties``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.model.plausibility import warn_of_tie
from limitmason.storage.frozen import ReadOnly, frozen

STRENGTHS = {"yield_force": "yield", "bond_force": "bond", "anchor_force": "anchor plate"}
"""Fields that limit the force of a tie, and their names for a reader."""


@dataclass(frozen=True, eq=False)
class Tie(ReadOnly):
    """A tie between a point of block a and one of block b, or of the ground.

    0 <= T <= strength, tension only.

    T = k (L - L0 - plastic elongation), not below zero and not above the strength, which is the least of yield, bond
    and anchor plate. It yields without limit and without hardening; it has no weight and no bending stiffness.

    Parameters
    ----------
    block_a, block_b : names or numbers; ``block_b`` None is the ground, held with the first wholly held block
    point_a, point_b : ends in the reference position [m], shape (3,), each moving with its block. They may lie outside
        the block (a plate on its face, a rod through others), but not by more than half its longest side
    yield_force : at which the rod yields [N]; or ``area`` times ``yield_stress``
    bond_force : at which it is pulled out of its grout, bond stress times perimeter times length [N]
    anchor_force : at which its plate breaks out of the masonry or into it [N]
    area : of the section [m2]
    yield_stress, modulus : of the material [Pa]
    stiffness : axial [N/m]; or ``modulus`` times ``area`` over the length. Limit analysis does not need it
    name : for a reader

    Raises
    ------
    InputError
        For ends that coincide, no strength, numbers that are not positive, and what is given twice.

    Notes
    -----
    A tie hangs loose when its ends approach. What fails by bond or at an anchor plate is taken to hold its force while
    it slips, as a rod that yields: assumed, and unsafe where a plate breaks out suddenly. Give such a strength reduced.
    """

    block_a: int | str
    point_a: ArrayLike
    block_b: int | str | None
    point_b: ArrayLike
    yield_force: float | None = None
    bond_force: float | None = None
    anchor_force: float | None = None
    area: float | None = None
    yield_stress: float | None = None
    modulus: float | None = None
    stiffness: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        """Take points and numbers as floats, and check them and what goes together."""
        label = f"tie {self.name!r}" if self.name else self._between
        for field in ("point_a", "point_b"):
            try:
                point = np.array(getattr(self, field), dtype=float)
            except (TypeError, ValueError):
                point = np.empty(0)
            if point.shape != (3,) or not np.isfinite(point).all():
                raise InputError(f"{label}: {field} must be three finite coordinates [m], got {getattr(self, field)!r}")
            object.__setattr__(self, field, point)
        for field in (*STRENGTHS, "area", "yield_stress", "modulus", "stiffness"):
            value = getattr(self, field)
            if value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
                raise InputError(f"{label}: {field} must be a number, got {value!r}")
            if not (0.0 < value < np.inf):
                raise InputError(
                    f"{label}: {field} must be positive and finite, got {value!r}; leave out what does not govern"
                )
            object.__setattr__(self, field, float(value))
        if self.yield_stress is not None and self.yield_force is not None:
            raise InputError(f"{label}: give yield_force or yield_stress with area, not both")
        if self.modulus is not None and self.stiffness is not None:
            raise InputError(f"{label}: give stiffness or modulus with area, not both")
        for field in ("yield_stress", "modulus"):
            if getattr(self, field) is not None and self.area is None:
                raise InputError(f"{label}: {field} needs the area of the section")
        if self.area is not None and self.yield_stress is None and self.modulus is None:
            raise InputError(f"{label}: area is not used without yield_stress or modulus")
        if self.yield_stress is None and all(getattr(self, field) is None for field in STRENGTHS):
            raise InputError(
                f"{label}: it has no strength; give yield_force (or area and yield_stress), bond_force or anchor_force"
            )
        # far above the rounding of coordinates; ends at the very origin coincide too
        reach = max(float(np.abs(self.ends).max()), 1e-300)
        if not self.length > 1e-9 * reach:
            raise InputError(f"{label}: its two ends coincide, it has no length and no direction")
        warn_of_tie(self, label)

    @property
    def ends(self) -> Array:
        """Both points [m], shape (2, 3)."""
        return frozen(np.array([self.point_a, self.point_b], dtype=float))

    @property
    def length(self) -> float:
        """Distance of the ends [m]."""
        a, b = self.ends
        return float(np.linalg.norm(b - a))

    @property
    def direction(self) -> Array:
        """Unit vector from point a to point b, shape (3,)."""
        a, b = self.ends
        return frozen(np.asarray((b - a) / np.linalg.norm(b - a)))

    @property
    def strengths(self) -> dict[str, float]:
        """What limits the force, by name [N]."""
        found = {name: getattr(self, field) for field, name in STRENGTHS.items() if getattr(self, field) is not None}
        if self.yield_stress is not None and self.area is not None:
            found["yield"] = self.yield_stress * self.area
        return found

    @property
    def strength(self) -> float:
        """Largest force, the least of yield, bond and anchor plate [N]."""
        return min(self.strengths.values())

    @property
    def governed_by(self) -> str:
        """What gives way first: "yield", "bond" or "anchor plate"."""
        return min(self.strengths, key=self.strengths.__getitem__)

    @property
    def axial_stiffness(self) -> float:
        """Force per elongation [N/m], or NaN where neither stiffness nor modulus is given."""
        if self.stiffness is not None:
            return self.stiffness
        if self.modulus is not None and self.area is not None:
            return self.modulus * self.area / self.length
        return float("nan")

    def __str__(self) -> str:
        """One line for a reader."""
        name = f"{self.name}: " if self.name else ""
        return f"{name}{self._between}, {self.length:.3g} m, {self.strength / 1e3:.4g} kN ({self.governed_by})"

    @property
    def _between(self) -> str:
        """Its blocks in words, for messages."""
        return f"tie from {self.block_a!r} to {'the ground' if self.block_b is None else repr(self.block_b)}"
