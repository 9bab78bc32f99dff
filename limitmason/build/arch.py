"""Arches of voussoirs: circular by radius and embrace or by span and rise, pointed, or between two given curves.

``inner`` and ``outer`` are the ends of the joints on intrados and extrados, in x-z from left to right [m], (n + 1, 2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from limitmason.build.erect import Site
from limitmason.build.voussoirs import circle, circle_facts, circular_joints, outlines_between, snapped, springing
from limitmason.checks import choice, count, positive
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import prism
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint

_SHAPES = ("circular", "pointed")


def arch(
    *,
    thickness: float,
    width: float,
    voussoirs: int,
    joint: Joint,
    radius: float | None = None,
    angle_deg: float = 180.0,
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
        Radius of the centre line [m] and angle of embrace [deg], above 0 and below 330; or
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
        if radius is not None or span is None or rise is None:
            raise InputError("a pointed arch is given by span and rise, not by radius")
        inner, outer, facts = _pointed(positive("span", span), positive("rise", rise), depth, number)
    else:
        r, angle = circle(radius, angle_deg, span, rise)
        inner, outer = circular_joints(r, angle, depth, number)
        facts = circle_facts(r, angle)
    return _erect(
        inner, outer, depth, {"shape": shape, **facts, "thickness": depth}, width=width, joint=joint, density=density,
        piers=(pier_height, pier_width, pier_courses), joints=joints, tolerance=tolerance,
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
    inner, outer = np.asarray(intrados, dtype=float), np.asarray(extrados, dtype=float)
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
        inner, outer, first, recipe, width=width, joint=joint, density=density, joints=joints, tolerance=tolerance
    )


def _pointed(span: float, rise: float, thickness: float, voussoirs: int) -> tuple[np.ndarray, np.ndarray, dict]:
    """Joint ends of two arcs whose centres lie on the springing line; the crown joint is vertical.

    Returned are points of intrados and extrados from left to right [m], shape (n + 1, 2), and what the recipe keeps.

    Parameters
    ----------
    span, rise, thickness, voussoirs : of the centre line [m], [m], [m] and their even number
    """
    half = span / 2.0
    if voussoirs % 2:
        raise InputError(f"voussoirs must be even for a pointed arch, got {voussoirs}")
    if rise <= half:
        raise InputError(f"rise {rise:g} m of a pointed arch must exceed half its span ({half:g} m)")
    radius = (half**2 + rise**2) / (2.0 * half)
    centre = radius - half
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
        curve[-1] = 0.0, math.sqrt(r**2 - centre**2)
        sides.append(np.vstack([curve, curve[-2::-1] * [-1.0, 1.0]]))
    return snapped(sides[0], thickness), snapped(sides[1], thickness), {"radius": radius, "span": span, "rise": rise}


def _erect(
    inner: np.ndarray, outer: np.ndarray, held: float, recipe: dict, *, width: float, joint: Joint, density: float,
    joints: Mapping | None, tolerance: float | None, piers: tuple[float | None, float | None, int] = (None, None, 1),
) -> Assembly:
    """Assembly of voussoirs between points of two curves, on piers where asked for; held blocks are ``held`` thick.

    Parameters
    ----------
    width, density, tolerance : along y [m], [kg/m3], and of contacts [m]
    recipe : what is told of the arch
    joints : joint laws by kind
    piers : height [m], width [m] and number of courses; None for springings on held blocks
    """
    wide = positive("width", width)
    positive("density", density)
    number = len(inner) - 1
    outlines = outlines_between(inner, outer)
    site = Site(density)
    pier_height, pier_width, pier_courses = piers
    if pier_height is None:
        for name, given, default in (("pier_width", pier_width, None), ("pier_courses", pier_courses, 1)):
            if given != default:
                raise InputError(f"{name} is given but pier_height is not")
        for side, end in (("left", 0), ("right", -1)):
            outline = springing(inner[end], outer[end], held, left=side == "left")
            site.add(f"base-{side}", prism(outline, 0.0, wide), fixed=True)
    else:
        tall = positive("pier_height", pier_height)
        _add_piers(site, inner, outer, wide, tall, pier_width, count("pier_courses", pier_courses), held)
    for k in range(number):
        # a voussoir's bed joints are radial; the course, and so the length of the unit, runs along the width
        site.add(f"voussoir-{k + 1}", prism(outlines[k], 0.0, wide), axis=(0.0, 1.0, 0.0))
    recipe = {
        "kind": "arch", **recipe, "width": wide, "voussoirs": number, "keystone": number % 2 == 1,
        "pier_height": pier_height,
        "pier_width": None if pier_height is None else (float(pier_width) if pier_width else recipe["thickness"]),
        "pier_courses": pier_courses if pier_height is not None else None, "density": float(density),
    }
    return site.assembly(joint, recipe, joints=joints, tolerance=tolerance)


def _add_piers(
    site: Site, inner: np.ndarray, outer: np.ndarray, width: float, height: float, pier_width: float | None,
    courses: int, held: float,
) -> None:
    """Courses of two piers below the springings, and the base that holds them.

    Parameters
    ----------
    width, height, pier_width : along y, of the piers, and along x [m], that of the joint where None
    held : thickness of the base [m]
    courses : of each pier
    """
    joint = abs(outer[0, 0] - inner[0, 0])
    level = max(abs(outer[0, 1] - inner[0, 1]), abs(outer[-1, 1] - inner[-1, 1]), abs(inner[0, 1] - inner[-1, 1]))
    if level > 1e-9 * joint:
        raise InputError("pier_height: piers need level springings (angle_deg of 180, or a pointed arch)")
    broad = joint if pier_width is None else positive("pier_width", pier_width)
    if broad < joint * (1.0 - 1e-9):
        raise InputError(f"pier_width {broad:g} m is less than the thickness of the arch ({joint:g} m)")
    top = float(inner[0, 1])
    near, far = float(inner[0, 0]), float(inner[-1, 0])
    xs = {"left": (near - broad, near), "right": (far, far + broad)}
    foot = top - height
    x0, x1 = xs["left"][0] - broad / 2.0, xs["right"][1] + broad / 2.0
    site.add_box("base", ((x0, 0.0, foot - held), (x1, width, foot)), fixed=True)
    for side, (a, b) in xs.items():
        for k in range(courses):
            low, high = foot + height * k / courses, top if k == courses - 1 else foot + height * (k + 1) / courses
            site.add_box(f"pier-{side}-{k + 1}", ((a, 0.0, low), (b, width, high)), axis=0)
