"""Reduction to the plane: whether a whole problem takes place in one plane, and which."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.geometry.polyhedron import face_planes, group_by_topology
from limitmason.geometry.rotation import vector_product
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

__all__ = ["Plane", "find_plane", "two_planes"]


class Plane(NamedTuple):
    """Plane of a two-dimensional problem."""

    axis_1: Array  # horizontal unit vector in the plane, (3,)
    axis_2: Array  # unit vector in the plane, square to the first, (3,)
    normal: Array  # unit vector that all blocks turn about, (3,)
    level: float  # coordinate of its points along the normal [m]


_SKEW = 1e-6
"""Sine of an angle, or part of a width, that counts as none: what rounding may make of a plane problem [-]."""

_OFF = 1e-7
"""Part of the structure's length by which joints and centroids may be off their mirror images [-]: rounding."""

_NO_MOMENT = 1e-9
"""Moment out of the plane over the largest load times the structure's length that counts as none [-]: rounding."""

_FLAT = 1e-8
"""Least over largest singular value of normals and loads below which they all lie in one plane [-]: rounding."""

_PARALLEL = 1e-6
"""Second over largest singular value of normals and loads below which they are all parallel [-]: rounding."""


def find_plane(assembly: Assembly, loads: Loads, driven: Array | None = None) -> Plane | None:
    """The plane of symmetry in which the whole problem takes place.

    It is None for a 3-D problem.

    Blocks, rectangular interfaces and loads must be symmetric about one plane and every normal and force parallel to
    it. The mean of a stress state and its mirror image is then also admissible, so two points per interface on the
    plane give exactly the multiplier of four corners.

    Parameters
    ----------
    assembly, loads : the problem
    driven : twists that are prescribed beside the loads, shape (k, 6); they lie in the plane too

    Notes
    -----
    A wall of square piers under its weight alone is symmetric about two planes: of these the one nearest to x-z.
    """
    return next(_planes(assembly, loads, driven), None)


def two_planes(assembly: Assembly, loads: Loads, driven: Array | None = None) -> bool:
    """Whether the problem lies in two planes at once, as a square pier under vertical loads does.

    A plane state of stress of its blocks would then hang on which of the two is taken. Arguments are those of
    :func:`find_plane`.
    """
    return len(list(_planes(assembly, loads, driven))) > 1


def contacts_stay_in_plane(assembly: Assembly, plane: Plane) -> bool:
    """True if blocks that move within a plane can be computed in it: they then meet others as outlines do, everywhere.

    Faces must lie in the plane or stand square to it. Blocks must be symmetric about it, or reach at least as far to
    both sides as what moves. A slide past an oblique edge, or onto a half-wide block, takes place in space.
    """
    free = ~assembly.fixed
    parts = [part for body in assembly.blocks for part in body.parts]
    span = np.empty((len(parts), 2))  # of every part: how far it reaches along the normal, from and to [m]
    for faces, members, vertices in group_by_topology(parts):
        off = vertices @ plane.normal - plane.level
        span[members, 0], span[members, 1] = off.min(axis=1), off.max(axis=1)
        for face in faces:
            across = np.abs(face_planes(vertices[:, list(face)])[0] @ plane.normal)
            # 0 for a face square to the plane, 1 for one in it: all between are oblique
            if ((across > _SKEW) & (across < 1.0 - _SKEW)).any():
                return False
    moves = np.repeat(free, [len(b.parts) for b in assembly.blocks])
    wide = np.abs(span[moves]).max(initial=0.0)  # of what moves, to the farther side
    symmetric = np.abs(span.sum(axis=1)) <= _SKEW * wide
    as_wide = (span[:, 0] <= -(1.0 - _SKEW) * wide) & (span[:, 1] >= (1.0 - _SKEW) * wide)
    return bool((symmetric | as_wide).all())


