"""What the joints and zones of a zoned model have done so far, per interface and per zone."""

import numpy as np
from numpy.typing import NDArray

from dem.joint_marks import JointMarks, PointMarks, marks_of
from dem.kernels.yielding import SHEAR_NOW, SHEAR_PAST, TENSION_NOW, TENSION_PAST
from dem.zones.running import Reading
from dem.zones.zoned_model import ZonedModel

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
    points = PointMarks(now.opening, _size(p.slip), now.normal, _size(now.shear), p.lift, p.damage, p.area)
    return marks_of(points, model.law[p.joint], model.interface[p.joint], len(model.assembly.interfaces))


def _size(values: Array) -> Array:
    """Size of what lies along a joint, shape (m,): of numbers in the plane, of pairs in space."""
    return np.abs(values) if values.ndim == 1 else np.linalg.norm(values, axis=1)
