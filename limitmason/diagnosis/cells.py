"""Fits of tabulated models to many data sets from inner products alone, without forming a residual."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limitmason.diagnosis.grid import Grid
    from limitmason.diagnosis.likelihood import Likelihood

SWEEPS = 8  # of coordinate descent inside one cell of three and more axes
TINY = 1e-30  # keeps the step finite along an axis without effect
FLAT = 1e-9  # of the largest squared change per cell along an axis: below it rounding would choose the step
CANCELLED = 1e-8  # share of the data's squares below which a loss is summed again from residuals
WALK = 3  # cells that a fit may go on beyond that of the best node
BLOCK = 400_000  # inner products held at a time: they stay in the processor's cache
EDGE = 0.5 - 1e-9


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
    Columns are the nodes with the sizes innermost: where the noise is estimated, the best size at each value of the
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
        self.z_levels = np.array([v[:: self.levels_apart(first)] for v in node_z]).T if self.k else np.zeros((1, 0))
        flat = [FLAT * float(gram[:, i, i].max(initial=0.0)) for i in range(2 * self.d)]
        flat = [max(flat[i], flat[self.d + i]) for i in range(self.d)]
        # one row per node, so that one look-up fetches all that a step needs
        self.table = np.concatenate([
            index.T, np.where(some[0], -0.5, 0.0).T, np.where(some[1], 0.5, 0.0).T,
            np.einsum("dgn,gn->gd", sides, self.nodes), gram.reshape(self.count, 4 * self.d**2), squares[:, None],
            half[:, None], *(v[:, None] for v in (*node_z, *z_sides)), np.tile(flat, (self.count, 1)),
        ], axis=1)  # fmt: skip
        columns_z = np.stack(node_z, axis=1) if self.k else np.zeros((self.count, 0))
        self.ranks = np.ascontiguousarray(np.concatenate([self.nodes, columns_z, -half[:, None]], axis=1).T)
        self.losses = np.ascontiguousarray(np.concatenate([self.nodes, -0.5 * squares[:, None]], axis=1).T)

    def levels_apart(self, first: int) -> int:
        """Number of columns that share their measured inputs."""
        return int(np.prod(self.shape[:first], dtype=int))


class Looked:
    """What is fetched of the cells that data sets lie in, one array per quantity, data sets along the last axis."""

    def __init__(self, table: np.ndarray, d: int, k: int):
        rows = np.ascontiguousarray(table.T)
        ends = np.cumsum([d, d, d, 2 * d, 4 * d * d, 1, 1, k, 2 * k])
        self.index, self.low, self.high, self.cross, gram, squares, half, self.z, z_sides, self.flat = np.split(
            rows, ends
        )
        self.gram = gram.reshape(2 * d, 2 * d, len(table))
        self.squares, self.half = squares[0], half[0]
        self.z_sides = z_sides.reshape(2, k, len(table))


def fit_many(
    grids: Sequence["Grid"], y: np.ndarray, z: np.ndarray, like: "Likelihood", replicate=1.0, residuals: bool = True
) -> list:
    """Best fit of several models to each data set, Gaussian errors and all values used.

    Parameters
    ----------
    grids : models with as many axes each
    y : whitened log data, shape (b, n)
    z : nuisance data in standard deviations from the measured values, shape (b, k)
    like : how squares become a log-likelihood; no Student errors
    replicate : redrawn replicate variance, a number or shape (b,)
    residuals : whether they are wanted; without, those of the fits have shape (b, 0)

    Returns
    -------
    list of Fit, one per grid
    """
    from limitmason.diagnosis.grid import FIELDS, Fit

    y, z = np.atleast_2d(y), np.atleast_2d(z)
    b = len(y)
    replicate = np.broadcast_to(np.asarray(replicate, dtype=float), (b,))
    largest = max(g.cells.count for g in grids)
    step = max(1, BLOCK // largest)
    parts = [
        _fit_rows(grids, y[s : s + step], z[s : s + step], like, replicate[s : s + step], residuals)
        for s in range(0, max(b, 1), step)
    ]
    if len(parts) == 1:
        return parts[0]
    return [Fit(*(np.concatenate([getattr(p, f) for p in fits]) for f in FIELDS)) for fits in zip(*parts, strict=True)]


def _fit_rows(grids, y, z, like, replicate, residuals):
    from limitmason.diagnosis.grid import Fit

    b, n = y.shape
    d, k = grids[0].cells.d, grids[0].cells.k
    squares = np.einsum("bn,bn->b", y, y)
    known = like.kind == "known"
    one = np.ones((b, 1))
    wide = np.concatenate([y, z, one] if known else [y, one], axis=1)
    rows = np.arange(b)
    tables, inner, columns = [], [], []
    for grid in grids:
        cells = grid.cells
        products = wide @ (cells.ranks if known else cells.losses)
        if known:
            column = products.argmax(axis=1)
        else:
            column = _best_column(cells, products, squares, z, like, n, replicate)
        beside = cells.beside[column]
        inner.append(np.concatenate([products[rows, column][:, None], products[rows[:, None], beside]], axis=1))
        if d:
            constant = cells.table[:, 4 * d * d + 5 * d + (1 if known else 0)] * (1.0 if known else 0.5)
            inner[-1] += constant[np.concatenate([column[:, None], beside], axis=1)]
            if known and k:
                at = 4 * d * d + 5 * d + 2
                at_z = cells.table[:, at : at + k][np.concatenate([column[:, None], beside], axis=1)]
                inner[-1] -= np.einsum("bck,bk->bc", at_z, z)
        else:
            inner[-1] += 0.5 * cells.table[0, 0]
        tables.append(cells.table[column])
        columns.append(column)
    many = len(grids)
    which = np.tile(rows, many)
    looked = Looked(np.concatenate(tables), d, k)
    z_rows, squares, replicate = z.T[:, which], squares[which], replicate[which]
    state = _step(looked, np.ascontiguousarray(np.concatenate(inner).T), z_rows, squares, like, n, replicate)
    state["column"] = np.concatenate(columns)
    if d:
        _walk(grids, state, y, z_rows, squares, like, replicate, b)
    out = []
    for g, grid in enumerate(grids):
        part = slice(g * b, (g + 1) * b)
        node = grid.cells.number[state["column"][part]]
        position = (state["index"][:, part] + state["move"][:, part]).T
        fit = Fit(state["loglik"][part], state["loss"][part], state["penalty"][part], position, np.zeros((b, 0)), node)
        poor = np.flatnonzero(fit.loss < CANCELLED * squares[part])
        if residuals or len(poor):
            chosen = rows if residuals else poor
            left = y[chosen] - grid.values_from(fit.node[chosen], fit.position[chosen])
            fit.loss[chosen] = np.einsum("bn,bn->b", left, left)
            fit.loglik[chosen] = like.loglik(fit.loss[chosen], fit.penalty[chosen], float(n), replicate[part][chosen])
            if residuals:
                fit = Fit(fit.loglik, fit.loss, fit.penalty, fit.position, left, fit.node)
        out.append(fit)
    return out


def _best_column(cells, products, squares, z, like, n, replicate):
    """Best node where the noise is estimated: the best sizes for each value of the inputs, then the best of those."""
    b, levels = len(products), cells.z_levels
    by_level = products.reshape(b, len(levels), -1)
    size = by_level.argmax(axis=2)
    best = np.take_along_axis(by_level, size[..., None], axis=2)[..., 0]
    loss = np.maximum(squares[:, None] - 2.0 * best, 0.0)
    penalty = ((z[:, None, :] - levels[None]) ** 2).sum(axis=-1)
    level = np.argmax(like.loglik(loss, penalty, float(n), replicate[:, None]), axis=1)
    return level * by_level.shape[2] + size[np.arange(b), level]


def _step(looked: Looked, inner, z, squares, like, n, replicate) -> dict[str, np.ndarray]:
    """One linear step in every cell: which way by the mean of the changes on both sides, how far by that side's."""
    d, k = len(looked.index), len(looked.z)
    first = d - k
    at, low, high, gram = inner[0], looked.low, looked.high, looked.gram
    pull = np.concatenate([at - inner[1 : 1 + d], inner[1 + d :] - at]) - looked.cross
    off = z - looked.z
    loss = np.maximum(squares - 2.0 * at + looked.squares, 0.0)
    per = None if like.kind == "known" else 1.0 / like.variance(loss, float(n), replicate)
    if d:
        inside = np.where((low < 0) & (high > 0), 0.5, 1.0)  # at an end only one side has a change
        both = pull[:d] + pull[d:]
        sums = gram[:d, :d] + gram[:d, d:] + gram[d:, :d] + gram[d:, d:]
        mean = [[inside[i] * inside[j] * sums[i, j] for j in range(d)] for i in range(d)]
        z_step = (looked.z_sides[0] + looked.z_sides[1]) * inside[first:]
        slope = [inside[i] * both[i] for i in range(d)]
        move = descend(*_normal(mean, slope, z_step, off, per, looked.flat), low, high)
        after = (move > 0.0) | (low == 0.0)
        low, high = np.where(after, 0.0, low), np.where(after, high, 0.0)
        slope = [np.where(after[i], pull[d + i], pull[i]) for i in range(d)]
        side = [
            [
                np.where(after[i], np.where(after[j], gram[d + i, d + j], gram[d + i, j]),
                         np.where(after[j], gram[i, d + j], gram[i, j]))
                for j in range(d)
            ]
            for i in range(d)
        ]  # fmt: skip
        z_step = np.where(after[first:], looked.z_sides[1], looked.z_sides[0])
        move = descend(*_normal(side, slope, z_step, off, per, looked.flat), low, high)
        for i in range(d):
            loss = loss - 2.0 * move[i] * slope[i]
            for j in range(d):
                loss = loss + move[i] * move[j] * side[i][j]
        loss = np.maximum(loss, 0.0)
        off = off - move[first:] * z_step
    else:
        move = np.zeros((0, len(at)))
    penalty = (off**2).sum(axis=0)
    loglik = like.loglik(loss, penalty, float(n), replicate)
    return {"loglik": loglik, "loss": loss, "penalty": penalty, "move": move, "index": looked.index}


