"""Nested dissection of the block graph: an elimination order that keeps a Cholesky factor sparse.

A separator is a set of blocks without which the rest falls apart into pieces that do not touch. Pieces are eliminated
first, each on its own, separators after what they separate. Source: George (1973), Nested dissection of a regular
finite element mesh.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from limitmason.limit.interior_point.kernels import dissect_by_levels

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class Tree(NamedTuple):
    """Elimination tree: fronts in the order of elimination, children before parents.

    A front is a set of nodes eliminated together; ``boundary`` holds the nodes that it still touches when its turn
    comes, as positions in the elimination order, ascending.
    """

    fronts: list[Index]  # node numbers
    boundary: list[Index]
    parent: Index  # front number, -1 for a root
    children: list[list[int]]
    operations: float  # multiplications of the factorisation


def block_graph(node: Index, point: Index) -> sparse.csr_array:
    """Graph of the nodes that share a contact point, shape (n, n), from incidences (node, point)."""
    n, m = int(node.max()) + 1, int(point.max()) + 1
    touch = sparse.csr_array((np.ones(len(node)), (node, point)), shape=(n, m))
    graph = sparse.csr_array(touch @ touch.T)
    graph.setdiag(0)
    graph.eliminate_zeros()
    graph.sort_indices()
    return graph


def nested_dissection(graph: sparse.csr_array, size: Index, position: Array | None = None, *, leaf: int = 8) -> Tree:
    """Elimination tree of a graph, the cheaper one of two dissections.

    Parameters
    ----------
    graph : symmetric adjacency, shape (n, n)
    size : unknowns of every node, shape (n,)
    position : place of every node [m], shape (n, 3); without it only the levels of the graph are used
    leaf : nodes up to which a piece is left whole

    Notes
    -----
    Levels suit walls that turn corners or have holes; bisection by coordinates suits plain walls and blocks that touch
    very many others, such as a beam along the top.
    """
    trees = [elimination_tree(graph, dissect_levels(graph, leaf), size)]
    if position is not None:
        trees.append(elimination_tree(graph, dissect_coordinates(graph, position, leaf), size))
    return min(trees, key=lambda t: t.operations)


def dissect_levels(graph: sparse.csr_array, leaf: int) -> list[Index]:
    """Fronts, children first, by cutting at the narrowest level of a breadth-first search."""
    n = graph.shape[0]
    order, start = np.empty(n, np.int64), np.empty(n + 1, np.int64)
    part = np.full(n, -1, np.int64)
    count = dissect_by_levels(graph.indptr.astype(np.int64), graph.indices.astype(np.int64), leaf, order, part, start)
    return [order[start[k] : start[k + 1]] for k in range(count)][::-1]


def dissect_coordinates(graph: sparse.csr_array, position: Array, leaf: int) -> list[Index]:
    """Fronts, children first, by halving along the longest extent; left nodes that touch the right separate."""
    start, neighbour = graph.indptr, graph.indices
    right_side = np.zeros(graph.shape[0], dtype=bool)
    fronts, pieces = [], [np.arange(graph.shape[0])]
    while pieces:
        piece = pieces.pop()
        if len(piece) <= leaf:
            fronts.append(piece)
            continue
        axis = np.ptp(position[piece], axis=0).argmax()
        ranked = piece[np.argsort(position[piece, axis], kind="stable")]
        left, right = np.split(ranked, [len(ranked) // 2])
        right_side[right] = True
        entries, owner = ragged_ranges(start[left], start[left + 1] - start[left])
        touches = np.bincount(owner, right_side[neighbour[entries]], len(left)) > 0
        right_side[right] = False
        if touches.all():
            fronts.append(piece)
            continue
        if touches.any():
            fronts.append(left[touches])
        pieces += [left[~touches], right]
    return fronts[::-1]


def elimination_tree(graph: sparse.csr_array, fronts: list[Index], size: Index) -> Tree:
    """Boundary, parent and cost of every front, from the order of elimination."""
    start, neighbour = graph.indptr, graph.indices
    order = np.concatenate(fronts)
    place = np.empty(len(order), np.intp)
    place[order] = np.arange(len(order))
    count = np.array([len(f) for f in fronts])
    front_of = np.repeat(np.arange(len(fronts)), count)
    last = np.cumsum(count)
    boundary: list[Index] = []
    parent = np.full(len(fronts), -1, dtype=np.intp)
    children: list[list[int]] = [[] for _ in fronts]
    for k, nodes in enumerate(fronts):
        reach = [place[neighbour[start[u] : start[u + 1]]] for u in nodes] + [boundary[j] for j in children[k]]
        touched = np.unique(np.concatenate(reach))
        boundary.append(touched[touched >= last[k]])
        if len(boundary[k]):
            parent[k] = front_of[boundary[k][0]]
            children[parent[k]].append(k)
    n = np.array([size[f].sum() for f in fronts], dtype=float)
    m = np.array([size[order[b]].sum() for b in boundary], dtype=float)
    return Tree(fronts, boundary, parent, children, float((n**3 / 3.0 + n**2 * m + n * m**2).sum()))


def ragged_ranges(first: Index, count: Index) -> tuple[Index, Index]:
    """All numbers first[i] .. first[i] + count[i] - 1 in a row, and the i each belongs to."""
    owner = np.repeat(np.arange(len(first)), count)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return first[owner] + offset, owner
