"""What the joints and zones of a zoned model have done so far, per interface and per zone."""

import numpy as np
from numpy.typing import NDArray

from dem.joint_marks import ROUNDING, JointMarks
from dem.kernels.arrays import LAW_C, LAW_FC, LAW_FT, LAW_KN, LAW_KS, LAW_MU, LAW_RATE, LAW_RATE_SLIP
from dem.kernels.yielding import SHEAR_NOW, SHEAR_PAST, TENSION_NOW, TENSION_PAST
from dem.zones.model import ZonedModel
from dem.zones.running import Reading

Array = NDArray[np.float64]

ELASTIC, AT_YIELD, YIELDED, TENSION = 0, 1, 2, 3
"""Marks of a zone: elastic, yields in shear now, yielded so before, failed in tension at any time."""


def zone_marks(flags: NDArray[np.int64]) -> NDArray[np.int64]:
    """Mark of every zone from the flags of its stress points, shape (e,); tension goes first."""
    whole = np.bitwise_or.reduce(flags, axis=1)
    out = np.where(whole & SHEAR_PAST, YIELDED, ELASTIC)
    out = np.where(whole & SHEAR_NOW, AT_YIELD, out)
    return np.where(whole & (TENSION_NOW | TENSION_PAST), TENSION, out)


def joint_marks(model: ZonedModel, now: Reading) -> JointMarks:
    """Marks per interface of the assembly, as :func:`dem.joint_marks.joint_marks` has them for rigid blocks."""
    p = model.contacts
    law = model.law[p.joint]
    kn, ks, mu, c, ft = (law[:, k] for k in (LAW_KN, LAW_KS, LAW_MU, LAW_C, LAW_FT))
    normal, shear, slip = now.normal, np.abs(now.shear), np.abs(p.slip)
    size = np.maximum(np.maximum(np.abs(normal), shear), 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        pulled = np.where(-normal > ROUNDING * size, -normal / ft, 0.0)
        sheared = np.where(shear > ROUNDING * size, shear / np.maximum(c + mu * normal, 0.0), 0.0)
        pressed = np.where(np.isfinite(law[:, LAW_FC]), normal / (kn * law[:, LAW_FC]), 0.0)
    used = np.minimum(np.nan_to_num(np.maximum(np.maximum(pulled, sheared), pressed), posinf=1.0), 1.0)
    # only crushing takes more from the lift than dilation gave
    depth = np.maximum(-p.lift, 0.0)
    plastic = (now.opening > (1.0 + ROUNDING) * ft / kn) | (slip > ROUNDING * size / ks)
    softens = (law[:, LAW_RATE] > 0.0) | (law[:, LAW_RATE_SLIP] > 0.0)
    failed = np.where(softens, p.damage > 0.0, plastic) | (depth > ROUNDING * size / kn)
    rows, count = model.interface[p.joint], len(model.assembly.interfaces)

    def largest(values: Array) -> Array:
        out = np.full(count, -np.inf)
        np.maximum.at(out, rows, values)
        return np.where(np.isfinite(out), out, np.nan)

    area = np.bincount(rows, p.area, count)
    with np.errstate(invalid="ignore"):
        part = np.bincount(rows, p.area * failed, count) / area
    return JointMarks(largest(now.opening), largest(slip), largest(depth), largest(used), part)
