"""What cracks have taken beside the fracture energy: rows of points across each crack, from brick to brick."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from limitmason.arrays import Array, Flags, Index
from limitmason.continuum.equilibrium import Solver
from limitmason.continuum.mesh import CORNERS
from limitmason.continuum.rotating_crack import Memory
from limitmason.continuum.uniaxial_curves import Curves, envelope

_OFF = 0.03  # of the energy of one crack from which a curve warns, chosen
ALONG = 0.9
"""Cosine between the normal of a crack and the way to the next brick from which that lies across it, chosen."""
OPEN = 1e-6  # of the elastic strain at the strength: a crack strain below it is rounding
_ITERATIONS = 60  # most of Newton's steps to the opening of one crack
_EXACT = 1e-12  # of its solution: a step below it ends the iteration, that is rounding


class CrackEnergy(NamedTuple):
    """Energy that cracks have taken, beside that of single cracks.

    Parameters
    ----------
    taken : by the cracks [J]
    of_one : what one crack of the same opening takes in each row of points, in all [J]
    place : middle of a brick where the two differ most [m], shape (3,)
    """

    taken: float
    of_one: float
    place: Array

    @property
    def ratio(self) -> float:
        """Taken over that of single cracks [-], 1 without a crack."""
        return self.taken / self.of_one if self.of_one > 0.0 else 1.0

    def warnings(self) -> tuple[str, ...]:
        """What a user should know where the cracks have not taken the fracture energy of their area."""
        if abs(self.ratio - 1.0) <= _OFF:
            return ()
        x, y, z = self.place
        why = "bricks side by side crack together" if self.ratio > 1.0 else "rows of points of a brick crack alone"
        return (
            f"cracks have taken {self.ratio:.2f} times the fracture energy of their area, most of the difference at "
            f"({x:.3g}, {y:.3g}, {z:.3g}) m: {why}",
        )


def crack_energy(solver: Solver, curves: Curves, memory: Memory) -> CrackEnergy:
    """Energy taken by the cracks of a state beside that of one crack across every row of points.

    A row runs across a crack, through all cracked bricks that touch along its normal. Its points have opened by
    w = sum e l, with the crack strain e and the length l of each. One crack of that opening takes
    G(w), the area under the softening curve less what unloading gives back: Gf where nothing is left to carry.

    Parameters
    ----------
    solver : of the path
    curves : of all integration points, as the materials are
    memory : of the state

    Notes
    -----
    Openings are the largest that were reached. Crushing is left out. A crack that turned, and a second one across it,
    count as more. Rows of neighbours are matched by their place in the brick, so bricks are read in one order.
    """
    d, mesh = solver.d, solver.model.mesh
    bricks, rows_per_brick = len(mesh), d.points**2
    # crack strain of every point: of the largest strain that it has reached, what its stress does not make
    value, axes = np.linalg.eigh(memory.tension)
    reached = np.maximum(value[:, 2:], 0.0)
    stress, _, _ = envelope(curves, reached)
    opened = (reached - stress / curves.modulus[:, None]).reshape(bricks, -1)
    # energy lost per volume, without what crushing took: its area less what unloading gives back
    shortest = -np.maximum(np.linalg.eigvalsh(memory.compression), 0.0)
    held, _, area = envelope(curves, shortest)
    lost = (memory.lost - (area - 0.5 * held * shortest).sum(axis=1)).reshape(bricks, -1)
    least = OPEN * curves.tension.reshape(bricks, -1) / curves.modulus.reshape(bricks, -1)
    cracked: Flags = np.asarray((opened > least).any(axis=1))
    if not cracked.any():
        return CrackEnergy(taken=0.0, of_one=0.0, place=np.zeros(3))
    # rows: number of that of every point, in its brick and in the stack of bricks that crack across each other
    normal = axes.reshape(bricks, -1, 3, 3)[np.arange(bricks), opened.argmax(axis=1), :, 2]
    row_of_brick = _rows(d.place, _edge(mesh.corners, normal))
    stack = across_cracks(mesh.solid.f2t, mesh.corners.mean(axis=1), normal, cracked)[1]
    row = rows_per_brick * stack[:, None] + row_of_brick
    # a row of a brick is as long as its crack band, each of its points by its share in the volume of the row
    width = solver.band * np.cbrt(d.volume.sum(axis=1))
    brick_row = (rows_per_brick * np.arange(bricks)[:, None] + row_of_brick).ravel()
    volumes = np.bincount(brick_row, d.volume.ravel(), minlength=rows_per_brick * bricks)
    length = width[:, None] * d.volume / volumes[brick_row].reshape(bricks, -1)
    # rounding may leave a point that has not cracked below zero
    counts = (cracked[:, None] & (opened >= 0.0)).ravel()
    n = int(row.max()) + 1

    def summed(values: Array) -> Array:
        """Sums over the points of every row, shape (n,)."""
        return np.bincount(row.ravel()[counts], values.ravel()[counts], minlength=n).astype(np.float64)

    # opening [m] of every row and the number of bricks that it crosses, kept from zero where none of its points counts
    opening, crossed = summed(opened * length), np.maximum(summed(length / width[:, None]), 1e-300)
    section = summed(d.volume / width[:, None]) / crossed  # area of every row [m2]
    # the law of the point that has opened most stands for its row: written last, it stays
    most = np.zeros(n, dtype=np.intp)
    order = np.argsort(np.where(counts, opened.ravel(), -1.0), kind="stable")
    most[row.ravel()[order]] = order
    single = _of_one(curves.rows(most), opening, width[most // d.per_brick]) * section
    taken = summed(lost * d.volume)
    off = np.bincount(stack[most // d.per_brick], taken - single, minlength=bricks)  # of every stack [J]
    worst = int(np.flatnonzero(stack == int(np.abs(off).argmax()))[0])
    return CrackEnergy(float(taken.sum()), float(single.sum()), mesh.corners[worst].mean(axis=0))


def _edge(corners: Array, normal: Array) -> Index:
    """Edge of every brick, 0 to 2 for those of the reference cube, nearest to a normal, shape (m,).

    Parameters
    ----------
    corners : of the bricks [m], shape (m, 8, 3)
    normal : one unit vector per brick, shape (m, 3)
    """
    # mean direction of the four edges: corners at 1 less those at 0
    edge = np.einsum("nk,mni->mki", CORNERS - 0.5, corners)
    edge /= np.linalg.norm(edge, axis=2, keepdims=True)
    return np.asarray(np.abs(np.einsum("mki,mi->mk", edge, normal)).argmax(axis=1))


def _rows(place: Array, edge: Index) -> Index:
    """Number of the row of every point, 0 to p^2 - 1, where rows run along an edge of each brick, shape (m, q).

    Parameters
    ----------
    place : integration points in the reference cube, p along each edge, shape (3, q)
    edge : along which the rows of every brick run, 0 to 2, shape (m,)
    """
    # by rank among the p values of each coordinate, which rounding to nine digits makes equal
    rank = np.array([np.unique(np.round(x, 9), return_inverse=True)[1] for x in place])
    p = int(rank.max()) + 1
    # points of one row agree in the two other coordinates
    return np.asarray(np.array([p * rank[a] + rank[b] for a, b in ((1, 2), (0, 2), (0, 1))])[edge])


def across_cracks(faces: Index, centre: Array, normal: Array, cracks: Flags) -> tuple[Index, Index]:
    """Pairs of cracked bricks that touch along the normals of both their cracks, and the stacks that they make.

    Parameters
    ----------
    faces : bricks on both sides of every face, -1 for none, shape (2, f)
    centre : middles of the bricks [m], shape (m, 3)
    normal : normals of their cracks, shape (m, 3)
    cracks : bricks that count, shape (m,)

    Returns
    -------
    pairs, shape (p, 2), and the number of the stack of every brick, shape (m,): a brick without a pair has its own
    """
    pairs = faces[:, faces[1] >= 0].T
    pairs = pairs[cracks[pairs].all(axis=1)]
    way = centre[pairs[:, 1]] - centre[pairs[:, 0]]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    tied = pairs[(np.abs(np.einsum("pki,pi->pk", normal[pairs], way)) > ALONG).all(axis=1)]
    graph = coo_array((np.ones(len(tied)), tuple(tied.T)), shape=(len(centre), len(centre)))
    return tied, np.asarray(connected_components(graph, directed=False)[1])


def _of_one(c: Curves, opening: Array, width: Array) -> Array:
    """Energy per area of one crack of an opening [J/m2], shape (n,), zero where nothing has opened.

    Its strain past the strength, s x, follows from s x + (1 - exp(-x)) ft / E = w / h, by Newton's method from below:
    the left side flattens, so that no step goes past the solution.

    Parameters
    ----------
    c : curve of every crack, s its softening strain
    opening : w [m], shape (n,)
    width : h of the crack band [m], shape (n,)
    """
    out = np.zeros(len(opening))
    # a material of infinite strength has no crack
    rows = np.flatnonzero((opening > 0.0) & np.isfinite(c.tension))
    ft, scale, h = c.tension[rows], c.softening[rows], width[rows]
    first, target = ft / c.modulus[rows], opening[rows] / width[rows]  # ft / E and w / h
    x = np.zeros(len(rows))
    for _ in range(_ITERATIONS):
        step = (target - scale * x - first * (1.0 - np.exp(-x))) / (scale + first * np.exp(-x))
        x += step
        if (np.abs(step) <= _EXACT * np.maximum(x, _EXACT)).all():
            break
    left = ft * np.exp(-x)
    # area of the triangle to ft and of the exponential, less what unloading from the stress that is left gives back
    out[rows] = h * (0.5 * ft * first + scale * (ft - left) - 0.5 * left * (first + scale * x))
    return out
