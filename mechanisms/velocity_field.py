"""A mechanism as rigid motions of an assembly's blocks, and the Prediction that carries it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.acceptance import Certificate
from limitmason.answers.results import NO_TILT, Bound, BoundKind, Mechanism, Prediction, Status
from limitmason.arrays import Array, Flags
from limitmason.errors import NotApplicable
from limitmason.mechanics.law_table import FIELDS, MECHANISMS, RESIDUAL, refuse, terms
from limitmason.mechanics.law_table import notes as left_out
from limitmason.mechanics.model_notes import why_no_tilt_angle
from limitmason.mechanics.resultants import scaled_mechanism
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from mechanisms.built_wall import wall_recipe
from mechanisms.parameters import ROUNDING, Facade, load_direction
from mechanisms.virtual_work_check import check_contacts

UPPER = Bound(
    BoundKind.UPPER,
    "upper: admissible as a contact field, so not below associative limit analysis on the same interfaces",
)
UPPER_IDEAL = Bound(
    BoundKind.UPPER,
    "upper bound of associative limit analysis on the same geometry (no assembly is given on which to check it)",
)
ESTIMATE = Bound(
    BoundKind.ESTIMATE, "estimate: friction is a prescribed force, not a contact result; no bound of limit analysis"
)
ESTIMATE_INADMISSIBLE = Bound(
    BoundKind.ESTIMATE,
    "estimate: friction is a prescribed force and the motion is not admissible as a contact field (blocks "
    "interpenetrate or slide without opening); no bound of limit analysis",
)

THIS_MOTION = Bound(
    BoundKind.ESTIMATE,
    "estimate: exact for this motion without friction, which is not admissible as a contact field; no bound",
)
FREE_WALL = Bound(BoundKind.ESTIMATE, "estimate: exact for the facade without its side walls; with them no bound")
NOT_ADMISSIBLE = Bound(
    BoundKind.ESTIMATE,
    "estimate: the motion of these blocks is not admissible as a contact field; no bound of limit analysis",
)
NO_POWER_BALANCE = Bound(BoundKind.ESTIMATE, "estimate: the closed form is not the power balance of these blocks")

ON_BLOCKS = "the motion is admissible on these blocks and gives the upper bound"

_SAME = 1e-6  # relative difference up to which a formula and the power balance on the blocks are the same number
_JUST_ABOVE = 1e-6  # [m]: a block whose centroid is on a level does not lie above it


def rotation(assembly: Assembly, moving: Flags, point: ArrayLike, spin: ArrayLike) -> Array:
    """Return the twists of blocks that turn together about an axis, zero for the others, shape (n_blocks, 6).

    v = spin x (r - point).

    Parameters
    ----------
    assembly : the blocks
    moving : which of them turn, shape (n_blocks,)
    point : on the axis [m], shape (3,)
    spin : angular velocity [rad/s], shape (3,), right-hand rule
    """
    twists = np.zeros((assembly.n_blocks, 6))
    arm = assembly.centroids[moving] - np.asarray(point, dtype=float)
    twists[moving, :3] = np.cross(np.asarray(spin, dtype=float), arm)
    twists[moving, 3:] = spin
    return twists


def translation(assembly: Assembly, moving: Flags, velocity: ArrayLike) -> Array:
    """Return the twists of blocks that move together without turning, zero for the others, shape (n_blocks, 6).

    ``moving`` marks them, shape (n_blocks,), ``velocity`` is theirs [m/s], shape (3,).
    """
    twists = np.zeros((assembly.n_blocks, 6))
    twists[moving, :3] = velocity
    return twists


def above(assembly: Assembly, level: float) -> Flags:
    """Free blocks whose centroids lie above a level [m], shape (n_blocks,)."""
    return ~assembly.fixed & (assembly.centroids[:, 2] > level)


def rocking_twists(
    assembly: Assembly, loads: Loads, level: float, crack: Callable[[float], float]
) -> Array:
    """Return the twists of mechanisms A and B: facade and wedges turn about the toe line at a level.

    Both are those of :mod:`mechanisms.facade_rocking`. Above the level the facade and its beam move. Of the units and
    beams on side walls those move that reach the outer face, or whose centroids lie before the crack line.

    Parameters
    ----------
    assembly : a built wall
    loads : on it, out of plane
    level : of the hinge, z [m]
    crack : distance of the crack from the outer face [m] at a level z [m]

    Returns
    -------
    [m/s, rad/s], shape (n_blocks, 6), of a turn at 1 rad/s

    Raises
    ------
    NotApplicable
        For live loads along x, or towards side walls, or that are no weights turned, and for what is no built wall.
    """
    axis, sense = load_direction(assembly, loads)
    recipe = wall_recipe(assembly)
    thickness = recipe["thickness"]
    if axis != "y" or (sense > 0 and recipe["returns"]):
        raise NotApplicable(
            "the loads must push the facade out of plane, away from its side walls: Loads.horizontal(wall, (0, -1, 0))"
        )
    moving = above(assembly, level + _JUST_ABOVE)
    slack = ROUNDING * thickness
    for k, block in enumerate(assembly.blocks):
        if moving[k] and block.name.startswith(("return", "beam-")):
            corner = block.bounds[0, 1] <= slack  # a unit that reaches the outer face belongs to the facade
            y, z = assembly.centroids[k, 1:]
            # the crack ends at the top of the wall, above which beams lie
            moving[k] = corner or y <= crack(min(z, recipe["height"])) + slack
    toe = 0.0 if sense < 0 else thickness
    return rotation(assembly, moving, (0.0, toe, level), (-float(sense), 0.0, 0.0))


def flexure_twists(assembly: Assembly, loads: Loads, level: float, tangent: float) -> Array:
    """Return the twists of mechanism D: a rectangle rocks about its foot, a triangle at each held end about its line.

    Parameters
    ----------
    assembly : a built wall of plan L or U
    loads : on it, that push the facade away from its side walls
    level : of the hinge, z [m]
    tangent : tan(a) of the outer lines from the vertical [-]

    Returns
    -------
    [m/s, rad/s], shape (n_blocks, 6), of a triangle's turn at 1 rad/s

    Raises
    ------
    NotApplicable
        For plans other than L and U, loads along x or towards the side walls or that are no weights turned, and for
        what is no built wall.
    """
    axis, sense = load_direction(assembly, loads)
    recipe = wall_recipe(assembly)
    if recipe["plan"] not in ("L", "U"):
        raise NotApplicable(f"plan {recipe['plan']!r}: mechanism D needs a facade held at one end (L) or both (U)")
    if axis != "y" or sense > 0:
        raise NotApplicable(
            "the loads must push the facade away from its side walls: Loads.horizontal(wall, (0, -1, 0))"
        )
    length, height = recipe["length"], recipe["height"] - level
    a = math.atan(tangent)
    reach = height * tangent
    held = {r["side"] for r in recipe["returns"]}
    ends = {"left": reach if "left" in held else 0.0, "right": length - reach if "right" in held else length}
    facade = np.array([b.name.startswith("facade") or b.name == "beam" for b in assembly.blocks])
    x, z = assembly.centroids[:, 0], assembly.centroids[:, 2]
    free = facade & above(assembly, level + _JUST_ABOVE)
    up = np.minimum(z - level, height)
    # a triangle turns at unit rate about its line from (reach, level) to the top of the held end, inclined by a; the
    # middle turns by sin a, so that both move alike where they meet, at x = reach (docs/mechanisms.md, 4.2)
    twists = np.zeros((assembly.n_blocks, 6))
    middle = free & (x >= ends["left"]) & (x <= ends["right"])
    twists += rotation(assembly, middle, (0.0, 0.0, level), (math.sin(a), 0.0, 0.0))
    left = free & (x < ends["left"]) & (x > reach - up * tangent)
    twists += rotation(assembly, left, (reach, 0.0, level), (math.sin(a), 0.0, -math.cos(a)))
    right = free & (x > ends["right"]) & (x < length - reach + up * tangent)
    return twists + rotation(assembly, right, (length - reach, 0.0, level), (math.sin(a), 0.0, math.cos(a)))


def answer(
    name: str,
    multiplier: float,
    *,
    facade: Facade | None = None,
    assembly: Assembly | None = None,
    loads: Loads | None = None,
    twists: Array | None = None,
    ideal_bound: Bound = ESTIMATE,
    details: Mapping[str, Any] | None = None,
    warnings: tuple[str, ...] = (),
    source: str = "",
) -> Prediction:
    """Return a Prediction of this package: number, what it is, and its motion held against the joints.

    Parameters
    ----------
    name : of the mechanism; the method is "mechanisms: " and this
    multiplier : of the closed form [-]
    facade : the parameters used
    assembly, loads : the problem, where it is one of blocks
    twists : velocities of its blocks in the mechanism [m/s, rad/s], shape (n_blocks, 6)
    ideal_bound : what the closed form is where no assembly is given
    details, warnings, source : go to the Prediction
    """
    mechanism: Mechanism | None = None
    certificate: Certificate | None = None
    bound, extra, notes = ideal_bound, dict(details or {}), list(warnings)
    if assembly is not None:
        refuse(MECHANISMS, assembly)
    if assembly is not None and (loads is None or twists is None):
        notes += left_out(MECHANISMS, assembly)
    elif assembly is not None and loads is not None and twists is not None:
        check = check_contacts(assembly, loads, twists)
        mechanism = scaled_mechanism(assembly, loads, twists, check.points.position, check.points.interface)
        kinematic = check.multiplier if check.admissible else math.nan
        certificate = Certificate(math.nan, math.nan, flow_residual=check.violation, kinematic_multiplier=kinematic)
        extra |= {"admissible": check.admissible, "kinematic_multiplier": kinematic}
        extra[NO_TILT] = why_no_tilt_angle(assembly, loads)
        # admissible on the blocks and no higher than the closed form: that is a bound then. Higher: it is not on these
        # blocks, whose own balance gives one. Not admissible: what the closed form is by itself, at most an estimate
        bound = ESTIMATE_INADMISSIBLE if ideal_bound == ESTIMATE else ideal_bound
        if check.admissible and kinematic <= multiplier + _SAME * abs(multiplier):
            bound = UPPER
            if kinematic < 0.0:
                notes.append("below zero: by this motion the structure falls under its dead load alone")
        elif check.admissible:
            bound = NO_POWER_BALANCE
            notes.append(f"{ON_BLOCKS} {kinematic:.6g} there (details['kinematic_multiplier'])")
        elif ideal_bound == UPPER_IDEAL:
            bound = NOT_ADMISSIBLE
        # the power of an admissible motion counts cohesion, tension, crushing and ties; what it does not count is told
        uncharged = tuple(term for term in terms() if not check.admissible or term not in FIELDS or term is RESIDUAL)
        notes += left_out(MECHANISMS, assembly, among=uncharged)
    provenance: dict[str, Any] = {"theory": "analytical mechanism", "source": source}
    if facade is not None:
        provenance["parameters"] = facade.as_dict()
    return Prediction(
        method=f"mechanisms: {name}", collapse_multiplier=float(multiplier), bound=bound, status=Status.SOLVED,
        mechanism=mechanism, certificate=certificate, warnings=tuple(notes), provenance=provenance,
        details=extra,
    )
