"""The joint law: Coulomb friction with dilatancy, cohesion, tension cut-off, crushing and elastic stiffness."""

import math
from dataclasses import dataclass, fields
from typing import Any

from limitmason.errors import InputError
from limitmason.model.plausibility import given_as_coefficient, warn_of_joint


@dataclass(frozen=True)
class Joint:
    """Law of a joint between two blocks.

    |T| <= c A + N tan(phi), -ft A <= N <= fc A; a sliding joint opens by tan(psi) per unit of slip.

    Parameters
    ----------
    friction_angle_deg : phi [deg], 0 <= phi < 90
    dilatancy_angle_deg : psi [deg], 0 <= psi <= phi; used by non-associative limit analysis and the DEM
    cohesion : c [Pa]
    tensile_strength : ft [Pa]; where ft > c / tan(phi) the DEM takes it as it is and every other method cuts it at the
        apex of the Coulomb cone, and the answer warns
    compressive_strength : fc [Pa], infinite by default
    normal_stiffness, shear_stiffness : kn, ks [Pa/m]; needed by the DEM only
    residual_friction_angle_deg, residual_cohesion, residual_tensile_strength : values after failure [deg], [Pa];
        None keeps the peak value (perfect plasticity)
    name : label shown in tables

    Raises
    ------
    InputError
        When a value is outside its range; the message names the field.

    Warns
    -----
    PlausibilityWarning
        For a friction angle that looks like radians, a strength like MPa, a stiffness like N/mm3.
    """

    friction_angle_deg: float
    dilatancy_angle_deg: float = 0.0
    cohesion: float = 0.0
    tensile_strength: float = 0.0
    compressive_strength: float = math.inf
    normal_stiffness: float | None = None
    shear_stiffness: float | None = None
    residual_friction_angle_deg: float | None = None
    residual_cohesion: float | None = None
    residual_tensile_strength: float | None = None
    name: str = ""

    def __repr__(self) -> str:
        """What is not the default."""
        given = [f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if getattr(self, f.name) != f.default]
        return f"Joint({', '.join(given)})"

    def __post_init__(self) -> None:
        """Check every field and say which one is wrong."""
        label = f"joint {self.name!r}" if self.name else "joint"
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "name" or value is None:
                continue
            if isinstance(value, bool) or (not isinstance(value, (int, float)) and not hasattr(value, "__float__")):
                raise InputError(f"{label}: {field.name} must be a number, got {value!r}")
            if math.isnan(float(value)):
                raise InputError(f"{label}: {field.name} is NaN")
            if float(value) < 0.0:
                raise InputError(f"{label}: {field.name} = {value} must not be negative")
            if math.isinf(float(value)) and field.name != "compressive_strength":
                raise InputError(f"{label}: {field.name} must be finite")
        if self.friction_angle_deg >= 90.0:
            raise InputError(f"{label}: friction_angle_deg = {self.friction_angle_deg} must be below 90 degrees")
        if self.dilatancy_angle_deg > self.friction_angle_deg:
            raise InputError(
                f"{label}: dilatancy_angle_deg = {self.dilatancy_angle_deg} exceeds friction_angle_deg = "
                f"{self.friction_angle_deg}; a joint cannot dilate more than its friction angle"
            )
        if self.compressive_strength == 0.0:
            raise InputError(f"{label}: compressive_strength must be positive (infinite when crushing is left out)")
        if self.residual_friction_angle_deg is not None and self.residual_friction_angle_deg >= 90.0:
            raise InputError(f"{label}: residual_friction_angle_deg must be below 90 degrees")
        warn_of_joint(self, label)

    @classmethod
    def from_friction_coefficient(cls, coefficient: float, **options: Any) -> "Joint":
        """Joint with tan(phi) = coefficient [-]; other fields as keywords."""
        if not coefficient >= 0.0:
            raise InputError(f"friction coefficient must be a number >= 0, got {coefficient!r}")
        with given_as_coefficient():
            return cls(math.degrees(math.atan(coefficient)), **options)

    @property
    def tan_phi(self) -> float:
        """Friction coefficient tan(phi) [-]."""
        return math.tan(math.radians(self.friction_angle_deg))

    @property
    def tan_psi(self) -> float:
        """Dilatancy tan(psi), opening per slip [-]."""
        return math.tan(math.radians(self.dilatancy_angle_deg))

    @property
    def softens(self) -> bool:
        """Whether it names a residual value."""
        residual = (self.residual_friction_angle_deg, self.residual_cohesion, self.residual_tensile_strength)
        return any(value is not None for value in residual)

    @property
    def is_cohesionless(self) -> bool:
        """True for a dry joint with unlimited compression: the multiplier then does not depend on the scale."""
        return self.cohesion == 0.0 and self.tensile_strength == 0.0 and math.isinf(self.compressive_strength)
