"""Settings of a search for the collapse multiplier by the DEM."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from dem.joints import JointOptions
from dem.stepping import Verdict
from limitmason.deformable import SOLID
from limitmason.deformable.levels import RIGID
from limitmason.errors import InputError
from limitmason.model.stages import Damping

Grid = tuple[int, int]

CHECKS = ("stiffness", "ks/kn", "contact points", "rate")


class Loading(StrEnum):
    """How the live load grows."""

    INCREMENTS = "increments"
    RAMP = "ramp"


@dataclass(frozen=True, kw_only=True)
class DemSettings:
    """Settings of :func:`dem.collapse`, by name there and in ``limitmason.predict(..., "dem")``.

    Parameters
    ----------
    contact_points : points along the unit and across the thickness of every interface, one pair, or one per kind
        ("bed", "head", "base") or per wall by how its blocks' names begin ({"facade": (2, 8), "return": (2, 2)}; a
        joint between two walls takes the finer); at psi < phi torsion needs about 8 across
    contact_model : "grid", or "vertices" for corners only
    loading : "increments" holds each load until force and moment are small in four checks in a row, restores the last
        equilibrium when the blocks keep moving and halves the increment; "ramp" raises the load steadily, reads the
        largest multiplier at the supports as max(Rh / Rv) does, repeats at half speed and extrapolates to none, until
        that changes by < 1 %
    tolerance : width of the final bracket over the multiplier [-], 0.005 by default; increments only
    error_budget : what to repeat the search with: "stiffness" (kn, ks x 10), "ks/kn" (ks x 0.4, which decides how
        wedged blocks share their thrust), "contact points" (x 2) and "rate" (increments half as long; a ramp at half
        speed). The repeats start near the multiplier found and close in on it to twice ``tolerance``; all four together
        take two to five times as long as the search. () for none
    joint_options : limits of dilation, softening lengths
    blocks, stress : "rigid", or "modal" blocks that strain and bend, in space ("solid"), "plane stress" or "plane
        strain"; see :func:`dem.make_state`
    first_increment : first step of the multiplier; a twentieth of that at which live equals dead load by default
    max_steps : budget for one load, up to three times that while it is still on its way to a verdict; when it runs out
        the load is "undecided", never counted as stable
    moved_limit : displacement that counts as collapse, over the smallest block dimension [-]; None begins with 0.02
        and, where a load in equilibrium moves a block by more than half of that, as soft joints do, goes on from
        there with 0.3. A number is kept, and a warning says where it is too small
    equilibrium : largest unbalanced force of every block over its own load, and moment over that load times its least
        thickness [-]; a twentieth of the load increment where that is less
    ramp_steps : steps in which a ramp reaches the estimate of the multiplier, 40,000 by default; ramps only
    damping : while loading; local 0.4 with stops at peaks of the kinetic energy, given up for local 0.6 in a load that
        has not settled after 8000 steps (increments), or 0.5 (ramp)
    progress : called with every load tried and its verdict

    Raises
    ------
    InputError
        For an unknown loading or check, a tolerance that is not positive, and a setting that the loading does not use.
    """

    contact_points: Grid | Mapping[str, Grid] = (4, 8)
    contact_model: str = "grid"
    loading: Loading = Loading.INCREMENTS
    tolerance: float | None = None
    error_budget: tuple[str, ...] = CHECKS
    joint_options: JointOptions | None = None
    blocks: str = RIGID
    stress: str = SOLID
    first_increment: float | None = None
    max_steps: int = 60_000
    moved_limit: float | None = None
    equilibrium: float = 1e-4
    ramp_steps: int | None = None
    damping: Damping | None = None
    progress: Callable[[float, Verdict], object] | None = None

    def __post_init__(self) -> None:
        """Say which setting is wrong, or would not be used."""
        steady, ramp = (str(x) for x in Loading)
        if self.loading not in tuple(Loading):
            raise InputError(f"loading must be {steady!r} or {ramp!r}, got {self.loading!r}")
        object.__setattr__(self, "loading", Loading(self.loading))
        if self.tolerance is not None and self.loading is Loading.RAMP:
            raise InputError(
                f"tolerance is for loading={steady!r}; ramps are slowed until lambda changes by under 1 %"
            )
        if self.tolerance is not None and not self.tolerance > 0:
            raise InputError(f"tolerance must be positive, got {self.tolerance!r}")
        if self.ramp_steps is not None and self.loading is not Loading.RAMP:
            raise InputError(f"ramp_steps is for loading={ramp!r}; {steady!r} holds loads one after the other")
        if isinstance(self.error_budget, str):
            raise InputError(f"error_budget must be several of {', '.join(CHECKS)}, such as ({self.error_budget!r},)")
        for check in self.error_budget:
            if check not in CHECKS:
                raise InputError(f"unknown check {check!r} in error_budget; known: {', '.join(CHECKS)}")

    def with_options(self, options: Mapping[str, Any]) -> DemSettings:
        """These settings with some replaced by name.

        Raises
        ------
        TypeError
            For an unknown name.
        """
        return replace(self, **options) if options else self
