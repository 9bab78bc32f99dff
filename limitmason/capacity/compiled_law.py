"""Return map of the joint law point by point, compiled: :mod:`limitmason.capacity.point_law` says what it is.

Arrays are of m points with c components, normal first. The law of one point, ``s``, ``peak`` or ``rest``, is
(tan(phi), tan(psi) [-], cohesion, tension and crushing strength [Pa]); ``strength``, ``peaks`` and ``rests`` have it of
every point, (5, m). ``kn`` and ``ks`` are stiffnesses [Pa/m], (m,).
``old_slip`` and ``old_lift`` are plastic slip and opening before the step [m], (m, c - 1) and (m,). ``displacement`` is
that of b against a, opening positive [m], (m, c).
"""

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Strength: TypeAlias = tuple[float, float, float, float, float]

BELOW_THE_APEX = 1e-12
"""That of :mod:`limitmason.mechanics.law`: what is kept on disk would not see a change there, so that a test does."""

PROBE = 1e-6
"""Step of the difference quotients of softening points, over their softening length [-]."""

_DAMAGED = 1e-13
"""Change of a damage that counts as none [-]: rounding of a number of size one, with some room."""

_SECANT = 1e-7
"""Step of the damage for the slope of what is demanded [-]: near the root of rounding, best for a difference."""

_ROUNDS = 40
"""Iterations for a damage at most; what has not come to rest then swings between two values: chosen."""

_BITS = 52
"""Halvings to the last bit of a damage between 0 and 1."""


@njit(cache=True, error_model="numpy", inline="always")
def _at(law: Array, m: int) -> Strength:
    """The law of point m."""
    return law[0, m], law[1, m], law[2, m], law[3, m], law[4, m]


@njit(cache=True, error_model="numpy", inline="always")
def _damaged(peak: Strength, rest: Strength, damage: float) -> Strength:
    """Strengths at a damage between 0, peak, and 1, residual; crushing stays."""
    return (
        peak[0] + damage * (rest[0] - peak[0]), peak[1] + damage * (rest[1] - peak[1]),
        peak[2] + damage * (rest[2] - peak[2]), peak[3] + damage * (rest[3] - peak[3]), peak[4],
    )


@njit(cache=True, error_model="numpy")
def _predicted(
    m: int, kn: Array, ks: Array, old_slip: Array, old_lift: float, w: Array, along: Array
) -> tuple[float, float]:
    """Stress without further slip and without limits: N and |T| [Pa], and T / |T| written to ``along``, (c - 1,).

    ``w`` is the displacement of point m [m], shape (c,).
    """
    size = 0.0
    for j in range(len(along)):
        along[j] = ks[m] * (old_slip[m, j] - w[1 + j])
        size += along[j] * along[j]
    size = np.sqrt(size)
    for j in range(len(along)):
        along[j] /= max(size, 1e-300)
    return kn[m] * (old_lift - w[0]), size


@njit(cache=True, error_model="numpy")
def _corrected(
    s: Strength, kn: float, ks: float, n0: float, size: float, old_lift: float, opening: float
) -> tuple[float, float, float, bool, bool, bool]:
    """Slip p [m], lift [m] and N [Pa] of a point, and whether it lies at the tip, at the cut-off, or is crushed.

    The trial returns to the cone, to its tip where no shear is left, to the tension cut-off, or to the crushing
    strength. Each case is asked for in this order and overrides the one before: only the return to the cone tells
    whether the tip is passed, and only what is left there whether the tension is reached.

    Parameters
    ----------
    s : strengths that stay through the step
    n0, size : N and |T| of the trial [Pa]
    old_lift : plastic opening before the step [m]
    opening : w, from which n0 came [m]
    """
    mu, psi, cohesion, tension, crushing = s
    # |T| - ks p = c + mu (n0 + kn psi p)
    p = max(size - (cohesion + mu * n0), 0.0) / (ks + kn * mu * psi)
    # tension between the tip of the cone and a strength beyond it: all of the shear slips
    tip = p > 0.0 and cohesion + mu * (n0 + kn * psi * p) < 0.0
    if tip:
        p = size / ks
    apex = n0 + kn * psi * p <= -tension
    if apex:
        p = max(size - max(cohesion - mu * tension, 0.0), 0.0) / ks
    normal = -tension if apex else n0 + kn * psi * p
    lift = old_lift + psi * p
    crushed = normal > crushing
    if crushed:
        normal = crushing
        p = max(size - (cohesion + mu * normal), 0.0) / ks
        lift = opening + normal / kn
    return p, lift, normal, tip and not apex, apex, crushed


