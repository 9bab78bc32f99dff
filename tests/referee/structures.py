"""One generator of random structures for every engine: at most 12 blocks, with ties, cohesion, crushing, cracked units.

The shapes are those of ``draw``; here they get stiffness, a material, ties, a crack through a unit and a support, or a
group of them, that settles.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .assemblies import GRAVITY, Case, Law, Load
from .draw import SPACE, area_centroid, plane_case, space_case
from .model import Model, Pull
from .shapes import PLANE, on_slab, rectangle

Array = np.ndarray

MOST = 12
"""Blocks of a structure, with those that are held."""

SPACE_EVERY = 3
"""One structure in this many is in space."""

CALM = ("columns", "rubble", "bond", "arch", "opening", "tower", "leaning", "wall", "corner", "vault",
        "two leaves")
"""Shapes without sizes that lie decades apart."""


def structure(seed: int, number: int, *, fit: Callable[[Model], bool] = lambda model: True, **options) -> Model:
    """Structure ``number`` of a series, drawn until it is fit; options as in :func:`_drawn`."""
    random = np.random.default_rng([seed, number, 5])
    while not fit(model := _drawn(seed, number, random, **options)):
        pass
    return model


def _drawn(
    seed: int, number: int, random, *, wild: bool = False, most: int = MOST, plain: float = 0.5, ties: bool = True,
    split: bool = False, together: bool = False, crushing: bool = True, apex: bool = True, bonds: str = "",
) -> Model:
    """One structure.

    Parameters
    ----------
    wild : sizes and densities decades apart, frictions up to 1000, loads decades beside the weight
    most : blocks
    plain : share of structures without ties, and without cracks
    ties, crushing : False for none
    apex : tension beyond that of the apex of the cone, which the DEM takes and the others do not
    split : cut a slab that holds all into supports with gaps between them
    together : a group of supports settles as one, instead of a single one
    bonds : "brittle" or "softening": joints lose c and ft at once, or over an energy; "held": ft without cohesion
    """
    while True:
        k = int(random.integers(1 << 30))
        case = _case(seed, number, k, random)
        if split and len(case.fixed) == 1:
            case = _on_supports(case, random)
        if len(case.outlines) <= most and (wild or case.tags["shape"] in CALM):
            break
    if not wild:
        case = _calm(case, random)
    law = case.law
    law = replace(law, crushing=law.crushing if crushing else np.inf, tension=law.tension if apex else law.cut_off)
    case = replace(case, law=_bonded(case, law, bonds, random) if bonds else law)
    laws: dict[tuple[int, int], Law] = {}
    tags = dict(case.tags, number=number, draw=k) | ({"law": bonds} if bonds else {})
    if random.random() > plain and len(case.outlines) < most:
        case, laws = _cracked(case, random)
        tags["cracked"] = bool(laws)
    height = np.ptp(np.vstack(case.outlines)[:, 1])
    stress = float(np.median([d for d in case.density if d > 0])) * GRAVITY * height
    kn = stress / (height * 10 ** random.uniform(-6, -4))
    model = Model.of(
        replace(case, tags=tags), laws=laws, stiffness=(kn, kn * random.uniform(0.3, 1.0)),
        young=kn * height * 10 ** random.uniform(-1, 1) * (min(case.density) > 0), poisson=random.uniform(0.0, 0.3),
    )
    tied = _ties(case, model, random) if ties and random.random() > plain else ()
    held = sorted(case.fixed)
    group = tuple(held[: max(1, len(held) // 2) if together else 1]) if len(held) > 1 else ()
    return replace(model, ties=tied, group=group, driven=int(random.choice(model.free)))


def _case(seed: int, number: int, k: int, random) -> Case:
    if number % SPACE_EVERY < SPACE_EVERY - 1:
        case = plane_case(seed, k, str(random.choice(list(PLANE))))
        return _columns(case, random) if random.random() < 0.1 else case
    return space_case(seed, k, str(random.choice(list(SPACE))), dry=bool(random.random() < 0.6))


def _calm(case: Case, random) -> Case:
    """Blocks of one density and some ten centimetres, friction 0.3 to 1, strengths a few times the stress by weight."""
    size = random.uniform(0.5, 3.0) / np.ptp(np.vstack(case.outlines), axis=0).max()
    density = random.uniform(1600.0, 2600.0)
    old = float(np.median([d for d in case.density if d > 0] or [1000.0]))
    force, stress = size**3 * density / old, size * density / old
    loads = tuple(
        f if f.kind == "body"
        else replace(f, vector=tuple(force * np.array(f.vector)), at=tuple(size * np.array(f.at))) if f.kind == "point"
        else replace(f, size=f.size * stress)
        for f in case.loads
    )
    law = case.law
    law = Law(random.uniform(0.3, 1.0), law.cohesion * stress, law.tension * stress, law.crushing * stress)
    return replace(
        case, outlines=tuple(size * o for o in case.outlines),
        depth=tuple((size * y0, size * y1) for y0, y1 in case.depth), density=(density,) * len(case.density), law=law,
        loads=loads,
    )


def _bonded(case: Case, law: Law, bonds: str, random) -> Law:
    """The law with a bond of a part of the stress by weight, or some times it; one in five has ft beyond the apex."""
    height = np.ptp(np.vstack(case.outlines)[:, 1])
    stress = float(np.median(case.density)) * GRAVITY * height * 10 ** random.uniform(-1.5, 0.5)
    if bonds == "held":
        return replace(law, cohesion=0.0, tension=stress)
    lost = 0.0 if bonds == "brittle" else 10 ** random.uniform(0.3, 2.5)
    beyond = random.uniform(1.0, 4.0) if random.random() < 0.2 else random.uniform(0.1, 1.0)
    return replace(law, cohesion=stress, tension=beyond * stress / law.mu, lost=lost)


def _columns(case: Case, random) -> Case:
    """Two to six equal columns on one slab: every mode is repeated."""
    n, courses = [(2, 5), (3, 3), (4, 2), (5, 2), (6, 1)][int(random.integers(5))]
    width, high = random.uniform(0.2, 0.5), random.uniform(0.2, 0.6)
    free = [rectangle(x, x + width, z * high, (z + 1) * high) for x in range(n) for z in range(courses)]
    free, held = on_slab(free)
    loads = tuple(f for f in case.loads if f.kind == "body")
    return replace(
        case, outlines=(*held, *free), depth=((0.0, width),) * (1 + len(free)), density=(2000.0,) * (1 + len(free)),
        fixed=frozenset([0]), loads=loads or (Load("body", (1.0, 0.0, 0.0)),), tags=case.tags | {"shape": "columns"},
    )


def _on_supports(case: Case, random) -> Case:
    """The one slab below all cut into two to four supports, a little apart."""
    (k,) = case.fixed
    slab, n = case.outlines[k], int(random.integers(2, 5))
    ends = np.linspace(slab[0], slab[1], n + 1), np.linspace(slab[3], slab[2], n + 1)
    pieces = []
    for i in range(n):
        gap = 0.02 * (ends[0][i + 1] - ends[0][i])
        pieces.append(np.array([ends[0][i] + gap, ends[0][i + 1] - gap, ends[1][i + 1] - gap, ends[1][i] + gap]))
    rest = [i for i in range(len(case.outlines)) if i != k]
    new = {old: n + j for j, old in enumerate(rest)}
    return replace(
        case, outlines=(*pieces, *(case.outlines[i] for i in rest)), fixed=frozenset(range(n)),
        depth=(*[case.depth[k]] * n, *(case.depth[i] for i in rest)),
        density=(*[case.density[k]] * n, *(case.density[i] for i in rest)),
        loads=tuple(replace(f, block=new.get(f.block, -1)) for f in case.loads),
    )


def _cracked(case: Case, random) -> tuple[Case, dict[tuple[int, int], Law]]:
    """A unit in two along a line through its centroid, held together by a crack of ten times the strength of joints."""
    loaded = {f.block for f in case.loads}
    whole = [i for i in case.free if i not in loaded]
    if not whole:
        return case, {}
    i = int(random.choice(whole))
    outline = case.outlines[i]
    area, centre = area_centroid(outline)
    angle = random.uniform(0.0, np.pi)
    normal = np.array([np.cos(angle), np.sin(angle)])
    halves = [_half(outline, centre, sign * normal) for sign in (1.0, -1.0)]
    if min(area_centroid(h)[0] for h in halves) < 0.1 * area or min(_shortest(h) for h in halves) < 0.05 * area**0.5:
        return case, {}
    y0, y1 = case.depth[i]
    stress = 1e4 * GRAVITY * area / max(y1 - y0, area**0.5) + 10 * max(case.law.cohesion, case.law.tension)
    n = len(case.outlines)
    cracked = replace(
        case, outlines=(*case.outlines[:i], halves[0], *case.outlines[i + 1 :], halves[1]),
        depth=(*case.depth, case.depth[i]), density=(*case.density, case.density[i]),
    )
    return cracked, {(i, n): Law(0.6, stress, 0.5 * stress, case.law.crushing)}


def _half(outline: Array, centre: Array, normal: Array) -> Array:
    """The part of a convex outline on the side to which the normal points."""
    depth = (outline - centre) @ normal
    out = []
    for p, q, d, e in zip(outline, np.roll(outline, -1, axis=0), depth, np.roll(depth, -1), strict=True):
        if d >= 0:
            out.append(p)
        if d * e < 0:
            out.append(p + (q - p) * d / (d - e))
    return np.array(out)


def _shortest(outline: Array) -> float:
    return float(np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1).min())


def _ties(case: Case, model: Model, random) -> tuple[Pull, ...]:
    """One tie between two free blocks, or from one to the ground, in the middle plane of a plane structure."""
    free = model.free
    a = int(random.choice(free))
    others = [i for i in free if i != a]
    b = int(random.choice(others)) if others and random.random() < 0.6 else -1
    ends = []
    for i in (a, b):
        if i < 0:
            ends.append(ends[0] + model.length * np.array([random.uniform(-1, 1), 0.0, random.uniform(-1, 0.2)]))
        else:
            x, z = area_centroid(case.outlines[i])[1]
            ends.append(np.array([x, np.mean(case.depth[i]), z]))
    strength = model.weight / len(free) * 10 ** random.uniform(-1, 0.5)
    return (Pull(a, ends[0], b, ends[1], strength, strength / (1e-4 * model.length)),)
