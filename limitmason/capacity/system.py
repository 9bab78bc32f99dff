"""The structure as equations: residual, bordered tangent and sparse patterns, in units of weight and elastic length.

Shapes of blocks that deform are unknowns like the motions, each held by a spring of its own, K q.

Forces are counted in mean block weights, moments in that times a block's size, motions in the elastic length (the
mean weight over the mean stiffness of a contact point) and that over the size: in newtons and metres an interior point
stalls at 1e-5 of a block's weight.
"""

from copy import copy
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from limitmason.arrays import Array, Index
from limitmason.capacity.bordered_factors import ROUNDED, FrontFactors, determinant_sign
from limitmason.capacity.kinematics import (
    Contact,
    ContactGeometry,
    Pose,
    at_rest,
    block_wrenches,
    contact,
    geometric_stiffness,
    motion_between,
    moved,
    point_wrenches,
    shape_geometry,
)
from limitmason.capacity.path_loads import PathLoads
from limitmason.capacity.point_law import ElastoplasticLaw, PlasticHistory, Returned, return_map, virgin
from limitmason.capacity.ties import Pulled, pull, stiffness
from limitmason.mechanics.tie_springs import NO_TIES, TieSprings
from limitmason.multifrontal.unsymmetric import UnsymmetricFronts

_STILL = 1e-9
"""Displacement of the control over the largest motion, in own units, up to which it is rounding [-]."""


class Evaluated(NamedTuple):
    """A pose with the stresses that the law gives there, wrenches, and the unbalance at a multiplier, in own units."""

    pose: Pose
    contact: Contact
    wrenches: Array  # (m, c, 2, d)
    returned: Returned
    multiplier: float
    force: Array  # [N], (m, c)
    pulled: Pulled
    residual: Array  # own units, free degrees of freedom
    control: float  # control displacement of the pose [m]

    @property
    def unbalance(self) -> float:
        """Largest unbalanced force or moment, in mean block weights."""
        return float(np.abs(self.residual).max(initial=0.0))