@njit(cache=True, error_model="numpy")
def returned(
    strength: Array, kn: Array, ks: Array, floor: float, old_slip: Array, old_lift: Array, displacement: Array,
    stress: Array, slip: Array, lift: Array, tangent: Array,
) -> None:
    """Write stress and history of every point by strengths that stay, and the consistent tangent if asked.

    Parameters
    ----------
    floor : share of the elastic stiffness left in the tangent
    stress : written, compression positive [Pa], (m, c)
    slip, lift : written, plastic slip and opening after the step [m], shaped as before it
    tangent : written unless it is empty: - d(stress) / d(displacement) [Pa/m], shape (m, c, c) or (0, c, c)
    """
    c = displacement.shape[1]
    along = np.empty(c - 1)
    for m in range(len(kn)):
        s, w = _at(strength, m), displacement[m]
        mu, psi, cohesion = s[:3]
        n0, size = _predicted(m, kn, ks, old_slip, old_lift[m], w, along)
        p, raised, normal, tip, apex, crushed = _corrected(s, kn[m], ks[m], n0, size, old_lift[m], w[0])
        held = size - ks[m] * p  # shear that is left
        stress[m, 0], lift[m] = normal, raised
        for j in range(c - 1):
            stress[m, 1 + j] = held * along[j]
            slip[m, j] = old_slip[m, j] - p * along[j]
        if not len(tangent):
            continue
        # derivatives by displacement: of N first (``first`` by the opening), then of the shears. On the cone
        # d(slip) = (-ks s.de + mu kn dw) / hardness with s the sense of the shear; crushed, N stays. Shears follow N by
        # ``slope`` on the cone, while N rises by ``flow`` per unit of shear stiffness as slip lifts
        cone = not apex and not tip and p > 0.0
        # a point that can hold no shear slides by any, though it may bear none yet
        sliding = p > 0.0 or cohesion + mu * normal <= 0.0
        # of the trial shear that is held, by which the stiffness across the slip is less
        share = held / max(size, 1e-300) if sliding else 1.0
        slope, hardness = mu if cone else 0.0, ks[m] + kn[m] * mu * psi
        flow = kn[m] * psi * (1.0 / ks[m] if tip else 1.0 / hardness if cone and not crushed else 0.0)
        first = 0.0 if apex or crushed else kn[m] * (1.0 - flow * slope)
        least = floor * min(kn[m], ks[m])
        tangent[m, 0, 0] = first + least
        for i in range(c - 1):
            tangent[m, 0, 1 + i] = flow * ks[m] * along[i]
            tangent[m, 1 + i, 0] = slope * first * along[i]
        for i in range(c - 1):
            for j in range(c - 1):
                x = ks[m] * share * ((i == j) - sliding * along[i] * along[j])
                tangent[m, 1 + i, 1 + j] = x + slope * along[i] * tangent[m, 0, 1 + j] + (least if i == j else 0.0)


@njit(cache=True, error_model="numpy")
def _slip_to_tip(
    s: Strength, ks: float, began: Array, size: float, along: Array, normal: float, slip: float
) -> float:
    """Slip of a step that met a shear strength [m]: all of it, or up to the tip of the cone, with no shear left.

    Beyond the tip there is none that slip could break. On the way from the stress at the start to that of the end the
    tip is passed where the shear strength by ``s`` is nothing.

    Parameters
    ----------
    s : strengths at the end of the step
    began : (N, T...) from which the step began [Pa], (c,)
    size, along : shear at the end without further slip, |T| [Pa] and T / |T|, (c - 1,)
    normal : N at the end without a limit [Pa]
    slip : size of the slip in the step [m]
    """
    mu, _, cohesion, tension, _ = s
    if cohesion + mu * max(normal, -tension) >= -BELOW_THE_APEX * cohesion:
        return slip
    first, last = cohesion + mu * began[0], cohesion + mu * normal
    # part of the step, in which strength falls evenly, after which no shear is left
    share = first / (max(first, 0.0) - last) if first > 0.0 else 0.0
    total = 0.0
    for j in range(len(along)):
        x = began[1 + j] + share * (size * along[j] - began[1 + j])
        total += x * x
    return np.sqrt(total) / ks


@njit(cache=True, error_model="numpy")
def slips_to_tip(
    strength: Array, ks: Array, began: Array, tried: Array, normal: Array, slip: Array, out: Array
) -> None:
    """Write :func:`_slip_to_tip` of every point [m], (m,).

    Parameters
    ----------
    began : (N, T...) from which the step began [Pa], (m, c)
    tried : shear at the end without further slip [Pa], (m, c - 1)
    normal, slip : N at the end without a limit [Pa], and size of the slip in the step [m], (m,)
    """
    for m in range(len(ks)):
        out[m] = _slip_to_tip(_at(strength, m), ks[m], began[m], 1.0, tried[m], normal[m], slip[m])


