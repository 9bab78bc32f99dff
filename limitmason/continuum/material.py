"""What masonry is taken to be as a continuum: elasticity, strengths and fracture energies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitmason.deformable import SOLID, Elasticity
from limitmason.errors import InputError
from limitmason.model.input import read_number

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Material:
    """Homogeneous, isotropic masonry; without strengths it stays elastic.

    Parameters
    ----------
    young_modulus : E [Pa]
    poisson_ratio : nu [-], 0 to below 0.5
    density : mass density [kg/m3]
    tensile_strength : ft [Pa]; infinite by default
    tensile_energy : mode-I fracture energy Gf [N/m], the area under stress against opening of a crack, elastic part
        included; infinite by default
    compressive_strength : fc [Pa]; infinite by default
    compressive_energy : Gfc [N/m], the area beyond the peak under stress against shortening of a crushing band
    name : label

    Raises
    ------
    InputError
        For numbers out of range, and for a strength without its energy or an energy without its strength.
    """

    young_modulus: float
    poisson_ratio: float = 0.2
    density: float = 2000.0
    tensile_strength: float = math.inf
    tensile_energy: float = math.inf
    compressive_strength: float = math.inf
    compressive_energy: float = math.inf
    name: str = "masonry"

    def __post_init__(self) -> None:
        """Check the ranges."""
        read_number(f"young_modulus of {self.name!r}", self.young_modulus)
        for label in (
            "young_modulus", "tensile_strength", "tensile_energy", "compressive_strength", "compressive_energy"
        ):  # fmt: skip
            value = getattr(self, label)
            if not value > 0.0:
                raise InputError(f"{label} of {self.name!r} must be positive (infinite for none), got {value!r}")
        if not 0.0 <= self.poisson_ratio < 0.5:
            raise InputError(f"poisson_ratio of {self.name!r} must be 0 to below 0.5, got {self.poisson_ratio!r}")
        if not (0.0 <= self.density < math.inf):
            raise InputError(f"density of {self.name!r} must be finite and not negative, got {self.density!r}")
        for side in ("tensile", "compressive"):
            strength, energy = (getattr(self, f"{side}_{part}") for part in ("strength", "energy"))
            if math.isfinite(strength) != math.isfinite(energy):
                raise InputError(f"{self.name!r}: give {side}_strength and {side}_energy together, or neither")

    @classmethod
    def from_modulus(
        cls,
        young_modulus: float,
        *,
        poisson_ratio: float = 0.2,
        density: float = 2000.0,
        modulus_over_strength: float = 1000.0,
        ductility: float = 1.6e-3,
        tensile_energy: float = 12.0,
        name: str = "masonry",
    ) -> Material:
        """Strengths and energies from Young's modulus alone: fc = E / alpha, ft = fc / 10, Gfc = d fc, Gf = 12 N/m.

        Parameters
        ----------
        young_modulus : E [Pa]
        poisson_ratio, density : [-], [kg/m3]; they do not follow from E
        modulus_over_strength : alpha = E / fc [-]
        ductility : d = Gfc / fc [m]
        tensile_energy : Gf [N/m]

        Notes
        -----
        Murano et al., equations 9 to 12, after Lourenço's recommendations. They are a first guess where nothing was
        measured: a dry wall has no tensile strength, whatever its modulus.
        """
        fc = young_modulus / modulus_over_strength
        return cls(young_modulus, poisson_ratio, density, fc / 10.0, tensile_energy, fc, ductility * fc, name)

    @property
    def elastic(self) -> bool:
        """Whether it neither cracks nor crushes."""
        return math.isinf(self.tensile_strength) and math.isinf(self.compressive_strength)

    @property
    def stiffness(self) -> Array:
        """Elastic stiffness [Pa], shape (6, 6), for strains (xx, yy, zz, xy, yz, zx) with engineering shear."""
        return Elasticity.of(self.young_modulus, self.poisson_ratio, SOLID).matrix
