"""Where a line of stresses, dead + lambda live, stays within the strength of a joint point: opening, slip, crushing."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from limitmason.arrays import Array
from limitmason.mechanics.law import PointLaw

OPENING, SLIP, CRUSHING = "opening", "slip", "crushing"

CRITERIA = (OPENING, SLIP, CRUSHING)
"""What a joint point can fail by: N = -ft, |T| = c + tan(phi) N, N = fc."""

_ALONG = 1e-14
"""Part of the squares by which they may differ where a line runs along the cone [-]: some units in the last place."""


def point_range(criterion: str, law: PointLaw, dead: Array, live: Array) -> tuple[Array, Array]:
    """Range of lambda in which every point bears dead + lambda live by a criterion.

    Low above high where none does.

    Parameters
    ----------
    criterion : out of ``CRITERIA``
    law : strengths of the points [Pa], or over their areas [N], shape (m,)
    dead, live : stresses (N, T...) [Pa], or forces [N], compression positive, shape (m, c)

    Returns
    -------
    tuple
        Lower and upper ends, (m,), infinite where there is none.
    """
    return _RANGES[criterion](law, dead, live)


def _below_zero(constant: Array, slope: Array) -> tuple[Array, Array]:
    """Range of lambda with constant + lambda slope <= 0, per row: lower and upper ends, (inf, -inf) for none.

    Parameters
    ----------
    constant, slope : any unit, shape (m,)
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        root = -constant / slope
    nothing = (slope == 0.0) & (constant > 0.0)
    low = np.where(nothing, np.inf, np.where(slope < 0.0, root, -np.inf))
    return low, np.where(nothing, -np.inf, np.where(slope > 0.0, root, np.inf))


def _opening(law: PointLaw, dead: Array, live: Array) -> tuple[Array, Array]:
    """Where N >= -ft, see :func:`point_range`."""
    return _below_zero(-dead[:, 0] - law.tension, -live[:, 0])


def _crushing(law: PointLaw, dead: Array, live: Array) -> tuple[Array, Array]:
    """Where N <= fc, see :func:`point_range`, and everywhere for points without a compressive strength."""
    crushes = law.crushes
    return _below_zero(np.where(crushes, dead[:, 0] - law.crushing, -1.0), np.where(crushes, live[:, 0], 0.0))


def _slip(law: PointLaw, dead: Array, live: Array) -> tuple[Array, Array]:
    """Where a line of stresses runs inside the Coulomb cone |T| <= h, h = c + tan(phi) N, see :func:`point_range`.

    Everywhere where it is the axis of the cone and ft lies beyond the apex: from there h counts as 0, as in
    :meth:`PointLaw.excess`.
    """
    low, high = _in_cone(law, dead, live)
    axis = ~law.cut_off & ~dead[:, 1:].any(axis=1) & ~live[:, 1:].any(axis=1)
    return np.where(axis, -np.inf, low), np.where(axis, np.inf, high)


def _in_cone(law: PointLaw, dead: Array, live: Array) -> tuple[Array, Array]:
    """Range of multipliers in which a line of stresses runs inside |T| <= h with h >= 0.

    Parameters
    ----------
    law : strengths of the points [Pa]
    dead, live : stresses at multiplier 0 and per multiplier, (N, T...) [Pa], shape (m, c)

    Returns
    -------
    Lower and upper ends, (m,); the lower one is above the upper one where no multiplier is inside.
    """
    # h = bears + grows lambda
    bears, grows = law.shear_strength(dead[:, 0]), law.tan_phi * live[:, 0]
    if dead.shape[1] == 2:  # in plane the cone is two lines, +-T <= h
        one, other = (_below_zero(sign * dead[:, 1] - bears, sign * live[:, 1] - grows) for sign in (1.0, -1.0))
        return np.maximum(one[0], other[0]), np.minimum(one[1], other[1])
    # inside where q = |T|^2 - h^2 = a lambda^2 + 2 b lambda + k <= 0 and h >= 0
    shear = np.linalg.norm(live[:, 1:], axis=1)
    a = shear**2 - grows**2
    b = (dead[:, 1:] * live[:, 1:]).sum(axis=1) - bears * grows
    k = (dead[:, 1:] ** 2).sum(axis=1) - bears**2
    with np.errstate(divide="ignore", invalid="ignore"):
        # 2 / (-b +- root) has no difference of near numbers where a is small
        root = np.sqrt(np.maximum(b * b - a * k, 0.0))
        far = -b - np.where(b < 0.0, -1.0, 1.0) * root
        ends = np.sort([far / a, np.where(far == 0.0, 0.0, k / far)], axis=0)  # both are 0 where one is by no division
        middle = -b / a
        # along the cone there is one end; on a generator that is the apex
        single = np.where(b == 0.0, -bears / grows, k / far)
    inf = np.full(len(a), np.inf)
    # along: shear grows as the strength does, the line is parallel to the cone. Across: it grows faster, and the line
    # leaves the cone at both ends; else it goes on inside for ever towards growing strength
    along, across = np.abs(a) <= _ALONG * (shear**2 + grows**2), a > 0.0
    low, high = np.where(grows > 0.0, ends[1], -inf), np.where(grows > 0.0, inf, ends[0])
    # across, it is inside at all where the roots are real and h >= 0 midway between them
    real = (b * b >= a * k) & (bears + grows * middle >= 0.0)
    low = np.where(across, np.where(real, ends[0], inf), low)
    high = np.where(across, np.where(real, ends[1], -inf), high)
    # the other nappe, where q <= 0 > h, bears nothing
    holds = np.where(grows > 0.0, b < 0.0, b > 0.0) | ((b == 0.0) & (k <= 0.0))
    low = np.where(along, np.where(holds, np.where(grows > 0.0, single, -inf), inf), low)
    high = np.where(along, np.where(holds, np.where(grows > 0.0, inf, single), -inf), high)
    # a live load that changes neither shear nor strength of a point leaves it inside, or outside, for all multipliers
    still = (shear == 0.0) & (grows == 0.0)
    inside = (k <= 0.0) & (bears >= 0.0)
    return np.where(still, np.where(inside, -inf, inf), low), np.where(still, np.where(inside, inf, -inf), high)


_RANGES: Mapping[str, Callable[[PointLaw, Array, Array], tuple[Array, Array]]] = {
    OPENING: _opening, SLIP: _slip, CRUSHING: _crushing,
}
