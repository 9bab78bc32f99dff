"""Modal assurance criterion: how alike the mode shapes of two models, or of a model and a test, are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from limitmason.arrays import Array
from limitmason.display.text_table import aligned
from limitmason.errors import InputError
from limitmason.model.input import read_vector
from limitmason.storage.frozen import ReadOnly
from limitmason.vibration.modes import Modes

Shapes = Modes | ArrayLike


_CLOSE = 0.01  # of a frequency: modes this near turn into each other with small changes of a model


class Alike(NamedTuple):
    """Modes of two models that span the same motions, and how well.

    Parameters
    ----------
    first, second : numbers of the modes, from 0; closely spaced ones together
    value : mean squared cosine of the principal angles between the smaller and the larger of the two spaces, 0 to 1
    """

    first: tuple[int, ...]
    second: tuple[int, ...]
    value: float


@dataclass(frozen=True, eq=False)
class Mac(ReadOnly):
    """Matrix of the criterion, 0 to 1.

    Row i, column j compares mode i of the first with mode j of the second.

    Parameters
    ----------
    values : [-], shape (k, l)
    frequency_a, frequency_b : [Hz], shapes (k,) and (l,); NaN where not given
    products : u^H W v, u^H W u and v^H W v of all shapes, shapes (k, l), (k, k), (l, l)
    """

    values: Array
    frequency_a: Array
    frequency_b: Array
    products: tuple[Array, Array, Array]

    @property
    def pairs(self) -> list[tuple[int, int, float]]:
        """For every mode of the first the mode of the second that is most like it.

        The criterion of the pair stands beside it.
        """
        best = self.values.argmax(axis=1)
        return [(i, int(j), float(self.values[i, j])) for i, j in enumerate(best)]

    @property
    def groups(self) -> list[Alike]:
        """Groups of the first, and those modes of the second that span the same motions.

        A group lies within 1 % in frequency.

        Shapes of equal or close frequencies are any that span the same motions: one by one they need not be alike.
        """
        theirs = _groups(self.frequency_b)
        out = []
        for mine in _groups(self.frequency_a):
            ranked = sorted(theirs, key=lambda g: -self._shared(mine, g).sum())
            chosen: list[int] = []
            while len(chosen) < len(mine) and ranked:
                chosen += ranked.pop(0)
            out.append(Alike(tuple(mine), tuple(sorted(chosen)), float(self._shared(mine, chosen).mean())))
        return out

    def _shared(self, a: list[int], b: list[int]) -> Array:
        """Squared cosines of the principal angles between two spaces (Bjorck and Golub 1973)."""
        cross, first, second = self.products
        u, v = (_root(x[np.ix_(g, g)]) for x, g in ((first, a), (second, b)))
        return np.asarray(np.linalg.svd(u.conj().T @ cross[np.ix_(a, b)] @ v, compute_uv=False) ** 2)

    def __str__(self) -> str:
        """Table of pairs.

        Modes of close frequencies stand together.
        """
        rows = [
            [_numbers(g.first), _hertz(self.frequency_a, g.first), _numbers(g.second),
             _hertz(self.frequency_b, g.second), f"{g.value:.3f}"]
            for g in self.groups
        ]  # fmt: skip
        text = aligned([["mode", "Hz", "is most like", "Hz", "MAC"], *rows], ">>>>>")
        if not any(len(g.first) + len(g.second) > 2 for g in self.groups):
            return text
        return f"{text}\nmodes within {_CLOSE:.0%} in frequency are compared by the motions that they span together"

    __repr__ = __str__


def _groups(frequency: Array) -> list[list[int]]:
    """Groups of modes whose frequencies follow each other closely.

    Without frequencies every mode is a group of its own.
    """
    out: list[list[int]] = []
    for i in np.argsort(frequency, kind="stable"):
        near = bool(out) and frequency[i] - frequency[out[-1][-1]] <= _CLOSE * frequency[i]
        if near:
            out[-1].append(int(i))
        else:
            out.append([int(i)])
    return sorted(out)


def _root(gram: Array) -> Array:
    """Columns that make vectors of these products orthonormal.

    There are fewer where the vectors depend on each other.
    """
    value, axes = np.linalg.eigh(gram)
    kept = value > 1e-10 * value.max()
    return np.asarray(axes[:, kept] / np.sqrt(value[kept]))


def _numbers(modes: tuple[int, ...]) -> str:
    return "+".join(str(i + 1) for i in modes)


def _hertz(frequency: Array, modes: tuple[int, ...]) -> str:
    low, high = (f"{f(frequency[list(modes)]):.4g}" for f in (np.min, np.max))
    return low if low == high else f"{low}-{high}"


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
        For shapes that do not fit the sensors, that are zero, or frequencies that are not positive.

    Notes
    -----
    Wrong where few sensors make different modes look alike: then only frequencies tell them apart. Fitting the factor
    of a shape takes one freedom of its s components, so that the misfit of a right model is smaller by 1 / s.
    """

    sensors: Sequence[tuple[ArrayLike, str | ArrayLike]]
    frequency: Array
    shape: Array
    close: float = _CLOSE

    def __post_init__(self) -> None:
        """Scale every shape to a largest component of 1."""
        frequency, shape = np.asarray(self.frequency, dtype=float), np.array(self.shape, dtype=float)
        if shape.shape != (len(frequency), len(self.sensors)) or not np.isfinite(shape).all():
            wanted = f"({len(frequency)}, {len(self.sensors)})"
            raise InputError(f"shape must be finite, one row per mode and a column per sensor {wanted}: {shape.shape}")
        if not (frequency > 0.0).all() or not np.abs(shape).max(axis=1).all():
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
        """What the modes of a model predict of these quantities, by the same names.

        Raises
        ------
        InputError
            Where the model gives fewer modes than were measured.
        """
        if len(found) < len(self):
            raise InputError(f"{len(self)} modes were measured, the model gives {len(found)}")
        place, along = _placed(self.sensors)
        theirs = np.asarray(np.einsum("kpi,pi->kp", found.at(place), along))
        ratio = np.minimum.outer(1.0 / self.frequency, 1.0 / np.maximum(found.frequency, 1e-300))
        ratio = ratio * np.minimum.outer(self.frequency, found.frequency)
        size = np.outer((self.shape**2).sum(axis=1), np.maximum((theirs**2).sum(axis=1), 1e-300))
        rows, columns = linear_sum_assignment(-((self.shape @ theirs.T) ** 2) / size * ratio)
        frequency, shape = np.zeros(len(self)), np.zeros(self.shape.shape)
        for mine, his in zip(rows, columns, strict=True):
            f = found.frequency[his]
            together = np.flatnonzero(np.abs(found.frequency - f) <= self.close * f)
            c = np.linalg.lstsq(theirs[together].T, self.shape[mine], rcond=1e-9)[0]
            shape[mine] = c @ theirs[together]
            frequency[mine] = np.sqrt(c**2 @ found.frequency[together] ** 2 / (c @ c)) if c.any() else f
        return self._named(frequency, shape)

    def _named(self, frequency: Array, shape: Array) -> dict[str, float]:
        out = {f"frequency {k + 1}": float(f) for k, f in enumerate(frequency)}
        return out | {
            f"mode {k + 1} sensor {s + 1}": float(v) for k, row in enumerate(shape) for s, v in enumerate(row)
        }


