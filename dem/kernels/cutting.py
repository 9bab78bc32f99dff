"""Joints cut from how pieces meet now: points of a face, a corner or a crossing, and where the joint lies in blocks."""

from typing import NamedTuple

import numpy as np

from dem.kernels.arrays import Array, Index
from dem.kernels.compiled import kernel
from dem.kernels.contact_geometry import CORNER, CROSSING, MOST
from dem.kernels.kinematics import cross, dot
from dem.kernels.outlines import slope_of
from dem.kernels.pieces import Meetings

LATTICE = 4
"""Points along either side of a contact found later."""

BEYOND = 0.01
"""Part of an edge by which a crossing may lie beyond its end and still be made; edges that overlap cross within."""

RUN_OFF = 0.1
"""Part of an edge by which a crossing may have run beyond its end and still bear, until a search cuts it anew."""

ROOM = 2 * MOST + 1
"""Most points of a joint that is cut."""


class Poses(NamedTuple):
    """Where blocks are now, and the area that a corner of theirs takes."""

    rot: Array  # (n, 3, 3)
    place: Array  # of the centroid [m], (n, 3)
    quat: Array  # (n, 4)
    centroid: Array  # in the reference position [m], (n, 3)
    point_area: Array  # [m2], (n,)


class Cut(NamedTuple):
    """Joints that are cut, row by row; all of it is written."""

    size: Index  # number of its points, 0 where there is no joint, (r,)
    s: Array  # of the points, (r, ROOM)
    t: Array
    area: Array
    gap: Array
    position: Array  # [m], (r, ROOM, 3)
    world: Array  # frame in global axes, (r, 3, 3)
    frame: Array  # in the axes of a, (r, 3, 3)
    turn: Array  # as in ``Joints``, and so the rest, (r, 4)
    arm_a: Array  # (r, 3)
    arm_b: Array  # (r, 3)
    offset: Array  # (r, 3)
    edge: Array  # (r, 3)
    limits: Array  # (r, 4)
    apart: Array  # distance of edges that cross beside the gap [m], (r,)


@kernel(fast=False)
def _lattice(x: Array, y: Array, px: Array, py: Array, corners: Index) -> int:
    """Cover a quadrilateral by a lattice of points and by triangles, each cell cut both ways.

    Parameters
    ----------
    x, y : its four corners [m]
    px, py : points, written [m], shape (m,)
    corners : their numbers at every triangle, written, shape (k, 3)

    Returns
    -------
    triangles : how many were written
    """
    m = LATTICE
    for i in range(m):
        v = i / (m - 1.0)
        for j in range(m):
            u, k = j / (m - 1.0), i * m + j
            px[k] = (1.0 - v) * ((1.0 - u) * x[0] + u * x[1]) + v * ((1.0 - u) * x[3] + u * x[2])
            py[k] = (1.0 - v) * ((1.0 - u) * y[0] + u * y[1]) + v * ((1.0 - u) * y[3] + u * y[2])
    found = 0
    for i in range(m - 1):
        for j in range(m - 1):
            a = i * m + j
            b, c, d = a + 1, a + m + 1, a + m
            for p, q, r in ((a, b, c), (a, c, d), (a, b, d), (b, c, d)):
                corners[found, 0], corners[found, 1], corners[found, 2] = p, q, r
                found += 1
    return found


@kernel(fast=False, forceinline=True)
def _sum(x: Array, count: int) -> float:
    """Sum of the first ``count`` numbers of x, in their order: the last bits depend on it."""
    total = 0.0
    for k in range(count):
        total += x[k]
    return total


@kernel(fast=False)
def _spokes(x: Array, y: Array, px: Array, py: Array, corners: Index) -> int:
    """Cover a polygon by its centre, corners and middles of sides, and by triangles from the centre to half sides.

    Parameters
    ----------
    x, y : corners of the polygon [m], shape (n,)
    px, py : points, written [m], shape (m,)
    corners : their numbers at every triangle, written, shape (k, 3)

    Returns
    -------
    triangles : how many were written
    """
    n, found = len(x), 0
    px[0], py[0] = _sum(x, n) / n, _sum(y, n) / n
    for k in range(n):
        z = (k + 1) % n
        px[1 + 2 * k], py[1 + 2 * k] = x[k], y[k]
        px[2 + 2 * k], py[2 + 2 * k] = 0.5 * (x[k] + x[z]), 0.5 * (y[k] + y[z])
        for p, q in ((1 + 2 * k, 2 + 2 * k), (2 + 2 * k, 1 + 2 * z)):
            corners[found, 0], corners[found, 1], corners[found, 2] = 0, p, q
            found += 1
    return found


