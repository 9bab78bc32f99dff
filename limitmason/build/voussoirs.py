"""Voussoirs of a circular arch in its plane: joint ends, springings, and whether every one is convex.

``inner`` and ``outer`` are the ends of the joints on intrados and extrados, in x-z from left to right [m], (n + 1, 2).
"""

from __future__ import annotations

import math

import numpy as np

from limitmason.checks import finite, positive
from limitmason.errors import InputError

_SEMICIRCLE_DEG = 180.0
_WIDEST_DEG = 330.0  # angle of embrace, chosen: beyond it the springings of a nearly closed ring come together
_STANDS_OUT = 0.25  # of the joint's length, chosen: how far a held block reaches beyond either end of a springing
_DUST = 1e-12  # of the thickness: coordinates below it are rounding of zero


def circle(radius: object, angle_deg: object, span: object, rise: object) -> tuple[float, float]:
    """Radius [m] and angle of embrace [rad] of the centre line.

    They follow from the pair of arguments that is given; the other pair is None.

    Parameters
    ----------
    radius, angle_deg : of the centre line [m], [deg], a semicircle where no angle is given; or
    span, rise : springing to springing, and springing to crown [m]
    """
    if (span is None) != (rise is None) or (radius is None) == (span is None):
        raise InputError("give radius (and angle_deg), or both span and rise")
    if radius is not None:
        angle = finite("angle_deg", _SEMICIRCLE_DEG if angle_deg is None else angle_deg)
        if not 0.0 < angle < _WIDEST_DEG:
            raise InputError(f"angle_deg must be above 0 and below {_WIDEST_DEG:g}, got {angle_deg!r}")
        return positive("radius", radius), math.radians(angle)
    if angle_deg is not None:
        raise InputError(f"angle_deg goes with radius; span and rise say the angle of embrace, got {angle_deg!r} too")
    half, height = positive("span", span) / 2.0, positive("rise", rise)
    # seen from a springing the crown stands at a quarter of the angle of embrace
    angle = 4.0 * math.atan2(height, half)
    if angle >= math.radians(_WIDEST_DEG):
        raise InputError(f"rise {height:g} m is too large for a span of {2.0 * half:g} m")
    return (half**2 + height**2) / (2.0 * height), angle


def circle_facts(radius: float, angle: float) -> dict[str, float]:
    """What a recipe says of a circular centre line.

    Its radius, angle of embrace [deg], span and rise [m].

    Parameters
    ----------
    radius, angle : of the centre line [m], and of embrace [rad]
    """
    return {
        "radius": radius, "angle_deg": math.degrees(angle), "span": 2.0 * radius * math.sin(angle / 2.0),
        "rise": radius - radius * math.cos(angle / 2.0),
    }


def circular_joints(radius: float, angle: float, thickness: float, voussoirs: int) -> tuple[np.ndarray, np.ndarray]:
    """Inner and outer ends of the radial joints of a circular arch.

    Both are in x-z from left to right [m], shape (n + 1, 2); the springings of the centre line are at z = 0.

    Parameters
    ----------
    radius : of the centre line [m]
    angle : of embrace [rad]
    thickness : radial [m]
    voussoirs : their number n
    """
    if thickness >= 2.0 * radius:
        raise InputError(f"thickness {thickness:g} m leaves no intrados at a centre-line radius of {radius:g} m")
    theta = np.linspace(-angle / 2.0, angle / 2.0, voussoirs + 1)
    direction = np.column_stack([np.sin(theta), np.cos(theta)])
    # from the circle's centre to the level of the springings
    drop = np.array([0.0, radius * math.cos(angle / 2.0)])
    inner, outer = ((radius + side * thickness / 2.0) * direction - drop for side in (-1.0, 1.0))
    return snapped(inner, thickness), snapped(outer, thickness)


def outlines_between(inner: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """Outlines of the voussoirs between successive joints in x-z [m], shape (n, 4, 2).

    Corners run from the left joint's inner end along the intrados and back along the extrados.

    Parameters
    ----------
    inner, outer : ends of the joints on intrados and extrados in x-z [m], shape (n + 1, 2), from left to right

    Raises
    ------
    InputError
        For a voussoir that is not convex, by its number from 1 at the left.
    """
    outlines = np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], axis=1)
    for k, outline in enumerate(outlines):
        side = np.roll(outline, -1, axis=0) - outline
        following = np.roll(side, -1, axis=0)
        # counter-clockwise and convex: at every corner the outline turns left
        turn = side[:, 0] * following[:, 1] - side[:, 1] * following[:, 0]
        if (turn <= 0.0).any():
            raise InputError(
                f"voussoir {k + 1} is not convex or has no area: its joints cross, or intrados and extrados are "
                "swapped or not given from left to right"
            )
    return outlines


def snapped(curve: np.ndarray, thickness: float) -> np.ndarray:
    """Points with rounding dust made zero [m], shape (n, 2).

    The springings of a semicircle are then exactly level.

    Parameters
    ----------
    curve : the points [m], shape (n, 2)
    thickness : of the arch [m], beside which dust is small
    """
    return np.where(np.abs(curve) < _DUST * thickness, 0.0, curve)


def springing(inner: np.ndarray, outer: np.ndarray, depth: float, *, left: bool) -> np.ndarray:
    """Outline of the held block behind a springing joint [m], shape (4, 2).

    Its corners run counter-clockwise in x-z. The block stands out by a quarter of the joint's length beyond both ends.

    Parameters
    ----------
    inner, outer : ends of the joint on intrados and extrados [m], shape (2,)
    depth : thickness of the block behind the joint [m]
    left : whether it is the left springing of the arch
    """
    along = outer - inner
    size = float(np.linalg.norm(along))
    along = along / size
    # unit normal of the joint, away from the arch
    out = np.array([-along[1], along[0]]) if left else np.array([along[1], -along[0]])
    near, far = inner - _STANDS_OUT * size * along, outer + _STANDS_OUT * size * along
    corners = [near, far, far + depth * out, near + depth * out]
    # on the right the same order would run clockwise
    return np.array(corners if left else [corners[1], corners[0], corners[3], corners[2]])
