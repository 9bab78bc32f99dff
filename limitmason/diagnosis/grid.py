"""A model tabulated on sizes and nuisance inputs: every fit is a look-up, a matrix product and one linear step."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from limitmason.diagnosis.cells import WALK, Cells, descend, fit_many
from limitmason.diagnosis.likelihood import Likelihood

FIELDS = ("loglik", "loss", "penalty", "position", "residuals", "node")
CHUNK = 2_000_000  # entries of a work array
FACTORS = 4  # of 1 + r^2 / tau under one logarithm: no overflow for residuals below 1e4 in single precision


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


class Grid:
    """Whitened log predictions on the nodes of a regular grid.

    Node values F, data y and the nuisance datum as further rows: the deviance of all data sets at all nodes is
    |y|^2 - 2 y F' + |F|^2. From the best node a linear step within half a cell gives the fit; where it ends on the edge
    of its cell it goes on to the next.

    Parameters
    ----------
    sizes : node sizes, one increasing array per cause (none for the baseline model)
    z : node values of each nuisance input in standard deviations from its measured value
    values : log predictions over the noise, shape (len of every axis ..., n)

    Notes
    -----
    Wrong where predictions bend within one cell: the linear step then misses. ``tabulate`` refines until they do not.
    """

    def __init__(self, sizes: Sequence[np.ndarray], z: Sequence[np.ndarray], values: np.ndarray):
        self.sizes = tuple(np.asarray(s, dtype=float) for s in sizes)
        self.z = tuple(np.asarray(a, dtype=float) for a in z)
        self.values = np.ascontiguousarray(values, dtype=float)
        axes = self.sizes + self.z
        self.shape = tuple(len(a) for a in axes)
        self.n = values.shape[-1]
        if values.shape[:-1] != self.shape:
            raise ValueError(f"values of shape {values.shape} do not fit axes of lengths {self.shape}")

    @cached_property
    def nodes(self) -> np.ndarray:
        """Node values, shape (g, n)."""
        return self.values.reshape(-1, self.n)

    @cached_property
    def node_z(self) -> np.ndarray:
        """Nuisance inputs of every node, shape (g, k)."""
        mesh = np.meshgrid(*self.sizes, *self.z, indexing="ij")[len(self.sizes) :]
        return np.stack([m.ravel() for m in mesh], axis=-1) if mesh else np.zeros((len(self.nodes), 0))

    @cached_property
    def _slopes(self) -> np.ndarray:
        """Change of the values towards the node before and after, per cell and axis, shape (2, g, d, n)."""
        if not self.shape:
            return np.zeros((2, 1, 0, self.n))
        return np.stack([self._steps(self.values, a) for a in range(len(self.shape))], axis=2)

    @cached_property
    def _z_steps(self) -> np.ndarray:
        """Change of the nuisance inputs towards the node before and after, shape (2, g, k)."""
        mesh = np.meshgrid(*self.sizes, *self.z, indexing="ij") if self.z else []
        first = len(self.sizes)
        steps = [self._steps(mesh[first + i][..., None], first + i)[..., 0] for i in range(len(self.z))]
        return np.stack(steps, axis=-1) if steps else np.zeros((2, len(self.nodes), 0))

    def _steps(self, values: np.ndarray, axis: int) -> np.ndarray:
        step = np.diff(values, axis=axis)
        none = np.zeros_like(np.take(values, [0], axis=axis))
        ways = [np.concatenate(parts, axis=axis) for parts in ((none, step), (step, none))]
        return np.stack([w.reshape(-1, values.shape[-1]) for w in ways])

    def _towards(self, array: np.ndarray, node: np.ndarray, after: np.ndarray) -> np.ndarray:
        """One-sided changes at nodes, ``after`` telling the side of each axis, shape (b, d, ...)."""
        return array[after.astype(int), node[:, None], np.arange(after.shape[1])[None, :]]

    @cached_property
    def _reach(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest step from every node, in cells, shape (g, d)."""
        if not self.shape:
            return np.zeros((1, 0)), np.zeros((1, 0))
        index = np.indices(self.shape).reshape(len(self.shape), -1).T
        last = np.array(self.shape) - 1
        return np.where(index == 0, 0.0, -0.5), np.where(index == last, 0.0, 0.5)

    @cached_property
    def cells(self) -> Cells:
        """Inner products of the nodes, by which fits with Gaussian errors are found."""
        return Cells(self.values, self.z)

    def fit(self, y, z, like: Likelihood, replicate=1.0, weights=None) -> Fit:
        """Best fit to each data set.

        Parameters
        ----------
        y : whitened log data, shape (b, n)
        z : nuisance data in standard deviations from the measured values, shape (b, k)
        like : how squares become a log-likelihood
        replicate : redrawn replicate variance, a number or shape (b,)
        weights : 1 for values that are used, 0 for values left out, shape (b, n); None uses all
        """
        if like.tails is None and weights is None:
            return fit_many([self], y, z, like, replicate)[0]
        y, z = np.atleast_2d(y), np.atleast_2d(z)
        replicate = np.broadcast_to(np.asarray(replicate, dtype=float), (len(y),))
        step = max(1, CHUNK // max(1, len(self.nodes)))
        parts = []
        for start in range(0, len(y), step):
            rows = slice(start, start + step)
            chosen = None if weights is None else weights[rows]
            node = self._best_node(y[rows], z[rows], like, replicate[rows], chosen)
            part = self._refine(node, y[rows], z[rows], like, replicate[rows], chosen)
            parts.append(self._walk(part, y[rows], z[rows], like, replicate[rows], chosen))
        if len(parts) == 1:
            return parts[0]
        return Fit(*(np.concatenate([getattr(p, name) for p in parts]) for name in FIELDS))

    def _walk(self, fit: Fit, y, z, like, replicate, weights) -> Fit:
        """Go on to the next cell where a fit ended on the edge of its own: along a valley the nearest node misleads."""
        active = np.arange(len(y))
        for _ in range(WALK if self.shape else 0):
            index = np.stack(np.unravel_index(fit.node[active], self.shape), axis=-1)
            move = fit.position[active] - index
            step = np.where(np.abs(move) >= 0.5 - 1e-9, np.sign(move), 0.0).astype(int)
            step = np.clip(index + step, 0, np.array(self.shape) - 1) - index
            moved = step.any(axis=1)
            active = active[moved]
            if not len(active):
                break
            node = np.ravel_multi_index(tuple((index + step)[moved].T), self.shape)
            chosen = None if weights is None else weights[active]
            other = self._refine(node, y[active], z[active], like, replicate[active], chosen)
            better = other.loglik > fit.loglik[active] + 1e-9
            active = active[better]
            for name in FIELDS:
                getattr(fit, name)[active] = getattr(other, name)[better]
        return fit

    def _best_node(self, y, z, like, replicate, weights):
        used = np.ones_like(y) if weights is None else weights
        count = used.sum(axis=1)[:, None]
        if like.tails is None:
            loss = ((used * y * y).sum(axis=1)[:, None] - 2.0 * (used * y) @ self.nodes.T) + used @ (self.nodes**2).T
            penalty = ((z[:, None, :] - self.node_z[None]) ** 2).sum(axis=-1)
            return np.argmax(like.loglik(np.maximum(loss, 0.0), penalty, count, replicate[:, None]), axis=1)
        loss = (like.tails + 1.0) * _log_terms(y, used, self.nodes, like.tails)
        penalty = ((z[:, None, :] - self.node_z[None]) ** 2).sum(axis=-1)
        return np.argmax(like.loglik(loss, penalty, count, replicate[:, None]), axis=1)

    def _refine(self, node, y, z, like, replicate, weights):
        residuals, off = y - self.nodes[node], z - self.node_z[node]
        low, high = self._reach[0][node], self._reach[1][node]
        first = len(self.sizes)
        # which way: by the mean of the changes on both sides; how far: by the change on that side
        used = weights
        if like.tails is not None:
            pull = (like.tails + 1.0) / (like.tails + residuals**2)
            used = pull if weights is None else weights * pull
        count = float(self.n) if weights is None else weights.sum(axis=1)
        variance = None
        if like.kind != "known":
            variance = like.variance(
                (residuals**2 if used is None else used * residuals**2).sum(axis=1), count, replicate
            )
        inner = np.where((low < 0) & (high > 0), 0.5, 1.0)  # at an end only one side has a change
        slopes = (self._slopes[0][node] + self._slopes[1][node]) * inner[..., None]
        z_step = (self._z_steps[0][node] + self._z_steps[1][node]) * inner[:, first:]
        move = _step(*_normal(slopes, z_step, residuals, off, used, variance), low, high)
        after = (move > 0.0) | (low == 0.0)
        slopes = self._towards(self._slopes, node, after)
        z_step = self._towards(self._z_steps, node, after[:, first:])
        low, high = np.where(after, 0.0, low), np.where(after, high, 0.0)
        move = _step(*_normal(slopes, z_step, residuals, off, used, variance), low, high)
        left = residuals - np.einsum("bd,bdn->bn", move, slopes)
        off = off - move[:, first:] * z_step
        penalty = (off**2).sum(axis=1)
        loss = _loss(left, like, weights)
        index = np.stack(np.unravel_index(node, self.shape), axis=-1) if self.shape else np.zeros((len(y), 0))
        return Fit(like.loglik(loss, penalty, count, replicate), loss, penalty, index + move, left, node)

    def values_at(self, fit: Fit) -> np.ndarray:
        """Whitened predictions of fits (of this grid or of one with as many nodes), shape (b, n)."""
        return self.values_from(fit.node, fit.position)

    def values_from(self, node: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Whitened predictions at grid positions, linear from the node of each, shape (b, n)."""
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

    def sizes_at(self, position: np.ndarray) -> np.ndarray:
        """Sizes of the causes at grid positions, shape (b, p)."""
        columns = [np.interp(position[:, i], np.arange(len(s)), s) for i, s in enumerate(self.sizes)]
        return np.stack(columns, axis=-1) if columns else np.zeros((len(position), 0))

    def z_at(self, position: np.ndarray) -> np.ndarray:
        """Nuisance inputs at grid positions, shape (b, k)."""
        first = len(self.sizes)
        columns = [np.interp(position[:, first + i], np.arange(len(s)), s) for i, s in enumerate(self.z)]
        return np.stack(columns, axis=-1) if columns else np.zeros((len(position), 0))

    def at_size(self, *indices: float) -> "Grid":
        """The baseline-like grid (nuisance only) at given positions along the size axes, linear between nodes."""
        values = self.values
        for u in indices:
            low = min(int(np.floor(u)), len(values) - 1)
            high = min(low + 1, len(values) - 1)
            values = values[low] + (u - low) * (values[high] - values[low])
        return Grid((), self.z, values)

    def denser(self, times: int = 4) -> "Grid":
        """The same grid with more nodes along the nuisance inputs, linear between the old ones."""
        values, z = self.values, []
        for axis, a in enumerate(self.z, start=len(self.sizes)):
            u = np.linspace(0.0, len(a) - 1.0, times * (len(a) - 1) + 1)
            low = np.minimum(u.astype(int), max(len(a) - 2, 0))
            part = (u - low).reshape(-1, *[1] * (values.ndim - axis - 1))
            below = np.take(values, low, axis=axis)
            values = below + part * (np.take(values, np.minimum(low + 1, len(a) - 1), axis=axis) - below)
            z.append(np.interp(u, np.arange(len(a)), a))
        return Grid(self.sizes, z, values)

    def without_axis(self, axis: int) -> list["Grid"]:
        """One grid per node of a size axis, that axis fixed at the node."""
        rest = tuple(s for i, s in enumerate(self.sizes) if i != axis)
        return [Grid(rest, self.z, np.take(self.values, i, axis=axis)) for i in range(len(self.sizes[axis]))]

    def columns(self, chosen: np.ndarray) -> "Grid":
        """The same grid for some of the specimens."""
        return Grid(self.sizes, self.z, self.values[..., chosen])


def _log_terms(y, used, nodes, tails) -> np.ndarray:
    """Sum of log(1 + r^2 / tau) over the values used, shape (b, g), by one logarithm for several; to rank nodes."""
    y, scaled, columns = y.astype(np.float32), (used / tails).astype(np.float32), nodes.T.astype(np.float32)
    out = np.zeros((len(y), columns.shape[1]), dtype=np.float32)
    factor = np.ones_like(out)
    for i, column in enumerate(columns):
        term = y[:, i, None] - column
        term *= term
        term *= scaled[:, i, None]
        term += 1.0
        factor *= term
        if i % FACTORS == FACTORS - 1 or i == len(columns) - 1:
            out += np.log(factor)
            factor[...] = 1.0
    return out


def _loss(residuals, like: Likelihood, weights):
    if weights is None:
        return like.loss(residuals)
    if like.tails is None:
        return (weights * residuals**2).sum(axis=1)
    return (like.tails + 1.0) * (weights * np.log1p(residuals**2 / like.tails)).sum(axis=1)


def _normal(slopes, z_step, residuals, off, used, variance):
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


def _step(gram, gradient, low, high):
    """Linear step of many data sets within their boxes, shape (b, d)."""
    return descend(gram.transpose(1, 2, 0), gradient.T, low.T, high.T).T
