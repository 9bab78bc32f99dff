"""What a calibration aims at: measured numbers, frequencies and curves with their scatter, and how a model is read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.checks import choice, count, finite, instance, numbers
from limitmason.errors import InputError

FIRST_CRACK = "first crack"
FEATURES = ("stiffness", FIRST_CRACK, "peak", "peak displacement", "residual", "area")
"""What can be read off a curve; residual and area at and up to the end of the measured one."""

POINT = "point"
"""What is read where points along a curve are to be met."""

RISE = (0.1, 0.4)
"""Shares of the peak between which the initial stiffness is the secant [-]."""


@dataclass(frozen=True)
class Target:
    """A measured number, or several of one kind such as natural frequencies.

    Parameters
    ----------
    value : measured; of several, the model's are compared in the order given, so that modes must be paired before
    scatter : standard deviation, relative to the value unless ``absolute``; None where nothing is known of it
    absolute : the scatter is in the unit of the value, and differences count instead of ratios
    unit : shown in tables

    Raises
    ------
    InputError
        For values that are not finite, a ratio to a value that is not positive, a scatter that is not positive, or a
        relative one of 1 and more.
    """

    value: float | Sequence[float]
    scatter: float | None = None
    absolute: bool = False
    unit: str = "-"

    def __post_init__(self) -> None:
        """Check every field."""
        values = np.atleast_1d(numbers("the value of a target", self.value))
        if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
            raise InputError(f"a target needs one or more finite values, got {self.value!r}")
        if self.absolute and self.scatter is None:
            raise InputError("an absolute scatter must be given as a number")
        if not self.absolute and not (values > 0.0).all():
            raise InputError(
                f"a target of {self.value!r} is not positive: give its scatter in its own unit, absolute=True"
            )
        _check_scatter(self.scatter, self.absolute)
        if np.ndim(self.value):
            object.__setattr__(self, "value", tuple(values.tolist()))


@dataclass(frozen=True, eq=False)
class CurveTarget:
    """A measured curve: what is read off it, or points along it.

    Parameters
    ----------
    curve : measured, monotonic in displacement where ``points``, "residual" or "area" are asked for
    scatter : relative standard deviation of every feature, one number or one by feature; None where unknown
    features : some of ``FEATURES``; the first crack is the event of that name on both curves
    points : number of points of equal spacing along the displacement of the measured curve, instead of features or
        beside them; their scatter is relative to the measured peak. Each counts as a number of its own, though the
        points of one curve share errors, which the fit warns of: few points, or a larger ``point_scatter``
    point_scatter : of the points; None is that of the features where it is one number

    Raises
    ------
    InputError
        For unknown features, nothing asked for, and a scatter of points where none are. A feature that the measured
        curve lacks is refused by :func:`limitmason.calibrate`.
    """

    curve: Curve
    scatter: float | Mapping[str, float] | None = None
    features: Sequence[str] = ("stiffness", "peak", "area")
    points: int = 0
    point_scatter: float | None = None

    def __post_init__(self) -> None:
        """Check every field."""
        instance("the curve of a target", self.curve, Curve)
        features = (self.features,) if isinstance(self.features, str) else tuple(self.features)
        object.__setattr__(self, "features", features)
        for name in features:
            choice("a feature of a curve", name, FEATURES)
        object.__setattr__(self, "points", count("points along a curve", self.points, least=0))
        if not features and not self.points:
            raise InputError("nothing is asked of the curve: name features or a number of points")
        if self.point_scatter is not None and not self.points:
            raise InputError("point_scatter is that of points along the curve, and none are asked for: give points=")
        if isinstance(self.scatter, Mapping):
            for name in self.features:
                if name not in self.scatter:
                    raise InputError(f"the scatter of {name!r} is not given")
            if idle := [name for name in self.scatter if name not in self.features]:
                raise InputError(f"a scatter is given of {idle[0]!r}, which is not among the features asked for")
        for scatter in (*(self.scatter.values() if isinstance(self.scatter, Mapping) else (self.scatter,)),
                        self.point_scatter):
            _check_scatter(scatter)


class OutputValue(NamedTuple):
    """One number of what a model returns.

    Parameters
    ----------
    output : its name
    what : "number", a feature of a curve, or "point"
    at : of a "number" its index; of a feature or a point the displacement it needs, in the curve's unit
    """

    output: str
    what: str = "number"
    at: float = 0.0

    def of(self, outputs: Mapping[str, Any]) -> float:
        """The number read from the outputs, or NaN where a curve has none.

        A curve has none where it does not reach so far, or has no such event.

        Raises
        ------
        InputError
            Where the model returns no such output, or another kind of thing.
        """
        if self.output not in outputs:
            known = ", ".join(map(str, outputs)) or "nothing"
            raise InputError(f"the model returns no {self.output!r}; it returns: {known}")
        found = outputs[self.output]
        if self.what == "number":
            try:
                values = np.atleast_1d(np.asarray(found, dtype=float))
            except (TypeError, ValueError):
                raise InputError(f"the model's {self.output!r} is no number: {found!r}") from None
            if values.ndim > 1:
                raise InputError(f"the model's {self.output!r} is an array of shape {values.shape}, not a sequence")
            return float(values[int(self.at)]) if int(self.at) < len(values) else math.nan
        if not isinstance(found, Curve):
            raise InputError(f"the model's {self.output!r} must be a Curve, as the target is, got {found!r}")
        return feature(found, self.what, self.at)


class Entry(NamedTuple):
    """One number to be met.

    Parameters
    ----------
    test : name of the test
    label : how it is called in tables
    reading : how it is read off what a model returns
    measured : in ``unit``
    scatter : standard deviation, relative [-] or in ``unit``; None where it is not known
    relative : whether it is compared by its ratio, else by its difference
    unit : shown in tables
    """

    test: str
    label: str
    reading: OutputValue
    measured: float
    scatter: float | None
    relative: bool
    unit: str = "-"

    def misfit(self, predicted: float) -> float:
        """log(predicted / measured) [-], or the difference in ``unit``; NaN for what cannot be compared.

        ``predicted`` is in the unit of the measured number.
        """
        if not math.isfinite(predicted) or (self.relative and predicted <= 0.0):
            return math.nan
        return math.log(predicted / self.measured) if self.relative else predicted - self.measured


def feature(curve: Curve, what: str, at: float) -> float:
    """A feature of a curve in its units, NaN where it has none or ends before ``at``.

    Parameters
    ----------
    curve : measured or computed
    what : one of ``FEATURES``, or "point"
    at : displacement of a point or residual, or up to which the area counts, in the curve's unit
    """
    if what == "stiffness":
        try:
            return curve.stiffness(*RISE)
        except InputError:  # begins above the lower share: no rise was recorded
            return math.nan
    if what == FIRST_CRACK:
        crack = curve.event(FIRST_CRACK)
        return math.nan if crack is None else crack.load
    if what == "peak":
        return curve.peak.load
    if what == "peak displacement":
        return curve.peak.displacement
    if what in ("residual", POINT):
        return float(curve.at(at))
    if what == "area":
        end = float(curve.at(at))
        inside = curve.displacement < at
        u, f = np.append(curve.displacement[inside], at), np.append(curve.load[inside], end)
        return float((0.5 * (f[1:] + f[:-1]) * np.diff(u)).sum())
    raise InputError(f"unknown feature {what!r} of a curve")


def entries_of(test: str, name: str, target: Any) -> list[Entry]:
    """Entries that one target asks for, one for every number.

    A plain number or a pair (value, scatter) stands for a :class:`Target`.

    Parameters
    ----------
    test : name of the test, for labels
    name : of the model's output
    target : what was measured

    Raises
    ------
    InputError
        For something else, and for a feature that the measured curve lacks.
    """
    if isinstance(target, Curve):
        target = CurveTarget(target)
    if isinstance(target, CurveTarget):
        return _entries_of_curve(test, name, target)
    if isinstance(target, tuple) and len(target) == 2:
        target = Target(*target)
    elif isinstance(target, Real) and not isinstance(target, bool):
        target = Target(float(target))
    if isinstance(target, list | np.ndarray):
        raise InputError(f"target {name!r} of several numbers: write Target(values, 0.05), 0.05 for 5 % of each")
    if not isinstance(target, Target):
        raise InputError(f"target {name!r} must be a Target, a CurveTarget, a Curve or a number, got {target!r}")
    values = target.value if isinstance(target.value, tuple) else (float(target.value),)  # type: ignore[arg-type]
    return [
        Entry(
            test=test, label=name if len(values) == 1 else f"{name} {k + 1}",
            reading=OutputValue(name, "number", float(k)), measured=float(v), scatter=target.scatter,
            relative=not target.absolute, unit=target.unit,
        )
        for k, v in enumerate(values)
    ]


def _entries_of_curve(test: str, name: str, target: CurveTarget) -> list[Entry]:
    """Entries that a measured curve asks for: features, and loads at displacements.

    Parameters
    ----------
    test : name of the test, for labels
    name : of the model's output
    target : the curve, and what is asked of it
    """
    curve, out = target.curve, []
    end = float(curve.displacement[-1])
    units = {"stiffness": f"{curve.load_unit}/{curve.displacement_unit}", "peak displacement": curve.displacement_unit,
             "area": f"{curve.load_unit} {curve.displacement_unit}"}
    for what in target.features:
        value = feature(curve, what, end)
        if not value > 0.0:
            raise InputError(f"the measured curve {name!r} has no positive {what!r} (it is {value:g})")
        scatter = target.scatter[what] if isinstance(target.scatter, Mapping) else target.scatter
        reading = OutputValue(name, what, end if what in ("residual", "area") else 0.0)
        out.append(Entry(
            test=test, label=f"{name}: {what}", reading=reading, measured=value, scatter=scatter, relative=True,
            unit=units.get(what, curve.load_unit),
        ))
    spread = target.point_scatter
    if spread is None and not isinstance(target.scatter, Mapping):
        spread = target.scatter
    if target.points and spread is None:
        raise InputError(f"the points of curve {name!r} need a scatter, relative to the peak: point_scatter=")
    peak = abs(curve.peak.load)
    start = float(curve.displacement[0])
    for k in range(target.points):
        u = start + (end - start) * (k + 1) / target.points
        out.append(Entry(
            test=test, label=f"{name} at {u:.4g}", reading=OutputValue(name, POINT, u), measured=float(curve.at(u)),
            scatter=float(spread or 0.0) * peak, relative=False, unit=curve.load_unit,
        ))
    return out


def check_units(target: Any, found: Any, name: str) -> None:
    """Refuse a computed curve in other units than the measured one.

    Parameters
    ----------
    target : what was measured
    found : what was computed
    name : what it is called

    Raises
    ------
    InputError
        Naming both.
    """
    measured = target.curve if isinstance(target, CurveTarget) else target
    if isinstance(measured, Curve) and isinstance(found, Curve):
        a, b = (f"{c.displacement_unit}, {c.load_unit}" for c in (measured, found))
        if a != b:
            raise InputError(f"curve {name!r} was measured in {a} and is computed in {b}: use curve.in_units")


def outputs_of(result: Any) -> Mapping[str, Any]:
    """The result of a model, by name: a curve is "curve", a prediction has "multiplier", a number is "value"."""
    if isinstance(result, Mapping):
        return result
    if isinstance(result, Curve):
        return {"curve": result}
    if isinstance(result, Prediction):
        return {"multiplier": result.collapse_multiplier}
    return {"value": result}


def check_candidates(candidates: Any) -> None:
    """Refuse what is no mapping of tests that could be made, a model and scatters each."""
    if not candidates:
        raise InputError("no candidates are given")
    for name, given in candidates.items() if isinstance(candidates, Mapping) else [("", candidates)]:
        pair = given if isinstance(given, tuple | list) and len(given) == 2 else (None, None)
        if not callable(pair[0]) or not isinstance(pair[1], Mapping):
            raise InputError(f"candidates must read {{'test': (model, {{'peak': 0.05}})}}, got {given!r} for {name!r}")


def check_scatters(test: str, scatter: Mapping[str, float], given: Sequence[str]) -> None:
    """Refuse relative scatters of a test that could be made, where they tell nothing.

    Parameters
    ----------
    test : its name
    scatter : of every number that would be measured, by its name [-]
    given : names of the numbers that its model gives

    Raises
    ------
    InputError
        For no number, one that the model does not give, and a scatter outside 0 to 1.
    """
    if not scatter:
        raise InputError(f"candidate {test!r} measures nothing: give the scatter of one of {', '.join(given)}")
    for name, sd in scatter.items():
        if name not in given:
            raise InputError(f"candidate {test!r} gives no {name!r}; it gives {', '.join(given)}")
        _check_scatter(sd)


def _check_scatter(scatter: float | None, absolute: bool = False) -> None:
    """Refuse a scatter that is not positive, or a relative one of 1 and more.

    None says that it is unknown; ``absolute`` that it is in the unit of the value, and may be any size.
    """
    if scatter is None:
        return
    if not finite("a scatter", scatter) > 0.0:
        raise InputError(f"a scatter must be positive, 0.05 is 5 %; got {scatter!r}")
    if scatter >= 1.0 and not absolute:
        raise InputError(
            f"a scatter is relative, 0.05 is 5 %; got {scatter!r}, {100.0 * scatter:g} %: in the unit of the value "
            "it is Target(value, scatter, absolute=True)"
        )
