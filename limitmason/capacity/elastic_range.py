"""How far a load goes before a joint point first reaches its strength: elastic joints, by superposition, no rate.

Up to there the joints hold everywhere, so that stresses are linear in the loads: s = s_dead + lambda s_live at every
point, from one factorisation. What a point can bear is a range of lambda; the range of the structure is what all points
have in common. No steps, no speed and no tolerance enter: the check of what driven runs call their first failure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from limitmason.arrays import Array
from limitmason.capacity.contacts import points_of_path
from limitmason.capacity.deformable import lumped, plane_of
from limitmason.capacity.point_range import CRITERIA, point_range
from limitmason.deformable.levels import LUMPED, RIGID, RITZ, SIMPLY_DEFORMABLE
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.contact_points import ContactPoints, Grid
from limitmason.mechanics.default_stiffness import joint_stiffness
from limitmason.mechanics.equilibrium import degrees_of_freedom
from limitmason.mechanics.joint_shapes import shapes_of, soft_block_warnings
from limitmason.mechanics.law import PointLaw, interface_law
from limitmason.mechanics.law_table import refuse_ties
from limitmason.mechanics.lumped_units import with_lumped_units
from limitmason.mechanics.stiffness_matrix import stiffness_matrix
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.frozen import ReadOnly

_NOTHING = 1e-9
"""Of the largest stress that a load makes: below is none. Blocks moved by 1e-12 m make 1e-12, rounding alone 5e-15."""

_ROUNDED = 2e-14
"""The same for each size of the model between it and the origin: what is rounded in map coordinates."""

_SAME = 1e-9
"""Part of a stiffness, of an area, or of the model's size, by which two that are equal may differ [-]: rounding."""

_FREE = 1e-12
"""Least over largest pivot of the scaled stiffness below which a block is free to move [-]: rounding."""


class Onset(NamedTuple):
    """An end of a range: the point that first reaches its strength.

    Parameters
    ----------
    multiplier : of the live load [-]; where a point is over its strength whatever the load, -inf as the upper end, inf
        as the lower
    criterion : what the point fails by, "opening", "slip" or "crushing"
    interface : number of its interface
    joint : its joint in words
    place : of the point [m]
    """

    multiplier: float
    criterion: str
    interface: int
    joint: str
    place: tuple[float, float, float]

    @property
    def where(self) -> str:
        """What fails, in which joint and at which point."""
        x, y, z = self.place
        return f"{self.criterion} of the {self.joint} at ({x:.4g}, {y:.4g}, {z:.4g}) m"

    def __str__(self) -> str:
        """In a line."""
        return f"{self.multiplier:.6g} by {self.where}" if np.isfinite(self.multiplier) else f"none holds: {self.where}"


