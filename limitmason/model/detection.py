"""Contacts of the blocks of an assembly: which tolerance holds, what was found, and what to say about the rest.

Overlaps are refused in ``assembly``, by the words made here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.constants import RELATIVE_TOLERANCE
from limitmason.errors import InputError
from limitmason.geometry.contact import KEPT, NEAR, ContactPatches, ContactRules, DoubtfulContact, find_contacts
from limitmason.geometry.convex_parts import convex_parts, is_convex, largest_skew
from limitmason.geometry.polyhedron import Solid, check_closed, check_solids, least_widths, mass_properties
from limitmason.model.block import Block
from limitmason.model.blockwork import Blockwork
from limitmason.model.interface import Interface
from limitmason.model.plausibility import PlausibilityWarning, warn

_ROUNDING = 1e-9  # of a solid's size: chosen, far above the rounding of coordinates and far below a gap

_SAME_FACE_DEG = 10.0
"""Chosen: two faces of one block that turn by more are told apart, and an interface may lie on either side [deg]."""

_SHOWN = 3  # doubts that a warning lists in full, chosen to keep it readable


class ContactWarning(PlausibilityWarning):
    """Faces that nearly touch and are no contact, or contacts that open like a wedge."""


class BlockPieces(NamedTuple):
    """Convex pieces of all blocks in a row.

    ``owner`` is the number of the block of each, and ``widths`` are the least widths of the blocks [m].
    """

    solids: list[Solid]
    owner: Index
    widths: Array


def pieces_of(blocks: Sequence[Block]) -> BlockPieces:
    """Pieces of all blocks."""
    parts = [b.parts for b in blocks]
    owner = np.repeat(np.arange(len(blocks)), [len(p) for p in parts])
    return BlockPieces([piece for p in parts for piece in p], owner, least_widths(parts))


def closed_pieces(blocks: Sequence[Block]) -> BlockPieces:
    """Pieces of all blocks, open ones refused by name.

    What is flat, inverted or concave is not seen here.
    """
    check_closed([p for b in blocks for p in b.parts], [b.name for b in blocks for _ in b.parts])
    return pieces_of(blocks)


def with_convex_parts(
    blocks: Sequence[Block], pieces: BlockPieces, flatness: float
) -> tuple[tuple[Block, ...], BlockPieces]:
    """Blocks and their pieces, those that are not convex divided into convex parts.

    A block stays one rigid body. Other faults, such as faces that are not plane, are left for :func:`detect` to refuse.

    Parameters
    ----------
    blocks : as given
    pieces : their solids, closed but convex or not
    flatness : largest distance of a vertex from its face's plane [m]

    Raises
    ------
    InputError
        Naming the block, for what :func:`~limitmason.geometry.convex_parts.convex_parts` refuses.
    """
    rows = np.flatnonzero(~is_convex(pieces.solids, flatness))
    parts: dict[int, list[Solid]] = {}
    for k in rows.tolist():
        solid, name = pieces.solids[k], blocks[pieces.owner[k]].name
        skew = largest_skew(solid)
        # warped, flat or inverted: detect refuses it in plainer words than a division would
        if skew > flatness or not mass_properties([solid]).volume[0] > 0.0:
            continue
        size = float(np.ptp(solid.vertices, axis=0).max())
        try:
            # chosen twice the skew: corners of a warped face lie in its plane, with room
            parts[k] = convex_parts(solid, max(2.0 * skew, _ROUNDING * size))
        except InputError as error:
            raise InputError(f"block {name!r} is not convex, and {error}") from None
    if not parts:
        return tuple(blocks), pieces
    new: list[list[Solid]] = [[] for _ in blocks]
    for k, solid in enumerate(pieces.solids):
        new[pieces.owner[k]] += parts.get(k, [solid])
    divided = tuple(
        b if len(b.parts) == len(p) else replace(b, parts=tuple(p)) for b, p in zip(blocks, new, strict=True)
    )
    return divided, pieces_of(divided)


def typical_tolerance(pieces: BlockPieces) -> float:
    """The default tolerance for a block of median width [m].

    ``pieces`` are those of all blocks.

    Contacts take that of the smaller of two blocks.
    """
    # what is flat or not finite is refused by name when contacts are looked for
    width = np.nanmedian(pieces.widths)
    return RELATIVE_TOLERANCE * (float(width) if np.isfinite(width) and width > 0 else 1.0)


def contact_distances(widths: Array, rules: ContactRules) -> Array:
    """Gap or overlap up to which faces of every block touch [m], shape (n_blocks,).

    Of two blocks the smaller one counts.

    Parameters
    ----------
    widths : least width of every block [m], shape (n_blocks,)
    rules : their distance, where it is given, holds for all blocks
    """
    return np.asarray(RELATIVE_TOLERANCE * widths if rules.distance is None else np.full(len(widths), rules.distance))


def near_miss_reach(widths: Array, distances: Array) -> Array:
    """Gap of every block up to which faces are near misses [m].

    It is at least twice the tolerance, so that a tolerance given wide still leaves room for near misses beyond it.

    Parameters
    ----------
    widths : least width of every block [m], shape (n_blocks,)
    distances : from :func:`contact_distances` [m], shape (n_blocks,)
    """
    return np.maximum(2.0 * distances, NEAR * widths)


def detect(blocks: Sequence[Block], pieces: BlockPieces, rules: ContactRules, flatness: float) -> ContactPatches:
    """Contacts, overlaps and doubts of blocks.

    Flat, inverted and concave pieces are refused by name.

    Parameters
    ----------
    blocks : between which contacts are looked for
    pieces : their convex pieces
    rules : what counts as a contact
    flatness : largest distance of a vertex from its face's plane [m]
    """
    check_solids(pieces.solids, [blocks[i].name for i in pieces.owner], flatness)
    distances = contact_distances(pieces.widths, rules)
    reach = near_miss_reach(pieces.widths, distances)
    _check_pieces(blocks, pieces, distances)
    return find_contacts(pieces.solids, pieces.owner, distances, rules=rules, reach=reach)


def _check_pieces(blocks: Sequence[Block], pieces: BlockPieces, distances: Array) -> None:
    """Refuse pieces of one block that overlap.

    Their volumes are added up, so that they may only touch.

    Parameters
    ----------
    blocks : for their names
    pieces : of all of them
    distances : up to which faces of every block touch [m], shape (n_blocks,)
    """
    owner = pieces.owner
    # pieces that are not alone in their block
    rows = np.flatnonzero(np.bincount(owner)[owner] > 1)
    if not len(rows):
        return
    # each taken as a block of its own, since contacts are found between blocks
    among = find_contacts([pieces.solids[i] for i in rows], np.arange(len(rows)), distances[owner[rows]])
    for i, j, depth in among.overlaps:
        if owner[rows[i]] == owner[rows[j]]:
            raise InputError(
                f"two pieces of block {blocks[owner[rows[i]]].name!r} overlap by {depth:.3g} m; the convex "
                "pieces of a block must fill it without overlapping"
            )


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
