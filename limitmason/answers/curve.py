"""A load-displacement curve, whoever made it: a push-over by any method, a test, a target of calibration or diagnosis.

Displacement is the abscissa, in the order in which it was passed (cycles turn back); load the ordinate, conjugate to it
where the work is asked for. Both are in the units that the curve names.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.references import Citable, Cited
from limitmason.arrays import Array, Flags
from limitmason.checks import finite, numbers
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.storage.csv_table import Tabular
from limitmason.storage.frozen import ReadOnly

_SECANT_FROM, _SECANT_TO = 0.1, 0.4
"""Shares of the peak load between which a secant stiffness is taken, unless other ones are asked for; chosen."""

_REST = 0.01  # of the range of a column: noise about zero, at rest; chosen
_ULTIMATE = 0.8
"""Share of the peak to which the load has fallen at the ultimate displacement, as is customary."""


class Energy(NamedTuple):
    """Energy up to every sample [J], shape (n,) each.

    Parameters
    ----------
    live : work of the live loads
    dead : work of the dead loads
    stored : elastic energy
    lost : by slip, crushing and cracks of a solid
    error : live + dead - stored - lost - broken - jumped, over the gross work |dW_live| + |dW_dead| so far [-]
    broken : by joints which lose strength over an opening; None where a theory has no such part
    jumped : taken by jumps where they are followed; None where a theory has no such part
    """

    live: Array
    dead: Array
    stored: Array
    lost: Array
    error: Array
    broken: Array | None = None
    jumped: Array | None = None


class Event(NamedTuple):
    """Something that happened along a curve.

    Parameters
    ----------
    name : in the field's terms ("first crack", "unit yields", "jump")
    index : of the sample at or after which it happened
    where : name of the joint or block; empty where it is of the whole structure
    value : what reached a threshold, in the unit of that; NaN where there is none
    """

    name: str
    index: int  # type: ignore[assignment]  # the field's word; nobody asks a tuple for its index here
    where: str = ""
    value: float = float("nan")


class CurvePoint(NamedTuple):
    """A point of a curve: sample, displacement and load in the curve's units."""

    index: int  # type: ignore[assignment]
    displacement: float
    load: float


