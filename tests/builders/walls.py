"""Small assemblies built from boxes alone, so that tests of the mechanics do not depend on the builders."""

import dataclasses
import itertools

import numpy as np

import limitmason as lm
from limitmason.geometry import box


def on_slab(boxes, *, mu=0.65, joint=None, density=2000.0, **options):
    """Boxes ((x0, y0, z0), (x1, y1, z1)) standing on one wide fixed slab, block 0, whose top is z = 0."""
    corners = np.array(boxes, dtype=float)
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    margin = 0.5 * (high - low).max()
    slab = box((low[0] - margin, low[1] - margin, -0.1), (high[0] + margin, high[1] + margin, 0.0))
    joint = joint or lm.Joint.from_friction_coefficient(mu)
    return lm.Assembly.from_polyhedra(
        [slab, *(box(a, b) for a, b in boxes)], joint=joint, density=density, fixed=[0], **options
    )


def stack(widths_heights, *, depth=1.0, centred=True, **options):
    """Blocks one on the other, given as (width, height) from the bottom."""
    boxes, z, widest = [], 0.0, max(w for w, _ in widths_heights)
    for width, height in widths_heights:
        x0 = 0.5 * (widest - width) if centred else 0.0
        boxes.append(((x0, 0, z), (x0 + width, depth, z + height)))
        z += height
    return on_slab(boxes, **options)


def bonded_stack(n, strength, *, cohesion=1e5):
    """n equal blocks of 1 x 1 x 0.2 m whose joints bear tension [Pa]."""
    wall = stack([(1.0, 0.2)] * n, mu=0.5)
    joint = dataclasses.replace(wall.interfaces[0].joint, cohesion=cohesion, tensile_strength=strength)
    return wall.with_joints(joint)


def running_bond(units, courses, *, half_first=False, size=(0.4, 0.2, 0.2), heads=True, **options):
    """Running-bond wall in x-z, half units at both ends of every other course."""
    length, height, depth = size
    boxes = []
    for j in range(courses):
        if (j % 2 == 0) == half_first:
            ends = [0.0, *(length * (i + 0.5) for i in range(units)), units * length]
        else:
            ends = [length * i for i in range(units + 1)]
        boxes += [((a, 0, j * height), (b, depth, (j + 1) * height)) for a, b in itertools.pairwise(ends)]
    wall = on_slab(boxes, **options)
    return wall if heads else wall.with_interfaces(i for i in wall.interfaces if i.kind != "head")


def arch_blocks(radius, thickness, voussoirs, *, depth=0.5, mu=10.0):
    """Semicircular arch of equal voussoirs with radial joints between two fixed springers."""
    inner, outer = radius - 0.5 * thickness, radius + 0.5 * thickness
    angles = np.linspace(np.pi, 0.0, voussoirs + 1)

    def ray(angle, r):
        return [r * np.cos(angle), r * np.sin(angle)]

    outlines = [[ray(a, inner), ray(a, outer), ray(b, outer), ray(b, inner)] for a, b in itertools.pairwise(angles)]
    base = [[[s * inner, -0.2], [s * outer, -0.2], [s * outer, 0.0], [s * inner, 0.0]] for s in (-1.0, 1.0)]
    return lm.Assembly.from_polygons(
        [*base, *outlines], thickness=depth, joint=lm.Joint.from_friction_coefficient(mu), fixed=[0, 1], tolerance=1e-5
    )


def lattice_weights(n):
    """Weights of n evenly spaced points, ends included: equal but for the two at each end, right area and moment."""
    x = np.linspace(-0.5, 0.5, n)
    weights = np.full(n, 1.0 / (n - 1))
    weights[[0, 1]] = np.linalg.solve(
        [[1.0, 1.0], [x[0] ** 2, x[1] ** 2]],
        [0.5 - 0.5 * weights[2:-2].sum(), 1.0 / 24.0 - 0.5 * (weights * x**2)[2:-2].sum()],
    ) if n > 3 else ([1.0 / 6.0, 2.0 / 3.0] if n == 3 else [0.5, 0.5])
    weights[[-1, -2]] = weights[[0, 1]]
    return weights


def beside_or_on_a_large_block(ratio, *, high, scale=1.0, **options):
    """A cube and two small blocks on each other, their height the cube's over ``ratio``: they overturn at 0.25."""
    small = 1.0 / ratio
    x, z = (0.3, 1.0) if high else (1.5, 0.0)
    boxes = [((0, 0, 0), (1, 1, 1))]
    boxes += [((x, 0.3, z + k * small), (x + 0.5 * small, 0.3 + small, z + (k + 1) * small)) for k in range(2)]
    return on_slab(scale * np.array(boxes), mu=0.75, **options)


def corner():
    """L-shaped corner, courses interlocking."""
    boxes = []
    for j in range(4):
        z0, z1 = 0.2 * j, 0.2 * (j + 1)
        if j % 2 == 0:
            boxes += [((0, 0, z0), (0.4, 0.2, z1)), ((0.4, 0, z0), (0.8, 0.2, z1)), ((0, 0.2, z0), (0.2, 0.6, z1))]
        else:
            boxes += [((0, 0, z0), (0.2, 0.4, z1)), ((0.2, 0, z0), (0.6, 0.2, z1)), ((0.6, 0, z0), (0.8, 0.2, z1)),
                      ((0, 0.4, z0), (0.2, 0.6, z1))]
    return on_slab(boxes)


def leaning():
    """Two blocks, the upper one overhanging by more than half: it topples without any live load."""
    solids = [box((0, 0, -1), (1, 1, 0)), box((0.6, 0, 0), (1.8, 1, 1))]
    return lm.Assembly.from_polyhedra(solids, joint=lm.Joint(40.0), fixed=[0])