@njit(cache=True, error_model="numpy")
def _demanded(
    s: Strength, rates: tuple[float, float], kn: float, ks: float, began: Array, before: float,
    trial: tuple[float, float], along: Array, old_lift: float, opening: float,
) -> float:
    """Damage that a step asks for, returned with strengths ``s``: max(h_n, rate_opening x) + rate_slip p.

    The true damage is where that of ``s`` and this are equal.

    Parameters
    ----------
    rates : damage per opening and per slip [1/m]
    began : (N, T...) from which the step began [Pa], (c,)
    before : damage before the step
    trial, along : N and |T| without limits [Pa], and T / |T|, (c - 1,)
    old_lift, opening : plastic opening before the step, and opening now [m]
    """
    p, lift = _corrected(s, kn, ks, trial[0], trial[1], old_lift, opening)[:2]
    beyond = max(opening - lift - s[3] / kn, 0.0)
    slip = _slip_to_tip(s, ks, began, trial[1], along, kn * (lift - opening), p)
    return min(max(before, rates[0] * beyond) + rates[1] * slip, 1.0)


@njit(cache=True, error_model="numpy")
def _damage(
    peak: Strength, rest: Strength, rates: tuple[float, float], kn: float, ks: float, began: Array, before: float,
    trial: tuple[float, float], along: Array, old_lift: float, opening: float,
) -> float:
    """The least damage that asks for no more damage, parameters as in :func:`_demanded`."""
    damage = before
    # Newton's method on damage = demanded(damage), with the slope by a difference
    for _ in range(_ROUNDS):
        s = _damaged(peak, rest, damage)
        asked = _demanded(s, rates, kn, ks, began, before, trial, along, old_lift, opening)
        if abs(asked - damage) < _DAMAGED:
            return damage
        probed = min(damage + _SECANT, 1.0)
        s = _damaged(peak, rest, probed)
        rise = _demanded(s, rates, kn, ks, began, before, trial, along, old_lift, opening) - asked
        slope = rise / max(probed - damage, 1e-300)
        # a point whose strength falls faster than its spring unloads goes all the way
        onward = (asked - damage) / (1.0 - slope) if slope < 1.0 else 1.0 - damage
        damage = min(max(damage + onward, before), 1.0)
    # slip damages no more where the tip of the cone has come to the tension: there the damage stops, halved in on
    low, high = before, 1.0
    for _ in range(_BITS):
        middle = 0.5 * (low + high)
        s = _damaged(peak, rest, middle)
        if _demanded(s, rates, kn, ks, began, before, trial, along, old_lift, opening) > middle:
            low = middle
        else:
            high = middle
    return high


@njit(cache=True, error_model="numpy")
def softened(
    peaks: Array, rests: Array, by_opening: Array, by_slip: Array, kn: Array, ks: Array, floor: float,
    began: Array, old_slip: Array, old_lift: Array, old_damage: Array, displacement: Array, stress: Array, slip: Array,
    lift: Array, damage: Array, tangent: Array,
) -> None:
    """Write stress, history and tangent of the points that soften on in a step; others are left alone.

    Damage depends on the return, so that there is no closed form of the tangent: it is taken by central differences
    over ``PROBE`` of the displacement at which the damage is complete.

    Parameters
    ----------
    by_opening, by_slip : damage per opening and per slip [1/m], (m,)
    floor : share of the elastic stiffness left in the tangent
    began : (N, T...) from which the step began [Pa], (m, c)
    old_damage : before the step, (m,)
    stress, slip, lift, damage, tangent : as :func:`returned` wrote them with the damage before; changed
    """
    c = displacement.shape[1]
    along, w = np.empty(c - 1), np.empty(c)
    for m in range(len(kn)):
        peak, rest, rates, before = _at(peaks, m), _at(rests, m), (by_opening[m], by_slip[m]), old_damage[m]
        w[:] = displacement[m]
        trial = _predicted(m, kn, ks, old_slip, old_lift[m], w, along)
        s = _damaged(peak, rest, before)
        if not _demanded(s, rates, kn[m], ks[m], began[m], before, trial, along, old_lift[m], w[0]) > before:
            continue
        step = PROBE / max(by_opening[m], by_slip[m])  # [m]
        tangent[m] = 0.0
        # ahead and behind along every component, and at last where the point is
        for k in range(2 * c + 1):
            w[:] = displacement[m]
            sign = 0.0 if k == 2 * c else 1.0 if k % 2 else -1.0
            w[k // 2 % c] += sign * step
            trial = _predicted(m, kn, ks, old_slip, old_lift[m], w, along)
            h = _damage(peak, rest, rates, kn[m], ks[m], began[m], before, trial, along, old_lift[m], w[0])
            s = _damaged(peak, rest, h)
            p, raised, normal = _corrected(s, kn[m], ks[m], trial[0], trial[1], old_lift[m], w[0])[:3]
            held = trial[1] - ks[m] * p
            if k == 2 * c:
                stress[m, 0], lift[m], damage[m] = normal, raised, h
                for j in range(c - 1):
                    stress[m, 1 + j] = held * along[j]
                    slip[m, j] = old_slip[m, j] - p * along[j]
                continue
            tangent[m, 0, k // 2] += sign * normal
            for j in range(c - 1):
                tangent[m, 1 + j, k // 2] += sign * held * along[j]
        for i in range(c):
            for j in range(c):
                tangent[m, i, j] *= -0.5 / step
            tangent[m, i, i] += floor * min(kn[m], ks[m])
