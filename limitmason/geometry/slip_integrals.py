"""Integral of the slip |s| over faces of rigid blocks: what cohesion dissipates, in closed form."""

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.geometry.polygon import NO_HEIGHT, NO_LENGTH

FAR = 1e3
"""Distance of the centre of rotation over the size of the face from which the slip is a series about the centroid."""


def slip_integrals(corners: Array, start: Index, sliding: Array, spin: Array) -> Array:
    """Integral of |s| over polygons, s(x) = sliding + spin (-x_2, x_1).

    s_c is s at the centroid, from which x is measured.

    Parameters
    ----------
    corners : of all polygons in a row, counter-clockwise, from each one's own centroid [m], shape (sum, 2)
    start : offsets of the polygons, shape (k + 1,)
    sliding : at the centroids [m/s], shape (k, 2)
    spin : about the normals [rad/s], shape (k,)

    Returns
    -------
    [m3/s], shape (k,). Exact where the centre of rotation is near, |spin| times the integral of the distance from it
    (see :func:`limitmason.geometry.polygon.polar_mean_radius`); else to second order,
    A |s_c| + spin^2 / (2 |s_c|) times the second moment along s_c, within 1e-9.
    """
    k = len(start) - 1
    owner = np.repeat(np.arange(k), np.diff(start))
    following = np.arange(1, len(corners) + 1)
    # the last corner of every polygon is followed by its first
    following[start[1:] - 1] = start[:-1]
    q, r = corners, corners[following]
    cross = q[:, 0] * r[:, 1] - q[:, 1] * r[:, 0]
    area = np.bincount(owner, 0.5 * cross, k)
    size = np.zeros(k)
    np.maximum.at(size, owner, np.linalg.norm(q, axis=1))
    speed = np.linalg.norm(sliding, axis=1)
    far = speed >= FAR * np.abs(spin) * size  # the centre of rotation, at speed / spin, lies far beyond the polygon
    turning = np.where(far, 1.0, spin)  # any number but zero where the series is taken
    # far: |s| = |s_c| + first order (no integral) + spin^2 (x . s_c)^2 / (2 |s_c|^3)
    along = sliding / np.maximum(speed, 1e-300)[:, None]
    u, v = (q * along[owner]).sum(axis=1), (r * along[owner]).sum(axis=1)  # ends of every side along s_c [m]
    second = np.bincount(owner, cross * (u * u + u * v + v * v) / 12.0, k)
    series = area * speed + 0.5 * spin**2 * second / np.maximum(speed, 1e-300)
    # near: triangles between every edge and the centre of rotation
    pole = np.column_stack([-sliding[:, 1], sliding[:, 0]]) / turning[:, None]
    q, r = q - pole[owner], r - pole[owner]
    edge = r - q
    length = np.linalg.norm(edge, axis=1)
    t = edge / np.maximum(length, 1e-300)[:, None]
    h = q[:, 0] * t[:, 1] - q[:, 1] * t[:, 0]  # of the triangles, positive where they run counter-clockwise [m]
    # an edge that points at the centre of rotation spans no area
    keep = (length > NO_LENGTH * size[owner]) & (np.abs(h) > NO_HEIGHT * size[owner])
    height = np.where(keep, np.abs(h), 1.0)

    def primitive(point: Array) -> Array:
        """Integral of twice sqrt(1 + w^2) over w, the place along the edge over the triangle's height."""
        w = (point * t).sum(axis=1) / height
        return w * np.sqrt(1.0 + w * w) + np.arcsinh(w)

    part = np.where(keep, np.sign(h) * height**3 / 6.0 * (primitive(r) - primitive(q)), 0.0)
    exact = np.abs(spin) * np.bincount(owner, part, k)
    return np.where(far, series, exact)
