"""Whose edges end the contact of faces that slide on each other, and points that stay with these edges.

A joint keeps its points as material points of block b, and the plane of block a. Where a's edge ends the contact, b
slides past that edge: what bears is the material of b that lies there now, and once b has turned the plane is b's. A
search for contacts cuts such a joint anew; one for the collapse load, which looks for none, lets its points follow.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.kernels import OF_A, OF_B, OF_BOTH
from dem.model.state import ENDS, PointForces, State
from limitmason.arrays import Array, Flags, Index
from limitmason.model import Assembly

FACES = 1

NOTICED = 1e-4
"""Slip from which the points of a joint follow its edges, over the square root of its area [-]."""

class _Outline(NamedTuple):
    """Convex outline of a joint, counter-clockwise, and whose edge each side is."""

    corners: Array
    whose: NDArray[np.int64]


def follow_edges(assembly: Assembly, state: State) -> None:
    """Let the points of joints that have slipped follow the edges of their faces.

    Changes ``state.points``.

    With b slipped by u along an axis, an end that is an edge of b moves by u over the face of a, one of a by nothing,
    and one of both by what makes the contact smaller. Points between move in proportion. Areas stay until the joint is
    cut anew.
    """
    joints, points, now = state.joints, state.points, state.measured(assembly)
    mine = np.repeat(find_ends(assembly, state, now), np.diff(joints.start))
    row, slip = state.ends[mine], now.slip[mine]
    s, t = (
        row[:, c] - slip[:, c] + _moved(row[:, 4 + 3 * c], row[:, 5 + 3 * c], row[:, 6 + 3 * c], slip[:, c])
        for c in (0, 1)
    )
    # the gap belongs to the place on b's face
    points.gap[mine] += row[:, 2] * (s - points.s[mine]) + row[:, 3] * (t - points.t[mine])
    points.s[mine], points.t[mine] = s, t


def find_ends(assembly: Assembly, state: State, now: PointForces) -> NDArray[np.bool_]:
    """Joints between faces that have slid, shape (k,), once it is known whose edges end them (``state.ends``)."""
    slid, first = joints_that_slid(state, now), state.joints.start[:-1]
    for k in np.flatnonzero(slid & np.isnan(state.ends[first, 0])).tolist():
        _find_ends_of(assembly, state, k)
    return slid


def note_slid(state: State, now: PointForces) -> None:
    """Mark the joints between faces that have slid, whose ends are then found when they are asked for.

    The mark is a number in the second column of ``state.ends`` beside none in the first.
    """
    first = state.joints.start[:-1]
    new = first[joints_that_slid(state, now) & np.isnan(state.ends[first, 1])]
    state.ends[new, 1] = 0.0


def joints_that_slid(state: State, now: PointForces) -> Flags:
    """Joints between faces that have slid now by more than rounding, shape (k,)."""
    joints, area = state.joints, state.points.area
    first = joints.start[:-1]
    if not len(first):
        return np.zeros(0, dtype=bool)
    total = np.add.reduceat(area, first)
    mean = np.add.reduceat(now.slip * area[:, None], first) / total[:, None]
    return np.asarray((state.contact == FACES) & (np.linalg.norm(mean, axis=1) > NOTICED * np.sqrt(total)))


def _find_ends_of(assembly: Assembly, state: State, k: int) -> None:
    """Write down whose edges end joint k."""
    mine = slice(int(state.joints.start[k]), int(state.joints.start[k + 1]))
    state.ends[mine] = _ends_of(assembly, state, k, mine)


def _moved(part: Array, lower: Array, upper: Array, slip: Array) -> Array:
    """Motion over a's face of points at a part of the way from a lower to an upper end, of slip [m]."""
    low = np.select([lower == OF_A, lower == OF_B], [0.0, slip], np.maximum(slip, 0.0))
    high = np.select([upper == OF_A, upper == OF_B], [0.0, slip], np.minimum(slip, 0.0))
    return np.asarray((1.0 - part) * low + part * high)


def _ends_of(assembly: Assembly, state: State, k: int, mine: slice) -> Array:
    """Rows of ``State.ends`` of joint k, one for each of its points.

    A row holds s, t and the gradient of the gap as it was made, then for each axis its ends. Those are the part of the
    way from the lower to the upper end, and whose edge either is.
    """
    points = state.points
    xy = np.column_stack([points.s[mine], points.t[mine]])
    out = np.full((len(xy), ENDS), np.nan)
    out[:, :2], out[:, 2:4] = xy, 0.0
    out[:, 4::3], out[:, 5::3], out[:, 6::3] = 0.5, OF_B, OF_B
    own = points.gap[mine] - state.setback[mine]
    if own.any():
        out[:, 2:4] = np.linalg.lstsq(np.column_stack([np.ones(len(xy)), xy]), own, rcond=None)[0][1:]
    size = np.ptp(xy, axis=0)
    if not size.max() > 0.0:
        return out
    outline = _outline(assembly, state, k, xy, size)
    for axis in (0, 1):
        if size[axis] > 1e-9 * size.max():
            out[:, 4 + 3 * axis : 7 + 3 * axis] = _between(outline, xy, axis)
    return out


