"""Contacts of the blocks of an assembly: which tolerance holds, and what was found.

What is said of contacts, and of blocks that overlap or float, is in ``contact_warnings``.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.constants import RELATIVE_TOLERANCE
from limitmason.errors import InputError
from limitmason.geometry.contact import NEAR, ContactPatches, ContactRules, DoubtfulContact, find_contacts
from limitmason.geometry.convex_parts import convex_parts, is_convex, largest_skew
from limitmason.geometry.polyhedron import Solid, check_closed, check_solids, least_widths, mass_properties
from limitmason.model.block import Block

_ROUNDING = 1e-9  # of a solid's size: chosen, far above the rounding of coordinates and far below a gap


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
    _check_pieces(blocks, pieces, rules)
    return _found(pieces, rules)


def doubts_between(blocks: Sequence[Block], rules: ContactRules) -> tuple[DoubtfulContact, ...]:
    """Doubts between blocks whose shapes are known to be right.

    ``rules`` say what counts as a contact.
    """
    return tuple(_found(pieces_of(blocks), rules).doubts)


def _found(pieces: BlockPieces, rules: ContactRules) -> ContactPatches:
    """Contacts, overlaps and doubts of sound convex pieces of blocks; ``rules`` say what counts as a contact."""
    distances = contact_distances(pieces.widths, rules)
    reach = near_miss_reach(pieces.widths, distances)
    return find_contacts(pieces.solids, pieces.owner, distances, rules=rules, reach=reach)


def _check_pieces(blocks: Sequence[Block], pieces: BlockPieces, rules: ContactRules) -> None:
    """Refuse pieces of one block that overlap.

    Their volumes are added up, so that they may only touch.

    Parameters
    ----------
    blocks : for their names
    pieces : of all of them
    rules : their distance says what touches
    """
    owner = pieces.owner
    rows = np.flatnonzero(np.bincount(owner)[owner] > 1)
    if not len(rows):
        return
    # contacts are found between blocks: each piece counts as one, and those of two blocks are among them
    distances = contact_distances(pieces.widths, rules)[owner[rows]]
    for i, j, depth in find_contacts([pieces.solids[i] for i in rows], np.arange(len(rows)), distances).overlaps:
        if owner[rows[i]] == owner[rows[j]]:
            raise InputError(
                f"two pieces of block {blocks[owner[rows[i]]].name!r} overlap by {depth:.3g} m; the convex "
                "pieces of a block must fill it without overlapping"
            )