def mac(
    a: Shapes,
    b: Shapes,
    *,
    points: ArrayLike | None = None,
    sensors: Sequence[tuple[ArrayLike, str | ArrayLike]] | None = None,
    weighted: bool = False,
    masses: ArrayLike | None = None,
    frequencies: ArrayLike | None = None,
) -> Mac:
    """Modal assurance criterion of two sets of shapes.

    It is |a^H W b|^2 / ((a^H W a) (b^H W b)).

    Parameters
    ----------
    a, b : ``Modes`` of any two models of one structure, or shapes, real or complex: at points, shape (k, p, 3), or of
        sensors, one number each, shape (k, s)
    points : where shapes are compared [m], shape (p, 3); by default the blocks or nodes of the model that has fewer,
        those wholly held left out
    sensors : instead of points, (point, direction) of every sensor [m]; "x", "-x", "y" ... or a vector of any length
    weighted : by mass: with the mass matrix where both are modes of one model, else with the masses that the default
        points stand for; False: W = 1, the plain criterion
    masses : weights of chosen points or sensors instead [kg], shape (p,)
    frequencies : of the shapes that come without a model [Hz], shape (k,)

    Returns
    -------
    Mac
        The criterion shape by shape, and ``groups``: modes of close frequencies by the motions they span together.

    Raises
    ------
    InputError
        When shapes do not fit each other, are zero, or masses of chosen points are wanted and not given.

    Notes
    -----
    The factor and phase of a shape do not count. Modes of one model are orthogonal by mass alone: the plain criterion
    of a model with itself has small numbers beside its diagonal. Points on an axis of symmetry see nothing of half the
    modes: choose them over the whole structure. Source: Allemang and Brown (1982); Murano et al., equation 23, whose
    numerator is misprinted.
    """
    if masses is not None and not weighted:
        raise InputError("masses are used by the weighted criterion only: say weighted=True, or leave them out")
    frequency = _frequencies(a, b, frequencies)
    same = isinstance(a, Modes) and isinstance(b, Modes) and _one_model(a, b)
    if sensors is not None and points is not None:
        raise InputError("give points or sensors, not both")
    if same and weighted and points is None and sensors is None and masses is None:
        assert isinstance(a, Modes)
        assert isinstance(b, Modes)
        # unit modal mass makes M-products of vectors of the free unknowns
        matrix = a.system.mass
        u, v = (_free_vectors(m) for m in (a, b))
        return _compared((u @ matrix @ v.T, u @ matrix @ u.T, v @ matrix @ v.T), frequency)
    along = None
    if sensors is not None:
        points, along = _placed(sensors)
    where, weight = _where(a, b, points, masses, weighted)
    u, v = (_flat(m, where, along) for m in (a, b))
    if u.shape[1] != v.shape[1]:
        wanted = "say with sensors= where and along what each number was taken"
        if points is not None:
            wanted = f"shapes at points have three components each; of sensors with one, {wanted}"
        raise InputError(f"shapes with {u.shape[1]} and {v.shape[1]} components cannot be compared: {wanted}")
    w = np.ones(u.shape[1]) if weight is None else _per_component(weight, u.shape[1])
    return _compared(((u.conj() * w) @ v.T, (u.conj() * w) @ u.T, (v.conj() * w) @ v.T), frequency)


