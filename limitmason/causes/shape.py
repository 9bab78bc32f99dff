"""Causes in shape, mass, units and displacement: out-of-plumb, size, density and modulus of blocks, sway."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from limitmason.arrays import Array
from limitmason.build.variants import displaced, resized, with_density_factor, with_part_of_thickness
from limitmason.causes.declare import Model, declare
from limitmason.causes.joints import MM_PER_MPA
from limitmason.causes.wrenches import Direction, live_direction, rescaled_loads, turned
from limitmason.errors import InputError, NotApplicable
from limitmason.geometry.rotation import rotation_matrices
from limitmason.limit.analysis import whole_limit_analysis
from limitmason.mechanics.elastic_joints import elastic_displacements
from limitmason.model import Assembly, Loads, Material
from limitmason.model.input import read_vector
from limitmason.model.interface import COS_45

_ACROSS = {"facade": (0.0, 1.0, 0.0), "rear": (0.0, 1.0, 0.0), "return": (1.0, 0.0, 0.0)}
"""Direction across the walls of ``build.wall``, by how the names of their units begin."""

ROUNDS = 30  # of the secant method for the multiplier at which blocks stand displaced


@declare(
    "out-of-plumb", parameter="lean_deg", lever="direction of loads", baseline=0.0, bounds=(-2.0, 2.0), unit="deg",
    physics="the wall leans: its weight has a component along the load before the test starts",
    source="statics of the turned structure",
    isolate="plumb line before the test; test in both directions: the effect changes sign",
    hidden_when="tilting tests in one direction: exact twin of the angle offset (load and weight turn together)",
)
def out_of_plumb(size: float, assembly: Assembly, loads: Loads, *, direction: Direction | None = None) -> Model:
    """A wall that leans as a whole before the test, by the size [deg].

    Positive towards the live load.

    The loads are turned by the opposite angle about the blocks' centroids, which is the same as turning the wall with
    its base joint under loads that keep their direction in space.

    Parameters
    ----------
    direction : horizontal direction of the lean; None is that of the live load
    """
    d = live_direction(loads) if direction is None else read_vector("direction", direction)
    axis = np.cross((0.0, 0.0, 1.0), d)
    if np.linalg.norm(axis) < 1e-9:
        said = "out-of-plumb needs a horizontal direction: give direction="
        raise InputError(said) if direction is not None else NotApplicable(f"{said}; that of the live load is vertical")
    back = rotation_matrices(-np.radians(size) * axis / np.linalg.norm(axis))
    return assembly, replace(loads, **turned(loads, "dead", back), **turned(loads, "live", back))


def _along(*, axes: str) -> Mapping[str, str]:
    """Name and parameter of the cause for some axes; for all three those declared."""
    if not axes or set(axes) - set("xyz"):
        raise InputError(f"axes must be letters out of 'xyz', got {axes!r}")
    if set(axes) == set("xyz"):
        return {}
    some = sorted(set(axes))
    return {"name": f"block size along {', '.join(some)}", "parameter": f"size_factor_{''.join(some)}"}


@declare(
    "block size", parameter="size_factor", lever="blocks", baseline=1.0, bounds=(0.9, 1.1), variant=_along,
    physics="units differ from the drawing: lengths x size, weights with the volume", source="geometry",
    isolate="measure and weigh a sample of units",
    hidden_when="dry joints without overload and all axes alike: the multiplier does not depend on the scale",
)
def block_size(factor: float, assembly: Assembly, loads: Loads, *, axes: str = "xyz") -> Model:
    """Blocks larger or smaller than drawn: lengths along some axes x size [-].

    Weights follow, applied forces stay.

    Parameters
    ----------
    axes : letters out of "xyz"; "y" is the thickness of a wall in the x-z plane, "z" the course height
    """
    factors = np.array([factor if a in axes else 1.0 for a in "xyz"])
    new = resized(assembly, factors)
    return new, rescaled_loads(assembly, new, loads, factors)


@declare(
    "block density", parameter="density_factor", lever="weights", baseline=1.0, bounds=(0.8, 1.2),
    physics="moisture, voids or another stone: weight x size", source="statics", isolate="weigh a sample of units",
    hidden_when="dry joints without overload: weight cancels; with overload twin of its magnitude, inverted",
)
def block_density(factor: float, assembly: Assembly, loads: Loads, *, blocks: Sequence[str] | None = None) -> Model:
    """Blocks heavier or lighter than assumed: density x size [-].

    Body forces follow, applied forces stay.

    Parameters
    ----------
    blocks : names of the blocks it holds for; None is all
    """
    new = with_density_factor(assembly, factor, blocks)
    return new, rescaled_loads(assembly, new, loads)


@declare(
    "missing unit", parameter="missing_share", lever="blocks", baseline=0.0, bounds=(0.0, 0.95),
    physics="a unit is broken, hollow or was never laid: it weighs less and touches over less of the thickness by size",
    source="statics", isolate="look behind the render; knock, or a thermogram",
    hidden_when="the unit is no part of what moves; in plane only its weight is missed",
)
def missing_unit(
    share: float, assembly: Assembly, loads: Loads, *, unit: str | None = None, direction: Direction | None = None
) -> Model:
    """A unit of which a share [-] is missing.

    It is missing over the unit's whole face, and from both sides of the wall.

    Parameters
    ----------
    unit : its name; None is the free one nearest to the middle of the structure
    direction : across the wall that it stands in; None for what its length and its joints say
    """
    if unit is None:
        middle = np.linalg.norm(assembly.centroids - assembly.centroids.mean(axis=0), axis=1)
        unit = assembly.blocks[int(np.argmin(np.where(assembly.held.all(axis=1), np.inf, middle)))].name
    k = assembly.block_index(unit)
    light, light_loads = block_density(blocks=(unit,)).apply(1.0 - share, assembly, loads)  # type: ignore[misc]
    across = _across_the_wall(assembly, k) if direction is None else direction
    thin = with_part_of_thickness(light, 1.0 - share, across).interfaces
    laid = zip(light.interfaces, thin, strict=True)
    changed = [there if k in (i.block_a, i.block_b) else i for i, there in laid]
    return light.with_interfaces(changed), light_loads


def _across_the_wall(assembly: Assembly, k: int) -> Array:
    """Horizontal unit vector across the wall in which a unit stands, shape (3,).

    A built wall says it by the names of its units. Elsewhere a header has upright joints along its length and none at
    its ends: the wall runs across it. Any other unit lies along the wall. One without a laid direction, or laid on end,
    is taken to stand in a wall along x.

    ``k`` is the number of the unit.
    """
    # at a corner a header has a joint at one end and one beside it, as a unit along the other wall has
    run = assembly.blocks[k].name.partition("-")[0]
    if assembly.recipe.get("kind") == "wall" and run in _ACROSS:
        return np.array(_ACROSS[run])
    axis, x = assembly.blocks[k].axis, assembly.arrays
    if axis is None or abs(axis[2]) > COS_45:
        return np.array([0.0, 1.0, 0.0])
    normals = x.normal[(x.block_a == k) | (x.block_b == k)]
    upright = normals[np.abs(normals[:, 2]) < COS_45]
    header = len(upright) > 0 and bool((np.abs(upright @ axis) < COS_45).all())
    return np.asarray(axis if header else np.cross((0.0, 0.0, 1.0), axis))


@declare(
    "unit modulus", parameter="modulus_factor", lever="stiffness", baseline=1.0, bounds=(0.3, 3.0),
    physics="units are softer or stiffer than stated: E x size", source="linear elasticity",
    isolate="compression of one unit; sound velocity",
    hidden_when="joints give way far more than units: twin of joint stiffness where both are uniform; peaks alone",
)
def unit_modulus(factor: float, assembly: Assembly, loads: Loads) -> Model:
    """Units of another elastic modulus: E x size [-] of every block that has a material."""
    changed: dict[int | str, Material] = {
        b.name: replace(b.material, young_modulus=factor * b.material.young_modulus)
        for b in assembly.blocks if b.material is not None
    }
    if not changed:
        raise NotApplicable("no block has a material: its blocks are rigid, whatever their modulus")
    return assembly.with_material(changed), loads


@declare(
    "second-order displacement", parameter="joint_compliance_mm_per_mpa", lever="displaced blocks", baseline=0.0,
    bounds=(0.0, 20.0), unit="mm/MPa", analyses=ROUNDS + 3,
    physics="joints are soft: the wall sways before it collapses and its weight works against it; size is 1 / kn",
    source="second-order theory of a block on elastic joints: lambda = tan(atan(b/h) - theta(lambda))",
    isolate="record the sway before collapse; shear and compression stiffness of one joint",
    hidden_when="specimens of one height and one load level, where it is a shift of the multiplier",
)
def second_order_displacement(
    size: float, assembly: Assembly, loads: Loads, *, shear_ratio: float = 0.4, head_joints: bool = False,
    flow_rule: str = "associative", multiplier: float | None = None,
) -> Model:
    """P-delta: blocks stand displaced by their elastic joints when they collapse.

    Size is 1 / kn [mm/MPa].

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
    dead, live = (
        elastic_displacements(
            assembly, np.asarray(wrench), normal_stiffness=1.0 / (size * MM_PER_MPA), shear_ratio=shear_ratio,
            head_joints=head_joints,
        )[0]
        for wrench in (loads.dead, loads.live)
    )

    def at(factor: float) -> Assembly:
        return displaced(assembly, dead + factor * live)

    if multiplier is not None:
        return at(multiplier), loads

    def collapse(model: Assembly) -> float:
        value = whole_limit_analysis(model, loads, flow_rule).collapse_multiplier
        return float(value) if np.isfinite(value) else 0.0  # it cannot stand displaced so far

    # fixed point of multiplier -> collapse multiplier of the geometry displaced at it, by the secant method
    high = collapse(assembly)
    # f is how much further the displaced structure could be loaded: zero at the fixed point
    before, f_before, x, f = 0.0, collapse(at(0.0)), high, collapse(at(high)) - high
    for _ in range(ROUNDS):
        if abs(f) <= 1e-8 * max(high, 1e-300):  # the limit analyses themselves are no finer
            break
        secant = x - f * (x - before) / (f - f_before) if f != f_before else 0.5 * (x + before)
        before, f_before = x, f
        x = min(max(secant, 0.0), high)
        f = collapse(at(x)) - x
        if x == before:  # held at an end of the range: no step leads on
            break
    return at(x), loads
