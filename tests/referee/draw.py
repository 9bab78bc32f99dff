"""The seeded draw of a case: shape, densities, joint law and loads."""

import itertools

import numpy as np

from .assemblies import GRAVITY, Case, Law, Load
from .shapes import PLANE, arch, bond, cuts, on_slab, rectangle, rubble, tower

Array = np.ndarray


def area_centroid(outline: Array) -> tuple[float, Array]:
    """Area and centroid of a counter-clockwise polygon, about its first corner so that a far place costs no digits."""
    r = outline - outline[0]
    cross = r[:-1, 0] * r[1:, 1] - r[1:, 0] * r[:-1, 1]
    area = 0.5 * cross.sum()
    return float(area), outline[0] + (cross[:, None] * (r[:-1] + r[1:])).sum(axis=0) / (6 * area)


def plane_case(seed: int, number: int, shape: str | None = None) -> Case:
    """Case ``number`` of the plane series ``seed``."""
    random = np.random.default_rng([seed, number, 2])
    shape = shape or list(PLANE)[number % len(PLANE)]
    free, held = PLANE[shape](random)
    unit = 10 ** random.uniform(-2, 2)
    outlines = tuple(unit * o for o in (*held, *free))
    thickness = unit * 10 ** random.uniform(-0.7, 0.3)
    density, dense = _densities(random, len(outlines))
    fixed = frozenset(range(len(held)))
    height = np.ptp(np.vstack(outlines)[:, 1])
    law, kind = _law(random, _typical(density) * GRAVITY * height, crushing=True)
    case = Case((seed, number), outlines, ((0.0, float(thickness)),) * len(outlines), density, fixed, law, (), True)
    loads, pushed = _loads(random, case)
    tags = {"shape": shape, "law": kind, "loads": pushed, "densities": dense}
    return _with(case, loads, tags)


def space_case(seed: int, number: int, shape: str | None = None, dry: bool = True) -> Case:
    """Case ``number`` of the series in space; ``dry`` leaves out cohesion and tension."""
    random = np.random.default_rng([seed, number, 3])
    shape = shape or list(SPACE)[number % len(SPACE)]
    free, held = SPACE[shape](random)
    unit = 10 ** random.uniform(-2, 2)
    blocks = [*held, *free]
    outlines = tuple(unit * o for o, _ in blocks)
    depth = tuple((unit * y0, unit * y1) for _, (y0, y1) in blocks)
    density, dense = _densities(random, len(blocks))
    height = np.ptp(np.vstack(outlines)[:, 1])
    law, kind = Law(_friction(random)), "dry"
    if not dry:
        stress = _typical(density) * GRAVITY * height
        law, kind = Law(law.mu, stress * 10 ** random.uniform(-1, 1), stress * 10 ** random.uniform(-1, 1)), "cohesive"
    fixed = frozenset(range(len(held)))
    case = Case((seed, number), outlines, depth, density, fixed, law, (), False)
    loads, pushed = _loads(random, case)
    return _with(case, loads, {"shape": shape, "law": kind, "loads": pushed, "densities": dense})


def _with(case: Case, loads: tuple[Load, ...], tags: dict[str, str]) -> Case:
    return Case(case.seed, case.outlines, case.depth, case.density, case.fixed, case.law, loads, case.plane, tags)


def twisted_case(seed: int, number: int) -> Case:
    """One or two cohesive boxes turned about the vertical by two opposite forces, perhaps pushed sideways as well."""
    random = np.random.default_rng([seed, number, 4])
    size = random.uniform(0.5, 1.5, 2)
    free, z = [], 0.0
    for _ in range(int(random.integers(1, 3))):
        height = random.uniform(0.1, 0.4)
        free.append(_box((0.0, size[0]), (0.0, size[1]), (z, z + height)))
        z += height
    free, held = _slab(free)
    blocks = [*held, *free]
    stress = 2000.0 * GRAVITY * z
    law = Law(random.uniform(0.2, 0.8), stress * 10 ** random.uniform(-0.5, 1), stress * 10 ** random.uniform(0, 1))
    force = np.array([0.0, stress * size.prod(), 0.0])
    top = len(blocks) - 1
    loads = [
        Load("point", tuple(force), "live", top, (size[0], size[1] / 2, z)),
        Load("point", tuple(-force), "live", top, (0.0, size[1] / 2, z)),
    ]
    if random.random() < 0.5:
        loads.append(Load("body", (random.uniform(-1, 1), random.uniform(-1, 1), 0.0)))
    return Case(
        (seed, number), tuple(o for o, _ in blocks), tuple(d for _, d in blocks), (2000.0,) * len(blocks),
        frozenset([0]), law, tuple(loads), False, {"shape": "twisted", "law": "cohesive"},
    )


