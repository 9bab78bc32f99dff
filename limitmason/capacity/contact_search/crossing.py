"""Edges that cross where two faces lie on each other in space: corners of their overlap that are no block's corner.

The overlap of two faces has three kinds of corners: those of either face inside the other, and the places where a side
of one crosses a side of the other. These move along both sides as blocks slide: the point stays on the one along which
it moves less, with the frame on the face of the other, and is put back where the sides cross once it is off by more
than an overshoot.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.contact_search.faces import Shapes, turned
from limitmason.capacity.contact_search.model_faces import shapes_of, with_faces
from limitmason.capacity.contact_search.near import Near, all_pairs, facing, gap_and_inside, near_blocks, near_corners
from limitmason.capacity.contacts import PathContacts, turned_over
from limitmason.capacity.kinematics import Pose, at_rest
from limitmason.geometry.rotation import vector_product
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly

_PARALLEL = 0.02
"""Sine of the angle of two sides below which they are taken to run beside each other [-]: chosen."""

_ONE_PLACE = 1e-2
"""Part of an overshoot, or of the near gap, within which two places of the reference pose are one [-]: chosen."""

_SLID = 1e-9
"""Part of a block's size that two blocks must have slid for it to count as a slide [-]: rounding."""


class Crossings(NamedTuple):
    """Sides of two faces that cross in a pose.

    The first side is of the block with the lower number. Arrays of numbers have the shape (k,), those of points and
    directions (k, 3).

    ``side`` are the corners at which both sides begin, ``place`` the points of both in the reference pose [m];
    ``gap`` [m] is along the normal of the first face, negative where they overlap, ``inside`` the least distance from
    the ends of either side [m], ``along`` both sides' directions in the pose.
    """

    side: tuple[Index, Index]
    place: tuple[Array, Array]
    gap: Array
    inside: Array
    along: tuple[Array, Array]


def following(shapes: Shapes) -> Index:
    """Number of the corner that follows every corner round its face, shape (q,), where its side ends."""
    n = len(shapes.corner_face)
    out = np.arange(1, n + 1)
    first = np.flatnonzero(np.diff(shapes.corner_face, prepend=-1))
    out[np.append(first[1:], n) - 1] = first
    return out


class _CrossedLines(NamedTuple):
    """Where the lines of k pairs of sides meet in a pose, as seen along the normal of the first side's face.

    Parameters
    ----------
    shares : of the length of the first and of the second side at which they meet [-], shape (k,) each
    gap : from the first to the second side there, along the normal [m], shape (k,)
    inside : how far from the ends of both sides that is, negative outside [m], (k,); -inf where they are parallel
    along : unit vectors along both sides in the pose, shape (k, 3) each
    """

    shares: tuple[Array, Array]
    gap: Array
    inside: Array
    along: tuple[Array, Array]


def _crossed_lines(shapes: Shapes, pose: Pose, p: Index, q: Index) -> _CrossedLines:
    """Where the lines of two sides meet as seen along the normal of the first side's face.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    pose : where the blocks are
    p, q : numbers of the corners at which the sides begin, shape (k,)
    """
    now = shapes.placed(pose, shapes.owner, shapes.corner_place)
    after, face = following(shapes), shapes.corner_face[p]
    n = turned(pose, shapes.face_block[face], shapes.normal[face])
    u, v, apart = now[after[p]] - now[p], now[after[q]] - now[q], now[q] - now[p]

    def area(a: Array, b: Array) -> Array:
        """Areas n . (a x b) that pairs of vectors span as seen along the normals [m2]."""
        return np.asarray(np.einsum("ij,ij->i", n, vector_product(a, b)))

    long_u, long_v = np.linalg.norm(u, axis=1), np.linalg.norm(v, axis=1)
    both = area(u, v)
    clear = np.abs(both) > _PARALLEL * long_u * long_v
    both = np.where(clear, both, 1.0)
    # Cramer's rule in the plane of the face, where area is the product across it
    s, t = area(apart, v) / both, area(apart, u) / both
    gap = np.einsum("ij,ij->i", n, apart + t[:, None] * v - s[:, None] * u)
    inside = np.minimum(np.minimum(s, 1.0 - s) * long_u, np.minimum(t, 1.0 - t) * long_v)
    unit = u / long_u[:, None], v / long_v[:, None]
    return _CrossedLines((s, t), gap, np.where(clear, inside, -np.inf), unit)


