"""Causes in shape, mass and displacement: out-of-plumb, block size and density, sway before collapse."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from limitmason.build.variants import displaced, resized, with_density_factor, with_joint_law
from limitmason.diagnosis.catalogue.elastic import elastic_displacements
from limitmason.diagnosis.catalogue.loading import (
    live_direction,
    shared_acceleration,
    turned,
)
from limitmason.diagnosis.cause import Cause
from limitmason.geometry.rotation import rotation_matrices
from limitmason.limit import limit_analysis
from limitmason.model import Assembly, Joint, Loads

Bounds = tuple[float, float]
Direction = tuple[float, float, float]
MM_PER_MPA = 1e-9  # [m/Pa]


@dataclass(frozen=True)
class Lean:
    """All loads turned against the lean, seen from the wall: the same as leaning the wall, joints included."""

    direction: Direction | None

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if size == 0.0:
            return assembly, loads
        d = live_direction(loads) if self.direction is None else np.asarray(self.direction, dtype=float)
        axis = np.cross((0.0, 0.0, 1.0), d)
        if np.linalg.norm(axis) < 1e-9:
            raise ValueError("out-of-plumb needs a horizontal direction: give direction=")
        back = rotation_matrices(-np.radians(size) * axis / np.linalg.norm(axis))
        return assembly, replace(loads, dead=turned(loads.dead, back), live=turned(loads.live, back))


def out_of_plumb(bounds: Bounds = (-2.0, 2.0), *, direction: Direction | None = None) -> Cause:
    """A wall that leans as a whole before the test, by the size [deg], positive towards the live load.

    The loads are turned by the opposite angle about the blocks' centroids, which is the same as turning the wall with
    its base joint under loads that keep their direction in space.

    Parameters
    ----------
    direction : horizontal direction of the lean; None is that of the live load
    """
    return Cause(
        "out-of-plumb", "lean_deg", 0.0, bounds, "the wall leans: its weight has a component along the load before "
        "the test starts", apply=Lean(direction), unit="deg", source="statics of the turned structure",
        isolate="plumb line before the test; test in both directions: the effect changes sign",
        hidden_when="tilting tests in one direction: exact twin of the angle offset (load and weight turn together)",
        methods=("limit", "dem"),
    )  # fmt: skip


def rescaled_loads(old: Assembly, new: Assembly, loads: Loads, factors=(1.0, 1.0, 1.0)) -> Loads:
    """Loads of an assembly whose blocks changed their weight and size.

    Self weight, and the live load in proportion to it that most blocks share, follow the new weights. All other forces
    stay; their points of application move with the size.
    """
    share = shared_acceleration(old, loads)
    out = {}
    for case, per_weight in (("dead", np.array([0.0, 0.0, -1.0])), ("live", share)):
        wrench = getattr(loads, case)
        body = np.zeros_like(wrench)
        body[:, :3] = old.weights[:, None] * per_weight
        rest = wrench - body
        rest = np.where(np.abs(rest) > 1e-12 * max(float(np.abs(wrench).max(initial=0.0)), 1e-300), rest, 0.0)
        force, moment = rest[:, :3], rest[:, 3:]
        square = (force**2).sum(axis=1, keepdims=True)
        arm = np.divide(np.cross(force, moment), square, out=np.zeros_like(force), where=square > 0)
        rest = np.hstack([force, moment + np.cross(arm * (np.asarray(factors) - 1.0), force)])
        rest[:, :3] += new.weights[:, None] * per_weight
        out[case] = rest
    return replace(loads, **out)


@dataclass(frozen=True)
class Resized:
    """Blocks stretched along some axes."""

    axes: str

    def __call__(self, factor: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if factor == 1.0:
            return assembly, loads
        factors = np.array([factor if a in self.axes else 1.0 for a in "xyz"])
        new = resized(assembly, factors)
        return new, rescaled_loads(assembly, new, loads, factors)


def block_size(bounds: Bounds = (0.9, 1.1), *, axes: str = "xyz") -> Cause:
    """Blocks larger or smaller than drawn: lengths along some axes x size [-]; weights follow, applied forces stay.

    Parameters
    ----------
    axes : letters out of "xyz"; "y" is the thickness of a wall in the x-z plane, "z" the course height
    """
    if not axes or set(axes) - set("xyz"):
        raise ValueError(f"axes must be letters out of 'xyz', got {axes!r}")
    name = "block size" if set(axes) == set("xyz") else f"block size along {', '.join(sorted(set(axes)))}"
    return Cause(
        name, "size_factor" if set(axes) == set("xyz") else f"size_factor_{''.join(sorted(set(axes)))}", 1.0, bounds,
        "units differ from the drawing: lengths x size, weights with the volume", apply=Resized(axes), unit="-",
        source="geometry", isolate="measure and weigh a sample of units",
        hidden_when="dry joints without overload and all axes alike: the multiplier does not depend on the scale",
        methods=("limit", "dem"),
    )  # fmt: skip


@dataclass(frozen=True)
class DensityFactor:
    """Density of all blocks, or of some, times the size."""

    blocks: tuple[str, ...] | None

    def __call__(self, factor: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if factor == 1.0:
            return assembly, loads
        new = with_density_factor(assembly, factor, self.blocks)
        return new, rescaled_loads(assembly, new, loads)


def block_density(bounds: Bounds = (0.8, 1.2), *, blocks: Sequence[str] | None = None) -> Cause:
    """Blocks heavier or lighter than assumed: density x size [-]; body forces follow, applied forces stay.

    Parameters
    ----------
    blocks : names of the blocks it holds for; None is all
    """
    return Cause(
        "block density", "density_factor", 1.0, bounds, "moisture, voids or another stone: weight x size",
        apply=DensityFactor(None if blocks is None else tuple(blocks)), unit="-", source="statics",
        isolate="weigh a sample of units",
        hidden_when="dry joints without overload: weight cancels; with overload twin of its magnitude, inverted",
    )  # fmt: skip


@dataclass(frozen=True)
class SecondOrder:
    """Blocks moved to where elastic joints let them go at the collapse load itself."""

    shear_ratio: float
    head_joints: bool
    flow_rule: str
    multiplier: float | None
    rounds: int = 30

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if size == 0.0:
            return assembly, loads
        springs = {
            "normal_stiffness": 1.0 / (size * MM_PER_MPA),
            "shear_ratio": self.shear_ratio,
            "head_joints": self.head_joints,
        }
        dead = elastic_displacements(assembly, np.asarray(loads.dead), **springs)[0]
        live = elastic_displacements(assembly, np.asarray(loads.live), **springs)[0]

        def at(multiplier: float) -> Assembly:
            return displaced(assembly, dead + multiplier * live)

        if self.multiplier is not None:
            return at(self.multiplier), loads

        def collapse(model: Assembly) -> float:
            value = limit_analysis(model, loads, self.flow_rule).collapse_multiplier
            return float(value) if np.isfinite(value) else 0.0  # it cannot stand displaced so far

        # fixed point of multiplier -> collapse multiplier of the geometry displaced at it, by the secant method
        high = collapse(assembly)
        low, f_low, x, fx = 0.0, collapse(at(0.0)), high, collapse(at(high)) - high
        for _ in range(self.rounds):
            if abs(fx) <= 1e-8 * max(high, 1e-300):
                break
            step = x - fx * (x - low) / (fx - f_low) if fx != f_low else 0.5 * (x + low)
            low, f_low = x, fx
            x = min(max(step, 0.0), high)
            fx = collapse(at(x)) - x
            if x == low:
                break
        return at(x), loads


def second_order_displacement(
    bounds: Bounds = (0.0, 20.0),
    *,
    shear_ratio: float = 0.4,
    head_joints: bool = False,
    flow_rule: str = "associative",
    multiplier: float | None = None,
) -> Cause:
    """P-delta: blocks stand displaced by their elastic joints when they collapse; size is 1 / kn [mm/MPa].

    Displacements are those of rigid blocks on linear joints of stiffness kn = 1 / size under dead load plus multiplier
    times live load. The multiplier is that of collapse, found with the displacement it causes (some limit analyses).

    Parameters
    ----------
    shear_ratio : ks / kn [-]; 0.4 is assumed, that of an isotropic layer with a Poisson ratio of 0.25
    head_joints : whether head joints are springs too
    flow_rule : of the limit analysis that finds the multiplier
    multiplier : displace at this multiplier instead

    Notes
    -----
    Linear joints carry tension: real joints open and sway more, so it is a lower bound of the effect. In the DEM use
    :func:`joint_softness` instead.
    """
    return Cause(
        "second-order displacement", "joint_compliance_mm_per_mpa", 0.0, bounds, "joints are soft: the wall sways "
        "before it collapses and its weight works against it; size is 1 / kn",
        apply=SecondOrder(shear_ratio, head_joints, flow_rule, multiplier), unit="mm/MPa",
        source="second-order theory of a block on elastic joints: lambda = tan(atan(b/h) - theta(lambda))",
        isolate="record the sway before collapse; shear and compression stiffness of one joint",
        hidden_when="specimens of one height and one load level, where it is a shift of the multiplier",
        methods=("limit",),
    )  # fmt: skip


@dataclass(frozen=True)
class Softer:
    """Compliance added to every joint, in mm/MPa."""

    shear_ratio: float

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if size == 0.0:
            return assembly, loads
        added = size * MM_PER_MPA

        def change(joint: Joint) -> Joint:
            kn, ks = joint.normal_stiffness, joint.shear_stiffness
            ks = kn if ks is None else ks
            return replace(
                joint,
                normal_stiffness=1.0 / ((1.0 / kn if kn else 0.0) + added),
                shear_stiffness=1.0 / ((1.0 / ks if ks else 0.0) + added / self.shear_ratio),
            )

        return with_joint_law(assembly, change), loads


def joint_softness(bounds: Bounds = (0.0, 20.0), *, shear_ratio: float = 0.4) -> Cause:
    """Joints softer than assumed, for the DEM: 1 / kn raised by the size [mm/MPa], 1 / ks by size / shear_ratio.

    Joints without stiffness (the DEM's own default, nearly rigid) get kn = 1 / size.
    """
    return Cause(
        "joint softness", "softness_mm_per_mpa", 0.0, bounds, "joints close under load: the wall sways and joints "
        "open before collapse, and its weight works against it", apply=Softer(shear_ratio), unit="mm/MPa",
        source="no-tension Winkler joint; the DEM follows it with large displacements",
        isolate="record the sway before collapse; compression of a stack against load",
        hidden_when="limit analysis and mechanisms, whose joints are rigid; specimens of one height",
        methods=("dem",),
    )  # fmt: skip
