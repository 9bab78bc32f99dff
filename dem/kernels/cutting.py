"""Joints cut from how pieces meet now: points, and where joints lie in blocks."""

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
"""Most points of a joint that is cut: centre, corners and middles of the sides of the largest polygon."""

ONE_POINT = 1e9
"""Places that are equal once rounded to whole parts of 1 m / ONE_POINT are one point of a joint [1/m]."""

ONE_CORNER = 0.1
"""Side of a polygon, over the side of a corner's area, up to which its two ends are one touching corner; chosen."""

ALIKE = 100.0
"""Cosines that are equal once rounded to whole parts of 1 / ALIKE belong to faces that look equally well along n."""


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
    s: Array  # places of the points along t1 [m], (r, ROOM)
    t: Array  # and along t2 [m], (r, ROOM)
    area: Array  # [m2], (r, ROOM)
    gap: Array  # height of b above a's plane, negative where they overlap [m], (r, ROOM)
    position: Array  # of the points in global axes [m], (r, ROOM, 3)
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
    """Cover a quadrilateral by points of a lattice and by triangles of its cells.

    Parameters
    ----------
    x, y : its four corners in their order around it [m], shape (4,)
    px, py : the LATTICE^2 points, written [m], shape (LATTICE^2 or more,)
    corners : numbers of the points at each triangle, four a cell by both diagonals, written, shape (4 cells or more, 3)

    Returns
    -------
    triangles : how many were written
    """
    m = LATTICE
    # bilinear: u runs from corner 0 to 1, v from there to the opposite side
    for i in range(m):
        v = i / (m - 1.0)
        for j in range(m):
            u, k = j / (m - 1.0), i * m + j
            px[k] = (1.0 - v) * ((1.0 - u) * x[0] + u * x[1]) + v * ((1.0 - u) * x[3] + u * x[2])
            py[k] = (1.0 - v) * ((1.0 - u) * y[0] + u * y[1]) + v * ((1.0 - u) * y[3] + u * y[2])
    found = 0
    for i in range(m - 1):
        for j in range(m - 1):
            a = i * m + j  # corners a, b, c, d around the cell
            b, c, d = a + 1, a + m + 1, a + m
            for p, q, r in ((a, b, c), (a, c, d), (a, b, d), (b, c, d)):
                corners[found, 0], corners[found, 1], corners[found, 2] = p, q, r
                found += 1
    return found


@kernel(fast=False, forceinline=True)
def _sum(x: Array, count: int) -> float:
    """Sum of the first ``count`` numbers of x, in order, on which last bits depend."""
    total = 0.0
    for k in range(count):
        total += x[k]
    return total


