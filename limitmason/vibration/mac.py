"""Modal assurance criterion: how alike the mode shapes of two models, or of a model and a test, are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import numbers
from limitmason.display.notebook import Displayed
from limitmason.display.text_table import aligned
from limitmason.errors import InputError
from limitmason.storage.csv_table import Tabular
from limitmason.storage.frozen import ReadOnly
from limitmason.vibration.modal_test import CLOSE, ModalTest, placed
from limitmason.vibration.modes import Modes
from limitmason.vibration.sensor_shapes import (
    Shapes,
    as_rows,
    check_sensors,
    check_shapes,
    check_zeros,
    compared_points,
    per_component,
    unseen_modes,
)


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


ALIKE = 0.5
"""Criterion below which two shapes are not called alike [-]: more of them differs than is common."""

_DEPENDS = 1e-10
"""Squared length, over the largest, below which what is left of a vector is rounding: a hundred-thousandth of a length.
"""

_ONE_MASS = 1e-9  # of the largest entry: mass matrices of one model differ by their rounding


@dataclass(frozen=True, eq=False)
class Mac(Displayed, Tabular, ReadOnly):
    """Matrix of the criterion, 0 to 1.

    Row i, column j compares mode i of the first with mode j of the second.

    Parameters
    ----------
    values : the criterion, 0 where shapes are orthogonal, 1 where they are one up to a factor, shape (k, l)
    frequency_a, frequency_b : [Hz], shapes (k,) and (l,); NaN where not given
    products : u^H W v, u^H W u and v^H W v of all shapes, shapes (k, l), (k, k), (l, l)
    unseen : modes of the first and of the second, from 0, that hardly move along any sensor: their numbers are rounding
    """

    values: Array
    frequency_a: Array
    frequency_b: Array
    products: tuple[Array, Array, Array]
    unseen: tuple[tuple[int, ...], tuple[int, ...]] = ((), ())

    @property
    def pairs(self) -> list[tuple[int, int, float]]:
        """For every mode of the first the mode of the second that is most like it.

        The criterion of the pair stands beside it.
        """
        best = self.values.argmax(axis=1)
        return [(i, int(j), float(self.values[i, j])) for i, j in enumerate(best)]

    @property
    def groups(self) -> list[Alike]:
        """Groups of modes of the first set, and those of the second that span the same motions.

        A group lies within 1 % in frequency. Shapes of equal or close frequencies are any that span the same motions:
        one by one they need not be alike.
        """
        theirs = _groups(self.frequency_b)
        out = []
        for mine in _groups(self.frequency_a):
            # the groups most like it, until they are as many modes
            ranked = sorted(theirs, key=lambda g: -self._shared(mine, g).sum())
            chosen: list[int] = []
            while len(chosen) < len(mine) and ranked:
                chosen += ranked.pop(0)
            out.append(Alike(tuple(mine), tuple(sorted(chosen)), float(self._shared(mine, chosen).mean())))
        return out

    def _shared(self, a: list[int], b: list[int]) -> Array:
        """Squared cosines of the principal angles between two spaces, largest first.

        By Bjorck and Golub (1973).

        Parameters
        ----------
        a, b : numbers of the modes of the first and of the second set that span the spaces
        """
        cross, first, second = self.products
        u, v = (_root(x[np.ix_(g, g)]) for x, g in ((first, a), (second, b)))
        return np.asarray(np.linalg.svd(u.conj().T @ cross[np.ix_(a, b)] @ v, compute_uv=False) ** 2)

    def __str__(self) -> str:
        """Table of pairs.

        Modes of close frequencies stand together.
        """
        rows = [
            [_numbers(g.first), _hertz(self.frequency_a, g.first),
             *((_numbers(g.second), _hertz(self.frequency_b, g.second)) if g.value >= ALIKE else ("none", "")),
             f"{g.value:.3f}"]
            for g in self.groups
        ]
        lines = [aligned([["mode", "Hz", "is most like", "Hz", "MAC"], *rows], ">>>>>")]
        if any(len(g.first) + len(g.second) > 2 for g in self.groups):
            lines.append(f"modes within {CLOSE:.0%} in frequency are compared by the motions that they span together")
        for which, modes in zip(("first", "second"), self.unseen, strict=True):
            if modes:
                some = f"{'mode' if len(modes) == 1 else 'modes'} {', '.join(str(i + 1) for i in modes)} of the {which}"
                lines.append(f"{some}: no motion along any sensor; the numbers there are rounding")
        return "\n".join(lines)

    __repr__ = __str__

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Pairs with their units, and a row for each pair; modes count from 1."""
        units = {"mode": "-", "frequency": "Hz", "is most like": "-", "its frequency": "Hz", "MAC": "-"}
        return units, [[i + 1, self.frequency_a[i], j + 1, self.frequency_b[j], v] for i, j, v in self.pairs]


