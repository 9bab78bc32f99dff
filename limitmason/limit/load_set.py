"""Loads that are safe at once: a convex set between corners and half-planes."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from limitmason.answers.results import Resultants
from limitmason.arrays import Array
from limitmason.checks import numbers
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.geometry.convex_set import nearest_in_hull
from limitmason.storage.files import write_text

INSIDE = 1e-9
"""Distance from the inner set, over the sizes of multipliers, up to which they count as carried [-]: rounding."""

NO_SIZE = 1e-12
"""Added to the size of every multiplier, over the largest [-]: one that is zero at all corners then divides too."""


class HalfPlane(NamedTuple):
    """Loads that a mechanism lets pass: unit normal . multipliers <= offset."""

    normal: Array  # (k,)
    offset: float  # [-]
    twists: Array | None  # of the mechanism, (n_blocks, 6); None for a limit of what was asked


@dataclass(frozen=True, eq=False)
class LoadRegion(Displayed):
    """Set of multipliers that a structure carries at once, from inside and outside.

    Parameters
    ----------
    names : of the load cases
    status : "closed" within the tolerance, "not closed", or "empty": no multipliers within the limits are carried
    corners : multipliers with forces that carry them; all between them are carried too [-], shape (m, k)
    forces : joint forces at every corner
    outside : half-planes that no carried load leaves, each with its mechanism
    gap : largest distance of an outer corner from the inner set, over the diameter of the inner set, in multipliers
        over their extents [-]; of an empty set NaN
    cone : directions in which the set has no end, unit rays whose cone it is, shape (r, k); none where it is bounded
    within : sizes of the multipliers beyond which nothing was asked, shape (k,); infinite where none was needed
    proof : of an empty set: the motion in which the dead load does more work than the joints dissipate, whatever the
        multipliers
    certain : for psi < phi, the set of joints with friction psi: what it holds is carried by every flow rule between
        psi and phi, and what this set does not hold by none (Radenkovic); None where psi = phi
    """

    names: tuple[str, ...]
    status: str
    corners: Array
    forces: tuple[Resultants, ...]
    outside: tuple[HalfPlane, ...]
    gap: float
    within: Array
    cone: Array = field(default_factory=lambda: np.zeros((0, 0)))
    proof: Array | None = None
    certain: LoadRegion | None = None

    def contains(self, multipliers: Sequence[float]) -> bool | None:
        """Whether the structure carries these multipliers, None where neither is proven.

        It is True where forces carry them and False where a mechanism moves. Between the two sets it is None.
        Beyond ``within`` it is None too, where the cone does not reach. ``multipliers`` has one for every case [-].
        """
        y = numbers("multipliers", multipliers)
        if y.shape != (len(self.names),) or not np.isfinite(y).all():
            raise InputError(f"multipliers: give one for each of {' and '.join(self.names)}, got {multipliers!r}")
        if any(p.twists is not None and p.normal @ y > p.offset for p in self.outside):
            return False
        if not len(self.corners):
            return None
        # over the sizes of the multipliers, so that no case is drowned by another
        size = np.abs(self.corners).max(axis=0) + np.abs(self.corners).max() * NO_SIZE
        cone = self.cone / size if len(self.cone) else None
        nearest = nearest_in_hull(self.corners / size, y / size, cone)
        return True if np.linalg.norm(y / size - nearest) <= INSIDE else None

    def to_json(self, path: str | Path) -> None:
        """Write corners, half-planes, cone and gap to a file."""
        planes = [{"normal": p.normal.tolist(), "offset": p.offset, "limit": p.twists is None} for p in self.outside]
        kept = {
            "cases": self.names, "status": self.status, "corners": self.corners.tolist(), "outside": planes,
            "gap": None if math.isnan(self.gap) else self.gap, "cone": self.cone.tolist(),
        }
        write_text(path, json.dumps(kept, indent=1) + "\n")

    def __str__(self) -> str:
        """Status, counts and gap."""
        text = f"safe loads {' and '.join(self.names)}: {self.status}"
        if self.status == "empty":
            return text
        rays = "one ray" if len(self.cone) == 1 else f"{len(self.cone)} rays"
        unbounded = f", unbounded along {rays}" if len(self.cone) else ""
        text = f"{text}, {len(self.corners)} corners, {len(self.outside)} half-planes, gap {self.gap:.1e}{unbounded}"
        if self.certain is None:
            return text
        count = len(self.certain.corners)
        return f"{text}; by every flow rule from psi to phi: {f'{count} corners' if count else self.certain.status}"
