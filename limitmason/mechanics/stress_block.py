"""Stress blocks: the exact crushing law of in-plane sections, by the normal forces at their two ends."""

from typing import NamedTuple

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Index
from limitmason.mechanics.law import PointLaw, interface_law
from limitmason.model.assembly import Assembly


class StressBlock(NamedTuple):
    """Crushing in-plane sections by the forces N1, N2 at their two ends, j sections.

    N_i' >= (N1' + N2')^2 / (2 Q) with N_i' = N_i + t / 2, which is |M| <= N' L / 2 - N'^2 / (2 fc b): the exact block
    of compressed masonry at its strength, whose capacity Q = q counts from the tension corner.
    """

    ends: Index  # numbers of both end points, (j, 2)
    capacity: Array  # Q = fc A + t A, [N], (j,)
    tension: Array  # t A [N], (j,)

    @property
    def count(self) -> int:  # type: ignore[override]  # no tuple of numbers to count in
        """Number of sections."""
        return len(self.ends)

    def excess(self, normal: Array) -> Array:
        """How far sections lie outside their law, at most 0 inside [N], shape (j,).

        Parameters
        ----------
        normal : forces at both ends, compression positive [N], shape (j, 2)
        """
        n1, n2 = (normal[:, k] + 0.5 * self.tension for k in (0, 1))  # counted from the tension corner
        return (n1 + n2) ** 2 / (2.0 * self.capacity) - np.minimum(n1, n2)

    def power(self, lift: Array) -> Array:
        """Power that sections dissipate, the largest -(g1 N1 + g2 N2) of all forces within their law [W], shape (j,).

        Parameters
        ----------
        lift : free opening g of both ends, negative where they close [m/s], shape (j, 2)
        """
        # N' = N1' + N2' that dissipates most: 0 where both ends open, the whole capacity where both close. The end that
        # opens more then bears the least that it may, N'^2 / (2 Q)
        low, high = lift.min(axis=1), lift.max(axis=1)
        spread = np.maximum(high - low, 1e-300)
        n = self.capacity * (np.clip(-low, 0.0, spread) / spread)
        return -low * n - (high - low) * n**2 / (2.0 * self.capacity) + 0.5 * self.tension * lift.sum(axis=1)

    def in_units_of(self, force: Array | float) -> "StressBlock":
        """Capacities over a force [N], one or one per section, shape (j,)."""
        return self._replace(capacity=self.capacity / force, tension=self.tension / force)


def stress_blocks(law: PointLaw, ends: Index) -> StressBlock:
    """Stress blocks of in-plane sections from the law of each section.

    Parameters
    ----------
    law : of every section over its whole area [N], shape (j,)
    ends : numbers of the contact points at both ends, shape (j, 2)
    """
    return StressBlock(ends, law.corner_crushing, law.tension)


def stress_blocks_of(assembly: Assembly, prediction: Prediction) -> StressBlock | None:
    """Stress blocks of the in-plane sections of a prediction, or None where its crushing is summed over points."""
    if not prediction.stress_block or prediction.resultants is None:
        return None
    law = interface_law(assembly.links)
    k = prediction.resultants.point_interface
    rows = np.flatnonzero(law.crushes[: len(assembly.interfaces)])  # a tie, after them, is no section
    # points come joint by joint: those of a section are its two ends
    first = np.searchsorted(k, rows)
    found = (first < len(k)) & (k[np.minimum(first, len(k) - 1)] == rows)
    rows, first = rows[found], first[found]
    return stress_blocks(law.at(rows).over(assembly.links.area[rows]), np.column_stack([first, first + 1]))
