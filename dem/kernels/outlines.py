"""Outlines of a joint's points, and whose edges end the contact along an axis."""

from typing import NamedTuple

import numpy as np

from dem.kernels.arrays import Array, Index, Joints, Points
from dem.kernels.compiled import kernel
from dem.kernels.kinematics import cross, dot
from dem.kernels.pivots import OF_A, OF_B, OF_BOTH, extent, extremes

ROUNDING = 1e-9
"""Length over the extent of all points below which it is nothing but rounding [-]."""

IN_A_ROW = 1e-16
"""Determinant of the sums of products, over their squared trace, up to which points lie in a row [-]."""

STRAIGHT = 1e-12
"""Twice the area of a triangle of three points, over that of their box, up to which they lie on one side [-]."""

AT_A_CORNER = 1e-6
"""Part of a side by which a line may miss it and still meet it at its end, so that no corner lets it through."""

BESIDE = 1e-4
"""Step beyond a side, and into either block, at which it is asked whose the side is, over the extent; chosen [-]."""


class SolidArrays(NamedTuple):
    """Convex pieces of blocks in the reference position, padded to the largest."""

    start: Index  # first piece of every block, (n + 1,)
    corners: Array  # from the block's centroid [m], (p, v, 3)
    faces: Index  # corners of every face, (p, f, k)
    size: Index  # how many corners a face has, (p, f)
    n_faces: Index  # (p,)


@kernel(fast=False)
def slope_of(x: Array, y: Array, height: Array) -> tuple[float, float]:
    """Slopes along x and y of the plane nearest to heights, by least squares.

    Where the points lie in a row it is level across the row.

    Parameters
    ----------
    x, y, height : places and heights of the points [m], shape (n,)

    Returns
    -------
    slope_x, slope_y : rise of the plane per length along x and along y [-]
    """
    n = len(x)
    # normal equations about the mean: sums of dx dx, dy dy, dx dy on the left, of dx h and dy h (u, v) on the right
    mx = my = mean = 0.0
    for k in range(n):
        mx, my, mean = mx + x[k], my + y[k], mean + height[k]
    mx, my, mean = mx / n, my / n, mean / n
    xx = yy = xy = u = v = 0.0
    for k in range(n):
        dx, dy, h = x[k] - mx, y[k] - my, height[k] - mean
        xx, yy, xy = xx + dx * dx, yy + dy * dy, xy + dx * dy
        u, v = u + dx * h, v + dy * h
    det, whole = xx * yy - xy * xy, xx + yy
    if det > IN_A_ROW * whole * whole:
        return (yy * u - xy * v) / det, (xx * v - xy * u) / det
    if not whole > 0.0:
        return 0.0, 0.0  # all points at one place: level
    # the sums of products of a row along (c, s) are its length squared times c c, c s and s s
    return (xx * u + xy * v) / (whole * whole), (xy * u + yy * v) / (whole * whole)


@kernel(fast=False, counted=True)
def convex_hull(x: Array, y: Array, corners: Index) -> int:
    """Corners of the convex hull of points, counter-clockwise from the leftmost.

    There are none in the middle of a side.

    Parameters
    ----------
    x, y : places of the points [m], shape (n,)
    corners : numbers of the points that are corners, written, shape (n + 2,)

    Returns
    -------
    found : how many corners were written

    Notes
    -----
    Source: the monotone chain of Andrew (1979).
    """
    n = len(x)
    order = np.empty(n, np.int64)
    # points of a column differ by rounding, and in a sort by that the lowest, a corner, comes second and is left out
    same = ROUNDING * extent(x, n)
    for k in range(n):
        at = k
        while at > 0 and (
            x[k] < x[order[at - 1]] - same or (x[k] <= x[order[at - 1]] + same and y[k] < y[order[at - 1]])
        ):
            order[at] = order[at - 1]
            at -= 1
        order[at] = k
    flat = STRAIGHT * extent(x, n) * extent(y, n)
    found = 0
    # the lower chain from left to right, then the upper one back; each leaves its last corner to the next
    for chain in range(2):
        first = found
        for step in range(n):
            k = order[step] if chain == 0 else order[n - 1 - step]
            while found - first > 1:
                i, j = corners[found - 2], corners[found - 1]
                if (x[j] - x[i]) * (y[k] - y[i]) - (y[j] - y[i]) * (x[k] - x[i]) > flat:
                    break
                found -= 1
            corners[found] = k
            found += 1
        found -= 1
    return found


