"""Boxes along the axes of a wall: what one leaves of another, which hang together, and joining them along x."""

from __future__ import annotations

from limitmason.build.plan import Box

SAME = 1e-9
"""Chosen: places and lengths that differ by less are equal, far above rounding [m]."""


def subtract(box: Box, hole: Box) -> list[Box]:
    """Return what a hole leaves of a box.

    Pieces beside the hole have the box's height, pieces below and above it the hole's width.

    The hole goes through the whole thickness: its y does not count. Both are lower and upper corner [m].
    """
    (x0, y0, z0), (x1, y1, z1) = box
    hx0, hx1, hz0, hz1 = hole[0][0], hole[1][0], hole[0][2], hole[1][2]
    # of the box's size: what would be left thinner is rounding
    thin = 1e-9 * max(x1 - x0, z1 - z0)
    if hx0 >= x1 - thin or hx1 <= x0 + thin or hz0 >= z1 - thin or hz1 <= z0 + thin:
        return [box]
    rest: list[Box] = []
    left, right = x0, x1
    if hx0 > x0 + thin:
        rest.append(((x0, y0, z0), (hx0, y1, z1)))
        left = hx0
    if hx1 < x1 - thin:
        rest.append(((hx1, y0, z0), (x1, y1, z1)))
        right = hx1
    if hz0 > z0 + thin:
        rest.append(((left, y0, z0), (right, y1, hz0)))
    if hz1 < z1 - thin:
        rest.append(((left, y0, hz1), (right, y1, z1)))
    return rest


def _shared_area(a: Box, b: Box) -> float:
    """Area of the face that boxes ``a`` and ``b`` share [m2], 0 where they share none."""
    sides, touching = [], 0
    # boxes that share a face overlap along two axes and touch along the third
    for k in range(3):
        side = min(a[1][k], b[1][k]) - max(a[0][k], b[0][k])
        if abs(side) < SAME:
            touching += 1
        elif side < 0.0:
            return 0.0
        else:
            sides.append(side)
    return sides[0] * sides[1] if touching == 1 else 0.0


def connected(boxes: list[Box]) -> list[list[Box]]:
    """Group boxes that hang together face to face."""
    groups: list[list[Box]] = []
    for box in boxes:
        joined = [group for group in groups if any(_shared_area(box, other) > 0.0 for other in group)]
        groups = [group for group in groups if not any(group is one for one in joined)]
        groups.append([box, *(other for group in joined for other in group)])
    return groups


def side_area(a: Box, b: Box) -> float:
    """Area shared by two boxes that stand side by side along x [m2], 0 for others."""
    beside = abs(a[0][0] - b[1][0]) < SAME or abs(a[1][0] - b[0][0]) < SAME
    return _shared_area(a, b) if beside else 0.0


def coalesced(boxes: list[Box]) -> list[Box]:
    """Join boxes of equal cross-section that stand side by side along x."""
    rest = list(boxes)
    for i, a in enumerate(rest):
        for j, b in enumerate(rest):
            # y and z of the lower and of the upper corner
            same = all(abs(a[end][k] - b[end][k]) < SAME for end in (0, 1) for k in (1, 2))
            if i != j and same and abs(a[1][0] - b[0][0]) < SAME:
                joined = (a[0], b[1])
                return coalesced([box for k, box in enumerate(rest) if k not in (i, j)] + [joined])
    return rest