@kernel(fast=False)
def _spokes(x: Array, y: Array, px: Array, py: Array, corners: Index) -> int:
    """Cover a polygon by its centre, corners and middles of sides, and triangles.

    Parameters
    ----------
    x, y : corners of the polygon in their order around it [m], shape (n,)
    px, py : the 2 n + 1 points, written [m]: centre, then every corner with the middle of the side that follows it
    corners : numbers of the points at each of the 2 n triangles, from the centre to half a side, written, shape
        (2 n or more, 3)

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
    """Points of a convex counter-clockwise polygon, edges too, with their areas.

    A quadrilateral has a lattice, any other outline its centre, corners and middles of sides. Each triangle between
    these points gives a third of its area to each of its corners.

    Parameters
    ----------
    x, y : corners of the polygon [m], shape (n,)
    s, t, area : places of the points in the same axes [m] and their areas [m2], written, shape (ROOM,)

    Returns
    -------
    points : how many were written
    """
    n = len(x)
    most = max(LATTICE * LATTICE, 2 * n + 1)
    px, py, weight = np.empty(most), np.empty(most), np.zeros(most)
    corners = np.empty((max(4 * (LATTICE - 1) ** 2, 2 * n), 3), np.int64)
    # share of a triangle's cross product, twice its area, that counts: a half; a quarter in a lattice, whose cells are
    # cut along both diagonals and so covered twice
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
        # points at one place, as of corners that coincide, are one with the area of all
        same = -1
        for i in range(found):
            alike_s = np.rint(s[i] * ONE_POINT) == np.rint(px[k] * ONE_POINT)
            if alike_s and np.rint(t[i] * ONE_POINT) == np.rint(py[k] * ONE_POINT):
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
    """A place ``at`` [m] in the axes of block i, R^T (at - centroid), to ``out`` (3).

    ``rot`` and ``place`` are the rotation matrices and the centroids now [m] of all blocks, (n, 3, 3) and (n, 3).
    """
    d = (at[0] - place[i, 0], at[1] - place[i, 1], at[2] - place[i, 2])
    for r in range(3):
        out[r] = rot[i, 0, r] * d[0] + rot[i, 1, r] * d[1] + rot[i, 2, r] * d[2]


@kernel(fast=False)
def _place(row: int, a: int, b: int, at: tuple[float, float, float], at_b: tuple[float, float, float], poses: Poses,
           out: Cut) -> None:
    """Write how a joint lies in its blocks: arms, offset, frame and turn.

    Parameters
    ----------
    row : of ``out``, the joint; its axes are in ``out.world[row]`` already
    a, b : its blocks
    at, at_b : its origin now as a point of a and as one of b, global axes [m]
    poses, out : where all blocks are, and the joints that are cut, written
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
    # conjugate of the turn of b against a, conj(q_a) q_b, of scalars x and y and vectors p and q: it undoes that turn
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
    row : of ``out``, the joint that is written; its size stays 0 where two faces share no more than ``least``
    a, b : blocks of the joint; a has the base's face
    polygon : corners of the polygon on b's face, global axes [m], shape (m, 3)
    plane : unit normal of a's face, away from a, and its offset [m], shape (4,)
    corner : whether a corner or edge of b touches: then every corner of the polygon is a point of the same area
    poses, out : where all blocks are, and the joints that are cut
    least : area up to which two faces do not touch [m2]
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
    # t1 runs along the longest side of the polygon as it lies in the plane of a's face
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
            if np.sqrt((x[k] - x[k - 1]) ** 2 + (y[k] - y[k - 1]) ** 2) > ONE_CORNER * np.sqrt(each):
                s[count], t[count] = x[k], y[k]
                count += 1
        # a polygon with short sides alone is one corner
        if count == 0:
            s[0], t[0], count = x[0], y[0], 1
        for k in range(count):
            area[k] = each
    else:
        count = spread(x, y, s, t, area)
        if not _sum(area, count) > least:
            return
    # gap of a point: the height of b's face over the base plane there
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
    row : of ``out``, the joint that is written; its size stays 0 where the edges pass beyond their ends
    a, b : blocks of the joint
    found : start and vector u along the edge of a [m], start and vector v along that of b [m], and the unit normal n
        from a to b, which runs along u x v, shape (5, 3)
    poses, out : where all blocks are, and the joints that are cut
    """
    # parts of the way along u and v, ``one`` and ``two``, at which the edges are nearest: there d + two v - one u runs
    # along n. Its product with v or u, times n = u x v / |u x v|, leaves one unknown
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
    # along each edge, from where they pass now to where they would have run beyond either end
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
    rows : of ``met``, those that are cut, shape (r,)
    one, two : blocks a and b of each, shape (r,); a is the block of the base, or of the first of two edges
    met : how pairs of pieces meet
    poses : where all blocks are
    least : area up to which two faces do not touch [m2]
    out : the joints, written row by row; the size is 0 where there is none
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
    """Interface of two blocks that now looks most along n; of equal ones the nearest.

    Parameters
    ----------
    block_a, block_b : blocks of all interfaces, shape (k,)
    normal : of all interfaces in the reference position, unit vector from a to b, shape (k, 3)
    centre : of all interfaces in the reference position [m], shape (k, 3)
    poses : where all blocks are
    one, two : the first and the second block
    n : unit normal from the first block to the second now, global axes, shape (3,)
    at : a place now, global axes [m], shape (3,)

    Returns
    -------
    interface : its number; 0, the first of all, where neither block has one
    """
    # n (``own``) and the place (``local``) are turned back with each block to the reference position of the interfaces
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
            along = np.rint(ALIKE * (along if block_a[k] == block else -along))
            far = (centre[k, 0] - local[0]) ** 2 + (centre[k, 1] - local[1]) ** 2 + (centre[k, 2] - local[2]) ** 2
            if along > looks or (along == looks and far < nearest):
                best, looks, nearest = k, along, far
    return best
