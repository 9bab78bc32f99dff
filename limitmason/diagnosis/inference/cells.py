"""Cells of a grid: inner products of its node values, and the linear step of a fit within a cell."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Row = Sequence[Array] | Array
Rows = Sequence[Sequence[Array]] | Array
FLAT = 1e-9  # of the largest squared change per cell along an axis: below it rounding would choose the step
SWEEPS = 8  # of coordinate descent inside one cell of three and more axes
TINY = 1e-30  # keeps the step finite along an axis without effect


def column_slices(d: int, k: int) -> dict[str, slice]:
    """Where each quantity stands in a row of ``Cells.table``, for d axes of which the last k are measured inputs.

    ``index`` of the node along every axis; ``low`` and ``high``, the box of the step in cells; ``cross``, change
    towards the node before and after along every axis times node value; ``gram``, these 2 d changes with each other;
    ``squares`` of the node value; ``half`` of that and of the node's penalty; ``z``, measured inputs at the node, and
    ``z_sides``, their changes before and after; ``flat``, the least squared change along an axis that counts.
    """
    widths = {"index": d, "low": d, "high": d, "cross": 2 * d, "gram": 4 * d * d, "squares": 1, "half": 1, "z": k,
              "z_sides": 2 * k, "flat": d}  # fmt: skip
    ends = np.cumsum([0, *widths.values()]).tolist()
    return {name: slice(a, b) for name, a, b in zip(widths, ends, ends[1:], strict=False)}


class Cells:
    """Inner products of the node values of a grid with each other, per node and neighbour.

    With a node value F, the change S to a neighbour and data y, everything that a linear step needs is known from y F
    at the node and its neighbours: S (y - F) = (y F' - y F) - S F, and |y - F|^2 = |y|^2 - 2 y F + |F|^2. The step m
    then leaves |y - F|^2 - 2 m S (y - F) + m S S' m.

    Parameters
    ----------
    values : log predictions over the noise, shape (len of every axis ..., n); sizes come before the measured inputs
    z : node values of each measured input in standard deviations

    Notes
    -----
    Nodes are ordered with the sizes innermost: where the noise is estimated, the best size at each value of the
    inputs is that with the least loss, and only those need a logarithm.
    """

    def __init__(self, values: np.ndarray, z: Sequence[np.ndarray]):
        self.shape, n = values.shape[:-1], values.shape[-1]
        self.d, self.k = len(self.shape), len(z)
        first = self.d - self.k
        order = (*range(first, self.d), *range(first))
        self.count = int(np.prod(self.shape, dtype=int))
        self.number = np.arange(self.count).reshape(self.shape).transpose(order).ravel()
        self.nodes = values.reshape(-1, n)[self.number]
        index = np.array(np.unravel_index(self.number, self.shape)) if self.d else np.zeros((0, 1), dtype=int)
        lengths = [self.shape[a] for a in order]
        self.stride = np.zeros(self.d, dtype=int)
        for i, axis in enumerate(order):
            self.stride[axis] = int(np.prod(lengths[i + 1 :], dtype=int))
        self.last = np.array(self.shape, dtype=int) - 1
        some = np.array([index > 0, index < self.last[:, None]])
        columns = np.arange(self.count)
        ways = np.array([-1, 1])[:, None, None] * self.stride[None, :, None]
        self.beside = np.where(some, columns + ways, columns).reshape(2 * self.d, self.count).T.copy()
        sides = np.stack([self.nodes - self.nodes[self.beside[:, i]] for i in range(self.d)]
                         + [self.nodes[self.beside[:, self.d + i]] - self.nodes for i in range(self.d)]
                         ) if self.d else np.zeros((0, 1, n))  # fmt: skip
        gram = sides.transpose(1, 0, 2) @ sides.transpose(1, 2, 0)
        squares = np.einsum("gn,gn->g", self.nodes, self.nodes)
        node_z = [a[index[first + i]] for i, a in enumerate(z)]
        z_sides = [v - v[self.beside[:, first + i]] for i, v in enumerate(node_z)]
        z_sides += [v[self.beside[:, self.d + first + i]] - v for i, v in enumerate(node_z)]
        half = 0.5 * squares + 0.5 * sum((v**2 for v in node_z), np.zeros(self.count))
        apart = int(np.prod(self.shape[:first], dtype=int))  # nodes that share their measured inputs
        self.z_levels = np.array([v[::apart] for v in node_z]).T if self.k else np.zeros((1, 0))
        flat = [FLAT * float(gram[:, i, i].max(initial=0.0)) for i in range(2 * self.d)]
        flat = [max(flat[i], flat[self.d + i]) for i in range(self.d)]
        rows = {
            "index": index.T,
            "low": np.where(some[0], -0.5, 0.0).T,
            "high": np.where(some[1], 0.5, 0.0).T,
            "cross": np.einsum("dgn,gn->gd", sides, self.nodes),
            "gram": gram.reshape(self.count, 4 * self.d**2),
            "squares": squares[:, None],
            "half": half[:, None],
            "z": np.array(node_z).reshape(self.k, self.count).T,
            "z_sides": np.array(z_sides).reshape(2 * self.k, self.count).T,
            "flat": np.tile(flat, (self.count, 1)),
        }
        # one row per node, so that one look-up fetches all that a step needs
        self.columns = column_slices(self.d, self.k)
        self.table = np.concatenate([rows[name] for name in self.columns], axis=1)
        self.ranks = np.ascontiguousarray(np.concatenate([self.nodes, rows["z"], -half[:, None]], axis=1).T)
        self.losses = np.ascontiguousarray(np.concatenate([self.nodes, -0.5 * squares[:, None]], axis=1).T)

    def __getitem__(self, name: str) -> np.ndarray:
        """One quantity of all nodes, shape (g, its number of columns)."""
        return self.table[:, self.columns[name]]


class Looked:
    """What is fetched of the cells that data sets lie in, one array per quantity, data sets along the last axis.

    Parameters
    ----------
    table : rows of ``Cells.table``, one per data set
    d, k : number of axes, and of measured inputs among them
    """

    def __init__(self, table: np.ndarray, d: int, k: int):
        rows = np.ascontiguousarray(table.T)
        at = {name: rows[part] for name, part in column_slices(d, k).items()}
        self.index, self.low, self.high, self.cross = at["index"], at["low"], at["high"], at["cross"]
        self.gram = at["gram"].reshape(2 * d, 2 * d, len(table))
        self.squares, self.half = at["squares"][0], at["half"][0]
        self.z, self.flat = at["z"], at["flat"]
        self.z_sides = at["z_sides"].reshape(2, k, len(table))


def descend(gram: Rows, gradient: Row, low: Row, high: Row) -> Array:
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


def _descend_two(gram: Rows, gradient: Row, low: Row, high: Row) -> Array:
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


def _clip(values: Array, low: Array, high: Array) -> Array:
    out: Array = np.minimum(np.maximum(values, low), high)
    return out
