"""Capacity of a rigid mechanism by the Italian Circular: the accelerations that its oscillator reaches."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from limitmason.arrays import Array
from limitmason.codes.spectra import LARGEST_AG, FloorSpectrum, GroundSpectrum, RecordSpectrum
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly

Spectrum = GroundSpectrum | FloorSpectrum | RecordSpectrum

_GROUNDS = 401  # accelerations from 0 to LARGEST_AG, 0.005 g apart, between which a demand is sought; chosen
_AT_ONCE = 0.01  # of d0: a loss within it is sudden; chosen
_MOST_LOST = 0.5  # of the capacity: what is lost at once where less is left, C8.7.1.2.1
_STILL = 0.01  # of the largest acceleration: a capacity below it is none that could be lost; chosen

_NONE = 1e-9  # of the largest load: a load below it is rounding

DAMPING = {"SLV": 0.08, "SLC": 0.10}
"""Of the mechanism, by limit state [-]."""

SHARES = {"SLV": 0.4, "SLC": 0.6}
"""Parts of d0 [-]."""

PERIODS = {"SLV": 1.68, "SLC": 1.56}
"""T = factor pi sqrt(d / a) [C8.7.1.10, C8.7.1.11]."""

BEHAVIOUR_FACTOR = 2.0
"""q of the check of SLV by forces alone: ag over that which sets the mechanism in motion [-]."""


class Capacity(NamedTuple):
    """Capacity of a mechanism as an oscillator, for one way of counting its bodies."""

    bodies: int
    mass_share: float  # e* [-]
    a0: float  # a0* = alpha0 g / (e* FC) [m/s2]
    d0: float  # displacement without capacity [m], NaN without a curve
    d: dict[str, float]  # of SLV and SLC [m]
    a: dict[str, float]  # a(d) [m/s2]
    period: dict[str, float]  # [s]
    ag: dict[str, float]  # acceleration of the ground over g that is reached, by limit state
    ag_simplified: float  # SLV by q = 2 [-]


def bodies_of(assembly: Assembly, twists: Array, tolerance: float = 1e-4) -> list[list[int]]:
    """Numbers of the blocks that move, in groups without relative motion.

    The velocities of a group are one rigid field.

    Parameters
    ----------
    assembly : the blocks
    twists : of every block, up to a common factor, shape (n, 6)
    tolerance : difference of two fields over the largest velocity [-]
    """
    c, turn = assembly.centroids, twists[:, 3:]
    middle = c.mean(axis=0)
    size = float(np.linalg.norm(np.ptp(c, axis=0)))
    # a rigid motion as velocity of the middle of all blocks, and spin times the size: same units
    field = np.hstack([twists[:, :3] + np.cross(turn, middle - c), size * turn])
    largest = float(np.linalg.norm(field, axis=1).max())
    bodies: list[list[int]] = []
    for i in np.flatnonzero(np.linalg.norm(field, axis=1) > tolerance * largest):
        for body in bodies:
            if np.linalg.norm(field[i] - field[body[0]]) <= tolerance * largest:
                body.append(int(i))
                break
        else:
            bodies.append([int(i)])
    return bodies


def capacity_of(
    weights: Array,
    moved: Array,
    at_control: float,
    multiplier: float,
    path: tuple[Array, Array] | None,
    spectra: Mapping[str, Spectrum],
    confidence_factor: float = 1.0,
) -> Capacity:
    """Capacity of a chain of bodies from weights, virtual displacements and a curve.

    The chain is an oscillator of one degree of freedom, whose part of the mass is e* = (sum P delta)^2 / (sum P sum P
    delta^2), and whose acceleration and displacement follow from the curve. For each limit state that ground is found
    whose spectrum asks for just that.

    Parameters
    ----------
    weights : P + Q of every body [N]
    moved : delta of every body along the push, up to a factor
    at_control : delta_C of the control point, up to the same factor
    multiplier : alpha0 [-]
    path : displacement of the control point [m] and alpha [-] to where this is zero; None for q = 2 alone
    spectra : by limit state
    confidence_factor : FC [-]
    """
    first, second = float(weights @ moved), float(weights @ moved**2)  # sum P delta, sum P delta^2
    share = first**2 / (float(weights.sum()) * second)
    to_a = GRAVITY / (share * confidence_factor)  # acceleration of the oscillator per unit of the multiplier [m/s2]
    a0 = multiplier * to_a
    # ground whose peak sets the mechanism in motion: that is SLD, and by q = 2 half of SLV
    in_motion = {state: _reached(spectra[state], lambda s: peak_of(s) - a0) for state in ("SLD", "SLV")}
    d0, ag = math.nan, {"SLD": in_motion["SLD"]}
    d, a, period = dict[str, float](), dict[str, float](), dict[str, float]()  # empty without a curve
    if path is not None:
        along, acceleration = path[0] * abs(second / (at_control * first)), path[1] * to_a
        d0 = zero_of(along, acceleration)
        lost = _lost_at(along, acceleration, d0)
        for state, part in SHARES.items():
            d[state], a[state] = part * d0, _first_at(along, acceleration, part * d0)
            # life safety ends earlier where the capacity breaks off
            if state == "SLV" and lost is not None and along[lost] < d[state]:
                d[state], a[state] = float(along[lost]), float(acceleration[lost])
            if not (d[state] > 0.0 and a[state] > 0.0):
                raise InputError(
                    f"curve: it carries nothing at the displacement of {state}, {d[state]:.3g} m of the oscillator; "
                    "follow it from the dead load to where it is zero"
                )
            period[state] = PERIODS[state] * math.pi * math.sqrt(d[state] / a[state])
            asked = partial(_excess, period[state], DAMPING[state], d[state])
            ag[state] = _reached(spectra[state], asked)
    return Capacity(
        bodies=len(weights), mass_share=share, a0=a0, d0=d0, d=d, a=a, period=period, ag=ag,
        ag_simplified=BEHAVIOUR_FACTOR * in_motion["SLV"],
    )


def _excess(period: float, damping: float, displacement: float, spectrum: Spectrum) -> float:
    """Displacement that a spectrum asks for, less the one that is there [m].

    It is asked for at a period [s] and a damping [-].
    """
    return spectrum.displacement(period, damping) - displacement


def _reached(spectrum: Spectrum, excess: Callable[[Spectrum], float]) -> float:
    """Least acceleration of the ground over g at which the demand meets the capacity.

    It is infinite where none up to 2 g does.
    On soil D the peak ag S falls between two accelerations, so that there may be three. A record's demand has one.

    Parameters
    ----------
    spectrum : of the demand, which is scaled
    excess : of demand over capacity by a spectrum, negative where it holds
    """
    # a spectrum has no acceleration of zero, so that the first trial is next to it
    trials = np.linspace(1e-9, LARGEST_AG, 2 if isinstance(spectrum, RecordSpectrum) else _GROUNDS)
    for low, high in pairwise(map(float, trials)):
        if excess(spectrum.scaled(high)) > 0.0:
            return float(brentq(lambda ag: excess(spectrum.scaled(ag)), low, high))
    return math.inf


def zero_of(along: Array, a: Array) -> float:
    """Displacement behind the peak at which a curve first comes down to zero [m].

    It lies between two samples, on the line through them.

    Parameters
    ----------
    along, a : displacement [m] and acceleration [m/s2], or multiplier [-], of every sample, shape (n,)
    """
    # a curve of elastic joints begins at zero too
    peak = int(np.argmax(a))
    if not a[peak] > _NONE * np.abs(a).max():
        raise InputError("curve: it never carries a load above zero; follow it in the sense of the live load")
    below = peak + np.flatnonzero(a[peak:] <= 0.0)
    if not len(below):
        raise InputError(
            f"the curve ends at alpha = {a[-1] / a.max():.2f} of its largest: follow it to where it is zero"
        )
    k = int(below[0])
    return float(along[k - 1] + (along[k] - along[k - 1]) * a[k - 1] / (a[k - 1] - a[k]))


def _first_at(along: Array, a: Array, displacement: float) -> float:
    """Acceleration where a path first comes to a displacement [m/s2]; a path that turns back comes there again.

    Parameters
    ----------
    along, a : displacement [m] and acceleration [m/s2] of every sample, shape (n,)
    displacement : below the largest of the path [m]
    """
    k = max(int(np.argmax(along >= displacement)), 1)
    return float(np.interp(displacement, along[k - 1 : k + 1], a[k - 1 : k + 1]))


def _lost_at(along: Array, a: Array, d0: float) -> int | None:
    """Number of the sample from which more than half of the capacity is lost at once.

    At once is over a hundredth of d0 at most. None where no such loss is.

    Parameters
    ----------
    along : displacement of every sample [m], shape (n,)
    a : acceleration of every sample [m/s2], shape (n,)
    d0 : displacement at zero capacity [m]
    """
    # last sample within that reach of each; a path may turn back, where the furthest it came counts
    forward = np.maximum.accumulate(along)
    last = np.searchsorted(forward, forward + _AT_ONCE * d0, side="right") - 1
    sudden = np.flatnonzero((a[last] < _MOST_LOST * a) & (a > _STILL * a.max()))
    if not len(sudden):
        return None
    first = int(sudden[0])
    # the steepest step of it
    return first + int(np.argmin(np.diff(a[first : last[first] + 1])))


def peak_of(spectrum: Any) -> float:
    """Largest acceleration of what the mechanism stands on: floor, ground or record [m/s2]."""
    if isinstance(spectrum, FloorSpectrum):
        return math.sqrt(sum(a * a for a in spectrum.peaks()))
    if isinstance(spectrum, GroundSpectrum):
        return spectrum.ag * spectrum.amplification * GRAVITY
    # not ag: that is what the record stands for, of rock for one on soil
    return float(np.abs(np.asarray(spectrum.record)).max())


def ag_of(spectrum: Spectrum) -> float:
    """Acceleration of the ground under a spectrum over g [-]."""
    return spectrum.ground.ag if isinstance(spectrum, FloorSpectrum) else spectrum.ag
