"""Making the contact report of an assembly: candidates are searched anew, judged by the rules, and set against it."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import finite, positive
from limitmason.errors import InputError
from limitmason.geometry import contact
from limitmason.geometry.contact import Candidates, ContactRules, DoubtfulContact
from limitmason.geometry.facing import all_faces
from limitmason.geometry.penetration import near_pairs, penetrations, touching_edges
from limitmason.model import contact_warnings, detection
from limitmason.model.blockwork import Blockwork
from limitmason.model.contact_report import TINY, ContactEntry, ContactReport, EdgeContact, NearMiss
from limitmason.model.contact_warnings import length_text
from limitmason.model.detection import BlockPieces
from limitmason.model.face_touch import contact_gaps, least_width, untouched_faces
from limitmason.model.interface import Interface

_EXACT = 1e-6  # of the tolerance: smaller gaps are rounding and told as zero
_SEARCHED = 10.0  # largest factor on the tolerance of which the report tells what it would add
_STEEPEST_DEG = 89.0  # faces at a right angle do not face each other


def contact_report(assembly: Blockwork, *, distance: float | None, angle_deg: float | None) -> ContactReport:
    """Report on the contacts of an assembly, see ``Assembly.contact_report``.

    Parameters
    ----------
    assembly : that is reported on
    distance : gap up to which near misses are listed [m]; None for what detection looks at
    angle_deg : angle between faces up to which they are listed [deg]; None for what detection looks at
    """
    if distance is not None:
        positive("distance", distance, "m")
    if angle_deg is not None and not 0.0 < finite("angle_deg", angle_deg) < 90.0:
        raise InputError(f"angle_deg must be between 0 and 90, got {angle_deg!r}")
    rules, blocks = assembly.contact_rules, assembly.blocks
    pieces = detection.pieces_of(blocks)
    near = detection.contact_distances(pieces.widths, rules)
    exact = _EXACT * float(near.max())
    # how far beside a face a near miss is still listed, per block
    shown = detection.near_miss_reach(pieces.widths, near) if distance is None else np.full(len(near), distance)
    looked_at = contact.LOOKED_AT_DEG if angle_deg is None else max(angle_deg, rules.angle_deg)
    # farther than is listed: what a wider tolerance would add is counted among these
    reach = np.maximum(shown, _SEARCHED * near)
    faces, start = all_faces(pieces.solids)
    p, q = near_pairs(pieces.solids, pieces.owner, reach)
    steepest = min(max(looked_at, contact.LOOKED_AT_DEG), _STEEPEST_DEG)
    found = contact.candidates(pieces.owner, faces, start, p, q, near, reach, rules, steepest)
    present = contact_warnings.interfaces_by_pair(assembly)
    kept, missed, passed = _judged(_within(found, shown, looked_at), rules, pieces, near, present)
    p, q = near_pairs(pieces.solids, pieces.owner, near)
    touching = np.minimum(near[pieces.owner[p]], near[pieces.owner[q]])
    deeper = penetrations(pieces.solids, pieces.owner, faces, start, p, q, touching)
    entries = _entries(assembly, pieces, exact)
    # beside a contact, or faces that nearly are one, an edge that touches is no finding
    linked = set(present) | {(d.a, d.b) for d in missed if d.kind != "turned"}
    names = [b.name for b in blocks]
    edges = touching_edges(pieces.solids, pieces.owner, near, pieces.widths, linked)
    untouched, n_faces = untouched_faces(assembly, pieces.widths)
    count = Counter(i for pair, group in present.items() for i in pair for _ in group)
    tiny = {i for e in entries if e.tiny for i in (e.a, e.b)}
    free = np.flatnonzero(~assembly.held.any(axis=1)).tolist()
    loose = contact_warnings.loose_blocks(assembly).tolist() if assembly.supports else [i for i in free if not count[i]]
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


def _judged(
    listed: Candidates, rules: ContactRules, pieces: BlockPieces, near: Array,
    present: Mapping[tuple[int, int], list[Interface]],
) -> tuple[list[DoubtfulContact], list[DoubtfulContact], list[DoubtfulContact]]:
    """Doubts in three lists: kept as contacts, missed, and passed over.

    Those kept are contacts by a rule, those missed are near misses.

    Parameters
    ----------
    listed : pairs of faces that are judged
    rules : by which
    pieces : of all blocks
    near : gap up to which faces of every block touch [m], shape (n_blocks,)
    present : interfaces by pair of blocks
    """
    code = contact.judged(listed, rules)
    rows = np.flatnonzero(~np.isin(code, (contact.NOTHING, contact.MADE)))
    between = contact.filled(listed, rows, pieces.solids, pieces.owner)
    # what would be a contact is looked at too: the model may have no interface there
    rows = np.union1d(rows[~between], np.flatnonzero(code == contact.MADE))
    kept: list[DoubtfulContact] = []
    missed: list[DoubtfulContact] = []
    doubts = contact.doubts_of(listed, code, rows, made="left out")
    for doubt in doubts:
        there = contact_warnings.joined(doubt, present, near[doubt.a] + near[doubt.b])
        if doubt.kind in contact.KEPT and there:
            kept.append(doubt)
        elif doubt.kind in (*contact.KEPT, "left out"):
            missed += [] if there else [doubt._replace(kind="left out")]
    other = [d for d in doubts if d.kind not in (*contact.KEPT, "left out")]
    width_given = rules.width is not None
    open_ones = contact_warnings.near_misses(other, present, 2.0 * float(near.max()), least_width_given=width_given)
    return kept, missed + open_ones, [d for d in other if not any(d is m for m in open_ones)]


def _within(found: Candidates, reach: Array, angle_deg: float) -> Candidates:
    """The candidates up to a gap per block [m], shape (n_blocks,), and an angle [deg].

    ``reach`` is that gap.
    """
    # of two blocks the smaller gap counts
    far = np.minimum(reach[found.a], reach[found.b])
    keep = (found.pairs.gap.min(axis=1) <= far) & (found.pairs.angle_deg <= angle_deg)
    # the first field are the pairs of faces, the others have a row for each
    return Candidates(found.pairs.rows(keep), *(column[keep] for column in found._replace(reach=far)[1:]))


def _would_add(
    found: Candidates, pieces: BlockPieces, rules: ContactRules, widest: float
) -> tuple[tuple[str, int], ...]:
    """How many more pairs of faces would be contacts if one tolerance were wider.

    One tolerance after the other is widened; returned are which, in words, and the number of pairs.

    Parameters
    ----------
    found : pairs of faces that touch or nearly do
    pieces : of all blocks
    rules : that hold
    widest : gap of the widest near miss [m]; 0 where there is none
    """
    base = np.isin(contact.judged(found, rules), contact.CONTACT_CODES)
    # what is widened, the candidates, the rules, and a factor on the tolerance
    tries: list[tuple[str, Candidates, ContactRules, float]] = [
        (f"distance x {k:g}", found, rules, k) for k in (2.0, 5.0, _SEARCHED)
    ]
    if widest > 0.0:
        every = np.full(len(found.distance), widest)
        wide = found._replace(distance=np.maximum(found.distance, every), reach=np.maximum(found.reach, every))
        tries.append((f"distance {length_text(widest)}", wide, rules, 1.0))
    for wider in sorted({min(k * rules.angle_deg, contact.LOOKED_AT_DEG) for k in (2.0, 3.0)}):
        if wider > rules.angle_deg:
            tries.append((f"angle {wider:g} degrees", found, replace(rules, angle_deg=wider), 1.0))
    tries.append(("no least width", found._replace(width=np.zeros(len(found.width))), rules, 1.0))
    out = []
    for label, trial, changed, times in tries:
        rows = np.flatnonzero(np.isin(contact.judged(trial, changed, times=times), contact.CONTACT_CODES) & ~base)
        between = contact.filled(found, rows, pieces.solids, pieces.owner)
        out.append((label, int((~between).sum())))
    return tuple(out)


def _entries(assembly: Blockwork, pieces: BlockPieces, exact: float) -> list[ContactEntry]:
    """A row for every joint of an assembly with these pieces.

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
    """Least and largest gap [m], rounding errors below ``exact`` [m] taken as nil."""
    low, high = (0.0 if abs(g) < exact else float(g) for g in gap)
    return low, high


def _named(doubts: Iterable[DoubtfulContact], names: list[str], exact: float) -> tuple[NearMiss, ...]:
    """Doubts with names for blocks, nearest first.

    Gaps below ``exact`` [m] are told as zero.
    """
    rows = [
        NearMiss(
            a=names[d.a], b=names[d.b], kind=d.kind, gap=_snapped(d.gap, exact), angle_deg=d.angle_deg, area=d.area,
            place=d.place, polygons=d.polygons,
        )
        for d in doubts
    ]
    return tuple(sorted(rows, key=lambda r: (max(r.gap[0], 0.0), r.gap[1], r.a, r.b)))