@dataclass(frozen=True, eq=False)
class ElasticRange(ReadOnly):
    """Multipliers of the live load between which no joint point reaches its strength.

    Stresses have c components at m points; all is linear in the load.

    Parameters
    ----------
    assembly : of lumped units with the joints' series stiffness
    points : contact points
    dead, live : stresses (N, T...) of the points by either load, compression positive [Pa], shape (m, c)
    shift_dead, shift_live : displacement of the centroids by either load [m], shape (n, 3)
    blocks : how units deform, with the state of stress of those that do
    warnings : what a user should know
    """

    assembly: Assembly
    points: ContactPoints
    dead: Array
    live: Array
    shift_dead: Array
    shift_live: Array
    blocks: str
    warnings: tuple[str, ...] = ()

    @property
    def low(self) -> Onset | None:
        """The lower end, or None where there is none.

        It is above zero where the dead load alone is too much.
        """
        return self.end(-1)

    @property
    def high(self) -> Onset | None:
        """The upper end, or None where there is none.

        It is below zero where the dead load alone is too much.
        """
        return self.end(1)

    @property
    def stands(self) -> bool:
        """Whether the dead load alone reaches no strength."""
        low, high = self.low, self.high
        return (low is None or low.multiplier < 0.0) and (high is None or high.multiplier > 0.0)

    def end(self, sense: int = 1, criterion: str | None = None) -> Onset | None:
        """End of the range by one criterion, or by all.

        Parameters
        ----------
        sense : 1 for the upper end, -1 for the lower
        criterion : "opening", "slip" or "crushing"; None for the one that comes first

        Raises
        ------
        InputError
            For another criterion or sense.
        """
        if sense not in (-1, 1) or criterion not in (None, *CRITERIA):
            raise InputError(f"sense is 1 or -1 and criterion one of {', '.join(CRITERIA)}, got {sense}, {criterion!r}")
        dead, live = self._beyond_rounding(self.dead), self._beyond_rounding(self.live)
        found = []
        for name in CRITERIA if criterion is None else (criterion,):
            low, high = point_range(name, self._law, dead, live)  # of every point, (m,)
            bound = high if sense == 1 else -low  # the point that ends the range has the least
            k = int(np.argmin(bound))
            if bound[k] < np.inf:
                found.append(self._onset(sense * float(bound[k]) + 0.0, name, k))  # no -0
        return min(found, key=lambda o: sense * o.multiplier, default=None)

    @property
    def _law(self) -> PointLaw:
        return interface_law(self.assembly.arrays, convex=False).at(self.points.interface)

    def _beyond_rounding(self, stress: Array) -> Array:
        """Stresses of a load without those of no size beside the largest, which dry joints have no strength to hide."""
        corners = self.assembly.arrays.corners
        nothing = max(_NOTHING, _ROUNDED * np.abs(corners).max() / np.ptp(corners, axis=0).max())
        return np.where(np.abs(stress) > nothing * np.abs(stress).max(), stress, 0.0)

    def _by_dead_load(self, high: Onset) -> str:
        """Words for own weight that alone exceeds or reaches a strength: an empty range.

        ``high`` is the upper end of the range, named where own weight reaches a strength there.
        """
        law, dead = self._law, self._beyond_rounding(self.dead)
        bears = law.shear_strength(dead[:, 0])
        # where ft lies beyond the apex of the cone a point there bears no shear, and pull up to ft
        bears = np.where(law.cut_off, bears, np.maximum(bears, 0.0))
        shear = np.linalg.norm(dead[:, 1:], axis=1)
        over = np.array([-dead[:, 0] - law.tension, shear - bears, dead[:, 0] - law.crushing])  # rows as in CRITERIA
        which, point = np.unravel_index(int(np.argmax(over)), over.shape)
        if over[which, point] > _NOTHING * np.abs(dead).max():
            return f"own weight alone exceeds a strength, by {self._onset(0.0, CRITERIA[which], int(point)).where}"
        return f"own weight alone reaches a strength, which any load exceeds, by {high.where}"

    def with_strengths(self, assembly: Assembly) -> ElasticRange:
        """These stresses against the strengths of another assembly's joints.

        Parameters
        ----------
        assembly : with joints as stiff, as large and at the same places as these

        Raises
        ------
        InputError
            For another number of blocks or joints, other stiffnesses, areas or places of joints, to 1e-9 of each, and
            other materials of blocks.
        """
        mine_many, their_many = ((len(a.blocks), len(a.interfaces)) for a in (self.assembly, assembly))
        if mine_many != their_many:
            raise InputError("with_strengths: the joints must differ in their strengths only, not in number")
        for a, b in zip(self.assembly.blocks, assembly.blocks, strict=True):
            if a.material != b.material:
                raise InputError(
                    f"with_strengths: block {b.name!r} must be of the same material: ask elastic_range again"
                )
        other = with_lumped_units(assembly) if self.blocks == LUMPED else assembly
        mine, theirs = self.assembly.arrays, other.arrays
        size = np.ptp(mine.corners, axis=0).max()
        same = np.abs(mine.centre - theirs.centre).max() <= _SAME * size and all(
            np.allclose(getattr(mine, n), getattr(theirs, n), rtol=_SAME, atol=0.0, equal_nan=True)
            for n in ("normal_stiffness", "shear_stiffness", "area")
        )
        if not same:
            raise InputError("with_strengths: the joints must differ in their strengths only")
        joints = (replace(i, joint=j.joint) for i, j in zip(self.assembly.interfaces, other.interfaces, strict=True))
        return replace(self, assembly=replace(self.assembly, interfaces=tuple(joints)))

    def _onset(self, multiplier: float, criterion: str, point: int) -> Onset:
        """The joint of a point in words, with where and by which criterion its strength is reached.

        Parameters
        ----------
        multiplier : load multiplier at the onset [-]
        point : number of the contact point
        """
        k = int(self.points.interface[point])
        i = self.assembly.interfaces[k]
        a, b = (self.assembly.blocks[n].name for n in (i.block_a, i.block_b))
        x, y, z = (float(v) for v in self.points.position[point])
        return Onset(multiplier, criterion, k, f"{i.kind} joint of {a} and {b}", (x, y, z))

    def __str__(self) -> str:
        """Both ends in words, or why there is nothing between them."""
        low, high = self.low, self.high
        if low is not None and high is not None and low.multiplier >= high.multiplier:
            ends = [f"  empty: {self._by_dead_load(high)}"]
        else:
            ends = [f"  {word} {'no end' if end is None else end}" for word, end in (("from", low), ("to", high))]
        lines = [f"elastic range of the multiplier, {self.blocks} blocks, {self.points.count} contact points", *ends]
        return "\n".join(lines + [f"  note: {w}" for w in self.warnings])

    __repr__ = __str__


