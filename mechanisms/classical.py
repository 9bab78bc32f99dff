"""Classical mechanisms: overturning, sliding, stacks, a facade turning about an inclined hinge, Rondelet's rule."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from limitmason.answers.results import Bound, BoundKind, Prediction
from limitmason.arrays import Array, Flags
from limitmason.checks import choice, count, finite, instance, not_negative, positive
from limitmason.errors import InputError, NotApplicable
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from mechanisms.built_wall import foot_level
from mechanisms.horizontal_flexure import flexure_terms, other_ends
from mechanisms.parameters import ROUNDING, Facade, loads_of, read
from mechanisms.velocity_field import FREE_WALL, THIS_MOTION, UPPER_IDEAL, answer, flexure_twists, rotation, translation
from mechanisms.virtual_work_check import check_contacts

EXACT = Bound(BoundKind.EXACT, "exact for rigid blocks without tension")

_EQUAL = 1e-12  # relative: multipliers that near to each other are equal, and the lower joint is kept
_SLACK = 10.0  # tolerances of the assembly: faces whose heights differ by less lie on one level


class Level(NamedTuple):
    """A flat joint through the whole structure.

    Parameters
    ----------
    height : of the joint, z [m]
    moving : blocks above it, shape (n_blocks,)
    corners : of its contacts [m], shape (k, 3)
    tan_phi : largest friction coefficient among them [-]
    """

    height: float
    moving: Flags
    corners: Array
    tan_phi: float


def overturning(assembly: Assembly, *, loads: Loads | None = None) -> Prediction:
    """Return overturning in one piece of everything above a flat joint.

    The centre of the weights W_i stands x_i inside the toe and z_i above it, so that

        lambda = sum(W_i x_i) / (c sum(W_i z_i))

    and t/H for a free wall. The toe is the line across the push through the outermost corner, or an edge of the convex
    outline of what bears; c is the cosine between the push and the normal of that line, and the least lambda counts.
    From the numbers of a facade it is ``simple_rocking(facade, side_walls=0)``.

    Parameters
    ----------
    assembly : with flat joints through it; all of them are tried
    loads : live part horizontal on the whole; weights along -y where omitted

    Returns
    -------
    Prediction
        ``details``: hinge_height [m].

    Raises
    ------
    NotApplicable
        For an assembly without a flat joint through it, or live loads that do no work.

    Notes
    -----
    Always admissible as a contact field, so an upper bound of associative limit analysis; exact for a free wall.
    Wrong as an estimate of walls with cracks in their side walls, which fall earlier.
    """
    if isinstance(assembly, Facade):
        raise InputError("overturning is of an assembly; from a Facade it is simple_rocking(facade, side_walls=0)")
    loads, direction = _direction(assembly, loads)

    def turned(level: Level) -> list[Array]:
        """Twists of what lies above a level as it turns about a toe, shape (n_blocks, 6) for each toe."""
        toe = level.corners[np.argmax(level.corners @ direction)]
        outline = ConvexHull(level.corners[:, :2])
        toes = [(toe, direction)]
        for (i, j), plane in zip(outline.simplices, outline.equations, strict=True):
            x, y, _ = level.corners[j] - level.corners[i]
            outward = np.array([y, -x, 0.0]) / math.copysign(math.hypot(x, y), y * plane[0] - x * plane[1])
            if ROUNDING < outward @ direction < 1.0 - ROUNDING:  # an edge across the push is the first toe
                toes.append((level.corners[i], outward))
        # spin x (r - toe) moves the top outwards and lifts what stands behind the toe
        return [rotation(assembly, level.moving, at, (-out[1], out[0], 0.0)) for at, out in toes]

    return _worst_level("overturning", assembly, loads, turned, "moment equilibrium about the toe")


def sliding(facade: Facade | Assembly, *, loads: Loads | None = None) -> Prediction:
    """Return sliding in one piece of everything above a flat joint.

    lambda = f for weights turned sideways.

    Parameters
    ----------
    facade : numbers of a facade, or any assembly with flat joints
    loads : of the assembly, as in :func:`overturning`

    Notes
    -----
    The motion dilates, e_n = tan(phi) e_t, as the associative law asks; without cohesion its value does not depend on
    that, since the weight above presses with all of itself. An upper bound, exact for a single block.
    """
    if isinstance(facade, Facade):
        if loads is not None:
            raise InputError("loads go with an assembly; a Facade carries its overload itself")
        f = facade
        load = f.overload * f.overload_length
        # friction of all that weighs over what is pushed: of the overload only the part that is mass
        value = f.friction * (f.weight + load) / (f.weight + load * f.overload_inertia)
        return answer(
            "sliding", value, facade=f, ideal_bound=FREE_WALL if f.side_walls else UPPER_IDEAL, source="Coulomb"
        )
    loads, direction = _direction(facade, loads)

    def moved(level: Level) -> list[Array]:
        """Twists of what lies above a level as it slides and rises by tan(phi) of that, shape (n_blocks, 6)."""
        return [translation(facade, level.moving, direction + [0.0, 0.0, level.tan_phi])]

    return _worst_level("sliding", facade, loads, moved, "Coulomb")


def rigid_block(
    *, width: float, height: float, friction: float, weight: float = 1.0, top_load: float = 0.0
) -> Prediction:
    """Return rocking or sliding of one block with a centred mass on its top.

    W is its weight, Q that of the mass.

        rocking (b/h)(W + Q)/(W + 2 Q), sliding f

    Parameters
    ----------
    width : b along the load [m]
    height : h [m]
    friction : f [-]
    weight, top_load : W and Q [N]

    Notes
    -----
    Exact. Source: docs/mechanisms.md, section 8.
    """
    for name, value in (("width", width), ("height", height), ("weight", weight)):
        positive(name, value)
    for name, value in (("friction", friction), ("top_load", top_load)):
        not_negative(name, value)
    rocking = width / height * (weight + top_load) / (weight + 2.0 * top_load)
    name, value = min((("rocking", rocking), ("sliding", friction)), key=lambda pair: pair[1])
    details = {"rocking": rocking, "sliding": friction}
    return answer(f"block, {name}", value, ideal_bound=EXACT, details=details, source="statics of one block")


def stack(*, width: float, course_height: float, courses: int, friction: float) -> Prediction:
    """Return collapse of a stack of n equal blocks, at min(f, b/(n h)).

    What lies above joint j from the top rocks at b/(j h), so that the lowest joint governs.

    Parameters
    ----------
    width : b along the load [m]
    course_height : h of a block [m]
    courses : n
    friction : f [-]

    Notes
    -----
    Exact. Source: docs/mechanisms.md, section 8.
    """
    courses = count("courses", courses)
    positive("course_height", course_height)
    whole = rigid_block(width=width, height=courses * course_height, friction=friction)
    details = {"rocking": [width / (j * course_height) for j in range(1, courses + 1)], "sliding": friction}
    return answer(
        whole.method.replace("mechanisms: block", "stack"), whole.collapse_multiplier, ideal_bound=EXACT,
        details=details, source="statics of one block",
    )


def inclined_hinge(
    facade: Facade | Assembly,
    *,
    loads: Loads | None = None,
    side_walls: int | None = None,
    crack_tangent: float | None = None,
) -> Prediction:
    """Return a facade held at its ends that turns about inclined hinges, with no torsion in its joints.

        one side wall    (t/H)(L - H tan(a)/2) / (L - 2 H tan(a)/3)
        two side walls   the same with L/2 in place of L

    Parameters
    ----------
    facade, loads : as in :func:`mechanisms.simple_rocking`
    side_walls : 1 or 2, in place of the facade's
    crack_tangent : tan(a), inclination of the hinges from the vertical [-]; where omitted, the diagonal of the facade
        or, with two side walls, of its half: the multiplier then is 1.5 t/H whatever the length

    Raises
    ------
    InputError
        For a hinge that leaves the facade.
    NotApplicable
        For another number of side walls.

    Notes
    -----
    Derived (docs/mechanisms.md, section 8): the friction-free case of mechanism D with the hinge at the foot. The
    formula is that without overload; one that the facade has is counted. The multiplier falls to t/H as a -> 0. What
    makes a steep hinge dear is the torsion that is left out here (:func:`mechanisms.horizontal_flexure`). It stands for
    the facades of Rondelet's rule.
    """
    seen = read(facade, loads, side_walls=side_walls)
    f = seen.facade
    if f.side_walls not in (1, 2):
        raise NotApplicable(f"side_walls must be 1 or 2, got {f.side_walls}")
    length = f.length if f.side_walls == 1 else 0.5 * f.length
    diagonal = length / f.height
    tangent = diagonal if crack_tangent is None else finite("crack_tangent", crack_tangent)
    if not 0.0 < tangent <= diagonal * (1.0 + ROUNDING):
        raise InputError(f"crack_tangent must be above 0 and at most L/H = {diagonal:g}, got {crack_tangent!r}")
    value = flexure_terms(f, f.courses, radius=0.0).at(tangent)  # friction without an arm resists nothing
    twists: Array | None = None
    warnings: tuple[str, ...] = ()
    if seen.assembly is not None and seen.loads is not None and not (warnings := other_ends(seen)):
        twists = flexure_twists(seen.assembly, seen.loads, foot_level(seen.assembly), tangent)
    details = {"crack_tangent": tangent, "crack_angle_deg": math.degrees(math.atan(tangent)), "diagonal": diagonal}
    return answer(
        f"inclined hinge, {f.side_walls} side wall{'s' if f.side_walls == 2 else ''}", value, **seen._asdict(),
        twists=twists, ideal_bound=THIS_MOTION, details=details, warnings=warnings,
        source="derived (docs/mechanisms.md, section 8)",
    )


def rondelet_thickness(*, length: float, height: float, side_walls: int = 1, divisor: float = 10.0) -> float:
    """Return the thickness by Rondelet's rule for a wall held at its ends [m].

    It may be held at one end or both.

        t = (H/N) L / sqrt(L^2 + H^2), with L/2 in place of L for two side walls

    Parameters
    ----------
    length, height : L and H [m]
    side_walls : 1 or 2
    divisor : N, 8 (strong), 10 or 12 (light)

    Raises
    ------
    InputError
        For sizes that are not positive and other numbers of side walls.

    Notes
    -----
    Recalled from the handbooks, not checked against the treatise (docs/mechanisms.md, section 8). A sizing rule, not a
    collapse load: the rotation about the diagonal gives 1.5 t/H for any L/H and does not imply it.
    """
    choice("side_walls", side_walls, (1, 2))
    for name, value in (("length", length), ("height", height), ("divisor", divisor)):
        positive(name, value)
    run = length / side_walls
    return height / divisor * run / math.hypot(run, height)


def flat_levels(assembly: Assembly) -> list[Level]:
    """Return the flat joints that divide an assembly into a part above and a part below, from the ground up.

    Raises
    ------
    NotApplicable
        When there is none.
    """
    x = assembly.arrays
    slack = _SLACK * assembly.tolerance
    # height of every interface, none for those that are not horizontal
    level_of = np.where(np.abs(x.normal[:, 2]) > 1.0 - ROUNDING, x.centre[:, 2], np.nan)
    low = np.array([b.bounds[0, 2] for b in assembly.blocks])
    high = np.array([b.bounds[1, 2] for b in assembly.blocks])
    levels: list[Level] = []
    for height in np.unique(np.round(level_of[np.isfinite(level_of)] / slack)) * slack:
        moving = low > height - slack
        cut = ~moving & (high > height + slack)
        # held blocks may go up beside the wall; nothing held may ride on it
        if (cut & ~assembly.fixed).any() or (moving & assembly.fixed).any() or not moving.any():
            continue
        # all joints between the two parts must lie on this level: one elsewhere, or upright, would tear or rub
        between = moving[x.block_a] != moving[x.block_b]
        if not between.any() or (np.abs(level_of[between] - height) > slack).any() or np.isnan(level_of[between]).any():
            continue
        rows = np.flatnonzero(between)
        corners = np.concatenate([assembly.interfaces[k].polygon for k in rows])
        levels.append(Level(float(x.centre[rows, 2].mean()), moving, corners, float(x.tan_phi[rows].max())))
    if not levels:
        raise NotApplicable("the assembly has no level joint through it: nothing can overturn or slide in one piece")
    return levels


def _worst_level(
    name: str, assembly: Assembly, loads: Loads, motions: Callable[[Level], list[Array]], source: str
) -> Prediction:
    """Prediction of the level above which a motion has the smallest multiplier.

    Parameters
    ----------
    name : of the mechanism
    assembly, loads : the problem
    motions : twists of all blocks, shape (n_blocks, 6) each, for what lies above a level
    source : of the formula, for the prediction
    """
    best: tuple[float, Level, Array] | None = None
    for level, twists in ((at, moved) for at in flat_levels(assembly) for moved in motions(at)):
        # by virtual work the multiplier is over the power of the live loads: without any there is none
        if not (loads.live * np.where(assembly.held, 0.0, twists)).sum() > 0.0:
            continue
        value = check_contacts(assembly, loads, twists).multiplier
        if best is None or value < best[0] * (1.0 - _EQUAL):
            best = (value, level, twists)
    if best is None:
        raise NotApplicable(f"the live loads do no work in {name}")
    value, level, twists = best
    # a built wall may stand on a held course, from whose top heights count; other assemblies stand on z = 0
    foot = foot_level(assembly) if assembly.recipe.get("kind") == "wall" else 0.0
    details = {"hinge_height": level.height - foot}
    return answer(
        name, value, assembly=assembly, loads=loads, twists=twists, ideal_bound=UPPER_IDEAL, details=details,
        source=source,
    )


def _direction(assembly: Assembly, loads: Loads | None) -> tuple[Loads, Array]:
    """Loads, and the horizontal direction of their live part, a unit vector of shape (3,).

    Parameters
    ----------
    assembly : on whose free blocks the loads act
    loads : None for the weights along -y

    Raises
    ------
    InputError
        For anything but an assembly and loads of as many blocks.
    NotApplicable
        For live loads whose horizontal resultant is zero, up to rounding.
    """
    loads = loads_of(instance("assembly", assembly, Assembly), loads, (0.0, -1.0, 0.0))
    total = loads.live[~assembly.fixed, :3].sum(axis=0) * [1.0, 1.0, 0.0]
    size = np.linalg.norm(total)
    if not size > ROUNDING * np.abs(loads.live).max(initial=1e-300):
        raise NotApplicable("the live loads have no horizontal resultant")
    return loads, total / size
