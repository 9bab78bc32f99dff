"""The leading course of a bond: the order of its units from end to end, and what fills the length they leave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from limitmason.errors import InputError

BONDS = ("running", "header", "english", "flemish")

TOLERANCE = 1e-9  # of the unit length: only rounding, no piece of masonry is that short

_LEAST_LAP = 0.25  # of a unit, chosen: joints of a corner unit keep it from the joint of the lapping course
_WIDEST_HEADER = 1.25  # of a header's width, chosen: a wider piece of a Flemish course is a cut stretcher
_MIDDLE = 0.1  # of a piece's length, chosen: one whose centre is off the run's middle by less lies in the middle

# a unit before it has a place: length along the wall [m], and whether it goes through the whole thickness
Size = tuple[float, bool]


@dataclass(frozen=True)
class Bond:
    """One bond: what units a course is made of, and how far it laps the one below.

    Parameters
    ----------
    name : one of ``BONDS``
    pitch : length of its longest unit along the wall [m]
    module : units that a leading course repeats
    header_width : width of a unit that lies across the wall [m]
    staggering : overlap of a unit over the one below [m]
    leaves : units side by side in the thickness of the wall
    thickness : of the wall [m]
    min_piece : pieces shorter than this are not laid [m]
    """

    name: str
    pitch: float
    module: tuple[Size, ...]
    header_width: float
    staggering: float
    leaves: int
    thickness: float
    min_piece: float

    @property
    def tolerance(self) -> float:
        """Length below which two positions are the same [m]."""
        return TOLERANCE * self.pitch


class Piece(NamedTuple):
    """A position of a course, filled by one unit or by one in every leaf.

    ``start`` and ``end`` are along the wall [m]. A ``header`` is one unit through the whole thickness.
    """

    start: float
    end: float
    header: bool


class Leading(NamedTuple):
    """The leading course, with the sense in which each piece was laid.

    A sense is +1 for a piece laid from its start on, -1 from its end on, 0 for one in the middle, laid from both.
    """

    pieces: tuple[Piece, ...]
    senses: tuple[int, ...]


class Ends(NamedTuple):
    """What bounds a run, and what meets it between.

    `start` and `end` are the thickness of the wall that crosses there [m], 0 at a free end.

    `crossing` is (u0, u1) [m] of a T junction, or None.
    """

    start: float = 0.0
    end: float = 0.0
    crossing: tuple[float, float] | None = None


def leading_course(bond: Bond, length: float, ends: Ends) -> Leading:
    """Return the course that covers the whole run.

    It is symmetric whenever the ends of the run are alike.

    Parameters
    ----------
    bond : that it is laid in
    length : of the run [m]
    ends : thickness of the walls that cross at its start and end [m], 0 for a free end, and the span of a T junction
    """
    # from the axis of a T outwards, cut pieces at the ends
    if ends.crossing is not None:
        middle = 0.5 * (ends.crossing[0] + ends.crossing[1])
        core = _core(bond, ends.crossing[1] - ends.crossing[0])
        half = 0.5 * sum(size for size, _ in core)
        left = _sequence(bond, middle - half)
        right = _sequence(bond, length - middle - half)
        senses = [0] if len(core) == 1 else [-1, 1]
        return _place(length, [*left[::-1], *core, *right], [-1] * len(left) + senses + [1] * len(right))
    # from both corners inwards, cut pieces in the middle
    if ends.start and ends.end:
        first, last = _lead(bond, ends.start), _lead(bond, ends.end)
        used = sum(size for size, _ in first + last)
        if used > length + bond.tolerance:
            raise InputError(f"length {length:g} m is too short for interlocking corners at both ends")
        return _place(length, *_symmetric(bond, first, last, length - used))
    # a corner at the end: the mirror image of one at the start
    if ends.end:
        mirrored = leading_course(bond, length, Ends(start=ends.end, end=0.0))
        pieces = tuple(Piece(length - p.end, length - p.start, p.header) for p in mirrored.pieces[::-1])
        return Leading(pieces, tuple(-s for s in mirrored.senses[::-1]))
    first = _lead(bond, ends.start) if ends.start else []
    rest = _sequence(bond, length - sum(size for size, _ in first))
    return _place(length, first + rest, [1] * (len(first) + len(rest)))


def _place(length: float, sizes: list[Size], senses: list[int]) -> Leading:
    """The leading course with its pieces in their places.

    The last one ends exactly at the end of the run.

    Parameters
    ----------
    length : of the run [m]
    sizes : length [m] of every piece, and whether it is a header
    senses : in which each was laid: 1 from its start, -1 from its end, 0 in the very middle
    """
    pieces, position = [], 0.0
    for index, (size, header) in enumerate(sizes):
        end = length if index == len(sizes) - 1 else position + size
        pieces.append(Piece(position, end, header))
        position = end
    return Leading(tuple(pieces), tuple(senses))


def _sequence(bond: Bond, length: float) -> list[Size]:
    """Sizes of the units that cover a length [m], in the order of the bond's module.

    The last unit is cut; one that would be too short is merged with that before it.
    """
    sizes: list[Size] = []
    position, index = 0.0, 0
    while length - position > bond.tolerance:
        size, header = bond.module[index % len(bond.module)]
        size = min(size, length - position)
        if sizes and size < bond.min_piece - bond.tolerance:
            sizes[-1] = (sizes[-1][0] + size, sizes[-1][1])
        else:
            sizes.append((size, header))
        position, index = position + size, index + 1
    return sizes


def _lead(bond: Bond, crossing: float) -> list[Size]:
    """Unit that the leading course puts at a corner before its regular ones, or none.

    The lapping course has a joint at the inner face of the crossing wall. Where the regular joints come within a
    quarter of a unit of it, the first unit is cut so that they lap it properly. A cut corner unit of a thick wall goes
    through as a header.

    Parameters
    ----------
    bond : that the course is laid in
    crossing : thickness of the wall that crosses at the corner [m]
    """
    past = crossing / bond.pitch
    # the first regular joint stands one unit from the corner
    nearest = abs(past - max(round(past), 1))
    if bond.name != "flemish" and nearest >= _LEAST_LAP - TOLERANCE:
        return []
    # the face of the crossing wall then stands over the middle of a unit
    size = (crossing - bond.pitch / 2.0) % bond.pitch
    return [(size, bond.leaves > 1 or bond.name == "header")]


def _core(bond: Bond, crossing: float) -> list[Size]:
    """Units centred on a wall that meets the run in a T.

    There is one, or two with their joint on the axis of that wall: whichever keeps the joints farther from the faces of
    the crossing wall, where the lapping course stops.

    Parameters
    ----------
    bond : that the course is laid in
    crossing : thickness of the wall that meets the run [m]

    Returns
    -------
    list
        Length along the run [m] of every unit, and whether it is a header.
    """
    if bond.name == "flemish":
        return [(bond.header_width, True)]
    face = crossing / (2.0 * bond.pitch)  # from the axis to a face of the crossing wall, in units
    # joints of one unit stand 1/2, 3/2, ... from the axis, those of two 0, 1, 2, ...
    one_clears = abs(face - max(round(face - 0.5), 0) - 0.5)
    two_clear = abs(face - round(face))
    number = 1 if one_clears >= two_clear - TOLERANCE else 2  # where both clear it alike, one, whatever the last bit
    _, header = bond.module[0]
    return [(bond.pitch, header)] * number


def _symmetric(
    bond: Bond, first: list[Size], last: list[Size], length: float
) -> tuple[list[Size], list[int]]:
    """Fill the length between two corners symmetrically.

    Whole units stand outside and, where needed, cut ones in the middle.

    Returned are the units, and in which sense each is laid: 1 from the start, -1 from the end, 0 in the very middle. No
    cut unit is shorter than half a unit, so that a lapping joint over its middle keeps a quarter on both sides.

    Parameters
    ----------
    bond : that the course is laid in
    first, last : pieces laid at the corners, length [m] and whether each is a header
    length : between them [m]
    """
    middle = _fill_flemish(bond, length) if bond.name == "flemish" else _fill(bond, length)
    sizes = [*first, *middle, *last]
    total = sum(size for size, _ in sizes)
    senses, position = [], 0.0
    for size, _ in sizes:
        # from the middle of the run
        centre = position + 0.5 * size - 0.5 * total
        senses.append(0 if abs(centre) < _MIDDLE * size else (1 if centre < 0.0 else -1))
        position += size
    # with a joint in the very middle and a short staggering, one lapping unit over it would be far too long
    if 0 not in senses and 2.0 * (bond.pitch - bond.staggering) > bond.pitch + bond.min_piece:
        turn = senses.index(-1) if -1 in senses else 0  # first unit that is laid from the end
        # the two units at that joint are laid as middle ones, lapped from both ends
        if turn:
            senses[turn - 1] = senses[turn] = 0
    return sizes, senses


def _fill(bond: Bond, length: float) -> list[Size]:
    """Pieces that fill a length [m] between two corners.

    Whole units of the bond stand around one or two cut ones.

    A rest shorter than half a unit is not laid by itself: with one whole unit it makes two equal pieces.
    """
    pitch, header = bond.pitch, bond.module[0][1]
    whole = int((length + bond.tolerance) / pitch)
    rest = length - whole * pitch
    if rest <= bond.tolerance:
        return [(pitch, header)] * whole
    if whole == 0:
        return [(length, header)]
    if rest >= pitch / 2.0 and whole % 2 == 0:
        cuts = [rest]
    else:  # too short by itself, or beside the middle: two pieces keep the course symmetric
        whole, rest = whole - 1, rest + pitch
        cuts = [rest / 2.0] * 2
    side = whole // 2
    centre = [cuts[0], pitch, cuts[-1]] if whole % 2 else cuts
    return [(size, header) for size in [pitch] * side + centre + [pitch] * side]


def _fill_flemish(bond: Bond, length: float) -> list[Size]:
    """Pieces of a Flemish bond that fill a length [m] between two corners.

    Stretcher, header, ..., stretcher, with cut stretchers (bats) in the middle where the length needs them. The course
    is symmetric: ``side``, a middle of whole and cut units, and the mirrored side.
    """
    stretcher, header = bond.pitch, bond.header_width
    module = stretcher + header
    # how often header and stretcher follow on a first stretcher
    turns = int((length - stretcher + bond.tolerance) / module)
    if length < stretcher - bond.tolerance:
        return [(length, False)]
    rest = length - stretcher - turns * module
    s, h = (stretcher, False), (header, True)
    if rest <= bond.tolerance:
        return [s, *[h, s] * turns]
    # an even number of turns leaves a stretcher in the middle to be cut, an odd one a header to keep or to widen
    if turns % 2 == 0:
        side, spare = [s, h] * (turns // 2), stretcher + rest
        # bats are no longer than a stretcher
        if spare <= 2.0 * stretcher:
            centre = [(spare / 2.0, False)] * 2
        else:
            bat = ((spare - header) / 2.0, False)
            centre = [bat, h, bat]
        return [*side, *centre, *side[::-1]]
    side = [s, h] * ((turns - 1) // 2)
    if rest < header:
        # the stretchers beside the middle header take half the rest each, as two bats each
        bat = ((stretcher + rest / 2.0) / 2.0, False)
        centre = [bat, bat, h, bat, bat]
    elif rest <= stretcher:
        # the middle header and the rest make two bats
        bat = ((header + rest) / 2.0, False)
        centre = [s, bat, bat, s]
    else:
        # room for a second header, and a bat between the two
        centre = [s, h, (rest - header, False), h, s]
    return [*side, *centre, *side[::-1]]


def is_header(bond: Bond, size: float) -> bool:
    """Whether a piece of the lapping course goes through the wall as one unit.

    Parameters
    ----------
    bond : that the course is laid in
    size : length of the piece along the wall [m]
    """
    if bond.name in ("header", "english"):
        return True
    if bond.name == "flemish":
        return size <= _WIDEST_HEADER * bond.header_width + bond.tolerance
    return False
