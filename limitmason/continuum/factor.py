"""Multifrontal factor of a stiffness that comes brick by brick: no sparse matrix is made.

The order and the fronts are those of :mod:`limitmason.multifrontal`. A front whose own block is not
positive definite, behind a peak, is eliminated with row exchanges inside that block instead of by Cholesky. As these
cannot leave the front, every solution is put into the matrix: what is unbalanced must be small beside the size of the
matrix times that of the solution, |b - K x| <= 1e-8 (|b| + max |K| |x|), or it is corrected and, where that fails,
found again by a factor with exchanges over the whole matrix. This is not a check against the load alone.

Sources: Duff and Reid (1983), The multifrontal solution of indefinite sparse symmetric linear equations; Liu (1992),
The multifrontal method for sparse matrix solution: theory and practice.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dgetrf, dgetrs, dpotrf
from scipy.sparse.linalg import splu

from limitmason.arrays import Array, Flags, Index
from limitmason.errors import NotApplicable
from limitmason.multifrontal.dissection import block_graph, dissect, elimination_tree
from limitmason.multifrontal.fronts import Front, Fronts, below_cholesky

_LEAF = 40  # nodes of a piece that is left whole: fewer cost calls, more cost fill
_CORRECTIONS = 3  # most corrections of a solution, or as many as are asked for
_EXACT = 1e-11  # unbalanced over the size of the matrix times the solution: above it a solution is corrected
_GOOD = 1e-8  # above it, after corrections, the whole is factored with exchanges
_SUMMED = 1e6  # sums in a matrix and its factor over its largest entry, at most
_LOOSE = 1e13  # size of the matrix times the solution over the right-hand side: rounding alone resists


class SingularStiffness(NotApplicable):
    """Part of a solid can move without strain, or the stiffness or the load is not finite."""


class Elimination:
    """What factors of one mesh share: the order of elimination, the fronts, and where bricks stand in them.

    Parameters
    ----------
    unknowns : of every brick, 3 i + j for direction j of node i, shape (m, k)
    held : unknowns that are zero, shape (3 n,)
    position : of the nodes [m], shape (n, 3)

    Attributes
    ----------
    order : free unknown that is eliminated at every rank, shape (r,)
    rank : of the unknowns of every brick, -1 for held ones, shape (m, k)
    fronts : their sizes and places
    bricks : numbers of the bricks that every front assembles
    places : place in the front of the unknowns of these bricks, shape (bricks of the front, k) each
    """

    def __init__(self, unknowns: Index, held: Flags, position: Array) -> None:
        """Number the unknowns and lay out the fronts.

        Parameters
        ----------
        unknowns, held, position : see the class
        """
        # nodes that move and belong to a brick get a number of their own; the others, -1, are no part of the graph
        free = ~held.reshape(-1, 3)
        nodes = np.intersect1d(np.flatnonzero(free.any(axis=1)), unknowns[:, ::3] // 3)
        number = np.full(len(free), -1, dtype=np.intp)
        number[nodes] = np.arange(len(nodes))
        node, brick = number[unknowns[:, ::3] // 3], np.arange(len(unknowns))[:, None]
        moves = node >= 0
        graph = block_graph(node[moves], np.broadcast_to(brick, node.shape)[moves])
        pieces = dissect(graph, position[nodes], _LEAF)
        # nodes in the order of elimination, then their free unknowns in that order
        ordered = nodes[np.concatenate(pieces)]
        self.order: Index = (3 * ordered[:, None] + np.arange(3))[free[ordered]]
        rank = np.full(held.size, -1, dtype=np.intp)
        rank[self.order] = np.arange(len(self.order))
        self.rank = rank[unknowns]
        self.fronts = Fronts(elimination_tree(graph, pieces), free[ordered].sum(axis=1))
        # a brick is assembled by the front that eliminates the first of its unknowns; a wholly held one by none
        first = np.where(self.rank < 0, len(self.order), self.rank).min(axis=1)
        owner = np.where(first < len(self.order), self.fronts.eliminating(first), -1)
        self.bricks = [np.flatnonzero(owner == k) for k in range(len(self.fronts.owned))]
        self.places = [self._places(k, self.rank[bricks]) for k, bricks in enumerate(self.bricks)]

    def _places(self, front: int, rank: Index) -> Index:
        """Places in a front of the unknowns of its bricks, shape (b, k).

        Parameters
        ----------
        front : number of the front
        rank : of the unknowns in the order of elimination, shape (b, k); held ones, -1, share a place behind all others
        """
        size = self.fronts.owned[front] + len(self.fronts.edges[front])
        return np.where(rank < 0, size, self.fronts.place(front, rank))


class _Exactly(Exception):
    """A front's own block is exactly singular."""


