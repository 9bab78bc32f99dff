"""Meshes of bricks of 20 or 8 nodes: solids cut along the planes of their outline, whatever the units inside."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from skfem import Basis, MeshHex
from skfem.element import ElementHex1, ElementHexS2

from limitmason.arrays import Array, Index
from limitmason.checks import choice, count, numbers, several
from limitmason.errors import InputError, NotApplicable
from limitmason.geometry import Solid
from limitmason.model.input import read_list, read_vector
from limitmason.storage.frozen import ReadOnly, frozen

_NEAR = 1e-7  # of the size of a piece or a structure: corners and planes this near to each other are one; rounding
_RIGHT = 1e-6  # of the longest way to a corner: edges whose product is smaller make a right angle
_ALONG = 1e-9  # of the components of the edges' directions: edges this near to the axes lie along them, by rounding
_IN_LINE = 1e-9  # of the square of an edge: corners of a face that span less area lie in a line with it
_LOOSE = 1e-3  # of the longest edge of a brick: how far outside a point may lie
_OUTSIDE = 0.501  # of an edge, from the middle of a brick: its surface is at 0.5, the rest is that slack
_WHOLE = 1e-9  # of a number of steps: how little it may be above a whole one and count as that
_STEPS = 8  # of Newton's method to a place in a brick: exact after one in a box, quadratic in others
CORNERS = np.array([[1, 1, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]])
"""Corners of the reference cube in the order of scikit-fem."""


class Box(NamedTuple):
    """An axis-aligned box.

    Parameters
    ----------
    low, high : lowest and highest corner [m], shape (3,) each
    material : number of what it is made of
    """

    low: Array
    high: Array
    material: int = 0


class Mesh(ReadOnly):
    """Bricks with trilinear geometry.

    Parameters
    ----------
    vertices : corners of the bricks [m], shape (n, 3)
    bricks : corners of every brick in the order of scikit-fem's hexahedron, shape (m, 8)
    material : number of the material of every brick, shape (m,)
    per_brick : number of nodes of a brick, k: 20, whose displacements are quadratic along edges, or 8, trilinear

    Attributes
    ----------
    nodes : where they are [m], corners first, shape (number of nodes, 3)
    connectivity : nodes of every brick, shape (m, k)
    solid, element : the mesh and its element as scikit-fem has them

    Notes
    -----
    Bricks of 8 nodes bend too stiffly, and a rotating crack in them stresses what lies beside it (stress locking).
    """

    def __init__(self, vertices: Array, bricks: Index, material: Index, per_brick: int = 20) -> None:
        """Number the nodes: corners first, then middles of edges.

        Parameters
        ----------
        vertices, bricks, material, per_brick : see the class
        """
        choice("nodes of a brick", per_brick, (8, 20))
        # copies: what the caller holds may change, and is not frozen
        corner, self.bricks, self.material = numbers("vertices", vertices), np.array(bricks), np.array(material)
        if corner.ndim != 2 or corner.shape[1] != 3 or self.bricks.ndim != 2 or self.bricks.shape[1] != 8:
            raise InputError(
                f"vertices must have shape (n, 3) and bricks (m, 8), got {corner.shape} and {self.bricks.shape}"
            )
        if self.material.shape != (len(self.bricks),):
            raise InputError(f"material must have one number for each of the {len(self.bricks)} bricks")
        self.solid = MeshHex(np.array(corner.T, order="C"), np.array(self.bricks.T, order="C"))
        self.element = ElementHexS2() if per_brick == 20 else ElementHex1()
        self.per_brick = per_brick
        # only numbers and places of nodes are read of it: the cheapest integration will do
        basis = Basis(self.solid, self.element, intorder=1)
        self.nodes: Array = np.ascontiguousarray(basis.doflocs.T)
        self.connectivity: Index = np.ascontiguousarray(basis.element_dofs.T)  # (m, k)
        frozen(vars(self))

    def __len__(self) -> int:
        return len(self.bricks)

    def __repr__(self) -> str:
        return f"<Mesh of {len(self)} bricks and {len(self.nodes)} nodes>"

    @cached_property
    def corners(self) -> Array:
        """Corners of every brick [m], shape (m, 8, 3)."""
        return frozen(np.asarray(self.solid.p.T[self.bricks]))

    @cached_property
    def boundary(self) -> Index:
        """Numbers of the free faces, shape (f,)."""
        return frozen(np.asarray(self.solid.boundary_facets()))

    @cached_property
    def boundary_owner(self) -> Index:
        """Brick that each free face belongs to, shape (f,)."""
        return frozen(np.asarray(self.solid.f2t[0, self.boundary]))

    @cached_property
    def boundary_nodes(self) -> Index:
        """Corner nodes of the free faces, counter-clockwise seen from outside, shape (f, 4)."""
        faces = self.solid.facets[:, self.boundary].T
        p = self.solid.p.T[faces]
        inside = self.corners[self.boundary_owner].mean(axis=1)
        middle = p.mean(axis=1)
        # scikit-fem keeps corners sorted, not in order around the face: sorted here by their angle about its middle
        axis = p[:, 1] - p[:, 0]
        # normal of a face by three of its corners, by others where these lie in a line
        normal = np.cross(axis, p[:, 3] - p[:, 0])
        in_line = np.linalg.norm(normal, axis=1) < _IN_LINE * np.linalg.norm(axis, axis=1) ** 2
        normal[in_line] = np.cross(axis, p[:, 2] - p[:, 0])[in_line]
        across = np.cross(normal, axis)
        r = p - middle[:, None]
        angle = np.arctan2(np.einsum("fki,fi->fk", r, across) / np.linalg.norm(across, axis=1)[:, None],
                           np.einsum("fki,fi->fk", r, axis) / np.linalg.norm(axis, axis=1)[:, None])
        around = np.argsort(angle, axis=1)
        faces, p = np.take_along_axis(faces, around, axis=1), np.take_along_axis(p, around[..., None], axis=1)
        outward = np.einsum("fi,fi->f", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), middle - inside) > 0.0
        faces[~outward] = faces[~outward][:, ::-1]
        return frozen(np.asarray(faces))

    def at(self, points: ArrayLike) -> tuple[Index, Array]:
        """Brick that holds each point, and the values of its k shape functions there.

        Parameters
        ----------
        points : [m], shape (p, 3)

        Returns
        -------
        brick : shape (p,)
        weight : shape (p, k)

        Raises
        ------
        InputError
            For a point outside the solid by more than a thousandth of a brick.
        """
        p = np.atleast_2d(numbers("points", points))
        if p.shape[1:] != (3,):
            raise InputError(f"points must have shape (p, 3), got {p.shape}")
        brick, weight = np.empty(len(p), dtype=np.intp), np.empty((len(p), self.per_brick))
        low, high = self.corners.min(axis=1), self.corners.max(axis=1)
        slack = _LOOSE * (high - low).max(axis=1)[:, None]
        for k, x in enumerate(p):
            near = np.flatnonzero(((x >= low - slack) & (x <= high + slack)).all(axis=1))
            # coordinates in a brick run from 0 to 1: inside is within 0.5 of the middle
            local = _local(self.corners[near], x) if len(near) else np.empty((0, 3))
            off = np.abs(local - 0.5).max(axis=1, initial=0.0) if len(near) else np.empty(0)
            if not len(near) or off.min() > _OUTSIDE:
                raise InputError(f"point ({x[0]:g}, {x[1]:g}, {x[2]:g}) lies outside the solid")
            best = int(np.argmin(off))
            brick[k] = near[best]
            weight[k] = self._shape(local[best : best + 1])[0]
        return brick, weight

    def shape_at(self, brick: Index, points: Array) -> Array:
        """Values of the k shape functions at points in known bricks, shape (p, k).

        Parameters
        ----------
        brick : that holds each point, shape (p,)
        points : [m], shape (p, 3)
        """
        return self._shape(_local(self.corners[brick], points))

    def _shape(self, local: Array) -> Array:
        """Values of the shape functions at reference points, (p, 3), as an array of shape (p, k)."""
        shape = [self.element.lbasis(local.T, i)[0] for i in range(self.per_brick)]
        return np.array([np.broadcast_to(s, len(local)) for s in shape]).T


def _local(corners: Array, x: Array) -> Array:
    """Reference coordinates, by Newton on the trilinear map, shape (m, 3).

    Parameters
    ----------
    corners : of the bricks [m], shape (m, 8, 3)
    x : one point for all bricks, shape (3,), or one for each, shape (m, 3) [m]
    """
    c = np.full((len(corners), 3), 0.5)
    for _ in range(_STEPS):
        shape, gradient = trilinear(c)
        gap = np.einsum("mk,mki->mi", shape, corners) - x
        jacobian = np.einsum("mki,mkj->mij", corners, gradient)
        c = c - np.linalg.solve(jacobian, gap[..., None])[..., 0]
    return c


def trilinear(place: Array) -> tuple[Array, Array]:
    """Shape functions of the eight corners and their gradients, shapes (q, 8) and (q, 8, 3).

    Parameters
    ----------
    place : reference points, coordinates from 0 to 1, shape (q, 3)
    """
    sign = 2.0 * CORNERS - 1.0
    # a function is the product of three factors, x or 1 - x, and its derivative that of the two others with their sign
    factor = 0.5 + sign * (place[:, None] - 0.5)
    gradient = np.stack([sign[:, i] * np.delete(factor, i, axis=2).prod(axis=2) for i in range(3)], axis=2)
    return factor.prod(axis=2), gradient


def box_axes(vertices: Array) -> Array:
    """Directions of the edges of a box as rows, those nearest to x, y and z first, second and third, shape (3, 3).

    The axes of space themselves where the edges lie along them, up to rounding, or where there is no right angle.

    Parameters
    ----------
    vertices : corners of the box, in any order [m], shape (8, 3)
    """
    v = np.asarray(vertices, dtype=float)
    edges = v - v[0]
    length = np.linalg.norm(edges, axis=1)
    first = edges[int(np.argsort(length)[1])]  # the shortest from the first corner; before it that corner itself
    first = first / np.linalg.norm(first)
    perpendicular = np.flatnonzero((np.abs(edges @ first) < _RIGHT * length.max()) & (length > 0.0))
    if not len(perpendicular):
        return np.eye(3)
    second = edges[perpendicular[int(np.argmin(length[perpendicular]))]]
    second = second / np.linalg.norm(second)
    axes = np.array([first, second, np.cross(first, second)])
    rows = np.empty((3, 3))
    left = [0, 1, 2]
    for k in range(3):  # each axis of space takes the edge that lies nearest to it
        best = max(left, key=lambda i: abs(axes[i, k]))
        left.remove(best)
        rows[k] = axes[best] * (1.0 if axes[best, k] >= 0.0 else -1.0)
    if np.abs(rows - np.eye(3)).max() < _ALONG:
        return np.eye(3)
    # a reflection is no turn: the third axis points the other way
    return rows if np.linalg.det(rows) > 0.0 else rows * np.array([[1.0], [1.0], [-1.0]])


def box_of(solid: Solid, name: str) -> Box:
    """The axis-aligned box that a convex piece is.

    Parameters
    ----------
    solid : the piece
    name : of its block, for the message

    Raises
    ------
    NotApplicable
        When it is another shape.
    """
    v = np.asarray(solid.vertices)
    low, high = v.min(axis=0), v.max(axis=0)
    near = _NEAR * float((high - low).max())  # of the piece's own size, wherever it stands
    at_corner = ((np.abs(v - low) <= near) | (np.abs(v - high) <= near)).all()
    if len(v) != 8 or not at_corner:
        raise NotApplicable(
            f"block {name!r} is no box along the axes: its solid is not meshed; give bricks of your own (Mesh)"
        )
    return Box(low, high)


def stands_on(upper: Box, lower: Box, near: float) -> bool:
    """Whether a box stands on another, whose top and foot are one within ``near`` [m]."""
    above = abs(upper.low[2] - lower.high[2]) <= near
    return bool(above and (np.minimum(upper.high, lower.high) - np.maximum(upper.low, lower.low))[:2].min() > near)


def mesh_boxes(
    boxes: Sequence[Box],
    size: float | tuple[float, float, float],
    *,
    planes: Sequence[tuple[int, float]] = (),
    nodes: int = 20,
) -> Mesh:
    """Mesh the union of boxes by bricks of at most a size.

    It follows the planes of the outline, not those between boxes.

    Parameters
    ----------
    boxes : may touch, must not overlap with different materials
    size : largest edge of a brick [m], one or three along x, y and z
    planes : further planes (axis 0, 1 or 2, coordinate [m]) that edges must follow, such as limits of a loaded patch
    nodes : of a brick, 20 or 8, see :class:`Mesh`

    Raises
    ------
    InputError
        For no boxes, one whose high corner is not above its low one, sizes that are not positive, and an unknown axis.
    """
    boxes = several("boxes", boxes, Box)
    if not boxes:
        raise InputError("no boxes to mesh")
    for k, b in enumerate(boxes):
        ends = [read_vector(f"boxes[{k}]: {name}", getattr(b, name)) for name in ("low", "high")]
        count(f"boxes[{k}]: material", b.material, least=0)
        if not (ends[1] > ends[0]).all():
            raise InputError(f"boxes[{k}]: high must be above low along x, y and z, got {b.low} and {b.high}")
    planes = read_list("planes", planes)
    for plane in planes:
        if np.shape(plane) != (2,) or plane[0] not in (0, 1, 2) or not np.isfinite(numbers("planes", plane)).all():
            raise InputError(f"planes: give pairs of an axis, 0, 1 or 2, and a coordinate [m], got {plane!r}")
    edge = numbers("size", size)
    if edge.shape not in ((), (3,)):
        raise InputError(f"size of the bricks must be one number or three [m], got {size!r}")
    edge = np.broadcast_to(edge, (3,))
    if not (np.isfinite(edge) & (edge > 0.0)).all():
        raise InputError(f"size of the bricks must be positive [m], got {size!r}")
    low, high = np.array([b.low for b in boxes]), np.array([b.high for b in boxes])
    extent = float((high.max(axis=0) - low.min(axis=0)).max())
    # a grid through the faces of all boxes
    ticks = [_distinct(np.concatenate([low[:, i], high[:, i]]), extent) for i in range(3)]
    filled = _fill(boxes, ticks, extent)
    # a finer one through those planes alone across which the material changes anywhere, as at the outline
    kept = []
    for axis in range(3):
        cells = np.moveaxis(filled, axis, 0)
        outside = np.full((1, *cells.shape[1:]), -1)
        padded = np.concatenate([outside, cells, outside])
        changes = (padded[1:] != padded[:-1]).reshape(len(ticks[axis]), -1).any(axis=1)
        extra = [x for a, x in planes if a == axis and ticks[axis][0] < x < ticks[axis][-1]]
        kept.append(_divided(_distinct(np.concatenate([ticks[axis][changes], extra]), extent), float(edge[axis])))
    material = _fill(boxes, kept, extent)
    # bricks are the filled cells, vertices the points of the grid that they use, in the order of their numbers
    cell = np.argwhere(material >= 0)
    shape = np.array([len(k) for k in kept])
    number = np.ravel_multi_index(tuple(np.moveaxis(cell[:, None] + CORNERS, -1, 0)), tuple(shape))
    used, bricks = np.unique(number, return_inverse=True)
    where = np.stack(np.unravel_index(used, tuple(shape)), axis=1)
    vertices = np.stack([kept[i][where[:, i]] for i in range(3)], axis=1)
    return Mesh(vertices, bricks.reshape(number.shape), material[tuple(cell.T)], nodes)


def _distinct(values: Array, extent: float) -> Array:
    """Coordinates [m] in ascending order, one of those that rounding alone tells apart.

    ``extent`` is the size of the structure [m].
    """
    v = np.sort(values)
    return v[np.concatenate([[True], np.diff(v) > _NEAR * extent])]


def _divided(ticks: Array, size: float) -> Array:
    """Ticks [m], ascending, and equal steps of at most ``size`` [m] between them."""
    parts = [ticks[:1]]
    for a, b in pairwise(ticks.tolist()):
        # less a little: a length of exactly n sizes makes n steps, whatever its rounding
        n = max(1, int(np.ceil((b - a) / size * (1.0 - _WHOLE))))
        parts.append(a + (b - a) * np.arange(1, n + 1) / n)
    return np.concatenate(parts)


def _fill(boxes: Sequence[Box], ticks: Sequence[Array], extent: float) -> Index:
    """Material per cell of a grid, -1 for none, shape (cells along x, y, z).

    Parameters
    ----------
    boxes : of a number of their material each
    ticks : planes of the grid along x, y and z [m]
    extent : size of the structure [m]
    """
    cells = np.full([len(t) - 1 for t in ticks], -1, dtype=np.intp)
    middle = [0.5 * (t[1:] + t[:-1]) for t in ticks]
    slack = _NEAR * extent
    for b in boxes:
        # the middle of a cell may lie on a joint between boxes: both then claim it
        rows = [np.flatnonzero((m > b.low[i] - slack) & (m < b.high[i] + slack)) for i, m in enumerate(middle)]
        cells[np.ix_(*rows)] = b.material
    return cells
