"""Factors L U of sparse matrices with unsymmetric values, all of one pattern: order and fronts are found once.

Rows are exchanged within a front only, so that the pattern stays; whether a solution is right its residual tells.
Source: Duff and Reid (1984), The multifrontal solution of unsymmetric sets of linear equations.
"""

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Index
from limitmason.multifrontal.dissection import dissect, elimination_tree
from limitmason.multifrontal.fronts import Fronts

_LEAF = 5  # nodes up to which a piece is eliminated at once: chosen, not derived


class UnsymmetricFronts:
    """Order and fronts of all matrices of one pattern with a border.

    Parameters
    ----------
    pattern : shape (n + 1, n + 1), as symmetric as its values are not; its last row and column are the border,
        eliminated last
    node : number of the node (block) that every unknown but the border is of, ascending, shape (n,)
    position : of every node [m], shape (nodes, 3)

    Attributes
    ----------
    order : number of the unknown at every rank in the order of elimination, shape (n + 1,)
    fronts : sizes and places of the fronts
    edge_size : how many unknowns each front touches and leaves to its parent, shape (fronts,)
    """

    def __init__(self, pattern: sparse.csc_matrix, node: Index, position: Array) -> None:
        """Find the order, and where every entry and every update goes."""
        nodes = len(position)
        self._pattern = pattern.indptr, pattern.indices
        node = np.append(node, nodes)  # the border is a node of its own
        column = np.repeat(np.arange(pattern.shape[1]), np.diff(pattern.indptr))  # of every entry
        # graph of the nodes that share an entry
        ones = np.ones(pattern.nnz)
        graph = sparse.coo_array((ones, (node[pattern.indices], node[column])), shape=(nodes + 1,) * 2).tocsr()
        graph.setdiag(0)
        graph.eliminate_zeros()
        graph.sort_indices()
        inner = graph[:nodes, :nodes]
        order = dissect(inner, position, _LEAF)
        order[-1] = np.append(order[-1], nodes)  # the last front eliminates the border
        tree = elimination_tree(graph, order)
        sequence, width = np.concatenate(order), np.bincount(node)
        # unknowns sorted by the turn of their node; stable, so that those of a node keep their order
        by_node = np.argsort(np.argsort(sequence)[node], kind="stable")
        self.order: Index = by_node
        rank = np.empty(len(node), np.intp)  # of every unknown
        rank[by_node] = np.arange(len(node))
        self.fronts = fronts = Fronts(tree, width[sequence])
        self.edge_size = edge = np.diff(fronts.edge_start)
        size = fronts.owned + edge
        stored = fronts.owned * (size + edge)  # first columns of the front, and the rest of its first rows
        # where updates and factors of the fronts begin
        self._starts = _reused(edge, tree.parent), np.cumsum(stored) - stored
        self._stored = int(stored.sum())
        # what ``kernels.factor_unsymmetric`` calls entries: by front, number of the entry and its spot there
        # an entry belongs to the front that eliminates the first of its two unknowns
        row, across = rank[pattern.indices], rank[column]
        owner = fronts.eliminating(np.minimum(row, across))
        entry = np.argsort(owner, kind="stable")
        start = np.searchsorted(owner[entry], np.arange(len(order) + 1))
        spot = np.empty(pattern.nnz, np.intp)
        for k in range(len(order)):
            of = entry[start[k] : start[k + 1]]
            i, j, n = fronts.place(k, row[of]), fronts.place(k, across[of]), fronts.owned[k]
            # the first n columns one by one, then, by rows, what is beside them
            beside = n * size[k] + i * edge[k] + j - n
            spot[start[k] : start[k + 1]] = np.where(j < n, j * size[k] + i, beside)
        self._entries = start, entry, spot
        # where the update of every front goes in its parent; that of the root, empty, goes nowhere
        kept = [fronts.place(int(p), fronts.edges[k]) if p >= 0 else fronts.edges[k] for k, p in enumerate(tree.parent)]
        count = [len(c) for c in tree.children]
        child = np.concatenate([np.array(c, np.intp) for c in tree.children])
        self._children = np.append(0, np.cumsum(count)), child, fronts.edge_start, np.concatenate(kept)
        room = int((self._starts[0] + edge**2).max())
        self._work, self._updates = np.empty(int((size * edge).max())), np.empty(room)

    def factors(self, value: Array) -> tuple[Array, Index] | None:
        """Factors of a matrix and the exchanges of rows, or None where rows within a front give no pivot.

        The matrix may then be singular, or ask for exchanges between fronts.

        Parameters
        ----------
        value : entries of the matrix in the order of the pattern, shape (nnz,)

        Returns
        -------
        tuple
            Numbers of all factors in a row, and of every unknown the row of its front that it was exchanged with.
        """
        from limitmason.multifrontal.kernels import factor_unsymmetric  # compiled: loaded where a matrix is factored

        store, pivot = np.empty(self._stored), np.empty(len(self.order), np.intp)
        found = factor_unsymmetric(
            value, self._entries, self.fronts.owned, self.fronts.edge_start, self._children, self._starts,
            (self._work, self._updates, store), pivot,
        )
        return (store, pivot) if found else None

    def solve(self, store: Array, pivot: Index, right: Array) -> Array:
        """The solution for a right side, both of shape (n + 1,).

        ``store`` and ``pivot`` are what :meth:`factors` returned.
        """
        from limitmason.multifrontal.kernels import substitute_unsymmetric

        x, f = right[self.order], self.fronts
        substitute_unsymmetric(x, f.owned, f.edge_start, f.edge, self._starts[1], store, pivot)
        found = np.empty_like(x)
        found[self.order] = x
        return found

    def product(self, value: Array, x: Array) -> Array:
        """A matrix of the pattern by its entries, shape (nnz,), times a vector, shape (n + 1,)."""
        from limitmason.multifrontal.kernels import product

        out = np.zeros(len(x))
        product(*self._pattern, value, x, out)
        return out

    def sense(self, store: Array, pivot: Index) -> int:
        """Sign of the determinant: of the pivots, turned by every exchange of rows.

        Parameters
        ----------
        store, pivot : what :meth:`factors` returned
        """
        owned = self.fronts.owned
        within = np.arange(len(self.order)) - np.repeat(self.fronts.first, owned)
        size = np.repeat(owned + self.edge_size, owned)
        # a front keeps its own columns first, each of all its rows, ``size``: the diagonal is every size + 1
        diagonal = store[np.repeat(self._starts[1], owned) + within * (size + 1)]
        return int(np.sign(diagonal).prod()) * (-1) ** int((pivot != within).sum())


def _reused(edge: Index, parent: Index) -> Index:
    """Where the update of every front begins, in room that is used again once its parent has taken it.

    An update takes the first gap that is large enough.

    Parameters
    ----------
    edge : unknowns that every front touches; its update has edge^2 numbers, shape (fronts,)
    parent : number of the front that takes the update, -1 for none, shape (fronts,)
    """
    start, taken = np.zeros(len(edge), np.intp), list[tuple[int, int, int]]()  # begin, end, parent of what waits
    for k, size in enumerate(edge**2):
        taken = [t for t in taken if t[2] != k]
        at = 0
        for begin, end, _ in taken:
            if begin - at >= size:
                break
            at = end
        start[k] = at
        taken = sorted([*taken, (at, at + int(size), int(parent[k]))])
    return start
