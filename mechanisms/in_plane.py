"""In-plane rocking of a running-bond wall about its toe along a crack that steps through the bond."""

from __future__ import annotations

import math

import numpy as np

from limitmason.answers.results import Bound, BoundKind, Prediction
from limitmason.arrays import Array
from limitmason.checks import count, not_negative, positive
from limitmason.errors import NotApplicable
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from mechanisms.built_wall import at_origin, foot_level, wall_recipe
from mechanisms.parameters import ROUNDING, Facade, load_direction, loads_of, read
from mechanisms.velocity_field import ESTIMATE, UPPER_IDEAL, above, answer, rotation
from mechanisms.virtual_work_check import ContactCheck, check_contacts

BEDS_ONLY = Bound(
    BoundKind.UPPER,
    "upper without head-joint contact only: the motion is admissible on the bed joints; head joints rub in it and "
    "raise associative limit analysis",
)
SOURCE = "derived (docs/mechanisms.md, section 8)"

_STARTS = 4
"""Places of the crack's foot that are tried, half a staggering apart from the toe on; chosen."""
_JUST_ABOVE = 1e-6  # [m]: a block whose centroid is on a level does not lie above it


def stepped_crack(wall: Facade | Assembly, *, loads: Loads | None = None) -> Prediction:
    """Return in-plane rocking of the wall above a crack that steps in every course.

    The crack starts at the toe.

        (v/2h)(4n + 2)/(4n - 1)               n courses, bottom course ending at the toe with a half unit, n v <= B
        (B/H)(1 - 2b/3)/(1 - b^2/3)           small blocks, b = B h/(H v) < 1

    v is the staggering of head joints, h the height of a course, B the length and H the height of the wall [m], f the
    friction coefficient.

    For an assembly the staircases of its own blocks are tried, from every bed joint up, and the best admissible one is
    returned with its power balance.

    Parameters
    ----------
    wall : numbers of a wall without side walls (its length is B), or an assembly
    loads : of the assembly, weights along +x or -x; +x where omitted

    Returns
    -------
    Prediction
        ``details``: slope v/h, crack_angle_deg, friction_limit (the largest f for which it is an upper bound).

    Raises
    ------
    NotApplicable
        For walls with side walls or openings, loads out of plane, and a Facade with an overload.

    Notes
    -----
    For f = v/h exact (confirmed by a static linear program in docs/mechanisms.md) where head joints do not touch; for
    f < v/h an upper bound; for f > v/h associated limit analysis lies *above* it, since opening = f slip is violated
    on the steps. Head-joint friction raises the associated value too.
    """
    if isinstance(wall, Assembly):
        return _on_blocks(wall, loads)
    f = read(wall, loads).facade
    _straight(f.side_walls, "side_walls")
    _bare(f)
    n, slope = f.courses, f.slope
    if n * f.staggering <= f.length * (1.0 + ROUNDING):  # the crack ends in the top, not in the far side
        value = 0.5 * slope * (4 * n + 2) / (4 * n - 1)
        shape = "whole courses"
    else:
        value = slender_wall(f.length, f.height, slope)
        shape = "small blocks"
    bound = UPPER_IDEAL if f.friction <= slope * (1.0 + ROUNDING) else ESTIMATE
    return answer(
        f"stepped crack in plane, {shape}", value, facade=f, ideal_bound=bound, details=_details(slope), source=SOURCE
    )


def sloping_crack(wall: Facade | Assembly, *, loads: Loads | None = None) -> Prediction:
    """Return in-plane rocking along a crack of the worst inclination.

    Its bed joints have prescribed friction.

        lambda = sqrt(k f v/h) - k f/2 at tan(alpha) = sqrt(k f v/h),  k = 1 - 1/n^2,   f <= v/h
        lambda = v/(2h) at tan(alpha) = v/h,                                            f >= v/h

    Parameters
    ----------
    wall, loads : as in :func:`stepped_crack`

    Raises
    ------
    NotApplicable
        Where the crack would leave the wall, H tan(alpha) > B, and for an overload, which the formula does not know.

    Notes
    -----
    Small blocks in the crack's outline, n courses in the friction sum. The same friction hypothesis as mechanism B, so
    an estimate and no value of limit analysis: programs without head-joint contact still fall below 0.4628 at n = 16
    where this gives 0.4812 (v/h = 1, f = 0.65). Source: derived, docs/mechanisms.md, section 8.
    """
    if isinstance(wall, Assembly):
        loads = _in_plane(wall, loads)[0]
    seen = read(wall, loads)
    f = seen.facade
    _straight(f.side_walls, "side_walls")
    _bare(f)
    value, tangent = sloping_crack_limit(f.friction, f.slope, f.courses)
    if f.height * tangent > f.length * (1.0 + ROUNDING):
        raise NotApplicable(
            f"length {f.length:g} m is less than H tan(alpha) = {f.height * tangent:g} m: the crack leaves the wall"
        )
    details = _details(f.slope, tangent)
    return answer(
        "sloping crack in plane", value, **seen._asdict(), ideal_bound=ESTIMATE, details=details, source=SOURCE
    )


