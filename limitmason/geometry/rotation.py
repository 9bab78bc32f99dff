"""Finite rotations on plain arrays: unit quaternions, rotation vectors and matrices."""

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array


def vector_product(a: Array, b: Array) -> Array:
    """Products a x b of vectors whose leading axes fit each other, shapes (..., 3); the same bits as np.cross gives.

    For the small arrays here, which are many, that takes most of its time to turn axes.
    """
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


def rotation_vectors(quaternion: ArrayLike) -> Array:
    """Rotation vectors (axis times angle, up to half a turn) of unit quaternions.

    q = (cos(a/2), e sin(a/2)) gives a e; q and -q are the same rotation.

    Parameters
    ----------
    quaternion : scalar first [-], shape (..., 4)

    Returns
    -------
    [rad], shape (..., 3)
    """
    q = np.asarray(quaternion, dtype=float)
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    # a / sin(a/2) -> 2 for small angles, to the last digit below 1e-12
    factor = np.where(sine > 1e-12, 2.0 * np.arctan2(sine, q[..., :1]) / np.maximum(sine, 1e-300), 2.0)
    return factor * q[..., 1:]


def quaternions(vector: ArrayLike) -> Array:
    """Unit quaternions, scalar first, of rotation vectors [rad], shape (..., 3): shape (..., 4)."""
    v = np.asarray(vector, dtype=float)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    # sin(a/2) e = sinc(a/2) v / 2 without loss of digits
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * v], axis=-1)


def cross_matrix(v: Array) -> Array:
    """[v], with [v] w = v x w, of vectors of shape (..., 3): shape (..., 3, 3)."""
    k = np.zeros((*v.shape, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    k -= np.swapaxes(k, -1, -2)
    return k


def axial(tensor: Array) -> Array:
    """Sum of r x f of first moments P = sum of r f^T, (P_yz - P_zy, P_zx - P_xz, P_xy - P_yx), shape (..., 3).

    Parameters
    ----------
    tensor : P, shape (..., 3, 3)
    """
    out = np.empty(tensor.shape[:-1])
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., k] = tensor[..., i, j] - tensor[..., j, i]
    return out


def rotation_matrices(vector: ArrayLike) -> Array:
    """Rotation matrices exp([v x]) of rotation vectors.

    R = I + sin(a)/a K + (1 - cos(a))/a^2 K^2, with K the cross product matrix of the vector and a its length.

    Parameters
    ----------
    vector : [rad], shape (..., 3); any length

    Returns
    -------
    [-], shape (..., 3, 3)
    """
    v = np.asarray(vector, dtype=float)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    k = cross_matrix(v)
    # sin(a)/a and (1 - cos(a))/a^2 = 2 (sin(a/2)/a)^2 without loss of digits
    sine = np.sinc(angle / np.pi)
    half = np.sinc(0.5 * angle / np.pi)
    return np.eye(3) + sine * k + 0.5 * half**2 * (k @ k)