class System:
    """Joints, loads and the control of one path.

    Parameters
    ----------
    bodies, law : contact points and what they carry
    loads : dead and live, on the degrees of freedom
    control : weights of the rigid degrees of freedom in the control displacement, shape (n, d - k)
    weight, size, length : units of force [N], of arms [m] and of displacement [m]: mean weight of a block, its median
        size, and the elastic length
    springs : stiffness of the shapes' coordinates [N/m], shape (n, k); 0 where a block has none
    ties : rods between blocks that are rigid

    Attributes
    ----------
    order : number of the free degrees of freedom, the unknowns beside the multiplier
    row_scale, motion_scale : from newtons, and to metres and radians, from own units, shape (d,)
    control_own, springs_own : ``control`` and ``springs`` in own units on the unknowns, shape (order,)
    ends, tie_ends : unknowns of both blocks of every point, (m, 2, d), and tie, (t, 2, d); -1 for held ones
    starts : first point of every run of points between the same two blocks, shape (runs,)
    """

    def __init__(
        self, bodies: ContactGeometry, law: ElastoplasticLaw, loads: PathLoads, control: Array, weight: float,
        size: float, length: float, springs: Array, ties: TieSprings = NO_TIES,
    ) -> None:
        """Number the free degrees of freedom and make the pattern of the bordered tangent."""
        self.loads, self.control = loads, np.hstack([control, np.zeros_like(springs)])
        self.bodies, self.law, self.springs, self.ties = bodies, law, springs, ties
        self.weight, self.size, self.length = weight, size, length
        free = bodies.free
        self.order = int(free.sum())
        number = np.full(free.shape, -1, np.intp)  # unknown of every degree of freedom, -1 where it is held
        number[free] = np.arange(self.order)
        turns = np.abs(bodies.basis[3:6]).max(axis=0) > 0.5  # of a basis of unit vectors: turns, and not shifts
        self.row_scale = np.where(turns, 1.0 / (weight * size), 1.0 / weight)
        self.motion_scale = np.where(turns, self.length / size, self.length)
        self._scale = self.row_scale[:, None] * self.motion_scale  # of stiffnesses to own units, shape (d, d)
        # what every iteration asks for and does not change: scale of an element, places of the free degrees of freedom
        self._element_scale, self._free = np.tile(self._scale, (2, 2)), np.flatnonzero(free)
        self._axes, self._freedoms = (0,) * bodies.directions.shape[1], (0,) * free.shape[1]
        self.control_own = (self.control * self.motion_scale)[free] / self.length
        self.springs_own = (np.hstack([np.zeros_like(control), springs]) * self.length / weight)[free]
        self.ends = np.stack([number[bodies.block_a], number[bodies.block_b]], axis=1)  # (m, 2, d)
        # points come joint by joint: one element per run of points between the same two blocks
        pair = bodies.block_a * len(free) + bodies.block_b
        self.starts = np.flatnonzero(np.diff(pair, prepend=-1))
        length_of_run = np.diff(np.append(self.starts, len(pair)))
        place = np.arange(length_of_run.max(initial=0))
        # numbers of the points of every run, filled up with -1, shape (runs, longest)
        self._of_run = np.where(place < length_of_run[:, None], self.starts[:, None] + place, -1)
        self.tie_ends = np.stack([number[ties.block_a], number[ties.block_b]], axis=1)  # (t, 2, d)
        ends = np.concatenate([self.ends[self.starts], self.tie_ends])
        self._tangent_pattern(ends.reshape(len(ends), -1), number[loads.turning])
        # row of what is prescribed and the corner behind it
        self._borders = {
            "control": np.append(self.control_own, 0.0), "multiplier": np.append(np.zeros(self.order), 1.0),
        }
        self._untied = None if len(ties.length) else pull(ties, bodies.basis[:6], self.at_rest(), np.zeros(0))

    def _tangent_pattern(self, *dofs: Index) -> None:
        """Where every entry goes in the bordered matrix.

        In the order of :meth:`tangent`: elements, loads that turn, diagonal, column of the live load, row of the
        control, corner.

        Parameters
        ----------
        dofs : unknown of every row of every element, and of every block with loads that turn, -1 for held ones, shapes
            (k, size)
        """
        order = self.order
        rows = np.concatenate([np.repeat(x, x.shape[1], axis=1).ravel() for x in dofs])
        columns = np.concatenate([np.tile(x, (1, x.shape[1])).ravel() for x in dofs])
        keep = (rows >= 0) & (columns >= 0)
        own = np.arange(order)
        rows = np.concatenate([rows[keep], own, own, np.full(order, order), [order]])
        columns = np.concatenate([columns[keep], own, np.full(order, order), own, [order]])
        # by columns, then rows, as a compressed column matrix stands; one slot for entries at one place
        key, slot = np.unique(columns * (order + 1) + rows, return_inverse=True)
        indptr = np.searchsorted(key, np.arange(order + 2) * (order + 1))
        # slots of the elements' entries (_slot), and of loads that turn (_turning), -1 for those of held blocks; _rest
        own_slot = np.full(len(keep), -1)
        own_slot[keep], self._rest = slot[: keep.sum()], slot[keep.sum() :]
        self._slot, self._turning = np.split(own_slot, [len(dofs[0]) * dofs[0].shape[1] ** 2])
        self._fronts: UnsymmetricFronts | None = None
        indices, indptr = (key % (order + 1)).astype(np.int32), indptr.astype(np.int32)
        self._pattern = sparse.csc_matrix((np.zeros(len(key)), indices, indptr), shape=(order + 1,) * 2)

    def evaluate(self, pose: Pose, old: PlasticHistory, multiplier: float) -> Evaluated:
        """Stresses, wrenches and unbalance in a pose reached from a history.

        The residual is in block weights, zero in equilibrium; ``old`` is the history before the step.

        Parameters
        ----------
        multiplier : of the live load [-]
        """
        at = contact(self.bodies, pose)
        wrenches = point_wrenches(self.bodies, at)
        returned = return_map(self.law, old, at.displacement)
        force = returned.stress * self.bodies.area[:, None]
        pulled = self._untied
        if pulled is None:
            pulled = pull(self.ties, self.bodies.basis[:6], pose, old.stretched)
            returned = returned._replace(history=returned.history._replace(stretched=pulled.plastic))
        rest = self.unbalanced(pose, wrenches, force, pulled, multiplier)
        return Evaluated(pose, at, wrenches, returned, multiplier, force, pulled, rest, self.controlled(pose))

    def unbalanced(self, pose: Pose, wrenches: Array, force: Array, pulled: Pulled, multiplier: float) -> Array:
        """What loads, point forces, ties and springs leave over on the free motions, own units, shape (order,).

        Parameters
        ----------
        pose : where the blocks are
        pulled : tensions of the ties there
        wrenches : of unit forces on the two blocks of every point, shape (m, c, 2, d)
        force : of every point [N], shape (m, c)
        multiplier : of the live load [-]
        """
        dead, live = self.loads.at(pose)
        total = block_wrenches(self.bodies, wrenches, force) + dead + multiplier * live
        if self._untied is None:
            for side, block in enumerate((self.ties.block_a, self.ties.block_b)):
                np.add.at(total, block, pulled.tension[:, None] * pulled.wrenches[:, side])
        if self.bodies.deforming:
            total[:, -self.bodies.deforming :] -= self.springs * pose.shapes
        return (total * self.row_scale).take(self._free)

    def applied(self, pose: Pose) -> tuple[Array, Array]:
        """Dead and live loads on the free degrees of freedom in a pose, own units, shape (order,) each."""
        dead, live = self.loads.at(pose)
        return (dead * self.row_scale).take(self._free), (live * self.row_scale).take(self._free)

    def relative(self, at: Evaluated, own: Array) -> tuple[Array, Array]:
        """Displacement of points, (m, c), and elongation of ties, (t,), in [m] each, by a small motion of the blocks.

        It is linear about the pose ``at``. ``own`` are motions of the free degrees of freedom in own units, shape
        (order,). Displacements are of b against a, positive where a point opens.
        """
        from limitmason.capacity import compiled

        # virtual work: forces of a point push its blocks apart; a tie pulls them together, hence its minus
        motion, b = self._motion(own), self.bodies
        displaced = np.empty(at.force.shape)
        compiled.relative(b.block_a, b.block_b, at.wrenches, motion, displaced)
        if self._untied is not None:
            return displaced, self._untied.elongation
        ends_of_ties = np.stack([motion[self.ties.block_a], motion[self.ties.block_b]], axis=1)
        return displaced, -np.einsum("tsd,tsd->t", at.pulled.wrenches, ends_of_ties)

    def virgin(self) -> PlasticHistory:
        """The history of joints and ties that nothing has happened to."""
        return virgin(*self.bodies.directions.shape[:2])._replace(stretched=np.zeros(len(self.ties.length)))

    def at_rest(self) -> Pose:
        """The unstressed pose."""
        return at_rest(*self.springs.shape)

    def sprung(self, pose: Pose) -> Array:
        """Forces of the blocks' own deformation on the free degrees of freedom, own units, shape (order,)."""
        motion = np.hstack([np.zeros((len(pose.shapes), len(self.row_scale) - pose.shapes.shape[1])), pose.shapes])
        return np.asarray(-self.springs_own * motion[self.bodies.free] / self.length)

    def controlled(self, pose: Pose) -> float:
        """The control displacement of a pose [m], of which only shifts count."""
        shift = pose.shift @ self.bodies.basis[:3]
        return float((self.control * shift).sum())

    def far(self, before: Pose, after: Pose) -> float:
        """How far all free blocks move from one pose to another, root of the sum of squares [m].

        Turns count by arms of the size of a block.
        """
        own = motion_between(before, after) @ self.bodies.basis * (self.length / self.motion_scale)
        return float(np.linalg.norm(own[self.bodies.free]))

    def advanced(self, pose: Pose, own: Array) -> Pose:
        """The pose after a motion in own units of the free degrees of freedom."""
        return moved(pose, self._motion(own) @ self.bodies.basis.T)

    def _motion(self, own: Array) -> Array:
        """Motion of all degrees of freedom, shape (n, d), of the free ones in own units."""
        motion = np.zeros(self.bodies.free.shape)
        motion.ravel()[self._free] = own
        return motion * self.motion_scale

    def bordered(self, at: Evaluated, prescribed: str, viscosity: Array | float = 0.0) -> FrontFactors | SuperLU:
        """Factors of the tangent, bordered by the control row, or by lambda = constant ("multiplier").

        Unknowns: motion and multiplier in own units; equations: equilibrium, and what is prescribed.

        Parameters
        ----------
        prescribed : "control" or "multiplier", which is kept
        viscosity : eta of a viscous force in own units, one or of every unknown
        """
        return self._factored(self._entries(at, prescribed, viscosity))

    def _factored(self, value: Array) -> FrontFactors | SuperLU:
        """Factors of a matrix of the pattern by its entries, (nnz,): large ones by fronts."""
        if not self.bodies.large:
            return self._pivoted(value)
        if self._fronts is None:  # the pattern stays, so that its order is looked for once
            count = self.bodies.free.sum(axis=1)
            has = count > 0
            node = np.repeat(np.arange(has.sum()), count[has])
            self._fronts = UnsymmetricFronts(self._pattern, node, self.bodies.centroid[has])
        factors = self._fronts.factors(value)
        return self._pivoted(value) if factors is None else FrontFactors(value, self._fronts, *factors, self._pivoted)

    def _pivoted(self, value: Array) -> SuperLU:
        """Sparse factors of a bordered tangent by its entries, with rows exchanged wherever that is called for."""
        # the order is for pivots on the diagonal: elements of blocks that deform are so wide that leaving it for every
        # larger entry fills the factors to twice the size, in four times the time, and they solve no better
        worth_leaving = 0.1 if self.bodies.deforming or self.bodies.large else 1.0
        return splu(self._matrix(value), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=worth_leaving)

    def along_tangent(self, at: Evaluated, move: float) -> Array | None:
        """Motion and multiplier, own units, by which the tangent goes on over a control displacement [m].

        Shape (order + 1,), the multiplier last. None where the tangent is singular.
        """
        try:
            step = self.bordered(at, "control").solve(np.append(np.zeros(self.order), move / self.length))
        except RuntimeError:
            return None
        return step if np.isfinite(step).all() else None

    def driven(self, at: Evaluated) -> bool:
        """Whether a little live load moves the control at ``at``, True where the tangent is singular."""
        try:
            motion = self.bordered(at, "multiplier").solve(np.append(np.zeros(self.order), 1.0))[:-1]
        except RuntimeError:
            return True
        return not abs(float(self.control_own @ motion)) <= _STILL * float(np.abs(motion).max(initial=0.0))

    def sense(self, at: Evaluated, prescribed: str) -> int:
        """Sign of the determinant of the bordered tangent at ``at``, or 0 where it is singular.

        ``prescribed`` is "control" or "multiplier", which is kept.
        """
        value = self._entries(at, prescribed)
        try:
            factors = self._factored(value)
            if isinstance(factors, FrontFactors):
                if factors.corrected(np.ones(self.order + 1))[1] <= ROUNDED:
                    return factors.fronts.sense(factors.store, factors.exchanged)
                factors = self._pivoted(value)
        except RuntimeError:
            return 0
        return determinant_sign(factors)

    def tangent(self, at: Evaluated, prescribed: str, viscosity: Array | float = 0.0) -> sparse.csc_matrix:
        """The matrix of :meth:`bordered`, with an eta of viscous force in own units, one or of every unknown.

        Parameters
        ----------
        at, prescribed : the pose, and "control" or "multiplier", which is kept
        """
        return self._matrix(self._entries(at, prescribed, viscosity))

    def _matrix(self, value: Array) -> sparse.csc_matrix:
        """The matrix of the pattern with these entries, (nnz,)."""
        made = copy(self._pattern)  # shares its indices: a matrix made anew would check them again
        made.data = value
        return made

    def _entries(self, at: Evaluated, prescribed: str, viscosity: Array | float = 0.0) -> Array:
        """Entries of :meth:`tangent` in the order of the pattern, shape (nnz,)."""
        element = self._deforming_elements(at) if self.bodies.deforming else self._elements(at)
        if self._untied is None:
            element = np.concatenate([element, stiffness(at.pulled, self.bodies.basis[:6])])
        values = self._summed(element)
        viscous = -self.springs_own - viscosity
        # every place once
        values[self._rest] += np.concatenate([viscous, self.applied(at.pose)[1], self._borders[prescribed]])
        if len(self._turning):
            turned = self.loads.load_tangent(at.pose, at.multiplier) * self._scale
            moves = self._turning >= 0
            values[self._turning[moves]] += turned.ravel()[moves]
        return values

    def _summed(self, element: Array) -> Array:
        """Entries of the tangent, own units, by elements in newtons and metres, (k, 2 d, 2 d)."""
        from limitmason.capacity import compiled

        values = np.zeros(self._pattern.nnz)
        compiled.assembled(element, self._element_scale, self._slot, values)
        return values

    def _elements(self, at: Evaluated) -> Array:
        """Derivative of the wrenches by the motions, per run of points between two rigid blocks, (k, 2 d, 2 d)."""
        from limitmason.capacity import compiled

        d = len(self._freedoms)
        out, law = np.empty((len(self.starts), 2 * d, 2 * d)), at.returned
        compiled.elements(
            self._axes, self._freedoms, self.bodies.area, at.wrenches, law.tangent, self.starts, out
        )
        return out + geometric_stiffness(self.bodies, at.contact, at.force, self.starts)

    def _deforming_elements(self, at: Evaluated) -> Array:
        """Stiffness between the two blocks of every run, which deform, shape (runs, 2 d, 2 d).

        A run is the points of one pair of blocks, which follow each other. Elements are wide, so that one product per
        run is faster than one per point. Forces that turn with the blocks add terms to the rigid degrees of freedom and
        to their coupling with the shapes.
        """
        b, d = self.bodies, self.bodies.basis.shape[1]
        r = d - b.deforming
        m, c = at.force.shape
        runs, most = self._of_run.shape
        flat = at.wrenches.reshape(m, c, 2 * d)
        stiff = (b.area[:, None, None] * at.returned.tangent) @ flat
        # points of a run numbered -1 take the last row, which is nothing
        left = np.concatenate([flat, np.zeros((1, c, 2 * d))])[self._of_run].reshape(runs, most * c, 2 * d)
        right = np.concatenate([stiff, np.zeros((1, c, 2 * d))])[self._of_run].reshape(runs, most * c, 2 * d)
        element = -left.transpose(0, 2, 1) @ right
        rigid = geometric_stiffness(b, at.contact, at.force, self.starts)
        moments = [np.add.reduceat(x, self.starts, axis=0) for x in shape_geometry(at.contact, at.force)]
        parts = [np.s_[:r], np.s_[d : d + r]]
        for i in (0, 1):
            for j in (0, 1):
                element[:, parts[i], parts[j]] += rigid[:, i * r : (i + 1) * r, j * r : (j + 1) * r]
            spin = b.basis[3:6, :r].T @ moments[i]
            element[:, parts[i], d + r :] += spin
            element[:, d + r :, parts[i]] += spin.transpose(0, 2, 1)
        return np.asarray(element)