def _compared(products: tuple[Array, Array, Array], frequency: list[Array]) -> Mac:
    cross, first, second = products
    own_a, own_b = np.real(np.diag(first)), np.real(np.diag(second))
    if not ((own_a > 0.0).all() and (own_b > 0.0).all()):
        raise InputError("a shape is zero at all points that are compared")
    return Mac(np.abs(cross) ** 2 / np.outer(own_a, own_b), frequency[0], frequency[1], products)


def _frequencies(a: Shapes, b: Shapes, given: ArrayLike | None) -> list[Array]:
    """Frequencies of both sets, NaN where they are not known."""
    measured = [not isinstance(m, Modes) for m in (a, b)]
    if given is not None and sum(measured) != 1:
        raise InputError("frequencies are those of the shapes without a model, of which there must be one set")
    out = []
    for m in (a, b):
        if isinstance(m, Modes):
            out.append(m.frequency)
            continue
        own = np.full(len(np.asarray(m)), np.nan) if given is None else np.asarray(given, dtype=float)
        if own.shape != (len(np.asarray(m)),):
            raise InputError(f"frequencies must have shape ({len(np.asarray(m))},), got {own.shape}")
        out.append(own)
    return out


def _placed(sensors: Sequence[tuple[ArrayLike, str | ArrayLike]]) -> tuple[Array, Array]:
    """Points and unit directions of sensors, shapes (s, 3)."""
    place, along = [], []
    for k, (point, direction) in enumerate(sensors):
        way = direction
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


def _one_model(a: Modes, b: Modes) -> bool:
    x, y = a.system.mass, b.system.mass
    return a.shape.shape[1:] == b.shape.shape[1:] and x.shape == y.shape and abs(x - y).max() <= 1e-9 * abs(x).max()


def _free_vectors(m: Modes) -> Array:
    """Shapes on the free unknowns in their order, shape (k, r)."""
    r = m.system.mass.shape[0]
    numbers = m.system.spread(np.arange(1.0, r + 1.0)).ravel()
    place = np.zeros(r, dtype=np.intp)
    held = numbers == 0.0
    place[np.round(numbers[~held]).astype(np.intp) - 1] = np.flatnonzero(~held)
    return np.asarray(m.shape.reshape(len(m), -1)[:, place])


def _where(
    a: Shapes, b: Shapes, points: ArrayLike | None, masses: ArrayLike | None, weighted: bool
) -> tuple[Array | None, Array | None]:
    """Points [m] at which shapes are compared, and the masses they stand for.

    Without ``points`` they are the blocks that move in the coarser model, with its masses if ``weighted``. Without any
    model the points are None.
    """
    given = None if masses is None else np.asarray(masses, dtype=float)
    if points is not None:
        where = np.atleast_2d(np.asarray(points, dtype=float))
        if weighted and given is None:
            raise InputError("give the masses that chosen points stand for, or compare plainly (weighted=False)")
        if given is not None and given.shape != (len(where),):
            raise InputError(f"masses must have shape ({len(where)},), got {given.shape}")
        return where, given
    models = [m for m in (a, b) if isinstance(m, Modes)]
    if not models:
        if weighted and given is None:
            raise InputError("shapes without a model have no masses: give them")
        return None, given
    if len(models) == 1:
        raise InputError("give the points, or the sensors, at which the shapes without a model were taken")
    coarse = min(models, key=lambda m: int(m.system.carrier.moving.sum()))
    kept = coarse.system.carrier.moving
    weight = coarse.system.carrier.masses[kept] if weighted else None
    return coarse.places[kept], given if given is not None else weight


def _flat(m: Shapes, where: Array | None, along: Array | None) -> Array:
    if isinstance(m, Modes):
        assert where is not None
        u = m.at(where)
        return np.asarray(u.reshape(len(m), -1) if along is None else np.einsum("kpi,pi->kp", u, along))
    shapes = np.asarray(m)
    if shapes.ndim < 2 or not np.isfinite(shapes).all():
        raise InputError(f"shapes must be finite and of shape (k, p, 3) or (k, p), got shape {shapes.shape}")
    return shapes.reshape(len(shapes), -1)


def _per_component(weight: Array, length: int) -> Array:
    if length % len(weight):
        raise InputError(f"{len(weight)} masses do not fit shapes of {length} components")
    return np.repeat(weight, length // len(weight))
