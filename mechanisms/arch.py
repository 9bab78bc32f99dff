"""Minimum thickness of circular arches under their own weight: the five-hinge limit, by an equation and a root."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitmason.checks import finite
from limitmason.errors import InputError


class ArchLimit(NamedTuple):
    """Thinnest arch, with the angle of its haunch hinge and its thrust.

    Parameters
    ----------
    thickness : over the radius of the centre line, t/R [-]
    haunch_deg : of the hinge at the haunch, from the crown [deg]
    thrust : horizontal, over the weight of the whole arch [-]
    """

    thickness: float
    haunch_deg: float
    thrust: float


def arch_limit(angle_deg: float = 180.0) -> ArchLimit:
    """Return the least thickness of a circular arch that carries its own weight.

    Radial joints may open at every angle.

    Thrust through the extrados at crown and springings, touching the intrados at the haunch beta. Per unit of weight
    an angle, with r_i = 1 - t/2, r_o = 1 + t/2 and centroids at rho = 1 + t^2/12,

        H = max over beta of [r_i beta sin(beta) - rho (1 - cos(beta))] / (r_o - r_i cos(beta))
          = [r_o alpha sin(alpha) - rho (1 - cos(alpha))] / (r_o (1 - cos(alpha)))        (alpha: half embrace)

    Parameters
    ----------
    angle_deg : angle of embrace, 60 to 180 (chosen) [deg]

    Returns
    -------
    ArchLimit
        For 180: t/R = 0.107478, haunch at 54.484 degrees, thrust 0.19763 of the arch's weight.

    Raises
    ------
    InputError
        Outside 60 to 180 degrees.

    Notes
    -----
    Source: Milankovitch (1907) for the semicircle; derived (docs/mechanisms.md, section 8). Couplet-Heyman's 0.106 puts
    the centroids on the centre line. Wrong for few voussoirs (joints miss the haunch: slightly thinner arches stand),
    where friction is too small for the springings, and for other cuts (0.1095 with vertical joints).
    """
    if not 60.0 <= finite("angle_deg", angle_deg) <= 180.0:
        raise InputError(f"angle_deg must lie between 60 and 180, got {angle_deg!r}")
    # scipy.optimize takes a quarter of a second to load, which whoever asks for walls need not wait for
    from scipy.optimize import brentq, minimize_scalar

    alpha = math.radians(0.5 * angle_deg)
    # lengths below are in radii of the centre line, thrusts in weights of an arch of one radian

    def need(beta: float, t: float) -> float:
        """Thrust that the part from the crown to an angle beta [rad] needs, at a thickness t, not to turn inwards."""
        inner, outer, rho = 1.0 - 0.5 * t, 1.0 + 0.5 * t, 1.0 + t * t / 12.0
        return (inner * beta * math.sin(beta) - rho * (1.0 - math.cos(beta))) / (outer - inner * math.cos(beta))

    def haunch(t: float) -> float:
        """Angle from the crown [rad] of the hinges at the haunches, in an arch of relative thickness t."""
        # not from the crown itself, where numerator and denominator both become small
        found = minimize_scalar(
            lambda b: -need(b, t), bounds=(0.05 * alpha, alpha), method="bounded", options={"xatol": 1e-12}
        )
        return float(found.x)

    def spare(t: float) -> float:
        """Thrust at which the half arch turns about its springing less that which it needs: zero at the least t."""
        outer, rho = 1.0 + 0.5 * t, 1.0 + t * t / 12.0
        drop = 1.0 - math.cos(alpha)
        return (outer * alpha * math.sin(alpha) - rho * drop) / (outer * drop) - need(haunch(t), t)

    # between a line, which no thrust line fits in, and half the radius, which stands at every angle
    t = float(brentq(spare, 1e-5, 0.5, xtol=1e-14))
    beta = haunch(t)
    return ArchLimit(t, math.degrees(beta), need(beta, t) / (2.0 * alpha))
