"""What the tests of walls measure on an assembly."""

import itertools

import numpy as np

from limitmason import Joint

JOINT = Joint(33.0)


BRICK = (0.4, 0.2, 0.2)  # twice as long as thick: every bond can be laid with it


def parts(assembly, *, without=("base",)):
    """Lower and upper corners of every convex piece, and the name of its block."""
    low, high, names = [], [], []
    for block in assembly.blocks:
        if block.name not in without:
            for part in block.parts:
                low.append(part.vertices.min(axis=0))
                high.append(part.vertices.max(axis=0))
                names.append(block.name)
    return np.array(low), np.array(high), names


def volume(assembly, *, without=("base",)):
    return sum(block.volume for block in assembly.blocks if block.name not in without)


def plan_area(recipe):
    area = recipe["length"] * recipe["thickness"]
    return area + sum((r["length"] - recipe["thickness"]) * r["thickness"] for r in recipe["returns"])


def deepest_overlap(low, high):
    """Largest, over all pairs of boxes, of the smallest side of their intersection; not above zero if none overlap."""
    side = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    depth = side.min(axis=2)
    np.fill_diagonal(depth, -np.inf)
    return depth.max()


def course_boxes(assembly, course):
    """Boxes of one course, counted from 1, by name."""
    low, high, names = parts(assembly)
    chosen = [k for k, name in enumerate(names) if f"-{course:02d}-" in name]
    return low[chosen], high[chosen], [names[k] for k in chosen]


def head_joints(assembly, course, axis):
    """Vertical joint planes of a course normal to `axis`: (position, from, to along the other axis)."""
    low, high, _ = course_boxes(assembly, course)
    other, found = 1 - axis, []
    for i, j in itertools.permutations(range(len(low)), 2):
        a, b = max(low[i, other], low[j, other]), min(high[i, other], high[j, other])
        if abs(high[i, axis] - low[j, axis]) < 1e-9 and b - a > 1e-9:
            found.append((high[i, axis], a, b))
    return found


def smallest_overlap(assembly, axis):
    """Smallest distance between parallel head joints of successive courses that lie one over the other."""
    nearest = np.inf
    for course in range(1, assembly.recipe["courses"]):
        pairs = itertools.product(head_joints(assembly, course, axis), head_joints(assembly, course + 1, axis))
        for (u, a, b), (v, c, d) in pairs:
            if min(b, d) - max(a, c) > 1e-9:
                nearest = min(nearest, abs(u - v))
    return nearest


def plans(lengths=(2.2, 2.07), bonds=("running", "header", "english", "flemish")):
    shapes = [
        {},
        {"plan": "L", "return_length": 1.33},
        {"plan": "L", "return_length": 1.2, "corner": "right"},
        {"plan": "T", "return_length": 1.2},
        {"plan": "T", "return_length": 1.2, "return_position": 0.9},
        {"plan": "U", "return_length": (1.2, 1.5)},
    ]
    return [{"bond": b, "length": x, **shape} for b, x, shape in itertools.product(bonds, lengths, shapes)]


def words(options):
    return "-".join(str(value) for value in options.values())
