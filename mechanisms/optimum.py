"""Smallest ratio of two quadratics on an interval: every multiplier of this package is one in the crack's tangent."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.errors import InputError
from mechanisms.friction import FrictionSums

Option = TypeVar("Option", bound=tuple[Any, ...])

_FLAT = 1e-14  # of the largest term: a quadratic term below it is rounding, and the derivative a straight line
_EQUAL = 1e-12  # relative: values that near to each other are equal


class SmallestValue(NamedTuple):
    """Smallest multiplier [-] and the crack's tangent at which it is taken [-]."""

    value: float
    at: float


class PowerRatio(NamedTuple):
    """Multiplier of one hinge as N(s) / D(s), s the crack's tangent.

    Parameters
    ----------
    numerator, denominator : coefficients of 1, s, s^2 in the powers that resist and drive, shape (3,) each
    friction : of the joints that the crack crosses
    """

    numerator: Array
    denominator: Array
    friction: FrictionSums

    def at(self, s: float) -> float:
        """Its value at a tangent, see :func:`ratio`."""
        return ratio(self.numerator, self.denominator, s)

    def smallest(self, high: float, given: float | None = None) -> SmallestValue:
        """Its smallest value from 0 to the tangent ``high``, or its value at one that is ``given``."""
        if given is not None:
            return SmallestValue(self.at(given), given)
        return smallest_ratio(self.numerator, self.denominator, low=0.0, high=high)


def smallest_ratio(numerator: ArrayLike, denominator: ArrayLike, low: float, high: float) -> SmallestValue:
    """Return the minimum of N(s) / D(s) for low <= s <= high, D positive inside.

    (N / D)' = 0 where N' D - N D' = 0; the cubic terms cancel and at most two stationary points remain, so the minimum
    is exact: the smaller of those inside and the two ends. Where D vanishes at an end, the value there is that of the
    limit.

    Parameters
    ----------
    numerator, denominator : coefficients of 1, s, s^2, shape (3,) each
    low, high : interval, low <= high

    Raises
    ------
    InputError
        When the interval is empty.
    """
    if not low <= high:
        raise InputError(f"the interval from {low!r} to {high!r} is empty")
    n, d = np.asarray(numerator, dtype=float), np.asarray(denominator, dtype=float)
    # N' D - N D' = c + b s + a s^2
    c, b, a = n[1] * d[0] - n[0] * d[1], 2.0 * (n[2] * d[0] - n[0] * d[2]), n[2] * d[1] - n[1] * d[2]
    points = [low, high]
    far = max(abs(low), abs(high))
    largest_term = max(abs(c), abs(b) * far, abs(a) * far**2, 1e-300)
    if abs(a) * far**2 > _FLAT * largest_term:
        discriminant = b**2 - 4.0 * a * c
        if discriminant >= 0.0:
            # the pair of roots without cancellation
            q = -0.5 * (b + np.copysign(np.sqrt(discriminant), b))
            points += [q / a, c / q if q else 0.0]
    elif b:
        points.append(-c / b)
    best = SmallestValue(float("inf"), low)
    for s in points:
        if low <= s <= high:
            value = ratio(n, d, s)
            if value < best.value:
                best = SmallestValue(value, float(s))
    return best


def least(options: Iterable[Option]) -> Option | None:
    """The option whose first item, a :class:`SmallestValue`, is smallest: the first of those equal but for rounding."""
    best: Option | None = None
    for option in options:
        if best is None or option[0].value < best[0].value * (1.0 - _EQUAL):
            best = option
    return best


def ratio(numerator: ArrayLike, denominator: ArrayLike, s: float) -> float:
    """Return N(s) / D(s), by its limit where both vanish at s = 0, or infinite where only D does.

    ``numerator`` and ``denominator`` are coefficients of 1, s, s^2, shape (3,) each.
    """
    n, d = np.asarray(numerator, dtype=float), np.asarray(denominator, dtype=float)
    powers = np.array([1.0, s, s * s])
    # a common factor s is taken out, as by l'Hospital's rule
    while s == 0.0 and d[0] == 0.0 and n[0] == 0.0 and len(n) > 1:
        n, d, powers = n[1:], d[1:], powers[:-1]
    top, bottom = float(n @ powers), float(d @ powers)
    return top / bottom if bottom > 0.0 else float("inf")