def crossings(shapes: Shapes, pose: Pose, inside: float, depth: float = 0.0) -> Crossings:
    """Sides of faces that look at each other, which cross in a pose and are near there.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    pose : where the blocks are
    depth : by which sides may lie behind each other beyond the near gap, as the springs of soft joints let them [m]
    inside : least distance from the ends of both sides [m]
    """
    # the block with the lower number has the first side
    one, two = near_blocks(shapes, pose, depth)
    f, g = facing(shapes, pose, np.minimum(one, two), np.maximum(one, two))
    start = shapes.corners_begin
    # sides cross near each other only where the corners of a face are not all before or all behind the other face
    count = np.diff(start)[g]
    first = np.cumsum(count) - count
    # all corners of face g, beside face f
    corner = np.arange(count.sum()) - np.repeat(first - start[g], count)
    on = np.repeat(f, count)
    gap, _ = gap_and_inside(shapes, pose, shapes.corner_place[corner], shapes.owner[corner], on)
    if len(gap):
        near = np.minimum.reduceat(gap, first) < shapes.near
        near &= np.maximum.reduceat(gap, first) > -shapes.near - depth
        f, g = f[near], g[near]
    p, q = all_pairs(start, f, start, g)
    met = _crossed_lines(shapes, pose, p, q)
    # gaps from -near - depth to near, written about the middle between both
    use = (met.inside > inside) & (np.abs(met.gap + 0.5 * depth) < shapes.near + 0.5 * depth)
    p, q = p[use], q[use]
    return Crossings(
        side=(p, q), place=_places(shapes, p, q, (met.shares[0][use], met.shares[1][use])), gap=met.gap[use],
        inside=met.inside[use], along=(met.along[0][use], met.along[1][use]),
    )


def _places(shapes: Shapes, p: Index, q: Index, shares: tuple[Array, Array]) -> tuple[Array, Array]:
    """Points at shares [-] of the sides that begin at corners p and q, in the reference pose [m], shape (k, 3) each."""
    x, after = shapes.corner_place, following(shapes)
    (s, t) = shares
    return x[p] + s[:, None] * (x[after[p]] - x[p]), x[q] + t[:, None] * (x[after[q]] - x[q])


def off_crossing(shapes: Shapes, c: PathContacts, rows: Index, pose: Pose) -> Array:
    """How far points lie from where their sides cross [m], or sides from crossing at all.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : contact points
    pose : where the blocks are
    rows : contact points that are crossings

    Returns
    -------
    ndarray, shape of ``rows``; the size of the structure where the sides are parallel
    """
    p, q = _sides(shapes, c.corner[rows])
    met, x = _crossed_lines(shapes, pose, p, q), shapes.assembly.centroids
    # the point stays with the side of block b
    first = shapes.owner[p] == c.block_b[rows]
    place = np.where(first[:, None], *_places(shapes, p, q, met.shares))
    away = np.linalg.norm(place - c.place_b[rows], axis=1)
    beyond = np.where(np.isfinite(met.inside), -met.inside, x.max() - x.min())
    return np.asarray(np.where(met.inside > -shapes.step, away, beyond))


def faces_that_meet(
    assembly: Assembly, first: PathContacts, plane: Plane | None, size: float, firm: Index
) -> tuple[Shapes, PathContacts]:
    """Faces that may meet on the way, and the first contacts with the numbers that these have for them.

    A contact point gets the ``face`` that it lies on, and its ``corner`` where it is one of a block or, in space, a
    place where sides of two faces cross.

    Parameters
    ----------
    first : contacts of the reference pose
    plane : of a problem in plane, whose faces are then lines; None in space
    size : median block size [m]
    firm : rank of every block by :func:`.firmness`, the higher the firmer, shape (n,)
    """
    shapes, first = shapes_of(assembly, first, plane, size, firm)
    shapes = shapes.with_open_pairs(first)
    if plane is None:
        shapes, first = with_crossings(shapes, first)
    return shapes, with_faces(shapes, first)


