"""Closed surfaces that lie in one list of faces: which faces bound one body, and how much a body encloses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

from limitmason.arrays import Array, Index

_ONE_PLACE = 1e-8
"""Distance over the size of a file up to which corners are one: rounding; chosen."""

_ONE_ANGLE = 1e-4
"""Angle [rad] about an edge up to which faces of two bodies lie on each other, in files of single precision; chosen."""


class Shell(NamedTuple):
    """A closed surface: its corners [m], shape (n, 3), and signed volume [m3], negative where faces run clockwise."""

    corners: Array
    volume: float


T = TypeVar("T")


def bodies_of_triangles(corners: Array, triangles: Index, *, whole: bool) -> list[Index]:
    """Triangles of every body of a file, in the order of their first ones.

    Corners are those that the file numbers. Where its triangles do not close by these, as in an .stl, whose triangles
    each have their own, those at one place are one.

    Parameters
    ----------
    corners : of the file [m], shape (n, 3)
    triangles : by number of the corners, shape (m, 3)
    whole : all triangles are one body
    """
    triangles = _with_area(triangles)
    sides = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    if not np.array_equal(np.unique(sides, axis=0), np.unique(sides[:, ::-1], axis=0)):
        triangles = _with_area(_one_at_a_place(corners)[triangles])
    if whole or len(triangles) == 0:
        return [triangles] if len(triangles) else []
    label = bodies_of_faces(corners, triangles)
    return [triangles[label == k] for k in range(label.max() + 1)]


def bodies_of_faces(corners: Array, faces: Index | Sequence[Sequence[int]]) -> Index:
    """Number of the body of every face, shape (m,).

    Bodies are counted from 0 in the order of their first faces.

    Parameters
    ----------
    corners : [m], shape (n, 3)
    faces : plane, counter-clockwise from outside, by number of the corners
    """
    owner = np.repeat(np.arange(len(faces)), [len(f) for f in faces])  # number of the face of every side
    if isinstance(faces, np.ndarray):
        sides = np.stack([np.roll(faces, 1, axis=1), faces], axis=-1).reshape(-1, 2)
    else:
        sides = np.array([(f[k - 1], f[k]) for f in faces for k in range(len(f))], dtype=np.intp)
    two, more = _edges(sides)
    pairs = [owner[two]]  # faces of one body: both at an edge of two, and at an edge of more those with a body between
    for at in more:
        forward = sides[at, 0] < sides[at, 1]
        if 2 * forward.sum() == len(at):  # as many sides run either way: bodies can be closed here
            first, last = np.sort(sides[at[0]])
            axis = corners[last] - corners[first]
            # into a face: to the left of its side, seen from outside
            along = np.where(forward, 1.0, -1.0)[:, None] * axis
            arms = np.cross([_normal(corners[list(faces[k])]) for k in owner[at]], along)
            pairs.append(owner[at[np.array(list(_wedges(axis, arms, forward)))]])
        else:  # what does not close stays one body, and is refused as such
            pairs.append(owner[np.column_stack([np.full(len(at) - 1, at[0]), at[1:]])])
    label = _pieces(np.vstack(pairs), len(faces))
    first = np.unique(label, return_index=True)[1]
    return np.asarray(np.argsort(np.argsort(first))[label])  # sorted twice, first faces become their ranks


def _normal(corners: Array) -> Array:
    """Normal of a plane face, twice its area long [m2], from its corners [m], shape (k, 3)."""
    return np.asarray(np.cross(corners - corners[0], np.roll(corners, -1, axis=0) - corners[0]).sum(axis=0))


def with_hollows(shells: Sequence[tuple[T, Shell]]) -> tuple[list[list[T]], T | None]:
    """Outer surfaces, each with the hollows in it, and a hollow that lies in none.

    Faces of a hollow run the other way, so that its volume is negative. Where all run so nothing is hollow.

    Parameters
    ----------
    shells : an object of the caller that stands for each, and its surface

    Returns
    -------
    groups : objects of every outer surface and of the hollows in it
    lost : object of a hollow that lies in no outer surface, None where there is none
    """
    outer = [s for s in shells if s[1].volume >= 0.0] or list(shells)
    out = [[what] for what, _ in outer]
    for hollow in (s for s in shells if not any(s is o for o in outer)):
        # the box of a body is enough to tell in which one a hollow is; of bodies in each other the innermost
        around = [k for k, (_, body) in enumerate(outer) if _within(hollow[1], body)]
        if not around:
            return out, hollow[0]
        out[min(around, key=lambda k: outer[k][1].volume)].append(hollow[0])
    return out, None


def _within(shell: Shell, other: Shell) -> bool:
    """Whether the box of a surface lies in that of another."""
    low, high = other.corners.min(axis=0), other.corners.max(axis=0)
    return bool((shell.corners >= low).all() and (shell.corners <= high).all())


def _with_area(triangles: Index) -> Index:
    """Triangles without those two of whose corners are one, which have no area and no normal."""
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (c != a)]


def _one_at_a_place(corners: Array) -> Index:
    """Of every corner [m] the number of the first at its place, shape (n,)."""
    places, at = np.unique(corners, axis=0, return_inverse=True)
    near = cKDTree(places).query_pairs(_ONE_PLACE * float(np.ptp(corners, axis=0).max()), output_type="ndarray")
    at = _pieces(near, len(places))[at.ravel()]
    first = np.full(at.max() + 1, len(corners), dtype=np.intp)
    np.minimum.at(first, at, np.arange(len(corners)))
    return first[at]


def _edges(sides: Index) -> tuple[Index, list[Index]]:
    """Sides of faces that lie on one edge, by their numbers.

    Parameters
    ----------
    sides : the two corners of every side, shape (n, 2)

    Returns
    -------
    two : both sides of every edge that has two, shape (k, 2)
    more : the sides of every edge that has more than two
    """
    # sorted by corners, sides of one edge stand together; ends are the places where the next edge begins
    low, high = sides.min(axis=1), sides.max(axis=1)
    order = np.lexsort((high, low))
    new = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    ends = np.flatnonzero(np.r_[True, new, True])
    count = np.diff(ends)
    two = ends[:-1][count == 2]
    more = [order[begin : begin + n] for begin, n in zip(ends[:-1], count, strict=True) if n > 2]
    return np.column_stack([order[two], order[two + 1]]), more


def _wedges(axis: Array, arms: Array, forward: Any) -> Iterator[tuple[int, int]]:
    """Pairs of faces at an edge with a body between them, by their numbers.

    Faces about the edge open and close bodies as brackets do.

    Parameters
    ----------
    axis : along the edge [m], shape (3,)
    arms : from the edge into each face [m], shape (k, 3)
    forward : whether each face, counter-clockwise from outside, runs along the axis, shape (k,); a body then lies
        behind it in the sense of a right-handed turn about the axis, else before it
    """
    # angle of every face about the edge, from the first
    across = np.cross(axis, arms[0])
    turn = np.arctan2(arms @ across * np.linalg.norm(axis), arms @ np.cross(across, axis))
    turn = (turn + _ONE_ANGLE) % (2.0 * np.pi)  # those on the first do not come last
    order = np.argsort(turn)
    group = np.cumsum(np.r_[0, np.diff(turn[order]) > _ONE_ANGLE])  # faces on each other
    order = order[np.lexsort((~forward[order], group))]  # of these the body behind ends before the next begins
    # a face that runs backward opens a body, one that runs forward closes it: begin where fewest are open
    depth = np.cumsum(np.where(forward[order], -1, 1))
    open_faces: list[int] = []
    for k in np.roll(order, -int(np.argmin(depth)) - 1):
        if forward[k]:
            yield open_faces.pop(), int(k)
        else:
            open_faces.append(int(k))


def volume_of_mixed_faces(corners: Array, triangles: Index) -> float:
    """Volume of a body [m3], whatever the senses of its faces: scans often mix these.

    Faces that hang together by edges of two faces are a piece, and are turned to one sense. A piece whose faces had
    different senses counts as positive. Others keep their sign: a cavity, whose faces run the other way, is taken off.
    Edges of more than two faces, where bodies touch, link none. What is missing of an open body is missing here: the
    cone from the mean of the corners to it.

    Parameters
    ----------
    corners : of the body [m], shape (n, 3)
    triangles : of it, by number of the corners, shape (m, 3)
    """
    m = len(triangles)
    sides = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    shared, _ = _edges(sides)
    # pairs of faces that share an edge, each once and in rising order; side s is of face s % m
    pairs, row = np.unique(np.sort(shared % m, axis=1), axis=0, return_index=True)
    # faces of one sense pass their edge in opposite ways; where both pass it alike one of them is turned over
    against = (sides[shared[:, 0], 0] == sides[shared[:, 1], 0])[row]
    piece = _pieces(pairs, m)
    first = np.unique(piece, return_index=True)[1]
    # a tree along the shortest ways from the first face of each piece, so that a fault of the mesh turns few faces;
    # its root m stands for no face and is linked to all first faces
    links = np.vstack([pairs, np.column_stack([first, np.full(len(first), m)])])
    before = breadth_first_order(coo_array((np.ones(len(links)), links.T), shape=(m + 1, m + 1)), m, directed=False)[1]
    later = np.flatnonzero(before[:m] != m)
    tree = np.sort(np.column_stack([before[later], later]), axis=1)
    # two copies of every face, k as it is and k + m + 1 turned over. A pair of one sense links like copies, a pair that
    # passes its edge alike links unlike ones: a face whose own copy hangs together with the first of its piece keeps
    # its sense, another is turned. ``copy`` is the offset, 0 or m + 1, of the copy of the second face that goes with
    # the first face as it is. Pairs (i, j) rise, so that they are looked up by the number m i + j
    copy = against[np.searchsorted(pairs @ [m, 1], tree @ [m, 1])] * (m + 1)
    sheet = _pieces(
        np.vstack([tree + np.outer(copy, [0, 1]), tree + np.outer(m + 1 - copy, [0, 1]) + [m + 1, 0]]), 2 * (m + 1)
    )
    sign = np.where(sheet[:m] == sheet[first[piece]], 1.0, -1.0)
    p = (corners - corners.mean(axis=0))[triangles]
    cones = np.einsum("ni,ni->n", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6.0
    mixed = np.bincount(piece[pairs[:, 0]], weights=against, minlength=len(first)) > 0
    volumes = np.bincount(piece, weights=cones * sign)
    return abs(float(np.where(mixed, np.abs(volumes), volumes).sum()))


def _pieces(pairs: Index, count: int) -> Index:
    """Number of the connected piece of each of some things, shape (count,).

    Parameters
    ----------
    pairs : of things that are connected, shape (k, 2)
    count : number of things
    """
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]
