"""Every compiled function of ``limit``: graph levels, dense fronts and Lorentz cones, on plain arrays.

All of them stay in this file: numba's disk cache does not notice an edit in an imported module. Cone kernels take m
points with c = 2 or 3 components each; a point x is inside its Lorentz cone when x_0 > |(x_1, ...)|. In the cone's
algebra x o s = (x . s, x_0 s_i + s_0 x_i).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# a sum may be reordered so that it vectorises; not-a-number and infinity keep their meaning
FAST = {"reassoc", "contract", "arcp", "nsz"}


# ---- graph -----------------------------------------------------------------------------------------------------------


@njit(cache=True)
def breadth_first(start: Index, neighbour: Index, part: Index, root: int, queue: Index, level: Index) -> int:
    """Levels of the nodes without a part that ``root`` reaches; their number, and ``queue`` holds them by level."""
    queue[0], level[root] = root, 0
    head, tail = 0, 1
    while head < tail:
        node, head = queue[head], head + 1
        for k in range(start[node], start[node + 1]):
            other = neighbour[k]
            if part[other] < 0 and level[other] < 0:
                level[other] = level[node] + 1
                queue[tail] = other
                tail += 1
    return tail


@njit(cache=True)
def narrow_level(queue: Index, level: Index, count: int) -> int:
    """Level that splits a piece best: few nodes, with at least two fifths of the rest on either side if possible."""
    best, best_score, first = -1, 1e300, 0
    while first < count:
        here, last = level[queue[first]], first
        while last < count and level[queue[last]] == here:
            last += 1
        left, right = first, count - last
        if left > 0 and right > 0:
            share = min(left, right) / (left + right)
            score = (last - first) * (1.0 + 10.0 * max(0.0, 0.4 - share))
            if share < 0.15:
                score += 1e6 * (0.2 - share)
            if score < best_score:
                best, best_score = here, score
        first = last
    return best


@njit(cache=True)
def dissect_by_levels(
    start: Index, neighbour: Index, leaf: int, order: Index, part: Index, part_start: Index
) -> int:
    """Cut a graph at narrow breadth-first levels until the pieces have at most ``leaf`` nodes; number of parts.

    ``order`` receives the nodes part by part, a separator before the pieces it separates; ``part`` the part of each
    node (-1 on entry); part k is order[part_start[k] : part_start[k + 1]].
    """
    n = part.size
    queue, level = np.empty(n, np.int64), np.full(n, -1, np.int64)
    parts, placed, part_start[0] = 0, 0, 0
    for seed in range(n):
        while part[seed] < 0:
            # start twice from the farthest node: long thin levels
            root = seed
            for _ in range(2):
                count = breadth_first(start, neighbour, part, root, queue, level)
                root = queue[count - 1]
                for k in range(count):
                    level[queue[k]] = -1
            count = breadth_first(start, neighbour, part, root, queue, level)
            cut = -1
            if count > leaf and level[queue[count - 1]] >= 2:
                cut = narrow_level(queue, level, count)
            for k in range(count):
                node = queue[k]
                # of the level, only nodes that touch the next one separate
                taken = cut < 0
                if level[node] == cut:
                    for e in range(start[node], start[node + 1]):
                        if part[neighbour[e]] < 0 and level[neighbour[e]] == cut + 1:
                            taken = True
                            break
                if taken:
                    order[placed] = node
                    placed += 1
            for k in range(part_start[parts], placed):
                part[order[k]] = parts
            for k in range(count):
                level[queue[k]] = -1
            parts += 1
            part_start[parts] = placed
    return parts


# ---- fronts ----------------------------------------------------------------------------------------------------------


@njit(cache=True, fastmath=FAST)
def assemble_front(
    f11: Array, f21: Array, f22: Array, points: Index, row_start: Index, place: Index, coefficient: Array, root: Array
) -> None:
    """Add (A_p C_p)(A_p C_p)^T of some points to the lower half of a front [[f11, .], [f21, f22]].

    Rows row_start[p] : row_start[p + 1] of ``coefficient`` are A_p without its zero rows, ``place`` their places in
    the front, ascending; root[p] = C_p.
    """
    owned, c = f11.shape[0], coefficient.shape[1]
    most = 0
    for p in points:
        most = max(most, row_start[p + 1] - row_start[p])
    scaled = np.empty((most, c))
    for p in points:
        first = row_start[p]
        rows = row_start[p + 1] - first
        for i in range(rows):
            for j in range(c):
                total = 0.0
                for k in range(c):
                    total += coefficient[first + i, k] * root[p, k, j]
                scaled[i, j] = total
        for i in range(rows):
            a = place[first + i]
            for j in range(i + 1):
                b = place[first + j]
                value = 0.0
                for k in range(c):
                    value += scaled[i, k] * scaled[j, k]
                if a < owned:
                    f11[a, b] += value
                elif b < owned:
                    f21[a - owned, b] += value
                else:
                    f22[a - owned, b - owned] += value


@njit(cache=True)
def extend_add(f11: Array, f21: Array, f22: Array, update: Array, place: Index) -> None:
    """Add the lower half of a child's ``update`` to its parent's front; ``place`` ascends."""
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
    """Solve L L^T x = x in place for the rows of ``x``, shape (right-hand sides, n).

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