# ---- densities, law, loads ------------------------------------------------------------------------------------------


def _densities(random, n: int) -> tuple[tuple[float, ...], str]:
    typical = 10 ** random.uniform(1, 4)
    pick = random.random()
    if pick < 0.25:
        return tuple(typical * 10 ** random.uniform(-2.5, 2.5, n)), "over 1e5"
    if pick < 0.35:
        kept = random.choice([0.0, 1.0], n, p=[0.3, 0.7])
        kept[-1] = 1.0  # at least one block gives the body forces something to act on
        return tuple(typical * kept), "some weightless"
    return (typical,) * n, "equal"


def _typical(density: tuple[float, ...]) -> float:
    """Median density of the blocks that have weight [kg/m3]."""
    heavy = [d for d in density if d > 0]
    return float(np.median(heavy)) if heavy else 1000.0


def _friction(random) -> float:
    pick = random.random()
    if pick < 0.8:
        return random.uniform(0.2, 1.2)
    return 10 ** random.uniform(0.0, 3.0) if pick < 0.92 else random.uniform(0.01, 0.2)


def _law(random, stress: float, *, crushing: bool) -> tuple[Law, str]:
    mu, pick = _friction(random), random.random()
    if pick < 0.6:
        return Law(mu), "dry"
    cohesion, tension = stress * 10 ** random.uniform(-2, 1, 2)
    if pick < 0.8 or not crushing:
        return Law(mu, cohesion, tension if random.random() < 0.7 else 0.0), "cohesive"
    strength = stress * 10 ** random.uniform(0.3, 2)
    if pick < 0.9:
        return Law(mu, crushing=strength), "crushing"
    return Law(mu, cohesion, tension, strength), "cohesive and crushing"


def _loads(random, case: Case) -> tuple[tuple[Load, ...], str]:
    def direction() -> tuple[float, float, float]:
        v = random.normal(size=3)
        if case.plane:
            v[1] = 0.0
        return tuple(v / np.linalg.norm(v))

    def patch(kind: str, when: str) -> Load:
        i = int(random.choice(case.free))
        outline, (y0, y1) = case.outlines[i], case.depth[i]
        weight = max(case.density[i], 10.0) * GRAVITY * area_centroid(outline)[0] * (y1 - y0)
        weight *= 10 ** random.uniform(-0.5, 1.0)
        k = int(random.integers(len(outline)))
        a, b = outline[k], outline[(k + 1) % len(outline)]
        if kind == "point":
            x, z = a + random.random() * (b - a)
            y = 0.5 * (y0 + y1) if case.plane else random.uniform(y0, y1)
            force = weight * np.array(direction())
            return Load("point", tuple(force), when, i, (x, y, z))
        edge = (b - a) / np.linalg.norm(b - a)
        area = np.linalg.norm(b - a) * (y1 - y0)
        outward = (edge[1], 0.0, -edge[0])
        return Load("pressure", outward, when, i, size=weight / area)

    pick = random.random()
    if pick < 0.35:
        v = direction()
        level = np.array([v[0], v[1], 0.0])
        live, name = Load("body", tuple(level / np.linalg.norm(level))), "horizontal"
    elif pick < 0.55:
        live, name = Load("body", direction()), "inclined"
    elif pick < 0.8:
        live, name = patch("point", "live"), "point"
    else:
        live, name = patch("pressure", "live"), "pressure"
    loads = [live]
    if random.random() < 0.25:
        loads.append(patch(random.choice(["point", "pressure"]), "dead"))
        name += " and dead"
    return tuple(loads), name


# ---- shapes in space: (outline in x-z, (y0, y1)) --------------------------------------------------------------------


def _box(x, y, z):
    return rectangle(*x, *z), (float(y[0]), float(y[1]))


def _slab(free):
    points = np.vstack([o for o, _ in free])
    y0, y1 = min(d[0] for _, d in free), max(d[1] for _, d in free)
    _, (base,) = on_slab([points])
    m = 0.2 * (y1 - y0)
    return free, [(base, (y0 - m, y1 + m))]


