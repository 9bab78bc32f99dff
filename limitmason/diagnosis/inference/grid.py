"""A model tabulated on sizes and measured inputs: its nodes, what lies between them, and what it is there."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from limitmason.errors import InputError

Array = NDArray[np.float64]
Row = Sequence[Array] | Array
Rows = Sequence[Sequence[Array]] | Array

FLAT = 1e-9  # of the largest squared change per cell along an axis: below it rounding would choose the step
SWEEPS = 8  # of coordinate descent inside one cell of three and more axes
TINY = 1e-30  # keeps the step finite along an axis without effect


class OnNodes(Protocol):
    """Anything with node sizes, node inputs in standard deviations and values of shape (len of every axis ..., n)."""

    @property
    def sizes(self) -> tuple[np.ndarray, ...]:
        """Node sizes of each cause."""
        ...

    @property
    def z(self) -> tuple[np.ndarray, ...]:
        """Node values of each measured input."""
        ...

    @property
    def values(self) -> np.ndarray:
        """Log predictions of the nodes."""
        ...


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


def descend(gram: Rows, gradient: Row, low: Array, high: Array) -> Array:
    """Minimiser of m'Gm/2 - g'm within a box, all data sets at once: closed form up to two axes, else by sweeps.

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


class Grid:
    """Whitened log predictions on the nodes of a regular grid.

    Parameters
    ----------
    sizes : node sizes, one increasing array per cause (none for the baseline model)
    z : node values of each measured input in standard deviations from its measured value
    values : log predictions over the noise, shape (len of every axis ..., n)

    Notes
    -----
    Wrong where predictions bend within one cell: all between nodes is linear. Tables are refined until they do not.
    """

    def __init__(self, sizes: Sequence[np.ndarray], z: Sequence[np.ndarray], values: np.ndarray):
        self.sizes = tuple(np.asarray(s, dtype=float) for s in sizes)
        self.z = tuple(np.asarray(a, dtype=float) for a in z)
        self.values = np.ascontiguousarray(values, dtype=float)
        axes = self.sizes + self.z
        self.shape = tuple(len(a) for a in axes)
        self.n = values.shape[-1]
        if values.shape[:-1] != self.shape:
            raise InputError(f"values of shape {values.shape} do not fit axes of lengths {self.shape}")

    @cached_property
    def nodes(self) -> np.ndarray:
        """Node values, shape (g, n)."""
        return self.values.reshape(-1, self.n)

    @cached_property
    def node_z(self) -> np.ndarray:
        """Measured inputs of every node, shape (g, k)."""
        mesh = np.meshgrid(*self.sizes, *self.z, indexing="ij")[len(self.sizes) :]
        return np.stack([m.ravel() for m in mesh], axis=-1) if mesh else np.zeros((len(self.nodes), 0))

    @cached_property
    def cells(self) -> Cells:
        """Inner products of the nodes, by which fits with Gaussian errors are found."""
        return Cells(self.values, self.z)

    def place(self, inputs: Sequence[float] | np.ndarray) -> list[float]:
        """Index along every axis of a measured input, with fractions, at given inputs in standard deviations."""
        return [float(np.interp(v, a, np.arange(len(a)))) for v, a in zip(inputs, self.z, strict=True)]

    @cached_property
    def zero(self) -> list[float]:
        """Place of the measured inputs themselves."""
        return self.place(np.zeros(len(self.z)))

    @cached_property
    def slopes(self) -> np.ndarray:
        """Change of a baseline per standard deviation of each measured input, whitened, shape (n, k)."""
        out = np.zeros((self.n, len(self.z)))
        for axis, nodes in enumerate(self.z):
            ends = []
            for step in (-1.0, 1.0):
                at = np.zeros(len(self.z))
                at[axis] = np.clip(step, nodes[0], nodes[-1])
                ends.append((at[axis], self.between(self.place(at))))
            (low, before), (high, after) = ends
            out[:, axis] = (after - before) / (high - low)
        return out

    def effect(self, null: "Grid", node: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Whitened change of a baseline by the fit of an explanation, measured inputs included, shape (n,)."""
        inputs = self.z_at(position)[0]
        return self.values_from(node, position)[0] - null.between(null.place(inputs))

    def values_from(self, node: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Whitened predictions at positions near nodes, as a fit sees them, shape (b, n).

        Linear along every axis from the node of each data set, without mixed terms: those of the fit's own step.

        Parameters
        ----------
        node : number of the node that a position is reached from, shape (b,)
        position : index along every axis, with fractions, shape (b, d)
        """
        out = self.nodes[node]
        if not self.shape:
            return out
        index = np.unravel_index(node, self.shape)
        for axis, (i, length) in enumerate(zip(index, self.shape, strict=True)):
            move = position[:, axis] - i
            way = np.where((move > 0.0) | (i == 0), 1, -1)
            beside = list(index)
            beside[axis] = np.clip(i + way, 0, length - 1)
            change = self.nodes[np.ravel_multi_index(tuple(beside), self.shape)] - self.nodes[node]
            out = out + (way * move)[:, None] * change
        return out

    def between(self, position: Sequence[float] | np.ndarray) -> np.ndarray:
        """Values at a position along the leading axes, linear between nodes, shape (the axes left ..., n)."""
        values = self.values
        for u in position:
            values = _along(values, 0, np.array([u]))[0]
        return values

    def sizes_at(self, position: np.ndarray) -> np.ndarray:
        """Sizes of the causes at grid positions, shape (b, p)."""
        return _coordinates(self.sizes, position)

    def z_at(self, position: np.ndarray) -> np.ndarray:
        """Measured inputs at grid positions, shape (b, k)."""
        return _coordinates(self.z, position[:, len(self.sizes) :])

    def at_size(self, *position: float) -> "Grid":
        """The baseline-like grid (measured inputs only) at given positions along the size axes."""
        return Grid((), self.z, self.between(position))

    def denser(self, times: int = 4) -> "Grid":
        """The same grid with more nodes along the measured inputs, linear between the old ones."""
        values, z = self.values, []
        for axis, a in enumerate(self.z, start=len(self.sizes)):
            u = np.linspace(0.0, len(a) - 1.0, times * (len(a) - 1) + 1)
            values = _along(values, axis, u)
            z.append(np.interp(u, np.arange(len(a)), a))
        return Grid(self.sizes, z, values)

    def without_axis(self, axis: int) -> list["Grid"]:
        """One grid per node of a size axis, that axis fixed at the node."""
        rest = tuple(s for i, s in enumerate(self.sizes) if i != axis)
        return [Grid(rest, self.z, np.take(self.values, i, axis=axis)) for i in range(len(self.sizes[axis]))]

    def mixed(self, mix: np.ndarray) -> "Grid":
        """The same grid in other coordinates of the specimens, values times ``mix`` of shape (n, n)."""
        return Grid(self.sizes, self.z, self.values @ mix.T)

    def columns(self, chosen: np.ndarray) -> "Grid":
        """The same grid for some of the specimens."""
        return Grid(self.sizes, self.z, self.values[..., chosen])


@dataclass(frozen=True)
class Tabulation:
    """Log predictions of a model.

    Parameters
    ----------
    causes : none for the baseline, one, or two
    sizes : node sizes of each cause
    z : node values of each measured input in standard deviations
    values : shape (len of every axis ..., n)
    levels : sizes at which the simulator was called, per cause
    error : largest interpolation error found between levels, in units of the noise
    """

    causes: Sequence[Any]
    sizes: tuple[np.ndarray, ...]
    z: tuple[np.ndarray, ...]
    values: np.ndarray
    levels: tuple[np.ndarray, ...] = ()
    error: float = 0.0

    def whitened(self, origin: np.ndarray, scale: np.ndarray) -> Grid:
        """The table as a grid in units of the noise, measured from ``origin``, both of shape (n,)."""
        return Grid(self.sizes, self.z, (self.values - origin) / scale)


def at_measured(table: OnNodes) -> np.ndarray:
    """Values at the measured inputs themselves for every node size, shape (len of every size axis ..., n)."""
    values = table.values
    for axis in table.z:
        values = np.take(values, int(np.argmin(np.abs(axis))), axis=len(table.sizes))
    return values


def _along(values: np.ndarray, axis: int, position: np.ndarray) -> np.ndarray:
    """Values at positions along one axis, linear between nodes: the one interpolation of grids."""
    last = values.shape[axis] - 1
    low = np.minimum(position.astype(int), last)
    part = (position - low).reshape(-1, *[1] * (values.ndim - axis - 1))
    below = np.take(values, low, axis=axis)
    return below + part * (np.take(values, np.minimum(low + 1, last), axis=axis) - below)


def _coordinates(axes: Sequence[np.ndarray], position: np.ndarray) -> np.ndarray:
    columns = [np.interp(position[:, i], np.arange(len(a)), a) for i, a in enumerate(axes)]
    return np.stack(columns, axis=-1) if columns else np.zeros((len(position), 0))