@kernel(fast=False)
def _inside(solids: SolidArrays, block: int, at: tuple[float, float, float]) -> bool:
    """Whether a place lies in one of a block's convex pieces in reference position.

    Parameters
    ----------
    solids : pieces of all blocks
    block : number of the block
    at : place from the block's centroid, reference axes [m]
    """
    x = solids.corners
    for p in range(solids.start[block], solids.start[block + 1]):
        within = True
        for f in range(solids.n_faces[p]):
            # outward normal of the face by Newell's sums; its length does not matter
            n0 = n1 = n2 = 0.0
            m = solids.size[p, f]
            for k in range(m):
                u, v = solids.faces[p, f, k], solids.faces[p, f, (k + 1) % m]
                n0 += x[p, u, 1] * x[p, v, 2] - x[p, u, 2] * x[p, v, 1]
                n1 += x[p, u, 2] * x[p, v, 0] - x[p, u, 0] * x[p, v, 2]
                n2 += x[p, u, 0] * x[p, v, 1] - x[p, u, 1] * x[p, v, 0]
            u = solids.faces[p, f, 0]
            if n0 * (at[0] - x[p, u, 0]) + n1 * (at[1] - x[p, u, 1]) + n2 * (at[2] - x[p, u, 2]) > 0.0:
                within = False
                break
        if within:
            return True
    return False


@kernel(fast=False)
def _whose_side(j: int, joints: Joints, solids: SolidArrays, s: float, t: float, step: float) -> int:
    """Whose edge a side of joint j's outline is: the block's that ends there, or both.

    Just beyond the side a place is looked at on either side of the joint's plane. Where it lies within the block on
    that side, the block's face goes on, and the edge is the other's.

    Parameters
    ----------
    joints : all joints
    solids : pieces of all blocks
    s, t : place a step beyond the side, on the joint's plane [m]
    step : from the plane into either block [m]

    Returns
    -------
    whose : ``OF_A``, ``OF_B`` or ``OF_BOTH``
    """
    frame, turn = joints.frame, joints.turn
    local = (
        s * frame[j, 0, 0] + t * frame[j, 1, 0], s * frame[j, 0, 1] + t * frame[j, 1, 1],
        s * frame[j, 0, 2] + t * frame[j, 1, 2],
    )
    n = (step * frame[j, 2, 0], step * frame[j, 2, 1], step * frame[j, 2, 2])
    arm = joints.arm_a
    if _inside(solids, joints.block_a[j], (
        arm[j, 0] + local[0] - n[0], arm[j, 1] + local[1] - n[1], arm[j, 2] + local[2] - n[2]
    )):
        # a face that goes on on both sides ends at a seam of parts of one block: the points stay with b
        return OF_B
    # the joint's plane in block b's axes: rotated by the quaternion (w, v)
    w, v = turn[j, 0], (turn[j, 1], turn[j, 2], turn[j, 3])
    above = (local[0] + n[0], local[1] + n[1], local[2] + n[2])
    # v' = (2 w w - 1) x + 2 (v . x) v + 2 w v x x, of a unit quaternion
    across, along, same = cross(v, above), 2.0 * dot(v, above), 2.0 * w * w - 1.0
    arm = joints.arm_b
    goes_on = _inside(solids, joints.block_b[j], (
        arm[j, 0] + same * above[0] + along * v[0] + 2.0 * w * across[0],
        arm[j, 1] + same * above[1] + along * v[1] + 2.0 * w * across[1],
        arm[j, 2] + same * above[2] + along * v[2] + 2.0 * w * across[2],
    ))
    return OF_A if goes_on else OF_BOTH


@kernel(fast=False)
def _outline(x: Array, y: Array, wide: float, high: float, corners: Index, u: Array, v: Array) -> int:
    """Convex outline of points; of a row a strip as wide as the row is long.

    Parameters
    ----------
    x, y : places of the points [m], shape (n,)
    wide, high : their extents along x and y [m]
    corners : work space for numbers of points, shape (n + 2 or more,)
    u, v : corners of the outline along x and y [m], counter-clockwise, written, shape (n + 2 or more, at least 4)

    Returns
    -------
    count : corners of the outline
    """
    if min(wide, high) > ROUNDING * max(wide, high):
        count = convex_hull(x, y, corners)
        for i in range(count):
            u[i], v[i] = x[corners[i]], y[corners[i]]
        return count
    # a row: a strip from its first to its last point, half as wide as it is long to either side
    along, across = (x, y) if wide >= high else (y, x)
    (low, top), aside = extremes(along, len(along)), 0.5 * max(wide, high)
    one, two = (u, v) if wide >= high else (v, u)
    # counter-clockwise: along x from below, along y from the right
    sign = -1.0 if wide >= high else 1.0
    one[0], one[1], one[2], one[3] = along[low], along[top], along[top], along[low]
    two[0], two[1] = across[low] + sign * aside, across[top] + sign * aside
    two[2], two[3] = across[top] - sign * aside, across[low] - sign * aside
    return 4


