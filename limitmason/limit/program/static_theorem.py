"""The static theorem as scaled sparse arrays, from which every program starts.

Cones are added in ``cones``; both go to a solver in ``clarabel_solver``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from limitmason.answers.results import Bound, BoundKind, ContactModel, Mechanism, Prediction, Resultants, Status
from limitmason.arrays import Array, Flags, Index
from limitmason.checks import switch
from limitmason.errors import InputError
from limitmason.limit.program.face_cells import Cells, whole_faces, with_cells
from limitmason.mechanics.certificate import Kinematics, kinematic_multiplier
from limitmason.mechanics.contact_points import ContactPoints, Grid, contact_points
from limitmason.mechanics.equilibrium import degrees_of_freedom, equilibrium_matrix
from limitmason.mechanics.law import PointLaw, interface_law
from limitmason.mechanics.law_table import ASSOCIATIVE, CORNERS, refuse
from limitmason.mechanics.plane import Plane, find_plane
from limitmason.mechanics.residuals import total_load
from limitmason.mechanics.resultants import resultants_from_points, scaled_mechanism
from limitmason.mechanics.stress_block import StressBlock, stress_blocks
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

NO_CASES: Array = np.zeros((0, 0, 6))

ENDLESS = 1e8
"""Strength of a tie over the total load beyond which it is refused: the solvers' accuracy ends there."""


class Problem(NamedTuple):
    """Find f, lambda with matrix f + dead + lambda live = 0 and f within the law.

    Everything is scaled.

    Forces are divided by ``force_scale`` = total load / sqrt(number of free blocks) and live loads multiplied by
    ``live_scale`` so that both are of order one: unscaled, an interior-point solver stops at its tolerance while the
    multiplier is still wrong by up to several per cent. Moment rows are divided by a radius of the block.
    """

    assembly: Assembly
    loads: Loads
    points: ContactPoints
    plane: Plane | None  # None for a problem in space
    contact_model: str  # "vertices" or "grid"
    matrix: sparse.csc_array  # free rows, (r, c m)
    dead: Array  # (r,)
    live: Array  # (r,)
    row: Index  # degree of freedom d i + j of every row
    row_radius: Array  # 1 for force rows, the block's radius [m] for moment rows
    force_scale: float  # [N]
    live_scale: float  # multiplier = scaled multiplier * live_scale
    law: PointLaw  # of every point, over force_scale; crushing is infinite where a stress block stands for it
    stress_block: StressBlock  # of crushing in-plane sections, over force_scale
    point_scale: Array  # forces of a point are so many times their scaled value and ``force_scale`` [-], (m,)
    row_unit: Array  # rows are in so many ``force_scale`` [-], (r,)
    size: float  # total load in scaled units [-]
    cells: Cells  # of cohesive faces in space with contact points at their corners; empty without
    cases: Array = NO_CASES  # further live loads [N, N m], each with a multiplier of its own that is free, (k, n, 6)
    free: Array = NO_CASES[..., 0]  # the same in rows as ``live``, (k, r)

    @property
    def components(self) -> int:
        """Force components per point: 3, or 2 in plane."""
        return self.points.components

    @property
    def interfaces(self) -> Index:
        """Interfaces that have contact points, and ties after them."""
        return np.unique(self.points.interface)

    @property
    def crushing_points(self) -> Flags:
        """Points of faces at which joints crush one by one, (m,).

        The yielding of a tie is none.
        """
        return self.law.crushes & (self.points.interface < len(self.assembly.interfaces))

    @property
    def block_interfaces(self) -> Index:
        """Interfaces whose crushing is that of a stress block."""
        return self.points.interface[self.stress_block.ends[:, 0]]

    def forces(self, scaled: Array) -> Array:
        """Contact forces on block b in global axes [N], shape (m, 3).

        ``scaled`` are the unknowns f of the program [-], shape (c m,): normal force (compression > 0), then tangents.
        """
        f = scaled.reshape(-1, self.components) * self.point_scale[:, None]
        return self.force_scale * np.einsum("mc,mci->mi", f, self.points.directions)

    def twists(self, dual: Array) -> Array:
        """Twists of all blocks: [m/s] and [rad/s], shape (n_blocks, 6).

        ``dual`` are the duals of the equilibrium rows, shape (r,). Held degrees of freedom have none and do not move.
        """
        basis, _ = degrees_of_freedom(self.assembly, self.plane)
        flat = np.zeros(self.assembly.n_blocks * basis.shape[1])
        flat[self.row] = dual / self.row_radius
        return flat.reshape(self.assembly.n_blocks, -1) @ basis.T

    def with_free(self, multipliers: Array) -> Problem:
        """The problem with its free live loads taken to the dead load.

        ``multipliers`` are their scaled multipliers u [-], shape (k,).
        """
        if not len(multipliers):  # no free live load
            return self
        added = np.tensordot(multipliers * self.live_scale, self.cases, 1)
        return self._replace(
            loads=replace(self.loads, dead=self.loads.dead + added), dead=self.dead + multipliers @ self.free,
            cases=NO_CASES, free=self.free[:0],
        )

    def dual(self, twists: Array) -> Array:
        """Inverse of :meth:`twists`."""
        basis, _ = degrees_of_freedom(self.assembly, self.plane)
        return (twists @ basis).ravel()[self.row] * self.row_radius

    @property
    def contact_facts(self) -> dict[str, Any]:
        """What a prediction says of the contacts that its forces act at, as its fields."""
        return {
            "contact_model": ContactModel(self.contact_model),
            "plane": self.plane is not None,
            "stress_block": self.stress_block.count > 0,
        }

    def resultants(self, force: Array) -> Resultants:
        """Resultants of contact forces on block b in global axes [N], shape (m, 3)."""
        p = self.points
        return resultants_from_points(self.assembly, p.position, p.interface, p.area, force)

    def mechanism(self, loads: Loads, dual: Array) -> Mechanism | None:
        """The motion of duals of the rows, (r,), or None where the live load does no work.

        It is scaled so that the power of the live load of ``loads`` is the size of that load.
        """
        return scaled_mechanism(self.assembly, loads, self.twists(dual), self.points.position, self.points.interface)

    def proven_by(self, loads: Loads, twists: Array, candidates: tuple[Array, ...] = ()) -> Kinematics:
        """What a motion alone proves of loads, as ``kinematic_multiplier`` does.

        Parameters
        ----------
        twists : the motion [m/s, rad/s], shape (n_blocks, 6); its scale does not matter
        candidates : other motions that may repair it, shape (n_blocks, 6) each

        Returns
        -------
        Kinematics, with an upper bound of the multiplier [-].
        """
        none = self.resultants(np.zeros((self.points.count, 3)))
        motion = Mechanism(twists, np.zeros(0), np.zeros((0, 2)))
        # only its motion and the places of its contact points are read
        trial = Prediction(
            method="", collapse_multiplier=np.nan, bound=Bound(BoundKind.NONE), status=Status.SOLVED, mechanism=motion,
            resultants=none, **self.contact_facts,
        )
        return kinematic_multiplier(self.assembly, loads, trial, candidates=candidates)


