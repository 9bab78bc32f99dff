"""Causes in the law of the joints: friction, cohesion, tension, dilatancy, crushing, wear."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import atan, degrees, exp, isfinite, tan
from typing import ClassVar

import numpy as np

from limitmason.build.variants import with_joint_law
from limitmason.diagnosis.catalogue.elastic import dead_load_stress
from limitmason.diagnosis.cause import Cause
from limitmason.model import Assembly, Joint, Loads

Bounds = tuple[float, float]
KINDS = ("bed", "head", "base")


def with_friction_factor(joint: Joint, factor: float) -> Joint:
    """The joint with tan(phi), and its residual value, times a factor; psi is kept as far as phi allows."""
    phi = degrees(atan(factor * joint.tan_phi))
    later = joint.residual_friction_angle_deg
    if later is not None:
        later = degrees(atan(factor * tan(later * np.pi / 180.0)))
    return replace(
        joint,
        friction_angle_deg=phi,
        dilatancy_angle_deg=min(joint.dilatancy_angle_deg, phi),
        residual_friction_angle_deg=later,
    )


@dataclass(frozen=True)
class JointChange:
    """A change in the law of the joints of some kinds; a subclass says what becomes of one joint at a size."""

    kinds: tuple[str, ...] = KINDS
    baseline: ClassVar[float] = 0.0

    def changed(self, joint: Joint, size: float) -> Joint:
        """The law of one joint at a size other than the baseline."""
        raise NotImplementedError

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if size == self.baseline:
            return assembly, loads
        return with_joint_law(assembly, lambda joint: self.changed(joint, size), self.kinds), loads


@dataclass(frozen=True)
class FrictionFactor(JointChange):
    """tan(phi) of the joints of some kinds times a factor."""

    baseline: ClassVar[float] = 1.0

    def changed(self, joint: Joint, size: float) -> Joint:
        """Friction coefficient times the size."""
        return with_friction_factor(joint, size)


def weak_base_joint(bounds: Bounds = (0.3, 1.0)) -> Cause:
    """Joints to the support with less friction than the others: tan(phi_base) = size x tan(phi) [-]."""
    return Cause(
        "weak base joint", "base_friction_factor", 1.0, bounds,
        "the ground slab is smoother, wetter or dustier than the blocks: tan(phi) of the joints to supports x size",
        apply=FrictionFactor(("base",)), unit="-",
        source="Coulomb law, the foundation joint as a material of its own",
        isolate="slide one course on the ground, beside the same course on another course",
        hidden_when="no specimen slides on its base, or the base slides as the bed joints would (one course)",
    )  # fmt: skip


def head_joint_friction(bounds: Bounds = (0.0, 1.0)) -> Cause:
    """Head joints that carry less shear than bed joints: tan(phi_head) = size x tan(phi) [-]."""
    return Cause(
        "head joint friction", "head_friction_factor", 1.0, bounds,
        "head joints are rough-cut, dusty or barely touch: tan(phi) of the head joints x size",
        apply=FrictionFactor(("head",)), unit="-",
        source="Coulomb law",
        isolate="the same wall built with gaps in its head joints",
        hidden_when="the mechanism presses no head joint",
        methods=("limit", "dem"),
    )  # fmt: skip


@dataclass(frozen=True)
class StressDependentFriction:
    """tan(phi) (sigma / sigma_ref)^-a per bed and base joint, sigma from the elastic state under dead load."""

    reference_stress: float
    least_stress: float

    def __call__(self, exponent: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if exponent == 0.0:
            return assembly, loads
        stress = np.maximum(dead_load_stress(assembly, loads), self.least_stress * self.reference_stress)
        interfaces = []
        for i, sigma in zip(assembly.interfaces, stress.tolist(), strict=True):
            if i.kind != "head":
                factor = (sigma / self.reference_stress) ** -exponent
                i = replace(i, joint=with_friction_factor(i.joint, factor))
            interfaces.append(i)
        return assembly.with_interfaces(interfaces), loads


def stress_dependent_friction(
    bounds: Bounds = (0.0, 0.3), *, reference_stress: float = 1e5, least_stress: float = 0.01
) -> Cause:
    """Friction that falls with the normal stress: tan(phi) = tan(phi_ref) (sigma / sigma_ref)^-size.

    The stress of a joint is its mean normal stress under dead load, by elastic joints of uniform stiffness between
    rigid blocks; it is not changed by the live load. Head joints keep their friction.

    Parameters
    ----------
    reference_stress : stress at which the friction of the model was measured [Pa]; 0.1 MPa is assumed
    least_stress : lower stresses count as this share of the reference [-]
    """
    if not (reference_stress > 0 and least_stress > 0):
        raise ValueError("reference_stress [Pa] and least_stress [-] must be positive")
    return Cause(
        "stress-dependent friction", "friction_exponent", 0.0, bounds,
        "asperities yield: tan(phi) = tan(phi_ref) (sigma / sigma_ref)^-size, sigma from the dead load",
        apply=StressDependentFriction(reference_stress, least_stress), unit="-",
        source="power law of friction of asperities in contact (Bowden and Tabor 1950; exponent 1/3 for spheres)",
        isolate="shear tests of one joint at several normal stresses, one of them that of the walls",
        hidden_when="all specimens carry the same stress: then it is an error of the friction coefficient",
        methods=("limit", "dem"),
    )  # fmt: skip


@dataclass(frozen=True)
class AddedCohesion(JointChange):
    """c + size, in kPa."""

    def changed(self, joint: Joint, size: float) -> Joint:
        """Cohesion raised."""
        return replace(joint, cohesion=joint.cohesion + 1e3 * size)


def cohesion(bounds: Bounds = (0.0, 5.0), *, kinds: Iterable[str] = KINDS) -> Cause:
    """Joints that stick: |T| <= c A + tan(phi) N with c raised by the size [kPa]; tension stays as it is.

    Limit analysis takes it as perfectly plastic, an upper value for a brittle film; so it does tension.
    """
    return Cause(
        "cohesion", "cohesion_kpa", 0.0, bounds, "dust, moisture or interlock of asperities: shear strength without "
        "pressure, c raised by size", apply=AddedCohesion(tuple(kinds)), unit="kPa", source="Mohr-Coulomb law",
        isolate="shear tests at low normal stress; specimens of two sizes of one shape",
        hidden_when="one size and one load level, where it is a larger friction",
        methods=("limit", "dem"),
    )  # fmt: skip


@dataclass(frozen=True)
class AddedTension(JointChange):
    """ft + size in kPa, with the cohesion that the Coulomb cone needs for it."""

    def changed(self, joint: Joint, size: float) -> Joint:
        """Tensile strength raised, and cohesion where the cone would end before it."""
        ft = joint.tensile_strength + 1e3 * size
        return replace(joint, tensile_strength=ft, cohesion=max(joint.cohesion, ft * joint.tan_phi))


def tension(bounds: Bounds = (0.0, 5.0), *, kinds: Iterable[str] = KINDS) -> Cause:
    """Joints that hold in tension: ft raised by the size [kPa], c to ft tan(phi) at least (the cone's apex)."""
    return Cause(
        "tension", "tension_kpa", 0.0, bounds, "suction or a film of mortar: N >= -ft A, with the cohesion "
        "ft tan(phi) without which the Coulomb cone would end before ft", apply=AddedTension(tuple(kinds)), unit="kPa",
        source="tension cut-off of the Mohr-Coulomb law; a section carries ft A L/2 plastic, ft A L/6 elastic",
        isolate="lift one block off another",
        hidden_when="near twin of cohesion where rocking and sliding gain alike",
        methods=("limit", "dem"),
    )  # fmt: skip


@dataclass(frozen=True)
class DilatancyShare(JointChange):
    """psi moved from its value towards phi by a share."""

    def changed(self, joint: Joint, size: float) -> Joint:
        """Dilatancy angle raised."""
        phi, psi = joint.friction_angle_deg, joint.dilatancy_angle_deg
        return replace(joint, dilatancy_angle_deg=min(psi + size * (phi - psi), phi))


def dilatancy(bounds: Bounds = (0.0, 1.0), *, kinds: Iterable[str] = KINDS) -> Cause:
    """Joints that climb when they slide: psi = psi_0 + size (phi - psi_0); acts where the flow rule reads psi."""
    return Cause(
        "dilatancy", "dilatancy_share", 0.0, bounds, "rough joints open by tan(psi) per unit of slip and raise their "
        "pressure where they cannot; size 0 keeps psi, 1 is psi = phi", apply=DilatancyShare(tuple(kinds)), unit="-",
        source="Godio, Stefanou and Sab 2017 (multiplier against dilatancy and block size)",
        isolate="shear test of one joint at constant normal stress: opening against slip",
        hidden_when="associative limit analysis and mechanisms, which do not read psi; walls without confinement; "
        "twin of cohesion at one height",
        methods=("limit, non-associative", "dem"),
    )  # fmt: skip


@dataclass(frozen=True)
class AddedCrushing(JointChange):
    """1 / fc + size, in 1/MPa."""

    def changed(self, joint: Joint, size: float) -> Joint:
        """Inverse of the compressive strength raised."""
        old = 1.0 / joint.compressive_strength if isfinite(joint.compressive_strength) else 0.0
        return replace(joint, compressive_strength=1.0 / (old + 1e-6 * size))


def finite_compressive_strength(bounds: Bounds = (0.0, 1.0)) -> Cause:
    """Joints that crush: 1 / fc raised by the size [1/MPa]; a size of 0.1 is fc = 10 MPa.

    In plane limit analysis uses the exact stress block |M| <= N L/2 - N^2 / (2 fc t); in 3-D it needs
    ``contact_model="grid"``.
    """
    return Cause(
        "finite compressive strength", "crushing_per_mpa", 0.0, bounds, "stones touch on few spots that crush: the "
        "toe needs the area N / fc, so that the lever arm shrinks by N / (2 fc t); size is 1 / fc",
        apply=AddedCrushing(), unit="1/MPa", source="rectangular stress block, M = N L/2 - N^2 / (2 fc t)",
        isolate="the same wall under several overloads; compression test of a stack",
        hidden_when="stresses are alike in all specimens: twin of edge rounding; no effect without overload on models",
        methods=("limit", "dem"),
    )  # fmt: skip


@dataclass(frozen=True)
class Wear:
    """tan(phi) times exp(-size (order - 1)), order of the test read from the specimen."""

    order: str

    def __call__(self, rate: float, assembly: Assembly, loads: Loads, specimen=None) -> tuple[Assembly, Loads]:
        """Extended model."""
        if rate == 0.0:
            return assembly, loads
        if specimen is None:
            raise ValueError("wear depends on the test: give specimen={'" + self.order + "': number of the test}")
        try:
            number = float(specimen[self.order] if hasattr(specimen, "keys") else getattr(specimen, self.order))
        except (KeyError, AttributeError):
            raise ValueError(f"wear needs {self.order!r} (1 for the first test) in every specimen") from None
        factor = exp(-rate * (number - 1.0))
        return with_joint_law(assembly, lambda j: with_friction_factor(j, factor)), loads


def wear(bounds: Bounds = (0.0, 0.05), *, order: str = "order") -> Cause:
    """Friction that falls from test to test with the same blocks: tan(phi) exp(-size (order - 1)).

    Parameters
    ----------
    order : name under which every specimen holds the number of its test, 1 for the first
    """
    return Cause(
        "wear", "wear_per_test", 0.0, bounds, "faces polish in repeated tests: tan(phi) exp(-size (order - 1))",
        apply=Wear(order), unit="per test", source="exponential running-in of a coefficient; the law is assumed",
        isolate="repeat the first test at the end of the campaign",
        hidden_when="the order of the tests follows another covariate, or nothing depends on friction",
        reads_specimen=True,
    )  # fmt: skip
