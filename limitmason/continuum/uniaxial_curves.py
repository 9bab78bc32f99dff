"""Uniaxial curves of points of a solid: exponential softening in tension, a parabola in compression.

Curves as in the manual of DIANA: exponential by fracture energy, parabola with its peak at 5 fc / 3 E.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.errors import InputError
from limitmason.model.material import Material


class Curves(NamedTuple):
    """Uniaxial curves of n points, shape (n,) each.

    Infinite strengths never yield.
    """

    modulus: Array  # E [Pa]
    poisson: Array  # nu [-]
    tension: Array  # ft [Pa]
    softening: Array  # strain scale of the exponential [-]
    crushing: Array  # fc [Pa]
    end: Array  # strain over the peak strain at which the parabola ends [-]

    def rows(self, rows: Index) -> "Curves":
        """Curves of the points whose numbers are given."""
        return Curves(*(c[rows] for c in self))


def curves_of(materials: Sequence[Material], material: Index, width: Array) -> Curves:
    """Curves of points from their materials and crack-band widths.

    Parameters
    ----------
    materials : by their numbers; None for a strength is one that never yields, for an energy one that never falls
    material : number of the material of each point, shape (n,)
    width : h, over which a crack is smeared [m], shape (n,): the cube root of the volume that a point stands for

    Raises
    ------
    InputError
        When a brick is so wide that its fracture energy is less than 1.5 times the elastic energy at the strength.
    """

    def column(name: str) -> Array:
        """One property of the material of every point, infinite where it has none, shape (n,)."""
        given = [getattr(m, name) for m in materials]
        return np.array([np.inf if value is None else value for value in given], dtype=float)[material]

    e, ft, fc = column("young_modulus"), column("tensile_strength"), column("compressive_strength")
    with np.errstate(invalid="ignore"):
        # area under the curve times the width is the fracture energy: triangle up to ft, exponential after it
        softening = np.where(np.isinf(ft), np.inf, column("tensile_energy") / (width * ft) - 0.5 * ft / e)
        # the falling parabola holds two thirds of fc times its strain
        end = np.where(np.isinf(fc), np.inf, 1.5 * column("compressive_energy") / (width * fc))
        # below zero the curve would run back, snap-back inside a brick; a quarter of ft / E is the margin, chosen
        wrong = softening < 0.25 * ft / e
    wrong &= np.isfinite(ft)
    if wrong.any():
        i = int(np.argmax(wrong))
        largest = float(4.0 / 3.0 * e[i] * column("tensile_energy")[i] / ft[i] ** 2)
        raise InputError(
            f"a crack band of {width[i]:.3g} m in {materials[material[i]].name!r} snaps back: with its strength and "
            f"fracture energy bricks must be smaller than {largest:.3g} m"
        )
    return Curves(modulus=e, poisson=column("poisson_ratio"), tension=ft, softening=softening, crushing=fc, end=end)


def envelope(c: Curves, strain: Array) -> tuple[Array, Array, Array]:
    """Stress, slope and area of the curves at equivalent strains never exceeded before.

    Tension is linear to ft, then falls as ft exp(-(e - ft / E) / softening). Compression is linear to fc / 3 and rises
    on a parabola to fc at a strain of 5 fc / (3 E); with t from 0 to 1 on this branch it is fc / 3 (1 + 4 t - 2 t^2).
    It falls as fc (1 - s^2), with s from 0 to 1 over the strain `end`. The area is the energy under the curve.

    Parameters
    ----------
    c : curves of n points
    strain : equivalent strains of three directions, tension positive [-], shape (n, 3)

    Returns
    -------
    stress [Pa], slope [Pa], area under the curve from zero [J/m3]: shape (n, 3) each
    """
    return _curves(c, strain, area=True)


def _curves(c: Curves, strain: Array, *, area: bool) -> tuple[Array, Array, Array]:
    """What :func:`envelope` gives, whose areas are zero where they are not asked for: most calls need none.

    Parameters
    ----------
    c, strain : see there
    area : whether to work out the areas
    """
    e = c.modulus[:, None]
    # linear first; what has cracked or crushed is written over it
    stress, slope = e * strain, np.broadcast_to(e, strain.shape).copy()
    under = 0.5 * stress * strain if area else np.zeros((1, 1))
    cracked = np.nonzero(strain > (c.tension / c.modulus)[:, None])
    if len(cracked[0]):
        peak, scale = c.tension[cracked[0]], c.softening[cracked[0]]
        first = peak / c.modulus[cracked[0]]
        # exp(-700) is zero for a stress, and does not underflow
        s = peak * np.exp(-np.minimum((strain[cracked] - first) / scale, 700.0))
        stress[cracked], slope[cracked] = s, -s / scale
        if area:
            under[cracked] = 0.5 * peak * first + scale * (peak - s)
    short = -strain
    crushed = np.nonzero(short > (c.crushing / (3.0 * c.modulus))[:, None])
    if len(crushed[0]):
        f, modulus, end = c.crushing[crushed[0]], c.modulus[crushed[0]], c.end[crushed[0]]
        # t is 0 at fc / 3, strain fc / 3 E, and 1 at fc, strain 5 fc / 3 E; s is 0 there, 1 where nothing is left
        t = (short[crushed] - f / (3.0 * modulus)) / (4.0 * f / (3.0 * modulus))
        s = (short[crushed] - 5.0 * f / (3.0 * modulus)) / end
        rising, gone = t <= 1.0, s >= 1.0
        # each is kept within its branch: the area then is the sum of both parts
        s = np.clip(s, 0.0, 1.0)
        rise, t = 4.0 * f / (3.0 * modulus), np.minimum(t, 1.0)
        stress[crushed] = -np.where(rising, f / 3.0 * (1.0 + 4.0 * t - 2.0 * t * t), f * (1.0 - s * s))
        slope[crushed] = np.where(rising, f / 3.0 * (4.0 - 4.0 * t) / rise, np.where(gone, 0.0, -2.0 * f * s / end))
        if area:  # triangle up to fc / 3, then what lies under both branches
            on_rising, on_falling = f / 3.0 * rise * (t + 2.0 * t * t - 2.0 / 3.0 * t**3), f * end * (s - s**3 / 3.0)
            under[crushed] = f * f / (18.0 * modulus) + on_rising + on_falling
    return stress, slope, under


def uniaxial(c: Curves, strain: Array, tension: Array, compression: Array) -> tuple[Array, Array]:
    """Stress and slope, with unloading to the origin from what was reached before.

    Parameters
    ----------
    c : curves of n points
    strain : equivalent strain, tension positive [-], shape (n, 3)
    tension, compression : largest ones before, as positive numbers [-], shape (n, 3)

    Returns
    -------
    stress, slope : [Pa], shape (n, 3) each
    """
    reached = np.where(strain >= 0.0, np.maximum(strain, tension), np.minimum(strain, -compression))
    stress, slope, _ = _curves(c, reached, area=False)
    inside = np.abs(strain) < np.abs(reached)
    # nothing reached, nothing strained: Hooke's law, without a division by zero
    secant = np.where(reached == 0.0, c.modulus[:, None], stress / np.where(reached == 0.0, 1.0, reached))
    return np.where(inside, secant * strain, stress), np.where(inside, secant, slope)
