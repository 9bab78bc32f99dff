"""Multifrontal factor of a stiffness that comes brick by brick: no sparse matrix is made.

Parts of the mesh are eliminated from the bottom up. The front of a part is a dense matrix of the unknowns it eliminates
and of those they touch; what elimination leaves goes to the front of the part above. A front whose own block is not
positive definite, behind a peak, is eliminated with row exchanges inside that block instead of by Cholesky. As these
cannot leave the front, every solution is put into the matrix: what is unbalanced must be small beside the size of the
matrix times that of the solution, |b - K x| <= 1e-8 (|b| + max |K| |x|), or it is corrected and, where that fails,
found again by a factor with exchanges over the whole matrix. This is not a check against the load alone.

Sources: Duff and Reid (1983), The multifrontal solution of indefinite sparse symmetric linear equations; Liu (1992),
The multifrontal method for sparse matrix solution: theory and practice.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dgetrf, dgetrs, dpotrf
from scipy.sparse.linalg import splu

from limitmason.continuum.dissection import Part
from limitmason.errors import NotApplicable

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_EXACT = 1e-11  # unbalanced over the size of the matrix times the solution: above it a solution is corrected
_GOOD = 1e-8  # above it, after corrections, the whole is factored with exchanges
_SUMMED = 1e6  # sums in a matrix and its factor over its largest entry, at most
_LOOSE = 1e13  # size of the matrix times the solution over the right-hand side: rounding alone resists


class SingularStiffness(NotApplicable):
    """Part of a solid can move without strain, or the stiffness or the load is not finite."""


class Front(NamedTuple):
    """Unknowns by their rank in the order of elimination: those eliminated, and those they touch, ascending.

    ``runs`` are the pieces of the boundary that stay together in the front above: first and last in the boundary, and
    where the piece begins there, own unknowns before boundary.
    """

    first: int
    size: int
    boundary: Index
    halves: tuple[int, ...]
    bricks: Index
    place: Index  # of the 60 unknowns of every brick in the front, its size for those held, (b, 60)
    runs: list[tuple[int, int, int]]


class Elimination:
    """What factors of one mesh share: the order of elimination and the fronts.

    Parameters
    ----------
    parts : of the mesh, halves first
    unknowns : of every brick, shape (m, 60)
    held : unknowns that are zero, shape (3 n,)
    """

    def __init__(self, parts: list[Part], unknowns: Index, held: NDArray[np.bool_]) -> None:
        """Number the unknowns and lay out the fronts."""
        own = [(3 * p.nodes[:, None] + np.arange(3)).ravel() for p in parts]
        own = [u[~held[u]] for u in own]
        self.order: Index = np.concatenate(own)
        self.unknowns = unknowns
        rank = np.full(held.size, -1, dtype=np.intp)
        rank[self.order] = np.arange(len(self.order))
        self.rank = rank[unknowns]
        ends = np.cumsum([len(u) for u in own])
        self.fronts: list[Front] = []
        for part, end, count in zip(parts, ends.tolist(), map(len, own), strict=True):
            at = self.rank[part.bricks]
            touched = np.unique(np.concatenate([at.ravel(), *(self.fronts[h].boundary for h in part.halves)]))
            boundary = touched[touched >= end]
            front = Front(end - count, count, boundary, part.halves, part.bricks, at, [])
            size = count + len(boundary)
            self.fronts.append(front._replace(place=np.where(at < 0, size, _place(front, at))))
            for half in part.halves:
                self.fronts[half].runs.extend(_runs(_place(front, self.fronts[half].boundary), count))

    def factor(self, values: Array) -> "Factor":
        """Factor of the stiffness with the matrices of the bricks, symmetric, shape (m, 60, 60)."""
        return Factor(self, values)


def _place(front: Front, rank: Index) -> Index:
    """Place of unknowns in a front."""
    inside = rank < front.first + front.size
    return np.asarray(np.where(inside, rank - front.first, front.size + np.searchsorted(front.boundary, rank)))


def _runs(place: Index, count: int) -> list[tuple[int, int, int]]:
    if not len(place):
        return []
    breaks = np.flatnonzero((np.diff(place) != 1) | (place[1:] == count)) + 1
    return [(a, b, int(place[a])) for a, b in pairwise([0, *breaks.tolist(), len(place)])]


class _Eliminated(NamedTuple):
    """A front's own block, lower Cholesky or LU with its row exchanges, and what its unknowns pass on."""

    own: Array  # (k, k)
    exchanges: Index | None
    below: Array  # by Cholesky A21 L^-T, else A21, (m, k)