# ---- cones -----------------------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def nesterov_todd(x: Array, s: Array) -> tuple[bool, Array, Array]:
    """Scaling W with W x = W^-1 s, given by an axis of determinant one and a size; False where a point left its cone.

    Returns inside, axis (m, c), size (m,). Determinants are products (x_0 - |x_1..|)(x_0 + |x_1..|): the difference of
    squares would lose half the digits near the boundary.
    """
    m, c = x.shape
    axis, size = np.empty((m, c)), np.empty(m)
    for p in range(m):
        tail_x, tail_s = 0.0, 0.0
        for j in range(1, c):
            tail_x += x[p, j] ** 2
            tail_s += s[p, j] ** 2
        tail_x, tail_s = np.sqrt(tail_x), np.sqrt(tail_s)
        det_x = (x[p, 0] - tail_x) * (x[p, 0] + tail_x)
        det_s = (s[p, 0] - tail_s) * (s[p, 0] + tail_s)
        if not (det_x > 0.0 and det_s > 0.0 and x[p, 0] > 0.0 and s[p, 0] > 0.0):
            return False, axis, size
        root_x, root_s = np.sqrt(det_x), np.sqrt(det_s)
        size[p] = np.sqrt(root_s / root_x)
        cosine = 0.0
        for j in range(c):
            cosine += (x[p, j] / root_x) * (s[p, j] / root_s)
        double = 2.0 * np.sqrt(0.5 * (1.0 + cosine))
        tail = 0.0
        for j in range(1, c):
            axis[p, j] = (s[p, j] / root_s - x[p, j] / root_x) / double
            tail += axis[p, j] ** 2
        axis[p, 0] = np.sqrt(1.0 + tail)
    return True, axis, size


@njit(cache=True, error_model="numpy")
def scaled(axis: Array, size: Array, x: Array, inverse: bool) -> Array:
    """W x, or W^-1 x, at every point."""
    m, c = x.shape
    out, sign = np.empty((m, c)), -1.0 if inverse else 1.0
    for p in range(m):
        factor = 1.0 / size[p] if inverse else size[p]
        dot = 0.0
        for j in range(1, c):
            dot += axis[p, j] * x[p, j]
        along = sign * x[p, 0] + dot / (1.0 + axis[p, 0])
        out[p, 0] = (axis[p, 0] * x[p, 0] + sign * dot) * factor
        for j in range(1, c):
            out[p, j] = (x[p, j] + along * axis[p, j]) * factor
    return out


