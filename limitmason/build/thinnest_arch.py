"""Minimum thickness of a circular arch under its own weight: the thrust line as a linear program, solved by bisection.

A direct calculation on joints and weights that needs no assembly and no solver of the limit package; the limit analysis
of the assembly that `arch` builds must reproduce it (`voussoir_shape="chord"`).
"""

from __future__ import annotations

import numpy as np

from limitmason.checks import choice, count, finite, positive
from limitmason.errors import InputError, NotConverged

_SHAPES = ("chord", "sector")


def arch_minimum_thickness(
    *,
    voussoirs: int = 60,
    angle_deg: float = 180.0,
    radius: float = 1.0,
    voussoir_shape: str = "chord",
) -> float:
    """Return the least thickness at which a circular arch carries its own weight.

    Its joints are radial.

    Joints carry no tension, do not slide and do not crush. With F_i = (H, V - sum W_k) the force across joint i and
    K_i its moment about the centre of the arch, the force meets the joint at the radius K_i / N_i, so the arch stands
    if some H, V, K_0 give

        (R - t/2) N_i <= K_i <= (R + t/2) N_i      at every joint,
        N_i = H cos(theta_i) - (V - sum W_k) sin(theta_i),    K_i = K_0 + sum W_k x_k   (sums over k < i),

    theta from the crown, positive to the right, x_k the lever arm of the voussoir's weight.

    Parameters
    ----------
    voussoirs
        Their number; joints only between them, at equal angles. At least 4: with fewer, a line of thrust through the
        middle of every joint always exists.
    angle_deg
        Angle of embrace [deg], 180 for a semicircle; above 0, at most 180.
    radius
        Of the centre line [m]. With the default of 1 the result is t/R.
    voussoir_shape
        "chord": plane faces between the joints, as `arch` builds them. "sector": true annular sectors. The centroids
        differ by a share (angle per voussoir)^2 / 12 of the radius: 1.3e-5 in t/R at 60 voussoirs, 4.5e-4 at 10.

    Returns
    -------
    float
        Thickness [m]; for the semicircle it tends to 0.107478 R from below as voussoirs are added.

    Raises
    ------
    InputError
        Naming the argument that is wrong.

    Notes
    -----
    Source of the limit: Milankovitch (1907), t/R = 0.1075 for a semicircle, hinges at the haunches 54.5 degrees from
    the crown; Heyman's 0.106 is an approximation. Wrong where sliding governs (the thrust of a semicircle needs a
    friction angle of 21.6 degrees at the springings, atan(2 H / W) with H = 0.1976 W) and for stone that crushes.
    """
    # scipy.optimize takes a quarter of a second to load, which whoever builds only walls need not wait for
    from scipy.optimize import brentq

    number = count("voussoirs", voussoirs, least=4)
    angle = np.radians(_angle(angle_deg))
    scale = positive("radius", radius)
    choice("voussoir_shape", voussoir_shape, _SHAPES)

    def margin(thickness: float) -> float:
        return thrust_margin(thickness, number, angle, chord=voussoir_shape == "chord")

    thin, thick = 1e-6, 1.0
    if margin(thin) >= 0.0:
        return scale * thin
    while margin(thick) < 0.0:  # pragma: no cover - a circular arch half as thick as its radius stands
        thick = 0.5 * (thick + 2.0)
    return scale * float(brentq(margin, thin, thick, xtol=1e-9, rtol=1e-9))


def thrust_margin(thickness: float, voussoirs: int, angle: float, *, chord: bool = False) -> float:
    """Return how far inside the arch the best line of thrust stays, over all joints.

    It is negative if none is inside.

    Parameters
    ----------
    thickness
        t/R of the arch.
    voussoirs, angle
        Number, and angle of embrace [rad].
    chord
        Whether voussoirs have plane faces.

    Returns
    -------
    float
        Smallest of K_i - (R - t/2) N_i and (R + t/2) N_i - K_i, divided by total weight times radius, at its largest.
    """
    from scipy.optimize import linprog

    theta = np.linspace(-angle / 2.0, angle / 2.0, voussoirs + 1)
    inner, outer = 1.0 - thickness / 2.0, 1.0 + thickness / 2.0
    weight = 1.0 / voussoirs
    radial = centroid_radius(thickness, angle / voussoirs, chord=chord)
    arm = radial * np.sin(0.5 * (theta[:-1] + theta[1:]))
    passed = weight * np.arange(voussoirs + 1)
    moment = np.concatenate([[0.0], np.cumsum(weight * arm)])
    # unknowns H, V, K_0, margin; N = H cos - V sin + passed sin
    normal = np.column_stack([np.cos(theta), -np.sin(theta), np.zeros_like(theta)])
    constant = passed * np.sin(theta)
    turning = np.zeros_like(normal)
    turning[:, 2] = 1.0
    ones = np.ones((voussoirs + 1, 1))
    rows = np.vstack([np.hstack([inner * normal - turning, ones]), np.hstack([turning - outer * normal, ones])])
    limits = np.concatenate([moment - inner * constant, outer * constant - moment])
    solution = linprog(
        [0.0, 0.0, 0.0, -1.0], A_ub=rows, b_ub=limits, bounds=[(None, None)] * 3 + [(None, 10.0)], method="highs"
    )
    if solution.status != 0:
        raise NotConverged(f"the thrust line program was not solved: {solution.message}")
    return float(solution.x[3])


def centroid_radius(thickness: float, step: float, *, chord: bool) -> float:
    """Return the distance of a voussoir's centroid from the centre of an arch of unit radius.

        2/3 (Ri^2 + Ri Ro + Ro^2) / (Ri + Ro), times sin(step/2)/(step/2) for a sector, cos(step/2) for plane faces

    Parameters
    ----------
    thickness
        t/R of the arch.
    step
        Angle of the voussoir [rad].
    chord
        Whether it has plane faces.
    """
    inner, outer = 1.0 - thickness / 2.0, 1.0 + thickness / 2.0
    half = step / 2.0
    shape = np.cos(half) if chord else np.sin(half) / half
    return float(2.0 / 3.0 * (inner**2 + inner * outer + outer**2) / (inner + outer) * shape)


def _angle(angle_deg: object) -> float:
    angle = finite("angle_deg", angle_deg)
    if not 0.0 < angle <= 180.0:
        raise InputError(f"angle_deg must be above 0 and at most 180, got {angle_deg!r}")
    return angle
