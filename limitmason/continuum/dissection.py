"""Dissection of a mesh: halves first, the nodes that they share last, and so on down to a few bricks.

A cut follows the planes between bricks; of those that leave at least a quarter on either side the one with the fewest
nodes is taken, so that a wall is cut across and never along its thickness. Source: George (1973), Nested dissection of
a regular finite element mesh.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_LEAF = 12  # bricks that are left whole: fewer cost calls, more cost fill
_SPLIT = 0.25  # smallest part of the bricks on one side of a cut
_LEVEL = 1e-7  # of the extent: middles of bricks this near to each other lie in one layer


class Part(NamedTuple):
    """A part of the mesh: nodes to eliminate with it, its halves' numbers, and its bricks where it is left whole."""

    nodes: Index
    halves: tuple[int, ...]
    bricks: Index


def dissect(connectivity: Index, nodes: Array) -> list[Part]:
    """Parts of a mesh, halves before the part that they make up; every node that a brick has belongs to one part.

    Parameters
    ----------
    connectivity : nodes of every brick, shape (m, 20)
    nodes : [m], shape (n, 3)
    """
    middle = nodes[connectivity].mean(axis=1)
    taken = np.zeros(len(nodes), dtype=bool)
    own: list[Index] = []
    whole: list[Index] = []
    halves: list[list[int]] = []
    todo = [(np.arange(len(connectivity)), -1)]
    while todo:
        bricks, parent = todo.pop()
        number = len(own)
        first = _first_half(connectivity[bricks], middle[bricks], taken) if len(bricks) > _LEAF else None
        if first is None:
            found, left = np.unique(connectivity[bricks]), bricks
        else:
            one, other = bricks[first], bricks[~first]
            found, left = np.intersect1d(connectivity[one], connectivity[other]), bricks[:0]
            todo += [(one, number), (other, number)]
        found = found[~taken[found]]
        taken[found] = True
        own.append(_in_a_row(found, nodes))
        whole.append(left)
        halves.append([])
        if parent >= 0:
            halves[parent].append(number)
    last = len(own) - 1  # parts were found from the whole down; they are eliminated from the bottom up
    return [Part(own[i], tuple(last - j for j in halves[i]), whole[i]) for i in range(last, -1, -1)]


def _first_half(connectivity: Index, middle: Array, taken: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Bricks on one side of the best cut, shape (m,); None where all lie at one place."""
    used, local = np.unique(connectivity, return_inverse=True)
    local = local.ravel()
    counts = ~taken[used]
    m, best, chosen = len(middle), np.inf, None
    for axis in range(3):
        order = np.argsort(middle[:, axis], kind="stable")
        x = middle[order, axis]
        layer = np.empty(m, dtype=np.intp)
        layer[order] = np.concatenate([[0], np.cumsum(np.diff(x) > _LEVEL * (x[-1] - x[0]))])
        layers = int(layer[order[-1]]) + 1
        if layers < 2:
            continue
        of_node = np.repeat(layer, connectivity.shape[1])
        lowest, highest = np.full(len(used), layers), np.zeros(len(used), dtype=np.intp)
        np.minimum.at(lowest, local, of_node)
        np.maximum.at(highest, local, of_node)
        begun, ended = (np.bincount(k[counts], minlength=layers) for k in (lowest, highest))
        shared = np.cumsum(begun - ended)[:-1]  # nodes with bricks on both sides of the cut behind each layer
        uneven = np.abs(2 * np.cumsum(np.bincount(layer, minlength=layers))[:-1] / m - 1.0)
        # past the limit the evenest cut is the best
        cost = np.where(uneven <= 1.0 - 2.0 * _SPLIT, shared * (1.0 + uneven**2), 1e9 * (1.0 + uneven))
        cut = int(np.argmin(cost))
        if cost[cut] < best:
            best, chosen = float(cost[cut]), layer <= cut
    return chosen


def _in_a_row(found: Index, nodes: Array) -> Index:
    """Nodes of a part along its longest extent, so that a neighbour meets runs of them, not single ones."""
    if not len(found):
        return found
    x = nodes[found]
    extent = np.ptp(x, axis=0)
    level = np.round((x - x.min(axis=0)) / max(float(extent.max()), 1e-300), 7)
    return found[np.lexsort([level[:, i] for i in np.argsort(extent)])]
