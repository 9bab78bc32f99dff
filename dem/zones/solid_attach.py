"""Contact points of joints in space, attached to the facets of the blocks on either side."""

from collections.abc import Iterable

import numpy as np

from dem.kernels.arrays import Index
from dem.kernels.solid_arrays import FaceContacts, Facets
from dem.model.joints import Grid, make_points
from dem.zones.solid_mesh import SolidMesh, quadrilaterals
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.model import Assembly

_SIGNS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
_FACING = 0.9  # cosine from which a facet faces the way of a joint
_PASSES = 30


def make_facets(mesh: SolidMesh) -> Facets:
    """Facets as the kernel takes them."""
    return Facets(mesh.facets, mesh.beside)


def make_face_contacts(assembly: Assembly, mesh: SolidMesh, grid: Grid | None) -> tuple[FaceContacts, Index]:
    """Contact points of all joints that touch a block not held, and the interface of each row of the law.

    Parameters
    ----------
    grid : as in the rigid DEM, at its places and with its areas; None puts points no further apart than the facets of
        the finer of both faces are wide, each with the area that a bilinear pressure gives it: what zones under a
        uniform stress ask for. Points further apart than the nodes dent them

    Raises
    ------
    InputError
        For a joint that lies on no face of one of its blocks.
    """
    x = assembly.arrays
    if grid is None:
        interfaces = np.flatnonzero(~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b]))
        laid = [_spread(x.corners[x.corner_start[k] : x.corner_start[k + 1]], _met(assembly, mesh, k))
                for k in interfaces.tolist()]  # fmt: skip
        position, area = np.concatenate([p for p, _ in laid]), np.concatenate([a for _, a in laid])
        owner = np.repeat(interfaces, [len(a) for _, a in laid])
    else:
        found = make_points(assembly, grid, "grid")
        position, area, owner = found.position, found.area, np.asarray(found.interface)
    interfaces, row = np.unique(owner, return_inverse=True)
    m = len(area)
    facet, other = np.zeros(m, np.int64), np.zeros(m, np.int64)
    local, share, origin, gap = np.zeros((m, 2)), np.zeros((m, 4)), np.zeros((m, 3)), np.zeros(m)
    corners = mesh.place[mesh.facets]
    for k in interfaces.tolist():
        own = np.flatnonzero(owner == k)
        i = assembly.interfaces[k]
        normal = np.asarray(i.normal)
        facet[own], local[own] = _nearest(assembly, mesh, k, i.block_a, normal, position[own])
        other[own], at = _nearest(assembly, mesh, k, i.block_b, -normal, position[own])
        share[own] = bilinear(at)
        on_b = np.einsum("mk,mki->mi", share[own], corners[other[own]])
        # the foot on a of where b has it: faces that touch within the tolerance meet where the model is made
        local[own], _ = _feet(corners[facet[own]], on_b)
        origin[own] = np.einsum("mk,mki->mi", bilinear(local[own]), corners[facet[own]])
        gap[own] = -((on_b - origin[own]) * mesh.facet_normal[facet[own]]).sum(axis=1)
    zero = np.zeros(m)
    tangent = np.stack([x.tangent_1[interfaces], x.tangent_2[interfaces]], axis=1)
    contacts = FaceContacts(
        row.ravel().astype(np.int64), facet, local, origin, mesh.facets[other], share, np.ascontiguousarray(area), gap,
        np.zeros((m, 2)), zero, zero.copy(), np.ascontiguousarray(tangent),
    )  # fmt: skip
    return contacts, interfaces.astype(np.int64)


def bilinear(local: Array) -> Array:
    """Shape functions of a facet's nodes at local places, (m, 2) to (m, 4)."""
    return np.asarray(0.25 * np.prod(1.0 + local[:, None, :] * _SIGNS, axis=2))


def bilinear_slopes(local: Array) -> tuple[Array, Array]:
    """Their derivatives along both local directions, two of (m, 4)."""
    s, t = local[:, :1], local[:, 1:]
    return 0.25 * _SIGNS[:, 0] * (1.0 + t * _SIGNS[:, 1]), 0.25 * _SIGNS[:, 1] * (1.0 + s * _SIGNS[:, 0])


def _met(assembly: Assembly, mesh: SolidMesh, interface: int) -> list[Array]:
    """Corners of the facets that meet in an interface, of either block, shapes (f, 4, 3)."""
    i = assembly.interfaces[interface]
    normal = np.asarray(i.normal)
    ends = ((i.block_a, normal), (i.block_b, -normal))
    return [mesh.place[mesh.facets[_facing(assembly, mesh, interface, block, n)]] for block, n in ends]