def _sides(shapes: Shapes, number: Index) -> tuple[Index, Index]:
    """Corners at which two sides that cross begin, from their number: n + p n + q beyond those of all n corners."""
    n = len(shapes.corner_face)
    p, q = np.divmod(number - n, n)
    return p, q


def gap_at(shapes: Shapes, near: Near, pose: Pose) -> Array:
    """Gaps [m] in another pose of corners at faces, and of sides that cross, shape (m,).

    Parameters
    ----------
    shapes : faces and corners of the blocks
    near : what is near, as found in some pose
    pose : the pose in which its gaps are asked for
    """
    gap, _ = gap_and_inside(shapes, pose, near.place, near.owner, near.face)
    crosses = is_crossing(shapes, near)
    if crosses.any():
        gap[crosses] = _crossed_lines(shapes, pose, *_sides(shapes, near.corner[crosses])).gap
    # joints that do not quite fit begin open by more than their geometry says
    return gap + shapes.apart(near.face, near.owner)


def candidate_contacts(shapes: Shapes, pose: Pose, since: Pose, depth: float, *, inside: float, space: bool) -> Near:
    """Contacts that a pose has or nearly has: corners near faces, and in space crossings of two faces' sides.

    Parameters
    ----------
    since : pose from which the last motion counts
    depth : by which corners may lie behind a face beyond the near gap, as the springs of soft joints let them [m]
    inside : least distance from the sides of the face, and from the ends of sides that cross [m]
    """
    near = near_corners(shapes, pose, inside, depth)
    if space:
        near = near.with_rows(as_near(shapes, crossings(shapes, pose, inside, depth), since, pose))
    near = near._replace(gap=near.gap + shapes.apart(near.face, near.owner))
    return near.at(near.gap < shapes.near)


def already_points(shapes: Shapes, c: PathContacts, near: Near) -> Flags:
    """Which of k corners at faces are a point already, or lay together in the reference pose without being one, (k,).

    Parameters
    ----------
    c : points that are there
    near : corners at faces in a pose
    """
    present = shapes.code(c.corner, c.face)[c.face >= 0]
    return np.isin(shapes.code(near.corner, near.face), np.concatenate([present, shapes.strangers]))


def facing_cosine(shapes: Shapes, pose: Pose, near: Near) -> Array:
    """Cosine between the normals of both faces of contacts, -1 where they lie on each other, shape (k,).

    It is rounded to six decimals, so that contacts that are alike stay so.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    pose : where the blocks are
    near : corners at faces, and places where sides cross
    """
    crosses = is_crossing(shapes, near)
    p, q = _sides(shapes, np.where(crosses, near.corner, 0))  # 0 stands for what is no crossing, and is not used
    # a crossing is on the faces of its two sides, a corner on its own and the one it lies at
    one = shapes.corner_face[np.where(crosses, p, near.corner)]
    two = np.where(crosses, shapes.corner_face[np.where(crosses, q, 0)], near.face)
    m, n = (turned(pose, shapes.face_block[f], shapes.normal[f]) for f in (one, two))
    return np.round(np.einsum("ij,ij->i", m, n), 6)


def edges_of(shapes: Shapes, c: PathContacts | Near) -> Index:
    """One number for the edges of two blocks that cross, whichever faces meet there, -1 for corners, shape (m,)."""
    crosses = is_crossing(shapes, c)
    if not crosses.any():
        return np.full(len(crosses), -1, np.intp)
    p, q = _sides(shapes, np.where(crosses, c.corner, 0))
    return np.where(crosses, shapes.edge[p] * len(shapes.edge) + shapes.edge[q], -1)


def _edges(shapes: Shapes) -> Index:
    """Number of every side's edge, shape (q,): two faces that meet there have one side each, in opposite senses."""
    x, near = shapes.corner_place, _ONE_PLACE * shapes.step
    ends = np.round((x + x[following(shapes)]) / near)
    # the middle tells edges of a convex part from each other
    rows = np.column_stack([shapes.owner, ends]).astype(np.int64)
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)


def is_crossing(shapes: Shapes, c: PathContacts | Near) -> Flags:
    """Which points are places where sides cross."""
    return np.asarray(c.corner >= len(shapes.corner_face))