@of_model
def elastic_range(
    assembly: Assembly,
    loads: Loads,
    *,
    blocks: str = RIGID,
    stress: str | None = None,
    contact_model: str | None = None,
    grid: Grid | float | Mapping[str, Grid] | None = None,
    stiffness: float | tuple[float, float] | None = None,
) -> ElasticRange:
    """Multipliers of the live load between which no joint point reaches its strength.

    K u = w,  s = -k A^T u,  for dead and live load alike: lambda_opening = min (ft + N_dead) / -N_live over the points
    that the live load pulls at, and so for slip and crushing.

    Parameters
    ----------
    assembly, loads : the problem
    blocks, stress, grid, stiffness : as for :func:`limitmason.pushover`, whose joints are linear up to the same load on
        the same points
    contact_model : "grid", of 5 x 5 points where no other grid is given; corners ("vertices"), on which a path in plane
        goes unless told, bend three times as stiffly as the face

    Returns
    -------
    ElasticRange

    Raises
    ------
    InputError
        For a live load that does nothing, words unknown, and joints without stiffness where units are lumped.
    NotApplicable
        For ties, and for blocks that the joints do not hold.

    Notes
    -----
    Exact for small displacements and joints that are closed over their whole faces and bear tension up to there: joints
    without tensile strength open at any pull, so that the range then ends where the first point is free of pressure.
    Beyond the apex of the cone, where ft > c / tan(phi), a point bears pull up to ft and no shear: where neither load
    makes shear, slip sets no bound, else it does so at the apex at the latest. Stresses below 1e-9 of the largest that
    the load makes anywhere count as none, more where map coordinates are rounded.
    Stresses at corners of blocks that deform grow with points and shapes: the answer is that of the points it is asked
    on, as in every method on contact points. Where slip comes first, a structure whose joints lose nothing by it goes
    on: the range ``end(1, "opening")`` is then no more than an estimate.
    """
    deforming = blocks in (SIMPLY_DEFORMABLE, RITZ)
    refuse_ties(assembly, "an elastic range", "leave the ties out: assembly.with_ties(())")
    if blocks == LUMPED:
        assembly = lumped(assembly, stiffness)
    plane, state = plane_of(assembly, loads, blocks, stress)
    points, _ = points_of_path(assembly, plane, "grid" if contact_model is None else contact_model, grid)
    kn, ks, warnings = joint_stiffness(assembly, loads.dead, stiffness)
    springs = np.column_stack([kn, *[ks] * (points.components - 1)])[points.interface]
    shapes = shapes_of(assembly, blocks, state, None if plane is None else plane.normal) if deforming else None
    warnings = [*warnings, *soft_block_warnings(assembly, kn, blocks)]
    # A and K = A k A^T of all motions u of the blocks, then of their shapes: A^T u displaces the points
    rows, matrix = stiffness_matrix(assembly, points, springs, plane, shapes, blocks)
    basis, free = degrees_of_freedom(assembly, plane)
    wrench = np.column_stack([(w @ basis * free).ravel() for w in (loads.dead, loads.live)])
    # unknowns: motions of the blocks, of which the free ones are solved for, then coordinates of their shapes
    free_or_shape = np.concatenate([free.ravel(), np.ones(matrix.shape[0] - free.size, dtype=bool)])
    solved = np.flatnonzero(free_or_shape)
    moved = np.zeros((len(free_or_shape), 2))  # by the dead and by the live load
    wrench = np.pad(wrench, ((0, len(free_or_shape) - len(wrench)), (0, 0)))
    # blocks that deform: number, shapes, and where the coordinates of these are among the unknowns
    deforms, own = [], free.size
    for i, shape in enumerate(shapes or ()):
        if shape is not None:
            deforms.append((i, shape, slice(own, own + shape.count)))
            own += shape.count
    for i, shape, of_shapes in deforms:  # forces beside the centroid work on the mean gradient of every shape
        for column, arms in enumerate((loads.dead_arms, loads.live_arms)):
            wrench[of_shapes, column] = np.einsum("kij,ji->k", shape.mean_gradient, arms[i])
    # loads that cancel on a block move none that is rigid, and press one that deforms
    if not wrench[:, 1].any():
        raise InputError("no live load acts on a free block: there is nothing whose range could be asked for")
    moved[solved] = _solved(sparse.csc_array(matrix[solved][:, solved]), wrench[solved])
    stress_of = -springs[:, :, None] * (rows.T @ moved).reshape(points.count, points.components, 2)
    # forces that cancel on blocks whose joints do not feel their strain leave rounding alone [Pa]
    felt = np.abs(loads.live_arms).max(axis=(1, 2)) / np.cbrt(assembly.volumes) + np.abs(loads.live[:, :3]).max(axis=1)
    if np.abs(stress_of[:, :, 1]).max() <= _NOTHING * felt.max() / points.area.sum():
        stress_of[:, :, 1] = 0.0
    # displacement of the centroids by load, block and axis
    shift = np.einsum("ndl,xd->lnx", moved[: free.size].reshape(*free.shape, 2), basis[:3])
    for i, shape, of_shapes in deforms:  # a shape moves the centroid too: rigid motions are means over the block
        at = shape.displacement(assembly.centroids[i : i + 1])[0]
        shift[:, i] += (at.T @ moved[of_shapes]).T
    level = f"{blocks}, {state}" if deforming else blocks
    return ElasticRange(
        assembly=assembly, points=points, dead=stress_of[:, :, 0], live=stress_of[:, :, 1], shift_dead=shift[0],
        shift_live=shift[1], blocks=level, warnings=tuple(warnings),
    )