class Factor:
    """Factor of one stiffness; right-hand sides and solutions are in the order of elimination.

    Parameters
    ----------
    elimination : order and fronts
    values : matrices of the bricks, symmetric, shape (m, 60, 60)

    Attributes
    ----------
    indefinite : fronts that were not positive definite
    exchanged : whether exchanges over the whole matrix were needed

    Raises
    ------
    SingularStiffness
        When the matrix is singular, not just to rounding, or not finite.

    Notes
    -----
    A matrix that is singular to rounding is factored: loads that do not work on its motions without force are carried.
    What is unbalanced is small beside |K| |x|, not always beside the load: with a layer 1e-10 times as stiff as the
    rest it may be 2e-4 of the load, with 1e-8 a hundredth of that; with 1e-12 the solid is refused as singular.
    Corrections do not lower it, the rounding of x alone makes it.
    """

    @np.errstate(over="ignore", invalid="ignore")
    def __init__(self, elimination: Elimination, values: Array) -> None:
        """Eliminate the fronts from the bottom up."""
        self.elimination, self.values = elimination, values
        self.indefinite, self._below = 0, 0
        self._largest = float(np.abs(values).max(initial=0.0))
        self._whole: Callable[[Array], Array] | None = None
        self._done: list[_Eliminated] = []
        if not np.isfinite(_SUMMED * self._largest):
            raise SingularStiffness("the stiffness is not finite, or its sums are not")
        updates: dict[int, Array] = {}
        for number, front in enumerate(elimination.fronts):
            done, left = self._eliminated(front, [updates.pop(h) for h in front.halves])
            if done is None:
                self._done.clear()
                self._exchange()
                return
            self._done.append(done)
            updates[number] = left

    @property
    def exchanged(self) -> bool:
        """Whether exchanges over the whole matrix were needed."""
        return self._whole is not None

    @property
    def negative(self) -> int | None:
        """Negative eigenvalues, those of all fronts' own blocks (Haynsworth 1968); None where exchanges were needed."""
        return None if self.exchanged else self._below

    def _eliminated(self, front: Front, updates: list[Array]) -> tuple[_Eliminated | None, Array]:
        """A front without its own unknowns, and what is left of its boundary; None where that cannot be done."""
        k, m = front.size, len(front.boundary)
        own, below, left = self._assembled(front)
        for half, update in zip(front.halves, updates, strict=True):
            _extend(own, below, left, update, self.elimination.fronts[half].runs)
        if not k:
            return _Eliminated(own, None, below), left
        lower, failed = dpotrf(own, lower=1, clean=0)
        if not failed:
            if m:
                below = dtrsm(1.0, lower, below, side=1, lower=1, trans_a=1, overwrite_b=1)
                left = dsyrk(-1.0, below, beta=1.0, c=left, lower=1, overwrite_c=1)
            return _Eliminated(lower, None, below), left
        self.indefinite += 1
        full = np.tril(own) + np.tril(own, -1).T
        self._below += int((np.linalg.eigvalsh(full) < 0.0).sum())
        factor, exchanges, failed = dgetrf(full, overwrite_a=1)
        if failed:
            return None, left
        if m:
            across, _ = dgetrs(factor, exchanges, below.T)
            left -= below @ across
        return _Eliminated(factor, exchanges, below), left

    def _assembled(self, front: Front) -> tuple[Array, Array, Array]:
        """Own block, boundary by own, and boundary, from the bricks of the front; only lower halves count."""
        k, m = front.size, len(front.boundary)
        if not len(front.bricks):
            return np.zeros((k, k), order="F"), np.zeros((m, k), order="F"), np.zeros((m, m), order="F")
        n = k + m + 1  # the last place collects what is held
        to = front.place[:, :, None] + n * front.place[:, None, :]
        whole = np.bincount(to.ravel(), self.values[front.bricks].ravel(), minlength=n * n).reshape((n, n), order="F")
        return (
            np.asfortranarray(whole[:k, :k]), np.asfortranarray(whole[k:-1, :k]), np.asfortranarray(whole[k:-1, k:-1]),
        )  # fmt: skip

    def _exchange(self) -> None:
        """Factor the whole matrix with exchanges."""
        n = len(self.elimination.order)
        matrix = assembled(self.values, self.elimination.rank, n)
        try:
            factor = splu(matrix)
        except RuntimeError as error:
            raise self._singular() from error
        self._whole = factor.solve

    def _singular(self) -> SingularStiffness:
        return SingularStiffness(
            "the stiffness is singular: supports leave part of the solid free to move, cracks have cut it off, or a "
            "single layer of bricks with points=2 has motions without strain"
        )

    @np.errstate(over="ignore", under="ignore", invalid="ignore")
    def solve(self, right: Array, *, corrections: int = 1) -> Array:
        """Solution for right-hand sides of shape (r,) or (r, c).

        Parameters
        ----------
        corrections : how often what is unbalanced is solved for again at least; more often only where it is large.
            Without any, rounding chooses among the paths of a solid whose strain is the same all over

        Raises
        ------
        SingularStiffness
            When a right-hand side is not finite, has a part that rounding alone resists, or no solution balances it.
        """
        b = right.reshape(len(right), -1)
        if not np.isfinite(b).all():
            raise SingularStiffness("the load is not finite")
        load = _lengths(b)
        x = self._substituted(b)
        if (self._largest * _lengths(x) <= _LOOSE * load).all():
            for correction in range(max(corrections, 3) + 1):
                off = b - self.product(x)
                size = np.maximum(load + self._largest * _lengths(x), np.finfo(float).tiny)
                worst = float((_lengths(off) / size).max())
                if correction >= corrections and worst <= _EXACT:
                    return x.reshape(right.shape)
                x = x + self._substituted(off)
            if worst <= _GOOD:
                return x.reshape(right.shape)
        if self.exchanged:
            raise self._singular()
        self._exchange()
        return self.solve(right, corrections=corrections)

    def product(self, x: Array) -> Array:
        """The matrix times vectors, shape (r, c)."""
        rank = self.elimination.rank
        padded = np.concatenate([x, np.zeros((1, x.shape[1]))])  # rank -1, held, takes the zero
        f = self.values @ padded[rank]
        out = np.empty(x.shape)
        for c in range(x.shape[1]):
            out[:, c] = np.bincount((rank + 1).ravel(), f[:, :, c].ravel(), minlength=len(x) + 1)[1:]
        return out

    def _substituted(self, right: Array) -> Array:
        if self._whole is not None:
            return np.asarray(self._whole(right))
        x = np.array(right)
        fronts = self.elimination.fronts
        for front, done in zip(fronts, self._done, strict=True):
            if front.size:
                mine = x[front.first : front.first + front.size]
                if done.exchanges is None:
                    mine[:] = dtrsm(1.0, done.own, mine, lower=1)
                    x[front.boundary] -= done.below @ mine
                else:
                    mine[:], _ = dgetrs(done.own, done.exchanges, mine)
                    x[front.boundary] -= done.below @ mine
        for front, done in zip(reversed(fronts), reversed(self._done), strict=True):
            if front.size:
                mine, passed = x[front.first : front.first + front.size], done.below.T @ x[front.boundary]
                if done.exchanges is None:
                    mine[:] = dtrsm(1.0, done.own, mine - passed, lower=1, trans_a=1)
                else:
                    mine -= dgetrs(done.own, done.exchanges, passed)[0]
        return x


