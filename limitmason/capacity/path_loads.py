"""Loads of a path on the degrees of freedom: forces of fixed direction, whose points turn with their blocks."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.geometry.rotation import axial
from limitmason.model.load import Loads


class PathLoads(NamedTuple):
    """Wrenches on d degrees of freedom of n blocks, and where their forces act.

    Parameters
    ----------
    dead, live : in the reference pose, zero where a degree of freedom is held [N, N m], shape (n, d)
    dead_arms, live_arms : sum of r f^T, r from the centroid in the reference pose to where a force f acts [N m], shape
        (n, 3, 3)
    spins : rotation vector of a unit of every degree of freedom, shape (3, d)
    free : whether it moves, shape (n, d)
    turning : numbers of the blocks whose moments change as they turn, shape (l,)
    """

    dead: Array
    live: Array
    dead_arms: Array
    live_arms: Array
    spins: Array
    free: Flags
    turning: Index

    @classmethod
    def of(cls, loads: Loads, basis: Array, free: Flags) -> "PathLoads":
        """Loads on the degrees of freedom of blocks.

        On the last k rows of the basis, shapes of a block that deforms, no load does work.

        Parameters
        ----------
        loads : of the assembly, on n blocks
        basis : motion (shift, spin, coordinates of shapes) per degree of freedom, shape (6 + k, d)
        free : which are free, shape (n, d)
        """
        spins = basis[3:6]
        off_centre = loads.dead_arms.any(axis=(1, 2)) | loads.live_arms.any(axis=(1, 2))  # forces beside the centroid
        turning = np.flatnonzero(off_centre & (free & spins.any(axis=0)).any(axis=1))
        dead, live = loads.dead @ basis[:6] * free, loads.live @ basis[:6] * free
        return cls(dead, live, loads.dead_arms, loads.live_arms, spins, free, turning)

    def at(self, turn: Array) -> tuple[Array, Array]:
        """Dead and live wrenches where blocks have turned [N, N m], shape (n, d) each.

        Forces stay as they are, moments become M + sum of (R - I) r x f.

        Parameters
        ----------
        turn : R - I of the blocks, shape (n, 3, 3)
        """
        if not len(self.turning):
            # forces at centroids have no moment, however the blocks turn
            return self.dead, self.live
        dead, live = (axial(turn @ arms) @ self.spins * self.free for arms in (self.dead_arms, self.live_arms))
        return self.dead + dead, self.live + live

    def load_tangent(self, turn: Array, multiplier: float) -> Array:
        """Derivative of the wrenches on turning blocks by their motions, dF/du, shape (l, d, d).

        Rows are wrenches, columns motions. With P = sum of (R r) f^T a spin d makes
        d(M) = sum of (d x R r) x f = (P - tr(P) 1) d.

        Parameters
        ----------
        turn : R - I of the blocks, shape (n, 3, 3)
        multiplier : lambda, on the live loads [-]
        """
        rows = self.turning
        p = (turn[rows] + np.eye(3)) @ (self.dead_arms[rows] + multiplier * self.live_arms[rows])
        p = p - np.trace(p, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        return np.asarray(self.spins.T @ p @ self.spins)
