"""Fronts of an elimination: their sizes and places, and the two sweeps through them.

A front is a dense matrix of the unknowns that it eliminates and of those that they touch, [[f11, .], [f21, f22]] with
only the lower half used. What elimination leaves of f22 is passed to the front of the parent and not stored. Source:
Duff and Reid (1983), The multifrontal solution of indefinite sparse symmetric linear equations.
"""

from collections.abc import Callable

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm

from limitmason.arrays import Array, Index
from limitmason.multifrontal.dissection import Tree, ragged_ranges

Front = tuple[Array, Array, Array]
"""Own block f11, (n, n), boundary by own f21, (m, n), and boundary f22, (m, m), ordered by columns as LAPACK does.

The front eliminates n unknowns and touches m others.
"""


class Fronts:
    """Fronts of all factors of one pattern, in unknowns by their rank in the order of elimination.

    Parameters
    ----------
    tree : elimination tree of the nodes
    width : number of unknowns of every node, nodes in order of elimination, shape (n,)

    Attributes
    ----------
    first : rank of the first unknown that a front eliminates, shape (fronts,)
    owned : how many it eliminates, shape (fronts,)
    edges : ranks of the unknowns that each front touches and leaves to its parent, ascending
    edge, edge_start : the same in one row for compiled functions, front k at edge_start[k] : edge_start[k + 1]
    size : how many numbers a whole factor has
    """

    def __init__(self, tree: Tree, width: Index) -> None:
        """Lay out sizes, boundaries and storage."""
        # rank of the first unknown of every node, and behind all
        node_start = np.concatenate([[0], np.cumsum(width)])
        end = node_start[np.cumsum([len(f) for f in tree.fronts])]
        self.first = np.concatenate([[0], end[:-1]])
        self.owned = end - self.first
        self.edges = [ragged_ranges(node_start[b], width[b])[0] for b in tree.boundary]
        edge_size = np.array([len(e) for e in self.edges])
        self.edge_start = np.concatenate([[0], np.cumsum(edge_size)])
        self.edge = np.concatenate(self.edges).astype(np.int64)
        stored = self.owned * (self.owned + edge_size)  # f11 and f21
        self._start = np.cumsum(stored) - stored
        self.size = int(stored.sum())
        self._children = tree.children
        # where a child's boundary lies in its parent's front
        self._in_parent = {k: self.place(int(p), self.edges[k]) for k, p in enumerate(tree.parent) if p >= 0}

    def place(self, front: int, rank: Index) -> Index:
        """Place of unknowns in a front: its own ones first, then its boundary.

        Parameters
        ----------
        front : number of the front
        rank : places of unknowns in the order of elimination, all of them in the front, shape (k,)
        """
        first, owned = self.first[front], self.owned[front]
        return np.where(rank < first + owned, rank - first, owned + np.searchsorted(self.edges[front], rank))

    def eliminating(self, rank: Index) -> Index:
        """Number of the front that eliminates each of some unknowns, given by rank, shape (k,)."""
        return np.searchsorted(self.first, rank, side="right") - 1

    def parts(self, store: Array, front: int) -> tuple[Array, Array]:
        """Own block (n, n) and the one below it (m, n) of one front of a factor.

        Both are views: what is written to them is written to ``store``, the whole factor, shape (size,).
        """
        n, m, at = int(self.owned[front]), len(self.edges[front]), int(self._start[front])
        own, below = store[at : at + n * n], store[at + n * n : at + n * (n + m)]
        return own.reshape((n, n), order="F"), below.reshape((m, n), order="F")

    def eliminate(
        self, store: Array, assembled: Callable[[int], Front], pivoted: Callable[[int, Front], Front]
    ) -> None:
        """Factor a matrix front by front, children before parents, into ``store``, shape (size,).

        A front's update is the Schur complement f22 - f21 f11^-1 f21^T. It is added to the front of its parent.

        Parameters
        ----------
        store : written, the factors of all fronts in a row, laid out as :meth:`parts` reads them
        assembled : makes, from the number of a front, its entries of the matrix; its children's updates are added
        pivoted : makes, from number and assembled front, factor of the own block, what is kept below it, and the update
        """
        from limitmason.multifrontal.kernels import extend_add  # compiled: loaded where a matrix is factored

        updates: dict[int, Array] = {}
        for k, children in enumerate(self._children):
            front = assembled(k)
            for child in children:
                extend_add(*front, updates.pop(child), self._in_parent[child])
            own, below = self.parts(store, k)
            own[:], lower, left = pivoted(k, front)
            if len(below):
                below[:], updates[k] = lower, left

    def substitute(self, store: Array, x: Array) -> None:
        """Solve L L^T x = b by Cholesky factors; each row of ``x`` is a b and becomes its solution.

        Parameters
        ----------
        store : factor of :meth:`eliminate`, shape (size,)
        x : right-hand sides, unknowns in order of elimination, shape (right-hand sides, n)
        """
        from limitmason.multifrontal.kernels import substitute

        substitute(x, self.first, self.owned, self.edge_start, self.edge, self._start, store)


def below_cholesky(lower: Array, front: Front) -> Front:
    """A front by the Cholesky factor L of its own block: L, f21 L^-T and f22 - (f21 L^-T) (f21 L^-T)^T.

    Parameters
    ----------
    lower : L, f11 = L L^T, shape (n, n)
    front : overwritten by the answer where it has a boundary
    """
    _, f21, f22 = front
    if len(f21):
        f21 = dtrsm(1.0, lower, f21, side=1, lower=1, trans_a=1, overwrite_b=1)
        f22 = dsyrk(-1.0, f21, beta=1.0, c=f22, lower=1, overwrite_c=1)
    return lower, f21, f22