def _outline(assembly: Assembly, state: State, k: int, xy: Array, size: Array) -> _Outline:
    """Outline of the points of a joint.

    Where they lie in a row, it is a narrow strip around the row.
    """
    if size.min() <= 1e-9 * size.max():
        # a row of points in a plane: a strip around it
        axis = int(size.argmax())
        low, high = xy[xy[:, axis].argmin()].copy(), xy[xy[:, axis].argmax()].copy()
        aside = 0.5 * size.max() * np.eye(2)[1 - axis]
        corners = np.array([low - aside, high - aside, high + aside, low + aside])
        corners = corners if axis == 0 else corners[::-1]
    else:
        corners = xy[convex_hull(xy)]
    following = np.roll(corners, -1, axis=0)
    along = following - corners
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    step = 1e-4 * size.max()
    beyond = 0.5 * (corners + following) + step * outward
    joints = state.joints
    frame, (a, b) = joints.frame[k], (int(joints.block_a[k]), int(joints.block_b[k]))
    local = beyond @ frame[:2]
    w, v = joints.turn[k, 0], joints.turn[k, 1:]
    turn = (2.0 * w * w - 1.0) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * w * np.cross(np.eye(3), v)
    in_a = _inside(assembly, a, assembly.centroids[a] + joints.arm_a[k] + local - step * frame[2])
    in_b = _inside(assembly, b, assembly.centroids[b] + joints.arm_b[k] + (local + step * frame[2]) @ turn.T)
    # a face that goes on on both sides ends at a seam of parts of one block: the points stay with b
    whose = np.where(in_a, OF_B, np.where(in_b, OF_A, OF_BOTH))
    return _Outline(corners, whose)


def convex_hull(xy: Array) -> list[int]:
    """Corners of the convex hull of points, counter-clockwise from the leftmost; none in the middle of a side.

    Notes
    -----
    Source: the monotone chain of Andrew (1979).
    """
    x, y = xy.T.tolist()
    flat = 1e-12 * float(np.prod(np.ptp(xy, axis=0)))
    order = np.lexsort((xy[:, 1], xy[:, 0])).tolist()
    chains = []
    for way in (order, order[::-1]):
        chain: list[int] = []
        for k in way:
            while len(chain) > 1:
                i, j = chain[-2:]
                if (x[j] - x[i]) * (y[k] - y[i]) - (y[j] - y[i]) * (x[k] - x[i]) > flat:
                    break
                chain.pop()
            chain.append(k)
        chains += chain[:-1]
    return chains


@cache
def _sides(faces: tuple[tuple[int, ...], ...]) -> tuple[Index, Index, Index]:
    """Corners at either end of all sides of all faces, and where the sides of each face begin."""
    following = [i for face in faces for i in (*face[1:], face[0])]
    start = np.cumsum([0, *(len(face) for face in faces[:-1])])
    return np.array([i for face in faces for i in face]), np.array(following), start


def _inside(assembly: Assembly, block: int, at: Array) -> Flags:
    """Whether points lie in a block, reference position."""
    found = np.zeros(len(at), dtype=bool)
    for part in assembly.blocks[block].parts:
        one, two, start = _sides(part.faces)
        u, v = part.vertices[one], part.vertices[two]
        across = u[:, [1, 2, 0]] * v[:, [2, 0, 1]] - u[:, [2, 0, 1]] * v[:, [1, 2, 0]]
        n = np.add.reduceat(across, start, axis=0)
        found |= (((at[:, None] - u[start]) * n).sum(axis=2) <= 0.0).all(axis=1)
    return found


def _between(outline: _Outline, points: Array, axis: int) -> Array:
    """Where points lie between the outline's ends along an axis, 0 low to 1 high, and whose edge each end is, (m, 3).

    (0.5, OF_B, OF_B) where there are none.
    """
    p, q = outline.corners, np.roll(outline.corners, -1, axis=0)
    other, rows = 1 - axis, np.arange(len(points))
    rise = q[:, other] - p[:, other]
    reach = np.ptp(outline.corners, axis=0).max()
    met = np.broadcast_to(np.abs(rise) > 1e-9 * reach, (len(points), len(p)))
    way = np.divide(points[:, other, None] - p[:, other], rise, out=np.full(met.shape, -1.0), where=met)
    met = met & (way > -1e-6) & (way < 1.0 + 1e-6)
    at = p[:, axis] + way * (q[:, axis] - p[:, axis])
    low, high = np.where(met, at, np.inf).argmin(axis=1), np.where(met, at, -np.inf).argmax(axis=1)
    length = at[rows, high] - at[rows, low]
    ends = met.any(axis=1) & (length > 1e-9 * reach)
    part = np.divide(points[:, axis] - at[rows, low], length, out=np.full(len(points), 0.5), where=ends)
    whose = np.where(ends, [outline.whose[low], outline.whose[high]], OF_B)
    return np.column_stack([np.clip(part, 0.0, 1.0), *whose])


def pivots_on_a(assembly: Assembly, state: State, now: PointForces, rows: Index) -> Flags:
    """Whether all that bears in joints that slid and turned is an edge of a: the face they bear on is b's, (r,)."""
    where = np.empty(len(rows), dtype=np.int64)
    # whose edges end a contact is found only where the first round asks for it; the second then knows
    for _ in range(2):
        kernels.bearing_ends(state.points, state.joints.start, state.ends, now.opening, now.slip, rows, where)
        for k in rows[where == kernels.UNKNOWN].tolist():
            _find_ends_of(assembly, state, k)
    return np.asarray(where == kernels.ON_A)
