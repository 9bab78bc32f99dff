"""What sensors measured of a structure's natural modes, and what a model predicts at them."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from limitmason.arrays import Array
from limitmason.checks import not_negative, numbers
from limitmason.errors import InputError
from limitmason.model.input import read_list, read_vector
from limitmason.storage.frozen import ReadOnly
from limitmason.vibration.modes import Modes

CLOSE = 0.01
"""Part of a frequency within which modes turn into each other with small changes of a model."""

_LOOKS_ALIKE = 1e-9  # of the largest singular value: shapes that differ by less at the sensors are one there
_NONE = 1e-300  # frequency or length that a part is of, instead of 0


@dataclass(frozen=True, eq=False)
class ModalTest(ReadOnly):
    r"""Frequencies and shapes measured at sensors, and what a model predicts of them.

    A predicted mode is given to each measured one, so that the sum of MAC x min(f / f', f' / f) is largest. Modes whose
    frequencies are close turn into each other with small changes: those of the model that are close to the one given
    are taken together. The measured shape u is then compared with its projection on the motions that they span,

    .. math:: p = V c, \quad c = \arg\min |u - V c|, \qquad f^2 = \sum c_i^2 f_i^2 / \sum c_i^2

    with V the predicted shapes of unit modal mass at the sensors, and f the Rayleigh quotient of that motion.

    Parameters
    ----------
    sensors : (point, direction) of every sensor, as for :func:`mac` [m]
    frequency : measured [Hz], shape (k,)
    shape : measured, one component per sensor up to a factor per mode, shape (k, s)
    close : part of a frequency within which modes are taken together [-]

    Raises
    ------
    InputError
        For shapes that do not fit the sensors, that are zero or complex, or frequencies that are not positive.

    Notes
    -----
    Wrong where few sensors make different modes look alike: then only frequencies tell them apart. Fitting the factor
    of a shape takes one freedom of its s components, so that the misfit of a right model is smaller by 1 / s.
    """

    sensors: Sequence[tuple[ArrayLike, str | ArrayLike]]
    frequency: Array
    shape: Array
    close: float = CLOSE

    def __post_init__(self) -> None:
        """Check the input and scale every shape so that its component of largest size is 1."""
        if not isinstance(self.sensors, Sequence):
            raise InputError(f"sensors must be a list of (point, direction), got {self.sensors!r}")
        placed(self.sensors)
        # a list and arrays of its own: what the caller holds may change, and is not frozen with the test
        object.__setattr__(self, "sensors", deepcopy(self.sensors))
        try:
            given = np.asarray(self.shape)
        except ValueError:
            raise InputError("shape: every mode must have as many numbers as there are sensors") from None
        if np.iscomplexobj(given) and np.any(np.imag(given)):
            raise InputError("shape must be real: compare complex shapes by mac, or turn each to its real part first")
        frequency, shape = numbers("frequency", self.frequency), numbers("shape", np.real(given))
        not_negative("close", self.close)
        if frequency.ndim != 1:
            raise InputError(f"frequency must be a list, one number for each mode [Hz], got {self.frequency!r}")
        if shape.shape != (len(frequency), len(self.sensors)):
            wanted = f"({len(frequency)}, {len(self.sensors)})"
            raise InputError(f"shape must have one row per mode and a column per sensor {wanted}: {shape.shape}")
        if not np.isfinite(shape).all():
            failed = int(np.argmin(np.isfinite(shape).all(axis=0)))
            raise InputError(f"shape must be finite, it is not at sensor {failed}: leave that sensor out")
        if not ((frequency > 0.0) & np.isfinite(frequency)).all() or not np.abs(shape).max(axis=1).all():
            raise InputError("every mode needs a positive frequency and a shape that is not zero at all sensors")
        largest = np.take_along_axis(shape, np.abs(shape).argmax(axis=1)[:, None], axis=1)
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "shape", shape / largest)

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def quantities(self) -> dict[str, float]:
        """Measured "frequency 1" [Hz], "mode 1 sensor 1" [-] and so on.

        The largest component of each shape is 1.
        """
        return self._named(self.frequency, self.shape)

    def predicted(self, found: Modes) -> dict[str, float]:
        """What the modes found of a model predict of these quantities, by the same names.

        Measured modes are assigned to those of the model one by one, so that the sum of MAC times the ratio of
        frequencies is largest: two modes of one shape at the sensors are told apart by frequency. Modes of the model
        whose frequencies lie within ``close`` may come out of a test in any mixture. The mixture nearest to what was
        measured is compared, with the frequency of its Rayleigh quotient.

        Raises
        ------
        InputError
            Where the model gives fewer modes than were measured.
        """
        if len(found) < len(self):
            raise InputError(f"{len(self)} modes were measured, the model gives {len(found)}")
        place, along = placed(self.sensors)
        # of unit modal mass, shape (modes of the model, sensors)
        theirs = np.asarray(np.einsum("kpi,pi->kp", found.at(place), along))
        ratio = np.minimum.outer(1.0 / self.frequency, 1.0 / np.maximum(found.frequency, _NONE))
        # the smaller over the larger, 1 where they agree
        ratio = ratio * np.minimum.outer(self.frequency, found.frequency)
        size = np.outer((self.shape**2).sum(axis=1), np.maximum((theirs**2).sum(axis=1), _NONE))
        # the sum of MAC times the ratio, largest where its opposite is least
        rows, columns = linear_sum_assignment(-((self.shape @ theirs.T) ** 2) / size * ratio)
        frequency, shape = np.zeros(len(self)), np.zeros(self.shape.shape)
        for measured, assigned in zip(rows, columns, strict=True):
            f = found.frequency[assigned]
            together = np.flatnonzero(np.abs(found.frequency - f) <= self.close * f)
            # rcond: modes that look alike at the sensors share the factor, where it would grow without bound
            c = np.linalg.lstsq(theirs[together].T, self.shape[measured], rcond=_LOOKS_ALIKE)[0]
            shape[measured] = c @ theirs[together]
            # a shape at right angles to all of them has no mixture, and the frequency of the mode it was given
            frequency[measured] = np.sqrt(c**2 @ found.frequency[together] ** 2 / (c @ c)) if c.any() else f
        return self._named(frequency, shape)

    def _named(self, frequency: Array, shape: Array) -> dict[str, float]:
        """Frequencies, (k,) [Hz], and components of shapes, (k, s) [-], by the names of :attr:`quantities`."""
        out = {f"frequency {k + 1}": float(f) for k, f in enumerate(frequency)}
        return out | {
            f"mode {k + 1} sensor {s + 1}": float(v) for k, row in enumerate(shape) for s, v in enumerate(row)
        }


def placed(sensors: Sequence[tuple[ArrayLike, str | ArrayLike]]) -> tuple[Array, Array]:
    """Points [m] and unit directions [-] of sensors, each of shape (s, 3).

    Parameters
    ----------
    sensors : (point, direction) of every sensor; "x", "-x", "y" ... or a vector of any length

    Raises
    ------
    InputError
        For no sensors, and by number for one that is not of this form.
    """
    place, along = [], []
    for k, sensor in enumerate(read_list("sensors", sensors)):
        try:
            point, direction = sensor
        except (TypeError, ValueError):
            raise InputError(
                f"sensor {k} must be (point, direction), as in ((0.4, 0, 1.2), 'y'), got {sensor!r}"
            ) from None
        way: Any = direction
        if isinstance(direction, str):
            if direction.lstrip("+-") not in ("x", "y", "z") or len(direction) > 2:
                raise InputError(f"sensor {k}: direction must be 'x', '-x', 'y' ... or a vector, got {direction!r}")
            way = np.eye(3)["xyz".index(direction[-1])] * (-1.0 if direction[0] == "-" else 1.0)
        place.append(read_vector(f"point of sensor {k}", point))
        along.append(read_vector(f"direction of sensor {k}", way))
        if not np.linalg.norm(along[-1]) > 0.0:
            raise InputError(f"sensor {k}: its direction must not be zero")
        along[-1] = along[-1] / np.linalg.norm(along[-1])
    if not place:
        raise InputError("give at least one sensor")
    return np.array(place), np.array(along)