@kernel(fast=False)
def _between(
    u: Array, v: Array, whose: Index, count: int, along: float, aside: float
) -> tuple[float, float, float]:
    """Where a point lies between ends along u, 0 to 1, and whose edge each end is.

    The ends are those of the line v = ``aside`` through the outline. Where the line misses the outline, or passes it
    at a corner alone, the answer is that of points that stay with b: the middle, between edges of b.

    Parameters
    ----------
    u, v : corners of the outline in the plane of the joint [m]; the first ``count`` of them count
    whose : OF_A, OF_B or OF_BOTH of the side that begins at every corner
    count : how many corners the outline has
    along, aside : place of the point along u and along v [m]

    Returns
    -------
    part : part of the way from the lower to the upper end [-]
    lower, upper : whose edge either end is, OF_A, OF_B or OF_BOTH
    """
    reach = max(extent(u, count), extent(v, count))
    low, high, first, last = np.inf, -np.inf, -1, -1
    for i in range(count):
        k = (i + 1) % count
        rise = v[k] - v[i]
        if not abs(rise) > ROUNDING * reach:
            continue  # a side along the line has its ends where the sides beside it meet the line
        part = (aside - v[i]) / rise  # of the side, up to where the line meets it
        # the side does not reach the height of the point
        if not (part > -AT_A_CORNER and part < 1.0 + AT_A_CORNER):
            continue
        at = u[i] + part * (u[k] - u[i])
        if at < low:
            low, first = at, i
        if at > high:
            high, last = at, i
    if first < 0:
        return 0.5, float(OF_B), float(OF_B)
    length = high - low
    if not length > ROUNDING * reach:
        return 0.5, float(OF_B), float(OF_B)
    return min(max((along - low) / length, 0.0), 1.0), float(whose[first]), float(whose[last])


@kernel(fast=False, counted=True)
def find_ends(points: Points, joints: Joints, setback: Array, solids: SolidArrays, rows: Index, ends: Array) -> None:
    """Write where the points of some joints lie between the ends of the outline.

    Parameters
    ----------
    points, joints : all of them
    setback : how far every point is set back [m], shape (m,)
    solids : pieces of all blocks
    rows : numbers of the joints that are asked for
    ends : written in the rows of their points, shape (m, 10): s, t [m]; slopes of the gap along s and t as it was made
        [-]; then for s and for t the part of the way from the lower to the upper end, and whose edge either end is
    """
    for j in rows:
        first, last = joints.start[j], joints.start[j + 1]
        n = last - first
        x, y, out = points.s[first:last], points.t[first:last], ends[first:last]
        own = points.gap[first:last] - setback[first:last]
        slope = slope_of(x, y, own)
        for k in range(n):
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x[k], y[k], slope[0], slope[1]
            # as long as nothing else is known, along s and along t: in the middle, between edges of b
            for c in (4, 7):
                out[k, c], out[k, c + 1], out[k, c + 2] = 0.5, OF_B, OF_B
        wide, high = extent(x, n), extent(y, n)
        largest = max(wide, high)
        if not largest > 0.0:
            continue  # a single point has no outline: it stays with b
        room = max(n + 2, 4)
        corners, u, v, whose = np.empty(room, np.int64), np.empty(room), np.empty(room), np.empty(room, np.int64)
        count, step = _outline(x, y, wide, high, corners, u, v), BESIDE * largest
        for i in range(count):
            # a step outwards from the middle of the side: the outline runs counter-clockwise
            k = (i + 1) % count
            du, dv = u[k] - u[i], v[k] - v[i]
            by = step / np.sqrt(du * du + dv * dv)
            s, t = 0.5 * (u[i] + u[k]) + by * dv, 0.5 * (v[i] + v[k]) - by * du
            whose[i] = _whose_side(j, joints, solids, s, t, step)
        # along an axis on which the points have no extent there is no way between two ends
        for k in range(n):
            if wide > ROUNDING * largest:
                out[k, 4], out[k, 5], out[k, 6] = _between(u, v, whose, count, x[k], y[k])
            if high > ROUNDING * largest:
                out[k, 7], out[k, 8], out[k, 9] = _between(v, u, whose, count, y[k], x[k])
