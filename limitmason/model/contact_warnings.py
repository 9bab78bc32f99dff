"""What is said of contacts: blocks that overlap or float, faces that nearly touch, joints that open like a wedge.

Overlaps and floating blocks are refused in ``assembly`` by these words.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.geometry.contact import KEPT, ContactPatches, ContactRules, DoubtfulContact
from limitmason.model.block import Block
from limitmason.model.blockwork import Blockwork
from limitmason.model.detection import contact_distances
from limitmason.model.interface import Interface
from limitmason.model.plausibility import PlausibilityWarning, warn

_SAME_FACE_DEG = 10.0
"""Chosen: two faces of one block that turn by more are told apart, and an interface may lie on either side [deg]."""

_SHOWN = 3  # doubts that a warning lists in full, chosen to keep it readable


class ContactWarning(PlausibilityWarning):
    """Faces that nearly touch and are no contact, or contacts that open like a wedge."""


def overlap_text(found: ContactPatches, blocks: Sequence[Block], widths: Array, rules: ContactRules) -> str:
    """Words on blocks that overlap: the worst pair, its depth, and what to do.

    Parameters
    ----------
    found : with one overlap or more
    blocks : of the assembly
    widths : least thickness of every block [m], shape (n_blocks,)
    rules : what their tolerance is read from
    """
    i, j, depth = max(found.overlaps, key=lambda overlap: overlap[2])
    more = f" ({len(found.overlaps)} overlapping pairs in all)" if len(found.overlaps) > 1 else ""
    distances = contact_distances(widths, rules)
    what = "correct the geometry or raise the tolerance"
    if depth > 0.5 * min(widths[i], widths[j]):  # no error of drawing
        what = "one lies in the other: leave out what is drawn twice, and draw a block around a hole in two parts"
    return (
        f"blocks {blocks[i].name!r} and {blocks[j].name!r} overlap by {depth:.3g} m, more than the "
        f"tolerance of {min(distances[i], distances[j]):.3g} m{more}; {what}"
    )


def loose_blocks(assembly: Blockwork) -> Index:
    """Numbers of an assembly's blocks without a chain of contacts to one that is held.

    A block counts as held where any of its degrees of freedom is.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n = assembly.n_blocks
    a = np.array([i.block_a for i in assembly.interfaces], dtype=int)
    b = np.array([i.block_b for i in assembly.interfaces], dtype=int)
    _, label = connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
    return np.flatnonzero(~np.isin(label, label[assembly.held.any(axis=1)]))


def floating_text(assembly: Blockwork, loose: Index) -> str:
    """Words on blocks without a chain of contacts to a support, with the nearest miss.

    Parameters
    ----------
    assembly : that has them
    loose : numbers of these blocks, one or more
    """
    near = [d for d in assembly.doubts if d.kind not in KEPT and (d.a in loose or d.b in loose)]
    first = int(loose[0])
    # a miss of the block that is named goes first, then the smallest gap
    about = min(near, key=lambda d: (first not in (d.a, d.b), d.gap[0], d.angle_deg), default=None)
    nearest = "" if about is None else f"; nearest miss: {doubt_text(about, assembly.blocks)}"
    return (
        f"block {assembly.blocks[first].name!r} floats: no chain of contacts joins it to a support "
        f"({len(loose)} such blocks){nearest}; close the gap, or raise the tolerance above "
        f"{assembly.tolerance:.3g} m if it should touch"
    )


def length_text(length: float) -> str:
    """A length [m] in words, in m from 1 m on and in mm below."""
    return f"{length:.3g} m" if abs(length) >= 1.0 else f"{1e3 * length:.3g} mm"


def doubt_text(doubt: DoubtfulContact, blocks: Sequence[Block]) -> str:
    """Names, gap and angle of two faces in words, and of a narrow contact its width."""
    # a least gap that is rounding beside the largest is told as 0, and a gap even to 1 % as one number
    low, high = (0.0 if abs(g) < 1e-6 * abs(doubt.gap[1]) else g for g in doubt.gap)
    gap = length_text(high) if high - low <= 0.01 * abs(high) else f"{length_text(low)} to {length_text(high)}"
    wide = f", {length_text(doubt.width)} wide" if doubt.kind == "narrow" else ""
    return f"{blocks[doubt.a].name!r} and {blocks[doubt.b].name!r} (gap {gap}, {doubt.angle_deg:.2g} degrees{wide})"


def interfaces_by_pair(assembly: Blockwork) -> dict[tuple[int, int], list[Interface]]:
    """Interfaces of every pair of blocks (a, b), a < b."""
    out: dict[tuple[int, int], list[Interface]] = {}
    for i in assembly.interfaces:
        out.setdefault((min(i.block_a, i.block_b), max(i.block_a, i.block_b)), []).append(i)
    return out


