"""The contact report: which faces touch, which nearly do, what hangs on little, what a wider tolerance would add."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.checks import positive
from limitmason.errors import InputError
from limitmason.geometry import contact
from limitmason.geometry.contact import Candidates, ContactRules, DoubtfulContact
from limitmason.geometry.facing import all_faces
from limitmason.geometry.overlap import near_pairs, penetrations, touching_edges
from limitmason.model import detection
from limitmason.model.blockwork import Blockwork
from limitmason.model.detection import BlockPieces, length_text
from limitmason.model.face_touch import UntouchedFace, contact_gaps, least_width, untouched_faces
from limitmason.storage.frozen import ReadOnly

TINY = 0.1
"""A contact narrower than this fraction of the smaller block's width is tiny [-]."""

_SHOWN = 20  # rows of a table that a reader looks at


class ContactEntry(NamedTuple):
    """A contact of the model: names, kind, area [m2], least width in its plane [m], gap [m], angle [deg], place [m].

    Gap and angle are NaN where an interface made by hand lies on no face of one of its blocks.
    """

    a: str
    b: str
    kind: str
    area: float
    width: float
    gap: tuple[float, float]
    angle_deg: float
    place: Array
    tiny: bool


class NearMiss(NamedTuple):
    """Two faces in doubt: names, kind as in ``limitmason.geometry.contact.Doubt``, gap [m], angle [deg], place [m].

    A further kind, "left out", is a pair of faces that touch where the model has no interface.
    """

    a: str
    b: str
    kind: str
    gap: tuple[float, float]
    angle_deg: float
    area: float
    place: Array
    polygons: list[Array]


class EdgeContact(NamedTuple):
    """Blocks that touch along an edge or at a corner only.

    No force passes there in this model. Place [m].
    """

    a: str
    b: str
    kind: str
    place: Array


