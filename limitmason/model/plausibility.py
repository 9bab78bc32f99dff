"""Warnings about input that is allowed but looks like another unit, or like a slip: never errors."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.constants import GRAVITY

_OWN = ("limitmason", "dem", "mechanisms", "dataclasses", "functools")
_ANGLE_LIKE_RADIANS = 1.6  # a right angle in radians, rounded up
_STRESS_LIKE_MPA = (1e-3, 50.0)  # mortars and stones lie there in MPa, none in Pa
_LIGHTEST = 0.5  # g/cm3; blocks far lighter are weightless on purpose
_STIFFNESS_LIKE_N_PER_MM3 = 1e4  # 10 kPa would press a joint of this many Pa/m together by a metre
_PRESSURE_TOO_HIGH = 1e9  # stronger than any stone [Pa]
_MODULUS_TOO_LOW = 1e5  # softer than rubber
_BLOCK_LIKE_CM = 20.0  # no block is as long in metres
_DENSITY_LIKE_N_PER_M3 = (12e3, 35e3)  # unit weights of masonry in N/m3
_TOLERANCE_TOO_LARGE = 0.2  # of a block's least width, chosen
_OUTSIDE = 1e-3  # of a block's longest side, chosen: a point load farther outside its box is no rounding
_SECTION_LIKE_MM2 = 1.0  # no rod is as thick in square metres

_given_as_coefficient: ContextVar[bool] = ContextVar("given_as_coefficient", default=False)


class PlausibilityWarning(UserWarning):
    """An allowed input that looks like radians, mm, MPa or kN/m3, or an odd load."""


def warn(text: str, category: type[Warning] = PlausibilityWarning) -> None:
    """Warn at the line of the user's own code that called this package."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and str(frame.f_globals.get("__name__", "")).split(".")[0] in _OWN:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, category, stacklevel=level)


@contextmanager
def given_as_coefficient() -> Iterator[None]:
    """While a friction angle is worked out from a coefficient.

    However small, it is no angle in radians then.
    """
    token = _given_as_coefficient.set(True)
    try:
        yield
    finally:
        _given_as_coefficient.reset(token)


def warn_of_joint(joint: Any, label: str) -> None:
    """Warn of a joint's numbers in other units.

    Angles like radians, strengths like MPa, stiffnesses like N/mm3, and strengths that grow by failing. ``label`` names
    the joint.
    """
    if not _given_as_coefficient.get():
        _warn_of_angle(joint, label, "; use Joint.from_friction_coefficient for a joint this smooth")
    _warn_of_strengths(joint, label, "compressive_strength", "residual_cohesion", "residual_tensile_strength")
    for field in ("cohesion", "tensile_strength"):
        peak, rest = getattr(joint, field), getattr(joint, f"residual_{field}")
        if rest is not None and rest > peak:
            warn(f"{label}: residual_{field} = {rest:g} Pa exceeds {field} = {peak:g} Pa: it grows stronger by failing")
    for field in ("normal_stiffness", "shear_stiffness"):
        value = getattr(joint, field)
        if value is not None and value > 0.0:
            warn_of_stiffness(value, f"{label}: {field}")


def warn_of_stiffness(value: float, label: str) -> None:
    """Warn of a stiffness above 0 [Pa/m] that looks like N/mm3; ``label`` says whose."""
    if value < _STIFFNESS_LIKE_N_PER_MM3:
        warn(f"{label} = {value:g} Pa/m looks like N/mm3 ({value:g} N/mm3 is {1e9 * value:g} Pa/m)")


def warn_of_material(material: Any, label: str) -> None:
    """Warn of a material's numbers in other units.

    Moduli like MPa or GPa, strengths like MPa, angles like radians. ``label`` names the material.
    """
    if material.young_modulus < _MODULUS_TOO_LOW:
        e = material.young_modulus
        warn(f"{label}: young_modulus = {e:g} Pa looks like MPa or GPa ({e:g} GPa is {1e9 * e:g} Pa)")
    _warn_of_angle(material, label)
    _warn_of_strengths(material, label)


def warn_of_tie(tie: Any, label: str) -> None:
    """Warn of a tie's numbers in other units.

    A yield stress and modulus like MPa, a section like mm2. ``label`` names the tie.
    """
    for field in ("yield_stress", "modulus"):
        value = getattr(tie, field)
        if value is not None and value < _MODULUS_TOO_LOW:
            warn(f"{label}: {field} = {value:g} Pa looks like MPa ({value:g} MPa is {1e6 * value:g} Pa)")
    if tie.area is not None and tie.area > _SECTION_LIKE_MM2:
        warn(f"{label}: area = {tie.area:g} m2 looks like mm2 ({tie.area:g} mm2 is {1e-6 * tie.area:g} m2)")


