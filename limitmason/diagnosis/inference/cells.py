"""Cells of a grid: inner products of node values, and the linear step of a fit.

With b data sets ``gram`` is d rows of d arrays, ``slope`` and the ends ``low`` and ``high`` of a box d, each (b,).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.diagnosis.inference.box_descent import Row, Rows, descend

FLAT = 1e-9
"""Part of the largest squared change per cell along an axis below which rounding would choose the step [-]."""

HELD = 50_000  # entries of changes that are held at a time: they then stay in the processor's cache, chosen

HALF_CELL = 0.5  # farthest step from a node along an axis [cells]: beyond it another node is nearer


def column_slices(d: int, k: int) -> dict[str, slice]:
    """Where quantities stand in a row of ``Cells.table``: d axes, the last k inputs.

    ``index`` of the node along every axis; ``low`` and ``high``, the box of the step in cells; ``cross``, change
    towards the node before and after along every axis times node value; ``gram``, these 2 d changes with each other;
    ``squares`` of the node value; ``half`` of that and of the node's penalty; ``z``, measured inputs at the node, and
    ``z_sides``, their changes before and after; ``flat``, the least squared change along an axis that counts.
    """
    widths = {"index": d, "low": d, "high": d, "cross": 2 * d, "gram": 4 * d * d, "squares": 1, "half": 1, "z": k,
              "z_sides": 2 * k, "flat": d}
    ends = np.cumsum([0, *widths.values()]).tolist()
    return {name: slice(a, b) for name, a, b in zip(widths, ends, ends[1:], strict=False)}


class Cells:
    """Inner products of the node values of a grid, per node and neighbour.

    With a node value F, the change S to a neighbour and data y, everything that a linear step needs is known from y F
    at the node and its neighbours: S (y - F) = (y F' - y F) - S F, and |y - F|^2 = |y|^2 - 2 y F + |F|^2. The step m
    then leaves |y - F|^2 - 2 m S (y - F) + m S S' m.

    Nodes are ordered with the sizes innermost: where the noise is estimated, the best size at each value of the
    inputs is that with the least loss, and only those need a logarithm.

    Parameters
    ----------
    values : log predictions over the noise, shape (len of every axis ..., n); sizes come before the measured inputs
    z : node values of each measured input in standard deviations

    Attributes
    ----------
    d, k, count : number of axes, of measured inputs among them, and of nodes, g
    number : place of every node among the values as they came, shape (g,)
    stride : from the number of a node to that of the next along every axis, shape (d,)
    beside : numbers of the nodes before and after every node along every axis, shape (g, 2 d)
    table, columns : a row per node of all that a step needs, and where each quantity stands in it
    """

    def __init__(self, values: np.ndarray, z: Sequence[np.ndarray]):
        """Order the nodes, find their neighbours, and lay out the table of a step."""
        self.shape, n = values.shape[:-1], values.shape[-1]
        self.d, self.k = len(self.shape), len(z)
        sizes = self.d - self.k  # number of axes of sizes; those of measured inputs come after them
        order = (*range(sizes, self.d), *range(sizes))  # measured inputs outermost, sizes innermost
        self.count = int(np.prod(self.shape, dtype=int))
        self.number = np.arange(self.count).reshape(self.shape).transpose(order).ravel()
        nodes = values.reshape(-1, n)
        self.nodes = nodes[self.number] if self.k and sizes else nodes  # no copy where the order stays
        index = np.array(np.unravel_index(self.number, self.shape)) if self.d else np.zeros((0, 1), dtype=int)
        self.last = np.array(self.shape, dtype=int) - 1  # number of the last node along every axis
        self.stride = np.zeros(self.d, dtype=int)
        for i, axis in enumerate(order):
            self.stride[axis] = int(np.prod([self.shape[a] for a in order[i + 1 :]], dtype=int))
        has_side = np.array([index > 0, index < self.last[:, None]])
        self.beside = self._neighbours(has_side)
        norms = self._norms()
        self.reach = 0.5 * np.maximum(norms[:, : self.d], norms[:, self.d :]).sum(axis=1)  # of a step, shape (g,)
        node_z = [a[index[sizes + i]] for i, a in enumerate(z)]
        alike = int(np.prod(self.shape[:sizes], dtype=int))  # nodes that share their measured inputs
        self.z_levels = np.array([v[::alike] for v in node_z]).T if self.k else np.zeros((1, 0))
        # one row per node, so that one look-up fetches all that a step needs
        self.columns = column_slices(self.d, self.k)
        rows = self._quantities(index, has_side, norms, node_z)
        self.table = np.concatenate([rows[name] for name in self.columns], axis=1)
        self.filled = np.zeros(self.count, dtype=bool)  # rows whose inner products are made

    def _neighbours(self, has_side: np.ndarray) -> Index:
        """Node before and after every node along every axis, (g, 2 d), all before first.

        A node at the end of an axis is its own neighbour there: the change is then zero.

        Parameters
        ----------
        has_side : whether there is a node before, and after, shape (2, d, g)
        """
        own = np.arange(self.count)
        ways = np.array([-1, 1])[:, None, None] * self.stride[None, :, None]  # from a node to that before, and after
        return np.where(has_side, own + ways, own).reshape(2 * self.d, self.count).T.copy()

    def _quantities(
        self, index: Index, has_side: np.ndarray, norms: np.ndarray, node_z: list[np.ndarray]
    ) -> dict[str, np.ndarray]:
        """Columns of the table by name, inner products zero until they are wanted.

        Parameters
        ----------
        index : of every node along every axis, shape (d, g)
        has_side : whether there is a node before, and after, shape (2, d, g)
        norms : size of the change to either, shape (g, 2 d)
        node_z : each measured input at every node [sd], shape (g,)
        """
        d, k, g = self.d, self.k, self.count
        squares = np.einsum("gn,gn->g", self.nodes, self.nodes)
        z_before = [v - v[self.beside[:, d - k + i]] for i, v in enumerate(node_z)]
        z_after = [v[self.beside[:, 2 * d - k + i]] - v for i, v in enumerate(node_z)]
        half = 0.5 * squares + 0.5 * sum((v**2 for v in node_z), np.zeros(g))
        flat = [FLAT * float((norms[:, [i, d + i]] ** 2).max(initial=0.0)) for i in range(d)]
        return {
            "index": index.T, "low": np.where(has_side[0], -HALF_CELL, 0.0).T,
            "high": np.where(has_side[1], HALF_CELL, 0.0).T,
            "cross": np.zeros((g, 2 * d)), "gram": np.zeros((g, 4 * d**2)),
            "squares": squares[:, None], "half": half[:, None], "z": np.array(node_z).reshape(k, g).T,
            "z_sides": np.array([*z_before, *z_after]).reshape(2 * k, g).T, "flat": np.tile(flat, (g, 1)),
        }

    def products(self, y: Array, beside: Array, known: bool) -> Array:
        """What nodes are ranked by, the largest best: y F - |F|^2 / 2, shape (b, g).

        Where the noise is known z Z - |Z|^2 / 2 is added.

        Parameters
        ----------
        y : values, shape (b, n)
        beside : data of the measured inputs where the noise is known, and ones, shape (b, k + 1 or 1)
        known : whether the noise is known; else measured inputs do not count here
        """
        out = y @ self.nodes.T
        out += beside @ (self.ranks if known else self.losses)
        return out

    @cached_property
    def ranks(self) -> Array:
        """What measured inputs and one are multiplied by to rank nodes in known noise."""
        return np.concatenate([self["z"].T, -self["half"].T])

    @cached_property
    def losses(self) -> Array:
        """What one is multiplied by to rank the nodes by their sums of squares."""
        return -0.5 * self["squares"].T

    def _norms(self) -> np.ndarray:
        """Size of the change to the node before and after along every axis, (g, 2 d)."""
        out = np.zeros((self.count, 2 * self.d))
        step = max(1, HELD // max(self.nodes.shape[1], 1))
        for axis in range(self.d):
            before, after = self.beside[:, axis], self.beside[:, self.d + axis]
            for start in range(0, self.count, step):
                rows = slice(start, start + step)
                change = self.nodes[after[rows]] - self.nodes[rows]
                out[rows, self.d + axis] = np.sqrt(np.einsum("gn,gn->g", change, change))
            out[:, axis] = np.where(before == np.arange(self.count), 0.0, out[before, self.d + axis])
        return out

    def rows(self, nodes: Index) -> np.ndarray:
        """Rows of the table of nodes by number, (len of these, width), products made when first wanted."""
        missing = np.unique(nodes[~self.filled[nodes]])
        d, at = self.d, self.columns
        step = max(1, HELD // max(2 * d * self.nodes.shape[1], 1))
        for start in range(0, len(missing) if d else 0, step):
            some = missing[start : start + step]
            sides = self.nodes[self.beside[some]] - self.nodes[some, None]
            # changes are upwards on either side: node less the one before it
            np.negative(sides[:, :d], out=sides[:, :d])
            self.table[some, at["gram"]] = (sides @ sides.transpose(0, 2, 1)).reshape(len(some), -1)
            self.table[some, at["cross"]] = np.einsum("gdn,gn->gd", sides, self.nodes[some])
        self.filled[missing] = True
        return self.table[nodes]

    def __getitem__(self, name: str) -> np.ndarray:
        """One quantity of all nodes, shape (g, its number of columns)."""
        return self.table[:, self.columns[name]]


@dataclass(frozen=True)
class NodeData:
    """What is known without data of the cells of b data sets, on the last axis."""

    index: Array  # of the node along every axis, (d, b)
    low: Array  # box of the step [cells], (d, b)
    high: Array
    cross: Array  # changes towards the node before, then after, along every axis, times the node value, (2 d, b)
    gram: Array  # these changes with each other, (2 d, 2 d, b)
    squares: Array  # sum of squares of the node value, (b,)
    z: Array  # measured inputs at the node [sd], (k, b)
    z_sides: Array  # their changes before and after [sd], (2, k, b)
    flat: Array  # least squared change along an axis that counts, (d, b)


def node_data(table: np.ndarray, d: int, k: int) -> NodeData:
    """Rows of ``Cells.table``, one per data set, as named quantities.

    Parameters
    ----------
    table : shape (b, its width)
    d : number of axes
    k : number of measured inputs among them
    """
    rows = np.ascontiguousarray(table.T)
    at = {name: rows[part] for name, part in column_slices(d, k).items()}
    return NodeData(
        index=at["index"], low=at["low"], high=at["high"], cross=at["cross"],
        gram=at["gram"].reshape(2 * d, 2 * d, len(table)), squares=at["squares"][0], z=at["z"],
        z_sides=at["z_sides"].reshape(2, k, len(table)), flat=at["flat"],
    )


@dataclass(frozen=True)
class GridStep:
    """One linear step from the node of every data set, data sets along the last axis.

    Parameters
    ----------
    index : of the node along every axis, shape (d, b)
    move : step along every axis in cells, shape (d, b)
    off : nuisance data that the step leaves, shape (k, b)
    loss : sum of squares that it leaves, shape (b,); of no use where residuals were formed
    left : residuals that it leaves, shape (b, n); None where none were formed
    """

    index: Array
    move: Array
    off: Array
    loss: Array
    left: Array | None


@dataclass(frozen=True)
class StepData:
    """What data sets know of the cell around a node: y times nodes, or their values.

    Parameters
    ----------
    y, z, squares : data, nuisance data, and sum of squares of the data, shapes (b, n), (b, k) and (b,)
    per : from the sums of squares at the nodes to 1 over the noise variance; None where that is known
    used : from residuals at the nodes to weights of the values; None where inner products are enough
    """

    y: Array
    z: Array
    squares: Array
    per: Callable[[Array], Array] | None
    used: Callable[[Array], Array] | None


@dataclass(frozen=True)
class CellSums:
    """What the step of every data set needs of its cell, sets along the last axis.

    Parameters
    ----------
    here : what is known of it without data
    gram : changes to the 2 d neighbours with each other, shape (2 d, 2 d, b)
    pull : these changes with the residual at the node, shape (2 d, b)
    loss : sum of its squares, shape (b,)
    residuals : shape (b, n); None where not formed
    sides : the changes themselves, shape (b, 2 d, n); None where not formed
    """

    here: NodeData
    gram: Array
    pull: Array
    loss: Array
    residuals: Array | None = None
    sides: Array | None = None


def stepped(grids: Sequence[Cells], owner: Index, column: Index, at: StepData, inner: Sequence[Array] = ()) -> GridStep:
    """One linear step in every cell: which way by both sides, how far by that side.

    Parameters
    ----------
    grids : cells of several grids with as many axes each
    owner : number of the grid of each data set, increasing, shape (b,)
    column : number of its node in this grid, shape (b,)
    at : data, their squares and their weights
    inner : inner products of the data with node and neighbours, one array per grid, where they were made
    """
    cell = _cell(grids, owner, column, at, inner)
    here, gram, pull, loss = cell.here, cell.gram, cell.pull, cell.loss
    d, first = len(here.index), len(here.index) - len(here.z)  # axes, and the first one of a measured input
    low, high, z_sides = here.low, here.high, here.z_sides
    off = at.z.T - here.z  # of measured inputs from the node [sd], shape (k, b)
    per = None if at.per is None else at.per(loss)  # 1 over the noise variance
    inside = np.where((low < 0) & (high > 0), 0.5, 1.0)  # weight of a mean: at an end only one side has a change
    # rows and columns 0 to d are changes towards the node before, d to 2 d towards that after
    sums = gram[:d, :d] + gram[:d, d:] + gram[d:, :d] + gram[d:, d:]
    mean, slope = inside[:, None] * inside * sums, inside * (pull[:d] + pull[d:])
    z_step = (z_sides[0] + z_sides[1]) * inside[first:]
    move = descend(*_normal(mean, slope, z_step, off, per, here.flat), low, high)
    # the side on which the step leads
    after = (move > 0.0) | (low == 0.0)
    low, high = np.where(after, 0.0, low), np.where(after, high, 0.0)
    slope = np.where(after, pull[d:], pull[:d])
    ahead, behind = (np.where(after, half[:, d:], half[:, :d]) for half in (gram[d:], gram[:d]))
    side = np.where(after[:, None], ahead, behind)
    z_step = np.where(after[first:], z_sides[1], z_sides[0])
    move = descend(*_normal(side, slope, z_step, off, per, here.flat), low, high)
    off = off - move[first:] * z_step
    if cell.residuals is not None and cell.sides is not None:
        # weights hang on the residuals, so that the sum of squares follows from them, not from inner products
        chosen = np.where(after.T[:, :, None], cell.sides[:, d:], cell.sides[:, :d])
        left = cell.residuals - np.einsum("db,bdn->bn", move, chosen)
        return GridStep(index=here.index, move=move, off=off, loss=loss, left=left)
    # |r - m S|^2 = |r|^2 - 2 m S r + m S S' m
    for i in range(d):
        loss = loss - 2.0 * move[i] * slope[i]
        for j in range(d):
            loss = loss + move[i] * move[j] * side[i, j]
    return GridStep(index=here.index, move=move, off=off, loss=np.maximum(loss, 0.0), left=None)


def _cell(grids: Sequence[Cells], owner: Index, column: Index, at: StepData, inner: Sequence[Array]) -> CellSums:
    """Sums of the linear step in a cell, for each data set at its node.

    Inner products with the nodes are enough where every value has one weight. Weights that depend on the residuals need
    the residuals themselves.

    Parameters
    ----------
    grids : cells of several grids with as many axes each
    owner : grid of each data set, ascending, shape (b,)
    column : its node there, shape (b,)
    at : data, their squares and their weights
    inner : products of the data with node and neighbours where these are made already, (its b, 1 + 2 d) per grid
    """
    d, k = grids[0].d, grids[0].k
    tables, nodes, products = [], [], list(inner)  # one entry per grid
    ends = np.searchsorted(owner, np.arange(len(grids) + 1))
    for g, cells in enumerate(grids):
        part = slice(ends[g], ends[g + 1])  # data sets of this grid
        mine = column[part]
        tables.append(cells.rows(mine))
        if not inner:
            nodes.append(cells.nodes[np.concatenate([mine[:, None], cells.beside[mine]], axis=1)])
            if at.used is None:
                products.append(np.einsum("bn,bcn->bc", at.y[part], nodes[-1]))
    here = node_data(np.concatenate(tables), d, k)
    if at.used is None:
        # rows: product with the node, with its d lower neighbours, with its d upper ones
        to = np.ascontiguousarray(np.concatenate(products).T)
        pull = np.concatenate([to[0] - to[1 : 1 + d], to[1 + d :] - to[0]]) - here.cross
        loss = np.maximum(at.squares - 2.0 * to[0] + here.squares, 0.0)  # |y|^2 - 2 y F + |F|^2
        return CellSums(here=here, gram=here.gram, pull=pull, loss=loss)
    around = np.concatenate(nodes)  # values of the node, the d before and the d after it, shape (b, 1 + 2 d, n)
    node = around[:, :1]
    residuals = at.y - node[:, 0]
    # what the prediction changes from the lower neighbours to the node, and on to the upper ones
    sides = np.concatenate([node - around[:, 1 : 1 + d], around[:, 1 + d :] - node], axis=1)
    used = at.used(residuals)  # weight of every value, shape (b, n)
    gram = ((sides * used[:, None]) @ sides.transpose(0, 2, 1)).transpose(1, 2, 0)
    pull = np.einsum("bdn,bn->db", sides, residuals * used)
    loss = (used * residuals**2).sum(axis=1)
    return CellSums(here=here, gram=gram, pull=pull, loss=loss, residuals=residuals, sides=sides)


def _normal(
    gram: Rows, slope: Row, z_step: Array, off: Array, per: Array | None, flat: Array
) -> tuple[list[list[Array]], list[Array]]:
    """Normal equations of a linear step, in which an axis without effect has no pull.

    Parameters
    ----------
    gram, slope : inner products of the changes per cell with each other, and with the residuals
    z_step : change of each measured input per cell
    off : how far it is from its measured value [sd]
    per : one over the noise variance, shape (b,), or None where it is one
    flat : least squared change along an axis that counts
    """
    d, k = len(slope), len(z_step)
    # entries are arrays over the data sets, shape (b,)
    matrix: list[list[Array]] = [[g if per is None else g * per for g in row] for row in gram]
    right: list[Array] = [s if per is None else s * per for s in slope]
    for i in range(d):
        live = gram[i][i] > flat[i]
        if live.all():
            continue
        right[i] = np.where(live, right[i], 0.0)
        for j in range(d):
            if j != i:
                matrix[i][j] = matrix[j][i] = np.where(live, matrix[i][j], 0.0)
    # measured inputs are pulled back to their values
    for i in range(k):
        a = d - k + i
        matrix[a][a] = matrix[a][a] + z_step[i] ** 2
        right[a] = right[a] + z_step[i] * off[i]
    return matrix, right
