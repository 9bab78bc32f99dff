"""Causes in the law of the joints: friction, cohesion, tension, dilatancy, crushing, stiffness, softening, wear."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import atan, degrees, exp, isfinite, tan
from typing import Any

import numpy as np

from limitmason.causes.declare import Model, declare
from limitmason.causes.measurement import number
from limitmason.checks import positive
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.elastic_joints import dead_load_stress
from limitmason.model import Assembly, Joint, Loads

KINDS = ("bed", "head", "base")
MM_PER_MPA = 1e-9  # [m/Pa]


def with_friction_factor(joint: Joint, factor: float) -> Joint:
    """The joint with tan(phi), and its residual, times a factor; psi at most phi."""
    phi = degrees(atan(factor * joint.tan_phi))
    psi, later = min(joint.dilatancy_angle_deg, phi), joint.residual_friction_angle_deg
    if later is not None:
        later = degrees(atan(factor * tan(later * np.pi / 180.0)))
    return replace(joint, friction_angle_deg=phi, dilatancy_angle_deg=psi, residual_friction_angle_deg=later)


def times(joint: Joint, factor: float, *names: str) -> Joint:
    """The joint with some of its properties times a factor; those that it does not have stay None."""
    values = {name: getattr(joint, name) for name in names}
    return replace(joint, **{name: factor * value for name, value in values.items() if value is not None})


@declare(
    "weak base joint", parameter="base_friction_factor", lever="friction", baseline=1.0, bounds=(0.3, 1.0),
    physics="the ground slab is smoother, wetter or dustier than the blocks: tan(phi) of the joints to supports x size",
    source="Coulomb law, the foundation joint as a material of its own",
    isolate="slide one course on the ground, beside the same course on another course",
    hidden_when="no specimen slides on its base, or the base slides as the bed joints would (one course)",
)
def weak_base_joint(factor: float, assembly: Assembly, loads: Loads) -> Model:
    """Joints to the support with less friction than the others.

    tan(phi_base) = factor tan(phi) [-].
    """
    return assembly.with_joints(lambda joint: with_friction_factor(joint, factor), kinds=("base",)), loads


@declare(
    "head joint friction", parameter="head_friction_factor", lever="friction of single joints", baseline=1.0,
    bounds=(0.0, 1.0), source="Coulomb law",
    physics="head joints are rough-cut, dusty or barely touch: tan(phi) of the head joints x size",
    isolate="the same wall built with gaps in its head joints", hidden_when="the mechanism presses no head joint",
)
def head_joint_friction(factor: float, assembly: Assembly, loads: Loads) -> Model:
    """Head joints that carry less shear than bed joints.

    tan(phi_head) = factor tan(phi) [-].
    """
    return assembly.with_joints(lambda joint: with_friction_factor(joint, factor), kinds=("head",)), loads


def _check_stresses(*, reference_stress: float, least_stress: float) -> Mapping[str, str]:
    """Refuse stresses that are not positive: a power of their ratio is taken.

    The ``variant`` of the cause: what its fields become by these options, here nothing. Units are the cause's.
    """
    if not (reference_stress > 0 and least_stress > 0):
        raise InputError("reference_stress [Pa] and least_stress [-] must be positive")
    return {}


@declare(
    "stress-dependent friction", parameter="friction_exponent", lever="friction of single joints", baseline=0.0,
    bounds=(0.0, 0.3), variant=_check_stresses,
    physics="asperities yield: tan(phi) = tan(phi_ref) (sigma / sigma_ref)^-size, sigma from the dead load",
    source="power law of friction of asperities in contact (Bowden and Tabor 1950; exponent 1/3 for spheres)",
    isolate="shear tests of one joint at several normal stresses, one of them that of the walls",
    hidden_when="all specimens carry the same stress: then it is an error of the friction coefficient",
)
def stress_dependent_friction(
    exponent: float, assembly: Assembly, loads: Loads, *, reference_stress: float = 1e5, least_stress: float = 0.01
) -> Model:
    """Friction that falls with the normal stress.

    tan(phi) = tan(phi_ref) (sigma / sigma_ref)^-exponent.

    The stress of a joint is its mean normal stress under dead load, by elastic joints of uniform stiffness between
    rigid blocks; it is not changed by the live load. Head joints keep their friction.

    Parameters
    ----------
    reference_stress : stress at which the friction of the model was measured [Pa]; 0.1 MPa is assumed
    least_stress : lower stresses count as this share of the reference [-]
    exponent : size of the cause, 0 for a friction that does not fall [-]
    """
    stress = np.maximum(dead_load_stress(assembly, loads), least_stress * reference_stress)
    factors = [(sigma / reference_stress) ** -exponent for sigma in stress.tolist()]
    laid = zip(assembly.interfaces, factors, strict=True)
    changed = (i if i.kind == "head" else replace(i, joint=with_friction_factor(i.joint, f)) for i, f in laid)
    return assembly.with_interfaces(changed), loads


@declare(
    "cohesion", parameter="cohesion_kpa", lever="cohesion", baseline=0.0, bounds=(0.0, 5.0), unit="kPa",
    physics="dust, moisture or interlock of asperities: shear strength without pressure, c raised by size",
    source="Mohr-Coulomb law",
    isolate="shear tests at low normal stress; specimens of two sizes of one shape",
    hidden_when="one size and one load level, where it is a larger friction",
)
def cohesion(size: float, assembly: Assembly, loads: Loads, *, kinds: Iterable[str] = KINDS) -> Model:
    """Joints that stick: |T| <= c A + tan(phi) N with c raised by the size [kPa].

    Tension stays as it is.

    Limit analysis takes it as perfectly plastic, an upper value for a brittle film; so it does tension.
    """
    return assembly.with_joints(lambda joint: replace(joint, cohesion=joint.cohesion + 1e3 * size), kinds=kinds), loads


@declare(
    "tension", parameter="tension_kpa", lever="tension", baseline=0.0, bounds=(0.0, 5.0), unit="kPa",
    physics="suction or a film of mortar: N >= -ft A, with the cohesion ft tan(phi) without which the Coulomb cone "
    "would end before ft",
    source="tension cut-off of the Mohr-Coulomb law; a section carries ft A L/2 plastic, ft A L/6 elastic",
    isolate="lift one block off another",
    hidden_when="near twin of cohesion where rocking and sliding gain alike",
)
def tension(size: float, assembly: Assembly, loads: Loads, *, kinds: Iterable[str] = KINDS) -> Model:
    """Joints that hold in tension.

    The tensile strength ft is raised by the size [kPa], and c to ft tan(phi) at least (the cone's apex).
    """

    def stronger(joint: Joint) -> Joint:
        """The joint with more tensile strength, and the cohesion that puts the apex of its cone there at least."""
        ft = joint.tensile_strength + 1e3 * size
        return replace(joint, tensile_strength=ft, cohesion=max(joint.cohesion, ft * joint.tan_phi))

    return assembly.with_joints(stronger, kinds=kinds), loads


@declare(
    "dilatancy", parameter="dilatancy_share", lever="dilatancy", baseline=0.0, bounds=(0.0, 1.0),
    physics="rough joints open by tan(psi) per unit of slip and raise their pressure where they cannot; size 0 keeps "
    "psi, 1 is psi = phi",
    source="Godio, Stefanou and Sab 2017 (multiplier against dilatancy and block size)",
    isolate="shear test of one joint at constant normal stress: opening against slip",
    hidden_when="associative limit analysis and mechanisms, which do not read psi; walls without confinement; "
    "twin of cohesion at one height",
)
def dilatancy(size: float, assembly: Assembly, loads: Loads, *, kinds: Iterable[str] = KINDS) -> Model:
    """Joints that climb when they slide: psi = psi_0 + size (phi - psi_0).

    Acts where the flow rule reads psi.
    """

    def climbing(joint: Joint) -> Joint:
        phi, psi = joint.friction_angle_deg, joint.dilatancy_angle_deg
        return replace(joint, dilatancy_angle_deg=min(psi + size * (phi - psi), phi))

    return assembly.with_joints(climbing, kinds=kinds), loads


@declare(
    "finite compressive strength", parameter="crushing_per_mpa", lever="crushing", baseline=0.0, bounds=(0.0, 1.0),
    unit="1/MPa",
    physics="stones touch on few spots that crush: the toe needs the area N / fc, so that the lever arm shrinks by "
    "N / (2 fc t); size is 1 / fc",
    source="rectangular stress block, M = N L/2 - N^2 / (2 fc t)",
    isolate="the same wall under several overloads; compression test of a stack",
    hidden_when="stresses are alike in all specimens: twin of edge rounding; no effect without overload on models",
)
def finite_compressive_strength(size: float, assembly: Assembly, loads: Loads) -> Model:
    """Joints that crush: 1 / fc raised by the size [1/MPa].

    A size of 0.1 is fc = 10 MPa.

    In plane limit analysis uses the exact stress block |M| <= N L/2 - N^2 / (2 fc t); in 3-D it needs
    ``contact_model="grid"``.
    """

    def crushing(joint: Joint) -> Joint:
        old = 1.0 / joint.compressive_strength if isfinite(joint.compressive_strength) else 0.0
        return replace(joint, compressive_strength=1.0 / (old + 1e-6 * size))

    return assembly.with_joints(crushing, kinds=KINDS), loads


@declare(
    "wear", parameter="wear_per_test", lever="friction", baseline=0.0, bounds=(0.0, 0.05), unit="per test",
    physics="faces polish in repeated tests: tan(phi) exp(-size (order - 1))",
    source="exponential running-in of a coefficient; the law is assumed",
    isolate="repeat the first test at the end of the campaign",
    hidden_when="the order of the tests follows another covariate, or nothing depends on friction",
)
def wear(rate: float, assembly: Assembly, loads: Loads, specimen: Any = None, *, order: str = "order") -> Model:
    """Friction that falls from test to test with the same blocks.

    tan(phi) exp(-rate (n - 1)) in test n = ``specimen[order]``, 1 for the first.

    Parameters
    ----------
    rate : size of the cause, per test [-]
    specimen : mapping of a test that holds its number; it must be given, as the law depends on it
    order : name under which every specimen holds that number
    """
    if specimen is None:
        raise InputError("wear depends on the test: give specimen={'" + order + "': number of the test}")
    factor = exp(-rate * (number(specimen, order, "wear") - 1.0))
    return assembly.with_joints(lambda joint: with_friction_factor(joint, factor), kinds=KINDS), loads


@declare(
    "joint softness", parameter="softness_mm_per_mpa", lever="stiffness", baseline=0.0, bounds=(0.0, 20.0),
    unit="mm/MPa",
    physics="joints close under load: the wall sways and joints open before collapse, and its weight works against it",
    source="no-tension Winkler joint; the DEM follows it with large displacements",
    isolate="record the sway before collapse; compression of a stack against load",
    hidden_when="limit analysis and mechanisms, whose joints are rigid; specimens of one height",
)
def joint_softness(size: float, assembly: Assembly, loads: Loads, *, shear_ratio: float = 0.4) -> Model:
    """Joints softer than assumed: 1 / kn raised by the size [mm/MPa], for the DEM.

    1 / ks is raised by size / shear_ratio. Joints without stiffness, nearly rigid by the DEM's default, get kn = 1 /
    size.
    """
    added = size * MM_PER_MPA
    positive("shear_ratio", shear_ratio)

    def in_series(stiffness: float | None, compliance: float) -> float:
        """Stiffness [Pa/m] with a compliance [m/Pa] more; no stiffness counts as rigid."""
        return 1.0 / ((1.0 / stiffness if stiffness else 0.0) + compliance)

    def softer(joint: Joint) -> Joint:
        """The joint in series with the added compliance."""
        kn, ks = joint.normal_stiffness, joint.shear_stiffness
        ks = kn if ks is None else ks
        return replace(
            joint, normal_stiffness=in_series(kn, added), shear_stiffness=in_series(ks, added / shear_ratio)
        )

    return assembly.with_joints(softer, kinds=KINDS), loads


@declare(
    "joint friction", parameter="friction_factor", lever="friction", baseline=1.0, bounds=(0.6, 1.5),
    physics="units or sand of another source: tan(phi) x size", source="Coulomb law",
    isolate="slide one joint of each batch",
    hidden_when="no specimen slides; friction is a measured input as well",
)
def joint_friction(factor: float, assembly: Assembly, loads: Loads) -> Model:
    """Joints with another friction than was measured: factor tan(phi) [-]."""
    return assembly.with_joints(lambda joint: with_friction_factor(joint, factor), kinds=KINDS), loads


@declare(
    "bond strength", parameter="bond_factor", lever="cohesion", baseline=1.0, bounds=(0.2, 2.0),
    physics="mortar holds more or less than stated: cohesion and tension of the joints x size",
    source="Mohr-Coulomb law with a tension cut-off; bond varies by 30 % and more within one mortar",
    isolate="bond wrench or shear of couplets of the same batch and age",
    hidden_when="dry joints, which have none; peaks of walls that rock as whole pieces",
)
def bond_strength(factor: float, assembly: Assembly, loads: Loads) -> Model:
    """Mortar that holds more or less.

    Cohesion and tensile strength of all joints times ``factor`` [-], residual values too.
    """
    if not any(i.joint.cohesion or i.joint.tensile_strength for i in assembly.interfaces):
        raise NotApplicable("no joint has a cohesion or a tensile strength: there is no bond to change")

    names = ("cohesion", "tensile_strength", "residual_cohesion", "residual_tensile_strength")
    return assembly.with_joints(lambda joint: times(joint, factor, *names), kinds=KINDS), loads


def _stiffness_of(*, kinds: Iterable[str], joint: Sequence[str] | None) -> Mapping[str, Any]:
    """Name, parameter and physics of the cause for some kinds of joints, or one joint.

    For all kinds they are those declared, and nothing is returned.
    """
    if isinstance(kinds, str) or not (kinds := tuple(kinds)):
        raise InputError(f"kinds must be several names such as ('bed', 'base'), or one such as ('base',): {kinds!r}")
    if joint is not None:
        if set(kinds) != set(KINDS):
            raise InputError("joint is one joint, whatever its kind: leave kinds out")
        called = "|".join(joint)
        where = {"name": f"loose joint {called}", "physics": f"the joint {called} is loose or cracked: kn, ks x size"}
        return where | {"parameter": "loose_" + "".join(c if c.isalnum() else "_" for c in called)}
    if set(kinds) == set(KINDS):
        return {}
    called = ", ".join(kinds)
    return {"name": f"stiffness of {called} joints", "parameter": f"stiffness_factor_{'_'.join(kinds)}",
            "physics": f"{called} joints are softer or stiffer than stated: kn, ks x size"}


@declare(
    "joint stiffness", parameter="stiffness_factor", lever="stiffness", baseline=1.0, bounds=(0.2, 2.5),
    variant=_stiffness_of,
    physics="joints are softer or stiffer than stated: kn and ks x size",
    source="linear elastic joint; at the base it is a foundation that gives way",
    isolate="compression and shear of one joint; a frequency, which no load cell enters",
    hidden_when="peaks alone, which hardly feel it; two joints at places of one symmetry",
)
def joint_stiffness(
    factor: float, assembly: Assembly, loads: Loads, *, kinds: Iterable[str] = KINDS, joint: Sequence[str] | None = None
) -> Model:
    """Joints of another stiffness.

    kn and ks times ``factor`` [-], of some kinds or between two blocks alone.

    Parameters
    ----------
    kinds : "bed", "head", "base"; ("base",) is a softer or stiffer foundation
    joint : names of the two blocks of the one joint that it is about, see :func:`each_joint`
    factor : size of the cause [-]
    """

    def stiffer(law: Joint) -> Joint:
        if law.normal_stiffness is None:
            raise NotApplicable("a joint without normal_stiffness has none to change: state kn and ks of the joints")
        return times(law, factor, "normal_stiffness", "shear_stiffness")

    if joint is None:
        return assembly.with_joints(stiffer, kinds=kinds), loads
    pair = {assembly.block_index(name) for name in joint}
    between = [{i.block_a, i.block_b} == pair for i in assembly.interfaces]
    if not any(between):
        raise InputError(f"there is no joint between {' and '.join(map(repr, joint))}")
    laid = zip(assembly.interfaces, between, strict=True)
    return assembly.with_interfaces(replace(i, joint=stiffer(i.joint)) if b else i for i, b in laid), loads


def _softening(assembly: Assembly, change: Callable[[Joint], Joint]) -> Assembly:
    """Joints that lose strength in failure, changed.

    Raises
    ------
    NotApplicable
        Where none does.
    """
    if not any(i.joint.softens for i in assembly.interfaces):
        raise NotApplicable("no joint loses strength in failure: name a residual value or a fracture energy")
    return assembly.with_joints(lambda joint: change(joint) if joint.softens else joint)


@declare(
    "fracture energy", parameter="energy_factor", lever="softening", baseline=1.0, bounds=(0.25, 4.0),
    physics="joints lose their strength over another opening and slip: GfI and GfII x size",
    source="linear softening, area under the curve of stress against opening",
    isolate="a joint in tension or shear under control of its opening",
    hidden_when="limit analysis, which is perfectly plastic; the residual and the first crack do not feel it",
)
def fracture_energy(factor: float, assembly: Assembly, loads: Loads) -> Model:
    """Joints that soften faster or slower.

    Fracture energies in tension and shear times ``factor`` [-].
    """

    def tougher(joint: Joint) -> Joint:
        if joint.fracture_energy_tension is None and joint.fracture_energy_shear is None:
            raise NotApplicable("a joint that softens names no fracture energy: it drops at once, whatever the size")
        return times(joint, factor, "fracture_energy_tension", "fracture_energy_shear")

    return _softening(assembly, tougher), loads


@declare(
    "strength kept", parameter="strength_kept", lever="softening", baseline=0.0, bounds=(0.0, 0.9),
    physics="joints keep a share of the cohesion and tension that the model takes away in failure",
    source="residual shear strength of a cracked joint",
    isolate="slide a joint on after its peak; reload a cracked joint in tension",
    hidden_when="limit analysis, which loses nothing; the load up to the peak does not feel it",
)
def strength_kept(share: float, assembly: Assembly, loads: Loads) -> Model:
    """Joints that lose less: residual c and ft raised by ``share`` [-] of what is lost.

    Friction stays as it is.
    """

    def kept(joint: Joint) -> Joint:
        """The joint with residual c and ft raised by a share of what it loses."""
        residuals = {}
        for strength, way in (("cohesion", "shear"), ("tensile_strength", "tension")):
            peak, rest = getattr(joint, strength), getattr(joint, f"residual_{strength}")
            if rest is None:  # all of it is lost where an energy is named, else nothing
                rest = peak if getattr(joint, f"fracture_energy_{way}") is None else 0.0
            residuals[f"residual_{strength}"] = rest + share * (peak - rest)
        return replace(joint, **residuals)

    return _softening(assembly, kept), loads
