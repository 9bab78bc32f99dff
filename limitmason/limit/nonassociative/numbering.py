"""One order of blocks, points and tangents, read off the geometry.

Searches for non-associative states are local: they end where the order of rows and columns leads them. In an order
that the geometry gives, the same structure leads to the same end however it was written down.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Index
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw
from limitmason.limit.program.static_theorem import Problem

CLOSE = 1e-6
"""Coordinates that differ by less than this part of the structure's size are equal [-]."""

DIGITS = 40
"""Binary digits kept of every entry: sums in another order differ in the last ones of 52."""


class Numbering(NamedTuple):
    """Geometric order of a problem: row k is its row ``row[k]``, and so for points.

    ``sign`` (r,) reverses the rows that a mirror reverses. ``turn`` (m, c - 1, c - 1) leads from the tangents of the
    problem's points, in geometric order, to tangents that depend on the face alone.
    """

    row: Index  # (r,)
    sign: Array  # 1 or -1, (r,)
    point: Index  # (m,)
    turn: Array  # (m, c - 1, c - 1)

    def law(self, law: JointLaw) -> JointLaw:
        """The joint law in this order, rounded so that equal structures give equal arrays."""
        c = law.components
        # rows in their order with their sign, points in theirs, and the tangents of each turned to those of its face
        column = (c * self.point[:, None] + np.arange(c)).ravel()
        matrix = sparse.diags_array(self.sign) @ law.matrix.tocsr()[self.row][:, column] @ self._blocks(c).T
        matrix = sparse.csc_array(matrix)
        matrix.data = _rounded(matrix.data)
        matrix.eliminate_zeros()
        matrix.sort_indices()
        live = _rounded(self.sign * law.live[self.row])
        p = self.point
        return law._replace(
            matrix=matrix, dead=_rounded(self.sign * law.dead[self.row]), live=live, tan_phi=law.tan_phi[p],
            tan_psi=law.tan_psi[p], tension=_rounded(law.tension[p]), cohesion=_rounded(law.cohesion[p]),
            crushing=_rounded(law.crushing[p]), live_size=math.fsum(np.abs(live)),
        )

    def back(self, law: JointLaw, state: ForceState) -> ForceState:
        """A ``state`` of the reordered law as a state of ``law``, the problem's own."""
        c = law.components
        force, velocity = np.empty_like(state.force), np.empty_like(state.velocity)
        turned = self._blocks(c).T @ state.force
        force.reshape(-1, c)[self.point] = turned.reshape(-1, c)
        velocity[self.row] = self.sign * state.velocity
        return ForceState(state.multiplier, force, velocity)

    def _blocks(self, components: int) -> sparse.csr_array:
        """Turn of the force components of every point, block diagonal, shape (c m, c m)."""
        m = len(self.point)
        blocks = np.zeros((m, components, components))
        blocks[:, 0, 0] = 1.0
        blocks[:, 1:, 1:] = self.turn
        return sparse.csr_array(
            sparse.bsr_array((blocks, np.arange(m), np.arange(m + 1)), shape=(components * m, components * m))
        )


