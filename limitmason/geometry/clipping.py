"""Convex polygons clipped against convex polygons, thousands of pairs at a time."""

import numpy as np

from limitmason.arrays import Array, Flags, Index


def clip_convex_batch(subject: Array, n_subject: Index, window: Array, n_window: Index) -> tuple[Array, Index]:
    """Intersections of m pairs of convex counter-clockwise polygons.

    One polygon of a pair is clipped by the sides of the other (Sutherland and Hodgman, 1974). Corners are those that
    :func:`~limitmason.geometry.polygon.clip_convex` gives of one pair, to the last digit: this is for many at once.

    Parameters
    ----------
    subject : [m], shape (m, K, 2), rows padded to K vertices
    n_subject : vertex counts, shape (m,)
    window, n_window : the same for the clipping polygons, shape (m, L, 2) and (m,)

    Returns
    -------
    polygons : [m], shape (m, K + L, 2); entries beyond the count repeat the last vertex
    counts : shape (m,); 0 where the pair does not overlap
    """
    m, k = subject.shape[:2]
    width = k + window.shape[1]
    points = np.concatenate([subject, np.repeat(subject[:, -1:], width - k, axis=1)], axis=1)
    count = np.asarray(n_subject, dtype=np.intp).copy()
    slots = np.arange(width)
    rows = np.arange(m)
    # every edge of the windows in turn cuts off what lies to its right
    for edge in range(window.shape[1]):
        active = (edge < n_window) & (count > 0)
        if not active.any():
            continue
        a = window[:, edge]
        b = window[rows, (edge + 1) % np.maximum(n_window, 1)]  # an empty window has no next vertex, nor is it active
        e = b - a
        # twice the area to the left of the window's edge: 0 and more is inside
        d = e[:, None, 0] * (points[..., 1] - a[:, None, 1]) - e[:, None, 1] * (points[..., 0] - a[:, None, 0])
        valid = slots < count[:, None]
        after = np.where(slots + 1 < count[:, None], slots + 1, 0)  # the last vertex is followed by the first
        d_after = np.take_along_axis(d, after, axis=1)
        p_after = np.take_along_axis(points, after[..., None], axis=1)
        keep = valid & (d >= 0)
        cross = valid & (((d > 0) & (d_after < 0)) | ((d < 0) & (d_after > 0)))
        t = np.divide(d, d - d_after, out=np.zeros_like(d), where=cross)
        # interleave: every vertex that stays, then the point where the edge leaving it crosses the line
        both = np.stack([keep, cross], axis=2).reshape(m, -1)
        candidates = np.stack([points, points + t[..., None] * (p_after - points)], axis=2).reshape(m, -1, 2)
        new_count = both.sum(axis=1)
        # a stable sort of flags moves what is kept to the front and leaves its order
        order = np.argsort(~both, axis=1, kind="stable")[:, :width]
        clipped = np.take_along_axis(candidates, order[..., None], axis=1)
        points = np.where(active[:, None, None], clipped, points)
        count = np.where(active, new_count, count)
    last = np.maximum(count - 1, 0)
    fill = np.minimum(slots, last[:, None])
    return np.take_along_axis(points, fill[..., None], axis=1), count


def area_perimeter(polygons: Array) -> tuple[Array, Array]:
    """Signed area [m2] and perimeter [m] of padded polygons, shape (m, K, 2), whose padding repeats the last vertex."""
    q = polygons - polygons.mean(axis=1, keepdims=True)
    r = np.roll(q, -1, axis=1)
    area = 0.5 * (q[..., 0] * r[..., 1] - q[..., 1] * r[..., 0]).sum(axis=1)
    return area, np.linalg.norm(r - q, axis=2).sum(axis=1)


def drop_redundant_vertices(polygons: Array, counts: Index, slack: Array) -> tuple[Array, Index]:
    """Padded polygons without repeated vertices, nor vertices that lie on a side.

    A vertex is dropped that is nearer than its ``slack`` [m] to the next one, or to the line past it. Clipping along a
    shared edge leaves such vertices, one rounding error apart.

    Parameters
    ----------
    polygons : padded by the last vertex [m], shape (m, K, 2)
    counts : number of vertices of each, shape (m,)
    slack : of each [m], shape (m,)

    Returns
    -------
    polygons, counts : in the same form
    """
    points, count = polygons, counts.copy()
    slots = np.arange(points.shape[1])

    def keep_only(keep: Flags) -> tuple[Array, Index]:
        """The vertices to keep at the front of every row, padded by the last one, and how many they are."""
        # a stable sort of flags moves what is kept to the front and leaves its order
        order = np.argsort(~keep, axis=1, kind="stable")
        kept = keep.sum(axis=1)
        fill = np.minimum(slots, np.maximum(kept - 1, 0)[:, None])
        packed = np.take_along_axis(points, order[..., None], axis=1)
        return np.take_along_axis(packed, fill[..., None], axis=1), kept

    # dropping one of two equal vertices may bring its neighbours together: twice
    for _ in range(2):
        valid = slots < count[:, None]
        after = np.where(slots + 1 < count[:, None], slots + 1, 0)
        gap = np.linalg.norm(points - np.take_along_axis(points, after[..., None], axis=1), axis=2)
        points, count = keep_only(valid & (gap > slack[:, None]))
    # one vertex at a time: two neighbours that each look redundant may together carry a corner
    for _ in range(points.shape[1]):
        valid = slots < count[:, None]
        after = np.where(slots + 1 < count[:, None], slots + 1, 0)
        before = np.where(slots > 0, slots - 1, np.maximum(count - 1, 0)[:, None])
        # distance of every vertex from the line through its neighbours; a triangle keeps its three
        p0 = np.take_along_axis(points, before[..., None], axis=1)
        p1 = np.take_along_axis(points, after[..., None], axis=1)
        chord, arm = p1 - p0, points - p0
        length = np.maximum(np.linalg.norm(chord, axis=2), 1e-300)
        offset = np.abs(chord[..., 0] * arm[..., 1] - chord[..., 1] * arm[..., 0]) / length
        offset = np.where(valid & (count > 3)[:, None], offset, np.inf)
        worst = offset.argmin(axis=1)
        redundant = offset[np.arange(len(points)), worst] <= slack
        if not redundant.any():
            break
        points, count = keep_only(valid & ~(redundant[:, None] & (slots == worst[:, None])))
    return points, count
