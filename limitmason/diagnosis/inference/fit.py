"""Best fits of tabulated models to many data sets: a look-up, a matrix product and one linear step each.

Two strategies of one algorithm, best node, linear step within half a cell, on to the next cell where the step ends on
its edge. Gaussian errors with all values used go by inner products alone, without forming a residual; Student errors
and values left out go by residuals.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.diagnosis.inference.cells import Array, Cells, Looked, Row, Rows, descend
from limitmason.diagnosis.inference.grid import Grid
from limitmason.diagnosis.inference.noise import Likelihood, student_terms

Index = NDArray[np.intp]
State = dict[str, Any]
"""Arrays of the fits under way, by name, data sets along the last axis."""

FIELDS = ("loglik", "loss", "penalty", "position", "residuals", "node")
CANCELLED = 1e-8  # share of the data's squares below which a loss is summed again from residuals
WALK = 3  # cells that a fit may go on beyond that of the best node
EDGE = 0.5 - 1e-9  # of a cell: a step that ends beyond it goes on
BETTER = 1e-9  # log-likelihood by which the next cell must be better
BLOCK = 400_000  # inner products held at a time: they stay in the processor's cache
CHUNK = 2_000_000  # entries of a work array of the strategy by residuals


@dataclass(frozen=True)
class Fit:
    """Best fits of one model to many data sets.

    Parameters
    ----------
    loglik, loss, penalty : shape (b,)
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


def fit(
    grid: Grid, y: Array, z: Array, like: Likelihood, replicate: Array | float = 1.0, weights: Array | None = None
) -> Fit:  # fmt: skip
    """Best fit of one model to each data set; see :func:`fits`."""
    return fits([grid], y, z, like, replicate, weights)[0]