@dataclass(frozen=True, eq=False)
class ContactReport(ReadOnly):
    """What :meth:`limitmason.Assembly.contact_report` found.

    ``str`` makes a table of it.

    Parameters
    ----------
    n_blocks : of the assembly
    tolerance : gap up to which faces touch: least and largest over the blocks [m]
    rules : angles and width that hold
    contacts : every interface of the model
    near_misses : faces that may have been meant to touch: "apart", "opens", "turned" or "narrow" where the two blocks
        share no other contact, and "left out"
    kept : wedges that are contacts by a rule: "closed" or "in part"
    passed_over : other pairs of faces that were not made a contact: "narrow" or "turned" beside another contact, and
        "narrow" by a least width that was given
    edges : touching along an edge or at a corner only
    overlaps : names and depth beyond the tolerance [m]
    deepest_overlap : of faces in contact, within the tolerance [m]
    untouched : faces that touch nothing, the outer faces of a sound wall among them
    n_faces : of all blocks
    floating : blocks without a chain of contacts to a support, or without any contact where nothing is held
    hanging : free blocks whose only contact is tiny
    would_add : what is widened, and how many more pairs of faces would then be contacts
    looked_up_to : gap [m] and angle between faces [deg] up to which near misses were looked for
    """

    n_blocks: int
    tolerance: tuple[float, float]
    rules: ContactRules
    contacts: tuple[ContactEntry, ...]
    near_misses: tuple[NearMiss, ...]
    kept: tuple[NearMiss, ...]
    passed_over: tuple[NearMiss, ...]
    edges: tuple[EdgeContact, ...]
    overlaps: tuple[tuple[str, str, float], ...]
    deepest_overlap: float
    untouched: tuple[UntouchedFace, ...]
    n_faces: int
    floating: tuple[str, ...]
    hanging: tuple[str, ...]
    would_add: tuple[tuple[str, int], ...]
    looked_up_to: tuple[float, float]

    @property
    def tiny(self) -> tuple[ContactEntry, ...]:
        """Contacts that are short relative to their blocks."""
        return tuple(c for c in self.contacts if c.tiny)

    @property
    def decisions(self) -> tuple[str, ...]:
        """What a user should decide before trusting a multiplier, or empty for a clean model."""
        out = []
        for rows, one, many in (
            (self.near_misses, "near miss", "near misses"),
            ([k for k in self.kept if k.kind == "in part"], "wedge kept in part", "wedges kept in part"),
            (self.overlaps, "overlap", "overlaps"),
            (self.floating, "floating block", "floating blocks"),
            (self.hanging, "block that hangs on one tiny contact", "blocks that hang on one tiny contact"),
        ):
            if rows:
                out.append(f"{len(rows)} {one if len(rows) == 1 else many}")
        return tuple(out)

    @property
    def tolerance_text(self) -> str:
        """Gap up to which faces touch, with its unit."""
        low, high = (length_text(t) for t in self.tolerance)
        return low if low == high else f"{low} to {high}"

    def __repr__(self) -> str:
        """One line."""
        verdict = ", ".join(self.decisions) or "nothing to decide"
        return f"<ContactReport: {len(self.contacts)} contacts of {self.n_blocks} blocks; {verdict}>"

    def __str__(self) -> str:
        """The whole report as text.

        Lengths in mm, places in m.
        """
        kinds = Counter(c.kind for c in self.contacts)
        lines = [
            f"{self.n_blocks} blocks, {len(self.contacts)} contacts"
            + (f" ({', '.join(f'{n} {k}' for k, n in sorted(kinds.items()))})" if kinds else ""),
            f"tolerance {self.tolerance_text}; angle {self.rules.angle_deg:g} degrees, wedges closed up to "
            f"{self.rules.wedge_deg:g} degrees",
            f"near misses looked for up to {length_text(self.looked_up_to[0])} and {self.looked_up_to[1]:g} degrees",
        ]
        if self.contacts:
            area = [c.area for c in self.contacts]
            lines.append(f"area {min(area):.3g} to {max(area):.3g} m2")
        if known := [c for c in self.contacts if not np.isnan(c.angle_deg)]:
            low, high = (1e3 * extreme(g for c in known for g in c.gap) for extreme in (min, max))
            angle = max(c.angle_deg for c in known)
            lines.append(f"gap {low:.2g} to {high:.2g} mm, angle up to {angle:.2g} degrees")
        if len(known) < len(self.contacts):
            lines.append(f"{len(self.contacts) - len(known)} contacts lie on no face of one of their blocks")
        if self.deepest_overlap > 0.0:
            lines.append(f"deepest overlap within the tolerance {1e3 * self.deepest_overlap:.2g} mm")
        lines += _doubt_rows("near misses: faces that may have been meant to touch", self.near_misses)
        lines += _doubt_rows("wedges kept as contacts", self.kept)
        tiny = [f"{c.a} | {c.b} | {1e3 * c.width:.3g} mm wide, {c.area:.3g} m2 | {_place(c.place)}" for c in self.tiny]
        lines += _rows("tiny contacts", tiny)
        lines += _rows("overlaps", [f"{a} | {b} | {1e3 * d:.3g} mm deep" for a, b, d in self.overlaps])
        lines += _rows("floating blocks: no chain of contacts to a support", list(self.floating))
        lines += _rows("blocks that hang on one tiny contact", list(self.hanging))
        edges = [f"{e.a} | {e.b} | {e.kind} | {_place(e.place)}" for e in self.edges]
        lines += _rows("edge and corner contacts: no force passes there", edges, shown=5)
        lines += _doubt_rows("passed over: narrow, or turned beside another contact", self.passed_over, shown=5)
        lines.append(f"{len(self.untouched)} of {self.n_faces} faces touch nothing (outer faces included)")
        if self.would_add:
            lines.append("more contacts with " + "; ".join(f"{what}: {count:+d}" for what, count in self.would_add))
        lines.append(f"to decide: {', '.join(self.decisions)}" if self.decisions else "nothing to decide")
        return "\n".join(lines)


