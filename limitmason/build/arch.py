"""Arches of voussoirs: circular by radius and embrace or by span and rise, pointed, or between two given curves.

``inner`` and ``outer`` are the ends of the joints on intrados and extrados, in x-z from left to right [m], (n + 1, 2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from limitmason.build.erect import Site
from limitmason.build.voussoirs import circle, circle_facts, circular_joints, outlines_between, snapped, springing
from limitmason.checks import choice, count, numbers, positive
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import prism
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint

_SHAPES = ("circular", "pointed")
_LEVEL = 1e-9  # of the springing joint's length: what is level, or as wide, up to rounding


class _Piers(NamedTuple):
    """Piers of an arch as given.

    Height and width [m], None for no piers and for the arch's thickness, and the number of courses of each.
    """

    height: float | None = None
    width: float | None = None
    courses: int = 1


def arch(
    *,
    thickness: float,
    width: float,
    voussoirs: int,
    joint: Joint,
    radius: float | None = None,
    angle_deg: float | None = None,
    span: float | None = None,
    rise: float | None = None,
    shape: str = "circular",
    density: float = 2000.0,
    pier_height: float | None = None,
    pier_width: float | None = None,
    pier_courses: int = 1,
    joints: Mapping | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Return an arch of voussoirs with radial joints, on held springings or on piers.

    It lies in the x-z plane.

    Parameters
    ----------
    thickness, width
        Radial thickness, and extent along y [m].
    voussoirs
        Their number; odd numbers have a keystone. A pointed arch needs an even number.
    radius, angle_deg
        Radius of the centre line [m] and angle of embrace [deg], above 0 and below 330, default 180; or
    span, rise
        of the centre line, springing to springing and springing to crown [m].
    shape
        "circular", or "pointed": two arcs with centres on the springing line, `rise` above half the span.
    pier_height, pier_width, pier_courses
        Piers under horizontal springings [m]: inner face flush with the intrados, equal blocks. They stand on a held
        slab "base". Without piers two held blocks "base-left" and "base-right" take the springings.
    joint, joints, density, tolerance
        As in `wall`.

    Returns
    -------
    Assembly
        Held blocks first, then "pier-left-1" ... from the ground up, then "voussoir-1" ... from left to right.
        The crown lies over x = 0; the springings' centres are at z = 0.

    Raises
    ------
    InputError
        Naming the argument that is wrong.

    Notes
    -----
    Voussoirs have plane faces between their joints: the volume of a circular one is W/2 sin(beta) (Ro^2 - Ri^2), beta
    the angle of a voussoir, W the width; a sector has beta in place of sin(beta).
    """
    choice("shape", shape, _SHAPES)
    number = count("voussoirs", voussoirs)
    depth = positive("thickness", thickness)
    if shape == "pointed":
        if radius is not None or angle_deg is not None or span is None or rise is None:
            raise InputError("a pointed arch is given by span and rise, not by radius and angle_deg")
        inner, outer, facts = _pointed(positive("span", span), positive("rise", rise), depth, number)
    else:
        r, angle = circle(radius, angle_deg, span, rise)
        inner, outer = circular_joints(r, angle, depth, number)
        facts = circle_facts(r, angle)
    return _erect(
        inner, outer, depth, {"shape": shape, **facts, "thickness": depth}, width=width, joint=joint, density=density,
        piers=_Piers(pier_height, pier_width, pier_courses), joints=joints, tolerance=tolerance,
    )


