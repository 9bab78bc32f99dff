"""Contacts between polyhedra: plane patches where two faces of different blocks meet, and blocks that overlap.

The common area of two faces is found in ``facing``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array, Flags, Index
from limitmason.checks import positive
from limitmason.errors import InputError
from limitmason.geometry.closed_part import closed_centres, closed_part
from limitmason.geometry.facing import Faces, FacingPairs, all_faces, facing_pairs, inner_faces
from limitmason.geometry.merged_patches import ContactPatch, merged
from limitmason.geometry.penetration import near_pairs, penetrations
from limitmason.geometry.polygon import centroid_in_space, width_in_space
from limitmason.geometry.polyhedron import Solid

LOOKED_AT_DEG = 45.0
"""Faces further than this from parallel do not face each other; what meets there meets at an edge or a corner [deg]."""

NEAR = 0.02
"""Gap up to which faces that do not touch are near misses, as a fraction of the smaller block's width: chosen [-]."""

_CORNERS_ALIKE = 1e-3
"""Part of the distance that counts as contact within which corners lie on one line [-]: chosen."""

_SAME_PLANE = 1e-3
"""Distance of two parallel common areas up to which they lie in one plane, over their width [-]: chosen."""

_LEAST_WIDTH = 0.01
"""Part of the least width of a contact below which an overlap of two faces is not looked at at all [-]: chosen."""


@dataclass(frozen=True)
class ContactRules:
    """Which faces count as touching.

    Parameters
    ----------
    distance : gap or overlap up to which faces touch [m]; None: a fraction (``RELATIVE_TOLERANCE``) of the width of the
        smaller of the two blocks
    angle_deg : faces that touch and are no further than this from parallel are in contact where the gap is within the
        distance, so two faces that open like a wedge are in contact next to its edge [deg]
    wedge_deg : faces that touch at one end and open by no more than this are in contact over their whole common area
        (while the gap stays below a near miss): the small turn that closes such a joint is drawing error [deg]
    width : contacts narrower than this, 2 area / perimeter, are left out [m]; None: as the distance
    """

    distance: float | None = None
    angle_deg: float = 15.0
    wedge_deg: float = 0.5
    width: float | None = None

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("distance", "width"):
            value = getattr(self, name)
            if value is not None:
                positive(f"contact {name}", value, "m")
        if not 0.0 <= self.wedge_deg <= self.angle_deg <= LOOKED_AT_DEG:
            raise InputError(
                f"contact angles must keep 0 <= wedge ({self.wedge_deg!r}) <= angle ({self.angle_deg!r}) <= "
                f"{LOOKED_AT_DEG:g} degrees"
            )

    def as_options(self) -> dict[str, Any]:
        """The rules as the options of ``Assembly.from_polyhedra``."""
        return {
            "tolerance": self.distance, "angle_tolerance_deg": self.angle_deg, "wedge_tolerance_deg": self.wedge_deg,
            "smallest_contact": self.width,
        }


class DoubtfulContact(NamedTuple):
    """Two faces near each other that are no contact, or one only by a rule a reader should know of.

    Parameters
    ----------
    a, b : blocks, a < b
    kind : of a near miss "apart" (a gap all along), "opens" (touches along an edge only), "turned" (touches, but too
        far from parallel) or "narrow"; of a contact that was made "closed" (opens by a small angle, kept whole) or "in
        part" (kept where the gap is within the distance)
    gap : least and largest over the common area, negative where the blocks overlap [m]
    angle_deg : between the faces [deg]
    area : common to both faces [m2]
    width : 2 area / perimeter [m]
    place : centre of the common area [m], shape (3,)
    normal : from a to b, shape (3,)
    polygons : the common area [m], list of shape (k, 3)
    """

    a: int
    b: int
    kind: str
    gap: tuple[float, float]
    angle_deg: float
    area: float
    width: float
    place: Array
    normal: Array
    polygons: list[Array]


KEPT = ("closed", "in part")


class ContactPatches(NamedTuple):
    """Contact patches found, with overlaps and doubts."""

    a: Index  # owners of m patches, a < b, (m,)
    b: Index
    polygons: list[Array]  # convex [m], (n, 3) each
    normals: Array  # unit, from a to b, (m, 3)
    overlaps: list[tuple[int, int, float]]  # owners of pieces that penetrate, and how deep [m]
    doubts: list[DoubtfulContact]