def contact_report(assembly: Blockwork, *, distance: float | None, angle_deg: float | None) -> ContactReport:
    """Report on the contacts of an assembly, see ``Assembly.contact_report``.

    Parameters
    ----------
    distance, angle_deg : gap [m] and angle up to which near misses are listed; None for the rules' own
    """
    if distance is not None:
        positive("distance", distance, "m")
    if angle_deg is not None and not 0.0 < angle_deg < 90.0:
        raise InputError(f"angle_deg must be between 0 and 90, got {angle_deg!r}")
    rules, blocks = assembly.contact_rules, assembly.blocks
    pieces = detection.pieces_of(blocks)
    near = detection.contact_distances(pieces.widths, rules)
    exact = 1e-6 * float(near.max())
    # how far beside a face a near miss is still listed, per block
    shown = detection.near_miss_reach(pieces.widths, near) if distance is None else np.full(len(near), distance)
    looked_at = contact.LOOKED_AT_DEG if angle_deg is None else max(angle_deg, rules.angle_deg)
    found = _search(pieces, near, np.maximum(shown, 10.0 * near), rules, max(looked_at, contact.LOOKED_AT_DEG))
    present = detection.interfaces_by_pair(assembly)

    listed = _within(found, shown, looked_at)
    code = contact.judged(listed, rules)
    rows = np.flatnonzero(~np.isin(code, (contact.NOTHING, contact.MADE)))
    between = _filled(listed, rows, pieces)
    rows = np.union1d(rows[~between], np.flatnonzero(code == contact.MADE))
    kept: list[DoubtfulContact] = []
    missed: list[DoubtfulContact] = []
    doubts = contact.doubts_of(listed, code, rows, made="left out")
    for doubt in doubts:
        there = detection.joined(doubt, present, near[doubt.a] + near[doubt.b])
        if doubt.kind in contact.KEPT and there:
            kept.append(doubt)
        elif doubt.kind in (*contact.KEPT, "left out"):
            missed += [] if there else [doubt._replace(kind="left out")]
    other = [d for d in doubts if d.kind not in (*contact.KEPT, "left out")]
    given = assembly.contact_rules.width is not None
    open_ones = detection.near_misses(other, present, 2.0 * float(near.max()), least_width_given=given)
    missed += open_ones
    passed = [d for d in other if not any(d is m for m in open_ones)]

    faces, start = all_faces(pieces.solids)
    p, q = near_pairs(pieces.solids, pieces.owner, near)
    touching = np.minimum(near[pieces.owner[p]], near[pieces.owner[q]])
    deeper = penetrations(pieces.solids, pieces.owner, faces, start, p, q, touching)
    entries = _entries(assembly, pieces, exact)
    linked = set(present) | {(d.a, d.b) for d in missed if d.kind != "turned"}
    names = [b.name for b in blocks]
    edges = touching_edges(pieces.solids, pieces.owner, near, pieces.widths, linked)
    untouched, n_faces = untouched_faces(assembly, pieces)
    count = Counter(i for pair, group in present.items() for i in pair for _ in group)
    tiny = {i for e in entries if e.tiny for i in (e.a, e.b)}
    free = np.flatnonzero(~assembly.held.any(axis=1)).tolist()
    loose = detection.loose_blocks(assembly).tolist() if assembly.supports else [i for i in free if not count[i]]
    return ContactReport(
        n_blocks=assembly.n_blocks, tolerance=(float(near.min()), float(near.max())), rules=rules,
        contacts=tuple(entries), near_misses=_named(missed, names, exact), kept=_named(kept, names, exact),
        passed_over=_named(passed, names, exact),
        edges=tuple(EdgeContact(names[a], names[b], kind, place) for a, b, kind, place in edges),
        overlaps=tuple((names[i], names[j], d) for i, j, d in deeper),
        deepest_overlap=max((-e.gap[0] for e in entries if e.gap[0] < 0.0), default=0.0), untouched=tuple(untouched),
        n_faces=n_faces, floating=tuple(names[i] for i in loose),
        hanging=tuple(names[i] for i in free if count[i] == 1 and names[i] in tiny),
        would_add=_would_add(found, pieces, rules, max((d.gap[1] for d in missed if d.kind == "apart"), default=0.0)),
        looked_up_to=(float(np.max(shown)), float(looked_at)),
    )


def _search(pieces: BlockPieces, near: Array, reach: Array, rules: ContactRules, looked_at_deg: float) -> Candidates:
    p, q = near_pairs(pieces.solids, pieces.owner, reach)
    faces, start = all_faces(pieces.solids)
    return contact.candidates(pieces.owner, faces, start, p, q, near, reach, rules, min(looked_at_deg, 89.0))


def _within(found: Candidates, reach: Array, angle_deg: float) -> Candidates:
    """The candidates up to a gap per block [m] and an angle."""
    far = np.minimum(reach[found.a], reach[found.b])
    keep = (found.pairs.gap.min(axis=1) <= far) & (found.pairs.angle_deg <= angle_deg)
    return Candidates(found.pairs.rows(keep), *(column[keep] for column in found._replace(reach=far)[1:]))


def _filled(found: Candidates, rows: Index, pieces: BlockPieces) -> Flags:
    """Whether another block fills the space between the two faces of some candidates."""
    return contact.filled(
        contact.closed_centres(found.pairs, rows), found.a[rows], found.b[rows], pieces.solids, pieces.owner
    )