def arch_from_curves(
    intrados: np.ndarray,
    extrados: np.ndarray,
    *,
    width: float,
    joint: Joint,
    density: float = 2000.0,
    joints: Mapping | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Return an arch whose joints connect corresponding points of two curves.

    The profile and the stereotomy are free.

    Parameters
    ----------
    intrados, extrados
        Joint ends in the x-z plane [m], shape (n + 1, 2) each for n voussoirs, from left to right.
    width, joint, density, joints, tolerance
        As in `arch`. The held blocks are as thick as the first joint is long.

    Raises
    ------
    InputError
        Curves of different length, fewer than two points, or a voussoir that is not convex, named by its number.
    """
    inner, outer = numbers("intrados", intrados), numbers("extrados", extrados)
    if inner.ndim != 2 or inner.shape != outer.shape or inner.shape[1] != 2 or len(inner) < 2:
        raise InputError(
            f"intrados and extrados must both have shape (n + 1, 2) with n of at least 1, "
            f"got {inner.shape} and {outer.shape}"
        )
    if not (np.isfinite(inner).all() and np.isfinite(outer).all()):
        raise InputError("intrados and extrados must be finite")
    middle = 0.5 * (inner + outer)
    recipe = {
        "shape": "curves", "span": float(middle[-1, 0] - middle[0, 0]),
        "rise": float(middle[:, 1].max() - 0.5 * (middle[0, 1] + middle[-1, 1])),
        "thickness": float(np.linalg.norm(outer - inner, axis=1).min()),
        "intrados": inner.tolist(), "extrados": outer.tolist(),
    }
    first = float(np.linalg.norm(outer[0] - inner[0]))
    return _erect(
        inner, outer, first, recipe, width=width, joint=joint, density=density, piers=_Piers(), joints=joints,
        tolerance=tolerance,
    )


def _pointed(span: float, rise: float, thickness: float, voussoirs: int) -> tuple[np.ndarray, np.ndarray, dict]:
    """Joint ends of two arcs whose centres lie on the springing line.

    The crown joint is vertical.

    Parameters
    ----------
    span, rise : of the centre line, springing to springing and springing to crown [m]
    thickness : radial [m]
    voussoirs : their even number n

    Returns
    -------
    inner, outer : ends of the joints on intrados and extrados in x-z from left to right [m], shape (n + 1, 2)
    facts : radius, span and rise of the centre line [m], for the recipe
    """
    half = span / 2.0
    if voussoirs % 2:
        raise InputError(f"voussoirs must be even for a pointed arch, got {voussoirs}")
    if rise <= half:
        raise InputError(f"rise {rise:g} m of a pointed arch must exceed half its span ({half:g} m)")
    # the circle of the left arc passes through its springing (-half, 0) and the crown (0, rise)
    radius = (half**2 + rise**2) / (2.0 * half)
    centre = radius - half
    # the intrados arcs must reach the plane of symmetry
    if radius - thickness / 2.0 <= centre:
        raise InputError(f"thickness {thickness:g} m leaves no intrados at the crown")
    crown = math.atan2(rise, -centre)
    phi = np.linspace(math.pi, crown, voussoirs // 2 + 1)
    sides = []
    for r in (radius - thickness / 2.0, radius + thickness / 2.0):
        curve = np.column_stack([centre + r * np.cos(phi), r * np.sin(phi)])
        if (curve[:-1, 0] >= 0.0).any():
            raise InputError(
                f"voussoirs: {voussoirs} are too many for a thickness of {thickness:g} m; joints cross at the crown"
            )
        # the last joint is vertical for both arcs, not radial to either
        curve[-1] = 0.0, math.sqrt(r**2 - centre**2)
        sides.append(np.vstack([curve, curve[-2::-1] * [-1.0, 1.0]]))  # from the crown on its mirror image
    return snapped(sides[0], thickness), snapped(sides[1], thickness), {"radius": radius, "span": span, "rise": rise}


def _erect(
    inner: np.ndarray, outer: np.ndarray, held: float, recipe: dict, *, width: float, joint: Joint, density: float,
    joints: Mapping | None, tolerance: float | None, piers: _Piers,
) -> Assembly:
    """Assembly of voussoirs between points of two curves, on held blocks or on piers.

    Parameters
    ----------
    inner, outer : ends of the joints on intrados and extrados in x-z from left to right [m], shape (n + 1, 2)
    held : thickness of the held blocks [m]
    recipe : what is told of the arch, to which this adds
    width : along y [m]
    joint, joints : law of every joint, and laws by kind or pair of block names that go before it
    density : [kg/m3]
    tolerance : gap up to which faces touch [m]; None for the default
    piers : under the springings, or none
    """
    wide = positive("width", width)
    positive("density", density)
    number = len(inner) - 1
    outlines = outlines_between(inner, outer)
    site = Site(density)
    if piers.height is None:
        for name, given, default in (("pier_width", piers.width, None), ("pier_courses", piers.courses, 1)):
            if given != default:
                raise InputError(f"{name} is given but pier_height is not")
        for side, end in (("left", 0), ("right", -1)):
            outline = springing(inner[end], outer[end], held, left=side == "left")
            site.add(f"base-{side}", prism(outline, y0=0.0, y1=wide), fixed=True)
    else:
        tall = positive("pier_height", piers.height)
        _add_piers(site, inner, outer, wide, tall, piers.width, count("pier_courses", piers.courses), held)
    for k in range(number):
        # a voussoir's bed joints are radial; the course, and so the length of the unit, runs along the width
        site.add(f"voussoir-{k + 1}", prism(outlines[k], y0=0.0, y1=wide), axis=(0.0, 1.0, 0.0))
    recipe = {
        "kind": "arch", **recipe, "width": wide, "voussoirs": number, "keystone": number % 2 == 1,
        "pier_height": piers.height,
        "pier_width": None if piers.height is None else (float(piers.width) if piers.width else recipe["thickness"]),
        "pier_courses": piers.courses if piers.height is not None else None, "density": float(density),
    }
    return site.assembly(joint, recipe, joints=joints, tolerance=tolerance)


def _add_piers(
    site: Site, inner: np.ndarray, outer: np.ndarray, width: float, height: float, pier_width: float | None,
    courses: int, held: float,
) -> None:
    """Add the courses of two piers below the springings, and the held base under both.

    Parameters
    ----------
    site : to which blocks are added
    inner, outer : ends of the joints on intrados and extrados in x-z from left to right [m], shape (n + 1, 2)
    width : of the arch and the piers, along y [m]
    height : of the piers [m]
    pier_width : of the piers, along x [m]; that of the springing joint where None
    courses : of each pier
    held : thickness of the base [m]
    """
    joint_width = abs(outer[0, 0] - inner[0, 0])  # of the springing
    slope = max(abs(outer[0, 1] - inner[0, 1]), abs(outer[-1, 1] - inner[-1, 1]), abs(inner[0, 1] - inner[-1, 1]))
    if slope > _LEVEL * joint_width:
        raise InputError("pier_height: piers need level springings (angle_deg of 180, or a pointed arch)")
    broad = joint_width if pier_width is None else positive("pier_width", pier_width)
    if broad < joint_width * (1.0 - _LEVEL):
        raise InputError(f"pier_width {broad:g} m is less than the thickness of the arch ({joint_width:g} m)")
    top = float(inner[0, 1])
    near, far = float(inner[0, 0]), float(inner[-1, 0])
    xs = {"left": (near - broad, near), "right": (far, far + broad)}
    foot = top - height
    # chosen: the base stands out by half a pier on both sides
    x0, x1 = xs["left"][0] - broad / 2.0, xs["right"][1] + broad / 2.0
    site.add_box("base", ((x0, 0.0, foot - held), (x1, width, foot)), fixed=True)
    for side, (a, b) in xs.items():
        for k in range(courses):
            low = foot + height * k / courses
            # the last one meets the springing to the last bit
            high = top if k == courses - 1 else foot + height * (k + 1) / courses
            site.add_box(f"pier-{side}-{k + 1}", ((a, 0.0, low), (b, width, high)), axis=0)
