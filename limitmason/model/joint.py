"""The joint law: Coulomb friction with dilatancy, cohesion, tension cut-off, crushing and elastic stiffness."""

import math
from dataclasses import dataclass, fields
from difflib import get_close_matches
from enum import StrEnum
from typing import Any, Self

from limitmason.checks import choice, law_angles, single_number
from limitmason.errors import InputError
from limitmason.model.joint_term import JointTerm, name_of
from limitmason.model.plausibility import given_as_coefficient, warn_of_joint


class LostBy(StrEnum):
    """What brings a point of a joint from its peak to its residual values."""

    OPENING_OR_SLIP = "opening or slip"
    OPENING = "opening"
    NOTHING = "nothing"


class Unloading(StrEnum):
    """How a point that has lost tensile strength closes again."""

    ELASTIC = "elastic"
    SECANT = "secant"


_COEFFICIENTS = ("friction_coefficient", "friction", "coefficient", "mu")
_SYMBOLS = {
    "phi": "friction_angle_deg", "psi": "dilatancy_angle_deg", "c": "cohesion", "ft": "tensile_strength",
    "tension": "tensile_strength", "fc": "compressive_strength", "compression": "compressive_strength",
    "kn": "normal_stiffness", "ks": "shear_stiffness",
}
_CHOICES: dict[str, type[StrEnum]] = {"lost_by": LostBy, "unloading": Unloading}


