"""Best fits of tabulated models to many data sets: node, linear step, next cell.

Where all values are used fits go by inner products of the nodes, without forming a residual; where some are left out by
residuals. The step is the same, see :func:`~.cells.stepped`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.diagnosis.inference.cells import Cells, StepData, stepped
from limitmason.diagnosis.inference.grid import Grid
from limitmason.diagnosis.inference.likelihood import Likelihood

CANCELLED = 1e-8  # share of the data's squares below which a loss is summed again from residuals
WALK = 3  # cells that a fit may go on beyond that of the best node
EDGE = 0.5 - 1e-9  # of a cell: a step that ends beyond it goes on
BETTER = 1e-9  # log-likelihood by which the next cell must be better
BLOCK = 400_000  # inner products held at a time: they stay in the processor's cache
MANY = 200  # values of a data set, above which a copy of them costs more than fitting grids together saves
CHUNK = 2_000_000  # entries of a work array of the fits by residuals


@dataclass(frozen=True)
class BestFit:
    """Best fits of one model to many data sets.

    Parameters
    ----------
    loglik : log-likelihood up to a constant of the data, shape (b,)
    loss : sum of squares of the residuals, shape (b,)
    penalty : sum of squares of the measured inputs from their data [sd], shape (b,)
    position : index along every axis, with fractions, shape (b, d)
    residuals : in units of the stated noise, shape (b, n)
    node : number of the node that the fit started from, shape (b,)
    """

    loglik: np.ndarray
    loss: np.ndarray
    penalty: np.ndarray
    position: np.ndarray
    residuals: np.ndarray
    node: np.ndarray


@dataclass(frozen=True)
class Data:
    """Data sets that are fitted.

    Parameters
    ----------
    y : whitened values, shape (b, n)
    z : nuisance data in standard deviations from the measured values, shape (b, k)
    like : how squares become a log-likelihood
    replicate : redrawn replicate variance, shape (b,)
    weights : 1 for values that are used, 0 for values left out, shape (b, n); None uses all
    """

    y: Array
    z: Array
    like: Likelihood
    replicate: Array
    weights: Array | None

    @property
    def plain(self) -> bool:
        """Whether inner products of the nodes are enough: all values are used."""
        return self.weights is None

    @cached_property
    def squares(self) -> Array:
        """Sum of the squared values, shape (b,)."""
        return cast(Array, np.einsum("bn,bn->b", self.y, self.y))

    @cached_property
    def beside(self) -> Array:
        """What nodes are ranked by beside values: nuisance data in known noise, and ones."""
        one = np.ones((len(self.y), 1))
        return np.concatenate([self.z, one], axis=1) if self.like.known else one

    @cached_property
    def count(self) -> Array:
        """Number of values used, shape (b,)."""
        return np.full(len(self.y), float(self.y.shape[1])) if self.weights is None else self.weights.sum(axis=1)

    def loglik(self, loss: Array, penalty: Array) -> Array:
        """Log-likelihood of sums of squares of data and nuisance, (b,) or (b, any)."""
        shape = (-1,) + (1,) * (np.ndim(loss) - 1)
        return cast(Array, self.like.loglik(loss, penalty, self.count.reshape(shape), self.replicate.reshape(shape)))

    def per(self, loss: Array) -> Array:
        """One over the noise variance by sums of squares, shape (b,)."""
        return 1.0 / self.like.variance(loss, self.count, self.replicate)

    def used(self, residuals: Array) -> Array:
        """Weight of every value, none for those left out, shape (b, n)."""
        return np.ones_like(residuals) if self.weights is None else self.weights

    def some(self, rows: Any) -> Data:
        """Some of the data sets."""
        weights = None if self.weights is None else self.weights[rows]
        return Data(self.y[rows], self.z[rows], self.like, self.replicate[rows], weights)


def fits(
    grids: Sequence[Grid], y: Array, z: Array, like: Likelihood, replicate: Array | float = 1.0,
    weights: Array | None = None, residuals: bool = True,
) -> list[BestFit]:
    """Best fit of several models to each data set, one ``BestFit`` per model.

    Parameters
    ----------
    grids : models
    y : whitened values, shape (b, n)
    z : nuisance data in standard deviations, shape (b, k)
    like : how squares become a log-likelihood
    weights : 1 for values that are used, else 0, shape (b, n); None for all
    replicate : redrawn replicate variance, a number or shape (b,)
    residuals : whether they are wanted; where not, they have the shape (b, 0)
    """
    y, z = np.atleast_2d(y), np.atleast_2d(z)
    data = Data(y, z, like, np.broadcast_to(np.asarray(replicate, dtype=float), (len(y),)), weights)
    # data sets that are fitted at a time, so that work arrays stay small
    step = max(1, (BLOCK if data.plain else CHUNK) // max(1, *(len(g.nodes) for g in grids)))
    step = max(1, min(step, CHUNK // max(1, y.shape[1] * (len(grids) if y.shape[1] <= MANY else 1))))
    # small arrays are cheaper by the dozen: grids of as many axes go together
    alike: dict[int, list[int]] = {}  # numbers of grids by their axes; -i for one that goes alone
    for i, grid in enumerate(grids):
        alike.setdefault(len(grid.shape) if data.plain and y.shape[1] <= MANY else -i, []).append(i)
    parts = []  # fits of every grid, for one slice of the data sets after another
    for start in range(0, max(len(y), 1), step):
        some = data.some(slice(start, start + step))
        found: dict[int, BestFit] = {}
        for group in alike.values():
            found.update(zip(group, _fitted([grids[i] for i in group], some, residuals), strict=True))
        parts.append([found[i] for i in range(len(grids))])
    if len(parts) == 1:
        return parts[0]
    # each field of a fit of one grid, over all slices
    return [BestFit(*map(np.concatenate, zip(*(vars(f).values() for f in found), strict=True)))
            for found in zip(*parts, strict=True)]


def _fitted(grids: Sequence[Grid], data: Data, residuals: bool) -> list[BestFit]:
    """Fit data sets on grids: best node, linear step in its cell, better cells beside.

    Parameters
    ----------
    residuals : whether the fits keep their residuals, shape (b, n)
    """
    b, many = len(data.y), len(grids)
    starts = [_best_node(g.cells, data) for g in grids]
    # all data sets once for every grid, one grid after the other
    every = data if many == 1 else data.some(np.tile(np.arange(b), many))
    owner = np.repeat(np.arange(many), b)
    inner = [s.products for s in starts if s.products is not None]
    column = np.concatenate([s.column for s in starts])
    found = _step(grids, every, owner, column, inner)
    if grids[0].shape:
        for g, grid in enumerate(grids):
            if len(grid.sizes) > 1:  # of two causes, which may trade off
                _try_rows_beside(grid, data, found, slice(g * b, (g + 1) * b), starts[g].ranks)
        _go_on(grids, every, owner, found)
    out = []
    for g, grid in enumerate(grids):
        part = slice(g * b, (g + 1) * b)
        node, position = grid.cells.number[found.column[part]], (found.index[:, part] + found.move[:, part]).T
        loglik, loss, penalty = found.loglik[part], found.loss[part], found.penalty[part]
        left = np.zeros((b, 0))
        # a loss that is a small difference of large sums is computed again from the residuals
        poor = np.flatnonzero(loss < CANCELLED * data.squares) if data.plain else np.zeros(0, int)
        if residuals or len(poor):
            chosen = data if residuals else data.some(poor)
            rows = slice(None) if residuals else poor
            rest = chosen.y - grid.values_from(node[rows], position[rows])
            loss[rows] = data.like.loss(rest, chosen.weights)
            loglik[rows] = chosen.loglik(loss[rows], penalty[rows])
            left = rest if residuals else left
        out.append(BestFit(loglik=loglik, loss=loss, penalty=penalty, position=position, residuals=left, node=node))
    return out


class BestNode(NamedTuple):
    """The best node of each of b data sets, and what finding it has computed.

    Parameters
    ----------
    column : number of the node in the order of ``Cells``, shape (b,)
    products : data times node and its 2 d neighbours, shape (b, 1 + 2 d); None where values are left out
    ranks : of every node, the higher the better among nodes with the same measured inputs, shape (b, nodes)
    """

    column: Index
    products: Array | None
    ranks: Array


def _best_node(cells: Cells, data: Data) -> BestNode:
    """The node of a grid with the largest log-likelihood, for each data set."""
    y, z, like = data.y, data.z, data.like
    if not data.plain:
        used = data.used(y)
        # |y - F|^2 = |y|^2 - 2 y F + |F|^2, each value with its weight
        squares = (used * y * y).sum(axis=1)[:, None]
        loss = np.maximum((squares - 2.0 * (used * y) @ cells.nodes.T) + used @ (cells.nodes**2).T, 0.0)
        penalty = ((z[:, None, :] - cells["z"][None]) ** 2).sum(axis=-1)
        ranks = data.loglik(loss, penalty)
        return BestNode(np.argmax(ranks, axis=1), products=None, ranks=ranks)
    # y F - |F|^2 / 2 ranks nodes as -|y - F|^2 / 2 does: |y|^2 is the same for all nodes of a data set
    known, rows = like.known, np.arange(len(y))
    products = cells.products(y, data.beside, known)
    if known:
        column = products.argmax(axis=1)
    else:  # the best sizes for each value of the inputs, then the best of those: only they need a logarithm
        levels = cells.z_levels
        by_level = products.reshape(len(y), len(levels), -1)
        size = by_level.argmax(axis=2)
        best = np.take_along_axis(by_level, size[..., None], axis=2)[..., 0]
        loss = np.maximum(data.squares[:, None] - 2.0 * best, 0.0)
        penalty = ((z[:, None, :] - levels[None]) ** 2).sum(axis=-1)
        level = np.argmax(data.loglik(loss, penalty), axis=1)
        column = level * by_level.shape[2] + size[rows, level]
    # back to y F: what ranks the nodes besides is taken off
    around = np.concatenate([column[:, None], cells.beside[column]], axis=1)
    inner = products[rows[:, None], around] + (cells["half"][:, 0] if known else 0.5 * cells["squares"][:, 0])[around]
    if known and cells.k:
        inner -= np.einsum("bck,bk->bc", cells["z"][around], z)
    return BestNode(column, inner, products)


@dataclass
class _Found:
    """Fits under way of b data sets, along the last axis.

    ``column`` is the node that each is fitted from, (b,), ``index`` its place along every axis and ``move`` the step
    from there in cells, (d, b). ``loglik``, ``loss`` and ``penalty``, that of the measured inputs, are (b,).
    """

    column: Index
    index: Array
    move: Array
    loglik: Array
    loss: Array
    penalty: Array

    def take(self, at: Index, other: _Found, which: np.ndarray) -> None:
        """Write some fits of others over those of some data sets.

        Parameters
        ----------
        at : numbers of the data sets
        which : which of the other fits these are, boolean
        """
        for values, others in zip(vars(self).values(), vars(other).values(), strict=True):
            values[..., at] = others[..., which]


def _step(grids: Sequence[Grid], data: Data, owner: Index, column: Index, inner: Sequence[Array] = ()) -> _Found:
    """One linear step from a node of the grid that each data set is fitted by.

    Parameters
    ----------
    grids, data : grids of as many axes, and the b data sets
    owner, column : number of the grid of every data set, and of the node in it to step from, shape (b,)
    inner : products of data and nodes that are known, an array per grid as in :class:`BestNode`; () where none are
    """
    at = StepData(
        y=data.y, z=data.z, squares=data.squares, per=None if data.like.known else data.per,
        used=None if data.plain else data.used,
    )
    step = stepped([g.cells for g in grids], owner, column, at, inner)
    loss = step.loss if step.left is None else data.like.loss(step.left, data.weights)
    penalty = (step.off**2).sum(axis=0)
    return _Found(column, step.index, step.move, data.loglik(loss, penalty), loss, penalty)


def _try_rows_beside(grid: Grid, data: Data, found: _Found, part: slice, ranks: Array) -> None:
    """Try steps from the best nodes in the rows beside those of the fits.

    Two causes that trade off make a valley narrower than a cell: the best node need not lie in the cell of the best
    fit. No step reaches farther than half of every cell, and a row that this rules out is left alone.

    Parameters
    ----------
    found : fits of all grids, changed where a better one is found
    part : of ``found``, the data sets on this grid
    ranks : of every node for each data set, from :func:`_best_node`
    """
    # a row: nodes of one size of the first cause and one value of the inputs, over all sizes of the second
    cells, line = grid.cells, np.arange(grid.shape[1])
    numbers = np.arange(found.loglik.shape[-1])[part]
    last = grid.shape[0] - 1
    active = np.arange(len(data.y))  # data sets whose fit may still move
    for _ in range(WALK):
        moved = []
        for way in (-1, 1):  # to the row before, and after
            at = found.column[part][active]
            row = at // len(line) % (last + 1) + way
            rows = active[(row >= 0) & (row <= last)]
            first = (found.column[part][rows] // len(line) + way) * len(line)  # first node of that row
            column = first + ranks[rows[:, None], first[:, None] + line].argmax(axis=1)  # its best one
            some = data.some(rows)
            before = some.like.loss(some.y - cells.nodes[column], some.weights)
            # a step from a node changes the residuals by at most `reach`: the best it can come to
            least = np.maximum(np.sqrt(before) - cells.reach[column], 0.0) ** 2
            can = some.loglik(least, np.zeros(len(rows))) > found.loglik[part][rows] + BETTER
            rows, some, column = rows[can], some.some(can), column[can]
            if not len(rows):
                continue
            other = _step([grid], some, np.zeros(len(rows), dtype=int), column)
            better = other.loglik > found.loglik[part][rows] + BETTER
            found.take(numbers[rows[better]], other, better)
            moved.append(rows[better])
        active = np.unique(np.concatenate(moved)) if moved else active[:0]


def _go_on(grids: Sequence[Grid], data: Data, owner: Index, found: _Found) -> None:
    """Go on to the next cell where a fit ended on the edge of its own.

    Along a valley the nearest node misleads. What is better in the next cell is written to ``found``, what is not
    stays.

    Parameters
    ----------
    grids, data : grids of as many axes, and the b data sets
    owner : number of the grid of every data set, shape (b,)
    found : fits; its ``move`` is the step from the node along every axis in cells, from -0.5 to 0.5
    """
    last, stride = np.array([g.cells.last for g in grids]), np.array([g.cells.stride for g in grids])
    active = np.arange(len(owner))
    for _ in range(WALK):
        active = active[(np.abs(found.move[:, active]) >= EDGE).any(axis=0)]
        move, index, mine = found.move[:, active], found.index[:, active].astype(int), owner[active]
        # nodes to go on along every axis, -1, 0 or 1; none at the end of an axis
        on = np.where(np.abs(move) >= EDGE, np.sign(move), 0.0).astype(int)
        on = np.clip(index + on, 0, last[mine].T) - index
        goes = on.any(axis=0)
        active, on = active[goes], on[:, goes]
        if not len(active):
            return
        column = found.column[active] + (stride[owner[active]].T * on).sum(axis=0)
        some = data.some(active)
        other = _step(grids, some, owner[active], column)
        better = other.loglik > found.loglik[active] + BETTER
        active = active[better]
        found.take(active, other, better)
