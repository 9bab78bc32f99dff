"""Compiled functions of ``limit``: points in dense fronts and Lorentz cones.

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


# ---- fronts ----------------------------------------------------------------------------------------------------------


@njit(cache=True, fastmath=FAST)
def assemble_front(
    f11: Array, f21: Array, f22: Array, points: Index, row_start: Index, place: Index, coefficient: Array, root: Array
) -> None:
    """Add (A_p C_p)(A_p C_p)^T of points to the lower half of [[f11, .], [f21, f22]].

    Parameters
    ----------
    f11, f21, f22 : are added to; n unknowns eliminated in the front, k passed on: shapes (n, n), (k, n), (k, k)
    points : numbers p of the points
    row_start : rows row_start[p] : row_start[p + 1] of ``coefficient`` belong to point p, shape (m + 1,)
    place : place of every row in the front, ascending within a point, the k passed on after the n
    coefficient : A_p of all points one below the other, without zero rows, shape (sum, c)
    root : C_p of every point, shape (m, c, c)
    """
    owned, c = f11.shape[0], coefficient.shape[1]
    most = 0
    for p in points:
        most = max(most, row_start[p + 1] - row_start[p])
    scaled = np.empty((most, c))  # A_p C_p
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
            for j in range(i + 1):  # places ascend, so that b <= a: the lower half
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


# ---- cones -----------------------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def nesterov_todd(x: Array, s: Array) -> tuple[bool, Array, Array]:
    """Scaling W of every point with W x = W^-1 s, of a primal x and a dual s.

    With an axis a of determinant a_0^2 - |a_1..|^2 = 1 and a size,

        W = size [[a_0, a_1..^T], [a_1.., 1 + a_1.. a_1..^T / (1 + a_0)]]

    Parameters
    ----------
    x, s : points within their cones, shape (m, c)

    Returns
    -------
    inside : False where a point left its cone, and then the rest is unfinished
    axis, size : shapes (m, c) and (m,)

    Notes
    -----
    Determinants are products (x_0 - |x_1..|)(x_0 + |x_1..|): the difference of squares would lose half the digits near
    the boundary. Source: Nesterov and Todd (1998), Primal-dual interior-point methods for self-scaled cones.
    """
    m, c = x.shape
    axis, size = np.empty((m, c)), np.empty(m)
    for p in range(m):
        norm_x, norm_s = 0.0, 0.0  # of the components after the first
        for j in range(1, c):
            norm_x += x[p, j] ** 2
            norm_s += s[p, j] ** 2
        norm_x, norm_s = np.sqrt(norm_x), np.sqrt(norm_s)
        det_x = (x[p, 0] - norm_x) * (x[p, 0] + norm_x)
        det_s = (s[p, 0] - norm_s) * (s[p, 0] + norm_s)
        if not (det_x > 0.0 and det_s > 0.0 and x[p, 0] > 0.0 and s[p, 0] > 0.0):
            return False, axis, size
        root_x, root_s = np.sqrt(det_x), np.sqrt(det_s)
        size[p] = np.sqrt(root_s / root_x)
        product = 0.0  # of both at determinant one
        for j in range(c):
            product += (x[p, j] / root_x) * (s[p, j] / root_s)
        # the axis is (s' + J x') / length with s', x' of determinant one and J = diag(1, -1, ...)
        length = 2.0 * np.sqrt(0.5 * (1.0 + product))
        square = 0.0
        for j in range(1, c):
            axis[p, j] = (s[p, j] / root_s - x[p, j] / root_x) / length
            square += axis[p, j] ** 2
        axis[p, 0] = np.sqrt(1.0 + square)
    return True, axis, size


@njit(cache=True, error_model="numpy")
def scaled(axis: Array, size: Array, x: Array, inverse: bool) -> Array:
    """W x, or W^-1 x, at every point, with the scaling of Nesterov and Todd.

    With the axis (w_0, w_1) and x = (x_0, x_1), where w_1 and x_1 hold all components after the first,
    W x = size (w . x, x_1 + (x_0 + w_1 . x_1 / (1 + w_0)) w_1). The inverse has -w_1 for w_1, and 1 / size.

    Parameters
    ----------
    axis, size : of :func:`nesterov_todd`, shapes (m, c) and (m,)
    x : shape (m, c)
    inverse : W^-1 x instead of W x
    """
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
    """Roots of the inverse of H = W^2 + stiffness e_0 e_0^T, without cancellation.

    root = W^-1 (1 - (1 - b) d d^T) with d along W^-1 e_0, |d| = 1, and b = (1 + stiffness |W^-1 e_0|^2)^-1/2.

    Parameters
    ----------
    axis, size : W as of :func:`nesterov_todd`, shapes (m, c) and (m,)
    stiffness : that is added, shape (m,)

    Returns
    -------
    root : root root^T = H^-1, shape (m, c, c)
    turn : root^T W, shape (m, c, c)
    lever : root^T e_0, shape (m, c)
    """
    m, c = axis.shape
    root, turn, lever = np.empty((m, c, c)), np.empty((m, c, c)), np.empty((m, c))
    row, arm = np.empty(c), np.empty(c)
    for p in range(m):
        square = 0.0
        for j in range(c):
            arm[j] = (axis[p, 0] if j == 0 else -axis[p, j]) / size[p]  # W^-1 e_0
            square += arm[j] ** 2
        shrink = 1.0 / np.sqrt(1.0 + stiffness[p] * square)  # b of the docstring
        for j in range(c):
            lever[p, j] = arm[j] * shrink
            root[p, 0, j] = arm[j] * shrink
            for k in range(c):
                turn[p, j, k] = (1.0 if j == k else 0.0) - (1.0 - shrink) * arm[j] * arm[k] / square
        for i in range(1, c):
            # row i of W^-1, and its part along d
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
    """root^T v + turn u + lever push at every point, shape (m, c).

    It takes rates v (m, c), scaled products u (m, c) and the bounds' force ``push`` (m,) to the coordinates of the
    factor. ``root``, ``turn`` and ``lever`` come from :func:`inverse_roots`.
    """
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
    """Product root o at every point, (m, c): from the factor's coordinates to forces.

    ``root`` comes from :func:`inverse_roots`, shape (m, c, c); o has shape (m, c).
    """
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
    """H^-1 v = root root^T v, v (m, c); ``root`` is of :func:`inverse_roots`."""
    return outward(root, outward(root.transpose(0, 2, 1), v))


@njit(cache=True, error_model="numpy")
def inverse_step(x: Array, d: Array) -> float:
    """Largest 1 / step at which x + step d reaches its cone's boundary, 0 for never.

    The cone is x_0 >= |(x_1, ...)|. In coordinates that scale x to the unit of the cone's axis the step is (rho_0, rho)
    and meets the boundary at 1 / (|rho| - rho_0). Source: Vandenberghe 2010, The CVXOPT linear and quadratic cone
    program solvers.

    Parameters
    ----------
    x : points within their cones, shape (m, c)
    d : their steps, shape (m, c)
    """
    m, c = x.shape
    worst = 0.0
    for p in range(m):
        tail = 0.0
        for j in range(1, c):
            tail += x[p, j] ** 2
        tail = np.sqrt(tail)
        # sqrt(x_0^2 - tail^2) as a product: near the boundary the difference of squares would cancel
        root = np.sqrt((x[p, 0] - tail) * (x[p, 0] + tail))
        dot = x[p, 0] * d[p, 0]
        for j in range(1, c):
            dot -= x[p, j] * d[p, j]
        dot /= root  # rho_0 times root
        along = (dot + d[p, 0]) / (x[p, 0] / root + 1.0)
        rest = 0.0  # |rho|^2 times root^2
        for j in range(1, c):
            rest += (d[p, j] - along * x[p, j] / root) ** 2
        worst = max(worst, (np.sqrt(rest) - dot) / root)
    return worst
