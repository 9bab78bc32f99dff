"""What a unit is made of: elastic constants, and the strength of Mohr and Coulomb where it yields or cracks."""

import math
from dataclasses import dataclass, fields

from limitmason.errors import InputError
from limitmason.model.plausibility import warn_of_material


@dataclass(frozen=True, kw_only=True)
class Material:
    """Elastic material of a unit, with a Mohr-Coulomb strength and a tension cut-off where these are given.

    |tau| <= c - sigma tan(phi), sigma <= ft, tension positive. Without cohesion and friction angle it never yields.

    Parameters
    ----------
    young_modulus : E [Pa], > 0
    poisson_ratio : nu [-], -1 < nu < 0.5
    density : [kg/m3], > 0; None keeps the density that the block has
    cohesion, friction_angle_deg : c [Pa] and phi [deg], 0 <= phi < 90, both or neither
    dilatancy_angle_deg : psi [deg], 0 <= psi <= phi, of yielding in shear; yielding in tension is associated
    tensile_strength : ft [Pa]; None is the apex c / tan(phi), which also governs where it is lower
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
    cohesion: float | None = None
    friction_angle_deg: float | None = None
    dilatancy_angle_deg: float = 0.0
    tensile_strength: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        """Check every field and say which one is wrong."""
        label = f"material {self.name!r}" if self.name else "material"
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "name" or (value is None and field.default is None):
                continue
            if isinstance(value, (bool, str)) or not hasattr(value, "__float__"):
                raise InputError(f"{label}: {field.name} must be a number, got {value!r}")
            if not math.isfinite(float(value)):
                raise InputError(f"{label}: {field.name} = {value} must be finite")
            if float(value) < 0.0 and field.name != "poisson_ratio":
                raise InputError(f"{label}: {field.name} = {value} must not be negative")
        if not self.young_modulus > 0.0:
            raise InputError(f"{label}: young_modulus must be positive")
        if not -1.0 < self.poisson_ratio < 0.5:
            raise InputError(
                f"{label}: poisson_ratio = {self.poisson_ratio} must lie between -1 and 0.5, both excluded: at 0.5 a "
                "unit has no finite bulk modulus"
            )
        if self.density == 0.0:
            raise InputError(f"{label}: density must be positive; leave it out to keep the density of the block")
        if (self.cohesion is None) != (self.friction_angle_deg is None):
            raise InputError(f"{label}: give both cohesion and friction_angle_deg, or neither for an elastic unit")
        if self.cohesion is None or self.friction_angle_deg is None:
            for name in ("dilatancy_angle_deg", "tensile_strength"):
                if getattr(self, name):
                    raise InputError(f"{label}: {name} needs cohesion and friction_angle_deg beside it")
        elif self.friction_angle_deg >= 90.0:
            raise InputError(f"{label}: friction_angle_deg = {self.friction_angle_deg} must be below 90 degrees")
        elif self.dilatancy_angle_deg > self.friction_angle_deg:
            raise InputError(
                f"{label}: dilatancy_angle_deg = {self.dilatancy_angle_deg} exceeds friction_angle_deg = "
                f"{self.friction_angle_deg}"
            )
        warn_of_material(self, label)

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
        """tan(phi) [-]; 0 for an elastic unit."""
        return math.tan(math.radians(self.friction_angle_deg or 0.0))

    @property
    def tan_psi(self) -> float:
        """tan(psi) [-]."""
        return math.tan(math.radians(self.dilatancy_angle_deg))

