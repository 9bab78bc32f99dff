"""Blocks of a plane assembly cut into quadrilateral zones.

A rigid block keeps its corners alone.

The plane is x-z, thickness runs along y. Every side of a block is a chain of nodes, counter-clockwise, to which the
contact points of its joints are attached.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array, Flags
from limitmason.errors import InputError
from limitmason.geometry import polygon_area_centroid
from limitmason.model import Assembly

Index = NDArray[np.int64]

MOST = 300_000
"""Zones that a mesh may have: beyond it a step takes a tenth of a second and a run days."""

_FLAT = 1e-6
"""Distance from a plane, over the size of a block, up to which a corner lies in it [-]."""

_ONE_NODE = 1e-7
"""Distance over the longest side of a block up to which nodes of two patches are one [-]."""

_WHOLE = 1e-9
"""Part by which a length may exceed a whole number of zones by rounding [-]."""


@dataclass(frozen=True, kw_only=True)
class ZoneMesh:
    """Nodes, zones and sides of all blocks in the plane x-z.

    Parameters
    ----------
    place : nodes in the reference position [m], x and z, shape (n, 2)
    block : of every node, shape (n,)
    zones : nodes of every zone, counter-clockwise, shape (e, 4)
    zone_block : block of every zone, shape (e,)
    rigid : blocks without zones, shape (b,)
    size : largest zone edge [m]
    sides : nodes along each side of every block, counter-clockwise, in a row
    side_start : first entry of every side in ``sides``, shape (s + 1,)
    side_block : block of every side, shape (s,)
    thickness : of every block [m], shape (b,)
    """

    place: Array
    block: Index
    zones: Index
    zone_block: Index
    rigid: Flags
    size: float
    sides: Index
    side_start: Index
    side_block: Index
    thickness: Array

    @property
    def zone_sizes(self) -> Array:
        """Edge of a square as large as every zone [m], shape (e,)."""
        corners = self.place[self.zones]
        one, two = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
        return np.sqrt(0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]))


def outline_of(assembly: Assembly, number: int) -> tuple[Array, float]:
    """Outline in x-z and thickness of a block, a convex prism along y.

    Parameters
    ----------
    number : of the block in the assembly

    Returns
    -------
    outline : counter-clockwise [m], shape (k, 2)
    thickness : [m]

    Raises
    ------
    InputError
        For a block of several pieces and one that is not a prism along y.
    """
    block = assembly.blocks[number]
    if len(block.parts) > 1:
        raise InputError(
            f"block {block.name!r} is concave ({len(block.parts)} convex pieces): a zoned block must be convex; make "
            "it several blocks with a strong joint between them, or leave it rigid by fixing it"
        )
    # all corners in two planes across y, and at the same places x, z in both
    v = block.parts[0].vertices
    low, high = v[:, 1].min(), v[:, 1].max()
    size = float(np.ptp(v, axis=0).max())
    front = np.abs(v[:, 1] - low) <= _FLAT * size
    back = np.abs(v[:, 1] - high) <= _FLAT * size
    flat, other = v[front][:, [0, 2]], v[back][:, [0, 2]]
    same = len(flat) == len(other) and all(np.linalg.norm(other - p, axis=1).min() <= _FLAT * size for p in flat)
    if not (front | back).all() or not same:
        raise InputError(
            f"block {block.name!r} is not a prism along y: zoned blocks in the plane are for walls in x-z of one "
            "thickness; in space take simply deformable blocks, which strain and bend"
        )
    # a convex outline in order of the angle about its middle
    r = flat - flat.mean(axis=0)
    return flat[np.argsort(np.arctan2(r[:, 1], r[:, 0]))], float(high - low)


def make_mesh(assembly: Assembly, zone_size: float, stiff: Iterable[int] = ()) -> ZoneMesh:
    """Cut the blocks that have a material and are neither held nor stiff into zones.

    A quadrilateral block is cut by lines that join points at equal parts of opposite sides; another convex one first
    into quadrilaterals from its centroid to the middles of its sides.

    Parameters
    ----------
    assembly : of blocks that are convex prisms along y
    zone_size : largest edge of a zone [m]
    stiff : numbers of further blocks that stay rigid

    Raises
    ------
    InputError
        For a zone size that is no length, larger than a block's least side, or so small that there are more than
        ``MOST`` zones, and as :func:`outline_of`.
    """
    if isinstance(zone_size, bool) or not isinstance(zone_size, int | float | np.number) or not 0 < zone_size < np.inf:
        raise InputError(f"zone_size must be a positive length [m], got {zone_size!r}")
    outlines, thickness = zip(*(outline_of(assembly, i) for i in range(assembly.n_blocks)), strict=True)
    area = np.array([polygon_area_centroid(outline)[0] for outline in outlines])
    rigid = assembly.held.any(axis=1) | np.array([b.material is None for b in assembly.blocks])
    rigid[list(stiff)] = True
    cut_area = sum(area[~rigid].tolist())
    if cut_area > MOST * zone_size**2:
        raise InputError(
            f"zone_size = {zone_size:g} m cuts {cut_area:.3g} m2 of wall into {cut_area / zone_size**2:.1e} zones or "
            f"more; {MOST:.0e} is the most: take {np.sqrt(cut_area / MOST):.2g} m or larger"
        )
    parts: list[tuple[Array, Index, list[Index]]] = []
    count, largest = 0, 0.0
    for i, (block, outline) in enumerate(zip(assembly.blocks, outlines, strict=True)):
        edges = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
        if rigid[i]:
            nodes, cells = outline, np.zeros((0, 4), np.int64)
            chains = [np.array([k, (k + 1) % len(outline)]) for k in range(len(outline))]
        else:
            if zone_size > edges.min() * (1.0 + _WHOLE):
                raise InputError(
                    f"zone_size = {zone_size:g} m is larger than the shortest side of block {block.name!r}, "
                    f"{edges.min():g} m: take at most that"
                )
            nodes, cells, chains = _cut(outline, edges, zone_size)
            x = nodes[cells]
            largest = max(largest, float(np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).max()))
        parts.append((nodes, cells + count, [chain + count for chain in chains]))
        count += len(nodes)
    place, zones, chains_of = zip(*parts, strict=True)
    of_node, of_zone, of_side = (
        np.repeat(np.arange(len(parts)), [len(x) for x in items]) for items in (place, zones, chains_of)
    )
    sides = [chain for chains in chains_of for chain in chains]
    return ZoneMesh(
        place=np.concatenate(place), block=of_node, zones=np.concatenate(zones), zone_block=of_zone,
        sides=np.concatenate(sides), side_start=np.cumsum([0, *map(len, sides)]), side_block=of_side,
        thickness=np.array(thickness), rigid=rigid, size=largest,
    )


def _parts(length: float, size: float) -> int:
    """Least number of equal parts no longer than ``size`` of a ``length``, both [m]."""
    return max(int(np.ceil(length / size - _WHOLE)), 1)


def _cut(outline: Array, edges: Array, size: float) -> tuple[Array, Index, list[Index]]:
    """Nodes, zones and side chains of one block, numbered from 0.

    A quadrilateral is one patch of n by m zones. Any other polygon is cut into one quadrilateral patch per corner: the
    corner, the middles of its two sides, and the centroid.

    Parameters
    ----------
    outline : corners, counter-clockwise [m], shape (k, 2)
    edges : lengths of its sides [m], shape (k,)
    size : largest edge of a zone [m]

    Returns
    -------
    nodes : places [m], shape (n, 2)
    cells : nodes of every zone, counter-clockwise, shape (z, 4)
    chains : nodes along every side, in the order of the outline
    """
    if len(outline) == 4:
        n, m = _parts(max(edges[0], edges[2]), size), _parts(max(edges[1], edges[3]), size)
        nodes, cells = _patch(outline, n, m)
        grid = np.arange((n + 1) * (m + 1)).reshape(m + 1, n + 1)
        return nodes, cells, [grid[0], grid[:, -1], grid[-1, ::-1], grid[::-1, 0]]
    k = len(outline)
    centre = polygon_area_centroid(outline)[1]
    middle = 0.5 * (outline + np.roll(outline, -1, axis=0))
    n = _parts(0.5 * float(edges.max()), size)  # the same for all patches, so that their nodes meet
    nodes_of, cells_of = [], []
    for i in range(k):
        corners = np.array([outline[i], middle[i], centre, middle[i - 1]])
        nodes, cells = _patch(corners, n, n)
        cells_of.append(cells + i * len(nodes))
        nodes_of.append(nodes)
    raw, cells = np.concatenate(nodes_of), np.concatenate(cells_of)
    # one node where patches meet: nodes at one place, once rounded, get one ``number``
    key = np.round((raw - raw.min(axis=0)) / (_ONE_NODE * edges.max())).astype(np.int64)
    _, first, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    number = number.ravel()
    grid = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)  # nodes of a patch before that
    step = (n + 1) ** 2
    # a side runs along the first side of its first corner's patch, then along the last of the next corner's
    chains = [
        number[np.concatenate([grid[0] + i * step, grid[::-1, 0][1:] + ((i + 1) % k) * step])] for i in range(k)
    ]
    return raw[first], number[cells], chains


def _patch(corners: Array, n: int, m: int) -> tuple[Array, Index]:
    """Nodes and zones of a quadrilateral cut into n by m, from its first side on.

    Parameters
    ----------
    corners : counter-clockwise [m], shape (4, 2)
    n, m : how many zones along the first side, and along the second

    Returns
    -------
    nodes : [m], shape ((n + 1) (m + 1), 2)
    cells : four nodes of every zone, shape (n m, 4)
    """
    s, t = np.meshgrid(np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 1.0, m + 1))
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)
    first = (np.arange(m)[:, None] * (n + 1) + np.arange(n)).ravel()
    cells = np.column_stack([first, first + 1, first + n + 2, first + n + 1])
    return (weights @ corners).reshape(-1, 2), cells.astype(np.int64)
