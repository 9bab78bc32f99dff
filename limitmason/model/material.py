"""What units and solids are made of: elasticity, with a Mohr-Coulomb strength or with fracture energies."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, fields

from limitmason.checks import law_angles, positive, single_number
from limitmason.errors import InputError
from limitmason.model.plausibility import warn_of_material

FRACTURE = ("tensile_energy", "compressive_strength", "compressive_energy")
"""Fields of a solid that cracks and crushes; blocks have none of them."""


@dataclass(frozen=True)
class Material:
    r"""Isotropic material.

    Elastic, yielding by Mohr and Coulomb, or losing strength over fracture energies.

    A unit yields where :math:`|\tau| = c - \sigma \tan\varphi` or :math:`\sigma = f_t`, tension positive; without
    cohesion and friction angle it never does. A solid cracks at :math:`f_t` and crushes at :math:`f_c`, over the
    energies :math:`G_f` and :math:`G_{fc}`. Blocks take the first, :class:`limitmason.continuum.Continuum` the second.

    Parameters
    ----------
    young_modulus : E [Pa], > 0
    poisson_ratio : nu [-], -1 < nu < 0.5
    density : [kg/m3], >= 0; None keeps the density that the block has
    cohesion, friction_angle_deg : c [Pa] and phi [deg], 0 <= phi < 90, both or neither
    dilatancy_angle_deg : psi [deg], 0 <= psi <= phi, of yielding in shear; yielding in tension is associated
    tensile_strength : ft [Pa]; None is the apex c / tan(phi), which also governs where it is lower
    tensile_energy : Gf [N/m], the area under stress against opening of a crack, elastic part included
    compressive_strength : fc [Pa]
    compressive_energy : Gfc [N/m], the area beyond the peak under stress against shortening of a crushing band
    name : label shown in tables

    Raises
    ------
    ValueError
        When a value is outside its range, or one of a pair is missing; the message names the field.

    Warns
    -----
    PlausibilityWarning
        For a modulus or a strength that looks like MPa or GPa, and an angle that looks like radians.
    """

    young_modulus: float
    poisson_ratio: float
    density: float | None = None
    _: KW_ONLY
    cohesion: float | None = None
    friction_angle_deg: float | None = None
    dilatancy_angle_deg: float = 0.0
    tensile_strength: float | None = None
    tensile_energy: float | None = None
    compressive_strength: float | None = None
    compressive_energy: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        """Check every field and say which one is wrong."""
        label = f"material {self.name!r}" if self.name else "material"
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "name" or (value is None and field.default is None):
                continue
            single_number(f"{label}: {field.name}", value, signed=field.name == "poisson_ratio")
        if not self.young_modulus > 0.0:
            raise InputError(f"{label}: young_modulus must be positive")
        if not -1.0 < self.poisson_ratio < 0.5:
            raise InputError(
                f"{label}: poisson_ratio = {self.poisson_ratio} must lie between -1 and 0.5, both excluded: at 0.5 a "
                "unit has no finite bulk modulus"
            )
        self._check_strength(label)
        warn_of_material(self, label)

    def _check_strength(self, label: str) -> None:
        """Refuse one of a pair without the other, and two laws at once.

        ``label`` names the material in messages.
        """
        if (self.cohesion is None) != (self.friction_angle_deg is None):
            raise InputError(f"{label}: give both cohesion and friction_angle_deg, or neither for an elastic unit")
        if (self.compressive_strength is None) != (self.compressive_energy is None):
            raise InputError(f"{label}: give both compressive_strength and compressive_energy, or neither")
        if self.tensile_energy is not None and self.tensile_strength is None:
            raise InputError(f"{label}: tensile_energy needs tensile_strength beside it")
        for name in (*FRACTURE, *(("tensile_strength",) if self.fractures else ())):
            if getattr(self, name) == 0.0:
                raise InputError(f"{label}: {name} must be positive; leave it out where there is none")
        if self.cohesion is None or self.friction_angle_deg is None:
            if self.dilatancy_angle_deg:
                raise InputError(f"{label}: dilatancy_angle_deg needs cohesion and friction_angle_deg beside it")
            # zero too: such a unit would never yield, in tension neither
            if self.tensile_strength is not None and self.tensile_energy is None:
                raise InputError(
                    f"{label}: tensile_strength needs cohesion and friction_angle_deg beside it, or tensile_energy"
                )
        elif self.fractures:
            raise InputError(f"{label}: fracture energies do not go with cohesion and friction_angle_deg")
        else:
            law_angles(label, self.friction_angle_deg, self.dilatancy_angle_deg)

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
        """Masonry as a solid from Young's modulus.

        fc = E / alpha, ft = fc / 10, Gfc = d fc, Gf = 12 N/m.

        Parameters
        ----------
        young_modulus : E [Pa]
        poisson_ratio : nu [-]; it does not follow from E
        density : [kg/m3]; it does not follow from E
        modulus_over_strength : alpha = E / fc [-]
        ductility : d = Gfc / fc [m]
        tensile_energy : Gf [N/m]
        name : label shown in tables

        Notes
        -----
        Murano et al., equations 9 to 12, after Lourenço's recommendations. They are a first guess where nothing was
        measured: a dry wall has no tensile strength, whatever its modulus.
        """
        fc = positive("young_modulus", young_modulus) / positive("modulus_over_strength", modulus_over_strength)
        positive("ductility", ductility)
        return cls(
            young_modulus, poisson_ratio, density, tensile_strength=fc / 10.0, tensile_energy=tensile_energy,
            compressive_strength=fc, compressive_energy=ductility * fc, name=name,
        )

    @property
    def fractures(self) -> bool:
        """Whether it loses strength over a fracture energy."""
        return any(getattr(self, name) is not None for name in FRACTURE)

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def bulk_modulus(self) -> float:
        """K = E / (3 (1 - 2 nu)) [Pa]."""
        return self.young_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    @property
    def yields(self) -> bool:
        """Whether it has a strength."""
        return self.cohesion is not None

    @property
    def tan_phi(self) -> float:
        """tan(phi) [-], or 0 for an elastic unit."""
        return math.tan(math.radians(self.friction_angle_deg or 0.0))

    @property
    def tan_psi(self) -> float:
        """tan(psi) [-]."""
        return math.tan(math.radians(self.dilatancy_angle_deg))