@dataclass(frozen=True, eq=False)
class Curve(Displayed, Tabular, Citable, ReadOnly):
    """Load against displacement, with events on the way and how well points are known.

    Parameters
    ----------
    displacement : in ``displacement_unit``, shape (n,)
    load : in ``load_unit``, shape (n,)
    displacement_unit : "m" unless said otherwise
    load_unit : "N" unless said otherwise; "-" for a multiplier
    label : what a legend calls it
    events : in the order of their samples
    errors : named errors per sample, such as "energy" or "rate" [-], shape (n,) each
    states : state of the structure at every sample, opaque to the curve; empty where none were kept
    status : how the run ended; empty for a measured curve
    warnings : what a user should know before trusting the curve
    source : who measured or computed it
    references : papers behind it, for ``cite()``

    Raises
    ------
    InputError
        When the two columns differ in length, are empty or not finite, or an error or the states do not fit them.
    """

    displacement: Array
    load: Array
    displacement_unit: str = "m"
    load_unit: str = "N"
    label: str = ""
    events: tuple[Event, ...] = ()
    errors: Mapping[str, Array] = field(default_factory=dict)
    states: Sequence[Any] = ()
    status: str = ""
    warnings: tuple[str, ...] = ()
    source: str = ""
    references: tuple[Cited, ...] = ()

    def __post_init__(self) -> None:
        """Check that the columns fit each other, and freeze them."""
        for name in ("displacement", "load"):
            column = numbers(name, getattr(self, name)) + 0.0  # -0 is 0: nobody should read "-0 N"
            if column.ndim != 1 or not len(column):
                raise InputError(f"{name} must be a column of at least one number, got shape {column.shape}")
            if not np.isfinite(column).all():
                raise InputError(f"{name} is not finite at sample {int(np.argmin(np.isfinite(column)))}")
            object.__setattr__(self, name, column)
        n = len(self.displacement)
        if len(self.load) != n:
            raise InputError(f"the curve has {n} displacements and {len(self.load)} loads")
        errors = {name: numbers(f"error {name!r}", values) for name, values in self.errors.items()}
        for name, values in errors.items():
            if values.shape != (n,):
                raise InputError(f"error {name!r} has shape {values.shape}, the curve {n} samples")
        object.__setattr__(self, "errors", errors)
        if len(self.states) not in (0, n):
            raise InputError(f"there are {len(self.states)} states for {n} samples")
        events = tuple(self.events)
        outside = [e for e in events if not isinstance(e.index, Integral) or not 0 <= e.index < n]
        if outside:
            raise InputError(f"event {outside[0].name!r} is at sample {outside[0].index} of a curve of {n}")
        object.__setattr__(self, "events", tuple(sorted(events, key=lambda e: e.index)))

    def __len__(self) -> int:
        return len(self.displacement)

    def __iter__(self) -> Iterator[Array]:
        """Displacement and load, so that ``u, f = curve`` unpacks."""
        return iter((self.displacement, self.load))

    def point(self, index: int) -> CurvePoint:
        """The point at a sample.

        Negative numbers count from the end; a number outside the curve is an InputError.
        """
        if not isinstance(index, Integral) or not -len(self) <= index < len(self):
            raise InputError(f"point: give the number of a sample, 0 to {len(self) - 1}, got {index!r}")
        i = range(len(self))[index]
        return CurvePoint(i, float(self.displacement[i]), float(self.load[i]))

    @property
    def _sense(self) -> float:
        """Sign of the load in the sense of the push, -1 for a curve pushed the other way.

        That is one whose displacements and loads are both negative, but for a hundredth of their range.
        """
        # of displacement and load: the least, and the largest value
        lowest, highest = (np.array([f(c) for c in (self.displacement, self.load)]) for f in (np.min, np.max))
        other_way = ((lowest < 0.0) & (highest <= -_REST * lowest)).all()
        return -1.0 if other_way else 1.0

    @property
    def peak(self) -> CurvePoint:
        """Where the load is largest, in the sense in which it was pushed.

        Of several such samples it is the first.
        """
        return self.point(int(np.argmax(self._sense * self.load)))

    @property
    def first_limit_point(self) -> CurvePoint | None:
        """The first sample after which the load falls, or None while it only rises.

        A later branch may climb above it: ``peak`` is the largest load of all.
        """
        falls = np.flatnonzero(self._sense * np.diff(self.load) < 0.0)
        return self.point(int(falls[0])) if len(falls) else None

    def ultimate(self, share: float = _ULTIMATE) -> CurvePoint | None:
        """Where the load has first fallen to a share of its peak.

        It is None where it never does. The displacement is that on a straight line between two samples, the index that
        of the second. On a measured curve with cycles an unloading that is made up later is no fall.

        Parameters
        ----------
        share : of the peak load [-]
        """
        top = self.peak
        load = finite("share", share) * top.load
        fallen = self._sense * (self.load - load) <= 0.0
        below = np.flatnonzero((fallen & ~self._made_up(~fallen))[top.index :])
        if not len(below):
            return None
        k = top.index + int(below[0])
        # the peak itself, for a share of 1 or more, or a peak of zero; or further on after a cycle
        if k == top.index or fallen[k - 1]:
            return self.point(k)
        return CurvePoint(k, self._between(k, load), load)

    @property
    def _way(self) -> Array:
        """Displacements from the first sample on, towards that of the peak, shape (n,)."""
        way = self.displacement - self.displacement[0]
        return np.asarray(-way if way[self.peak.index] < 0.0 else way)

    def _made_up(self, borne: Flags) -> Flags:
        """Samples in an unloading from which the curve comes back, shape (n,).

        That is to its turning point or beyond, and ``borne``, shape (n,), again. A computed path has none: where it
        turns back, it snaps back.
        """
        x = self._way
        reached = np.maximum.accumulate(x)
        # the largest displacement at which the load is borne, of each sample and those behind it
        later = np.maximum.accumulate(np.where(borne, x, -np.inf)[::-1])[::-1]
        return np.asarray((x < reached) & (later >= reached) & (not self.status))

    def stiffness(self, low: float = _SECANT_FROM, high: float = _SECANT_TO) -> float:
        """Secant stiffness between two shares of the peak on the way up.

        It is load over displacement, in the curve's units, with crossings interpolated between samples.

        Parameters
        ----------
        low : share of the peak load at the lower end [-], 0 <= low < high
        high : share of the peak load at the upper end [-], at most 1

        Raises
        ------
        InputError
            For shares out of order, and where the curve starts above the lower one, rises without displacement, or has
            no load in the sense of the push.
        """
        if not 0.0 <= finite("low", low) < finite("high", high) <= 1.0:
            raise InputError(f"shares of the peak must satisfy 0 <= low < high <= 1, got {low!r} and {high!r}")
        top = self.peak
        if not self._sense * top.load > 0.0:
            raise InputError(f"the largest load is {top.load:g} {self.load_unit}: there is no way up to it")
        first, second = (self._crossing(share * top.load, top.index) for share in (low, high))
        if first == second:
            raise InputError(f"the load rises at one displacement, {first:g} {self.displacement_unit}: no secant there")
        return (high - low) * top.load / (second - first)

    def _crossing(self, load: float, last: int) -> float:
        """Displacement at which ``load`` is first reached on the way up to sample ``last``.

        That sample is a peak, of at least that load.
        """
        reached = np.flatnonzero(self._sense * (self.load[: last + 1] - load) >= 0.0)
        k = int(reached[0])
        if k == 0:
            # beyond the load from the start, so that the way up to it was not recorded
            if self._sense * (self.load[0] - load) > 0.0:
                raise InputError(f"the curve starts at {self.load[0]:g} {self.load_unit}, beyond {load:g}")
            return float(self.displacement[0])
        return self._between(k, load)

    def _between(self, k: int, load: float) -> float:
        """Displacement at which ``load`` is passed between samples k - 1 and k.

        The curve is a straight line between them.
        """
        x, y = self.displacement[k - 1 : k + 1], self.load[k - 1 : k + 1]
        return float(x[0] + (load - y[0]) / (y[1] - y[0]) * (x[1] - x[0]))

    @property
    def quantities(self) -> dict[str, float]:
        """What a test would write down, by name, in the curve's units.

        "peak" and "drift at peak" are always there, and "residual", the load at the end, of a measured curve with
        cycles or an unloading that at the largest displacement. "stiffness" is the secant of 10 to 40 % of the peak,
        "drift at 80 %" the displacement where the load has fallen so far. The first event of each name gives its load
        and its drift. What the curve does not show is left out.
        """
        top, ultimate = self.peak, self.ultimate()
        end = len(self) - 1 if self.status else int(np.flatnonzero(self._way == self._way.max())[-1])
        out = {"peak": top.load, "drift at peak": top.displacement, "residual": float(self.load[end])}
        with suppress(InputError):  # a secant needs a way up, from below its lower end
            out["stiffness"] = self.stiffness()
        if ultimate is not None:
            out["drift at 80 %"] = ultimate.displacement
        for event in reversed(self.events):  # of one name the first is written last
            at = self.point(event.index)
            out |= {event.name: at.load, f"drift at {event.name}": at.displacement}
        return out

    @property
    def work(self) -> Array:
        """Work of the load from the first sample on, by trapezoids, shape (n,).

        Its unit is that of the load times that of the displacement.
        """
        steps = 0.5 * (self.load[1:] + self.load[:-1]) * np.diff(self.displacement)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def at(self, displacement: ArrayLike) -> Array:
        """Load at given displacements, interpolated, NaN outside the curve.

        Parameters
        ----------
        displacement : in the curve's unit, a number or of any shape, which is that of the answer

        Raises
        ------
        InputError
            For a curve that turns back (cycles), which has no single load at a displacement.
        """
        steps, x, y = np.diff(self.displacement), self.displacement, self.load
        if (steps < 0.0).any() and (steps > 0.0).any():
            raise InputError("the curve turns back: it has no single load at a displacement; cut out one branch first")
        if (steps < 0.0).any():  # pushed the other way: np.interp takes rising displacements
            x, y = x[::-1], y[::-1]
        return np.interp(numbers("displacement", displacement), x, y, left=np.nan, right=np.nan)

    def event(self, name: str) -> CurvePoint | None:
        """The point of the first event of a name, or None where it did not happen."""
        return next((self.point(e.index) for e in self.events if e.name == name), None)

    def in_units(self, displacement_unit: str, displacement: float, load_unit: str, load: float) -> Curve:
        """This curve in other units.

        Parameters
        ----------
        displacement_unit : the new one
        displacement : factor on displacements [new unit / old unit]
        load_unit : the new one
        load : factor on loads [new unit / old unit]
        """
        return replace(
            self, displacement=self.displacement * finite("displacement", displacement),
            load=self.load * finite("load", load),
            displacement_unit=displacement_unit, load_unit=load_unit,
        )

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Displacement, load and errors with their units, and a row for each sample."""
        units = {"displacement": self.displacement_unit, "load": self.load_unit, **dict.fromkeys(self.errors, "-")}
        return units, list(zip(self.displacement, self.load, *self.errors.values(), strict=True))

    def __str__(self) -> str:
        """Peak, where it is, how the curve ended, and what to know before trusting it."""
        top = self.peak
        name = f"{self.label}: " if self.label else ""
        end = f"; {self.status}" if self.status else ""
        unit = "" if self.load_unit == "-" else f" {self.load_unit}"
        return (
            f"curve {name}{len(self)} samples to {self.displacement[-1]:.4g} {self.displacement_unit}, largest load "
            f"{top.load:.5g}{unit} at {top.displacement:.4g} {self.displacement_unit}{end}"
            + "".join(f"\n  note: {w}" for w in self.warnings)
        )

    def __repr__(self) -> str:
        return str(self)
