"""Power that the joints of a mechanism dissipate under the associative law, point by point and over whole faces.

``twists`` are those of every block [m/s, rad/s], shape (n, 6).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from limitmason.answers.results import Prediction, Resultants
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.geometry.slip_integrals import slip_integrals
from limitmason.mechanics.law import PointLaw, interface_law
from limitmason.mechanics.residuals import PointState
from limitmason.mechanics.rigid_motion import velocity
from limitmason.mechanics.stress_block import stress_blocks_of
from limitmason.model.assembly import Assembly


def point_rates(assembly: Assembly, twists: Array, position: Array, interface: NDArray) -> tuple[Array, Array]:
    """Opening (m,) and sliding (m, 3) of b relative to a at contact points, in global axes [m/s].

    Parameters
    ----------
    twists : of every block [m/s, rad/s], shape (n, 6)
    position : of the points [m], shape (m, 3)
    interface : number of the joint or tie of each, shape (m,)
    """
    x = assembly.links
    a, b = x.block_a[interface], x.block_b[interface]

    c = assembly.centroids
    jump = velocity(c, twists, b, position) - velocity(c, twists, a, position)
    n = x.normal[interface]
    opening = (jump * n).sum(axis=1)
    return opening, jump - opening[:, None] * n


def along_tangents(assembly: Assembly, faces: NDArray, vectors: Array) -> Array:
    """Components of vectors, shape (m, 3), along both tangents of one of the ``faces`` each, shape (m, 2)."""
    x = assembly.links
    return np.column_stack([(vectors * t[faces]).sum(axis=1) for t in (x.tangent_1, x.tangent_2)])


def face_slip(assembly: Assembly, twists: Array, faces: NDArray) -> tuple[Array, Array]:
    """How whole faces slide, b against a: slip of their centroids along the tangents, and spin about the normal.

    Parameters
    ----------
    twists : of every block [m/s, rad/s], shape (n, 6)
    faces : numbers of the interfaces, shape (m,)

    Returns
    -------
    slip : [m/s], shape (m, 2)
    spin : [rad/s], shape (m,)
    """
    x = assembly.links
    _, at_centre = point_rates(assembly, twists, x.centre[faces], faces)
    spin = ((twists[x.block_b[faces], 3:] - twists[x.block_a[faces], 3:]) * x.normal[faces]).sum(axis=1)
    return along_tangents(assembly, faces, at_centre), spin


def point_state(assembly: Assembly, resultants: Resultants, twists: Array, *, convex: bool = True) -> PointState:
    """Forces, rates and strengths at the contact points of a prediction.

    Parameters
    ----------
    resultants : with the force at every point
    twists : of every block [m/s, rad/s], shape (n, 6)
    convex : as of :func:`limitmason.mechanics.law.interface_law`
    """
    x = assembly.links
    k = resultants.point_interface
    n = x.normal[k]
    normal_force = (resultants.point_force * n).sum(axis=1)
    opening, sliding = point_rates(assembly, twists, resultants.point_position, k)
    return PointState(
        normal_force, resultants.point_force - normal_force[:, None] * n, opening, sliding,
        interface_law(x, convex=convex).at(k).over(resultants.point_area),
    )


def point_dissipation(law: PointLaw, opening: Array, sliding: Array) -> tuple[Array, Array]:
    """Power that points dissipate under the associative law [W], (m,), and their free opening g [m/s], (m,).

    The free opening g = e_n - tan(phi) |e_t| is the opening beyond the dilation of its slip. Without crushing g < 0 is
    inadmissible, see :meth:`limitmason.mechanics.law.PointLaw.dissipation`.

    Parameters
    ----------
    law : capacities of the points [N]
    opening : e_n [m/s], shape (m,)
    sliding : e_t [m/s], shape (m, 3)
    """
    slip = np.linalg.norm(sliding, axis=1)
    return law.dissipation(opening, slip), law.free_opening(opening, slip)


class Dissipation:
    """The joint law of a prediction as the power that any motion of its blocks dissipates.

    Faces with cohesion between rigid blocks in space are integrated in closed form, D = N_t e_n + (c - tan(phi) t) A
    integral of |s|, where t is the tension per area: e_n is linear and |s| convex, so that the flow rule holds all over
    a face when it holds at its corners. Cohesion lumped at points would dissipate more in torsion (at corners 0.7071
    instead of 0.3826 c a^3 on a square), for it may not gather there as friction may. That holds for the points of a
    grid as well, of which only crushing is summed over the points. Plane problems, whose slip is uniform, are summed.

    Parameters
    ----------
    assembly : the structure
    prediction : with forces at contact points and the contact model that they follow
    state : its points, see :func:`point_state`

    Attributes
    ----------
    pairs : stress blocks of in-plane sections, None without
    rigid : points that do not crush, shape (m,)
    _faces : numbers of the faces that are integrated, shape (f,)
    _start, _corners : their corners along both tangents from the centroid [m], from _start[k] on those of face k
    _cohesion, _lumped : shear strength at the tension corner of these faces [Pa], and of every point on them [N]
    """

    def __init__(self, assembly: Assembly, prediction: Prediction, state: PointState) -> None:
        """Find the joints whose crushing or cohesion is not that of their points alone."""
        resultants = prediction.resultants
        if resultants is None:
            raise InputError("a prediction without joint forces says nothing about its joints")
        self._assembly, self._resultants, self.state = assembly, resultants, state
        # ends of in-plane sections with an exact stress block crush as a pair
        self.pairs = stress_blocks_of(assembly, prediction)
        self.rigid = ~state.law.crushes
        if self.pairs is not None:
            self.rigid[self.pairs.ends] = False
        x, k, law = assembly.links, resultants.point_interface, interface_law(assembly.links)
        # faces that are integrated: with cohesion, and with points; not in plane, where the slip is uniform
        whole = (law.cohesion > 0) & (np.bincount(k, minlength=len(x.area)) > 0)
        if prediction.plane:
            whole[:] = False
        f = self._faces = np.flatnonzero(whole)
        if len(f):
            # first corner of each of these faces, and after them the number of corners
            self._start = np.concatenate([[0], np.cumsum(np.diff(x.corner_start)[f])])
            # corners along t1, t2 from the centre [m]
            rows = np.flatnonzero(whole[x.corner_owner])
            owner = x.corner_owner[rows]
            self._corners = along_tangents(assembly, owner, x.corners[rows] - x.centre[owner])
            # shear strength at the tension corner [Pa], and what it gives at every contact point [N]
            self._cohesion = law.at(f).corner_cohesion
            lumped = np.zeros(len(x.area))
            lumped[f] = self._cohesion
            self._lumped = lumped[k] * resultants.point_area

    def rates(self, twists: Array) -> tuple[Array, Array]:
        """Opening and sliding of the contact points, see :func:`point_rates`."""
        r = self._resultants
        return point_rates(self._assembly, twists, r.point_position, r.point_interface)

    def power(self, twists: Array) -> tuple[float, float, Array]:
        """Power that a motion dissipates, over whole faces and as summed over the contact points.

        Parameters
        ----------
        twists : of every block [m/s, rad/s], shape (n, 6)

        Returns
        -------
        power over whole faces [W], the same summed over the points [W], and g = e_n - tan(phi) |e_t| of every point
        [m/s], shape (m,)
        """
        opening, sliding = self.rates(twists)
        law = self.state.law
        if self.pairs is None:
            power, g = point_dissipation(law, opening, sliding)
            total = float(power.sum())
        else:
            # at the ends of sections points give the power of cohesion, the stress blocks that of the normal force
            ends = self.pairs.ends
            power, g = point_dissipation(law.without_crushing(ends), opening, sliding)
            slip = np.linalg.norm(sliding, axis=1)
            others = np.ones(len(g), dtype=bool)
            others[ends] = False
            # tension and friction of the ends are in the pairs' power: cohesion c |s| is left
            total = float(power[others].sum() + (law.cohesion * slip)[ends].sum())
            total += float(self.pairs.power(g[ends]).sum())
        return total + self.spread(twists, sliding), total, g

    def spread(self, twists: Array, sliding: Array) -> float:
        """Power of cohesion spread over faces, less that of cohesion lumped at points [W].

        The part that tension explains, N_t e_n, is left out: e_n is linear, and the points keep area and centroid.

        Parameters
        ----------
        twists : of every block [m/s, rad/s], shape (n, 6)
        sliding : of every point [m/s], shape (m, 3)
        """
        if not len(self._faces):
            return 0.0
        # a face slides by the slip of its centre and its spin about the normal: |slip| is integrated over its polygon
        whole = self._cohesion * slip_integrals(
            self._corners, self._start, *face_slip(self._assembly, twists, self._faces)
        )
        return float(whole.sum() - (self._lumped * np.linalg.norm(sliding, axis=1)).sum())