class Candidates(NamedTuple):
    """Pairs of faces that may be contacts, and the tolerances that hold for them, shape (m,) each."""

    pairs: FacingPairs
    a: Index  # blocks of both faces
    b: Index
    distance: Array  # gap up to which they touch [m]
    width: Array  # least width of a contact [m]
    reach: Array  # gap up to which they are looked at [m]


def find_contacts(
    solids: Sequence[Solid],
    owner: Index,
    tolerance: ArrayLike,
    *,
    rules: ContactRules | None = None,
    reach: ArrayLike | None = None,
) -> ContactPatches:
    """Plane patches where faces of owners meet, with gaps or overlaps in tolerance.

    Parameters
    ----------
    solids : convex pieces, faces counter-clockwise from outside
    owner : block each piece belongs to, shape (n_solids,); pieces of one block do not touch each other
    tolerance : largest gap or overlap between two faces in contact, one for all or one per block, of which the smaller
        counts [m]
    rules : angles and width; ``rules.distance`` is not read here
    reach : gap up to which faces that are no contact are reported, in the same form [m]; None reports none

    Returns
    -------
    ContactPatches
        ``overlaps`` lists (block, block, depth [m]) where convex pieces penetrate deeper than the tolerance,
        ``doubts`` the near misses and the contacts kept by a rule.

    Notes
    -----
    Edge-to-edge and corner-to-face touching without an area carries no interface; see
    :func:`limitmason.geometry.penetration.touching_edges`.
    """
    rules = rules or ContactRules()
    n = int(owner.max()) + 1
    distance = np.broadcast_to(np.asarray(tolerance, dtype=float), n)
    far = distance if reach is None else np.maximum(np.broadcast_to(np.asarray(reach, dtype=float), n), distance)
    p, q = near_pairs(solids, owner, far)
    faces, start = all_faces(solids)
    overlaps = penetrations(solids, owner, faces, start, p, q, np.minimum(distance[owner[p]], distance[owner[q]]))
    looked_at = rules.angle_deg if reach is None else LOOKED_AT_DEG
    found = candidates(owner, faces, start, p, q, distance, far, rules, looked_at)
    code = judged(found, rules)
    pairs = found.pairs
    if (doubtful := (code != MADE) & (code != NOTHING)).any():
        rows = np.flatnonzero(doubtful)
        # faces with a third block between them do not meet
        code[rows[filled(found, rows, solids, owner)]] = NOTHING
    doubts = doubts_of(found, code, np.arange(len(code))) if reach is not None else []
    made = np.flatnonzero((code == MADE) | (code == _CLOSED) | (code == _IN_PART))
    polygons = [pairs.points[k, : pairs.corners_of[k]] for k in made]
    area = pairs.area[made]
    for row in np.flatnonzero(code[made] == _IN_PART).tolist():
        k = made[row]
        polygons[row] = closed_part(polygons[row], pairs.gap[k, : pairs.corners_of[k]], float(found.distance[k]))
        area[row] = 0.0  # of its hull: a part is merged with nothing
    return _merge_patches(
        found.a[made], found.b[made], polygons, pairs.normal[made], area, found.distance[made], overlaps, doubts
    )


def candidates(
    owner: Index, faces: Faces, start: Index, p: Index, q: Index, distance: Array,
    reach: Array, rules: ContactRules, looked_at_deg: float,
) -> Candidates:
    """Faces of near solids that overlap in projection with a gap within reach.

    Parameters
    ----------
    rules : which faces count as touching
    owner : block of every solid, shape (solids,)
    faces, start : of all solids, see :func:`all_faces`
    p, q : pairs of solids that are near, shape (k,)
    distance : gap that counts as contact, per owner [m]
    reach : gap up to which faces are looked at, per owner [m]
    looked_at_deg : angle up to which faces are looked at [deg]
    """
    pair_distance = np.minimum(distance[owner[p]], distance[owner[q]])
    pair_reach = np.minimum(reach[owner[p]], reach[owner[q]])
    pairs = facing_pairs(faces, start, owner, p, q, pair_reach, _CORNERS_ALIKE * pair_distance, looked_at_deg)
    a, b = owner[faces.part[pairs.f]], owner[faces.part[pairs.g]]
    limit, far = np.minimum(distance[a], distance[b]), np.minimum(reach[a], reach[b])
    width = limit if rules.width is None else np.full(len(a), rules.width)
    low = pairs.gap.min(axis=1)
    keep = (pairs.width > _LEAST_WIDTH * np.minimum(width, limit)) & (low >= -limit) & (low <= far)
    # where a piece is thinner than the distance, the faces behind it are near enough too
    inner = inner_faces(faces, owner, _CORNERS_ALIKE * float(distance.min(initial=np.inf)))
    keep &= ~(inner[pairs.f] | inner[pairs.g])
    return Candidates(
        pairs=pairs.rows(keep), a=a[keep], b=b[keep], distance=limit[keep], width=width[keep], reach=far[keep],
    )