def _groups(frequency: Array) -> list[list[int]]:
    """Numbers of the modes, from 0, in groups of close frequencies.

    Each frequency of a group follows the last within ``CLOSE`` of it.

    Parameters
    ----------
    frequency : [Hz], shape (k,); NaN where unknown, which makes the mode a group of its own
    """
    groups: list[list[int]] = []
    for i in np.argsort(frequency, kind="stable"):
        # no comparison with NaN is true
        close = bool(groups) and frequency[i] - frequency[groups[-1][-1]] <= CLOSE * frequency[i]
        if close:
            groups[-1].append(int(i))
        else:
            groups.append([int(i)])
    return sorted(groups)


def _root(gram: Array) -> Array:
    """Matrix R that makes vectors orthonormal, R^H G R = 1.

    It has fewer columns where the vectors depend on each other.

    Parameters
    ----------
    gram : scalar products G of the vectors, Hermitian, shape (k, k)
    """
    value, axes = np.linalg.eigh(gram)
    kept = value > _DEPENDS * value.max()
    return np.asarray(axes[:, kept] / np.sqrt(value[kept]))


def _numbers(modes: tuple[int, ...]) -> str:
    """Numbers of modes as a table shows them, counted from 1."""
    return "+".join(str(i + 1) for i in modes)


def _hertz(frequency: Array, modes: tuple[int, ...]) -> str:
    """Frequency of modes [Hz], or the lowest and highest of several; "-" where it is not known."""
    low, high = (f"{f(frequency[list(modes)]):.4g}".replace("nan", "-") for f in (np.min, np.max))
    return low if low == high else f"{low}-{high}"