def _lengths(vectors: Array) -> Array:
    """Lengths of columns whose squares may overflow, infinite where they are not finite."""
    largest = np.abs(vectors).max(axis=0, initial=0.0)
    unit = np.where(largest > 0.0, largest, 1.0)
    lengths = unit * np.linalg.norm(vectors / unit, axis=0)
    return np.asarray(np.where(np.isfinite(lengths), lengths, np.inf))


def _extend(own: Array, below: Array, left: Array, update: Array, runs: list[tuple[int, int, int]]) -> None:
    """Add the lower half of what a half left to the front above."""
    k = len(own)
    for number, (first, end, to) in enumerate(runs):
        columns = slice(first, end)
        for start, stop, at in runs[number:]:
            block = update[start:stop, columns]
            high, wide = block.shape
            if at < k:
                own[at : at + high, to : to + wide] += block
            elif to < k:
                below[at - k : at - k + high, to : to + wide] += block
            else:
                left[at - k : at - k + high, to - k : to - k + wide] += block


def assembled(values: Array, rank: Index, count: int) -> sparse.csc_array:
    """Sparse matrix of the free unknowns from those of the bricks.

    Parameters
    ----------
    values : shape (m, 60, 60)
    rank : row of every unknown of a brick, negative for those held, shape (m, 60)
    count : rows
    """
    narrow = rank.astype(np.int32)
    row, column = np.repeat(narrow, 60, axis=1).ravel(), np.tile(narrow, (1, 60)).ravel()
    kept = (row >= 0) & (column >= 0)
    entries = sparse.coo_array((values.ravel()[kept], (row[kept], column[kept])), shape=(count, count))
    return sparse.csc_array(entries.tocsc())