NOTHING, MADE, _CLOSED, _IN_PART, _APART, _OPENS, _TURNED, _NARROW = range(8)
_KINDS = dict(enumerate(("closed", "in part", "apart", "opens", "turned", "narrow"), start=_CLOSED))
CONTACT_CODES = (MADE, _CLOSED, _IN_PART)


def judged(found: Candidates, rules: ContactRules, *, times: float = 1.0) -> Index:
    """Code of each pair of faces, (m,): ``MADE``, ``NOTHING`` or a kind of doubt.

    Parameters
    ----------
    found : pairs of faces that may be contacts
    rules : which of them count as touching
    times : factor on the distance that counts as contact [-]
    """
    pairs, limit = found.pairs, times * found.distance
    low, high = pairs.gap.min(axis=1), pairs.gap.max(axis=1)
    wide, facing = pairs.width > found.width, pairs.angle_deg <= rules.angle_deg  # not narrow, nearly parallel
    touches, inside = low <= limit, high <= limit  # the gap is within the limit somewhere, or everywhere
    code = np.full(len(low), NOTHING, dtype=np.intp)
    code[facing & ~touches & (low <= found.reach)] = _APART
    code[~facing & touches] = _TURNED
    code[facing & inside] = MADE
    part = np.flatnonzero(facing & touches & ~inside & wide)
    code[part] = _IN_PART
    for k in part.tolist():
        # a closed part that is too narrow is an edge
        n = pairs.corners_of[k]
        if width_in_space(closed_part(pairs.points[k, :n], pairs.gap[k, :n], float(limit[k]))) <= found.width[k]:
            code[k] = _OPENS
    code[_closing(found, rules, low, high, limit)] = _CLOSED
    code[(code != NOTHING) & ~wide] = _NARROW
    # what is narrow and does not touch either is nothing
    code[(code == _NARROW) & ~(touches & facing)] = NOTHING
    return code


def _closing(found: Candidates, rules: ContactRules, low: Array, high: Array, limit: Array) -> Flags:
    """Flags of the pairs that are wedges of a small angle and touch somewhere, (m,).

    One that does not touch itself may touch on another piece of the same two faces.

    Parameters
    ----------
    found : pairs of faces that may be contacts
    rules : which of them count as touching
    low, high : least and largest gap of every pair [m], shape (m,)
    limit : gap that counts as contact [m], shape (m,)
    """
    pairs = found.pairs
    near = np.maximum(found.reach, limit)
    out = (pairs.angle_deg <= rules.wedge_deg) & (high > limit) & (high <= near)
    for k in np.flatnonzero(out & (low > limit)).tolist():
        same = (found.a == found.a[k]) & (found.b == found.b[k]) & (low <= limit)
        # pieces of one face have its normal and angle but for rounding
        same &= np.abs(pairs.normal - pairs.normal[k]).max(axis=1) < 1e-6
        same &= np.abs(pairs.angle_deg - pairs.angle_deg[k]) < 1e-4  # [deg]
        out[k] = same.any()
    return out


def filled(found: Candidates, rows: Index, solids: Sequence[Solid], owner: Index) -> Flags:
    """Whether the solid of a third owner lies between the two faces of each pair, shape (m,).

    Parameters
    ----------
    found : pairs of faces that may be contacts
    rows : numbers of those that are looked at, shape (m,)
    solids : all pieces of the blocks
    owner : of every solid
    """
    low = np.array([s.vertices.min(axis=0) for s in solids])
    high = np.array([s.vertices.max(axis=0) for s in solids])
    out = np.zeros(len(rows), dtype=bool)
    for k, (row, x) in enumerate(zip(rows.tolist(), closed_centres(found.pairs, rows), strict=True)):
        third = (owner != found.a[row]) & (owner != found.b[row])
        around = (low < x).all(axis=1) & (x < high).all(axis=1) & third
        for i in np.flatnonzero(around).tolist():
            faces, _ = all_faces([solids[i]])
            out[k] |= bool((faces.normal @ x < faces.offset).all())
    return out


