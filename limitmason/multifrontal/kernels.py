"""Compiled parts of the multifrontal elimination, on plain arrays."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# a sum may be reordered so that it vectorises; not-a-number and infinity keep their meaning
FAST = {"reassoc", "contract", "arcp", "nsz"}

# such a function that another one calls is part of it (inline): else the process that compiles them adds in another
# order than those that load them, and a path takes other steps


@njit(cache=True)
def extend_add(f11: Array, f21: Array, f22: Array, update: Array, place: Index) -> None:
    """Add the lower half of a child's ``update`` to its parent's front, of blocks f11, f21 and f22.

    Parameters
    ----------
    f11, f21, f22 : the parent's front, added to; see ``fronts.Front``
    update : what is left of the child's boundary, shape (m, m)
    place : where each unknown of that boundary is in the parent's front, ascending, so that lower halves stay lower
    """
    owned, n = f11.shape[0], place.size
    for j in range(n):
        b = place[j]
        if b < owned:
            for i in range(j, n):
                a = place[i]
                if a < owned:
                    f11[a, b] += update[i, j]
                else:
                    f21[a - owned, b] += update[i, j]
        else:
            for i in range(j, n):
                f22[place[i] - owned, b - owned] += update[i, j]


@njit(cache=True)
def product(start: NDArray[np.int32], row: NDArray[np.int32], value: Array, x: Array, out: Array) -> None:
    """Add a matrix by compressed columns times a vector to ``out``, shape (n,).

    Parameters
    ----------
    start, row : where every column begins, (n + 1,), and the row of every entry, (nnz,)
    value, x : entries of the matrix, (nnz,), and the vector, (n,)
    """
    for j in range(len(x)):
        for k in range(start[j], start[j + 1]):
            out[row[k]] += value[k] * x[j]


@njit(cache=True, fastmath=FAST)
def substitute(
    x: Array, first: Index, owned: Index, edge_start: Index, edge: Index, store_start: Index, store: Array
) -> None:
    """Solve L L^T x = b by Cholesky factors; each row of ``x`` is a b and becomes its solution.

    Forwards L y = b goes through the fronts in order, backwards L^T x = y against it. Four columns at a time are as
    fast as BLAS here and wake no threads.

    Parameters
    ----------
    x : unknowns in order of elimination, shape (right-hand sides, n)
    first, owned : front k owns the unknowns first[k] : first[k] + owned[k], shape (fronts,)
    edge_start, edge : it touches the unknowns edge[edge_start[k] : edge_start[k + 1]]
    store_start : where front k begins in ``store``, shape (fronts,)
    store : its diagonal block, (n, n), then the block of its edge, (m, n), both by columns
    """
    fronts = owned.size
    widest = 0
    for k in range(fronts):
        widest = max(widest, edge_start[k + 1] - edge_start[k])
    work = np.empty(widest)
    # forwards: a front's own unknowns by its diagonal block, whose multiples are then taken off those it touches
    for k in range(fronts):
        n, m, e = owned[k], edge_start[k + 1] - edge_start[k], edge_start[k]
        top, low = store_start[k], store_start[k] + n * n  # where its diagonal block and the block of its edge begin
        for r in range(x.shape[0]):
            own = x[r, first[k] : first[k] + n]
            for j in range(n):
                column = store[top + j * n : top + (j + 1) * n]
                pivot = own[j] / column[j]
                own[j] = pivot
                for i in range(j + 1, n):
                    own[i] -= column[i] * pivot
            if m == 0:
                continue
            t = work[:m]
            t[:] = 0.0
            j = 0
            while j + 4 <= n:
                at = low + j * m
                c0, c1 = store[at : at + m], store[at + m : at + 2 * m]
                c2, c3 = store[at + 2 * m : at + 3 * m], store[at + 3 * m : at + 4 * m]
                x0, x1, x2, x3 = own[j], own[j + 1], own[j + 2], own[j + 3]
                for i in range(m):
                    t[i] += c0[i] * x0 + c1[i] * x1 + c2[i] * x2 + c3[i] * x3
                j += 4
            while j < n:
                c0, x0 = store[low + j * m : low + (j + 1) * m], own[j]
                for i in range(m):
                    t[i] += c0[i] * x0
                j += 1
            for i in range(m):
                x[r, edge[e + i]] -= t[i]
    # backwards: what the unknowns that it touches come to is taken off its own, then its diagonal block transposed
    for k in range(fronts - 1, -1, -1):
        n, m, e = owned[k], edge_start[k + 1] - edge_start[k], edge_start[k]
        top, low = store_start[k], store_start[k] + n * n
        for r in range(x.shape[0]):
            own, t = x[r, first[k] : first[k] + n], work[:m]
            for i in range(m):
                t[i] = x[r, edge[e + i]]
            j = 0
            while m > 0 and j + 4 <= n:
                at = low + j * m
                c0, c1 = store[at : at + m], store[at + m : at + 2 * m]
                c2, c3 = store[at + 2 * m : at + 3 * m], store[at + 3 * m : at + 4 * m]
                s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
                for i in range(m):
                    s0 += c0[i] * t[i]
                    s1 += c1[i] * t[i]
                    s2 += c2[i] * t[i]
                    s3 += c3[i] * t[i]
                own[j] -= s0
                own[j + 1] -= s1
                own[j + 2] -= s2
                own[j + 3] -= s3
                j += 4
            while m > 0 and j < n:
                c0, s0 = store[low + j * m : low + (j + 1) * m], 0.0
                for i in range(m):
                    s0 += c0[i] * t[i]
                own[j] -= s0
                j += 1
            for j in range(n - 1, -1, -1):
                column, total = store[top + j * n : top + (j + 1) * n], 0.0
                for i in range(j + 1, n):
                    total += column[i] * own[i]
                own[j] = (own[j] - total) / column[j]


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _less_columns(column: Array, columns: Array, s: int, many: int) -> None:
    """Subtract from a column of a front its multiples of those before it: a forward substitution, L y = column.

    Three columns are read together, the first two of which change the entries of the next ones.

    Parameters
    ----------
    column : column of a front, changed, shape (s,)
    columns : columns of L, each with a one on the diagonal that is not stored, by columns, shape (s * many or more,)
    s : unknowns of the front
    many : columns before this one
    """
    j = 0
    while j + 3 <= many:
        c0, c1 = columns[j * s : (j + 1) * s], columns[(j + 1) * s : (j + 2) * s]
        c2 = columns[(j + 2) * s : (j + 3) * s]
        x0 = column[j]
        x1 = column[j + 1] - x0 * c0[j + 1]
        x2 = column[j + 2] - x0 * c0[j + 2] - x1 * c1[j + 2]
        column[j + 1], column[j + 2] = x1, x2
        for i in range(j + 3, s):
            column[i] -= x0 * c0[i] + x1 * c1[i] + x2 * c2[i]
        j += 3
    while j < many:
        c0, x0 = columns[j * s : (j + 1) * s], column[j]
        for i in range(j + 1, s):
            column[i] -= x0 * c0[i]
        j += 1


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _less_above(columns: Array, beside: Array, n: int, m: int) -> None:
    """Subtract from the rows beside the columns of a front their multiples of the rows above: U, then the update.

    Row i becomes row i less the sum over j < min(i, n) of L[i, j] row j. The first n rows are then rows of U, the
    others what is added to the front of the parent.
    Two rows and three columns at a time: with more, the compiler asks whether they overlap and does not vectorise.

    Parameters
    ----------
    columns : first n columns of the front, factored, by columns, shape ((n + m) n,)
    beside : its other m columns, by rows, changed, shape ((n + m) m,)
    n, m : unknowns that the front eliminates, and those that it touches
    """
    s = n + m
    for i in range(0, s - 1, 2):
        most, row, after, j = min(i, n), beside[i * m : (i + 1) * m], beside[(i + 1) * m : (i + 2) * m], 0
        while j + 3 <= most:
            x0, x1, x2 = columns[j * s + i], columns[(j + 1) * s + i], columns[(j + 2) * s + i]
            y0, y1, y2 = columns[j * s + i + 1], columns[(j + 1) * s + i + 1], columns[(j + 2) * s + i + 1]
            u0, u1 = beside[j * m : (j + 1) * m], beside[(j + 1) * m : (j + 2) * m]
            u2 = beside[(j + 2) * m : (j + 3) * m]
            for b in range(m):
                row[b] -= x0 * u0[b] + x1 * u1[b] + x2 * u2[b]
                after[b] -= y0 * u0[b] + y1 * u1[b] + y2 * u2[b]
            j += 3
        _less(row, columns, beside, s, i, j, most)
        _less(after, columns, beside, s, i + 1, j, min(i + 1, n))
    if s % 2:
        _less(beside[(s - 1) * m : s * m], columns, beside, s, s - 1, 0, min(s - 1, n))


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def _less(row: Array, columns: Array, beside: Array, s: int, i: int, begin: int, end: int) -> None:
    """Subtract from row i of those beside the columns, of length s, L[i, j] times row j for begin <= j < end."""
    m = len(row)
    for j in range(begin, end):
        x, above = columns[j * s + i], beside[j * m : (j + 1) * m]
        for b in range(m):
            row[b] -= x * above[b]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def factor_unsymmetric(
    value: Array, entries: tuple[Index, Index, Index], owned: Index, edge_start: Index,
    children: tuple[Index, Index, Index, Index], starts: tuple[Index, Index], arrays: tuple[Array, Array, Array],
    pivot: Index,
) -> bool:
    """Write the factors L U of a matrix of unsymmetric values front by front; False where it is singular.

    Rows are exchanged within what a front eliminates. Of a front of s unknowns that eliminates n, ``store`` holds its
    first n columns, L (with ones on its diagonal) below U, by columns; then the rest of its first n rows, U, by rows.

    Parameters
    ----------
    value : entries of the matrix, shape (nnz,)
    entries : where the list of every front begins, (fronts + 1,); then, in these lists, number of the entry in
        ``value`` and its place in the front, (nnz,): below n s in the columns, from there on in the rows beside them
    owned : how many unknowns every front eliminates, shape (fronts,)
    edge_start : where the unknowns that it touches begin in one list of all fronts, shape (fronts + 1,)
    children : where the children of every front begin, (fronts + 1,); numbers of the children; where the places of each
        front's update begin, (fronts + 1,); places of these unknowns in the front of the parent
    starts : where the update of every front begins in ``updates``, and its factors in ``store``, shapes (fronts,)
    arrays : ``work`` for what is beside the columns of a front, ``updates``, and ``store``, which is the answer
    pivot : written: of every unknown, the row of its front that it was exchanged with, shape (n,)
    """
    entry_start, entry, spot = entries
    child_start, child, place_start, place = children
    update_start, store_start = starts
    work, updates, store = arrays
    first = 0  # number of unknowns that are eliminated so far
    for k in range(owned.size):
        n, m = owned[k], edge_start[k + 1] - edge_start[k]
        s = n + m
        columns, beside = store[store_start[k] : store_start[k] + n * s], work[: s * m]
        columns[:], beside[:] = 0.0, 0.0
        # the front: entries of the matrix, and what the fronts of its children leave
        for e in range(entry_start[k], entry_start[k + 1]):
            if spot[e] < n * s:
                columns[spot[e]] = value[entry[e]]
            else:
                beside[spot[e] - n * s] = value[entry[e]]
        for q in range(child_start[k], child_start[k + 1]):
            j = child[q]
            size, own = edge_start[j + 1] - edge_start[j], 0
            to = place[place_start[j] : place_start[j] + size]
            # places ascend: the first ``own`` are among the columns of the parent
            while own < size and to[own] < n:
                own += 1
            for a in range(size):
                at, update = to[a], updates[update_start[j] + a * size : update_start[j] + (a + 1) * size]
                for b in range(own):
                    columns[to[b] * s + at] += update[b]
                for b in range(own, size):
                    beside[at * m + to[b] - n] += update[b]
        for b in range(n):  # exchanges so far, the column less those before it, its pivot, and its exchange
            column = columns[b * s : (b + 1) * s]
            for j in range(b):
                p = pivot[first + j]
                column[j], column[p] = column[p], column[j]
            _less_columns(column, columns, s, b)
            p, most = b, abs(column[b])
            for i in range(b + 1, n):
                if abs(column[i]) > most:
                    p, most = i, abs(column[i])
            if not (0.0 < most < np.inf):
                return False
            pivot[first + b] = p
            if p != b:
                for j in range(b + 1):
                    columns[j * s + b], columns[j * s + p] = columns[j * s + p], columns[j * s + b]
                for j in range(m):
                    beside[b * m + j], beside[p * m + j] = beside[p * m + j], beside[b * m + j]
            inverse = 1.0 / column[b]
            for i in range(b + 1, s):
                column[i] *= inverse
        _less_above(columns, beside, n, m)
        at = store_start[k] + n * s
        store[at : at + n * m] = beside[: n * m]
        updates[update_start[k] : update_start[k] + m * m] = beside[n * m :]
        first += n
    return True


@njit(cache=True, fastmath=FAST, error_model="numpy")
def substitute_unsymmetric(
    x: Array, owned: Index, edge_start: Index, edge: Index, store_start: Index, store: Array, pivot: Index
) -> None:
    """Solve L U x = b with the factors of :func:`factor_unsymmetric`, fronts in order, then against it.

    Parameters
    ----------
    x : b, which becomes the solution, unknowns in order of elimination, shape (n,)
    owned, edge_start, pivot : as for :func:`factor_unsymmetric`
    edge : numbers in x of the unknowns that the fronts touch, in one list
    store_start, store : where the factors of every front begin, shape (fronts,), and all factors
    """
    first, work = 0, np.empty((owned + np.diff(edge_start)).max())
    # L y = b: exchanges of rows, own unknowns, then those that the front touches, from which its multiples are taken
    for k in range(owned.size):
        n, m, e = owned[k], edge_start[k + 1] - edge_start[k], edge_start[k]
        s, own = n + m, x[first : first + n]
        for j in range(n):
            p = pivot[first + j]
            own[j], own[p] = own[p], own[j]
        below = work[:s]
        below[:n], below[n:] = own, 0.0
        for j in range(n):
            column, y = store[store_start[k] + j * s : store_start[k] + (j + 1) * s], below[j]
            for i in range(j + 1, s):
                below[i] -= y * column[i]
        own[:] = below[:n]
        for i in range(m):
            x[edge[e + i]] += below[n + i]
        first += n
    # U x = y: what the unknowns that a front touches come to is taken off its own, then its columns from the last
    for k in range(owned.size - 1, -1, -1):
        n, m, e = owned[k], edge_start[k + 1] - edge_start[k], edge_start[k]
        first -= n
        s, own, beside, at = n + m, x[first : first + n], work[:m], store_start[k]
        for i in range(m):
            beside[i] = x[edge[e + i]]
        for i in range(n):
            row, y = store[at + n * s + i * m : at + n * s + (i + 1) * m], 0.0
            for j in range(m):
                y += row[j] * beside[j]
            own[i] -= y
        for j in range(n - 1, -1, -1):
            column = store[at + j * s : at + j * s + j + 1]
            own[j] /= column[j]
            y = own[j]
            for i in range(j):
                own[i] -= y * column[i]