def make_problem(
    assembly: Assembly,
    loads: Loads,
    *,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] = (5, 5),
    in_plane: bool | None = None,
    cells: Cells | None = None,
    live_required: bool = True,
    cases: Array = NO_CASES,
) -> Problem:
    """Arrays of the static theorem.

    Parameters
    ----------
    assembly, loads : the structure with its dead and live load; loads on held blocks do not count
    contact_model, grid : see :func:`limitmason.mechanics.contact_points.contact_points`
    in_plane : True demands and False forbids the reduction to the plane; None uses it where it is exact
    cells : of cohesive faces in space with contact points at their corners, see
        :mod:`limitmason.limit.program.face_cells`; None takes every face whole
    live_required : False allows a problem without live load, which only asks what the dead load needs
    cases : further live loads [N, N m], shape (k, n_blocks, 6): f + dead + lambda live + sum u_k case_k, with u_k free

    Raises
    ------
    InputError
        When loads and assembly do not fit, no free block carries live load, or nothing is held.
    NotApplicable
        Where ``vertices`` meets a finite compressive strength in 3-D, and for terms of the law that are not taken.
    """
    plane = _checked_plane(assembly, loads, cases, in_plane, live_required=live_required)
    n, x = assembly.n_blocks, assembly.links
    # joints between two fixed blocks pass nothing on, whatever their law
    seen = np.flatnonzero(~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b]))
    refuse(ASSOCIATIVE, assembly, seen, where=CORNERS if contact_model == "vertices" and plane is None else "")
    points = contact_points(assembly, contact_model=contact_model, grid=grid, plane=plane, ties=True)
    if plane is not None or contact_model != "vertices":
        cells = {}  # cohesion acts at the points
    elif cells is None:
        cells = whole_faces(assembly)
    points = with_cells(assembly, points, cells)
    basis, moves = degrees_of_freedom(assembly, plane)
    row = np.flatnonzero(moves.ravel())
    d = basis.shape[1]
    # moments over the size of their block are of the size of forces; moments follow 3 forces, or 2 in plane
    radius = np.ones((n, d))
    radius[:, 3 if d == 6 else 2 :] = np.cbrt(x.volume)[:, None]
    row_radius = radius.ravel()[row]

    # unit of force: the total load over the root of the number of free blocks;
    # a total live load without any (only the dead load is asked about) is taken as one
    size = np.sqrt((~assembly.fixed).sum())
    scale = total_load(assembly, loads) / size
    live = (loads.live @ basis).ravel()[row] / row_radius
    dead = (loads.dead @ basis).ravel()[row] / row_radius
    live_scale = scale * size / (np.abs(live).sum() or 1.0)
    free_rows = (cases @ basis).reshape(len(cases), n * d)[:, row] / row_radius * (live_scale / scale)
    # rows of held degrees of freedom are left out; a diagonal product per row keeps the sparsity pattern
    matrix = equilibrium_matrix(assembly, points, plane=plane).tocsr()[row]
    matrix = sparse.csc_array(sparse.diags_array(1.0 / row_radius) @ matrix)

    _refuse_endless_ties(assembly, total_load(assembly, loads))
    k = points.interface
    of_faces = interface_law(x)
    law = of_faces.at(k).over(points.area).in_units_of(scale)
    faces = k < len(assembly.interfaces)
    # the two corners of a plane joint are the ends of a section with a stress block
    by_ends = plane is not None and contact_model == "vertices"
    first = np.flatnonzero(law.crushes & faces)[::2] if by_ends else np.empty(0, int)
    sections = of_faces.at(k[first]).over(x.area[k[first]]).in_units_of(scale)
    block = stress_blocks(sections, np.column_stack([first, first + 1]))
    law = law.without_crushing(block.ends)
    return Problem(
        assembly=assembly, loads=loads, points=points, plane=plane, contact_model=contact_model, matrix=matrix,
        dead=dead / scale, live=live * live_scale / scale, row=row, row_radius=row_radius, force_scale=float(scale),
        live_scale=float(live_scale), law=law, stress_block=block, point_scale=np.ones(points.count),
        row_unit=np.ones(len(row)), size=float(size), cells=cells, cases=cases,
        free=free_rows,
    )