def carried_by_first(shapes: Shapes, found: Crossings, before: Pose, now: Pose) -> Flags:
    """Whether a crossing's point stays on the first block's side, shape (k,): where it moves less along that side.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    found : crossings in the pose ``now``
    before : pose from which the last motion counts; where nothing slid the point stays with the firmer block
    """
    (p, q), owner = found.side, shapes.owner
    moved = []  # way of the point of either side since then [m], shape (k, 3) each
    for block, place in ((owner[p], found.place[0]), (owner[q], found.place[1])):
        arm = place - shapes.assembly.centroids[block]
        moved.append(now.shift[block] - before.shift[block] + turned(now, block, arm) - turned(before, block, arm))
    slid, (u, v) = moved[1] - moved[0], found.along
    # slid = s u + r v within the plane of both sides: the crossing moves by s along u, by r along v, both here without
    # their common factor 1 / (1 - cosine^2)
    cosine = np.einsum("ij,ij->i", u, v)
    on_u, on_v = np.einsum("ij,ij->i", slid, u), np.einsum("ij,ij->i", slid, v)
    s, r = np.abs(on_u - cosine * on_v), np.abs(on_v - cosine * on_u)
    nothing = np.maximum(s, r) < _SLID * shapes.spread[owner[p]]
    return np.where(nothing, shapes.firm[owner[p]] >= shapes.firm[owner[q]], s <= r)


def as_near(shapes: Shapes, found: Crossings, before: Pose, now: Pose) -> Near:
    """Crossings as corners at faces: the block along whose side one moves less has the point, the other the face.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    found : crossings in the pose ``now``
    before : pose from which the last motion counts
    """
    first, n = carried_by_first(shapes, found, before, now), len(shapes.corner_face)
    (p, q), owner = found.side, shapes.owner
    return Near(
        corner=n + p * n + q, face=np.where(first, shapes.corner_face[q], shapes.corner_face[p]), gap=found.gap,
        inside=found.inside, owner=np.where(first, owner[p], owner[q]), place=np.where(first[:, None], *found.place),
    )


def with_crossings(shapes: Shapes, c: PathContacts) -> tuple[Shapes, PathContacts]:
    """Contacts of the reference pose in space, those where two sides cross with their numbers.

    A point between faces is a corner of one block, or a place where a side of one face crosses a side of the other. The
    second kind is found here: it gets the number of the crossing as its ``corner``, and its ``face``. Its frame may
    have to go to the other block of the pair. Crossings that are no point of a joint are noted as ``strangers`` of the
    shapes: they are not taken for new contacts later.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : points of the joints; ``corner`` and ``face`` are -1 where none is known yet
    """
    shapes = shapes._replace(edge=_edges(shapes))
    rest = at_rest(shapes.assembly.n_blocks)
    found = crossings(shapes, rest, _ONE_PLACE * shapes.step)
    near = as_near(shapes, found, rest, rest)
    corner, face, swapped = c.corner.copy(), c.face.copy(), np.zeros(c.count, bool)
    named = np.zeros(len(near.corner), bool)  # crossings that are a point
    # of crossings at one place that on the faces that look at each other most comes first and names the point
    for row in np.argsort(facing_cosine(shapes, rest, near), kind="stable"):
        a, b = int(shapes.face_block[near.face[row]]), int(near.owner[row])
        same = ((c.block_a == a) & (c.block_b == b)) | ((c.block_a == b) & (c.block_b == a))
        at = np.flatnonzero(same & (np.abs(c.place_b - near.place[row]).max(axis=1) < _ONE_PLACE * shapes.near))
        named[row] = len(at) > 0
        for i in at[corner[at] < 0]:
            corner[i], face[i], swapped[i] = near.corner[row], near.face[row], c.block_b[i] != b
    c = replace(turned_over(c, swapped), corner=corner, face=face)
    p, q = found.side
    joined = np.isin(shapes.pair(shapes.owner[p], shapes.owner[q]), shapes.pair(c.block_a, c.block_b))
    # of no joint, or well away from the ends of both sides and yet no point of the joint
    strange = ~joined | (~named & (found.inside > shapes.step))
    faces = np.stack([shapes.corner_face[p], shapes.corner_face[q]], 1)[strange]
    codes = shapes.code(near.corner[strange][:, None], faces)
    return shapes._replace(strangers=np.concatenate([shapes.strangers, codes.ravel()])), c
