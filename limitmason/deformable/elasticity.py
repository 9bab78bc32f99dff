"""Isotropic elasticity in space, in plane stress and in plane strain, in any axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import choice
from limitmason.errors import InputError
from limitmason.storage.frozen import ReadOnly

SOLID, PLANE_STRESS, PLANE_STRAIN = "solid", "plane stress", "plane strain"
STATES = (SOLID, PLANE_STRESS, PLANE_STRAIN)
"""States of stress in which a run may take its blocks."""


@dataclass(frozen=True)
class Elasticity(ReadOnly):
    """Isotropic elasticity, tension positive, in space or in a plane.

    sigma = lambda tr(eps) P + 2 mu eps for strains that lie in the space that P projects onto.

    In space P is the unit tensor and lambda is Lame's. In a plane P = 1 - n n^T, and lambda is that of plane stress,
    2 lambda mu / (lambda + 2 mu) = E nu / (1 - nu^2), or of plane strain, Lame's.

    Parameters
    ----------
    lame : lambda of the state of stress [Pa]
    shear : mu [Pa]
    projector : P, shape (3, 3)
    normal : unit normal of the plane, shape (3,); None in space
    state : "solid", "plane stress" or "plane strain"
    """

    lame: float
    shear: float
    projector: Array
    normal: Array | None
    state: str

    @classmethod
    def of(cls, young_modulus: float, poisson_ratio: float, state: str, normal: ArrayLike | None = None) -> Elasticity:
        """Elasticity of a material with E = ``young_modulus`` [Pa] and nu = ``poisson_ratio`` [-].

        Parameters
        ----------
        state : "solid", "plane stress" or "plane strain"
        normal : of the plane, (0, 1, 0) where none is given, shape (3,); in space none

        Raises
        ------
        InputError
            For an unknown state, E not positive, and nu outside -1 < nu < 0.5.
        """
        choice("the state of stress", state, STATES)
        e, nu = young_modulus, poisson_ratio
        if not e > 0.0 or not np.isfinite(e):
            raise InputError(f"young_modulus must be positive and finite [Pa], got {e!r}")
        if not -1.0 < nu < 0.5:
            raise InputError(f"poisson_ratio must lie between -1 and 0.5, both excluded, got {nu!r}")
        lame = e * nu / (1.0 - nu**2) if state == PLANE_STRESS else e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        n = None if state == SOLID else plane_normal(normal)
        projector = np.eye(3) if n is None else np.eye(3) - np.outer(n, n)
        return cls(lame, e / (2.0 * (1.0 + nu)), projector, n, state)

    @property
    def plane(self) -> bool:
        """Whether strains lie in a plane."""
        return self.state != SOLID

    @property
    def contraction(self) -> float:
        """Lateral contraction over the strain along a bar free sideways in this state [-].

        nu, or nu / (1 - nu) in plane strain.
        """
        return self.lame / (self.lame + 2.0 * self.shear) if self.plane else 0.5 * self.lame / (self.lame + self.shear)

    @property
    def bar_modulus(self) -> float:
        """Stress over strain along a bar that is free sideways in this state [Pa].

        E, or E / (1 - nu^2) in plane strain.
        """
        return 2.0 * self.shear * (1.0 + self.contraction)

    @property
    def matrix(self) -> Array:
        r"""Stresses [Pa] of direct strains and of shear angles.

        A shear angle is :math:`\gamma = 2 \varepsilon_{ij}`.

        In space three and three, the shears in any one order, shape (6, 6). In a plane stresses along its two axes,
        their shear and the stress across the plane, from two strains and an angle, shape (4, 3).
        """
        d = np.zeros((4, 3) if self.plane else (6, 6))
        # stresses along the axes come first, then shears
        direct = 2 if self.plane else 3
        d[:direct, :direct] = self.lame
        d[range(direct), range(direct)] += 2.0 * self.shear
        shears = range(direct, d.shape[1])
        d[shears, shears] = self.shear
        # held across the plane; in plane stress that stress is zero
        if self.state == PLANE_STRAIN:
            d[3, :2] = self.lame
        return d

    def stress(self, strain: Array) -> Array:
        """Stress [Pa] of strains in the space of P, tension positive, shapes (..., 3, 3)."""
        trace = np.trace(strain, axis1=-2, axis2=-1)
        return np.asarray(self.lame * trace[..., None, None] * self.projector + 2.0 * self.shear * strain)


def plane_normal(normal: ArrayLike | None) -> Array:
    """Unit normal of a plane, (0, 1, 0) where none is given, shape (3,).

    Raises
    ------
    InputError
        For a vector that is not three finite numbers, not all zero.
    """
    n = np.asarray((0.0, 1.0, 0.0) if normal is None else normal, dtype=float)
    if n.shape != (3,) or not np.isfinite(n).all() or not np.linalg.norm(n) > 0.0:
        raise InputError(f"the normal of the plane must be three numbers, not all zero, got {normal!r}")
    return np.asarray(n / np.linalg.norm(n))