def joined(doubt: DoubtfulContact, present: Mapping[tuple[int, int], list[Interface]], slack: float) -> bool:
    """Whether the model has an interface where two faces meet.

    Parameters
    ----------
    doubt : the two faces that may meet
    present : from :func:`interfaces_by_pair`
    slack : distance up to which they are the same place [m]
    """
    if doubt.kind in KEPT:
        # the joint that was made in spite of the doubt lies on the closed part of the common area
        points = np.concatenate(doubt.polygons)
        low, high = points.min(axis=0), points.max(axis=0)
    else:
        low = high = doubt.place
    # an interface may lie on either face, or half-way in the gap
    slack += abs(doubt.gap[1])
    for i in present.get((doubt.a, doubt.b), ()):
        near = (i.polygon.min(axis=0) <= high + slack).all() and (low - slack <= i.polygon.max(axis=0)).all()
        # another face of the same blocks may be as near, but it is turned
        if near and abs(i.normal @ doubt.normal) > np.cos(np.deg2rad(_SAME_FACE_DEG)):
            return True
    return False


def near_misses(
    doubts: Sequence[DoubtfulContact], present: Mapping[tuple[int, int], list[Interface]], slack: float = 0.0, *,
    least_width_given: bool = False,
) -> list[DoubtfulContact]:
    """Faces that may have been meant to touch and do not.

    Faces that touch at too large an angle count only where their blocks have no other contact, the most nearly parallel
    ones of each pair: beside a contact they are the next side of a rounded stone. So do faces that touch over less than
    the least width of a contact, unless that width was given: then leaving them out was asked for.

    Parameters
    ----------
    doubts : of all faces that nearly touch
    present : interfaces by pair of blocks, from :func:`interfaces_by_pair`
    slack : what :func:`joined` allows beside them [m]
    least_width_given : whether a user gave the least width of a contact
    """
    turned: dict[tuple[int, int], DoubtfulContact] = {}
    for d in doubts:
        pair = (d.a, d.b)
        if d.kind == "turned" and pair not in present:
            # of angles that are equal but for rounding the larger face
            turned[pair] = min(turned.get(pair, d), d, key=lambda e: (round(e.angle_deg, 6), -e.area))
    return [
        d
        for d in doubts
        if (d.kind in ("apart", "opens") and not joined(d, present, slack))
        or d is turned.get((d.a, d.b))
        or (d.kind == "narrow" and not least_width_given and (d.a, d.b) not in present)
    ]


def count_text(count: int) -> str:
    """Words on the number of near misses, one or more."""
    which = "pair of faces nearly touches and is no contact" if count == 1 else (
        "pairs of faces nearly touch and are no contacts"
    )
    return f"{count} {which}: see assembly.contact_report()"


def warn_of_doubts(assembly: Blockwork, kept: Sequence[DoubtfulContact], missed: Sequence[DoubtfulContact]) -> None:
    """Warn of joints made by a rule, and of near misses.

    Parameters
    ----------
    assembly : for the names of its blocks
    kept : doubts that are contacts by a rule
    missed : near misses, see :func:`near_misses`
    """
    narrow = [d for d in missed if d.kind == "narrow"]
    missed = [d for d in missed if d.kind != "narrow"]
    for rows, what, do in (
        (kept, "open like a wedge and are kept as contacts", "draw them closed, or see assembly.contact_report()"),
        (missed, "nearly touch and are no contacts", "close them, raise the tolerance, or see "
         "assembly.contact_report()"),
        (narrow, "touch over too narrow a strip and are no contacts", "lower smallest_contact to keep them, give it "
         "to leave them out, or see assembly.contact_report()"),
    ):
        if rows:
            shown = "; ".join(doubt_text(d, assembly.blocks) for d in rows[:_SHOWN])
            more = f"; and {len(rows) - _SHOWN} more" if len(rows) > _SHOWN else ""
            warn(f"{len(rows)} pair(s) of faces {what}: {shown}{more}; {do}", ContactWarning)


def moved_doubts(
    doubts: Iterable[DoubtfulContact], matrix: Array, translation: Array, scale: float
) -> tuple[DoubtfulContact, ...]:
    """Doubts of an assembly that was turned, mirrored or scaled.

    A point x went to matrix x + translation.

    Parameters
    ----------
    doubts : before
    matrix : scale times an orthogonal one, shape (3, 3)
    translation : [m], shape (3,)
    scale : lengths after over before [-]
    """
    return tuple(
        d._replace(
            gap=(scale * d.gap[0], scale * d.gap[1]), area=scale**2 * d.area, width=scale * d.width,
            place=matrix @ d.place + translation, normal=matrix @ d.normal / scale,
            polygons=[p @ matrix.T + translation for p in d.polygons],
        )
        for d in doubts
    )


def renumbered_doubts(doubts: Iterable[DoubtfulContact], new: Index) -> tuple[DoubtfulContact, ...]:
    """Doubts of an assembly whose block i is now block ``new[i]``.

    As when they are found, they are sorted by their pair of blocks, a < b.
    """
    out = []
    for d in doubts:
        a, b = int(new[d.a]), int(new[d.b])
        out.append(d._replace(a=a, b=b) if a < b else d._replace(a=b, b=a, normal=-d.normal))
    return tuple(sorted(out, key=lambda d: (d.a, d.b)))