@njit(cache=True, error_model="numpy")
def inverse_roots(axis: Array, size: Array, stiffness: Array) -> tuple[Array, Array, Array]:
    """Roots of the inverse Hessian H = W^2 + stiffness e_0 e_0^T of every point, without subtracting large numbers.

    Returns root (m, c, c) with root root^T = H^-1, turn = root^T W (m, c, c), lever = root^T e_0 (m, c).
    root = W^-1 (1 - (1 - b) d d^T) with d along W^-1 e_0 and b = (1 + stiffness |W^-1 e_0|^2)^-1/2.
    """
    m, c = axis.shape
    root, turn, lever = np.empty((m, c, c)), np.empty((m, c, c)), np.empty((m, c))
    row, arm = np.empty(c), np.empty(c)
    for p in range(m):
        square = 0.0
        for j in range(c):
            arm[j] = (axis[p, 0] if j == 0 else -axis[p, j]) / size[p]
            square += arm[j] ** 2
        shrink = 1.0 / np.sqrt(1.0 + stiffness[p] * square)
        for j in range(c):
            lever[p, j] = arm[j] * shrink
            root[p, 0, j] = arm[j] * shrink
            for k in range(c):
                turn[p, j, k] = (1.0 if j == k else 0.0) - (1.0 - shrink) * arm[j] * arm[k] / square
        for i in range(1, c):
            along = 0.0
            for j in range(c):
                if j == 0:
                    row[j] = -axis[p, i] / size[p]
                else:
                    row[j] = ((1.0 if i == j else 0.0) + axis[p, i] * axis[p, j] / (1.0 + axis[p, 0])) / size[p]
                along += row[j] * arm[j]
            along /= square
            for j in range(c):
                root[p, i, j] = (row[j] - along * arm[j]) + along * arm[j] * shrink
    return root, turn, lever


@njit(cache=True, error_model="numpy")
def inward(root: Array, turn: Array, lever: Array, v: Array, u: Array, push: Array) -> Array:
    """root^T v + turn u + lever push at every point."""
    m, c = v.shape
    out = np.empty((m, c))
    for p in range(m):
        for j in range(c):
            total = lever[p, j] * push[p]
            for i in range(c):
                total += root[p, i, j] * v[p, i] + turn[p, j, i] * u[p, i]
            out[p, j] = total
    return out


@njit(cache=True, error_model="numpy")
def outward(root: Array, o: Array) -> Array:
    """Root times o at every point."""
    m, c = o.shape
    out = np.empty((m, c))
    for p in range(m):
        for i in range(c):
            total = 0.0
            for j in range(c):
                total += root[p, i, j] * o[p, j]
            out[p, i] = total
    return out


@njit(cache=True, error_model="numpy")
def inverse_hessian(root: Array, v: Array) -> Array:
    """H^-1 v = root root^T v at every point."""
    m, c = v.shape
    out, o = np.empty((m, c)), np.empty(c)
    for p in range(m):
        for j in range(c):
            total = 0.0
            for i in range(c):
                total += root[p, i, j] * v[p, i]
            o[j] = total
        for i in range(c):
            total = 0.0
            for j in range(c):
                total += root[p, i, j] * o[j]
            out[p, i] = total
    return out


@njit(cache=True, error_model="numpy")
def inverse_step(x: Array, d: Array) -> float:
    """Largest 1 / step at which a point x + step d reaches the boundary of its cone; 0 when none ever does."""
    m, c = x.shape
    worst = 0.0
    for p in range(m):
        tail = 0.0
        for j in range(1, c):
            tail += x[p, j] ** 2
        tail = np.sqrt(tail)
        root = np.sqrt((x[p, 0] - tail) * (x[p, 0] + tail))
        dot = x[p, 0] * d[p, 0]
        for j in range(1, c):
            dot -= x[p, j] * d[p, j]
        dot /= root
        along = (dot + d[p, 0]) / (x[p, 0] / root + 1.0)
        rest = 0.0
        for j in range(1, c):
            rest += (d[p, j] - along * x[p, j] / root) ** 2
        worst = max(worst, (np.sqrt(rest) - dot) / root)
    return worst
