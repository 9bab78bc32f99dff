"""Outlines of random masonry in the x-z plane: every function returns (free outlines, fixed outlines) [m]."""

import itertools

import numpy as np
from scipy.spatial import Voronoi

Array = np.ndarray
Outlines = list[Array]


def rectangle(x0: float, x1: float, z0: float, z1: float) -> Array:
    """Counter-clockwise in (x, z)."""
    return np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])


def on_slab(free: Outlines) -> tuple[Outlines, Outlines]:
    """These outlines on a held slab of their own whose top is their lowest point."""
    points = np.vstack(free)
    low, high = points.min(axis=0), points.max(axis=0)
    margin, depth = 0.3 * (high[0] - low[0]), 0.2 * (high - low).max()
    return free, [rectangle(low[0] - margin, high[0] + margin, low[1] - depth, low[1])]


def cuts(random, length: float, pieces: int, least: float = 0.35) -> Array:
    """Ends of ``pieces`` random lengths, none shorter than ``least`` of their mean."""
    share = least + (1 - least) * random.dirichlet(np.full(pieces, 2.0)) * pieces
    ends = np.concatenate([[0.0], np.cumsum(share / share.sum())]) * length
    ends[-1] = length
    return ends


def bond(random) -> tuple[Outlines, Outlines]:
    """Courses of random heights and random joints, or a running bond of equal units."""
    courses, units = random.integers(2, 4), random.integers(2, 4)
    free, width = [], random.uniform(0.6, 2.0)
    levels = cuts(random, random.uniform(0.8, 2.0), courses)
    running = random.random() < 0.3
    for j, (z0, z1) in enumerate(itertools.pairwise(levels)):
        if running:
            ends = np.linspace(0, width, units + 1)
            if j % 2:
                ends = np.concatenate([[0.0], 0.5 * (ends[1:] + ends[:-1]), [width]])
        else:
            ends = cuts(random, width, units + int(random.integers(-1, 2)))
        free += [rectangle(a, b, z0, z1) for a, b in itertools.pairwise(ends)]
    return on_slab(free)


def rubble(random) -> tuple[Outlines, Outlines]:
    """Voronoi cells of a rectangle; drawn again until no edge is shorter than a fiftieth of it."""
    while True:
        n, size = random.integers(3, 8), np.array([random.uniform(0.5, 1.5), random.uniform(0.8, 2.0)])
        seeds = random.uniform(0.05, 0.95, (n, 2)) * size
        mirrored = [seeds]
        for axis, at in ((0, 0.0), (0, size[0]), (1, 0.0), (1, size[1])):
            other = seeds.copy()
            other[:, axis] = 2 * at - other[:, axis]
            mirrored.append(other)
        cells = Voronoi(np.vstack(mirrored))
        vertices = cells.vertices.copy()
        for axis in (0, 1):  # the mirror images put these corners on the rectangle up to rounding
            for at in (0.0, size[axis]):
                vertices[np.abs(vertices[:, axis] - at) < 1e-9, axis] = at
        free = []
        for k in range(n):
            outline = vertices[cells.regions[cells.point_region[k]]]
            angle = np.arctan2(*(outline - outline.mean(axis=0)).T[::-1])
            free.append(outline[np.argsort(angle)])
        edges = [np.linalg.norm(np.roll(o, -1, axis=0) - o, axis=1).min() for o in free]
        if min(edges) > 0.02 * size.max():
            return on_slab(free)


def arch(random) -> tuple[Outlines, Outlines]:
    """Ring of voussoirs, equal or not, between two held skewbacks."""
    n = int(random.integers(3, 9))
    half = random.uniform(0.25, 0.5) * np.pi
    thickness = random.uniform(0.08, 0.35)
    angles = np.pi / 2 + half - cuts(random, 2 * half, n, random.choice([0.5, 1.0]))
    inner, outer = 1.0 - thickness / 2, 1.0 + thickness / 2

    def voussoir(a: float, b: float) -> Array:
        ray = np.array([[np.cos(a), np.sin(a)], [np.cos(b), np.sin(b)]])
        return np.array([inner * ray[1], outer * ray[1], outer * ray[0], inner * ray[0]])

    free = [voussoir(a, b) for a, b in itertools.pairwise(angles)]
    return free, [voussoir(angles[0] + 0.15, angles[0]), voussoir(angles[-1], angles[-1] - 0.15)]


