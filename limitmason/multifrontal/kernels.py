"""Compiled parts of the multifrontal elimination, on plain arrays."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# a sum may be reordered so that it vectorises; not-a-number and infinity keep their meaning
FAST = {"reassoc", "contract", "arcp", "nsz"}


@njit(cache=True)
def extend_add(f11: Array, f21: Array, f22: Array, update: Array, place: Index) -> None:
    """Add the lower half of a child's ``update`` to its parent's front, of blocks f11, f21 and f22.

    ``place`` ascends.
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


@njit(cache=True, fastmath=FAST)
def substitute(
    x: Array, first: Index, owned: Index, edge_start: Index, edge: Index, store_start: Index, store: Array
) -> None:
    """Solve L L^T x = x in place for the rows of ``x``, shape (right-hand sides, n); front k begins at store_start[k].

    Front k owns the unknowns first[k] : first[k] + owned[k] and touches edge[edge_start[k] : edge_start[k + 1]];
    ``store`` holds its diagonal block and below it the block of the edge, both by columns. Four columns at a time are
    as fast as BLAS here and wake no threads.
    """
    fronts = owned.size
    widest = 0
    for k in range(fronts):
        widest = max(widest, edge_start[k + 1] - edge_start[k])
    work = np.empty(widest)
    for k in range(fronts):
        n, m, e = owned[k], edge_start[k + 1] - edge_start[k], edge_start[k]
        top, low = store_start[k], store_start[k] + n * n
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
