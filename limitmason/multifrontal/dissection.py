"""Nested dissection of a graph with places: an elimination order that keeps a factor sparse.

A separator is a set of nodes without which the rest falls apart into pieces that do not touch. Pieces are eliminated
first, each on its own, separators after what they separate. Source: George (1973), Nested dissection of a regular
finite element mesh.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Flags, Index

_SPLIT = 0.25  # smallest part of the nodes on one side of a cut
_LEVEL = 1e-7  # of the extent: nodes this near to each other lie in one layer


class Tree(NamedTuple):
    """Elimination tree: fronts in the order of elimination, children before parents.

    A front is a set of nodes eliminated together; ``boundary`` holds the nodes that it still touches when its turn
    comes, as positions in the elimination order, ascending.
    """

    fronts: list[Index]  # node numbers
    boundary: list[Index]
    parent: Index  # front number, -1 for a root
    children: list[list[int]]


def block_graph(node: Index, point: Index) -> sparse.csr_array:
    """Graph of the nodes that share a contact point or an element, shape (n, n), from incidences (node, point)."""
    n, m = int(node.max()) + 1, int(point.max()) + 1
    touch = sparse.csr_array((np.ones(len(node)), (node, point)), shape=(n, m))
    graph = sparse.csr_array(touch @ touch.T)
    graph.setdiag(0)
    graph.eliminate_zeros()
    graph.sort_indices()
    return graph


def dissect(graph: sparse.csr_array, position: Array, leaf: int) -> list[Index]:
    """Fronts, children first, by cuts across the axis along which the separator is smallest.

    A cut runs behind a layer of nodes of equal coordinate. Of those that leave at least a quarter on either side the
    one with the fewest nodes that touch the other side is taken, so that a wall is cut across, never along it.

    Parameters
    ----------
    graph : symmetric adjacency, shape (n, n)
    position : of every node [m], shape (n, 3)
    leaf : nodes up to which a piece is left whole
    """
    start, neighbour = graph.indptr, graph.indices
    local = np.full(graph.shape[0], -1, dtype=np.intp)
    fronts, pieces = [], [np.arange(graph.shape[0])]
    while pieces:
        piece = pieces.pop()
        local[piece] = np.arange(len(piece))
        entries, owner = ragged_ranges(start[piece], start[piece + 1] - start[piece])
        other = local[neighbour[entries]]
        local[piece] = -1
        inside = other >= 0
        cut = _best_cut(position[piece], owner[inside], other[inside]) if len(piece) > leaf else None
        if cut is None:
            fronts.append(piece)
            continue
        near, shared = cut
        fronts += [piece[shared]] if shared.any() else []
        pieces += [side for side in (piece[near & ~shared], piece[~near]) if len(side)]
    return fronts[::-1]


def _best_cut(position: Array, owner: Index, other: Index) -> tuple[Flags, Flags] | None:
    """Nodes before the best cut, and those of them that touch a node behind, or None where all lie at one place.

    Parameters
    ----------
    owner, other : both ends of every edge
    position : of the nodes [m], shape (n, d)
    """
    n, best, chosen = len(position), np.inf, None
    for x in position.T:
        order = np.argsort(x, kind="stable")
        layer = np.empty(n, dtype=np.intp)
        # a layer ends where the next node along the axis is farther than a part of the whole extent
        steps = np.diff(x[order])
        layer[order] = np.concatenate([[0], np.cumsum(steps > _LEVEL * steps.sum())])
        layers = int(layer[order[-1]]) + 1
        if layers < 2:
            continue
        # last layer that a node is joined to
        farthest = layer.copy()
        np.maximum.at(farthest, owner, layer[other])
        begun, ended = (np.bincount(of, minlength=layers) for of in (layer, farthest))
        shared = np.cumsum(begun - ended)[:-1]  # nodes that reach across the cut behind each layer
        before = np.cumsum(begun)[:-1] - shared
        uneven = np.abs(2.0 * before / np.maximum(n - shared, 1) - 1.0)
        # past the limit the evenest cut is the best
        cost = np.where(uneven <= 1.0 - 2.0 * _SPLIT, shared * (1.0 + uneven**2), 1e9 * (1.0 + uneven))
        cut = int(np.argmin(cost))
        if cost[cut] < best:
            best, chosen = float(cost[cut]), (layer <= cut, (layer <= cut) & (farthest > cut))
    return chosen


def elimination_tree(graph: sparse.csr_array, fronts: list[Index]) -> Tree:
    """Boundary and parent of every front, from the order of elimination.

    The boundary is what a front's own nodes and its children touch of nodes that are eliminated later. The parent is
    the front that eliminates the first of these.

    Parameters
    ----------
    graph, fronts : which nodes touch, (n, n), and the nodes that every front eliminates, in that order
    """
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
    return Tree(fronts, boundary, parent, children)


def ragged_ranges(first: Index, count: Index) -> tuple[Index, Index]:
    """All numbers first[i] .. first[i] + count[i] - 1 in a row, and the i each belongs to."""
    owner = np.repeat(np.arange(len(first)), count)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return first[owner] + offset, owner