def _would_add(
    found: Candidates, pieces: BlockPieces, rules: ContactRules, widest: float
) -> tuple[tuple[str, int], ...]:
    """How many more pairs of faces would be contacts if one tolerance were wider.

    ``widest`` is the gap of the widest near miss [m]. Returned are what is widened, in words, and the number of pairs.
    """
    base = np.isin(contact.judged(found, rules), contact.CONTACT_CODES)
    tries: list[tuple[str, Candidates, ContactRules, float]] = [
        (f"distance x {k:g}", found, rules, k) for k in (2.0, 5.0, 10.0)
    ]
    if widest > 0.0:
        every = np.full(len(found.distance), widest)
        wide = found._replace(distance=np.maximum(found.distance, every), reach=np.maximum(found.reach, every))
        tries.append((f"distance {length_text(widest)}", wide, rules, 1.0))
    for k in (2.0, 3.0):
        wider = min(k * rules.angle_deg, contact.LOOKED_AT_DEG)
        if wider > rules.angle_deg:
            tries.append((f"angle {wider:g} degrees", found, replace(rules, angle_deg=wider), 1.0))
    tries.append(("no least width", found._replace(width=np.zeros(len(found.width))), rules, 1.0))
    out = []
    for label, trial, changed, times in tries:
        rows = np.flatnonzero(np.isin(contact.judged(trial, changed, times=times), contact.CONTACT_CODES) & ~base)
        between = _filled(found, rows, pieces)
        out.append((label, int((~between).sum())))
    return tuple(out)


def _entries(assembly: Blockwork, pieces: BlockPieces, exact: float) -> list[ContactEntry]:
    """A row for every joint: blocks, kind, area, width, gap and angle.

    Gaps below ``exact`` [m] are told as zero.
    """
    x = assembly.arrays
    gaps, angles = contact_gaps(assembly, pieces)
    out = []
    for k, i in enumerate(assembly.interfaces):
        width = least_width(i.polygon, i.normal)
        small = float(min(pieces.widths[i.block_a], pieces.widths[i.block_b]))
        out.append(ContactEntry(
            a=assembly.blocks[i.block_a].name, b=assembly.blocks[i.block_b].name, kind=i.kind, area=float(x.area[k]),
            width=width, gap=_snapped(gaps[k], exact), angle_deg=float(angles[k]), place=x.centre[k],
            tiny=width < TINY * small,
        ))
    return out


def _snapped(gap: Iterable[float], exact: float) -> tuple[float, float]:
    """Least and largest gap, rounding errors below ``exact`` taken as nil [m]."""
    low, high = (0.0 if abs(g) < exact else float(g) for g in gap)
    return low, high


def _named(doubts: Iterable[DoubtfulContact], names: list[str], exact: float) -> tuple[NearMiss, ...]:
    """Doubts with names for blocks, nearest first; gaps below ``exact`` [m] are zero."""
    rows = [
        NearMiss(
            a=names[d.a], b=names[d.b], kind=d.kind, gap=_snapped(d.gap, exact), angle_deg=d.angle_deg, area=d.area,
            place=d.place, polygons=d.polygons,
        )
        for d in doubts
    ]
    return tuple(sorted(rows, key=lambda r: (max(r.gap[0], 0.0), r.gap[1], r.a, r.b)))


def _place(place: Array) -> str:
    return f"at ({', '.join(f'{x:.4g}' for x in place)}) m"


def _rows(title: str, rows: list[str], *, shown: int = _SHOWN) -> list[str]:
    """A titled list in words, of at most ``shown`` rows."""
    if not rows:
        return []
    more = [f"  ... and {len(rows) - shown} more"] if len(rows) > shown else []
    return [f"{title} ({len(rows)})", *(f"  {r}" for r in rows[:shown]), *more]


def _doubt_rows(title: str, rows: tuple[NearMiss, ...], *, shown: int = _SHOWN) -> list[str]:
    """A titled list of near misses in words, of at most ``shown`` rows."""
    return _rows(title, [
        f"{d.a} | {d.b} | {d.kind} | gap {1e3 * d.gap[0]:.2g} to {1e3 * d.gap[1]:.2g} mm, {d.angle_deg:.2g} degrees, "
        f"{d.area:.3g} m2 | {_place(d.place)}" for d in rows
    ], shown=shown)