def _spread(polygon: Array, met: Iterable[Array]) -> tuple[Array, Array]:
    """Points of a polygon no further apart than facets are wide, and the areas that go with bilinear functions [m2]."""
    nodes, quads = quadrilaterals(polygon)
    where, areas = [], []
    for quad in nodes[quads]:
        edges = np.roll(quad, -1, axis=0) - quad
        length = np.linalg.norm(edges, axis=1)
        along = edges / length[:, None]
        # of each face its widest facet, and the finer face
        wide = np.min([np.ptp(corners @ along.T, axis=1).max(axis=0) for corners in met], axis=0)
        parts = np.maximum(np.ceil(length / wide - 1e-6).astype(int), 1)
        n, m = int(parts[[0, 2]].max()), int(parts[[1, 3]].max())
        s, t = np.meshgrid(np.linspace(-1.0, 1.0, n + 1), np.linspace(-1.0, 1.0, m + 1))
        points = bilinear(np.column_stack([s.ravel(), t.ravel()])) @ quad
        first = (np.arange(m)[:, None] * (n + 1) + np.arange(n)).ravel()
        cells = np.column_stack([first, first + 1, first + n + 2, first + n + 1])
        area = np.zeros(len(points))
        for place in _SIGNS / np.sqrt(3.0):
            g, h = (points[cells].transpose(0, 2, 1) @ d[0] for d in bilinear_slopes(place[None]))
            np.add.at(area, cells, np.linalg.norm(np.cross(g, h), axis=1)[:, None] * bilinear(place[None]))
        where.append(points)
        areas.append(area)
    points, area = np.concatenate(where), np.concatenate(areas)
    if len(quads) == 1:
        return points, area
    # one point where quadrilaterals meet
    key = np.round((points - points.min(axis=0)) / (1e-7 * np.ptp(points, axis=0).max()) + 0.37).astype(np.int64)
    _, first, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return points[first], np.asarray(np.bincount(number.ravel(), area), dtype=float)


def _nearest(
    assembly: Assembly, mesh: SolidMesh, interface: int, block: int, normal: Array, points: Array
) -> tuple[Index, Array]:
    """Facet of a block with an outward normal, and place on it, nearest to each point: shapes (m,) and (m, 2)."""
    own = _facing(assembly, mesh, interface, block, normal)
    corners = mesh.place[mesh.facets[own]]
    m, f = len(points), len(own)
    local, off = _feet(np.tile(corners, (m, 1, 1)), np.repeat(points, f, axis=0))
    off = np.where(np.isfinite(off), off, np.inf).reshape(m, f)
    size = np.ptp(corners.reshape(-1, 3), axis=0).max()
    # of facets that meet at the point the first, so that nothing hangs on rounding
    at = np.argmax(off <= off.min(axis=1)[:, None] + 1e-9 * size, axis=1)
    return own[at], local.reshape(m, f, 2)[np.arange(m), at]


def _facing(assembly: Assembly, mesh: SolidMesh, interface: int, block: int, normal: Array) -> Index:
    """Facets of a block that face the way of a joint."""
    own = np.flatnonzero((mesh.facet_block == block) & (mesh.facet_normal @ normal > _FACING))
    if not len(own):
        i = assembly.interfaces[interface]
        a, b = assembly.blocks[i.block_a].name, assembly.blocks[i.block_b].name
        raise InputError(
            f"the joint between {a!r} and {b!r} lies on no face of {assembly.blocks[block].name!r}: zoned blocks meet "
            "face to face"
        )
    return own


def _feet(corners: Array, points: Array) -> tuple[Array, Array]:
    """Local places nearest to points on bilinear facets, -1 to 1, and the distances [m].

    (m, 4, 3), (m, 3).
    """
    local = np.zeros((len(points), 2))
    for _ in range(_PASSES):
        r = points - np.einsum("mk,mki->mi", bilinear(local), corners)
        g, h = (np.einsum("mk,mki->mi", d, corners) for d in bilinear_slopes(local))
        gg, gh, hh = (g * g).sum(axis=1), (g * h).sum(axis=1), (h * h).sum(axis=1)
        rg, rh = (r * g).sum(axis=1), (r * h).sum(axis=1)
        det = np.maximum(gg * hh - gh * gh, 1e-12 * gg * hh)
        step = np.column_stack([hh * rg - gh * rh, gg * rh - gh * rg]) / det[:, None]
        local = np.clip(local + step, -1.0, 1.0)
    r = points - np.einsum("mk,mki->mi", bilinear(local), corners)
    return local, np.linalg.norm(r, axis=1)