class Factor:
    """Factor of one stiffness.

    Right-hand sides and solutions are in the order of elimination.

    Parameters
    ----------
    elimination : order and fronts
    values : matrices of the bricks, symmetric, shape (m, k, k)

    Attributes
    ----------
    indefinite : number of fronts that were not positive definite
    exchanged : whether exchanges over the whole matrix were needed
    _store : factored own block of every front and the block below it, as :meth:`.Fronts.parts` finds them

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
        """Eliminate the fronts from the bottom up.

        Parameters
        ----------
        elimination, values : see the class
        """
        self.elimination, self.values = elimination, values
        self.indefinite, self._negative_found = 0, 0  # fronts, and negative eigenvalues of their own blocks
        self._largest = float(np.abs(values).max(initial=0.0))
        self._whole: Callable[[Array], Array] | None = None  # solves by the factor with exchanges over the whole
        self._exchanges: dict[int, Index] = {}  # of the rows of fronts that are not positive definite
        # entries are summed over bricks and fronts: with room for that none may overflow
        if not np.isfinite(_SUMMED * self._largest):
            raise SingularStiffness("the stiffness is not finite, or its sums are not")
        self._store = np.empty(elimination.fronts.size)
        try:
            elimination.fronts.eliminate(self._store, self._assembled, self._factored_pivot)
        except _Exactly:
            self._exchange()

    @property
    def exchanged(self) -> bool:
        """Whether exchanges over the whole matrix were needed."""
        return self._whole is not None

    @property
    def negative(self) -> int | None:
        """Number of negative eigenvalues, None where exchanges over the whole matrix were needed.

        It is the sum over all fronts' own blocks, since inertia is additive over Schur complements (Haynsworth 1968).
        """
        return None if self.exchanged else self._negative_found

    def _factored_pivot(self, k: int, front: Front) -> Front:
        """A front, eliminated: factor of its own block, block below it, and what it leaves of its boundary.

        By Cholesky, f21 becomes f21 L^-T. Else by LU with exchanges of rows inside the own block, f21 kept as it is.

        Parameters
        ----------
        k : number of the front
        front : assembled, with what its children left
        """
        own, below, left = front
        lower, failed = dpotrf(own, lower=1, clean=0)
        if not failed:
            return below_cholesky(lower, front)
        self.indefinite += 1
        full = np.tril(own) + np.tril(own, -1).T  # LU needs both halves, fronts fill the lower one
        self._negative_found += int((np.linalg.eigvalsh(full) < 0.0).sum())
        factor, self._exchanges[k], failed = dgetrf(full, overwrite_a=1)
        if failed:
            raise _Exactly
        if len(below):
            left -= below @ dgetrs(factor, self._exchanges[k], below.T)[0]
        return factor, below, left

    def _assembled(self, k: int) -> Front:
        """Own block, boundary by own, and boundary, from the bricks of front ``k``.

        Only lower halves count.
        """
        e = self.elimination
        own, size = int(e.fronts.owned[k]), int(e.fronts.owned[k]) + len(e.fronts.edges[k])
        n = size + 1  # the last place collects what is held
        # places in the whole front, column by column, of all entries of the bricks' matrices
        to = e.places[k][:, :, None] + n * e.places[k][:, None, :]
        whole = np.bincount(to.ravel(), self.values[e.bricks[k]].ravel(), minlength=n * n).reshape((n, n), order="F")
        parts = whole[:own, :own], whole[own:-1, :own], whole[own:-1, own:-1]
        return tuple(np.array(part, dtype=float, order="F") for part in parts)  # type: ignore[return-value]

    def _exchange(self) -> None:
        """Factor the whole matrix with exchanges of rows, where a front alone has no factor."""
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
        # a solution that long says that rounding alone resists: corrections would be as wrong as it is
        if (self._largest * _lengths(x) <= _LOOSE * load).all():
            for correction in range(max(corrections, _CORRECTIONS) + 1):
                off = b - self.product(x)
                size = np.maximum(load + self._largest * _lengths(x), np.finfo(float).tiny)
                worst = float((_lengths(off) / size).max())
                if correction >= corrections and worst <= _EXACT:
                    return x.reshape(right.shape)
                x = x + self._substituted(off)
            if worst <= _GOOD:
                return x.reshape(right.shape)
        # factors without exchange of rows were not exact enough: made with it, once
        if self.exchanged:
            raise self._singular()
        self._exchange()
        return self.solve(right, corrections=corrections)

    def product(self, x: Array) -> Array:
        """The matrix times the c columns of ``x``, shape (r, c)."""
        rank = self.elimination.rank
        padded = np.concatenate([x, np.zeros((1, x.shape[1]))])  # rank -1, held, takes the zero
        f = self.values @ padded[rank]
        out = np.empty(x.shape)
        for c in range(x.shape[1]):  # held rows are summed in the first place and dropped
            out[:, c] = np.bincount((rank + 1).ravel(), f[:, :, c].ravel(), minlength=len(x) + 1)[1:]
        return out

    def _substituted(self, right: Array) -> Array:
        """Solution for right-hand sides (r, c), by substitution forwards and back through the fronts."""
        if self._whole is not None:
            return np.asarray(self._whole(right))
        fronts = self.elimination.fronts
        # no front needed its rows exchanged, as where the matrix is positive definite: Cholesky's two sweeps serve
        if not self._exchanges:
            rows = np.array(right.T, order="C")
            fronts.substitute(self._store, rows)
            return rows.T
        x = np.array(right)
        for k in range(len(fronts.owned)):
            mine, edge, own, below = self._of_front(x, k)
            exchanged = k in self._exchanges
            mine[:] = dgetrs(own, self._exchanges[k], mine)[0] if exchanged else dtrsm(1.0, own, mine, lower=1)
            x[edge] -= below @ mine
        for k in reversed(range(len(fronts.owned))):
            mine, edge, own, below = self._of_front(x, k)
            passed = below.T @ x[edge]
            if k in self._exchanges:
                mine -= dgetrs(own, self._exchanges[k], passed)[0]
            else:
                mine[:] = dtrsm(1.0, own, mine - passed, lower=1, trans_a=1)
        return x

    def _of_front(self, x: Array, k: int) -> tuple[Array, Index, Array, Array]:
        """What substitution needs of a front: own rows of x, ranks that it touches, own block, block below it.

        Parameters
        ----------
        x : unknowns in the order of elimination, shape (r, c); the rows given back are a view
        k : number of the front
        """
        fronts = self.elimination.fronts
        first = int(fronts.first[k])
        return x[first : first + int(fronts.owned[k])], fronts.edges[k], *fronts.parts(self._store, k)


def _lengths(vectors: Array) -> Array:
    """Lengths of the columns of (r, c) whose squares may overflow, shape (c,), infinite where they are not finite."""
    largest = np.abs(vectors).max(axis=0, initial=0.0)
    unit = np.where(largest > 0.0, largest, 1.0)
    lengths = unit * np.linalg.norm(vectors / unit, axis=0)
    return np.asarray(np.where(np.isfinite(lengths), lengths, np.inf))


def assembled(values: Array, rank: Index, count: int) -> sparse.csc_array:
    """Sparse matrix of the free unknowns from those of the bricks.

    Parameters
    ----------
    values : shape (m, k, k)
    rank : row of every unknown of a brick, negative for those held, shape (m, k)
    count : number of rows of the matrix
    """
    narrow = rank.astype(np.int32)  # half the memory of the lists below
    k = rank.shape[1]
    row, column = np.repeat(narrow, k, axis=1).ravel(), np.tile(narrow, (1, k)).ravel()
    kept = (row >= 0) & (column >= 0)
    entries = sparse.coo_array((values.ravel()[kept], (row[kept], column[kept])), shape=(count, count))
    return sparse.csc_array(entries.tocsc())
