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
from limitmason.formats.drawn_mortar import grown
from limitmason.model.input import read_list
from limitmason.storage.files import needed

SAME = 0.95
"""Two outlines whose common area is this share of the larger one are one stone, drawn twice."""

SHOWN = 10
"""So many moved stones are named in the text; ``changes`` has all."""

_ROUNDS = 400  # half steps, chosen; the last one is whole

_ROUNDING = 1e-6
"""Lengths, over the gap or the mortar, that count as rounding; chosen."""

_MOVED = 1e-9
"""Move of a corner that is told [m]: a nanometre is rounding."""

_TOUCH = 1e-3
"""Distance over the gap up to which closed stones touch; chosen."""

_OVERLAP = 0.1
"""Common area, over the gap times the side of the smaller stone, from which on two stones overlap; chosen."""

_STRAIGHT = 1e-9
"""Sine of the angle between two sides below which they are one; chosen, above rounding."""


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
    Stones grow as in :mod:`limitmason.formats.drawn_mortar`: they fill joints and notches, not openings or the space
    beside the wall, and keep their total area. The thickness stays in ``Cleaned.mortar`` for the stiffness of the
    joints, k = E_m / thickness and the like (:mod:`limitmason.mechanics.stiffness_from_moduli`). The weight of the
    mortar is counted at the density of the stones.
    """
    not_negative("mortar [m]", mortar)
    positive("gap", gap, "m")
    outlines = read_list("outlines", outlines)
    if not outlines:
        raise InputError("outlines: give at least one closed polygon x, z [m]")
    labels = [f"stone {i}" for i in range(1, len(outlines) + 1)] if names is None else list(names)
    if len(labels) != len(outlines):
        raise InputError(f"there are {len(outlines)} outlines and {len(labels)} names")
    shapely = need_shapely()
    rings = [_checked(o, n, gap, shapely) for o, n in zip(outlines, labels, strict=True)]
    repeats = _repeats(rings, shapely)
    changes = [Change(labels[j], f"dropped: the same as {labels[i]}", size=0.0) for j, i in repeats.items()]
    kept = [i for i in range(len(rings)) if i not in repeats]
    rings, labels = [rings[i] for i in kept], [labels[i] for i in kept]
    if mortar > 0.0:
        cells = [_straight(_merged(c, _ROUNDING * mortar)) for c in grown(rings, labels, mortar, gap, shapely)]
        for name, cell, ring in zip(labels, cells, rings, strict=True):
            by = float(shapely.distance(shapely.points(cell), shapely.Polygon(ring)).max())
            if by > _ROUNDING * mortar:
                changes.append(Change(name, "grown", by))
        rings = cells
    start = [r.copy() for r in rings]
    if mortar == 0.0:
        _meet_corners(rings, gap)
        _meet_edges(rings, start, gap, shapely)
    out = []
    for ring, before, name in zip(rings, start, labels, strict=True):
        move = float(np.linalg.norm(ring - before, axis=1).max(initial=0.0))
        if move > _MOVED:
            changes.append(Change(name, "moved", move))
        # corners that met are one now, and a thin stone may be gone
        merged = _merged(ring, _ROUNDING * gap)
        if len(merged) < 3 or not shapely.Polygon(merged).is_valid:
            raise InputError(f"{name}: closing gaps of {gap:g} m leaves no outline of it; give a smaller gap")
        out.append(merged)
    alone, overlaps = _contacts(out, labels, gap, shapely)
    return Cleaned(out, labels, tuple(changes), alone, overlaps, mortar, gap)


def need_shapely() -> Any:
    """The library, or an error that says how to install it."""
    return needed("shapely", "traced drawings", "dxf")


def _checked(outline: ArrayLike, name: str, gap: float, shapely: Any) -> Array:
    """Corners of an outline counter-clockwise, each once [m], shape (n, 2).

    Parameters
    ----------
    outline : corners x, z as a user gives them [m], in either sense, the first perhaps repeated at the end
    name : of the stone, for errors
    gap : width up to which gaps are closed [m]: a stone no wider than that would vanish
    shapely : the module
    """
    ring = numbers(name, outline)
    if ring.ndim != 2 or ring.shape[1] != 2 or not np.isfinite(ring).all():
        raise InputError(f"{name}: an outline has finite corners x, z, shape (n, 2), got shape {ring.shape}")
    if len(ring) > 1 and np.allclose(ring[0], ring[-1], rtol=0.0, atol=1e-12):
        ring = ring[:-1]
    # corners nearer than rounding of the size are one
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
    """Corners of an outline ``ring`` that are not nearly the one before.

    They are farther from it than the length ``least`` [m].
    """
    far = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1) > least
    return ring[far]


def _repeats(rings: list[Array], shapely: Any) -> dict[int, int]:
    """Numbers of the outlines that repeat an earlier one, with the number of that one.

    ``rings`` are all outlines [m], shape (n, 2) each, and ``shapely`` is the module.
    """
    polygons = [shapely.Polygon(r) for r in rings]
    tree = shapely.STRtree(polygons)
    dropped: dict[int, int] = {}
    for i, j in sorted((int(min(p)), int(max(p))) for p in tree.query(polygons, predicate="intersects").T):
        if i < j and i not in dropped and j not in dropped:
            common = polygons[i].intersection(polygons[j]).area
            least = SAME * max(polygons[i].area, polygons[j].area)
            if common > least and _snapped(polygons[i], polygons[j], shapely) > least:
                dropped[j] = i
    return dropped


def _meet_corners(rings: list[Array], gap: float) -> None:
    """Corners of different outlines within ``gap`` [m] of each other go to their mean.

    Nearest pairs come first. ``rings`` are changed in place [m], shape (n, 2) each.
    """
    from scipy.spatial import cKDTree

    corners = np.concatenate(rings)
    owner = np.repeat(np.arange(len(rings)), [len(r) for r in rings])
    pairs = cKDTree(corners).query_pairs(gap, output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    length = np.linalg.norm(corners[pairs[:, 0]] - corners[pairs[:, 1]], axis=1)
    # corners that meet are a group: its number for every corner, and its corners by that number
    group = np.arange(len(corners))
    members = {k: [k] for k in range(len(corners))}
    # by length; equal ones, to the picometre, by their numbers, so that rounding does not say which comes first
    for k in np.lexsort((pairs[:, 1], pairs[:, 0], np.round(length, 12))):
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
    """Corners go to the edges of other outlines that are within the gap.

    Each round takes half the way. An edge moves as its own corners do. Halves make the result independent of the order
    of the outlines. The last round only takes up what is left of them.

    Parameters
    ----------
    rings : outlines [m], shape (n, 2) each, changed in place
    start : the same outlines as they were drawn, from which corners stay within the gap
    gap : largest distance between a corner and an edge that meet, and largest move of a corner [m]
    shapely : the module
    """
    # corners as they are now and as they were drawn, and by outline what is the same for all its corners
    at, drawn = np.concatenate(rings), np.concatenate(start)
    count = [len(r) for r in rings]
    owner = np.repeat(np.arange(len(rings)), count)
    # first corner of each corner's outline, and the corner after it
    first = np.repeat(np.cumsum(count) - count, count)
    after = first + (np.arange(len(at)) - first + 1) % np.repeat(count, count)
    # pairs of a corner and an edge of another outline; edge k begins at corner k
    edges = shapely.linestrings(np.stack([at, at[after]], axis=1))
    # three gaps: both may come nearer by a gap each, and then lie within one
    corner, edge = shapely.STRtree(edges).query(shapely.points(at), predicate="dwithin", distance=3.0 * gap)
    kept = owner[corner] != owner[edge]
    corner, edge = corner[kept], edge[kept]
    if not len(corner):  # every outline stands alone
        return
    for share in [0.5] * _ROUNDS + [1.0]:
        # of each pair the way from the corner to the nearest point of the edge
        begin = at[edge]
        along = at[after[edge]] - begin
        share_along = np.einsum("ij,ij->i", at[corner] - begin, along) / np.einsum("ij,ij->i", along, along)
        move = begin + np.clip(share_along, 0.0, 1.0)[:, None] * along - at[corner]
        far = np.linalg.norm(move, axis=1)
        # of each corner the nearest edge of each other outline: the first pair of both, sorted by distance
        nearest = np.lexsort((far, owner[edge], corner))
        rows = nearest[np.r_[True, (np.diff(corner[nearest]) != 0) | (np.diff(owner[edge][nearest]) != 0)]]
        # no corner goes farther than the gap from where it was drawn
        free = np.linalg.norm(at[corner] + share * move - drawn[corner], axis=1) <= gap
        rows = rows[(far[rows] <= gap) & free[rows]]
        if not len(rows):
            break
        # of the edges that are left to a corner the farthest counts, which comes last
        rows = rows[np.lexsort((far[rows], corner[rows]))]
        rows = rows[np.r_[corner[rows][1:] != corner[rows][:-1], True]]
        at[corner[rows]] += share * move[rows]
        if share < 1.0 and far[rows].max() < 1e-9 * gap:  # all that meets has met, but for rounding
            break
    for k, ring in enumerate(rings):
        ring[:] = at[owner == k]


def _contacts(
    rings: list[Array], names: list[str], gap: float, shapely: Any
) -> tuple[tuple[str, ...], tuple[tuple[str, str, float], ...]]:
    """Names of stones that touch no other, and pairs that lie in each other.

    A pair has its common area [m2].

    Parameters
    ----------
    rings : outlines that were closed [m], shape (n, 2) each
    names : of the stones
    gap : width up to which gaps were closed [m]
    shapely : the module
    """
    polygons = [shapely.Polygon(r) for r in rings]
    tree = shapely.STRtree(polygons)
    touches = np.zeros(len(rings), dtype=bool)
    overlaps = []
    for i, j in tree.query(polygons, predicate="dwithin", distance=_TOUCH * gap).T:
        if i == j:
            continue
        touches[i] = True
        area = polygons[i].intersection(polygons[j]).area if i < j else 0.0  # each pair once
        least = _OVERLAP * gap * np.sqrt(min(polygons[i].area, polygons[j].area))
        if area > least and _snapped(polygons[i], polygons[j], shapely) > least:
            overlaps.append((names[i], names[j], float(area)))
    return tuple(n for n, t in zip(names, touches, strict=True) if not t), tuple(overlaps)


def _snapped(a: Any, b: Any, shapely: Any) -> float:
    """Common area of two polygons of shapely on a fine grid [m2].

    Without a grid it may come out as all of one, where sides lie in one line but for rounding.
    """
    return float(shapely.intersection(a, b, grid_size=_STRAIGHT * a.length).area)


def loops(lines: Sequence[ArrayLike], gap: float) -> tuple[list[Array], list[int]]:
    """Outlines that single lines enclose together [m], shape (n, 2) each.

    Returned too are the numbers of the lines that enclose nothing. What is no wider than ``gap`` on average (2 area /
    perimeter) is no outline, but the space between the lines of two stones.

    Parameters
    ----------
    lines : open polylines x, z [m], shape (n, 2) each
    gap : distance up to which ends of lines meet [m]
    """
    shapely = need_shapely()
    strokes = [np.array(line, dtype=float) for line in lines]  # copies: their ends are moved
    ends = np.array([p for s in strokes for p in (s[0], s[-1])]).reshape(-1, 2)
    # an end goes to the earliest one within the gap
    for k, end in enumerate(ends):
        close = np.flatnonzero(np.linalg.norm(ends[:k] - end, axis=1) <= gap)
        if len(close):
            ends[k] = ends[close[0]]
    for k, stroke in enumerate(strokes):
        stroke[0], stroke[-1] = ends[2 * k], ends[2 * k + 1]
    # cut where they cross; a line within a picometre is a point and has no length to be cut
    noded = shapely.union_all([shapely.LineString(s) for s in strokes if len(_merged(s, 1e-12)) > 1])
    enclosed = shapely.get_parts(shapely.polygonize([noded]))
    faces = [np.array(p.exterior.coords[:-1]) for p in enclosed if 2.0 * p.area > gap * p.length]
    width = _ROUNDING * max(gap, 1e-9)
    edges = shapely.union_all([shapely.LinearRing(f) for f in faces]).buffer(width) if faces else None
    # ends touch other lines anyhow: the middle tells whether a line is an edge of what is enclosed
    middles = [shapely.LineString(s).interpolate(0.5, normalized=True) for s in strokes]
    unused = [k for k, middle in enumerate(middles) if edges is None or not edges.intersects(middle)]
    return [_straight(f) for f in faces], unused


def _straight(ring: Array) -> Array:
    """An outline ``ring`` without the corners at which a side only meets other lines."""
    before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
    a, b = ring - before, after - ring
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return ring[np.abs(cross) > _STRAIGHT * np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)]
