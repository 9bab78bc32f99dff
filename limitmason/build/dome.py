"""Domes of voussoirs: a circular meridian turned about the vertical axis, cut by cones and by meridian planes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from limitmason.arrays import Array
from limitmason.build.erect import Site
from limitmason.checks import count, finite, positive
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint

_DUST = 1e-12  # of the radius, and of an angle [rad]: rounding of zero
_STANDS_OUT = 0.25  # of the thickness, chosen: how far the held ring reaches beyond the springing on both sides

# faces by numbers of corners: lower joint inside (first, second meridian), outside; then the upper joint
_VOUSSOIR = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def dome(
    *,
    radius: float,
    thickness: float,
    courses: int,
    lunes: int,
    joint: Joint,
    springing_deg: float = 90.0,
    opening_deg: float = 0.0,
    density: float = 2000.0,
    joints: Mapping | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Return a dome of voussoirs on a held ring.

    Joints on cones about the axis and in meridian planes.

    Parameters
    ----------
    radius
        Of the middle surface [m].
    thickness
        Radial [m].
    courses
        Rings of voussoirs between springing and crown, without the keystone.
    lunes
        Voussoirs in a ring, 4 or more.
    springing_deg
        Angle between axis and springing [deg], up to 90: a hemisphere.
    opening_deg
        The same for the edge of an oculus [deg]; 0 closes the dome with one keystone, which takes the place of a
        further course.
    joint, density, joints, tolerance
        As in `wall`.

    Returns
    -------
    Assembly
        Held block "base", then "voussoir-02-05" (course from the springing, lune), last "keystone". The axis is over
        x = y = 0, the middle of the springing joints at z = 0.

    Raises
    ------
    InputError
        Naming the argument that is wrong.

    Notes
    -----
    Faces are plane: every ring is a regular polygon with its corners on the circles of the sphere, so that the dome
    lies inside the sphere by 1 - cos(pi / lunes) of the radius at most. Meridian joints run from springing to crown
    without bond, as a dome's cracks do: a dome whose stones lap holds a ring by friction, this one does not.
    """
    r, depth = positive("radius", radius), positive("thickness", thickness)
    rings, n = count("courses", courses), count("lunes", lunes, 4)
    positive("density", density)
    foot, edge = math.radians(finite("springing_deg", springing_deg)), math.radians(finite("opening_deg", opening_deg))
    if depth >= 2.0 * r:
        raise InputError(f"thickness {depth:g} m leaves no intrados at a radius of {r:g} m")
    # angles from the axis, so that the edge of the oculus has the smaller one
    if not 0.0 <= edge < foot <= 0.5 * math.pi + _DUST:
        raise InputError(
            f"springing_deg and opening_deg must satisfy 0 <= opening < springing <= 90, got {springing_deg!r} and "
            f"{opening_deg!r}"
        )
    inside, outside = r - 0.5 * depth, r + 0.5 * depth
    # angles of the bed joints from the axis; a closed dome has one course more, whose place the keystone takes
    theta = np.linspace(foot, edge, rings + (2 if edge == 0.0 else 1))[: rings + 1]
    lift = r * math.cos(foot)
    phi = 2.0 * math.pi * np.arange(n + 1) / n
    # the last meridian is the first to the last bit
    phi[-1] = 0.0

    def at(radius: float, colatitude: float, meridian: float) -> Array:
        """Place of a point [m], shape (3,), by its polar coordinates.

        They are the distance from the sphere's centre [m] and two angles [rad].
        """
        across, up = radius * math.sin(colatitude), radius * math.cos(colatitude)
        place = np.array([across * math.cos(meridian), across * math.sin(meridian), up - lift])
        return np.where(np.abs(place) < _DUST * r, 0.0, place)

    def voussoir(low: float, high: float, j: int, near: float, far: float) -> Solid:
        """Stone of lune j between two bed joints and two radii.

        Bed joints are given by angles from the axis [rad], radii in m.
        """
        corners = [at(s, t, m) for t in (low, high) for s in (near, far) for m in (phi[j], phi[j + 1])]
        return Solid(np.array(corners), _VOUSSOIR)

    site = Site(density)
    # the held ring goes on below the springing, as high as the dome is thick
    below = foot + depth / r
    wider = _STANDS_OUT * depth
    if inside <= wider:
        raise InputError(f"thickness {depth:g} m leaves no room within the held ring at a radius of {r:g} m")
    ring = [voussoir(below, foot, j, inside - wider, outside + wider) for j in range(n)]
    site.add("base", ring, fixed=True)
    digits = max(2, len(str(rings)), len(str(n)))
    for k in range(rings):
        for j in range(n):
            middle = 0.5 * (2 * j + 1) * 2.0 * math.pi / n
            # a unit's length runs round the ring
            axis = (-math.sin(middle), math.cos(middle), 0.0)
            name = f"voussoir-{k + 1:0{digits}d}-{j + 1:0{digits}d}"
            site.add(name, voussoir(theta[k], theta[k + 1], j, inside, outside), axis=axis)
    if edge == 0.0:
        rim = np.array([at(s, theta[-1], m) for s in (inside, outside) for m in phi[:-1]])
        sides = tuple((j, (j + 1) % n, n + (j + 1) % n, n + j) for j in range(n))
        # below, seen from outside, the rim runs the other way round
        faces = (tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)), *sides)
        site.add("keystone", Solid(rim, faces))
    recipe = {
        "kind": "dome", "radius": r, "thickness": depth, "courses": rings, "lunes": n,
        "springing_deg": math.degrees(foot), "opening_deg": math.degrees(edge), "density": float(density),
    }
    return site.assembly(joint, recipe, joints=joints, tolerance=tolerance)
