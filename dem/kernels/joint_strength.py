"""Strength of a contact point: peak, residual values and damage by a joint's row.

A point goes from its peak to its residual values as its damage goes from 0 to 1. All of it is part of the joint law,
:mod:`dem.kernels.joint_law`.
"""

from typing import NamedTuple

from dem.kernels.added_terms import Numbers, entries_of, with_added
from dem.kernels.arrays import LAW, Array
from dem.kernels.compiled import kernel

TINY = 1e-300
"""Least divisor, so that nothing is divided by nothing."""


class Peak(NamedTuple):
    """Stiffness and peak values of a joint, and what is added to its law."""

    kn: float  # [Pa/m]
    ks: float  # [Pa/m]
    tan_phi: float
    tan_psi: float
    cohesion: float  # c [Pa]
    tension: float  # ft [Pa]
    crushing: float  # closing at which it crushes, fc / kn [m]
    lift: float  # largest plastic opening [m]
    added: Numbers | None  # entries of terms added to the law, None where there are none


class SofteningRow(NamedTuple):
    """Residual less peak values of a joint, at most 0, and what takes it there."""

    tan_phi: float
    tan_psi: float
    cohesion: float  # [Pa]
    tension: float  # [Pa]
    by_opening: float  # damage per opening beyond the strength [1/m]
    by_slip: float  # damage per plastic slip [1/m]
    secant: float  # pull of the elastic opening beyond ft at damage 1, where tension unloads to the origin, else 0 [Pa]


@kernel(forceinline=True)
def plain_peak_of(law: Array, j: int) -> Peak:
    """Peak values of joint j without added terms; ``law``: all rows, (k, LAW_SIZE)."""
    return Peak(
        law[j, LAW.kn], law[j, LAW.ks], law[j, LAW.tan_phi], law[j, LAW.tan_psi], law[j, LAW.cohesion],
        law[j, LAW.tension], law[j, LAW.crushing], law[j, LAW.lift], None,
    )


@kernel(forceinline=True)
def peak_of(law: Array, j: int) -> Peak:
    """Peak values of joint j, with added terms; ``law``: all rows, (k, LAW_SIZE)."""
    return Peak(
        law[j, LAW.kn], law[j, LAW.ks], law[j, LAW.tan_phi], law[j, LAW.tan_psi], law[j, LAW.cohesion],
        law[j, LAW.tension], law[j, LAW.crushing], law[j, LAW.lift], entries_of(law, j),
    )


@kernel(forceinline=True)
def softening_of(law: Array, j: int) -> SofteningRow:
    """How joint j falls to its residual values; ``law``: all rows, (k, LAW_SIZE)."""
    # where the opening does no damage the flag is 0, and so is the pull
    secant = law[j, LAW.secant] * law[j, LAW.kn] / max(law[j, LAW.by_opening], TINY)
    return SofteningRow(
        law[j, LAW.rest_tan_phi] - law[j, LAW.tan_phi], law[j, LAW.rest_tan_psi] - law[j, LAW.tan_psi],
        law[j, LAW.rest_cohesion] - law[j, LAW.cohesion], law[j, LAW.rest_tension] - law[j, LAW.tension],
        law[j, LAW.by_opening], law[j, LAW.by_slip], secant,
    )


@kernel(forceinline=True)
def strength_of(peak: Peak, softening: SofteningRow | None, damage: float, slip_1: float, slip_2: float) -> Numbers:
    """tan(phi), tan(psi), c [Pa] and ft [Pa] of a point, added terms included.

    Parameters
    ----------
    peak : peak values of its joint
    softening : how the joint falls from them; None where nothing is lost
    damage : 0 at the peak, 1 at residual values [-]
    slip_1, slip_2 : plastic slip along t1 and t2 [m], on which added terms may depend
    """
    mu, dil, c, ft = peak.tan_phi, peak.tan_psi, peak.cohesion, peak.tension
    if softening is not None:
        mu, dil, c, ft = (
            mu + damage * softening.tan_phi, dil + damage * softening.tan_psi, c + damage * softening.cohesion,
            ft + damage * softening.tension,
        )
    return with_added(peak.added, mu, dil, c, ft, slip_1, slip_2, damage)