def numbering(problem: Problem, *, mirrored: bool = False) -> Numbering:
    """Order of a problem by coordinates of blocks, then of points, then of faces.

    Parameters
    ----------
    problem : from :func:`limitmason.limit.program.static_theorem.make_problem`
    mirrored : the order of the mirror image across x, or across the horizontal axis of a plane problem

    Returns
    -------
    Numbering: blocks and points by their first coordinate, then the second, then the third.

    Notes
    -----
    Coordinates count as equal within ``CLOSE`` of the structure's size. Blocks of one centroid (one inside another)
    fall back on their volume, then on their number. A plane problem keeps its order when it is turned about the
    vertical; in 3-D a turned structure has another order.
    """
    x, plane, points = problem.assembly.links, problem.plane, problem.points
    axes = np.eye(3) if plane is None else np.stack([plane.axis_1, plane.normal, plane.axis_2])  # rows: x, y, z
    # of every degree of freedom of a block: forces, then moments
    row_sign = np.ones(6 if plane is None else 3)
    if mirrored:
        axes[0] *= -1.0
        # a mirror across x turns forces along x, and moments about y and z
        row_sign = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0] if plane is None else [-1.0, 1.0, -1.0])
    size = float(np.ptp(x.corners, axis=0).max(initial=0.0)) or 1.0
    # ``lexsort`` takes the least important key first
    blocks = np.lexsort((_ranks(x.volume, CLOSE * size**3), *_keys(x.centroid @ axes.T, size)))
    place = np.empty(len(blocks), dtype=np.intp)  # of every block in the new order
    place[blocks] = np.arange(len(blocks))
    freedom = problem.row % len(row_sign)
    row = np.lexsort((freedom, place[problem.row // len(row_sign)]))
    directions = points.directions @ axes.T
    # the sense of a face's normal depends on which of its blocks comes first: here its first component is positive
    sign = _first_sign(directions[:, 0])
    normal = sign[:, None] * directions[:, 0]
    centre = x.centre[points.interface] @ axes.T
    point = np.lexsort((*_keys(normal, 1.0), *_keys(centre, size), *_keys(points.position @ axes.T, size)))
    if plane is not None:
        # along the face in the sense of the plane's rotation, which the mirror reverses
        turn = np.full((len(point), 1, 1), -1.0 if mirrored else 1.0)
        return Numbering(row, row_sign[freedom[row]], point, turn)
    # first tangent: horizontal, or on a level face the projection of x, as "horizontal" says nothing there
    up, along = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    level = np.abs(normal[:, 2]) > 1.0 - CLOSE
    first = np.where(level[:, None], along - normal[:, :1] * normal, np.cross(up, normal))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    tangents = np.stack([first, np.cross(normal, first)], axis=1)
    # exchanging the two blocks of a face reverses its normal and the force on the second block alike
    turn = sign[:, None, None] * np.einsum("pik,pjk->pij", tangents, directions[:, 1:])
    return Numbering(row, row_sign[freedom[row]], point, turn[point])


def _keys(coordinates: Array, size: float) -> list[Index]:
    """Keys for ``lexsort`` of ``coordinates`` (n, 3), equal within ``CLOSE`` ``size``."""
    return [_ranks(coordinates[:, k], CLOSE * size) for k in (2, 1, 0)]


def _ranks(values: Array, tolerance: float) -> Index:
    """Rank of every one of ``values`` (n,) among the distinct ones, shape (n,).

    Values closer than the ``tolerance``, in their unit, to the next share a rank.
    """
    order = np.argsort(values, kind="stable")
    rank = np.empty(len(values), dtype=np.intp)
    rank[order] = np.concatenate([[0], np.cumsum(np.diff(values[order]) > tolerance)]) if len(values) else 0
    return rank


def _first_sign(vectors: Array) -> Array:
    """Sign, 1 or -1, of the first component not zero of ``vectors`` (m, 3), (m,)."""
    first = np.argmax(np.abs(vectors) > CLOSE, axis=1)
    return np.where(vectors[np.arange(len(vectors)), first] < 0.0, -1.0, 1.0)


def _rounded(values: Array) -> Array:
    """``values`` to :data:`DIGITS` binary digits, zero where as small beside the rest.

    Infinite ones (joints that do not crush) stay.
    """
    finite = np.isfinite(values)
    mantissa, exponent = np.frexp(np.where(finite, values, 0.0))
    kept = np.ldexp(np.round(np.ldexp(mantissa, DIGITS)), exponent - DIGITS)
    largest = np.abs(kept).max(initial=0.0)
    kept[np.abs(kept) < 2.0**-DIGITS * largest] = 0.0
    return np.where(finite, kept, values)
