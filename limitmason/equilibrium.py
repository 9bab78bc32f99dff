"""Contact points and the equilibrium matrix: the one place for normals and lever arms.

A f + w = 0 with f = (N, T1, T2) per contact point, compression positive. The force on block b is
N n + T1 t1 + T2 t2 at the point, the force on block a its opposite; moments are taken about block centroids.
The transpose gives the rates conjugate to f: A^T v = (opening, sliding of b relative to a).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Grid = tuple[int, int]
__all__ = [
    "KINDS",
    "ContactPoints",
    "Plane",
    "contact_points",
    "degrees_of_freedom",
    "equilibrium_matrix",
    "find_plane",
    "project",
]

KINDS = ("bed", "head", "base")


class Plane(NamedTuple):
    """Plane of a two-dimensional problem: horizontal axis, second axis in the plane, and the normal all turn about."""

    axis_1: Array
    axis_2: Array
    normal: Array


class ContactPoints(NamedTuple):
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


def find_plane(assembly: Assembly, loads: Loads) -> Plane | None:
    """The plane of symmetry in which the whole problem takes place, or None for a 3-D problem.

    Blocks, rectangular interfaces and loads must be symmetric about one plane and every normal and force parallel to
    it. The mean of a stress state and its mirror image is then also admissible, so two points per interface on the
    plane give exactly the multiplier of four corners.

    Parameters
    ----------
    assembly, loads : the problem
    """
    x = assembly.arrays
    active = ~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b])
    if not active.any() or (np.diff(x.corner_start)[active] != 4).any():
        return None
    free = ~assembly.fixed
    wrench = np.concatenate([loads.dead[free], loads.live[free]])
    size = max(np.abs(wrench[:, :3]).max(initial=0.0), 1e-300)
    vectors = np.concatenate([x.normal[active], wrench[:, :3] / size])
    corners = x.corners[(x.corner_start[:-1][active, None] + np.arange(4))]
    edge = corners[:, 1] - corners[:, 0]
    # singular values: those of vectors.T @ vectors would be the squares, whose rounding hides a plane that is turned
    _, singular, axes = np.linalg.svd(vectors, full_matrices=False)  # at least three rows: a joint, dead and live load
    if singular[2] > 1e-8 * singular[0]:
        return None
    candidates = [axes[2]]
    if singular[1] <= 1e-6 * singular[0]:  # every normal and force is parallel: any of the two edge directions may do
        e = edge[0] / np.linalg.norm(edge[0])
        candidates = [e, np.cross(x.normal[active][0], e)]
    length = np.linalg.norm(corners.max(axis=(0, 1)) - corners.min(axis=(0, 1)))
    for p in candidates:
        p = p / np.linalg.norm(p) * (1.0 if p[np.abs(p).argmax()] > 0 else -1.0)
        if abs(p[1]) > 0.5 and p[1] < 0:
            p = -p
        height = corners @ p
        middle = x.centroid[free] @ p
        level = float(np.median(middle))
        mirrored = (
            np.abs(np.sort(height, axis=1) + np.sort(height, axis=1)[:, ::-1] - 2 * level).max() <= 1e-7 * length
            and np.abs(middle - level).max() <= 1e-7 * length
        )
        spread = np.sort(np.abs(np.stack([edge @ p, (corners[:, 2] - corners[:, 1]) @ p], axis=1)), axis=1)
        rectangular = spread[:, 0].max() <= 1e-7 * length
        moments = wrench[:, 3:] - (wrench[:, 3:] @ p)[:, None] * p
        quiet = np.abs(moments).max(initial=0.0) <= 1e-9 * size * length
        if mirrored and rectangular and quiet and _supports_fit(assembly.held, p):
            z = np.array([0.0, 0.0, 1.0])
            first = np.cross(p, z) if abs(p[2]) < 0.9 else np.array([1.0, 0.0, 0.0]) - p[0] * p
            first /= np.linalg.norm(first)
            return Plane(first, np.cross(first, p), p)
    return None


def _supports_fit(held: NDArray[np.bool_], p: Array) -> bool:
    partial = held[held.any(axis=1) & ~held.all(axis=1)]
    if not len(partial):
        return True
    uniform = (partial[:, :3].all(axis=1) | ~partial[:, :3].any(axis=1)) & (
        partial[:, 3:].all(axis=1) | ~partial[:, 3:].any(axis=1)
    )
    return bool(uniform.all() or np.isclose(np.abs(p).max(), 1.0, atol=1e-12))


def contact_points(
    assembly: Assembly,
    *,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] = (5, 5),
    plane: Plane | None = None,
    elastic: bool = False,
) -> ContactPoints:
    """Contact points of all interfaces that touch a free block.

    Parameters
    ----------
    contact_model : "vertices", the polygon's corners, exact for rocking of rigid no-tension blocks; or "grid", points
        on a lattice that includes the edges (cell centres would lose 1/n of the lever arm)
    grid : points along the unit's length (or the height of a head joint) and across the thickness, one pair for all
        interfaces, or one per kind of joint ("bed", "head", "base") or per wall, which is how the names of its blocks
        begin ("facade", "return-left"); at least 2 each. Walls go before kinds, and a joint between two walls takes
        the finer of both
    plane : from :func:`find_plane`; points then lie on the plane
    elastic : areas of a grid that bend as the face does, for stiffness (the DEM); False for areas that carry what the
        face carries, for strength: the points are the same

    Returns
    -------
    ContactPoints
        Tributary areas add up to the interface's area and keep its centroid; elastic ones, from 3 points on a side, its
        second moment too. With 2 it is three times too large, which no points at the edges alone can better.
    """
    if contact_model not in ("vertices", "grid"):
        raise InputError(f"contact_model must be 'vertices' or 'grid', got {contact_model!r}")
    x = assembly.arrays
    kinds = np.array([i.kind for i in assembly.interfaces])
    active = np.flatnonzero(~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b]))
    sizes = _grid_sizes(assembly, kinds, contact_model, grid)
    n_corners = np.diff(x.corner_start)
    position, interface, area = [], [], []
    key = np.column_stack([n_corners, sizes])
    for group in np.unique(key[active], axis=0) if len(active) else ():
        rows = active[(key[active] == group).all(axis=1)]
        corners = x.corners[x.corner_start[rows][:, None] + np.arange(group[0])]
        if contact_model == "grid" and group[0] == 4:
            corners = _turned(assembly, rows, corners)
        if plane is not None:
            points, weight = _plane_points(corners, x, rows, plane, int(group[1]), elastic)
        elif contact_model == "vertices":
            points, weight = corners, _corner_areas(corners, x.normal[rows])
        elif group[0] == 4:
            points, weight = _lattice(corners, int(group[1]), int(group[2]), x.normal[rows], elastic)
        else:
            points, weight = _fan_lattice(corners, int(max(group[1:])), x.normal[rows], elastic)
        position.append(points.reshape(-1, 3))
        area.append(weight.ravel())
        interface.append(np.repeat(rows, points.shape[1]))
    if not position:
        empty = np.empty((0, 3))
        k = 3 if plane is None else 2
        none = np.empty(0, np.intp)
        return ContactPoints(empty, none, np.empty(0), np.empty((0, k, 3)), none, none)
    owner = np.concatenate(interface)
    order = np.argsort(owner, kind="stable")
    owner = owner[order]
    n = x.normal[owner]
    if plane is None:
        directions = np.stack([n, x.tangent_1[owner], x.tangent_2[owner]], axis=1)
    else:
        directions = np.stack([n, np.cross(plane.normal, n)], axis=1)
    return ContactPoints(
        np.concatenate(position)[order], owner, np.concatenate(area)[order], directions,
        x.block_a[owner], x.block_b[owner],
    )  # fmt: skip


def _grid_sizes(assembly: Assembly, kinds: NDArray, contact_model: str, grid: Grid | Mapping[str, Grid]) -> Index:
    if contact_model == "vertices":
        return np.full((len(kinds), 2), 2, dtype=np.intp)
    table = grid if isinstance(grid, Mapping) else dict.fromkeys(set(kinds.tolist()), grid)
    for name, size in table.items():
        if np.shape(size) != (2,) or min(size) < 2 or any(int(s) != s for s in size):
            raise InputError(f"grid for {name!r} must be two whole numbers of at least 2, got {size!r}")
    walls = [name for name in table if name not in KINDS]
    names = [block.name for block in assembly.blocks]
    for wall in walls:
        if not any(name.startswith(wall) for name in names):
            raise InputError(
                f"grid has an entry {wall!r}, which is no kind of joint ({', '.join(KINDS)}) and begins the name of no "
                "block"
            )
    sizes = np.empty((len(kinds), 2), np.intp)
    for k, kind in enumerate(kinds.tolist()):
        ends = (assembly.interfaces[k].block_a, assembly.interfaces[k].block_b) if walls else ()
        own = [table[wall] for wall in walls if any(names[block].startswith(wall) for block in ends)]
        if not own and kind not in table:
            raise InputError(f"grid has no entry for joints of kind {kind!r}")
        sizes[k] = np.max(own, axis=0) if own else table[kind]
    return sizes


def _turned(assembly: Assembly, rows: Index, corners: Array) -> Array:
    """Quadrilaterals renumbered so that their first edge runs along the unit, the second across the thickness."""
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1]
    e1 = e1 / np.linalg.norm(e1, axis=1)[:, None]
    e2 = e2 / np.linalg.norm(e2, axis=1)[:, None]
    turn = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1) < np.linalg.norm(corners[:, 2] - corners[:, 1], axis=1)
    for k, row in enumerate(rows):
        i = assembly.interfaces[row]
        pair = sorted((i.block_b, i.block_a), key=lambda b: assembly.fixed[b])
        axis = next((assembly.blocks[b].axis for b in pair if assembly.blocks[b].axis is not None), None)
        if axis is None:
            continue
        across = np.cross(axis, (0.0, 0.0, 1.0))
        if np.linalg.norm(across) <= 1e-6:
            across = np.array([0.0, 1.0, 0.0])  # an upright unit: its thickness is taken along y, as in a wall in x-z
        if max(abs(e1[k] @ across), abs(e2[k] @ across)) > 1e-6:
            turn[k] = abs(e1[k] @ across) > abs(e2[k] @ across)
    return np.where(turn[:, None, None], np.roll(corners, -1, axis=1), corners)


def _corner_areas(corners: Array, normal: Array) -> Array:
    """Tributary areas of polygon corners that add up to the area and keep its centroid.

    Each triangle from the centroid to an edge gives half its area to either end: that is linear interpolation with the
    centroid's own third handed to the corners in the same proportion, which leaves the first moment unchanged.
    """
    r = corners - corners[:, :1]
    part = 0.5 * np.einsum("mti,mi->mt", np.cross(r[:, 1:-1], r[:, 2:]), normal)
    centre = corners[:, 0] + (part[..., None] * (r[:, 1:-1] + r[:, 2:]) / 3.0).sum(axis=1) / part.sum(axis=1)[:, None]
    q = corners - centre[:, None]
    triangle = 0.5 * np.einsum("mti,mi->mt", np.cross(q, np.roll(q, -1, axis=1)), normal)
    return 0.5 * (triangle + np.roll(triangle, 1, axis=1))


def _edge_points(n: int, elastic: bool) -> tuple[Array, Array]:
    """Evenly spaced points on 0 .. 1, ends included, and their weights times 1 - s and s.

    Parameters
    ----------
    elastic : weights with the second moment of the face from n = 3 on; False for the integrals of hat functions

    Returns
    -------
    points : shape (n,)
    share : shape (2, n); the sum of both rows is the weights, which add up to 1

    Notes
    -----
    Any stress below a strength, handed to the points by hat functions, stays below strength times their integrals: what
    limit analysis finds on them comes from above. Their second moment, though, is 1 + 2 / (n - 1)^2 too large, which
    elastic points must not have: handing h / (12 (1 - h)) of each end, h the spacing, to its neighbour makes it right
    (Simpson's rule for n = 3, the 3/8 rule for 4, Gregory's for many; exact up to cubics). Gauss-Lobatto points are
    exact to higher powers but leave an edge 1 / (n (n - 1)) of the area: blocks that overturn stand on it, and it gives
    way. With n = 2 area and centroid are kept; the second moment is then three times too large with any weights.
    """
    s, h = np.linspace(0.0, 1.0, n), 1.0 / (n - 1)
    weight = np.full(n, h)
    weight[[0, -1]] *= 0.5
    if elastic and n > 2:
        handed = h / (12.0 * (1.0 - h))
        weight[[0, -1]] -= handed
        weight[1] += handed
        weight[-2] += handed
        return s, np.stack([weight * (1.0 - s), weight * s])
    share = np.stack([weight * (1.0 - s), weight * s])
    share[:, 0] += np.array([-1.0, 1.0]) * h * h / 6.0
    share[:, -1] += np.array([1.0, -1.0]) * h * h / 6.0
    return s, share


def _lattice(corners: Array, n1: int, n2: int, normal: Array, elastic: bool) -> tuple[Array, Array]:
    """Even lattice of a quadrilateral mapped from the unit square.

    The ratio of areas is linear in either coordinate, so that its values at the corners give the weights exactly.
    """
    (s, along), (t, across) = _edge_points(n1, elastic), _edge_points(n2, elastic)
    a, b, c, d = corners[:, 0], corners[:, 1], corners[:, 2], corners[:, 3]
    low = a[:, None] + s[None, :, None] * (b - a)[:, None]
    high = d[:, None] + s[None, :, None] * (c - d)[:, None]
    points = low[:, :, None] + t[None, None, :, None] * (high - low)[:, :, None]
    m = len(corners)
    weight = np.zeros((m, n1, n2))
    for i, edge in enumerate((b - a, c - d)):
        for j, side in enumerate((d - a, c - b)):
            # tangents at corner (j along, i across)
            ratio = np.einsum("mi,mi->m", np.cross(edge, side), normal)
            weight += ratio[:, None, None] * np.outer(along[j], across[i])
    return points.reshape(m, -1, 3), weight.reshape(m, -1)


def _fan_lattice(corners: Array, n: int, normal: Array, elastic: bool) -> tuple[Array, Array]:
    """Rings of points between the centroid and the boundary of a polygon that is no quadrilateral.

    Every triangle from the centroid to a side is mapped from the unit square, s from the centroid outwards and t along
    the side; its ratio of areas grows as s, so that the centroid itself counts for nothing in exact weights.
    """
    m = len(corners)
    r = corners - corners[:, :1]
    part = 0.5 * np.einsum("mti,mi->mt", np.cross(r[:, 1:-1], r[:, 2:]), normal)
    centre = corners[:, 0] + (part[..., None] * (r[:, 1:-1] + r[:, 2:]) / 3.0).sum(axis=1) / part.sum(axis=1)[:, None]
    s, share = _edge_points(n, elastic)
    outwards, along = share[1], share.sum(axis=0)
    following = np.roll(corners, -1, axis=1)
    side = following - corners
    boundary = (corners[:, :, None] + s[None, None, :-1, None] * side[:, :, None]).reshape(m, -1, 3)
    ratio = np.einsum("mki,mi->mk", np.cross(corners - centre[:, None], side), normal)
    # a corner ends one side and begins the next
    load = ratio[:, :, None] * along[:-1]
    load[:, :, 0] += along[-1] * np.roll(ratio, 1, axis=1)
    load = load.reshape(m, -1)
    rings = range(1, n)
    points = [centre[:, None] + s[k] * (boundary - centre[:, None]) for k in rings]
    weight = [outwards[k] * load for k in rings]
    if outwards[0] > 0.0:
        points, weight = [centre[:, None], *points], [outwards[0] * ratio.sum(axis=1)[:, None], *weight]
    return np.concatenate(points, axis=1), np.concatenate(weight, axis=1)


def _plane_points(corners: Array, x, rows: Index, plane: Plane, n: int, elastic: bool) -> tuple[Array, Array]:
    """Points along each interface on the plane of symmetry, ends included."""
    tangent = np.cross(plane.normal, x.normal[rows])
    s = np.einsum("mki,mi->mk", corners - x.centre[rows][:, None], tangent)
    low, high = s.min(axis=1), s.max(axis=1)
    t, share = _edge_points(n, elastic)
    along = low[:, None] + t * (high - low)[:, None]
    weight = share.sum(axis=0)
    return x.centre[rows][:, None] + along[..., None] * tangent[:, None], x.area[rows][:, None] * weight


def degrees_of_freedom(assembly: Assembly, plane: Plane | None = None) -> tuple[Array, NDArray[np.bool_]]:
    """Basis of a block's motion and which of its coordinates are free.

    Returns
    -------
    basis : shape (6, 6), the unit wrenches; in plane shape (6, 3), two translations and the turn about the normal
    free : shape (n_blocks, 6 or 3)
    """
    if plane is None:
        return np.eye(6), ~assembly.held
    basis = np.zeros((6, 3))
    basis[:3, 0], basis[:3, 1], basis[3:, 2] = plane.axis_1, plane.axis_2, plane.normal
    touched = np.abs(basis) > 1e-9
    free = ~np.stack([assembly.held[:, touched[:, k]].any(axis=1) for k in range(3)], axis=1)
    return basis, free


def equilibrium_matrix(assembly: Assembly, points: ContactPoints, *, plane: Plane | None = None) -> sparse.csc_array:
    """Equilibrium matrix A of A f + w = 0, held degrees of freedom included.

    Parameters
    ----------
    points : contact points; in plane they must come with the same ``plane``

    Returns
    -------
    sparse array, shape (d n_blocks, c m) with d = 6 or 3 degrees of freedom a block and c = 3 or 2 force components a
    point; row d i + j belongs to block i, column c p + q to point p. Force rows [-], moment rows [m].
    """
    m, c = points.count, points.components
    n = assembly.n_blocks
    force = points.directions
    blocks, values = [], []
    # the block with the lower number first: the rows of every column then ascend and need no sorting
    swapped = points.block_b > points.block_a
    for block, sign in (
        (np.minimum(points.block_a, points.block_b), np.where(swapped, -1.0, 1.0)),
        (np.maximum(points.block_a, points.block_b), np.where(swapped, 1.0, -1.0)),
    ):
        arm = points.position - assembly.centroids[block]
        moment = np.cross(arm[:, None], force)
        wrench = sign[:, None, None] * np.concatenate([force, moment], axis=2)  # (m, c, 6)
        if plane is not None:
            basis, _ = degrees_of_freedom(assembly, plane)
            wrench = wrench @ basis
        blocks.append(block)
        values.append(wrench)
    d = values[0].shape[2]
    wrench = np.stack(values, axis=2)  # (m, c, 2, d)
    rows = (d * np.stack(blocks, axis=1))[:, None, :, None] + np.arange(d)
    rows = np.broadcast_to(rows, wrench.shape).ravel()
    starts = np.arange(m * c + 1) * (2 * d)
    matrix = sparse.csc_array((wrench.ravel(), rows, starts), shape=(d * n, c * m))
    matrix.eliminate_zeros()
    return matrix


def project(wrench: Array, basis: Array) -> Array:
    """Wrenches (n, 6) on the degrees of freedom of :func:`degrees_of_freedom`, shape (n, d)."""
    return wrench @ basis