@kernel(fast=False, counted=True)
def spread(x: Array, y: Array, s: Array, t: Array, area: Array) -> int:
    """Points of a convex counter-clockwise polygon, edges included, with tributary areas.

    ``s``, ``t`` [m] and ``area`` [m2] are written, how many is returned. A quadrilateral has a lattice, any other
    outline its centre, corners and middles of sides. Each triangle gives a third of its area to its corners.

    Parameters
    ----------
    x, y : corners of the polygon [m], shape (n,)
    """
    n = len(x)
    most = max(LATTICE * LATTICE, 2 * n + 1)
    px, py, weight = np.empty(most), np.empty(most), np.zeros(most)
    corners = np.empty((max(4 * (LATTICE - 1) ** 2, 2 * n), 3), np.int64)
    # twice the area of a triangle, halved; a cell of the lattice is cut along both diagonals and covered twice
    if n == 4:
        triangles, share, total = _lattice(x, y, px, py, corners), 0.25, LATTICE * LATTICE
    else:
        triangles, share, total = _spokes(x, y, px, py, corners), 0.5, 2 * n + 1
    for k in range(triangles):
        a, b, c = corners[k]
        part = share * abs((px[b] - px[a]) * (py[c] - py[a]) - (py[b] - py[a]) * (px[c] - px[a])) / 3.0
        weight[a] += part
        weight[b] += part
        weight[c] += part
    found = 0
    for k in range(total):
        # points within 1e-9 m are one
        same = -1
        for i in range(found):
            if np.rint(s[i] * 1e9) == np.rint(px[k] * 1e9) and np.rint(t[i] * 1e9) == np.rint(py[k] * 1e9):
                same = i
                break
        if same < 0:
            s[found], t[found], area[found] = px[k], py[k], weight[k]
            found += 1
        else:
            area[same] += weight[k]
    return found


@kernel(fast=False)
def _at(rot: Array, place: Array, i: int, at: tuple[float, float, float], out: Array) -> None:
    """A place in the axes of block i, from its centroid, written to ``out`` (3)."""
    d = (at[0] - place[i, 0], at[1] - place[i, 1], at[2] - place[i, 2])
    for r in range(3):
        out[r] = rot[i, 0, r] * d[0] + rot[i, 1, r] * d[1] + rot[i, 2, r] * d[2]


@kernel(fast=False)
def _place(row: int, a: int, b: int, at: tuple[float, float, float], at_b: tuple[float, float, float], poses: Poses,
           out: Cut) -> None:
    """Write how joint ``row`` with axes ``out.world`` lies in blocks a and b.

    Parameters
    ----------
    at, at_b : its origin now on either block [m]
    """
    rot, place, quat = poses.rot, poses.place, poses.quat
    _at(rot, place, a, at, out.arm_a[row])
    _at(rot, place, b, at_b, out.arm_b[row])
    for r in range(3):
        out.offset[row, r] = (
            (poses.centroid[b, r] + out.arm_b[row, r]) - (poses.centroid[a, r] + out.arm_a[row, r])
        )
        for c in range(3):
            out.frame[row, r, c] = (
                out.world[row, r, 0] * rot[a, 0, c] + out.world[row, r, 1] * rot[a, 1, c]
                + out.world[row, r, 2] * rot[a, 2, c]
            )
    p, q = (-quat[a, 1], -quat[a, 2], -quat[a, 3]), (quat[b, 1], quat[b, 2], quat[b, 3])
    w, x, y = cross(p, q), quat[a, 0], quat[b, 0]
    out.turn[row, 0] = x * y - dot(p, q)
    for r in range(3):
        out.turn[row, 1 + r] = -(x * q[r] + y * p[r] + w[r])