def _warn_of_angle(law: Any, label: str, remedy: str = "") -> None:
    """Warn of a friction angle like radians.

    Parameters
    ----------
    law : joint law or material
    label : what it is called
    remedy : what to do where the angle is meant
    """
    angle = law.friction_angle_deg
    if angle is not None and 0.0 < angle < _ANGLE_LIKE_RADIANS:
        as_degrees = f"{np.degrees(angle):.3g} degrees"
        warn(f"{label}: friction_angle_deg = {angle:g} degrees looks like radians ({as_degrees}){remedy}")


def _warn_of_strengths(law: Any, label: str, *further: str) -> None:
    """Warn of strengths like MPa.

    Parameters
    ----------
    law : joint law or material
    label : what it is called
    further : fields to be looked at beside cohesion and tensile strength
    """
    for field in ("cohesion", "tensile_strength", *further):
        value = getattr(law, field)
        if value is not None and _STRESS_LIKE_MPA[0] <= value < _STRESS_LIKE_MPA[1]:
            warn(f"{label}: {field} = {value:g} Pa looks like MPa ({value:g} MPa is {1e6 * value:g} Pa)")


def warn_of_blocks(blocks: Sequence[Any], sizes: Array) -> None:
    """Warn of densities and sizes of blocks in other units.

    Densities like N/m3, kN/m3 or g/cm3, and millimetres or centimetres read as metres.

    Parameters
    ----------
    blocks : of the assembly
    sizes : longest side of the box of every convex piece [m]
    """
    middle = float(np.median(sizes))
    if middle > _BLOCK_LIKE_CM:
        warn(f"half the blocks measure {middle:.3g} m or more: are the coordinates in mm or cm? they are read "
             "as m; a drawing takes scale=0.001")
    density = np.array([b.density for b in blocks])
    heavy = float(np.median(density))
    if _DENSITY_LIKE_N_PER_M3[0] <= heavy <= _DENSITY_LIKE_N_PER_M3[1]:
        warn(f"half the blocks have {heavy:g} kg/m3 or more, which looks like N/m3 ({heavy / GRAVITY:.4g} kg/m3)")
    for low, high, unit, factor in ((_LIGHTEST, 10.0, "g/cm3", 1e3), (10.0, 35.0, "kN/m3", 1e3 / GRAVITY)):
        rows = np.flatnonzero((density >= low) & (density < high))
        if len(rows):
            first = blocks[int(rows[0])]
            more = f" and {len(rows) - 1} more" if len(rows) > 1 else ""
            warn(
                f"block {first.name!r}{more}: density {first.density:g} kg/m3 looks like {unit} "
                f"({factor * first.density:.4g} kg/m3)"
            )


def warn_of_tolerance(distance: float, names: Sequence[str], widths: Array) -> None:
    """Warn of a contact tolerance that is no longer small beside the smallest block.

    Parameters
    ----------
    distance : given for all contacts [m]
    names : of the blocks
    widths : least width of every block [m]
    """
    least = int(widths.argmin())
    if distance > _TOLERANCE_TOO_LARGE * widths[least]:
        warn(
            f"the contact tolerance of {distance:.3g} m is {distance / widths[least]:.0%} of the width of block "
            f"{names[least]!r} ({widths[least]:.3g} m): contacts of blocks this small are not to be trusted"
        )


def warn_of_point(name: str, at: Array, bounds: Array) -> None:
    """Warn of a point load at a place outside the box of its block.

    Parameters
    ----------
    name : of the block
    at : place of the load [m], shape (3,)
    bounds : two opposite corners of the box [m], shape (2, 3)
    """
    outside = float(np.maximum(np.maximum(bounds[0] - at, at - bounds[1]), 0.0).max())
    if outside > _OUTSIDE * float(np.ptp(bounds, axis=0).max()):
        place = ", ".join(f"{x:.4g}" for x in at)
        warn(f"point load on block {name!r}: it acts at ({place}) m, {outside:.3g} m outside the block")


def warn_of_pressure(name: str, pressure: float) -> None:
    """Warn of a pressure [Pa] that no masonry carries.

    ``name`` says what it acts on.
    """
    if abs(pressure) > _PRESSURE_TOO_HIGH:
        warn(f"pressure on {name}: {pressure:.3g} Pa is more than 1 GPa; is it in another unit?")
