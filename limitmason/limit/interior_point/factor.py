"""Block multifrontal Cholesky factor of M = sum over points (A_p C_p)(A_p C_p)^T.

The symbolic work depends on the pattern of A alone and is done once; every factorisation then assembles dense fronts
from the points and hands each front's Schur complement to its parent. Dense work goes to LAPACK, the rest to
``kernels``. Source: Duff and Reid (1983), The multifrontal solution of indefinite sparse symmetric linear equations.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.linalg.lapack import dpotrf

from limitmason.arrays import Array, Index
from limitmason.limit.interior_point.kernels import assemble_front
from limitmason.multifrontal.dissection import block_graph, dissect, elimination_tree, ragged_ranges
from limitmason.multifrontal.fronts import Front, Fronts, below_cholesky

FRONT_UNKNOWNS = 60
"""Unknowns up to which a piece of the structure is one front; smaller fronts cost calls, larger ones fill-in."""

FEWEST_BLOCKS = 4
"""Blocks of such a piece at least: chosen."""

FIRST_TRY, LAST_TRY, GROWTH = 1e-12, 1e6, 100.0
"""Relative increase of an indefinite front's diagonal at first, at last, and from one try to the next: chosen.

The first is some rounding of a sum; beyond the last only numbers that are not finite are left as a reason.
"""


class BlockCholesky:
    """Factor of M = sum_p (A_p C_p)(A_p C_p)^T; A_p are c neighbouring columns of A.

    Parameters
    ----------
    matrix : A, shape (r, c m)
    components : c, columns per point
    row_block : block of every row, ascending, shape (r,); blocks may have different numbers of rows
    position : place of every block [m], indexed by ``row_block``, shape (n_blocks, 3): the order follows it

    Attributes
    ----------
    fronts : dense blocks of the factor with the unknowns of each, ``_store`` their numbers
    shifts : fronts of the last factorisation that needed a larger diagonal
    _order, _rank : rows of A in order of elimination, and the rank of every row in it, shape (r,)
    _row_start : gathered rows _row_start[p] : _row_start[p + 1] are those of point p, shape (m + 1,)
    _coefficient : entries of A in the gathered rows, shape (rows gathered, c)
    _place : place of every gathered row in the front of its point
    _front_points : points that every front assembles

    Notes
    -----
    Memory: ``fronts.size`` numbers for the factor and one front per level of the tree. A matrix that is singular to
    rounding gets a small shift on the failing front, which the caller's iterative refinement must correct.
    """

    def __init__(self, matrix: sparse.csc_array, components: int, row_block: ArrayLike, position: Array) -> None:
        """Order the unknowns and lay out fronts and rows; nothing is factorised yet.

        Parameters
        ----------
        matrix : G, equilibrium in scaled form, shape (r, c m)
        components : c, force components a point, 2 or 3
        row_block : block of every row, shape (r,)
        position : centroids of all blocks [m], by which nested dissection cuts the graph, shape (n_blocks, 3)
        """
        matrix = sparse.csc_array(matrix)
        matrix.sum_duplicates()  # sorts every column by rows as well, which the runs of one block below rest on
        rows, columns = matrix.shape
        # nodes of the graph are the blocks that have rows; of each its number of rows, and its first row
        blocks, node, node_rows = np.unique(row_block, return_inverse=True, return_counts=True)
        node_start = np.concatenate([[0], np.cumsum(node_rows)])
        self.rows, self.components, self.points = rows, components, columns // components
        self.shifts = 0

        # incidences (block, point): the entries of a column come in runs of one block
        column = np.repeat(np.arange(columns), np.diff(matrix.indptr))
        entry_point, entry_node = column // components, node[matrix.indices]
        first_of_run = np.ones(len(column), dtype=bool)
        first_of_run[1:] = (np.diff(entry_point) != 0) | (np.diff(entry_node) != 0)
        run_point, run_node = entry_point[first_of_run], entry_node[first_of_run]
        graph = block_graph(run_node, run_point)
        leaf = max(FEWEST_BLOCKS, int(FRONT_UNKNOWNS * len(blocks) / rows))  # blocks of a piece
        pieces = dissect(graph, np.asarray(position, dtype=float)[blocks], leaf)
        tree, order = elimination_tree(graph, pieces), np.concatenate(pieces)
        # rows in order of elimination, and the rank of every row in it
        self._order, _ = ragged_ranges(node_start[order], node_rows[order])
        self._rank = np.empty(rows, np.int64)
        self._rank[self._order] = np.arange(rows)
        self.fronts = Fronts(tree, node_rows[order])
        self._store = np.empty(self.fronts.size)

        # the rows of every point are gathered once, in order of elimination
        node_rank = np.empty(len(blocks), np.intp)
        node_rank[order] = np.arange(len(blocks))
        # one number for a point and the rank of a node on it: sorted, they go point by point in order of elimination
        incidence, run_incidence = np.unique(run_point * len(blocks) + node_rank[run_node], return_inverse=True)
        point, node_there = incidence // len(blocks), order[incidence % len(blocks)]
        start = np.concatenate([[0], np.cumsum(node_rows[node_there])])
        row, owner = ragged_ranges(node_start[node_there], node_rows[node_there])
        self._row_start = start[np.searchsorted(point, np.arange(self.points + 1))]
        # every entry of G at its gathered row, in the column of its force component
        self._coefficient = np.zeros((len(row), components))
        entry = start[run_incidence[np.cumsum(first_of_run) - 1]] + matrix.indices - node_start[entry_node]
        self._coefficient[entry, column % components] = matrix.data
        self._place_points(self._rank[row], point[owner])

    def _place_points(self, rank: Index, point: Index) -> None:
        """Give every point to the front that eliminates its first unknown, with places.

        A place is that of ``Fronts.place``: own unknowns of the front first, then its boundary.

        Parameters
        ----------
        rank : of the unknown of every gathered row, in order of elimination
        point : to which every such row belongs
        """
        fronts = self.fronts
        loaded = np.flatnonzero(np.diff(self._row_start))
        owner = np.zeros(self.points, dtype=np.intp)
        owner[loaded] = fronts.eliminating(rank[self._row_start[loaded]])
        ranked = loaded[np.argsort(owner[loaded], kind="stable")]
        self._front_points = np.split(ranked, np.searchsorted(owner[ranked], np.arange(1, len(fronts.owned))))
        # one search for all: boundaries of all fronts in a row, told apart by a multiple of the number of rows
        front, step = owner[point], self.rows + 1
        keys = fronts.edge + np.repeat(np.arange(len(fronts.owned)), np.diff(fronts.edge_start)) * step
        outside = rank >= (fronts.first + fronts.owned)[front]
        self._place = rank - fronts.first[front]
        f = front[outside]
        found = np.searchsorted(keys, rank[outside] + f * step)
        self._place[outside] = found - fronts.edge_start[f] + fronts.owned[f]

    def factorise(self, root: Array, *, shift: float = 0.0) -> None:
        """Factorise M = sum_p (A_p C_p)(A_p C_p)^T, front by front into ``_store``.

        Parameters
        ----------
        root : C_p of every point, shape (m, c, c)
        shift : added to the diagonal of M, in the unit of its entries

        Raises
        ------
        FloatingPointError
            When a front stays indefinite however far it is shifted, as with numbers that are not finite.
        """
        self.shifts = 0

        def assembled(k: int) -> Front:
            """Front k from its own points: lower triangle of owned, mixed, passed unknowns."""
            # n unknowns are eliminated here, m are passed on to the parent
            n, m, points = int(self.fronts.owned[k]), len(self.fronts.edges[k]), self._front_points[k]
            f11, f21, f22 = np.zeros((n, n), order="F"), np.zeros((m, n), order="F"), np.zeros((m, m), order="F")
            if len(points):
                assemble_front(f11, f21, f22, points, self._row_start, self._place, self._coefficient, root)
            return f11, f21, f22

        def pivoted(_: int, front: Front) -> Front:
            """The front with its own unknowns eliminated."""
            return below_cholesky(self._dense_cholesky(front[0], shift), front)

        self.fronts.eliminate(self._store, assembled, pivoted)

    def _dense_cholesky(self, matrix: Array, shift: float) -> Array:
        """Lower Cholesky factor of ``matrix`` (n, n) with ``shift`` on its diagonal.

        A front that rounding has made indefinite is tried again with a larger diagonal; ``shifts`` counts how often.
        """
        diagonal = matrix.ravel("K")[:: len(matrix) + 1]  # a view: what is added to it is added to the matrix
        diagonal += shift
        lower, failed = dpotrf(matrix, lower=1, clean=0, overwrite_a=0)
        more = FIRST_TRY / GROWTH
        while failed:
            # in proportion to each unknown's own stiffness: these differ by twenty orders of magnitude near the end
            more *= GROWTH
            self.shifts += 1
            if more > LAST_TRY:
                raise FloatingPointError("a front of the Cholesky factorisation is not positive definite")
            diagonal *= 1.0 + more
            lower, failed = dpotrf(matrix, lower=1, clean=0, overwrite_a=0)
        return lower

    def solve(self, right: Array) -> Array:
        """Solution of M x = right.

        ``right`` has shape (r,), or (k, r) for k right-hand sides at once.
        """
        x = np.ascontiguousarray(np.atleast_2d(right)[:, self._order])
        self.fronts.substitute(self._store, x)
        x = x[:, self._rank]
        return x if right.ndim == 2 else x[0]
