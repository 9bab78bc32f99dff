"""Contact points of interfaces: where forces pass, their tributary areas and directions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from limitmason.answers.results import ContactModel
from limitmason.arrays import Array, Flags, Index
from limitmason.checks import choice, numbers
from limitmason.errors import InputError
from limitmason.mechanics import point_lattices as lattices
from limitmason.mechanics.face_sides import DIFFERS, in_rows, turned_corners
from limitmason.mechanics.plane import Plane
from limitmason.model.arrays import AssemblyArrays
from limitmason.model.assembly import Assembly
from limitmason.storage.frozen import ReadOnly

Grid = tuple[int, int]
Chosen = TypeVar("Chosen")

__all__ = ["KINDS", "ContactPoints", "Grid", "chosen_grid", "contact_points"]

KINDS = ("bed", "head", "base", "crack")

LOBATTO = ContactModel.LOBATTO

LOBATTO_POINTS = 15
"""Points on a side: a crushing section to 1 %, the largest load of one that breaks at once to 2 %."""

EVEN_GRID: Grid = (5, 5)
"""Evenly spaced points along and across a joint where none are given: chosen."""


@dataclass(frozen=True, eq=False)
class ContactPoints(ReadOnly):
    """Points at which an interface transmits forces.

    Parameters
    ----------
    position : [m], shape (m, 3)
    interface : number of the interface each point belongs to, shape (m,)
    area : tributary area [m2], shape (m,)
    directions : unit vectors of the force components, normal and two tangents, or normal and one in plane,
        shape (m, 3, 3) or (m, 2, 3)
    block_a, block_b : numbers of the blocks each point lies between; its force acts on b, shape (m,)
    """

    position: Array
    interface: Index
    area: Array
    directions: Array
    block_a: Index
    block_b: Index

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.position)

    @property
    def components(self) -> int:
        """Force components per point: 3, or 2 in plane."""
        return self.directions.shape[1]


def contact_points(
    assembly: Assembly,
    *,
    contact_model: str = "vertices",
    grid: Grid | float | Mapping[str, Grid] = EVEN_GRID,
    plane: Plane | None = None,
    elastic: bool = False,
    ties: bool = False,
    called: str = "grid",
) -> ContactPoints:
    """Contact points of all interfaces that touch a free block.

    Parameters
    ----------
    contact_model : "vertices", the polygon's corners, exact for rocking of rigid no-tension blocks; "grid", points
        on an even lattice that includes the edges (cell centres would lose 1/n of the lever arm); or "lobatto", whose
        points crowd towards the edges: for joints that crush or break, see :data:`LOBATTO_POINTS`
    grid : points along the unit's length (or the height of a head joint) and across the thickness, one pair for all
        interfaces, or one per kind of joint ("bed", "head", "base") or per wall, which is how the names of its blocks
        begin ("facade", "return-left"); at least 2 each. Walls go before kinds, and a joint between two walls takes
        the finer of both; or the largest spacing of points [m], by which every interface gets as many as it needs
    plane : from :func:`limitmason.mechanics.plane.find_plane`; points then lie on the plane, in rows along the unit, or
        across it where the plane does: of the grid's two numbers then at least the second
    elastic : areas of a grid that bend as the face does, for stiffness (the DEM); False for areas that carry what the
        face carries, for strength: the points are the same
    ties : one point more for every tie that touches a free block, at its middle, as ``Assembly.links`` numbers them
    called : name of the argument by which a user gave the grid, for errors

    Returns
    -------
    ContactPoints
        Tributary areas add up to the interface's area and keep its centroid; elastic ones, from 3 points on a side, its
        second moment too. With 2 it is three times too large, which no points at the edges alone can better.
    """
    choice("contact_model", contact_model, tuple(ContactModel))
    x = assembly.arrays
    active = np.flatnonzero(~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b]))
    if contact_model == "vertices":  # a side has its two ends alone
        sizes = np.full((len(x.area), 2), 2, dtype=np.intp)
    elif isinstance(grid, int | float):
        sizes = _spaced_sizes(assembly, grid, plane, called)
    else:
        sizes = _grid_sizes(assembly, grid, called)
        sizes = sizes if plane is None else in_rows(assembly, sizes, plane)
    position, interface, area = [np.empty((0, 3))], [np.empty(0, np.intp)], [np.empty(0)]
    # faces with as many corners and points are laid out at once
    corners_and_sizes = np.column_stack([np.diff(x.corner_start), sizes])
    for alike in np.unique(corners_and_sizes[active], axis=0) if len(active) else ():
        rows = active[(corners_and_sizes[active] == alike).all(axis=1)]
        points, share = _laid_out(assembly, rows, alike, contact_model, plane, elastic=elastic)
        position.append(points.reshape(-1, 3))
        area.append(share.ravel())
        interface.append(np.repeat(rows, points.shape[1]))
    if ties and assembly.ties:
        x = assembly.links  # the interfaces and, after them, the ties
        rows = len(assembly.interfaces) + np.arange(len(assembly.ties))
        rows = rows[~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b])[rows]]
        position.append(x.centre[rows])
        area.append(x.area[rows])
        interface.append(rows)
    owner = np.concatenate(interface)
    order = np.argsort(owner, kind="stable")
    owner = owner[order]
    normal, at = x.normal[owner], np.concatenate(position)[order]
    if plane is None:
        directions = np.stack([normal, x.tangent_1[owner], x.tangent_2[owner]], axis=1)
    else:
        # what a face is off the plane by rounding is a moment out of it, and much for a light block between heavy ones
        at += (plane.level - at @ plane.normal)[:, None] * plane.normal
        normal = normal - (normal @ plane.normal)[:, None] * plane.normal
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        directions = np.stack([normal, np.cross(plane.normal, normal)], axis=1)
    return ContactPoints(
        position=at, interface=owner, area=np.concatenate(area)[order], directions=directions, block_a=x.block_a[owner],
        block_b=x.block_b[owner],
    )


def _laid_out(
    assembly: Assembly, rows: Index, alike: Index, contact_model: str, plane: Plane | None, *, elastic: bool
) -> tuple[Array, Array]:
    """Contact points of faces that are alike, and their tributary areas.

    Parameters
    ----------
    assembly : whose interfaces these are
    rows : numbers of the faces, shape (r,)
    alike : number of corners k, and of points along and across, of each of them, shape (3,)
    contact_model, plane, elastic : as of :func:`contact_points`

    Returns
    -------
    points : [m], shape (r, p, 3)
    area : [m2], shape (r, p)
    """
    x = assembly.arrays
    n_corners, along, across = (int(number) for number in alike)
    lattice = lattices.lobatto_points if contact_model == LOBATTO else partial(lattices.edge_points, elastic=elastic)
    if contact_model != "vertices" and n_corners == 4:
        corners = turned_corners(assembly, rows)
    else:
        corners = x.corners[x.corner_start[rows][:, None] + np.arange(n_corners)]
    if plane is not None:
        return lattices.plane_points(corners, x, rows, plane, along, lattice)
    if contact_model == "vertices":
        return corners, lattices.corner_areas(corners, x.normal[rows])
    if n_corners == 4:
        return lattices.lattice_points(corners, along, across, x.normal[rows], lattice)
    return lattices.fan_points(corners, max(along, across), x.normal[rows], lattice)


_ENOUGH = 5
"""Points on a side of a joint that crushes or loses strength that pass without a warning: 4 may err by a quarter."""


def chosen_grid(contact_model: str, grid: Chosen | None) -> Chosen | Grid:
    """The grid of contact points that an analysis uses.

    Parameters
    ----------
    contact_model : as of :func:`contact_points`
    grid : what the user gave; without any it is ``EVEN_GRID``, or ``LOBATTO_POINTS`` both ways

    Raises
    ------
    InputError
        For a grid with another contact model, which would not use it.
    """
    if grid is None:
        return (LOBATTO_POINTS, LOBATTO_POINTS) if contact_model == LOBATTO else EVEN_GRID
    if contact_model == "vertices":
        raise InputError(f"grid={grid!r} is not used by contact_model={contact_model!r}: give contact_model='grid'")
    return grid


def weakening(assembly: Assembly) -> Flags:
    """Interfaces whose joints crush or lose strength, which two points on a side cannot tell, shape (k,)."""
    softens = np.array([i.joint.softens for i in assembly.interfaces], dtype=bool)
    return np.isfinite(assembly.arrays.compressive_strength) | softens


FEW_POINTS = "joints crush or lose strength at the few contact points"
"""How :func:`on_few_points` begins."""


def on_few_points(assembly: Assembly, remedy: str, points: ContactPoints | None = None) -> tuple[str, ...]:
    """A warning of joints that crush or lose strength on few points, or nothing where there are none.

    Parameters
    ----------
    remedy : what the user should do, which ends the warning
    points : those chosen, of which a side of such a joint may have five or more; None for a default that is coarse
    """
    weak = weakening(assembly)
    if points is not None:
        number = np.bincount(points.interface, minlength=len(weak))[: len(weak)]  # without the ties, numbered last
        sides = points.components - 1  # points lie along both sides of a face, in plane along one
        weak &= (number > 0) & (number < _ENOUGH**sides)
    if not weak.any():
        return ()
    whose = "of the default" if points is None else "given"
    return (
        f"{FEW_POINTS} {whose}: the first crack, and what a crushing section bears, may be a quarter too high with 4 "
        f"points on a side, twice with 3 and three times with 2; {remedy}",
    )


def _grid_sizes(assembly: Assembly, grid: Grid | Mapping[str, Grid], called: str) -> Index:
    """Points along both sides of every joint by its kind or wall, shape (k, 2).

    ``grid`` and ``called`` are those of :func:`contact_points`, but no spacing.

    Raises
    ------
    InputError
        For sizes that are not two whole numbers from 2 on, names that mean nothing, and kinds without an entry.
    """
    table = grid if isinstance(grid, Mapping) else dict.fromkeys({i.kind for i in assembly.interfaces}, grid)
    for name, size in table.items():
        counts = numbers(f"{called} for {name!r}", size)
        if counts.shape != (2,) or not (counts >= 2.0).all() or (counts != counts.round()).any():
            raise InputError(f"{called} for {name!r} must be two whole numbers of at least 2, got {size!r}")
    walls = [name for name in table if name not in KINDS]
    names = [block.name for block in assembly.blocks]
    for wall in walls:
        if not any(name.startswith(wall) for name in names):
            raise InputError(
                f"{called} has an entry {wall!r}, which is no kind of joint ({', '.join(KINDS)}) and begins the name "
                "of no block"
            )
    sizes = np.empty((len(assembly.interfaces), 2), np.intp)
    for k, i in enumerate(assembly.interfaces):
        own = [table[wall] for wall in walls if any(names[b].startswith(wall) for b in (i.block_a, i.block_b))]
        if not own and i.kind not in table:
            raise InputError(f"{called} has no entry for joints of kind {i.kind!r}")
        sizes[k] = np.max(own, axis=0) if own else table[i.kind]
    return sizes


def extents(x: AssemblyArrays, *directions: Array) -> Array:
    """Extent of every face along directions of its plane [m], shape (k, number of directions).

    Parameters
    ----------
    x : faces by their corners
    directions : unit vectors, one of each face in every array, shape (k, 3) each
    """
    owner, first = x.corner_owner, x.corner_start[:-1]
    arm = x.corners - x.centre[owner]
    along = [np.einsum("ij,ij->i", arm, d[owner]) for d in directions]
    return np.stack([np.maximum.reduceat(a, first) - np.minimum.reduceat(a, first) for a in along], axis=1)


def _spaced_sizes(assembly: Assembly, spacing: float, plane: Plane | None, called: str) -> Index:
    """Points both ways on every interface for a spacing, 2 at least, shape (k, 2).

    Parameters
    ----------
    spacing : largest distance of evenly spaced points [m]
    plane : in which they lie, one row along each face; None for points all over it
    called : name of the argument that the spacing was given by, for errors

    Raises
    ------
    InputError
        For a spacing that is not positive, or seems to be meant as a number of points.
    """
    if isinstance(spacing, bool) or not 0.0 < spacing < np.inf:
        raise InputError(f"a spacing of contact points must be positive [m], got {spacing!r}")
    x = assembly.arrays
    if plane is None:
        # points of quadrilaterals follow their sides, those of other faces the tangents
        rows = np.flatnonzero(np.diff(x.corner_start) == 4)
        spans = extents(x, x.tangent_1, x.tangent_2)
        if len(rows):
            quads = turned_corners(assembly, rows)
            spans[rows, 0] = np.linalg.norm(quads[:, 1] - quads[:, 0], axis=1)
            spans[rows, 1] = np.linalg.norm(quads[:, 2] - quads[:, 1], axis=1)
    else:
        span = extents(x, np.cross(plane.normal, x.normal))
        spans = np.concatenate([span, np.zeros_like(span)], axis=1)
    longest = spans.max(initial=0.0)
    # grid=5 is easily meant as 5 points: as a spacing of 5 m it would leave two on a side. A number is 2 at least
    if spacing >= 2.0 and spacing > longest:
        raise InputError(
            f"{called}={spacing!r} is a spacing of points [m], more than the longest joint, {longest:.3g} m: give two "
            f"numbers of points, {called}=(5, 5), or a smaller spacing"
        )
    # a side that is a whole number of spacings but for rounding gets no point more
    return np.maximum(np.ceil(spans / spacing - DIFFERS).astype(np.intp) + 1, 2)
