"""Nested dissection of a graph with places: an elimination order that keeps a factor sparse.

A separator is a set of nodes without which the rest falls apart into pieces that do not touch. Pieces are eliminated
first, each on its own, separators after what they separate. Source: George (1973), Nested dissection of a regular
finite element mesh.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Flags, Index

# smallest part of the nodes on one side of a cut: chosen, a tree of even halves is the shallowest
_SPLIT = 0.25
_LEVEL = 1e-7  # of the extent: nodes this near to each other lie in one layer


class Tree(NamedTuple):
    """Elimination tree: fronts in the order of elimination, children before parents.

    Parameters
    ----------
    fronts : node numbers that every front eliminates together
    boundary : nodes that every front still touches when its turn comes, as places in the elimination order, ascending
    parent : number of the front that takes the update of every front, -1 for a root, shape (fronts,)
    children : numbers of the fronts whose parent each front is
    """

    fronts: list[Index]
    boundary: list[Index]
    parent: Index
    children: list[list[int]]


def block_graph(node: Index, point: Index) -> sparse.csr_array:
    """Graph of the nodes that share a contact point or an element, shape (n, n).

    Parameters
    ----------
    node : number of a node that each incidence joins to a point, shape (incidences,)
    point : number of that point or element, shape (incidences,)
    """
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

    Returns
    -------
    list
        Node numbers of every front; together they hold each node once.
    """
    # ``local`` numbers the nodes of the piece at hand, -1 for all others
    start, neighbour = graph.indptr, graph.indices
    local = np.full(graph.shape[0], -1, dtype=np.intp)
    fronts, pieces = [], [np.arange(graph.shape[0])]
    while pieces:
        piece = pieces.pop()
        # edges of the graph within the piece, from node ``owner`` to node ``other``
        local[piece] = np.arange(len(piece))
        entries, owner = ragged_ranges(start[piece], start[piece + 1] - start[piece])
        other = local[neighbour[entries]]
        local[piece] = -1
        inside = other >= 0
        cut = _best_cut(position[piece], owner[inside], other[inside]) if len(piece) > leaf else None
        if cut is None:
            fronts.append(piece)
            continue
        # separators are noted before what they separate: the list is turned round at the end
        near, shared = cut
        fronts += [piece[shared]] if shared.any() else []
        pieces += [side for side in (piece[near & ~shared], piece[~near]) if len(side)]
    return fronts[::-1]


def _best_cut(position: Array, owner: Index, other: Index) -> tuple[Flags, Flags] | None:
    """Nodes before the best cut, and those of them that touch a node behind, or None where all lie at one place.

    Both answers have shape (n,). The nodes that touch one behind are the separator.

    Parameters
    ----------
    position : of the nodes [m], shape (n, 3)
    owner : node at one end of every edge, in either sense, shape (edges,)
    other : node at its other end, shape (edges,)
    """
    n, best, chosen = len(position), np.inf, None
    for x in position.T:  # along every axis
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
        # per layer: nodes that lie in it, and nodes that reach no farther than it
        begun, ended = (np.bincount(of, minlength=layers) for of in (layer, farthest))
        shared = np.cumsum(begun - ended)[:-1]  # nodes that reach across the cut behind each layer
        before = np.cumsum(begun)[:-1] - shared
        uneven = np.abs(2.0 * before / np.maximum(n - shared, 1) - 1.0)
        # a cut costs its separator, up to a quarter more where it is uneven; past the limit more than any separator
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
    graph : which nodes touch, symmetric, shape (n, n)
    fronts : numbers of the nodes that every front eliminates, in the order of elimination
    """
    start, neighbour = graph.indptr, graph.indices
    order = np.concatenate(fronts)
    place = np.empty(len(order), np.intp)  # place of every node in the order of elimination
    place[order] = np.arange(len(order))
    count = np.array([len(f) for f in fronts])
    front_of = np.repeat(np.arange(len(fronts)), count)  # front that eliminates the node at every place
    last = np.cumsum(count)  # first place behind every front
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
    """All numbers first[i] .. first[i] + count[i] - 1 in a row, and the i each belongs to.

    Example: first (5, 0) and count (2, 3) give (5, 6, 0, 1, 2) and (0, 0, 1, 1, 1).

    Parameters
    ----------
    first : first number of every range, shape (n,)
    count : how many numbers it has, shape (n,)
    """
    owner = np.repeat(np.arange(len(first)), count)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return first[owner] + offset, owner
