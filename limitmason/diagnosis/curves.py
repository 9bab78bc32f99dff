"""Measured curves as rows of a study: features with errors, or loads at points.

Neighbouring points of a curve share their errors (gap, slack, drift of a sensor, machine stiffness): 200 points are not
200 witnesses. How many they are is estimated from how the specimens' deviations go together along the curve.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.checks import count as whole
from limitmason.checks import finite
from limitmason.diagnosis.observations import EvidenceKind, Observation
from limitmason.errors import InputError

FEWEST = 4  # curves from which the number of effective points is estimated

_RISE = 0.3  # of the peak: between 10 and 40 % of it, where the stiffness is read
_REST = 0.01  # of the largest value of a column: what it may go the other way
_BESIDE = 0.25  # of the spacing of points, to either side of one, over which its slope is read; chosen


def features(specimen: Any, curve: Curve, *, load_error: float, displacement_error: float) -> list[Observation]:
    r"""Peak, stiffness, drift at the peak and residual of a curve, with their errors.

    The stiffness is that between 10 and 40 % of the peak, over a difference of displacements d: its relative error is
    :math:`\sqrt{2 l^2 + 2 (e / d)^2}` by the errors l and e of the columns. The drift at the peak is known no better
    than half the range in which the load is within 2 l of the peak. What is known no better than itself, is not
    positive, or cannot be read, is left out, with a warning. Another warns of a record that does not begin at zero. The
    residual is the load at the largest displacement: a model is to be read there, not where its own curve ends.

    Parameters
    ----------
    specimen : key of the specimen, which the observations carry
    curve : measured
    load_error : l, relative standard deviation of a load [-]
    displacement_error : e, standard deviation of a displacement, in the curve's unit

    Raises
    ------
    InputError
        For an error that is not positive, and a curve pushed the other way.
    """
    _check_errors(load_error, displacement_error)
    _refuse_other_way(specimen, curve)
    _say_if_not_from_zero(specimen, curve, load_error, displacement_error)
    found, top = curve.quantities, curve.peak
    near = curve.displacement[curve.load >= (1.0 - 2.0 * load_error) * top.load]
    # relative scatter and unit of every quantity
    rows = {"peak": (load_error, curve.load_unit), "residual": (load_error, curve.load_unit)}
    if "stiffness" in found:
        # displacements between 10 and 40 % of the peak lie this far apart
        between = _RISE * top.load / found["stiffness"]
        rows["stiffness"] = (float(np.sqrt(2.0) * np.hypot(load_error, displacement_error / between)),
                             f"{curve.load_unit}/{curve.displacement_unit}")
    if top.displacement > 0.0:
        spread = float(np.hypot(displacement_error, 0.5 * np.ptp(near))) / top.displacement
        rows["drift at peak"] = (spread, curve.displacement_unit)
    # a scatter is relative, so that quantities are compared by their logarithms
    gone = [q for q in rows if not found[q] > 0.0]
    vague = [q for q, (scatter, _) in rows.items() if scatter >= 1.0 and q not in gone]
    for names, why in ((gone, "it is not positive"), (vague, "its error is as large as itself")):
        if names:
            warnings.warn(f"{', '.join(names)} of specimen {specimen}: left out, {why}", stacklevel=2)
    return [Observation(specimen, q, found[q], *rows[q]) for q in rows if q not in gone and q not in vague]


def points(
    measured: Mapping[Any, Curve],
    predicted: Mapping[Any, Curve] | None = None,
    *,
    load_error: float,
    displacement_error: float,
    count: int = 8,
) -> tuple[list[Observation], float]:
    """Loads at evenly spaced displacements, and how many of a curve are independent.

    A load's relative error is that of the load cell and that of the displacement times the slope. Of each curve as many
    points are kept, evenly spaced to its end, as it has effective ones; what these still share within a specimen the
    study estimates (``shared`` of :class:`~limitmason.diagnosis.Study`).

    Parameters
    ----------
    measured : by specimen
    predicted : by the baseline, at least as long, from which deviations are taken; without, or for fewer than four
        curves, the points of a curve count as one
    load_error, displacement_error : as for :func:`features`
    count : points of each curve at which deviations are looked at, and most that are kept

    Returns
    -------
    rows, effective : quantities "load at X" with X in the curve's unit, as :func:`limitmason.answer` finds them

    Raises
    ------
    InputError
        For errors that are not positive, a predicted curve that is missing, too short or in other units, loads that
        are not positive, and a curve pushed the other way.
    """
    _check_errors(load_error, displacement_error)
    count = whole("count", count)

    def read(curve: Curve, some: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacements, loads and relative errors of ``some`` evenly spaced points."""
        x = np.linspace(0.0, curve.displacement.max(), some + 1)[1:]
        positive = curve.at(x) > 0.0
        if not positive.all():
            at = f"{x[int(np.argmin(positive))]:.4g} {curve.displacement_unit}"
            raise InputError(f"{curve}: no positive load at {at}, where a point is: cut the curve, or ask for fewer")
        # the slope carries an error of the displacement over to the load
        step = _BESIDE * x[0]
        # the curve has nothing before its begin and behind its end
        before, behind = np.maximum(x - step, curve.displacement.min()), np.minimum(x + step, x[-1])
        y, slope = curve.at(x), (curve.at(behind) - curve.at(before)) / (behind - before)
        return x, y, np.hypot(load_error, slope * displacement_error / y)

    for specimen, curve in measured.items():
        _refuse_other_way(specimen, curve)
    deviations = []
    for specimen, curve in measured.items() if predicted is not None else ():
        x, y, scatter = read(curve, count)
        other = None if predicted is None else predicted.get(specimen)
        mine, theirs = ("" if c is None else f"{c.displacement_unit}, {c.load_unit}" for c in (curve, other))
        if other is not None and mine != theirs:
            raise InputError(f"the curve of specimen {specimen!r} is measured in {mine} and predicted in {theirs}: "
                             "use curve.in_units")
        if other is None or not (other.at(x) > 0.0).all():
            raise InputError(f"the predicted curve of specimen {specimen!r} is missing, ends before the measured, or "
                             "falls to zero")
        deviations.append(np.log(y / other.at(x)) / scatter)
    effective = effective_points(np.array(deviations)) if len(deviations) >= FEWEST else 1.0
    return [
        Observation(
            specimen=specimen, quantity=f"load at {at:.6g}", value=value, scatter=sd, unit=curve.load_unit,
            kind=EvidenceKind.FORCE, counted=(len(curve.load), effective),
        )
        for specimen, curve in measured.items() for at, value, sd in zip(*read(curve, int(effective)), strict=True)
    ], effective


