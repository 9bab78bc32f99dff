"""Stones drawn with open joints: each takes the mortar that lies nearer to it than to any other. Needs shapely.

The distance from a convex outline is that of its mitred offsets, max_k (n_k . x - c_k) over its sides; negative inside.
Where two of them are equal the stones meet: half-way between their sides, also where these are not parallel or overlap.
A polygon of such parts has the least of their distances. Nearness divides the plane, so that stones cannot overlap.
Scanned stones, in space, are made to meet by :mod:`limitmason.formats.stones`.

``rings`` are outlines x, z [m], shape (n, 2) each; ``shapely`` is the module, passed on as it is optional; ``reach`` is
half of the widest joint and ``grid`` the size to which coordinates are rounded [m].
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.geometry.polygon import convex_pieces
from limitmason.geometry.splitting import split_polygon

FINE = 1e-9
"""Grid of the drawing while it is divided, over the thickness of the mortar."""

POCKET = 16.0
"""Holes between stones of a smaller area, over half a joint squared, are mortar too; chosen."""

_NEAR = 10.0
"""Distance over the grid within which rounded outlines touch; chosen."""

_SLIVER = 1e3
"""Area over perimeter and grid below which what is left between stones is rounding; chosen."""

_SIMPLER = 1e4
"""Distance over the grid up to which an outline loses corners; chosen, a hundred-thousandth of the mortar."""

_PARALLEL = 1e-12
"""Difference of two unit normals below which sides are parallel; chosen, above rounding."""


class _Sides(NamedTuple):
    """Outward unit normals (k, 2) and offsets (k,) of a convex part."""

    normal: Array
    offset: Array


def grown(rings: Sequence[Array], names: Sequence[str], mortar: float, gap: float, shapely: Any) -> list[Array]:
    """Outlines that share the mortar between them [m], shape (n, 2) each.

    Filled is the closing of all stones: dilated, then eroded, by half the mortar's thickness and the gap, mitred. So
    joints of up to the thickness and twice the gap are filled, openings and the space beside the wall are not.

    Parameters
    ----------
    rings : outlines x, z [m], shape (n, 2) each, counter-clockwise
    names : of the stones, for errors
    mortar : thickness of the joints [m]
    gap : half of what one may be thicker [m]
    shapely : the module

    Raises
    ------
    InputError
        Naming a stone that lies within another one.
    """
    grid, reach = FINE * mortar, 0.5 * mortar + gap
    stones = [shapely.Polygon(r) for r in rings]
    whole = shapely.union_all(stones, grid_size=grid)
    closed = whole.buffer(reach, join_style="mitre").buffer(-reach, join_style="mitre")
    whole = _bridged(shapely.union(whole, closed, grid_size=grid), stones, reach, grid, shapely)
    # by the full width of a joint: what two stones could both have is shared out below
    wide = [s.buffer(2.0 * reach, join_style="mitre") for s in stones]
    wide = [_areas(shapely.intersection(w, whole, grid_size=grid), shapely) for w in wide]
    parts = [[_sides(piece) for piece in convex_pieces(r)] for r in rings]
    taken: list[list[Any]] = [[] for _ in stones]
    for i, j in sorted((int(a), int(b)) for a, b in shapely.STRtree(wide).query(wide, predicate="intersects").T):
        if i >= j:
            continue
        common = _areas(shapely.intersection(wide[i], wide[j], grid_size=grid), shapely)
        if common.area > 0.0:
            # mortar that two stones could have goes to the nearer one, wherever their wide outlines overlap
            near = _nearer(parts[i], parts[j], common.bounds, shapely)
            mine = _areas(shapely.intersection(common, near, grid_size=grid), shapely)
            taken[j].append(mine)
            taken[i].append(_areas(shapely.difference(common, mine, grid_size=grid), shapely))
    own = []
    for w, lost in zip(wide, taken, strict=True):
        own.append(shapely.difference(w, shapely.union_all(lost, grid_size=grid), grid_size=grid) if lost else w)
    return _outlines(own, whole, stones, names, grid, shapely)


def _bridged(whole: Any, stones: list[Any], reach: float, grid: float, shapely: Any) -> Any:
    """The filled region with joints that it lacks, and with small pockets.

    Lacking are joints between near stones where the region leaves out the shortest way between the two.

    Parameters
    ----------
    whole : region filled so far, of shapely
    stones : outlines of the stones, polygons of shapely
    reach : half of the widest joint [m]
    grid : size to which coordinates are rounded [m]
    shapely : the module
    """
    more, tree = [], shapely.STRtree(stones)
    for i, j in tree.query(stones, predicate="dwithin", distance=2.0 * reach).T:
        if i < j and not whole.buffer(_NEAR * grid).covers(shapely.shortest_line(stones[i], stones[j])):
            # the joint is the hull of what each stone has within its width of the other
            a, b = stones[i], stones[j]
            facing = [p.intersection(q.buffer(2.0 * reach)) for p, q in ((a, b), (b, a))]
            more.append(shapely.union_all(facing).convex_hull)
    whole = shapely.union_all([whole, *more], grid_size=grid)
    pockets = [shapely.Polygon(hole) for p in shapely.get_parts(whole) for hole in p.interiors]
    return shapely.union_all([whole, *(p for p in pockets if p.area < POCKET * reach**2)], grid_size=grid)


def _outlines(
    own: list[Any], whole: Any, stones: list[Any], names: Sequence[str], grid: float, shapely: Any
) -> list[Array]:
    """Outlines of stones that together fill a region [m], shape (k, 2) each.

    What is cut off from a stone, or is nobody's, goes to the neighbour with the longest border.

    Parameters
    ----------
    own : cell of every stone, of shapely; changed in place
    whole : region to fill
    stones : as they are drawn, polygons of shapely
    names : of the stones, for errors
    grid : size to which coordinates are rounded [m]
    shapely : the module
    """
    for k, (cell, stone) in enumerate(zip(own, stones, strict=True)):
        pieces = [p for p in shapely.get_parts(cell) if p.geom_type == "Polygon"]
        own[k] = max(pieces, key=lambda p: p.intersection(stone).area, default=stone)
        # its neighbours took most of the stone itself
        if own[k].intersection(stone).area < 0.5 * stone.area:
            raise InputError(f"{names[k]}: lies in another stone; leave one of them out")
    rest = shapely.difference(whole, shapely.union_all(own, grid_size=grid), grid_size=grid)
    left = [p for p in shapely.get_parts(rest) if p.area > _SLIVER * grid * p.length]
    for piece in sorted(left, key=lambda p: -p.area):
        near = shapely.STRtree(own).query(piece, predicate="dwithin", distance=_NEAR * grid)
        border = [own[k].intersection(piece.boundary.buffer(_NEAR * grid)).length for k in near]
        if len(near):
            k = int(near[int(np.argmax(border))])
            own[k] = shapely.union(own[k], piece, grid_size=grid)
    out = []
    for cell, name in zip(own, names, strict=True):
        if cell.geom_type != "Polygon" or len(cell.interiors):
            raise InputError(f"{name}: goes around another stone; draw it as two")
        plain = cell.simplify(_SIMPLER * grid)
        out.append(np.array(shapely.geometry.polygon.orient(plain).exterior.coords[:-1]))
    return out


def _sides(piece: Array) -> _Sides:
    """Normals and offsets of a convex part.

    ``piece`` are its corners x, z counter-clockwise [m], shape (k, 2).
    """
    along = np.roll(piece, -1, axis=0) - piece
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    return _Sides(normal, np.einsum("ij,ij->i", normal, piece))


def _nearer(a: list[_Sides], b: list[_Sides], bounds: tuple[float, ...], shapely: Any) -> Any:
    """Region of a box that lies nearer to one stone than to another, of shapely.

    Nearer to a convex part p than to q: for some side l of q, all sides k of p, n_k . x - c_k <= n_l . x - c_l.
    Nearer to a stone than to another: to some part of it than to all parts of the other.

    Parameters
    ----------
    a : convex parts of the stone
    b : convex parts of the other
    bounds : of the box [m]: least x, least z, largest x, largest z
    shapely : the module
    """
    left, low, right, high = bounds
    box = np.array([[left, low], [right, low], [right, high], [left, high]])
    regions = []
    for p in a:
        nearer_than = []
        for q in b:
            sides = zip(q.normal, q.offset, strict=True)
            cut = [_within_half_planes(box, p.normal - n, p.offset - c) for n, c in sides]
            nearer_than.append(shapely.union_all([shapely.Polygon(c) for c in cut if c is not None]))
        regions.append(_areas(shapely.intersection_all(nearer_than), shapely))
    return _areas(shapely.union_all(regions), shapely)


def _areas(found: Any, shapely: Any) -> Any:
    """What of a result of shapely has an area.

    Lines and points in which outlines only touch are left out.
    """
    return shapely.union_all([p for p in shapely.get_parts(found) if p.geom_type == "Polygon"])


def _within_half_planes(polygon: Array, normals: Array, offsets: Array) -> Array | None:
    """Part of a convex polygon in which all n . x <= c, shape (m, 2).

    It is None where nothing is left.

    Parameters
    ----------
    polygon : corners [m], shape (j, 2)
    normals : n of every half plane, of any length, shape (k, 2)
    offsets : c of every half plane, shape (k,)
    """
    size = float(np.ptp(polygon, axis=0).max())
    left: Array | None = polygon
    for n, c in zip(normals, offsets, strict=True):
        if left is None:
            return None
        if (left @ n <= c).all():
            continue
        length = float(np.hypot(*n))
        if length < _PARALLEL:
            # no line divides the plane: 0 <= c holds everywhere, or nowhere
            if c < 0.0:
                return None
            continue
        # the part behind the line is kept; corners within rounding of the line lie on it
        left, _ = split_polygon(left, n * c / length**2, n / length, slack=1e-12 * size)
    return left
