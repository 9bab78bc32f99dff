"""The linear step of a fit: the minimiser of a quadratic form within a box, for many data sets at once."""

import numpy as np

SWEEPS = 8  # of coordinate descent inside one cell of three and more axes
TINY = 1e-30  # keeps the step finite along an axis without effect


def descend(gram, gradient, low, high):
    """Minimiser of m'Gm/2 - g'm within a box, all data sets at once: closed form up to two axes, else by sweeps.

    Parameters
    ----------
    gram : d rows of d arrays, one entry per data set
    gradient, low, high : d arrays each

    Returns
    -------
    ndarray, shape (d, number of data sets)
    """
    d = len(gradient)
    if d == 2:
        return _descend_two(gram, gradient, low, high)
    # an array of no rows still says how many data sets there are
    move = np.zeros((d, np.shape(gradient)[1] if np.ndim(gradient) == 2 else 0))
    for _ in range(SWEEPS if d > 1 else 1):
        for i in range(d):
            rest = gradient[i]
            for j in range(d):
                if j != i:
                    rest = rest - gram[i][j] * move[j]
            move[i] = _clip(rest / (gram[i][i] + TINY), low[i], high[i])
    return move


def _descend_two(gram, gradient, low, high):
    """The same for two axes: the free minimum, or the better of the two with one axis held at its violated end."""
    a, b, c = gram[0][0] + TINY, gram[0][1], gram[1][1] + TINY
    g, h = gradient
    determinant = np.maximum(a * c - b * b, 1e-10 * a * c)
    first = _clip((c * g - b * h) / determinant, low[0], high[0])
    second = _clip((a * h - b * g) / determinant, low[1], high[1])
    answer = _clip((h - b * first) / c, low[1], high[1])
    other = _clip((g - b * second) / a, low[0], high[0])
    one = first * (0.5 * a * first + b * answer - g) + answer * (0.5 * c * answer - h)
    two = other * (0.5 * a * other + b * second - g) + second * (0.5 * c * second - h)
    swap = two < one
    return np.stack([np.where(swap, other, first), np.where(swap, second, answer)])


def _clip(values, low, high):
    return np.minimum(np.maximum(values, low), high)
