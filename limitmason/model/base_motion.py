"""Base motion: a stage of loading in which the ground follows a record of its acceleration."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import choice, finite, numbers, positive
from limitmason.constants import GRAVITY
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.model.input import read_vector
from limitmason.model.response_spectrum import ResponseSpectrum
from limitmason.model.stages import Stage
from limitmason.storage.csv_table import UNITS, separator, split, two_decimal_signs
from limitmason.storage.files import read_text

HOLD, COAST = "hold", "coast"

AT_REST = 0.01
"""A record ends at rest where its last velocity is below this fraction of its largest [-]."""

_UNEVEN = 0.01  # of the step, chosen: times in a file are rounded, by more than this a sample is missing
_ROUNDED = 1e-9  # of the step, chosen: a mean step that differs by more from the middle one tells of rounded times

_ACCELERATIONS = {"m/s2": 1.0, "cm/s2": 1e-2, "gal": 1e-2, "mm/s2": 1e-3, "g": GRAVITY}
_TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3}
# read in round brackets beside the known ones, and refused: without them a record in mg would be one in m/s2
_OTHER_UNITS = ("mg", "%g", "% g", "milli-g", "m", "cm", "mm", "in", "ft")


@dataclass(frozen=True)
class BaseMotion(Displayed, Stage):
    """Move all held blocks with a recorded ground acceleration.

    The stage is for the dynamic mode only.

    Parameters
    ----------
    acceleration : samples [m/s2], shape (k,) along ``direction``, or (k, 3): x, y and z at once
    sample_step : time between samples [s]; linear between them
    direction : unit vector of the motion, shape (3,); three components have none
    after : what the ground does when the record is over and it still moves. "hold": it stops dead, a blow of its whole
        velocity on everything that stands on it. "coast": it goes on at that velocity in the stages that follow, also
        in a run continued from the history. None: a record that ends with more than a hundredth of its largest velocity
        is refused where another stage follows, and named in the warnings where none does; what is left below that stops

    The displacement of the ground starts from the velocity that an earlier record left it with ("coast").
    """

    acceleration: Sequence[float] | Sequence[Sequence[float]] = ()
    sample_step: float = 0.01
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    after: str | None = None

    def __post_init__(self) -> None:
        """Check what can be checked without a model."""
        choice("BaseMotion: after", self.after, (None, HOLD, COAST))
        if isinstance(self.acceleration, str | Path):
            name = str(self.acceleration)
            raise InputError(f"BaseMotion takes numbers; a file is read by BaseMotion.from_csv({name!r})")
        record = numbers("BaseMotion: acceleration", self.acceleration)
        # an array or list of the user may be changed afterwards: the record may not
        object.__setattr__(self, "acceleration", _plain(record))
        if not np.isfinite(record).all():
            raise InputError("BaseMotion: the record has samples that are not finite")
        if not record.ndim or not record.size or len(record) < 2:
            raise InputError("BaseMotion: a record needs two samples of acceleration and more")
        if record.ndim != 1 and record.shape[1:] != (3,):
            raise InputError(f"BaseMotion: acceleration must have shape (k,) or (k, 3), got {record.shape}")
        positive("BaseMotion: sample_step", self.sample_step)
        if not np.linalg.norm(read_vector("BaseMotion: direction", self.direction)) > 0.0:
            raise InputError("BaseMotion: direction must not be zero")
        if record.ndim == 2 and tuple(self.direction) != BaseMotion.direction:
            raise InputError("BaseMotion: three components along x, y and z take no direction; leave it out")

    @classmethod
    def from_csv(
        cls, path: str | Path, *, units: str | None = None, scale: float = 1.0, column: int | Sequence[int] = 1,
        **settings: Any,
    ) -> BaseMotion:
        """A record from a CSV file.

        Time stands in the first column, acceleration in another. Lines of words are headings.

        Parameters
        ----------
        path : of the file
        units : of the acceleration: "m/s2", "cm/s2", "gal", "mm/s2" or "g"; where omitted, what its heading says in
            brackets or as its last word, as in "a [g]" and "a / g", or a line "# units: s,g" as other tables have, and
            m/s2 without any. Time is in seconds, or in "ms" where its heading says so
        scale : factor on the whole record [-]
        column : of the acceleration, counted from 0; three of them hold x, y and z, (1, 2, 3)
        settings : ``direction`` and ``after``, see above

        Raises
        ------
        InputError
            For an unknown unit, or another one than a known one of the heading, for a heading whose unit is unknown, or
            such as "acc_g", where ``units`` is omitted, for a line without an acceleration among those of numbers, and
            times that are not equally spaced; it names file and line. With ``units`` what else stands in brackets, as
            in "a [corrected]", is a remark.
        """
        known = ", ".join(_ACCELERATIONS)
        if units is not None and units not in _ACCELERATIONS:
            raise InputError(f"units must be one of {known}, got {units!r}")
        columns = list(column) if isinstance(column, Iterable) else [column]
        if len(columns) not in (1, 3) or not all(isinstance(c, int) and c > 0 for c in columns):
            raise InputError(f"column must be a whole number above 0, or three of them, got {column!r}")
        rows, headed, clock = _read_columns(path, columns, units)
        if len(rows) < 2:
            where = "" if column == 1 else f" in column {column}"
            raise InputError(f"{path}: no two lines of time, acceleration{where} (or with semicolons or tabs between)")
        for unit, number in headed.items():
            if unit not in _ACCELERATIONS:
                if units is None:
                    raise InputError(f"{path}, line {number}: the heading says {unit!r}; give units=, one of {known}")
            elif unit != (units or next(iter(headed))):
                raise InputError(f"{path}, line {number}: the heading says {unit}, not {units or next(iter(headed))}")
        factor = finite("scale", scale) * _ACCELERATIONS[units or next(iter(headed), "m/s2")]
        table = np.array(rows)
        time, a = _TIMES[clock] * table[:, 0], table[:, 1] if len(columns) == 1 else table[:, 1:]
        step = float(np.median(np.diff(time)))
        if not step > 0.0:
            raise InputError(f"{path}: times must grow from line to line; is the comma a decimal sign there?")
        uneven = np.flatnonzero(np.abs(np.diff(time) - step) > _UNEVEN * abs(step))
        if len(uneven):
            raise InputError(f"{path}: times must be equally spaced; after {time[uneven[0]]:g} s they are not")
        # of times that are rounded the middle step is one of two round numbers, and the record would be too long
        mean = float(time[-1] - time[0]) / (len(time) - 1)
        step = mean if abs(mean - step) > _ROUNDED * step else step
        return cls(tuple((factor * a).tolist()), step, **settings)

    @property
    def units(self) -> Array:
        """Directions of unit length of the components, shape (c, 3)."""
        if np.ndim(self.acceleration) == 2:
            return np.eye(3)
        d = np.asarray(self.direction, dtype=float)
        return (d / np.linalg.norm(d))[None]

    def left_over(self) -> tuple[Array, bool]:
        """Velocity at the end of the record [m/s], shape (3,), and whether it matters.

        It matters where it is more than a hundredth of the largest.
        """
        a = self._components
        # trapezes are exact: the record is linear between samples
        v = np.cumsum(0.5 * self.sample_step * (a[1:] + a[:-1]), axis=0)
        size = np.linalg.norm(v, axis=1)
        return v[-1] @ self.units, bool(size[-1] > AT_REST * size.max())

    @property
    def _components(self) -> Array:
        """Samples of every component [m/s2], shape (k, c)."""
        a = np.asarray(self.acceleration, dtype=float)
        return a.reshape(len(a), -1)

    def corrected(self) -> BaseMotion:
        """The record less its mean acceleration, so that it leaves the ground at rest.

        That corrects a constant error of the zero line, not one that drifts.
        """
        a, h = self._components, self.sample_step
        mean = 0.5 * h * (a[1:] + a[:-1]).sum(axis=0) / (h * (len(a) - 1))
        return replace(self, acceleration=(a - mean).reshape(np.shape(self.acceleration)))

    def spectrum(
        self, periods: ArrayLike | None = None, *, damping: float = 0.05, component: int = 0
    ) -> ResponseSpectrum:
        """Response spectrum of the record.

        Parameters
        ----------
        periods : of the oscillators [s]; 100 from 0.05 to 4 s where omitted
        damping : over the critical one [-]
        component : of a record with three: 0, 1 or 2 for x, y or z
        """
        component = int(choice("component", component, tuple(range(self._components.shape[1]))))
        return ResponseSpectrum.of_record(self._components[:, component], self.sample_step, periods, damping)

    def diagram(self) -> dict[str, Any]:
        """What ``plot()`` draws: acceleration of the ground over time [g]."""
        a = self._components / GRAVITY
        names = ["acceleration"] if a.shape[1] == 1 else list("xyz")
        columns = {"time": self.sample_step * np.arange(len(a))} | dict(zip(names, a.T, strict=True))
        return {"history": columns, "names": names, "against": "time", "units": {"time": "s"},
                "ylabel": "acceleration of the ground [g]"}

    def displacement(self, times: Array) -> Array:
        """Displacement by the record since the stage began [m], one column per direction in ``units``, shape (t, c).

        It is the exact second integral of the piecewise linear record, from rest: the velocity at which an earlier
        record left the ground ("coast") is added by the run. Times after the record, within the last step of a run,
        go on at its last velocity; what ``after`` says holds for the stages that follow.

        Parameters
        ----------
        times : since the stage began [s], shape (t,), or one
        """
        a, h = self._components, self.sample_step
        start = np.zeros((1, a.shape[1]))
        # velocities and displacements at the samples
        v = np.concatenate([start, np.cumsum(0.5 * h * (a[1:] + a[:-1]), axis=0)])
        u = np.concatenate([start, np.cumsum(h * v[:-1] + h * h * (2.0 * a[:-1] + a[1:]) / 6.0, axis=0)])
        # sample before each time, the time since then, and that since the end of the record
        times = np.atleast_1d(np.asarray(times, dtype=float))
        k = np.clip((times / h).astype(int), 0, len(a) - 2)
        r = np.clip(times - k * h, 0.0, h)[:, None]
        late = np.maximum(times - (len(a) - 1) * h, 0.0)[:, None]
        return u[k] + v[k] * r + 0.5 * a[k] * r**2 + (a[k + 1] - a[k]) / (6.0 * h) * r**3 + v[-1] * late


def _plain(record: Array) -> Any:
    """A record as numbers that nobody can change, or as tuples of three of them."""
    return tuple(map(tuple, record.tolist())) if record.ndim == 2 else tuple(np.atleast_1d(record).tolist())


def _read_columns(
    path: str | Path, columns: Sequence[int], units: str | None
) -> tuple[list[list[float]], dict[str, int], str]:
    """Numbers of a file and the units that its headings say.

    Parameters
    ----------
    path : of the file
    columns : numbers of those that hold an acceleration, counted from 0
    units : of the acceleration as the user says, None where the headings are to say it

    Returns
    -------
    rows : time and accelerations of every line of numbers, in the file's own units
    headed : units of acceleration in headings, and the line in which each stands
    clock : unit of time, "s" or "ms"
    """
    rows: list[list[float]] = []
    headed: dict[str, int] = {}
    clock, above = "s", ""
    typed: list[tuple[int, str]] = []  # cells as they stand in the file, where a comma may be a decimal sign
    for number, line in enumerate(read_text(path).splitlines(), 1):
        line = line.strip().removeprefix(UNITS.strip())
        between = separator(line)
        cells = split([line], between)
        try:
            rows.append([float(cells[0]), *(float(cells[c]) for c in columns)])
            typed += [(number, cell.strip()) for cell in line.split(between)] if between != "," else []
        except (ValueError, IndexError):
            # above the numbers it is a heading, among them a fault
            if rows and line.strip():
                raise InputError(f"{path}, line {number}: no time and acceleration in {line!r}") from None
            above = cells[0] if cells else ""
            headed |= {unit: number for c in columns if (unit := _unit(cells, c, _ACCELERATIONS))}
            bare = [cells[c] for c in columns if c < len(cells) and _ends_with_unit(cells[c])]
            if bare and units is None:
                words = f"is {bare[0]!r} in a unit? write that in brackets, or give units="
                raise InputError(f"{path}, line {number}: {words}") from None
            clock = _unit(cells, column=0, known=_TIMES) or clock
            if clock not in _TIMES:
                raise InputError(f"{path}, line {number}: time in {clock!r}; it is read in s or ms") from None
            continue
        # a time right above the first numbers is that of a sample
        if len(rows) == 1 and _is_number(above):
            raise InputError(f"{path}, line {number - 1}: a time, {above}, without an acceleration")
    if doubt := two_decimal_signs(typed):
        raise InputError(f"{path}: {doubt}")
    return rows, headed, clock


def _unit(cells: Sequence[str], column: int, known: Iterable[str]) -> str:
    """Unit in a heading, in lower case, or an empty word.

    It stands alone, in square brackets, or in round ones, where years and names stand too, or is the last word.

    Parameters
    ----------
    cells : of the heading
    column : whose unit is asked for, counted from 0
    known : units that are read alone, in round brackets and as the last word
    """
    if column < len(cells) and cells[column].strip().lower() in known:
        return cells[column].strip().lower()
    words = re.search(r"\[([^]]*)]|\(([^)]*)\)", cells[column]) if column < len(cells) else None
    if words is None:  # of a longer word only what is there by itself: not the g of "ag"
        last = _plain_unit(re.split(r"\s|(?<=\s)/", cells[column])[-1].lstrip("/")) if column < len(cells) else ""
        return last if last in known or (column > 0 and "/s" in last) else ""
    unit = _plain_unit(words[1] or words[2] or "")
    return unit if words[1] or unit in known or unit in _OTHER_UNITS or "/s" in unit else ""


def _plain_unit(text: str) -> str:
    """A unit in lower case and without signs of powers."""
    return text.strip().replace("²", "2").replace("^", "").lower()


def _ends_with_unit(cell: str) -> bool:
    """Whether a heading ends with a unit of acceleration that is neither a word of its own nor in brackets."""
    return "_" in cell and _plain_unit(cell.rsplit("_", 1)[1]) in _ACCELERATIONS


def _is_number(cell: str) -> bool:
    """Whether a cell holds a number."""
    try:
        return bool(np.isfinite(float(cell)))
    except ValueError:
        return False