def fits(
    grids: Sequence[Grid],
    y: Array,
    z: Array,
    like: Likelihood,
    replicate: Array | float = 1.0,
    weights: Array | None = None,
    residuals: bool = True,
) -> list[Fit]:
    """Best fit of several models to each data set, one ``Fit`` per model.

    Parameters
    ----------
    grids : models with as many axes each
    y : whitened data, shape (b, n)
    z : nuisance data in standard deviations from the measured values, shape (b, k)
    like : how squares become a log-likelihood
    replicate : redrawn replicate variance, a number or shape (b,)
    weights : 1 for values that are used, 0 for values left out, shape (b, n); None uses all
    residuals : whether they are wanted; where not, fits by products have residuals of shape (b, 0)
    """
    y, z = np.atleast_2d(y), np.atleast_2d(z)
    b = len(y)
    replicate = np.broadcast_to(np.asarray(replicate, dtype=float), (b,))
    products = like.tails is None and weights is None
    step = max(1, (BLOCK if products else CHUNK) // max(1, *(len(g.nodes) for g in grids)))
    parts = []
    for start in range(0, max(b, 1), step):
        rows = slice(start, start + step)
        if products:
            parts.append(_by_products(grids, y[rows], z[rows], like, replicate[rows], residuals))
        else:
            chosen = None if weights is None else weights[rows]
            parts.append([_by_residuals(g, y[rows], z[rows], like, replicate[rows], chosen) for g in grids])
    return [_joined(found) for found in zip(*parts, strict=True)]


def _joined(parts: Sequence[Fit]) -> Fit:
    """Fits of consecutive data sets as one."""
    if len(parts) == 1:
        return parts[0]
    return Fit(*(np.concatenate([getattr(p, name) for p in parts]) for name in FIELDS))


# ---- Gaussian errors: by inner products ------------------------------------------------------------------------------


def _by_products(
    grids: Sequence[Grid], y: Array, z: Array, like: Likelihood, replicate: Array, residuals: bool
) -> list[Fit]:  # fmt: skip
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
        around = np.concatenate([column[:, None], beside], axis=1)
        constant = cells["half"][:, 0] if known else 0.5 * cells["squares"][:, 0]
        inner[-1] += constant[around]
        if known and k:
            inner[-1] -= np.einsum("bck,bk->bc", cells["z"][around], z)
        tables.append(cells.table[column])
        columns.append(column)
    many = len(grids)
    which = np.tile(rows, many)
    looked = Looked(np.concatenate(tables), d, k)
    z_rows, squares, replicate = z.T[:, which], squares[which], replicate[which]
    state = _step_in_cells(looked, np.ascontiguousarray(np.concatenate(inner).T), z_rows, squares, like, n, replicate)
    state["column"] = np.concatenate(columns)
    if d:
        _walk_by_products(grids, state, y, z_rows, squares, like, replicate, b)
    out = []
    for g, grid in enumerate(grids):
        part = slice(g * b, (g + 1) * b)
        node = grid.cells.number[state["column"][part]]
        position = (state["index"][:, part] + state["move"][:, part]).T
        loglik, loss, penalty = (state[name][part] for name in ("loglik", "loss", "penalty"))
        left = np.zeros((b, 0))
        poor = np.flatnonzero(loss < CANCELLED * squares[part])
        if residuals or len(poor):
            chosen = rows if residuals else poor
            rest = y[chosen] - grid.values_from(node[chosen], position[chosen])
            loss[chosen] = np.einsum("bn,bn->b", rest, rest)
            loglik[chosen] = like.loglik(loss[chosen], penalty[chosen], float(n), replicate[part][chosen])
            left = rest if residuals else left
        out.append(Fit(loglik, loss, penalty, position, left, node))
    return out


def _best_column(
    cells: Cells, products: Array, squares: Array, z: Array, like: Likelihood, n: int, replicate: Array
) -> Index:  # fmt: skip
    """Best node where the noise is estimated: the best sizes for each value of the inputs, then the best of those."""
    b, levels = len(products), cells.z_levels
    by_level = products.reshape(b, len(levels), -1)
    size = by_level.argmax(axis=2)
    best = np.take_along_axis(by_level, size[..., None], axis=2)[..., 0]
    loss = np.maximum(squares[:, None] - 2.0 * best, 0.0)
    penalty = ((z[:, None, :] - levels[None]) ** 2).sum(axis=-1)
    level = np.argmax(like.loglik(loss, penalty, float(n), replicate[:, None]), axis=1)
    return level * by_level.shape[2] + size[np.arange(b), level]


def _step_in_cells(
    looked: Looked, inner: Array, z: Array, squares: Array, like: Likelihood, n: int, replicate: Array
) -> State:  # fmt: skip
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
        move = descend(*_normal_of_products(mean, slope, z_step, off, per, looked.flat), low, high)
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
        move = descend(*_normal_of_products(side, slope, z_step, off, per, looked.flat), low, high)
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


def _normal_of_products(
    gram: Rows, slope: Row, z_step: Array, off: Array, per: Array | None, flat: Array
) -> tuple[list[list[Array]], list[Array]]:  # fmt: skip
    """Normal equations of a linear step; along an axis without effect on the data nothing pulls."""
    d, k = len(slope), len(z_step)
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
    for i in range(k):
        a = d - k + i
        matrix[a][a] = matrix[a][a] + z_step[i] ** 2
        right[a] = right[a] + z_step[i] * off[i]
    return matrix, right


def _walk_by_products(
    grids: Sequence[Grid], state: State, y: Array, z: Array, squares: Array, like: Likelihood, replicate: Array, b: int
) -> None:  # fmt: skip
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
        other = _step_in_cells(looked, at, z[:, active], squares[active], like, n, replicate[active])
        better = other["loglik"] > state["loglik"][active] + BETTER
        active = active[better]
        for name in ("loglik", "loss", "penalty", "move", "index"):
            state[name][..., active] = other[name][..., better]
        state["column"][active] = column[better]


# ---- Student errors, and values left out: by residuals -----------------------------------------------------------


def _by_residuals(
    grid: Grid, y: Array, z: Array, like: Likelihood, replicate: Array, weights: Array | None
) -> Fit:  # fmt: skip
    """Best node, step, and on to the next cell as by products."""
    start = _best_node(grid, y, z, like, replicate, weights)
    fitted = _refine(grid, start, y, z, like, replicate, weights)
    active = np.arange(len(y))
    for _ in range(WALK if grid.shape else 0):
        index = np.stack(np.unravel_index(fitted.node[active], grid.shape), axis=-1)
        move = fitted.position[active] - index
        step = np.where(np.abs(move) >= EDGE, np.sign(move), 0.0).astype(int)
        step = np.clip(index + step, 0, np.array(grid.shape) - 1) - index
        moved = step.any(axis=1)
        active = active[moved]
        if not len(active):
            break
        node = np.ravel_multi_index(tuple((index + step)[moved].T), grid.shape)
        chosen = None if weights is None else weights[active]
        other = _refine(grid, node, y[active], z[active], like, replicate[active], chosen)
        better = other.loglik > fitted.loglik[active] + BETTER
        active = active[better]
        for name in FIELDS:
            getattr(fitted, name)[active] = getattr(other, name)[better]
    return fitted


def _best_node(
    grid: Grid, y: Array, z: Array, like: Likelihood, replicate: Array, weights: Array | None
) -> Index:  # fmt: skip
    used = np.ones_like(y) if weights is None else weights
    count = used.sum(axis=1)[:, None]
    if like.tails is None:
        loss = ((used * y * y).sum(axis=1)[:, None] - 2.0 * (used * y) @ grid.nodes.T) + used @ (grid.nodes**2).T
        penalty = ((z[:, None, :] - grid.node_z[None]) ** 2).sum(axis=-1)
        return np.argmax(like.loglik(np.maximum(loss, 0.0), penalty, count, replicate[:, None]), axis=1)
    loss = (like.tails + 1.0) * student_terms(y, used, grid.nodes, like.tails)
    penalty = ((z[:, None, :] - grid.node_z[None]) ** 2).sum(axis=-1)
    return np.argmax(like.loglik(loss, penalty, count, replicate[:, None]), axis=1)


def _refine(
    grid: Grid, node: Index, y: Array, z: Array, like: Likelihood, replicate: Array, weights: Array | None
) -> Fit:  # fmt: skip
    residuals, off = y - grid.nodes[node], z - grid.node_z[node]
    low, high = grid.reach[0][node], grid.reach[1][node]
    first = len(grid.sizes)
    # which way: by the mean of the changes on both sides; how far: by the change on that side
    used = weights
    if like.tails is not None:
        pull = (like.tails + 1.0) / (like.tails + residuals**2)
        used = pull if weights is None else weights * pull
    count = float(grid.n) if weights is None else weights.sum(axis=1)
    variance = None
    if like.kind != "known":
        variance = like.variance((residuals**2 if used is None else used * residuals**2).sum(axis=1), count, replicate)
    inner = np.where((low < 0) & (high > 0), 0.5, 1.0)  # at an end only one side has a change
    slopes = (grid.changes[0][node] + grid.changes[1][node]) * inner[..., None]
    z_step = (grid.z_changes[0][node] + grid.z_changes[1][node]) * inner[:, first:]
    move = _bounded_step(*_normal_of_residuals(slopes, z_step, residuals, off, used, variance), low, high)
    after = (move > 0.0) | (low == 0.0)
    slopes = _beside(grid.changes, node, after)
    z_step = _beside(grid.z_changes, node, after[:, first:])
    low, high = np.where(after, 0.0, low), np.where(after, high, 0.0)
    move = _bounded_step(*_normal_of_residuals(slopes, z_step, residuals, off, used, variance), low, high)
    left = residuals - np.einsum("bd,bdn->bn", move, slopes)
    off = off - move[:, first:] * z_step
    penalty = (off**2).sum(axis=1)
    loss = like.loss(left, weights)
    index = np.stack(np.unravel_index(node, grid.shape), axis=-1) if grid.shape else np.zeros((len(y), 0), int)
    return Fit(like.loglik(loss, penalty, count, replicate), loss, penalty, index + move, left, node)


def _beside(changes: np.ndarray, node: np.ndarray, after: np.ndarray) -> np.ndarray:
    """One-sided changes at nodes, ``after`` telling the side of each axis, shape (b, d, ...)."""
    return changes[after.astype(int), node[:, None], np.arange(after.shape[1])[None, :]]


def _normal_of_residuals(
    slopes: Array, z_step: Array, residuals: Array, off: Array, used: Array | None, variance: Array | None
) -> tuple[Array, Array]:  # fmt: skip
    """Normal equations of a linear step: matrix (b, d, d) and right side (b, d)."""
    if used is None:
        gram, gradient = slopes @ slopes.transpose(0, 2, 1), np.einsum("bdn,bn->bd", slopes, residuals)
    else:
        gram = (slopes * used[:, None]) @ slopes.transpose(0, 2, 1)
        gradient = np.einsum("bdn,bn->bd", slopes, residuals * used)
    if variance is not None:
        gram, gradient = gram / variance[:, None, None], gradient / variance[:, None]
    first = slopes.shape[1] - z_step.shape[1]
    for k in range(z_step.shape[1]):
        gram[:, first + k, first + k] += z_step[:, k] ** 2
        gradient[:, first + k] += z_step[:, k] * off[:, k]
    return gram, gradient


def _bounded_step(gram: Array, gradient: Array, low: Array, high: Array) -> Array:
    """Linear step of many data sets within their boxes, shape (b, d)."""
    return descend(gram.transpose(1, 2, 0), gradient.T, low.T, high.T).T
