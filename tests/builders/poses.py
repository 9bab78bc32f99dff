"""Blocks of a running model put at a pose with a velocity."""

import numpy as np

from dem import kernels


def rotation(vector):
    """Quaternion and rotation matrix of a rotation vector."""
    half = 0.5 * np.linalg.norm(vector)
    q = np.r_[np.cos(half), np.sinc(half / np.pi) * np.asarray(vector) / 2.0]
    matrix = np.empty((3, 3))
    kernels.rotation_of(q, matrix)
    return q, matrix + np.eye(3)


def place(state, assembly, block, matrix, centre, vel=(0, 0, 0), spin=(0, 0, 0)):
    """Put a block at a pose with a velocity."""
    cosine = 0.5 * (np.trace(matrix) - 1.0)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    axis = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    q, _ = rotation(angle * axis / max(np.linalg.norm(axis), 1e-300))
    b = state.bodies
    b.quat[block] = q
    kernels.rotation_of(q, b.rot[block])
    b.shift[block] = np.asarray(centre) - assembly.centroids[block]
    b.vel[block], b.spin[block] = vel, spin
    turn = b.rot[block] + np.eye(3)
    b.ang[block] = turn @ np.linalg.inv(b.inv_inertia[block]) @ turn.T @ spin
