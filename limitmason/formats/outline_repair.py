"""Traced outlines made to meet: gaps closed, doubled stones dropped, and every change told. Needs shapely.

``rings`` are outlines x, z [m], shape (n, 2) each, and ``gap`` the distance up to which they are meant to meet [m];
``shapely`` is the module, passed on as it is optional.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import not_negative, numbers, positive
from limitmason.errors import InputError
from limitmason.formats.mortar import grown
from limitmason.storage.files import needed

SAME = 0.95
"""Two outlines whose common area is this share of the larger one are one stone, drawn twice."""

SHOWN = 10
"""So many moved stones are named in the text; ``changes`` has all."""

_ROUNDS = 400  # half steps, chosen; the last one is whole


class Change(NamedTuple):
    """What was done to an outline: its name, what, and by how much at most [m]."""

    name: str
    what: str
    size: float


class Cleaned(NamedTuple):
    """Outlines that meet, and the record of what was changed.

    ``outlines`` [m], shape (n, 2) each, with their ``names``; ``changes`` in the order of the outlines, nothing else
    was moved; ``alone`` names the stones that touch no other; ``overlaps`` pairs that still lie in each other, with
    their common area [m2]; ``mortar`` is the thickness of the joints that were closed [m], ``gap`` what counted as an
    error of drawing [m]: the ``tolerance`` of ``Assembly.from_polygons`` with which what is left of it touches.
    """

    outlines: list[Array]
    names: list[str]
    changes: tuple[Change, ...]
    alone: tuple[str, ...]
    overlaps: tuple[tuple[str, str, float], ...]
    mortar: float = 0.0
    gap: float = 0.0

    @property
    def largest_move(self) -> float:
        """Largest distance that a corner was moved [m]."""
        return max((c.size for c in self.changes if c.what == "moved"), default=0.0)

    def __str__(self) -> str:
        """What was changed, a line for each stone.

        Of many stones that were moved only the farthest :data:`SHOWN` are listed.
        """
        head = f"{len(self.outlines)} outlines; largest move of a corner {1e3 * self.largest_move:.3g} mm"
        wider = [c.size for c in self.changes if c.what == "grown"]
        if wider:
            head += f"; {len(wider)} grown by up to {1e3 * max(wider):.3g} mm, each over half a mortar joint"
        moved = sorted((c for c in self.changes if c.what == "moved"), key=lambda c: -c.size)
        lines = [f"  {c.name}: {c.what}" for c in self.changes if not c.size]
        lines += [f"  {c.name}: {c.what} by up to {1e3 * c.size:.3g} mm" for c in moved[:SHOWN]]
        if len(moved) > SHOWN:
            lines.append(f"  and {len(moved) - SHOWN} more by up to {1e3 * moved[SHOWN].size:.3g} mm, see changes")
        lines += [f"  {n}: touches no other stone" for n in self.alone]
        lines += [f"  {a} and {b} still overlap by {1e4 * area:.3g} cm2" for a, b, area in self.overlaps]
        return "\n".join([head, *lines])


def clean(
    outlines: Sequence[ArrayLike], gap: float = 0.005, *, mortar: float = 0.0, names: Sequence[str] | None = None
) -> Cleaned:
    """Close the small gaps and overlaps of traced outlines.

    Corners move to corners, then to edges, within ``gap``.

    Corners of different outlines within ``gap`` of each other meet in their middle; a corner that is still within
    ``gap`` of another outline's edge and that edge approach each other. What moves does so by at most ``gap``.

    Parameters
    ----------
    outlines : closed polygons x, z [m], shape (n, 2) each
    gap : largest distance that counts as an error of drawing [m]
    mortar : largest thickness of the mortar joints, drawn as open space between the stones [m]: every stone takes what
        of it is nearer to it than to another, which also parts stones that overlap, and keeps its free sides; corners
        do not move then. Joints of up to the thickness and twice the gap are closed
    names : of the outlines; "stone 1" ... where omitted

    Returns
    -------
    Cleaned
        With every change; nothing is moved that it does not name.

    Raises
    ------
    ImportError
        When shapely is not installed; the message says how to install it.
    InputError
        Naming the outline: fewer than three corners, an outline that crosses itself, or one no larger than the gap.

    Notes
    -----
    Stones grow as in :mod:`limitmason.formats.mortar`: they fill joints and notches, not openings or the space beside
    the wall, and keep their total area. The thickness stays in ``Cleaned.mortar`` for the stiffness of the
    joints, k = E_m / thickness and the like (:mod:`limitmason.mechanics.stiffness_from_moduli`). The weight of the
    mortar is counted at the density of the stones.
    """
    not_negative("mortar [m]", mortar)
    positive("gap", gap, "m")
    if isinstance(outlines, str) or not len(outlines):
        raise InputError("outlines: give at least one closed polygon x, z [m]")
    labels = [f"stone {i}" for i in range(1, len(outlines) + 1)] if names is None else list(names)
    if len(labels) != len(outlines):
        raise InputError(f"there are {len(outlines)} outlines and {len(labels)} names")
    shapely = need_shapely()
    rings = [_checked(o, n, gap, shapely) for o, n in zip(outlines, labels, strict=True)]
    kept, twice = _once(rings, labels, shapely)
    rings, labels = [rings[i] for i in kept], [labels[i] for i in kept]
    changes = [Change(n, f"dropped: the same as {o}", 0.0) for n, o in twice]
    if mortar > 0.0:
        cells = [_straight(_merged(c, 1e-6 * mortar)) for c in grown(rings, labels, mortar, gap, shapely)]
        for name, cell, ring in zip(labels, cells, rings, strict=True):
            by = float(shapely.distance(shapely.points(cell), shapely.Polygon(ring)).max())
            changes += [Change(name, "grown", by)] * (by > 1e-6 * mortar)
        rings = cells
    start = [r.copy() for r in rings]
    if mortar == 0.0:
        _meet_corners(rings, gap)
        _meet_edges(rings, start, gap, shapely)
    out = []
    for ring, before, name in zip(rings, start, labels, strict=True):
        move = float(np.linalg.norm(ring - before, axis=1).max(initial=0.0))
        if move > 1e-9:  # a nanometre is rounding
            changes.append(Change(name, "moved", move))
        merged = _merged(ring, 1e-6 * gap)
        if len(merged) < 3 or not shapely.Polygon(merged).is_valid:
            raise InputError(f"{name}: closing gaps of {gap:g} m leaves no outline of it; give a smaller gap")
        out.append(merged)
    alone, overlaps = _contacts(out, labels, gap, shapely)
    return Cleaned(out, labels, tuple(changes), alone, overlaps, mortar, gap)


def need_shapely() -> Any:
    """The library, or an error that says how to install it."""
    return needed("shapely", "traced drawings", "dxf")


def _checked(outline: ArrayLike, name: str, gap: float, shapely: Any) -> Array:
    """An outline counter-clockwise, without a repeated first corner or corners in one place [m], shape (n, 2)."""
    ring = numbers(name, outline)
    if ring.ndim != 2 or ring.shape[1] != 2 or not np.isfinite(ring).all():
        raise InputError(f"{name}: an outline has finite corners x, z, shape (n, 2), got shape {ring.shape}")
    if len(ring) > 1 and np.allclose(ring[0], ring[-1], rtol=0.0, atol=1e-12):
        ring = ring[:-1]
    ring = _merged(ring, 1e-9 * max(float(np.ptp(ring, axis=0).max(initial=0.0)), 1e-300))
    if len(ring) < 3:
        raise InputError(f"{name}: an outline needs three corners, got {len(ring)}")
    if np.ptp(ring, axis=0).min() <= gap:
        raise InputError(f"{name} is no wider than the gap of {gap:g} m; give a smaller one, or leave it out")
    polygon = shapely.Polygon(ring)
    if not polygon.is_valid:
        raise InputError(f"{name}: {shapely.is_valid_reason(polygon)}; draw it without crossing itself")
    return np.array(shapely.geometry.polygon.orient(polygon).exterior.coords[:-1])


def _merged(ring: Array, least: float) -> Array:
    """Corners that are farther apart than a length."""
    far = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1) > least
    return ring[far]


def _once(rings: list[Array], names: list[str], shapely: Any) -> tuple[list[int], list[tuple[str, str]]]:
    """Numbers of the outlines without those that repeat an earlier one, and which those repeat."""
    polygons = [shapely.Polygon(r) for r in rings]
    tree = shapely.STRtree(polygons)
    dropped: dict[int, int] = {}
    for i, j in sorted((int(min(p)), int(max(p))) for p in tree.query(polygons, predicate="intersects").T):
        if i < j and i not in dropped and j not in dropped:
            common = polygons[i].intersection(polygons[j]).area
            if common > SAME * max(polygons[i].area, polygons[j].area):
                dropped[j] = i
    return [i for i in range(len(rings)) if i not in dropped], [(names[j], names[i]) for j, i in dropped.items()]


def _meet_corners(rings: list[Array], gap: float) -> None:
    """Corners of different outlines within the gap of each other go to their mean, nearest pairs first."""
    from scipy.spatial import cKDTree

    corners = np.concatenate(rings)
    owner = np.repeat(np.arange(len(rings)), [len(r) for r in rings])
    pairs = cKDTree(corners).query_pairs(gap, output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    length = np.linalg.norm(corners[pairs[:, 0]] - corners[pairs[:, 1]], axis=1)
    group = np.arange(len(corners))
    members = {k: [k] for k in range(len(corners))}
    for k in np.lexsort((pairs[:, 1], pairs[:, 0], np.round(length, 12))) if len(pairs) else ():
        a, b = group[pairs[k, 0]], group[pairs[k, 1]]
        if a == b:
            continue
        both = members[a] + members[b]
        # a chain of corners must not walk: all stay within the gap of their mean; an outline keeps its corners apart
        middle = corners[both].mean(axis=0)
        if len(set(owner[both])) < len(both) or np.linalg.norm(corners[both] - middle, axis=1).max() > gap:
            continue
        group[members[b]] = a
        members[a] = both
        del members[b]
    target = corners.copy()
    for both in members.values():
        target[both] = corners[both].mean(axis=0)
    first = 0
    for ring in rings:
        ring[:] = target[first : first + len(ring)]
        first += len(ring)


def _meet_edges(rings: list[Array], start: list[Array], gap: float, shapely: Any) -> None:
    """Corners near another outline's edge and that edge's corners approach each other by halves.

    Halves make the result independent of the order of the outlines; the last pass only takes up what is left of them.

    Parameters
    ----------
    start : outlines as they were drawn, from which corners stay within the gap
    """
    at, from_ = np.concatenate(rings), np.concatenate(start)
    count = [len(r) for r in rings]
    owner = np.repeat(np.arange(len(rings)), count)
    # first corner of each corner's outline, and the corner after it
    first = np.repeat(np.cumsum(count) - count, count)
    after = first + (np.arange(len(at)) - first + 1) % np.repeat(count, count)
    edges = shapely.linestrings(np.stack([at, at[after]], axis=1))
    corner, edge = shapely.STRtree(edges).query(shapely.points(at), predicate="dwithin", distance=3.0 * gap)
    kept = owner[corner] != owner[edge]
    corner, edge = corner[kept], edge[kept]
    if not len(corner):  # every outline stands alone
        return
    for share in [0.5] * _ROUNDS + [1.0]:
        a = at[edge]
        along = at[after[edge]] - a
        where = np.einsum("ij,ij->i", at[corner] - a, along) / np.einsum("ij,ij->i", along, along)
        move = a + np.clip(where, 0.0, 1.0)[:, None] * along - at[corner]
        far = np.linalg.norm(move, axis=1)
        # of each other outline the nearest edge, and of these the farthest one
        nearest = np.lexsort((far, owner[edge], corner))
        rows = nearest[np.r_[True, (np.diff(corner[nearest]) != 0) | (np.diff(owner[edge][nearest]) != 0)]]
        # no corner goes farther than the gap from where it was drawn
        free = np.linalg.norm(at[corner] + share * move - from_[corner], axis=1) <= gap
        rows = rows[(far[rows] <= gap) & free[rows]]
        # of every corner the farthest move counts, which comes last
        rows = rows[np.lexsort((far[rows], corner[rows]))]
        rows = rows[np.r_[corner[rows][1:] != corner[rows][:-1], True]] if len(rows) else rows
        at[corner[rows]] += share * move[rows]
        if share < 1.0 and far[rows].max(initial=0.0) < 1e-9 * gap:
            break
    for k, ring in enumerate(rings):
        ring[:] = at[owner == k]


def _contacts(
    rings: list[Array], names: list[str], gap: float, shapely: Any
) -> tuple[tuple[str, ...], tuple[tuple[str, str, float], ...]]:
    """Stones that touch no other, and pairs that lie in each other.

    Parameters
    ----------
    names : of the stones
    """
    polygons = [shapely.Polygon(r) for r in rings]
    tree = shapely.STRtree(polygons)
    touches = np.zeros(len(rings), dtype=bool)
    overlaps = []
    for i, j in tree.query(polygons, predicate="dwithin", distance=1e-3 * gap).T:
        if i == j:
            continue
        touches[i] = True
        area = polygons[i].intersection(polygons[j]).area if i < j else 0.0
        if area > 0.1 * gap * np.sqrt(min(polygons[i].area, polygons[j].area)):
            overlaps.append((names[i], names[j], float(area)))
    return tuple(n for n, t in zip(names, touches, strict=True) if not t), tuple(overlaps)


def loops(lines: Sequence[ArrayLike], gap: float) -> tuple[list[Array], list[int]]:
    """Outlines that single lines enclose together, and the numbers of the lines that enclose nothing.

    Parameters
    ----------
    lines : open polylines x, z [m], shape (n, 2) each
    gap : distance up to which ends of lines meet [m]; what they enclose is no outline where it is no wider on average
        (2 area / perimeter), but a gap between the lines of two stones
    """
    shapely = need_shapely()
    strokes = [np.array(line, dtype=float) for line in lines]  # copies: their ends are moved
    ends = np.array([p for s in strokes for p in (s[0], s[-1])]).reshape(-1, 2)
    for k, p in enumerate(ends):
        close = np.flatnonzero(np.linalg.norm(ends[:k] - p, axis=1) <= gap)
        if len(close):
            ends[k] = ends[close[0]]
    for k, stroke in enumerate(strokes):
        stroke[0], stroke[-1] = ends[2 * k], ends[2 * k + 1]
    noded = shapely.union_all([shapely.LineString(s) for s in strokes if len(_merged(s, 1e-12)) > 1])
    enclosed = shapely.get_parts(shapely.polygonize([noded]))
    faces = [np.array(p.exterior.coords[:-1]) for p in enclosed if 2.0 * p.area > gap * p.length]
    edges = shapely.union_all([shapely.LinearRing(f) for f in faces]).buffer(1e-6 * max(gap, 1e-9)) if faces else None
    # ends touch other lines anyhow: the middle tells whether a line is an edge of what is enclosed
    middles = [shapely.LineString(s).interpolate(0.5, normalized=True) for s in strokes]
    unused = [k for k, middle in enumerate(middles) if edges is None or not edges.intersects(middle)]
    return [_straight(f) for f in faces], unused


def _straight(ring: Array) -> Array:
    """An outline ``ring`` without the corners at which a side only meets other lines."""
    before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
    a, b = ring - before, after - ring
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return ring[np.abs(cross) > 1e-9 * np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)]