def mac(
    a: Shapes | ModalTest,
    b: Shapes | ModalTest,
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
    a, b : ``Modes`` of any two models of one structure, or shapes, real or complex: of sensors, one number each, shape
        (k, s), or at points, shape (k, p, 3); NaN in all modes where a component was not measured; or a
        :class:`ModalTest`, which brings sensors and frequencies
    points : where shapes are compared [m], shape (p, 3); by default the blocks or nodes of the model that has fewer,
        those wholly held left out
    sensors : instead of points, (point, direction) of every sensor [m]; "x", "-x", "y" ... or a vector of any length
    weighted : by mass: with the mass matrix where both are modes of one model, else with the masses that the default
        points stand for; False: W = 1, the plain criterion
    masses : weights of chosen points or sensors instead [kg], shape (p,)
    frequencies : of the shapes that come without a model [Hz], shape (k,); a pair of them where both do

    Returns
    -------
    Mac
        The criterion shape by shape, and ``groups``: modes of close frequencies by the motions they span together.

    Raises
    ------
    InputError
        When shapes do not fit each other or the sensors, or masses of chosen points are wanted and not given; when a
        component reads zero in every shape of a set without a model and not in the other: a zero is a motion that was
        measured.

    Notes
    -----
    The factor and phase of a shape do not count. Modes of one model are orthogonal by mass alone: the plain criterion
    of a model with itself has small numbers beside its diagonal. Points on an axis of symmetry see nothing of half the
    modes: choose them over the whole structure. Source: Allemang and Brown (1982); Murano et al., equation 23, whose
    numerator is misprinted.
    """
    tests = [m for m in (a, b) if isinstance(m, ModalTest)]
    if tests:
        if not (sensors is None and points is None and frequencies is None):
            raise InputError("a ModalTest has its own sensors and frequencies: leave sensors, points, frequencies out")
        sensors = tests[0].sensors
        if len(tests) == 2:
            _check_same_sensors(*tests)
    measured = [m.frequency if isinstance(m, ModalTest) else None for m in (a, b)]  # [Hz]
    a, b = (m.shape if isinstance(m, ModalTest) else m for m in (a, b))
    for name, m in (("a", a), ("b", b)):
        check_shapes(name, m)
    if masses is not None and not weighted:
        raise InputError("masses are used by the weighted criterion only: say weighted=True, or leave them out")
    if sensors is not None and points is not None:
        raise InputError("give points or sensors, not both")
    along = None  # directions of sensors; without them all three components of a point count
    if sensors is not None:
        points, along = placed(sensors)
        for m in (a, b):
            check_sensors(m, len(along))
    frequency = _frequencies(a, b, frequencies)
    frequency = [f if own is None else own for f, own in zip(frequency, measured, strict=True)]
    same = isinstance(a, Modes) and isinstance(b, Modes) and _one_model(a, b)
    if same and weighted and points is None and sensors is None and masses is None:
        assert isinstance(a, Modes)
        assert isinstance(b, Modes)
        # unit modal mass makes M-products of vectors of the free unknowns
        matrix = a.system.mass
        u, v = (_free_vectors(m) for m in (a, b))
        return _compared((u @ matrix @ v.T, u @ matrix @ u.T, v @ matrix @ v.T), frequency)
    where, weight = compared_points(a, b, points, masses, weighted)
    u, v = (as_rows(m, where, along) for m in (a, b))
    # points without directions: of shapes without a model they are those at which these were taken
    chosen = points is not None and along is None and where is not None
    if u.shape[1] != v.shape[1] or (chosen and u.shape[1] != 3 * len(where)):  # type: ignore[arg-type]
        wanted = "say with sensors= where and along what each number was taken"
        if points is not None:
            wanted = f"shapes at points have three components each; of sensors with one, {wanted}"
        raise InputError(f"shapes with {u.shape[1]} and {v.shape[1]} components cannot be compared: {wanted}")
    w = np.ones(u.shape[1]) if weight is None else per_component(weight, u.shape[1])
    kept = ~(np.isnan(u).all(axis=0) | np.isnan(v).all(axis=0))  # components that one of the sets did not measure
    u, v, w = u[:, kept], v[:, kept], w[kept]
    # without any place a table of (k, s) is one of sensors, whose columns are no axes of points
    one_each = along is not None or (where is None and np.ndim(a) == np.ndim(b) == 2)  # type: ignore[arg-type]
    blanks = not isinstance(a, Modes), not isinstance(b, Modes)  # a zero of a model is a motion that it does not make
    check_zeros(u, v, np.flatnonzero(kept), one_each, blanks)
    unseen = tuple(unseen_modes(m, where, along) for m in (a, b))
    return _compared(((u.conj() * w) @ v.T, (u.conj() * w) @ u.T, (v.conj() * w) @ v.T), frequency, unseen)


def _check_same_sensors(a: ModalTest, b: ModalTest) -> None:
    """Refuse two tests whose sensors stand at other places, look along other directions or come in another order."""
    (place, along), (other_place, other_along) = placed(a.sensors), placed(b.sensors)
    if len(place) != len(other_place):
        raise InputError(f"the tests have {len(place)} and {len(other_place)} sensors: compare those they share")
    same = np.isclose(np.hstack([place, along]), np.hstack([other_place, other_along])).all(axis=1)
    if not same.all():
        raise InputError(
            f"sensor {int(np.argmin(same))} of the two tests differs in place or direction: take the sensors that they "
            "share, in one order and with one sign"
        )


def _compared(
    products: tuple[Array, Array, Array], frequency: list[Array], unseen: tuple[tuple[int, ...], ...] = ((), ())
) -> Mac:
    """MAC_ij = |C_ij|^2 / (A_ii B_jj) from the products of two sets of shapes.

    A mode that moves nothing is refused.

    Parameters
    ----------
    products : C of the two sets with each other, A and B of each with itself; (k, l), (k, k), (l, l)
    frequency : of both sets [Hz], shapes (k,) and (l,)
    unseen : numbers of the modes of either set that no sensor sees
    """
    cross, first, second = products
    own = [np.real(np.diag(g)) for g in (first, second)]
    for which, square in zip(("first", "second"), own, strict=True):
        if not (square > 0.0).all():
            number = int(np.argmin(square)) + 1
            raise InputError(f"mode {number} of the {which} set is zero at all points or sensors that are compared")
    values = np.abs(cross) ** 2 / np.outer(*own)
    return Mac(values, frequency[0], frequency[1], products, (unseen[0], unseen[1]))


def _frequencies(a: Shapes, b: Shapes, given: ArrayLike | None) -> list[Array]:
    """Frequencies of both sets [Hz], shapes (k,) and (l,), NaN where they are not known.

    Parameters
    ----------
    a, b : modes of a model, which have their own, or shapes
    given : of the set without a model, (k,), or a pair of them where both have none
    """
    without = [i for i, m in enumerate((a, b)) if not isinstance(m, Modes)]
    out = [m.frequency if isinstance(m, Modes) else np.full(len(np.asarray(m)), np.nan) for m in (a, b)]
    if given is None:
        return out
    if not without:
        raise InputError("frequencies are of shapes without a model, and both sets are modes of one: leave them out")
    pair: Sequence[Any] = [given] if len(without) == 1 else given if isinstance(given, list | tuple) else []
    if len(without) == 2 and (len(pair) != 2 or not all(np.ndim(p) == 1 for p in pair)):
        raise InputError("both sets come without a model: give their frequencies as a pair, (first, second)")
    for i, one in zip(without, pair, strict=True):
        own = numbers("frequencies", one)
        if own.shape != out[i].shape:
            raise InputError(f"frequencies must have shape {out[i].shape}, one for each shape, got {own.shape}")
        out[i] = own
    return out


def _one_model(a: Modes, b: Modes) -> bool:
    """Whether two sets are of one model: one mass matrix but for rounding, of unknowns that move the same."""
    x, y = a.system.mass, b.system.mass
    if a.shape.shape[1:] != b.shape.shape[1:] or x.shape != y.shape or abs(x - y).max() > _ONE_MASS * abs(x).max():
        return False
    # rows of equal blocks that stand on one or the other end have one mass matrix, of other blocks
    number = np.arange(1.0, x.shape[0] + 1.0)
    one, other = (m.system.spread(number) for m in (a, b))
    return bool(np.abs(one - other).max() <= _ONE_MASS * np.abs(one).max())


def _free_vectors(m: Modes) -> Array:
    """Shapes of the modes ``m`` of a model on its free unknowns, in their order, shape (k, r)."""
    # the numbers of the unknowns, spread as a shape is, show in which entry of a shape each stands; held ones are 0
    r = m.system.mass.shape[0]
    shown = m.system.spread(np.arange(1.0, r + 1.0)).ravel()
    shape, at = m.shape.reshape(len(m), -1), np.flatnonzero(shown)
    if np.array_equal(np.sort(shown[at]), np.arange(1.0, r + 1.0)):
        return np.asarray(shape[:, at[np.argsort(shown[at])]])
    # unknowns along other axes, as those of a plane that is turned: each is a part at right angles to the others
    out = np.empty((len(m), r))
    for k in range(r):
        own = m.system.spread(np.eye(1, r, k)[0]).ravel()
        out[:, k] = shape @ own / (own @ own)
    return out