def doubts_of(found: Candidates, code: Index, rows: Index, *, made: str | None = None) -> list[DoubtfulContact]:
    """Near misses and contacts by rule, one entry for all pieces of a pair of faces.

    Pieces of one pair of faces have one normal, one angle and one plane between them.

    Parameters
    ----------
    found : pairs of faces that may be contacts
    code : from :func:`judged`, shape (m,)
    rows : numbers of the pairs to look at
    made : kind to give to plain contacts; None leaves them out
    """
    kinds = _KINDS if made is None else {**_KINDS, MADE: made}
    # one normal and angle but for rounding; + 0.0 makes -0.0 and 0.0 one
    groups: dict[tuple, list[int]] = {}
    normal = np.round(found.pairs.normal, 6) + 0.0
    angle = np.round(found.pairs.angle_deg, 4)
    for k in rows[np.isin(code[rows], list(kinds))].tolist():
        key = (int(found.a[k]), int(found.b[k]), int(code[k]), *normal[k].tolist(), float(angle[k]))
        groups.setdefault(key, []).append(k)
    out = []
    for (a, b, kind, *_), parallel in groups.items():
        for members in _by_plane(found, np.array(parallel)):
            pairs = found.pairs.rows(members)
            polygons = [p[:n] for p, n in zip(pairs.points, pairs.corners_of, strict=True)]
            place = (pairs.area / pairs.area.sum()) @ np.array([centroid_in_space(p) for p in polygons])
            out.append(DoubtfulContact(
                a=a, b=b, kind=kinds[kind], gap=(float(pairs.gap.min()), float(pairs.gap.max())),
                angle_deg=float(pairs.angle_deg.max()), area=float(pairs.area.sum()), width=float(pairs.width.max()),
                place=place, normal=pairs.normal[0], polygons=polygons,
            ))
    return sorted(out, key=lambda d: (d.a, d.b))


def _by_plane(found: Candidates, rows: Index) -> list[Index]:
    """Rows of parallel pairs of faces in groups, each in one plane, as the steps of two stepped blocks are not."""
    # the common area lies half-way between both faces, in the plane across their mean normal
    level = np.einsum("mi,mi->m", found.pairs.normal[rows], found.pairs.points[rows, 0])
    order = np.argsort(level, kind="stable")
    apart = np.diff(level[order]) > _SAME_PLANE * found.pairs.width[rows].max()
    return [np.sort(group) for group in np.split(rows[order], np.flatnonzero(apart) + 1)]


def _merge_patches(
    a: Index, b: Index, polygons: list[Array], normals: Array, areas: Array, tolerance: Array, overlaps: list,
    doubts: list[DoubtfulContact],
) -> ContactPatches:
    """Join coplanar patches of two blocks that together fill their convex hull.

    Parameters
    ----------
    a, b : owners of every patch, shape (m,)
    polygons : its corners [m], (n, 3) each
    normals : its unit normal from a to b, shape (m, 3)
    areas : [m2], shape (m,); 0 for a patch that is joined to no other
    tolerance : distance up to which faces touch [m], shape (m,)
    overlaps, doubts : passed on
    """
    groups: dict[tuple[int, int], list[ContactPatch]] = {}
    rows = np.lexsort((b, a))
    for k in rows.tolist():
        patch = ContactPatch(polygons[k], normals[k], float(areas[k]), float(tolerance[k]))
        groups.setdefault((int(a[k]), int(b[k])), []).append(patch)
    kept = [(pair, patch) for pair, group in groups.items() for patch in merged(group)]
    ends = np.array([pair for pair, _ in kept], dtype=np.intp).reshape(-1, 2)
    return ContactPatches(
        a=ends[:, 0], b=ends[:, 1], polygons=[patch.polygon for _, patch in kept],
        normals=np.array([patch.normal for _, patch in kept]).reshape(-1, 3), overlaps=overlaps, doubts=doubts,
    )