def _solved(matrix: sparse.csc_array, loads: Array) -> Array:
    """Solution of K u = w for every load, shape (r, k), refused where joints leave a block free.

    K is scaled to ones on the diagonal, S K S with S_ii = K_ii^-1/2, so that pivots tell a free motion from a soft one.
    One step of refinement follows.

    Parameters
    ----------
    matrix : stiffness K of the free unknowns, symmetric, shape (r, r)
    loads : w, a column for every load, shape (r, k)
    """
    size = np.sqrt(matrix.diagonal())
    if not (size > 0.0).all():
        raise NotApplicable("a block is free of all joints: there is no elastic state")
    scale = sparse.diags_array(1.0 / size)
    scaled = sparse.csc_array(scale @ matrix @ scale)
    try:
        factors = splu(scaled)
        found = factors.solve(loads / size[:, None])
        # one step of iterative refinement, by what equilibrium still lacks
        found += factors.solve(loads / size[:, None] - scaled @ found)
    except RuntimeError:
        found = np.full(loads.shape, np.nan)
    pivots = np.abs(factors.U.diagonal()) if np.isfinite(found).all() else np.zeros(1)
    if not pivots.min() > _FREE * pivots.max():
        raise NotApplicable("the joints do not hold the blocks in place: there is no elastic state")
    return np.asarray(found / size[:, None])

