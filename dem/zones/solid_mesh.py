"""Blocks of an assembly in space cut into hexahedral zones.

A rigid block keeps its faces alone.

A block of eight corners and six quadrilateral faces (a brick, a voussoir, a wedge of a dome) is cut by planes that join
points at equal parts of its edges; another one, at each of whose corners three edges meet, first into one hexahedron a
corner, from the centroid to the middles of faces and edges. Faces are made of quadrilateral facets, over which contact
points slide.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dem.driving.zone_marks import BlockMesh
from dem.zones.element import CUBE, FACES, shape_gradients, shape_values
from dem.zones.mesh import need_length
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.geometry import Solid
from limitmason.model import Assembly

Index = NDArray[np.int64]

MOST = 60_000
"""Zones that a mesh in space may have: beyond it a step takes a fiftieth of a second and a run days."""

_FLAT = 0.02  # smallest ratio of volumes at the corners of a zone to that of its middle


@dataclass(frozen=True, kw_only=True)
class SolidMesh(BlockMesh):
    """Nodes, zones and facets of all blocks in space.

    Parameters
    ----------
    facets : nodes of the quadrilaterals of all faces, counter-clockwise from outside, shape (f, 4)
    beside : facet of the same face across each of its edges, -1 at the rim of the face, shape (f, 4)
    facet_block : shape (f,)
    facet_normal : outward, shape (f, 3)
    """

    facets: Index
    beside: Index
    facet_block: Index
    facet_normal: Array

    @property
    def zone_sizes(self) -> Array:
        """Cube root of the volume of every zone, as its middle has it [m], shape (e,)."""
        jacobian = shape_gradients(np.zeros(3)) @ self.place[self.zones]
        return np.asarray(2.0 * np.cbrt(np.linalg.det(jacobian)))


def make_solid_mesh(assembly: Assembly, zone_size: float, stiff: Iterable[int] = ()) -> SolidMesh:
    """Cut the blocks that have a material and are neither held nor ``stiff`` into zones no larger than a size [m].

    Raises
    ------
    InputError
        For a size that is no length, larger than the shortest edge of a block or so small that there are more than
        :data:`MOST` zones; for a block to be cut that is concave, has a corner at which other than three edges meet, or
        is so slanted that a zone would be turned inside out.
    """
    need_length(zone_size)
    rigid = assembly.held.any(axis=1) | np.array([b.material is None for b in assembly.blocks])
    rigid[list(stiff)] = True
    volume = sum(b.volume for b, r in zip(assembly.blocks, rigid, strict=True) if not r)
    if volume > MOST * zone_size**3:
        raise InputError(
            f"zone_size = {zone_size:g} m cuts {volume:.3g} m3 of blocks into {volume / zone_size**3:.1e} zones or "
            f"more; {MOST:.0e} is the most: take {np.cbrt(volume / MOST):.2g} m or larger"
        )
    place: list[Array] = []
    owner: list[Index] = []
    zones: list[Index] = []
    zone_owner: list[Index] = []
    facets: list[Index] = []
    face: list[Index] = []
    facet_owner: list[Index] = []
    count, faces, largest = 0, 0, 0.0
    for i, block in enumerate(assembly.blocks):
        if rigid[i]:
            nodes, cells, quads, of_face = _surface(block.parts)
        else:
            if len(block.parts) > 1:
                raise InputError(
                    f"block {block.name!r} is concave ({len(block.parts)} convex pieces): a zoned block must be "
                    "convex; make it several blocks with a strong joint between them, or leave it rigid by giving it "
                    "no material"
                )
            nodes, cells, quads, of_face = _cut(block.name, block.parts[0], block.centroid, zone_size)
            x = nodes[cells]
            ends = x[:, [0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3]] - x[:, [1, 2, 3, 0, 5, 6, 7, 4, 4, 5, 6, 7]]
            largest = max(largest, float(np.linalg.norm(ends, axis=2).max()))
        place.append(nodes)
        owner.append(np.full(len(nodes), i, dtype=np.int64))
        zones.append(cells + count)
        zone_owner.append(np.full(len(cells), i, dtype=np.int64))
        facets.append(quads + count)
        face.append(of_face + faces)
        facet_owner.append(np.full(len(quads), i, dtype=np.int64))
        count, faces = count + len(nodes), faces + int(of_face.max()) + 1
    where, quads, of_face = np.concatenate(place), np.concatenate(facets), np.concatenate(face)
    x = where[quads]
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return SolidMesh(
        place=where, block=np.concatenate(owner), zones=np.concatenate(zones), zone_block=np.concatenate(zone_owner),
        facets=quads, beside=_beside(quads, of_face), facet_block=np.concatenate(facet_owner), facet_normal=normal,
        rigid=rigid, size=largest,
    )  # fmt: skip


def _beside(facets: Index, face: Index) -> Index:
    """Facet of the same face across every edge, -1 where there is none, shape (f, 4)."""
    ends = np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2)
    key = np.column_stack([np.repeat(face, 4), np.sort(ends, axis=1)])
    order = np.lexsort(key.T)
    same = (key[order[1:]] == key[order[:-1]]).all(axis=1)
    one, two = order[:-1][same], order[1:][same]
    out = np.full(4 * len(facets), -1, dtype=np.int64)
    out[one], out[two] = two // 4, one // 4
    return out.reshape(-1, 4)


def quadrilaterals(polygon: Array) -> tuple[Array, Index]:
    """Corners and quadrilaterals of a convex polygon: itself, or one to each corner from the mean of all, (k, 4)."""
    k = len(polygon)
    if k == 4:
        return polygon, np.arange(4)[None]
    middle = 0.5 * (polygon + np.roll(polygon, -1, axis=0))
    i = np.arange(k)
    quads = np.column_stack([i, k + i, np.full(k, 2 * k), k + (i - 1) % k])
    return np.concatenate([polygon, middle, polygon.mean(axis=0)[None]]), quads


def _surface(parts: Iterable[Solid]) -> tuple[Array, Index, Index, Index]:
    """Nodes, no zones, and the facets of a rigid block with the face of each.

    No node belongs to two faces.
    """
    place: list[Array] = []
    facets: list[Index] = []
    owner: list[int] = []
    count, number = 0, 0
    for part in parts:
        for face in part.faces:
            nodes, quads = quadrilaterals(part.vertices[list(face)])
            place.append(nodes)
            facets.append(quads + count)
            owner += [number] * len(quads)
            count, number = count + len(nodes), number + 1
    return np.concatenate(place), np.zeros((0, 8), np.int64), np.concatenate(facets), np.array(owner, dtype=np.int64)


def _cut(name: str, solid: Solid, centroid: Array, size: float) -> tuple[Array, Index, Index, Index]:
    """Nodes, zones and facets of one block, numbered from 0, and the face of every facet."""
    edges = {tuple(sorted((f[k - 1], f[k]))) for f in solid.faces for k in range(len(f))}
    shortest = min(float(np.linalg.norm(solid.vertices[a] - solid.vertices[b])) for a, b in edges)
    if size > shortest * (1.0 + 1e-9):
        raise InputError(
            f"zone_size = {size:g} m is larger than the shortest edge of block {name!r}, {shortest:g} m: take at most "
            "that"
        )
    met = np.bincount(np.array(sorted(edges)).ravel(), minlength=len(solid.vertices))
    if (met != 3).any():
        raise InputError(
            f"block {name!r} has a corner at which {met[met != 3][0]} edges meet: only blocks with three at each "
            "corner (bricks, voussoirs, prisms) are cut into zones in space; take blocks='simply deformable', or leave "
            "it rigid by giving it no material"
        )
    hexahedra, outer = _one_hexahedron(solid) if _like_a_box(solid) else _corner_hexahedra(solid, centroid)
    x = np.stack(hexahedra)
    if not np.linalg.det(shape_gradients(np.zeros(3)) @ x).min() > 0.0:
        raise InputError(f"block {name!r} is too slanted to be cut into zones: take blocks='simply deformable'")
    lengths = np.stack([np.linalg.norm(x[:, a] - x[:, b], axis=2).max(axis=1) for a, b in _ALONG], axis=1)
    parts = np.maximum(np.ceil(lengths / size - 1e-9).astype(int), 1)
    if len(x) > 1:
        parts[:] = parts.max()
    place, cells, facets, face, count = [], [], [], [], 0
    for corners, (n, m, k), sides in zip(x, parts, outer, strict=True):
        nodes, own, of_side = _grid(corners, int(n), int(m), int(k))
        place.append(nodes)
        cells.append(own + count)
        for side, number in sides:
            facets.append(of_side[side] + count)
            face.append(np.full(len(of_side[side]), number))
        count += len(nodes)
    raw, zones, quads = np.concatenate(place), np.concatenate(cells), np.concatenate(facets)
    if len(x) > 1:
        # one node where hexahedra meet
        key = np.round((raw - raw.min(axis=0)) / (1e-7 * lengths.max()) + 0.37).astype(np.int64)
        _, first, number_of = np.unique(key, axis=0, return_index=True, return_inverse=True)
        number_of = number_of.ravel()
        raw, zones, quads = raw[first], number_of[zones], number_of[quads]
    _check_shapes(name, raw[zones])
    return raw, zones.astype(np.int64), quads.astype(np.int64), np.concatenate(face).astype(np.int64)


_ALONG = (([0, 3, 4, 7], [1, 2, 5, 6]), ([0, 1, 4, 5], [3, 2, 7, 6]), ([0, 1, 2, 3], [4, 5, 6, 7]))
"""Ends of the edges of a hexahedron along each of its directions."""


def _like_a_box(solid: Solid) -> bool:
    return len(solid.vertices) == 8 and len(solid.faces) == 6 and all(len(f) == 4 for f in solid.faces)


def _one_hexahedron(solid: Solid) -> tuple[list[Array], list[list[tuple[int, int]]]]:
    """Corners of a block that is a hexahedron, and the block's face of each of its sides."""
    low = solid.faces[0]
    above = {}
    for f in solid.faces[1:]:
        for k in range(4):
            a, b = f[k - 1], f[k]
            if (a in low) != (b in low):
                above[a if a in low else b] = b if a in low else a
    first = [low[0], low[3], low[2], low[1]]
    corners = np.array(first + [above[v] for v in first])
    named = {frozenset(corners[side].tolist()): k for k, side in enumerate(FACES)}
    return [solid.vertices[corners]], [[(named[frozenset(f)], k) for k, f in enumerate(solid.faces)]]