def _check_errors(load_error: float, displacement_error: float) -> None:
    """Refuse errors of loads [-] and of displacements that are not positive."""
    for name, error in (("load", load_error), ("displacement", displacement_error)):
        if not finite(f"the error of {name}", error) > 0.0:
            raise InputError(f"the errors of load and displacement must be positive, got {name}_error={error!r}")


def _say_if_not_from_zero(specimen: Any, curve: Curve, load_error: float, displacement_error: float) -> None:
    """Warn of a curve that begins off zero by more than its errors, or has no stiffness."""
    (u, f), top = (column[0] for column in curve), curve.peak.load
    if abs(u) > 2.0 * displacement_error or abs(f) > 2.0 * load_error * abs(top):
        warnings.warn(f"the curve of specimen {specimen} begins at {u:.4g} {curve.displacement_unit} and {f:.4g} "
                      f"{curve.load_unit}: an offset is read as displacement and load", stacklevel=3)
    try:
        curve.stiffness()
    except InputError as unread:
        warnings.warn(f"stiffness of specimen {specimen}: left out, {unread}", stacklevel=3)


def _refuse_other_way(specimen: Any, curve: Curve) -> None:
    """Refuse a ``curve`` of negative displacements, loads, or both: pushes go one way."""
    turn = [-1.0 if column.max() <= -_REST * column.min() and column.min() < 0.0 else 1.0 for column in curve]
    if min(turn) < 0.0:
        u, f = turn
        mirrored = f"curve.in_units({curve.displacement_unit!r}, {u}, {curve.load_unit!r}, {f})"
        what = "pushed the other way" if u == f else f"of {'displacements' if u < 0.0 else 'loads'} below zero alone"
        raise InputError(f"the curve of specimen {specimen!r} is {what}: give {mirrored}")


def effective_points(deviations: np.ndarray) -> float:
    r"""Independent points that a curve is worth, (tr S)^2 / tr S^2.

    S is the covariance of deviations along it.

    Both traces are estimated without bias for normal deviations, with C their covariance in the sample and m its
    degrees of freedom: :math:`E\,tr C^2 = (1 + 1/m) tr S^2 + (tr S)^2 / m`, :math:`E (tr C)^2 = (tr S)^2 + 2 tr S^2/m`.

    Parameters
    ----------
    deviations : of every curve at every point, shape (curves, points); their mean over the curves is taken off

    Notes
    -----
    Between 1 and the number of points. A cause that acts on the curves differently lowers it too: to the safe side.
    M. S. Srivastava (2005), Some tests concerning the covariance matrix in high dimensional data.
    """
    m, k = len(deviations) - 1, deviations.shape[1]
    about = deviations - deviations.mean(axis=0)
    sample = about.T @ about / m
    # of the sample: tr C^2 and (tr C)^2; from them, by both equations above, tr S^2 and (tr S)^2
    sample_of_square, sample_squared = float((sample**2).sum()), float(np.trace(sample)) ** 2
    of_square = (sample_of_square - sample_squared / m) / (1.0 + 1.0 / m - 2.0 / m**2)
    squared = sample_squared - 2.0 * of_square / m
    # an estimate of tr S^2 may come out negative, where nothing along the curve goes together
    return float(np.clip(squared / of_square, 1.0, k)) if of_square > 0.0 else float(k)