@kernel(fast=False, counted=True)
def _cut_face(
    row: int, a: int, b: int, polygon: Array, plane: Array, corner: bool, poses: Poses, least: float, out: Cut
) -> None:
    """Joint on a polygon of block b's face above the plane of block a's face.

    Parameters
    ----------
    row : of ``out`` that is written; its size stays 0 where the polygon is smaller than ``least`` [m2]
    polygon : corners of the polygon [m]
    plane : normal and offset of the base's face
    corner : whether a corner or edge touches, whose points have an area of their own
    """
    m = len(polygon)
    flat, height, x, y = np.empty((m, 3)), np.empty(m), np.empty(m), np.empty(m)
    n = (plane[0], plane[1], plane[2])
    centre = np.zeros(3)
    for k in range(m):
        high = polygon[k, 0] * n[0] + polygon[k, 1] * n[1] + polygon[k, 2] * n[2] - plane[3]
        # the incident face runs against the base's normal: its corners are clockwise seen along -n, hence the reversal
        height[m - 1 - k] = high
        for r in range(3):
            flat[k, r] = polygon[k, r] - high * n[r]
            centre[r] += flat[k, r] / m
    longest, t1 = -1.0, (1.0, 0.0, 0.0)
    for k in range(m):
        e = (flat[k, 0] - flat[k - 1, 0], flat[k, 1] - flat[k - 1, 1], flat[k, 2] - flat[k - 1, 2])
        length = np.sqrt(dot(e, e))
        if length > longest:
            longest, t1 = length, (e[0] / length, e[1] / length, e[2] / length)
    t2 = cross(n, t1)
    for k in range(m):
        d = (flat[k, 0] - centre[0], flat[k, 1] - centre[1], flat[k, 2] - centre[2])
        x[m - 1 - k], y[m - 1 - k] = dot(d, t1), dot(d, t2)
    s, t, area = out.s[row], out.t[row], out.area[row]
    if corner:
        # touching corners, each with the same area wherever it comes to lie on the other block's face
        each, count = min(poses.point_area[a], poses.point_area[b]), 0
        for k in range(m):
            if np.sqrt((x[k] - x[k - 1]) ** 2 + (y[k] - y[k - 1]) ** 2) > 0.1 * np.sqrt(each):
                s[count], t[count] = x[k], y[k]
                count += 1
        if count == 0:
            s[0], t[0], count = x[0], y[0], 1
        for k in range(count):
            area[k] = each
    else:
        count = spread(x, y, s, t, area)
        if not _sum(area, count) > least:
            return
    # the height of b's face over the base plane
    slope, mean = slope_of(x, y, height), _sum(height, m) / m
    for k in range(count):
        out.gap[row, k] = mean + s[k] * slope[0] + t[k] * slope[1]
        for r in range(3):
            out.position[row, k, r] = centre[r] + s[k] * t1[r] + t[k] * t2[r]
    for r in range(3):
        out.world[row, 0, r], out.world[row, 1, r], out.world[row, 2, r] = t1[r], t2[r], n[r]
    at = (centre[0], centre[1], centre[2])
    _place(row, a, b, at, at, poses, out)
    out.size[row] = count