def _tower_in_space(random, offsets=0.25):
    free, low, size, z = [], np.zeros(2), random.uniform(0.5, 1.0, 2), 0.0
    for _ in range(int(random.integers(1, 5))):
        height = random.uniform(0.2, 1.0)
        free.append(_box((low[0], low[0] + size[0]), (low[1], low[1] + size[1]), (z, z + height)))
        new = size * random.uniform(0.6, 1.2, 2)
        low = low + 0.5 * (size - new) + random.uniform(-offsets, offsets, 2) * size
        size, z = new, z + height
    return _slab(free)


def _overhang_in_space(random):
    return _tower_in_space(random, 0.5)


def _wall_in_space(random):
    free, width, depth = [], random.uniform(0.8, 1.6), random.uniform(0.2, 0.6)
    for z0, z1 in itertools.pairwise(cuts(random, random.uniform(0.5, 1.5), int(random.integers(2, 4)))):
        across = random.random() < 0.5
        for a, b in itertools.pairwise(cuts(random, width, int(random.integers(1, 4)))):
            rows = cuts(random, depth, 2 if across else 1)
            free += [_box((a, b), (c, d), (z0, z1)) for c, d in itertools.pairwise(rows)]
    return _slab(free)


def _corner_in_space(random):
    t, long = random.uniform(0.2, 0.4), random.uniform(0.7, 1.2)
    free = []
    for k in range(int(random.integers(2, 4))):
        z = (0.3 * k, 0.3 * (k + 1))
        cut = random.uniform(t * 1.2, long * 0.9)
        if k % 2:
            free += [_box((0.0, cut), (0.0, t), z), _box((cut, long), (0.0, t), z), _box((0.0, t), (t, long), z)]
        else:
            free += [_box((t, long), (0.0, t), z), _box((0.0, t), (0.0, cut), z), _box((0.0, t), (cut, long), z)]
    return _slab(free)


def _vault(random):
    ring, held = arch(random)
    width = random.uniform(0.4, 1.2)
    free = []
    for k, outline in enumerate(ring[:7]):
        rows = cuts(random, width, 2 if (k % 2 or random.random() < 0.4) else 1)
        free += [(outline, (float(a), float(b))) for a, b in itertools.pairwise(rows)]
    if len(ring) > 7:
        free += [(outline, (0.0, width)) for outline in ring[7:]]
    return free, [(o, (0.0, width)) for o in held]


def _rubble_in_space(random):
    cells, held = rubble(random)
    depth = random.uniform(0.2, 0.8)
    return [(o, (0.0, depth)) for o in cells], [(o, (-0.1, depth + 0.1)) for o in held]


def _two_leaves(random):
    """Two plane walls back to back, one bonded otherwise than the other: joints cross in plan."""
    free, depth = [], random.uniform(0.2, 0.5)
    for k, make in enumerate((bond, tower)):
        cells, _ = make(random)
        free += [(o, (k * depth, (k + 1) * depth)) for o in cells]
    return _slab(free)


def _small_on_giant_in_space(random):
    free = [_box((0.0, 1.0), (0.0, random.uniform(0.5, 1.5)), (0.0, random.uniform(0.3, 1.0)))]
    top, scale = free[0][0][2, 1], 10 ** random.uniform(-4, -1)
    small, _ = _tower_in_space(random)
    return _slab(free + [(o * scale + [0.4, top], (0.2 + a * scale, 0.2 + b * scale)) for o, (a, b) in small])


def _beside_in_space(random):
    free, held, x = [], [], 0.0
    for _ in range(2):
        name = random.choice(["tower", "wall", "vault", "overhang"])
        part, base = SPACE[name](random)
        scale = 10 ** random.uniform(-4, 0)
        every = np.vstack([o for o, _ in part + base])
        move = np.array([x - every[:, 0].min() * scale, 0.0])
        free += [(o * scale + move, (a * scale, b * scale)) for o, (a, b) in part]
        held += [(o * scale + move, (a * scale, b * scale)) for o, (a, b) in base]
        x += np.ptp(every[:, 0]) * scale * 1.2
    return free, held


SPACE = {
    "tower": _tower_in_space, "overhang": _overhang_in_space, "wall": _wall_in_space, "corner": _corner_in_space,
    "vault": _vault, "rubble": _rubble_in_space, "two leaves": _two_leaves,
    "small on giant": _small_on_giant_in_space, "side by side": _beside_in_space,
}
