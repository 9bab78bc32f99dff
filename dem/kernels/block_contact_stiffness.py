"""Stiffness that a block feels through its contact points when it alone moves.

It is for time steps and masses; forces of points are made in ``joint_forces``, by ``joint_law``.
"""

import numpy as np

from dem.kernels.arrays import LAW, Array, Index, Joints, Points
from dem.kernels.compiled import kernel

RUN = 128
"""Rows that are summed without being halved, as in numpy."""

DEPTH = 48
"""Halvings that there is room for: more than the rows of any array ask for."""


@kernel(fast=False)
def _run(rows: Array, first: int, count: int, out: Array, eight: Array) -> None:
    """Sum of at most :data:`RUN` rows, to ``out``, with the last bits of numpy's.

    numpy adds up every eighth number by itself, as its vector registers do, then these eight sums in pairs, and at the
    end what is left of the rows. Another order would give other last bits.

    Parameters
    ----------
    rows : numbers that are summed column by column, shape (n, width)
    first, count : the row to begin with, and how many rows are added
    out : the sum, written, shape (width,)
    eight : working memory of the eight sums, shape (8, width), so that no array is made here
    """
    width = rows.shape[1]
    # fewer rows than there are sums are added one by one, as in numpy
    if count < 8:
        for c in range(width):
            out[c] = 0.0
        whole = 0
    else:
        for k in range(8):
            for c in range(width):
                eight[k, c] = rows[first + k, c]
        whole = count - count % 8
        for k in range(8, whole):
            for c in range(width):
                eight[k % 8, c] += rows[first + k, c]
        for c in range(width):
            low = (eight[0, c] + eight[1, c]) + (eight[2, c] + eight[3, c])
            out[c] = low + ((eight[4, c] + eight[5, c]) + (eight[6, c] + eight[7, c]))
    for k in range(whole, count):
        for c in range(width):
            out[c] += rows[first + k, c]


@kernel(fast=False, counted=True)
def _pairwise(rows: Array, first: int, count: int, out: Array) -> None:
    """Sum of rows in the order of numpy: halves of halves down to :data:`RUN` rows.

    The same order gives the last bits of numpy's sum. A stack stands for a function that calls itself: at each depth a
    run of rows (``begin``, ``size``), how many of its halves are summed (``done``), the sum of its first half
    (``lower``) and of the whole (``found``).

    Parameters
    ----------
    rows : numbers that are summed column by column, shape (n, width)
    first, count : the row to begin with, and how many rows are added
    out : the sum, written, shape (width,)
    """
    width, depth = rows.shape[1], 0
    begin, size, done = np.zeros(DEPTH, np.int64), np.zeros(DEPTH, np.int64), np.zeros(DEPTH, np.int64)
    lower, found, eight = np.empty((DEPTH, width)), np.empty((DEPTH, width)), np.empty((8, width))
    begin[0], size[0] = first, count
    while True:
        if size[depth] <= RUN:
            _run(rows, begin[depth], size[depth], found[depth], eight)
        elif done[depth] < 2:
            half = size[depth] // 2
            half -= half % 8  # whole groups of eight, as in numpy
            if done[depth] == 1:
                for c in range(width):
                    lower[depth, c] = found[depth + 1, c]
            begin[depth + 1] = begin[depth] + (half if done[depth] == 1 else 0)
            size[depth + 1] = size[depth] - half if done[depth] == 1 else half
            depth += 1
            done[depth] = 0
            continue
        else:
            for c in range(width):
                found[depth, c] = lower[depth, c] + found[depth + 1, c]
        if depth == 0:
            break
        depth -= 1
        done[depth] += 1
    for c in range(width):
        out[c] = found[0, c]


@kernel(fast=False, counted=True)
def add_springs(
    points: Points, joints: Joints, rows: Index, of_b: bool, frame: Array, out: Array
) -> None:
    """Add the stiffness of points of joints to one block each: sums of k A g g^T.

    g = (e, r x e) for e along t1, t2 and n, with r from the block's centroid to the point; k is ks, ks and kn. Every
    joint is summed up before it is added, in the order in which ``numpy.add.reduceat`` does.

    Parameters
    ----------
    points, joints : all of them
    rows : numbers of the joints that count, shape (r,)
    of_b : whether the blocks are the second ones of the joints, or the first
    frame : rows t1, t2, n of these joints in the reference axes of that block, shape (r, 3, 3)
    out : stiffness of every block against displacement and turn [N/m, N, N m], added to, shape (n, 6, 6)
    """
    # g and k A g of the three directions, k A [N/m], and the sums of a joint: of every point, and of all
    g, pushed, stiff = np.empty((3, 6)), np.empty((3, 6)), np.empty(3)
    total, eight = np.empty(36), np.empty((8, 36))
    most = 0
    for j in rows:
        most = max(most, joints.start[j + 1] - joints.start[j])
    part = np.empty((most, 36))
    arm = joints.arm_b if of_b else joints.arm_a
    for row in range(rows.size):
        j = rows[row]
        block = joints.block_b[j] if of_b else joints.block_a[j]
        kn, ks = joints.law[j, LAW.kn], joints.law[j, LAW.ks]
        for i in range(3):
            for k in range(3):
                g[i, k] = frame[row, i, k]
        first, count = joints.start[j], joints.start[j + 1] - joints.start[j]
        for k in range(count):
            s, t, area = points.s[first + k], points.t[first + k], points.area[first + k]
            x = arm[j, 0] + s * g[0, 0] + t * g[1, 0]
            y = arm[j, 1] + s * g[0, 1] + t * g[1, 1]
            z = arm[j, 2] + s * g[0, 2] + t * g[1, 2]
            stiff[0], stiff[1], stiff[2] = ks * area, ks * area, kn * area
            for i in range(3):
                g[i, 3] = y * g[i, 2] - z * g[i, 1]
                g[i, 4] = z * g[i, 0] - x * g[i, 2]
                g[i, 5] = x * g[i, 1] - y * g[i, 0]
                for c in range(6):
                    pushed[i, c] = stiff[i] * g[i, c]
            for r in range(6):
                for c in range(6):
                    part[k, 6 * r + c] = pushed[0, r] * g[0, c] + pushed[1, r] * g[1, c] + pushed[2, r] * g[2, c]
        if count == 0:
            continue
        # reduceat begins with the first row and adds the sum of the others to it
        head = min(count, 1)  # no constant, for which the sums would be compiled once more
        if count <= RUN:
            _run(part, head, count - head, total, eight)
        else:
            _pairwise(part, head, count - head, total)
        for r in range(6):
            for c in range(6):
                out[block, r, c] += part[0, 6 * r + c] + total[6 * r + c]