def _checked_plane(
    assembly: Assembly, loads: Loads, cases: Array, in_plane: bool | None, *, live_required: bool
) -> Plane | None:
    """The plane that a problem reduces to, or None in space.

    Input without a problem to solve raises an InputError. Arguments are those of :func:`make_problem`.
    """
    if len(loads.dead) != assembly.n_blocks:
        raise InputError(f"the loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    assembly.check_connected()
    if assembly.fixed.all():
        raise InputError("every block is fixed: there is nothing to solve")
    if live_required and not loads.live[~assembly.held].any():
        raise InputError(
            "the live load is zero on every free degree of freedom; use Loads.horizontal or one of the with_ methods "
            "with case='live'"
        )
    if not assembly.interfaces:
        raise InputError("the assembly has no interfaces: no two blocks touch")
    wanted = None if in_plane is None else switch("in_plane", in_plane)
    plane = find_plane(assembly, loads, cases.reshape(-1, 6)) if wanted is not False else None
    if wanted and plane is None:
        raise InputError(
            "in_plane=True, but blocks, rectangular interfaces and loads are not all symmetric about one plane"
        )
    return plane


def _refuse_endless_ties(assembly: Assembly, load: float) -> None:
    """Refuse a tie so strong beside the total load [N] that it is a rod without end."""
    for tie in assembly.ties:
        if tie.strength > ENDLESS * load:
            raise InputError(
                f"{tie}: its strength is more than {ENDLESS:g} times the load, {load:.4g} N; a thousand times the load "
                "is enough for a rod that does not yield"
            )
