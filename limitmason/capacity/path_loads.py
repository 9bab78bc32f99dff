"""Loads of a path on the degrees of freedom: forces of fixed direction, whose points move with their blocks.

A block turns by R and strains by G, the mean gradient of its displacement. The point at r from the centroid goes to
R (1 + G) r: a force there works on every shape by the gradient of it, as if it were spread over the block.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.kinematics import Pose
from limitmason.geometry.rotation import axial
from limitmason.model.load import Loads


class PathLoads(NamedTuple):
    """Wrenches on d degrees of freedom of n blocks, the last k of them shapes, and where their forces act.

    Parameters
    ----------
    dead, live : in the reference pose, zero where a degree of freedom is held [N, N m], shape (n, d)
    dead_arms, live_arms : sum of r f^T, r from the centroid in the reference pose to where a force f acts [N m], shape
        (n, 3, 3)
    spins : rotation vector of a unit of every degree of freedom, shape (3, d)
    gradients : mean gradient of the displacement of every shape [1/m], shape (n, k, 3, 3)
    free : whether it moves, shape (n, d)
    turning : numbers of the blocks whose loads change as they turn and strain, shape (l,)
    """

    dead: Array
    live: Array
    dead_arms: Array
    live_arms: Array
    spins: Array
    gradients: Array
    free: Flags
    turning: Index

    @classmethod
    def of(cls, loads: Loads, basis: Array, free: Flags, gradients: Array | None = None) -> "PathLoads":
        """Loads on the degrees of freedom of blocks.

        Parameters
        ----------
        loads : of the assembly, on n blocks
        basis : motion (shift, spin, coordinates of shapes) per degree of freedom, shape (6 + k, d)
        free : which are free, shape (n, d)
        gradients : of the shapes, as in the class; None for rigid blocks
        """
        bent = np.zeros((len(free), 0, 3, 3)) if gradients is None else gradients
        spins, has_arms = basis[3:6], loads.dead_arms.any(axis=(1, 2)) | loads.live_arms.any(axis=(1, 2))
        # degrees of freedom that turn or strain a block, and blocks with forces off the centroid that move by one
        turns_or_strains = spins.any(axis=0) | basis[6:].any(axis=0)
        turning = np.flatnonzero(has_arms & (free & turns_or_strains).any(axis=1))
        wrenches = [loads.dead @ basis[:6] * free, loads.live @ basis[:6] * free]
        # shapes are the last degrees of freedom; where no block turns or strains, no force acts on a free one
        if len(turning) and bent.shape[1]:
            for wrench, arms in zip(wrenches, (loads.dead_arms, loads.live_arms), strict=True):
                wrench[:, -bent.shape[1] :] += _on_shapes(bent, arms) * free[:, -bent.shape[1] :]
        dead, live = wrenches
        return cls(dead, live, loads.dead_arms, loads.live_arms, spins, bent, free, turning)

    def at(self, pose: Pose) -> tuple[Array, Array]:
        """Dead and live wrenches in a pose [N, N m], on shapes [N], shape (n, d) each.

        Moments M + sum of (R (1 + G) r - r) x f, and on shape k the sum of f . R G_k r.
        """
        if not len(self.turning):
            # forces at centroids have no moment, however the blocks turn
            return self.dead, self.live
        bent, turn = self.gradients, pose.turn
        gradient = np.einsum("nk,nkij->nij", pose.shapes, bent)
        moved = turn + gradient + turn @ gradient if bent.shape[1] else turn  # R (1 + G) - 1
        out = []
        for wrench, arms in ((self.dead, self.dead_arms), (self.live, self.live_arms)):
            more = axial(moved @ arms) @ self.spins
            if bent.shape[1]:
                more[:, -bent.shape[1] :] += _on_shapes(turn[:, None] @ bent, arms)
            out.append(wrench + more * self.free)
        return out[0], out[1]

    def load_tangent(self, pose: Pose, multiplier: float) -> Array:
        """Change of the wrenches of the turning blocks with their motions, shape (l, d, d).

        Rows of motions that are held are left to the caller. With P = sum of x f^T, x = R (1 + G) r, a spin d makes
        d(M) = sum of (d x x) x f = (P - tr(P) 1) d. A shape makes sum of (R G_k r) x f. So much does a spin change the
        force on the shape, since forces have a potential.

        Parameters
        ----------
        multiplier : lambda, on the live loads [-]
        """
        rows = self.turning
        arms = self.dead_arms[rows] + multiplier * self.live_arms[rows]
        turn, bent = pose.turn[rows] + np.eye(3), self.gradients[rows]
        gradient = np.einsum("nk,nkij->nij", pose.shapes[rows], bent)
        p = turn @ arms + turn @ gradient @ arms if bent.shape[1] else turn @ arms
        p = p - np.trace(p, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        out = np.asarray(self.spins.T @ p @ self.spins)
        if bent.shape[1]:
            by_shapes = axial(turn[:, None] @ bent @ arms[:, None]) @ self.spins  # (l, k, d)
            out[:, -bent.shape[1] :] += by_shapes
            out[:, :, -bent.shape[1] :] += by_shapes.transpose(0, 2, 1)
        return out


def _on_shapes(gradients: Array, arms: Array) -> Array:
    """Forces of loads on shapes, tr(G_k sum of r f^T) [N], shape (n, k).

    Parameters
    ----------
    gradients : of the shapes, as the blocks lie [1/m], shape (n, k, 3, 3)
    arms : sum of r f^T, r in the axes of the blocks [N m], shape (n, 3, 3)
    """
    return np.einsum("nkij,nji->nk", gradients, arms)
