"""A small stack with a very large block beside it or below it: their own loads and sizes differ by the ratio."""

import limitmason as lm
from limitmason.geometry import box

FRICTION = lm.Joint.from_friction_coefficient(0.7)


def beside_giant(ratio, courses=3):
    """A stack of unit cubes on a slab, and a cube of ``ratio`` times the size standing apart from it."""
    boxes = [box((0, 0, k), (1, 1, k + 1)) for k in range(courses)]
    far = 3.0 + ratio
    slab = box((-2, -2, -1), (far + ratio + 2, ratio + 2, 0))
    giant = box((far, 0, 0), (far + ratio, ratio, ratio))
    return lm.Assembly.from_polyhedra([slab, *boxes, giant], joint=FRICTION, fixed=[0], tolerance=1e-4)


def on_giant(ratio, courses=3):
    """A stack of unit cubes on a free slab of ``ratio`` times their size, twice as wide as high."""
    boxes = [box((0, 0, k), (1, 1, k + 1)) for k in range(courses)]
    slab = box((-2 * ratio, -2 * ratio, -ratio - 1), (2 * ratio, 2 * ratio, -ratio))
    giant = box((-ratio, -ratio, -ratio), (ratio, ratio, 0))
    return lm.Assembly.from_polyhedra([slab, *boxes, giant], joint=FRICTION, fixed=[0], tolerance=1e-4)
