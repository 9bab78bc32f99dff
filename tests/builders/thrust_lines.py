"""Minimum thickness of a circular arch under its own weight by lines of thrust: a linear program without assembly.

Joints carry no tension, do not slide and do not crush. With F_i = (H, V - sum W_k) the force across joint i and K_i its
moment about the centre of the arch, the force meets the joint at the radius K_i / N_i, so the arch stands if some H, V,
K_0 give

    (R - t/2) N_i <= K_i <= (R + t/2) N_i      at every joint,
    N_i = H cos(theta_i) - (V - sum W_k) sin(theta_i),    K_i = K_0 + sum W_k x_k   (sums over k < i),

theta from the crown, positive to the right, x_k the lever arm of the voussoir's weight.
"""

import numpy as np
from scipy.optimize import brentq, linprog


def thinnest(voussoirs, angle_deg=180.0, *, chord=True):
    """t / R of the thinnest arch of voussoirs with plane faces, or of annular sectors."""
    angle = np.radians(angle_deg)
    return brentq(lambda t: thrust_margin(t, voussoirs, angle, chord=chord), 1e-6, 1.0, xtol=1e-9, rtol=1e-9)


def thrust_margin(thickness, voussoirs, angle, *, chord=False):
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
    assert solution.status == 0, solution.message
    return float(solution.x[3])


def centroid_radius(thickness, step, *, chord):
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
