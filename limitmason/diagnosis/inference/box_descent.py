"""Least value of a quadratic function within a box, for many data sets at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from limitmason.arrays import Array

Row = Sequence[Array] | Array  # one array over the data sets per axis

Rows = Sequence[Sequence[Array]] | Array

SWEEPS = 8  # of coordinate descent inside one cell of three and more axes

TINY = 1e-30  # keeps the step finite along an axis without effect


def descend(gram: Rows, gradient: Row, low: Array, high: Array) -> Array:
    """Minimiser of m'Gm/2 - g'm within a box, for all data sets at once.

    Up to two axes it is in closed form, else by sweeps.

    Parameters
    ----------
    gram : d rows of d arrays, one entry per data set
    gradient : d arrays
    low, high : ends of the box, shape (d, number of data sets)

    Returns
    -------
    ndarray, shape (d, number of data sets)
    """
    d = len(gradient)
    if d == 2:
        return _descend_two(gram, gradient, low, high)
    move = np.zeros((d, np.shape(low)[1]))
    for _ in range(SWEEPS if d > 1 else 1):
        for i in range(d):
            rest = gradient[i]
            for j in range(d):
                if j != i:
                    rest = rest - gram[i][j] * move[j]
            move[i] = _clip(rest / (gram[i][i] + TINY), low[i], high[i])
    return move


def _descend_two(gram: Rows, gradient: Row, low: Row, high: Row) -> Array:
    """Descent along two axes: the free minimum, or the better of two on the edges.

    With G = [[a, b], [b, c]] and g = (g, h) the free minimum is G^-1 g. Where it leaves the box, each axis in turn is
    held at the end that it violates, and the other is minimised along that edge.

    Parameters
    ----------
    gram, gradient, low, high : as for :func:`descend`, of two axes

    Returns
    -------
    ndarray, shape (2, number of data sets)
    """
    a, b, c = gram[0][0] + TINY, gram[0][1], gram[1][1] + TINY
    g, h = gradient
    # two causes that act alike make it vanish: it is kept positive, and the ends decide
    determinant = np.maximum(a * c - b * b, 1e-10 * a * c)
    first = _clip((c * g - b * h) / determinant, low[0], high[0])
    second = _clip((a * h - b * g) / determinant, low[1], high[1])
    # the partner of either value along its edge, and m'Gm/2 - g'm there
    answer = _clip((h - b * first) / c, low[1], high[1])
    other = _clip((g - b * second) / a, low[0], high[0])
    one = first * (0.5 * a * first + b * answer - g) + answer * (0.5 * c * answer - h)
    two = other * (0.5 * a * other + b * second - g) + second * (0.5 * c * second - h)
    swap = two < one
    return np.stack([np.where(swap, other, first), np.where(swap, second, answer)])


def _clip(values: Array, low: Array, high: Array) -> Array:
    """Values brought between ``low`` and ``high``, faster than ``np.clip`` if few."""
    out: Array = np.minimum(np.maximum(values, low), high)
    return out