def _corner_hexahedra(solid: Solid, centroid: Array) -> tuple[list[Array], list[list[tuple[int, int]]]]:
    """A hexahedron for every corner, from the centroid to the middles of its faces and edges."""
    x = solid.vertices
    middle = [x[list(f)].mean(axis=0) for f in solid.faces]
    out, outer = [], []
    for v in range(len(x)):
        around: list[tuple[int, int, int]] = []  # face, and the corners before and after on it
        for k, f in enumerate(solid.faces):
            if v in f:
                at = f.index(v)
                around.append((k, f[at - 1], f[(at + 1) % len(f)]))
        # seen from outside a face goes from the edge after the corner to the edge before it
        u1 = around[0][2]
        u2 = around[0][1]
        (u3,) = {a for _, *two in around for a in two} - {u1, u2}
        shared = {frozenset((before, after)): k for k, before, after in around}
        f12, f13, f23 = (shared[frozenset(pair)] for pair in ((u1, u2), (u1, u3), (u2, u3)))
        if np.linalg.det(np.stack([x[u1] - x[v], x[u2] - x[v], x[u3] - x[v]])) < 0.0:
            u1, u2, f13, f23 = u2, u1, f23, f13
        e1, e2, e3 = (0.5 * (x[v] + x[u]) for u in (u1, u2, u3))
        out.append(np.stack([x[v], e1, middle[f12], e2, e3, middle[f13], centroid, middle[f23]]))
        # of FACES: 0 is -zeta, 2 is -eta, 5 is -xi
        outer.append([(0, f12), (2, f13), (5, f23)])
    return out, outer


