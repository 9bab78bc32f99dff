"""Modal assurance criterion: how alike the mode shapes of two models, or of a model and a test, are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitmason.errors import InputError
from limitmason.text_table import aligned
from limitmason.vibration.modes import Modes

Array = NDArray[np.float64]
Shapes = Modes | ArrayLike


@dataclass(frozen=True, eq=False)
class Mac:
    """Matrix of the criterion, 0 to 1; row i, column j compares mode i of the first with mode j of the second.

    Parameters
    ----------
    values : [-], shape (k, l)
    frequency_a, frequency_b : [Hz], shapes (k,) and (l,); NaN where not given
    """

    values: Array
    frequency_a: Array
    frequency_b: Array

    @property
    def pairs(self) -> list[tuple[int, int, float]]:
        """For every mode of the first the mode of the second that is most like it, and the criterion of the pair."""
        best = self.values.argmax(axis=1)
        return [(i, int(j), float(self.values[i, j])) for i, j in enumerate(best)]

    def __str__(self) -> str:
        """Table of pairs."""
        rows = [
            [str(i + 1), f"{self.frequency_a[i]:.4g}", str(j + 1), f"{self.frequency_b[j]:.4g}", f"{v:.3f}"]
            for i, j, v in self.pairs
        ]
        return aligned([["mode", "Hz", "is most like", "Hz", "MAC"], *rows], ">>>>>")

    __repr__ = __str__


def mac(
    a: Shapes,
    b: Shapes,
    *,
    points: ArrayLike | None = None,
    weighted: bool = False,
    masses: ArrayLike | None = None,
) -> Mac:
    """Modal assurance criterion |a^H W b|^2 / ((a^H W a) (b^H W b)) of two sets of shapes.

    Parameters
    ----------
    a, b : ``Modes`` of any two models of one structure, or shapes at the points, real or complex, shape (k, p, 3) or
        (k, p) for any one component
    points : where shapes are compared [m], shape (p, 3); by default the blocks or nodes of the model that has fewer,
        those wholly held left out
    weighted : by mass: with the mass matrix where both are modes of one model, else with the masses that the default
        points stand for; False: W = 1, the plain criterion
    masses : weights of chosen points instead [kg], shape (p,)

    Returns
    -------
    Mac

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
    frequency = [m.frequency if isinstance(m, Modes) else np.full(len(np.asarray(m)), np.nan) for m in (a, b)]
    same = isinstance(a, Modes) and isinstance(b, Modes) and _one_model(a, b)
    if same and weighted and points is None and masses is None:
        assert isinstance(a, Modes)
        assert isinstance(b, Modes)
        # unit modal mass makes M-products of vectors of the free unknowns
        matrix = a.system.mass
        u, v = (_free_vectors(m) for m in (a, b))
        return Mac(_criterion(u @ matrix @ v.T, u @ matrix @ u.T, v @ matrix @ v.T), *frequency)
    where, weight = _where(a, b, points, masses, weighted)
    u, v = (_flat(m, where) for m in (a, b))
    if u.shape[1] != v.shape[1]:
        raise InputError(f"shapes with {u.shape[1]} and {v.shape[1]} components cannot be compared: give points")
    w = np.ones(u.shape[1]) if weight is None else _per_component(weight, u.shape[1])
    return Mac(_criterion((u.conj() * w) @ v.T, (u.conj() * w) @ u.T, (v.conj() * w) @ v.T), *frequency)


def _criterion(cross: Array, first: Array, second: Array) -> Array:
    own_a, own_b = np.real(np.diag(first)), np.real(np.diag(second))
    if not ((own_a > 0.0).all() and (own_b > 0.0).all()):
        raise InputError("a shape is zero at all points that are compared")
    return np.asarray(np.abs(cross) ** 2 / np.outer(own_a, own_b))


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
        raise InputError("give the points at which the shapes without a model were taken")
    coarse = min(models, key=lambda m: int(m.system.carrier.moving.sum()))
    kept = coarse.system.carrier.moving
    weight = coarse.system.carrier.masses[kept] if weighted else None
    return coarse.places[kept], given if given is not None else weight


def _flat(m: Shapes, where: Array | None) -> Array:
    if isinstance(m, Modes):
        assert where is not None
        return m.at(where).reshape(len(m), -1)
    shapes = np.asarray(m)
    if shapes.ndim < 2 or not np.isfinite(shapes).all():
        raise InputError(f"shapes must be finite and of shape (k, p, 3) or (k, p), got shape {shapes.shape}")
    return shapes.reshape(len(shapes), -1)


def _per_component(weight: Array, length: int) -> Array:
    if length % len(weight):
        raise InputError(f"{len(weight)} masses do not fit shapes of {length} components")
    return np.repeat(weight, length // len(weight))
