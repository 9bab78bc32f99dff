"""A model tabulated on sizes and measured inputs: nodes, and what lies between."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from limitmason.diagnosis.inference.cells import Cells


class Grid:
    """Whitened log predictions on the nodes of a regular grid.

    Parameters
    ----------
    sizes : node sizes, one increasing array per cause (none for the baseline model)
    z : node values of each measured input in standard deviations from its measured value
    values : log predictions over the noise, shape (len of every axis ..., n)

    Attributes
    ----------
    shape, n : length of every axis, those of sizes first; number of predictions at a node
    nodes : ``values`` of all g nodes one after the other, the last axis running fastest, shape (g, n)

    Notes
    -----
    Wrong where predictions bend within one cell: all between nodes is linear. Tables are refined until they do not.
    """

    def __init__(self, sizes: Sequence[np.ndarray], z: Sequence[np.ndarray], values: np.ndarray):
        """Keep nodes and values.

        Parameters
        ----------
        sizes, z, values : as of the class
        """
        self.sizes = tuple(np.asarray(s, dtype=float) for s in sizes)
        self.z = tuple(np.asarray(a, dtype=float) for a in z)
        self.values = np.ascontiguousarray(values, dtype=float)
        self.shape = tuple(len(a) for a in self.sizes + self.z)
        self.n = values.shape[-1]

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
        """Index along every axis of inputs, with fractions, of ``inputs`` [sd], (k,)."""
        return [float(np.interp(v, a, np.arange(len(a)))) for v, a in zip(inputs, self.z, strict=True)]

    @cached_property
    def zero(self) -> list[float]:
        """Place of the measured inputs themselves."""
        return self.place(np.zeros(len(self.z)))

    @cached_property
    def slopes(self) -> np.ndarray:
        """Change of a baseline per deviation of each input, whitened, shape (n, k)."""
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
        """Whitened change of a baseline by a fit, measured inputs included, shape (n,)."""
        inputs = self.z_at(position)[0]
        return self.values_from(node, position)[0] - null.between(null.place(inputs))

    def values_from(self, node: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Predictions at positions near nodes, in units of the noise, shape (b, n).

        First order from the node of each data set: along every axis the slope is the difference to the neighbour on the
        side of the position. The least-squares step takes these slopes, so a fit sees the same values.

        Parameters
        ----------
        node : number of the node that a position is reached from, shape (b,)
        position : index along every axis, with fractions, shape (b, d); from 0 to the last node, as fits keep to
        """
        out = self.nodes[node]
        if not self.shape:
            return out
        index = np.unravel_index(node, self.shape)
        for axis, (i, length) in enumerate(zip(index, self.shape, strict=True)):
            move = position[:, axis] - i
            # at an end of an axis no position lies on the side without a neighbour, and a move of 0 needs none
            side = np.where((move > 0.0) | (i == 0), 1, -1)
            neighbour = list(index)
            neighbour[axis] = np.clip(i + side, 0, length - 1)
            difference = self.nodes[np.ravel_multi_index(tuple(neighbour), self.shape)]
            difference -= self.nodes[node]
            difference *= (side * move)[:, None]  # cells moved towards that neighbour
            out += difference
        return out

    def between(self, position: Sequence[float] | np.ndarray) -> np.ndarray:
        """Values at a position along the leading axes, shape (the axes left ..., n)."""
        values = self.values
        for u in position:
            values = _along(values, axis=0, position=np.array([u]))[0]
        return values

    def sizes_at(self, position: np.ndarray) -> np.ndarray:
        """Sizes of the causes at grid positions, shape (b, p)."""
        return _coordinates(self.sizes, position)

    def z_at(self, position: np.ndarray) -> np.ndarray:
        """Measured inputs at grid positions, shape (b, k)."""
        return _coordinates(self.z, position[:, len(self.sizes) :])

    def at_size(self, *position: float) -> "Grid":
        """The baseline-like grid (inputs only) at positions along the size axes."""
        return Grid((), self.z, self.between(position))

    def denser(self, times: int = 4) -> "Grid":
        """This grid with ``times`` as many nodes along the inputs, linear between."""
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
        """This grid in other coordinates, values times ``mix`` of shape (n, n)."""
        return Grid(self.sizes, self.z, self.values @ mix.T)

    def columns(self, chosen: np.ndarray) -> "Grid":
        """This grid for some of the specimens, by numbers or flags ``chosen``."""
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
        """The table in units of the noise ``scale``, from ``origin``, both (n,)."""
        values = self.values - origin
        values /= scale
        return Grid(self.sizes, self.z, values)


def at_measured(table: Grid | Tabulation) -> np.ndarray:
    """Values at the measured inputs for every node size, shape (sizes ..., n)."""
    values = table.values
    for axis in table.z:
        values = np.take(values, int(np.argmin(np.abs(axis))), axis=len(table.sizes))
    return values


def _along(values: np.ndarray, axis: int, position: np.ndarray) -> np.ndarray:
    """Values at positions along one axis, linear between nodes: for all grids.

    Parameters
    ----------
    values : node values, any shape
    axis : number of the axis along which is interpolated
    position : positions along it, counted in nodes, shape (p,); the axis then has p entries
    """
    last = values.shape[axis] - 1
    low = np.minimum(position.astype(int), last)
    part = (position - low).reshape(-1, *[1] * (values.ndim - axis - 1))
    below = np.take(values, low, axis=axis)
    return below + part * (np.take(values, np.minimum(low + 1, last), axis=axis) - below)


def _coordinates(axes: Sequence[np.ndarray], position: np.ndarray) -> np.ndarray:
    """Values along axes at positions in nodes, (b, number of axes), linear between.

    Parameters
    ----------
    axes : node values of every axis
    position : index along every axis, with fractions, shape (b, number of axes or more)
    """
    columns = [np.interp(position[:, i], np.arange(len(a)), a) for i, a in enumerate(axes)]
    return np.stack(columns, axis=-1) if columns else np.zeros((len(position), 0))