@kernel(fast=False)
def _cut_crossing(row: int, a: int, b: int, found: Array, poses: Poses, out: Cut) -> None:
    """Joint of one point where an edge of block a passes an edge of block b.

    None where they pass beyond their ends: of blocks apart, the axis of the widest gap may belong to edges that will
    not touch, and nearly parallel ones pass far away.

    Parameters
    ----------
    row : of ``out``, the joint that is written
    found : start and vector along the edge of a [m], the same of b, and the unit normal from a to b, shape (5, 3)
    """
    d = (found[2, 0] - found[0, 0], found[2, 1] - found[0, 1], found[2, 2] - found[0, 2])
    u, v = (found[1, 0], found[1, 1], found[1, 2]), (found[3, 0], found[3, 1], found[3, 2])
    n, w = (found[4, 0], found[4, 1], found[4, 2]), cross(u, v)
    size = np.sqrt(dot(w, w))
    one, two = dot(cross(d, v), n) / size, dot(cross(d, u), n) / size
    if max(abs(one - 0.5), abs(two - 0.5)) > 0.5 + BEYOND:
        return
    long_u, long_v = np.sqrt(dot(u, u)), np.sqrt(dot(v, v))
    t1 = (u[0] / long_u, u[1] / long_u, u[2] / long_u)
    t2 = cross(n, t1)
    at = (found[0, 0] + one * u[0], found[0, 1] + one * u[1], found[0, 2] + one * u[2])
    at_b = (found[2, 0] + two * v[0], found[2, 1] + two * v[1], found[2, 2] + two * v[2])
    for r in range(3):
        out.world[row, 0, r], out.world[row, 1, r], out.world[row, 2, r] = t1[r], t2[r], n[r]
        out.position[row, 0, r] = at_b[r]
        rot = poses.rot
        out.edge[row, r] = (rot[b, 0, r] * v[0] + rot[b, 1, r] * v[1] + rot[b, 2, r] * v[2]) / long_v
    _place(row, a, b, at, at_b, poses, out)
    out.limits[row, 0], out.limits[row, 1] = (-RUN_OFF - one) * long_u, (1.0 + RUN_OFF - one) * long_u
    out.limits[row, 2], out.limits[row, 3] = (-RUN_OFF - two) * long_v, (1.0 + RUN_OFF - two) * long_v
    out.s[row, 0] = out.t[row, 0] = out.gap[row, 0] = 0.0
    out.area[row, 0], out.apart[row] = min(poses.point_area[a], poses.point_area[b]), dot(d, n)
    out.size[row] = 1


@kernel(fast=False)
def cut_joints(rows: Index, one: Index, two: Index, met: Meetings, poses: Poses, least: float, out: Cut) -> None:
    """Cut the joints of some meetings.

    Parameters
    ----------
    rows : of ``met``
    one, two : blocks a and b of each, shape (r,)
    least : area up to which two faces do not touch [m2]
    """
    for row in range(len(rows)):
        m = rows[row]
        out.size[row], out.apart[row] = 0, 0.0
        out.edge[row], out.limits[row] = 0.0, 0.0
        if met.kind[m] == CROSSING:
            _cut_crossing(row, one[row], two[row], met.crossing[m], poses, out)
        else:
            polygon = met.polygon[m, : met.corners[m]]
            _cut_face(row, one[row], two[row], polygon, met.plane[m], met.kind[m] == CORNER, poses, least, out)


@kernel(fast=False, counted=True)
def facing_interface(
    block_a: Index, block_b: Index, normal: Array, centre: Array, poses: Poses, one: int, two: int, n: Array, at: Array
) -> int:
    """Interface whose face looks along n, out of the first block, and of these the nearest.

    Parameters
    ----------
    block_a, block_b, normal, centre : of all interfaces, normals from a to b
    n : normal from the first block to the second
    at : a place now [m]
    one, two : the first and the second block
    """
    best, looks, nearest = 0, -np.inf, np.inf
    own, local = np.empty(3), np.empty(3)
    for second in range(2):
        block, sign = (two, -1.0) if second else (one, 1.0)
        _at(poses.rot, poses.place, block, (at[0], at[1], at[2]), local)
        for r in range(3):
            local[r] += poses.centroid[block, r]
            rot = poses.rot
            own[r] = sign * (rot[block, 0, r] * n[0] + rot[block, 1, r] * n[1] + rot[block, 2, r] * n[2])
        for k in range(len(block_a)):
            if block_a[k] != block and block_b[k] != block:
                continue
            along = normal[k, 0] * own[0] + normal[k, 1] * own[1] + normal[k, 2] * own[2]
            # cosines within a hundredth count as alike, and the nearer one wins
            along = np.rint(100.0 * (along if block_a[k] == block else -along))
            far = (centre[k, 0] - local[0]) ** 2 + (centre[k, 1] - local[1]) ** 2 + (centre[k, 2] - local[2]) ** 2
            if along > looks or (along == looks and far < nearest):
                best, looks, nearest = k, along, far
    return best