def sloping_crack_limit(friction: float, slope: float, courses: int | None = None) -> tuple[float, float]:
    """Return multiplier and tan(alpha) of :func:`sloping_crack`.

    Parameters
    ----------
    friction, slope : f and v/h [-]
    courses : n; very many where omitted, so that k = 1

    Returns
    -------
    multiplier, tangent : lambda and tan(alpha) [-]
    """
    f, slope = not_negative("friction", friction), positive("slope", slope)
    if courses is not None:
        f *= 1.0 - 1.0 / count("courses", courses) ** 2
    if f >= slope:  # the crack cannot be steeper than the bond
        return 0.5 * slope, slope
    return math.sqrt(f * slope) - 0.5 * f, math.sqrt(f * slope)


def slender_wall(width: float, height: float, slope: float) -> float:
    """Return the stepped-crack multiplier of a slender wall in small blocks, (B/H)(1 - 2b/3)/(1 - b^2/3).

    Parameters
    ----------
    width, height : B and H [m]
    slope : v/h [-]; b = B/(H v/h) must not exceed 1

    Raises
    ------
    NotApplicable
        When the wall is not slender.
    """
    for name, value in (("width", width), ("height", height), ("slope", slope)):
        positive(name, value)
    b = width / (height * slope)
    if b > 1.0 + ROUNDING:
        raise NotApplicable(
            f"width {width:g} m exceeds H v/h = {height * slope:g} m: the crack ends in the top, not the side"
        )
    return width / height * (1.0 - 2.0 * b / 3.0) / (1.0 - b * b / 3.0)


def _on_blocks(wall: Assembly, loads: Loads | None) -> Prediction:
    """Smallest stepped crack that blocks and bed joints of a straight wall admit.

    Parameters
    ----------
    wall : straight, from ``build.wall`` or ``layout``
    loads : in its plane; weights along +x where omitted
    """
    wall = at_origin(wall)
    loads, sense = _in_plane(wall, loads)
    f = Facade.from_assembly(wall, loads)
    toe = f.length if sense > 0 else 0.0
    foot, top = foot_level(wall), wall.recipe["height"]
    from_toe, z = (toe - wall.centroids[:, 0]) * sense, wall.centroids[:, 2]
    # head joints rub in this motion: the bound is that of the bed joints alone, as it says
    beds = wall.with_interfaces([i for i in wall.interfaces if i.kind != "head"])
    best: tuple[ContactCheck, Array, float] | None = None
    for course in range(f.courses):
        level = foot + course * f.course_height
        for start in range(_STARTS):
            # blocks move whose centroids lie before a line that rises by v/h: from the toe it meets that of a half unit
            reach = 0.5 * start * f.staggering + (np.minimum(z, top) - level) * f.slope
            moving = above(wall, level + _JUST_ABOVE) & (from_toe <= reach + ROUNDING * f.length)
            if not moving.any():
                continue
            twists = rotation(wall, moving, (toe, 0.0, level), (0.0, float(sense), 0.0))
            check = check_contacts(beds, loads, twists)
            if check.admissible and (best is None or check.multiplier < best[0].multiplier):
                best = (check, twists, level)
    if best is None:
        raise NotApplicable(
            f"no staircase through these blocks opens its bed joints as the law asks (friction {f.friction:.3g}, "
            f"v/h {f.slope:.3g}): the closed form for numbers is an estimate then"
        )
    check, twists, level = best
    details = {**_details(f.slope), "hinge_height": level - foot}
    return answer(
        "stepped crack in plane", check.multiplier, facade=f, assembly=wall, loads=loads, twists=twists,
        ideal_bound=BEDS_ONLY, details=details, source=SOURCE,
    )


def _details(slope: float, tangent: float | None = None) -> dict[str, float]:
    """Geometry of a crack by name: the bond's slope v/h and the crack's own tan(alpha), by default the same [-]."""
    tangent = slope if tangent is None else tangent
    angle = math.degrees(math.atan(tangent))
    return {"slope": slope, "crack_tangent": tangent, "crack_angle_deg": angle, "friction_limit": slope}


def _in_plane(wall: Assembly, loads: Loads | None) -> tuple[Loads, int]:
    """Loads in the plane of a straight wall without openings, and their sense along x, 1 or -1.

    All other walls and loads are refused. Without ``loads`` they are the weights along +x.
    """
    recipe = wall_recipe(wall)
    _straight(len(recipe["returns"]), "the assembly's side walls")
    _straight(len(recipe["openings"]), "the assembly's openings")
    loads = loads_of(wall, loads, (1.0, 0.0, 0.0))
    axis, sense = load_direction(wall, loads)
    if axis != "x":
        raise NotApplicable("loads must be in the plane of the wall: Loads.horizontal(wall, (1, 0, 0))")
    return loads, sense


def _straight(number: int, what: str) -> None:
    """Refuse a wall that has any of what ``what`` says, side walls or openings."""
    if number:
        raise NotApplicable(f"{what} must be 0: the in-plane crack is that of a straight wall without openings")


def _bare(f: Facade) -> None:
    """Refuse a wall with an overload, which the closed forms of in-plane cracks do not know."""
    if f.overload or f.side_overload:
        raise NotApplicable("overload must be 0: the closed form of the in-plane crack is that of the weight alone")
