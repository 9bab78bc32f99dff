"""Rigid motions of blocks: velocities, finite motions from rates, and which joints open or slide.

``twists`` are those of every block [m/s, rad/s], shape (n, 6).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Flags, Index
from limitmason.checks import instance, positive
from limitmason.errors import InputError
from limitmason.geometry.rotation import cross_matrix, vector_product
from limitmason.model import Assembly

_LARGEST_TURN = 0.35
"""Largest rotation drawn [rad]; beyond about 20 degrees a picture of a rate suggests a path that nobody computed."""


_SMALL_TURN = 1e-4
"""Rotation [rad] below which series replace (t - sin t) / t^3 and its like: their next term is below rounding."""

_STILL = 1e-12
"""Rate over that of the fastest vertex up to which a joint does not move, where no larger one is asked for [-]."""


class RigidMotion(NamedTuple):
    """Finite motion of n blocks: x -> centroid + translation + rotation (x - centroid)."""

    centroid: Array  # before the motion [m], (n, 3)
    translation: Array  # of the centroid [m], (n, 3)
    rotation: Array  # matrices, (n, 3, 3)

    def moved(self, points: ArrayLike, block: int | Index) -> Array:
        """Points [m], shape (k, 3), carried by one block or by one block each."""
        p = np.asarray(points, dtype=float)
        arm = p - self.centroid[block]
        turned = np.einsum("...ij,...j->...i", self.rotation[block], arm)
        return self.centroid[block] + self.translation[block] + turned


class MovingJoints(NamedTuple):
    """Largest opening and sliding rate on the corners of k interfaces, and which of the two dominates."""

    opening: Array  # [m/s], (k,)
    sliding: Array  # [m/s], (k,)
    opens: Flags  # moves, and opens no slower than it slides, (k,)
    slides: Flags  # moves, and slides faster than it opens, (k,)


def finite_motion(centroids: Array, twists: Array, factor: float) -> RigidMotion:
    """Motion after following constant twists for a while: rigid, however large the rotation.

    The rotation is exp(factor [omega x]); the centroid follows the arc about the instantaneous centre, so that a block
    rocking about its toe keeps the toe where it is instead of growing or sinking.

    Parameters
    ----------
    centroids : [m], shape (n, 3)
    twists : velocity of the centroid and angular velocity [m/s, rad/s], shape (n, 6)
    factor : for how long they are followed [s]
    """
    v, w = factor * twists[:, :3], factor * twists[:, 3:]
    angle = np.linalg.norm(w, axis=1)
    k = cross_matrix(w)
    small = angle < _SMALL_TURN
    t = np.where(small, 1.0, angle)  # any number but zero, where the series are taken
    # sin(t) / t, (1 - cos(t)) / t^2 and (t - sin(t)) / t^3, by their series at small angles
    sine = np.where(small, 1.0 - angle**2 / 6.0, np.sin(t) / t)
    cosine = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(t)) / t**2)
    cubic = np.where(small, 1.0 / 6.0 - angle**2 / 120.0, (t - np.sin(t)) / t**3)
    square = k @ k
    one = np.eye(3)
    # Rodrigues' formula, and its integral over the turn for the way of the centroid
    rotation = one + sine[:, None, None] * k + cosine[:, None, None] * square
    arc = one + cosine[:, None, None] * k + cubic[:, None, None] * square
    return RigidMotion(centroids, np.einsum("nij,nj->ni", arc, v), rotation)


def velocity(centroids: Array, twists: Array, block: int | Index, points: Array) -> Array:
    """Velocity of points carried by one block or by one block each, v + omega x (r - c) [m/s], shape (k, 3).

    Parameters
    ----------
    centroids : c of all blocks [m], shape (n, 3)
    twists : v and omega of all blocks [m/s, rad/s], shape (n, 6)
    block : number of the block, or of each point's block, shape (k,)
    points : r [m], shape (k, 3)
    """
    return np.asarray(twists[block, :3] + vector_product(twists[block, 3:], points - centroids[block]))


def largest_jumps(assembly: Assembly, jump: Array, normal: Array) -> tuple[Array, Array]:
    """Largest opening (negative where all corners close) and sliding at the corners of every interface, (k,) each.

    Parameters
    ----------
    jump : motion of b relative to a at every corner of ``assembly.arrays`` [m] or [m/s], shape (n, 3)
    normal : of the face there, from a to b, shape (n, 3)
    """
    x = assembly.arrays
    owner = x.corner_owner
    apart = np.einsum("ij,ij->i", jump, normal)
    opening, sliding = np.full(len(x.block_a), -np.inf), np.zeros(len(x.block_a))
    np.maximum.at(opening, owner, apart)
    np.maximum.at(sliding, owner, np.linalg.norm(jump - apart[:, None] * normal, axis=1))
    return opening, sliding


def largest_rates(assembly: Assembly, twists: Array) -> Array:
    """Largest speed of any vertex of each block [m/s], shape (n_blocks,), from their twists (n_blocks, 6)."""
    points, start = assembly.vertices
    owner = np.repeat(np.arange(assembly.n_blocks), np.diff(start))
    speed = np.linalg.norm(velocity(assembly.centroids, twists, owner, points), axis=1)
    rate = np.zeros(assembly.n_blocks)
    np.maximum.at(rate, owner, speed)
    return rate


def drawn_motion(assembly: Assembly, twists: Array, scale: float) -> RigidMotion:
    """Motion for a picture: the fastest vertex moves by a fraction of the structure's size, sqrt(height x length).

    Parameters
    ----------
    twists : of every block [m/s, rad/s], shape (n, 6)
    scale : largest displacement over that size [-]; rotations are held below 0.35 rad whatever it is
    """
    positive("scale", scale)
    fastest = float(largest_rates(assembly, twists).max(initial=0.0))
    spin = float(np.linalg.norm(twists[:, 3:], axis=1).max(initial=0.0))
    if fastest == 0.0:
        return finite_motion(assembly.centroids, np.zeros_like(twists), 0.0)
    factor = scale * structure_size(assembly) / fastest
    if spin > 0.0:
        factor = min(factor, _LARGEST_TURN / spin)
    return finite_motion(assembly.centroids, twists, factor)


def structure_size(assembly: Assembly) -> float:
    """Geometric mean of the height and the longest horizontal extent of the blocks that can move [m]."""
    span = np.ptp(free_bounds(assembly), axis=0)
    return float(np.sqrt(span[:2].max() * span[2]))


def free_or_all(assembly: Assembly) -> Index:
    """Numbers of the blocks that are not fixed; of all, where all are."""
    free = np.flatnonzero(~assembly.fixed)
    return free if len(free) else np.arange(assembly.n_blocks)


def free_bounds(assembly: Assembly) -> Array:
    """Lowest and highest coordinates of :func:`free_or_all` blocks [m], shape (2, 3)."""
    bounds = np.array([assembly.blocks[i].bounds for i in free_or_all(assembly)])
    return np.array([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)])


def joint_rates(assembly: Assembly, twists: Array) -> tuple[Array, Array]:
    """Largest opening and sliding rate [m/s] at the corners of every interface, shape (k,) each, from twists (n, 6)."""
    x = assembly.arrays
    owner = x.corner_owner
    a, b = (velocity(x.centroid, twists, block[owner], x.corners) for block in (x.block_a, x.block_b))
    return largest_jumps(assembly, b - a, x.normal[owner])


def moving_joints(assembly: Assembly, twists: Array, threshold: float) -> MovingJoints:
    """Interfaces that open or slide, from the relative velocity at their corners.

    Rates come from the twists alone, so that every method's mechanism can be drawn, whatever contact points it used.
    A joint slides where the tangential rate exceeds the opening rate: a dilatant sliding joint opens by less than it
    slides as long as tan(psi) < 1, and at a hinge the corners separate along the normal.

    Parameters
    ----------
    twists : of every block [m/s, rad/s], shape (n, 6)
    threshold : rates below this fraction of the fastest vertex are not marked [-]
    """
    opening, sliding = joint_rates(assembly, twists)
    least = max(threshold, _STILL) * float(largest_rates(assembly, twists).max(initial=0.0))
    moves = np.maximum(opening, sliding) > least
    return MovingJoints(opening, sliding, moves & (opening >= sliding), moves & (sliding > opening))


def checked_twists(assembly: Assembly, prediction: Prediction) -> Array:
    """The mechanism's twists, shape (n, 6), or an error that says why there are none.

    Parameters
    ----------
    prediction : whose mechanism is drawn
    """
    instance("prediction", prediction, Prediction, "of lm.limit_analysis, lm.predict ...")
    if prediction.mechanism is None:
        raise InputError(
            f"this prediction ({prediction.method}) has no mechanism to draw: its status is '{prediction.status}'"
        )
    twists = np.asarray(prediction.mechanism.twists, dtype=float)
    if twists.shape != (assembly.n_blocks, 6):
        raise InputError(
            f"the mechanism has twists of shape {twists.shape}, the assembly {assembly.n_blocks} blocks: they do not "
            "belong together"
        )
    if not np.isfinite(twists).all():
        block = int(np.flatnonzero(~np.isfinite(twists).all(axis=1))[0])
        raise InputError(f"the twist of block {assembly.blocks[block].name!r} is not finite")
    return twists