@dataclass(frozen=True)
class Joint:
    """Law of a joint between two blocks.

    |T| <= c A + N tan(phi), -ft A <= N <= fc A; a sliding joint opens by tan(psi) per unit of slip.

    Parameters
    ----------
    friction_angle_deg : phi [deg], 0 <= phi < 90
    dilatancy_angle_deg : psi [deg], 0 <= psi <= phi; used by non-associative limit analysis and the DEM
    cohesion : c [Pa]
    tensile_strength : ft [Pa]; where ft > c / tan(phi) the DEM and the capacity curve take it as it is, every other
        method cuts it at the apex of the Coulomb cone, and the answer warns
    compressive_strength : fc [Pa], infinite by default
    normal_stiffness, shear_stiffness : kn, ks [Pa/m]; needed by the DEM only
    residual_friction_angle_deg, residual_cohesion, residual_tensile_strength : values after failure [deg], [Pa];
        None keeps the peak value (perfect plasticity), or is 0 where the fracture energy is named
    name : label shown in tables
    lost_by : what takes a point to its residual values: "opening or slip", "opening" (a joint that slides keeps its
        cohesion) or "nothing" (they are never reached)
    fracture_energy_tension, fracture_energy_shear : GfI, GfII [J/m2], areas under the curves of tension against
        opening and, above the residual shear, of shear against plastic slip under constant N, which fall linearly:
        ft is lost over 2 GfI / (ft - ft_r), c over 2 GfII / (c - c_r). One damage goes with both, so that a joint which
        has lost all of its tension has no cohesion left, and phi and psi go with it. None is a sudden drop, or
        ``softening_slip`` of the DEM's options
    unloading : in tension of a point that has lost a part of ft over an opening: "elastic" keeps kn, "secant" goes
        straight to the origin, so that cycles lose stiffness. In shear a joint unloads with ks
    terms : further terms of the law, each of its own class, see :class:`limitmason.model.joint_term.JointTerm`

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
    lost_by: LostBy = LostBy.OPENING_OR_SLIP
    fracture_energy_tension: float | None = None
    fracture_energy_shear: float | None = None
    unloading: Unloading = Unloading.ELASTIC
    terms: tuple[JointTerm, ...] = ()

    def __new__(cls, *_: Any, **given: Any) -> Self:
        """Refuse a field that a joint does not have.

        For a coefficient of friction the message says the angle.
        """
        known = [f.name for f in fields(cls)]
        for name in sorted(given.keys() - set(known)):
            near = get_close_matches(_SYMBOLS.get(name, name), known, n=1) or [f"one of {', '.join(known)}"]
            if name in _COEFFICIENTS and isinstance(given[name], int | float):
                near = [f"friction_angle_deg={math.degrees(math.atan(given[name])):.4g}"]
            raise InputError(f"a joint has no field {name!r}: write {near[0]}")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        """Check every field and say which one is wrong."""
        label = f"joint {self.name!r}" if self.name else "joint"
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in ("name", "terms") or (value is None and field.default is None):
                continue
            if field.name in _CHOICES:
                choices = _CHOICES[field.name]
                object.__setattr__(self, field.name, choices(choice(f"{label}: {field.name}", value, tuple(choices))))
                continue
            single_number(f"{label}: {field.name}", value, endless=field.name == "compressive_strength")
        law_angles(label, self.friction_angle_deg, self.dilatancy_angle_deg)
        if self.compressive_strength == 0.0:
            raise InputError(f"{label}: compressive_strength must be positive (infinite when crushing is left out)")
        if self.residual_friction_angle_deg is not None and self.residual_friction_angle_deg >= 90.0:
            raise InputError(f"{label}: residual_friction_angle_deg must be below 90 degrees")
        self._check_energies(label)
        if not isinstance(self.terms, tuple | list):
            raise InputError(f"{label}: terms must be a list of terms of the law, got {self.terms!r}; for none ()")
        object.__setattr__(self, "terms", tuple(self.terms))
        names = [name_of(term) for term in self.terms]
        if len(set(names)) < len(names):
            raise InputError(f"{label}: a term is given twice: {', '.join(names)}")
        peak = self.tan_phi, self.tan_psi, self.cohesion, self.tensile_strength
        for term, name in zip(self.terms, names, strict=True):
            # slip 0, damage 0: what reads the law at its peak does not ask the term
            if term.strength(*peak, 0.0, 0.0, *term.numbers.values()) != peak:
                raise InputError(f"{label}: term {name!r} changes the strength of a joint that has not slipped")
        warn_of_joint(self, label)

    def _check_energies(self, label: str) -> None:
        """Refuse fracture energies that nothing can spend.

        ``label`` names the joint in messages.
        """
        for field, strength in (("fracture_energy_tension", "tensile_strength"), ("fracture_energy_shear", "cohesion")):
            energy, rest = getattr(self, field), getattr(self, f"residual_{strength}")
            if energy is None:
                continue
            if self.lost_by is LostBy.NOTHING:
                raise InputError(f"{label}: {field} is given, but lost_by='nothing' never spends it")
            if self.lost_by is LostBy.OPENING and field == "fracture_energy_shear":
                raise InputError(f"{label}: {field} is given, but lost_by='opening' loses nothing by slip")
            if energy == 0.0:
                raise InputError(f"{label}: {field} must be positive; leave it out for a sudden drop")
            if not getattr(self, strength) > (rest or 0.0):
                raise InputError(f"{label}: {field} is given, but {strength} has nothing to lose: raise it")

    @classmethod
    def from_friction_coefficient(cls, coefficient: float, **options: Any) -> "Joint":
        """Joint with a coefficient of friction in place of the angle.

        Parameters
        ----------
        coefficient : tan(phi) [-], >= 0
        options : other fields of the joint
        """
        single_number("friction coefficient", coefficient)
        if "friction_angle_deg" in options:
            raise InputError("give the friction coefficient or friction_angle_deg, not both")
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
        """Whether a joint names a residual value or fracture energy that something takes."""
        named = (
            self.residual_friction_angle_deg, self.residual_cohesion, self.residual_tensile_strength,
            self.fracture_energy_tension, self.fracture_energy_shear,
        )
        return self.lost_by is not LostBy.NOTHING and any(value is not None for value in named)

    @property
    def is_cohesionless(self) -> bool:
        """True for a dry joint with unlimited compression.

        The multiplier then does not depend on the scale.
        """
        strong = self.cohesion > 0.0 or self.tensile_strength > 0.0 or math.isfinite(self.compressive_strength)
        return not strong and not self.terms