def _planes(assembly: Assembly, loads: Loads, driven: Array | None) -> Iterator[Plane]:
    """Planes about which structure, ties and loads are symmetric, at most two.

    Joints must be rectangles that lie square to the plane, and all forces must lie in it.

    Parameters
    ----------
    driven : twists that are prescribed beside the loads, shape (k, 6); None for none
    """
    x = assembly.arrays
    active = ~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b])
    # only rectangles keep the multiplier of their corners with two points on the plane
    if not active.any() or (np.diff(x.corner_start)[active] != 4).any():
        return
    free = ~assembly.fixed
    wrench = np.concatenate([loads.dead[free], loads.live[free]])
    arms = np.concatenate([loads.dead_arms[free], loads.live_arms[free]])  # sum of r f^T on every block [N m]
    size = max(np.abs(wrench[:, :3]).max(initial=0.0), 1e-300)
    ties = np.arange(len(active), len(assembly.links.area))  # links are the interfaces and, after them, the ties
    ties = ties[free[assembly.links.block_a[ties]] | free[assembly.links.block_b[ties]]]
    # all that must lie in the plane: its normal is what they have nothing of
    vectors = np.concatenate([x.normal[active], wrench[:, :3] / size, assembly.links.normal[ties], _in_plane(driven)])
    corners = x.corners[(x.corner_start[:-1][active, None] + np.arange(4))]
    edge, next_edge = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1]
    # singular values: those of vectors.T @ vectors would be the squares, whose rounding hides a plane that is turned
    _, singular, axes = np.linalg.svd(vectors, full_matrices=False)  # at least three rows: a joint, dead and live load
    if singular[2] > _FLAT * singular[0]:
        return
    candidates = [axes[2]]
    # where every normal and force is parallel either of the two edge directions may do
    if singular[1] <= _PARALLEL * singular[0]:
        e = edge[0] / np.linalg.norm(edge[0])
        # which edge is first hangs on rounding: the order of the two must not
        candidates = sorted([e, np.cross(x.normal[active][0], e)], key=lambda p: -abs(p[1]))
    length = np.linalg.norm(corners.max(axis=(0, 1)) - corners.min(axis=(0, 1)))
    for p in candidates:
        # of the two normals of a plane the one whose largest component is positive, or its y where that is large
        p = p / np.linalg.norm(p) * (1.0 if p[np.abs(p).argmax()] > 0 else -1.0)
        if abs(p[1]) > 0.5 and p[1] < 0:
            p = -p
        level = float(np.median(x.centroid[free] @ p))
        # joints are mirrored by the plane and lie square to it; centroids of blocks and ties lie in it
        across = np.sort(corners @ p, axis=1)
        off = np.concatenate([x.centroid[free], assembly.links.centre[ties]]) @ p - level
        mirrored = (
            np.abs(across + across[:, ::-1] - 2 * level).max() <= _OFF * length
            and np.abs(off).max() <= _OFF * length
        )
        # of every joint one edge lies in the plane: the smaller part of two edges along the normal is none
        spread = np.sort(np.abs(np.stack([edge @ p, next_edge @ p], axis=1)), axis=1)
        rectangular = spread[:, 0].max() <= _OFF * length
        moments = wrench[:, 3:] - (wrench[:, 3:] @ p)[:, None] * p
        # of two forces beside the plane, mirror images of each other, only parts along and across it are left in r f^T
        across_arms = [a - (a @ p)[:, None] * p for a in (arms @ p, p @ arms)]
        turns_in_plane = all(np.abs(a).max(initial=0.0) <= _NO_MOMENT * size * length for a in (moments, *across_arms))
        if mirrored and rectangular and turns_in_plane and _supports_fit(assembly.held, p):
            # the first axis is horizontal; in a level plane, whose normal is near z, it is x laid into the plane
            z = np.array([0.0, 0.0, 1.0])
            first = np.cross(p, z) if abs(p[2]) < 0.9 else np.array([1.0, 0.0, 0.0]) - p[0] * p
            first /= np.linalg.norm(first)
            yield Plane(first, np.cross(first, p), p, level)


def _in_plane(driven: Array | None) -> Array:
    """Unit vectors of a plane that holds these twists: along their translations and across their axes, shape (m, 3).

    Parameters
    ----------
    driven : twists that are prescribed, shape (k, 6); None for none
    """
    twists = np.zeros((0, 6)) if driven is None else np.asarray(driven, dtype=float)
    rows = np.concatenate([twists[:, :3], *(vector_product(twists[:, 3:], axis) for axis in np.eye(3))])
    size = np.linalg.norm(rows, axis=1)
    moves = size > 1e-9 * size.max(initial=0.0)  # beyond rounding: none of the others has a direction
    return np.asarray(rows[moves] / size[moves, None])


def _supports_fit(held: Flags, p: Array) -> bool:
    """Whether supports that hold a block in some freedoms alone are the same in the plane as in space.

    They are where every translation is held or none, and every rotation, or where the plane's normal is x, y or z.

    Parameters
    ----------
    held : freedoms of every block along and about x, y, z, shape (n, 6)
    p : unit normal of the plane, shape (3,)
    """
    partial = held[held.any(axis=1) & ~held.all(axis=1)]
    if not len(partial):
        return True
    kinds = partial.reshape(-1, 2, 3)  # translations and rotations
    uniform = kinds.all(axis=2) | ~kinds.any(axis=2)
    return bool(uniform.all() or np.isclose(np.abs(p).max(), 1.0, atol=1e-12))  # x, y or z but for rounding
