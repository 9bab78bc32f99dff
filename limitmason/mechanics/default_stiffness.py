"""Stiffness of joints and ties that name none: one rule for the DEM, the capacity curve and studies of both."""

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import numbers
from limitmason.errors import InputError, NotApplicable
from limitmason.model.assembly import Assembly
from limitmason.model.plausibility import warn_of_stiffness

SETTLEMENT = 1e-6
"""The base shortens by this fraction of the median block size under the whole dead load [-]."""

TIE_STRETCH = 1e-5
"""A tie that names no stiffness reaches its strength when it is stretched by this fraction of the median block [-]."""

LEVEL = 0.5
"""Vertical part of a joint's normal above which the joint counts as level, so that weight presses on it [-]: 60 deg."""


def default_tie_stiffness(assembly: Assembly, strength: Array) -> Array:
    """Axial stiffness of ties that name none [N/m]: strength / (1e-5 x median block size), shape as ``strength`` [N].

    Such ties yield long before what counts as collapse, and are no stiffer than the joints. It is a number for
    collapse, no property of a rod.
    """
    size = float(np.median(np.cbrt(assembly.arrays.volume[~assembly.fixed])))
    return np.asarray(strength / (TIE_STRETCH * size))


def default_stiffness(assembly: Assembly, dead: Array) -> float:
    """Joint stiffness for joints that name none [Pa/m].

    kn = (dead load / area of the joints on supports) / (1e-6 x median block size): the foot of the structure shortens
    by 1e-6 of a block. Small enough that the change of geometry does not show in the multiplier, large enough to
    settle fast. It is a number for rigid-block collapse, not a property of a material.

    Parameters
    ----------
    dead : wrench per block [N, N m], shape (n, 6)
    """
    x = assembly.arrays
    free = ~assembly.fixed
    # no less than the own weight: dead loads may cancel, or be left out
    load = np.linalg.norm(dead[free, :3], axis=1).sum()
    load = max(float(load), float(assembly.weights[free].sum()), 1e-300)
    # the foot: level joints with supports, without any all joints with supports, without these one joint of mean size
    at_support = assembly.held[x.block_a].any(axis=1) ^ assembly.held[x.block_b].any(axis=1)
    level = at_support & (np.abs(x.normal[:, 2]) > LEVEL)
    foot = level if level.any() else at_support
    area = x.area[foot].sum() if foot.any() else x.area.mean()
    size = float(np.median(np.cbrt(x.volume[free])))
    return load / area / (SETTLEMENT * size)


def joint_stiffness(
    assembly: Assembly, dead: Array, stiffness: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None
) -> tuple[Array, Array, list[str]]:
    """Stiffnesses kn and ks of every interface [Pa/m], shape (k,), and a warning where joints name none.

    Parameters
    ----------
    dead : wrench per block, which sets the default [N, N m], shape (n, 6)
    stiffness : kn, or (kn, ks), of all joints or per interface; by default those of the joints

    Raises
    ------
    InputError
        For numbers that are not positive and finite, more than two, and more or fewer than there are interfaces.
    NotApplicable
        For joints without shear stiffness.
    """
    x = assembly.arrays
    warnings: list[str] = []
    count = len(x.area)
    if stiffness is not None:
        pair = stiffness if isinstance(stiffness, tuple | list) else (stiffness, stiffness)
        given = [numbers("stiffness", v) for v in pair if v is not None]
        right = all(np.isfinite(v).all() and (v > 0.0).all() and v.shape in ((), (count,)) for v in given)
        if len(given) != 2 or not right:
            raise InputError(
                f"stiffness must be positive and finite, kn or (kn, ks) [Pa/m], each a number or {count}, one for each "
                f"joint, got {stiffness!r}"
            )
        for name, values in zip(("kn", "ks"), given, strict=True):
            if values.size:
                warn_of_stiffness(float(values.min()), f"stiffness: {name}")
        return np.full(count, given[0]), np.full(count, given[1]), warnings
    missing, standard = ~(x.normal_stiffness > 0.0), np.nan  # NaN where a joint names none
    if missing.any():
        standard = default_stiffness(assembly, dead)
        warnings.append(missing_stiffness(int(missing.sum()), count, standard))
    kn = np.where(missing, standard, x.normal_stiffness)
    ks = np.where(np.isnan(x.shear_stiffness), kn, x.shear_stiffness)  # kn where a joint names no ks
    # a joint without shear stiffness would leave its blocks a free motion
    if not (ks > 0.0).all():
        raise NotApplicable(
            f"joint of interface {int(np.argmin(ks > 0))} has shear_stiffness 0: it must be positive here"
        )
    return kn, ks, warnings


def missing_stiffness(count: int, of: int, standard: float) -> str:
    """What to say of ``count`` joints, of so many, that name no stiffness and take the ``standard`` one [Pa/m]."""
    return (
        f"{count} of {of} joints name no stiffness: kn = ks = {standard:.3g} Pa/m is used, chosen so that the foot "
        f"shortens by {SETTLEMENT:g} of a block under the dead load; it is not a material property"
    )