def opening(random) -> tuple[Outlines, Outlines]:
    """Two piers, a lintel across them, a course on top."""
    left, gap, right = random.uniform(0.3, 0.8), random.uniform(0.3, 0.9), random.uniform(0.3, 0.8)
    height = random.uniform(0.5, 1.2)
    free = []
    for x0, x1 in ((0.0, left), (left + gap, left + gap + right)):
        levels = cuts(random, height, int(random.integers(1, 4)))
        free += [rectangle(x0, x1, a, b) for a, b in itertools.pairwise(levels)]
    bearing = random.uniform(0.3, 1.0, 2) * [left, right]
    x0, x1 = left - bearing[0], left + gap + bearing[1]
    free.append(rectangle(x0, x1, height, height + 0.2))
    ends = x0 + cuts(random, x1 - x0, int(random.integers(1, 4)))
    free += [rectangle(a, b, height + 0.2, height + 0.45) for a, b in itertools.pairwise(ends)]
    return on_slab(free)


def leaning(random) -> tuple[Outlines, Outlines]:
    """A bond that leans: its beds level and its heads sheared, or the whole of it turned with its base."""
    free, held = bond(random)
    if random.random() < 0.5:
        slope = random.uniform(-0.3, 0.3)
        return on_slab([o + np.outer(o[:, 1], [slope, 0.0]) for o in free])
    angle = random.uniform(-0.2, 0.2)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return [o @ turn for o in free], [o @ turn for o in held]


def tower(random, offsets: float = 0.25) -> tuple[Outlines, Outlines]:
    """Blocks one on the other, each moved sideways by up to a share of the width below."""
    free, x, z, width = [], 0.0, 0.0, 1.0
    for _ in range(int(random.integers(1, 6))):
        height = random.uniform(0.2, 1.2) * width
        free.append(rectangle(x, x + width, z, z + height))
        z += height
        new = width * random.uniform(0.6, 1.2)
        x += 0.5 * (width - new) + random.uniform(-offsets, offsets) * width
        width = new
    return on_slab(free)


def overhang(random) -> tuple[Outlines, Outlines]:
    """A tower whose offsets are so large that about half of them cannot stand."""
    return tower(random, 0.5)


def on_giant(random) -> tuple[Outlines, Outlines]:
    """Small towers on one very large free block."""
    free = [rectangle(0.0, 1.0, 0.0, random.uniform(0.3, 1.5))]
    top, x = free[0][2, 1], 0.1
    for _ in range(int(random.integers(1, 3))):
        small, _ = tower(random)
        scale = 10 ** random.uniform(-4, -1)
        points = np.vstack(small)
        free += [(o - [points[:, 0].min(), 0.0]) * scale + [x, top] for o in small]
        x += np.ptp(points[:, 0]) * scale + 0.1
    return on_slab(free)


def shims(random) -> tuple[Outlines, Outlines]:
    """A large block, perhaps with another on it, on two or three small ones of equal height."""
    size = 10 ** random.uniform(-3, -0.5)
    places = np.sort(random.uniform(0.0, 1.0 - size, int(random.integers(2, 4))))
    places[0], places[-1] = random.uniform(0.0, 0.1), 0.9 - size
    places = places[np.concatenate([[True], np.diff(places) > 1.01 * size])]
    free = [rectangle(x, x + size, 0.0, size) for x in places]
    free.append(rectangle(0.0, 1.0, size, size + random.uniform(0.3, 1.5)))
    if random.random() < 0.5:
        free.append(rectangle(0.1, 0.8, free[-1][2, 1], free[-1][2, 1] + 0.4))
    return on_slab(free)


SINGLE = {
    "rubble": rubble, "bond": bond, "arch": arch, "opening": opening, "leaning": leaning, "tower": tower,
    "overhang": overhang, "small on giant": on_giant, "shims": shims,
}


def side_by_side(random) -> tuple[Outlines, Outlines]:
    """Two or three of the others side by side, sizes over four decades, nothing between them."""
    free, held, x = [], [], 0.0
    for _ in range(int(random.integers(2, 4))):
        name = random.choice(["rubble", "bond", "arch", "opening", "leaning", "tower", "overhang"])
        part, base = SINGLE[name](random)
        scale = 10 ** random.uniform(-4, 0)
        low, high = np.vstack(part + base)[:, 0].min(), np.vstack(part + base)[:, 0].max()
        move = np.array([x - low * scale, 0.0])
        free += [o * scale + move for o in part]
        held += [o * scale + move for o in base]
        x += (high - low) * scale * 1.2
    return free, held


PLANE = {**SINGLE, "side by side": side_by_side}