def _normal(gram, slope, z_step, off, per, flat):
    """Normal equations of a linear step; along an axis without effect on the data nothing pulls."""
    d, k = len(slope), len(z_step)
    matrix = [[g if per is None else g * per for g in row] for row in gram]
    right = [s if per is None else s * per for s in slope]
    for i in range(d):
        live = gram[i][i] > flat[i]
        if live.all():
            continue
        right[i] = np.where(live, right[i], 0.0)
        for j in range(d):
            if j != i:
                matrix[i][j] = matrix[j][i] = np.where(live, matrix[i][j], 0.0)
    for i in range(k):
        a = d - k + i
        matrix[a][a] = matrix[a][a] + z_step[i] ** 2
        right[a] = right[a] + z_step[i] * off[i]
    return matrix, right


def _walk(grids, state, y, z, squares, like, replicate, b):
    """Go on to the next cell where a fit ended on the edge of its own: along a valley the nearest node misleads."""
    d, k, n = grids[0].cells.d, grids[0].cells.k, y.shape[1]
    active = np.arange(len(squares))
    for _ in range(WALK):
        move = state["move"][:, active]
        active = active[(np.abs(move) >= EDGE).any(axis=0)]
        if not len(active):
            return
        tables, inner, columns, moved = [], [], [], []
        bounds = np.searchsorted(active, np.arange(len(grids) + 1) * b)
        for g, grid in enumerate(grids):
            mine = active[bounds[g] : bounds[g + 1]]
            if not len(mine):
                continue
            cells = grid.cells
            index = state["index"][:, mine].astype(int)
            on = np.where(np.abs(state["move"][:, mine]) >= EDGE, np.sign(state["move"][:, mine]), 0.0).astype(int)
            on = np.clip(index + on, 0, cells.last[:, None]) - index
            goes = on.any(axis=0)
            mine, column = mine[goes], state["column"][mine[goes]] + cells.stride @ on[:, goes]
            if not len(mine):
                continue
            data = y[mine - g * b]
            around = np.concatenate([column[:, None], cells.beside[column]], axis=1)
            inner.append(np.einsum("bn,bcn->bc", data, cells.nodes[around]))
            tables.append(cells.table[column])
            columns.append(column)
            moved.append(mine)
        if not moved:
            return
        active, column = np.concatenate(moved), np.concatenate(columns)
        looked = Looked(np.concatenate(tables), d, k)
        at = np.ascontiguousarray(np.concatenate(inner).T)
        other = _step(looked, at, z[:, active], squares[active], like, n, replicate[active])
        better = other["loglik"] > state["loglik"][active] + 1e-9
        active = active[better]
        for name in ("loglik", "loss", "penalty", "move", "index"):
            state[name][..., active] = other[name][..., better]
        state["column"][active] = column[better]


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