def _grid(corners: Array, n: int, m: int, k: int) -> tuple[Array, Index, list[Index]]:
    """Nodes and zones of a hexahedron in n by m by k, and the facets of its sides in the order of ``FACES``."""
    z, y, x = np.meshgrid(*(np.linspace(-1.0, 1.0, c + 1) for c in (k, m, n)), indexing="ij")
    nodes = shape_values(np.stack([x, y, z], axis=-1).reshape(-1, 3)) @ corners
    number = np.arange(len(nodes)).reshape(k + 1, m + 1, n + 1)
    shift = (CUBE > 0).astype(int)
    cells = np.stack([number[c : k + c, b : m + b, a : n + a] for a, b, c in shift], axis=-1)
    ends = (cells[0], cells[-1], cells[:, 0], cells[:, :, -1], cells[:, -1], cells[:, :, 0])
    sides = [e[..., f].reshape(-1, 4) for e, f in zip(ends, FACES, strict=True)]
    return nodes, cells.reshape(-1, 8), sides


def _check_shapes(name: str, x: Array) -> None:
    """Refuse a zone that is flat or turned inside out at a corner."""
    middle = np.linalg.det(shape_gradients(np.zeros(3)) @ x)
    for corner in CUBE:
        if (np.linalg.det(shape_gradients(corner) @ x) < _FLAT * middle).any():
            raise InputError(
                f"block {name!r} is too slanted: a zone of it would be flat or turned inside out; take "
                "blocks='simply deformable', or leave it rigid by giving it no material"
            )
